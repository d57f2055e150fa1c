//! UNI-TELWAY from the master's side: frames byte for byte, and what becomes of everything else.

mod support;

use std::{borrow::Cow, time::Duration};

use bytes::Bytes;
use drive_bus::{
    Line, LineConfig, Protocol,
    exchange::{
        Exchange, Failure, Step, Stray,
        unitelway::{UNITE, UniTelway, data_frame, poll},
    },
    protocol::{NetworkHeader, UniTelwaySettings},
    unite::{SpecificCommand, SpecificReport, UniTeError},
};
use drive_core::{
    Class, Port, PortError, Terms,
    serial::{CharacterFormat, SerialSettings},
};
use support::{
    MS,
    script::{PATIENCE, Script},
};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio_modbus::{ExceptionCode, Request, Response, client::Client};

const ACK: &[u8] = &[0x06];
const NAK: &[u8] = &[0x15];
const EOT: &[u8] = &[0x04];
const READ: Request<'static> = Request::ReadHoldingRegisters(400, 1);
const WRITE: Request<'static> = Request::WriteSingleRegister(400, 6);
const WRITTEN: Response = Response::WriteSingleRegister(400, 6);

fn serial() -> SerialSettings {
    SerialSettings::new(19_200, CharacterFormat::F8O1).unwrap()
}

fn script(settings: UniTelwaySettings) -> Script<UniTelway> {
    Script::new(UniTelway::new(serial(), settings, 20 * MS))
}

fn simplified(category: u8) -> UniTelwaySettings {
    UniTelwaySettings { header: NetworkHeader::Simplified, category, ..UniTelwaySettings::default() }
}

/// A machine that knows slave 1 to hold nothing.
fn settled() -> Script<UniTelway> {
    let mut script = script(UniTelwaySettings::default());
    assert_eq!(script.ask(1, &READ), poll(1));
    assert_eq!(script.hear(EOT), Step::More);
    send(&mut script);
    acknowledge(&mut script);
    assert_eq!(script.hear(&reply(&[0x34, 0, 0])), sends(ACK));
    assert!(matches!(script.wait(), Step::Done(Ok(Ok(_)))));
    script
}

fn sends(bytes: &[u8]) -> Step {
    Step::Send(Bytes::copy_from_slice(bytes))
}

/// The silence before a transmission passes; what is sent.
fn send(script: &mut Script<UniTelway>) -> Bytes {
    match script.wait() {
        Step::Send(bytes) => bytes,
        step => panic!("{step:?}"),
    }
}

/// The slave acknowledges the request and is polled.
fn acknowledge(script: &mut Script<UniTelway>) {
    assert_eq!(script.hear(ACK), Step::More);
    assert_eq!(send(script), poll(1));
}

/// A reply of slave 1 with the standard header.
fn reply(unite: &[u8]) -> Bytes {
    data_frame(1, &[&[0x20, 0, 0xFE, 0, 0, 0], unite].concat())
}

