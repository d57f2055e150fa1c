//! The expected objects are written from the words of the fields, by hand.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, SystemTime},
};

use drive_bus::evidence::{Alike, Certainty, Defect, Finding};
use drive_core::{
    Command, Control, Current, Direction, Error, Fault, FaultEntry, Faults, Frequency, Ground, Identity,
    Lease, Measurements, Motion, Percent, PortError, RawWord, Reaction, Refusal, SelfRestart, SlaveAddress,
    Speed, State, Status, StopMode, Watchdog,
};
use serde_json::{Value, from_value, json, to_value};
use tokio::time::{Instant, advance};

use crate::{
    Act, Alarms, Band, Cause, ChangedWord, Commanders, Counters, DriveSettings, Event, EventKind, ExitAction,
    FrequencyLimits, IdentityCheck, LastSeen, Limit, LimitProblem, Link, OnExit, OnFault, OnLoss, Outcome,
    PendingStop, Periods, Policy, Refused, Snapshot, Started, StopReport, Timed, Trip, Unconfirmed, Unknown,
    WatchdogBefore, WatchdogCheck, WatchdogContract,
    view::{EventView, Happened, SnapshotView},
};

const STOP_CONFIRMED: EventKind = EventKind::StopConfirmed { mode: StopMode::Ramp, motion: Motion::AtRest };

static OLF: FaultEntry = FaultEntry::new(9, "OLF", "motor overload", "let the motor cool");

fn is(told: impl serde::Serialize, expected: Value) {
    assert_eq!(to_value(told).unwrap(), expected);
}

fn status(state: State) -> Timed<Status> {
    let frequency = Some(Frequency::from_hertz(30));
    let status = Status { state, motion: Motion::Driven, output_frequency: frequency, ..Status::default() };
    Timed::<Status>::new(status, Instant::now())
}

fn nothing_known() -> Snapshot {
    Snapshot {
        name: "pump 1".into(),
        link: Link::Connecting,
        error: None,
        status: None,
        retracted: false,
        measurements: None,
        setpoint: None,
        identity: IdentityCheck::Unchecked,
        watchdog: WatchdogCheck::NoContract { found: None },
        self_restarts: None,
        restarts_accepted: true,
        control_taken: None,
        run_command_stands: None,
        eeprom_worn: None,
        exceeded: Vec::new(),
        unmet: None,
        off_setpoint: None,
        since: Vec::new(),
        stop: None,
        lease: None,
        suspended: None,
        start_refused: Some(Refused::NotConnected),
        trips: Arc::default(),
        counters: Counters::default(),
        max_age: Duration::from_secs(3),
        measurements_max_age: Duration::from_secs(13),
    }
}

#[test]
fn a_drive_that_was_never_seen_has_no_value() {
    is(
        nothing_known(),
        json!({
            "name": "pump 1", "shows": "connecting", "link": "connecting", "status": {"quality": "missing"},
            "measurements": {"quality": "missing"}, "started_here": false, "identity": {"check": "unchecked"},
            "concerns": [{"kind": "never_seen", "rank": crate::ConcernKind::NeverSeen.rank(), "severity": "note", "wakes": false, "text": "not seen yet",
                "remedy": "wait, or look at its supply, its address and its cable"}],
            "watchdog": {"check": "no_contract"}, "start_refused": "the drive does not answer",
            "counters": {"polls": 0, "answered": 0, "missed": 0, "failures": 0, "lost": 0, "trips": 0, "saves": 0}
        }),
    );
}

