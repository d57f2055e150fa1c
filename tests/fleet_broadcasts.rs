//! Whom a command reaches that is given to all: what is broadcast, on which line, whatever happens to it, and a STOP ALL that is
//! pressed again and again on a full line. In virtual time.

use std::time::Duration;

use drive_core::{Direction, Frequency, StopMode};
use drive_families::Family;
use drive_fleet::{DriveSettings, GroupStart, Order, Periods, StopReport, Until, WatchdogContract};
use support::plant::{PATIENCE, Plant, Site, common_settings, contract, controlled};
use tokio::time::{Instant, sleep};

const SECOND: Duration = Duration::from_secs(1);
const MS: Duration = Duration::from_millis(1);

/// Everybody forward at once.
fn start_at(hertz: u16) -> GroupStart {
    let setpoint = Some(Frequency::from_hertz(hertz).into());
    GroupStart { direction: Direction::Forward, setpoint, spacing: Duration::ZERO, until: Until::InForce }
}

/// A line of 31 drives of a family, all of which turn.
async fn full_line(family: Family) -> Plant {
    let member = |address: u8| {
        let periods =
            Periods { running: 4 * SECOND, rest: 4 * SECOND, slow: 60 * SECOND, max_age: 12 * SECOND };
        let watchdog = contract(family)
            .filter(|_| family.capabilities().watchdog.is_some_and(|watchdog| watchdog.settable))
            .map(|contract| WatchdogContract { timeout: 10 * SECOND, ..contract });
        let settings = DriveSettings { periods, watchdog, ..DriveSettings::controlled(address.to_string()) };
        (family, address, settings)
    };
    let plant =
        Plant::open_whatever_the_plan(vec![Site::new(common_settings(), (1..=31).map(member).collect())]);
    let plant = plant.unwrap_or_else(|error| panic!("{error}"));
    for drive in plant.fleet.drives() {
        drive.ready(PATIENCE).await.unwrap_or_else(|refused| panic!("{}: {refused}", drive.name()));
    }
    plant.fleet.all().start(start_at(40)).await.unwrap_or_else(|failure| panic!("{failure}"));
    plant
}

/// How long it takes until every drive has confirmed each of these presses of STOP ALL, from that press, in the order in which they
/// were pressed.
async fn pressed(
    plant: &Plant,
    presses: u32,
    every: Duration,
    mode: StopMode,
) -> Vec<(Duration, StopReport)> {
    let mut waiting = Vec::new();
    for _ in 0..presses {
        let (at, stop) = (Instant::now(), plant.fleet.stop_all(mode));
        waiting.push(tokio::spawn(async move {
            let report = stop.in_force().await;
            (at.elapsed(), report)
        }));
        sleep(every).await;
    }
    let mut all = Vec::new();
    for one in waiting {
        all.push(one.await.expect("it ends"));
    }
    all
}

#[tokio::test(start_paused = true)]
async fn five_presses_of_stop_all_in_a_second_for_ten_seconds_keep_no_drive_of_a_full_line_from_confirming_one()
 {
    for (family, mode) in [
        (Family::ATV312, StopMode::Ramp),
        (Family::ATV21, StopMode::Ramp),
        (Family::ATV28, StopMode::Freewheel),
    ] {
        let plant = full_line(family).await;
        let (alone, report) = pressed(&plant, 1, SECOND, mode).await.remove(0);
        assert!(report.is_confirmed(), "{family}: {report}");

        let plant = full_line(family).await;
        let bound = plant.fleet.plan("line 0").expect("it is a line").stop_all(0);
        let before: u64 =
            plant.fleet.drives().iter().map(|drive| Plant::writes(plant.machine_of(drive.name()))).sum();
        let all = pressed(&plant, 50, 200 * MS, mode).await;
        let slowest = all.iter().map(|(took, _)| *took).max().unwrap_or_default();
        let after: u64 =
            plant.fleet.drives().iter().map(|drive| Plant::writes(plant.machine_of(drive.name()))).sum();
        println!(
            "{family}: once {alone:?}; 50 times: the first {:?}, the slowest {slowest:?}, {} writes, the bound {bound:?}",
            all[0].0,
            after - before
        );
        for (number, (took, report)) in all.iter().enumerate() {
            assert!(report.is_confirmed(), "{family}, press {number}: {report}");
            // A sweep of statuses that are newer than it, besides what a stop of all takes.
            assert!(*took <= 2 * bound, "{family}, press {number}: {took:?}, the bound {bound:?}");
        }
        assert!(all[0].0 <= alone + bound / 4, "{family}: the first waits for no other: {:?}", all[0].0);
        for drive in plant.fleet.drives() {
            drive.wait_until(|snapshot| snapshot.stop.is_none()).await;
            assert!(!plant.machine_of(drive.name()).observe().running, "{family}: {}", drive.name());
        }
    }
}

