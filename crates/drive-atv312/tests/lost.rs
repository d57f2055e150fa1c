//! A line that is lost behind a write: what is said of that write.

use std::io;

use async_trait::async_trait;
use drive_atv312::{Atv312, CAPABILITIES, exception_meaning, registers::LFR};
use drive_core::{Class, Drive, ErrorKind, Port, PortError, Registers, Row};
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

/// Answers every reading with zeros until something is written. The write's own answer may be lost, and nothing is sent
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
            Request::ReadHoldingRegisters(_, count) => {
                Ok(Ok(Response::ReadHoldingRegisters(vec![0; usize::from(count)])))
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

#[tokio::test]
async fn a_write_that_cannot_be_read_back_is_unknown_and_never_called_not_sent() {
    let slave = 1.try_into().unwrap();
    let port = Lost { answers_write: false, written: false };
    let mut registers = Registers::new(port, slave, &CAPABILITIES, exception_meaning);
    let error = registers.at(Class::Command).write(LFR, 500).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");

    for answers_write in [false, true] {
        let mut drive = Atv312::new(Lost { answers_write, written: false }, slave);
        let row = Row::find(drive.rows(), "ACC").unwrap();
        let error = drive.write_parameter(row, 50).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    }
}
