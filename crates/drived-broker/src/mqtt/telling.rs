//! What is told: each drive by a task of its own, from its watch, as the API has it.
//!
//! What a person has to know at once (state, link, fault, stop) is told at once; values that change all the time at most
//! once in an interval, and only those topics in which one has moved by more than it means; everything at each heartbeat, though nothing
//! has changed.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use drive_core::{Direction, Setpoint, State};
use drive_fleet::{DriveHandle, Event, EventKind, Freshness, Link, Snapshot};
use serde_json::{Map, Value, json};
use tokio::time::{Instant, sleep_until};

use super::{
    Face,
    discovery::Discovered,
    parts::{ABOUT, MEASUREMENTS, News, TOPICS, news, parts_of},
};
use crate::broker::{Kept, Message};
use drived_plant::plant::views::{Gist, LineView};
use drived_words::json::{line, unix};

/// For how long news are of interest to a broker that was away.
const NEWS_FOR: Duration = Duration::from_secs(600);

/// After so many intervals what has moved by less than it means is told too, so that everybody has what a value came to rest at.
const LITTLE: u32 = 10;

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
            let snapshot = watch.look();
            let (now, again) = (Instant::now(), anew.has_changed().unwrap_or(false));
            anew.mark_unchanged();
            let (head, gist) = (Head::of(&snapshot, now), Gist::of(&snapshot, now));
            let due = match &told {
                Some(last) if again || last.head != head => now,
                Some(last) if last.gist != gist => (last.looked_at + interval).min(last.due(heartbeat)),
                Some(last) => last.due(heartbeat),
                None => now,
            };
            let due = if due <= now {
                let told_now = self.tell(head, gist, again, told.take());
                let due = told_now.due(heartbeat);
                told = Some(told_now);
                due
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

    /// Tells all of it where it was not told in this heartbeat, and else what is news: what a person has to know at once, what has moved
    /// by more than it means once in its interval, and what has moved by less after some of them.
    fn tell(&self, head: Head, gist: Gist, again: bool, before: Option<Told>) -> Told {
        let (face, name, now) = (&self.face, self.drive.name(), Instant::now());
        self.discovered.tell(face, &self.drive, again);
        let is_urgent = before.as_ref().is_none_or(|before| before.head != head);
        let whole =
            again || before.as_ref().is_none_or(|before| now >= before.whole_at + face.config.heartbeat);
        let reachable = if head.link == Link::Connected { "online" } else { "offline" };
        // It does not expire.
        if again || before.as_ref().is_none_or(|before| before.head.link != head.link) {
            face.tell_for_good(face.topics.drive(name, "availability"), reachable);
        }
        let whole_at = before.as_ref().filter(|_| !whole).map_or(now, |before| before.whole_at);
        let mut parts_before = before.map(|before| before.parts.map(Some)).unwrap_or_default();
        let (mut pending, rows) = (None, self.drive.capabilities().rows);
        let mut place = 0;
        let parts = parts_of(&face.plant.view_of(&self.line, &self.drive)).map(|value| {
            let (at, last) = (place, parts_before[place].take());
            place += 1;
            let news = last.as_ref().map_or(News::Something, |(last, _)| news(at, last, &value, rows));
            let pace = if at == MEASUREMENTS { face.config.measurements } else { face.config.interval };
            let wait = match news {
                // What a drive is does not expire, and is not told again.
                _ if whole && (again || at != ABOUT) => Duration::ZERO,
                News::Nothing => Duration::MAX,
                _ if is_urgent => Duration::ZERO,
                News::Something => pace,
                News::Little => pace * LITTLE,
            };
            let due = last.as_ref().map_or(Some(now), |(_, told_at)| told_at.checked_add(wait));
            match (due, last) {
                (Some(due), last) if due <= now || last.is_none() => {
                    let topic = face.topics.drive(name, TOPICS[at]);
                    match at == ABOUT {
                        true => face.tell_for_good(topic, value.to_string()),
                        false => face.tell(topic, value.to_string()),
                    }
                    (value, now)
                }
                (due, last) => {
                    pending = pending.into_iter().chain(due).min();
                    last.unwrap_or((value, now))
                }
            }
        });
        Told { head, gist, looked_at: now, whole_at, pending, parts }
    }
}

/// What was told of a drive.
struct Told {
    head: Head,
    /// When it was looked at last whether something is to be told, and what it was then.
    looked_at: Instant,
    gist: Gist,
    /// When everything was told last.
    whole_at: Instant,
    /// When something is to be told that has waited for its time.
    pending: Option<Instant>,
    /// Each part as it was told last, and when.
    parts: [(Value, Instant); 4],
}

impl Told {
    /// When something is to be told though nothing changes.
    fn due(&self, heartbeat: Duration) -> Instant {
        let whole = self.whole_at + heartbeat;
        self.pending.map_or(whole, |pending| pending.min(whole))
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
