//! The task that owns the port: it writes, reads, waits, and does what the master decides.

use std::{
    future::poll_fn,
    io, mem,
    ops::Range,
    pin::{Pin, pin},
    sync::Arc,
    task::{Context, Poll, Waker},
    time::Duration,
};

use drive_clock::{Sleeps, Timer, Watch};
use tokio::{
    io::{AsyncReadExt, AsyncWrite, AsyncWriteExt},
    task::yield_now,
    time::{Instant, timeout},
};

use crate::{
    config::{Endpoint, LineConfig},
    master::{Outcome, SecondPort},
    shared::{Caller, Shared},
    transport::{BoxedStream, Connector, OpenError, Opening, poll_read_now, reset_when_dropped},
};

/// How long a frame may wait for room in the system's buffer. That has room for many frames and is empty when one is sent,
/// so that a port which takes none for a second is as good as gone; a stop must not wait for it longer.
const WRITE_LIMIT: Duration = Duration::from_secs(1);

/// How often a port that gives bytes without end is read before anything else is done: 8 KiB, twice what Linux keeps for a
/// terminal, so that what lay there is taken and no babbler keeps the line from deciding.
const MOST_READS: u32 = 16;

/// First and longest time between two attempts to open the port again: soon enough for whoever has put the plug back, and
/// seldom enough for a port that is away for a week.
const REOPEN_BACKOFF: (Duration, Duration) = (Duration::from_millis(100), Duration::from_secs(2));

pub(crate) struct Task {
    shared: Arc<Shared>,
    endpoint: Endpoint,
    connector: Connector,
    port: Connection,
    /// The connection that stops take while the first waits for a drive that does not answer.
    second: Connection,
    timer: Timer,
    watch: Option<Watch>,
    sleeps: Sleeps,
    /// When the answer that is awaited is worth being awake for.
    awake: Option<Range<Instant>>,
    /// Before the next attempt to open the port. It is shortest again once the port has given a byte, not when it
    /// merely opens: some open and fail for ever.
    backoff: Duration,
    received: Vec<u8>,
    /// The same of the second connection, with room once there is one.
    received_second: Vec<u8>,
    ended: Vec<(Caller, Outcome)>,
}

enum Connection {
    Open(BoxedStream),
    Opening(Opening<OpenError>),
    Waiting(Instant),
    Gone,
}

/// What a port does.
enum PortEvent {
    Received(io::Result<usize>),
    Opened(Result<BoxedStream, OpenError>),
}

enum Event {
    Received(io::Result<usize>),
    Opened(Result<BoxedStream, OpenError>),
    /// Something of the second connection.
    Second(PortEvent),
    /// A deadline, a new request, the end.
    Woken,
}

impl Task {
    pub(crate) fn new(
        config: &LineConfig,
        shared: Arc<Shared>,
        connector: Connector,
        stream: Option<BoxedStream>,
        sleeps: Sleeps,
    ) -> Self {
        let on_descriptor = config.endpoint.is_serial() || config.endpoint.is_connection();
        let precise = on_descriptor && config.protocol.is_paced() || config.precise_timer;
        shared.master().set_reopens(connector.reopens());
        let port = match stream {
            Some(stream) => {
                up(&shared, &config.endpoint);
                Connection::Open(stream)
            }
            None => Connection::Waiting(Instant::now()),
        };
        Self {
            shared,
            endpoint: config.endpoint.clone(),
            connector,
            port,
            second: Connection::Gone,
            timer: if precise { Timer::precise() } else { Timer::tokio() },
            watch: (precise && config.stay_awake).then(Watch::new),
            sleeps,
            awake: None,
            backoff: REOPEN_BACKOFF.0,
            received: vec![0; 512],
            received_second: Vec::new(),
            ended: Vec::new(),
        }
    }

