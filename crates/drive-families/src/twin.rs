//! The simulated twin of a family: [`Twin`].

use drive_sim::Model;

use crate::{Family, options::Options};

/// How a simulated drive is set up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum SetUp {
    /// For command by the bus, as far as the family needs settings for it.
    ForTheBus,
    /// As it leaves the factory.
    Factory,
}

/// How drives of a family are simulated.
#[derive(Clone, Copy)]
pub struct Twin {
    pub(crate) machine: &'static Machine,
    pub(crate) options: &'static [(&'static str, &'static str)],
    pub(crate) trip: Option<u16>,
}

/// Makes a simulated drive.
pub type Machine = dyn Fn(SetUp) -> Box<dyn Model> + Send + Sync;

impl Twin {
    /// By these machines.
    #[must_use]
    pub const fn new(machine: &'static Machine) -> Self {
        Self { machine, options: &[], trip: None }
    }

    /// The same, of whose machines that are set up for the bus an owner says this by options.
    #[must_use]
    pub const fn told(self, options: &'static [(&'static str, &'static str)]) -> Self {
        Self { options, ..self }
    }

    /// The same with the vendor's code of a trip that a reset clears, such as that of an overload.
    #[must_use]
    pub const fn tripping(self, code: u16) -> Self {
        Self { trip: Some(code), ..self }
    }
}

impl Family {
    /// A simulated drive of it; `None`: nobody has given it a twin.
    #[must_use]
    pub fn machine(self, set_up: SetUp) -> Option<Box<dyn Model>> {
        self.0.twin.map(|twin| (twin.machine)(set_up))
    }

    /// What the owner of its simulated drives that are set up for the bus says of them.
    #[must_use]
    pub fn simulated_options(self) -> Options {
        let told = self.0.twin.map_or::<&[_], _>(&[], |twin| twin.options);
        let mut options = Options::default();
        for (name, text) in told {
            options.keep(name, text);
        }
        options
    }

    /// The vendor's code of a trip of its simulated drives that a reset clears.
    #[must_use]
    pub fn simulated_trip(self) -> Option<u16> {
        self.0.twin?.trip
    }
}
