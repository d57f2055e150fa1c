//! A connection whose far end has to read, and to say to its end what it has begun: one that takes nothing for a while, or has half a
//! head to say, is closed.

use std::{
    io,
    pin::Pin,
    sync::Arc,
    task::{Context, Poll, ready},
    time::Duration,
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::{Sleep, sleep},
};

use super::crowd::Place;

/// How long the head of a request may take, from its first byte on: nobody knows yet who asks.
const HEAD_WITHIN: Duration = Duration::from_secs(1);

/// How long the far end may take nothing of what it asked for.
const TAKES_WITHIN: Duration = Duration::from_secs(15);

/// A stream whose reads fail when a head does not end in time, and its writes when they are not taken in time.
pub(super) struct Patient<S> {
    stream: S,
    place: Arc<Place>,
    /// Behind so many others a head has begun; until when it has to be there.
    head: Option<(u64, Pin<Box<Sleep>>)>,
    /// Until when the write that waits has to be taken.
    until: Option<Pin<Box<Sleep>>>,
}

impl<S> Patient<S> {
    pub(super) const fn new(stream: S, place: Arc<Place>) -> Self {
        Self { stream, place, head: None, until: None }
    }

    fn in_time<T>(&mut self, context: &mut Context<'_>, taken: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if taken.is_ready() {
            self.until = None;
            return taken;
        }
        let until = self.until.get_or_insert_with(|| Box::pin(sleep(TAKES_WITHIN)));
        ready!(until.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Patient<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        let heads = self.place.heads();
        if self.place.is_under_way() || self.head.as_ref().is_some_and(|(behind, _)| *behind != heads) {
            self.head = None;
        }
        if self.place.is_under_way() {
            return read;
        }
        if buffer.filled().len() > before && self.head.is_none() {
            self.head = Some((heads, Box::pin(sleep(HEAD_WITHIN))));
        }
        let is_late = self.head.as_mut().is_some_and(|(_, head)| head.as_mut().poll(context).is_ready());
        if is_late { Poll::Ready(Err(io::ErrorKind::TimedOut.into())) } else { read }
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Patient<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let taken = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.in_time(context, taken)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let taken = Pin::new(&mut self.stream).poll_flush(context);
        self.in_time(context, taken)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let taken = Pin::new(&mut self.stream).poll_shutdown(context);
        self.in_time(context, taken)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let taken = Pin::new(&mut self.stream).poll_write_vectored(context, bytes);
        self.in_time(context, taken)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}

#[cfg(test)]
mod tests {
    use tokio::{
        io::{AsyncReadExt as _, AsyncWriteExt as _, duplex},
        time::Instant,
    };

    use super::*;
    use crate::crowd::{Crowd, Limits};

    #[tokio::test(start_paused = true)]
    async fn whoever_reads_nothing_is_given_up_and_whoever_reads_slowly_is_not() {
        let (near, mut far) = duplex(16);
        let place = Crowd::new(Limits::HTTP).enter(None, Instant::now()).unwrap();
        let mut near = Patient::new(near, Arc::new(place));
        let slow = tokio::spawn(async move {
            for _ in 0..4 {
                tokio::time::sleep(TAKES_WITHIN - Duration::from_secs(1)).await;
                far.read_exact(&mut [0; 16]).await.unwrap();
            }
            far
        });
        near.write_all(&[0; 64]).await.unwrap();
        near.write_all(&[0; 16]).await.ok();
        let _far = slow.await.unwrap();
        let given_up = near.write_all(&[0; 64]).await.unwrap_err();
        assert_eq!(given_up.kind(), io::ErrorKind::TimedOut);
    }
}
