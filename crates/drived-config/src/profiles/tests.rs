//! Folders of profiles: what is refused, and what a file that is read again changes.

use std::fs;

use super::*;
use crate::testing;

/// A profile that is shipped, under another key.
fn text(key: &str) -> String {
    let (_, text) = shipped::TEXTS.iter().find(|(name, _)| *name == "siemens/v20").expect("it is shipped");
    text.replace("key = \"v20\"", &format!("key = \"{key}\""))
}

fn folder(name: &str) -> (testing::Folder, PathBuf) {
    let folder = testing::Folder::new(name);
    let profiles = folder.file("profiles");
    fs::create_dir_all(profiles.join("maker")).unwrap();
    (folder, profiles)
}

fn family(key: &str) -> Family {
    key.parse().unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_profiles_of_a_folder_and_of_those_in_it_are_families_by_their_keys() {
    let (_kept, profiles) = folder("families");
    fs::write(profiles.join("one.toml"), text("folder-one")).unwrap();
    fs::write(profiles.join("maker").join("two.toml"), text("folder-two")).unwrap();
    fs::write(profiles.join("notes.txt"), "no profile").unwrap();
    let read = Folder::read(&profiles).unwrap();
    assert_eq!(read.keys().collect::<Vec<_>>(), ["folder-one", "folder-two"]);
    for key in ["folder-one", "folder-two"] {
        assert!(read.has(family(key)), "{key}");
        assert_eq!(family(key).capabilities().name, "Siemens SINAMICS V20");
    }
    assert!(read.has(Family::ATV312), "what is built in is from no folder");
}

/// The drive that has to be stopped may be another one than that whose file somebody is writing.
#[test]
fn a_file_that_is_no_profile_is_left_out_alone_and_whoever_names_its_drive_is_told_why() {
    let (_kept, profiles) = folder("damaged");
    let damaged = text("folder-damaged").replace("words = [0x047A] }]", "words = [0x047F] }]");
    fs::write(profiles.join("own-file.toml"), damaged).unwrap();
    fs::write(profiles.join("long.toml"), "x".repeat(LONGEST + 1)).unwrap();
    fs::write(profiles.join("good.toml"), text("folder-good")).unwrap();
    let read = Folder::read(&profiles).unwrap();
    assert_eq!(read.keys().collect::<Vec<_>>(), ["folder-good"]);
    assert!(read.has(family("folder-good")) && read.why_not(family("folder-good")).is_none());
    assert_eq!(read.left_out().len(), 2, "{:?}", read.left_out());
    for key in ["folder-damaged", "FOLDER-Damaged"] {
        let error = key.parse::<Family>().unwrap_err().to_string();
        assert!(
            error.contains("own-file.toml:") && error.contains("holds a run bit") && error.contains("write"),
            "{error}"
        );
    }
    let error = "long".parse::<Family>().unwrap_err().to_string();
    assert!(error.contains("long.toml") && error.contains("longer than"), "{error}");
    // Mended, it is as any other.
    fs::write(profiles.join("own-file.toml"), text("folder-damaged")).unwrap();
    assert!(Folder::read(&profiles).unwrap().has(family("folder-damaged")));
    let error = Folder::read(&profiles.join("nowhere")).unwrap_err().to_string();
    assert!(error.contains("nowhere"), "{error}");
}

/// A family that was read before is driven no further by a file that is damaged since.
#[test]
fn a_file_that_was_right_and_is_damaged_is_left_out_by_its_name() {
    let (_kept, profiles) = folder("spoilt");
    let file = profiles.join("own.toml");
    fs::write(&file, text("folder-spoilt")).unwrap();
    assert!(Folder::read(&profiles).unwrap().has(family("folder-spoilt")));
    fs::write(&file, text("folder-spoilt").replace("acts = \"level\"", "acts = level")).unwrap();
    let read = Folder::read(&profiles).unwrap();
    let why = read.why_not(family("folder-spoilt")).expect("its file is damaged");
    assert!(!read.has(family("folder-spoilt")) && why.contains("own.toml:"), "{why}");
}

#[test]
fn a_name_that_is_shipped_or_built_in_or_given_twice_is_left_out_with_the_file() {
    // Another test may have done it.
    let _ = ship();
    for (key, reason) in [("v20", "is the name of a family"), ("atv312", "is the name of a family")] {
        let (_kept, profiles) = folder(key);
        fs::write(profiles.join("own.toml"), text(key)).unwrap();
        fs::write(profiles.join("good.toml"), text(&format!("folder-beside-{key}"))).unwrap();
        let read = Folder::read(&profiles).unwrap();
        // It is not the drive that the file was to say, although there is one by this name.
        let error = read.why_not(family(key)).expect("the file is left out");
        assert!(error.contains(reason) && error.contains("own.toml"), "{error}");
        assert_eq!(read.keys().count(), 1);
    }
    let (_kept, profiles) = folder("twice");
    fs::write(profiles.join("one.toml"), text("folder-twice")).unwrap();
    fs::write(profiles.join("three.toml"), text("folder-once")).unwrap();
    fs::write(profiles.join("two.toml"), text("folder-twice")).unwrap();
    let read = Folder::read(&profiles).unwrap();
    assert_eq!(read.keys().collect::<Vec<_>>(), ["folder-once"], "neither of the two is taken");
    let error = "folder-twice".parse::<Family>().unwrap_err().to_string();
    assert!(error.contains("one.toml") && error.contains("two.toml"), "{error}");
}

#[test]
fn a_file_that_is_read_again_is_another_family_only_where_its_content_is_another() {
    let (_kept, profiles) = folder("again");
    let file = profiles.join("own.toml");
    fs::write(&file, text("folder-again")).unwrap();
    Folder::read(&profiles).unwrap();
    let before = family("folder-again");
    Folder::read(&profiles).unwrap();
    assert_eq!(family("folder-again").revision(), before.revision());
    assert_eq!(changed(before), None);
    fs::write(&file, text("folder-again").replace("page 111", "page 112") + "\n# another\n").unwrap();
    let told = changed(before).expect("the file says something else");
    assert!(told.contains(short(before.revision().unwrap())) && told.contains("own.toml"), "{told}");
    Folder::read(&profiles).unwrap();
    let after = family("folder-again");
    assert_eq!(after, before, "a drive is known by its name");
    assert_ne!(after.revision(), before.revision());
    assert_eq!(before.capabilities().name, after.capabilities().name, "what is open goes on");
    fs::remove_file(&file).unwrap();
    let read = Folder::read(&profiles).unwrap();
    assert!(!read.has(after), "it is not in the folder any more");
    assert!(changed(after).expect("it is gone").contains("cannot be read"));
}

#[test]
fn what_a_profile_does_not_know_is_the_familys_to_say() {
    let (_kept, profiles) = folder("unknown");
    fs::write(profiles.join("own.toml"), text("folder-unknown")).unwrap();
    Folder::read(&profiles).unwrap();
    let family = family("folder-unknown");
    assert!(
        family.not_known().iter().any(|said| said.contains("who commands it")),
        "{:?}",
        family.not_known()
    );
    assert!(!family.tells_itself(), "a V20 has no fingerprint");
    assert!(Family::ATV312.not_known().is_empty() && Family::ATV312.tells_itself());
}
