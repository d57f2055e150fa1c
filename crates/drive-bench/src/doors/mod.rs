//! The wait of a stop at each door of the daemon while somebody does his worst at another: from the act of whoever stops (the
//! pointer or the key goes down, the request is sent) until the stop waits for its line. The program `drived` is looked for beside
//! this one; the page is pressed in a Chromium over Playwright, and MQTT goes over a mosquitto, where they are installed.
//!
//! It ends where the stop of each drive that is meant is in the queue of its line, as the daemon logs it with the time ([`queue`]);
//! and each row says besides when whoever stops had the answer, which MQTT does not give. One stop after the other: the next begins when
//! something has become of it, so that no repetition is taken for a stop.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here: each attacker is a thread")]

mod attacks;
mod browser;
mod loads;
mod observer;
pub(crate) mod plant;
mod queue;
mod trivial;

use std::{
    io::{Error as IoError, ErrorKind, Read as _, Write as _},
    net::{SocketAddr, TcpStream},
    os::unix::net::UnixStream,
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use clap::Args;
use drive_sparkplug::{DataType, Metric, Payload, Raw};

use self::{
    attacks::{ATTACKS, Attack, Target},
    browser::Browser,
    loads::{Got, LOADS, Looking},
    observer::Observer,
    plant::{EDGE_NODE, GROUP, PUMP, Plant, Size, until},
    queue::{Act, Whom},
    trivial::Trivial,
};
use crate::{
    Error,
    report::{Goal, Report, Unit},
    usage::{allow_descriptors, memory_of},
};

const SECTION: &str = "doors";
const LOADS_SECTION: &str = "loads";
/// Stops at each door under each attack.
const STOPS: usize = 100;
/// What a stop may take until it waits for its line, at p99.
const GOAL_MS: f64 = 50.0;
/// Whoever has not answered by then has not taken it.
const PATIENCE: Duration = Duration::from_secs(5);
const BETWEEN: Duration = Duration::from_millis(20);
/// After so many that were not taken, one after the other, the rest is not waited for.
const IN_VAIN: usize = 5;

/// What became of a stop.
#[derive(Debug, Clone, Copy)]
struct Taken {
    /// It was in the queue of its line; where there is none, it was answered.
    queued: Duration,
    answered: Option<Duration>,
}

/// Which doors and attacks somebody wants to see; where nothing is named, all.
#[derive(Debug, Default, Args)]
pub(crate) struct Wanted {
    /// Of the doors, stop only at these: pointer, key, http, socket, gateway, mqtt, sparkplug.
    #[arg(long, value_name = "DOOR", value_parser = DOORS.map(Door::key))]
    door: Vec<String>,
    /// Of the attacks on doors, or of the loads, only these.
    #[arg(long, value_name = "ATTACK", value_parser = ATTACKS.iter().chain(&LOADS[1..]).map(|attack| attack.key).collect::<Vec<_>>())]
    attack: Vec<String>,
}

impl Wanted {
    /// Those of the doors that somebody wants to see.
    fn doors(&self, of: &[Door]) -> Vec<Door> {
        of.iter().copied().filter(|door| Self::has(&self.door, door.key())).collect()
    }

    fn has(of: &[String], key: &str) -> bool {
        of.is_empty() || of.iter().any(|one| one == key)
    }
}

/// Measures each door under each attack; and what the machine itself takes: the same attack on a server that does nothing, with stops at
/// that one, and by the page's button at the daemon, which nobody attacks then.
pub(crate) fn measure(report: &mut Report, wanted: &Wanted) -> Result<(), Error> {
    let (plant, trivial) = (Plant::start(Size::SMALL)?, Trivial::start()?);
    let wanted_doors = wanted.doors(&DOORS);
    let mut stopper = Stopper::of(&plant, &trivial, &wanted_doors)?;
    let doors = stopper.those_that_open(wanted_doors)?;
    let target = plant.target();
    let machine = Target { http: trivial.address, gateway: trivial.address, ..plant.target() };
    let is_control = |door: &Door| *door == Door::Pointer;
    let controls: Vec<Door> = doors.iter().copied().filter(is_control).chain([Door::Trivial]).collect();
    for attack in ATTACKS.into_iter().filter(|attack| Wanted::has(&wanted.attack, attack.key)) {
        let name = attack.name;
        under(attack, &target, &doors, &mut stopper, |door, waits| {
            tell(report, SECTION, name, door, waits, Goal::AtMost(GOAL_MS));
        });
        let name = format!("{name}, of a server that does nothing");
        under(attack, &machine, &controls, &mut stopper, |door, waits| {
            tell(report, SECTION, &name, door, waits, Goal::None);
        });
    }
    Ok(())
}

/// Measures each load: its stops beside those under none, what it got, how old statuses were, and what the daemon holds.
pub(crate) fn measure_loads(report: &mut Report, wanted: &Wanted) -> Result<(), Error> {
    allow_descriptors()?;
    let (plant, trivial) = (Plant::start(Size::FULL)?, Trivial::start()?);
    let wanted_doors = wanted.doors(&LOADED_DOORS);
    let mut stopper = Stopper::of(&plant, &trivial, &wanted_doors)?;
    let doors = stopper.those_that_open(wanted_doors)?;
    let (target, process) = (plant.target(), plant.process.to_string());
    let period = plant.period()?;
    let mut calm = Vec::new();
    let is_wanted = |load: &Attack| load.key == "calm" || Wanted::has(&wanted.attack, load.key);
    for load in LOADS.into_iter().filter(is_wanted) {
        let before = memory_of(&process)?;
        let over = AtomicBool::new(false);
        let (got, seen) = thread::scope(|scope| {
            let looks = scope.spawn(|| Looking::at(&target.socket, &over));
            let got = under(load, &target, &doors, &mut stopper, |door, waits| {
                let p99 = tell(report, LOADS_SECTION, load.name, door, waits, Goal::AtMost(GOAL_MS));
                match calm.iter().find(|(of, _)| *of == door) {
                    None => calm.push((door, p99)),
                    Some((_, calm)) => {
                        let what =
                            format!("{}: a stop by {}, p99 by that beside none", load.name, door.name());
                        report.note(LOADS_SECTION, what, Unit::Times, p99 / calm);
                    }
                }
            });
            over.store(true, Ordering::Relaxed);
            (got, looks.join())
        });
        let seen = seen.map_err(|_| "whoever looked has panicked")?;
        for one in got.into_iter().chain(seen.got(period)) {
            report.note(LOADS_SECTION, format!("{}: {}", load.name, one.what), one.unit, one.value);
        }
        for (when, held) in [("before", before), ("at its end", memory_of(&process)?)] {
            let what = format!("{}: memory of the daemon {when}", load.name);
            report.note(LOADS_SECTION, what, Unit::KiB, held as f64);
        }
    }
    Ok(())
}

/// Stops at each of these doors while somebody attacks.
fn under(
    attack: Attack,
    target: &Target,
    doors: &[Door],
    stopper: &mut Stopper<'_>,
    mut tell: impl FnMut(Door, &[Option<Taken>]),
) -> Vec<Got> {
    let over = AtomicBool::new(false);
    thread::scope(|scope| {
        let acts = scope.spawn(|| (attack.act)(target, &over));
        thread::sleep(Duration::from_secs(1));
        for door in doors {
            let (mut all, mut in_vain) = (Vec::with_capacity(STOPS), 0);
            while all.len() < STOPS {
                let taken = stopper.stop(*door).inspect_err(|error| {
                    eprintln!("drive-bench: a stop by {} is not counted as taken: {error}", door.name());
                });
                in_vain = if taken.is_ok() { 0 } else { in_vain + 1 };
                all.push(taken.ok());
                if in_vain == IN_VAIN {
                    all.resize(STOPS, None);
                }
                thread::sleep(BETWEEN);
            }
            tell(*door, &all);
        }
        over.store(true, Ordering::Relaxed);
        acts.join().unwrap_or_default()
    })
}

/// Tells what became of the stops; gives the p99 of their waits, in milliseconds.
fn tell(
    report: &mut Report,
    section: &str,
    attack: &str,
    door: Door,
    all: &[Option<Taken>],
    goal: Goal,
) -> f64 {
    // What was not taken is later than everything.
    let sorted = |of: fn(&Taken) -> Option<Duration>| {
        let ms = |taken: &Option<Taken>| {
            let wait = taken.as_ref().and_then(of);
            wait.map_or(f64::INFINITY, |wait| wait.as_secs_f64() * 1_000.0)
        };
        let mut waits: Vec<f64> = all.iter().map(ms).collect();
        waits.sort_by(f64::total_cmp);
        waits
    };
    let at = |waits: &[f64], share: f64| {
        let last = waits.len().saturating_sub(1);
        waits.get((last as f64 * share).round() as usize).copied().unwrap_or(f64::INFINITY)
    };
    let ms = |wait: f64| if wait.is_finite() { format!("{wait:.1} ms") } else { "never".to_owned() };
    let (queued, answered) = (sorted(|taken| Some(taken.queued)), sorted(|taken| taken.answered));
    let lost = all.iter().filter(|taken| taken.is_none()).count();
    let lost = if lost == 0 { String::new() } else { format!(", {lost} not taken") };
    let answers = match door {
        Door::Mqtt | Door::Sparkplug | Door::Trivial => String::new(),
        _ => format!(", answered at p99 after {}", ms(at(&answered, 0.99))),
    };
    let until = if door == Door::Trivial { "until answered" } else { "in the queue of its line" };
    let (door, p50, worst) = (door.name(), ms(at(&queued, 0.5)), ms(at(&queued, 1.0)));
    let what = format!("{attack}: a stop by {door}{answers}; {until}: p50 {p50}, worst {worst}{lost}; p99");
    let p99 = at(&queued, 0.99);
    report.row(section, what, Unit::Millis, p99, goal);
    p99
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
    Sparkplug,
    /// A server beside the daemon that does nothing.
    Trivial,
}

const DOORS: [Door; 7] =
    [Door::Pointer, Door::Key, Door::Http, Door::Socket, Door::Gateway, Door::Mqtt, Door::Sparkplug];

/// Those at which somebody stops while there is a load: a browser has no processor left then.
const LOADED_DOORS: [Door; 5] = [Door::Http, Door::Socket, Door::Gateway, Door::Mqtt, Door::Sparkplug];

impl Door {
    /// As the command line names it.
    const fn key(self) -> &'static str {
        match self {
            Self::Pointer => "pointer",
            Self::Key => "key",
            Self::Http => "http",
            Self::Socket => "socket",
            Self::Gateway => "gateway",
            Self::Mqtt => "mqtt",
            Self::Sparkplug => "sparkplug",
            Self::Trivial => "trivial",
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Pointer => "the page's button",
            Self::Key => "the page's key",
            Self::Http => "HTTP",
            Self::Socket => "the socket",
            Self::Gateway => "the gateway",
            Self::Mqtt => "MQTT",
            Self::Sparkplug => "Sparkplug",
            Self::Trivial => "HTTP there",
        }
    }

    const fn wants(self) -> &'static str {
        match self {
            Self::Pointer | Self::Key => {
                "it wants /usr/bin/chromium and the Python module playwright (DRIVED_PYTHON)"
            }
            Self::Mqtt | Self::Sparkplug => "it wants mosquitto",
            Self::Http | Self::Socket | Self::Gateway | Self::Trivial => "it wants nothing",
        }
    }
}

