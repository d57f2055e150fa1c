//! What became of the last commands, by their ids: a command that comes again is answered, not repeated. An id is its caller's own.

use std::{
    collections::{HashMap, VecDeque},
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use drive_core::Setpoint;
use tokio::{sync::watch, time::Instant};

use super::{Action, Expects, Lifetime, OutcomeWord, Rejected, Request, Target};
use crate::plant::views::CommandView;
use drived_config::rights::Caller;

/// How many commands are remembered, and for how long.
const KEPT: usize = 1_000;
const KEPT_FOR: Duration = Duration::from_secs(600);

/// A command as it is told, now and later.
pub(super) type Command = Arc<watch::Sender<Arc<CommandView>>>;
/// The ear of somebody who waits for it.
pub type Told = watch::Receiver<Arc<CommandView>>;

/// The last commands.
#[derive(Default)]
pub(in crate::plant) struct Log(Mutex<Entries>);

#[derive(Default)]
struct Entries {
    /// Those that have an id in common are of as many callers.
    by_id: HashMap<String, Vec<Entry>>,
    /// The ids with the time of their arrival, the oldest first. One that was used again stands here more than once.
    order: VecDeque<(Instant, String)>,
}

struct Entry {
    arrived: Instant,
    caller: String,
    target: Target,
    action: Action,
    expects: Option<Expects>,
    lifetime: Lifetime,
    command: Command,
}

/// What the log knows of an id.
pub(super) enum Found {
    /// It is this command that came before.
    Again(Command),
    /// It is new.
    New(Command),
}

impl Log {
    /// The command of an id; of one that several callers have used none is told: it would be another's.
    pub(super) fn of(&self, id: &str) -> Option<Command> {
        let mut entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        entries.forget(Instant::now());
        match &entries.by_id.get(id)?[..] {
            [only] => Some(Arc::clone(&only.command)),
            _ => None,
        }
    }

    /// The same command of the same caller as it came before, or a new one. A stop is always new.
    pub(super) fn find_or_add(
        &self,
        caller: &Caller,
        request: Request,
        view: CommandView,
    ) -> Result<Found, Rejected> {
        let mut entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        entries.forget(request.arrived);
        if let Some(command) = entries.again(caller, &request)? {
            return Ok(Found::Again(command));
        }
        let Request { id: _, target, action, expects, lifetime, arrived } = request;
        let id = view.id.clone();
        let command = Arc::new(watch::Sender::new(Arc::new(view)));
        let (caller, told) = (caller.name.clone(), Arc::clone(&command));
        let entry = Entry { arrived, caller, target, action, expects, lifetime, command: told };
        let same = entries.by_id.entry(id.clone()).or_default();
        same.retain(|other| other.caller != entry.caller);
        same.push(entry);
        entries.order.push_back((arrived, id));
        Ok(Found::New(command))
    }

    /// The command that this is once more, if it came before.
    pub(super) fn again(&self, caller: &Caller, request: &Request) -> Result<Option<Command>, Rejected> {
        let mut entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        entries.forget(request.arrived);
        entries.again(caller, request)
    }

    /// The setpoints that are on their way to somebody.
    pub(super) fn setpoints_under_way(&self) -> Vec<(Target, Setpoint)> {
        let entries = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let given = |entry: &Entry| match entry.action {
            Action::Setpoint { setpoint, .. } | Action::Start { setpoint: Some(setpoint), .. } => {
                let is_open = entry.command.borrow().outcome == OutcomeWord::Pending;
                is_open.then(|| (entry.target.clone(), setpoint))
            }
            _ => None,
        };
        entries.by_id.values().flatten().filter_map(given).collect()
    }
}

#[cfg(test)]
impl Log {
    /// No command is added before what it gives is dropped.
    pub(super) fn hold(&self) -> impl Drop + '_ {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entries {
    fn again(&self, caller: &Caller, request: &Request) -> Result<Option<Command>, Rejected> {
        let is_once = !matches!(request.action, Action::Stop(_));
        let id = request.id.as_ref().filter(|_| drive_fleet::mutant!("done-twice", is_once, false));
        let Some((id, same)) = id.and_then(|id| self.by_id.get_key_value(id)) else { return Ok(None) };
        let Some(entry) = same.iter().find(|entry| entry.caller == caller.name) else { return Ok(None) };
        let is_same = (&entry.target, entry.action, &entry.expects, entry.lifetime)
            == (&request.target, request.action, &request.expects, request.lifetime);
        if is_same { Ok(Some(Arc::clone(&entry.command))) } else { Err(Rejected::IdReused(id.clone())) }
    }

    /// Forgets what is too old, and the oldest of too many.
    fn forget(&mut self, now: Instant) {
        while let Some((arrived, _)) = self.order.front() {
            let is_old = now.saturating_duration_since(*arrived) > KEPT_FOR;
            if !is_old && self.order.len() < KEPT {
                return;
            }
            let Some((arrived, id)) = self.order.pop_front() else { return };
            if let Some(same) = self.by_id.get_mut(&id) {
                same.retain(|entry| entry.arrived != arrived);
                if same.is_empty() {
                    self.by_id.remove(&id);
                }
            }
        }
    }
}
