//! Whatever comes in: no panic, nothing without bound, and the node goes on.

#[expect(dead_code, reason = "the rules are for the other tests")]
mod support;

use std::time::Duration;

use drive_sparkplug::{
    Event, LONGEST_PAYLOAD, MOST_METRICS, Malformed, Metric, Payload, Quality, Raw, Settings, Value,
};
use proptest::prelude::*;
use support::{Rig, settings, written};

fn raws() -> impl Strategy<Value = Raw> {
    prop_oneof![
        any::<u32>().prop_map(Raw::Int),
        any::<u64>().prop_map(Raw::Long),
        any::<f32>().prop_map(Raw::Float),
        any::<f64>().prop_map(Raw::Double),
        any::<bool>().prop_map(Raw::Boolean),
        ".{0,20}".prop_map(Raw::String),
    ]
}

fn metrics() -> impl Strategy<Value = Metric> {
    let names = prop_oneof![
        Just(None),
        Just(Some("Control/Setpoint".to_owned())),
        Just(Some("Node Control/Rebirth".to_owned())),
        "(.{0,12})".prop_map(Some),
    ];
    let aliases = prop::option::of(prop_oneof![0..12_u64, any::<u64>()]);
    let quality = prop::option::of(prop::sample::select(vec![Quality::Bad, Quality::Good, Quality::Stale]));
    let times = prop::option::of(any::<u64>());
    let types = prop::option::of(any::<u32>());
    let values = prop::option::of(raws());
    (names, aliases, times, types, any::<[bool; 2]>(), values, quality).prop_map(
        |(name, alias, timestamp, data_type, [is_historical, is_null], value, quality)| Metric {
            name,
            alias,
            timestamp,
            data_type,
            is_historical,
            is_null,
            value,
            quality,
        },
    )
}

fn payloads() -> impl Strategy<Value = Payload> {
    let metrics = prop::collection::vec(metrics(), 0..8);
    (prop::option::of(any::<u64>()), prop::option::of(any::<u64>()), metrics)
        .prop_map(|(timestamp, seq, metrics)| Payload { timestamp, seq, metrics })
}

/// Payloads, their parts, with bytes that were flipped, and noise.
fn bytes() -> impl Strategy<Value = Vec<u8>> {
    let noise = prop::collection::vec(any::<u8>(), 0..300);
    let whole = payloads().prop_map(|payload| payload.encode());
    let cut = (payloads(), any::<prop::sample::Index>()).prop_map(|(payload, len)| {
        let mut bytes = payload.encode();
        bytes.truncate(len.index(bytes.len() + 1));
        bytes
    });
    let flipped =
        (payloads(), any::<prop::sample::Index>(), any::<u8>()).prop_map(|(payload, place, mask)| {
            let mut bytes = payload.encode();
            if !bytes.is_empty() {
                let place = place.index(bytes.len());
                bytes[place] ^= mask;
            }
            bytes
        });
    prop_oneof![noise, whole, cut, flipped]
}

fn topics() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        "spBv1.0/plant/NCMD/hall 1",
        "spBv1.0/plant/DCMD/hall 1/pump 1",
        "spBv1.0/plant/DCMD/hall 1/nobody",
        "spBv1.0/STATE/scada",
        "",
    ])
}

