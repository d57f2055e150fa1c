//! The settings that decide what a command means in this drive. They are read once, block by block, and forgotten with
//! [`forget`](drive_core::Drive::forget): what the control word's bits do, where command and reference come from, what
//! replaces a reference, the limits.

use drive_core::{
    Absent, Class, Error, ErrorKind, Frequency, Ground, Identity, Port, Recognised, Refusal, Result,
    SelfRestart, Speed, StopMode,
    registers::{Register, access::Kind},
};
use drive_drivecom::{self as drivecom, Limits, StopWord};

use crate::{
    Atv312,
    facts::{ANALOG_INPUTS, Facts, SILENT},
    ramp::Ramp,
    reading::Resolution,
    registers::{
        ATR, CCS, CD1, CD2, CHCF, CMD, DCI, FR1, FR2, FST, NST, PIF, RFC, SA2, SA3, SMIL, STT, TFR, address,
    },
    words::{AccessLevel, ControlWord, ExtendedControl},
};

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
const LI1: u16 = 129;
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

/// Every setting that is read, those that decide a stop first. No list of the manual has the words between the blocks.
const BLOCKS: &[Block] = &[
    (address::LAC, 1, Always),
    // Stt, nSt, dCI, FSt.
    (address::STT, span(address::STT, address::FST), Always),
    (address::CCS, 1, AtL3),
    (address::CD1, span(address::CD1, address::CD2), Switched),
    (address::CHCF, 1, Switched),
    (address::RFC, 1, AtL3),
    (address::FR1, span(address::FR1, address::FR2), AtL3),
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
    (address::ADC, 1, Always),
];
/// The blocks that decide a stop: at L1 and L2, and at L3, where any bit above the chart's may have got another meaning.
const FOR_A_STOP: (usize, usize) = (2, 13);
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
            Some(AccessLevel::L3) if self.knows_stop() => {}
            _ => return held,
        }
        let mut kept = held & self.functions().bits();
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

    /// Why the drive, as it is set up, cannot be reversed by the control word.
    pub(crate) fn refuses_reverse(&self) -> Option<Refusal> {
        self.others().contains(ControlWord::REVERSE).then_some(Refusal::Settings(
            "a function is assigned to bit 11 of CMD, so it does not reverse: free that bit",
        ))
    }

    /// Why a reference of the bus has no effect, whatever the inputs say.
    pub(crate) fn refuses_reference(&self) -> Option<Refusal> {
        const REMEDY: &str = "set Fr1 to Mdb and rFC to Fr1";
        if self.word(PIF) != 0 {
            return Some(Refusal::Overridden {
                by: "the PI regulator (PIF)",
                remedy: "set PIF to nO, or regulate by PISP",
            });
        }
        let by_bus = [FR1, FR2].map(|channel| self.word(channel) == REFERENCE_BY_MODBUS);
        let (usable, by) = match (self.level(), self.word(RFC)) {
            (Some(AccessLevel::L3), REFERENCE_1) => {
                (by_bus[0], "the reference channel Fr1, which is not Mdb,")
            }
            (Some(AccessLevel::L3), REFERENCE_2) => {
                (by_bus[1], "the reference channel Fr2, which is not Mdb,")
            }
            (Some(AccessLevel::L3), _) => {
                (by_bus.contains(&true), "a reference channel, Fr1 or Fr2, of which none is Mdb,")
            }
            _ => (true, ""),
        };
        (!usable).then_some(Refusal::Overridden { by, remedy: REMEDY })
    }

    /// Whether `rFC` selects Fr2 for good.
    pub(crate) fn has_second_reference(&self) -> bool {
        self.level() == Some(AccessLevel::L3) && self.word(RFC) == REFERENCE_2
    }

    /// Whether `rFC` leaves the selection to an input or a bit.
    pub(crate) fn switches_reference(&self) -> bool {
        ![REFERENCE_1, REFERENCE_2].contains(&self.word(RFC))
    }

    /// Whether the reference channel that is active, by bit 0 of `LRS3`, is the bus.
    pub(crate) fn refuses_channel(&self, second: bool) -> Option<Refusal> {
        let (channel, by) = if second {
            (FR2, "the reference channel Fr2, selected by rFC (LRS3 bit 0),")
        } else {
            (FR1, "the reference channel Fr1, selected by rFC (LRS3 bit 0),")
        };
        (self.level() == Some(AccessLevel::L3) && self.word(channel) != REFERENCE_BY_MODBUS).then_some(
            Refusal::Overridden { by, remedy: "set rFC so that the channel which is Mdb is selected" },
        )
    }

    /// Whether a logic input is assigned to a stop.
    pub(crate) fn has_stop_inputs(&self) -> bool {
        self.stop_inputs().next().is_some()
    }

    /// The stop that an input asks for: the freewheel stop and the fast stop while it is 0, the injection while it is 1
    /// (p. 40 and 41).
    pub(crate) fn stopped_by(&self, inputs: u16) -> Option<Refusal> {
        let asks = |(bit, level): (u16, bool)| (inputs >> bit & 1 == 1) == level;
        self.stop_inputs().any(asks).then_some(Refusal::Overridden {
            by: "a stop by a logic input (nSt, FSt or dCI)",
            remedy: "close the input of nSt or FSt, or open that of dCI",
        })
    }

    /// The bits of the inputs that stop, and the level at which they do.
    fn stop_inputs(&self) -> impl Iterator<Item = (u16, bool)> {
        let stops = [(self.word(NST), false), (self.word(FST), false), (self.word(DCI), true)];
        let bit = |source: u16| source.checked_sub(LI1).filter(|&bit| bit < 6);
        stops.into_iter().filter_map(move |(source, level)| Some((bit(source)?, level)))
    }

    /// Whether an input or a bit of the control word is assigned to a preset speed or to jog operation.
    pub(crate) fn has_presets(&self) -> bool {
        self.presets().any(|(_, source)| source != 0)
    }

    /// The preset speed or jog operation that is selected, by the logic inputs and the held control word.
    pub(crate) fn selected_preset(&self, inputs: u16, held: u16) -> Option<Refusal> {
        let is_on = |source: u16| {
            let bit = |first: u16, count: u16| source.checked_sub(first).filter(|&bit| bit < count);
            bit(LI1, 6).is_some_and(|bit| inputs >> bit & 1 == 1)
                || bit(CD11, 5).is_some_and(|bit| held >> (11 + bit) & 1 == 1)
        };
        let (function, _) = self.presets().find(|&(_, source)| is_on(source))?;
        Some(if function == address::JOG {
            Refusal::Overridden {
                by: "jog operation (JOG) by its input",
                remedy: "open the input, or set JOG to nO",
            }
        } else {
            Refusal::Overridden {
                by: "a preset speed (PS2 to PS16) by its input",
                remedy: "open the input, or set PS2 to PS16 to nO",
            }
        })
    }

    fn presets(&self) -> impl Iterator<Item = (u16, u16)> {
        let functions = [address::PS2, address::PS4, address::PS8, address::PS16, address::JOG];
        functions.into_iter().map(|function| (function, self.at(function).unwrap_or(0)))
    }

    /// What decides the reference instead of the bus, as far as settings and `facts` tell it: the settings, a preset speed, the
    /// other channel, a summing input.
    pub(crate) fn overrides(&self, facts: &Facts, held: u16) -> Option<Refusal> {
        const SUMMED: Refusal = Refusal::Overridden {
            by: "a summing input (SA2, AI2 as the drive leaves the factory, or SA3)",
            remedy: "set SA2 and SA3 to nO",
        };
        let preset = facts.inputs.and_then(|inputs| self.selected_preset(inputs, held));
        let second = facts.second.unwrap_or_else(|| self.has_second_reference());
        let channel = facts.second.and_then(|second| self.refuses_channel(second));
        // Only to reference 1 is something summed (p. 42).
        let adds = |source: &u16| match *source {
            0 => false,
            // What the potentiometer or another bus adds is not told.
            source => {
                !ANALOG_INPUTS.contains(&source)
                    || facts.analog.is_some_and(|inputs| {
                        let input = source.checked_sub(1).and_then(|input| inputs.get(usize::from(input)));
                        input.is_none_or(|input| input.cast_signed().unsigned_abs() > SILENT)
                    })
            }
        };
        let summed = (!second && self.summed().iter().any(adds)).then_some(SUMMED);
        self.refuses_reference().or(preset).or(channel).or(summed)
    }

    /// What is summed to reference 1.
    pub(crate) fn summed(&self) -> [u16; 2] {
        [SA2, SA3].map(|input| self.word(input))
    }

    /// The automatic restart, where it is switched on.
    pub(crate) fn self_restart(&self) -> Option<SelfRestart> {
        (self.word(ATR) != 0).then_some(SelfRestart {
            code: "Atr",
            meaning: "resets its fault and starts the motor again by itself, for as long as tAr says",
        })
    }
}

