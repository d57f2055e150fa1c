//! What a drive is away for, and what happens when it is back: somebody else takes control and lets go, a cable is cut and
//! mended, the power goes and comes. Nothing starts by itself, and a stop that was demanded meanwhile is carried out.

use std::{
    future::ready,
    sync::{Arc, Mutex},
    time::Duration,
};

use drive_bus::Line;
use drive_core::{Command, Direction, Frequency, StopMode};
use drive_families::Family;
use drive_fleet::{EventKind, Fleet, Link, OnControlTaken, Outcome};
use drive_sim::Panel;
use support::{
    drives,
    plant::{self, MOTOR, PATIENCE, Plant, Site},
};
use tokio::{
    io::{copy_bidirectional, duplex},
    spawn,
    sync::watch,
    time::{sleep, timeout},
};

const SECOND: Duration = Duration::from_secs(1);

/// Why this side does not decide for a while.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Away {
    /// Somebody else has control.
    Control,
    /// The cable is cut.
    Cable,
    /// The drive has no power.
    Power,
}

impl Away {
    /// What is set at the drive so that it can be.
    fn settings(self, family: Family) -> &'static [&'static str] {
        match (self, drives::five(family)) {
            // §8.4 p. 31: R forces local.
            (Self::Control, drives::Five::Atv21) => &["set F112 48"],
            // BBV51701 p. 44: LI5 forces local, the terminals' channel.
            (Self::Control, drives::Five::Atv312) => &["set FLO 133", "set FLOC 1"],
            _ => &[],
        }
    }

    fn comes(self, family: Family) -> &'static str {
        match (self, drives::five(family)) {
            (Self::Control, drives::Five::Atv21) => "terminal R on",
            (Self::Control, drives::Five::Atv312) => "terminal LI5 on",
            (Self::Control, _) => "panel takes",
            (Self::Cable, _) => "line cut",
            (Self::Power, _) => "power off",
        }
    }

    fn goes(self, family: Family) -> &'static str {
        match (self, drives::five(family)) {
            (Self::Control, drives::Five::Atv21) => "terminal R off",
            (Self::Control, drives::Five::Atv312) => "terminal LI5 off",
            (Self::Control, _) => "panel releases",
            (Self::Cable, _) => "line join",
            (Self::Power, _) => "power on",
        }
    }
}

/// One drive, set up so that it can be taken away.
fn plant(family: Family, away: Away, on_control_taken: OnControlTaken) -> Plant {
    let plant = Plant::single(family, |settings| settings.on_control_taken = on_control_taken);
    away.settings(family).iter().for_each(|setting| plant.happens(setting));
    if plant.machine().surroundings().switches.iter().any(|switch| switch.name == "given-back") {
        // The reading of the manual under which a run command acts again.
        plant.happens("reading given-back standing-word");
    }
    plant
}

/// It is away, and this side has noticed.
async fn taken(plant: &mut Plant, family: Family, away: Away) {
    plant.happens(away.comes(family));
    let noticed = |kind: &EventKind| match away {
        Away::Control => matches!(kind, EventKind::ControlTaken(_)),
        Away::Cable | Away::Power => matches!(kind, EventKind::Lost { .. }),
    };
    plant.event(&format!("{family} {away:?} is away"), noticed).await;
}

/// It is back, and this side has noticed.
async fn given_back(plant: &Plant, family: Family, away: Away) {
    plant.happens(away.goes(family));
    let is_back = plant.motor();
    let is_back = is_back.wait_until(|snapshot| snapshot.link == Link::Connected);
    timeout(PATIENCE, is_back).await.unwrap_or_else(|_| panic!("{family} {away:?}: it does not come back"));
}

/// Every family and everything that it can be away for.
async fn each(test: impl AsyncFn(Family, Away)) {
    for family in Family::BUILT_IN {
        for away in [Away::Control, Away::Cable, Away::Power] {
            test(family, away).await;
        }
    }
}

