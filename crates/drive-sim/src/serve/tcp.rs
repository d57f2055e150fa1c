//! TCP endpoints: the line's own frames over TCP, and Modbus TCP.

use std::{collections::BTreeMap, io};

use drive_clock::Timer;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::Instant,
};

use super::wired;
use crate::{
    fault::Fault,
    line::SimLine,
    speech::{Content, Speech},
    wire::Master,
};

/// Transaction, protocol, length, unit.
const HEADER: usize = 7;
/// The longest PDU.
const LONGEST: usize = 253;

pub(super) async fn serve_rtu(line: SimLine, listener: TcpListener) -> io::Result<()> {
    loop {
        let (stream, _) = listener.accept().await?;
        hurry(&stream);
        let wire = line.wiring().wire(false);
        let master = Master::of(line.wiring().settings);
        // A broken connection ends that master's service, not the line's.
        if let Err(error) =
            wired::serve(line.shared().clone(), stream, Timer::precise(), wire, || Some(master)).await
        {
            tracing::debug!(%error, "connection lost");
        }
    }
}

pub(super) async fn serve_modbus(line: SimLine, listener: TcpListener) -> io::Result<()> {
    let mut connections = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => {
                let (stream, _) = accepted?;
                hurry(&stream);
                connections.spawn(connection(line.clone(), stream));
            }
            Some(ended) = connections.join_next() => {
                if let Ok(Err(error)) = ended {
                    tracing::debug!(%error, "connection lost");
                }
            }
        }
    }
}

/// A frame is one small write and must not wait for the next. A connection that refuses is gone, and its service shows
/// it; the endpoint goes on.
pub(super) fn hurry(stream: &TcpStream) {
    if let Err(error) = stream.set_nodelay(true) {
        tracing::debug!(%error, "connection not hurried");
    }
}

/// One client: requests are answered in their order.
async fn connection(line: SimLine, mut stream: TcpStream) -> io::Result<()> {
    let mut timer = Timer::precise();
    let mut wakes = line.shared().wakes();
    let mut received = Vec::new();
    // Transactions whose answers a test holds back.
    let mut held = BTreeMap::new();
    loop {
        while let Some((transaction, unit, request)) = next_request(&mut received)? {
            let speech = {
                let mut state = line.shared().lock();
                // A gateway knows how each of its slaves speaks.
                state.reached = None;
                let speech = state.request(Instant::now(), unit, &request).into_iter().next();
                let lost = state.faults.strikes(Fault::Lost).is_some();
                let late = state.faults.strikes(Fault::Late).map(|_| ());
                let lateness = late.map(|()| state.faults.lateness()).unwrap_or_default();
                speech.filter(|_| !lost).map(|speech| (speech, lateness))
            };
            line.shared().has_changed();
            let Some((Speech { content: Content::Message(answer), heard, turnaround, .. }, lateness)) =
                speech
            else {
                held.insert(unit, transaction);
                continue;
            };
            timer.until(heard + turnaround + lateness).await;
            stream.write_all(&frame(transaction, unit, &answer)).await?;
        }
        tokio::select! {
            read = stream.read_buf(&mut received) => {
                if read? == 0 {
                    return Ok(());
                }
            }
            woken = wakes.changed() => {
                if woken.is_err() {
                    return Ok(());
                }
                let released = line.shared().lock().take_released(|unit| held.contains_key(&unit));
                for (_, unit, answer) in released {
                    if let Some(transaction) = held.remove(&unit) {
                        stream.write_all(&frame(transaction, unit, &answer)).await?;
                    }
                }
            }
        }
    }
}

/// Takes a whole request from what was received: transaction, unit, PDU.
pub(super) fn next_request(received: &mut Vec<u8>) -> io::Result<Option<(u16, u8, Vec<u8>)>> {
    let &[t1, t2, p1, p2, l1, l2, unit, ..] = &received[..] else { return Ok(None) };
    let length = usize::from(u16::from_be_bytes([l1, l2]));
    if [p1, p2] != [0, 0] || !(2..=LONGEST + 1).contains(&length) {
        // Without a frame's length there is no way to find the next one.
        return Err(io::Error::new(io::ErrorKind::InvalidData, "not a Modbus TCP header"));
    }
    let end = HEADER - 1 + length;
    let Some(request) = received.get(HEADER..end).map(<[u8]>::to_vec) else { return Ok(None) };
    received.drain(..end);
    Ok(Some((u16::from_be_bytes([t1, t2]), unit, request)))
}

pub(super) fn frame(transaction: u16, unit: u8, pdu: &[u8]) -> Vec<u8> {
    let length = u16::try_from(pdu.len() + 1).unwrap_or(u16::MAX);
    let mut frame = Vec::with_capacity(HEADER + pdu.len());
    frame.extend(transaction.to_be_bytes());
    frame.extend([0, 0]);
    frame.extend(length.to_be_bytes());
    frame.push(unit);
    frame.extend(pdu);
    frame
}
