use std::fs;

use drive_core::{Direction, Lease, StopMode};

use super::*;
use crate::testing::Folder;

const ONE: &str = "/dev/ttyUSB0 atv312@1";
const TWO: &str = "/dev/ttyUSB0 atv312@2";
const THREE: &str = "/dev/ttyUSB0 atv312@3";

fn places(drives: &[(&str, &str)]) -> Places {
    let drives = drives.iter().map(|(name, place)| ((*name).to_owned(), Place::from(*place)));
    drives.collect::<Places>().after([ONE, TWO].map(Place::from))
}

fn record(stop: Option<StopMode>) -> RunRecord {
    let lease = Lease::new(Direction::Forward, 15);
    let mut record = serde_json::json!({ "identity": "ATV312HU22N4", "lease": lease });
    if let Some(stop) = stop {
        record["stop"] = serde_json::json!(stop);
    }
    serde_json::from_value(record).unwrap()
}

#[test]
fn what_was_kept_is_known_after_a_kill_and_half_a_file_says_nothing() {
    let folder = Folder::new("records");
    let file = folder.file("state/runs.json");
    let open = || Records::<RunRecord>::open(Some(&file), &places(&[("pump 1", ONE)]));
    let records = open();
    let run = record(None);
    assert!(records.set(&ONE.into(), "pump 1", Some(run.clone())));
    assert!(!records.set(&ONE.into(), "pump 1", Some(run.clone())), "nothing is written twice");
    records.write();
    // The program was killed.
    let records = open();
    assert_eq!((records.of(&ONE.into()), records.of(&TWO.into())), (Some(run), None));
    assert!(
        records.call(&ONE.into(), "mixer")
            && !records.call(&ONE.into(), "mixer")
            && !records.call(&TWO.into(), "mixer")
    );
    assert!(records.set(&ONE.into(), "mixer", None) && !records.set(&ONE.into(), "mixer", None));
    records.write();
    assert_eq!(open().of(&ONE.into()), None);
    fs::write(&file, "{\"pump 1\":").unwrap();
    assert_eq!(open().of(&ONE.into()), None);
}

/// A run of the first drive and a stop of the second, as they are written, with this put in the place of that.
fn written(that: &str, this: &str) -> String {
    let folder = Folder::new("records-written");
    let file = folder.file("runs.json");
    let records = Records::<RunRecord>::open(Some(&file), &places(&[("north", ONE), ("south", TWO)]));
    records.set(&ONE.into(), "north", Some(record(None)));
    records.set(&TWO.into(), "south", Some(record(Some(StopMode::Fast))));
    records.write();
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(that), "{text}");
    text.replacen(that, this, 1)
}

#[test]
fn a_record_that_cannot_be_read_loses_no_other_ones_stop_and_is_put_aside_and_told_until_somebody_has_seen_to_it()
 {
    let stop = record(Some(StopMode::Fast));
    let whole = written("{", "{");
    let cases = [
        written("\"word\": 15", "\"word\": \"?\""),
        written("\"lease\": {", "\"lease\": 7, \"run\": {"),
        format!("{whole}{whole}"),
        // Cut off behind the second, or in the first that follows it.
        whole.trim_end().trim_end_matches('}').to_owned() + "}},",
        whole.trim_end().trim_end_matches('}').to_owned() + "}}, \"/dev/ttyUSB0 atv312@3\": {\"dri",
    ];
    for text in cases {
        let folder = Folder::new("records-one-lost");
        let file = folder.file("runs.json");
        let open = || Records::<RunRecord>::open(Some(&file), &places(&[("north", ONE), ("south", TWO)]));
        fs::write(&file, &text).unwrap();
        for _ in 0..2 {
            let records = open();
            assert_eq!(records.of(&TWO.into()), Some(stop.clone()), "{text}");
            let lost = records.lost().expect("it is told");
            assert!(lost.contains("runs.json.damaged"), "{lost}");
            assert_eq!(fs::read_to_string(folder.file("runs.json.damaged")).unwrap(), text);
        }
        open().see_to_lost();
        assert_eq!((open().lost(), open().of(&TWO.into())), (None, Some(stop.clone())));
        assert_eq!(fs::read_to_string(folder.file("runs.json.damaged.seen")).unwrap(), text);
    }
    let empty = ["", "\0\0\0\0", "[]"];
    for text in empty {
        let folder = Folder::new("records-all-lost");
        let file = folder.file("runs.json");
        fs::write(&file, text).unwrap();
        let open = || Records::<RunRecord>::open(Some(&file), &places(&[("north", ONE)]));
        assert!(open().lost().is_some() && open().lost().is_some(), "{text:?}");
    }
}

#[test]
fn a_stop_is_kept_whose_record_a_newer_version_has_written() {
    // What it was, what stands there now, how it stops then, and whether something may be lost.
    let cases = [
        ("\"stop\": \"fast\"", "\"stop\": \"fast\", \"since\": 1", StopMode::Fast, false),
        ("\"stop\": \"fast\"", "\"stop\": \"coast\"", StopMode::Ramp, false),
        ("\"stop\": \"fast\"", "\"stop\": {\"mode\": \"fast\"}, \"injection_ms\": []", StopMode::Ramp, false),
        ("\"word\": 15", "\"word\": 15, \"since\": 1", StopMode::Fast, true),
        ("\"record\": {", "\"version\": 2, \"record\": {", StopMode::Fast, false),
    ];
    for (that, this, mode, may_be_lost) in cases {
        let folder = Folder::new("records-newer");
        let file = folder.file("runs.json");
        fs::write(&file, written(that, this)).unwrap();
        let records = Records::<RunRecord>::open(Some(&file), &places(&[("north", ONE), ("south", TWO)]));
        assert_eq!(records.of(&TWO.into()), Some(record(Some(mode))), "{this}");
        assert_eq!(records.of(&ONE.into()), Some(record(None)), "{this}");
        assert_eq!(records.lost().is_some(), may_be_lost, "{this}: {:?}", records.lost());
    }
}

