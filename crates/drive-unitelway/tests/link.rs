//! Frames byte for byte, and what becomes of everything else. `unitelway_line.rs` of drive-bus has the line above it.

mod support;

use bytes::Bytes;
use drive_unitelway::{
    Failure, NetworkHeader, Refusal, Reply, Request, RequestError, Step, Stray, UniTelwaySettings,
    data_frame, poll,
};
use support::{MS, PATIENCE, Script};

const ACK: &[u8] = &[0x06];
const NAK: &[u8] = &[0x15];
const EOT: &[u8] = &[0x04];

fn read() -> Request {
    Request::read_word(400)
}

fn write() -> Request {
    Request::write_word(400, 6)
}

fn simplified(category: u8) -> UniTelwaySettings {
    UniTelwaySettings { header: NetworkHeader::Simplified, category, ..UniTelwaySettings::default() }
}

/// A machine that knows slave 1 to hold nothing.
fn settled() -> Script {
    let mut script = Script::new(UniTelwaySettings::default());
    let mark = script.ask(1, &read());
    assert_eq!(give_mark_back(&mut script, &mark), reply(&[0x04, 0x07, 0x90, 0x01]));
    acknowledge(&mut script);
    assert_eq!(take(&mut script, &reply(&[0x34, 0, 0])), Step::Done(Ok(Ok(Reply::Words(vec![0])))));
    script
}

fn sends(bytes: &[u8]) -> Step {
    Step::Send(Bytes::copy_from_slice(bytes))
}

/// The silence before a transmission passes; what is sent.
fn send(script: &mut Script) -> Bytes {
    match script.wait() {
        Step::Send(bytes) => bytes,
        step => panic!("{step:?}"),
    }
}

/// The line is free for others until the exchange goes on; what is sent then.
fn go_on(script: &mut Script, step: Step) -> Bytes {
    let Step::Wait(until) = step else { panic!("{step:?}") };
    assert!(until > script.now);
    script.resume(1, until)
}

/// The slave acknowledges the request and is polled.
fn acknowledge(script: &mut Script) {
    assert_eq!(script.hear(ACK), Step::More);
    assert_eq!(send(script), poll(1));
}

/// The slave says something that is none of what it was asked for; it is told that we have it, and the exchange goes on.
fn dropped(script: &mut Script, said: &[u8]) -> Bytes {
    assert_eq!(script.hear(said), Step::More);
    assert_eq!(*send(script), *ACK, "{said:02X?}");
    let step = script.wait();
    go_on(script, step)
}

/// The slave says its reply, is told that we have it, and has nothing more to say.
fn take(script: &mut Script, said: &[u8]) -> Step {
    assert_eq!(script.hear(said), Step::More);
    closed(script)
}

fn closed(script: &mut Script) -> Step {
    assert_eq!(*send(script), *ACK);
    assert_eq!(script.wait(), Step::More);
    send(script);
    script.hear(EOT)
}

/// A slave mirrors the number that it is asked to; what it is asked then.
fn give_mark_back(script: &mut Script, mark: &[u8]) -> Bytes {
    assert_eq!(script.hear(ACK), Step::More);
    send(script);
    let mirrored = mirrored(mark);
    dropped(script, &mirrored)
}

/// The reply to a mirror request, which has 4 bytes.
fn mirrored(mark: &[u8]) -> Bytes {
    let (slave, message) = (&mark[2], &mark[4..mark.len() - 1]);
    let (header, asked) = message.split_at(message.len() - 6);
    assert_eq!(asked[0], 0xFA, "a mirror request: {mark:02X?}");
    let number = &asked[2..];
    data_frame(*slave, &[header, &[0xFB], number].concat())
}

/// A reply of slave 1 with the standard header.
fn reply(unite: &[u8]) -> Bytes {
    data_frame(1, &[&[0x20, 0, 0xFE, 0, 0, 0], unite].concat())
}

