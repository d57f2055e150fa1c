//! What is published and what arrives, in words of our own.

use bytes::Bytes;
use tokio::time::Instant;

/// How often a message is delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Qos {
    /// At most once: lost with the connection.
    AtMostOnce = 0,
    /// Until the broker has acknowledged it.
    AtLeastOnce = 1,
}

/// A message to be published.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    pub topic: String,
    pub payload: Bytes,
    pub qos: Qos,
    pub retain: bool,
    /// When it is over: it is not sent any more, and the broker delivers it no longer.
    pub expires: Option<Instant>,
    pub properties: Properties,
}

impl Message {
    /// A message that is delivered at least once, to those who listen now.
    pub fn new(topic: impl Into<String>, payload: impl Into<Bytes>) -> Self {
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
    pub fn retained(self) -> Self {
        Self { retain: true, ..self }
    }
}

/// The properties of MQTT v5 that are of use here.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Properties {
    pub content_type: Option<String>,
    pub response_topic: Option<String>,
    pub correlation: Option<Bytes>,
    pub user: Vec<(String, String)>,
}

/// A message that has arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrived {
    pub topic: String,
    pub payload: Bytes,
    /// As it was published, and at the most as it is subscribed.
    pub qos: Qos,
    /// It was published to be retained, whether it was kept or has come straight.
    pub retain: bool,
    /// It may have arrived before.
    pub repeated: bool,
    pub at: Instant,
    /// What is left of its expiry, in seconds.
    pub expires_in_s: Option<u32>,
    pub properties: Properties,
}