impl<P: Port> Atv312<P> {
    /// Bit 9 of `CMI`: one exchange once.
    pub(crate) async fn resolution(&mut self, class: Class) -> Result<Resolution> {
        match self.known.resolution {
            Some(resolution) => Ok(resolution),
            None => Ok(self.read_controls(class).await?.resolution()),
        }
    }

    /// Reads what is not known yet of the settings.
    pub(crate) async fn read_settings(&mut self, class: Class) -> Result<()> {
        while !self.known.settings.is_complete() {
            match self.read_setting(class).await {
                // Of so many readings one may be lost without the drive being so.
                Err(error) if error.kind() == ErrorKind::NoAnswer => self.read_setting(class).await?,
                read => read?,
            }
        }
        Ok(())
    }

    /// The settings, and anew those that say whose the reference is: whoever stands at the drive may have set them otherwise since they
    /// were read, and of a motor that stands no word tells it. Below L3 it is the level itself that may have changed.
    pub(crate) async fn read_channels(&mut self, class: Class) -> Result<()> {
        let channels: &[u16] = match self.known.settings.level() {
            Some(AccessLevel::L3) => &[address::RFC, address::FR1],
            _ => &[address::LAC],
        };
        self.read_again(class, channels).await
    }

    /// The settings, and anew those that decide what a command word does. A drive takes them while its motor stands alone, so that what is
    /// read for a start holds for its stop.
    pub(crate) async fn read_meanings(&mut self, class: Class) -> Result<()> {
        let blocks = BLOCKS.iter().take(FOR_A_STOP.1).map(|(first, ..)| *first);
        self.read_again(class, &blocks.collect::<Vec<_>>()).await
    }

