//! Commands: each has an id, an expiry that counts from its arrival, and an outcome that is told under its id.
//!
//! A command goes on when whoever asked for it has gone, but where it waits and he is [not heard any more](drived_config::rights::Heard). A stop never expires, and is carried out each time it arrives.

pub mod age;
mod body;
mod carry;
mod expected;
mod log;
mod outcome;
mod said;
mod settle;
mod undone;

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_core::{Direction, Setpoint};
use drive_fleet::{DriveHandle, Place, ShownIdentity, StopOrder, Until};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tokio::{
    task::yield_now,
    time::{Instant, timeout},
};

pub(super) use self::log::Log;
pub use self::{
    body::{Accept, Asked, Asks, NewSetpoint, Release, Reset, Save, Start, Stop, is_id},
    expected::{Expects, Otherwise},
    log::Told,
    outcome::OutcomeWord,
    said::Said,
};
use self::{
    carry::{Meant, Posted, Work},
    log::Found,
};
use super::{Plant, views::CommandView};
use drived_config::{config::Group, rights::Caller};

/// How long a command may wait until it is sent, unless it says so itself, and at the longest.
pub const LIFETIME: Lifetime = Lifetime::Usual(Duration::from_secs(1));
pub const LONGEST_LIFETIME: Duration = Duration::from_secs(10);

/// Of more drives than these what is told of a stop is made when they have theirs.
const MADE_AT_ONCE: usize = 100;

/// What is asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The caller's name of it; `None`: it gets one of ours.
    pub id: Option<String>,
    pub target: Target,
    pub action: Action,
    /// What whoever asks was shown; `None`: he means whoever is called so.
    pub expects: Option<Expects>,
    pub lifetime: Lifetime,
    /// When it arrived.
    pub arrived: Instant,
}

/// How long a command may wait until it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lifetime {
    /// Nobody has said: until something of it is. A start that has begun goes on for as long as its drive takes, 2 s at the most.
    Usual(Duration),
    /// The command says it: whatever of it was not sent by then never is.
    Said(Duration),
}

impl Lifetime {
    #[must_use]
    pub const fn time(self) -> Duration {
        match self {
            Self::Usual(time) | Self::Said(time) => time,
        }
    }
}

/// Who is meant.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Target {
    Drive(String),
    Group(String),
    /// These, each by itself: who has chosen them has made no group of them.
    Selected(Vec<String>),
    All,
}

/// What is to be done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    Start {
        direction: Direction,
        setpoint: Option<Setpoint>,
        until: Until,
    },
    Stop(StopOrder),
    Setpoint {
        setpoint: Setpoint,
        until: Until,
    },
    Reset,
    Release,
    /// To EEPROM.
    Save,
    /// Another drive than before, which says that it is this one.
    Accept(ShownIdentity),
}

/// Why a command is not taken at all.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Rejected {
    #[error("{caller} has no right to {right}")]
    NoRight { caller: String, right: &'static str },
    #[error("the token {caller} is not for {drive}")]
    OutOfScope { caller: String, drive: String },
    #[error("there is no drive {0:?}")]
    NoDrive(String),
    #[error("there is no group {0:?}")]
    NoGroup(String),
    #[error("a stop of {0} came after it")]
    Stopped(String),
    #[error("it is not as it was shown: {0}")]
    Otherwise(Otherwise),
    #[error("the daemon is about to end: until it has, only stops are carried out")]
    Closing,
    #[error("it is {} ms old, and was to be carried out within {} ms", .age.as_millis(), .lifetime.as_millis())]
    TooOld { age: Duration, lifetime: Duration },
    #[error(
        "the clock of this computer was set back by {:.1} s a moment ago, and nobody can say how old it is",
        .0.as_secs_f64()
    )]
    ClockSetBack(Duration),
    #[error("it was sent {0} ms in the future: the clocks differ")]
    FromTheFuture(u64),
    #[error("the id {0:?} was used for another command: expected one that is new, or the same command")]
    IdReused(String),
}

