//! UNI-TELWAY: the link of [`drive_unitelway`], and what the Modbus requests of a family become among its own.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use bytes::Bytes;
use drive_core::{Class, NEGATIVE_REPLY, serial::SerialSettings};
use drive_unitelway::{Refusal, Reply, UniTelwaySettings};
use tokio::time::Instant;
use tokio_modbus::{
    ExceptionCode, Request, Response,
    prelude::{ConformityLevel, DeviceIdObject, ReadDeviceIdentificationResponse},
};

use super::{Failure, Frame, Machine, Step, Stray};
use crate::shape::Shape;

/// The function code under which a UNI-TE request itself travels in a [`Request::Custom`]: the data are its code and its
/// body without the category, which the line adds; the answer's data are the whole reply. One of the codes that Modbus
/// leaves to its users (MODBUS Application Protocol V1.1b3, section 5: 100 to 110).
pub const UNITE: u8 = 100;

/// The machine.
#[derive(Debug)]
pub struct UniTelway {
    link: drive_unitelway::UniTelway,
    /// The slave of the exchange that is under way.
    slave: u8,
    /// What was asked, by slave, in the exchange that is under way and in those that were put aside.
    asked: BTreeMap<u8, Arc<Request<'static>>>,
}

impl UniTelway {
    /// A machine for an adapter that makes pauses of at most `chunk_gap` inside a frame.
    #[must_use]
    pub fn new(serial: SerialSettings, settings: UniTelwaySettings, chunk_gap: Duration) -> Self {
        let chunk_gap = chunk_gap.max(serial.t3_5());
        let link = drive_unitelway::UniTelway::new(serial.baud(), settings, chunk_gap);
        Self { link, slave: 0, asked: BTreeMap::new() }
    }

    fn open(
        &mut self,
        slave: u8,
        request: Arc<Request<'static>>,
        start: fn(&mut drive_unitelway::UniTelway, u8, drive_unitelway::Request) -> Bytes,
    ) -> Bytes {
        // What has no form was refused by `carries`.
        let Ok(unite) = encode(&request) else { return Bytes::new() };
        self.slave = slave;
        self.asked.insert(slave, request);
        start(&mut self.link, slave, unite)
    }

    fn translated(&mut self, step: drive_unitelway::Step) -> Step {
        use drive_unitelway::{Failure as F, Step as S};

        match step {
            S::More => Step::More,
            S::Send(bytes) => Step::Send(bytes),
            S::Wait(until) => Step::Wait(Instant::from_std(until)),
            S::Done(result) => {
                let asked = self.asked.remove(&self.slave);
                Step::Done(match result {
                    Ok(Ok(reply)) => asked
                        .and_then(|asked| decode(&asked, reply))
                        .map(Ok)
                        .ok_or_else(|| Failure::Mismatch("the reply to another request".to_owned())),
                    Ok(Err(Refusal::Negative)) => Ok(Err(ExceptionCode::Custom(NEGATIVE_REPLY))),
                    Ok(Err(Refusal::Undeliverable)) => Ok(Err(ExceptionCode::GatewayPathUnavailable)),
                    Err(F::Timeout) => Err(Failure::Timeout),
                    Err(F::Damaged(why)) => Err(Failure::Damaged(why)),
                    Err(F::Mismatch(why)) => Err(Failure::Mismatch(why)),
                    Err(F::Refused(why)) => Err(Failure::Refused(why)),
                    Err(F::Doubted(why)) => Err(Failure::Doubted(why)),
                })
            }
        }
    }
}

impl Machine for UniTelway {
    fn carries(&self, slave: u8, request: &Request<'_>, class: Class) -> Result<(), String> {
        let unite = encode(request)?;
        if unite.is_specific() && class < Class::Command {
            return Err(format!("request F2h commands the drive, which class {class} may not"));
        }
        self.link.check(slave, &unite).map_err(|error| error.to_string())
    }

    fn is_write(&self, request: &Request<'_>) -> bool {
        encode(request).map_or_else(|_| crate::pdu::is_write(request), |unite| unite.is_write())
    }

