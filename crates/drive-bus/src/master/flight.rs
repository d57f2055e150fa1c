//! What is asked, and the exchange that asks it.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::PortError;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{far_end, probing::Question};
use crate::{exchange::Frame, schedule::Entry, shape::Shape};

/// What is asked, and by whom.
pub(super) struct Asked<C> {
    pub(super) request: Arc<Request<'static>>,
    pub(super) pdu: Bytes,
    pub(super) shape: Shape,
    pub(super) is_write: bool,
    pub(super) caller: C,
    pub(super) attempts: u32,
    /// The adapter was asked for its echo on behalf of this request.
    pub(super) echo_was_read: bool,
    /// The slave refuses to read more along.
    pub(super) asked_longer: bool,
    /// It went over the second connection too.
    pub(super) went_second: bool,
    /// What came when it was asked last, which may have been the answer to another read, and how often that was so.
    pub(super) doubted: Option<(Frame, u32)>,
    /// What became of the last attempt.
    pub(super) last: Option<PortError>,
}

/// The exchange that is under way.
pub(super) struct Flight<C> {
    pub(super) purpose: Purpose<C>,
    pub(super) slave: u8,
    pub(super) request: Arc<Request<'static>>,
    pub(super) shape: Shape,
    /// A check over what it asks.
    pub(super) asks: u16,
    /// The same, where it writes.
    pub(super) wrote: Option<u16>,
    /// Somebody's stop, whether he still waits for it or not.
    pub(super) is_stop: bool,
    /// By how many words the read was lengthened.
    pub(super) more: u8,
    /// An answer of this shape may be that to an earlier request.
    pub(super) suspect: bool,
    /// The host was away when its time was over.
    pub(super) stalled: bool,
    /// How long its answer may take to begin.
    pub(super) patience: Duration,
    pub(super) question: Question,
    pub(super) started: Instant,
    /// The same of its first part, where it was put aside.
    pub(super) asked_at: Instant,
    /// Its transaction number, where the protocol has one.
    pub(super) number: Option<u16>,
    /// How many questions in vain the far end owed when it was sent.
    pub(super) behind: usize,
    pub(super) sent: Option<Sent>,
}

impl<C> Flight<C> {
    /// What came when it was asked just before, and was told nobody.
    pub(super) fn doubted(&self) -> Option<Frame> {
        let Purpose::Call(Some(entry)) = &self.purpose else { return None };
        entry.work.doubted.map(|(frame, _)| frame)
    }

    /// What the far end was asked, if it was and somebody is to answer.
    pub(super) fn asked(&self) -> Option<far_end::Asked> {
        let sent = self.sent.filter(|sent| sent.unanswered_until.is_none())?;
        let &Self { slave, number, shape, .. } = self;
        Some(far_end::Asked { slave, number, shape, at: sent.end, place: sent.place })
    }
}

/// What the port was given.
#[derive(Clone, Copy)]
pub(super) struct Sending {
    pub(super) since: Instant,
    pub(super) characters: usize,
}

#[derive(Clone, Copy)]
pub(super) struct Sent {
    /// Computed end of transmission.
    pub(super) end: Instant,
    pub(super) timeout: Duration,
    /// When the answer is due.
    pub(super) answer_by: Instant,
    /// When it would be due if the far end owed nothing.
    pub(super) usually_by: Instant,
    /// Behind what it waits in the far end.
    pub(super) place: far_end::Place,
    /// Nobody answers; it is over at this time.
    pub(super) unanswered_until: Option<Instant>,
}

#[expect(
    clippy::large_enum_variant,
    reason = "a line has one under way: a box would be made for each exchange, and save nothing"
)]
pub(super) enum Purpose<C> {
    /// Somebody's call; `None` once he has dropped it.
    Call(Option<Entry<Asked<C>>>),
    /// Whether an off-line slave is back.
    Probe,
    /// Whether the adapter echoes.
    EchoRead,
    /// What may still lie in a port that was opened again.
    ThrowAway,
}
