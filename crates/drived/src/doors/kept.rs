//! The body of an answer, which keeps the connection's place and ends with the server.

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
    /// An event stream has no end of its own.
    end: Option<Pin<Box<dyn Future<Output = ()> + Send>>>,
}

impl Kept {
    pub(super) fn whole(body: Body, asking: Asking) -> Self {
        Self { body, _asking: asking, end: None }
    }

    pub(super) fn stream(body: Body, asking: Asking, mut end: watch::Receiver<bool>) -> Self {
        let end = Box::pin(async move {
            // Where nobody could say it any more, it has ended too.
            let _ = end.wait_for(|ended| *ended).await;
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
