//! One connection, from its first byte to its last, by the client crate.
//!
//! The crate connects again by itself and keeps what it has not sent; neither is used. Each connection has a client of its
//! own, so that a will, a server and a sequence of messages belong to one connection, and nothing but [`Queue`] is kept.
//! One future polls the crate and never waits for room in it; the other publishes.
//!
//! [`Queue`]: super::queue::Queue

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use futures_util::{
    StreamExt as _,
    stream::{FuturesOrdered, FuturesUnordered},
};
use rumqttc::{
    AsyncClient, ConnAck, ConnectionError, DisconnectProperties, DisconnectReasonCode, EventLoop, LastWill,
    LastWillProperties, MqttOptions, Packet, Publish, PublishOptions, PublishProperties, QoS,
    RetainForwardRule, StateError, SubscribeFilterInput, SubscribeNotice, SubscribeReasonCode,
    TlsConfiguration, Transport,
};
use tokio::{
    sync::{mpsc, oneshot},
    time::{Instant, sleep, sleep_until, timeout},
};

use super::{
    Arrived, Attempt, Connection, EVENTS, Event, Goodbye, Message, Options, Properties, Qos, Shared,
    Subscription, Then, Wanted, Will, prompt,
    queue::{Limits, Sign, Waiting},
};

/// How long a broker may take until it has answered CONNECT, and again until it has answered SUBSCRIBE.
const ANSWERED_WITHIN: Duration = Duration::from_secs(10);
/// Messages that are on their way at once.
const ON_THEIR_WAY: usize = 64;
/// What may arrive at once: bytes, and messages that the broker has to wait with.
const LARGEST: u32 = 64 << 10;
const UNACKNOWLEDGED: u16 = 64;
/// How long the last messages may take, and then the goodbye.
const DRAINED_WITHIN: Duration = Duration::from_secs(2);
const SAID_WITHIN: Duration = Duration::from_secs(1);
/// Messages before the answer to SUBSCRIBE that are kept until it is there.
const EARLY: usize = 64;

/// How a connection ended.
#[derive(Debug)]
pub(super) enum Ended {
    Left(Then),
    /// Why, in words.
    Lost(String),
}

/// Connects once, and stays for as long as it can be.
pub(super) async fn run(connection: &mut Connection, attempt: Attempt, will: Option<Will>) -> Ended {
    let Connection { options, shared, events, leaves } = connection;
    let built =
        client_options(options, attempt, will).map(|of| AsyncClient::builder(of).capacity(ON_THEIR_WAY));
    let (client, event_loop) =
        match built.map(|builder| builder.try_build().map_err(|error| error.to_string())) {
            Some(Ok(built)) => built,
            Some(Err(why)) => return Ended::Lost(why),
            None => return Ended::Lost("there is no such server".to_owned()),
        };
    let (ready, is_ready) = oneshot::channel();
    let (on_their_way, leaving) = (Mutex::default(), Mutex::new(None));
    let reader = Reader { client: client.clone(), options, attempt, shared, events, early: VecDeque::new() };
    let writer = Writer { client, shared, on_their_way: &on_their_way, leaving: &leaving };
    let ended = tokio::select! {
        why = reader.read(event_loop, ready) => Ended::Lost(why),
        then = writer.write(is_ready, leaves) => Ended::Left(then),
        () = events.closed() => Ended::Left(Then::End),
    };
    shared.queue().take_back(std::mem::take(&mut *lock(&on_their_way)));
    lock(&leaving).take().map_or(ended, Ended::Left)
}

/// What polls the crate.
struct Reader<'a> {
    client: AsyncClient,
    options: &'a Options,
    attempt: Attempt,
    shared: &'a Shared,
    events: &'a mpsc::Sender<Event>,
    /// What has arrived before the answer to SUBSCRIBE.
    early: VecDeque<Arrived>,
}

