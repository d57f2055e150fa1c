//! The same through the running daemon.

use serde_json::{Value, json};

use crate::{
    client::{self, Told},
    failure::Failure,
    one_drive::OneDriveArgs,
    output,
};

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
    one.daemon.say(&Value::Array(rows), show)
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
    let written = daemon.put(&path, &json!({ "value": value, "save": save })).await?.done()?;
    one.daemon.say(&written, |written| {
        output::say(format_args!("{name} {}", written["text"].as_str().unwrap_or_default()))
    })
}

/// Saves the parameters of a drive to its EEPROM.
pub(super) async fn save(one: &OneDriveArgs, name: Option<&str>) -> Result<(), Failure> {
    let done = "has saved its parameters to EEPROM: all that it kept in RAM, not one alone".to_owned();
    one.tell(name, &Told { action: "save", body: json!({}), done }).await
}

/// Reads every register that can be read. The daemon reads them between its polls, and what it has read it keeps for a
/// while: it is asked again until nothing is missing.
pub(super) async fn dump(one: &OneDriveArgs, name: Option<&str>) -> Result<(), Failure> {
    let mut daemon = one.daemon.connect().await?;
    let path = one.path(&mut daemon, name, &["parameters"]).await? + "?wait=30s";
    let mut left = usize::MAX;
    loop {
        let rows = daemon.get(&path).await?.done()?;
        let missing =
            |row: &&Value| row["access"] != "write" && row["text"].is_null() && row["error"].is_null();
        let now = rows.as_array().into_iter().flatten().filter(missing).count();
        // Where it comes no further the drive is not there.
        if now == 0 || now >= left {
            return one.daemon.say(&rows, show);
        }
        left = now;
    }
}

fn show(rows: &Value) -> Result<(), Failure> {
    client::registers(rows.as_array().map_or(&[][..], Vec::as_slice))
}
