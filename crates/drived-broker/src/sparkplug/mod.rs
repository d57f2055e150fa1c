//! The daemon as an edge node of Sparkplug B, and its drives as devices, for the SCADA hosts of an MQTT broker.
//!
//! What may be said, and when, is decided by [`EdgeNode`]; this carries it out, and sets what the drives are like. Nothing
//! waits in a queue of its own: where the broker takes no more, values are said later, as they are then.

mod bd_seq;
mod commanding;
mod historical;
mod looks;
mod metrics;
#[cfg(test)]
mod tests;

use std::{
    collections::{BTreeSet, HashMap},
    sync::{Arc, Mutex, PoisonError, atomic::Ordering},
    time::Duration,
};

use drive_fleet::{Events, Freshness, Received, Snapshot};
use drive_sparkplug::{Action, BdSeq, EdgeNode, Event as Heard, Now, Settings};
use serde_json::Value as Json;
use tokio::{
    sync::{mpsc, oneshot},
    task::{JoinHandle, block_in_place},
    time::{Instant, MissedTickBehavior, interval, timeout},
};

use self::{
    bd_seq::Kept as KeptBdSeq,
    commanding::Commanding,
    historical::{Counts, Historical},
};
use crate::{
    broker::config::{MqttConfig, SparkplugConfig},
    broker::{Arrived, Broker, Event, Goodbye, Kept, Message, Options, Qos, Subscription, Wanted, Will},
    mqtt,
};
use drived_doors::audit::Audit;
use drived_plant::{
    counts::{Id, Samples},
    plant::Plant,
};
use drived_words::{failure::Failure, json::unix};

/// Messages that may wait for the broker: births of many devices are said in parts.
const QUEUE: usize = 1_024;
/// Between two tellings of the lines, whose counters never stand still.
const LINES: Duration = Duration::from_secs(10);
/// Until the broker is asked again whether it takes more.
const ROOM: Duration = Duration::from_millis(20);
/// Outcomes that wait to be told.
const OUTCOMES: usize = 256;
/// How long the goodbye may take.
const CLOSED_WITHIN: Duration = Duration::from_secs(3);

/// A face that only has to be opened: the files that it needs have been read.
pub struct Prepared {
    config: SparkplugConfig,
    options: Options,
    /// Between two looks at the drives.
    interval: Duration,
    bd_seq: KeptBdSeq,
    node: EdgeNode,
}

/// The open face.
pub struct Sparkplug {
    broker: Broker,
    leave: oneshot::Sender<()>,
    /// `None`: nothing of outages is told.
    historical: Option<Arc<Counts>>,
    /// Gives its events back, so that the connection stands until its end.
    task: JoinHandle<mpsc::Receiver<Event>>,
}

impl Sparkplug {
    /// Reads the files of a configuration that wants it: those of the brokers, and the number that outlives the program.
    ///
    /// # Errors
    /// One of them cannot be read, or is none of this.
    pub fn prepared(mqtt: &MqttConfig, sparkplug: &SparkplugConfig) -> Result<Prepared, Failure> {
        let options = mqtt::options(mqtt)?;
        let client_id = format!("{}-sparkplug", options.client_id);
        let options = Options { client_id, is_urgent: |topic| topic.contains("/DCMD/"), ..options };
        Self::prepare(sparkplug.clone(), options, mqtt.interval)
    }

    /// The same with options of a broker, and the time between two looks at the drives.
    fn prepare(config: SparkplugConfig, options: Options, interval: Duration) -> Result<Prepared, Failure> {
        let bd_seq = KeptBdSeq::open(&config.state)
            .map_err(|error| Failure::Input(format!("mqtt.sparkplug: state: {error}")))?;
        let settings = Settings {
            name: config.name.clone(),
            primary_host: config.primary_host.clone(),
            has_other_servers: options.servers.len() > 1,
            rebirth_pause: config.rebirth_pause,
            commands: config.commands.is_some(),
        };
        let node = EdgeNode::new(settings, metrics::of_the_node([], []), now())
            .map_err(|error| Failure::Input(format!("mqtt.sparkplug: {error}")))?;
        let subscribe = |of: drive_sparkplug::Subscription| Subscription {
            filter: of.filter,
            qos: Qos::AtLeastOnce,
            wanted: if of.wants_retained { Wanted::NewsAndKept } else { Wanted::News },
        };
        let subscriptions = node.subscriptions().into_iter().map(subscribe).collect();
        let options = Options { subscriptions, queue: QUEUE, ..options };
        Ok(Prepared { config, options, interval, bd_seq, node })
    }

    /// Says the death of the node, and goodbye. It takes no longer than [`CLOSED_WITHIN`], twice.
    pub async fn close(self) {
        let Self { broker, leave, mut task, .. } = self;
        let _ = leave.send(());
        let events = timeout(CLOSED_WITHIN, &mut task).await;
        broker.end(Goodbye::WithWill, CLOSED_WITHIN).await;
        task.abort();
        drop(events);
    }

