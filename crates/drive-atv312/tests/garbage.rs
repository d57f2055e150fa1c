//! A drive that answers any word to anything: nothing panics, and nothing is written that the manual does not know.

use std::{io, time::Duration};

use async_trait::async_trait;
use drive_atv312::{Atv312, ROWS};
use drive_core::{Direction, Drive, Frequency, Port, Reaction, Setpoint, SlaveAddress, Speed, StopMode};
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

/// Answers every read with the next words of a generator, and confirms every write.
#[derive(Debug)]
struct Babble {
    state: u32,
    /// Every word written to CMD.
    commands: Vec<u16>,
}

impl Babble {
    fn word(&mut self) -> u16 {
        self.state = self.state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Most words are plausible somewhere, so that the ladder is climbed and not only refused.
        const PLAUSIBLE: [u16; 12] = [0x0240, 0x0221, 0x0223, 0x0227, 0x0227, 0x4000, 0, 0, 0, 1, 2, 0x0008];
        let plausible = PLAUSIBLE.get((self.state >> 24) as usize % 16).copied();
        plausible.unwrap_or((self.state >> 8) as u16)
    }
}

impl Port for Babble {}

impl SlaveContext for Babble {
    fn set_slave(&mut self, _: Slave) {}
}

#[async_trait]
impl Client for Babble {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        Ok(Ok(match request {
            Request::ReadHoldingRegisters(_, count) => {
                Response::ReadHoldingRegisters((0..count).map(|_| self.word()).collect())
            }
            Request::WriteSingleRegister(address, word) => {
                if address == 8501 {
                    self.commands.push(word);
                }
                Response::WriteSingleRegister(address, word)
            }
            request => {
                let error = io::Error::new(io::ErrorKind::Unsupported, format!("{request:?}"));
                return Err(tokio_modbus::Error::Transport(error));
            }
        }))
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test]
async fn whatever_the_drive_says_nothing_panics_and_only_the_manuals_control_words_are_written() {
    /// BBV51701 p. 10 and 12.
    const ALLOWED: [u16; 10] =
        [0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x080F, 0x0080, 0x100F, 0x200F, 0x400F];
    let mut written = [false; ALLOWED.len()];
    for seed in 0..3_000 {
        let port = Babble { state: seed, commands: Vec::new() };
        let mut drive = Atv312::new(port, SlaveAddress::try_from(1).unwrap());
        let _ = drive.status().await;
        let _ = drive.measurements().await;
        let _ = drive.faults().await;
        let _ = drive.past_faults().await;
        let _ = drive.identify().await;
        let _ = drive.set_setpoint(Setpoint::Frequency(Frequency::from_hertz(25))).await;
        let _ = drive.set_setpoint(Setpoint::Speed(Speed::from_rpm(100))).await;
        for direction in [Direction::Forward, Direction::Reverse] {
            let _ = drive.start(direction).await;
        }
        for mode in StopMode::ALL {
            let _ = drive.stop(mode).await;
        }
        let _ = drive.reset_faults().await;
        let _ = drive.watchdog().await;
        let _ = drive.arm_watchdog(Duration::from_secs(1), Reaction::Ramp).await;
        let _ = drive.set_up_bus_control().await;
        let _ = drive.release().await;
        for row in ROWS.iter().filter(|row| row.code != "CMD").step_by(7) {
            let _ = drive.write_parameter(row, 1).await;
        }
        let _ = drive.persist().await;
        for command in drive.into_port().commands {
            let index = ALLOWED.iter().position(|&word| word == command);
            written[index.unwrap_or_else(|| panic!("{command:04X}h was written"))] = true;
        }
    }
    assert_eq!(written, [true; ALLOWED.len()], "each of them is in use");
}
