//! `drived start`: starts the motor of one drive.

use clap::ValueEnum;
use drive_core::{Direction, Status, StopMode};

use super::stop::stop as tell_stop;
use crate::{
    failure::Failure,
    one_drive::{OneDrive, OneDriveArgs},
    output,
    signals::Ending,
};

/// Start the motor of one drive at the setpoint that the drive holds
///
/// Refused when the drive has tripped, is not ready or is commanded by somebody else. The motor goes on when this
/// program has ended, unless the drive's own communication watchdog stops it: keep the line alive with `drived poll`.
/// Ctrl-C before the start is confirmed stops the motor again.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    one: OneDriveArgs,
    /// Which way
    #[arg(long, value_enum, default_value_t = Turn::Forward)]
    direction: Turn,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Turn {
    Forward,
    Reverse,
}

impl From<Turn> for Direction {
    fn from(turn: Turn) -> Self {
        match turn {
            Turn::Forward => Self::Forward,
            Turn::Reverse => Self::Reverse,
        }
    }
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    let mut one = args.one.open().await?;
    let direction = Direction::from(args.direction);
    let mut ending = Ending::listen()?;
    let status = start(&mut one, direction, ending.asked()).await?;
    output::say(format_args!("{} started {direction}: the drive shows {status}", one.name))?;
    one.close().await;
    Ok(())
}

/// Starts, unless it is asked to end before the drive has confirmed it: the run command may be on its way then, and
/// whoever takes a start back wants a motor that stands.
async fn start(
    one: &mut OneDrive,
    direction: Direction,
    asked_to_end: impl Future<Output = ()>,
) -> Result<Status, Failure> {
    let started = tokio::select! {
        biased;
        started = one.drive.start(direction) => started,
        () = asked_to_end => {
            let status = tell_stop(one, StopMode::Ramp).await?;
            return Err(Failure::Drive(format!(
                "{}: asked to end before the start was confirmed, so it was stopped again: the drive shows {status}",
                one.name
            )));
        }
    };
    started.map_err(|error| one.failure(&error))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use drive_bus::{Line, LineConfig};
    use drive_core::SerialSettings;
    use drive_families::Family;
    use drive_sim::{SimLine, Wiring};

    use super::*;
    use crate::simulated::{self, SetUp};

    #[tokio::test(start_paused = true)]
    async fn a_start_that_is_given_up_at_any_moment_leaves_no_motor_running() {
        for family in Family::ALL {
            let mut taken_back = 0;
            for after in (0..1_000).step_by(20).map(Duration::from_millis) {
                let settings: SerialSettings = family.capabilities().factory;
                let simulated = SimLine::new(Wiring::rtu(settings));
                let machine = simulated.add_boxed(1, simulated::model(family, SetUp::ForTheBus)).unwrap();
                let config = LineConfig { offline_after: 0, ..LineConfig::stream(settings) };
                let line = Line::over(simulated.in_memory(), config.clone());
                let name = format!("{family}@1").parse::<crate::drive_spec::DriveSpec>().unwrap().single();
                let mut one = OneDrive::over(name.unwrap(), line, config);
                one.drive.set_setpoint(drive_core::Frequency::from_hertz(20).into()).await.unwrap();
                let started = start(&mut one, Direction::Forward, tokio::time::sleep(after)).await;
                if let Err(failure) = &started {
                    assert!(failure.to_string().contains("so it was stopped again"), "{family}: {failure}");
                    taken_back += 1;
                }
                for _ in 0..20 {
                    tokio::time::sleep(Duration::from_millis(500)).await;
                    // The drive's own watchdog is no part of this.
                    one.drive.status().await.unwrap();
                }
                assert_eq!(machine.observe().running, started.is_ok(), "{family} after {after:?}");
            }
            assert!(taken_back > 0, "{family}");
        }
    }
}
