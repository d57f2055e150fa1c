//! What is told of each line, from what it counts.

use drive_bus::{Line, stats::SlaveStats};
use drive_core::Class;
use drive_fleet::{DriveHandle, LinePlan};

use super::{samples::Samples, table::Id};
use drived_plant::plant::tally::Counts;

/// A line with its id and its name, and its drives with their ids.
pub(super) fn collect(
    (id, name): (&str, &str),
    line: &Line,
    plan: Option<LinePlan>,
    drives: &[(String, DriveHandle)],
    samples: &mut Samples,
) {
    let (protocol, stats) = (line.config().protocol.to_string(), line.stats());
    samples.add(Id::LineInfo, &[id, name, &protocol], 1.0);
    samples.add(Id::LineUp, &[id], if stats.opened > stats.lost { 1.0 } else { 0.0 });
    samples.add(Id::LineBusy, &[id], stats.busy.as_secs_f64());
    samples.add(Id::LineWorstStop, &[id], line.worst_case_stop().as_secs_f64());
    samples.add_known(Id::LineSweep, &[id], plan.map(|plan| plan.sweep.as_secs_f64()));
    samples.count(Id::LineWaiting, &[id], stats.queued as u64);
    samples.count(Id::LineNoise, &[id], stats.noise_bytes);
    samples.count(Id::LineReopens, &[id], stats.opened.saturating_sub(1));
    for class in Class::ALL {
        let (of, labels) = (stats.class(class), [id, &class.to_string()]);
        samples.count(Id::LineRequests, &labels, of.sent);
        samples.add_histogram(Id::LineQueueWait, &labels, of.waits.up_to(), of.waits.sum().as_secs_f64());
    }
    for (drive_id, drive) in drives {
        // What a slave counts that is no drive of the configuration is in the sums of the line alone.
        if let Some(of) = stats.slaves.get(&drive.slave().number()) {
            tell_exchanges(of, [id, drive_id], samples);
        }
    }
    let sum = |count: fn(&SlaveStats) -> u64| stats.slaves.values().map(count).sum();
    for (reason, count) in [
        ("expired", sum(|slave| slave.outcomes.expired)),
        ("superseded", sum(|slave| slave.outcomes.superseded)),
        ("withdrawn", sum(|slave| slave.outcomes.withdrawn)),
        ("refused", sum(|slave| slave.outcomes.refused)),
    ] {
        samples.count(Id::LineUnsent, &[id, reason], count);
    }
    for (kind, count) in [
        ("late", sum(|slave| slave.late)),
        ("early", sum(|slave| slave.early)),
        ("wrong_function", sum(|slave| slave.wrong_function)),
        ("wrong_count", sum(|slave| slave.wrong_count)),
        ("foreign", stats.foreign),
    ] {
        samples.count(Id::LineFrameErrors, &[id, kind], count);
    }
}

fn tell_exchanges(slave: &SlaveStats, [line, drive]: [&str; 2], samples: &mut Samples) {
    let outcomes = &slave.outcomes;
    for (result, count) in [
        ("answered", outcomes.answered),
        ("exception", outcomes.exceptions),
        ("no_answer", outcomes.timeouts),
        ("damaged", outcomes.damaged),
        ("mismatch", outcomes.mismatches),
        ("busy", outcomes.busy),
    ] {
        samples.count(Id::LineExchanges, &[line, drive, result], count);
    }
    let durations = &slave.exchanges;
    let sum = durations.sum().as_secs_f64();
    samples.add_histogram(Id::LineExchangeDuration, &[line, drive], durations.up_to(), sum);
}

/// The commands to the drives of a line: those to drives that have left are not told any more.
pub(super) fn collect_commands(
    line: &str,
    drives: &[(String, DriveHandle)],
    counts: &Counts,
    samples: &mut Samples,
) {
    for (command, count) in &counts.commands {
        if drives.iter().any(|(id, _)| *id == command.drive) {
            let outcome = command.outcome.to_string();
            let labels = [line, &command.drive, command.action.name(), &outcome, &command.face];
            samples.count(Id::Commands, &labels, *count);
        }
    }
}
