//! How an alarm comes, returns, and is over.

use super::{
    Alarms, GONE_AFTER, LONGEST_NOTE, LONGEST_SHELF, RETURNED,
    alarm::{Alarm, AlarmChange, Became},
    fold,
    look::{Because, Condition, Look, milliseconds},
};

impl Alarms {
    /// Looks at some drives, lines, or the program. What is not among them is as it was.
    pub fn look(&mut self, looks: &[Look], now_unix_ms: u64) -> Vec<AlarmChange> {
        let mut changes = Vec::new();
        for look in looks {
            for condition in &look.there {
                self.comes(look, condition, now_unix_ms, &mut changes);
            }
            self.returns(look, now_unix_ms, &mut changes);
        }
        self.end_shelves(now_unix_ms, &mut changes);
        // Nothing else makes a cause or ends one.
        if changes.iter().any(|change| change.became != Became::Explained) {
            self.fold(&mut changes);
            self.drop_oldest(&mut changes);
            self.alarms.retain(|alarm| !alarm.is_over);
        }
        changes
    }

    /// Looks at all lines and at the program, and notes which drives there are: whoever is not there is gone after a while. Drives are
    /// looked at before their lines, which come back with them.
    pub fn look_at_all(
        &mut self,
        looks: &[Look],
        is_drive: impl Fn(&str) -> bool,
        now_unix_ms: u64,
    ) -> Vec<AlarmChange> {
        let mut changes = self.look(looks, now_unix_ms);
        let is_there = |drive: Option<&str>, line: Option<&str>| match drive {
            Some(drive) => is_drive(drive),
            None => looks.iter().any(|look| look.drive.is_none() && look.line.as_deref() == line),
        };
        self.missing.retain(|(drive, line), _| !is_there(drive.as_deref(), line.as_deref()));
        let mut has_gone = false;
        for alarm in self.alarms.iter_mut().filter(|alarm| !alarm.gone) {
            if is_there(alarm.drive.as_deref(), alarm.line.as_deref()) {
                continue;
            }
            let whose = (alarm.drive.clone(), alarm.line.clone().filter(|_| alarm.drive.is_none()));
            // A clock that was set back does not make it longer.
            let since = self.missing.entry(whose).or_insert(now_unix_ms);
            *since = (*since).min(now_unix_ms);
            if now_unix_ms - *since < GONE_AFTER {
                continue;
            }
            has_gone = true;
            alarm.gone = true;
            alarm.returned_unix_ms.get_or_insert(now_unix_ms);
            (alarm.acknowledged, alarm.shelved, alarm.suppressed_by) = (None, None, None);
            changes.push(told(Became::Gone, alarm));
        }
        if has_gone {
            self.fold(&mut changes);
        }
        changes
    }

    fn comes(&mut self, look: &Look, condition: &Condition, now: u64, changes: &mut Vec<AlarmChange>) {
        let Condition { kind, mark, since_unix_ms, .. } = condition;
        let since = since_unix_ms.unwrap_or(now).min(now);
        let detail = condition.detail.as_deref().map(bounded);
        let remedy = condition.remedy.as_deref().map_or_else(|| kind.remedy().to_owned(), bounded);
        let is_same = |alarm: &&mut Alarm| is_of(alarm, look) && alarm.kind == *kind && alarm.mark == *mark;
        let Some(alarm) = self.alarms.iter_mut().find(is_same) else {
            // Above all that there were, also where the file was lost.
            self.last_id = (self.last_id + 1).max(now);
            let alarm = Alarm {
                id: self.last_id,
                kind: *kind,
                drive: look.drive.clone(),
                line: look.line.clone(),
                mark: mark.clone(),
                detail,
                faults: condition.faults.clone(),
                remedy,
                first_unix_ms: since,
                last_unix_ms: since,
                count: 1,
                returned_unix_ms: None,
                gone: false,
                acknowledged: None,
                shelved: None,
                suppressed_by: None,
                ending_unix_ms: None,
                because: condition.because.clone(),
                is_over: false,
            };
            changes.push(told(Became::Came, &alarm));
            self.alarms.push(alarm);
            return;
        };
        alarm.line.clone_from(&look.line);
        alarm.ending_unix_ms = None;
        let is_new = !alarm.is_active();
        let is_as_told = match &condition.because {
            None => false,
            Some(Because::NotAsked) => alarm.detail.is_some(),
            because => *because == alarm.because,
        };
        let stands = !is_new && is_as_told;
        // It came while the clock was ahead, and that was set right: it has stood since, and not from a time to come on.
        let is_ahead = !is_new && alarm.last_unix_ms > now;
        if is_ahead {
            alarm.last_unix_ms = since;
            alarm.first_unix_ms = alarm.first_unix_ms.min(since);
        }
        let is_explained = is_ahead || !stands && alarm.detail != detail || alarm.remedy != remedy;
        alarm.remedy = remedy;
        if !stands {
            (alarm.detail, alarm.because) = (detail, condition.because.clone());
        }
        // Somebody has taken note of the fault that was there, or put that aside, and of no other.
        let before = !alarm.faults.is_empty();
        let is_another = before && condition.faults.iter().any(|code| !alarm.faults.contains(code));
        if !condition.faults.is_empty() {
            alarm.faults.clone_from(&condition.faults);
        }
        if is_new || is_another {
            if is_another {
                alarm.shelved = None;
            }
            // Its trip may be older than the fault that stands in it now.
            again(alarm, if is_new { since } else { now });
            changes.push(told(Became::CameAgain, alarm));
        } else if is_explained {
            changes.push(told(Became::Explained, alarm));
        }
    }

