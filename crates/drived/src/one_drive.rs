//! The one drive on which a subcommand acts.

use drive_bus::{Line, LineConfig};
use drive_core::{Drive, Error, ErrorKind};
use drive_families::Options;

use crate::{
    drive_options::{self, OptionArgs},
    drive_spec::{DriveName, DriveSpec},
    failure::Failure,
    line_spec::{self, LineSpec},
    signals::Ending,
};

/// `--line` and `--drive` of the subcommands that act on one drive.
#[derive(Debug, clap::Args)]
pub(crate) struct OneDriveArgs {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP)]
    line: LineSpec,
    /// The drive, such as atv312@1
    #[arg(long, value_name = "FAMILY@ADDRESS")]
    drive: DriveSpec,
    #[command(flatten)]
    options: OptionArgs,
}

impl OneDriveArgs {
    /// The name of the one drive.
    pub(crate) fn name(&self) -> Result<DriveName, Failure> {
        self.drive.single().ok_or_else(|| {
            Failure::Input("--drive names several drives: this acts on one, such as atv312@1".to_owned())
        })
    }

    /// Opens the line. Nothing is sent by it.
    pub(crate) async fn open(&self) -> Result<OneDrive, Failure> {
        let name = self.name()?;
        let options = self.options.of(&[name])?;
        let config = self.line.config(&[name]).map_err(|error| Failure::Input(error.to_string()))?;
        // No other drive waits behind a mute one here, so each request is really sent.
        let config = LineConfig { offline_after: 0, ..config };
        let line = open_line(config.clone()).await?;
        let drive = open_drive(&line, name, &options)?;
        Ok(OneDrive { name, drive, config, line })
    }
}

/// Opens a line; a port that is missing or in use is the caller's input.
pub(crate) async fn open_line(config: LineConfig) -> Result<Line, Failure> {
    Line::open(config).await.map_err(|error| Failure::Input(error.to_string()))
}

/// A drive on an open line, with those of the options that are its family's. Nothing is sent by it.
pub(crate) fn open_drive(line: &Line, name: DriveName, options: &Options) -> Result<Box<dyn Drive>, Failure> {
    let DriveName { family, slave } = name;
    let drive = family.open_with(line.slave(slave.number()), slave, &options.of(family));
    drive.map_err(|error| Failure::Input(format!("{name}: {error}")))
}

/// Waits for what became of something that a drive was told. Whoever asks the program to end meanwhile has to know that
/// it may have been sent.
pub(crate) async fn told<T>(name: DriveName, command: impl Future<Output = T>) -> Result<T, Failure> {
    let mut ending = Ending::listen()?;
    tokio::select! {
        biased;
        outcome = command => Ok(outcome),
        () = ending.asked() => Err(Failure::Drive(format!(
            "{name}: asked to end before it was confirmed: nobody knows whether it was carried out, read it back"
        ))),
    }
}

/// A drive and its open line.
pub(crate) struct OneDrive {
    pub(crate) name: DriveName,
    pub(crate) drive: Box<dyn Drive>,
    config: LineConfig,
    line: Line,
}

impl OneDrive {
    /// What a person reads when the drive did not do it.
    pub(crate) fn failure(&self, error: &Error) -> Failure {
        let name = self.name;
        Failure::Drive(match error.kind() {
            ErrorKind::NoAnswer => format!(
                "{name} does not answer ({error}): see that it is switched on, wired, and set to address {} and {}",
                name.slave, self.config.serial
            ),
            ErrorKind::OutcomeUnknown => {
                format!("{name}: {error}: nobody knows whether it was carried out, read the status")
            }
            ErrorKind::Unsupported => format!("{name}: {error}{}", drive_options::hint(name.family)),
            _ => format!("{name}: {error}"),
        })
    }

    /// A drive on a line of a test.
    #[cfg(test)]
    pub(crate) fn over(name: DriveName, line: Line, config: LineConfig) -> Self {
        let drive = open_drive(&line, name, &Options::default()).unwrap();
        Self { name, drive, config, line }
    }

    /// Closes the port.
    pub(crate) async fn close(self) {
        self.line.close().await;
    }
}
