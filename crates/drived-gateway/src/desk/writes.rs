//! Writes: judged as commands of the fleet are, carried out by it, and confirmed once they are in force.

use std::time::Duration;

use drive_core::{
    Class, Direction, Drive, Error, Intent, Row, Setpoint, StopMode, Terms, tokio_modbus::ExceptionCode,
};
use drive_families::Family;
use drive_fleet::{DriveHandle, Link, Until};
use futures_util::{FutureExt as _, future::join_all};
use tokio::time::{Instant, sleep_until, timeout_at};

use super::{Answer, Desk};
use crate::{
    clients::{Before, Connection},
    config::GatewayConfig,
    pdu::Ask,
};
use drived_doors::{
    Caller,
    audit::{Kind, Record},
};
use drived_plant::plant::{
    commands::{Action, Expects, LONGEST_LIFETIME, Lifetime, OutcomeWord, Rejected, Request, Target},
    revisions::Subject,
    watched::WatchedDoor,
};

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

/// How long a start waits for the end of its connection. Where both were held back on the way the end comes second: by the round trip of
/// the confirmation, which a system may put off by 40 ms.
const END_FOLLOWS: Duration = Duration::from_millis(100);

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
        match self.by.is_open() {
            true => Ok(()),
            false => {
                Err(Refusal::rule("its client has closed the connection: nobody would hear that it was done"))
            }
        }
    }
}

/// A stop that waits for nothing, by this mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Stop(StopMode);

impl Desk {
    /// Whether a write stops the motor, so that it goes ahead of what waits: a word that is a stop; or one without a run
    /// command, unless the motor is known to stand and nothing is about to start it.
    pub(crate) fn stop_in(&self, unit: u8, ask: &Ask) -> Option<Stop> {
        let Ask::Write { .. } = ask else { return None };
        if unit == 0 && self.config.broadcast {
            return self.broadcast_stop(ask);
        }
        let drive = self.drive(unit).filter(|_| self.config.rights.stop)?;
        let by_a_word = self.intents_without_reading(&drive, ask).find_map(|intent| match intent {
            Intent::Prepare(_) if stands(&drive) => None,
            Intent::ResetFaults(_) if stands(&drive) || shows_fault(&drive) => None,
            intent => self.stops_by(&drive, intent),
        });
        let places: Vec<_> = ask.places().collect();
        by_a_word.or_else(|| self.speaker(&drive)?.stopped_by(&places)).map(Stop)
    }

    /// How what a word asks stops a motor that runs, if it does. In a quick stop of the chart no word acts but one that disables the
    /// voltage: what else would stop it, as a shutdown that lets it coast, leaves it to that.
    fn stops_by(&self, drive: &DriveHandle, intent: Intent) -> Option<StopMode> {
        let mode = intent.stops()?;
        let is_left = !disables_voltage(intent) && self.plant.quick_stops().locks(drive);
        Some(if is_left { StopMode::Fast } else { mode })
    }

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

    /// Stops a motor by what a client has written: a quick stop locks it from its word on, and one that disables the voltage ends that
    /// once the drive has shown it.
    async fn stop_as_asked(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        Stop(mode): Stop,
        ask: &Ask,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        self.clients.write_without_run(who.by, drive.place());
        let asked: Vec<Intent> = self.intents_without_reading(drive, ask).collect();
        if asked.contains(&Intent::QuickStop) {
            self.plant.quick_stops().lock(drive);
        }
        self.stop(who.caller, drive, mode, arrived).await?;
        if asked.iter().any(|intent| disables_voltage(*intent)) && !asked.contains(&Intent::QuickStop) {
            self.plant.quick_stops().unlock(drive);
        }
        Ok(())
    }

    fn caller(&self, by: &Connection) -> Caller {
        Caller::new(self.config.name.clone(), format!("modbus {}", by.peer), self.config.rights)
    }

    /// What each word of a write asks, as far as that needs no exchange.
    fn intents_without_reading(
        &self,
        drive: &DriveHandle,
        ask: &Ask,
    ) -> impl Iterator<Item = Intent> + use<> {
        let mut speaker = self.speaker(drive);
        let words: Vec<(u16, u16)> = ask.writes().filter(|_| !ask.is_of_coils()).collect();
        words.into_iter().filter_map(move |(register, word)| {
            speaker.as_mut()?.intent(register, word).now_or_never()?.ok().flatten()
        })
    }

