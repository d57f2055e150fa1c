//! What is asked through the broker, judged before the plant hears of it.
//!
//! MQTT says neither who sent a message nor that it comes once. So the last level of the topic names who asks, for the
//! broker's access list to vouch for; what is retained, late or repeated moves no motor; and a stop is taken whatever it
//! looks like. Commands are carried out in the order in which they come, except that a stop waits for nothing.

use std::{
    collections::{HashMap, VecDeque},
    sync::Arc,
    time::Duration,
};

use drive_core::{Direction, Setpoint, StopMode};
use serde_json::{Map, Value, json};
use tokio::{
    sync::{Semaphore, mpsc, watch},
    time::{Instant, timeout},
};

use super::{
    Face,
    pace::Pace,
    topics::{Asking, Meant, Verb, topic_id},
};
use crate::{
    broker::{Arrived, Kept, Message, Qos},
    doors::{
        Caller, Rights, Role,
        audit::{Audit, Kind, Record},
    },
    json::unix,
    plant::{
        commands::{Action, Asked, LIFETIME, LONGEST_LIFETIME, OutcomeWord, Rejected, Request, Target, Told},
        views::CommandView,
    },
};

/// Who asks where the topic names nobody.
const NAMELESS: &str = "mqtt";
/// Commands that wait for the audit log.
const WAITING: usize = 64;
/// Commands whose outcome is waited for.
const FOLLOWED: usize = 256;
/// For how long an outcome may still be settled, and an answer waits for a broker that is away.
const SETTLES_FOR: Duration = Duration::from_secs(600);
/// A command that may have been on its way from the broker for longer is late.
const LATE: Duration = Duration::from_secs(3);
/// Calls of the daemon to itself that may be under way.
const CALLS: usize = 30;
/// In a flood, a stop that comes so soon after the same one has nothing to add.
pub(crate) const SAME_STOP: Duration = Duration::from_millis(50);

/// Where the answers to a message go.
#[derive(Debug, Clone)]
struct Answers {
    outcome: String,
    response: Option<String>,
    correlation: Option<axum::body::Bytes>,
}

/// The id and the action of a message, as far as they are known.
type Named = (Option<String>, Option<String>);

/// A command that waits for its record in the audit log.
struct Order {
    caller: Caller,
    request: Request,
    record: Record,
    answers: Answers,
}

/// What takes commands.
pub(super) struct Commanding {
    judge: Arc<Judge>,
    orders: mpsc::Sender<Order>,
    /// How fast each commander may come; those whom the configuration does not name, together.
    paces: HashMap<String, Pace>,
    /// When each target was last stopped by each mode.
    stopped: HashMap<(Meant, StopMode), Instant>,
    /// The calls that have not come back, the oldest first.
    calls: VecDeque<(u64, Instant)>,
    called: u64,
    /// When the last call was made that has come back: what comes after it was sent after that.
    sent_after: Option<Instant>,
}

/// What carries them out.
struct Judge {
    face: Arc<Face>,
    audit: Audit,
    closing: watch::Receiver<bool>,
    followed: Arc<Semaphore>,
}

impl Commanding {
    pub(super) fn new(face: Arc<Face>, audit: Audit, closing: watch::Receiver<bool>) -> Self {
        let (orders, waiting) = mpsc::channel(WAITING);
        let followed = Arc::new(Semaphore::new(FOLLOWED));
        let judge = Arc::new(Judge { face, audit, closing, followed });
        tokio::spawn(Arc::clone(&judge).work(waiting));
        Self {
            judge,
            orders,
            paces: HashMap::new(),
            stopped: HashMap::new(),
            calls: VecDeque::new(),
            called: 0,
            sent_after: None,
        }
    }

    /// There is a new connection, which has proved nothing yet.
    pub(super) fn connected(&mut self) {
        self.calls.clear();
        self.sent_after = None;
        self.call();
    }