fn unite(code_and_body: &[u8]) -> Request {
    let (code, body) = code_and_body.split_first().expect("it has a code");
    Request::other(*code, body)
}

/// Requests and replies as the link's rules make them, the 10h doubled, both checks as they are on the line.
struct Vector {
    settings: UniTelwaySettings,
    slave: u8,
    request: Request,
    sent: &'static [u8],
    reply: &'static [u8],
    answer: Reply,
}

fn vectors() -> Vec<Vector> {
    let standard = UniTelwaySettings::default();
    let with = |reply: &'static [u8]| Reply::Raw(Bytes::from_static(reply));
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
            request: Request::read_words(250, 4).unwrap(),
            sent: &[0x10, 0x02, 0x01, 0x09, 0x00, 0x36, 0x07, 0x68, 0x07, 0xFA, 0x00, 0x04, 0x00, 0xC6],
            reply: &[
                0x10, 0x02, 0x01, 0x0B, 0x00, 0x66, 0x07, 0xF4, 0x01, 0x00, 0x00, 0x10, 0x10, 0x00, 0x1E,
                0x00, 0xBE,
            ],
            answer: Reply::Words(vec![500, 0, 16, 30]),
        },
    ]
}

#[test]
fn the_test_vectors_go_both_ways_whole_byte_by_byte_and_twice_in_a_row() {
    for Vector { settings, slave, request, sent, reply, answer } in vectors() {
        let mut script = Script::new(settings);
        for round in 0..3 {
            let opening = script.ask(slave, &request);
            let asked = if round == 0 {
                script.hear(ACK);
                send(&mut script);
                script.hear(&mirrored(&opening));
                send(&mut script);
                let Step::Wait(until) = script.wait() else { panic!() };
                script.resume(slave, until)
            } else {
                opening
            };
            assert_eq!(asked, sent);
            assert_eq!(script.hear(ACK), Step::More);
            assert_eq!(send(&mut script), poll(slave));
            let step = match round {
                0 => script.hear(reply),
                1 => script.hear_one_by_one(reply),
                _ => script.hear(&[reply, reply].concat()),
            };
            assert_eq!(step, Step::More, "{request:?}");
            assert_eq!(closed(&mut script), Step::Done(Ok(Ok(answer.clone()))));
        }
    }
}

#[test]
fn a_damaged_vector_is_refused_and_polled_for_again_and_never_taken_for_another_answer() {
    let reply = reply(&[0x66, 0x07, 0xF4, 0x01, 0x10, 0x00]);
    let read = Request::read_words(250, 2).unwrap();
    for at in 0..reply.len() {
        for bit in 0..8 {
            let mut damaged = reply.to_vec();
            damaged[at] ^= 1 << bit;
            let mut script = settled();
            script.ask(1, &read);
            acknowledge(&mut script);
            script.hear(&damaged);
            let mut step = script.wait_for_step();
            if step == sends(NAK) {
                step = script.wait();
            }
            // Refused, or no beginning of a frame was left, or that of another slave's.
            assert_eq!(go_on(&mut script, step), poll(1), "after {damaged:02X?}");
            let answer = Reply::Words(vec![500, 16]);
            assert_eq!(take(&mut script, &reply), Step::Done(Ok(Ok(answer))));
        }
    }
}

#[test]
fn a_slave_that_has_nothing_to_say_yet_or_says_nothing_is_polled_again_until_its_time_is_over() {
    for says in [EOT, &[]] {
        let mut script = settled();
        script.ask(1, &write());
        let asked = script.now;
        acknowledge(&mut script);
        let not_yet = |script: &mut Script| {
            if says.is_empty() { script.wait() } else { script.hear(says) }
        };
        for _ in 0..2 {
            let step = not_yet(&mut script);
            assert_eq!(go_on(&mut script, step), poll(1));
        }
        assert_eq!(take(&mut script, &reply(&[0xFE])), Step::Done(Ok(Ok(Reply::Done))));

        let mark = script.ask(1, &write());
        if says.is_empty() {
            // What it said last may have been the answer to an earlier poll.
            give_mark_back(&mut script, &mark);
        }
        acknowledge(&mut script);
        let step = loop {
            match not_yet(&mut script) {
                step @ Step::Wait(_) => assert_eq!(go_on(&mut script, step), poll(1)),
                step => break step,
            }
        };
        assert_eq!(step, Step::Done(Err(Failure::Timeout)));
        assert!(script.now - asked >= PATIENCE);
    }
}

