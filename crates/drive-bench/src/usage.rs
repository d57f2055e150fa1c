//! What this process uses, as the kernel counts it.

use std::{
    fs,
    time::{Duration, Instant},
};

use rustix::{
    process::{Resource, getrlimit, setrlimit},
    time::{ClockId, clock_gettime},
};

use crate::Error;

/// Processor time of all threads of this process.
pub(crate) fn processor_time() -> Duration {
    clock(ClockId::ProcessCPUTime)
}

/// The clock that all processes of a machine share, and that [`std::time::Instant`] reads.
pub(crate) fn monotonic() -> Duration {
    clock(ClockId::Monotonic)
}

fn clock(id: ClockId) -> Duration {
    Duration::try_from(clock_gettime(id)).unwrap_or_default()
}

/// Who has used the processors so far, in ticks of the kernel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Machine {
    at: Instant,
    everybody: u64,
    /// This process and those of its children that have ended.
    ours: u64,
}

impl Machine {
    pub(crate) fn now() -> Result<Self, Error> {
        let stat = fs::read_to_string("/proc/stat")?;
        let all: Vec<u64> = stat
            .lines()
            .next()
            .and_then(|line| line.strip_prefix("cpu "))
            .ok_or("no processors in /proc/stat")?
            .split_whitespace()
            .map(str::parse)
            .collect::<Result<_, _>>()?;
        // user, nice, system, idle, iowait, irq, softirq, steal; guests are counted in user already.
        let everybody = [0, 1, 2, 5, 6, 7].iter().filter_map(|&column| all.get(column)).sum();
        let stat = fs::read_to_string("/proc/self/stat")?;
        // The name of the process may hold anything; what is wanted stands behind it.
        let (_, rest) = stat.rsplit_once(')').ok_or("no name in /proc/self/stat")?;
        let ours = rest.split_whitespace().skip(11).take(4).map(str::parse::<u64>).sum::<Result<_, _>>()?;
        Ok(Self { at: Instant::now(), everybody, ours })
    }

    /// How many processors the others have used on the average since then, the kernel's own threads among them.
    pub(crate) fn others_since(self) -> Result<f64, Error> {
        let now = Self::now()?;
        let ticks = (now.everybody - self.everybody).saturating_sub(now.ours - self.ours);
        Ok(ticks as f64 / rustix::param::clock_ticks_per_second() as f64 / self.at.elapsed().as_secs_f64())
    }
}

/// Memory that this process holds, in KiB: its resident pages.
pub(crate) fn memory_kib() -> Result<u64, Error> {
    memory_of("self")
}

/// The same of a process by its number.
pub(crate) fn memory_of(process: &str) -> Result<u64, Error> {
    let statm = fs::read_to_string(format!("/proc/{process}/statm"))?;
    let pages: u64 = statm.split_whitespace().nth(1).ok_or("no resident pages in statm")?.parse()?;
    Ok(pages * (rustix::param::page_size() as u64 / 1_024))
}

/// Lines by the hundred, and clients by the thousand, are more descriptors than a shell allows.
pub(crate) fn allow_descriptors() -> Result<(), Error> {
    let mut limit = getrlimit(Resource::Nofile);
    limit.current = limit.maximum;
    Ok(setrlimit(Resource::Nofile, limit)?)
}
