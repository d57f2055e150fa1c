//! One client: its frames come in, its answers go out. It may be slow, idle or hostile; nobody else notices.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_bus::exchange::mbap;
use drive_core::tokio_modbus::ExceptionCode;
use futures_util::future::poll_immediate;
use tokio::{
    io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _},
    sync::{Semaphore, mpsc},
    time::{Instant, timeout},
};

use super::{
    clients::Connection,
    counters::Ended,
    desk::{Asked, Desk},
    framing::{Frame, Frames},
};
use drived_doors::crowd::Place;

/// Requests that wait behind the one that is carried out; one more is answered by 06h.
const QUEUED: usize = 8;
/// Answers that wait until the client takes them; then nothing more is read from it.
const UNREAD: usize = 16;
/// How long a frame that has begun may take to end, and a client to take an answer.
const HALF_OPEN: Duration = Duration::from_secs(5);

/// Stops of one client that are not answered yet; behind so many nothing more is read from it.
const STOPS: usize = 64;

/// A request, and how its answer is told.
struct Waiting {
    transaction: u16,
    unit: u8,
    asked: Asked,
}

/// Serves a client until it goes, or has to.
pub(super) async fn serve(
    stream: impl AsyncRead + AsyncWrite + Send,
    by: Connection,
    desk: Arc<Desk>,
    place: &Place,
) {
    let by = Arc::new(by);
    let (input, output) = tokio::io::split(stream);
    let (answers, outbox) = mpsc::channel(UNREAD);
    let (queue, waiting) = mpsc::channel(QUEUED);
    let mut written = std::pin::pin!(write(output, outbox));
    let mut carried = std::pin::pin!(carry_out(&desk, &by, waiting, answers.clone()));
    let read = read(input, &desk, (&by, place), queue, answers);
    let (ended, takes_more) = tokio::select! {
        ended = read => (ended, true),
        // Whoever takes no answer any more asks nothing more.
        ended = &mut written => (ended, false),
        () = &mut carried => (None, false),
    };
    if let Some(why) = ended {
        let count = desk.counters.end(why);
        if count.is_power_of_two() {
            let (name, peer) = (&desk.config.name, by.peer);
            tracing::warn!("gateway {name}: {peer} was put out ({}), {count} of these in all", why.name());
        }
    }
    if ended.is_some_and(|why| why != Ended::Full) || !takes_more {
        return;
    }
    // Whoever closes his side after the last request gets its answer all the same, and whoever has no place his refusal.
    let rest = async { tokio::join!(carried, written) };
    let _ = timeout(desk.config.patience + HALF_OPEN, rest).await;
}

/// Reads frames until the client's end, or a reason to put it out.
async fn read(
    mut input: impl AsyncRead + Unpin,
    desk: &Arc<Desk>,
    (by, place): (&Arc<Connection>, &Place),
    queue: mpsc::Sender<Waiting>,
    answers: mpsc::Sender<Bytes>,
) -> Option<Ended> {
    let mut frames = Frames::new();
    let stops = Arc::new(Semaphore::new(STOPS));
    loop {
        let (patience, why) = match frames.is_inside() {
            true => (HALF_OPEN, Ended::HalfOpen),
            false => (desk.config.idle, Ended::Idle),
        };
        match timeout(patience, input.read(frames.room())).await {
            Err(_) => return Some(why),
            Ok(Ok(0) | Err(_)) => {
                by.close();
                return None;
            }
            Ok(Ok(bytes)) => frames.filled(bytes),
        }
        let arrived = Instant::now();
        // Before anything is carried out: whether he has closed his side behind it.
        while let room @ [_, ..] = frames.room()
            && let Some(more) = poll_immediate(input.read(room)).await
        {
            let Ok(bytes @ 1..) = more else {
                by.close();
                break;
            };
            frames.filled(bytes);
        }
        loop {
            let frame = match frames.next() {
                Ok(Some(frame)) => frame,
                Ok(None) => break,
                Err(_) => return Some(Ended::Malformed),
            };
            desk.clients.hear(by.peer, arrived);
            desk.plant.watched().hear(&desk.config.name, by.peer, arrived);
            place.hear(arrived);
            let Frame { transaction, unit, .. } = frame;
            let asked = desk.look_at(arrived, &frame);
            if asked.stop.is_some() {
                let (desk, by, answers) = (Arc::clone(desk), Arc::clone(by), answers.clone());
                // It is closed by nobody.
                let place = Arc::clone(&stops).acquire_owned().await;
                let stopped = async move {
                    answer(&desk, &by, Waiting { transaction, unit, asked }, &answers).await;
                    drop(place);
                };
                tokio::spawn(stopped);
            } else if place.is_for_stops() {
                // All others ask: whoever does not stop leaves the place to one who does.
                let function = frame.pdu.first().copied().unwrap_or_default();
                let busy = desk.refuse(function, ExceptionCode::ServerDeviceBusy);
                let _ = answers.send(mbap::frame(transaction, unit, &busy)).await;
                return Some(Ended::Full);
            } else if queue.try_send(Waiting { transaction, unit, asked }).is_err() {
                let function = frame.pdu.first().copied().unwrap_or_default();
                let busy = desk.refuse(function, ExceptionCode::ServerDeviceBusy);
                // A client that is gone is noticed at the next reading.
                let _ = answers.send(mbap::frame(transaction, unit, &busy)).await;
            }
            // So that whoever is free takes it before the next comes.
            tokio::task::yield_now().await;
        }
    }
}

/// Carries out one request after the other.
async fn carry_out(
    desk: &Arc<Desk>,
    by: &Connection,
    mut waiting: mpsc::Receiver<Waiting>,
    answers: mpsc::Sender<Bytes>,
) {
    while let Some(next) = waiting.recv().await {
        answer(desk, by, next, &answers).await;
    }
}

async fn answer(desk: &Arc<Desk>, by: &Connection, waiting: Waiting, answers: &mpsc::Sender<Bytes>) {
    let Waiting { transaction, unit, asked } = waiting;
    if let Some(pdu) = desk.answer(by, asked).await {
        // Nobody waits for the answer of a client that is gone.
        let _ = answers.send(mbap::frame(transaction, unit, &pdu)).await;
    }
}

/// Writes answers until nobody has one any more, or the client does not take them.
async fn write(mut output: impl AsyncWrite + Unpin, mut outbox: mpsc::Receiver<Bytes>) -> Option<Ended> {
    while let Some(answer) = outbox.recv().await {
        match timeout(HALF_OPEN, output.write_all(&answer)).await {
            Err(_) => return Some(Ended::SlowReader),
            Ok(Err(_)) => return None,
            Ok(Ok(())) => {}
        }
    }
    None
}
