//! One world under one operation: what is said of the motor, against the motor.

use std::time::Duration;

use drive_core::{Control, Direction, Error, ErrorKind, Frequency, Row, Status, StopMode};
use drive_sim::Observation;
use tokio::time::sleep;

use super::{Configuration, Event, Judge, Scene, Surrounded};
use crate::{
    contract::{Contract, is_given},
    truth::{TOLERANCE, contradiction},
};

/// Long enough for every ramp of these drives from 50 Hz to rest.
const SETTLED: Duration = Duration::from_secs(14);

/// What is asked of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Operation {
    /// A start, at 20 Hz.
    Start(Direction),
    /// Another setpoint, of 25 Hz, and where the motor stands a start behind it.
    Setpoint,
    /// A stop.
    Stop(StopMode),
    /// A reset of a trip.
    Reset,
    /// Control is given back.
    Release,
    /// The run command is withdrawn.
    Withdraw,
    /// The settings are saved.
    Save,
    /// A parameter is written that moves no control.
    Parameter,
}

impl Operation {
    /// Every operation that a family has.
    pub(super) fn all(contract: &Contract, family: &dyn Surrounded) -> Vec<Self> {
        let mut all = vec![
            Self::Start(Direction::Forward),
            Self::Start(Direction::Reverse),
            Self::Setpoint,
            Self::Release,
            Self::Withdraw,
            Self::Save,
        ];
        all.extend(contract.trip.map(|_| Self::Reset));
        all.extend(family.parameter().map(|_| Self::Parameter));
        all.extend(StopMode::ALL.map(Self::Stop));
        all
    }
}

/// When an event comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comes {
    /// While the motor stands, or whoever may runs it, before the operation.
    Before,
    /// While the operation is under way.
    Amid,
    /// While the motor runs by our command; the operation comes behind it.
    InRun,
    /// Behind an operation that ends a run of ours.
    After,
}

impl Comes {
    /// All of them that an operation knows.
    pub(super) fn of(operation: Operation) -> &'static [Self] {
        match operation {
            Operation::Stop(_) | Operation::Reset | Operation::Release | Operation::Withdraw => {
                &[Self::Before, Self::Amid, Self::InRun, Self::After]
            }
            _ => &[Self::Before, Self::Amid, Self::InRun],
        }
    }
}

/// How a command ended, for the table of outcomes.
fn ended<T>(result: &Result<T, Error>) -> &'static str {
    match result {
        Ok(_) => "confirmed",
        Err(error) => match error.kind() {
            ErrorKind::NotConfirmed => "not confirmed",
            ErrorKind::OutcomeUnknown => "unknown",
            ErrorKind::NoAnswer | ErrorKind::NotSent => "no answer",
            ErrorKind::Refused | ErrorKind::Exception | ErrorKind::Unsupported => "refused",
            _ => "other",
        },
    }
}

pub(super) fn is_at(seen: &Observation, hundredths: i32) -> bool {
    (seen.output_frequency - hundredths).abs() <= TOLERANCE
}

/// Whether by this a panel takes over a motor that runs, whose twin does not, or runs one whose twin has tripped and does not hear
/// it.
fn takes_over(deed: &str, seen: &Observation, twin: &Observation) -> bool {
    match deed {
        "panel takes" => seen.running && !twin.running,
        "panel run" => seen.local && seen.trip.is_none() && twin.trip.is_some(),
        _ => false,
    }
}

fn rests(seen: &Observation) -> bool {
    is_at(seen, 0) && seen.shaft_frequency.abs() <= TOLERANCE
}

/// A cell of the matrix.
pub(super) struct Cell<'a> {
    contract: &'a Contract,
    family: &'a dyn Surrounded,
    scene: Scene,
    judge: Option<Box<dyn Judge>>,
    event: &'a Event,
    comes: Comes,
    operation: Operation,
    /// Another reading of the manual than the usual: the judge, who follows the manual, is silent or of the first.
    doubtful: bool,
    twin_is_released: bool,
    /// The panel has taken over a motor that ran, as it did not at the twin.
    panel_took_a_run: bool,
    /// The manual decided at least once.
    pub(super) decided: bool,
}

/// `Err`: what was said contradicts what was seen.
type Judged<T = ()> = Result<T, String>;

