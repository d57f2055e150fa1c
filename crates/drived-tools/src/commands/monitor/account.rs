//! What became of a stop, counted until every drive is accounted for.

use std::sync::Arc;

use super::words;
use drived_plant::plant::{
    commands::{ActionWord, OutcomeWord},
    views::{CommandView, SeveralView},
};
use drived_words::logging::escaped;

/// Whose motors are to stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Stop {
    All,
    One(String),
}

/// One press of a stop key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Account {
    pub(super) number: u64,
    pub(super) stop: Stop,
    /// When it was pressed, on the wall's clock.
    pub(super) unix_ms: u64,
    pub(super) state: Sent,
}

/// How far it has come.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Sent {
    /// It has been given to so many drives as were known, and nobody has answered yet; so often in vain.
    Sending { drives: usize, failed: u32, why: String },
    /// The daemon has it since then, by its own clock, and said last so.
    Taken { count: Count, out_of_sight: Option<String>, arrived_unix_ms: u64 },
    /// It could not be given, or nobody knows what became of it.
    Failed(String),
}

/// Every drive once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Count {
    pub(super) confirmed: usize,
    pub(super) pending: usize,
    pub(super) not_reachable: usize,
    /// Drives that are only read.
    pub(super) refused: usize,
    pub(super) failed: usize,
    /// Those that are not confirmed, each with what is known of it.
    pub(super) left: Vec<(String, String)>,
    /// Whether anything may still change.
    pub(super) is_open: bool,
}

/// What the task that carries it out has to say.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Progress {
    /// Another try has failed, and it is tried again.
    Again(String),
    /// What the daemon answered.
    Answer(Arc<CommandView>),
    /// It cannot be asked what became of it for now.
    OutOfSight(String),
    Over(String),
}

impl Account {
    /// Takes what is told of it. `is_silent`: the one drive that is meant does not answer.
    pub(super) fn take(&mut self, progress: Progress, is_silent: bool) {
        match (progress, &mut self.state) {
            (Progress::Answer(answer), state) => {
                let (count, arrived_unix_ms) = (Count::of(&answer, is_silent), answer.time_unix_ms);
                *state = Sent::Taken { count, out_of_sight: None, arrived_unix_ms };
            }
            (Progress::Again(text), Sent::Sending { failed, why, .. }) => {
                *failed += 1;
                *why = text;
            }
            (Progress::OutOfSight(why), Sent::Taken { out_of_sight, .. }) => *out_of_sight = Some(why),
            (Progress::Again(_) | Progress::OutOfSight(_), _) => {}
            (Progress::Over(why), state) => *state = Sent::Failed(why),
        }
    }

    /// Whether it may still change.
    pub(super) const fn is_open(&self) -> bool {
        match &self.state {
            Sent::Sending { .. } => true,
            Sent::Taken { count, .. } => count.is_open,
            Sent::Failed(_) => false,
        }
    }

    /// Whether every motor that was meant is known to stand.
    pub(super) const fn is_done(&self) -> bool {
        matches!(
            &self.state,
            Sent::Taken { count: Count { is_open: false, not_reachable: 0, failed: 0, .. }, .. }
        )
    }

    /// Whether a motor that has confirmed it was started since.
    pub(super) fn is_over_by(&self, command: &CommandView) -> bool {
        let starts = command.action == ActionWord::Start && command.outcome == OutcomeWord::Confirmed;
        // One from before may be told behind it.
        let is_later = matches!(&self.state, Sent::Taken { arrived_unix_ms, .. } if command.time_unix_ms > *arrived_unix_ms);
        let its = |name: &str| match &self.stop {
            Stop::All => true,
            Stop::One(own) => own == name,
        };
        let several = command.several.iter().flat_map(|several| &several.drives);
        let mut names = several.filter_map(|one| one.drive.as_deref()).chain(command.drive.as_deref());
        starts && is_later && self.is_done() && names.any(its)
    }

    /// What is told of it: first what was done, then how it stands.
    pub(super) fn sentence(&self) -> String {
        let what = match &self.stop {
            Stop::All => "STOP ALL".to_owned(),
            Stop::One(name) => format!("STOP {name}"),
        };
        match &self.state {
            Sent::Sending { drives, failed: 0, .. } => {
                let drives = drived_words::output::counted(*drives, "drive", "drives");
                format!("{what}: given to {drives}, no answer yet")
            }
            Sent::Sending { failed, why, .. } => {
                format!("{what}: NOT SENT YET, tried {failed} times: {why}: use the emergency stop")
            }
            Sent::Taken { count, out_of_sight, .. } => {
                let sight = out_of_sight.as_ref().map(|why| format!("; out of sight: {why}"));
                format!("{what}: {}{}", count.sentence(), sight.unwrap_or_default())
            }
            Sent::Failed(why) => format!("{what}: NOT CONFIRMED: {why}: use the emergency stop"),
        }
    }

    /// Who is left, by name.
    pub(super) fn left(&self) -> String {
        let Sent::Taken { count, .. } = &self.state else { return String::new() };
        let mut kinds: Vec<(&str, Vec<&str>)> = Vec::new();
        for (name, what) in &count.left {
            match kinds.iter_mut().find(|(kind, _)| kind == what) {
                Some((_, names)) => names.push(name),
                None => kinds.push((what, vec![name])),
            }
        }
        let told = kinds.iter().map(|(kind, names)| format!("{kind}: {}", names.join(", ")));
        told.collect::<Vec<_>>().join("; ")
    }
}

impl Count {
    /// Counts what became of a stop of one drive, or of several.
    fn of(command: &CommandView, is_silent: bool) -> Self {
        let one;
        let several = match &command.several {
            Some(several) => several,
            None => {
                one = SeveralView::of(&mut [Arc::new(command.clone())], |_| is_silent);
                &one
            }
        };
        let SeveralView { drives, confirmed, pending, not_reachable, refused, failed } = several;
        let not_done = drives.iter().filter(|drive| drive.outcome != OutcomeWord::Confirmed);
        Self {
            confirmed: *confirmed,
            pending: *pending,
            not_reachable: *not_reachable,
            refused: *refused,
            failed: *failed,
            left: not_done.map(|drive| left(drive)).collect(),
            is_open: drives.iter().any(|drive| drive.outcome == OutcomeWord::Pending),
        }
    }

    fn sentence(&self) -> String {
        let Self { confirmed, pending, not_reachable, refused, failed, .. } = self;
        let always = format!("{confirmed} confirmed, {pending} pending, {not_reachable} not reachable");
        let some = [(*refused, "only read"), (*failed, "NOT CONFIRMED")];
        let some =
            some.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!(", {count} {what}"));
        some.fold(always, |text, more| text + &more)
    }
}

/// Who is left, and what is known of it.
fn left(command: &CommandView) -> (String, String) {
    let name = escaped(command.drive.as_deref().unwrap_or("the drive"));
    (name, words::outcome(command.outcome))
}
