//! Alarms as objects with a life, after ISA-18.2: [`Alarms`]. One source for every face: what troubles a drive
//! ([`ConcernKind`](crate::ConcernKind)), a line or the program becomes an alarm here and nowhere else.
//!
//! - An alarm is **over** when it is so no more *and* somebody has taken note of it. One that comes again before is the same alarm, with
//!   a higher count and to be acknowledged anew. One that is acknowledged and still so stays.
//! - **Nothing goes away because it is not seen.** A trip of a drive that does not answer stands until the drive is seen without it; a
//!   restart of the program ends nothing, for what it has not looked at yet it does not know.
//! - **A cause folds what follows from it**: a line whose port is away or on which nobody answers is one alarm, and the losses of its
//!   drives are suppressed by it. It stands until they are back, or for a minute after the first of them is; who is missing then is an
//!   alarm of his own. What has come and gone with its cause has none of its own to be acknowledged.
//! - **Shelving** is for a bounded time and ends by itself; what has come again meanwhile waits for that. An alarm about a motor that
//!   moves or may ([`AlarmKind::is_of_motion`]) cannot be shelved: nobody shall stand beside a machine whose alarm another has put
//!   aside. For the same reason such an alarm is never suppressed by one that is shelved, and who has acknowledged its cause before it
//!   came is told anew.
//! - A drive that is called otherwise keeps its alarms ([`rename`](Alarms::rename)). A drive or line that leaves the configuration leaves its alarms as **gone**, to be acknowledged once.
//! - Of alarms that have returned the newest 500 are kept; that older ones were dropped is counted and told. Those that are so are as
//!   many as there are drives and kinds.
//!
//! It has no clock and no task: time is an argument.

mod alarm;
mod fold;
mod life;
mod look;
mod table;
#[cfg(test)]
mod tests;
#[cfg(feature = "serde")]
mod view;

use std::{collections::BTreeMap, time::Duration};

#[cfg(feature = "serde")]
pub use self::view::AlarmView;
pub use self::{
    alarm::{Acknowledged, Alarm, AlarmChange, AlarmState, Became, Shelved},
    look::{Because, Condition, LineSeen, Look, Moment},
    table::AlarmKind,
};

/// So many alarms that have returned are kept.
const RETURNED: usize = 500;
/// So long a note or a reason may be, in characters; what is known of an alarm is cut there.
pub const LONGEST_NOTE: usize = 500;
/// The longest time for which an alarm is shelved.
pub const LONGEST_SHELF: Duration = Duration::from_secs(24 * 3_600);
/// A drive that is not configured for so long is gone. A reload takes one out and puts it in again.
const GONE_AFTER: u64 = 10_000;

/// All alarms of a plant.
///
/// ```
/// use std::collections::BTreeMap;
/// use drive_fleet::alarms::{AlarmKind, Alarms, Look};
///
/// // Of a drive it is `Look::at_drive`, of a line `Look::at_line`.
/// let full = BTreeMap::from([(AlarmKind::AuditLog, "no space left on device".to_owned())]);
/// let mut alarms = Alarms::default();
/// alarms.look(&[Look::at_program(&full, &BTreeMap::new())], 1_000);
/// let id = alarms.all()[0].id;
///
/// // It is over when it is so no more, and somebody has taken note of it: in either order.
/// alarms.acknowledge(id, "Anna", Some("disk ordered"), 2_000)?;
/// assert!(alarms.all()[0].is_active());
/// alarms.look(&[Look::at_program(&BTreeMap::new(), &BTreeMap::new())], 3_000);
/// assert!(alarms.all().is_empty());
/// # Ok::<(), drive_fleet::alarms::AlarmRefused>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Alarms {
    /// The number of the newest.
    last_id: u64,
    /// How many were dropped because there were too many.
    dropped: u64,
    /// In the order in which they came first.
    alarms: Vec<Alarm>,
    /// Since when somebody who has alarms is not configured.
    #[cfg_attr(feature = "serde", serde(skip))]
    missing: BTreeMap<(Option<String>, Option<String>), u64>,
}

/// Why nothing is done with an alarm.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AlarmRefused {
    /// There is none of this number, or it is over.
    #[error("there is no alarm {0}, or it is over")]
    NoSuchAlarm(u64),
    /// It is about a motor that moves, or may.
    #[error("an alarm about a motor that moves or may is not shelved: acknowledge it, and see to the motor")]
    OfMotion,
    /// It is not shelved without end.
    #[error("an alarm is shelved for 1 second to 24 hours")]
    Time,
    /// Nobody would know why.
    #[error("whoever shelves an alarm says why")]
    NoReason,
    /// What is noted is too long.
    #[error("a note has at most {LONGEST_NOTE} characters")]
    TooLong,
}

impl Alarms {
    /// All that are not over, in the order in which they came first.
    #[must_use]
    pub fn all(&self) -> &[Alarm] {
        &self.alarms
    }

    /// How many were dropped because there were too many.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// The one of a number.
    #[must_use]
    pub fn get(&self, id: u64) -> Option<&Alarm> {
        self.alarms.iter().find(|alarm| alarm.id == id)
    }

    /// Those that are suppressed by one.
    pub fn members(&self, id: u64) -> impl Iterator<Item = &Alarm> {
        self.alarms.iter().filter(move |alarm| alarm.suppressed_by == Some(id))
    }

