//! UNI-TELWAY in words: the link's polls and signals, and the UNI-TE requests and replies that its data frames carry
//! (VVDED397054 p. 11–13/35–37). Words are little-endian.

use std::collections::BTreeMap;

use bytes::Bytes;
use drive_bus::{
    content::Signal,
    unite::{Identification, LinkCounters, SpecificReport, code, unite_of},
};
use drive_families::Family;

use super::{
    Counts, Said, hex,
    pdu::{counted, run, span, written},
    words::Words,
};

/// Segment of internal words, and the type of a 16-bit word.
const WORDS: [u8; 2] = [0x68, 0x07];
/// The codes of replies that are no request's code and 30h.
const REFUSED: u8 = 0xFD;
const DONE: u8 = 0xFE;
const MIRRORED: u8 = 0xFB;
/// Behind the code of the specific reply.
const SPECIFIC_REPLY: u8 = 0x30;

/// How many words the specific request has: command, reference, acceleration, deceleration (p. 13/37).
const COMMAND: usize = 4;
/// The control word's register (p. 13/37, 21/45).
const CMD: u16 = 400;

/// The conversations of a line: several requests may wait for their replies.
#[derive(Debug, Default)]
pub(super) struct Telway {
    asked: BTreeMap<u8, Asked>,
    /// To whom the last data frame of the master went, until a word comes to it.
    sent_to: Option<u8>,
}

/// What was asked.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Asked {
    Read { first: u16, quantity: u16 },
    Write { first: u16, words: Vec<u16> },
    Specific { words: [u16; COMMAND] },
    Mirror(Bytes),
    Other { code: u8, body: Bytes },
}

impl Telway {
    pub(super) fn poll(&mut self) -> Said {
        self.sent_to = None;
        Said::text("poll: the slave may speak")
    }

    pub(super) fn signal(&mut self, signal: Signal) -> Said {
        let sent_to = self.sent_to.take();
        match signal {
            Signal::Taken => Said::text("ACK: taken"),
            Signal::NothingToSay => Said::text("EOT: nothing to say"),
            Signal::Refused => {
                // What the slave has not taken it will not answer.
                sent_to.and_then(|slave| self.asked.remove(&slave));
                Said::text("NAK: once more")
            }
        }
    }

    /// A data frame. `sent`: it is the master's, where that is known.
    pub(super) fn message(
        &mut self,
        (slave, message): (u8, &Bytes),
        sent: Option<bool>,
        family: Option<Family>,
        seen: &mut Words,
        counts: &mut Counts,
    ) -> Said {
        self.sent_to = None;
        let unite = match unite_of(message) {
            Some(Ok(unite)) => unite,
            Some(Err(_)) => {
                self.asked.remove(&slave);
                return Said::trouble(
                    "the network's own answer",
                    "the network could not deliver the request",
                );
            }
            None => {
                return Said::trouble(format!("data {}", hex(message)), "a network header that is not known");
            }
        };
        if sent.unwrap_or_else(|| !is_reply(&unite)) {
            counts.requests += 1;
            self.sent_to = Some(slave);
            let asked = Asked::of(&unite);
            let said = asked.said(family, slave, seen);
            // A frame whose acknowledgement was lost is sent again.
            let before = self.asked.insert(slave, asked.clone()).filter(|before| *before != asked);
            counts.unanswered += u64::from(before.is_some());
            return said;
        }
        match self.asked.remove(&slave) {
            Some(asked) => {
                let is_refusal = unite.first() == Some(&REFUSED);
                let count = if is_refusal { &mut counts.exceptions } else { &mut counts.answers };
                *count += 1;
                asked.replied(&unite, family, slave, seen)
            }
            None if counts.requests == 0 => Said::text(format!("replies {}", hex(&unite))),
            None => Said::trouble(format!("replies {}", hex(&unite)), "nobody had asked for it"),
        }
    }

    /// How many requests wait for their replies.
    pub(super) fn waiting(&self) -> u64 {
        u64::try_from(self.asked.len()).unwrap_or(u64::MAX)
    }
}

/// Whether this can only be a reply.
fn is_reply(unite: &[u8]) -> bool {
    matches!(
        unite,
        [REFUSED | DONE | MIRRORED | 0x34 | 0x3F | 0x60 | 0x66 | 0xD2, ..]
            | [code::SPECIFIC, SPECIFIC_REPLY, 0, ..]
    )
}

impl Asked {
    fn of(unite: &Bytes) -> Self {
        match **unite {
            [code::READ_WORD, _, a, b] => Self::Read { first: word([a, b]), quantity: 1 },
            [code::READ_OBJECTS, _, segment, kind, a, b, c, d] if [segment, kind] == WORDS => {
                Self::Read { first: word([a, b]), quantity: word([c, d]) }
            }
            [code::WRITE_WORD, _, a, b, c, d] => {
                Self::Write { first: word([a, b]), words: vec![word([c, d])] }
            }
            [code::WRITE_OBJECTS, _, segment, kind, a, b, c, d, ref data @ ..]
                if [segment, kind] == WORDS && data.len() == 2 * usize::from(word([c, d])) =>
            {
                Self::Write { first: word([a, b]), words: words(data) }
            }
            [code::SPECIFIC, _, 0, 0, a, b, c, d, e, f, g, h] => {
                Self::Specific { words: [[a, b], [c, d], [e, f], [g, h]].map(word) }
            }
            [code::MIRROR, _, ..] => Self::Mirror(unite.slice(2..)),
            [code, _, ..] => Self::Other { code, body: unite.slice(2..) },
            _ => Self::Other { code: unite.first().copied().unwrap_or_default(), body: Bytes::new() },
        }
    }

