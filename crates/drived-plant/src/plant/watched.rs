//! Whoever has started a motor and has to be heard as long as it runs: kept as long as the program, whatever becomes of the face by which
//! he came and of the drive's name, and in the state folder beyond it.

use std::{
    collections::BTreeMap,
    net::{IpAddr, SocketAddr},
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_core::{Status, StopMode};
use drive_fleet::{DriveHandle, Place};
use serde::{Deserialize, Serialize};
use tokio::{
    sync::watch,
    task::{JoinHandle, spawn_blocking},
    time::{Instant, interval, timeout},
};

use super::{
    Plant,
    commands::{Action, LONGEST_LIFETIME, Lifetime, Request, Target},
    revisions::Subject,
};
use drived_config::{
    places::Places,
    records::{Record, Records, in_folder},
    rights::{Caller, Role},
};
use drived_words::json::unix;

/// The file of the state folder.
const FILE: &str = "watched.json";
/// How long a start waits at the most until it is kept who has to be heard: a disk that hangs holds up no pump for ever.
const KEPT_WITHIN: Duration = Duration::from_millis(400);
/// A start waits no longer than a client has patience, a minute at the most: a motor that stands then was not started.
const STARTED_WITHIN: Duration = Duration::from_secs(61);
/// Within what a start shows that was given to a motor that runs.
const START_SHOWS: Duration = Duration::from_secs(8);
/// How often it is looked who is silent.
const LOOKED: Duration = Duration::from_millis(500);

/// A door by which clients come that have to be heard, as it is configured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WatchedDoor<'a> {
    pub name: &'a str,
    pub listen: SocketAddr,
    /// How long a client may be silent; `None`: for ever.
    pub limit: Option<Duration>,
    /// Whether the motor is stopped then.
    pub stops: bool,
}

/// Who has started a motor, and what becomes of it when he is silent.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Starter {
    door: String,
    listen: SocketAddr,
    client: IpAddr,
    limit_ms: u64,
    stops: bool,
}

impl Record for Starter {
    const LOSS: &'static str = "no motor is stopped for the silence of who has started it before now";

    fn alone(&self) -> &'static str {
        "it is not stopped for the silence of who has started it"
    }
}

impl Starter {
    const fn limit(&self) -> Duration {
        Duration::from_millis(self.limit_ms)
    }
}

/// The watch over who has started a drive.
#[derive(Debug, Clone)]
pub struct Watch {
    /// What the drive is called.
    drive: String,
    starter: Starter,
    /// Since when he is watched by this program.
    began: Instant,
    heard: Instant,
    /// His silence was told.
    is_told: bool,
    /// His run was to be stopped since: whoever starts the motor behind that starts another one.
    is_stopped: bool,
}

impl Watch {
    fn begin(drive: &str, starter: Starter) -> Self {
        let now = Instant::now();
        Self { drive: drive.to_owned(), starter, began: now, heard: now, is_told: false, is_stopped: false }
    }
}

/// Somebody who has been silent for too long.
struct Silent {
    drive: DriveHandle,
    starter: Starter,
}

/// Who has to be heard, by the place of the drive that he has started last: a motor turns on whatever it is called.
#[derive(Debug)]
pub struct Watched {
    kept: Option<Records<Starter>>,
    drives: Mutex<BTreeMap<Place, Watch>>,
    /// How often that has changed which is kept, and up to which change it is in the file.
    changed: watch::Sender<u64>,
    written: watch::Sender<u64>,
}

impl Default for Watched {
    fn default() -> Self {
        Self {
            kept: None,
            drives: Mutex::default(),
            changed: watch::Sender::new(0),
            written: watch::Sender::new(0),
        }
    }
}

impl Watched {
    /// Those of this state folder whose runs were not ended; without one they live as long as the program. They count as silent from
    /// now on, until they are heard.
    pub fn in_folder(folder: Option<&Path>, places: &Places, runs: impl Fn(&Place) -> bool) -> Self {
        let Some(file) = in_folder(folder, FILE) else { return Self::default() };
        let kept = Records::<Starter>::open(Some(&file), places);
        let all = kept.all().into_iter().filter(|(place, ..)| runs(place));
        let drives = all.map(|(place, drive, starter)| (place, Watch::begin(&drive, starter))).collect();
        Self { kept: Some(kept), drives: Mutex::new(drives), ..Self::default() }
    }

