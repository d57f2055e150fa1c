//! What troubles a drive and what it does: **in the same words on every face at the same moment**.

use std::{path::PathBuf, process::Command, time::Duration};

use axum::{
    Extension, Json, Router,
    body::Body,
    extract::Path,
    http::{Request, header::CONTENT_TYPE},
    routing::get,
};
use drive_core::{Direction, Frequency, StopMode};
use drive_fleet::{ConcernKind, Shows, alarms::AlarmKind};
use drive_testing::peers;
use http_body_util::BodyExt as _;
use serde_json::json;
use tokio::{
    net::TcpListener,
    task::spawn_blocking,
    time::{Instant, sleep},
};
use tower::ServiceExt as _;

use drived_client::{self as client, Target};
use drived_daemon::run;
use drived_doors::{Caller, Rights};
use drived_http::{api, metrics};
use drived_plant::plant::{
    self,
    commands::{Action, LIFETIME, Request as Asked},
    testing::{TestPlant, every_pair_of_troubles},
    views::{DriveView, StateView},
};
use drived_tools::commands::{monitor, report};

/// Every face that shows the drives in text says of the only one of a state what it does and the worst that troubles it.
fn every_face_tells(state: &StateView) {
    let [drive] = &*state.drives else { panic!("{state:?}") };
    let faces = [
        ("status", client::overview_text(state, &Target::All)),
        ("monitor", monitor::screen_of(state.clone())),
        ("run", run::screen_of(&state.drives)),
    ];
    let word = drive.snapshot.shows.to_string();
    let worst = drive.snapshot.concern().map(|concern| concern.text.clone());
    for (face, text) in faces {
        let row =
            text.lines().find(|line| line.contains(drive.name())).unwrap_or_else(|| panic!("{face}: {text}"));
        assert!(row.contains(&word), "{face} says not {word}: {row}");
        assert!(worst.as_ref().is_none_or(|worst| text.contains(worst)), "{face} says not {worst:?}: {text}");
        // Behind the word stands what troubles it, in a sentence.
        let row = worst.as_ref().and_then(|worst| row.split(worst.as_str()).next()).unwrap_or(row);
        for other in Shows::ALL.iter().map(ToString::to_string).filter(|other| !word.contains(other)) {
            let said = format!(" {other} ");
            assert!(!row.contains(&said), "{face} says {other} and not {word}: {row}");
        }
    }
    if let Some(worst) = worst {
        assert_eq!(report::worst_of(drive), worst, "report");
    }
}

/// The rules for a metrics store say the same words, and wake nobody for what is no trouble.
fn the_rules_tell(kind: ConcernKind) {
    let rule = format!("summary: \"{{{{ $labels.name }}}}: {}\"", kind.words());
    let has_rule = metrics::ALERTS.contains(&format!("drived_alarms{{alarm=\"{}\"", kind.word()));
    let is_alarm = AlarmKind::Drive(kind).severity().is_trouble();
    assert_eq!(metrics::ALERTS.contains(&rule), is_alarm, "{rule}");
    assert_eq!(has_rule, is_alarm, "{kind}");
}

fn state_of(drive: DriveView) -> StateView {
    StateView { drives: vec![drive], ..StateView::default() }
}

#[tokio::test(start_paused = true)]
async fn of_every_pair_of_troubles_in_both_orders_every_face_tells_the_same_worst() {
    let pairs = every_pair_of_troubles(Instant::now());
    assert!(pairs.len() > 180, "{}", pairs.len());
    for (known, drive, worst) in pairs {
        assert_eq!(drive.snapshot.concern().map(|concern| &*concern.text), Some(&*worst));
        assert_eq!(drive.snapshot.shows, known.shows());
        the_rules_tell(drive.snapshot.concern().expect("something troubles it").kind);
        every_face_tells(&state_of(drive));
    }
}

