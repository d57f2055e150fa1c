//! What can be done to another process from outside, and what its system tells of it.

use std::{
    collections::BTreeSet,
    fs,
    path::PathBuf,
    process::{Command, Stdio},
};

/// The supply of descriptors that a process is given again.
pub(super) const DESCRIPTORS: u64 = 1_024;

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
