//! What the requests beyond reading and writing carry (VVDED397054 p. 11–13/35–37).

/// What a slave says of itself, in the reply to [`IDENTIFICATION`](crate::code::IDENTIFICATION).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identification {
    /// 18h: Altivar.
    pub product: u8,
    /// 58h: Altivar 58.
    pub subtype: u8,
    /// Two decimal digits: 21h is V2.1.
    pub version: u8,
    /// The drive's rating, such as `ATV58U18N4`. What is not ASCII is replaced.
    pub rating: String,
}

impl Identification {
    /// That of a whole reply; `None` when it is not whole.
    #[must_use]
    pub fn from_reply(reply: &[u8]) -> Option<Self> {
        match *reply {
            [_, product, subtype, version, len, ref text @ ..] if text.len() == usize::from(len) => {
                let rating = String::from_utf8_lossy(text).into_owned();
                Some(Self { product, subtype, version, rating })
            }
            _ => None,
        }
    }
}

/// The four counters of a slave's link. Each stops at 32 767.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct LinkCounters {
    /// Messages that it sent and nobody acknowledged.
    pub sent_not_acknowledged: u16,
    /// Messages that it sent and the master refused.
    pub sent_refused: u16,
    /// Messages that it received and did not acknowledge.
    pub received_not_acknowledged: u16,
    /// Messages that it received and refused.
    pub received_refused: u16,
}

impl LinkCounters {
    /// Those of a whole reply to [`READ_COUNTERS`](crate::code::READ_COUNTERS); `None` when it has not four words.
    #[must_use]
    pub fn from_reply(reply: &[u8]) -> Option<Self> {
        let [sent_not_acknowledged, sent_refused, received_not_acknowledged, received_refused] =
            words(reply, 1)?;
        Some(Self { sent_not_acknowledged, sent_refused, received_not_acknowledged, received_refused })
    }
}

/// What the specific request writes, in the drive's own counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SpecificCommand {
    /// `CMD`, the control word.
    pub cmd: u16,
    /// `FRH`, the frequency reference.
    pub frh: u16,
    /// `ACC`, the acceleration ramp.
    pub acc: u16,
    /// `DEC`, the deceleration ramp.
    pub dec: u16,
}

impl SpecificCommand {
    /// The body of its request, [`SPECIFIC`](crate::code::SPECIFIC).
    #[must_use]
    pub fn body(self) -> [u8; 10] {
        let mut body = [0; 10];
        let words = [self.cmd, self.frh, self.acc, self.dec].map(u16::to_le_bytes);
        // Two bytes in front of the words are reserved.
        for (to, from) in body.iter_mut().skip(2).zip(words.as_flattened()) {
            *to = *from;
        }
        body
    }
}

/// What the specific request reads back, in the drive's own counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SpecificReport {
    /// `FRH`, the frequency reference.
    pub frh: u16,
    /// `ETA`, the status register.
    pub eta: u16,
    /// `FLT`, the fault register.
    pub flt: u16,
    /// `LCR`, the motor current.
    pub lcr: u16,
}

impl SpecificReport {
    /// That of a whole reply; `None` when it is another reply.
    #[must_use]
    pub fn from_reply(reply: &[u8]) -> Option<Self> {
        // Its own code is followed by that of the specific reply and a reserved byte.
        if reply.get(1) != Some(&0x30) {
            return None;
        }
        let [frh, eta, flt, lcr] = words(reply, 3)?;
        Some(Self { frh, eta, flt, lcr })
    }
}

/// The four words of a reply, from this byte on.
fn words(reply: &[u8], from: usize) -> Option<[u16; 4]> {
    match reply.get(from..) {
        Some(&[a, b, c, d, e, f, g, h]) => Some([[a, b], [c, d], [e, f], [g, h]].map(u16::from_le_bytes)),
        _ => None,
    }
}
