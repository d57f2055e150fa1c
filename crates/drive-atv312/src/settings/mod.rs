//! The settings that decide what a command means in this drive. They are read once, block by block, and forgotten with
//! [`forget`](drive_core::Drive::forget): what the control word's bits do, where command and reference come from, what
//! replaces a reference, the limits.

mod instead;
mod reading;

use drive_core::{
    Absent, Identity, Recognised, Speed, StopMode,
    registers::{Register, access::Kind},
};
use drive_drivecom::{self as drivecom, StopWord};

use crate::{
    ramp::Ramp,
    reading::Resolution,
    registers::{CCS, CD1, CD2, CHCF, DCI, FR1, FR2, FST, RFC, STT, address},
    words::{AccessLevel, ControlWord},
};

pub(crate) use reading::Controls;

/// `Fr1`, `Fr2` = Mdb.
pub(crate) const REFERENCE_BY_MODBUS: u16 = 164;
/// `Cd1`, `Cd2` = Mdb.
pub(crate) const COMMAND_BY_MODBUS: u16 = 10;
/// `CHCF` = SEP.
pub(crate) const SEPARATE: u16 = 2;
/// `rFC` = Fr1.
pub(crate) const REFERENCE_1: u16 = 96;
/// `rFC` = Fr2.
const REFERENCE_2: u16 = 97;
/// Cd11, bit 11 of the control word, in the functions' assignments; Cd12 to Cd15 follow.
const CD11: u16 = 171;
/// C111, bit 11 of the Modbus control word, in `rFC` and `CCS`; C112 to C115 follow.
const C111: u16 = 187;
/// LI1 in every assignment; LI2 to LI6 follow.
pub(crate) const LI1: u16 = 129;
/// Cd13: bit 13 in the functions' assignments.
pub(crate) const CD13: u16 = CD11 + 2;
/// Cd14.
pub(crate) const CD14: u16 = CD11 + 3;

/// A block of consecutive settings, and when it counts.
type Block = (u16, u16, When);

/// When a setting counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum When {
    Always,
    /// At access level L3.
    AtL3,
    /// At access level L3, where a bit of the control word switches the command channel.
    Switched,
}
use When::{Always, AtL3, Switched};

/// Every setting that is read, those that decide a stop first, and of these the ones that say whose the command is. No list of the manual has
/// the words between the blocks.
const BLOCKS: &[Block] = &[
    (address::LAC, 1, Always),
    (address::CCS, 1, AtL3),
    (address::CD1, span(address::CD1, address::CD2), Switched),
    (address::CHCF, 1, Switched),
    (address::RFC, 1, AtL3),
    (address::FR1, span(address::FR1, address::FR2), AtL3),
    // Stt, nSt, dCI, FSt.
    (address::STT, span(address::STT, address::FST), Always),
    (address::RPS, 1, AtL3),
    (address::LC2, 1, AtL3),
    (address::ETF, 1, AtL3),
    (address::CHP, 1, AtL3),
    (address::PR2, span(address::PR2, address::PR4), AtL3),
    (address::PS2, span(address::PS2, address::PS16), Always),
    (address::SA2, span(address::SA2, address::SA3), Always),
    (address::PIF, 1, Always),
    (address::JOG, 1, Always),
    (address::ATR, 1, Always),
    (address::LFL, 1, Always),
    (address::ADC, 1, Always),
];
/// The blocks that say by which bit of the bus the command is switched, if by any: who has the reference has it too unless `CHCF` = SEP.
const FOR_THE_COMMAND: usize = 4;
/// The blocks that decide a stop: at L1 and L2, and at L3, where any bit above the chart's may have got another meaning.
const FOR_A_STOP: (usize, usize) = (7, 13);
/// The blocks of what takes the place of a reference of the bus, or is added to it, whichever channel gives it.
const REPLACE_A_REFERENCE: &[u16] = &[address::PS2, address::SA2, address::PIF, address::JOG, address::LFL];
/// The functions that a bit of the control word can be assigned to, besides the stops.
const FUNCTIONS: [u16; 10] = [
    address::RPS,
    address::LC2,
    address::ETF,
    address::CHP,
    address::PR2,
    address::PR4,
    address::PS2,
    address::PS4,
    address::PS8,
    address::PS16,
];

/// Everything that is read once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Known {
    pub(crate) resolution: Option<Resolution>,
    pub(crate) settings: Settings,
    pub(crate) ramp: Ramp,
    /// Whether it is an Altivar 312, once it was asked.
    pub(crate) kind: Option<Recognised>,
    /// What it has said of its size.
    pub(crate) size: Option<Identity>,
    /// The registers that this drive lacks.
    pub(crate) absent: Absent,
    pub(crate) speeds: Option<(Speed, Speed)>,
    /// The input that inhibits every fault, by `InH`, as it was read last.
    pub(crate) inhibits: Option<u16>,
    /// Whether a status was read since, so that the next one has time for a setting.
    pub(crate) seen: bool,
}

