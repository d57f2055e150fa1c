//! Utilisation: the shortest time that the exchanges can take, by the time they took; and the silences.

use std::{sync::mpsc, thread, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::serial::SerialSettings;
use drive_sim::SimLine;
use tokio::{io::DuplexStream, sync::oneshot};

use crate::{
    Error,
    awake::Awake,
    masters::{saturate, stock},
    peers::Python,
    report::{Goal, Report, Unit, micros, millis},
    rig::{DRIVES, Rig, runtime},
    simulator::{Counted, populated},
    spinning::spinning,
    usage::{Machine, processor_time},
    virtual_line,
};

const SECTION: &str = "utilisation";

/// What a line of these exchanges should reach.
const GOAL: f64 = 0.995;

/// The masters are measured in turn, for so long each: what disturbs the machine for a while disturbs them all.
const ROUND: Duration = Duration::from_secs(3);

/// A round in which other programs use more of the processors than this is measured once more, and then left out.
const CALM: f64 = 0.1;

/// How often a round is measured at the most.
const TRIES: u32 = 3;

/// What asks, over a pty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Master {
    Ours { stays_awake: bool, processors_kept_awake: bool },
    Spinning,
    Python(Python),
    Stock { silence: bool },
}

const MASTERS: [Master; 8] = [
    Master::Ours { stays_awake: true, processors_kept_awake: false },
    Master::Ours { stays_awake: false, processors_kept_awake: false },
    Master::Ours { stays_awake: true, processors_kept_awake: true },
    Master::Spinning,
    Master::Python(Python("minimalmodbus")),
    Master::Python(Python("pymodbus")),
    Master::Stock { silence: true },
    Master::Stock { silence: false },
];

/// What the rounds of one master have shown.
#[derive(Debug, Default, Clone, Copy)]
struct Shown {
    counted: Counted,
    /// Processor time of this process.
    used: Duration,
    disturbed: u32,
}

pub(crate) fn measure(report: &mut Report, time: Duration, transactions: u64) -> Result<(), Error> {
    let (present, missing): (Vec<_>, Vec<_>) = MASTERS.into_iter().partition(|master| match master {
        Master::Python(script) => script.is_installed(),
        _ => true,
    });
    for master in missing {
        eprintln!("drive-bench: left out, not installed: {}", master.name());
    }
    let mut shown = vec![Shown::default(); present.len()];
    let rounds = (time.as_secs() / ROUND.as_secs()).clamp(1, 60) as u32;
    for _ in 0..rounds {
        for (master, shown) in present.iter().zip(&mut shown) {
            shown.add_round(*master, time / rounds)?;
        }
    }
    for (master, shown) in present.iter().zip(&shown) {
        let first = *master == MASTERS[0];
        let goal = if first { Goal::AtLeast(GOAL) } else { Goal::None };
        let silences = if master.is_ours() { Goal::AtMost(0.0) } else { Goal::None };
        describe(report, master.name(), &shown.counted, goal, silences);
        if master.is_ours() || *master == Master::Spinning {
            let share = shown.used.as_secs_f64() / shown.counted.taken.as_secs_f64();
            report.note(SECTION, format!("{}: of one processor", master.name()), Unit::Share, share);
        }
        let disturbed = f64::from(shown.disturbed);
        report.note(
            SECTION,
            format!("{}: disturbed rounds of {rounds}", master.name()),
            Unit::Count,
            disturbed,
        );
    }
    let lawful = |(master, shown): &(&Master, &Shown)| !master.is_ours() && shown.counted.violations == 0;
    let best = present.iter().zip(&shown).filter(lawful).map(|(_, shown)| shown.counted.utilisation());
    if let Some(best) = best.reduce(f64::max) {
        let ours = shown.first().map_or(0.0, |shown| shown.counted.utilisation());
        let what = "this line by the best of the others that keep the silences";
        report.row(SECTION, what, Unit::Times, ours / best, Goal::AtLeast(1.0));
    }

    let counted = in_memory(time)?;
    describe(report, "this line, in memory", &counted, Goal::AtLeast(GOAL), Goal::AtMost(0.0));
    let counted = virtual_line::saturated(DRIVES, transactions)?;
    describe(report, "its machines alone, virtual time", &counted, Goal::AtLeast(GOAL), Goal::AtMost(0.0));
    Ok(())
}

