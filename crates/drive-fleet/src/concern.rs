//! What troubles a drive: [`Concern`]. **One table** says how badly, in which words, what to do, and whether it wakes
//! somebody; every face, every log and every rule of a monitoring system shows this and decides nothing of its own.

use std::{fmt, time::Duration};

use tokio::time::Instant;

/// How badly something troubles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Severity {
    /// Somebody should go there now.
    Alarm,
    /// Somebody should see to it.
    Warning,
    /// It should be known, and is often over by itself.
    Note,
}

drive_core::named! { Severity {
    Alarm => "alarm",
    Warning => "warning",
    Note => "note",
} }

impl Severity {
    /// Whether it is trouble. A note is none: it is often over by itself.
    #[must_use]
    pub const fn is_trouble(self) -> bool {
        matches!(self, Self::Alarm | Self::Warning)
    }
}

/// A row of the table.
struct Row {
    word: &'static str,
    words: &'static str,
    remedy: &'static str,
    severity: Severity,
    wakes: bool,
}

macro_rules! table {
    ($($(#[$doc:meta])* $kind:ident: $word:literal, $words:literal, $severity:ident, $wakes:literal, $remedy:literal;)*) => {
        /// What it is that troubles a drive. **In the order of its rank**: the worst comes first.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
        #[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
        pub enum ConcernKind {
            $($(#[$doc])* $kind,)*
        }

        impl ConcernKind {
            /// All of them, the worst first.
            pub const ALL: &'static [Self] = &[$(Self::$kind),*];

            const fn row(self) -> Row {
                match self {
                    $(Self::$kind => Row {
                        word: $word,
                        words: $words,
                        remedy: $remedy,
                        severity: Severity::$severity,
                        wakes: $wakes,
                    },)*
                }
            }
        }
    };
}

table! {
    /// A stop goes without a confirmation for longer than the settings allow: [`PendingStop::alarm`](crate::PendingStop).
    StopUnconfirmed: "stop_unconfirmed", "STOP NOT CONFIRMED, the motor may turn", Alarm, true,
        "use the emergency stop, then look at the drive";
    /// Somebody else has control and the run command of this side still stands in the drive.
    RunCommandStands: "run_command_stands", "a run command stands, the motor may start when control is given back", Alarm, true,
        "stop the drive at its panel before control is given back";
    /// It does not answer, and its motor turned when it was last seen.
    LostRunning: "lost_running", "lost while it was running, the motor may turn", Alarm, true,
        "look at the motor, then at the drive's supply and its cable";
    /// It has tripped.
    Tripped: "tripped", "tripped", Alarm, false,
        "remove the cause, then reset it";
    /// The run command of this side stands and something else decides: it may act again by itself.
    RunSuspended: "run_suspended", "its run command is not in force, the motor may start by it", Alarm, false,
        "see what decides instead; the run command is withdrawn, unless that was accepted";
    /// Another drive than before answers at its address.
    IdentityChanged: "identity_changed", "another drive than before answers at its address", Alarm, false,
        "see which drive it is and how it is set up, then accept it on its page or by drived accept";
    /// It is none of the family that it is configured as.
    OtherFamily: "other_family", "a drive of another family answers at its address", Alarm, false,
        "set it up as what it is: until then it is only read, and stopped when that is asked for";
    /// What has to be set up so in the drive for its words to mean what they are taken for is otherwise.
    SetUpOtherwise: "set_up_otherwise", "a setting in it is not as it has to be, its motor may turn otherwise than is told", Alarm, false,
        "set it at the drive as is said; until then it is not started";
    /// Its communication watchdog cannot be brought to what the contract says.
    WatchdogBroken: "watchdog_broken", "its watchdog is not as the contract says", Alarm, false,
        "set it at the drive, or change the contract";
    /// Its motor turns, and its communication watchdog is not as the contract says.
    WatchdogNotInForce: "watchdog_not_in_force", "its motor turns without the watchdog of its contract", Alarm, false,
        "stop the motor: it is set up at standstill";
    /// It does not answer.
    Lost: "lost", "does not answer", Alarm, false,
        "look at its supply, its address and its cable";
    /// It answers, by exceptions: nothing is known of it, and it is not silent.
    Refuses: "refuses", "answers, and refuses to tell its status", Alarm, false,
        "see which drive it is, and whether it is set up as that";
    /// It answers, and what it showed last is old.
    Stale: "stale", "what it shows is old", Warning, false,
        "see how busy its line is";
    /// Settings of the drive start its motor again by themselves, and nobody has accepted that.
    RestartsItself: "restarts_itself", "its own settings start the motor again by themselves", Warning, false,
        "switch them off at the drive, or accept them by name";
    /// Its EEPROM is written more often than it lasts.
    EepromWorn: "eeprom_worn", "its EEPROM is written more often than it lasts", Warning, false,
        "see who writes its parameters, and why its watchdog does not stay as it is set";
    /// A measured value is above its limit.
    LimitExceeded: "limit_exceeded", "above its limit", Warning, false,
        "look at load, fan and filters, or at who gives a frequency above its limit";
    /// Its output is not at its setpoint, and comes no nearer: for 2 s while it says that it is at its reference or the output goes on above it,
    /// for 20 s else.
    OffSetpoint: "off_setpoint", "the output is not at its setpoint, and comes no nearer", Warning, false,
        "see what 100 % is at the drive (its reference frequency), its lowest and highest speed, and who else gives it a setpoint";
    /// It shows an alarm that does not trip.
    Warning: "warning", "the drive shows an alarm", Warning, false,
        "read its faults: they name the alarm";
    /// Panel, terminals or another bus have taken control.
    ControlTaken: "control_taken", "somebody else has taken control", Warning, false,
        "give control back there";
    /// A stop is on its way and not confirmed yet.
    StopPending: "stop_pending", "a stop is on its way, not confirmed yet", Note, false,
        "wait until it is confirmed";
    /// Its motor runs by a command of this side, and nobody here knows at which setpoint: behind a lost line or a restart of the program, of a
    /// drive that tells no reference. Whether it follows is not judged.
    SetpointUnknown: "setpoint_unknown", "at which setpoint the motor runs is not known here", Note, false,
        "give it a setpoint: whether its output comes to that is watched from then on";
    /// Its motor turns, control is on this bus, and no run command of this side stands in it.
    RunByAnother: "run_by_another", "its motor turns by no command of this side", Note, false,
        "see who runs it: another master on its line, or a setting of the drive";
    /// Its output was cut while the motor turned, and nothing tells when the shaft has come to rest.
    Coasting: "coasting", "output off, the shaft may coast", Note, false,
        "keep away from the shaft until it is seen to stand";
    /// Direct current holds its shaft at rest, and heats its motor.
    Held: "held", "direct current holds the shaft", Note, false,
        "the current heats the motor: it ends with its time, or with a ramp stop";
    /// It has not been seen yet.
    NeverSeen: "never_seen", "not seen yet", Note, false,
        "wait, or look at its supply, its address and its cable";
}

impl ConcernKind {
    /// Its place: 0 is the worst.
    #[must_use]
    pub const fn rank(self) -> usize {
        self as usize
    }

    /// Its word for programs.
    #[must_use]
    pub const fn word(self) -> &'static str {
        self.row().word
    }

    /// The same in words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        self.row().words
    }

    /// What to do first.
    #[must_use]
    pub const fn remedy(self) -> &'static str {
        self.row().remedy
    }

    /// How badly it troubles.
    #[must_use]
    pub const fn severity(self) -> Severity {
        self.row().severity
    }

    /// Whether somebody is woken for it.
    #[must_use]
    pub const fn wakes(self) -> bool {
        self.row().wakes
    }
}

impl fmt::Display for ConcernKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.words())
    }
}

