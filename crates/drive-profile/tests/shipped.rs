//! The profiles that are shipped: each is one, each at the level that its marks carry, as the table of the README says.

use std::collections::BTreeSet;

use drive_profile::{Level, format::Mark, read, shipped};

#[test]
fn each_profile_that_is_shipped_is_one_and_has_a_key_of_its_own() {
    let (mut keys, mut refused) = (BTreeSet::new(), String::new());
    for (name, text) in shipped::TEXTS {
        match read(text) {
            Ok(profile) => assert!(keys.insert(profile.key().to_owned()), "{name}"),
            Err(refusals) => refused.push_str(&format!("{name}:\n{refusals}\n")),
        }
    }
    assert!(refused.is_empty(), "{refused}");
    assert_eq!(keys.len(), shipped::all().len());
}

/// What is not sure is not shipped; what contradicts itself moves nothing.
#[test]
fn no_profile_that_is_shipped_rests_on_a_weak_source_or_on_memory() {
    for profile in shipped::all() {
        for (name, source) in &profile.file().sources {
            let mark = source.get_ref().mark;
            assert!(!matches!(mark, Mark::W | Mark::M), "{}: {name}", profile.key());
        }
    }
}

#[test]
fn the_readme_has_the_table_of_what_is_shipped() {
    let mut table = String::from(
        "| Drive | Key | Level | What keeps it from the next | What else is not known | Sources | Strangers that drove it |\n|---|---|---|---|---|---|---|\n",
    );
    let strangers = strangers();
    for profile in shipped::all() {
        let told = |keeps: bool| {
            let gaps = profile.gaps().iter().filter(|gap| gap.keeps_from.is_some() == keeps);
            let told: Vec<&str> = gaps.map(|gap| gap.what.as_str()).collect();
            if told.is_empty() { "—".to_owned() } else { told.join("; ") }
        };
        let (name, key, level) = (profile.name(), profile.key(), profile.level());
        let sources = profile.file().sources.values().map(drive_profile::format::Spanned::get_ref);
        let sources: Vec<String> =
            sources.map(|source| format!("{} ({:?})", source.document, source.mark)).collect();
        let drove: Vec<&str> =
            strangers.iter().filter(|(of, _)| of == key).map(|(_, file)| file.as_str()).collect();
        let drove = if drove.is_empty() { "—".to_owned() } else { drove.join(", ") };
        table.push_str(&format!(
            "| {name} | `{key}` | {level} | {} | {} | {} | {drove} |\n",
            told(true),
            told(false),
            sources.join("; ")
        ));
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
    let readme = std::fs::read_to_string(path).expect("it is there");
    let (head, rest) = readme.split_once("<!-- shipped -->\n").expect("it has a place for the table");
    let (_, tail) = rest.split_once("<!-- /shipped -->").expect("the place has an end");
    if std::env::var_os("UPDATE_README").is_some() {
        let written = format!("{head}<!-- shipped -->\n{table}<!-- /shipped -->{tail}");
        std::fs::write(path, written).expect("it can be written");
        return;
    }
    assert!(
        readme.contains(&table),
        "UPDATE_README=1 cargo test -p drive-profile --test shipped writes it:\n{table}"
    );
}

/// Profile and stranger, as the test names them that drives the one through the other.
fn strangers() -> Vec<(String, String)> {
    let test = include_str!("../../../tests/profile_strangers.rs");
    let kinds = test.split("kind(\"").skip(1).filter_map(|rest| {
        let mut quoted = rest.split('"');
        let key = quoted.next()?;
        let file = quoted.nth(1).filter(|file| file.ends_with(".py"))?;
        Some((key.to_owned(), file.to_owned()))
    });
    // The drivers of LinuxCNC drive their twins.
    let test = include_str!("../../../tests/linuxcnc.rs");
    let drivers = test.split("let bench = Bench::of").skip(1).filter_map(|rest| {
        let key = rest.split('"').nth(1)?;
        let driver = rest.split("loadusr -W ").nth(1)?.split(' ').next()?;
        Some((key.to_owned(), format!("LinuxCNC's {driver} (its twin)")))
    });
    kinds.chain(drivers).collect()
}

#[test]
fn a_drive_whose_document_carries_all_that_motion_needs_reaches_it() {
    for key in ["v20", "danfoss-fc", "goodrive"] {
        let profile = shipped::find(key).unwrap_or_else(|| panic!("{key}"));
        assert_eq!(profile.level(), Level::Motion, "{key}: {:#?}", profile.gaps());
    }
}

/// An Optidrive's register 6 holds its state in one byte and its fault in the other.
#[test]
fn a_byte_is_shown_as_the_word_that_it_is_in_and_told_as_that() {
    let profile =
        shipped::all().iter().find(|shipped| shipped.key() == "optidrive-eco").expect("it is there");
    let row = profile.capabilities().rows.iter().find(|row| row.name.ends_with("byte of this word"));
    let row = row.expect("it has one");
    assert_eq!(row.unit, drive_core::registers::Unit::CODE);
}
