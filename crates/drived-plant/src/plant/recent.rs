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
    views::{CommandView, HappenedView, NoticeView},
};

/// How many are kept.
const KEPT: usize = 500;
/// Of how many drives of a command the event stream tells at once: no revision is larger than what is kept of all.
const TOLD_AT_ONCE: usize = 256;

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

    /// Tells a command as it is now, where it was told so before.
    pub(super) fn tell_command(&self, command: &CommandView, before: Option<&CommandView>) {
        let before = before.and_then(|before| before.several.as_ref());
        self.note_last_commands(command, before);
        let brief = CommandView { several: None, ..command.clone() };
        let counts = |drives| command.several.as_ref().map(|several| several.counts(drives));
        let revision = match &command.several {
            Some(several) if several.count() > TOLD_AT_ONCE => {
                let news = several.news(before).take(TOLD_AT_ONCE).cloned().collect();
                self.revisions.push(Subject::Command, &CommandView { several: counts(news), ..brief.clone() })
            }
            _ => self.revisions.push(Subject::Command, command),
        };
        let brief = CommandView { status: None, several: counts(Vec::new()), ..brief };
        self.recent.keep(RecentView { revision, what: Happened::Command(Box::new(brief)) });
    }

    /// Tells what happened to a drive. What came of a command that has been told as such is not told twice.
    pub(super) fn tell_event(&self, event: Event) {
        if let EventKind::Command { command: Command::Start(_), commander, outcome, .. } = &event.kind
            && outcome.is_confirmed()
        {
            self.watched.started_by(&event.place, commander);
        }
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
                | Command::Configure(_)
        );
        let commanders = self.recent.commanders.lock().unwrap_or_else(PoisonError::into_inner);
        is_asked_for && commanders.contains(&**commander)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde_json::Value;

    use super::*;
    use crate::plant::{
        commands::OutcomeWord,
        revisions::{Next, data_of},
        testing::TestPlant,
        views::SeveralView,
    };

    fn command(drive: Option<String>, several: Option<SeveralView>) -> CommandView {
        let told = serde_json::json!({
            "id": "a", "drive": drive, "action": "stop", "command": "ramp stop", "caller": "local", "origin": "test",
            "outcome": "pending", "open": true, "time_unix_ms": 1,
        });
        CommandView { several, ..serde_json::from_value(told).unwrap() }
    }

    #[tokio::test(start_paused = true)]
    async fn of_very_many_drives_the_event_stream_tells_those_of_which_something_is_new() {
        let plant = TestPlant::of(1).await.plant;
        let drives = 2 * TOLD_AT_ONCE;
        let name = |number: usize| Some(format!("pump {number}"));
        let mut parts: Vec<_> = (0..drives).map(|number| Arc::new(command(name(number), None))).collect();
        let mut reader = plant.revisions().reader(None);
        let first = command(None, Some(SeveralView::of(&mut parts, |_| false)));
        plant.0.tell_command(&first, None);
        Arc::make_mut(&mut parts[7]).outcome = OutcomeWord::Confirmed;
        let second = command(None, Some(SeveralView::of(&mut parts, |_| false)));
        plant.0.tell_command(&second, Some(&first));
        let mut told = Vec::new();
        while told.len() < 2 {
            let Next::Frames(frames) = plant.revisions().next(&mut reader).await else { panic!("frames") };
            let commands = frames.iter().filter_map(|frame| data_of(frame, Subject::Command));
            told.extend(commands.map(|(_, data)| serde_json::from_slice::<Value>(data).unwrap()));
        }
        assert_eq!(told[0]["drives"].as_array().map(Vec::len), Some(TOLD_AT_ONCE));
        assert_eq!((&told[0]["pending"], &told[0]["confirmed"]), (&drives.into(), &0.into()));
        assert_eq!(told[1]["drives"].as_array().map(Vec::len), Some(1));
        assert_eq!(told[1]["drives"][0]["drive"], "pump 7");
        assert_eq!((&told[1]["pending"], &told[1]["confirmed"]), (&(drives - 1).into(), &1.into()));
    }
}