    fn returns(&mut self, look: &Look, now: u64, changes: &mut Vec<AlarmChange>) {
        let is_there = |alarm: &Alarm| {
            look.there.iter().any(|there| there.kind == alarm.kind && there.mark == alarm.mark)
        };
        let ends = |alarm: &Alarm| {
            is_of(alarm, look) && alarm.is_active() && look.seen.contains(&alarm.kind) && !is_there(alarm)
        };
        let mut ending: Vec<&Alarm> = self.alarms.iter().filter(|alarm| ends(alarm)).collect();
        // What follows from others returns before them.
        ending.sort_by_key(|alarm| alarm.kind.is_cause());
        for id in ending.iter().map(|alarm| alarm.id).collect::<Vec<_>>() {
            let waits_for = self.members(id).any(Alarm::is_active);
            let is_part = self.get(id).is_some_and(|alarm| self.is_part_of_its_cause(alarm));
            let Some(alarm) = self.alarms.iter_mut().find(|alarm| alarm.id == id) else { continue };
            let since = alarm.ending_unix_ms.map_or(now, |since| since.min(now));
            alarm.ending_unix_ms = Some(since);
            if waits_for && now.saturating_sub(since) < fold::BACK_WITHIN {
                continue;
            }
            (alarm.returned_unix_ms, alarm.ending_unix_ms, alarm.suppressed_by) = (Some(now), None, None);
            alarm.is_over = alarm.shelved.is_none() && (alarm.acknowledged.is_some() || is_part);
            changes.push(told(if alarm.is_over { Became::Over } else { Became::Returned }, alarm));
        }
    }

    fn end_shelves(&mut self, now: u64, changes: &mut Vec<AlarmChange>) {
        // A clock that was set back does not make it longer.
        let is_over = |until: u64| until <= now || until > now + milliseconds(LONGEST_SHELF);
        for alarm in &mut self.alarms {
            if alarm.shelved.as_ref().is_some_and(|shelved| is_over(shelved.until_unix_ms)) {
                changes.push(unshelve(alarm));
            }
        }
    }

    /// Of those that have returned the newest are kept.
    fn drop_oldest(&mut self, changes: &mut Vec<AlarmChange>) {
        let has_returned = |alarm: &&mut Alarm| !alarm.is_active() && !alarm.is_over;
        let mut returned: Vec<&mut Alarm> = self.alarms.iter_mut().filter(has_returned).collect();
        let over = returned.len().saturating_sub(RETURNED);
        returned.sort_by_key(|alarm| (alarm.returned_unix_ms, alarm.id));
        for alarm in returned.into_iter().take(over) {
            alarm.is_over = true;
            self.dropped += 1;
            changes.push(told(Became::Dropped, alarm));
        }
    }
}

/// Takes an alarm back from where it was put aside: what is so then, or has come since, has to be acknowledged.
pub(super) fn unshelve(alarm: &mut Alarm) -> AlarmChange {
    alarm.shelved = None;
    if alarm.is_active() {
        alarm.acknowledged = None;
    }
    alarm.is_over = !alarm.is_active() && alarm.acknowledged.is_some();
    told(if alarm.is_over { Became::Over } else { Became::Unshelved }, alarm)
}

/// It has come once more, and has to be acknowledged anew.
pub(super) fn again(alarm: &mut Alarm, since: u64) {
    alarm.count = alarm.count.saturating_add(1);
    alarm.last_unix_ms = since;
    (alarm.returned_unix_ms, alarm.gone, alarm.acknowledged) = (None, false, None);
}

pub(super) fn told(became: Became, alarm: &Alarm) -> AlarmChange {
    AlarmChange { became, alarm: alarm.clone() }
}

/// A drive is the same on another line.
fn is_of(alarm: &Alarm, look: &Look) -> bool {
    alarm.drive == look.drive && (alarm.drive.is_some() || alarm.line == look.line)
}

fn bounded(text: &str) -> String {
    text.chars().take(LONGEST_NOTE).collect()
}
