//! Confirmed means in force: every control configuration of the five manuals, in every state of the world, against every
//! command. What the simulated motor does is held against what the drive said, by three statements:
//!
//! 1. what is confirmed decides: a motor whose start and setpoint are confirmed turns that way, that fast;
//! 2. a stop is written, whatever is known, and after one that is confirmed the motor comes to rest and stays there;
//! 3. nothing but a start moves a motor.
//!
//! What the motor's twin does too, in the same world and without this side, the plant has done.

use std::{collections::BTreeMap, time::Duration};

use drive_core::{Control, Direction, Error, ErrorKind, Frequency, Status, StopMode};
use drive_families::Family;
use drive_sim::Observation;
use support::{
    configurations::{Configuration, World, configurations, worlds},
    drives,
    scene::Scene,
};

/// Long enough for every ramp of these drives from 50 Hz to rest.
const SETTLED: Duration = Duration::from_secs(14);
/// What is seen of a motor that stands, or has reached a speed, in hundredths of a hertz.
const TOLERANCE: i32 = 20;

/// What is asked of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ask {
    Start(Way),
    /// A setpoint while the motor stands, and a start after it.
    SetpointThenStart,
    /// A setpoint while the motor runs by a start.
    SetpointOnTheRun,
    /// A stop of whatever runs: by a start before the world changed.
    Stop(StopMode),
    /// A stop of what the world runs, and of what stands.
    StopOfOthers(StopMode),
    Reset,
    Release,
    Withdraw,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Forward,
    Reverse,
    /// On the run forward.
    Turned,
}

