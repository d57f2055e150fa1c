//! Which metrics there are, and where in the objects of the API their values stand.

use drive_sparkplug::{DataType, Definition, Quality, Reading, Value};
use serde_json::{Value as Json, json};

use drived_plant::plant::{
    alarms::{OwnAlarms, Owner},
    past::IsView,
    untold::UntoldPoint,
};

/// A metric: its name, its type, and the pointer to its value.
type Row = (&'static str, DataType, &'static str);

/// The metrics that a host may write.
pub(super) const SETPOINT: &str = "Control/Setpoint";
pub(super) const SPEED_SETPOINT: &str = "Control/Speed Setpoint";
pub(super) const COMMAND: &str = "Control/Command";
pub(super) const ALARMS_COMMAND: &str = "Alarms/Command";

/// What the daemon has.
#[rustfmt::skip]
const DAEMON: &[Row] = &[
    ("Daemon/Version", DataType::String, "/version"),
];

/// What each of its lines has, below its id.
#[rustfmt::skip]
const LINE: &[Row] = &[
    ("Name", DataType::String, "/name"),
    ("Link", DataType::String, "/link"),
    ("Utilisation", DataType::Double, "/utilisation_percent"),
    ("Worst Case Stop", DataType::UInt64, "/worst_case_stop_ms"),
    ("Cycle", DataType::UInt64, "/cycle_ms"),
    ("Exchanges", DataType::UInt64, "/exchanges"),
    ("Errors/No Answer", DataType::UInt64, "/errors/no_answer"),
    ("Errors/Damaged", DataType::UInt64, "/errors/damaged"),
    ("Errors/Late", DataType::UInt64, "/errors/late"),
    ("Errors/Mismatched", DataType::UInt64, "/errors/mismatched"),
    ("Errors/Exception", DataType::UInt64, "/errors/exception"),
    ("Errors/Foreign", DataType::UInt64, "/errors/foreign"),
];

/// What was done last with alarms, by what a host has written to the node.
#[rustfmt::skip]
const DONE: &[Row] = &[
    (ALARMS_COMMAND, DataType::String, ""),
    ("Alarms/LastCommand/Id", DataType::String, "/id"),
    ("Alarms/LastCommand/Outcome", DataType::String, "/outcome"),
    ("Alarms/LastCommand/Reason", DataType::String, "/reason"),
    ("Alarms/LastCommand/Text", DataType::String, "/text"),
    ("Alarms/LastCommand/Time", DataType::DateTime, "/time_unix_ms"),
];

/// The alarms of the program, of each line and of each drive, below `Alarms`: of the node, for a device is silent while it is lost.
#[rustfmt::skip]
const ALARMS: &[Row] = &[
    ("Problem", DataType::Boolean, "/problem"),
    ("Active", DataType::UInt32, "/active"),
    ("Waiting", DataType::UInt32, "/waiting_count"),
    ("State", DataType::String, "/alarms/0/state"),
    ("Number", DataType::UInt64, "/alarms/0/id"),
    ("Kind", DataType::String, "/alarms/0/kind"),
    ("Severity", DataType::String, "/alarms/0/severity"),
    ("Text", DataType::String, "/alarms/0/text"),
    ("Remedy", DataType::String, "/alarms/0/remedy"),
    ("First", DataType::DateTime, "/alarms/0/first_unix_ms"),
    ("Last", DataType::DateTime, "/alarms/0/last_unix_ms"),
    ("Count", DataType::UInt32, "/alarms/0/count"),
    ("Acknowledged By", DataType::String, "/alarms/0/acknowledged/by"),
    ("Acknowledged", DataType::DateTime, "/alarms/0/acknowledged/unix_ms"),
    ("Note", DataType::String, "/alarms/0/acknowledged/note"),
    ("Shelved Until", DataType::DateTime, "/alarms/0/shelved/until_unix_ms"),
    ("Suppressed By", DataType::UInt64, "/alarms/0/suppressed_by"),
    ("All", DataType::String, "/all"),
];

