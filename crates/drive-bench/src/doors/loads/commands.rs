//! Commands offered by three doors at once, over many connections each, by those who do not wait for answers: setpoints that rise with the
//! time, each door's to a drive of its own. A drive whose setpoint falls was given an older one behind a newer one. Each command has a name
//! with a number that rises on its connection: what is answered, and what the audit log has, is in that order, or it is counted.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here")]

use std::{
    collections::BTreeMap,
    fs,
    io::{Read, Write},
    net::TcpStream,
    os::unix::net::UnixStream,
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use super::{Got, Tally, http::Answers};
use crate::{
    doors::{
        PATIENCE,
        attacks::{Target, connect},
        connected,
        plant::{PUMP, Size},
    },
    report::Unit,
};

/// So many a second, all connections together.
const RATE: u64 = 10_000;
/// Connections of each door.
const CONNECTIONS: [(Door, u64); 3] = [(Door::Http, 24), (Door::Socket, 24), (Door::Gateway, 8)];
const TICK: Duration = Duration::from_millis(10);
/// The setpoint rises by a tenth of a hertz this often, from 5 Hz to 50.
const STEP: Duration = Duration::from_millis(200);
const LEAST: u64 = 50;
const MOST: u64 = 500;
/// How many files of the audit log there may be beside the newest.
const AUDIT_FILES: u32 = 20;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Door {
    Http,
    Socket,
    Gateway,
}

impl Door {
    const fn name(self) -> &'static str {
        match self {
            Self::Http => "HTTP",
            Self::Socket => "the socket",
            Self::Gateway => "the gateway",
        }
    }

    /// The drive that it commands.
    const fn slave(self) -> u8 {
        let last = Size::FULL.commanded;
        match self {
            Self::Http => last - 2,
            Self::Socket => last - 1,
            Self::Gateway => last,
        }
    }

    /// A setpoint, named by the connection and its number on it where the door has names.
    fn request(self, token: &str, connection: u64, number: u64, tenths: u64) -> Vec<u8> {
        let slave = self.slave();
        if self == Self::Gateway {
            // Altivar 312, LFr (8502), in tenths of a hertz; the transaction is the number.
            let [high, low] = u16::try_from(tenths).unwrap_or(u16::MAX).to_be_bytes();
            let [first, second] = (number as u16).to_be_bytes();
            return vec![first, second, 0, 0, 0, 6, slave, 6, 0x21, 0x36, high, low];
        }
        let token = match self {
            Self::Http => format!("Authorization: Bearer {token}\r\n"),
            _ => String::new(),
        };
        let body = format!(
            "{{\"id\":\"c{connection}-{number}\",\"setpoint\":{{\"frequency_hz\":{}.{}}}}}",
            tenths / 10,
            tenths % 10
        );
        format!(
            "POST /api/v1/drives/{PUMP}%20{slave}/setpoint?wait=0 HTTP/1.1\r\nHost: localhost\r\n{token}Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )
        .into_bytes()
    }
}

/// What is read and written on a connection.
type Ends = (Box<dyn Read + Send>, Box<dyn Write + Send>);

fn open(door: Door, to: &Target) -> std::io::Result<Ends> {
    let of_tcp = |stream: TcpStream| Ok::<Ends, _>((Box::new(stream.try_clone()?), Box::new(stream)));
    match door {
        Door::Http => of_tcp(connect(to.http)?),
        Door::Gateway => of_tcp(connect(to.gateway)?),
        Door::Socket => {
            let stream = UnixStream::connect(&to.socket)?;
            stream.set_write_timeout(Some(PATIENCE))?;
            stream.set_read_timeout(Some(PATIENCE))?;
            Ok((Box::new(stream.try_clone()?), Box::new(stream)))
        }
    }
}

pub(super) fn offer(to: &Target, over: &AtomicBool) -> Vec<Got> {
    let (begun, before) = (Instant::now(), became(to));
    let connections: u64 = CONNECTIONS.iter().map(|(_, connections)| connections).sum();
    let all = Mutex::new(Tally::default());
    thread::scope(|scope| {
        for (door, number) in CONNECTIONS {
            for connection in 0..number {
                let (all, connection) = (&all, connection * 10 + door.slave() as u64);
                scope.spawn(move || {
                    let tally = one(door, to, (connection, connections), begun, over);
                    all.lock().unwrap_or_else(PoisonError::into_inner).add(tally);
                });
            }
        }
    });
    let time = begun.elapsed().as_secs_f64();
    let became = became(to);
    let mut got = Vec::new();
    for (what, count) in all.into_inner().unwrap_or_else(PoisonError::into_inner).0 {
        got.push(Got::new(what + " a second", Unit::Count, count as f64 / time));
    }
    for ((origin, outcome), count) in became {
        let count = count - before.get(&(origin.clone(), outcome.clone())).copied().unwrap_or_default();
        if count > 0.0 && origin != "mqtt" && origin != "sparkplug" {
            got.push(Got::new(format!("by {origin}: {outcome} a second"), Unit::Count, count / time));
        }
    }
    let (written, out_of_order) = audited(&to.audit);
    got.push(Got::new("commands in the audit log a second", Unit::Count, written as f64 / time));
    got.push(Got::new("of them behind a later one of their connection", Unit::Count, out_of_order as f64));
    got
}

/// How many of these commands the audit log has, and how many of them stand behind one that was given after them.
fn audited(log: &Path) -> (u64, u64) {
    let aside = (1..=AUDIT_FILES).rev().map(|number| format!("{}.{number}", log.display()));
    let files = aside.chain([log.display().to_string()]);
    let (mut last, mut written, mut out_of_order) = (BTreeMap::<u64, u64>::new(), 0, 0);
    for text in files.filter_map(|file| fs::read_to_string(file).ok()) {
        for line in text.lines().filter(|line| line.contains("\"kind\":\"command\"")) {
            let id = line.split_once("\"id\":\"c").and_then(|(_, rest)| rest.split('"').next());
            let Some((connection, number)) = id.and_then(numbers) else { continue };
            written += 1;
            let before = last.insert(connection, number);
            out_of_order += u64::from(before.is_some_and(|before| before > number));
        }
    }
    (written, out_of_order)
}

/// The connection and the number of a command, by its name without the letter.
fn numbers(id: &str) -> Option<(u64, u64)> {
    let (connection, number) = id.split_once('-')?;
    Some((connection.parse().ok()?, number.parse().ok()?))
}

/// What became of setpoints so far, as the metrics tell it, by their origin and outcome.
fn became(to: &Target) -> BTreeMap<(String, String), f64> {
    let read = || {
        let mut stream = connected(to.http)?;
        let head = "GET /metrics HTTP/1.0\r\nHost: localhost\r\n";
        stream.write_all(format!("{head}Authorization: Bearer {}\r\n\r\n", to.token).as_bytes())?;
        let mut text = String::new();
        stream.read_to_string(&mut text).map(|_| text)
    };
    let text = read().unwrap_or_default();
    let mut became = BTreeMap::new();
    for line in text.lines().filter(|line| line.starts_with("drived_commands_total{")) {
        let label = |name: &str| {
            let (_, rest) = line.split_once(&format!("{name}=\""))?;
            rest.split('"').next().map(str::to_owned)
        };
        let count = line.rsplit(' ').next().and_then(|count| count.parse::<f64>().ok());
        if let (Some("setpoint"), Some(origin), Some(outcome), Some(count)) =
            (label("action").as_deref(), label("origin"), label("outcome"), count)
        {
            *became.entry((origin, outcome)).or_default() += count;
        }
    }
    became
}

/// Offers on one of so many connections until it is over. One that is closed is opened again.
fn one(
    door: Door,
    to: &Target,
    (connection, connections): (u64, u64),
    begun: Instant,
    over: &AtomicBool,
) -> Tally {
    let (offered, mut tally, name) = (AtomicU64::new(0), Tally::default(), door.name());
    let is_over = || over.load(Ordering::Relaxed);
    while !is_over() {
        let Ok((mut reads, mut writes)) = open(door, to) else {
            tally.count(format!("{name}: could not connect"));
            thread::sleep(TICK);
            continue;
        };
        let (ends, from) = (AtomicBool::new(false), offered.load(Ordering::Relaxed));
        thread::scope(|scope| {
            scope.spawn(|| {
                let (since, mut given) = (Instant::now(), 0);
                while !is_over() && !ends.load(Ordering::Relaxed) {
                    let steps = (begun.elapsed().as_millis() / STEP.as_millis()) as u64;
                    let due = since.elapsed().as_millis() as u64 * RATE / connections / 1_000;
                    let mut all = Vec::new();
                    for number in given..due {
                        let tenths = (LEAST + steps).min(MOST);
                        all.extend(door.request(&to.token, connection, from + number, tenths));
                    }
                    if writes.write_all(&all).is_err() {
                        ends.store(true, Ordering::Relaxed);
                    } else {
                        offered.fetch_add(due - given, Ordering::Relaxed);
                        given = due;
                    }
                    thread::sleep(TICK);
                }
            });
            let (mut heard, mut buffer, mut next) = (Vec::new(), vec![0; 65_536], from);
            while !is_over() && !ends.load(Ordering::Relaxed) {
                match reads.read(&mut buffer) {
                    Ok(read) if read > 0 => {
                        heard.extend_from_slice(buffer.get(..read).unwrap_or_default());
                        let tell = &mut |number: Option<u64>, answer: String| {
                            let is_its_own =
                                number.is_none_or(|number| door.answers_at_once() || number == next);
                            if !is_its_own {
                                tally.count(format!("{name}: answered out of order"));
                            }
                            next += 1;
                            tally.count(format!("{name}: {answer}"));
                        };
                        match door {
                            Door::Gateway => answers_of_modbus(&mut heard, tell),
                            _ => answers_of_http(&mut heard, tell),
                        }
                    }
                    _ => {
                        tally.count(format!("{name}: connections that ended"));
                        ends.store(true, Ordering::Relaxed);
                    }
                }
            }
            ends.store(true, Ordering::Relaxed);
        });
    }
    tally.0.insert(format!("{name}: offered"), offered.into_inner());
    tally
}

impl Door {
    /// Whether what it refuses is answered before what it is still about, as a transaction may be in Modbus TCP.
    const fn answers_at_once(self) -> bool {
        matches!(self, Self::Gateway)
    }
}

fn answers_of_http(heard: &mut Vec<u8>, tell: &mut dyn FnMut(Option<u64>, String)) {
    let mut answers = Answers::of(std::mem::take(heard));
    while let Some(answer) = answers.next() {
        let id = answer.id.as_deref().and_then(|id| numbers(id.strip_prefix('c')?));
        tell(id.map(|(_, number)| number), format!("answered {}", answer.name()));
    }
    *heard = answers.rest();
}

fn answers_of_modbus(heard: &mut Vec<u8>, tell: &mut dyn FnMut(Option<u64>, String)) {
    // The header of MBAP: transaction, protocol, the length of what follows, unit; then the function and, of an exception, its code.
    while let Some(&[first, second, _, _, high, low, _, function, code]) = heard.first_chunk::<9>() {
        let whole = 6 + usize::from(u16::from_be_bytes([high, low]));
        if heard.len() < whole {
            return;
        }
        let number = u64::from(u16::from_be_bytes([first, second]));
        let became = match function & 0x80 {
            0 => "confirmed".to_owned(),
            _ => format!("refused by {code:02X}h"),
        };
        tell(Some(number), became);
        heard.drain(..whole);
    }
}
