//! What is asked of the motor but stops, by the rules of the fleet.

use std::time::Duration;

use drive_core::{Class, Direction, Drive, Error, Intent, Setpoint, Terms, tokio_modbus::ExceptionCode};
use drive_fleet::{DriveHandle, Link, Until};
use futures_util::FutureExt as _;
use tokio::time::{Instant, sleep_until, timeout_at};

use super::{Refusal, Stop, Wanted, Who, busy, pending, shows_fault, stands, watched};
use crate::{clients::Before, desk::Desk, pdu::Ask};
use drived_plant::plant::commands::{
    Action, Expects, LONGEST_LIFETIME, Lifetime, OutcomeWord, Rejected, Request, Target,
};

/// How long a start waits for the end of its connection. Where both were held back on the way the end comes second: by the round trip of
/// the confirmation, which a system may put off by 40 ms.
const END_FOLLOWS: Duration = Duration::from_millis(100);

impl Desk {
    /// What a write asks of the motor; `None` where it commands nothing. Words that are not understood, and commands among
    /// other registers, are refused as a whole.
    pub(super) async fn wanted(&self, drive: &DriveHandle, ask: &Ask) -> Result<Option<Wanted>, Refusal> {
        let Some(mut speaker) = self.speaker(drive) else {
            return Err(Refusal::rule("its family is not known here"));
        };
        let (mut wanted, mut commands, mut others) = (Wanted::default(), 0, 0);
        for (register, word) in ask.writes() {
            let intent = speaker.intent(register, word).await.map_err(|error| match error {
                Error::Unsupported { .. } => {
                    Refusal::rule(format!("register {register}, word {word:04X}h: {error}"))
                }
                error => Refusal::new(ExceptionCode::GatewayTargetDevice, error.to_string()),
            })?;
            match intent {
                None => others += 1,
                Some(Intent::Setpoint(setpoint)) => {
                    commands += 1;
                    let before = wanted.setpoint.replace(setpoint);
                    if before.is_some_and(|before| before != setpoint) {
                        return Err(Refusal::rule("two setpoints in one write"));
                    }
                }
                Some(command) => {
                    commands += 1;
                    let before = wanted.command.replace(command);
                    if before.is_some_and(|before| before != command) {
                        return Err(Refusal::rule("two commands in one write"));
                    }
                }
            }
        }
        match (commands, others) {
            (0, _) => Ok(None),
            (_, 0) => Ok(Some(wanted)),
            _ => Err(Refusal::rule("a command among other registers in one write")),
        }
    }

    /// Carries out a write that is no stop.
    pub(super) async fn command(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        ask: &Ask,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        if !self.config.rights.operate {
            return Err(Refusal::rule("this gateway only stops: writes = \"stop\""));
        }
        if ask.is_of_coils() {
            return Err(Refusal::new(ExceptionCode::IllegalFunction, "of coils only a stop is carried out"));
        }
        let deadline = arrived + self.config.patience;
        let wanted = timeout_at(deadline, self.wanted(drive, ask)).await.map_err(|_| busy())??;
        let Some(Wanted { command, setpoint }) = wanted else {
            return self.parameters(who, drive, ask, deadline).await;
        };
        let give = |setpoint| Action::Setpoint { setpoint, until: Until::InForce };
        match command {
            None => match setpoint {
                Some(setpoint) => self.order(who, drive, give(setpoint), arrived, deadline).await,
                None => Ok(()),
            },
            Some(Intent::Start(direction)) => {
                let action = Action::Start { direction, setpoint, until: Until::InForce };
                self.start(who, drive, (direction, setpoint), action, (arrived, deadline)).await
            }
            Some(Intent::ResetFaults(_)) if shows_fault(drive) => {
                self.may_begin(who)?;
                self.clients.write_without_run(who.by, drive.place());
                self.order(who, drive, Action::Reset, arrived, deadline).await?;
                self.plant.quick_stops().unlock(drive);
                Ok(())
            }
            Some(step) => {
                match self.stops_by(drive, step).filter(|_| !stands(drive)) {
                    // It was started while this waited.
                    Some(mode) => {
                        self.stop_as_asked(who, drive, Stop(mode), ask, arrived).await?;
                    }
                    None => self.prepare(who, drive, ask, arrived).await?,
                }
                match setpoint.filter(|setpoint| drive.snapshot().setpoint != Some(*setpoint)) {
                    Some(setpoint) => self.order(who, drive, give(setpoint), arrived, deadline).await,
                    None => Ok(()),
                }
            }
        }
    }

