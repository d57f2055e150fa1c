//! A line of UNI-TELWAY slaves with lawful habits of their own, and a link that loses what it can: every value is right
//! and fresh, no drive is shut out, a stop is confirmed in its bound. The slaves are `support/telway.rs`.
//!
//! Each property lives through 100 000 requests or more. `HABITS_TIMES=10 cargo test --release -p drive-bus --test
//! unitelway_habits` is ten times as many, 1 000 000 each; `HABITS_SEED=n` runs one seed again.

#![cfg(feature = "unitelway")]

mod support;

use std::{ops::Range, time::Duration};

use drive_bus::{
    LineConfig,
    protocol::{NetworkHeader, UniTelwaySettings},
};
use drive_core::Class;
use support::{
    MS,
    telway::{Ended, Faults, Habits, Telway, Unacknowledged, config},
};

const SECOND: Duration = Duration::from_secs(1);

/// A line that allows for slaves which take 150 ms for each word.
fn patient(header: NetworkHeader) -> LineConfig {
    config(UniTelwaySettings { header, link_timeout: 200 * MS, ..UniTelwaySettings::default() })
}

/// The seven habits, each alone.
fn habits() -> [(&'static str, Habits); 7] {
    let plain = Habits::plain();
    let keeps = |unacknowledged| Habits { unacknowledged, ..plain };
    [
        ("repeats", plain),
        ("forgets", keeps(Unacknowledged::Forgets)),
        ("queues", keeps(Unacknowledged::Queues)),
        ("refuses", keeps(Unacknowledged::Refuses)),
        ("silent", Habits { silent: true, unacknowledged: Unacknowledged::Queues, work: 30 * MS, ..plain }),
        ("slow", Habits { delay: 150 * MS, ..plain }),
        ("busy", Habits { busy: Some((3 * SECOND, 900 * MS)), ..plain }),
    ]
}

/// Each fault alone, at half of the replies, never twice running: a slave that forgets what is lost would never be heard.
fn faults() -> [(&'static str, Faults); 3] {
    let none = Faults { once: true, ..Faults::default() };
    [
        ("lost ACK", Faults { lost_ack: 2, ..none }),
        ("lost reply", Faults { lost_reply: 2, ..none }),
        ("damaged reply", Faults { damaged_reply: 2, ..none }),
    ]
}

/// So many seeds, or as many times as many as somebody wants.
fn seeds(count: u64) -> Range<u64> {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    match number("HABITS_SEED") {
        Some(seed) => seed..seed + 1,
        None => 0..count * number("HABITS_TIMES").unwrap_or(1),
    }
}

fn is_ok(ended: &Ended) -> bool {
    matches!(ended.outcome, Ok(Ok(_)))
}

/// What one property lived through.
#[derive(Debug, Default)]
struct Lived {
    requests: usize,
    spoilt: usize,
}

impl Lived {
    fn add(&mut self, line: &Telway) {
        self.requests += line.requests.len();
        self.spoilt += line.spoilt;
    }
}

/// Reads, writes and stops at random for so many calls, each checked for being right and fresh; then the line gets well.
fn work(line: &mut Telway, slaves: u8, calls: u32) {
    for _ in 0..calls {
        for slave in 1..=slaves {
            if line.waiting(slave) == 0 {
                // A slave that is off-line is asked again by the line.
                let _ = match line.random.below(10) {
                    0..7 => {
                        let quantity = 1 + line.random.below(3) as u16;
                        line.read(slave, quantity, Class::Status)
                    }
                    7 | 8 => line.write(slave, Class::Command),
                    _ => line.write(slave, Class::Stop),
                };
            }
        }
        line.run_for(SECOND);
    }
    line.faults = Faults::default();
    while line.run_for(30 * SECOND).is_some() {}
    for slave in 1..=slaves {
        let read = line.read(slave, 2, Class::Status).expect("no drive is shut out");
        assert!(is_ok(&line.outcome(read)), "slave {slave} answers once nothing goes wrong any more");
    }
}

#[test]
fn every_habit_with_every_fault_gives_right_and_fresh_values_and_shuts_nobody_out() {
    let mut lived = Lived::default();
    for (habit, habits) in habits() {
        for (fault, faults) in faults() {
            for seed in seeds(75) {
                eprintln!("{habit}, {fault}, seed {seed}");
                let mut line = Telway::new(seed, patient(habits.header), [habits; 2]);
                line.faults = faults;
                work(&mut line, 2, 40);
                lived.add(&line);
            }
        }
    }
    println!("each habit with each fault: {lived:?}");
}

#[test]
fn any_habits_on_one_line_where_anything_may_be_lost_give_right_and_fresh_values() {
    let mut lived = Lived::default();
    for seed in seeds(900) {
        eprintln!("seed {seed}");
        let header = if seed % 2 == 0 { NetworkHeader::Simplified } else { NetworkHeader::default() };
        let mut line = Telway::new(seed, patient(header), []);
        let mut any = Vec::new();
        for _ in 0..3 {
            let of = |n| line.random.below(n);
            let mut of = of;
            any.push(Habits {
                unacknowledged: [
                    Unacknowledged::Repeats,
                    Unacknowledged::Forgets,
                    Unacknowledged::Queues,
                    Unacknowledged::Refuses,
                ][of(4) as usize],
                silent: of(3) == 0,
                delay: MS * (1 + of(6) as u32),
                work: MS * of(400) as u32,
                busy: (of(4) == 0).then_some((3 * SECOND, 600 * MS)),
                header,
                mirrors: true,
            });
        }
        let mut line = Telway::new(seed, patient(header), any);
        line.faults =
            Faults { lost_ack: 4, lost_reply: 5, damaged_reply: 5, anything: 20, ..Faults::default() };
        work(&mut line, 3, 40);
        lived.add(&line);
    }
    println!("any habits: {lived:?}");
}

#[test]
fn a_stop_is_confirmed_in_its_bound_whatever_the_slave_does_and_the_link_loses() {
    let mut lived = Lived::default();
    for (habit, habits) in habits() {
        for (fault, faults) in faults() {
            for seed in seeds(125) {
                eprintln!("{habit}, {fault}, seed {seed}");
                let config = patient(habits.header);
                // Two losses, so three attempts at the most: each a number that is mirrored and the stop itself, of four
                // words each, and the time of a reply that does not come; and the time in which the slave is busy.
                let attempt = config.response_timeout + 200 * MS * 8;
                let bound = config.worst_case_stop(253, 253) + attempt * 3 + SECOND;
                let mut line = Telway::new(seed, config, [habits; 2]);
                for _ in 0..10 {
                    line.faults = faults;
                    let _ = line.read(1, 3, Class::Status);
                    let _ = line.read(2, 3, Class::Status);
                    let pause = Duration::from_micros(line.random.below(400_000));
                    line.run_for(pause);
                    line.faults.left = Some(2);
                    let called = line.now;
                    // As a family does: again, until it is confirmed.
                    loop {
                        let stop = line.write(1, Class::Stop).expect("a stop is always taken");
                        if is_ok(&line.outcome(stop)) {
                            break;
                        }
                    }
                    assert!(line.now - called <= bound, "{:?} of {bound:?}", line.now - called);
                }
                lived.add(&line);
            }
        }
    }
    println!("stops: {lived:?}");
}

/// A slave of each kind with whose reply to an earlier master nothing is known yet.
#[test]
fn what_an_earlier_master_left_in_a_slave_is_nobodys_answer() {
    for (habit, habits) in habits() {
        let mut line = Telway::new(0, patient(habits.header), [habits]);
        for _ in 0..2 {
            line.leave_reply(1, &[0x66, 0x07, 0xAD, 0xDE, 0xAD, 0xDE]);
        }
        let read = line.read(1, 2, Class::Status).unwrap();
        assert!(is_ok(&line.outcome(read)), "{habit}");
    }
}

#[test]
fn one_lost_acknowledgement_costs_a_drive_nothing_but_an_exchange() {
    for (habit, habits) in habits() {
        let mut line = Telway::new(0, patient(habits.header), [habits]);
        line.faults = Faults { lost_ack: 1, left: Some(1), ..Faults::default() };
        for n in 0..20 {
            let read = line.read(1, 2, Class::Status).unwrap();
            assert!(is_ok(&line.outcome(read)), "{habit}: read {n}");
        }
        assert_eq!(line.faults.left, Some(0), "{habit}: it happened");
    }
}

#[test]
fn a_slave_that_cannot_mirror_is_served_too_once_it_has_nothing_more_to_say() {
    for silent in [false, true] {
        let habits = Habits { mirrors: false, silent, ..Habits::plain() };
        let mut line = Telway::new(0, patient(habits.header), [habits]);
        line.leave_reply(1, &[0x66, 0x07, 0xAD, 0xDE, 0xAD, 0xDE]);
        for _ in 0..5 {
            let read = line.read(1, 2, Class::Status).unwrap();
            assert!(is_ok(&line.outcome(read)), "silent: {silent}");
        }
    }
}

#[test]
fn a_slow_drive_does_not_hold_the_line() {
    for silent in [false, true] {
        let slow = Habits { work: 400 * MS, silent, ..Habits::plain() };
        let config = config(UniTelwaySettings::default());
        let mut line = Telway::new(0, config, [slow, Habits::plain(), Habits::plain()]);
        let mut read = [0; 4];
        for slave in 1..=3 {
            line.read(slave, 8, Class::Status).unwrap();
        }
        while line.now < line.start + 20 * SECOND {
            let Some(ended) = line.run_for(SECOND) else { continue };
            assert!(is_ok(&ended), "{:?}", ended.outcome);
            read[usize::from(ended.slave)] += 1;
            line.read(ended.slave, 8, Class::Status).unwrap();
        }
        // A reply takes 400 ms, and with all its words the exchange of a quick one 50.
        let least = if silent { 60 } else { 120 };
        assert!(read[1] >= 15 && read[2] >= least && read[3] >= least, "silent: {silent}, {read:?}");
    }
}

/// How many of 120 reads in 12 s one slave answers, which needs so long for each reply.
fn read_in_twelve_seconds(silent: bool, work: Duration) -> u32 {
    let slave = Habits { work, silent, ..Habits::plain() };
    let mut line = Telway::new(0, config(UniTelwaySettings::default()), [slave]);
    let (mut told, mut next) = (0, line.start);
    while line.now < line.start + 12 * SECOND {
        if line.now >= next && line.waiting(1) == 0 {
            line.read(1, 4, Class::Status).unwrap();
            next = line.now + 100 * MS;
        }
        if let Some(ended) = line.run_for(MS) {
            assert!(is_ok(&ended), "{:?}", ended.outcome);
            told += 1;
        }
    }
    told
}

#[test]
fn a_slave_that_is_silent_until_it_is_ready_is_read_at_its_pace() {
    for work in [10 * MS, 30 * MS] {
        let (says_so, silent) = (read_in_twelve_seconds(false, work), read_in_twelve_seconds(true, work));
        println!("{work:?}: {says_so} of one that says so, {silent} of one that is silent");
        assert!(silent >= 85, "{silent} of 120, {says_so} of one that says so");
    }
}
