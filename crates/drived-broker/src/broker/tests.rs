use std::time::Duration;

use rumqttc::{DisconnectReasonCode, Packet, RetainForwardRule};
use tokio::{
    sync::mpsc::Receiver,
    time::{Instant, sleep},
};

use super::{
    testing::{Conduct, TestBroker, publish},
    *,
};

fn word(topic: &str, payload: &str) -> Message {
    Message::new(topic, payload.to_owned())
}

async fn connected(events: &mut Receiver<Event>) -> Attempt {
    loop {
        match events.recv().await.expect("the connection is kept") {
            Event::Connected(attempt) => return attempt,
            Event::Message(_) | Event::Disconnected => {}
        }
    }
}

fn start(options: Options) -> (Broker, Receiver<Event>) {
    Broker::start(options, |_| None)
}

#[tokio::test(start_paused = true)]
async fn it_subscribes_before_it_says_that_it_is_connected() {
    let far = TestBroker::default();
    let subscription =
        |filter: &str, wanted| Subscription { filter: filter.to_owned(), qos: Qos::AtLeastOnce, wanted };
    let subscriptions =
        vec![subscription("plant/+/command", Wanted::News), subscription("state", Wanted::NewsAndKept)];
    let (_broker, mut events) = start(Options { subscriptions, ..far.options() });
    assert_eq!(connected(&mut events).await, Attempt { number: 1, server: 0 });
    let [Packet::Connect(connect, None, _), Packet::Subscribe(subscribe)] = &far.packets()[..] else {
        panic!("{:?}", far.packets())
    };
    assert!(connect.clean_start);
    assert_eq!(connect.properties.as_ref().unwrap().session_expiry_interval, Some(0));
    let rules: Vec<_> = subscribe
        .filters
        .iter()
        .map(|filter| (filter.retain_forward_rule.clone(), filter.preserve_retain))
        .collect();
    assert_eq!(rules, [(RetainForwardRule::Never, true), (RetainForwardRule::OnEverySubscribe, true)]);
}

#[tokio::test(start_paused = true)]
async fn a_message_in_order_outlives_the_connection_and_state_does_not() {
    let far = TestBroker::default();
    let (broker, mut events) = start(far.options());
    connected(&mut events).await;
    far.behave(Conduct::Away);
    far.cut();
    assert!(matches!(events.recv().await, Some(Event::Disconnected)));
    assert!(broker.publish(word("news", "1"), Kept::InOrder));
    assert!(!broker.publish(word("state", "old"), Kept::Latest));
    assert!(broker.publish(word("news", "2"), Kept::InOrder));
    far.behave(Conduct::Usual);
    connected(&mut events).await;
    broker.publish(word("state", "new"), Kept::Latest);
    far.message("state").await;
    let expected = [("news", "1"), ("news", "2"), ("state", "new")];
    assert_eq!(far.published(), expected.map(|(topic, payload)| (topic.to_owned(), payload.to_owned())));
}

#[tokio::test(start_paused = true)]
async fn what_was_not_acknowledged_is_sent_again_in_its_order() {
    let far = TestBroker::default();
    far.behave(Conduct::Deaf);
    let (broker, mut events) = start(far.options());
    connected(&mut events).await;
    for payload in ["1", "2", "3"] {
        broker.publish(word("news", payload), Kept::InOrder);
    }
    far.until(|far| far.published().len() == 3).await;
    assert_eq!(broker.counts().sent, 0);
    far.behave(Conduct::Usual);
    far.cut();
    far.until(|far| far.published().len() == 6).await;
    let payloads: Vec<String> = far.published().into_iter().map(|(_, payload)| payload).collect();
    assert_eq!(payloads, ["1", "2", "3", "1", "2", "3"]);
}

#[tokio::test(start_paused = true)]
async fn the_queue_is_bounded_and_what_it_loses_is_counted() {
    let far = TestBroker::default();
    far.behave(Conduct::Away);
    let (broker, mut events) = start(far.options());
    for number in 0..20 {
        broker.publish(word("news", &number.to_string()), Kept::InOrder);
    }
    assert_eq!((broker.counts().waiting, broker.counts().lost.no_room), (8, 12));
    far.behave(Conduct::Usual);
    connected(&mut events).await;
    far.until(|far| far.published().len() == 8).await;
    assert_eq!(far.published()[0].1, "12", "the oldest are lost");
}

