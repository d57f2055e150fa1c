//! Writes to every drive of a line at once, §5.1: 0001h has bits of its own then, and the reference is always counted as
//! 30000 = 100 %, whatever n39 says. Nobody answers, so nothing is confirmed: read each drive afterwards.
//!
//! ```
//! use drive_3g3ev::broadcast;
//! use drive_core::{Direction, Percent};
//!
//! assert_eq!(broadcast::run(Direction::Reverse).value, 0b11);
//! assert_eq!(broadcast::reference(Percent::from_percent(100)).unwrap().value, 30_000);
//! ```

use drive_core::{BroadcastWrite, Direction, Percent};

use crate::{broadcast_command, registers::REFERENCE, words::BroadcastCommand};

/// Words of the reference per hundredth of a percent: 30000 for 10000.
const COUNTS: i32 = 3;
/// The reference of 100 %.
const FULL: u16 = 30_000;

/// Every drive stops, in the way that it is set to.
#[must_use]
pub const fn stop() -> BroadcastWrite {
    broadcast_command(0)
}

/// Every drive starts, those that stand included, at the reference that it holds. None is asked first whether it has
/// tripped or who commands it.
#[must_use]
pub const fn run(direction: Direction) -> BroadcastWrite {
    let word = match direction {
        Direction::Forward => BroadcastCommand::RUN,
        Direction::Reverse => BroadcastCommand::RUN.union(BroadcastCommand::REVERSE),
    };
    broadcast_command(word.bits())
}

/// Every drive trips with the external fault EF0; then the bit is cleared. Send both, in this order.
#[must_use]
pub const fn external_fault() -> [BroadcastWrite; 2] {
    [broadcast_command(BroadcastCommand::EXTERNAL_FAULT.bits()), stop()]
}

/// Every drive resets its fault; then the bit is cleared. Send both, in this order. **Every drive that runs stops**,
/// because the same word holds the run command.
#[must_use]
pub const fn fault_reset() -> [BroadcastWrite; 2] {
    [broadcast_command(BroadcastCommand::FAULT_RESET.bits()), stop()]
}

/// Every drive takes this reference. `None` when it is negative or above 100 %.
#[must_use]
pub fn reference(share: Percent) -> Option<BroadcastWrite> {
    let value = share.hundredths().checked_mul(COUNTS)?.try_into().ok().filter(|counts| *counts <= FULL)?;
    Some(BroadcastWrite { function: 0x10, register: REFERENCE.address(), value })
}