/// The settings, as far as they were read.
#[derive(Debug, Clone, Default)]
pub(crate) struct Settings {
    words: Vec<(u16, u16)>,
    /// Blocks that were read, or passed over.
    blocks: usize,
    /// The drive has refused one: it is asked for again only by a command that needs it.
    refused: bool,
}

impl Settings {
    pub(crate) fn word<A: Kind>(&self, register: Register<A>) -> u16 {
        self.at(register.address()).unwrap_or(0)
    }

    fn at(&self, address: u16) -> Option<u16> {
        self.words.iter().find(|(at, _)| *at == address).map(|&(_, word)| word)
    }

    pub(crate) fn level(&self) -> Option<AccessLevel> {
        self.at(address::LAC).map(AccessLevel::from)
    }

    pub(crate) fn is_complete(&self) -> bool {
        self.next_block().is_none()
    }

    /// Whether a block is not known yet that the drive has not refused.
    pub(crate) fn can_learn(&self) -> bool {
        !self.refused && !self.is_complete()
    }

    /// How many blocks there are.
    pub(crate) const fn blocks(&self) -> usize {
        BLOCKS.len()
    }

    /// Which blocks count: those of L3, and those of a command channel that is switched by the bus.
    fn selects(&self) -> (bool, bool) {
        let at_l3 = self.level() == Some(AccessLevel::L3);
        (at_l3, at_l3 && self.word(CCS).checked_sub(C111).is_some_and(|bit| bit < 5))
    }

    fn next_block(&self) -> Option<(usize, Block)> {
        let (at_l3, switched) = self.selects();
        let mut left = (0..).zip(BLOCKS.iter().copied()).skip(self.blocks);
        left.find(|(_, (_, _, when))| match when {
            Always => true,
            AtL3 => at_l3,
            Switched => switched,
        })
    }

    /// Whether the words that stop are known.
    pub(crate) fn knows_stop(&self) -> bool {
        match self.level() {
            None => false,
            Some(AccessLevel::L1 | AccessLevel::L2) => self.blocks >= FOR_A_STOP.0,
            Some(AccessLevel::L3) => self.blocks >= FOR_A_STOP.1,
            Some(AccessLevel::Unknown(_)) => true,
        }
    }

    /// Whether it is known which bit of the bus switches the command.
    fn knows_command(&self) -> bool {
        self.level() == Some(AccessLevel::L3) && self.blocks >= FOR_THE_COMMAND
    }

    /// What stops this drive in a mode, by the control word without the bits that have another function.
    pub(crate) fn stop(&self, mode: StopMode) -> StopWord {
        const UNREAD: &str = "the settings that decide what the control word does were not read yet";
        let by = |word: ControlWord, mode, instead| StopWord { word: word.bits(), mode, instead };
        let fast = |instead| {
            let word = if self.acts(ControlWord::FAST_STOP) {
                ControlWord::enabled_stop(StopMode::Fast)
            } else {
                None
            };
            let word = word.unwrap_or(ControlWord::from_bits_retain(drivecom::QUICK_STOP));
            by(word, StopMode::Fast, instead)
        };
        let Some(enabled) = ControlWord::enabled_stop(mode) else {
            return by(ControlWord::from_bits_retain(drivecom::DISABLE_VOLTAGE), mode, None);
        };
        if mode == StopMode::Fast {
            return fast(None);
        }
        if !self.knows_stop() {
            return fast(Some(UNREAD));
        }
        if mode == StopMode::DcInjection && self.acts(ControlWord::DC_INJECTION) {
            return by(enabled, mode, None);
        }
        let normal = ControlWord::run(drive_core::Direction::Forward) | ControlWord::STOP;
        match self.normal_stop() {
            Ok((selected, _)) if selected == mode => by(normal, mode, None),
            // Injection takes the place of no other stop.
            Ok((StopMode::DcInjection, why)) => fast(Some(why)),
            Ok((selected, why)) => {
                let lacks = "with LAC = L3 bit 13 of CMD brakes only where dCI is set to Cd13";
                by(normal, selected, Some(if mode == StopMode::DcInjection { lacks } else { why }))
            }
            Err(why) => fast(Some(why)),
        }
    }

