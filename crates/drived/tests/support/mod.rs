//! Runs the built program.

// Not every test program uses everything here.
#![allow(dead_code)]

use std::{
    io::{BufRead, BufReader, Read as _, Write},
    net::{TcpListener, TcpStream},
    path::PathBuf,
    process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    thread,
    time::Duration,
};

use drive_testing::peers;

/// The program with arguments, not yet started.
pub(crate) fn drived(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_drived"));
    command.args(arguments).env_remove("DRIVED_LOG").env("RUST_BACKTRACE", "1");
    // Its daemon's socket is its own, where the test names none.
    command.env_remove("RUNTIME_DIRECTORY").env("XDG_RUNTIME_DIR", runtime_folder());
    // And so is what it keeps.
    command.env_remove("STATE_DIRECTORY").env("XDG_STATE_HOME", path("states"));
    command
}

/// A folder that is not there yet, another one each time.
fn runtime_folder() -> PathBuf {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    path(&format!("runtime-{}", NEXT.fetch_add(1, Ordering::Relaxed)))
}

/// What a run of the program left behind.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Ended {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            out: String::from_utf8(output.stdout).expect("stdout is text"),
            err: String::from_utf8(output.stderr).expect("stderr is text"),
        }
    }

    /// It ended with this code and one line on stderr that says this.
    #[track_caller]
    pub(crate) fn assert_refused(&self, code: i32, reason: &str) {
        assert_eq!(self.code, Some(code), "{self:?}");
        assert_eq!(self.err.lines().count(), 1, "{self:?}");
        assert!(self.err.starts_with("drived: ") && self.err.contains(reason), "{self:?}");
        assert!(!self.err.contains("panicked"), "{self:?}");
    }

    /// It is an alarm that a stop is not confirmed: when it is one, while the stop goes on, and once more when that ends.
    #[track_caller]
    pub(crate) fn assert_stop_not_confirmed(&self) {
        assert_eq!(self.code, Some(1), "{self:?}");
        let alarm = "drived: STOP NOT CONFIRMED, the motor may turn: use the emergency stop. ";
        assert!(self.err.lines().all(|line| line.starts_with(alarm)), "{self:?}");
        assert!((1..=2).contains(&self.err.lines().count()), "{self:?}");
    }

    /// It ended well, and said nothing on stderr.
    #[track_caller]
    pub(crate) fn assert_done(&self) -> &str {
        assert_eq!((self.code, self.err.as_str()), (Some(0), ""), "{self:?}");
        &self.out
    }
}

/// Runs the program to its end.
pub(crate) fn run(arguments: &[&str]) -> Ended {
    Ended::from(drived(arguments).stdin(Stdio::null()).output().expect("the program starts"))
}

/// A path of this test alone.
pub(crate) fn path(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("drived-test-{}-{name}", std::process::id()))
}

/// Between two looks at what tells nobody that it has changed: it leaves the processor to what is waited for.
#[expect(clippy::disallowed_methods, reason = "the tests have threads of their own")]
pub(crate) fn look_again() {
    thread::sleep(Duration::from_millis(5));
}

/// Sends the text of a request on a connection of its own, and gives what is answered.
pub(crate) fn ask(port: u16, request: &str) -> String {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
    stream.write_all(request.as_bytes()).expect("it reads");
    let mut answer = String::new();
    // It may end the connection before it has read everything.
    let _ = stream.read_to_string(&mut answer);
    answer
}

/// What is answered to somebody who asks a server of this machine, and ends the connection. Not by HTTP/1.0, in which proxies ask.
pub(crate) fn get(port: u16, path: &str, accept: &str) -> String {
    let request =
        format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nAccept: {accept}\r\nConnection: close\r\n\r\n");
    let answer = ask(port, &request);
    let (head, body) = answer.split_once("\r\n\r\n").expect("an answer has a head");
    assert!(head.lines().next().is_some_and(|first| first.ends_with("200 OK")), "{answer}");
    body.to_owned()
}

/// A port of this machine that nobody uses.
pub(crate) fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).expect("there is one").port()
}

/// Whether a program that was not written here is there, by a run of it that ends well: see [`drive_testing::peers`].
pub(crate) fn is_there(program: &str, arguments: &[&str]) -> bool {
    peers::is_there(peers::runs(program, arguments), &format!("{program} {}", arguments.join(" ")))
}

