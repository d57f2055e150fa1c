//! What the subcommands without a drive tell programs: one object, or one a line, with the figures that a person reads.

mod support;

use serde_json::Value;
use support::{File, path, run};

/// The objects of a run that ends well.
fn objects(arguments: &[&str]) -> Vec<Value> {
    let ended = run(&[arguments, &["--json"]].concat());
    let lines = ended.assert_done().lines().map(|line| serde_json::from_str(line).expect("an object a line"));
    lines.collect()
}

#[test]
fn families_and_registers_are_told_as_their_tables_have_them() {
    let families = objects(&["families"]);
    // The manual: five families, and twenty drives from files.
    assert_eq!(families.len(), 5 + 20);
    let [atv58] = &objects(&["families", "atv58"])[..] else { panic!("one object") };
    assert!(families.contains(atv58));
    // User's manual of the card VW3-A58303: the three protocols that it speaks.
    assert_eq!(atv58["protocols"], serde_json::json!(["rtu", "ascii", "unitelway"]));
    let listed = objects(&["param", "list", "atv312"]);
    let rows = listed[0].as_array().expect("a list");
    let acc = rows.iter().find(|row| row["mnemonic"] == "ACC").expect("the manual has it");
    // ATV312 communication parameters manual, table of parameters: ACC is at 9001.
    assert_eq!((&acc["address"], &acc["raw"]), (&9001.into(), &Value::Null));
}

#[test]
fn a_configuration_and_its_plan_are_told_with_the_figures_of_the_tables() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/drives.toml");
    let [checked] = &objects(&["check", "--config", file])[..] else { panic!("one object") };
    let lines = checked["lines"].as_array().expect("a list");
    assert_eq!(lines.len(), 2);
    assert_eq!(lines[0]["drives"].as_array().map(Vec::len), Some(31));
    assert_eq!(lines[0]["drives"][30]["name"], "fan 31");
    let said = run(&["check", "--config", file]);
    let meaning = lines[0]["drives"][0]["meaning"]["status"].as_str().expect("a text");
    assert!(said.assert_done().contains(meaning), "{meaning}");
    let planned = objects(&["plan", "--config", file]);
    assert_eq!(planned.len(), 2);
    // The manual's example prints 857 ms and 66.00 % for this line.
    let north = &planned[0]["cases"][0];
    assert_eq!((&planned[0]["line"], &north["works"]), (&"north".into(), &true.into()));
    assert_eq!(north["cycle_us"].as_u64().map(|micros| micros.div_ceil(1_000)), Some(857));
    assert_eq!(north["used_ppm"].as_u64().map(|ppm| (ppm + 50) / 100), Some(6_600));
}

#[test]
fn tokens_are_made_listed_and_removed_in_objects() {
    let tokens = path("json-tokens");
    let text = format!(
        "tokens = \"{}\"\n[lines.a]\nport = \"/dev/x,19200,8E1\"\n[[drives]]\nline = \"a\"\ndrive = \"atv312@1\"\nname = \"p\"\n",
        tokens.display()
    );
    let file = File::new("json-tokens", &text);
    let config = ["--config", file.path()];
    let [made] = &objects(&[&["token", "add", "scada", "--role", "operate"][..], &config].concat())[..]
    else {
        panic!("one object")
    };
    assert!(made["token"].as_str().is_some_and(|token| token.len() > 20), "{made}");
    let [listed] = &objects(&[&["token", "list"][..], &config].concat())[..] else { panic!("one object") };
    assert_eq!((&listed["name"], &listed["role"]), (&"scada".into(), &"operate".into()));
    assert!(listed.get("token").is_none(), "what opens the door is told once");
    let removed = objects(&[&["token", "remove", "scada"][..], &config].concat());
    assert_eq!(removed[0]["removed"], true);
    assert_eq!(objects(&[&["token", "list"][..], &config].concat()), Vec::<Value>::new());
    std::fs::remove_file(tokens).expect("it was made");
}
