//! The line: times, rules, counters, and what a test can do to a slave.

use std::time::Duration;

use crate::support::{
    CMD, KEEP, LINK_LOST, OUT, RAMP, REF, Small, TIMEOUT, TURNAROUND, ask, frame, hear, read, write,
};
use drive_core::{SerialSettings, serial::CharacterFormat};
use drive_sim::{
    AddressError, Breach, Defects, Delivery, Exception, Panel, SecondMaster, SimLine, Unheard, Wiring,
};
use tokio::{io::AsyncWriteExt, time::Instant};

const PATIENCE: Duration = Duration::from_millis(500);

fn line_of(addresses: impl IntoIterator<Item = u8>) -> SimLine {
    let line = SimLine::default();
    for address in addresses {
        line.add(address, Small::new()).unwrap();
    }
    line
}

#[tokio::test(start_paused = true)]
async fn an_answer_takes_request_turnaround_and_answer_at_every_speed() {
    for (baud, micros) in [(9_600, 29_062), (19_200, 17_031), (115_200, 7_005)] {
        let settings = SerialSettings::new(baud, CharacterFormat::F8E1).unwrap();
        let line = SimLine::new(Wiring::rtu(settings));
        line.add(1, Small::new()).unwrap();
        let mut port = line.in_memory();
        // 8 characters of 11 bits, 5 ms, and 13 characters.
        let exact = settings.characters(8) + TURNAROUND + settings.characters(13);
        assert_eq!(exact.as_micros(), micros);
        let start = Instant::now();
        let answer = ask(&mut port, &read(1, 1, 4), PATIENCE).await.unwrap();
        assert_eq!(answer.len(), 13);
        // tokio's clock has steps of a millisecond.
        let taken = start.elapsed();
        assert!((exact..exact + Duration::from_millis(1)).contains(&taken), "{baud}: {taken:?}");
        let stats = line.stats();
        assert_eq!((stats.requests, stats.answers), (1, 1));
        assert_eq!((stats.characters_in, stats.characters_out), (8, 13));
        let slack = stats.ideal.abs_diff(exact + settings.t3_5());
        assert!(slack < Duration::from_micros(1), "{slack:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn character_by_character_each_arrives_with_its_last_bit() {
    let settings = SerialSettings::new(1_200, CharacterFormat::F8N1).unwrap();
    let line = SimLine::new(Wiring { delivery: Delivery::Pieces(1), ..Wiring::rtu(settings) });
    line.add(1, Small::new()).unwrap();
    let mut port = line.in_memory();
    port.write_all(&read(1, 1, 1)).await.unwrap();
    let begins = Instant::now() + settings.characters(8) + TURNAROUND;
    for count in 1..=7 {
        let heard = hear(&mut port, PATIENCE).await.unwrap();
        assert_eq!(heard.len(), 1);
        let due = begins + settings.characters(count);
        let late = Instant::now().checked_duration_since(due).unwrap();
        assert!(late < Duration::from_millis(1), "{late:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_silence_that_is_kept_is_no_violation_and_a_short_one_is_recorded() {
    let line = line_of([1]);
    let mut port = line.in_memory();
    let t3_5 = SerialSettings::MODBUS_DEFAULT.t3_5();
    ask(&mut port, &read(1, 1, 1), PATIENCE).await.unwrap();
    tokio::time::sleep(Duration::from_millis(3)).await;
    ask(&mut port, &read(1, 1, 1), PATIENCE).await.unwrap();
    assert_eq!(line.violations(), []);
    tokio::time::sleep(Duration::from_millis(1)).await;
    let at = Instant::now();
    ask(&mut port, &read(1, 1, 1), PATIENCE).await.unwrap();
    let [violation] = line.violations()[..] else { panic!("{:?}", line.violations()) };
    assert_eq!(violation.at, at);
    let Breach::Silence { kept, required } = violation.breach else { panic!("{violation:?}") };
    assert_eq!(required, t3_5);
    assert!(kept <= Duration::from_millis(1), "{kept:?}");
    assert_eq!(line.stats().shortest_silence, Some(kept));
}

#[tokio::test(start_paused = true)]
async fn two_frames_in_one_piece_follow_each_other_without_silence() {
    let line = line_of([1, 2]);
    let mut port = line.in_memory();
    let broadcast = write(0, KEEP.address(), 3);
    ask(&mut port, &[broadcast, read(1, KEEP.address(), 1)].concat(), PATIENCE).await.unwrap();
    let [violation] = line.violations()[..] else { panic!("{:?}", line.violations()) };
    assert!(matches!(violation.breach, Breach::Silence { kept: Duration::ZERO, .. }), "{violation:?}");
}

#[tokio::test(start_paused = true)]
async fn a_pause_inside_a_frame_is_recorded_and_a_long_one_ends_it() {
    let settings = SerialSettings::new(1_200, CharacterFormat::F8E1).unwrap();
    let line = SimLine::new(Wiring::rtu(settings));
    let slave = line.add(1, Small::new()).unwrap();
    let mut port = line.in_memory();
    let request = read(1, 1, 1);
    let (head, tail) = request.split_at(3);
    // 1.5 characters are 13.8 ms, 3.5 are 32.1 ms.
    for (pause, breaches, requests) in [(10, 0, 1), (20, 1, 2), (40, 1, 2)] {
        port.write_all(head).await.unwrap();
        tokio::time::sleep(settings.characters(3) + Duration::from_millis(pause)).await;
        let answer = ask(&mut port, tail, PATIENCE).await;
        assert_eq!(slave.requests(3), requests, "{pause}");
        assert_eq!(answer.is_some(), pause < 40);
        let gaps = line.violations().iter().filter(|v| matches!(v.breach, Breach::Gap { .. })).count();
        assert_eq!(gaps, breaches, "{pause}");
        tokio::time::sleep(PATIENCE).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_master_that_sends_while_a_slave_does_collides_and_both_frames_are_lost() {
    let line = line_of([1, 2]);
    let mut port = line.in_memory();
    port.write_all(&read(1, 1, 4)).await.unwrap();
    // The answer begins after 4.6 + 5 ms and takes 7.4 ms.
    tokio::time::sleep(Duration::from_millis(12)).await;
    let heard = ask(&mut port, &read(2, 1, 1), PATIENCE).await.unwrap();
    let [violation] = line.violations()[..] else { panic!("{:?}", line.violations()) };
    assert_eq!(violation.breach, Breach::Collision { slave: 1, late: false });
    assert_eq!(heard.len(), 13);
    assert_ne!(heard, frame(&heard[..11]), "the answer is damaged");
    assert_eq!(line.slave(2).unwrap().all_requests(), 0);
}

#[tokio::test(start_paused = true)]
async fn a_broadcast_is_taken_by_all_and_answered_by_none() {
    let line = line_of(1..=31);
    let mut port = line.in_memory();
    assert_eq!(ask(&mut port, &write(0, KEEP.address(), 42), PATIENCE).await, None);
    for slave in line.slaves() {
        assert_eq!(slave.peek(KEEP.address()), Some(42), "{}", slave.address());
    }
    // Reading is no function for a broadcast.
    assert_eq!(ask(&mut port, &read(0, KEEP.address(), 1), PATIENCE).await, None);
    assert_eq!(line.stats().broadcasts, 2);
}

#[tokio::test(start_paused = true)]
async fn a_damaged_frame_and_a_foreign_address_are_met_with_silence() {
    let line = line_of([1]);
    let mut port = line.in_memory();
    let mut damaged = read(1, 1, 1);
    damaged[3] ^= 1;
    assert_eq!(ask(&mut port, &damaged, PATIENCE).await, None);
    assert_eq!(ask(&mut port, &read(9, 1, 1), PATIENCE).await, None);
    assert_eq!(line.stats().bad_frames, 1);
    assert!(ask(&mut port, &read(1, 1, 1), PATIENCE).await.is_some());
}

#[tokio::test(start_paused = true)]
async fn the_limits_of_a_family_are_answered_with_their_exceptions() {
    let line = line_of([1]);
    let mut port = line.in_memory();
    let mut exception = async |body: &[u8]| {
        tokio::time::sleep(Duration::from_millis(10)).await;
        let answer = ask(&mut port, &frame(body), PATIENCE).await.unwrap();
        assert_eq!(answer, frame(&answer[..3]));
        assert_eq!(answer[1], body[1] | 0x80);
        answer[2]
    };
    assert_eq!(exception(&[1, 0x03, 0, 1, 0, 9]).await, 3, "too many words");
    assert_eq!(exception(&[1, 0x03, 0, 1, 0, 0]).await, 3, "no word");
    assert_eq!(exception(&[1, 0x03, 0, 9, 0, 1]).await, 2, "no such register");
    assert_eq!(exception(&[1, 0x03, 0xFF, 0xFF, 0, 2]).await, 2, "beyond the highest register");
    assert_eq!(exception(&[1, 0x03, 0, 100, 0, 1]).await, 4, "a rule of the family");
    assert_eq!(exception(&[1, 0x04, 0, 1, 0, 1]).await, 1, "no such function");
    assert_eq!(exception(&[1, 0x06, 0, 3, 0, 1]).await, 2, "read only");
    assert_eq!(exception(&[1, 0x06, 0, 1, 0, 2]).await, 3, "outside its range");
    assert_eq!(exception(&[1, 0x10, 0, 1, 0, 1, 3, 0, 0, 0]).await, 3, "byte count");
    assert_eq!(exception(&[1, 0x08, 0, 2, 0, 0]).await, 1, "no such sub-code");
    assert_eq!(exception(&[1, 0x08, 0, 0x0B, 0, 1]).await, 3, "data of a counter");
    line.slave(1).unwrap().refuse_next(Exception(0x22));
    assert_eq!(exception(&[1, 0x03, 0, 1, 0, 1]).await, 0x22);
    assert_eq!(line.violations(), []);
}

#[tokio::test(start_paused = true)]
async fn functions_of_any_length_are_cut_right_when_they_come_byte_by_byte() {
    let line = line_of([1]);
    let mut port = line.in_memory();
    let character = SerialSettings::MODBUS_DEFAULT.characters(1);
    let cases: [(&[u8], &[u8]); 5] = [
        (&[1, 0x10, 0, 1, 0, 2, 4, 0, 0, 0, 9], &[1, 0x10, 0, 1, 0, 2]),
        (&[1, 0x08, 0, 0, 0xA5, 0x37], &[1, 0x08, 0, 0, 0xA5, 0x37]),
        (&[1, 0x2B, 0x0E, 1, 0], b"\x01\x2B\x0E\x01\x01\x00\x00\x02\x00\x05Maker\x01\x05Small"),
        (&[1, 0x64, 1, 2, 3], &[1, 0x64, 0xAA, 1, 2, 3]),
        (&[1, 0x08, 0, 0, 1, 2, 3, 4], &[1, 0x08, 0, 0, 1, 2, 3, 4]),
    ];
    for (request, answer) in cases {
        for byte in frame(request) {
            port.write_all(&[byte]).await.unwrap();
            tokio::time::advance(character).await;
        }
        assert_eq!(hear(&mut port, PATIENCE).await, Some(frame(answer)));
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

#[tokio::test(start_paused = true)]
async fn the_counters_of_function_08_count_and_listen_only_is_left_by_a_restart() {
    let line = line_of([1]);
    let mut port = line.in_memory();
    let mut diagnose = async |sub: u8, data: u8| {
        tokio::time::sleep(Duration::from_millis(10)).await;
        ask(&mut port, &frame(&[1, 0x08, 0, sub, 0, data]), PATIENCE).await
    };
    let counter = |sub: u8, count: u8| Some(frame(&[1, 0x08, 0, sub, 0, count]));
    assert_eq!(diagnose(0x0A, 0).await, counter(0x0A, 0));
    assert_eq!(diagnose(0x0B, 1).await, Some(frame(&[1, 0x88, 3])));
    assert_eq!(diagnose(0x0D, 0).await, counter(0x0D, 1));
    assert_eq!(diagnose(0x0E, 0).await, counter(0x0E, 3));
    assert_eq!(diagnose(0x0B, 0).await, counter(0x0B, 4));
    assert_eq!(diagnose(0x04, 0).await, None);
    assert_eq!(diagnose(0x0E, 0).await, None);
    assert_eq!(diagnose(0x01, 0).await, counter(0x01, 0));
    assert_eq!(diagnose(0x0E, 0).await, counter(0x0E, 1));
}

#[tokio::test(start_paused = true)]
async fn the_event_counter_leaves_out_exceptions_and_itself() {
    let line = line_of([1]);
    let mut port = line.in_memory();
    for request in [read(1, 1, 1), read(1, 1, 9), frame(&[1, 0x0B]), write(1, KEEP.address(), 1)] {
        ask(&mut port, &request, PATIENCE).await.unwrap();
    }
    let answer = ask(&mut port, &frame(&[1, 0x0B]), PATIENCE).await;
    assert_eq!(answer, Some(frame(&[1, 0x0B, 0, 0, 0, 2])));
}

#[tokio::test(start_paused = true)]
async fn a_motor_started_over_the_line_ramps_in_the_time_its_ramp_says() {
    let line = line_of([1]);
    let slave = line.slave(1).unwrap();
    let mut port = line.in_memory();
    ask(&mut port, &write(1, REF.address(), 4_000), PATIENCE).await.unwrap();
    let start = Instant::now();
    ask(&mut port, &write(1, CMD.address(), 1), PATIENCE).await.unwrap();
    let request = SerialSettings::MODBUS_DEFAULT.characters(8);
    slave.wait_until(|seen| seen.output_frequency == 4_000).await;
    let expected = request + RAMP * 4 / 5;
    assert!((expected..expected + Duration::from_millis(2)).contains(&start.elapsed()));
    let answer = ask(&mut port, &read(1, OUT.address(), 1), PATIENCE).await;
    assert_eq!(answer, Some(frame(&[1, 0x03, 2, 0x0F, 0xA0])));
}

#[tokio::test(start_paused = true)]
async fn the_watchdog_trips_a_drive_that_hears_nothing_and_only_after_its_time() {
    let line = line_of([1]);
    let slave = line.slave(1).unwrap();
    let mut port = line.in_memory();
    tokio::time::sleep(TIMEOUT * 10).await;
    assert_eq!(slave.observe().trip, None, "the line was never used");
    ask(&mut port, &read(1, 1, 1), PATIENCE).await.unwrap();
    let heard = slave.received().last().unwrap().at;
    tokio::time::sleep_until(heard + TIMEOUT - Duration::from_millis(1)).await;
    assert_eq!(slave.observe().trip, None);
    let tripped = slave.wait_until(|seen| seen.trip.is_some()).await;
    assert_eq!(tripped.trip, Some(LINK_LOST));
    assert!(Instant::now() >= heard + TIMEOUT);
}

#[tokio::test(start_paused = true)]
async fn a_muted_slave_hears_nothing_until_it_is_connected_again() {
    let line = line_of([1, 2]);
    let slave = line.slave(1).unwrap();
    let mut port = line.in_memory();
    slave.mute();
    assert_eq!(ask(&mut port, &write(1, KEEP.address(), 1), PATIENCE).await, None);
    assert_eq!((slave.all_requests(), slave.peek(KEEP.address())), (0, Some(7)));
    assert!(ask(&mut port, &read(2, 1, 1), PATIENCE).await.is_some());
    slave.unmute();
    assert!(ask(&mut port, &write(1, KEEP.address(), 1), PATIENCE).await.is_some());
}

#[tokio::test(start_paused = true)]
async fn a_held_answer_waits_for_its_release_and_its_request_is_carried_out() {
    let line = line_of([1]);
    let slave = line.slave(1).unwrap();
    let mut port = line.in_memory();
    slave.hold_next_answer();
    let request = write(1, KEEP.address(), 1);
    assert_eq!(ask(&mut port, &request, PATIENCE).await, None);
    slave.wait_until_held().await;
    assert_eq!(slave.peek(KEEP.address()), Some(1));
    slave.release();
    assert_eq!(hear(&mut port, PATIENCE).await, Some(request));
}

#[tokio::test(start_paused = true)]
async fn a_power_cycle_forgets_ram_and_keeps_eeprom() {
    let line = line_of([1]);
    let slave = line.slave(1).unwrap();
    let mut port = line.in_memory();
    for (register, value) in [(KEEP, 9), (REF, 1_000), (CMD, 1)] {
        ask(&mut port, &write(1, register.address(), value), PATIENCE).await.unwrap();
    }
    slave.wait_until(|seen| seen.output_frequency == 1_000).await;
    slave.power_cycle();
    let seen = slave.observe();
    assert!(!seen.running && seen.eeprom_writes == 1, "{seen:?}");
    let kept = [KEEP, REF, CMD].map(|register| slave.peek(register.address()));
    assert_eq!(kept, [Some(9), Some(0), Some(0)]);
}

#[tokio::test(start_paused = true)]
async fn whoever_stands_at_the_machine_is_seen_by_the_observer() {
    let line = line_of([1]);
    let slave = line.slave(1).unwrap();
    let mut port = line.in_memory();
    for (register, value) in [(REF, 5_000), (CMD, 1)] {
        ask(&mut port, &write(1, register.address(), value), PATIENCE).await.unwrap();
    }
    let idle = slave.wait_until(|seen| seen.output_frequency == 5_000).await;
    slave.set_load(95);
    assert!(slave.observe().current > idle.current);
    slave.panel(Panel::TakeControl);
    assert!(slave.observe().local);
    slave.trip(17);
    let seen = slave.observe();
    assert_eq!((seen.trip, seen.output_frequency), (Some(17), 0));
    assert_eq!(seen.shaft_frequency, 5_000, "it coasts");
    slave.wait_until(|seen| seen.shaft_frequency == 0).await;
}

#[tokio::test(start_paused = true)]
async fn a_master_that_never_reads_does_not_stop_the_slaves() {
    let line = line_of([1]);
    let slave = line.slave(1).unwrap();
    let mut port = line.in_memory();
    for count in 1..=400 {
        port.write_all(&read(1, 1, 4)).await.unwrap();
        slave.wait_for_requests(count).await;
        tokio::time::sleep(Duration::from_millis(30)).await;
    }
    let stats = line.stats();
    assert_eq!(stats.answers, 400);
    assert!(stats.undelivered > 0 && stats.characters_out == 400 * 13);
}

#[tokio::test(start_paused = true)]
async fn utilisation_is_the_ideal_time_per_time_taken() {
    let line = line_of([1]);
    let mut port = line.in_memory();
    let t3_5 = SerialSettings::MODBUS_DEFAULT.t3_5();
    for _ in 0..100 {
        ask(&mut port, &read(1, 1, 4), PATIENCE).await.unwrap();
        tokio::time::sleep(t3_5 + Duration::from_millis(20)).await;
    }
    let stats = line.take_stats();
    let slot = stats.ideal / 100;
    let expected = slot.as_nanos() * 1_000_000 / (slot + Duration::from_millis(20)).as_nanos();
    let utilisation = u128::from(stats.utilisation(t3_5).unwrap());
    assert!(utilisation.abs_diff(expected) < 30_000, "{utilisation} {expected}");
    assert_eq!(line.stats().requests, 0);
}

#[test]
fn an_address_that_is_taken_or_is_none_is_refused() {
    let line = line_of([1]);
    assert_eq!(line.add(1, Small::new()).err(), Some(AddressError::Taken(1)));
    assert_eq!(line.add(0, Small::new()).err(), Some(AddressError::OutOfRange(0)));
    assert_eq!(line.add(248, Small::new()).err(), Some(AddressError::OutOfRange(248)));
    assert!(line.slave(2).is_none());
}

/// Omron 3G3EV at 9600 bit/s: 24 bits and 10 ms, 12.5 ms, between its answer or a request to all and the next request
/// (VS-606V7 manual p. 92, for §3.3 of the 3G3EV's).
#[tokio::test(start_paused = true)]
async fn a_request_that_cuts_a_slaves_pause_short_is_a_breach() {
    let settings = SerialSettings::new(9_600, CharacterFormat::F8N1).unwrap();
    let frame_to = |slave: u8, pdu: &[u8]| frame(&[&[slave], pdu].concat());
    let status = frame_to(1, &[3, 0, 0x2C, 0, 1]);
    let stop_all = frame_to(0, &[0x10, 0, 1, 0, 1, 2, 0, 0]);
    let mut broken = Vec::new();
    for (first, second) in [(&status, &stop_all), (&stop_all, &status), (&status, &status)] {
        for pause in [5, 20] {
            let line = SimLine::new(Wiring::rtu(settings));
            line.add(1, drive_sim::models::drive_3g3ev::Drive3g3ev::new()).unwrap();
            let mut port = line.in_memory();
            port.write_all(first).await.unwrap();
            if first == &status {
                hear(&mut port, PATIENCE).await.unwrap();
            } else {
                tokio::time::sleep(settings.characters(first.len())).await;
            }
            tokio::time::sleep(Duration::from_millis(pause)).await;
            port.write_all(second).await.unwrap();
            tokio::time::sleep(PATIENCE).await;
            let pauses = line.violations().into_iter().filter(|violation| {
                matches!(violation.breach, Breach::Pause { slave: 1, required, .. }
                    if required == Duration::from_micros(12_500))
            });
            broken.push(pauses.count());
        }
    }
    assert_eq!(broken, [1, 0, 1, 0, 1, 0]);
}

#[tokio::test(start_paused = true)]
async fn a_second_master_is_heard_whole_or_in_its_answers_or_in_its_questions() {
    let question = read(1, KEEP.address(), 1);
    // The parameter as it is delivered.
    let answer = frame(&[1, 3, 2, 0, 7]);
    let whole = [question.clone(), answer.clone()].concat();
    for (unheard, expected) in
        [(None, whole), (Some(Unheard::Requests), answer), (Some(Unheard::Answers), question)]
    {
        let line = line_of([1]);
        let requests = vec![(1, vec![3, 0, 4, 0, 1])];
        let second_master = Some(SecondMaster { requests, every: PATIENCE, unheard });
        line.set_defects(Defects { second_master, ..Defects::default() });
        let mut port = line.in_memory();
        let mut heard = Vec::new();
        // His first question comes after half a second, and is answered within thirty milliseconds.
        let until = Instant::now() + PATIENCE + Duration::from_millis(200);
        while Instant::now() < until {
            heard.extend(hear(&mut port, Duration::from_millis(50)).await.unwrap_or_default());
        }
        assert_eq!(heard, expected, "{unheard:?}");
        // Ours are heard as ever.
        let ours = ask(&mut port, &read(1, CMD.address(), 1), Duration::from_millis(100)).await;
        assert_eq!(ours, Some(frame(&[1, 3, 2, 0, 0])), "{unheard:?}");
    }
}
