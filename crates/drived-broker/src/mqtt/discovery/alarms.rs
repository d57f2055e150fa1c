//! The alarms of a drive, of a line or of the program as entities, which are there for as long as the daemon is: that a drive is lost is
//! told while it is.

use drive_fleet::alarms::{AlarmKind, AlarmState};
use serde_json::{Value, json};

use super::{super::Face, Component, component, expire_after, rights, while_the_daemon_is};
use drived_plant::plant::alarms::Owner;

/// The entities of somebody's alarms: where the life of the one that matters most stands, with all of them in the attributes; whether
/// there is a problem; each alarm as it comes; and that somebody takes note of those that he was shown, and of no others.
pub(super) fn components(face: &Face, owner: &Owner, id: &str, name: &str) -> [Component; 4] {
    let (topic, expire_after) = (face.topics.alarms(owner), expire_after(face));
    let always = while_the_daemon_is(&face.topics);
    let named = |text: &str| match name {
        "" => text.to_owned(),
        of => format!("{of}{}", text.to_lowercase()),
    };
    let states = std::iter::once("none".to_owned())
        .chain(AlarmState::ALL.iter().filter(|state| **state != AlarmState::Over).map(ToString::to_string));
    let kinds: Vec<&str> = AlarmKind::all().map(AlarmKind::word).collect();
    let may = rights::rights(face).operate;
    let acknowledge = json!({
        "name": named("Acknowledge alarms"), "retain": false,
        "command_topic": face.topics.asking_of_alarms(rights::said(face)),
        "json_attributes_topic": topic,
        "json_attributes_template": "{{ {'waiting': value_json.waiting} | to_json }}",
        "command_template": "{{ {'action': 'acknowledge', 'alarms': this.attributes.waiting | default([])} | to_json }}",
        "availability": always, "availability_mode": "all",
    });
    [
        component(
            format!("{id}alarms"),
            "sensor",
            json!({
                "name": named("Alarms"), "device_class": "enum", "options": states.collect::<Vec<_>>(), "state_topic": topic,
                "value_template": "{{ value_json.alarms[0].state if value_json.alarms else 'none' }}",
                "json_attributes_topic": topic,
                "json_attributes_template": "{{ dict(value_json.alarms[0] if value_json.alarms else {}, \
                                             active=value_json.active, waiting=value_json.waiting | count, \
                                             alarms=value_json.alarms) | to_json }}",
                "expire_after": expire_after, "availability": always, "availability_mode": "all",
            }),
        ),
        component(
            format!("{id}problem"),
            "binary_sensor",
            json!({
                "name": named("Problem"), "device_class": "problem", "state_topic": topic,
                "value_template": "{{ 'ON' if value_json.problem else 'OFF' }}",
                "expire_after": expire_after, "availability": always, "availability_mode": "all",
            }),
        ),
        component(
            format!("{id}alarm"),
            "event",
            json!({
                "name": named("Alarm"), "event_types": kinds, "state_topic": face.topics.alarm(owner),
                "value_template": "{{ dict(value_json, event_type=value_json.kind) | to_json }}",
                "availability": always, "availability_mode": "all",
            }),
        ),
        component(format!("{id}acknowledge"), "button", if may { acknowledge } else { Value::Null }),
    ]
}
