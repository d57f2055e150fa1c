//! What waits to be sent. Bounded, without clock and I/O.

use std::collections::{HashMap, VecDeque};

use tokio::{sync::oneshot, time::Instant};

use super::{
    Subscription,
    message::{Message, Qos},
};

/// Topics of state that may wait: above what any daemon has.
const STATES: usize = 1 << 17;
/// Subscriptions that may wait, and that are sent together.
const ASKED: usize = 4_096;
const TOGETHER: usize = 32;
/// Signs of the broker that may be waited for.
const SIGNS: usize = 16;
/// A message whose connection has broken so often while it was on its way is taken for the reason.
const TRIES: u8 = 3;

/// How a message is kept until it is sent, and what becomes of it when the connection is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// State: the newest of its topic is sent. Gone with the connection, for whoever publishes it does so again.
    Latest,
    /// News: in order, and over a loss of the connection. Where there are too many, the oldest are lost.
    InOrder,
    /// In order, in the connection of this number only. Where there are too many, it is not taken.
    OfConnection(u64),
}

/// A message and how it is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Waiting {
    pub(super) message: Message,
    pub(super) kept: Kept,
    tries: u8,
}

/// How the connection is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub connected: bool,
    /// Messages that wait to be sent.
    pub waiting: usize,
    pub sent: u64,
    pub arrived: u64,
    pub lost: Lost,
}

/// Messages that were lost, by the reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lost {
    /// There was no room for them, or for those that came after them.
    pub no_room: u64,
    /// Their time was over before they could be sent.
    pub expired: u64,
    /// The broker takes none of this size, or none to this topic, or was lost again and again with them.
    pub not_taken: u64,
    /// More arrived than could be looked at.
    pub flood: u64,
}

impl Lost {
    /// Each reason, with how many.
    pub const fn by_reason(&self) -> [(&'static str, u64); 4] {
        [
            ("no_room", self.no_room),
            ("expired", self.expired),
            ("not_taken", self.not_taken),
            ("flood", self.flood),
        ]
    }
}

/// What the broker of this connection takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Limits {
    pub(super) qos: Qos,
    pub(super) retain: bool,
    /// Bytes of a message.
    pub(super) size: usize,
}

/// What is asked behind messages, so that its answer shows that the broker has taken them.
#[derive(Debug)]
pub(super) struct Sign {
    pub(super) asked: Subscription,
    pub(super) seen: oneshot::Sender<()>,
}

#[derive(Debug)]
pub(super) struct Queue {
    most: usize,
    news: VecDeque<Waiting>,
    /// How many of them have been handed over or given up, since the beginning.
    passed: u64,
    /// Each with how many messages have to have passed before it is asked.
    signs: VecDeque<(u64, Sign)>,
    /// The topics of `state` in the order in which they are sent.
    order: VecDeque<String>,
    state: HashMap<String, Message>,
    asked: VecDeque<Subscription>,
    connection: Option<u64>,
    counts: Counts,
}

impl Queue {
    pub(super) fn new(most: usize) -> Self {
        let counts = Counts::default();
        Self {
            most,
            news: VecDeque::new(),
            passed: 0,
            signs: VecDeque::new(),
            order: VecDeque::new(),
            state: HashMap::new(),
            asked: VecDeque::new(),
            connection: None,
            counts,
        }
    }

    pub(super) fn push(&mut self, message: Message, kept: Kept) -> bool {
        match kept {
            Kept::Latest => {
                if self.connection.is_none() {
                    return false;
                }
                if let Some(waiting) = self.state.get_mut(&message.topic) {
                    *waiting = message;
                    return true;
                }
                if self.state.len() >= STATES {
                    self.counts.lost.no_room += 1;
                    return false;
                }
                self.order.push_back(message.topic.clone());
                self.state.insert(message.topic.clone(), message);
                return true;
            }
            Kept::OfConnection(number) if self.connection != Some(number) => return false,
            Kept::OfConnection(_) if self.news.len() >= self.most => {
                self.counts.lost.no_room += 1;
                return false;
            }
            Kept::OfConnection(_) => {}
            Kept::InOrder => {
                if self.news.len() >= self.most {
                    self.news.pop_front();
                    self.passed += 1;
                    self.counts.lost.no_room += 1;
                }
            }
        }
        self.news.push_back(Waiting { message, kept, tries: 0 });
        true
    }

