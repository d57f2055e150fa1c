//! The specification's numbered assertions, as far as they can be seen in what an edge node sends: each says how often it
//! found what it speaks of, or what breaks it. Their ids are those of Eclipse Sparkplug 3.0.0; several say the same.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    protobuf::{Field, Metric},
    recording::{Message, Packet, Recording, Said},
};

type Verdict = Result<usize, String>;
type Check = fn(&Recording) -> Verdict;

/// Milliseconds since 1970, between 2001 and 2096.
const UTC_MS: std::ops::Range<u64> = 1_000_000_000_000..4_000_000_000_000;
const INT32: u64 = 3;
const INT64: u64 = 4;
const BOOLEAN: u64 = 11;

/// What the rule of an id says of a recording. The id is written as the name of a test: `tck_id_…`.
///
/// # Panics
/// There is no such rule.
pub(crate) fn judge(id: &str, recording: &Recording) -> Verdict {
    let is_it = |known: &&str| known.replace('-', "_") == id;
    let rule = RULES.iter().find(|(ids, _)| ids.iter().any(is_it));
    rule.unwrap_or_else(|| panic!("there is no rule {id}")).1(recording)
}

/// Every rule that a recording breaks, and every one of which it has no case.
pub(crate) fn judge_all(recording: &Recording) -> (Vec<String>, Vec<String>) {
    let (mut broken, mut untried) = (Vec::new(), Vec::new());
    for (ids, check) in RULES {
        match check(recording) {
            Err(why) => broken.push(format!("{}: {why}", ids.join(", "))),
            Ok(0) => untried.extend(ids.iter().map(|&id| id.to_owned())),
            Ok(_) => {}
        }
    }
    (broken, untried)
}

/// The ids of the rules that a recording breaks.
pub(crate) fn ids_broken(recording: &Recording) -> Vec<String> {
    let broken = RULES.iter().filter(|(_, check)| check(recording).is_err());
    broken.flat_map(|(ids, _)| ids.iter().map(|id| id.replace('-', "_"))).collect()
}

/// The ids of all rules.
pub(crate) fn ids() -> BTreeSet<String> {
    RULES.iter().flat_map(|(ids, _)| ids.iter().map(|id| id.replace('-', "_"))).collect()
}

