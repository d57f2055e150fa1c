//! What is told of each drive, from its snapshot: a value that is not known or too old is absent.

use drive_core::{
    Current, Frequency, Identity, Measurements, Percent, Power, Setpoint, Speed, State, Status, Voltage,
};
use drive_fleet::{DriveHandle, Freshness, IdentityCheck, LinePlan, Link, Snapshot, WatchdogCheck};
use tokio::time::Instant;

use super::{samples::Samples, table::Id};
use drived_words::json::unix;

/// Its labels are the ids of its line and its own.
pub(super) fn collect(labels: [&str; 2], plan: Option<LinePlan>, drive: &DriveHandle, samples: &mut Samples) {
    let (snapshot, now) = (drive.snapshot(), Instant::now());
    tell_whole(&snapshot, drive, labels, now, samples);
    if snapshot.link == Link::Connected {
        tell_watchdog(&snapshot, plan, labels, samples);
    }
    if let Some(status) = snapshot.fresh_status(now) {
        tell_status(status, &snapshot, labels, samples);
    }
    let measured = snapshot.measurements.as_ref();
    if let Some(measured) = measured.filter(|_| snapshot.measurements_freshness(now) == Freshness::Fresh) {
        tell_measurements(&measured.value, labels, samples);
    }
}

/// What holds whether the drive answers or not.
fn tell_whole(
    snapshot: &Snapshot,
    drive: &DriveHandle,
    labels: [&str; 2],
    now: Instant,
    samples: &mut Samples,
) {
    let [line, id] = labels;
    let identity = match &snapshot.identity {
        IdentityCheck::Same(identity)
        | IdentityCheck::Changed { found: identity, .. }
        | IdentityCheck::OtherFamily { found: identity, .. } => Some(identity),
        IdentityCheck::Unchecked | IdentityCheck::CannotSay => None,
    };
    let said =
        |value: fn(&Identity) -> &Option<String>| identity.and_then(|identity| value(identity).as_deref());
    let model = said(|identity| &identity.model).unwrap_or_default();
    let firmware = said(|identity| &identity.version).unwrap_or_default();
    let (settings, address) = (drive.settings(), drive.slave().number().to_string());
    let family = drive.capabilities().key;
    samples.add(Id::DriveInfo, &[line, id, drive.name(), &address, family, model, firmware], 1.0);
    samples.add(Id::DriveUp, &labels, flag(snapshot.link == Link::Connected));
    let last = snapshot.status.as_ref().map(|status| unix(status.at) as f64 / 1_000.0);
    samples.add_known(Id::DriveLastAnswer, &labels, last);
    samples.add_known(Id::DriveCurrentLimit, &labels, settings.alarms.current.map(amperes));
    let counters = &snapshot.counters;
    for (id, count) in [
        (Id::DriveTrips, counters.trips),
        (Id::DrivePolls, counters.polls),
        (Id::DriveMissed, counters.missed),
        (Id::DriveLost, counters.lost),
        (Id::DriveSaves, counters.saves),
    ] {
        samples.count(id, &labels, count);
    }
    let pending = snapshot.stop.map(|stop| now.saturating_duration_since(stop.since).as_secs_f64());
    samples.add_known(Id::DriveStopPending, &labels, pending);
    for concern in snapshot.concerns(now) {
        samples.add(Id::DriveConcern, &[line, id, concern.kind.word()], 1.0);
    }
    samples.add(Id::DriveStopUnconfirmed, &labels, flag(snapshot.stop.is_some_and(|stop| stop.alarm)));
}

fn tell_watchdog(snapshot: &Snapshot, plan: Option<LinePlan>, labels: [&str; 2], samples: &mut Samples) {
    let timeout = match &snapshot.watchdog {
        WatchdogCheck::NoContract { found: Some(found) } | WatchdogCheck::Verified(found) => found.timeout,
        WatchdogCheck::NoContract { found: None } | WatchdogCheck::Unchecked => return,
        WatchdogCheck::WaitsForStandstill(_) | WatchdogCheck::Broken(_) => None,
    };
    samples.add(Id::DriveWatchdogArmed, &labels, flag(timeout.is_some()));
    let Some(timeout) = timeout else { return };
    samples.add(Id::DriveWatchdogTimeout, &labels, timeout.as_secs_f64());
    let margin = plan.map(|plan| timeout.as_secs_f64() - plan.feed(timeout).heard_within().as_secs_f64());
    samples.add_known(Id::DriveWatchdogMargin, &labels, margin);
}

