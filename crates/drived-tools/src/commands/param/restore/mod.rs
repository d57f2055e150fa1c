//! `drived param restore`: what a file has kept goes back into a drive.

mod carry;
mod plan;

use std::path::{Path, PathBuf};

use drive_core::registers::{Change, Part, Restoring};
use serde_json::{Map, Value, json};

use self::{
    carry::{Carried, carry},
    plan::Plan,
};
use super::{
    diff::Comparison,
    file::Backup,
    source::{Source, SourceArgs},
};
use drived_file::ledger::LedgerArgs;
use drived_words::{failure::Failure, output, signals::Ending};

/// Put parameters from a file back into a drive, in the order that its manual wants; without --write it is only said what would
/// be written
///
/// Only what differs is written, each at standstill and read back. One that the drive refuses is passed over, and told with its
/// reason at the end (exit code 1), as is one that could not be read, when it was kept or now: it is named as missing, and not written.
/// Who commands the drive, and the line's own settings, stay as they are then, and nothing is saved. A drive that does
/// not answer, or that runs, ends it; running it again goes on from there. Limits that belong together (low speed, high speed,
/// highest frequency) are kept in their order at every moment of the way. Through the daemon it needs the right to change
/// parameters.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Files that drived param backup has kept, or a folder of them
    #[arg(value_name = "FILE|FOLDER", required = true)]
    files: Vec<PathBuf>,
    /// The drive, if it is not the one that the file names
    #[arg(long, value_name = "DRIVE")]
    to: Option<String>,
    /// Write
    #[arg(long)]
    write: bool,
    /// Then save the drive's parameters to its EEPROM, where they are kept in RAM until then
    #[arg(long, requires = "write")]
    save: bool,
    /// Write also address, speed and format of the line, last: the drive is not found where it was then
    #[arg(long)]
    with_communication: bool,
    /// Write the rest also where a macro configuration (CFG of an Altivar 312) is another one than in the file: it is only set at
    /// the drive, and puts the rest back when it is
    #[arg(long)]
    other_macro: bool,
    /// Write also to a drive of another model or rating of the same family
    #[arg(long)]
    other_model: bool,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    ledger: LedgerArgs,
}

/// What became of one file.
struct Told {
    text: Vec<String>,
    json: Map<String, Value>,
    /// Why it is not done, and whether the next file may be taken all the same.
    failure: Option<(Failure, bool)>,
}

pub(super) async fn run(args: Args) -> Result<(), Failure> {
    if let Some(path) = args.files.iter().find(|path| !path.exists()) {
        return Err(Failure::Input(format!(
            "{}: there is no such file or folder; a drive that is not the one of the file goes behind --to",
            path.display()
        )));
    }
    let files = files(&args.files)?;
    if args.to.is_some() && files.len() > 1 {
        return Err(Failure::Input(
            "--to is for one file: several go to the drives that they name".to_owned(),
        ));
    }
    // Whatever is wrong with a file is said before anything is written to any drive.
    let files = files.iter().map(|path| Ok((path, Backup::read(path)?)));
    let files: Vec<(&PathBuf, Backup)> = files.collect::<Result<_, Failure>>()?;
    let mut ending = Ending::listen()?;
    let mut told = Vec::new();
    let mut result = Ok(());
    for (path, file) in &files {
        let named = match &args.to {
            Some(word) => args.source.one(word).await,
            None => args.source.of_file(&file.head),
        };
        let mut source = args.source.open(&named?).await?;
        let one = restore(&args, path, file, &mut source, &mut ending).await;
        source.close().await;
        let Told { text, json, failure } = match one {
            Ok(one) => one,
            Err(failure) => {
                result = Err(failure);
                break;
            }
        };
        if !args.source.daemon.is_json() {
            text.iter().try_for_each(output::say)?;
        }
        told.push(Value::Object(json));
        // What one drive refuses keeps nobody from the next one.
        let goes_on = failure.as_ref().is_none_or(|(_, goes_on)| *goes_on);
        result = match (result, failure) {
            (Err(Failure::Drive(before)), Some((Failure::Drive(why), _))) => {
                Err(Failure::Drive(format!("{before}; {why}")))
            }
            (before, failure) => before.and(failure.map_or(Ok(()), |(failure, _)| Err(failure))),
        };
        if !goes_on {
            break;
        }
    }
    if args.source.daemon.is_json() {
        output::say_as_it_is(json!({ "restored": told }))?;
    }
    let left: Vec<_> = files.iter().skip(told.len()).map(|(_, file)| file.head.name.as_str()).collect();
    match result {
        Err(Failure::Drive(why)) if !left.is_empty() => {
            Err(Failure::Drive(format!("{why}; nothing was written to {}", left.join(", "))))
        }
        result => result,
    }
}

