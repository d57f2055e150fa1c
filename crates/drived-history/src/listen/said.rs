//! What a frame of the event stream says, as a record.

use std::collections::{BTreeMap, BTreeSet};

use drived_plant::plant::views::CommandView;
use serde::Deserialize;

use crate::record::{Kind, Moment, Record};

/// What is longer is kept without what the API told: a command for a thousand drives.
const LONGEST_BODY: usize = 256 << 10;

/// By so many words an alarm is kept at the most until its state or its count is another.
const WORDS: usize = 16;

/// An event as the stream tells it, as far as it is looked at here.
#[derive(Deserialize)]
struct Told {
    time_unix_ms: i64,
    event: String,
    #[serde(default)]
    drive: Option<String>,
    alarm: bool,
    text: String,
}

/// An alarm likewise.
#[derive(Deserialize)]
struct ToldAlarm {
    id: u64,
    count: u32,
    state: String,
    #[serde(default)]
    drive: Option<String>,
    #[serde(default)]
    line: Option<String>,
    text: String,
}

/// The alarms as they were kept, by their numbers: state, count, and the words by which they were told since. One that stands for others is
/// told anew with each of them, and a loss by turns with what came of each question.
#[derive(Debug, Default)]
pub(super) struct Alarms(BTreeMap<u64, (String, u32, BTreeSet<String>)>);

impl Alarms {
    /// Whether it is another than it was.
    fn is_new(&mut self, ToldAlarm { id, count, state, text, .. }: &ToldAlarm) -> bool {
        if state == "over" {
            return self.0.remove(id).is_some();
        }
        let (known, times, words) = self.0.entry(*id).or_default();
        if (&*known, *times) != (state, *count) {
            (*known, *times) = (state.clone(), *count);
            words.clear();
        }
        words.len() < WORDS && words.insert(text.clone())
    }
}

/// Whether a frame of the event stream tells of an alarm.
pub(super) fn is_of_an_alarm(frame: &[u8]) -> bool {
    frame.split(|byte| *byte == b'\n').nth(1) == Some(b"event: alarm")
}

/// What a frame of the event stream says, as a record; `None`: it is of a drive's or a line's values.
pub(super) fn said(frame: &str, now: Moment, alarms: &mut Alarms) -> Option<Record> {
    let (head, data) = frame.split_once("\ndata: ")?;
    let (_, name) = head.split_once("\nevent: ")?;
    let data = data.trim_end();
    let body = (data.len() <= LONGEST_BODY).then(|| data.to_owned());
    let record = Record { body, ..Record::of_history(now, "", "") };
    match name {
        "event" => {
            let told: Told = serde_json::from_str(data).ok()?;
            let told = Told { text: lasting(told.text), ..told };
            let at = Moment { wall_ms: told.time_unix_ms, ..now };
            let kind = if told.drive.is_some() { Kind::Event } else { Kind::Notice };
            let Told { event, drive, alarm, text, .. } = told;
            Some(Record { at, kind, what: event, drive, is_alarm: alarm, text, ..record })
        }
        "alarm" => {
            let told: ToldAlarm = serde_json::from_str(data).ok()?;
            if !alarms.is_new(&told) {
                return None;
            }
            let ToldAlarm { state, drive, line, text, .. } = told;
            let is_alarm = state == "unacknowledged";
            // An alarm keeps its words: its end is not told as if it came.
            let text = if is_alarm { text } else { format!("{state}: {text}") };
            Some(Record { kind: Kind::Alarm, what: state, drive, line, is_alarm, text, ..record })
        }
        "command" => {
            let told: CommandView = serde_json::from_str(data).ok()?;
            let at = Moment { wall_ms: i64::try_from(told.time_unix_ms).unwrap_or(i64::MAX), ..now };
            Some(Record {
                at,
                kind: Kind::Command,
                what: told.action.name().to_owned(),
                drive: told.drive.clone(),
                text: in_words(&told),
                act: Some(format!("{}:{}", told.time_unix_ms, told.id)),
                ..record
            })
        }
        _ => None,
    }
}

/// What is worth keeping of a text: not when a line asks a silent drive next, which is another time in each.
fn lasting(mut text: String) -> String {
    if let Some(head) = text.strip_suffix(", it is probed as soon as the line is free") {
        text.truncate(head.len());
    }
    if let Some(at) = text.rfind(", next probe in ").filter(|at| !text[at + 1..].contains([',', ':'])) {
        text.truncate(at);
    }
    text
}