fn unite(code_and_body: &'static [u8]) -> Request<'static> {
    Request::Custom(UNITE, Cow::Borrowed(code_and_body))
}

/// Requests and replies as the link's rules make them, the 10h doubled, both checks as they are on the line.
struct Vector {
    settings: UniTelwaySettings,
    slave: u8,
    request: Request<'static>,
    sent: &'static [u8],
    reply: &'static [u8],
    answer: Response,
}

fn vectors() -> Vec<Vector> {
    let standard = UniTelwaySettings::default();
    let with = |reply: &'static [u8]| Response::Custom(UNITE, Bytes::from_static(reply));
    vec![
        // Mirror of 10h 04h, category 1, simplified header.
        Vector {
            settings: simplified(1),
            slave: 1,
            request: unite(&[0xFA, 0x10, 0x04]),
            sent: &[0x10, 0x02, 0x01, 0x05, 0x00, 0xFA, 0x01, 0x10, 0x10, 0x04, 0x37],
            reply: &[0x10, 0x02, 0x01, 0x04, 0x00, 0xFB, 0x10, 0x10, 0x04, 0x36],
            answer: with(&[0xFB, 0x10, 0x04]),
        },
        // Mirror of 05h.
        Vector {
            settings: simplified(0),
            slave: 1,
            request: unite(&[0xFA, 0x05]),
            sent: &[0x10, 0x02, 0x01, 0x04, 0x00, 0xFA, 0x00, 0x05, 0x16],
            reply: &[0x10, 0x02, 0x01, 0x03, 0x00, 0xFB, 0x05, 0x16],
            answer: with(&[0xFB, 0x05]),
        },
        // Mirror of 00h with the network header.
        Vector {
            settings: standard,
            slave: 1,
            request: unite(&[0xFA, 0x00]),
            sent: &[0x10, 0x02, 0x01, 0x09, 0x20, 0, 0xFE, 0, 0, 0, 0xFA, 0x07, 0x00, 0x3B],
            reply: &[0x10, 0x02, 0x01, 0x08, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xFB, 0x00, 0x34],
            answer: with(&[0xFB, 0x00]),
        },
        // Request 00h of category 7 to slave 2.
        Vector {
            settings: standard,
            slave: 2,
            request: unite(&[0x00, 0x00, 0x00]),
            sent: &[0x10, 0x02, 0x02, 0x0A, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0x00, 0x07, 0x00, 0x00, 0x43],
            reply: &[0x10, 0x02, 0x02, 0x09, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0x30, 0x00, 0x00, 0x6B],
            answer: with(&[0x30, 0x00, 0x00]),
        },
        // Error counters.
        Vector {
            settings: standard,
            slave: 1,
            request: unite(&[0xA2]),
            sent: &[0x10, 0x02, 0x01, 0x08, 0x20, 0, 0xFE, 0, 0, 0, 0xA2, 0x07, 0xE2],
            reply: &[
                0x10, 0x02, 0x01, 0x0F, 0x20, 0x00, 0xFE, 0x00, 0x00, 0x00, 0xD2, 0, 0, 0, 0, 0, 0, 0, 0,
                0x12,
            ],
            answer: with(&[0xD2, 0, 0, 0, 0, 0, 0, 0, 0]),
        },
        // The manual's reading of W250 to W253 (VVDED397054 p. 12/36), with the words of a drive.
        Vector {
            settings: simplified(7),
            slave: 1,
            request: Request::ReadHoldingRegisters(250, 4),
            sent: &[0x10, 0x02, 0x01, 0x09, 0x00, 0x36, 0x07, 0x68, 0x07, 0xFA, 0x00, 0x04, 0x00, 0xC6],
            reply: &[
                0x10, 0x02, 0x01, 0x0B, 0x00, 0x66, 0x07, 0xF4, 0x01, 0x00, 0x00, 0x10, 0x10, 0x00, 0x1E,
                0x00, 0xBE,
            ],
            answer: Response::ReadHoldingRegisters(vec![500, 0, 16, 30]),
        },
    ]
}

#[test]
fn the_test_vectors_go_both_ways_whole_byte_by_byte_and_twice_in_a_row() {
    for Vector { settings, slave, request, sent, reply, answer } in vectors() {
        let mut script = script(settings);
        for round in 0..3 {
            let opening = script.ask(slave, &request);
            if round == 0 {
                assert_eq!(opening, poll(slave), "nothing is known of the slave yet");
                script.hear(EOT);
                assert_eq!(send(&mut script), sent);
            } else {
                assert_eq!(opening, sent);
            }
            assert_eq!(script.hear(ACK), Step::More);
            assert_eq!(send(&mut script), poll(slave));
            let step = match round {
                0 => script.hear(reply),
                1 => script.hear_one_by_one(reply),
                _ => script.hear(&[reply, reply].concat()),
            };
            assert_eq!(step, sends(ACK), "{request:?}");
            assert_eq!(script.wait(), Step::Done(Ok(Ok(answer.clone()))));
        }
    }
}

#[test]
fn a_damaged_vector_is_refused_and_polled_for_again_and_never_taken_for_another_answer() {
    for Vector { settings, slave, request, reply, answer, .. } in vectors() {
        for at in 0..reply.len() {
            for bit in 0..8 {
                let mut damaged = reply.to_vec();
                damaged[at] ^= 1 << bit;
                let mut script = script(settings);
                script.ask(slave, &request);
                script.hear(EOT);
                send(&mut script);
                script.hear(ACK);
                send(&mut script);
                let mut step = script.hear(&damaged);
                if step == Step::More {
                    step = script.wait_for_step();
                }
                if step == sends(NAK) {
                    assert_eq!(send(&mut script), poll(slave));
                    assert_eq!(script.hear(reply), sends(ACK), "after {damaged:02X?}");
                    assert_eq!(script.wait(), Step::Done(Ok(Ok(answer.clone()))));
                } else {
                    // No beginning of a frame was left, or the beginning of another slave's.
                    assert_eq!(step, Step::Done(Err(Failure::Timeout)), "{damaged:02X?}");
                }
            }
        }
    }
}

#[test]
fn a_slave_that_has_nothing_to_say_yet_is_polled_again_until_its_time_is_over() {
    let mut script = settled();
    script.ask(1, &WRITE);
    let asked = script.now;
    acknowledge(&mut script);
    for _ in 0..3 {
        assert_eq!(script.hear(EOT), Step::More);
        assert_eq!(send(&mut script), poll(1));
    }
    assert_eq!(script.hear(&reply(&[0xFE])), sends(ACK));
    assert_eq!(script.wait(), Step::Done(Ok(Ok(WRITTEN))));

    script.ask(1, &WRITE);
    acknowledge(&mut script);
    let step = loop {
        match script.hear(EOT) {
            Step::More => assert_eq!(send(&mut script), poll(1)),
            step => break step,
        }
    };
    assert_eq!(step, Step::Done(Err(Failure::Timeout)));
    assert!(script.now - asked >= PATIENCE);
}

#[test]
fn what_an_earlier_exchange_left_in_a_slave_is_taken_before_its_next_request() {
    let mut script = settled();
    script.ask(1, &WRITE);
    acknowledge(&mut script);
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));

    assert_eq!(script.ask(1, &READ), poll(1));
    script.strays();
    assert_eq!(script.hear(&reply(&[0xFE])), sends(ACK));
    assert_eq!(script.strays(), [Stray::Frame { slave: 1, function: 0xFE }]);
    assert_eq!(send(&mut script), poll(1));
    assert_eq!(script.hear(EOT), Step::More);
    assert_eq!(send(&mut script), reply(&[0x04, 0x07, 0x90, 0x01]));
    acknowledge(&mut script);
    assert_eq!(script.hear(&reply(&[0x34, 0x06, 0x00])), sends(ACK));
    assert_eq!(script.wait(), Step::Done(Ok(Ok(Response::ReadHoldingRegisters(vec![6])))));
}

