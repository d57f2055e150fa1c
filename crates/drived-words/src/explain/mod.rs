//! Frames of a line in words: which drive, which registers, what their bits say and which have changed, and which silence
//! was too short. Pure: it is fed frame by frame, in their order.

mod pdu;
mod unite;
mod words;

use std::{collections::BTreeMap, time::Duration};

use drive_bus::{
    capture::{Captured, Direction, Dissector},
    content::Content,
};
use drive_core::SerialSettings;
use drive_families::Family;
use serde::Serialize;

use self::{pdu::Asked, unite::Telway, words::Words};
use crate::output::milliseconds;

/// A word of a register in words: its bits, where it is a word of bits.
pub fn word_in_words(family: Option<Family>, address: u16, word: u16) -> String {
    let told = Words::default().told(family, 0, address, word);
    told.detail.unwrap_or(told.short)
}

/// What is known of a line beforehand.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// Its speed and format, by which silences are judged; `None`: they are not.
    pub serial: Option<SerialSettings>,
    /// How late each frame was handed over at the most, where the line is only listened to.
    pub late: Option<Duration>,
    /// Its drives: family and name, by address.
    pub drives: BTreeMap<u8, (Family, String)>,
}

/// A frame in words.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explained {
    /// When its last byte was handed over, since 1970; `None` where that was not taken down.
    #[serde(
        skip_serializing_if = "Option::is_none",
        serialize_with = "crate::explain::as_some_milliseconds",
        rename = "time_unix_ms"
    )]
    pub at: Option<Duration>,
    /// Whether the master sent it, where that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sent: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slave: Option<u8>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    /// What it says, on one line.
    pub text: String,
    /// What its words say one by one, where they say more than numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub details: Vec<String>,
    /// What is wrong with it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub trouble: Vec<String>,
    /// From the end of its request to its first character.
    #[serde(
        skip_serializing_if = "Option::is_none",
        serialize_with = "crate::explain::as_some_milliseconds"
    )]
    #[serde(rename = "answered_after_ms")]
    pub after: Option<Duration>,
    /// Its bytes.
    pub bytes: String,
}

/// How many there were of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    pub requests: u64,
    pub answers: u64,
    pub exceptions: u64,
    pub unanswered: u64,
    pub damaged: u64,
    pub silences_broken: u64,
    /// Silences that may have been too short, and are not known well enough.
    pub silences_doubtful: u64,
}

/// Puts the frames of one line into words.
pub struct Explainer {
    known: Known,
    words: Words,
    /// The Modbus request whose answer is awaited.
    asked: Option<(u8, Asked)>,
    telway: Telway,
    /// When the line was last busy.
    busy_until: Option<Duration>,
    counts: Counts,
}

impl Explainer {
    pub fn new(known: Known) -> Self {
        Self {
            known,
            words: Words::default(),
            asked: None,
            telway: Telway::default(),
            busy_until: None,
            counts: Counts::default(),
        }
    }

    /// The next frame of a line that speaks this.
    pub fn explain(&mut self, dissector: Dissector, frame: &Captured) -> Explained {
        let sent = match frame.direction {
            Direction::Sent => Some(true),
            Direction::Received => Some(false),
            Direction::Unknown => None,
        };
        let content = Content::of(dissector, &frame.bytes);
        let timing = self.timing(frame, sent, dissector == Dissector::Rtu && content.is_ok());
        let slave = content.as_ref().ok().and_then(Content::slave);
        let mut said = match content {
            Ok(content) => self.said(&content, sent),
            Err(why) => {
                self.counts.damaged += 1;
                Said::trouble(format!("{} bytes", frame.bytes.len()), why.to_string())
            }
        };
        said.trouble.extend(timing.trouble);
        Explained {
            at: Some(frame.at),
            sent,
            slave,
            drive: slave.and_then(|slave| self.known.drives.get(&slave)).map(|(_, name)| name.clone()),
            text: said.text,
            details: said.details,
            trouble: said.trouble,
            after: timing.after.filter(|_| sent == Some(false)),
            bytes: hex(&frame.bytes),
        }
    }

