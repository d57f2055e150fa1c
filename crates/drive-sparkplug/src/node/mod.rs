//! The edge node: one writer of all messages, so that their numbers have no gap.

mod events;
mod hearing;

use std::time::Instant;

pub use self::events::{
    Action, Command, DeviceError, Event, Ignored, Now, PastError, Publication, Settings, Subscription, Write,
    WriteError,
};
use crate::{
    BdSeq, Definition, Id, Metric, MetricError, NodeName, Payload, Reading, Value,
    host::Host,
    metrics::{Metrics, in_order, own},
    topic::{Verb, state_topic},
};

/// The metric by which a host asks for the births again. It never has an alias.
pub(crate) const REBIRTH: &str = "Node Control/Rebirth";
/// The metric that joins a death to its birth.
pub(crate) const BD_SEQ: &str = "bdSeq";

/// A Sparkplug B edge node: what it has to say, and when.
///
/// It has no clock and no socket. Its caller connects, hands in what happens by the `handle_…` functions, sets what is
/// known by [`Self::set_node`], [`Self::set_device`] and [`Self::set_present`], and carries out what [`Self::poll`] says,
/// until it says nothing. What changes while nothing is polled is said once, as it is then: slow connections lose no
/// message and hold no queue.
#[derive(Debug)]
pub struct EdgeNode {
    settings: Settings,
    session: Session,
    bd_seq: BdSeq,
    /// Of the message before.
    seq: u8,
    host: Host,
    metrics: Metrics,
    devices: Vec<Device>,
    next_alias: u64,
    born_at: Option<Instant>,
    /// When the births that were asked for may be sent.
    rebirth_at: Option<Instant>,
}

/// How far the session is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Session {
    /// There is no connection, or none yet.
    Away,
    /// The primary host is not there.
    Waiting,
    /// The birth of the node is the next message.
    Birth,
    Alive,
    /// The death of the node is the next message.
    Leaving {
        reconnect: bool,
    },
    /// It has been said; the connection is to be ended.
    Left {
        reconnect: bool,
    },
}

#[derive(Debug)]
struct Device {
    id: Id,
    metrics: Metrics,
    /// Whether it answers.
    is_present: bool,
    /// Whether a birth has told so in this session.
    is_born: bool,
    /// Whether it is to be forgotten.
    is_removed: bool,
}

impl EdgeNode {
    /// A node with metrics of its own and no devices. Besides its own it has `bdSeq` and `Node Control/Rebirth`.
    ///
    /// # Errors
    /// [`MetricError::Taken`].
    pub fn new(settings: Settings, metrics: Vec<Definition>, now: Now) -> Result<Self, MetricError> {
        let mut next_alias = 0;
        let metrics = Metrics::new(metrics, &[BD_SEQ, REBIRTH], &mut next_alias, now.unix_ms)?;
        Ok(Self {
            settings,
            session: Session::Away,
            bd_seq: BdSeq::default(),
            seq: 0,
            host: Host::default(),
            metrics,
            devices: Vec::new(),
            next_alias,
            born_at: None,
            rebirth_at: None,
        })
    }

    /// A device that is not present yet.
    ///
    /// # Errors
    /// [`DeviceError`], when its name is none, is taken, or one of its metrics is wrong.
    pub fn add_device(&mut self, id: &str, metrics: Vec<Definition>, now: Now) -> Result<(), DeviceError> {
        let id = Id::new(id)?;
        if self.devices.iter().any(|device| !device.is_removed && device.id.is_like(&id)) {
            return Err(DeviceError::Taken(id.to_string()));
        }
        let metrics = Metrics::new(metrics, &[], &mut self.next_alias, now.unix_ms)?;
        self.devices.push(Device { id, metrics, is_present: false, is_born: false, is_removed: false });
        Ok(())
    }

    /// Forgets a device; one that was born dies before.
    pub fn remove_device(&mut self, id: &str) {
        if let Some(device) = self.device(id) {
            device.is_removed = true;
            device.is_present = false;
        }
    }

    /// Gives the node other metrics of its own, without values. They are told by births of everything.
    ///
    /// # Errors
    /// [`MetricError::Taken`]; the old ones stay.
    pub fn define(&mut self, metrics: Vec<Definition>, now: Now) -> Result<(), MetricError> {
        self.metrics = Metrics::new(metrics, &[BD_SEQ, REBIRTH], &mut self.next_alias, now.unix_ms)?;
        if self.is_alive() {
            self.session = Session::Birth;
        }
        Ok(())
    }