#[tokio::test(start_paused = true)]
async fn a_snapshot_tells_what_is_known_with_the_age_and_quality_of_each_value() {
    let setpoint = Some(Frequency::from_hertz(30).into());
    let measurements = Measurements { torque: Some(Percent::from_percent(40)), ..Measurements::default() };
    let identity = Identity { model: Some("ATV312HU15N4".to_owned()), ..Identity::default() };
    let armed = Watchdog { timeout: Some(Duration::from_secs(10)), reaction: Some(Reaction::Ramp) };
    let restart = SelfRestart { code: "Atr", meaning: "starts the motor again by itself" };
    let stop = PendingStop {
        mode: StopMode::Ramp,
        since: Instant::now(),
        attempts: 2,
        taken: false,
        alarm: true,
        undone: 0,
    };
    let measurements = Some(Timed::<Measurements>::new(measurements, Instant::now()));
    advance(Duration::from_secs(10)).await;
    let snapshot = Snapshot {
        link: Link::Connected,
        status: Some(status(State::Running)),
        measurements,
        setpoint,
        identity: IdentityCheck::Same(Arc::new(identity)),
        watchdog: WatchdogCheck::Verified(armed),
        self_restarts: Some([restart].into()),
        stop: Some(stop),
        lease: Some(Lease::new(Direction::Forward, 0x000F)),
        suspended: None,
        start_refused: None,
        ..nothing_known()
    };
    advance(Duration::from_millis(120)).await;
    is(
        &snapshot,
        json!({
            "name": "pump 1", "shows": "stop_pending", "link": "connected",
            "status": {"quality": "good", "age_ms": 120, "state": "running", "motion": "driven",
                "output_frequency_hz": 30.0, "raw": []},
            "measurements": {"quality": "good", "age_ms": 10_120, "before_trip": false, "torque_percent": 40.0, "raw": []},
            "setpoint": {"frequency_hz": 30.0}, "reached": true,
            "stop": {"mode": "ramp", "since_ms": 10_120, "attempts": 2, "taken": false, "alarm": true},
            "started_here": true, "starts_by_itself": ["Atr"],
            "concerns": [{"kind": "stop_unconfirmed", "rank": 0, "severity": "alarm", "wakes": true, "since_ms": 10_120,
                "text": "STOP NOT CONFIRMED, the motor may turn: ramp stop, sent in 2 attempts",
                "detail": "ramp stop, sent in 2 attempts",
                "remedy": "use the emergency stop, then look at the drive"}],
            "identity": {"check": "same", "model": "ATV312HU15N4", "codes": []},
            "watchdog": {"check": "verified", "time_ms": 10_000, "reaction": "ramp"},
            "counters": {"polls": 0, "answered": 0, "missed": 0, "failures": 0, "lost": 0, "trips": 0, "saves": 0}
        }),
    );
    advance(Duration::from_secs(3)).await;
    let told = to_value(&snapshot).unwrap();
    assert_eq!((&told["status"]["quality"], &told["status"]["age_ms"]), (&json!("stale"), &json!(3_120)));
    assert_eq!((&told["measurements"]["quality"], told.get("reached")), (&json!("stale"), None));
    assert_eq!(told["start_refused"], "its status is too old");
}

#[test]
fn a_fault_is_told_as_long_as_the_drive_shows_it_with_the_statuses_around_it() {
    let faults = Faults { present: vec![Fault { code: 9, entry: Some(&OLF) }], ..Faults::default() };
    let trip = Trip {
        at: Instant::now(),
        wall: SystemTime::now(),
        found: false,
        before: Some(status(State::Running)),
        status: status(State::Fault),
        faults: Some(Arc::new(faults)),
        by_watchdog: false,
        watchdog_after: None,
    };
    let trips = Arc::new(VecDeque::from([trip]));
    let tripped = Snapshot { link: Link::Lost, status: Some(status(State::Fault)), trips, ..nothing_known() };
    let fault = to_value(&tripped).unwrap()["fault"].clone();
    for (key, value) in [
        ("code", json!(9)),
        ("mnemonic", json!("OLF")),
        ("meaning", json!("motor overload")),
        ("remedy", json!("let the motor cool")),
        ("by_watchdog", json!(false)),
    ] {
        assert_eq!(fault[key], value, "{fault}");
    }
    assert_eq!((&fault["before"]["state"], &fault["at_trip"]["state"]), (&json!("running"), &json!("fault")));
    let cleared = Snapshot { status: Some(status(State::Ready)), ..tripped };
    assert_eq!(to_value(cleared).unwrap().get("fault"), None);
}

