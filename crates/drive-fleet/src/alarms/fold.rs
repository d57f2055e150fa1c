//! Causes: which alarm stands for which others.

use std::collections::BTreeMap;

use super::{
    Alarms,
    alarm::{Alarm, AlarmChange, Became},
    life::{again, told},
    table::AlarmKind,
};

/// So long a cause stands after it is so no more, while some of what follows from it is still so: drives come back one by one.
pub(super) const BACK_WITHIN: u64 = 60_000;
/// What came not longer than this before its cause came by it: drives are missed one by one.
const CAME_BEFORE: u64 = 60_000;

impl Alarms {
    /// Finds the cause of each alarm.
    pub(super) fn fold(&mut self, changes: &mut Vec<AlarmChange>) {
        let causes = Causes::of(&self.alarms);
        for at in 0..self.alarms.len() {
            let alarm = &self.alarms[at];
            let cause = causes.cause_of(alarm);
            if !alarm.is_active() || alarm.is_over || cause == alarm.suppressed_by {
                continue;
            }
            let is_news = alarm.kind.is_of_motion() && alarm.acknowledged.is_none();
            let since = alarm.last_unix_ms;
            let alarm = &mut self.alarms[at];
            alarm.suppressed_by = cause;
            changes.push(told(if cause.is_some() { Became::Suppressed } else { Became::Released }, alarm));
            if is_news && let Some(cause) = cause {
                self.tell_anew(cause, since, changes);
            }
        }
    }

    /// Whether all that there is of an alarm came with its cause, so that who takes note of that one has taken note of it.
    pub(super) fn is_part_of_its_cause(&self, alarm: &Alarm) -> bool {
        let cause = alarm.suppressed_by.and_then(|id| self.get(id));
        cause.is_some_and(|cause| alarm.first_unix_ms.saturating_add(CAME_BEFORE) >= cause.last_unix_ms)
    }

    /// A motor that may turn has joined a cause: whoever has taken note of that did not know of it.
    fn tell_anew(&mut self, cause: u64, since: u64, changes: &mut Vec<AlarmChange>) {
        let acknowledged = |alarm: &&mut Alarm| alarm.id == cause && alarm.acknowledged.is_some();
        if let Some(alarm) = self.alarms.iter_mut().find(acknowledged) {
            again(alarm, since);
            changes.push(told(Became::CameAgain, alarm));
        }
    }
}

/// What stands for others now: at each line and at each drive, the worst first.
struct Causes(BTreeMap<Place, Vec<(AlarmKind, u64, bool)>>);

/// A line or a drive.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Line(Option<String>),
    Drive(Option<String>),
}

impl Causes {
    fn of(alarms: &[Alarm]) -> Self {
        let mut causes: BTreeMap<Place, Vec<_>> = BTreeMap::new();
        let is_cause = |alarm: &&Alarm| alarm.kind.is_cause() && alarm.is_active() && !alarm.is_over;
        for alarm in alarms.iter().filter(is_cause) {
            let place = match &alarm.drive {
                Some(_) => Place::Drive(alarm.drive.clone()),
                None => Place::Line(alarm.line.clone()),
            };
            causes.entry(place).or_default().push((alarm.kind, alarm.id, alarm.shelved.is_some()));
        }
        causes.values_mut().for_each(|causes| causes.sort());
        Self(causes)
    }

    /// The alarm that stands for this one: the worst of those from which it follows.
    fn cause_of(&self, alarm: &Alarm) -> Option<u64> {
        let places = [Place::Line(alarm.line.clone()), Place::Drive(alarm.drive.clone())];
        let mut near = places.iter().filter_map(|place| self.0.get(place)).flatten();
        let stands_for = |(kind, _, is_shelved): &&(AlarmKind, u64, bool)| {
            alarm.kind.follows_from(*kind) && !(alarm.kind.is_of_motion() && *is_shelved)
        };
        near.find(stands_for).map(|(_, id, _)| *id)
    }
}
