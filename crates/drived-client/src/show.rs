//! What the daemon knows, for a person: every value with its age, an old one never as if it were live.

use drive_core::Faults;
use tokio::time::Instant;

use super::Target;
use drived_plant::plant::{
    parameters::ParameterView,
    views::{DriveView, LineLink, StateView},
};
use drived_screen::row::{Column, Row};
use drived_words::{
    failure::Failure,
    output::{self, Table},
    values,
};

/// The columns of the overview.
const COLUMNS: [Column; 5] =
    [Column::State, Column::Frequency, Column::Current, Column::Control, Column::Age];

/// The drives of a target, one a line, and what is wrong with the lines. Those in trouble come first.
///
/// # Errors
///
/// A drive does not answer.
pub fn overview(state: &StateView, target: &Target) -> Result<(), Failure> {
    let drives: Vec<&DriveView> = of_target(state, target).collect();
    output::say_table(table(&drives, Instant::now()))?;
    troubles(state, &drives).iter().try_for_each(output::say)?;
    answering(&drives)
}

/// What [`overview`] says.
pub fn overview_text(state: &StateView, target: &Target) -> String {
    let drives: Vec<&DriveView> = of_target(state, target).collect();
    format!("{}\n{}", table(&drives, Instant::now()), troubles(state, &drives).join("\n"))
}

/// What troubles drives and lines, in a sentence each.
fn troubles(state: &StateView, drives: &[&DriveView]) -> Vec<String> {
    let of_drives = sorted(drives)
        .into_iter()
        .filter_map(|drive| Some(format!("{}: {}", drive.name(), drive.snapshot.concern()?.text)));
    let away = state.lines.iter().filter(|line| line.link == LineLink::Away).map(|line| {
        let why = line.error.as_deref().unwrap_or("nobody answers");
        format!("line {} is away: {why}", line.name)
    });
    of_drives.chain(away).collect()
}

/// The drives, one a row.
fn table(drives: &[&DriveView], now: Instant) -> Table {
    let heads = ["drive"].into_iter().chain(COLUMNS.map(Column::head));
    let mut table = Table::headed(heads.map(str::to_owned));
    for drive in sorted(drives) {
        let row = Row::of(drive, now);
        let cells = COLUMNS.map(|column| row.cell(column).to_owned());
        table.cells([row.name].into_iter().chain(cells));
    }
    table
}

/// Those in trouble first, behind them in the order of the configuration.
fn sorted<'a>(drives: &[&'a DriveView]) -> Vec<&'a DriveView> {
    let mut sorted = drives.to_vec();
    sorted.sort_by_key(|drive| drive.snapshot.rank());
    sorted
}

/// Whether every drive answers.
fn answering(drives: &[&DriveView]) -> Result<(), Failure> {
    let silent = drives.iter().filter(|drive| !drive.snapshot.status.is_good());
    let silent: Vec<&str> = silent.map(|drive| drive.name()).collect();
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
pub fn whole(drive: &DriveView, all: bool) -> Result<(), Failure> {
    let DriveView { line, slave, family, snapshot: known, .. } = drive;
    output::say(format_args!("{} {family}@{slave} on line {line}", drive.name()))?;
    let mut table = Table::texts();
    let mut row = |label: &str, value: Option<String>| {
        if let Some(value) = value {
            table.row([format!("  {label}"), value]);
        }
    };
    let now = Instant::now();
    let is_live = known.status.is_good();
    row("state", Some(Row::of(drive, now).cell(Column::State).to_owned()));
    let status = known.status.value.as_ref();
    let age = status.and_then(|status| status.at).map(|at| output::age(now.saturating_duration_since(at)));
    row("status", (!is_live).then(|| old_in_words(age.as_deref())));
    row("why", known.error.clone());
    let dated = |text: String| if is_live { text } else { format!("({text})") };
    for (label, value) in status.into_iter().flat_map(values::status) {
        row(label, Some(dated(value)));
    }
    row("setpoint", known.setpoint.map(|setpoint| setpoint.to_string()));
    row("age", age);
    if let Some(trip) = &known.fault {
        row("fault", Some(values::tripped(trip.fault.as_ref())));
        row("what to do", trip.fault.and_then(|fault| fault.remedy()).map(str::to_owned));
    }
    for concern in &known.concerns {
        row("trouble", Some(concern.text.clone()));
        row("what to do", Some(concern.remedy.clone()));
    }
    let restarts = known.starts_by_itself.as_ref().filter(|codes| !codes.is_empty());
    row("starts by itself", restarts.map(|codes| codes.join(", ")));
    row("start", known.start_refused.as_ref().map(|why| format!("would be refused: {why}")));
    row("watchdog", Some(values::watchdog(&known.watchdog)));
    if let Some(measured) = known.measurements.value.as_ref().filter(|_| all) {
        let old = |at: Instant| format!("{} ago", output::age(now.saturating_duration_since(at)));
        row("measured", measured.at.map(old));
        let is_live = known.measurements.is_good();
        for (label, value) in values::measurements(measured) {
            row(label, Some(if is_live { value } else { format!("({value})") }));
        }
    }
    output::say_table(table)?;
    answering(&[drive])
}

fn old_in_words(age: Option<&str>) -> String {
    match age {
        Some(age) => format!("NOT LIVE: what stands in brackets was so {age} ago"),
        None => "NOT LIVE: nothing is known".to_owned(),
    }
}

fn of_target<'a>(state: &'a StateView, target: &'a Target) -> impl Iterator<Item = &'a DriveView> {
    state.drives.iter().filter(|drive| target.has(state, drive.name()))
}

/// The present faults and the history of one drive.
pub fn faults(drive: &str, faults: &Faults) -> Result<(), Failure> {
    if faults.present.is_empty() {
        let what = if faults.tripped { "has tripped, and names no fault" } else { "has no fault" };
        output::say(format_args!("{drive} {what}"))?;
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
        Some(true) if faults.tripped => {
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
pub fn registers(rows: &[ParameterView]) -> Result<(), Failure> {
    let mut table = Table::new(["register", "mnemonic", "value", "name", "access"]);
    for row in rows {
        // A value that could not be read says why.
        let value = row.text.as_deref().or(row.error.as_deref()).unwrap_or("-");
        table.row([
            row.place().to_string(),
            row.mnemonic.to_string(),
            value.to_owned(),
            row.name.to_string(),
            row.access.to_string(),
        ]);
    }
    output::say_table(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use drived_plant::plant::testing::{read, told};

    #[tokio::test(start_paused = true)]
    async fn who_is_silent_is_named_and_stands_first() {
        let mut lost = told("pump 2");
        (lost["shows"], lost["link"]) = ("lost".into(), "lost".into());
        lost["concerns"] = serde_json::json!([{"kind": "lost", "rank": 8, "severity": "alarm", "wakes": false,
            "text": "does not answer", "remedy": "look"}]);
        let mut good = told("pump 1");
        good["status"] = serde_json::json!({"quality": "good", "state": "ready", "raw": []});
        let [good, lost] = [read(&good), read(&lost)];
        assert_eq!(answering(&[&good]), Ok(()));
        let silent = Failure::Drive("pump 2 does not answer".to_owned());
        assert_eq!(answering(&[&good, &lost]), Err(silent));
        let shown = table(&[&good, &lost], Instant::now()).to_string();
        let rows: Vec<&str> = shown.lines().collect();
        assert!(rows[1].starts_with("pump 2  lost") && rows[2].starts_with("pump 1"), "{shown}");
    }
}