    /// Why an alarm cannot be shelved; `None`: it can be.
    #[must_use]
    pub fn shelving_refused(&self, alarm: &Alarm) -> Option<AlarmRefused> {
        let of_motion = |alarm: &Alarm| alarm.kind.is_of_motion() && alarm.is_active();
        let is_refused = alarm.kind.is_of_motion() || self.members(alarm.id).any(of_motion);
        is_refused.then_some(AlarmRefused::OfMotion)
    }

    /// Somebody takes note of an alarm. Nothing changes where somebody has: the first note stays.
    ///
    /// # Errors
    /// There is none of this number, or the note is too long.
    pub fn acknowledge(
        &mut self,
        id: u64,
        by: &str,
        note: Option<&str>,
        now_unix_ms: u64,
    ) -> Result<Vec<AlarmChange>, AlarmRefused> {
        if note.is_some_and(|note| note.chars().count() > LONGEST_NOTE) {
            return Err(AlarmRefused::TooLong);
        }
        let alarm = self.get_mut(id)?;
        if alarm.acknowledged.is_some() && !alarm.gone {
            return Ok(Vec::new());
        }
        let note = note.filter(|note| !note.trim().is_empty()).map(str::to_owned);
        alarm.acknowledged = Some(Acknowledged { by: by.to_owned(), unix_ms: now_unix_ms, note });
        let is_over = !alarm.is_active() && alarm.shelved.is_none();
        alarm.is_over = is_over;
        let told = alarm.clone();
        self.alarms.retain(|alarm| !alarm.is_over);
        Ok(vec![AlarmChange {
            became: if is_over { Became::Over } else { Became::Acknowledged },
            alarm: told,
        }])
    }

    /// Somebody puts an alarm aside for a time; one that is shelved already gets this time and reason.
    ///
    /// # Errors
    /// There is none of this number, it is [of motion](AlarmKind::is_of_motion) or stands for one that is, the time is not from 1 s to
    /// [`LONGEST_SHELF`], or the reason is missing or too long.
    pub fn shelve(
        &mut self,
        id: u64,
        by: &str,
        why: &str,
        time: Duration,
        now_unix_ms: u64,
    ) -> Result<Vec<AlarmChange>, AlarmRefused> {
        if time < Duration::from_secs(1) || time > LONGEST_SHELF {
            return Err(AlarmRefused::Time);
        }
        if why.trim().is_empty() {
            return Err(AlarmRefused::NoReason);
        }
        if why.chars().count() > LONGEST_NOTE {
            return Err(AlarmRefused::TooLong);
        }
        let refused = self.get(id).and_then(|alarm| self.shelving_refused(alarm));
        let alarm = self.get_mut(id)?;
        if let Some(refused) = refused {
            return Err(refused);
        }
        let until_unix_ms = now_unix_ms + look::milliseconds(time);
        alarm.shelved =
            Some(Shelved { by: by.to_owned(), unix_ms: now_unix_ms, until_unix_ms, why: why.to_owned() });
        Ok(vec![AlarmChange { became: Became::Shelved, alarm: alarm.clone() }])
    }

    /// Somebody takes an alarm back from where it was put aside. Nothing changes where it was not.
    ///
    /// # Errors
    /// There is none of this number.
    pub fn unshelve(&mut self, id: u64) -> Result<Vec<AlarmChange>, AlarmRefused> {
        let alarm = self.get_mut(id)?;
        if alarm.shelved.is_none() {
            return Ok(Vec::new());
        }
        let change = life::unshelve(alarm);
        self.alarms.retain(|alarm| !alarm.is_over);
        Ok(vec![change])
    }

    /// A drive is called otherwise: its alarms are the same, and go with it. What was seen of it by the new name alone is the same once
    /// more.
    pub fn rename(&mut self, old: &str, new: &str) {
        let of_old: Vec<AlarmKind> = self.of_drive(old).map(|alarm| alarm.kind).collect();
        let is_twice = |alarm: &Alarm| alarm.drive.as_deref() == Some(new) && of_old.contains(&alarm.kind);
        self.alarms.retain(|alarm| !is_twice(alarm));
        for alarm in self.alarms.iter_mut().filter(|alarm| alarm.drive.as_deref() == Some(old)) {
            alarm.drive = Some(new.to_owned());
        }
    }

    /// Each drive is called now as this says of its name of before, all at once, for two may have exchanged their names.
    pub fn rename_all(&mut self, names: &BTreeMap<String, String>) {
        let renamed = |alarm: &Alarm| names.get(alarm.drive.as_deref()?).cloned();
        let (moved, mut stay): (Vec<Alarm>, Vec<Alarm>) =
            self.alarms.drain(..).partition(|alarm| renamed(alarm).is_some());
        let moved: Vec<Alarm> =
            moved.into_iter().map(|alarm| Alarm { drive: renamed(&alarm), ..alarm }).collect();
        let is_same = |one: &Alarm, other: &Alarm| {
            one.drive.is_some()
                && (&one.drive, one.kind, &one.mark) == (&other.drive, other.kind, &other.mark)
        };
        stay.retain(|alarm| !moved.iter().any(|other| is_same(alarm, other)));
        self.alarms = moved;
        self.alarms.append(&mut stay);
        self.alarms.sort_by_key(|alarm| alarm.id);
    }

    fn of_drive<'a>(&'a self, drive: &'a str) -> impl Iterator<Item = &'a Alarm> {
        self.alarms.iter().filter(move |alarm| alarm.drive.as_deref() == Some(drive))
    }

    fn get_mut(&mut self, id: u64) -> Result<&mut Alarm, AlarmRefused> {
        self.alarms.iter_mut().find(|alarm| alarm.id == id).ok_or(AlarmRefused::NoSuchAlarm(id))
    }
}