    async fn read_again(&mut self, class: Class, blocks: &[u16]) -> Result<()> {
        if !self.known.settings.is_complete() {
            return self.read_settings(class).await;
        }
        let before = self.known.settings.selects();
        for (index, _) in BLOCKS.iter().enumerate().filter(|(_, (first, ..))| blocks.contains(first)) {
            match self.read_setting_again(class, index).await {
                // Of so many readings one may be lost without the drive being so.
                Err(error) if error.kind() == ErrorKind::NoAnswer => {
                    self.read_setting_again(class, index).await?;
                }
                read => read?,
            }
        }
        if self.known.settings.selects() != before {
            self.known.settings = Settings::default();
        }
        self.read_settings(class).await
    }

    /// Reads one block of the settings, for whoever has time; the drive is asked no more once it has refused one.
    pub(crate) async fn read_a_setting(&mut self, class: Class) {
        if !self.known.settings.refused
            && let Err(Error::Exception { .. }) = self.read_setting(class).await
        {
            self.known.settings.refused = true;
        }
    }

    pub(crate) async fn read_setting(&mut self, class: Class) -> Result<()> {
        let Some((index, block)) = self.known.settings.next_block() else { return Ok(()) };
        let words = self.read_block(class, block).await?;
        let settings = &mut self.known.settings;
        settings.words.extend(words);
        settings.blocks = index + 1;
        Ok(())
    }