#[test]
fn a_record_goes_with_the_machine_when_two_names_are_exchanged_in_the_file_behind_a_kill() {
    let folder = Folder::new("records-exchanged");
    let file = folder.file("runs.json");
    let open = |drives: &[(&str, &str)]| Records::<RunRecord>::open(Some(&file), &places(drives));
    let before = open(&[("north", ONE), ("south", TWO)]);
    before.set(&ONE.into(), "north", Some(record(Some(StopMode::Ramp))));
    before.write();
    let exchanged = [("south", ONE), ("north", TWO)];
    for _ in 0..2 {
        let after = open(&exchanged);
        assert_eq!(
            (after.of(&ONE.into()), after.of(&TWO.into())),
            (Some(record(Some(StopMode::Ramp))), None)
        );
        let [(_, name, _)] = &after.all()[..] else { panic!("{after:?}") };
        assert_eq!(name, "south");
    }
}

#[test]
fn a_file_of_a_version_that_kept_names_alone_is_read_by_the_names_once_and_has_places_from_then_on() {
    let folder = Folder::new("records-names");
    let file = folder.file("runs.json");
    let stop = record(Some(StopMode::Fast));
    fs::write(&file, serde_json::to_vec(&BTreeMap::from([("north", &stop)])).unwrap()).unwrap();
    let open = |drives: &[(&str, &str)]| Records::<RunRecord>::open(Some(&file), &places(drives));
    assert_eq!(open(&[("north", ONE), ("south", TWO)]).of(&ONE.into()), Some(stop.clone()));
    // Killed at once, and the names are exchanged.
    let after = open(&[("south", ONE), ("north", TWO)]);
    assert_eq!((after.of(&ONE.into()), after.of(&TWO.into())), (Some(stop), None));
}

#[test]
fn what_belongs_to_nobody_is_kept_until_the_place_is_there_again() {
    let folder = Folder::new("records-nobodys");
    let file = folder.file("runs.json");
    let open = |drives: &[(&str, &str)]| Records::<RunRecord>::open(Some(&file), &places(drives));
    let (run, stop) = (record(None), record(Some(StopMode::Ramp)));
    let before = open(&[("north", ONE), ("south", TWO)]);
    before.set(&ONE.into(), "north", Some(stop.clone()));
    before.set(&TWO.into(), "south", Some(run.clone()));
    before.write();
    // One of them is at another's place, and one is gone.
    let after = open(&[("north", TWO)]);
    assert_eq!(after.of(&TWO.into()), Some(run.clone()));
    assert_eq!(after.all().len(), 1);
    after.set_all([]);
    assert!(after.write());
    // What is nobody's is known.
    let left = (format!("north ({ONE})"), stop.clone());
    assert_eq!(after.left(), BTreeMap::from([(ONE.into(), left)]));
    assert_eq!(before.left(), BTreeMap::new());
    after.call(&ONE.into(), "east");
    assert_eq!(after.left(), BTreeMap::new());
    // Whoever comes to its place has it.
    assert_eq!(open(&[("east", ONE)]).of(&ONE.into()), Some(stop.clone()));
    // Its name is at a place that is new: a stop goes with it, and a run does not.
    let after = open(&[("east", THREE)]);
    assert_eq!(after.of(&THREE.into()), Some(stop));
    after.set(&THREE.into(), "east", Some(run.clone()));
    after.write();
    let after = open(&[("east", "/dev/ttyUSB0 atv312@4")]);
    assert_eq!((after.of(&"/dev/ttyUSB0 atv312@4".into()), after.of(&THREE.into())), (None, Some(run)));
}

/// A port whose path is another now has the same drives, and another machine on another port is none of them: until the drive says which it is, the
/// motor at the old place may turn.
#[test]
fn a_run_that_goes_by_the_name_to_another_port_stays_where_it_was_until_it_is_adopted_or_seen_to() {
    let folder = Folder::new("records-behind");
    let file = folder.file("runs.json");
    let open = |drives: &[(&str, &str)]| Records::<RunRecord>::open(Some(&file), &places(drives));
    let (run, elsewhere) = (record(None), "/dev/ttyUSB7 atv312@1");
    // By the next start a file has had it.
    let again = || Records::open(Some(&file), &places(&[("north", elsewhere)]).after([elsewhere.into()]));
    let moved = || {
        let before = open(&[("north", ONE)]);
        before.set(&ONE.into(), "north", Some(run.clone()));
        before.write();
        let after = open(&[("north", elsewhere)]);
        assert_eq!(after.of(&elsewhere.into()), Some(run.clone()));
        assert_eq!(after.left(), BTreeMap::from([(ONE.into(), (format!("north ({ONE})"), run.clone()))]));
        after
    };
    // It is another one: what it has ends, and what is left is.
    let after = moved();
    after.set(&elsewhere.into(), "north", None);
    after.write();
    let after: Records<RunRecord> = again();
    assert_eq!((after.of(&elsewhere.into()), after.left().len()), (None, 1));
    assert!(after.forget(&ONE.into()) && !after.forget(&ONE.into()), "somebody has seen to it");
    // It is the same one.
    let after = moved();
    assert!(after.settle(&elsewhere.into(), "north") && !after.settle(&elsewhere.into(), "north"));
    after.write();
    let after: Records<RunRecord> = again();
    assert_eq!((after.of(&elsewhere.into()), after.left().len()), (Some(run.clone()), 0));
    assert!(!after.forget(&elsewhere.into()), "it is somebody's");
}
