//! The audit log: who asked for what, from where, and what was answered. One JSON object a line, each with its number, the SHA-256
//! of the line before and a seal by a key, so that a line that was changed, added or taken out is found, at the end too.
//!
//! What somebody may not do stands in a file of its own, so that nobody pushes out what was done. What could not be written is
//! kept, and written as a gap as soon as it can be.

mod file;
mod gap;
mod said;
mod seal;
mod show;
mod verify;

use std::{
    path::Path,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel},
    },
    time::{Duration, SystemTime},
};

use drive_fleet::{Event, EventKind, Events, Received};
use serde::Serialize;
use tokio::sync::{oneshot, watch};

pub use self::verify::verify;
use self::{file::File, gap::Gap, said::masked};
pub use self::{
    said::bounded,
    show::{Filter, Found, shown},
    verify::{Verdict, verify_since},
};
use drived_config::{
    kept::Kept,
    names::{self, Names},
    rights::{Caller, Rights},
};

/// Records that wait for the disk.
const WAITING: usize = 256;
/// Of these, outcomes that nobody waits for.
const OUTCOMES_AHEAD: usize = WAITING / 4;
/// From one try to write a gap to the next.
const TRIED_AGAIN: Duration = Duration::from_secs(1);
/// How often the newest line is told in the program's log, where it is out of reach of who has the file.
const HEAD_TOLD_EVERY: Duration = Duration::from_secs(3_600);
/// What stands behind the name of the log in that of the file of what was refused.
const REFUSED: &str = ".refused";

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
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
    /// Somebody has asked for what he may not do.
    Refused,
    /// What is missing before this line, and why.
    Gap,
}

/// One line of the log, without time and chain.
#[derive(Debug, Clone, Serialize)]
pub struct Record {
    pub kind: Kind,
    pub caller: String,
    pub origin: String,
    /// In words, or method and path of a request.
    pub what: String,
    /// The id of the drive that it is about, where it is one: it keeps that whatever it is called.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    /// What the request said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<serde_json::Value>,
    /// The command's id.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// What became of it, in the words of the API.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outcome: Option<String>,
    /// The status of the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub status: Option<u16>,
}

impl Record {
    pub fn new(kind: Kind, caller: &Caller, what: impl Into<String>) -> Self {
        let Caller { name, origin, .. } = caller.clone();
        Self {
            kind,
            caller: name,
            origin,
            what: masked(&what.into()),
            drive: None,
            body: None,
            id: None,
            outcome: None,
            status: None,
        }
    }
}

impl Record {
    /// What the program itself has done.
    pub fn of_program(kind: Kind, what: impl Into<String>) -> Self {
        let origin = format!("process {}", std::process::id());
        Self::new(kind, &Caller::new("drived", origin, Rights::ALL), what)
    }
}

/// A record as it stands in the file, without its seal.
#[derive(Serialize)]
struct Line<'a> {
    number: u64,
    time_unix_ms: u64,
    #[serde(flatten)]
    record: &'a Record,
    /// The SHA-256 of the line before, without its line end; zeros before the first.
    previous: &'a str,
}

/// The log cannot be written; the reason stands in the program's log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the audit log cannot be written")]
pub struct NotWritten;

type Waiting = (Record, oneshot::Sender<Result<(), NotWritten>>);

/// The log; a cheap handle. Without a file nothing is kept, and everything counts as written.
#[derive(Debug, Clone, Default)]
pub struct Audit {
    waiting: Option<SyncSender<Waiting>>,
    /// What somebody may not do.
    refused: Option<SyncSender<Record>>,
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    failing: watch::Sender<bool>,
    /// The number of the newest line and its SHA-256.
    head: watch::Sender<Option<String>>,
    /// What could not be written.
    gap: Mutex<Gap>,
}

