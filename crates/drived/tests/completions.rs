//! What the tab key offers in real shells, each on a terminal of its own, with a daemon and without. `.ci/run` installs them.
#![cfg(unix)]

mod support;

use std::{
    io::{Read as _, Write as _},
    path::Path,
    process::{Child, ChildStdin, Command, Stdio},
    sync::mpsc::{Receiver, channel},
    time::Duration,
};

use support::{File, Running, Sim, is_there, path};

/// A shell that says nothing for so long has nothing more to say: the test fails.
const PATIENCE: Duration = Duration::from_secs(60);
/// How often the tab key is pressed.
const TRIES: u32 = 20;

/// Drives whose names a shell has to quote, a group and a line.
struct Plant {
    _running: Running,
    _sim: Sim,
    file: File,
    socket: String,
}

impl Plant {
    fn start(name: &str) -> Self {
        let sim = Sim::serve(name, &["atv312@1-2", "atv21@5"]);
        let text = format!(
            "[http]\nlisten = \"off\"\n[groups]\n\"both pumps\" = [\"pump 1\", \"pump 2\"]\n[lines.bench]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv312@1-2\"\nname = \"pump {{}}\"\n\
             [[drives]]\nline = \"bench\"\ndrive = \"atv21@5\"\nname = \"Fan:O'Neill $5\"\n",
            sim.link()
        );
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock")).display().to_string();
        let mut running = Running::start(&["run", "--config", file.path(), "--socket", &socket]);
        running.wait_for(r#""event":"connected""#);
        Self { _running: running, _sim: sim, file, socket }
    }
}

/// A shell on a terminal, with the completions of the built program.
struct Shell {
    child: Child,
    keys: ChildStdin,
    said: Receiver<Vec<u8>>,
    ended: u32,
}

impl Shell {
    /// `None`, with the reason printed, where there is none.
    fn open(name: &str) -> Option<Self> {
        let (command, prepare) = match name {
            "bash" => (
                "bash --norc --noprofile -i",
                "bind 'set bell-style none'; bind 'set completion-query-items -1'; bind 'set page-completions off'; \
                 bind 'set show-all-if-ambiguous on'; bind 'set enable-bracketed-paste off'; \
                 source <(drived completions bash)",
            ),
            "zsh" => (
                "zsh -f -i",
                "autoload -Uz compinit; compinit -u -D; unsetopt beep; LISTMAX=0; source <(drived completions zsh)",
            ),
            _ => ("fish --no-config -i", "drived completions fish | source"),
        };
        if !is_there(name, &["--version"]) || !is_there("script", &["--version"]) {
            return None;
        }
        let program = Path::new(env!("CARGO_BIN_EXE_drived"));
        let folders = std::env::var("PATH").unwrap_or_default();
        let folders = format!("{}:{folders}", program.parent().expect("it stands in a folder").display());
        let mut child = Command::new("script")
            .args(["-q", "-c", &format!("stty cols 200 rows 50; exec {command}"), "/dev/null"])
            .env("PATH", folders)
            .env("TERM", "xterm")
            .env("LC_ALL", "C.UTF-8")
            .env("XDG_RUNTIME_DIR", path(&format!("no-daemon-{name}")))
            .env_remove("RUNTIME_DIRECTORY")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("script runs");
        let keys = child.stdin.take().expect("stdin is piped");
        let mut terminal = child.stdout.take().expect("stdout is piped");
        let (tell, said) = channel();
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(read @ 1..) = terminal.read(&mut bytes) {
                if tell.send(bytes[..read].to_vec()).is_err() {
                    break;
                }
            }
        });
        let mut shell = Self { child, keys, said, ended: 0 };
        shell.enter(prepare);
        Some(shell)
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).and_then(|()| self.keys.flush()).expect("the shell reads");
    }

    /// Enters a line, and gives everything that came up to its end.
    fn enter(&mut self, line: &str) -> String {
        self.ended += 1;
        // The line itself is echoed, and does not contain what is waited for.
        let end = format!("ended-{}", self.ended);
        self.press(&format!("{line}; echo 'end''ed-{}'\r", self.ended));
        let mut all = Vec::new();
        while !String::from_utf8_lossy(&all).contains(&end) {
            match self.said.recv_timeout(PATIENCE) {
                Ok(bytes) => all.extend(bytes),
                Err(error) => panic!("{error}: {}", String::from_utf8_lossy(&all)),
            }
        }
        String::from_utf8_lossy(&all).into_owned()
    }

    /// The words that a line has when the tab key has been pressed behind it, as the shell gives them to a program.
    fn completed(&mut self, line: &str) -> Vec<String> {
        self.press(&format!("{line}\t"));
        // The cursor goes to the beginning and back.
        let said = self.enter("\x01printf '<%s>' \x05");
        let words = said.rsplit("<drived>").next().filter(|_| said.contains("<drived>"));
        let words = words.unwrap_or_else(|| panic!("{line}: {said}"));
        let words = words.split_once("ended-").map_or(words, |(words, _)| words);
        words.split('>').filter_map(|word| word.split_once('<')).map(|(_, word)| word.to_owned()).collect()
    }

    /// The last word of a line becomes this one by the tab key, pressed again and again, as one does: the program gives up after half
    /// a second, which a busy machine may need for its start.
    fn assert_completed(&mut self, line: &str, last: &str, name: &str) {
        let mut words = Vec::new();
        for _ in 0..TRIES {
            words = self.completed(line);
            if words.last().is_some_and(|word| word == last) {
                return;
            }
        }
        panic!("{name}: {line}: {words:?}, and not {last}");
    }

    /// Waits until all of these words, plain or quoted, stand on the terminal when the tab key has been pressed behind a line.
    /// zsh lists nothing while more is typed.
    fn offers(&mut self, line: &str, words: &[[&str; 2]]) {
        let (mut all, mut tries) = (Vec::new(), TRIES);
        self.press(&format!("{line}\t"));
        let stands = |all: &[u8], forms: &[&str; 2]| {
            let all = String::from_utf8_lossy(all);
            forms.iter().any(|form| all.contains(form))
        };
        while !words.iter().all(|forms| stands(&all, forms)) {
            match self.said.recv_timeout(PATIENCE / TRIES) {
                Ok(bytes) => all.extend(bytes),
                Err(error) if tries == 0 => panic!("{error}: {}", String::from_utf8_lossy(&all)),
                Err(_) => {
                    tries -= 1;
                    self.press(&format!("\x15{line}\t"));
                }
            }
        }
        self.enter("\x15true");
    }
}