impl<'a> Cell<'a> {
    pub(super) fn new(
        contract: &'a Contract,
        family: &'a dyn Surrounded,
        configuration: &Configuration,
        reading: Option<&str>,
        (event, comes, operation): (&'a Event, Comes, Operation),
    ) -> Self {
        let scene = Scene::new(contract.capabilities, configuration);
        if let Some(reading) = reading {
            scene.happens(reading);
        }
        let doubtful = reading.is_some();
        Self {
            contract,
            family,
            scene,
            judge: None,
            event,
            comes,
            operation,
            doubtful,
            twin_is_released: false,
            panel_took_a_run: false,
            decided: false,
        }
    }

    fn happens(&mut self, deeds: &[String]) {
        for deed in deeds {
            self.panel_took_a_run |= takes_over(deed, &self.scene.seen(), &self.scene.twin());
            self.scene.happens(deed);
        }
    }

    /// Whether who else is on the line may have a hand in what is seen.
    fn has_masters(&self) -> bool {
        self.event.is_of_a_master()
    }

    /// Lets things settle, with each status held against the shaft, and asks twin and manual then.
    async fn settle(&mut self, when: &str) -> Judged {
        let at = |why: String| format!("{when}: {why}");
        let in_force = self.scene.live(SETTLED).await.map_err(at)?;
        let held = self.scene.drive.lease().is_some();
        let (seen, twin) = (self.scene.seen(), self.scene.twin());
        let turns = seen.running && seen.setpoint != 0 && !is_at(&seen, 0);
        // A panel that has taken over a motor which ran commands it; its twin was taken over at rest.
        let is_panels = seen.local && self.panel_took_a_run;
        if turns && !held && !twin.running && !is_panels && !self.has_masters() {
            return Err(at(format!("it turns, and no lease stands: {seen:?}, the twin {twin:?}")));
        }
        let Some(judge) = self.judge.as_mut().filter(|_| !self.doubtful) else { return Ok(()) };
        let objection = judge.objects(held, in_force);
        self.decided |= judge.decides();
        objection.map_or(Ok(()), |why| Err(at(why)))
    }

    /// What this side did has not moved the motor.
    fn unmoved(&self) -> Judged {
        let (seen, twin) = (self.scene.seen(), self.scene.twin());
        let explained = rests(&seen) || is_at(&seen, twin.output_frequency) || self.has_masters();
        if explained { Ok(()) } else { Err(format!("it moves: {seen:?}, the twin {twin:?}")) }
    }

    async fn give(&mut self, hertz: u16) -> bool {
        is_given(&self.scene.drive.set_setpoint(Frequency::from_hertz(hertz).into()).await)
    }

    /// Runs at 20 Hz. Whether that is confirmed.
    async fn run(&mut self) -> Judged<bool> {
        let ran = self.give(20).await && self.scene.drive.start(Direction::Forward).await.is_ok();
        self.settle("it runs").await?;
        Ok(ran)
    }

    async fn operate(&mut self) -> Result<Option<Status>, Error> {
        let drive = &mut self.scene.drive;
        Ok(match self.operation {
            Operation::Start(direction) => Some(drive.start(direction).await?),
            Operation::Setpoint => {
                drive.set_setpoint(Frequency::from_hertz(25).into()).await?;
                None
            }
            Operation::Stop(mode) => Some(drive.stop(mode).await?.status),
            Operation::Reset => Some(drive.reset_faults().await?),
            Operation::Release => Some(drive.release().await?),
            Operation::Withdraw => Some(drive.withdraw().await?.into_status()),
            Operation::Save => {
                drive.assume_changed();
                drive.persist().await?;
                None
            }
            Operation::Parameter => {
                let parameter = self.family.parameter();
                let row = |code| Row::find(self.contract.capabilities.rows, code);
                if let Some((row, value)) = parameter.and_then(|(code, value)| Some((row(code)?, value))) {
                    drive.write_parameter(row, value).await?;
                }
                None
            }
        })
    }

    /// How the operation ended.
    pub(super) async fn live_through(&mut self) -> Judged<&'static str> {
        self.scene.live(Duration::from_secs(1)).await?;
        self.judge = self.family.judge(&self.scene.machine);
        let ran = self.prepare().await?;
        let Self { event, comes, operation, .. } = *self;
        if matches!(comes, Comes::Before | Comes::InRun) {
            self.happens(&event.comes);
            self.settle("the world has changed").await?;
        }
        let (before, writes) = (self.scene.seen(), self.scene.writes());
        let by_bus = match operation {
            // Where both do the same only the drive can tell by whom.
            Operation::Withdraw => {
                self.scene.drive.status().await.is_ok_and(|it| it.control == Some(Control::Bus))
            }
            _ => false,
        };
        let done = if comes == Comes::Amid { self.operate_amid().await } else { self.operate().await };
        if operation == Operation::Release && comes == Comes::After {
            self.twin_is_released = self.scene.release_twin().await;
        }
        let at_once = self.scene.seen();
        if operation == Operation::Reset && at_once.trip.is_none() {
            self.scene.twin_is_reset();
        }
        let said = match &done {
            // What came amid came perhaps behind the reading.
            _ if comes == Comes::Amid => None,
            Ok(status) => status.as_ref(),
            Err(Error::NotConfirmed { status, .. }) if !status.raw.is_empty() => Some(&**status),
            Err(_) => None,
        };
        if let Some(why) = said.and_then(|status| contradiction(status, &at_once)) {
            return Err(format!("{operation:?} ({}): {why}", ended(&done)));
        }
        let told = done.as_ref().map_or_else(ToString::to_string, |_| "confirmed".to_owned());
        self.settle(&format!("{operation:?} ({told})")).await?;
        self.judge_outcome(&done, ran, &before, &at_once, writes, by_bus)
            .await
            .map_err(|why| format!("{operation:?} ({told}): {why}"))?;
        if comes == Comes::After {
            self.happens(&event.comes);
            self.settle("the world has changed behind it").await?;
            if operation == Operation::Release {
                self.as_the_twin_does(&done)?;
            }
        }
        self.happens(&event.goes);
        self.settle("the world is as before").await?;
        if operation == Operation::Withdraw && ran && done.is_ok() {
            self.unmoved().map_err(|moved| format!("withdrawn, and when the other lets go {moved}"))?;
        }
        // Direct current is ended, and whatever runs by us as well: nothing of ours turns behind a confirmed stop.
        let writes = self.scene.writes();
        let stopped = self.scene.drive.stop(StopMode::Ramp).await;
        self.settle("stopped at last").await?;
        let power_stays_off = event.silences() && event.goes.is_empty();
        self.judge_stop(stopped.as_ref().err(), writes, !power_stays_off)
            .map_err(|why| format!("at last: {why}"))?;
        Ok(ended(&done))
    }

