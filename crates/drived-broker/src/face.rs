//! `[mqtt]` as a [`Face`]: the plant in topics, and beside it the edge node of `[mqtt.sparkplug]`. Each has a connection of its own.

use std::pin::Pin;

use drive_sparkplug::NodeName;
use drived_config::rights::Role;
use drived_face::{
    ConfigError, Configured, Face, Failure, Key, Meaning, Open, Opening, Samples, Site, Written, same,
};
use futures_util::future::OptionFuture;
use serde_json::{Map, Value, json};

use crate::{
    broker::config::{MqttConfig, MqttEntry, SparkplugConfig},
    mqtt::Mqtt,
    sparkplug::Sparkplug,
};

/// What a program adds that tells brokers.
pub const FACE: &dyn Face = &OnBrokers;

struct OnBrokers;

const ROW: Key = Key::of_table(
    "[mqtt]",
    &["the [MQTT broker](mqtt.md), and [`[mqtt.sparkplug]`](sparkplug.md)"],
    "none: nothing is told to a broker",
);

impl Face for OnBrokers {
    fn table(&self) -> &'static str {
        "mqtt"
    }

    fn row(&self) -> &'static Key {
        &ROW
    }

    fn configure(&self, written: Written<'_>, site: &Site<'_>) -> Result<Box<dyn Configured>, ConfigError> {
        let source = written.source();
        let entry: MqttEntry = written.read()?;
        let mqtt = MqttConfig::read(source, &entry)?;
        let lines = || site.lines.iter().map(|line| line.name.as_str());
        let read = |entry| SparkplugConfig::read(source, entry, site.drives(), lines(), site.state);
        let sparkplug = entry.sparkplug.as_ref().map(read).transpose()?;
        Ok(Box::new(OnBroker { mqtt, sparkplug }))
    }
}

/// What the file says of both.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnBroker {
    pub mqtt: MqttConfig,
    /// `None`: it is no edge node.
    pub sparkplug: Option<SparkplugConfig>,
}

impl Configured for OnBroker {
    fn is_same(&self, other: &dyn Configured) -> bool {
        same(self, other)
    }

    fn meaning(&self) -> Vec<Meaning> {
        let sparkplug =
            self.sparkplug.as_ref().map(|sparkplug| format!("sparkplug: {}", of_sparkplug(sparkplug)));
        let heads = [format!("mqtt: {}", of_mqtt(&self.mqtt))].into_iter().chain(sparkplug);
        heads.map(|head| Meaning { head, rows: Vec::new() }).collect()
    }

    fn object(&self) -> Map<String, Value> {
        let sparkplug = self.sparkplug.as_ref().map(of_sparkplug);
        Map::from_iter([
            ("mqtt".to_owned(), json!(of_mqtt(&self.mqtt))),
            ("sparkplug".to_owned(), json!(sparkplug)),
        ])
    }

    fn check(&self) -> Result<(), Failure> {
        Mqtt::prepare(self.mqtt.clone()).map(drop)
    }

    fn prepare(&self) -> Result<Opening, Failure> {
        let mqtt = Mqtt::prepare(self.mqtt.clone())?;
        let sparkplug = self.sparkplug.as_ref().map(|sparkplug| Sparkplug::prepared(&self.mqtt, sparkplug));
        let sparkplug = sparkplug.transpose()?;
        Ok(Box::new(move |around| {
            let (plant, audit) = (&around.plant, &around.audit);
            let mqtt = mqtt.open(plant.clone(), audit.clone(), around.names.clone());
            let sparkplug = sparkplug.map(|sparkplug| sparkplug.open(plant.clone(), audit.clone()));
            Box::new(Told { mqtt, sparkplug })
        }))
    }
}

/// Where a broker is told everything, and who commands there.
fn of_mqtt(mqtt: &MqttConfig) -> String {
    let servers: Vec<String> = mqtt.servers.iter().map(ToString::to_string).collect();
    let commands = match (mqtt.commands, mqtt.commanders.is_empty()) {
        (false, _) => "nobody commands there".to_owned(),
        (true, true) => "WHOEVER MAY PUBLISH THERE OPERATES".to_owned(),
        (true, false) => {
            let each = mqtt.commanders.iter().map(|(name, role)| format!("{name} ({})", role.name()));
            format!("commands by {}", each.collect::<Vec<_>>().join(", "))
        }
    };
    let issued = if mqtt.needs_issued { ", starts and setpoints only with issued_unix_ms" } else { "" };
    format!("{} at {}: {commands}{issued}", mqtt.base, servers.join(", "))
}

/// What the daemon is called as an edge node, and what is done there.
fn of_sparkplug(sparkplug: &SparkplugConfig) -> String {
    let NodeName { group, edge_node } = &sparkplug.name;
    let host = sparkplug.primary_host.as_ref().map(|host| format!(", for the primary host {host}"));
    let may = sparkplug.commands.map_or("nobody commands there", |role| match role {
        Role::Stop => "WHOEVER MAY PUBLISH THERE STOPS",
        _ => "WHOEVER MAY PUBLISH THERE OPERATES",
    });
    let later =
        if sparkplug.historical { "; what the history kept of an outage is told behind it" } else { "" };
    format!("{group}/{edge_node}{}: {may}{later}", host.unwrap_or_default())
}

/// Both while they are open.
struct Told {
    mqtt: Mqtt,
    sparkplug: Option<Sparkplug>,
}

impl Open for Told {
    fn collect(&self, samples: &mut Samples) {
        self.mqtt.collect(samples);
        self.sparkplug.iter().for_each(|sparkplug| sparkplug.collect(samples));
    }

    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            let sparkplug = OptionFuture::from(self.sparkplug.map(Sparkplug::close));
            tokio::join!(self.mqtt.close(), sparkplug);
        })
    }
}
