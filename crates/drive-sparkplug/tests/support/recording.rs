//! What went over a connection, and what an edge node said in it.

use super::protobuf::{self, Payload};

/// One packet, as MQTT has it.
#[derive(Debug, Clone)]
pub(crate) enum Packet {
    /// The edge node connects.
    Connect { clean_start: bool, session_expiry: u32, will: Option<Message> },
    /// It subscribes.
    Subscribe { filter: String, qos: u8 },
    /// It publishes.
    Sent(Message),
    /// It is told.
    Heard(Message),
    /// It disconnects.
    Disconnect { reason: u8 },
}

/// A message.
#[derive(Debug, Clone)]
pub(crate) struct Message {
    pub(crate) topic: String,
    pub(crate) payload: Vec<u8>,
    pub(crate) qos: u8,
    pub(crate) retain: bool,
}

/// A message of the edge node, read.
#[derive(Debug, Clone)]
pub(crate) struct Said {
    /// Where it stands among the packets.
    pub(crate) place: usize,
    /// `NBIRTH` and so on.
    pub(crate) verb: String,
    pub(crate) group: String,
    pub(crate) edge_node: String,
    pub(crate) device: Option<String>,
    pub(crate) message: Message,
    pub(crate) payload: Payload,
    /// The number of the connection that it came by, from 0.
    pub(crate) session: usize,
}

/// All of it.
pub(crate) struct Recording {
    pub(crate) packets: Vec<Packet>,
    pub(crate) said: Vec<Said>,
}

impl Recording {
    /// # Panics
    /// A message of the edge node is no payload, or its topic is none of Sparkplug.
    pub(crate) fn of(packets: Vec<Packet>) -> Self {
        let mut session = 0_usize;
        let mut said = Vec::new();
        for (place, packet) in packets.iter().enumerate() {
            match packet {
                Packet::Connect { .. } => session += 1,
                Packet::Sent(message) => said.push(Said::of(place, message, session - 1)),
                _ => {}
            }
        }
        Self { packets, said }
    }

    /// The wills of its connections, in their order.
    pub(crate) fn wills(&self) -> Vec<Option<&Message>> {
        self.packets
            .iter()
            .filter_map(|packet| match packet {
                Packet::Connect { will, .. } => Some(will.as_ref()),
                _ => None,
            })
            .collect()
    }

    /// What was said with this verb.
    pub(crate) fn verb<'a>(&'a self, verb: &'a str) -> impl Iterator<Item = &'a Said> {
        self.said.iter().filter(move |said| said.verb == verb)
    }

    /// The birth that is in force for a message.
    pub(crate) fn birth_of<'a>(&'a self, said: &'a Said) -> Option<&'a Said> {
        let verb = if said.device.is_some() { "DBIRTH" } else { "NBIRTH" };
        let mut before = self.said.iter().rev().filter(|other| other.place < said.place);
        before
            .find(|other| other.verb == verb && other.device == said.device && other.session == said.session)
    }
}

impl Said {
    fn of(place: usize, message: &Message, session: usize) -> Self {
        let levels: Vec<&str> = message.topic.split('/').collect();
        assert!(levels[0] == "spBv1.0" && (4..=5).contains(&levels.len()), "{}", message.topic);
        let payload = protobuf::read(&message.payload);
        Self {
            place,
            verb: levels[2].to_owned(),
            group: levels[1].to_owned(),
            edge_node: levels[3].to_owned(),
            device: levels.get(4).map(|&device| device.to_owned()),
            message: message.clone(),
            payload: payload.unwrap_or_else(|| panic!("no payload on {}", message.topic)),
            session,
        }
    }

    /// Whether it tells data.
    pub(crate) fn is_data(&self) -> bool {
        matches!(self.verb.as_str(), "NDATA" | "DDATA")
    }

    /// Whether it is a birth.
    pub(crate) fn is_birth(&self) -> bool {
        matches!(self.verb.as_str(), "NBIRTH" | "DBIRTH")
    }

    /// A metric by its name.
    pub(crate) fn metric(&self, name: &str) -> Option<&protobuf::Metric> {
        self.payload.metrics.iter().find(|metric| metric.name.as_deref() == Some(name))
    }
}