/// The files, those of a folder in the order of their names.
pub(super) fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let failed = |error: std::io::Error| Failure::Input(format!("{}: {error}", path.display()));
        let found = std::fs::read_dir(path).map_err(failed)?;
        let found = found.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>();
        let mut found = found.map_err(failed)?;
        found.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
        found.sort();
        if found.is_empty() {
            return Err(Failure::Input(format!("{} has no files *.toml", path.display())));
        }
        files.extend(found);
    }
    Ok(files)
}

async fn restore(
    args: &Args,
    path: &Path,
    file: &Backup,
    source: &mut Source,
    ending: &mut Ending,
) -> Result<Told, Failure> {
    let name = source.name();
    let (family, of) = (source.family()?, file.head.family);
    if family != of {
        return Err(Failure::Input(format!(
            "{}: the file is of the family {of}, and {name} is of {family}",
            path.display()
        )));
    }
    let now = source.keep().await?;
    // Of a drive that tells nothing it is not known that nothing differs.
    if let Some(why) = now.nothing_read() {
        let failure = Failure::Drive(format!("{name}: {why}; nothing was written"));
        let json = json!({ "drive": name, "file": path, "error": failure.to_string() });
        let Value::Object(json) = json else { return Err(failure) };
        return Ok(Told { text: Vec::new(), json, failure: Some((failure, false)) });
    }
    let other = other_model(file, &now);
    let firmware = other_firmware(file, &now);
    if let Some(why) = other.as_ref().filter(|_| !args.other_model) {
        return Err(Failure::Input(format!(
            "{name} is another model than that of {}: {why}; --other-model writes all the same",
            path.display()
        )));
    }
    let plan = Plan::of(file, &now, args.with_communication).map_err(|failure| match failure {
        Failure::Input(why) => Failure::Input(format!("{}: {why}", path.display())),
        failure => failure,
    })?;
    let by_hand = plan.by_hand(file, &now);
    if let Some(why) = by_hand.as_ref().filter(|_| args.write && !args.other_macro) {
        return Err(Failure::Input(format!(
            "{name}: nothing was written: {why}; --other-macro writes the rest all the same"
        )));
    }
    let mut json = Map::new();
    json.insert("drive".to_owned(), json!(name));
    json.insert("file".to_owned(), json!(path));
    json.extend(plan.json(file, &now).map(|(key, value)| (key.to_owned(), value)));
    let mut text = Vec::new();
    if plan.changes.is_empty() && !plan.skipped.is_empty() {
        text.push(format!("{name}: nothing to write of what can be restored from {}", path.display()));
    } else if plan.changes.is_empty() {
        text.push(format!("{name}: nothing to write, it holds what {} has", path.display()));
    } else {
        let differ = output::counted(plan.changes.len(), "parameter differs", "parameters differ");
        text.push(format!("{name}: {differ} from {}", path.display()));
        text.push(plan.table(file, &now).on_terminal().to_string());
    }
    if !plan.not_in_file.is_empty() {
        let codes: Vec<_> = plan.not_in_file.iter().map(|row| row.code).collect();
        let named = output::counted(codes.len(), "setting that it has is", "settings that it has are");
        text.push(format!(
            "{name}: {named} not in {}, which was cut off or has chosen ones, and left as found: {}",
            path.display(),
            codes.join(", ")
        ));
    }
    json.insert("other_model".to_owned(), json!(other));
    json.insert("other_firmware".to_owned(), json!(firmware));
    text.extend(other.map(|why| format!("another model: {why}")));
    text.extend(
        firmware.map(|why| format!("another firmware: {why}: what this one does not know it refuses")),
    );
    text.extend(plan.skipped.iter().map(|(row, why)| format!("not written: {}: {why}", row.code)));
    text.extend(by_hand.map(|why| format!("before anything is written: {why}")));
    if !args.write {
        if !plan.changes.is_empty() {
            text.push("nothing has been written: --write does it, in this order".to_owned());
        }
        // Some of that order is held back then.
        if !plan.missing.is_empty() {
            let codes: Vec<_> = plan.missing.iter().map(|row| row.code).collect();
            text.push(format!("missing: {}: {HELD_BACK}", codes.join(", ")));
        }
        return Ok(Told { text, json, failure: None });
    }
    if !args.source.daemon.is_json() {
        text.drain(..).try_for_each(output::say)?;
    }
    source.ready_for_writing(&args.ledger).await?;
    let mut carried = carry(&plan, source, ending).await;
    let stopped = carried.stopped.as_ref().map(|stopped| stopped.in_words(&name, &carried));
    let mut failure = stopped.map(|why| (Failure::Drive(why), false));
    // The line itself may be another one then, and nobody answers where the drive was.
    let cuts = |change: &Change| of.capabilities().restoring.part(change.row) == Part::Communication;
    let is_cut = carried.written.iter().any(cuts);
    if failure.is_none() && !is_cut {
        let put_back = verify(file, source, args.with_communication, &plan, &mut carried).await;
        failure = put_back.map(|failure| (failure, false));
    }
    if failure.is_none() && !(carried.refused.is_empty() && plan.missing.is_empty()) {
        failure = Some((Failure::Drive(carried.refusals_in_words(&name, &plan.missing)), true));
    }
    let mut saved = false;
    if failure.is_none() {
        match keep(args, source, &carried).await {
            Ok((is_saved, how)) => {
                // What a cut of the supply has taken since it was read is not what was saved.
                let put_back = match is_saved && !is_cut {
                    true => verify(file, source, args.with_communication, &plan, &mut carried).await,
                    false => None,
                };
                saved = is_saved && put_back.is_none();
                text.extend(if put_back.is_none() { how } else { vec![NOT_SAVED.to_owned()] });
                failure = put_back.map(|failure| (failure, false));
            }
            Err(why) => {
                failure = Some((Failure::Drive(format!("all is written, and not saved: {why}")), false));
            }
        }
    } else if args.save {
        text.push(NOT_SAVED.to_owned());
    }
    if !carried.written.is_empty() {
        let written = output::counted(carried.written.len(), "parameter was", "parameters were");
        let others = carried.written.len() + carried.refused.len() + carried.held_back.len();
        let more = match plan.changes.len().saturating_sub(others) {
            by_itself @ 1.. if carried.stopped.is_none() => format!("; {by_itself} more came right by these"),
            _ => String::new(),
        };
        text.insert(0, format!("{name}: {written} written and read back{more}"));
    }
    let slave = source.slave();
    for (row, why) in &carried.refused {
        text.push(format!("refused: {name}, slave {slave}, {} ({}): {why}", row.code, row.place()));
    }
    if !carried.held_back.is_empty() {
        let codes: Vec<_> = carried.held_back.iter().map(|row| row.code).collect();
        text.push(format!("left as it was because of that: {}: {HELD_BACK}", codes.join(", ")));
    }
    text.extend(later(&of.capabilities().restoring, &carried));
    json.extend([
        ("written".to_owned(), carried.written.iter().map(|change| change.row.code).collect()),
        ("refused".to_owned(), carried.refused.iter().map(|refusal| refusal_json(slave, refusal)).collect()),
        ("held_back".to_owned(), carried.held_back.iter().map(|row| row.code).collect()),
        ("not_written".to_owned(), carried.left.iter().map(|row| row.code).collect()),
        ("unknown".to_owned(), json!(carried.unknown())),
        ("eeprom_writes".to_owned(), json!(carried.eeprom_writes())),
        ("saved".to_owned(), json!(saved)),
        ("error".to_owned(), json!(failure.as_ref().map(|(failure, _)| failure.to_string()))),
    ]);
    Ok(Told { text, json, failure })
}

