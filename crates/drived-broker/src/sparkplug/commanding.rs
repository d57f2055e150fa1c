//! What hosts write, as the [desk](crate::desk) takes it.
//!
//! A write has no id, no expiry and no answer of its own. So a setpoint is a level, motion is asked for by an object in
//! `Control/Command`, and what becomes of either stands in `Control/LastCommand/…`. The time of the payload says how old
//! it is.

use drive_core::{Frequency, Setpoint, Speed};
use drive_sparkplug::{Command, Value, Write, WriteError};
use serde_json::{Value as Json, json};
use tokio::{sync::mpsc, time::Instant};

use super::metrics::{ALARMS_COMMAND, COMMAND, SETPOINT, SPEED_SETPOINT};
use crate::{
    broker::Arrived,
    broker::config::SparkplugConfig,
    desk::{AlarmMessage, Answer, Answers, Desk, Message, Refusal},
};
use drived_config::names::Kind;
use drived_doors::{Caller, Rights, Role, audit::Audit};
use drived_plant::plant::{
    Plant,
    alarms::AlarmsSaid,
    commands::{Action, Lifetime, Said, Target},
};
use drived_words::{json::unix, strict::Unclear};

/// Who asks: hosts do not say who they are.
const CALLER: &str = "sparkplug";

/// What takes commands.
pub(super) struct Commanding {
    desk: Desk<To>,
    plant: Plant,
    caller: Caller,
    /// How old a command may be that does not say so itself.
    lifetime: Lifetime,
    /// What became of the last command of a drive, or of the last that was done with alarms.
    outcomes: mpsc::Sender<(Option<String>, Json)>,
}

/// The device whose last command it is; `None`: it was about alarms.
#[derive(Clone)]
struct To {
    device: Option<String>,
    outcomes: mpsc::Sender<(Option<String>, Json)>,
}

impl Commanding {
    pub(super) fn new(
        config: &SparkplugConfig,
        plant: Plant,
        audit: Audit,
        outcomes: mpsc::Sender<(Option<String>, Json)>,
    ) -> Self {
        let rights = config.commands.map_or(Rights::NONE, Role::rights);
        let origin = format!("sparkplug {}", config.name.group);
        let caller = Caller::new(CALLER, origin, rights);
        let desk = Desk::open(plant.clone(), audit);
        Self { desk, plant, caller, lifetime: Lifetime::Usual(config.lifetime), outcomes }
    }

    /// Takes what a host writes, one metric after the other. `is_alive`: the births have been told, so that the host can know
    /// what it writes.
    pub(super) fn handle(&mut self, command: Command, arrived: &Arrived, is_alive: bool) {
        let Command { device, timestamp, is_retained, writes } = command;
        for write in writes {
            // A stop is taken whenever it is from.
            let (write, of_the_past) = match write {
                Err(WriteError::Historical(write)) => {
                    (Ok(write.clone()), Some(WriteError::Historical(write)))
                }
                write => (write, None),
            };
            // What was so before the host has sent it is as old as that.
            let own = write.as_ref().ok().and_then(|write| write.timestamp);
            let sent_unix_ms = timestamp.map(|sent| own.map_or(sent, |own| own.min(sent)));
            let of_the_past = of_the_past.map(|error| Refusal::malformed(error.to_string()));
            let unborn = (!is_alive).then_some(Refusal::NotBorn);
            let undated = || Refusal::malformed("its payload has no timestamp: its age is not known");
            let undated = timestamp.is_none().then(undated);
            // What stands in for a lost id may have been another's. A stop is taken at its word.
            let lost = || self.plant.names_problem().map(Refusal::NamesLost);
            let doubt = if is_retained { Some(Refusal::Retained) } else { unborn.or(undated).or_else(lost) };
            let Some(device) = device.as_ref().map(|device| device.as_str().to_owned()) else {
                self.handle_alarms(write, of_the_past.or(doubt), sent_unix_ms, arrived);
                continue;
            };
            // The drive that it is now; of one that is gone the name may be another's by now.
            let drive = self.plant.name_of(Kind::Drive, &device);
            let drive = drive.unwrap_or_else(|| format!("{device}, which is gone"));
            self.desk.take(Message {
                needs_id: matches!(&write, Ok(write) if write.name == COMMAND),
                // Its payload says it.
                needs_issued: false,
                doubt: read_only(&write).or(of_the_past).or(doubt),
                said: said(write),
                caller: self.caller.clone(),
                pace_of: String::new(),
                target: Some(Target::Drive(drive)),
                arrived: arrived.at,
                asked_after: None,
                sent_unix_ms,
                lifetime: self.lifetime,
                longest: None,
                id: None,
                what: format!("MQTT {}", arrived.topic),
                answers: To { device: Some(device), outcomes: self.outcomes.clone() },
            });
        }
    }

