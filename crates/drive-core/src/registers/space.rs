//! The four spaces of Modbus, and a place in one of them.

use std::fmt;

/// Where a register stands (Modbus Application Protocol V1.1b3, section 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Space {
    /// A bit that can be read and written.
    Coil,
    /// A bit that can be read.
    DiscreteInput,
    /// A word that can be read.
    InputRegister,
    /// A word that can be read and written.
    HoldingRegister,
}

impl Space {
    /// Whether one of it is a bit.
    #[must_use]
    pub const fn is_bit(self) -> bool {
        matches!(self, Self::Coil | Self::DiscreteInput)
    }

    /// The function that reads it.
    #[must_use]
    pub const fn read_by(self) -> u8 {
        match self {
            Self::Coil => 1,
            Self::DiscreteInput => 2,
            Self::HoldingRegister => 3,
            Self::InputRegister => 4,
        }
    }

    /// The functions that write one or several of it.
    #[must_use]
    pub const fn written_by(self) -> Option<[u8; 2]> {
        match self {
            Self::Coil => Some([5, 15]),
            Self::HoldingRegister => Some([6, 16]),
            Self::DiscreteInput | Self::InputRegister => None,
        }
    }
}

impl fmt::Display for Space {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Coil => "coil",
            Self::DiscreteInput => "discrete input",
            Self::InputRegister => "input register",
            Self::HoldingRegister => "holding register",
        })
    }
}

/// One register, coil or input of a drive: there may be one of each kind at an address.
///
/// ```
/// use drive_core::registers::{Place, Space};
///
/// assert_eq!(Place::from(3201).to_string(), "3201");
/// let coil = Place { space: Space::Coil, address: 14 };
/// assert_eq!(coil.to_string(), "coil 14");
/// assert_eq!(Place::read("coil 14"), Some(coil));
/// assert_eq!(Place::read("14"), None, "whose it is, is not said");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Place {
    /// The space.
    pub space: Space,
    /// The address on the wire.
    pub address: u16,
}

impl Place {
    /// A place as [`Display`](fmt::Display) writes it with its space.
    #[must_use]
    pub fn read(text: &str) -> Option<Self> {
        let spaces = [Space::Coil, Space::DiscreteInput, Space::InputRegister, Space::HoldingRegister];
        spaces.into_iter().find_map(|space| {
            let address = text.strip_prefix(&*space.to_string())?.strip_prefix(' ')?.parse().ok()?;
            Some(Self { space, address })
        })
    }
}

/// A holding register.
impl From<u16> for Place {
    fn from(address: u16) -> Self {
        Self { space: Space::HoldingRegister, address }
    }
}

/// Its space, but for a holding register, which is what most are, and its address.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.space {
            Space::HoldingRegister => write!(f, "{}", self.address),
            space => write!(f, "{space} {}", self.address),
        }
    }
}
