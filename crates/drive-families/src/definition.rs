//! What a family consists of: [`Definition`].

use std::fmt;

use drive_core::{Capabilities, Drive, Port, SlaveAddress};

#[cfg(feature = "sim")]
use crate::twin::Twin;
use crate::{
    bits::Bit,
    options::{OptionEntry, Options},
};

/// Makes the drive of this address behind a port, as its owner says that it is. Nothing is sent by it.
pub type Open = dyn Fn(Box<dyn Port>, SlaveAddress, &Options) -> Box<dyn Drive> + Send + Sync;

/// The bits that the manual names of the register at an address, the lowest first.
pub type Bits = dyn Fn(u16) -> Vec<Bit> + Send + Sync;

/// What a family of drives consists of, for whoever chooses drives by name.
///
/// A family from outside is one by the same definition as ours, and gets everything that ours get:
///
/// ```
/// use drive_core::{Capabilities, Drive, Port, SlaveAddress};
/// use drive_families::{Definition, Family, OptionEntry, Options};
///
/// const CAPABILITIES: Capabilities = Capabilities::least("fan1", "Somebody's fan drive");
///
/// fn open(port: Box<dyn Port>, slave: SlaveAddress, options: &Options) -> Box<dyn Drive> {
///     # let _ = (port, slave, options);
///     todo!("Fan1::new(port, slave)")
/// }
///
/// static FAN1: Definition = Definition::new(&CAPABILITIES, &open).with_options(&[OptionEntry::new(
///     "blades",
///     "a whole number",
///     "how many blades its fan has (default 6)",
///     &|text| text.parse::<u8>().is_ok(),
/// )]);
///
/// // Once, where the program begins.
/// Family::new(&FAN1).add()?;
/// assert_eq!("fan1".parse::<Family>().unwrap().capabilities().name, "Somebody's fan drive");
/// # Ok::<(), drive_families::NameTaken>(())
/// ```
///
/// One that is read from a file has its tables by [`drive_core::interned`], and functions that hold what was read. A function from a
/// file is kept for the life of the program: whoever reads files again keeps the definition of each content once.
#[derive(Clone, Copy)]
pub struct Definition {
    pub(crate) capabilities: &'static Capabilities,
    pub(crate) open: &'static Open,
    pub(crate) options: &'static [OptionEntry],
    pub(crate) bits: &'static Bits,
    pub(crate) revision: Option<&'static str>,
    pub(crate) not_known: &'static [&'static str],
    pub(crate) tells_itself: bool,
    #[cfg(feature = "sim")]
    pub(crate) twin: Option<Twin>,
}

impl Definition {
    /// A family that can do this, and how a drive of it is made.
    #[must_use]
    pub const fn new(capabilities: &'static Capabilities, open: &'static Open) -> Self {
        Self {
            capabilities,
            open,
            options: &[],
            bits: &|_| Vec::new(),
            revision: None,
            not_known: &[],
            tells_itself: true,
            #[cfg(feature = "sim")]
            twin: None,
        }
    }

    /// The same with what only the owner of such a drive knows of it.
    #[must_use]
    pub const fn with_options(self, options: &'static [OptionEntry]) -> Self {
        Self { options, ..self }
    }

    /// The same with the bits that the manual names of the register at an address, the lowest first.
    #[must_use]
    pub const fn with_bits(self, bits: &'static Bits) -> Self {
        Self { bits, ..self }
    }

    /// The same, read from a file of this content, by a text that each content has alone.
    #[must_use]
    pub const fn with_revision(self, revision: &'static str) -> Self {
        Self { revision: Some(revision), ..self }
    }

    /// The same with what nobody can know of a drive of it, in sentences for whoever commands one.
    #[must_use]
    pub const fn with_not_known(self, not_known: &'static [&'static str]) -> Self {
        Self { not_known, ..self }
    }

    /// The same, of whose drives nothing tells what they are: who looks for drives takes none for one of these.
    #[must_use]
    pub const fn without_tell_tale(self) -> Self {
        Self { tells_itself: false, ..self }
    }

    /// The same with its simulated twin, by which `sim`, `demo` and tests have such drives. With the feature `sim`.
    #[cfg(feature = "sim")]
    #[must_use]
    pub const fn with_twin(self, twin: Twin) -> Self {
        Self { twin: Some(twin), ..self }
    }
}

impl fmt::Debug for Definition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Definition")
            .field("capabilities", &self.capabilities)
            .field("options", &self.options)
            .finish_non_exhaustive()
    }
}