#[test]
fn what_could_be_checked_of_identity_and_watchdog_is_told_in_words() {
    let identity = |model: &str| Arc::new(Identity { model: Some(model.to_owned()), ..Identity::default() });
    let changed = IdentityCheck::Changed { remembered: identity("A"), found: identity("B") };
    is(
        changed,
        json!({"check": "changed", "model": "B", "codes": [], "remembered": {"model": "A", "codes": []}}),
    );
    is(IdentityCheck::CannotSay, json!({"check": "cannot_say"}));
    let off = Watchdog { timeout: None, reaction: None };
    is(WatchdogCheck::WaitsForStandstill(off), json!({"check": "waits_for_standstill"}));
    is(WatchdogCheck::NoContract { found: Some(off) }, json!({"check": "no_contract"}));
    is(WatchdogCheck::Unchecked, json!({"check": "unchecked"}));
    is(WatchdogCheck::Broken("not kept".to_owned()), json!({"check": "broken", "why": "not kept"}));
}

#[test]
fn an_outcome_is_one_of_seven_words_with_its_reason() {
    let slave = SlaveAddress::try_from(7).unwrap();
    let because = Some(Refusal::NotInControl(Control::Panel));
    let over = Unconfirmed::TimeOver { after: Duration::from_secs(2), last: None, because, stop: None };
    let asked = Frequency::from_hertz(31);
    let band = Band { low: Frequency::from_hertz(30), high: Frequency::from_hertz(32) };
    let setpoint = Speed::from_rpm(900).into();
    let problem = drive_core::SetpointProblem::TooLarge;
    let denied =
        Error::NotConfirmed { slave, command: Command::Release, status: Box::default(), because: None };
    for (outcome, word, reason) in [
        (Outcome::Confirmed, "confirmed", None),
        (Outcome::NothingStood, "nothing", None),
        (Outcome::Expired, "expired", None),
        (Outcome::OutcomeUnknown(Unknown::default()), "unknown", None),
        (Outcome::NotConfirmed(over), "not_confirmed", Some("not_remote")),
        (Outcome::NotConfirmed(Unconfirmed::Denied(denied)), "not_confirmed", Some("denied")),
        (Outcome::NotConfirmed(Unconfirmed::Lost), "not_confirmed", Some("offline")),
        (
            Outcome::not_started(Frequency::from_hertz(10).into(), None, None),
            "not_confirmed",
            Some("not_started"),
        ),
        (Outcome::OutcomeUnknown(Unknown { abandoned: true, ..Unknown::default() }), "unknown", None),
        (Outcome::NotConfirmed(Unconfirmed::Superseded), "superseded", Some("later_command")),
        (Outcome::NotConfirmed(Unconfirmed::Stopped), "superseded", Some("stop")),
        (Outcome::Refused(Refused::Superseded), "superseded", Some("later_command")),
        (Outcome::Refused(Refused::Stopped), "superseded", Some("stop")),
        (Outcome::Refused(Refused::Commander("guest".to_owned())), "refused", Some("no_right")),
        (Outcome::Refused(Refused::Because(Refusal::Fault(9))), "refused", Some("fault")),
        (
            Outcome::Refused(Refused::Limit(LimitProblem::Forbidden { asked, band })),
            "refused",
            Some("forbidden_band"),
        ),
        (
            Outcome::Refused(Refused::Drive(Error::Setpoint { slave, setpoint, problem })),
            "refused",
            Some("limit"),
        ),
    ] {
        let told = to_value(&outcome).unwrap();
        assert_eq!((&told["outcome"], told.get("reason")), (&json!(word), reason.map(Value::from).as_ref()));
        assert_eq!(told.get("text").is_some(), word != "confirmed", "{told}");
        // The log, the audit log and the text of its event have the same.
        let said = outcome.to_string().replace(' ', "_");
        assert!(said.split(':').next().is_some_and(|kind| kind.contains(word)), "{word}: {said}");
    }
    is(
        Outcome::Started(Started {
            direction: Direction::Forward,
            reference: Some(Frequency::ZERO),
            turns_round: false,
        }),
        json!({
            "outcome": "confirmed", "started": {"direction": "forward", "reference_hz": 0.0},
            "text": "started forward at 0.00 Hz: its setpoint is zero"
        }),
    );
    let reference = Some(Frequency::from_hertz(20));
    is(
        Outcome::Started(Started { direction: Direction::Reverse, reference, turns_round: true }),
        json!({
            "outcome": "confirmed", "started": {"direction": "reverse", "reference_hz": 20.0, "turns_round": true},
            "text": "started reverse at 20.00 Hz: its motor still turns the other way, and comes down first"
        }),
    );
    is(
        Outcome::Refused(Refused::ReadOnly),
        json!({"outcome": "refused", "reason": "read_only", "text": "the drive is only read: its settings say control = false"}),
    );
}

