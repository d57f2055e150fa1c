//! The daemon at **Home Assistant itself**, headless, with its own mqtt integration on a real broker: through a trip, loss and return of a
//! drive, a refusal, a restart of each side, a rename and a removal. `DRIVED_HOME_ASSISTANT_PYTHON` names the Python that has it; where that is
//! not there the test says that it is skipped, and where `CI` is set it fails.

use std::{fs, path::PathBuf};

use crate::home::HomeAssistant;
use crate::rig::{Daemon, Mosquitto};
use crate::support::path;
use serde_json::{Value, json};

/// A daemon on this broker that goes on where it was when it is started again; the heartbeat is the usual one, so that nothing here can
/// be right by being told again.
fn daemon(name: &str, broker: &Mosquitto) -> (Daemon, PathBuf) {
    let folder = path(&format!("{name}-state"));
    let head = format!("state = {:?}\n", folder.to_str().expect("the path is text"));
    let section = format!("servers = [\"mqtt://127.0.0.1:{}\"]\ndiscovery = \"device\"", broker.port);
    (Daemon::start_with(name, &head, &section), folder)
}

#[test]
fn at_home_assistant_itself_a_drive_is_commanded_trips_is_lost_and_acknowledged_and_what_left_is_gone() {
    let Some(python) = HomeAssistant::python() else { return };
    let Some(mut broker) = Mosquitto::start("home") else { return };
    let mut home = HomeAssistant::start(&python, path("home"), &broker);
    let (mut daemon, state) = daemon("home-daemon", &broker);

    // It finds the drives, and what their family has.
    home.wait("binary_sensor.pump_1_answers", "on");
    home.wait("binary_sensor.pump_2_answers", "on");
    home.wait("binary_sensor.pump_1_problem", "off");
    home.wait("sensor.pump_1_alarms", "none");
    home.wait("binary_sensor.drived_drived_connected", "on");
    home.wait("sensor.pump_1_mains_voltage", "400.0");
    let all = home.say("states");
    assert!(all.get("sensor.pump_1_power").is_none(), "an Altivar 312 has none: {all:#}");

    // A command, and what became of it.
    let told = home.command("set number.pump_1_setpoint 30", "pump_1");
    assert_eq!((&told["action"], &told["caller"]), (&json!("setpoint"), &json!("mqtt")), "{told}");
    home.wait("sensor.pump_1_last_command", "confirmed");
    home.command("press button.pump_1_start", "pump_1");
    home.wait("binary_sensor.pump_1_turning", "on");
    home.wait("sensor.pump_1_frequency", "30.0");
    assert!(daemon.turns());
    home.say("press button.pump_1_stop");
    home.wait("binary_sensor.pump_1_turning", "off");
    assert!(!daemon.turns());
    // A refusal: 20 to 22 Hz are forbidden to this drive.
    let told = home.command("set number.pump_1_setpoint 21", "pump_1");
    home.wait("sensor.pump_1_last_command", "refused");
    assert_eq!((&told["action"], &told["reason"]), (&json!("setpoint"), &json!("forbidden_band")), "{told}");

    // A trip, and somebody takes note of it.
    daemon.sim.say("atv312@1 trip OCF", "done");
    home.wait("binary_sensor.pump_1_problem", "on");
    let alarm = home.wait("sensor.pump_1_alarms", "unacknowledged");
    assert_eq!((&alarm["kind"], &alarm["count"]), (&json!("tripped"), &json!(1)), "{alarm}");
    assert!(alarm["remedy"].is_string() && alarm["first_unix_ms"].is_u64(), "{alarm}");
    home.wait("sensor.pump_1_fault", "OCF");
    home.say("press button.pump_1_acknowledge_alarms");
    let alarm = home.wait("sensor.pump_1_alarms", "acknowledged");
    assert_eq!(alarm["acknowledged"]["by"], "mqtt", "{alarm}");
    assert_eq!(alarm["waiting"], 0);

    // The daemon is killed and comes back: the trip is there as soon as the daemon is, the same alarm, and stays.
    daemon.kill();
    home.wait("binary_sensor.pump_1_problem", "unavailable");
    home.say("forget");
    daemon.start_again();
    let alarm = home.wait("sensor.pump_1_alarms", "acknowledged");
    assert_eq!(alarm["count"], 1, "{alarm}");
    home.wait("sensor.pump_1_identity", "ATV312HU15N4");
    home.wait("sensor.pump_1_mains_voltage", "400.0");
    let problem = home.seen("binary_sensor.pump_1_problem");
    let told: Vec<_> = problem.iter().skip_while(|state| *state != "on").collect();
    assert_eq!(told, ["on"], "{problem:?}");
    // What is kept for good is there before the drive is: a button can be pressed once it answers.
    home.wait("binary_sensor.pump_1_answers", "on");
    home.command("press button.pump_1_reset_fault", "pump_1");
    home.wait("binary_sensor.pump_1_problem", "off");
    // Its own watchdog may have tripped it once more while nobody was there to feed it.
    home.say("press button.pump_1_acknowledge_alarms");
    home.wait("sensor.pump_1_alarms", "none");

    // A drive is lost: that is told while it is, and a stop goes to it.
    home.say("forget");
    daemon.sim.say("atv312@2 cable cut", "done");
    home.wait("binary_sensor.pump_2_answers", "off");
    home.wait("sensor.pump_2_state", "unavailable");
    let alarm = home.wait("sensor.pump_2_alarms", "unacknowledged");
    assert_eq!(alarm["kind"], "lost", "{alarm}");
    home.wait("binary_sensor.pump_2_problem", "on");
    assert_ne!(home.state("button.pump_2_stop"), "unavailable");
    assert_eq!(home.state("button.pump_2_start"), "unavailable");
    home.say("press button.pump_2_stop");
    let told = home.wait("sensor.pump_2_last_command", "outcome_unknown");
    assert_eq!(told["action"], "stop", "{told}");
    daemon.sim.say("atv312@2 cable join", "done");
    home.wait("binary_sensor.pump_2_answers", "on");
    home.wait("sensor.pump_2_last_command", "confirmed");
    home.wait("sensor.pump_2_alarms", "returned");
    home.wait("binary_sensor.pump_2_problem", "off");
    assert_eq!(home.seen("sensor.pump_1_alarms"), Vec::<String>::new(), "nothing of the other");
    home.say("press button.pump_2_acknowledge_alarms");
    home.wait("sensor.pump_2_alarms", "none");
    assert_eq!(home.complaints(), Vec::<String>::new());

    // Home Assistant begins anew, then the broker, which has forgotten everything.
    let folder = home.end();
    let mut home = HomeAssistant::start(&python, folder, &broker);
    home.wait("binary_sensor.pump_1_answers", "on");
    home.wait("sensor.pump_1_mains_voltage", "400.0");
    home.wait("sensor.pump_2_alarms", "none");
    broker.kill();
    home.wait("binary_sensor.pump_1_answers", "unavailable");
    broker.start_again();
    home.wait("binary_sensor.pump_1_answers", "on");
    home.wait("binary_sensor.pump_2_problem", "off");

    // A drive gets another name while the daemon is away: its entities stay.
    daemon.kill();
    home.wait("binary_sensor.pump_2_answers", "unavailable");
    let text = fs::read_to_string(daemon.file.path()).expect("it is ours");
    // From here on with short heartbeats: behind a restart what is gone is taken back when three of them are over.
    // And each start has to say when it was issued.
    let text = text.replace("discovery =", "heartbeat = \"5s\"\nneeds_issued = true\ndiscovery =");
    fs::write(daemon.file.path(), text.replace("pump {}", "fan {}")).expect("it is ours");
    home.say("forget");
    daemon.start_again();
    home.wait("binary_sensor.pump_2_answers", "on");
    home.say("named binary_sensor.pump_2_answers fan 2");
    assert!(!home.seen("binary_sensor.pump_2_answers").contains(&"-".to_owned()), "it is never taken away");
    let told = home.command("set number.pump_2_setpoint 25", "pump_2");
    assert_eq!((&told["action"], &told["reason"]), (&json!("setpoint"), &Value::Null), "{told}");
    home.command("press button.pump_2_start", "pump_2");
    home.wait("binary_sensor.pump_2_turning", "on");
    home.say("press button.pump_2_stop");
    home.wait("binary_sensor.pump_2_turning", "off");

    // One leaves while the daemon is away: it goes with all it had, and without a complaint.
    daemon.kill();
    fs::write(daemon.file.path(), text.replace("pump {}", "fan {}").replace("atv312@1-2", "atv312@1"))
        .expect("it is ours");
    daemon.start_again();
    home.wait("binary_sensor.pump_2_answers", "-");
    home.wait("binary_sensor.pump_1_answers", "on");
    let left: Vec<String> = serde_json::from_value::<serde_json::Map<String, Value>>(home.say("states"))
        .expect("an object")
        .into_iter()
        .map(|(entity, _)| entity)
        .filter(|entity| entity.contains("pump_2"))
        .collect();
    assert_eq!(left, Vec::<String>::new());
    assert_eq!(home.complaints(), Vec::<String>::new());
    let _ = fs::remove_dir_all(state);
}
