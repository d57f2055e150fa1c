//! The drive against a bank of words: how it asks, in how many exchanges, and what it makes of words that no manual
//! explains.

mod rig;

use drive_core::{
    Class, Control, Direction, Drive, Error, ErrorKind, Frequency, PortError, State, Status, StopMode,
    Voltage,
};
use drive_testing::words::Asked;
use rig::{ready, running, with};

fn unknown() -> PortError {
    PortError::OutcomeUnknown("test")
}

/// What a status says that was made of these words.
async fn status(words: &[(u16, u16)]) -> Status {
    rig::drive(with(words)).status().await.unwrap()
}

#[tokio::test(start_paused = true)]
async fn a_status_takes_two_exchanges_once_n39_and_the_command_are_known() {
    let mut drive = rig::drive(running());
    drive.status().await.unwrap();
    drive.status().await.unwrap();
    let two = [Asked::Read(Class::Status, 0x20, 8), Asked::Read(Class::Status, 0x2C, 1)];
    let asked = drive.into_port().asked;
    assert_eq!(asked[0], Asked::Read(Class::Status, 0x0127, 1));
    assert_eq!(asked[3], Asked::Read(Class::Status, 0x0001, 1), "what the next stop keeps of it");
    assert_eq!((&asked[1..3], &asked[4..]), (&two[..], &two[..]));
}

