//! [`Identity`]: what a drive says it is.

use std::fmt;

use crate::{refusal::Refusal, status::RawWord};

/// What a drive says it is. Two drives that differ in any part are different drives.
///
/// ```
/// use drive_core::Identity;
///
/// let remembered = Identity {
///     vendor: Some("Telemecanique".to_owned()),
///     model: Some("ATV312H075M2".to_owned()),
///     ..Identity::default()
/// };
/// let found = Identity { version: Some("5.1".to_owned()), ..remembered.clone() };
/// assert_ne!(remembered, found);
/// assert_eq!(found.to_string(), "Telemecanique ATV312H075M2 5.1");
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Identity {
    /// The vendor's name.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub vendor: Option<String>,
    /// The model or reference.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub model: Option<String>,
    /// The version of its firmware, as it writes it.
    #[cfg_attr(feature = "serde", serde(rename = "firmware", skip_serializing_if = "Option::is_none"))]
    pub version: Option<String>,
    /// Words that tell one model from another, where the family has registers for it.
    pub codes: Vec<RawWord>,
}

impl Identity {
    /// Why no start is given to a drive that says this now, where it said something else `before`: it was exchanged between two looks.
    /// What it says the first time is kept there.
    pub fn refuses_start(self, before: &mut Option<Self>) -> Option<Refusal> {
        let is_other = before.as_ref().is_some_and(|before| *before != self);
        before.get_or_insert(self);
        is_other.then_some(Refusal::Exchanged)
    }
}

/// Every part that it says, one after the other.
impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = [&self.vendor, &self.model, &self.version].into_iter().flatten().cloned();
        let codes = self.codes.iter().map(|word| format!("{} {}", word.code, word.value));
        f.write_str(&words.chain(codes).collect::<Vec<_>>().join(" "))
    }
}
