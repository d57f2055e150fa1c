//! What the broker still has of drives and lines that left the configuration while the daemon was not running: read back after each
//! connect, and taken back once.
//!
//! What stands under the base is the daemon's own, unless another daemon tells there too: while there may be one, nothing is taken
//! back, and where there is one it is said who. A document of Home Assistant is taken back only if it names this daemon.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use serde_json::Value;
use tokio::time::Instant;

use super::{
    Face,
    discovery::{self, Discovered},
    parts::TOPICS,
    topics::Standing,
};
use crate::broker::{Arrived, Qos, Subscription, Wanted, config::Discovery};
use drived_config::names::Kind;

/// How long after a connect the broker may take to say what it has.
const SETTLED: Duration = Duration::from_secs(2);
/// After the availability and the documents, the rest is taken back: a reader of the documents does not read that any more.
const REST: Duration = Duration::from_secs(3);
/// Drives and lines that are looked after at once; the others at the next connect.
const MOST: usize = 1_024;

/// What is being taken back.
pub(super) struct Gone {
    /// What has been read back may be judged from then on.
    from: Instant,
    drives: BTreeSet<String>,
    lines: BTreeSet<String>,
    /// The drives whose rest is taken back then.
    rest: BTreeMap<String, Instant>,
    connects: u32,
    /// Which other daemon the broker had last, and when it had told that.
    seen: Option<(String, Option<u64>)>,
    /// Which other daemon was told of.
    other: Option<String>,
}

impl Gone {
    pub(super) fn new() -> Self {
        Self {
            from: Instant::now(),
            drives: BTreeSet::new(),
            lines: BTreeSet::new(),
            rest: BTreeMap::new(),
            connects: 0,
            seen: None,
            other: None,
        }
    }

    /// Asks a new connection for what it has.
    pub(super) fn connected(&mut self, face: &Face) {
        self.connects = self.connects.saturating_add(1);
        self.from = Instant::now() + SETTLED;
        self.drives.clear();
        self.lines.clear();
        let topics = &face.topics;
        let own = [topics.daemon(), topics.drive_of("+", "availability"), topics.line_of("+")];
        let documents = is_discovered(face).then(|| topics.documents(&topics.node())).into_iter().flatten();
        ask(face, own.into_iter().chain(documents));
    }

    /// Hears what the broker has, and what others tell. False: it is none of that.
    pub(super) fn hear(&mut self, face: &Face, arrived: &Arrived, daemon: &Discovered) -> bool {
        let Some(standing) = face.topics.standing(&arrived.topic) else { return false };
        if arrived.payload.is_empty() {
            return true;
        }
        match standing {
            Standing::Daemon => self.hear_daemon(face, arrived),
            // What others tell now is theirs.
            _ if !arrived.retain => {}
            Standing::Drive(id) if self.drives.len() < MOST => drop(self.drives.insert(id)),
            Standing::Line(id) if self.lines.len() < MOST => drop(self.lines.insert(id)),
            Standing::Drive(_) | Standing::Line(_) => {}
            Standing::Document => {
                if let Ok(document) = serde_json::from_slice::<Value>(&arrived.payload)
                    && discovery::is_of(face, &document)
                    && !daemon.recall(face, &arrived.topic, &document)
                {
                    face.tell_for_good(arrived.topic.clone(), "");
                }
            }
        }
        true
    }

    /// A daemon tells under this base, or has done so. Of two that are there the one that began later stands aside: a broker throws out
    /// the one when the other of its name comes, and who commands a drive means that of the first.
    fn hear_daemon(&mut self, face: &Face, arrived: &Arrived) {
        let said = serde_json::from_slice::<Value>(&arrived.payload).unwrap_or_default();
        let Some(instance) = said["instance"].as_str().filter(|instance| *instance != face.instance) else {
            return;
        };
        // What the broker has of it was told since this one has been here.
        let seen = Some((instance.to_owned(), said["time_unix_ms"].as_u64()));
        let is_new = self.connects > 1 && self.seen != seen;
        self.seen = seen;
        let lives = is_new || !arrived.retain;
        let host = said["host"].as_str();
        // It may be this one before its restart, and another on this host as well. If it is there, it tells so again before that is over.
        let left = arrived.expires_in_s.map(|seconds| Duration::from_secs(seconds.into()));
        self.from = self.from.max(Instant::now() + left.unwrap_or(face.config.heartbeat * 3) + SETTLED);
        if !lives {
            return;
        }
        let stays = *face.instance < *instance;
        let (host, base) = (host.unwrap_or("of a host that it does not name"), &face.config.base);
        let who = if stays { "this one stays" } else { "it was there first, and this one stands aside" };
        if self.other.as_deref() != Some(instance) {
            tracing::error!(
                "MQTT: another daemon, on {host}, tells under {base:?} too, and its drives cannot be told from those of this one: {who}; \
                 give each its own base"
            );
            self.other = Some(instance.to_owned());
        }
        if !stays {
            face.broker.stand_aside();
        }
    }

    /// Takes back what is not there any more.
    pub(super) fn look(&mut self, face: &Face) {
        let now = Instant::now();
        let due: Vec<String> =
            self.rest.iter().filter(|(_, at)| **at <= now).map(|(id, _)| id.clone()).collect();
        for id in due {
            self.rest.remove(&id);
            if !has_drive(face, &id) {
                for what in TOPICS.into_iter().chain(["alarms", "last_command", "availability"]) {
                    face.tell_for_good(face.topics.drive_of(&id, what), "");
                }
            }
        }
        if now < self.from {
            return;
        }
        for id in std::mem::take(&mut self.drives) {
            if !has_drive(face, &id) && !self.rest.contains_key(&id) {
                tracing::info!("MQTT: there is no drive {id:?} any more: what was told of it is taken back");
                if is_discovered(face) {
                    let device = format!("{}_{id}", face.topics.node());
                    ask(face, face.topics.documents(&device));
                }
                self.take_back(face, &id);
            }
        }
        let lines = face.plant.lines();
        for id in std::mem::take(&mut self.lines) {
            if !lines.iter().any(|line| face.topics.id(Kind::Line, &line.name) == id) {
                face.tell_for_good(face.topics.line_of(&id), "");
                face.tell_for_good(format!("{}/alarms", face.topics.line_of(&id)), "");
            }
        }
    }

    /// Takes back what was told of a drive that is here no more: first that it is there, then the rest.
    pub(super) fn take_back(&mut self, face: &Face, id: &str) {
        face.tell_for_good(face.topics.drive_of(id, "availability"), "offline");
        self.rest.insert(id.to_owned(), Instant::now() + REST);
    }
}

/// Whether there is a drive of this id, or will be in a moment.
pub(super) fn has_drive(face: &Face, id: &str) -> bool {
    face.topics.has(Kind::Drive, id) || is_here(face, id)
}

/// Whether there is a drive of this id.
pub(super) fn is_here(face: &Face, id: &str) -> bool {
    face.plant.fleet().drives().iter().any(|drive| face.topics.id(Kind::Drive, drive.name()) == id)
}

fn is_discovered(face: &Face) -> bool {
    face.config.discovery != Discovery::Off
}

/// Asks the broker for what it has of these topics.
fn ask(face: &Face, filters: impl IntoIterator<Item = String>) {
    let asked = filters.into_iter().map(|filter| Subscription {
        filter,
        qos: Qos::AtLeastOnce,
        wanted: Wanted::Others,
    });
    face.broker.subscribe(asked);
}
