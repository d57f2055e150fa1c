//! A daemon with all its doors, to be attacked.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here")]

use std::{
    env,
    ffi::OsString,
    fs,
    io::{Read as _, Write as _},
    net::{SocketAddr, TcpListener, TcpStream},
    ops::RangeInclusive,
    os::unix::{net::UnixStream, process::CommandExt as _},
    path::{Path, PathBuf},
    process::{Child, ChildStderr, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    thread,
    time::{Duration, Instant},
};

use rustix::process::{Pid, Signal, set_parent_process_death_signal, setpriority_process};

use super::{attacks::Target, queue::Queue};
use crate::Error;

/// What is behind the doors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    /// So many drives can be commanded: few, so that each stop is soon over.
    pub(super) commanded: u8,
    /// So many are watched besides, on the same line.
    pub(super) watched: u8,
    /// So many clients the gateway lets in.
    pub(super) clients: u16,
    writes: &'static str,
}

impl Size {
    /// For attacks on the doors.
    pub(super) const SMALL: Self = Self { commanded: 2, watched: 0, clients: 16, writes: "stop" };
    /// For loads: a line that is full of polls.
    pub(super) const FULL: Self = Self { commanded: 5, watched: 26, clients: 256, writes: "operate" };

    pub(super) const fn drives(self) -> u8 {
        self.commanded + self.watched
    }
}

/// The group and the edge node as which it is known to hosts of Sparkplug.
pub(super) const GROUP: &str = "bench";
pub(super) const EDGE_NODE: &str = "bench";
/// The folder of what outlives the daemon, in its own.
const STATE: &str = "state";
/// Drives that can be commanded are called so, with their address behind.
pub(super) const PUMP: &str = "pump";

/// A daemon with simulated drives and all its doors, in a folder of its own.
pub(super) struct Plant {
    folder: Folder,
    pub(super) http: SocketAddr,
    pub(super) gateway: SocketAddr,
    pub(super) socket: PathBuf,
    /// `None` where there is no mosquitto.
    pub(super) broker: Option<SocketAddr>,
    pub(super) queue: Queue,
    pub(super) size: Size,
    /// By which somebody may operate.
    pub(super) token: String,
    /// The number of the daemon's process.
    pub(super) process: u32,
    _running: Vec<Running>,
}

impl Plant {
    /// Whom an attack meets.
    pub(super) fn target(&self) -> Target {
        let (socket, token) = (self.socket.clone(), self.token.clone());
        let audit = self.folder.0.join(STATE).join("audit");
        Target { http: self.http, gateway: self.gateway, socket, token, audit }
    }

    /// How often a drive at rest is asked.
    pub(super) fn period(&self) -> Result<Duration, Error> {
        let mut stream = UnixStream::connect(&self.socket)?;
        let head =
            "GET /api/v1/drives/pump%201/settings HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
        stream.write_all(head.as_bytes())?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        let (_, body) = answer.split_once("\r\n\r\n").ok_or("no answer")?;
        let settings: serde_json::Value = serde_json::from_str(body)?;
        let ms = settings.pointer("/settings/periods/rest_ms").and_then(serde_json::Value::as_u64);
        Ok(Duration::from_millis(ms.ok_or("the daemon does not tell its periods")?))
    }

    pub(super) fn start(size: Size) -> Result<Self, Error> {
        let (program, folder) = (program()?, Folder::new()?);
        let (link, socket) = (folder.0.join("line"), folder.0.join("drived.sock"));
        let (http, gateway, broker) = (free()?, free()?, free()?);
        let mosquitto = mosquitto(&folder.0.join("mosquitto.conf"), broker)?;
        let mqtt = match mosquitto {
            Some(_) => format!(
                "[mqtt]\nservers = [\"mqtt://{broker}\"]\ncommands = true\n\
                 [mqtt.sparkplug]\ngroup = \"{GROUP}\"\nedge_node = \"{EDGE_NODE}\"\ncommands = \"stop\"\n"
            ),
            None => String::new(),
        };
        let config = folder.0.join("drives.toml");
        let Size { commanded, clients, writes, .. } = size;
        let drives = |numbers: RangeInclusive<u8>, name: &str, control: bool| {
            let (first, last) = (numbers.start(), numbers.end());
            format!(
                "[[drives]]\nline = \"bench\"\ndrive = \"atv312@{first}-{last}\"\nname = \"{name} {{}}\"\ncontrol = {control}\n"
            )
        };
        let watched = match size.watched {
            0 => String::new(),
            _ => drives(commanded + 1..=size.drives(), "fan", false),
        };
        fs::write(
            &config,
            format!(
                "state = {:?}\n[http]\nlisten = \"{http}\"\n[socket]\npath = {socket:?}\n{mqtt}[lines.bench]\nport = {link:?}\n\
                 {}{watched}\
                 [[gateways]]\nlisten = \"{gateway}\"\nline = \"bench\"\nclients = {clients}\nwrites = \"{writes}\"\n",
                folder.0.join(STATE),
                drives(1..=commanded, PUMP, true),
            ),
        )?;
        let token = Command::new(&program)
            .args(["token", "add", "bench", "--role", "operate", "--config", text(&config)?])
            .output()?;
        let token = String::from_utf8(token.stdout)?.trim().to_owned();
        let all = format!("atv312@1-{}", size.drives());
        let drives = ["sim", "--drive", &all, "--pty", text(&link)?];
        let drives = Running::start(&program, &drives)?;
        drives.goes_first();
        until(|| link.exists())?;
        let (daemon, log) = Running::start_heard(&program, &["run", "--config", text(&config)?])?;
        until(|| socket.exists() && TcpStream::connect(http).is_ok() && TcpStream::connect(gateway).is_ok())?;
        let broker = mosquitto.is_some().then_some(broker);
        let process = daemon.0.id();
        let running = [drives, daemon].into_iter().chain(mosquitto).collect();
        let queue = Queue::of(log);
        Ok(Self { folder, http, gateway, socket, broker, queue, size, token, process, _running: running })
    }
}

