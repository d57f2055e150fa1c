//! What is seen of a drive, a line or the program at one moment: [`Look`]. What is not so and what cannot be seen are two things.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::evidence::{Defect, Finding};
use drive_core::{Error, PortError};
use tokio::time::Instant;

use super::table::AlarmKind;
use crate::{
    concern::ConcernKind,
    place::Place,
    settings::RunRecord,
    snapshot::{Link, Snapshot},
};

/// A moment by both clocks: what is kept goes by the wall's, for it outlives the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// By the steady clock.
    pub at: Instant,
    /// By the wall's, in milliseconds since 1970.
    pub unix_ms: u64,
}

impl Moment {
    /// When something was by the wall's clock.
    fn of(self, at: Instant) -> u64 {
        self.unix_ms.saturating_sub(milliseconds(self.at.saturating_duration_since(at)))
    }
}

pub(super) fn milliseconds(time: Duration) -> u64 {
    u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
}

/// Something that is so.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Condition {
    /// What.
    pub kind: AlarmKind,
    /// Which of several of its kind.
    pub mark: Option<String>,
    /// Since when, in milliseconds since 1970; `None`: since it is seen.
    pub since_unix_ms: Option<u64>,
    /// What is known of it besides.
    pub detail: Option<String>,
    /// What to do first, where that is not what its kind says.
    pub remedy: Option<String>,
    /// The codes of the faults that it is of; none: they are not known.
    pub faults: Vec<u16>,
    /// By what it is so, where its detail says that in other words each time.
    pub because: Option<Because>,
}

/// By what a drive does not answer. One alarm is told in one text for as long as this is the same: each question to a drive that is lost ends in
/// another error, and the next one is another number of seconds away.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Because {
    /// Nobody has asked it: that tells nothing of the drive, and nothing else of what was told.
    NotAsked,
    /// It was asked, and says nothing.
    Silent,
    /// Another one, in words.
    Other(String),
}

impl Because {
    /// That of an error, and the error in words that last.
    fn of(error: &Error) -> (Self, String) {
        let text = error.to_string();
        let Error::Port { slave, exchange, problem } = error else {
            return (Self::Other(text.clone()), text);
        };
        match problem {
            PortError::Offline { .. } => {
                (Self::Silent, format!("slave {slave}, {exchange}: the slave is off-line"))
            }
            PortError::Timeout { .. } => (Self::Silent, text),
            PortError::Expired | PortError::Superseded | PortError::QueueFull(_) => (Self::NotAsked, text),
            PortError::NeverQuiet { .. } => (Self::Other("the line is never quiet".to_owned()), text),
            _ => (Self::Other(text.clone()), text),
        }
    }
}

/// What is seen of something.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Look {
    /// The drive.
    pub drive: Option<String>,
    /// The line, or that of the drive; without either it is the program.
    pub line: Option<String>,
    /// What is so.
    pub there: Vec<Condition>,
    /// The kinds of which it would be seen if they were so: what is not there of these has returned, and of others it is not known.
    pub seen: Vec<AlarmKind>,
}

/// What is seen of a line besides its drives.
#[derive(Debug, Clone, Default)]
pub struct LineSeen<'a> {
    /// Why its port is not there; `None`: it is.
    pub away: Option<String>,
    /// What it has found wrong; `None` where it has not been heard for long enough to say so.
    pub findings: Option<&'a [Finding]>,
}

impl Look {
    /// At a drive on a line.
    #[must_use]
    pub fn at_drive(line: &str, snapshot: &Snapshot, now: Moment) -> Self {
        let condition = |kind: AlarmKind| {
            let AlarmKind::Drive(concern) = kind else { return None };
            let found = snapshot.concern_of(concern, now.at)?;
            let lasts = found.lasts(now.at).unwrap_or_default();
            let by = snapshot.error.as_ref().filter(|_| found.is_by_error()).map(Because::of);
            let (because, detail) =
                by.map_or((None, found.detail), |(because, text)| (Some(because), Some(text)));
            (lasts >= kind.lasts_at_least()).then(|| Condition {
                kind,
                mark: None,
                since_unix_ms: found.since.map(|since| now.of(since)),
                detail,
                remedy: None,
                faults: match concern {
                    ConcernKind::Tripped => snapshot.present_faults(),
                    _ => Vec::new(),
                },
                because,
            })
        };
        let seen = |kind: &AlarmKind| match kind {
            AlarmKind::Drive(concern) => snapshot.would_show(*concern, now.at),
            _ => false,
        };
        Self {
            drive: Some(snapshot.name.to_string()),
            line: Some(line.to_owned()),
            there: alarms_of_drives().filter_map(condition).collect(),
            seen: alarms_of_drives().filter(seen).collect(),
        }
    }

