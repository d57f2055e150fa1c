//! The documents for whoever works on this house name only what exists.

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

/// The files that a document links to, without their places.
fn linked(text: &str) -> Vec<String> {
    let targets = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
    targets.filter(|target| !target.is_empty() && !target.contains("://")).map(str::to_owned).collect()
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
        let folder = root.join(document).parent().expect("it is in a folder").to_owned();
        for path in linked(&text) {
            assert!(folder.join(&path).exists(), "{document} links to {path}");
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
