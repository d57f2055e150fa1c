//! What a line costs among so many in one process, from one to a thousand.

use std::{fs, path::Path, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::serial::SerialSettings;
use tokio::{runtime::Runtime, time::sleep};

use crate::{
    Error,
    far_end::{Book, FarEnd},
    masters::{lawful_by_hand, saturate},
    plot::{Curve, plot},
    report::{Goal, Report, Unit, micros, millis},
    rig::DRIVES,
    simulator::Counted,
    usage::{allow_descriptors, memory_kib, processor_time},
};

const SECTION: &str = "growth";

const COUNTS: [u16; 7] = [1, 3, 10, 30, 100, 300, 1_000];

/// From so many lines on loops that are written by hand are measured beside them.
const MANY: u16 = 100;

/// Until the timeouts are learned and every line is in its stride.
const SETTLE: Duration = Duration::from_secs(2);

/// What a line with 31 polls may hold.
const MEMORY: Goal = Goal::AtMost(64.0);

/// What so many lines have shown.
struct Shown {
    lines: u16,
    mean: f64,
    least: f64,
    processors: f64,
    each: Duration,
    memory: f64,
    counted: Counted,
}

/// Measures 1 to `most` lines, and draws what was measured into `picture`.
pub(crate) fn measure(
    report: &mut Report,
    time: Duration,
    most: u16,
    picture: Option<&Path>,
) -> Result<(), Error> {
    allow_descriptors()?;
    let before = memory_kib()?;
    let mut all = Vec::new();
    for lines in COUNTS.into_iter().filter(|lines| *lines < most).chain([most]) {
        let shown = one(lines, time / 3, before)?;
        describe(report, &shown, lines == most);
        if lines >= MANY {
            beside(report, &shown, &by_hand(lines, time / 3)?);
        }
        all.push(shown);
    }
    if let Some(picture) = picture {
        let curve = |name, most, value: fn(&Shown) -> f64| Curve {
            name,
            most,
            points: all.iter().map(|shown| (f64::from(shown.lines), value(shown))).collect(),
        };
        let curves = [
            curve("utilisation, mean (to 1)", 1.0, |shown| shown.mean),
            curve("processors in use (to 2)", 2.0, |shown| shown.processors),
            curve("memory of a line (to 128 KiB)", 128.0, |shown| shown.memory),
        ];
        fs::write(picture, plot("lines in one process", &curves))?;
    }
    Ok(())
}

fn one(lines: u16, time: Duration, before: u64) -> Result<Shown, Error> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let _inside = runtime.enter();
    let config = LineConfig { precise_timer: true, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) };
    let books: Vec<Book> = (0..lines).map(|_| Book::default()).collect();
    let masters: Vec<Line> =
        books.iter().map(|book| Line::over(FarEnd::new(book.clone()), config.clone())).collect();
    let polls: Vec<_> = masters
        .iter()
        .map(|line| {
            let line = line.clone();
            runtime.spawn(async move { saturate(&line, DRIVES, SETTLE + time).await })
        })
        .collect();
    let (used, counted) = settled(&runtime, &books, time);
    let memory = memory_kib()?.saturating_sub(before) as f64 / f64::from(lines);
    runtime.block_on(async {
        for poll in polls {
            poll.await??;
        }
        for line in masters {
            line.close().await;
        }
        Ok::<_, Error>(())
    })?;
    shown(lines, (used, time), memory, &counted)
}

/// What as many loops reach on as many far ends, each a task of its own that does nothing else.
fn by_hand(lines: u16, time: Duration) -> Result<Shown, Error> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let _inside = runtime.enter();
    let books: Vec<Book> = (0..lines).map(|_| Book::default()).collect();
    let spawn = |book: &Book| runtime.spawn(lawful_by_hand(FarEnd::new(book.clone()), DRIVES, SETTLE + time));
    let loops: Vec<_> = books.iter().map(spawn).collect();
    let (used, counted) = settled(&runtime, &books, time);
    runtime.block_on(async {
        for each in loops {
            each.await??;
        }
        Ok::<_, Error>(())
    })?;
    shown(lines, (used, time), 0.0, &counted)
}

/// The processor time of so long, once all are in their stride, and what was counted in it.
fn settled(runtime: &Runtime, books: &[Book], time: Duration) -> (Duration, Vec<Counted>) {
    runtime.block_on(sleep(SETTLE));
    for book in books {
        let _while_settling = book.take();
    }
    let used = processor_time();
    runtime.block_on(sleep(time));
    (processor_time().saturating_sub(used), books.iter().map(Book::take).collect())
}

fn shown(
    lines: u16,
    (used, time): (Duration, Duration),
    memory: f64,
    counted: &[Counted],
) -> Result<Shown, Error> {
    let shares: Vec<f64> = counted.iter().map(Counted::own_utilisation).collect();
    let mut sum = Counted::default();
    counted.iter().for_each(|counted| sum.add(counted));
    Ok(Shown {
        lines,
        mean: shares.iter().sum::<f64>() / f64::from(lines),
        least: shares.iter().copied().fold(f64::INFINITY, f64::min),
        processors: used.as_secs_f64() / time.as_secs_f64(),
        each: used / u32::try_from(sum.requests)?.max(1),
        memory,
        counted: sum,
    })
}

fn beside(report: &mut Report, shown: &Shown, by_hand: &Shown) {
    let name = |what: &str| format!("{} loops by hand: {what}", by_hand.lines);
    report.note(SECTION, name("utilisation, mean"), Unit::Share, by_hand.mean);
    report.note(SECTION, name("utilisation, the least"), Unit::Share, by_hand.least);
    report.note(SECTION, name("processors in use, drives included"), Unit::Times, by_hand.processors);
    report.note(SECTION, name("processor time per transaction"), Unit::Micros, micros(by_hand.each));
    let what = format!("{} lines by as many loops by hand: utilisation, mean", shown.lines);
    report.note(SECTION, what, Unit::Times, shown.mean / by_hand.mean);
    let what = format!("{} lines by as many loops by hand: processor time per transaction", shown.lines);
    report.note(SECTION, what, Unit::Times, shown.each.as_secs_f64() / by_hand.each.as_secs_f64());
}

fn describe(report: &mut Report, shown: &Shown, last: bool) {
    let name = |what: &str| format!("{} lines: {what}", shown.lines);
    report.note(SECTION, name("utilisation, mean"), Unit::Share, shown.mean);
    report.note(SECTION, name("utilisation, the least"), Unit::Share, shown.least);
    report.note(SECTION, name("processors in use, drives included"), Unit::Times, shown.processors);
    report.note(SECTION, name("processor time per transaction"), Unit::Micros, micros(shown.each));
    let goal = if last { MEMORY } else { Goal::None };
    report.row(SECTION, name("memory of a line with 31 polls"), Unit::KiB, shown.memory, goal);
    let shortest = millis(shown.counted.shortest_silence.unwrap_or_default());
    let what =
        format!("silences too short in {} reads (the shortest {shortest:.3} ms)", shown.counted.requests);
    report.row(SECTION, name(&what), Unit::Count, shown.counted.violations as f64, Goal::AtMost(0.0));
}