#[test]
fn a_slave_that_says_nothing_to_the_first_poll_is_asked_all_the_same() {
    let mut script = script(UniTelwaySettings::default());
    assert_eq!(script.ask(1, &WRITE), poll(1));
    assert_eq!(send(&mut script), reply(&[0x14, 0x07, 0x90, 0x01, 0x06, 0x00]));
    acknowledge(&mut script);
    assert_eq!(script.hear(&reply(&[0xFE])), sends(ACK));
    assert_eq!(script.wait(), Step::Done(Ok(Ok(WRITTEN))));
}

#[test]
fn a_slave_that_used_to_say_something_is_not_asked_when_it_says_nothing_until_the_second_time() {
    let mut script = settled();
    script.ask(1, &WRITE);
    assert_eq!(script.wait(), Step::Done(Err(Failure::Timeout)));
    assert_eq!(script.ask(1, &READ), poll(1));
    assert_eq!(script.wait(), Step::Done(Err(Failure::Timeout)), "what it holds may come late");
    assert_eq!(script.ask(1, &WRITE), poll(1));
    assert_eq!(send(&mut script), reply(&[0x14, 0x07, 0x90, 0x01, 0x06, 0x00]));
}

#[test]
fn a_refused_request_is_sent_again_and_then_given_up_as_not_carried_out() {
    let mut script = settled();
    let request = script.ask(1, &WRITE);
    assert_eq!(script.hear(NAK), Step::More);
    assert_eq!(send(&mut script), request);
    assert!(matches!(script.hear(NAK), Step::Done(Err(Failure::Refused(_)))));
    assert_eq!(script.ask(1, &WRITE), request, "it holds nothing of it");
}

