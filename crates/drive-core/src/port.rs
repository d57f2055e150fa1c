//! The way from a drive to its line: [`Port`], the terms of a call, and what can go wrong on the way.

use std::{io, time::Duration};

use async_trait::async_trait;
use tokio::time::Instant;
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

use crate::address::SlaveAddress;

/// How urgent a call is. A line serves a higher class first, always.
///
/// The order of the variants is the order of urgency: `Class::Stop > Class::Background`.
///
/// ```
/// use drive_core::Class;
///
/// assert!(Class::Stop > Class::Command);
/// assert_eq!("keep-alive".parse(), Ok(Class::KeepAlive));
/// assert_eq!(Class::ALL[0], Class::Stop);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Class {
    /// What nobody waits for: parameters, histories, slow measurements.
    Background,
    /// The cyclic poll of what control and safety need.
    #[default]
    Status,
    /// A frame sent so that the drive's own communication watchdog does not trip.
    KeepAlive,
    /// Start, setpoint, reset.
    Command,
    /// A stop. Nothing overtakes it.
    Stop,
}

// The most urgent first: so they are gone through.
crate::named! { Class {
    Stop => "stop",
    Command => "command",
    KeepAlive => "keep-alive",
    Status => "status",
    Background => "background",
} }

/// What sending a write twice would do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Effect {
    /// The value is a level: writing it twice does what writing it once does. It may be retried inside its
    /// lifetime.
    #[default]
    Level,
    /// The write is an edge (reset, EEPROM save, emergency stop): it is sent once, and never again by itself.
    Edge,
}

/// The terms under which the calls that follow travel: how urgent, for how long, and whether a write may be
/// repeated.
///
/// ```
/// use std::time::Duration;
/// use drive_core::{Class, Effect, Terms};
///
/// // A setpoint: not sent after a second, and the next takes the place of one that still waits.
/// let setpoint = Terms::of(Class::Command).within(Duration::from_secs(1)).replacing(8502);
/// assert_eq!((setpoint.effect, setpoint.replaces), (Effect::Level, Some(8502)));
/// // A reset is written once, whatever becomes of its answer.
/// assert_eq!(Terms::of(Class::Command).edge().effect, Effect::Edge);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Terms {
    /// How urgent.
    pub class: Class,
    /// From the call on, how long it may wait until its first bit is sent. What has not been sent by then never
    /// is: the call ends with [`PortError::Expired`]. `None`: it waits as long as its caller does.
    pub lifetime: Option<Duration>,
    /// Whether a write may be repeated.
    pub effect: Effect,
    /// A key under which a later call to the same slave replaces this one while it is not yet sent; the replaced
    /// call ends with [`PortError::Superseded`]. Used for setpoints, where only the latest counts.
    pub replaces: Option<u16>,
    /// How many words a read may take along behind those that are wanted: all of them can be read, and the drive's limit
    /// allows it. A line whose answers carry no number asks for more where the answer must differ from one that may
    /// still come, and leaves them out.
    pub spare_words: u8,
    /// When the order began of which the call is a part: a start is several writes. A write in [`Class::Command`] is not sent
    /// any more once a stop was written to its slave since, by whomever: it ends with [`PortError::Superseded`], so that nobody's
    /// start goes on behind somebody else's stop. `None`: it is an order by itself.
    pub begun: Option<Instant>,
}

impl Terms {
    /// The terms of a class, without a lifetime, for levels, replaced by nothing.
    #[must_use]
    pub const fn of(class: Class) -> Self {
        Self { class, lifetime: None, effect: Effect::Level, replaces: None, spare_words: 0, begun: None }
    }

    /// These terms with a lifetime.
    #[must_use]
    pub const fn within(self, lifetime: Duration) -> Self {
        Self { lifetime: Some(lifetime), ..self }
    }

    /// These terms for a write that is an edge.
    #[must_use]
    pub const fn edge(self) -> Self {
        Self { effect: Effect::Edge, ..self }
    }

    /// These terms for a read that may take so many words along.
    #[must_use]
    pub const fn sparing(self, spare_words: u8) -> Self {
        Self { spare_words, ..self }
    }

    /// These terms with a replacement key.
    #[must_use]
    pub const fn replacing(self, key: u16) -> Self {
        Self { replaces: Some(key), ..self }
    }
}

