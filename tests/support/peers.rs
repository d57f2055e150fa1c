//! Masters and slaves that were not written here, for tests of interoperation.
//!
//! Where a peer is not installed the test prints why it is skipped; where `CI` is set it fails instead, because
//! `.ci/run` installs them all.

use std::{
    env,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// A Python that has `module`, or `None` with the reason printed. `DRIVED_PYTHON` names the interpreter.
#[must_use]
pub fn python_with(module: &str) -> Option<PathBuf> {
    let python = PathBuf::from(env::var_os("DRIVED_PYTHON").unwrap_or_else(|| "python3".into()));
    let found = runs(Command::new(&python).args(["-c", &format!("import {module}")]));
    found_or_skip(found, &format!("the Python module {module}")).then_some(python)
}

/// A program on the path, or `None` with the reason printed.
#[must_use]
pub fn program(name: &str) -> Option<PathBuf> {
    let found = runs(Command::new(name).arg("-V")) || runs(Command::new(name).arg("--version"));
    found_or_skip(found, name).then(|| PathBuf::from(name))
}

/// The path of a script beside the tests.
#[must_use]
pub fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("peers").join(name)
}

fn runs(command: &mut Command) -> bool {
    let status = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

fn found_or_skip(found: bool, what: &str) -> bool {
    assert!(found || env::var_os("CI").is_none(), "{what} is not installed, and CI must have it");
    if !found {
        eprintln!("skipped: {what} is not installed");
    }
    found
}