impl Reader<'_> {
    /// Reads until the connection ends, and says why.
    async fn read(mut self, mut event_loop: EventLoop, ready: oneshot::Sender<Limits>) -> String {
        let mut ready = Some(ready);
        let mut limits = Limits { qos: Qos::AtLeastOnce, retain: true, size: usize::MAX };
        // Whatever holds up the crate, such as a broker that does not read: a connection without a packet is over.
        let silent = self.options.keep_alive * 2 + ANSWERED_WITHIN;
        loop {
            let patience = if ready.is_some() { ANSWERED_WITHIN } else { silent };
            let packet = match timeout(patience, event_loop.poll()).await {
                Err(_) => return "it does not answer".to_owned(),
                Ok(Err(error)) => return in_words(&error),
                Ok(Ok(rumqttc::Event::Incoming(packet))) => packet,
                Ok(Ok(_)) => continue,
            };
            match packet {
                Packet::ConnAck(answer) => {
                    limits = limits_of(&answer);
                    if !self.options.subscriptions.is_empty() {
                        let filters = self.options.subscriptions.iter().map(filter);
                        if let Err(error) = self.client.try_subscribe_many(filters) {
                            return error.to_string();
                        }
                        continue;
                    }
                }
                Packet::SubAck(answer) if ready.is_some() => self.look_at(&answer.return_codes),
                Packet::SubAck(answer) => {
                    let refused =
                        |code: &SubscribeReasonCode| !matches!(code, SubscribeReasonCode::Success(_));
                    if answer.return_codes.iter().any(refused) {
                        tracing::warn!(
                            "MQTT: the broker does not let its own topics be read back: what was told of drives that were \
                             taken out while this program did not run may stand there"
                        );
                    }
                    continue;
                }
                Packet::Publish(publish) => {
                    match arrived(publish) {
                        Some(arrived) if ready.is_none() => self.pass_on(arrived),
                        Some(arrived) if self.early.len() < EARLY => self.early.push_back(arrived),
                        _ => self.shared.queue().count_arrived(false),
                    }
                    continue;
                }
                _ => continue,
            }
            let Some(ready) = ready.take() else { continue };
            self.shared.queue().connected(self.attempt.number);
            if let Some(server) = self.options.servers.get(self.attempt.server) {
                tracing::info!("MQTT: connected to {server}");
            }
            // Where nobody listens any more this is ended from outside.
            let _ = self.events.send(Event::Connected(self.attempt)).await;
            let _ = ready.send(limits);
            while let Some(early) = self.early.pop_front() {
                self.pass_on(early);
            }
        }
    }

    /// Gives on what has arrived, if there is room for it.
    fn pass_on(&self, arrived: Arrived) {
        let room = self.events.capacity();
        let takes = room > EVENTS / 4 || room > 0 && (self.options.is_urgent)(&arrived.topic);
        let taken = takes && self.events.try_send(Event::Message(arrived)).is_ok();
        self.shared.queue().count_arrived(taken);
    }

    /// Says in the log what the broker does not let us hear.
    fn look_at(&self, answers: &[SubscribeReasonCode]) {
        for (subscription, answer) in self.options.subscriptions.iter().zip(answers) {
            if !matches!(answer, SubscribeReasonCode::Success(_)) {
                tracing::error!(
                    "MQTT: the broker refuses the subscription {:?}: {answer:?}",
                    subscription.filter
                );
            }
        }
    }
}

/// What publishes.
struct Writer<'a> {
    client: AsyncClient,
    shared: &'a Shared,
    /// What the crate has and the broker has not acknowledged, the oldest first.
    on_their_way: &'a Mutex<VecDeque<Waiting>>,
    /// What comes next, when the goodbye has been said.
    leaving: &'a Mutex<Option<Then>>,
}

