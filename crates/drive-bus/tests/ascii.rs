//! Modbus ASCII: frames byte for byte, and what becomes of everything else.

#![cfg(feature = "ascii")]

mod support;

use std::{borrow::Cow, time::Duration};

use bytes::Bytes;
use drive_bus::{
    Echo, Line, LineConfig, Protocol,
    exchange::{
        Failure, Machine, Step, Stray,
        ascii::{Ascii, AsciiSettings, frame},
    },
};
use drive_core::{
    Class, PortError,
    serial::{CharacterFormat, SerialSettings},
};
use support::{MS, calls, script::Script};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::Instant;
use tokio_modbus::{ExceptionCode, Request, Response, client::Client};

/// "Writing the value 10 to the word W252 of slave 2", question and answer (VVDED397054 p. 23/47).
const PRINTED: &[u8] = b":020600FC000AF2\r\n";
const WRITE: Request<'static> = Request::WriteSingleRegister(252, 10);
const WRITTEN: Response = Response::WriteSingleRegister(252, 10);

fn settings() -> SerialSettings {
    SerialSettings::new(9_600, CharacterFormat::F7E1).unwrap()
}

fn script(echo: Echo) -> Script<Ascii> {
    Script::new(Ascii::new(settings(), AsciiSettings::default(), echo))
}

fn read(script: &mut Script<Ascii>, answer: &[u8]) -> Step {
    script.ask(1, &Request::ReadHoldingRegisters(463, 2));
    script.hear(answer)
}

fn words(step: &Step) -> Option<&[u16]> {
    match step {
        Step::Done(Ok(Ok(Response::ReadHoldingRegisters(words)))) => Some(words),
        _ => None,
    }
}

/// The change of the last character in slave 2 (function 08/03, p. 19/43).
fn change_delimiter(to: u8) -> Request<'static> {
    Request::Custom(0x08, Cow::Owned(vec![0, 3, to, 0]))
}

/// As an adapter does that keeps an answer until the next question: which of them belongs to this question nothing tells.
#[test]
fn of_two_answers_that_differ_and_come_together_none_is_believed() {
    let answers = |first: u8, second: u8| {
        [
            frame(1, &Bytes::copy_from_slice(&[3, 4, 0, first, 0, 0]), b'\n'),
            frame(1, &Bytes::copy_from_slice(&[3, 4, 0, second, 0, 0]), b'\n'),
        ]
        .concat()
    };
    let mut script = script(Echo::Off);
    let step = read(&mut script, &answers(7, 8));
    assert!(
        matches!(&step, Step::Done(Err(Failure::Mismatch(why))) if why == "two answers that differ"),
        "{step:?}"
    );
    assert_eq!(
        words(&read(&mut script, &answers(7, 7))),
        Some(&[7, 0][..]),
        "what comes twice says one thing"
    );
    // An exception says something else, too.
    let refused = [answers(7, 7), frame(1, &Bytes::copy_from_slice(&[0x83, 2]), b'\n').to_vec()].concat();
    assert!(matches!(read(&mut script, &refused), Step::Done(Err(Failure::Mismatch(_)))));
    // The answer of another slave, or to another question, belongs to nobody's question here.
    let others = [
        answers(7, 7),
        frame(2, &Bytes::copy_from_slice(&[3, 4, 0, 9, 0, 0]), b'\n').to_vec(),
        frame(1, &Bytes::copy_from_slice(&[6, 0, 1, 0, 2]), b'\n').to_vec(),
    ]
    .concat();
    assert_eq!(words(&read(&mut script, &others)), Some(&[7, 0][..]));
}

#[test]
fn the_manuals_frame_goes_both_ways_whole_byte_by_byte_and_twice_in_a_row() {
    let mut script = script(Echo::Off);
    for _ in 0..2 {
        assert_eq!(script.ask(2, &WRITE), PRINTED);
        assert_eq!(script.hear(PRINTED), Step::Done(Ok(Ok(WRITTEN))));
    }
    script.ask(2, &WRITE);
    assert_eq!(script.hear_one_by_one(PRINTED), Step::Done(Ok(Ok(WRITTEN))));
    // What comes a second time belongs to nobody.
    script.ask(2, &WRITE);
    assert_eq!(script.hear(&[PRINTED, PRINTED].concat()), Step::Done(Ok(Ok(WRITTEN))));
    assert!(matches!(script.strays()[..], [Stray::Frame { slave: 2, function: 6, .. }]));
}

