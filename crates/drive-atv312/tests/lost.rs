//! A line that is lost behind a write, and a drive that does not tell its settings.

use std::{
    io,
    sync::{Arc, Mutex},
};

use async_trait::async_trait;
use drive_atv312::{Atv312, CAPABILITIES, exception_meaning, registers::LFR};
use drive_core::{Class, Drive, ErrorKind, Port, PortError, Registers, Row, State, StopMode};
use tokio_modbus::{ExceptionCode, Request, Response, Slave, client::Client, slave::SlaveContext};

/// Answers every reading with zeros, and that of the reference with 50 Hz, until something is written. The write's own answer may be lost, and nothing is sent
/// any more behind it.
#[derive(Debug)]
struct Lost {
    answers_write: bool,
    written: bool,
}

impl Port for Lost {}

impl SlaveContext for Lost {
    fn set_slave(&mut self, _: Slave) {}
}

#[async_trait]
impl Client for Lost {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let failed = |problem: PortError| Err(tokio_modbus::Error::Transport(problem.into_io()));
        match request {
            _ if self.written => failed(PortError::Expired),
            Request::ReadHoldingRegisters(first, count) => {
                let word = |register| if register == LFR.address() { 500 } else { 0 };
                Ok(Ok(Response::ReadHoldingRegisters((first..first + count).map(word).collect())))
            }
            Request::WriteSingleRegister(register, word) => {
                self.written = true;
                if self.answers_write {
                    Ok(Ok(Response::WriteSingleRegister(register, word)))
                } else {
                    failed(PortError::OutcomeUnknown("no answer"))
                }
            }
            _ => failed(PortError::Closed),
        }
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test(start_paused = true)]
async fn a_write_that_cannot_be_read_back_is_unknown_and_never_called_not_sent() {
    let slave = 1.try_into().unwrap();
    let port = Lost { answers_write: false, written: false };
    let mut registers = Registers::new(port, slave, &CAPABILITIES, exception_meaning);
    let error = registers.at(Class::Command).write(LFR, 500).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");

    for answers_write in [false, true] {
        let mut drive = Atv312::new(Lost { answers_write, written: false }, slave);
        let row = Row::find(drive.capabilities().rows, "ACC").unwrap();
        let error = drive.write_parameter(row, 50).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
        // The terminals command it, and it is the reference of the bus that is taken back.
        let mut drive = Atv312::new(Lost { answers_write, written: false }, slave);
        let error = drive.release().await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    }
}

/// Runs until it is told to stop quickly, and has no register but those of the fast set, `CMI` and `CMD`.
#[derive(Debug, Clone, Default)]
struct Silent {
    written: Arc<Mutex<Vec<(u16, u16)>>>,
}

impl Port for Silent {}

impl SlaveContext for Silent {
    fn set_slave(&mut self, _: Slave) {}
}

#[async_trait]
impl Client for Silent {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let mut written = self.written.lock().unwrap();
        let eta = if written.contains(&(8501, 0x0002)) { 0x0207 } else { 0x0627 };
        Ok(match request {
            Request::ReadHoldingRegisters(3201, 6) => {
                Ok(Response::ReadHoldingRegisters(vec![eta, 500, 500, 10, 0, 0x4010]))
            }
            Request::ReadHoldingRegisters(8504, 1) => Ok(Response::ReadHoldingRegisters(vec![0])),
            Request::WriteSingleRegister(register, word) => {
                written.push((register, word));
                Ok(Response::WriteSingleRegister(register, word))
            }
            _ => Err(ExceptionCode::IllegalDataAddress),
        })
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_does_not_tell_its_settings_is_stopped_all_the_same() {
    for mode in [StopMode::Ramp, StopMode::DcInjection] {
        let port = Silent::default();
        let mut drive = Atv312::new(port.clone(), 1.try_into().unwrap());
        assert_eq!(drive.stop(mode).await.unwrap().status.state, State::QuickStop, "{mode}");
        assert_eq!(*port.written.lock().unwrap(), [(8501, 0x0002)], "{mode}");
    }
}