impl Writer<'_> {
    /// Publishes until it is to leave, and says goodbye.
    async fn write(
        self,
        ready: oneshot::Receiver<Limits>,
        leaves: &mut mpsc::Receiver<(Goodbye, Then)>,
    ) -> Then {
        let limits = tokio::select! {
            Ok(limits) = ready => limits,
            (_, then) = asked(leaves) => return then,
        };
        let mut notices = FuturesOrdered::new();
        let mut leaving: Option<(Goodbye, Then, Instant)> = None;
        let mut answers = FuturesOrdered::new();
        // Messages that the crate was given, and those of them that are gone; signs that are asked behind so many.
        let (mut given, mut gone) = (0_u64, 0_u64);
        let (mut signs, mut seen) = (VecDeque::new(), FuturesUnordered::new());
        loop {
            while let Some(notice) = self.ask() {
                answers.push_back(notice.wait_completion_async());
            }
            // What the broker has is told before it is replaced.
            while answers.is_empty() && notices.len() < ON_THEIR_WAY {
                let next = self.shared.queue().pop(Instant::now(), limits);
                let Some(waiting) = next else { break };
                let Message { topic, payload, .. } = waiting.message.clone();
                match self.client.try_publish_tracked(topic, payload, published(&waiting.message)) {
                    Ok(notice) => {
                        notices.push_back(notice.wait_completion_async());
                        given += 1;
                        lock(self.on_their_way).push_back(waiting);
                    }
                    Err(_) => self.shared.queue().count_sent(false),
                }
            }
            signs.extend(std::iter::from_fn(|| self.shared.queue().sign()).map(|sign| (given, sign)));
            // The crate sends what is asked before messages that it has: so these have to be gone.
            while signs.front().is_some_and(|(behind, _)| *behind <= gone) {
                let sign = signs.pop_front();
                seen.extend(sign.and_then(|(_, sign)| self.ask_for(sign)));
            }
            if let Some((goodbye, then, until)) = leaving
                && (notices.is_empty() && self.shared.queue().is_empty() || Instant::now() >= until)
            {
                return self.say(goodbye, then).await;
            }
            let until =
                leaving.map_or_else(|| Instant::now() + Duration::from_secs(3_600), |(_, _, until)| until);
            tokio::select! {
                Some(result) = notices.next() => {
                    let sent = lock(self.on_their_way).pop_front();
                    gone += 1;
                    self.shared.queue().count_sent(result.is_ok());
                    if let (Err(error), Some(sent)) = (result, sent) {
                        tracing::warn!("MQTT: the broker does not take {:?}: {error}", sent.message.topic);
                    }
                }
                // What the broker refuses is said where its answer is read.
                Some(_) = answers.next() => {}
                Some(()) = seen.next() => {}
                () = self.shared.work.notified(), if notices.len() < ON_THEIR_WAY => {}
                (goodbye, then) = asked(leaves), if leaving.is_none() => {
                    leaving = Some((goodbye, then, Instant::now() + DRAINED_WITHIN));
                }
                () = sleep_until(until) => {}
            }
        }
    }

    /// Sends subscriptions that wait; those for which the crate has no room now are sent when it has more.
    fn ask(&self) -> Option<SubscribeNotice> {
        let asked = Some(self.shared.queue().asked()).filter(|asked| !asked.is_empty())?;
        let notice = self.client.try_subscribe_many_tracked(asked.iter().map(filter)).ok()?;
        self.shared.queue().has_asked(asked.len());
        Some(notice)
    }

    /// Asks for a sign, and gives what waits for it; nothing where the crate has no room for it now.
    fn ask_for(&self, sign: Sign) -> Option<impl Future<Output = ()> + use<>> {
        let Sign { asked, seen } = sign;
        let notice = self.client.try_subscribe_many_tracked([filter(&asked)]).ok()?;
        Some(async move {
            if notice.wait_async().await.is_ok() {
                // Whoever does not wait any more misses nothing.
                let _ = seen.send(());
            }
        })
    }

    async fn say(&self, goodbye: Goodbye, then: Then) -> Then {
        let reason = match goodbye {
            Goodbye::Normal => DisconnectReasonCode::NormalDisconnection,
            Goodbye::WithWill => DisconnectReasonCode::DisconnectWithWillMessage,
        };
        let nothing = DisconnectProperties {
            session_expiry_interval: None,
            reason_string: None,
            user_properties: Vec::new(),
            server_reference: None,
        };
        *lock(self.leaving) = Some(then);
        if self.client.try_disconnect_now_with_properties(reason, nothing).is_ok() {
            // The reader ends when it has been sent.
            sleep(SAID_WITHIN).await;
        }
        then
    }
}

