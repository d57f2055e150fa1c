//! Files that can work, and what is said of those that cannot.

use std::{any::Any, path::Path, sync::Once};

use drive_core::{Frequency, Reaction, StopMode};
use drive_fleet::{Commanders, OnControlTaken, OnExit, OnFault, Periods, WatchdogContract, plan};

use drived_config::testing::Folder;

use super::*;
use drived_broker::{
    OnBroker,
    broker::config::{Address, Discovery, MqttConfig, SparkplugConfig},
};
use drived_config::{
    config::{DrivePart, ROOM_PPM, drive_keys},
    rights::{Rights, Role},
};
use drived_doors::Network;
use drived_gateway::{
    All,
    config::{GatewayConfig, Units},
};

const FULL: &str = r#"
snapshots = "1s"

[defaults]
control = true
running = "1s"
rest = "2s"
max_age = "5s"
watchdog = { time = "5s", reaction = "ramp" }

[lines.north]
port = "/dev/ttyUSB0,19200,8N1"

[lines.south]
port = "tcp://gateway:502"
response_timeout = "100ms"

[[drives]]
line = "north"
drive = "atv312@1-10"
name = "fan {}"
frequency = { low = 10, high = 47.5, forbidden = [[20, 22.5]], change_per_second = 2 }
commanders = ["operator", "scada"]

[[drives]]
line = "north"
drive = "atv28@20"
control = false
on_exit = "leave"

[[drives]]
line = "south"
drive = "atv21@1"
on_exit = "release"
stop_mode = "freewheel"
on_fault = "reset-watchdog-trip"
on_control_taken = "report"
accept_self_restart = ["Atr"]
alarms = { current = 12.5, motor_thermal = 110 }
"#;

const THIRTY_ONE: &str = r#"
lines.a.port = "/dev/ttyUSB0"
[[drives]]
line = "a"
drive = "atv312@1-31"
"#;

#[test]
fn what_a_file_says_of_the_far_end_goes_before_what_stands_behind_the_port() {
    let told = |keys: &str| {
        let text = FULL.replace(
            "port = \"tcp://gateway:502\"",
            &format!("port = \"tcp://gateway:502,gateway=3x1s\"\n{keys}"),
        );
        read(&text).map(|config| {
            config.lines.into_iter().find(|line| line.name == "south").unwrap().config.far_end()
        })
    };
    let three = drive_bus::Gateway { at_once: Some(1), wait: Some(Duration::from_secs(3)) };
    assert_eq!(told(""), Ok(Some(three)));
    assert_eq!(told("gateway = \"none\""), Ok(None));
    assert!(told("gateway = \"often\"").unwrap_err().contains("expected none, unknown, or how long"));
    assert!(told("far_end_paces = false").unwrap_err().contains("Modbus TCP has no speed"));
    assert!(told("connections = 2").is_ok());
    assert!(told("connections = 3").unwrap_err().contains("expected 1 to 2"));
    let serial = FULL.replace("19200,8N1\"", "19200,8N1\"\nfar_end_paces = false");
    assert_eq!(read(&serial).unwrap().lines[0].config.far_end_paces, Some(false));
}

/// The text of a file, for a program with the faces that drived has.
fn parsed(text: &str) -> Result<Config, ConfigError> {
    static FACES: Once = Once::new();
    FACES.call_once(|| {
        [drived_gateway::FACE, drived_history::FACE, drived_broker::FACE, drived_webhook::FACE]
            .map(drived_face::add)
            .into_iter()
            .for_each(Result::unwrap);
    });
    Config::read(Path::new("drives.toml"), text)
}

/// What it says of a face.
fn face<T: Configured + Clone>(config: &Config, table: &str) -> Option<T> {
    config.face(table).map(|face| (face as &dyn Any).downcast_ref::<T>().expect("it is of the face").clone())
}

fn read(text: &str) -> Result<Config, String> {
    let config = parsed(text);
    config.and_then(Config::workable).map_err(|error| error.to_string())
}

#[test]
fn a_full_file_says_what_it_says() {
    let config = read(FULL).unwrap();
    assert_eq!(config.snapshots, Duration::from_secs(1));
    let [north, south] = &config.lines[..] else { panic!("{config:?}") };
    assert_eq!(north.drives.len(), 11);
    let DrivePart { name, settings: fan, .. } = &north.drives[6];
    assert_eq!((name.to_string().as_str(), fan.name.as_str()), ("atv312@7", "fan 7"));
    assert_eq!(fan.limits.high, Some(Frequency::from_centihertz(4_750)));
    assert_eq!(fan.limits.forbidden[0].high, Frequency::from_centihertz(2_250));
    assert_eq!(fan.commanders, Commanders::Only(vec!["operator".to_owned(), "scada".to_owned()]));
    let contract = WatchdogContract { timeout: Duration::from_secs(5), reaction: Reaction::Ramp };
    assert_eq!(fan.watchdog, Some(contract));
    let watched = &north.drives[10].settings;
    assert_eq!((watched.control, watched.on_exit, watched.watchdog), (false, OnExit::Leave, None));
    assert_eq!(watched.name, "north 20");
    let released = &south.drives[0].settings;
    assert_eq!(released.on_exit, OnExit::Release(StopMode::Freewheel));
    assert_eq!(released.on_fault, OnFault::ResetWatchdogTrip);
    assert_eq!(released.on_control_taken, OnControlTaken::Report);
    assert_eq!(released.accept_self_restart, ["Atr"]);
    assert_eq!(south.config.response_timeout, Duration::from_millis(100));
}

#[test]
fn thirty_one_equal_drives_are_three_lines() {
    assert_eq!(read(THIRTY_ONE).unwrap().lines[0].drives.len(), 31);
}