/// Whoever stops at each door.
struct Stopper<'a> {
    plant: &'a Plant,
    trivial: &'a Trivial,
    browser: Option<Browser>,
    observer: Observer,
}

impl<'a> Stopper<'a> {
    fn of(plant: &'a Plant, trivial: &'a Trivial, doors: &[Door]) -> Result<Self, Error> {
        let is_pressed = doors.iter().any(|door| matches!(door, Door::Pointer | Door::Key));
        let browser = match is_pressed {
            true => Browser::start(&format!("http://{}/", plant.http))?,
            false => None,
        };
        Ok(Self { plant, trivial, browser, observer: Observer::start(&plant.socket)? })
    }

    /// Those of the doors that are there, once a stop by each was taken.
    fn those_that_open(&mut self, doors: Vec<Door>) -> Result<Vec<Door>, Error> {
        let (doors, left_out): (Vec<Door>, Vec<Door>) = doors.into_iter().partition(|door| self.has(*door));
        for door in left_out {
            eprintln!("drive-bench: {} is left out: {}", door.name(), door.wants());
        }
        for door in &doors {
            until(|| self.stop(*door).is_ok_and(|_| true))?;
        }
        Ok(doors)
    }

    const fn has(&self, door: Door) -> bool {
        match door {
            Door::Pointer | Door::Key => self.browser.is_some(),
            Door::Mqtt | Door::Sparkplug => self.plant.broker.is_some(),
            Door::Http | Door::Socket | Door::Gateway | Door::Trivial => true,
        }
    }

