//! A daemon with all its doors, to be attacked.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here")]

use std::{
    env,
    ffi::OsString,
    fs,
    net::{SocketAddr, TcpListener, TcpStream},
    os::unix::process::CommandExt as _,
    path::{Path, PathBuf},
    process::{Child, ChildStderr, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    thread,
    time::{Duration, Instant},
};

use rustix::process::{Signal, set_parent_process_death_signal};

use super::queue::Queue;
use crate::Error;

/// The addresses of its drives: two, so that each stop is soon over.
pub(super) const DRIVES: [u8; 2] = [1, 2];

const FAMILY: &str = "atv312@1-2";

/// A daemon with simulated drives and all its doors, in a folder of its own.
pub(super) struct Plant {
    _folder: Folder,
    pub(super) http: SocketAddr,
    pub(super) gateway: SocketAddr,
    pub(super) socket: PathBuf,
    /// `None` where there is no mosquitto.
    pub(super) broker: Option<SocketAddr>,
    pub(super) queue: Queue,
    _running: Vec<Running>,
}

impl Plant {
    pub(super) fn start() -> Result<Self, Error> {
        let (program, folder) = (program()?, Folder::new()?);
        let (link, socket) = (folder.0.join("line"), folder.0.join("drived.sock"));
        let (http, gateway, broker) = (free()?, free()?, free()?);
        let mosquitto = mosquitto(&folder.0.join("mosquitto.conf"), broker)?;
        let mqtt = match mosquitto {
            Some(_) => format!("[mqtt]\nservers = [\"mqtt://{broker}\"]\ncommands = true\n"),
            None => String::new(),
        };
        let config = folder.0.join("drives.toml");
        fs::write(
            &config,
            format!(
                "[http]\nlisten = \"{http}\"\n[socket]\npath = {socket:?}\n{mqtt}[lines.bench]\nport = {link:?}\n\
                 [[drives]]\nline = \"bench\"\ndrive = \"{FAMILY}\"\nname = \"pump {{}}\"\ncontrol = true\n\
                 [[gateways]]\nlisten = \"{gateway}\"\nline = \"bench\"\nwrites = \"stop\"\n"
            ),
        )?;
        let drives = ["sim", "--drive", FAMILY, "--pty", text(&link)?];
        let drives = Running::start(&program, &drives)?;
        until(|| link.exists())?;
        let (daemon, log) = Running::start_heard(&program, &["run", "--config", text(&config)?])?;
        until(|| socket.exists() && TcpStream::connect(http).is_ok() && TcpStream::connect(gateway).is_ok())?;
        let broker = mosquitto.is_some().then_some(broker);
        let running = [drives, daemon].into_iter().chain(mosquitto).collect();
        Ok(Self { _folder: folder, http, gateway, socket, broker, queue: Queue::of(log), _running: running })
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
