//! Who asks, and what he may do.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whoever a request comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Caller {
    /// The token's name, `local` on the socket, `anonymous` without either.
    pub(crate) name: String,
    /// From where: `page 127.0.0.1`, `http 10.0.0.7`, `socket uid 1000`.
    pub(crate) origin: String,
    pub(crate) rights: Rights,
}

/// What a caller may do. A stop is a right of its own: it can be given where nothing else is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub(crate) struct Rights {
    /// To see everything but secrets.
    pub(crate) view: bool,
    /// To stop motors.
    pub(crate) stop: bool,
    /// To start them, to give setpoints, to reset faults, to give control back.
    pub(crate) operate: bool,
    /// To write parameters and to reload the configuration.
    pub(crate) engineer: bool,
}

impl Rights {
    pub(crate) const NONE: Self = Self { view: false, stop: false, operate: false, engineer: false };
    pub(crate) const ALL: Self = Self { view: true, stop: true, operate: true, engineer: true };
}

/// What a token is given for; each has the rights of those before it.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema, clap::ValueEnum,
)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Role {
    /// To see everything
    View,
    /// Also to stop motors
    Stop,
    /// Also to start them, to give setpoints and to reset faults
    Operate,
    /// Also to write parameters and to reload the configuration
    Engineer,
}

impl Role {
    pub(crate) fn rights(self) -> Rights {
        Rights {
            view: true,
            stop: self >= Self::Stop,
            operate: self >= Self::Operate,
            engineer: self >= Self::Engineer,
        }
    }

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::View => "view",
            Self::Stop => "stop",
            Self::Operate => "operate",
            Self::Engineer => "engineer",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_role_has_the_rights_of_those_before_it() {
        let rights = [Role::View, Role::Stop, Role::Operate, Role::Engineer].map(Role::rights);
        assert_eq!(rights[0], Rights { view: true, ..Rights::NONE });
        assert_eq!(rights[1], Rights { view: true, stop: true, ..Rights::NONE });
        assert_eq!(rights[2], Rights { engineer: false, ..Rights::ALL });
        assert_eq!(rights[3], Rights::ALL);
    }
}