#[tokio::test(start_paused = true)]
async fn measurements_take_two_exchanges_and_are_in_their_units() {
    let words = [(0x23, 500), (0x28, 198), (0x2B, 0x15), (0x2D, 2), (0x31, 325), (0x22, 8)];
    let mut drive = rig::drive(with(&words));
    let measured = drive.measurements().await.unwrap();
    assert_eq!(measured.reference, Some(Frequency::from_hertz(50).into()));
    assert_eq!(measured.output_voltage, Some(Voltage::from_decivolts(1_980)));
    assert_eq!(measured.dc_bus_voltage, Some(Voltage::from_decivolts(3_250)));
    assert_eq!((measured.inputs, measured.outputs), (Some(0x15), Some(2)));
    assert!(measured.raw.contains(&drive_core::RawWord { address: 0x22, code: "0022h", value: 8 }));
    let read = |first, count| Asked::Read(Class::Background, first, count);
    assert_eq!(drive.into_port().asked, [read(0x0127, 1), read(0x22, 7), read(0x2B, 7)]);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_does_not_read_reserved_registers_is_read_round_them() {
    let mut words = running();
    words.words.insert(0x27, 42);
    words.refused.extend([0x25, 0x26, 0x2E, 0x2F, 0x30].map(|reserved| (reserved, 2)));
    let mut drive = rig::drive(words);
    let first = drive.status().await.unwrap();
    assert_eq!(first.current.unwrap().deciamperes(), 42);
    assert_eq!(drive.status().await.unwrap(), first);
    drive.measurements().await.unwrap();
    let read = |first, count| Asked::Read(Class::Status, first, count);
    let asked = drive.into_port().asked;
    let singly: Vec<_> = (0x20..0x28).map(|register| read(register, 1)).collect();
    assert_eq!((&asked[1], &asked[2..10], &asked[10]), (&read(0x20, 8), &singly[..], &read(0x2C, 1)));
    assert_eq!(asked[12..15], [read(0x20, 5), read(0x27, 1), read(0x2C, 1)], "found out once");
    assert!(!asked[15..].contains(&read(0x25, 1)));
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_written_first_as_a_stop_and_read_as_a_command() {
    let mut drive = rig::drive(ready());
    drive.stop(StopMode::Ramp).await.unwrap();
    let asked = drive.into_port().asked;
    assert_eq!(asked[0], Asked::Write(Class::Stop, 1, vec![0]));
    assert!(asked[1..].iter().all(|asked| matches!(asked, Asked::Read(Class::Command, ..))), "{asked:?}");
    assert_eq!(asked.last(), Some(&Asked::Read(Class::Command, 1, 1)), "what is in force after the status");
    assert_eq!(asked.len(), 5, "n39, and one status");
}

#[tokio::test(start_paused = true)]
async fn reading_a_drive_writes_nothing() {
    let mut drive = rig::drive(running());
    drive.status().await.unwrap();
    drive.measurements().await.unwrap();
    drive.faults().await.unwrap();
    drive.watchdog().await.unwrap();
    drive.keep_alive().await.unwrap();
    let port = drive.into_port();
    assert_eq!(port.written(), []);
    assert_eq!(port.asked.last(), Some(&Asked::LoopBack(Class::KeepAlive)));
}

#[tokio::test(start_paused = true)]
async fn an_ambiguous_stop_is_read_back_and_written_again_where_it_was_lost() {
    for (arrives, writes) in [(true, 1), (false, 2)] {
        let mut words = ready();
        words.words.insert(1, 1);
        words.writes.push_back(Some((unknown(), arrives)));
        let mut drive = rig::drive(words);
        drive.stop(StopMode::Ramp).await.unwrap();
        assert_eq!(drive.into_port().written(), vec![(1, 0); writes]);
    }
}

#[tokio::test(start_paused = true)]
async fn a_run_command_that_does_not_show_is_not_confirmed_after_a_bounded_time() {
    let mut drive = rig::drive(ready());
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed);
    let asked = drive.into_port().asked;
    assert!(asked.len() < 120, "{}", asked.len());
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_the_terminals_keep_running_is_not_a_confirmed_stop() {
    let mut words = running();
    words.words.insert(0x2C, 0x0465);
    let error = rig::drive(words).stop(StopMode::Ramp).await.unwrap_err();
    let Error::NotConfirmed { status, .. } = error else { panic!("{error}") };
    assert_eq!((status.state, status.control), (State::Running, Some(Control::Local)));
}

#[tokio::test(start_paused = true)]
async fn run_in_the_old_direction_does_not_confirm_a_turn() {
    let mut words = running();
    words.deaf = true;
    let mut drive = rig::drive(words);
    assert!(drive.start(Direction::Forward).await.is_ok());
    let error = drive.start(Direction::Reverse).await.unwrap_err();
    let Error::NotConfirmed { status, .. } = error else { panic!("{error}") };
    assert_eq!((status.state, status.raw(1)), (State::Running, Some(1)));
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_confirmed_and_not_carried_out_is_not_confirmed() {
    let mut words = running();
    words.deaf = true;
    let error = rig::drive(words).stop(StopMode::Ramp).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
}

#[tokio::test(start_paused = true)]
async fn the_reset_bit_is_cleared_also_when_the_outcome_of_the_pulse_is_unknown() {
    let mut words = with(&[(0x20, 0x08), (0x21, 1), (0x0108, 77)]);
    words.writes.extend([Some((unknown(), true)), None]);
    let mut drive = rig::drive(words).with_fault_reset_function(77);
    let error = drive.reset_faults().await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    let port = drive.into_port();
    assert_eq!(port.written(), [(1, 0x40), (1, 0)]);
}

#[tokio::test(start_paused = true)]
async fn a_pulse_that_was_not_sent_is_not_cleared() {
    let mut words = with(&[(0x20, 0x08), (0x21, 1), (0x0106, 77)]);
    words.writes.push_back(Some((PortError::Expired, false)));
    let mut drive = rig::drive(words).with_fault_reset_function(77);
    assert_eq!(drive.reset_faults().await.unwrap_err().kind(), ErrorKind::NotSent);
    assert_eq!(drive.into_port().written(), [(1, 0x10)]);
}

#[tokio::test(start_paused = true)]
async fn a_save_whose_outcome_is_unknown_counts_and_is_not_repeated() {
    let mut words = ready();
    words.writes.extend([None, Some((unknown(), true)), None]);
    let mut drive = rig::drive(words);
    let n20 = drive_3g3ev::registers::parameter(20).unwrap();
    drive.write_parameter(n20, 50).await.unwrap();
    assert_eq!(drive.persist().await.unwrap_err().kind(), ErrorKind::OutcomeUnknown);
    assert_eq!(drive.persist().await, Ok(2), "asked for again by its caller, and the first one counted");
    let writes = drive.into_port().written();
    assert_eq!(writes, [(0x0114, 50), (0x0900, 0), (0x0900, 0)]);
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_that_reads_back_otherwise_is_not_confirmed() {
    let mut words = ready();
    words.deaf = true;
    let mut drive = rig::drive(words);
    let error = drive.set_setpoint(Frequency::from_hertz(50).into()).await.unwrap_err();
    let Error::NotConfirmed { status, .. } = error else { panic!("{error}") };
    assert_eq!(status.raw(2), Some(0));
}

#[tokio::test(start_paused = true)]
async fn an_ambiguous_setpoint_is_read_back() {
    for (arrives, taken) in [(true, true), (false, false)] {
        let mut words = ready();
        words.writes.push_back(Some((unknown(), arrives)));
        let mut drive = rig::drive(words);
        let result = drive.set_setpoint(Frequency::from_hertz(50).into()).await;
        assert_eq!(result.is_ok(), taken, "{result:?}");
        assert_eq!(drive.into_port().written().len(), 1);
    }
}

#[tokio::test(start_paused = true)]
async fn a_unit_that_the_manual_does_not_list_is_never_guessed() {
    let mut words = ready();
    words.words.insert(0x0127, 4);
    let mut drive = rig::drive(words);
    assert_eq!(drive.status().await.unwrap().output_frequency, None);
    let error = drive.set_setpoint(Frequency::from_hertz(50).into()).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Answer);
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn the_state_is_what_the_words_together_say() {
    let cases = [
        (0x04, 0, 0x0142, 0, State::Ready),
        (0x04, 0, 0x0102, 0, State::NotReady),
        (0x00, 0, 0x0142, 0, State::NotReady),
        (0x04, 0, 0x01C2, 0, State::NotReady),
        (0x05, 0, 0x0041, 0, State::Running),
        (0x04, 0, 0x0041, 0, State::Running),
        (0x04, 0, 0x0042, 30, State::Stopping),
        (0x04, 0, 0x0142, 30, State::Ready),
        (0x0D, 0, 0x0041, 30, State::Fault),
        (0x05, 1, 0x0041, 30, State::Fault),
        (0x05, 0, 0x4041, 30, State::Fault),
    ];
    for (signals, errors, state, output, expected) in cases {
        let seen = status(&[(0x20, signals), (0x21, errors), (0x2C, state), (0x24, output)]).await;
        assert_eq!(seen.state, expected, "{signals:04X}h {errors:04X}h {state:04X}h");
    }
}

#[tokio::test(start_paused = true)]
async fn every_word_of_each_register_is_decoded_and_kept() {
    for register in [0x20, 0x21, 0x24, 0x2C] {
        for word in 0..=u16::MAX {
            let seen = status(&[(register, word)]).await;
            assert_eq!(seen.raw(register), Some(word));
            match register {
                0x20 => assert_eq!(seen.is_fault(), word >> 3 & 1 == 1),
                0x21 => {
                    assert_eq!(seen.is_fault(), word != 0);
                    assert_eq!(seen.fault_code, (word != 0).then(|| word.trailing_zeros() as u16));
                }
                0x24 => assert_eq!(seen.output_frequency, Some(Frequency::from_decihertz(word))),
                _ => {
                    let control = if word >> 0xA & 1 == 1 { Control::Local } else { Control::Bus };
                    assert_eq!(seen.control, Some(control));
                }
            }
        }
    }
}

#[tokio::test(start_paused = true)]
async fn every_fault_bit_is_listed_with_its_number_also_the_blank_ones() {
    for word in [0xFFFF, 0x8870, 0x5780] {
        let faults = rig::drive(with(&[(0x21, word)])).faults().await.unwrap();
        let bits = faults.present.iter().fold(0, |all, fault| all | 1_u16 << fault.code);
        assert_eq!(bits, word);
        for fault in faults.present {
            assert_eq!(fault.entry.is_none(), [4, 5, 6, 0xB, 0xF].contains(&fault.code));
        }
    }
}

#[tokio::test(start_paused = true)]
async fn answers_of_all_ones_never_panic() {
    let all = (0..=0x44).map(|offset| 0x0100 + offset).chain(0..=0x3D).map(|address| (address, 0xFFFF));
    let all: Vec<_> = all.collect();
    let mut drive = rig::drive(with(&all)).with_fault_reset_function(0xFFFF);
    assert_eq!(drive.status().await.unwrap().state, State::Fault);
    drive.measurements().await.unwrap();
    assert_eq!(drive.faults().await.unwrap().warnings.len(), 13);
    assert_eq!(drive.watchdog().await.unwrap_err().kind(), ErrorKind::Answer);
    assert!(drive.start(Direction::Reverse).await.is_err());
    assert!(drive.reset_faults().await.is_err());
    assert!(drive.set_setpoint(Frequency::from_hertz(1).into()).await.is_err());
}