/// The next wish to leave; never, when there is nobody left to have one.
async fn asked(leaves: &mut mpsc::Receiver<(Goodbye, Then)>) -> (Goodbye, Then) {
    match leaves.recv().await {
        Some(leave) => leave,
        None => std::future::pending().await,
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The options of one connection; `None`: there is no such server.
fn client_options(options: &Options, attempt: Attempt, will: Option<Will>) -> Option<MqttOptions> {
    let server = options.servers.get(attempt.server)?;
    let mut built = MqttOptions::new(&options.client_id, (server.host.as_str(), server.port));
    if let Some(secured) = &server.tls {
        let config = TlsConfiguration::Rustls(Arc::clone(&secured.0));
        built.set_transport(Transport::tls_with_config(config));
    }
    match &options.login {
        Some(super::Login { user, password: Some(password) }) => {
            built.set_credentials(user, password.clone());
        }
        Some(super::Login { user, password: None }) => {
            built.set_username(user);
        }
        None => {}
    }
    let keep_alive = u16::try_from(options.keep_alive.as_secs()).unwrap_or(u16::MAX);
    built
        .set_keep_alive(keep_alive)
        .set_clean_start(true)
        .set_session_expiry_interval(Some(0))
        .set_receive_maximum(Some(UNACKNOWLEDGED))
        .set_max_packet_size(Some(LARGEST))
        .set_connect_timeout(ANSWERED_WITHIN)
        .set_socket_connector(prompt::connect);
    if let Some(Will { message }) = will {
        let properties = LastWillProperties {
            delay_interval: None,
            payload_format_indicator: None,
            message_expiry_interval: seconds_left(&message),
            content_type: message.properties.content_type,
            response_topic: message.properties.response_topic,
            correlation_data: message.properties.correlation,
            user_properties: message.properties.user,
        };
        let qos = qos(message.qos);
        built.set_last_will(LastWill::new(
            message.topic,
            message.payload,
            qos,
            message.retain,
            Some(properties),
        ));
    }
    #[cfg(test)]
    if let Some(dial) = options.dial.clone() {
        built.set_socket_connector(move |_, _| std::future::ready(dial()));
    }
    Some(built)
}

fn filter(subscription: &Subscription) -> SubscribeFilterInput {
    let rule = match subscription.wanted {
        Wanted::News => RetainForwardRule::Never,
        Wanted::NewsAndKept | Wanted::Others => RetainForwardRule::OnEverySubscribe,
    };
    let others = subscription.wanted == Wanted::Others;
    let filter = SubscribeFilterInput::new(&subscription.filter, qos(subscription.qos));
    filter.no_local(others).preserve_retain(!others).retain_forward_rule(rule)
}

fn limits_of(answer: &ConnAck) -> Limits {
    let said = answer.properties.as_ref();
    let size = said.and_then(|said| said.max_packet_size).and_then(|size| usize::try_from(size).ok());
    Limits {
        qos: if said.and_then(|said| said.max_qos) == Some(0) { Qos::AtMostOnce } else { Qos::AtLeastOnce },
        retain: said.and_then(|said| said.retain_available) != Some(0),
        size: size.unwrap_or(usize::MAX),
    }
}

fn published(message: &Message) -> PublishOptions {
    let Properties { content_type, response_topic, correlation, user } = message.properties.clone();
    let properties = PublishProperties {
        message_expiry_interval: seconds_left(message),
        content_type,
        response_topic,
        correlation_data: correlation,
        user_properties: user,
        ..PublishProperties::default()
    };
    PublishOptions::new(qos(message.qos)).retain(message.retain).properties(properties)
}

/// What is left of a message's time, in seconds, and at least one.
fn seconds_left(message: &Message) -> Option<u32> {
    let left = message.expires?.saturating_duration_since(Instant::now());
    Some(u32::try_from(left.as_millis().div_ceil(1_000)).unwrap_or(u32::MAX).max(1))
}

/// What has arrived; `None`: its topic is none.
fn arrived(publish: Publish) -> Option<Arrived> {
    let said = publish.properties.unwrap_or_default();
    Some(Arrived {
        topic: String::from_utf8(publish.topic.to_vec()).ok()?,
        payload: publish.payload,
        qos: if publish.qos == QoS::AtMostOnce { Qos::AtMostOnce } else { Qos::AtLeastOnce },
        retain: publish.retain,
        repeated: publish.dup,
        at: Instant::now(),
        expires_in_s: said.message_expiry_interval,
        properties: Properties {
            content_type: said.content_type,
            response_topic: said.response_topic,
            correlation: said.correlation_data,
            user: said.user_properties,
        },
    })
}

const fn qos(qos: Qos) -> QoS {
    match qos {
        Qos::AtMostOnce => QoS::AtMostOnce,
        Qos::AtLeastOnce => QoS::AtLeastOnce,
    }
}

fn in_words(error: &ConnectionError) -> String {
    match error {
        ConnectionError::Io(error) => error.to_string(),
        ConnectionError::ConnectionRefused(code) => format!("it does not let us in: {code:?}"),
        ConnectionError::Timeout(_) => "it does not answer".to_owned(),
        ConnectionError::MqttState(StateError::ServerDisconnect { reason_code, .. }) => match reason_code {
            DisconnectReasonCode::SessionTakenOver => {
                "another client of our client_id has connected in our place".to_owned()
            }
            reason => format!("it says goodbye: {reason:?}"),
        },
        error => error.to_string(),
    }
}