#[test]
fn no_single_damage_to_the_manuals_frame_is_taken_for_its_answer_and_the_next_answer_is() {
    for at in 0..PRINTED.len() - 1 {
        for bit in 0..8 {
            let mut damaged = PRINTED.to_vec();
            damaged[at] ^= 1 << bit;
            let mut script = script(Echo::Off);
            script.ask(2, &WRITE);
            let mut step = script.hear(&damaged);
            if step == Step::More {
                step = script.wait_for_step();
            }
            assert!(matches!(step, Step::Done(Err(_))), "{damaged:02X?}: {step:?}");
            script.ask(2, &WRITE);
            assert_eq!(script.hear(PRINTED), Step::Done(Ok(Ok(WRITTEN))), "after {damaged:02X?}");
        }
    }
}

#[test]
fn an_answer_with_a_wrong_check_is_damaged_at_once_and_one_in_lower_case_too() {
    for (answer, why) in [
        (&b":010304022B006465\r\n"[..], "LRC"),
        (b":010304022b006466\r\n", "not hexadecimal"),
        (b":010304022B00646 \r\n", "not hexadecimal"),
        (b":0103\r\n", "shorter than a frame"),
        (b":01030402\r:", "it breaks off"),
    ] {
        let step = read(&mut script(Echo::Off), answer);
        assert_eq!(step, Step::Done(Err(Failure::Damaged(why))), "{}", String::from_utf8_lossy(answer));
    }
    let step = read(&mut script(Echo::Off), &frame(1, &[3, 4, 0x02, 0x2B, 0, 0x64], b'\n'));
    assert_eq!(words(&step), Some(&[0x022B, 0x64][..]));
}

#[test]
fn a_colon_begins_a_frame_wherever_it_stands() {
    let good = frame(1, &[3, 4, 0, 1, 0, 2], b'\n');
    for before in [&b"#!"[..], b":", b":02", b":0203\r", b"::::", b"\r\n", b":9"] {
        let step = read(&mut script(Echo::Off), &[before, &good].concat());
        assert_eq!(words(&step), Some(&[1, 2][..]), "{before:02X?}");
    }
}

#[test]
fn characters_may_follow_each_other_after_a_second_and_not_later() {
    let good = frame(1, &[3, 4, 0, 1, 0, 2], b'\n');
    let (first, rest) = good.split_at(9);
    let mut script = script(Echo::Off);
    read(&mut script, first);
    script.now += Duration::from_millis(990);
    assert_eq!(script.machine.handle_timeout(script.now), Step::More);
    assert_eq!(words(&script.hear(rest)), Some(&[1, 2][..]));

    read(&mut script, first);
    let began = script.now;
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Damaged("it breaks off"))));
    assert_eq!(script.now - began, Duration::from_secs(1));
}

#[test]
fn who_never_stops_talking_is_cut_off() {
    let mut script = script(Echo::Off);
    script.ask(1, &Request::ReadHoldingRegisters(0, 1));
    let mut heard = 0;
    let step = loop {
        heard += 100;
        match script.hear(&[b':'; 100]) {
            Step::More => {}
            step => break step,
        }
    };
    assert!(heard < 3_000 && matches!(step, Step::Done(Err(Failure::Damaged(_)))), "{heard}: {step:?}");
}

#[test]
fn the_last_character_follows_function_08_03_slave_by_slave() {
    let mut script = script(Echo::Off);
    let ends = |bytes: &Bytes| bytes.last().copied();
    assert_eq!(ends(&script.ask(2, &change_delimiter(b'!'))), Some(b'\n'));
    // Whether the answer to it already ends with the new character is not printed: either is heard.
    let answer = frame(2, &[8, 0, 3, b'!', 0], b'!');
    assert!(matches!(script.hear(&answer), Step::Done(Ok(Ok(_)))));
    assert_eq!(ends(&script.ask(2, &WRITE)), Some(b'!'));
    assert_eq!(script.hear(&frame(2, &[6, 0, 252, 0, 10], b'!')), Step::Done(Ok(Ok(WRITTEN))));
    assert_eq!(ends(&script.ask(3, &WRITE)), Some(b'\n'), "the others were told nothing");
    assert!(matches!(script.hear(&frame(3, &[0x86, 2], b'\n')), Step::Done(Ok(Err(_)))));

    // A power cycle: it waits for a line feed again, and is found.
    for expected in [b'!', b'!', b'\n'] {
        assert_eq!(ends(&script.ask(2, &WRITE)), Some(expected));
        if expected == b'!' {
            assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));
        }
    }
    assert_eq!(script.hear(PRINTED), Step::Done(Ok(Ok(WRITTEN))));
    assert_eq!(ends(&script.ask(2, &WRITE)), Some(b'\n'));
}