/// One slave as a drive sees it: a tokio-modbus [`Client`] that also takes the [`Terms`] of the calls that follow.
///
/// # For callers
/// Set the terms, then call. The terms hold until they are set anew.
///
/// # For implementors
/// A line with a schedule **must** honour class, lifetime, effect and key as [`Terms`] says; a connection of one drive has
/// nothing to schedule, see [`Reconnecting`](crate::Reconnecting). Every call **must** end in a bounded time. What is special about a failure is carried as a [`PortError`] inside
/// [`tokio_modbus::Error::Transport`], see [`PortError::into_io`]. `call` **should** be safe to drop: the exchange
/// that is under way finishes on the line and its answer is discarded.
pub trait Port: Client {
    /// Sets the terms of the calls that follow.
    fn set_terms(&mut self, terms: Terms) {
        let _ = terms;
    }

    /// The slave that it was made for; `None` on a port that goes to whichever it is told. A drive that is made for another
    /// slave talks to nobody: its calls end with [`Error::OtherSlave`](crate::Error::OtherSlave).
    fn made_for(&self) -> Option<SlaveAddress> {
        None
    }

    /// The drive behind it needs at least this silence after its answers, before the next request to it: its family says so as it is made.
    /// A port that keeps no pauses leaves that to whoever has it.
    fn wants_pause(&mut self, pause: Duration) {
        let _ = pause;
    }

    /// When the exchange that brought the last answer began; `None` where the port does not keep it. A value is not older than
    /// that, and may be: whoever shows one age shows this one, however long the exchange took and whenever its caller was
    /// told.
    fn asked_at(&self) -> Option<Instant> {
        None
    }

    /// Whether its line speaks Modbus ASCII, in which some drives watch their line more closely.
    fn is_ascii(&self) -> bool {
        false
    }
}

/// A port of any kind, for what takes one of a single type.
#[async_trait]
impl Client for Box<dyn Port> {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        (**self).call(request).await
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        (**self).disconnect().await
    }
}

impl SlaveContext for Box<dyn Port> {
    fn set_slave(&mut self, slave: Slave) {
        (**self).set_slave(slave);
    }
}

impl Port for Box<dyn Port> {
    fn set_terms(&mut self, terms: Terms) {
        (**self).set_terms(terms);
    }

    fn wants_pause(&mut self, pause: Duration) {
        (**self).wants_pause(pause);
    }

    fn made_for(&self) -> Option<SlaveAddress> {
        (**self).made_for()
    }

    fn asked_at(&self) -> Option<Instant> {
        (**self).asked_at()
    }

    fn is_ascii(&self) -> bool {
        (**self).is_ascii()
    }
}