#[tokio::test(start_paused = true)]
async fn an_event_tells_its_wall_time_and_what_belongs_to_it() {
    let told = |kind| to_value(Event::now("pump 1", kind, Cause::Drive)).unwrap();
    let command = EventKind::Command {
        command: Command::Start(Direction::Forward),
        setpoint: Some(Frequency::from_hertz(30).into()),
        commander: "operator".into(),
        outcome: Outcome::Expired,
    };
    let mut event = told(command);
    event.as_object_mut().unwrap().remove("time_unix_ms").unwrap();
    assert_eq!(
        event,
        json!({
            "order": 0, "drive": "pump 1", "event": "command", "alarm": false, "cause": {"by": "drive"},
            "text": "command: start forward at 30.00 Hz by operator: expired: its time was over before it was sent: it never will be",
            "command": {
                "action": "start", "command": "start forward", "direction": "forward", "given": {"frequency_hz": 30.0},
                "commander": "operator", "outcome": "expired",
                "text": "its time was over before it was sent: it never will be"
            }
        })
    );
    let exit = told(EventKind::Exit(ExitAction::Stopped(Outcome::Confirmed)));
    assert_eq!(exit["exit"], json!({"action": "stopped", "outcome": "confirmed"}));
    assert_eq!(told(EventKind::Exit(ExitAction::TimeOver))["exit"], json!({"action": "time_over"}));
    assert_eq!(told(EventKind::WatchdogBroken("not kept".to_owned()))["event"], "watchdog_broken");

    let hour = Duration::from_secs(3_600);
    let event =
        Event { wall: SystemTime::UNIX_EPOCH + hour, ..Event::now("pump 1", STOP_CONFIRMED, Cause::Drive) };
    advance(Duration::from_secs(10)).await;
    assert_eq!(to_value(event).unwrap()["time_unix_ms"], 3_600_000, "the wall's clock as it stood then");
}

