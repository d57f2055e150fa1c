//! A daemon over simulated drives, in a folder of its own; both are ended with it.

use std::{
    fs::{self, File},
    io::{self, Read as _, Write as _},
    net::{TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use super::{broker::Broker, misfortunes, process};

/// Until it is there, at the most.
const READY: Duration = Duration::from_secs(60);

pub(super) struct Plant {
    program: PathBuf,
    pub(super) folder: PathBuf,
    pub(super) http: u16,
    pub(super) gateway: u16,
    pub(super) broker: Broker,
    line: Line,
    disk: Disk,
    /// The wrong line in the daemon.
    mutant: Option<&'static str>,
    daemon: Option<Child>,
}

/// Where the daemon keeps its state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Disk {
    /// Where everything else is.
    Usual,
    /// On a small one of its own, where the system gives one.
    Small,
}

/// A simulated line.
pub(super) struct Line {
    path: PathBuf,
    sim: Child,
}

impl Drop for Line {
    fn drop(&mut self) {
        let _ = self.sim.kill();
        let _ = self.sim.wait();
    }
}

impl Line {
    /// It ends with its standard input.
    fn start(program: &Path, path: PathBuf) -> io::Result<Self> {
        let sim = Command::new(program)
            .args(["sim", "--drive", "atv312@1-2", "--drive", "atv21@5"])
            .args(["--baud", "19200", "--format", "8E1", "--pty"])
            .arg(&path)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        Ok(Self { path, sim })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        self.kill();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn free_port() -> io::Result<u16> {
    TcpListener::bind("127.0.0.1:0")?.local_addr().map(|address| address.port())
}

impl Plant {
    pub(super) fn start(program: &Path) -> io::Result<Self> {
        Self::with_mutant(program, None)
    }

    /// With this wrong line in the daemon, where the program was built with them all.
    pub(super) fn with_mutant(program: &Path, mutant: Option<&'static str>) -> io::Result<Self> {
        let folder = std::env::temp_dir().join(format!("drive-fire-{}", std::process::id()));
        Self::start_in(program, folder, Disk::Usual, mutant)
    }

    /// Another plant of the same program.
    pub(super) fn another_with(&self, disk: Disk) -> io::Result<Self> {
        Self::start_in(&self.program, self.folder.join("another-plant"), disk, self.mutant)
    }

    fn start_in(
        program: &Path,
        folder: PathBuf,
        disk: Disk,
        mutant: Option<&'static str>,
    ) -> io::Result<Self> {
        fs::create_dir_all(&folder)?;
        let disk = if disk == Disk::Small && !misfortunes::may_mount() { Disk::Usual } else { disk };
        let line = Line::start(program, folder.join("line"))?;
        let (http, gateway) = (free_port()?, free_port()?);
        let broker = Broker::start()?;
        let mut plant = Self {
            program: program.to_owned(),
            folder,
            http,
            gateway,
            broker,
            line,
            disk,
            mutant,
            daemon: None,
        };
        plant.until("the simulated line", |plant| plant.line.path.exists())?;
        fs::create_dir_all(plant.state())?;
        fs::write(plant.config(), plant.text(&plant.line.path))?;
        File::create(plant.folder.join("log"))?;
        plant.begin()?;
        Ok(plant)
    }

    /// The daemon begins, and knows its drives when this ends.
    pub(super) fn begin(&mut self) -> io::Result<()> {
        let log = File::options().append(true).open(self.folder.join("log"))?;
        let mut command = self.tool();
        if self.disk == Disk::Small {
            // Its state lies on a disk of its own, which nobody else sees.
            let script = "mount -t tmpfs -o size=12m none \"$XDG_STATE_HOME\" && exec \"$0\" \"$@\"";
            command = process::at_home("unshare", &self.folder, &self.state());
            command.args(["--map-root-user", "--mount", "sh", "-c", script]).arg(&self.program);
        }
        command.envs(self.mutant.map(|mutant| ("DRIVED_MUTANT", mutant)));
        let daemon = command
            .arg("run")
            .arg("--config")
            .arg(self.config())
            .arg("--socket")
            .arg(self.folder.join("socket"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()?;
        self.daemon = Some(daemon);
        self.until("three drives that were identified", |plant| {
            let answer = plant.ask(plant.http, b"GET /api/v1/drives HTTP/1.1\r\nHost: localhost\r\n\r\n");
            let text = answer.map(|answer| String::from_utf8_lossy(&answer).into_owned()).unwrap_or_default();
            text.matches("\"connection\":\"online\"").count()
                + text.matches("\"connection\": \"online\"").count()
                >= 3
                || text.matches("output_frequency").count() >= 3
        })
    }

    /// The daemon is killed as nobody can refuse to be.
    pub(super) fn kill(&mut self) {
        if let Some(mut daemon) = self.daemon.take() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }

    fn state(&self) -> PathBuf {
        self.folder.join("state")
    }

    /// The disk of the daemon's state, as it is seen from here; `None`: it has none of its own.
    pub(super) fn seen_disk(&self) -> Option<PathBuf> {
        let state = self.state();
        let below = state.strip_prefix("/").ok()?;
        Some(process::folder(self.pid()?).join("root").join(below)).filter(|_| self.disk == Disk::Small)
    }

    /// The process of the daemon.
    pub(super) fn pid(&self) -> Option<u32> {
        self.daemon.as_ref().map(Child::id)
    }

    /// Another line with the same drives, which this daemon does not serve.
    pub(super) fn another_line(&self) -> io::Result<Line> {
        let line = Line::start(&self.program, self.folder.join("another"))?;
        self.until("another simulated line", |_| line.path.exists())?;
        Ok(line)
    }

    pub(super) fn config(&self) -> PathBuf {
        self.folder.join("drives.toml")
    }

    /// Whoever comes may stop and give setpoints; nobody can start over the gateway, and nobody is asked to start over HTTP.
    fn text(&self, line: &Path) -> String {
        let (Self { http, gateway, .. }, mqtt) = (self, self.broker.port);
        format!(
            "snapshots = \"1s\"\naudit = \"{}\"\n[http]\nlisten = \"127.0.0.1:{http}\"\n[defaults]\ncontrol = true\n\
             watchdog = {{ time = \"10s\", reaction = \"ramp\" }}\n[lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv21@5\"\nname = \"fan\"\n\
             [groups]\npumps = [\"pump 1\", \"pump 2\"]\n\
             [[gateways]]\nlisten = \"127.0.0.1:{gateway}\"\nwrites = \"stop\"\nvirtual_unit = 247\nmax_age = \"10s\"\n\
             [mqtt]\nservers = [\"mqtt://127.0.0.1:{mqtt}\"]\ncommands = true\ndiscovery = \"device\"\n\
             [mqtt.commanders]\nhmi = \"stop\"\npanel = \"stop\"\ndesk = \"operate\"\n[history]\n",
            self.state().join("audit").display(),
            line.display()
        )
    }

    /// The program, with a state folder of this plant.
    pub(super) fn tool(&self) -> Command {
        process::at_home(&self.program, &self.folder, &self.state())
    }

    #[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
    pub(super) fn until(&self, what: &str, is_there: impl Fn(&Self) -> bool) -> io::Result<()> {
        let begun = Instant::now();
        while !is_there(self) {
            if begun.elapsed() > READY {
                let why = format!("{what} did not come in {READY:?}: {}", self.log());
                return Err(io::Error::other(why));
            }
            thread::sleep(Duration::from_millis(50));
        }
        Ok(())
    }

    /// What is answered to these bytes, behind which nothing comes.
    pub(super) fn ask(&self, port: u16, bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_read_timeout(Some(Duration::from_secs(20)))?;
        stream.set_write_timeout(Some(Duration::from_secs(20)))?;
        // What it has refused it need not read.
        let _ = stream.write_all(bytes);
        // A server of HTTP gives up a request whose client says nothing more; who wants his answer says that he waits for the end.
        if !bytes.windows(17).any(|header| header == b"Connection: close") {
            let _ = stream.shutdown(std::net::Shutdown::Write);
        }
        let mut answer = Vec::new();
        match stream.read_to_end(&mut answer) {
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                Err(error)
            }
            _ => Ok(answer),
        }
    }

    /// The one frame of Modbus TCP that answers another.
    pub(super) fn ask_whole(&self, port: u16, frame: &[u8]) -> io::Result<Vec<u8>> {
        let mut stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_read_timeout(Some(Duration::from_secs(10)))?;
        stream.write_all(frame)?;
        let mut answer = vec![0; 6];
        stream.read_exact(&mut answer)?;
        let mut rest = vec![0; u16::from_be_bytes([answer[4], answer[5]]).into()];
        stream.read_exact(&mut rest)?;
        answer.extend(rest);
        Ok(answer)
    }

    /// What the daemon has said on its standard error.
    pub(super) fn log(&self) -> String {
        fs::read_to_string(self.folder.join("log")).unwrap_or_default()
    }

    /// What it holds in memory, in KiB; `None`: this system does not say.
    pub(super) fn memory(&self) -> Option<u64> {
        process::memory(self.pid()?)
    }
}
