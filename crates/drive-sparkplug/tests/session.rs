//! What an edge node does beyond the numbered assertions.

#[expect(dead_code, reason = "the rules are for the other tests")]
mod support;

use std::time::Duration;

use drive_sparkplug::{
    Action, BdSeq, Command, Definition, DeviceError, Event, Id, Ignored, Metric, MetricError, PastError,
    Payload, Quality, Raw, Reading, Settings, Value, Write, WriteError,
};
use support::{Rig, definitions, protobuf, recording::Packet, settings, written};

const PUMP: &str = "spBv1.0/plant/DCMD/hall 1/pump 1";
const NODE: &str = "spBv1.0/plant/NCMD/hall 1";

fn alive() -> Rig {
    let mut rig = Rig::new(settings());
    rig.run("pump 1", 10.0);
    rig.connect();
    rig.wait(Duration::from_secs(60));
    rig
}

/// The payload of the last message.
fn last(rig: &Rig) -> protobuf::Payload {
    let last = rig.packets.iter().rev().find_map(|packet| match packet {
        Packet::Sent(message) => protobuf::read(&message.payload),
        _ => None,
    });
    last.unwrap()
}

fn writes(event: Option<Event>) -> Vec<Result<Write, WriteError>> {
    match event {
        Some(Event::Command(command)) => command.writes,
        event => panic!("{event:?}"),
    }
}

#[test]
fn a_host_that_asks_for_births_again_and_again_gets_them_once_in_each_pause() {
    let mut rig = alive();
    let mark = rig.mark();
    for asked in 0..100_u32 {
        rig.ask_for_rebirth();
        rig.run("pump 1", f64::from(asked));
        rig.wait(Duration::from_millis(100));
    }
    // Ten seconds and a tenth, births five seconds apart, the first at once. Behind it is the one change that nobody had
    // asked for births before.
    let births = ["NBIRTH", "DBIRTH pump 1"];
    assert_eq!(rig.topics(mark), [&births[..], &["DDATA pump 1"], &births, &births].concat());
}

#[test]
fn what_changes_while_births_are_awaited_is_told_by_them_and_not_again() {
    let mut rig = alive();
    rig.ask_for_rebirth();
    rig.ask_for_rebirth();
    let mark = rig.mark();
    rig.run("pump 1", 33.0);
    assert!(rig.topics(mark).is_empty());
    assert!(rig.node.deadline().is_some());
    rig.wait(Duration::from_secs(5));
    assert_eq!(rig.topics(mark), ["NBIRTH", "DBIRTH pump 1"]);
    assert_eq!(rig.node.deadline(), None);
    let metrics = last(&rig).metrics;
    let hertz =
        metrics.iter().find(|metric| metric.name.as_deref() == Some("Status/Output Frequency")).unwrap();
    assert_eq!(hertz.double(), Some(33.0));
}

#[test]
fn a_request_for_births_before_the_first_ones_is_answered_by_them() {
    let mut rig = Rig::new(Settings { primary_host: Some(Id::new("scada").unwrap()), ..settings() });
    rig.connect();
    rig.ask_for_rebirth();
    rig.state(true, 1);
    rig.wait(Duration::from_secs(60));
    assert_eq!(rig.topics(0), ["NBIRTH"]);
}

#[test]
fn a_retained_request_for_births_is_nothing() {
    let mut rig = alive();
    let mark = rig.mark();
    let payload = written(rig.now, "Node Control/Rebirth", Raw::Boolean(true));
    assert_eq!(rig.hear(NODE, &payload, true), Some(Event::Ignored(Ignored::RetainedRebirth)));
    assert!(rig.topics(mark).is_empty());
}

