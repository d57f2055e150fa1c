//! What is published and what arrives, in words of our own.

use axum::body::Bytes;
use tokio::time::Instant;

/// How often a message is delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Qos {
    /// At most once: lost with the connection.
    AtMostOnce = 0,
    /// Until the broker has acknowledged it.
    AtLeastOnce = 1,
}

/// A message to be published.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) topic: String,
    pub(crate) payload: Bytes,
    pub(crate) qos: Qos,
    pub(crate) retain: bool,
    /// When it is over: it is not sent any more, and the broker delivers it no longer.
    pub(crate) expires: Option<Instant>,
    pub(crate) properties: Properties,
}

impl Message {
    /// A message that is delivered at least once, to those who listen now.
    pub(crate) fn new(topic: impl Into<String>, payload: impl Into<Bytes>) -> Self {
        Self {
            topic: topic.into(),
            payload: payload.into(),
            qos: Qos::AtLeastOnce,
            retain: false,
            expires: None,
            properties: Properties::default(),
        }
    }

    /// The same, kept by the broker for those who listen later.
    pub(crate) fn retained(self) -> Self {
        Self { retain: true, ..self }
    }
}

/// The properties of MQTT v5 that are of use here.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Properties {
    pub(crate) content_type: Option<String>,
    pub(crate) response_topic: Option<String>,
    pub(crate) correlation: Option<Bytes>,
    pub(crate) user: Vec<(String, String)>,
}

/// A message that has arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Arrived {
    pub(crate) topic: String,
    pub(crate) payload: Bytes,
    /// As it was published, and at the most as it is subscribed.
    pub(crate) qos: Qos,
    /// It was published to be retained, whether it was kept or has come straight.
    pub(crate) retain: bool,
    /// It may have arrived before.
    pub(crate) repeated: bool,
    pub(crate) at: Instant,
    /// What is left of its expiry, in seconds.
    pub(crate) expires_in_s: Option<u32>,
    pub(crate) properties: Properties,
}
