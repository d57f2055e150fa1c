//! The page, read by a headless Chromium.

use std::{
    io::{BufRead as _, BufReader, Lines, Write as _},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use drive_testing::peers;
use serde_json::Value;

/// A Chromium that looks at the page, on a screen and on a phone.
pub(crate) struct Page {
    child: Child,
    asks: Option<ChildStdin>,
    lines: Lines<BufReader<ChildStdout>>,
}

impl Page {
    /// Whether there is a Chromium, and a Python with Playwright.
    pub(crate) fn is_installed() -> bool {
        let chromium = peers::is_there(peers::runs("/usr/bin/chromium", &["--version"]), "Chromium");
        peers::python_with("playwright").is_some() && chromium
    }

    /// Opens the page that is served at this port of the machine.
    pub(crate) fn open(http: u16) -> Self {
        let python = std::env::var("DRIVED_PYTHON").unwrap_or_else(|_| "python3".to_owned());
        let mut child = Command::new(python)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page_reader.py"))
            .arg(format!("http://127.0.0.1:{http}/"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the script starts");
        let asks = child.stdin.take();
        let mut lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        assert_eq!(lines.next().expect("it speaks").expect("it is text"), "ready");
        Self { child, asks, lines }
    }

    /// What is shown of something.
    pub(crate) fn shows(&mut self, what: &str) -> Value {
        writeln!(self.asks.as_mut().expect("it is open"), "{what}").expect("it reads");
        let line = self.lines.next().expect("it has not ended").expect("it is text");
        serde_json::from_str(&line).expect("it is JSON")
    }

    /// Closes it: nothing was complained of in its console.
    pub(crate) fn close(mut self) {
        drop(self.asks.take());
        assert!(self.child.wait().expect("it ends").success(), "the page has complained");
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
