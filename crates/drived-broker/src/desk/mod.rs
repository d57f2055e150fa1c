//! One desk that takes commands for every broker: what a message says is judged here, once, before the plant hears of it.
//!
//! A broker says neither that a message is young nor that it comes once. So what is retained, late, old or repeated moves no
//! motor, and a stop is taken whatever it looks like. Commands are carried out in the order in which they come, each when it
//! stands in the audit log, except that a stop waits for nothing.

mod alarms;
mod alarms_answer;
mod counter;
mod lately;
mod pace;
mod refusal;
#[cfg(test)]
pub mod testing;

use std::{collections::HashMap, sync::Arc, time::Duration};

use drive_fleet::StopOrder;
use serde_json::Value;
use tokio::{
    sync::{mpsc, watch},
    time::Instant,
};

pub use self::{
    alarms::AlarmMessage,
    alarms_answer::AlarmsAnswer,
    refusal::{Refusal, Refused},
};
use self::{
    counter::{Counter, Named, Order},
    pace::Pace,
};
use drived_config::rights::Heard;
use drived_doors::{
    Caller,
    audit::{Audit, Kind, Record},
};
use drived_plant::plant::{
    Plant,
    commands::{Action, Asked, LIFETIME, LONGEST_LIFETIME, Lifetime, Request, Said, Target, age::age_of},
    views::CommandView,
};

/// Commands that wait for the audit log.
const WAITING: usize = 64;
/// In a flood, a stop that comes so soon after the same one has nothing to add.
const SAME_STOP: Duration = Duration::from_millis(50);

/// Where it is told what becomes of a message.
pub trait Answers: Clone + Send + 'static {
    /// Tells it. Nobody waits for it.
    fn tell(&self, answer: Answer<'_>);
}

