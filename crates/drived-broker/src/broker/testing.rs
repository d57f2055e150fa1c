//! A broker in memory, for tests in virtual time: as much of MQTT v5 as they need.

use std::{
    collections::BTreeMap,
    io,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use bytes::BytesMut;
use rumqttc::{
    ConnAck, ConnAckProperties, ConnectReturnCode, Packet, PubAck, PubAckReason, Publish, SubAck,
    SubscribeReasonCode,
};
use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _, DuplexStream, duplex},
    sync::{Notify, mpsc},
};

use super::{Options, Qos, Server};

/// How a connection is made.
pub type Dial = Arc<dyn Fn() -> io::Result<DuplexStream> + Send + Sync>;

/// How the broker behaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Conduct {
    #[default]
    Usual,
    /// It cannot be reached.
    Away,
    /// It accepts and never answers.
    Silent,
    /// It answers CONNECT and acknowledges nothing else.
    Deaf,
}

/// What it has seen and how it behaves; cheap to clone.
#[derive(Clone, Default)]
pub struct TestBroker(Arc<Inner>);

#[derive(Default)]
struct Inner {
    state: Mutex<State>,
    changed: Notify,
}

#[derive(Default)]
struct State {
    conduct: Conduct,
    largest: Option<u32>,
    /// CONNECT with its will, SUBSCRIBE, DISCONNECT, as they came; publishes are in `published`.
    packets: Vec<Packet>,
    published: Vec<Publish>,
    retained: BTreeMap<String, Publish>,
    counted: u64,
    forgets: bool,
    /// What is to be delivered, while it is held up.
    held: Option<Vec<Publish>>,
    client: Option<mpsc::UnboundedSender<Option<Publish>>>,
}

impl TestBroker {
    /// Options for connections to it.
    pub fn options(&self) -> Options {
        let inner = Arc::clone(&self.0);
        let dial: Dial = Arc::new(move || inner.accept());
        Options {
            servers: vec![Server { host: "memory".to_owned(), port: 1883, tls: None }],
            client_id: "drived".to_owned(),
            login: None,
            keep_alive: std::time::Duration::from_secs(30),
            subscriptions: Vec::new(),
            queue: 8,
            is_urgent: |_| false,
            dial: Some(dial),
        }
    }

    pub fn behave(&self, conduct: Conduct) {
        self.state().conduct = conduct;
    }

    /// Announces the largest packet that it takes.
    pub fn takes_at_most(&self, bytes: u32) {
        self.state().largest = Some(bytes);
    }

    /// Keeps only what is retained, and counts the rest.
    pub fn forget(&self) {
        self.state().forgets = true;
    }

    /// Ends the present connection.
    pub fn cut(&self) {
        if let Some(client) = self.state().client.take() {
            let _ = client.send(None);
        }
    }

    /// Sends a message to the client.
    pub fn deliver(&self, publish: Publish) {
        self.state().deliver(publish);
    }

    /// Keeps a message as somebody else has published it.
    pub fn retain(&self, topic: &str, payload: &str) {
        let publish = Publish { retain: true, ..publish(topic, payload, Qos::AtLeastOnce) };
        self.state().retained.insert(topic.to_owned(), publish);
    }

    /// Holds up whatever is to be delivered.
    pub fn hold(&self) {
        self.state().held = Some(Vec::new());
    }

    /// Delivers what was held up, in its order.
    pub fn release(&self) {
        let mut state = self.state();
        for publish in state.held.take().unwrap_or_default() {
            state.deliver(publish);
        }
    }

    /// The topics and payloads that were published so far.
    pub fn published(&self) -> Vec<(String, String)> {
        self.state().published.iter().map(words).collect()
    }

    pub fn publishes(&self) -> Vec<Publish> {
        self.state().published.clone()
    }

    pub fn packets(&self) -> Vec<Packet> {
        self.state().packets.clone()
    }

    pub fn retained(&self) -> BTreeMap<String, Publish> {
        self.state().retained.clone()
    }

    /// How many messages were published.
    pub fn counted(&self) -> u64 {
        self.state().counted
    }

    /// Waits until what was seen is as it should be.
    pub async fn until(&self, is_so: impl Fn(&Self) -> bool) {
        loop {
            let changed = self.0.changed.notified();
            if is_so(self) {
                return;
            }
            changed.await;
        }
    }

    /// Waits until a message to this topic has been published, and gives the last one.
    pub async fn message(&self, topic: &str) -> Publish {
        let found = |broker: &Self| broker.publishes().into_iter().rfind(|publish| publish.topic == topic);
        self.until(|broker| found(broker).is_some()).await;
        found(self).expect("it was there")
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.state()
    }
}

impl State {
    fn deliver(&mut self, publish: Publish) {
        match (&mut self.held, &self.client) {
            (Some(held), _) => held.push(publish),
            (None, Some(client)) => {
                let _ = client.send(Some(publish));
            }
            // It has just been cut off.
            (None, None) => {}
        }
    }
}

impl Inner {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn accept(self: &Arc<Self>) -> io::Result<DuplexStream> {
        let conduct = self.state().conduct;
        if conduct == Conduct::Away {
            return Err(io::ErrorKind::ConnectionRefused.into());
        }
        let (ours, theirs) = duplex(1 << 20);
        let (sender, receiver) = mpsc::unbounded_channel();
        self.state().client = Some(sender);
        tokio::spawn(Arc::clone(self).serve(ours, receiver));
        Ok(theirs)
    }

