//! What the sources themselves must be, read as text.

use std::path::{Path, PathBuf};

/// The places of a source in which a value is looked up by the name of its key. To set one is none.
fn look_ups(source: &str) -> Vec<&str> {
    let code = source.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    let is_look_up = |line: &&str| {
        let called = [".get(\"", ".get_mut(\"", ".pointer(\"", ".pointer_mut(\"", "[key]", ".get(key)"];
        let indexed = line.match_indices("[\"").any(|(at, _)| {
            let of_something =
                line[..at].ends_with(|last: char| last.is_alphanumeric() || "_)]".contains(last));
            let behind = line[at..].split_once(']').map_or("", |(_, behind)| behind);
            of_something && !(behind.starts_with(" = "))
        });
        indexed || called.iter().any(|call| line.contains(call))
    };
    code.lines().filter(|line| !line.trim_start().starts_with("//")).filter(is_look_up).collect()
}

#[test]
fn no_tool_looks_anything_up_by_its_key_but_reads_it_as_what_it_is() {
    fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            match entry.is_dir() {
                true => sources(&entry, found),
                false => found.push(entry),
            }
        }
    }
    assert_eq!(look_ups("let age = drive[\"status\"][\"age_ms\"].as_u64();").len(), 1);
    assert_eq!(look_ups("told.get(\"reason\")").len(), 1);
    assert!(look_ups("body[\"setpoint\"] = json!(setpoint);\ndaemon.read(&[\"state\"])").is_empty());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("crates");
    let mut found =
        vec![folder.join("drived-words/src/values.rs"), folder.join("drived-doors/src/audit/show.rs")];
    for of_tools in [
        "drived-client/src",
        "drived-daemon/src/run",
        "drived/src/commands",
        "drived-tools/src",
        "drived-screen/src/row",
    ] {
        sources(&folder.join(of_tools), &mut found);
    }
    found.retain(|path| {
        !path.ends_with("tests.rs")
            && !path.iter().any(|part| part == "tests")
            && path.extension().is_some_and(|end| end == "rs")
    });
    assert!(found.len() > 100, "{}", found.len());
    for path in found {
        let source = std::fs::read_to_string(&path).unwrap();
        assert_eq!(look_ups(&source), Vec::<&str>::new(), "{}", path.display());
    }
}
