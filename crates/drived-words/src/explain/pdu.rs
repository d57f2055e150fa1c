//! Requests and answers of Modbus in words (MODBUS Application Protocol V1.1b3).

use drive_core::ExceptionMeaning;
use drive_families::Family;

use super::{
    Said, hex,
    words::{Words, name},
};

/// Set in the function code of an exception.
const EXCEPTION: u8 = 0x80;

/// Encapsulated interface, by which a device is identified.
const IDENTIFICATION: u8 = 0x2B;

/// What was asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Asked {
    /// Functions 03h and 04h.
    Read { function: u8, first: u16, quantity: u16 },
    /// Functions 06h and 10h.
    Write { function: u8, first: u16, words: Vec<u16> },
    /// Function 17h.
    ReadWrite { read: (u16, u16), first: u16, words: Vec<u16> },
    /// Function 08h.
    Diagnostics { code: u16, data: Vec<u8> },
    /// Function 2Bh with 0Eh.
    Identification { code: u8, object: u8 },
    /// Anything else.
    Other { function: u8, data: Vec<u8> },
}

/// What was answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Answer {
    Words {
        first: u16,
        words: Vec<u16>,
    },
    Done,
    Identification(Vec<(u8, String)>),
    Exception(u8),
    /// The refusal of an identification by its own code (the Altivar 312's Modbus manual, p. 14).
    NotIdentified(u8),
    Other(Vec<u8>),
    /// It fits no request of this kind.
    Unfitting(&'static str),
}

impl Asked {
    pub(super) fn of(pdu: &[u8]) -> Self {
        match *pdu {
            [function @ (3 | 4), a, b, c, d] => {
                Self::Read { function, first: word([a, b]), quantity: word([c, d]) }
            }
            [6, a, b, c, d] => Self::Write { function: 6, first: word([a, b]), words: vec![word([c, d])] },
            [16, a, b, c, d, bytes, ref data @ ..] if fits(word([c, d]), bytes, data) => {
                Self::Write { function: 16, first: word([a, b]), words: words(data) }
            }
            [23, a, b, c, d, e, f, g, h, bytes, ref data @ ..] if fits(word([g, h]), bytes, data) => {
                Self::ReadWrite {
                    read: (word([a, b]), word([c, d])),
                    first: word([e, f]),
                    words: words(data),
                }
            }
            [8, a, b, ref data @ ..] => Self::Diagnostics { code: word([a, b]), data: data.to_vec() },
            [0x2B, 0x0E, code, object] => Self::Identification { code, object },
            [function, ref data @ ..] => Self::Other { function, data: data.to_vec() },
            [] => Self::Other { function: 0, data: Vec::new() },
        }
    }

    /// The answer to it in a PDU.
    pub(super) fn answer(&self, pdu: &[u8]) -> Answer {
        let [function, ref data @ ..] = *pdu else { return Answer::Unfitting("nothing is in it") };
        if function == self.function() | EXCEPTION {
            return Answer::refusal(function, data);
        }
        if function != self.function() {
            return Answer::Unfitting("it has another function than was asked for");
        }
        match (self, data) {
            (
                Self::Read { first, quantity, .. } | Self::ReadWrite { read: (first, quantity), .. },
                [bytes, data @ ..],
            ) => {
                if !fits(*quantity, *bytes, data) {
                    return Answer::Unfitting("it has another number of words than was asked for");
                }
                Answer::Words { first: *first, words: words(data) }
            }
            (Self::Write { function: 6, first, words }, &[a, b, c, d]) => {
                let same = word([a, b]) == *first && words[..] == [word([c, d])];
                done_if(same)
            }
            (Self::Write { first, words, .. }, &[a, b, c, d]) => {
                done_if(word([a, b]) == *first && usize::from(word([c, d])) == words.len())
            }
            (Self::Identification { .. }, [0x0E, _, _, _, _, _, objects @ ..]) => {
                Answer::Identification(texts(objects))
            }
            (Self::Read { .. } | Self::ReadWrite { .. } | Self::Write { .. }, _) => {
                Answer::Unfitting("it has another length than was asked for")
            }
            _ => Answer::Other(data.to_vec()),
        }
    }

