//! Whether the system gives as many file descriptors as the lines and the faces of the daemon need: without them a port that
//! was lost could not be opened again.

use std::fs;

use drived_words::failure::Failure;

/// A port and its timer.
const FOR_A_LINE: u64 = 3;
/// The log, the listeners, their connections and streams, the files of the configuration.
const FOR_THE_REST: u64 = 96;

/// Checks the limit against what is needed. Where the system does not tell its limit nothing is refused.
pub(super) fn check(lines: usize) -> Result<(), Failure> {
    let needed = FOR_THE_REST + FOR_A_LINE * u64::try_from(lines).unwrap_or(u64::MAX / FOR_A_LINE);
    match limit() {
        Some(limit) if limit < needed => Err(Failure::Input(format!(
            "too few file descriptors: {lines} lines and the daemon's listeners need {needed}, the limit is {limit}: raise \
             it by ulimit -n, or LimitNOFILE= of the unit"
        ))),
        _ => Ok(()),
    }
}

/// The limit of open files, as Linux tells it; `None` where there is none or it is not told.
fn limit() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max open files"))?;
    line.split_whitespace().next()?.parse().ok()
}