#[test]
fn periods_that_the_file_does_not_name_leave_room_on_the_line() {
    let line = &read(THIRTY_ONE).unwrap().lines[0];
    assert!(plan(line.budget, &line.demands()).unwrap().utilisation_ppm <= ROOM_PPM);
    let Periods { running, rest, slow, max_age } = line.drives[0].settings.periods;
    let usual = Periods::default();
    assert!(running > usual.running);
    assert_eq!(rest.as_millis() * usual.running.as_millis(), usual.rest.as_millis() * running.as_millis());
    assert!(slow > usual.slow && max_age > usual.max_age);

    let few = THIRTY_ONE.replace("1-31", "1-5");
    assert_eq!(
        read(&few).unwrap().lines[0].drives[0].settings.periods,
        usual,
        "where they fit they are the usual ones"
    );
}

#[test]
fn periods_that_the_file_names_are_kept_or_refused() {
    let kept = format!("{THIRTY_ONE}running = \"1s\"\nslow = \"0s\"\n");
    assert_eq!(read(&kept).unwrap().lines[0].drives[0].settings.periods.running, Duration::from_secs(1));
    let refused = format!("{THIRTY_ONE}running = \"500ms\"\n");
    assert!(read(&refused).unwrap_err().contains("lengthen the periods"));
}

#[test]
fn what_is_wrong_is_told_with_file_line_field_and_what_was_expected() {
    for (instead_of, with, told) in [
        (
            "snapshots = \"1s\"",
            "snapshots = 1",
            "drives.toml:2: snapshots: expected a text in quotes, such as",
        ),
        (
            "running = \"1s\"",
            "running = \"fast\"",
            "drives.toml:6: running: \"fast\": expected a whole number and a unit",
        ),
        ("running = \"1s\"", "runing = \"1s\"", "drives.toml:6: runing: unknown field `runing`, expected"),
        (
            "running = \"1s\"",
            "fault-reset-function = 5",
            "drives.toml:6: fault-reset-function: it is an option of the drive's family: expected options = {",
        ),
        ("time = \"5s\"", "time = \"5\"", "drives.toml:9: time: \"5\": expected a whole number and a unit"),
        (
            "reaction = \"ramp\" }",
            "reaction = \"beep\" }",
            "drives.toml:9: reaction: \"beep\": expected one of ramp, fast, ",
        ),
        (
            "19200,8N1",
            "19200,8X1",
            "drives.toml:12: port: \"/dev/ttyUSB0,19200,8X1\": \"8X1\" is not a character format",
        ),
        ("19200,8N1", "19200,8E1", "drives.toml:12: port: atv28@20: format 8E1"),
        (
            "line = \"north\"\ndrive = \"atv312",
            "line = \"nord\"\ndrive = \"atv312",
            "drives.toml:19: line: there is no line \"nord\"",
        ),
        (
            "atv312@1-10",
            "atv999@1-10",
            "drives.toml:20: drive: \"atv999@1-10\": \"atv999\" is not a family of drives",
        ),
        (
            "\"fan {}\"",
            "\"fan\"",
            "drives.toml:21: name: 10 drives have this name: expected {} for the address",
        ),
        (
            "low = 10,",
            "low = 60,",
            "drives.toml:22: frequency: fan 1: the lowest frequency 60.00 Hz is above",
        ),
        ("47.5", "47.555", "drives.toml:22: high: expected a number from 0 on with at most 2 decimals"),
        ("[[20, 22.5]]", "[[20, 22.5, 30]]", "drives.toml:22: forbidden: a band of 3 frequencies: expected"),
        (
            "[[20, 22.5]]",
            "[[20]]",
            "drives.toml:22: forbidden: a band of 1 frequencies: expected [LOW, HIGH]",
        ),
        (
            "response_timeout = \"100ms\"",
            "response_timeout = \"0\"",
            "drives.toml:16: response_timeout: 0ns: expected 10ms to 10s",
        ),
        (
            "response_timeout = \"100ms\"",
            "response_timeout = \"10min\"",
            "drives.toml:16: response_timeout: 600s: expected 10ms to 10s",
        ),
        (
            "response_timeout = \"100ms\"",
            "response_timeout = \"100ms\"\nresponse = \"150ms\"",
            "drives.toml:17: response: 150ms as the usual time of an answer, and 100ms as the longest",
        ),
        (
            "tcp://gateway:502",
            "/dev/ttyUSB0,19200,8N1",
            "drives.toml:15: port: it is the port of line \"north\" too",
        ),
        ("\"fan {}\"", "\"fan\\u001b {}\"", "drives.toml:21: name: fan\\u{1b} 1: a name has no control"),
        (
            "port = \"tcp://gateway:502\"\n",
            "",
            "drives.toml:14: lines.south: expected port = \"PORT\", such as",
        ),
        ("[lines.south]", "[lines.\"\"]", "drives.toml:32: line: there is no line \"south\""),
        ("atv28@20", "atv28@7", "drives.toml:27: drive: address 7 of this line is taken"),
        (
            "on_exit = \"leave\"",
            "on_exit = \"explode\"",
            "drives.toml:29: on_exit: \"explode\": expected one of stop, release, leave",
        ),
        (
            "frequency = {",
            "injection = \"31s\"\nfrequency = {",
            "drives.toml:22: injection: fan 1: an injection of 31s: expected more than nothing and 30s at the most",
        ),
        ("max_age = \"5s\"", "max_age = \"1s\"", "drives.toml:8: max_age: fan 1: with a status every 1s"),
        (
            "port = \"/dev/ttyUSB0,19200,8N1\"",
            "port = \"/dev/ttyUSB0,19200,8N1\"\nresponse_timeout = \"3s\"",
            "drives.toml:11: lines.north: the watchdog of fan 1 is 5s, and it might hear nothing for",
        ),
        (
            "control = false",
            "control = false\nwatchdog = { time = \"5s\", reaction = \"ramp\" }",
            "drives.toml:29: watchdog: north 20: the bus cannot set a communication watchdog of Schneider Altivar 28",
        ),
        (
            "running = \"1s\"",
            "running = \"100ms\"",
            "drives.toml:11: lines.north: one status of 11 drives takes",
        ),
    ] {
        let text = FULL.replacen(instead_of, with, 1);
        assert_ne!(text, FULL, "{instead_of}");
        let error = read(&text).expect_err(told);
        assert!(error.starts_with(told), "{error}\nexpected {told}");
        assert!(!error.contains('\n'), "{error}");
    }
}