    const fn function(&self) -> u8 {
        match self {
            Self::Read { function, .. } | Self::Write { function, .. } | Self::Other { function, .. } => {
                *function
            }
            Self::ReadWrite { .. } => 0x17,
            Self::Diagnostics { .. } => 8,
            Self::Identification { .. } => 0x2B,
        }
    }

    /// It in a few words, without what it carries.
    pub(super) fn short(&self) -> String {
        match self {
            Self::Read { first, quantity, .. } => {
                format!("read of {} from {first}", counted(usize::from(*quantity)))
            }
            Self::Write { first, words, .. } => format!("write of {} to {first}", counted(words.len())),
            _ => format!("function {:02X}h", self.function()),
        }
    }

    pub(super) fn said(&self, family: Option<Family>, slave: u8, seen: &mut Words) -> Said {
        match self {
            Self::Read { first, quantity, .. } => {
                Said::text(format!("reads {}", span(family, *first, *quantity)))
            }
            Self::Write { first, words, .. } => written("writes", family, slave, &run(*first, words), seen),
            Self::ReadWrite { read: (from, quantity), first, words } => {
                let said = written("writes", family, slave, &run(*first, words), seen);
                let text = format!("{}; reads {}", said.text, span(family, *from, *quantity));
                Said { text, ..said }
            }
            Self::Diagnostics { code: 0, data } => Said::text(format!("asks for an echo of {}", hex(data))),
            Self::Diagnostics { code, data } => {
                Said::text(format!("diagnostics {code:02X}h, {}: {}", diagnostics(*code), hex(data)))
            }
            Self::Identification { code, object } => {
                Said::text(format!("asks who it is (identification {code}, object {object})"))
            }
            Self::Other { function, data } => {
                let data = if data.is_empty() { String::new() } else { format!(": {}", hex(data)) };
                let text = format!("function {function:02X}h, {}{data}", named(*function));
                // Those of a known form have been told apart before.
                match function {
                    3 | 4 | 6 | 0x10 | 0x17 => Said::trouble(text, "its counts or its length do not fit"),
                    _ => Said::text(text),
                }
            }
        }
    }
}

/// Whether its function is that of a refusal: no request has such a one.
pub(super) fn is_refusal(pdu: &[u8]) -> bool {
    pdu.first().is_some_and(|function| function & EXCEPTION != 0)
}

/// A refusal whose question is not there.
pub(super) fn lone_refusal(pdu: &[u8]) -> Option<Said> {
    let [function, ref data @ ..] = *pdu else { return None };
    let refused = function.checked_sub(EXCEPTION)?;
    let what = format!("function {refused:02X}h, {}", named(refused));
    Some(Answer::refusal(function, data).refused(&what))
}

impl Answer {
    fn refusal(function: u8, data: &[u8]) -> Self {
        match *data {
            [0x0E, code] if function == IDENTIFICATION | EXCEPTION => Self::NotIdentified(code),
            [code, ..] => Self::Exception(code),
            [] => Self::Unfitting("an exception without a code"),
        }
    }

    pub(super) const fn is_refusal(&self) -> bool {
        matches!(self, Self::Exception(_) | Self::NotIdentified(_))
    }

    /// A refusal of this.
    fn refused(&self, what: &str) -> Said {
        let trouble = match self {
            Self::Exception(code) => {
                let meaning = ExceptionMeaning::standard(*code);
                format!("exception {code:02X}h: {meaning}")
            }
            Self::NotIdentified(code) => format!("error {code:02X}h: {}", unidentified(*code)),
            _ => "it has no code".to_owned(),
        };
        Said::trouble(format!("refuses the {what}"), trouble)
    }

    pub(super) fn said(&self, asked: &Asked, family: Option<Family>, slave: u8, seen: &mut Words) -> Said {
        match self {
            Self::Words { first, words } => written("answers", family, slave, &run(*first, words), seen),
            Self::Done => Said::text("done".to_owned()),
            Self::Identification(texts) => {
                let texts: Vec<String> =
                    texts.iter().map(|(object, text)| format!("{}: {text}", part(*object))).collect();
                Said::text(format!("is {}", texts.join(", ")))
            }
            Self::Exception(_) | Self::NotIdentified(_) => self.refused(&asked.short()),
            Self::Other(data) => Said::text(format!("answers {}", hex(data))),
            Self::Unfitting(why) => Said {
                trouble: vec![(*why).to_owned()],
                ..Said::text("an answer that does not fit".to_owned())
            },
        }
    }
}