    /// What there is before anything happens. Whether the motor was run by our command, or was given its setpoint.
    async fn prepare(&mut self) -> Judged<bool> {
        if self.operation == Operation::Reset {
            let ran = self.comes == Comes::InRun && self.run().await?;
            if let Some(trip) = self.contract.trip {
                self.happens(&[format!("trip {trip}")]);
            }
            return Ok(ran);
        }
        let ends_a_run = matches!(self.operation, Operation::Stop(_) | Operation::Withdraw);
        let runs = match self.comes {
            Comes::InRun | Comes::After => true,
            Comes::Amid => ends_a_run,
            // What stands, and what others run.
            Comes::Before => self.operation == Operation::Withdraw,
        };
        let ran = if runs { self.run().await? } else { self.give(20).await };
        if self.operation == Operation::Release && self.comes == Comes::After {
            // Its twin ran at another setpoint and is given back too: nothing of ours is left then.
            self.scene.run_twin(35).await;
            let _ = self.scene.drive.stop(StopMode::Ramp).await;
            self.settle("it was stopped").await?;
        }
        Ok(ran)
    }

    /// The event comes behind the first exchanges of the operation, whatever they are.
    async fn operate_amid(&mut self) -> Result<Option<Status>, Error> {
        let (around, event, machine) = (self.scene.around(), self.event, self.scene.machine.clone());
        let twin = self.scene.twin();
        let (done, took) = tokio::join!(self.operate(), async {
            sleep(Duration::from_millis(60)).await;
            let took = |deed: &String| {
                let took = takes_over(deed, &machine.observe(), &twin);
                around.happens(deed);
                took
            };
            event.comes.iter().map(took).fold(false, |took, one| took | one)
        });
        self.panel_took_a_run |= took;
        done
    }

