//! The connection to an MQTT v5 broker: the one place that knows the client crate, which is in [`session`] and [`tls`]
//! alone and can be exchanged there.
//!
//! Nothing that a broker does holds up anybody: [`Broker::publish`] puts into a bounded queue and returns, what does not
//! fit is lost and counted, and a broker that is away, silent or does not read is left and tried again. Every connection
//! is new (clean start, session expiry 0): a broker keeps no commands for a daemon that is away, and who publishes state
//! publishes it again after each [`Event::Connected`].

pub mod config;
mod message;
mod prompt;
mod queue;
mod session;
#[cfg(test)]
pub mod testing;
#[cfg(test)]
mod tests;
mod tls;

use std::{
    fmt,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::{
    sync::{Notify, mpsc, oneshot, watch},
    time::{Instant, sleep, timeout},
};

pub use self::{
    message::{Arrived, Message, Properties, Qos},
    queue::{Counts, Kept},
    tls::Secured,
};
use self::{
    queue::{Queue, Sign},
    session::Ended,
};

/// From the end of a connection to the next try: at first, and at the longest. Each time is drawn from its last half, so
/// that many daemons do not come back together.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(30);
/// Until somebody who stands aside looks again whether he is alone: at first, and at the longest.
const FIRST_ASIDE: Duration = Duration::from_secs(60);
const LONGEST_ASIDE: Duration = Duration::from_secs(600);
/// A connection that has held for so long was a good one: the next pause is short again.
const GOOD_AFTER: Duration = Duration::from_secs(30);
/// Events that wait for whoever reads them. The last quarter is for those that are urgent.
const EVENTS: usize = 1_024;

/// Where the brokers are, and as whom they are spoken to.
#[derive(Clone)]
pub struct Options {
    /// Tried in turn, one at a time; at least one.
    pub servers: Vec<Server>,
    pub client_id: String,
    pub login: Option<Login>,
    /// The longest silence before the broker is asked for a sign of life.
    pub keep_alive: Duration,
    /// Asked for after every connect, before anything is published.
    pub subscriptions: Vec<Subscription>,
    /// How many messages [in order](Kept::InOrder) may wait.
    pub queue: usize,
    /// Whether a message of this topic is taken even where others are turned away because too many come: a stop.
    pub is_urgent: fn(&str) -> bool,
    /// How tests connect.
    #[cfg(test)]
    pub dial: Option<testing::Dial>,
}

/// A broker.
#[derive(Clone)]
pub struct Server {
    pub host: String,
    pub port: u16,
    /// `None`: in clear.
    pub tls: Option<Secured>,
}

impl fmt::Display for Server {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.host, self.port)
    }
}

/// A user of the broker.
#[derive(Clone)]
pub struct Login {
    pub user: String,
    pub password: Option<String>,
}

/// What the broker is to send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subscription {
    pub filter: String,
    pub qos: Qos,
    pub wanted: Wanted,
}

/// Which messages of a subscription.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// What is published from now on, with the flag of a retained message as it was published.
    News,
    /// That, after what the broker has retained.
    NewsAndKept,
    /// What others publish, after what the broker has retained, whoever has published it. Only this has the flag then.
    Others,
}

/// One try to connect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Attempt {
    /// Rises with each; the number of the connection that it becomes.
    pub number: u64,
    /// The server's place among [`Options::servers`].
    pub server: usize,
}

/// What the broker publishes when the connection ends otherwise than by a normal goodbye.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Will {
    pub message: Message,
}

/// What a connection tells, in this order.
#[derive(Debug)]
pub enum Event {
    /// Connected and subscribed: what is to be known there has to be published again.
    Connected(Attempt),
    Message(Arrived),
    /// It is tried again.
    Disconnected,
}

/// How to go, by the reason codes of MQTT v5.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goodbye {
    /// 0x00: the will is not published.
    Normal,
    /// 0x04: the will is published.
    WithWill,
}

/// What comes after a goodbye.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Then {
    End,
    /// The next server is tried.
    NextServer,
    /// Another has the place: it is tried again much later.
    StandAside,
}

/// The connection, as those have it who publish; cheap to clone. It goes on until [`Self::end`], or until its events are
/// dropped.
#[derive(Clone)]
pub struct Broker {
    shared: Arc<Shared>,
    leave: mpsc::Sender<(Goodbye, Then)>,
    gone: watch::Receiver<()>,
}

struct Shared {
    queue: Mutex<Queue>,
    /// Something waits to be sent.
    work: Notify,
}

