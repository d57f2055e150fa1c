//! `drived status`: what one drive says of itself.

use drive_core::{Measurements, Status};
use serde::Serialize;
use serde_json::json;

use crate::{
    client::{self, Target},
    failure::Failure,
    json,
    one_drive::OneDriveArgs,
    output::{self, Table},
};

/// Show the drives of the running daemon, a group or one of them, or read one drive on a line; nothing is written
///
/// A value that is old is in brackets, with its age. Exit code 1 when a drive that was asked for does not answer.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A drive or a group of the running daemon; without it, all
    #[arg(value_name = "NAME", conflicts_with = "line")]
    name: Option<String>,
    #[command(flatten)]
    one: OneDriveArgs,
    /// Also read the slow values: voltages, torque, thermal states, hours, inputs and outputs
    #[arg(long)]
    all: bool,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    if !args.one.is_on_line() {
        return through_daemon(&args).await;
    }
    let mut one = args.one.open().await?;
    let status = one.drive.status().await.map_err(|error| one.failure(&error))?;
    let restarts = one.drive.self_restarts().await;
    let measurements = match args.all {
        true => Some(one.drive.measurements().await.map_err(|error| one.failure(&error))?),
        false => None,
    };
    if args.one.daemon.is_json() {
        let read = Read {
            name: one.name.to_string(),
            family: one.drive.capabilities().key,
            status: &status,
            measurements: measurements.as_ref(),
            starts_by_itself: restarts.ok().map(|all| all.iter().map(|one| one.code).collect()),
        };
        output::say_as_it_is(json::line(&read))?;
        one.close().await;
        return Ok(());
    }
    output::say(format_args!("{} {}", one.name, one.drive.capabilities().name))?;
    let mut table = Table::texts();
    let restarts = match restarts {
        Ok(restarts) => restarts.iter().map(ToString::to_string).collect(),
        Err(error) => vec![format!("not known: {error}")],
    };
    let restarts = restarts.into_iter().map(|restart| ("starts by itself", restart));
    for (label, value) in
        lines(&status).into_iter().chain(restarts).chain(measurements.iter().flat_map(slow_lines))
    {
        table.row([format!("  {label}"), value]);
    }
    output::say_table(table)?;
    one.close().await;
    Ok(())
}

/// What one drive on a line has said of itself, as the API says it of those of the daemon.
#[derive(Serialize)]
struct Read<'a> {
    name: String,
    family: &'static str,
    status: &'a Status,
    #[serde(skip_serializing_if = "Option::is_none")]
    measurements: Option<&'a Measurements>,
    /// Absent where the drive did not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    starts_by_itself: Option<Vec<&'static str>>,
}

async fn through_daemon(args: &Args) -> Result<(), Failure> {
    let mut daemon = args.one.daemon.connect().await?;
    let state = daemon.state().await?;
    let target = args.name.as_deref().map_or(Ok(Target::All), |name| Target::find(&state, name))?;
    let one =
        state.drives.iter().find(|drive| matches!(&target, Target::Drive(name) if drive.name() == name));
    match one {
        Some(drive) => args.one.daemon.say(drive, || client::whole(&json!(drive), args.all)),
        None => args.one.daemon.say(&state, || client::overview(&state, &target)),
    }
}

/// The values that the drive gave, each with its label.
fn lines(status: &Status) -> Vec<(&'static str, String)> {
    let state = match (status.direction, status.at_reference) {
        (Some(direction), Some(true)) => format!("{}, {direction}, at reference", status.state),
        (Some(direction), _) => format!("{}, {direction}", status.state),
        (None, _) => status.state.to_string(),
    };
    let yes_no = |value: bool| if value { "present" } else { "none" }.to_owned();
    let words = status.raw.iter().map(|word| format!("{} {:04X}h", word.code, word.value));
    let mut lines = vec![("state", state)];
    let mut line = |label, value: Option<String>| lines.extend(value.map(|value| (label, value)));
    line("output frequency", status.output_frequency.map(|value| value.to_string()));
    line("motor current", output::current(status));
    line("control", status.control.map(|value| value.to_string()));
    line("fault code", status.fault_code.filter(|&code| code != 0).map(|code| code.to_string()));
    line("warning", status.warning.map(yes_no));
    line("words", Some(words.collect::<Vec<_>>().join(", ")));
    lines
}

fn slow_lines(values: &Measurements) -> Vec<(&'static str, String)> {
    let hours = |time: std::time::Duration| format!("{} h", time.as_secs() / 3_600);
    let bits = |word: u16| format!("{word:016b}");
    let mut lines = Vec::new();
    let mut line = |label, value: Option<String>| lines.extend(value.map(|value| (label, value)));
    let before = "some are from before the trip, and stand in the drive's words alone";
    line("measured", values.before_trip.then(|| before.to_owned()));
    line("reference", values.reference.map(|value| value.to_string()));
    line("speed", values.speed.map(|value| value.to_string()));
    line("output voltage", values.output_voltage.map(|value| value.to_string()));
    line("output voltage", values.output_voltage_share.map(|value| value.to_string()));
    line("line voltage", values.line_voltage.map(|value| value.to_string()));
    line("DC bus voltage", values.dc_bus_voltage.map(|value| value.to_string()));
    line("DC bus voltage", values.dc_bus_voltage_share.map(|value| value.to_string()));
    line("torque", values.torque.map(|value| value.to_string()));
    line("power", values.power_share.map(|value| value.to_string()));
    line("input power", values.input_power.map(|value| value.to_string()));
    line("output power", values.output_power.map(|value| value.to_string()));
    line("drive thermal", values.drive_thermal.map(|value| value.to_string()));
    line("motor thermal", values.motor_thermal.map(|value| value.to_string()));
    line("drive load", values.drive_load.map(|value| value.to_string()));
    line("motor load", values.motor_load.map(|value| value.to_string()));
    line("input energy", values.input_energy.map(|value| value.to_string()));
    line("output energy", values.output_energy.map(|value| value.to_string()));
    line("running time", values.running_time.map(hours));
    line("powered time", values.powered_time.map(hours));
    line("inputs", values.inputs.map(bits));
    line("outputs", values.outputs.map(bits));
    lines
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, Frequency, State};

    use super::*;

    #[test]
    fn what_a_drive_does_not_tell_is_left_out() {
        let status = Status {
            state: State::Running,
            direction: Some(Direction::Reverse),
            at_reference: Some(true),
            output_frequency: Some(Frequency::from_hertz(30)),
            fault_code: Some(0),
            ..Status::default()
        };
        let lines = lines(&status);
        assert_eq!(lines[0], ("state", "running, reverse, at reference".to_owned()));
        assert_eq!(lines[1], ("output frequency", "30.00 Hz".to_owned()));
        assert!(lines.iter().all(|(label, _)| !["fault code", "motor current", "warning"].contains(label)));
    }
}