#[test]
fn only_what_has_changed_is_told_and_a_quality_only_where_it_has() {
    let mut rig = alive();
    let mark = rig.mark();
    rig.run("pump 1", 10.0);
    assert!(rig.topics(mark).is_empty());
    rig.set("pump 1", "Status/Output Frequency", Some(Value::Double(10.0)), Quality::Stale);
    let metrics = last(&rig).metrics;
    assert_eq!((metrics.len(), metrics[0].quality(), metrics[0].double()), (1, Some(500), Some(10.0)));
    rig.set("pump 1", "Status/Output Frequency", None, Quality::Stale);
    let metrics = last(&rig).metrics;
    assert_eq!((metrics.len(), metrics[0].quality(), metrics[0].is_null), (1, None, true));
    rig.run("pump 1", 11.0);
    assert_eq!(last(&rig).metrics[0].quality(), Some(192));
}

#[test]
fn what_changes_twice_before_it_is_told_is_told_once_as_it_is() {
    let mut rig = alive();
    let mark = rig.mark();
    for hertz in [11.0, 12.0, 13.0] {
        let reading =
            Reading { value: Some(Value::Double(hertz)), quality: Quality::Good, unix_ms: rig.now.unix_ms };
        rig.node.set_device("pump 1", "Status/Output Frequency", reading).unwrap();
    }
    rig.carry_out();
    assert_eq!(rig.topics(mark), ["DDATA pump 1"]);
    assert_eq!(last(&rig).metrics[0].double(), Some(13.0));
}

#[test]
fn a_number_that_is_none_is_told_as_no_value_of_bad_quality() {
    let mut rig = alive();
    rig.run("pump 1", f64::NAN);
    let metrics = last(&rig).metrics;
    assert_eq!((metrics[0].is_null, metrics[0].quality(), metrics[0].value.clone()), (true, Some(0), None));
    let mark = rig.mark();
    rig.run("pump 1", f64::INFINITY);
    assert!(rig.topics(mark).is_empty());
}

#[test]
fn a_device_that_never_answered_is_not_spoken_of() {
    let mut rig = alive();
    rig.set("fan 1", "Counts", Some(Value::Int32(1)), Quality::Good);
    rig.node.set_present("fan 1", false);
    rig.carry_out();
    assert!(!rig.topics(0).iter().any(|topic| topic.contains("fan 1")));
}

#[test]
fn a_device_that_came_and_went_unseen_is_not_spoken_of() {
    let mut rig = alive();
    let mark = rig.mark();
    rig.node.set_present("fan 1", true);
    rig.node.set_present("fan 1", false);
    rig.node.set_present("pump 1", false);
    rig.node.set_present("pump 1", true);
    rig.carry_out();
    assert!(rig.topics(mark).is_empty());
}

#[test]
fn a_device_that_is_removed_dies_and_one_that_is_added_is_born() {
    let mut rig = alive();
    let mark = rig.mark();
    rig.node.remove_device("pump 1");
    rig.carry_out();
    assert_eq!(rig.topics(mark), ["DDEATH pump 1"]);
    assert_eq!(rig.node.devices().collect::<Vec<_>>(), ["fan 1"]);
    rig.node.add_device("pump 1", definitions(), rig.now).unwrap();
    rig.run("pump 1", 5.0);
    assert_eq!(rig.topics(mark + 1), ["DBIRTH pump 1"]);
    // Its aliases are new: nothing that was said of the old one is taken for it.
    assert!(last(&rig).metrics.iter().filter_map(|metric| metric.alias).all(|alias| alias > 9));
}

#[test]
fn other_metrics_of_the_node_are_told_by_births_of_everything() {
    let mut rig = alive();
    let mark = rig.mark();
    let metrics = vec![Definition::new("Lines/south/Errors", drive_sparkplug::DataType::UInt64)];
    rig.node.define(metrics, rig.now).unwrap();
    rig.carry_out();
    assert_eq!(rig.topics(mark), ["NBIRTH", "DBIRTH pump 1"]);
    let reading = Reading { value: Some(Value::UInt64(1)), quality: Quality::Good, unix_ms: rig.now.unix_ms };
    assert!(rig.node.set_node("Lines/north/Errors", reading.clone()).is_err());
    rig.node.set_node("Lines/south/Errors", reading).unwrap();
    rig.carry_out();
    assert_eq!(rig.topics(mark), ["NBIRTH", "DBIRTH pump 1", "NDATA"]);
}