#[rustfmt::skip]
const RULES: &[(&[&str], Check)] = &[
    // The connection.
    (&["tck-id-principles-persistence-clean-session-50"], |r| connects(r, |clean, expiry, _| clean && expiry == 0)),
    (&["tck-id-payloads-ndeath-will-message", "tck-id-message-flow-edge-node-birth-publish-will-message"],
        |r| connects(r, |_, _, will| will.is_some())),
    (&["tck-id-message-flow-edge-node-birth-publish-will-message-topic"],
        |r| connects(r, |_, _, will| will.is_some_and(|will| is_topic(&will.topic, "NDEATH", false)))),
    (&["tck-id-payloads-ndeath-will-message-qos", "tck-id-message-flow-edge-node-birth-publish-will-message-qos"],
        |r| connects(r, |_, _, will| will.is_some_and(|will| will.qos == 1))),
    (&["tck-id-payloads-ndeath-will-message-retain", "tck-id-message-flow-edge-node-birth-publish-will-message-will-retained"],
        |r| connects(r, |_, _, will| will.is_some_and(|will| !will.retain))),
    (&["tck-id-message-flow-edge-node-birth-publish-will-message-payload"],
        |r| connects(r, |_, _, will| will.and_then(|will| super::protobuf::read(&will.payload)).is_some())),
    (&["tck-id-topics-nbirth-bdseq-increment", "tck-id-message-flow-edge-node-birth-publish-will-message-payload-bdSeq"], will_numbers),
    (&["tck-id-message-flow-edge-node-ncmd-subscribe"], |r| subscribes(r, "NCMD")),
    (&["tck-id-message-flow-device-dcmd-subscribe"], |r| subscribes(r, "DCMD")),
    (&["tck-id-principles-birth-certificates-order", "tck-id-message-flow-edge-node-birth-publish-connect"], births_first),

    // Topics.
    (&["tck-id-topic-structure", "tck-id-topic-structure-namespace-a",
       "tck-id-topic-structure-namespace-device-id-associated-message-types",
       "tck-id-topic-structure-namespace-device-id-non-associated-message-types",
       "tck-id-topic-structure-namespace-valid-group-id", "tck-id-topic-structure-namespace-valid-edge-node-id",
       "tck-id-topic-structure-namespace-valid-device-id"],
        |r| each(r.said.iter(), |said| is_topic(&said.message.topic, &said.verb, said.verb.starts_with('D')))),
    (&["tck-id-topics-nbirth-topic", "tck-id-message-flow-edge-node-birth-publish-nbirth-topic"], |r| topics(r, "NBIRTH")),
    (&["tck-id-topics-ndata-topic"], |r| topics(r, "NDATA")),
    (&["tck-id-topics-ndeath-topic"], |r| topics(r, "NDEATH")),
    (&["tck-id-topics-dbirth-topic", "tck-id-message-flow-device-birth-publish-dbirth-topic"], |r| topics(r, "DBIRTH")),
    (&["tck-id-topics-ddata-topic"], |r| topics(r, "DDATA")),
    (&["tck-id-topics-ddeath-topic"], |r| topics(r, "DDEATH")),
    (&["tck-id-message-flow-device-birth-publish-dbirth-match-edge-node-topic"], |r| each(r.verb("DBIRTH"), |said| {
        node_birth(r, said).is_some_and(|birth| (&birth.group, &birth.edge_node) == (&said.group, &said.edge_node))
    })),
    (&["tck-id-case-sensitivity-sparkplug-ids"], ids_differ),
    (&["tck-id-case-sensitivity-metric-names"], |r| each(births(r), |said| {
        let names: BTreeSet<_> = said.payload.metrics.iter().filter_map(|metric| metric.name.as_ref()).map(|name| name.to_lowercase()).collect();
        names.len() == said.payload.metrics.len()
    })),

    // Quality of service, retain flag, time, number.
    (&["tck-id-topics-nbirth-mqtt", "tck-id-payloads-nbirth-qos", "tck-id-payloads-nbirth-retain",
       "tck-id-message-flow-edge-node-birth-publish-nbirth-qos", "tck-id-message-flow-edge-node-birth-publish-nbirth-retained"],
        |r| each(r.verb("NBIRTH"), is_plain)),
    (&["tck-id-topics-dbirth-mqtt", "tck-id-payloads-dbirth-qos", "tck-id-payloads-dbirth-retain",
       "tck-id-message-flow-device-birth-publish-dbirth-qos", "tck-id-message-flow-device-birth-publish-dbirth-retained"],
        |r| each(r.verb("DBIRTH"), is_plain)),
    (&["tck-id-topics-ndata-mqtt", "tck-id-payloads-ndata-qos", "tck-id-payloads-ndata-retain"], |r| each(r.verb("NDATA"), is_plain)),
    (&["tck-id-topics-ddata-mqtt", "tck-id-payloads-ddata-qos", "tck-id-payloads-ddata-retain"], |r| each(r.verb("DDATA"), is_plain)),
    (&["tck-id-topics-ddeath-mqtt"], |r| each(r.verb("DDEATH"), is_plain)),
    (&["tck-id-topics-nbirth-timestamp", "tck-id-payloads-nbirth-timestamp"], |r| each(r.verb("NBIRTH"), is_timed)),
    (&["tck-id-topics-dbirth-timestamp", "tck-id-payloads-dbirth-timestamp"], |r| each(r.verb("DBIRTH"), is_timed)),
    (&["tck-id-topics-ndata-timestamp", "tck-id-payloads-ndata-timestamp"], |r| each(r.verb("NDATA"), is_timed)),
    (&["tck-id-topics-ddata-timestamp", "tck-id-payloads-ddata-timestamp"], |r| each(r.verb("DDATA"), is_timed)),
    (&["tck-id-payloads-ddeath-timestamp"], |r| each(r.verb("DDEATH"), is_timed)),
    (&["tck-id-payloads-timestamp-in-UTC"], |r| each(r.said.iter(), is_timed)),
    (&["tck-id-payloads-metric-timestamp-in-UTC"], |r| metrics(r.said.iter().filter(|said| said.is_birth() || said.is_data()),
        |metric| metric.timestamp.is_some_and(|at| UTC_MS.contains(&at)))),
    (&["tck-id-topics-nbirth-seq-num", "tck-id-payloads-nbirth-seq", "tck-id-payloads-sequence-num-req-nbirth",
       "tck-id-message-flow-edge-node-birth-publish-nbirth-payload-seq"], |r| each(r.verb("NBIRTH"), |said| said.payload.seq == Some(0))),
    (&["tck-id-payloads-sequence-num-always-included"],
        |r| each(r.said.iter().filter(|said| said.verb != "NDEATH"), |said| said.payload.seq.is_some_and(|seq| seq <= 255))),
    (&["tck-id-payloads-sequence-num-incrementing"], |r| numbers(r, |_| true)),
    (&["tck-id-topics-dbirth-seq", "tck-id-payloads-dbirth-seq", "tck-id-payloads-dbirth-seq-inc",
       "tck-id-message-flow-device-birth-publish-dbirth-payload-seq"], |r| numbers(r, |verb| verb == "DBIRTH")),
    (&["tck-id-topics-ndata-seq-num", "tck-id-payloads-ndata-seq", "tck-id-payloads-ndata-seq-inc"], |r| numbers(r, |verb| verb == "NDATA")),
    (&["tck-id-topics-ddata-seq-num", "tck-id-payloads-ddata-seq", "tck-id-payloads-ddata-seq-inc"], |r| numbers(r, |verb| verb == "DDATA")),
    (&["tck-id-topics-ddeath-seq-num", "tck-id-payloads-ddeath-seq", "tck-id-payloads-ddeath-seq-inc",
       "tck-id-payloads-ddeath-seq-number"], |r| numbers(r, |verb| verb == "DDEATH")),
    (&["tck-id-topics-ndeath-seq", "tck-id-payloads-ndeath-seq"], |r| each(r.verb("NDEATH"), |said| said.payload.seq.is_none())),
    (&["tck-id-topics-ndeath-payload"], |r| each(r.verb("NDEATH"), |said| said.payload.metrics.len() == 1 && said.metric("bdSeq").is_some())),

    // What births tell.
    (&["tck-id-message-flow-edge-node-birth-publish-nbirth-payload"], |r| each(r.verb("NBIRTH"), |_| true)),
    (&["tck-id-message-flow-device-birth-publish-dbirth-payload"], |r| each(r.verb("DBIRTH"), |_| true)),
    (&["tck-id-topics-nbirth-metrics", "tck-id-operational-behavior-data-publish-nbirth-values"], |r| metrics(r.verb("NBIRTH"), is_complete)),
    (&["tck-id-topics-dbirth-metrics", "tck-id-operational-behavior-data-publish-dbirth-values"], |r| metrics(r.verb("DBIRTH"), is_complete)),
    (&["tck-id-payloads-metric-datatype-req", "tck-id-payloads-metric-datatype-value", "tck-id-payloads-metric-datatype-value-type"],
        |r| metrics(births(r), |metric| metric.data_type.is_some_and(|code| (1..=34).contains(&code)))),
    (&["tck-id-payloads-metric-datatype-not-req"], |r| metrics(data(r), |metric| metric.data_type.is_none())),
    (&["tck-id-topics-nbirth-bdseq-included", "tck-id-payloads-nbirth-bdseq"], |r| each(r.verb("NBIRTH"), |said| said.metric("bdSeq").is_some())),
    (&["tck-id-topics-nbirth-bdseq-matching", "tck-id-payloads-nbirth-bdseq-repeat", "tck-id-operational-behavior-data-commands-rebirth-action-3",
       "tck-id-message-flow-edge-node-birth-publish-nbirth-payload-bdSeq"], |r| each(r.verb("NBIRTH"), |said| {
        let metric = said.metric("bdSeq");
        metric.is_some_and(|metric| metric.data_type == Some(INT64) && metric.number() == will_number(r, said.session))
    })),
    (&["tck-id-payloads-ndeath-bdseq"], |r| each(r.verb("NDEATH"), |said| {
        said.metric("bdSeq").is_some_and(|metric| metric.number() == will_number(r, said.session))
    })),
    (&["tck-id-topics-nbirth-rebirth-metric", "tck-id-payloads-nbirth-rebirth-req",
       "tck-id-operational-behavior-data-commands-rebirth-name", "tck-id-operational-behavior-data-commands-rebirth-datatype",
       "tck-id-operational-behavior-data-commands-rebirth-value"], |r| each(r.verb("NBIRTH"), |said| {
        said.metric("Node Control/Rebirth").is_some_and(|metric| metric.data_type == Some(BOOLEAN) && metric.value == Some((14, Field::Varint(0))))
    })),
    (&["tck-id-operational-behavior-data-commands-rebirth-name-aliases"],
        |r| each(r.verb("NBIRTH"), |said| said.metric("Node Control/Rebirth").is_some_and(|metric| metric.alias.is_none()))),
    (&["tck-id-topics-nbirth-metric-reqs", "tck-id-operational-behavior-data-publish-nbirth"], |r| told_before(r, "NDATA")),
    (&["tck-id-topics-dbirth-metric-reqs", "tck-id-operational-behavior-data-publish-dbirth"], |r| told_before(r, "DDATA")),
    (&["tck-id-operational-behavior-data-publish-nbirth-order"], |r| each(r.said.iter().filter(|said| said.device.is_none()), is_chronological)),
    (&["tck-id-operational-behavior-data-publish-dbirth-order"], |r| each(r.said.iter().filter(|said| said.device.is_some()), is_chronological)),

    // Order.
    (&["tck-id-message-flow-device-birth-publish-nbirth-wait"], |r| each(r.verb("DBIRTH"), |said| node_birth(r, said).is_some())),
    (&["tck-id-payloads-dbirth-order", "tck-id-payloads-ndata-order", "tck-id-payloads-ddata-order"], births_before_data),
    (&["tck-id-operational-behavior-device-ddeath"], dead_are_silent),
    (&["tck-id-operational-behavior-edge-node-intentional-disconnect-ndeath", "tck-id-payloads-ndeath-will-message-publisher"], |r| leaves(r, |_| true)),
    (&["tck-id-operational-behavior-edge-node-intentional-disconnect-packet", "tck-id-payloads-ndeath-will-message-publisher-disconnect-mqtt50"],
        |r| leaves(r, |reason| reason == 0x04)),
    (&["tck-id-operational-behavior-data-commands-rebirth-action-1"], |r| rebirths(r, |next| next.verb == "NBIRTH" || !next.is_data())),
    (&["tck-id-operational-behavior-data-commands-rebirth-action-2"], reborn),

    // Data.
    (&["tck-id-topics-ndata-payload", "tck-id-operational-behavior-data-publish-nbirth-change"], |r| only_changes(r, "NDATA")),
    (&["tck-id-topics-ddata-payload", "tck-id-operational-behavior-data-publish-dbirth-change"], |r| only_changes(r, "DDATA")),
    (&["tck-id-payloads-name-birth-data-requirement"],
        |r| metrics(r.said.iter().filter(|said| said.is_birth() || said.is_data()), |metric| metric.timestamp.is_some())),
    (&["tck-id-payloads-name-requirement"],
        |r| metrics(r.said.iter(), |metric| metric.name.is_some() || metric.alias.is_some())),
    (&["tck-id-payloads-alias-birth-requirement"],
        |r| metrics(births(r), |metric| metric.name.is_some() && (metric.alias.is_some() || is_own(metric)))),
    (&["tck-id-payloads-alias-data-cmd-requirement"], |r| metrics(data(r), |metric| metric.name.is_none() && metric.alias.is_some())),
    (&["tck-id-payloads-alias-uniqueness"], aliases_are_unique),

    // Quality.
    (&["tck-id-payloads-propertyset-keys-array-size", "tck-id-payloads-propertyset-values-array-size"],
        |r| metrics_with_quality(r, |metric| metric.keys.len() == metric.properties.len())),
    (&["tck-id-payloads-propertyset-quality-value-type", "tck-id-payloads-metric-propertyvalue-type-type",
       "tck-id-payloads-metric-propertyvalue-type-value", "tck-id-payloads-metric-propertyvalue-type-req"],
        |r| metrics_with_quality(r, |metric| metric.properties.iter().all(|value| value.get(&1) == Some(&Field::Varint(INT32))))),
    (&["tck-id-payloads-propertyset-quality-value-value"],
        |r| metrics_with_quality(r, |metric| matches!(metric.quality(), Some(0 | 192 | 500)))),
];

