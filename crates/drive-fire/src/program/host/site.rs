//! Two lines with drives of every family behind ptys, and the daemon that commands them, asked over HTTP.

use std::{
    fs::{self, File},
    io::{self, Read as _, Write as _},
    net::{TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;

use super::{
    super::{misfortunes, process},
    simulator::Simulator,
};
use crate::child;

/// A drive of the site: its name, the place of its line, and its name on that.
pub(super) struct Drive {
    pub(super) name: &'static str,
    pub(super) line: usize,
    pub(super) machine: &'static str,
}

const fn drive(name: &'static str, line: usize, machine: &'static str) -> Drive {
    Drive { name, line, machine }
}

/// All of them.
pub(super) const DRIVES: [Drive; 8] = [
    drive("north 1", 0, "atv312@1"),
    drive("north 2", 0, "atv312@2"),
    drive("north 5", 0, "atv21@5"),
    drive("north 6", 0, "atv28@6"),
    drive("north 7", 0, "atv58@7"),
    drive("north 8", 0, "3g3ev@8"),
    drive("south 1", 1, "atv58@1"),
    drive("south 2", 1, "atv58@2"),
];

/// The lines: name, speed and format.
pub(super) const LINES: [(&str, [&str; 2]); 2] =
    [("north", ["19200", "8N1"]), ("south", ["9600", "7E1,ascii"])];

/// Until it is there, at the most, and until it has ended.
const READY: Duration = Duration::from_secs(100);

/// How long an answer of HTTP is waited for: a stop is asked for what becomes of it in 30 s, and the host may hold all up meanwhile.
const ANSWER: Duration = Duration::from_secs(90);

pub(super) struct Site {
    program: PathBuf,
    folder: PathBuf,
    http: u16,
    token: String,
    pub(super) lines: Vec<Simulator>,
    daemon: Mutex<Option<Child>>,
    pid: AtomicU32,
    has_own_disk: bool,
}

impl Drop for Site {
    fn drop(&mut self) {
        self.lines.iter().for_each(Simulator::kill);
        if let Some(mut daemon) = self.daemon.lock().unwrap_or_else(PoisonError::into_inner).take() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

impl Site {
    /// All drives are connected when this ends. With this wrong line in the daemon, where the program was built with them all.
    pub(super) fn start(program: &Path, mutant: Option<&str>) -> io::Result<Self> {
        let folder = std::env::temp_dir().join(format!("drive-fire-host-{}", std::process::id()));
        fs::create_dir_all(folder.join("state"))?;
        let lines = LINES.iter().enumerate().map(|(place, (name, serial))| {
            let of_line = DRIVES.iter().filter(|drive| drive.line == place);
            let machines: Vec<_> = of_line.map(|drive| drive.machine).collect();
            Simulator::new(program, folder.join(name), *serial, &machines)
        });
        let mut site = Self {
            program: program.to_owned(),
            http: TcpListener::bind("127.0.0.1:0")?.local_addr()?.port(),
            token: String::new(),
            lines: lines.collect(),
            folder,
            daemon: Mutex::default(),
            pid: AtomicU32::new(0),
            has_own_disk: misfortunes::may_mount(),
        };
        site.lines.iter().try_for_each(Simulator::begin)?;
        fs::write(site.config(), site.text())?;
        site.token = site.new_token()?;
        site.begin(mutant)?;
        Ok(site)
    }

    fn config(&self) -> PathBuf {
        self.folder.join("drives.toml")
    }

    fn state(&self) -> PathBuf {
        self.folder.join("state")
    }

    /// Whose output is cut is known to have come to rest when it has; the 3G3EV's reset is an input of its own.
    fn text(&self) -> String {
        let Self { folder, http, .. } = self;
        let folder = folder.display();
        let mut text = format!(
            "snapshots = \"0\"\ntokens = \"{folder}/tokens\"\naudit = \"{folder}/state/audit\"\n[history]\n\
             [http]\nlisten = \"127.0.0.1:{http}\"\n[defaults]\ncontrol = true\ncoast = \"60s\"\n\
             watchdog = {{ time = \"10s\", reaction = \"ramp\" }}\noptions = {{ fault-reset-function = 3 }}\n"
        );
        for ((name, [baud, format]), simulator) in LINES.iter().zip(&self.lines) {
            text += &format!("[lines.{name}]\nport = \"{},{baud},{format}\"\n", simulator.link().display());
        }
        for Drive { name, line, machine } in &DRIVES {
            let line = LINES[*line].0;
            text += &format!("[[drives]]\nline = \"{line}\"\ndrive = \"{machine}\"\nname = \"{name}\"\n");
        }
        text
    }

    fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        process::at_home(program, &self.folder, &self.state())
    }

    fn new_token(&self) -> io::Result<String> {
        let mut command = self.command(&self.program);
        command.args(["token", "add", "fire", "--role", "operate", "--config"]).arg(self.config());
        let ended = child::run(&mut command, READY)?;
        let token = ended.stdout.trim().to_owned();
        if token.starts_with("drv_") { Ok(token) } else { Err(io::Error::other(ended.stderr)) }
    }

    fn begin(&self, mutant: Option<&str>) -> io::Result<()> {
        let mut command = self.command(&self.program);
        if self.has_own_disk {
            // Its state lies on a disk of its own, which nobody else sees and which can be filled.
            let script = "mount -t tmpfs -o size=64m none \"$XDG_STATE_HOME\" && exec \"$0\" \"$@\"";
            command = self.command("unshare");
            command.args(["--map-root-user", "--mount", "sh", "-c", script]).arg(&self.program);
        }
        command.envs(mutant.map(|mutant| ("DRIVED_MUTANT", mutant)));
        command.args(["run", "--config"]).arg(self.config());
        command.arg("--socket").arg(self.folder.join("socket"));
        let log = File::create(self.folder.join("log"))?;
        let daemon = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log).spawn()?;
        self.pid.store(daemon.id(), Ordering::Relaxed);
        *self.daemon.lock().unwrap_or_else(PoisonError::into_inner) = Some(daemon);
        self.until_all_are_connected()
    }

    /// Each drive answers.
    pub(super) fn until_all_are_connected(&self) -> io::Result<()> {
        let is_connected =
            |drive: &Value| drive["link"] == "connected" && drive["status"]["quality"] == "good";
        until(|| {
            let all = self.ask("GET", "/api/v1/drives", None).ok().filter(|(status, _)| *status == 200);
            all.is_some_and(|(_, all)| all.as_array().is_some_and(|all| all.iter().all(is_connected)))
        })
        .map_err(|()| io::Error::other(format!("not all drives are there: {}", self.log())))
    }

    /// The process of the daemon.
    pub(super) fn pid(&self) -> u32 {
        self.pid.load(Ordering::Relaxed)
    }

    /// How it has ended, if it has: its code, where it has one.
    pub(super) fn has_ended(&self) -> Option<Option<i32>> {
        let mut daemon = self.daemon.lock().unwrap_or_else(PoisonError::into_inner);
        daemon.as_mut()?.try_wait().ok()?.map(|status| status.code())
    }

    /// It is asked to end: its code, where it has one. `None`: it does not end.
    pub(super) fn end(&self) -> Option<Option<i32>> {
        process::signal(self.pid(), "TERM");
        until(|| self.has_ended().is_some()).ok()?;
        self.has_ended()
    }

    /// The disk of the daemon's state, as it is seen from here; `None`: it has none of its own.
    pub(super) fn disk(&self) -> Option<PathBuf> {
        let state = self.state();
        let below = state.strip_prefix("/").ok()?;
        Some(process::folder(self.pid()).join("root").join(below)).filter(|_| self.has_own_disk)
    }

    /// What the daemon has said on its standard error.
    pub(super) fn log(&self) -> String {
        fs::read_to_string(self.folder.join("log")).unwrap_or_default()
    }

    /// What HTTP answers: its status and what stands in it. A command has a body.
    pub(super) fn ask(&self, method: &str, path: &str, body: Option<&str>) -> io::Result<(u16, Value)> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.http))?;
        stream.set_read_timeout(Some(ANSWER))?;
        let (token, body) = (&self.token, body.unwrap_or_default());
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {token}\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer)?;
        let no_answer = || io::Error::new(io::ErrorKind::InvalidData, format!("no answer: {answer:?}"));
        let (head, body) = answer.split_once("\r\n\r\n").ok_or_else(no_answer)?;
        let status = head.get(9..12).and_then(|status| status.parse().ok()).ok_or_else(no_answer)?;
        Ok((status, serde_json::from_str(body).unwrap_or_default()))
    }
}

impl Drive {
    /// Its address in the API.
    pub(super) fn path(&self, act: &str) -> String {
        format!("/api/v1/drives/{}/{act}", self.name.replace(' ', "%20"))
    }
}

#[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
fn until(mut is_so: impl FnMut() -> bool) -> Result<(), ()> {
    let begun = Instant::now();
    while !is_so() {
        if begun.elapsed() > READY {
            return Err(());
        }
        thread::sleep(Duration::from_millis(100));
    }
    Ok(())
}