    /// Reads a block of the settings that is known already, and remembers what is otherwise.
    pub(crate) async fn read_setting_again(&mut self, class: Class, index: usize) -> Result<()> {
        let settings = &self.known.settings;
        let known = |&&(first, ..): &&Block| settings.at(first).is_some();
        let Some(&block) = BLOCKS.get(index).filter(known) else { return Ok(()) };
        for (address, word) in self.read_block(class, block).await? {
            let known = self.known.settings.words.iter_mut().find(|(at, _)| *at == address);
            if let Some((_, known)) = known.filter(|(_, known)| *known != word) {
                *known = word;
                self.proof.watch.changes(Ground::Inputs);
            }
        }
        Ok(())
    }

    /// The words of a block that this drive has. A function that it does not have is assigned to nothing.
    async fn read_block(&mut self, class: Class, (first, count, _): Block) -> Result<Vec<(u16, u16)>> {
        let words = self.known.absent.read(&mut self.registers.at(class), first, count).await?;
        Ok((first..=u16::MAX).zip(words).filter_map(|(at, word)| Some((at, word?))).collect())
    }

    /// `LSP` to `HSP`, both within `tFr`: the three follow each other, one exchange where they were not read lately.
    pub(crate) async fn frequency_limits(&mut self) -> Result<Limits> {
        match self.proof.fresh_limits().flatten() {
            Some(limits) => Ok(limits),
            None => self.read_frequency_limits(Class::Command).await,
        }
    }

    pub(crate) async fn read_frequency_limits(&mut self, class: Class) -> Result<Limits> {
        let words: [u16; 3] = self.registers.at(class).read_array(TFR.address()).await?;
        let [tfr, hsp, lsp] = words.map(Frequency::from_decihertz);
        let limits = (lsp, hsp.min(tfr));
        if self.proof.take_limits(Some(limits)) {
            // The same limits in rpm.
            self.known.speeds = None;
        }
        Ok(limits)
    }

    /// `SMIL` and `SMAL`, the same limits in rpm: one exchange once.
    pub(crate) async fn speed_limits(&mut self) -> Result<(Speed, Speed)> {
        if let Some(limits) = self.known.speeds {
            return Ok(limits);
        }
        let limits = drivecom::speed_limits(&mut self.registers.at(Class::Command), SMIL).await?;
        self.known.speeds = Some(limits);
        Ok(limits)
    }

    /// `CMD`, `LFr`, `PISP` and `CMI` in one exchange.
    pub(crate) async fn read_controls(&mut self, class: Class) -> Result<Controls> {
        let [command, reference, _, cmi] = self.registers.at(class).read_array(CMD.address()).await?;
        // Of a word that stands as this side wrote it, the bits above are those that it has kept: what else it holds, such as the bit of a
        // stop that has another meaning since, was this side's.
        if self.proof.held() != Some(command) {
            self.hold(command);
        }
        self.proof.was_read(command, reference);
        let controls = Controls { command, reference, cmi: ExtendedControl::from_bits_retain(cmi) };
        self.take_extended(controls.cmi);
        Ok(controls)
    }
}

/// The control variables.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Controls {
    pub(crate) command: u16,
    /// `LFr`.
    pub(crate) reference: u16,
    pub(crate) cmi: ExtendedControl,
}

impl Controls {
    pub(crate) const fn resolution(&self) -> Resolution {
        Resolution::of(self.cmi)
    }
}

/// Words from one address to another, both included.
const fn span(first: u16, last: u16) -> u16 {
    last - first + 1
}
