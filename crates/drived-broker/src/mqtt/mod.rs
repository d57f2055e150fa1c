//! The plant on an MQTT v5 broker: what it is like, what is asked of it there, and how Home Assistant finds it.
//!
//! Everything stands on [`broker`](crate::broker), which never holds up anybody. State is retained and expires, so that
//! nothing of a daemon that is gone looks alive; commands are judged by the [desk](crate::desk) before the plant hears of them.

mod alarms;
mod commanding;
mod discovery;
mod gone;
mod last;
mod parts;
mod telling;
#[cfg(test)]
mod tests;
mod topics;

use std::{collections::HashMap, sync::Arc, time::Duration};

use drive_fleet::{DriveHandle, EventKind, Received};
use tokio::{
    sync::{Notify, mpsc, watch},
    task::JoinHandle,
    time::{Instant, MissedTickBehavior, interval, sleep_until},
};

use self::{
    alarms::Alarms, commanding::Commanding, discovery::Discovered, gone::Gone, last::LastCommands,
    telling::Teller, topics::Topics,
};
use crate::broker::{
    Broker, Event, Goodbye, Kept, Login, Message, Options, Qos, Secured, Server, Subscription, Wanted, Will,
    config::{Address, Discovery, MqttConfig},
};
use drived_config::{
    host::host_name,
    names::{Kind, Names},
};
use drived_doors::{audit::Audit, secret};
use drived_plant::{
    counts::{Id, Samples},
    plant::Plant,
};
use drived_words::{failure::Failure, json::unix};

/// The longest silence before the broker is asked for a sign of life; half as much again, and the broker publishes the will.
const KEEP_ALIVE: Duration = Duration::from_secs(20);
/// News that may wait for a broker that is away.
const NEWS: usize = 1_000;
/// Between two looks at which drives there are.
const LOOKS: Duration = Duration::from_secs(1);
/// When Home Assistant has begun, everything is told again after a time of up to this.
const BIRTH: Duration = Duration::from_secs(5);
/// How long the goodbye may take.
const CLOSED_WITHIN: Duration = Duration::from_secs(3);

/// What holds for the whole face.
struct Face {
    plant: Plant,
    config: MqttConfig,
    topics: Topics,
    broker: Broker,
    /// Where it is, for whoever is told of two under one base.
    host: Option<String>,
    instance: String,
    /// The newest line of the audit log.
    audited: watch::Receiver<Option<String>>,
    /// Rises when everything is to be told again.
    anew: watch::Sender<u64>,
}

impl Face {
    /// Tells state, which the broker keeps until it has not been told again for three heartbeats.
    fn tell(&self, topic: String, payload: String) {
        let then = Instant::now() + self.config.heartbeat * 3;
        let expires = drive_fleet::mutant!("state-for-ever", Some(then), None);
        let message = Message { qos: Qos::AtMostOnce, expires, ..Message::new(topic, payload).retained() };
        self.broker.publish(message, Kept::Latest);
    }

    /// Tells what holds until it is told otherwise.
    fn tell_for_good(&self, topic: String, payload: impl Into<bytes::Bytes>) {
        self.broker.publish(Message::new(topic, payload).retained(), Kept::Latest);
    }
}

/// A face that only has to be opened: the files that it needs have been read.
pub struct Prepared {
    config: MqttConfig,
    options: Options,
}

/// The open face.
pub struct Mqtt {
    face: Arc<Face>,
    closed: Arc<Notify>,
    /// Gives its events back, so that the connection stands until its end.
    task: JoinHandle<mpsc::Receiver<Event>>,
}

impl Mqtt {
    /// Reads the files of a configuration.
    ///
    /// # Errors
    /// A certificate, a key or a password cannot be read.
    pub fn prepare(config: MqttConfig) -> Result<Prepared, Failure> {
        let options = Options {
            subscriptions: subscriptions(&config),
            queue: NEWS,
            is_urgent: topics::is_urgent,
            ..options(&config)?
        };
        Ok(Prepared { config, options })
    }

    /// Says goodbye. It takes no longer than [`CLOSED_WITHIN`].
    pub async fn close(self) {
        let Self { face, closed, task, .. } = self;
        closed.notify_one();
        let events = task.await;
        telling::tell_head(&face);
        face.tell_for_good(face.topics.status(), "offline");
        face.broker.clone().end(Goodbye::Normal, CLOSED_WITHIN).await;
        drop(events);
    }