fn done_if(same: bool) -> Answer {
    if same { Answer::Done } else { Answer::Unfitting("it confirms something else than was written") }
}

/// Registers with their words, and the bits of those that have some.
pub(super) fn written(
    verb: &str,
    family: Option<Family>,
    slave: u8,
    words: &[(u16, u16)],
    seen: &mut Words,
) -> Said {
    let (mut short, mut details) = (Vec::new(), Vec::new());
    for &(address, word) in words {
        let told = seen.told(family, slave, address, word);
        short.push(told.short);
        details.extend(told.detail);
    }
    Said { text: format!("{verb} {}", short.join(", ")), details, ..Said::default() }
}

/// Words of registers that follow each other.
pub(super) fn run(first: u16, words: &[u16]) -> Vec<(u16, u16)> {
    (0..).zip(words).map(|(offset, word)| (first.wrapping_add(offset), *word)).collect()
}

/// The registers of a read.
pub(super) fn span(family: Option<Family>, first: u16, quantity: u16) -> String {
    let begin = name(family, first);
    match quantity {
        1 => begin,
        _ => {
            let last = name(family, first.wrapping_add(quantity.saturating_sub(1)));
            format!("{begin} to {last} ({quantity} words)")
        }
    }
}

pub(super) fn counted(words: usize) -> String {
    if words == 1 { "1 word".to_owned() } else { format!("{words} words") }
}

fn word(bytes: [u8; 2]) -> u16 {
    u16::from_be_bytes(bytes)
}

fn words(data: &[u8]) -> Vec<u16> {
    data.chunks_exact(2).map(|pair| pair.try_into().map_or(0, word)).collect()
}

fn fits(quantity: u16, bytes: u8, data: &[u8]) -> bool {
    usize::from(quantity) * 2 == usize::from(bytes) && data.len() == usize::from(bytes)
}

/// The texts of an identification: number, length, text.
fn texts(mut objects: &[u8]) -> Vec<(u8, String)> {
    let mut found = Vec::new();
    while let [object, length, rest @ ..] = objects {
        let Some((text, rest)) = rest.split_at_checked(usize::from(*length)) else { break };
        found.push((*object, String::from_utf8_lossy(text).escape_debug().to_string()));
        objects = rest;
    }
    found
}

/// Why an identification is refused (the Altivar 312's Modbus manual, p. 14).
const fn unidentified(code: u8) -> &'static str {
    match code {
        0 => "no error",
        1 => "the request code, the type of MEI or the ReadDeviceId is incorrect",
        2 => "the object id is incorrect",
        _ => "not known here",
    }
}

/// What an object of an identification is (section 6.21).
const fn part(object: u8) -> &'static str {
    match object {
        0 => "vendor",
        1 => "product",
        2 => "revision",
        _ => "object",
    }
}

/// What a function is (section 6).
const fn named(function: u8) -> &'static str {
    match function {
        1 => "read coils",
        2 => "read discrete inputs",
        3 | 4 => "read registers",
        5 => "write a coil",
        6 => "write a register",
        7 => "read exception status",
        0x0B => "read event counter",
        0x0C => "read event log",
        0x0F => "write coils",
        0x10 => "write registers",
        0x11 => "report server id",
        0x16 => "mask write register",
        0x17 => "read and write registers",
        0x2B => "encapsulated interface",
        _ => "not known here",
    }
}

/// What a diagnostic code is (section 6.8).
const fn diagnostics(code: u16) -> &'static str {
    match code {
        1 => "restart communication",
        2 => "read the diagnostic register",
        3 => "change the delimiter of ASCII",
        4 => "force listen only",
        10 => "clear counters",
        11 => "count of messages on the line",
        12 => "count of damaged messages",
        13 => "count of exceptions",
        14 => "count of messages to this slave",
        15 => "count of messages without an answer",
        _ => "not known here",
    }
}
