//! UNI-TELWAY, the master's side: who is polled may speak.
//!
//! The machine [`UniTelway`] has no clock and no port: time is an argument, bytes go in and come out. It needs no runtime.
//!
//! ```
//! use std::time::{Duration, Instant};
//!
//! use drive_unitelway::{Reply, Request, Step, UniTelway, UniTelwaySettings, data_frame, poll};
//!
//! # fn main() -> Result<(), drive_unitelway::RequestError> {
//! let settings = UniTelwaySettings::default();
//! let mut machine = UniTelway::new(19_200, settings, Duration::from_millis(20));
//! let request = Request::read_words(250, 2)?;
//! machine.check(1, &request)?;
//!
//! // Nothing is known of slave 1: it is asked to mirror a number of ours before it is asked anything else.
//! let mut now = Instant::now();
//! let frame = machine.start(1, request);
//! assert_eq!(frame[..4], [0x10, 0x02, 1, 12]);
//! machine.handle_sent(now, now + Duration::from_millis(500));
//!
//! // It acknowledges, and is polled after the silence.
//! assert_eq!(machine.handle_bytes(now, &[0x06]), Step::More);
//! now = machine.deadline().expect("the silence");
//! assert_eq!(machine.handle_timeout(now), Step::Send(poll(1)));
//! # let _ = (data_frame(1, &[]), Reply::Done);
//! # Ok(())
//! # }
//! ```
//!
//! ```text
//! data frame : 10 02 address length data BCC      (each 10h of length and data sent twice)
//! poll       : 10 05 address
//! yes, no, nothing to say : 06, 15, 04
//!
//! master : data            poll                     ACK       poll
//! slave  :       ACK             data (or EOT: later)              EOT
//! ```
//!
//! One exchange is a request, its acknowledgement, as many polls as the slave needs, the reply and its acknowledgement,
//! and one more poll. The time that a slave may take for its reply is an argument. Inside it [`UniTelwaySettings`]
//! has the link's own times.
//!
//! # Which request a reply belongs to
//! A reply says nothing of it. Slaves do different things with a reply whose acknowledgement they have not heard: they
//! send it again at the next poll, keep it and answer later requests behind it, refuse any request until it is taken,
//! or forget it. So a request is sent only to a slave that holds nothing:
//! - It has answered the last poll of its last exchange by EOT, and every reply that it owed has come.
//! - Else it is asked first to mirror a number of ours (request FAh). What comes before that number is dropped; behind
//!   it, nothing older can come, because a slave answers in the order in which it was asked. One that refuses to mirror
//!   has to have nothing more to say.
//! - The first write of a stop waits for neither. Where it is not known what the slave holds, no confirmation of it is
//!   taken: its outcome is unknown, and it should be sent again behind a number that was mirrored.
//!
//! # When something is lost, and when a slave is slow
//! - EOT and silence both mean "not yet" to a poll for a reply: the slave is polled again until its time is over, and
//!   others can be served between the polls.
//! - A request that the slave refuses (NAK) was not carried out. What the slave may hold is taken, the request is sent
//!   again at once, then after pauses in which others are served, for [`UniTelwaySettings::busy_timeout`].
//! - A request that the slave does not acknowledge may have been carried out. The exchange fails, a write's outcome is
//!   unknown, and whether it is sent again is for its master to decide: an edge never is.
//! - A reply that is damaged is refused and polled for again; nothing is carried out twice by that.
//!
//! There is no broadcast here: the card's manual names none for this protocol.
//!
//! # What remains
//! A slave that can neither mirror nor say EOT is asked as soon as it has been silent once: a reply of its that comes
//! later than its master waits for it and has the shape of a later one is taken for it.
//!
//! # Sources
//! The card's manual (VVDED397054 p. 11–13/35–37) prints the UNI-TE requests and leaves the link to the "UNI-TELWAY
//! reference manual". The frames here are those of public implementations of the slave's side. **Not confirmed on a
//! card**: the network header, what a slave with nothing to say answers, all times, and what becomes of a reply whose
//! acknowledgement the slave has not heard.

#![forbid(unsafe_code)]

mod failure;
mod frame;
mod known;
mod link;
mod network;
mod receive;
mod request;
mod send;
mod settings;
mod stage;
mod values;

/// The examples of the README, which compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use self::{
    failure::{Answer, Failure},
    frame::{Heard, Receiver, data as data_frame, len as frame_len, poll},
    link::{Step, Stray, UniTelway},
    network::{NetworkHeader, unite_of},
    request::{Refusal, Reply, Request, RequestError, code},
    settings::{UniTelwaySettings, longest, reply_len, request_len},
    values::{Identification, LinkCounters, SpecificCommand, SpecificReport},
};
