//! A rule that nothing can break asserts nothing: each is broken here, by a recording in which one thing is wrong.

#[expect(dead_code, reason = "the rig is for the other tests")]
mod support;

use std::{collections::BTreeSet, time::Duration};

use drive_sparkplug::{DataType, Metric, Payload, Quality, Raw, Value};
use support::{
    Rig,
    recording::{Message, Packet, Recording},
    rules, settings,
};

type Wrong = fn(&mut Vec<Packet>);

/// What can be wrong, one thing at a time.
#[rustfmt::skip]
const WRONGS: &[(&str, Wrong)] = &[
    ("a session that is kept", |all| connects(all, |clean, _, _| *clean = false)),
    ("no will", |all| connects(all, |_, _, will| *will = None)),
    ("a will that is a birth", |all| connects(all, |_, _, will| with(will, |will| will.topic = will.topic.replace("NDEATH", "NBIRTH")))),
    ("a will of quality 0", |all| connects(all, |_, _, will| with(will, |will| will.qos = 0))),
    ("a retained will", |all| connects(all, |_, _, will| with(will, |will| will.retain = true))),
    ("a will without a payload", |all| connects(all, |_, _, will| with(will, |will| will.payload = vec![0xFF]))),
    ("the same bdSeq in every will", |all| {
        let mut first = None;
        connects(all, |_, _, will| with(will, |will| *will = first.get_or_insert_with(|| will.clone()).clone()));
    }),
    ("no subscriptions", |all| all.retain(|packet| !matches!(packet, Packet::Subscribe { .. }))),
    ("no births of the node", |all| all.retain(|packet| !is(packet, "NBIRTH"))),
    ("no births of devices", |all| all.retain(|packet| !is(packet, "DBIRTH"))),
    ("no deaths", |all| all.retain(|packet| !is(packet, "NDEATH"))),
    ("data before births", |all| {
        let data: Vec<_> = all.extract_if(.., |packet| is(packet, "DDATA")).collect();
        let place = all.iter().position(|packet| is(packet, "NBIRTH")).unwrap() + 1;
        all.splice(place..place, data);
    }),
    ("another namespace", |all| topics(all, |topic| topic.replace("plant", "a+b"))),
    ("a device in each topic", |all| topics(all, |topic| if topic.matches('/').count() == 3 { format!("{topic}/x") } else { topic.to_owned() })),
    ("another group in births of devices", |all| topics(all, |topic| topic.replace("plant/DBIRTH", "plants/DBIRTH"))),
    ("names that differ in case", |all| topics(all, |topic| topic.replace("DDATA/hall 1/pump 1", "DDATA/hall 1/Pump 1"))),
    ("metrics that differ in case", |all| payloads(all, |_, payload| {
        let twin = payload.metrics.first().filter(|metric| metric.name.is_some()).cloned();
        payload.metrics.extend(twin.map(|twin| Metric { name: twin.name.map(|name| name.to_uppercase()), ..twin }));
    })),
    ("quality 1 and retained", |all| sent(all, |message| (message.qos, message.retain) = (1, true))),
    ("no times", |all| payloads(all, |_, payload| {
        payload.timestamp = None;
        payload.metrics.iter_mut().for_each(|metric| metric.timestamp = None);
    })),
    ("seconds", |all| payloads(all, |_, payload| payload.timestamp = payload.timestamp.map(|at| at / 1_000))),
    ("a number in deaths, and 7 in all others", |all| payloads(all, |_, payload| payload.seq = Some(7))),
    ("no numbers", |all| payloads(all, |_, payload| payload.seq = None)),
    ("deaths with more metrics", |all| payloads(all, |topic, payload| if topic.contains("NDEATH") {
        payload.metrics.push(Metric::default());
    })),
    ("no types in births, and types in data", |all| payloads(all, |topic, payload| {
        payload.metrics.iter_mut().for_each(|metric| metric.data_type = topic.contains("DATA").then_some(10));
    })),
    ("unknown types", |all| payloads(all, |_, payload| payload.metrics.iter_mut().for_each(|metric| metric.data_type = Some(99)))),
    ("no values", |all| payloads(all, |_, payload| payload.metrics.iter_mut().for_each(|metric| metric.value = None))),
    ("no bdSeq and no rebirth", |all| payloads(all, |_, payload| payload.metrics.retain(|metric| metric.alias.is_some()))),
    ("another bdSeq", |all| payloads(all, |_, payload| of(payload, "bdSeq", |metric| metric.value = Some(Raw::Long(999))))),
    ("rebirth that is true and has an alias", |all| payloads(all, |_, payload| of(payload, "Node Control/Rebirth", |metric| {
        metric.alias = Some(5_000);
        metric.value = Some(Raw::Boolean(true));
    }))),
    ("births without what data tell", |all| payloads(all, |topic, payload| if topic.contains("BIRTH") {
        payload.metrics.retain(|metric| metric.alias.is_none());
    })),
    ("metrics against their order", |all| payloads(all, |_, payload| {
        let last = Metric { timestamp: Some(1), ..payload.metrics.last().cloned().unwrap_or_default() };
        payload.metrics.extend([Metric { timestamp: Some(2), ..last.clone() }, last]);
    })),
    ("data of a dead device", |all| {
        let data = all.iter().find(|packet| is(packet, "DDATA") && on(packet, "fan 1")).unwrap().clone();
        let place = all.iter().position(|packet| is(packet, "DDEATH")).unwrap() + 1;
        all.insert(place, data);
    }),
    ("an ordinary disconnect", |all| for packet in all {
        if let Packet::Disconnect { reason } = packet { *reason = 0 }
    }),
    ("data behind a request for births", |all| {
        let data = Payload { timestamp: Some(3_000_000_000_000), ..Payload::default() }.encode();
        let message = Message { topic: "spBv1.0/plant/NDATA/hall 1".to_owned(), payload: data, qos: 0, retain: false };
        let place = all.iter().position(|packet| matches!(packet, Packet::Heard(_))).unwrap() + 1;
        all.insert(place, Packet::Sent(message));
    }),
    ("a rebirth without devices", |all| {
        let heard = all.iter().position(|packet| matches!(packet, Packet::Heard(_))).unwrap();
        let mut place = 0;
        all.retain(|packet| { place += 1; place <= heard || !is(packet, "DBIRTH") });
    }),
    ("everything twice", |all| *all = all.iter().flat_map(|packet| [packet.clone(), packet.clone()]).collect()),
    ("names in data, and none in births", |all| payloads(all, |topic, payload| {
        payload.metrics.iter_mut().for_each(|metric| metric.name = topic.contains("DATA").then(|| "x".to_owned()));
    })),
    ("neither names nor aliases", |all| payloads(all, |_, payload| payload.metrics.iter_mut().for_each(|metric| {
        (metric.name, metric.alias) = (None, None);
    }))),
    ("one alias for all", |all| payloads(all, |_, payload| payload.metrics.iter_mut().for_each(|metric| metric.alias = metric.alias.and(Some(1))))),
    ("qualities that are wrong on the wire", |all| sent(all, |message| {
        // Quality: Int32 and 192, as bytes; then a string and 193.
        replace(&mut message.payload, &[0x08, 3, 0x18, 0xC0, 0x01], &[0x08, 12, 0x18, 0xC1, 0x01]);
    })),
    ("keys without values", |all| sent(all, |message| {
        // The set of that value: its field becomes an unknown one.
        replace(&mut message.payload, &[0x12, 5, 0x08, 3, 0x18], &[0x1A, 5, 0x08, 3, 0x18]);
    })),
];