#[tokio::test]
async fn of_every_pair_of_troubles_in_both_orders_the_page_tells_the_same_worst() {
    let Some(python) = browser() else { return };
    // All of one moment: a busy machine takes its time, and a text may say how long something has lasted.
    tokio::time::pause();
    let pairs = every_pair_of_troubles(Instant::now()).into_iter();
    let pairs: Vec<_> = pairs
        .map(|(known, drive, worst)| {
            let rank = drive.snapshot.rank();
            json!({"drive": drive, "worst": worst, "rank": rank, "shows": known.shows().to_string()})
        })
        .collect();
    tokio::time::resume();
    let module = async |Path(name): Path<String>| {
        let web = concat!(env!("CARGO_MANIFEST_DIR"), "/../drived-http/src/page/web");
        let text = std::fs::read_to_string(format!("{web}/{name}")).unwrap_or_default();
        ([(CONTENT_TYPE, "text/javascript")], text)
    };
    let served = Router::new().route("/{module}", get(module));
    let served = served.route("/pairs.json", get(async move || Json(pairs.clone())));
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port is free");
    let address = listener.local_addr().expect("it has an address");
    let serving = tokio::spawn(async move { axum::serve(listener, served).await });
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/page.py");
    let arguments = [script.to_owned(), "pairs".to_owned(), format!("http://{address}/")];
    let seen = spawn_blocking(move || Command::new(python).args(arguments).status()).await;
    serving.abort();
    assert!(seen.expect("it ends").expect("the script starts").success(), "the page says something else");
}

/// A Python with Playwright beside a Chromium, or `None` with the reason printed, as in `tests/page.rs`.
fn browser() -> Option<PathBuf> {
    let chromium = peers::is_there(peers::runs("/usr/bin/chromium", &["--version"]), "Chromium");
    peers::python_with("playwright").filter(|_| chromium)
}

fn caller() -> Caller {
    Caller::new("hmi", "test", Rights::ALL)
}

/// The plant as a client of the API reads it now, and what a metrics store scrapes.
async fn told(test: &TestPlant) -> (StateView, String) {
    let told = serde_json::to_value(test.plant.state(&caller())).expect("it is told");
    let state = serde_json::from_value(told).expect("it reads back");
    let router = metrics::serve(api::router(test.plant.clone()), test.plant.clone(), Vec::new());
    let asked = Request::get("/metrics").body(Body::empty()).expect("it is a request");
    let answer = router.layer(Extension(caller())).oneshot(asked).await.expect("it answers");
    let text = answer.into_body().collect().await.expect("it has a body").to_bytes();
    (state, String::from_utf8(text.to_vec()).expect("it is text"))
}

#[tokio::test(start_paused = true)]
async fn through_a_stop_that_is_not_confirmed_every_face_tells_the_same_at_every_moment() {
    let test = TestPlant::of(1).await;
    let drive = test.plant.fleet().drive("pump 1").expect("it is there");
    assert!(drive.set_setpoint(Frequency::from_hertz(50)).await.is_confirmed());
    assert!(drive.start(Direction::Forward).await.is_confirmed());
    sleep(Duration::from_secs(20)).await;
    let stop = Asked {
        expects: None,
        id: None,
        target: plant::commands::Target::All,
        action: Action::Stop(StopMode::Ramp.into()),
        lifetime: LIFETIME,
        arrived: Instant::now(),
    };
    // Its cable is cut while the motor turns.
    test.machines[0].mute();
    test.plant.begin(&caller(), stop).expect("it is carried out");
    let mut seen = Vec::new();
    for moment in 0..120 {
        if moment == 32 {
            test.machines[0].unmute();
        }
        sleep(Duration::from_millis(250)).await;
        let (state, scraped) = told(&test).await;
        every_face_tells(&state);
        let known = &state.drives[0].snapshot;
        for kind in ConcernKind::ALL {
            let series = format!(
                "drived_drive_concern{{line=\"north\",drive=\"pump 1\",concern=\"{}\"}} 1",
                kind.word()
            );
            let troubles = known.concerns.iter().any(|concern| concern.kind == *kind);
            assert_eq!(scraped.contains(&series), troubles, "{series}: {known:?}");
        }
        let shown = (known.shows, known.concern().map(|concern| concern.kind));
        if seen.last() != Some(&shown) {
            seen.push(shown);
        }
    }
    let words = |shows| seen.iter().any(|(shown, _)| *shown == shows);
    let troubled = |kind| seen.iter().any(|(_, concern)| *concern == Some(kind));
    assert!(words(Shows::StopPending) && words(Shows::Lost), "{seen:?}");
    assert!(troubled(ConcernKind::StopPending) && troubled(ConcernKind::StopUnconfirmed), "{seen:?}");
    assert!(matches!(seen.last(), Some((shows, None)) if shows.is_of_the_drive()), "{seen:?}");
}