    /// Says something to itself over the broker. A broker delivers in order, so that a command behind it is younger.
    pub(super) fn call(&mut self) {
        let face = &self.judge.face;
        if !face.config.commands {
            return;
        }
        let now = Instant::now();
        self.called += 1;
        let mut call = Message::new(face.topics.echo(), self.called.to_string());
        call.expires = Some(now + LATE);
        if face.broker.publish(call, Kept::Latest) {
            self.calls.push_back((self.called, now));
            self.calls.drain(..self.calls.len().saturating_sub(CALLS));
        }
    }

    /// A call has come back.
    fn echoed(&mut self, arrived: &Arrived) {
        let number = std::str::from_utf8(&arrived.payload).ok().and_then(|text| text.parse::<u64>().ok());
        let at = self.calls.iter().position(|(call, _)| Some(*call) == number);
        if let Some((_, made)) = at.and_then(|at| self.calls.drain(..=at).next_back()) {
            self.sent_after = Some(made);
        }
    }

    /// Whether nobody can say that it was sent a moment ago.
    fn is_late(&self, arrived: &Arrived) -> bool {
        self.sent_after.is_none_or(|sent| arrived.at.saturating_duration_since(sent) > LATE)
    }

    /// Takes what has arrived.
    pub(super) fn handle(&mut self, arrived: &Arrived) {
        let face = Arc::clone(&self.judge.face);
        if arrived.topic == face.topics.echo() {
            return self.echoed(arrived);
        }
        let Some(asking) = face.topics.asked(&arrived.topic) else { return };
        let said = Said::of(asking.verb, &arrived.payload);
        let named = asking.commander.clone().filter(|name| face.config.commanders.contains_key(name));
        let pace = self.paces.entry(named.unwrap_or_default()).or_insert_with(|| Pace::new(arrived.at));
        let (is_stop, in_time) = (said.is_stop(), pace.allows(arrived.at));
        if !(in_time || is_stop) {
            return;
        }
        let caller = caller(&face, &asking);
        let answers = Answers {
            outcome: face.topics.outcome(&asking.meant),
            response: arrived.properties.response_topic.clone().filter(|topic| face.topics.is_foreign(topic)),
            correlation: arrived.properties.correlation.clone(),
        };
        let record = Record {
            body: Some(said.body.clone()),
            ..Record::new(Kind::Command, &caller, format!("MQTT {}", arrived.topic))
        };
        let named: Named = (said.id.clone(), said.action.clone());
        let refuse = |reason, text: &str| {
            self.judge.refuse(&caller, record.clone(), &answers, &named, reason, text);
        };
        let Some(target) = target(&face, &asking.meant) else {
            return refuse("not_found", "there is none of this name");
        };
        if is_stop {
            let mode = said.mode();
            let id = said.id.clone();
            let key = (asking.meant, mode);
            if !in_time && self.stopped.get(&key).is_some_and(|at| arrived.at < *at + SAME_STOP) {
                return;
            }
            self.stopped.insert(key, arrived.at);
            let action = Action::Stop(mode);
            let request = Request { id, target, action, lifetime: LIFETIME, arrived: arrived.at };
            return self.judge.stop(&caller, request, record, &answers);
        }
        self.stopped.clear();
        if arrived.retain {
            let text = "it is retained: the broker would send it again and again; publish it without the retain flag";
            return refuse("retained", text);
        }
        if self.is_late(arrived) {
            let text = "the connection to the broker has stalled, and nobody can say how old it is";
            return refuse("late", text);
        }
        if *self.judge.closing.borrow() {
            return refuse("closing", "the daemon is about to end");
        }
        let request = match said.asked.and_then(|asked| requested(asked, target, arrived)) {
            Ok(request) => request,
            Err(text) => return refuse("malformed", &text),
        };
        if request.id.is_none() && (arrived.repeated || arrived.qos == Qos::AtLeastOnce) {
            let text = "at QoS 1 and 2 a message may come again when nobody expects it: expected an id, Correlation \
                        Data, or QoS 0";
            return refuse("id_needed", text);
        }
        let order =
            Order { caller: caller.clone(), request, record: record.clone(), answers: answers.clone() };
        if self.orders.try_send(order).is_err() {
            refuse("busy", "too many commands are waiting");
        }
    }
}

