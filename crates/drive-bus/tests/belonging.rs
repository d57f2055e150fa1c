//! Which request an answer belongs to: doubles, stalls, late answers, strays, echoes, refusals, on a line that has no
//! transaction numbers. Each test is one fault, fed by hand.

#![cfg(feature = "tcp")]

mod support;

use std::time::Duration;

use drive_bus::{
    Echo, LineConfig, SlaveSettings,
    exchange::{Machine, Step, mbap::Mbap, rtu},
};
use drive_core::{Class, PortError, Terms, serial::SerialSettings};
use support::{
    MS,
    by_hand::{ByHand, RESPONSE},
    script::Script,
};
use tokio_modbus::{ExceptionCode, Request, Response};

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const READ: Request<'static> = Request::ReadHoldingRegisters(3201, 2);
const STOP: Request<'static> = Request::WriteSingleRegister(8501, 0);

/// A line that takes the time that its characters take.
fn config() -> LineConfig {
    LineConfig { far_end_paces: Some(true), double_window: 50 * MS, ..LineConfig::stream(SERIAL) }
}

fn once() -> LineConfig {
    LineConfig { retries: 0, ..config() }
}

/// The PDU of an answer with these words.
fn words(words: &[u16]) -> Vec<u8> {
    let bytes = words.iter().flat_map(|word| word.to_be_bytes());
    [3, words.len() as u8 * 2].into_iter().chain(bytes).collect()
}

fn read(words: &[u16]) -> Result<Result<Response, ExceptionCode>, PortError> {
    Ok(Ok(Response::ReadHoldingRegisters(words.to_vec())))
}

/// How many words a request asks for.
fn asked(request: &[u8]) -> u8 {
    assert_eq!(request[1], 3, "{request:02X?}");
    request[5]
}

#[test]
fn an_answer_that_comes_twice_is_not_the_answer_to_the_next_request() {
    for after in [3, 5, 8] {
        let mut line = ByHand::new(config());
        line.ask(1, 1, READ, Terms::default());
        line.ask(2, 1, READ, Terms::default());
        let first = line.sent();
        line.answers(&first, &words(&[1, 1]));
        let answered = line.now;
        let second = line.sent();
        assert_eq!(second, first);
        let begun = line.now;
        line.hears(answered + after * MS - line.now, &rtu::frame(1, &words(&[1, 1])));
        line.now = begun;
        line.answers(&second, &words(&[2, 2]));
        assert_eq!(line.ended(), Some((1, read(&[1, 1]))));
        assert_eq!(line.ended(), Some((2, read(&[2, 2]))), "{after} ms");
        assert_eq!(line.master.stats(line.now).slaves[&1].early, 1);
    }
}

#[test]
fn reads_that_follow_each_other_closely_differ_in_length_where_their_drive_lets_them() {
    let mut line = ByHand::new(config());
    let mut lengths = Vec::new();
    for value in 0..4 {
        line.ask(0, 1, READ, Terms::default().sparing(1));
        let request = line.sent();
        lengths.push(asked(&request));
        // The one before comes once more, when this one's answer could be there.
        let characters = SERIAL.characters(request.len() + 5 + 2 * usize::from(lengths[0]));
        if let Some(&before) = lengths.iter().rev().nth(1) {
            line.hears(characters + 4 * MS, &rtu::frame(1, &words(&vec![value - 1; before.into()])));
            assert_eq!(line.ended(), None);
        }
        line.hears(RESPONSE, &rtu::frame(1, &words(&vec![value; asked(&request).into()])));
        assert_eq!(line.ended(), Some((0, read(&[value, value]))));
    }
    assert_eq!(lengths, [2, 3, 2, 3]);
}

#[test]
fn a_far_end_that_does_not_pace_may_answer_at_once_and_the_silence_counts_from_what_the_line_takes() {
    for config in [
        LineConfig { far_end_paces: Some(false), ..config() },
        LineConfig::rtu_over_tcp("server:4001", SERIAL),
    ] {
        let mut line = ByHand::new(config);
        line.ask(1, 1, READ, Terms::default());
        line.ask(2, 2, READ, Terms::default());
        let request = line.sent();
        let begun = line.now;
        line.hears(Duration::ZERO, &rtu::frame(1, &words(&[1, 1])));
        assert_eq!(line.ended(), Some((1, read(&[1, 1]))));
        line.sent();
        assert_eq!(line.now - begun, SERIAL.characters(request.len()) + SERIAL.t3_5());
    }
}

