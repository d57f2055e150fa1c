//! What is built in: every direct dependency has its reason, and every package a licence that is on the list.

use std::{
    collections::BTreeSet,
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use drive_testing::peers;
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

/// The schema of CycloneDX 1.5, strictly, by its own library: what it does not know is wrong.
#[test]
fn the_bill_of_materials_is_what_its_schema_says() {
    const JUDGES: &str = "import sys\n\
        from cyclonedx.schema import SchemaVersion\n\
        from cyclonedx.validation.json import JsonStrictValidator\n\
        wrong = JsonStrictValidator(SchemaVersion.V1_5).validate_str(sys.stdin.read())\n\
        sys.exit(str(wrong)[:400] if wrong else 0)";
    let Some(python) = peers::python_with("jsonschema, cyclonedx.validation.json") else { return };
    let bill = match drive_fire::sbom::bill(&root(), "drived") {
        Ok(bill) => bill,
        Err(error) => {
            eprintln!("skipped: cargo cannot tell offline: {error}");
            return;
        }
    };
    let judge = |bill: &Value| {
        let mut child = Command::new(&python)
            .args(["-c", JUDGES])
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it is run");
        let mut asked = child.stdin.take().expect("it is asked");
        asked.write_all(bill.to_string().as_bytes()).expect("it reads");
        drop(asked);
        let told = child.wait_with_output().expect("it ends");
        if told.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&told.stderr).into_owned()) }
    };
    assert_eq!(judge(&bill), Ok(()));
    let mut wrong = bill.clone();
    wrong["components"][0]["type"] = "thing".into();
    assert!(judge(&wrong).is_err(), "it would take anything");
}

/// How many points of levels 1 and 2 each section of OWASP ASVS 5.0.0 has.
const ASVS: &str = "1.1:2 1.2:9 1.3:11 1.4:3 1.5:2 2.1:3 2.2:3 2.3:4 2.4:1 3.2:2 3.3:4 3.4:6 3.5:5 3.7:2 4.1:3 4.2:1 4.3:2 4.4:4 5.1:1 \
    5.2:3 5.3:2 5.4:3 6.1:3 6.2:12 6.3:4 6.4:4 6.5:5 6.6:3 6.8:4 7.1:3 7.2:4 7.3:2 7.4:5 7.5:2 7.6:2 8.1:2 8.2:3 8.3:1 8.4:1 9.1:3 9.2:4 \
    10.1:2 10.2:2 10.3:4 10.4:11 10.5:5 10.6:2 10.7:3 11.1:2 11.2:3 11.3:3 11.4:4 11.5:1 11.6:1 12.1:3 12.2:2 12.3:4 13.1:1 13.2:5 13.3:2 \
    13.4:5 14.1:2 14.2:4 14.3:3 15.1:3 15.2:3 15.3:7 16.1:1 16.2:5 16.3:4 16.4:3 16.5:3 17.1:1 17.2:4 17.3:2";

#[test]
fn each_point_of_the_catalogue_stands_in_one_row_and_says_whether_it_holds() {
    let whole: BTreeSet<String> = ASVS
        .split_whitespace()
        .filter_map(|section| section.split_once(':'))
        .flat_map(|(section, count)| {
            let count: u32 = count.parse().expect("it is a number");
            (1..=count).map(move |point| format!("V{section}.{point}"))
        })
        .collect();
    assert_eq!(whole.len(), 253, "as the catalogue has them");
    let text = read(".github/SECURITY-POINTS.md");
    let mut said = BTreeSet::new();
    for row in text.lines().filter_map(|line| line.strip_prefix("| V")) {
        let [points, state, why] = row.trim_end_matches(" |").split(" | ").collect::<Vec<_>>()[..] else {
            panic!("{row:?} has not three cells")
        };
        assert!(["holds", "does not apply", "lacks"].contains(&state) && why.len() > 5, "{row}");
        let (section, range) = points.rsplit_once('.').expect("it is a point");
        let (first, last) = range.split_once('–').unwrap_or((range, range));
        let number = |text: &str| text.parse::<u32>().unwrap_or_else(|_| panic!("{row}"));
        for point in number(first)..=number(last) {
            assert!(said.insert(format!("V{section}.{point}")), "V{section}.{point} stands there twice");
        }
    }
    assert_eq!(said, whole);
}