/// Two drives of a family that run, and what was broadcast to them by what is done to them.
async fn broadcast_by<T>(family: Family, deed: impl AsyncFnOnce(&Plant) -> T) -> (Plant, u64, T) {
    let member = |address: u8| (family, address, controlled(family, &address.to_string()));
    let plant = Plant::open(vec![Site::new(common_settings(), (1..=2).map(member).collect())]);
    let plant = plant.unwrap_or_else(|error| panic!("{error}"));
    for drive in plant.fleet.drives() {
        drive.ready(PATIENCE).await.expect("it gets ready");
        let started = drive.start_at(Direction::Forward, Frequency::from_hertz(20)).await;
        assert!(started.is_confirmed(), "{started}");
    }
    let before = plant.sites[0].simulated.stats().broadcasts;
    let done = deed(&plant).await;
    let broadcasts = plant.sites[0].simulated.stats().broadcasts - before;
    (plant, broadcasts, done)
}

#[tokio::test(start_paused = true)]
async fn nothing_but_the_stop_of_all_drives_of_a_line_is_broadcast() {
    let (family, mode) = (Family::ATV28, StopMode::Freewheel);
    let (_, broadcasts, _) = broadcast_by(family, async |plant| {
        for order in [Order::ResetFaults, Order::Release, Order::Persist] {
            for drive in plant.fleet.drives() {
                let _ = drive.order(order).await;
            }
        }
        let group = plant.fleet.all();
        let _ = group.set_setpoint(Frequency::from_hertz(30)).await;
        for drive in plant.fleet.drives() {
            assert!(drive.stop(mode).await.is_confirmed());
        }
        group.start(start_at(20)).await.unwrap_or_else(|failure| panic!("{failure}"));
    })
    .await;
    assert_eq!(broadcasts, 0, "start, setpoint, reset, release, save, and stops of single drives");

    // One that does not hear the broadcast is stopped by its own.
    let (plant, broadcasts, report) = broadcast_by(family, async |plant| {
        plant.machine_of("2").mute();
        let stop = plant.fleet.stop_all(mode);
        plant.machine_of("1").wait_until(|machine| !machine.running).await;
        assert!(plant.machine_of("2").observe().running, "it has heard nothing");
        plant.machine_of("2").unmute();
        stop.await
    })
    .await;
    assert_eq!((broadcasts, report.broadcasts.len()), (1, 1), "{report}");
    plant.drive("2").wait_until(|snapshot| snapshot.stop.is_none()).await;
    assert!(!plant.machine_of("2").observe().running);

    // While all are being stopped so, or harder, nothing is broadcast over it.
    let (_, broadcasts, again) = broadcast_by(family, async |plant| {
        let first = plant.fleet.stop_all(mode);
        sleep(20 * MS).await;
        let again = [mode, StopMode::Fast, StopMode::Ramp].map(|mode| plant.fleet.stop_all(mode));
        let mut reports = vec![first.await];
        for stop in again {
            reports.push(stop.await);
        }
        reports
    })
    .await;
    assert_eq!(broadcasts, 1, "{again:?}");
    assert!(again.iter().all(StopReport::is_confirmed), "{again:?}");
}
