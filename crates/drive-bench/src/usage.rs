//! What this process uses, as the kernel counts it.

use std::{fs, time::Duration};

use rustix::time::{ClockId, clock_gettime};

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

/// Memory that this process holds, in KiB: its resident pages.
pub(crate) fn memory_kib() -> Result<u64, Error> {
    let statm = fs::read_to_string("/proc/self/statm")?;
    let pages: u64 = statm.split_whitespace().nth(1).ok_or("no resident pages in statm")?.parse()?;
    Ok(pages * (rustix::param::page_size() as u64 / 1_024))
}
