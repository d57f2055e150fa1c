//! What goes into an edge node, and what comes out of it.

use std::time::Instant;

use crate::{Id, IdError, Malformed, MetricError, NodeName, Value};

/// Now, by both clocks: the one that never jumps decides, the other is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Now {
    /// For what is waited for.
    pub at: Instant,
    /// For what is sent: milliseconds since 1970, UTC.
    pub unix_ms: u64,
}

/// How an edge node behaves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// Its name.
    pub name: NodeName,
    /// The host without which it says nothing; `None`: it speaks to whoever listens.
    pub primary_host: Option<Id>,
    /// Whether there is more than one server: then a server whose primary host is offline is left for the next one.
    pub has_other_servers: bool,
    /// The shortest time between two births that a host asks for. Whoever asks more often is answered when it is over.
    pub rebirth_pause: std::time::Duration,
    /// Whether anything of a device can be written: then its commands are subscribed.
    pub commands: bool,
}

/// A message to publish. None is ever retained.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Publication {
    /// Its topic.
    pub topic: String,
    /// Its bytes.
    pub payload: Vec<u8>,
    /// Its quality of service: 1 for the death of the node, else 0.
    pub qos: u8,
}

/// Topics to subscribe with quality of service 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subscription {
    /// The topics, as MQTT filters them.
    pub filter: String,
    /// Whether a retained message is wanted: a host's state is retained, a command must not be (with MQTT 5: Retain
    /// Handling 2, and Retain As Published so that one is recognised).
    pub wants_retained: bool,
}

/// What is to be done, in this order and once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Publish. What cannot be published is not left out: end the connection instead, else the numbers have a gap.
    Publish(Publication),
    /// Disconnect; with MQTT 5 by the reason 0x04, Disconnect with Will Message. `reconnect`: to the next server, or to the
    /// same where there is one.
    Disconnect {
        /// Whether a new session is to begin.
        reconnect: bool,
    },
}

/// What was heard.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A host wants the births again; they come by themselves.
    RebirthAsked,
    /// The primary host is there.
    HostOnline,
    /// The primary host has gone.
    HostOffline,
    /// Somebody writes metrics.
    Command(Command),
    /// It was nothing that could be used.
    Ignored(Ignored),
}

/// Metrics that somebody writes.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// The device; `None`: the node.
    pub device: Option<Id>,
    /// When the host has sent it, by the host's clock, in milliseconds since 1970.
    pub timestamp: Option<u64>,
    /// Whether a broker has kept it: it may be of any age, and must not be obeyed.
    pub is_retained: bool,
    /// What is written, one by one.
    pub writes: Vec<Result<Write, WriteError>>,
}

/// A value for a metric, of the metric's type.
#[derive(Debug, Clone, PartialEq)]
pub struct Write {
    /// The metric's name, also where it was written by its alias.
    pub name: String,
    /// The value.
    pub value: Value,
    /// When it was so, by the host's clock, where the metric says it: it may be older than what carries it.
    pub timestamp: Option<u64>,
}

/// Why a metric of a command is not written.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// Neither its name nor its alias was in a birth.
    #[error("no birth has told of a metric {0}")]
    Unknown(String),
    /// There is no value, or one of another type.
    #[error("metric {0:?} has no value of its type")]
    NotItsType(String),
    /// It says that it is of the past, and this.
    #[error("metric {:?} is of the past", .0.name)]
    Historical(Write),
}

/// Why a message is not used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Ignored {
    /// It is for somebody else.
    #[error("a message on {0:?}, which is not of this node")]
    NotOurs(String),
    /// Its bytes are no payload.
    #[error(transparent)]
    Malformed(#[from] Malformed),
    /// The state of a host that is no JSON with `online` and `timestamp`.
    #[error("a state of the primary host that has not online and timestamp: {0}")]
    NotAState(String),
    /// A state older than what is known.
    #[error("an outdated state of the primary host")]
    Outdated,
    /// A retained request for a birth: it would come again with every connection.
    #[error("a retained request for a birth")]
    RetainedRebirth,
}

/// Why nothing of the past can be told of a device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PastError {
    /// Its birth has not been told in this session, or births have been asked for.
    #[error("the birth of {0:?} has not been told")]
    NotBorn(String),
    /// One of the metrics is none of its birth, or of another type.
    #[error(transparent)]
    Metric(#[from] MetricError),
}

/// Why a device cannot be added.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// Its name cannot be in a topic.
    #[error(transparent)]
    Id(#[from] IdError),
    /// Its name differs from another's in nothing but case.
    #[error("there is already a device {0:?}: expected a name that differs in more than case")]
    Taken(String),
    /// One of its metrics is wrong.
    #[error(transparent)]
    Metric(#[from] MetricError),
}
