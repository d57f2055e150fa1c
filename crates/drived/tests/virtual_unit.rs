//! Where a drive stands in the virtual unit, as mbpoll reads it, while drives are taken out, put back, renamed and added, over reloads and a
//! restart. Over a pty, in real time; nothing here asserts a duration.
#![cfg(unix)]

mod support;

use std::{fs, path::PathBuf, process::Command};

use serde_json::Value;
use support::{Running, Sim, drived, free_port, get, is_there, path, run};

/// As `drived export gateway-map` has them: the revision in the head, and the address of each drive in its details.
const REVISION: u16 = 8;
const FIRST_SLAVE: u16 = 2_015;
const DETAILS: u16 = 16;

struct Plant {
    sim: Sim,
    folder: PathBuf,
    modbus: u16,
    http: u16,
}

impl Plant {
    fn new() -> Self {
        let folder = path("virtual-unit-folder");
        fs::create_dir_all(&folder).expect("the directory can be written");
        let sim = Sim::serve("virtual-unit", &["atv312@1-5"]);
        Self { sim, folder, modbus: free_port(), http: free_port() }
    }

    fn file(&self) -> String {
        self.folder.join("drives.toml").to_str().expect("the path is text").to_owned()
    }

    fn configure(&self, drives: &[(&str, u8)]) {
        let drives = drives.iter().map(|(name, slave)| {
            format!("[[drives]]\nline = \"a\"\ndrive = \"atv312@{slave}\"\nname = \"{name}\"\n")
        });
        let text = format!(
            "state = \"state\"\n[http]\nlisten = \"127.0.0.1:{}\"\n[lines.a]\nport = \"{},19200,8E1\"\n{}[[gateways]]\n\
             listen = \"127.0.0.1:{}\"\nvirtual_unit = 247\n",
            self.http,
            self.sim.link(),
            drives.collect::<String>(),
            self.modbus
        );
        fs::write(self.file(), text).expect("it can be written");
    }

    fn start(&self) -> Running {
        let mut daemon = Running::start(&["run", "--config", &self.file()]);
        daemon.wait_for(r#""event":"connected""#);
        daemon
    }

    fn reload(&self, daemon: &mut Running) {
        daemon.signal("-HUP");
        daemon.wait_for_log("configuration read again: ");
    }

    /// Registers of the virtual unit; the gateway listens on a task of its own.
    fn read(&self, address: u16, count: u16) -> Vec<u16> {
        let [port, address, count] = [self.modbus, address, count].map(|number| number.to_string());
        for _ in 0..50 {
            let arguments = [
                "-m",
                "tcp",
                "-p",
                &port,
                "-a",
                "247",
                "-0",
                "-r",
                &address,
                "-c",
                &count,
                "-1",
                "-q",
                "127.0.0.1",
            ];
            let told = Command::new("mbpoll").args(arguments).output().expect("it runs");
            if told.status.success() {
                let text = String::from_utf8(told.stdout).expect("it is text");
                // `[16]: 	1234`, and with a negative number behind it where it may be one.
                let values = text.lines().filter_map(|line| line.strip_prefix('[')?.split_once("]:"));
                let first = |value: &str| value.split_whitespace().next().and_then(|word| word.parse().ok());
                return values.filter_map(|(_, value)| first(value)).collect();
            }
        }
        panic!("nobody answers for the virtual unit");
    }

    /// The address of the drive in each place, 0 where nobody is; the revision is the same in the head, the API and the exported map.
    fn seen(&self, places: u16) -> (Vec<u16>, u16) {
        let details = self.read(FIRST_SLAVE - (DETAILS - 1), places * DETAILS);
        let slaves =
            details.chunks(usize::from(DETAILS)).map(|details| details[usize::from(DETAILS) - 1]).collect();
        let revision = self.read(REVISION, 1)[0];
        let state: Value =
            serde_json::from_str(&get(self.http, "/api/v1/state", "application/json")).expect("it is JSON");
        assert_eq!(state["daemon"]["names_revision"], revision);
        let map = run(&["export", "gateway-map", "--config", &self.file()]);
        assert!(map.assert_done().contains(&format!("; {revision} here\"")), "{revision}: {map:?}");
        (slaves, revision)
    }
}

impl Drop for Plant {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn no_register_moves_under_a_scada_and_a_place_is_given_again_only_once_a_person_has_said_so() {
    if !is_there("mbpoll", &["-V"]) {
        return;
    }
    let plant = Plant::new();
    let (fan, blower, mixer) = (("fan 3", 1), ("blower", 2), ("mixer", 3));
    plant.configure(&[fan, blower, mixer]);
    let mut daemon = plant.start();
    let (slaves, first) = plant.seen(3);
    assert_eq!(slaves, [1, 2, 3]);

