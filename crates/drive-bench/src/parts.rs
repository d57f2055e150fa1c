//! Where the time of a slot goes that is neither its exchange nor its silence, exchange by exchange: the master's own times
//! beside those at which the simulator saw the requests, on the clock that all processes share.

use std::time::Duration;

use drive_bus::Line;
use drive_core::serial::SerialSettings;
use tokio::time::Instant;

use crate::{
    Error,
    masters::saturate,
    report::{Report, Unit, micros, quantile},
    rig::{DRIVES, Rig, exchange, runtime},
    simulator::{Logged, Order, TURNAROUND},
    spinning::{Span, spinning},
    usage::monotonic,
};

const SECTION: &str = "parts";

/// As many exchanges as the simulated drives of a line remember.
const KEPT: usize = 31 * 256;

/// One line beside the loop that never sleeps, each with a simulator of its own.
pub(crate) fn measure(report: &mut Report, time: Duration) -> Result<(), Error> {
    let mut rig = Rig::one_line()?;
    let config = rig.config()?;
    let spans = runtime()?.block_on(async {
        let line = Line::open(config).await?;
        line.keep_exchanges(KEPT);
        let run = line.clone();
        tokio::spawn(async move { saturate(&run, DRIVES, time).await }).await??;
        let (now, clock) = (Instant::now(), monotonic());
        let kept = line.exchanges();
        line.close().await;
        let at = |then: Instant| clock.saturating_sub(now.saturating_duration_since(then));
        Ok::<_, Error>(
            kept.iter().map(|kept| (at(kept.began), at(kept.began) + kept.took)).collect::<Vec<_>>(),
        )
    })?;
    describe(report, "this line", &mut rig, &spans)?;
    let mut rig = Rig::one_line()?;
    let port = rig.port()?.clone();
    let spans = spinning(&port, DRIVES, time)?;
    describe(report, "loop that never sleeps", &mut rig, &spans)
}

fn describe(report: &mut Report, name: &str, rig: &mut Rig, spans: &[Span]) -> Result<(), Error> {
    let counted = rig.take()?;
    let logs = rig.order(&Order::Log)?.logs;
    let late = counted.late / u32::try_from(counted.requests)?.max(1);
    let log = logs.first().ok_or("the simulator has no line")?;
    let mut parts = parts(spans, log, late);
    for (part, times) in &mut parts {
        let count = u32::try_from(times.len())?.max(1);
        let mean = times.iter().sum::<Duration>() / count;
        report.note(SECTION, format!("{name}: {part}, mean of {count}"), Unit::Micros, micros(mean));
        for (quantile_name, per_mille) in [("p50", 500), ("p99", 990)] {
            let time = micros(quantile(times, per_mille));
            report.note(SECTION, format!("{name}: {part}, {quantile_name}"), Unit::Micros, time);
        }
    }
    report.note(
        SECTION,
        format!("{name}: the simulator's answer too late, mean"),
        Unit::Micros,
        micros(late),
    );
    Ok(())
}

/// What each slot loses, beside the mean by which the simulator is late with its answers.
fn parts(spans: &[Span], log: &[Logged], late: Duration) -> [(&'static str, Vec<Duration>); 3] {
    let (mut asked, mut heard, mut waited) = (Vec::new(), Vec::new(), Vec::new());
    for pair in spans.windows(2) {
        let [(began, ended), (next, _)] = *pair else { continue };
        let seen = log.partition_point(|request| request.at < began);
        let Some(seen) = log.get(seen).map(|request| request.at).filter(|at| *at < ended) else { continue };
        asked.push(seen - began);
        heard.push(ended.saturating_sub(seen + exchange(TURNAROUND) + late));
        waited.push(next.saturating_sub(ended + SerialSettings::MODBUS_DEFAULT.t3_5()));
    }
    [
        ("from the choice of a request until the simulator has seen it", asked),
        ("from the last byte of an answer until it is taken", heard),
        ("from the end of the silence until the next request", waited),
    ]
}
