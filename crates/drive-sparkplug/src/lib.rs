//! A Sparkplug B 3.0 edge node as a pure machine: what it says to hosts over MQTT, and when.
//!
//! [`EdgeNode`] has no clock, no socket and no task. Its caller owns the connection, hands in what happens, and carries out
//! each [`Action`] in the order in which it gets them. So the numbers of the messages have no gap by construction, a whole
//! session is a test without waiting, and any MQTT client will do.
//!
//! ```
//! use std::time::{Duration, Instant};
//!
//! use drive_sparkplug::{
//!     Action, BdSeq, DataType, Definition, EdgeNode, Id, NodeName, Now, Quality, Reading, Settings, Value,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let now = Now { at: Instant::now(), unix_ms: 1_700_000_000_000 };
//! let settings = Settings {
//!     name: NodeName { group: Id::new("plant")?, edge_node: Id::new("hall 1")? },
//!     primary_host: None,
//!     has_other_servers: false,
//!     rebirth_pause: Duration::from_secs(5),
//!     commands: true,
//! };
//!
//! // The number after the one that was kept, and kept again before it is used.
//! let bd_seq = BdSeq::default();
//! let will = EdgeNode::will(&settings.name, bd_seq, now);
//! assert_eq!(will.topic, "spBv1.0/plant/NDEATH/hall 1");
//! let mut node = EdgeNode::new(settings, Vec::new(), now)?;
//! node.add_device("pump 1", vec![Definition::new("Speed", DataType::Double)], now)?;
//! assert_eq!(node.subscriptions()[1].filter, "spBv1.0/plant/DCMD/hall 1/+");
//! node.handle_connected(bd_seq);
//!
//! let reading = Reading { value: Some(Value::Double(890.0)), quality: Quality::Good, unix_ms: now.unix_ms };
//! node.set_device("pump 1", "Speed", reading)?;
//! node.set_present("pump 1", true);
//! let mut topics = Vec::new();
//! while let Some(Action::Publish(publication)) = node.poll(now) {
//!     topics.push(publication.topic);
//! }
//! assert_eq!(topics, ["spBv1.0/plant/NBIRTH/hall 1", "spBv1.0/plant/DBIRTH/hall 1/pump 1"]);
//! # Ok(())
//! # }
//! ```
//!
//! # How it keeps the specification
//! - The will is the death of the node with the [`BdSeq`] of its connection; births repeat that number. The caller keeps it
//!   over restarts.
//! - Births, data and deaths of devices are numbered 0 to 255 together, the birth of the node with 0.
//! - A birth tells every metric there is: name, alias, type, time, quality, and a value or that there is none. Data tell
//!   aliases, times and values that have changed, and a quality where it has. `bdSeq` and `Node Control/Rebirth` have no
//!   alias and are never data.
//! - A device is born when it answers and dies when it does not; one that has never answered is not spoken of.
//! - Whoever asks for the births gets all of them. From the request to them no data are sent. A host that asks again and
//!   again gets them once in each [`Settings::rebirth_pause`].
//! - With a primary host nothing is said before it is online. When it goes, the node dies, and begins again at the next
//!   server. A state that is older than one that this connection has brought is nothing.
//! - What is told of the past is historical, with its own time and quality, and changes nothing of what is so now.
//! - Leaving is the node's death and a DISCONNECT by which the server sends the will too.
//!
//! # Hostile payloads
//! [`Payload::decode`] takes any bytes: [`LONGEST_PAYLOAD`] and [`MOST_METRICS`] bound it, and what could nest is skipped
//! without being looked into. A metric that no birth has told, of another type, or no number, is a [`WriteError`].
//!
//! # Not carried
//! Templates, data sets, arrays, files and metadata; the part of a host. Nothing is stored for later: whoever keeps values tells them
//! by [`EdgeNode::past`].
//!
//! # Sources
//! Eclipse Sparkplug Specification 3.0.0, chapters 4 to 6. `tests/rules.rs` has a test for each of its numbered assertions
//! (`tck-id-…`) that can be seen in what an edge node sends.

#![forbid(unsafe_code)]

mod bd_seq;
mod host;
mod metrics;
mod node;
mod payload;
mod topic;
mod value;
mod wire;

/// The examples of the README, which compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use self::{
    bd_seq::BdSeq,
    metrics::{Definition, MetricError, Reading},
    node::{
        Action, Command, DeviceError, EdgeNode, Event, Ignored, Now, PastError, Publication, Settings,
        Subscription, Write, WriteError,
    },
    payload::{LONGEST_PAYLOAD, MOST_METRICS, Malformed, Metric, Payload},
    topic::{Id, IdError, NodeName},
    value::{DataType, Quality, Raw, Value},
};
