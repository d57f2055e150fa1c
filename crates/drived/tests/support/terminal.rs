//! The built program on a terminal of this test's own, and what stands on its screen.

// Not every test needs all of it.
#![allow(dead_code)]

use std::{
    fs::File,
    io::{Read as _, Write as _},
    os::fd::OwnedFd,
    process::{Child, Command, Stdio},
    sync::mpsc::{Receiver, RecvTimeoutError, channel},
    time::{Duration, Instant},
};

use rustix::{
    pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt},
    termios::{Action, LocalModes, Winsize, tcflow, tcgetattr, tcsetwinsize},
};

/// How long anything may take that comes at all.
const PATIENCE: Duration = Duration::from_secs(60);

/// A program on a terminal; killed when dropped.
pub(crate) struct Terminal {
    child: Child,
    keys: File,
    /// The program's end, so that it can be held.
    end: OwnedFd,
    said: Receiver<Vec<u8>>,
    screen: Screen,
}

impl Terminal {
    /// Starts a program on a terminal of this size, which is its controlling one.
    pub(crate) fn start(command: &mut Command, columns: u16, rows: u16) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("the system gives a pty");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("it is ours");
        let name = ptsname(&master, Vec::new()).expect("it has a name").into_string().expect("it is text");
        let end = File::options().read(true).write(true).open(name).expect("it can be opened");
        let size = Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        tcsetwinsize(&end, size).expect("it has a size");
        let its = || Stdio::from(end.try_clone().expect("it can be shared"));
        // setsid makes it the controlling terminal, so that Ctrl-C is a signal; and where the tests run under nohup, the program does not.
        let mut session = Command::new("env");
        session.args(["--default-signal=HUP", "setsid", "--ctty", "--wait"]);
        session.arg(command.get_program()).args(command.get_args());
        session
            .env("TERM", "xterm-256color")
            .env("LANG", "C.UTF-8")
            .env_remove("LC_ALL")
            .env_remove("LC_CTYPE");
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => session.env(name, value),
                None => session.env_remove(name),
            };
        }
        let child = session.stdin(its()).stdout(its()).stderr(its()).spawn().expect("setsid runs");
        let (tell, said) = channel();
        let mut heard = File::from(master);
        let keys = heard.try_clone().expect("it can be shared");
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(read @ 1..) = heard.read(&mut bytes) {
                if tell.send(bytes[..read].to_vec()).is_err() {
                    break;
                }
            }
        });
        let screen = Screen::new(columns.into(), rows.into());
        Self { child, keys, end: end.into(), said, screen }
    }

    /// Tells the program that its terminal is gone.
    pub(crate) fn hang_up(&self) {
        let session = self.child.id();
        let children = std::fs::read_to_string(format!("/proc/{session}/task/{session}/children"));
        let children = children.expect("Linux tells them");
        let program = children.split_whitespace().next().map_or_else(|| session.to_string(), str::to_owned);
        let told = Command::new("kill").args(["-HUP", &program]).status().expect("kill starts");
        assert!(told.success());
    }

    /// Types this.
    pub(crate) fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).expect("the terminal takes it");
    }

    /// Waits until this stands on the screen, and gives the screen.
    pub(crate) fn wait_for(&mut self, text: &str) -> String {
        self.wait_until(text, |screen| screen.contains(text))
    }

    /// Waits until the screen is as it should be, and gives it.
    pub(crate) fn wait_until(&mut self, what: &str, is_so: impl Fn(&str) -> bool) -> String {
        let until = Instant::now() + PATIENCE;
        loop {
            let screen = self.screen.text();
            if is_so(&screen) {
                return screen;
            }
            match self.said.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(bytes) => self.screen.take(&bytes),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    panic!("{what} does not come:\n{screen}")
                }
            }
        }
    }

    /// Holds what the program shows, as a terminal does on which somebody marks a text; lets it go on.
    pub(crate) fn hold(&self, is_held: bool) {
        let action = if is_held { Action::OOff } else { Action::OOn };
        tcflow(&self.end, action).expect("it can be held");
    }

    /// Whether a key that makes a signal throws away what is on its way to the terminal (termios(3), NOFLSH).
    pub(crate) fn loses_output_by_a_signal(&self) -> bool {
        !tcgetattr(&self.end).expect("it has modes").local_modes.contains(LocalModes::NOFLSH)
    }

    /// Waits for the end: the exit code, what was said at last, and whether the terminal is as it was: with the lines that
    /// were there before, a cursor, an echo, and lines.
    pub(crate) fn end(mut self) -> (Option<i32>, String, bool) {
        let code = self.child.wait().expect("it can be waited for").code();
        let modes = tcgetattr(&self.end).expect("it has modes").local_modes;
        // What was said last may take its time through a terminal on a busy machine.
        let quiet = |screen: &Screen| match screen.is_alternate || screen.is_cursor_hidden {
            true => Duration::from_secs(10),
            false => Duration::from_millis(200),
        };
        while let Ok(bytes) = self.said.recv_timeout(quiet(&self.screen)) {
            self.screen.take(&bytes);
        }
        let is_given_back = modes.contains(LocalModes::ECHO | LocalModes::ICANON | LocalModes::IEXTEN)
            && !self.screen.is_alternate
            && !self.screen.is_cursor_hidden;
        (code, self.screen.text(), is_given_back)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// As much of a terminal as the program needs: characters at places.
struct Screen {
    columns: usize,
    cells: Vec<Vec<char>>,
    row: usize,
    column: usize,
    /// Where the cursor stood before the alternate screen: DECSET 1049 saves it, DECRST 1049 puts it back (xterm, "Private Modes").
    before: (usize, usize),
    is_alternate: bool,
    is_cursor_hidden: bool,
    /// What has come of a sequence or a character that is not whole.
    rest: Vec<u8>,
}

impl Screen {
    fn new(columns: usize, rows: usize) -> Self {
        Self {
            columns,
            cells: vec![vec![' '; columns]; rows],
            row: 0,
            column: 0,
            before: (0, 0),
            is_alternate: false,
            is_cursor_hidden: false,
            rest: Vec::new(),
        }
    }

    fn text(&self) -> String {
        let rows = self.cells.iter().map(|row| row.iter().collect::<String>().trim_end().to_owned());
        rows.collect::<Vec<_>>().join("\n")
    }

    fn take(&mut self, bytes: &[u8]) {
        self.rest.extend_from_slice(bytes);
        let whole = match std::str::from_utf8(&self.rest) {
            Ok(_) => self.rest.len(),
            Err(error) => error.valid_up_to(),
        };
        let text = String::from_utf8_lossy(&self.rest[..whole]).into_owned();
        let mut left = text.as_str();
        while let Some(first) = left.chars().next() {
            if first == '\u{1b}' {
                let Some(length) = self.sequence(left) else { break };
                left = &left[length..];
            } else {
                self.character(first);
                left = &left[first.len_utf8()..];
            }
        }
        self.rest.drain(..whole - left.len());
    }

    /// Does what a sequence asks for, and gives its length; `None` while it is not whole.
    fn sequence(&mut self, text: &str) -> Option<usize> {
        let rest = text.strip_prefix("\u{1b}[");
        let Some(rest) = rest else { return (text.len() > 1).then_some(2) };
        let end = rest.find(|character: char| character.is_ascii_alphabetic())?;
        let (numbers, last) = (&rest[..end], &rest[end..=end]);
        let mut values = numbers.split(';').map(|number| number.parse::<usize>().unwrap_or(1));
        match (last, numbers) {
            ("H", _) => {
                self.row = values.next().unwrap_or(1).saturating_sub(1);
                self.column = values.next().unwrap_or(1).saturating_sub(1);
            }
            ("J", _) => self.cells.iter_mut().for_each(|row| row.fill(' ')),
            ("h" | "l", "?1049") => {
                self.is_alternate = last == "h";
                match self.is_alternate {
                    true => self.before = (self.row, self.column),
                    false => (self.row, self.column) = self.before,
                }
                self.cells.iter_mut().for_each(|row| row.fill(' '));
            }
            ("h" | "l", "?25") => self.is_cursor_hidden = last == "l",
            _ => {}
        }
        Some(2 + end + 1)
    }

    fn character(&mut self, character: char) {
        match character {
            '\r' => self.column = 0,
            '\n' => self.row += 1,
            character => {
                if self.column >= self.columns {
                    (self.row, self.column) = (self.row + 1, 0);
                }
                if let Some(cell) = self.cells.get_mut(self.row).and_then(|row| row.get_mut(self.column)) {
                    *cell = character;
                }
                self.column += 1;
            }
        }
    }
}
