//! The registers of one drive on a line.

use drive_core::{Capabilities, Drive, ErrorKind, Row, Status, Written, registers::Storage};
use serde_json::json;

use super::shown::{find, value_cells, value_table};
use crate::one_drive::{OneDrive, OneDriveArgs};
use drived_client::own_line::told;
use drived_file::ledger::LedgerArgs;
use drived_plant::plant::parameters::{ParameterView, WrittenView};
use drived_words::{
    drive_spec::DriveName, failure::Failure, output, registers::wanted, signals::Ending, way::Way,
};

/// Reads registers.
pub(super) async fn get(args: &OneDriveArgs, registers: &[String]) -> Result<(), Failure> {
    let family = args.name()?.family;
    let rows = registers.iter().map(|text| find(family, text)).collect::<Result<Vec<_>, _>>()?;
    if let Some(row) = rows.iter().find(|row| !row.access.is_readable()) {
        return Err(Failure::Input(format!("{} ({}) can only be written", row.code, row.place())));
    }
    let mut one = args.open().await?;
    let mut read = Vec::new();
    for row in rows {
        let word = one.drive.read_parameter(row).await.map_err(|error| one.failure(&error))?;
        let row = in_units(&mut *one.drive, row).await.map_err(|error| one.failure(&error))?;
        read.push((row, Ok(word)));
    }
    say_values(args, one.drive.capabilities(), &read)?;
    one.close().await;
    Ok(())
}

/// Writes one register, reads it back, and saves it if that is wanted.
pub(super) async fn set(
    args: &OneDriveArgs,
    register: &str,
    value: &str,
    save: bool,
    ledger: &LedgerArgs,
) -> Result<(), Failure> {
    let name = args.name()?;
    let row = find(name.family, register)?;
    if save {
        let by = saving(name, "leave out --save")?;
        if row.storage == Storage::Volatile {
            return Err(Failure::Input(format!(
                "{name}: {} ({}) is kept in RAM only, {by} does not save it: leave out --save",
                row.code,
                row.place()
            )));
        }
    }
    let is_scaled = name.family.capabilities().scaled_by(row.address).is_some();
    if !is_scaled {
        wanted(row, value)?;
    }
    let mut one = args.open_to_write(ledger).await?;
    let shown = in_units(&mut *one.drive, row).await.map_err(|error| one.failure(&error))?;
    let word = wanted(&shown, value)?;
    let (written, running) = write(&mut one, row, word).await?;
    let what = if written.changed { "is now" } else { "was already" };
    let kept = match written.storage {
        Storage::Volatile => "kept in RAM, lost at power-off",
        Storage::RamUntilSaved if save => "kept in RAM until saved",
        Storage::RamUntilSaved => {
            "kept in RAM, lost at power-off unless the drive is told to save its parameters"
        }
        Storage::Eeprom => "kept in EEPROM",
        Storage::Unknown => "the manual does not say whether it is kept in RAM or EEPROM",
    };
    let later = name.family.capabilities().restoring.acts_later(row.address);
    let parameter = ParameterView::read(one.drive.capabilities(), &shown, word);
    let mut body = json!(WrittenView { parameter, changed: written.changed });
    body["acts_later"] = json!(later);
    let mut text = vec![format!("{} {} {what} {} ({kept})", one.name, row.code, shown.show(word))];
    text.extend(later.map(|needs| format!("{}: {needs}", row.code)));
    if let Some(status) = running {
        body["written_while"] = json!(status);
        text.push(moved(&status));
    }
    if save && written.storage == Storage::Eeprom {
        text.push("the write itself has stored it: nothing else was saved".to_owned());
    } else if save {
        match persist(&mut one).await {
            Ok((saves, told)) => {
                body["saves"] = json!(saves);
                text.push(told);
            }
            Err(failure) => {
                // What was written is told though it is not saved.
                args.daemon.say_done(&body, || text.iter().try_for_each(output::say))?;
                return Err(failure);
            }
        }
    }
    args.daemon.say_done(&body, || text.iter().try_for_each(output::say))?;
    one.close().await;
    Ok(())
}

/// Writes a register where the manual's rules let it; what a motor that is not at rest was seen to do before.
async fn write(
    one: &mut OneDrive,
    row: &'static Row,
    word: u16,
) -> Result<(Written, Option<Status>), Failure> {
    let capabilities = one.drive.capabilities();
    let mut way = Way::of(capabilities, std::iter::empty());
    for row in way.judged_by(&[(row, word)]) {
        if let Ok(word) = one.drive.read_parameter(row).await {
            way.hold(row.place(), word);
        }
    }
    if let Some(why) = way.refuses(&[(row, word)]) {
        return Err(Failure::Input(why));
    }
    let running = one.drive.status().await.ok().filter(|status| !status.is_undriven());
    let written = told(one.name, &mut Ending::listen()?, one.drive.write_parameter(row, word)).await?;
    one.count_of(row, &written);
    let written = written.map_err(|error| one.failure(&error))?;
    Ok((written, running.filter(|_| written.changed)))
}

