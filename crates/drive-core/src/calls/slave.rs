//! What calls to one slave share: [`Registers`], with the order that is carried out and the picture that is read.

use std::time::Duration;

use tokio::time::Instant;
use tokio_modbus::Slave;

use super::{Calls, Lifetimes};
use crate::{
    address::SlaveAddress,
    capabilities::Capabilities,
    confirm::CONFIRMED_WITHIN,
    error::{Error, ExceptionMeaning, Result},
    kept_readings::KeptReadings,
    port::{Class, Port, Terms},
    status::Status,
    stopped::{Followed, Follower},
};

/// How long what judges a written order waits for its turn on the line: it has to show within [`CONFIRMED_WITHIN`], and a reading that
/// was lost costs the line another wait.
const JUDGED_WITHIN: Duration = CONFIRMED_WITHIN.saturating_mul(2);

/// The registers of one slave behind a port.
#[derive(Debug)]
pub struct Registers<P> {
    pub(super) port: P,
    pub(super) slave: SlaveAddress,
    pub(super) capabilities: &'static Capabilities,
    pub(super) meaning: fn(function: u8, code: u8) -> ExceptionMeaning,
    /// The other slave to which the port leads.
    pub(super) elsewhere: Option<SlaveAddress>,
    /// When the oldest answer since [`begin_snapshot`](Self::begin_snapshot) ended on the line.
    oldest: Option<Instant>,
    /// When the order began that is carried out.
    begun: Option<Instant>,
    /// Until then what is read as a command judges an order that was written.
    judged_until: Option<Instant>,
    /// Something of the order was written, or may have been.
    pub(super) written: bool,
    /// How long calls may wait.
    pub lifetimes: Lifetimes,
    /// What long jobs have read that were cut.
    pub kept: KeptReadings,
    /// Who follows a stop that does not show: see [`Drive::follow_stops`](crate::Drive::follow_stops).
    pub follower: Option<Follower>,
}

impl<P: Port> Registers<P> {
    /// The registers of `slave`, which is the one that the port was made for where it was made for one: else every call ends
    /// with [`Error::OtherSlave`]. `meaning` says what an exception means on this family.
    #[must_use]
    pub fn new(
        mut port: P,
        slave: SlaveAddress,
        capabilities: &'static Capabilities,
        meaning: fn(function: u8, code: u8) -> ExceptionMeaning,
    ) -> Self {
        let elsewhere = port.made_for().filter(|made_for| *made_for != slave);
        // A port that was made for another slave keeps it, so that nothing goes to a drive that is not meant.
        if elsewhere.is_none() {
            port.set_slave(Slave(slave.number()));
            port.wants_pause(capabilities.turnaround);
        }
        let (lifetimes, kept) = (Lifetimes::default(), KeptReadings::default());
        Self {
            port,
            slave,
            capabilities,
            meaning,
            elsewhere,
            oldest: None,
            begun: None,
            judged_until: None,
            written: false,
            lifetimes,
            kept,
            follower: None,
        }
    }

    /// Tells whoever follows it a status behind a stop that does not show yet, and how the last write of that ended. Of the run command
    /// that is to end the status says nothing.
    pub fn tell_follower<T>(&self, status: &Status, written: &Result<T>) {
        if let Some(follower) = &self.follower {
            let status = Status { verdict: None, ..status.clone() };
            // An exception is what the drive says. Every other end is the line's.
            let denied = written.as_ref().err().filter(|error| matches!(error, Error::Exception { .. }));
            follower.send_replace(Some(Followed { status, denied: denied.cloned() }));
        }
    }

    /// The slave.
    #[must_use]
    pub const fn slave(&self) -> SlaveAddress {
        self.slave
    }