impl Drop for Shell {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn in_each_shell(check: impl Fn(&mut Shell, &str)) {
    for name in ["bash", "zsh", "fish"] {
        if let Some(mut shell) = Shell::open(name) {
            check(&mut shell, name);
        }
    }
}

#[test]
fn a_line_is_completed_with_the_names_of_the_daemon_quoted_as_the_shell_needs_it() {
    let plant = Plant::start("tab");
    let socket = &plant.socket;
    in_each_shell(|shell, name| {
        for (line, last) in [
            ("drived stop --socket SOCKET both", "both pumps"),
            ("drived status --socket SOCKET Fan", "Fan:O'Neill $5"),
            ("drived status --socket SOCKET fan", "Fan:O'Neill $5"),
            ("drived param get --socket SOCKET pump\\ 2 HS", "HSP"),
            ("drived param set --socket SOCKET 'pump 1' tCC 3", "3C"),
            ("drived explain --socket SOCKET --from be", "bench"),
        ] {
            shell.assert_completed(&line.replace("SOCKET", socket), last, name);
        }
        let words = [["pump 1", "pump\\ 1"], ["pump 2", "pump\\ 2"], ["both pumps", "both\\ pumps"]];
        shell.offers(&format!("drived start --socket {socket} "), &words);
    });
}

#[test]
fn families_settings_options_and_registers_are_completed_without_a_daemon() {
    in_each_shell(|shell, name| {
        for (line, last) in [
            ("drived stat", "status"),
            ("drived status --dri", "--drive"),
            ("drived poll --drive 3g", "3g3ev@"),
            ("drived poll --drive atv312@1 --line rtu+", "rtu+tcp://"),
            ("drived poll --drive atv312@1 --line rtu+tcp://plant:4001,19", "rtu+tcp://plant:4001,19200"),
            ("drived poll --drive atv312@1 --line /dev/ttyUSB0,19200,8E", "/dev/ttyUSB0,19200,8E1"),
            ("drived stop --line /dev/x --drive atv312@1 --mode=fr", "--mode=freewheel"),
            ("drived status --drive 3g3ev@1 --option fau", "fault-reset-function="),
            ("drived param get --line /dev/x --drive atv312@1 ACC HS", "HSP"),
            ("drived param list 3g", "3g3ev"),
            ("drived families atv5", "atv58"),
            ("drived help fam", "families"),
        ] {
            shell.assert_completed(line, last, name);
        }
    });
}

#[test]
fn files_are_completed_by_the_shell_and_a_named_one_tells_its_names() {
    let plant = Plant::start("files");
    let (file, socket) = (plant.file.path(), &plant.socket);
    let beginning = file.strip_suffix("oml").expect("its name");
    in_each_shell(|shell, name| {
        shell.assert_completed(&format!("drived check --config {beginning}"), file, name);
        shell.assert_completed(&format!("drived explain x.pcapng --config {file} --name ben"), "bench", name);
        shell.assert_completed(&format!("drived param diff --socket {socket} fac"), "factory", name);
    });
}
