//! Random drives in random worlds under random commands: what is confirmed is in force, a stop is written and stops, nothing but a
//! start moves a motor, and the manual has nothing against it. A seed plays the same run again.

use std::time::Duration;

use drive_core::{
    Direction, ErrorKind, Frequency, Motion, Result, StopMode,
    registers::{Row, Storage},
};
use drive_sim::{Observation, Surroundings};
use fastrand::Rng;

use super::{Event, Judge, Scene, Surrounded, Values};
use crate::{contract::Contract, truth::TOLERANCE};

/// Long enough for every ramp of these drives from 50 Hz to rest; their ramps are left as they are.
const SETTLED: Duration = Duration::from_secs(14);

/// A drive with the settings and the world that a seed gives, and what was told to it so far.
struct Run {
    rng: Rng,
    scene: Scene,
    /// The manual, where each reading of it is the usual one.
    judge: Option<Box<dyn Judge>>,
    trip: Option<u16>,
    events: Vec<Event>,
    /// What has happened around the drive and can be taken back.
    present: Option<Event>,
    /// The setpoint that was confirmed last, in hundredths of a hertz.
    given: Option<i32>,
    /// A start of ours may be in force.
    started: bool,
    powered: bool,
    tripped: bool,
    story: Vec<String>,
}

type Judged = std::result::Result<(), String>;

impl Contract {
    /// Lives through the random world of this seed, on a drive with random settings, under random commands. What contradicted
    /// itself, with all that happened before.
    ///
    /// # Panics
    /// When a configuration or an event is none of the simulator's.
    pub async fn contradiction_in_random_world(&self, seed: u64) -> Option<String> {
        let family = self.around.as_deref()?;
        let mut run = Run::new(self, family, seed).await;
        let why = run.play().await.err()?;
        Some(format!("seed {seed}: {}\n  {why}", run.story.join("\n  ")))
    }
}

impl Run {
    async fn new(contract: &Contract, family: &dyn Surrounded, seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let all = family.configurations();
        let configuration = &all[rng.usize(..all.len())];
        let mut scene = Scene::new(contract.capabilities, configuration);
        let mut story = vec![format!("{} [{}]", contract.capabilities.name, configuration.name)];
        for _ in 0..rng.usize(..4) {
            if let Some((row, value)) = a_setting(&mut rng, contract, family)
                && scene.is_set_to(row, value)
            {
                story.push(format!("set {} {value}", row.code));
            }
        }
        let around: &Surroundings = scene.machine.surroundings();
        let usual = rng.bool();
        for switch in around.switches.iter().filter(|_| !usual) {
            let reading = switch.readings[rng.usize(..switch.readings.len())];
            scene.happens(&format!("reading {} {reading}", switch.name));
            story.push(format!("reading {} {reading}", switch.name));
        }
        // What is said of a drive that nobody has commanded yet is judged with what follows.
        let _ = scene.live(Duration::from_secs(1)).await;
        let judge = if usual { family.judge(&scene.machine) } else { None };
        Self {
            rng,
            judge,
            trip: contract.trip,
            events: family.events(around),
            scene,
            present: None,
            given: None,
            started: false,
            powered: true,
            tripped: false,
            story,
        }
    }

    fn happens(&mut self, deed: &str) {
        self.scene.happens(deed);
    }

    /// Time passes; what is said then, against shaft and manual.
    async fn live(&mut self, time: Duration) -> Judged {
        let in_force = self.scene.live(time).await?;
        let held = self.scene.drive.lease().is_some();
        let objection =
            self.judge.as_mut().filter(|_| time == SETTLED).and_then(|judge| judge.objects(held, in_force));
        objection.map_or(Ok(()), Err)
    }

