//! The same through the running daemon.

use serde_json::{Value, json};

use crate::{client, failure::Failure, one_drive::OneDriveArgs, output};

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
    one.daemon.say(&written, |written| match written["text"].as_str() {
        Some(text) => output::say(format_args!("{name} {text}")),
        None => output::say(format_args!("{name} {register} is now {}", shown(&written["value"]))),
    })
}

/// Saves the parameters of a drive to its EEPROM.
pub(super) async fn save(one: &OneDriveArgs, name: Option<&str>) -> Result<(), Failure> {
    let mut daemon = one.daemon.connect().await?;
    let path = one.path(&mut daemon, name, &["save"]).await?;
    let saved = daemon.post(&path, &json!({})).await?.done()?;
    one.daemon.say(&saved, |saved| {
        let name = name.unwrap_or_default();
        output::say(format_args!(
            "{name} {}",
            saved["text"].as_str().unwrap_or("has saved its parameters to EEPROM")
        ))
    })
}

/// Reads every register that can be read.
pub(super) async fn dump(one: &OneDriveArgs, name: Option<&str>) -> Result<(), Failure> {
    let mut daemon = one.daemon.connect().await?;
    let path = one.path(&mut daemon, name, &["parameters"]).await?;
    let rows = daemon.get(&path).await?.done()?;
    one.daemon.say(&rows, show)
}

fn show(rows: &Value) -> Result<(), Failure> {
    let all = rows.as_array().or_else(|| rows["parameters"].as_array());
    client::registers(all.map_or(&[][..], Vec::as_slice))
}

fn shown(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}