    fn said(&mut self, content: &Content, sent: Option<bool>) -> Said {
        match content {
            Content::Pdu { slave, pdu } => match sent {
                // Where the bytes alone are there, who sent the first is a guess, and no request has the function of a refusal.
                Some(true) if !pdu::is_refusal(pdu) => self.request(*slave, pdu),
                Some(_) => self.answer(*slave, pdu),
                // What has one form for both: nothing is told from it.
                None => {
                    if let Some(refusal) = pdu::lone_refusal(pdu) {
                        self.counts.exceptions += 1;
                        return refusal;
                    }
                    let said = Asked::of(pdu).said(self.family(*slave), *slave, &mut self.words);
                    Said { text: format!("{}, or confirms it", said.text), ..said }
                }
            },
            Content::Poll { .. } => self.telway.poll(),
            Content::Signal(signal) => self.telway.signal(*signal),
            Content::Message { slave, message } => {
                let family = self.family(*slave);
                let Self { telway, words, counts, .. } = self;
                telway.message((*slave, message), sent, family, words, counts)
            }
            _ => Said::text("nothing that is known here"),
        }
    }

    /// What was counted; a request that is still open has not been answered.
    pub fn counts(&self) -> Counts {
        let open = u64::from(self.asked.is_some()) + self.telway.waiting();
        Counts { unanswered: self.counts.unanswered + open, ..self.counts }
    }

    /// How late a frame may have been handed over, where the line is only listened to.
    pub const fn late(&self) -> Option<Duration> {
        self.known.late
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
        let mut said = asked.said(family, slave, &mut self.words);
        said.trouble.extend(trouble);
        // Nobody answers a broadcast.
        self.asked = (slave != 0).then_some((slave, asked));
        said
    }

    fn answer(&mut self, slave: u8, pdu: &[u8]) -> Said {
        let family = self.family(slave);
        let Some((expected, asked)) = self.asked.take() else {
            let refusal = pdu::lone_refusal(pdu);
            self.counts.exceptions += u64::from(refusal.is_some());
            let mut said = refusal.unwrap_or_else(|| Asked::of(pdu).said(family, slave, &mut self.words));
            // The request of the first may stand before the capture.
            let is_first = self.counts.requests == 0;
            said.trouble.extend((!is_first).then(|| "nobody had asked for it".to_owned()));
            return said;
        };
        if expected != slave {
            let trouble = vec![format!("slave {expected} was asked, not this one")];
            self.asked = Some((expected, asked));
            return Said { trouble, ..Said::text(format!("answer of slave {slave}")) };
        }
        let answer = asked.answer(pdu);
        match answer.is_refusal() {
            true => self.counts.exceptions += 1,
            false => self.counts.answers += 1,
        }
        answer.said(&asked, family, slave, &mut self.words)
    }

    /// The family of a slave; of all, where they are of one.
    fn family(&self, slave: u8) -> Option<Family> {
        if slave != 0 {
            return self.known.drives.get(&slave).map(|(family, _)| *family);
        }
        let mut families = self.known.drives.values().map(|(family, _)| *family);
        let first = families.next()?;
        families.all(|family| family == first).then_some(first)
    }

    /// How long the line was quiet before a frame. What is sent is handed over at once and takes its time on the wire; what
    /// is received has had its time when its last byte is there.
    fn timing(&mut self, frame: &Captured, sent: Option<bool>, keeps_silences: bool) -> Timing {
        let Some(serial) = self.known.serial else { return Timing::default() };
        let on_wire = serial.characters(frame.bytes.len());
        let is_ours = sent == Some(true) && self.known.late.is_none();
        let (begin, end) = if is_ours {
            (frame.at, frame.at + on_wire)
        } else {
            (frame.at.saturating_sub(on_wire), frame.at)
        };
        let before = self.busy_until.replace(end);
        let Some(before) = before else { return Timing::default() };
        let (quiet, least) = (begin.saturating_sub(before), serial.t3_5());
        let mut timing = Timing { after: Some(quiet), trouble: None };
        // Only what the master of the capture sends is known to the microsecond. What is heard may have been on the line
        // earlier, this frame or the one before it.
        let late = match self.known.late {
            _ if is_ours => Duration::ZERO,
            Some(late) => late,
            None => return timing,
        };
        if !keeps_silences || begin >= before + least + late {
            return timing;
        }
        if begin + late >= before + least {
            self.counts.silences_doubtful += 1;
            return timing;
        }
        self.counts.silences_broken += 1;
        let at_most = if late.is_zero() { "" } else { "at most " };
        timing.trouble = Some(format!(
            "silence before it {at_most}{}, 3.5 characters are {}",
            milliseconds(quiet + late),
            milliseconds(least)
        ));
        timing
    }
}

#[derive(Default)]
struct Timing {
    after: Option<Duration>,
    trouble: Option<String>,
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

    fn trouble(text: impl Into<String>, trouble: impl Into<String>) -> Self {
        Self { trouble: vec![trouble.into()], ..Self::text(text) }
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
