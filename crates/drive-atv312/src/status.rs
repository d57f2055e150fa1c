//! The fast set: W3201 to W3207 in one request, and what they say.
//!
//! The block ends before W3208, which no list of the manual has: what a read across it answers is not printed, and the
//! fast set needs nothing behind it.

use drive_core::{
    Control, Current, Frequency, RawWord, Refusal, State, Status,
    drivecom::ChartState,
    registers::{Register, access::Kind},
};

use crate::{
    registers::{CMD, ETA, ETI, FRH, LCR, OTR, RFR, ULN},
    words::{ControlWord, ExtendedStatus, StatusWord},
};

/// First word and number of words.
pub(crate) const BLOCK: (u16, u16) = (ETA.address(), 7);

/// The mnemonics of the block in its order.
const CODES: [&str; 7] = [
    ETA.row().code,
    RFR.row().code,
    FRH.row().code,
    LCR.row().code,
    OTR.row().code,
    ETI.row().code,
    ULN.row().code,
];

/// What a count of `rFr`, `LFr`, `LFRD` and `RFRD` is, by bit 9 of `CMI` (p. 16, 19 and 21).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Resolution {
    /// 0.1 Hz and 1 rpm.
    Normal,
    /// 32767 for 600 Hz.
    High,
}

impl Resolution {
    /// The magnitude of a signed frequency word.
    pub(crate) const fn frequency(self, word: u16) -> Frequency {
        let counts = word.cast_signed().unsigned_abs();
        match self {
            Self::Normal => Frequency::from_decihertz(counts),
            Self::High => Frequency::from_centihertz((counts as u32 * 60_000 + 16_383) / 32_767),
        }
    }

    /// The word for a frequency, if there is one that reads back as this very frequency.
    pub(crate) fn word(self, frequency: Frequency) -> Option<u16> {
        match self {
            Self::Normal => frequency.exact_decihertz(),
            Self::High => {
                let counts = (u64::from(frequency.centihertz()) * 32_767 + 30_000) / 60_000;
                let word = u16::try_from(counts).ok().filter(|&word| word <= i16::MAX.unsigned_abs())?;
                (self.frequency(word) == frequency).then_some(word)
            }
        }
    }

    /// The step of a frequency setpoint, for errors.
    pub(crate) const fn step(self) -> &'static str {
        match self {
            Self::Normal => "0.1 Hz",
            Self::High => "600/32767 Hz (CMI bit 9 is set)",
        }
    }
}

/// W3201 to W3207 as they were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FastWords {
    words: [u16; CODES.len()],
}

impl FastWords {
    /// From the block; `None` when it has another length.
    pub(crate) fn of(block: &[u16]) -> Option<Self> {
        block.try_into().ok().map(|words| Self { words })
    }

    /// From a status that was made of them.
    pub(crate) fn in_status(status: &Status) -> Self {
        let mut words = [0; CODES.len()];
        for (word, address) in words.iter_mut().zip(BLOCK.0..) {
            *word = status.raw(address).unwrap_or(0);
        }
        Self { words }
    }

    pub(crate) fn word<A: Kind>(&self, register: Register<A>) -> u16 {
        let index = register.address().checked_sub(BLOCK.0).map(usize::from);
        index.and_then(|index| self.words.get(index)).copied().unwrap_or(0)
    }

    pub(crate) fn chart(&self) -> Option<ChartState> {
        ChartState::of(self.word(ETA))
    }

    pub(crate) fn eta(&self) -> StatusWord {
        StatusWord::from_bits_retain(self.word(ETA))
    }

    pub(crate) fn eti(&self) -> ExtendedStatus {
        ExtendedStatus::from_bits_retain(self.word(ETI))
    }

    /// Whether the output stage feeds the motor.
    pub(crate) fn is_turning(&self) -> bool {
        self.eti().contains(ExtendedStatus::MOTOR_RUNNING)
    }

    /// Who commands: ETA says whether local control is forced, ETI who it is otherwise.
    pub(crate) fn control(&self) -> Control {
        if self.eta().contains(StatusWord::NOT_FORCED_LOCAL) { self.eti().control() } else { Control::Local }
    }

    /// Why a setting cannot be changed now.
    pub(crate) fn refuses_settings(&self) -> Option<Refusal> {
        if self.eti().intersects(ExtendedStatus::MOTOR_RUNNING.union(ExtendedStatus::DC_INJECTION)) {
            return Some(Refusal::MotorRunning);
        }
        self.eti()
            .contains(ExtendedStatus::EEPROM_BUSY)
            .then_some(Refusal::Settings("ETI bit 0: the drive is saving its parameters to EEPROM"))
    }

