//! What happened as a person reads it: one line a fact, where several records tell of one.

use std::collections::BTreeMap;

use drived_plant::plant::past::RecordView;

use super::body::body;

/// What a trip was by is read within this time behind it.
const EXPLAINED_WITHIN_MS: i64 = 30_000;
/// An alarm comes within this time behind the event that it is of.
const ALARM_WITHIN_MS: i64 = 5_000;
/// The program and the history notice within this time of each other that the clock was set.
const STEPPED_WITHIN_MS: i64 = 5_000;
/// So many records of one reading stand between two of them at the most.
const OF_ONE_READING: usize = 8;

/// A fact.
#[derive(Debug, Clone)]
pub struct Line<'a> {
    /// The first that is told of it.
    pub record: &'a RecordView,
    /// It in a sentence, with what the others tell.
    pub text: String,
    /// Whether somebody had to see to it.
    pub is_alarm: bool,
}

/// Whether a drive shows by this that it has tripped: that its state is a fault from now on.
pub(super) fn is_to_fault(found: &RecordView) -> bool {
    found.what == "state_changed" && body(found).to.as_deref() == Some("fault")
}

/// What was told of a trip later, as words of the trip.
pub(super) fn as_trip(explained: &RecordView) -> String {
    explained.text.replacen("trip explained", "tripped", 1)
}

/// A trip with the change of its state that one reading showed.
pub(super) fn with_change(trip: String, change: Option<&RecordView>) -> String {
    match change {
        Some(change) => format!("{trip} ({})", change.text),
        None => trip,
    }
}

/// Records in the daemon's order as facts: a trip with the change of its state, what it was by, and its alarm; likewise any other alarm that
/// tells no more than an event of its drive does.
#[must_use]
pub fn lines(records: &[RecordView]) -> Vec<Line<'_>> {
    let mut lines: Vec<Option<Line<'_>>> = Vec::with_capacity(records.len());
    // The last trip of each drive, and its last event with these words at the head.
    let mut trips: BTreeMap<&str, usize> = BTreeMap::new();
    let mut events: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    for record in records {
        let is_alarm = record.alarm;
        let (drive, place) = (record.drive.as_deref().unwrap_or_default(), lines.len());
        let of_trip = trips.get(drive).filter(|_| record.what == "trip_explained");
        let is_alarm_of_drive =
            record.kind == "alarm" && record.what == "unacknowledged" && record.drive.is_some();
        let of_event = events.get(&(drive, head(&record.text))).filter(|_| is_alarm_of_drive);
        let within = if is_alarm_of_drive { ALARM_WITHIN_MS } else { EXPLAINED_WITHIN_MS };
        let known = of_trip.or(of_event).and_then(|place| lines[*place].as_mut());
        if let Some(known) =
            known.filter(|known| (record.time_unix_ms - known.record.time_unix_ms).abs() <= within)
        {
            let told = if of_trip.is_some() { as_trip(record) } else { record.text.clone() };
            // What is known of a trip grows: what tells more takes the place of what told less.
            if told.len() > known.text.len() {
                known.text = told;
            }
            known.is_alarm |= is_alarm;
            lines.push(None);
            continue;
        }
        if record.kind == "event" {
            if record.what == "tripped" {
                trips.insert(drive, place);
            }
            events.insert((drive, head(&record.text)), place);
        }
        lines.push(Some(Line { record, text: record.text.clone(), is_alarm }));
    }
    fold_changes(&mut lines);
    fold_steps(&mut lines);
    lines.into_iter().flatten().collect()
}

/// The words of a text before what it says of them.
fn head(text: &str) -> &str {
    text.split_once(": ").map_or(text, |(head, _)| head)
}

