//! Streams that somebody else has made: one that panics, or an opening that does not end, is a port that is lost, and takes nothing
//! else of the line with it.

use std::{
    any::Any,
    future::poll_fn,
    io,
    panic::{AssertUnwindSafe, catch_unwind},
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use drive_core::panic_said;
use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::timeout,
};

use super::{BoxedStream, Opening};

/// How long somebody else's opening may take: whatever it dials has answered by then.
const OPEN_LIMIT: Duration = Duration::from_secs(30);

/// Such a stream.
pub(crate) struct Guarded<S>(pub(crate) S);

impl<S: AsyncRead + Unpin> AsyncRead for Guarded<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        guarded(|| Pin::new(&mut self.0).poll_read(context, buffer))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Guarded<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        guarded(|| Pin::new(&mut self.0).poll_write(context, bytes))
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        guarded(|| Pin::new(&mut self.0).poll_flush(context))
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        guarded(|| Pin::new(&mut self.0).poll_shutdown(context))
    }
}

/// Begins to open such a stream.
pub(crate) fn begin<S, F>(open: &mut (impl FnMut() -> F + ?Sized)) -> Opening<io::Error>
where
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
    F: Future<Output = io::Result<S>> + Send + 'static,
{
    let mut begun = catch_unwind(AssertUnwindSafe(open)).map(Box::pin).map_err(|panic| Some(told(&*panic)));
    let opening = poll_fn(move |context| match &mut begun {
        Ok(opening) => guarded(|| opening.as_mut().poll(context)),
        Err(panic) => Poll::Ready(Err(panic.take().unwrap_or_else(|| io::ErrorKind::Other.into()))),
    });
    Box::pin(async move {
        let limit =
            || io::Error::new(io::ErrorKind::TimedOut, format!("it was not opened within {OPEN_LIMIT:?}"));
        let opened = timeout(OPEN_LIMIT, opening).await.unwrap_or_else(|_| Err(limit()));
        opened.map(|stream| Box::new(Guarded(stream)) as BoxedStream)
    })
}

fn guarded<T>(poll: impl FnOnce() -> Poll<io::Result<T>>) -> Poll<io::Result<T>> {
    catch_unwind(AssertUnwindSafe(poll)).unwrap_or_else(|panic| Poll::Ready(Err(told(&*panic))))
}

fn told(panic: &(dyn Any + Send)) -> io::Error {
    io::Error::other(format!("the stream has panicked: {}", panic_said(panic)))
}