    /// The names of the devices.
    pub fn devices(&self) -> impl Iterator<Item = &str> {
        self.devices.iter().filter(|device| !device.is_removed).map(|device| device.id.as_str())
    }

    /// What a metric of the node holds.
    ///
    /// # Errors
    /// [`MetricError::Unknown`] and [`MetricError::WrongType`].
    pub fn set_node(&mut self, metric: &str, reading: Reading) -> Result<(), MetricError> {
        self.metrics.set(metric, reading)
    }

    /// What a metric of a device holds, whether or not it is present.
    ///
    /// # Errors
    /// [`MetricError::Unknown`], also when there is no such device, and [`MetricError::WrongType`].
    pub fn set_device(&mut self, id: &str, metric: &str, reading: Reading) -> Result<(), MetricError> {
        match self.device(id) {
            Some(device) => device.metrics.set(metric, reading),
            None => Err(MetricError::Unknown(format!("{id}/{metric}"))),
        }
    }

    /// Whether a device answers: it is born when it does, and dies when it does not any more.
    pub fn set_present(&mut self, id: &str, is_present: bool) {
        if let Some(device) = self.device(id) {
            device.is_present = is_present;
        }
    }

    /// The will of a connection that is to be made: the death of the node. The connection begins a session of its own: MQTT 5
    /// with Clean Start and a Session Expiry of 0, or MQTT 3.1.1 with Clean Session. `bd_seq` is the one after that of the
    /// connection before, and has been kept.
    pub fn will(name: &NodeName, bd_seq: BdSeq, now: Now) -> Publication {
        let bd_seq = own(BD_SEQ, &Value::Int64(bd_seq.number().into()), now.unix_ms);
        let payload = Payload { timestamp: Some(now.unix_ms), seq: None, metrics: vec![bd_seq] };
        Publication { topic: name.topic(Verb::Death, None), payload: payload.encode(), qos: 1 }
    }

    /// What every connection has to subscribe, before anything is said in it.
    pub fn subscriptions(&self) -> Vec<Subscription> {
        let name = &self.settings.name;
        let mut all = vec![Subscription { filter: name.topic(Verb::Command, None), wants_retained: false }];
        if self.settings.commands {
            // Of every device there is or will be.
            let filter = format!("{}/+", name.topic(Verb::Command, None).replacen("NCMD", "DCMD", 1));
            all.push(Subscription { filter, wants_retained: false });
        }
        if let Some(host) = &self.settings.primary_host {
            all.push(Subscription { filter: state_topic(host), wants_retained: true });
        }
        all
    }

    /// A session with the [will](Self::will) of this number is there, and what it hears is subscribed.
    pub fn handle_connected(&mut self, bd_seq: BdSeq) {
        self.handle_disconnected();
        self.bd_seq = bd_seq;
        self.host = Host::default();
        let must_wait = self.settings.primary_host.is_some();
        self.session = if must_wait { Session::Waiting } else { Session::Birth };
    }

    /// The connection has ended.
    pub fn handle_disconnected(&mut self) {
        self.session = Session::Away;
        self.born_at = None;
        self.rebirth_at = None;
        self.devices.retain(|device| !device.is_removed);
        for device in &mut self.devices {
            device.is_born = false;
        }
    }

    /// Ends the session: the death of the node, then the connection's end.
    pub fn leave(&mut self) {
        self.part(false);
    }

    /// Whether its birth has been told in this session, and its death has not.
    pub fn is_alive(&self) -> bool {
        self.session == Session::Alive
    }

    /// When [`Self::poll`] will have something to say though nothing happens.
    pub fn deadline(&self) -> Option<Instant> {
        self.rebirth_at.filter(|_| self.is_alive())
    }

    /// What is to be done next; ask until it is nothing.
    pub fn poll(&mut self, now: Now) -> Option<Action> {
        match self.session {
            Session::Away | Session::Waiting => None,
            Session::Birth => Some(Action::Publish(self.birth(now))),
            Session::Alive => self.poll_alive(now),
            Session::Leaving { reconnect } => {
                self.session = Session::Left { reconnect };
                Some(Action::Publish(Self::will(&self.settings.name, self.bd_seq, now)))
            }
            Session::Left { reconnect } => {
                self.handle_disconnected();
                Some(Action::Disconnect { reconnect })
            }
        }
    }

