//! Faults as the vendor lists them, in a form that a person can act on.

#[cfg(feature = "serde")]
mod json;

use std::fmt;

/// What is known of one fault code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FaultEntry {
    /// The vendor's code.
    pub code: u16,
    /// The mnemonic on the keypad.
    pub mnemonic: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What to do first.
    pub remedy: &'static str,
}

impl FaultEntry {
    /// A row of a family's fault table.
    #[must_use]
    pub const fn new(code: u16, mnemonic: &'static str, meaning: &'static str, remedy: &'static str) -> Self {
        Self { code, mnemonic, meaning, remedy }
    }
}

/// A fault that a drive reported: its number always, and what the manual says of it where it says something.
///
/// ```
/// use drive_core::{Fault, FaultEntry};
///
/// static FAULTS: &[FaultEntry] =
///     &[FaultEntry::new(9, "OCF", "overcurrent", "check the motor and the settings of its plate")];
///
/// let fault = Fault::lookup(FAULTS, 9);
/// assert_eq!(fault.to_string(), "9 OCF: overcurrent");
/// // A code that the manual does not list keeps its number.
/// assert_eq!(Fault::lookup(FAULTS, 77).to_string(), "77 ?: a code that the manual does not list");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Fault {
    /// The vendor's code.
    pub code: u16,
    /// The manual's entry; `None` for a code that the manual does not list.
    pub entry: Option<&'static FaultEntry>,
}

impl Fault {
    /// The fault with this code, looked up in a family's table.
    #[must_use]
    pub fn lookup(table: &'static [FaultEntry], code: u16) -> Self {
        Self { code, entry: table.iter().find(|entry| entry.code == code) }
    }

    /// The mnemonic, or `?` for a code that the manual does not list.
    #[must_use]
    pub fn mnemonic(&self) -> &'static str {
        self.entry.map_or("?", |entry| entry.mnemonic)
    }

    /// The meaning, or a sentence that says that the manual has none.
    #[must_use]
    pub fn meaning(&self) -> &'static str {
        self.entry.map_or("a code that the manual does not list", |entry| entry.meaning)
    }

    /// What to do first, where it is known.
    #[must_use]
    pub fn remedy(&self) -> Option<&'static str> {
        self.entry.map(|entry| entry.remedy).filter(|remedy| !remedy.is_empty())
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}: {}", self.code, self.mnemonic(), self.meaning())
    }
}

/// The faults of a drive.
///
/// ```
/// use drive_core::{Fault, Faults};
///
/// let faults = Faults { present: vec![Fault { code: 9, entry: None }], ..Faults::default() };
/// let codes: Vec<_> = faults.present.iter().map(|fault| fault.code).collect();
/// assert_eq!(codes, [9]);
/// assert_eq!(faults.reset_allowed, None, "this drive does not say");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Faults {
    /// The present faults. Most drives have at most one; the 3G3EV and the Altivar 58 report bits, so several can be
    /// present at once.
    pub present: Vec<Fault>,
    /// The history, in the order in which the drive keeps it (its README says which end is the newest). Empty where
    /// the family has none.
    pub history: Vec<Fault>,
    /// Alarms that do not trip.
    pub warnings: Vec<Fault>,
    /// Whether the drive says that it has tripped, by the word that its status goes by: it may name no fault for it, or not yet.
    #[cfg_attr(feature = "serde", serde(default))]
    pub tripped: bool,
    /// Whether the drive says that a reset would be accepted; `None` where it does not say.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub reset_allowed: Option<bool>,
}