    /// Stops by a door, and waits until something has become of it.
    fn stop(&mut self, door: Door) -> std::io::Result<Taken> {
        if door == Door::Trivial {
            let began = Instant::now();
            ask_http(connected(self.trivial.address)?)?;
            let waited = began.elapsed();
            return Ok(Taken { queued: waited, answered: Some(waited) });
        }
        self.observer.catch_up();
        self.plant.queue.forget();
        let (act, answered) = self.act(door)?;
        let all: Vec<u8> = (1..=self.plant.size.commanded).collect();
        let whom = if door == Door::Gateway { Whom::One(1) } else { Whom::All(&all) };
        let queued = self.plant.queue.had(whom, act)?;
        self.observer.has_settled_another()?;
        Ok(Taken { queued, answered })
    }

    /// Stops by a door: when that was, and how long it took until it was answered, where it is.
    fn act(&mut self, door: Door) -> std::io::Result<(Act, Option<Duration>)> {
        match (door, &mut self.browser) {
            (Door::Pointer, Some(browser)) => return browser.press("pointer"),
            (Door::Key, Some(browser)) => return browser.press("key"),
            _ => {}
        }
        let (act, began) = (Act::now(), Instant::now());
        match door {
            Door::Http => ask_http(connected(self.plant.http)?)?,
            Door::Socket => {
                let stream = UnixStream::connect(&self.plant.socket)?;
                stream.set_read_timeout(Some(PATIENCE))?;
                ask_http(stream)?;
            }
            Door::Gateway => {
                let mut stream = connected(self.plant.gateway)?;
                // Altivar 312, CMD (8501) = 0000h: disable voltage, which stops whatever the motor does.
                stream.write_all(&[0, 1, 0, 0, 0, 6, 1, 6, 0x21, 0x35, 0, 0])?;
                let mut head = [0; 9];
                stream.read_exact(&mut head)?;
            }
            Door::Mqtt => {
                let broker = self.plant.broker.ok_or(ErrorKind::NotFound)?;
                let _connection = publish(connected(broker)?, &[("drived/all/stop".to_owned(), Vec::new())])?;
                return Ok((act, None));
            }
            Door::Sparkplug => {
                let broker = self.plant.broker.ok_or(ErrorKind::NotFound)?;
                let all: Vec<_> =
                    (1..=self.plant.size.commanded).map(|slave| stop_of_a_host(slave, act)).collect();
                let _connection = publish(connected(broker)?, &all)?;
                return Ok((act, None));
            }
            Door::Trivial | Door::Pointer | Door::Key => return Err(ErrorKind::NotFound.into()),
        }
        Ok((act, Some(began.elapsed())))
    }
}