    /// The drive of the family that knows its words, on the same line. It reads units; it writes nothing.
    fn speaker(&self, drive: &DriveHandle) -> Option<Box<dyn Drive>> {
        let family: Family = drive.capabilities().key.parse().ok()?;
        let (_, line) = drive.line();
        let options = self.plant.options(drive.name());
        Some(family.open_with(line.slave(drive.slave().number()), drive.slave(), &options))
    }

    /// Whether the words of a broadcast stop the drives of this gateway.
    fn broadcast_stop(&self, ask: &Ask) -> Option<Stop> {
        // What a word of one drive by file asks of another nothing tells: it may be a start there.
        let is_built_in = |drive: &DriveHandle| {
            Family::BUILT_IN.iter().any(|family| family.capabilities().key == drive.capabilities().key)
        };
        let drives: Vec<_> = self.drives().into_iter().filter(is_built_in).collect();
        let intents = drives.iter().flat_map(|drive| self.intents_without_reading(drive, ask));
        stop_of_all(intents)
    }

    /// Stops a motor. Confirmed when the drive shows that no run command is in force any more; it may still come down.
    async fn stop(
        &self,
        caller: &Caller,
        drive: &DriveHandle,
        mode: StopMode,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        let request = Request {
            id: None,
            target: Target::Drive(drive.name().to_string()),
            action: Action::Stop(mode.into()),
            expects: Some(Expects::of(drive)),
            lifetime: Lifetime::Usual(LONGEST_LIFETIME),
            arrived,
        };
        self.record(caller, drive, &request).whenever();
        let left = (arrived + self.config.patience).saturating_duration_since(Instant::now());
        let settled = self.plant.command(caller, request, left);
        let taken = drive.wait_until(|snapshot| snapshot.stop.is_some_and(|stop| stop.taken));
        // It is on its way before anything is looked at, and goes on whoever waits.
        tokio::select! {
            biased;
            view = settled => match view {
                Ok(view) => self.judged(drive, view.outcome, view.text.as_deref()),
                Err(rejected) => Err(Refusal::rule(rejected.to_string())),
            },
            // A drive that has left shows nothing any more.
            Some(_) = async { taken.await.stop.filter(|stop| stop.taken) } => Ok(()),
        }
    }

    /// The setpoint that was written together with a stop.
    async fn setpoint_beside(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        ask: &Ask,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        if ask.is_of_coils() || ask.writes().count() == 1 {
            return Ok(());
        }
        let deadline = arrived + self.config.patience;
        let wanted = timeout_at(deadline, self.wanted(drive, ask)).await.map_err(|_| busy())??;
        match wanted.and_then(|wanted| wanted.setpoint) {
            Some(setpoint) if drive.snapshot().setpoint != Some(setpoint) => {
                let action = Action::Setpoint { setpoint, until: Until::InForce };
                let given = self.order(who, drive, action, arrived, deadline).await;
                given.map_err(|Refusal { code, why }| {
                    Refusal::new(code, format!("it stops; its setpoint: {why}"))
                })
            }
            _ => Ok(()),
        }
    }