fn tell_status(status: &Status, snapshot: &Snapshot, labels: [&str; 2], samples: &mut Samples) {
    let [line, name] = labels;
    // Those that it is not in are told too.
    for state in State::ALL {
        let is_in = flag(state == status.state);
        samples.add(Id::DriveState, &[line, name, &state.to_string().replace(' ', "_")], is_in);
    }
    samples.add_known(Id::DriveFrequency, &labels, status.output_frequency.map(hertz));
    samples.add_known(Id::DriveCurrent, &labels, status.current.map(amperes));
    samples.add_known(Id::DriveCurrentShare, &labels, status.current_share.map(ratio));
    samples.add_known(Id::DriveWarning, &labels, status.warning.map(flag));
    match snapshot.setpoint {
        Some(Setpoint::Frequency(setpoint)) => samples.add(Id::DriveSetpoint, &labels, hertz(setpoint)),
        Some(Setpoint::Speed(setpoint)) => samples.add(Id::DriveSetpointSpeed, &labels, rpm(setpoint)),
        Some(Setpoint::Share(_)) | None => {}
    }
    if let Some(control) = status.control {
        samples.add(Id::DriveInControl, &[line, name, &control.to_string().replace(' ', "_")], 1.0);
    }
    if let Some(trip) = snapshot.present_trip() {
        let fault = trip.fault();
        let code = fault.map(|fault| fault.code.to_string()).unwrap_or_default();
        let mnemonic = fault.map_or("?", |fault| fault.mnemonic());
        samples.add(Id::DriveFault, &[line, name, &code, mnemonic], 1.0);
    }
}

fn tell_measurements(measured: &Measurements, labels: [&str; 2], samples: &mut Samples) {
    let [line, name] = labels;
    for (id, value) in [
        (Id::DriveSpeed, measured.speed.map(rpm)),
        (Id::DriveMotorVoltage, measured.output_voltage.map(volts)),
        (Id::DriveMotorVoltageShare, measured.output_voltage_share.map(ratio)),
        (Id::DriveBusVoltage, measured.dc_bus_voltage.map(volts)),
        (Id::DriveBusVoltageShare, measured.dc_bus_voltage_share.map(ratio)),
        (Id::DriveLineVoltage, measured.line_voltage.map(volts)),
        (Id::DriveTorque, measured.torque.map(ratio)),
        (Id::DrivePowerShare, measured.power_share.map(ratio)),
        (Id::DrivePower, measured.output_power.map(watts)),
        (Id::DriveInputPower, measured.input_power.map(watts)),
        (Id::DriveRunning, measured.running_time.map(|time| time.as_secs_f64())),
        (Id::DrivePowered, measured.powered_time.map(|time| time.as_secs_f64())),
    ] {
        samples.add_known(id, &labels, value);
    }
    for (id, motor, drive) in [
        (Id::DriveThermal, measured.motor_thermal, measured.drive_thermal),
        (Id::DriveLoad, measured.motor_load, measured.drive_load),
    ] {
        samples.add_known(id, &[line, name, "motor"], motor.map(ratio));
        samples.add_known(id, &[line, name, "drive"], drive.map(ratio));
    }
}

fn flag(is_so: bool) -> f64 {
    if is_so { 1.0 } else { 0.0 }
}

fn hertz(frequency: Frequency) -> f64 {
    f64::from(frequency.centihertz()) / 100.0
}

fn rpm(speed: Speed) -> f64 {
    f64::from(speed.rpm())
}

fn amperes(current: Current) -> f64 {
    f64::from(current.deciamperes()) / 10.0
}

fn volts(voltage: Voltage) -> f64 {
    f64::from(voltage.decivolts()) / 10.0
}

fn ratio(share: Percent) -> f64 {
    f64::from(share.hundredths()) / 10_000.0
}

fn watts(power: Power) -> f64 {
    f64::from(power.decawatts()) * 10.0
}
