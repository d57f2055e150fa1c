//! The page in a Chromium, of which somebody presses the stop.

use std::{
    io::{BufRead as _, BufReader, Error, ErrorKind, Result, Write as _},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::Duration,
};

use crate::peers::{Python, interpreter};

/// A script that shows the page, and presses when a line says by what.
pub(super) struct Browser {
    script: Child,
    /// `None` when it is to end.
    says: Option<ChildStdin>,
    told: BufReader<ChildStdout>,
}

impl Browser {
    /// Shows a page; `None` where there is no Chromium, or no Playwright.
    pub(super) fn start(page: &str) -> Result<Option<Self>> {
        if !Path::new("/usr/bin/chromium").exists() || !Python("playwright").is_installed() {
            return Ok(None);
        }
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/stop_in_browser.py");
        let mut command = Command::new(interpreter());
        let mut script =
            command.arg(script).arg(page).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let (says, told) = (script.stdin.take(), script.stdout.take());
        let (Some(says), Some(told)) = (says, told) else { return Ok(None) };
        let mut browser = Self { script, says: Some(says), told: BufReader::new(told) };
        browser.line()?;
        Ok(Some(browser))
    }

    /// Presses, by `pointer` or `key`: how long it took from then until the page had the answer.
    pub(super) fn press(&mut self, by: &str) -> Result<Duration> {
        let says = self.says.as_mut().ok_or(ErrorKind::BrokenPipe)?;
        writeln!(says, "{by}")?;
        let ms: f64 = self.line()?.trim().parse().map_err(|_| Error::from(ErrorKind::TimedOut))?;
        Duration::try_from_secs_f64(ms / 1_000.0).map_err(|error| {
            Error::new(ErrorKind::InvalidData, format!("the browser tells of {ms} ms: {error}"))
        })
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        match self.told.read_line(&mut line)? {
            0 => Err(ErrorKind::UnexpectedEof.into()),
            _ => Ok(line),
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It takes its Chromium with it.
        self.says = None;
        let _ = self.script.wait();
    }
}
