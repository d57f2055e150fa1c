//! What hosts write, judged before the plant hears of it.
//!
//! A write has no id, no expiry and no answer of its own. So a setpoint is a level, motion is asked for by an object in
//! `Control/Command`, and what becomes of either stands in `Control/LastCommand/…`. The time of the payload says how old
//! it is: what is too old, retained or of an unknown age moves no motor. A stop is taken whatever it looks like.

use std::{collections::HashMap, sync::Arc, time::Duration};

use drive_core::StopMode;
use drive_sparkplug::{Command, Value, Write, WriteError};
use serde_json::{Map, Value as Json, json};
use tokio::{
    sync::{Semaphore, mpsc, watch},
    time::{Instant, timeout},
};

use super::metrics::{COMMAND, SETPOINT, SPEED_SETPOINT};
use crate::{
    broker::Arrived,
    config::SparkplugConfig,
    doors::{
        Caller, Rights, Role,
        audit::{Audit, Kind, Record},
    },
    json::{milliseconds, unix},
    mqtt::{Pace, SAME_STOP, is_id, is_open},
    plant::{
        Plant,
        commands::{Action, Asked, LIFETIME, OutcomeWord, Rejected, Request, Target, Told},
        views::CommandView,
    },
};

/// Who asks: hosts do not say who they are.
const CALLER: &str = "sparkplug";
/// Commands that wait for the audit log.
const WAITING: usize = 64;
/// Commands whose outcome is waited for.
const FOLLOWED: usize = 256;
/// For how long an outcome may still be settled.
const SETTLES_FOR: Duration = Duration::from_secs(600);
/// How far the clock of a host may be ahead.
const AHEAD: Duration = Duration::from_secs(1);

/// What takes commands.
pub(super) struct Commanding {
    judge: Arc<Judge>,
    orders: mpsc::Sender<Order>,
    closing: watch::Receiver<bool>,
    /// How old a command may be that does not say so itself.
    lifetime: Duration,
    pace: Pace,
    /// The last stop of each drive.
    stopped: HashMap<String, (StopMode, Instant)>,
}

/// What carries them out.
struct Judge {
    plant: Plant,
    audit: Audit,
    caller: Caller,
    followed: Arc<Semaphore>,
    /// What became of the last command of a drive.
    outcomes: mpsc::Sender<(String, Json)>,
}

/// A command that waits for its record in the audit log.
struct Order {
    drive: String,
    request: Request,
    record: Record,
}

/// Why nothing is done.
struct Refusal {
    id: Option<String>,
    outcome: OutcomeWord,
    reason: &'static str,
    text: String,
}

impl Commanding {
    pub(super) fn new(
        config: &SparkplugConfig,
        plant: Plant,
        audit: Audit,
        closing: watch::Receiver<bool>,
        outcomes: mpsc::Sender<(String, Json)>,
    ) -> Self {
        let rights = config.commands.map_or(Rights::NONE, Role::rights);
        let origin = format!("sparkplug {}", config.name.group);
        let caller = Caller { name: CALLER.to_owned(), origin, rights };
        let followed = Arc::new(Semaphore::new(FOLLOWED));
        let judge = Arc::new(Judge { plant, audit, caller, followed, outcomes });
        let (orders, waiting) = mpsc::channel(WAITING);
        tokio::spawn(Arc::clone(&judge).work(waiting));
        let (pace, stopped) = (Pace::new(Instant::now()), HashMap::new());
        Self { judge, orders, closing, lifetime: config.lifetime, pace, stopped }
    }

    /// Takes what a host writes, one metric after the other. `is_alive`: the births have been told, so that the host can know
    /// what it writes.
    pub(super) fn handle(&mut self, command: Command, arrived: &Arrived, is_alive: bool) {
        let Command { device, timestamp, is_retained, writes } = command;
        let Some(drive) = device.map(|device| device.as_str().to_owned()) else {
            tracing::debug!("Sparkplug: {}: no metric of the node can be written", arrived.topic);
            return;
        };
        for write in writes {
            let in_time = self.pace.allows(arrived.at);
            if let Ok(Write { name, value: Value::String(text) }) = &write
                && name == COMMAND
                && let Some((id, mode)) = stop(text)
            {
                let last = self.stopped.get(&drive);
                let is_new = last.is_none_or(|(same, at)| *same != mode || arrived.at >= *at + SAME_STOP);
                if in_time || is_new {
                    self.stopped.insert(drive.clone(), (mode, arrived.at));
                    self.judge.stop(drive.clone(), id, mode, self.judge.record(&write, arrived), arrived.at);
                }
                continue;
            }
            if !in_time {
                // Nothing of a flood reaches the audit log, which is there for everybody.
                continue;
            }
            self.stopped.remove(&drive);
            let record = self.judge.record(&write, arrived);
            let asked = match write {
                Ok(write) => self.asked(&drive, write, timestamp, [is_retained, is_alive], arrived),
                Err(error) => Err(refusal("malformed", error.to_string())),
            };
            match asked {
                Ok(request) => {
                    let id = request.id.clone();
                    let order = Order { drive: drive.clone(), request, record: record.clone() };
                    if self.orders.try_send(order).is_err() {
                        let refused =
                            Refusal { id, ..refusal("busy", "too many commands are waiting".to_owned()) };
                        self.judge.refuse(&drive, record, refused);
                    }
                }
                Err(refused) => self.judge.refuse(&drive, record, refused),
            }
        }
    }