proptest! {
    #[test]
    fn a_payload_is_read_as_it_was_written(payload in payloads()) {
        // Whatever is no number is not equal to itself.
        let is_number = |metric: &Metric| match metric.value {
            Some(Raw::Float(number)) => !number.is_nan(),
            Some(Raw::Double(number)) => !number.is_nan(),
            _ => true,
        };
        prop_assume!(payload.metrics.iter().all(is_number));
        prop_assert_eq!(Payload::decode(&payload.encode()), Ok(payload));
    }

    #[test]
    fn whatever_comes_in_the_node_goes_on(messages in prop::collection::vec((topics(), bytes(), any::<bool>()), 0..20)) {
        let mut rig = Rig::new(Settings { primary_host: Some("scada").map(|id| drive_sparkplug::Id::new(id).unwrap()), ..settings() });
        rig.run("pump 1", 1.0);
        rig.connect();
        rig.state(true, 1);
        for (topic, payload, retain) in &messages {
            rig.hear(topic, payload, *retain);
            rig.wait(Duration::from_millis(1));
        }
        // No more than one answer in each pause, whatever was asked.
        let births = rig.topics(0).iter().filter(|topic| *topic == "NBIRTH").count();
        prop_assert!(births <= 2, "{births}");
        rig.wait(Duration::from_secs(10));
        let mark = rig.mark();
        rig.run("pump 1", 2.0);
        if rig.node.is_alive() {
            prop_assert_eq!(rig.topics(mark), ["DDATA pump 1"]);
        }
    }

    #[test]
    fn what_a_command_writes_is_of_the_metrics_type_and_a_number(payload in payloads()) {
        let mut rig = Rig::new(settings());
        rig.connect();
        let heard = rig.hear("spBv1.0/plant/DCMD/hall 1/pump 1", &payload.encode(), false);
        let Some(Event::Command(command)) = heard else { panic!("{heard:?}") };
        prop_assert_eq!(command.writes.len(), payload.metrics.len());
        for write in command.writes.into_iter().flatten() {
            match (write.name.as_str(), write.value) {
                ("Status/State", Value::String(_)) | ("Counts", Value::Int32(_)) => {}
                ("Control/Setpoint" | "Status/Output Frequency", Value::Double(number)) => {
                    prop_assert!(number.is_finite());
                }
                (name, value) => panic!("{name}: {value:?}"),
            }
        }
    }
}

#[test]
fn a_payload_that_is_too_long_or_has_too_many_metrics_is_refused() {
    let long = vec![0; LONGEST_PAYLOAD + 1];
    assert_eq!(Payload::decode(&long), Err(Malformed::TooLong(LONGEST_PAYLOAD + 1)));
    // A metric of nothing takes two bytes.
    let many = [0x12, 0].repeat(MOST_METRICS + 1);
    assert_eq!(Payload::decode(&many), Err(Malformed::TooManyMetrics(MOST_METRICS + 1)));
}

#[test]
fn what_nests_without_end_is_skipped() {
    // A template in a template, and a property set in a property set, a thousand times.
    for tag in [[0x92, 0x01], [0x4A, 0x00]] {
        let mut inner = Vec::new();
        for _ in 0..1_000 {
            let mut outer = if tag[1] == 0 { vec![tag[0]] } else { tag.to_vec() };
            let len = u32::try_from(inner.len()).unwrap();
            outer.extend([(len & 0x7F) as u8 | 0x80, (len >> 7) as u8]);
            outer.extend(inner);
            inner = outer;
        }
        let mut payload = vec![0x12, (inner.len() & 0x7F) as u8 | 0x80, (inner.len() >> 7) as u8];
        payload.extend(inner);
        // Read as a metric of another kind, or refused: the stack is not its measure.
        let _ = Payload::decode(&payload);
    }
}

#[test]
fn a_group_that_never_ends_is_refused() {
    let groups = [0x0B].repeat(10_000);
    assert!(matches!(Payload::decode(&groups), Err(Malformed::NotProtobuf(_))));
}

#[test]
fn a_string_that_is_no_utf_8_is_refused() {
    assert!(matches!(Payload::decode(&[0x12, 3, 0x0A, 1, 0xFF]), Err(Malformed::NotProtobuf(_))));
    let mut rig = Rig::new(settings());
    rig.connect();
    let good = written(rig.now, "Control/Setpoint", Raw::Double(1.0));
    assert!(matches!(
        rig.hear("spBv1.0/plant/DCMD/hall 1/pump 1", &[0x12, 3, 0x0A, 1, 0xFF], false),
        Some(Event::Ignored(_))
    ));
    assert!(matches!(rig.hear("spBv1.0/plant/DCMD/hall 1/pump 1", &good, false), Some(Event::Command(_))));
}
