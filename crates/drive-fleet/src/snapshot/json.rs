//! What is known of a watchdog, for programs.

use drive_core::Watchdog;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Why a watchdog is not as it has to be.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub(crate) struct Why {
    why: String,
}

/// What is off is told like what nobody has read, and reads back as that.
pub(crate) fn watchdog<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Watchdog>, D::Error> {
    let found = Watchdog::deserialize(deserializer)?;
    Ok((found.timeout.is_some() || found.reaction.is_some()).then_some(found))
}

pub(crate) mod why {
    use super::{Deserialize, Deserializer, Serialize, Serializer, Why};

    pub(crate) fn serialize<S: Serializer>(why: &str, serializer: S) -> Result<S::Ok, S::Error> {
        Why { why: why.to_owned() }.serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
        Ok(Why::deserialize(deserializer)?.why)
    }
}