#[tokio::test(start_paused = true)]
async fn what_has_come_to_rest_while_it_was_away_does_not_start_when_it_is_back() {
    each(async |family, away| {
        let mut plant = plant(family, away, OnControlTaken::Withdraw);
        plant.run_at(30).await;
        taken(&mut plant, family, away).await;
        sleep(20 * SECOND).await;
        let ran_on = plant.machine().observe().running;
        given_back(&plant, family, away).await;
        sleep(60 * SECOND).await;
        let runs = plant.machine().observe().running;
        assert!(ran_on || !runs, "{family} {away:?}: it started");
        assert!(away == Away::Cable || !runs, "{family} {away:?}: only a cut cable leaves a motor alone");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn a_run_command_is_withdrawn_when_somebody_else_takes_control_or_is_an_alarm() {
    for family in Family::BUILT_IN {
        let mut plant = plant(family, Away::Control, OnControlTaken::Withdraw);
        plant.run_at(30).await;
        taken(&mut plant, family, Away::Control).await;
        let withdrawn = plant
            .event("the withdrawal", |kind| {
                let is_withdrawal = matches!(kind, EventKind::Command { command: Command::Withdraw, .. });
                is_withdrawal || matches!(kind, EventKind::RunCommandStands(_))
            })
            .await;
        // The Altivar 58's manual names no word that ends its run command and nothing else.
        match drives::five(family) {
            drives::Five::Atv58 => assert!(withdrawn.is_alarm(), "{family}: {withdrawn}"),
            _ => assert!(
                matches!(withdrawn, EventKind::Command { outcome: Outcome::Confirmed, .. }),
                "{family}: {withdrawn}"
            ),
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_trip_that_somebody_resets_at_the_drive_starts_nothing() {
    for family in Family::BUILT_IN {
        let mut plant = Plant::single(family, |_| ());
        if family == Family::OMRON_3G3EV {
            // The reading of the manual under which a run command acts again.
            plant.happens("reading after-reset runs");
        }
        plant.run_at(30).await;
        plant.happens(&format!("trip {}", drives::a_trip(family)));
        let command =
            |kind: &EventKind| matches!(kind, EventKind::Command { command: Command::Withdraw, .. });
        let withdrawn = plant.event("the withdrawal", command).await;
        assert!(
            matches!(withdrawn, EventKind::Command { outcome: Outcome::Confirmed, .. }),
            "{family}: {withdrawn}"
        );
        plant.machine().panel(Panel::Reset);
        sleep(60 * SECOND).await;
        let seen = plant.machine().observe();
        assert!(!seen.running && seen.trip.is_none(), "{family}: {seen:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_policy_leaves_the_run_command_as_it_is_and_nothing_is_written() {
    for family in Family::BUILT_IN {
        let mut plant = plant(family, Away::Control, OnControlTaken::Report);
        plant.run_at(30).await;
        taken(&mut plant, family, Away::Control).await;
        let writes = Plant::writes(plant.machine());
        sleep(20 * SECOND).await;
        given_back(&plant, family, Away::Control).await;
        sleep(20 * SECOND).await;
        assert_eq!(Plant::writes(plant.machine()), writes, "{family}");
        if family == Family::ATV21 {
            // FA00 still holds RUN: that is what the policy accepts.
            assert!(plant.machine().observe().running, "{family}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_that_was_asked_for_while_it_was_away_is_not_carried_out_when_it_is_back() {
    each(async |family, away| {
        let plant = plant(family, away, OnControlTaken::Withdraw);
        plant.motor().ready(PATIENCE).await.expect("it gets ready");
        plant.happens(away.comes(family));
        let outcome = plant.motor().run(Direction::Forward, Frequency::from_hertz(20)).await;
        assert!(!outcome.is_confirmed(), "{family} {away:?}: {outcome}");
        sleep(20 * SECOND).await;
        given_back(&plant, family, away).await;
        sleep(60 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family} {away:?}: {outcome}");
        assert_eq!(plant.motor().snapshot().stop, None, "{family} {away:?}");
    })
    .await;
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_was_demanded_while_it_was_away_is_carried_out_when_it_is_back_at_the_latest() {
    each(async |family, away| {
        let mut plant = plant(family, away, OnControlTaken::Report);
        plant.run_at(30).await;
        taken(&mut plant, family, away).await;
        let outcome = plant.motor().stop(StopMode::Ramp).await;
        // A drive that obeys somebody else may obey a stop as well.
        assert!(away == Away::Control || !outcome.is_confirmed(), "{family} {away:?}: {outcome}");
        sleep(20 * SECOND).await;
        given_back(&plant, family, away).await;
        let motor = plant.motor();
        let confirmed = motor.wait_until(|snapshot| snapshot.stop.is_none());
        timeout(PATIENCE, confirmed).await.unwrap_or_else(|_| panic!("{family} {away:?}: it goes on"));
        assert!(!plant.machine().observe().running, "{family} {away:?}");
        sleep(60 * SECOND).await;
        assert!(!plant.machine().observe().running, "{family} {away:?}");
    })
    .await;
}

/// Two serial servers have exchanged their addresses, or two adapters their names: the port of a line was away for a moment, and
/// leads to the drive of another line.
#[tokio::test(start_paused = true)]
async fn the_drive_of_another_line_that_is_at_the_end_of_one_for_a_moment_lost_is_not_moved() {
    let sites = ["here", "there"].map(|name| {
        let settings = plant::controlled(Family::ATV312, name);
        Site::new(plant::common_settings(), vec![(Family::ATV312, plant::ADDRESS, settings)])
    });
    let [here, there] = &sites;
    let machines = sites.each_ref().map(|site| site.simulated.slave(plant::ADDRESS).expect("it is there"));
    let text = format!("{} set INV 170", machines[1].name());
    there.simulated.control(&text).expect("it is another drive");
    // Where the port leads, and what pulls it out.
    let leads_to = Arc::new(Mutex::new(here.simulated.clone()));
    let (pull, pulled) = watch::channel(0_u32);
    let open = {
        let leads_to = Arc::clone(&leads_to);
        move || {
            let far = leads_to.lock().expect("nobody panics with it").in_memory();
            let mut pulled = pulled.clone();
            pulled.mark_unchanged();
            let (ours, mut end) = duplex(512);
            spawn(async move {
                let mut far = far;
                tokio::select! {
                    _ = copy_bidirectional(&mut end, &mut far) => {}
                    _ = pulled.changed() => {}
                }
            });
            ready(Ok(ours))
        }
    };
    let line = Line::over_reopened(open, here.config());
    let settings = plant::controlled(Family::ATV312, MOTOR);
    let build = |port, slave| drives::drive(Family::ATV312, port, slave);
    let fleet = Fleet::builder().line("bench", line.clone()).drive("bench", plant::ADDRESS, settings, build);
    let fleet = fleet.start().expect("it can be fed");
    let motor = fleet.drive(MOTOR).expect("it is there");
    motor.ready(PATIENCE).await.expect("it gets ready");
    let known = motor.snapshot().identity.clone();
    let start = async || motor.start_at(Direction::Forward, Frequency::from_hertz(20)).await;

    // The same drive is there again, has said so, and is commanded as before.
    pull.send_modify(|times| *times += 1);
    sleep(2 * SECOND).await;
    let outcome = start().await;
    assert!(outcome.is_confirmed(), "{outcome}");
    assert_eq!(motor.snapshot().identity, known);
    let stopped = motor.stop(StopMode::Ramp).await;
    assert!(stopped.is_confirmed(), "{stopped}");
    sleep(5 * SECOND).await;

    *leads_to.lock().expect("nobody panics with it") = there.simulated.clone();
    pull.send_modify(|times| *times += 1);
    sleep(SECOND / 100).await;
    for _ in 0..3 {
        let outcome = start().await;
        assert!(matches!(outcome, Outcome::Refused(_)), "{outcome}");
        sleep(5 * SECOND).await;
        assert!(!machines[1].observe().running, "another motor runs");
    }
    assert_eq!(plant::Plant::writes(&machines[1]), 0);
    assert_eq!(line.stats().lost, 2);
    drop(fleet);
    line.close().await;
}
