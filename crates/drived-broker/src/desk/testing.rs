//! What is asked of every door in the same words, for the tests of each.

/// Objects that move no motor, with the outcome and the reason by which it is told, and the key that the text names.
pub const REFUSED: [(&str, &str, &str, &str); 12] = [
    (r#"{"id": "a", "action": "stop", "action": "start"}"#, "refused", "ambiguous", "action"),
    (r#"{"id": "b", "action": "start", "action": "stop"}"#, "refused", "ambiguous", "action"),
    (r#"{"id": "c", "action": "start", "stop": true}"#, "refused", "ambiguous", "stop"),
    (r#"{"id": "d", "stop": {"mode": "fast"}}"#, "refused", "ambiguous", "stop"),
    (r#"{"id": "e", "action": "start", "action": "STOP"}"#, "refused", "ambiguous", "action"),
    (r#"{"id": "f", "action": "start", "action": "start"}"#, "refused", "malformed", "action"),
    (
        r#"{"id": "g", "action": "start", "setpoint": {"frequency_hz": 10, "frequency_hz": 50}}"#,
        "refused",
        "malformed",
        "setpoint.frequency_hz",
    ),
    (
        r#"{"id": "h", "action": "start", "direction": "forward", "direction": "reverse"}"#,
        "refused",
        "malformed",
        "direction",
    ),
    (r#"{"id": "i", "action": "start", "setpoint": null}"#, "refused", "malformed", "setpoint"),
    (r#"{"id": "j", "action": "start", "speed": 1}"#, "refused", "malformed", "speed"),
    (r#"{"id": "k", "action": "start", "issued_unix_ms": 1000}"#, "expired", "expired", "old"),
    (r#"{"id": "l", "action": "start", "issued_unix_ms": "now"}"#, "refused", "malformed", "issued_unix_ms"),
];

/// Texts that are no object.
pub const NO_OBJECTS: [&str; 5] = ["null", "", "[]", "start", "{\"action\": \"start\""];

/// What is a stop, whatever else it says and also where it does not come to its end.
pub const STOPS: [&str; 11] = [
    r#"{"id": "s", "action": "stop"}"#,
    r#"{"id": "s", "action": "stop", "action": "stop"}"#,
    r#"{"id": "s", "action": "stop", "mode": "gently"}"#,
    r#"{"id": "s", "action": "stop", "mode": null, "expires_in_ms": 0}"#,
    r#"{"id": "s", "action": "stop", "setpoint": {"frequency_hz": 50, "frequency_hz": 50}}"#,
    r#"{"id": "s", "action": "stop", "issued_unix_ms": 1000}"#,
    r#"{"id": "s", "action": "STOP"}"#,
    r#"{"id": "s", "action": "stop""#,
    r#"{"id": "s", "action": "stop"}x"#,
    "STOP",
    r#""stop""#,
];