#[tokio::test(start_paused = true)]
async fn of_each_topic_of_state_only_the_newest_waits() {
    let far = TestBroker::default();
    let (broker, mut events) = start(far.options());
    connected(&mut events).await;
    // Nothing is sent before this test waits.
    for number in 0..1_000 {
        broker.publish(word("a", &number.to_string()), Kept::Latest);
        broker.publish(word("b", &number.to_string()), Kept::Latest);
    }
    assert_eq!(broker.counts().waiting, 2);
    far.message("b").await;
    assert_eq!(far.published(), [("a".into(), "999".into()), ("b".into(), "999".into())]);
    assert_eq!(broker.counts().lost, queue::Lost::default());
}

#[tokio::test(start_paused = true)]
async fn a_message_of_one_connection_is_not_sent_in_another() {
    let far = TestBroker::default();
    let (broker, mut events) = start(far.options());
    let first = connected(&mut events).await;
    assert!(broker.publish(word("birth", "1"), Kept::OfConnection(first.number)));
    far.message("birth").await;
    far.cut();
    let second = connected(&mut events).await;
    assert!(second.number > first.number);
    assert!(!broker.publish(word("data", "old"), Kept::OfConnection(first.number)));
    assert!(broker.publish(word("birth", "2"), Kept::OfConnection(second.number)));
    far.until(|far| far.published().len() == 2).await;
    assert_eq!(far.published()[1].1, "2");
}

#[tokio::test(start_paused = true)]
async fn what_is_over_before_it_can_be_sent_is_not_sent() {
    let far = TestBroker::default();
    far.behave(Conduct::Away);
    let (broker, mut events) = start(far.options());
    let expires = Some(Instant::now() + Duration::from_secs(2));
    broker.publish(Message { expires, ..word("news", "short") }, Kept::InOrder);
    let expires = Some(Instant::now() + Duration::from_secs(600));
    broker.publish(Message { expires, ..word("news", "long") }, Kept::InOrder);
    sleep(Duration::from_secs(10)).await;
    far.behave(Conduct::Usual);
    connected(&mut events).await;
    let sent = far.message("news").await;
    assert_eq!(sent.payload, "long");
    let left = sent.properties.unwrap().message_expiry_interval.unwrap();
    assert!((540..=590).contains(&left), "the time that it has waited is taken off: {left}");
    assert_eq!(broker.counts().lost.expired, 1);
}

#[tokio::test(start_paused = true)]
async fn a_message_that_the_broker_takes_not_at_all_does_not_cost_the_connection() {
    let far = TestBroker::default();
    far.takes_at_most(200);
    let (broker, mut events) = start(far.options());
    connected(&mut events).await;
    broker.publish(word("news", &"x".repeat(300)), Kept::InOrder);
    broker.publish(word("news", "small"), Kept::InOrder);
    broker.publish(word("a wildcard/#", "x"), Kept::InOrder);
    far.message("news").await;
    sleep(Duration::from_secs(1)).await;
    assert_eq!(far.published(), [("news".into(), "small".into())]);
    assert_eq!(broker.counts().lost.not_taken, 2);
    assert_eq!(far.packets().len(), 1, "one CONNECT and nothing else");
}

#[tokio::test(start_paused = true)]
async fn each_connect_has_a_will_of_its_own_and_the_servers_have_their_turns() {
    let far = TestBroker::default();
    let server = far.options().servers[0].clone();
    let options = Options { servers: vec![server.clone(), server], ..far.options() };
    let will = |attempt: Attempt| {
        Some(Will { message: word("death", &format!("{} {}", attempt.number, attempt.server)).retained() })
    };
    let (_broker, mut events) = Broker::start(options, will);
    for server in [0, 1, 0] {
        assert_eq!(connected(&mut events).await.server, server);
        far.cut();
    }
    let wills: Vec<_> = far
        .packets()
        .into_iter()
        .map(|packet| match packet {
            Packet::Connect(_, Some(will), _) => {
                assert!(will.retain);
                String::from_utf8(will.message.to_vec()).unwrap()
            }
            other => panic!("{other:?}"),
        })
        .collect();
    assert_eq!(wills, ["1 0", "2 1", "3 0"]);
}

#[tokio::test(start_paused = true)]
async fn a_goodbye_comes_after_what_was_published_and_with_its_reason() {
    let far = TestBroker::default();
    let (broker, mut events) = start(far.options());
    connected(&mut events).await;
    broker.publish(word("death", "1"), Kept::InOrder);
    broker.leave(Goodbye::WithWill);
    connected(&mut events).await;
    broker.publish(word("status", "offline"), Kept::Latest);
    broker.end(Goodbye::Normal, Duration::from_secs(5)).await;
    assert_eq!(far.published(), [("death".into(), "1".into()), ("status".into(), "offline".into())]);
    let reasons: Vec<_> = far
        .packets()
        .into_iter()
        .filter_map(|packet| match packet {
            Packet::Disconnect(disconnect) => Some(disconnect.reason_code),
            _ => None,
        })
        .collect();
    let [with_will, normal] = reasons[..] else { panic!("{reasons:?}") };
    assert_eq!(with_will, DisconnectReasonCode::DisconnectWithWillMessage);
    assert_eq!(normal, DisconnectReasonCode::NormalDisconnection);
    while let Some(event) = events.recv().await {
        assert!(!matches!(event, Event::Connected(_)), "it is the end");
    }
}