/// What each drive has. A value that its family does not have is null.
#[rustfmt::skip]
const DRIVE: &[Row] = &[
    ("Status/State", DataType::String, "/status/state"),
    ("Status/Direction", DataType::String, "/status/direction"),
    ("Status/Output Frequency", DataType::Double, "/status/output_frequency_hz"),
    ("Status/Current", DataType::Double, "/status/current_a"),
    ("Status/Current Share", DataType::Double, "/status/current_percent"),
    ("Status/At Reference", DataType::Boolean, "/status/at_reference"),
    ("Status/Reached", DataType::Boolean, "/reached"),
    ("Status/Warning", DataType::Boolean, "/status/warning"),
    ("Status/Control", DataType::String, "/status/control"),
    ("Fault/Present", DataType::Boolean, "/fault/present"),
    ("Fault/Code", DataType::Int32, "/fault/code"),
    ("Fault/Mnemonic", DataType::String, "/fault/mnemonic"),
    ("Fault/Meaning", DataType::String, "/fault/meaning"),
    ("Fault/Remedy", DataType::String, "/fault/remedy"),
    ("Fault/Time", DataType::DateTime, "/fault/time_unix_ms"),
    ("Measurements/Reference Frequency", DataType::Double, "/measurements/reference/frequency_hz"),
    ("Measurements/Reference Speed", DataType::Double, "/measurements/reference/speed_rpm"),
    ("Measurements/Speed", DataType::Double, "/measurements/speed_rpm"),
    ("Measurements/Output Voltage", DataType::Double, "/measurements/output_voltage_v"),
    ("Measurements/Output Voltage Share", DataType::Double, "/measurements/output_voltage_percent"),
    ("Measurements/Line Voltage", DataType::Double, "/measurements/line_voltage_v"),
    ("Measurements/DC Bus Voltage", DataType::Double, "/measurements/dc_bus_voltage_v"),
    ("Measurements/DC Bus Voltage Share", DataType::Double, "/measurements/dc_bus_voltage_percent"),
    ("Measurements/Torque", DataType::Double, "/measurements/torque_percent"),
    ("Measurements/Power", DataType::Double, "/measurements/power_percent"),
    ("Measurements/Input Power", DataType::Double, "/measurements/input_power_kw"),
    ("Measurements/Output Power", DataType::Double, "/measurements/output_power_kw"),
    ("Measurements/Drive Thermal State", DataType::Double, "/measurements/drive_thermal_percent"),
    ("Measurements/Motor Thermal State", DataType::Double, "/measurements/motor_thermal_percent"),
    ("Measurements/Drive Load", DataType::Double, "/measurements/drive_load_percent"),
    ("Measurements/Motor Load", DataType::Double, "/measurements/motor_load_percent"),
    ("Measurements/Input Energy", DataType::UInt64, "/measurements/input_energy_counts"),
    ("Measurements/Output Energy", DataType::UInt64, "/measurements/output_energy_counts"),
    ("Measurements/Running Time", DataType::Double, "/measurements/running_time_h"),
    ("Measurements/Powered Time", DataType::Double, "/measurements/powered_time_h"),
    ("Measurements/Inputs", DataType::UInt32, "/measurements/inputs"),
    ("Measurements/Outputs", DataType::UInt32, "/measurements/outputs"),
    (SETPOINT, DataType::Double, "/setpoint/frequency_hz"),
    (SPEED_SETPOINT, DataType::Double, "/setpoint/speed_rpm"),
    (COMMAND, DataType::String, ""),
    ("Control/Allowed", DataType::Boolean, "/control"),
    ("Control/Start Refused", DataType::String, "/start_refused"),
    ("Control/Low Limit", DataType::Double, "/limits/low_hz"),
    ("Control/High Limit", DataType::Double, "/limits/high_hz"),
    ("Control/LastCommand/Id", DataType::String, "/last/id"),
    ("Control/LastCommand/Outcome", DataType::String, "/last/outcome"),
    ("Control/LastCommand/Reason", DataType::String, "/last/reason"),
    ("Control/LastCommand/Text", DataType::String, "/last/text"),
    ("Control/LastCommand/Time", DataType::DateTime, "/last/time_unix_ms"),
    ("Properties/Name", DataType::String, "/name"),
    ("Properties/Short Name", DataType::String, "/short_name"),
    ("Properties/Slot", DataType::Int32, "/slot"),
    ("Properties/Line", DataType::String, "/line"),
    ("Properties/Slave", DataType::Int32, "/slave"),
    ("Properties/Family", DataType::String, "/family"),
    ("Properties/Not Known", DataType::String, "/not_known"),
    ("Properties/Model", DataType::String, "/identity/model"),
    ("Properties/Firmware", DataType::String, "/identity/firmware"),
];

