//! What somebody was not told while it was read, so that it can be told later: a broker that was away gets the values of its outage from
//! whoever keeps the past.

use std::{
    collections::BTreeSet,
    sync::{Arc, PoisonError},
};

use tokio::time::Instant;

use super::{
    Plant,
    past::{PastError, PointView},
};

/// Knows what was not told to whom. Each call may read a disk and take its time: it is made on a thread that may wait.
pub trait Untold: Send + Sync {
    /// Somebody was told something.
    ///
    /// # Errors
    /// [`PastError`]: nothing was noted, and it is to be said again.
    fn note(&self, told: &Told) -> Result<(), PastError>;

    /// What somebody is to be told next, of a drive that is not one of `later`; `None`: nothing now. The same comes again until it is
    /// [noted](Self::note) that it was told.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn next(&self, whom: &str, later: &BTreeSet<String>) -> Result<Option<UntoldView>, PastError>;
}

/// What somebody was told for certain.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Told {
    /// By a name that is kept.
    pub whom: String,
    /// From when on somebody is to know everything of whom nothing is kept yet.
    pub begun: Instant,
    /// As it was read, behind the first moment up to the second; what came before it is an outage, unless it was told.
    pub live: Option<(Instant, Instant)>,
    /// Of what was not told then: its number, and up to where in it.
    pub later: Option<(i64, i64)>,
}

/// A part of what somebody was not told.
#[derive(Debug, Clone, PartialEq)]
pub struct UntoldView {
    /// The number of the outage.
    pub number: i64,
    pub drive: String,
    /// In the order of the daemon's own clock.
    pub points: Vec<UntoldPoint>,
    /// Where this part ends, by that clock.
    pub until_ms: i64,
}

/// What was known of a value from one moment on.
#[derive(Debug, Clone, PartialEq)]
pub struct UntoldPoint {
    /// The moment by the daemon's own clock.
    pub at_ms: i64,
    /// As the history names it, with its unit.
    pub value: &'static str,
    pub point: PointView,
}

impl Plant {
    /// This knows what was not told from now on; `None`: nobody does.
    pub fn set_untold(&self, untold: Option<Arc<dyn Untold>>) {
        *self.0.untold.write().unwrap_or_else(PoisonError::into_inner) = untold;
    }

    /// Who knows what was not told; `None`: nobody does.
    pub fn untold(&self) -> Option<Arc<dyn Untold>> {
        self.0.untold.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
