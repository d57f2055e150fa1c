//! The wire without a clock, exact to the nanosecond.

use drive_core::serial::CharacterFormat;

use super::*;
use crate::{framing::rtu, models::atv312::Atv312, slave::Slave};

const TURNAROUND: Duration = Duration::from_millis(5);

fn wire(baud: u32, delivery: Delivery) -> (Wire, State, Instant) {
    let settings = SerialSettings::new(baud, CharacterFormat::F8E1).unwrap();
    let now = Instant::now();
    let mut line = State::default();
    let dialect = Dialect { settings, ..Dialect::default() };
    let drive = Box::new(Atv312::under_bus_control());
    let mut slave = Slave::new(drive, 1, dialect, now, line.counters(dialect));
    slave.set_turnaround(Some(TURNAROUND));
    line.add(1, slave);
    (Wire::new(dialect, Pacing::Simulated, delivery), line, now)
}

/// Reads the status word.
fn request() -> Vec<u8> {
    rtu::frame(1, &[0x03, 0x0C, 0x81, 0x00, 0x01])
}

#[test]
fn an_answer_ends_after_request_turnaround_and_answer_to_the_nanosecond() {
    // 8 and 7 characters of 11 bits.
    for (baud, nanos) in [(9_600, 22_187_501), (19_200, 13_593_751), (115_200, 6_432_292)] {
        let (mut wire, mut line, now) = wire(baud, Delivery::Whole);
        wire.receive(now, &request(), &mut line);
        let due = now + Duration::from_nanos(nanos);
        assert_eq!(wire.poll(now, &mut line), Step::Wait(Some(due)), "{baud}");
        let Step::Send(answer) = wire.poll(due, &mut line) else { panic!("nothing is sent") };
        assert_eq!(answer, rtu::frame(1, &[0x03, 0x02, 0x02, 0x40]));
        assert_eq!(wire.poll(due, &mut line), Step::Wait(None));
        assert_eq!(line.stats.lag, Duration::ZERO);
    }
}

#[test]
fn in_pieces_each_is_due_with_its_last_bit() {
    let (mut wire, mut line, now) = wire(19_200, Delivery::Pieces(3));
    wire.receive(now, &request(), &mut line);
    let begins = now + wire.master.settings.characters(8) + TURNAROUND;
    for (characters, length) in [(3, 3), (6, 3), (7, 1)] {
        let due = begins + wire.master.settings.characters(characters);
        assert_eq!(wire.poll(now, &mut line), Step::Wait(Some(due)));
        let Step::Send(piece) = wire.poll(due, &mut line) else { panic!("nothing is sent") };
        assert_eq!(piece.len(), length);
    }
}

#[test]
fn a_silence_of_t3_5_is_kept_and_one_nanosecond_less_is_not() {
    for (missing, violations) in [(0, 0), (1, 1)] {
        let (mut wire, mut line, now) = wire(19_200, Delivery::Whole);
        wire.receive(now, &request(), &mut line);
        let Step::Wait(Some(due)) = wire.poll(now, &mut line) else { panic!("nothing is due") };
        assert!(matches!(wire.poll(due, &mut line), Step::Send(_)));
        let next = due + wire.master.settings.t3_5() - Duration::from_nanos(missing);
        wire.receive(next, &request(), &mut line);
        assert_eq!(line.stats.violations, violations);
        assert_eq!(line.stats.requests, 2);
    }
}

#[test]
fn an_answer_that_is_handed_over_late_begins_the_silence_late() {
    let (mut wire, mut line, now) = wire(19_200, Delivery::Whole);
    wire.receive(now, &request(), &mut line);
    let Step::Wait(Some(due)) = wire.poll(now, &mut line) else { panic!("nothing is due") };
    let late = due + Duration::from_millis(1);
    assert!(matches!(wire.poll(late, &mut line), Step::Send(_)));
    assert_eq!(line.stats.lag, Duration::from_millis(1));
    wire.receive(due + wire.master.settings.t3_5(), &request(), &mut line);
    assert_eq!(line.stats.violations, 1);
}