impl Rejected {
    /// The outcome and the reason by which every face tells it.
    pub const fn told(&self) -> (OutcomeWord, &'static str) {
        match self {
            Self::NoRight { .. } | Self::OutOfScope { .. } => (OutcomeWord::Refused, "no_right"),
            Self::NoDrive(_) | Self::NoGroup(_) => (OutcomeWord::Refused, "not_found"),
            Self::Stopped(_) => (OutcomeWord::Superseded, "stop"),
            Self::Otherwise(_) => (OutcomeWord::Refused, "not_as_shown"),
            Self::Closing => (OutcomeWord::Refused, "closing"),
            Self::TooOld { .. } => (OutcomeWord::Expired, "expired"),
            Self::ClockSetBack(_) => (OutcomeWord::Refused, "late"),
            Self::FromTheFuture(_) => (OutcomeWord::Refused, "malformed"),
            Self::IdReused(_) => (OutcomeWord::Refused, "id_reused"),
        }
    }
}

/// What is to be done, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ActionWord {
    Start,
    Stop,
    Setpoint,
    Reset,
    Release,
    Save,
    Accept,
}

impl ActionWord {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Stop => "stop",
            Self::Setpoint => "setpoint",
            Self::Reset => "reset",
            Self::Release => "release",
            Self::Save => "save",
            Self::Accept => "accept",
        }
    }
}

impl Action {
    pub const fn word(&self) -> ActionWord {
        match self {
            Self::Start { .. } => ActionWord::Start,
            Self::Stop(_) => ActionWord::Stop,
            Self::Setpoint { .. } => ActionWord::Setpoint,
            Self::Reset => ActionWord::Reset,
            Self::Release => ActionWord::Release,
            Self::Save => ActionWord::Save,
            Self::Accept(_) => ActionWord::Accept,
        }
    }

    pub fn text(&self) -> String {
        match self {
            Self::Start { direction, setpoint: Some(setpoint), .. } => {
                format!("start {direction} at {setpoint}")
            }
            Self::Start { direction, setpoint: None, .. } => format!("start {direction}"),
            Self::Stop(order) => order.to_string(),
            Self::Setpoint { setpoint, .. } => format!("setpoint {setpoint}"),
            Self::Reset => "fault reset".to_owned(),
            Self::Release => "release".to_owned(),
            Self::Save => "save to EEPROM".to_owned(),
            Self::Accept(_) => "accepting the identity".to_owned(),
        }
    }
}

impl Plant {
    /// Carries out a command and waits for its outcome for as long as `wait`; then it is told as it is.
    ///
    /// # Errors
    /// [`Rejected`]: nothing was done.
    ///
    /// # Cancellation
    /// The command goes on.
    pub async fn command(
        &self,
        caller: &Caller,
        request: Request,
        wait: Duration,
    ) -> Result<Arc<CommandView>, Rejected> {
        let asked_after = request.arrived;
        self.command_asked_after(caller, request, asked_after, wait).await
    }

    /// The same, begun by [`begin_asked_after`](Self::begin_asked_after).
    ///
    /// # Errors
    /// [`Rejected`]: nothing was done.
    pub async fn command_asked_after(
        &self,
        caller: &Caller,
        request: Request,
        asked_after: Instant,
        wait: Duration,
    ) -> Result<Arc<CommandView>, Rejected> {
        let told = self.begin_asked_after(caller, request, asked_after)?;
        Ok(settled(told, wait).await)
    }

    /// The command of an id, after its outcome is known or `wait` is over.
    pub async fn command_of(&self, id: &str, wait: Duration) -> Option<Arc<CommandView>> {
        let told = self.0.commands.of(id)?.subscribe();
        Some(settled(told, wait).await)
    }

    /// Begins a command: what the drives are asked is on its way to them when this returns. Its outcome is told, and told
    /// anew for as long as it may still be settled.
    ///
    /// # Errors
    /// [`Rejected`]: nothing was done.
    pub fn begin(&self, caller: &Caller, request: Request) -> Result<Told, Rejected> {
        let asked_after = request.arrived;
        self.begin_asked_after(caller, request, asked_after)
    }

