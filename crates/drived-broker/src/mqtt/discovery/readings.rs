//! Values with units: which of them a family has stands in its capabilities.

use drive_core::Quantity;
use serde_json::{Value, json};

/// How a value is shown.
struct Shown {
    name: &'static str,
    class: Option<&'static str>,
    unit: &'static str,
    precision: u8,
    is_diagnostic: bool,
    is_total: bool,
}

const fn shown(name: &'static str, class: &'static str, unit: &'static str, precision: u8) -> Shown {
    let class = if class.is_empty() { None } else { Some(class) };
    Shown { name, class, unit, precision, is_diagnostic: false, is_total: false }
}

/// How each is shown; `None`: not at Home Assistant. It has no class for revolutions per minute, and none for shares of torque and heat.
fn of(quantity: Quantity) -> Option<Shown> {
    let aside = |shown| Shown { is_diagnostic: true, ..shown };
    let total = |shown| Shown { is_diagnostic: true, is_total: true, ..shown };
    Some(match quantity {
        Quantity::OutputFrequency => shown("Frequency", "frequency", "Hz", 2),
        Quantity::Current => shown("Current", "current", "A", 1),
        Quantity::CurrentShare => shown("Current share", "", "%", 1),
        Quantity::Speed => shown("Speed", "", "rpm", 0),
        Quantity::OutputVoltage => aside(shown("Motor voltage", "voltage", "V", 1)),
        Quantity::LineVoltage => aside(shown("Mains voltage", "voltage", "V", 1)),
        Quantity::DcBusVoltage => aside(shown("DC bus voltage", "voltage", "V", 1)),
        Quantity::Torque => shown("Torque", "", "%", 1),
        Quantity::OutputPower => shown("Power", "power", "kW", 2),
        Quantity::InputPower => shown("Input power", "power", "kW", 2),
        Quantity::DriveThermal => shown("Drive thermal state", "", "%", 1),
        Quantity::MotorThermal => shown("Motor thermal state", "", "%", 1),
        Quantity::RunningTime => total(shown("Running hours", "duration", "h", 1)),
        Quantity::PoweredTime => total(shown("Powered hours", "duration", "h", 1)),
        _ => return None,
    })
}

/// The sensor of a value whose topics are these; `None`: it is not shown.
pub(super) fn sensor(quantity: Quantity, topic: impl Fn(&str) -> String, expire_after: u64) -> Option<Value> {
    let shown = of(quantity)?;
    let (topic, place) =
        if quantity.is_measured() { (topic("measurements"), "") } else { (topic("state"), "status.") };
    let mut sensor = json!({
        "name": shown.name, "state_topic": topic, "value_template": good(place, quantity.key()),
        "unit_of_measurement": shown.unit, "state_class": if shown.is_total { "total_increasing" } else { "measurement" },
        "suggested_display_precision": shown.precision, "expire_after": expire_after,
    });
    if let Some(class) = shown.class {
        sensor["device_class"] = class.into();
    }
    if shown.is_diagnostic {
        sensor["entity_category"] = "diagnostic".into();
    }
    Some(sensor)
}

/// A value while it is good, and `None` else.
pub(super) fn good(place: &str, key: &str) -> String {
    format!(
        "{{{{ value_json.{place}{key} | default(none) if value_json.{place}quality == 'good' else none }}}}"
    )
}