    /// A few steps; what contradicts.
    async fn play(&mut self) -> Judged {
        for _ in 0..self.rng.usize(3..9) {
            match self.rng.u8(..10) {
                0 | 1 => self.world_changes(),
                2 => self.trip(),
                3 | 4 => self.start().await?,
                5 => self.setpoint().await?,
                6 | 7 => self.stop().await?,
                8 => self.reset().await,
                _ => self.release_or_withdraw().await,
            }
            self.live(SETTLED).await?;
            let Observation { running, output_frequency, trip, .. } = self.scene.seen();
            self.story.push(format!("  then runs: {running}, {output_frequency}, trip {trip:?}"));
            if self.tripped && trip.is_none() {
                // Whoever reset it may have reset its references as well.
                self.given = None;
            }
            self.tripped = trip.is_some();
            self.only_a_start_moves()?;
        }
        Ok(())
    }

    fn world_changes(&mut self) {
        let world = match self.present.take() {
            Some(world) if self.rng.bool() => Event { comes: world.goes, goes: Vec::new() },
            before => {
                let next = self.events[self.rng.usize(..self.events.len())].clone();
                // A supply that was taken away comes back first.
                let back = before.into_iter().flat_map(|before| before.goes);
                Event { comes: back.chain(next.comes).collect(), goes: next.goes }
            }
        };
        for deed in &world.comes {
            self.happens(deed);
            self.powered = match deed.as_str() {
                "power off" => false,
                "power on" => true,
                _ => self.powered,
            };
        }
        if world.comes.iter().any(|deed| deed.starts_with("power ")) {
            // What was started does not start again by itself.
            (self.started, self.given) = (false, None);
        }
        self.story.push(world.comes.join("; "));
        self.present = (!world.goes.is_empty()).then_some(world);
    }

    fn trip(&mut self) {
        let Some(trip) = self.trip else { return };
        let deed = format!("trip {trip}");
        self.happens(&deed);
        self.story.push(deed);
    }

    async fn start(&mut self) -> Judged {
        let direction = if self.rng.bool() { Direction::Forward } else { Direction::Reverse };
        let started = self.scene.drive.start(direction).await;
        self.tell(&format!("start {direction}"), &started);
        let refused = matches!(&started, Err(error) if error.kind() == ErrorKind::Refused);
        self.started |= !refused;
        let Ok(_) = started else { return Ok(()) };
        let at_once = self.scene.seen();
        // At a setpoint of zero `tLS` takes the voltage from a motor whose run command stays in force.
        let sleeps = at_once.setpoint == 0 && self.story.iter().any(|told| told.contains("tLS"));
        if !at_once.running && at_once.trip.is_none() && !sleeps {
            return Err(format!("a start confirmed without output: {at_once:?}"));
        }
        self.live(Duration::from_secs(3)).await?;
        self.steers_for(direction)
    }

    /// Statement 1: the drive steers for what was confirmed.
    fn steers_for(&self, direction: Direction) -> Judged {
        let Some(given) = self.given else { return Ok(()) };
        let target = if direction == Direction::Forward { given } else { -given };
        let seen = self.scene.seen();
        if seen.trip.is_none() && (!seen.running || (seen.setpoint - target).abs() > TOLERANCE) {
            return Err(format!("confirmed for {target}: {seen:?}"));
        }
        Ok(())
    }

    async fn setpoint(&mut self) -> Judged {
        let hertz = self.rng.u16(10..45);
        let before = self.scene.seen();
        let given = self.scene.drive.set_setpoint(Frequency::from_hertz(hertz).into()).await;
        self.tell(&format!("setpoint {hertz} Hz"), &given);
        self.given = given.is_ok().then_some(i32::from(hertz) * 100);
        if given.is_ok() && before.running && self.started && before.output_frequency.abs() > TOLERANCE {
            self.live(Duration::from_secs(2)).await?;
            let seen = self.scene.seen();
            let size = (seen.setpoint.abs() - i32::from(hertz) * 100).abs();
            if seen.running && seen.trip.is_none() && size > TOLERANCE {
                return Err(format!("a setpoint confirmed on the run: {seen:?}"));
            }
        }
        Ok(())
    }

