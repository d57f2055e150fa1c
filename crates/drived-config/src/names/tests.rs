use super::*;
use crate::testing::Folder;

fn named(drives: &[(&str, &str)]) -> Configured {
    let slotted: Vec<_> = drives.iter().map(|(name, place)| (*name, *place, None)).collect();
    slotted_as(&slotted)
}

/// With the numbers that the configuration gives.
fn slotted_as(drives: &[(&str, &str, Option<u16>)]) -> Configured {
    let named = |(name, place, slot): &(&str, &str, Option<u16>)| Named {
        name: (*name).into(),
        place: (*place).into(),
        slot: *slot,
    };
    Configured { drives: drives.iter().map(named).collect(), ..Configured::default() }
}

/// The topics of the drives by their names.
fn topics_of(table: &Table) -> Vec<(&str, &str)> {
    table.drives.iter().map(|known| (known.name.as_str(), known.topic.as_str())).collect()
}

fn names_of(table: &Table) -> Vec<Option<String>> {
    table.slots().into_iter().map(|slot| slot.map(|name| name.to_string())).collect()
}

fn held(names: &[&str]) -> Vec<Option<String>> {
    names.iter().map(|name| (!name.is_empty()).then(|| (*name).to_owned())).collect()
}

#[test]
fn a_drive_that_is_taken_out_takes_its_number_along_and_has_it_again_when_it_comes_back() {
    let all = named(&[("fan 3", "a 3"), ("blower", "a 4"), ("mixer", "a 5")]);
    let without = named(&[("blower", "a 4"), ("mixer", "a 5")]);
    let mut table = Table::default();
    table.take_up(&all);
    assert_eq!(names_of(&table), held(&["fan 3", "blower", "mixer"]));
    let told = table.take_up(&without).changed;
    assert_eq!(told, ["fan 3 is gone: its number 0 is kept for it"]);
    assert_eq!(names_of(&table), held(&["", "blower", "mixer"]), "nobody moves");
    assert_eq!(table.take_up(&without), Told::default(), "it is told once");
    // Put back at another place of the file, and beside a new one.
    let back = named(&[("mixer", "a 5"), ("pump", "b 1"), ("blower", "a 4"), ("fan 3", "a 3")]);
    assert_eq!(table.take_up(&back).changed, ["pump has the number 3"]);
    assert_eq!(names_of(&table), held(&["fan 3", "blower", "mixer", "pump"]));
}

#[test]
fn a_drive_that_is_called_otherwise_keeps_its_number_and_one_in_the_place_of_another_does_not_get_it() {
    let mut table = Table::default();
    table.take_up(&named(&[("fan 3", "a 3"), ("blower", "a 4")]));
    let told = table.take_up(&named(&[("extractor", "a 3"), ("blower", "a 4")]));
    assert_eq!(told.changed, ["fan 3 is called extractor now: it keeps its number 0"]);
    assert_eq!(told.renamed, [("fan 3".to_owned(), "extractor".to_owned())]);
    assert_eq!(names_of(&table), held(&["extractor", "blower"]));
    let told = table.take_up(&named(&[("blower", "a 4"), ("pump", "a 9")])).changed;
    assert_eq!(told, ["extractor is gone: its number 0 is kept for it", "pump has the number 2"]);
    // Its name elsewhere is still its name.
    table.take_up(&named(&[("blower", "b 7"), ("pump", "a 9")]));
    assert_eq!(names_of(&table), held(&["", "blower", "pump"]));
}

#[test]
fn a_number_is_given_again_only_after_a_person_has_said_so() {
    let mut table = Table::default();
    table.take_up(&named(&[("fan", "a 1"), ("pump", "a 2")]));
    table.take_up(&named(&[("pump", "a 2")]));
    assert!(table.give("pump", 0).unwrap_err().contains("the number of fan, which is gone"));
    assert!(table.forget("pump").unwrap_err().contains("is in the configuration"));
    assert!(table.forget("mixer").is_err());
    assert_eq!(table.forget("fan"), Ok(Some(0)));
    assert_eq!(table.give("pump", 0), Ok(()));
    assert_eq!(names_of(&table), held(&["pump"]));
    table.take_up(&named(&[("pump", "a 2"), ("fan", "a 1")]));
    assert_eq!(names_of(&table), held(&["pump", "fan"]));
}

