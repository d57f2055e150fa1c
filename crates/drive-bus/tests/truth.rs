//! Every value belongs to its request: faults, doubles, stalls, strangers and servers by the hundred thousand, each seed a
//! story that can be told again. `DRIVED_TRUTH_EXCHANGES` is how many exchanges each story has: 100 000 by default,
//! 1 000 000 for the full count; `DRIVED_TRUTH_SEED` is where its seeds begin.

#![cfg(feature = "tcp")]

mod support;

use std::{env, time::Duration};

use drive_bus::{Echo, LineConfig};
use drive_core::serial::SerialSettings;
use support::truth::{Counts, Faults, TruthLine, run};

/// How many exchanges one seed lives through.
const CHAPTER: u64 = 2_000;

fn number(variable: &str, default: u64) -> u64 {
    env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// A line that takes the time that its characters take.
fn line() -> LineConfig {
    LineConfig {
        far_end_paces: Some(true),
        double_window: Duration::from_millis(50),
        ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT)
    }
}

fn server() -> LineConfig {
    LineConfig::rtu_over_tcp("server:4001", SerialSettings::MODBUS_DEFAULT)
}

/// Tells the story with as many seeds as it takes; no value is wrong, and most are there.
fn tell(name: &str, config: &LineConfig, spare: u8, faults: Faults) {
    tell_slowly(name, config, spare, faults, Duration::from_millis(30));
}

/// The same with longer pauses between the questions.
fn tell_slowly(name: &str, config: &LineConfig, spare: u8, faults: Faults, pause: Duration) {
    let exchanges = number("DRIVED_TRUTH_EXCHANGES", 100_000);
    let first = number("DRIVED_TRUTH_SEED", 1);
    let mut sum = Counts::default();
    for seed in first.. {
        let mut line = TruthLine::new(seed, config.clone(), faults);
        run(&mut line, (seed % 3 + 1) as u8, spare, pause, CHAPTER.min(exchanges));
        let counts = line.counts;
        assert_eq!((counts.wrong, counts.unfounded), (0, 0), "{name}: DRIVED_TRUTH_SEED={seed}: {counts:?}");
        sum.exchanges += counts.exchanges;
        sum.right += counts.right;
        sum.failed += counts.failed;
        sum.writes += counts.writes;
        sum.faults += counts.faults;
        if sum.exchanges >= exchanges {
            break;
        }
    }
    println!("{name}: {sum:?}");
    assert!(sum.right > sum.exchanges / 4, "{name}: {sum:?}");
}

#[test]
fn answers_that_come_twice() {
    for spare in [1, 3] {
        tell("doubles", &line(), spare, Faults { double: (15, 17), ..Faults::default() });
    }
}

#[test]
fn answers_that_come_twice_before_the_line_can_have_carried_another() {
    tell("doubles of what cannot differ", &line(), 0, Faults { double: (15, 7), ..Faults::default() });
}

#[test]
fn a_process_that_stands_still() {
    for spare in [0, 1] {
        tell("stalls", &line(), spare, Faults { stall: (40, 3_000), ..Faults::default() });
    }
}

#[test]
fn answers_that_come_late_in_their_window() {
    tell("late", &line(), 0, Faults { late: (40, 240), lost: 50, refused: 30, ..Faults::default() });
}

#[test]
fn answers_that_come_later_than_any_window() {
    let faults = Faults { late: (20, 20_000), lost: 50, ..Faults::default() };
    tell_slowly("very late", &line(), 3, faults, Duration::from_secs(2));
}

#[test]
fn another_master_that_asks_for_the_same() {
    tell("second master", &line(), 3, Faults { second_master: 20, ..Faults::default() });
}

#[test]
fn adapters_that_echo_now_and_then_and_damage_their_echoes() {
    for echo in [Echo::Off, Echo::On, Echo::Auto] {
        let config = LineConfig { echo, ..line() };
        let faults = Faults { echo: 3, lost: 40, damaged: (40, 15), ..Faults::default() };
        tell("echoes", &config, 1, faults);
    }
}

#[test]
fn a_far_end_that_does_not_pace_doubles_stalls_and_is_late() {
    let faults =
        Faults { double: (15, 17), late: (40, 20_000), lost: 100, stall: (200, 3_000), ..Faults::default() };
    tell("unpaced", &LineConfig { far_end_paces: None, ..line() }, 3, faults);
}

#[test]
fn a_serial_server_that_doubles_damages_and_stalls() {
    let faults = Faults { double: (15, 17), damaged: (40, 300), stall: (200, 3_000), ..Faults::default() };
    tell("RTU over TCP", &server(), 3, faults);
}

#[test]
fn a_modbus_tcp_server_that_guesses_doubles_and_is_late() {
    let faults = Faults {
        double: (15, 100),
        late: (40, 5_000),
        stall: (200, 3_000),
        guessed: 10,
        ..Faults::default()
    };
    tell("Modbus TCP", &LineConfig::modbus_tcp("server:502"), 0, faults);
}

#[test]
fn everything_at_once() {
    let faults = Faults {
        double: (100, 17),
        late: (200, 5_000),
        lost: 100,
        damaged: (100, 15),
        stall: (500, 3_000),
        second_master: 0,
        echo: 50,
        refused: 200,
        guessed: 0,
    };
    tell("everything", &line(), 3, faults);
}
