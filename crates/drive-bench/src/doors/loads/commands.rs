//! Commands offered by three doors at once, each by one who does not wait for answers: setpoints that rise with the time, each door's
//! to a drive of its own. A drive whose setpoint falls was given an older one behind a newer one.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here")]

use std::{
    collections::BTreeMap,
    io::{Read, Write},
    net::TcpStream,
    os::unix::net::UnixStream,
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
    thread,
    time::{Duration, Instant},
};

use super::{Got, Tally, http::Answers};
use crate::{
    doors::{
        PATIENCE,
        attacks::Target,
        connected,
        plant::{PUMP, Size},
    },
    report::Unit,
};

/// So many a second of each of the three.
const RATE: u64 = 3_334;
const TICK: Duration = Duration::from_millis(10);
/// The setpoint rises by a tenth of a hertz this often, from 5 Hz to 50.
const STEP: Duration = Duration::from_millis(200);
const LEAST: u64 = 50;
const MOST: u64 = 500;

pub(super) fn offer(to: &Target, over: &AtomicBool) -> Vec<Got> {
    let (begun, before) = (Instant::now(), became(to));
    let last = Size::FULL.commanded;
    let by_http = |slave: u8, token: Option<&str>| {
        let token = token.map_or_else(String::new, |token| format!("Authorization: Bearer {token}\r\n"));
        let path = format!("/api/v1/drives/{PUMP}%20{slave}/setpoint?wait=0");
        move |tenths: u64| {
            let body = format!("{{\"setpoint\":{{\"frequency_hz\":{}.{}}}}}", tenths / 10, tenths % 10);
            format!(
                "POST {path} HTTP/1.1\r\nHost: localhost\r\n{token}Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
                body.len()
            )
            .into_bytes()
        }
    };
    // Altivar 312, LFr (8502), in tenths of a hertz.
    let frame = |tenths: u64| {
        let [high, low] = u16::try_from(tenths).unwrap_or(u16::MAX).to_be_bytes();
        vec![0, 1, 0, 0, 0, 6, last, 6, 0x21, 0x36, high, low]
    };
    let all = thread::scope(|scope| {
        let http = scope.spawn(|| {
            let open = || connected(to.http).and_then(|stream| Ok((stream.try_clone()?, stream)));
            one("HTTP", open, by_http(last - 2, Some(&to.token)), answers_of_http, over)
        });
        let socket = scope.spawn(|| {
            let open = || {
                let stream = UnixStream::connect(&to.socket)?;
                stream.set_write_timeout(Some(PATIENCE))?;
                stream.set_read_timeout(Some(PATIENCE))?;
                Ok((stream.try_clone()?, stream))
            };
            one("the socket", open, by_http(last - 1, None), answers_of_http, over)
        });
        let gateway = scope.spawn(|| {
            let open =
                || connected(to.gateway).and_then(|stream: TcpStream| Ok((stream.try_clone()?, stream)));
            one("the gateway", open, frame, answers_of_modbus, over)
        });
        [http, socket, gateway].map(|one| one.join().unwrap_or_default())
    });
    let time = begun.elapsed().as_secs_f64();
    let became = became(to);
    let mut got = Vec::new();
    for tally in all {
        for (what, count) in tally.0 {
            got.push(Got::new(what + " a second", Unit::Count, count as f64 / time));
        }
    }
    for ((origin, outcome), count) in became {
        let count = count - before.get(&(origin.clone(), outcome.clone())).copied().unwrap_or_default();
        if count > 0.0 && origin != "mqtt" && origin != "sparkplug" {
            got.push(Got::new(format!("by {origin}: {outcome} a second"), Unit::Count, count / time));
        }
    }
    got
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

/// Offers by one door until it is over. A connection that is closed is opened again.
fn one<S: Read + Write + Send>(
    door: &str,
    open: impl Fn() -> std::io::Result<(S, S)>,
    request: impl Fn(u64) -> Vec<u8> + Sync,
    take: fn(&mut Vec<u8>, &mut dyn FnMut(String)),
    over: &AtomicBool,
) -> Tally {
    let (begun, offered, mut tally) = (Instant::now(), AtomicU64::new(0), Tally::default());
    while !over.load(Ordering::Relaxed) {
        let Ok((mut reads, mut writes)) = open() else {
            tally.count(format!("{door}: could not connect"));
            thread::sleep(TICK);
            continue;
        };
        let ends = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                let mut owed = 0;
                while !over.load(Ordering::Relaxed) && !ends.load(Ordering::Relaxed) {
                    let now = Instant::now();
                    let steps = (begun.elapsed().as_millis() / STEP.as_millis()) as u64;
                    let one = request((LEAST + steps).min(MOST));
                    owed += RATE * TICK.as_millis() as u64;
                    let many = owed / 1_000;
                    owed %= 1_000;
                    let all = one.repeat(usize::try_from(many).unwrap_or_default());
                    if writes.write_all(&all).is_err() {
                        ends.store(true, Ordering::Relaxed);
                    } else {
                        offered.fetch_add(many, Ordering::Relaxed);
                    }
                    thread::sleep(TICK.saturating_sub(now.elapsed()));
                }
            });
            let (mut heard, mut buffer) = (Vec::new(), vec![0; 65_536]);
            while !over.load(Ordering::Relaxed) && !ends.load(Ordering::Relaxed) {
                match reads.read(&mut buffer) {
                    Ok(read) if read > 0 => {
                        heard.extend_from_slice(buffer.get(..read).unwrap_or_default());
                        take(&mut heard, &mut |answer| tally.count(format!("{door}: {answer}")));
                    }
                    _ => {
                        tally.count(format!("{door}: connections that ended"));
                        ends.store(true, Ordering::Relaxed);
                    }
                }
            }
            ends.store(true, Ordering::Relaxed);
        });
    }
    tally.0.insert(format!("{door}: offered"), offered.into_inner());
    tally
}

fn answers_of_http(heard: &mut Vec<u8>, tell: &mut dyn FnMut(String)) {
    let mut answers = Answers::of(std::mem::take(heard));
    while let Some(answer) = answers.next() {
        tell(format!("answered {}", answer.name()));
    }
    *heard = answers.rest();
}

fn answers_of_modbus(heard: &mut Vec<u8>, tell: &mut dyn FnMut(String)) {
    // The header of MBAP: transaction, protocol, the length of what follows, unit; then the function and, of an exception, its code.
    while let Some(&[_, _, _, _, high, low, _, function, code]) = heard.first_chunk::<9>() {
        let whole = 6 + usize::from(u16::from_be_bytes([high, low]));
        if heard.len() < whole {
            return;
        }
        tell(match function & 0x80 {
            0 => "confirmed".to_owned(),
            _ => format!("refused by {code:02X}h"),
        });
        heard.drain(..whole);
    }
}
