//! Frames of a line in words: which drive, which registers, what their bits say and which have changed, and which silence
//! was too short. Pure: it is fed frame by frame, in their order.

mod content;
mod pdu;
mod words;

use std::{collections::BTreeMap, time::Duration};

use drive_bus::capture::{Captured, Direction, Dissector};
use drive_core::SerialSettings;
use drive_families::Family;
use serde::Serialize;

use self::{
    content::{Content, content},
    pdu::Asked,
    words::Words,
};
use crate::output::milliseconds;

/// A word of a register in words: its bits, where it is a word of bits.
pub(crate) fn word_in_words(family: Option<Family>, address: u16, word: u16) -> String {
    let told = Words::default().told(family, 0, address, word);
    told.detail.unwrap_or(told.short)
}

/// What is known of a line beforehand.
#[derive(Debug, Clone, Default)]
pub(crate) struct Known {
    /// Its speed and format, by which silences are judged; `None`: they are not.
    pub(crate) serial: Option<SerialSettings>,
    /// Its drives: family and name, by address.
    pub(crate) drives: BTreeMap<u8, (Family, String)>,
}

/// A frame in words.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Explained {
    /// When its last byte was handed over, since 1970.
    #[serde(serialize_with = "crate::explain::as_milliseconds", rename = "time_unix_ms")]
    pub(crate) at: Duration,
    /// Whether the master of the capture sent it.
    pub(crate) sent: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) slave: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) drive: Option<String>,
    /// What it says, on one line.
    pub(crate) text: String,
    /// What its words say one by one, where they say more than numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) details: Vec<String>,
    /// What is wrong with it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) trouble: Vec<String>,
    /// From the end of its request to its first character.
    #[serde(
        skip_serializing_if = "Option::is_none",
        serialize_with = "crate::explain::as_some_milliseconds"
    )]
    #[serde(rename = "answered_after_ms")]
    pub(crate) after: Option<Duration>,
    /// Its bytes.
    pub(crate) bytes: String,
}

/// How many there were of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub(crate) struct Counts {
    pub(crate) requests: u64,
    pub(crate) answers: u64,
    pub(crate) exceptions: u64,
    pub(crate) unanswered: u64,
    pub(crate) damaged: u64,
    pub(crate) silences_broken: u64,
}

/// Puts the frames of one line into words.
pub(crate) struct Explainer {
    dissector: Dissector,
    known: Known,
    words: Words,
    /// The request whose answer is awaited.
    asked: Option<(u8, Asked)>,
    /// When the line was last busy.
    busy_until: Option<Duration>,
    counts: Counts,
}

impl Explainer {
    pub(crate) fn new(dissector: Dissector, known: Known) -> Self {
        let words = Words::default();
        Self { dissector, known, words, asked: None, busy_until: None, counts: Counts::default() }
    }

    /// The next frame.
    pub(crate) fn explain(&mut self, frame: &Captured) -> Explained {
        let sent = frame.direction == Direction::Sent;
        let content = content(self.dissector, &frame.bytes);
        let timing = self.timing(frame, sent);
        let (slave, mut said) = match content {
            Content::Pdu { slave, pdu } if sent => (Some(slave), self.request(slave, &pdu)),
            Content::Pdu { slave, pdu } => (Some(slave), self.answer(slave, &pdu)),
            Content::Link { slave, text } => (slave, Said::text(text)),
            Content::Damaged(why) => {
                self.counts.damaged += 1;
                (None, Said { trouble: vec![why], ..Said::text(format!("{} bytes", frame.bytes.len())) })
            }
        };
        said.trouble.extend(timing.trouble);
        Explained {
            at: frame.at,
            sent,
            slave,
            drive: slave.and_then(|slave| self.known.drives.get(&slave)).map(|(_, name)| name.clone()),
            text: said.text,
            details: said.details,
            trouble: said.trouble,
            after: timing.after.filter(|_| !sent),
            bytes: hex(&frame.bytes),
        }
    }

    /// What was counted; a request that is still open has not been answered.
    pub(crate) fn counts(&self) -> Counts {
        Counts { unanswered: self.counts.unanswered + u64::from(self.asked.is_some()), ..self.counts }
    }

    fn request(&mut self, slave: u8, pdu: &[u8]) -> Said {
        self.counts.requests += 1;
        let mut trouble = Vec::new();
        if let Some((before, asked)) = self.asked.take() {
            self.counts.unanswered += 1;
            trouble.push(format!("slave {before} had not answered: {}", asked.short()));
        }
        let family = self.family(slave);
        let asked = Asked::of(pdu);
        let said = Said { trouble, ..asked.said(family, slave, &mut self.words) };
        // Nobody answers a broadcast.
        self.asked = (slave != 0).then_some((slave, asked));
        said
    }

    fn answer(&mut self, slave: u8, pdu: &[u8]) -> Said {
        let family = self.family(slave);
        let Some((expected, asked)) = self.asked.take() else {
            let said = Asked::of(pdu).said(family, slave, &mut self.words);
            // The request of the first may stand before the capture.
            let is_first = self.counts.requests == 0;
            let trouble = (!is_first).then(|| "nobody had asked for it".to_owned()).into_iter().collect();
            return Said { trouble, ..said };
        };
        if expected != slave {
            let trouble = vec![format!("slave {expected} was asked, not this one")];
            self.asked = Some((expected, asked));
            return Said { trouble, ..Said::text(format!("answer of slave {slave}")) };
        }
        let answer = asked.answer(pdu);
        match answer {
            pdu::Answer::Exception(_) => self.counts.exceptions += 1,
            _ => self.counts.answers += 1,
        }
        answer.said(&asked, family, slave, &mut self.words)
    }

    fn family(&self, slave: u8) -> Option<Family> {
        self.known.drives.get(&slave).map(|(family, _)| *family)
    }

    /// How long the line was quiet before a frame. What is sent is handed over at once and takes its time on the wire; what
    /// is received has had its time when its last byte is there.
    fn timing(&mut self, frame: &Captured, sent: bool) -> Timing {
        let Some(serial) = self.known.serial else { return Timing::default() };
        let on_wire = serial.characters(frame.bytes.len());
        let (begin, end) =
            if sent { (frame.at, frame.at + on_wire) } else { (frame.at.saturating_sub(on_wire), frame.at) };
        let before = self.busy_until.replace(end);
        let Some(before) = before else { return Timing::default() };
        let quiet = begin.saturating_sub(before);
        let least = serial.t3_5();
        // Only what the master of the capture sends is known to the microsecond: an adapter hands over late what it hears.
        let is_broken = sent && self.dissector == Dissector::Rtu && quiet < least;
        self.counts.silences_broken += u64::from(is_broken);
        let trouble = is_broken.then(|| {
            format!("silence before it {}, 3.5 characters are {}", milliseconds(quiet), milliseconds(least))
        });
        Timing { after: Some(quiet), trouble: trouble.into_iter().collect() }
    }
}

#[derive(Default)]
struct Timing {
    after: Option<Duration>,
    trouble: Vec<String>,
}

/// What a frame says.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Said {
    text: String,
    details: Vec<String>,
    trouble: Vec<String>,
}

impl Said {
    fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}

fn as_milliseconds<S: serde::Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(time.as_micros() as f64 / 1_000.0)
}

fn as_some_milliseconds<S: serde::Serializer>(
    time: &Option<Duration>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match time {
        Some(time) => as_milliseconds(time, serializer),
        None => serializer.serialize_none(),
    }
}
