//! The families of drives, chosen by name: what a configuration or a command line says becomes a
//! [`Drive`].
//!
//! ```
//! use drive_families::Family;
//!
//! let family: Family = "atv312".parse()?;
//! assert_eq!(family.capabilities().name, "Schneider Altivar 312");
//! # Ok::<(), drive_families::UnknownFamily>(())
//! ```

#![forbid(unsafe_code)]

mod bits;
mod nowhere;
mod options;

use std::{fmt, str::FromStr};

use drive_3g3ev::Drive3g3ev;
use drive_atv21::Atv21;
use drive_atv28::Atv28;
use drive_atv58::Atv58;
use drive_atv312::Atv312;
use drive_core::{Capabilities, Drive, Port, SlaveAddress, WatchdogCapability};

pub use crate::bits::Bit;
use crate::nowhere::Nowhere;
pub use crate::options::{OPTIONS, OptionEntry, OptionError, Options};

/// A family of drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// Schneider Altivar 21.
    Atv21,
    /// Schneider Altivar 28.
    Atv28,
    /// Schneider Altivar 58 with its communication card.
    Atv58,
    /// Schneider Altivar 312.
    Atv312,
    /// Omron 3G3EV.
    Omron3g3ev,
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Atv21, Self::Atv28, Self::Atv58, Self::Atv312, Self::Omron3g3ev];

    /// What it can do.
    #[must_use]
    pub const fn capabilities(self) -> &'static Capabilities {
        match self {
            Self::Atv21 => &drive_atv21::CAPABILITIES,
            Self::Atv28 => &drive_atv28::CAPABILITIES,
            Self::Atv58 => &drive_atv58::CAPABILITIES,
            Self::Atv312 => &drive_atv312::CAPABILITIES,
            Self::Omron3g3ev => &drive_3g3ev::CAPABILITIES,
        }
    }

    /// A drive of this family behind a port. Nothing is sent by it.
    #[must_use]
    pub fn open(self, port: impl Port + 'static, slave: SlaveAddress) -> Box<dyn Drive> {
        self.open_with(port, slave, &Options::default())
    }

    /// A drive of this family of which its owner says more than the bus can tell, by those of the options that are the
    /// family's: see [`Options::check`]. Nothing is sent by it.
    #[must_use]
    pub fn open_with(
        self,
        port: impl Port + 'static,
        slave: SlaveAddress,
        options: &Options,
    ) -> Box<dyn Drive> {
        match self {
            Self::Atv21 => {
                Box::new(Atv21::new(port, slave).with_authority(options.authority.unwrap_or_default()))
            }
            Self::Atv28 => Box::new(Atv28::new(port, slave)),
            Self::Atv58 => Box::new(Atv58::with_map(port, slave, options.map.unwrap_or_default())),
            Self::Atv312 => Box::new(Atv312::new(port, slave)),
            Self::Omron3g3ev => {
                let drive = Drive3g3ev::new(port, slave).with_saves(options.saves.unwrap_or_default());
                Box::new(match options.fault_reset_function {
                    Some(number) => drive.with_fault_reset_function(number),
                    None => drive,
                })
            }
        }
    }

    /// The communication watchdog of a drive of this family on its line, of which those of the options hold that are the
    /// family's: [`Drive::watchdog_capability`], asked without a line.
    #[must_use]
    pub fn watchdog(self, ascii: bool, options: &Options) -> Option<WatchdogCapability> {
        let slave = SlaveAddress::try_from(1).ok()?;
        self.open_with(Nowhere { ascii }, slave, options).watchdog_capability()
    }
}

/// Prints the name that configurations use, [`Capabilities::key`].
impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.capabilities().key)
    }
}

/// A name that is no family's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not a family of drives: expected one of {keys}", keys = Family::ALL.map(|family| family.to_string()).join(", "))]
pub struct UnknownFamily(pub String);

impl FromStr for Family {
    type Err = UnknownFamily;

    fn from_str(text: &str) -> Result<Self, UnknownFamily> {
        let found = Self::ALL.into_iter().find(|family| family.capabilities().key.eq_ignore_ascii_case(text));
        found.ok_or_else(|| UnknownFamily(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_is_found_by_the_name_that_it_prints() {
        for family in Family::ALL {
            assert_eq!(family.to_string().parse(), Ok(family));
            assert_eq!(family.to_string().to_uppercase().parse(), Ok(family));
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_names_that_exist() {
        let error = "atv999".parse::<Family>().unwrap_err().to_string();
        assert!(error.starts_with("\"atv999\" is not a family of drives"), "{error}");
        for family in Family::ALL {
            assert!(error.contains(family.capabilities().key), "{error}");
        }
    }
}
