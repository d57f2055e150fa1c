//! How many precise timers this process has. Where there are many, something is always due, no processor falls asleep,
//! and a wait that spins takes the time of another.

use std::sync::atomic::{AtomicUsize, Ordering};

/// With more timers than this nothing spins.
const FEW: usize = 8;

static TIMERS: AtomicUsize = AtomicUsize::new(0);

/// One of them, for as long as it lives.
#[derive(Debug)]
pub(crate) struct Member(());

impl Member {
    pub(crate) fn new() -> Self {
        TIMERS.fetch_add(1, Ordering::Relaxed);
        Self(())
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        TIMERS.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Whether there are so few that one may spin.
pub(crate) fn is_small() -> bool {
    TIMERS.load(Ordering::Relaxed) <= FEW
}