#[test]
fn a_change_of_the_last_character_that_nobody_confirmed_is_tried_both_ways() {
    let mut script = script(Echo::Off);
    script.ask(2, &change_delimiter(b'!'));
    script.wait_for_step();
    let mut tried = Vec::new();
    for _ in 0..3 {
        tried.extend(script.ask(2, &WRITE).last().copied());
        script.wait_for_step();
    }
    assert!(tried.contains(&b'!') && tried.contains(&b'\n'), "{tried:02X?}");
}

#[test]
fn a_refused_change_of_the_last_character_changes_nothing() {
    let mut script = script(Echo::Off);
    script.ask(2, &change_delimiter(b'!'));
    let refused = Step::Done(Ok(Err(ExceptionCode::IllegalDataValue)));
    assert_eq!(script.hear(&frame(2, &[0x88, 3], b'\n')), refused);
    assert_eq!(script.ask(2, &WRITE), PRINTED);
}

#[test]
fn a_last_character_that_ends_no_frame_is_never_asked_for() {
    let machine = Ascii::new(settings(), AsciiSettings::default(), Echo::Off);
    for new in [b':', 0x80, 0xFF] {
        assert!(machine.carries(2, &change_delimiter(new), Class::Background).is_err(), "{new:02X}h");
    }
    assert_eq!(machine.carries(2, &change_delimiter(b'\r'), Class::Background), Ok(()));
}

#[test]
fn foreign_late_and_unfit_frames_are_no_answer_and_are_counted() {
    let mut script = script(Echo::Off);
    script.ask(1, &Request::ReadHoldingRegisters(463, 2));
    assert_eq!(script.hear(&frame(7, &[3, 4, 0, 9, 0, 9], b'\n')), Step::More);
    assert_eq!(script.hear(&frame(1, &[4, 4, 0, 9, 0, 9], b'\n')), Step::More);
    assert_eq!(script.hear(b"\x00\x00"), Step::More);
    let strays = script.strays();
    assert!(matches!(
        strays[..],
        [
            Stray::Frame { slave: 7, function: 3, .. },
            Stray::Frame { slave: 1, function: 4, .. },
            Stray::Noise(2)
        ]
    ));
    assert!(matches!(script.wait_for_step(), Step::Done(Err(Failure::Mismatch(_)))));
    script.hear(&frame(1, &[3, 4, 0, 9, 0, 9], b'\n'));
    assert!(matches!(script.strays()[..], [Stray::Frame { slave: 1, function: 3, .. }]));
}

#[test]
fn an_echo_is_found_by_a_read_and_an_answer_that_equals_its_request_counts_the_second_time() {
    let mut script = script(Echo::Auto);
    let read = script.ask(1, &Request::ReadHoldingRegisters(463, 2));
    assert_eq!(script.hear(&read), Step::More);
    assert!(script.machine.echoes());
    assert_eq!(words(&script.hear(&frame(1, &[3, 4, 0, 1, 0, 2], b'\n'))), Some(&[1, 2][..]));
    script.ask(2, &WRITE);
    assert_eq!(script.hear(PRINTED), Step::More);
    assert_eq!(script.hear(PRINTED), Step::Done(Ok(Ok(WRITTEN))));
    // The slave is dead: its confirmation is not made up of the echo.
    script.ask(2, &WRITE);
    assert_eq!(script.hear(PRINTED), Step::More);
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));
}