    /// At a line, with all its drives.
    #[must_use]
    pub fn at_line(line: &str, drives: &[&Snapshot], seen: &LineSeen<'_>, now: Moment) -> Self {
        let (mut there, mut kinds) = (Vec::new(), vec![AlarmKind::LineAway]);
        if let Some(why) = &seen.away {
            there.push(condition(AlarmKind::LineAway, None, Some(why.clone())));
        } else if drives.iter().any(|drive| drive.link == Link::Connected || drive.refuses())
            || drives.len() < 2
        {
            kinds.push(AlarmKind::LineSilent);
        } else if drives.iter().all(|drive| does_not_answer(drive)) {
            let heard = drives.iter().filter_map(|drive| drive.status.as_ref()).map(|status| status.at).max();
            let detail = Some(format!("{} drives", drives.len()));
            let since_unix_ms = heard.map(|at| now.of(at));
            there.push(Condition { since_unix_ms, ..condition(AlarmKind::LineSilent, None, detail) });
        }
        if let Some(findings) = seen.findings {
            kinds.push(AlarmKind::LineFinding);
            // That somebody does not answer any more is told of the drive.
            let told = findings.iter().filter(|one| !matches!(one.defect, Defect::FellSilent(_)));
            there.extend(told.map(|finding| {
                let mark = match finding.slave {
                    Some(slave) => format!("{} {slave}", finding.defect.name()),
                    None => finding.defect.name().to_owned(),
                };
                let detail = match finding.slave {
                    Some(slave) => format!("address {slave}: {finding}"),
                    None => finding.to_string(),
                };
                let remedy = finding.next().first().map(|next| (*next).to_owned());
                Condition { remedy, ..condition(AlarmKind::LineFinding, Some(mark), Some(detail)) }
            }));
        }
        Self { drive: None, line: Some(line.to_owned()), there, seen: kinds }
    }

    /// At what is to be seen to of a drive after so many hours or starts: what of it is due, each by its name and with why.
    #[must_use]
    pub fn at_maintenance(line: &str, drive: &str, due: &[(String, String)]) -> Self {
        let due = due.iter();
        let there =
            due.map(|(part, why)| condition(AlarmKind::Maintenance, Some(part.clone()), Some(why.clone())));
        Self {
            drive: Some(drive.to_owned()),
            line: Some(line.to_owned()),
            there: there.collect(),
            seen: vec![AlarmKind::Maintenance],
        }
    }

    /// At the program, with what is wrong with it, in words, and with what an earlier run has left of drives that are not in the
    /// configuration: which drive, and its record, by its place. What is not there is not so.
    #[must_use]
    pub fn at_program(
        wrong: &BTreeMap<AlarmKind, String>,
        left: &BTreeMap<Place, (String, RunRecord)>,
    ) -> Self {
        let wrong = wrong.iter().map(|(kind, why)| condition(*kind, None, Some(why.clone())));
        let left = left.iter().map(|(place, (drive, run))| {
            let kind = if run.stop.is_some() { AlarmKind::StopLeft } else { AlarmKind::RunLeft };
            condition(kind, Some(place.to_string()), Some(drive.clone()))
        });
        let there = wrong.chain(left).collect();
        Self { drive: None, line: None, there, seen: AlarmKind::all().collect() }
    }
}

fn condition(kind: AlarmKind, mark: Option<String>, detail: Option<String>) -> Condition {
    Condition { kind, mark, since_unix_ms: None, detail, remedy: None, faults: Vec::new(), because: None }
}

fn alarms_of_drives() -> impl Iterator<Item = AlarmKind> {
    AlarmKind::all().filter(|kind| matches!(kind, AlarmKind::Drive(_)))
}

/// Whether a drive does not answer, and not only has not been asked yet.
fn does_not_answer(drive: &Snapshot) -> bool {
    match drive.link {
        Link::Lost => true,
        Link::Connecting => drive.error.is_some(),
        Link::Connected => false,
    }
}