impl Shared {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Broker {
    /// Connects, and connects again whenever the connection is lost. `will` is asked anew before each connect.
    pub fn start(
        options: Options,
        will: impl FnMut(Attempt) -> Option<Will> + Send + 'static,
    ) -> (Self, mpsc::Receiver<Event>) {
        let shared = Arc::new(Shared { queue: Mutex::new(Queue::new(options.queue)), work: Notify::new() });
        let (events, told) = mpsc::channel(EVENTS);
        let (leave, leaves) = mpsc::channel(4);
        let (alive, gone) = watch::channel(());
        let connection = Connection { options, shared: Arc::clone(&shared), events, leaves };
        tokio::spawn(async move {
            connection.keep(will).await;
            drop(alive);
        });
        (Self { shared, leave, gone }, told)
    }

    /// Hands over a message. It is sent when its turn comes; `false`: it is lost, and counted where somebody misses it.
    pub fn publish(&self, message: Message, kept: Kept) -> bool {
        let taken = self.shared.queue().push(message, kept);
        if taken {
            self.shared.work.notify_one();
        }
        taken
    }

    /// Asks for more, in the present connection only.
    pub fn subscribe(&self, subscriptions: impl IntoIterator<Item = Subscription>) {
        self.shared.queue().ask(subscriptions);
        self.shared.work.notify_one();
    }

    /// Asks the broker for a sign behind everything that was published in order before: for a subscription that it has given already, which
    /// changes nothing. A broker takes what comes by one connection in its order, so that its answer says that it has what was published.
    /// An error: there is none, for the connection has ended before it or nothing more can be asked now.
    pub fn sign(&self, again: Subscription) -> oneshot::Receiver<()> {
        let (seen, sees) = oneshot::channel();
        self.shared.queue().ask_behind(Sign { asked: again, seen });
        self.shared.work.notify_one();
        sees
    }

    pub fn counts(&self) -> Counts {
        self.shared.queue().counts()
    }

    /// Says goodbye after what has been published so far, and goes on with the next server.
    pub fn leave(&self, goodbye: Goodbye) {
        // Who is leaving already is not asked again.
        let _ = self.leave.try_send((goodbye, Then::NextServer));
    }

    /// Leaves the place to another who has it too, and looks again later.
    pub fn stand_aside(&self) {
        // Who is leaving already is not asked again.
        let _ = self.leave.try_send((Goodbye::Normal, Then::StandAside));
    }

    /// Says goodbye after what has been published so far, for good. It takes no longer than `within`.
    pub async fn end(mut self, goodbye: Goodbye, within: Duration) {
        let _ = self.leave.try_send((goodbye, Then::End));
        // It ends by dropping its side.
        let _ = timeout(within, self.gone.changed()).await;
    }
}

/// What keeps the connection.
struct Connection {
    options: Options,
    shared: Arc<Shared>,
    events: mpsc::Sender<Event>,
    leaves: mpsc::Receiver<(Goodbye, Then)>,
}

impl Connection {
    async fn keep(mut self, mut will: impl FnMut(Attempt) -> Option<Will>) {
        let (mut attempt, mut pause) = (Attempt { number: 0, server: 0 }, FIRST_PAUSE);
        let (mut told, mut aside) = (None, FIRST_ASIDE);
        loop {
            attempt.number += 1;
            let begun = Instant::now();
            let ended = session::run(&mut self, attempt, will(attempt)).await;
            if self.shared.queue().disconnected() {
                told = None;
                if self.events.send(Event::Disconnected).await.is_err() {
                    return;
                }
            }
            pause = if begun.elapsed() >= GOOD_AFTER { FIRST_PAUSE } else { pause };
            let mut wait = pause;
            match ended {
                Ended::Left(Then::End) => return,
                Ended::Left(Then::NextServer) => {}
                Ended::Left(Then::StandAside) => {
                    wait = aside;
                    aside = (aside * 2).min(LONGEST_ASIDE);
                }
                Ended::Lost(why) => self.tell(attempt, why, &mut told),
            }
            attempt.server = (attempt.server + 1) % self.options.servers.len().max(1);
            let pausing = sleep(jittered(wait));
            pause = (pause * 2).min(LONGEST_PAUSE);
            tokio::select! {
                () = pausing => {}
                Some((_, Then::End)) = self.leaves.recv() => return,
            }
        }
    }

    /// Says in the log why there is no connection, once for each reason.
    fn tell(&self, attempt: Attempt, why: String, told: &mut Option<String>) {
        if let Some(server) = self.options.servers.get(attempt.server)
            && told.as_ref() != Some(&why)
        {
            tracing::warn!("MQTT: {server}: {why}; it is tried again");
            *told = Some(why);
        }
    }
}

/// A time between half of a pause and the whole.
fn jittered(pause: Duration) -> Duration {
    let mut byte = [u8::MAX];
    // Without randomness the pause is whole.
    let _ = getrandom::fill(&mut byte);
    pause / 2 + pause / 2 * u32::from(byte[0]) / u32::from(u8::MAX)
}
