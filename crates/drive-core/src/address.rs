//! The address of a slave.

use std::{fmt, str::FromStr};

/// The address of one slave, 1 to 247.
///
/// ```
/// use drive_core::SlaveAddress;
///
/// let seven: SlaveAddress = "7".parse()?;
/// assert_eq!(seven.number(), 7);
/// assert!(SlaveAddress::try_from(0).is_err(), "the broadcast is no slave's");
/// # Ok::<(), drive_core::SlaveAddressError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "u8", into = "u8")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct SlaveAddress(#[cfg_attr(feature = "schemars", schemars(range(min = 1, max = 247)))] u8);

impl SlaveAddress {
    /// The lowest.
    pub const MIN: Self = Self(1);
    /// The highest.
    pub const MAX: Self = Self(247);

    /// The address as a number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0
    }
}

impl TryFrom<u8> for SlaveAddress {
    type Error = SlaveAddressError;

    fn try_from(number: u8) -> Result<Self, SlaveAddressError> {
        let is_one = (Self::MIN.0..=Self::MAX.0).contains(&number);
        if is_one { Ok(Self(number)) } else { Err(SlaveAddressError(number.to_string())) }
    }
}

impl From<SlaveAddress> for u8 {
    fn from(address: SlaveAddress) -> Self {
        address.0
    }
}

/// Reads it in decimal digits.
impl FromStr for SlaveAddress {
    type Err = SlaveAddressError;

    fn from_str(text: &str) -> Result<Self, SlaveAddressError> {
        let number: Option<u8> = text.parse().ok();
        number.and_then(|number| number.try_into().ok()).ok_or_else(|| SlaveAddressError(text.to_owned()))
    }
}

impl fmt::Display for SlaveAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A number or a text that is no slave's address.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0} is not a slave address: expected 1 to 247 (0 is the broadcast, 248 to 255 are reserved)")]
pub struct SlaveAddressError(String);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_1_to_247() {
        assert!(SlaveAddress::try_from(0).is_err());
        assert!(SlaveAddress::try_from(1).is_ok());
        assert!(SlaveAddress::try_from(247).is_ok());
        assert!(SlaveAddress::try_from(248).is_err());
    }

    #[test]
    fn a_text_that_is_no_address_is_named() {
        assert_eq!("247".parse(), Ok(SlaveAddress::MAX));
        for text in ["", "0", "248", "256", "-1", "x7", " 7"] {
            let error = text.parse::<SlaveAddress>().unwrap_err().to_string();
            assert!(error.starts_with(&format!("{text} is not a slave address")), "{error}");
        }
    }

    #[cfg(feature = "serde")]
    #[test]
    fn an_address_is_written_as_its_number_and_no_other_number_is_read() {
        let address: SlaveAddress = serde_json::from_str("17").unwrap();
        assert_eq!(serde_json::to_string(&address).unwrap(), "17");
        for text in ["0", "248", "300", "\"17\"", "null"] {
            assert!(serde_json::from_str::<SlaveAddress>(text).is_err(), "{text}");
        }
    }
}
