//! The alarms of one drive, of one line itself, or of the program, together, as faces tell them that have a place for each: brokers.

use std::collections::BTreeMap;

use drive_fleet::{
    Severity,
    alarms::{AlarmState, AlarmView},
};
use serde::{Deserialize, Serialize};

use super::AlarmsView;

/// Whose alarms they are.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Owner {
    /// The program's own, and those of drives and lines that are gone.
    Program,
    /// A line's own; not those of its drives.
    Line(String),
    Drive(String),
}

/// All alarms of one owner.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnAlarms {
    /// Whether one is so that nobody has put aside.
    pub problem: bool,
    /// How many are so, whatever somebody has done about them.
    pub active: usize,
    /// Those that wait for somebody to take note of them, as often as each has come: what one acknowledges who has seen this.
    pub waiting: Vec<SeenAlarm>,
    /// All of them, the one that matters most first.
    pub alarms: Vec<AlarmView>,
}

/// An alarm as somebody has seen it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeenAlarm {
    pub id: u64,
    /// How often it had come: where it has come again since, nothing is done with it.
    pub count: u32,
}

impl Owner {
    pub fn of(alarm: &AlarmView) -> Self {
        match (&alarm.alarm.drive, &alarm.alarm.line) {
            _ if alarm.alarm.gone => Self::Program,
            (Some(drive), _) => Self::Drive(drive.clone()),
            (None, Some(line)) => Self::Line(line.clone()),
            (None, None) => Self::Program,
        }
    }
}

impl SeenAlarm {
    const fn of(alarm: &AlarmView) -> Self {
        Self { id: alarm.alarm.id, count: alarm.alarm.count }
    }
}

impl OwnAlarms {
    /// The one that matters most.
    pub fn first(&self) -> Option<&AlarmView> {
        self.alarms.first()
    }

    fn of(mut alarms: Vec<AlarmView>) -> Self {
        alarms.sort_by_key(rank);
        let is_shown = |alarm: &&AlarmView| alarm.alarm.is_active() && alarm.alarm.shelved.is_none();
        Self {
            problem: alarms.iter().any(|alarm| is_shown(&alarm)),
            active: alarms.iter().filter(|alarm| alarm.alarm.is_active()).count(),
            waiting: alarms.iter().filter(|alarm| alarm.state.waits()).map(SeenAlarm::of).collect(),
            alarms,
        }
    }
}

impl AlarmsView {
    /// The same by their owners. Who has none is not among them, but for the program.
    pub fn together(self) -> BTreeMap<Owner, OwnAlarms> {
        let mut by_owner = BTreeMap::from([(Owner::Program, Vec::new())]);
        for alarm in self.alarms {
            by_owner.entry(Owner::of(&alarm)).or_default().push(alarm);
        }
        by_owner.into_iter().map(|(owner, alarms)| (owner, OwnAlarms::of(alarms))).collect()
    }
}

/// What waits for somebody comes first, then what is so, then by how badly it troubles.
fn rank(alarm: &AlarmView) -> (bool, bool, bool, Severity, drive_fleet::alarms::AlarmKind, u64) {
    let is_aside = alarm.state == AlarmState::Shelved;
    let known = &alarm.alarm;
    (!alarm.state.waits(), is_aside, !known.is_active(), alarm.severity, known.kind, known.id)
}
