//! Each kind of event in a sentence.

use std::fmt;

use drive_core::Motion;

use super::EventKind;
use crate::{outcome::Tenths, snapshot::Trip};

impl fmt::Display for EventKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Connected(status) => write!(f, ": {status}"),
            Self::Lost { silent_for, error: Some(error) } => {
                write!(f, " for {}: {error}", Tenths(*silent_for))
            }
            Self::Lost { silent_for, error: None } => write!(f, " for {}", Tenths(*silent_for)),
            Self::StateChanged { from, to } => write!(f, ": {from} to {to}"),
            Self::Tripped(trip) | Self::TripExplained(trip) | Self::FaultChanged(trip) => {
                trip_details(f, trip)
            }
            Self::Warning { present } => write!(f, ": {}", if *present { "present" } else { "gone" }),
            Self::Limit { limit, exceeded } => {
                write!(f, ": {limit}, {}", if *exceeded { "exceeded" } else { "kept again" })
            }
            Self::ControlTaken(control) => write!(f, " by {control}"),
            Self::ControlElsewhere(control) => write!(f, ": with {control}"),
            Self::StartTookCommand(other) => write!(f, " from {other}"),
            Self::Reconfigured(settings) => write!(f, ": {}", settings.join(", ")),
            Self::Renamed(old) => write!(f, ": it was called {old}"),
            Self::Identified(identity) => write!(f, ": {}", identity),
            Self::IdentityChanged { remembered, found } => {
                write!(f, ": {} instead of {}", found, remembered)
            }
            Self::OtherFamily { it_is, .. } => write!(f, ": {it_is}"),
            Self::SetUpOtherwise { because, present } => {
                write!(f, "{}: {because}", if *present { "" } else { ", not any more; it was" })
            }
            Self::RunAdopted(lease) => {
                write!(
                    f,
                    ": the run command {} of an earlier run of this program stands, it is ours again",
                    lease.direction
                )
            }
            Self::RunNotAdopted(why) => write!(f, ": whatever turns the motor is not ours: {why}"),
            Self::WatchdogVerified { watchdog, written, .. } => {
                let how = if *written { "written and read back" } else { "found so" };
                match watchdog.timeout {
                    Some(timeout) => write!(f, ": {timeout:?}, {how}"),
                    None => write!(f, ": off, {how}"),
                }
            }
            Self::WatchdogBroken(why) | Self::WatchdogNotInForce(why) => write!(f, ": {why}"),
            Self::WatchdogRestored(watchdog) => match watchdog.timeout {
                Some(timeout) => {
                    write!(f, " to {timeout:?}, as it was found: it acts when nobody speaks to it")
                }
                None => f.write_str(": off, as it was found"),
            },
            Self::WatchdogStays { timeout, why } => {
                write!(f, ", it acts {timeout:?} after the last message: {why}")
            }
            Self::EepromWritten { by, ledger } => write!(f, " by {by}: {ledger}"),
            Self::Command { command, setpoint: Some(setpoint), commander, outcome } => {
                write!(f, ": {command} at {setpoint} by {commander}: {outcome}")
            }
            Self::Command { command, setpoint: None, commander, outcome } => {
                write!(f, ": {command} by {commander}: {outcome}")
            }
            Self::RunCommandStands(error) => {
                write!(f, ", it may start the motor when control is given back: {error}")
            }
            Self::RestartsItself { by, accepted } => {
                let settings: Vec<String> = by.iter().map(ToString::to_string).collect();
                let judged = if *accepted { "accepted" } else { "not accepted, so that a start is refused" };
                write!(f, ": {} ({judged})", settings.join(", "))
            }
            Self::StopModeReplaced { asked, used, why } => {
                write!(f, ": {used} stop instead of {asked}")?;
                why.map_or(Ok(()), |why| write!(f, ", {why}"))
            }
            Self::StopTookCommand(other) => write!(f, " from {other}, and keeps it until it is released"),
            Self::StopUnconfirmed { since, attempts, outcome } => {
                write!(f, " since {} after {attempts} attempts: {outcome}", Tenths(*since))
            }
            Self::Exit(action) | Self::Removed(action) => write!(f, ": {action}"),
            Self::StopConfirmed { motion: Motion::Coasting, .. } => write!(f, ": {}", Motion::Coasting),
            Self::OutputBlocked(because)
            | Self::ReferenceTaken(because)
            | Self::CommandOverridden(because) => {
                write!(f, ": {because}")
            }
            Self::ContractChanged(ground) => write!(f, ": {ground}"),
            Self::DriverPanicked(said) => write!(f, ", a fault of the program: {said}"),
            Self::ValueWithdrawn => f.write_str(": another answer came to the same question"),
            Self::LineFinding { finding, present } => {
                let whose = if finding.slave.is_some() { "" } else { "the line: " };
                write!(f, "{}: {whose}{finding}", if *present { "" } else { ", not any more" })?;
                match finding.next().first().filter(|_| *present) {
                    Some(next) => write!(f, ". Next: {next}"),
                    None => Ok(()),
                }
            }
            Self::FaultCleared | Self::ControlReturned | Self::StopConfirmed { .. } => Ok(()),
        }
    }
}

fn trip_details(f: &mut fmt::Formatter<'_>, trip: &Trip) -> fmt::Result {
    if trip.found {
        f.write_str(", found so")?;
    }
    if trip.by_watchdog {
        f.write_str(" by its communication watchdog")?;
    }
    if let Some(silence) = trip.watchdog_after {
        write!(f, " after {} without a message", Tenths(silence))?;
    }
    match trip.faults.as_deref().and_then(|faults| faults.present.first()) {
        Some(fault) => write!(f, ": {fault}"),
        None => match trip.status.value.fault_code {
            Some(code) => write!(f, ": fault {code}"),
            None => Ok(()),
        },
    }
}
