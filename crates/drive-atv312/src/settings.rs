//! Settings that are read once, before what depends on them, and forgotten with
//! [`forget`](drive_core::Drive::forget): what the control word's bits do, where the reference comes from, the limits.

use drive_core::{Class, Frequency, Port, Refusal, Result, Speed, StopMode, drivecom};

use crate::{
    Atv312,
    registers::{CCS, CHP, CMI, ETF, FR1, FR2, LAC, LC2, PR2, PR4, PS2, PS16, RFC, RPS, SMIL, STT, TFR},
    status::Resolution,
    words::{AccessLevel, ExtendedControl, StopType},
};

/// `Fr1`, `Fr2` = Mdb.
pub(crate) const REFERENCE_BY_MODBUS: u16 = 164;
/// Cd11 in the functions' assignments; Cd12 to Cd15 follow.
const CD11: u16 = 171;
/// C111 (bit 11 of the Modbus control word) in `rFC` and `CCS`; C112 to C115 follow.
const C111: u16 = 187;
/// Cd13 and Cd14: bits 13 and 14.
pub(crate) const CD13: u16 = CD11 + 2;
/// Cd14.
pub(crate) const CD14: u16 = CD11 + 3;

/// Everything that is read once.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Known {
    pub(crate) resolution: Option<Resolution>,
    pub(crate) control: Option<ControlSettings>,
    pub(crate) frequencies: Option<(Frequency, Frequency)>,
    pub(crate) speeds: Option<(Speed, Speed)>,
}

/// What the control word does on this drive, and where its reference comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ControlSettings {
    pub(crate) level: AccessLevel,
    stop_type: StopType,
    dc_injection: u16,
    fast_stop: u16,
    /// Bits 11 to 15, at level L3: whether a function is assigned to them.
    assigned: [bool; 5],
    reference_by_bus: bool,
}

impl ControlSettings {
    /// Why the drive, as it is set up, cannot stop this way; `None` when it can.
    pub(crate) fn lacks(&self, mode: StopMode) -> Option<&'static str> {
        let standard = match self.level {
            AccessLevel::L1 | AccessLevel::L2 => true,
            AccessLevel::L3 => false,
            AccessLevel::Unknown(_) => return Some("the access level LAC is none that the manual lists"),
        };
        match mode {
            StopMode::Freewheel => None,
            StopMode::Ramp if !standard && self.assigned_bit(12) => {
                Some("a function is assigned to bit 12 of CMD, so 100Fh does not stop")
            }
            StopMode::Ramp => match self.stop_type {
                StopType::Ramp => None,
                StopType::Fast => Some("Stt makes the normal stop a fast stop"),
                StopType::Freewheel => Some("Stt makes the normal stop a freewheel stop"),
                StopType::DcInjection => Some("Stt makes the normal stop a DC injection stop"),
                StopType::Unknown(_) => Some("Stt holds a stop type that the manual does not list"),
            },
            StopMode::Fast => (!standard && self.fast_stop != CD14)
                .then_some("with LAC = L3 bit 14 of CMD stops only where FSt is set to Cd14"),
            StopMode::DcInjection => (!standard && self.dc_injection != CD13)
                .then_some("with LAC = L3 bit 13 of CMD brakes only where dCI is set to Cd13"),
        }
    }

    /// Why the drive, as it is set up, cannot be reversed by the control word.
    pub(crate) fn refuses_reverse(&self) -> Option<Refusal> {
        (self.level == AccessLevel::L3 && self.assigned_bit(11))
            .then_some(Refusal::Settings("a function is assigned to bit 11 of CMD, so it does not reverse"))
    }

    /// Why a reference from the bus would have no effect.
    pub(crate) fn refuses_reference(&self) -> Option<Refusal> {
        (self.level == AccessLevel::L3 && !self.reference_by_bus)
            .then_some(Refusal::Settings("with LAC = L3 the reference channel Fr1 (Fr2) must be Mdb"))
    }

    fn assigned_bit(&self, bit: usize) -> bool {
        bit.checked_sub(11).and_then(|index| self.assigned.get(index)).copied().unwrap_or(false)
    }
}

impl<P: Port> Atv312<P> {
    /// Bit 9 of `CMI`: one exchange once.
    pub(crate) async fn resolution(&mut self, class: Class) -> Result<Resolution> {
        if let Some(resolution) = self.known.resolution {
            return Ok(resolution);
        }
        let cmi = ExtendedControl::from_bits_retain(self.registers.at(class).read(CMI).await?);
        Ok(self.learn_resolution(cmi))
    }

    pub(crate) const fn learn_resolution(&mut self, cmi: ExtendedControl) -> Resolution {
        let high = cmi.contains(ExtendedControl::HIGH_RESOLUTION);
        let resolution = if high { Resolution::High } else { Resolution::Normal };
        self.known.resolution = Some(resolution);
        resolution
    }

    /// What the control word does: two exchanges once, at level L3 nine more, because there any of its bits 11 to 15
    /// may have got another meaning.
    pub(crate) async fn control_settings(&mut self, class: Class) -> Result<ControlSettings> {
        if let Some(settings) = self.known.control {
            return Ok(settings);
        }
        let mut calls = self.registers.at(class);
        let level = AccessLevel::from(calls.read(LAC).await?);
        // Stt, nSt, dCI, FSt.
        let [stt, _, dc_injection, fast_stop] = calls.read_array(STT.address()).await?;
        let mut settings = ControlSettings {
            level,
            stop_type: StopType::from(stt),
            dc_injection,
            fast_stop,
            assigned: [false; 5],
            reference_by_bus: false,
        };
        if level == AccessLevel::L3 {
            let mut functions = vec![settings.dc_injection, settings.fast_stop];
            for (first, count) in [
                (RPS.address(), 1),
                (LC2.address(), 1),
                (ETF.address(), 1),
                (CHP.address(), 1),
                (PS2.address(), span(PS2.address(), PS16.address())),
                (PR2.address(), span(PR2.address(), PR4.address())),
            ] {
                functions.extend(calls.read_words(first, count).await?);
            }
            let switching = [calls.read(RFC).await?, calls.read(CCS).await?];
            let references = calls.read_words(FR1.address(), span(FR1.address(), FR2.address())).await?;
            for (bit, assigned) in (0..).zip(&mut settings.assigned) {
                *assigned = functions.contains(&(CD11 + bit)) || switching.contains(&(C111 + bit));
            }
            settings.reference_by_bus = references.contains(&REFERENCE_BY_MODBUS);
        }
        self.known.control = Some(settings);
        Ok(settings)
    }

    /// `LSP` to `HSP`, both within `tFr`: the three follow each other, one exchange once.
    pub(crate) async fn frequency_limits(&mut self) -> Result<(Frequency, Frequency)> {
        if let Some(limits) = self.known.frequencies {
            return Ok(limits);
        }
        let words: [u16; 3] = self.registers.at(Class::Command).read_array(TFR.address()).await?;
        let [tfr, hsp, lsp] = words.map(Frequency::from_decihertz);
        let limits = (lsp, hsp.min(tfr));
        self.known.frequencies = Some(limits);
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
}

/// Words from one address to another, both included.
const fn span(first: u16, last: u16) -> u16 {
    last - first + 1
}
