//! What the daemon knows, for a person: every value with its age, an old one never as if it were live.

use drive_core::Faults;
use drive_fleet::view::ConcernView;
use serde_json::{Value, json};

use super::Target;
use crate::{
    failure::Failure,
    output::{self, Table},
    plant::{
        parameters::ParameterView,
        views::{DriveView, LineLink, StateView},
    },
};

/// The drives of a target, one a line, and what is wrong with the lines. Those in trouble come first.
///
/// # Errors
///
/// A drive does not answer.
pub(crate) fn overview(state: &StateView, target: &Target) -> Result<(), Failure> {
    let told: Vec<Value> = of_target(state, target).map(|drive| json!(drive)).collect();
    let drives: Vec<&Value> = told.iter().collect();
    let mut sorted = drives.clone();
    // Stable: behind those in trouble the order is that of the configuration.
    sorted.sort_by_key(|drive| concern(drive).map_or(usize::MAX, |concern| concern.rank));
    let mut table = Table::new(["drive", "state", "output", "setpoint", "current", "age"]);
    for drive in &sorted {
        let status = &drive["status"];
        let old = status["quality"] != "good";
        // An old value is set in brackets: it is what was, not what is.
        let shown = |text: Option<String>| {
            let text = output::or_dash(text);
            if old && text != "-" { format!("({text})") } else { text }
        };
        table.row([
            name(drive).to_owned(),
            state_in_words(drive),
            shown(hertz(&status["output_frequency_hz"])),
            output::or_dash(
                hertz(&drive["setpoint"]["frequency_hz"]).or_else(|| rpm(&drive["setpoint"]["speed_rpm"])),
            ),
            shown(current(status)),
            output::or_dash(status["age_ms"].as_u64().map(age)),
        ]);
    }
    output::say_table(table)?;
    for drive in sorted {
        if let Some(concern) = concern(drive) {
            output::say(format_args!("{}: {}", name(drive), concern.text))?;
        }
    }
    for line in state.lines.iter().filter(|line| line.link == LineLink::Away) {
        let why = line.error.as_deref().unwrap_or("nobody answers");
        output::say(format_args!("line {} is away: {why}", line.name))?;
    }
    answering(&drives)
}

/// Whether every drive answers.
fn answering(drives: &[&Value]) -> Result<(), Failure> {
    let silent: Vec<&str> =
        drives.iter().filter(|drive| drive["status"]["quality"] != "good").map(|drive| name(drive)).collect();
    match silent.len() {
        0 => Ok(()),
        1 => Err(Failure::Drive(format!("{} does not answer", silent.join("")))),
        number => {
            let first = silent.iter().take(3).copied().collect::<Vec<_>>().join(", ");
            let more = if number > 3 { ", …" } else { "" };
            Err(Failure::Drive(format!("{number} drives do not answer: {first}{more}")))
        }
    }
}

/// Everything that is known of one drive; its measurements too, if they are wanted.
///
/// # Errors
///
/// The drive does not answer.
pub(crate) fn whole(drive: &Value, all: bool) -> Result<(), Failure> {
    let family = drive["family"].as_str().unwrap_or_default();
    let place = format!("{family}@{} on line {}", drive["slave"], drive["line"].as_str().unwrap_or("?"));
    output::say(format_args!("{} {place}", name(drive)))?;
    let mut table = Table::texts();
    let mut row = |label: &str, value: Option<String>| {
        if let Some(value) = value {
            table.row([format!("  {label}"), value]);
        }
    };
    let status = &drive["status"];
    let fresh = status["quality"] == "good";
    row("state", Some(state_in_words(drive)));
    row("status", (!fresh).then(|| old_in_words(status)));
    row("why", drive["error"].as_str().map(str::to_owned));
    let dated = |text: String| if fresh { text } else { format!("({text})") };
    row("output frequency", hertz(&status["output_frequency_hz"]).map(dated));
    row("motor current", current(status).map(dated));
    row(
        "setpoint",
        hertz(&drive["setpoint"]["frequency_hz"]).or_else(|| rpm(&drive["setpoint"]["speed_rpm"])),
    );
    row("control", status["control"].as_str().map(words).map(dated));
    row("age", status["age_ms"].as_u64().map(age));
    row("words", raw(status));
    let fault = &drive["fault"];
    if fault.is_object() {
        row("fault", Some(fault_in_words(fault)));
        row("what to do", fault["remedy"].as_str().map(str::to_owned));
    }
    for concern in concerns(drive) {
        row("trouble", Some(concern.text));
        row("what to do", Some(concern.remedy));
    }
    row("starts by itself", list(&drive["starts_by_itself"]));
    row("start", drive["start_refused"].as_str().map(|why| format!("would be refused: {why}")));
    row("watchdog", drive["watchdog"]["check"].as_str().map(words));
    if all {
        for (key, value) in drive["measurements"].as_object().into_iter().flatten() {
            let (label, value) = measurement(key, value);
            row(&label, value);
        }
    }
    output::say_table(table)?;
    answering(&[drive])
}

