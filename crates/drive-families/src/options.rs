//! What only its owner knows of a drive: options that one family has and the bus cannot tell.

mod entries;

use drive_atv21::Authority;
use drive_atv58::Atv58Map;

pub use self::entries::{OPTIONS, OptionEntry};
use crate::Family;

/// What the owner of a drive says about it, for [`Family::open_with`]. An option that is not given keeps the family's
/// default; each belongs to one family, and no other is opened with it.
///
/// In a program they are fields; from a configuration or a command line they are names and texts, [`OPTIONS`]:
///
/// ```
/// use drive_families::{Family, Options};
///
/// let mut options = Options::default();
/// options.set("fault-reset-function", "5")?;
/// assert_eq!(options, Options { fault_reset_function: Some(5), ..Options::default() });
/// assert!(options.check(Family::Omron3g3ev).is_ok());
/// assert!(options.check(Family::Atv312).is_err());
/// # Ok::<(), drive_families::OptionError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Options {
    /// Altivar 21: by what right the bus commands it.
    pub authority: Option<Authority>,
    /// Altivar 58: which word is what, where its card's manual is silent.
    pub map: Option<Atv58Map>,
    /// 3G3EV: the number of "fault reset" in n06 to n08, see
    /// [`with_fault_reset_function`](drive_3g3ev::Drive3g3ev::with_fault_reset_function).
    pub fault_reset_function: Option<u16>,
    /// 3G3EV: how often its EEPROM was saved before, see [`with_saves`](drive_3g3ev::Drive3g3ev::with_saves).
    pub saves: Option<u32>,
}

impl Options {
    /// Sets the option of this name from a text.
    ///
    /// # Errors
    /// [`OptionError::Unknown`] and [`OptionError::Value`]; nothing is set then.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), OptionError> {
        let entry = OptionEntry::find(name)?;
        (entry.set)(self, value.trim()).ok_or_else(|| OptionError::Value {
            name: entry.name,
            value: value.to_owned(),
            expected: entry.value,
        })
    }

    /// Those of them that are this family's: for a list that holds options of several.
    #[must_use]
    pub fn of(&self, family: Family) -> Self {
        let none = Self::default();
        match family {
            Family::Atv21 => Self { authority: self.authority, ..none },
            Family::Atv58 => Self { map: self.map, ..none },
            Family::Omron3g3ev => {
                Self { fault_reset_function: self.fault_reset_function, saves: self.saves, ..none }
            }
            Family::Atv28 | Family::Atv312 => none,
        }
    }

    /// Whether a drive of this family can be opened with them.
    ///
    /// # Errors
    /// [`OptionError::Family`] with the first one that is another family's.
    pub fn check(&self, family: Family) -> Result<(), OptionError> {
        let Self { authority, map, fault_reset_function, saves } = self;
        let given = [
            ("authority", Family::Atv21, authority.is_some()),
            ("the map of the words", Family::Atv58, map.is_some()),
            ("fault-reset-function", Family::Omron3g3ev, fault_reset_function.is_some()),
            ("saves", Family::Omron3g3ev, saves.is_some()),
        ];
        match given.into_iter().find(|&(_, owner, is_given)| is_given && owner != family) {
            Some((name, owner, _)) => Err(OptionError::Family { name, owner, family }),
            None => Ok(()),
        }
    }

    fn map_mut(&mut self) -> &mut Atv58Map {
        self.map.get_or_insert_default()
    }
}

/// An option that cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OptionError {
    /// No family has it.
    #[error("{0:?} is not an option of a drive: expected one of {names}", names = entries::names())]
    Unknown(String),
    /// A text that is no value of it.
    #[error("option {name}: {value:?} is not a value of it: expected {expected}")]
    Value {
        /// The option.
        name: &'static str,
        /// What was said.
        value: String,
        /// What can be said.
        expected: &'static str,
    },
    /// It belongs to another family.
    #[error("option {name} belongs to the {owner}: the {family} has {own}", own = entries::names_of(*family))]
    Family {
        /// The option.
        name: &'static str,
        /// The family that has it.
        owner: Family,
        /// The family of the drive.
        family: Family,
    },
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn set(name: &str, value: &str) -> Result<Options, OptionError> {
        let mut options = Options::default();
        options.set(name, value).map(|()| options)
    }

    #[test]
    fn every_option_changes_what_it_names_and_belongs_to_its_family_alone() {
        for entry in OPTIONS {
            let value = match entry.name {
                "authority" => "settings",
                "speed-limits" => "1,2",
                "message-watch" => "1s",
                "read-only-function" => "4",
                "saves" => "123",
                _ => "007Bh",
            };
            let options = set(entry.name, value).unwrap();
            assert_ne!(options, Options::default(), "{}", entry.name);
            if entry.family == Family::Atv58 {
                assert_ne!(options.map, Some(Atv58Map::default()), "{}", entry.name);
            }
            for family in Family::ALL {
                let own = family == entry.family;
                assert_eq!(options.check(family).is_ok(), own, "{} {family}", entry.name);
                assert_eq!(options.of(family) == options, own, "{} {family}", entry.name);
                assert!(options.of(family).check(family).is_ok());
            }
        }
    }

    #[test]
    fn a_text_that_is_no_value_is_refused_with_what_was_expected_and_nothing_is_set() {
        for entry in OPTIONS {
            for value in ["", "?", "-1", "99999999999", "word"] {
                let mut options = Options::default();
                let error = options.set(entry.name, value).unwrap_err().to_string();
                assert!(error.contains(entry.name) && error.contains(entry.value), "{error}");
                assert_eq!(options, Options::default(), "{} = {value:?}", entry.name);
            }
        }
    }

    #[test]
    fn words_of_the_altivar_58_are_given_one_by_one() {
        let mut options = Options::default();
        options.set("status-word", "1CBh").unwrap();
        options.set("reverse-command", "none").unwrap();
        options.set("speed-limits", "251, 249").unwrap();
        options.set("message-watch", "1500ms").unwrap();
        let map = Atv58Map {
            status: 0x01CB,
            reverse_command: 0,
            speed_limits: Some((251, 249)),
            message_watch: Duration::from_millis(1_500),
            ..Atv58Map::default()
        };
        assert_eq!(options.map, Some(map));
    }

    #[test]
    fn a_wrong_family_is_told_whose_the_option_is_and_what_it_has_itself() {
        let options = set("saves", "7").unwrap();
        let error = options.check(Family::Atv21).unwrap_err().to_string();
        assert_eq!(error, "option saves belongs to the 3g3ev: the atv21 has authority");
        let error = options.check(Family::Atv312).unwrap_err().to_string();
        assert_eq!(error, "option saves belongs to the 3g3ev: the atv312 has none");
        let error = set("save", "7").unwrap_err().to_string();
        assert!(
            error.starts_with("\"save\" is not an option of a drive: expected one of authority,"),
            "{error}"
        );
    }
}