#[test]
fn after_a_timeout_the_next_read_asks_another_length_so_that_the_late_answer_is_not_its_own() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, READ, Terms::default().sparing(3));
    assert_eq!(asked(&line.sent()), 2);
    let second = line.sent();
    assert_eq!(asked(&second), 3, "at once, and not what is owed");
    // The first answer, later than any window; the second, of three words.
    line.hears(SERIAL.characters(17) + RESPONSE, &rtu::frame(1, &words(&[1, 1])));
    assert_eq!(line.ended(), None);
    line.hears(RESPONSE, &rtu::frame(1, &words(&[2, 2, 0xFFFF])));
    assert_eq!(line.ended(), Some((1, read(&[2, 2]))));
    assert_eq!(line.master.stats(line.now).slaves[&1].late, 1);
}

#[test]
fn a_slave_has_its_pause_behind_an_answer_that_came_late() {
    let pause = SlaveSettings { turnaround: 40 * MS, ..SlaveSettings::default() };
    let terms = Terms::default().sparing(3);
    let mut line = ByHand::after_a_question_in_vain(once().slave(1, pause), READ, terms, 600 * MS);
    line.hears(RESPONSE, &rtu::frame(1, &words(&[1, 1])));
    let late = line.now;
    line.ask(2, 1, STOP, Terms::of(Class::Stop));
    line.sent();
    assert!(line.now >= late + 40 * MS, "{:?}", line.now - late);
}

/// What comes behind an answer, and nobody is owed, was its own too. A slave that never stops talking holds up no stop beyond its bound.
#[test]
fn a_stop_that_waits_gives_its_slave_its_pause_behind_a_stray_and_keeps_its_bound_behind_many() {
    let pause = SlaveSettings { turnaround: 40 * MS, ..SlaveSettings::default() };
    let answered_with_a_stop_behind = || {
        let mut line = ByHand::new(once().slave(1, pause));
        line.ask(1, 1, READ, Terms::default());
        let request = line.sent();
        line.answers(&request, &words(&[1, 1]));
        line.ask(2, 1, STOP, Terms::of(Class::Stop));
        line
    };
    let mut line = answered_with_a_stop_behind();
    line.hears(30 * MS, &rtu::frame(1, &words(&[1, 9, 9])));
    let stray = line.now;
    line.sent();
    assert!(line.now >= stray + 40 * MS, "{:?}", line.now - stray);

    let mut line = answered_with_a_stop_behind();
    let (asked, bound) = (line.now, once().slave(1, pause).worst_case_stop(8, 8));
    let sent = loop {
        if line.next_sent(line.now + 30 * MS).is_some() {
            break line.now;
        }
        line.hears(30 * MS, &rtu::frame(1, &words(&[1, 9, 9])));
        assert!(line.now < asked + 2 * bound, "it is never sent");
    };
    assert!(sent > asked + 40 * MS && sent - asked <= bound, "{:?} of {bound:?}", sent - asked);
}

#[test]
fn what_is_owed_is_asked_for_by_nobody_for_a_minute() {
    let mut line = ByHand::after_a_question_in_vain(once(), READ, Terms::default().sparing(3), 2_000 * MS);
    for _ in 0..40 {
        line.ask(2, 1, READ, Terms::default().sparing(3));
        let request = line.sent();
        assert_ne!(asked(&request), 2);
        line.answers(&request, &words(&vec![7; asked(&request).into()]));
        assert_eq!(line.ended(), Some((2, read(&[7, 7]))));
        line.sends_nothing_for(1_000 * MS);
    }
}

#[test]
fn what_is_owed_is_not_forgotten_behind_many_writes_of_other_values() {
    let mut line = ByHand::after_a_question_in_vain(once(), READ, Terms::default().sparing(3), 2_000 * MS);
    for value in 0..40 {
        line.ask(2, 1, Request::WriteSingleRegister(8502, value), Terms::default());
        let write = line.sent();
        line.answers(&write, &write[1..6]);
        assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_ok()));
        line.ask(3, 1, READ, Terms::default().sparing(3));
        let request = line.sent();
        assert_ne!(asked(&request), 2, "behind {value} writes");
        line.answers(&request, &words(&vec![7; asked(&request).into()]));
        assert_eq!(line.ended(), Some((3, read(&[7, 7]))));
        line.sends_nothing_for(300 * MS);
    }
}

#[test]
fn a_read_that_cannot_differ_waits_out_the_late_window() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, READ, Terms::default());
    let request = line.sent();
    let end = line.now + SERIAL.characters(request.len());
    line.sent();
    assert_eq!(line.now, end + config().late_window);
}

