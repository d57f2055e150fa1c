//! Programs that were not written here, which a test holds ours against. A test that cannot run for want of one is counted, and not
//! passed: its name and what it lacks stand in `target/debug/skipped/`, which `cargo run -p drive-fire -- skipped` counts. Where `CI` or
//! `DRIVED_STRICT` is set it fails instead.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
};

/// Where it is written which tests could not run: beside the programs that cargo has built.
#[must_use]
pub fn folder() -> Option<PathBuf> {
    let program = env::current_exe().ok()?;
    let built = program.parent()?;
    let built = if built.ends_with("deps") { built.parent()? } else { built };
    Some(built.join("skipped"))
}

/// Whether a test may go on that needs `what`, which was `found` or not.
///
/// # Panics
/// When it was not, and everything has to be there.
#[must_use]
pub fn is_there(found: bool, what: &str) -> bool {
    let strict = ["CI", "DRIVED_STRICT"].into_iter().find(|name| env::var_os(name).is_some());
    assert!(
        found || strict.is_none(),
        "{what} is not there, and has to be: {} is set",
        strict.unwrap_or_default()
    );
    // The standard test harness gives each test a thread of its name.
    let test = thread::current().name().unwrap_or("a test").to_owned();
    note(folder().as_deref(), &test, what, found);
    if !found {
        eprintln!("skipped: {what} is not there");
    }
    found
}

/// A file for each test and what it lacks. A folder that cannot be written counts nothing: that is no reason for a test to fail.
fn note(folder: Option<&Path>, test: &str, what: &str, found: bool) {
    let Some(folder) = folder else { return };
    let name: String = format!("{test} {what}").replace(['/', ':'], ".").chars().take(200).collect();
    let file = folder.join(name);
    let _ = match found {
        false => fs::create_dir_all(folder).and_then(|()| fs::write(file, format!("{test}: {what}"))),
        true => fs::remove_file(file),
    };
}

/// The tests that could not run when they were run last, each with what it lacks, in order.
#[must_use]
pub fn skipped() -> Vec<String> {
    let files = folder().and_then(|folder| fs::read_dir(folder).ok()).into_iter().flatten().flatten();
    let mut lines: Vec<String> = files.filter_map(|file| fs::read_to_string(file.path()).ok()).collect();
    lines.sort();
    lines
}

/// Whether a program ends well with these arguments.
#[must_use]
pub fn runs(program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> bool {
    let mut command = Command::new(program);
    let status =
        command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// A Python that has a module; the interpreter is named by `DRIVED_PYTHON`.
///
/// # Panics
/// As [`is_there`].
#[must_use]
pub fn python_with(module: &str) -> Option<PathBuf> {
    let python = PathBuf::from(env::var_os("DRIVED_PYTHON").unwrap_or_else(|| "python3".into()));
    let found = runs(&python, &["-c", &format!("import {module}")]);
    is_there(found, &format!("the Python module {module}")).then_some(python)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_that_lacks_something_is_counted_until_it_runs() {
        let folder = env::temp_dir().join(format!("drive-testing-skipped-{}", std::process::id()));
        let counted = || fs::read_dir(&folder).map_or(0, Iterator::count);
        note(Some(&folder), "a::test", "a peer", false);
        note(Some(&folder), "a::test", "/usr/bin/another", true);
        note(Some(&folder), "another::test", "a peer", false);
        assert_eq!(counted(), 2);
        assert_eq!(fs::read_to_string(folder.join("a..test a peer")).unwrap(), "a::test: a peer");
        note(Some(&folder), "a::test", "a peer", true);
        assert_eq!(counted(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }
}
