//! The plant as it is told: the state once, then what the events change.

use std::{collections::VecDeque, time::Duration};

use tokio::time::Instant;

use super::{
    super::{drive::Drive, happening::Happening},
    Lines,
};
use drived_client::Heard;
use drived_plant::plant::{recent::RecentView, views::StateView};

/// How many things that happened are kept.
const KEPT: usize = 2_000;

/// A connection that is there and says nothing for so long is none: there is a sign of life each 5 s.
const SILENT_AFTER: Duration = Duration::from_secs(12);

/// Whether anybody is there who tells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in super::super) enum Connection {
    /// Not yet.
    Reading,
    Live,
    /// Not any more; it is tried again.
    Gone {
        since: Instant,
        why: String,
    },
}

/// What is known.
#[derive(Debug)]
pub(in super::super) struct Plant {
    /// Where it comes from, in words.
    pub(in super::super) source: String,
    pub(in super::super) connection: Connection,
    heard: Instant,
    /// In the order of the daemon.
    pub(in super::super) drives: Vec<Drive>,
    pub(in super::super) lines: Lines,
    /// The groups with their drives.
    pub(in super::super) groups: Vec<(String, Vec<String>)>,
    /// Whether the caller may stop motors.
    pub(in super::super) may_stop: bool,
    pub(in super::super) is_demo: bool,
    /// The newest last.
    pub(in super::super) happenings: VecDeque<Happening>,
}

impl Plant {
    pub(super) fn new(source: String, now: Instant) -> Self {
        Self {
            source,
            connection: Connection::Reading,
            heard: now,
            drives: Vec::new(),
            lines: Lines::new(),
            groups: Vec::new(),
            may_stop: true,
            is_demo: false,
            happenings: VecDeque::new(),
        }
    }

    pub(in super::super) fn drive(&self, name: &str) -> Option<&Drive> {
        self.drives.iter().find(|drive| drive.name() == name)
    }

    /// Whether what is told is told now.
    pub(in super::super) fn is_connected(&self) -> bool {
        self.connection == Connection::Live
    }

    /// How long nothing has been heard, where that is too long.
    pub(in super::super) fn silent_for(&self, now: Instant) -> Option<Duration> {
        let silent = now.saturating_duration_since(self.heard);
        (self.is_connected() && silent > SILENT_AFTER).then_some(silent)
    }

    pub(super) fn has(&self, group: &str, drive: &str) -> bool {
        let group = self.groups.iter().find(|(name, _)| name == group);
        group.is_some_and(|(_, drives)| drives.iter().any(|name| name == drive))
    }

    /// Begins anew with a whole state, and with what happened until then.
    pub(super) fn begin(
        &mut self,
        state: StateView,
        recent: &[RecentView],
        kept: Vec<Happening>,
        now: Instant,
    ) {
        self.connection = Connection::Live;
        self.heard = now;
        self.may_stop = state.daemon.rights.stop;
        self.is_demo = state.daemon.demo;
        self.drives = state.drives.into_iter().map(|drive| Drive::told(drive, now)).collect();
        self.lines = state.lines.into_iter().map(|line| (line.name.clone(), line)).collect();
        self.groups = state.groups.into_iter().map(|group| (group.name, group.drives)).collect();
        let told: VecDeque<_> = recent.iter().filter_map(|one| Happening::lately(&one.what)).collect();
        // A daemon that was started anew does not know what the one before it told.
        let oldest = told.front().map_or(u64::MAX, |one| one.unix_ms);
        self.happenings.retain(|one| one.unix_ms < oldest);
        // On opening nothing is known of before it either.
        if self.happenings.is_empty() {
            self.happenings.extend(kept.into_iter().filter(|one| one.unix_ms < oldest));
        }
        self.happenings.extend(told);
        self.trim();
    }

    pub(super) fn take(&mut self, heard: Heard, now: Instant) {
        self.heard = now;
        match heard {
            Heard::Drive(drive) => {
                let drive = Drive::told(*drive, now);
                match self.drives.iter_mut().find(|known| known.name() == drive.name()) {
                    Some(known) => *known = drive,
                    None => self.drives.push(drive),
                }
            }
            Heard::Line(line) => {
                self.lines.insert(line.name.clone(), *line);
            }
            Heard::Command(command) => self.add(Happening::commanded(&command)),
            Heard::Event(event) => self.add(Happening::happened(&event)),
            Heard::Reset | Heard::Other => {}
        }
    }

    fn add(&mut self, one: Happening) {
        match self.happenings.iter_mut().rev().find(|known| known.is_same(&one)) {
            Some(known) => *known = one,
            None => self.happenings.push_back(one),
        }
        self.trim();
    }

    pub(super) fn interrupted(&mut self, why: String, now: Instant) {
        match &mut self.connection {
            Connection::Gone { why: known, .. } => *known = why,
            _ => self.connection = Connection::Gone { since: now, why },
        }
    }

    fn trim(&mut self) {
        let more = self.happenings.len().saturating_sub(KEPT);
        self.happenings.drain(..more);
    }
}