    pub(crate) async fn run(mut self) {
        let _ends = Ends(Arc::clone(&self.shared));
        while let Some(deadline) = self.decide().await {
            self.shared.count_round();
            let event = self.next_event(deadline).await;
            if self.was_asleep() {
                continue;
            }
            match event {
                Event::Received(Ok(0)) => self.lose("the port was closed by its far end"),
                Event::Received(Ok(len)) => self.take(len),
                Event::Received(Err(error)) => self.lose(&error.to_string()),
                Event::Opened(Ok(stream)) => {
                    up(&self.shared, &self.endpoint);
                    self.port = Connection::Open(stream);
                }
                Event::Opened(Err(error)) => {
                    self.shared.master().handle_down(&error.to_string());
                    self.wait_to_open();
                }
                Event::Second(event) => self.take_second(event),
                Event::Woken => {}
            }
        }
    }

    /// Lets the master decide and writes what it wants written, until there is nothing to do but wait. `None`: the end.
    async fn decide(&mut self) -> Option<Option<Instant>> {
        loop {
            self.read_rest().await;
            self.serve_second();
            let (frame, deadline, finished, asked_at, mute, retractions) = {
                let now = Instant::now();
                let mut master = self.shared.master();
                master.handle_timeout(now);
                let asked_at = master.asked_at();
                let mute = master.poll_mute(now);
                let frame = master.poll_transmit(now);
                self.awake.take_if(|_| !master.is_busy());
                self.ended.extend(std::iter::from_fn(|| master.poll_outcome()));
                (frame, master.deadline(), master.is_finished(), asked_at, mute, master.retractions())
            };
            self.shared.tell_retractions(retractions);
            let answered = !self.ended.is_empty();
            for (caller, outcome) in self.ended.drain(..) {
                caller.answer(outcome, asked_at);
            }
            if let Some(reason) = mute {
                self.leave(&reason);
                continue;
            }
            let Some(frame) = frame else {
                if answered && !finished {
                    // Whoever got an answer usually asks again at once: one look at the port and one timer for both.
                    give_way().await;
                    continue;
                }
                return (!finished).then_some(deadline);
            };
            let Connection::Open(stream) = &mut self.port else { return Some(deadline) };
            match write(stream, &frame).await {
                Ok(()) => {
                    let now = Instant::now();
                    let (deadline, due) = {
                        let mut master = self.shared.master();
                        master.handle_sent(now);
                        (master.deadline(), master.answer_due())
                    };
                    let due = self.watch.as_mut().zip(due);
                    self.awake = due.and_then(|(watch, (due, spread))| watch.plan(now, due, spread));
                    self.shared.tap().take_if(|tap| !tap.sent(now, &frame));
                    return Some(deadline);
                }
                Err(error) => self.lose(&error.to_string()),
            }
        }
    }

    /// Reads what lies in the port before a time is declared over or a request is sent: what came before is then known
    /// to have come before.
    async fn read_rest(&mut self) {
        let (is_over, may_send) = {
            let (now, master) = (Instant::now(), self.shared.master());
            (master.is_over(now), master.may_send())
        };
        let Connection::Open(_) = self.port else { return };
        if is_over || (may_send && self.endpoint.is_connection()) {
            // The runtime itself may have been away, or has not looked at the port since the last answer.
            yield_now().await;
        } else if !may_send {
            return;
        }
        for _ in 0..MOST_READS {
            let Connection::Open(stream) = &mut self.port else { return };
            // Whoever waits for more asks again.
            let mut context = Context::from_waker(Waker::noop());
            match poll_read_now(stream.as_mut(), &mut context, &mut self.received) {
                Poll::Pending => return,
                Poll::Ready(Ok(0)) => return self.lose("the port was closed by its far end"),
                Poll::Ready(Ok(len)) => self.take(len),
                Poll::Ready(Err(error)) => return self.lose(&error.to_string()),
            }
        }
    }

    /// Bytes were received.
    fn take(&mut self, len: usize) {
        self.backoff = REOPEN_BACKOFF.0;
        let bytes = self.received.get(..len).unwrap_or_default();
        let (now, mut master) = (Instant::now(), self.shared.master());
        master.handle_bytes(now, bytes);
        let complete = !master.is_busy();
        drop(master);
        self.shared.tap().take_if(|tap| !tap.received(now, bytes, complete));
    }

