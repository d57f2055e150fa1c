//! The task of an endpoint that carries characters: reads, asks the wire, writes.

use std::{future::poll_fn, io, pin::Pin, sync::Arc, task::Poll};

use drive_clock::Timer;
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWrite},
    time::Instant,
};

use crate::{
    line::Shared,
    wire::{Master, Step, Wire},
};

/// Serves one master until its end of the port closes, as its port is set at the moment; where nobody can tell how, what
/// comes is nothing to the slaves.
pub(super) async fn serve(
    shared: Arc<Shared>,
    mut port: impl AsyncRead + AsyncWrite + Unpin,
    mut timer: Timer,
    mut wire: Wire,
    master: impl Fn() -> Option<Master>,
) -> io::Result<()> {
    let mut wakes = shared.wakes();
    let mut buffer = [0; 1_024];
    loop {
        if let Some(master) = master() {
            wire.tune(master);
        }
        let step = wire.poll(Instant::now(), &mut shared.lock());
        let due = match step {
            Step::Send(bytes) => {
                let taken = hand_over(&mut port, &bytes).await?;
                let lost = u64::try_from(bytes.len() - taken).unwrap_or(u64::MAX);
                shared.lock().stats.undelivered += lost;
                shared.has_changed();
                continue;
            }
            Step::Wait(due) => due,
        };
        tokio::select! {
            biased;
            read = port.read(&mut buffer) => {
                let now = Instant::now();
                let Some(bytes) = buffer.get(..read?).filter(|bytes| !bytes.is_empty()) else { return Ok(()) };
                let Some(master) = master() else { continue };
                wire.tune(master);
                wire.receive(now, bytes, &mut shared.lock());
                shared.has_changed();
            }
            woken = wakes.changed() => {
                if woken.is_err() {
                    return Ok(());
                }
            }
            () = wait(&mut timer, due) => {}
        }
    }
}

async fn wait(timer: &mut Timer, due: Option<Instant>) {
    match due {
        Some(due) => timer.until(due).await,
        None => std::future::pending().await,
    }
}

/// Writes what the port takes now and drops the rest, as a wire does for a receiver that does not listen: a master that
/// never reads must not stop the slaves. How many bytes were taken.
async fn hand_over(port: &mut (impl AsyncWrite + Unpin), bytes: &[u8]) -> io::Result<usize> {
    let mut taken = 0;
    while let Some(rest) = bytes.get(taken..).filter(|rest| !rest.is_empty()) {
        let written = poll_fn(|context| match Pin::new(&mut *port).poll_write(context, rest) {
            Poll::Ready(written) => Poll::Ready(written),
            Poll::Pending => Poll::Ready(Ok(0)),
        });
        match written.await? {
            0 => break,
            count => taken += count,
        }
    }
    Ok(taken)
}
