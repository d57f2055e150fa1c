//! A register that this very drive lacks, which it answers by exception 02 for every request that names it: it is `None`, takes no
//! other along, and is not asked for again. No list says which of p. 57 an Altivar 28 has.

use drive_atv28::{Atv28, CAPABILITIES};
use drive_core::{Direction, Drive, Error, ErrorKind, Frequency, Setpoint};
use drive_testing::words::{Asked, Words};

const FORTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(40));
/// Runs forward at 30 Hz by the bus: `LFr`, `HSP`, `CMD`, `FrH`, `rFr`, `LCr`, `ULn`, `tHr`, `tHd`, `ETA`, `ETI`.
const RUNS: [(u16, u16); 11] = [
    (401, 300),
    (250, 500),
    (400, 0x000F),
    (450, 300),
    (451, 300),
    (453, 21),
    (454, 4_000),
    (455, 40),
    (456, 50),
    (458, 0x0627),
    (459, 0x4012),
];

fn without(missing: u16) -> Atv28<Words> {
    let mut words = Words::new(&CAPABILITIES, &RUNS);
    words.refused.insert(missing, 0x02);
    Atv28::new(words, 1.try_into().unwrap())
}

#[tokio::test(start_paused = true)]
async fn a_status_is_told_without_a_word_that_it_can_do_without() {
    for missing in [451, 452, 453, 454, 455, 456, 457, 460] {
        let mut drive = without(missing);
        let status = drive.status().await.unwrap();
        assert_eq!(status.reference, Some(Frequency::from_hertz(30)), "{missing}");
        assert_eq!(status.output_frequency.is_none(), missing == 451, "{missing}");
        assert_eq!(status.current.is_none(), missing == 453, "{missing}");
        assert_eq!(status.raw(missing), None);
        assert!(status.raw(458).is_some() && status.raw(459).is_some());
        drive.status().await.unwrap();
        let asked = drive.into_port().asked;
        assert_eq!(
            asked.iter().filter(|asked| asked.reads(missing)).count(),
            2,
            "{missing}: in its block and alone, then no more"
        );
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_without_its_status_words_is_told_by_the_exception_that_it_answers() {
    for missing in [450, 458, 459] {
        let mut drive = without(missing);
        for _ in 0..2 {
            let error = drive.status().await.unwrap_err();
            assert!(matches!(error, Error::Exception { code: 0x02, .. }), "{missing}: {error}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn each_measurement_and_each_fault_stands_for_itself() {
    for missing in [450, 454, 455, 456, 478, 487, 491, 530, 605] {
        let measured = without(missing).measurements().await.unwrap();
        let lacks = [
            (450, measured.reference.is_none()),
            (454, measured.line_voltage.is_none()),
            (455, measured.motor_thermal.is_none()),
            (456, measured.drive_thermal.is_none()),
            (478, measured.inputs.is_none() && measured.outputs.is_none()),
            (487, measured.torque.is_none()),
            (491, measured.power_share.is_none()),
            (530, measured.running_time.is_none()),
            (605, measured.speed.is_none()),
        ];
        for (register, is_none) in lacks {
            assert_eq!(is_none, register == missing, "{register} without {missing}");
        }
    }
    for past in drive_atv28::ROWS.iter().filter(|row| row.code.starts_with("DP")) {
        let mut drive = without(past.address);
        assert!(drive.faults().await.is_ok(), "{}", past.code);
    }
}

/// BBV51701 p. 21 prints "1%" of the twin's `Otr` and `OPr`, and no sign.
#[tokio::test(start_paused = true)]
async fn a_torque_and_a_power_of_which_the_sign_is_not_printed_are_left_raw() {
    for (word, shown) in [(100, Some(100)), (0x7FFF, Some(0x7FFF)), (0x8000, None), (0xFFFF, None)] {
        let words = Words::new(&CAPABILITIES, &[(487, word), (491, word)]);
        let mut drive = Atv28::new(words, 1.try_into().unwrap());
        let measured = drive.measurements().await.unwrap();
        let shown = shown.map(drive_core::Percent::from_percent);
        assert_eq!((measured.torque, measured.power_share), (shown, shown), "{word:04X}h");
        assert!([487, 491].iter().all(|address| measured.raw.iter().any(|raw| raw.address == *address)));
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_is_started_and_given_its_setpoint_without_the_speeds_and_without_its_limits() {
    for missing in [603, 604, 250, 251] {
        let mut drive = without(missing);
        drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{missing}: {error}"));
        // No drive of words follows it: that it was written is what counts here.
        let error = drive.set_setpoint(FORTY).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{missing}: {error}");
        assert!(drive.into_port().written().contains(&(401, 400)), "{missing}");
    }
}

#[tokio::test(start_paused = true)]
async fn no_fault_is_reset_where_nothing_tells_which_inputs_are_closed() {
    let mut words = Words::new(&CAPABILITIES, &[(458, 0x0608), (459, 0x4006), (457, 17)]);
    words.refused.insert(478, 0x02);
    let mut drive = Atv28::new(words, 1.try_into().unwrap());
    let error = drive.reset_faults().await.unwrap_err();
    assert!(error.to_string().contains("IOLR"), "{error}");
    assert_eq!(drive.into_port().written(), []);
}

#[tokio::test(start_paused = true)]
async fn the_words_around_a_missing_one_are_read_in_rows_and_a_drive_that_may_be_another_is_asked_anew() {
    for missing in [451, 453, 456] {
        let mut drive = without(missing);
        for _ in 0..2 {
            drive.status().await.unwrap();
        }
        drive.forget();
        drive.status().await.unwrap();
        let asked = drive.into_port().asked;
        assert_eq!(
            asked.iter().filter(|asked| asked.reads(missing)).count(),
            4,
            "{missing}: in its block and alone, and so once more"
        );
        // Each status ends with the second block.
        let second = asked.split(|asked| matches!(asked, Asked::Read(_, 457, 4))).nth(1).unwrap();
        let rows = second.iter().filter(|asked| matches!(asked, Asked::Read(_, 450..=456, _))).count();
        assert_eq!(rows, if missing == 456 { 1 } else { 2 }, "{missing}: {second:?}");
    }
}