#[test]
fn after_a_stray_answer_equal_reads_alternate_their_length_for_a_minute() {
    let mut line = ByHand::new(config());
    let lengths = |line: &mut ByHand| -> Vec<u8> {
        let ask = |line: &mut ByHand| {
            line.sends_nothing_for(500 * MS);
            line.ask(1, 1, READ, Terms::default().sparing(1));
            let request = line.sent();
            line.answers(&request, &words(&vec![1; asked(&request).into()]));
            assert_eq!(line.ended(), Some((1, read(&[1, 1]))));
            asked(&request)
        };
        (0..4).map(|_| ask(line)).collect()
    };
    assert_eq!(lengths(&mut line), [2, 2, 2, 2]);
    line.hears(100 * MS, &rtu::frame(1, &words(&[9, 9])));
    let alternating = lengths(&mut line);
    assert!(alternating.windows(2).all(|pair| pair[0] != pair[1]), "{alternating:?}");
    line.sends_nothing_for(Duration::from_secs(61));
    assert_eq!(lengths(&mut line), [2, 2, 2, 2]);
}

#[test]
fn what_another_master_asks_for_is_asked_in_another_length() {
    let mut line = ByHand::new(config());
    line.ask(0, 1, READ, Terms::default().sparing(1));
    let request = line.sent();
    line.answers(&request, &words(&[1, 1]));
    assert!(line.ended().is_some());
    for value in 0..5 {
        // It asks the same slave for the same words.
        line.hears(200 * MS, &rtu::frame(1, &[3, 0x0C, 0x81, 0, 2]));
        line.ask(1, 1, READ, Terms::default().sparing(2));
        let request = line.sent();
        assert_ne!(asked(&request), 2);
        line.hears(SERIAL.characters(20) + RESPONSE, &rtu::frame(1, &words(&[0xBAD, 0xBAD])));
        line.hears(RESPONSE, &rtu::frame(1, &words(&vec![value; asked(&request).into()])));
        assert_eq!(line.ended(), Some((1, read(&[value, value]))));
    }
}

#[test]
fn a_drive_that_refuses_to_read_more_along_is_asked_for_what_is_wanted() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, READ, Terms::default().sparing(1));
    line.sent();
    let longer = line.sent();
    line.answers(&longer, &[0x83, 2]);
    let plain = line.sent();
    assert_eq!(asked(&plain), 2);
    // It may be the answer that the first question had not got.
    line.answers(&plain, &words(&[5, 5]));
    assert_eq!(line.ended(), None);
    let plain = line.sent();
    assert_eq!(asked(&plain), 2);
    line.answers(&plain, &words(&[5, 5]));
    assert_eq!(line.ended(), Some((1, read(&[5, 5]))));
}

#[test]
fn after_a_wake_up_far_behind_its_deadline_that_slave_is_asked_nothing_and_the_others_are() {
    let mut line = ByHand::new(once());
    line.ask(1, 1, READ, Terms::default());
    line.sent();
    // The process stands still for 3 s; nothing lies in the port.
    line.now += 3_000 * MS;
    let woken = line.now;
    line.master.handle_timeout(woken);
    assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_err()));
    line.ask(2, 1, Request::ReadInputRegisters(3201, 4), Terms::default().sparing(3));
    line.ask(3, 2, READ, Terms::default());
    let other = line.sent();
    assert_eq!((other[0], line.now), (2, woken));
    line.answers(&other, &words(&[3, 3]));
    assert_eq!(line.sent()[0], 1);
    assert!(line.now >= woken + config().late_window);
}

#[test]
fn a_stop_after_a_stall_is_sent_at_once_and_the_confirmation_of_the_one_before_is_not_its_own() {
    let mut line = ByHand::new(once());
    line.ask(1, 1, STOP, Terms::of(Class::Stop));
    let first = line.sent();
    line.now += 3_000 * MS;
    line.master.handle_timeout(line.now);
    assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_err()));
    let called = line.now;
    line.ask(2, 1, STOP, Terms::of(Class::Stop));
    assert_eq!((line.sent(), line.now), (first.clone(), called));
    line.answers(&first, &first[1..6]);
    let unknown = PortError::OutcomeUnknown("the answer may be that to an earlier request");
    assert_eq!(line.ended(), Some((2, Err(unknown))));
}

