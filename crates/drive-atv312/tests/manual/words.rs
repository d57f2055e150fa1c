//! Bits and states (BBV51701 p. 10–25).

use drive_atv312::{
    CAPABILITIES,
    words::{
        ControlWord, ExtendedControl, ExtendedStatus, ExtendedStatus1, ExtendedStatus3, FaultState, LogicIo,
        StatusWord,
    },
};
use drive_core::{Control, SerialSettings, SlaveAddress, StopMode, serial::CharacterFormat};
use drive_drivecom::ChartState;

#[test]
fn the_states_are_those_of_the_table_of_page_13() {
    // Bits 6, 5, 3, 2, 1, 0 of ETA; x is either.
    for (state, bits) in [
        (ChartState::NotReadyToSwitchOn, "0x0000"),
        (ChartState::SwitchOnDisabled, "1x0000"),
        (ChartState::ReadyToSwitchOn, "010001"),
        (ChartState::SwitchedOn, "010011"),
        (ChartState::OperationEnabled, "010111"),
        (ChartState::Fault, "0x1000"),
        (ChartState::FaultReactionActive, "0x1111"),
        (ChartState::QuickStopActive, "000111"),
    ] {
        for eta in 0..=u16::MAX {
            let read = [6, 5, 3, 2, 1, 0].map(|bit| if eta >> bit & 1 == 1 { '1' } else { '0' });
            let fits = bits.chars().zip(read).all(|(printed, read)| printed == 'x' || printed == read);
            assert_eq!(ChartState::of(eta) == Some(state), fits, "{eta:04X}h {state:?}");
        }
    }
}

