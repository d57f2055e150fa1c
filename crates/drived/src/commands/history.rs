//! `drived history`: what a drive did between two moments, read from the black box, beside a running daemon or without one.

mod frames;
mod place;
mod times;

use std::path::PathBuf;

use chrono::Local;
use drived_history::{
    column::Point,
    curve::Piece,
    quantity::{Quantity, TABLE},
    read::{self, Filter, Found, History, Reading},
    store::StoreError,
    story::{self, Line},
};
use drived_plant::plant::past::{AT_ONCE, RecordView, StepView as Told};
use drived_words::{
    duration::Time,
    failure::Failure,
    output::{self, JsonArgs, Table},
};
use serde_json::json;

use self::times::{offsets, whole};
pub(crate) use self::{
    place::{HistoryArgs, failed},
    times::{moment_of, offset, said},
};
use super::plot;

/// Show what a drive did, and what happened to it, between two moments
///
/// It is read from the history that the daemon keeps, whether that runs or not. A value is told from when it was read to when it was read
/// again or was too old; where nothing was known there is nothing. Times are those of this machine's zone; where the clock goes back in
/// autumn the first of the two hours is meant, unless the time has its offset: 2026-10-25T02:30:00+01:00.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The drive
    #[arg(value_name = "NAME")]
    name: String,
    /// From when: 03:12, "yesterday 03:12", "2026-11-21 03:12"; half an hour ago unless it is said
    #[arg(long, value_name = "TIME")]
    from: Option<String>,
    /// Until when; now unless it is said
    #[arg(long, value_name = "TIME", conflicts_with = "lasts")]
    to: Option<String>,
    /// For how long, from then on; without --from the last of it: 30min, 2h, 90d
    #[arg(long = "for", value_name = "TIME")]
    lasts: Option<Time>,
    /// Which value, again for each: output_frequency_hz, current_a, state, and so on
    #[arg(long = "value", value_name = "NAME")]
    values: Vec<String>,
    /// In steps of this length, each with its least, mean and greatest
    #[arg(long, value_name = "TIME")]
    every: Option<Time>,
    /// Print comma-separated values, one value or step a line, and nothing of what happened
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Draw the values as curves, a gap where nothing is known
    #[arg(long, conflicts_with_all = ["csv", "json"])]
    plot: bool,
    /// Write what a capture has heard of its line around the one trip of that time to this file, for Wireshark and `drived explain`
    #[arg(long, value_name = "FILE", conflicts_with_all = ["csv", "json", "plot", "values", "every"])]
    frames_to: Option<PathBuf>,
    #[command(flatten)]
    place: HistoryArgs,
    #[command(flatten)]
    json: JsonArgs,
}

/// Why points are read no further.
enum Stopped {
    By(Failure),
    Unreadable(StoreError),
}

impl From<StoreError> for Stopped {
    fn from(error: StoreError) -> Self {
        Self::Unreadable(error)
    }
}

/// What is shown to a person who has not said which values.
const SHOWN: [Quantity; 5] =
    [Quantity::STATE, Quantity::OUTPUT_FREQUENCY, Quantity::SETPOINT, Quantity::CURRENT, Quantity::TORQUE];
/// So many rows of values a person is shown at the most, unless the steps are said.
const ROWS: i64 = 40;
/// So far back is told where nothing is said.
const HALF_AN_HOUR_MS: i64 = 1_800_000;
/// What ends no longer ago than this may not be written yet.
const LAST_MS: i64 = 60_000;
/// So many steps at the most, whoever reads them.
const STEPS: i64 = 1_000_000;

pub(crate) async fn run(args: &Args) -> Result<(), Failure> {
    let now = Local::now().timestamp_millis();
    let moment = |text: &Option<String>| text.as_deref().map(moment_of).transpose();
    let lasts = args.lasts.map(|Time(lasts)| i64::try_from(lasts.as_millis()).unwrap_or(i64::MAX));
    let (from, to) = meant(now, moment(&args.from)?, moment(&args.to)?, lasts);
    let quantities = args.values.iter().map(|name| named(name)).collect::<Result<Vec<_>, _>>()?;
    if now.saturating_sub(to) <= LAST_MS {
        args.place.have_written(&args.name, to.min(now)).await?;
    }
    let history = args.place.open(&args.name)?;
    if args.csv {
        csv_head(args.every.is_some())?;
    }
    let readings = readings(&history, from, to)?;
    if let Some(file) = &args.frames_to {
        return frames::write(&history, &args.name, &readings, file);
    }
    for reading in readings {
        let asked =
            Asked { drive: &args.name, from: reading.from_ms, to: reading.to_ms, reading, history: &history };
        match (args.csv, args.json.is_json(), args.plot) {
            (true, ..) => asked.csv(&quantities, args.every)?,
            (_, true, _) => asked.json(&quantities, args.every)?,
            (_, _, true) => asked.plot(&quantities, args.every)?,
            _ => asked.show(&quantities, args.every)?,
        }
    }
    Ok(())
}

