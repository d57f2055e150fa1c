//! The gateway of the program beside mbusd, which was written by somebody else: the same questions to two lines with the same drives. Who
//! answers and who refuses, by which code and with how much, is the same; so are parameters that nobody writes.

use std::{
    io,
    net::TcpListener,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use fastrand::Rng;

use super::plant::{Line, Plant};
use crate::report::{Find, Plant as Planted, Told};

/// ACC, DEC and LAC, tFr, HSP, LSP of an Altivar 312 (BBV51701): parameters, the same in every one that is new.
const PARAMETERS: [u16; 5] = [9001, 9002, 3103, 3104, 3105];
/// What a 312 tells of its motor and its state, what a 21 does, and what neither has.
const OTHERS: [u16; 6] = [3201, 3202, 8501, 0xFD00, 0xFE07, 60_000];
/// The drives of both lines, and one that neither has.
const UNITS: [u8; 8] = [1, 1, 2, 2, 5, 5, 5, ABSENT];
const ABSENT: u8 = 9;

/// mbusd, and the line that it serves.
struct Mbusd {
    child: Child,
    port: u16,
    _line: Line,
}

impl Drop for Mbusd {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Mbusd {
    fn start(program: &Path, plant: &Plant) -> io::Result<Self> {
        let line = plant.another_line()?;
        let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
        // Without repetitions: whoever is not there is told as soon as ours tells it.
        let child = Command::new(program)
            .args(["-d", "-L", "-", "-v", "0", "-s", "19200", "-m", "8E1", "-A", "127.0.0.1", "-N", "0"])
            .args(["-R", "10", "-W", "500", "-P", &port.to_string(), "-p"])
            .arg(line.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        let mbusd = Self { child, port, _line: line };
        plant.until("mbusd", |plant| plant.ask_whole(port, &frame(1, &[3, 0x23, 0x29, 0, 1])).is_ok())?;
        Ok(mbusd)
    }
}

fn frame(unit: u8, pdu: &[u8]) -> Vec<u8> {
    let [high, low] = (pdu.len() as u16 + 1).to_be_bytes();
    [&[0x12, 0x34, 0, 0, high, low, unit], pdu].concat()
}

/// A question that writes nothing, and whether its answer is the same at any time.
fn question(rng: &mut Rng) -> (Vec<u8>, bool) {
    let unit = UNITS[rng.usize(..UNITS.len())];
    let is_parameter = rng.bool();
    let address = if is_parameter {
        PARAMETERS[rng.usize(..PARAMETERS.len())]
    } else {
        OTHERS[rng.usize(..OTHERS.len())]
    };
    let count = if is_parameter { 1 } else { [0, 1, 2, 4, 125, 126][rng.usize(..6)] };
    let function = [3, 3, 3, 3, 3, 3, 4, 1, 0x41][rng.usize(..9)];
    let [high, low] = address.to_be_bytes();
    (frame(unit, &[function, high, low, 0, count]), is_parameter && function == 3)
}

/// What does not agree. Behind the number, unit and length stand a function and what belongs to it.
fn against(asked: &[u8], is_constant: bool, ours: &[u8], theirs: &[u8]) -> Option<String> {
    let differ = |what: &str| Some(format!("{what}: {ours:02X?} and {theirs:02X?} to {asked:02X?}"));
    if ours.len() < 9 || theirs.len() < 9 {
        return differ("no answer");
    }
    if ours[..4] != asked[..4] || ours[6] != asked[6] {
        return differ("another number or unit");
    }
    let (function, own, others) = (ours[7], &ours[8..], &theirs[8..]);
    if function != theirs[7] {
        return differ("one answers, one refuses");
    }
    if own.len() != others.len() {
        return differ("another length");
    }
    // Ours knows its drives, and says of another that there is no way to it, where mbusd has asked in vain (0Ah and 0Bh of the
    // protocol's section 7); and of a question that has no form the one who reads it may say so, or the one who is asked.
    let is_known = match (own, others) {
        ([0x0A], [0x0B]) => asked[6] == ABSENT,
        ([0x03], [_]) => function & 0x80 != 0 && !(1..=125).contains(&asked[11]),
        _ => false,
    };
    if (function & 0x80 != 0 || is_constant) && own != others && !is_known {
        return differ(if function & 0x80 == 0 { "another value" } else { "another reason" });
    }
    None
}

/// A wrong gateway: what it would answer.
type Defect = (&'static str, fn(Vec<u8>) -> Vec<u8>);

const DEFECTS: [Defect; 10] = [
    ("it answers nothing", |_| Vec::new()),
    ("another number", |mut answer| {
        answer[0] ^= 1;
        answer
    }),
    ("another unit", |mut answer| {
        answer[6] ^= 1;
        answer
    }),
    ("another protocol", |mut answer| {
        answer[2] ^= 1;
        answer
    }),
    ("it refuses what is answered", |answer| {
        let code = [answer[7] | 0x80, 4];
        [&answer[..7], if answer[7] & 0x80 == 0 { &code } else { &answer[7..] }].concat()
    }),
    ("it answers what is refused", |mut answer| {
        answer[7] &= 0x7F;
        answer
    }),
    ("another reason", |mut answer| {
        if answer[7] & 0x80 != 0 {
            answer[8] ^= 1;
        }
        answer
    }),
    ("0Ah for every refusal", |mut answer| {
        if answer[7] & 0x80 != 0 {
            answer[8] = 0x0A;
        }
        answer
    }),
    ("a byte less", |mut answer| {
        answer.pop();
        answer
    }),
    ("the bytes of a word are swapped", |mut answer| {
        if answer.len() == 11 {
            answer.swap(9, 10);
        }
        answer
    }),
];

/// The same questions to both, for so long.
pub(super) fn run(plant: &Plant, mbusd: &Path, seed: u64, time: Duration) -> io::Result<Told> {
    let begun = Instant::now();
    let mut told = Told::new("differential, gateway with mbusd", "questions");
    let mbusd = Mbusd::start(mbusd, plant)?;
    let mut rng = Rng::with_seed(seed);
    let mut asked = Vec::new();
    while begun.elapsed() < time {
        let (question, is_constant) = question(&mut rng);
        let ours = plant.ask_whole(plant.gateway, &question)?;
        let theirs = plant.ask_whole(mbusd.port, &question)?;
        told.count += 1;
        told.count_as(
            if ours.get(7).is_some_and(|byte| byte & 0x80 != 0) { "refused" } else { "answered" },
            1,
        );
        if let Some(what) = against(&question, is_constant, &ours, &theirs) {
            told.finds.push(Find { what, replay: format!("drive-fire program --mbusd mbusd --seed {seed}") });
        }
        asked.push((question, is_constant, ours, theirs));
    }
    for (name, defect) in DEFECTS {
        let found = asked.iter().position(|(question, is_constant, ours, theirs)| {
            against(question, *is_constant, ours, theirs).is_none()
                && against(question, *is_constant, &defect(ours.clone()), theirs).is_some()
        });
        let found_by = found.map(|number| format!("question {number}"));
        told.plants.push(Planted { name: name.to_owned(), found_by });
    }
    told.took = begun.elapsed();
    Ok(told)
}
