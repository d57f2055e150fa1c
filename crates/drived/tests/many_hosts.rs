//! Several daemons and what joins them: one Prometheus that scrapes them all, with the rules that the program gives out, and
//! one broker.
#![cfg(unix)]

#[path = "support/prometheus.rs"]
mod prometheus;
mod support;

use std::{
    collections::BTreeSet,
    fs,
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    thread,
};

use prometheus::Prometheus;
use support::{File, Running, Sim, free_port, get, is_there, path};

/// A daemon with two pumps of its own.
struct Host {
    port: u16,
    daemon: Running,
    sim: Sim,
    file: File,
}

impl Host {
    fn start(name: &str) -> Self {
        Self::with(name, "")
    }

    /// The same with more sections.
    fn with(name: &str, sections: &str) -> Self {
        let (sim, port) = (Sim::serve(name, &["atv312@1-2"]), free_port());
        let text = format!(
            "snapshots = \"500ms\"\n{sections}[http]\nlisten = \"127.0.0.1:{port}\"\n[lines.{name}]\nport = \"{},19200,8E1\"\n\
             [[drives]]\nline = \"{name}\"\ndrive = \"atv312@1-2\"\nname = \"{name} pump {{}}\"\ncontrol = true\n",
            sim.link()
        );
        let file = File::new(name, &text);
        let mut daemon = Running::start(&["run", "--config", file.path()]);
        daemon.wait_for_log("the page is at http://127.0.0.1");
        for _ in 0..2 {
            daemon.wait_for(r#""event":"connected""#);
        }
        Self { port, daemon, sim, file }
    }
}

/// A mosquitto that keeps nothing when it goes; killed when dropped.
struct Broker(Child);

impl Broker {
    fn start(port: u16) -> Self {
        let config = path(&format!("mosquitto-{port}.conf"));
        let text = format!("user root\nlistener {port} 127.0.0.1\nallow_anonymous true\npersistence false\n");
        fs::write(&config, text).expect("it can be written");
        let mut mosquitto = Command::new("mosquitto");
        mosquitto.arg("-c").arg(&config).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        Self(mosquitto.spawn().expect("it was there a moment ago"))
    }

    /// The next messages of some topics, as they are told or kept.
    fn hear(port: u16, topics: &str, count: u8) -> BTreeSet<String> {
        let (port, count) = (port.to_string(), count.to_string());
        let mut heard = Command::new("mosquitto_sub");
        heard.args(["-V", "mqttv5", "-h", "127.0.0.1", "-p", &port, "-t", topics, "-C", &count, "-v"]);
        loop {
            let output = heard.output().expect("it comes with mosquitto");
            if output.status.success() {
                return String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect();
            }
        }
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn one_prometheus_sees_three_daemons_and_fires_when_a_drive_of_one_trips() {
    if !is_there("prometheus", &["--version"]) {
        return;
    }
    let mut hosts = ["north", "east", "south"].map(Host::start);
    let files: Vec<&str> = hosts.iter().map(|host| host.file.path()).collect();
    let mut prometheus = Prometheus::start("prometheus", &files);
    prometheus.wait(|prometheus| {
        let up = prometheus.query(r#"sum(up{job="drived"}) == 3 and sum(drived_drive_up) == 6"#)?;
        up.contains("\"value\"").then_some(())
    });
    let quiet = prometheus.firing().expect("it answers");
    assert!(!quiet.contains("alertname"), "{quiet}");

    let [_, east, _] = &mut hosts;
    east.sim.say("atv312@2 trip OCF", "done");
    // By what it has tripped is read a moment later.
    let is_told = |alerts: &String| alerts.contains("alertname") && !alerts.contains(r#""mnemonic":"?""#);
    let alerts = prometheus.wait(|prometheus| prometheus.firing().filter(is_told));
    assert!(alerts.contains(r#""alertname":"DrivedTripped""#), "{alerts}");
    assert!(
        alerts.contains(r#""drive":"east pump 2""#) && alerts.contains(r#""mnemonic":"OCF""#),
        "{alerts}"
    );
    assert!(!alerts.contains("north pump") && !alerts.contains("south pump"), "{alerts}");

    // The metric store is an output: a daemon goes on, and ends, whether it is there or not.
    drop(prometheus);
    for host in hosts {
        let Host { mut daemon, .. } = host;
        daemon.wait_for(r#""quality":"good""#);
        assert_eq!(daemon.interrupt().0, Some(0));
    }
}

#[test]
fn three_daemons_follow_a_broker_that_moves_tell_it_everything_again_and_are_missed_when_they_go() {
    if !is_there("sh", &["-c", "command -v mosquitto && command -v mosquitto_sub"]) {
        return;
    }
    let (first, second) = (free_port(), free_port());
    let broker = Broker::start(first);
    let mut hosts = ["ash", "birch", "cedar"].map(|name| {
        let servers = format!("\"mqtt://127.0.0.1:{first}\", \"mqtt://127.0.0.1:{second}\"");
        Host::with(
            name,
            &format!("[mqtt]\nservers = [{servers}]\nbase = \"plant/{name}\"\nheartbeat = \"1s\"\n"),
        )
    });
    let all: BTreeSet<String> = ["ash", "birch", "cedar"]
        .iter()
        .flat_map(|name| {
            [1, 2].map(|pump| format!("plant/{name}/drive/{name}_pump_{pump}/availability online"))
        })
        .collect();
    // A drive that is told again stands here once.
    let hear_all = |port| while Broker::hear(port, "plant/+/drive/+/availability", 6) != all {};
    hear_all(first);

    // The drives are asked on while there is no broker, and the one that comes knows nothing.
    drop(broker);
    for host in &mut hosts {
        let snapshot = host.daemon.wait_for(r#""kind":"snapshot""#);
        assert!(snapshot.contains(r#""quality":"good""#), "{snapshot}");
    }
    let _broker = Broker::start(second);
    hear_all(second);
    for host in &hosts {
        assert!(get(host.port, "/metrics", "*/*").contains("\ndrived_mqtt_connected 1\n"));
    }

    let [mut ash, birch, cedar] = hosts;
    ash.daemon.signal("-KILL");
    while !Broker::hear(second, "plant/ash/status", 1).contains("plant/ash/status offline") {}
    for Host { daemon, .. } in [birch, cedar] {
        assert_eq!(daemon.interrupt().0, Some(0));
    }
}

#[test]
fn whoever_scrapes_without_end_holds_up_no_line() {
    let Host { port, mut daemon, sim: _sim, file: _file } = Host::start("scraped");
    let ends = AtomicBool::new(false);
    thread::scope(|scope| {
        let scrapers: Vec<_> = (0..8)
            .map(|_| {
                scope.spawn(|| {
                    let mut scrapes = 0;
                    while !ends.load(Ordering::Relaxed) {
                        assert!(get(port, "/metrics", "*/*").contains("drived_drive_up"));
                        scrapes += 1;
                    }
                    scrapes
                })
            })
            .collect();
        for _ in 0..6 {
            let snapshot = daemon.wait_for(r#""kind":"snapshot""#);
            assert!(
                snapshot.contains(r#""quality":"good""#) && snapshot.contains(r#""lost":0"#),
                "{snapshot}"
            );
        }
        ends.store(true, Ordering::Relaxed);
        for scraper in scrapers {
            let scrapes: u32 = scraper.join().expect("every scrape is answered");
            assert!(scrapes > 0);
        }
    });
    assert_eq!(daemon.interrupt().0, Some(0));
}