#[test]
fn the_polls_of_a_slave_that_needs_long_become_rarer() {
    let mut script = settled();
    script.ask(1, &write());
    acknowledge(&mut script);
    let mut polls = 0;
    while let step @ Step::Wait(_) = script.hear(EOT) {
        go_on(&mut script, step);
        polls += 1;
    }
    assert!((10..25).contains(&polls), "{polls} polls in {PATIENCE:?}");
}

#[test]
fn a_slave_is_known_to_hold_nothing_only_once_it_has_said_so_behind_its_last_reply() {
    let mut script = settled();
    script.ask(1, &write());
    acknowledge(&mut script);
    script.hear(&reply(&[0xFE]));
    assert_eq!(*send(&mut script), *ACK);
    script.wait();
    assert_eq!(send(&mut script), poll(1));
    // It has not heard our acknowledgement, and then nothing is heard of it.
    let again = dropped(&mut script, &reply(&[0xFE]));
    assert_eq!(again, poll(1));
    assert_eq!(script.wait(), Step::Done(Ok(Ok(Reply::Done))));

    let mark = script.ask(1, &write());
    assert!(mark.windows(2).any(|bytes| bytes == [0xFA, 0x07]), "{mark:02X?}");
    assert_eq!(script.hear(ACK), Step::More);
    send(&mut script);
    script.strays();
    assert_eq!(dropped(&mut script, &reply(&[0xFE])), poll(1));
    assert!(matches!(script.strays()[..], [Stray::Frame { slave: 1, function: 0xFE }]));
    let request = dropped(&mut script, &mirrored(&mark));
    assert_eq!(request, reply(&[0x14, 0x07, 0x90, 0x01, 0x06, 0x00]));
}

/// Found by `drive-fire worlds`: a status of half a second ago, which an adapter had kept, told a motor that came down as one at rest.
#[test]
fn a_reply_behind_which_the_slave_has_another_one_to_the_same_question_is_doubted() {
    for (second, is_taken) in [(&[0x34, 1, 2][..], false), (&[0x34, 0, 0], true), (&[0xFE], true)] {
        let mut script = settled();
        script.ask(1, &read());
        acknowledge(&mut script);
        // It was said to an earlier poll; what it says to this one is still to come.
        assert_eq!(script.hear(&reply(&[0x34, 0, 0])), Step::More);
        assert_eq!(*send(&mut script), *ACK);
        assert_eq!(script.wait(), Step::More);
        assert_eq!(send(&mut script), poll(1));
        assert_eq!(dropped(&mut script, &reply(second)), poll(1));
        let answer = script.hear(EOT);
        if is_taken {
            assert_eq!(answer, Step::Done(Ok(Ok(Reply::Words(vec![0])))), "{second:02X?}");
        } else {
            assert!(matches!(answer, Step::Done(Err(Failure::Doubted(_)))), "{second:02X?}: {answer:?}");
        }
    }
}

#[test]
fn two_marks_are_never_the_same() {
    let mut script = Script::new(UniTelwaySettings::default());
    let first = script.ask(1, &read());
    script.machine.abandon();
    let second = script.ask(1, &read());
    assert_ne!(first, second);
    script.hear(ACK);
    send(&mut script);
    assert_eq!(dropped(&mut script, &mirrored(&first)), poll(1), "an earlier one is no proof");
}

