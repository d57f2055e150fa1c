//! A stop that is undone, by another master or by a driver that does not send it: an alarm in its time, and a ticket that ends.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{
    Capabilities, Direction, Drive, Faults, Frequency, Lease, Lifetimes, Measurements, Result, Setpoint,
    SlaveAddress, Status, StopMode, Stopped, Written, registers::Row,
};
use drive_families::Family;
use drive_fleet::{DriveSettings, EventKind, Fleet, Outcome};
use drive_sim::{SimLine, Wiring};
use support::{
    drives,
    plant::{ADDRESS, MOTOR, PATIENCE, Plant, common_settings},
};
use tokio::time::{Instant, sleep, timeout};

const MS: Duration = Duration::from_millis(1);
/// The time of a stop.
const STANDSTILL: Duration = Duration::from_secs(5);

/// Another master that starts the motor again and again.
async fn runs_it(mut drive: Box<dyn Drive>, period: Duration) {
    loop {
        sleep(period).await;
        // What becomes of it shows in the motor: the stop is written between its words, too.
        let _ = drive.start(Direction::Forward).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_another_master_undoes_ends_in_its_time_and_is_an_alarm_unless_the_motor_stands() {
    for family in Family::BUILT_IN {
        let mut undone = 0;
        for period in [30, 100, 300, 410, 700] {
            // A witness takes every word of this bus for one of the fleet's.
            let plant = Plant::single(family, |settings| settings.times.standstill = STANDSTILL);
            let mut plant = plant.without_witnesses();
            plant.run_at(40).await;
            plant.events_so_far().await;
            let slave = SlaveAddress::try_from(ADDRESS).expect("it is one");
            let another = drives::drive(family, plant.lines[0].slave(ADDRESS), slave);
            let other = tokio::spawn(runs_it(another, period * MS));
            let began = Instant::now();
            let outcome = timeout(PATIENCE, plant.motor().stop(StopMode::Ramp)).await;
            let outcome = outcome.unwrap_or_else(|_| panic!("{family}, {period} ms: it does not end"));
            let after = began.elapsed();
            assert!(after <= STANDSTILL + 20 * MS, "{family}, {period} ms: {after:?}, {outcome}");
            let events = plant.events_so_far().await;
            let is_alarm = |kind: &EventKind| matches!(kind, EventKind::StopUnconfirmed { .. });
            if !outcome.is_confirmed() {
                undone += 1;
                assert!(matches!(outcome, Outcome::NotConfirmed(_)), "{family}, {period} ms: {outcome}");
                assert_eq!(events.iter().filter(|kind| is_alarm(kind)).count(), 1, "{family}, {period} ms");
                // It may have come to rest between two run commands since.
                let stop = plant.motor().snapshot().stop;
                assert!(stop.is_none_or(|stop| stop.alarm), "{family}, {period} ms: {stop:?}");
            }
            other.abort();
            let _ = other.await;
            if plant.motor().snapshot().stop.is_some() {
                let is_over = |kind: &EventKind| matches!(kind, EventKind::StopConfirmed { .. });
                plant.event("the stop goes on", is_over).await;
                assert!(!plant.machine().observe().running, "{family}, {period} ms");
            }
        }
        assert!(undone > 0, "{family}: nothing was undone");
    }
}

/// Altivar 21 Modbus §8.3 p. 24 leaves open whether bit 10 of FD01 ends with the order or with the motion, and the factory's ramp is 10 s.
#[tokio::test(start_paused = true)]
async fn a_motor_that_comes_down_for_longer_than_its_time_is_stopped_whatever_its_drive_calls_running() {
    for reading in ["ordered", "turning"] {
        for dec in [100, 600] {
            let change = |settings: &mut DriveSettings| settings.times.standstill = STANDSTILL;
            let mut plant = Plant::single(Family::ATV21, change);
            plant.happens(&format!("reading FD01.10 {reading}"));
            plant.happens(&format!("set DEC {dec}"));
            plant.run_at(40).await;
            plant.events_so_far().await;
            let outcome = plant.motor().stop(StopMode::Ramp).await;
            assert!(outcome.is_confirmed(), "{reading}, DEC {dec}: {outcome}");
            assert_eq!(plant.machine().observe().shaft_frequency, 0, "{reading}, DEC {dec}");
            let events = plant.events_so_far().await;
            let is_alarm = |kind: &EventKind| matches!(kind, EventKind::StopUnconfirmed { .. });
            assert!(!events.iter().any(is_alarm), "{reading}, DEC {dec}: {events:?}");
        }
    }
}

/// A driver that forgets to write: it reads, and says that it is done.
struct Forgetful {
    inner: Box<dyn Drive>,
    starts: bool,
}

#[async_trait::async_trait]
impl Drive for Forgetful {
    fn slave(&self) -> SlaveAddress {
        self.inner.slave()
    }

    fn capabilities(&self) -> &'static Capabilities {
        self.inner.capabilities()
    }

    fn lifetimes_mut(&mut self) -> &mut Lifetimes {
        self.inner.lifetimes_mut()
    }

    fn forget(&mut self) {
        self.inner.forget();
    }

    fn lease(&self) -> Option<Lease> {
        self.inner.lease()
    }

    fn adopt(&mut self, lease: Lease) {
        self.inner.adopt(lease);
    }

    async fn status(&mut self) -> Result<Status> {
        self.inner.status().await
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.inner.measurements().await
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.inner.faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        match self.starts {
            true => self.inner.start(direction).await,
            false => self.inner.status().await,
        }
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        Ok(Stopped::by(mode, self.inner.status().await?))
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.inner.set_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        self.inner.reset_faults().await
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.inner.keep_alive().await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.inner.read_parameter(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.inner.write_parameter(row, word).await
    }
}

/// A fleet of one drive by such a driver, and its simulated line.
fn by_a_forgetful_driver(family: Family, starts: bool) -> (Fleet, SimLine) {
    let settings = common_settings();
    let simulated = SimLine::new(Wiring::rtu(settings));
    simulated.add_boxed(ADDRESS, drives::machine(family)).expect("the address is free");
    let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
    let fleet = Fleet::builder()
        .line("north", line)
        .drive("north", ADDRESS, DriveSettings::controlled(MOTOR), move |port, slave| {
            Box::new(Forgetful { inner: drives::drive(family, port, slave), starts })
        })
        .start()
        .expect("it is built");
    (fleet, simulated)
}

#[tokio::test(start_paused = true)]
async fn a_driver_that_calls_a_stop_done_while_its_status_says_running_keeps_no_report_and_no_alarm_back() {
    for family in Family::BUILT_IN {
        let (fleet, _site) = by_a_forgetful_driver(family, true);
        let motor = fleet.drive(MOTOR).expect("it is there");
        motor.ready(PATIENCE).await.expect("it gets ready");
        assert!(motor.run(Direction::Forward, Frequency::from_hertz(30)).await.is_confirmed(), "{family}");
        let stop = fleet.stop_all(StopMode::Ramp);
        let report = timeout(PATIENCE, stop.finished()).await.expect("it ends");
        assert!(!report.is_confirmed(), "{family}: {report}");
        assert!(!stop.in_force().await.is_confirmed(), "{family}: it runs");
        let stop = motor.snapshot().stop.expect("it is repeated");
        assert!(stop.alarm && !stop.taken, "{family}: {stop:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_driver_that_calls_a_start_done_while_its_drive_shows_no_run_command_has_started_nothing() {
    for family in Family::BUILT_IN {
        let (fleet, site) = by_a_forgetful_driver(family, false);
        let motor = fleet.drive(MOTOR).expect("it is there");
        motor.ready(PATIENCE).await.expect("it gets ready");
        let outcome = motor.start(Direction::Forward).await;
        assert!(matches!(outcome, Outcome::NotConfirmed(_)), "{family}: {outcome}");
        assert!(!site.slave(ADDRESS).expect("it is there").observe().running);
    }
}

/// The cable is cut while a motor comes down along its ramp, and joined again: nobody has started it, and its ramp goes on.
#[tokio::test(start_paused = true)]
async fn a_ramp_on_which_the_line_was_away_goes_on_and_nobody_is_blamed_for_it() {
    for (family, away) in Family::BUILT_IN.into_iter().flat_map(|family| [(family, 1_500), (family, 4_000)]) {
        let plant = Plant::single(family, |settings| settings.watchdog = None);
        let machine = plant.machine().clone();
        let ramp = [
            (Family::ATV21, "set DEC 300"),
            (Family::ATV58, "set W253 300"),
            (Family::OMRON_3G3EV, "set n20 30"),
        ];
        let ramp = ramp.iter().find(|(of, _)| *of == family).map_or("set dEC 300", |(_, ramp)| ramp);
        plant.happens(ramp);
        plant.run_at(40).await;
        let motor = plant.motor();
        let stop = motor.stop(StopMode::Ramp);
        sleep(1_000 * MS).await;
        plant.happens("line cut");
        sleep(away * MS).await;
        let before = Plant::writes(&machine);
        plant.happens("line join");
        let outcome = timeout(PATIENCE, async {
            let mut watch = motor.watch();
            let mut stop = std::pin::pin!(stop.finished());
            loop {
                tokio::select! {
                    outcome = &mut stop => return outcome,
                    _ = watch.changed() => {
                        let undone = watch.look().stop.map_or(0, |stop| stop.undone);
                        assert_eq!(undone, 0, "{family}, away for {away} ms");
                    }
                }
            }
        });
        let outcome = outcome.await.unwrap_or_else(|_| panic!("{family}: never told"));
        let modes = outcome.stop().unwrap_or_else(|| panic!("{family}: {outcome}"));
        assert_eq!(modes.used, Some(StopMode::Ramp), "{family}, away for {away} ms: {outcome}");
        let writes = Plant::writes(&machine) - before;
        assert!(writes <= 1, "{family}, away for {away} ms: written {writes} times");
    }
}
