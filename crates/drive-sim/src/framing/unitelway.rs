//! The UNI-TELWAY link from the slaves' side: each is polled in turn and speaks only then, except that it acknowledges
//! at once what it receives.
//!
//! ```text
//! data frame : 10 02 address length [10 if length == 10h] data BCC    (each 10h inside the data sent twice)
//! poll       : 10 05 address
//! ```
//!
//! The BCC is the sum of all bytes before it. What a slave without anything to say answers to a poll is not printed, nor
//! what it does with a reply that nobody has acknowledged: [`LinkHabits`] are switches for it.

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use tokio::time::Instant;

use super::Framing;
use crate::{
    habits::{HeaderForm, LinkHabits, Unacknowledged},
    model::Damage,
    speech::{Content, Speech},
    state::State,
    unite::LinkCounters,
};

const DLE: u8 = 0x10;
const STX: u8 = 0x02;
const ENQ: u8 = 0x05;
const EOT: u8 = 0x04;
const ACK: u8 = 0x06;
const NAK: u8 = 0x15;
/// First byte of a message: UNI-TE follows at once, or after five more bytes of network address.
const SIMPLE_HEADER: u8 = 0x00;
const NETWORK_HEADER: u8 = 0x20;
const NETWORK_HEADER_LENGTH: usize = 6;
/// A frame that pauses longer is given up; the manual has no number for it.
const PAUSE: Duration = Duration::from_millis(100);

/// The link of all slaves of a line.
#[derive(Debug, Default)]
pub(crate) struct UniTelway {
    stage: Stage,
    frame: Frame,
    stations: BTreeMap<u8, Station>,
    /// Whose data frame waits for its acknowledgement.
    sent: Option<u8>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    #[default]
    Idle,
    Control,
    PollAddress,
    Address,
    Length,
    LengthAgain,
    Data,
    DataAgain,
    Check,
}

/// A data frame that is being received.
#[derive(Debug, Default)]
struct Frame {
    address: u8,
    length: usize,
    data: Vec<u8>,
    sum: u8,
}

/// What a slave remembers of its link.
#[derive(Debug, Default)]
struct Station {
    /// The messages that it will send when polled, until they are acknowledged, each from its time on.
    pending: VecDeque<(Instant, Vec<u8>)>,
    /// The network header of the request that it answers.
    header: Vec<u8>,
    counters: LinkCounters,
}

impl Framing for UniTelway {
    fn is_between_frames(&self) -> bool {
        self.stage == Stage::Idle
    }

    fn keeps_silences(&self) -> bool {
        false
    }

    fn frame_timeout(&self, _: Duration) -> Duration {
        PAUSE
    }

    fn byte(&mut self, byte: u8, at: Instant, line: &mut State, speech: &mut Vec<Speech>) {
        if !matches!(self.stage, Stage::Idle | Stage::Control | Stage::Check) {
            self.frame.sum = self.frame.sum.wrapping_add(byte);
        }
        self.stage = match (self.stage, byte) {
            (Stage::Idle, DLE) => Stage::Control,
            (Stage::Idle, ACK | NAK) => {
                self.acknowledged(byte == ACK);
                Stage::Idle
            }
            (Stage::Idle, _) => Stage::Idle,
            (Stage::Control, ENQ) => Stage::PollAddress,
            (Stage::Control, STX) => self.begin(),
            (Stage::Control, _) => self.give_up(line),
            (Stage::PollAddress, address) => {
                line.good_frame();
                speech.extend(self.polled(address, at, line));
                Stage::Idle
            }
            (Stage::Address, address) => {
                self.frame.address = address;
                Stage::Length
            }
            (Stage::Length, length) => {
                self.frame.length = usize::from(length);
                if length == DLE { Stage::LengthAgain } else { self.frame.next() }
            }
            (Stage::LengthAgain, DLE) => self.frame.next(),
            (Stage::Data, DLE) => Stage::DataAgain,
            (Stage::DataAgain, DLE) | (Stage::Data, _) => {
                self.frame.data.push(byte);
                self.frame.next()
            }
            // Inside a frame a lone DLE begins another one.
            (Stage::LengthAgain | Stage::DataAgain, STX) => {
                line.bad_frame(Damage::Check);
                self.begin()
            }
            (Stage::LengthAgain | Stage::DataAgain, ENQ) => {
                line.bad_frame(Damage::Check);
                Stage::PollAddress
            }
            (Stage::LengthAgain | Stage::DataAgain, _) => self.give_up(line),
            (Stage::Check, check) => {
                speech.extend(self.received(check, at, line));
                Stage::Idle
            }
        };
    }

    fn damaged(&mut self, _: Instant, line: &mut State) {
        if self.stage != Stage::Idle {
            self.stage = self.give_up(line);
        }
    }

    fn awaits_more(&self) -> bool {
        true
    }

    fn silence(&mut self, line: &mut State, _: &mut Vec<Speech>) {
        self.stage = self.give_up(line);
    }

    fn release(&mut self, slave: u8, message: Vec<u8>, now: Instant) -> Option<Speech> {
        let station = self.stations.entry(slave).or_default();
        station.pending.push_back((now, [&station.header[..], &message].concat()));
        None
    }