    plant.configure(&[blower, mixer]);
    plant.reload(&mut daemon);
    let (slaves, without) = plant.seen(3);
    assert_eq!(slaves, [0, 2, 3], "nobody moves");
    assert_ne!(without, first);

    let pump = ("pump", 4);
    plant.configure(&[pump, blower, mixer]);
    plant.reload(&mut daemon);
    assert_eq!(plant.seen(4).0, [0, 2, 3, 4], "who is new has a place of his own");

    plant.configure(&[mixer, pump, blower, fan]);
    plant.reload(&mut daemon);
    let (slaves, back) = plant.seen(4);
    assert_eq!(slaves, [1, 2, 3, 4], "who is put back has his own");

    assert_eq!(daemon.interrupt().0, Some(0));
    let mut daemon = plant.start();
    assert_eq!(plant.seen(4), (slaves, back), "a restart moves nobody");

    let extractor = ("extractor", 2);
    plant.configure(&[mixer, pump, extractor, fan]);
    plant.reload(&mut daemon);
    let (slaves, renamed) = plant.seen(4);
    assert_eq!(slaves, [1, 2, 3, 4]);
    assert_ne!(renamed, back);

    plant.configure(&[pump, extractor, fan]);
    plant.reload(&mut daemon);
    let gone = plant.seen(4);
    assert_eq!(gone.0, [1, 2, 0, 4]);
    let file = plant.file();
    let names = |what: &[&str]| run(&[&["names"], what, &["--config", &file]].concat());
    names(&["give", "pump", "2"]).assert_refused(2, "2 is the number of mixer, which is gone");
    plant.reload(&mut daemon);
    assert_eq!(plant.seen(4), gone);
    names(&["forget", "mixer"]).assert_done();
    names(&["give", "pump", "2"]).assert_done();
    plant.reload(&mut daemon);
    assert_eq!(plant.seen(3).0, [1, 2, 4]);
    assert_eq!(daemon.interrupt().0, Some(0));
}

/// What one of many hosts begins with is a configuration that works, and what it gives to Prometheus is what Prometheus takes.
#[test]
fn a_host_is_made_of_the_template_and_found_by_prometheus() {
    let folder = path("host-folder");
    fs::create_dir_all(&folder).expect("the directory can be written");
    let at = |name: &str| folder.join(name).to_str().expect("the path is text").to_owned();
    let template = run(&["export", "host", "--host", "pumps-north"]);
    fs::write(at("drives.toml"), template.assert_done()).expect("it can be written");
    for (name, text) in [
        ("drived.crt", include_str!("tls/certificate.pem")),
        ("plant-ca.crt", include_str!("tls/certificate.pem")),
        ("drived.key", include_str!("tls/key.pem")),
    ] {
        fs::write(at(name), text).expect("it can be written");
        fs::set_permissions(at(name), std::os::unix::fs::PermissionsExt::from_mode(0o600))
            .expect("it is ours");
    }
    let checked = run(&["check", "--config", &at("drives.toml")]);
    assert!(checked.code == Some(0) && checked.out.contains("plant/pumps-north"), "{checked:?}");
    let found = run(&["export", "file-sd", "--config", &at("drives.toml"), "--host", "pumps-north"]);
    let found = found.assert_done();
    // With a site, which stands in every topic and label.
    let south = run(&["export", "host", "--host", "fans", "--site", "south"]);
    assert!(south.assert_done().contains("base = \"south/fans\""), "{south:?}");
    let labelled =
        run(&["export", "file-sd", "--config", &at("drives.toml"), "--host", "fans", "--site", "south"]);
    assert!(labelled.assert_done().contains("\"site\": \"south\""), "{labelled:?}");
    // https://prometheus.io/docs/prometheus/latest/configuration/configuration/#file_sd_config
    let expected = serde_json::json!([{
        "targets": ["pumps-north:7580"],
        "labels": { "host": "pumps-north", "__scheme__": "https" },
    }]);
    assert_eq!(serde_json::from_str::<Value>(found).expect("it is JSON"), expected);
    run(&["export", "file-sd", "--config", &at("drives.toml")]).assert_refused(2, "expected --host NAME");
    run(&["export", "host", "--host", "pumps north"]).assert_refused(2, "expected the name of a host");
    assert_eq!(drived(&["export", "host"]).output().expect("it runs").status.code(), Some(2));
    if is_there("promtool", &["--version"]) {
        fs::write(at("pumps-north.json"), found).expect("it can be written");
        let scraped = "scrape_configs:\n  - job_name: drived\n    file_sd_configs:\n      - files: ['pumps-north.json']\n";
        fs::write(at("prometheus.yml"), scraped).expect("it can be written");
        let told = Command::new("promtool")
            .args(["check", "config", &at("prometheus.yml")])
            .output()
            .expect("it runs");
        assert!(told.status.success(), "{told:?}");
    }
    fs::remove_dir_all(folder).expect("it is there");
}
