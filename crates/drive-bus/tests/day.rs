//! The whole master in virtual time: a day of 31 drives, random traffic, the bound of a Stop.

mod support;

use std::time::Duration;

use drive_bus::{Echo, LineConfig, SlaveSettings};
use drive_core::{Class, PortError, Terms, serial::SerialSettings};
use proptest::prelude::*;
use support::{
    MS,
    rig::{Faults, Rig},
};

const SECOND: Duration = Duration::from_secs(1);

fn config() -> LineConfig {
    LineConfig::stream(SerialSettings::MODBUS_DEFAULT)
}

#[test]
fn a_day_of_31_drives_with_noise_dead_drives_and_commands_and_every_answer_is_right() {
    let mut rig = Rig::new(2_026, config());
    rig.faults =
        Faults { lost: 900, flipped: 700, truncated: 1_300, noise: 500, late: 2_000, foreign: 1_100 };
    let (mut commands, mut stops, mut refused) = (0, 0, 0);
    for round in 0..8_640_u64 {
        // Every hour three other drives are without power for half of it.
        if round % 360 == 0 {
            rig.dead = (0..3).map(|n| ((round / 360 + n * 11) % 31 + 1) as u8).collect();
        }
        if round % 360 == 180 {
            rig.dead.clear();
        }
        for slave in 1..=31 {
            match rig.read(slave, (round % 100) as u16, 8, Terms::of(Class::Status).within(9 * SECOND)) {
                Ok(_) => {}
                Err(PortError::Offline { .. }) => refused += 1,
                Err(other) => panic!("{other}"),
            }
        }
        let now = rig.now;
        let command_at = now + Duration::from_millis(rig.random.below(2_000));
        rig.run_until(command_at);
        if rig.random.one_in(3) {
            let slave = (rig.random.below(31) + 1) as u8;
            let terms = Terms::of(Class::Command).within(SECOND).replacing(500);
            let value = rig.random.below(5_000) as u16;
            commands += u64::from(rig.write(slave, 500, value, terms).is_ok());
        }
        if rig.random.one_in(20) {
            let slave = (rig.random.below(31) + 1) as u8;
            rig.write(slave, 501, (round % 2) as u16, Terms::of(Class::Stop)).unwrap();
            stops += 1;
        }
        rig.run_until(now + 10 * SECOND);
    }
    let end = rig.now + 60 * SECOND;
    rig.run_until(end);
    assert_eq!(rig.waiting().count(), 0, "no request is lost");
    let counts = rig.counts;
    assert!(counts.answered > 240_000, "{counts:?}");
    assert!(commands > 2_000 && stops > 300 && refused > 10_000, "{commands} {stops} {refused}");
    let stats = rig.master.stats(rig.now);
    assert!(stats.slaves.values().all(|slave| !slave.offline), "all came back");
    assert!(stats.foreign > 100 && stats.noise_bytes > 100);
}

