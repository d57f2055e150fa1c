//! A stop is never late: not for a dead drive, not for noise, not for a probe, and never later than the line says.

#![cfg(feature = "tcp")]

mod support;

use std::time::Duration;

use drive_bus::{Gateway, LineConfig, SlaveSettings, exchange::rtu};
use drive_core::{Class, Terms, serial::SerialSettings};
use support::{MS, by_hand::ByHand};
use tokio_modbus::Request;

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const READ: Request<'static> = Request::ReadHoldingRegisters(3201, 1);
const STOP: Request<'static> = Request::WriteSingleRegister(8501, 0);

fn config() -> LineConfig {
    LineConfig::stream(SERIAL)
}

fn stop() -> Terms {
    Terms::of(Class::Stop)
}

/// A line on which these slaves have answered before, so that their timeouts are learned.
fn acquainted(config: LineConfig, slaves: &[u8]) -> ByHand {
    let mut line = ByHand::new(config);
    for &slave in slaves {
        line.ask(0, slave, READ, Terms::default());
        let request = line.sent();
        line.answers(&request, &[3, 2, 0, 1]);
        assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_ok()));
    }
    line
}

#[test]
fn the_second_attempt_to_stop_a_dead_drive_waits_for_the_first_of_every_other() {
    let mut line = acquainted(config(), &[1, 2, 3]);
    for slave in 1..=3 {
        line.ask(u32::from(slave), slave, STOP, stop());
    }
    // Drives 1 and 2 are dead.
    let stopped: Vec<u8> = (0..5)
        .map(|_| {
            let request = line.sent();
            if request[0] == 3 {
                line.answers(&request, &request[1..6]);
            }
            request[0]
        })
        .collect();
    assert_eq!(stopped, [1, 2, 3, 1, 2]);
}

#[test]
fn noise_holds_a_stop_up_for_one_frame_and_everything_else_as_long_as_it_lasts() {
    let mut line = acquainted(config(), &[1]);
    let bound = config().worst_case_stop(8, 8);
    line.ask(1, 1, Request::WriteSingleRegister(8502, 1), Terms::of(Class::Command));
    let babble = |line: &mut ByHand| {
        line.master.handle_bytes(line.now, &[0x55]);
        let until = line.now + MS;
        let sent = line.next_sent(until);
        line.now = until;
        sent
    };
    for _ in 0..2_000 {
        assert_eq!(babble(&mut line), None);
    }
    line.ask(2, 1, STOP, stop());
    let called = line.now;
    let mut attempts = 0;
    // The stop is sent into the noise, and again as often as any level is.
    for _ in 0..10_000 {
        if let Some(request) = babble(&mut line) {
            assert_eq!(request, rtu::frame(1, &[6, 0x21, 0x35, 0, 0]));
            attempts += 1;
            assert!(
                line.now - called <= bound * attempts,
                "attempt {attempts} after {:?}",
                line.now - called
            );
        }
    }
    assert_eq!(attempts, 1 + config().retries);
}

#[test]
fn a_stop_called_while_a_probe_is_being_written_waits_until_that_is_off_the_line() {
    let mut line = ByHand::new(config());
    line.ask(1, 1, READ, Terms::default());
    for _ in 0..=config().retries {
        line.sent();
    }
    let until = line.now + 5_000 * MS;
    let probe = line.next_written(until).expect("a probe");
    assert!(line.master.stats(line.now).slaves[&1].offline);
    line.ask(2, 2, STOP, stop());
    // The port takes it a moment later.
    line.now += MS;
    let taken = line.now;
    line.master.handle_sent(taken);
    assert_eq!(line.sent()[0], 2);
    let frame = SERIAL.characters(probe.len());
    assert_eq!(line.now - taken, frame + config().silence());
}

#[test]
fn a_command_goes_before_a_probe_and_a_stream_of_them_delays_it_by_a_second_at_most() {
    let mut line = acquainted(config(), &[2]);
    // It has never answered, and others have: one short question is enough.
    line.ask(1, 1, READ, Terms::default());
    line.sent();
    let command = |line: &mut ByHand| {
        line.ask(2, 2, Request::WriteSingleRegister(8502, 1), Terms::of(Class::Command));
    };
    command(&mut line);
    let start = line.now;
    loop {
        let request = line.sent();
        if request[0] == 1 {
            break;
        }
        line.answers(&request, &request[1..6]);
        command(&mut line);
    }
    let first = line.now - start;
    // Due after half a second, aged after another.
    assert!(first > 1_500 * MS && first < 2_500 * MS, "{first:?}");
}