    fn encode(&self, slave: u8, message: &[u8], _: &State) -> Vec<u8> {
        data_frame(slave, message)
    }
}

impl UniTelway {
    fn begin(&mut self) -> Stage {
        self.frame.data.clear();
        self.frame.sum = DLE.wrapping_add(STX);
        Stage::Address
    }

    fn give_up(&mut self, line: &mut State) -> Stage {
        line.bad_frame(Damage::Check);
        Stage::Idle
    }

    /// A slave may speak: its message if it has one, again if it was not acknowledged.
    fn polled(&mut self, address: u8, at: Instant, line: &mut State) -> Option<Speech> {
        let slave = line.slave(address)?;
        if !slave.is_connected(at) || !slave.speaks_unite() {
            return None;
        }
        let (turnaround, habits) = (slave.turnaround(), slave.habits());
        let unheard = self.sent.take();
        self.not_acknowledged(unheard, line);
        let station = self.stations.entry(address).or_default();
        let content = match station.pending.front() {
            Some((ready, message)) if *ready <= at => {
                self.sent = Some(address);
                Content::Message(message.clone())
            }
            _ if habits.silent => return None,
            _ => Content::Signal(vec![EOT]),
        };
        Some(Speech { slave: address, content, heard: at, turnaround, is_to_another: false })
    }

    /// Something else came than a word to what this slave has sent.
    fn not_acknowledged(&mut self, address: Option<u8>, line: &mut State) {
        let Some(address) = address else { return };
        let Some(station) = self.stations.get_mut(&address) else { return };
        LinkCounters::count(&mut station.counters.sent_not_acknowledged);
        let habits = line.slave(address).map(|slave| slave.habits());
        if habits.is_some_and(|habits| habits.unacknowledged == Unacknowledged::Forgets) {
            station.pending.pop_front();
        }
    }

    /// The master's answer to a data frame. One that is refused stays, and is sent at the next poll.
    fn acknowledged(&mut self, taken: bool) {
        let Some(station) = self.sent.take().and_then(|address| self.stations.get_mut(&address)) else {
            return;
        };
        if taken {
            station.pending.pop_front();
        } else {
            LinkCounters::count(&mut station.counters.sent_refused);
        }
    }

    /// A whole data frame: acknowledged or refused by its slave, and carried out.
    fn received(&mut self, check: u8, at: Instant, line: &mut State) -> Option<Speech> {
        let unheard = self.sent.take();
        self.not_acknowledged(unheard, line);
        let Frame { address, ref data, sum, .. } = self.frame;
        let intact = check == sum;
        if intact {
            line.good_frame();
        } else {
            line.bad_frame(Damage::Check);
        }
        let slave = line.slave(address)?;
        if !slave.is_connected(at) || !slave.speaks_unite() {
            return None;
        }
        let habits = slave.habits();
        let LinkHabits { unacknowledged, acknowledges_after, .. } = habits;
        let turnaround = acknowledges_after.unwrap_or(slave.turnaround());
        let station = self.stations.entry(address).or_default();
        let is_full = unacknowledged == Unacknowledged::Refuses && !station.pending.is_empty();
        let takes = intact && !is_full && !slave.is_busy(at);
        let request = takes.then(|| split_header(data)).flatten();
        let signal = match request.filter(|(header, _)| is_known(habits.header, header)) {
            Some((header, request)) => {
                station.header = header.to_vec();
                let answer = slave.unite(at, request, &mut station.counters);
                if unacknowledged != Unacknowledged::Queues {
                    station.pending.clear();
                }
                let answer = answer.map(|(answer, after)| (at + after, [header, &answer].concat()));
                station.pending.extend(answer);
                ACK
            }
            None => {
                LinkCounters::count(&mut station.counters.received_refused);
                NAK
            }
        };
        let content = Content::Signal(vec![signal]);
        Some(Speech { slave: address, content, heard: at, turnaround, is_to_another: false })
    }
}

impl Frame {
    /// What comes after another byte of data.
    fn next(&self) -> Stage {
        if self.data.len() < self.length { Stage::Data } else { Stage::Check }
    }
}

/// The network header of a message and what follows it, if it has one of the two known forms.
fn split_header(message: &[u8]) -> Option<(&[u8], &[u8])> {
    match *message.first()? {
        SIMPLE_HEADER => message.split_at_checked(1),
        NETWORK_HEADER => message.split_at_checked(NETWORK_HEADER_LENGTH),
        _ => None,
    }
}

fn is_known(form: HeaderForm, header: &[u8]) -> bool {
    match form {
        HeaderForm::Either => true,
        HeaderForm::Simplified => header.len() == 1,
        HeaderForm::Standard => header.len() == NETWORK_HEADER_LENGTH,
    }
}

/// A data frame with its doubled 10h and its BCC.
fn data_frame(address: u8, message: &[u8]) -> Vec<u8> {
    // A message of ours is shorter than this: the longest answers 63 words.
    let length = u8::try_from(message.len()).unwrap_or(u8::MAX);
    let mut frame = vec![DLE, STX, address, length];
    if length == DLE {
        frame.push(DLE);
    }
    for byte in message {
        frame.push(*byte);
        if *byte == DLE {
            frame.push(DLE);
        }
    }
    frame.push(frame.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
    frame
}
