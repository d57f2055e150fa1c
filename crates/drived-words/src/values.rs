//! What a drive tells of itself, as labels with values in their units, for whatever face lists them. What it does not tell is
//! not there.

use std::time::Duration;

use drive_core::{Fault, Identity, Measurements, Motion, RawWord, Status, Watchdog};
use drive_fleet::{Counters, FrequencyLimits, IdentityCheck, WatchdogCheck};

use crate::output;

/// Labels with their values.
pub type Values = Vec<(&'static str, String)>;

/// Those that are there.
fn told<const N: usize>(values: [(&'static str, Option<String>); N]) -> Values {
    values.into_iter().filter_map(|(label, value)| Some((label, value?))).collect()
}

/// The state of a drive, with its direction.
pub fn state(status: &Status) -> String {
    let direction = status.direction.map(|direction| format!(", {direction}")).unwrap_or_default();
    let at_reference = if status.at_reference == Some(true) { ", at reference" } else { "" };
    format!("{}{direction}{at_reference}", status.state)
}

/// The other values of the fast set.
pub fn status(status: &Status) -> Values {
    let presence = |present: bool| if present { "present" } else { "none" }.to_owned();
    told([
        ("output frequency", status.output_frequency.map(|value| value.to_string())),
        ("shaft", (!status.motion.is_not_known()).then(|| status.motion.to_string())),
        ("motor current", output::current(status)),
        ("control", status.control.map(|value| value.to_string())),
        ("fault code", status.fault_code.filter(|&code| code != 0).map(|code| code.to_string())),
        ("warning", status.warning.map(presence)),
        ("words", words(&status.raw)),
    ])
}

/// What a motor does whose stop is confirmed.
pub const fn stopped(status: Option<&Status>) -> &'static str {
    match status {
        Some(Status { motion: Motion::AtRest, .. }) => "stands still",
        Some(Status { motion: Motion::Held, .. }) => "is held at rest by direct current",
        Some(Status { motion: Motion::Coasting, .. }) => "has no output, the shaft may coast",
        _ => "has taken the stop",
    }
}

/// Words as a drive sent them; nothing where there are none.
fn words(raw: &[RawWord]) -> Option<String> {
    let words: Vec<String> = raw.iter().map(|word| format!("{} {:04X}h", word.code, word.value)).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// What a service file is read for: how long a drive and its motor have run, and what they took.
pub fn worked(values: &Measurements) -> [(&'static str, Option<String>); 4] {
    let hours = |time: Duration| match time.as_secs() / 360 {
        tenths if tenths % 10 == 0 => format!("{} h", tenths / 10),
        tenths => format!("{}.{} h", tenths / 10, tenths % 10),
    };
    [
        ("running time", values.running_time.map(hours)),
        ("powered time", values.powered_time.map(hours)),
        ("input energy", values.input_energy.map(|value| value.to_string())),
        ("output energy", values.output_energy.map(|value| value.to_string())),
    ]
}

/// The values of the slow set.
pub fn measurements(values: &Measurements) -> Values {
    let mut all = measured(values);
    all.extend(told(worked(values)));
    all
}

/// The same without [what it worked](worked).
pub fn measured(values: &Measurements) -> Values {
    fn shown(value: Option<impl std::fmt::Display>) -> Option<String> {
        value.map(|value| value.to_string())
    }
    let bits = |word: u16| format!("{word:016b}");
    let before = "some are from before the trip, and stand in the drive's words alone";
    told([
        ("measured", values.before_trip.then(|| before.to_owned())),
        ("reference", shown(values.reference)),
        ("speed", shown(values.speed)),
        ("output voltage", shown(values.output_voltage)),
        ("output voltage", shown(values.output_voltage_share)),
        ("line voltage", shown(values.line_voltage)),
        ("DC bus voltage", shown(values.dc_bus_voltage)),
        ("DC bus voltage", shown(values.dc_bus_voltage_share)),
        ("torque", shown(values.torque)),
        ("power", shown(values.power_share)),
        ("input power", shown(values.input_power)),
        ("output power", shown(values.output_power)),
        ("drive thermal", shown(values.drive_thermal)),
        ("motor thermal", shown(values.motor_thermal)),
        ("drive load", shown(values.drive_load)),
        ("motor load", shown(values.motor_load)),
        ("inputs", values.inputs.map(bits)),
        ("outputs", values.outputs.map(bits)),
    ])
}

/// What a drive says it is, where it has said it.
pub fn identity(check: &IdentityCheck) -> Option<&Identity> {
    match check {
        IdentityCheck::Same(found)
        | IdentityCheck::Changed { found, .. }
        | IdentityCheck::OtherFamily { found, .. } => Some(found),
        IdentityCheck::Unchecked | IdentityCheck::CannotSay => None,
    }
}

/// Whether a drive is the one that it was.
pub const fn identity_check(check: &IdentityCheck) -> &'static str {
    match check {
        IdentityCheck::Same(_) => "the drive that the program knows",
        IdentityCheck::Changed { .. } => "ANOTHER DRIVE than the one that the program knows",
        IdentityCheck::OtherFamily { .. } => "A DRIVE OF ANOTHER FAMILY than it is configured as",
        IdentityCheck::CannotSay => "a drive of this family cannot be told from another of its kind",
        IdentityCheck::Unchecked => "not checked yet",
    }
}

/// A communication watchdog as it was found.
pub const fn found_watchdog(check: &WatchdogCheck) -> Option<&Watchdog> {
    match check {
        WatchdogCheck::NoContract { found } => found.as_ref(),
        WatchdogCheck::WaitsForStandstill(found) | WatchdogCheck::Verified(found) => Some(found),
        WatchdogCheck::Unchecked | WatchdogCheck::Broken(_) => None,
    }
}

/// What is known of a communication watchdog.
pub fn watchdog(check: &WatchdogCheck) -> String {
    let word = match check {
        WatchdogCheck::NoContract { .. } => "no contract",
        WatchdogCheck::Unchecked => "not read yet",
        WatchdogCheck::WaitsForStandstill(_) => "waits for standstill",
        WatchdogCheck::Verified(_) => "verified",
        WatchdogCheck::Broken(why) => return format!("NOT as the contract says: {why}"),
    };
    let found = found_watchdog(check);
    let time = found.and_then(|found| found.timeout).map(output::age);
    let reaction = found.and_then(|found| found.reaction).map(|reaction| reaction.to_string());
    [Some(word.to_owned()), time, reaction].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The limits of setpoints; empty where there are none.
pub fn limits(limits: &FrequencyLimits) -> String {
    let ends = [(limits.low, "from"), (limits.high, "to")];
    let ends = ends.into_iter().filter_map(|(end, word)| Some(format!("{word} {}", end?)));
    let bands = limits.forbidden.iter().map(|band| format!("not {} to {}", band.low, band.high));
    ends.chain(bands).collect::<Vec<_>>().join(", ")
}

/// What was counted of a drive.
pub fn counters(counters: Counters) -> String {
    let Counters { polls, answered, missed, failures, lost, trips, saves, .. } = counters;
    let told = [
        ("polls", polls),
        ("answered", answered),
        ("missed", missed),
        ("failures", failures),
        ("lost", lost),
        ("trips", trips),
        ("saves", saves),
    ];
    told.map(|(name, count)| format!("{name} {count}")).join(", ")
}

/// By which fault a drive has tripped; its code alone where nothing more is known.
pub fn tripped(fault: Option<&Fault>) -> String {
    match fault {
        None => "it has named no fault".to_owned(),
        Some(fault) if fault.entry.is_none() => {
            format!("code {}, whose meaning is not known here", fault.code)
        }
        Some(fault) => fault.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, Frequency, State};
    use drive_fleet::Band;

    use super::*;

    #[test]
    fn what_a_drive_does_not_tell_is_left_out() {
        let status = Status {
            state: State::Running,
            direction: Some(Direction::Reverse),
            at_reference: Some(true),
            output_frequency: Some(Frequency::from_hertz(30)),
            fault_code: Some(0),
            ..Status::default()
        };
        assert_eq!(state(&status), "running, reverse, at reference");
        assert_eq!(super::status(&status), [("output frequency", "30.00 Hz".to_owned())]);
    }

    #[test]
    fn limits_are_told_with_their_forbidden_bands_and_units() {
        let hertz = Frequency::from_hertz;
        let band = Band { low: hertz(30), high: Frequency::from_decihertz(325) };
        let told = FrequencyLimits {
            low: Some(hertz(10)),
            high: Some(hertz(50)),
            forbidden: vec![band],
            ..FrequencyLimits::default()
        };
        assert_eq!(limits(&told), "from 10.00 Hz, to 50.00 Hz, not 30.00 Hz to 32.50 Hz");
        assert_eq!(limits(&FrequencyLimits::default()), "");
    }
}
