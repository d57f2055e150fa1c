//! A drive that takes every stop and runs on: what is known of it stays young while its driver waits for it to obey.

use std::time::Duration;

use drive_atv312::{Atv312, CAPABILITIES};
use drive_bus::{Line, LineConfig};
use drive_core::{Error, SerialSettings, StopMode};
use drive_fleet::{DriveSettings, Fleet, Outcome, Times, Unconfirmed, Unknown};
use drive_sim::{SimLine, Wiring};
use drive_testing::words::Words;
use tokio::time::{Instant, sleep};

/// Runs forward at 30 Hz by the bus, for which it is set up (BBV51701 p. 10, 11, 21, 22, 35 to 37).
const RUNS: [(u16, u16); 16] = [
    (3006, 2),
    (3103, 600),
    (3104, 500),
    (8401, 2),
    (8411, 96),
    (8413, 164),
    (8421, 98),
    (8423, 10),
    (8424, 10),
    (8501, 0x000F),
    (8502, 300),
    (3201, 0x0627),
    (3202, 300),
    (3203, 300),
    (3206, 0x4012),
    (11_204, 174),
];

#[tokio::test(start_paused = true)]
async fn behind_a_stop_that_is_not_obeyed_no_status_gets_older_than_a_poll() {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let site = SimLine::new(Wiring::rtu(settings));
    let line = Line::over(site.in_memory(), LineConfig::stream(settings));
    let mut words = Words::new(&CAPABILITIES, &RUNS);
    words.deaf = true;
    let fleet = Fleet::builder()
        .line("north", line)
        .drive("north", 1, DriveSettings::controlled("pump"), move |_, slave| {
            Box::new(Atv312::new(words, slave))
        })
        .start()
        .unwrap();
    let pump = fleet.drive("pump").unwrap();
    pump.wait_until(|seen| seen.status.is_some()).await;
    let stop = pump.stop(StopMode::Ramp);
    let mut oldest = Duration::ZERO;
    for _ in 0..400 {
        sleep(Duration::from_millis(25)).await;
        let seen = pump.snapshot();
        assert!(seen.stop.is_some_and(|stop| !stop.taken), "{seen:?}");
        oldest = oldest.max(seen.status.as_ref().expect("it was seen").age(Instant::now()));
    }
    assert!(oldest <= Duration::from_secs(1), "{oldest:?}, in virtual time");
    assert!(!stop.await.is_confirmed());
}

/// Its driver writes the stop anew for as long as one attempt takes: who asks meanwhile hears what the drive says to it.
#[tokio::test(start_paused = true)]
async fn that_a_drive_refuses_the_words_of_a_stop_is_told_before_the_first_attempt_is_over() {
    // Illegal function denies it; behind a failure of the device (04) nobody knows.
    for (by, is_denied) in [(1, true), (4, false)] {
        let settings = SerialSettings::MODBUS_DEFAULT;
        let site = SimLine::new(Wiring::rtu(settings));
        let line = Line::over(site.in_memory(), LineConfig::stream(settings));
        let mut words = Words::new(&CAPABILITIES, &RUNS);
        words.refuses_writes = Some(by);
        let times = Times { stop_alarm: Duration::from_secs(1), ..Times::default() };
        let fleet = Fleet::builder()
            .line("north", line)
            .drive(
                "north",
                1,
                DriveSettings { times, ..DriveSettings::controlled("pump") },
                move |_, slave| Box::new(Atv312::new(words, slave)),
            )
            .start()
            .unwrap();
        let pump = fleet.drive("pump").unwrap();
        pump.wait_until(|seen| seen.status.is_some()).await;
        let outcome = pump.stop(StopMode::Ramp).await;
        let told = match &outcome {
            Outcome::NotConfirmed(Unconfirmed::StopDenied { error, .. }) if is_denied => Some(error),
            Outcome::OutcomeUnknown(Unknown { error, .. }) if !is_denied => error.as_ref(),
            _ => None,
        };
        assert!(matches!(told, Some(Error::Exception { code, .. }) if *code == by), "{by}: {outcome}");
        assert_eq!(pump.snapshot().stop.map(|stop| stop.attempts), Some(1), "{by}");
    }
}
