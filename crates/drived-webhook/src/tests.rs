//! What the tests of this crate share.

use drive_fleet::alarms::AlarmView;
use serde_json::json;

/// An alarm in a state, as the API writes one.
pub(crate) fn view(id: u64, state: &str) -> AlarmView {
    let note = json!({ "by": "anna", "unix_ms": 5, "note": "seen" });
    let mut told = json!({
        "id": id, "kind": "tripped", "drive": "pump 1", "line": "lines", "remedy": "look at it", "first_unix_ms": 1,
        "last_unix_ms": 1, "count": 1, "state": state, "severity": "alarm", "of_motion": false, "text": "tripped: OCF",
    });
    if ["acknowledged", "over"].contains(&state) {
        told["acknowledged"] = note;
    }
    if ["returned", "over"].contains(&state) {
        told["returned_unix_ms"] = json!(9);
    }
    serde_json::from_value(told).expect("an alarm as the API writes it")
}
