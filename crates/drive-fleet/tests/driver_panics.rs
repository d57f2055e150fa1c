//! A driver that panics: a fault of the program, such as in a family that its user has written. Its drive goes on being supervised, and
//! above all stopped.

use std::{
    panic::resume_unwind,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    time::Duration,
};

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{
    Capabilities, Direction, Drive, Faults, Frequency, Identity, Lease, Lifetimes, Measurements, Refusal,
    Result, Row, SerialSettings, Setpoint, SlaveAddress, Status, StopMode, Stopped, Written, async_trait,
};
use drive_fleet::{DriveHandle, DriveSettings, Event, EventKind, Fleet, Outcome, Received};
use drive_sim::{SimLine, SimSlave, Wiring, models::atv312};

/// Where it panics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum In {
    Status,
    Stop,
    /// Behind the run word.
    Start,
    Measurements,
    Lease,
    Unmet,
    /// When a status is dropped that waits for its answer.
    DroppedStatus,
}

/// How often it panics yet, and where.
#[derive(Clone)]
struct Fault(In, Arc<AtomicU32>);

impl Fault {
    fn strikes(&self, here: In) {
        let take = |times: u32| times.checked_sub(1);
        if self.0 == here && self.1.fetch_update(Ordering::SeqCst, Ordering::SeqCst, take).is_ok() {
            // As a panic, without a page on the standard error for each.
            resume_unwind(Box::new(format!("{here:?} is not written yet")));
        }
    }

    fn arm(&self, times: u32) {
        self.1.store(times, Ordering::SeqCst);
    }
}

struct AtDrop<'a>(&'a Fault, bool);

impl Drop for AtDrop<'_> {
    fn drop(&mut self) {
        if self.1 {
            self.0.strikes(In::DroppedStatus);
        }
    }
}

/// A sixth family, by somebody who has not finished it.
struct Unfinished<D> {
    drive: D,
    fault: Fault,
}

#[async_trait]
impl<D: Drive> Drive for Unfinished<D> {
    fn slave(&self) -> SlaveAddress {
        self.drive.slave()
    }

    fn capabilities(&self) -> &'static Capabilities {
        self.drive.capabilities()
    }

    fn lifetimes_mut(&mut self) -> &mut Lifetimes {
        self.drive.lifetimes_mut()
    }

    fn forget(&mut self) {
        self.drive.forget();
    }

    fn lease(&self) -> Option<Lease> {
        self.fault.strikes(In::Lease);
        self.drive.lease()
    }

    fn adopt(&mut self, lease: Lease) {
        self.drive.adopt(lease);
    }

    fn unmet(&self) -> Option<Refusal> {
        self.fault.strikes(In::Unmet);
        self.drive.unmet()
    }

    async fn status(&mut self) -> Result<Status> {
        self.fault.strikes(In::Status);
        let mut dropped = AtDrop(&self.fault, true);
        let status = self.drive.status().await;
        dropped.1 = false;
        status
    }

    async fn measurements(&mut self) -> Result<Measurements> {
        self.fault.strikes(In::Measurements);
        self.drive.measurements().await
    }

    async fn faults(&mut self) -> Result<Faults> {
        self.drive.faults().await
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        let started = self.drive.start(direction).await;
        self.fault.strikes(In::Start);
        started
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.fault.strikes(In::Stop);
        self.drive.stop(mode).await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.drive.set_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        self.drive.reset_faults().await
    }

    async fn identify(&mut self) -> Result<Identity> {
        self.drive.identify().await
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.drive.keep_alive().await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.drive.read_parameter(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.drive.write_parameter(row, word).await
    }
}

struct Rig {
    _site: SimLine,
    fleet: Fleet,
    pump: DriveHandle,
    machine: SimSlave,
    fault: Fault,
}

impl Rig {
    /// A pump that is ready and whose driver has no fault yet.
    async fn ready(place: In) -> Self {
        let settings = SerialSettings::MODBUS_DEFAULT;
        let site = SimLine::new(Wiring::rtu(settings));
        let machine = site.add(1, atv312::Atv312::under_bus_control()).unwrap();
        let line = Line::over(site.in_memory(), LineConfig::stream(settings));
        let fault = Fault(place, Arc::default());
        let of_driver = fault.clone();
        let fleet = Fleet::builder()
            .line("north", line)
            .drive("north", 1, DriveSettings::controlled("pump"), move |port, slave| {
                Box::new(Unfinished { drive: Atv312::new(port, slave), fault: of_driver })
            })
            .start()
            .unwrap();
        let pump = fleet.drive("pump").unwrap();
        pump.ready(Duration::from_secs(10)).await.unwrap();
        Self { _site: site, fleet, pump, machine, fault }
    }

    /// The same, and its motor runs.
    async fn running(place: In) -> Self {
        let rig = Self::ready(place).await;
        let started = rig.pump.run(Direction::Forward, Frequency::from_hertz(20)).await;
        assert!(started.is_confirmed(), "{started}");
        rig
    }