    fn poll_alive(&mut self, now: Now) -> Option<Action> {
        if self.rebirth_at.is_some_and(|due| due <= now.at) {
            return Some(Action::Publish(self.birth(now)));
        }
        if let Some(place) = self.devices.iter().position(|device| device.is_present != device.is_born) {
            return Some(Action::Publish(self.birth_or_death(place, now)));
        }
        self.devices.retain(|device| !device.is_removed);
        // Whoever has asked for births is told no data before them.
        if self.rebirth_at.is_some() {
            return None;
        }
        let changes = self.metrics.changes();
        if !changes.is_empty() {
            return Some(Action::Publish(self.message(Verb::Data, None, changes, now)));
        }
        for place in 0..self.devices.len() {
            let device = &mut self.devices[place];
            let changes = if device.is_born { device.metrics.changes() } else { Vec::new() };
            if !changes.is_empty() {
                let id = device.id.clone();
                return Some(Action::Publish(self.message(Verb::Data, Some(&id), changes, now)));
            }
        }
        None
    }

    /// Whether everything that is held has been told, as far as [`Self::poll`] has nothing more to say: there is a birth, and none is
    /// awaited.
    pub fn is_told(&self) -> bool {
        self.is_alive() && self.rebirth_at.is_none()
    }

    /// Whether a device can be told of: its birth has been said in this session.
    pub fn is_born(&self, id: &str) -> bool {
        self.devices.iter().any(|device| device.id.as_str() == id && device.is_born && device.is_present)
    }

    /// What a device held in the past, as data by which nobody takes it for what it holds now. The message has its number: publish it before
    /// anything else that [`Self::poll`] says, and poll before it until that is nothing, so that what is so now is told first.
    ///
    /// Each reading tells its own time and its quality. They may stand in any order.
    ///
    /// # Errors
    /// [`PastError`], and then nothing is to be said: it can be told later, or never.
    pub fn past(
        &mut self,
        id: &str,
        readings: impl IntoIterator<Item = (impl AsRef<str>, Reading)>,
        now: Now,
    ) -> Result<Publication, PastError> {
        if !self.is_told() || !self.is_born(id) {
            return Err(PastError::NotBorn(id.to_owned()));
        }
        let device = self.devices.iter().find(|device| device.id.as_str() == id && device.is_born);
        let device = device.ok_or_else(|| PastError::NotBorn(id.to_owned()))?;
        let told = readings.into_iter().map(|(name, reading)| device.metrics.past(name.as_ref(), reading));
        let (metrics, id) = (told.collect::<Result<Vec<_>, _>>()?, device.id.clone());
        Ok(self.message(Verb::Data, Some(&id), metrics, now))
    }

    /// The birth of the node: everything that was born before it is born again behind it.
    fn birth(&mut self, now: Now) -> Publication {
        self.session = Session::Alive;
        self.born_at = Some(now.at);
        self.rebirth_at = None;
        self.devices.retain(|device| !device.is_removed);
        for device in &mut self.devices {
            device.is_born = false;
        }
        let bd_seq = Value::Int64(self.bd_seq.number().into());
        let own = [own(BD_SEQ, &bd_seq, now.unix_ms), own(REBIRTH, &Value::Boolean(false), now.unix_ms)];
        let metrics = in_order(self.metrics.birth().into_iter().chain(own));
        // The next number after 255 is 0.
        self.seq = u8::MAX;
        self.message(Verb::Birth, None, metrics, now)
    }

    fn birth_or_death(&mut self, place: usize, now: Now) -> Publication {
        let device = &mut self.devices[place];
        device.is_born = device.is_present;
        let (verb, metrics) =
            if device.is_born { (Verb::Birth, device.metrics.birth()) } else { (Verb::Death, Vec::new()) };
        let id = device.id.clone();
        self.message(verb, Some(&id), metrics, now)
    }

    /// A message with the next number.
    fn message(&mut self, verb: Verb, device: Option<&Id>, metrics: Vec<Metric>, now: Now) -> Publication {
        self.seq = self.seq.wrapping_add(1);
        let payload = Payload { timestamp: Some(now.unix_ms), seq: Some(self.seq.into()), metrics };
        Publication { topic: self.settings.name.topic(verb, device), payload: payload.encode(), qos: 0 }
    }

    /// Ends the session. The death of the node is told even where its birth was not.
    fn part(&mut self, reconnect: bool) {
        if self.session != Session::Away {
            self.session = Session::Leaving { reconnect };
        }
    }

    fn device(&mut self, id: &str) -> Option<&mut Device> {
        self.devices.iter_mut().find(|device| !device.is_removed && device.id.as_str() == id)
    }
}
