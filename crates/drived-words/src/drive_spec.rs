//! What `--drive` says: `FAMILY@ADDRESSES`, such as `atv312@1-10,12`.

use std::{collections::BTreeMap, fmt, str::FromStr};

use drive_core::{SlaveAddress, SlaveAddressError};
use drive_families::{Family, UnknownFamily};

use crate::meant::{did_you_mean, nearest};

/// One drive: a family at an address. It prints as it is written, `atv312@7`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DriveName {
    pub family: Family,
    pub slave: SlaveAddress,
}

impl fmt::Display for DriveName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&format!("{}@{}", self.family, self.slave))
    }
}

/// Drives of one family at one or more addresses, each at most once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DriveSpec {
    family: Family,
    slaves: Vec<SlaveAddress>,
}

impl DriveSpec {
    pub fn names(&self) -> impl Iterator<Item = DriveName> + '_ {
        self.slaves.iter().map(|&slave| DriveName { family: self.family, slave })
    }

    /// The only drive of it, if it is one.
    pub fn single(&self) -> Option<DriveName> {
        match *self.slaves {
            [slave] => Some(DriveName { family: self.family, slave }),
            _ => None,
        }
    }
}

/// The drives of one line, in the order in which they were named.
pub fn on_one_line(specs: &[DriveSpec]) -> Result<Vec<DriveName>, AddressTwice> {
    let mut by_address = BTreeMap::new();
    let mut names = Vec::new();
    for name in specs.iter().flat_map(DriveSpec::names) {
        if let Some(first) = by_address.insert(name.slave, name) {
            return Err(AddressTwice { first, second: name });
        }
        names.push(name);
    }
    Ok(names)
}

/// Drives of one line as a person lists them, each with the name that its owner gave it:
/// `atv312@1-10,12 (fan 1 … fan 12)`.
pub fn listed(drives: &[(DriveName, String)]) -> String {
    let of_family = |drives: &[(DriveName, String)]| {
        let slaves = Addresses(drives.iter().map(|(name, _)| name.slave).collect());
        drives.first().map(|(name, _)| format!("{}@{slaves}", name.family))
    };
    let families: Vec<String> =
        drives.chunk_by(|(one, _), (next, _)| one.family == next.family).filter_map(of_family).collect();
    let text = families.join(" ");
    match drives {
        [(name, own), ..] if *own == name.to_string() => text,
        [(_, only)] => format!("{text} ({only})"),
        [(_, first), (_, second)] => format!("{text} ({first}, {second})"),
        [(_, first), .., (_, last)] => format!("{text} ({first} … {last})"),
        [] => text,
    }
}

/// Two drives at one address of one line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{first} and {second}: two drives cannot have one address on a line")]
pub struct AddressTwice {
    first: DriveName,
    second: DriveName,
}

/// A text that names no drives.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DriveSpecError {
    #[error("expected FAMILY@ADDRESSES, such as atv312@1 or atv312@1-10,12{0}")]
    Form(String),
    #[error("{unknown}{}", meant(unknown))]
    Family { unknown: UnknownFamily },
    #[error("{0:?} is not an address or a range of addresses: expected 1 to 247 or a range such as 1-10")]
    Number(String),
    #[error(transparent)]
    Address(#[from] SlaveAddressError),
    #[error("{slave} is too high an address: the {family} has addresses 1 to {highest}")]
    TooHigh { slave: SlaveAddress, family: &'static str, highest: u8 },
    #[error("the range {first}-{last} runs backwards: did you mean {last}-{first}?")]
    Backwards { first: SlaveAddress, last: SlaveAddress },
    #[error("the address {0} is named twice: once is enough")]
    Twice(SlaveAddress),
}

impl FromStr for DriveSpec {
    type Err = DriveSpecError;

    fn from_str(text: &str) -> Result<Self, DriveSpecError> {
        // Somebody else's sign between them can mean nothing else.
        let parts = text.split_once('@').or_else(|| text.split_once(':'));
        let (family, addresses) = parts.ok_or_else(|| DriveSpecError::Form(missing(text)))?;
        let family: Family = family.trim().parse().map_err(|unknown| DriveSpecError::Family { unknown })?;
        let Addresses(slaves) = addresses.parse()?;
        let capabilities = family.capabilities();
        match slaves.iter().find(|slave| slave.number() > capabilities.highest_address) {
            Some(&slave) => Err(DriveSpecError::TooHigh {
                slave,
                family: capabilities.name,
                highest: capabilities.highest_address,
            }),
            None => Ok(Self { family, slaves }),
        }
    }
}

/// Which families may have been meant by a name that is none.
pub fn meant(unknown: &UnknownFamily) -> String {
    let all: Vec<String> = Family::all().iter().map(ToString::to_string).collect();
    did_you_mean(&nearest(&unknown.0, all.iter().map(String::as_str)))
}

/// What is missing where a family or an address stands alone.
fn missing(text: &str) -> String {
    match text.trim().parse::<Family>() {
        Ok(family) => format!(": at which address? {family}@1, or drived scan finds it"),
        Err(_) if text.parse::<Addresses>().is_ok() => ": of which family? drived scan finds it".to_owned(),
        Err(_) => String::new(),
    }
}

/// Addresses in the order in which they were named, each at most once: `1-10,12`. Spaces and semicolons part them too, and a range
/// may be written as `1..3`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Addresses(pub Vec<SlaveAddress>);

impl FromStr for Addresses {
    type Err = DriveSpecError;

    fn from_str(text: &str) -> Result<Self, DriveSpecError> {
        let mut slaves = Vec::new();
        let text = text.trim().replace("..=", "-").replace("..", "-").replace('–', "-");
        // Spaces around a sign part nothing.
        let parts =
            text.split([',', ';']).flat_map(|part| match part.contains('-') || part.trim().is_empty() {
                true => vec![part.trim()],
                false => part.split_whitespace().collect(),
            });
        for part in parts {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let (first, last) = (address(first.trim())?, address(last.trim())?);
            if first > last {
                return Err(DriveSpecError::Backwards { first, last });
            }
            for number in first.number()..=last.number() {
                let slave = SlaveAddress::try_from(number)?;
                if slaves.contains(&slave) {
                    return Err(DriveSpecError::Twice(slave));
                }
                slaves.push(slave);
            }
        }
        Ok(Self(slaves))
    }
}

/// It prints as it can be written, ranges of three and more as such.
impl fmt::Display for Addresses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let follows =
            |one: &SlaveAddress, next: &SlaveAddress| one.number().checked_add(1) == Some(next.number());
        for (index, range) in self.0.chunk_by(follows).enumerate() {
            let comma = if index > 0 { "," } else { "" };
            match range {
                [first, .., last] if range.len() > 2 => write!(f, "{comma}{first}-{last}")?,
                [first, last] => write!(f, "{comma}{first},{last}")?,
                _ => range.iter().try_for_each(|slave| write!(f, "{comma}{slave}"))?,
            }
        }
        Ok(())
    }
}