    /// The same with what may have been on its way since `asked_after`, such as over a broker: a stop by another door since then may have
    /// come after it, and it is not begun. What came through the same door came in its order. What a drive is asked and nothing
    /// of which has begun is withdrawn, if it is no stop, once whoever has asked is not heard any more.
    ///
    /// # Errors
    /// [`Rejected`]: nothing was done.
    pub fn begin_asked_after(
        &self,
        caller: &Caller,
        mut request: Request,
        asked_after: Instant,
    ) -> Result<Told, Rejected> {
        let (has_right, right) = match request.action {
            Action::Stop(_) => (caller.rights.stop, "stop"),
            Action::Save => (caller.rights.engineer, "save parameters"),
            // Who may start a motor does not say by that how another drive is set up for it.
            Action::Accept(_) => (caller.rights.engineer, "accept another drive"),
            _ => (caller.rights.operate, "operate"),
        };
        if !has_right {
            return Err(Rejected::NoRight { caller: caller.name.clone(), right });
        }
        self.0.note_commander(&caller.name);
        let fleet = self.fleet();
        let is_stop = matches!(request.action, Action::Stop(_));
        if !is_stop {
            request.arrived = self.0.pulse.asked_after(request.arrived);
        }
        let asked_after = asked_after.min(request.arrived);
        let meant = match self.meant(caller, &mut request) {
            _ if self.is_closing() && !is_stop => Err(Rejected::Closing),
            meant => meant,
        };
        let meant = match meant {
            // What came before is told, also where it has changed what was shown, and where nothing new is begun.
            Err(rejected @ (Rejected::Otherwise(_) | Rejected::Closing)) => {
                let again = self.0.commands.again(caller, &request)?;
                return again.map(|told| told.subscribe()).ok_or(rejected);
            }
            meant => meant?,
        };
        let meant = Meant::new(&fleet, caller, &request, meant);
        // Held until it is on its way: a start that has passed is not behind a stop that passes after it.
        let mut passing = self.0.stopped.pass();
        // Before anything is made that is told of it: among thousands that takes longer than all their stops.
        let stops = meant.stop(&request);
        if let Some(stops) = stops {
            passing.note(caller, meant.drives());
            self.0.watched.stop(meant.drives());
            drop(passing);
            return self.tell_stops(caller, request, meant, stops);
        }
        passing.may_begin(caller, &request, asked_after, meant.drives())?;
        if matches!(request.action, Action::Start { .. }) {
            let commander = &caller.name;
            meant.drives().iter().for_each(|drive| self.0.watched.start_anew(drive.place(), commander));
        }
        let work = Work::new(self.clone(), caller, &request, meant);
        match self.0.commands.find_or_add(caller, request, work.view())? {
            Found::Again(told) => Ok(told.subscribe()),
            Found::New(command) => {
                let told = command.subscribe();
                work.begin(command, None);
                Ok(told)
            }
        }
    }

    /// Tells of stops that are on their way.
    fn tell_stops(
        &self,
        caller: &Caller,
        request: Request,
        meant: Meant,
        stops: Posted,
    ) -> Result<Told, Rejected> {
        let asked = request.clone();
        // Of so many even this waits until they have it: whoever asks at once is told how many they are.
        let (first, work) = match meant.drives().len() > MADE_AT_ONCE {
            true => (meant.pending(caller, &request), None),
            false => {
                let work = Work::new(self.clone(), caller, &request, meant.clone());
                (work.view(), Some(work))
            }
        };
        let (Found::New(command) | Found::Again(command)) =
            self.0.commands.find_or_add(caller, asked, first)?;
        let told = command.subscribe();
        match work {
            Some(work) => work.begin(command, Some(stops)),
            None => {
                let (plant, caller) = (self.clone(), caller.clone());
                self.0.runtime.spawn(async move {
                    let work = Work::new(plant, &caller, &request, meant);
                    work.tell(&command);
                    work.carried(stops, command).await;
                });
            }
        }
        Ok(told)
    }

