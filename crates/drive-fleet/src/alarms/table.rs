//! What an alarm can be of: [`AlarmKind`], with its words. What is of a drive is a [`ConcernKind`]; the others stand here.

use std::{fmt, time::Duration};

use drive_core::INJECTION_AT_MOST;

use crate::concern::{ConcernKind, Severity};

/// A drive that was never seen is an alarm after this time: at a start nobody has been seen yet.
const SEEN_WITHIN: Duration = Duration::from_secs(60);

/// What an alarm is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum AlarmKind {
    /// The port of a line is away: the cause of all that its drives cannot show.
    LineAway,
    /// No drive of a line answers, and it has several: the cause of their losses.
    LineSilent,
    /// Something troubles a drive.
    Drive(ConcernKind),
    /// A line has found something wrong with itself, or with a drive on it, by what it has heard.
    LineFinding,
    /// A stop that was not confirmed is kept of a drive that is not in the configuration: nobody gives it.
    StopLeft,
    /// A run command is kept of a drive that is not in the configuration: nobody watches what it turns.
    RunLeft,
    /// What was kept of runs and stops could not be read: a stop may not be given anew, and a motor not be watched.
    RecordsLost,
    /// The audit log cannot be written, so that only stops are carried out.
    AuditLog,
    /// The history cannot be written: what happens now waits in memory, and what finds no room there is lost.
    History,
    /// The certificate by which the page is served ends soon or has ended: behind its end no browser comes in.
    Certificate,
    /// A drive has run for so long, or was started so often, that something of it is to be seen to.
    Maintenance,
    /// The configuration could not be read again, or a reload has left a motor that may turn.
    Reload,
}

/// Those that are of no drive's own.
const OTHERS: [AlarmKind; 11] = [
    AlarmKind::LineAway,
    AlarmKind::LineSilent,
    AlarmKind::LineFinding,
    AlarmKind::StopLeft,
    AlarmKind::RunLeft,
    AlarmKind::RecordsLost,
    AlarmKind::AuditLog,
    AlarmKind::History,
    AlarmKind::Certificate,
    AlarmKind::Maintenance,
    AlarmKind::Reload,
];

struct Row {
    word: &'static str,
    words: &'static str,
    remedy: &'static str,
    severity: Severity,
}

impl AlarmKind {
    /// All kinds of which there are alarms.
    pub fn all() -> impl Iterator<Item = Self> {
        let drives = ConcernKind::ALL.iter().map(|kind| Self::Drive(*kind));
        OTHERS.into_iter().chain(drives.filter(|kind| kind.severity().is_trouble()))
    }

