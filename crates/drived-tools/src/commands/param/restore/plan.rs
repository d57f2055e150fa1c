//! What a restore would write, in which order, and what it leaves alone: decided before anything is written.

use drive_core::{
    Row,
    registers::{Change, Part, in_order},
};
use serde_json::{Value, json};

use crate::commands::param::file::{Backup, Entry};
use drived_words::{failure::Failure, output::Table, registers::range, way::Way};

/// What is to be done to one drive.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    /// Settings that the file has, in the order in which they are written, those of one step together.
    pub(super) steps: Vec<Vec<Wanted>>,
    /// What differs now, in that order. Writing some may change others, which are written again when their turn comes.
    pub(super) changes: Vec<Change>,
    /// What differs, or may, and is not written, with the reason.
    pub(super) skipped: Vec<(&'static Row, String)>,
    /// Of those the ones that nobody has left out: what the drive holds there is not known to be what the file has.
    pub(super) missing: Vec<&'static Row>,
    /// Settings of the drive that the file does not name: it was cut off, or has chosen ones.
    pub(super) not_in_file: Vec<&'static Row>,
    /// What the drive holds now.
    pub(super) way: Way,
}

/// A word that the file has for a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Wanted {
    pub(super) row: &'static Row,
    pub(super) word: u16,
}

impl Plan {
    /// How a drive that holds `now` comes to hold what the file says.
    pub(super) fn of(file: &Backup, now: &Backup, with_communication: bool) -> Result<Self, Failure> {
        let capabilities = file.head.family.capabilities();
        let (mut skipped, mut missing) = (Vec::new(), Vec::new());
        let words =
            now.entries.iter().filter_map(|entry| Some((entry.row.place(), *entry.held.as_ref().ok()?)));
        let way = Way::of(capabilities, words);
        let mut end = way.clone();
        for Entry { row, held } in &file.entries {
            if let (Part::Setting, Ok(word)) = (capabilities.restoring.part(row), held) {
                end.hold(row.place(), *word);
            }
        }
        for Entry { row, held } in &file.entries {
            let differs = held.as_ref().ok().copied() != now.word(row.place());
            let part = capabilities.restoring.part(row);
            let is_unread = held.is_err() || now.word(row.place()).is_none();
            let exceeds = if differs && part == Part::Setting { end.exceeds(row) } else { None };
            let why = match (part, held) {
                (Part::Rating | Part::Passing, _) => continue,
                (_, Err(why)) => format!("could not be read when it was kept: {why}"),
                (Part::Left(why) | Part::ByHand(why), Ok(_)) if differs => why.to_owned(),
                (Part::Communication, Ok(_)) if differs && !with_communication => {
                    "it changes the line itself: --with-communication writes it, last".to_owned()
                }
                (Part::Setting | Part::Communication, Ok(_)) if now.word(row.place()).is_none() => {
                    "the drive does not tell what it holds".to_owned()
                }
                (Part::Setting, Ok(_)) => match &exceeds {
                    Some(why) => format!("this drive cannot have it: {why}"),
                    None => continue,
                },
                _ => continue,
            };
            // Who leaves the line as it is, or sets at the drive what is only set there, has left it out himself.
            let cannot_be = is_unread || exceeds.is_some();
            if cannot_be && (part == Part::Setting || part == Part::Communication && with_communication) {
                missing.push(*row);
            }
            skipped.push((*row, why));
        }
        let wanted = |row: &'static Row| {
            let is_wanted = !skipped.iter().any(|(skipped, _)| skipped.place() == row.place());
            file.word(row.place()).filter(|_| is_wanted).map(|word| Wanted { row, word })
        };
        let is_line = |row: &&Row| capabilities.restoring.part(row) == Part::Communication;
        let steps = capabilities.restoring.steps(capabilities.rows).into_iter().map(|step| {
            let rows = step.into_iter().filter(|row| with_communication || !is_line(row));
            rows.filter_map(wanted).collect::<Vec<_>>()
        });
        let steps: Vec<Vec<Wanted>> = steps.filter(|step| !step.is_empty()).collect();
        let changes = in_steps(&steps, way.clone())?;
        for Change { row, wanted, .. } in &changes {
            if !row.range.allows(row.unit.number(*wanted)) {
                let shown = file.row(row);
                return Err(Failure::Input(format!(
                    "{} ({}): {} is not allowed, expected: {}",
                    row.code,
                    row.place(),
                    shown.show(*wanted),
                    range(&shown)
                )));
            }
        }
        let is_named = |row: &Row| file.entries.iter().any(|entry| entry.row.place() == row.place());
        let settings = now.entries.iter().map(|entry| entry.row);
        let not_in_file = settings
            .filter(|row| capabilities.restoring.part(row) == Part::Setting && !is_named(row))
            .collect();
        Ok(Self { steps, changes, skipped, missing, not_in_file, way })
    }

    /// What has to be set at the drive before anything is written: it would load other values over them.
    pub(super) fn by_hand(&self, file: &Backup, now: &Backup) -> Option<String> {
        let restoring = file.head.family.capabilities().restoring;
        self.skipped.iter().find_map(|(row, _)| {
            let Part::ByHand(why) = restoring.part(row) else { return None };
            let (was, is) = (file.word(row.place())?, now.word(row.place())?);
            Some(format!("{} was {} and is {}: {why}", row.code, file.text(row, was), now.text(row, is)))
        })
    }

    /// What would be written, and what not, as a person reads it.
    pub(super) fn table(&self, file: &Backup, now: &Backup) -> Table {
        let mut table = Table::new(["", "parameter", "now", "from the file", "what it is, and why here"]);
        for (index, Change { row, held, wanted }) in self.changes.iter().enumerate() {
            let why = file.head.family.capabilities().restoring.why(row.address);
            let name = why.map_or_else(|| row.name.to_owned(), |why| format!("{}: {why}", row.name));
            let later = file.head.family.capabilities().restoring.acts_later(row.address);
            let name = later.map_or_else(|| name.clone(), |needs| format!("{name}; {needs}"));
            table.row([
                (index + 1).to_string(),
                row.code.to_owned(),
                now.text(row, *held),
                file.text(row, *wanted),
                name,
            ]);
        }
        table
    }

    pub(super) fn json(&self, file: &Backup, now: &Backup) -> [(&'static str, Value); 3] {
        let changes = self.changes.iter().map(|Change { row, held, wanted }| {
            json!({
                "mnemonic": row.code,
                "address": row.address,
                "now": { "value": now.text(row, *held), "raw": held },
                "from_file": { "value": file.text(row, *wanted), "raw": wanted },
                "acts_later": file.head.family.capabilities().restoring.acts_later(row.address),
                "why_here": file.head.family.capabilities().restoring.why(row.address),
            })
        });
        let skipped = self.skipped.iter().map(|(row, why)| json!({ "mnemonic": row.code, "why": why }));
        let not_in_file = self.not_in_file.iter().map(|row| json!(row.code));
        [
            ("changes", changes.collect()),
            ("skipped", skipped.collect()),
            ("not_in_file", not_in_file.collect()),
        ]
    }
}

