//! Home Assistant's MQTT discovery, as Home Assistant 2026.11 checks it: a document for each drive and one for the daemon,
//! or one for each of their components, which older ones know too.
//!
//! A value is announced when the drive has shown that it has it. A control is announced where it would be obeyed, and is
//! taken back where it would not be; those that move a motor expire at the broker. A value that is not good is `None`.

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex, PoisonError},
};

use drive_core::State;
use drive_fleet::{Commanders, DriveHandle, IdentityCheck, Snapshot};
use serde_json::{Map, Value, json};

use super::{
    Face,
    topics::{Meant, Topics, Verb},
};
use crate::broker::config::Discovery;
use drived_config::names::Kind;
use drived_doors::{Rights, Role};
use drived_plant::plant::views::LineView;

/// How Home Assistant is called among the commanders, where they are named.
const COMMANDER: &str = "homeassistant";
/// After so many seconds at the broker, a command that would move a motor is gone.
const COMMANDS_EXPIRE_S: u32 = 2;
/// The highest setpoint that is offered where no limit is configured: the mains' own.
const USUAL_HIGH_HZ: f64 = 50.0;

/// Every state that a drive can show.
const STATES: [State; 9] = [
    State::NotReady,
    State::Disabled,
    State::Ready,
    State::Running,
    State::Stopping,
    State::QuickStop,
    State::FaultReaction,
    State::Fault,
    State::Unknown,
];

/// The events that somebody should look at now.
const ALARMS: [&str; 11] = [
    "lost",
    "tripped",
    "identity_changed",
    "other_family",
    "watchdog_broken",
    "watchdog_not_in_force",
    "stop_unconfirmed",
    "run_command_stands",
    "restarts_itself",
    "limit",
    "warning",
];

/// Which of a drive's topics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Of {
    Status,
    Measurements,
}

/// A value with a unit.
struct Reading {
    of: Of,
    /// As the API names it.
    key: &'static str,
    name: &'static str,
    class: Option<&'static str>,
    unit: &'static str,
    precision: u8,
    diagnostic: bool,
    total: bool,
}

const fn reading(
    of: Of,
    key: &'static str,
    name: &'static str,
    class: &'static str,
    unit: &'static str,
) -> Reading {
    let class = if class.is_empty() { None } else { Some(class) };
    Reading { of, key, name, class, unit, precision: 1, diagnostic: false, total: false }
}

/// The readings. Home Assistant has no class for revolutions per minute, and none for shares of torque and heat.
const READINGS: [Reading; 13] = [
    Reading { precision: 2, ..reading(Of::Status, "output_frequency_hz", "Frequency", "frequency", "Hz") },
    reading(Of::Status, "current_a", "Current", "current", "A"),
    reading(Of::Status, "current_percent", "Current share", "", "%"),
    Reading { precision: 0, ..reading(Of::Measurements, "speed_rpm", "Speed", "", "rpm") },
    Reading {
        diagnostic: true,
        ..reading(Of::Measurements, "output_voltage_v", "Motor voltage", "voltage", "V")
    },
    Reading {
        diagnostic: true,
        ..reading(Of::Measurements, "line_voltage_v", "Mains voltage", "voltage", "V")
    },
    Reading {
        diagnostic: true,
        ..reading(Of::Measurements, "dc_bus_voltage_v", "DC bus voltage", "voltage", "V")
    },
    reading(Of::Measurements, "torque_percent", "Torque", "", "%"),
    Reading { precision: 2, ..reading(Of::Measurements, "output_power_kw", "Power", "power", "kW") },
    reading(Of::Measurements, "drive_thermal_percent", "Drive thermal state", "", "%"),
    reading(Of::Measurements, "motor_thermal_percent", "Motor thermal state", "", "%"),
    Reading {
        diagnostic: true,
        total: true,
        ..reading(Of::Measurements, "running_time_h", "Running hours", "duration", "h")
    },
    Reading {
        diagnostic: true,
        total: true,
        ..reading(Of::Measurements, "powered_time_h", "Powered hours", "duration", "h")
    },
];