    /// Adds what the connection counts.
    pub fn collect(&self, samples: &mut Samples) {
        let counts = self.broker.counts();
        samples.add(Id::SparkplugConnected, &[], f64::from(counts.connected));
        samples.count(Id::SparkplugSent, &[], counts.sent);
        samples.count(Id::SparkplugArrived, &[], counts.arrived);
        for (reason, lost) in counts.lost.by_reason() {
            samples.count(Id::SparkplugLost, &[reason], lost);
        }
        if let Some(counts) = &self.historical {
            for (result, count) in [("told", &counts.told), ("left_out", &counts.left_out)] {
                samples.count(Id::SparkplugHistorical, &[result], count.load(Ordering::Relaxed));
            }
        }
    }
}

impl Prepared {
    /// Connects, and tells and hears from now on. Nothing waits for the broker.
    pub fn open(self, plant: Plant, audit: Audit) -> Sparkplug {
        let Self { config, options, interval, bd_seq, node } = self;
        // One that was open until now has counted on.
        let mut bd_seq = KeptBdSeq::open(&config.state).unwrap_or(bd_seq);
        let number = Arc::new(Mutex::new((0, BdSeq::default())));
        let (name, next) = (config.name.clone(), Arc::clone(&number));
        // What the node hears at the least: every broker lets it ask for that once more.
        let again = options.subscriptions.first().filter(|_| config.historical).cloned();
        let (broker, events) = Broker::start(options, move |attempt| {
            let bd_seq = without_blocking(|| bd_seq.next());
            *next.lock().unwrap_or_else(PoisonError::into_inner) = (attempt.number, bd_seq);
            Some(Will { message: message(EdgeNode::will(&name, bd_seq, now())) })
        });
        let (outcomes, told) = mpsc::channel(OUTCOMES);
        let (leave, leaves) = oneshot::channel();
        let fleet_events = plant.fleet().events();
        let commanding = Commanding::new(&config, plant.clone(), audit, outcomes);
        let counts = again.as_ref().map(|_| Arc::<Counts>::default());
        let whom = format!("sparkplug {}/{}", config.name.group, config.name.edge_node);
        let historical = again
            .zip(counts.clone())
            .map(|(again, counts)| Historical::new(plant.clone(), whom, again, counts));
        let (drives, ids) = Default::default();
        let broker_too = broker.clone();
        let face =
            Face { plant, node, broker: broker_too, connection: None, commanding, historical, drives, ids };
        let task = tokio::spawn(face.run(events, number, told, fleet_events, leaves, interval));
        Sparkplug { broker, leave, historical: counts, task }
    }
}

/// The one task that numbers and publishes.
struct Face {
    plant: Plant,
    node: EdgeNode,
    broker: Broker,
    /// The number of the connection.
    connection: Option<u64>,
    commanding: Commanding,
    /// `None`: nothing of outages is told.
    historical: Option<Historical>,
    /// By their ids, which are those of the devices.
    drives: HashMap<String, Seen>,
    /// The ids of the lines and of the drives by which the metrics of the node are defined.
    ids: (BTreeSet<String>, BTreeSet<String>),
}

/// A drive as it was told last.
#[derive(Default)]
struct Seen {
    snapshot: Option<Arc<Snapshot>>,
    freshness: Option<(Freshness, Freshness)>,
    /// What became of its last command.
    last: Json,
}

impl Face {
    async fn run(
        mut self,
        mut events: mpsc::Receiver<Event>,
        number: Arc<Mutex<(u64, BdSeq)>>,
        mut told: mpsc::Receiver<(Option<String>, Json)>,
        mut fleet_events: Events,
        mut leaves: oneshot::Receiver<()>,
        pace: Duration,
    ) -> mpsc::Receiver<Event> {
        let mut looks = interval(pace);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut lines = interval(LINES);
        lines.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (mut has_more, mut is_over) = (false, false);
        let mut alarms = self.plant.alarm_changes();
        loop {
            let deadline = self.node.deadline().map(Instant::from_std);
            let again = has_more.then(|| Instant::now() + ROOM).into_iter().chain(deadline).min();
            let past = self.historical.as_ref().and_then(Historical::due);
            let (mut looked_at, mut goes_on) = (None, false);
            tokio::select! {
                event = events.recv() => match event {
                    Some(Event::Connected(attempt)) => {
                        let (of, bd_seq) = *number.lock().unwrap_or_else(PoisonError::into_inner);
                        // Else that connection has ended already.
                        if of == attempt.number {
                            self.connection = Some(attempt.number);
                            self.node.handle_connected(bd_seq);
                            self.historical.iter_mut().for_each(Historical::begin_anew);
                            self.look();
                            self.look_at_lines();
                        }
                    }
                    Some(Event::Disconnected) => {
                        self.connection = None;
                        self.node.handle_disconnected();
                        self.historical.iter_mut().for_each(Historical::begin_anew);
                    }
                    Some(Event::Message(arrived)) => self.hear(&arrived),
                    None => return events,
                },
                Some((drive, last)) = told.recv() => match drive {
                    Some(drive) => self.tell_outcome(&drive, last),
                    None => self.tell_done(&last),
                },
                Ok(()) = alarms.changed() => self.look_at_alarms(),
                received = fleet_events.recv(), if !is_over => match received {
                    // A trip, a loss: at once.
                    Received::Event(_) | Received::Missed(_) => self.look(),
                    Received::End => is_over = true,
                },
                _ = looks.tick() => {
                    looked_at = Some(Instant::now());
                    self.look();
                }
                came = came(&mut self.historical) => {
                    if let Some(historical) = &mut self.historical {
                        historical.take(came, &self.node);
                    }
                }
                () = until(past) => goes_on = true,
                _ = lines.tick() => self.look_at_lines(),
                () = until(again) => {}
                _ = &mut leaves => {
                    self.node.leave();
                    self.carry_out();
                    return events;
                }
            }
            has_more = self.carry_out();
            if !has_more {
                self.note_live(looked_at);
            }
            if goes_on {
                self.tell_the_past(has_more);
            }
        }
    }

