//! What a contract with a drive rests on, changed by somebody else in the middle of a run: it is told, and nothing goes on as if it
//! stood, for every family whose manual has such a setting. In virtual time.

use std::time::Duration;

use drive_core::{Direction, Frequency, Ground, StopMode};
use drive_families::Family;
use drive_fleet::{EventKind, Outcome, Refused, WatchdogCheck};
use support::plant::Plant;
use tokio::time::sleep;

const SECOND: Duration = Duration::from_secs(1);

/// Setting and word, by the manuals: what is changed, and on what it bears.
const CHANGES: &[(Family, &str, u16, u16, Ground)] = &[
    // Altivar 21 Modbus §6.4: time-out and reaction; UL; §8.4: what the inputs do.
    (Family::ATV21, "F803", 0x0803, 30, Ground::Watchdog),
    (Family::ATV21, "F603", 0x0603, 1, Ground::Watchdog),
    (Family::ATV21, "UL", 0x0012, 4_000, Ground::Limits),
    (Family::ATV21, "F113", 0x0113, 48, Ground::Inputs),
    // Altivar 28 RS485 kit and VW3A58303: HSP.
    (Family::ATV28, "HSP", 250, 400, Ground::Limits),
    (Family::ATV58, "HSP", 250, 400, Ground::Limits),
    // BBV51701: ttO; HSP; bit 9 of CMI; dCI.
    (Family::ATV312, "ttO", 6005, 300, Ground::Watchdog),
    (Family::ATV312, "HSP", 3104, 400, Ground::Limits),
    (Family::ATV312, "CMI", 8504, 1 << 9, Ground::Units),
    (Family::ATV312, "dCI", 11_203, 0, Ground::Inputs),
    // 3G3EV §2.1: n39, n40 and n02.
    (Family::OMRON_3G3EV, "n39", 0x0127, 1, Ground::Units),
    (Family::OMRON_3G3EV, "n40", 0x0128, 1, Ground::Watchdog),
    (Family::OMRON_3G3EV, "n02", 0x0102, 3, Ground::Inputs),
];

#[tokio::test(start_paused = true)]
async fn whatever_a_contract_rests_on_is_told_when_somebody_changes_it_in_run_and_nothing_goes_on_as_if_it_stood()
 {
    for (family, name, register, word, ground) in CHANGES {
        // What takes turns on an Altivar 312 has had its own after 920 statuses.
        let every = Duration::from_millis(300);
        let mut plant = Plant::single(*family, |settings| settings.periods.running = every);
        plant.run_at(30).await;
        // Each setting has had its turn once.
        sleep(280 * SECOND).await;
        let restarts = plant.machine().all_requests();
        let before = plant.machine().peek(*register);
        assert!(before.is_some_and(|before| before != *word), "{family}: {name} is {before:?}");
        assert!(plant.machine().poke(*register, *word), "{family}: {name}");
        plant
            .event(&format!("{family}: {name} is told"), |kind| *kind == EventKind::ContractChanged(*ground))
            .await;
        let snapshot = plant.motor().snapshot();
        match ground {
            Ground::Units => {
                assert_eq!(snapshot.setpoint, None, "{family}: {name}: it may be another now");
            }
            Ground::Limits => assert!(snapshot.setpoint.is_some(), "{family}: {name}: it is what was asked"),
            Ground::Watchdog => {
                let is_verified = matches!(snapshot.watchdog, WatchdogCheck::Verified(_));
                assert!(!is_verified, "{family}: {name}: {:?}", snapshot.watchdog);
            }
            // By which inputs it starts again by itself is asked again.
            _ => assert!(plant.machine().all_requests() > restarts),
        }
        assert_eq!(plant.machine().peek(*register), Some(*word), "{family}: {name}: a run is not disturbed");
        sleep(15 * SECOND).await;
        if *ground == Ground::Limits {
            let outcome = plant.motor().set_setpoint(Frequency::from_hertz(45)).await;
            assert!(matches!(outcome, Outcome::Refused(_)), "{family}: {outcome}");
        }
        assert!(plant.motor().stop(StopMode::Ramp).await.is_confirmed(), "{family}: {name}");
        let outcome = plant.motor().start(Direction::Forward).await;
        if *ground == Ground::Watchdog {
            // It is that of the contract again, or nothing starts.
            let is_set = plant.machine().peek(*register) == before;
            let is_refused = matches!(outcome, Outcome::Refused(Refused::WatchdogUnverified));
            assert!(is_set && outcome.is_confirmed() || is_refused, "{family}: {name}: {outcome}");
        }
        assert!(!outcome.is_confirmed() || plant.machine().observe().running, "{family}: {name}: {outcome}");
    }
}