    /// It in a few words, without what it carries.
    fn short(&self) -> String {
        match self {
            Self::Read { first, quantity } => {
                format!("read of {} from {first}", counted(usize::from(*quantity)))
            }
            Self::Write { first, words } => format!("write of {} to {first}", counted(words.len())),
            Self::Specific { .. } => "specific request".to_owned(),
            Self::Mirror(_) => "mirror request".to_owned(),
            Self::Other { code, .. } => format!("request {code:02X}h"),
        }
    }

    fn said(&self, family: Option<Family>, slave: u8, seen: &mut Words) -> Said {
        match self {
            Self::Read { first, quantity } => {
                Said::text(format!("reads {}", span(family, *first, *quantity)))
            }
            Self::Write { first, words } => written("writes", family, slave, &run(*first, words), seen),
            Self::Specific { words } => {
                let [cmd, frh, acc, dec] = *words;
                let details = seen.told(family, slave, CMD, cmd).detail.into_iter().collect();
                let text = format!("commands CMD {cmd:04X}h, FRH {frh}, ACC {acc}, DEC {dec}");
                Said { details, ..Said::text(text) }
            }
            Self::Mirror(data) => Said::text(format!("asks to mirror {}", hex(data))),
            Self::Other { code, body } => {
                let body = if body.is_empty() { String::new() } else { format!(": {}", hex(body)) };
                Said::text(match *code {
                    code::IDENTIFICATION => "asks who it is".to_owned(),
                    code::PROTOCOL_VERSION => "asks for the version of its protocol".to_owned(),
                    code::READ_COUNTERS => "reads the error counters of its link".to_owned(),
                    code::CLEAR_COUNTERS => "sets the error counters of its link to 0".to_owned(),
                    other => format!("request {other:02X}h of UNI-TE, not known here{body}"),
                })
            }
        }
    }

    /// What is replied to it.
    fn replied(&self, reply: &Bytes, family: Option<Family>, slave: u8, seen: &mut Words) -> Said {
        let other = || Said::trouble(format!("replies {}", hex(reply)), "it does not fit the request");
        match (self, &**reply) {
            // Its cause is one byte, of which the manual prints no number (p. 13/37).
            (_, [REFUSED, ..]) => Said::trouble(
                format!("refuses the {}", self.short()),
                "negative reply FDh: the manual names a wrong number of parameters as its cause",
            ),
            (Self::Read { first, quantity: 1 }, [0x34, data @ ..]) if data.len() == 2 => {
                written("replies", family, slave, &run(*first, &words(data)), seen)
            }
            (Self::Read { first, quantity }, [0x66, 0x07, data @ ..])
                if data.len() == 2 * usize::from(*quantity) =>
            {
                written("replies", family, slave, &run(*first, &words(data)), seen)
            }
            (Self::Write { .. } | Self::Other { code: code::CLEAR_COUNTERS, .. }, [DONE]) => {
                Said::text("done")
            }
            (Self::Mirror(sent), [MIRRORED, data @ ..]) if sent == data => {
                Said::text(format!("mirrors {}", hex(data)))
            }
            (Self::Specific { .. }, _) => match SpecificReport::from_reply(reply) {
                Some(SpecificReport { frh, eta, flt, lcr }) => {
                    Said::text(format!("reports FRH {frh}, ETA {eta:04X}h, FLT {flt:04X}h, LCR {lcr}"))
                }
                None => other(),
            },
            (Self::Other { code: code::IDENTIFICATION, .. }, [0x3F, ..]) => identified(reply),
            (Self::Other { code: code::READ_COUNTERS, .. }, [0xD2, ..]) => counters(reply),
            (Self::Other { code, .. }, [answered, data @ ..]) if *answered == code.wrapping_add(0x30) => {
                Said::text(format!("replies {}", hex(data)))
            }
            _ => other(),
        }
    }
}

fn identified(reply: &[u8]) -> Said {
    let Some(Identification { product, subtype, version, rating }) = Identification::from_reply(reply) else {
        return Said::trouble(format!("replies {}", hex(reply)), "an identification that is not whole");
    };
    let product = match (product, subtype) {
        (0x18, 0x58) => "Altivar 58".to_owned(),
        (0x18, subtype) => format!("Altivar, sub-type {subtype:02X}h"),
        (product, subtype) => format!("product {product:02X}h, sub-type {subtype:02X}h"),
    };
    // Two decimal digits: 21h is V2.1.
    let version = format!("V{:X}.{:X}", version >> 4, version & 0x0F);
    Said::text(format!("is {product}, {version}, {}", rating.escape_debug()))
}

fn counters(reply: &[u8]) -> Said {
    match LinkCounters::from_reply(reply) {
        Some(LinkCounters {
            sent_not_acknowledged,
            sent_refused,
            received_not_acknowledged,
            received_refused,
        }) => Said::text(format!(
            "has counted: sent and not acknowledged {sent_not_acknowledged}, sent and refused {sent_refused}, \
                 received and not acknowledged {received_not_acknowledged}, received and refused {received_refused}"
        )),
        None => Said::trouble(format!("replies {}", hex(reply)), "error counters that are not four words"),
    }
}

fn word(bytes: [u8; 2]) -> u16 {
    u16::from_le_bytes(bytes)
}

fn words(data: &[u8]) -> Vec<u16> {
    data.as_chunks::<2>().0.iter().map(|pair| word(*pair)).collect()
}
