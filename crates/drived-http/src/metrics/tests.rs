//! What a scrape tells of a simulated plant in virtual time, asked as a metrics store asks it.

use std::{collections::BTreeSet, fs, path::Path, time::Duration};

use axum::{Extension, body::Body, http::Request};
use drive_bus::{Line, LineConfig};
use drive_families::{Family, SetUp, simulated};
use drive_fleet::{ConcernKind, DriveSettings, Fleet, alarms::AlarmKind};
use drive_sim::{SimLine, Wiring};
use http_body_util::BodyExt as _;
use tokio::time::sleep;
use tower::ServiceExt as _;

use super::{
    samples::Format,
    table::{Kind, TABLE},
    *,
};
use crate::api;
use drived_doors::{Caller, Rights};
use drived_plant::plant::testing::TestPlant;

/// Where the table of the metrics is written down.
const DOCUMENT: &str = "../drived/docs/metrics.md";

/// The doors' router of a plant, for somebody with these rights.
fn router(plant: &TestPlant, rights: Rights) -> Router {
    let caller = Caller::new("scraper", "page 10.0.0.7", rights);
    let plant = plant.plant.clone();
    serve(api::router(plant.clone()), plant, Vec::new()).layer(Extension(caller))
}

async fn ask(router: &Router, request: Request<Body>) -> (StatusCode, String) {
    let response = router.clone().oneshot(request).await.unwrap();
    let status = response.status();
    let body = response.into_body().collect().await.unwrap().to_bytes();
    (status, String::from_utf8(body.to_vec()).unwrap())
}

async fn get(router: &Router, path: &str) -> (StatusCode, String) {
    ask(router, Request::get(path).body(Body::empty()).unwrap()).await
}

async fn post(router: &Router, path: &str, body: &'static str) -> StatusCode {
    let request = Request::post(path).header("content-type", "application/json");
    ask(router, request.body(Body::from(body)).unwrap()).await.0
}

async fn scrape(plant: &TestPlant) -> String {
    get(&router(plant, Rights::ALL), "/metrics").await.1
}

/// The value of a series; `None` where it is absent.
fn value(text: &str, series: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(series)?.strip_prefix(' '))?;
    Some(line.parse().expect("a sample ends with its value"))
}

/// The series of a metric.
fn series<'a>(text: &'a str, metric: &str) -> Vec<&'a str> {
    let of = |line: &&str| line.strip_prefix(metric).is_some_and(|rest| rest.starts_with(['{', ' ']));
    text.lines().filter(of).collect()
}

#[tokio::test(start_paused = true)]
async fn a_running_drive_is_told_in_base_units() {
    let plant = TestPlant::of(1).await;
    let doors = router(&plant, Rights::ALL);
    let body = r#"{"setpoint": {"frequency_hz": 30.5}, "until": "at_reference"}"#;
    assert_eq!(post(&doors, "/api/v1/drives/pump%201/start?wait=30s", body).await, StatusCode::OK);
    sleep(Duration::from_secs(30)).await;
    let text = get(&doors, "/metrics").await.1;
    let of =
        |metric: &str| value(&text, &format!("drived_drive_{metric}{{line=\"north\",drive=\"pump 1\"}}"));
    assert_eq!((of("up"), of("trips_total")), (Some(1.0), Some(0.0)), "{text}");
    assert_eq!(of("setpoint_hertz"), Some(30.5));
    // The machine's own slip and resolution are no matter of the metric.
    assert!(of("output_frequency_hertz").is_some_and(|hertz| (hertz - 30.5).abs() < 0.2), "{text}");
    let shown = plant.machines[0].observe();
    assert_eq!(of("output_frequency_hertz"), Some(f64::from(shown.output_frequency) / 100.0));
    assert!(of("motor_speed_rpm").is_some_and(|rpm| rpm > 500.0), "{text}");
    assert!(of("line_voltage_volts").is_some_and(|volts| volts > 300.0), "{text}");
    assert!(of("torque_ratio").is_some_and(|torque| torque.abs() < 2.0), "{text}");
    let states = series(&text, "drived_drive_state");
    assert_eq!(states.len(), 9, "every state is told: {text}");
    let in_force: Vec<_> = states.into_iter().filter(|state| state.ends_with(" 1")).collect();
    assert_eq!(in_force, ["drived_drive_state{line=\"north\",drive=\"pump 1\",state=\"running\"} 1"]);
    let command = "drived_commands_total{line=\"north\",drive=\"pump 1\",action=\"start\",outcome=\"confirmed\",origin=\"page\"}";
    assert_eq!(value(&text, command), Some(1.0), "{text}");
    assert_eq!(value(&text, "drived_line_up{line=\"north\"}"), Some(1.0));
}