impl Judge {
    /// Stops at once: no disk and no other command holds it up.
    fn stop(&self, caller: &Caller, request: Request, record: Record, answers: &Answers) {
        self.audit.record(record.clone()).whenever();
        let named = (request.id.clone(), Some("stop".to_owned()));
        let begun = self.face.plant.begin(caller, request);
        self.begun(caller, begun, record, answers, &named);
    }

    /// Carries out what waits, one after the other, when it stands in the audit log.
    async fn work(self: Arc<Self>, mut orders: mpsc::Receiver<Order>) {
        while let Some(Order { caller, request, record, answers }) = orders.recv().await {
            let named = (request.id.clone(), Some(request.action.name().to_owned()));
            if let Err(error) = self.audit.record(record.clone()).done().await {
                let text = format!("{error}: until it can, only stops are carried out");
                self.refuse(&caller, record, &answers, &named, "audit", &text);
                continue;
            }
            let begun = self.face.plant.begin(&caller, request);
            self.begun(&caller, begun, record, &answers, &named);
        }
    }

    fn begun(
        &self,
        caller: &Caller,
        begun: Result<Told, Rejected>,
        record: Record,
        answers: &Answers,
        named: &Named,
    ) {
        let mut told = match begun {
            Ok(told) => told,
            Err(rejected) => {
                let said = refusal(caller, named, rejected.told(), &rejected);
                return self.answered(caller, record, answers, said);
            }
        };
        let view = Arc::clone(&told.borrow_and_update());
        self.answered(caller, record, answers, said(&view));
        if !is_open(&view) {
            return;
        }
        // Of so many that their outcomes are not waited for, they stand in the audit log.
        let Ok(permit) = Arc::clone(&self.followed).try_acquire_owned() else { return };
        let (face, answers) = (Arc::clone(&self.face), answers.clone());
        tokio::spawn(async move {
            let mut last = view;
            while is_open(&last) && matches!(timeout(SETTLES_FOR, told.changed()).await, Ok(Ok(()))) {
                let view = Arc::clone(&told.borrow_and_update());
                if view.outcome != last.outcome {
                    answer(&face, &answers, &said(&view));
                }
                last = view;
            }
            drop(permit);
        });
    }

    fn refuse(
        &self,
        caller: &Caller,
        record: Record,
        answers: &Answers,
        named: &Named,
        reason: &str,
        text: &str,
    ) {
        self.audit.record(record.clone()).whenever();
        let said = refusal(caller, named, (OutcomeWord::Refused, reason), &text);
        self.answered(caller, record, answers, said);
    }

    /// Answers for the first time, and keeps that in the audit log.
    fn answered(&self, caller: &Caller, record: Record, answers: &Answers, said: Value) {
        let text = |key: &str| said.get(key).and_then(Value::as_str).map(str::to_owned);
        let (id, outcome) = (text("id"), text("outcome"));
        self.audit
            .record(Record { id, outcome, ..Record::new(Kind::Answer, caller, record.what) })
            .whenever();
        answer(&self.face, answers, &said);
    }
}

/// What a message says, as far as it can be understood.
struct Said {
    /// For the audit log.
    body: Value,
    action: Option<String>,
    id: Option<String>,
    asked: Result<Asked, String>,
}

impl Said {
    fn of(verb: Verb, payload: &[u8]) -> Self {
        let text = std::str::from_utf8(payload).map(str::trim).unwrap_or_default();
        let words = |action: &str| {
            let asked = plain(verb, text);
            Self { body: Value::from(text), action: Some(action.to_owned()), id: None, asked }
        };
        match verb {
            Verb::Command => Self::of_object(text),
            Verb::Stop if text.starts_with('{') => {
                let said = Self::of_object(text);
                Self { action: Some("stop".to_owned()), ..said }
            }
            Verb::Stop => words("stop"),
            Verb::Run if text == "stop" => words("stop"),
            Verb::Run => words("start"),
            Verb::Frequency | Verb::Speed => words("setpoint"),
            Verb::Reset => words("reset"),
            Verb::Release => words("release"),
        }
    }

