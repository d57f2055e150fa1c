//! What happened lately, for whoever opens a page afterwards: commands with what became of them, and events.

use std::{
    collections::{BTreeSet, VecDeque},
    sync::{Mutex, PoisonError},
};

use drive_core::Command;
use drive_fleet::{Event, EventKind, view::EventView};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    Inner,
    revisions::Subject,
    views::{CommandView, HappenedView, NoticeView, SeveralView},
};

/// How many are kept.
const KEPT: usize = 500;

/// The last events of a plant.
#[derive(Default)]
pub(super) struct Recent {
    entries: Mutex<VecDeque<RecentView>>,
    /// Those whose commands are told as such.
    commanders: Mutex<BTreeSet<String>>,
}

/// Something that happened, as the event stream told it last.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RecentView {
    /// By which revision.
    pub revision: u64,
    #[serde(flatten)]
    pub what: Happened,
}

/// What it was.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Happened {
    /// A command, without its drives where it was for several, and without what they showed: its own address has them.
    Command(Box<CommandView>),
    /// What happened to a drive.
    Event(Box<EventView>),
    /// What happened to the program itself; the event stream names it `event` too.
    Notice(NoticeView),
}

impl Recent {
    /// The newest last.
    pub(super) fn all(&self) -> Vec<RecentView> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }

    fn keep(&self, entry: RecentView) {
        let mut entries = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        let known = entries.iter_mut().rev().find(|known| known.what.is_same_command(&entry.what));
        if let Some(known) = known {
            *known = entry;
            return;
        }
        if entries.len() >= KEPT {
            entries.pop_front();
        }
        entries.push_back(entry);
    }
}

impl Happened {
    /// What happened to a drive or to the program; `None`: a command, which is told otherwise.
    pub fn event(&self) -> Option<HappenedView> {
        match self {
            Self::Command(_) => None,
            Self::Event(event) => Some(HappenedView {
                time_unix_ms: event.time_unix_ms,
                drive: Some(event.drive.to_string()),
                alarm: event.alarm,
                text: event.text.clone(),
            }),
            Self::Notice(notice) => Some(notice.clone().into()),
        }
    }

    fn is_same_command(&self, other: &Self) -> bool {
        matches!((self, other), (Self::Command(one), Self::Command(two))
            if (&one.id, one.time_unix_ms) == (&two.id, two.time_unix_ms))
    }
}

impl Inner {
    /// Somebody begins to command, whose commands are told by [`tell_command`](Self::tell_command).
    pub(super) fn note_commander(&self, name: &str) {
        let mut commanders = self.recent.commanders.lock().unwrap_or_else(PoisonError::into_inner);
        if !commanders.contains(name) {
            commanders.insert(name.to_owned());
        }
    }

    /// Tells a command as it is now.
    pub(super) fn tell_command(&self, command: &CommandView) {
        self.note_last_commands(command);
        let revision = self.revisions.push(Subject::Command, command);
        let several = command.several.as_ref();
        let several = several.map(|several| SeveralView { drives: Vec::new(), ..several.clone() });
        let brief = CommandView { status: None, several, ..command.clone() };
        self.recent.keep(RecentView { revision, what: Happened::Command(Box::new(brief)) });
    }

    /// Tells what happened to a drive. What came of a command that has been told as such is not told twice.
    pub(super) fn tell_event(&self, event: Event) {
        if !self.is_told_as_a_command(&event.kind) {
            let revision = self.revisions.push(Subject::Event, &event);
            self.recent
                .keep(RecentView { revision, what: Happened::Event(Box::new(EventView::from(&event))) });
        }
    }

    /// Tells what happened to the program itself.
    pub(super) fn tell_notice(&self, notice: NoticeView) {
        self.note_for_alarms(&notice);
        let revision = self.revisions.push(Subject::Event, &notice);
        self.recent.keep(RecentView { revision, what: Happened::Notice(notice) });
    }

    fn is_told_as_a_command(&self, kind: &EventKind) -> bool {
        let EventKind::Command { command, commander, .. } = kind else { return false };
        let is_asked_for = matches!(
            command,
            Command::Start(_)
                | Command::Stop(_)
                | Command::Setpoint(_)
                | Command::ResetFaults
                | Command::Release
                | Command::Persist
        );
        let commanders = self.recent.commanders.lock().unwrap_or_else(PoisonError::into_inner);
        is_asked_for && commanders.contains(&**commander)
    }
}
