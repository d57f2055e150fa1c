//! From words to a state: what FD01 says, in the terms that all families share.

use drive_core::{
    Control, Frequency, Percent, RawWord, State, Status,
    registers::{Register, access::Read},
};

use crate::{
    registers as map,
    words::{CommandSource, StatusWord},
};

/// What control and safety need, the most important first.
pub(crate) const FAST_SET: [Register<Read>; 3] =
    [map::STATUS_WORD, map::OUTPUT_FREQUENCY, map::OUTPUT_CURRENT];

/// The state that a status word tells, with the output frequency where it is known.
///
/// The manual has no table of states; the order here is that of severity: trip, emergency stop, run, output without
/// run, what keeps it from starting, standby.
pub(crate) fn state(word: StatusWord, output: Option<Frequency>) -> State {
    let turning = output.is_some_and(|frequency| frequency > Frequency::ZERO);
    if word.contains(StatusWord::TRIPPED) {
        return if turning { State::FaultReaction } else { State::Fault };
    }
    if word.contains(StatusWord::EMERGENCY_STOP) {
        return State::QuickStop;
    }
    // A run command without an output is none: ST = OFF or MOFF stands against it.
    let cut = word.contains(StatusWord::FREEWHEEL) && !turning;
    if word.contains(StatusWord::RUN) && !cut && !word.contains(StatusWord::UNDERVOLTAGE) {
        return State::Running;
    }
    if turning || word.contains(StatusWord::DC_BRAKING) {
        return State::Stopping;
    }
    if word.contains(StatusWord::UNDERVOLTAGE) || !word.contains(StatusWord::STANDBY) {
        return State::NotReady;
    }
    if word.contains(StatusWord::FREEWHEEL) { State::Disabled } else { State::Ready }
}

/// The status that these words of the fast set make.
pub(crate) fn status(raw: Vec<RawWord>) -> Status {
    let mut status = Status { raw, ..Status::default() };
    status.output_frequency =
        status.raw(map::OUTPUT_FREQUENCY.address()).map(|word| Frequency::from_centihertz(word.into()));
    status.current_share =
        status.raw(map::OUTPUT_CURRENT.address()).map(|word| Percent::from_hundredths(word.into()));
    let source = status.raw(map::COMMAND_SOURCE.address()).map(CommandSource::from);
    if let Some(word) = status.raw(map::STATUS_WORD.address()).map(StatusWord::from_bits_retain) {
        status.state = state(word, status.output_frequency);
        status.direction = Some(word.direction());
        status.warning = Some(word.contains(StatusWord::ALARM));
        status.control = control(word, source);
    }
    status
}

/// Who commands: FD01 tells only that it is not remote, FE45 who it is.
pub(crate) fn control(word: StatusWord, source: Option<CommandSource>) -> Option<Control> {
    let named = source.and_then(CommandSource::control);
    if !word.contains(StatusWord::LOCAL) {
        return named;
    }
    match named {
        Some(Control::Terminals | Control::Panel) => named,
        _ => Some(Control::Local),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STOPPED: Option<Frequency> = Some(Frequency::ZERO);

    #[test]
    fn the_words_that_the_manual_explains_come_out_as_it_says() {
        for (word, output, expected) in [
            (0x4000, STOPPED, State::Ready),
            (0x6404, Some(Frequency::from_hertz(60)), State::Running),
            (0x6600, STOPPED, State::Running),
            (0x4000, Some(Frequency::from_hertz(60)), State::Stopping),
            (0x4080, STOPPED, State::Stopping),
            (0x4800, STOPPED, State::Disabled),
            (0x4C00, STOPPED, State::Disabled),
            (0x0408, STOPPED, State::NotReady),
            (0x0000, STOPPED, State::NotReady),
            (0x4008, STOPPED, State::NotReady),
            (0x1000, STOPPED, State::QuickStop),
            (0x0003, STOPPED, State::Fault),
            (0x0402, Some(Frequency::from_hertz(3)), State::FaultReaction),
        ] {
            assert_eq!(state(StatusWord::from_bits_retain(word), output), expected, "{word:04X}h");
        }
    }

    #[test]
    fn no_word_with_the_trip_bit_is_anything_but_a_fault() {
        for bits in 0..=u16::MAX {
            let word = StatusWord::from_bits_retain(bits);
            assert_eq!(word.bits(), bits);
            for output in [None, STOPPED, Some(Frequency::from_hertz(1))] {
                let state = state(word, output);
                assert_eq!(state.is_fault(), bits & 2 != 0, "{bits:04X}h");
                assert!(state != State::Ready || bits & 0x4000 != 0, "{bits:04X}h");
            }
        }
    }

    #[test]
    fn a_local_drive_is_never_said_to_be_commanded_by_the_bus() {
        let local = StatusWord::LOCAL;
        assert_eq!(control(local, Some(CommandSource::Keypad)), Some(Control::Panel));
        assert_eq!(control(local, Some(CommandSource::Serial)), Some(Control::Local));
        assert_eq!(control(local, None), Some(Control::Local));
        assert_eq!(control(StatusWord::empty(), None), None);
        assert_eq!(control(StatusWord::empty(), Some(CommandSource::Serial)), Some(Control::Bus));
        assert_eq!(control(StatusWord::empty(), Some(CommandSource::Unknown(9))), None);
    }
}