    /// The status. `command` is the control word that the drive was last seen to hold, if any: in the state "operation
    /// enabled" these words alone do not tell a motor that slows down to stop from one that slows down to a lower
    /// setpoint, nor a stopped one from one that runs at a setpoint of zero.
    pub(crate) fn status(&self, resolution: Resolution, command: Option<ControlWord>) -> Status {
        let eta = self.eta();
        Status {
            state: self.state(command),
            direction: Some(eta.direction()),
            output_frequency: Some(resolution.frequency(self.word(RFR))),
            current: Some(Current::from_deciamperes(u32::from(self.word(LCR)))),
            current_share: None,
            at_reference: Some(eta.contains(StatusWord::REFERENCE_REACHED)),
            warning: Some(eta.contains(StatusWord::ALARM)),
            fault_code: None,
            control: Some(self.control()),
            raw: self.raw(),
        }
    }

    fn raw(&self) -> Vec<RawWord> {
        let words = (BLOCK.0..).zip(CODES).zip(self.words);
        words.map(|((address, code), value)| RawWord { address, code, value }).collect()
    }

    fn state(&self, command: Option<ControlWord>) -> State {
        match self.chart() {
            None => State::Unknown,
            Some(ChartState::NotReadyToSwitchOn) => State::NotReady,
            Some(ChartState::SwitchOnDisabled | ChartState::ReadyToSwitchOn) => State::Disabled,
            Some(ChartState::SwitchedOn) if self.is_turning() => State::Stopping,
            Some(ChartState::SwitchedOn) => State::Ready,
            Some(ChartState::OperationEnabled) => self.enabled(command),
            Some(ChartState::QuickStopActive) => State::QuickStop,
            Some(ChartState::FaultReactionActive) => State::FaultReaction,
            Some(ChartState::Fault) => State::Fault,
        }
    }

    fn enabled(&self, command: Option<ControlWord>) -> State {
        let command = command.filter(|_| self.control() == Control::Bus);
        let stopping = self.eti().intersects(ExtendedStatus::FAST_STOP.union(ExtendedStatus::DC_INJECTION))
            || command.is_some_and(ControlWord::is_stop);
        match (self.is_turning(), command) {
            (true, _) if stopping => State::Stopping,
            (true, _) => State::Running,
            (false, Some(command)) if command.is_run() => State::Running,
            (false, _) => State::Ready,
        }
    }

    /// Whether the drive itself shows that no run command acts: it has left "operation enabled", or there the motor
    /// stands, slows down or is braked.
    pub(crate) fn shows_stop(&self, keeps_enabled: bool) -> bool {
        const BRAKES: ExtendedStatus =
            ExtendedStatus::DECELERATING.union(ExtendedStatus::FAST_STOP).union(ExtendedStatus::DC_INJECTION);
        match self.chart() {
            None | Some(ChartState::NotReadyToSwitchOn) => false,
            Some(ChartState::OperationEnabled) => {
                keeps_enabled && (!self.is_turning() || self.eti().intersects(BRAKES))
            }
            Some(_) => true,
        }
    }
}

/// The raw form of the control word, for statuses that were confirmed by it.
pub(crate) const fn raw_command(value: u16) -> RawWord {
    RawWord { address: CMD.address(), code: CMD.row().code, value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(eta: u16, eti: u16) -> FastWords {
        FastWords::of(&[eta, 0, 0, 0, 0, eti, 0]).unwrap()
    }

    #[test]
    fn every_status_word_decodes_and_none_outside_the_table_is_called_a_known_state() {
        for eta in 0..=u16::MAX {
            for eti in [0x0000, 0x4000, 0x4010, 0xFFFF] {
                let status = words(eta, eti).status(Resolution::Normal, None);
                assert_eq!(status.state == State::Unknown, ChartState::of(eta).is_none(), "{eta:04X}h");
                assert_eq!(status.raw(3201), Some(eta));
            }
        }
    }

    #[test]
    fn at_high_resolution_a_frequency_is_taken_only_if_it_reads_back_as_itself() {
        let high = Resolution::High;
        assert_eq!(high.word(Frequency::from_hertz(600)), Some(32_767));
        assert_eq!(high.word(Frequency::ZERO), Some(0));
        assert_eq!(high.word(Frequency::from_hertz(601)), None);
        for centihertz in 0..=60_000 {
            let frequency = Frequency::from_centihertz(centihertz);
            if let Some(word) = high.word(frequency) {
                assert_eq!(high.frequency(word), frequency);
            }
        }
        for word in 0..=0x7FFF {
            assert_eq!(high.word(high.frequency(word)), Some(word), "every word is reachable");
        }
    }

    #[test]
    fn forced_local_mode_outranks_the_control_source() {
        assert_eq!(words(0x0227, 0x4000).control(), Control::Bus);
        assert_eq!(words(0x0027, 0x4000).control(), Control::Local);
    }
}
