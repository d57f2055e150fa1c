//! Modbus TCP: a header with transaction number, length and unit, then the PDU.

use std::{
    hash::{BuildHasher, RandomState},
    sync::Arc,
};

use bytes::{Buf, BufMut, Bytes, BytesMut};
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{Answer, Failure, Machine, Step, Stray};
use crate::{answer, pdu::MAX_PDU};

/// Transaction number, protocol number, length (2 bytes each), unit.
pub const HEADER: usize = 7;

/// What a header says, once it is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Head {
    /// The number by which the answer is told.
    pub transaction: u16,
    /// The slave behind a gateway.
    pub unit: u8,
    /// How many bytes of PDU follow, 1 to 253.
    pub pdu: usize,
}

impl Head {
    /// The header of these bytes; `None` where they are none: another protocol number, or a length that no PDU has.
    #[must_use]
    pub fn of(bytes: [u8; HEADER]) -> Option<Self> {
        let [t1, t0, p1, p0, l1, l0, unit] = bytes;
        let len = usize::from(u16::from_be_bytes([l1, l0]));
        let is_head = (p1, p0) == (0, 0) && (2..=MAX_PDU + 1).contains(&len);
        is_head.then(|| Self { transaction: u16::from_be_bytes([t1, t0]), unit, pdu: len - 1 })
    }
}

/// A PDU with its header.
#[must_use]
pub fn frame(transaction: u16, unit: u8, pdu: &[u8]) -> Bytes {
    let mut frame = BytesMut::with_capacity(HEADER + pdu.len());
    frame.put_u16(transaction);
    frame.put_u16(0);
    frame.put_u16(pdu.len() as u16 + 1);
    frame.put_u8(unit);
    frame.put_slice(pdu);
    frame.freeze()
}

/// The machine: one request at a time, because behind a gateway there is one line.
#[derive(Debug, Default)]
pub struct Mbap {
    transaction: u16,
    current: Option<Current>,
    received: BytesMut,
    /// How many of the bytes received came before the request.
    stale: usize,
    strays: Vec<Stray>,
}

#[derive(Debug)]
struct Current {
    unit: u8,
    request: Arc<Request<'static>>,
    answer_by: Option<Instant>,
    misfit: Option<String>,
}

impl Mbap {
    /// A machine that has sent nothing yet. Its numbers begin anywhere, so that an answer to another connection's request
    /// is none to its own.
    #[must_use]
    pub fn new() -> Self {
        Self { transaction: RandomState::new().hash_one(()) as u16, ..Self::default() }
    }

    /// The next whole frame: transaction, unit, PDU. The transaction is none where the frame began before the request.
    fn next_frame(&mut self) -> Option<(Option<u16>, u8, Bytes)> {
        let mut noise = 0;
        let frame = loop {
            let Some(&header) = self.received.first_chunk::<HEADER>() else { break None };
            let Some(Head { transaction, unit, pdu }) = Head::of(header) else {
                // No header: go on with the next byte until one fits.
                self.received.advance(1);
                self.stale = self.stale.saturating_sub(1);
                noise += 1;
                continue;
            };
            if self.received.len() < HEADER + pdu {
                break None;
            }
            self.received.advance(HEADER);
            let transaction = (self.stale == 0).then_some(transaction);
            self.stale = self.stale.saturating_sub(HEADER + pdu);
            break Some((transaction, unit, self.received.split_to(pdu).freeze()));
        };
        if noise > 0 {
            self.strays.push(Stray::Noise(noise));
        }
        frame
    }

    fn fits(&mut self, transaction: Option<u16>, unit: u8, pdu: Bytes) -> Option<Answer> {
        let mut stray = Stray::frame(unit, &pdu);
        if let Stray::Frame { number, .. } = &mut stray {
            *number = transaction;
        }
        let is_it = crate::mutant!("transaction-unchecked", transaction == Some(self.transaction), true);
        let Some(current) = self.current.as_mut().filter(|_| is_it) else {
            self.strays.push(stray);
            return None;
        };
        if unit != current.unit {
            current.misfit = Some(format!("unit {unit} instead of {}", current.unit));
            self.strays.push(stray);
            return None;
        }
        answer::check(&current.request, pdu).map_err(|why| current.misfit = Some(why)).ok()
    }
}

impl Machine for Mbap {
    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, pdu: &Bytes) -> Bytes {
        // What came before the request is no answer to it, whatever its number.
        self.current = None;
        while let Some((transaction, unit, pdu)) = self.next_frame() {
            self.fits(transaction, unit, pdu);
        }
        self.stale = self.received.len();
        self.transaction = self.transaction.wrapping_add(1);
        self.current = Some(Current { unit: slave, request, answer_by: None, misfit: None });
        frame(self.transaction, slave, pdu)
    }

    fn handle_sent(&mut self, _: Instant, answer_by: Instant) {
        if let Some(current) = &mut self.current {
            current.answer_by = Some(answer_by);
        }
    }

    fn handle_bytes(&mut self, _now: Instant, bytes: &[u8]) -> Step {
        self.received.extend_from_slice(bytes);
        while let Some((transaction, unit, pdu)) = self.next_frame() {
            if let Some(answer) = self.fits(transaction, unit, pdu) {
                self.current = None;
                return Step::Done(Ok(answer));
            }
        }
        Step::More
    }

    fn handle_timeout(&mut self, now: Instant) -> Step {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return Step::More;
        }
        // A frame that is half there when the time is over may never end: what follows begins anew.
        if !self.received.is_empty() {
            self.strays.push(Stray::Noise(self.received.len()));
            self.received.clear();
            self.stale = 0;
        }
        match self.current.take().and_then(|current| current.misfit) {
            Some(why) => Step::Done(Err(Failure::Mismatch(why))),
            None => Step::Done(Err(Failure::Timeout)),
        }
    }

    fn deadline(&self) -> Option<Instant> {
        self.current.as_ref()?.answer_by
    }

    fn abandon(&mut self) {
        self.current = None;
    }

    fn reset(&mut self) {
        self.current = None;
        self.received.clear();
        self.stale = 0;
    }

    fn take_strays(&mut self) -> Vec<Stray> {
        std::mem::take(&mut self.strays)
    }

    fn confuses_late_answers(&self) -> bool {
        false
    }

    fn number(&self) -> Option<u16> {
        Some(self.transaction)
    }
}
