//! What a network brings to the doors: commands in JSON, payloads of Sparkplug B, and what people write of drives and lines.

use drive_sparkplug::{MOST_METRICS, Metric, Payload, Raw};
use drived_words::{
    drive_spec::{Addresses, DriveSpec},
    line_spec::LineSpec,
    object::Object,
};
use serde_json::Value;

use super::{
    bytes::{LONGEST, change, text},
    source::Source,
};

/// Commands as the manual of `drived` has them, and what is wrong in a way of its own.
const COMMANDS: &[&str] = &[
    r#"{"id": "a1", "action": "start", "direction": "forward", "setpoint": {"frequency_hz": 25.5}, "expires_in_ms": 1000}"#,
    r#"{"id": "a2", "action": "stop", "mode": "ramp"}"#,
    r#"{"action": "setpoint", "setpoint": {"speed_rpm": -1480}, "until": "at_reference"}"#,
    r#"{"action": "stop", "action": "start"}"#,
    r#"{"a": [0, {"c": 2, "c": null}], "b": {"c": 1e400}}"#,
    r#"{"setpoint": {"frequency_hz": 1e-7, "frequency_hz": 18446744073709551616}}"#,
    r#"[{"action": "stop"}, "\ud83d\ude00", "\u0000"]"#,
];

/// The common reader and ours say the same of any bytes; what stands twice is seen, and the last of it counts for both.
pub(super) fn json(rng: &mut Source) -> Result<(), String> {
    let text = rng.bytes(LONGEST, |rng| {
        let mut text = COMMANDS[rng.usize(..COMMANDS.len())].as_bytes().to_vec();
        if rng.u8(..16) == 0 {
            let depth = rng.usize(1..400);
            text = [b"{\"a\":".repeat(depth), text, b"}".repeat(depth)].concat();
        }
        for _ in 0..rng.usize(..3) {
            change(rng, &mut text);
        }
        text
    });
    let differs = |what: &str| Err(format!("{what}: {:?}", String::from_utf8_lossy(&text)));
    match (Object::read(&text), serde_json::from_slice::<Value>(&text)) {
        (Ok(Some(object)), Ok(Value::Object(theirs))) => {
            let members = object.members().count();
            if members < theirs.len() || object.twice().is_none() && members != theirs.len() {
                return differs("another number of members");
            }
            if object.into_members() == theirs { Ok(()) } else { differs("other members") }
        }
        (Ok(None), Ok(theirs)) if !theirs.is_object() => Ok(()),
        (Err(_), Err(_)) => Ok(()),
        _ => differs("one reads it, the other does not"),
    }
}

/// A payload that was changed is one, within its bounds, or is refused; what is read is written as what was read.
pub(super) fn sparkplug(rng: &mut Source) -> Result<(), String> {
    let metric = |rng: &mut Source| Metric {
        name: rng.bool().then(|| "Control/Setpoint".to_owned()),
        alias: rng.bool().then(|| rng.u64(..)),
        data_type: Some(rng.u32(..40)),
        is_null: rng.bool(),
        value: Some(match rng.u8(..3) {
            0 => Raw::Double(f64::from_bits(rng.u64(..))),
            1 => Raw::Boolean(rng.bool()),
            _ => Raw::String("stop".to_owned()),
        }),
        ..Metric::default()
    };
    let bytes = rng.bytes(LONGEST, |rng| {
        let metrics = (0..rng.usize(..6)).map(|_| metric(rng)).collect();
        let mut bytes = Payload { timestamp: Some(rng.u64(..)), seq: Some(rng.u64(..256)), metrics }.encode();
        for _ in 0..rng.usize(..4) {
            change(rng, &mut bytes);
        }
        bytes
    });
    let Ok(read) = Payload::decode(&bytes) else { return Ok(()) };
    if read.metrics.len() > MOST_METRICS {
        return Err(format!("{} metrics", read.metrics.len()));
    }
    // NaN equals nothing: bytes are compared.
    let written = read.encode();
    match Payload::decode(&written) {
        Ok(again) if again.encode() == written => Ok(()),
        other => Err(format!("written otherwise than read: {other:?}")),
    }
}

/// Drives and lines as a command line has them are read or refused in words.
pub(super) fn specs(rng: &mut Source) -> Result<(), String> {
    const SPECS: &[&str] = &[
        "atv312@1-31",
        "3g3ev@2,4,7-9",
        "atv21@5:injection=2s",
        "serial=/dev/ttyUSB0,19200,8E1,ascii",
        "tcp:10.0.0.7:502,gateway=3x1s/4",
        "rtu-tcp:server:4001,9600,8N1,unitelway",
        "limit=10Hz..50Hz",
    ];
    let text = String::from_utf8_lossy(&text(rng, SPECS)).into_owned();
    let refusals = [
        text.parse::<DriveSpec>().err().map(|error| error.to_string()),
        text.parse::<Addresses>().err().map(|error| error.to_string()),
        text.parse::<LineSpec>().err().map(|error| error.to_string()),
    ];
    match refusals.into_iter().flatten().find(String::is_empty) {
        Some(_) => Err(format!("{text:?} is refused without a word")),
        None => Ok(()),
    }
}