    /// The kind of a [word](Self::word); `None` for a word that is none.
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::all().find(|kind| kind.word() == word)
    }

    fn row(self) -> Row {
        let row = |word, words, severity, remedy| Row { word, words, remedy, severity };
        match self {
            Self::LineAway => row(
                "line_away",
                "the port of the line is away, none of its drives can be reached",
                Severity::Alarm,
                "look at its adapter or serial server, and at the plug",
            ),
            Self::LineSilent => row(
                "line_silent",
                "no drive of the line answers",
                Severity::Alarm,
                "look at the motors, then at the cable of the line and at the supply of its drives",
            ),
            Self::LineFinding => row(
                "line_finding",
                "the line is not as it should be",
                Severity::Warning,
                "drived doctor says more",
            ),
            Self::StopLeft => row(
                "stop_left",
                "a stop was not confirmed, and nobody gives it, for its drive is not in the configuration: the motor may turn",
                Severity::Alarm,
                "see whether the motor turns; once its drive is in the configuration again, the stop is given anew",
            ),
            Self::RunLeft => row(
                "run_left",
                "a run command of this program may stand in a drive that is not in the configuration, and nobody watches it: the motor may turn",
                Severity::Alarm,
                "see whether the motor turns; once its drive is in the configuration again, it is watched and can be stopped from here; where it is not to be there again: drived alarms done NUMBER",
            ),
            Self::RecordsLost => row(
                "records_lost",
                "not all that was kept of runs and stops could be read, a stop or a run may be lost: a motor may turn",
                Severity::Alarm,
                "see whether a motor turns that should not, and stop it; then: drived alarms done NUMBER",
            ),
            Self::AuditLog => row(
                "audit_log",
                "the audit log cannot be written, only stops are carried out",
                Severity::Alarm,
                "see whether its disk is full; the log of the program says why",
            ),
            Self::History => row(
                "history",
                "the history cannot be written, what happens now waits in memory and may be lost",
                Severity::Warning,
                "see whether its disk is full; the log of the program says why",
            ),
            Self::Certificate => row(
                "certificate",
                "the certificate of the page ends soon or has ended, no browser comes in behind its end",
                Severity::Warning,
                "have it renewed; drived reload takes it",
            ),
            Self::Maintenance => row(
                "maintenance",
                "maintenance is due",
                Severity::Warning,
                "have it done, and say so: drived alarms done NUMBER",
            ),
            Self::Reload => row(
                "reload",
                "the configuration does not hold as it was read again",
                Severity::Alarm,
                "see what is said of it, mend the file, and read it again",
            ),
            // At a start it is a note: it becomes an alarm by its age alone.
            Self::Drive(ConcernKind::NeverSeen) => row(
                ConcernKind::NeverSeen.word(),
                ConcernKind::NeverSeen.words(),
                Severity::Warning,
                "look at its supply, its address and its cable",
            ),
            // No stop of here holds it for longer than it has to last: whatever does heats a motor that stands, and ends it nowhere.
            Self::Drive(ConcernKind::Held) => row(
                ConcernKind::Held.word(),
                ConcernKind::Held.words(),
                Severity::Warning,
                ConcernKind::Held.remedy(),
            ),
            Self::Drive(kind) => row(kind.word(), kind.words(), kind.severity(), kind.remedy()),
        }
    }

    /// Its word for programs.
    #[must_use]
    pub fn word(self) -> &'static str {
        self.row().word
    }

    /// The same in words.
    #[must_use]
    pub fn words(self) -> &'static str {
        self.row().words
    }

    /// What to do first.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        self.row().remedy
    }

    /// How badly it troubles.
    #[must_use]
    pub fn severity(self) -> Severity {
        self.row().severity
    }

    /// Whether it is about a motor that moves, or may: **nobody may shelve it**. Who has taken note of it
    /// acknowledges it, and it goes on to be shown for as long as the motor may turn.
    #[must_use]
    pub const fn is_of_motion(self) -> bool {
        match self {
            Self::Drive(kind) => kind.wakes(),
            Self::StopLeft | Self::RunLeft | Self::RecordsLost => true,
            _ => false,
        }
    }

    /// Whether somebody is woken for it: it is [of motion](Self::is_of_motion), or may stand for alarms that are.
    #[must_use]
    pub const fn wakes(self) -> bool {
        self.is_of_motion() || matches!(self, Self::LineAway | Self::LineSilent)
    }

    /// For how long it has to last before it is an alarm.
    #[must_use]
    pub const fn lasts_at_least(self) -> Duration {
        match self {
            Self::Drive(ConcernKind::NeverSeen) => SEEN_WITHIN,
            Self::Drive(ConcernKind::Held) => INJECTION_AT_MOST,
            _ => Duration::ZERO,
        }
    }

    /// Whether it can be the cause of others.
    pub(super) const fn is_cause(self) -> bool {
        matches!(
            self,
            Self::LineAway | Self::LineSilent | Self::Drive(ConcernKind::Lost | ConcernKind::LostRunning)
        )
    }

    /// Whether it tells of a drive that nothing is heard of it.
    pub(super) const fn is_of_absence(self) -> bool {
        use ConcernKind::{Lost, LostRunning, NeverSeen, Stale};
        matches!(self, Self::Drive(Lost | LostRunning | NeverSeen | Stale))
    }

    /// Whether it would not be there without `cause`, at the same drive or at a drive of that line.
    pub(super) const fn follows_from(self, cause: Self) -> bool {
        match cause {
            Self::LineAway => self.is_of_absence() || matches!(self, Self::LineSilent),
            Self::LineSilent => self.is_of_absence(),
            Self::Drive(ConcernKind::Lost | ConcernKind::LostRunning) => {
                matches!(self, Self::Drive(ConcernKind::Stale | ConcernKind::NeverSeen))
            }
            _ => false,
        }
    }
}

/// In words.
impl fmt::Display for AlarmKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.words())
    }
}

#[cfg(feature = "serde")]
mod written {
    use std::borrow::Cow;

    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};

    use super::AlarmKind;

    impl Serialize for AlarmKind {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.serialize_str(self.word())
        }
    }

    impl<'de> Deserialize<'de> for AlarmKind {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let word = Cow::<'_, str>::deserialize(deserializer)?;
            Self::of_word(&word).ok_or_else(|| D::Error::custom(format!("no alarm is called {word}")))
        }
    }

    #[cfg(feature = "schemars")]
    impl schemars::JsonSchema for AlarmKind {
        fn schema_name() -> Cow<'static, str> {
            "AlarmKind".into()
        }

        fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
            let words: Vec<&str> = Self::all().map(Self::word).collect();
            schemars::json_schema!({ "type": "string", "enum": words })
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_kind_has_a_word_of_its_own_by_which_it_is_found_and_no_note_is_an_alarm() {
        let all: Vec<AlarmKind> = AlarmKind::all().collect();
        let words: BTreeSet<&str> = all.iter().map(|kind| kind.word()).collect();
        assert_eq!(words.len(), all.len());
        for kind in &all {
            assert_eq!(AlarmKind::of_word(kind.word()), Some(*kind));
            assert!(kind.severity().is_trouble() && !kind.remedy().is_empty(), "{kind:?}");
        }
        assert_eq!(AlarmKind::of_word("coasting"), None, "it is a note");
    }

    #[test]
    fn what_is_of_motion_is_what_wakes_somebody() {
        for kind in ConcernKind::ALL {
            assert_eq!(AlarmKind::Drive(*kind).is_of_motion(), kind.wakes());
        }
    }

    #[test]
    fn nothing_is_its_own_cause_and_no_two_are_each_others() {
        for one in AlarmKind::all() {
            for other in AlarmKind::all().filter(|other| one.follows_from(*other)) {
                assert!(!other.follows_from(one), "{one:?} and {other:?}");
                assert!(other.is_cause(), "{other:?}");
            }
        }
    }
}