fn asks() -> Vec<Ask> {
    let mut asks = vec![
        Ask::Start(Way::Forward),
        Ask::Start(Way::Reverse),
        Ask::Start(Way::Turned),
        Ask::SetpointThenStart,
        Ask::SetpointOnTheRun,
        Ask::Reset,
        Ask::Release,
        Ask::Withdraw,
    ];
    asks.extend(StopMode::ALL.map(Ask::Stop));
    asks.extend(StopMode::ALL.map(Ask::StopOfOthers));
    asks
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

fn is_at(seen: &Observation, hundredths: i32) -> bool {
    (seen.output_frequency - hundredths).abs() <= TOLERANCE
}

fn rests(seen: &Observation) -> bool {
    is_at(seen, 0) && seen.shaft_frequency.abs() <= TOLERANCE
}

/// Whether a motor turns otherwise than the drive says.
fn is_the_other_way(status: &Status, seen: &Observation) -> bool {
    let turns = seen.shaft_frequency.abs() > TOLERANCE;
    let reverse = seen.shaft_frequency < 0;
    turns && status.direction.is_some_and(|direction| (direction == Direction::Reverse) != reverse)
}

/// A cell of the matrix under way.
struct Cell {
    scene: Scene,
    world: World,
}

/// What was said against what was seen; `Err`: they contradict each other.
type Verdict = Result<&'static str, String>;

impl Cell {
    async fn new(configuration: &Configuration, world: &World) -> Self {
        let mut scene = Scene::new(configuration.family, configuration.model, &configuration.options);
        for setting in configuration.settings {
            scene.happens(setting);
        }
        scene.live(Duration::from_secs(1)).await;
        Self { scene, world: world.clone() }
    }

    async fn world_comes(&mut self) {
        for deed in &self.world.comes {
            self.scene.happens(deed);
        }
        self.scene.live(SETTLED).await;
    }

    async fn run(&mut self, hertz: u16) -> bool {
        let frequency = Frequency::from_hertz(hertz);
        let given = self.scene.drive.set_setpoint(frequency.into()).await.is_ok();
        let started = self.scene.drive.start(Direction::Forward).await.is_ok();
        self.scene.live(SETTLED).await;
        given && started
    }

    /// Statement 3: what this side did has not moved the motor.
    fn unmoved(&self) -> Result<(), String> {
        let (seen, twin) = (self.scene.seen(), self.scene.twin());
        let as_twin = is_at(&seen, twin.output_frequency);
        if rests(&seen) || as_twin { Ok(()) } else { Err(format!("it moves: {seen:?}, the twin {twin:?}")) }
    }

    async fn judge(mut self, ask: Ask) -> Verdict {
        match ask {
            Ask::Start(way) => self.start(way).await,
            Ask::SetpointThenStart => self.setpoint_then_start().await,
            Ask::SetpointOnTheRun => self.setpoint_on_the_run().await,
            Ask::Stop(mode) => self.stop(mode, true).await,
            Ask::StopOfOthers(mode) => self.stop(mode, false).await,
            Ask::Reset => self.reset().await,
            Ask::Release => self.release().await,
            Ask::Withdraw => self.withdraw().await,
        }
    }

    async fn start(&mut self, way: Way) -> Verdict {
        if way == Way::Turned && !self.run(20).await {
            return Ok("not run");
        }
        self.world_comes().await;
        let given = way == Way::Turned
            || self.scene.drive.set_setpoint(Frequency::from_hertz(20).into()).await.is_ok();
        // Whoever runs it already may have been given the setpoint.
        self.scene.live(SETTLED).await;
        let before = self.scene.seen();
        let direction = if way == Way::Forward { Direction::Forward } else { Direction::Reverse };
        let started = self.scene.drive.start(direction).await;
        // What is confirmed is in force at once, not when the motor has come to rest in between.
        let at_once = self.scene.seen();
        self.scene.live(SETTLED).await;
        let seen = self.scene.seen();
        let target = if way == Way::Forward { 2_000 } else { -2_000 };
        match &started {
            Ok(_) if given && !is_at(&seen, target) => {
                return Err(format!("start confirmed, asked {target}: {seen:?}"));
            }
            Ok(_) if !at_once.running => return Err(format!("start confirmed, no output: {at_once:?}")),
            // It may still come down from the other direction, if that is what the drive says.
            Ok(status) if is_the_other_way(status, &at_once) => {
                return Err(format!("start confirmed as {:?}: {at_once:?}", status.direction));
            }
            Err(error) if matches!(ended(&started), "refused") => {
                // Nothing was written that moves it: it does what it did, or what the twin does.
                let same = is_at(&seen, before.output_frequency);
                if !same && self.unmoved().is_err() {
                    return Err(format!("refused ({error}) and moved: {before:?} to {seen:?}"));
                }
            }
            _ => {}
        }
        let told = ended(&started);
        self.stopped_afterwards().await?;
        Ok(told)
    }

    /// Whatever became of a start: a stop after it stops, or says that it cannot.
    async fn stopped_afterwards(&mut self) -> Result<(), String> {
        let writes = self.scene.writes();
        let stopped = self.scene.drive.stop(StopMode::Ramp).await;
        self.judge_stop(writes, &stopped.map(|_| ()), StopMode::Ramp).await
    }

    async fn setpoint_then_start(&mut self) -> Verdict {
        self.world_comes().await;
        let runs = self.scene.seen().running;
        let at_rest = rests(&self.scene.seen()) && !runs;
        let given = self.scene.drive.set_setpoint(Frequency::from_hertz(25).into()).await;
        self.scene.live(SETTLED).await;
        let seen = self.scene.seen();
        if at_rest {
            self.unmoved().map_err(|moved| format!("a setpoint ({}) and {moved}", ended(&given)))?;
        } else if runs && given.is_ok() && seen.running && seen.output_frequency.abs() != 2_500 {
            return Err(format!("setpoint 25 Hz confirmed to who runs it: {seen:?}"));
        }
        if given.is_ok() && self.scene.drive.start(Direction::Forward).await.is_ok() {
            self.scene.live(SETTLED).await;
            let seen = self.scene.seen();
            if !is_at(&seen, 2_500) {
                return Err(format!("setpoint 25 Hz and start confirmed: {seen:?}"));
            }
        }
        Ok(ended(&given))
    }

    async fn setpoint_on_the_run(&mut self) -> Verdict {
        if !self.run(20).await {
            return Ok("not run");
        }
        self.world_comes().await;
        let running = self.scene.seen().running;
        let given = self.scene.drive.set_setpoint(Frequency::from_hertz(25).into()).await;
        self.scene.live(SETTLED).await;
        let seen = self.scene.seen();
        if given.is_ok() && running && seen.running && !rests(&seen) && seen.output_frequency.abs() != 2_500 {
            return Err(format!("setpoint 25 Hz confirmed on the run: {seen:?}"));
        }
        if !running {
            self.unmoved().map_err(|moved| format!("a setpoint ({}) and {moved}", ended(&given)))?;
        }
        Ok(ended(&given))
    }

    async fn stop(&mut self, mode: StopMode, started: bool) -> Verdict {
        if started && !self.run(20).await {
            return Ok("not run");
        }
        self.world_comes().await;
        let writes = self.scene.writes();
        let stopped = self.scene.drive.stop(mode).await;
        let used = stopped.as_ref().map_or(mode, |stopped| stopped.mode);
        let told = ended(&stopped);
        self.judge_stop(writes, &stopped.map(|_| ()), used).await?;
        Ok(told)
    }

    /// Statement 2.
    async fn judge_stop(
        &mut self,
        writes: u64,
        stopped: &Result<(), Error>,
        used: StopMode,
    ) -> Result<(), String> {
        let hears = !self.world.comes.iter().any(|deed| deed.starts_with("power "));
        if hears && self.scene.writes() == writes {
            return Err(format!("a stop that wrote nothing: {stopped:?}"));
        }
        if let Err(error) = stopped
            && matches!(error.kind(), ErrorKind::Unsupported | ErrorKind::Refused)
        {
            return Err(format!("a stop was refused: {error}"));
        }
        self.scene.live(SETTLED).await;
        let seen = self.scene.seen();
        if stopped.is_ok() && !is_at(&seen, 0) {
            return Err(format!("stop by {used} confirmed, and it turns: {seen:?}"));
        }
        if stopped.is_ok() && used == StopMode::DcInjection {
            let _ = self.scene.drive.stop(StopMode::Ramp).await;
        }
        self.scene.live(SETTLED).await;
        let seen = self.scene.seen();
        if stopped.is_ok() && !is_at(&seen, 0) {
            return Err(format!("it turns again after a confirmed stop: {seen:?}"));
        }
        Ok(())
    }

    async fn reset(&mut self) -> Verdict {
        self.scene.happens(&format!("trip {}", drives::a_trip_name(self.scene.family())));
        self.world_comes().await;
        if self.scene.seen().trip.is_none() {
            // It has reset itself, and whoever asked for a run has it.
            return Ok("not tripped");
        }
        let reset = self.scene.drive.reset_faults().await;
        self.scene.live(SETTLED).await;
        let seen = self.scene.seen();
        if !rests(&seen) {
            return Err(format!("a fault reset ({}) moved the motor: {seen:?}", ended(&reset)));
        }
        if reset.is_ok() && seen.trip.is_some() {
            return Err(format!("the reset is confirmed and the drive has tripped: {seen:?}"));
        }
        Ok(ended(&reset))
    }

    /// At rest after a run of ours control is given back; then the world acts, and the drive does what its twin does, which
    /// ran at another setpoint and was given back too: nothing of ours is left.
    async fn release(&mut self) -> Verdict {
        self.run(20).await;
        self.scene.run_twin(35).await;
        if self.scene.drive.stop(StopMode::Ramp).await.is_err() {
            return Ok("not stopped");
        }
        self.scene.live(SETTLED).await;
        let released = self.scene.drive.release().await;
        let twin_released = self.scene.release_twin().await;
        self.scene.live(SETTLED).await;
        self.unmoved().map_err(|moved| format!("a release ({}) and {moved}", ended(&released)))?;
        self.world_comes().await;
        let (seen, twin) = (self.scene.seen(), self.scene.twin());
        match &released {
            Ok(_) if twin_released && !is_at(&seen, twin.output_frequency) => {
                Err(format!("released, and the world does not get its way: {seen:?}, the twin {twin:?}"))
            }
            // The setpoint that stands is the bus's where it is to be; who starts the motor is another matter.
            Err(_) if !rests(&seen) && !twin.running => {
                Err(format!("not released ({}), and it moves: {seen:?}, the twin {twin:?}", ended(&released)))
            }
            _ => Ok(ended(&released)),
        }
    }

    /// Somebody else has taken over while the motor ran by our start. After our run command is withdrawn he lets go, and
    /// nothing starts by it.
    async fn withdraw(&mut self) -> Verdict {
        if !self.run(20).await {
            return Ok("not run");
        }
        self.world_comes().await;
        let before = self.scene.seen();
        // Where both do the same only the drive can tell by whom.
        let by_bus = self.scene.drive.status().await.is_ok_and(|status| status.control == Some(Control::Bus));
        let ours = by_bus || !is_at(&before, self.scene.twin().output_frequency);
        let withdrawn = self.scene.drive.withdraw().await;
        self.scene.live(SETTLED).await;
        let held = self.scene.seen();
        if !ours
            && !is_at(&held, before.output_frequency)
            && !is_at(&held, self.scene.twin().output_frequency)
        {
            return Err(format!("a withdrawal changed what others command: {before:?} to {held:?}"));
        }
        for deed in &self.world.goes.clone() {
            self.scene.happens(deed);
        }
        self.scene.live(SETTLED).await;
        if withdrawn.is_ok() {
            self.unmoved().map_err(|moved| format!("withdrawn, and when the other lets go {moved}"))?;
        }
        Ok(ended(&withdrawn))
    }
}

/// Of so many cells under a doubtful reading of the manual one is lived through: `DRIVED_ONE_IN`, 1 for all of them.
fn one_in() -> usize {
    let given = std::env::var("DRIVED_ONE_IN").map_or(Ok(61), |one_in| one_in.parse());
    given.expect("DRIVED_ONE_IN is a number")
}

/// The cells of a family: how many were lived through, and those that contradict themselves. Those under the usual reading
/// are taken twelve times as often as those under a doubtful one.
async fn matrix(family: Family) -> (usize, Vec<String>) {
    let doubtful_one_in = one_in();
    let usual_one_in = doubtful_one_in.div_ceil(12);
    let mut outcomes: BTreeMap<(String, &'static str), usize> = BTreeMap::new();
    let mut wrong = Vec::new();
    let (mut usual, mut doubtful, mut seen) = (0_usize, 0_usize, 0_usize);
    for configuration in configurations(family) {
        let around = Scene::new(family, configuration.model, &configuration.options).machine.surroundings();
        let doubts = around.switches.iter().flat_map(|switch| {
            let others = switch.readings.iter().skip(1);
            others.map(|reading| format!("reading {} {reading}", switch.name))
        });
        let readings: Vec<Option<String>> = std::iter::once(None).chain(doubts.map(Some)).collect();
        for world in worlds(around) {
            for ask in asks() {
                for reading in &readings {
                    let (count, one_in) = match reading {
                        None => (&mut usual, usual_one_in),
                        Some(_) => (&mut doubtful, doubtful_one_in),
                    };
                    *count += 1;
                    if !count.is_multiple_of(one_in) {
                        continue;
                    }
                    let cell = Cell::new(&configuration, &world).await;
                    if let Some(reading) = reading {
                        cell.scene.happens(reading);
                    }
                    seen += 1;
                    match cell.judge(ask).await {
                        Ok(outcome) => *outcomes.entry((format!("{ask:?}"), outcome)).or_default() += 1,
                        Err(why) => wrong.push(format!(
                            "{family} [{} {:?}] {reading:?} {:?} {ask:?}: {why}",
                            configuration.name, configuration.options.authority, world.comes
                        )),
                    }
                }
            }
        }
    }
    println!("{family}: {seen} cells, {} contradictions", wrong.len());
    for ((ask, outcome), count) in outcomes {
        println!("{family} | {ask} | {outcome} | {count}");
    }
    (seen, wrong)
}

async fn holds(family: Family) {
    let (seen, wrong) = matrix(family).await;
    assert!(wrong.is_empty(), "{} of {seen} cells:\n{}", wrong.len(), wrong.join("\n"));
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_21_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::Atv21).await;
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_28_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::Atv28).await;
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_58_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::Atv58).await;
}

#[tokio::test(start_paused = true)]
async fn what_an_altivar_312_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::Atv312).await;
}

#[tokio::test(start_paused = true)]
async fn what_a_3g3ev_confirms_is_in_force_whoever_else_may_decide() {
    holds(Family::Omron3g3ev).await;
}
