//! Payloads: metrics with a time and a number, to bytes and back.

use prost::Message as _;

use crate::{Quality, Raw, wire};

/// The longest payload that is read, in bytes: the births of an edge node with hundreds of metrics are shorter.
pub const LONGEST_PAYLOAD: usize = 65_536;
/// The most metrics that are read from a payload.
pub const MOST_METRICS: usize = 2_000;

/// The property that has a metric's quality.
const QUALITY: &str = "Quality";
/// Int32, the type of that property.
const INT32: u32 = crate::DataType::Int32.code();

/// A payload: what one message says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Payload {
    /// When it was sent, in milliseconds since 1970, UTC.
    pub timestamp: Option<u64>,
    /// Its number among the messages of its edge node, 0 to 255; none in a death of the node and in commands.
    pub seq: Option<u64>,
    /// What it says.
    pub metrics: Vec<Metric>,
}

/// One metric of a payload.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Metric {
    /// Its name; data and commands may have the alias alone.
    pub name: Option<String>,
    /// Its number, as the birth has told it.
    pub alias: Option<u64>,
    /// When it had this value, in milliseconds since 1970, UTC.
    pub timestamp: Option<u64>,
    /// The number of its type, see [`crate::DataType`]; others than ours may have any.
    pub data_type: Option<u32>,
    /// Whether it is of the past and says nothing of now.
    pub is_historical: bool,
    /// Whether it says that there is no value.
    pub is_null: bool,
    /// Its value.
    pub value: Option<Raw>,
    /// Its quality, where the payload tells one that is defined.
    pub quality: Option<Quality>,
}

/// Why bytes are no payload that is read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Malformed {
    /// It is longer than [`LONGEST_PAYLOAD`].
    #[error("a payload of {0} bytes: expected {LONGEST_PAYLOAD} at the most")]
    TooLong(usize),
    /// It has more than [`MOST_METRICS`].
    #[error("a payload of {0} metrics: expected {MOST_METRICS} at the most")]
    TooManyMetrics(usize),
    /// It is not Protocol Buffers, or not this message.
    #[error("not a Sparkplug payload: {0}")]
    NotProtobuf(String),
}

impl Payload {
    /// Its bytes.
    pub fn encode(&self) -> Vec<u8> {
        let metrics = self.metrics.iter().map(Metric::to_wire).collect();
        wire::Payload { timestamp: self.timestamp, metrics, seq: self.seq }.encode_to_vec()
    }

    /// Reads bytes, whatever they are.
    ///
    /// # Errors
    /// [`Malformed`], when they are too many or no payload.
    pub fn decode(bytes: &[u8]) -> Result<Self, Malformed> {
        if bytes.len() > LONGEST_PAYLOAD {
            return Err(Malformed::TooLong(bytes.len()));
        }
        let payload =
            wire::Payload::decode(bytes).map_err(|error| Malformed::NotProtobuf(error.to_string()))?;
        if payload.metrics.len() > MOST_METRICS {
            return Err(Malformed::TooManyMetrics(payload.metrics.len()));
        }
        let metrics = payload.metrics.into_iter().map(Metric::of_wire).collect();
        Ok(Self { timestamp: payload.timestamp, seq: payload.seq, metrics })
    }
}

impl Metric {
    fn to_wire(&self) -> wire::Metric {
        let quality = |quality: Quality| wire::PropertySet {
            keys: vec![QUALITY.to_owned()],
            values: vec![wire::PropertyValue { kind: Some(INT32), int: Some(quality.code()) }],
        };
        wire::Metric {
            name: self.name.clone(),
            alias: self.alias,
            timestamp: self.timestamp,
            datatype: self.data_type,
            is_historical: self.is_historical.then_some(true),
            is_null: self.is_null.then_some(true),
            properties: self.quality.map(quality),
            value: self.value.as_ref().and_then(Raw::to_wire),
        }
    }

    fn of_wire(metric: wire::Metric) -> Self {
        let properties = metric.properties.unwrap_or_default();
        let quality = properties.keys.iter().position(|key| key == QUALITY);
        let quality = quality.and_then(|place| properties.values.get(place)?.int);
        Self {
            name: metric.name,
            alias: metric.alias,
            timestamp: metric.timestamp,
            data_type: metric.datatype,
            is_historical: metric.is_historical.unwrap_or_default(),
            is_null: metric.is_null.unwrap_or_default(),
            value: metric.value.map(Raw::of_wire),
            quality: quality.and_then(Quality::of),
        }
    }
}

impl Raw {
    fn to_wire(&self) -> Option<wire::MetricValue> {
        Some(match self {
            Self::Int(bits) => wire::MetricValue::Int(*bits),
            Self::Long(bits) => wire::MetricValue::Long(*bits),
            Self::Float(number) => wire::MetricValue::Float(*number),
            Self::Double(number) => wire::MetricValue::Double(*number),
            Self::Boolean(truth) => wire::MetricValue::Boolean(*truth),
            Self::String(text) => wire::MetricValue::String(text.clone()),
            Self::Other => return None,
        })
    }

    fn of_wire(value: wire::MetricValue) -> Self {
        match value {
            wire::MetricValue::Int(bits) => Self::Int(bits),
            wire::MetricValue::Long(bits) => Self::Long(bits),
            wire::MetricValue::Float(number) => Self::Float(number),
            wire::MetricValue::Double(number) => Self::Double(number),
            wire::MetricValue::Boolean(truth) => Self::Boolean(truth),
            wire::MetricValue::String(text) => Self::String(text),
            wire::MetricValue::Bytes(_)
            | wire::MetricValue::DataSet(_)
            | wire::MetricValue::Template(_)
            | wire::MetricValue::Extension(_) => Self::Other,
        }
    }
}