/// What Home Assistant was told of one device: by topic, so that it can be taken back.
#[derive(Debug, Clone, Default)]
pub(super) struct Discovered(Arc<Mutex<Told>>);

#[derive(Debug, Default)]
struct Told {
    documents: BTreeMap<String, String>,
    /// The components that they had, with their platforms.
    components: BTreeMap<String, String>,
    /// The readings that the drive has shown so far.
    keys: BTreeSet<&'static str>,
}

impl Discovered {
    /// Announces a drive, when it has shown something and its document is another than before.
    pub(super) fn tell(
        &self,
        face: &Face,
        drive: &DriveHandle,
        snapshot: &Snapshot,
        state: &Map<String, Value>,
        measurements: &Map<String, Value>,
        again: bool,
    ) {
        if face.config.discovery == Discovery::Off || snapshot.status.is_none() {
            return;
        }
        let shows = |of, key| match of {
            Of::Status => state["status"].get(key).is_some(),
            Of::Measurements => measurements.contains_key(key),
        };
        let keys = {
            let mut told = self.told();
            told.keys.extend(READINGS.iter().filter(|one| shows(one.of, one.key)).map(|one| one.key));
            told.keys.clone()
        };
        self.publish(face, Device::of_drive(face, drive, snapshot, &keys), again);
    }

    /// Announces the daemon with its lines.
    pub(super) fn tell_daemon(&self, face: &Face, lines: &[LineView], again: bool) {
        if face.config.discovery != Discovery::Off {
            self.publish(face, Device::of_daemon(face, lines), again);
        }
    }

    /// Takes a document of this device that the broker has for told, so that what is not in it any more is taken back from it. False: it
    /// is told otherwise now.
    pub(super) fn recall(&self, face: &Face, topic: &str, document: &Value) -> bool {
        let Some(levels) =
            topic.strip_prefix(&face.config.discovery_prefix).and_then(|rest| rest.strip_prefix('/'))
        else {
            return false;
        };
        let node = face.topics.node();
        let mut told = self.told();
        match (levels.split('/').collect::<Vec<_>>().as_slice(), face.config.discovery) {
            (["device", device, _], Discovery::Device) if *device == node => {
                for (id, component) in document["components"].as_object().into_iter().flatten() {
                    let platform = component["platform"].as_str().unwrap_or_default().to_owned();
                    told.components.entry(id.clone()).or_insert(platform);
                }
                true
            }
            ([platform, device, id, _], Discovery::Component) if *device == node => {
                told.components.entry((*id).to_owned()).or_insert_with(|| (*platform).to_owned());
                true
            }
            _ => false,
        }
    }

    /// Takes everything back: the device is gone.
    pub(super) fn take_back(&self, face: &Face) {
        let topics: Vec<String> = std::mem::take(&mut self.told().documents).into_keys().collect();
        for topic in topics {
            face.tell_for_good(topic, "");
        }
    }

    fn publish(&self, face: &Face, mut device: Device, again: bool) {
        {
            let mut told = self.told();
            for (id, platform) in &told.components {
                if !device.components.iter().any(|known| known.id == *id) {
                    let (id, platform) = (id.clone(), platform.clone().into());
                    device.components.push(Component { id, platform, values: None });
                }
            }
            let all = device.components.iter().map(|known| (known.id.clone(), known.platform.to_string()));
            told.components = all.collect();
        }
        for (topic, document) in device.documents(face) {
            let is_new = self.told().documents.get(&topic) != Some(&document);
            if is_new || again {
                face.tell_for_good(topic.clone(), document.clone());
                self.told().documents.insert(topic, document);
            }
        }
    }

