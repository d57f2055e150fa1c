//! Carrying out: what is asked of the fleet, and how the answer is told.

use std::{
    borrow::Cow,
    collections::HashMap,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use drive_fleet::{
    Act, DriveHandle, Fleet, Group, GroupFailure, GroupStart, GroupStop, GroupTicket, Link, Order, Outcome,
    Refused, StopReport, StopTicket, Ticket, view::StopModesView,
};
use futures_util::future::join_all;
use tokio::{
    sync::Notify,
    time::{Instant, sleep, timeout_at},
};

use super::{
    Action, ActionWord, Lifetime, OutcomeWord, Request, Target,
    log::Command,
    outcome::{GROUP_BUSY, GROUP_FAILED, GROUP_NOT_READY, of_all, of_watched, told},
    settle::settled,
    undone::{UNDONE, finished},
};
use crate::plant::{
    Plant,
    views::{CommandView, SeveralView, Shown},
};
use drived_config::{
    names::Kind,
    rights::{Caller, Heard},
};
use drived_words::json::{milliseconds, unix};

/// Outcomes of several drives that come within this time are told together.
const TOGETHER: Duration = Duration::from_millis(50);
/// And longer for many: what it takes to tell them anew must not take a processor.
const EACH: Duration = Duration::from_micros(8);
/// For how long an outcome that is not known may still be settled: as long as the command is remembered.
const SETTLES_FOR: Duration = Duration::from_secs(600);

/// The drives that a command is for, and by which id they are asked.
#[derive(Clone)]
pub(super) struct Meant {
    id: String,
    group: Group,
}

impl Meant {
    pub(super) fn new(fleet: &Fleet, caller: &Caller, request: &Request, drives: Vec<DriveHandle>) -> Self {
        let id = request.id.clone().unwrap_or_else(new_id);
        let act = Act::of(&caller.name).through(&caller.origin).with_id(&id);
        Self { id, group: fleet.group_of(drives).commanded_by(act) }
    }

    pub(super) fn drives(&self) -> &[DriveHandle] {
        self.group.members()
    }

    /// The command before anything is known of any of them.
    pub(super) fn pending(&self, caller: &Caller, request: &Request) -> CommandView {
        let pending = self.drives().len();
        let several = SeveralView {
            drives: Vec::new(),
            confirmed: 0,
            pending,
            not_reachable: 0,
            refused: 0,
            failed: 0,
        };
        CommandView { several: Some(several), ..self.head(caller, request) }
    }

    /// What holds for all of them.
    fn head(&self, caller: &Caller, request: &Request) -> CommandView {
        let (group, selected) = match &request.target {
            Target::Group(name) => (Some(name.clone()), Vec::new()),
            Target::Selected(names) => (None, names.clone()),
            Target::Drive(_) | Target::All => (None, Vec::new()),
        };
        CommandView {
            id: self.id.clone(),
            drive: None,
            group,
            selected,
            action: request.action.word(),
            command: request.action.text(),
            caller: caller.name.clone(),
            origin: caller.origin.clone(),
            outcome: OutcomeWord::Pending,
            open: true,
            reason: None,
            text: None,
            time_unix_ms: unix(request.arrived),
            took_ms: None,
            status: None,
            counted: None,
            started: None,
            stop: None,
            restarts: None,
            several: None,
        }
    }

    /// Stops them, if that is what was asked.
    pub(super) fn stop(&self, request: &Request) -> Option<Posted> {
        let Action::Stop(order) = request.action else { return None };
        Some(match (&request.target, self.drives()) {
            (Target::Drive(_), [drive]) => Posted::Stop(drive.stop(order)),
            _ => Posted::StopOfSeveral(self.group.stop(order)),
        })
    }
}

/// A command and the drives that are meant.
#[derive(Clone)]
pub(super) struct Work(Arc<Inner>);

struct Inner {
    plant: Plant,
    request: Request,
    /// For how long whoever asks is heard.
    heard: Heard,
    group: Group,
    /// Where each stands among them, by his name.
    numbers: HashMap<Arc<str>, usize>,
    /// What is told of each member, in their order. One that has changed is another one: so it is known which are to be told.
    parts: Mutex<Vec<Arc<CommandView>>>,
    /// One of them has changed.
    changed: Notify,
    /// And that has not been told yet.
    is_untold: AtomicBool,
    /// What holds for all of them.
    head: CommandView,
}

/// What was asked of the drives: it is on its way to them.
pub(super) enum Posted {
    Stop(StopTicket),
    StopOfSeveral(GroupStop),
    SetpointOfSeveral(GroupTicket<Vec<(Arc<str>, Outcome)>>),
    /// One for each member.
    Orders(Vec<Ticket>),
    /// A start of several waits for its turn first.
    Nothing,
}

impl Work {
    pub(super) fn new(plant: Plant, caller: &Caller, request: &Request, meant: Meant) -> Self {
        let head = meant.head(caller, request);
        let group = meant.group;
        let of_one = CommandView { group: None, selected: Vec::new(), ..head.clone() };
        let part = |member: &DriveHandle| {
            let part = CommandView { drive: Some(member.name().to_string()), ..of_one.clone() };
            match (request.action, member.settings().control) {
                // A stop of several goes to those that may be commanded, and the others are accounted for at once.
                (Action::Stop(_), false) if request.target != Target::Drive(member.name().to_string()) => {
                    let (word, reason, text) = of_watched(&member.snapshot());
                    part.ended_as(word, reason, text, member, request.arrived)
                }
                _ => part,
            }
        };
        let parts = group.members().iter().map(|member| Arc::new(part(member))).collect();
        let parts = Mutex::new(parts);
        let request = request.clone();
        let numbers = group.members().iter().map(|member| Arc::clone(member.name())).zip(0..).collect();
        Self(Arc::new(Inner {
            plant,
            request,
            heard: caller.heard.clone(),
            group,
            numbers,
            parts,
            changed: Notify::new(),
            is_untold: AtomicBool::new(false),
            head,
        }))
    }

    fn members(&self) -> &[DriveHandle] {
        self.0.group.members()
    }

    fn parts(&self) -> MutexGuard<'_, Vec<Arc<CommandView>>> {
        self.0.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The command as it is to be told now.
    pub(super) fn view(&self) -> CommandView {
        let mut parts = self.parts();
        if let (Target::Drive(_), Some(part)) = (&self.0.request.target, parts.first()) {
            return CommandView::clone(part);
        }
        let is_silent = |number: usize| {
            let member = self.members().get(number);
            member.is_some_and(|member| member.snapshot().link != Link::Connected)
        };
        CommandView {
            outcome: of_all(parts.iter().map(|part| part.outcome)),
            open: parts.iter().any(|part| part.open),
            took_ms: parts.iter().filter_map(|part| part.took_ms).max(),
            several: Some(SeveralView::of(&mut parts, is_silent)),
            ..self.0.head.clone()
        }
    }

    /// Begins, and goes on whether or not anybody waits. What is asked of the drives is on its way to them when this
    /// returns, whatever the caller's task has still to spend; only a start of several waits for its turn. A stop is under way.
    pub(super) fn begin(self, command: Command, stops: Option<Posted>) {
        let posted = stops.unwrap_or_else(|| self.post());
        let first = Arc::clone(&command.borrow());
        self.0.plant.0.tell_command(&first, None);
        let runtime = self.0.plant.0.runtime.clone();
        runtime.spawn(self.carried(posted, command));
    }

    pub(super) async fn carried(self, posted: Posted, command: Command) {
        tokio::select! {
            () = self.work(posted) => {}
            () = self.tell_changes(&command) => {}
        }
        self.tell(&command);
        if self.is_open() {
            tokio::select! {
                () = self.settle() => {}
                () = self.tell_changes(&command) => {}
                () = sleep(SETTLES_FOR) => {}
            }
            self.tell(&command);
        }
    }

    pub(super) fn tell(&self, command: &Command) {
        self.0.is_untold.store(false, Ordering::SeqCst);
        let view = Arc::new(self.view());
        let before = Arc::clone(&command.borrow());
        self.0.plant.0.tell_command(&view, Some(&before));
        command.send_replace(view);
    }

    /// Tells what has changed, for as long as it is polled.
    async fn tell_changes(&self, command: &Command) {
        loop {
            self.0.changed.notified().await;
            let parts = u32::try_from(self.members().len()).unwrap_or(u32::MAX);
            sleep(TOGETHER.max(EACH.saturating_mul(parts))).await;
            // What ended meanwhile was told with the end.
            if self.0.is_untold.load(Ordering::SeqCst) {
                self.tell(command);
            }
        }
    }

    fn post(&self) -> Posted {
        let Inner { request, group, .. } = &*self.0;
        match (request.action, &request.target) {
            (Action::Start { .. }, Target::Group(_) | Target::All) => Posted::Nothing,
            (Action::Setpoint { setpoint, .. }, Target::Group(_) | Target::All) => {
                Posted::SetpointOfSeveral(group.set_setpoint(setpoint))
            }
            (action, _) => {
                let order = |member: &DriveHandle| {
                    let order = order(action)?;
                    Some(match request.lifetime {
                        Lifetime::Usual(time) => member.order_since(order, request.arrived, time),
                        Lifetime::Said(time) => member.order_until(order, request.arrived + time),
                    })
                };
                Posted::Orders(group.members().iter().filter_map(order).collect())
            }
        }
    }

    async fn work(&self, posted: Posted) {
        match posted {
            Posted::Stop(stop) => self.stopped(0, &stop).await,
            Posted::StopOfSeveral(stops) => {
                let each = stops.each().iter();
                let each = each.filter_map(|(name, stop)| Some((*self.0.numbers.get(name)?, stop)));
                join_all(each.map(|(number, stop)| self.stopped(number, stop))).await;
            }
            Posted::SetpointOfSeveral(given) => {
                for (name, outcome) in given.await {
                    self.end_of(&name, &outcome);
                }
            }
            Posted::Orders(orders) => {
                let orders = orders.into_iter().enumerate();
                join_all(orders.map(async |(number, order)| {
                    let outcome = tokio::select! {
                        biased;
                        outcome = order.finished() => outcome,
                        () = self.0.heard.ends() => heard_by_nobody(order).await,
                    };
                    self.end(number, &outcome);
                }))
                .await;
            }
            Posted::Nothing => {
                let Inner { plant, request, heard, .. } = &*self.0;
                let expires = request.arrived + request.lifetime.time();
                let turn = tokio::select! {
                    biased;
                    () = heard.ends() => return self.end_each(&Outcome::Refused(Refused::Withdrawn)),
                    turn = timeout_at(expires, plant.0.group_starts.lock()) => turn,
                };
                let Ok(_turn) = turn else {
                    let text = "another start of a group was under way";
                    return self.end_all(OutcomeWord::Expired, GROUP_BUSY, text);
                };
                self.start_group().await;
            }
        }
    }

    async fn stopped(&self, number: usize, stop: &StopTicket) {
        let Some(member) = self.members().get(number) else { return };
        let outcome = finished(stop, member, || self.undone(number)).await;
        self.end(number, &outcome);
    }

    /// A run command has come behind a stop that goes on.
    fn undone(&self, number: usize) {
        if let Some(part) = self.parts().get_mut(number).map(Arc::make_mut) {
            let times = part.restarts.unwrap_or(0) + 1;
            (part.restarts, part.text) = (Some(times), Some(UNDONE.to_owned()));
            if times == 1 {
                tracing::warn!("{}: {}: {UNDONE}", part.drive.as_deref().unwrap_or_default(), part.command);
            }
        }
        self.note_change();
    }

    fn note_change(&self) {
        self.0.is_untold.store(true, Ordering::SeqCst);
        self.0.changed.notify_one();
    }

    async fn start_group(&self) {
        let Action::Start { direction, setpoint, until } = self.0.request.action else { return };
        let start = GroupStart { direction, setpoint, spacing: Duration::ZERO, until };
        match self.0.group.start(start).await {
            Ok(started) => {
                for (name, outcome) in started {
                    self.end_of(&name, &outcome);
                }
            }
            Err(GroupFailure::NotReady(reasons)) => {
                for (name, refused) in reasons {
                    self.end_of(&name, &Outcome::Refused(refused));
                }
                let text = "nobody of the group was started: another of its drives was not ready";
                self.end_all(OutcomeWord::Refused, GROUP_NOT_READY, text);
            }
            Err(GroupFailure::Abandoned(outcomes)) => {
                for (name, outcome) in outcomes {
                    self.end_of(&name, &outcome);
                }
            }
            Err(GroupFailure::Failed { outcomes, stopped }) => {
                for (name, outcome) in outcomes {
                    self.end_of(&name, &outcome);
                }
                let text = match stopped == StopReport::default() {
                    true => {
                        "nobody of the group was started, because not all of its drives took the setpoint"
                    }
                    false => "the group was stopped again, because not all of its drives started",
                };
                self.end_all(OutcomeWord::Superseded, GROUP_FAILED, text);
            }
        }
    }

    /// Waits until what is not known is.
    async fn settle(&self) {
        let open: Vec<bool> = self.parts().iter().map(|part| part.open).collect();
        let open = self.members().iter().enumerate().zip(open).filter(|(_, is_open)| *is_open);
        let each = open.map(|((number, member), _)| async move {
            let ended = Instant::now();
            if let Some(outcome) = settled(self.0.request.action, member, ended).await {
                self.end_as(number, outcome, None, None);
            }
        });
        join_all(each).await;
    }

    /// Whether it may still turn out what became of a part.
    fn is_open(&self) -> bool {
        self.parts().iter().any(|part| part.open)
    }

    fn end_of(&self, name: &str, outcome: &Outcome) {
        if let Some(number) = self.0.numbers.get(name) {
            self.end(*number, outcome);
        }
    }

    fn end(&self, number: usize, outcome: &Outcome) {
        self.end_with(number, Some(outcome), told(outcome));
    }

    fn end_each(&self, outcome: &Outcome) {
        (0..self.members().len()).for_each(|number| self.end(number, outcome));
    }

    /// Ends what has no outcome of its own.
    fn end_all(&self, word: OutcomeWord, reason: &'static str, text: &str) {
        for number in 0..self.members().len() {
            let outcome = self.parts().get(number).map(|part| part.outcome);
            if outcome == Some(OutcomeWord::Pending) {
                self.end_as(number, word, Some(reason), Some(text.to_owned()));
            }
        }
    }

    fn end_as(&self, number: usize, word: OutcomeWord, reason: Option<&'static str>, text: Option<String>) {
        self.end_with(number, None, (word, reason, text));
    }

    fn end_with(
        &self,
        number: usize,
        outcome: Option<&Outcome>,
        (word, reason, text): (OutcomeWord, Option<&'static str>, Option<String>),
    ) {
        let Some(member) = self.members().get(number) else { return };
        let mut parts = self.parts();
        if let Some(part) = parts.get_mut(number).map(Arc::make_mut) {
            let is_first = part.outcome == OutcomeWord::Pending;
            *part = part.clone().ended_as(word, reason, text, member, self.0.request.arrived);
            part.stop = outcome.and_then(Outcome::stop).map(StopModesView::from).or(part.stop.take());
            part.started = outcome.and_then(Outcome::started).or(part.started);
            if is_first {
                let id = self.0.plant.known_as(Kind::Drive, member.name()).id;
                self.0.plant.tally().count(id, part);
            }
        }
        drop(parts);
        self.note_change();
    }
}

impl CommandView {
    /// The same, ended, with what the drive shows now.
    fn ended_as(
        self,
        outcome: OutcomeWord,
        reason: Option<&'static str>,
        text: Option<String>,
        member: &DriveHandle,
        arrived: Instant,
    ) -> Self {
        let now = Instant::now();
        let status = Some(Shown::Live(member.snapshot()));
        let took_ms = Some(milliseconds(now.saturating_duration_since(arrived)));
        // A stop goes on until it is confirmed.
        let open = match outcome {
            OutcomeWord::Pending | OutcomeWord::Unknown => true,
            OutcomeWord::NotConfirmed => self.action == ActionWord::Stop,
            _ => false,
        };
        let undone = self.restarts.map(|_| UNDONE.to_owned());
        let text: Vec<String> = text.into_iter().chain(undone).collect();
        let text = (!text.is_empty()).then(|| text.join("; "));
        Self { outcome, open, reason: reason.map(Cow::from), text, status, took_ms, ..self }
    }
}

/// What becomes of an order whose asker is not heard any more: it goes on where it has begun, and else it never does.
async fn heard_by_nobody(order: Ticket) -> Outcome {
    if order.has_begun() {
        return order.finished().await;
    }
    order.withdraw();
    Outcome::Refused(Refused::Withdrawn)
}

/// What a drive is asked for an action; `None` for a stop, which is no order.
fn order(action: Action) -> Option<Order> {
    Some(match action {
        Action::Start { direction, setpoint, until } => Order::Start { direction, setpoint, until },
        Action::Setpoint { setpoint, until } => Order::Setpoint { setpoint, until },
        Action::Reset => Order::ResetFaults,
        Action::Release => Order::Release,
        Action::Save => Order::Persist,
        Action::Accept(shown) => Order::AcceptIdentity(shown),
        Action::Stop(_) => return None,
    })
}

/// An id that nobody guesses.
fn new_id() -> String {
    let mut bytes = [0; 8];
    // Without randomness the time must do; an id is no secret.
    if getrandom::fill(&mut bytes).is_err() {
        bytes = unix(Instant::now()).to_be_bytes();
    }
    format!("c-{:016x}", u64::from_be_bytes(bytes))
}

#[cfg(test)]
mod tests;