fn each<'a>(all: impl Iterator<Item = &'a Said>, is_right: impl Fn(&Said) -> bool) -> Verdict {
    let mut count = 0;
    for said in all {
        if !is_right(said) {
            let Said { place, message, payload, .. } = said;
            return Err(format!("packet {place} on {}: {payload:?}", message.topic));
        }
        count += 1;
    }
    Ok(count)
}

fn metrics<'a>(all: impl Iterator<Item = &'a Said>, is_right: impl Fn(&Metric) -> bool) -> Verdict {
    let mut count = 0;
    for said in all {
        for metric in &said.payload.metrics {
            if !is_right(metric) {
                return Err(format!("packet {} on {}: {metric:?}", said.place, said.message.topic));
            }
            count += 1;
        }
    }
    Ok(count)
}

fn metrics_with_quality(recording: &Recording, is_right: impl Fn(&Metric) -> bool) -> Verdict {
    metrics(recording.said.iter(), |metric| metric.keys.is_empty() || is_right(metric))
}

fn connects(recording: &Recording, is_right: impl Fn(bool, u32, Option<&Message>) -> bool) -> Verdict {
    let mut count = 0;
    for packet in &recording.packets {
        if let Packet::Connect { clean_start, session_expiry, will } = packet {
            if !is_right(*clean_start, *session_expiry, will.as_ref()) {
                return Err(format!("{packet:?}"));
            }
            count += 1;
        }
    }
    Ok(count)
}

