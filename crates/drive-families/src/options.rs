//! What only its owner knows of a drive: options that one family has and the bus cannot tell.

use std::{collections::BTreeMap, fmt};

use crate::Family;

/// One option of a family.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct OptionEntry {
    /// Its name.
    pub name: &'static str,
    /// The texts that are values of it.
    pub value: &'static str,
    /// What it says of the drive, and its default.
    pub meaning: &'static str,
    is_value: &'static IsValue,
}

/// Whether a text is a value of an option.
pub type IsValue = dyn Fn(&str) -> bool + Send + Sync;

impl fmt::Debug for OptionEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OptionEntry")
            .field("name", &self.name)
            .field("value", &self.value)
            .finish_non_exhaustive()
    }
}

impl OptionEntry {
    /// An option of this name, with the texts that are values of it, in words and as a check, and what it says of the drive.
    #[must_use]
    pub const fn new(
        name: &'static str,
        value: &'static str,
        meaning: &'static str,
        is_value: &'static IsValue,
    ) -> Self {
        Self { name, value, meaning, is_value }
    }
}

/// What the owner of a drive says about it, for [`Family::open_with`]: names and texts, as a configuration or a command line has
/// them. An option that is not given keeps the family's default; each belongs to a family, and no other is opened with it.
///
/// ```
/// use drive_families::{Family, Options};
///
/// let mut options = Options::default();
/// options.set("fault-reset-function", "5")?;
/// assert!(options.check(Family::OMRON_3G3EV).is_ok());
/// assert!(options.check(Family::ATV312).is_err());
/// # Ok::<(), drive_families::OptionError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Options(BTreeMap<&'static str, String>);

impl Options {
    /// Sets the option of this name from a text.
    ///
    /// # Errors
    /// [`OptionError::Unknown`] and [`OptionError::Value`]; nothing is set then.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), OptionError> {
        let (name, text) = (name.trim(), value.trim());
        let mut has_it = None;
        for (_, entry) in all().filter(|(_, entry)| entry.name == name) {
            if (entry.is_value)(text) {
                self.keep(entry.name, text);
                return Ok(());
            }
            has_it = Some(entry);
        }
        Err(match has_it {
            Some(entry) => {
                OptionError::Value { name: entry.name, value: value.to_owned(), expected: entry.value }
            }
            None => OptionError::Unknown(name.to_owned()),
        })
    }

    pub(crate) fn keep(&mut self, name: &'static str, text: &str) {
        self.0.insert(name, text.to_owned());
    }

    /// Takes what others say beside it.
    pub fn extend(&mut self, others: Self) {
        self.0.extend(others.0);
    }

    /// What is said by the option of this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    /// Each that is given, and its text.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.0.iter().map(|(name, text)| (*name, text.as_str()))
    }

    /// Those of them that are this family's: for a list that holds options of several.
    #[must_use]
    pub fn of(&self, family: Family) -> Self {
        let own = self.0.iter().filter(|(name, _)| family.has_option(name));
        Self(own.map(|(name, text)| (*name, text.clone())).collect())
    }

    /// Whether a drive of this family can be opened with them.
    ///
    /// # Errors
    /// [`OptionError::Family`] with the first one that is another family's, [`OptionError::Value`] with the first one whose text is
    /// no value of this family's.
    pub fn check(&self, family: Family) -> Result<(), OptionError> {
        for (name, text) in &self.0 {
            match family.options().iter().find(|entry| entry.name == *name) {
                Some(entry) if (entry.is_value)(text) => {}
                Some(entry) => {
                    return Err(OptionError::Value { name, value: text.clone(), expected: entry.value });
                }
                None => {
                    let owner = all().find(|(_, entry)| entry.name == *name);
                    let owner = owner.map_or(family, |(owner, _)| owner);
                    return Err(OptionError::Family { name, owner, family });
                }
            }
        }
        Ok(())
    }
}

/// Every option of every family.
fn all() -> impl Iterator<Item = (Family, &'static OptionEntry)> {
    Family::all().into_iter().flat_map(|family| family.options().iter().map(move |entry| (family, entry)))
}

fn names(options: impl Iterator<Item = &'static OptionEntry>) -> String {
    let names: Vec<&str> = options.map(|entry| entry.name).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// An option that cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// No family has it.
    #[error("{0:?} is not an option of a drive: expected one of {names}", names = names(all().map(|(_, entry)| entry)))]
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
    #[error("option {name} belongs to the {owner}: the {family} has {own}", own = names(family.options().iter()))]
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
    use super::*;

    fn set(name: &str, value: &str) -> Result<Options, OptionError> {
        let mut options = Options::default();
        options.set(name, value).map(|()| options)
    }

    #[test]
    fn every_option_belongs_to_its_family_alone() {
        for (owner, entry) in all() {
            let value = match entry.name {
                "authority" => "settings",
                "speed-limits" => "1,2",
                "message-watch" => "1s",
                "read-only-function" => "4",
                "saves" => "123",
                _ => "007Bh",
            };
            let options = set(entry.name, value).unwrap();
            assert_eq!(options.get(entry.name), Some(value));
            for family in Family::BUILT_IN {
                let own = family == owner;
                assert_eq!(options.check(family).is_ok(), own, "{} {family}", entry.name);
                assert_eq!(options.of(family) == options, own, "{} {family}", entry.name);
                assert!(options.of(family).check(family).is_ok());
            }
        }
    }

    #[test]
    fn a_text_that_is_no_value_is_refused_with_what_was_expected_and_nothing_is_set() {
        for (_, entry) in all() {
            for value in ["", "?", "-1", "99999999999", "word"] {
                let mut options = Options::default();
                let error = options.set(entry.name, value).unwrap_err().to_string();
                assert!(error.contains(entry.name) && error.contains(entry.value), "{error}");
                assert_eq!(options, Options::default(), "{} = {value:?}", entry.name);
            }
        }
    }

    #[test]
    fn a_wrong_family_is_told_whose_the_option_is_and_what_it_has_itself() {
        let options = set("saves", "7").unwrap();
        let error = options.check(Family::ATV21).unwrap_err().to_string();
        assert_eq!(error, "option saves belongs to the 3g3ev: the atv21 has authority");
        let error = options.check(Family::ATV312).unwrap_err().to_string();
        assert_eq!(error, "option saves belongs to the 3g3ev: the atv312 has none");
        let error = set("save", "7").unwrap_err().to_string();
        assert!(
            error.starts_with("\"save\" is not an option of a drive: expected one of authority,"),
            "{error}"
        );
    }
}
