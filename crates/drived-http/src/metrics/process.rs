//! What every program tells of itself, from `/proc`; nothing on a system without it.

use std::fs;

use super::{samples::Samples, table::Id};

/// What the kernel counts processor time in, for programs: a hundredth of a second on every architecture of today.
const TICKS_A_SECOND: f64 = 100.0;

pub(super) fn collect(samples: &mut Samples) {
    let read = |file: &str| fs::read_to_string(file).unwrap_or_default();
    let status = read("/proc/self/status");
    let field = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
        line.split_whitespace().next()?.parse::<f64>().ok()
    };
    samples.add_known(Id::ProcessResident, &[], field("VmRSS").map(|kib| kib * 1_024.0));
    samples.add_known(Id::ProcessVirtual, &[], field("VmSize").map(|kib| kib * 1_024.0));
    samples.add_known(Id::ProcessThreads, &[], field("Threads"));
    // Behind the name, which may have spaces and brackets; proc(5) counts from there, the state being 3.
    let stat = read("/proc/self/stat");
    let stat: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |number: usize| stat.get(number - 3)?.parse::<f64>().ok().map(|ticks| ticks / TICKS_A_SECOND);
    samples.add_known(Id::ProcessCpu, &[], ticks(14).zip(ticks(15)).map(|(user, system)| user + system));
    let boot = read("/proc/stat");
    let boot = boot.lines().find_map(|line| line.strip_prefix("btime ")?.parse::<f64>().ok());
    samples.add_known(Id::ProcessStart, &[], boot.zip(ticks(22)).map(|(boot, since)| boot + since));
    // The folder itself is open while it is read.
    let open = fs::read_dir("/proc/self/fd").map(|entries| entries.count().saturating_sub(1)).ok();
    samples.add_known(Id::ProcessFds, &[], open.map(|count| count as f64));
    let limits = read("/proc/self/limits");
    let limit = limits.lines().find_map(|line| line.strip_prefix("Max open files"));
    let limit = limit.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    samples.add_known(Id::ProcessMaxFds, &[], limit);
}
