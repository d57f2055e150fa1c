//! What is asked through the broker, as the [`desk`] takes it.
//!
//! MQTT says neither who sent a message nor that it comes once. So the last level of the topic names who asks, for the
//! broker's access list to vouch for, and what the daemon says to itself tells how late the broker is.

use std::{collections::VecDeque, sync::Arc, time::Duration};

use drive_core::{Direction, Setpoint};
use serde_json::{Value, json};
use tokio::time::Instant;

use super::{
    Face,
    last::ACCEPTED,
    topics::{Meant, Verb},
};
use crate::{
    broker::{Arrived, Kept, Message, Qos},
    desk::{self, Answer, Answers, Desk, Refusal},
};
use drived_config::{kept::sha256, names::Kind};
use drived_doors::{Caller, Rights, Role, audit::Audit};
use drived_plant::{
    follow::SETTLES_FOR,
    plant::{
        alarms::AlarmsSaid,
        commands::{Action, LIFETIME, OutcomeWord, Said, Target, is_id},
    },
};
use drived_words::strict::Unclear;

/// Who asks where the topic names nobody.
const NAMELESS: &str = "mqtt";
/// A command that may have been on its way from the broker for longer is late.
const LATE: Duration = Duration::from_secs(3);
/// Calls of the daemon to itself that may be under way.
const CALLS: usize = 30;

/// What takes commands.
pub(super) struct Commanding {
    face: Arc<Face>,
    desk: Desk<To>,
    /// The calls that have not come back, the oldest first.
    calls: VecDeque<(u64, Instant)>,
    called: u64,
    /// When the last call was made that has come back: what comes after it was sent after that.
    sent_after: Option<Instant>,
}

/// Where the answers to a message go.
#[derive(Clone)]
struct To {
    face: Arc<Face>,
    outcome: String,
    response: Option<String>,
    correlation: Option<bytes::Bytes>,
}

impl Commanding {
    pub(super) fn new(face: Arc<Face>, audit: Audit) -> Self {
        let desk = Desk::open(face.plant.clone(), audit);
        Self { face, desk, calls: VecDeque::new(), called: 0, sent_after: None }
    }

    /// There is a new connection, which has proved nothing yet.
    pub(super) fn connected(&mut self) {
        self.calls.clear();
        self.sent_after = None;
        self.call();
    }

    /// Says something to itself over the broker. A broker delivers in order, so that a command behind it is younger.
    pub(super) fn call(&mut self) {
        let face = &self.face;
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
        let face = &self.face;
        if arrived.topic == face.topics.echo() {
            return self.echoed(arrived);
        }
        let is_late = drive_fleet::mutant!("late-command-moves", self.is_late(arrived), false);
        let late = is_late.then_some(Refusal::Late);
        let is_kept = drive_fleet::mutant!("kept-command-moves", arrived.retain, false);
        let doubt = if is_kept { Some(Refusal::Retained) } else { late };
        if let Some(commander) = face.topics.asked_of_alarms(&arrived.topic) {
            self.desk.take_alarms(desk::AlarmMessage {
                said: AlarmsSaid::of(std::str::from_utf8(&arrived.payload).unwrap_or_default()),
                caller: caller(face, commander.as_deref()),
                pace_of: self.pace_of(commander.as_deref()),
                doubt,
                arrived: arrived.at,
                sent_unix_ms: None,
                what: format!("MQTT {}", arrived.topic),
                answers: self.answers(arrived, face.topics.alarms_outcome()),
            });
            return;
        }
        let Some(asking) = face.topics.asked(&arrived.topic) else { return };
        let target = target(face, &asking.meant);
        // What stands in for a lost topic may have been another's. A stop is taken at its word.
        let is_by_name = match (&asking.meant, &target) {
            (Meant::Drive(id), Some(Target::Drive(name))) | (Meant::Group(id), Some(Target::Group(name))) => {
                id == name
            }
            _ => true,
        };
        let lost = || face.topics.problem().filter(|_| !is_by_name).map(Refusal::NamesLost);
        let doubt = doubt.or_else(lost);
        let expires = arrived.expires_in_s.filter(|seconds| *seconds > 0);
        self.desk.take(desk::Message {
            said: said(asking.verb, &arrived.payload),
            caller: caller(face, asking.commander.as_deref()),
            pace_of: self.pace_of(asking.commander.as_deref()),
            target,
            doubt,
            arrived: arrived.at,
            asked_after: self.sent_after,
            sent_unix_ms: None,
            lifetime: LIFETIME,
            longest: expires.map(|seconds| Duration::from_secs(seconds.into())),
            needs_id: arrived.repeated || arrived.qos == Qos::AtLeastOnce,
            needs_issued: face.config.needs_issued,
            id: arrived.properties.correlation.as_deref().map(id_of),
            what: format!("MQTT {}", arrived.topic),
            answers: self.answers(arrived, face.topics.outcome(&asking.meant)),
        });
    }

