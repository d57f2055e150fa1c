//! Whatever comes in: no panic, no wait without end, no wrong answer, and the next good frame is understood.

mod support;

use bytes::Bytes;
use drive_unitelway::{Answer, Failure, Reply, Request, Step, UniTelwaySettings, data_frame};
use proptest::prelude::*;
use support::{MS, Script};

/// The longest that anything may take here: the machine's own limits, several times over.
const FOR_EVER: u32 = 60_000;

fn requests() -> impl Strategy<Value = Request> {
    prop_oneof![
        Just(Request::read_words(250, 4).unwrap()),
        Just(Request::write_word(400, 6)),
        Just(Request::write_words(400, &[6, 500]).unwrap()),
        Just(Request::mirror(&[1, 2])),
    ]
}

/// Noise, frames of the protocol, and their parts, more often than chance makes them.
fn chunks(frame: fn(u8, &[u8]) -> Vec<u8>, special: &'static [u8]) -> impl Strategy<Value = Vec<Vec<u8>>> {
    let noise = prop::collection::vec(any::<u8>(), 0..600);
    let near = prop::collection::vec(prop::sample::select(special), 0..40);
    let data = prop::collection::vec(any::<u8>(), 1..40);
    let whole = (1_u8..4, data.clone()).prop_map(move |(slave, data)| frame(slave, &data));
    let cut = (1_u8..4, data, 0_usize..30).prop_map(move |(slave, data, len)| {
        let mut frame = frame(slave, &data);
        frame.truncate(len);
        frame
    });
    prop::collection::vec(prop_oneof![noise, near, whole, cut], 0..12)
}

fn unitelway_chunks() -> impl Strategy<Value = Vec<Vec<u8>>> {
    chunks(
        |slave, unite| data_frame(slave, &[&[0], unite].concat()).to_vec(),
        &[0x10, 0x10, 0x02, 0x05, 0x01, 0x00, 0x06, 0x15, 0x04, 0x34, 0x66, 0xFD, 0xFE],
    )
}

/// An exchange in the middle of all that. True: it has ended.
fn feed(script: &mut Script, request: &Request, chunks: &[Vec<u8>]) -> bool {
    script.ask(1, request);
    for chunk in chunks {
        match script.hear(chunk) {
            Step::Done(_) => return true,
            Step::Wait(until) => drop(script.resume(1, until)),
            Step::More | Step::Send(_) => {}
        }
        assert!(script.strays().len() <= 4 * chunk.len() + 16, "strays without bound");
        if script.machine.deadline().is_some_and(|deadline| deadline <= script.now)
            && let Step::Done(_) = script.wait_or_go_on(1)
        {
            return true;
        }
    }
    false
}

/// Time alone ends it.
fn end(script: &mut Script) {
    let began = script.now;
    loop {
        if let Step::Done(_) = script.wait_or_go_on(1) {
            break;
        }
        assert!(script.now - began < FOR_EVER * MS, "the exchange never ends");
    }
    script.now += 1_000 * MS;
}

/// A whole exchange with a slave that is as it should be, until the answer has come.
fn exchange(script: &mut Script) -> Step {
    let sent = script.ask(1, &Request::read_word(0));
    play(script, sent, &data_frame(1, &[0, 0x34, 7, 0]))
}

/// Goes on with an exchange whose slave mirrors what it is asked to, and else says `reply`, until it ends.
fn play(script: &mut Script, mut sent: Bytes, reply: &[u8]) -> Step {
    let mut holds = None;
    for _ in 0..1_000 {
        let heard = match *sent {
            [0x10, 0x02, 1, len, .., 0xFA, _, a, b, c, d, _] => {
                let header = &sent[4..usize::from(len) - 2];
                holds = Some(data_frame(1, &[header, &[0xFB, a, b, c, d]].concat()).to_vec());
                vec![0x06]
            }
            [0x10, 0x02, ..] => {
                holds = Some(reply.to_vec());
                vec![0x06]
            }
            [0x10, 0x05, 1] => holds.clone().unwrap_or_else(|| vec![0x04]),
            [0x06] => {
                holds = None;
                vec![]
            }
            _ => vec![],
        };
        let step = if heard.is_empty() { Step::More } else { script.hear(&heard) };
        match if step == Step::More { script.wait_or_go_on(1) } else { step } {
            Step::Send(bytes) => sent = bytes,
            Step::Wait(until) => sent = script.resume(1, until),
            step => return step,
        }
    }
    Step::More
}

proptest! {
    #[test]
    fn the_machine_survives_anything_and_understands_the_next_reply(
        request in requests(),
        chunks in unitelway_chunks(),
    ) {
        let mut script = Script::new(UniTelwaySettings::default());
        if !feed(&mut script, &request, &chunks) {
            end(&mut script);
        }
        let step = exchange(&mut script);
        prop_assert_eq!(step, Step::Done(Ok(Ok(Reply::Words(vec![7])))));
    }

    #[test]
    fn bytes_outside_an_exchange_are_strays_and_nothing_else(chunks in unitelway_chunks()) {
        let mut script = Script::new(UniTelwaySettings::default());
        for chunk in &chunks {
            prop_assert_eq!(script.hear(chunk), Step::More);
        }
        let step = exchange(&mut script);
        prop_assert_eq!(step, Step::Done(Ok(Ok(Reply::Words(vec![7])))));
    }

    #[test]
    fn a_damaged_reply_is_never_another_answer(
        words in prop::collection::vec(any::<u16>(), 4),
        at in any::<prop::sample::Index>(),
        flipped in 0_u8..8,
    ) {
        let mut unite = vec![0, 0x66, 7];
        unite.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        let mut reply = data_frame(1, &unite).to_vec();
        let at = at.index(reply.len());
        reply[at] ^= 1 << flipped;
        let outcome = outcome_of(&reply);
        prop_assert!(outcome.is_err(), "{:02X?}: {:?}", reply, outcome);
    }
}

/// What becomes of reading four words from a slave that sends `reply` when it is polled for it, and nothing after that.
fn outcome_of(reply: &[u8]) -> Result<Answer, Failure> {
    let request = Request::read_words(250, 4).unwrap();
    let mut script = Script::new(UniTelwaySettings::default());
    let sent = script.ask(1, &request);
    match play(&mut script, sent, reply) {
        Step::Done(outcome) => outcome,
        step => panic!("{step:?}"),
    }
}

#[test]
fn a_reply_that_a_flipped_bit_makes_shorter_is_no_answer_though_its_check_fits() {
    // The length was 0Bh. After three bytes stands 83h, the first byte of the words, and it is their sum.
    let reply = [0x10, 0x02, 0x01, 0x03, 0x00, 0x66, 0x07, 0x83, 0x07, 0, 0, 0, 0, 0, 0, 0x15];
    assert_eq!(outcome_of(&reply), Err(Failure::Mismatch("0 bytes instead of 4 words".to_owned())));
}