#[test]
fn a_slave_that_cannot_mirror_has_to_have_nothing_more_to_say() {
    let mut script = Script::new(UniTelwaySettings::default());
    script.ask(1, &read());
    script.hear(ACK);
    send(&mut script);
    let step = script.hear(EOT);
    go_on(&mut script, step);
    for left in [&[0x34, 1, 2][..], &[0xFD, 0x01], &[0xFD]] {
        assert_eq!(dropped(&mut script, &reply(left)), poll(1));
    }
    assert_eq!(script.hear(EOT), Step::More);
    assert_eq!(send(&mut script), reply(&[0x04, 0x07, 0x90, 0x01]));
}

#[test]
fn the_first_write_of_a_stop_is_sent_at_once_and_its_confirmation_is_taken_only_where_it_proves_something() {
    let mut script = Script::new(UniTelwaySettings::default());
    assert_eq!(script.ask_at_once(1, &write()), reply(&[0x14, 0x07, 0x90, 0x01, 0x06, 0x00]));
    acknowledge(&mut script);
    assert!(matches!(take(&mut script, &reply(&[0xFE])), Step::Done(Err(Failure::Doubted(_)))));
    let mark = script.ask(1, &write());
    give_mark_back(&mut script, &mark);
    acknowledge(&mut script);
    assert_eq!(take(&mut script, &reply(&[0xFE])), Step::Done(Ok(Ok(Reply::Done))));
    script.ask_at_once(1, &write());
    acknowledge(&mut script);
    assert_eq!(take(&mut script, &reply(&[0xFE])), Step::Done(Ok(Ok(Reply::Done))));
}

#[test]
fn a_refused_request_is_sent_again_once_what_the_slave_holds_is_taken() {
    let mut script = settled();
    let request = script.ask(1, &write());
    assert_eq!(script.hear(NAK), Step::More);
    assert_eq!(send(&mut script), poll(1));
    assert_eq!(dropped(&mut script, &reply(&[0x34, 1, 2])), request);
    acknowledge(&mut script);
    assert_eq!(take(&mut script, &reply(&[0xFE])), Step::Done(Ok(Ok(Reply::Done))));
}

#[test]
fn a_slave_that_goes_on_refusing_is_asked_after_pauses_and_given_up_as_busy() {
    let mut script = settled();
    let request = script.ask(1, &write());
    let (asked, mut refused) = (script.now, 0);
    let step = loop {
        refused += 1;
        match script.hear(NAK) {
            Step::More => {}
            step => break step,
        }
        assert_eq!(send(&mut script), poll(1));
        let step = script.hear(EOT);
        // The first may have been refused for the damage that it took.
        let again = if step == Step::More { send(&mut script) } else { go_on(&mut script, step) };
        assert_eq!(again, request);
    };
    assert!(matches!(step, Step::Done(Err(Failure::Refused(_)))), "{step:?}");
    assert!(script.now - asked >= UniTelwaySettings::default().busy_timeout);
    assert!((5..30).contains(&refused), "{refused} frames");
}

#[test]
fn a_refusal_among_noise_is_none_because_the_request_may_have_been_taken() {
    let mut script = settled();
    script.ask(1, &write());
    assert_eq!(script.hear(&[0xAA, 0x15]), Step::More);
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));
}

#[test]
fn a_request_that_is_not_acknowledged_is_not_sent_again() {
    let mut script = settled();
    script.ask(1, &write());
    let asked = script.now;
    assert_eq!(script.wait(), Step::Done(Err(Failure::Timeout)));
    assert!(script.now - asked < 110 * MS, "the link's own timeout, not that of the reply");
}

#[test]
fn a_reply_that_stays_damaged_is_given_up_and_one_that_breaks_off_is_damaged() {
    let mut script = settled();
    script.ask(1, &read());
    acknowledge(&mut script);
    let good = reply(&[0x34, 1, 2]);
    assert_eq!(script.hear(&good[..7]), Step::More);
    assert_eq!(script.wait_for_step(), sends(NAK));
    let step = script.wait();
    assert_eq!(go_on(&mut script, step), poll(1));
    let mut damaged = good.to_vec();
    damaged[9] ^= 1;
    assert_eq!(script.hear(&damaged), Step::Done(Err(Failure::Damaged("BCC"))));
}