#[test]
fn a_refusal_among_noise_is_none_because_the_request_may_have_been_taken() {
    let mut script = settled();
    script.ask(1, &WRITE);
    assert_eq!(script.hear(&[0xAA, 0x15]), Step::More);
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));
}

#[test]
fn a_request_that_is_not_acknowledged_is_not_sent_again() {
    let mut script = settled();
    script.ask(1, &WRITE);
    let asked = script.now;
    assert_eq!(script.wait(), Step::Done(Err(Failure::Timeout)));
    assert!(script.now - asked < 110 * MS, "the link's own timeout, not that of the reply");
}

#[test]
fn a_reply_that_stays_damaged_is_given_up_and_one_that_breaks_off_is_damaged() {
    let mut script = settled();
    script.ask(1, &READ);
    acknowledge(&mut script);
    let good = reply(&[0x34, 1, 2]);
    assert_eq!(script.hear(&good[..7]), Step::More);
    assert_eq!(script.wait(), sends(NAK));
    assert_eq!(send(&mut script), poll(1));
    let mut damaged = good.to_vec();
    damaged[9] ^= 1;
    assert_eq!(script.hear(&damaged), Step::Done(Err(Failure::Damaged("BCC"))));
}

#[test]
fn a_reply_to_another_request_is_taken_from_the_slave_and_is_no_answer() {
    let mut script = settled();
    script.ask(1, &READ);
    acknowledge(&mut script);
    for unfit in [&[0xFE][..], &[0x34, 1], &[0x66, 7, 1, 2], &[]] {
        assert_eq!(script.hear(&reply(unfit)), sends(ACK), "{unfit:02X?}");
        assert_eq!(send(&mut script), poll(1));
    }
    assert_eq!(script.hear(&data_frame(1, &[0x55, 0x34, 1, 2])), sends(ACK), "an unknown header");
    assert_eq!(send(&mut script), poll(1));
    // Another slave's frame is not ours to acknowledge.
    assert_eq!(script.hear(&data_frame(2, &[0, 0x34, 1, 2])), Step::More);
    assert!(matches!(script.wait_for_step(), Step::Done(Err(Failure::Mismatch(_)))));
}

#[test]
fn a_negative_reply_is_an_exception_and_so_is_what_the_network_cannot_deliver() {
    let mut script = settled();
    for (answer, exception) in [
        (reply(&[0xFD]), ExceptionCode::IllegalDataValue),
        (data_frame(1, &[0x22, 0, 0xFE, 0, 0, 0]), ExceptionCode::GatewayPathUnavailable),
    ] {
        script.ask(1, &WRITE);
        acknowledge(&mut script);
        assert_eq!(script.hear(&answer), sends(ACK));
        assert_eq!(script.wait(), Step::Done(Ok(Err(exception))));
    }
}

#[test]
fn an_adapter_that_echoes_is_recognised_in_every_step() {
    let mut script = script(UniTelwaySettings::default());
    let first = script.ask(1, &READ);
    assert_eq!(script.hear(&first), Step::More);
    assert!(script.machine.echoes());
    script.hear(EOT);
    let request = reply(&[0x04, 0x07, 0x90, 0x01]);
    assert_eq!(send(&mut script), request);
    for _ in 0..2 {
        assert_eq!(script.hear(&request), Step::More);
        assert_eq!(script.hear(ACK), Step::More);
        assert_eq!(send(&mut script), poll(1));
        assert_eq!(script.hear(&[&poll(1)[..], &reply(&[0x34, 6, 0])].concat()), sends(ACK));
        // The next request waits for the echo of this acknowledgement, or it would be acknowledged by it.
        let answer = Step::Done(Ok(Ok(Response::ReadHoldingRegisters(vec![6]))));
        assert_eq!(script.hear(ACK), answer);
        assert_eq!(script.ask(1, &READ), request);
    }
    assert_eq!(script.strays().iter().filter(|stray| **stray == Stray::Echo).count(), 7);
}

