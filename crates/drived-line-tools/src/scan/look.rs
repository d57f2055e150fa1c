//! What is at one address: whether anybody answers, which family he is likely of, and whether there are two of them. Only reads.

use std::time::Duration;

use drive_bus::{
    Line, Protocol,
    evidence::{Defect, Fact, Finding, What},
    record::Ending,
};
use drive_core::{Drive, Error, Identity, PortError, SlaveAddress, Watchdog};
use drive_families::Family;
use tokio::time::Instant;

use super::answer::{Answer, Likeness};
use drived_client::own_line;
use drived_words::failure::Failure;

/// Exceptions of a gateway: no path to the slave, and no answer from it (Modbus Application Protocol V1.1b3, section 7).
const GATEWAY: [u8; 2] = [0x0A, 0x0B];

/// How often one register is asked in a row whose answers are damaged, until they count as damaged every time: on a line that
/// damages one frame in ten by chance, one such series in ten thousand is chance.
const EVERY_TIME: u32 = 4;

/// How often something is asked that takes several exchanges, of which now one and now another is damaged.
const ASKED: u32 = 12;

/// So many refusals of what each drive of a family answers tell that it is none of that family.
const TELL_TALE: u32 = 2;

/// How many exchanges the line keeps: those of one status.
const KEPT: usize = 8;

/// Whether an address answers at all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Heard {
    Nothing,
    /// What cannot be understood, or two who say different things.
    Damaged(Answer),
    Somebody,
}

/// How often an address has to answer twice to one question until that is no chance.
const TWICE: u32 = 2;

/// Asks an address for one register, and listens on for a second answer where one has come.
pub(super) async fn ask(line: &Line, slave: SlaveAddress, wait: Duration) -> Result<Heard, Failure> {
    for _ in 0..TWICE {
        let began = Instant::now();
        if let Some(heard) = ask_once(line, slave).await? {
            return Ok(heard);
        }
        tokio::time::sleep(wait).await;
        let mut since = line.evidence();
        since.retain(|fact| fact.at >= began);
        let is_second = |fact: &Fact| {
            fact.slave == Some(slave.number()) && matches!(fact.what, What::Doubled | What::Contradicted)
        };
        // Where another master asks the same slave its answer to him is no second answer to us.
        let is_shared = since.iter().any(|fact| fact.what == What::OthersRequest);
        if is_shared || !since.iter().any(is_second) {
            return Ok(Heard::Somebody);
        }
    }
    let why = format!("{TWICE} of {TWICE} times another answer came after the first");
    Ok(Heard::Damaged(Answer::Two { alike: Vec::new(), why }))
}

/// Asks it once, and again where the answer is damaged. `None`: it answers.
async fn ask_once(line: &Line, slave: SlaveAddress) -> Result<Option<Heard>, Failure> {
    // The shortest read that a family has; an exception is an answer too.
    let mut drive = open(line, Family::ATV312, slave);
    Ok(match often(line, async || drive.keep_alive().await).await {
        Asked::Refused(Error::Exception { code, .. }) if GATEWAY.contains(&code) => Some(Heard::Nothing),
        Asked::Refused(Error::Port { problem: PortError::Timeout { .. }, .. }) => Some(Heard::Nothing),
        Asked::Refused(Error::Port { problem: PortError::Expired, .. }) => {
            return Err(Failure::Drive(own_line::NEVER_QUIET.to_owned()));
        }
        Asked::Refused(Error::Port { problem, .. }) => return Err(Failure::Input(problem.to_string())),
        Asked::Told(()) | Asked::Refused(_) => None,
        Asked::Damaged(why) => {
            let begins =
                line.exchanges().pop().is_some_and(|last| last.answer.first() == Some(&slave.number()));
            Some(Heard::Damaged(match cut(line, slave) {
                Some(cut) => Answer::Damaged(cut),
                None if begins => Answer::Two {
                    alike: Vec::new(),
                    why: format!(
                        "all {EVERY_TIME} answers begin with this address and are damaged behind it"
                    ),
                },
                None => Answer::Damaged(why),
            }))
        }
    })
}

/// What the line has found to be done to every answer of a slave, which is no second one.
pub(super) fn cut(line: &Line, slave: SlaveAddress) -> Option<String> {
    let is_it = |finding: &Finding| {
        finding.slave == Some(slave.number())
            && matches!(
                finding.defect,
                Defect::FirstByteCut | Defect::LastByteCut | Defect::BytesBehind | Defect::OneAnswerBehind
            )
    };
    line.findings().into_iter().find(is_it).map(|finding| finding.to_string())
}

