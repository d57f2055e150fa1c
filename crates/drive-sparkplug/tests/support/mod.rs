//! A broker and a host in memory, and the specification's rules.

pub(crate) mod protobuf;
pub(crate) mod recording;
pub(crate) mod rules;

use std::time::{Duration, Instant};

use drive_sparkplug::{
    Action, BdSeq, DataType, Definition, EdgeNode, Event, Id, Metric, NodeName, Now, Payload, Quality, Raw,
    Reading, Settings, Value,
};
use recording::{Message, Packet, Recording};

/// An edge node whose caller does everything at once, with a clock of its own and a record of every packet.
pub(crate) struct Rig {
    pub(crate) node: EdgeNode,
    pub(crate) now: Now,
    pub(crate) packets: Vec<Packet>,
    pub(crate) bd_seq: BdSeq,
    pub(crate) events: Vec<Event>,
    /// What the node has said of connecting again, since it was asked.
    pub(crate) reconnect: Option<bool>,
}

pub(crate) fn settings() -> Settings {
    Settings {
        name: NodeName { group: Id::new("plant").unwrap(), edge_node: Id::new("hall 1").unwrap() },
        primary_host: None,
        has_other_servers: false,
        rebirth_pause: Duration::from_secs(5),
        commands: true,
    }
}

/// What each device of the rig has.
pub(crate) fn definitions() -> Vec<Definition> {
    vec![
        Definition::new("Status/State", DataType::String),
        Definition::new("Status/Output Frequency", DataType::Double),
        Definition::new("Counts", DataType::Int32),
        Definition::new("Control/Setpoint", DataType::Double),
    ]
}

impl Rig {
    /// Two devices, `pump 1` and `fan 1`, which are not present.
    pub(crate) fn new(settings: Settings) -> Self {
        let now = Now { at: Instant::now(), unix_ms: 1_700_000_000_000 };
        let lines = vec![Definition::new("Lines/north/Errors", DataType::UInt64)];
        let mut node = EdgeNode::new(settings, lines, now).unwrap();
        node.add_device("pump 1", definitions(), now).unwrap();
        node.add_device("fan 1", definitions(), now).unwrap();
        Self { node, now, packets: Vec::new(), bd_seq: BdSeq::default(), events: Vec::new(), reconnect: None }
    }

    pub(crate) fn wait(&mut self, time: Duration) {
        self.now.at += time;
        self.now.unix_ms += u64::try_from(time.as_millis()).unwrap();
        self.carry_out();
    }

    /// Connects with the next number, and subscribes.
    pub(crate) fn connect(&mut self) {
        self.bd_seq = self.bd_seq.next();
        let will = EdgeNode::will(&settings().name, self.bd_seq, self.now);
        let will = Some(Message { topic: will.topic, payload: will.payload, qos: will.qos, retain: false });
        self.packets.push(Packet::Connect { clean_start: true, session_expiry: 0, will });
        for subscription in self.node.subscriptions() {
            self.packets.push(Packet::Subscribe { filter: subscription.filter, qos: 1 });
        }
        self.node.handle_connected(self.bd_seq);
        self.carry_out();
    }

    /// The connection breaks.
    pub(crate) fn lose(&mut self) {
        self.node.handle_disconnected();
    }

    pub(crate) fn leave(&mut self) {
        self.node.leave();
        self.carry_out();
    }

    /// A device is there and has a value.
    pub(crate) fn run(&mut self, device: &str, hertz: f64) {
        self.node.set_present(device, true);
        self.set(device, "Status/Output Frequency", Some(Value::Double(hertz)), Quality::Good);
    }

    pub(crate) fn set(&mut self, device: &str, metric: &str, value: Option<Value>, quality: Quality) {
        let reading = Reading { value, quality, unix_ms: self.now.unix_ms };
        self.node.set_device(device, metric, reading).unwrap();
        self.carry_out();
    }

    pub(crate) fn set_errors(&mut self, count: u64) {
        let reading =
            Reading { value: Some(Value::UInt64(count)), quality: Quality::Good, unix_ms: self.now.unix_ms };
        self.node.set_node("Lines/north/Errors", reading).unwrap();
        self.carry_out();
    }

    /// Somebody publishes.
    pub(crate) fn hear(&mut self, topic: &str, payload: &[u8], retain: bool) -> Option<Event> {
        let message = Message { topic: topic.to_owned(), payload: payload.to_vec(), qos: 0, retain };
        self.packets.push(Packet::Heard(message));
        let event = self.node.handle_message(topic, payload, retain, self.now);
        self.events.extend(event.clone());
        self.carry_out();
        event
    }

    pub(crate) fn ask_for_rebirth(&mut self) {
        let payload = written(self.now, "Node Control/Rebirth", Raw::Boolean(true));
        // What answers it is later.
        self.now.unix_ms += 1;
        self.hear("spBv1.0/plant/NCMD/hall 1", &payload, false);
    }

    pub(crate) fn state(&mut self, is_online: bool, timestamp: u64) {
        let state = format!(r#"{{"online":{is_online},"timestamp":{timestamp}}}"#);
        self.hear("spBv1.0/STATE/scada", state.as_bytes(), true);
    }

    /// What was published since then, as `VERB` or `VERB device`.
    pub(crate) fn topics(&self, since: usize) -> Vec<String> {
        let sent = self.packets[since..].iter().filter_map(|packet| match packet {
            Packet::Sent(message) => {
                let levels: Vec<&str> = message.topic.split('/').collect();
                let device = levels.get(4).map_or(String::new(), |device| format!(" {device}"));
                Some(format!("{}{device}", levels[2]))
            }
            _ => None,
        });
        sent.collect()
    }

    pub(crate) fn mark(&self) -> usize {
        self.packets.len()
    }

    pub(crate) fn recording(&self) -> Recording {
        Recording::of(self.packets.clone())
    }

    pub(crate) fn carry_out(&mut self) {
        while let Some(action) = self.node.poll(self.now) {
            match action {
                Action::Publish(message) => {
                    let message = Message {
                        topic: message.topic,
                        payload: message.payload,
                        qos: message.qos,
                        retain: false,
                    };
                    self.packets.push(Packet::Sent(message));
                }
                Action::Disconnect { reconnect } => {
                    self.packets.push(Packet::Disconnect { reason: 0x04 });
                    self.reconnect = Some(reconnect);
                }
            }
        }
    }
}

/// A command that writes one metric by its name.
pub(crate) fn written(now: Now, name: &str, value: Raw) -> Vec<u8> {
    let metric = Metric { name: Some(name.to_owned()), value: Some(value), ..Metric::default() };
    Payload { timestamp: Some(now.unix_ms), seq: None, metrics: vec![metric] }.encode()
}
