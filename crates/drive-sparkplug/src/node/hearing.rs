//! What an edge node hears.

use super::{Command, EdgeNode, Event, Ignored, Now, REBIRTH, Session, Write, WriteError};
use crate::{
    Metric, Payload, Raw,
    host::{Heard, HostState},
    metrics::{self, Metrics},
    topic::{Verb, state_topic},
};

impl EdgeNode {
    /// A message has come. `None`: it says nothing new.
    pub fn handle_message(
        &mut self,
        topic: &str,
        payload: &[u8],
        is_retained: bool,
        now: Now,
    ) -> Option<Event> {
        let name = &self.settings.name;
        if self.settings.primary_host.as_ref().is_some_and(|host| state_topic(host) == topic) {
            return self.handle_state(payload);
        }
        if topic == name.topic(Verb::Command, None) {
            return match Payload::decode(payload) {
                Ok(payload) => self.handle_node_command(&payload, is_retained, now),
                Err(malformed) => Some(Event::Ignored(malformed.into())),
            };
        }
        let device = self
            .devices
            .iter()
            .find(|device| !device.is_removed && name.topic(Verb::Command, Some(&device.id)) == topic);
        let Some(device) = device else {
            return Some(Event::Ignored(Ignored::NotOurs(topic.to_owned())));
        };
        Some(match Payload::decode(payload) {
            Ok(payload) => Event::Command(Command {
                device: Some(device.id.clone()),
                timestamp: payload.timestamp,
                is_retained,
                writes: payload.metrics.iter().map(|metric| write(&device.metrics, metric)).collect(),
            }),
            Err(malformed) => Event::Ignored(malformed.into()),
        })
    }

    fn handle_state(&mut self, payload: &[u8]) -> Option<Event> {
        let state: HostState = match serde_json::from_slice(payload) {
            Ok(state) => state,
            Err(error) => return Some(Event::Ignored(Ignored::NotAState(error.to_string()))),
        };
        let was_online = self.host.is_online();
        match self.host.handle(state) {
            Heard::Outdated => Some(Event::Ignored(Ignored::Outdated)),
            Heard::Online => {
                if self.session == Session::Waiting {
                    self.session = Session::Birth;
                }
                (!was_online).then_some(Event::HostOnline)
            }
            Heard::Offline => {
                match self.session {
                    Session::Birth | Session::Alive => self.part(true),
                    // Where there is one server, the host comes back to it.
                    Session::Waiting if self.settings.has_other_servers => {
                        self.part(true);
                    }
                    _ => {}
                }
                Some(Event::HostOffline)
            }
        }
    }

    fn handle_node_command(&mut self, payload: &Payload, is_retained: bool, now: Now) -> Option<Event> {
        let is_rebirth = |metric: &Metric| metric.name.as_deref() == Some(REBIRTH);
        let asks = |metric: &Metric| is_rebirth(metric) && metric.value == Some(Raw::Boolean(true));
        if payload.metrics.iter().any(asks) {
            if is_retained {
                return Some(Event::Ignored(Ignored::RetainedRebirth));
            }
            // Births that are still to come answer it.
            if let Some(born_at) = self.born_at.filter(|_| self.is_alive()) {
                let due = now.at.max(born_at + self.settings.rebirth_pause);
                self.rebirth_at.get_or_insert(due);
            }
            return Some(Event::RebirthAsked);
        }
        let others = payload.metrics.iter().filter(|metric| !is_rebirth(metric));
        let writes: Vec<_> = others.map(|metric| write(&self.metrics, metric)).collect();
        let command = Command { device: None, timestamp: payload.timestamp, is_retained, writes };
        (!command.writes.is_empty()).then_some(Event::Command(command))
    }
}

/// What a metric of a command writes.
fn write(metrics: &Metrics, metric: &Metric) -> Result<Write, WriteError> {
    // Some hosts send an alias beside an empty name.
    let name = metric.name.as_deref().filter(|name| !name.is_empty());
    let Some(definition) = metrics.definition(name, metric.alias) else {
        let name = name.map(|name| format!("{name:?}"));
        let alias = || metric.alias.map_or("without name and alias".to_owned(), |alias| alias.to_string());
        return Err(WriteError::Unknown(name.unwrap_or_else(alias)));
    };
    let name = definition.name.clone().into_owned();
    let raw = metric.value.as_ref().filter(|_| !metric.is_null);
    match metrics::read(definition, raw) {
        Some(value) => {
            let written = Write { name, value, timestamp: metric.timestamp };
            if metric.is_historical { Err(WriteError::Historical(written)) } else { Ok(written) }
        }
        None => Err(WriteError::NotItsType(name)),
    }
}