#[test]
fn what_the_protocol_has_no_form_for_is_refused_before_anything_is_sent() {
    let machine = UniTelway::new(serial(), UniTelwaySettings::default(), 20 * MS);
    let carries = |slave, request: &Request<'_>| machine.carries(slave, request, Class::Command);
    assert!(carries(0, &WRITE).is_err(), "a broadcast");
    assert!(carries(1, &Request::ReadHoldingRegisters(0, 64)).is_err());
    assert!(carries(1, &Request::Custom(0x08, Cow::Borrowed(&[0, 4, 0, 0]))).is_err());
    assert!(carries(1, &Request::Custom(UNITE, Cow::Owned(vec![0xFA; 252]))).is_err(), "too long");
    assert_eq!(carries(1, &Request::Custom(UNITE, Cow::Owned(vec![0xFA; 240]))), Ok(()));
    let specific = unite(&[0xF2, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0]);
    assert!(machine.is_write(&specific));
    for class in Class::ALL {
        let carried = machine.carries(1, &specific, class).is_ok();
        assert_eq!(carried, class >= Class::Command, "{class}");
    }
}

/// The far end of a line: slave 1, scripted.
struct Peer(DuplexStream);

impl Peer {
    async fn hears(&mut self) -> Vec<u8> {
        let mut bytes = vec![0; 64];
        let len = self.0.read(&mut bytes).await.unwrap();
        bytes.truncate(len);
        bytes
    }

    async fn says(&mut self, bytes: &[u8]) {
        tokio::time::sleep(5 * MS).await;
        self.0.write_all(bytes).await.unwrap();
    }

    /// Takes the first poll, and acknowledges the request that follows it.
    async fn takes_request(&mut self) -> Vec<u8> {
        assert_eq!(self.hears().await, *poll(1));
        self.says(EOT).await;
        let request = self.hears().await;
        self.says(ACK).await;
        request
    }

    async fn gives_reply(&mut self, unite: &[u8]) {
        assert_eq!(self.hears().await, *poll(1));
        self.says(&reply(unite)).await;
        assert_eq!(self.hears().await, ACK);
    }
}

fn line(change: impl FnOnce(LineConfig) -> LineConfig) -> (Line, Peer) {
    let (ours, theirs) = tokio::io::duplex(1_024);
    let protocol = Protocol::UniTelway(UniTelwaySettings::default());
    let config = LineConfig { protocol, ..LineConfig::stream(serial()) };
    (Line::over(ours, change(config)), Peer(theirs))
}

#[tokio::test(start_paused = true)]
async fn an_edge_whose_acknowledgement_is_lost_has_an_unknown_outcome_and_is_sent_once() {
    let (line, mut peer) = line(|config| config);
    let slave = line.slave(1);
    let mut edge = slave.clone().with_terms(Terms::of(Class::Command).within(Duration::from_secs(9)).edge());
    let call = tokio::spawn(async move { edge.call(WRITE).await });
    assert_eq!(peer.hears().await, *poll(1));
    peer.says(EOT).await;
    peer.hears().await;
    let lost = PortError::from_modbus(call.await.unwrap().unwrap_err());
    assert_eq!(lost, PortError::OutcomeUnknown("no answer"));

    // A level is sent again, after the late window and once the slave holds nothing any more.
    let mut level = slave.with_terms(Terms::of(Class::Command).within(Duration::from_secs(9)));
    let call = tokio::spawn(async move { level.call(WRITE).await });
    assert_eq!(peer.hears().await, *poll(1));
    peer.says(EOT).await;
    let first = peer.hears().await;
    assert_eq!(peer.takes_request().await, first);
    peer.gives_reply(&[0xFE]).await;
    assert_eq!(call.await.unwrap().unwrap(), Ok(WRITTEN));
    assert_eq!(line.stats().slaves[&1].retries, 1);
}

#[tokio::test(start_paused = true)]
async fn the_specific_request_travels_as_a_command_and_brings_what_it_reads_back() {
    let (line, mut peer) = line(|config| config);
    let mut slave = line.slave(1);
    slave.set_terms(Terms::of(Class::Status));
    let command = SpecificCommand { cmd: 0x0F, frh: 500, acc: 30, dec: 40 };
    let mut unite = slave.unite();
    let call = tokio::spawn(async move { unite.command(command).await });
    let expected = reply(&[0xF2, 7, 0, 0, 0x0F, 0, 0xF4, 1, 30, 0, 40, 0]);
    assert_eq!(peer.takes_request().await, *expected);
    peer.gives_reply(&[0xF2, 0x30, 0, 0xF4, 1, 0x27, 2, 0, 0, 23, 0]).await;
    let report = SpecificReport { frh: 500, eta: 0x0227, flt: 0, lcr: 23 };
    assert_eq!(call.await.unwrap(), Ok(report));
    let stats = line.stats();
    assert_eq!((stats.class(Class::Command).sent, stats.class(Class::Status).sent), (1, 0));
}

