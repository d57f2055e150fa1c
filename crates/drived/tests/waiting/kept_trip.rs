//! What the history has of a trip while its line was captured, by the command line. Over a pty, in real time; nothing here asserts a duration.

use std::{
    fs,
    time::{Duration, Instant},
};

use crate::support::{File, Running, Sim, look_again, path, run};
use serde_json::Value;

/// How long something may take to come true: what comes behind a trip is kept ten seconds at a time.
const PATIENCE: Duration = Duration::from_secs(90);

#[test]
fn a_trip_is_one_line_and_has_what_a_capture_of_its_line_has_heard() {
    let mut sim = Sim::serve("kept-trip", &["atv312@1"]);
    let (state, socket) = (path("kept-trip-state"), path("kept-trip.sock"));
    let socket = socket.to_str().expect("the path is text");
    let text = format!(
        "state = \"{}\"\n[http]\nlisten = \"off\"\n[lines.bench]\nport = \"{},19200,8E1\"\n[[drives]]\n\
         line = \"bench\"\ndrive = \"atv312@1\"\nname = \"pump\"\n",
        state.display(),
        sim.link()
    );
    let file = File::new("kept-trip", &text);
    let history = ["history", "pump", "--config", file.path(), "--for", "1h"];
    let mut daemon = Running::start(&["run", "--config", file.path(), "--socket", socket]);
    daemon.wait_for(r#""event":"identified""#);
    let captured = path("kept-trip.pcapng");
    let captured = captured.to_str().expect("the path is text");
    let capture =
        Running::start(&["capture", "bench", "--to", captured, "--seconds", "600", "--socket", socket]);
    while fs::read(captured).map_or(0, |file| file.len()) < 1_000 {
        look_again();
    }
    sim.say("atv312@1 trip OCF", "done");
    daemon.wait_for(r#""event":"trip_explained""#);
    let until = Instant::now() + PATIENCE;
    let frames = loop {
        let told = run(&[&history[..], &["--json"]].concat());
        let frames = told.assert_done().lines().find_map(|line| {
            let told: Value = serde_json::from_str(line).expect("it is JSON");
            told["freeze_frame"]["capture"]["frames"].as_u64()
        });
        if let Some(frames) = frames {
            break frames;
        }
        assert!(Instant::now() < until, "{}", told.out);
        look_again();
    };
    let told = run(&history);
    let trips: Vec<&str> = told.assert_done().lines().filter(|line| line.contains("tripped")).collect();
    let [trip, freeze_frame] = &trips[..] else { panic!("{}", told.out) };
    assert!(trip.contains("event: tripped: 9 OCF: overcurrent (state changed: "), "{trip}");
    assert!(freeze_frame.contains("freeze-frame of tripped: ") && freeze_frame.contains(" frames from "));
    let kept = path("kept-trip-frames.pcapng");
    let kept = kept.to_str().expect("the path is text");
    let to_file = [&history[..], &["--frames-to", kept]].concat();
    assert!(run(&to_file).assert_done().contains(" frames from "));
    run(&to_file).assert_refused(2, "exists");
    let explained = run(&["explain", kept, "--config", file.path(), "--json"]);
    assert!(explained.assert_done().lines().count() as u64 >= frames, "{}", explained.out);
    // Of a time without a trip there are none.
    run(&[
        "history",
        "pump",
        "--config",
        file.path(),
        "--from",
        "2001-01-01 00:00",
        "--for",
        "1h",
        "--frames-to",
        "none.pcapng",
    ])
    .assert_refused(2, "there is no freeze-frame");
    capture.interrupt();
    daemon.interrupt();
    for file in [captured, kept] {
        let _ = fs::remove_file(file);
    }
    let _ = fs::remove_dir_all(&state);
}
