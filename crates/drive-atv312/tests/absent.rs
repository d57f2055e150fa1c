//! A register that this very drive lacks, which it answers by exception 02: it takes no other along.

use std::{sync::mpsc, thread, time::Duration};

use drive_atv312::{Atv312, CAPABILITIES, ROWS};
use drive_core::{Drive, Error, Row, StopMode};
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

/// Found by `drive-fire worlds --story 3.3.0.o14.o10.l1.o12.l7.f17x0.o9.o13.f49x2.o9.o14.o3.o5.o5.f38x2`: a stop asked its own memory
/// for the access level for ever, and its whole thread stood still. Nobody can end that from within the thread.
#[test]
fn a_drive_that_tells_no_access_level_is_stopped_and_the_stop_comes_to_an_end() {
    for mode in [StopMode::Ramp, StopMode::Fast, StopMode::Freewheel, StopMode::DcInjection] {
        let (ended, end) = mpsc::channel();
        thread::spawn(move || {
            let runtime =
                tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build();
            let mut drive = without("LAC");
            let stopped = runtime.expect("a runtime").block_on(drive.stop(mode));
            ended.send((stopped, drive.into_port().asked)).expect("somebody waits");
        });
        let (stopped, asked) = end.recv_timeout(Duration::from_secs(60)).expect("the stop comes to an end");
        let cmd = Row::find(ROWS, "CMD").unwrap().address;
        assert!(
            asked.iter().any(|asked| matches!(asked, Asked::Write(_, at, _) if *at == cmd)),
            "{mode:?}: {asked:?}"
        );
        // These words follow no command, so that it is never confirmed.
        assert!(matches!(stopped, Ok(_) | Err(Error::NotConfirmed { .. })), "{mode:?}: {stopped:?}");
    }
}
