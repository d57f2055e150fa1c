//! Carrying a restore out: one register after the other, each at standstill and read back, up to the first that cannot be.

use drive_core::{Row, registers::Change};

use super::plan::{Plan, ordered};
use crate::commands::param::source::{Source, Unread, Unwritten};
use drived_words::{output::Progress, signals::Ending};

/// What has been done.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Carried {
    /// What was written and read back.
    pub(super) written: Vec<Change>,
    /// Why it ended before all was done.
    pub(super) stopped: Option<Stopped>,
    /// What differed at the beginning and has not been written.
    pub(super) left: Vec<&'static Row>,
}

/// Why a restore ended early.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stopped {
    /// At which register.
    pub(super) at: &'static Row,
    pub(super) why: String,
    /// Nobody knows whether it has been written.
    pub(super) is_unknown: bool,
}

impl Carried {
    /// How many of the writes went to EEPROM each, or are to be taken for that.
    pub(super) fn eeprom_writes(&self) -> usize {
        self.written.iter().filter(|change| change.row.storage.may_wear()).count()
    }
}

/// Writes what differs. What an earlier write has changed is seen, because each step is read before it is written.
pub(super) async fn carry(plan: &Plan, source: &mut Source, ending: &mut Ending) -> Carried {
    let mut carried = Carried::default();
    let rows: usize = plan.steps.iter().map(Vec::len).sum();
    let mut progress = Progress::of(format_args!("{}: restoring", source.name()), rows);
    for step in &plan.steps {
        if let Err(stopped) = carry_step(step, source, ending, &mut progress, &mut carried.written).await {
            carried.stopped = Some(stopped);
            break;
        }
    }
    if let Some(stopped) = &carried.stopped {
        let is_done = |row: &Row| carried.written.iter().any(|done| done.row.address == row.address);
        let unknown = stopped.is_unknown.then_some(stopped.at.address);
        let rows = plan.changes.iter().map(|change| change.row);
        carried.left = rows.filter(|row| !is_done(row) && Some(row.address) != unknown).collect();
    }
    carried
}

async fn carry_step(
    step: &[super::plan::Wanted],
    source: &mut Source,
    ending: &mut Ending,
    progress: &mut Progress,
    written: &mut Vec<Change>,
) -> Result<(), Stopped> {
    let mut held = Vec::new();
    for wanted in step {
        progress.note(wanted.row.code);
        progress.step();
        let word = source.read(wanted.row).await.map_err(|unread| {
            let (Unread::Refused(why) | Unread::Silent(why)) = unread;
            Stopped { at: wanted.row, why, is_unknown: false }
        })?;
        held.push((wanted.row.address, word));
    }
    let held = |row: &Row| held.iter().find(|(address, _)| *address == row.address).map(|(_, word)| *word);
    for change in ordered(step, &held) {
        let stopped = |why, is_unknown| Stopped { at: change.row, why, is_unknown };
        let mut writing = std::pin::pin!(source.write(change.row, change.wanted));
        let (outcome, is_asked) = tokio::select! {
            biased;
            outcome = &mut writing => (outcome, false),
            // What is on the wire is waited for: whoever ends the program knows then what was written.
            () = ending.asked() => (writing.await, true),
        };
        match outcome {
            Ok(()) => written.push(change),
            Err(Unwritten::Refused(why)) => return Err(stopped(why, false)),
            Err(Unwritten::Unknown(why)) => return Err(stopped(why, true)),
        }
        if is_asked {
            return Err(stopped("asked to end; this one is written".to_owned(), false));
        }
    }
    Ok(())
}