/// The program, beside this one.
pub(crate) fn program() -> Result<PathBuf, Error> {
    let program = env::current_exe()?.with_file_name("drived");
    match program.exists() {
        true => Ok(program),
        false => {
            Err(format!("{} is not there: cargo build --profile dist --bin drived", program.display()).into())
        }
    }
}

/// A broker, where there is one on this machine.
fn mosquitto(config: &Path, at: SocketAddr) -> Result<Option<Running>, Error> {
    fs::write(config, format!("listener {} {}\nallow_anonymous true\n", at.port(), at.ip()))?;
    let program =
        ["/usr/sbin/mosquitto", "/usr/bin/mosquitto"].into_iter().find(|program| Path::new(program).exists());
    let Some(program) = program else { return Ok(None) };
    let running = Running::start(Path::new(program), &["-c", text(config)?])?;
    until(|| TcpStream::connect(at).is_ok())?;
    Ok(Some(running))
}

/// A program that ends with the measurement, and with this program, however that ends.
pub(crate) struct Running(Child);

/// Becomes a program that the system kills when whoever has started this one is gone.
pub(crate) fn become_one_that_ends_with_me(program: &[OsString]) -> Error {
    let Some((program, arguments)) = program.split_first() else { return "no program is named".into() };
    if let Err(error) = set_parent_process_death_signal(Some(Signal::KILL)) {
        return error.into();
    }
    Command::new(program).args(arguments).exec().into()
}

impl Running {
    pub(crate) fn start(program: &Path, arguments: &[&str]) -> Result<Self, Error> {
        Ok(Self(Self::command(program, arguments)?.spawn()?))
    }

    /// Real drives wait for no processor of this machine: these go first, where somebody may say so.
    fn goes_first(&self) {
        let process = i32::try_from(self.0.id()).ok().and_then(Pid::from_raw);
        let _ = setpriority_process(process, -10);
    }

    /// The same, with its log, in which each stop stands that is in the queue of its line.
    fn start_heard(program: &Path, arguments: &[&str]) -> Result<(Self, ChildStderr), Error> {
        let mut command = Self::command(program, arguments)?;
        let mut child = command.env("DRIVED_LOG", "warn,drive_bus=debug").stderr(Stdio::piped()).spawn()?;
        let log = child.stderr.take().ok_or("it has no log")?;
        Ok((Self(child), log))
    }

    fn command(program: &Path, arguments: &[&str]) -> Result<Command, Error> {
        let mut command = Command::new(env::current_exe()?);
        command
            .arg("--with-me")
            .arg(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        Ok(command)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A folder that is gone afterwards.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new() -> Result<Self, Error> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let folder = env::temp_dir().join(format!("drive-bench-doors-{}-{number}", std::process::id()));
        fs::create_dir_all(&folder)?;
        Ok(Self(folder))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

pub(crate) fn free() -> Result<SocketAddr, Error> {
    Ok(TcpListener::bind("127.0.0.1:0")?.local_addr()?)
}

pub(crate) fn text(path: &Path) -> Result<&str, Error> {
    path.to_str().ok_or_else(|| "the path is no text".into())
}

/// Waits until something is so.
pub(crate) fn until(mut is_so: impl FnMut() -> bool) -> Result<(), Error> {
    let begun = Instant::now();
    while !is_so() {
        if begun.elapsed() > Duration::from_secs(30) {
            return Err("the daemon does not begin".into());
        }
        thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}