    /// What bit 12 does, and the words for it where that is no ramp; or why it does nothing.
    fn normal_stop(&self) -> Result<(StopMode, &'static str), &'static str> {
        if matches!(self.level(), None | Some(AccessLevel::Unknown(_))) {
            return Err("the access level LAC is none that the manual lists");
        }
        if self.others().contains(ControlWord::STOP) {
            return Err("a function is assigned to bit 12 of CMD, so 100Fh does not stop");
        }
        Ok(match self.word(STT) {
            0 => (StopMode::Ramp, "Stt makes the normal stop a ramp"),
            1 => (StopMode::Fast, "Stt makes the normal stop a fast stop"),
            2 => (StopMode::Freewheel, "Stt makes the normal stop a freewheel stop"),
            3 => (StopMode::DcInjection, "Stt makes the normal stop a DC injection stop"),
            _ => return Err("Stt holds a stop type that the manual does not list"),
        })
    }

    /// How the drive stops when a run command goes, where that is known.
    pub(crate) fn known_stop(&self) -> Option<StopMode> {
        let known = self.knows_stop() && self.at(address::STT).is_some();
        self.normal_stop().ok().map(|(mode, _)| mode).filter(|_| known)
    }

    /// Whether a logic input injects direct current.
    pub(crate) fn injects_by_input(&self) -> bool {
        self.word(DCI).checked_sub(LI1).is_some_and(|bit| bit < 6)
    }

    /// Whether the fast stop or the injection acts by its bit.
    fn acts(&self, bit: ControlWord) -> bool {
        let assigned = if bit == ControlWord::FAST_STOP { (FST, CD14) } else { (DCI, CD13) };
        match self.level() {
            _ if !self.knows_stop() => false,
            Some(AccessLevel::L1 | AccessLevel::L2) => true,
            Some(AccessLevel::L3) => self.word(assigned.0) == assigned.1 && !self.others().contains(bit),
            _ => false,
        }
    }

    /// The bits 11 to 15 that do something else than to reverse and to stop by bits 12, 13 and 14: at L3 only.
    pub(crate) fn others(&self) -> ControlWord {
        // A stop by another bit than the usual one.
        let stops = [(FST, CD14), (DCI, CD13)].map(|(stop, usual)| (self.word(stop), usual));
        let stops = stops.into_iter().filter(|(bit, usual)| bit != usual).map(|(bit, _)| bit);
        self.bits(CD11, stops) | self.functions()
    }

    /// The bits that have another function than the usual one, or may have as long as that was not read.
    pub(crate) fn assignable(&self) -> u16 {
        const ABOVE_THE_CHART: u16 = 0xF800;
        if self.knows_stop() { self.functions().bits() } else { ABOVE_THE_CHART }
    }

    /// The bits that a function or a switch between channels is assigned to.
    fn functions(&self) -> ControlWord {
        let switches = [RFC, CCS].into_iter().map(|switch| self.word(switch));
        self.bits(CD11, FUNCTIONS.iter().filter_map(|&function| self.at(function)))
            | self.bits(C111, switches)
    }

    fn bits(&self, bit_11: u16, sources: impl Iterator<Item = u16>) -> ControlWord {
        let assigned = sources.filter_map(|source| source.checked_sub(bit_11)).filter(|&bit| bit < 5);
        let bits = assigned.fold(0, |bits, bit| bits | 1 << (11 + bit));
        ControlWord::from_bits_retain(if self.level() == Some(AccessLevel::L3) { bits } else { 0 })
    }

    /// The bits with another function that a control word must carry, so that it does only what its name says: as the drive
    /// holds them, and those that switch the channels towards the bus.
    pub(crate) fn kept(&self, held: u16) -> u16 {
        match self.level() {
            Some(AccessLevel::L1 | AccessLevel::L2) => return 0,
            Some(AccessLevel::L3) if self.knows_command() => {}
            _ => return held,
        }
        let mut kept = if self.knows_stop() { held & self.functions().bits() } else { held };
        let command = if self.word(CHCF) == SEPARATE {
            self.towards_bus(CCS, [CD1, CD2], COMMAND_BY_MODBUS)
        } else {
            None
        };
        let reference = self.towards_bus(RFC, [FR1, FR2], REFERENCE_BY_MODBUS);
        for (bit, set) in [reference, command].into_iter().flatten() {
            kept = if set { kept | bit } else { kept & !bit };
        }
        kept
    }

    /// The bit that switches between two channels of which one is the bus, and its value for the bus.
    fn towards_bus<A: Kind, B: Kind>(
        &self,
        switch: Register<A>,
        channels: [Register<B>; 2],
        bus: u16,
    ) -> Option<(u16, bool)> {
        let bit = self.word(switch).checked_sub(C111).filter(|&bit| bit < 5)?;
        let [first, second] = channels.map(|channel| self.word(channel) == bus);
        (first != second).then_some((1 << (11 + bit), second))
    }

    /// A control word as it would be at level L1: without the bits that have another function here.
    pub(crate) fn meaning(&self, held: u16) -> ControlWord {
        ControlWord::from_bits_retain(held) - self.others()
    }
}

/// Words from one address to another, both included.
const fn span(first: u16, last: u16) -> u16 {
    last - first + 1
}
