//! A simulated plant in virtual time, for the tests of what stands on it.

use std::{
    sync::Arc,
    time::{Duration, SystemTime},
};

use drive_bus::{Line, LineConfig};
use drive_core::{
    Control, Current, Direction, Error, Fault, FaultEntry, Faults, Identity, Lease, Motion, SelfRestart,
    SerialSettings, State, Status, StopMode,
};
use drive_families::{Family, Options, SetUp, simulated};
use drive_fleet::{
    Counters, DriveSettings, Fleet, IdentityCheck, Limit, Link, PendingStop, Snapshot, Timed, Trip,
    WatchdogCheck,
};
use drive_sim::{SimLine, SimSlave, Wiring};
use drive_testing::witness::Witnesses;
use tokio::time::Instant;

use super::{Plant, alarms::KeptAlarms, views::DriveView};
use drived_config::config::Group;

/// One line, named `north`, with Altivar 312: `pump 1`, `pump 2` … in the group `pumps`.
pub struct TestPlant {
    pub plant: Plant,
    pub line: SimLine,
    pub machines: Vec<SimSlave>,
    /// What the fleet tells is held against the machines.
    pub witnesses: Witnesses,
}

impl TestPlant {
    /// Drives that may be commanded.
    pub async fn of(drives: u8) -> Self {
        Self::with(drives, DriveSettings::controlled).await
    }

    /// Drives with these settings, each once it can be started or has been tried for long enough.
    pub async fn with(drives: u8, settings: impl Fn(String) -> DriveSettings) -> Self {
        Self::start(drives, settings, &KeptAlarms::default()).await
    }

    /// Drives that may be commanded, of a program that goes on with alarms that were kept.
    pub async fn keeping(drives: u8, kept: &KeptAlarms) -> Self {
        Self::start(drives, DriveSettings::controlled, kept).await
    }

    /// Drives of another family than Altivar 312 that may be commanded.
    pub async fn of_family(family: Family, drives: u8) -> Self {
        let options = family.simulated_options();
        let plant =
            Self::start_of((family, &options), drives, DriveSettings::controlled, &KeptAlarms::default())
                .await;
        let names = plant.plant.fleet().drives().into_iter().map(|drive| drive.name().to_string());
        plant.plant.set_options(names.map(|name| (name, options.clone())).collect());
        plant
    }

    async fn start(drives: u8, settings: impl Fn(String) -> DriveSettings, kept: &KeptAlarms) -> Self {
        Self::start_of((Family::ATV312, &simulated::options()), drives, settings, kept).await
    }

    async fn start_of(
        (family, options): (Family, &Options),
        drives: u8,
        settings: impl Fn(String) -> DriveSettings,
        kept: &KeptAlarms,
    ) -> Self {
        let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
        let config = LineConfig {
            response_timeout: Duration::from_millis(100),
            ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT)
        };
        let mut machines = Vec::new();
        for slave in 1..=drives {
            machines
                .push(line.add_boxed(slave, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap());
        }
        let port = Line::over(line.in_memory(), config);
        let mut builder = Fleet::builder().whatever_the_plan().line("north", port);
        let names: Vec<String> = (1..=drives).map(|slave| format!("pump {slave}")).collect();
        for (slave, name) in (1..).zip(&names) {
            builder = builder.drive("north", slave, settings(name.clone()), |port, slave| {
                family.open_with(port, slave, options)
            });
        }
        let fleet = builder.start().unwrap();
        let witnesses = Witnesses::of_fleet(&fleet, [("north", &line)]);
        let groups = vec![Group { name: "pumps".to_owned(), drives: names }];
        let plant = Plant::start_with(fleet, groups, false, kept, Default::default());
        for drive in plant.fleet().drives() {
            let _ = drive.ready(Duration::from_secs(10)).await;
        }
        Self { plant, line, machines, witnesses }
    }
}

impl TestPlant {
    /// As a reload does that exchanges the names of `pump 1` and `pump 2`.
    pub fn exchange_names(&self) {
        for (old, new) in [("pump 1", "neither"), ("pump 2", "pump 1"), ("neither", "pump 2")] {
            self.plant.fleet().rename(old, DriveSettings::controlled(new)).expect("nobody has the name");
            self.plant.renamed(old, new);
        }
    }
}

/// A drive as the API tells it, of which little is known.
pub fn told(name: &str) -> serde_json::Value {
    serde_json::json!({
        "name": name, "line": "north", "slave": 1, "family": "atv312", "control": true,
        "shows": "unknown", "link": "connected", "status": {"quality": "missing"},
        "measurements": {"quality": "missing"}, "started_here": false, "identity": {"check": "unchecked"}, "watchdog": {"check": "no_contract"}, "concerns": [],
        "counters": {"polls": 0, "answered": 0, "missed": 0, "failures": 0, "lost": 0, "trips": 0, "saves": 0},
    })
}

/// A drive as somebody reads it who was told this.
pub fn read(told: &serde_json::Value) -> DriveView {
    serde_json::from_value(told.clone()).unwrap_or_else(|error| panic!("{error}: {told}"))
}

impl Plant {
    /// No group starts before what it gives is dropped.
    pub async fn hold_group_starts(&self) -> impl Drop {
        self.0.group_starts.lock().await
    }
}