    /// Notes that the births have been published, and everything that was seen at `looked_at`.
    fn note_live(&mut self, looked_at: Option<Instant>) {
        if let Some(historical) = &mut self.historical
            && self.connection.is_some()
            && self.node.is_told()
        {
            historical.born(Instant::now());
            looked_at.into_iter().for_each(|at| historical.live(at));
        }
    }

    /// Says what is next of the past, unless something that is so now waits.
    fn tell_the_past(&mut self, has_more: bool) {
        let Some(historical) = &mut self.historical else { return };
        let is_free = !has_more && self.node.is_told() && self.broker.counts().waiting == 0;
        match self.connection.filter(|_| is_free) {
            None => historical.stand_by(),
            Some(connection) => {
                if !historical.go_on(&mut self.node, &self.broker, connection, now()) {
                    self.part();
                }
            }
        }
    }

    /// Carries out what the node has to say. True: the broker takes no more of it now.
    fn carry_out(&mut self) -> bool {
        let Some(connection) = self.connection else { return false };
        loop {
            if self.broker.counts().waiting >= QUEUE / 2 {
                return true;
            }
            match self.node.poll(now()) {
                None => return false,
                Some(Action::Publish(publication)) => {
                    if !self.broker.publish(message(publication), Kept::OfConnection(connection)) {
                        // Without it the numbers would have a gap: the session is over, and begins anew.
                        self.part();
                        return false;
                    }
                }
                Some(Action::Disconnect { .. }) => {
                    self.part();
                    return false;
                }
            }
        }
    }

    /// Ends the connection, after what it has been given.
    fn part(&mut self) {
        self.connection = None;
        self.node.handle_disconnected();
        self.historical.iter_mut().for_each(Historical::begin_anew);
        self.broker.leave(Goodbye::WithWill);
    }

    /// What somebody has published for this node.
    fn hear(&mut self, arrived: &Arrived) {
        match self.node.handle_message(&arrived.topic, &arrived.payload, arrived.retain, now()) {
            Some(Heard::Command(command)) => {
                self.commanding.handle(command, arrived, self.node.is_alive());
            }
            Some(Heard::RebirthAsked) => tracing::debug!("Sparkplug: a host asks for the births"),
            Some(Heard::HostOnline) => tracing::info!("Sparkplug: the primary host is online"),
            Some(Heard::HostOffline) => tracing::warn!("Sparkplug: the primary host is offline"),
            // A broker may send anything.
            Some(Heard::Ignored(why)) => tracing::debug!("Sparkplug: {}: {why}", arrived.topic),
            None => {}
        }
    }

    /// Sets what became of a command to a device, and says it before anything else becomes of it.
    fn tell_outcome(&mut self, device: &str, last: Json) {
        if let Some(seen) = self.drives.get_mut(device) {
            seen.last = last;
            seen.snapshot = None;
            self.look();
            self.carry_out();
        }
    }

    /// Says what was done with alarms by what a host has written.
    fn tell_done(&mut self, done: &Json) {
        for (metric, reading) in metrics::read_done(done, now().unix_ms) {
            let _ = self.node.set_node(metric, reading);
        }
        self.look_at_alarms();
        self.carry_out();
    }
}

/// Waits for what comes to who tells the past, or for ever.
async fn came(historical: &mut Option<Historical>) -> historical::Came {
    match historical {
        Some(historical) => historical.came().await,
        None => std::future::pending().await,
    }
}

/// Waits until a time, or for ever.
async fn until(at: Option<Instant>) {
    match at {
        Some(at) => tokio::time::sleep_until(at).await,
        None => std::future::pending().await,
    }
}

fn now() -> Now {
    let now = Instant::now();
    Now { at: now.into_std(), unix_ms: unix(now) }
}

fn message(publication: drive_sparkplug::Publication) -> Message {
    let qos = if publication.qos == 0 { Qos::AtMostOnce } else { Qos::AtLeastOnce };
    Message { qos, ..Message::new(publication.topic, publication.payload) }
}

/// Lets other tasks of this thread go on elsewhere while a disk is waited for.
fn without_blocking<T>(wait: impl FnOnce() -> T) -> T {
    match tokio::runtime::Handle::current().runtime_flavor() {
        tokio::runtime::RuntimeFlavor::MultiThread => block_in_place(wait),
        _ => wait(),
    }
}
