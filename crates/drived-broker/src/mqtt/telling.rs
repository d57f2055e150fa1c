//! What is told: each drive by a task of its own, from its watch, as the API has it.
//!
//! What a person has to know at once (state, link, fault, stop) is told at once; values that change all the time at most
//! once in an interval, and only those topics in which one has changed; everything at each heartbeat, though nothing has changed.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use drive_core::{Direction, Setpoint, State};
use drive_fleet::{DriveHandle, Event, EventKind, Freshness, Link, Snapshot};
use serde_json::{Map, Value, json};
use tokio::time::{Instant, sleep_until};

use super::{Face, discovery::Discovered};
use crate::broker::{Kept, Message};
use drived_plant::plant::views::{DriveView, Gist, LineView};
use drived_words::json::{line, unix};

/// For how long news are of interest to a broker that was away.
const NEWS_FOR: Duration = Duration::from_secs(600);

/// What is told at once.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Head {
    link: Link,
    quality: Freshness,
    state: Option<(State, Option<Direction>, Option<u16>)>,
    /// The code of the trip that it shows: it is read a moment after the state.
    trip: Option<Option<u16>>,
    stops: bool,
    setpoint: Option<Setpoint>,
}

impl Head {
    fn of(snapshot: &Snapshot, now: Instant) -> Self {
        let status = snapshot.status.as_ref().map(|status| &status.value);
        Self {
            link: snapshot.link,
            quality: snapshot.freshness(now),
            state: status.map(|status| (status.state, status.direction, status.fault_code)),
            trip: snapshot.present_trip().map(|trip| trip.fault().map(|fault| fault.code)),
            stops: snapshot.stop.is_some(),
            setpoint: snapshot.setpoint,
        }
    }
}

/// What tells one drive.
pub(super) struct Teller {
    face: Arc<Face>,
    line: Arc<str>,
    drive: DriveHandle,
    discovered: Discovered,
}

impl Teller {
    pub(super) fn new(face: Arc<Face>, line: Arc<str>, drive: DriveHandle, discovered: Discovered) -> Self {
        Self { face, line, drive, discovered }
    }

    /// Tells until the drive has ended.
    pub(super) async fn run(self) {
        let (mut watch, mut anew) = (self.drive.watch(), self.face.anew.subscribe());
        let (heartbeat, interval) = (self.face.config.heartbeat, self.face.config.interval);
        let mut told: Option<Told> = None;
        loop {
            let snapshot = Arc::clone(&watch.borrow_and_update());
            let (now, again) = (Instant::now(), anew.has_changed().unwrap_or(false));
            anew.mark_unchanged();
            let (head, gist) = (Head::of(&snapshot, now), Gist::of(&snapshot, now));
            let due = match &told {
                Some(last) if again || last.head != head => now,
                Some(last) if last.gist != gist => (last.at + interval).min(last.whole_at + heartbeat),
                Some(last) => last.whole_at + heartbeat,
                None => now,
            };
            let due = if due <= now {
                // Of what was told in this heartbeat only what has changed is told again.
                let before = told.filter(|last| !again && now < last.whole_at + heartbeat);
                let told_now = self.tell(&snapshot, again, before.as_ref().map(|last| &last.values));
                let whole_at = before.map_or(now, |last| last.whole_at);
                told = Some(Told { head, gist, at: now, whole_at, values: told_now });
                whole_at + heartbeat
            } else {
                due
            };
            // A status becomes stale though nothing comes.
            let stale_at = snapshot.status.as_ref().map(|status| status.at + snapshot.max_age);
            let stale_at = stale_at.filter(|at| *at >= now).map(|at| at + Duration::from_millis(1));
            tokio::select! {
                changed = watch.changed() => if changed.is_err() {
                    return;
                },
                _ = anew.changed() => {
                    // Seen at the head of the loop.
                    anew.mark_changed();
                }
                () = sleep_until(stale_at.map_or(due, |at| at.min(due))) => {}
            }
        }
    }

    /// Tells all of it, or what is not as it was before. Gives what it is now.
    fn tell(&self, snapshot: &Snapshot, again: bool, before: Option<&Values>) -> Values {
        let (face, name) = (&self.face, self.drive.name());
        let reachable = if snapshot.link == Link::Connected { "online" } else { "offline" };
        let Parts { state, measurements, fault } = Parts::of(&DriveView::of(&self.line, &self.drive));
        self.discovered.tell(face, &self.drive, again);
        let parts = [state, measurements, fault].map(Value::Object);
        let values = (reachable, parts.clone().map(ageless));
        for (at, (what, part)) in ["state", "measurements", "fault"].into_iter().zip(parts).enumerate() {
            if before.is_none_or(|(_, before)| before[at] != values.1[at]) {
                face.tell(face.topics.drive(name, what), part.to_string());
            }
        }
        if before.is_none_or(|(before, _)| *before != reachable) {
            face.tell_for_good(face.topics.drive(name, "availability"), reachable);
        }
        values
    }
}