/// What is written, one after the other, so that what the manual wants to hold among values holds at every moment.
fn in_steps(steps: &[Vec<Wanted>], mut way: Way) -> Result<Vec<Change>, Failure> {
    let of_step = |step: &Vec<Wanted>, way: &Way| ordered(step, &|row| way.word(row.place()));
    let mut end = way.clone();
    let all: Vec<Change> = steps.iter().flat_map(|step| of_step(step, &way)).collect();
    all.iter().for_each(|change| end.hold(change.row.place(), change.wanted));
    let changed: Vec<u16> = all.iter().map(|change| change.row.address).collect();
    if let Some(why) = end.breaks(&changed) {
        let why = format!("the drive would be left with {why}: mend the file; nothing was written");
        return Err(Failure::Input(why));
    }
    let mut changes = Vec::new();
    for step in steps {
        let mut pending = of_step(step, &way);
        while let Some(change) = way.take(&mut pending) {
            way.hold(change.row.place(), change.wanted);
            changes.push(change);
        }
        if let Some(why) = pending.first().and_then(|change| way.would_break(change)) {
            let codes: Vec<&str> = pending.iter().map(|change| change.row.code).collect();
            return Err(Failure::Input(format!(
                "no order of {} keeps the drive from {why} on the way: set one of them to another value at the drive first; nothing was written",
                codes.join(", ")
            )));
        }
    }
    Ok(changes)
}

/// The changes of one step, in the order in which they are written where nothing else forbids it.
pub(super) fn ordered(step: &[Wanted], held: &dyn Fn(&Row) -> Option<u16>) -> Vec<Change> {
    let change = |Wanted { row, word }: &Wanted| Some(Change { row, held: held(row)?, wanted: *word });
    in_order(&step.iter().filter_map(change).collect::<Vec<_>>())
}