/// Something that troubles a drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Concern {
    /// What.
    pub kind: ConcernKind,
    /// Since when, as this side saw it; of a drive that does not answer since it did last.
    pub since: Option<Instant>,
    /// What is known of it besides, such as the fault or the error.
    pub detail: Option<String>,
}

/// It in a sentence.
impl fmt::Display for Concern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.words())?;
        self.detail.as_ref().map_or(Ok(()), |detail| write!(f, ": {detail}"))
    }
}

impl Concern {
    /// Whether its detail is the error by which the drive was asked in vain last.
    pub(crate) const fn is_by_error(&self) -> bool {
        matches!(
            self.kind,
            ConcernKind::LostRunning
                | ConcernKind::Lost
                | ConcernKind::Refuses
                | ConcernKind::Stale
                | ConcernKind::NeverSeen
        )
    }

    /// For how long.
    #[must_use]
    pub fn lasts(&self, now: Instant) -> Option<Duration> {
        self.since.map(|since| now.saturating_duration_since(since))
    }
}

/// Keeps since when there is what there is now: what was there before keeps its time.
pub(crate) fn note(since: &mut Vec<(ConcernKind, Instant)>, concerns: &[Concern], now: Instant) {
    since.retain(|(kind, _)| concerns.iter().any(|concern| concern.kind == *kind));
    for concern in concerns {
        if !since.iter().any(|(kind, _)| *kind == concern.kind) {
            since.push((concern.kind, now));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_its_ranks_and_no_worse_thing_is_told_more_mildly() {
        for (rank, kind) in ConcernKind::ALL.iter().enumerate() {
            assert_eq!(kind.rank(), rank);
        }
        for pair in ConcernKind::ALL.windows(2) {
            assert!(pair[0].severity() <= pair[1].severity(), "{pair:?}");
            assert!(pair[0].wakes() || !pair[1].wakes(), "{pair:?}");
        }
        let words: std::collections::BTreeSet<_> = ConcernKind::ALL.iter().map(|kind| kind.word()).collect();
        assert_eq!(words.len(), ConcernKind::ALL.len());
    }
}
