//! A gateway with a stranger's habits: a box between a network and the line, which serves one request after another and
//! waits for drives that do not answer.

use std::{
    collections::{BTreeSet, VecDeque},
    io,
    pin::pin,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use crc::{CRC_16_MODBUS, Crc};
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream},
    net::TcpListener,
    sync::{Mutex, watch},
    task::JoinSet,
    time::{Instant, sleep, sleep_until},
};

use super::{MEMORY, Serving, tcp};
use crate::{
    line::SimLine,
    speech::{Content, Speech},
};

/// Exception 0Bh: the gateway has asked and nobody has answered (Modbus Application Protocol V1.1b3, section 7).
const NOBODY_ANSWERED: u8 = 0x0B;
/// How many frames it can keep to give them once more.
const KEPT: usize = 8;
const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MODBUS);

/// What a gateway does. As it comes: Modbus TCP, one request at a time for all its connections, three attempts of a second
/// for a drive that does not answer, and then exception 0Bh, as mbusd and most boxes do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gateway {
    /// RTU frames over its connections instead of Modbus TCP.
    pub rtu: bool,
    /// How often it asks a drive that does not answer.
    pub attempts: u32,
    /// How long it waits each time.
    pub wait: Duration,
    /// Whether it says that nobody answered, by exception 0Bh, or nothing.
    pub tells: bool,
    /// Whether the connections share one line, so that one waits for another's request.
    pub one_line: bool,
    /// So many of the last answers are given once more to whoever connects next.
    pub replays: usize,
    /// When those come: as soon as somebody has connected, or with the first byte that he sends.
    pub replays_when_asked: bool,
    /// Each answer comes once more after so long.
    pub doubles_after: Option<Duration>,
    /// A connection gives nothing any more when it is so old; the next one does.
    pub mute_after: Option<Duration>,
    /// What it does with a second connection.
    pub second: SecondConnection,
}

/// What a gateway does when somebody connects while another connection is open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SecondConnection {
    /// It serves both, as gateways for several clients do.
    #[default]
    Granted,
    /// It ends the new one at once.
    Refused,
    /// The system takes the new one, and nobody serves it until the first is gone: a server that knows one client.
    NeverServed,
    /// It ends the first: the newest client is the right one.
    EndsTheFirst,
    /// It answers on the newest alone, and leaves the first open.
    SilencesTheFirst,
}

impl Default for Gateway {
    fn default() -> Self {
        Self {
            rtu: false,
            attempts: 3,
            wait: Duration::from_secs(1),
            tells: true,
            one_line: true,
            replays: 0,
            replays_when_asked: false,
            doubles_after: None,
            mute_after: None,
            second: SecondConnection::Granted,
        }
    }
}

/// What the connections of a gateway share.
struct Behind {
    line: SimLine,
    habits: Gateway,
    /// Whoever has it has the line.
    turn: Mutex<()>,
    /// Ends every connection.
    cut: watch::Sender<()>,
    /// Its last answers, as they went out.
    last: std::sync::Mutex<VecDeque<Vec<u8>>>,
    /// The connections that are open, by their number, the oldest first.
    open: std::sync::Mutex<BTreeSet<u64>>,
    /// How many there have been.
    connected: AtomicU64,
}

/// A connection that is counted for as long as it is open.
struct Counted<'a> {
    behind: &'a Behind,
    number: u64,
}

impl<'a> Counted<'a> {
    fn new(behind: &'a Behind) -> Self {
        let number = behind.connected.fetch_add(1, Ordering::Relaxed);
        behind.open().insert(number);
        Self { behind, number }
    }

    /// Whether another connection is open that was so before.
    fn is_second(&self) -> bool {
        self.behind.open().first().is_some_and(|first| *first != self.number)
    }

    /// Whether it is to be served now.
    fn is_served(&self) -> bool {
        match self.behind.habits.second {
            SecondConnection::NeverServed => !self.is_second(),
            SecondConnection::SilencesTheFirst => self.behind.open().last() == Some(&self.number),
            _ => true,
        }
    }
}

impl Drop for Counted<'_> {
    fn drop(&mut self) {
        self.behind.open().remove(&self.number);
    }
}

