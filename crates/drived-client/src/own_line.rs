//! A line that a subcommand opens itself, and what a person reads of the drives on it.

use std::time::Duration;

use drive_bus::{Line, LineConfig, OpenError};
use drive_core::{Drive, Error, ErrorKind, Lifetimes, PortError};
use drive_families::Options;
pub use drived_plant::plant::parameters::may_have_written;
pub use drived_words::closing::close;

use drived_words::{drive_options, drive_spec::DriveName, failure::Failure, ports, signals::Ending};

/// How long a request may wait until the line is quiet enough for it.
const QUIET_WITHIN: Duration = Duration::from_secs(5);

/// What is said of a line on which nothing can be sent.
pub const NEVER_QUIET: &str = "the line is never quiet, something else is sending: see whether speed, format and \
    protocol are those of the drives, and whether a second master is on it";

/// Lets no request to a drive wait without end for a line that is never quiet.
pub fn wait_at_most(drive: &mut dyn Drive) {
    let all = Some(QUIET_WITHIN);
    *drive.lifetimes_mut() =
        Lifetimes { command: all, keep_alive: all, status: all, background: all, ..Lifetimes::default() };
}

/// What a person reads when a drive did not do it.
pub fn words(name: DriveName, config: &LineConfig, error: &Error) -> String {
    match (error, error.kind()) {
        (Error::Port { problem: PortError::Expired, .. }, _) => {
            format!("{name} could not be asked: {NEVER_QUIET}")
        }
        (Error::Port { problem: PortError::Damaged(_) | PortError::Mismatch(_), .. }, _) => format!(
            "{name} cannot be understood ({error}): something else is sending, two slaves have this address, or speed, \
             format or protocol are others"
        ),
        (_, ErrorKind::NoAnswer) => format!(
            "{name} does not answer ({error}): see that it is switched on, wired, and set to address {} and {}; drived scan \
             --line {config} finds who is there",
            name.slave, config.serial
        ),
        (_, ErrorKind::OutcomeUnknown) => {
            format!("{name}: {error}: nobody knows whether it was carried out, read the status")
        }
        (_, ErrorKind::Unsupported) => format!("{name}: {error}{}", drive_options::hint(name.family)),
        _ => format!("{name}: {error}"),
    }
}

/// Opens a line; a port that is missing or in use is the caller's input.
pub async fn open_line(config: LineConfig) -> Result<Line, Failure> {
    open_line_of(None, config).await
}

/// The same, for a drive that is to be spoken to.
pub async fn open_line_of(drive: Option<DriveName>, config: LineConfig) -> Result<Line, Failure> {
    match Line::open(config).await {
        Ok(line) => Ok(line),
        Err(OpenError::InUse { path }) => {
            let told = crate::explain(&path, drive).await;
            Err(Failure::Input(told.unwrap_or_else(|| OpenError::InUse { path }.to_string())))
        }
        Err(error) => Err(Failure::Input(ports::refused(&error))),
    }
}

/// A drive on an open line, with those of the options that are its family's. Nothing is sent by it.
pub fn open_drive(line: &Line, name: DriveName, options: &Options) -> Box<dyn Drive> {
    name.family.open_with(line.slave(name.slave.number()), name.slave, options)
}

/// Waits for what became of something that a drive was told. Whoever asks the program to end meanwhile has to know that
/// it may have been sent.
pub async fn told<T>(
    name: DriveName,
    ending: &mut Ending,
    command: impl Future<Output = T>,
) -> Result<T, Failure> {
    tokio::select! {
        biased;
        outcome = command => Ok(outcome),
        () = ending.asked() => Err(Failure::Drive(format!(
            "{name}: asked to end before it was confirmed: nobody knows whether it was carried out, read it back"
        ))),
    }
}
