//! The wait of a stop at each door of the daemon while somebody does his worst at another: from the act of whoever stops (the
//! pointer or the key goes down, the request is sent) until the stop waits for its line. The program `drived` is looked for beside
//! this one; the page is pressed in a Chromium over Playwright, and MQTT goes over a mosquitto, where they are installed.
//!
//! HTTP, socket and page: until the answer is whole that it was taken, which is given when it waits for its line. Gateway and MQTT,
//! which are answered otherwise: until somebody on the socket has heard of the command. Both are a little later than the queue.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here: each attacker is a thread")]

mod attacks;
mod browser;
mod observer;
pub(crate) mod plant;

use std::{
    io::{Error as IoError, ErrorKind, Read as _, Write as _},
    net::TcpStream,
    os::unix::net::UnixStream,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use self::{
    attacks::ATTACKS,
    browser::Browser,
    observer::Observer,
    plant::{Plant, until},
};
use crate::{
    Error,
    report::{Goal, Report, Unit},
};

const SECTION: &str = "doors";
/// Stops at each door under each attack.
const STOPS: usize = 100;
/// What a stop may take until it waits for its line, at p99.
const GOAL_MS: f64 = 50.0;
/// Whoever has not answered by then has not taken it.
const PATIENCE: Duration = Duration::from_secs(5);
const BETWEEN: Duration = Duration::from_millis(20);

/// Measures each door under each attack.
pub(crate) fn measure(report: &mut Report) -> Result<(), Error> {
    let plant = Plant::start()?;
    let mut stopper = Stopper::of(&plant)?;
    let doors: Vec<Door> = DOORS.into_iter().filter(|door| stopper.has(*door)).collect();
    for left_out in DOORS.into_iter().filter(|door| !stopper.has(*door)) {
        eprintln!("drive-bench: {} is left out: {}", left_out.name(), left_out.wants());
    }
    for door in &doors {
        until(|| stopper.stop(*door).is_ok_and(|_| true))?;
    }
    for (name, attack) in ATTACKS {
        let over = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| attack(&plant, &over));
            thread::sleep(Duration::from_secs(1));
            for door in &doors {
                // What was not taken is later than everything.
                let mut waits = Vec::with_capacity(STOPS);
                for _ in 0..STOPS {
                    waits
                        .push(stopper.stop(*door).map_or(f64::INFINITY, |wait| wait.as_secs_f64() * 1_000.0));
                    thread::sleep(BETWEEN);
                }
                tell(report, name, *door, waits);
            }
            over.store(true, Ordering::Relaxed);
        });
    }
    Ok(())
}

fn tell(report: &mut Report, attack: &str, door: Door, mut waits: Vec<f64>) {
    waits.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let last = waits.len().saturating_sub(1);
        waits.get((last as f64 * share).round() as usize).copied().unwrap_or(f64::INFINITY)
    };
    let ms = |wait: f64| if wait.is_finite() { format!("{wait:.1} ms") } else { "never".to_owned() };
    let lost = waits.iter().filter(|wait| wait.is_infinite()).count();
    let lost = if lost == 0 { String::new() } else { format!(", {lost} not taken") };
    let (door, p50, worst) = (door.name(), ms(at(0.5)), ms(at(1.0)));
    let what = format!("{attack}: a stop by {door}: p50 {p50}, worst {worst}{lost}; p99");
    report.row(SECTION, what, Unit::Millis, at(0.99), Goal::AtMost(GOAL_MS));
}

/// A way by which somebody stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Door {
    Pointer,
    Key,
    Http,
    Socket,
    Gateway,
    Mqtt,
}

const DOORS: [Door; 6] = [Door::Pointer, Door::Key, Door::Http, Door::Socket, Door::Gateway, Door::Mqtt];

impl Door {
    const fn name(self) -> &'static str {
        match self {
            Self::Pointer => "the page's button",
            Self::Key => "the page's key",
            Self::Http => "HTTP",
            Self::Socket => "the socket",
            Self::Gateway => "the gateway",
            Self::Mqtt => "MQTT",
        }
    }

    const fn wants(self) -> &'static str {
        match self {
            Self::Pointer | Self::Key => {
                "it wants /usr/bin/chromium and the Python module playwright (DRIVED_PYTHON)"
            }
            Self::Mqtt => "it wants mosquitto",
            Self::Http | Self::Socket | Self::Gateway => "it wants nothing",
        }
    }
}

