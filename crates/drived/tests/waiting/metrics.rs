//! `/metrics` of a real daemon with simulated drives of all families, read by programs that were not written here.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::Write as _,
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

use crate::support::{File, Running, Sim, free_port, get, is_there, path, python_with, run};

/// The table that a test in the crate holds against the code.
const DOCUMENT: &str = include_str!("../../docs/metrics.md");

/// Five families on one line, the first tripped and the second without power.
struct Plant {
    port: u16,
    _daemon: Running,
    _sim: Sim,
    _file: File,
}

impl Plant {
    fn start(name: &str) -> Self {
        let drives = ["atv312@1", "atv28@2", "atv58@3", "atv21@4", "3g3ev@5"];
        let (mut sim, port) =
            (Sim::serve_with(name, &drives, &["--baud", "19200", "--format", "8N1"]), free_port());
        let mut text = format!(
            "[mqtt]\nservers = [\"mqtt://127.0.0.1:1\"]\n[[webhooks]]\nurl = \"http://127.0.0.1:1/\"\n[http]\nlisten = \"127.0.0.1:{port}\"\n[lines.bench]\nport = \"{},19200,8N1\"\n",
            sim.link()
        );
        for drive in drives {
            text += &format!(
                "[[drives]]\nline = \"bench\"\ndrive = \"{drive}\"\ncontrol = true\nalarms = {{ current = 50 }}\nname = '{drive} \\ \"north\"'\n"
            );
        }
        let file = File::new(name, &text);
        let socket = path(&format!("{name}.sock"));
        let socket = socket.to_str().expect("the path is text");
        let mut daemon = Running::start(&["run", "--config", file.path(), "--socket", socket]);
        for _ in drives {
            daemon.wait_for(r#""event":"connected""#);
        }
        let moving = "atv58@3 \\ \"north\"";
        run(&["start", moving, "--setpoint", "20Hz", "--socket", socket]).assert_done();
        sim.say("atv312@1 trip OCF", "done");
        daemon.wait_for(r#""event":"trip_explained""#);
        sim.say("atv28@2 power off", "done");
        daemon.wait_for(r#""event":"lost""#);
        Self { port, _daemon: daemon, _sim: sim, _file: file }
    }

    fn scrape(&self, accept: &str) -> String {
        get(self.port, "/metrics", accept)
    }
}

/// What a program says to a text on its stdin.
fn said(command: &mut Command, text: &str) -> Output {
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it was there a moment ago");
    let mut input = child.stdin.take().expect("it is piped");
    let text = text.to_owned();
    let writing = std::thread::spawn(move || input.write_all(text.as_bytes()));
    let output = child.wait_with_output().expect("it ends");
    writing.join().expect("it ends").expect("it reads its stdin");
    output
}

/// The metrics of the document with the names of their labels.
fn documented() -> BTreeMap<&'static str, BTreeSet<&'static str>> {
    let rows = DOCUMENT.lines().filter_map(|line| {
        let mut cells = line.strip_prefix("| `")?.split(" | ");
        let name = cells.next()?.trim_end_matches('`');
        Some((name, cells.nth(1)?.split('`').skip(1).step_by(2).collect()))
    });
    rows.collect()
}

/// The metrics of a scrape with the names of their labels, without what belongs to a histogram.
fn scraped(text: &str) -> BTreeMap<&str, BTreeSet<&str>> {
    let mut all = BTreeMap::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let (series, _) = line.rsplit_once(' ').expect("a sample has a value");
        let (name, labels) = series.split_once('{').unwrap_or((series, ""));
        let is_histogram = |name: &&str| text.contains(&format!("# TYPE {name} histogram"));
        let name = ["_bucket", "_sum", "_count"]
            .into_iter()
            .find_map(|end| name.strip_suffix(end).filter(is_histogram))
            .unwrap_or(name);
        let labels = labels.split("=\"").filter_map(|part| part.rsplit(['{', ',', '"']).next());
        let labels = labels.filter(|label| !label.is_empty() && *label != "le" && *label != "}");
        all.entry(name).or_insert_with(BTreeSet::new).extend(labels);
    }
    all
}

#[test]
fn programs_of_others_read_the_metrics_of_five_families() {
    let plant = Plant::start("metrics");
    // Measurements are read behind the first statuses.
    let until = Instant::now() + Duration::from_secs(30);
    let mut text = plant.scrape("text/plain");
    while !text.contains("\ndrived_drive_torque_ratio") && Instant::now() < until {
        text = plant.scrape("text/plain");
    }
    for (what, path) in [("alerts", "/alerts.yml"), ("dashboard", "/grafana.json")] {
        let exported = run(&["export", what]);
        let exported = exported.assert_done();
        let words = exported.split(|letter: char| !letter.is_ascii_lowercase() && letter != '_');
        // What is recorded of other metrics has a colon behind `drived`.
        for name in words.filter(|word| word.starts_with("drived_") && !word.ends_with('_')) {
            assert!(text.contains(&format!("\n{name}")), "nobody scrapes {name} of {what}: {text}");
        }
        let served = get(plant.port, path, "*/*");
        assert_eq!(
            exported.split_whitespace().collect::<String>(),
            served.split_whitespace().collect::<String>()
        );
    }
    let documented = documented();
    for (name, labels) in scraped(&text) {
        assert_eq!(documented.get(name), Some(&labels), "{name}: {text}");
    }
    assert!(text.contains(r#"drive="atv312@1 \\ \"north\"",code="9",mnemonic="OCF"} 1"#), "{text}");
    assert!(text.contains(r#"drived_drive_up{line="bench",drive="atv28@2 \\ \"north\""} 0"#), "{text}");
    if is_there("promtool", &["--version"]) {
        let checked = said(Command::new("promtool").args(["check", "metrics"]), &text);
        assert!(checked.status.success() && checked.stderr.is_empty(), "{checked:?}");
    }
    if let Some(python) = python_with("prometheus_client.openmetrics.parser") {
        const READ: &str = "import sys\n\
            from prometheus_client.openmetrics.parser import text_string_to_metric_families as read\n\
            for family in read(sys.stdin.read()):\n    \
                print(family.type, family.name, len(family.samples))\n    \
                for sample in family.samples:\n        \
                    if sample.name == 'drived_drive_fault': print(sample.labels, sample.value)\n";
        let open = plant.scrape("application/openmetrics-text;version=1.0.0,text/plain;q=0.5");
        let read = said(Command::new(python).args(["-c", READ]), &open);
        assert!(read.status.success(), "{read:?}");
        let read = String::from_utf8(read.stdout).expect("it is text");
        assert!(
            read.contains("info drived_drive 5\n") && read.contains("counter drived_drive_trips 5\n"),
            "{read}"
        );
        let fault = r#"{'line': 'bench', 'drive': 'atv312@1 \\ "north"', 'code': '9', 'mnemonic': 'OCF'} 1"#;
        assert!(read.contains(fault), "{read}");
        assert!(read.contains("histogram drived_line_exchange_duration_seconds 85\n"), "{read}");
    }
}

#[test]
fn every_alert_fires_where_it_should_and_nowhere_else() {
    const RULES: &str = include_str!("../../../drived-http/src/metrics/alerts.yml");
    const TESTS: &str = include_str!("../alerts.test.yml");
    let alerts: Vec<&str> = RULES.lines().filter_map(|line| line.trim().strip_prefix("- alert: ")).collect();
    assert!(alerts.len() > 10, "{alerts:?}");
    for alert in alerts {
        assert!(
            TESTS.contains(&format!("alertname: {alert}, exp_alerts: []")),
            "{alert} is never seen silent"
        );
        let fires = format!("alertname: {alert}\n        exp_alerts:\n");
        assert!(TESTS.contains(&fires), "{alert} is never seen to fire");
    }
    if is_there("promtool", &["--version"]) {
        let tested = Command::new("promtool").args(["test", "rules", "tests/alerts.test.yml"]).output();
        let tested = tested.expect("it was there a moment ago");
        assert!(tested.status.success(), "{}", String::from_utf8_lossy(&tested.stdout));
    }
}
