//! A word that this very drive lacks, which the card answers by exception 02 for every request that names it: it is `None`, takes no
//! other along, and is not asked for again. No public list says which words an Altivar 58 has.

use drive_atv58::{Atv58, CAPABILITIES};
use drive_core::{Direction, Drive, Error, ErrorKind, Frequency, Setpoint};
use drive_testing::words::Words;

const FORTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(40));
/// Runs forward at 30 Hz by the line, with the words of the default map.
const RUNS: [(u16, u16); 10] = [
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
];

fn without(missing: u16, more: &[(u16, u16)]) -> Atv58<Words> {
    let mut words = Words::new(&CAPABILITIES, &[&RUNS, more].concat());
    words.refused.insert(missing, 0x02);
    Atv58::new(words, 1.try_into().unwrap())
}

#[tokio::test(start_paused = true)]
async fn a_status_is_told_without_a_word_that_it_can_do_without() {
    for missing in [450, 451, 452, 453, 454, 455, 456, 457] {
        let mut drive = without(missing, &[]);
        let status = drive.status().await.unwrap();
        assert_eq!(status.reference.is_none(), missing == 450, "{missing}");
        assert_eq!(status.output_frequency.is_none(), missing == 451, "{missing}");
        assert_eq!(status.current.is_none(), missing == 453, "{missing}");
        assert!(status.raw(458).is_some(), "{missing}");
        drive.status().await.unwrap();
        let asked = drive.into_port().asked;
        assert!(
            asked.iter().filter(|asked| asked.reads(missing)).count() <= 2,
            "{missing}: in its block and alone, then no more"
        );
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_without_its_status_word_is_told_by_the_exception_that_it_answers() {
    let mut drive = without(458, &[]);
    for _ in 0..2 {
        let error = drive.status().await.unwrap_err();
        assert!(matches!(error, Error::Exception { code: 0x02, .. }), "{error}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_trip_is_told_without_its_register_of_bits() {
    let tripped = [(458, 0x0608)];
    let status = without(483, &tripped).status().await.unwrap();
    assert!(status.is_fault());
    assert_eq!(status.fault_code, None);
    assert_eq!(without(483, &tripped).faults().await.unwrap().present, []);
}

#[tokio::test(start_paused = true)]
async fn each_measurement_stands_for_itself() {
    for missing in [450, 452, 454, 455, 456, 463, 464, 465, 466] {
        let measured = without(missing, &[]).measurements().await.unwrap();
        let lacks = [
            (450, measured.reference.is_none()),
            (454, measured.line_voltage.is_none()),
            (455, measured.motor_thermal.is_none()),
            (456, measured.drive_thermal.is_none()),
        ];
        for (register, is_none) in lacks {
            assert_eq!(is_none, register == missing, "{register} without {missing}");
        }
        let sample = measured.raw.iter().filter(|word| (463..=466).contains(&word.address)).count();
        assert_eq!(sample, if missing >= 463 { 3 } else { 4 }, "{missing}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_is_started_and_given_its_setpoint_without_its_limits() {
    for missing in [250, 251] {
        let mut drive = without(missing, &[]);
        drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{missing}: {error}"));
        let error = drive.set_setpoint(FORTY).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{missing}: {error}");
        assert!(drive.into_port().written().contains(&(401, 400)), "{missing}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_words_around_a_missing_one_are_read_in_rows_and_a_drive_that_may_be_another_is_asked_anew() {
    for missing in [451, 453, 456] {
        let mut drive = without(missing, &[]);
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
        // At the most the block and its nine words one by one, a row on each side, and both again.
        assert!(asked.len() <= 10 + 2 + 10, "{missing}: {asked:?}");
    }
}