    /// Adds what it counts.
    pub fn collect(&self, samples: &mut Samples) {
        let counts = self.face.broker.counts();
        samples.add(Id::MqttConnected, &[], f64::from(counts.connected));
        samples.count(Id::MqttWaiting, &[], counts.waiting as u64);
        samples.count(Id::MqttSent, &[], counts.sent);
        samples.count(Id::MqttArrived, &[], counts.arrived);
        for (reason, lost) in counts.lost.by_reason() {
            samples.count(Id::MqttLost, &[reason], lost);
        }
    }
}

/// What a connection to the brokers of a configuration begins with, whatever it is for.
///
/// # Errors
/// A certificate, a key or a password cannot be read.
pub fn options(config: &MqttConfig) -> Result<Options, Failure> {
    let encrypted = config.servers.iter().any(|server| server.tls);
    let secured = || Secured::open(config.authorities.as_deref(), config.identity.as_ref());
    let secured =
        encrypted.then(secured).transpose().map_err(|error| Failure::Input(format!("mqtt: {error}")))?;
    let server = |address: &Address| Server {
        host: address.host.clone(),
        port: address.port,
        tls: secured.clone().filter(|_| address.tls),
    };
    Ok(Options {
        servers: config.servers.iter().map(server).collect(),
        client_id: config.client_id.clone(),
        login: login(config)?,
        keep_alive: KEEP_ALIVE,
        subscriptions: Vec::new(),
        queue: 0,
        is_urgent: |_| false,
        #[cfg(test)]
        dial: None,
    })
}

fn login(config: &MqttConfig) -> Result<Option<Login>, Failure> {
    let Some(user) = config.user.clone() else { return Ok(None) };
    let password = config.password.as_deref().map(secret).transpose();
    let password = password.map_err(|error| Failure::Input(format!("mqtt: {error}")))?;
    Ok(Some(Login { user, password }))
}

/// Commands are never taken from what the broker has kept: it is asked not to send that, and what comes with the flag is
/// refused.
fn subscriptions(config: &MqttConfig) -> Vec<Subscription> {
    let topics = Topics::new(config, Names::default());
    let commands = config.commands.then(|| topics.command_filters().into_iter().chain([topics.echo()]));
    let commands = commands.into_iter().flatten();
    let birth = (config.discovery != Discovery::Off).then(|| topics.birth());
    commands
        .chain(birth)
        .map(|filter| Subscription { filter, qos: Qos::AtLeastOnce, wanted: Wanted::News })
        .collect()
}

impl Prepared {
    /// Connects, and tells and asks from now on. Nothing waits for the broker.
    pub fn open(self, plant: Plant, audit: Audit, names: Names) -> Mqtt {
        let Self { config, options } = self;
        let topics = Topics::new(&config, names);
        let will = Will { message: Message::new(topics.status(), "offline").retained() };
        let (broker, events) =
            Broker::start(options, move |_| drive_fleet::mutant!("no-will", Some(will.clone()), None));
        let audited = audit.head();
        let (host, instance, anew) = (host_name(), instance(), watch::Sender::new(0));
        let face = Arc::new(Face { plant, config, topics, broker, host, instance, audited, anew });
        let commanding = Commanding::new(Arc::clone(&face), audit);
        let closed = Arc::new(Notify::new());
        let task = tokio::spawn(keep(Arc::clone(&face), events, commanding, Arc::clone(&closed)));
        Mqtt { face, closed, task }
    }
}

