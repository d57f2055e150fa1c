//! What the service manager is told: that the daemon is ready, what it does, that it lives, and how long it still needs.
//!
//! The words are those of sd_notify(3). Sending may block for as long as the service manager likes, so that it has a
//! thread of its own. Without `NOTIFY_SOCKET` nothing is told to anybody.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    time::Duration,
};

use drive_bus::Line;
use drive_fleet::{DriveHandle, Fleet, Link, Refused, Snapshot};
use tokio::{
    sync::watch,
    task::AbortHandle,
    time::{MissedTickBehavior, interval, timeout},
};

/// Between two looks at the tasks of lines and drives.
const LOOK: Duration = Duration::from_secs(1);
/// How long the doors may take to listen before the daemon is ready without them: the drives are watched all the same.
const DOORS: Duration = Duration::from_secs(5);
/// How much more time is asked for at each look while motors come down.
const MORE: Duration = Duration::from_secs(10);
/// Messages that wait for the service manager.
const WAITING: usize = 16;
/// How many drives are named in a status.
const NAMED: usize = 5;

/// What the service manager is told.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Word {
    Ready,
    Status(String),
    Alive,
    Reloading,
    Stopping,
    /// So much more time, from now on.
    Extend(Duration),
}

/// Tells the service manager, if there is one. Cheap to clone.
#[derive(Clone)]
pub(super) struct Notify(Option<SyncSender<Vec<Word>>>);

impl Notify {
    /// Begins to tell, if somebody listens.
    pub(super) fn start() -> Self {
        if std::env::var_os("NOTIFY_SOCKET").is_none() {
            return Self(None);
        }
        let (words, waiting) = sync_channel(WAITING);
        std::thread::spawn(move || send_all(&waiting));
        Self(Some(words))
    }

    /// Tells that the daemon is ready as soon as the doors listen and every task has been seen, then what the drives do,
    /// and, as often as is asked for, that every task of a line and of a drive lives.
    pub(super) fn watch(&self, fleet: Fleet, mut listening: watch::Receiver<bool>) -> Watching {
        let notify = self.clone();
        let task = tokio::spawn(async move {
            if notify.0.is_none() {
                return;
            }
            let _ = timeout(DOORS, listening.wait_for(|listening| *listening)).await;
            notify.tell_on(&fleet).await;
        });
        Watching(task.abort_handle())
    }

    /// The configuration is read again.
    pub(super) fn reloading(&self) {
        self.say(vec![Word::Reloading]);
    }

    /// It has been read again.
    pub(super) fn reloaded(&self) {
        self.say(vec![Word::Ready]);
    }

    /// The daemon ends, which may take the ramps of its motors: it asks for more time until what is returned is dropped.
    pub(super) fn stopping(&self, fleet: Fleet) -> Watching {
        self.say(vec![Word::Stopping]);
        let notify = self.clone();
        let task = tokio::spawn(async move {
            if notify.0.is_none() {
                return;
            }
            let mut looks = every(LOOK);
            loop {
                looks.tick().await;
                let waited: Vec<Arc<str>> = fleet
                    .drives()
                    .iter()
                    .filter(|drive| drive.snapshot().stop.is_some())
                    .map(|drive| Arc::clone(drive.name()))
                    .collect();
                let waited = match waited.is_empty() {
                    true => "ending".to_owned(),
                    false => format!("ending, waits for {}", named(&waited)),
                };
                notify.say(vec![Word::Extend(MORE), Word::Status(waited)]);
            }
        });
        Watching(task.abort_handle())
    }

