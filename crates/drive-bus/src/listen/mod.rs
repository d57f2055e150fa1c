//! Listening to a line without taking part in it: nothing is ever written.
//!
//! ```
//! use std::time::Duration;
//!
//! use drive_bus::{LineConfig, exchange::rtu, listen::{Ear, Role}};
//! use drive_core::serial::SerialSettings;
//!
//! let config = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
//! let mut ear = Ear::new(&config, Duration::ZERO).expect("RTU can be listened to");
//! // A host and its drive, from an adapter that has handed both frames over in one piece.
//! let both = [rtu::frame(1, &[3, 0x0C, 0x81, 0, 1]), rtu::frame(1, &[3, 2, 0x06, 0x27])].concat();
//! ear.hear(Duration::from_secs(1), &both);
//! let roles: Vec<Role> = ear.map(|heard| heard.role).collect();
//! assert_eq!(roles, [Role::Request, Role::Answer]);
//! ```
//!
//! # Where a frame ends
//! The length that its function gives it, and its check. The silences of the line are not seen here: an adapter delivers
//! in pieces, and a host that is busy sees a pause where there was none and none where there was one. A pause only ends
//! what cannot be told otherwise: a frame that was cut off, and one of a function whose length nobody knows.
//!
//! # Whose frame it is
//! Most frames of Modbus are a request or an answer by their form alone. Some have one form for both (functions 05, 06,
//! 08, 16h): they are told by the order in which they come, and where that is not known, because listening has begun in
//! the middle or something damaged came before, they are [`Role::Either`]. A write that is repeated **within** the response
//! timeout of the line's configuration, because nobody has answered it, is taken for its own answer. Nothing tells
//! whether an answer is that of the slave whose address it carries.
//!
//! # What is taken for a frame and is none
//! Inside a damaged frame a part of it can have the length and the CRC of another: about one damaged frame of 250 bytes in
//! 500, and one of 8 bytes in 10 000.
//!
//! # The port
//! [`Listener::open`] opens a serial port as a line does, exclusively, and writes nothing. Linux raises DTR and RTS of
//! any port while it is open. USB adapters for RS-485 switch their transmitter by themselves when characters are sent,
//! and stay silent; so does a port in the kernel's RS-485 mode ([`LineConfig::rs485`]). A plain converter that
//! switches by RTS **holds the line** for as long as the port is open: it is no tool to listen with.
//! Over TCP a serial server is listened to that gives everything it hears to each connection.

mod listener;
mod order;
mod split;
mod timed;

use std::time::Duration;

use bytes::Bytes;

pub use self::listener::Listener;
use self::{
    order::Order,
    split::{Found, Split},
};
use crate::{
    capture::{Captured, Direction},
    config::LineConfig,
    content::{Content, NoFrame},
};

/// Whose frame was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// The master's.
    Request,
    /// A slave's.
    Answer,
    /// The one or the other: both have this form, and what came before does not tell.
    Either,
    /// No frame.
    Damaged,
}

/// A frame that was heard, or bytes that make none.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Heard {
    /// When the first of its bytes was handed over, counted from where the caller counts. It was on the line before: by
    /// its own time and that of the adapter.
    pub first: Duration,
    /// When the last was.
    pub last: Duration,
    /// Its bytes, check included; of what is no frame 256 at the most.
    pub bytes: Bytes,
    /// Whose it is.
    pub role: Role,
    /// The slave that it is for or from, where that is known; 0: all.
    pub slave: Option<u8>,
    /// What it carries.
    pub content: Result<Content, NoFrame>,
}

impl Heard {
    /// It as a frame of a capture; the times since 1970 where the ear counts from there.
    #[must_use]
    pub fn captured(&self) -> Captured {
        let direction = match self.role {
            Role::Request => Direction::Sent,
            Role::Answer => Direction::Received,
            Role::Either | Role::Damaged => Direction::Unknown,
        };
        Captured { at: self.last, direction, bytes: self.bytes.clone() }
    }
}

/// Makes frames of what is heard on a line. It has no clock and no port: time is an argument, counted from anywhere. An
/// iterator of what is complete; between [`hear`](Self::hear) and the end of that the caller takes nothing else.
pub struct Ear {
    split: Box<dyn Split>,
    order: Order,
}

impl Ear {
    /// Begins to listen at `now` to a line of this configuration: its protocol, speed and format, and the longest pause
    /// inside a frame ([`LineConfig::chunk_gap`]). `None`: its protocol is Modbus TCP, whose frames are those of a
    /// connection.
    #[must_use]
    pub fn new(config: &LineConfig, now: Duration) -> Option<Self> {
        let split = split::of(config)?;
        Some(Self { split, order: Order::new(config.response_timeout, now) })
    }

    /// Bytes were handed over at `now`. At the most 256 of what makes no frame yet are kept, and what is not taken out.
    pub fn hear(&mut self, now: Duration, bytes: &[u8]) {
        self.split.push(now, bytes);
    }

    /// When [`handle_timeout`](Self::handle_timeout) is to be called, unless bytes come before.
    #[must_use]
    pub fn deadline(&self) -> Option<Duration> {
        self.split.deadline()
    }

    /// The [`deadline`](Self::deadline) has passed: what has begun goes on no more. At the end of listening too.
    pub fn handle_timeout(&mut self) {
        self.split.give_up();
    }
}

impl Iterator for Ear {
    type Item = Heard;

    fn next(&mut self) -> Option<Heard> {
        let found = self.split.next()?;
        Some(match found {
            Found::Frame(taken, content) => {
                let (role, slave) = self.order.role(taken.first, taken.last, &content);
                let (first, last, bytes) = (taken.first, taken.last, taken.bytes);
                Heard { first, last, bytes, role, slave, content: Ok(content) }
            }
            Found::Damaged(taken, why) => {
                self.order.disturbed(taken.last);
                let (first, last, bytes) = (taken.first, taken.last, taken.bytes);
                Heard { first, last, bytes, role: Role::Damaged, slave: None, content: Err(why) }
            }
        })
    }
}

impl std::fmt::Debug for Ear {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Ear").field("order", &self.order).finish_non_exhaustive()
    }
}
