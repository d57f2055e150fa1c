//! What the history kept while nobody was told: behind the births it is told as values of the past, with their own times.
//!
//! Data have quality of service 0, so that nobody acknowledges them. A broker takes what comes by one connection in its order: the answer to
//! something asked behind them says that it has them, and only then the history's place moves on. What is so now goes first: nothing of the
//! past is published while anything else waits, one message of it is under way at a time, and ten a second at the most.

use std::{
    collections::{BTreeSet, VecDeque},
    future::pending,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use drive_sparkplug::{EdgeNode, Now, PastError as NotTold};
use tokio::{
    sync::oneshot,
    task::{JoinHandle, spawn_blocking},
    time::Instant,
};

use super::{message, metrics};
use crate::broker::{Broker, Kept, Subscription};
use drived_config::names::Kind;
use drived_plant::plant::{
    Plant,
    past::PastError,
    untold::{Told, UntoldPoint, UntoldView},
};

/// Between two messages of the past, at the least.
const PACE: Duration = Duration::from_millis(100);
/// Values of one message.
const AT_ONCE: usize = 100;
/// Between two questions whether the broker has what was told as it was read.
const CERTAIN: Duration = Duration::from_secs(5);
/// Between two looks, while nobody is told anything, at whether the history knows that.
const KNOWN: Duration = Duration::from_secs(60);
/// A reading may be seen here so much later than it ended on its line.
const SEEN_WITHIN: Duration = Duration::from_secs(1);

/// What became of values of the past.
#[derive(Debug, Default)]
pub(super) struct Counts {
    pub(super) told: AtomicU64,
    /// Their drive has left, or no birth has their metric.
    pub(super) left_out: AtomicU64,
}

/// Tells what was not told.
pub(super) struct Historical {
    plant: Plant,
    whom: String,
    begun: Instant,
    /// What is asked again to hear from the broker.
    again: Subscription,
    counts: Arc<Counts>,
    /// When this session has told its first birth.
    born_at: Option<Instant>,
    /// Up to when everything that was read has been published in it.
    live_until: Option<Instant>,
    /// Before this nothing is published,
    paced_until: Instant,
    /// nor is anything asked or noted that nobody waits for.
    next_at: Instant,
    part: Option<Part>,
    step: Step,
    /// How many values of the present outage were told.
    telling: u64,
    is_missing: bool,
}

/// What the history has given and what is not told of it yet.
struct Part {
    number: i64,
    drive: String,
    until_ms: i64,
    points: VecDeque<UntoldPoint>,
}

/// What is waited for.
enum Step {
    Nothing,
    /// That the broker has all of this.
    Sign(oneshot::Receiver<()>, Told),
    /// That the history has noted it, and says what is next.
    Note(JoinHandle<Result<Option<UntoldView>, PastError>>),
}

/// What has come that was waited for.
pub(super) enum Came {
    Sign(bool),
    Noted(Result<Option<UntoldView>, PastError>),
}

impl Historical {
    pub(super) fn new(plant: Plant, whom: String, again: Subscription, counts: Arc<Counts>) -> Self {
        let begun = Instant::now();
        Self {
            plant,
            whom,
            begun,
            again,
            counts,
            born_at: None,
            live_until: None,
            paced_until: begun,
            next_at: begun,
            part: None,
            step: Step::Nothing,
            telling: 0,
            is_missing: false,
        }
    }

    /// The session has ended, or has begun: what the broker has not been seen to have is told again.
    pub(super) fn begin_anew(&mut self) {
        (self.born_at, self.live_until, self.part) = (None, None, None);
        self.step = Step::Nothing;
        self.next_at = Instant::now();
    }

    /// The births of this session have been published by now.
    pub(super) fn born(&mut self, at: Instant) {
        if self.born_at.is_none() {
            (self.born_at, self.next_at) = (Some(at), at);
        }
    }

    /// Everything that was read up to then has been published.
    pub(super) fn live(&mut self, until: Instant) {
        self.live_until = Some(until);
    }

    /// When there is something to do though nothing comes.
    pub(super) fn due(&self) -> Option<Instant> {
        let is_idle = matches!(self.step, Step::Nothing);
        let at = if self.part.is_some() { self.paced_until } else { self.next_at.max(self.paced_until) };
        is_idle.then_some(at)
    }

    /// Nothing of the past can be told now. That somebody is told nothing is noted at once, so that it outlives a kill, and for whoever keeps it
    /// from now on.
    pub(super) fn stand_by(&mut self) {
        let at = Instant::now();
        self.paced_until = at + PACE;
        if self.born_at.is_none() && at >= self.next_at {
            self.next_at = at + KNOWN;
            let told = Told { whom: self.whom.clone(), begun: self.begun, live: None, later: None };
            self.note(told, None);
        }
    }

    /// Waits for what is under way.
    pub(super) async fn came(&mut self) -> Came {
        match &mut self.step {
            Step::Nothing => pending().await,
            Step::Sign(sign, _) => Came::Sign(sign.await.is_ok()),
            Step::Note(noted) => Came::Noted(match noted.await {
                Ok(noted) => noted,
                Err(error) => Err(PastError::Unreadable(error.to_string())),
            }),
        }
    }

    /// Goes on with what has come.
    pub(super) fn take(&mut self, came: Came, node: &EdgeNode) {
        match (came, std::mem::replace(&mut self.step, Step::Nothing)) {
            (Came::Sign(true), Step::Sign(_, told)) => self.note(told, Some(node)),
            // Whether it has them nobody knows: they are told again.
            (Came::Sign(_), _) => self.part = None,
            (Came::Noted(Ok(next)), _) => {
                if self.part.as_ref().is_some_and(|part| !part.points.is_empty()) {
                    return;
                }
                self.part = next.map(Part::from);
                if self.part.is_none() && self.telling > 0 {
                    tracing::info!("Sparkplug: {} values of an outage have been told", self.telling);
                    self.telling = 0;
                }
            }
            (Came::Noted(Err(error)), _) => {
                tracing::debug!("Sparkplug: nothing can be told of an outage: {error}");
                self.part = None;
                self.next_at = Instant::now() + CERTAIN;
            }
        }
    }

    /// Publishes what is next of the past, where there is something, and asks for a sign where one is due. Everything that is so now has been
    /// published, and nothing waits. `false`: the connection is over.
    pub(super) fn go_on(&mut self, node: &mut EdgeNode, broker: &Broker, connection: u64, now: Now) -> bool {
        let (Some(born_at), Step::Nothing) = (self.born_at, &self.step) else { return true };
        let at = Instant::now();
        if self.due().is_none_or(|due| at < due) {
            return true;
        }
        let mut later = None;
        if let Some(part) = &mut self.part {
            let there = self.plant.fleet().drive(&part.drive).is_some();
            let readings = part.take(AT_ONCE);
            let until_ms = part.points.front().map_or(part.until_ms, |next| next.at_ms - 1);
            later = Some((part.number, until_ms));
            let count = readings.len() as u64;
            let id = self.plant.known_as(Kind::Drive, &part.drive).id;
            let told = match there {
                _ if readings.is_empty() => None,
                false => Some(Err(())),
                true => match node.past(&id, readings, now) {
                    Ok(publication) => Some(Ok(publication)),
                    // It has died a moment ago: when it is born again.
                    Err(NotTold::NotBorn(_)) => {
                        self.part = None;
                        return true;
                    }
                    Err(_) => Some(Err(())),
                },
            };
            match told {
                None => {}
                Some(Err(())) => drop(self.counts.left_out.fetch_add(count, Ordering::Relaxed)),
                Some(Ok(publication)) => {
                    if !broker.publish(message(publication), Kept::OfConnection(connection)) {
                        return false;
                    }
                    self.telling += count;
                    self.counts.told.fetch_add(count, Ordering::Relaxed);
                }
            }
        }
        (self.paced_until, self.next_at) = (at + PACE, at + CERTAIN);
        let until = self.live_until.and_then(|until| until.checked_sub(SEEN_WITHIN)).unwrap_or(born_at);
        let live = Some((born_at, until.max(born_at)));
        let told = Told { whom: self.whom.clone(), begun: self.begun, live, later };
        self.step = Step::Sign(broker.sign(self.again.clone()), told);
        true
    }

    /// Has the history note what is certain, and say what is next for a node.
    fn note(&mut self, told: Told, node: Option<&EdgeNode>) {
        let Some(untold) = self.plant.untold() else {
            self.next_at = Instant::now() + CERTAIN;
            if node.is_some() && !std::mem::replace(&mut self.is_missing, true) {
                tracing::warn!("Sparkplug: no history is kept: nothing of an outage can be told");
            }
            return;
        };
        self.is_missing = false;
        let goes_on = self.part.as_ref().is_some_and(|part| !part.points.is_empty());
        let later = node.filter(|_| !goes_on).map(|node| self.unborn(node));
        self.step = Step::Note(spawn_blocking(move || {
            untold.note(&told)?;
            later.map_or(Ok(None), |later| untold.next(&told.whom, &later))
        }));
    }

    /// The drives that are no devices now, and may be later.
    fn unborn(&self, node: &EdgeNode) -> BTreeSet<String> {
        let drives = self.plant.fleet().drives();
        let names = drives.iter().map(|drive| drive.name().to_string());
        names.filter(|name| !node.is_born(&self.plant.known_as(Kind::Drive, name).id)).collect()
    }
}

impl Part {
    /// The next of them, as a device has them; those of one moment together.
    fn take(&mut self, most: usize) -> Vec<(&'static str, drive_sparkplug::Reading)> {
        let mut readings = Vec::new();
        let mut last_ms = None;
        while let Some(next) = self.points.front()
            && (readings.len() < most || last_ms == Some(next.at_ms))
        {
            last_ms = Some(next.at_ms);
            readings.extend(metrics::of_the_past(next));
            self.points.pop_front();
        }
        readings
    }
}

impl From<UntoldView> for Part {
    fn from(view: UntoldView) -> Self {
        let UntoldView { number, drive, points, until_ms } = view;
        Self { number, drive, until_ms, points: points.into() }
    }
}