    async fn tell_on(&self, fleet: &Fleet) {
        let mut looks = every(LOOK.min(beat().map_or(LOOK, |beat| beat / 2)));
        let (mut pulse, mut ready, mut told) = (Pulse::default(), false, String::new());
        loop {
            looks.tick().await;
            let mut words = Vec::new();
            if pulse.look(fleet) {
                // Each has been seen since it was said last.
                pulse = Pulse::default();
                if !std::mem::replace(&mut ready, true) {
                    words.push(Word::Ready);
                }
                words.push(Word::Alive);
            }
            let status = status(fleet);
            if status != told {
                words.push(Word::Status(status.clone()));
                told = status;
            }
            if !words.is_empty() {
                self.say(words);
            }
        }
    }

    /// What the thread cannot take is not told: the next words come soon.
    fn say(&self, words: Vec<Word>) {
        if let Some(waiting) = &self.0 {
            let _ = waiting.try_send(words);
        }
    }
}

/// Something is told until this is dropped.
pub(super) struct Watching(AbortHandle);

impl Drop for Watching {
    fn drop(&mut self) {
        self.0.abort();
    }
}

fn every(period: Duration) -> tokio::time::Interval {
    let mut looks = interval(period);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    looks
}

/// Who has been seen alive.
#[derive(Default)]
struct Pulse {
    /// The rounds of each line when it was looked at first.
    lines: BTreeMap<Arc<str>, u64>,
    drives: Arc<Mutex<BTreeMap<Arc<str>, bool>>>,
}

impl Pulse {
    /// Asks those who have not been seen yet. True when everybody has been, whether their ports and drives are there or not.
    fn look(&mut self, fleet: &Fleet) -> bool {
        let (lines, drives) = (fleet.lines(), fleet.drives());
        let lines = lines
            .into_iter()
            .map(|(name, line)| self.line_lives(name, &line))
            .fold(true, |all, one| all & one);
        let drives = drives.iter().map(|drive| self.drive_lives(drive)).fold(true, |all, one| all & one);
        lines && drives
    }

    fn line_lives(&mut self, name: Arc<str>, line: &Line) -> bool {
        let rounds = line.rounds();
        *self.lines.entry(name).or_insert(rounds) != rounds
    }

    /// A drive's task answers a question for which it asks nobody, also while it waits for its drive.
    fn drive_lives(&self, drive: &DriveHandle) -> bool {
        let name = drive.name();
        let mut drives = self.drives.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(&lives) = drives.get(name) {
            return lives;
        }
        drives.insert(Arc::clone(name), false);
        let (seen, drive) = (Arc::clone(&self.drives), drive.clone());
        tokio::spawn(async move {
            let refused = drive.unready().await;
            let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
            match refused {
                // It was not asked: once more at the next look.
                Some(Refused::QueueFull) => drop(seen.remove(drive.name())),
                Some(Refused::Removed | Refused::ShutDown) => {}
                _ => drop(seen.insert(Arc::clone(drive.name()), true)),
            }
        });
        false
    }
}

/// What somebody reads who asks for the state of the service.
fn status(fleet: &Fleet) -> String {
    let drives: Vec<Arc<Snapshot>> = fleet.drives().iter().map(DriveHandle::snapshot).collect();
    let with = |is_so: fn(&Snapshot) -> bool| -> Vec<Arc<str>> {
        drives.iter().filter(|drive| is_so(drive)).map(|drive| Arc::clone(&drive.name)).collect()
    };
    let connected = with(|drive| drive.link == Link::Connected);
    let mut text = format!("{} of {} drives connected", connected.len(), drives.len());
    let lost = with(|drive| drive.link == Link::Lost);
    let tripped = with(|drive| {
        drive.link == Link::Connected && drive.status.as_ref().is_some_and(|status| status.value.is_fault())
    });
    for (what, drives) in [("lost", lost), ("tripped", tripped)] {
        if !drives.is_empty() {
            text = format!("{text}; {what}: {}", named(&drives));
        }
    }
    text
}

fn named(drives: &[Arc<str>]) -> String {
    let names: Vec<String> =
        drives.iter().take(NAMED).map(|name| drived_words::logging::escaped(name)).collect();
    match drives.len().saturating_sub(NAMED) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names.join(", ")),
    }
}