/// Tells the change of a state with the trip of the same reading.
fn fold_changes(lines: &mut [Option<Line<'_>>]) {
    for place in 0..lines.len() {
        let Some(change) = lines[place].as_ref().map(|line| line.record).filter(|found| is_to_fault(found))
        else {
            continue;
        };
        let near = place.saturating_sub(OF_ONE_READING)..(place + OF_ONE_READING).min(lines.len());
        let trip = lines[near].iter_mut().flatten().find(|line| is_of_one_reading(line.record, change));
        if let Some(trip) = trip {
            trip.text = with_change(std::mem::take(&mut trip.text), Some(change));
            lines[place] = None;
        }
    }
}

/// Tells once that the clock was set: as the history tells it, which knows from where to where.
fn fold_steps(lines: &mut [Option<Line<'_>>]) {
    let steps: Vec<&RecordView> =
        lines.iter().flatten().map(|line| line.record).filter(|found| is_step(found, "history")).collect();
    for line in lines {
        line.take_if(|line| steps.iter().any(|step| is_told_by(line.record, step)));
    }
}

fn is_step(found: &RecordView, kind: &str) -> bool {
    found.kind == kind && found.what == "clock_stepped"
}

/// Whether the program's own notice that the clock was set is of this step, which the history tells.
pub(super) fn is_told_by(notice: &RecordView, step: &RecordView) -> bool {
    is_step(notice, "notice")
        && is_step(step, "history")
        && notice.run == step.run
        && (notice.steady_ms - step.steady_ms).abs() <= STEPPED_WITHIN_MS
}

/// Whether a trip was read with the change of a state.
pub(super) fn is_of_one_reading(trip: &RecordView, change: &RecordView) -> bool {
    trip.what == "tripped" && trip.drive == change.drive && trip.time_unix_ms == change.time_unix_ms
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(number: i64, at: i64, kind: &str, what: &str, text: &str) -> RecordView {
        let body = serde_json::value::to_raw_value(&serde_json::json!({ "to": "fault" })).ok();
        RecordView {
            number,
            run: 1,
            time_unix_ms: at,
            steady_ms: at,
            kind: kind.to_owned(),
            what: what.to_owned(),
            drive: Some("pump".to_owned()),
            line: None,
            alarm: what == "tripped" || kind == "alarm" && what == "unacknowledged",
            text: text.to_owned(),
            body: body.filter(|_| what == "state_changed"),
        }
    }

    fn texts(records: &[RecordView]) -> Vec<(i64, String, bool)> {
        let told = lines(records).into_iter();
        told.map(|line| (line.record.time_unix_ms, line.text, line.is_alarm)).collect()
    }

    #[test]
    fn a_trip_is_one_line_with_its_state_its_alarm_and_what_it_was_by() {
        let mut all = vec![
            record(1, 1_000, "event", "state_changed", "state changed: running to fault"),
            record(2, 1_000, "event", "tripped", "tripped"),
            record(3, 1_060, "alarm", "unacknowledged", "tripped"),
            record(
                4,
                1_100,
                "event",
                "command",
                "command: withdrawal of the run command by tripped: confirmed",
            ),
            record(5, 1_160, "alarm", "unacknowledged", "tripped: fault 9"),
            record(6, 1_220, "event", "trip_explained", "trip explained: 9 OCF: overcurrent"),
            record(7, 1_260, "alarm", "unacknowledged", "tripped: 9 OCF: overcurrent"),
        ];
        let trip = "tripped: 9 OCF: overcurrent (state changed: running to fault)".to_owned();
        let own = (1_100, all[3].text.clone(), false);
        assert_eq!(texts(&all), [(1_000, trip, true), own.clone()]);
        // Where what it was by was never read, the alarm tells what is known.
        all.drain(5..);
        let trip = "tripped: fault 9 (state changed: running to fault)".to_owned();
        assert_eq!(texts(&all), [(1_000, trip, true), own]);
    }

    #[test]
    fn a_clock_that_was_set_is_told_once_and_as_the_history_tells_it() {
        let at = |number, kind, at| RecordView {
            drive: None,
            alarm: false,
            ..record(number, at, kind, "clock_stepped", &format!("the clock was set: {kind}"))
        };
        let all = [at(1, "notice", 1_000), at(2, "history", 1_400), at(3, "notice", 9_000)];
        let told = ["the clock was set: history", "the clock was set: notice"];
        assert_eq!(texts(&all).into_iter().map(|(_, text, _)| text).collect::<Vec<_>>(), told);
    }

    #[test]
    fn what_is_another_fact_stays_a_line_of_its_own() {
        let all = vec![
            record(1, 1_000, "event", "tripped", "tripped"),
            record(2, 2_000, "alarm", "acknowledged", "acknowledged: tripped"),
            record(3, 3_000, "event", "state_changed", "state changed: ready to fault"),
            record(4, 40_000, "event", "trip_explained", "trip explained: 9 OCF: overcurrent"),
            record(5, 50_000, "alarm", "unacknowledged", "tripped"),
            record(6, 51_000, "alarm", "unacknowledged", "lost while it was running"),
        ];
        assert_eq!(lines(&all).len(), all.len());
    }
}
