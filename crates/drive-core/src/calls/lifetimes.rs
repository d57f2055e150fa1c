//! How long calls of each class may wait: [`Lifetimes`].

use std::time::Duration;

use tokio::time::Instant;

use crate::port::Class;

/// How long a call of each class may wait until it is sent. `None`: as long as its caller waits.
///
/// ```
/// use std::time::Duration;
/// use drive_core::{Class, Lifetimes};
///
/// let lifetimes = Lifetimes { status: Some(Duration::from_millis(500)), ..Lifetimes::default() };
/// assert_eq!(lifetimes.of(Class::Command), Some(Duration::from_secs(1)), "never carried out late");
/// assert_eq!(lifetimes.of(Class::Stop), None, "a stop does not expire");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lifetimes {
    /// Stops. They do not expire by default.
    pub stop: Option<Duration>,
    /// Starts, setpoints, resets: 1 s by default, so that none is carried out late.
    pub command: Option<Duration>,
    /// When nothing more of a command is sent, however quickly each call of it was: a drive that takes long to answer makes the next one
    /// late. Never by default.
    pub command_until: Option<Instant>,
    /// When a command of which nothing was written is not sent any more, for one whose further words belong to the first: an edge that has
    /// risen is to fall. Never by default.
    pub begun_until: Option<Instant>,
    /// Keep-alives.
    pub keep_alive: Option<Duration>,
    /// Status polls; a daemon sets its poll period.
    pub status: Option<Duration>,
    /// Parameters, histories, slow measurements.
    pub background: Option<Duration>,
    /// The class in which what polls and identifies is asked instead of its own: [`Class::Stop`] where a stop waits for what it tells,
    /// so that it goes to a slave that is off-line as the stop itself would.
    pub polls_as: Option<Class>,
}

impl Lifetimes {
    /// The lifetime of a class.
    #[must_use]
    pub const fn of(&self, class: Class) -> Option<Duration> {
        match class {
            Class::Stop => self.stop,
            Class::Command => self.command,
            Class::KeepAlive => self.keep_alive,
            Class::Status => self.status,
            Class::Background => self.background,
        }
    }
}

impl Default for Lifetimes {
    fn default() -> Self {
        Self {
            stop: None,
            command: Some(Duration::from_secs(1)),
            command_until: None,
            begun_until: None,
            keep_alive: None,
            status: None,
            background: None,
            polls_as: None,
        }
    }
}