    /// These are the doors from now on. Who came by one of them, by its address or by its name, is watched as it says, and has its whole
    /// time to come again: the door was closed. Who came by one that is gone can not be heard any more.
    pub fn set_doors(&self, doors: &[WatchedDoor<'_>]) {
        let now = Instant::now();
        let mut drives = self.lock();
        drives.retain(|_, watch| {
            let Watch { starter, heard, .. } = watch;
            let by_address = doors.iter().find(|door| door.listen == starter.listen);
            let Some(door) = by_address.or_else(|| doors.iter().find(|door| door.name == starter.door))
            else {
                return true;
            };
            let Some(limit) = door.limit else { return false };
            *heard = now;
            (starter.door, starter.listen) = (door.name.to_owned(), door.listen);
            (starter.limit_ms, starter.stops) = (milliseconds(limit), door.stops);
            true
        });
        self.change();
    }

    /// A client has asked for something at a door.
    pub fn hear(&self, door: &str, client: IpAddr, now: Instant) {
        for watch in self.lock().values_mut() {
            if watch.starter.client == client && watch.starter.door == door {
                (watch.heard, watch.is_told) = (now, false);
            }
        }
    }

    /// A client is about to start a drive by a door. It is kept when this ends, or cannot be soon.
    pub async fn start(&self, door: WatchedDoor<'_>, client: IpAddr, drive: &DriveHandle) {
        let starter = door.limit.map(|limit| Starter {
            door: door.name.to_owned(),
            listen: door.listen,
            client,
            limit_ms: milliseconds(limit),
            stops: door.stops,
        });
        let (mut is_kept, change) = {
            let mut drives = self.lock();
            let before = match starter.clone() {
                Some(starter) => drives.insert(drive.place().clone(), Watch::begin(drive.name(), starter)),
                // Whoever starts it now needs not be heard.
                None => drives.remove(drive.place()),
            };
            if before.map(|before| before.starter) == starter {
                return;
            }
            (self.written.subscribe(), self.change())
        };
        if self.kept.is_some() {
            // A file that is not written holds up nothing.
            let _ = timeout(KEPT_WITHIN, is_kept.wait_for(|written| *written >= change)).await;
        }
    }

    /// These drives are to be stopped by somebody.
    pub(super) fn stop(&self, drives: &[DriveHandle]) {
        let mut watched = self.lock();
        // Nearly always nobody is watched, and a stop of all is for thousands.
        if watched.is_empty() {
            return;
        }
        for drive in drives {
            if let Some(watch) = watched.get_mut(drive.place()) {
                watch.is_stopped = true;
            }
        }
    }

    /// A drive is to be started by somebody. Who started it before a stop is not the one who has to be heard. Of a motor that runs it is not
    /// judged who is silent before that start has shown: it would end the run that somebody is about to have.
    pub(super) fn start_anew(&self, drive: &Place, commander: &str) {
        let mut drives = self.lock();
        let Some(watch) = drives.get_mut(drive) else { return };
        if watch.is_stopped {
            drives.remove(drive);
            self.change();
        } else if watch.starter.door != commander {
            watch.heard = watch.heard.max(Instant::now() + START_SHOWS);
        }
    }

    /// A start was confirmed. Whoever came by another door is not the one who has to be heard, and nobody else's silence is anything to
    /// his run.
    pub(super) fn started_by(&self, drive: &Place, commander: &str) {
        let mut drives = self.lock();
        if drives.get(drive).is_some_and(|watch| watch.starter.door != commander) {
            drives.remove(drive);
            self.change();
        }
    }

    /// The drive at a place is called otherwise.
    pub(super) fn call(&self, place: &Place, drive: &str) {
        if let Some(watch) = self.lock().get_mut(place) {
            drive.clone_into(&mut watch.drive);
            self.change();
        }
    }

    /// A drive has left the fleet: the watch over who has started it, for when it comes again.
    pub fn take(&self, drive: &Place) -> Option<Watch> {
        let watch = self.lock().remove(drive);
        if watch.is_some() {
            self.change();
        }
        watch
    }

    /// A drive comes again whose motor was left turning.
    pub fn put(&self, place: &Place, drive: &str, watch: Watch) {
        self.lock().insert(place.clone(), Watch { drive: drive.to_owned(), began: Instant::now(), ..watch });
        self.change();
    }

    /// A drive comes whose motor an earlier run has left turning: whoever had to be heard then has to be heard now.
    pub fn put_kept(&self, place: &Place, drive: &str) {
        let Some(kept) = &self.kept else { return };
        kept.call(place, drive);
        if let Some(starter) = kept.of(place) {
            self.put(place, drive, Watch::begin(drive, starter));
        }
    }

    /// Who is silent and has not been told yet. Who has started nothing that still runs is forgotten.
    fn look(&self, now: Instant, find: impl Fn(&Place) -> Option<DriveHandle>) -> Vec<Silent> {
        let (mut silent, mut is_less) = (Vec::new(), false);
        self.lock().retain(|drive, watch| {
            // It is about to come again.
            let Some(drive) = find(drive) else { return true };
            let snapshot = drive.snapshot();
            if !snapshot.started_here() {
                // A run of before is ours only once the drive has said so.
                let stands = snapshot.fresh_status(now).is_some_and(Status::is_undriven);
                let began = now.saturating_duration_since(watch.began);
                let is_over = stands && (watch.is_told || began >= STARTED_WITHIN);
                is_less |= is_over;
                return !is_over;
            }
            if !watch.is_told && now.saturating_duration_since(watch.heard) >= watch.starter.limit() {
                silent.push(Silent { drive, starter: watch.starter.clone() });
            }
            true
        });
        if is_less {
            self.change();
        }
        silent
    }

    /// What follows from a silence is done.
    fn tell(&self, drive: &Place) {
        if let Some(watch) = self.lock().get_mut(drive) {
            watch.is_told = true;
        }
    }

    fn change(&self) -> u64 {
        self.changed.send_modify(|changes| *changes += 1);
        *self.changed.borrow()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Place, Watch>> {
        self.drives.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn milliseconds(limit: Duration) -> u64 {
    u64::try_from(limit.as_millis()).unwrap_or(u64::MAX)
}

impl Plant {
    /// Who has to be heard.
    pub fn watched(&self) -> &Watched {
        &self.0.watched
    }

    /// Keeps who has to be heard in the state folder, until the plant or the runtime is gone.
    pub fn keep_watched(&self) -> JoinHandle<()> {
        let plant = Arc::downgrade(&self.0);
        let mut changed = self.0.watched.changed.subscribe();
        // What was left out of the file's is left out there, too.
        changed.mark_changed();
        tokio::spawn(async move {
            while changed.changed().await.is_ok() {
                let Some(inner) = plant.upgrade() else { return };
                let Some(kept) = inner.watched.kept.clone() else { return };
                let change = {
                    let drives = inner.watched.lock();
                    let starter = |(place, watch): (&Place, &Watch)| {
                        (place.clone(), watch.drive.clone(), watch.starter.clone())
                    };
                    kept.set_all(drives.iter().map(starter));
                    *changed.borrow_and_update()
                };
                drop(inner);
                let Ok(is_written) = spawn_blocking(move || kept.write()).await else { return };
                let Some(inner) = plant.upgrade() else { return };
                if is_written {
                    inner.watched.written.send_replace(change);
                }
            }
        })
    }

    /// Looks after those who have started a motor and are silent, for ever. A stop is recorded as it is given.
    pub async fn follow_watched(self, record: impl Fn(&Caller, String) + Send) {
        let mut looks = interval(LOOKED);
        loop {
            looks.tick().await;
            let (now, fleet) = (Instant::now(), self.fleet());
            for Silent { drive, starter } in self.0.watched.look(now, |place| fleet.drive_at(place)) {
                let Starter { door, client, .. } = &starter;
                let name = drive.name();
                let text = format!("{client} started it and has been silent for {:?}", starter.limit());
                tracing::warn!("gateway {door}: {name}: {text}");
                let event = serde_json::json!({
                    "time_unix_ms": unix(now),
                    "drive": name,
                    "event": "client_silent",
                    "alarm": true,
                    "text": text,
                });
                self.revisions().push(Subject::Event, &event);
                if !starter.stops {
                    self.0.watched.tell(drive.place());
                    continue;
                }
                // Nobody has asked for it: it is this program's policy.
                let who = format!("this program, by on_client_silence of {door}");
                let caller = Caller::new(who, format!("modbus {client}"), Role::Stop.rights());
                let action = Action::Stop(StopMode::Ramp.into());
                record(&caller, format!("{name}: {}", action.text()));
                let target = Target::Drive(name.to_string());
                let request = Request {
                    id: None,
                    target,
                    action,
                    expects: None,
                    lifetime: Lifetime::Usual(LONGEST_LIFETIME),
                    arrived: now,
                };
                // Nobody waits for it: the fleet repeats it until it is confirmed.
                match self.begin(&caller, request) {
                    Ok(_) => self.0.watched.tell(drive.place()),
                    Err(rejected) => tracing::warn!("{name}: the stop is given again: {rejected}"),
                }
            }
        }
    }
}
#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::plant::{alarms::KeptAlarms, quick_stops::QuickStops, testing::TestPlant};
    use drived_config::testing::Folder;

    #[tokio::test(start_paused = true)]
    async fn who_is_watched_is_kept_before_a_start_and_known_after_a_kill_where_the_run_was_not_ended() {
        let (folder, test) = (Folder::new("watched"), TestPlant::of(1).await);
        let place = folder.file("");
        let pump = test.plant.fleet().drive("pump 1").unwrap();
        let there: Places = [("pump 1".to_owned(), pump.place().clone())].into_iter().collect();
        let open = |runs: bool| Watched::in_folder(Some(&place), &there, move |_| runs);
        let known = |watched: &Watched| watched.lock().keys().map(Place::to_string).collect::<Vec<_>>();
        let kept = KeptAlarms::default();
        let plant = Plant::start_with(
            test.plant.fleet(),
            Vec::new(),
            false,
            &kept,
            (open(true), QuickStops::default()),
        );
        let keeping = plant.keep_watched();
        let door = |limit| WatchedDoor {
            name: "scada",
            listen: "127.0.0.1:1502".parse().unwrap(),
            limit,
            stops: true,
        };
        let client = "10.0.0.7".parse().unwrap();
        plant.watched().start(door(Some(Duration::from_secs(4))), client, &pump).await;
        assert_eq!(known(&open(true)), ["north atv312@1"]);
        assert!(known(&open(false)).is_empty());
        // Whoever starts it by a door where nobody has to be heard is not watched.
        plant.watched().start(door(None), client, &pump).await;
        assert!(known(&open(true)).is_empty());
        keeping.abort();
        fs::write(folder.file(FILE), "{\"pump 1\":{").unwrap();
        assert!(known(&open(true)).is_empty());
    }
}