    /// Those whom the configuration does not name have one pace together.
    fn pace_of(&self, commander: Option<&str>) -> String {
        let named = commander.filter(|name| self.face.config.commanders.contains_key(*name));
        named.unwrap_or_default().to_owned()
    }

    /// Where it is told what becomes of what has arrived.
    fn answers(&self, arrived: &Arrived, outcome: String) -> To {
        let face = Arc::clone(&self.face);
        let response = arrived.properties.response_topic.clone();
        let is_foreign = |topic: &str| face.topics.is_foreign(topic);
        let response =
            response.filter(|topic| drive_fleet::mutant!("answer-is-a-command", is_foreign(topic), true));
        To { face, outcome, response, correlation: arrived.properties.correlation.clone() }
    }
}

/// What a message says on a topic that asks for this.
fn said(verb: Verb, payload: &[u8]) -> Said {
    let text = std::str::from_utf8(payload).map(str::trim).unwrap_or_default();
    let action = match verb {
        Verb::Command => return Said::of(payload),
        Verb::Stop => return Said::stopping(payload),
        Verb::Run => match text {
            _ if Said::of(payload).stops().is_some() => return Said::of(payload),
            "forward" => Ok(started(Direction::Forward)),
            "reverse" => Ok(started(Direction::Reverse)),
            _ => Err("expected forward, reverse or stop".to_owned()),
        },
        Verb::Frequency => setpoint(serde_json::from_str(text).map(Setpoint::Frequency), "hertz"),
        Verb::Speed => setpoint(serde_json::from_str(text).map(Setpoint::Speed), "rpm"),
        Verb::Reset => Ok(Action::Reset),
        Verb::Release => Ok(Action::Release),
    };
    match action {
        Ok(action) => Said::plain(action, Value::from(text)),
        Err(why) => Said::unclear(Unclear::Malformed(why), Value::from(text)),
    }
}

fn started(direction: Direction) -> Action {
    Action::Start { direction, setpoint: None, until: drive_fleet::Until::default() }
}

fn setpoint(read: serde_json::Result<Setpoint>, unit: &str) -> Result<Action, String> {
    let setpoint = read.map_err(|error| format!("expected a number in {unit}: {error}"))?;
    Ok(Action::Setpoint { setpoint, until: drive_fleet::Until::default() })
}

/// Correlation Data as an id.
fn id_of(correlation: &[u8]) -> String {
    match std::str::from_utf8(correlation) {
        Ok(text) if is_id(text) => text.to_owned(),
        _ => sha256(correlation)[..32].to_owned(),
    }
}

/// Who asks, and what he may do.
fn caller(face: &Face, commander: Option<&str>) -> Caller {
    let name = commander.unwrap_or(NAMELESS).to_owned();
    let given = match face.config.commanders.is_empty() {
        true => commander.is_none().then_some(Role::Operate),
        false => face.config.commanders.get(&name).copied().or(drive_fleet::mutant!(
            "nobody-operates",
            None,
            commander.is_none().then_some(Role::Operate)
        )),
    };
    let role = drive_fleet::mutant!("whoever-has-a-name-operates", given, commander.map(|_| Role::Operate));
    Caller::new(name, "mqtt", role.map_or(Rights::NONE, Role::rights))
}

/// The drive or group of an id.
fn target(face: &Face, meant: &Meant) -> Option<Target> {
    match meant {
        Meant::All => Some(Target::All),
        Meant::Drive(id) => {
            let drives = face.plant.fleet().drives();
            let drive = drives.iter().find(|drive| face.topics.id(Kind::Drive, drive.name()) == *id)?;
            Some(Target::Drive(drive.name().to_string()))
        }
        Meant::Group(id) => {
            let group = face
                .plant
                .groups()
                .into_iter()
                .find(|group| face.topics.id(Kind::Group, &group.name) == *id)?;
            Some(Target::Group(group.name))
        }
    }
}

impl Answers for To {
    /// Publishes it: where everybody hears it, and where it was asked for. What is not known yet is accepted.
    fn tell(&self, answer: Answer<'_>) {
        let payload = match answer {
            Answer::Alarms(done) => json!(done),
            Answer::Refused(refused) => json!(refused),
            Answer::Command(view) => {
                let mut said = json!(view);
                if view.outcome == OutcomeWord::Pending {
                    said["outcome"] = ACCEPTED.into();
                }
                said
            }
        };
        let payload = bytes::Bytes::from(payload.to_string());
        let asked_for = drive_fleet::mutant!("who-asks-is-not-answered", &self.response, &None);
        for topic in std::iter::once(&self.outcome).chain(asked_for) {
            let mut message = Message::new(topic, payload.clone());
            message.retain = drive_fleet::mutant!("outcome-is-kept", false, true);
            message.expires = Some(Instant::now() + SETTLES_FOR);
            message.properties.content_type = Some("application/json".to_owned());
            message.properties.correlation =
                drive_fleet::mutant!("answer-without-its-number", self.correlation.clone(), None);
            self.face.broker.publish(message, Kept::InOrder);
        }
    }
}
