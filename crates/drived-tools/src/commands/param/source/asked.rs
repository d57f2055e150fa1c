//! One register of a drive, read or written, and the save to its EEPROM.

use axum::http::StatusCode;
use drive_core::{Error, ErrorKind, Refusal, Row};
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
                let reason = answer.reason();
                let failed = |failure: Failure| match is_of_the_register(reason.as_deref()) {
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
                        return Err(Unwritten::NotNow(why));
                    }
                    Err(error) => return Err(Unwritten::NotNow(error.to_string())),
                }
                let written = one.drive.write_parameter(row, word).await;
                one.count_of(row, &written);
                written.map(drop).map_err(|error| unwritten(row, &error))
            }
            Self::OfDaemon { daemon, view } => {
                let name = view.name();
                let path = path_of(&["drives", name, "parameters", &row.address.to_string()]);
                let body = json!({ "value": format!("0x{word:04X}"), "only_at_standstill": true });
                let answer = daemon.put(&path, &body).await;
                let answer = answer.map_err(|failure| Unwritten::Unknown(failure.to_string()))?;
                let why = answer.failure().to_string();
                match answer.status {
                    status if status.is_success() => Ok(()),
                    StatusCode::UNPROCESSABLE_ENTITY => Err(Unwritten::Refused(why)),
                    StatusCode::CONFLICT if !answer.reason().is_some_and(|word| is_of_the_moment(&word)) => {
                        Err(Unwritten::Refused(why))
                    }
                    status if status.is_client_error() => Err(Unwritten::NotNow(why)),
                    // Sent, and not confirmed: what it holds says what became of it.
                    _ => match self.read(row).await {
                        Ok(held) if held == word => Ok(()),
                        Ok(held) => Err(Unwritten::ReadsBack(held)),
                        Err(_) => Err(Unwritten::Unknown(why)),
                    },
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

/// What became of a register that could not be written.
fn unwritten(row: &Row, error: &Error) -> Unwritten {
    match error {
        Error::NotConfirmed { status, .. } => {
            let mut read = status.raw.iter().filter(|read| read.address == row.address);
            read.next().map_or_else(
                || Unwritten::Unknown(error.to_string()),
                |read| Unwritten::ReadsBack(read.value),
            )
        }
        _ if may_have_written(error) => Unwritten::Unknown(error.to_string()),
        Error::Refused { reason: Refusal::MotorRunning, .. } | Error::Port { .. } => {
            Unwritten::NotNow(error.to_string())
        }
        _ => Unwritten::Refused(error.to_string()),
    }
}

/// Whether a register could not be read because the drive refuses this one. One that did not answer has another word.
fn is_of_the_register(reason: Option<&str>) -> bool {
    reason == Some("drive")
}

/// Whether the daemon refuses whatever is asked of this drive, now or of this caller, and not this register: its words for that.
fn is_of_the_moment(reason: &str) -> bool {
    const WHATEVER: [&str; 13] = [
        "read_only",
        "no_right",
        "offline",
        "no_answer",
        "stale",
        "identity",
        "watchdog",
        "stop_pending",
        "stop",
        "later_command",
        "queue_full",
        "removed",
        "shut_down",
    ];
    reason == Refusal::MotorRunning.word() || WHATEVER.contains(&reason)
}

#[cfg(test)]
mod tests {
    use drive_core::{ExceptionMeaning, Exchange, PortError, SlaveAddress};
    use drive_fleet::Refused;

    use super::*;

    #[test]
    fn a_drive_that_has_fallen_silent_behind_the_daemon_is_not_taken_for_one_that_refuses_a_register() {
        let slave = SlaveAddress::try_from(1).unwrap();
        let exchange = Exchange { function: 3, register: None };
        let silent = [
            PortError::Timeout { after: std::time::Duration::from_millis(200) },
            PortError::Expired,
            PortError::Damaged("CRC"),
            PortError::Closed,
        ];
        for problem in silent {
            let refused = Refused::from(Error::Port { slave, exchange, problem });
            assert!(!is_of_the_register(Some(refused.word())), "{refused}");
            assert!(is_of_the_moment(refused.word()), "{refused}");
        }
        let meaning = ExceptionMeaning::NoSuchRegister;
        let refused = Refused::from(Error::Exception { slave, exchange, code: 2, meaning });
        assert!(is_of_the_register(Some(refused.word())) && !is_of_the_moment(refused.word()));
    }
}