    /// A slave says nothing that it is not polled for, and what it still had to say is polled first.
    fn confirms_late(&self) -> bool {
        false
    }

    fn start(&mut self, slave: u8, request: Arc<Request<'static>>, _: &Bytes) -> Bytes {
        self.open(slave, request, drive_unitelway::UniTelway::start)
    }

    fn start_at_once(&mut self, slave: u8, request: Arc<Request<'static>>, _: &Bytes) -> Bytes {
        self.open(slave, request, drive_unitelway::UniTelway::start_at_once)
    }

    fn handle_sent(&mut self, end: Instant, answer_by: Instant) {
        self.link.handle_sent(end.into_std(), answer_by.into_std());
    }

    fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) -> Step {
        let step = self.link.handle_bytes(now.into_std(), bytes);
        self.translated(step)
    }

    fn handle_timeout(&mut self, now: Instant) -> Step {
        let step = self.link.handle_timeout(now.into_std());
        self.translated(step)
    }

    fn deadline(&self) -> Option<Instant> {
        self.link.deadline().map(Instant::from_std)
    }

    fn abandon(&mut self) {
        self.link.abandon();
        self.asked.remove(&self.slave);
    }

    fn frees_the_line(&self) -> bool {
        true
    }

    fn resume(&mut self, slave: u8) -> Option<Bytes> {
        self.slave = slave;
        self.link.resume(slave)
    }

    fn forsake(&mut self, slave: u8) {
        self.link.forsake(slave);
        self.asked.remove(&slave);
    }

    fn reset(&mut self) {
        self.link.reset();
        self.asked.clear();
    }

    fn took(&self) -> Option<Duration> {
        self.link.took()
    }

    fn take_strays(&mut self) -> Vec<Stray> {
        let translated = |stray| match stray {
            drive_unitelway::Stray::Frame { slave, function } => Stray::Frame {
                slave,
                function,
                frame: Frame { shape: Shape::ANY, check: 0 },
                is_request: false,
                number: None,
                nobody: false,
            },
            drive_unitelway::Stray::Noise(bytes) => Stray::Noise(bytes),
            drive_unitelway::Stray::Echo => Stray::Echo,
        };
        self.link.take_strays().into_iter().map(translated).collect()
    }

    /// Of any reply it is unknown which request it belongs to.
    fn shape(&self, _: &[u8]) -> Shape {
        Shape::ANY
    }

    fn echoes(&self) -> bool {
        self.link.echoes()
    }
}

/// The UNI-TE form of a request.
///
/// # Errors
/// Why it has none.
fn encode(request: &Request<'_>) -> Result<drive_unitelway::Request, String> {
    use drive_unitelway::Request as Unite;

    match request {
        Request::ReadHoldingRegisters(first, quantity) | Request::ReadInputRegisters(first, quantity) => {
            Unite::read_words(*first, *quantity).map_err(|error| error.to_string())
        }
        Request::WriteSingleRegister(address, word) => Ok(Unite::write_word(*address, *word)),
        Request::WriteMultipleRegisters(first, words) => {
            Unite::write_words(*first, words).map_err(|error| error.to_string())
        }
        Request::Custom(0x08, data) => match &**data {
            [0, 0, mirrored @ ..] => Ok(Unite::mirror(mirrored)),
            _ => Err("UNI-TELWAY has the echo 08/00 and no other diagnostics".to_owned()),
        },
        Request::ReadDeviceIdentification(_, 0) => Ok(Unite::identification()),
        Request::Custom(UNITE, data) => match &**data {
            [code, body @ ..] => Ok(Unite::other(*code, body)),
            [] => Err("a UNI-TE request has a code".to_owned()),
        },
        other => {
            let function = other.function_code().value();
            Err(format!("UNI-TELWAY has no request for function {function:02X}h"))
        }
    }
}

