//! The address of a slave.

use std::fmt;

/// The address of one slave, 1 to 247.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SlaveAddress(u8);

impl SlaveAddress {
    /// The address as a number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0
    }
}

impl TryFrom<u8> for SlaveAddress {
    type Error = SlaveAddressError;

    fn try_from(number: u8) -> Result<Self, SlaveAddressError> {
        if (1..=247).contains(&number) { Ok(Self(number)) } else { Err(SlaveAddressError(number)) }
    }
}

impl fmt::Display for SlaveAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A number that is no slave's address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} is not a slave address: expected 1 to 247 (0 is the broadcast, 248 to 255 are reserved)")]
pub struct SlaveAddressError(u8);

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
}
