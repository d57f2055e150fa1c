//! A drive as a device: what its family has, and what would be obeyed.

use drive_core::State;
use drive_fleet::{Commanders, DriveHandle};
use serde_json::{Value, json};

use super::{
    super::{
        Face,
        last::ACCEPTED,
        topics::{Meant, Verb},
    },
    Component, Device, alarms, button, component, expire_after,
    readings::{self, good},
    rights::{rights, said},
    while_the_daemon_is,
};
use drived_config::names::Kind;
use drived_doors::Rights;
use drived_plant::plant::{alarms::Owner, commands::OutcomeWord};

/// After so many seconds at the broker, a command that would move a motor is gone.
const COMMANDS_EXPIRE_S: u32 = 2;
/// The highest setpoint that is offered where no limit is configured: the mains' own.
const USUAL_HIGH_HZ: f64 = 50.0;

/// Everything that a command can become. That this is not known has a word of its own: `unknown` is Home Assistant's for no value.
const OUTCOMES: [&str; 8] =
    [ACCEPTED, "confirmed", "not_confirmed", OUTCOME_UNKNOWN, "refused", "expired", "superseded", "nothing"];
const OUTCOME_UNKNOWN: &str = "outcome_unknown";

/// The device of a drive.
pub(super) fn device(face: &Face, drive: &DriveHandle) -> Device {
    let (name, topics) = (drive.name(), &face.topics);
    let id = topics.id(Kind::Drive, name);
    // Which one it is it says itself, when it is seen: that stands in a sensor of its own.
    let device = json!({
        "identifiers": [format!("{}_{id}", topics.node())],
        "name": name.as_ref(),
        "model": drive.capabilities().name,
        "via_device": topics.node(),
    });
    let topic = |what: &str| topics.drive(name, what);
    let mut components = Vec::new();
    for quantity in drive.capabilities().quantities {
        let sensor = readings::sensor(*quantity, topic, expire_after(face));
        components.extend(sensor.map(|sensor| component(quantity.key(), "sensor", sensor)));
    }
    components.extend(shown(face, topic));
    components.extend(alarms::components(face, &Owner::Drive(name.to_string()), "", ""));
    components.extend(controls(face, drive, &id));
    let availability = json!([{ "topic": topics.status() }, { "topic": topic("availability") }]);
    Device { id: format!("{}_{id}", topics.node()), device, availability, components }
}

/// What a drive shows besides its values.
fn shown(face: &Face, topic: impl Fn(&str) -> String) -> [Component; 6] {
    let expire_after = expire_after(face);
    let always = while_the_daemon_is(&face.topics);
    [
        component(
            "state",
            "sensor",
            json!({
                "name": "State", "device_class": "enum", "options": State::ALL, "state_topic": topic("state"),
                "value_template": good("status.", "state"), "expire_after": expire_after,
            }),
        ),
        component(
            "fault",
            "sensor",
            json!({
                "name": "Fault", "state_topic": topic("fault"), "json_attributes_topic": topic("fault"),
                "value_template": "{{ (value_json.mnemonic | default(value_json.code | default(none))) if value_json.present else \
                                   ('none' if value_json.quality == 'good' else none) }}",
                "expire_after": expire_after,
            }),
        ),
        component(
            "turning",
            "binary_sensor",
            json!({
                "name": "Turning", "device_class": "running", "state_topic": topic("state"),
                "value_template": "{% set status = value_json.status %}{{ none if status.quality != 'good' else ('ON' if \
                                   status.state in ['running', 'stopping', 'fault_reaction'] or status.state == 'quick_stop' \
                                   and status.output_frequency_hz | default(1) > 0 else 'OFF') }}",
                "expire_after": expire_after,
            }),
        ),
        component(
            "answers",
            "binary_sensor",
            json!({
                "name": "Answers", "device_class": "connectivity", "entity_category": "diagnostic",
                "state_topic": topic("availability"), "payload_on": "online", "payload_off": "offline",
                "availability": always, "availability_mode": "all",
            }),
        ),
        component(
            "identity",
            "sensor",
            json!({
                "name": "Identity", "entity_category": "diagnostic", "state_topic": topic("about"),
                "value_template": "{{ value_json.identity.model | default(none) }}",
                "json_attributes_topic": topic("about"),
                "json_attributes_template": "{{ value_json.identity | default({}) | to_json }}",
                "availability": always, "availability_mode": "all",
            }),
        ),
        component(
            "last_command",
            "sensor",
            json!({
                "name": "Last command", "device_class": "enum", "options": OUTCOMES,
                "state_topic": topic("last_command"), "value_template": format!(
                    "{{{{ '{OUTCOME_UNKNOWN}' if value_json.outcome == '{}' else value_json.outcome }}}}",
                    OutcomeWord::Unknown
                ),
                "json_attributes_topic": topic("last_command"),
                "availability": always, "availability_mode": "all",
            }),
        ),
    ]
}

