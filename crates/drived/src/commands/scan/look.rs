//! What is at one address: whether anybody answers, which family he is likely of, and whether there are two of them. Only reads.

use std::time::Duration;

use drive_bus::{Line, Protocol, record::Ending};
use drive_core::{Drive, Error, Identity, PortError, SlaveAddress, Watchdog};
use drive_families::Family;

use super::answer::{Answer, Likeness};
use crate::{failure::Failure, one_drive};

/// Exceptions of a gateway: no path to the slave, and no answer from it (Modbus Application Protocol V1.1b3, section 7).
const GATEWAY: [u8; 2] = [0x0A, 0x0B];

/// How often one register is asked in a row whose answers are damaged, until they count as damaged every time: on a line that
/// damages one frame in ten by chance, one such series in ten thousand is chance.
const EVERY_TIME: u32 = 4;

/// How often something is asked that takes several exchanges, of which now one and now another is damaged.
const ASKED: u32 = 12;

/// Whether an address answers at all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Heard {
    Nothing,
    /// What cannot be understood, or two who say different things.
    Damaged(Answer),
    Somebody,
}

/// Asks an address for one register, and listens on for a second answer where one has come.
pub(super) async fn ask(line: &Line, slave: SlaveAddress, wait: Duration) -> Result<Heard, Failure> {
    // The shortest read that a family has; an exception is an answer too.
    let mut drive = open(line, Family::Atv312, slave);
    let mut before = 0;
    let asked = often(line, async || {
        before = unasked(line);
        drive.keep_alive().await
    });
    match asked.await {
        Asked::Refused(Error::Exception { code, .. }) if GATEWAY.contains(&code) => {
            return Ok(Heard::Nothing);
        }
        Asked::Refused(Error::Port { problem: PortError::Timeout { .. }, .. }) => return Ok(Heard::Nothing),
        Asked::Refused(Error::Port { problem: PortError::Expired, .. }) => {
            return Err(Failure::Drive(one_drive::NEVER_QUIET.to_owned()));
        }
        Asked::Refused(Error::Port { problem, .. }) => return Err(Failure::Input(problem.to_string())),
        Asked::Told(()) | Asked::Refused(_) => {}
        Asked::Damaged(why) => {
            let begins =
                line.exchanges().pop().is_some_and(|last| last.answer.first() == Some(&slave.number()));
            return Ok(Heard::Damaged(match begins {
                true => Answer::Two {
                    alike: Vec::new(),
                    why: format!(
                        "all {EVERY_TIME} answers begin with this address and are damaged behind it"
                    ),
                },
                false => Answer::Damaged(why),
            }));
        }
    }
    tokio::time::sleep(wait).await;
    match unasked(line) - before {
        0 => Ok(Heard::Somebody),
        strays => {
            let why = format!("another answer came after the first ({strays} bytes or frames)");
            Ok(Heard::Damaged(Answer::Two { alike: Vec::new(), why }))
        }
    }
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
    let mut drive = open(line, family, slave);
    match often(line, async || drive.status().await).await {
        // What it does not have is not in its status: a drive without a status word is none of the family.
        Asked::Told(status) if !status.is_explained() => Looks::Unlike,
        Asked::Told(_) => Looks::Like(()),
        Asked::Refused(_) => Looks::Unlike,
        Asked::Damaged(_) => Looks::Damaged,
    }
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
    Looks::Like((likeness(family, identity), drive.watchdog().await.ok()))
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
    let _ = open(line, family.unwrap_or(Family::Atv312), slave).keep_alive().await;
}

fn open(line: &Line, family: Family, slave: SlaveAddress) -> Box<dyn Drive> {
    let mut drive = family.open(line.slave(slave.number()), slave);
    one_drive::wait_at_most(&mut *drive);
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
    line.keep_exchanges(1);
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