/// Tells what there is, and hears what is asked, until it is closed.
async fn keep(
    face: Arc<Face>,
    mut events: mpsc::Receiver<Event>,
    mut commanding: Commanding,
    closed: Arc<Notify>,
) -> mpsc::Receiver<Event> {
    let mut looks = interval(LOOKS);
    looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut tellers: HashMap<Arc<str>, Watched> = HashMap::new();
    let (mut daemon, mut gone) = (telling::Daemon::default(), Gone::new());
    let (mut alarms, mut last) = (Alarms::new(&face), LastCommands::new(&face));
    let mut birth = None;
    let mut happened = Some(face.plant.fleet().events());
    loop {
        let next = async {
            match &mut happened {
                Some(events) => events.recv().await,
                None => std::future::pending().await,
            }
        };
        let born = async {
            match birth {
                Some(at) => sleep_until(at).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            event = events.recv() => match event {
                Some(Event::Connected(_)) => {
                    // Before it is told anew what is there.
                    gone.connected(&face);
                    if drive_fleet::mutant!("back-and-silent", true, false) {
                        face.tell_for_good(face.topics.status(), "online");
                    }
                    face.anew.send_modify(|number| *number += 1);
                    daemon.tell(&face, true);
                    alarms.tell(&face, true);
                    last.tell(&face, true);
                    commanding.connected();
                }
                Some(Event::Disconnected) => {}
                Some(Event::Message(arrived)) if arrived.topic == face.topics.birth() => {
                    if arrived.payload.as_ref() == b"online" {
                        birth = Some(Instant::now() + some_of(BIRTH));
                    }
                }
                Some(Event::Message(arrived)) => {
                    if !gone.hear(&face, &arrived, &daemon.discovered) {
                        commanding.handle(&arrived);
                    }
                }
                None => return events,
            },
            received = next => match received {
                Received::Event(event) => {
                    telling::tell_event(&face, &event);
                    // What was asked before it may be on its way still: from the next call on nothing is.
                    if matches!(event.kind, EventKind::StateChanged { .. }) {
                        commanding.call();
                    }
                }
                Received::Missed(_) => {}
                Received::End => happened = None,
            },
            () = closed.notified() => return events,
            _ = looks.tick() => {
                look(&face, &mut tellers, &mut gone);
                gone.look(&face);
                daemon.tell(&face, false);
                alarms.tell(&face, false);
                last.tell(&face, false);
                commanding.call();
            }
            () = born => {
                birth = None;
                face.tell_for_good(face.topics.status(), "online");
                face.anew.send_modify(|number| *number += 1);
                daemon.tell(&face, true);
                alarms.tell(&face, true);
                last.tell(&face, true);
            }
            () = alarms.changed() => alarms.tell(&face, false),
            () = last.changed() => last.tell(&face, false),
        }
    }
}

/// A drive that is told.
struct Watched {
    /// By which it was told.
    id: String,
    task: JoinHandle<()>,
    discovered: Discovered,
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Tells the drives that have come, and takes back what was told of those that have gone.
fn look(face: &Arc<Face>, tellers: &mut HashMap<Arc<str>, Watched>, taken_back: &mut Gone) {
    let mut there: Vec<(Arc<str>, Arc<str>, DriveHandle)> = Vec::new();
    for (line, _) in face.plant.fleet().lines() {
        for drive in face.plant.fleet().drives_on(&line) {
            there.push((Arc::clone(drive.name()), Arc::clone(&line), drive));
        }
    }
    let gone = |name: &Arc<str>| !there.iter().any(|(known, ..)| known == name);
    tellers.retain(|name, watched| {
        if !gone(name) {
            return true;
        }
        watched.task.abort();
        if gone::is_here(face, &watched.id) {
            // It is told by another name.
            return false;
        }
        if face.topics.has(Kind::Drive, &watched.id) {
            // It will be in a moment, or is gone then.
            return true;
        }
        watched.discovered.take_back(face);
        taken_back.take_back(face, &watched.id);
        false
    });
    for (name, line, drive) in there {
        // A drive that ended and began anew is another one.
        if tellers.get(&name).is_none_or(|watched| watched.task.is_finished()) {
            let (id, discovered) = (face.topics.id(Kind::Drive, &name), Discovered::default());
            let teller = Teller::new(Arc::clone(face), line, drive, discovered.clone());
            tellers.insert(name, Watched { id, task: tokio::spawn(teller.run()), discovered });
        }
    }
}

/// A text that no other daemon has, the lesser the earlier it began.
fn instance() -> String {
    let mut bytes = [0; 8];
    // Without randomness its time alone tells it from others.
    let _ = getrandom::fill(&mut bytes);
    let drawn: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{:015}-{drawn}", unix(Instant::now()))
}

/// A part of a time, drawn.
fn some_of(time: Duration) -> Duration {
    let mut byte = [u8::MAX];
    let _ = getrandom::fill(&mut byte);
    time * u32::from(byte[0]) / u32::from(u8::MAX)
}
