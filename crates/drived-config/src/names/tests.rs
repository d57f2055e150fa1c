use super::*;
use crate::testing::Folder;

fn named(drives: &[(&str, &str)]) -> Vec<Named> {
    drives.iter().map(|(name, place)| Named { name: (*name).into(), place: (*place).into() }).collect()
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
    let mut table = Table::default();
    table.take_up(&all);
    assert_eq!(names_of(&table), held(&["fan 3", "blower", "mixer"]));
    let told = table.take_up(&all[1..]);
    assert_eq!(told, ["fan 3 is gone: its number 0 is kept for it"]);
    assert_eq!(names_of(&table), held(&["", "blower", "mixer"]), "nobody moves");
    assert!(table.take_up(&all[1..]).is_empty(), "it is told once");
    // Put back at another place of the file, and beside a new one.
    let back = named(&[("mixer", "a 5"), ("pump", "b 1"), ("blower", "a 4"), ("fan 3", "a 3")]);
    assert_eq!(table.take_up(&back), ["pump has the number 3"]);
    assert_eq!(names_of(&table), held(&["fan 3", "blower", "mixer", "pump"]));
}

#[test]
fn a_drive_that_is_called_otherwise_keeps_its_number_and_one_in_the_place_of_another_does_not_get_it() {
    let mut table = Table::default();
    table.take_up(&named(&[("fan 3", "a 3"), ("blower", "a 4")]));
    let told = table.take_up(&named(&[("extractor", "a 3"), ("blower", "a 4")]));
    assert_eq!(told, ["fan 3 is called extractor now: it keeps its number 0"]);
    assert_eq!(names_of(&table), held(&["extractor", "blower"]));
    let told = table.take_up(&named(&[("blower", "a 4"), ("pump", "a 9")]));
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
    assert_eq!(table.forget("fan"), Ok(0));
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
    let (table, told) = changed(&file, |table| Ok(table.take_up(&drives[1..]))).unwrap();
    assert_eq!((names_of(&table), told.len()), (held(&["", "pump"]), 1));
    let twice = br#"{"drives":[{"name":"fan","place":"","slot":1},{"name":"pump","place":"","slot":1}]}"#;
    for damage in [&b"{\"drives\": ["[..], b"[]", b"\xff", twice] {
        std::fs::write(file.path(), damage).unwrap();
        let names = Names::in_folder(Some(file.path().parent().unwrap()));
        let error = names.take_up(&[]).unwrap_err();
        assert!(error.contains("no drive has a number until it is mended"), "{error}");
        assert_eq!(names.slots(), None);
        assert_eq!(std::fs::read(file.path()).unwrap(), damage, "it is left as it is");
    }
    let (table, aside) = renewed(&file, &[]).unwrap();
    assert_eq!(table, Table::default());
    assert_eq!(std::fs::read(aside.unwrap()).unwrap(), twice);
}

#[test]
fn without_a_folder_the_numbers_hold_as_long_as_the_program() {
    let names = Names::in_folder(None);
    let all = named(&[("fan", "a 1"), ("pump", "a 2")]);
    assert_eq!(names.take(&all).unwrap(), ["given for the first time, in the order of the configuration"]);
    names.take(&all[1..]).unwrap();
    assert_eq!(names.slots(), Some(vec![None, Some(Arc::from("pump"))]));
}

#[test]
fn numbers_that_cannot_be_kept_hold_in_this_program_and_it_is_said() {
    let folder = Folder::new("names-unkept");
    // A file stands where the folder would be made.
    std::fs::write(folder.file("state"), "").unwrap();
    let names = Names::in_folder(Some(&folder.file("state")));
    let error = names.take(&named(&[("fan", "a 1")])).unwrap_err();
    assert!(error.contains("names.json"), "{error}");
}