fn a_day() -> Vec<Packet> {
    let mut rig = Rig::new(settings());
    rig.run("pump 1", 0.0);
    rig.run("fan 1", 20.0);
    rig.connect();
    for step in 1..10 {
        rig.wait(Duration::from_secs(1));
        rig.run("pump 1", f64::from(step));
        rig.run("fan 1", f64::from(step));
        rig.set_errors(step as u64);
    }
    rig.ask_for_rebirth();
    rig.wait(Duration::from_secs(10));
    rig.set("pump 1", "Counts", Some(Value::Int32(-1)), Quality::Good);
    rig.node.set_present("fan 1", false);
    rig.wait(Duration::from_secs(1));
    rig.leave();
    rig.connect();
    rig.leave();
    assert_eq!(DataType::Int32.code(), 3);
    rig.packets
}

#[test]
fn every_rule_is_broken_by_something_that_is_wrong() {
    let (broken, untried) = rules::judge_all(&Recording::of(a_day()));
    assert_eq!((broken, untried), (Vec::new(), Vec::new()));
    let mut bitten = BTreeSet::new();
    for (name, wrong) in WRONGS {
        let mut packets = a_day();
        wrong(&mut packets);
        let broken: Vec<_> = rules::ids_broken(&Recording::of(packets));
        assert!(!broken.is_empty(), "no rule notices {name}");
        bitten.extend(broken);
    }
    // What is no payload is no recording either.
    let payloads_that_are_none = ["nbirth_payload", "dbirth_payload"];
    let toothless: Vec<_> = rules::ids().difference(&bitten).cloned().collect();
    assert!(
        toothless.iter().all(|id| payloads_that_are_none.iter().any(|end| id.ends_with(end))),
        "{toothless:#?}"
    );
}

#[test]
#[should_panic(expected = "no payload on")]
fn bytes_that_are_no_payload_are_no_recording() {
    let mut packets = a_day();
    sent(&mut packets, |message| message.payload = vec![0xFF]);
    Recording::of(packets);
}

fn is(packet: &Packet, verb: &str) -> bool {
    matches!(packet, Packet::Sent(message) if message.topic.contains(&format!("/{verb}/")))
}

fn on(packet: &Packet, device: &str) -> bool {
    matches!(packet, Packet::Sent(message) if message.topic.ends_with(device))
}

fn connects(all: &mut [Packet], mut change: impl FnMut(&mut bool, &mut u32, &mut Option<Message>)) {
    for packet in all {
        if let Packet::Connect { clean_start, session_expiry, will } = packet {
            change(clean_start, session_expiry, will);
        }
    }
}

fn with(will: &mut Option<Message>, change: impl FnOnce(&mut Message)) {
    will.as_mut().map(change);
}

fn sent(all: &mut [Packet], change: impl Fn(&mut Message)) {
    for packet in all {
        if let Packet::Sent(message) = packet {
            change(message);
        }
    }
}

fn topics(all: &mut [Packet], change: impl Fn(&str) -> String) {
    sent(all, |message| message.topic = change(&message.topic));
}

fn payloads(all: &mut [Packet], change: impl Fn(&str, &mut Payload)) {
    sent(all, |message| {
        let mut payload = Payload::decode(&message.payload).unwrap();
        change(&message.topic, &mut payload);
        message.payload = payload.encode();
    });
}

fn of(payload: &mut Payload, name: &str, change: impl Fn(&mut Metric)) {
    payload.metrics.iter_mut().filter(|metric| metric.name.as_deref() == Some(name)).for_each(change);
}

fn replace(bytes: &mut [u8], old: &[u8], new: &[u8]) {
    for place in 0..bytes.len().saturating_sub(old.len()) {
        if bytes[place..].starts_with(old) {
            bytes[place..place + new.len()].copy_from_slice(new);
        }
    }
}
