//! The event stream of the daemon, as it comes.

use std::collections::BTreeMap;

use http_body_util::BodyExt as _;
use serde_json::Value;

use super::{Daemon, DaemonArgs, show};
use crate::{failure::Failure, output};

/// Prints what happens until the daemon ends or nobody reads any more.
pub(crate) async fn watch(args: &DaemonArgs, daemon: &mut Daemon) -> Result<(), Failure> {
    let answer = daemon.send("GET", "/api/v1/events", None).await?;
    if !answer.status().is_success() {
        return Err(Failure::Drive(format!("the daemon answers {}", answer.status())));
    }
    let mut body = answer.into_body();
    let (mut events, mut shown) = (Frames::default(), BTreeMap::new());
    while let Some(Ok(frame)) = body.frame().await {
        for (name, data) in events.take(frame.data_ref().map_or(&[][..], |data| data)) {
            if args.is_json() {
                output::say_as_it_is(serde_json::json!({ "kind": name, "data": data }))?;
            } else if let Some(text) = text(&name, &data, &mut shown) {
                output::say(format_args!("{} {text}", chrono::Local::now().format("%H:%M:%S")))?;
            }
        }
    }
    Err(Failure::Drive("the daemon has ended".to_owned()))
}

/// What a person reads of an event: for a drive only what has changed in words.
fn text(name: &str, data: &Value, shown: &mut BTreeMap<String, String>) -> Option<String> {
    let drive = data["drive"].as_str();
    match name {
        "event" => {
            let alarm = if data["alarm"] == true { "ALARM " } else { "" };
            Some(format!("{alarm}{}: {}", drive.unwrap_or("the daemon"), data["text"].as_str()?))
        }
        "command" => {
            let told = [
                drive.map(|drive| format!("{drive}: ")),
                data["command"].as_str().map(str::to_owned),
                data["caller"].as_str().map(|caller| format!(" by {caller}")),
                data["outcome"].as_str().map(|outcome| format!(": {}", outcome.replace('_', " "))),
                data["text"].as_str().map(|text| format!(", {text}")),
            ];
            Some(told.into_iter().flatten().collect())
        }
        "drive" => {
            let name = data["name"].as_str()?;
            let quality = if data["status"]["quality"] == "good" { "" } else { "LOST, was " };
            let now = format!("{quality}{}", show::status_in_words(&data["status"])?);
            let before = shown.insert(name.to_owned(), now.clone());
            (before.as_ref() != Some(&now)).then(|| format!("{name}: {now}"))
        }
        "reset" => Some("the reader was too slow: something is missing here".to_owned()),
        _ => None,
    }
}

/// Bytes of a stream of server-sent events, until they are whole.
#[derive(Default)]
pub(crate) struct Frames {
    rest: Vec<u8>,
    event: String,
    data: String,
}

impl Frames {
    /// The events that are whole with these bytes.
    pub(crate) fn take(&mut self, bytes: &[u8]) -> Vec<(String, Value)> {
        self.rest.extend_from_slice(bytes);
        let mut whole = Vec::new();
        while let Some(end) = self.rest.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.rest.drain(..=end).collect();
            let line = String::from_utf8_lossy(&line);
            let line = line.trim_end_matches(['\n', '\r']);
            match line.split_once(':') {
                _ if line.is_empty() => {
                    let data = std::mem::take(&mut self.data);
                    let event = std::mem::take(&mut self.event);
                    whole.extend(serde_json::from_str(&data).ok().map(|data| (event, data)));
                }
                Some(("event", name)) => name.trim_start().clone_into(&mut self.event),
                Some(("data", data)) => self.data.push_str(data.strip_prefix(' ').unwrap_or(data)),
                _ => {}
            }
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn events_are_whole_however_their_bytes_come() {
        let stream =
            b": hello\n\nid: 1\nevent: drive\ndata: {\"name\":\"pump 1\"}\n\nevent: tick\ndata: {}\n\n";
        for size in [1, 3, 7, stream.len()] {
            let mut frames = Frames::default();
            let all: Vec<_> = stream.chunks(size).flat_map(|bytes| frames.take(bytes)).collect();
            assert_eq!(
                all,
                [("drive".to_owned(), json!({"name": "pump 1"})), ("tick".to_owned(), json!({}))]
            );
        }
    }

    #[test]
    fn a_drive_is_told_again_only_when_it_reads_otherwise() {
        let mut shown = BTreeMap::new();
        let drive = json!({"name": "pump 1", "status": {"quality": "good", "state": "ready"}});
        assert_eq!(text("drive", &drive, &mut shown), Some("pump 1: ready".to_owned()));
        assert_eq!(text("drive", &drive, &mut shown), None);
        let lost = json!({"name": "pump 1", "status": {"quality": "stale", "state": "ready"}});
        assert_eq!(text("drive", &lost, &mut shown), Some("pump 1: LOST, was ready".to_owned()));
    }
}