#[test]
fn a_reply_to_another_request_is_taken_from_the_slave_and_is_no_answer() {
    let mut script = settled();
    script.ask(1, &read());
    acknowledge(&mut script);
    for unfit in [&[0xFE][..], &[0x34, 1], &[0x66, 7, 1, 2], &[]] {
        assert_eq!(dropped(&mut script, &reply(unfit)), poll(1), "{unfit:02X?}");
    }
    assert_eq!(dropped(&mut script, &data_frame(1, &[0x55, 0x34, 1, 2])), poll(1), "an unknown header");
    // Another slave's frame is not ours to acknowledge.
    assert_eq!(script.hear(&data_frame(2, &[0, 0x34, 1, 2])), Step::More);
    let step = loop {
        match script.wait() {
            Step::More => {}
            step @ Step::Wait(_) => assert_eq!(go_on(&mut script, step), poll(1)),
            step => break step,
        }
    };
    assert!(matches!(step, Step::Done(Err(Failure::Mismatch(_)))), "{step:?}");
}

#[test]
fn a_negative_reply_is_a_refusal_and_so_is_what_the_network_cannot_deliver() {
    let mut script = settled();
    for (answer, refusal) in [
        (reply(&[0xFD]), Refusal::Negative),
        (reply(&[0xFD, 0x06]), Refusal::Negative),
        (data_frame(1, &[0x22, 0, 0xFE, 0, 0, 0]), Refusal::Undeliverable),
    ] {
        script.ask(1, &write());
        acknowledge(&mut script);
        assert_eq!(take(&mut script, &answer), Step::Done(Ok(Err(refusal))));
    }
}

#[test]
fn an_adapter_that_echoes_is_recognised_in_every_step() {
    let mut script = Script::new(UniTelwaySettings::default());
    let mark = script.ask(1, &read());
    assert_eq!(script.hear(&mark), Step::More);
    assert!(script.machine.echoes());
    script.hear(ACK);
    send(&mut script);
    assert_eq!(script.hear(&[&poll(1)[..], &mirrored(&mark)].concat()), Step::More);
    assert_eq!(*send(&mut script), *ACK);
    let step = script.hear(ACK);
    let mut request = go_on(&mut script, step);
    assert_eq!(request, reply(&[0x04, 0x07, 0x90, 0x01]));
    for _ in 0..2 {
        assert_eq!(script.hear(&request), Step::More);
        assert_eq!(script.hear(ACK), Step::More);
        assert_eq!(send(&mut script), poll(1));
        assert_eq!(script.hear(&[&poll(1)[..], &reply(&[0x34, 6, 0])].concat()), Step::More);
        assert_eq!(*send(&mut script), *ACK);
        // The next poll waits for the echo of this acknowledgement, or that would be taken for something.
        assert_eq!(script.hear(ACK), Step::More);
        assert_eq!(send(&mut script), poll(1));
        let answer = Step::Done(Ok(Ok(Reply::Words(vec![6]))));
        assert_eq!(script.hear(&[&poll(1)[..], EOT].concat()), answer);
        request = script.ask(1, &read());
        assert_eq!(request, reply(&[0x04, 0x07, 0x90, 0x01]));
    }
    assert_eq!(script.strays().iter().filter(|stray| **stray == Stray::Echo).count(), 3 + 2 * 4);
}

#[test]
fn what_has_no_form_is_refused_before_anything_is_sent() {
    let machine = Script::new(UniTelwaySettings::default()).machine;
    assert_eq!(machine.check(0, &write()), Err(RequestError::Broadcast));
    assert_eq!(machine.check(1, &Request::mirror(&[0; 251])), Err(RequestError::TooLong(253)));
    assert_eq!(machine.check(1, &Request::mirror(&[0; 239])), Ok(()));
    assert!(unite(&[0xF2, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0]).is_write());
}
