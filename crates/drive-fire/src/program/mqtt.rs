//! What comes in from a broker: commands as they are and changed, with properties that nobody sends, and packets that are none.

use std::{
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::{Duration, Instant},
};

use super::{
    broker::{Broker, message, message_with},
    plant::Plant,
    promises,
};
use crate::fuzz::{Source, change};

/// How long the daemon may take to be there again, and to tell what became of a command.
const LONGEST: Duration = Duration::from_secs(40);

/// Topics of commands, as the manual of drived has them; `hmi` may stop and nothing else.
const TOPICS: &[&str] = &[
    "drived/drive/pump_1/command/hmi",
    "drived/drive/pump_2/stop/hmi",
    "drived/drive/fan/set/run/hmi",
    "drived/drive/fan/set/frequency/hmi",
    "drived/drive/fan/set/speed",
    "drived/drive/pump_1/reset/hmi",
    "drived/group/pumps/command/hmi",
    "drived/all/stop/panel",
    "drived/alarms/command/hmi",
    "drived/drive/pump_1/availability",
    "drived/line/bench",
    "drived/echo",
    "homeassistant/status",
    "homeassistant/device/drived/config",
];

const PAYLOADS: &[&str] = &[
    "{\"id\": \"4711\", \"action\": \"start\", \"direction\": \"forward\", \"setpoint\": {\"frequency_hz\": 30.5}}",
    "{\"action\": \"stop\", \"mode\": \"dc_injection\", \"injection_ms\": 3000}",
    "{\"id\": \"a\", \"action\": \"setpoint\", \"setpoint\": {\"frequency_hz\": 25}, \"lifetime_ms\": 900}",
    "{\"action\": \"acknowledge\", \"alarm\": 1}",
    "forward",
    "fast",
    "25.5",
    "online",
    "17",
    "",
];

/// Content type, response topic, correlation data, message expiry, user property, topic alias and subscription identifier.
const PROPERTIES: &[&[u8]] = &[
    &[],
    b"\x03\x00\x10application/json",
    b"\x08\x00\x07reply/x\x09\x00\x044711",
    &[0x02, 0, 0, 0, 1],
    &[0x02, 0xFF, 0xFF, 0xFF, 0xFF],
    b"\x26\x00\x01a\x00\x01b",
    &[0x23, 0, 1],
    &[0x0B, 1],
    b"\x08\x00\x0bdrived/echo",
];

/// So many executions have each promise among them.
pub(super) const COUNT: u64 = 2 * promises::COUNT;

/// One of the promises, or a message that nobody has thought of.
pub(super) fn execute(number: u64, plant: &Plant, rng: &mut Source) -> Result<(), String> {
    if number.is_multiple_of(2) { promises::is_kept(number / 2, plant) } else { one_message(plant, rng) }
}

/// One message, and behind it a stop that is asked for rightly and whose outcome is told.
fn one_message(plant: &Plant, rng: &mut Source) -> Result<(), String> {
    let broker = &plant.broker;
    until(|| broker.has_daemon()).map_err(|()| "the daemon does not come back to its broker".to_owned())?;
    let mut topic = TOPICS[rng.usize(..TOPICS.len())].as_bytes().to_vec();
    let mut payload = PAYLOADS[rng.usize(..PAYLOADS.len())].as_bytes().to_vec();
    let mut properties = PROPERTIES[rng.usize(..PROPERTIES.len())].to_vec();
    match rng.u8(..8) {
        0 => change(rng, &mut topic),
        1 => change(rng, &mut properties),
        2..=5 => change(rng, &mut payload),
        _ => {}
    }
    let topic = String::from_utf8_lossy(&topic).into_owned();
    let retained = u8::from(rng.u8(..8) == 1);
    let mut bytes = match rng.u8(..3) {
        0 => message(&topic, &payload, Some(rng.u16(1..))),
        _ => message_with(&topic, &payload, retained, &properties),
    };
    // A connection on which something came that is no packet is given up, and opened again after a while.
    if rng.u8(..24) == 1 {
        change(rng, &mut bytes);
    }
    let shown = || format!("{topic:?} {:?} {properties:02X?}", String::from_utf8_lossy(&payload));
    broker.give(&bytes);
    answers(broker).map_err(|why| format!("{why} behind {}", shown()))?;
    broker.wrong().map_or(Ok(()), Err)
}

/// A name for a command, which no other has.
pub(super) fn id() -> String {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    format!("fire-{}", NUMBER.fetch_add(1, Ordering::Relaxed))
}

/// What a stop of this name says.
pub(super) fn named(id: &str) -> String {
    format!("{{\"id\": \"{id}\", \"action\": \"stop\"}}")
}

/// A stop that is asked for rightly is taken, and its outcome told.
pub(super) fn answers(broker: &Broker) -> Result<(), String> {
    let id = id();
    let (mut last, mut told) = (None, None);
    until(|| {
        // In a flood the same stop is taken once in fifty milliseconds.
        if last.is_none_or(|last: Instant| last.elapsed() > Duration::from_millis(500)) {
            broker.give(&message("drived/drive/fan/command/hmi", named(&id).as_bytes(), None));
            last = Some(Instant::now());
        }
        told = broker.first(|said| promises::is_of(said, &id));
        told.is_some()
    })
    .map_err(|()| "no outcome of a stop is told".to_owned())?;
    match told.filter(|said| said.text.contains("\"refused\"")) {
        Some(said) => Err(format!("a stop is refused: {}", said.text)),
        None => Ok(()),
    }
}

#[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
pub(super) fn until(mut is_so: impl FnMut() -> bool) -> Result<(), ()> {
    let begun = Instant::now();
    while !is_so() {
        if begun.elapsed() > LONGEST {
            return Err(());
        }
        thread::sleep(Duration::from_millis(5));
    }
    Ok(())
}