#[test]
fn the_same_seed_gives_the_same_day() {
    let run = |seed| {
        let mut rig = Rig::new(seed, config());
        rig.faults = Faults { lost: 9, flipped: 7, truncated: 13, noise: 5, late: 20, foreign: 11 };
        for round in 0..200 {
            let slave = (rig.random.below(31) + 1) as u8;
            let _ = rig.read(slave, round, 2, Terms::default());
            let pause = Duration::from_micros(rig.random.below(60_000));
            rig.run_until(rig.now + pause);
        }
        (rig.counts, rig.now - rig.start)
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}

#[test]
fn a_saturated_line_keeps_every_silence_and_wastes_nothing_else() {
    let mut rig = Rig::new(1, config());
    for slave in 1..=31 {
        rig.read(slave, 0, 8, Terms::default()).unwrap();
    }
    let mut served = 0;
    while served < 3_000 {
        let until = rig.now + 20 * MS;
        for _ in rig.run_until(until) {
            served += 1;
            let slave = (served % 31 + 1) as u8;
            rig.read(slave, 0, 8, Terms::default()).unwrap();
        }
    }
    let t3_5 = SerialSettings::MODBUS_DEFAULT.t3_5();
    assert_eq!(rig.counts.shortest_silence, Some(t3_5));
    assert_eq!(rig.master.stats(rig.now).lag.max(), Duration::ZERO);
}

#[test]
fn with_3_of_31_dead_the_sweep_of_the_others_takes_at_most_a_twentieth_longer() {
    let sweeps = |dead: &[u8]| {
        let mut rig = Rig::new(5, config());
        rig.dead = dead.iter().copied().collect();
        let living: Vec<u8> = (1..=31).filter(|slave| ![3, 14, 25].contains(slave)).collect();
        let all: Vec<u8> = if dead.is_empty() { living.clone() } else { (1..=31).collect() };
        let mut times = Vec::new();
        for _ in 0..150 {
            let from = rig.now;
            let mut waiting: Vec<u64> =
                all.iter().filter_map(|&slave| rig.read(slave, 0, 8, Terms::default()).ok()).collect();
            let mut last = rig.now;
            while !waiting.is_empty() {
                let until = rig.now + MS;
                for (call, _) in rig.run_until(until) {
                    waiting.retain(|waiting| *waiting != call);
                    last = rig.now;
                }
            }
            times.push(last - from);
        }
        // Until the dead ones are known to be dead they cost their timeouts.
        times.split_off(20).iter().sum::<Duration>()
    };
    let (without, with) = (sweeps(&[]), sweeps(&[3, 14, 25]));
    assert!(with * 100 <= without * 105, "{with:?} against {without:?}");
}

#[test]
fn a_stop_waits_for_the_exchange_under_way_and_no_longer_than_the_bound() {
    let slow = SlaveSettings { turnaround: 12 * MS, response_timeout: Some(300 * MS) };
    let config = LineConfig { slave_change_gap: 10 * MS, ..config() }.slave(4, slow);
    let bound = config.worst_case_stop(5, 18);
    let mut rig = Rig::new(11, config);
    rig.faults = Faults { lost: 40, flipped: 40, ..Faults::default() };
    rig.dead.insert(7);
    for round in 0..2_000_u64 {
        for slave in 1..=8 {
            let _ = rig.read(slave, 0, 8, Terms::default());
        }
        let stop_at = rig.now + Duration::from_micros(rig.random.below(300_000));
        rig.run_until(stop_at);
        let slave = (round % 8 + 1) as u8;
        rig.write(slave, 501, 0, Terms::of(Class::Stop)).unwrap();
        let until = rig.now + 2 * SECOND;
        rig.run_until(until);
    }
    let longest = rig.counts.longest_stop_wait;
    assert!(longest <= bound, "{longest:?} against {bound:?}");
    assert!(longest > 30 * MS, "some had to wait: {longest:?}");
}

#[test]
fn the_bound_of_a_stop_grows_with_what_may_be_in_front_of_it() {
    let short = config().worst_case_stop(5, 18);
    assert!(config().worst_case_stop(5, 253) > short);
    assert!(LineConfig { response_timeout: SECOND, ..config() }.worst_case_stop(5, 18) > short + 400 * MS);
    assert!(LineConfig { echo: Echo::Auto, ..config() }.worst_case_stop(5, 18) > short);
    assert!(LineConfig { broadcast_pause: SECOND, ..config() }.worst_case_stop(5, 18) > SECOND);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_every_call_ends_once_with_the_right_answer_and_no_stop_is_overtaken(
        seed in any::<u64>(),
        lost in 0_u64..20,
        flipped in 0_u64..20,
        noise in 0_u64..20,
        late in 0_u64..20,
        echo in prop::option::of(0_u64..20),
        known in any::<bool>(),
        reconnects in any::<bool>(),
    ) {
        let setting = match echo {
            None if known => Echo::Off,
            Some(_) if known => Echo::On,
            _ => Echo::Auto,
        };
        let mut rig = Rig::new(seed, LineConfig { queue_limit: 40, echo: setting, ..config() });
        rig.echo = echo;
        rig.faults = Faults { lost, flipped, truncated: flipped, noise, late, foreign: noise };
        for _ in 0..300 {
            let slave = (rig.random.below(6) + 1) as u8;
            let class = Class::ALL[rig.random.below(5) as usize];
            let mut terms = Terms::of(class);
            if rig.random.one_in(2) {
                terms = terms.within(Duration::from_millis(rig.random.below(800)));
            }
            if rig.random.one_in(4) {
                terms = terms.edge();
            }
            let address = rig.random.below(50) as u16;
            let _ = match rig.random.below(10) {
                0..6 => rig.read(slave, address, 3, terms),
                // Each write has its own value, so that a confirmation cannot be another's.
                6..9 => {
                    let value = rig.random.below(60_000) as u16;
                    rig.write(slave, 600, value, terms.replacing(600))
                }
                _ => rig.write(0, 700, 1, terms),
            };
            if rig.random.one_in(8) {
                let call = rig.waiting().next();
                if let Some(call) = call {
                    rig.withdraw(call);
                }
            }
            if rig.random.one_in(30) && !rig.dead.remove(&slave) {
                rig.dead.insert(slave);
            }
            // The connection ends and is there again; what was on its way comes over the next one.
            if reconnects && rig.random.one_in(25) {
                rig.master.handle_lost(rig.now, "the test's reason");
                let away = Duration::from_micros(rig.random.below(100_000));
                rig.run_until(rig.now + away);
                rig.master.handle_up(rig.now);
            }
            let pause = Duration::from_micros(rig.random.below(80_000));
            rig.run_until(rig.now + pause);
        }
        let end = rig.now + 120 * SECOND;
        rig.run_until(end);
        prop_assert_eq!(rig.waiting().count(), 0);
    }
}