fn births(recording: &Recording) -> impl Iterator<Item = &Said> {
    recording.said.iter().filter(|said| said.is_birth())
}

fn data(recording: &Recording) -> impl Iterator<Item = &Said> {
    recording.said.iter().filter(|said| said.is_data())
}

fn is_topic(topic: &str, verb: &str, has_device: bool) -> bool {
    let levels: Vec<&str> = topic.split('/').collect();
    let ids = [levels.get(1), levels.get(3), levels.get(4)];
    levels.len() == if has_device { 5 } else { 4 }
        && (levels[0], levels[2]) == ("spBv1.0", verb)
        && ids.into_iter().flatten().all(|id| !id.is_empty() && !id.contains(['+', '#']))
}

fn topics(recording: &Recording, verb: &str) -> Verdict {
    each(recording.verb(verb), |said| is_topic(&said.message.topic, verb, verb.starts_with('D')))
}

fn is_plain(said: &Said) -> bool {
    said.message.qos == 0 && !said.message.retain
}

fn is_timed(said: &Said) -> bool {
    said.payload.timestamp.is_some_and(|at| UTC_MS.contains(&at))
}

fn is_complete(metric: &Metric) -> bool {
    metric.name.is_some() && metric.data_type.is_some() && metric.is_null == metric.value.is_none()
}

