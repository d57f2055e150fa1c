//! `drived check`: what a configuration means.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use drive_fleet::DriveSettings;
use drive_sparkplug::NodeName;
use serde_json::{Map, Value, json};

use drived_broker::{
    broker::config::{MqttConfig, SparkplugConfig},
    mqtt::Mqtt,
};
use drived_config::config::{DrivePart, LinePart, drive_keys};
use drived_doors::{Rights, Role};
use drived_file::Config;
use drived_gateway::config::{GatewayConfig, Units};
use drived_words::{
    drive_spec::{self, DriveName},
    failure::Failure,
    line_spec,
    output::{self, JsonArgs, Table},
};

/// Validate a configuration without opening a port, and show what it means for each drive
///
/// What its lines will be like is the answer of `drived plan --config FILE`.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The configuration, in TOML
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
    #[command(flatten)]
    json: JsonArgs,
}

/// How long the end may take behind the exit of the drives.
const CLOSING: Duration = Duration::from_secs(10);
/// `TimeoutStopSec` of the packaged unit.
const PACKAGED: Duration = Duration::from_secs(90);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let config = Config::load_workable(&args.config)?;
    if let Some(mqtt) = &config.mqtt {
        // What it needs is read as the daemon would.
        Mqtt::prepare(mqtt.clone())?;
    }
    args.json.say(|| object(&args.config, &config), || tell(&args.config, &config))
}

/// What it means, for a program: labels and texts are those that a person reads.
fn object(file: &Path, config: &Config) -> Value {
    let texts = |texts: Vec<(&str, String)>| {
        texts.into_iter().map(|(label, text)| (label.to_owned(), text.into())).collect::<Map<String, Value>>()
    };
    let drive = |drive: &DrivePart| {
        json!({
            "drive": drive.name.to_string(),
            "name": drive.settings.name,
            "control": drive.settings.control,
            "meaning": texts(meaning(drive)),
        })
    };
    let line = |line: &LinePart| {
        let drives: Vec<Value> = line.drives.iter().map(drive).collect();
        json!({ "name": line.name, "port": line.config.to_string(), "drives": drives })
    };
    let gateway = |gateway: &GatewayConfig| {
        let meaning = texts(meaning_of_gateway(gateway));
        json!({ "name": gateway.name, "listen": gateway.listen.to_string(), "meaning": meaning })
    };
    json!({
        "config": file,
        "lines": config.lines.iter().map(line).collect::<Vec<_>>(),
        "gateways": config.gateways.iter().map(gateway).collect::<Vec<_>>(),
        "mqtt": config.mqtt.as_ref().map(of_mqtt),
        "sparkplug": config.sparkplug.as_ref().map(of_sparkplug),
        "doubts": config.doubts(),
        "state": config.doors.state.folder,
        "timeout_stop_s": (config.shutdown + CLOSING).as_secs(),
    })
}

fn tell(file: &Path, config: &Config) -> Result<(), Failure> {
    for LinePart { name, config, drives, .. } in &config.lines {
        let controlled = drives.iter().filter(|drive| drive.settings.control).count();
        output::say(format_args!(
            "line {name}: {}, {controlled} under control, on {}",
            output::counted(drives.len(), "drive", "drives"),
            line_spec::describe(config)
        ))?;
        for (names, first) in alike(drives) {
            output::say(format_args!("  {}", drive_spec::listed(&names)))?;
            let mut table = Table::texts();
            for (label, text) in meaning(first) {
                table.row([format!("    {label}"), text]);
            }
            output::say_table(table)?;
        }
    }
    for gateway in &config.gateways {
        output::say(format_args!("gateway {}: Modbus TCP at {}", gateway.name, gateway.listen))?;
        let mut table = Table::texts();
        for (label, text) in meaning_of_gateway(gateway) {
            table.row([format!("    {label}"), text]);
        }
        output::say_table(table)?;
    }
    if let Some(mqtt) = &config.mqtt {
        output::say(format_args!("mqtt: {}", of_mqtt(mqtt)))?;
    }
    if let Some(sparkplug) = &config.sparkplug {
        output::say(format_args!("sparkplug: {}", of_sparkplug(sparkplug)))?;
    }
    if let Some(folder) = &config.doors.state.folder {
        let audit = if config.doors.state.audit.is_some() { "" } else { "; no audit log is kept" };
        output::say(format_args!("kept in {}{audit}", folder.display()))?;
    }
    for doubt in config.doubts() {
        output::say(format_args!("DOUBTFUL: {doubt}"))?;
    }
    let needed = config.shutdown + CLOSING;
    output::say(format_args!(
        "as a service it needs TimeoutStopSec={}s: shutdown is {:?}, and the lines are closed after it{}",
        needed.as_secs(),
        config.shutdown,
        match needed > PACKAGED {
            true =>
                "; THE PACKAGED UNIT HAS LESS: systemctl edit drived, or motors are left to their watchdogs",
            false => "",
        }
    ))?;
    output::say(format_args!(
        "{} is a configuration that can work; drived plan --config {0} calculates its lines",
        file.display()
    ))
}

