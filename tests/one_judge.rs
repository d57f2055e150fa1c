//! What is in force is decided by the families and by nobody above them: no source of the fleet or of the program compares a
//! drive's [`State`](drive_core::State) to decide. Who shows states, by a word, a colour or a number for each, is listed here.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Where a state is shown and nothing is decided by it.
const SHOWS: &[&str] = &[
    "drive-fleet/src/shows.rs",
    "drived-line-tools/src/poll/json.rs",
    "drived-broker/src/mqtt/discovery/drive.rs",
    "drived-gateway/src/virtual_unit.rs",
    "drived-history/src/quantity.rs",
    "drived-http/src/metrics/drives.rs",
    "drived-plant/src/journal/words.rs",
    "drived-screen/src/row/mod.rs",
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("it is a folder") {
        let path = entry.expect("it can be read").path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        match path.is_dir() {
            true if name != "tests" => sources(&path, found),
            false if name.ends_with(".rs") && !name.contains("test") => found.push(path),
            _ => {}
        }
    }
}

/// Whether a line names a state of a drive, outside its tests, comments and the states of other things.
fn names_a_state(line: &str) -> bool {
    let code = line.split("//").next().unwrap_or_default();
    code.match_indices("State::").any(|(at, _)| {
        let before = code[..at].chars().next_back();
        let after = code[at + 7..].chars().next();
        before.is_none_or(|before| !before.is_alphanumeric()) && after.is_some_and(char::is_uppercase)
    }) || code.contains(".is_moving()")
}

#[test]
fn nothing_above_a_family_decides_by_the_state_that_a_drive_shows() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
    let mut offenders = Vec::new();
    let all =
        fs::read_dir(&crates).expect("it is a folder").map(|entry| entry.expect("it can be read").path());
    let above = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        name.starts_with("drived") || name == "drive-fleet"
    };
    let owners: Vec<PathBuf> = all.filter(above).collect();
    assert!(owners.len() > 10, "{owners:?}");
    for owner in owners {
        let mut files = Vec::new();
        sources(&owner.join("src"), &mut files);
        for file in files {
            let name = file.strip_prefix(&crates).expect("it is below").to_string_lossy().replace('\\', "/");
            if SHOWS.contains(&name.as_str()) {
                continue;
            }
            let text = fs::read_to_string(&file).expect("it can be read");
            let own = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            let lines = own.lines().enumerate().filter(|(_, line)| names_a_state(line));
            offenders.extend(lines.map(|(number, line)| format!("{name}:{}: {}", number + 1, line.trim())));
        }
    }
    assert!(offenders.is_empty(), "{}", offenders.join("\n"));
}
