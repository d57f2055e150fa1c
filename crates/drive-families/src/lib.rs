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
//!
//! Five are built in. One from outside is a [`Definition`] too, and known by its name once it was [added](Family::add).

#![forbid(unsafe_code)]

mod bits;
mod definition;
mod five;
mod nowhere;
mod options;
#[cfg(feature = "sim")]
pub mod simulated;
mod texts;
#[cfg(feature = "sim")]
mod twin;

use std::{
    cmp::Ordering,
    collections::BTreeMap,
    fmt,
    hash::{Hash, Hasher},
    str::FromStr,
    sync::{PoisonError, RwLock},
};

use drive_core::{Capabilities, Drive, Port, SlaveAddress, WatchdogCapability};

#[cfg(feature = "sim")]
pub use crate::twin::{Machine, SetUp, Twin};
pub use crate::{
    bits::Bit,
    definition::{Bits, Definition, Open},
    options::{IsValue, OptionEntry, OptionError, Options},
};
use crate::{
    five::{atv21, atv28, atv58, atv312, omron_3g3ev},
    nowhere::Nowhere,
};

/// A family of drives: a handle of its [`Definition`]. Two are the same where their [names](Capabilities::key) are; those that are
/// [built in](Self::BUILT_IN) come first, in that order, then the others by their names.
#[derive(Clone, Copy)]
pub struct Family(pub(crate) &'static Definition);

/// Families from outside that a program knows by name.
static ADDED: RwLock<Vec<Family>> = RwLock::new(Vec::new());

/// Names that are no families, or not those that a file was to say, and why.
static LEFT_OUT: RwLock<BTreeMap<String, String>> = RwLock::new(BTreeMap::new());

impl Family {
    /// Schneider Altivar 21.
    pub const ATV21: Self = Self(atv21::DEFINITION);
    /// Schneider Altivar 28.
    pub const ATV28: Self = Self(atv28::DEFINITION);
    /// Schneider Altivar 58 with its communication card.
    pub const ATV58: Self = Self(atv58::DEFINITION);
    /// Schneider Altivar 312.
    pub const ATV312: Self = Self(atv312::DEFINITION);
    /// Omron 3G3EV.
    pub const OMRON_3G3EV: Self = Self(omron_3g3ev::DEFINITION);

    /// Those that every program knows.
    pub const BUILT_IN: [Self; 5] = [Self::ATV21, Self::ATV28, Self::ATV58, Self::ATV312, Self::OMRON_3G3EV];

    /// The family of this definition. By name it is known once it was [added](Self::add).
    #[must_use]
    pub const fn new(definition: &'static Definition) -> Self {
        Self(definition)
    }

    /// Makes it known by its name to everything in this program that chooses drives by name: configurations, command lines, `scan`.
    /// For the beginning of a program; there is no way back.
    ///
    /// # Errors
    /// A family of this name is known already, or it is no name: `@`, a space and what is not ASCII stand in none.
    pub fn add(self) -> Result<(), NameTaken> {
        let key = self.capabilities().key;
        let is_name = !key.is_empty() && key.bytes().all(|byte| byte.is_ascii_graphic() && byte != b'@');
        let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
        let mut known = Self::BUILT_IN.iter().chain(&*added);
        if !is_name || known.any(|family| family.capabilities().key.eq_ignore_ascii_case(key)) {
            return Err(NameTaken(key));
        }
        added.push(self);
        Ok(())
    }

    /// The same in place of one that was added by this name, of which drives that are open go on as they are; where none was,
    /// it is added. For families from files that are read again.
    ///
    /// # Errors
    /// As for [`add`](Self::add), where one that is built in has the name.
    pub fn exchange(self) -> Result<(), NameTaken> {
        let key = self.capabilities().key;
        let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
        match added.iter_mut().find(|family| family.capabilities().key == key) {
            Some(known) => *known = self,
            None => {
                drop(added);
                return self.add();
            }
        }
        Ok(())
    }

    /// That a name which somebody may mean is no family's, and why; `None`: nothing is wrong with it any more.
    pub fn leave_out(name: &str, why: Option<String>) {
        let mut left_out = LEFT_OUT.write().unwrap_or_else(PoisonError::into_inner);
        match why {
            Some(why) => left_out.insert(name.to_ascii_lowercase(), why),
            None => left_out.remove(&name.to_ascii_lowercase()),
        };
    }

    /// Why a name is no family's, or is not the one that a file was to say, where that was told by [`leave_out`](Self::leave_out).
    #[must_use]
    pub fn why_left_out(name: &str) -> Option<String> {
        let left_out = LEFT_OUT.read().unwrap_or_else(PoisonError::into_inner);
        left_out.get(&name.to_ascii_lowercase()).cloned()
    }

    /// All that this program knows by name: those that are [built in](Self::BUILT_IN), then those that were added.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
        Self::BUILT_IN.iter().chain(&*added).copied().collect()
    }

    /// What it can do.
    #[must_use]
    pub const fn capabilities(self) -> &'static Capabilities {
        self.0.capabilities
    }

    /// What only the owner of such a drive knows of it.
    #[must_use]
    pub const fn options(self) -> &'static [OptionEntry] {
        self.0.options
    }

    /// Which content of a file it was read from; `None`: it is from none. Two of one name may differ in it.
    #[must_use]
    pub const fn revision(self) -> Option<&'static str> {
        self.0.revision
    }

    /// What nobody can know of a drive of it, in sentences: to be said to whoever commands one.
    #[must_use]
    pub const fn not_known(self) -> &'static [&'static str] {
        self.0.not_known
    }

    /// Whether anything that its drives read to be tells them from others.
    #[must_use]
    pub const fn tells_itself(self) -> bool {
        self.0.tells_itself
    }

    /// Whether this is the name of one of its options.
    #[must_use]
    pub fn has_option(self, name: &str) -> bool {
        self.0.options.iter().any(|entry| entry.name == name)
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
        (self.0.open)(Box::new(port), slave, options)
    }

    /// The communication watchdog of a drive of this family on its line, of which those of the options hold that are the
    /// family's: [`Drive::watchdog_capability`], asked without a line.
    #[must_use]
    pub fn watchdog(self, ascii: bool, options: &Options) -> Option<WatchdogCapability> {
        let slave = SlaveAddress::try_from(1).ok()?;
        self.open_with(Nowhere { ascii }, slave, options).watchdog_capability()
    }
}