/// The metrics of a drive.
pub(super) fn of_a_drive() -> Vec<Definition> {
    DRIVE.iter().map(|&(name, data_type, _)| Definition::new(name, data_type)).collect()
}

/// The metrics of the daemon, of lines of these ids, and of the alarms of these.
pub(super) fn of_the_node<'a>(
    lines: impl IntoIterator<Item = &'a String>,
    owners: impl IntoIterator<Item = &'a Owner>,
) -> Vec<Definition> {
    let own = [DAEMON, DONE].into_iter().flatten();
    let own = own.map(|&(name, data_type, _)| Definition::new(name, data_type));
    let lines = lines.into_iter().flat_map(|line| {
        LINE.iter().map(move |&(name, data_type, _)| Definition::new(below(line, name), data_type))
    });
    let alarms = owners.into_iter().flat_map(|owner| {
        ALARMS.iter().map(move |&(name, data_type, _)| Definition::new(of_alarms(owner, name), data_type))
    });
    own.chain(lines).chain(alarms).collect()
}

/// The name of a metric of somebody's alarms.
fn of_alarms(owner: &Owner, name: &str) -> String {
    match owner {
        Owner::Program => format!("Alarms/{name}"),
        Owner::Line(line) => below(line, &format!("Alarms/{name}")),
        Owner::Drive(drive) => format!("Drives/{drive}/Alarms/{name}"),
    }
}

/// The name of a metric of a line.
fn below(line: &str, name: &str) -> String {
    format!("Lines/{line}/{name}")
}

/// What the daemon's object says.
pub(super) fn read_daemon(daemon: &Json, now_unix_ms: u64) -> impl Iterator<Item = (&'static str, Reading)> {
    DAEMON
        .iter()
        .map(move |&(name, data_type, pointer)| (name, good(value(daemon, data_type, pointer), now_unix_ms)))
}

/// What was done last with alarms.
pub(super) fn read_done(done: &Json, now_unix_ms: u64) -> impl Iterator<Item = (&'static str, Reading)> {
    DONE.iter()
        .map(move |&(name, data_type, pointer)| (name, good(value(done, data_type, pointer), now_unix_ms)))
}

/// What somebody's alarms are like.
pub(super) fn read_alarms(
    owner: &Owner,
    alarms: &OwnAlarms,
    now_unix_ms: u64,
) -> impl Iterator<Item = (String, Reading)> {
    let mut object = json!(alarms);
    object["waiting_count"] = alarms.waiting.len().into();
    object["all"] = object["alarms"].to_string().into();
    ALARMS.iter().map(move |&(name, data_type, pointer)| {
        (of_alarms(owner, name), good(value(&object, data_type, pointer), now_unix_ms))
    })
}

/// What a line's object says.
pub(super) fn read_line(line: &Json, now_unix_ms: u64) -> impl Iterator<Item = (String, Reading)> {
    let id = line["id"].as_str().unwrap_or_default();
    LINE.iter().map(move |&(metric, data_type, pointer)| {
        (below(id, metric), good(value(line, data_type, pointer), now_unix_ms))
    })
}