#[test]
fn what_is_kept_is_read_again_and_what_is_damaged_gives_nobody_a_number() {
    let folder = Folder::new("names");
    let file = Kept::at(&folder.file(FILE));
    let drives = named(&[("fan", "a 1"), ("pump", "a 2")]);
    changed(&file, |table| Ok(table.take_up(&drives))).unwrap();
    let left = named(&[("pump", "a 2")]);
    let (table, told) = changed(&file, |table| Ok(table.take_up(&left))).unwrap();
    assert_eq!((names_of(&table), told.changed.len()), (held(&["", "pump"]), 1));
    let twice = br#"{"drives":[{"name":"fan","place":"","slot":1},{"name":"pump","place":"","slot":1}]}"#;
    for damage in [&b"{\"drives\": ["[..], b"[]", b"\xff", twice] {
        std::fs::write(file.path(), damage).unwrap();
        let names = Names::in_folder(Some(file.path().parent().unwrap()));
        let error = names.take_up(&drives).unwrap_err();
        assert!(error.contains("no drive has a number until it is mended"), "{error}");
        assert_eq!(names.slots(), None);
        // Stops come by topics: those that follow from the names stand in.
        assert!(names.has(Kind::Drive, "fan"));
        assert_eq!(std::fs::read(file.path()).unwrap(), damage, "it is left as it is");
    }
    let (table, aside) = renewed(&file, &Configured::default()).unwrap();
    assert_eq!(table, Table::default());
    assert_eq!(std::fs::read(aside.unwrap()).unwrap(), twice);
}

#[test]
fn without_a_folder_the_numbers_hold_as_long_as_the_program() {
    let names = Names::in_folder(None);
    let all = named(&[("fan", "a 1"), ("pump", "a 2")]);
    let told = names.take_up(&all).unwrap().changed;
    assert_eq!(told, ["given for the first time, in the order of the configuration"]);
    names.take_up(&named(&[("pump", "a 2")])).unwrap();
    assert_eq!(names.slots(), Some(vec![None, Some(Arc::from("pump"))]));
}

#[test]
fn numbers_that_cannot_be_kept_hold_in_this_program_and_it_is_said() {
    let folder = Folder::new("names-unkept");
    // A file stands where the folder would be made.
    std::fs::write(folder.file("state"), "").unwrap();
    let names = Names::in_folder(Some(&folder.file("state")));
    let error = names.take_up(&named(&[("fan", "a 1")])).unwrap_err();
    assert!(error.contains("names.json"), "{error}");
}

#[test]
fn what_the_configuration_gives_wins_and_a_number_that_another_keeps_is_refused_with_both_named() {
    let mut table = Table::default();
    table.take_up(&slotted_as(&[("fan", "a 1", None), ("pump", "a 2", Some(0)), ("mixer", "a 3", Some(7))]));
    assert_eq!(
        table.slots().iter().flatten().map(|name| &**name).collect::<Vec<_>>(),
        ["pump", "fan", "mixer"]
    );
    assert_eq!(table.slots()[7].as_deref(), Some("mixer"));
    // Two that change places, and one whose number nobody gives keeps it.
    let told = table.take_up(&slotted_as(&[
        ("fan", "a 1", None),
        ("pump", "a 2", Some(7)),
        ("mixer", "a 3", Some(0)),
    ]));
    assert_eq!(told.changed.len(), 2, "{told:?}");
    assert_eq!((table.slots()[0].as_deref(), table.slots()[7].as_deref()), (Some("mixer"), Some("pump")));
    let before = table.slots();
    let told = table.take_up(&slotted_as(&[
        ("fan", "a 1", None),
        ("pump", "a 2", Some(1)),
        ("mixer", "a 3", Some(0)),
    ]));
    assert_eq!(told.refused, ["pump cannot have the slot 1: 1 is the number of fan"]);
    assert_eq!(table.slots(), before, "nobody moves");
    // Nor is the number of one who is gone given before a person says so; who is new gets another.
    let told = table.take_up(&slotted_as(&[
        ("pump", "a 2", Some(7)),
        ("mixer", "a 3", Some(0)),
        ("lift", "a 4", Some(1)),
    ]));
    assert_eq!(
        told.refused,
        ["lift cannot have the slot 1: 1 is the number of fan, which is gone: drived names forget it first"]
    );
    assert_eq!(table.slots()[8].as_deref(), Some("lift"));
    table.forget("fan").unwrap();
    table.take_up(&slotted_as(&[
        ("pump", "a 2", Some(7)),
        ("mixer", "a 3", Some(0)),
        ("lift", "a 4", Some(1)),
    ]));
    assert_eq!(table.slots()[1].as_deref(), Some("lift"));
}

#[test]
fn a_topic_is_kept_over_another_name_and_names_in_any_script_have_topics_of_their_own() {
    let mut table = Table::default();
    table.take_up(&named(&[("насос", "a 1"), ("pump 1", "a 2")]));
    assert_eq!(topics_of(&table), [("насос", "_____"), ("pump 1", "pump_1")], "as a version before had them");
    table.take_up(&named(&[("pump/1", "a 4"), ("котёл", "a 3"), ("main pump", "a 2"), ("насос", "a 1")]));
    // printf %s котёл | sha256sum
    let expected =
        [("насос", "_____"), ("main pump", "pump_1"), ("pump/1", "pump_1-46ad"), ("котёл", "_____-3e36")];
    assert_eq!(topics_of(&table), expected);
    // Where both are new, neither is before the other.
    for order in [[("насос", "a 1"), ("котёл", "a 3")], [("котёл", "a 3"), ("насос", "a 1")]]
    {
        let mut table = Table::default();
        table.take_up(&named(&order));
        let mut topics = topics_of(&table);
        topics.sort_unstable();
        assert_eq!(topics, [("котёл", "_____-3e36"), ("насос", "_____-ac43")]);
    }
}