#[test]
fn a_late_confirmation_proves_a_write_that_is_repeated_and_none_that_followed_another() {
    let mut line = ByHand::new(once());
    let start = Request::WriteSingleRegister(8501, 15);
    for between in [false, true] {
        line.ask(1, 1, STOP, Terms::of(Class::Stop));
        let stop = line.sent();
        line.sends_nothing_for(600 * MS);
        assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_err()));
        if between {
            line.ask(2, 1, start.clone(), Terms::of(Class::Command));
            let request = line.sent();
            line.answers(&request, &request[1..6]);
            assert!(matches!(line.ended(), Some((2, Ok(_)))));
        }
        line.ask(3, 1, STOP, Terms::of(Class::Stop));
        assert_eq!(line.sent(), stop);
        line.answers(&stop, &stop[1..6]);
        let Some((3, outcome)) = line.ended() else { panic!("it has ended") };
        assert_eq!(outcome.is_ok(), !between);
        line.sends_nothing_for(2_000 * MS);
    }
}

/// The confirmation of function 10h repeats where and how much was written, and not what (Modbus Application Protocol V1.1b3, 6.12).
#[test]
fn a_confirmation_that_names_no_value_proves_none_while_that_of_another_value_is_owed() {
    let unknown = || Err(PortError::OutcomeUnknown("the answer may be that to an earlier request"));
    let write = |value: u16| Request::WriteMultipleRegisters(1, vec![value].into());
    for (value, class, wait, is_read, is_told) in [
        (0, Class::Command, 2_000, false, false),
        // A stop waits for no late window.
        (0, Class::Stop, 0, false, false),
        // The same once more: whichever of the two was answered, the value is there.
        (64, Class::Command, 2_000, false, true),
        // Behind the late window the slave has answered something else: what it was asked before is over.
        (0, Class::Command, 2_000, true, true),
    ] {
        let command = Terms::of(Class::Command);
        let mut line = ByHand::after_a_question_in_vain(once(), write(64), command, 600 * MS);
        line.sends_nothing_for(wait * MS);
        if is_read {
            line.ask(2, 1, READ, Terms::default());
            let request = line.sent();
            line.answers(&request, &words(&vec![1; asked(&request).into()]));
            assert!(matches!(line.ended(), Some((2, Ok(_)))));
        }
        line.ask(3, 1, write(value), Terms::of(class));
        let request = line.sent();
        line.answers(&request, &request[1..6]);
        let done = Ok(Ok(Response::WriteMultipleRegisters(1, 1)));
        assert_eq!(
            line.ended(),
            Some((3, if is_told { done } else { unknown() })),
            "{value} {class:?} {is_read}"
        );
    }
}

#[test]
fn an_answer_that_came_while_the_host_was_away_from_its_own_writing_proves_nothing() {
    let mut line = ByHand::new(once());
    line.ask(1, 1, READ, Terms::default());
    let until = line.now + 1_000 * MS;
    let request = line.next_written(until).expect("a request");
    // Between the decision and the return of the write the process stands still.
    line.now += 1_000 * MS;
    line.master.handle_sent(line.now);
    line.answers(&request, &words(&[1, 1]));
    assert!(matches!(line.ended(), Some((1, Err(PortError::Mismatch(_))))));
}

#[test]
fn two_answers_that_differ_and_come_together_are_none() {
    let mut line = ByHand::new(once());
    line.ask(1, 1, READ, Terms::default());
    let request = line.sent();
    let both = [rtu::frame(1, &words(&[1, 1])), rtu::frame(1, &words(&[2, 2]))].concat();
    line.hears(SERIAL.characters(request.len() + both.len()) + RESPONSE, &both);
    assert!(matches!(line.ended(), Some((1, Err(PortError::Mismatch(_))))));
}

#[test]
fn a_damaged_echo_of_an_adapter_that_was_taken_for_silent_is_no_damaged_answer() {
    for config in [config(), LineConfig { far_end_paces: Some(false), ..config() }] {
        let mut line = ByHand::new(LineConfig { echo: Echo::Off, ..config });
        line.ask(1, 1, READ, Terms::default());
        line.ask(2, 1, READ, Terms::default());
        let request = line.sent();
        let mut echo = request.clone();
        echo[4] ^= 0x10;
        line.hears(SERIAL.characters(request.len()), &echo);
        line.sends_nothing_for(40 * MS);
        line.hears(RESPONSE, &rtu::frame(1, &words(&[1, 1])));
        assert_eq!(line.ended(), Some((1, read(&[1, 1]))));
        let request = line.sent();
        line.answers(&request, &words(&[2, 2]));
        assert_eq!(line.ended(), Some((2, read(&[2, 2]))));
    }
}

