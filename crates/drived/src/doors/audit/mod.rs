//! The audit log: who asked for what, from where, and what was answered. One JSON object a line, each with the SHA-256 of
//! the line before, so that a line that was changed, added or taken out is found.

mod file;
mod verify;

use std::{
    path::Path,
    sync::{
        Arc,
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    time::SystemTime,
};

use drive_fleet::{Event, EventKind, Events, Received};
use serde::Serialize;
use tokio::sync::{oneshot, watch};

use self::file::File;
pub(crate) use self::verify::{Verdict, verify};
use super::rights::{Caller, Rights};

/// Records that wait for the disk.
const WAITING: usize = 256;

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Kind {
    /// The daemon began or ended to serve.
    Daemon,
    /// The configuration was read again, not by a command.
    Configuration,
    /// A command came; it is carried out after this has been written.
    Command,
    /// What was answered to a command, and what became of it if that was known.
    Answer,
    /// What became of a command at a drive, whoever gave it, and what was done with the drive at the exit.
    Outcome,
    /// A token was right.
    Login,
    /// A session was ended by whoever had it.
    Logout,
    /// A token was wrong, or there were too many of them.
    LoginFailed,
    /// A token was added or removed.
    Token,
}

/// One line of the log, without time and chain.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Record {
    pub(crate) kind: Kind,
    pub(crate) caller: String,
    pub(crate) origin: String,
    /// In words, or method and path of a request.
    pub(crate) what: String,
    /// What the request said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) body: Option<serde_json::Value>,
    /// The command's id.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) id: Option<String>,
    /// What became of it, in the words of the API.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) outcome: Option<String>,
    /// The status of the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) status: Option<u16>,
}

impl Record {
    pub(crate) fn new(kind: Kind, caller: &Caller, what: impl Into<String>) -> Self {
        let Caller { name, origin, .. } = caller.clone();
        Self {
            kind,
            caller: name,
            origin,
            what: what.into(),
            body: None,
            id: None,
            outcome: None,
            status: None,
        }
    }
}

impl Record {
    /// What the program itself has done.
    pub(crate) fn of_program(kind: Kind, what: impl Into<String>) -> Self {
        let origin = format!("process {}", std::process::id());
        Self::new(kind, &Caller { name: "drived".to_owned(), origin, rights: Rights::ALL }, what)
    }
}

/// A record as it stands in the file.
#[derive(Serialize)]
struct Line<'a> {
    time_unix_ms: u64,
    #[serde(flatten)]
    record: &'a Record,
    /// The SHA-256 of the line before, without its line end; zeros before the first.
    previous: &'a str,
}

/// The log cannot be written; the reason stands in the program's log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the audit log cannot be written")]
pub(crate) struct NotWritten;

type Waiting = (Record, oneshot::Sender<Result<(), NotWritten>>);

/// The log; a cheap handle. Without a file nothing is kept, and everything counts as written.
#[derive(Debug, Clone, Default)]
pub(crate) struct Audit {
    waiting: Option<SyncSender<Waiting>>,
    failing: Arc<watch::Sender<bool>>,
}

impl Audit {
    /// Opens the log, and goes on with what is there.
    ///
    /// # Errors
    ///
    /// The file cannot be opened for writing, or is none of this program.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let failed =
            |error: std::io::Error| format!("the audit log {} cannot be written: {error}", path.display());
        let file = File::open(path).map_err(failed)?;
        let (waiting, records) = sync_channel(WAITING);
        let failing = Arc::new(watch::Sender::new(false));
        let told = Arc::clone(&failing);
        // A disk may take as long as it likes: no thread of the runtime waits for it.
        std::thread::spawn(move || write_all(file, &records, &told));
        Ok(Self { waiting: Some(waiting), failing })
    }

    /// Whether it cannot be written now.
    pub(crate) fn failing(&self) -> watch::Receiver<bool> {
        self.failing.subscribe()
    }

    /// Hands a record to the disk at once. What it gives need not be waited for.
    pub(crate) fn record(&self, record: Record) -> Written {
        let Some(waiting) = &self.waiting else { return Written(None) };
        let (done, written) = oneshot::channel();
        // A record that finds no room drops its sender: not written.
        if waiting.try_send((record, done)).is_err() && !self.failing.send_replace(true) {
            tracing::error!("the audit log is not written in time: only stops are carried out");
        }
        Written(Some(written))
    }
}

/// A record on its way to the disk.
#[must_use = "a command waits until it is written"]
pub(crate) struct Written(Option<oneshot::Receiver<Result<(), NotWritten>>>);

impl Written {
    /// Waits until the disk has it. Dropped, it is written all the same.
    pub(crate) async fn done(self) -> Result<(), NotWritten> {
        match self.0 {
            None => Ok(()),
            Some(written) => written.await.unwrap_or(Err(NotWritten)),
        }
    }

    /// Leaves it to the disk.
    pub(crate) fn whenever(self) {}
}

/// Writes what becomes of each command at its drive until the fleet ends: also of one whose caller did not wait for it.
pub(super) async fn follow(audit: Audit, mut events: Events) {
    loop {
        let Event { drive, kind, .. } = match events.recv().await {
            Received::Event(event) => event,
            Received::Missed(_) => continue,
            Received::End => return,
        };
        let name = kind.name();
        let (caller, what, outcome) = match kind {
            EventKind::Command { command, setpoint, commander, outcome } => {
                let at = setpoint.map(|setpoint| format!(" at {setpoint}")).unwrap_or_default();
                (commander.to_string(), format!("{drive}: {command}{at}"), outcome.kind().to_owned())
            }
            EventKind::Exit(action) | EventKind::Removed(action) => {
                ("drived".to_owned(), format!("{drive}: {name}"), action.to_string())
            }
            _ => continue,
        };
        let caller = Caller { name: caller, origin: "fleet".to_owned(), rights: Rights::ALL };
        let record = Record { outcome: Some(outcome), ..Record::new(Kind::Outcome, &caller, what) };
        // Where it cannot be written that is told by whoever writes.
        let _ = audit.record(record).done().await;
    }
}

fn write_all(mut file: File, records: &Receiver<Waiting>, failing: &watch::Sender<bool>) {
    for (record, done) in records {
        let written = file.append(&record);
        match &written {
            Ok(()) => {
                if failing.send_replace(false) {
                    tracing::warn!("the audit log is written again");
                }
            }
            Err(error) => {
                if !failing.send_replace(true) {
                    tracing::error!(%error, "the audit log cannot be written: only stops are carried out");
                }
            }
        }
        let _ = done.send(written.map_err(|_| NotWritten));
    }
}

/// Writes one record and waits for the disk, for a program that does nothing else meanwhile.
///
/// # Errors
///
/// The file cannot be written.
pub(crate) fn write_one(path: &Path, record: &Record) -> std::io::Result<()> {
    File::open(path)?.append(record)
}

fn unix_ms() -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    crate::json::milliseconds(now)
}
