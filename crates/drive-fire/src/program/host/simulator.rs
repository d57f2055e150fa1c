//! A simulated line behind a pty that is stopped, killed and begun again like any other process, and says meanwhile what its machines do.

use std::{
    fs,
    io::{self, BufRead as _, BufReader, Write as _},
    path::{Path, PathBuf},
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
    time::Instant,
};

use drive_sim::Observation;

use super::super::process;

/// What an observer saw of a machine, at some moment between asking and being told.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    pub(super) asked: Instant,
    pub(super) told: Instant,
    /// Of which of the simulators that came one after the other.
    pub(super) life: u32,
    pub(super) seen: Observation,
}

pub(super) struct Simulator {
    program: PathBuf,
    link: PathBuf,
    arguments: Vec<String>,
    machines: usize,
    /// Nought while there is none.
    pid: AtomicU32,
    life: Mutex<Life>,
}

/// The simulator that there is, and whom it talks to.
#[derive(Default)]
struct Life {
    number: u32,
    talk: Option<(Child, ChildStdin, BufReader<ChildStdout>)>,
}

impl Drop for Life {
    fn drop(&mut self) {
        self.end();
    }
}

impl Life {
    fn end(&mut self) {
        if let Some((mut child, ..)) = self.talk.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    fn say(&mut self, line: &str) -> Option<String> {
        let (_, input, output) = self.talk.as_mut()?;
        writeln!(input, "{line}").ok()?;
        let mut said = String::new();
        (output.read_line(&mut said).ok()? > 0).then_some(said)
    }
}

impl Simulator {
    /// Of these machines on a line of this speed and format.
    pub(super) fn new(program: &Path, link: PathBuf, serial: [&str; 2], machines: &[&str]) -> Self {
        let [baud, format] = serial;
        let mut arguments = vec!["sim", "--baud", baud, "--format", format];
        arguments.extend(machines.iter().flat_map(|machine| ["--drive", machine]));
        Self {
            program: program.to_owned(),
            link,
            arguments: arguments.into_iter().map(str::to_owned).collect(),
            machines: machines.len(),
            pid: AtomicU32::new(0),
            life: Mutex::default(),
        }
    }

    fn life(&self) -> MutexGuard<'_, Life> {
        self.life.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn link(&self) -> &Path {
        &self.link
    }

    /// Its pty is there when this ends.
    pub(super) fn begin(&self) -> io::Result<()> {
        let mut child = Command::new(&self.program)
            .args(&self.arguments)
            .arg("--pty")
            .arg(&self.link)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(io::Error::other("it has no standard input and output"));
        };
        let (pid, mut output) = (child.id(), BufReader::new(output));
        // What it serves, and each machine.
        for _ in 0..=self.machines {
            output.read_line(&mut String::new())?;
        }
        let mut life = self.life();
        life.end();
        life.number += 1;
        life.talk = Some((child, input, output));
        self.pid.store(pid, Ordering::Relaxed);
        if fs::symlink_metadata(&self.link).is_ok() {
            Ok(())
        } else {
            Err(io::Error::other("a simulator does not begin"))
        }
    }

    /// It is gone as nobody can refuse to be, and its pty with it. The link goes first: the system soon gives the name behind it to another's.
    pub(super) fn kill(&self) {
        let _ = fs::remove_file(&self.link);
        let pid = self.pid.swap(0, Ordering::Relaxed);
        if pid != 0 {
            process::signal(pid, "KILL");
        }
        // Whoever waits for its words is told their end by now.
        self.life().end();
    }

    /// Gives it this signal. False: it is not there.
    pub(super) fn signal(&self, signal: &str) -> bool {
        let pid = self.pid.load(Ordering::Relaxed);
        pid != 0 && process::signal(pid, signal)
    }

    /// What is to be seen of a machine, once the simulator gets to it; `None`: it is not there.
    pub(super) fn look(&self, machine: &str) -> Option<Look> {
        let mut life = self.life();
        let asked = Instant::now();
        let seen = read(&life.say(&format!("{machine} show"))?)?;
        Some(Look { asked, told: Instant::now(), life: life.number, seen })
    }
}

/// An observation as `show` prints it.
fn read(text: &str) -> Option<Observation> {
    let mut parts = text.trim().split(", ");
    let running = match parts.next()? {
        "fed" => true,
        "not fed" => false,
        _ => return None,
    };
    let mut hundredths = |name: &str| -> Option<i32> {
        let hertz: f64 = parts.next()?.strip_prefix(name)?.strip_suffix(" Hz")?.trim().parse().ok()?;
        Some((hertz * 100.0).round() as i32)
    };
    let (output_frequency, shaft_frequency) = (hundredths("output")?, hundredths("shaft")?);
    let setpoint = hundredths("setpoint")?;
    let trip = parts.find_map(|part| part.strip_prefix("tripped (")?.strip_suffix(')')?.parse().ok());
    Some(Observation { running, output_frequency, shaft_frequency, setpoint, trip, ..Observation::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_simulator_shows_is_read_and_nothing_else_is() {
        let seen = read("fed, output -20.05 Hz, shaft -20.00 Hz, setpoint 30.00 Hz\n").expect("it is one");
        let expected = (true, -2_005, -2_000, 3_000, None);
        assert_eq!(
            (seen.running, seen.output_frequency, seen.shaft_frequency, seen.setpoint, seen.trip),
            expected
        );
        let tripped = "not fed, output 0.00 Hz, shaft 4.20 Hz, setpoint 0.00 Hz, tripped (24), control is at the machine";
        let seen = read(tripped).expect("it is one");
        assert_eq!((seen.running, seen.shaft_frequency, seen.trip), (false, 420, Some(24)));
        assert_eq!(read("refused: \"atv312@9\" is no drive of this line"), None);
        assert_eq!(read(""), None);
    }
}
