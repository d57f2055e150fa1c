//! What happens to the drives of a fleet, as it happens.

mod exit;
mod kind;
mod text;

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use tokio::{
    sync::{broadcast, mpsc},
    time::Instant,
};

use crate::{
    cause::{Cause, ChangedWord},
    place::Place,
    runs::RunKept,
};

pub use self::{exit::ExitAction, kind::EventKind};

/// Something that happened to a drive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Event {
    /// The drive.
    pub drive: Arc<str>,
    /// Which machine it is, by whatever name.
    pub place: Place,
    /// Its place among all events of the fleet, from 1: no two have the same, and what was told later has a higher one,
    /// whatever the wall's clock says.
    pub order: u64,
    /// When.
    pub at: Instant,
    /// When by the wall's clock, as that stood then.
    pub wall: SystemTime,
    /// What.
    pub kind: EventKind,
    /// Why.
    pub cause: Cause,
    /// The words of the drive that changed with it.
    pub words: Arc<[ChangedWord]>,
}

impl Event {
    /// Something that happens now, outside of every order and every fleet: the name of its drive says where that is.
    #[must_use]
    pub fn now(drive: impl Into<Arc<str>>, kind: EventKind, cause: Cause) -> Self {
        let Moment { at, wall } = Moment::now();
        let drive = drive.into();
        Self { place: Place::from(&*drive), drive, order: 0, at, wall, kind, cause, words: Arc::default() }
    }
}

/// One moment by both clocks: that of all that one reading shows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    at: Instant,
    wall: SystemTime,
}

impl Moment {
    pub(crate) fn now() -> Self {
        Self { at: Instant::now(), wall: SystemTime::now() }
    }
}

/// What is told, before it has its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Happened {
    pub(crate) kind: EventKind,
    pub(crate) cause: Cause,
    pub(crate) words: Arc<[ChangedWord]>,
}

/// Where the events of a fleet are told, one after the other.
#[derive(Debug, Clone)]
pub(crate) struct Teller {
    events: broadcast::Sender<Event>,
    last: Arc<Mutex<u64>>,
    /// Where it is told what is to be kept of run commands.
    pub(crate) runs: Option<mpsc::UnboundedSender<RunKept>>,
}

impl Teller {
    pub(crate) fn new(
        events: broadcast::Sender<Event>,
        runs: Option<mpsc::UnboundedSender<RunKept>>,
    ) -> Self {
        Self { events, last: Arc::default(), runs }
    }

    pub(crate) fn subscribe(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    pub(crate) fn tell(&self, drive: Arc<str>, place: Place, moment: Moment, happened: Happened) {
        let Happened { kind, cause, words } = happened;
        let Moment { at, wall } = moment;
        // Told under the lock, so that every reader gets them in their order.
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        *last += 1;
        let event = Event { drive, place, order: *last, at, wall, kind, cause, words };
        // Without a reader there is nobody to tell.
        let _ = self.events.send(event);
    }
}