/// Whoever stops at each door.
struct Stopper<'a> {
    plant: &'a Plant,
    browser: Option<Browser>,
    observer: Observer,
}

impl<'a> Stopper<'a> {
    fn of(plant: &'a Plant) -> Result<Self, Error> {
        let browser = Browser::start(&format!("http://{}/", plant.http))?;
        Ok(Self { plant, browser, observer: Observer::start(&plant.socket)? })
    }

    const fn has(&self, door: Door) -> bool {
        match door {
            Door::Pointer | Door::Key => self.browser.is_some(),
            Door::Mqtt => self.plant.broker.is_some(),
            Door::Http | Door::Socket | Door::Gateway => true,
        }
    }

    /// Stops by a door: how long it took until it was on its way.
    fn stop(&mut self, door: Door) -> std::io::Result<Duration> {
        match (door, &mut self.browser) {
            (Door::Pointer, Some(browser)) => return browser.press("pointer"),
            (Door::Key, Some(browser)) => return browser.press("key"),
            _ => {}
        }
        let began = Instant::now();
        match door {
            Door::Http => {
                let stream = TcpStream::connect_timeout(&self.plant.http, PATIENCE)?;
                stream.set_read_timeout(Some(PATIENCE))?;
                ask_http(stream)?;
            }
            Door::Socket => {
                let stream = UnixStream::connect(&self.plant.socket)?;
                stream.set_read_timeout(Some(PATIENCE))?;
                ask_http(stream)?;
            }
            Door::Gateway => {
                let mut stream = TcpStream::connect_timeout(&self.plant.gateway, PATIENCE)?;
                // Altivar 312, CMD (8501) = 0000h: disable voltage, which stops whatever the motor does.
                stream.write_all(&[0, 1, 0, 0, 0, 6, 1, 6, 0x21, 0x35, 0, 0])?;
                let heard = self.observer.heard_of("modbus ", began);
                // As a client does, which sends its next request after the answer: the drive has confirmed it then.
                stream.set_read_timeout(Some(PATIENCE))?;
                stream.read_exact(&mut [0; 12])?;
                return heard;
            }
            Door::Mqtt => {
                let broker = self.plant.broker.ok_or(ErrorKind::NotFound)?;
                let _connection = publish(TcpStream::connect_timeout(&broker, PATIENCE)?, "drived/all/stop")?;
                return self.observer.heard_of("mqtt", began);
            }
            Door::Pointer | Door::Key => return Err(ErrorKind::NotFound.into()),
        }
        Ok(began.elapsed())
    }
}

fn ask_http(mut stream: impl std::io::Read + std::io::Write) -> std::io::Result<()> {
    stream.write_all(
        b"POST /api/v1/stop?wait=0 HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}",
    )?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    match answer.starts_with("HTTP/1.1 202") || answer.starts_with("HTTP/1.1 200") {
        true => Ok(()),
        false => Err(IoError::other("it was not taken")),
    }
}

/// Publishes nothing on a topic as a client of MQTT 5.0 does that has just come, and keeps the connection.
fn publish(mut stream: TcpStream, topic: &str) -> std::io::Result<TcpStream> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    // CONNECT (3.1): "MQTT", version 5, a clean start, 60 s, no properties, a client id that the broker makes.
    stream.write_all(&[0x10, 13, 0, 4, b'M', b'Q', b'T', b'T', 5, 0x02, 0, 60, 0, 0, 0])?;
    // CONNACK (3.2), with properties.
    let mut head = [0; 2];
    stream.read_exact(&mut head)?;
    let mut rest = vec![0; head[1].into()];
    stream.read_exact(&mut rest)?;
    if head[0] != 0x20 || rest.get(1) != Some(&0) {
        return Err(IoError::other("the broker refuses"));
    }
    // PUBLISH (3.3) at most once, without properties and payload.
    let length = u8::try_from(topic.len()).map_err(IoError::other)?;
    let packet = [&[0x30, length + 3, 0, length], topic.as_bytes(), &[0]].concat();
    stream.write_all(&packet)?;
    Ok(stream)
}
