//! Home Assistant's MQTT discovery, as Home Assistant 2026.11 checks it: a document for each drive and one for the daemon,
//! or one for each of their components, which older ones know too.
//!
//! A value is announced where the drive's family can have it. A control is announced where it would be obeyed, and is
//! taken back where it would not be; those that move a motor expire at the broker. A value that is not good is `None`.

mod alarms;
mod daemon;
mod drive;
mod readings;
mod rights;

use std::{
    borrow::Cow,
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use drive_fleet::DriveHandle;
use serde_json::{Map, Value, json};

use super::{Face, topics::Topics};
use crate::broker::config::Discovery;
use drived_plant::plant::views::LineView;

/// What Home Assistant was told of one device: by topic, so that it can be taken back.
#[derive(Debug, Clone, Default)]
pub(super) struct Discovered(Arc<Mutex<Told>>);

#[derive(Debug, Default)]
struct Told {
    documents: BTreeMap<String, String>,
    /// The components that they had, with their platforms.
    components: BTreeMap<String, String>,
}

impl Discovered {
    /// Announces a drive, when its document is another than before: by what its family has and by what it is configured as, and never by
    /// what is known of it. So an entity is there from the start, and nothing that comes to be known takes it away for a moment.
    pub(super) fn tell(&self, face: &Face, drive: &DriveHandle, again: bool) {
        if face.config.discovery != Discovery::Off {
            self.publish(face, drive::device(face, drive), again);
        }
    }

    /// Announces the daemon with its lines.
    pub(super) fn tell_daemon(&self, face: &Face, lines: &[LineView], again: bool) {
        if face.config.discovery != Discovery::Off {
            self.publish(face, daemon::device(face, lines), again);
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

/// What is there for as long as the daemon is, whether the drive answers or not.
fn while_the_daemon_is(topics: &Topics) -> Value {
    json!([{ "topic": topics.status() }])
}

fn button(name: &str, topic: String, word: &str) -> Value {
    json!({ "name": name, "command_topic": topic, "payload_press": word, "retain": false })
}

/// After how many seconds a value counts as unknown that has not been told again.
fn expire_after(face: &Face) -> u64 {
    face.config.heartbeat.as_secs().max(1) * 3
}
