//! A text with places for what is known of an alarm: [`Template`].

use std::str::FromStr;

use chrono::{DateTime, Local};
use drive_fleet::alarms::AlarmView;

/// How long a text may be before its places are filled.
const LONGEST: usize = 2_000;

/// What an alarm is told as unless the file says otherwise.
pub(crate) const USUAL: &str = "{of}: {text} ({state}). {what_to_do}";

/// A text, and the places in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Template(Vec<Piece>);

#[derive(Debug, Clone, PartialEq, Eq)]
enum Piece {
    Text(String),
    /// Its number in [`PLACES`].
    Place(usize),
}

/// What stands in a place, for this host.
type Filled = fn(&str, &AlarmView) -> String;

/// What may stand between braces.
const PLACES: [(&str, Filled); 15] = [
    ("host", |host, _| host.to_owned()),
    ("of", |_, view| view.alarm.of()),
    ("drive", |_, view| view.alarm.drive.clone().unwrap_or_default()),
    ("line", |_, view| view.alarm.line.clone().unwrap_or_default()),
    ("alarm", |_, view| view.alarm.kind.word().to_owned()),
    ("text", |_, view| view.text.clone()),
    ("severity", |_, view| view.severity.to_string()),
    ("state", |_, view| view.state.to_string()),
    ("what_to_do", |_, view| view.alarm.remedy.clone()),
    ("since", |_, view| time(view.alarm.first_unix_ms)),
    ("last", |_, view| time(view.alarm.last_unix_ms)),
    ("count", |_, view| view.alarm.count.to_string()),
    ("members", |_, view| view.members.to_string()),
    ("who", |_, view| who(view).0),
    ("note", |_, view| who(view).1),
];

impl Template {
    /// The text for an alarm of this host.
    pub(crate) fn fill(&self, host: &str, view: &AlarmView) -> String {
        let piece = |piece: &Piece| match piece {
            Piece::Text(text) => text.clone(),
            Piece::Place(number) => PLACES.get(*number).map_or_else(String::new, |(_, of)| of(host, view)),
        };
        self.0.iter().map(piece).collect()
    }
}

/// Who has acknowledged it or put it aside, and what he has said.
fn who(view: &AlarmView) -> (String, String) {
    match (&view.alarm.acknowledged, &view.alarm.shelved) {
        (_, Some(shelved)) => (shelved.by.clone(), shelved.why.clone()),
        (Some(seen), None) => (seen.by.clone(), seen.note.clone().unwrap_or_default()),
        (None, None) => <(String, String)>::default(),
    }
}

fn time(unix_ms: u64) -> String {
    let at = i64::try_from(unix_ms).ok().and_then(DateTime::from_timestamp_millis);
    at.map_or_else(String::new, |at| at.with_timezone(&Local).format("%Y-%m-%d %H:%M:%S %:z").to_string())
}

impl FromStr for Template {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if text.trim().is_empty() || text.chars().count() > LONGEST {
            return Err(format!("expected a text of at most {LONGEST} characters"));
        }
        let (mut pieces, mut plain, mut rest) = (Vec::new(), String::new(), text);
        while let Some(at) = rest.find(['{', '}']) {
            let (before, from) = rest.split_at(at);
            plain.push_str(before);
            if let Some(after) = ["{{", "}}"].iter().find_map(|twice| from.strip_prefix(twice)) {
                plain.push_str(from.get(..1).unwrap_or_default());
                rest = after;
                continue;
            }
            let place = from.strip_prefix('{').and_then(|from| from.split_once('}'));
            let Some((name, after)) = place else {
                return Err("a brace alone: expected {PLACE}, or {{ and }} for braces".to_owned());
            };
            let Some(number) = PLACES.iter().position(|(known, _)| *known == name) else {
                let known: Vec<String> = PLACES.iter().map(|(name, _)| format!("{{{name}}}")).collect();
                return Err(format!("{{{name}}}: expected one of {}", known.join(", ")));
            };
            pieces.extend([Piece::Text(std::mem::take(&mut plain)), Piece::Place(number)]);
            rest = after;
        }
        pieces.push(Piece::Text(plain + rest));
        Ok(Self(pieces))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::view;

    fn filled(text: &str) -> String {
        let (mut view, now) = (view(7, "unacknowledged"), 1_700_000_000_000);
        view.alarm.first_unix_ms = now;
        text.parse::<Template>().unwrap().fill("north", &view)
    }

    #[test]
    fn places_are_filled_and_double_braces_are_braces() {
        assert_eq!(filled("{host} {of}: {text}"), "north pump 1: tripped: OCF");
        assert_eq!(
            filled("{{{alarm}}} {severity}/{state} x{count} {line}"),
            "{tripped} alarm/unacknowledged x1 lines"
        );
        assert_eq!(filled("{who}{note}"), "", "nobody yet");
        // date -u -d @1700000000: 2023-11-14 22:13:20; the date is the same or the next one in every zone.
        assert!(filled("{since}").starts_with("2023-11-1"), "{}", filled("{since}"));
        assert_eq!(filled(USUAL), "pump 1: tripped: OCF (unacknowledged). look at it");
    }

    #[test]
    fn a_place_that_there_is_not_is_said_with_those_that_there_are() {
        let wrong = |text: &str| text.parse::<Template>().unwrap_err();
        assert!(
            wrong("{drve}").starts_with("{drve}: expected one of {host}, {of}, {drive}"),
            "{}",
            wrong("{drve}")
        );
        for text in ["a } b", "{of", "{", "", "  "] {
            wrong(text);
        }
        wrong(&"x".repeat(LONGEST + 1));
    }
}