    async fn serve(
        self: Arc<Self>,
        mut stream: DuplexStream,
        mut out: mpsc::UnboundedReceiver<Option<Publish>>,
    ) {
        let mut bytes = BytesMut::new();
        let mut identifier = 0;
        loop {
            tokio::select! {
                read = stream.read_buf(&mut bytes) => {
                    if !matches!(read, Ok(1..)) {
                        return;
                    }
                    while let Ok(packet) = Packet::read(&mut bytes, None) {
                        let answer = self.answer(packet);
                        self.changed.notify_waiters();
                        let mut written = BytesMut::new();
                        if let Some(answer) = answer {
                            answer.write(&mut written, None).expect("a packet");
                        }
                        if stream.write_all(&written).await.is_err() {
                            return;
                        }
                    }
                }
                publish = out.recv() => {
                    let Some(Some(mut publish)) = publish else { return };
                    if publish.qos != rumqttc::QoS::AtMostOnce && publish.pkid == 0 {
                        identifier = identifier % 60_000 + 1;
                        publish.pkid = identifier;
                    }
                    let mut written = BytesMut::new();
                    Packet::Publish(publish).write(&mut written, None).expect("a packet");
                    if stream.write_all(&written).await.is_err() {
                        return;
                    }
                }
            }
        }
    }

    fn answer(&self, packet: Packet) -> Option<Packet> {
        let mut state = self.state();
        if state.conduct == Conduct::Silent {
            state.packets.push(packet);
            return None;
        }
        let answers = state.conduct == Conduct::Usual;
        let answer = match &packet {
            Packet::Connect(..) => {
                let properties = ConnAckProperties { max_packet_size: state.largest, ..nothing() };
                return keep(
                    &mut state,
                    packet,
                    Some(Packet::ConnAck(ConnAck {
                        session_present: false,
                        code: ConnectReturnCode::Success,
                        properties: Some(properties),
                    })),
                );
            }
            Packet::Subscribe(subscribe) => {
                let granted = |filter: &rumqttc::SubscribeFilter| SubscribeReasonCode::Success(filter.qos);
                let of_all = |filter: &rumqttc::SubscribeFilter| {
                    filter.retain_forward_rule == rumqttc::RetainForwardRule::OnEverySubscribe
                };
                for filter in subscribe.filters.iter().filter(|filter| of_all(filter)) {
                    let fits = |topic: &str| is_of(topic, &filter.path);
                    let kept =
                        state.retained.iter().filter(|(topic, _)| fits(topic)).map(|(_, kept)| kept.clone());
                    for publish in kept.collect::<Vec<_>>() {
                        state.deliver(Publish { pkid: 0, dup: false, ..publish });
                    }
                }
                Packet::SubAck(SubAck {
                    pkid: subscribe.pkid,
                    return_codes: subscribe.filters.iter().map(granted).collect(),
                    properties: None,
                })
            }
            Packet::PingReq => return answers.then_some(Packet::PingResp),
            Packet::Publish(publish) => {
                state.counted += 1;
                let topic = words(publish).0;
                if publish.retain && publish.payload.is_empty() {
                    state.retained.remove(&topic);
                } else if publish.retain {
                    state.retained.insert(topic, publish.clone());
                }
                if words(publish).0.ends_with("/echo") && answers {
                    // What the client is subscribed to itself.
                    state.deliver(Publish { pkid: 0, retain: false, ..publish.clone() });
                }
                let (pkid, asks) = (publish.pkid, publish.qos != rumqttc::QoS::AtMostOnce);
                if !state.forgets {
                    state.published.push(publish.clone());
                }
                let taken = PubAck { pkid, reason: PubAckReason::Success, properties: None };
                return (answers && asks).then_some(Packet::PubAck(taken));
            }
            _ => return keep(&mut state, packet, None),
        };
        keep(&mut state, packet, answers.then_some(answer))
    }
}

/// Whether a topic is one of a filter.
fn is_of(topic: &str, filter: &str) -> bool {
    let (mut levels, mut wanted) = (topic.split('/'), filter.split('/'));
    loop {
        match (levels.next(), wanted.next()) {
            (_, Some("#")) | (None, None) => return true,
            (Some(_), Some("+")) => {}
            (Some(level), Some(want)) if level == want => {}
            _ => return false,
        }
    }
}

fn keep(state: &mut State, packet: Packet, answer: Option<Packet>) -> Option<Packet> {
    if !state.forgets {
        state.packets.push(packet);
    }
    answer
}

fn words(publish: &Publish) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&publish.topic), text(&publish.payload))
}

const fn nothing() -> ConnAckProperties {
    ConnAckProperties {
        session_expiry_interval: None,
        receive_max: None,
        max_qos: None,
        retain_available: None,
        max_packet_size: None,
        assigned_client_identifier: None,
        topic_alias_max: None,
        reason_string: None,
        user_properties: Vec::new(),
        wildcard_subscription_available: None,
        subscription_identifiers_available: None,
        shared_subscription_available: None,
        server_keep_alive: None,
        response_information: None,
        server_reference: None,
        authentication_method: None,
        authentication_data: None,
    }
}

/// A message as a client publishes it.
pub fn publish(topic: &str, payload: &str, qos: Qos) -> Publish {
    let qos = if qos == Qos::AtMostOnce { rumqttc::QoS::AtMostOnce } else { rumqttc::QoS::AtLeastOnce };
    Publish::new(topic, qos, payload.to_owned(), None)
}
