//! A second reader of Sparkplug payloads, by the wire format alone: it shares nothing with the crate's own.

use std::collections::BTreeMap;

/// A payload.
#[derive(Debug, Clone, Default)]
pub(crate) struct Payload {
    pub(crate) timestamp: Option<u64>,
    pub(crate) metrics: Vec<Metric>,
    pub(crate) seq: Option<u64>,
}

/// A metric.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Metric {
    pub(crate) name: Option<String>,
    pub(crate) alias: Option<u64>,
    pub(crate) timestamp: Option<u64>,
    pub(crate) data_type: Option<u64>,
    pub(crate) is_historical: bool,
    pub(crate) is_null: bool,
    /// The keys of its properties.
    pub(crate) keys: Vec<String>,
    /// The fields of each of their values.
    pub(crate) properties: Vec<BTreeMap<u64, Field>>,
    /// The number of the field that its value is in, and the value.
    pub(crate) value: Option<(u64, Field)>,
}

/// A field as it travels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Field {
    Varint(u64),
    Fixed64(u64),
    Fixed32(u32),
    Bytes(Vec<u8>),
}

impl Field {
    fn number(&self) -> Option<u64> {
        if let Self::Varint(number) = self { Some(*number) } else { None }
    }

    fn text(&self) -> Option<String> {
        if let Self::Bytes(bytes) = self { String::from_utf8(bytes.clone()).ok() } else { None }
    }

    fn bytes(&self) -> Option<&[u8]> {
        if let Self::Bytes(bytes) = self { Some(bytes) } else { None }
    }
}

impl Metric {
    /// Its value, where it is a text.
    pub(crate) fn text(&self) -> Option<String> {
        self.value.as_ref()?.1.text()
    }

    /// Its value, where it is an integer or a truth.
    pub(crate) fn number(&self) -> Option<u64> {
        self.value.as_ref()?.1.number()
    }

    /// Its value, where it is a Double.
    pub(crate) fn double(&self) -> Option<f64> {
        if let Field::Fixed64(bits) = self.value.as_ref()?.1 { Some(f64::from_bits(bits)) } else { None }
    }

    /// Its quality, where it tells one.
    pub(crate) fn quality(&self) -> Option<u64> {
        let place = self.keys.iter().position(|key| key == "Quality")?;
        self.properties.get(place)?.get(&3)?.number()
    }
}

/// Reads a payload; `None`: it is none.
pub(crate) fn read(bytes: &[u8]) -> Option<Payload> {
    let mut payload = Payload::default();
    for (number, field) in fields(bytes)? {
        match number {
            1 => payload.timestamp = Some(field.number()?),
            2 => payload.metrics.push(metric(field.bytes()?)?),
            3 => payload.seq = Some(field.number()?),
            _ => {}
        }
    }
    Some(payload)
}

fn metric(bytes: &[u8]) -> Option<Metric> {
    let mut metric = Metric::default();
    for (number, field) in fields(bytes)? {
        match number {
            1 => metric.name = Some(field.text()?),
            2 => metric.alias = Some(field.number()?),
            3 => metric.timestamp = Some(field.number()?),
            4 => metric.data_type = Some(field.number()?),
            5 => metric.is_historical = field.number()? != 0,
            7 => metric.is_null = field.number()? != 0,
            9 => {
                for (number, field) in fields(field.bytes()?)? {
                    match number {
                        1 => metric.keys.push(field.text()?),
                        2 => metric.properties.push(fields(field.bytes()?)?.into_iter().collect()),
                        _ => {}
                    }
                }
            }
            10..=19 => metric.value = Some((number, field)),
            _ => {}
        }
    }
    Some(metric)
}

fn fields(mut bytes: &[u8]) -> Option<Vec<(u64, Field)>> {
    let mut all = Vec::new();
    while !bytes.is_empty() {
        let tag = varint(&mut bytes)?;
        let field = match tag & 7 {
            0 => Field::Varint(varint(&mut bytes)?),
            1 => Field::Fixed64(u64::from_le_bytes(take(&mut bytes, 8)?.try_into().ok()?)),
            2 => {
                let len = varint(&mut bytes)?;
                Field::Bytes(take(&mut bytes, usize::try_from(len).ok()?)?.to_vec())
            }
            5 => Field::Fixed32(u32::from_le_bytes(take(&mut bytes, 4)?.try_into().ok()?)),
            _ => return None,
        };
        all.push((tag >> 3, field));
    }
    Some(all)
}

fn take<'a>(bytes: &mut &'a [u8], len: usize) -> Option<&'a [u8]> {
    let (head, tail) = bytes.split_at_checked(len)?;
    *bytes = tail;
    Some(head)
}

fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let byte = take(bytes, 1)?[0];
        number |= u64::from(byte & 0x7F) << shift;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}