/// Whether a drive answers, and its state, measurements and fault without their ages.
type Values = (&'static str, [Value; 3]);

/// What was told of a drive.
struct Told {
    head: Head,
    gist: Gist,
    /// When anything was told last, and when everything.
    at: Instant,
    whole_at: Instant,
    values: Values,
}

/// The same without what changes as time goes by.
fn ageless(mut value: Value) -> Value {
    match &mut value {
        Value::Object(members) => {
            members.retain(|key, _| key != "age_ms" && key != "time_unix_ms");
            members.values_mut().for_each(|member| *member = ageless(member.take()));
        }
        Value::Array(all) => all.iter_mut().for_each(|one| *one = ageless(one.take())),
        _ => {}
    }
    value
}

/// A drive as it is told, by topic.
struct Parts {
    state: Map<String, Value>,
    measurements: Map<String, Value>,
    fault: Map<String, Value>,
}

impl Parts {
    fn of(view: &DriveView) -> Self {
        let now = Value::from(unix(Instant::now()));
        let object = |value| match value {
            Some(Value::Object(object)) => object,
            _ => Map::new(),
        };
        let mut state = object(serde_json::to_value(view).ok());
        let mut measurements = object(state.remove("measurements"));
        let fault = state.remove("fault");
        let present = Value::from(fault.is_some());
        let mut fault = object(fault);
        fault.insert("present".to_owned(), present);
        fault.insert("quality".to_owned(), state["status"]["quality"].clone());
        for part in [&mut state, &mut measurements, &mut fault] {
            part.insert("time_unix_ms".to_owned(), now.clone());
        }
        Self { state, measurements, fault }
    }
}

/// Tells what has happened to a drive; what becomes of commands is told to those who asked.
pub(super) fn tell_event(face: &Face, event: &Event) {
    if matches!(event.kind, EventKind::Command { .. }) {
        return;
    }
    let mut message = Message::new(face.topics.drive(&event.drive, "event"), line(event));
    message.expires = Some(Instant::now() + NEWS_FOR);
    face.broker.publish(message, Kept::InOrder);
}

/// Tells the newest line of the audit log, if there is one. The broker keeps it, and whoever records what the broker says has
/// one for each time, by which a log is known that was put back as it was earlier.
pub(super) fn tell_head(face: &Face) {
    let head = face.audited.borrow().clone();
    if let Some(head) = head {
        let told = json!({ "head": head, "time_unix_ms": unix(Instant::now()) });
        face.tell_for_good(face.topics.audit(), told.to_string());
    }
}

/// The daemon and its lines.
#[derive(Default)]
pub(super) struct Daemon {
    told_at: Option<Instant>,
    /// The newest line of the audit log that was told.
    head: Option<String>,
    /// Whether the port of each line was there.
    links: BTreeMap<String, Value>,
    pub(super) discovered: Discovered,
}

impl Daemon {
    /// Tells them at each heartbeat, when a port has come or gone, and when they are to be told again.
    pub(super) fn tell(&mut self, face: &Face, again: bool) {
        let (now, lines) = (Instant::now(), face.plant.lines());
        let links: BTreeMap<String, Value> =
            lines.iter().map(|line| (line.name.clone(), json!(line.link))).collect();
        let is_due = self.told_at.is_none_or(|at| now >= at + face.config.heartbeat);
        if !(again || is_due || links != self.links) {
            return;
        }
        for gone in self.links.keys().filter(|name| !links.contains_key(*name)) {
            face.tell_for_good(face.topics.line(gone), "");
        }
        self.told_at = Some(now);
        let head = face.audited.borrow().clone();
        if again || head != self.head {
            tell_head(face);
            self.head = head;
        }
        self.links = links;
        for line in &lines {
            face.tell(face.topics.line(&line.name), told(line));
        }
        let counts = face.broker.counts();
        let lost: Map<String, Value> = counts
            .lost
            .by_reason()
            .into_iter()
            .map(|(reason, count)| (reason.to_owned(), count.into()))
            .collect();
        let daemon = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "host": face.host,
            "instance": face.instance,
            "time_unix_ms": unix(now),
            "lines": lines.len(),
            "drives": face.plant.fleet().drives().len(),
            "standing_lines": face.plant.standing_lines(),
            "mqtt": { "sent": counts.sent, "arrived": counts.arrived, "lost": lost },
        });
        face.tell(face.topics.daemon(), daemon.to_string());
        self.discovered.tell_daemon(face, &lines, again);
    }
}

fn told(line: &LineView) -> String {
    let mut line = json!(line);
    line["time_unix_ms"] = unix(Instant::now()).into();
    line.to_string()
}