/// A drive with every pair of troubles, which came in either order: what is known of it, the same as somebody reads it whom
/// the API has told it, and its worst trouble in words.
pub fn every_pair_of_troubles(now: Instant) -> Vec<(Snapshot, DriveView, String)> {
    type Trouble = Box<dyn Fn(&mut Snapshot)>;
    let shown = |snapshot: &mut Snapshot, change: fn(&mut Status)| {
        let timed = snapshot.status.as_mut().expect("it has a status");
        let mut status = Status::clone(&timed.value);
        change(&mut status);
        timed.value = Arc::new(status);
    };
    let stop = |alarm, now| PendingStop {
        mode: StopMode::Ramp,
        since: now,
        attempts: 3,
        taken: false,
        alarm,
        undone: 0,
    };
    let error = || Error::Unsupported { what: "a test", reason: "it is one" };
    let identity = || Arc::new(Identity::default());
    let troubles: Vec<Trouble> = vec![
        Box::new(move |drive| drive.stop = Some(stop(true, now))),
        Box::new(move |drive| drive.stop = Some(stop(false, now))),
        Box::new(move |drive| drive.run_command_stands = Some(error())),
        Box::new(|drive| {
            (drive.link, drive.lease) = (Link::Lost, Some(Lease::new(Direction::Forward, 0x000F)));
        }),
        Box::new(|drive| drive.link = Link::Lost),
        Box::new(|drive| drive.link = Link::Connecting),
        Box::new(move |drive| shown(drive, |status| status.state = State::Fault)),
        Box::new(move |drive| {
            shown(drive, |status| status.state = State::Fault);
            let status = drive.status.clone().expect("it has a status");
            let faults = Faults { present: vec![Fault { code: 9, entry: Some(&OCF) }], ..Faults::default() };
            drive.trips = Arc::new([trip(status, faults, now)].into());
        }),
        Box::new(move |drive| shown(drive, |status| status.warning = Some(true))),
        Box::new(move |drive| {
            drive.identity = IdentityCheck::Changed { remembered: identity(), found: identity() };
        }),
        Box::new(move |drive| {
            let it_is = "it is an Altivar 28: atv28".into();
            drive.identity = IdentityCheck::OtherFamily { it_is, found: identity() };
        }),
        Box::new(|drive| drive.watchdog = WatchdogCheck::Broken("not kept".to_owned())),
        Box::new(|drive| drive.max_age = Duration::ZERO),
        Box::new(|drive| {
            let restart = SelfRestart { code: "Atr", meaning: "starts again" };
            (drive.self_restarts, drive.restarts_accepted) = (Some([restart].into()), false);
        }),
        Box::new(|drive| {
            let amperes = Current::from_deciamperes;
            drive.exceeded = vec![Limit::Current { measured: amperes(39), limit: amperes(35) }];
        }),
        Box::new(|drive| drive.control_taken = Some(Control::Panel)),
    ];
    let plain = untroubled(now);
    let mut all = Vec::new();
    for (first, one) in troubles.iter().enumerate() {
        for (second, other) in troubles.iter().enumerate().filter(|(second, _)| *second != first) {
            let mut drive = plain.clone();
            one(&mut drive);
            other(&mut drive);
            let mut told = told("pump 1");
            let known = serde_json::to_value(&drive).expect("it is told");
            if let Some((told, known)) = told.as_object_mut().zip(known.as_object()) {
                told.extend(known.clone());
            }
            let told = read(&told);
            let worst = drive.concern(now).unwrap_or_else(|| panic!("{first} and {second} trouble nobody"));
            all.push((drive, told, worst.to_string()));
        }
    }
    all
}

/// A fault as a manual lists it.
static OCF: FaultEntry = FaultEntry::new(9, "OCF", "overcurrent", "check the motor and the load");

fn trip(status: Timed<Status>, faults: Faults, at: Instant) -> Trip {
    Trip {
        at,
        wall: SystemTime::UNIX_EPOCH,
        found: false,
        before: None,
        status,
        faults: Some(Arc::new(faults)),
        by_watchdog: false,
        watchdog_after: None,
    }
}

/// A drive that answers, stands, and that nothing troubles; its status is a while old already.
fn untroubled(now: Instant) -> Snapshot {
    let status = Status { state: State::Ready, motion: Motion::AtRest, at: Some(now), ..Status::default() };
    let at = now.checked_sub(Duration::from_millis(1)).unwrap_or(now);
    Snapshot {
        name: "pump 1".into(),
        link: Link::Connected,
        error: None,
        status: Some(Timed { value: Arc::new(status), at }),
        retracted: false,
        measurements: None,
        setpoint: None,
        identity: IdentityCheck::CannotSay,
        watchdog: WatchdogCheck::NoContract { found: None },
        self_restarts: None,
        restarts_accepted: true,
        control_taken: None,
        run_command_stands: None,
        eeprom_worn: None,
        exceeded: Vec::new(),
        unmet: None,
        off_setpoint: None,
        stop: None,
        lease: None,
        suspended: None,
        start_refused: None,
        trips: Arc::default(),
        counters: Counters::default(),
        since: Vec::new(),
        max_age: Duration::from_secs(3),
        measurements_max_age: Duration::from_secs(13),
    }
}