/// A connection on which nothing lasts for ever.
fn connected(to: SocketAddr) -> std::io::Result<TcpStream> {
    let stream = TcpStream::connect_timeout(&to, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    Ok(stream)
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

/// What a host of Sparkplug publishes to stop a drive, and where.
fn stop_of_a_host(slave: u8, now: Act) -> (String, Vec<u8>) {
    let topic = format!("spBv1.0/{GROUP}/DCMD/{EDGE_NODE}/{PUMP} {slave}");
    let metric = Metric {
        name: Some("Control/Command".to_owned()),
        data_type: Some(DataType::String.code()),
        value: Some(Raw::String("stop".to_owned())),
        ..Metric::default()
    };
    let payload = Payload { timestamp: Some(now.0 as u64), metrics: vec![metric], ..Payload::default() };
    (topic, payload.encode())
}

/// Publishes these payloads on their topics as a client of MQTT 5.0 does that has just come, and keeps the connection.
fn publish(mut stream: TcpStream, all: &[(String, Vec<u8>)]) -> std::io::Result<TcpStream> {
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
    // PUBLISH (3.3) at most once, without properties; none of them is longer than one byte of length says.
    let mut packets = Vec::new();
    for (topic, payload) in all {
        let length = u8::try_from(3 + topic.len() + payload.len()).map_err(IoError::other)?;
        if length > 127 {
            return Err(IoError::other("what is published is too long"));
        }
        packets.extend([0x30, length, 0, topic.len() as u8]);
        packets.extend(topic.as_bytes());
        packets.push(0);
        packets.extend(payload);
    }
    stream.write_all(&packets)?;
    Ok(stream)
}