fn is_own(metric: &Metric) -> bool {
    matches!(metric.name.as_deref(), Some("bdSeq" | "Node Control/Rebirth"))
}

fn is_chronological(said: &Said) -> bool {
    said.payload
        .metrics
        .iter()
        .filter(|metric| !metric.is_historical)
        .is_sorted_by_key(|metric| metric.timestamp)
}

fn will_number(recording: &Recording, session: usize) -> Option<u64> {
    let payload = super::protobuf::read(&recording.wills().get(session)?.as_ref()?.payload)?;
    let metric = payload.metrics.into_iter().find(|metric| metric.name.as_deref() == Some("bdSeq"))?;
    metric.number()
}

fn will_numbers(recording: &Recording) -> Verdict {
    let numbers: Vec<_> =
        (0..recording.wills().len()).map(|session| will_number(recording, session)).collect();
    let steps =
        numbers.windows(2).filter(|pair| matches!(pair, [Some(one), Some(next)] if *next == (one + 1) % 256));
    match steps.count() {
        steps if steps + 1 == numbers.len() => Ok(steps),
        _ => Err(format!("{numbers:?}")),
    }
}

/// The topic is subscribed in each session in which something was said, before it was.
fn subscribes(recording: &Recording, verb: &str) -> Verdict {
    let mut count = 0;
    for birth in births(recording).filter(|said| said.verb.starts_with(&verb[..1])) {
        let topic = birth.message.topic.replacen("BIRTH", "CMD", 1);
        let start = recording.packets[..birth.place]
            .iter()
            .rposition(|packet| matches!(packet, Packet::Connect { .. }));
        let packets = &recording.packets[start.unwrap_or_default()..birth.place];
        // Nobody has to name each device.
        let any =
            topic.rsplit_once('/').map(|(node, _)| format!("{node}/+")).filter(|_| verb.starts_with('D'));
        let is_it = |packet: &Packet| matches!(packet, Packet::Subscribe { filter, qos: 1 } if *filter == topic || Some(filter) == any.as_ref());
        if !packets.iter().any(is_it) {
            return Err(format!("{topic} is not subscribed before packet {}", birth.place));
        }
        count += 1;
    }
    Ok(count)
}