    /// Statement 2.
    async fn stop(&mut self) -> Judged {
        let mode = StopMode::ALL[self.rng.usize(..StopMode::ALL.len())];
        let writes = self.scene.writes();
        let stopped = self.scene.drive.stop(mode).await;
        self.tell(&format!("stop by {mode}"), &stopped);
        if self.powered && self.scene.writes() == writes && !self.is_deaf(&stopped) {
            return Err("a stop that wrote nothing".to_owned());
        }
        match stopped {
            Ok(stopped) => {
                if stopped.status.motion == Motion::Driven {
                    // Whoever hears that takes the stop for one that was not taken.
                    return Err(format!("a stop confirmed of a motor that is told to be driven: {stopped}"));
                }
                self.live(SETTLED).await?;
                let seen = self.scene.seen();
                if seen.output_frequency.abs() > TOLERANCE {
                    return Err(format!("a stop by {} confirmed: {seen:?}", stopped.mode));
                }
                if stopped.mode == StopMode::DcInjection {
                    let _ = self.scene.drive.stop(StopMode::Ramp).await;
                }
                (self.started, self.given) = (false, None);
            }
            Err(error) if matches!(error.kind(), ErrorKind::Refused | ErrorKind::Unsupported) => {
                return Err(format!("a stop was refused: {error}"));
            }
            Err(_) => {}
        }
        Ok(())
    }

    /// Whether the drive heard nothing, as while it starts up after a reset.
    fn is_deaf<T>(&self, outcome: &Result<T>) -> bool {
        matches!(outcome, Err(error) if matches!(error.kind(), ErrorKind::OutcomeUnknown | ErrorKind::NoAnswer | ErrorKind::NotSent))
    }

    async fn reset(&mut self) {
        let reset = self.scene.drive.reset_faults().await;
        self.tell("reset", &reset);
        // Behind a reset of ours nothing runs by the start of before; behind that of others it may.
        self.started &= !self.tripped;
        if self.scene.seen().trip.is_none() {
            self.scene.twin_is_reset();
        }
        self.given = None;
    }

    async fn release_or_withdraw(&mut self) {
        if self.rng.bool() {
            let released = self.scene.drive.release().await;
            self.tell("release", &released);
            // Who gets it is to find it as if it had never been ours.
            let _ = self.scene.release_twin().await;
            self.given = None;
        } else {
            let withdrawn = self.scene.drive.withdraw().await;
            self.tell("withdraw", &withdrawn);
            // A panel that has taken a running motor may have it run on.
            self.started &= withdrawn.is_err() || self.scene.seen().local;
        }
    }

    /// Statement 3.
    fn only_a_start_moves(&self) -> Judged {
        let (seen, twin) = (self.scene.seen(), self.scene.twin());
        let moves = seen.output_frequency.abs() > TOLERANCE;
        // Whoever runs the twin has started this one too, and the setpoint may be ours.
        if moves && !twin.running && !self.started {
            return Err(format!("it moves: {seen:?}, the twin {twin:?}"));
        }
        Ok(())
    }

    fn tell<T>(&mut self, what: &str, outcome: &Result<T>) {
        let told = outcome.as_ref().map_or_else(ToString::to_string, |_| "confirmed".to_owned());
        self.story.push(format!("{what}: {told}"));
    }
}

/// A setting at random: a value of its list, or of its range.
fn a_setting(rng: &mut Rng, contract: &Contract, family: &dyn Surrounded) -> Option<(&'static Row, u16)> {
    let rows = contract.capabilities.rows;
    let row = rows.get(rng.usize(..rows.len().max(1)))?;
    if !row.access.is_writable() || row.storage == Storage::Volatile {
        return None;
    }
    match family.values_of(row)? {
        Values::Listed(words) => Some((row, *rng.choice(&words)?)),
        Values::Between(low, high) => {
            let value = rng.i32(low..=high);
            Some((row, u16::try_from(value).unwrap_or(value as i16 as u16)))
        }
    }
}