#[cfg(unix)]
#[test]
fn a_port_under_two_names_is_one_port() {
    let link = std::env::temp_dir().join(format!("drived-port-{}", std::process::id()));
    std::os::unix::fs::symlink("/dev/tty", &link).unwrap();
    let text = format!(
        "[lines.a]\nport = \"/dev/tty\"\n[lines.b]\nport = {:?}\n\
         [[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n[[drives]]\nline = \"b\"\ndrive = \"atv312@2\"\n",
        link
    );
    let error = read(&text);
    std::fs::remove_file(&link).unwrap();
    assert!(error.unwrap_err().starts_with("drives.toml:4: port: it is the port of line \"a\" too"));
}

#[test]
fn what_the_owner_knows_of_a_drive_is_an_option_of_its_entry_or_of_the_defaults() {
    let text = |defaults: &str, own: &str| {
        format!(
            "[defaults]\noptions = {{ {defaults} }}\n[lines.a]\nport = \"/dev/ttyUSB0,9600,8N1\"\n\
             [[drives]]\nline = \"a\"\ndrive = \"3g3ev@1-2\"\noptions = {{ {own} }}\n\
             [[drives]]\nline = \"a\"\ndrive = \"atv312@3\"\n"
        )
    };
    let config = read(&text("fault-reset-function = 5, saves = 3", "saves = \"120\"")).unwrap();
    let [one, _, other] = &config.lines[0].drives[..] else { panic!("{config:?}") };
    assert_eq!((one.options.get("fault-reset-function"), one.options.get("saves")), (Some("5"), Some("120")));
    assert_eq!(other.options.iter().count(), 0, "it has none of these");
    for (own, told) in [
        ("saves = \"many\"", "drives.toml:8: saves: option saves: \"many\" is not a value of it"),
        ("saves = 1.5", "drives.toml:8: saves: expected a text or a whole number"),
        ("speed = 5", "drives.toml:8: speed: \"speed\" is not an option of a drive"),
        (
            "authority = \"settings\"",
            "drives.toml:8: options: 3g3ev@1: option authority belongs to the atv21",
        ),
    ] {
        let error = read(&text("", own)).expect_err(told);
        assert!(error.starts_with(told), "{error}\nexpected {told}");
    }
    let table = text("", "saves = 120").replace("options = { saves = 120 }", "options.saves = 120");
    assert_eq!(read(&table).unwrap().lines[0].drives[0].options.get("saves"), Some("120"));
}

#[test]
fn a_file_without_drives_or_a_line_without_any_is_refused() {
    assert!(read("").unwrap_err().starts_with("drives.toml: no drive: expected [[drives]]"));
    let lonely = format!("{FULL}\n[lines.east]\nport = \"/dev/ttyUSB9\"\n");
    assert!(read(&lonely).unwrap_err().contains("no drive is on this line"));
}

