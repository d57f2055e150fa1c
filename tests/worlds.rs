//! Worlds of every family, judged by the referee: every control configuration, what changes around the drive before a
//! command, in the middle of it and in the middle of a run, and every operation. In each status words are held against the shaft, and
//! when things have settled the manual is asked whether anything explains the motion, and whether what is said of our run command is so.

use std::time::Duration;

use drive_core::{Direction, Error, Frequency, Row, StopMode};
use drive_families::Family;
use drive_testing::truth::{TOLERANCE, contradiction};
use support::{
    configurations::{Configuration, World, configurations, worlds},
    drives,
    judged::Judge,
    scene::Scene,
};
use tokio::time::{Instant, sleep};

/// Long enough for every ramp of these drives from 50 Hz to rest.
const SETTLED: Duration = Duration::from_secs(14);
const POLL: Duration = Duration::from_millis(400);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Operation {
    Start(Direction),
    Setpoint,
    Stop(StopMode),
    Reset,
    Release,
    Withdraw,
    Save,
    Parameter,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comes {
    /// While the motor stands, before the operation.
    Before,
    /// While the operation is under way.
    Amid,
    /// While the motor runs by our command; the operation comes behind it.
    InRun,
}

const COMES: [Comes; 3] = [Comes::Before, Comes::Amid, Comes::InRun];

fn operations() -> Vec<Operation> {
    let mut all = vec![
        Operation::Start(Direction::Forward),
        Operation::Start(Direction::Reverse),
        Operation::Setpoint,
        Operation::Reset,
        Operation::Release,
        Operation::Withdraw,
        Operation::Save,
        Operation::Parameter,
    ];
    all.extend(StopMode::ALL.map(Operation::Stop));
    all
}

struct Cell {
    scene: Scene,
    judge: Judge,
    /// Another reading of the manual than the usual: the referee, which follows the manual, is silent or of the first.
    doubtful: bool,
    decided: bool,
}

type Judged = Result<(), String>;

impl Cell {
    async fn new(configuration: &Configuration, reading: Option<&str>) -> Self {
        let mut scene = Scene::new(configuration.family, configuration.model, &configuration.options);
        for setting in configuration.settings {
            scene.happens(setting);
        }
        if let Some(reading) = reading {
            scene.happens(reading);
        }
        scene.live(Duration::from_secs(1)).await;
        let judge = Judge::of(configuration.family, scene.machine.clone());
        Self { scene, judge, doubtful: reading.is_some(), decided: false }
    }

    fn happens(&mut self, deeds: &[String]) {
        for deed in deeds {
            self.scene.happens(deed);
            self.judge.happens(deed);
        }
    }

    /// Lets things settle, with each status held against the shaft, and asks the manual then.
    async fn settle(&mut self, when: &str) -> Judged {
        let end = Instant::now() + SETTLED;
        let mut in_force = false;
        while Instant::now() < end {
            if let Ok(status) = self.scene.drive.status().await {
                if let Some(why) = contradiction(&status, &self.scene.seen()) {
                    return Err(format!("{when}: {why}"));
                }
                in_force = status.verdict.is_some_and(|verdict| verdict.is_in_force());
            }
            self.judge.follow();
            sleep(POLL).await;
        }
        let objection = self.judge.objects(self.scene.drive.lease().is_some(), in_force);
        self.decided |= self.judge.decides();
        match objection {
            Some(why) if !self.doubtful => Err(format!("{when}: {why}")),
            _ => Ok(()),
        }
    }

    async fn run(&mut self) -> bool {
        let given = self.scene.drive.set_setpoint(Frequency::from_hertz(20).into()).await.is_ok();
        given && self.scene.drive.start(Direction::Forward).await.is_ok()
    }

    async fn operate(&mut self, operation: Operation) -> Result<(), Error> {
        let drive = &mut self.scene.drive;
        match operation {
            Operation::Start(direction) => drive.start(direction).await.map(drop),
            Operation::Setpoint => drive.set_setpoint(Frequency::from_hertz(25).into()).await,
            Operation::Stop(mode) => drive.stop(mode).await.map(drop),
            Operation::Reset => drive.reset_faults().await.map(drop),
            Operation::Release => drive.release().await.map(drop),
            Operation::Withdraw => drive.withdraw().await.map(drop),
            Operation::Save => {
                drive.assume_changed();
                drive.persist().await.map(drop)
            }
            Operation::Parameter => {
                let rows = drive.capabilities().rows;
                let ramp = Row::find(rows, "ACC").or_else(|| Row::find(rows, "n20"));
                let row = ramp.expect("each has one");
                drive.write_parameter(row, 25).await.map(drop)
            }
        }
    }

    async fn judge(mut self, world: &World, comes: Comes, operation: Operation) -> (bool, Judged) {
        let judged = self.live_through(world, comes, operation).await;
        (self.decided, judged)
    }

    async fn live_through(&mut self, world: &World, comes: Comes, operation: Operation) -> Judged {
        let mut given = false;
        if operation == Operation::Reset {
            let trip = format!("trip {}", drives::a_trip_name(self.scene.family()));
            if comes == Comes::InRun {
                self.run().await;
            }
            self.happens(&[trip]);
        } else if comes == Comes::InRun || matches!(operation, Operation::Stop(_) | Operation::Withdraw) {
            given = self.run().await;
            self.settle("it runs").await?;
        } else {
            given = self.scene.drive.set_setpoint(Frequency::from_hertz(20).into()).await.is_ok();
        }
        let done = if comes == Comes::Amid {
            // Behind the first exchanges of the operation, whatever they are.
            let around = self.scene.around();
            let (done, at) = tokio::join!(self.operate(operation), async {
                sleep(Duration::from_millis(60)).await;
                world.comes.iter().for_each(|deed| around.happens(deed));
                Instant::now()
            });
            world.comes.iter().for_each(|deed| self.judge.happened_at(at, deed));
            done
        } else {
            self.happens(&world.comes);
            self.settle("the world has changed").await?;
            self.operate(operation).await
        };
        let told = done.as_ref().map_or_else(ToString::to_string, |()| "confirmed".to_owned());
        self.settle(&format!("{operation:?} ({told})")).await?;
        let alone =
            given && comes != Comes::Amid && !world.comes.iter().any(|deed| deed.starts_with("master"));
        if let (Operation::Start(direction), Ok(()), true) = (operation, &done, alone) {
            let seen = self.scene.seen();
            let way = if direction == Direction::Forward { 1 } else { -1 };
            if (seen.output_frequency - way * 2_000).abs() > TOLERANCE {
                return Err(format!("a start {direction} at 20 Hz was confirmed: {seen:?}"));
            }
        }
        self.happens(&world.goes);
        self.settle("the world is as before").await?;
        // Direct current is ended, and whatever runs by us as well: nothing of ours turns behind a confirmed stop.
        let stopped = self.scene.drive.stop(StopMode::Ramp).await;
        self.settle("stopped at last").await?;
        match stopped {
            Ok(_) if self.scene.seen().output_frequency.abs() > TOLERANCE => {
                Err(format!("a last stop was confirmed: {:?}", self.scene.seen()))
            }
            _ => Ok(()),
        }
    }
}

/// What another master of the line does: his run command and his stops, a reference of his own, one the other way round, and no
/// way back: he stays.
fn other_masters(family: Family) -> Vec<World> {
    let of = |deeds: &[&str]| {
        let one = |deed: &&str| World { comes: vec![format!("master {deed}")], goes: Vec::new() };
        deeds.iter().map(one).collect()
    };
    match family {
        // Another reference, a preset speed, reverse, a stop, and what gives control back (§8.4, §8.5).
        Family::Atv21 => return of(&["FA01 3000", "FA00 C401h", "FA00 C600h", "FA00 C000h", "FA00 0000h"]),
        // §5.1.
        Family::Omron3g3ev => return of(&["0002h 300", "0001h 3", "0001h 0"]),
        _ => {}
    }
    let reference = if family == Family::Atv58 { "W401" } else { "LFr" };
    let (thirty, negative) = if family == Family::Atv58 { ("300", "FF38h") } else { ("30", "-20") };
    let mut deeds = vec![format!("master {reference} {thirty}"), format!("master {reference} {negative}")];
    deeds.extend(["000Fh", "080Fh", "100Fh", "0002h", "0000h"].map(|word| format!("master CMD {word}")));
    deeds.into_iter().map(|deed| World { comes: vec![deed], goes: Vec::new() }).collect()
}

/// Of so many cells one is lived through: `DRIVED_ONE_IN`, 1 for all of them.
fn one_in(family: Family) -> usize {
    let usual = if matches!(family, Family::Atv312 | Family::Atv21) { 131 } else { 23 };
    std::env::var("DRIVED_ONE_IN").map_or(usual, |one_in| one_in.parse().expect("DRIVED_ONE_IN is a number"))
}

async fn holds(family: Family) {
    let mut wrong = Vec::new();
    let (mut count, mut seen, mut decided) = (0_usize, 0_usize, 0_usize);
    for configuration in configurations(family) {
        let around = Scene::new(family, configuration.model, &configuration.options).machine.surroundings();
        let readings = around.switches.iter().flat_map(|switch| {
            let others = switch.readings.iter().skip(1);
            others.map(|reading| format!("reading {} {reading}", switch.name))
        });
        let readings: Vec<Option<String>> = std::iter::once(None).chain(readings.map(Some)).collect();
        for world in worlds(around).into_iter().chain(other_masters(family)) {
            for (comes, operation) in
                COMES.iter().flat_map(|&comes| operations().into_iter().map(move |it| (comes, it)))
            {
                for reading in &readings {
                    // A doubtful reading a tenth as often.
                    let one_in = one_in(family) * if reading.is_some() { 10 } else { 1 };
                    count += 1;
                    if !count.is_multiple_of(one_in) {
                        continue;
                    }
                    seen += 1;
                    let cell = Cell::new(&configuration, reading.as_deref()).await;
                    let (by_manual, judged) = cell.judge(&world, comes, operation).await;
                    decided += usize::from(by_manual);
                    if let Err(why) = judged {
                        let name = configuration.name;
                        wrong.push(format!(
                            "[{name}] {reading:?} {comes:?} {:?} {operation:?}: {why}",
                            world.comes
                        ));
                    }
                }
            }
        }
    }
    println!(
        "{family}: {seen} of {count} worlds, {decided} decided by the manual, {} contradictions",
        wrong.len()
    );
    assert!(wrong.is_empty(), "{} of {seen} worlds of the {family}:\n{}", wrong.len(), wrong.join("\n"));
}

#[tokio::test(start_paused = true)]
async fn no_world_of_an_altivar_28_contradicts_what_is_said_or_turns_its_motor_without_a_reason() {
    holds(Family::Atv28).await;
}

#[tokio::test(start_paused = true)]
async fn no_world_of_an_altivar_58_contradicts_what_is_said_or_turns_its_motor_without_a_reason() {
    holds(Family::Atv58).await;
}

#[tokio::test(start_paused = true)]
async fn no_world_of_an_altivar_312_contradicts_what_is_said_or_turns_its_motor_without_a_reason() {
    holds(Family::Atv312).await;
}

#[tokio::test(start_paused = true)]
async fn no_world_of_an_altivar_21_contradicts_what_is_said_or_turns_its_motor_without_a_reason() {
    holds(Family::Atv21).await;
}

#[tokio::test(start_paused = true)]
async fn no_world_of_a_3g3ev_contradicts_what_is_said_or_turns_its_motor_without_a_reason() {
    holds(Family::Omron3g3ev).await;
}
