//! A slave by a script: what a busy drive, a late order and a write that takes long come to.

use std::{collections::VecDeque, io};

use async_trait::async_trait;
use tokio_modbus::{ExceptionCode, Slave, client::Client, slave::SlaveContext};

use super::*;
use crate::{address::SlaveAddress, capabilities::Capabilities, error::ExceptionMeaning, port::Class};

const CAPABILITIES: Capabilities = Capabilities {
    functions: &[3, 6, 16],
    read_words: 16,
    write_words: 16,
    highest_address: 31,
    speeds: &[19_200],
    fault_reset: "a bit",
    ..Capabilities::least("test", "Test drive")
};

/// A slave that answers by a script and then by holding the last word that it was given.
#[derive(Debug, Default)]
struct Script {
    answers: VecDeque<ExceptionCode>,
    held: u16,
    /// It takes a write whose answer is exception 05 only after so many readings.
    takes_after: usize,
    asked: Option<u16>,
    writes: usize,
}

#[async_trait]
impl Client for Script {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        match request {
            Request::WriteSingleRegister(at, value) => {
                self.writes += 1;
                let exception = self.answers.pop_front();
                match exception {
                    Some(ExceptionCode::Acknowledge) => self.asked = Some(value),
                    Some(_) => {}
                    None => self.held = value,
                }
                Ok(exception.map_or(Ok(Response::WriteSingleRegister(at, value)), Err))
            }
            _ => {
                match self.takes_after.checked_sub(1) {
                    Some(left) => self.takes_after = left,
                    None => self.held = self.asked.take().unwrap_or(self.held),
                }
                Ok(Ok(Response::ReadHoldingRegisters(vec![self.held])))
            }
        }
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl SlaveContext for Script {
    fn set_slave(&mut self, _: Slave) {}
}

impl Port for Script {}

crate::registers! {
    /// One register.
    pub(crate) const ROWS;

    CMD: ReadWrite(8501, "CMD", "control word", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "test");
}

fn registers(answers: impl IntoIterator<Item = ExceptionCode>, takes_after: usize) -> Registers<Script> {
    let port = Script { answers: answers.into_iter().collect(), takes_after, ..Script::default() };
    let slave = SlaveAddress::try_from(1).unwrap();
    Registers::new(port, slave, &CAPABILITIES, |_, code| ExceptionMeaning::standard(code))
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_is_busy_is_asked_again_for_the_lifetime_of_the_call_and_not_longer() {
    let mut registers = registers([ExceptionCode::ServerDeviceBusy; 3], 0);
    assert_eq!(registers.at(Class::Command).write(CMD, 15).await, Ok(()));
    assert_eq!((registers.port.held, registers.port.writes), (15, 4));

    for (class, edge, least, most) in [(Class::Command, false, 5, 30), (Class::Command, true, 1, 1)] {
        let mut busy = self::registers([ExceptionCode::ServerDeviceBusy; 1_000], 0);
        let begun = Instant::now();
        let mut calls = busy.at(class);
        calls = if edge { calls.edge() } else { calls };
        let error = calls.write(CMD, 15).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Exception, "{error}");
        assert!(begun.elapsed() <= Duration::from_secs(1), "{:?}", begun.elapsed());
        assert!((least..=most).contains(&busy.port.writes), "{}", busy.port.writes);
    }
}

#[tokio::test(start_paused = true)]
async fn a_call_may_wait_for_longer_than_any_clock_goes() {
    let mut registers = registers([ExceptionCode::ServerDeviceBusy; 3], 0);
    registers.lifetimes.stop = Some(Duration::MAX);
    registers.lifetimes.command = Some(Duration::MAX);
    for (class, word) in [(Class::Stop, 2), (Class::Command, 15)] {
        assert_eq!(registers.at(class).write(CMD, word).await, Ok(()), "{class}");
        assert_eq!(registers.port.held, word);
    }
}

/// What an order is read for and its first word die with it; what belongs to that word goes out whatever it takes.
#[tokio::test(start_paused = true)]
async fn a_command_that_has_not_begun_in_time_is_not_written_and_one_that_has_is_finished() {
    for (begins, is_sent) in [(false, false), (true, true)] {
        let mut registers = registers([], 0);
        registers.begin_order();
        registers.lifetimes.begun_until = Some(Instant::now() + Duration::from_millis(100));
        if begins {
            assert_eq!(registers.at(Class::Command).write(CMD, 0x80).await, Ok(()));
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
        let terms =
            registers.bounded(Terms { lifetime: Some(Duration::from_secs(1)), ..Terms::of(Class::Command) });
        assert_eq!(terms.lifetime != Some(Duration::ZERO), is_sent, "{terms:?}");
        registers.begin_order();
        registers.lifetimes.begun_until = None;
        let terms =
            registers.bounded(Terms { lifetime: Some(Duration::from_secs(1)), ..Terms::of(Class::Command) });
        assert_eq!(terms.lifetime, Some(Duration::from_secs(1)));
    }
}

#[tokio::test(start_paused = true)]
async fn a_write_that_was_accepted_and_takes_long_is_known_once_it_is_read_back() {
    let mut registers = registers([ExceptionCode::Acknowledge], 3);
    assert_eq!(registers.at(Class::Command).write(CMD, 15).await, Ok(()));
    assert_eq!(registers.port.writes, 1);

    let mut never = self::registers([ExceptionCode::Acknowledge], usize::MAX);
    let error = never.at(Class::Command).write(CMD, 15).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");

    let mut parameter = self::registers([ExceptionCode::Acknowledge], 3);
    let written = parameter.at(Class::Background).change_row(CMD.row(), 15).await;
    assert_eq!(written.map(|written| written.changed), Ok(true));
}
