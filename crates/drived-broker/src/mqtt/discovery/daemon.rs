//! The daemon with its lines as a device.

use serde_json::{Value, json};

use super::{
    super::{
        Face,
        topics::{Meant, Verb},
    },
    Device, alarms, button, component, expire_after,
    rights::{rights, said},
};
use drived_config::names::Kind;
use drived_plant::plant::{alarms::Owner, views::LineView};

/// The device of the daemon.
pub(super) fn device(face: &Face, lines: &[LineView]) -> Device {
    let topics = &face.topics;
    let device = json!({
        "identifiers": [topics.node()], "name": format!("drived {}", face.config.base), "model": "drived",
        "sw_version": env!("CARGO_PKG_VERSION"),
    });
    let expire_after = expire_after(face);
    let mut components = vec![component(
        "connected",
        "binary_sensor",
        json!({
            "name": "Connected", "device_class": "connectivity", "entity_category": "diagnostic",
            "state_topic": topics.status(), "payload_on": "online", "payload_off": "offline",
            "availability": [], "availability_mode": "all",
        }),
    )];
    for line in lines {
        let (id, topic) = (topics.id(Kind::Line, &line.name), topics.line(&line.name));
        components.push(component(
            format!("line_{id}"),
            "binary_sensor",
            json!({
                "name": format!("Line {}", line.name), "device_class": "connectivity",
                "entity_category": "diagnostic", "state_topic": topic, "expire_after": expire_after,
                "value_template": "{{ 'ON' if value_json.link == 'connected' else 'OFF' }}",
            }),
        ));
        components.push(component(
            format!("line_{id}_utilisation"),
            "sensor",
            json!({
                "name": format!("Line {} utilisation", line.name), "entity_category": "diagnostic",
                "unit_of_measurement": "%", "state_class": "measurement", "suggested_display_precision": 1,
                "state_topic": topic, "value_template": "{{ value_json.utilisation_percent }}",
                "expire_after": expire_after,
            }),
        ));
        let (owner, prefix) = (Owner::Line(line.name.clone()), format!("Line {} ", line.name));
        components.extend(alarms::components(face, &owner, &format!("line_{id}_"), &prefix));
    }
    components.extend(alarms::components(face, &Owner::Program, "", ""));
    let stop = rights(face)
        .stop
        .then(|| button("Stop all", topics.asking(&Meant::All, Verb::Stop, said(face)), "ramp"));
    components.push(component("stop_all", "button", stop.unwrap_or(Value::Null)));
    let availability = json!([{ "topic": topics.status() }]);
    Device { id: topics.node(), device, availability, components }
}