    /// The next message: news before state.
    pub(super) fn pop(&mut self, now: Instant, limits: Limits) -> Option<Waiting> {
        loop {
            let mut waiting = match self.news.pop_front() {
                Some(waiting) => {
                    self.passed += 1;
                    waiting
                }
                None => {
                    let message = self.state.remove(&self.order.pop_front()?)?;
                    Waiting { message, kept: Kept::Latest, tries: 0 }
                }
            };
            let message = &mut waiting.message;
            if message.expires.is_some_and(|at| at <= now) {
                self.counts.lost.expired += 1;
            } else if size(message) > limits.size {
                self.counts.lost.not_taken += 1;
            } else {
                message.qos = message.qos.min(limits.qos);
                message.retain &= limits.retain;
                waiting.tries += 1;
                return Some(waiting);
            }
        }
    }

    /// Takes subscriptions of this connection. Above a bound they are lost: who asks does so again after the next connect.
    pub(super) fn ask(&mut self, subscriptions: impl IntoIterator<Item = Subscription>) {
        if self.connection.is_some() {
            let room = ASKED.saturating_sub(self.asked.len());
            self.asked.extend(subscriptions.into_iter().take(room));
        }
    }

    /// Those that are sent next.
    pub(super) fn asked(&self) -> Vec<Subscription> {
        self.asked.iter().take(TOGETHER).cloned().collect()
    }

    /// So many of them have been sent.
    pub(super) fn has_asked(&mut self, number: usize) {
        self.asked.drain(..number.min(self.asked.len()));
    }

    /// Takes a sign that is to be asked behind what waits in order, in this connection. Above a bound it is dropped, which its reader sees.
    pub(super) fn ask_behind(&mut self, sign: Sign) {
        if self.connection.is_some() && self.signs.len() < SIGNS {
            let behind = self.passed + self.news.len() as u64;
            self.signs.push_back((behind, sign));
        }
    }

    /// The next sign before which everything has passed.
    pub(super) fn sign(&mut self) -> Option<Sign> {
        let (behind, _) = self.signs.front()?;
        if *behind > self.passed {
            return None;
        }
        self.signs.pop_front().map(|(_, sign)| sign)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.news.is_empty() && self.order.is_empty()
    }

    pub(super) fn connected(&mut self, number: u64) {
        self.connection = Some(number);
        self.counts.connected = true;
    }

    /// Whether there was a connection.
    pub(super) fn disconnected(&mut self) -> bool {
        self.state.clear();
        self.order.clear();
        self.asked.clear();
        self.signs.clear();
        self.news.retain(|waiting| waiting.kept == Kept::InOrder);
        self.counts.connected = false;
        self.connection.take().is_some()
    }

    /// What was on its way when the connection was lost, the oldest first: news are sent again.
    pub(super) fn take_back(&mut self, on_their_way: VecDeque<Waiting>) {
        for waiting in on_their_way.into_iter().rev().filter(|waiting| waiting.kept == Kept::InOrder) {
            if waiting.tries >= TRIES {
                self.counts.lost.not_taken += 1;
            } else if self.news.len() >= self.most {
                self.counts.lost.no_room += 1;
            } else {
                self.news.push_front(waiting);
            }
        }
    }

    pub(super) fn count_sent(&mut self, taken: bool) {
        let count = if taken { &mut self.counts.sent } else { &mut self.counts.lost.not_taken };
        *count += 1;
    }

    pub(super) fn count_arrived(&mut self, taken: bool) {
        let count = if taken { &mut self.counts.arrived } else { &mut self.counts.lost.flood };
        *count += 1;
    }

    pub(super) fn counts(&self) -> Counts {
        Counts { waiting: self.news.len() + self.order.len(), ..self.counts }
    }
}

/// At least the bytes of a message on the wire.
fn size(message: &Message) -> usize {
    /// Fixed header, packet identifier, expiry and the lengths of the properties.
    const FRAME: usize = 32;
    let Message { topic, payload, properties, .. } = message;
    let texts = [&properties.content_type, &properties.response_topic];
    let texts: usize = texts.into_iter().flatten().map(|text| text.len() + 3).sum();
    let user: usize = properties.user.iter().map(|(name, value)| name.len() + value.len() + 5).sum();
    let correlation = properties.correlation.as_ref().map_or(0, |data| data.len() + 3);
    FRAME + topic.len() + payload.len() + texts + user + correlation
}
