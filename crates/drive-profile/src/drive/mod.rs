//! The engine: a drive of a profile is a [`Drive`](drive_core::Drive) as those are whose families are written by hand.

mod cell;
mod driven;
mod ending;
mod falling;
mod guards;
mod owner;
mod plan;
mod reading;
mod setpoint;
mod settings;
mod sight;
mod start;
mod steady;
mod step;
mod stop;
mod tables;
mod watchdog;

use std::sync::Arc;

use drive_core::{
    Error, ExceptionMeaning, Frequency, Ground, Port, Refusal, Registers, SlaveAddress, Status, Watch,
    interned,
};

pub use owner::Owner;

use crate::{format::Denial, ladder::Level, profile::Profile};
use guards::Guarded;
#[cfg(feature = "sim")]
pub(crate) use plan::Block;
pub(crate) use plan::{Words, is_double};
use sight::Sight;
use steady::Steady;

/// Behind every so many statuses the command is read back, while one of this side stands: what it does shows in each.
const STATUSES_PER_TURN: u16 = 4;

/// A drive of a profile behind a port. See [`Drive`](drive_core::Drive) for what its methods promise; what its profile does not let
/// them do is `Unsupported`, and says why.
#[derive(Debug)]
pub struct ProfileDrive<P> {
    registers: Registers<P>,
    profile: Arc<Profile>,
    sight: Arc<Sight>,
    owner: Owner,
    watch: Watch,
    guarded: Guarded,
    /// The setpoint that a run command of this side rests on, as the drive shows it.
    agreed: Option<i64>,
    /// The one before it, while the drive has not shown that it took the other one: either may stand there.
    agreed_before: Option<i64>,
    /// The setpoint that the next start gives, in counts: of a drive whose setpoint is its run command.
    kept: Option<i32>,
    /// A word of this side that ends its run command was written, and no start was confirmed since.
    has_ended: bool,
    /// A stop of this side that cuts the output was written, and no start was confirmed since: an output that is gone has not come down.
    lets_coast: bool,
    /// A stop of this side was seen, and the motor may still come down by it: its output then, where it is told.
    comes_down: Option<Option<u32>>,
    /// A run command of this side was taken back, while the output was this: until the drive is seen not to run.
    withdrawn_at: Option<Frequency>,
    /// The last status told that the motor was at its speed.
    at_speed: bool,
    /// That the drive does not let its motor reach the setpoint that was given, as it was read last.
    limited: Option<Refusal>,
    /// The time of its watchdog as it was read last, in counts.
    watchdog_time: Option<i64>,
    /// A setting was found otherwise than it was read before, and nobody was told yet.
    changed: Option<Ground>,
    /// An output that does not come down where the status word says that nothing runs.
    steady: Steady,
}

impl<P: Port> ProfileDrive<P> {
    /// The drive with this address, of which its owner says this. Nothing is sent.
    #[must_use]
    pub fn new(port: P, slave: SlaveAddress, profile: Arc<Profile>, owner: Owner) -> Self {
        let registers = Registers::new(port, slave, profile.capabilities(), meaning);
        let sight = Arc::new(Sight::of(&profile));
        let guarded = Guarded::of(&profile, &owner);
        Self {
            registers,
            profile,
            sight,
            owner,
            watch: Watch::every(STATUSES_PER_TURN),
            guarded,
            agreed: None,
            agreed_before: None,
            kept: None,
            has_ended: false,
            lets_coast: false,
            comes_down: None,
            withdrawn_at: None,
            at_speed: false,
            limited: None,
            watchdog_time: None,
            changed: None,
            steady: Steady::default(),
        }
    }

    /// What the profile does not let be done.
    fn allow(&self, level: Level, what: &'static str) -> Result<(), Error> {
        match self.profile.keeps_from(level) {
            Some(why) => Err(Error::Unsupported { what, reason: interned::text(&why) }),
            None => Ok(()),
        }
    }

    /// An error of a write, with what the profile lists of its exception.
    fn explained(&self, error: Error) -> Error {
        match error {
            Error::Exception { slave, exchange, code, meaning } => {
                let meaning = self.profile.denial(code).map_or(meaning, |denial| match denial {
                    Denial::NoSuchRegister => ExceptionMeaning::NoSuchRegister,
                    Denial::ValueRefused => ExceptionMeaning::ValueRefused,
                    Denial::NotNow => ExceptionMeaning::NotNow,
                });
                Error::Exception { slave, exchange, code, meaning }
            }
            error => error,
        }
    }

    const fn refused(&self, command: drive_core::Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    fn not_confirmed(&self, command: drive_core::Command, status: Status, because: Option<Refusal>) -> Error {
        Error::NotConfirmed { slave: self.registers.slave(), command, status: Box::new(status), because }
    }
}

/// What an exception means where nothing else is known: a number beyond those of Modbus says nothing.
fn meaning(_function: u8, code: u8) -> ExceptionMeaning {
    ExceptionMeaning::standard(code)
}
