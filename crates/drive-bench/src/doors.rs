//! The wait of a stop at each door of the daemon while somebody does his worst at another: from the request to the answer that
//! it is on its way to the drives. The program `drived` is looked for beside this one.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here: each attacker is a thread")]

use std::{
    env, fs,
    io::{Read as _, Write as _},
    net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream},
    os::unix::net::UnixStream,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::{Duration, Instant},
};

use socket2::{Domain, Socket, Type};

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
/// Attackers come from another address than whoever stops: limits are by address.
const ATTACKER: IpAddr = IpAddr::V4(Ipv4Addr::new(127, 0, 0, 2));

/// Who does what at which door.
type Attack = (&'static str, fn(&Plant, &AtomicBool));

const ATTACKS: [Attack; 8] = [
    ("nobody does anything", |_, over| wait(over)),
    ("512 connections that say nothing", |plant, over| hold(plant.http, 512, b"", over)),
    ("512 half-sent heads", |plant, over| {
        hold(plant.http, 512, b"POST /api/v1/stop HTTP/1.1\r\nHost: loc", over);
    }),
    ("64 slow bodies of logins", |plant, over| {
        hold(plant.http, 64, b"POST /api/v1/login HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 60000\r\n\r\n{", over);
    }),
    ("8 who try tokens on stops", |plant, over| {
        flood(
            plant.http,
            8,
            "POST /api/v1/stop?wait=0 HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer drv_wrong\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n{}",
            over,
        );
    }),
    ("8 who send 64 KiB that they may not", |plant, over| {
        let body = " ".repeat(65_000);
        let start = format!(
            "POST /api/v1/drives/pump%201/start HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        flood(plant.http, 8, &start, over);
    }),
    ("256 event streams that nobody reads", |plant, over| {
        hold(plant.http, 256, b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n", over);
    }),
    ("256 silent clients of the gateway", |plant, over| hold(plant.gateway, 256, b"", over)),
];

/// Measures each door under each attack.
pub(crate) fn measure(report: &mut Report) -> Result<(), Error> {
    let plant = Plant::start()?;
    for (name, attack) in ATTACKS {
        let over = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| attack(&plant, &over));
            thread::sleep(Duration::from_secs(1));
            for (door, goal, stop) in DOORS {
                let mut taken: Vec<f64> = Vec::with_capacity(STOPS);
                for _ in 0..STOPS {
                    let began = Instant::now();
                    if stop(&plant).is_ok_and(|done| done) {
                        taken.push(began.elapsed().as_secs_f64() * 1_000.0);
                    }
                    thread::sleep(BETWEEN);
                }
                taken.sort_by(f64::total_cmp);
                let at = |share: f64| {
                    let last = taken.len().saturating_sub(1);
                    taken.get((last as f64 * share).round() as usize).copied().unwrap_or(f64::INFINITY)
                };
                let lost = (STOPS - taken.len()) as f64;
                report.row(
                    SECTION,
                    format!("{name}: stops by {door} that were not taken"),
                    Unit::Count,
                    lost,
                    Goal::AtMost(0.0),
                );
                report.row(
                    SECTION,
                    format!("{name}: a stop by {door}, p50"),
                    Unit::Millis,
                    at(0.5),
                    Goal::None,
                );
                report.row(SECTION, format!("{name}: a stop by {door}, p99"), Unit::Millis, at(0.99), goal);
            }
            over.store(true, Ordering::Relaxed);
        });
    }
    Ok(())
}

