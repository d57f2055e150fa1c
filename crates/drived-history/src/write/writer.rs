//! The one thread that writes. Whatever the disk does, nobody waits for it.

use std::{
    path::{Path, PathBuf},
    thread::JoinHandle,
    time::{Duration, Instant},
};

use tokio::sync::watch;

use super::{
    Limits,
    archive::{Archive, End, FLUSHED_EVERY_MS},
    frames,
    inbox::Inbox,
    tidy,
};
use crate::{
    record::{Moment, Record},
    store::{self, Store, StoreError},
};

/// Between two looks at what has come. A record is written at once, and no second one within this time.
const LOOK: Duration = Duration::from_millis(500);
/// Before a file that cannot be written is tried again.
const TRIED_AGAIN: Duration = Duration::from_secs(2);
/// Values that somebody asks for are not written more often than this.
const ASKED_EVERY_MS: i64 = 2_000;
/// For so long at a time the file is tidied before anything else is looked at.
const TIDIED: Duration = Duration::from_millis(200);

/// Whether it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Health {
    /// It has not been opened yet.
    Opening,
    /// It is.
    Writing,
    /// It is not: why.
    Failing(String),
}

/// What a writer is given.
pub struct Writer<C> {
    pub path: PathBuf,
    pub limits: Limits,
    pub inbox: Inbox,
    /// Both clocks.
    pub clock: C,
    pub health: watch::Sender<Health>,
    /// This program has kept a history before: a reload opens it anew.
    pub is_anew: bool,
}

impl<C: Fn() -> Moment + Send + 'static> Writer<C> {
    /// Begins to write, until the inbox ends.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(self) -> std::io::Result<JoinHandle<()>> {
        std::thread::Builder::new().name("history".to_owned()).spawn(move || Work::new(self).run())
    }
}

struct Work<C> {
    writer: Writer<C>,
    archive: Archive,
    store: Option<Store>,
    tried: Option<Instant>,
    /// It is not tried again before somebody does something about the file.
    is_given_up: bool,
    has_to_tidy: bool,
    /// Which file somebody who read it has found damaged, and by what.
    damaged: Option<(u64, String)>,
    /// How often somebody had asked for what waits when that was written last, and when.
    asked: u64,
    asked_at: i64,
}

impl<C: Fn() -> Moment> Work<C> {
    fn new(writer: Writer<C>) -> Self {
        let mut archive = Archive::begin((writer.clock)());
        archive.is_anew = writer.is_anew;
        Self {
            writer,
            archive,
            store: None,
            tried: None,
            is_given_up: false,
            has_to_tidy: true,
            damaged: None,
            asked: 0,
            asked_at: i64::MIN / 2,
        }
    }

    fn run(mut self) {
        loop {
            let began = Instant::now();
            let mut batch = self.writer.inbox.take(LOOK);
            self.damaged = batch.damaged.take().or_else(|| self.damaged.take());
            let (now, asked) = ((self.writer.clock)(), batch.asked);
            let (is_end, goes_on) = (batch.is_end, batch.goes_on);
            self.archive.take(batch, now);
            self.archive.look_at_clock(now);
            let is_asked = asked != self.asked && now.steady_ms - self.asked_at >= ASKED_EVERY_MS;
            if is_end || is_asked || self.archive.is_due(now) {
                self.archive.close(now);
                self.has_to_tidy = true;
                self.asked_at = now.steady_ms;
            }
            let may_try = self.tried.is_none_or(|tried| tried.elapsed() >= TRIED_AGAIN) || is_end;
            if may_try && !self.is_given_up {
                let end = is_end.then_some(if goes_on { End::Closed } else { End::Ended });
                let worked = self.work(now, end);
                if worked.is_ok() {
                    self.writer.inbox.has_written_until(self.archive.flushed_at());
                }
                self.tell(worked);
            }
            if asked != self.asked {
                self.asked = asked;
                self.writer.inbox.written(asked);
            }
            if is_end {
                return;
            }
            // Records that come one by one are written together.
            self.writer.inbox.gather(LOOK.saturating_sub(began.elapsed()));
        }
    }

