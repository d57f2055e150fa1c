//! A command for programs.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::{Command, Direction, Setpoint, StopMode};
use crate::serialize::text;

/// Its word, its text and what it was given: `{"action": "start", "command": "start forward", "direction": "forward"}`.
impl Serialize for Command {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut told = Told {
            action: self.action().into(),
            command: self.to_string(),
            direction: None,
            mode: None,
            setpoint: None,
            register: None,
        };
        match *self {
            Self::Start(direction) => told.direction = Some(direction),
            Self::Stop(mode) => told.mode = Some(mode),
            Self::Setpoint(setpoint) => told.setpoint = Some(setpoint),
            Self::WriteParameter(register) => told.register = Some(register),
            _ => {}
        }
        told.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Command {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Told { action, command, direction, mode, setpoint, register } = Told::deserialize(deserializer)?;
        let missing = |field| de::Error::missing_field(field);
        Ok(match &*action {
            "start" => Self::Start(direction.ok_or_else(|| missing("direction"))?),
            "stop" => Self::Stop(mode.ok_or_else(|| missing("mode"))?),
            "withdraw" => Self::Withdraw,
            "setpoint" => Self::Setpoint(setpoint.ok_or_else(|| missing("setpoint"))?),
            "reset" => Self::ResetFaults,
            "release" => Self::Release,
            "watchdog" => Self::ArmWatchdog,
            "parameter" => Self::WriteParameter(register.ok_or_else(|| missing("register"))?),
            "save" => Self::Persist,
            "configure" => Self::Configure(text(&command)),
            other => return Err(de::Error::custom(format_args!("no command is called {other:?}"))),
        })
    }
}

#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
struct Told {
    action: String,
    command: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    direction: Option<Direction>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mode: Option<StopMode>,
    #[serde(skip_serializing_if = "Option::is_none")]
    setpoint: Option<Setpoint>,
    #[serde(skip_serializing_if = "Option::is_none")]
    register: Option<u16>,
}

#[cfg(feature = "schemars")]
impl schemars::JsonSchema for Command {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Command".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        Told::json_schema(generator)
    }
}
