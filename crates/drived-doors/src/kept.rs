//! The body of an answer, which keeps the connection's place, and ends with the server and with the authority of who asked for it.

use std::{
    pin::Pin,
    task::{Context, Poll},
};

use axum::body::{Body, Bytes};
use hyper::body::{Frame, SizeHint};
use tokio::sync::watch;

use super::crowd::Asking;

/// A body on its way.
pub(super) struct Kept {
    body: Body,
    _asking: Asking,
    /// What goes on for long ends when this does.
    end: Option<Pin<Box<dyn Future<Output = ()> + Send>>>,
}

impl Kept {
    pub(super) fn whole(body: Body, asking: Asking) -> Self {
        Self { body, _asking: asking, end: None }
    }

    pub(super) fn stream(
        body: Body,
        asking: Asking,
        mut end: watch::Receiver<bool>,
        authority: impl Future<Output = ()> + Send + 'static,
    ) -> Self {
        let end = Box::pin(async move {
            tokio::select! {
                // Where nobody could say it any more, it has ended too.
                _ = end.wait_for(|ended| *ended) => {}
                () = authority => {}
            }
        });
        Self { body, _asking: asking, end: Some(end) }
    }
}

impl hyper::body::Body for Kept {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        if self.end.as_mut().is_some_and(|end| end.as_mut().poll(context).is_ready()) {
            return Poll::Ready(None);
        }
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