    /// A run command. The same word again starts nothing: where the motor runs it is confirmed, and where it was stopped
    /// meanwhile, tripped or never started, a word without run has to come first from this client.
    pub(super) async fn start(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        (direction, setpoint): (Direction, Option<Setpoint>),
        action: Action,
        (arrived, deadline): (Instant, Instant),
    ) -> Result<(), Refusal> {
        // Also whoever is heard for a motor that runs stays who he is.
        self.may_begin(who)?;
        let before = self.clients.write_run(who.by, drive.place());
        let snapshot = drive.snapshot();
        let status = snapshot.fresh_status(Instant::now());
        let ours = status.and_then(|status| status.verdict).is_some_and(|verdict| verdict.is_in_force());
        let runs = snapshot.stop.is_none() && ours;
        let same_way = status.is_some_and(|status| status.direction.is_none_or(|way| way == direction));
        if runs && same_way {
            return match setpoint.filter(|setpoint| snapshot.setpoint != Some(*setpoint)) {
                Some(setpoint) => {
                    let action = Action::Setpoint { setpoint, until: Until::InForce };
                    self.order(who, drive, action, arrived, deadline).await
                }
                None => Ok(()),
            };
        }
        if self.plant.quick_stops().locks(drive) {
            return Err(Refusal::rule(
                "behind a quick stop a drive is locked until its voltage was disabled: write 0000h first",
            ));
        }
        // What was wished before a stop of somebody else is not wished behind it.
        let asked_after = match before {
            Before::NewerConnection => {
                return Err(Refusal::rule(
                    "its connection was open before the last word without run came on another one: write one on this one first",
                ));
            }
            _ if runs => arrived,
            Before::WithoutRun(at) => at,
            Before::NoWordWithoutRun => {
                return Err(Refusal::rule(
                    "nothing starts by a run command that only goes on: write one without run first",
                ));
            }
        };
        let end = drive_fleet::mutant!("end-of-a-connection-unawaited", arrived + END_FOLLOWS, arrived);
        sleep_until(end.min(deadline)).await;
        who.hears()?;
        self.plant.watched().start(watched(&self.config), who.by.peer, drive).await;
        self.order_asked_after(who, drive, action, (arrived, asked_after), deadline).await
    }

    /// Whether what is no stop may begin, where the plant does not judge that or not yet.
    pub(super) fn may_begin(&self, who: Who<'_>) -> Result<(), Refusal> {
        match self.plant.is_closing() {
            true => Err(Refusal::rule(Rejected::Closing.to_string())),
            false => who.hears(),
        }
    }

    /// A step of the ladder is written as it is, so that the drive shows it. The motor stands, or it would be a stop.
    pub(super) async fn prepare(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        ask: &Ask,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        self.may_begin(who)?;
        self.clients.write_without_run(who.by, drive.place());
        let settings = drive.settings();
        if !settings.control || !settings.commanders.allow(&self.config.name) {
            return Err(Refusal::rule(format!("{} may not command this drive", self.config.name)));
        }
        self.is_still(drive)?;
        let Some(mut speaker) = self.speaker(drive) else { return Ok(()) };
        for (address, word) in ask.writes() {
            // A reset has nothing to reset here, and a setpoint is given behind it.
            if let Some(Ok(Some(Intent::Prepare(_)))) = speaker.intent(address, word).now_or_never() {
                let step = Ask::Write { function: 0x06, address, words: vec![word] };
                let written = self.exchange(drive, &step, Terms::of(Class::Command).edge(), arrived).await;
                written.map_err(|code| Refusal::new(code, "the step was not confirmed by the drive"))?;
            }
        }
        Ok(())
    }

    /// Gives an order to the fleet, and waits for what becomes of it as long as the client does.
    pub(super) async fn order(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        action: Action,
        arrived: Instant,
        deadline: Instant,
    ) -> Result<(), Refusal> {
        self.order_asked_after(who, drive, action, (arrived, arrived), deadline).await
    }

    /// The same where a stop by another door since a moment goes before it.
    pub(super) async fn order_asked_after(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        action: Action,
        (arrived, asked_after): (Instant, Instant),
        deadline: Instant,
    ) -> Result<(), Refusal> {
        let left = || deadline.saturating_duration_since(Instant::now());
        let lifetime = Lifetime::Usual(deadline.saturating_duration_since(arrived).min(LONGEST_LIFETIME));
        let target = Target::Drive(drive.name().to_string());
        // While it waits for the audit log, the name may become another motor's.
        let expects = Some(Expects::of(drive));
        let request = Request { id: None, target, action, expects, lifetime, arrived };
        let record = self.record(who.caller, drive, &request);
        record.done().await.map_err(|error| Refusal::rule(error.to_string()))?;
        who.hears()?;
        match self.plant.command_asked_after(who.caller, request, asked_after, left()).await {
            Ok(view) => self.judged(drive, view.outcome, view.text.as_deref()),
            Err(Rejected::NoDrive(name)) => Err(Refusal::new(
                ExceptionCode::GatewayPathUnavailable,
                format!("there is no drive {name:?}"),
            )),
            Err(rejected) => Err(Refusal::rule(rejected.to_string())),
        }
    }

    /// What an outcome is to a client.
    pub(super) fn judged(
        &self,
        drive: &DriveHandle,
        outcome: OutcomeWord,
        text: Option<&str>,
    ) -> Result<(), Refusal> {
        let why = text.unwrap_or("its outcome is not known yet");
        let is_gone = drive.snapshot().link != Link::Connected;
        match outcome {
            OutcomeWord::Confirmed => Ok(()),
            OutcomeWord::Expired => Err(Refusal::new(ExceptionCode::ServerDeviceBusy, why)),
            OutcomeWord::Pending if !is_gone => Err(pending(drive)),
            OutcomeWord::Refused | OutcomeWord::NotConfirmed | OutcomeWord::Superseded if !is_gone => {
                Err(Refusal::rule(why))
            }
            _ => Err(Refusal::new(ExceptionCode::GatewayTargetDevice, why)),
        }
    }
}
