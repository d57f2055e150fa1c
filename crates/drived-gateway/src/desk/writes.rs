//! Writes: judged as commands of the fleet are, carried out by it, and confirmed once they are in force.

mod commands;
mod parameters;
mod stops;

use drive_core::{Intent, Setpoint, StopMode, tokio_modbus::ExceptionCode};
use drive_fleet::DriveHandle;
use futures_util::future::join_all;
use tokio::time::Instant;

pub(crate) use self::stops::Stop;
use super::{Answer, Desk};
use crate::{clients::Connection, config::GatewayConfig, pdu::Ask};
use drived_doors::{
    Caller,
    audit::{Kind, Record},
};
use drived_plant::plant::{commands::Request, revisions::Subject, watched::WatchedDoor};

/// Why a write is not carried out: the exception, and the reason in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refusal {
    pub(crate) code: ExceptionCode,
    pub(crate) why: String,
}

impl Refusal {
    fn new(code: ExceptionCode, why: impl Into<String>) -> Self {
        Self { code, why: why.into() }
    }

    /// By a rule of motion.
    fn rule(why: impl Into<String>) -> Self {
        Self::new(ExceptionCode::ServerDeviceFailure, why)
    }
}

/// What a write asks of the motor, taken together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Wanted {
    command: Option<Intent>,
    setpoint: Option<Setpoint>,
}

/// Who writes: on which connection, and as whom the plant knows him.
#[derive(Clone, Copy)]
struct Who<'a> {
    by: &'a Connection,
    caller: &'a Caller,
}

impl Who<'_> {
    /// Whether somebody is there who may hear what becomes of it. Only a stop is carried out for whom it is not so: what was held back on
    /// the way comes together with the end of a connection that was given up long before.
    fn hears(self) -> Result<(), Refusal> {
        match drive_fleet::mutant!("starts-for-nobody", self.by.is_open(), true) {
            true => Ok(()),
            false => {
                Err(Refusal::rule("its client has closed the connection: nobody would hear that it was done"))
            }
        }
    }
}

impl Desk {
    /// To whom a write to a unit goes.
    pub(super) fn written(&self, unit: u8) -> Vec<DriveHandle> {
        match self.drive(unit) {
            None if unit == 0 && self.config.broadcast => self.drives(),
            drive => drive.into_iter().collect(),
        }
    }

    /// Carries out a write.
    pub(crate) async fn write(
        &self,
        by: &Connection,
        arrived: Instant,
        unit: u8,
        ask: &Ask,
        stop: Option<Stop>,
        drives: Vec<DriveHandle>,
    ) -> Answer {
        if !self.config.rights.stop || self.config.virtual_unit == Some(unit) {
            return Err(ExceptionCode::IllegalFunction);
        }
        if drives.is_empty() && (unit != 0 || !self.config.broadcast) {
            return Err(ExceptionCode::GatewayPathUnavailable);
        }
        let caller = self.caller(by);
        let who = Who { by, caller: &caller };
        drives.iter().for_each(|drive| self.kept.forget(drive.place()));
        let written = match (stop, &drives[..]) {
            (Some(stop), [drive]) => {
                let stopped = self.stop_as_asked(who, drive, stop, ask, arrived).await;
                match stopped {
                    Ok(()) => self.setpoint_beside(who, drive, ask, arrived).await,
                    refused => refused,
                }
            }
            (Some(stop), drives) => {
                let stops = drives.iter().map(|drive| self.stop_as_asked(who, drive, stop, ask, arrived));
                join_all(stops).await.into_iter().collect()
            }
            (None, [drive]) if unit != 0 || self.drive(0).is_some() => {
                self.command(who, drive, ask, arrived).await
            }
            (None, _) => Err(Refusal::rule("to all units at once only a stop is carried out")),
        };
        drives.iter().for_each(|drive| self.kept.forget(drive.place()));
        written.map(|()| ask.confirmation()).map_err(|refusal| {
            self.tell_refusal(&caller, unit, ask, &refusal);
            refusal.code
        })
    }

    fn caller(&self, by: &Connection) -> Caller {
        let caller = Caller::new(self.config.name.clone(), format!("modbus {}", by.peer), self.config.rights);
        Caller { heard: by.heard(), ..caller }
    }

    fn record(
        &self,
        caller: &Caller,
        drive: &DriveHandle,
        request: &Request,
    ) -> drived_doors::audit::Written {
        self.audit.record(Record::new(
            Kind::Command,
            caller,
            format!("{}: {}", drive.name(), request.action.text()),
        ))
    }

    /// A write that is not carried out is told: in the log, in the audit log, and to those who read events along.
    fn tell_refusal(&self, caller: &Caller, unit: u8, ask: &Ask, refusal: &Refusal) {
        let drive = self.drive(unit).map(|drive| drive.name().to_string());
        let writes: Vec<String> =
            ask.writes().map(|(register, word)| format!("{register} = {word}")).collect();
        let what = format!("unit {unit}: write {}", writes.join(", "));
        let Refusal { code, why } = refusal;
        let code = u8::from(*code);
        let count = self.counters.refuse(refusal.code.into());
        if count.is_power_of_two() {
            let Caller { name, origin, .. } = caller;
            tracing::warn!("gateway {name}: {origin}: {what}: {why} ({code:02X}h), {count} of these in all");
        }
        let text = format!("{what} by {} from {} refused: {why}", caller.name, caller.origin);
        let record =
            Record { outcome: Some(format!("refused: {why}")), ..Record::new(Kind::Answer, caller, what) };
        self.audit.record(record).whenever();
        let event = serde_json::json!({
            "time_unix_ms": drived_words::json::unix(Instant::now()),
            "drive": drive,
            "event": "write_refused",
            "alarm": false,
            "text": text,
        });
        self.plant.revisions().push(Subject::Event, &event);
    }
}

/// A gateway as the door of those who have to be heard.
pub(crate) fn watched(config: &GatewayConfig) -> WatchedDoor<'_> {
    let GatewayConfig { name, listen, client_timeout, stops_when_silent, .. } = config;
    WatchedDoor { name, listen: *listen, limit: *client_timeout, stops: *stops_when_silent }
}

fn busy() -> Refusal {
    Refusal::new(ExceptionCode::ServerDeviceBusy, "the line had no room in time")
}

/// Whether a word disables the voltage, which ends the lock behind a quick stop (BBV51701 p. 10 to 12).
const fn disables_voltage(intent: Intent) -> bool {
    matches!(intent, Intent::Stop(StopMode::Freewheel) | Intent::ResetFaults(_))
}

/// It is on its way, and its outcome is told elsewhere.
fn pending(drive: &DriveHandle) -> Refusal {
    let why = format!("{} has not shown it yet: it goes on", drive.name());
    Refusal::new(ExceptionCode::Acknowledge, why)
}

/// Whether the motor is known to stand, and this fleet has nothing under way that moves it.
fn stands(drive: &DriveHandle) -> bool {
    let snapshot = drive.snapshot();
    let status = snapshot.fresh_status(Instant::now());
    status.is_some_and(drive_core::Status::is_undriven) && snapshot.stop.is_none() && !snapshot.started_here()
}

fn shows_fault(drive: &DriveHandle) -> bool {
    let snapshot = drive.snapshot();
    snapshot.fresh_status(Instant::now()).is_some_and(drive_core::Status::is_fault)
}
