//! Why something is not done, and what to do about it.

use std::fmt;

use crate::{
    named::Word,
    state::{Control, State},
};

/// A setting by which a drive starts its motor again without being told: after a trip, a power cut or the loss of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct SelfRestart {
    /// The manual's mnemonic of the setting, such as `Atr`: the name by which it is accepted.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::serialize::kept"))]
    pub code: Word,
    /// What it does, in words that finish "the drive …".
    #[cfg_attr(feature = "serde", serde(deserialize_with = "crate::serialize::kept"))]
    pub meaning: Word,
}

impl fmt::Display for SelfRestart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "by {} the drive {}", self.code, self.meaning)
    }
}

/// Why a command is refused before anything is sent, or what keeps one that was sent from being in force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Refusal {
    /// The drive has tripped; reset it first.
    Fault(u16),
    /// The drive has tripped and did not say why in the words that were read; reset it first.
    Tripped,
    /// Somebody else commands the drive.
    NotInControl(Control),
    /// The drive is in a state that does not allow it.
    State(State),
    /// This direction is not authorised by the drive's settings.
    DirectionForbidden,
    /// The drive's settings do not let the bus command it; the text says which setting, and after a colon what to do.
    Settings(&'static str),
    /// Something else than this command decides what the motor does.
    Overridden {
        /// What decides instead, such as an input with its function, a channel or a setting, by the manual's mnemonics.
        by: &'static str,
        /// What to set or do, so that the bus decides.
        remedy: &'static str,
    },
    /// A setting of the drive starts the motor again by itself, such as `Atr` of the Altivar 312, and nobody has accepted
    /// that: see [`Drive::accept_self_restart`](crate::Drive::accept_self_restart).
    RestartsItself(SelfRestart),
    /// Nothing has changed since the last save: the EEPROM is not written.
    NothingToSave,
    /// The EEPROM's life is used up by this drive's own count of saves.
    EepromLife,
    /// The motor runs and this needs it stopped.
    MotorRunning,
    /// The drive has said that it is another one than its family's, in these words: it is read, and stopped when that is asked
    /// for, and nothing else is written.
    AnotherDrive(&'static str),
    /// The drive says of itself another thing than it did before: it was exchanged, and nobody has missed it. A start waits until it
    /// was [identified](crate::Drive::identify) again.
    Exchanged,
    /// Of a setpoint: nothing speaks against it, and nothing shows that the drive goes by it before the motor runs; the text says what
    /// there is to see. A start may follow it, and shows it.
    OnlyAStartShows(&'static str),
}

impl Refusal {
    /// Its word for programs.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Fault(_) | Self::Tripped => "fault",
            Self::NotInControl(_) => "not_remote",
            Self::State(_) => "not_ready",
            Self::DirectionForbidden => "forbidden_direction",
            Self::Settings(_) => "settings",
            Self::Overridden { .. } => "overridden",
            Self::RestartsItself(_) => "restarts_itself",
            Self::NothingToSave => "nothing_to_save",
            Self::EepromLife => "eeprom_life",
            Self::MotorRunning => "motor_running",
            Self::AnotherDrive(_) | Self::Exchanged => "another_drive",
            Self::OnlyAStartShows(_) => "only_a_start_shows",
        }
    }
}

/// What is done about a trip.
const MEND: &str = "remove the cause, then reset it";

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(code) => write!(f, "the drive has tripped (fault {code}): {MEND}"),
            Self::Tripped => write!(f, "the drive has tripped: {MEND}"),
            Self::NotInControl(control) => f.write_str(match control {
                Control::Bus => "this bus commands the drive already: stop it first",
                Control::Terminals => {
                    "the terminals command the drive: switch off the input that gives them command, or set the channel of \
                     commands to the bus"
                }
                Control::Panel => {
                    "the panel commands the drive: give command back at the panel, or set the channel of commands to the bus"
                }
                Control::Local => {
                    "the terminals or the panel command the drive: switch off what forces local control, or set the channel \
                     of commands to the bus"
                }
                Control::OtherBus => {
                    "another bus commands the drive: give command back there, or set the channel of commands to this one"
                }
            }),
            Self::State(state) => {
                let remedy = match state {
                    State::NotReady => "switch on the supply of its power part and wait until it is ready",
                    State::Stopping | State::QuickStop | State::FaultReaction => "wait until the motor stands",
                    State::Running => "stop it first",
                    State::Fault => MEND,
                    State::Disabled | State::Ready => "start it first",
                    State::Unknown => "see what its display says, for its manual does not explain its status word",
                };
                write!(f, "the drive's state is \"{state}\": {remedy}")
            }
            Self::DirectionForbidden => {
                f.write_str("the drive's settings forbid this direction: allow it there, or start the other way")
            }
            Self::Settings(which) | Self::OnlyAStartShows(which) => f.write_str(which),
            Self::Overridden { by, remedy } => write!(f, "{by} decides instead: {remedy}"),
            Self::RestartsItself(restart) => {
                let code = restart.code;
                write!(f, "{restart}: switch {code} off, or accept it by name (accept-self-restart {code})")
            }
            Self::NothingToSave => {
                f.write_str("nothing has changed since the last save: change a parameter first")
            }
            Self::EepromLife => f.write_str(
                "the saves that were counted have used up the EEPROM's life: replace the drive, or correct the count",
            ),
            Self::MotorRunning => f.write_str("the motor runs: stop it first"),
            Self::AnotherDrive(it_is) => write!(f, "the drive says that it is {it_is}; change the family that is set for it"),
            Self::Exchanged => f.write_str(
                "the drive is another one than before, by what it says of itself: see which one stands there, and accept it if it is meant",
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_refusal_says_what_is_so_and_what_to_do() {
        let overridden = Refusal::Overridden { by: "input F", remedy: "switch it off" };
        let restart = SelfRestart { code: "Atr", meaning: "starts the motor again by itself" };
        let control = [Control::Bus, Control::Terminals, Control::Panel, Control::Local, Control::OtherBus];
        let states = [
            State::NotReady,
            State::Disabled,
            State::Ready,
            State::Running,
            State::Stopping,
            State::QuickStop,
            State::FaultReaction,
            State::Fault,
            State::Unknown,
        ];
        let others = [
            Refusal::Fault(17),
            Refusal::Tripped,
            Refusal::DirectionForbidden,
            overridden,
            Refusal::RestartsItself(restart),
            Refusal::NothingToSave,
            Refusal::EepromLife,
            Refusal::MotorRunning,
            Refusal::Exchanged,
        ];
        let controlled = control.map(Refusal::NotInControl);
        for refusal in others.into_iter().chain(controlled).chain(states.map(Refusal::State)) {
            let text = refusal.to_string();
            let (_, remedy) = text.split_once(": ").unwrap_or_else(|| panic!("{text}"));
            let verb = remedy.split(' ').next().unwrap_or_default();
            let verbs =
                ["allow", "change", "give", "remove", "replace", "see", "start", "stop", "switch", "wait"];
            assert!(verbs.contains(&verb), "{text}");
        }
    }
}