    /// What a write asks for.
    fn asked(
        &self,
        drive: &str,
        write: Write,
        timestamp: Option<u64>,
        [is_retained, is_alive]: [bool; 2],
        arrived: &Arrived,
    ) -> Result<Request, Refusal> {
        let asked = match (write.name.as_str(), &write.value) {
            (COMMAND, Value::String(text)) => object(text),
            (SETPOINT, Value::Double(hertz)) => setpoint("frequency_hz", *hertz),
            (SPEED_SETPOINT, Value::Double(rpm)) => setpoint("speed_rpm", *rpm),
            _ => Err(refusal("read_only", format!("{} cannot be written", write.name))),
        };
        let asked = asked?;
        let id = asked.id.clone();
        let refuse = |reason, text: &str| Err(Refusal { id: id.clone(), ..refusal(reason, text.to_owned()) });
        if is_retained {
            return refuse("retained", "it is retained: a broker would send it again and again");
        }
        if !is_alive {
            return refuse("not_born", "the births have not been told: nobody can know what it writes");
        }
        if *self.closing.borrow() {
            return refuse("closing", "the daemon is about to end");
        }
        let says_itself = asked.expires_in_ms.is_some();
        let mut request = match asked.of(Target::Drive(drive.to_owned()), arrived.at) {
            Ok(request) => request,
            Err(text) => return refuse("malformed", &text),
        };
        if write.name == COMMAND && request.id.is_none() {
            return refuse("id_needed", "expected an id, by which its outcome is found");
        }
        if !says_itself {
            request.lifetime = self.lifetime;
        }
        let Some(sent) = timestamp else {
            return refuse("malformed", "its payload has no timestamp: its age is not known");
        };
        let now = unix(arrived.at);
        if sent.saturating_sub(now) > milliseconds(AHEAD) {
            let text = format!("it was sent {} ms in the future: the clocks differ", sent - now);
            return refuse("malformed", &text);
        }
        let age = Duration::from_millis(now.saturating_sub(sent));
        if age >= request.lifetime {
            let text = format!("it is {age:?} old, and was to be carried out within {:?}", request.lifetime);
            return Err(Refusal { id, outcome: OutcomeWord::Expired, reason: "expired", text });
        }
        // Its time has run since it was sent; and the same command is the same again, whenever it comes.
        request.arrived = arrived.at.checked_sub(age).unwrap_or(arrived.at);
        Ok(request)
    }
}

impl Judge {
    /// What stands in the audit log of a write.
    fn record(&self, write: &Result<Write, WriteError>, arrived: &Arrived) -> Record {
        let body = match write {
            Ok(Write { name, value: Value::String(text) }) => json!({ name: text }),
            Ok(Write { name, value: Value::Double(number) }) => json!({ name: number }),
            Ok(Write { name, .. }) => json!(name),
            Err(error) => json!(error.to_string()),
        };
        let record = Record::new(Kind::Command, &self.caller, format!("MQTT {}", arrived.topic));
        Record { body: Some(body), ..record }
    }

    /// Stops at once: no disk and no other command holds it up.
    fn stop(&self, drive: String, id: Option<String>, mode: StopMode, record: Record, arrived: Instant) {
        self.audit.record(record.clone()).whenever();
        let target = Target::Drive(drive.clone());
        let request = Request { id, target, action: Action::Stop(mode), lifetime: LIFETIME, arrived };
        let begun = self.plant.begin(&self.caller, request);
        self.begun(drive, None, begun, record);
    }

    /// Carries out what waits, one after the other, when it stands in the audit log.
    async fn work(self: Arc<Self>, mut orders: mpsc::Receiver<Order>) {
        while let Some(Order { drive, request, record }) = orders.recv().await {
            let id = request.id.clone();
            if let Err(error) = self.audit.record(record.clone()).done().await {
                let text = format!("{error}: until it can, only stops are carried out");
                self.refuse(&drive, record, Refusal { id, ..refusal("audit", text) });
                continue;
            }
            let begun = self.plant.begin(&self.caller, request);
            self.begun(drive.clone(), id, begun, record);
        }
    }