    /// All that has happened so far.
    async fn events(&self) -> Vec<Event> {
        let mut events = self.fleet.events();
        let mut told = Vec::new();
        while let Ok(Received::Event(event)) =
            tokio::time::timeout(Duration::from_millis(1), events.recv()).await
        {
            told.push(event);
        }
        told
    }

    async fn panics_told(&self) -> Vec<Event> {
        let told = self.events().await.into_iter();
        told.filter(|event| matches!(event.kind, EventKind::DriverPanicked(_))).collect()
    }
}

const FOR_EVER: u32 = u32::MAX;

#[tokio::test(start_paused = true)]
async fn a_panic_in_a_stop_is_an_error_of_that_attempt_and_the_stop_is_sent_again() {
    let rig = Rig::running(In::Stop).await;
    rig.fault.arm(3);
    let stopped = rig.pump.stop(StopMode::Ramp).await;
    assert!(stopped.is_confirmed(), "{stopped}");
    assert!(!rig.machine.observe().running);
    let told = rig.panics_told().await;
    assert_eq!(told.len(), 1, "it is told once: {told:?}");
    assert!(told[0].kind.is_alarm());
    assert!(told[0].kind.to_string().contains("Stop is not written yet"), "{}", told[0].kind);
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_panics_at_each_attempt_is_an_alarm_with_its_reason_and_never_told_as_the_end_of_the_fleet()
 {
    let rig = Rig::running(In::Stop).await;
    rig.fault.arm(FOR_EVER);
    let stopped = rig.pump.stop(StopMode::Ramp).await;
    assert!(matches!(stopped, Outcome::OutcomeUnknown(_)), "{stopped}");
    assert!(stopped.to_string().contains("its driver panicked"), "{stopped}");
    assert!(rig.pump.snapshot().stop.is_some_and(|stop| stop.alarm), "it goes on, and is an alarm");
    // Whatever becomes of its driver, it is stopped.
    rig.fault.arm(0);
    assert!(rig.pump.stop(StopMode::Ramp).await.is_confirmed());
}

#[tokio::test(start_paused = true)]
async fn a_drive_whose_status_panics_is_lost_with_that_reason_and_its_stop_reaches_the_wire() {
    let rig = Rig::running(In::Status).await;
    rig.fault.arm(FOR_EVER);
    let lost = rig.pump.wait_until(|snapshot| snapshot.link == drive_fleet::Link::Lost).await;
    assert!(lost.error.as_ref().is_some_and(|error| error.to_string().contains("its driver panicked")));
    assert!(lost.start_refused.is_some());
    let told = rig.panics_told().await;
    assert_eq!(told.len(), 1, "{told:?}");
    let stop = rig.pump.stop(StopMode::Ramp);
    rig.machine.wait_until(|seen| !seen.running).await;
    // What cannot be seen is not told as seen.
    let stopped = stop.await;
    assert!(!stopped.is_confirmed(), "{stopped}");
}

#[tokio::test(start_paused = true)]
async fn a_start_whose_driver_panics_behind_its_run_word_is_judged_by_what_the_drive_shows() {
    let rig = Rig::ready(In::Start).await;
    rig.fault.arm(1);
    let started = rig.pump.start_at(Direction::Forward, Frequency::from_hertz(20)).await;
    assert!(rig.machine.observe().running);
    assert!(started.is_confirmed(), "{started}");
}

#[tokio::test(start_paused = true)]
async fn what_a_driver_panics_in_at_once_keeps_no_status_and_no_stop_from_the_drive() {
    for place in [In::Lease, In::Unmet, In::Measurements] {
        let rig = Rig::running(place).await;
        rig.fault.arm(FOR_EVER);
        tokio::time::sleep(Duration::from_secs(60)).await;
        assert_eq!(rig.panics_told().await.len(), 1, "{place:?}");
        let snapshot = rig.pump.snapshot();
        assert!(snapshot.fresh_status(tokio::time::Instant::now()).is_some(), "{place:?}");
        let stopped = rig.pump.stop(StopMode::Ramp).await;
        assert!(stopped.is_confirmed(), "{place:?}: {stopped}");
        assert!(!rig.machine.observe().running, "{place:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_for_which_a_call_is_cut_that_panics_by_it_reaches_the_wire() {
    let rig = Rig::running(In::DroppedStatus).await;
    rig.fault.arm(FOR_EVER);
    // A status is under way, for the motor runs and nothing else is asked of its drive.
    rig.machine.hold_next_answer();
    rig.machine.wait_until_held().await;
    let stop = rig.pump.stop(StopMode::Ramp);
    let stopped = stop.await;
    assert!(stopped.is_confirmed(), "{stopped}");
    assert!(!rig.machine.observe().running);
    assert_eq!(rig.panics_told().await.len(), 1);
}