fn births_first(recording: &Recording) -> Verdict {
    let mut seen = BTreeSet::new();
    let firsts = recording.said.iter().filter(|said| seen.insert(said.session));
    // A session that never had anything to say only dies.
    each(firsts.collect::<Vec<_>>().into_iter(), |said| matches!(said.verb.as_str(), "NBIRTH" | "NDEATH"))
}

fn node_birth<'a>(recording: &'a Recording, said: &Said) -> Option<&'a Said> {
    let mut before = recording.said.iter().rev().filter(|other| other.place < said.place);
    before.find(|other| other.verb == "NBIRTH" && other.session == said.session)
}

fn ids_differ(recording: &Recording) -> Verdict {
    let devices: BTreeSet<_> = recording.said.iter().filter_map(|said| said.device.as_ref()).collect();
    let lower: BTreeSet<_> = devices.iter().map(|device| device.to_lowercase()).collect();
    if lower.len() == devices.len() { Ok(devices.len()) } else { Err(format!("{devices:?}")) }
}

/// Each number is the one after the number before it, whoever it was about.
fn numbers(recording: &Recording, is_meant: impl Fn(&str) -> bool) -> Verdict {
    let numbered: Vec<&Said> = recording.said.iter().filter(|said| said.verb != "NDEATH").collect();
    let mut count = 0;
    for pair in numbered.windows(2) {
        let [before, said] = pair else { continue };
        if said.verb == "NBIRTH" || !is_meant(&said.verb) {
            continue;
        }
        let expected = before.payload.seq.map(|seq| (seq + 1) % 256);
        if said.payload.seq != expected || before.session != said.session {
            return Err(format!(
                "packet {}: {:?} behind {:?}",
                said.place, said.payload.seq, before.payload.seq
            ));
        }
        count += 1;
    }
    Ok(count)
}

/// Whether data tell only what the birth in force has told.
fn told_before(recording: &Recording, verb: &str) -> Verdict {
    each(recording.verb(verb), |said| {
        let Some(birth) = recording.birth_of(said) else { return false };
        let told: BTreeSet<_> = birth.payload.metrics.iter().filter_map(|metric| metric.alias).collect();
        said.payload.metrics.iter().all(|metric| metric.alias.is_some_and(|alias| told.contains(&alias)))
    })
}

/// Behind a birth of the node come the births of all devices that are born with it, and no data between them.
fn births_before_data(recording: &Recording) -> Verdict {
    let mut count = 0;
    for birth in recording.verb("NBIRTH") {
        let behind =
            recording.said.iter().filter(|said| said.place > birth.place && said.session == birth.session);
        let behind: Vec<_> = behind.take_while(|said| said.verb != "NBIRTH").collect();
        let births = behind.iter().take_while(|said| said.verb == "DBIRTH").count();
        // A device that is born later was dead, or unknown, at the birth of the node.
        let mut data_before = behind.iter().skip(births).filter(|said| said.is_data());
        if data_before.any(|said| recording.birth_of(said).is_none_or(|of| of.place < birth.place)) {
            return Err(format!("data without a birth behind packet {}", birth.place));
        }
        count += births;
    }
    Ok(count)
}

fn dead_are_silent(recording: &Recording) -> Verdict {
    let mut dead = BTreeSet::new();
    let mut count = 0;
    for said in &recording.said {
        match said.verb.as_str() {
            "NBIRTH" => dead.clear(),
            "DBIRTH" => drop(dead.remove(&said.device)),
            "DDEATH" => {
                count += 1;
                dead.insert(said.device.clone());
            }
            "DDATA" if dead.contains(&said.device) => {
                return Err(format!("packet {} of a dead device", said.place));
            }
            _ => {}
        }
    }
    Ok(count)
}