/// One of every kind, with everything that it may carry.
fn every_kind() -> Vec<EventKind> {
    let slave = SlaveAddress::try_from(7).unwrap();
    let exchange = drive_core::Exchange { function: 6, register: Some(8_601) };
    let error = || Error::Port { slave, exchange, problem: PortError::Closed };
    let identity = |model: &str| Arc::new(Identity { model: Some(model.to_owned()), ..Identity::default() });
    let watchdog = Watchdog { timeout: Some(Duration::from_secs(10)), reaction: Some(Reaction::Ramp) };
    let before = WatchdogBefore { identity: "one".to_owned(), set: watchdog, found: watchdog };
    let seen = LastSeen { status: status(State::Running).value, age: Duration::from_millis(120) };
    let over = Unconfirmed::TimeOver {
        after: Duration::from_secs(2),
        last: Some(seen.clone()),
        because: None,
        stop: None,
    };
    let unknown =
        Outcome::OutcomeUnknown(Unknown { error: Some(error()), last: Some(seen), ..Unknown::default() });
    let faults = Faults { present: vec![Fault { code: 9, entry: Some(&OLF) }], ..Faults::default() };
    let trip = Box::new(Trip {
        at: Instant::now(),
        wall: SystemTime::now(),
        found: true,
        before: Some(status(State::Running)),
        status: status(State::Fault),
        faults: Some(Arc::new(faults)),
        by_watchdog: true,
        watchdog_after: Some(Duration::from_secs(3)),
    });
    let amperes = Current::from_deciamperes;
    vec![
        EventKind::Connected(status(State::Ready).value),
        EventKind::Lost { silent_for: Duration::from_secs(3), error: Some(error()) },
        EventKind::Lost { silent_for: Duration::from_secs(3), error: None },
        EventKind::StateChanged { from: State::Ready, to: State::Running },
        EventKind::Tripped(trip.clone()),
        EventKind::TripExplained(trip.clone()),
        EventKind::FaultChanged(trip),
        EventKind::FaultCleared,
        EventKind::Warning { present: true },
        EventKind::Limit {
            limit: Limit::Current { measured: amperes(39), limit: amperes(35) },
            exceeded: true,
        },
        EventKind::Limit {
            limit: Limit::Frequency { measured: Frequency::from_hertz(30), limit: Frequency::from_hertz(20) },
            exceeded: true,
        },
        EventKind::Limit {
            limit: Limit::MotorThermal {
                measured: Percent::from_percent(101),
                limit: Percent::from_percent(95),
            },
            exceeded: false,
        },
        EventKind::ControlTaken(Control::Panel),
        EventKind::ControlElsewhere(Control::Local),
        EventKind::ControlReturned,
        EventKind::StartTookCommand(Control::OtherBus),
        EventKind::RunCommandStands(error()),
        EventKind::RestartsItself {
            by: [SelfRestart { code: "Atr", meaning: "starts the motor again" }].into(),
            accepted: false,
        },
        EventKind::Identified(identity("A")),
        EventKind::IdentityChanged { remembered: identity("A"), found: identity("B") },
        EventKind::WatchdogVerified { watchdog, written: true, before: Some(Arc::new(before)) },
        EventKind::SetUpOtherwise { because: Refusal::Tripped, present: true },
        EventKind::SetUpOtherwise { because: Refusal::MotorRunning, present: false },
        EventKind::WatchdogBroken("not kept".to_owned()),
        EventKind::WatchdogNotInForce("off".to_owned()),
        EventKind::WatchdogRestored(watchdog),
        EventKind::WatchdogStays { timeout: Duration::from_secs(10), why: "the motor turns" },
        EventKind::Command {
            command: Command::Start(Direction::Forward),
            setpoint: Some(Frequency::from_hertz(30).into()),
            commander: "operator".into(),
            outcome: Outcome::NotConfirmed(over),
        },
        EventKind::Command {
            command: Command::Setpoint(Speed::from_rpm(900).into()),
            setpoint: None,
            commander: "operator".into(),
            outcome: Outcome::Refused(Refused::Drive(error())),
        },
        EventKind::StopModeReplaced { asked: StopMode::Ramp, used: StopMode::Freewheel, why: Some("Stt") },
        EventKind::StopTookCommand(Control::Terminals),
        EventKind::StopUnconfirmed { since: Duration::from_secs(2), attempts: 3, outcome: unknown.clone() },
        STOP_CONFIRMED,
        EventKind::OutputBlocked(Refusal::Tripped),
        EventKind::ReferenceTaken(Refusal::MotorRunning),
        EventKind::CommandOverridden(Refusal::NotInControl(Control::Panel)),
        EventKind::ContractChanged(Ground::Limits),
        EventKind::DriverPanicked("it is not written yet".to_owned()),
        EventKind::LineFinding {
            finding: Finding {
                defect: Defect::FirstByteCut,
                slave: Some(3),
                share: (20, 40),
                certainty: Certainty::Certain,
            },
            present: true,
        },
        EventKind::LineFinding {
            finding: Finding {
                defect: Defect::SecondMaster(Some(Duration::from_millis(4_500))),
                slave: None,
                share: (4, 4),
                certainty: Certainty::CannotBeToldFrom(Alike::OldAnswers),
            },
            present: false,
        },
        EventKind::Reconfigured(vec!["periods"]),
        EventKind::Renamed(Arc::from("pump 1")),
        EventKind::Exit(ExitAction::Stopped(unknown)),
        EventKind::Exit(ExitAction::TimeOver),
        EventKind::Removed(ExitAction::Left),
    ]
}