/// From when to when is meant, by what was said of it.
fn meant(now: i64, from: Option<i64>, to: Option<i64>, lasts: Option<i64>) -> (i64, i64) {
    match (from, to, lasts) {
        (Some(from), None, Some(lasts)) => (from, from.saturating_add(lasts)),
        (None, None, Some(lasts)) => (now.saturating_sub(lasts), now),
        (from, to, _) => (from.unwrap_or(now - HALF_AN_HOUR_MS), to.unwrap_or(now)),
    }
}

/// The parts of a time in which the clock went on: one, unless it was set back in it. That is told apart from what a program reads.
fn readings(history: &History, from: i64, to: i64) -> Result<Vec<Reading>, Failure> {
    let readings = read::readings(&history.0, from, to).map_err(failed)?;
    if readings.is_empty() {
        return Err(Failure::Input(format!(
            "{} is before {}, and the clock was not set back between them: expected a time that ends after it begins",
            said(to),
            said(from)
        )));
    }
    for (before, after) in readings.iter().rev().skip(1).rev().filter_map(|reading| reading.set_behind) {
        output::complain(format_args!(
            "the clock was set back within that time, from {} to {}: what was before that is told first",
            said(before),
            said(after)
        ));
    }
    Ok(readings)
}

fn named(name: &str) -> Result<Quantity, Failure> {
    Quantity::named(name).ok_or_else(|| {
        let names: Vec<&str> = TABLE.iter().map(|row| row.name).collect();
        Failure::Input(format!("{name:?} is no value: expected one of {}, or word_ADDRESS", names.join(", ")))
    })
}

struct Asked<'a> {
    drive: &'a str,
    from: i64,
    to: i64,
    /// Of which reading of the clock they are.
    reading: Reading,
    history: &'a History,
}