/// The present faults and the history of one drive.
pub(crate) fn faults(drive: &str, faults: &Faults) -> Result<(), Failure> {
    if faults.present.is_empty() {
        output::say(format_args!("{drive} has no fault"))?;
    }
    let present = faults.present.iter().map(|fault| (format!("{drive} has tripped, fault"), fault));
    let warnings = faults.warnings.iter().map(|fault| ("  warning".to_owned(), fault));
    for (what, fault) in present.chain(warnings) {
        output::say(format_args!("{what} {fault}"))?;
        if let Some(remedy) = fault.remedy() {
            output::say(format_args!("  what to do: {remedy}"))?;
        }
    }
    match faults.reset_allowed {
        Some(true) if !faults.present.is_empty() => {
            output::say("  the drive would accept a reset now: drived reset")?;
        }
        Some(false) => output::say("  the drive would not accept a reset now: its cause is still there")?,
        _ => {}
    }
    for (position, fault) in faults.history.iter().enumerate() {
        output::say(format_args!("  history {}: {fault}", position + 1))?;
    }
    Ok(())
}

/// Registers with their values.
pub(crate) fn registers(rows: &[ParameterView]) -> Result<(), Failure> {
    let mut table = Table::new(["register", "mnemonic", "value", "name", "access"]);
    for row in rows {
        // A value that could not be read says why.
        let value = row.text.as_deref().or(row.error.as_deref()).unwrap_or("-");
        table.row([
            row.address.to_string(),
            row.mnemonic.to_string(),
            value.to_owned(),
            row.name.to_string(),
            row.access.to_string(),
        ]);
    }
    output::say_table(table)
}

/// A status in one line; nothing where there is none.
pub(crate) fn status_in_words(status: &Value) -> Option<String> {
    let state = status["state"].as_str().map(words)?;
    let parts = [
        Some(state),
        status["direction"].as_str().map(words),
        hertz(&status["output_frequency_hz"]),
        current(status),
        (status["at_reference"] == true).then(|| "at reference".to_owned()),
        status["control"].as_str().map(|control| format!("control: {}", words(control))),
    ];
    Some(parts.into_iter().flatten().collect::<Vec<_>>().join(", "))
}

fn of_target<'a>(state: &'a StateView, target: &'a Target) -> impl Iterator<Item = &'a DriveView> {
    state.drives.iter().filter(|drive| target.has(state, drive.name()))
}

fn name(drive: &Value) -> &str {
    drive["name"].as_str().unwrap_or("?")
}

/// All that troubles a drive, as the daemon tells it, the worst first.
pub(crate) fn concerns(drive: &Value) -> Vec<ConcernView> {
    serde_json::from_value(drive["concerns"].clone()).unwrap_or_default()
}

/// The worst that troubles a drive.
pub(crate) fn concern(drive: &Value) -> Option<ConcernView> {
    concerns(drive).into_iter().next()
}

/// What a drive does, as far as that is known: an old state is one that was.
pub(crate) fn state_in_words(drive: &Value) -> String {
    let status = &drive["status"];
    let state = status["state"].as_str().map(words);
    let state = match (state, status["direction"].as_str()) {
        (Some(state), Some("reverse")) => Some(format!("{state} reverse")),
        (state, _) => state,
    };
    let pending = if drive["stop"].is_object() { ", stop pending" } else { "" };
    match (drive["link"].as_str(), status["quality"].as_str(), state) {
        (Some("connecting"), _, None) => "connecting".to_owned(),
        (_, Some("good"), Some(state)) => {
            let fault = drive["fault"]["mnemonic"].as_str().filter(|_| state == "fault");
            format!("{}{pending}", fault.map_or(state.clone(), |fault| format!("{state} {fault}")))
        }
        (_, _, Some(state)) => format!("LOST, was {state}{pending}"),
        (_, _, None) => format!("LOST{pending}"),
    }
}

fn old_in_words(status: &Value) -> String {
    match status["age_ms"].as_u64() {
        Some(old) => format!("NOT LIVE: what stands in brackets was so {} ago", age(old)),
        None => "NOT LIVE: nothing is known".to_owned(),
    }
}

/// The code, the mnemonic and the meaning of a fault.
pub(crate) fn fault_in_words(fault: &Value) -> String {
    let code = fault["code"].as_u64().map(|code| code.to_string());
    let mnemonic = fault["mnemonic"].as_str().map(|mnemonic| format!("{mnemonic}:"));
    let meaning = fault["meaning"].as_str().map(str::to_owned);
    [code, mnemonic, meaning].into_iter().flatten().collect::<Vec<_>>().join(" ")
}

