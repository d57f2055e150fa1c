//! On histories that are written by hand.

use drived_config::testing::Folder;

use super::{Certainty, NIGHT_MS, Says as _, Story, Written, fault, on_wall, tell};
use crate::{
    record::{Kind, Moment, Record},
    store,
    write::{archive::Archive, inbox::Batch},
};

#[test]
fn a_trip_by_the_watchdog_behind_a_cut_line_is_told_by_the_silence_and_never_by_the_mains() {
    let folder = Folder::new("history-night-watchdog");
    let mut store = store::open(&folder.file("history.sqlite")).unwrap().store;
    let on_wall = |steady_ms| Moment { steady_ms, wall_ms: NIGHT_MS + steady_ms };
    let mut archive = Archive::begin(on_wall(0));
    archive.begin_run(&mut store.connection, "test").unwrap();
    let mut event = |at, drive: &str, what: &str, text: &str, body| {
        let record = Record::of_history(on_wall(at), what, text);
        let (drive, line) = (Some(drive.to_owned()), Some("north".to_owned()));
        archive.record(Record { kind: Kind::Event, drive, line, body, ..record });
    };
    for drive in ["pump 1", "pump 2", "pump 3"] {
        event(100_000, drive, "lost", "lost for 2.0 s: no answer", None);
    }
    for drive in ["pump 1", "pump 2", "pump 3"] {
        event(123_000, drive, "tripped", "tripped, found so", fault(false, true));
        let text = "trip explained, found so by its communication watchdog: 5 SLF: Modbus communication interruption";
        event(123_200, drive, "trip_explained", text, fault(true, true));
    }
    archive.end_run(&mut store.connection, on_wall(200_000)).unwrap();
    let story = tell(&store.connection, "pump 3", NIGHT_MS + 123_000).unwrap();
    assert!(story.about.as_ref().unwrap().text.contains("5 SLF"), "{story:?}");
    let (seen, likely) = (story.why(Certainty::Seen), story.why(Certainty::Likely));
    assert!(
        seen.contains("nothing had been heard of it before")
            && seen.contains("pump 1, pump 2 of its line fell silent with it"),
        "{story:?}"
    );
    assert!(
        likely.contains("the cable, its adapter, or the supply") && !likely.contains("mains"),
        "{story:?}"
    );
}

#[test]
fn a_motor_that_another_master_starts_is_not_answered_with_the_setpoint_of_before() {
    for seconds in [4, 40, 330] {
        let mut night = Written::begin(&format!("other-start-{seconds}"));
        let at = 400_000;
        night.asked(at - 1_000 * seconds, "setpoint", "setpoint 20.00 Hz by anna from http: confirmed");
        night.changed(at + 800, "ready", "running", "drive");
        night.event(at + 800, "control_returned", "control returned", None);
        let story = night.told(at);
        assert_eq!(story.about.as_ref().unwrap().text, "state changed: ready to running");
        let seen = story.why(Certainty::Seen);
        assert!(seen.contains("nobody here asked for it") && !seen.contains("asked for here"), "{story:?}");
        assert!(story.why(Certainty::NotKnown).contains("another master"), "{story:?}");
        assert!(story.course().contains("ready to running"), "{story:?}");
    }
}

