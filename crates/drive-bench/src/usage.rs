//! What a process uses, as Linux counts it.

use std::{fs, path::Path, time::Duration};

use crate::Error;

/// The thread that async-io keeps for its timers.
const TIMERS: &str = "async-io";

/// Processor time of one thread, by its directory under `/proc`.
fn thread_time(thread: &Path) -> Option<Duration> {
    let counted = fs::read_to_string(thread.join("schedstat")).ok()?;
    counted.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

/// Processor time of a master on this thread: the thread's and that of its timers.
pub(crate) fn time_of_master() -> Result<Duration, Error> {
    let mut time =
        thread_time(Path::new("/proc/thread-self")).ok_or("the kernel counts no processor time")?;
    for entry in fs::read_dir("/proc/self/task")? {
        let thread = entry?.path();
        if fs::read_to_string(thread.join("comm")).is_ok_and(|name| name.trim() == TIMERS) {
            time += thread_time(&thread).unwrap_or_default();
        }
    }
    Ok(time)
}

/// Memory that this process holds, in KiB.
pub(crate) fn memory_kib() -> Result<u64, Error> {
    let status = fs::read_to_string("/proc/self/status")?;
    let held = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).ok_or("no VmRSS")?;
    Ok(held.trim().trim_end_matches("kB").trim().parse()?)
}
