//! The alarms of a plant: looked for where its drives and lines are watched, changed by whoever may operate, told in the event stream
//! and kept beyond the life of the program. What is an alarm and what becomes of it is decided in [`drive_fleet::alarms`].

mod keep;
mod looks;
mod rights;
mod said;
#[cfg(test)]
mod tests;
mod together;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_fleet::{
    Place, RunRecord,
    alarms::{AlarmChange, AlarmKind, AlarmRefused, AlarmView, Alarms},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::{sync::watch, task::spawn_blocking, time::Instant};

pub use self::{
    keep::KeptAlarms,
    said::{AlarmDone, AlarmsAsked, AlarmsSaid},
    together::{OwnAlarms, Owner, SeenAlarm},
};
use super::{Inner, Plant, revisions::Subject};
use drived_config::{records::Records, rights::Caller};
use drived_words::json::unix;

/// The alarms as the plant has them.
pub(super) struct Desk {
    alarms: Mutex<Alarms>,
    /// What is wrong with the program itself, in words.
    wrong: Mutex<BTreeMap<AlarmKind, String>>,
    /// What is kept of the drives' runs and stops.
    runs: Option<Records<RunRecord>>,
    /// How often what is kept has changed.
    changed: watch::Sender<u64>,
    /// The program ends: what is seen from now on is its own doing.
    is_closed: watch::Sender<bool>,
    began: Instant,
}

/// All alarms.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AlarmsView {
    /// In the order in which they came first.
    pub alarms: Vec<AlarmView>,
    /// How many were dropped though nobody had acknowledged them, because there were too many.
    pub dropped: u64,
}

/// What is done with an alarm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AlarmAct {
    /// It is noted; with a count only if it has not come again since.
    Acknowledge { note: Option<String>, count: Option<u32> },
    /// It is put aside for a time.
    Shelve { time: Duration, why: String },
    /// It is put aside no more.
    Unshelve,
    /// What an alarm asks for was done: maintenance, which is counted anew from now on, or somebody has seen that a motor of which a run or a stop
    /// is left does not turn by it.
    Done { note: Option<String> },
}

/// Why nothing is done with an alarm.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AlarmRejected {
    #[error("{0} has no right to operate")]
    NoRight(String),
    #[error("the token {caller} is not for {of}")]
    OutOfScope { caller: String, of: String },
    #[error("it has come again since it was seen")]
    CameAgain,
    #[error("only maintenance, and what a run has left, is seen to by saying so, and this is neither")]
    NoMaintenance,
    #[error("no history is kept by this program, in which it would be kept")]
    NotKept,
    #[error(transparent)]
    Refused(#[from] AlarmRefused),
}

impl AlarmRejected {
    /// Why, in one word.
    pub const fn reason(&self) -> &'static str {
        match self {
            Self::NoRight(_) | Self::OutOfScope { .. } => "no_right",
            Self::CameAgain => "came_again",
            Self::Refused(AlarmRefused::NoSuchAlarm(_)) => "not_found",
            Self::Refused(AlarmRefused::OfMotion) => "of_motion",
            Self::NotKept => "not_kept",
            Self::NoMaintenance | Self::Refused(_) => "malformed",
        }
    }
}

