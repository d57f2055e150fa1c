//! The page in a Chromium, of which somebody presses the stop.

#![expect(clippy::disallowed_methods, reason = "there is no runtime here")]

use std::{
    io::{BufRead as _, BufReader, Error, ErrorKind, Result, Write as _},
    path::Path,
    process::{Child, ChildStdin, Command, Stdio},
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant},
};

use super::queue::Act;
use crate::peers::{Python, interpreter};

/// It says itself that a stop was not taken; one that says nothing for so long has lost its Chromium.
const SAYS_WITHIN: Duration = Duration::from_secs(60);

const ENDS_WITHIN: Duration = Duration::from_secs(10);

/// A script that shows the page, and presses when a line says by what.
pub(super) struct Browser {
    script: Child,
    /// `None` when it is to end.
    says: Option<ChildStdin>,
    told: Receiver<String>,
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
        let (tell, heard) = channel();
        thread::spawn(move || {
            for line in BufReader::new(told).lines().map_while(Result::ok) {
                if tell.send(line).is_err() {
                    return;
                }
            }
        });
        let browser = Self { script, says: Some(says), told: heard };
        browser.line()?;
        Ok(Some(browser))
    }

    /// Presses, by `pointer` or `key`: when that was, and how long it took from then until the page had the answer.
    pub(super) fn press(&mut self, by: &str) -> Result<(Act, Option<Duration>)> {
        // What it says of a press that was given up is not of this one.
        while self.told.try_recv().is_ok() {}
        let says = self.says.as_mut().ok_or(ErrorKind::BrokenPipe)?;
        writeln!(says, "{by}")?;
        let line = self.line()?;
        let invalid =
            |error| Error::new(ErrorKind::InvalidData, format!("the browser tells of {line}: {error}"));
        let (act, waited) = line.split_once(' ').ok_or(ErrorKind::TimedOut)?;
        let [act, ms] = [act, waited].map(|ms| ms.trim().parse::<f64>().map_err(|error| error.to_string()));
        let (act, ms) = (act.map_err(invalid)?, ms.map_err(invalid)?);
        let waited = Duration::try_from_secs_f64(ms / 1_000.0).map_err(|error| invalid(error.to_string()))?;
        Ok((Act(act), Some(waited)))
    }

    fn line(&self) -> Result<String> {
        self.told.recv_timeout(SAYS_WITHIN).map_err(|_| ErrorKind::TimedOut.into())
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It takes its Chromium with it.
        self.says = None;
        let begun = Instant::now();
        while matches!(self.script.try_wait(), Ok(None)) && begun.elapsed() < ENDS_WITHIN {
            thread::sleep(Duration::from_millis(20));
        }
        let _ = self.script.kill();
        let _ = self.script.wait();
    }
}