    /// What a write asks of the motor; `None` where it commands nothing. Words that are not understood, and commands among
    /// other registers, are refused as a whole.
    async fn wanted(&self, drive: &DriveHandle, ask: &Ask) -> Result<Option<Wanted>, Refusal> {
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
    async fn command(
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
    async fn start(
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
        sleep_until((arrived + END_FOLLOWS).min(deadline)).await;
        who.hears()?;
        self.plant.watched().start(watched(&self.config), who.by.peer, drive).await;
        self.order_asked_after(who, drive, action, (arrived, asked_after), deadline).await
    }

    /// Whether what is no stop may begin, where the plant does not judge that or not yet.
    fn may_begin(&self, who: Who<'_>) -> Result<(), Refusal> {
        match self.plant.is_closing() {
            true => Err(Refusal::rule(Rejected::Closing.to_string())),
            false => who.hears(),
        }
    }

    /// A step of the ladder is written as it is, so that the drive shows it. The motor stands, or it would be a stop.
    async fn prepare(
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

    /// Parameters: each is a row of the family that may be written, all are judged before the first is, and each is read back.
    async fn parameters(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        ask: &Ask,
        deadline: Instant,
    ) -> Result<(), Refusal> {
        if !self.config.raw_writes {
            return Err(Refusal::rule("it is no command, and raw_writes is not set"));
        }
        let rows = drive.capabilities().rows;
        let mut writes: Vec<(&'static Row, u16)> = Vec::new();
        for (register, word) in ask.writes() {
            let row = rows.iter().find(|row| row.place() == register.into() && row.access.is_writable());
            let Some(row) = row else {
                let why = format!("register {register} is no parameter of the family's list");
                return Err(Refusal::new(ExceptionCode::IllegalDataAddress, why));
            };
            if row.storage.may_wear() && !self.config.eeprom_writes {
                let why = format!("{} may be written to the EEPROM, and eeprom_writes is not set", row.code);
                return Err(Refusal::rule(why));
            }
            writes.push((row, word));
        }
        let drive = drive.commanded_by(&*self.config.name);
        let judged = timeout_at(deadline, self.plant.forbids(&drive, &writes)).await;
        if let Some(why) = judged.map_err(|_| pending(&drive))? {
            return Err(Refusal::rule(why));
        }
        for (row, word) in writes {
            let what = format!("{}: {} = {word}", drive.name(), row.code);
            let record = self.audit.record(Record::new(Kind::Command, who.caller, what));
            record.done().await.map_err(|error| Refusal::rule(error.to_string()))?;
            self.is_still(&drive)?;
            who.hears()?;
            let written = timeout_at(deadline, drive.write_parameter(row, word)).await;
            let written = written.map_err(|_| pending(&drive))?;
            let written = written.map_err(|refused| Refusal::rule(format!("{}: {refused}", row.code)))?;
            self.plant.tell_written(who.caller, &drive, row, word, written.changed);
        }
        Ok(())
    }

    /// Whether a drive is the one that its unit meant, for what the plant does not judge.
    fn is_still(&self, drive: &DriveHandle) -> Result<(), Refusal> {
        let judged = self.plant.is_as_shown(&Expects::of(drive), &[drive.name().to_string()]);
        judged.map_err(|otherwise| Refusal::rule(Rejected::Otherwise(otherwise).to_string()))
    }

    /// Gives an order to the fleet, and waits for what becomes of it as long as the client does.
    async fn order(
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
    async fn order_asked_after(
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
    fn judged(&self, drive: &DriveHandle, outcome: OutcomeWord, text: Option<&str>) -> Result<(), Refusal> {
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

/// Whether a word disables the voltage, which ends the lock behind a quick stop (BBV51701 p. 10 to 12).
const fn disables_voltage(intent: Intent) -> bool {
    matches!(intent, Intent::Stop(StopMode::Freewheel) | Intent::ResetFaults(_))
}

fn busy() -> Refusal {
    Refusal::new(ExceptionCode::ServerDeviceBusy, "the line had no room in time")
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

/// How the words stop all, if they do, by what they ask of each drive that understands them: whoever speaks of one family to all means
/// all of them, so that they do when they stop any and start none. The mode is that of the first.
fn stop_of_all(intents: impl Iterator<Item = Intent>) -> Option<Stop> {
    let mut first = None;
    for intent in intents {
        match intent {
            Intent::Start(_) => return None,
            other => first = first.or(other.stops().map(Stop)),
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use drive_core::Direction;

    use super::*;

    #[test]
    fn words_for_one_family_stop_every_drive_of_a_gateway_that_none_of_them_starts() {
        let stop = Intent::Stop(StopMode::Freewheel);
        assert_eq!(stop_of_all([].into_iter()), None, "nobody understands it");
        assert_eq!(stop_of_all([stop, stop].into_iter()), Some(Stop(StopMode::Freewheel)));
        assert_eq!(stop_of_all([Intent::Start(Direction::Forward), stop].into_iter()), None);
        assert_eq!(stop_of_all([stop, Intent::Start(Direction::Reverse)].into_iter()), None);
    }
}