#[test]
fn the_control_word_has_the_bits_of_pages_12_and_19() {
    for (bit, printed) in [
        (0, ControlWord::SWITCH_ON),
        (1, ControlWord::ENABLE_VOLTAGE),
        (2, ControlWord::NO_QUICK_STOP),
        (3, ControlWord::ENABLE_OPERATION),
        (7, ControlWord::FAULT_RESET),
        (11, ControlWord::REVERSE),
        (12, ControlWord::STOP),
        (13, ControlWord::DC_INJECTION),
        (14, ControlWord::FAST_STOP),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(ControlWord::all().bits(), 0x788F, "4 to 6, 8 to 10 and 15 are reserved");
}

#[test]
fn the_extended_control_word_has_the_bits_of_page_20() {
    for (bit, printed) in [
        (0, ExtendedControl::FACTORY_SETTINGS),
        (1, ExtendedControl::SAVE),
        (3, ExtendedControl::EXTERNAL_FAULT),
        (4, ExtendedControl::RAMP_SWITCH),
        (9, ExtendedControl::HIGH_RESOLUTION),
        (13, ExtendedControl::LOCK),
        (14, ExtendedControl::NO_TIMEOUT),
        (15, ExtendedControl::NO_CONSISTENCY_CHECK),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(ExtendedControl::all().bits(), 0xE21B);
}

#[test]
fn the_status_word_has_the_bits_of_page_21() {
    for (bit, printed) in [
        (0, StatusWord::READY),
        (1, StatusWord::SWITCHED_ON),
        (2, StatusWord::OPERATION_ENABLED),
        (3, StatusWord::FAULT),
        (4, StatusWord::VOLTAGE_DISABLED),
        (5, StatusWord::NO_QUICK_STOP),
        (6, StatusWord::SWITCH_ON_DISABLED),
        (7, StatusWord::ALARM),
        (9, StatusWord::NOT_FORCED_LOCAL),
        (10, StatusWord::REFERENCE_REACHED),
        (11, StatusWord::REFERENCE_EXCEEDED),
        (14, StatusWord::STOP_KEY),
        (15, StatusWord::REVERSE),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(StatusWord::all().bits(), 0xCEFF, "8, 12 and 13 are reserved");
}

#[test]
fn the_extended_status_words_have_the_bits_of_pages_22_and_23() {
    for (bit, printed) in [
        (0, ExtendedStatus::EEPROM_BUSY),
        (1, ExtendedStatus::CONSISTENCY_CHECK),
        (2, ExtendedStatus::RESET_AUTHORISED),
        (4, ExtendedStatus::MOTOR_RUNNING),
        (5, ExtendedStatus::DC_INJECTION),
        (6, ExtendedStatus::TRANSIENT),
        (7, ExtendedStatus::MOTOR_THERMAL_ALARM),
        (8, ExtendedStatus::BRAKING_ALARM),
        (9, ExtendedStatus::ACCELERATING),
        (10, ExtendedStatus::DECELERATING),
        (11, ExtendedStatus::CURRENT_LIMIT),
        (12, ExtendedStatus::FAST_STOP),
        (13, ExtendedStatus::SOURCE_LOW),
        (14, ExtendedStatus::SOURCE_HIGH),
        (15, ExtendedStatus::REVERSE_REQUESTED),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(ExtendedStatus::all().bits(), 0xFFF7, "3 is reserved");
    for (bit, printed) in [
        (1, ExtendedStatus1::FAULT),
        (2, ExtendedStatus1::MOTOR_RUNNING),
        (4, ExtendedStatus1::FREQUENCY_THRESHOLD),
        (5, ExtendedStatus1::HIGH_SPEED),
        (6, ExtendedStatus1::CURRENT_THRESHOLD),
        (7, ExtendedStatus1::REFERENCE_REACHED),
        (8, ExtendedStatus1::MOTOR_THERMAL_ALARM),
        (9, ExtendedStatus1::BRAKE_RELEASED),
        (12, ExtendedStatus1::SIGNAL_LOST),
        (14, ExtendedStatus1::DRIVE_THERMAL_ALARM),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(ExtendedStatus1::all().bits(), 0x53F6);
    for (bit, printed) in [
        (0, ExtendedStatus3::REFERENCE_2),
        (1, ExtendedStatus3::COMMAND_2),
        (2, ExtendedStatus3::RAMPS_2),
        (3, ExtendedStatus3::CURRENT_LIMIT_2),
        (11, ExtendedStatus3::MOTOR_1),
        (12, ExtendedStatus3::MOTOR_2),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(ExtendedStatus3::all().bits(), 0x180F);
}

#[test]
fn the_control_source_is_bits_14_and_13_of_eti_and_of_each_past_fault() {
    for (bits, source) in [
        (0x0000, Control::Local),
        (0x2000, Control::Panel),
        (0x4000, Control::Bus),
        (0x6000, Control::OtherBus),
    ] {
        for other in [0x0000, 0x9FFF] {
            assert_eq!(ExtendedStatus::from_bits_retain(bits | other).control(), source);
            assert_eq!(FaultState::from_bits_retain(bits | other).control(), source);
        }
    }
}

#[test]
fn the_state_at_a_past_fault_has_the_bits_of_page_25() {
    for (bit, printed) in [
        (0, FaultState::READY),
        (1, FaultState::NO_EMERGENCY_STOP),
        (2, FaultState::SWITCH_ON_DISABLED),
        (4, FaultState::REVERSE),
        (5, FaultState::MOTOR_RUNNING),
        (6, FaultState::DC_INJECTION),
        (7, FaultState::MOTOR_THERMAL_ALARM),
        (9, FaultState::ACCELERATING),
        (10, FaultState::DECELERATING),
        (11, FaultState::CURRENT_LIMIT),
        (15, FaultState::REVERSE_REQUESTED),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(FaultState::all().bits(), 0xEEF7, "3, 8 and 12 are reserved");
}

#[test]
fn the_inputs_and_outputs_have_the_bits_of_page_23() {
    let inputs = [LogicIo::LI1, LogicIo::LI2, LogicIo::LI3, LogicIo::LI4, LogicIo::LI5, LogicIo::LI6];
    for (bit, printed) in (0..).zip(inputs) {
        assert_eq!(printed.bits(), 1 << bit);
    }
    for (bit, printed) in [
        (7, LogicIo::KEYPAD),
        (8, LogicIo::R1),
        (9, LogicIo::R2),
        (10, LogicIo::LO),
        (14, LogicIo::ANALOG_OUTPUT),
    ] {
        assert_eq!(printed.bits(), 1 << bit);
    }
    assert_eq!(LogicIo::all().bits(), 0x47BF);
}

#[test]
fn line_limits_and_functions_are_those_of_bbv52816_pages_9_to_12() {
    assert_eq!(CAPABILITIES.functions, [3, 6, 16, 43]);
    assert_eq!((CAPABILITIES.read_words, CAPABILITIES.write_words), (29, 27));
    assert_eq!(CAPABILITIES.stop_modes, StopMode::ALL);
    let slave = |number| SlaveAddress::try_from(number).unwrap();
    for baud in [4_800, 9_600, 19_200] {
        for format in ["8O1", "8E1", "8N1", "8N2"] {
            let settings = SerialSettings::new(baud, format.parse().unwrap()).unwrap();
            for number in [1, 247] {
                assert_eq!(CAPABILITIES.check_line(slave(number), settings), Ok(()));
            }
        }
    }
    let other = |baud, format| CAPABILITIES.check_line(slave(1), SerialSettings::new(baud, format).unwrap());
    assert!(other(38_400, CharacterFormat::F8E1).is_err());
    assert!(other(19_200, CharacterFormat::F7E1).is_err());
    assert_eq!(CAPABILITIES.factory.to_string(), "19200 8E1");
}
