//! A register that this very drive lacks, which it answers by exception 02: it takes no other along.

use drive_atv312::{Atv312, CAPABILITIES, ROWS};
use drive_core::{Drive, Row};
use drive_testing::words::{Asked, Words};

/// Stands under the bus at L1: `ETA`, `ETI`, `HSP`, `tFr`.
const STANDS: [(u16, u16); 4] = [(3201, 0x0627), (3206, 0x4002), (3104, 500), (3103, 600)];

fn without(code: &str) -> Atv312<Words> {
    let mut words = Words::new(&CAPABILITIES, &STANDS);
    words.refused.insert(Row::find(ROWS, code).unwrap().address, 0x02);
    Atv312::new(words, 1.try_into().unwrap())
}

#[tokio::test(start_paused = true)]
async fn faults_and_measurements_are_told_without_one_of_their_words() {
    for code in ["DP1", "DP2", "DP3", "DP4", "LRS1", "LFt"] {
        without(code).faults().await.unwrap_or_else(|error| panic!("{code}: {error}"));
    }
    for code in ["ULn", "tHd", "OPr", "rtH", "IOLR", "RFRD", "FRHD", "tHr"] {
        let measured = without(code).measurements().await.unwrap_or_else(|error| panic!("{code}: {error}"));
        assert!(measured.raw.iter().all(|word| word.code != code));
    }
}

#[tokio::test(start_paused = true)]
async fn a_function_that_a_drive_lacks_is_assigned_to_nothing() {
    for code in ["JOG", "PIF", "SA3", "PS16", "Atr", "AdC", "dCI"] {
        let found = without(code).self_restarts().await.unwrap_or_else(|error| panic!("{code}: {error}"));
        assert_eq!(found, [], "{code}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_is_missing_is_not_asked_for_again_until_the_drive_may_be_another() {
    for code in ["ULn", "tHd", "RFRD"] {
        let (mut drive, missing) = (without(code), Row::find(ROWS, code).unwrap().address);
        for _ in 0..3 {
            drive.measurements().await.unwrap();
        }
        drive.forget();
        drive.measurements().await.unwrap();
        let asked = drive.into_port().asked;
        let alone = |asked: &&Asked| matches!(asked, Asked::Read(_, at, 1) if *at == missing);
        assert_eq!(asked.iter().filter(alone).count(), 2, "{code}: before forget and behind it");
        assert!(asked.iter().filter(|asked| asked.reads(missing)).count() <= 4, "{code}: {asked:?}");
    }
}