/// Why a call brought no answer, as far as the line knows.
///
/// ```
/// use drive_core::PortError;
///
/// // How it comes out of a tokio-modbus call on a line.
/// let error = drive_core::tokio_modbus::Error::Transport(PortError::Expired.into_io());
/// assert_eq!(PortError::from_modbus(error), PortError::Expired);
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PortError {
    /// Sent, and no answer came in time. A read: nothing is known. A write reports
    /// [`OutcomeUnknown`](Self::OutcomeUnknown) instead.
    #[error("no answer within {}", shown(*after))]
    Timeout {
        /// How long the line waited after the last bit of the request.
        after: Duration,
    },
    /// An answer came and was damaged (CRC, LRC, BCC, framing), also after the retries that its kind allows.
    #[error("the answer was damaged ({0})")]
    Damaged(&'static str),
    /// An intact answer came that does not fit the request: another function, address, quantity or echoed value.
    #[error("the answer does not fit the request ({0})")]
    Mismatch(String),
    /// A write was sent and nothing valid came back: it may or may not have been carried out. Read it back.
    #[error("the outcome of the write is unknown ({0})")]
    OutcomeUnknown(&'static str),
    /// The slave has refused the request for as long as the line repeated it: it is busy. Nothing of it was carried out.
    #[error("the slave is too busy to take the request ({0})")]
    Busy(&'static str),
    /// The lifetime ran out before the request was sent. Nothing was sent.
    #[error("expired before it was sent")]
    Expired,
    /// A later call with the same key took its place, or a stop. Nothing was sent.
    #[error("superseded by a later call before it was sent")]
    Superseded,
    /// The slave has not answered for several requests; the line asks it again by itself. Nothing was sent.
    #[error("the slave is off-line, {}", next_probe(*retry_in))]
    Offline {
        /// Until the line's next probe. Zero: it is due, and sent as soon as the line is free.
        retry_in: Duration,
    },
    /// There is no silence on the line in which the request could be sent: another master, a node that babbles, a
    /// receiver that hears noise. Nothing was sent. Stops are sent all the same.
    #[error("the line is never quiet: something else is sending (no pause for {heard_for:.1?})")]
    NeverQuiet {
        /// For how long there has been no pause.
        heard_for: Duration,
    },
    /// Too many requests wait on this line. Nothing was sent.
    #[error("the queue of the line is full ({0} requests wait)")]
    QueueFull(usize),
    /// The port is gone (unplugged, closed, refused) and has not come back. Nothing was sent.
    #[error("the line is down ({0})")]
    LineDown(String),
    /// The line was closed by its owner.
    #[error("the line is closed")]
    Closed,
    /// The line cannot carry this request (for instance a function that its protocol has no form for).
    #[error("the line cannot carry this request ({0})")]
    NotCarried(String),
    /// An error of a connection that is not one of ours, in its own words.
    #[error("{0}")]
    Other(String),
}

fn next_probe(retry_in: Duration) -> String {
    if retry_in.is_zero() {
        "it is probed as soon as the line is free".to_owned()
    } else {
        format!("next probe in {}", shown(retry_in))
    }
}

/// A time that was learned or measured, for a person: in milliseconds, from a second on in tenths of one.
fn shown(time: Duration) -> String {
    match (time.as_micros() + 500) / 1_000 {
        milliseconds @ ..1_000 => format!("{milliseconds} ms"),
        _ => format!("{:.1} s", time.as_secs_f64()),
    }
}

impl PortError {
    /// Wraps this error for the way through tokio-modbus; [`from_modbus`](Self::from_modbus) takes it out again.
    #[must_use]
    pub fn into_io(self) -> io::Error {
        let kind = match &self {
            Self::Timeout { .. } | Self::Expired | Self::OutcomeUnknown(_) => io::ErrorKind::TimedOut,
            Self::Damaged(_) | Self::Mismatch(_) => io::ErrorKind::InvalidData,
            Self::Offline { .. } => io::ErrorKind::HostUnreachable,
            Self::Superseded => io::ErrorKind::Interrupted,
            Self::QueueFull(_) | Self::Busy(_) | Self::NeverQuiet { .. } => io::ErrorKind::ResourceBusy,
            Self::LineDown(_) | Self::Closed => io::ErrorKind::NotConnected,
            Self::NotCarried(_) => io::ErrorKind::Unsupported,
            Self::Other(_) => io::ErrorKind::Other,
        };
        io::Error::new(kind, self)
    }

    /// Whether nothing of the request was carried out, because it did not reach the slave or was not taken.
    #[must_use]
    pub const fn nothing_sent(&self) -> bool {
        matches!(
            self,
            Self::Expired
                | Self::Superseded
                | Self::Busy(_)
                | Self::Offline { .. }
                | Self::QueueFull(_)
                | Self::NeverQuiet { .. }
                | Self::LineDown(_)
                | Self::Closed
                | Self::NotCarried(_)
        )
    }

    /// What a tokio-modbus error says in our terms.
    #[must_use]
    pub fn from_modbus(error: tokio_modbus::Error) -> Self {
        match error {
            tokio_modbus::Error::Protocol(error) => Self::Mismatch(error.to_string()),
            tokio_modbus::Error::Transport(error) => Self::from_io(error),
        }
    }

    fn from_io(error: io::Error) -> Self {
        match error.downcast::<Self>() {
            Ok(ours) => ours,
            Err(error) => match error.kind() {
                io::ErrorKind::BrokenPipe
                | io::ErrorKind::NotConnected
                | io::ErrorKind::ConnectionReset
                | io::ErrorKind::ConnectionAborted
                | io::ErrorKind::UnexpectedEof => Self::LineDown(error.to_string()),
                io::ErrorKind::InvalidData => Self::Mismatch(error.to_string()),
                _ => Self::Other(error.to_string()),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_outranks_every_other_class() {
        let mut classes = Class::ALL;
        classes.sort();
        assert_eq!(classes.last(), Some(&Class::Stop));
        assert!(Class::ALL.windows(2).all(|pair| pair[0] > pair[1]));
    }

    #[test]
    fn a_learned_time_is_told_without_its_nanoseconds() {
        let told = |nanoseconds| PortError::Timeout { after: Duration::from_nanos(nanoseconds) }.to_string();
        assert_eq!(told(160_196_386), "no answer within 160 ms");
        assert_eq!(told(999_700_000), "no answer within 1.0 s");
        let offline = PortError::Offline { retry_in: Duration::from_nanos(944_512_345) };
        assert_eq!(offline.to_string(), "the slave is off-line, next probe in 945 ms");
    }

    #[test]
    fn a_port_error_survives_the_way_through_tokio_modbus() {
        let error = PortError::Offline { retry_in: Duration::from_millis(500) };
        let through = tokio_modbus::Error::Transport(error.clone().into_io());
        assert_eq!(PortError::from_modbus(through), error);
    }
}