    /// Opens, closes and writes the second connection as the master wants it. Nothing of it is waited for.
    fn serve_second(&mut self) {
        let now = Instant::now();
        let wanted = {
            let mut master = self.shared.master();
            master.handle_timeout(now);
            master.poll_second(now)
        };
        match wanted {
            Some(SecondPort::Open) => {
                self.second = self.connector.connect().map_or(Connection::Gone, Connection::Opening);
                self.received_second.resize(self.received.len(), 0);
            }
            Some(SecondPort::Close) => {
                if let Connection::Open(stream) = &mut self.second {
                    reset_when_dropped(stream);
                }
                self.second = Connection::Gone;
            }
            None => {}
        }
        let Connection::Open(stream) = &mut self.second else { return };
        let Some(frame) = self.shared.master().poll_second_transmit(now) else { return };
        // Its buffer is empty: one that does not take a frame at once is as good as gone.
        let mut context = Context::from_waker(Waker::noop());
        match Pin::new(stream).poll_write(&mut context, &frame) {
            Poll::Ready(Ok(len)) if len == frame.len() => {
                let now = Instant::now();
                self.shared.master().handle_second_sent(now);
                self.shared.tap().take_if(|tap| !tap.sent(now, &frame));
            }
            _ => self.lose_second(),
        }
    }

    fn take_second(&mut self, event: PortEvent) {
        let now = Instant::now();
        match event {
            PortEvent::Opened(Ok(stream)) => {
                self.shared.master().handle_second_up(now);
                self.second = Connection::Open(stream);
            }
            PortEvent::Received(Ok(len @ 1..)) => {
                let bytes = self.received_second.get(..len).unwrap_or_default();
                self.shared.master().handle_second_bytes(now, bytes);
                self.shared.tap().take_if(|tap| !tap.received(now, bytes, true));
            }
            PortEvent::Received(_) | PortEvent::Opened(Err(_)) => self.lose_second(),
        }
    }

    fn lose_second(&mut self) {
        self.second = Connection::Gone;
        self.shared.master().handle_second_lost(Instant::now());
    }

    async fn next_event(&mut self, deadline: Option<Instant>) -> Event {
        let Self { shared, connector, port, second, timer, watch, awake, received, received_second, .. } =
            self;
        if let Connection::Waiting(until) = port
            && *until <= Instant::now()
        {
            *port = connector.connect().map_or(Connection::Gone, Connection::Opening);
        }
        let open_at = if let Connection::Waiting(until) = port { Some(*until) } else { None };
        let wake_at = [deadline, open_at].into_iter().flatten().min();
        let watched = awake.as_ref().map(|awake| awake.start);
        let watched = watched.filter(|start| wake_at.is_none_or(|wake_at| *start < wake_at));
        tokio::select! {
            biased;
            event = port_event(port, received) => return match event {
                PortEvent::Received(read) => Event::Received(read),
                PortEvent::Opened(opened) => Event::Opened(opened),
            },
            event = port_event(second, received_second) => return Event::Second(event),
            () = shared.wake.notified() => return Event::Woken,
            () = poll_fn(|context| match (watched, wake_at) {
                (Some(start), _) => timer.poll_shortly_before(context, start),
                (None, Some(at)) => timer.poll_until(context, at),
                (None, None) => Poll::Pending,
            }) => {}
        }
        let (Some(watch), Connection::Open(stream), Some(_)) = (watch, port, watched) else {
            return Event::Woken;
        };
        let began = Instant::now();
        let event = tokio::select! {
            biased;
            () = shared.wake.notified() => Event::Woken,
            read = read_awake(stream, received, awake.as_ref().map(|awake| awake.end)) => {
                awake.take_if(|_| read.is_none());
                read.map_or(Event::Woken, Event::Received)
            }
        };
        watch.ended(began.elapsed(), awake.is_some());
        event
    }

