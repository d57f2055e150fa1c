//! [`Place`]: which machine a drive is.

use std::{fmt, sync::Arc};

use drive_bus::Endpoint;
use drive_core::SlaveAddress;

/// Which machine a drive is, whatever it and its line are called at the moment: the port of its line, its family and its address there. A
/// name is what a person calls a drive, and two may exchange theirs; what was kept, stopped or shown of a machine belongs to its place.
///
/// It prints as it is kept in files and told to clients, `/dev/ttyUSB0 atv312@1`, and one that comes back from there ([`From`]) is that of a
/// drive where both are the same to the letter.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
pub struct Place(Arc<str>);

impl Place {
    /// That of a drive of a family, by the [key](drive_core::Capabilities::key) of that, on a line. One stream is told from another by the
    /// name of its line alone; the name of any other line means nothing.
    #[must_use]
    pub fn of(line: &str, endpoint: &Endpoint, family: &str, slave: SlaveAddress) -> Self {
        let drive = format_args!("{family}@{slave}");
        let text = match endpoint {
            Endpoint::Stream => format!("{line} {drive}"),
            port => format!("{port} {drive}"),
        };
        Self(Arc::from(text))
    }

    /// The family and the address, whatever the port is called.
    #[must_use]
    pub fn drive(&self) -> &str {
        self.0.rsplit(' ').next().unwrap_or_default()
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

/// One that was kept or told.
impl From<&str> for Place {
    fn from(told: &str) -> Self {
        Self(Arc::from(told))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_the_port_the_family_and_the_address_and_of_a_stream_the_name_of_its_line() {
        let slave = SlaveAddress::try_from(7).unwrap();
        let at = |line, endpoint: &Endpoint| Place::of(line, endpoint, "atv312", slave);
        let serial = Endpoint::Serial("/dev/serial/by-path/a port".into());
        let place = at("north", &serial);
        assert_eq!(place.to_string(), "/dev/serial/by-path/a port atv312@7");
        assert_eq!(place.drive(), "atv312@7");
        assert_eq!(place, Place::from("/dev/serial/by-path/a port atv312@7"), "as it was kept");
        assert_eq!(place, at("south", &serial), "a line may be called otherwise");
        let server = Endpoint::Tcp("10.0.0.5:502".to_owned());
        assert_eq!(at("north", &server).to_string(), "tcp://10.0.0.5:502 atv312@7");
        assert_ne!(at("north", &Endpoint::Stream), at("south", &Endpoint::Stream), "two streams");
    }
}