/// A stop by one door, what it may take at p99, and whether it was taken. The gateway answers when the drive has confirmed it.
type Door = (&'static str, Goal, fn(&Plant) -> std::io::Result<bool>);

const DOORS: [Door; 3] = [
    ("HTTP", Goal::AtMost(GOAL_MS), |plant| {
        let stream = TcpStream::connect_timeout(&plant.http, PATIENCE)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        ask_http(stream)
    }),
    ("the socket", Goal::AtMost(GOAL_MS), |plant| {
        let stream = UnixStream::connect(&plant.socket)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        ask_http(stream)
    }),
    ("the gateway, confirmed by the drive", Goal::None, |plant| {
        let mut stream = TcpStream::connect_timeout(&plant.gateway, PATIENCE)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        // Altivar 312, CMD (8501) = 0000h: disable voltage, which stops whatever the motor does.
        stream.write_all(&[0, 1, 0, 0, 0, 6, 1, 6, 0x21, 0x35, 0, 0])?;
        let mut answer = [0; 12];
        stream.read_exact(&mut answer)?;
        Ok(answer[7] == 6)
    }),
];

fn ask_http(mut stream: impl std::io::Read + std::io::Write) -> std::io::Result<bool> {
    stream.write_all(
        b"POST /api/v1/stop?wait=0 HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}",
    )?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    Ok(answer.starts_with("HTTP/1.1 202") || answer.starts_with("HTTP/1.1 200"))
}

/// Opens connections, says the same on each and keeps them; those that are closed are opened again.
fn hold(to: SocketAddr, count: usize, head: &[u8], over: &AtomicBool) {
    let mut held: Vec<Option<TcpStream>> = (0..count).map(|_| None).collect();
    while !over.load(Ordering::Relaxed) {
        for place in &mut held {
            let is_open = place.as_ref().is_some_and(|stream| {
                !matches!(stream.peek(&mut [0]), Ok(0))
                    && stream.take_error().is_ok_and(|error| error.is_none())
            });
            if !is_open {
                *place = connect(to).ok().and_then(|mut stream| {
                    stream.write_all(head).ok()?;
                    stream.set_nonblocking(true).ok().map(|()| stream)
                });
            }
        }
        thread::sleep(Duration::from_millis(10));
    }
}

/// Asks the same again and again on some connections at once, as fast as it is answered.
fn flood(to: SocketAddr, count: usize, request: &str, over: &AtomicBool) {
    thread::scope(|scope| {
        for _ in 0..count {
            scope.spawn(|| {
                let mut stream = None;
                let mut answer = [0; 4_096];
                while !over.load(Ordering::Relaxed) {
                    let Ok(mut open) = stream.take().map_or_else(|| connect(to), Ok) else {
                        thread::yield_now();
                        continue;
                    };
                    let answered = open.write_all(request.as_bytes()).and_then(|()| open.read(&mut answer));
                    stream = answered.is_ok_and(|read| read > 0).then_some(open);
                }
            });
        }
    });
}

fn connect(to: SocketAddr) -> std::io::Result<TcpStream> {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None)?;
    socket.bind(&SocketAddr::new(ATTACKER, 0).into())?;
    socket.connect_timeout(&to.into(), PATIENCE)?;
    socket.set_read_timeout(Some(PATIENCE))?;
    Ok(socket.into())
}

fn wait(over: &AtomicBool) {
    while !over.load(Ordering::Relaxed) {
        thread::sleep(Duration::from_millis(10));
    }
}

/// A daemon with four simulated drives and all its doors, in a folder of its own.
struct Plant {
    _folder: Folder,
    http: SocketAddr,
    gateway: SocketAddr,
    socket: PathBuf,
    _running: [Running; 2],
}

impl Plant {
    fn start() -> Result<Self, Error> {
        let program = env::current_exe()?.with_file_name("drived");
        if !program.exists() {
            return Err(format!(
                "{} is not there: cargo build --profile dist --bin drived",
                program.display()
            )
            .into());
        }
        let folder = Folder::new()?;
        let (link, socket) = (folder.0.join("line"), folder.0.join("drived.sock"));
        let (http, gateway) = (free()?, free()?);
        let config = folder.0.join("drives.toml");
        fs::write(
            &config,
            format!(
                "[http]\nlisten = \"{http}\"\n[socket]\npath = {socket:?}\n[lines.bench]\nport = {link:?}\n\
                 [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-4\"\nname = \"pump {{}}\"\ncontrol = true\n\
                 [[gateways]]\nlisten = \"{gateway}\"\nline = \"bench\"\nwrites = \"stop\"\n"
            ),
        )?;
        let run = |arguments: &[&str]| Running::start(&program, arguments);
        let drives = run(&["sim", "--drive", "atv312@1-4", "--pty", text(&link)?])?;
        until(|| link.exists())?;
        let daemon = run(&["run", "--config", text(&config)?])?;
        let plant = Self { _folder: folder, http, gateway, socket, _running: [drives, daemon] };
        until(|| DOORS.iter().all(|(_, _, stop)| stop(&plant).is_ok_and(|taken| taken)))?;
        Ok(plant)
    }
}

/// A program that ends with the measurement.
struct Running(Child);

impl Running {
    fn start(program: &Path, arguments: &[&str]) -> Result<Self, Error> {
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        Ok(Self(command.spawn()?))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A folder that is gone afterwards.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self, Error> {
        let folder = env::temp_dir().join(format!("drive-bench-doors-{}", std::process::id()));
        fs::create_dir_all(&folder)?;
        Ok(Self(folder))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn free() -> Result<SocketAddr, Error> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?)
}

fn text(path: &Path) -> Result<&str, Error> {
    path.to_str().ok_or_else(|| "the path is no text".into())
}

/// Waits until something is so.
fn until(mut is_so: impl FnMut() -> bool) -> Result<(), Error> {
    let begun = Instant::now();
    while !is_so() {
        if begun.elapsed() > Duration::from_secs(30) {
            return Err("the daemon does not begin".into());
        }
        thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}