#[tokio::test(start_paused = true)]
async fn a_line_speaks_ascii_and_leaves_a_late_slave_alone() {
    let (ours, mut theirs) = tokio::io::duplex(1_024);
    let ascii = Protocol::Ascii(AsciiSettings::default());
    let config = LineConfig { protocol: ascii, retries: 0, ..LineConfig::stream(settings()) };
    let line = Line::over(ours, config);
    let mut frames = vec![0; 64];

    let call = calls(line.slave(2), WRITE);
    let len = theirs.read(&mut frames).await.unwrap();
    assert_eq!(&frames[..len], PRINTED);
    let lost = PortError::from_modbus(call.await.unwrap().unwrap_err());
    assert_eq!(lost, PortError::OutcomeUnknown("no answer"));

    // The same again: its confirmation could be the first one's.
    let call = calls(line.slave(2), WRITE);
    let early = tokio::time::timeout(100 * MS, theirs.read(&mut frames)).await;
    assert!(early.is_err(), "it is asked in its late window");
    theirs.write_all(PRINTED).await.unwrap();
    let len = theirs.read(&mut frames).await.unwrap();
    theirs.write_all(&frames[..len]).await.unwrap();
    assert_eq!(call.await.unwrap().unwrap(), Ok(WRITTEN));
    assert_eq!(line.stats().slaves[&2].late, 1);
}

/// A write on a line that takes its time for characters, and when the last of it is off the line.
fn ask_in_time(script: &mut Script<Ascii>) -> (Bytes, Instant) {
    let request = script.ask(2, &WRITE);
    let end = script.now + settings().characters(request.len());
    script.machine.handle_sent(end, end + 500 * MS);
    (request, end)
}

/// The answer is there as soon as the line can carry it.
fn answered(script: &mut Script<Ascii>, end: Instant) -> Step {
    script.now = end + settings().characters(PRINTED.len()) + 5 * MS;
    script.machine.handle_bytes(script.now, PRINTED)
}

/// W:493662, W:364162 and W:201462 of `drive-fire`: what was damaged was the echo, and whoever asks again behind it speaks into the answer.
#[test]
fn an_echo_that_is_damaged_is_not_the_answer_where_the_line_carries_none_so_soon() {
    let mut script = script(Echo::Off);
    script.machine.set_far_end_paces(true);
    let (request, end) = ask_in_time(&mut script);
    let mut echo = request.to_vec();
    echo[9] ^= 0x01;
    assert_eq!(script.machine.handle_bytes(end, &echo), Step::More);
    assert_eq!(answered(&mut script, end), Step::Done(Ok(Ok(WRITTEN))));
}

#[test]
fn a_whole_echo_is_told_by_its_time_and_makes_no_confirmation_then_or_later() {
    let mut script = script(Echo::Auto);
    script.machine.set_far_end_paces(true);
    let (request, end) = ask_in_time(&mut script);
    assert_eq!(script.machine.handle_bytes(end, &request), Step::More);
    assert!(script.machine.echoes(), "no answer comes so soon");
    assert_eq!(answered(&mut script, end), Step::Done(Ok(Ok(WRITTEN))));
    assert!(script.machine.echoes());
    // The slave is dead, and the adapter holds the echo back for as long as an answer takes.
    let (_, end) = ask_in_time(&mut script);
    assert_eq!(answered(&mut script, end), Step::More);
    assert_eq!(script.wait_for_step(), Step::Done(Err(Failure::Timeout)));
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_in_ascii_waits_for_nobody() {
    let (ours, mut theirs) = tokio::io::duplex(1_024);
    let ascii = Protocol::Ascii(AsciiSettings::default());
    let line = Line::over(ours, LineConfig { protocol: ascii, ..LineConfig::stream(settings()) });
    assert_eq!(line.broadcast().call(WRITE).await.unwrap(), Ok(WRITTEN));
    let mut frame = [0; 17];
    theirs.read_exact(&mut frame).await.unwrap();
    assert_eq!(&frame, b":000600FC000AF4\r\n");
}

#[tokio::test]
async fn a_protocol_that_cannot_have_the_configured_characters_opens_no_port() {
    let config = LineConfig::serial("/dev/null", settings());
    let error = Line::open(config).await.unwrap_err();
    assert!(error.to_string().starts_with("Modbus RTU needs characters of 8 data bits, not 7E1"), "{error}");
}