#[tokio::test(start_paused = true)]
async fn what_a_lost_drive_showed_last_is_absent() {
    let plant = TestPlant::of(2).await;
    sleep(Duration::from_secs(15)).await;
    let metric = |name: &str, drive| format!("drived_drive_{name}{{line=\"north\",drive=\"pump {drive}\"}}");
    let before = scrape(&plant).await;
    assert_eq!(value(&before, &metric("output_frequency_hertz", 1)), Some(0.0));
    plant.machines[0].mute();
    sleep(Duration::from_secs(10)).await;
    let text = scrape(&plant).await;
    assert_eq!(value(&text, &metric("up", 1)), Some(0.0), "{text}");
    assert_eq!(value(&text, &metric("lost_total", 1)), Some(1.0));
    let of = |drive| {
        let of_drive = |line: &&str| {
            line.contains(&format!("drive=\"pump {drive}\"")) && !line.starts_with("drived_line_")
        };
        let names = text.lines().filter(of_drive).filter_map(|line| line.split('{').next());
        names.collect::<BTreeSet<_>>()
    };
    let values = [
        "drived_drive_output_frequency_hertz",
        "drived_drive_state",
        "drived_drive_motor_current_amperes",
        "drived_drive_motor_speed_rpm",
        "drived_drive_line_voltage_volts",
        "drived_drive_running_seconds_total",
        "drived_drive_in_control",
    ];
    for name in values {
        assert!(of(2).contains(name), "{name} of a drive that answers: {text}");
        assert!(!of(1).contains(name), "{name} of a drive that is lost: {text}");
    }
    for name in ["drived_drive_last_answer_timestamp_seconds", "drived_drive_info"] {
        assert!(of(1).contains(name), "{name}: {text}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_tripped_drive_has_its_mnemonic_until_its_fault_is_reset() {
    let plant = TestPlant::of(1).await;
    assert_eq!(series(&scrape(&plant).await, "drived_drive_fault"), [""; 0]);
    plant.machines[0].trip(9);
    sleep(Duration::from_secs(3)).await;
    let text = scrape(&plant).await;
    // BBV51701, fault codes of LFT: 9 = overcurrent OCF.
    let fault = "drived_drive_fault{line=\"north\",drive=\"pump 1\",code=\"9\",mnemonic=\"OCF\"} 1";
    assert_eq!(series(&text, "drived_drive_fault"), [fault], "{text}");
    assert_eq!(value(&text, "drived_drive_trips_total{line=\"north\",drive=\"pump 1\"}"), Some(1.0));
    let doors = router(&plant, Rights::ALL);
    assert_eq!(post(&doors, "/api/v1/drives/pump%201/reset?wait=20s", "{}").await, StatusCode::OK);
    sleep(Duration::from_secs(3)).await;
    let text = scrape(&plant).await;
    assert_eq!(series(&text, "drived_drive_fault"), [""; 0], "{text}");
    assert_eq!(value(&text, "drived_drive_trips_total{line=\"north\",drive=\"pump 1\"}"), Some(1.0));
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_not_confirmed_is_seen_and_one_that_is_has_its_time_counted() {
    let plant = TestPlant::of(1).await;
    let doors = router(&plant, Rights::ALL);
    assert_eq!(post(&doors, "/api/v1/drives/pump%201/start", "{}").await, StatusCode::OK);
    plant.machines[0].mute();
    assert_eq!(
        post(&doors, "/api/v1/drives/pump%201/stop?wait=10s", "{}").await,
        StatusCode::GATEWAY_TIMEOUT
    );
    sleep(Duration::from_secs(5)).await;
    let text = get(&doors, "/metrics").await.1;
    let unconfirmed = "drived_drive_stop_unconfirmed{line=\"north\",drive=\"pump 1\"}";
    assert_eq!(value(&text, unconfirmed), Some(1.0), "{text}");
    assert!(!series(&text, "drived_drive_stop_pending_seconds").is_empty(), "{text}");
    assert_eq!(value(&text, "drived_stop_confirm_seconds_count"), Some(0.0), "{text}");
    plant.machines[0].unmute();
    sleep(Duration::from_secs(30)).await;
    assert_eq!(post(&doors, "/api/v1/drives/pump%201/stop?wait=20s", "{}").await, StatusCode::OK);
    let text = get(&doors, "/metrics").await.1;
    assert_eq!(value(&text, unconfirmed), Some(0.0), "{text}");
    assert_eq!(value(&text, "drived_stop_confirm_seconds_count"), Some(1.0), "{text}");
    assert_eq!(value(&text, "drived_stop_confirm_seconds_bucket{le=\"10.0\"}"), Some(1.0), "{text}");
}

#[tokio::test(start_paused = true)]
async fn who_may_not_view_sees_no_metrics() {
    let plant = TestPlant::of(1).await;
    let (status, text) = get(&router(&plant, Rights::NONE), "/metrics").await;
    assert_eq!(status, StatusCode::FORBIDDEN, "{text}");
    assert!(!text.contains("pump"), "{text}");
}

#[tokio::test(start_paused = true)]
async fn each_format_says_its_content_type() {
    let plant = TestPlant::of(1).await;
    let doors = router(&plant, Rights::ALL);
    for (accept, kind, ends) in [
        ("application/openmetrics-text", "application/openmetrics-text; version=1.0.0; charset=utf-8", true),
        ("*/*", "text/plain; version=0.0.4; charset=utf-8", false),
    ] {
        let request = Request::get("/metrics").header("accept", accept).body(Body::empty()).unwrap();
        let response = doors.clone().oneshot(request).await.unwrap();
        assert_eq!(response.headers()[CONTENT_TYPE], kind);
        let body = response.into_body().collect().await.unwrap().to_bytes();
        assert_eq!(body.ends_with(b"# EOF\n"), ends);
    }
}

#[tokio::test(start_paused = true)]
async fn requests_are_counted_by_the_template_of_their_path() {
    let plant = TestPlant::of(1).await;
    let doors = router(&plant, Rights::ALL);
    for path in
        ["/api/v1/drives/pump%201", "/api/v1/drives/nobody", "/api/v1/drives/no%20one", "/nowhere/at/all"]
    {
        let _ = get(&doors, path).await;
    }
    let text = get(&doors, "/metrics").await.1;
    let counted = |route: &str, code: u16| {
        let labels = format!("{{route=\"{route}\",method=\"GET\",code=\"{code}\"}}");
        value(&text, &format!("drived_http_requests_total{labels}"))
    };
    assert_eq!(counted("/api/v1/drives/{name}", 200), Some(1.0), "{text}");
    assert_eq!(counted("/api/v1/drives/{name}", 404), Some(2.0), "{text}");
    assert_eq!(counted("none", 404), Some(1.0), "{text}");
    assert!(!text.contains("nobody") && !text.contains("nowhere"), "{text}");
}

#[tokio::test(start_paused = true)]
async fn exchanges_are_counted_by_the_bounds_of_the_wire() {
    let plant = TestPlant::of(1).await;
    sleep(Duration::from_secs(60)).await;
    let text = scrape(&plant).await;
    let series = |suffix: &str, more: &str| {
        let name = format!("drived_line_exchange_duration_seconds{suffix}");
        value(&text, &format!("{name}{{line=\"north\",drive=\"pump 1\"{more}}}"))
    };
    let count = series("_count", "").expect("there were exchanges");
    assert!(count > 50.0, "{text}");
    assert_eq!(series("_bucket", ",le=\"+Inf\""), Some(count));
    // 19200 bit/s and 11 bits a character: no request of 8 characters and answer of 7 fits into 8 ms.
    assert_eq!(series("_bucket", ",le=\"0.008\""), Some(0.0), "{text}");
    assert_eq!(series("_bucket", ",le=\"1.0\""), Some(count), "{text}");
    let answered = "drived_line_exchanges_total{line=\"north\",drive=\"pump 1\",result=\"answered\"}";
    let exceptions = answered.replace("answered", "exception");
    let ended = value(&text, answered).zip(value(&text, &exceptions)).map(|(one, other)| one + other);
    assert_eq!(ended, Some(count), "{text}");
}

#[test]
fn names_follow_the_rules_of_prometheus() {
    let mut names = BTreeSet::new();
    for metric in TABLE {
        let name = metric.name;
        assert!(names.insert(name), "{name} is there twice");
        let is_snake = |text: &str| text.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_');
        assert!(is_snake(name) && metric.labels.iter().all(|label| is_snake(label)), "{name}");
        assert!(name.starts_with("drived_") || name.starts_with("process_"), "{name}");
        assert_eq!(name.ends_with("_total"), metric.kind == Kind::Counter, "{name}");
        assert_eq!(name.ends_with("_info"), metric.kind == Kind::Info, "{name}");
        assert!(!["_count", "_sum", "_bucket"].iter().any(|end| name.ends_with(end)), "{name}");
        for unit in ["hours", "minutes", "milliseconds", "kilowatts", "percent", "celsius"] {
            assert!(!name.contains(unit), "{name} is in no base unit");
        }
        assert!(
            metric.help.ends_with('.') && !metric.help.contains(['\\', '"', '\n']),
            "{name}: {}",
            metric.help
        );
        let of_drive = metric.labels.starts_with(&["line", "drive"]);
        assert!(of_drive || !name.starts_with("drived_drive_"), "{name}");
    }
}

/// The table as the document has it.
fn table() -> String {
    let mut text = "| Metric | Type | Labels | What it tells |\n|---|---|---|---|\n".to_owned();
    for metric in TABLE {
        let kind = match metric.kind {
            Kind::Gauge => "gauge".to_owned(),
            Kind::Counter => "counter".to_owned(),
            Kind::Info => "info".to_owned(),
            Kind::Histogram(bounds) => {
                let ends = bounds.first().zip(bounds.last()).expect("a histogram has bounds");
                format!("histogram, {} bounds from {:?} to {:?}", bounds.len(), ends.0, ends.1)
            }
        };
        let labels = metric.labels.iter().map(|label| format!("`{label}`")).collect::<Vec<_>>().join(", ");
        text += &format!("| `{}` | {kind} | {labels} | {} |\n", metric.name, metric.help);
    }
    text
}

/// Where it is not, `DRIVED_WRITE=1` writes it there.
#[test]
fn the_document_has_the_table_of_the_code() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(DOCUMENT);
    let document = fs::read_to_string(&path).expect("the document is there");
    let (before, rest) = document.split_once("| Metric |").expect("it has a table");
    let after = rest.split_once("\n\n").map_or("", |(_, after)| after);
    let wanted = format!("{before}{}\n{after}", table());
    if std::env::var_os("DRIVED_WRITE").is_some() {
        fs::write(&path, wanted).expect("it can be written");
        return;
    }
    assert_eq!(document, wanted, "DRIVED_WRITE=1 writes the table anew");
}

/// What three thousand drives cost in one process, for the section on many hosts:
/// `cargo test --release -p drived --bin drived three_thousand -- --ignored --nocapture`.
#[tokio::test(start_paused = true)]
#[ignore = "measures, and asserts nothing that a test should"]
async fn three_thousand_drives_are_scraped_and_what_that_costs_is_printed() {
    const LINES: usize = 97;
    const LOOKS: u32 = 5;
    let mut builder = Fleet::builder().whatever_the_plan();
    for number in 0..LINES {
        let family = Family::BUILT_IN[number % Family::BUILT_IN.len()];
        let settings = family.capabilities().factory;
        let (line, name) = (SimLine::new(Wiring::rtu(settings)), format!("line {number}"));
        for slave in 1..=31 {
            line.add_boxed(slave, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
        }
        builder = builder.line(&*name, Line::over(line.in_memory(), LineConfig::stream(settings)));
        for slave in 1..=31 {
            let drive = DriveSettings::watched(format!("drive {number}.{slave}"));
            builder = builder.drive(&name, slave, drive, |port, slave| {
                family.open_with(port, slave, &simulated::options())
            });
        }
    }
    let plant = Plant::start(builder.start().unwrap(), Vec::new(), false);
    sleep(Duration::from_secs(10)).await;
    let (revision, time) = (plant.revisions().last(), Duration::from_secs(10));
    sleep(time).await;
    let drives = plant.drives().len();
    let told = plant.revisions().last() - revision;
    let metrics = Metrics { plant, sources: Vec::new(), began: (0, Instant::now()), turn: Mutex::default() };
    let began = std::time::Instant::now();
    let texts = [(); LOOKS as usize].map(|()| metrics.samples().text(Format::Text));
    let took = began.elapsed() / LOOKS;
    let text = &texts[0];
    let series = text.lines().filter(|line| !line.starts_with('#')).count();
    let up = text.lines().filter(|line| line.starts_with("drived_drive_up{") && line.ends_with(" 1")).count();
    println!(
        "{LINES} lines, {drives} drives, {up} of them answer: {series} series, {:.1} a drive; {} KiB, {} bytes a series;\n\
         a scrape takes {:.1} ms, which each 15 s is {:.5} of a processor, {:.1} µs a drive;\n\
         {:.1} revisions a second while nothing moves, {:.2} a drive",
        series as f64 / drives as f64,
        text.len() >> 10,
        text.len() / series,
        took.as_secs_f64() * 1e3,
        took.as_secs_f64() / 15.0,
        took.as_secs_f64() * 1e6 / drives as f64,
        told as f64 / time.as_secs_f64(),
        told as f64 / time.as_secs_f64() / drives as f64,
    );
}

/// The rules of the alarms, as the fleet's table has them.
fn rules_of_the_table() -> String {
    let camel =
        |word: &str| word.split('_').map(|part| part[..1].to_uppercase() + &part[1..]).collect::<String>();
    let mut rules = String::new();
    for kind in AlarmKind::all() {
        // One that is shelved, or for which another stands, wakes nobody; one that is acknowledged is so all the same.
        let has = format!(
            "max without (state) (drived_alarms{{alarm=\"{}\",state=~\"unacknowledged|acknowledged\"}})",
            kind.word()
        );
        let expr = match kind {
            AlarmKind::Drive(ConcernKind::Tripped) => format!(
                "|\n          {has} * on (instance, line, drive) group_left (code, mnemonic) drived_drive_fault\n          \
                 or ({has} unless on (instance, line, drive) drived_drive_fault)"
            ),
            _ => has,
        };
        // A line that is busy for a moment wakes nobody.
        let lasts = match kind {
            AlarmKind::Drive(ConcernKind::LostRunning) => "        for: 10s\n",
            AlarmKind::Drive(ConcernKind::Lost) | AlarmKind::LineAway => "        for: 30s\n",
            AlarmKind::Drive(ConcernKind::Stale) => "        for: 1m\n",
            _ => "",
        };
        let whose = match kind {
            AlarmKind::Drive(_) | AlarmKind::Maintenance => "{{ $labels.name }}",
            AlarmKind::LineAway | AlarmKind::LineSilent | AlarmKind::LineFinding => "line {{ $labels.name }}",
            _ => "{{ $labels.instance }}",
        };
        let severity = if kind.wakes() { "page" } else { "warning" };
        rules += &format!(
            "      - alert: Drived{}\n        expr: {expr}\n{lasts}        labels: {{ severity: {severity} }}\n        \
             annotations:\n          summary: \"{whose}: {}\"\n          description: \"What to do first: {}.\"\n\n",
            camel(kind.word()),
            kind.words(),
            kind.remedy()
        );
    }
    rules
}

#[test]
fn the_rules_for_alarms_are_those_of_the_fleets_table() {
    let (_, rest) = ALERTS.split_once("made from the fleet's own table, and kept so by a test.\n\n").unwrap();
    let (rules, _) =
        rest.split_once("      # What else troubles a drive, a line, a broker or the program.\n").unwrap();
    assert_eq!(rules, rules_of_the_table());
}

#[tokio::test(start_paused = true)]
async fn an_alarm_is_told_by_its_kind_where_it_is_in_its_life() {
    let plant = TestPlant::of(2).await;
    plant.machines[0].trip(9);
    sleep(Duration::from_secs(5)).await;
    let of = |state: &str| {
        format!(
            "drived_alarms{{line=\"north\",drive=\"pump 1\",name=\"pump 1\",alarm=\"tripped\",state=\"{state}\"}}"
        )
    };
    let text = scrape(&plant).await;
    assert_eq!(series(&text, "drived_alarms").len(), 1, "{text}");
    assert_eq!(value(&text, &of("unacknowledged")), Some(1.0), "{text}");
    let id = plant.plant.alarms().alarms[0].alarm.id;
    let doors = router(&plant, Rights::ALL);
    assert_eq!(post(&doors, &format!("/api/v1/alarms/{id}/acknowledge"), "{}").await, StatusCode::OK);
    let text = scrape(&plant).await;
    assert_eq!((value(&text, &of("unacknowledged")), value(&text, &of("acknowledged"))), (None, Some(1.0)));
    assert_eq!(value(&text, "drived_alarms_dropped_total"), Some(0.0));
}
