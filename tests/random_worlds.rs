//! Random drives in random worlds under random commands: what is confirmed is in force, a stop is written and stops, and
//! nothing but a start moves a motor. A run that contradicts prints its seed, and `DRIVED_SEED=… ` plays it again.

use std::time::Duration;

use drive_core::{
    Direction, ErrorKind, Frequency, Result, StopMode,
    registers::{Range, Row, Storage},
};
use drive_families::Family;
use drive_sim::Observation;
use fastrand::Rng;
use support::{
    configurations::{World, configurations, worlds},
    drives,
    scene::Scene,
};

/// Long enough for every ramp of these drives from 50 Hz to rest; their ramps are left as they are.
const SETTLED: Duration = Duration::from_secs(14);
const TOLERANCE: i32 = 20;

/// What is not changed: how the drive is reached and how fast its ramps are, by the manuals' mnemonics. A drive that
/// cannot be reached says nothing, and one with a ramp of an hour is still coming down when it is judged.
const LEFT_ALONE: [&str; 36] = [
    "F802", "F800", "F801", "F829", "F803", "F603", "ACC", "DEC", "F500", "F501", "AU1", "F856", "F870",
    "F871", "ACC", "dEC", "AC2", "dE2", "Inr", "Add", "tbr", "tFO", "ttO", "SLL", "FCS", "SCS", "CMI", "dCF",
    "tUn", "nCr", "n63", "n64", "n65", "n66", "n67", "n40",
];

/// A drive with the settings and the world that a seed gives, and what was told to it so far.
struct Run {
    rng: Rng,
    scene: Scene,
    worlds: Vec<World>,
    /// What has happened around the drive and can be taken back.
    present: Option<World>,
    /// The setpoint that was confirmed last, in hundredths of a hertz.
    given: Option<i32>,
    /// A start of ours may be in force.
    started: bool,
    powered: bool,
    tripped: bool,
    story: Vec<String>,
}

impl Run {
    async fn new(seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let family = Family::ALL[rng.usize(..Family::ALL.len())];
        let all = configurations(family);
        let configuration = &all[rng.usize(..all.len())];
        let mut scene = Scene::new(family, configuration.model, &configuration.options);
        let mut story =
            vec![format!("{family} [{}] {:?}", configuration.name, configuration.options.authority)];
        for setting in configuration.settings {
            scene.happens(setting);
        }
        for _ in 0..rng.usize(..4) {
            if let Some((row, value)) = a_setting(&mut rng, family)
                && scene.is_set_to(row, value)
            {
                story.push(format!("set {} {value}", row.code));
            }
        }
        let around = scene.machine.surroundings();
        for switch in around.switches {
            let reading = switch.readings[rng.usize(..switch.readings.len())];
            scene.happens(&format!("reading {} {reading}", switch.name));
            story.push(format!("reading {} {reading}", switch.name));
        }
        scene.live(Duration::from_secs(1)).await;
        let worlds = worlds(around);
        Self {
            rng,
            scene,
            worlds,
            present: None,
            given: None,
            started: false,
            powered: true,
            tripped: false,
            story,
        }
    }

    /// A few steps; what contradicts.
    async fn play(&mut self) -> std::result::Result<(), String> {
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
            self.scene.live(SETTLED).await;
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
            Some(world) if self.rng.bool() => World { comes: world.goes, goes: Vec::new() },
            before => {
                let next = self.worlds[self.rng.usize(..self.worlds.len())].clone();
                // A supply that was taken away comes back first.
                let back = before.into_iter().flat_map(|before| before.goes);
                World { comes: back.chain(next.comes).collect(), goes: next.goes }
            }
        };
        for deed in &world.comes {
            self.scene.happens(deed);
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
        let deed = format!("trip {}", drives::a_trip_name(self.scene.family()));
        self.scene.happens(&deed);
        self.story.push(deed);
    }

    async fn start(&mut self) -> std::result::Result<(), String> {
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
        self.scene.live(Duration::from_secs(3)).await;
        self.steers_for(direction)
    }