#[cfg(not(unix))]
fn send_all(waiting: &Receiver<Vec<Word>>) {
    for _ in waiting {}
}

/// Sends until nobody tells any more. What the service manager does not take is lost: it asks for its own reasons.
#[cfg(unix)]
fn send_all(waiting: &Receiver<Vec<Word>>) {
    use sd_notify::NotifyState;
    for words in waiting {
        let mut states = Vec::new();
        for word in &words {
            match word {
                Word::Ready => states.push(NotifyState::Ready),
                Word::Status(text) => states.push(NotifyState::Status(text)),
                Word::Alive => states.push(NotifyState::Watchdog),
                Word::Stopping => states.push(NotifyState::Stopping),
                Word::Reloading => {
                    states.push(NotifyState::Reloading);
                    // In the same message: without it systemd of 253 and newer takes the reload for failed.
                    states.extend(NotifyState::monotonic_usec_now());
                }
                Word::Extend(time) => {
                    let micros = u32::try_from(time.as_micros()).unwrap_or(u32::MAX);
                    states.push(NotifyState::ExtendTimeoutUsec(micros));
                }
            }
        }
        let _ = sd_notify::notify(&states);
    }
}

/// How often the service manager wants to be told that the daemon lives, halved.
fn beat() -> Option<Duration> {
    let micros: u64 = std::env::var("WATCHDOG_USEC").ok()?.parse().ok()?;
    let beat = Duration::from_micros(micros) / 2;
    (!beat.is_zero()).then_some(beat)
}

#[cfg(test)]
mod tests {
    use drive_bus::LineConfig;
    use drive_core::{SerialSettings, SlaveAddress};
    use drive_families::{Family, Options};
    use drive_fleet::DriveSettings;

    use super::*;

    /// A line without a port, and two drives on it that nobody can reach.
    fn nowhere() -> (Fleet, Line) {
        let config = LineConfig::stream(SerialSettings::MODBUS_DEFAULT);
        let gone = || async { Err::<tokio::io::DuplexStream, _>(std::io::Error::other("no such port")) };
        let line = Line::over_reopened(gone, config);
        let drive = |port: drive_bus::Slave, slave: SlaveAddress| {
            Family::ATV312.open_with(port, slave, &Options::default())
        };
        let builder = Fleet::builder().line("north", line.clone());
        let builder = builder.drive("north", 1, DriveSettings::watched("pump 1"), drive);
        let builder = builder.drive("north", 2, DriveSettings::watched("pump 2"), drive);
        (builder.start().unwrap(), line)
    }

    /// Whether everybody is seen within some looks.
    async fn lives(pulse: &mut Pulse, fleet: &Fleet) -> bool {
        for _ in 0..5 {
            if pulse.look(fleet) {
                return true;
            }
            tokio::time::sleep(LOOK).await;
        }
        false
    }

    #[tokio::test(start_paused = true)]
    async fn tasks_live_whether_their_port_and_drives_are_there_or_not() {
        let (fleet, _line) = nowhere();
        for _ in 0..3 {
            assert!(lives(&mut Pulse::default(), &fleet).await);
            tokio::time::sleep(Duration::from_secs(60)).await;
        }
        assert_eq!(status(&fleet), "0 of 2 drives connected; lost: pump 1, pump 2");
    }

    #[tokio::test(start_paused = true)]
    async fn a_line_whose_task_has_ended_is_not_taken_for_alive() {
        let (fleet, line) = nowhere();
        assert!(lives(&mut Pulse::default(), &fleet).await);
        line.close().await;
        assert!(!lives(&mut Pulse::default(), &fleet).await);
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_whose_task_has_ended_is_not_taken_for_alive() {
        let (fleet, _line) = nowhere();
        let _ = fleet.shutdown(Duration::from_secs(1)).await;
        assert!(!lives(&mut Pulse::default(), &fleet).await);
    }
}
