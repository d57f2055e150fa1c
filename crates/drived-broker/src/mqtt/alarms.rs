//! The alarms on the broker: of each drive, of each line itself and of the program all together, retained, and each once as it comes.
//! What is an alarm and what becomes of it is decided in [`drive_fleet::alarms`]; nothing here judges a drive.

use std::collections::BTreeMap;

use drive_fleet::{
    ConcernKind,
    alarms::{AlarmKind, AlarmState, AlarmView},
};
use serde_json::json;
use tokio::{
    sync::watch,
    time::{Duration, Instant},
};

use super::Face;
use crate::broker::{Kept, Message};
use drived_plant::plant::alarms::{OwnAlarms, Owner};
use drived_words::json::unix;

/// For how long it is of interest to a broker that was away that an alarm came: the alarm itself is told for as long as it stands.
const NEWS_FOR: Duration = Duration::from_secs(600);

/// Within this time after a drive was lost it is known whether it is alone.
const CAUSE_WITHIN: Duration = Duration::from_secs(5);

/// What tells them.
pub(super) struct Alarms {
    changes: watch::Receiver<u64>,
    /// How often each had come, and whether another stood for it, when they were looked at last.
    known: BTreeMap<u64, Known>,
    told: BTreeMap<Owner, OwnAlarms>,
    told_at: Option<Instant>,
}

struct Known {
    count: u32,
    is_suppressed: bool,
}

impl Alarms {
    /// Those that stand already are no news.
    pub(super) fn new(face: &Face) -> Self {
        let changes = face.plant.alarm_changes();
        let known = face.plant.alarms().alarms.iter().map(Known::of).collect();
        Self { changes, known, told: BTreeMap::new(), told_at: None }
    }

    /// Waits until one of them is another.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub(super) async fn changed(&mut self) {
        if self.changes.changed().await.is_err() {
            std::future::pending::<()>().await;
        }
    }

    /// Tells those of everybody at each heartbeat and when they are to be told again, and else those that are not as they were.
    pub(super) fn tell(&mut self, face: &Face, again: bool) {
        let now = Instant::now();
        let again = again || self.told_at.is_none_or(|at| now >= at + face.config.heartbeat);
        let alarms = face.plant.alarms();
        let unix_ms = unix(now);
        let (held, looked_at): (Vec<_>, Vec<_>) =
            alarms.alarms.iter().partition(|alarm| may_have_a_cause(alarm, unix_ms));
        for alarm in looked_at.iter().filter(|alarm| self.is_news(alarm)) {
            tell_news(face, alarm);
        }
        let held: Vec<u64> = held.iter().map(|alarm| alarm.alarm.id).collect();
        self.known.retain(|id, _| held.contains(id));
        self.known.extend(looked_at.into_iter().map(Known::of));
        let dropped = alarms.dropped;
        let mut together = alarms.together();
        for owner in owners(face) {
            together.entry(owner).or_default();
        }
        for (owner, own) in &together {
            if again || self.told.get(owner) != Some(own) {
                let mut told = json!(own);
                told["time_unix_ms"] = unix(now).into();
                if *owner == Owner::Program {
                    told["dropped"] = dropped.into();
                }
                face.tell(face.topics.alarms(owner), told.to_string());
            }
        }
        // A line is taken back here; a drive with everything else of it.
        for line in
            self.told.keys().filter(|owner| matches!(owner, Owner::Line(_)) && !together.contains_key(owner))
        {
            face.tell_for_good(face.topics.alarms(line), "");
        }
        if again {
            self.told_at = Some(now);
        }
        self.told = together;
    }

    /// Whether somebody is to be told of its coming: not for what follows from another alarm, before it is one of its own, and not for
    /// what somebody has put aside.
    fn is_news(&self, alarm: &AlarmView) -> bool {
        if matches!(alarm.state, AlarmState::Suppressed | AlarmState::Shelved | AlarmState::Gone) {
            return false;
        }
        match self.known.get(&alarm.alarm.id) {
            None => true,
            Some(known) => {
                alarm.alarm.count > known.count
                    || known.is_suppressed && alarm.state == AlarmState::Unacknowledged
            }
        }
    }
}

impl Known {
    fn of(alarm: &AlarmView) -> (u64, Self) {
        let is_suppressed = alarm.state == AlarmState::Suppressed;
        (alarm.alarm.id, Self { count: alarm.alarm.count, is_suppressed })
    }
}

/// Whether it may turn out in a moment that an alarm follows from another: the drives of a dead line are lost one after the other, and
/// that the line is dead is known with the last of them. That a motor may turn is told at once.
fn may_have_a_cause(alarm: &AlarmView, now_unix_ms: u64) -> bool {
    let is_lost = alarm.alarm.kind == AlarmKind::Drive(ConcernKind::Lost);
    let age = Duration::from_millis(now_unix_ms.saturating_sub(alarm.alarm.last_unix_ms));
    is_lost && alarm.state == AlarmState::Unacknowledged && age < CAUSE_WITHIN
}

/// Everybody who can have alarms.
fn owners(face: &Face) -> Vec<Owner> {
    let fleet = face.plant.fleet();
    let lines = fleet.lines().into_iter().map(|(name, _)| Owner::Line(name.to_string()));
    lines.chain(fleet.drives().iter().map(|drive| Owner::Drive(drive.name().to_string()))).collect()
}

fn tell_news(face: &Face, alarm: &AlarmView) {
    let mut told = json!(alarm);
    told["time_unix_ms"] = unix(Instant::now()).into();
    let mut message = Message::new(face.topics.alarm(&Owner::of(alarm)), told.to_string());
    message.expires = Some(Instant::now() + NEWS_FOR);
    face.broker.publish(message, Kept::InOrder);
}