/// Where a broker is told everything, and who commands there.
fn of_mqtt(mqtt: &MqttConfig) -> String {
    let servers: Vec<String> = mqtt.servers.iter().map(ToString::to_string).collect();
    let commands = match (mqtt.commands, mqtt.commanders.is_empty()) {
        (false, _) => "nobody commands there".to_owned(),
        (true, true) => "WHOEVER MAY PUBLISH THERE OPERATES".to_owned(),
        (true, false) => {
            let each = mqtt.commanders.iter().map(|(name, role)| format!("{name} ({})", role.name()));
            format!("commands by {}", each.collect::<Vec<_>>().join(", "))
        }
    };
    format!("{} at {}: {commands}", mqtt.base, servers.join(", "))
}

/// What the daemon is called as an edge node, and what is done there.
fn of_sparkplug(sparkplug: &SparkplugConfig) -> String {
    let NodeName { group, edge_node } = &sparkplug.name;
    let host = sparkplug.primary_host.as_ref().map(|host| format!(", for the primary host {host}"));
    let may = sparkplug.commands.map_or("nobody commands there", |role| match role {
        Role::Stop => "WHOEVER MAY PUBLISH THERE STOPS",
        _ => "WHOEVER MAY PUBLISH THERE OPERATES",
    });
    format!("{group}/{edge_node}{}: {may}", host.unwrap_or_default())
}

/// What a gateway lets its clients do, each with its label.
fn meaning_of_gateway(gateway: &GatewayConfig) -> Vec<(&'static str, String)> {
    let GatewayConfig { clients, idle, patience, share, .. } = gateway;
    let who = match gateway.allow.iter().map(ToString::to_string).collect::<Vec<_>>() {
        all if !all.is_empty() => all.join(", "),
        _ if gateway.listen.ip().is_loopback() => "programs of this machine".to_owned(),
        _ => "EVERYBODY WHO REACHES IT: Modbus TCP has no login".to_owned(),
    };
    let units = match &gateway.units {
        Units::OfLine(line) => format!("the addresses of the drives of line {line}"),
        Units::Table(units) => {
            let units: Vec<String> = units.iter().map(|(unit, drive)| format!("{unit} {drive}")).collect();
            units.join(", ")
        }
    };
    let reads = format!(
        "as {}, together with the rest within {share} % of a line, as far as its plan leaves that",
        gateway.reads
    );
    let writes = match gateway.rights {
        Rights { operate: true, .. } => "commands, by the rules of motion, and stops ahead of everything",
        Rights { stop: true, .. } => "stops only",
        _ => "none: it only reads",
    };
    let parameters = match (gateway.raw_writes, gateway.eeprom_writes) {
        (true, true) => "also parameters, WITH THOSE THAT WEAR OUT AN EEPROM",
        (true, false) => "also parameters, but none that goes to an EEPROM",
        _ => "no parameters",
    };
    let silence = gateway.client_timeout.map(|limit| {
        let then = if gateway.stops_when_silent { "its motors are stopped" } else { "that is an alarm" };
        ("silence", format!("of a client that has started a motor, for {limit:?}: {then}"))
    });
    let mut lines = vec![
        ("clients", format!("{clients} at once, each put out after {idle:?} without a request: {who}")),
        ("units", units),
        ("reads", reads),
        ("patience", format!("{patience:?}: what has not come by then is refused")),
        ("writes", writes.to_owned()),
    ];
    if gateway.rights.operate {
        lines.push(("parameters", parameters.to_owned()));
    }
    if gateway.broadcast {
        lines.push(("unit 0", "a stop for it stops all of these drives".to_owned()));
    }
    lines.extend(silence);
    lines
}

/// Drives with the same settings, and the first of them.
fn alike(drives: &[DrivePart]) -> Vec<(Vec<(DriveName, String)>, &DrivePart)> {
    let mut all: Vec<(Vec<(DriveName, String)>, &DrivePart)> = Vec::new();
    for drive in drives {
        let member = (drive.name, drive.settings.name.clone());
        match all.iter_mut().find(|(_, first)| is_alike(first, drive)) {
            Some((names, _)) => names.push(member),
            None => all.push((vec![member], drive)),
        }
    }
    all
}

/// Whether two drives differ in their names and addresses only.
fn is_alike(one: &DrivePart, other: &DrivePart) -> bool {
    let renamed = DriveSettings { name: one.settings.name.clone(), ..other.settings.clone() };
    one.name.family == other.name.family && one.options == other.options && one.settings == renamed
}

/// What the settings and options of a drive mean, each with its label.
fn meaning(drive: &DrivePart) -> Vec<(&'static str, String)> {
    let told =
        drive_keys().iter().filter(|key| drive.settings.control || !key.acts).flat_map(|key| key.tells);
    told.filter_map(|tells| Some((tells.label, (tells.text)(drive)?))).collect()
}