const NOT_SAVED: &str =
    "nothing was saved to EEPROM: see what is missing, then drived param save keeps what was written";

const HELD_BACK: &str = "who commands, by which reference, and where the drive is found, is only changed when everything else is as in the file; set \
    what was refused or is missing, or take its line out of the file, and run it again";

fn refusal_json(slave: u8, (row, why): &(&'static drive_core::Row, String)) -> Value {
    json!({ "slave": slave, "mnemonic": row.code, "address": row.address, "why": why })
}

/// What has been written and does not act yet, by what it needs.
fn later(restoring: &Restoring, carried: &Carried) -> Vec<String> {
    let mut all: Vec<(&str, Vec<&str>)> = Vec::new();
    for Change { row, .. } in &carried.written {
        let Some(needs) = restoring.acts_later(row.address) else { continue };
        match all.iter_mut().find(|(known, _)| *known == needs) {
            Some((_, codes)) => codes.push(row.code),
            None => all.push((needs, vec![row.code])),
        }
    }
    all.into_iter().map(|(needs, codes)| format!("{}: {needs}", codes.join(", "))).collect()
}

/// In what the drive is another one than that of the file.
fn other_model(file: &Backup, now: &Backup) -> Option<String> {
    let restoring = file.head.family.capabilities().restoring;
    let mut ratings = file.entries.iter().filter(|entry| restoring.part(entry.row) == Part::Rating);
    let rating = ratings.find_map(|entry| {
        let (row, word) = (entry.row, *entry.held.as_ref().ok()?);
        let held = now.word(row.place()).filter(|held| *held != word)?;
        Some(format!("{} is {} and was {}", row.code, now.text(row, held), file.text(row, word)))
    });
    rating.or_else(|| match (&file.head.model, &now.head.model) {
        (Some(was), Some(is)) if was != is => {
            Some(format!("it says that it is {is}, and the file is of {was}"))
        }
        _ => None,
    })
}

/// Which other firmware the drive has than that of the file, where both say it.
fn other_firmware(file: &Backup, now: &Backup) -> Option<String> {
    let (was, is) = (file.head.firmware.as_ref()?, now.head.firmware.as_ref()?);
    (was != is).then(|| format!("the drive has {is}, and the file is of {was}"))
}

/// Reads everything again: what a later write has put back is no success.
async fn verify(
    file: &Backup,
    source: &mut Source,
    with_communication: bool,
    plan: &Plan,
    carried: &mut Carried,
) -> Option<Failure> {
    let unread = |why: String| Failure::Drive(format!("all is written, and not read once more: {why}"));
    let now = match source.keep().await {
        // What tells nothing any more has put nothing back.
        Ok(now) => match now.nothing_read() {
            Some(why) => return Some(unread(format!("{}: {why}", source.name()))),
            None => now,
        },
        Err(failure) => return Some(unread(failure.to_string())),
    };
    let differences = Comparison::of(file, &now, with_communication).differences;
    let is_skipped =
        |row: &drive_core::Row| plan.skipped.iter().any(|(skipped, _)| skipped.place() == row.place());
    let has = |row: &drive_core::Row| file.word(row.place()).is_some();
    let rows = differences.iter().map(|difference| difference.row);
    let is_told = |row: &drive_core::Row| {
        let refused = carried.refused.iter().map(|(row, _)| *row);
        refused.chain(carried.held_back.iter().copied()).any(|told| told.place() == row.place())
    };
    carried.left = rows.filter(|row| has(row) && !is_skipped(row) && !is_told(row)).collect();
    if carried.left.is_empty() {
        return None;
    }
    let codes: Vec<_> = carried.left.iter().map(|row| row.code).collect();
    Some(Failure::Drive(format!(
        "{}: all was written, and the drive has put back {}: run it again, or see what excludes them",
        source.name(),
        codes.join(", ")
    )))
}

/// Saves where that is asked for and is a step of its own, and says where the values are kept.
async fn keep(args: &Args, source: &mut Source, carried: &Carried) -> Result<(bool, Vec<String>), Failure> {
    let capabilities = source.family()?.capabilities();
    let written = carried.written.len();
    let Some(by) = capabilities.persist else {
        let writes = output::counted(carried.eeprom_writes(), "write", "writes");
        let text = format!("each write is kept by itself: {writes} to EEPROM, or to be taken for that");
        return Ok((false, if written > 0 || args.save { vec![text] } else { Vec::new() }));
    };
    if args.save {
        let told = source.save().await?;
        return Ok((true, vec![format!("saved to EEPROM by {by}{told}")]));
    }
    let mut text = "kept in RAM, lost at power-off: drived param save saves it, once".to_owned();
    if carried.eeprom_writes() > 0 {
        let writes = output::counted(carried.eeprom_writes(), "write", "writes");
        text.push_str(&format!("; {writes} may have gone to EEPROM by itself"));
    }
    Ok((false, if written > 0 { vec![text] } else { Vec::new() }))
}

impl Carried {
    /// What was refused, and what could not be restored, in a line; why stands with each.
    fn refusals_in_words(&self, name: &str, missing: &[&'static drive_core::Row]) -> String {
        let listed = |rows: &[&'static drive_core::Row]| {
            let codes: Vec<_> = rows.iter().map(|row| row.code).collect();
            codes.join(", ")
        };
        let refused: Vec<_> = self.refused.iter().map(|(row, _)| *row).collect();
        let mut parts = Vec::new();
        for (rows, what) in [(&*refused, "refused"), (missing, "not restored")] {
            if !rows.is_empty() {
                let counted = output::counted(rows.len(), "parameter was", "parameters were");
                parts.push(format!("{counted} {what}: {}", listed(rows)));
            }
        }
        parts.push(match &*self.held_back {
            [] => "the rest is as in the file".to_owned(),
            held_back => format!("left as it was because of that: {}", listed(held_back)),
        });
        format!("{name}: {}", parts.join("; "))
    }

    fn unknown(&self) -> Option<&'static str> {
        self.stopped.as_ref().filter(|stopped| stopped.is_unknown).map(|stopped| stopped.at.code)
    }
}

impl carry::Stopped {
    /// What has been done, what is unknown, what has not, and how to go on.
    fn in_words(&self, name: &str, carried: &Carried) -> String {
        let listed = |rows: &mut dyn Iterator<Item = &'static str>| {
            let codes: Vec<_> = rows.collect();
            if codes.is_empty() { "none".to_owned() } else { codes.join(", ") }
        };
        let written = listed(&mut carried.written.iter().map(|change| change.row.code));
        let left = listed(&mut carried.left.iter().map(|row| row.code));
        let refused = match carried.refused.is_empty() {
            true => String::new(),
            false => format!("; refused: {}", listed(&mut carried.refused.iter().map(|(row, _)| row.code))),
        };
        let unknown = match self.is_unknown {
            true => format!("; unknown whether written: {}", self.at.code),
            false => String::new(),
        };
        format!(
            "{name}: stopped at {}: {}; written: {written}{refused}{unknown}; not written: {left}; the same command goes on from here",
            self.at.code, self.why
        )
    }
}

#[cfg(test)]
mod tests;