#[test]
fn the_echo_of_a_write_is_no_confirmation_though_the_adapter_was_taken_for_silent() {
    for alive in [false, true] {
        let mut line = ByHand::new(LineConfig { echo: Echo::Off, ..once() });
        line.ask(1, 1, STOP, Terms::of(Class::Command));
        let request = line.sent();
        line.hears(SERIAL.characters(request.len()), &request);
        assert_eq!(line.ended(), None);
        if alive {
            line.hears(SERIAL.characters(8) + RESPONSE, &request);
            assert!(matches!(line.ended(), Some((1, Ok(_)))));
        } else {
            line.sends_nothing_for(1_000 * MS);
            assert_eq!(line.ended(), Some((1, Err(PortError::OutcomeUnknown("no answer")))));
        }
    }
}

#[test]
fn over_tcp_an_answer_that_comes_damaged_and_then_good_is_not_that_to_the_retry() {
    let mut line = ByHand::new(LineConfig::rtu_over_tcp("server:4001", SERIAL));
    line.ask(1, 1, READ, Terms::default());
    let first = line.sent();
    let good = rtu::frame(1, &words(&[1, 1]));
    let mut damaged = good.to_vec();
    damaged[5] ^= 0x04;
    line.hears(30 * MS, &damaged);
    line.hears(60 * MS, &good);
    assert_eq!(line.ended(), None);
    assert_eq!(line.sent(), first);
    line.answers(&first, &words(&[2, 2]));
    assert_eq!(line.ended(), Some((1, read(&[2, 2]))));
}

#[test]
fn a_refusal_that_may_be_that_of_an_earlier_request_is_not_taken() {
    let mut line = ByHand::after_a_question_in_vain(once(), READ, Terms::default(), 600 * MS);
    // Another length, so that it need not wait; the late answer is a refusal.
    line.ask(2, 1, Request::ReadHoldingRegisters(3201, 5), Terms::default());
    let request = line.sent();
    line.answers(&request, &[0x83, 2]);
    assert!(matches!(line.ended(), Some((2, Err(PortError::Mismatch(_))))));
}

#[test]
fn a_write_that_is_refused_when_it_is_sent_again_has_an_unknown_outcome() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, STOP, Terms::of(Class::Command));
    line.sent();
    // Its confirmation is lost. The drive refuses the second, because the first was carried out.
    let again = line.sent();
    line.answers(&again, &[0x86, 4]);
    let unknown = PortError::OutcomeUnknown("not answered, and refused when it was repeated");
    assert_eq!(line.ended(), Some((1, Err(unknown))));
}

#[test]
fn on_a_line_that_is_never_quiet_calls_end_and_a_stop_is_sent() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, READ, Terms::default());
    let mut sent: Vec<Vec<u8>> = Vec::new();
    for _ in 0..3_000 {
        line.master.handle_bytes(line.now, &[0x55]);
        let until = line.now + MS;
        sent.extend(line.next_sent(until));
        line.now = until;
    }
    assert!(sent.is_empty());
    let ended = line.ended();
    let Some((1, Err(error @ PortError::NeverQuiet { .. }))) = ended else { panic!("{ended:?}") };
    assert!(error.to_string().starts_with("the line is never quiet: something else is sending"), "{error}");
    assert_eq!(line.master.stats(line.now).never_quiet, 1);
    line.ask(2, 1, STOP, Terms::of(Class::Stop));
    let called = line.now;
    while sent.is_empty() && line.now < called + 1_000 * MS {
        line.master.handle_bytes(line.now, &[0x55]);
        let until = line.now + MS;
        sent.extend(line.next_sent(until));
        line.now = until;
    }
    assert_eq!(sent[0][1], 6);
    assert!(line.now - called <= config().worst_case_stop(5, 5) + MS);
}

#[test]
fn the_time_of_the_next_probe_is_never_said_to_be_nothing() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, READ, Terms::default());
    for _ in 0..=config().retries {
        line.sent();
    }
    line.sends_nothing_for(600 * MS);
    for _ in 0..40 {
        let Err(error @ PortError::Offline { .. }) = line.submit(2, 1, READ, Terms::default()) else {
            panic!("it is off-line")
        };
        assert!(!error.to_string().contains("in 0"), "{error}");
        line.next_sent(line.now + 100 * MS);
        line.now += 100 * MS;
    }
}