#[test]
fn the_moment_that_is_asked_for_is_answered_and_not_the_heaviest_of_the_minutes_around() {
    let night = |name: &str| {
        let mut night = Written::begin(name);
        night.heard_for(900);
        night.event(260_000, "tripped", "tripped: 16 OHF: drive overheating", None);
        night.changed(270_000, "fault", "ready", "drive");
        night.event(
            270_000,
            "fault_cleared",
            "fault cleared",
            Some(serde_json::json!({ "cause": { "by": "drive" } })),
        );
        night.asked(302_100, "setpoint", "setpoint 12.00 Hz by bert from http: confirmed");
        night.asked(350_500, "stop", "ramp stop by bert from http: confirmed");
        night.changed(350_700, "running", "stopping", "command");
        night
    };
    let setpoint = night("asked-setpoint").told(302_000);
    assert!(setpoint.about.as_ref().unwrap().text.starts_with("setpoint 12.00 Hz by bert"), "{setpoint:?}");
    let seen = setpoint.why(Certainty::Seen);
    assert!(seen.contains("before it, 42.1 s away: tripped: 16 OHF"), "{setpoint:?}");
    let stop = night("asked-stop").told(350_000);
    assert!(stop.why(Certainty::Seen).contains("bert asked for it"), "{stop:?}");
    let cleared = night("asked-cleared").told(269_500);
    assert_eq!(cleared.about.as_ref().unwrap().text, "fault cleared");
    assert!(cleared.why(Certainty::Seen).contains("nobody here asked for it"), "{cleared:?}");
    // Nothing happened then.
    let quiet = night("asked-quiet").told(325_000);
    assert_eq!(quiet.about, None, "{quiet:?}");
    let seen = quiet.why(Certainty::Seen);
    assert!(seen.contains("next before it, 22.9 s away: setpoint 12.00 Hz"), "{quiet:?}");
    assert!(seen.contains("next after it, 25.5 s away: ramp stop by bert"), "{quiet:?}");
    // A whole minute means that minute.
    assert!(night("asked-minute").told(240_000).about.is_some_and(|about| about.text.starts_with("tripped")));
}

#[test]
fn two_that_were_found_tripped_did_not_trip_together_as_far_as_anybody_knows() {
    let mut night = Written::begin("found-together");
    let body = || fault(false, true).map(|body| serde_json::from_str(&body).unwrap());
    night.event(300_000, "tripped", "tripped, found so", body());
    night.kept(Kind::Event, Some("pump 2"), 300_100, "tripped", "tripped, found so", body());
    let story = night.told(300_000);
    assert_eq!(story.why(Certainty::Likely), "", "{story:?}");
    let open = story.why(Certainty::NotKnown);
    assert!(open.contains("found tripped too: pump 2; whether at the same time is not known"), "{story:?}");
}

#[test]
fn what_was_read_before_a_kill_and_is_lost_is_not_told_as_never_read() {
    let mut night = Written::begin("kill-words");
    night.event(200_000, "connected", "connected: running", None);
    night.killed_until(300_000);
    night.event(301_000, "connected", "connected: running", None);
    let story = night.told(250_500);
    assert_eq!(story.about, None, "{story:?}");
    let open: Vec<&str> = story.not_known.iter().map(|one| &*one.text).collect();
    assert!(open.iter().any(|text| text.contains("up to a minute may be missing")), "{open:?}");
    assert!(!open.iter().any(|text| text.contains("nothing was read")), "{open:?}");
}