fn raw(status: &Value) -> Option<String> {
    let words = status["raw"].as_array()?.iter();
    let words =
        words.filter_map(|word| Some(format!("{} {:04X}h", word["code"].as_str()?, word["value"].as_u64()?)));
    Some(words.collect::<Vec<_>>().join(", ")).filter(|words| !words.is_empty())
}

fn list(values: &Value) -> Option<String> {
    let values: Vec<&str> = values.as_array()?.iter().filter_map(Value::as_str).collect();
    (!values.is_empty()).then(|| values.join(", "))
}

/// A key's name and its unit, which is its last word.
fn key_without_unit(key: &str) -> (&str, &str) {
    const UNITS: [(&str, &str); 9] = [
        ("_hz", "Hz"),
        ("_a", "A"),
        ("_v", "V"),
        ("_percent", "%"),
        ("_kw", "kW"),
        ("_kwh", "kWh"),
        ("_rpm", "rpm"),
        ("_h", "h"),
        ("_ms", "ms"),
    ];
    let unit = UNITS.iter().find_map(|(ending, unit)| Some((key.strip_suffix(ending)?, *unit)));
    unit.unwrap_or((key, ""))
}

/// A measurement's label and its value in its unit; no value where it is none for a person.
pub(crate) fn measurement(key: &str, value: &Value) -> (String, Option<String>) {
    let label = if key == "age_ms" { "measured".to_owned() } else { words(key_without_unit(key).0) };
    (label, measured(key, value))
}

/// A value with the unit that its key says; nothing where it is only a mark.
pub(crate) fn measured(key: &str, value: &Value) -> Option<String> {
    let (_, unit) = key_without_unit(key);
    match (key, value) {
        ("quality", value) if value == "good" => None,
        ("age_ms", value) => value.as_u64().map(|old| format!("{} ago", age(old))),
        ("inputs" | "outputs", value) => value.as_u64().map(|bits| format!("{bits:016b}")),
        (_, Value::String(text)) => Some(words(text)),
        (_, Value::Number(number)) => Some(format!("{number} {unit}").trim_end().to_owned()),
        (_, Value::Bool(yes)) => Some(if *yes { "yes" } else { "no" }.to_owned()),
        _ => None,
    }
}

/// A key, or a word of the API, as a person reads it.
pub(crate) fn words(text: &str) -> String {
    text.replace('_', " ")
}

fn hertz(value: &Value) -> Option<String> {
    value.as_f64().map(|value| format!("{value:.2} Hz"))
}

fn rpm(value: &Value) -> Option<String> {
    value.as_f64().map(|value| format!("{value:.0} rpm"))
}

fn current(status: &Value) -> Option<String> {
    let share = || status["current_percent"].as_f64().map(|value| format!("{value:.2} %"));
    status["current_a"].as_f64().map(|value| format!("{value:.1} A")).or_else(share)
}

/// An age as a person says it.
pub(crate) fn age(milliseconds: u64) -> String {
    match milliseconds {
        0..10_000 => format!("{}.{} s", milliseconds / 1_000, milliseconds % 1_000 / 100),
        10_000..120_000 => format!("{} s", milliseconds / 1_000),
        120_000..7_200_000 => format!("{} min", milliseconds / 60_000),
        _ => format!("{} h", milliseconds / 3_600_000),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_value_is_never_shown_as_if_it_were_live() {
        let mut drive = json!({
            "name": "pump 1", "link": "connected",
            "status": {"quality": "good", "age_ms": 120, "state": "running", "output_frequency_hz": 30.0},
        });
        assert_eq!(state_in_words(&drive), "running");
        assert_eq!(answering(&[&drive]), Ok(()));
        drive["link"] = "lost".into();
        drive["status"]["quality"] = "stale".into();
        drive["status"]["age_ms"] = 21_000.into();
        assert_eq!(state_in_words(&drive), "LOST, was running");
        assert_eq!(old_in_words(&drive["status"]), "NOT LIVE: what stands in brackets was so 21 s ago");
        assert_eq!(answering(&[&drive]), Err(Failure::Drive("pump 1 does not answer".to_owned())));
    }

    #[tokio::test(start_paused = true)]
    async fn of_every_pair_of_troubles_the_worst_is_told_as_by_everybody() {
        for (_, drive, worst) in crate::plant::testing::every_pair_of_troubles(tokio::time::Instant::now()) {
            assert_eq!(concern(&drive).map(|concern| concern.text), Some(worst));
        }
    }

    #[test]
    fn a_measurement_has_the_unit_of_its_key() {
        assert_eq!(measured("speed_rpm", &json!(890)), Some("890 rpm".to_owned()));
        assert_eq!(measured("output_power_kw", &json!(0.75)), Some("0.75 kW".to_owned()));
        assert_eq!(measured("inputs", &json!(3)), Some("0000000000000011".to_owned()));
        assert_eq!(measured("quality", &json!("good")), None);
        assert_eq!(key_without_unit("output_energy_kwh"), ("output_energy", "kWh"));
    }
}