    /// The drives that are meant, and are as they were shown.
    fn meant(&self, caller: &Caller, request: &mut Request) -> Result<Vec<DriveHandle>, Rejected> {
        let fleet = &self.0.fleet;
        let is_stop = matches!(request.action, Action::Stop(_));
        // Whoever may stop, may stop them all: nobody is looked for by his name.
        if is_stop && request.target == Target::All {
            return Ok(fleet.drives());
        }
        let mut members = Vec::new();
        // A reload gives no name to another drive meanwhile.
        let groups = self.0.groups.read().unwrap_or_else(PoisonError::into_inner);
        match &request.expects {
            Some(expects) if is_stop => {
                let target = std::mem::replace(&mut request.target, Target::All);
                request.target = self.stopped_by(&groups, target, expects);
            }
            Some(expects) => {
                let names = self.named(&groups, &request.target)?;
                self.is_as_shown_among(&groups, expects, &names).map_err(Rejected::Otherwise)?;
            }
            None => {}
        }
        let may_be_less = is_stop && !matches!(request.target, Target::Drive(_));
        for name in self.named(&groups, &request.target)? {
            if !is_stop && !caller.may_command(&name, &groups) {
                return Err(Rejected::OutOfScope { caller: caller.name.clone(), drive: name });
            }
            match fleet.drive(&name) {
                Some(drive) => members.push(drive),
                // A group is stopped whoever is left of it; nothing else is done to a part of what was meant.
                None if may_be_less => {}
                None => return Err(Rejected::NoDrive(name)),
            }
        }
        Ok(members)
    }

    /// The names of the drives that are meant.
    fn named(&self, groups: &[Group], target: &Target) -> Result<Vec<String>, Rejected> {
        match target {
            Target::Drive(name) => Ok(vec![name.clone()]),
            Target::Group(name) => {
                let group = groups.iter().find(|group| group.name == *name);
                group.map(|group| group.drives.clone()).ok_or_else(|| Rejected::NoGroup(name.clone()))
            }
            Target::Selected(names) => Ok(names.clone()),
            Target::All => Ok(self.fleet().drives().iter().map(|drive| drive.name().to_string()).collect()),
        }
    }
}

/// When a stop was last asked of each drive, by whichever face: what was asked before it is not begun after it.
#[derive(Default)]
pub(super) struct Stopped(Mutex<LastStops>);

/// A stop is of the machine, whatever that is called by now. It is of the name besides: who asked for a start before it meant the machine
/// that had the name then.
#[derive(Default)]
struct LastStops {
    by_place: HashMap<Place, LastStop>,
    by_name: HashMap<Arc<str>, LastStop>,
}

/// The last stop of a drive.
struct LastStop {
    at: Instant,
    origin: Arc<str>,
    /// The last from elsewhere.
    from_elsewhere: Option<Instant>,
}

/// Nothing else passes while this is there.
struct Passing<'a>(MutexGuard<'a, LastStops>);

impl Stopped {
    fn pass(&self) -> Passing<'_> {
        Passing(self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Passing<'_> {
    /// These have been given their stops.
    fn note(&mut self, caller: &Caller, drives: &[DriveHandle]) {
        // What was asked for until now came before each of them.
        let (at, origin) = (Instant::now(), Arc::<str>::from(&*caller.origin));
        let stop = |last: Option<&LastStop>| {
            let from_elsewhere = last.and_then(|last| last.before(&origin));
            LastStop { at, origin: Arc::clone(&origin), from_elsewhere }
        };
        let LastStops { by_place, by_name } = &mut *self.0;
        for drive in drives {
            let (place, name) = (drive.place(), drive.name());
            by_place.insert(place.clone(), stop(by_place.get(place)));
            by_name.insert(Arc::clone(name), stop(by_name.get(name)));
        }
    }

    /// Whether no stop of these has overtaken what was asked.
    fn may_begin(
        &self,
        caller: &Caller,
        request: &Request,
        asked_after: Instant,
        drives: &[DriveHandle],
    ) -> Result<(), Rejected> {
        let overtakes = |last: &LastStop| {
            let from_elsewhere = last.before(&caller.origin);
            last.at > request.arrived || from_elsewhere.is_some_and(|at| at > asked_after)
        };
        let LastStops { by_place, by_name } = &*self.0;
        let is_overtaken = |drive: &&DriveHandle| {
            let lasts = [by_place.get(drive.place()), by_name.get(drive.name())];
            lasts.into_iter().flatten().any(overtakes)
        };
        match drives.iter().find(is_overtaken) {
            Some(drive) => Err(Rejected::Stopped(drive.name().to_string())),
            None => Ok(()),
        }
    }
}

impl LastStop {
    /// The last stop that did not come from there.
    fn before(&self, origin: &str) -> Option<Instant> {
        if *self.origin == *origin { self.from_elsewhere } else { Some(self.at) }
    }
}

async fn settled(mut told: Told, wait: Duration) -> Arc<CommandView> {
    // What is not known in time is told as it is.
    if wait.is_zero() {
        // The drives have their turn first. No timer is asked: on a machine with much to do it comes when it likes.
        yield_now().await;
    } else {
        let _ = timeout(wait, told.wait_for(|view| view.outcome != OutcomeWord::Pending)).await;
    }
    Arc::clone(&told.borrow())
}

#[cfg(test)]
mod tests {
    use drive_core::{Frequency, StopMode};
    use drive_fleet::{EventKind, Outcome, Received, Refused};
    use tokio::{sync::mpsc, task::spawn_blocking, time::advance};