    /// The body of the API, and `action` beside it.
    fn of_object(text: &str) -> Self {
        let body: Value = serde_json::from_str(text).unwrap_or_else(|_| Value::from(text));
        let mut members = body.as_object().cloned().unwrap_or_default();
        let action = members.remove("action").and_then(|action| action.as_str().map(str::to_owned));
        let id = members.get("id").and_then(Value::as_str).map(str::to_owned);
        let issued = members.remove("issued_unix_ms");
        let asked = match (&body, &action) {
            (Value::Object(_), Some(action)) => object(action, members, issued.as_ref()),
            _ => Err("expected an object in JSON with \"action\"".to_owned()),
        };
        Self { body, action, id: id.filter(|id| is_id(id)), asked }
    }

    fn is_stop(&self) -> bool {
        self.action.as_deref() == Some("stop")
    }

    /// How to stop: whatever cannot be understood of a stop, it is one.
    fn mode(&self) -> StopMode {
        let said = self.asked.as_ref().ok().map(|asked| asked.action);
        match said {
            Some(Action::Stop(mode)) => mode,
            _ => StopMode::Ramp,
        }
    }
}

/// What a word asks for.
fn plain(verb: Verb, text: &str) -> Result<Asked, String> {
    let action = match verb {
        Verb::Stop => Action::Stop(serde_json::from_value(Value::from(text)).unwrap_or(StopMode::Ramp)),
        Verb::Run => match text {
            "stop" => Action::Stop(StopMode::Ramp),
            _ => {
                let direction = match text {
                    "forward" => Direction::Forward,
                    "reverse" => Direction::Reverse,
                    _ => return Err("expected forward, reverse or stop".to_owned()),
                };
                Action::Start { direction, setpoint: None, until: drive_fleet::Until::default() }
            }
        },
        Verb::Frequency => setpoint(serde_json::from_str(text).map(Setpoint::Frequency), "hertz")?,
        Verb::Speed => setpoint(serde_json::from_str(text).map(Setpoint::Speed), "rpm")?,
        Verb::Reset => Action::Reset,
        Verb::Release => Action::Release,
        Verb::Command => return Err("expected an object in JSON".to_owned()),
    };
    Ok(Asked { id: None, expires_in_ms: None, action })
}

fn setpoint(read: serde_json::Result<Setpoint>, unit: &str) -> Result<Action, String> {
    let setpoint = read.map_err(|error| format!("expected a number in {unit}: {error}"))?;
    Ok(Action::Setpoint { setpoint, until: drive_fleet::Until::default() })
}

/// What an object asks for, by the types of the API.
fn object(action: &str, members: Map<String, Value>, issued: Option<&Value>) -> Result<Asked, String> {
    let mut asked = Asked::named(action, members)?;
    if let Some(issued) = issued {
        asked.expires_in_ms = Some(left(issued, asked.expires_in_ms)?);
    }
    Ok(asked)
}

/// What is left of the time of a command that says when it was issued.
fn left(issued: &Value, expires_in_ms: Option<u64>) -> Result<u64, String> {
    let issued = issued.as_u64().ok_or("issued_unix_ms: expected milliseconds since 1970")?;
    let (now, lifetime) =
        (unix(Instant::now()), expires_in_ms.unwrap_or(crate::json::milliseconds(LIFETIME)));
    let ahead = issued.saturating_sub(now);
    if ahead > crate::json::milliseconds(LIFETIME) {
        return Err(format!("issued_unix_ms: it is {ahead} ms in the future: the clocks differ"));
    }
    let age = now.saturating_sub(issued);
    match lifetime.checked_sub(age) {
        Some(left @ 1..) => Ok(left),
        _ => Err(format!("it is {age} ms old, and was to be carried out within {lifetime} ms")),
    }
}

