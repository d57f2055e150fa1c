//! Documents name only what exists: those for whoever works on this house files and tests, and all of them what they link to.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

const DOCUMENTS: [&str; 4] =
    [".github/ARCHITECTURE.md", ".github/CONTRIBUTING.md", ".github/A-FAMILY-IN-A-DAY.md", "README.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// What stands between single backticks in a document, outside its blocks of code.
fn quoted(text: &str) -> Vec<String> {
    let prose: String = text.split("```").step_by(2).collect();
    prose.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The names of every function of every Rust file under a folder.
fn collect_functions(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("it is a folder") {
        let path = entry.expect("it is listed").path();
        if path.is_dir() {
            collect_functions(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).expect("it is text");
            let names = text.split("fn ").skip(1).map(|rest| {
                rest.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect()
            });
            found.extend(names);
        }
    }
}

/// Every document in a folder and those below it.
fn collect_documents(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("it is a folder") {
        let path = entry.expect("it is listed").path();
        // A link is the same document, with another folder around it.
        if path.is_symlink() || path.ends_with("target") {
            continue;
        }
        if path.is_dir() {
            collect_documents(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
}

/// Where a document links to, outside its blocks of code: each file, and the place in it.
fn linked(text: &str) -> Vec<(String, String)> {
    let prose: String = text.split("```").step_by(2).collect();
    let targets = prose.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let ours = targets.filter(|target| !target.contains("://") && !target.contains(char::is_whitespace));
    let parts = ours.map(|target| target.split_once('#').unwrap_or((target, "")));
    parts.map(|(file, place)| (file.to_owned(), place.to_owned())).collect()
}

/// The places of a document that can be linked to, as a forge makes them of its headings.
fn places(text: &str) -> BTreeSet<String> {
    let prose: String = text.split("```").step_by(2).collect();
    let headings = prose.lines().filter(|line| line.starts_with('#'));
    let place = |heading: &str| -> String {
        let heading = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = heading.chars().filter(|letter| letter.is_alphanumeric() || " -_".contains(*letter));
        kept.map(|letter| if letter == ' ' { '-' } else { letter }).collect()
    };
    headings.map(place).collect()
}

#[test]
fn every_link_of_a_document_leads_to_what_is_there() {
    let mut documents = vec![root().join("README.md")];
    for folder in [".github", "crates", "examples"] {
        collect_documents(&root().join(folder), &mut documents);
    }
    assert!(documents.len() > 60, "{documents:?}");
    for document in documents {
        let text = fs::read_to_string(&document).expect("it is text");
        for (file, place) in linked(&text) {
            let folder = document.parent().expect("it is in a folder");
            let target = if file.is_empty() { document.clone() } else { folder.join(&file) };
            assert!(target.exists(), "{} links to {file}", document.display());
            if !place.is_empty() {
                let there = fs::read_to_string(&target).expect("it is text");
                let is_there = places(&there).contains(&place);
                assert!(is_there, "{} links to {file}#{place}", document.display());
            }
        }
    }
}

/// What is longer is read by nobody.
const LONGEST_CHAPTER: usize = 250;

#[test]
fn the_manual_lists_each_of_its_chapters_which_leads_back() {
    let folder = root().join("crates/drived");
    let readme = fs::read_to_string(folder.join("README.md")).expect("it is there");
    assert!(readme.lines().count() <= LONGEST_CHAPTER);
    let (_, list) = readme.split_once("\n## The chapters\n").expect("it has a list");
    let mut chapters = Vec::new();
    collect_documents(&folder.join("docs"), &mut chapters);
    assert!(chapters.len() > 15, "{chapters:?}");
    for chapter in chapters {
        let name = chapter.file_name().and_then(|name| name.to_str()).expect("it has a name");
        assert!(list.contains(&format!("](docs/{name})")), "{name} is not listed");
        let text = fs::read_to_string(&chapter).expect("it is text");
        assert!(
            text.starts_with("[The manual of `drived`](../README.md)\n\n# "),
            "{name} does not lead back"
        );
        assert!(text.lines().count() <= LONGEST_CHAPTER, "{name} is long");
    }
}

#[test]
fn every_event_of_a_drive_stands_in_the_manual() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect("it is there");
    let (source, manual) =
        (read("crates/drive-fleet/src/event/kind.rs"), read("crates/drived/docs/daemon.md"));
    let names = source.split("pub const fn name(&self)").nth(1).expect("each has a name");
    let names = names.split("    }\n").next().expect("one after the other");
    let names = names.split("=> \"").skip(1).filter_map(|rest| rest.split('"').next());
    let missing: Vec<String> = names
        .map(|name| name.replace(' ', "_"))
        .filter(|name| !manual.contains(&format!("`{name}`")))
        .collect();
    assert_eq!(missing, [""; 0], "they are told, and the manual does not know them");
}

#[test]
fn every_file_that_a_document_names_is_there() {
    let root = root();
    let tops = ["crates/", "tests/", "examples/", ".github/", ".ci/"];
    let crates: Vec<_> = fs::read_dir(root.join("crates")).expect("it is a folder").flatten().collect();
    for document in DOCUMENTS {
        let text = fs::read_to_string(root.join(document)).expect("it is there");
        for path in quoted(&text).into_iter().filter(|name| tops.iter().any(|top| name.starts_with(top))) {
            // `tests/manual.rs` is every family's.
            let of_a_crate = crates.iter().any(|folder| folder.path().join(&path).exists());
            assert!(of_a_crate || root.join(&path).exists(), "{document} names {path}");
        }
    }
}

#[test]
fn every_test_that_a_document_names_is_there() {
    let mut functions = BTreeSet::new();
    for folder in ["crates", "tests"] {
        collect_functions(&root().join(folder), &mut functions);
    }
    for document in DOCUMENTS {
        let text = fs::read_to_string(root().join(document)).expect("it is there");
        let is_sentence = |name: &String| {
            name.matches('_').count() >= 4
                && name
                    .chars()
                    .all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_')
        };
        for test in quoted(&text).into_iter().filter(is_sentence) {
            assert!(functions.contains(&test), "{document} names the test {test}");
        }
    }
}