    use super::*;
    use crate::plant::testing::TestPlant;
    use drived_config::rights::Rights;

    #[tokio::test(start_paused = true)]
    async fn whoever_does_not_wait_for_what_becomes_of_a_stop_is_answered_without_a_timer() {
        let plant = TestPlant::of(1).await.plant;
        // Timers come at whole milliseconds.
        advance(Duration::from_micros(300)).await;
        let (caller, arrived) = (Caller::new("page", "page", Rights::ALL), Instant::now());
        let action = Action::Stop(StopMode::Ramp.into());
        let request =
            Request { id: None, target: Target::All, action, expects: None, lifetime: LIFETIME, arrived };
        plant.command(&caller, request, Duration::ZERO).await.unwrap();
        assert_eq!(arrived.elapsed(), Duration::ZERO);
    }

    #[tokio::test(start_paused = true)]
    async fn a_start_that_may_be_given_is_on_its_way_before_a_stop_is_taken() {
        let plant = TestPlant::of(1).await.plant;
        let held = plant.0.commands.hold();
        let starting = plant.clone();
        let started = spawn_blocking(move || {
            let caller = Caller::new("page", "page", Rights::ALL);
            let action =
                Action::Start { direction: Direction::Forward, setpoint: None, until: Until::default() };
            let (target, arrived) = (Target::Drive("pump 1".to_owned()), Instant::now());
            starting.begin(
                &caller,
                Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived },
            )
        });
        // It has been let pass and is not handed over yet: no stop can be taken meanwhile.
        let patience = std::time::Instant::now() + Duration::from_secs(20);
        while plant.0.stopped.0.try_lock().is_ok() {
            assert!(std::time::Instant::now() < patience, "a stop would be taken before it");
            std::thread::yield_now();
        }
        drop(held);
        assert!(started.await.unwrap().is_ok());
        assert!(plant.0.stopped.0.try_lock().is_ok(), "and then stops are taken");
    }

    #[tokio::test(start_paused = true)]
    async fn the_stops_of_all_are_on_their_way_before_anything_is_made_that_is_told_of_them() {
        let plant = TestPlant::of(3).await.plant;
        // Nothing can be told of a command meanwhile.
        let held = plant.0.commands.hold();
        let stopping = plant.clone();
        let stopped = spawn_blocking(move || {
            let caller = Caller::new("page", "page", Rights::ALL);
            let (action, arrived) = (Action::Stop(StopMode::Ramp.into()), Instant::now());
            let request =
                Request { id: None, target: Target::All, action, lifetime: LIFETIME, arrived, expects: None };
            stopping.begin(&caller, request)
        });
        let patience = std::time::Instant::now() + Duration::from_secs(20);
        let has_its_own = |drive: &DriveHandle| drive.snapshot().stop.is_some();
        while !plant.fleet().drives().iter().all(has_its_own) {
            assert!(std::time::Instant::now() < patience, "a drive waits for what is told of its stop");
            yield_now().await;
        }
        drop(held);
        assert!(stopped.await.unwrap().is_ok());
    }