/// A Python that has a module, or `None` with the reason printed. `DRIVED_PYTHON` names the interpreter.
pub(crate) fn python_with(module: &str) -> Option<String> {
    let python = std::env::var("DRIVED_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    is_there(&python, &["-c", &format!("import {module}")]).then_some(python)
}

/// A configuration of this test alone; removed when dropped.
pub(crate) struct File(PathBuf);

impl File {
    pub(crate) fn new(name: &str, text: &str) -> Self {
        let path = path(&format!("{name}.toml"));
        std::fs::write(&path, text).expect("the directory can be written");
        Self(path)
    }

    pub(crate) fn path(&self) -> &str {
        self.0.to_str().expect("the path is text")
    }
}

impl Drop for File {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The program running beside the test; killed when dropped.
pub(crate) struct Running {
    child: Child,
    input: Option<ChildStdin>,
    lines: Option<BufReader<ChildStdout>>,
    runtime: Option<PathBuf>,
}

impl Running {
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::of(&mut drived(arguments))
    }

    /// The same with an environment of its own.
    pub(crate) fn of(command: &mut Command) -> Self {
        Self::with_output(command, Stdio::piped(), Stdio::piped())
    }

    /// Nobody reads what it says, but whoever wants to know why it has ended.
    pub(crate) fn start_unread(arguments: &[&str], log: std::fs::File) -> Self {
        Self::with_output(&mut drived(arguments), Stdio::null(), log.into())
    }

    fn with_output(command: &mut Command, out: Stdio, err: Stdio) -> Self {
        let runtime = command.get_envs().find(|(name, _)| *name == "XDG_RUNTIME_DIR");
        let runtime = runtime.and_then(|(_, folder)| folder).map(PathBuf::from);
        let mut child =
            command.stdin(Stdio::piped()).stdout(out).stderr(err).spawn().expect("the program starts");
        let input = child.stdin.take();
        let lines = child.stdout.take().map(BufReader::new);
        Self { child, input, lines, runtime }
    }

    /// Says a line on its stdin.
    pub(crate) fn say(&mut self, line: &str) {
        let input = self.input.as_mut().expect("stdin is written");
        writeln!(input, "{line}").expect("the program reads its stdin");
    }

    /// Nobody reads its stdout from now on.
    pub(crate) fn close_stdout(&mut self) {
        self.lines = None;
    }

    /// Waits for a line of its log that contains this.
    pub(crate) fn wait_for_log(&mut self, text: &str) {
        self.log_until(text);
    }

    /// Its log up to the end of the first line that contains this.
    pub(crate) fn log_until(&mut self, text: &str) -> String {
        let log = self.child.stderr.as_mut().expect("stderr is read");
        let (mut all, mut line, mut byte) = (String::new(), Vec::new(), [0]);
        loop {
            let read = std::io::Read::read_exact(log, &mut byte);
            assert!(read.is_ok(), "the program ended without saying {text:?}: {all}");
            line.push(byte[0]);
            if byte == *b"\n" {
                let whole = String::from_utf8_lossy(&line).into_owned();
                line.clear();
                all += &whole;
                if whole.contains(text) {
                    return all;
                }
            }
        }
    }

    /// Nobody reads its log from now on.
    pub(crate) fn close_log(&mut self) {
        self.child.stderr = None;
    }

    /// Its next line that contains this.
    pub(crate) fn wait_for(&mut self, text: &str) -> String {
        let mut line = String::new();
        let lines = self.lines.as_mut().expect("stdout is read");
        while lines.read_line(&mut line).expect("stdout is text") > 0 {
            if line.contains(text) {
                return line;
            }
            line.clear();
        }
        panic!("the program ended without saying {text:?}");
    }

    /// Asks it to end as Ctrl-C does.
    pub(crate) fn ask_to_end(&mut self) {
        self.signal("-INT");
    }

    /// Sends it a signal, such as `-STOP`.
    pub(crate) fn signal(&mut self, signal: &str) {
        let pid = self.child.id().to_string();
        let sent = Command::new("kill").args([signal, &pid]).status().expect("kill runs");
        assert!(sent.success());
    }

    /// Whether it has ended.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("it can be waited for").is_some()
    }

    /// Asks it to end as Ctrl-C does, and waits for it: its exit code and its last lines.
    pub(crate) fn interrupt(mut self) -> (Option<i32>, String) {
        self.ask_to_end();
        self.end()
    }

    /// Waits for its end: its exit code and its last lines.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let mut rest = String::new();
        if let Some(lines) = &mut self.lines {
            std::io::Read::read_to_string(lines, &mut rest).expect("stdout is text");
        }
        (self.child.wait().expect("it can be waited for").code(), rest)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(runtime) = &self.runtime {
            let _ = std::fs::remove_dir_all(runtime);
        }
    }
}

/// Simulated drives on a pty of this test alone.
pub(crate) struct Sim {
    running: Option<Running>,
    link: PathBuf,
}

impl Sim {
    pub(crate) fn serve(name: &str, drives: &[&str]) -> Self {
        Self::serve_with(name, drives, &[])
    }

    /// The same with more arguments.
    pub(crate) fn serve_with(name: &str, drives: &[&str], more: &[&str]) -> Self {
        let link = path(name);
        let mut arguments = vec!["sim", "--pty", link.to_str().expect("the path is text")];
        arguments.extend(more);
        for drive in drives {
            arguments.extend(["--drive", drive]);
        }
        let mut running = Running::start(&arguments);
        running.wait_for("serving");
        Self { running: Some(running), link }
    }

    pub(crate) fn link(&self) -> &str {
        self.link.to_str().expect("the path is text")
    }

    /// Runs a subcommand on one of the drives.
    pub(crate) fn on(&self, drive: &str, subcommand: &[&str]) -> Ended {
        let arguments = [subcommand, &["--line", self.link(), "--drive", drive]].concat();
        run(&arguments)
    }

    /// Says a line on its stdin, and waits for an answer that contains this.
    pub(crate) fn say(&mut self, line: &str, answer: &str) -> String {
        let running = self.running.as_mut().expect("it runs");
        running.say(line);
        running.wait_for(answer)
    }

    /// Ends it as Ctrl-C does.
    pub(crate) fn interrupt(mut self) -> (Option<i32>, String) {
        self.running.take().expect("it runs").interrupt()
    }
}

impl Drop for Sim {
    fn drop(&mut self) {
        if self.running.take().is_some() {
            let _ = std::fs::remove_file(&self.link);
        }
    }
}