    fn told(&self) -> std::sync::MutexGuard<'_, Told> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A device of Home Assistant.
struct Device {
    id: String,
    device: Value,
    availability: Value,
    components: Vec<Component>,
}

/// One of its components; without values it is none, and is taken back.
struct Component {
    id: String,
    platform: Cow<'static, str>,
    values: Option<Map<String, Value>>,
}

fn component(id: impl Into<String>, platform: &'static str, values: Value) -> Component {
    let values = match values {
        Value::Object(values) => Some(values),
        _ => None,
    };
    Component { id: id.into(), platform: platform.into(), values }
}

impl Device {
    fn of_drive(face: &Face, drive: &DriveHandle, snapshot: &Snapshot, keys: &BTreeSet<&str>) -> Self {
        let (name, topics) = (drive.name(), &face.topics);
        let id = topics.id(Kind::Drive, name);
        let mut device = json!({
            "identifiers": [format!("{}_{id}", topics.node())],
            "name": name.as_ref(),
            "model": drive.capabilities().name,
            "via_device": topics.node(),
        });
        if let IdentityCheck::Same(known) | IdentityCheck::Changed { found: known, .. } = &snapshot.identity {
            for (key, value) in
                [("manufacturer", &known.vendor), ("model_id", &known.model), ("sw_version", &known.version)]
            {
                if let Some(value) = value {
                    device[key] = value.as_str().into();
                }
            }
        }
        let expire_after = face.config.heartbeat.as_secs().max(1) * 3;
        let topic = |what: &str| topics.drive(name, what);
        let mut components = Vec::new();
        for one in READINGS.iter().filter(|one| keys.contains(one.key)) {
            components.push(component(one.key, "sensor", one.sensor(topic, expire_after)));
        }
        components.extend([
            component(
                "state",
                "sensor",
                json!({
                    "name": "State", "device_class": "enum", "options": STATES, "state_topic": topic("state"),
                    "value_template": good("status.", "state"), "expire_after": expire_after,
                }),
            ),
            component(
                "fault",
                "sensor",
                json!({
                    "name": "Fault", "state_topic": topic("fault"), "json_attributes_topic": topic("fault"),
                    "value_template": "{{ (value_json.mnemonic | default(value_json.code)) if value_json.present else \
                                       ('none' if value_json.quality == 'good' else none) }}",
                    "expire_after": expire_after,
                }),
            ),
            component(
                "problem",
                "binary_sensor",
                json!({
                    "name": "Problem", "device_class": "problem", "state_topic": topic("fault"),
                    "value_template": "{{ 'ON' if value_json.present else ('OFF' if value_json.quality == 'good' else none) }}",
                    "expire_after": expire_after,
                }),
            ),
            component(
                "turning",
                "binary_sensor",
                json!({
                    "name": "Turning", "device_class": "running", "state_topic": topic("state"),
                    "value_template": "{% set status = value_json.status %}{{ none if status.quality != 'good' else ('ON' if \
                                       status.state in ['running', 'stopping', 'fault_reaction'] or status.state == 'quick_stop' \
                                       and status.output_frequency_hz | default(1) > 0 else 'OFF') }}",
                    "expire_after": expire_after,
                }),
            ),
            component(
                "alarm",
                "event",
                json!({
                    "name": "Alarm", "event_types": ALARMS, "state_topic": topic("event"),
                    // Whatever else happens is none: Home Assistant ignores an empty text.
                    "value_template": "{{ {'event_type': value_json.event, 'text': value_json.text} | to_json \
                                       if value_json.alarm and value_json.event != 'exit' else '' }}",
                    // That it is lost is an alarm too, and told while it is.
                    "availability": while_the_daemon_is(topics), "availability_mode": "all",
                }),
            ),
            component(
                "answers",
                "binary_sensor",
                json!({
                    "name": "Answers", "device_class": "connectivity", "entity_category": "diagnostic",
                    "state_topic": topic("availability"), "payload_on": "online", "payload_off": "offline",
                    "availability": while_the_daemon_is(topics), "availability_mode": "all",
                }),
            ),
        ]);
        components.extend(controls(face, drive, &id));
        let availability = json!([{ "topic": topics.status() }, { "topic": topic("availability") }]);
        Self { id: format!("{}_{id}", topics.node()), device, availability, components }
    }