    /// Takes what a host writes to the node: that something is done with alarms.
    fn handle_alarms(
        &mut self,
        write: Result<Write, WriteError>,
        doubt: Option<Refusal>,
        sent_unix_ms: Option<u64>,
        arrived: &Arrived,
    ) {
        let Ok(Write { name, value: Value::String(text), .. }) = write else {
            tracing::debug!("Sparkplug: {}: of the node only {ALARMS_COMMAND} can be written", arrived.topic);
            return;
        };
        if name != ALARMS_COMMAND {
            tracing::debug!("Sparkplug: {}: {name} cannot be written", arrived.topic);
            return;
        }
        self.desk.take_alarms(AlarmMessage {
            said: AlarmsSaid::of(&text),
            caller: self.caller.clone(),
            pace_of: String::new(),
            doubt,
            arrived: arrived.at,
            sent_unix_ms,
            what: format!("MQTT {}", arrived.topic),
            answers: To { device: None, outcomes: self.outcomes.clone() },
        });
    }
}

/// What a write asks for.
fn said(write: Result<Write, WriteError>) -> Said {
    let malformed = |why: String, body| Said::unclear(Unclear::Malformed(why), body);
    let Write { name, value, .. } = match write {
        Ok(write) => write,
        Err(error) => return malformed(error.to_string(), Json::from(error.to_string())),
    };
    let set = |setpoint| Action::Setpoint { setpoint, until: drive_fleet::Until::default() };
    match (name.as_str(), value) {
        (COMMAND, Value::String(text)) => {
            let said = Said::of(text.as_bytes());
            Said { body: json!({ name: said.body }), ..said }
        }
        (SETPOINT, Value::Double(hertz)) => number::<Frequency>(hertz)
            .map(|frequency| Said::plain(set(Setpoint::Frequency(frequency)), json!({ &name: hertz })))
            .unwrap_or_else(|why| malformed(why, json!({ name: hertz }))),
        (SPEED_SETPOINT, Value::Double(rpm)) => number::<Speed>(rpm)
            .map(|speed| Said::plain(set(Setpoint::Speed(speed)), json!({ &name: rpm })))
            .unwrap_or_else(|why| malformed(why, json!({ name: rpm }))),
        _ => malformed(format!("{name} has no such value"), Json::from(name)),
    }
}

fn number<T: serde::de::DeserializeOwned>(number: f64) -> Result<T, String> {
    serde_json::from_value(json!(number)).map_err(|error| error.to_string())
}

/// What is written to something that cannot be.
fn read_only(write: &Result<Write, WriteError>) -> Option<Refusal> {
    let Ok(Write { name, .. }) = write else { return None };
    (![COMMAND, SETPOINT, SPEED_SETPOINT].contains(&name.as_str())).then(|| Refusal::ReadOnly(name.clone()))
}

impl Answers for To {
    fn tell(&self, answer: Answer<'_>) {
        let (id, outcome, reason, text) = match answer {
            Answer::Command(view) => {
                (Some(&view.id), view.outcome, view.reason.as_deref(), view.text.as_deref())
            }
            Answer::Alarms(done) => (done.id.as_ref(), done.outcome, done.reason, done.text.as_deref()),
            Answer::Refused(refused) => {
                (refused.id.as_ref(), refused.outcome, Some(refused.reason), Some(refused.text.as_str()))
            }
        };
        // Its time is when it is told.
        let time = unix(Instant::now());
        let last =
            json!({ "id": id, "outcome": outcome, "reason": reason, "text": text, "time_unix_ms": time });
        // Nobody waits for the face: an outcome that finds no room stands in the audit log.
        let _ = self.outcomes.try_send((self.device.clone(), last));
    }
}