impl Shared {
    fn gap(&self) -> MutexGuard<'_, Gap> {
        self.gap.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps what could not be written, and tells it.
    fn lose(&self, record: &Record, why: &dyn std::fmt::Display) {
        if self.gap().add(record, unix_ms()) {
            let Record { caller, origin, what, .. } = record;
            tracing::error!("not in the audit log yet: {what}, by {caller} ({origin})");
        }
        if !self.failing.send_replace(true) {
            tracing::error!("the audit log cannot be written: {why}: only stops are carried out");
        }
    }
}

impl Audit {
    /// Opens the log, and goes on with what is there.
    ///
    /// # Errors
    ///
    /// The file cannot be opened for writing, or is none of this program.
    pub fn open(path: &Path) -> Result<Self, String> {
        let failed =
            |error: std::io::Error| format!("the audit log {} cannot be written: {error}", path.display());
        let mut file = File::open(path).map_err(failed)?;
        let aside = File::open_refused(Kept::at(path).beside(REFUSED).path()).map_err(failed)?;
        let (waiting, records) = sync_channel(WAITING);
        let (refused, refusals) = sync_channel(WAITING);
        let shared = Arc::<Shared>::default();
        let of_writer = Arc::clone(&shared);
        // A disk may take as long as it likes: no thread of the runtime waits for it.
        std::thread::spawn(move || write_all(&mut file, &records, &of_writer));
        std::thread::spawn(move || write_refused(aside, &refusals));
        Ok(Self { waiting: Some(waiting), refused: Some(refused), shared })
    }

    /// Whether it cannot be written now.
    pub fn failing(&self) -> watch::Receiver<bool> {
        self.shared.failing.subscribe()
    }

    /// The newest line, by its number and its SHA-256, for who keeps it where nobody reaches who has the file; `None` before the first.
    pub fn head(&self) -> watch::Receiver<Option<String>> {
        self.shared.head.subscribe()
    }

    /// Hands a record to the disk at once. What it gives need not be waited for.
    pub fn record(&self, record: Record) -> Written {
        let Some(waiting) = &self.waiting else { return Written(None) };
        let (done, written) = oneshot::channel();
        // A record that finds no room drops its sender: not written.
        if let Err(error) = waiting.try_send((record, done)) {
            let (TrySendError::Full((record, _)) | TrySendError::Disconnected((record, _))) = error;
            self.shared.lose(&record, &"the disk does not take it in time");
        }
        Written(Some(written))
    }

    /// Hands on what somebody may not do. Of a flood, what finds no room is not written.
    pub fn record_refused(&self, record: Record) {
        if let Some(refused) = &self.refused {
            let _ = refused.try_send(record);
        }
    }
}

/// A record on its way to the disk.
#[must_use = "a command waits until it is written"]
pub struct Written(Option<oneshot::Receiver<Result<(), NotWritten>>>);

impl Written {
    /// Waits until the disk has it. Dropped, it is written all the same.
    pub async fn done(self) -> Result<(), NotWritten> {
        match self.0 {
            None => Ok(()),
            Some(written) => written.await.unwrap_or(Err(NotWritten)),
        }
    }

    /// Leaves it to the disk.
    pub fn whenever(self) {}
}