/// What came of reading a slave as a drive of a family.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Looks<T> {
    Like(T),
    Unlike,
    /// Its answers were damaged every time, while others never are.
    Damaged,
}

impl<T> From<Asked<T>> for Looks<T> {
    fn from(asked: Asked<T>) -> Self {
        match asked {
            Asked::Told(told) => Self::Like(told),
            Asked::Refused(_) => Self::Unlike,
            Asked::Damaged(_) => Self::Damaged,
        }
    }
}

/// Whether a slave can be read as a drive of a family.
pub(super) async fn status(line: &Line, family: Family, slave: SlaveAddress) -> Looks<()> {
    let mut drive = family.open(line.slave(slave.number()).until_refused(TELL_TALE), slave);
    own_line::wait_at_most(&mut *drive);
    match often(line, async || drive.status().await).await {
        // What it does not have is not in its status: a drive without a status word is none of the family.
        Asked::Told(status) if !status.is_explained() => Looks::Unlike,
        Asked::Told(_) => Looks::Like(()),
        Asked::Refused(_) => Looks::Unlike,
        Asked::Damaged(_) => Looks::Damaged,
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
pub(super) async fn identity(
    line: &Line,
    family: Family,
    slave: SlaveAddress,
) -> Looks<(Likeness, Option<Watchdog>)> {
    let mut drive = open(line, family, slave);
    let identity = match often(line, async || drive.identify().await).await {
        Asked::Told(identity) => Some(identity),
        Asked::Refused(_) => None,
        Asked::Damaged(_) => return Looks::Damaged,
    };
    Looks::Like((likeness(family, identity), watchdog(&mut *drive).await))
}

/// How its watchdog is set. One answer that does not come says nothing of it.
async fn watchdog(drive: &mut dyn Drive) -> Option<Watchdog> {
    for _ in 0..EVERY_TIME {
        match drive.watchdog().await {
            Ok(watchdog) => return Some(watchdog),
            Err(Error::Port { .. }) => {}
            Err(_) => break,
        }
    }
    None
}

/// Reads what two drives alike differ in, if in anything: voltages, temperatures, hours.
pub(super) async fn measurements(line: &Line, family: Family, slave: SlaveAddress) -> Looks<()> {
    let mut drive = open(line, family, slave);
    often(line, async || drive.measurements().await.map(drop)).await.into()
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
    Refused(Error),
    /// At one register every time.
    Damaged(String),
}

/// Asks until an answer is intact or refuses, but not for ever.
async fn often<T>(line: &Line, mut ask: impl AsyncFnMut() -> Result<T, Error>) -> Asked<T> {
    line.keep_exchanges(KEPT);
    // The beginning of a request up to its register; how many words it asks for may change.
    let register = if line.config().protocol == Protocol::Rtu { 4 } else { 9 };
    let (mut last, mut in_a_row) = (None, 0);
    let mut asked = 0;
    loop {
        asked += 1;
        let before = unasked(line);
        let error = match ask().await {
            Ok(told) => return Asked::Told(told),
            Err(error) => error,
        };
        let why = match &error {
            Error::Port { problem: problem @ (PortError::Damaged(_) | PortError::Mismatch(_)), .. } => {
                problem.to_string()
            }
            Error::Port { problem: PortError::Timeout { .. }, .. } if unasked(line) > before => {
                format!("{} bytes came that make no answer", unasked(line) - before)
            }
            _ => return Asked::Refused(error),
        };
        let exchange = line.exchanges().pop();
        let is_doubted = exchange.as_ref().is_some_and(|exchange| exchange.ending == Ending::Doubted);
        let request = exchange.and_then(|exchange| exchange.request.get(..register).map(<[u8]>::to_vec));
        in_a_row = match last == request {
            // It may be a right answer to what was asked before.
            _ if is_doubted => 0,
            true => in_a_row + 1,
            false => 1,
        };
        last = request;
        if in_a_row == EVERY_TIME {
            return Asked::Damaged(why);
        }
        if asked == ASKED {
            return Asked::Refused(error);
        }
    }
}

/// What the line has heard that nobody has asked for.
fn unasked(line: &Line) -> u64 {
    let stats = line.stats();
    stats.noise_bytes + stats.foreign + stats.slaves.values().map(|slave| slave.late).sum::<u64>()
}