/// What becomes of a message.
#[derive(Debug, Clone, Copy)]
pub enum Answer<'a> {
    Command(&'a CommandView),
    Alarms(&'a AlarmsAnswer),
    Refused(&'a Refused),
}

/// A message, as a broker's face has it.
pub struct Message<A> {
    pub said: Said,
    pub caller: Caller,
    /// Whose pace it comes at.
    pub pace_of: String,
    /// Whom it means; `None`: nobody of this plant.
    pub target: Option<Target>,
    /// What the face itself has against it, unless it is a stop.
    pub doubt: Option<Refusal>,
    pub arrived: Instant,
    /// Since when it may have been on its way, where its broker may keep it: a stop by another door since then goes before it.
    pub asked_after: Option<Instant>,
    /// When it was sent, by the clock of its sender.
    pub sent_unix_ms: Option<u64>,
    /// How long it may wait unless it says so itself, and at the longest in any case.
    pub lifetime: Lifetime,
    pub longest: Option<Duration>,
    /// It may come again, so that it has to have a name.
    pub needs_id: bool,
    /// A start and a setpoint have to say when they were issued.
    pub needs_issued: bool,
    /// Its name, where it says none.
    pub id: Option<String>,
    /// For the audit log.
    pub what: String,
    pub answers: A,
}

/// What takes commands.
pub struct Desk<A> {
    counter: Arc<Counter>,
    orders: mpsc::Sender<Order<A>>,
    /// How fast each may come.
    paces: HashMap<String, Pace>,
    /// When each target was last stopped so.
    stopped: HashMap<(Target, StopOrder), Instant>,
    /// As long as it is there those are heard who come here: behind a reload another one takes its place, with what they may do then.
    open: watch::Sender<()>,
}

impl<A: Answers + Sync> Desk<A> {
    /// Takes commands until it is dropped.
    pub fn open(plant: Plant, audit: Audit) -> Self {
        let (orders, waiting) = mpsc::channel(WAITING);
        let counter = Arc::new(Counter::new(plant, audit));
        tokio::spawn(Arc::clone(&counter).work(waiting));
        Self {
            counter,
            orders,
            paces: HashMap::new(),
            stopped: HashMap::new(),
            open: watch::Sender::default(),
        }
    }

    /// Takes a message.
    pub fn take(&mut self, mut message: Message<A>) {
        let stop = message.said.stops();
        let in_time = self.is_in_time(std::mem::take(&mut message.pace_of), message.arrived);
        if !in_time && drive_fleet::mutant!("stop-lost-in-a-flood", stop.is_none(), true) {
            // Nothing of a flood reaches the audit log, which is there for everybody.
            return;
        }
        let record = self.record(&message);
        let id = message.said.id.clone().or_else(|| message.id.clone());
        let mut named = Named { id: id.clone(), action: message.said.action, drive: None };
        let Message { caller, answers, arrived, .. } = &message;
        let (caller, answers, arrived) = (caller.clone(), answers.clone(), *arrived);
        let Some(target) = message.target.take() else {
            return self.counter.refuse(&caller, record, &answers, named, Refusal::NotFound);
        };
        named.drive = counter::drive_of(&target);
        let is_doubted = drive_fleet::mutant!("stop-of-a-broker-is-doubted", false, message.doubt.is_some());
        let waits = drive_fleet::mutant!("stop-of-a-broker-waits-for-the-disk", false, true);
        if let Some(order) = stop.filter(|_| !is_doubted && !waits) {
            let key = (target.clone(), order);
            if !in_time && self.stopped.get(&key).is_some_and(|at| arrived < *at + SAME_STOP) {
                return;
            }
            self.stopped.insert(key, arrived);
            let expects = message.said.expects();
            let request = Request {
                id: named.id,
                target,
                action: Action::Stop(order),
                expects,
                lifetime: LIFETIME,
                arrived,
            };
            return self.counter.stop(&caller, request, record, &answers);
        }
        self.stopped.clear();
        let asked_after = message.asked_after;
        let request = match self.judged(message, target, id) {
            Ok(request) => request,
            Err(refusal) => return self.counter.refuse(&caller, record, &answers, named, refusal),
        };
        let (audited, to) = (record.clone(), answers.clone());
        let asked_after = asked_after.map_or(request.arrived, |after| after.min(request.arrived));
        let open = self.open.subscribe();
        let caller = Caller { heard: Heard::until(move || ended(open.clone())), ..caller };
        let order =
            Order::Command { caller: caller.clone(), request, asked_after, record: audited, answers: to };
        if self.orders.try_send(order).is_err() {
            self.counter.refuse(&caller, record, &answers, named, Refusal::Busy);
        }
    }

    /// Whether somebody keeps the pace that everybody has.
    fn is_in_time(&mut self, pace_of: String, arrived: Instant) -> bool {
        self.paces.entry(pace_of).or_insert_with(|| Pace::new(arrived)).allows(arrived)
    }

    /// What a message that is no stop asks for.
    fn judged(&self, message: Message<A>, target: Target, id: Option<String>) -> Result<Request, Refusal> {
        if let Some(doubt) = message.doubt {
            return Err(doubt);
        }
        let asked = message.said.asked?;
        if drive_fleet::mutant!("all-are-commanded", target == Target::All, false) {
            return Err(Refusal::malformed("all drives can be stopped together, and nothing else"));
        }
        let (says_itself, issued) = (asked.expires_in_ms.is_some(), asked.issued_unix_ms);
        let asked = Asked { id, ..asked };
        let mut request = asked.of(target, message.arrived).map_err(Refusal::malformed)?;
        let longest = message.longest.map(|longest| longest.min(LONGEST_LIFETIME));
        request.lifetime = match (says_itself, longest) {
            (true, Some(longest)) => Lifetime::Said(request.lifetime.time().min(longest)),
            (true, None) => request.lifetime,
            (false, Some(longest)) => Lifetime::Said(longest),
            (false, None) => message.lifetime,
        };
        let is_undated = issued.is_none() && message.sent_unix_ms.is_none();
        if drive_fleet::mutant!("undated-command-moves", message.needs_issued, false)
            && is_undated
            && matches!(request.action, Action::Start { .. } | Action::Setpoint { .. })
        {
            return Err(Refusal::IssuedNeeded);
        }
        // Its time has run since it was sent; and the same command is the same again, whenever it comes.
        let age = age_of(
            [message.sent_unix_ms, issued],
            message.arrived,
            request.lifetime.time(),
            self.counter.clock_set_back(),
        )?;
        request.arrived = request.arrived.checked_sub(age).unwrap_or(request.arrived);
        // While it waits for the audit log, the name may become another motor's.
        request.expects = request.expects.or_else(|| self.counter.as_it_is(&request.target));
        if drive_fleet::mutant!("nameless-command-moves", message.needs_id, false) && request.id.is_none() {
            return Err(Refusal::IdNeeded);
        }
        Ok(request)
    }

    /// What stands in the audit log of a message.
    fn record(&self, message: &Message<A>) -> Record {
        let body = Some(message.said.body.clone()).filter(|body| *body != Value::Null);
        Record { body, ..Record::new(Kind::Command, &message.caller, message.what.clone()) }
    }
}
/// Until the desk is dropped.
async fn ended(mut open: watch::Receiver<()>) {
    while open.changed().await.is_ok() {}
}
