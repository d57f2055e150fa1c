//! What `--option` says: `NAME=VALUE`, what only its owner knows of a drive.

use std::str::FromStr;

use drive_families::{Family, OptionError, Options};

use crate::{drive_spec::DriveName, failure::Failure};

/// `--option` of the subcommands that open drives.
#[derive(Debug, clap::Args)]
pub struct OptionArgs {
    /// What the bus cannot tell of a drive, for every drive of the option's family; `drived families FAMILY` lists them;
    /// may be given several times
    #[arg(long = "option", value_name = "NAME=VALUE")]
    options: Vec<OptionSpec>,
}

impl OptionArgs {
    /// The options of these drives; each must belong to one of them.
    pub fn of(&self, drives: &[DriveName]) -> Result<Options, Failure> {
        let mut options = Options::default();
        for OptionSpec { name, value } in &self.options {
            if options.get(name).is_some() {
                return Err(Failure::Input(format!("option {name} is given twice")));
            }
            let set = options.set(name, value);
            set.map_err(|error| Failure::Input(error.to_string()))?;
            if let Some(first) = drives.first()
                && drives.iter().all(|drive| !drive.family.has_option(name))
            {
                let foreign = options.check(first.family);
                foreign.map_err(|error| Failure::Input(format!("{first}: {error}")))?;
            }
        }
        Ok(options)
    }
}

/// The names of a family's options, after an error that one of them might mend.
pub fn hint(family: Family) -> String {
    let own: Vec<&str> = family.options().iter().map(|entry| entry.name).collect();
    match own.is_empty() {
        true => String::new(),
        false => format!("; what you know of the drive can be said by --option: {}", own.join(", ")),
    }
}

/// One option as it is written.
#[derive(Debug, Clone)]
struct OptionSpec {
    name: String,
    value: String,
}

/// A text that is no option.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum OptionSpecError {
    #[error("expected NAME=VALUE, such as fault-reset-function=5")]
    Form,
    #[error(transparent)]
    Option(#[from] OptionError),
}

impl FromStr for OptionSpec {
    type Err = OptionSpecError;

    fn from_str(text: &str) -> Result<Self, OptionSpecError> {
        let (name, value) = text.split_once('=').ok_or(OptionSpecError::Form)?;
        Options::default().set(name, value)?;
        Ok(Self { name: name.trim().to_owned(), value: value.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive_spec::{self, DriveSpec};

    fn read(drives: &[&str], options: &[&str]) -> Result<Options, String> {
        let specs: Vec<DriveSpec> = drives.iter().map(|text| text.parse().unwrap()).collect();
        let options =
            options.iter().map(|text| text.parse().map_err(|error: OptionSpecError| error.to_string()));
        let args = OptionArgs { options: options.collect::<Result<_, _>>()? };
        args.of(&drive_spec::on_one_line(&specs).unwrap()).map_err(|failure| failure.to_string())
    }

    #[test]
    fn options_of_several_families_are_given_to_drives_of_several() {
        let options =
            read(&["3g3ev@1-2", "atv21@3"], &["fault-reset-function=5", "authority=settings"]).unwrap();
        assert_eq!(options.of(Family::OMRON_3G3EV).get("fault-reset-function"), Some("5"));
        assert_eq!(options.of(Family::ATV28), Options::default());
    }

    #[test]
    fn what_is_no_option_of_these_drives_is_refused_with_the_reason() {
        for (option, reason) in [
            ("saves", "expected NAME=VALUE"),
            ("speed=5", "\"speed\" is not an option of a drive: expected one of authority, "),
            ("saves=many", "option saves: \"many\" is not a value of it: expected a whole number"),
            ("saves=1", "atv312@1: option saves belongs to the 3g3ev: the atv312 has none"),
        ] {
            let error = read(&["atv312@1"], &[option]).unwrap_err();
            assert!(error.starts_with(reason), "{error}");
        }
        assert_eq!(read(&["3g3ev@1"], &["saves=1", "saves=2"]).unwrap_err(), "option saves is given twice");
    }
}
