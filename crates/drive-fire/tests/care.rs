//! What is built in: every direct dependency has its reason, and every package a licence that is on the list.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(name: &str) -> String {
    let path = root().join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn every_direct_dependency_has_its_reason_and_no_reason_is_left_over() {
    let manifest: toml::Table = read("Cargo.toml").parse().expect("it is a manifest");
    let named = manifest["workspace"]["dependencies"].as_table().expect("it has dependencies");
    let is_ours = |value: &toml::Value| value.get("path").is_some();
    let foreign: BTreeSet<&str> =
        named.iter().filter(|(_, value)| !is_ours(value)).map(|(name, _)| name.as_str()).collect();
    let text = read(".github/DEPENDENCIES.md");
    let rows = text.lines().filter_map(|line| line.strip_prefix("| `")?.split_once("` | "));
    let explained: BTreeSet<&str> = rows.filter(|(_, why)| why.len() > 12).map(|(name, _)| name).collect();
    assert_eq!(foreign, explained);
}

/// Whether an expression of SPDX is met by what is allowed; the old `/` means OR.
fn is_met(expression: &str, allowed: &BTreeSet<String>) -> bool {
    let expression = expression.replace(['(', ')'], " ").replace(" / ", " OR ").replace('/', " OR ");
    let all = |alternative: &str| alternative.split(" AND ").all(|licence| allowed.contains(licence.trim()));
    // `(A OR B) AND C`, the one form with both that is in use: one of the first and the last.
    match expression.split_once(" AND ").filter(|_| expression.contains(" OR ")) {
        Some((first, rest)) => {
            first.split(" OR ").any(|one| allowed.contains(one.trim())) && is_met(rest, allowed)
        }
        None => expression.split(" OR ").any(all),
    }
}

#[test]
fn every_licence_is_on_the_list() {
    let rules: toml::Table = read(".deny.toml").parse().expect("it is a table");
    let allowed = rules["licenses"]["allow"].as_array().expect("it is a list");
    let allowed: BTreeSet<String> =
        allowed.iter().filter_map(|licence| licence.as_str().map(str::to_owned)).collect();
    assert!(is_met("(MIT OR GPL-3.0-only) AND ISC", &allowed) && is_met("GPL-2.0/MIT", &allowed));
    assert!(!is_met("GPL-3.0-only", &allowed) && !is_met("MIT AND GPL-3.0-only", &allowed));
    let told = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo is there");
    if !told.status.success() {
        // Where nothing but this package was fetched nobody knows the others.
        eprintln!("skipped: cargo cannot tell offline: {}", String::from_utf8_lossy(&told.stderr));
        return;
    }
    let metadata: Value = serde_json::from_slice(&told.stdout).expect("it is JSON");
    let packages = metadata["packages"].as_array().expect("it lists packages");
    let wrong: Vec<String> = packages
        .iter()
        .filter(|package| !package["license"].as_str().is_some_and(|licence| is_met(licence, &allowed)))
        .map(|package| format!("{}: {}", package["name"], package["license"]))
        .collect();
    assert!(packages.len() > 100, "{}", packages.len());
    assert_eq!(wrong, Vec::<String>::new());
}
