//! When the alarms are looked for: at a drive whenever its snapshot has changed, at the lines and at the program once a second.

use std::{collections::BTreeSet, sync::Arc, time::Duration};

use drive_bus::Line;
use drive_fleet::{
    DriveHandle, Snapshot,
    alarms::{AlarmKind, LineSeen, Look, Moment},
};
use tokio::time::Instant;

use super::super::{Inner, views::NoticeView};
use drived_words::json::unix;

/// How long a line has been heard before what it finds nothing of is not so: its evidence begins with the program.
const HEARD_FOR: Duration = Duration::from_secs(120);

fn now() -> Moment {
    let at = Instant::now();
    Moment { at, unix_ms: unix(at) }
}

impl Inner {
    /// Looks at a drive.
    pub(in crate::plant) fn look_for_alarms_of(&self, line: &str, snapshot: &Snapshot) {
        let now = now();
        self.look_for(&[Look::at_drive(line, snapshot, now)], now);
    }

    fn look_for(&self, looks: &[Look], now: Moment) {
        if *self.alarms.is_closed.borrow() {
            return;
        }
        let mut alarms = self.alarms.lock();
        let changes = alarms.look(looks, now.unix_ms);
        self.tell_alarms(&alarms, &changes);
    }

    /// Looks at what is to be seen to of a drive.
    pub(in crate::plant) fn look_for_maintenance(&self, line: &str, drive: &str, due: &[(String, String)]) {
        self.look_for(&[Look::at_maintenance(line, drive, due)], now());
    }

    /// Looks at the lines and at the program, and who is not there any more.
    pub(in crate::plant) fn look_for_alarms(&self) {
        if *self.alarms.is_closed.borrow() {
            return;
        }
        let (now, mut names) = (now(), BTreeSet::new());
        let mut looks = vec![Look::at_program(&self.alarms.wrong_with_program(), &self.alarms.left())];
        for (name, line) in self.fleet.lines() {
            let drives = self.fleet.drives_on(&name);
            let snapshots: Vec<Arc<Snapshot>> = drives.iter().map(DriveHandle::snapshot).collect();
            names.extend(snapshots.iter().map(|snapshot| Arc::clone(&snapshot.name)));
            looks.push(self.look_at_line(&name, &line, &snapshots, now));
        }
        let mut alarms = self.alarms.lock();
        let changes = alarms.look_at_all(&looks, |name| names.contains(name), now.unix_ms);
        self.tell_alarms(&alarms, &changes);
    }

    fn look_at_line(&self, name: &str, line: &Line, drives: &[Arc<Snapshot>], now: Moment) -> Look {
        let stats = line.stats();
        let findings = line.findings();
        let is_heard = now.at.saturating_duration_since(self.alarms.began) >= HEARD_FOR;
        let seen = LineSeen {
            away: stats.port_known_away().map(str::to_owned),
            findings: (is_heard || !findings.is_empty()).then_some(&*findings),
        };
        let drives: Vec<&Snapshot> = drives.iter().map(|drive| &**drive).collect();
        Look::at_line(name, &drives, &seen, now)
    }

    /// What happens to the program itself is an alarm until it is said to be well again.
    pub(in crate::plant) fn note_for_alarms(&self, notice: &NoticeView) {
        let kind = AlarmKind::of_word(&notice.event);
        let is_of_program = |kind: &AlarmKind| {
            use AlarmKind::{AuditLog, Certificate, History, Reload};
            matches!(kind, AuditLog | Certificate | History | Reload)
        };
        let Some(kind) = kind.filter(is_of_program) else { return };
        match notice.alarm {
            true => _ = self.alarms.wrong().insert(kind, notice.text.clone()),
            false => _ = self.alarms.wrong().remove(&kind),
        }
    }
}
