//! What can be done to another process from outside, and what its system tells of it.

use std::{
    collections::BTreeSet,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// The supply of descriptors that a process is given again.
pub(super) const DESCRIPTORS: u64 = 1_024;

/// A program that has its sockets in this folder and its state in that one, and nothing of whoever attacks it.
pub(super) fn at_home(program: impl AsRef<OsStr>, folder: &Path, state: &Path) -> Command {
    let mut command = Command::new(program);
    command
        .env_remove("DRIVED_LOG")
        .env_remove("DRIVED_MUTANT")
        .env("RUST_BACKTRACE", "0")
        .env_remove("RUNTIME_DIRECTORY")
        .env("XDG_RUNTIME_DIR", folder)
        .env_remove("STATE_DIRECTORY")
        .env("XDG_STATE_HOME", state);
    command
}

/// Where the system tells of it.
pub(super) fn folder(pid: u32) -> PathBuf {
    PathBuf::from(format!("/proc/{pid}"))
}

/// The least number of which it has nothing open: with that as its limit it opens nothing more.
pub(super) fn free_descriptor(pid: u32) -> Option<u64> {
    let open = fs::read_dir(folder(pid).join("fd")).ok()?;
    let open: BTreeSet<u64> =
        open.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok()).collect();
    (0..).find(|number| !open.contains(number))
}

/// From now on it may have no descriptor of this number or above. False: nobody can say so here.
pub(super) fn limit_descriptors(pid: u32, limit: u64) -> bool {
    is_done(Command::new("prlimit").arg(format!("--pid={pid}")).arg(format!("--nofile={limit}:")))
}

/// Gives it this signal, such as `STOP`. False: it is not there.
pub(super) fn signal(pid: u32, signal: &str) -> bool {
    is_done(Command::new("kill").arg(format!("-{signal}")).arg(pid.to_string()))
}

/// What it holds in memory, in KiB; `None`: this system does not say.
pub(super) fn memory(pid: u32) -> Option<u64> {
    let status = fs::read_to_string(folder(pid).join("status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse().ok()
}

fn is_done(command: &mut Command) -> bool {
    let quiet = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    quiet.status().is_ok_and(|status| status.success())
}
