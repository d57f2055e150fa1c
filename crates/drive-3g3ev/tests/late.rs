//! A command that the way to the drive kept back: a start comes when a stop was already given, and its confirmation, which
//! by function 10h tells no value, is taken for the stop's; a pulse comes when it was already cleared.

mod rig;

use std::{
    collections::VecDeque,
    io,
    sync::{Arc, Mutex},
};

use async_trait::async_trait;
use drive_3g3ev::Drive3g3ev;
use drive_core::{Direction, Drive, ErrorKind, Port, PortError, State, StopMode, Terms};
use drive_sim::SimSlave;
use drive_testing::bench;
use rig::{RESET, Rig, one};
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

/// What becomes of a write to 0001h.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    /// It is kept back, and its sender hears nothing.
    Late,
    /// It is lost, and its sender hears the confirmation of the one that was kept back, which is carried out once so many
    /// reads have gone by.
    Mistaken { reads: u32 },
    /// It is carried out, and then the one that was kept back is, after so many reads.
    Overtaken { reads: u32 },
}

/// A gateway with a queue of its own, in front of a drive on a line.
#[derive(Debug, Clone)]
struct Gateway {
    line: drive_bus::Slave,
    fates: Arc<Mutex<VecDeque<Fate>>>,
    kept: Option<u16>,
    due: Option<u32>,
}

impl Gateway {
    fn next_fate(&self) -> Option<Fate> {
        self.fates.lock().unwrap().pop_front()
    }

    async fn deliver_what_is_due(&mut self) {
        match self.due {
            Some(0) => {
                self.due = None;
                if let Some(word) = self.kept {
                    self.write(word).await;
                }
            }
            Some(reads) => self.due = Some(reads - 1),
            None => {}
        }
    }

    async fn write(&mut self, word: u16) {
        let request = Request::WriteMultipleRegisters(1, vec![word].into());
        self.line.call(request).await.unwrap().unwrap();
    }
}

impl Port for Gateway {
    fn set_terms(&mut self, terms: Terms) {
        self.line.set_terms(terms);
    }
}

impl SlaveContext for Gateway {
    fn set_slave(&mut self, slave: Slave) {
        self.line.set_slave(slave);
    }
}

#[async_trait]
impl Client for Gateway {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        let Request::WriteMultipleRegisters(1, words) = &request else {
            self.deliver_what_is_due().await;
            return self.line.call(request).await;
        };
        let word = words[0];
        match self.next_fate() {
            None => self.write(word).await,
            Some(Fate::Late) => {
                self.kept = Some(word);
                return Err(tokio_modbus::Error::Transport(PortError::OutcomeUnknown("test").into_io()));
            }
            Some(Fate::Mistaken { reads }) => self.due = Some(reads),
            Some(Fate::Overtaken { reads }) => {
                self.write(word).await;
                self.due = Some(reads);
            }
        }
        Ok(Ok(Response::WriteMultipleRegisters(1, 1)))
    }

    async fn disconnect(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A drive behind a gateway.
fn behind_a_gateway(fates: impl IntoIterator<Item = Fate>) -> (Drive3g3ev<Gateway>, SimSlave, Rig) {
    let (drive, machine, rig) = one();
    let fates = Arc::new(Mutex::new(fates.into_iter().collect()));
    let gateway = Gateway { line: drive.into_drive().into_port(), fates, kept: None, due: None };
    let drive = Drive3g3ev::new(gateway, bench::address(1)).with_fault_reset_function(RESET);
    (drive, machine, rig)
}

/// One that was given a start that is kept back.
async fn with_a_late_start(fates: &[Fate]) -> (Drive3g3ev<Gateway>, SimSlave, Rig) {
    let (mut drive, machine, rig) = behind_a_gateway([Fate::Late].into_iter().chain(fates.iter().copied()));
    let error = drive.start(Direction::Forward).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    (drive, machine, rig)
}

#[tokio::test(start_paused = true)]
async fn a_stop_is_never_confirmed_by_the_late_confirmation_of_a_start() {
    // A status is two reads; the start is carried out before the first, between them, or when they have shown no RUN.
    for reads in 0..3 {
        let (mut drive, machine, _rig) = with_a_late_start(&[Fate::Mistaken { reads }]).await;
        let status = drive.stop(StopMode::Ramp).await.unwrap().status;
        assert_ne!(status.state, State::Running);
        assert_eq!((machine.peek(1), machine.observe().setpoint), (Some(0), 0), "after {reads} reads");
        assert_eq!(bench::written(&machine, 1), [1, 0], "the stop was written again");
    }
}

#[tokio::test(start_paused = true)]
async fn a_start_that_comes_after_a_stop_is_stopped_before_the_stop_counts_as_done() {
    for reads in 0..3 {
        let (mut drive, machine, _rig) = with_a_late_start(&[Fate::Overtaken { reads }]).await;
        drive.stop(StopMode::Ramp).await.unwrap();
        assert_eq!((machine.peek(1), machine.observe().setpoint), (Some(0), 0), "after {reads} reads");
        assert_eq!(bench::written(&machine, 1), [0, 1, 0]);
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_something_keeps_revoking_is_repeated_for_its_time_and_then_not_confirmed() {
    let revoked = [Fate::Overtaken { reads: 2 }; 100];
    let (mut drive, machine, _rig) = with_a_late_start(&revoked).await;
    let error = drive.stop(StopMode::Ramp).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
    let written = bench::written(&machine, 1);
    assert!((6..40).contains(&written.len()) && written.starts_with(&[0, 1, 0, 1]), "{written:?}");
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_a_late_start_runs_is_not_said_to_be_stopping() {
    let (mut drive, machine, _rig) = with_a_late_start(&[Fate::Overtaken { reads: 3 }]).await;
    drive.stop(StopMode::Ramp).await.unwrap();
    // The first read of this status lets the start through.
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.raw(1), machine.peek(1)), (State::Running, Some(1), Some(1)));
}

#[tokio::test(start_paused = true)]
async fn a_reset_pulse_that_comes_after_its_clearing_is_not_left_set() {
    let fates = [Fate::Late, Fate::Overtaken { reads: 0 }];
    let (mut drive, machine, _rig) = behind_a_gateway(fates);
    machine.trip(0);
    assert_eq!(drive.reset_faults().await.unwrap().state, State::Ready);
    assert_eq!((machine.peek(1), bench::written(&machine, 1)), (Some(0), vec![0, 0x20, 0]));
}