impl Master {
    const fn is_ours(self) -> bool {
        matches!(self, Self::Ours { .. })
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Ours { stays_awake: true, processors_kept_awake: false } => "this line",
            Self::Ours { stays_awake: false, .. } => "this line, not staying awake",
            Self::Ours { .. } => "this line, processors kept awake",
            Self::Spinning => "loop that never sleeps",
            Self::Python(Python(module)) => module,
            Self::Stock { silence: true } => "stock tokio-modbus with sleep(t3.5)",
            Self::Stock { silence: false } => "stock tokio-modbus",
        }
    }

    /// One round with a simulator of its own: what its line has counted, and the processor time of this process.
    fn round(self, time: Duration) -> Result<(Counted, Duration), Error> {
        let mut rig = Rig::one_line()?;
        let port = rig.port()?.clone();
        let mut before = processor_time();
        match self {
            Self::Ours { stays_awake, processors_kept_awake } => {
                let _awake = processors_kept_awake.then(Awake::begin);
                let config = LineConfig { stay_awake: stays_awake, ..rig.config()? };
                runtime()?.block_on(async {
                    let line = Line::open(config).await?;
                    warm_up_and_saturate(&line, time, || {
                        before = processor_time();
                        rig.take().map(drop)
                    })
                    .await
                })?;
            }
            Self::Spinning => drop(spinning(&port, DRIVES, time)?),
            Self::Python(script) => script.run(&port, DRIVES, time)?,
            Self::Stock { silence } => {
                runtime()?.block_on(async { tokio::spawn(stock(port, DRIVES, time, silence)).await? })?;
            }
        }
        Ok((rig.take()?, processor_time().saturating_sub(before)))
    }
}

impl Shown {
    fn add_round(&mut self, master: Master, time: Duration) -> Result<(), Error> {
        for tries in 1.. {
            let machine = Machine::now()?;
            let (counted, used) = master.round(time)?;
            let disturbed = machine.others_since()? > CALM;
            if disturbed && tries < TRIES {
                // It counts in no average; a silence that it broke counts all the same.
                self.counted.violations += counted.violations;
                continue;
            }
            self.disturbed += u32::from(disturbed);
            self.used += used;
            self.counted.add(&counted);
            break;
        }
        Ok(())
    }
}

/// Saturates a line, after it has opened and learned its timeouts; `begin` is called between.
async fn warm_up_and_saturate(
    line: &Line,
    time: Duration,
    begin: impl FnOnce() -> Result<(), Error>,
) -> Result<(), Error> {
    // As a task: every wake-up of the main future of a runtime costs a system call more.
    let run = |time| {
        let line = line.clone();
        tokio::spawn(async move { saturate(&line, DRIVES, time).await })
    };
    run(Duration::from_secs(1)).await??;
    begin()?;
    run(time).await??;
    line.close().await;
    Ok(())
}

/// The simulator in this process, on a thread of its own, joined by memory: what is missing is not the pty's.
fn in_memory(time: Duration) -> Result<Counted, Error> {
    let (started, when_started) = mpsc::channel::<Result<(SimLine, DuplexStream), Error>>();
    let (stop, stopped) = oneshot::channel::<()>();
    let simulator = thread::spawn(move || {
        let begin = || -> Result<_, Error> {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
            let line = populated(DRIVES, false)?;
            let stream = runtime.block_on(async { line.in_memory_precise() });
            Ok((runtime, line, stream))
        };
        match begin() {
            Ok((runtime, line, stream)) => {
                let _ = started.send(Ok((line, stream)));
                // The end comes when the other side is dropped.
                let _ = runtime.block_on(stopped);
            }
            Err(error) => {
                let _ = started.send(Err(error));
            }
        }
    });
    let (simulated, stream) = when_started.recv()??;
    let config = LineConfig { precise_timer: true, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
    runtime()?.block_on(async {
        let line = Line::over(stream, config);
        warm_up_and_saturate(&line, time, || {
            let _warming_up = simulated.take_stats();
            Ok(())
        })
        .await
    })?;
    drop(stop);
    simulator.join().map_err(|_| "the simulator panicked")?;
    Ok(Counted::of(&simulated.take_stats(), SerialSettings::MODBUS_DEFAULT.t3_5()))
}

/// The utilisation of a line in whole and without the simulator's own lateness (a real drive's is its turnaround), and
/// its silences.
fn describe(report: &mut Report, name: &str, counted: &Counted, goal: Goal, silences: Goal) {
    let slots = u32::try_from(counted.requests).unwrap_or(u32::MAX).max(1);
    let what = format!("{name}: utilisation over {} reads", counted.requests);
    report.row(SECTION, what, Unit::Share, counted.utilisation(), goal);
    let what = format!("{name}: without the simulator's own lateness");
    report.note(SECTION, what, Unit::Share, counted.own_utilisation());
    let own = counted.taken.saturating_sub(counted.late);
    let lost = own.saturating_sub(counted.ideal) / slots;
    report.note(SECTION, format!("{name}: lost in each slot"), Unit::Micros, micros(lost));
    let t3_5 = millis(SerialSettings::MODBUS_DEFAULT.t3_5());
    let shortest = millis(counted.shortest_silence.unwrap_or_default());
    let what = format!("{name}: silences shorter than {t3_5:.3} ms (the shortest {shortest:.3} ms)");
    report.row(SECTION, what, Unit::Count, counted.violations as f64, silences);
}
