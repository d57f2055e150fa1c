//! Carrying a restore out: one register after the other, each at standstill and read back. One that is refused is passed over, and
//! told; a drive that does not answer, or that runs, ends it.

use drive_core::{
    Row,
    registers::{Change, Part},
};

use super::plan::{Plan, Wanted, ordered};
use crate::commands::param::source::{Source, Unread, Unwritten};
use drived_words::{output::Progress, signals::Ending, way::Way};

/// What has been done.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Carried {
    /// What was written and read back.
    pub(super) written: Vec<Change>,
    /// What could not be written, or is not held though it was, with the reason.
    pub(super) refused: Vec<(&'static Row, String)>,
    /// What was not written because something before it was refused, or could not be restored at all.
    pub(super) held_back: Vec<&'static Row>,
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

    fn has_done(&self, row: &Row) -> bool {
        let mut done = self.written.iter().map(|change| change.row).chain(self.held_back.iter().copied());
        let mut refused = self.refused.iter();
        done.any(|done| done.place() == row.place())
            || refused.any(|(refused, _)| refused.place() == row.place())
    }
}

/// Writes what differs. What an earlier write has changed is seen, because each step is read before it is written.
pub(super) async fn carry(plan: &Plan, source: &mut Source, ending: &mut Ending) -> Carried {
    let rows: usize = plan.steps.iter().map(Vec::len).sum();
    let progress = Progress::of(format_args!("{}: restoring", source.name()), rows);
    let mut carrying = Carrying {
        source,
        ending,
        progress,
        way: plan.way.clone(),
        is_whole: plan.missing.is_empty(),
        carried: Carried::default(),
    };
    for step in &plan.steps {
        if let Err(stopped) = carrying.step(step).await {
            carrying.carried.stopped = Some(stopped);
            break;
        }
    }
    let mut carried = carrying.carried;
    if let Some(stopped) = &carried.stopped {
        let unknown = stopped.is_unknown.then_some(stopped.at.place());
        let rows = plan.changes.iter().map(|change| change.row);
        let left = rows.filter(|row| !carried.has_done(row) && Some(row.place()) != unknown);
        carried.left = left.collect();
    }
    carried
}

struct Carrying<'a> {
    source: &'a mut Source,
    ending: &'a mut Ending,
    progress: Progress,
    /// What the drive holds, as far as it is known.
    way: Way,
    /// Nothing of the file is missing before the first write.
    is_whole: bool,
    carried: Carried,
}

impl Carrying<'_> {
    async fn step(&mut self, step: &[Wanted]) -> Result<(), Stopped> {
        let mut readable = Vec::new();
        for wanted in step {
            self.progress.note(wanted.row.code);
            self.progress.step();
            match self.source.read(wanted.row).await {
                Ok(word) => {
                    self.way.hold(wanted.row.place(), word);
                    readable.push(*wanted);
                }
                Err(Unread::Refused(why)) => self.carried.refused.push((wanted.row, why)),
                Err(Unread::Silent(why)) => return Err(Stopped { at: wanted.row, why, is_unknown: false }),
            }
        }
        let mut pending = ordered(&readable, &|row| self.way.word(row.place()));
        if pending.iter().any(|change| !self.goes_on_behind_a_refusal(change.row)) {
            self.carried.held_back.extend(pending.drain(..).map(|change| change.row));
        }
        self.read_related(&pending).await?;
        while let Some(change) = self.way.take(&mut pending) {
            // One before it in this step may have been refused.
            match self.goes_on_behind_a_refusal(change.row) {
                true => self.write(change).await?,
                false => self.carried.held_back.push(change.row),
            }
        }
        for change in pending {
            let why = self.way.would_break(&change).unwrap_or_default();
            self.carried.refused.push((change.row, format!("not written, it would be {why}")));
        }
        Ok(())
    }

    /// Whether a register is written whatever was refused before it, or is missing: who then takes command has a drive that is not
    /// set up as the file says. Who commands, by which reference, and where the drive is found, stays as it is.
    fn goes_on_behind_a_refusal(&self, row: &Row) -> bool {
        let restoring = self.way.restoring();
        let is_line = restoring.part(row) == Part::Communication;
        let is_as_in_the_file = self.is_whole && self.carried.refused.is_empty();
        is_as_in_the_file || !(is_line || restoring.control.contains(&row.address))
    }

    /// What else has to do with these changes, which the file does not have, or an earlier write may have changed.
    async fn read_related(&mut self, pending: &[Change]) -> Result<(), Stopped> {
        let addresses: Vec<u16> = pending.iter().map(|change| change.row.address).collect();
        for row in self.way.related(&addresses) {
            match self.source.read(row).await {
                Ok(word) => self.way.hold(row.place(), word),
                // What the drive does not tell is compared with nothing.
                Err(Unread::Refused(_)) => self.way.forget(row.place()),
                Err(Unread::Silent(why)) => return Err(Stopped { at: row, why, is_unknown: false }),
            }
        }
        Ok(())
    }

    async fn write(&mut self, change: Change) -> Result<(), Stopped> {
        let stopped = |why, is_unknown| Stopped { at: change.row, why, is_unknown };
        let mut writing = std::pin::pin!(self.source.write(change.row, change.wanted));
        let (outcome, is_asked) = tokio::select! {
            biased;
            outcome = &mut writing => (outcome, false),
            // What is on the wire is waited for: whoever ends the program knows then what was written.
            () = self.ending.asked() => (writing.await, true),
        };
        match outcome {
            Ok(()) => {
                self.way.hold(change.row.place(), change.wanted);
                self.carried.written.push(change);
            }
            Err(Unwritten::Refused(why)) => self.carried.refused.push((change.row, why)),
            Err(Unwritten::ReadsBack(word)) => {
                self.way.hold(change.row.place(), word);
                let why = format!(
                    "it was written and reads back as {}: the drive has not taken {}",
                    self.way.text(change.row, word),
                    self.way.text(change.row, change.wanted)
                );
                self.carried.refused.push((change.row, why));
            }
            Err(Unwritten::NotNow(why)) => return Err(stopped(why, false)),
            Err(Unwritten::Unknown(why)) => return Err(stopped(why, true)),
        }
        match is_asked {
            true => Err(stopped("asked to end; this one is written".to_owned(), false)),
            false => Ok(()),
        }
    }
}
