//! Who accepts what: answers, as manuals print them and changed, to our line and to pymodbus and libmodbus, which were written by somebody
//! else. What ours takes for an answer the other takes for the same frame; what is not changed both take.
//!
//! Ours takes more in two ways, on purpose: a frame that stands behind stray bytes, and in ASCII one that ends with another character
//! than LF, which function 08/03 changes. Then the frame has to stand in what came, and the other has to take it where it stands alone.

use std::{
    io::{self, Write as _},
    path::Path,
    process::{Command, Stdio},
    sync::Arc,
    time::{Duration, Instant as Clock},
};

use drive_bus::{
    Echo,
    exchange::{
        Machine, Step,
        ascii::{self, Ascii, AsciiSettings},
        rtu::{self, Rtu},
    },
    pdu,
};
use drive_core::serial::SerialSettings;
use tokio::time::Instant;
use tokio_modbus::Request;

use crate::{
    fuzz::{Source, change, spoken},
    report::{Find, Plant, Told},
};

const SLAVE: u8 = 1;

/// Who else is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Peer {
    /// pymodbus' framers, RTU and ASCII: they know no request.
    Pymodbus,
    /// libmodbus as a master, RTU: it holds an answer against its request.
    Libmodbus,
}

impl Peer {
    const fn script(self) -> &'static str {
        match self {
            Self::Pymodbus => "pymodbus_frames.py",
            Self::Libmodbus => "libmodbus_frames.py",
        }
    }

    fn replay(self, seed: u64, count: u64) -> String {
        format!(
            "drive-fire differential --seed {seed} --answers {count} --peer {}",
            if self == Self::Pymodbus { "pymodbus" } else { "libmodbus" }
        )
    }

    const fn part(self) -> &'static str {
        match self {
            Self::Pymodbus => "differential, with pymodbus",
            Self::Libmodbus => "differential, with libmodbus",
        }
    }
}

/// One answer to one question.
#[derive(Debug, Clone)]
struct Case {
    is_ascii: bool,
    request: Request<'static>,
    bytes: Vec<u8>,
    /// As a manual prints it.
    whole: bool,
}

fn cases(seed: u64, count: u64, peer: Peer) -> Vec<Case> {
    let mut rng = Source::seeded(seed);
    (0..count).map(|_| a_case(&mut rng, peer)).collect()
}

fn a_case(rng: &mut Source, peer: Peer) -> Case {
    let answered: [(Request<'static>, &[u8]); 6] = [
        (Request::ReadHoldingRegisters(0x6B, 3), &[3, 6, 2, 0x2B, 0, 0, 0, 0x64]),
        (Request::ReadHoldingRegisters(3201, 1), &[3, 2, 2, 0x40]),
        (Request::ReadInputRegisters(8, 1), &[4, 2, 0, 0x0A]),
        (Request::WriteSingleRegister(0x2135, 6), &[6, 0x21, 0x35, 0, 6]),
        (Request::WriteMultipleRegisters(1, vec![10, 258].into()), &[0x10, 0, 1, 0, 2]),
        (Request::ReadHoldingRegisters(3201, 1), &[0x83, 2]),
    ];
    let (request, answer) =
        answered.into_iter().nth(rng.usize(..6)).unwrap_or((Request::ReportServerId, &[]));
    let is_ascii = peer == Peer::Pymodbus && rng.bool();
    let mut bytes =
        if is_ascii { ascii::frame(SLAVE, answer, b'\n') } else { rtu::frame(SLAVE, answer) }.to_vec();
    let whole = rng.u8(..8) == 0;
    if !whole {
        change(rng, &mut bytes);
    }
    Case { is_ascii, request, bytes, whole }
}

/// The PDU that ours takes for the answer.
fn ours(case: &Case) -> Option<Vec<u8>> {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let gap = Duration::from_millis(20);
    let mut machine: Box<dyn Machine> = match case.is_ascii {
        true => Box::new(Ascii::new(settings, AsciiSettings::default(), Echo::Off)),
        false => Box::new(Rtu::new(settings, gap, Echo::Off)),
    };
    let encoded = pdu::encode(&case.request).ok()?;
    let now = Instant::now();
    machine.start(SLAVE, Arc::new(case.request.clone()), &encoded);
    machine.handle_sent(now, now + 10 * gap);
    let mut step = machine.handle_bytes(now + gap, &case.bytes);
    for _ in 0..64 {
        match step {
            Step::Done(Ok(Ok(response))) => return Some(spoken(&response)),
            Step::Done(Ok(Err(code))) => {
                return Some(vec![case.request.function_code().value() | 0x80, u8::from(code)]);
            }
            Step::Done(Err(_)) => return None,
            _ => step = machine.handle_timeout(machine.deadline()?),
        }
    }
    None
}

/// A slave and the PDU that is taken for its answer.
type Taken = (u8, Vec<u8>);

/// What the other takes, case by case.
fn theirs(python: &Path, peer: Peer, cases: &[Case]) -> io::Result<Vec<Option<Taken>>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers").join(peer.script());
    let mut child = Command::new(python).arg(script).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let line = |case: &Case| {
        let request = pdu::encode(&case.request).map(|pdu| hex(&pdu)).unwrap_or_default();
        let bytes = if case.bytes.is_empty() { "-".to_owned() } else { hex(&case.bytes) };
        format!("{} {bytes} {request}\n", if case.is_ascii { "ascii" } else { "rtu" })
    };
    let text: String = cases.iter().map(line).collect();
    let mut stdin = child.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
    // It answers while it is asked: both ways hold less than a long list.
    let asking = std::thread::spawn(move || stdin.write_all(text.as_bytes()));
    let output = child.wait_with_output()?;
    asking.join().map_err(|_| io::ErrorKind::Other)??;
    let read = |line: &str| {
        let (slave, pdu) = line.split_once(' ')?;
        let bytes = (0..pdu.len() / 2).map(|at| u8::from_str_radix(pdu.get(2 * at..2 * at + 2)?, 16).ok());
        Some((slave.parse().ok()?, bytes.collect::<Option<Vec<u8>>>()?))
    };
    Ok(String::from_utf8_lossy(&output.stdout).lines().map(read).collect())
}