    /// Where the computer was asleep the line is one that was lost: what lies in the port is as old as that, and so is
    /// whatever was asked.
    fn was_asleep(&mut self) -> bool {
        let slept = self.sleeps.slept().filter(|_| self.connector.reopens());
        let Some((slept, Connection::Open(_))) = slept.zip(Some(&self.port)) else { return false };
        self.leave(&format!("the computer was asleep for {} s", slept.as_secs()));
        true
    }

    /// The port is mute: whatever lies in it, and in the one at its far end, goes with it.
    fn leave(&mut self, reason: &str) {
        if let Connection::Open(stream) = &mut self.port {
            reset_when_dropped(stream);
        }
        self.lose(reason);
    }

    fn lose(&mut self, reason: &str) {
        let now = Instant::now();
        self.shared.count_loss();
        self.shared.master().handle_lost(now, reason);
        self.port = if self.backoff > REOPEN_BACKOFF.0 {
            // It was opened, and lost without a byte: that may go on for ever, and whoever waits is told.
            self.shared.master().handle_down(reason);
            Connection::Waiting(now + self.backoff)
        } else if let Some(opening) = self.connector.connect() {
            // The first attempt is made at once: a plug that was pulled and put back, a server that started anew.
            Connection::Opening(opening)
        } else {
            self.shared.master().handle_down(reason);
            Connection::Gone
        };
        self.lengthen_backoff();
    }

    fn wait_to_open(&mut self) {
        self.port = Connection::Waiting(Instant::now() + self.backoff);
        self.lengthen_backoff();
    }

    fn lengthen_backoff(&mut self) {
        self.backoff = (self.backoff * 2).min(REOPEN_BACKOFF.1);
    }
}

/// Ends the line with its task, however that ends: by its end, with its runtime, by the panic of a port that somebody else has made.
struct Ends(Arc<Shared>);

impl Drop for Ends {
    fn drop(&mut self) {
        // With the tap the capture ends: its writer finishes the file.
        *self.0.tap() = None;
        self.0.end();
    }
}

/// The port is open.
fn up(shared: &Shared, endpoint: &Endpoint) {
    let paces = endpoint.far_end_paces();
    let mut master = shared.master();
    master.set_far_end_paces(paces);
    master.handle_up(Instant::now());
}

/// Writes a frame. A port nearly always takes it at once; only one that does not is worth a timer.
async fn write(stream: &mut BoxedStream, frame: &[u8]) -> io::Result<()> {
    let mut writing = pin!(stream.write_all(frame));
    if let Poll::Ready(written) = poll_fn(|context| Poll::Ready(writing.as_mut().poll(context))).await {
        return written;
    }
    let limit = || io::Error::new(io::ErrorKind::TimedOut, "the port takes no bytes");
    timeout(WRITE_LIMIT, writing).await.unwrap_or_else(|_| Err(limit()))
}

/// Lets the tasks run that are ready now, without a look at the ports in between (as `yield_now` would take).
async fn give_way() {
    let mut given = false;
    poll_fn(|context| {
        if mem::replace(&mut given, true) {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

/// Reads what comes by `end`, without falling asleep meanwhile, and gives way to whatever else wants to run.
async fn read_awake(
    stream: &mut BoxedStream,
    received: &mut [u8],
    end: Option<Instant>,
) -> Option<io::Result<usize>> {
    loop {
        let read = poll_fn(|context| Poll::Ready(poll_read_now(stream.as_mut(), context, received)));
        if let Poll::Ready(read) = read.await {
            return Some(read);
        }
        if end.is_none_or(|end| Instant::now() >= end) {
            return None;
        }
        std::thread::yield_now();
        tokio::task::yield_now().await;
    }
}

async fn port_event(port: &mut Connection, received: &mut [u8]) -> PortEvent {
    match port {
        Connection::Open(stream) => PortEvent::Received(stream.read(received).await),
        Connection::Opening(opening) => PortEvent::Opened(opening.await),
        Connection::Waiting(_) | Connection::Gone => std::future::pending().await,
    }
}