#[test]
fn a_stop_and_a_trip_within_one_poll_have_no_order_unless_the_drive_was_seen_between_them() {
    let mut night = Written::begin("one-poll");
    night.asked(299_850, "stop", "ramp stop by bert from http: confirmed");
    night.event(300_000, "tripped", "tripped: 0 OC: overcurrent", None);
    let story = night.told(299_500);
    assert!(!story.why(Certainty::Seen).contains("shortly before"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("at about the same time"), "{story:?}");
    let mut seen = Written::begin("two-polls");
    seen.asked(299_100, "stop", "ramp stop by bert from http: confirmed");
    seen.changed(299_500, "running", "stopping", "command");
    seen.event(300_000, "tripped", "tripped: 18 ObF: DC bus overvoltage", None);
    let story = seen.told(299_500);
    assert!(
        story.why(Certainty::Seen).contains("shortly before it somebody had asked: ramp stop"),
        "{story:?}"
    );
}

#[test]
fn a_drive_that_falls_silent_seconds_later_did_not_fall_silent_with_it() {
    let mut night = Written::begin("silent-later");
    let lost = || Some(serde_json::json!({ "silent_for_ms": 1_400 }));
    night.event(300_000, "lost", "lost for 1.4 s: no answer", lost());
    night.kept(Kind::Event, Some("pump 2"), 305_900, "lost", "lost for 1.4 s: no answer", lost());
    let story = night.told(299_000);
    assert!(story.about.as_ref().unwrap().text.starts_with("lost"), "{story:?}");
    assert!(!story.why(Certainty::Seen).contains("fell silent with it"), "{story:?}");
    assert_eq!(story.why(Certainty::Likely), "", "{story:?}");
}

#[test]
fn a_line_on_which_nothing_is_heard_is_not_told_as_a_port_that_is_away() {
    for (detail, is_away) in
        [("nothing was heard for 8.0 s, whoever was asked", false), ("there is no serial port", true)]
    {
        let mut night = Written::begin(&format!("away-{is_away}"));
        night.event(300_000, "lost", "lost for 1.4 s: no answer", None);
        let body = serde_json::json!({ "kind": "line_away", "detail": detail });
        let text = format!("the port of the line is away, none of its drives can be reached: {detail}");
        night.kept(Kind::Alarm, None, 301_000, "unacknowledged", &text, Some(body));
        let story = night.told(299_000);
        assert_eq!(
            story.why(Certainty::Seen).contains("the port of the line was away"),
            is_away,
            "{story:?}"
        );
    }
}

#[test]
fn a_setting_that_was_written_here_stands_beside_what_happened_then() {
    let mut night = Written::begin("setting");
    for (at, word, text) in [(100_000, 30, "3.0 s"), (295_000, 2, "0.2 s")] {
        let read = drived_plant::plant::past::ParameterRead {
            drive: "pump 1".into(),
            address: 9002,
            code: "dEC",
            word,
            text: text.to_owned(),
        };
        let settings = vec![crate::record::Setting { wall_ms: NIGHT_MS + at, read }];
        night.archive.take(Batch { settings, ..Batch::default() }, on_wall(at));
    }
    night.event(300_000, "tripped", "tripped: 18 ObF: DC bus overvoltage", None);
    let story = night.told(300_000);
    assert!(story.why(Certainty::Seen).contains("dEC was read, or written, as 0.2 s"), "{story:?}");
    let course = story.course();
    assert!(
        course.starts_with("its setting dEC was read, or written, as 0.2 s; it was 3.0 s\ntripped"),
        "{course}"
    );
}

/// A backup reads every register.
#[test]
fn settings_that_were_only_read_for_the_first_time_do_not_bury_what_happened() {
    for (read_at_once, sentences) in [(4_u16, 4), (170, 1)] {
        let mut night = Written::begin(&format!("settings-{read_at_once}"));
        let settings = (0..read_at_once).map(|address| crate::record::Setting {
            wall_ms: NIGHT_MS + 295_000 + i64::from(address),
            read: drived_plant::plant::past::ParameterRead {
                drive: "pump 1".into(),
                address,
                code: "dEC",
                word: 30,
                text: "3.0 s".to_owned(),
            },
        });
        night.archive.take(Batch { settings: settings.collect(), ..Batch::default() }, on_wall(296_000));
        night.event(300_000, "tripped", "tripped: 18 ObF: DC bus overvoltage", None);
        let course = night.told(300_000).course();
        let told = course.lines().filter(|line| line.contains("not recorded")).count();
        assert_eq!(told, sentences, "{course}");
        assert_eq!(course.contains("170 of its settings were read"), read_at_once == 170, "{course}");
        assert!(course.contains("tripped"), "{course}");
    }
}

#[test]
fn that_nobody_asked_is_told_only_where_nothing_is_missing() {
    let is_sure = |story: &Story| story.why(Certainty::Seen).contains("nobody here asked for it");
    let is_open = |story: &Story| {
        story.why(Certainty::NotKnown).contains("whether somebody here asked for it is not known")
    };
    let mut whole = Written::begin("whole");
    whole.stops(300_000);
    let story = whole.told(300_000);
    assert!(is_sure(&story) && !is_open(&story), "{story:?}");

    let mut hole = Written::begin("hole");
    let lost = crate::write::inbox::Lost { values: 0, records: 3 };
    let batch = Batch { lost, ..Batch::default() };
    hole.archive.take(batch, on_wall(295_000));
    hole.stops(300_000);
    hole.archive.write_records(&mut hole.store.connection, on_wall(301_000)).unwrap();
    let story = hole.told(300_000);
    assert!(is_open(&story) && !is_sure(&story), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("records could not be kept"), "{story:?}");

    // Readings that were not kept hide no command.
    let mut readings = Written::begin("readings");
    let lost = crate::write::inbox::Lost { values: 3, records: 0 };
    let batch = Batch { lost, ..Batch::default() };
    readings.archive.take(batch, on_wall(295_000));
    readings.stops(300_000);
    readings.archive.write_records(&mut readings.store.connection, on_wall(301_000)).unwrap();
    assert!(is_sure(&readings.told(300_000)));

    let mut killed = Written::begin("behind-kill");
    killed.event(200_000, "connected", "connected: running", None);
    killed.killed_until(299_000);
    killed.stops(300_000);
    let story = killed.told(300_000);
    assert!(is_open(&story) && !is_sure(&story), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("this program had been killed"), "{story:?}");

    let mut first = Written::begin("first");
    first.stops(2_000);
    let story = first.told(2_000);
    assert!(is_open(&story) && !is_sure(&story), "nothing is known of before: {story:?}");
}

#[test]
fn a_trip_that_was_not_explained_is_not_told_as_if_the_drive_had_said_why() {
    let mut night = Written::begin("unexplained");
    night.event(
        300_000,
        "tripped",
        "tripped",
        fault(false, false).map(|body| serde_json::from_str(&body).unwrap()),
    );
    let story = night.told(300_000);
    assert!(!story.why(Certainty::Said).contains("what it tripped by"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("by what was not read"), "{story:?}");
}

#[test]
fn what_the_drive_itself_keeps_of_its_faults_is_told_with_the_trip() {
    let mut night = Written::begin("own-record");
    night.event(300_000, "tripped", "tripped: 18 ObF: DC bus overvoltage", None);
    let text = "its own record of faults, in its own order: 18 ObF: DC bus overvoltage; 5 SLF: Modbus";
    night.event(300_500, "fault_record", text, None);
    let story = night.told(300_000);
    assert!(story.why(Certainty::Said).contains("5 SLF: Modbus"), "{story:?}");
}

#[test]
fn an_output_that_left_its_setpoint_without_a_command_is_a_fact_with_what_may_be_behind_it() {
    let mut night = Written::begin("departed");
    let text = "output left its setpoint of 30.00 Hz without a command of here: it is at 18.00 Hz";
    night.event(300_000, "output_departed", text, None);
    let story = night.told(300_000);
    assert_eq!(story.about.as_ref().unwrap().text, text);
    assert!(story.why(Certainty::Seen).contains("nobody here asked for it"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("a limit of current or torque"), "{story:?}");
}

#[test]
fn a_watchdog_that_acted_while_this_program_was_dead_is_told_by_that() {
    let mut night = Written::begin("dead");
    night.event(200_000, "connected", "connected: running", None);
    night.killed_until(300_000);
    let found = serde_json::json!({ "fault": { "by_watchdog": true, "found": true } });
    let text = "tripped, found so by its communication watchdog: 5 SLF: Modbus communication interruption";
    night.event(301_000, "tripped", text, Some(found));
    let story = night.told(301_000);
    let likely = story.why(Certainty::Likely);
    assert!(likely.contains("this program had been killed, so that nobody here spoke to it"), "{story:?}");
    assert!(story.why(Certainty::NotKnown).contains("when that happened is not known"), "{story:?}");
}