    #[tokio::test(start_paused = true)]
    async fn of_a_stop_of_very_many_it_is_told_how_many_before_who_they_are() {
        let many = MADE_AT_ONCE + 1;
        let plant = TestPlant::of(u8::try_from(many).unwrap()).await.plant;
        let (caller, arrived) = (Caller::new("page", "page", Rights::ALL), Instant::now());
        let action = Action::Stop(StopMode::Ramp.into());
        let request =
            Request { id: None, target: Target::All, action, lifetime: LIFETIME, arrived, expects: None };
        let mut told = plant.begin(&caller, request).unwrap();
        let counts = |view: &CommandView| {
            let several = view.several.as_ref().unwrap();
            (several.count(), several.drives.len())
        };
        assert_eq!(counts(&told.borrow()), (many, 0));
        let last = told.wait_for(|view| view.outcome != OutcomeWord::Pending).await.unwrap();
        assert_eq!((last.outcome, counts(&last)), (OutcomeWord::Confirmed, (many, many)));
    }

    #[tokio::test(start_paused = true)]
    async fn every_command_of_a_burst_is_on_its_way_when_it_was_taken_however_long_the_burst() {
        let plant = TestPlant::of(1).await.plant;
        let (mut events, pump) = (plant.fleet().events(), plant.fleet().drive("pump 1").unwrap());
        let caller = Caller::new("scada", "mqtt", Rights::ALL);
        let beside = pump.commanded_by("beside");
        let (messages, mut inbox) = mpsc::unbounded_channel();
        (0..1_000).for_each(|number| messages.send(number).unwrap());
        drop(messages);
        let mut stops = Vec::new();
        // Each message that is there at once takes a part of what this task may spend before it lets others run.
        while inbox.recv().await.is_some() {
            let (action, arrived) = (Action::Stop(StopMode::Ramp.into()), Instant::now());
            let target = Target::Drive("pump 1".to_owned());
            let _ = plant.begin(
                &caller,
                Request { id: None, target, action, expects: None, lifetime: LIFETIME, arrived },
            );
            stops.push(beside.stop(StopMode::Ramp));
        }
        for stop in stops {
            assert!(stop.await.is_confirmed());
        }
        let mut commanders = Vec::new();
        while commanders.len() < 2_000 {
            let Received::Event(event) = events.recv().await else { panic!("events are missing") };
            if let EventKind::Command { commander, .. } = event.kind {
                commanders.push(commander);
            }
        }
        let expected = ["scada", "beside"].into_iter().cycle();
        let late = commanders.iter().zip(expected).position(|(commander, expected)| **commander != *expected);
        assert_eq!(late, None, "the stop that was taken first was overtaken");
    }

    /// A start of before a stop that was held up, such as at a door whose thread had no turn, comes behind a reload.
    #[tokio::test(start_paused = true)]
    async fn a_start_of_before_a_stop_starts_nothing_where_the_names_were_exchanged_between_both() {
        for held_up in ["pump 2", "pump 1"] {
            let test = TestPlant::of(2).await;
            let caller = Caller::new("page", "page", Rights::ALL);
            let request = |name: &str, action, arrived| {
                let (id, target) = (None, Target::Drive(name.to_owned()));
                Request {
                    id,
                    target,
                    action,
                    expects: None,
                    lifetime: Lifetime::Usual(LONGEST_LIFETIME),
                    arrived,
                }
            };
            let setpoint = Some(Frequency::from_hertz(20).into());
            let (direction, until) = (Direction::Forward, Until::default());
            let start = Action::Start { direction, setpoint, until };
            let before = Instant::now();
            advance(Duration::from_millis(10)).await;
            let stop = request("pump 1", Action::Stop(StopMode::Ramp.into()), Instant::now());
            test.plant.command(&caller, stop, Duration::from_secs(3)).await.unwrap();
            test.exchange_names();
            // By the name that the stopped machine has now, or by that which it had.
            let begun = test.plant.begin(&caller, request(held_up, start, before));
            assert_eq!(begun.err(), Some(Rejected::Stopped(held_up.to_owned())), "{held_up}");
            let (later, wait) = (request(held_up, start, Instant::now()), Duration::from_secs(3));
            let later = test.plant.command(&caller, later, wait).await;
            assert_eq!(later.unwrap().outcome, OutcomeWord::Confirmed, "what is asked behind it is done");
        }
    }

    #[test]
    fn what_a_stop_has_overtaken_is_told_by_the_same_words_whoever_finds_it_out() {
        let (word, reason, _) = outcome::told(&Outcome::Refused(Refused::Stopped));
        let (here, why) = Rejected::Stopped("pump 1".to_owned()).told();
        assert_eq!((here, Some(why)), (word, reason));
    }
}