#[test]
fn lines_and_groups_keep_their_topics_too() {
    let one = |name: &str, place: &str| Named { name: name.into(), place: place.into(), slot: None };
    let there = |line: &str, group: &str| Configured {
        lines: vec![one(line, "/dev/ttyS0")],
        groups: vec![one(group, "fan, pump")],
        ..Configured::default()
    };
    let names = Names::default();
    names.take_up(&there("north", "all fans")).unwrap();
    let told = names.take_up(&there("Norden", "Gebläse")).unwrap().changed;
    assert_eq!(
        told,
        [
            "line north is called Norden now: it keeps its topic north",
            "group all fans is called Gebläse now: it keeps its topic all_fans"
        ]
    );
    assert_eq!(names.topic(Kind::Line, "Norden"), "north");
    assert_eq!(names.topic(Kind::Group, "Gebläse"), "all_fans");
    assert!(names.has(Kind::Line, "north") && !names.has(Kind::Drive, "north"));
}

#[test]
fn what_a_version_without_topics_has_kept_has_those_that_it_told() {
    let folder = Folder::new("names-before");
    let file = Kept::at(&folder.file(FILE));
    let before = r#"{"drives":[{"name":"Lüfter 1","place":"a 1","slot":4},{"name":"old","place":"a 2","slot":1,"gone":true}]}"#;
    std::fs::write(file.path(), before).unwrap();
    let names = Names::in_folder(file.path().parent());
    assert_eq!(
        names.take_up(&named(&[("Lüfter 1", "a 1"), ("new", "a 9")])).unwrap().changed,
        ["new has the number 5"]
    );
    assert_eq!(names.topic(Kind::Drive, "Lüfter 1"), "L_fter_1");
    assert_eq!(names.slots().unwrap()[4].as_deref(), Some("Lüfter 1"));
}

#[test]
fn numbers_that_were_lost_are_told_from_a_first_start_and_nobody_is_numbered_anew_before_a_person_says_so() {
    let folder = Folder::new("names-lost");
    let place = folder.file(FILE);
    let parent = place.parent().unwrap();
    // A first start keeps them also where there is no drive yet.
    let first = Names::in_folder(Some(parent));
    first.take_up(&Configured::default()).unwrap();
    assert!(place.exists());
    first.take_up(&named(&[("fan", "a 1"), ("pump", "a 2")])).unwrap();
    assert_eq!(first.problem(), None);
    for later in ["alarms.json", "history.sqlite", "webhooks.json"] {
        std::fs::write(folder.file(later), "").unwrap();
        _ = std::fs::remove_file(&place);
        // The drives in another order than then: each would get the number of the other.
        let there = named(&[("pump", "a 2"), ("fan", "a 1")]);
        let names = Names::in_folder(Some(parent));
        let error = names.take_up(&there).unwrap_err();
        assert!(error.contains("it is lost") && error.contains(later), "{error}");
        assert_eq!((names.problem(), names.slots()), (Some(error), None));
        assert_eq!(names.known_as(Kind::Drive, "pump").slot, None);
        assert!(!place.exists(), "nothing is kept that nobody has said");
        let (table, aside) = renewed(&Kept::at(&place), &there).unwrap();
        assert_eq!((names_of(&table), aside), (held(&["pump", "fan"]), None));
        names.take_up(&there).unwrap();
        assert_eq!((names.problem(), names.revision()), (None, Some(revision(&table.slots()))));
        std::fs::remove_file(folder.file(later)).unwrap();
    }
}

#[test]
fn an_id_is_the_first_name_and_nobody_else_gets_it() {
    let names = Names::default();
    let id = |name: &str| names.known_as(Kind::Drive, name).id;
    names.take_up(&named(&[("fan 3", "a 3"), ("blower", "a 4")])).unwrap();
    assert_eq!(id("fan 3"), "fan 3");
    names.take_up(&named(&[("extractor", "a 3"), ("blower", "a 4")])).unwrap();
    // Another is called as it was.
    let told = names.take_up(&named(&[("extractor", "a 3"), ("fan 3", "a 9"), ("blower", "a 4")])).unwrap();
    // printf %s 'fan 3' | sha256sum
    let expected = ["fan 3", "fan 3-9a7e", "blower"];
    assert_eq!(["extractor", "fan 3", "blower"].map(id), expected, "{told:?}");
    assert_eq!(names.name_of(Kind::Drive, "fan 3").as_deref(), Some("extractor"));
    assert_eq!(
        names.known_as(Kind::Drive, "extractor"),
        KnownAs { id: "fan 3".to_owned(), short_name: "fan_3".to_owned(), slot: Some(0) }
    );
    names.take_up(&named(&[("blower", "a 4")])).unwrap();
    assert_eq!(names.name_of(Kind::Drive, "fan 3"), None, "it is gone");
    names.take_up(&named(&[("blower", "a 4"), ("extractor", "a 3")])).unwrap();
    assert_eq!(id("extractor"), "fan 3");
}
