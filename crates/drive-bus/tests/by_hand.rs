//! What a line makes of late and damaged answers, of exceptions and of addresses, fed by hand.

#![cfg(feature = "tcp")]

mod support;

use drive_bus::{LineConfig, SlaveSettings, exchange::rtu};
use drive_core::{PortError, Terms, serial::SerialSettings};
use support::{MS, by_hand::ByHand};
use tokio_modbus::{Request, Response};

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const READ: Request<'static> = Request::ReadHoldingRegisters(3201, 1);

fn config() -> LineConfig {
    LineConfig::stream(SERIAL)
}

#[test]
fn a_late_answer_of_a_slow_slave_is_waited_for_longer_than_its_timeout() {
    let slow = SlaveSettings { response_timeout: Some(2_000 * MS), ..SlaveSettings::default() };
    let mut line = ByHand::new(config().slave(1, slow));
    line.ask(1, 1, READ, Terms::default());
    let first = line.sent();
    let asked = line.now;
    // The answer comes half a second after it was due, and is not the answer to the same question, asked again.
    line.hears(2_500 * MS, &rtu::frame(1, &[3, 2, 0, 1]));
    assert!(line.ended().is_none());
    assert_eq!(line.sent(), first);
    assert!(line.now - asked > 2_500 * MS);
    line.answers(&first, &[3, 2, 0, 2]);
    assert!(matches!(line.ended(), Some((1, Ok(Ok(Response::ReadHoldingRegisters(words))))) if words == [2]));
}

#[test]
fn exceptions_teach_the_same_timeout_as_answers() {
    let learned = |pdu: &'static [u8]| {
        let mut line = ByHand::new(LineConfig { timeout_floor: MS, ..config() });
        for _ in 0..100 {
            line.ask(1, 1, Request::ReadHoldingRegisters(0, 1), Terms::default());
            let request = line.sent();
            line.answers(&request, pdu);
            assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_ok()));
        }
        line.master.stats(line.now).slaves[&1].response_timeout
    };
    assert_eq!(learned(&[3, 2, 0, 1]), learned(&[0x83, 2]));
}

#[test]
fn an_address_that_no_slave_of_a_line_has_is_refused_except_on_modbus_tcp() {
    let mut line = ByHand::new(config());
    for slave in [248, 255] {
        let refused = line.submit(1, slave, READ, Terms::default());
        assert!(matches!(refused, Err(PortError::NotCarried(_))), "{slave}: {refused:?}");
    }
    assert_eq!(line.submit(1, 247, READ, Terms::default()), Ok(()));
    let mut gateway = ByHand::new(LineConfig::modbus_tcp("gateway:502"));
    assert_eq!(gateway.submit(1, 255, READ, Terms::default()), Ok(()));
}

#[test]
fn a_damaged_frame_is_not_trusted_to_be_the_answer_while_another_slaves_is_late() {
    let mut line = ByHand::new(LineConfig { retries: 0, ..config() });
    line.ask(1, 3, READ, Terms::default());
    line.sent();
    line.ask(2, 1, READ, Terms::default());
    let request = line.sent();
    assert_eq!(request[0], 1, "slave 3 has not answered in time");
    let end = line.now + SERIAL.characters(request.len());
    // The late answer of slave 3, its address damaged into that of slave 1.
    let mut late = rtu::frame(3, &[3, 2, 0, 3]).to_vec();
    late[0] = 1;
    line.hears(20 * MS, &late);
    assert_eq!(line.next_sent(line.now + 30 * MS), None);
    assert!(matches!(line.ended(), Some((1, Err(_)))) && matches!(line.ended(), Some((2, Err(_)))));
    // The answer of slave 1 is still to come: the next question waits until it can be taken for no other.
    line.ask(3, 1, READ, Terms::default());
    line.sent();
    assert!(line.now >= end + config().late_window);
}
