//! What `--option` says: `NAME=VALUE`, what only its owner knows of a drive.

use std::{collections::BTreeMap, str::FromStr};

use drive_families::{Family, OPTIONS, OptionEntry, OptionError, Options};

use crate::{drive_spec::DriveName, failure::Failure};

/// What an option is, for the help of `--option`.
pub(crate) const HELP: &str = "What the bus cannot tell of a drive; may be given several times";

/// [`HELP`] with every option there is.
pub(crate) fn long_help() -> String {
    let mut text = format!("{HELP}. It holds for every drive of its family that is named here:");
    for entry in OPTIONS {
        text.push_str(&format!("\n- {} ({}): {}", entry.name, entry.family, entry.meaning));
    }
    text
}

/// `--option`, for the subcommands that open drives.
#[derive(Debug, clap::Args)]
pub(crate) struct OptionArgs {
    #[arg(long = "option", value_name = "NAME=VALUE", help = HELP, long_help = long_help())]
    options: Vec<OptionSpec>,
}

impl OptionArgs {
    /// The options for these drives.
    pub(crate) fn of(&self, drives: &[DriveName]) -> Result<DriveOptions, Failure> {
        let mut options = BTreeMap::<Family, Options>::new();
        for (index, OptionSpec { entry, value }) in self.options.iter().enumerate() {
            let before = self.options.iter().take(index);
            if before.into_iter().any(|other| other.entry.name == entry.name) {
                return Err(Failure::Input(format!("option {} is given twice", entry.name)));
            }
            let mut one = Options::default();
            let read = one.set(entry.name, value);
            read.map_err(|error| Failure::Input(error.to_string()))?;
            let has_family = drives.iter().any(|name| name.family == entry.family);
            if let (false, Some(name)) = (has_family, drives.first()) {
                one.check(name.family).map_err(|error| Failure::Input(format!("{name}: {error}")))?;
            }
            let set = options.entry(entry.family).or_default().set(entry.name, value);
            set.map_err(|error| Failure::Input(error.to_string()))?;
        }
        Ok(DriveOptions(options))
    }
}

/// Options by family.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct DriveOptions(BTreeMap<Family, Options>);

impl DriveOptions {
    /// Those for a drive of this family.
    pub(crate) fn of(&self, family: Family) -> Options {
        self.0.get(&family).copied().unwrap_or_default()
    }
}
