//! `drived stop`: stops the motor of one drive.

use clap::ValueEnum;
use drive_core::{Error, ErrorKind, Status, StopMode};

use crate::{
    drive_spec::DriveName,
    failure::Failure,
    one_drive::{OneDrive, OneDriveArgs},
    output,
    signals::Ending,
};

/// How often a stop is sent before it is given up with an alarm.
const ATTEMPTS: u32 = 5;

const UNCONFIRMED: &str = "STOP NOT CONFIRMED, the motor may turn: use the emergency stop";

/// Stop the motor of one drive, again and again until the drive confirms it
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
    /// How
    #[arg(long, value_enum, default_value_t = Mode::Ramp)]
    mode: Mode,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Along the deceleration ramp
    Ramp,
    /// Along the drive's short ramp
    Fast,
    /// By cutting the output: the motor coasts
    Freewheel,
    /// By injecting direct current
    DcInjection,
}

impl From<Mode> for StopMode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Ramp => Self::Ramp,
            Mode::Fast => Self::Fast,
            Mode::Freewheel => Self::Freewheel,
            Mode::DcInjection => Self::DcInjection,
        }
    }
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mode = StopMode::from(args.mode);
    check(args.one.name()?, mode)?;
    let mut one = args.one.open().await?;
    let mut ending = Ending::listen()?;
    let stopped = tokio::select! {
        biased;
        stopped = stop(&mut one, mode) => Some(stopped),
        () = ending.asked() => None,
    };
    let status = stopped.unwrap_or_else(|| {
        Err(Failure::Drive(format!("{UNCONFIRMED}. {}: asked to end before it was confirmed", one.name)))
    })?;
    let done = if status.is_standstill() { "stands still" } else { "is stopping" };
    output::say(format_args!("{} {done} ({mode} stop): the drive shows {status}", one.name))?;
    one.close().await;
    Ok(())
}

fn check(name: DriveName, mode: StopMode) -> Result<(), Failure> {
    let modes = name.family.capabilities().stop_modes;
    if modes.contains(&mode) {
        return Ok(());
    }
    let allowed = Mode::value_variants().iter().filter(|&&mode| modes.contains(&mode.into()));
    let allowed = allowed.filter_map(|mode| Some(mode.to_possible_value()?.get_name().to_owned()));
    Err(Failure::Input(format!(
        "{name}: a {} has no {mode} stop, so nothing was stopped: choose --mode {}",
        name.family.capabilities().name,
        allowed.collect::<Vec<_>>().join(" or ")
    )))
}

/// A stop is repeated until it is confirmed; only what no repetition can change ends it sooner.
pub(super) async fn stop(one: &mut OneDrive, mode: StopMode) -> Result<Status, Failure> {
    let mut why = None;
    for attempt in 1..=ATTEMPTS {
        let error = match one.drive.stop(mode).await {
            Ok(stopped) => return Ok(stopped.status),
            Err(error) => error,
        };
        tracing::info!(drive = %one.name, attempt, %error, "stop not confirmed");
        match error.kind() {
            ErrorKind::Unsupported | ErrorKind::Refused => return Err(alarm(one, &error)),
            _ => why = Some(error),
        }
        if attempt < ATTEMPTS {
            // Whoever waits for it has to know at once that the motor may turn. A reader who went away ends no stop.
            let _ = output::say(format_args!(
                "{} has not confirmed the stop ({attempt} of {ATTEMPTS}), it is sent again",
                one.name
            ));
        }
    }
    Err(why.map_or_else(
        || Failure::Drive(format!("{} was not asked to stop", one.name)),
        |why| alarm(one, &why),
    ))
}

fn alarm(one: &OneDrive, error: &Error) -> Failure {
    let Failure::Drive(text) = one.failure(error) else { return one.failure(error) };
    Failure::Drive(format!("{UNCONFIRMED}. {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive_spec::DriveSpec;

    #[test]
    fn a_mode_that_the_family_does_not_have_is_refused_with_those_that_it_has() {
        for family in drive_families::Family::ALL {
            let name = format!("{family}@1").parse::<DriveSpec>().unwrap().single().unwrap();
            for mode in StopMode::ALL {
                let has = family.capabilities().stop_modes.contains(&mode);
                assert_eq!(check(name, mode).is_ok(), has, "{family} {mode}");
            }
        }
    }
}
