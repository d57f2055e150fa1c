//! Where there is no timer descriptor: a timer on a thread of its own.

use std::{
    io,
    pin::Pin,
    task::{Context, Poll},
};

use tokio::time::Instant;

pub(crate) struct Alarm(async_io::Timer);

impl Alarm {
    #[expect(clippy::unnecessary_wraps, reason = "on Linux it can fail")]
    pub(crate) fn new() -> io::Result<Self> {
        Ok(Self(async_io::Timer::never()))
    }

    /// Rings at this time from now on, and at no earlier one.
    pub(crate) fn set(&mut self, _: Instant, at: Instant) {
        self.0.set_at(at.into_std());
    }

    pub(crate) fn poll(&mut self, context: &mut Context<'_>) -> Poll<()> {
        Pin::new(&mut self.0).poll(context).map(drop)
    }
}