#[tokio::test(start_paused = true)]
async fn a_broker_that_accepts_and_never_answers_is_left_and_tried_again() {
    let far = TestBroker::default();
    far.behave(Conduct::Silent);
    let (broker, mut events) = start(far.options());
    for number in 0..100 {
        broker.publish(word("news", &number.to_string()), Kept::InOrder);
    }
    far.until(|far| far.packets().len() == 3).await;
    assert_eq!((broker.counts().connected, broker.counts().waiting), (false, 8));
    far.behave(Conduct::Usual);
    connected(&mut events).await;
    far.until(|far| far.published().len() == 8).await;
}

#[tokio::test(start_paused = true)]
async fn an_end_takes_no_longer_than_it_may_whatever_the_broker_does() {
    for conduct in [Conduct::Away, Conduct::Silent, Conduct::Deaf] {
        let far = TestBroker::default();
        let (broker, mut events) = start(far.options());
        connected(&mut events).await;
        far.behave(conduct);
        broker.publish(word("status", "offline"), Kept::InOrder);
        let begun = Instant::now();
        broker.end(Goodbye::Normal, Duration::from_secs(3)).await;
        assert!(begun.elapsed() <= Duration::from_secs(3), "{conduct:?}: {:?}", begun.elapsed());
    }
}

#[tokio::test(start_paused = true)]
async fn a_flood_is_turned_away_and_what_is_urgent_gets_through() {
    let far = TestBroker::default();
    let subscriptions =
        vec![Subscription { filter: "#".to_owned(), qos: Qos::AtLeastOnce, wanted: Wanted::News }];
    let options = Options { subscriptions, is_urgent: |topic| topic == "stop", ..far.options() };
    let (broker, mut events) = start(options);
    connected(&mut events).await;
    for _ in 0..10_000 {
        far.deliver(publish("go", "x", Qos::AtMostOnce));
    }
    far.deliver(publish("stop", "", Qos::AtLeastOnce));
    // Nobody takes the events meanwhile.
    sleep(Duration::from_secs(5)).await;
    let counts = broker.counts();
    assert_eq!(counts.arrived + counts.lost.flood, 10_001);
    assert!(counts.lost.flood > 9_000, "{counts:?}");
    let mut last = None;
    while let Ok(Event::Message(arrived)) = events.try_recv() {
        last = Some(arrived.topic);
    }
    assert_eq!(last.as_deref(), Some("stop"));
}

#[tokio::test(start_paused = true)]
async fn a_sign_of_the_broker_says_that_it_has_what_was_published_before() {
    let far = TestBroker::default();
    let asked =
        || Subscription { filter: "plant/command".to_owned(), qos: Qos::AtLeastOnce, wanted: Wanted::News };
    let (broker, mut events) = start(Options { queue: 1_000, subscriptions: vec![asked()], ..far.options() });
    assert!(broker.sign(asked()).await.is_err(), "there is no connection");
    let connection = connected(&mut events).await.number;
    let publish = |from: u32, to: u32| {
        for number in from..to {
            let message = Message { qos: Qos::AtMostOnce, ..word("news", &number.to_string()) };
            assert!(broker.publish(message, Kept::OfConnection(connection)));
        }
    };
    // More than are on their way at once.
    publish(0, 200);
    let sign = broker.sign(asked());
    publish(200, 300);
    sign.await.unwrap();
    let published = far.published().len();
    assert!(published >= 200, "{published}");
    far.until(|far| far.published().len() == 300).await;
    let expected: Vec<_> = (0..300).map(|number: u32| ("news".to_owned(), number.to_string())).collect();
    assert_eq!(far.published(), expected, "a sign changes no order and costs no message");

    // A broker that does not answer gives none, nor does one that is lost; and it holds up no message.
    far.behave(Conduct::Deaf);
    let (sign, later) = (broker.sign(asked()), broker.sign(asked()));
    publish(300, 301);
    far.until(|far| far.published().len() == 301).await;
    far.cut();
    assert!(sign.await.is_err() && later.await.is_err());
}