    /// Statement 1: the drive steers for what was confirmed.
    fn steers_for(&self, direction: Direction) -> std::result::Result<(), String> {
        let Some(given) = self.given else { return Ok(()) };
        let target = if direction == Direction::Forward { given } else { -given };
        let seen = self.scene.seen();
        if seen.trip.is_none() && (!seen.running || (seen.setpoint - target).abs() > TOLERANCE) {
            return Err(format!("confirmed for {target}: {seen:?}"));
        }
        Ok(())
    }

    async fn setpoint(&mut self) -> std::result::Result<(), String> {
        let hertz = self.rng.u16(10..45);
        let before = self.scene.seen();
        let given = self.scene.drive.set_setpoint(Frequency::from_hertz(hertz).into()).await;
        self.tell(&format!("setpoint {hertz} Hz"), &given);
        self.given = given.is_ok().then_some(i32::from(hertz) * 100);
        if given.is_ok() && before.running && self.started && before.output_frequency.abs() > TOLERANCE {
            self.scene.live(Duration::from_secs(2)).await;
            let seen = self.scene.seen();
            let size = (seen.setpoint.abs() - i32::from(hertz) * 100).abs();
            if seen.running && seen.trip.is_none() && size > TOLERANCE {
                return Err(format!("a setpoint confirmed on the run: {seen:?}"));
            }
        }
        Ok(())
    }

    /// Statement 2.
    async fn stop(&mut self) -> std::result::Result<(), String> {
        let mode = StopMode::ALL[self.rng.usize(..StopMode::ALL.len())];
        let writes = self.scene.writes();
        let stopped = self.scene.drive.stop(mode).await;
        self.tell(&format!("stop by {mode}"), &stopped);
        if self.powered && self.scene.writes() == writes && !self.is_deaf(&stopped) {
            return Err("a stop that wrote nothing".to_owned());
        }
        match stopped {
            Ok(stopped) => {
                self.scene.live(SETTLED).await;
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
    fn only_a_start_moves(&self) -> std::result::Result<(), String> {
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
fn a_setting(rng: &mut Rng, family: Family) -> Option<(&'static Row, u16)> {
    let rows = family.capabilities().rows;
    let row = &rows[rng.usize(..rows.len())];
    if !row.access.is_writable() || LEFT_ALONE.contains(&row.code) || row.storage == Storage::Volatile {
        return None;
    }
    let choices = row.range.choices();
    if !choices.is_empty() {
        return Some((row, choices[rng.usize(..choices.len())].value));
    }
    match row.range {
        Range::Within(low, high) | Range::Described(low, high, _) => {
            let value = rng.i32(low..=high);
            Some((row, u16::try_from(value).unwrap_or(value as i16 as u16)))
        }
        // The functions of the Altivar 21's inputs that its manual names.
        Range::Any if row.code.starts_with("F11") => Some((row, *rng.choice(&[0, 2, 38, 48, 52, 53])?)),
        _ => None,
    }
}

async fn contradicts(seed: u64) -> Option<String> {
    let mut run = Run::new(seed).await;
    let why = run.play().await.err()?;
    Some(format!("DRIVED_SEED={seed}: {}\n  {why}", run.story.join("\n  ")))
}

/// So many runs as `DRIVED_RUNS` says, 1 000 without it; one alone when `DRIVED_SEED` names it.
#[tokio::test(start_paused = true)]
async fn nothing_is_confirmed_that_is_not_in_force_and_nothing_moves_that_was_not_started() {
    if let Ok(seed) = std::env::var("DRIVED_SEED") {
        let seed = seed.parse().expect("DRIVED_SEED is a number");
        assert_eq!(contradicts(seed).await, None);
        return;
    }
    let runs = std::env::var("DRIVED_RUNS").map_or(Ok(1_000), |runs| runs.parse());
    let runs: u64 = runs.expect("DRIVED_RUNS is a number");
    let mut wrong = Vec::new();
    for seed in 0..runs {
        wrong.extend(contradicts(seed).await);
        if wrong.len() >= 20 {
            break;
        }
    }
    assert!(wrong.is_empty(), "{} of {runs} runs:\n{}", wrong.len(), wrong.join("\n\n"));
}