#[tokio::test(start_paused = true)]
async fn a_slave_says_who_it_is_and_what_its_link_has_counted() {
    let (line, mut peer) = line(|config| config);
    let mut unite = line.slave(1).unite();
    let mut same = unite.clone();
    let call = tokio::spawn(async move { same.identify().await });
    assert_eq!(peer.takes_request().await, *reply(&[0x0F, 7]));
    peer.gives_reply(b"\x3F\x18\x58\x21\x0AATV58U18N4").await;
    let identity = call.await.unwrap().unwrap();
    assert_eq!((identity.product, identity.subtype, identity.version), (0x18, 0x58, 0x21));
    assert_eq!(identity.rating, "ATV58U18N4");

    let call = tokio::spawn(async move { unite.link_counters().await });
    assert_eq!(peer.hears().await, *reply(&[0xA2, 7]));
    peer.says(ACK).await;
    peer.gives_reply(&[0xD2, 1, 0, 2, 0, 3, 0, 0xFF, 0x7F]).await;
    let counters = call.await.unwrap().unwrap();
    assert_eq!((counters.sent_not_acknowledged, counters.received_refused), (1, 0x7FFF));
}

#[tokio::test(start_paused = true)]
async fn an_identification_that_is_cut_short_is_no_identification() {
    let (line, mut peer) = line(|config| config);
    let mut unite = line.slave(1).unite();
    let call = tokio::spawn(async move { unite.identify().await });
    peer.takes_request().await;
    peer.gives_reply(b"\x3F\x18\x58\x21\x0AATV58").await;
    assert!(matches!(call.await.unwrap(), Err(UniTeError::Port(PortError::Mismatch(_)))));
}

#[tokio::test(start_paused = true)]
async fn a_line_that_speaks_modbus_sends_no_unite_request() {
    let (ours, _theirs) = tokio::io::duplex(64);
    let line = Line::over(ours, LineConfig::stream(serial()));
    let refused = line.slave(1).unite().identify().await.unwrap_err();
    assert!(matches!(refused, UniTeError::Port(PortError::NotCarried(_))), "{refused}");
    assert_eq!(line.stats().slaves.get(&1).map_or(0, |slave| slave.sent), 0);
}

#[tokio::test(start_paused = true)]
async fn a_stop_waits_no_longer_than_the_line_says_behind_an_exchange_where_everything_goes_wrong() {
    let (line, mut peer) = line(|config| LineConfig { retries: 0, ..config });
    let bound = line.worst_case_stop();
    let (mut slave, mut stop) = (line.slave(1), line.slave(2).with_terms(Terms::of(Class::Stop)));
    let read = tokio::spawn(async move { slave.call(READ).await });
    assert_eq!(peer.hears().await, *poll(1));
    let called = tokio::time::Instant::now();
    let stopped = tokio::spawn(async move { stop.call(WRITE).await });
    // Two leftovers, a refused request, a damaged reply, and nothing at the end.
    for word in [1, 2] {
        peer.says(&reply(&[0x34, word, 0])).await;
        assert_eq!(peer.hears().await, ACK);
        peer.hears().await;
    }
    peer.says(NAK).await;
    peer.hears().await;
    tokio::time::sleep(90 * MS).await;
    peer.says(ACK).await;
    assert_eq!(peer.hears().await, *poll(1));
    tokio::time::sleep(90 * MS).await;
    peer.says(&[0x10, 0x02, 1, 2, 0, 0, 0]).await;
    assert_eq!(peer.hears().await, NAK);
    assert_eq!(peer.hears().await, *poll(1));
    assert_eq!(peer.hears().await, *poll(2), "the stop's exchange begins");
    assert!(called.elapsed() <= bound, "{:?} of {bound:?}", called.elapsed());
    assert!(read.await.unwrap().is_err());
    stopped.abort();
}
