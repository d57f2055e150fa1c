//! The same through the running daemon.

use drive_core::Row;
use drive_families::Family;
use serde_json::json;

use super::{direct::moved, rule};
use crate::one_drive::OneDriveArgs;
use drived_client::{self as client, Daemon, Told, path_of};
use drived_plant::plant::{
    commands::ActionWord,
    parameters::{AccessWord, ParameterView, WrittenView},
    views::DriveView,
};
use drived_words::{failure::Failure, output, registers::wanted};

/// Reads registers.
pub(super) async fn get(one: &OneDriveArgs, words: &[String]) -> Result<(), Failure> {
    let Some((name, registers)) = words.split_first().filter(|(_, registers)| !registers.is_empty()) else {
        return Err(Failure::Input("expected NAME and one or more REGISTERs".to_owned()));
    };
    let mut daemon = one.daemon.connect().await?;
    let mut rows = Vec::new();
    for register in registers {
        let path = one.path(&mut daemon, Some(name), &["parameters", register]).await?;
        rows.push(daemon.get(&path).await?.done()?);
    }
    one.daemon.say(&rows, || client::registers(&rows))
}

/// Writes one register, reads it back, and saves it if that is wanted.
pub(super) async fn set(
    one: &OneDriveArgs,
    name: &str,
    register: &str,
    value: &str,
    save: bool,
) -> Result<(), Failure> {
    let mut daemon = one.daemon.connect().await?;
    let path = one.path(&mut daemon, Some(name), &["parameters", register]).await?;
    let drives = daemon.state().await?.drives;
    let drive = drives.iter().find(|drive| drive.name() == name);
    if let Some(drive) = drive {
        keep_rule(&mut daemon, drive, register, value).await?;
    }
    let running =
        drive.and_then(|drive| drive.snapshot.status.value.as_ref()).filter(|status| !status.is_undriven());
    let written = daemon.put(&path, &json!({ "value": value, "save": save })).await?;
    let written: WrittenView = written.done()?;
    let text = written.parameter.text.as_deref().unwrap_or_default();
    let running = running.filter(|_| written.changed);
    one.daemon.say(&written, || {
        output::say(format_args!("{name} {text}"))?;
        running.map_or(Ok(()), |status| output::say(moved(status)))
    })
}

/// Refuses what a restore refuses. What is no value, or no register, the daemon says better.
async fn keep_rule(
    daemon: &mut Daemon,
    drive: &DriveView,
    register: &str,
    value: &str,
) -> Result<(), Failure> {
    let Ok(family) = drive.family.parse::<Family>() else { return Ok(()) };
    let capabilities = family.capabilities();
    let Some(row) = Row::find(capabilities.rows, register) else { return Ok(()) };
    // Of those whose unit another register chooses none has such a rule.
    let Ok(word) = wanted(row, value) else { return Ok(()) };
    let read = async |row: &'static Row| {
        let path = path_of(&["drives", drive.name(), "parameters", &row.address.to_string()]);
        daemon.get(&path).await.ok()?.done::<ParameterView>().ok()?.raw
    };
    rule::held(capabilities, row, word, read).await
}

/// Saves the parameters of a drive to its EEPROM.
pub(super) async fn save(one: &OneDriveArgs, name: Option<&str>) -> Result<(), Failure> {
    let done = "has saved its parameters to EEPROM: all that it kept in RAM, not one alone".to_owned();
    one.tell(name, &Told { action: ActionWord::Save, body: json!({}), done }).await
}

/// Reads every register that can be read. The daemon reads them between its polls, and what it has read it keeps for a
/// while: it is asked again until nothing is missing.
pub(super) async fn dump(one: &OneDriveArgs, name: Option<&str>) -> Result<(), Failure> {
    let mut daemon = one.daemon.connect().await?;
    let path = one.path(&mut daemon, name, &["parameters"]).await? + "?wait=30s";
    let mut left = usize::MAX;
    loop {
        let rows: Vec<ParameterView> = daemon.get(&path).await?.done()?;
        let missing = |row: &&ParameterView| {
            row.access != AccessWord::Write && row.text.is_none() && row.error.is_none()
        };
        let now = rows.iter().filter(missing).count();
        // Where it comes no further the drive is not there.
        if now == 0 || now >= left {
            return one.daemon.say(&rows, || client::registers(&rows));
        }
        left = now;
    }
}
