//! Our line and somebody else's, asked for the same.

use std::{
    env,
    path::PathBuf,
    process::{Command, Stdio},
};

/// A Python that has pymodbus; where `CI` is set it has to be there.
fn python() -> Option<PathBuf> {
    let python = PathBuf::from(env::var_os("DRIVED_PYTHON").unwrap_or_else(|| "python3".into()));
    let asked = Command::new(&python).args(["-c", "import pymodbus"]).stderr(Stdio::null()).status();
    let found = asked.is_ok_and(|status| status.success());
    assert!(
        found || env::var_os("CI").is_none(),
        "the Python module pymodbus is not installed, and CI must have it"
    );
    if !found {
        eprintln!("skipped: the Python module pymodbus is not installed");
    }
    found.then_some(python)
}

#[test]
fn what_our_line_takes_for_an_answer_pymodbus_takes_too() {
    let Some(python) = python() else { return };
    let told = drive_fire::differential::run(&python, 1, 20_000).expect("it can be asked");
    println!("{told}");
    assert!(told.finds.is_empty(), "{told}");
    assert_eq!(told.plants_found(), told.plants.len(), "{told}");
}