impl Asked<'_> {
    fn each_point(
        &self,
        quantity: Quantity,
        mut each: impl FnMut(Point) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if !self.reading.is_the_only_one() {
            let pieces = self.reading.pieces(&self.history.0, self.drive, quantity).map_err(failed)?;
            return pieces.into_iter().flat_map(Piece::closed).try_for_each(each);
        }
        let each = |point| each(point).map(|()| true).map_err(Stopped::By);
        let read = read::points(&self.history.0, self.drive, quantity, self.from, self.to, each);
        read.map_err(|stopped| match stopped {
            Stopped::By(failure) => failure,
            Stopped::Unreadable(error) => failed(error),
        })
    }

    fn steps(&self, quantity: Quantity, length_ms: i64) -> Result<Vec<Told>, Failure> {
        if (self.to - self.from) / length_ms > STEPS {
            return Err(Failure::Input(format!(
                "expected longer steps than {length_ms} ms: {STEPS} are told at the most"
            )));
        }
        if !self.reading.is_the_only_one() {
            let steps =
                self.reading.steps(&self.history.0, self.drive, quantity, length_ms).map_err(failed)?;
            if let Some(steps) = steps {
                return Ok(steps);
            }
        }
        read::steps(&self.history.0, self.drive, quantity, self.from, self.to, length_ms, &|| true)
            .map_err(failed)
    }

    fn say_head(&self) -> Result<(), Failure> {
        let Self { drive, from, to, reading, .. } = *self;
        let before =
            reading.set_behind.map(|(_, to)| format!(", before the clock was set back to {}", said(to)));
        let after =
            reading.set_before.map(|(from, _)| format!(", after the clock was set back from {}", said(from)));
        let (after, before) = (after.unwrap_or_default(), before.unwrap_or_default());
        let offsets = offsets(from, to);
        output::say(format_args!("{drive}, {} to {} ({offsets}){after}{before}", said(from), said(to)))
    }

    /// Those that are meant, or all of which there is something.
    fn meant(&self, quantities: &[Quantity]) -> Result<Vec<Quantity>, Failure> {
        match quantities.is_empty() {
            true => read::all_quantities(&self.history.0, self.drive).map_err(failed),
            false => Ok(quantities.to_vec()),
        }
    }

    /// All that happened, some at a time.
    fn each_records(
        &self,
        mut each: impl FnMut(&[RecordView]) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut after = 0;
        loop {
            let filter = Filter {
                from_ms: self.from,
                to_ms: self.to,
                drive: Some(self.drive),
                limit: AT_ONCE,
                after,
                ..Filter::default()
            };
            let Found { mut records, is_cut } = read::records(&self.history.0, &filter).map_err(failed)?;
            let last = records.last().map(|last| last.number);
            records.retain(|found| self.reading.has(found.run, found.steady_ms));
            each(&records)?;
            match last {
                Some(last) if is_cut => after = last,
                _ => return Ok(()),
            }
        }
    }

    fn frames(&self) -> Result<Vec<read::Frame>, Failure> {
        frames::of(self.history, self.drive, &self.reading)
    }

    fn csv(&self, quantities: &[Quantity], every: Option<Time>) -> Result<(), Failure> {
        for quantity in self.meant(quantities)? {
            match every {
                None => self.each_point(quantity, |point| {
                    let is = point.count.map(|count| quantity.text(count)).unwrap_or_default();
                    output::say_as_it_is(format_args!("{},{},{quantity},{is}", whole(point.at), point.at))
                })?,
                Some(every) => {
                    for step in self.steps(quantity, length(every))? {
                        let Told { start_unix_ms, least, mean, greatest, known, .. } = step;
                        let mean = mean.map(|mean| format!("{mean:.3}")).unwrap_or_default();
                        output::say_as_it_is(format_args!(
                            "{},{start_unix_ms},{quantity},{least},{mean},{greatest},{known:.4}",
                            whole(start_unix_ms)
                        ))?;
                    }
                }
            }
        }
        Ok(())
    }

    fn json(&self, quantities: &[Quantity], every: Option<Time>) -> Result<(), Failure> {
        for quantity in self.meant(quantities)? {
            let name = quantity.to_string();
            match every {
                None => self.each_point(quantity, |point| {
                    let point = quantity.point(point);
                    output::say_as_it_is(json!({ "value": name, "point": point }))
                })?,
                Some(every) => {
                    for step in self.steps(quantity, length(every))? {
                        output::say_as_it_is(json!({ "value": name, "step": step }))?;
                    }
                }
            }
        }
        self.each_records(|all| all.iter().try_for_each(|found| output::say_as_it_is(json!(found))))?;
        self.frames()?.iter().try_for_each(|frame| output::say_as_it_is(frames::as_json(frame)))
    }

    fn plot(&self, quantities: &[Quantity], every: Option<Time>) -> Result<(), Failure> {
        let (from, to) = (self.from, self.to);
        self.say_head()?;
        if let Some(word) = quantities.iter().find(|quantity| !quantity.is_number()) {
            let text = format!("{word} is no number: without --plot it is told as it changes");
            return Err(Failure::Input(text));
        }
        let shown = SHOWN.into_iter().filter(|quantity| quantity.is_number()).collect();
        let asked = if quantities.is_empty() { shown } else { quantities.to_vec() };
        let fitting = (to - from).div_euclid(i64::from(plot::STEPS)).max(1_000);
        let length = every.map_or(fitting - fitting % 1_000, length);
        for quantity in asked {
            let steps: Vec<plot::Step> = self
                .steps(quantity, length)?
                .into_iter()
                .filter_map(|told| {
                    let Told { start_unix_ms, least, mean, greatest, .. } = told;
                    Some(plot::Step { place: (start_unix_ms - from) as f64, least, mean: mean?, greatest })
                })
                .collect();
            if steps.is_empty() {
                // Of those that nobody has named only what there is.
                if !quantities.is_empty() {
                    output::say(format_args!("{quantity}: nothing is known of that time"))?;
                }
                continue;
            }
            output::say(format_args!("\n{quantity}"))?;
            let ends = [said(from), said(to)];
            for line in plot::drawn(&steps, [0.0, (to - from).max(1) as f64], length as f64, ends) {
                output::say_as_it_is(line)?;
            }
        }
        Ok(())
    }

    fn show(&self, quantities: &[Quantity], every: Option<Time>) -> Result<(), Failure> {
        let (from, to) = (self.from, self.to);
        self.say_head()?;
        let quantities = if quantities.is_empty() { SHOWN.to_vec() } else { quantities.to_vec() };
        let length = every.map_or_else(|| step(to - from), length);
        let mut rows: std::collections::BTreeMap<i64, Vec<Option<Told>>> = std::collections::BTreeMap::new();
        for (place, quantity) in quantities.iter().enumerate() {
            for told in self.steps(*quantity, length)? {
                let row = rows.entry(told.start_unix_ms).or_insert_with(|| vec![None; quantities.len()]);
                row[place] = Some(told);
            }
        }
        if rows.is_empty() {
            output::say("no values are known of that time")?;
        } else {
            let heads = quantities.iter().map(ToString::to_string).chain(["known".to_owned()]);
            let mut table = Table::headed(["from".to_owned()].into_iter().chain(heads));
            for (start, told) in &rows {
                let known = told.iter().flatten().map(|told| told.known).fold(0.0, f64::max);
                let cells =
                    quantities.iter().zip(told).map(|(quantity, told)| in_words(*quantity, told.as_ref()));
                let first = [said(*start)].into_iter().chain(cells);
                table.cells(first.chain([format!("{:.0} %", known * 100.0)]));
            }
            output::say_table(table)?;
        }
        let (mut table, mut any) = (Table::new(["time", "what", ""]), false);
        self.each_records(|all| {
            for Line { record, text, is_alarm } in story::lines(all) {
                any = true;
                let alarm = if is_alarm { "ALARM" } else { "" };
                let text = format!("{}: {text}", record.kind);
                table.row([said(record.time_unix_ms), text, alarm.to_owned()]);
            }
            Ok(())
        })?;
        if !any {
            return output::say("nothing is recorded of that time");
        }
        output::say_table(table)?;
        self.frames()?.iter().try_for_each(|frame| output::say(frames::in_words(frame)))
    }
}

