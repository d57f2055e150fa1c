//! The far end of a line in the same process, for lines by the hundred: drives that answer reads as a real wire would
//! bring the answers, to the microsecond, at the price of one timer. It is a stream that the line reads and writes, so
//! that a line costs what it costs on a port but for the system calls that read and write one.

use std::{
    io,
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll, ready},
};

use bytes::Bytes;
use drive_bus::exchange::rtu;
use drive_clock::Timer;
use drive_core::serial::SerialSettings;
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::Instant,
};

use crate::{
    rig::{QUANTITY, exchange},
    simulator::{Counted, TURNAROUND},
};

const SETTINGS: SerialSettings = SerialSettings::MODBUS_DEFAULT;

/// What a far end has counted since it was last asked.
#[derive(Debug, Clone, Default)]
pub(crate) struct Book(Arc<Mutex<Page>>);

#[derive(Debug, Default)]
struct Page {
    counted: Counted,
    first: Option<Instant>,
    last: Option<Instant>,
}

impl Book {
    pub(crate) fn take(&self) -> Counted {
        let Page { mut counted, first, last } =
            std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        let span = first.zip(last).map(|(first, last)| last.saturating_duration_since(first));
        counted.taken = span.unwrap_or_default() + SETTINGS.t3_5();
        counted
    }
}

/// The stream.
#[derive(Debug)]
pub(crate) struct FarEnd {
    timer: Timer,
    /// What is on its way to the master, when it is there, and when its request began.
    answer: Option<(Instant, Bytes, Instant)>,
    quiet_since: Option<Instant>,
    book: Book,
}

impl FarEnd {
    pub(crate) fn new(book: Book) -> Self {
        Self { timer: Timer::precise(), answer: None, quiet_since: None, book }
    }

    fn hear(&mut self, now: Instant, frame: &[u8]) {
        let mut page = self.book.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kept) = self.quiet_since.map(|since| now.saturating_duration_since(since)) {
            page.counted.violations += u64::from(kept < SETTINGS.t3_5());
            page.counted.shortest_silence = page.counted.shortest_silence.into_iter().chain([kept]).min();
        }
        let slave = frame.first().copied().unwrap_or_default();
        let mut pdu = [0; 2 + 2 * QUANTITY as usize];
        pdu[..2].copy_from_slice(&[3, 2 * QUANTITY as u8]);
        let answer = rtu::frame(slave, &pdu);
        let due = now + SETTINGS.characters(frame.len()) + TURNAROUND + SETTINGS.characters(answer.len());
        self.answer = Some((due, answer, now));
    }

    fn told(&self, now: Instant, due: Instant, began: Instant) {
        let mut page = self.book.0.lock().unwrap_or_else(PoisonError::into_inner);
        page.counted.requests += 1;
        page.counted.ideal += exchange(TURNAROUND) + SETTINGS.t3_5();
        page.counted.late += now.saturating_duration_since(due);
        page.first.get_or_insert(began);
        page.last = Some(now);
    }
}

impl AsyncRead for FarEnd {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let Some(due) = self.answer.as_ref().map(|(due, ..)| *due) else { return Poll::Pending };
        ready!(self.timer.poll_until(context, due));
        if let Some((due, answer, began)) = self.answer.take() {
            let now = Instant::now();
            self.quiet_since = Some(now);
            self.told(now, due, began);
            buffer.put_slice(&answer);
        }
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for FarEnd {
    /// The line's task reads again after every write, so that nobody has to be woken.
    fn poll_write(mut self: Pin<&mut Self>, _: &mut Context<'_>, frame: &[u8]) -> Poll<io::Result<usize>> {
        self.hear(Instant::now(), frame);
        Poll::Ready(Ok(frame.len()))
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
