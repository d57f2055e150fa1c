//! Masters and slaves that were not written here, for tests of interoperation: see [`drive_testing::peers`].

use std::path::{Path, PathBuf};

pub use drive_testing::peers::python_with;
use drive_testing::peers::{is_there, runs};

/// A program on the path, or `None` with the reason printed.
#[must_use]
pub fn program(name: &str) -> Option<PathBuf> {
    let found = runs(name, &["-V"]) || runs(name, &["--version"]);
    is_there(found, name).then(|| PathBuf::from(name))
}

/// The path of a script beside the tests.
#[must_use]
pub fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("peers").join(name)
}
