//! `drived param`: the registers of a family, and their content in one drive.

mod backup;
pub mod diff;
mod direct;
pub mod file;
mod remote;
mod restore;
mod shown;
pub mod source;
#[cfg(test)]
mod testing;

use std::path::PathBuf;

use drive_families::Family;

use self::{
    direct::{dump, get, save_all, set},
    file::Backup,
    shown::list,
};
use crate::one_drive::OneDriveArgs;
use drived_client::{DaemonArgs, Target};
use drived_file::ledger::LedgerArgs;
use drived_plant::plant::parameters::ParameterView;
use drived_words::{drive_spec, failure::Failure, output};

/// List, read and write the registers of a drive, by mnemonic or address
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// List every register of a family: access, where it is kept, range, factory setting, source
    List {
        /// The family, such as atv312, or a drive of the running daemon
        #[arg(value_name = "FAMILY|NAME")]
        of: String,
        #[command(flatten)]
        daemon: DaemonArgs,
    },
    /// Read registers
    #[command(override_usage = "drived param get [OPTIONS] [NAME] REGISTER...")]
    Get {
        #[command(flatten)]
        one: OneDriveArgs,
        /// The drive of the running daemon, which --line and --drive stand for otherwise; and mnemonics or addresses, such as
        /// ACC, 9001 or 2329h
        #[arg(value_name = "[NAME] REGISTER", required = true)]
        words: Vec<String>,
    },
    /// Write one register and read it back
    #[command(override_usage = "drived param set [OPTIONS] [NAME] REGISTER VALUE")]
    Set {
        #[command(flatten)]
        one: OneDriveArgs,
        /// The drive of the running daemon, which --line and --drive stand for otherwise; the mnemonic or the address of the
        /// register; and a number in its unit, a hexadecimal word such as 0627h, or the mnemonic of a listed value
        #[arg(value_name = "[NAME] REGISTER VALUE", required = true, num_args = 1..=3, allow_negative_numbers = true)]
        words: Vec<String>,
        /// Then save the drive's parameters to its EEPROM, all of them, as `drived param save` does, also when the value was
        /// there already
        #[arg(long)]
        save: bool,
        #[command(flatten)]
        ledger: LedgerArgs,
    },
    /// Save a drive's parameters to its EEPROM, all that are kept in RAM, by the family's command for it
    ///
    /// What was changed since the last save outlives the next power-off then, whoever changed it. An EEPROM wears out by
    /// writes: save when you have changed something, not by a timer.
    Save {
        /// A drive of the running daemon
        #[arg(value_name = "NAME", conflicts_with = "line")]
        name: Option<String>,
        #[command(flatten)]
        one: OneDriveArgs,
        #[command(flatten)]
        ledger: LedgerArgs,
    },
    /// Read every register that can be read
    Dump {
        /// A drive of the running daemon
        #[arg(value_name = "NAME", conflicts_with = "line")]
        name: Option<String>,
        #[command(flatten)]
        one: OneDriveArgs,
    },
    Backup(backup::Args),
    Diff(diff::Args),
    Restore(restore::Args),
}

pub async fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::List { of, daemon } => {
            let family = family(&of, &daemon).await?;
            let capabilities = family.capabilities();
            let rows = capabilities.rows.iter().map(|row| ParameterView::unasked(capabilities, row));
            daemon.say(&rows.collect::<Vec<_>>(), || output::say_table(list(family)))
        }
        Command::Get { one, words } if one.is_on_line() => get(&one, &words).await,
        Command::Get { one, words } => remote::get(&one, &words).await,
        Command::Set { one, words, save, ledger } => match (one.is_on_line(), &*apart(&words)) {
            (true, [register, value]) => set(&one, register, value, save, &ledger).await,
            (false, [name, register, value]) => remote::set(&one, name, register, value, save).await,
            (true, _) => Err(Failure::Input(
                "expected REGISTER and VALUE beside --line and --drive, such as ACC 4.5".to_owned(),
            )),
            (false, _) => Err(Failure::Input(
                "expected NAME, REGISTER and VALUE, or --line and --drive instead of the name".to_owned(),
            )),
        },
        Command::Save { one, ledger, .. } if one.is_on_line() => save_all(&one, &ledger).await,
        Command::Save { one, name, .. } => remote::save(&one, name.as_deref()).await,
        Command::Dump { one, .. } if one.is_on_line() => dump(&one).await,
        Command::Dump { one, name } => remote::dump(&one, name.as_deref()).await,
        Command::Backup(args) => backup::run(args).await,
        Command::Diff(args) => diff::run(args).await,
        Command::Restore(args) => restore::run(args).await,
    }
}

/// The backups of these files and folders.
pub(super) fn backups(paths: &[PathBuf]) -> Result<Vec<Backup>, Failure> {
    restore::files(paths)?.iter().map(|path| Backup::read(path)).collect()
}

/// The words with `REGISTER=VALUE` as two.
fn apart(words: &[String]) -> Vec<String> {
    match words {
        [before @ .., last] if last.contains('=') && before.len() < 2 => {
            let parts = last.splitn(2, '=').map(|part| part.trim().to_owned());
            before.iter().cloned().chain(parts).collect()
        }
        words => words.to_vec(),
    }
}

/// A family by its name, or that of a drive of the running daemon.
async fn family(of: &str, daemon: &DaemonArgs) -> Result<Family, Failure> {
    let unknown = match of.parse() {
        Ok(family) => return Ok(family),
        Err(error) => Failure::Input(format!("{error}{}", drive_spec::meant(&error))),
    };
    // Where no daemon runs, it was meant for a family.
    let Ok(mut daemon) = daemon.connect().await else { return Err(unknown) };
    let state = daemon.state().await?;
    Target::find(&state, of)?;
    let family = state.drives.iter().find(|drive| drive.name() == of);
    family.and_then(|drive| drive.family.parse().ok()).ok_or(unknown)
}