/// What a drive's object says, each value by the age and the quality of the part that it stands in.
pub(super) fn read_drive(drive: &Json, now_unix_ms: u64) -> impl Iterator<Item = (&'static str, Reading)> {
    let judge = |part: &str| {
        let age = drive[part]["age_ms"].as_u64().unwrap_or_default();
        match drive[part]["quality"].as_str() {
            Some("good") => (Quality::Good, now_unix_ms.saturating_sub(age)),
            // Since when it is so is now: whoever reads it learns it here.
            Some("stale") => (Quality::Stale, now_unix_ms),
            _ => (Quality::Bad, now_unix_ms),
        }
    };
    let (status, measurements) = (judge("status"), judge("measurements"));
    DRIVE.iter().map(move |&(name, data_type, pointer)| {
        let (quality, unix_ms) = match name.split('/').next() {
            Some("Status" | "Fault") => status,
            Some("Measurements") => measurements,
            _ => (Quality::Good, now_unix_ms),
        };
        (name, Reading { value: value(drive, data_type, pointer), quality, unix_ms })
    })
}

/// What the history kept of a value of a drive, as its metric; `None`: there is none of it. Where nothing was known any more it is stale.
pub(super) fn of_the_past(kept: &UntoldPoint) -> Option<(&'static str, Reading)> {
    let (name, data_type, _) = DRIVE.iter().find(|(_, _, pointer)| kept_as(pointer) == Some(kept.value))?;
    let unix_ms = u64::try_from(kept.point.time_unix_ms).unwrap_or_default();
    let value = kept.point.is.as_ref().and_then(|is| value_of_the_past(*data_type, is));
    let quality = if value.is_some() { Quality::Good } else { Quality::Stale };
    Some((*name, Reading { value, quality, unix_ms }))
}

/// The name in the history of what an object has there.
fn kept_as(pointer: &'static str) -> Option<&'static str> {
    if pointer == "/setpoint/frequency_hz" {
        return Some("setpoint_hz");
    }
    let (part, name) = pointer.strip_prefix('/')?.split_once('/')?;
    (matches!(part, "status" | "measurements") && !name.contains('/')).then_some(name)
}

/// A value of the history as one of this type: the words that both have are written with spaces there.
fn value_of_the_past(data_type: DataType, is: &IsView) -> Option<Value> {
    Some(match (data_type, is) {
        (DataType::Double, IsView::Number(number)) => Value::Double(*number),
        // Counts, which are whole.
        (DataType::UInt64, IsView::Number(number)) if *number >= 0.0 => Value::UInt64(*number as u64),
        (DataType::UInt32, IsView::Word(bits)) => Value::UInt32(bits.parse().ok()?),
        (DataType::Boolean, IsView::Word(word)) => Value::Boolean(match word.as_str() {
            "yes" => true,
            "no" => false,
            _ => return None,
        }),
        (DataType::String, IsView::Word(word)) => Value::String(word.replace(' ', "_")),
        _ => return None,
    })
}

fn good(value: Option<Value>, unix_ms: u64) -> Reading {
    Reading { value, quality: Quality::Good, unix_ms }
}

/// A value of an object by its pointer; the whole object is none.
fn value(object: &Json, data_type: DataType, pointer: &str) -> Option<Value> {
    let found = object.pointer(pointer)?;
    Some(match data_type {
        DataType::Double => Value::Double(found.as_f64()?),
        DataType::Boolean => Value::Boolean(found.as_bool()?),
        DataType::String => Value::String(match found {
            // Sentences.
            Json::Array(all) => all.iter().filter_map(Json::as_str).collect::<Vec<_>>().join("; "),
            _ => found.as_str()?.to_owned(),
        }),
        DataType::DateTime => Value::DateTime(found.as_u64()?),
        DataType::UInt64 => Value::UInt64(found.as_u64()?),
        DataType::UInt32 => Value::UInt32(found.as_u64()?.try_into().ok()?),
        DataType::Int32 => Value::Int32(found.as_i64()?.try_into().ok()?),
        _ => return None,
    })
}
