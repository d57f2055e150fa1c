//! What each slave of a capture was asked and said, exchange by exchange. Pure.

use std::{collections::BTreeMap, time::Duration};

use bytes::Bytes;
use drive_bus::{
    capture::{Captured, Direction, Recording},
    content::Content,
    unite::unite_of,
};
use drive_core::SerialSettings;
use drive_sim::{Played, Says};

/// Requests with what was said to them, by slave, in their order.
pub(super) type Exchanges = BTreeMap<u8, Vec<(Vec<u8>, Played)>>;

/// The exchanges of a capture whose line had these settings. A request at its end that was not answered yet is none.
pub(super) fn exchanges(recording: &Recording, serial: SerialSettings) -> Exchanges {
    let mut recorder = Recorder { found: Exchanges::new(), open: None, unite: BTreeMap::new() };
    for frame in &recording.frames {
        let on_wire = serial.characters(frame.bytes.len());
        // What a master sends it hands over before it is on the line, what is heard behind it.
        let is_ours = frame.direction == Direction::Sent && recording.late.is_none();
        let (begin, end) = if is_ours {
            (frame.at, frame.at + on_wire)
        } else {
            (frame.at.saturating_sub(on_wire), frame.at)
        };
        match Content::of(recording.dissector, &frame.bytes) {
            Ok(Content::Pdu { slave, pdu }) => recorder.modbus(frame, (begin, end), slave, &pdu),
            Ok(Content::Message { slave, message }) => {
                if let Some(Ok(unite)) = unite_of(&message) {
                    recorder.unite(frame, (begin, end), slave, &unite);
                }
            }
            Ok(_) => {}
            Err(_) => recorder.damaged(frame, begin),
        }
    }
    recorder.found
}

struct Recorder {
    found: Exchanges,
    /// The Modbus request whose answer is awaited.
    open: Option<Open>,
    /// The UNI-TE requests whose replies are awaited, by slave, and when each ended.
    unite: BTreeMap<u8, (Bytes, Duration)>,
}

struct Open {
    slave: u8,
    request: Bytes,
    ended: Duration,
    /// What came and makes no frame, and when it began.
    damaged: Option<(Duration, Vec<u8>)>,
}

impl Recorder {
    fn modbus(&mut self, frame: &Captured, (begin, end): (Duration, Duration), slave: u8, pdu: &Bytes) {
        let is_awaited = self.open.as_ref().is_some_and(|open| open.slave == slave);
        let is_answer = match frame.direction {
            Direction::Received => true,
            Direction::Sent => false,
            // What has one form for both answers the same that is open.
            Direction::Unknown => self.open.as_ref().is_some_and(|open| is_awaited && open.request == *pdu),
        };
        if !is_answer {
            self.close();
            // Nobody answers a broadcast.
            let open = Open { slave, request: pdu.clone(), ended: end, damaged: None };
            self.open = Some(open).filter(|open| open.slave != 0);
        } else if is_awaited && let Some(open) = self.open.take() {
            let after = begin.saturating_sub(open.ended);
            self.add(open.slave, &open.request, Played { after, says: Says::Message(pdu.to_vec()) });
        }
    }

    fn damaged(&mut self, frame: &Captured, begin: Duration) {
        if let Some(open) = &mut self.open {
            let (_, bytes) = open.damaged.get_or_insert((begin, Vec::new()));
            bytes.extend_from_slice(&frame.bytes);
        }
    }

    /// Another request comes: the one before it has had no answer, or a damaged one.
    fn close(&mut self) {
        let Some(open) = self.open.take() else { return };
        let played = match open.damaged {
            Some((begin, bytes)) => {
                Played { after: begin.saturating_sub(open.ended), says: Says::Characters(bytes) }
            }
            None => Played { after: Duration::ZERO, says: Says::Nothing },
        };
        self.add(open.slave, &open.request, played);
    }

    fn unite(&mut self, frame: &Captured, (begin, end): (Duration, Duration), slave: u8, unite: &Bytes) {
        match frame.direction {
            Direction::Sent => {
                self.unite.insert(slave, (unite.clone(), end));
            }
            Direction::Received => {
                if let Some((request, ended)) = self.unite.remove(&slave) {
                    let after = begin.saturating_sub(ended);
                    self.add(slave, &request, Played { after, says: Says::Message(unite.to_vec()) });
                }
            }
            Direction::Unknown => {}
        }
    }

    fn add(&mut self, slave: u8, request: &Bytes, played: Played) {
        self.found.entry(slave).or_default().push((request.to_vec(), played));
    }
}
