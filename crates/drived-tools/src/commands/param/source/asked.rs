//! One register of a drive, read or written, and the save to its EEPROM.

use drive_core::{ErrorKind, Row};
use serde_json::json;

use super::{Source, Unread, Unwritten};
use drived_client::{own_line::may_have_written, path_of};
use drived_plant::plant::{commands::OutcomeWord, parameters::ParameterView};
use drived_words::failure::Failure;

impl Source {
    /// Reads one register, when its turn comes.
    pub(in crate::commands::param) async fn read(&mut self, row: &'static Row) -> Result<u16, Unread> {
        match self {
            Self::OnLine(one) => one.drive.read_parameter(row).await.map_err(|error| match error.kind() {
                ErrorKind::NoAnswer | ErrorKind::NotSent => Unread::Silent(error.to_string()),
                _ => Unread::Refused(error.to_string()),
            }),
            Self::OfDaemon { daemon, view } => {
                let name = view.name();
                let path = path_of(&["drives", name, "parameters", &row.address.to_string()]);
                let answer = daemon.get(&path).await;
                let answer = answer.map_err(|failure| Unread::Silent(failure.to_string()))?;
                let is_refused = answer.reason().as_deref() == Some("drive");
                let failed = |failure: Failure| match is_refused {
                    true => Unread::Refused(failure.to_string()),
                    false => Unread::Silent(failure.to_string()),
                };
                let row = answer.done::<ParameterView>().map_err(failed)?;
                row.raw.ok_or_else(|| Unread::Silent("the daemon tells no word".to_owned()))
            }
        }
    }

    /// Writes one register at standstill, and reads it back.
    pub(in crate::commands::param) async fn write(
        &mut self,
        row: &'static Row,
        word: u16,
    ) -> Result<(), Unwritten> {
        match self {
            Self::OnLine(one) => {
                match one.drive.status().await {
                    Ok(status) if status.is_undriven() => {}
                    Ok(status) => {
                        let why =
                            format!("parameters are restored at standstill, and the drive shows {status}");
                        return Err(Unwritten::Refused(why));
                    }
                    Err(error) => return Err(Unwritten::Refused(error.to_string())),
                }
                let written = one.drive.write_parameter(row, word).await;
                one.count_of(row, &written);
                match written {
                    Ok(_) => Ok(()),
                    Err(error) if may_have_written(&error) => Err(Unwritten::Unknown(error.to_string())),
                    Err(error) => Err(Unwritten::Refused(error.to_string())),
                }
            }
            Self::OfDaemon { daemon, view } => {
                let name = view.name();
                let path = path_of(&["drives", name, "parameters", &row.address.to_string()]);
                let body = json!({ "value": format!("0x{word:04X}"), "only_at_standstill": true });
                let answer = daemon.put(&path, &body).await;
                let answer = answer.map_err(|failure| Unwritten::Unknown(failure.to_string()))?;
                match answer.status {
                    status if status.is_success() => Ok(()),
                    status if status.is_client_error() => {
                        Err(Unwritten::Refused(answer.failure().to_string()))
                    }
                    _ => Err(Unwritten::Unknown(answer.failure().to_string())),
                }
            }
        }
    }

    /// Saves the drive's parameters to its EEPROM, whoever changed them. Says how often that was done, where it is known.
    pub(in crate::commands::param) async fn save(&mut self) -> Result<String, Failure> {
        match self {
            Self::OnLine(one) => {
                one.drive.assume_changed();
                let saves = one.drive.persist().await;
                one.count_save(&saves);
                let saves = saves.map_err(|error| one.failure(&error))?;
                Ok(format!("; saves counted: {saves}"))
            }
            Self::OfDaemon { daemon, view } => {
                let name = view.name();
                let answer =
                    daemon.post(&(path_of(&["drives", name, "save"]) + "?wait=30s"), &json!({})).await?;
                match answer.command() {
                    Some(command) if command.outcome == OutcomeWord::Confirmed => Ok(String::new()),
                    _ => Err(answer.failure()),
                }
            }
        }
    }
}