    fn of_daemon(face: &Face, lines: &[LineView]) -> Self {
        let topics = &face.topics;
        let device = json!({
            "identifiers": [topics.node()], "name": format!("drived {}", face.config.base), "model": "drived",
            "sw_version": env!("CARGO_PKG_VERSION"),
        });
        let expire_after = face.config.heartbeat.as_secs().max(1) * 3;
        let mut components = vec![component(
            "connected",
            "binary_sensor",
            json!({
                "name": "Connected", "device_class": "connectivity", "entity_category": "diagnostic",
                "state_topic": topics.status(), "payload_on": "online", "payload_off": "offline",
                "availability": [], "availability_mode": "all",
            }),
        )];
        for line in lines {
            let (id, topic) = (topics.id(Kind::Line, &line.name), topics.line(&line.name));
            components.push(component(
                format!("line_{id}"),
                "binary_sensor",
                json!({
                    "name": format!("Line {}", line.name), "device_class": "connectivity",
                    "entity_category": "diagnostic", "state_topic": topic, "expire_after": expire_after,
                    "value_template": "{{ 'ON' if value_json.link == 'connected' else 'OFF' }}",
                }),
            ));
            components.push(component(
                format!("line_{id}_utilisation"),
                "sensor",
                json!({
                    "name": format!("Line {} utilisation", line.name), "entity_category": "diagnostic",
                    "unit_of_measurement": "%", "state_class": "measurement", "suggested_display_precision": 1,
                    "state_topic": topic, "value_template": "{{ value_json.utilisation_percent }}",
                    "expire_after": expire_after,
                }),
            ));
        }
        let stop = rights(face)
            .stop
            .then(|| button("Stop all", topics.asking(&Meant::All, Verb::Stop, said(face)), "ramp"));
        components.push(component("stop_all", "button", stop.unwrap_or(Value::Null)));
        let availability = json!([{ "topic": topics.status() }]);
        Self { id: topics.node(), device, availability, components }
    }