/// What is told of a write to a motor that was not at rest.
pub(super) fn moved(before: &Status) -> String {
    format!(
        "the motor was not at rest: before it the drive showed {before}. It follows its limits and ramps at once"
    )
}

/// Saves the drive's parameters to its EEPROM.
pub(super) async fn save_all(args: &OneDriveArgs, ledger: &LedgerArgs) -> Result<(), Failure> {
    let name = args.name()?;
    saving(name, "each write says where its register is kept")?;
    let mut one = args.open_to_write(ledger).await?;
    let (saves, text) = persist(&mut one).await?;
    let body = json!({ "drive": name.to_string(), "action": "save", "outcome": "confirmed", "saves": saves });
    args.daemon.say_done(&body, || output::say(text))?;
    one.close().await;
    Ok(())
}

/// The command by which a family saves its parameters.
fn saving(name: DriveName, instead: &str) -> Result<&'static str, Failure> {
    let capabilities = name.family.capabilities();
    capabilities.persist.ok_or_else(|| {
        let family = capabilities.name;
        Failure::Input(format!("{name}: {family} has no command that saves its parameters: {instead}"))
    })
}

/// Saves whatever the drive keeps in RAM; tells how often it was done, and the same in words. What an earlier run of this program,
/// another one, or a hand at the panel has changed cannot be known here, and who asks for a save wants that kept too.
async fn persist(one: &mut OneDrive) -> Result<(u32, String), Failure> {
    let (name, by) = (one.name, saving(one.name, "")?);
    one.drive.assume_changed();
    let saves = told(name, &mut Ending::listen()?, one.drive.persist()).await?;
    one.count_save(&saves);
    let saves = saves.map_err(|error| one.failure(&error))?;
    let text = format!(
        "{name} has saved its parameters to EEPROM by {by}: all that it kept in RAM, not one alone; saves counted: {saves}"
    );
    Ok((saves, text))
}

/// Reads every register that can be read.
pub(super) async fn dump(args: &OneDriveArgs) -> Result<(), Failure> {
    let mut one = args.open().await?;
    let capabilities = one.drive.capabilities();
    let readable: Vec<&Row> = capabilities.rows.iter().filter(|row| row.access.is_readable()).collect();
    let mut progress = output::Progress::of(format_args!("reading {}", one.name), readable.len());
    let mut read = Vec::new();
    for row in readable {
        progress.step();
        read.push(match one.drive.read_parameter(row).await {
            Ok(word) => {
                let row = in_units(&mut *one.drive, row).await.map_err(|error| one.failure(&error))?;
                (row, Ok(word))
            }
            // A drive refuses what its model or its settings do not have; the rest is still worth reading.
            Err(error) if error.kind() == ErrorKind::Exception => {
                (*row, Err("refused by the drive".to_owned()))
            }
            Err(error) => return Err(one.failure(&error)),
        });
    }
    say_values(args, capabilities, &read)?;
    one.close().await;
    Ok(())
}

/// A row in the unit that it has in this drive now, which another register may choose: read only where one does.
async fn in_units(drive: &mut dyn Drive, row: &'static Row) -> drive_core::Result<Row> {
    let capabilities = drive.capabilities();
    let word = match capabilities.scaled_by(row.address) {
        Some(by) => Some(drive.read_parameter(by).await?),
        None => None,
    };
    Ok(capabilities.in_units(row, |_| word))
}

/// Prints registers with what was read of each, or why nothing was.
fn say_values(
    args: &OneDriveArgs,
    capabilities: &Capabilities,
    read: &[(Row, Result<u16, String>)],
) -> Result<(), Failure> {
    let view = |(row, word): &(Row, Result<u16, String>)| match word {
        Ok(word) => ParameterView::read(capabilities, row, *word),
        Err(why) => ParameterView::unread(capabilities, row, why.clone()),
    };
    args.daemon.say(&read.iter().map(view).collect::<Vec<_>>(), || {
        let mut table = value_table();
        for (row, word) in read {
            let shown = word.as_ref().map_or_else(Clone::clone, |word| row.show(*word));
            table.row(value_cells(capabilities, row, shown));
        }
        output::say_table(table)
    })
}

#[cfg(test)]
mod tests;