    /// What the family can do.
    #[must_use]
    pub const fn capabilities(&self) -> &'static Capabilities {
        self.capabilities
    }

    /// The calls that follow travel in this class, with its lifetime. Those of a stop end the order that had begun.
    pub const fn at(&mut self, class: Class) -> Calls<'_, P> {
        if matches!(class, Class::Stop) {
            self.begun = None;
        }
        let begun = if matches!(class, Class::Command) { self.begun } else { None };
        let asked_as = match (class, self.lifetimes.polls_as) {
            (Class::Status | Class::Background, Some(asked_as)) => asked_as,
            _ => class,
        };
        let terms = Terms { lifetime: self.lifetimes.of(class), begun, ..Terms::of(asked_as) };
        Calls { registers: self, terms }
    }

    /// An order begins: what is read for it dies with it, until it is written; and what it writes is not sent behind a stop of
    /// somebody else's that comes meanwhile, see [`Terms::begun`]. **Whatever writes in the class of commands begins an order**, or it
    /// is taken for a part of the one before.
    pub fn begin_order(&mut self) {
        (self.judged_until, self.written) = (None, false);
        self.begun = Some(Instant::now());
    }

    /// The order is written, or may be, and its judgement is owed: **what judges it does not die of the order's lifetime**. What is
    /// read in the class of commands waits for its turn, until the next order begins or the time is over in which this one has to
    /// show.
    pub fn owe_judgement(&mut self) {
        self.judged_until = Some(Instant::now() + JUDGED_WITHIN);
    }

    /// How long a reading of this class may wait that would wait for so long else.
    pub(super) fn patience(&self, terms: Terms) -> Terms {
        let judges =
            terms.class == Class::Command && self.judged_until.is_some_and(|until| Instant::now() < until);
        if judges { Terms { lifetime: None, ..terms } } else { self.bounded(terms) }
    }

    /// A call that dies is sent in the time of its command, too.
    pub(super) fn bounded(&self, terms: Terms) -> Terms {
        let begun_until = self.lifetimes.begun_until.filter(|_| !self.written);
        let until = [self.lifetimes.command_until, begun_until].into_iter().flatten().min();
        let until = until.filter(|_| terms.class == Class::Command);
        let left = until.map(|until| until.saturating_duration_since(Instant::now()));
        let lifetime = terms.lifetime.map(|lifetime| left.map_or(lifetime, |left| lifetime.min(left)));
        Terms { lifetime, ..terms }
    }

    /// What is read from here on makes one picture of the drive, which is as old as its oldest answer.
    pub const fn begin_snapshot(&mut self) {
        self.oldest = None;
    }

    /// When the oldest answer since [`begin_snapshot`](Self::begin_snapshot) ended on the line; `None` on a port that keeps
    /// no time, and before the first answer.
    #[must_use]
    pub const fn snapshot_time(&self) -> Option<Instant> {
        self.oldest
    }

    /// Whether the picture has taken so long that its parts may be of different moments.
    #[must_use]
    pub fn is_torn(&self) -> bool {
        self.oldest.is_some_and(|oldest| oldest.elapsed() > CONFIRMED_WITHIN / 2)
    }

    /// What was read is a part of the picture.
    pub(super) fn see(&mut self, at: Instant) {
        self.oldest = Some(self.oldest.map_or(at, |oldest| oldest.min(at)));
    }

    /// The port.
    #[must_use]
    pub const fn port(&self) -> &P {
        &self.port
    }

    /// Gives the port back.
    #[must_use]
    pub fn into_port(self) -> P {
        self.port
    }
}

/// The methods of [`Drive`](crate::Drive) that need nothing but the [`Registers`] of a family, in the field of this name:
/// `slave`, `capabilities`, `lifetimes_mut` and `kept_mut`.
///
/// ```ignore
/// #[async_trait]
/// impl<P: Port> Drive for Fan1<P> {
///     drive_core::told_by!(registers);
///     // and the methods that are the family's own
/// }
/// ```
#[macro_export]
macro_rules! told_by {
    ($registers:ident) => {
        fn slave(&self) -> $crate::SlaveAddress {
            self.$registers.slave()
        }

        fn capabilities(&self) -> &'static $crate::Capabilities {
            self.$registers.capabilities()
        }

        fn lifetimes_mut(&mut self) -> &mut $crate::Lifetimes {
            self.$registers.begin_order();
            &mut self.$registers.lifetimes
        }

        fn kept_mut(&mut self) -> Option<&mut $crate::KeptReadings> {
            Some(&mut self.$registers.kept)
        }

        fn follow_stops(&mut self, follower: $crate::Follower) {
            self.$registers.follower = Some(follower);
        }
    };
}