/// What the reply, which fits its request, is as the answer to it.
fn decode(request: &Request<'_>, reply: Reply) -> Option<Response> {
    Some(match (request, reply) {
        (Request::ReadHoldingRegisters(..), Reply::Words(words)) => Response::ReadHoldingRegisters(words),
        (Request::ReadInputRegisters(..), Reply::Words(words)) => Response::ReadInputRegisters(words),
        (Request::WriteSingleRegister(address, word), Reply::Done) => {
            Response::WriteSingleRegister(*address, *word)
        }
        (Request::WriteMultipleRegisters(first, words), Reply::Done) => {
            Response::WriteMultipleRegisters(*first, words.len() as u16)
        }
        (Request::Custom(0x08, data), Reply::Raw(_)) => Response::Custom(0x08, Bytes::copy_from_slice(data)),
        (Request::ReadDeviceIdentification(read_code, 0), Reply::Raw(reply)) => {
            let identification = drive_unitelway::Identification::from_reply(&reply)?;
            let version = identification.version;
            let object = |id, value| DeviceIdObject { id, value };
            let version = Bytes::from(format!("V{}.{}", version >> 4, version & 0x0F));
            Response::ReadDeviceIdentification(ReadDeviceIdentificationResponse {
                read_code: *read_code,
                conformity_level: ConformityLevel::BasicIdentificationStreamOnly,
                more_follows: false,
                next_object_id: 0,
                // The rating stands behind code, product, subtype, version and its length.
                device_id_objects: vec![object(1, reply.slice(5..)), object(2, version)],
            })
        }
        (Request::Custom(UNITE, _), Reply::Raw(reply)) => Response::Custom(UNITE, reply),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn what_the_protocol_has_no_form_for_is_refused_before_anything_is_sent() {
        let settings = UniTelwaySettings::default();
        let machine = UniTelway::new(SerialSettings::MODBUS_DEFAULT, settings, 20 * MS);
        let carries = |slave, request: &Request<'_>| machine.carries(slave, request, Class::Command);
        let unite = |bytes: &'static [u8]| Request::Custom(UNITE, Cow::Borrowed(bytes));
        assert!(carries(0, &Request::WriteSingleRegister(400, 6)).is_err(), "a broadcast");
        for request in [
            Request::ReadHoldingRegisters(0, 64),
            Request::ReadHoldingRegisters(0, 0),
            Request::WriteMultipleRegisters(0, Cow::Owned(vec![0; 61])),
            Request::Custom(0x08, Cow::Borrowed(&[0, 4, 0, 0])),
            Request::Custom(0x0B, Cow::Borrowed(&[])),
            unite(&[]),
            unite(&[0xFA; 252]),
            Request::ReadCoils(0, 1),
        ] {
            assert!(carries(1, &request).is_err(), "{request:?}");
        }
        assert_eq!(carries(1, &unite(&[0xFA; 240])), Ok(()));
        let specific = unite(&[0xF2, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0]);
        assert!(machine.is_write(&specific));
        for class in Class::ALL {
            let carried = machine.carries(1, &specific, class).is_ok();
            assert_eq!(carried, class >= Class::Command, "{class}");
        }
    }

    #[test]
    fn a_reply_becomes_the_answer_that_modbus_would_have_given() {
        let words = || Reply::Words(vec![500, 0x1234]);
        let read = Request::ReadInputRegisters(250, 2);
        assert_eq!(decode(&read, words()), Some(Response::ReadInputRegisters(vec![500, 0x1234])));
        let write = Request::WriteSingleRegister(400, 6);
        assert_eq!(decode(&write, Reply::Done), Some(Response::WriteSingleRegister(400, 6)));
        let echo = Request::Custom(0x08, Cow::Borrowed(&[0, 0, 0xA5, 0x37]));
        let raw = Reply::Raw(Bytes::from_static(&[0xFB, 0xA5, 0x37]));
        let echoed = Response::Custom(0x08, Bytes::from_static(&[0, 0, 0xA5, 0x37]));
        assert_eq!(decode(&echo, raw), Some(echoed));
        assert_eq!(decode(&write, words()), None);
    }
}