fn leaves(recording: &Recording, is_right: impl Fn(u8) -> bool) -> Verdict {
    let mut count = 0;
    for (place, packet) in recording.packets.iter().enumerate() {
        let Packet::Disconnect { reason } = packet else { continue };
        let last = recording.said.iter().rev().find(|said| said.place < place);
        if !is_right(*reason) || last.is_none_or(|said| said.verb != "NDEATH") {
            return Err(format!("packet {place}: reason {reason} behind {:?}", last.map(|said| &said.verb)));
        }
        count += 1;
    }
    Ok(count)
}

/// What is said behind each request for a birth.
fn rebirths(recording: &Recording, is_right: impl Fn(&Said) -> bool) -> Verdict {
    let mut count = 0;
    for (place, packet) in recording.packets.iter().enumerate() {
        let Packet::Heard(message) = packet else { continue };
        let payload = super::protobuf::read(&message.payload).unwrap_or_default();
        let is_asked = payload.metrics.iter().any(|metric| {
            metric.name.as_deref() == Some("Node Control/Rebirth") && metric.number() == Some(1)
        });
        if !message.topic.contains("/NCMD/") || !is_asked {
            continue;
        }
        let mut behind = recording.said.iter().filter(|said| said.place > place);
        // On the wire a message that was already on its way may cross the request.
        let next = behind.find(|said| said.payload.timestamp > payload.timestamp);
        match next {
            Some(next) if is_right(next) => count += 1,
            next => return Err(format!("packet {place}: {:?}", next.map(|next| &next.message.topic))),
        }
    }
    Ok(count)
}

/// A birth of the node that is not the first of its session is followed by a birth of each device that was alive.
fn reborn(recording: &Recording) -> Verdict {
    let mut alive: BTreeSet<Option<String>> = BTreeSet::new();
    let mut count = 0;
    for said in &recording.said {
        match said.verb.as_str() {
            "DBIRTH" => drop(alive.insert(said.device.clone())),
            "DDEATH" => drop(alive.remove(&said.device)),
            "NDEATH" => alive.clear(),
            "NBIRTH" if node_birth(recording, said).is_some() => {
                let behind = recording.said.iter().filter(|other| other.place > said.place);
                let births =
                    behind.take_while(|other| other.verb.starts_with("DB") || other.verb.starts_with("DDEA"));
                let born: BTreeSet<_> = births.map(|other| other.device.clone()).collect();
                if !alive.is_subset(&born) {
                    return Err(format!("packet {}: {alive:?} were alive, {born:?} are", said.place));
                }
                alive.clear();
                count += 1;
            }
            "NBIRTH" => alive.clear(),
            _ => {}
        }
    }
    Ok(count)
}

/// The value and the quality of a metric.
type Told = (Option<(u64, Field)>, Option<u64>);

/// No metric of data is what was told of it before.
fn only_changes(recording: &Recording, verb: &str) -> Verdict {
    let mut told: BTreeMap<u64, Told> = BTreeMap::new();
    let mut count = 0;
    for said in recording.said.iter().filter(|said| said.is_birth() || said.is_data()) {
        for metric in &said.payload.metrics {
            let Some(alias) = metric.alias else { continue };
            // What was so once says nothing of what is so now.
            if metric.is_historical {
                continue;
            }
            let before = told.get(&alias);
            let quality = metric.quality().or(before.and_then(|(_, quality)| *quality));
            let now = (metric.value.clone(), quality);
            if said.verb == verb {
                if before == Some(&now) {
                    return Err(format!("packet {}: alias {alias} is told again: {now:?}", said.place));
                }
                count += 1;
            }
            told.insert(alias, now);
        }
    }
    Ok(count)
}

fn aliases_are_unique(recording: &Recording) -> Verdict {
    let mut names: BTreeMap<(usize, u64), (Option<String>, Option<String>)> = BTreeMap::new();
    for said in births(recording) {
        for metric in &said.payload.metrics {
            let Some(alias) = metric.alias else { continue };
            let name = (said.device.clone(), metric.name.clone());
            let known = names.entry((said.session, alias)).or_insert_with(|| name.clone());
            if *known != name {
                return Err(format!("packet {}: alias {alias} is {known:?} and {name:?}", said.place));
            }
        }
    }
    Ok(names.len())
}
