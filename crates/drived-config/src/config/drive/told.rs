//! What the settings of a drive come to, in words for a person.

use std::time::Duration;

use drive_fleet::{
    Alarms, Commanders, FrequencyLimits, OnControlTaken, OnExit, OnExitAdopted, OnExitWatchdog, OnFault,
    OnLoss, Periods,
};

use crate::config::DrivePart;

pub(super) fn commands(drive: &DrivePart) -> Option<String> {
    Some(match &drive.settings.commanders {
        _ if !drive.settings.control => "none: it is only read".to_owned(),
        Commanders::Anyone => "by anyone".to_owned(),
        Commanders::Only(names) if names.is_empty() => "by nobody; a stop by anyone".to_owned(),
        Commanders::Only(names) => format!("by {}; a stop by anyone", names.join(", ")),
    })
}

pub(super) fn status(drive: &DrivePart) -> Option<String> {
    let Periods { running, rest, max_age, .. } = drive.settings.periods;
    Some(format!(
        "every {running:?} running, {rest:?} at rest; lost without one for {max_age:?}, or once its line calls it off-line"
    ))
}

pub(super) fn measurements(drive: &DrivePart) -> Option<String> {
    Some(match drive.settings.periods.slow {
        Duration::ZERO => "never".to_owned(),
        slow => format!("every {slow:?}"),
    })
}

pub(super) fn watchdog(drive: &DrivePart) -> Option<String> {
    let contract = drive.settings.watchdog;
    let contract = contract.map(|contract| format!("{:?}, then {}", contract.timeout, contract.reaction));
    Some(contract.unwrap_or_else(|| "left as it is".to_owned()))
}

pub(super) fn setpoints(drive: &DrivePart) -> Option<String> {
    let FrequencyLimits { low, high, forbidden, change_per_second } = &drive.settings.limits;
    let bounds = [
        low.map(|low| format!("from {low}")),
        high.map(|high| format!("to {high}")),
        change_per_second.map(|change| format!("changed by {change} a second at the most")),
    ];
    let bands = forbidden.iter().map(|band| format!("not {} to {}", band.low, band.high));
    listed(bounds.into_iter().flatten().chain(bands))
}

pub(super) fn alarms(drive: &DrivePart) -> Option<String> {
    let Alarms { current, drive_thermal, motor_thermal } = drive.settings.alarms;
    let above = [
        current.map(|value| format!("current above {value}")),
        drive_thermal.map(|value| format!("drive thermal state above {value}")),
        motor_thermal.map(|value| format!("motor thermal state above {value}")),
    ];
    listed(above.into_iter().flatten())
}

pub(super) fn at_exit(drive: &DrivePart) -> Option<String> {
    Some(match drive.settings.on_exit {
        OnExit::Stop(mode) => format!("stopped if it was started here ({mode} stop)"),
        OnExit::Release(mode) => {
            format!("stopped if it was started here ({mode} stop), control back to panel or terminals")
        }
        OnExit::Leave => "left as it is".to_owned(),
    })
}

pub(super) fn turning_at_exit(drive: &DrivePart) -> Option<String> {
    let then = match (drive.settings.on_exit, drive.settings.on_exit_adopted) {
        (OnExit::Leave, _) => return None,
        (_, OnExitAdopted::Stop(mode)) => format!("stopped too ({mode} stop)"),
        (OnExit::Stop(_), OnExitAdopted::Report) => "left, and is an alarm".to_owned(),
        _ => "left".to_owned(),
    };
    Some(format!("a motor that was not started here is {then}"))
}

pub(super) fn watchdog_at_exit(drive: &DrivePart) -> Option<String> {
    let wears = drive.name.family.capabilities().watchdog.is_some_and(|watchdog| watchdog.wears);
    let restores = match drive.settings.on_exit_watchdog {
        OnExitWatchdog::RestoreInRam => !wears,
        OnExitWatchdog::Restore => true,
        OnExitWatchdog::Leave => false,
    };
    let afterwards = match restores {
        true => "put back at standstill to what was found",
        false => "stays armed: it trips the drive when nobody speaks to it",
    };
    drive.settings.watchdog.map(|_| afterwards.to_owned())
}

pub(super) fn when_lost(drive: &DrivePart) -> Option<String> {
    Some(match drive.settings.on_loss {
        OnLoss::Report => "reported".to_owned(),
        OnLoss::Stop(mode) => format!("reported, and stopped when it is there again ({mode} stop)"),
    })
}

pub(super) fn when_tripped(drive: &DrivePart) -> Option<String> {
    let is_named = drive.name.family.capabilities().communication_fault.is_some();
    let then = match drive.settings.on_fault {
        OnFault::Report => "",
        OnFault::ResetWatchdogTrip if is_named => "; a trip of the watchdog is reset once the line is back",
        OnFault::ResetWatchdogTrip => "; its manual names no code for a trip of the watchdog: none is reset",
    };
    Some(format!("reported{then}"))
}

pub(super) fn control_taken(drive: &DrivePart) -> Option<String> {
    let then = match drive.settings.on_control_taken {
        OnControlTaken::Withdraw => "is withdrawn, so that nothing starts by it afterwards",
        OnControlTaken::Report => "stands",
    };
    Some(format!("reported; the run command {then}"))
}

pub(super) fn self_restart(drive: &DrivePart) -> Option<String> {
    let accepted = listed(drive.settings.accept_self_restart.iter().cloned());
    let accepted = accepted.map(|settings| format!("accepted by {settings}"));
    Some(accepted.unwrap_or_else(|| "a start is refused while a setting of the drive does that".to_owned()))
}

pub(super) fn resume(drive: &DrivePart) -> Option<String> {
    let lacks: Vec<String> = drive.settings.accept_resume.iter().map(ToString::to_string).collect();
    (!lacks.is_empty()).then(|| format!("goes on by itself when it has its {} again", lacks.join(" or its ")))
}

pub(super) fn coasts(drive: &DrivePart) -> Option<String> {
    drive.settings.coast.map(|time| format!("at rest {time:?} after its output was cut"))
}

pub(super) fn injection(drive: &DrivePart) -> Option<String> {
    drive.settings.injection.map(|time| format!("held for {time:?}, then the motor is taken to stand"))
}

pub(super) fn options(drive: &DrivePart) -> Option<String> {
    listed(drive.options.iter().map(|(name, text)| format!("{name} = {text}")))
}

fn listed(all: impl Iterator<Item = String>) -> Option<String> {
    let all: Vec<String> = all.collect();
    (!all.is_empty()).then(|| all.join(", "))
}
