//! Utilisation: the shortest time that the exchanges can take, by the time they took; and the silences.

use std::{sync::mpsc, thread, time::Duration};

use drive_bus::{Line, LineConfig, Stats};
use drive_core::serial::SerialSettings;
use drive_sim::SimLine;
use tokio::{io::DuplexStream, sync::oneshot};

use crate::{
    Error,
    awake::Awake,
    masters::{saturate, stock},
    report::{Goal, Report, Unit, micros, millis},
    rig::{DRIVES, Rig, runtime},
    simulator::{Counted, populated},
    spinning::spinning,
    virtual_line,
};

const SECTION: &str = "utilisation";

/// What a line of these exchanges should reach.
const GOAL: f64 = 0.995;

pub(crate) fn measure(report: &mut Report, time: Duration, transactions: u64) -> Result<(), Error> {
    on_a_pty(report, "this line, pty", time)?;
    if let Some(_awake) = Awake::begin() {
        on_a_pty(report, "this line, pty, processors kept awake", time)?;
    }
    let counted = in_memory(time)?;
    describe(report, "this line, in memory", &counted, Goal::AtLeast(GOAL));
    let counted = virtual_line::saturated(DRIVES, transactions)?;
    describe(report, "its machines alone, virtual time", &counted, Goal::AtLeast(GOAL));

    for (name, silence) in
        [("stock tokio-modbus with sleep(t3.5), pty", true), ("stock tokio-modbus, pty", false)]
    {
        let mut rig = Rig::one_line()?;
        let port = rig.port()?.clone();
        runtime()?.block_on(async { tokio::spawn(stock(port, DRIVES, time / 2, silence)).await? })?;
        describe(report, name, &rig.take()?, Goal::None);
    }
    let mut rig = Rig::one_line()?;
    spinning(rig.port()?, DRIVES, time / 2)?;
    describe(report, "loop that never sleeps, pty", &rig.take()?, Goal::None);
    Ok(())
}

fn on_a_pty(report: &mut Report, name: &str, time: Duration) -> Result<(), Error> {
    let mut rig = Rig::one_line()?;
    let stats = runtime()?.block_on(async {
        let line = Line::open(rig.config()?).await?;
        warm_up_and_saturate(&line, time, || rig.take().map(drop)).await
    })?;
    describe(report, name, &rig.take()?, Goal::AtLeast(GOAL));
    let late = micros(stats.lag.mean());
    report.note(SECTION, format!("{name}: of it by choice, timer and write"), Unit::Micros, late);
    Ok(())
}

/// Saturates a line, after it has opened and learned its timeouts; `begin` is called between.
async fn warm_up_and_saturate(
    line: &Line,
    time: Duration,
    begin: impl FnOnce() -> Result<(), Error>,
) -> Result<Stats, Error> {
    // As a task: every wake-up of the main future of a runtime costs a system call more.
    let run = |time| {
        let line = line.clone();
        tokio::spawn(async move { saturate(&line, DRIVES, time).await })
    };
    run(Duration::from_secs(1)).await??;
    begin()?;
    run(time).await??;
    let stats = line.stats();
    line.close().await;
    Ok(stats)
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
fn describe(report: &mut Report, name: &str, counted: &Counted, goal: Goal) {
    let share = |time: Duration| counted.ideal.as_secs_f64() / time.as_secs_f64();
    let own = counted.taken.saturating_sub(counted.late);
    let slots = u32::try_from(counted.requests).unwrap_or(u32::MAX).max(1);
    let lost = own.saturating_sub(counted.ideal) / slots;
    let whole = share(counted.taken);
    report.row(
        SECTION,
        format!("{name}: utilisation over {} reads", counted.requests),
        Unit::Share,
        whole,
        goal,
    );
    if goal != Goal::None {
        let what = format!("{name}: without the simulator's own lateness");
        report.row(SECTION, what, Unit::Share, share(own), goal);
    }
    report.note(SECTION, format!("{name}: lost in each slot"), Unit::Micros, micros(lost));
    let wanted = if goal == Goal::None { Goal::None } else { Goal::AtMost(0.0) };
    let t3_5 = millis(SerialSettings::MODBUS_DEFAULT.t3_5());
    report.row(
        SECTION,
        format!(
            "{name}: silences shorter than {t3_5:.3} ms (the shortest {:.3} ms)",
            millis(counted.shortest_silence.unwrap_or_default())
        ),
        Unit::Count,
        counted.violations as f64,
        wanted,
    );
}
