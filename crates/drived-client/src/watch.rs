//! The event stream of the daemon, as it comes.

use std::collections::BTreeMap;

use http_body_util::BodyExt as _;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::{Daemon, DaemonArgs};
use drived_plant::plant::views::{CommandView, DriveView, HappenedView, LineView};
use drived_screen::row;
use drived_words::{failure::Failure, moment, output};

/// Prints what happens until the daemon ends or nobody reads any more.
pub async fn watch(args: &DaemonArgs, daemon: &mut Daemon) -> Result<(), Failure> {
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
            } else if let Some(text) = Heard::of(&name, data).and_then(|heard| text(&heard, &mut shown)) {
                output::say(format_args!("{} {text}", moment::told(&chrono::Local::now(), "%H:%M:%S")))?;
            }
        }
    }
    Err(Failure::Drive("the daemon has ended".to_owned()))
}

/// An event of the stream.
#[derive(Debug, Clone)]
pub enum Heard {
    Drive(Box<DriveView>),
    Line(Box<LineView>),
    Command(Box<CommandView>),
    Event(HappenedView),
    /// Something is missing: the state is to be read anew.
    Reset,
    /// A sign of life, or what a newer daemon tells.
    Other,
}

impl Heard {
    /// What an event of this name tells; `None` where it is not what its name says.
    pub fn of(name: &str, data: Value) -> Option<Self> {
        fn read<T: DeserializeOwned>(data: Value) -> Option<T> {
            serde_json::from_value(data).ok()
        }
        Some(match name {
            "drive" => Self::Drive(read(data)?),
            "line" => Self::Line(read(data)?),
            "command" => Self::Command(read(data)?),
            "event" => Self::Event(read(data)?),
            "reset" => Self::Reset,
            _ => Self::Other,
        })
    }
}

/// What a person reads of an event: for a drive only what has changed in words.
fn text(heard: &Heard, shown: &mut BTreeMap<String, String>) -> Option<String> {
    match heard {
        Heard::Event(event) => {
            let alarm = if event.alarm { "ALARM " } else { "" };
            let drive = event.drive.as_deref().unwrap_or("the daemon");
            Some(format!("{alarm}{drive}: {}", event.text))
        }
        Heard::Command(command) => {
            let told = [
                command.drive.as_ref().map(|drive| format!("{drive}: ")),
                Some(command.command.clone()),
                Some(format!(" by {}", command.caller)),
                Some(format!(": {}", command.outcome.to_string().replace('_', " "))),
                command.text.as_ref().map(|text| format!(", {text}")),
            ];
            Some(told.into_iter().flatten().collect())
        }
        Heard::Drive(drive) => {
            let now = row::sentence(&drive.snapshot, drive.snapshot.status.is_good());
            let before = shown.insert(drive.name().to_owned(), now.clone());
            (before.as_ref() != Some(&now)).then(|| format!("{}: {now}", drive.name()))
        }
        Heard::Reset => Some("the reader was too slow: something is missing here".to_owned()),
        Heard::Line(_) | Heard::Other => None,
    }
}

/// Bytes of a stream of server-sent events, until they are whole.
#[derive(Default)]
pub struct Frames {
    rest: Vec<u8>,
    event: String,
    data: String,
}

impl Frames {
    /// The events that are whole with these bytes.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<(String, Value)> {
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
    use serde::Serialize;
    use serde_json::json;
    use tokio::time::Instant;

    use super::*;
    use drived_config::rights::{Caller, Rights};
    use drived_plant::plant::{
        commands::{Action, LIFETIME, Request, Target},
        testing::{TestPlant, told},
        views::NoticeView,
    };

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
        let mut drive = told("pump 1");
        drive["status"] = json!({"quality": "good", "state": "ready", "raw": []});
        let mut text = |drive: &Value| text(&Heard::of("drive", drive.clone()).unwrap(), &mut shown);
        assert_eq!(text(&drive), Some("pump 1: ready".to_owned()));
        assert_eq!(text(&drive), None);
        drive["status"]["quality"] = "stale".into();
        assert_eq!(text(&drive), Some("pump 1: not live: (ready)".to_owned()));
        (drive["shows"], drive["link"]) = ("lost".into(), "lost".into());
        assert_eq!(text(&drive), Some("pump 1: lost: (ready)".to_owned()));
    }

    /// What somebody who reads the stream understands of an event of this name.
    fn heard(name: &str, data: &impl Serialize) -> Heard {
        Heard::of(name, json!(data)).unwrap_or_else(|| panic!("{name}: {}", json!(data)))
    }

    #[tokio::test(start_paused = true)]
    async fn every_event_of_the_stream_is_understood() {
        let test = TestPlant::of(1).await;
        let plant = &test.plant;
        let request = Request {
            id: None,
            target: Target::All,
            action: Action::Stop(drive_core::StopMode::Ramp.into()),
            expects: None,
            lifetime: LIFETIME,
            arrived: Instant::now(),
        };
        let stopped = plant.begin(&Caller::new("hmi", "test", Rights::ALL), request).unwrap();
        assert!(matches!(heard("drive", &plant.drive("pump 1")), Heard::Drive(_)));
        assert!(matches!(heard("line", &plant.lines()[0]), Heard::Line(_)));
        assert!(matches!(heard("command", &**stopped.borrow()), Heard::Command(_)));
        let notice = NoticeView::new("audit_log", true, "it cannot be written");
        let Heard::Event(read) = heard("event", &notice) else { panic!("an event") };
        assert_eq!(read, notice.into());
        assert!(matches!(heard("tick", &json!({})), Heard::Other));
        assert!(Heard::of("drive", json!({"name": "pump 1"})).is_none(), "what is no drive is none");
    }
}