#[test]
fn the_bound_of_a_stop_holds_on_modbus_tcp_with_a_slaves_own_pause() {
    let pause = SlaveSettings { turnaround: 200 * MS, ..SlaveSettings::default() };
    let config = LineConfig {
        response_timeout: 50 * MS,
        broadcast_pause: 50 * MS,
        ..LineConfig::modbus_tcp("gateway:502")
    }
    .slave(1, pause);
    let bound = config.worst_case_stop(5, 5);
    let mut line = ByHand::new(config);
    line.ask(1, 1, READ, Terms::default());
    let request = line.sent();
    line.hears(20 * MS, &[request[0], request[1], 0, 0, 0, 5, 1, 3, 2, 0, 1]);
    assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_ok()));
    let called = line.now;
    line.ask(2, 1, STOP, stop());
    line.sent();
    assert_eq!(line.now - called, 200 * MS);
    assert!(line.now - called <= bound, "{bound:?}");
}

#[test]
fn the_bound_of_a_stop_holds_on_an_unpaced_stream_whose_slave_dribbles() {
    let config =
        LineConfig { response_timeout: 50 * MS, broadcast_pause: 50 * MS, unpaced: true, ..config() };
    let bound = config.worst_case_stop(5, 5);
    let mut line = ByHand::new(config);
    line.ask(1, 1, READ, Terms::default());
    line.sent();
    let called = line.now;
    line.ask(2, 1, STOP, stop());
    let tenth = MS / 10;
    while line.next_sent(line.now + tenth).is_none() {
        line.now += tenth;
        line.master.handle_bytes(line.now, &[1]);
        assert!(line.now - called <= bound + tenth, "{bound:?}");
    }
}

#[test]
fn while_a_stops_confirmation_waits_for_a_late_answer_the_other_watchdogs_are_fed() {
    let mut line = acquainted(LineConfig { retries: 0, ..config() }, &[1, 2]);
    line.ask(1, 1, READ, Terms::default());
    let asked = line.sent();
    let late_until = line.now + SERIAL.characters(asked.len()) + config().late_window;
    let until = line.now + 200 * MS;
    assert_eq!(line.next_sent(until), None);
    // Slave 1 is mute: its stop is confirmed by a read that waits until no late answer can be taken for its own.
    line.ask(2, 1, READ, stop());
    let mut fed = 0;
    loop {
        line.ask(3, 2, READ, Terms::of(Class::KeepAlive));
        let request = line.sent();
        if request[0] == 1 {
            break;
        }
        fed += 1;
        line.answers(&request, &[3, 2, 0, 1]);
    }
    assert!(fed > 5, "{fed}");
    // It is the next but one frame.
    assert!(line.now >= late_until && line.now < late_until + 40 * MS);
}

#[test]
fn stops_of_dead_drives_that_are_repeated_for_ever_take_a_fifth_of_the_line_together() {
    let mut line = acquainted(config(), &[1, 2, 3, 9]);
    for slave in 1..=3 {
        line.ask(u32::from(slave), slave, STOP, stop());
    }
    line.ask(9, 9, READ, Terms::of(Class::KeepAlive));
    let (mut fed, mut stops) = (Duration::ZERO, 0);
    let until = line.now + Duration::from_secs(300);
    while let Some(request) = line.next_sent(until) {
        let begun = line.now;
        if request[0] == 9 {
            line.answers(&request, &[3, 2, 0, 1]);
            fed += line.now - begun;
        } else if request[1] == 6 {
            stops += 1;
        }
        while let Some((caller, outcome)) = line.ended() {
            match caller {
                9 => line.ask(9, 9, READ, Terms::of(Class::KeepAlive)),
                // Whoever asked for the stop asks again at once.
                slave => {
                    assert!(outcome.is_err());
                    line.ask(slave, slave as u8, STOP, stop());
                }
            }
        }
    }
    // Half a second each, and four times as much for the others.
    assert!((110..=130).contains(&stops), "{stops}");
    assert!(fed > Duration::from_secs(180), "{fed:?}");
}

