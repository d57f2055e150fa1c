//! What a command says about itself, in JSON, the same at every face.

use std::time::Duration;

use drive_core::{Direction, Identity, Setpoint, StopMode};
use drive_fleet::Until;
use schemars::JsonSchema;
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::{Map, Value};
use tokio::time::Instant;

use super::{Action, Expects, LIFETIME, LONGEST_LIFETIME, Lifetime, Request, Target};

/// How long an id may be.
const LONGEST_ID: usize = 64;

/// A body that asks for something.
pub trait Asks: DeserializeOwned + Send + 'static {
    /// What it asks for.
    fn asked(self) -> Asked;
}

/// What a body says: the caller's id, how long the command may wait until it is sent, what he was shown, and what is to be done.
#[derive(Debug, Clone)]
pub struct Asked {
    pub id: Option<String>,
    pub expires_in_ms: Option<u64>,
    /// When it was issued, as it says itself.
    pub issued_unix_ms: Option<u64>,
    pub expects: Option<Expects>,
    pub action: Action,
}

impl Asked {
    /// What a body says that belongs to an action of this name.
    ///
    /// # Errors
    /// There is no such action, or its body is another one, in words.
    pub fn named(action: &str, members: Map<String, Value>) -> Result<Self, String> {
        fn read<T: Asks>(members: Map<String, Value>) -> Result<Asked, String> {
            serde_json::from_value::<T>(Value::Object(members))
                .map(T::asked)
                .map_err(|error| error.to_string())
        }
        match action {
            "start" => read::<Start>(members),
            "setpoint" => read::<NewSetpoint>(members),
            "reset" => read::<Reset>(members),
            "release" => read::<Release>(members),
            "save" => read::<Save>(members),
            _ => Err(format!(
                "action: expected start, stop, setpoint, reset, release or save, and not {action:?}"
            )),
        }
    }

    /// The request that it is.
    ///
    /// # Errors
    /// What is wrong with its id or its expiry, in words.
    pub fn of(self, target: Target, arrived: Instant) -> Result<Request, String> {
        let Self { id, expires_in_ms, expects, action, .. } = self;
        if id.as_ref().is_some_and(|id| !is_id(id)) {
            return Err(format!("id: expected 1 to {LONGEST_ID} printable ASCII characters without spaces"));
        }
        let lifetime = expires_in_ms.map_or(LIFETIME, |time| Lifetime::Said(Duration::from_millis(time)));
        if lifetime.time().is_zero() || lifetime.time() > LONGEST_LIFETIME {
            return Err(format!("expires_in_ms: expected 1 to {}", LONGEST_LIFETIME.as_millis()));
        }
        Ok(Request { id, target, action, expects, lifetime, arrived })
    }
}

/// Whether a text may be the name of a command.
pub fn is_id(text: &str) -> bool {
    (1..=LONGEST_ID).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_graphic())
}

/// A body with what every command may say beside its own members, and the action that it asks for.
macro_rules! body {
    (
        $(#[$about:meta])*
        $name:ident { $($(#[$of:meta])* $member:ident: $kind:ty,)* } asks $action:expr
    ) => {
        $(#[$about])*
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// The caller's name of the command: one that comes again within ten minutes is answered, and not repeated.
            #[schemars(length(min = 1, max = LONGEST_ID))]
            id: Option<String>,
            /// After this time from its arrival nothing of it is sent any more; unless it is said, after 1000, and of a start that has begun
            /// by then after 2000 more. A start of a group begins within it, and then takes as long as its lines need for its drives one after
            /// the other: some seconds for each of a full line.
            #[schemars(range(min = 1, max = 10_000))]
            expires_in_ms: Option<u64>,
            /// When it was issued, by a clock that agrees with the daemon's: its time counts from then, and a stop since then goes before it.
            issued_unix_ms: Option<u64>,
            /// What was shown of the drives: it is carried out so, or refused.
            expects: Option<Expects>,
            $($(#[$of])* $member: $kind,)*
        }

        impl Asks for $name {
            fn asked(self) -> Asked {
                let Self { id, expires_in_ms, issued_unix_ms, expects, $($member),* } = self;
                Asked { id, expires_in_ms, issued_unix_ms, expects, action: $action }
            }
        }
    };
}

body! {
    /// Starts the motor.
    Start {
        /// `forward` unless it is said.
        direction: Option<Direction>,
        /// Given first; without it the motor starts at what the drive holds.
        setpoint: Option<Setpoint>,
        /// When it is confirmed; `in_force` unless it is said.
        until: Option<Until>,
    } asks Action::Start {
        direction: direction.unwrap_or(Direction::Forward),
        setpoint,
        until: until.unwrap_or_default(),
    }
}

body! {
    /// Changes the setpoint.
    NewSetpoint {
        setpoint: Setpoint,
        /// When it is confirmed; `in_force` unless it is said.
        until: Option<Until>,
    } asks Action::Setpoint { setpoint, until: until.unwrap_or_default() }
}

body! {
    /// Resets the present fault, once.
    Reset {} asks Action::Reset
}

body! {
    /// Saves the parameters to EEPROM.
    Save {} asks Action::Save
}

body! {
    /// Gives control back to the panel or the terminals.
    Release {} asks Action::Release
}

body! {
    /// Takes what a drive says it is for right, where that is another one than before. Nothing is sent to it.
    Accept {
        /// What the drive says that it is, as the `identity` of its state has shown it: where it says something else by now, that is refused
        /// with the reason `not_as_shown`. What stands there besides, such as the `check`, is not looked at.
        identity: Identity,
    } asks Action::Accept((&identity).into())
}

/// Stops the motor. It never expires, and is carried out each time it arrives, whatever else its body says.
#[derive(Debug, JsonSchema)]
#[expect(dead_code, reason = "it is described here, and read as whatever stops is read")]
pub struct Stop {
    /// The caller's name of the command, by which its outcome is found. It need not be new.
    #[schemars(length(min = 1, max = LONGEST_ID))]
    id: Option<String>,
    /// What was shown of the drives: whoever stands where one of them was shown is stopped too, whatever he is called now.
    expects: Option<Expects>,
    /// `ramp` unless it is said.
    mode: Option<StopMode>,
    /// For a stop by `dc_injection`: for so long direct current is held to bring the motor to rest, at the most for 30000; unless it
    /// is said, as the drive's configuration does.
    #[schemars(range(min = 1, max = 30_000))]
    injection_ms: Option<u64>,
}