impl PartialEq for Family {
    fn eq(&self, other: &Self) -> bool {
        self.capabilities().key == other.capabilities().key
    }
}

impl Eq for Family {}

impl Ord for Family {
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |family: &Self| Self::BUILT_IN.iter().position(|built_in| built_in == family);
        // Whoever has no place comes behind all that have one.
        let rank = |family: &Self| place(family).unwrap_or(Self::BUILT_IN.len());
        rank(self).cmp(&rank(other)).then_with(|| self.capabilities().key.cmp(other.capabilities().key))
    }
}

impl PartialOrd for Family {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Hash for Family {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.capabilities().key.hash(state);
    }
}

impl fmt::Debug for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Family({})", self.capabilities().key)
    }
}

/// Prints the name that configurations use, [`Capabilities::key`].
impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.capabilities().key)
    }
}

/// A family cannot be known by this name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no family can be added by the name {0:?}: another has it, or it is none")]
pub struct NameTaken(pub &'static str);

/// A name that is no family's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is not a family of drives{why}", why = why_not(.0))]
pub struct UnknownFamily(pub String);

/// Why a name is no family's, where that was told; else the names that are.
fn why_not(name: &str) -> String {
    match Family::why_left_out(name) {
        Some(why) => format!(": {why}"),
        None => format!(": expected one of {}", keys()),
    }
}

fn keys() -> String {
    Family::all().iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

impl FromStr for Family {
    type Err = UnknownFamily;

    fn from_str(text: &str) -> Result<Self, UnknownFamily> {
        let is_it = |family: &&Self| family.capabilities().key.eq_ignore_ascii_case(text);
        let added = ADDED.read().unwrap_or_else(PoisonError::into_inner);
        let found = Self::BUILT_IN.iter().chain(&*added).find(is_it).copied();
        drop(added);
        found.ok_or_else(|| UnknownFamily(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_family_is_found_by_the_name_that_it_prints() {
        for family in Family::BUILT_IN {
            assert_eq!(family.to_string().parse(), Ok(family));
            assert_eq!(family.to_string().to_uppercase().parse(), Ok(family));
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_names_that_exist() {
        let error = "atv999".parse::<Family>().unwrap_err().to_string();
        assert!(error.starts_with("\"atv999\" is not a family of drives"), "{error}");
        for family in Family::BUILT_IN {
            assert!(error.contains(family.capabilities().key), "{error}");
        }
    }

    #[test]
    fn a_name_that_is_taken_or_is_none_is_no_new_family() {
        static TAKEN: Capabilities = Capabilities::least("ATV312", "somebody else's");
        static BROKEN: Capabilities = Capabilities::least("fan@1", "one whose name is no name");
        static EMPTY: Capabilities = Capabilities::least("", "nobody");
        for capabilities in [&TAKEN, &BROKEN, &EMPTY] {
            let definition = Box::leak(Box::new(Definition::new(capabilities, atv312::DEFINITION.open)));
            assert_eq!(Family::new(definition).add(), Err(NameTaken(capabilities.key)));
        }
        assert_eq!(Family::all(), Family::BUILT_IN);
    }
}