fn csv_head(is_in_steps: bool) -> Result<(), Failure> {
    match is_in_steps {
        false => output::say_as_it_is("time,time_unix_ms,value,is"),
        true => output::say_as_it_is("time,time_unix_ms,value,least,mean,greatest,known"),
    }
}

fn in_words(quantity: Quantity, told: Option<&Told>) -> String {
    let Some(told) = told else { return "-".to_owned() };
    let text = |value: f64| quantity.text((value * quantity.per() as f64).round() as i64);
    let (least, greatest) = (text(told.least), text(told.greatest));
    match told.mean {
        _ if least == greatest => least,
        Some(mean) => format!("{least} .. {} .. {greatest}", text(mean)),
        None if told.shares.is_empty() => format!("{least}, {greatest}"),
        None => told.shares.iter().map(|share| &*share.is).collect::<Vec<_>>().join(", "),
    }
}

fn length(Time(every): Time) -> i64 {
    i64::try_from(every.as_millis()).unwrap_or(i64::MAX).max(1)
}

/// Steps in which a time has few enough rows.
fn step(lasts: i64) -> i64 {
    const STEPS: [i64; 13] = [1, 2, 5, 10, 30, 60, 300, 600, 1_800, 3_600, 10_800, 86_400, 604_800];
    let fits = STEPS.into_iter().map(|seconds| seconds * 1_000).find(|step| lasts / step <= ROWS);
    fits.unwrap_or(lasts / ROWS)
}

#[cfg(test)]
mod tests {
    use super::meant;

    #[test]
    fn a_length_of_time_alone_is_the_last_of_it() {
        const NOW: i64 = 10_000_000;
        for (from, to, lasts, is) in [
            (None, None, None, (8_200_000, NOW)),
            (None, None, Some(180_000), (9_820_000, NOW)),
            (Some(5_000), None, Some(180_000), (5_000, 185_000)),
            (Some(5_000), None, None, (5_000, NOW)),
            (None, Some(9_000_000), None, (8_200_000, 9_000_000)),
        ] {
            assert_eq!(meant(NOW, from, to, lasts), is, "{from:?} {to:?} {lasts:?}");
        }
    }
}