    fn begun(&self, drive: String, id: Option<String>, begun: Result<Told, Rejected>, record: Record) {
        let mut told = match begun {
            Ok(told) => told,
            Err(rejected) => {
                let (outcome, reason) = rejected.told();
                let refused = Refusal { id, outcome, reason, text: rejected.to_string() };
                return self.answered(&drive, record, answer_of(&refused));
            }
        };
        let view = Arc::clone(&told.borrow_and_update());
        self.answered(&drive, record, outcome_of(&view));
        if !is_open(&view) {
            return;
        }
        // Of so many that their outcomes are not waited for, they stand in the audit log.
        let Ok(permit) = Arc::clone(&self.followed).try_acquire_owned() else { return };
        let outcomes = self.outcomes.clone();
        tokio::spawn(async move {
            let mut last = view;
            while is_open(&last) && matches!(timeout(SETTLES_FOR, told.changed()).await, Ok(Ok(()))) {
                let view = Arc::clone(&told.borrow_and_update());
                if view.outcome != last.outcome {
                    // Nobody waits for the face: an outcome that finds no room stands in the audit log.
                    let _ = outcomes.try_send((drive.clone(), outcome_of(&view)));
                }
                last = view;
            }
            drop(permit);
        });
    }

    fn refuse(&self, drive: &str, record: Record, refused: Refusal) {
        self.audit.record(record.clone()).whenever();
        self.answered(drive, record, answer_of(&refused));
    }

    /// Answers for the first time, and keeps that in the audit log.
    fn answered(&self, drive: &str, record: Record, said: Json) {
        let text = |key: &str| said.get(key).and_then(Json::as_str).map(str::to_owned);
        let (id, outcome) = (text("id"), text("outcome"));
        let answer = Record { id, outcome, ..Record::new(Kind::Answer, &self.caller, record.what) };
        self.audit.record(answer).whenever();
        let _ = self.outcomes.try_send((drive.to_owned(), said));
    }
}

/// The id and the mode of a text that is a stop, whatever else it says.
fn stop(text: &str) -> Option<(Option<String>, StopMode)> {
    if text.trim() == "stop" {
        return Some((None, StopMode::Ramp));
    }
    let Ok(Json::Object(mut members)) = serde_json::from_str::<Json>(text) else { return None };
    members.remove("action").filter(|action| action == "stop")?;
    let id = members.get("id").and_then(Json::as_str).filter(|id| is_id(id)).map(str::to_owned);
    match Asked::named("stop", members) {
        Ok(Asked { action: Action::Stop(mode), .. }) => Some((id, mode)),
        _ => Some((id, StopMode::Ramp)),
    }
}

/// What an object in JSON asks for: the body of the API, and `action` beside it.
fn object(text: &str) -> Result<Asked, Refusal> {
    let Ok(Json::Object(mut members)) = serde_json::from_str(text) else {
        return Err(refusal("malformed", "expected an object in JSON with \"action\"".to_owned()));
    };
    let id = members.get("id").and_then(Json::as_str).filter(|id| is_id(id)).map(str::to_owned);
    let action = members.remove("action");
    let asked = match action.as_ref().and_then(Json::as_str) {
        Some(action) => Asked::named(action, members),
        None => Err("expected \"action\"".to_owned()),
    };
    asked.map_err(|text| Refusal { id, ..refusal("malformed", text) })
}

fn setpoint(unit: &str, number: f64) -> Result<Asked, Refusal> {
    let members = Map::from_iter([("setpoint".to_owned(), json!({ unit: number }))]);
    Asked::named("setpoint", members).map_err(|text| refusal("malformed", text))
}

fn refusal(reason: &'static str, text: String) -> Refusal {
    Refusal { id: None, outcome: OutcomeWord::Refused, reason, text }
}

fn answer_of(refused: &Refusal) -> Json {
    let Refusal { id, outcome, reason, text } = refused;
    json!({ "id": id, "outcome": outcome, "reason": reason, "text": text, "time_unix_ms": unix(Instant::now()) })
}

/// A command as it is told here; its time is when it is told.
fn outcome_of(view: &CommandView) -> Json {
    let CommandView { id, outcome, reason, text, .. } = view;
    json!({
        "id": id, "outcome": outcome, "reason": reason, "text": text, "time_unix_ms": unix(Instant::now()),
    })
}
