//! `drived stop`: stops the motor of one drive.

use clap::ValueEnum;
use drive_core::StopMode;

use crate::{failure::Failure, one_drive::OneDriveArgs, output};

/// Stop the motor of one drive, again and again until the drive confirms it
///
/// A mode that the drive as it is set up does not have is replaced by one that stops; what was done is told. Exit code 1
/// when the stop is not confirmed after 5 s, or the motor does not stand after a minute.
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
    let mut one = args.one.stop()?;
    let status = one.stop(args.mode.into()).await?;
    output::say(format_args!("{} stands still: the drive shows {status}", one.name))?;
    one.close().await;
    Ok(())
}