#[test]
fn a_device_that_is_replaced_unseen_dies_before_it_is_born_again() {
    let mut rig = alive();
    let mark = rig.mark();
    rig.node.remove_device("pump 1");
    rig.node.add_device("pump 1", definitions(), rig.now).unwrap();
    rig.run("pump 1", 5.0);
    assert_eq!(rig.topics(mark), ["DDEATH pump 1", "DBIRTH pump 1"]);
}

#[test]
fn names_and_types_that_are_wrong_are_refused_and_change_nothing() {
    let mut rig = alive();
    let now = rig.now;
    let reading = Reading { value: Some(Value::Boolean(true)), quality: Quality::Good, unix_ms: now.unix_ms };
    let wrong = rig.node.set_device("pump 1", "Counts", reading.clone()).unwrap_err();
    assert_eq!(wrong.to_string(), r#"metric "Counts" is Int32: a value of type Boolean is none of it"#);
    assert!(matches!(
        rig.node.set_device("pump 1", "Nothing", reading.clone()),
        Err(MetricError::Unknown(_))
    ));
    assert!(matches!(rig.node.set_device("nobody", "Counts", reading), Err(MetricError::Unknown(_))));
    assert!(matches!(rig.node.add_device("a/b", Vec::new(), now), Err(DeviceError::Id(_))));
    let twice = vec![
        Definition::new("Speed", drive_sparkplug::DataType::Double),
        Definition::new("SPEED", drive_sparkplug::DataType::Double),
    ];
    assert!(matches!(rig.node.add_device("x", twice, now), Err(DeviceError::Metric(MetricError::Taken(_)))));
    let own = vec![Definition::new("bdseq", drive_sparkplug::DataType::Int64)];
    assert!(drive_sparkplug::EdgeNode::new(settings(), own, now).is_err());
    let mark = rig.mark();
    rig.carry_out();
    assert_eq!(rig.mark(), mark);
}

#[test]
fn a_metric_is_written_by_its_name_or_by_its_alias_alone() {
    let mut rig = alive();
    let by_name = written(rig.now, "Control/Setpoint", Raw::Double(40.0));
    let event = rig.hear(PUMP, &by_name, false);
    let write = Write { name: "Control/Setpoint".to_owned(), value: Value::Double(40.0), timestamp: None };
    let expected = Command {
        device: Some(Id::new("pump 1").unwrap()),
        timestamp: Some(rig.now.unix_ms),
        is_retained: false,
        writes: vec![Ok(write.clone())],
    };
    assert_eq!(event, Some(Event::Command(expected)));
    let recording = rig.recording();
    let birth = recording.verb("DBIRTH").last().unwrap();
    let alias = birth.metric("Control/Setpoint").unwrap().alias;
    for name in [None, Some(String::new())] {
        let metric = Metric { name, alias, value: Some(Raw::Double(40.0)), ..Metric::default() };
        let payload = Payload { metrics: vec![metric], ..Payload::default() };
        assert_eq!(writes(rig.hear(PUMP, &payload.encode(), false)), [Ok(write.clone())]);
    }
}

#[test]
fn a_retained_command_is_said_to_be_one() {
    let mut rig = alive();
    let payload = written(rig.now, "Control/Setpoint", Raw::Double(40.0));
    assert!(matches!(
        rig.hear(PUMP, &payload, true),
        Some(Event::Command(Command { is_retained: true, .. }))
    ));
}

#[test]
fn what_is_written_wrongly_is_told_with_its_reason() {
    let mut rig = alive();
    let name = || "Control/Setpoint".to_owned();
    let good = Metric { name: Some(name()), value: Some(Raw::Double(40.0)), ..Metric::default() };
    for (metric, problem) in [
        (
            Metric { name: Some("Speed".to_owned()), ..good.clone() },
            WriteError::Unknown(r#""Speed""#.to_owned()),
        ),
        (Metric { name: None, alias: Some(77), ..good.clone() }, WriteError::Unknown("77".to_owned())),
        (Metric { name: None, ..good.clone() }, WriteError::Unknown("without name and alias".to_owned())),
        (Metric { value: Some(Raw::Long(40)), ..good.clone() }, WriteError::NotItsType(name())),
        (Metric { value: Some(Raw::Double(f64::NAN)), ..good.clone() }, WriteError::NotItsType(name())),
        (Metric { value: Some(Raw::Float(f32::INFINITY)), ..good.clone() }, WriteError::NotItsType(name())),
        (Metric { value: None, ..good.clone() }, WriteError::NotItsType(name())),
        (Metric { is_null: true, ..good.clone() }, WriteError::NotItsType(name())),
        (
            Metric { is_historical: true, ..good },
            WriteError::Historical(Write { name: name(), value: Value::Double(40.0), timestamp: None }),
        ),
    ] {
        let payload = Payload { metrics: vec![metric], ..Payload::default() };
        assert_eq!(writes(rig.hear(PUMP, &payload.encode(), false)), [Err(problem)]);
    }
}

#[test]
fn without_commands_those_of_devices_are_not_subscribed() {
    let mut rig = Rig::new(Settings { commands: false, ..settings() });
    rig.connect();
    let subscribed = rig.packets.iter().filter(|packet| matches!(packet, Packet::Subscribe { .. })).count();
    assert_eq!(subscribed, 1, "{:?}", rig.packets);
}

#[test]
fn an_offline_host_at_the_only_server_is_awaited_there() {
    let mut rig = Rig::new(Settings { primary_host: Some(Id::new("scada").unwrap()), ..settings() });
    rig.connect();
    rig.state(false, 1);
    assert_eq!(rig.reconnect, None);
    assert_eq!(rig.events, [Event::HostOffline]);
    rig.state(true, 2);
    assert!(rig.node.is_alive());
    rig.state(true, 3);
    assert_eq!(rig.events, [Event::HostOffline, Event::HostOnline]);
}

#[test]
fn bd_seq_goes_on_behind_255_with_0_and_is_kept_as_text() {
    let mut bd_seq = BdSeq::default();
    for number in 0..600_u32 {
        assert_eq!(u32::from(bd_seq.number()), number % 256);
        assert_eq!(bd_seq.to_string().parse(), Ok(bd_seq));
        bd_seq = bd_seq.next();
    }
    assert_eq!("7\n".parse::<BdSeq>().map(BdSeq::number), Ok(7));
    assert!("256".parse::<BdSeq>().is_err());
    assert!("".parse::<BdSeq>().is_err());
}

#[test]
fn a_broken_connection_begins_again_with_births() {
    let mut rig = alive();
    rig.lose();
    let mark = rig.mark();
    rig.run("pump 1", 20.0);
    assert_eq!(rig.mark(), mark, "nothing is said to nobody");
    rig.node.leave();
    rig.carry_out();
    assert_eq!(rig.mark(), mark, "nor is there anything to leave");
    rig.connect();
    assert_eq!(rig.topics(mark), ["NBIRTH", "DBIRTH pump 1"]);
}

/// What a pump held at a time.
fn held(hertz: Option<f64>, unix_ms: u64) -> (&'static str, Reading) {
    let quality = if hertz.is_some() { Quality::Good } else { Quality::Stale };
    ("Status/Output Frequency", Reading { value: hertz.map(Value::Double), quality, unix_ms })
}

#[test]
fn what_was_once_is_told_with_its_own_time_and_changes_nothing_of_what_is_now() {
    let mut rig = alive();
    let before = last(&rig);
    let now = rig.now;
    let past = [held(Some(20.0), 2_000), held(None, 3_000), held(Some(12.5), 1_000)];
    let message = rig.node.past("pump 1", past, now).unwrap();
    assert_eq!((message.topic.as_str(), message.qos), ("spBv1.0/plant/DDATA/hall 1/pump 1", 0));
    let payload = protobuf::read(&message.payload).unwrap();
    assert_eq!(payload.seq, before.seq.map(|seq| seq + 1), "it has a number as every other");
    assert_eq!(payload.timestamp, Some(now.unix_ms));
    let alias =
        before.metrics.iter().find(|metric| metric.name.as_deref() == Some("Status/Output Frequency"));
    let alias = alias.and_then(|metric| metric.alias);
    let told: Vec<_> = payload
        .metrics
        .iter()
        .map(|metric| {
            assert!(metric.is_historical && metric.name.is_none() && metric.alias == alias, "{metric:?}");
            (metric.timestamp, metric.double(), metric.is_null, metric.quality())
        })
        .collect();
    let expected = [
        (Some(2_000), Some(20.0), false, Some(192)),
        (Some(3_000), None, true, Some(500)),
        (Some(1_000), Some(12.5), false, Some(192)),
    ];
    assert_eq!(told, expected);
    // What it holds is what it held, so that nothing is to be said; and what changes is said.
    assert_eq!(rig.node.poll(now), None);
    let mark = rig.mark();
    rig.run("pump 1", 11.0);
    assert_eq!(rig.topics(mark), ["DDATA pump 1"]);
    let next = last(&rig);
    assert_eq!(next.seq, before.seq.map(|seq| seq + 2));
    assert!(!next.metrics[0].is_historical);
    assert_eq!(next.metrics[0].quality(), None, "its quality is what it was");
}

#[test]
fn nothing_of_the_past_is_told_before_a_birth_nor_of_what_no_birth_has_told() {
    let mut rig = Rig::new(settings());
    rig.run("pump 1", 10.0);
    let now = rig.now;
    let one = || [held(Some(20.0), 1_000)];
    let not_born = |device: &str| Err(PastError::NotBorn(device.to_owned()));
    assert_eq!(rig.node.past("pump 1", one(), now), not_born("pump 1"));
    rig.connect();
    assert!(rig.node.past("pump 1", one(), now).is_ok());
    assert!(rig.node.is_born("pump 1") && !rig.node.is_born("fan 1"));
    assert_eq!(rig.node.past("fan 1", one(), now), not_born("fan 1"), "it has never answered");
    assert_eq!(rig.node.past("pump 9", one(), now), not_born("pump 9"));
    let reading = Reading { value: Some(Value::Double(1.0)), quality: Quality::Good, unix_ms: 1 };
    let unknown = rig.node.past("pump 1", [("Speed", reading.clone())], now);
    assert_eq!(unknown, Err(MetricError::Unknown("Speed".to_owned()).into()));
    let wrong = rig.node.past("pump 1", [("Counts", reading)], now);
    assert!(matches!(wrong, Err(PastError::Metric(MetricError::WrongType { .. }))), "{wrong:?}");
    // From a request for births to them no data are sent, also none of these.
    rig.wait(Duration::from_secs(1));
    rig.ask_for_rebirth();
    assert!(!rig.node.is_told());
    assert_eq!(rig.node.past("pump 1", one(), now), not_born("pump 1"));
    rig.wait(Duration::from_secs(60));
    let mark = last(&rig).seq;
    let Ok(message) = rig.node.past("pump 1", one(), now) else { panic!("the births have been told") };
    let numbered = protobuf::read(&message.payload).and_then(|payload| payload.seq);
    assert_eq!(numbered, mark.map(|seq| seq + 1), "those that could not be told have taken no number");
    rig.node.set_present("pump 1", false);
    assert_eq!(rig.node.past("pump 1", one(), now), not_born("pump 1"));
    assert!(matches!(rig.node.poll(now), Some(Action::Publish(death)) if death.topic.contains("/DDEATH/")));
}