impl Desk {
    pub(super) fn new(kept: &KeptAlarms) -> Self {
        Self {
            alarms: Mutex::new(kept.alarms.clone()),
            wrong: Mutex::default(),
            runs: kept.runs.clone(),
            changed: watch::Sender::new(0),
            is_closed: watch::Sender::new(false),
            began: Instant::now(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Alarms> {
        self.alarms.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wrong(&self) -> MutexGuard<'_, BTreeMap<AlarmKind, String>> {
        self.wrong.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The stops and the run commands that are nobody's.
    fn left(&self) -> BTreeMap<Place, (String, RunRecord)> {
        self.runs.as_ref().map(Records::left).unwrap_or_default()
    }

    /// What is wrong with the program itself, and what was lost of the runs and stops that were kept.
    fn wrong_with_program(&self) -> BTreeMap<AlarmKind, String> {
        let lost = self.runs.as_ref().and_then(Records::lost);
        let lost = lost.map(|lost| (AlarmKind::RecordsLost, lost));
        self.wrong().clone().into_iter().chain(lost).collect()
    }

    /// Somebody has seen to what was lost.
    fn see_to_lost(&self) {
        if let Some(runs) = self.runs.clone() {
            spawn_blocking(move || runs.see_to_lost());
        }
    }

    /// Somebody has seen to what is left at a place.
    fn forget_left(&self, place: &Place) {
        if let Some(runs) = self.runs.clone().filter(|runs| runs.forget(place)) {
            spawn_blocking(move || runs.write());
        }
    }
}

impl Plant {
    /// All alarms, as they are.
    pub fn alarms(&self) -> AlarmsView {
        let alarms = self.0.alarms.lock();
        let all = alarms.all().iter().map(|alarm| AlarmView::of(alarm, &alarms)).collect();
        AlarmsView { alarms: all, dropped: alarms.dropped() }
    }

    /// The alarm of a number.
    pub fn alarm(&self, id: u64) -> Option<AlarmView> {
        let alarms = self.0.alarms.lock();
        alarms.get(id).map(|alarm| AlarmView::of(alarm, &alarms))
    }

    /// Does this with an alarm, and gives it as it is then. What has been done already is done once more without a change.
    ///
    /// # Errors
    /// [`AlarmRejected`]: nothing was done.
    pub fn act_on_alarm(&self, caller: &Caller, id: u64, act: &AlarmAct) -> Result<AlarmView, AlarmRejected> {
        let groups = self.groups();
        let now = unix(Instant::now());
        // Told under the lock, so that every reader gets the changes in their order.
        let mut alarms = self.0.alarms.lock();
        let alarm = alarms.get(id).ok_or(AlarmRefused::NoSuchAlarm(id))?;
        rights::may(caller, alarm, &groups)?;
        let before = AlarmView::of(alarm, &alarms);
        let changes = match act {
            AlarmAct::Acknowledge { count: Some(count), .. } if *count != before.alarm.count => {
                return Err(AlarmRejected::CameAgain);
            }
            AlarmAct::Acknowledge { note, .. } => {
                alarms.acknowledge(id, &caller.name, note.as_deref(), now)?
            }
            AlarmAct::Shelve { time, why } => alarms.shelve(id, &caller.name, why, *time, now)?,
            AlarmAct::Unshelve => alarms.unshelve(id)?,
            AlarmAct::Done { note } if matches!(alarm.kind, AlarmKind::RunLeft | AlarmKind::StopLeft) => {
                let place = alarm.mark.as_deref().map(Place::from);
                let changes = alarms.acknowledge(id, &caller.name, note.as_deref(), now)?;
                place.iter().for_each(|place| self.0.alarms.forget_left(place));
                changes
            }
            AlarmAct::Done { note } if alarm.kind == AlarmKind::RecordsLost => {
                let changes = alarms.acknowledge(id, &caller.name, note.as_deref(), now)?;
                self.0.alarms.see_to_lost();
                changes
            }
            AlarmAct::Done { note } => {
                let (Some(drive), Some(part)) = (&alarm.drive, &alarm.mark) else {
                    return Err(AlarmRejected::NoMaintenance);
                };
                if alarm.kind != AlarmKind::Maintenance {
                    return Err(AlarmRejected::NoMaintenance);
                }
                let past = self.past().ok_or(AlarmRejected::NotKept)?;
                let done = (drive.clone(), part.clone());
                let changes = alarms.acknowledge(id, &caller.name, note.as_deref(), now)?;
                past.maintained(&done.0, &done.1, &caller.name, note.as_deref());
                changes
            }
        };
        self.0.tell_alarms(&alarms, &changes);
        let after = changes.last().map(|change| AlarmView::of(&change.alarm, &alarms));
        Ok(after.unwrap_or(before))
    }

    /// What is to be seen to of a drive after so many hours or starts, as whoever counts them says: what is due, each by its name and with why.
    /// What is not among it is due no more.
    pub fn tell_maintenance(&self, line: &str, drive: &str, due: &[(String, String)]) {
        self.0.look_for_maintenance(line, drive, due);
    }

    /// A drive is called otherwise.
    pub(super) fn rename_alarms(&self, old: &str, new: &str) {
        self.0.alarms.lock().rename(old, new);
        self.0.alarms.changed.send_modify(|times| *times += 1);
    }

    /// Ends the looking, for the program ends, and what is to be seen from now on is its own doing; what is kept is written.
    pub fn close_alarms(&self) {
        self.0.alarms.is_closed.send_replace(true);
    }

    /// A reader of how often the alarms have changed.
    pub fn alarm_changes(&self) -> watch::Receiver<u64> {
        self.0.alarms.changed.subscribe()
    }
}

impl Inner {
    /// Tells what has become of alarms, each as it is now, with the causes at the same lines: who follows from them has changed.
    fn tell_alarms(&self, alarms: &Alarms, changes: &[AlarmChange]) {
        if changes.is_empty() {
            return;
        }
        let latest: BTreeMap<u64, &AlarmChange> =
            changes.iter().map(|change| (change.alarm.id, change)).collect();
        for change in latest.values() {
            self.revisions.push(Subject::Alarm, &AlarmView::of(&change.alarm, alarms));
        }
        let lines: BTreeSet<&Option<String>> = latest.values().map(|change| &change.alarm.line).collect();
        let is_cause = |alarm: &&drive_fleet::alarms::Alarm| {
            alarm.drive.is_none()
                && alarm.line.is_some()
                && lines.contains(&alarm.line)
                && !latest.contains_key(&alarm.id)
        };
        for cause in alarms.all().iter().filter(is_cause) {
            self.revisions.push(Subject::Alarm, &AlarmView::of(cause, alarms));
        }
        self.alarms.changed.send_modify(|times| *times += 1);
    }
}