/// A gateway in memory: connections to it are made one after another, or several at once.
#[derive(Clone)]
pub struct GatewayInMemory(Arc<Behind>);

impl GatewayInMemory {
    /// The master's end of a new connection.
    #[must_use]
    pub fn connect(&self) -> DuplexStream {
        let (master, slaves) = tokio::io::duplex(MEMORY);
        // Detached: it ends by itself with the master's end.
        drop(tokio::spawn(connection(Arc::clone(&self.0), slaves)));
        master
    }
}

impl GatewayInMemory {
    /// Ends all its connections, as a network does.
    pub fn cut(&self) {
        self.0.cut.send_replace(());
    }
}

impl std::fmt::Debug for GatewayInMemory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GatewayInMemory").field("habits", &self.0.habits).finish_non_exhaustive()
    }
}

impl SimLine {
    /// The line behind a gateway, in memory, on tokio's own clock, paused or not.
    #[must_use]
    pub fn behind(&self, habits: Gateway) -> GatewayInMemory {
        GatewayInMemory(self.behind_it(habits))
    }

    /// The line behind a gateway on TCP.
    #[must_use]
    pub fn serve_gateway(&self, listener: TcpListener, habits: Gateway) -> Serving {
        Serving::new(tokio::spawn(accept(self.behind_it(habits), listener)))
    }

    fn behind_it(&self, habits: Gateway) -> Arc<Behind> {
        Arc::new(Behind {
            line: self.clone(),
            habits,
            turn: Mutex::new(()),
            cut: watch::Sender::new(()),
            last: std::sync::Mutex::default(),
            open: std::sync::Mutex::default(),
            connected: AtomicU64::new(0),
        })
    }
}

async fn accept(behind: Arc<Behind>, listener: TcpListener) -> io::Result<()> {
    let mut connections = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => {
                let (stream, _) = accepted?;
                tcp::hurry(&stream);
                connections.spawn(connection(Arc::clone(&behind), stream));
            }
            Some(ended) = connections.join_next() => {
                if let Ok(Err(error)) = ended {
                    tracing::debug!(%error, "connection lost");
                }
            }
        }
    }
}

/// One connection, until it is cut.
async fn connection(behind: Arc<Behind>, stream: impl AsyncRead + AsyncWrite + Send) -> io::Result<()> {
    let counted = Counted::new(&behind);
    match behind.habits.second {
        SecondConnection::Refused if counted.is_second() => return Ok(()),
        SecondConnection::EndsTheFirst if counted.is_second() => behind.cut.send_replace(()),
        _ => {}
    }
    let mut cut = behind.cut.subscribe();
    tokio::select! {
        served = serve(&behind, &counted, stream) => served,
        _ = cut.changed() => Ok(()),
    }
}

/// Its requests are served in their order, each when the one before it is over.
async fn serve(
    behind: &Behind,
    counted: &Counted<'_>,
    stream: impl AsyncRead + AsyncWrite + Send,
) -> io::Result<()> {
    let (mut from, mut to) = tokio::io::split(stream);
    let habits = behind.habits;
    let begun = Instant::now();
    let mut received = Vec::new();
    let mut replayed = behind.replayed();
    let mut again = VecDeque::new();
    loop {
        if !habits.replays_when_asked {
            to.write_all(&std::mem::take(&mut replayed)).await?;
        }
        let request = loop {
            if let Some(request) = Asked::take(habits.rtu, &mut received)? {
                break request;
            }
            tokio::select! {
                read = from.read_buf(&mut received) => {
                    if read? == 0 {
                        return Ok(());
                    }
                }
                () = due(&again) => {}
            }
            give_again(&mut again, &mut to).await?;
        };
        if habits.mute_after.is_some_and(|age| begun.elapsed() >= age) || !counted.is_served() {
            continue;
        }
        to.write_all(&std::mem::take(&mut replayed)).await?;
        let mut serving = pin!(behind.serve(&request));
        let answer = loop {
            tokio::select! {
                answer = &mut serving => break answer,
                () = due(&again) => give_again(&mut again, &mut to).await?,
            }
        };
        let Some(answer) = answer else { continue };
        give_again(&mut again, &mut to).await?;
        to.write_all(&answer).await?;
        again.extend(habits.doubles_after.map(|after| (Instant::now() + after, answer)));
    }
}

