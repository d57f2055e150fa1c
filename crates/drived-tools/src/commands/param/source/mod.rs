//! The drives whose parameters are kept, compared and restored: on a line, or of the running daemon.

mod asked;
mod keep;

use drive_core::SlaveAddress;
use drive_families::Family;

use super::file::{Backup, Head};
use crate::one_drive::OneDrive;
use drived_client::{Daemon, DaemonArgs, wanted};
use drived_file::ledger::LedgerArgs;
use drived_plant::plant::views::DriveView;
use drived_words::{
    drive_options::OptionArgs,
    drive_spec::{self, DriveName, DriveSpec},
    failure::Failure,
    line_spec::{self, LineSpec},
};

/// Where the drives are.
#[derive(Debug, clap::Args)]
pub struct SourceArgs {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", conflicts_with_all = ["socket", "token_file"], help = line_spec::HELP)]
    line: Option<LineSpec>,
    #[command(flatten)]
    options: OptionArgs,
    #[command(flatten)]
    pub(super) daemon: DaemonArgs,
}

/// One drive, not yet opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Named {
    OnLine(DriveName),
    OfDaemon(String),
}

/// One drive that can be asked.
pub enum Source {
    OnLine(Box<OneDrive>),
    OfDaemon { daemon: Box<Daemon>, view: Box<DriveView> },
}

/// Why a register could not be read.
pub(super) enum Unread {
    /// The drive answers, and not this.
    Refused(String),
    /// It does not answer.
    Silent(String),
}

/// Why a register was not written.
pub(super) enum Unwritten {
    /// The drive, or what is known of it, refuses this one: it holds what it held, and another one may be taken.
    Refused(String),
    /// It was written, and this is what it holds.
    ReadsBack(u16),
    /// Nothing can be written now: it runs, it does not answer, or somebody may not write. It holds what it held.
    NotNow(String),
    /// Nobody knows what it holds.
    Unknown(String),
}

impl SourceArgs {
    /// The drives that these words name: on a line `FAMILY@ADDRESSES`, else drives, groups and lines of the daemon, or all of
    /// its drives.
    pub(super) async fn named(&self, words: &[String], all: bool) -> Result<Vec<Named>, Failure> {
        if self.line.is_some() {
            if all {
                return Err(Failure::Input("--all is for the drives of the running daemon".to_owned()));
            }
            let specs = words.iter().map(|word| word.parse::<DriveSpec>());
            let specs = specs.collect::<Result<Vec<_>, _>>();
            let specs = specs.map_err(|error| Failure::Input(error.to_string()))?;
            let names = drive_spec::on_one_line(&specs).map_err(|error| Failure::Input(error.to_string()))?;
            return Ok(names.into_iter().map(Named::OnLine).collect());
        }
        let state = self.daemon.connect().await?.state().await?;
        let drives = if all { state.drives.iter().collect() } else { wanted(&state, words)? };
        Ok(drives.into_iter().map(|drive| Named::OfDaemon(drive.name().to_owned())).collect())
    }

    /// The one drive that a word names.
    pub(super) async fn one(&self, word: &str) -> Result<Named, Failure> {
        let mut named = self.named(&[word.to_owned()], false).await?;
        match (named.pop(), named.is_empty()) {
            (Some(one), true) => Ok(one),
            _ => Err(Failure::Input(format!("{word} names several drives: name one"))),
        }
    }

    /// The drive that a file names: by its name in the running daemon, or by its address on the line.
    pub(super) fn of_file(&self, head: &Head) -> Result<Named, Failure> {
        if self.line.is_none() {
            return Ok(Named::OfDaemon(head.name.clone()));
        }
        let slave = SlaveAddress::try_from(head.slave).map_err(|error| Failure::Input(error.to_string()))?;
        Ok(Named::OnLine(DriveName { family: head.family, slave }))
    }

    /// Reads everything that a backup of a drive keeps.
    pub(super) async fn read(&self, named: &Named) -> Result<Backup, Failure> {
        let mut source = self.open(named).await?;
        let backup = source.keep().await;
        source.close().await;
        let backup = backup?;
        match backup.nothing_read() {
            Some(why) => Err(Failure::Drive(format!("{}: {why}", named.name()))),
            None => Ok(backup),
        }
    }

    /// Opens a drive. Nothing is written by it.
    pub(super) async fn open(&self, named: &Named) -> Result<Source, Failure> {
        match (named, &self.line) {
            (Named::OnLine(name), Some(line)) => {
                Ok(Source::OnLine(Box::new(OneDrive::open(line, &self.options, *name).await?)))
            }
            (Named::OnLine(_), None) => Err(crate::one_drive::unnamed()),
            (Named::OfDaemon(name), _) => {
                let mut daemon = self.daemon.connect().await?;
                let view = daemon.read(&["drives", name]).await?;
                Ok(Source::OfDaemon { daemon: Box::new(daemon), view })
            }
        }
    }
}

impl Named {
    /// What a person calls it.
    pub(super) fn name(&self) -> String {
        match self {
            Self::OnLine(name) => name.to_string(),
            Self::OfDaemon(name) => name.clone(),
        }
    }
}

impl Source {
    /// That it may be written to. The daemon judges that itself, and keeps the ledger.
    pub(super) async fn ready_for_writing(&mut self, ledger: &LedgerArgs) -> Result<(), Failure> {
        if let Self::OnLine(one) = self {
            one.is_meant().await?;
            one.ledger = Some(ledger.of(one.name, one.config()));
        }
        Ok(())
    }

    pub(super) fn family(&self) -> Result<Family, Failure> {
        match self {
            Self::OnLine(one) => Ok(one.name.family),
            Self::OfDaemon { view, .. } => {
                view.family.parse().map_err(|error| Failure::Input(format!("the daemon's drive: {error}")))
            }
        }
    }

    pub(super) fn name(&self) -> String {
        match self {
            Self::OnLine(one) => one.name.to_string(),
            Self::OfDaemon { view, .. } => view.name().to_owned(),
        }
    }

    pub(super) fn slave(&self) -> u8 {
        match self {
            Self::OnLine(one) => one.name.slave.number(),
            Self::OfDaemon { view, .. } => view.slave,
        }
    }

    /// Lets the drive go.
    pub(super) async fn close(self) {
        if let Self::OnLine(one) = self {
            one.close().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_families::SetUp;

    use super::*;
    use crate::commands::param::testing::Bench;

    /// What each says of itself by function 43/14: "ATV21" (Altivar 21 Modbus manual, identification) and "ATV312" (Altivar 312
    /// communication manual, "Identification"). The others have no word for it over Modbus RTU.
    #[tokio::test(start_paused = true)]
    async fn a_drive_that_says_it_is_of_another_family_is_not_written_to_directly_either() {
        let known = [Family::ATV21, Family::ATV312];
        for taken_for in known {
            for family in known {
                let bench = Bench::taken_for(taken_for, family, SetUp::ForTheBus);
                let Source::OnLine(mut one) = bench.source else { panic!("it is on a line") };
                match one.is_meant().await {
                    Ok(()) => assert_eq!(taken_for, family),
                    Err(failure) => {
                        assert_ne!(taken_for, family, "{failure}");
                        let told = failure.to_string();
                        assert!(told.contains("nothing was written") && told.contains("Altivar"), "{told}");
                    }
                }
            }
        }
    }
}