#[test]
fn the_repeated_stop_of_a_dead_drive_finds_it_back_and_probes_of_others_go_on_meanwhile() {
    let mut line = acquainted(config(), &[1, 2, 3]);
    line.ask(2, 2, READ, Terms::default());
    line.ask(1, 1, STOP, stop());
    line.ask(3, 3, STOP, stop());
    let (mut stops, mut asked) = (0, 0);
    let begun = line.now;
    let heard = loop {
        // Whoever asked for a stop asks again at once, so that one always waits.
        while let Some((caller, _)) = line.ended() {
            if caller != 2 {
                line.ask(caller, caller as u8, STOP, stop());
            }
        }
        let until = line.now + 10 * MS;
        match line.next_sent(until) {
            Some(request) if request[..2] == [1, 6] => stops += 1,
            Some(request) => asked += u32::from(request[0] == 2),
            None => line.now = until,
        }
        if stops == 12 && line.master.is_busy() {
            break line.now;
        }
        assert!(line.now - begun < Duration::from_secs(120));
    };
    // Beyond the attempts before it was off-line.
    assert!(asked > config().retries + 1, "{asked}");
    // Drive 1 hears this one.
    line.answers(&[1, 6, 0x21, 0x35, 0, 0, 0, 0], &[6, 0x21, 0x35, 0, 0]);
    assert!(line.now - heard < 40 * MS);
    assert!(matches!(line.ended(), Some((1, Ok(_)))));
    assert!(!line.master.stats(line.now).slaves[&1].offline);
}

#[test]
fn the_first_stop_of_a_drive_that_is_off_line_waits_for_no_share() {
    let mut line = ByHand::new(config());
    for slave in [1, 2] {
        line.ask(u32::from(slave), slave, READ, Terms::default());
    }
    while line.next_sent(line.now + 3_000 * MS).is_some() && line.master.stats(line.now).slaves[&2].sent < 4 {
    }
    while line.ended().is_some() {}
    line.ask(1, 1, STOP, stop());
    while line.sent()[..2] != [1, 6] {}
    while line.ended().is_none_or(|(caller, _)| caller != 1) {
        line.next_sent(line.now + 10 * MS);
        line.now += 10 * MS;
    }
    // Slave 1 has had its stop in vain; slave 2, off-line as well, has had none.
    let called = line.now;
    line.ask(2, 2, STOP, stop());
    line.ask(1, 1, STOP, stop());
    let next = line.sent();
    assert_eq!(next[..2], [2, 6]);
    assert!(line.now - called <= config().worst_case_stop(8, 8));
}

/// A fifth of the line is for stops in vain: each holds the others up for as long as the gateway waits for its drive, and the next
/// follows four times as long behind it, however many were in vain before.
#[test]
fn behind_a_gateway_a_stop_waits_for_the_share_of_one_in_vain_and_not_of_all_before_it() {
    for wait in [None, Some(Duration::from_secs(1)), Some(Duration::from_secs(20))] {
        let gateway = Gateway { wait, ..Gateway::default() };
        let longest = (wait.unwrap_or(Gateway::ASSUMED_WAIT) * 4).min(Duration::from_secs(30));
        for later in 0..40 {
            let mut line =
                ByHand::new(LineConfig { gateway: Some(gateway), ..LineConfig::modbus_tcp("gateway:502") });
            let pass = |line: &mut ByHand, time: Duration| {
                let until = line.now + time;
                while line.next_sent(until).is_some() {}
                line.now = until;
            };
            for caller in 0..12 {
                line.ask(caller, 3, STOP, stop());
                pass(&mut line, 500 * MS);
            }
            pass(&mut line, Duration::from_secs(5) * later);
            let called = line.now;
            line.ask(12, 3, STOP, stop());
            while line.next_sent(called + Duration::from_secs(300)).expect("it is sent")[7] != 6 {}
            assert!(line.now - called <= longest, "{:?}, {later}, {wait:?}", line.now - called);
        }
    }
}
