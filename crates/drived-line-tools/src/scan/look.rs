//! What is at one address: whether anybody answers, which family he is likely of, and whether there are two of them. Only reads.

use std::time::Duration;

use drive_bus::{
    Line,
    evidence::{Defect, Fact, Finding, What},
    record::Ending,
};
use drive_core::{Drive, Error, ExceptionMeaning, Identity, PortError, Recognised, SlaveAddress, Watchdog};
use drive_families::Family;
use tokio::time::Instant;

use super::answer::Likeness;
use drived_client::own_line;
use drived_words::failure::Failure;

/// Exceptions of a gateway: no path to the slave, and no answer from it (Modbus Application Protocol V1.1b3, section 7).
const GATEWAY: [u8; 2] = [0x0A, 0x0B];

/// How often a watchdog is asked for that does not come.
const WATCHDOG: u32 = 4;

/// How often something is asked that takes several exchanges, of which now one and now another is damaged.
const ASKED: u32 = 12;

/// How often somebody who is there is asked what he does not answer at all: one answer that does not come, or not in time, says nothing of
/// him.
const UNANSWERED: u32 = 3;

/// So many refusals of what each drive of a family answers tell that it is none of that family.
const TELL_TALE: u32 = 2;

/// How many exchanges the line keeps: those of one status.
const KEPT: usize = 8;

/// An address of a line.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub line: &'a Line,
    pub slave: SlaveAddress,
    /// Another master was heard there: what answers him is no second slave.
    pub is_shared: bool,
}

/// Whether an address answers at all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Heard {
    Nothing,
    /// What cannot be understood: why.
    Damaged(String),
    Somebody,
}

/// Asks an address for one register, and listens on for a second answer where one has come: again and again while anything is
/// odd, until the line has found what, or there was one answer and nothing else.
pub(super) async fn ask(at: At<'_>, wait: Duration) -> Result<Heard, Failure> {
    let At { line, slave, .. } = at;
    line.keep_exchanges(KEPT);
    let mut drive = open(line, Family::ATV312, slave);
    let (mut damaged, mut is_there) = (None, false);
    for _ in 0..ASKED {
        let (began, before) = (Instant::now(), unasked(line));
        // The shortest read that a family has; an exception is an answer too.
        match drive.keep_alive().await {
            Err(error @ Error::Port { .. }) if is_damaged(&error, unasked(line) > before) => {
                damaged = Some(told(&error, unasked(line) - before));
            }
            Err(Error::Exception { code, .. }) if GATEWAY.contains(&code) => return Ok(Heard::Nothing),
            Err(Error::Port { problem: PortError::Timeout { .. }, .. }) if !is_there => {
                return Ok(Heard::Nothing);
            }
            Err(Error::Port { problem: PortError::Timeout { .. }, .. }) => continue,
            Err(Error::Port { problem: PortError::Expired, .. }) => {
                return Err(Failure::Drive(own_line::NEVER_QUIET.to_owned()));
            }
            Err(Error::Port { problem, .. }) => return Err(Failure::Input(problem.to_string())),
            Ok(()) | Err(_) => {
                (damaged, is_there) = (None, true);
                tokio::time::sleep(wait).await;
            }
        }
        let is_odd =
            |fact: &Fact| fact.at >= began && fact.slave == Some(slave.number()) && is_odd(fact.what);
        if damaged.is_none() && !line.evidence().iter().any(is_odd) || found(at).is_some() {
            break;
        }
    }
    Ok(damaged.map_or(Heard::Somebody, Heard::Damaged))
}

/// Whether this is neither an answer nor silence.
const fn is_odd(what: What) -> bool {
    !matches!(what, What::Exception(_) | What::Silence | What::OthersRequest | What::OthersAnswer)
}

/// What the line has found wrong with this slave by its evidence, as `doctor` and `run` would.
pub(super) fn found(At { line, slave, is_shared }: At<'_>) -> Option<Finding> {
    let is_it = |finding: &Finding| {
        finding.slave == Some(slave.number())
            && !matches!(finding.defect, Defect::RefusesAll(_) | Defect::FellSilent(_))
            && !(is_shared && finding.is_of_two())
    };
    line.findings().into_iter().find(is_it)
}

/// What came of reading a slave as a drive of a family.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Looks<T> {
    Like(T),
    Unlike,
    /// Its answers were damaged every time.
    Damaged,
}

impl<T> From<Asked<T>> for Looks<T> {
    fn from(asked: Asked<T>) -> Self {
        match asked {
            Asked::Told(told) => Self::Like(told),
            Asked::Refused => Self::Unlike,
            Asked::Damaged => Self::Damaged,
        }
    }
}

/// Whether a slave can be read as a drive of a family, and has tripped then.
pub(super) async fn status(at: At<'_>, family: Family) -> Looks<bool> {
    let At { line, slave, .. } = at;
    let mut drive = family.open(line.slave(slave.number()).until_refused(TELL_TALE), slave);
    own_line::wait_at_most(&mut *drive);
    match often(at, async || drive.status().await).await {
        // What it does not have is not in its status: a drive without a status word is none of the family.
        Asked::Told(status) if !status.is_explained() => Looks::Unlike,
        Asked::Told(status) => Looks::Like(status.is_fault()),
        Asked::Refused => Looks::Unlike,
        Asked::Damaged => Looks::Damaged,
    }
}