#[test]
fn a_daemon_begins_without_drives_and_with_nothing_else_that_is_wrong() {
    let folder = std::env::temp_dir().join(format!("drived-begin-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("drives.toml");
    // Whoever names a file that is not there has misspelt it.
    let begin = |http| Config::load_to_begin(&file, http);
    assert!(begin(None).unwrap_err().to_string().contains("cannot be read"));
    std::fs::write(&file, "state = \"/var/lib/drived\"\n").unwrap();
    assert!(begin(None).unwrap().lines.is_empty());
    // Nobody could ever add one.
    let refused = begin(Some(Http::Off)).unwrap_err().to_string();
    assert!(refused.contains("no drive: expected [[drives]]") && refused.contains("no page"), "{refused}");
    std::fs::write(&file, "state = \"/var/lib/drived\"\n[http]\nlisten = \"off\"\n").unwrap();
    assert!(begin(None).unwrap_err().to_string().contains("no page, to add some there"));
    assert!(begin(Some(Http::default())).is_ok(), "it is said beside the file that there is one");
    std::fs::write(&file, "state = \"/var/lib/drived\"\n").unwrap();
    let config = begin(None).unwrap();
    assert_eq!(config.doors.state.folder.as_deref(), Some(Path::new("/var/lib/drived")));
    assert!(Config::load_workable(&file).unwrap_err().to_string().contains("no drive: expected [[drives]]"));
    for (wrong, told) in [
        ("[lines.a]\nport = \"/dev/ttyUSB0\"\n", "no drive"),
        ("stat = 1\n", "unknown field"),
        ("[http\n", ""),
    ] {
        std::fs::write(&file, wrong).unwrap();
        assert!(begin(None).unwrap_err().to_string().contains(told), "{wrong}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_example_is_a_configuration_that_works() {
    let config = read(include_str!("../../../examples/drives.toml")).unwrap();
    assert_eq!(config.lines.iter().map(|line| line.drives.len()).collect::<Vec<_>>(), [31, 3]);
}

#[test]
fn a_group_names_drives_of_the_file_in_its_own_order() {
    let text = format!("{FULL}\n[groups]\nfans = [\"fan 3\", \"fan 1\"]\n");
    let config = parsed(&text).unwrap();
    let [group] = &*config.groups else { panic!("{:?}", config.groups) };
    assert_eq!(
        (group.name.as_str(), &*group.drives),
        ("fans", &["fan 3".to_owned(), "fan 1".to_owned()][..])
    );
    for (groups, reason) in [
        ("fans = [\"fan 99\"]", "there is no drive \"fan 99\""),
        ("fans = [\"fan 1\", \"fan 1\"]", "is in this group twice"),
        ("fans = []", "has no drive"),
        ("\"fan 1\" = [\"fan 2\"]", "is a drive too"),
        ("\" \" = [\"fan 2\"]", "expected a name"),
    ] {
        let text = format!("{FULL}\n[groups]\n{groups}\n");
        let error = parsed(&text).unwrap_err().to_string();
        assert!(error.contains(reason), "{error}");
    }
}

#[test]
fn the_tables_of_the_daemon_are_no_faces() {
    let own: Vec<&str> = File::KEYS.iter().map(|key| key.name.trim_matches(['[', ']'])).collect();
    let own: Vec<&str> = own.into_iter().map(|key| key.split('.').next().unwrap()).collect();
    assert_eq!(own, drived_face::OWN);
}

#[test]
fn others_than_this_machine_are_let_in_by_tokens_and_by_encryption_alone() {
    let rest = "[lines.a]\nport = \"/dev/ttyUSB0\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n";
    let read = |head: &str| parsed(&format!("{head}\n{rest}"));
    for (head, problem) in [
        (
            "[http]\nlisten = \"0.0.0.0:7580\"",
            "drives.toml:2: listen: 0.0.0.0:7580: others than this machine can reach it",
        ),
        ("tokens = \"tokens\"\n[http]\nlisten = \"0.0.0.0:7580\"", "tokens would cross the network in clear"),
        ("[http]\nlisten = \"[::]:7580\"\nplain = true", "expected tokens = \"FILE\""),
        ("[http]\nlisten = \"everywhere\"", "expected ADDRESS:PORT"),
        ("[http]\nwithout_login = \"operate\"", "expected nothing, view or stop"),
        ("[http]\nallowed_hosts = [\"drives.example:443\"]", "without a port"),
        ("[http]\nallowed_hosts = [\"https://drives.example\"]", "expected a name"),
        ("[http]\npassword = \"0000\"", "unknown field"),
        ("[socket]\nmode = \"999\"", "expected permissions such as 0660"),
    ] {
        let error = read(head).unwrap_err().to_string();
        assert!(error.contains(problem), "{head}: {error}");
    }
    for head in [
        "tokens = \"tokens\"\n[http]\nlisten = \"0.0.0.0:7580\"\nplain = true",
        "tokens = \"tokens\"\n[http]\nlisten = \"0.0.0.0:7580\"\ntls = { certificate = \"c\", key = \"k\" }",
        "[http]\nlisten = \"off\"",
        "[http]\nlisten = \"[::1]:7580\"\nallowed_hosts = [\"drives.example\", \"[fd00::1]\"]\nwithout_login = \"nothing\"",
        "audit = \"audit\"\n[socket]\npath = \"drived.sock\"\nmode = \"0600\"",
    ] {
        read(head).unwrap();
    }
}

#[test]
fn a_gateway_is_off_unless_configured_and_says_what_it_lacks() {
    assert!(read(FULL).unwrap().faces.iter().all(|(table, _)| *table == "history"));
    let with = |entry: &str| read(&format!("{FULL}\n[[gateways]]\n{entry}\n"));
    let config = with("line = \"north\"").unwrap();
    let All(gateways) = face(&config, "gateways").unwrap();
    let [gateway]: [GatewayConfig; 1] = gateways.try_into().unwrap();
    assert_eq!((gateway.name.as_str(), gateway.listen.to_string()), ("gateway", "127.0.0.1:1502".to_owned()));
    assert_eq!(gateway.units, Units::OfLine("north".to_owned()));
    assert_eq!((gateway.share, gateway.clients, gateway.rights.stop), (30, 16, false));
    for (entry, told) in [
        ("", "expected line = \"NAME\", or units"),
        ("line = \"west\"", "line: there is no line \"west\""),
        ("line = \"north\"\nunits = { 1 = \"fan 1\" }", "expected line or units, not both"),
        ("units = { 1 = \"fan 99\" }", "there is no drive \"fan 99\""),
        ("units = { 256 = \"fan 1\" }", "expected a unit number, 0 to 255"),
        (
            "line = \"north\"\nlisten = \"0.0.0.0:502\"",
            "listen: 0.0.0.0:502: others than this machine can reach it",
        ),
        ("line = \"north\"\nallow = [\"10.0.0.0/33\"]", "expected an address or a network"),
        ("line = \"north\"\nshare = 100", "share: 100: expected 1 to 80"),
        ("line = \"north\"\npatience = \"1ms\"", "patience: 1ms: expected 50ms to 60s"),
        ("line = \"north\"\nreads = \"stop\"", "expected one of status, background"),
        ("line = \"north\"\nraw_writes = true", "raw_writes = true needs writes = \"operate\""),
        ("line = \"north\"\nwrites = \"operate\"\neeprom_writes = true", "needs raw_writes = true"),
        ("line = \"north\"\nbroadcast = true", "broadcast = true needs writes"),
        ("line = \"north\"\non_client_silence = \"stop\"", "expected client_timeout with it"),
        ("line = \"north\"\n[[gateways]]\nline = \"north\"", "two gateways are named \"gateway\""),
        (
            "line = \"north\"\n[[gateways]]\nline = \"north\"\nname = \"b\"",
            "127.0.0.1:1502 is another gateway's too",
        ),
    ] {
        let error = with(entry).expect_err(told);
        assert!(error.contains(told), "{error}\nexpected {told}");
        assert!(!error.contains('\n'), "{error}");
    }
    with("line = \"north\"\nlisten = \"0.0.0.0:502\"\nplain = true\nallow = [\"10.0.0.0/8\", \"fd00::/8\"]")
        .unwrap();
}

#[test]
fn a_webhook_says_what_it_lacks_and_shows_no_path() {
    let with = |entry: &str| read(&format!("[[webhooks]]\n{entry}\n{BROKER}"));
    let there = "url = \"https://hooks.example.com/services/T0/secret\"";
    let config = with(there).unwrap();
    let shown = format!("{:?}", config.face("webhooks").unwrap().meaning());
    assert!(shown.contains("https://hooks.example.com") && !shown.contains("services"), "{shown}");
    for (entry, told) in [
        ("", "expected url = "),
        ("url = \"hooks.example.com\"", "url: \"hooks.example.com\": expected https://HOST/PATH"),
        ("url = \"http://10.0.0.7/a\"", "url: alarms and tokens would cross the network in clear"),
        ("text = \"{drvie}\"", "{drvie}: expected one of {host}, {of}"),
        ("severity = \"note\"", "expected one of warning, alarm"),
        ("body = \"text\"\nfield = \"text\"", "field: expected body or field, not both"),
        ("timeout = \"0\"", "timeout: 0ns: expected 1s to 60s"),
        ("name = \"\"", "expected a name without control characters"),
        ("[[webhooks]]\nurl = \"http://[::1]:9/\"", "two webhooks are named \"webhook\""),
    ] {
        let said = if told.contains("url") { entry.to_owned() } else { format!("{there}\n{entry}") };
        let error = with(&said).expect_err(told);
        assert!(error.contains(told), "{error}\nexpected {told}");
    }
    with("url = \"http://10.0.0.7/a\"\nplain = true").unwrap();
    let many: Vec<String> = (0..17).map(|number| format!("{there}\nname = \"{number}\"")).collect();
    assert!(with(&many.join("\n[[webhooks]]\n")).unwrap_err().contains("expected at most 16"));
}

#[test]
fn a_network_has_the_addresses_that_begin_as_it_does() {
    for (network, inside, outside) in [
        ("10.0.0.0/24", "10.0.0.255", "10.0.1.0"),
        ("10.0.0.7", "10.0.0.7", "10.0.0.8"),
        ("10.0.0.0/24", "::ffff:10.0.0.9", "fd00::1"),
        ("fd00::/8", "fdff::1", "fe00::1"),
    ] {
        let network: Network = network.parse().unwrap();
        assert!(network.has(inside.parse().unwrap()), "{network:?} {inside}");
        assert!(!network.has(outside.parse().unwrap()), "{network:?} {outside}");
    }
    let all: Network = "0.0.0.0/0".parse().unwrap();
    assert!(all.has("192.168.1.1".parse().unwrap()));
}

const BROKER: &str = "[lines.a]\nport = \"/dev/ttyUSB0\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1-2\"\nname = \"pump {}\"\n";

fn with_broker(section: &str) -> Result<MqttConfig, String> {
    read(&format!("{section}\n{BROKER}"))
        .map(|config| face::<OnBroker>(&config, "mqtt").expect("there is a broker").mqtt)
}

#[test]
fn without_a_section_nothing_is_told_to_a_broker_and_nobody_commands_unless_it_is_said() {
    assert!(read(BROKER).unwrap().faces.iter().all(|(table, _)| *table == "history"));
    let mqtt =
        with_broker("[mqtt]\nservers = [\"mqtts://broker\", \"mqtt://[::1]:1884\"]\nbase = \"plant/north\"")
            .unwrap();
    let address = |host: &str, port, tls| Address { host: host.to_owned(), port, tls };
    assert_eq!(mqtt.servers, [address("broker", 8883, true), address("::1", 1884, false)]);
    assert_eq!((mqtt.commands, mqtt.discovery, &*mqtt.client_id), (false, Discovery::Off, "plant-north"));
    assert_eq!((mqtt.heartbeat, mqtt.interval), (Duration::from_secs(30), Duration::from_secs(1)));
    assert!(!mqtt.needs_issued);
    let needs = with_broker("[mqtt]\nservers = [\"mqtts://broker\"]\ncommands = true\nneeds_issued = true");
    assert!(needs.unwrap().needs_issued);
}

#[test]
fn what_is_wrong_with_a_broker_is_told_with_its_place() {
    let tls = "[mqtt]\nservers = [\"mqtts://broker\"]\n";
    for (section, problem) in [
        ("[mqtt]\nservers = []".to_owned(), "expected one at least"),
        ("[mqtt]\nservers = [\"broker\"]".to_owned(), "expected mqtts://HOST"),
        ("[mqtt]\nservers = [\"mqtt://broker:0\"]".to_owned(), "expected mqtts://HOST"),
        ("[mqtt]\nservers = [\"mqtt://broker\"]".to_owned(), "would cross the network in clear"),
        (format!("{tls}base = \"plant/+\""), "expected levels"),
        (format!("{tls}base = \"$SYS\""), "expected levels"),
        (format!("{tls}base = \"plant//north\""), "expected levels"),
        (format!("{tls}client_id = \"a b\""), "expected a name"),
        (format!("{tls}heartbeat = \"500ms\""), "expected 1s or more"),
        (format!("{tls}password = \"file\""), "a password of nobody"),
        (format!("{tls}discovery = \"on\""), "expected device, component or off"),
        (format!("{tls}[mqtt.commanders]\nhmi = \"operate\""), "expected commands = true"),
        (format!("{tls}needs_issued = true"), "expected commands = true"),
        (format!("{tls}commands = true\nneeds_issued = \"yes\""), "expected a boolean"),
        (format!("{tls}commands = true\n[mqtt.commanders]\n\"h/i\" = \"operate\""), "a level of a topic"),
        (format!("{tls}commands = true\n[mqtt.commanders]\nhmi = \"root\""), "unknown variant"),
        (format!("{tls}insecure = true"), "unknown field"),
    ] {
        let told = with_broker(&section).expect_err(&section);
        assert!(told.starts_with("drives.toml:") && told.contains(problem), "{section}: {told}");
    }
    let plain = "[mqtt]\nservers = [\"mqtt://broker\"]\nplain = true";
    assert_eq!(with_broker(plain).unwrap().servers[0].port, 1883);
}

#[test]
fn a_slot_is_given_to_one_drive_and_several_of_one_entry_follow_each_other() {
    let with = |drives: &str| read(&format!("[lines.a]\nport = \"/dev/ttyUSB0,19200,8E1\"\n{drives}"));
    let several = "[[drives]]\nline = \"a\"\ndrive = \"atv312@1-3\"\nslot = 10\n";
    let config = with(several).unwrap_or_else(|told| panic!("{told}"));
    let slots: Vec<_> = config.lines[0].drives.iter().map(|drive| drive.slot).collect();
    assert_eq!(slots, [Some(10), Some(11), Some(12)]);
    let again = "[[drives]]\nline = \"a\"\ndrive = \"atv312@9\"\nname = \"fan\"\nslot = 11\n";
    let told = with(&format!("{several}{again}")).expect_err("two drives");
    assert!(told.contains("slot 11 is given to \"a 2\" and to \"fan\""), "{told}");
    let told = with(&format!("[defaults]\nslot = 1\n{several}")).expect_err("a default");
    assert!(told.contains("a default names no line and no drive"), "{told}");
}

fn edge_node(config: &Config) -> Option<SparkplugConfig> {
    face::<OnBroker>(config, "mqtt").and_then(|on_broker| on_broker.sparkplug)
}

fn with_edge_node(section: &str) -> Result<SparkplugConfig, String> {
    let mqtt = "[mqtt]\nservers = [\"mqtts://broker\"]\n[mqtt.sparkplug]\n";
    read(&format!("{mqtt}{section}\n{BROKER}"))
        .map(|config| edge_node(&config).expect("there is an edge node"))
}

#[test]
fn without_a_section_the_daemon_is_no_edge_node_and_hosts_command_nothing_unless_it_is_said() {
    assert_eq!(edge_node(&read(&format!("[mqtt]\nservers = [\"mqtts://broker\"]\n{BROKER}")).unwrap()), None);
    let least = with_edge_node("group = \"plant\"\nedge_node = \"hall 1\"\nstate = \"bd-seq\"").unwrap();
    assert_eq!((least.name.group.as_str(), least.name.edge_node.as_str()), ("plant", "hall 1"));
    assert_eq!((least.primary_host, least.commands, least.historical), (None, None, false));
    assert_eq!((least.lifetime, least.rebirth_pause), (Duration::from_secs(1), Duration::from_secs(5)));
    let more = "group = \"plant\"\nedge_node = \"x\"\nstate = \"/var/bd-seq\"\nprimary_host = \"scada\"\n\
                commands = \"stop\"\nlifetime = \"5s\"\nhistorical = true";
    let more = with_edge_node(more).unwrap();
    assert_eq!(more.primary_host.map(|host| host.to_string()), Some("scada".to_owned()));
    assert_eq!((more.commands, more.lifetime), (Some(Role::Stop), Duration::from_secs(5)));
    assert!(more.historical);
    assert_eq!(more.state, Path::new("/var/bd-seq"));
}

#[test]
fn what_is_wrong_with_an_edge_node_is_told_with_its_place() {
    let least = "group = \"plant\"\nedge_node = \"hall 1\"\nstate = \"bd-seq\"\n";
    for (section, problem) in [
        ("edge_node = \"x\"".to_owned(), "missing field"),
        ("group = \"a/b\"\nstate = \"x\"".to_owned(), "expected a name without + / #"),
        (format!("{least}primary_host = \"#\""), "expected a name without + / #"),
        (format!("{least}commands = \"engineer\""), "expected one of off, stop, operate"),
        (format!("{least}lifetime = \"11s\""), "expected up to 10s"),
        (format!("{least}retain = true"), "unknown field"),
        (format!("{least}historical = \"yes\""), "expected a boolean"),
    ] {
        let told = with_edge_node(&section).expect_err(&section);
        assert!(told.starts_with("drives.toml:") && told.contains(problem), "{section}: {told}");
    }
    for (name, problem) in
        [("a/b", "expected a name without + / #"), ("PUMP 1", "differ in nothing but case")]
    {
        let more = format!("[[drives]]\nline = \"a\"\ndrive = \"atv312@3\"\nname = \"{name}\"\n");
        let text = format!("[mqtt]\nservers = [\"mqtts://broker\"]\n[mqtt.sparkplug]\n{least}{BROKER}{more}");
        let told = read(&text).expect_err(name);
        assert!(told.contains(problem), "{told}");
    }
}

#[test]
fn what_only_a_drive_under_control_can_do_is_refused_without_it() {
    let with = |said: &str| {
        read(&format!(
            "lines.a.port = \"/dev/ttyUSB0,19200,8N1\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n{said}\n"
        ))
    };
    let acting = [
        ("commanders", "[\"operator\"]"),
        ("watchdog", "{ time = \"5s\", reaction = \"ramp\" }"),
        ("frequency", "{ low = 10 }"),
        ("stop_mode", "\"fast\""),
        ("on_exit", "\"stop\""),
        ("on_exit_adopted", "\"stop\""),
        ("on_exit_watchdog", "\"leave\""),
        ("on_loss", "\"stop\""),
        ("on_fault", "\"reset-watchdog-trip\""),
        ("on_control_taken", "\"withdraw\""),
        ("accept_self_restart", "[\"Atr\"]"),
        ("accept_resume", "[\"output\"]"),
        ("injection", "\"3s\""),
    ];
    for (key, value) in acting {
        let refused = with(&format!("{key} = {value}")).expect_err(key);
        let told = format!("drives.toml:5: {key}: {key} without control = true: a 1 is only read");
        assert!(refused.starts_with(&told), "{refused}");
        with(&format!("{key} = {value}\ncontrol = true")).expect(key);
    }
    let declared: Vec<_> = drive_keys().iter().filter(|key| key.acts).map(|key| key.name).collect();
    assert_eq!(declared, acting.map(|(key, _)| key));
    for idle in [
        "on_exit = \"leave\"",
        "on_exit_adopted = \"leave\"",
        "on_loss = \"report\"",
        "on_fault = \"report\"",
        "alarms = { current = 10 }",
        "coast = \"30s\"",
    ] {
        with(idle).expect(idle);
    }
}

/// The keys that a section takes, by the parser's own words for one that it does not know.
fn taken(section: &str) -> std::collections::BTreeSet<String> {
    let told = read(&format!("{section}\nnobody_knows_it = 1\n{BROKER}")).unwrap_err();
    let (_, all) = told.split_once("expected one of ").unwrap_or_else(|| panic!("{section}: {told}"));
    all.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The chapters of the manual, one behind the other.
fn manual() -> String {
    let folder = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../drived/docs")).unwrap();
    let mut chapters: Vec<_> = folder.map(|entry| entry.unwrap().path()).collect();
    chapters.sort();
    chapters.into_iter().map(|chapter| std::fs::read_to_string(chapter).unwrap()).collect()
}

/// The rows of the table of the manual with this head.
fn rows(manual: &str, head: &str) -> Vec<String> {
    let rows = manual.lines().skip_while(|line| !line.starts_with(&format!("| {head} | Is |"))).skip(2);
    rows.take_while(|row| row.starts_with('|')).map(str::to_owned).collect()
}

/// The keys of the table of the manual with this head.
fn documented(head: &str) -> std::collections::BTreeSet<String> {
    let rows = rows(&manual(), head);
    let firsts = rows.iter().map_while(|row| row.strip_prefix("| ")?.split(" | ").next());
    let keys = firsts.flat_map(|first| first.split('`').skip(1).step_by(2));
    let bare = |key: &str| key.trim_matches(['[', ']']).rsplit('.').next().unwrap_or_default().to_owned();
    keys.map(bare).collect()
}

#[test]
fn the_manual_has_every_key_of_the_file_and_no_other() {
    for (head, section) in
        [("`[http]`", "[http]"), ("`[mqtt.sparkplug]`", "[mqtt]\nservers = []\n[mqtt.sparkplug]")]
    {
        assert_eq!(documented(head), taken(section), "{head}");
    }
    let mut mqtt = documented("`[mqtt]`");
    mqtt.insert("sparkplug".to_owned());
    assert_eq!(mqtt, taken("[mqtt]"));
}

#[test]
fn the_manual_says_of_each_key_what_its_table_declares() {
    let manual = manual();
    read(FULL).unwrap();
    for (head, keys) in tables() {
        let declared: Vec<String> = keys.iter().map(|key| key.row()).collect();
        assert_eq!(rows(&manual, &head), declared, "expected\n{}", declared.join("\n"));
    }
}

/// What the sources of all crates call a file of the state folder.
fn called_a_file_of_the_state_folder() -> std::collections::BTreeSet<String> {
    let mut found = std::collections::BTreeSet::new();
    let mut folders = vec![std::path::PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.extend((!path.ends_with("target")).then_some(path));
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = std::fs::read_to_string(path).unwrap();
                let behind = text.split("/// The file of the state folder.\n").skip(1);
                found.extend(behind.filter_map(|rest| rest.split('"').nth(1)).map(str::to_owned));
            }
        }
    }
    found
}

#[test]
fn the_manual_lists_every_file_of_the_state_folder_and_no_other() {
    let folder = Folder::new("state-files");
    std::fs::write(folder.file("drives.toml"), format!("state = \".\"\n{BROKER}")).unwrap();
    let state = Config::load(&folder.file("drives.toml")).unwrap().doors.state;
    let source = Source { file: std::path::Path::new("drives.toml"), text: "" };
    let own = [state.bd_seq(source, None), state.tokens, state.audit, state.watchdogs];
    let own = own.into_iter().map(|file| file.unwrap().file_name().unwrap().to_str().unwrap().to_owned());
    let kept: std::collections::BTreeSet<String> = own.chain(called_a_file_of_the_state_folder()).collect();
    let manual = include_str!("../../drived/docs/configuration.md");
    let row = manual.lines().find_map(|line| line.strip_prefix("| `state` | ")).unwrap();
    let (list, _) = row.split_once(';').unwrap();
    let listed = list.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    assert_eq!(kept, listed);
}

#[test]
fn a_key_that_says_its_default_changes_nothing() {
    let file = |[top, line, drive, gateway, webhook]: [&str; 5]| {
        let (port, names) = ("lines.a.port = \"/dev/ttyUSB0\"", "line = \"a\"\ndrive = \"atv312@1\"");
        let drive = format!("[[drives]]\n{names}\ncontrol = true\n{drive}");
        let config = read(&format!(
            "{top}\n{port}\n{line}\n{drive}\n[[gateways]]\nline = \"a\"\n{gateway}\n[[webhooks]]\nurl = \"https://a/\"\n{webhook}\n"
        ));
        config.map(|config| format!("{config:?}"))
    };
    let plain = file([""; 5]).unwrap();
    let mut tried = 0;
    for (head, keys) in tables() {
        for key in keys {
            // What is more than code has no word in the file.
            let Some(default) = key.default().trim_end_matches(" ¹").strip_prefix('`') else { continue };
            let Some(default) = default.strip_suffix('`') else { continue };
            let is_value =
                default.starts_with('"') || default.parse::<bool>().is_ok() || default.parse::<u32>().is_ok();
            let said = if is_value { default.to_owned() } else { format!("{default:?}") };
            let said = format!("{} = {said}", key.name);
            let config = match &*head {
                "Top level" if key.name.starts_with('[') => continue,
                "Top level" => file([&said, "", "", "", ""]),
                "`[lines.NAME]`" => file(["", &format!("lines.a.{said}"), "", "", ""]),
                // It is refused without the time that it is about.
                _ if key.name == "on_client_silence" => continue,
                "`[[gateways]]`" => file(["", "", "", &said, ""]),
                "`[[webhooks]]`" => file(["", "", "", "", &said]),
                "`[history]`" => file(["", "", "", "", &format!("[history]\n{said}")]),
                _ if key.name == "control" => continue,
                _ => file(["", "", &said, "", ""]),
            };
            assert_eq!(config.as_ref(), Ok(&plain), "{said}");
            tried += 1;
        }
    }
    assert!(tried > 25, "{tried}");
}

#[test]
fn whoever_stands_behind_a_proxy_that_the_file_tells_of_is_not_local() {
    let rest = "[lines.a]\nport = \"/dev/ttyUSB0\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\n";
    let folder = Folder::new("proxies");
    for (http, freely) in [
        ("", Role::Stop.rights()),
        // Somebody calls it by a name: a proxy stands before it.
        ("allowed_hosts = [\"drives.example\"]", Rights::NONE),
        // A proxy encrypts, as the key says.
        ("plain = true", Rights::NONE),
    ] {
        std::fs::write(folder.file("drives.toml"), format!("[http]\n{http}\n{rest}")).unwrap();
        let config = Config::load(&folder.file("drives.toml")).unwrap();
        assert_eq!(config.doors.http.unwrap().freely(false), freely, "{http}");
    }
}

#[test]
fn drives_that_were_added_hold_as_long_as_the_configuration_has_none_of_its_own_and_by_their_own_words_alone()
{
    let folder = Folder::new("added");
    let (file, added) = (folder.file("drives.toml"), folder.file(added::FILE));
    let head = "state = \".\"\n[defaults]\ncontrol = true\non_exit = \"leave\"\n[groups]\nall = [\"pump\"]\n";
    let own = "[lines.a]\nport = \"/dev/ttyUSB0\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\nname = \"pump\"\n";
    let theirs = own.replace("atv312@1", "atv28@2");
    let names = |config: &Config| -> Vec<(String, bool)> {
        let drives = config.lines.iter().flat_map(|line| &line.drives);
        drives.map(|drive| (drive.name.to_string(), drive.settings.control)).collect()
    };
    std::fs::write(&file, head).unwrap();
    // A group of a drive that is nowhere is wrong, whichever file it would stand in.
    assert!(Config::load_or_empty(&file).unwrap_err().to_string().contains("pump"));
    std::fs::write(&added, &theirs).unwrap();
    let config = Config::load(&file).unwrap();
    // What the configuration says of all its drives is not said of these: nobody takes control of them by it.
    assert_eq!(names(&config), [("atv28@2".to_owned(), false)]);
    assert!(config.added.as_ref().is_some_and(|added| !added.is_aside));
    let other = theirs.replace("drive = \"atv28@2\"", "drive = \"atv58@3\"\nguessed = true");
    let with = Config::load_with(&file, &other).unwrap();
    assert_eq!(names(&with), [("atv58@3".to_owned(), false)]);
    assert!(with.lines[0].drives[0].is_guess && !config.lines[0].drives[0].is_guess);
    std::fs::write(&file, format!("{head}{own}")).unwrap();
    let config = Config::load(&file).unwrap();
    assert_eq!(names(&config), [("atv312@1".to_owned(), true)]);
    let aside = config.added.unwrap().aside(&file).expect("it is said");
    assert!(aside.contains("added.toml") && aside.contains("drives.toml has drives of its own"), "{aside}");
    // Then nobody reads it, whatever stands there.
    std::fs::write(&added, "[[drives").unwrap();
    assert_eq!(names(&Config::load(&file).unwrap()).len(), 1);
    // A line alone is a plant of its own that is not finished yet, and nothing is put in its place.
    std::fs::write(&file, format!("{head}[lines.a]\nport = \"/dev/ttyUSB0\"\n")).unwrap();
    assert!(Config::load_or_empty(&file).unwrap_err().to_string().contains("no drive"));
    std::fs::write(&file, "state = \".\"\n").unwrap();
    for (text, wrong) in [
        (format!("{theirs}running = \"soon\"\n"), "added.toml:7: running"),
        (format!("shutdown = \"1s\"\n{theirs}"), "added.toml:1: shutdown: expected lines and drives alone"),
        ("[[drives".to_owned(), "added.toml:1"),
    ] {
        std::fs::write(&added, text).unwrap();
        let told = Config::load(&file).unwrap_err().to_string();
        assert!(told.contains(wrong), "{told}");
    }
    std::fs::remove_file(&added).unwrap();
    assert!(names(&Config::load_or_empty(&file).unwrap()).is_empty());
}