#[tokio::test(start_paused = true)]
async fn an_event_of_every_kind_reads_back_as_it_was_told_with_its_fields_and_its_cause() {
    let act = Act::of("operator").through("page").with_id("c-12");
    let causes = [Cause::Command(act), Cause::Policy { policy: Policy::Removal }, Cause::Drive, Cause::Found];
    let word = RawWord { address: 3_201, code: "ETA", value: 0x27 };
    for (order, kind) in (1..).zip(every_kind()) {
        let cause = causes[order as usize % causes.len()].clone();
        let words = [ChangedWord { word, before: Some(0x23) }, ChangedWord { word, before: None }].into();
        let name = kind.name().replace(' ', "_");
        let event = Event { order, words, ..Event::now("pump 1", kind, cause) };
        let told = to_value(&event).unwrap();
        assert_eq!(told["event"], name, "the name of a kind is the same in the log and in JSON");
        let fields = ["order", "time_unix_ms", "drive", "event", "alarm", "text", "cause", "words"];
        let others = told.as_object().unwrap().keys().filter(|key| !fields.contains(&key.as_str()));
        let has_none = matches!(event.kind, EventKind::FaultCleared | EventKind::ControlReturned);
        assert_eq!(others.count() == 0, has_none, "{told}");
        let read: EventView = from_value(told.clone()).unwrap_or_else(|error| panic!("{error}: {told}"));
        assert_eq!(read, EventView::from(&event));
        assert_eq!(to_value(&read).unwrap(), told);
    }
    let told = to_value(Event::now("pump 1", EventKind::FaultCleared, causes[0].clone())).unwrap();
    assert_eq!(
        told["cause"],
        json!({"by": "command", "commander": "operator", "door": "page", "act": "c-12"})
    );
    let read: EventView = from_value(told).unwrap();
    assert_eq!(read.what, Happened::FaultCleared);
}

#[tokio::test(start_paused = true)]
async fn a_snapshot_reads_back_as_it_was_told() {
    let nothing = nothing_known();
    let now = Instant::now();
    let whole = Snapshot {
        link: Link::Connected,
        status: Some(status(State::Running)),
        setpoint: Some(Speed::from_rpm(900).into()),
        identity: IdentityCheck::CannotSay,
        watchdog: WatchdogCheck::Broken("not kept".to_owned()),
        stop: Some(PendingStop {
            mode: StopMode::Fast,
            since: now,
            attempts: 1,
            taken: true,
            alarm: false,
            undone: 0,
        }),
        since: vec![(crate::ConcernKind::WatchdogBroken, now)],
        ..nothing_known()
    };
    for snapshot in [nothing, whole] {
        let told = to_value(&snapshot).unwrap();
        let read: SnapshotView = from_value(told.clone()).unwrap();
        assert_eq!(read, SnapshotView::of(&snapshot, now));
        assert_eq!(to_value(&read).unwrap(), told);
    }
}