/// Our side with a defect: what it would take for the answer.
type Defect = (&'static str, fn(&Case, Option<Vec<u8>>) -> Option<Vec<u8>>);

const DEFECTS: [Defect; 10] = [
    ("the CRC is not checked", |case, taken| match case.bytes.as_slice() {
        [SLAVE, pdu @ .., _, _] if !case.is_ascii && pdu.len() > 1 => Some(pdu.to_vec()),
        _ => taken,
    }),
    ("any slave answers", |case, taken| match case.bytes.as_slice() {
        [_, pdu @ .., _, _] if !case.is_ascii && pdu.first() == Some(&3) => Some(pdu.to_vec()),
        _ => taken,
    }),
    ("the last byte is lost", |_, taken| taken.map(|pdu| pdu[..pdu.len() - 1].to_vec())),
    ("the bytes of a word are swapped", |_, taken| {
        taken.map(|mut pdu| {
            let end = pdu.len();
            pdu.swap(end - 1, end - 2);
            pdu
        })
    }),
    ("nothing is taken", |_, _| None),
    ("no refusal is taken", |_, taken| taken.filter(|pdu| pdu[0] & 0x80 == 0)),
    ("a refusal is an answer", |_, taken| {
        taken.map(|mut pdu| {
            pdu[0] &= 0x7F;
            pdu
        })
    }),
    ("no ASCII is taken", |case, taken| taken.filter(|_| !case.is_ascii)),
    ("the count is one too high", |_, taken| {
        taken.map(|mut pdu| {
            pdu[1] = pdu[1].wrapping_add(1);
            pdu
        })
    }),
    ("what breaks off is filled up", |case, taken| {
        taken.or_else(|| (case.bytes.len() > 4).then(|| vec![3, 2, 0, 0]))
    }),
];

/// The frame of a PDU that ours took, and whether it stands in what came, in ASCII but for its last character.
fn stands_in(case: &Case, taken: &[u8]) -> bool {
    let frame = alone(case, taken).bytes;
    let end = frame.len() - usize::from(case.is_ascii);
    case.bytes.windows(end).any(|window| *window == frame[..end])
}

/// The same answer with nothing around it.
fn alone(case: &Case, taken: &[u8]) -> Case {
    let frame = if case.is_ascii { ascii::frame(SLAVE, taken, b'\n') } else { rtu::frame(SLAVE, taken) };
    Case { bytes: frame.to_vec(), whole: false, ..case.clone() }
}

/// What does not agree: ours takes what the other does not, or one of them does not take what a manual prints.
fn against(case: &Case, taken: Option<&[u8]>, other: Option<&Taken>) -> Option<String> {
    let same = |taken: &[u8]| other.is_some_and(|(slave, pdu)| *slave == SLAVE && pdu == taken);
    match taken {
        Some(taken) if !same(taken) && !stands_in(case, taken) => {
            Some(format!("ours takes {taken:02X?}, the other {other:02X?} of {:02X?}", case.bytes))
        }
        None if case.whole => Some(format!("ours does not take {:02X?}", case.bytes)),
        _ => None,
    }
}

/// So many answers, judged by this peer, which this Python asks.
///
/// # Errors
/// The other cannot be run.
pub fn run(python: &Path, peer: Peer, seed: u64, count: u64) -> io::Result<Told> {
    let begun = Clock::now();
    let mut told = Told::new(peer.part(), "answers");
    let cases = cases(seed, count, peer);
    let others = theirs(python, peer, &cases)?;
    if others.len() != cases.len() {
        return Err(io::Error::other(format!("{} answers to {} questions", others.len(), cases.len())));
    }
    let taken: Vec<_> = cases.iter().map(ours).collect();
    told.count = count;
    // What ours has taken, alone before the other.
    let taken_alone: Vec<Case> =
        cases.iter().zip(&taken).filter_map(|(case, taken)| Some(alone(case, taken.as_ref()?))).collect();
    let others_alone = theirs(python, peer, &taken_alone)?;
    for (case, other) in taken_alone.iter().zip(&others_alone) {
        if ours(case) != other.as_ref().map(|(_, pdu)| pdu.clone()) {
            let what = format!("alone {:02X?} is {other:02X?} to the other", case.bytes);
            told.finds.push(Find { what, replay: peer.replay(seed, count) });
        }
    }
    let both = taken.iter().zip(&others).filter(|(ours, other)| ours.is_some() && other.is_some()).count();
    let alone = taken.iter().zip(&others).filter(|(ours, other)| ours.is_none() && other.is_some()).count();
    told.details.push(format!("{both} taken by both, {alone} by the other alone"));
    let all = || cases.iter().zip(&taken).zip(&others);
    for (number, ((case, taken), other)) in all().enumerate() {
        if let Some(what) = against(case, taken.as_deref(), other.as_ref()) {
            told.finds.push(Find { what: format!("{number}: {what}"), replay: peer.replay(seed, count) });
        }
    }
    told.finds.truncate(20);
    for (name, defect) in DEFECTS {
        let found = all().position(|((case, taken), other)| {
            against(case, defect(case, taken.clone()).as_deref(), other.as_ref()).is_some()
        });
        told.plants
            .push(Plant { name: name.to_owned(), found_by: found.map(|number| format!("answer {number}")) });
    }
    told.took = begun.elapsed();
    Ok(told)
}
