//! What an audit log says of somebody, of something, of some time.

use std::{
    io::{self, BufRead as _, BufReader},
    path::Path,
};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::{
    REFUSED,
    file::{KEPT, aside},
};
use drived_config::kept::Kept;

/// Which records are looked for; what is not said is not asked.
#[derive(Debug, Clone, Default)]
pub struct Filter {
    pub since_unix_ms: Option<u64>,
    pub until_unix_ms: Option<u64>,
    pub caller: Option<String>,
    /// A part of what was asked for, such as the name that a drive had, or the id of a drive.
    pub about: Option<String>,
    /// What somebody might not do, instead of what was done.
    pub refused: bool,
}

/// A line of the log as it is read back, whichever program has written it: what is missing in it is empty, and what this one
/// does not know is passed on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Found {
    pub time_unix_ms: u64,
    #[serde(default)]
    pub kind: String,
    #[serde(default)]
    pub caller: String,
    #[serde(default)]
    pub origin: String,
    #[serde(default)]
    pub what: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<Value>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outcome: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub status: Option<u16>,
    #[serde(flatten)]
    rest: Map<String, Value>,
}

impl Filter {
    fn has(&self, found: &Found) -> bool {
        let time = found.time_unix_ms;
        self.since_unix_ms.is_none_or(|since| time >= since)
            && self.until_unix_ms.is_none_or(|until| time < until)
            && self.caller.as_ref().is_none_or(|caller| *caller == found.caller)
            && self.about.as_ref().is_none_or(|about| {
                found.what.contains(about.as_str()) || found.drive.as_ref() == Some(about)
            })
    }
}

/// The records that are looked for, the oldest first; of more the last so many.
///
/// # Errors
/// A file cannot be read.
pub fn shown(path: &Path, filter: &Filter, last: usize) -> io::Result<Vec<Found>> {
    let log = Kept::at(path);
    let log = if filter.refused { log.beside(REFUSED) } else { log };
    let mut found = std::collections::VecDeque::new();
    for file in (1..=KEPT).rev().map(|number| aside(&log, number)).chain([log.clone()]) {
        let Some(open) = file.open()? else { continue };
        for line in BufReader::new(open).split(b'\n') {
            let Ok(mut record) = serde_json::from_slice::<Found>(&line?) else { continue };
            record.what = decoded(&record.what);
            if !filter.has(&record) {
                continue;
            }
            if found.len() >= last {
                found.pop_front();
            }
            found.push_back(record);
        }
    }
    Ok(found.into())
}

/// A path as a person writes it: `pump 1` for `pump%201`.
fn decoded(path: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = path.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let escaped = || {
            let digits = str::from_utf8(after.get(..2)?).ok()?;
            u8::from_str_radix(digits, 16).ok().filter(|byte| !byte.is_ascii_control())
        };
        match (byte == b'%').then(escaped).flatten() {
            Some(escaped) => {
                bytes.push(escaped);
                rest = after.get(2..).unwrap_or_default();
            }
            None => {
                bytes.push(byte);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| path.to_owned())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::json;

    use super::{
        super::{Kind, Line, Record},
        *,
    };
    use drived_config::testing::Folder;

    #[test]
    fn what_is_written_reads_back_as_it_was_written_with_what_a_newer_program_has_added() {
        let record = Record {
            body: Some(json!({"setpoint": {"frequency_hz": 30.0}})),
            outcome: Some("confirmed".to_owned()),
            status: Some(200),
            id: Some("c-1".to_owned()),
            drive: Some("pump 1".to_owned()),
            ..Record::of_program(Kind::Command, "POST /api/v1/stop")
        };
        let line = Line { number: 7, time_unix_ms: 100, record: &record, previous: "00" };
        let mut written = serde_json::to_value(&line).unwrap();
        written.as_object_mut().unwrap().insert("newer".to_owned(), json!([1]));
        let found: Found = serde_json::from_value(written.clone()).unwrap();
        assert_eq!((&*found.kind, &*found.what), ("command", "POST /api/v1/stop"));
        assert_eq!(serde_json::to_value(&found).unwrap(), written);
    }

    #[test]
    fn who_did_what_at_a_time_is_found_in_all_files_of_the_log() {
        let folder = Folder::new("shown");
        let line = |time: u64, caller: &str, what: &str| {
            format!("{{\"time_unix_ms\":{time},\"caller\":\"{caller}\",\"what\":\"{what}\"}}\n")
        };
        let older =
            line(100, "panel", "POST /api/v1/drives/pump%201/start") + &line(200, "scada", "pump 1: stop");
        fs::write(folder.file("audit.1"), older).unwrap();
        fs::write(folder.file("audit"), line(300, "panel", "POST /api/v1/stop") + "torn").unwrap();
        fs::write(folder.file("audit.refused"), line(150, "guest", "POST /api/v1/reload")).unwrap();
        let found = |filter: Filter, last| {
            let shown = shown(&folder.file("audit"), &filter, last).unwrap();
            shown.iter().map(|record| record.time_unix_ms).collect::<Vec<_>>()
        };
        assert_eq!(found(Filter::default(), 10), [100, 200, 300]);
        assert_eq!(found(Filter::default(), 2), [200, 300]);
        assert_eq!(found(Filter { about: Some("pump 1".to_owned()), ..Filter::default() }, 10), [100, 200]);
        assert_eq!(found(Filter { caller: Some("panel".to_owned()), ..Filter::default() }, 10), [100, 300]);
        let around = Filter { since_unix_ms: Some(150), until_unix_ms: Some(300), ..Filter::default() };
        assert_eq!(found(around, 10), [200]);
        assert_eq!(found(Filter { refused: true, ..Filter::default() }, 10), [150]);
    }
}