/// The request of a message: its expiry is the message's own, what it says itself, or the usual; never more than ten
/// seconds. Without an id, the Correlation Data names it.
fn requested(asked: Asked, target: Target, arrived: &Arrived) -> Result<Request, String> {
    if target == Target::All {
        return Err("all drives can be stopped together, and nothing else".to_owned());
    }
    let says_itself = asked.expires_in_ms.is_some();
    let mut request = asked.of(target, arrived.at)?;
    if let Some(seconds) = arrived.expires_in_s.filter(|seconds| *seconds > 0) {
        let left = Duration::from_secs(seconds.into()).min(LONGEST_LIFETIME);
        request.lifetime = if says_itself { request.lifetime.min(left) } else { left };
    }
    if request.id.is_none() {
        request.id = arrived.properties.correlation.as_deref().map(id_of);
    }
    Ok(request)
}

/// Correlation Data as an id.
fn id_of(correlation: &[u8]) -> String {
    use sha2::{Digest as _, Sha256};
    match std::str::from_utf8(correlation) {
        Ok(text) if is_id(text) => text.to_owned(),
        _ => Sha256::digest(correlation).iter().take(16).map(|byte| format!("{byte:02x}")).collect(),
    }
}

pub(crate) fn is_id(text: &str) -> bool {
    (1..=64).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_graphic())
}

/// Who asks, and what he may do.
fn caller(face: &Face, asking: &Asking) -> Caller {
    let name = asking.commander.clone().unwrap_or_else(|| NAMELESS.to_owned());
    let role = match face.config.commanders.is_empty() {
        true => asking.commander.is_none().then_some(Role::Operate),
        false => face.config.commanders.get(&name).copied(),
    };
    Caller { name, origin: "mqtt".to_owned(), rights: role.map_or(Rights::NONE, Role::rights) }
}

/// The drive or group of an id.
fn target(face: &Face, meant: &Meant) -> Option<Target> {
    match meant {
        Meant::All => Some(Target::All),
        Meant::Drive(id) => {
            let drives = face.plant.fleet().drives();
            let drive = drives.iter().find(|drive| topic_id(drive.name()) == *id)?;
            Some(Target::Drive(drive.name().to_string()))
        }
        Meant::Group(id) => {
            let group = face.plant.groups().into_iter().find(|group| topic_id(&group.name) == *id)?;
            Some(Target::Group(group.name))
        }
    }
}

/// Whether more will be told of it.
pub(crate) fn is_open(view: &CommandView) -> bool {
    match view.outcome {
        OutcomeWord::Pending | OutcomeWord::Unknown => true,
        OutcomeWord::NotConfirmed => view.action == "stop",
        _ => false,
    }
}

/// A command as it is told here: one whose outcome is not known yet is accepted.
fn said(view: &CommandView) -> Value {
    let mut said = json!(view);
    if view.outcome == OutcomeWord::Pending {
        said["outcome"] = "accepted".into();
    }
    said
}

fn refusal(
    caller: &Caller,
    named: &Named,
    (outcome, reason): (OutcomeWord, &str),
    text: &dyn std::fmt::Display,
) -> Value {
    let mut said = json!({
        "outcome": outcome, "reason": reason, "text": text.to_string(),
        "caller": caller.name, "origin": caller.origin, "time_unix_ms": unix(Instant::now()),
    });
    let (id, action) = named;
    for (key, value) in [("id", id), ("action", action)] {
        if let Some(value) = value {
            said[key] = value.as_str().into();
        }
    }
    said
}

/// Publishes an answer: where everybody hears it, and where it was asked for.
fn answer(face: &Face, answers: &Answers, said: &Value) {
    let payload = axum::body::Bytes::from(said.to_string());
    for topic in std::iter::once(&answers.outcome).chain(&answers.response) {
        let mut message = Message::new(topic, payload.clone());
        message.expires = Some(Instant::now() + SETTLES_FOR);
        message.properties.content_type = Some("application/json".to_owned());
        message.properties.correlation = answers.correlation.clone();
        face.broker.publish(message, Kept::InOrder);
    }
}