#[test]
fn a_stop_of_several_drives_names_each_that_is_not_confirmed() {
    let lost = Error::Port {
        slave: SlaveAddress::try_from(2).unwrap(),
        exchange: drive_core::Exchange { function: 6, register: None },
        problem: PortError::Closed,
    };
    let report = StopReport {
        confirmed: vec!["pump 1".into()],
        unconfirmed: vec![("pump 2".into(), Outcome::Refused(Refused::Drive(lost)))],
        ..StopReport::default()
    };
    is(
        report,
        json!({
            "confirmed": ["pump 1"], "read_only": [], "broadcasts": [],
            "unconfirmed": [{"drive": "pump 2", "outcome": "refused", "reason": "no_answer", "text": "slave 2, function 06h: the line is closed",
                "error": {"kind": "not_sent", "text": "slave 2, function 06h: the line is closed"}}]
        }),
    );
}

#[test]
fn settings_read_back_as_they_were_told_and_what_is_not_said_is_usual() {
    let hertz = Frequency::from_hertz;
    let settings = DriveSettings {
        commanders: Commanders::Only(vec!["operator".to_owned()]),
        limits: FrequencyLimits {
            low: Some(hertz(10)),
            high: Some(hertz(50)),
            forbidden: vec![Band { low: hertz(30), high: hertz(32) }],
            change_per_second: None,
        },
        alarms: Alarms { current: Some(Current::from_deciamperes(35)), ..Alarms::default() },
        watchdog: Some(WatchdogContract { timeout: Duration::from_secs(10), reaction: Reaction::Ramp }),
        on_exit: OnExit::Release(StopMode::Fast),
        on_loss: OnLoss::Stop(StopMode::Ramp),
        on_fault: OnFault::ResetWatchdogTrip,
        ..DriveSettings::controlled("pump 1")
    };
    let told = json!({
        "name": "pump 1", "control": true, "commanders": {"only": ["operator"]},
        "periods": {"running_ms": 500, "rest_ms": 1_000, "slow_ms": 10_000, "max_age_ms": 3_000},
        "times": {"lifetime_ms": 1_000, "effect_ms": 5_000, "reference_ms": 60_000, "standstill_ms": 60_000, "stop_alarm_ms": 2_000},
        "limits": {"low_hz": 10.0, "high_hz": 50.0, "forbidden_hz": [[30.0, 32.0]]},
        "alarms": {"current_a": 3.5}, "watchdog": {"time_ms": 10_000, "reaction": "ramp"},
        "on_exit": {"release": "fast"}, "on_exit_adopted": "report",
        "on_exit_watchdog": "restore_in_ram", "on_loss": {"stop": "ramp"}, "on_fault": "reset_watchdog_trip",
        "on_control_taken": "withdraw", "accept_self_restart": [], "accept_resume": []
    });
    is(&settings, told.clone());
    assert_eq!(from_value::<DriveSettings>(told).unwrap(), settings);
    let least = from_value::<DriveSettings>(json!({"name": "fan"})).unwrap();
    assert_eq!(least, DriveSettings::watched("fan"));
    let periods = from_value::<Periods>(json!({"slow_ms": 0})).unwrap();
    assert_eq!(periods, Periods { slow: Duration::ZERO, ..Periods::default() });
    for wrong in [json!({"low_hz": 10.005}), json!({"lowest_hz": 10.0}), json!({"forbidden_hz": [[30.0]]})] {
        assert!(from_value::<FrequencyLimits>(wrong.clone()).is_err(), "{wrong}");
    }
}

#[cfg(feature = "schemars")]
#[test]
fn the_schema_of_a_snapshot_names_its_keys() {
    let schema = schemars::schema_for!(Snapshot);
    let properties = schema.get("properties").and_then(Value::as_object).unwrap();
    for key in ["name", "link", "status", "identity", "watchdog", "counters"] {
        assert!(properties.contains_key(key), "{key}");
    }
}