#[test]
fn on_an_idle_line_an_off_line_slave_is_probed_without_back_off() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, READ, Terms::default());
    for _ in 0..=config().retries {
        line.sent();
    }
    let mut last = line.now;
    for _ in 0..10 {
        line.sent();
        assert!(line.now - last <= 3_000 * MS, "{:?}", line.now - last);
        last = line.now;
    }
}

/// Of a slave that is off-line and answers two words where one is asked for, or damaged, as of one that is mute: 0.5 s, then twice as long
/// each time, up to 10 s.
#[test]
fn an_off_line_slave_whose_answers_are_none_is_probed_with_back_off_while_others_are_asked() {
    let probes = |answer: &dyn Fn(&mut ByHand, &[u8])| {
        let mut line = ByHand::new(LineConfig { offline_after: 1, ..once() });
        line.ask(1, 1, READ, Terms::default());
        line.sent();
        while line.ended().is_none() {
            line.now += 50 * MS;
            line.master.handle_timeout(line.now);
        }
        let (end, mut probes) = (line.now + 60_000 * MS, 0);
        line.ask(2, 2, READ, Terms::default());
        while line.now < end {
            let request = line.sent();
            if request[0] == 1 {
                probes += 1;
                answer(&mut line, &request);
            } else {
                line.answers(&request, &words(&vec![1; asked(&request).into()]));
            }
            if line.ended().is_some() {
                line.ask(2, 2, READ, Terms::default());
            }
        }
        probes
    };
    let mute = probes(&|_, _| ());
    let of_another_length = probes(&|line, request| {
        let more = usize::from(asked(request)) + 1;
        line.answers(request, &words(&vec![1; more]));
    });
    let damaged = probes(&|line, request| {
        let mut answer = rtu::frame(request[0], &words(&vec![1; asked(request).into()])).to_vec();
        answer[4] ^= 0x10;
        line.hears(SERIAL.characters(request.len() + answer.len()) + RESPONSE, &answer);
    });
    assert!((8..=12).contains(&mute), "{mute}");
    assert_eq!(
        [of_another_length, damaged].map(|probes| probes <= mute),
        [true; 2],
        "{of_another_length}, {damaged}"
    );
}

#[test]
fn a_modbus_tcp_answer_that_lay_in_the_socket_before_its_request_was_sent_is_none() {
    let mut script = Script::new(Mbap::new());
    let first = script.ask(1, &READ);
    let number = u16::from_be_bytes([first[0], first[1]]);
    let answer = |number: u16, word: u8| {
        let [high, low] = number.to_be_bytes();
        vec![high, low, 0, 0, 0, 7, 1, 3, 4, 0, word, 0, word]
    };
    // The server guesses the next number, and sends half of the guess after that.
    let guess = answer(number.wrapping_add(1), 0xBB);
    assert!(matches!(script.hear(&[answer(number, 1), guess.clone()].concat()), Step::Done(Ok(Ok(_)))));
    script.ask(1, &READ);
    assert_eq!(script.hear(&[]), Step::More);
    let right = |word: u16| Step::Done(Ok(Ok(Response::ReadHoldingRegisters(vec![word, word]))));
    assert_eq!(script.hear(&answer(number.wrapping_add(1), 2)), right(2));
    let guess = answer(number.wrapping_add(2), 0xBB);
    script.machine.handle_bytes(script.now, &guess[..7]);
    script.ask(1, &READ);
    assert_eq!(script.hear(&guess[7..]), Step::More);
    assert_eq!(script.hear(&answer(number.wrapping_add(2), 3)), right(3));
}

#[test]
fn a_far_end_that_is_faster_than_it_is_said_to_be_is_told_and_read_when_that_is_set() {
    // An adapter without a UART: what it answers is there before a line could carry it.
    let hurries = |config: LineConfig| {
        let mut line = ByHand::new(config);
        line.ask(1, 1, READ, Terms::default());
        let until = line.now + 5_000 * MS;
        while let Some(request) = line.next_sent(until) {
            let answer = words(&vec![7; asked(&request).into()]);
            line.hears(MS, &rtu::frame(1, &answer));
        }
        line
    };
    let mut told = hurries(config());
    assert!(told.ended().is_some_and(|(_, outcome)| outcome.is_err()));
    assert!(told.master.stats(told.now).is_faster_than_configured());
    let mut set = hurries(LineConfig { far_end_paces: Some(false), ..config() });
    assert_eq!(set.ended(), Some((1, read(&[7, 7]))));
    assert!(!set.master.stats(set.now).is_faster_than_configured());
}