/// A command in a sentence: what, by whom, from where, and what became of it.
fn in_words(command: &CommandView) -> String {
    let CommandView { caller, origin, outcome, .. } = command;
    let several =
        command.several.as_ref().map(|_| format!(" ({})", command.several_in_words())).unwrap_or_default();
    // A command for one drive names it beside.
    let of = match (&command.group, &command.several) {
        (Some(group), _) => format!(" of group {group}"),
        (None, Some(several)) if !command.selected.is_empty() => {
            format!(" of {} drives that were selected", several.count())
        }
        (None, Some(several)) => format!(" of all {} drives", several.count()),
        (None, None) => String::new(),
    };
    let why = command.text.as_ref().map(|text| format!(": {text}")).unwrap_or_default();
    format!(
        "{}{of} by {caller} from {origin}: {}{several}{why}",
        command.command,
        outcome.to_string().replace('_', " ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_an_alarm_is_not_told_with_the_words_of_its_beginning() {
        let now = Moment { steady_ms: 0, wall_ms: 0 };
        let mut alarms = Alarms::default();
        let mut told = |state: &str| {
            let data = serde_json::json!({ "id": 7, "count": 1, "state": state, "line": "north", "text": "no drive answers" });
            said(&format!("id: 1\nevent: alarm\ndata: {data}\n\n"), now, &mut alarms).unwrap().text
        };
        assert_eq!(told("unacknowledged"), "no drive answers");
        assert_eq!(told("over"), "over: no drive answers");
    }

    #[test]
    fn a_command_for_all_drives_is_told_as_one() {
        let one = serde_json::json!({
            "id": "a", "action": "stop", "command": "ramp stop", "caller": "anonymous", "origin": "http 127.0.0.1",
            "outcome": "confirmed", "open": false, "time_unix_ms": 7, "drive": "pump 1",
        });
        let mut all = one.clone();
        all.as_object_mut().unwrap().remove("drive");
        for (name, count) in
            [("confirmed", 1), ("pending", 0), ("not_reachable", 0), ("refused", 0), ("failed", 0)]
        {
            all[name] = count.into();
        }
        all["drives"] = serde_json::json!([one]);
        let told = |data: &serde_json::Value| {
            let frame = format!("id: 1\nevent: command\ndata: {data}\n\n");
            said(&frame, Moment { steady_ms: 0, wall_ms: 0 }, &mut Alarms::default()).unwrap().text
        };
        assert!(told(&all).starts_with("ramp stop of all 1 drives by anonymous"), "{}", told(&all));
        assert!(told(&one).starts_with("ramp stop by anonymous"), "{}", told(&one));
    }

    #[test]
    fn a_loss_is_kept_once_by_each_of_its_words_however_often_these_come_again() {
        let now = Moment { steady_ms: 0, wall_ms: 0 };
        let mut alarms = Alarms::default();
        let mut told = |state: &str, count: u32, why: &str| {
            let text = format!("lost while it was running, the motor may turn: {why}");
            let data =
                serde_json::json!({ "id": 7, "count": count, "state": state, "drive": "pump", "text": text });
            said(&format!("id: 1\nevent: alarm\ndata: {data}\n\n"), now, &mut alarms).is_some()
        };
        let whys = ["no answer within 100 ms", "expired before it was sent", "the slave is off-line"];
        let mut all = |state: &str, count: u32| {
            let round = whys.iter().cycle().take(12);
            round.filter(|why| told(state, count, why)).count()
        };
        assert_eq!(all("suppressed", 1), 3);
        assert_eq!(all("unacknowledged", 1), 3, "it is another state");
        assert_eq!(all("unacknowledged", 2), 3, "it has come again");
        let endless = (0..1_000).filter(|number| told("unacknowledged", 2, &number.to_string())).count();
        assert!(endless < WORDS, "{endless}");
    }

    #[test]
    fn an_alarm_that_is_told_again_for_those_that_follow_from_it_is_kept_once() {
        let now = Moment { steady_ms: 0, wall_ms: 0 };
        let mut alarms = Alarms::default();
        let mut told = |state: &str, count: u32, members: u32| {
            let data = serde_json::json!({
                "id": 7, "count": count, "state": state, "line": "north", "text": "no drive answers", "members": members,
            });
            said(&format!("id: 1\nevent: alarm\ndata: {data}\n\n"), now, &mut alarms).is_some()
        };
        assert!(
            told("unacknowledged", 1, 1) && !told("unacknowledged", 1, 2) && !told("unacknowledged", 1, 3)
        );
        assert!(told("acknowledged", 1, 3) && told("unacknowledged", 2, 3));
        assert!(told("over", 2, 0) && told("unacknowledged", 1, 0), "it has come anew");
    }
}