fn address(text: &str) -> Result<SlaveAddress, DriveSpecError> {
    let number: u8 = text.parse().map_err(|_| DriveSpecError::Number(text.to_owned()))?;
    Ok(SlaveAddress::try_from(number)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(text: &str) -> Vec<u8> {
        let spec: DriveSpec = text.parse().unwrap();
        spec.names().map(|name| name.slave.number()).collect()
    }

    #[test]
    fn addresses_are_single_numbers_and_ranges() {
        assert_eq!(numbers("atv312@7"), [7]);
        assert_eq!(numbers("atv312@1-3,12,31"), [1, 2, 3, 12, 31]);
    }

    #[test]
    fn what_can_mean_nothing_else_is_understood() {
        assert_eq!(numbers("atv312@1..3"), [1, 2, 3]);
        assert_eq!(numbers("atv312@1 2 3"), [1, 2, 3]);
        assert_eq!(numbers("atv312@1, 3 - 5; 7"), [1, 3, 4, 5, 7]);
        assert_eq!(numbers("ATV312:7"), [7]);
    }

    #[test]
    fn drives_are_listed_as_they_could_be_written() {
        for text in ["atv312@7", "atv312@1-31", "atv312@1,2", "atv312@1-3,5,6,9-11", "atv312@1-3 atv21@4,5,9"]
        {
            let drives: Vec<_> = text
                .split(' ')
                .flat_map(|spec| spec.parse::<DriveSpec>().unwrap().names().collect::<Vec<_>>())
                .collect();
            let plain: Vec<_> = drives.iter().map(|name| (*name, name.to_string())).collect();
            assert_eq!(listed(&plain), text);
        }
        let fan = |number: u8| {
            (
                DriveName { family: Family::ATV312, slave: SlaveAddress::try_from(number).unwrap() },
                format!("fan {number}"),
            )
        };
        assert_eq!(listed(&[fan(1), fan(2), fan(3)]), "atv312@1-3 (fan 1 … fan 3)");
        assert_eq!(listed(&[fan(9)]), "atv312@9 (fan 9)");
    }

    #[test]
    fn what_no_drive_can_have_is_refused_with_the_reason() {
        for (text, reason) in [
            ("atv312", "at which address? atv312@1"),
            ("1", "of which family?"),
            ("", "expected FAMILY@ADDRESSES"),
            ("atv321@1", "did you mean atv21 or atv312?"),
            ("atv999@1", "is not a family of drives: expected one of"),
            ("atv312@", "is not an address"),
            ("atv312@x", "is not an address"),
            ("atv312@-3", "is not an address"),
            ("atv312@1-2-3", "is not an address"),
            ("atv312@300", "is not an address"),
            ("atv312@0", "0 is not a slave address"),
            ("atv312@248", "248 is not a slave address"),
            ("atv312@5-2", "runs backwards: did you mean 2-5?"),
            ("atv312@1-5,3", "named twice"),
            ("atv28@32", "addresses 1 to 31"),
        ] {
            let error = text.parse::<DriveSpec>().unwrap_err().to_string();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }

    #[test]
    fn two_drives_of_one_line_have_two_addresses() {
        let specs: Vec<DriveSpec> =
            ["atv312@1-3", "atv21@3"].iter().map(|text| text.parse().unwrap()).collect();
        let error = on_one_line(&specs).unwrap_err().to_string();
        assert!(error.starts_with("atv312@3 and atv21@3"), "{error}");
        assert_eq!(on_one_line(&specs[..1]).unwrap().len(), 3);
    }
}