    /// Its documents by their topics; an empty one takes back what was there.
    fn documents(&self, face: &Face) -> Vec<(String, String)> {
        let origin = json!({ "name": "drived", "sw_version": env!("CARGO_PKG_VERSION") });
        let object = |component: &Component, values: &Map<String, Value>| {
            let mut values = values.clone();
            values.insert("unique_id".to_owned(), format!("{}_{}", self.id, component.id).into());
            // Nothing can vouch for the daemon but the daemon itself.
            if values.get("availability") == Some(&json!([])) {
                values.remove("availability");
                values.remove("availability_mode");
            } else if !values.contains_key("availability") {
                values.insert("availability".to_owned(), self.availability.clone());
                values.insert("availability_mode".to_owned(), "all".into());
            }
            values
        };
        if face.config.discovery == Discovery::Device {
            let mut components = Map::new();
            for one in &self.components {
                let mut values = one.values.as_ref().map(|values| object(one, values)).unwrap_or_default();
                values.insert("platform".to_owned(), one.platform.as_ref().into());
                components.insert(one.id.clone(), Value::Object(values));
            }
            let document = json!({ "device": self.device, "origin": origin, "components": components });
            return vec![(face.topics.discovery(&format!("device/{}", self.id)), document.to_string())];
        }
        let one = |one: &Component| {
            let document = one.values.as_ref().map(|values| {
                let mut values = object(one, values);
                values.insert("device".to_owned(), self.device.clone());
                values.insert("origin".to_owned(), origin.clone());
                Value::Object(values).to_string()
            });
            let topic = face.topics.discovery(&format!("{}/{}/{}", one.platform, self.id, one.id));
            (topic, document.unwrap_or_default())
        };
        self.components.iter().map(one).collect()
    }
}

impl Reading {
    fn sensor(&self, topic: impl Fn(&str) -> String, expire_after: u64) -> Value {
        let (topic, place) = match self.of {
            Of::Status => (topic("state"), "status."),
            Of::Measurements => (topic("measurements"), ""),
        };
        let mut sensor = json!({
            "name": self.name, "state_topic": topic, "value_template": good(place, self.key),
            "unit_of_measurement": self.unit, "state_class": if self.total { "total_increasing" } else { "measurement" },
            "suggested_display_precision": self.precision, "expire_after": expire_after,
        });
        if let Some(class) = self.class {
            sensor["device_class"] = class.into();
        }
        if self.diagnostic {
            sensor["entity_category"] = "diagnostic".into();
        }
        sensor
    }
}

/// Whether a document of Home Assistant is one of this daemon: it names the topic of its status.
pub(super) fn is_of(face: &Face, document: &Value) -> bool {
    let status = face.topics.status();
    let names = |part: &Value| {
        let topics = part["availability"].as_array().into_iter().flatten().map(|one| &one["topic"]);
        topics.chain([&part["state_topic"]]).any(|topic| *topic == status)
    };
    let parts = document["components"].as_object();
    document["origin"]["name"] == "drived"
        && (names(document) || parts.into_iter().flatten().any(|(_, part)| names(part)))
}

/// A value while it is good, and `None` else.
fn good(place: &str, key: &str) -> String {
    format!(
        "{{{{ value_json.{place}{key} | default(none) if value_json.{place}quality == 'good' else none }}}}"
    )
}

/// What commands a drive.
fn controls(face: &Face, drive: &DriveHandle, id: &str) -> [Component; 5] {
    let settings = drive.settings();
    let rights = if settings.control { rights(face) } else { Rights::NONE };
    let meant = Meant::Drive(id.to_owned());
    let topic = |verb| face.topics.asking(&meant, verb, said(face));
    let commander = said(face).unwrap_or("mqtt");
    let may_operate = rights.operate
        && match &settings.commanders {
            Commanders::Anyone => true,
            Commanders::Only(names) => names.iter().any(|name| name == commander),
        };
    let moving = |mut values: Value| {
        values["message_expiry_interval"] = COMMANDS_EXPIRE_S.into();
        values
    };
    let hertz = |frequency: drive_core::Frequency| f64::from(frequency.centihertz()) / 100.0;
    let (low, high) =
        (settings.limits.low.map_or(0.0, hertz), settings.limits.high.map_or(USUAL_HIGH_HZ, hertz));
    let high = high.max(low);
    let setpoint = json!({
        "name": "Setpoint", "device_class": "frequency", "unit_of_measurement": "Hz", "mode": "box",
        "min": low, "max": high, "step": 0.1, "optimistic": false, "retain": false,
        "command_topic": topic(Verb::Frequency), "state_topic": face.topics.drive(drive.name(), "state"),
        // Home Assistant drops a number outside its limits, and says so in its log each time.
        "value_template": format!(
            "{{% set hertz = (value_json.setpoint | default({{}})).frequency_hz | default(none) %}}{{{{ hertz if \
             value_json.status.quality == 'good' and hertz is not none and {low} <= hertz <= {high} else none }}}}"
        ),
    });
    let mut stop = button("Stop", topic(Verb::Stop), "ramp");
    stop["availability"] = while_the_daemon_is(&face.topics);
    stop["availability_mode"] = "all".into();
    let start = |name, word| moving(button(name, topic(Verb::Run), word));
    let when = |may: bool, values: Value| if may { values } else { Value::Null };
    [
        component("setpoint", "number", when(may_operate, moving(setpoint))),
        component("start", "button", when(may_operate, start("Start", "forward"))),
        component("start_reverse", "button", when(may_operate, start("Start in reverse", "reverse"))),
        // A stop is never too late, and goes to a drive that is lost as soon as it is back.
        component("stop", "button", when(rights.stop, stop)),
        component(
            "reset",
            "button",
            when(may_operate, moving(button("Reset fault", topic(Verb::Reset), "reset"))),
        ),
    ]
}

/// What is there for as long as the daemon is, whether the drive answers or not.
fn while_the_daemon_is(topics: &Topics) -> Value {
    json!([{ "topic": topics.status() }])
}

fn button(name: &str, topic: String, word: &str) -> Value {
    json!({ "name": name, "command_topic": topic, "payload_press": word, "retain": false })
}

/// What Home Assistant may do.
fn rights(face: &Face) -> Rights {
    let config = &face.config;
    let role = match said(face) {
        Some(name) => config.commanders.get(name).copied(),
        None if config.commanders.is_empty() => Some(Role::Operate),
        None => config.commanders.get("mqtt").copied(),
    };
    role.filter(|_| config.commands).map_or(Rights::NONE, Role::rights)
}

/// The name by which Home Assistant commands, where its topics have one.
fn said(face: &Face) -> Option<&'static str> {
    face.config.commanders.contains_key(COMMANDER).then_some(COMMANDER)
}
