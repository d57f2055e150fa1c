//! Bytes that wait to become frames, each with the time at which it was handed over.

use std::{collections::VecDeque, time::Duration};

use bytes::Bytes;

/// What has come and is not yet part of anything.
#[derive(Debug, Default)]
pub(super) struct Timed {
    bytes: Vec<u8>,
    /// How many bytes came at a time, and when.
    pieces: VecDeque<(usize, Duration)>,
}

/// Bytes, with the times of the first and of the last of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Taken {
    pub(super) bytes: Bytes,
    pub(super) first: Duration,
    pub(super) last: Duration,
}

impl Timed {
    pub(super) fn push(&mut self, now: Duration, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.bytes.extend_from_slice(bytes);
            self.pieces.push_back((bytes.len(), now));
        }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// When the last of them came.
    pub(super) fn last(&self) -> Option<Duration> {
        self.pieces.back().map(|(_, at)| *at)
    }

    /// Takes the first `len` of them, or all where there are less.
    pub(super) fn take(&mut self, len: usize) -> Option<Taken> {
        let (_, first) = *self.pieces.front()?;
        let mut left = len.min(self.bytes.len());
        let bytes: Vec<u8> = self.bytes.drain(..left).collect();
        let mut last = first;
        while let Some((count, at)) = self.pieces.front_mut().filter(|_| left > 0) {
            last = *at;
            let taken = left.min(*count);
            *count -= taken;
            left -= taken;
            if *count == 0 {
                self.pieces.pop_front();
            }
        }
        Some(Taken { bytes: bytes.into(), first, last })
    }
}

impl Taken {
    /// These bytes, and those behind them.
    pub(super) fn and(self, more: Self) -> Self {
        Self { bytes: [self.bytes, more.bytes].concat().into(), first: self.first, last: more.last }
    }
}