/// What commands a drive.
fn controls(face: &Face, drive: &DriveHandle, id: &str) -> [Component; 5] {
    let settings = drive.settings();
    let rights = if settings.control { rights(face) } else { Rights::NONE };
    let meant = Meant::Drive(id.to_owned());
    let topic = |verb| face.topics.asking(&meant, verb, said(face));
    let commander = said(face).unwrap_or("mqtt");
    let may_operate = rights.operate
        && match &settings.commanders {
            Commanders::Anyone => true,
            Commanders::Only(names) => names.iter().any(|name| name == commander),
        };
    let moving = |mut values: Value| {
        values["message_expiry_interval"] = COMMANDS_EXPIRE_S.into();
        values
    };
    // Where it has to say when it was issued, by an object that does: a plain word has no room for it.
    let issued = |mut values: Value, asks: &str| {
        if face.config.needs_issued {
            values["command_topic"] = topic(Verb::Command).into();
            values["command_template"] =
                format!("{{{{ {{{asks}, 'issued_unix_ms': (now().timestamp() * 1000) | int}} | to_json }}}}")
                    .into();
        }
        moving(values)
    };
    let hertz = |frequency: drive_core::Frequency| f64::from(frequency.centihertz()) / 100.0;
    let (low, high) =
        (settings.limits.low.map_or(0.0, hertz), settings.limits.high.map_or(USUAL_HIGH_HZ, hertz));
    let high = high.max(low);
    let setpoint = json!({
        "name": "Setpoint", "device_class": "frequency", "unit_of_measurement": "Hz", "mode": "box",
        "min": low, "max": high, "step": 0.1, "optimistic": false, "retain": false,
        "command_topic": topic(Verb::Frequency), "state_topic": face.topics.drive(drive.name(), "state"),
        // Home Assistant drops a number outside its limits, and says so in its log each time.
        "value_template": format!(
            "{{% set hertz = (value_json.setpoint | default({{}})).frequency_hz | default(none) %}}{{{{ hertz if \
             value_json.status.quality == 'good' and hertz is not none and {low} <= hertz <= {high} else none }}}}"
        ),
    });
    let mut stop = button("Stop", topic(Verb::Stop), "ramp");
    stop["availability"] = while_the_daemon_is(&face.topics);
    stop["availability_mode"] = "all".into();
    let start =
        |name, word| issued(button(name, topic(Verb::Run), word), "'action': 'start', 'direction': value");
    let setpoint = issued(setpoint, "'action': 'setpoint', 'setpoint': {'frequency_hz': value}");
    let when = |may: bool, values: Value| if may { values } else { Value::Null };
    [
        component("setpoint", "number", when(may_operate, setpoint)),
        component("start", "button", when(may_operate, start("Start", "forward"))),
        component("start_reverse", "button", when(may_operate, start("Start in reverse", "reverse"))),
        // A stop is never too late, and goes to a drive that is lost as soon as it is back.
        component("stop", "button", when(rights.stop, stop)),
        component(
            "reset",
            "button",
            when(may_operate, moving(button("Reset fault", topic(Verb::Reset), "reset"))),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_has_its_option() {
        use OutcomeWord::{Confirmed, Expired, NotConfirmed, Nothing, Pending, Refused, Superseded, Unknown};
        let all = [Pending, Confirmed, NotConfirmed, Unknown, Refused, Expired, Superseded, Nothing];
        let words =
            all.map(|word| word.to_string().replace("unknown", OUTCOME_UNKNOWN).replace("pending", ACCEPTED));
        assert_eq!(words, OUTCOMES);
    }
}