/// Writes what becomes of each command at its drive until the fleet ends: also of one whose caller did not wait for it.
pub(super) async fn follow(audit: Audit, names: Names, mut events: Events) {
    let mut ahead = 0;
    loop {
        let Event { drive, kind, .. } = match events.recv().await {
            Received::Event(event) => event,
            Received::Missed(events) => {
                let what = format!(
                    "{events} events of drives came too fast: what became of some commands is missing"
                );
                audit.record(Record::of_program(Kind::Gap, what)).whenever();
                continue;
            }
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
        let caller = Caller::new(caller, "fleet", Rights::ALL);
        let id = Some(names.known_as(names::Kind::Drive, &drive).id);
        let record =
            Record { drive: id, outcome: Some(outcome), ..Record::new(Kind::Outcome, &caller, what) };
        let written = audit.record(record);
        // So many are handed on before the disk is waited for: they are written in their order.
        ahead = (ahead + 1) % OUTCOMES_AHEAD;
        match ahead {
            // Where it cannot be written that is told by whoever writes.
            0 => drop(written.done().await),
            _ => written.whenever(),
        }
    }
}

fn write_all(file: &mut File, records: &Receiver<Waiting>, shared: &Shared) {
    let mut told: Option<(String, SystemTime)> = None;
    loop {
        let has_gap = !shared.gap().is_empty();
        let next = match has_gap {
            true => records.recv_timeout(TRIED_AGAIN),
            false => records.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        // What is missing stands before what comes after it.
        let closed = close_gap(file, shared);
        let next = match next {
            Ok(waiting) => waiting,
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) => return,
        };
        // The disk is waited for once for all that wait by now: each command waits for it before it moves anything.
        let together: Vec<Waiting> = std::iter::once(next).chain(records.try_iter().take(WAITING)).collect();
        let written = closed.and_then(|()| file.append_all(together.iter().map(|(record, _)| record)));
        if let Err(error) = &written {
            together.iter().for_each(|(record, _)| shared.lose(record, error));
        }
        let head = file.head();
        shared.head.send_replace(Some(head.clone()).filter(|head| !head.is_empty()));
        let is_of_daemon = together.iter().any(|(record, _)| record.kind == Kind::Daemon);
        for (_, done) in together {
            let _ = done.send(written.as_ref().map_err(|_| NotWritten).copied());
        }
        let is_due = |at: &SystemTime| at.elapsed().is_ok_and(|age| age >= HEAD_TOLD_EVERY);
        if is_of_daemon || told.as_ref().is_none_or(|(_, at)| is_due(at)) {
            if told.as_ref().is_none_or(|(last, _)| *last != head) {
                tracing::info!("the audit log ends with {head}: drived audit verify --since {head}");
            }
            told = Some((head, SystemTime::now()));
        }
    }
}

/// Writes what is missing, if anything is.
fn close_gap(file: &mut File, shared: &Shared) -> std::io::Result<()> {
    let Some((record, many)) = shared.gap().record(unix_ms()) else { return Ok(()) };
    if drive_fleet::mutant!("audit-is-never-written-again", false, true) {
        return Err(std::io::ErrorKind::StorageFull.into());
    }
    if drive_fleet::mutant!("gap-untold", true, false) {
        file.append(&record)?;
    }
    // What was lost while this was written is the next gap.
    shared.gap().forget(many);
    if shared.gap().is_empty() && shared.failing.send_replace(false) {
        tracing::warn!("the audit log is written again");
    }
    Ok(())
}

fn write_refused(mut file: File, records: &Receiver<Record>) {
    let mut is_failing = false;
    for record in records {
        let written = file.append(&record);
        if let (Err(error), false) = (&written, is_failing) {
            tracing::warn!("what was refused is not written: {error}");
        }
        is_failing = written.is_err();
    }
}

/// Writes one record and waits for the disk, for a program that does nothing else meanwhile.
///
/// # Errors
///
/// The file cannot be written.
pub fn write_one(path: &Path, record: &Record) -> std::io::Result<()> {
    File::open(path)?.append(record)
}

fn unix_ms() -> u64 {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    drived_words::json::milliseconds(now)
}

#[cfg(test)]
mod tests {
    use drived_config::testing::Folder;

    use super::*;

    #[test]
    fn records_that_wait_at_once_wait_for_the_disk_once() {
        let folder = Folder::new("at-once");
        let path = folder.file("audit");
        let mut file = File::open(&path).unwrap();
        let (waiting, records) = sync_channel(WAITING);
        let written: Vec<_> = (0..100)
            .map(|number| {
                let (done, written) = oneshot::channel();
                let record = Record::of_program(Kind::Command, format!("command {number}"));
                waiting.try_send((record, done)).unwrap();
                written
            })
            .collect();
        drop(waiting);
        write_all(&mut file, &records, &Shared::default());
        assert_eq!(file.waits, 1);
        assert!(written.into_iter().all(|written| written.blocking_recv() == Ok(Ok(()))));
        assert!(matches!(verify(&path).unwrap(), Verdict::Unbroken { records: 100, .. }));
    }
}