/// The most words that a slave was last seen to answer a read with, over Modbus RTU. Who answers more than a family's manual
/// lets it is none of that family, whatever its words look like.
pub(super) fn longest_read(line: &Line, slave: SlaveAddress) -> u16 {
    let words = line.exchanges().into_iter().filter_map(|exchange| {
        let is_read = matches!(exchange.ending, Ending::Answered)
            && exchange.request.first() == Some(&slave.number())
            && matches!(exchange.request.get(1), Some(0x03 | 0x04));
        exchange.request.get(4..6).filter(|_| is_read).map(|count| u16::from_be_bytes([count[0], count[1]]))
    });
    words.max().unwrap_or(0)
}

/// What a drive of a family says it is, and how its watchdog is set, where it tells.
pub(super) async fn identity(at: At<'_>, family: Family) -> Looks<(Likeness, Option<Watchdog>)> {
    let mut drive = open(at.line, family, at.slave);
    let identity = match often(at, async || drive.identify().await).await {
        Asked::Told(identity) => Some(identity),
        Asked::Refused => None,
        Asked::Damaged => return Looks::Damaged,
    };
    // Some are told by registers that say no name.
    let recognised = drive.recognise(identity.as_ref().unwrap_or(&Identity::default()));
    if matches!(recognised, Recognised::NotMine { .. }) {
        return Looks::Unlike;
    }
    let likeness = likeness(family, identity);
    // Zeros and numbers look like words of a status: who has not told his name has what his family's manual says that he answers.
    if !likeness.certain && drive.keep_alive().await.is_err_and(|error| is_lacking(&error)) {
        return Looks::Unlike;
    }
    match watchdog(&mut *drive).await {
        Err(()) if !likeness.certain => Looks::Unlike,
        watchdog => Looks::Like((likeness, watchdog.ok().flatten())),
    }
}

/// How its watchdog is set; an error: it has not what its manual has. One answer that does not come says nothing of it.
async fn watchdog(drive: &mut dyn Drive) -> Result<Option<Watchdog>, ()> {
    for _ in 0..WATCHDOG {
        match drive.watchdog().await {
            Ok(watchdog) => return Ok(Some(watchdog)),
            Err(Error::Port { .. }) => {}
            Err(error) if is_lacking(&error) => return Err(()),
            Err(_) => break,
        }
    }
    Ok(None)
}

/// Whether the slave has no such function or register.
const fn is_lacking(error: &Error) -> bool {
    use ExceptionMeaning::{NoSuchFunction, NoSuchRegister};
    matches!(error, Error::Exception { meaning: NoSuchFunction | NoSuchRegister, .. })
}

/// Reads what two drives alike differ in, if in anything: voltages, temperatures, hours.
pub(super) async fn measurements(at: At<'_>, family: Family) -> Looks<()> {
    let mut drive = open(at.line, family, at.slave);
    often(at, async || drive.measurements().await.map(drop)).await.into()
}

fn likeness(family: Family, identity: Option<Identity>) -> Likeness {
    let model = identity.as_ref().and_then(|identity| identity.model.as_deref()).unwrap_or_default();
    let certain = model.to_ascii_lowercase().replace(['-', ' '], "").contains(family.capabilities().key);
    Likeness { family, certain, identity }
}

/// Asks whom we know, so that a watchdog begins anew. What comes of it is not asked: one that has gone cannot be fed.
pub(super) async fn feed(line: &Line, family: Option<Family>, slave: SlaveAddress) {
    let _ = open(line, family.unwrap_or(Family::ATV312), slave).keep_alive().await;
}

fn open(line: &Line, family: Family, slave: SlaveAddress) -> Box<dyn Drive> {
    let mut drive = family.open(line.slave(slave.number()), slave);
    own_line::wait_at_most(&mut *drive);
    drive
}

enum Asked<T> {
    Told(T),
    Refused,
    /// Every time, or until the line had found why.
    Damaged,
}

/// Asks until an answer is intact or refuses, or [does not come](UNANSWERED), but not for ever. Something short is asked in between: what
/// is damaged every time while that never is tells more.
async fn often<T>(at: At<'_>, mut ask: impl AsyncFnMut() -> Result<T, Error>) -> Asked<T> {
    let At { line, slave, .. } = at;
    let mut unanswered = 0;
    for _ in 0..ASKED {
        let before = unasked(line);
        let error = match ask().await {
            Ok(told) => return Asked::Told(told),
            Err(error) => error,
        };
        if !is_damaged(&error, unasked(line) > before) {
            let is_silence = matches!(error, Error::Port { problem: PortError::Timeout { .. }, .. });
            unanswered += u32::from(is_silence);
            if is_silence && unanswered < UNANSWERED {
                continue;
            }
            return Asked::Refused;
        }
        if found(at).is_some() {
            break;
        }
        let _ = open(line, Family::ATV312, slave).keep_alive().await;
    }
    Asked::Damaged
}

/// Whether something came that makes no answer; `strays`: something that nobody had asked for.
fn is_damaged(error: &Error, strays: bool) -> bool {
    let Error::Port { problem, .. } = error else { return false };
    matches!(problem, PortError::Damaged(_) | PortError::Mismatch(_))
        || strays && matches!(problem, PortError::Timeout { .. })
}

fn told(error: &Error, strays: u64) -> String {
    match error {
        Error::Port { problem: PortError::Timeout { .. }, .. } => {
            format!("{strays} bytes came that make no answer")
        }
        Error::Port { problem, .. } => problem.to_string(),
        _ => error.to_string(),
    }
}

/// What the line has heard that nobody has asked for.
pub(super) fn unasked(line: &Line) -> u64 {
    let stats = line.stats();
    stats.noise_bytes + stats.foreign + stats.slaves.values().map(|slave| slave.late).sum::<u64>()
}
