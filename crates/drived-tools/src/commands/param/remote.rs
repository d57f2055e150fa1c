//! The same through the running daemon.

use serde_json::json;

use super::direct::moved;
use crate::one_drive::OneDriveArgs;
use drived_client::{self as client, Told};
use drived_plant::plant::{
    commands::ActionWord,
    parameters::{AccessWord, ParameterView, WrittenView},
};
use drived_words::{failure::Failure, output};

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
    let running =
        drive.and_then(|drive| drive.snapshot.status.value.as_ref()).filter(|status| !status.is_undriven());
    let written = daemon.put(&path, &json!({ "value": value, "save": save })).await?;
    let written: WrittenView = written.done()?;
    let text = written.parameter.text.as_deref().unwrap_or_default();
    let running = running.filter(|_| written.changed);
    one.daemon.say_done(&written, || {
        output::say(format_args!("{name} {text}"))?;
        running.map_or(Ok(()), |status| output::say(moved(status)))
    })
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
