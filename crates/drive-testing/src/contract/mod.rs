//! What every family promises of itself: [`Contract`]. A family from outside runs it on itself as ours do.

pub mod adversary;
mod claims;
mod story;
mod words;
pub mod worlds;

use drive_bus::Protocol;
use drive_core::{Capabilities, Drive, ExceptionMeaning, Port, SerialSettings, SlaveAddress};
use drive_sim::Model;

use crate::rig::Rig;

use worlds::{Share, Surrounded};

/// How many of its worlds a family is checked in.
const CHECKED: Share = Share::one_in(61);

/// A family, and what its [`Capabilities`] do not say of it. Whatever the drive says, nothing panics and nothing is sent that
/// the family does not have; what is claimed is done, and what is not claimed is `Unsupported`; it starts, reverses, stops,
/// trips and recovers against its simulated twin.
///
/// ```no_run
/// # use drive_core::{Capabilities, Drive, Port, SlaveAddress};
/// # use drive_sim::{Model, models::atv28::Atv28 as FanMachine};
/// # const CAPABILITIES: Capabilities = Capabilities::least("fan1", "Somebody's fan drive");
/// # fn fan1(port: Box<dyn Port>, slave: SlaveAddress) -> Box<dyn Drive> { unimplemented!() }
/// use drive_testing::Contract;
///
/// # async fn test() {
/// // #[tokio::test(start_paused = true)]
/// let contract = Contract::new(&CAPABILITIES, fan1, || Box::new(FanMachine::new()));
/// Contract { trip: Some(17), watchdog_trips: &[5], ..contract }.check().await;
/// # }
/// ```
///
/// Each method panics when what it checks is not so; the text says what. They need tokio's paused clock.
pub struct Contract {
    /// What the family claims.
    pub capabilities: &'static Capabilities,
    /// Makes its drive, as a plant would set it up.
    pub open: Box<Open>,
    /// Makes its simulated twin, set up for control by the bus.
    pub machine: Box<dyn Fn() -> Box<dyn Model>>,
    /// A trip that a reset clears, in the vendor's code; `None`: nothing is tripped.
    pub trip: Option<u16>,
    /// What the drive reports as present after its communication watchdog has tripped it.
    pub watchdog_trips: &'static [u16],
    /// Words that mean something somewhere in the family, sixteen at the most, so that commands are carried through against a
    /// drive that answers any word.
    pub plausible: &'static [u16],
    /// The control word; `None`: what is written is not judged.
    pub control: Option<ControlWord>,
    /// The status word; `None`: its decoding is not judged.
    pub status: Option<StatusWord>,
    /// The exceptions that the manual lists, each with its meaning; every other is
    /// [`Unknown`](ExceptionMeaning::Unknown). Empty: they are not judged.
    pub exceptions: &'static [(u8, ExceptionMeaning)],
    /// It says what it is on another line than one of Modbus RTU only.
    pub identifies_elsewhere: bool,
    /// How its drives are commanded and what may happen around them; `None`: it lives in no world.
    pub around: Option<Box<dyn Surrounded>>,
}

/// Makes the drive of this address behind a port.
pub type Open = dyn Fn(Box<dyn Port>, SlaveAddress) -> Box<dyn Drive>;

/// A control word, and every value of it that the driver may send.
#[derive(Debug, Clone, Copy)]
pub struct ControlWord {
    /// Its register.
    pub register: u16,
    /// The values, from the manual.
    pub words: &'static [u16],
    /// Of a value that was written, the bits that belong to others and are kept as they were read.
    pub others: fn(u16) -> u16,
    /// Those of the values that a drive which answers any word is never sent, because one of its settings always decides
    /// something else.
    pub unseen: &'static [u16],
    /// Those of the values that act when they are written, and not for as long as they stand, such as the pulse of a start: each is sent
    /// as an edge and once for an order. One that is written again because its answer was lost starts a motor that somebody has
    /// stopped meanwhile.
    pub once: &'static [u16],
}

/// A status word, and what tells a trip.
#[derive(Debug, Clone, Copy)]
pub struct StatusWord {
    /// Its register.
    pub register: u16,
    /// What else a drive holds that stands ready at zero speed under the bus.
    pub others: &'static [(u16, u16)],
    /// Whether a value means that the drive has tripped or is about to, by the manual.
    pub is_tripped: fn(u16) -> bool,
}

impl Contract {
    /// A family of which nothing else is known.
    pub fn new(
        capabilities: &'static Capabilities,
        open: impl Fn(Box<dyn Port>, SlaveAddress) -> Box<dyn Drive> + 'static,
        machine: impl Fn() -> Box<dyn Model> + 'static,
    ) -> Self {
        Self {
            capabilities,
            open: Box::new(open),
            machine: Box::new(machine),
            trip: None,
            watchdog_trips: &[],
            plausible: &[],
            control: None,
            status: None,
            exceptions: &[],
            identifies_elsewhere: false,
            around: None,
        }
    }

    /// All of it, and what finds most first.
    pub async fn check(&self) {
        self.withstands_the_adversary().await;
        self.survives_any_words().await;
        self.decodes_every_status_word().await;
        self.sends_no_request_that_is_too_long().await;
        self.explains_its_exceptions().await;
        self.does_what_it_claims().await;
        self.has_the_watchdog_that_it_claims().await;
        self.has_the_history_that_it_claims().await;
        self.takes_the_exchanges_that_it_claims().await;
        self.lives_the_story().await;
        self.is_true_in_worlds(CHECKED).await;
    }

    /// Its drive and its machine on a line with its factory settings.
    #[must_use]
    pub fn rig(&self) -> Rig {
        self.rig_speaking(Protocol::Rtu, self.capabilities.factory)
    }

    /// The same on a line that speaks this protocol with these characters.
    #[must_use]
    pub fn rig_speaking(&self, protocol: Protocol, settings: SerialSettings) -> Rig {
        Rig::new(protocol, settings, (self.machine)(), |port, slave| (self.open)(Box::new(port), slave))
    }

    /// Its drive at address 1 behind a port.
    fn drive(&self, port: impl Port + 'static) -> Box<dyn Drive> {
        (self.open)(Box::new(port), crate::bench::address(1))
    }

    pub(crate) fn name(&self) -> &'static str {
        self.capabilities.name
    }
}

/// Whether a setpoint was given: it is in force, or nothing speaks against it and only a start shows it, as of a drive whose register does no
/// more than read back.
pub(crate) fn is_given(given: &drive_core::Result<()>) -> bool {
    given.as_ref().err().is_none_or(drive_core::Error::only_a_start_shows)
}
