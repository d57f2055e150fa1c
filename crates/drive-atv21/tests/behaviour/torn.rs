//! What the words of one status say that are of different moments: FD01 is read first, and FD00 in an exchange of its own.

use std::sync::{Arc, Mutex};

use async_trait::async_trait;
use drive_atv21::Atv21;
use drive_bus::Slave as Line;
use drive_core::{Direction, Drive, Motion, Port, State, StopMode, Terms};
use drive_sim::SimSlave;
use drive_testing::{bench, truth::Judged};
use tokio_modbus::{Request, Response, Slave, client::Client, slave::SlaveContext};

use crate::support::{HALF_SPEED, Rig, SECOND};

/// A drive that acts upon FA00 behind its next answer for FD01, where something else may happen as well.
#[derive(Clone)]
struct Late {
    line: Line,
    deed: Arc<Mutex<Option<Deed>>>,
    kept: Option<Request<'static>>,
}

/// What happens between FD01 and FD00.
type Deed = Box<dyn FnOnce() + Send>;

impl Port for Late {
    fn set_terms(&mut self, terms: Terms) {
        self.line.set_terms(terms);
    }
}

impl SlaveContext for Late {
    fn set_slave(&mut self, slave: Slave) {
        self.line.set_slave(slave);
    }
}

#[async_trait]
impl Client for Late {
    async fn call(&mut self, request: Request<'_>) -> tokio_modbus::Result<Response> {
        match request {
            Request::WriteSingleRegister(0xFA00, word) if self.deed.lock().unwrap().is_some() => {
                self.kept = Some(Request::WriteSingleRegister(0xFA00, word));
                Ok(Ok(Response::WriteSingleRegister(0xFA00, word)))
            }
            Request::ReadHoldingRegisters(0xFD01, 1) if self.deed.lock().unwrap().is_some() => {
                let answer = self.line.call(request).await;
                if let Some(kept) = self.kept.take() {
                    self.line.call(kept).await.unwrap().unwrap();
                }
                let deed = self.deed.lock().unwrap().take();
                deed.into_iter().for_each(|deed| deed());
                answer
            }
            request => self.line.call(request).await,
        }
    }

    async fn disconnect(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// A motor that was seen to run at 25 Hz for a while, and what is to happen to it.
async fn running() -> (Rig, Judged<Atv21<Late>>, Arc<Mutex<Option<Deed>>>) {
    let (rig, _) = Rig::factory();
    let port = Late { line: rig.line.slave(1), deed: Arc::default(), kept: None };
    let late = Arc::clone(&port.deed);
    let mut drive = Judged::new(Atv21::new(port, bench::address(1)), rig.machine.clone());
    drive.set_coast_time(Some(20 * SECOND));
    drive.set_setpoint(HALF_SPEED.into()).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    for _ in 0..100 {
        drive.status().await.unwrap();
        tokio::time::sleep(SECOND / 10).await;
    }
    (rig, drive, late)
}

/// It was told at rest for good, at 31 Hz: FD01 was the word of the run command, FD00 was 0 behind it, and that is a ramp at its end.
#[tokio::test(start_paused = true)]
async fn a_motor_whose_output_is_cut_between_fd01_and_fd00_of_the_first_look_behind_a_stop_coasts() {
    let nothing: fn(&SimSlave) = |_| {};
    let st_opens: fn(&SimSlave) = |machine| machine.terminal("ST", false).unwrap();
    let trips: fn(&SimSlave) = |machine| machine.trip(0x000E);
    for (what, mode, deed) in [
        ("freewheel", StopMode::Freewheel, nothing),
        ("ST = OFF", StopMode::Ramp, st_opens),
        ("a trip", StopMode::Ramp, trips),
    ] {
        let (rig, mut drive, late) = running().await;
        let machine = rig.machine.clone();
        *late.lock().unwrap() = Some(Box::new(move || deed(&machine)));
        drive.stop(mode).await.unwrap();
        for _ in 0..20 {
            let status = drive.status().await.unwrap();
            assert_eq!(status.motion, Motion::Coasting, "{what}: {status}");
            tokio::time::sleep(SECOND / 2).await;
        }
        tokio::time::sleep(10 * SECOND).await;
        assert_eq!(drive.status().await.unwrap().motion, Motion::AtRest, "{what}: its coast time is over");
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_loses_st_between_fd01_and_fd00_of_a_look_at_its_ramp_coasts() {
    let (rig, mut drive, late) = running().await;
    rig.machine.reading("FD01.10", "turning").unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
    for _ in 0..5 {
        assert_eq!(drive.status().await.unwrap().motion, Motion::Braking);
        tokio::time::sleep(SECOND / 10).await;
    }
    let machine = rig.machine.clone();
    *late.lock().unwrap() = Some(Box::new(move || machine.terminal("ST", false).unwrap()));
    assert_eq!(drive.status().await.unwrap().state, State::Stopping);
    assert_eq!(drive.status().await.unwrap().motion, Motion::Coasting);
}