    async fn judge_outcome(
        &mut self,
        done: &Result<Option<Status>, Error>,
        ran: bool,
        before: &Observation,
        at_once: &Observation,
        writes: u64,
        by_bus: bool,
    ) -> Judged {
        // Behind what came amid nobody can say what was so before.
        let clear = self.comes != Comes::Amid && !self.has_masters();
        let seen = self.scene.seen();
        match self.operation {
            Operation::Start(direction) if clear => {
                let way = if direction == Direction::Forward { 1 } else { -1 };
                match done {
                    Ok(_) if ran && !is_at(&seen, way * 2_000) => Err(format!("at 20 Hz: {seen:?}")),
                    Ok(_) if !at_once.running => Err(format!("no output: {at_once:?}")),
                    // Nothing was written that moves it: it does what it did, or what the twin does.
                    Err(_) if ended(done) == "refused" && !is_at(&seen, before.output_frequency) => {
                        self.unmoved()
                    }
                    _ => Ok(()),
                }
            }
            Operation::Setpoint if clear => self.judge_setpoint(done.is_ok(), before).await,
            Operation::Stop(mode) => {
                let hears = !self.event.silences() || self.comes == Comes::After;
                self.judge_stop(done.as_ref().err(), writes, hears)?;
                if done.is_ok() && mode == StopMode::DcInjection {
                    let _ = self.scene.drive.stop(StopMode::Ramp).await;
                    self.settle("the injection is ended").await?;
                }
                Ok(())
            }
            Operation::Reset if !rests(&seen) && clear && self.comes != Comes::InRun => {
                // One that has reset itself before does what others ask.
                if before.trip.is_none() { Ok(()) } else { Err(format!("it moves: {seen:?}")) }
            }
            Operation::Reset if done.is_ok() && seen.trip.is_some() && clear => {
                Err(format!("it has tripped: {seen:?}"))
            }
            Operation::Release if self.comes == Comes::After => self.unmoved(),
            Operation::Withdraw if clear && ran => {
                let twin = self.scene.twin();
                let ours = by_bus || !is_at(before, twin.output_frequency);
                let kept = is_at(&seen, before.output_frequency) || is_at(&seen, twin.output_frequency);
                if ours || kept { Ok(()) } else { Err(format!("others command: {before:?} to {seen:?}")) }
            }
            _ => Ok(()),
        }
    }

    async fn judge_setpoint(&mut self, given: bool, before: &Observation) -> Judged {
        let seen = self.scene.seen();
        let holds = is_at(&seen, 2_500) || is_at(&seen, -2_500);
        if before.running && given && seen.running && !rests(&seen) && !holds {
            return Err(format!("25 Hz to who runs it: {seen:?}"));
        }
        if before.running {
            return Ok(());
        }
        self.unmoved()?;
        if given && self.scene.drive.start(Direction::Forward).await.is_ok() {
            self.settle("it was started").await?;
            let seen = self.scene.seen();
            if !is_at(&seen, 2_500) {
                return Err(format!("25 Hz, and a start is confirmed: {seen:?}"));
            }
        }
        Ok(())
    }

    /// A stop is written, whatever is known, and after one that is confirmed the motor is at rest.
    fn judge_stop(&self, failed: Option<&Error>, writes: u64, hears: bool) -> Judged {
        let seen = self.scene.seen();
        match failed {
            _ if hears && self.scene.writes() == writes => {
                Err(format!("a stop that wrote nothing: {failed:?}"))
            }
            Some(error) if matches!(error.kind(), ErrorKind::Unsupported | ErrorKind::Refused) => {
                Err(format!("a stop was refused: {error}"))
            }
            // What came amid came perhaps behind the stop.
            None if self.comes == Comes::Amid && self.scene.twin().running => Ok(()),
            // A master who stays may start it again.
            None if !is_at(&seen, 0) && !self.has_masters() => Err(format!("it turns: {seen:?}")),
            _ => Ok(()),
        }
    }

    /// Behind a release the world has its way, as with a twin that was given back too.
    fn as_the_twin_does(&mut self, released: &Result<Option<Status>, Error>) -> Judged {
        let (seen, twin) = (self.scene.seen(), self.scene.twin());
        match released {
            _ if self.has_masters() => Ok(()),
            Ok(_) if self.twin_is_released && !is_at(&seen, twin.output_frequency) => {
                Err(format!("released, and the world does not get its way: {seen:?}, the twin {twin:?}"))
            }
            // The setpoint that stands is the bus's where it is to be; who starts the motor is another matter.
            Err(_) if !rests(&seen) && !twin.running => {
                Err(format!("not released, and it moves: {seen:?}, the twin {twin:?}"))
            }
            _ => Ok(()),
        }
    }
}