    fn work(&mut self, now: Moment, end: Option<End>) -> Result<(), StoreError> {
        let mut store = match self.store.take() {
            Some(store) => store,
            None => self.open(now)?,
        };
        // What stands where nothing is written is found by whoever reads. The last words are written all the same.
        if let Some((file, why)) = self.damaged.take()
            && file == self.writer.inbox.file()
            && end.is_none()
        {
            drop(store);
            return Err(self.put_aside(&why, now));
        }
        let connection = &mut store.connection;
        let written = (|| {
            if self.archive.has_records() {
                self.archive.write_records(connection, now)?;
            }
            self.archive.write_values(connection)?;
            if let Some(end) = end {
                return self.archive.end_run_by(end, connection, now);
            }
            let began = Instant::now();
            while self.has_to_tidy && began.elapsed() < TIDIED {
                // What was seen by then has been flushed.
                let known_until = now.steady_ms.saturating_sub(FLUSHED_EVERY_MS);
                self.has_to_tidy =
                    frames::fill(connection, self.archive.run().unwrap_or_default(), known_until)?
                        || tidy::compact(connection, now.wall_ms)?
                        || tidy::trim(connection, self.archive.lived(now), &self.writer.limits)?;
            }
            Ok(())
        })();
        if let Err(error) = &written
            && error.is_damage()
        {
            drop(store);
            return Err(self.put_aside(&error.to_string(), now));
        }
        self.store = Some(store);
        written
    }

    fn open(&mut self, now: Moment) -> Result<Store, StoreError> {
        let mut opened = store::open(&self.writer.path)?;
        if let Some((aside, why)) = opened.aside.take() {
            drop(opened);
            return Err(self.is_aside(&aside, &why, now));
        }
        let begun = self
            .archive
            .begin_run(&mut opened.store.connection, concat!("drived ", env!("CARGO_PKG_VERSION")));
        match begun {
            Ok(()) => Ok(opened.store),
            // Its head was sound, and what lies behind it is not.
            Err(error) if error.is_damage() => {
                drop(opened);
                Err(self.put_aside(&error.to_string(), now))
            }
            Err(error) => Err(error),
        }
    }

    /// Puts the file aside, which is closed. It is an alarm until the next one is written.
    fn put_aside(&mut self, why: &str, now: Moment) -> StoreError {
        match store::put_aside(&self.writer.path) {
            Ok(aside) => self.is_aside(&aside, why, now),
            Err(error) => error,
        }
    }

    /// It is aside: what comes belongs to another one.
    fn is_aside(&mut self, aside: &Path, why: &str, now: Moment) -> StoreError {
        self.writer.inbox.has_put_aside();
        self.tell_aside(aside, why, now);
        self.archive.begin_file(now);
        StoreError::Damaged(why.to_owned())
    }

    fn tell_aside(&mut self, aside: &Path, why: &str, now: Moment) {
        let text = format!(
            "the history was damaged ({why}): it is in {} now, and a new one was begun",
            aside.display()
        );
        tracing::error!("{text}");
        self.archive.record(Record { is_alarm: true, ..Record::of_history(now, "damaged", text) });
    }

    /// Says whether it is written, once each time that changes.
    fn tell(&mut self, worked: Result<(), StoreError>) {
        let health = match worked {
            Ok(()) => {
                self.tried = None;
                Health::Writing
            }
            Err(error) => {
                self.tried = Some(Instant::now());
                self.is_given_up = drive_fleet::mutant!("full-disk-ends-the-past", error.is_lasting(), true);
                // What is begun anew is tried at once.
                if matches!(error, StoreError::Damaged(_)) {
                    self.tried = None;
                }
                Health::Failing(error.to_string())
            }
        };
        let is_other = |known: &Health| std::mem::discriminant(known) != std::mem::discriminant(&health);
        if is_other(&self.writer.health.borrow()) {
            match &health {
                Health::Failing(why) => tracing::error!("the history cannot be written: {why}"),
                Health::Writing => tracing::info!("the history is written to {}", self.writer.path.display()),
                Health::Opening => {}
            }
            self.writer.health.send_replace(health);
        }
    }
}