/// When the next answer is given once more.
async fn due(again: &VecDeque<(Instant, Vec<u8>)>) {
    match again.front() {
        Some((at, _)) => sleep_until(*at).await,
        None => std::future::pending().await,
    }
}

/// Gives once more what is due.
async fn give_again(
    again: &mut VecDeque<(Instant, Vec<u8>)>,
    to: &mut (impl AsyncWrite + Unpin),
) -> io::Result<()> {
    while again.front().is_some_and(|(at, _)| *at <= Instant::now()) {
        let Some((_, answer)) = again.pop_front() else { break };
        to.write_all(&answer).await?;
    }
    Ok(())
}

impl Behind {
    fn open(&self) -> std::sync::MutexGuard<'_, BTreeSet<u64>> {
        self.open.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// The answer to a request as it goes out to the connection.
    async fn serve(&self, request: &Asked) -> Option<Vec<u8>> {
        let _turn = if self.habits.one_line { Some(self.turn.lock().await) } else { None };
        let settings = self.line.wiring().settings;
        sleep(settings.characters(request.pdu.len() + 3)).await;
        let speech = {
            let mut state = self.line.shared().lock();
            // A gateway knows how each of its slaves speaks.
            state.reached = None;
            state.request(Instant::now(), request.unit, &request.pdu).into_iter().next()
        };
        self.line.shared().has_changed();
        if let Some(Speech { content: Content::Message(answer), heard, turnaround, .. }) = speech {
            sleep_until(heard + turnaround + settings.characters(answer.len() + 3)).await;
            let frame = request.answered(&answer);
            self.keep(&frame);
            return Some(frame);
        }
        if request.unit == 0 {
            return None;
        }
        sleep(self.habits.wait * self.habits.attempts).await;
        let told = [request.pdu.first().copied().unwrap_or_default() | 0x80, NOBODY_ANSWERED];
        self.habits.tells.then(|| request.answered(&told))
    }

    fn keep(&self, frame: &[u8]) {
        let mut last = self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        last.push_back(frame.to_vec());
        if last.len() > KEPT {
            last.pop_front();
        }
    }

    /// What whoever connects is given first.
    fn replayed(&self) -> Vec<u8> {
        let last = self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let from = last.len().saturating_sub(self.habits.replays);
        last.range(from..).flatten().copied().collect()
    }
}

/// A request, and what its answer repeats.
struct Asked {
    /// On Modbus TCP.
    transaction: Option<u16>,
    unit: u8,
    pdu: Vec<u8>,
}

impl Asked {
    fn take(rtu: bool, received: &mut Vec<u8>) -> io::Result<Option<Self>> {
        if !rtu {
            let request = tcp::next_request(received)?;
            return Ok(request.map(|(transaction, unit, pdu)| Self {
                transaction: Some(transaction),
                unit,
                pdu,
            }));
        }
        let is_frame = |end: &usize| {
            received
                .get(..*end)
                .and_then(<[u8]>::split_last_chunk::<2>)
                .is_some_and(|(frame, check)| frame.len() > 1 && CRC.checksum(frame).to_le_bytes() == *check)
        };
        let Some(end) = (4..=received.len()).find(is_frame) else { return Ok(None) };
        let frame: Vec<u8> = received.drain(..end).collect();
        let (unit, pdu) = (frame.first().copied().unwrap_or_default(), frame.get(1..end - 2));
        Ok(Some(Self { transaction: None, unit, pdu: pdu.unwrap_or_default().to_vec() }))
    }

    fn answered(&self, pdu: &[u8]) -> Vec<u8> {
        if let Some(transaction) = self.transaction {
            return tcp::frame(transaction, self.unit, pdu);
        }
        let mut frame = [&[self.unit], pdu].concat();
        frame.extend(CRC.checksum(&frame).to_le_bytes());
        frame
    }
}
