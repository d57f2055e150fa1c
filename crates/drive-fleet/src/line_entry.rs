//! A line of the fleet.

use std::sync::{Arc, Mutex, PoisonError};

use drive_bus::Line;
use tokio::{sync::Semaphore, time::Instant};

use crate::plan::{LineBudget, LinePlan};

/// A line of the fleet.
pub(crate) struct LineEntry {
    pub(crate) name: Arc<str>,
    pub(crate) line: Line,
    pub(crate) budget: LineBudget,
    plan: Mutex<LinePlan>,
    /// When the commands of groups may use it again; who holds it is using it.
    pub(crate) commands: tokio::sync::Mutex<Instant>,
    /// The turn that its drives take one after the other at what takes many exchanges of the lowest class.
    pub(crate) turns: Arc<Semaphore>,
    /// The turn that they take to start: each reads some thirty registers for it, and if all did it at once none would be done in time.
    pub(crate) starts: Arc<Semaphore>,
}

impl LineEntry {
    pub(crate) fn new(name: String, line: Line, budget: LineBudget, plan: LinePlan) -> Self {
        Self {
            name: Arc::from(name),
            line,
            budget,
            plan: Mutex::new(plan),
            commands: tokio::sync::Mutex::new(Instant::now()),
            turns: Arc::new(Semaphore::new(1)),
            starts: Arc::new(Semaphore::new(1)),
        }
    }

    pub(crate) fn plan(&self) -> LinePlan {
        *self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn set_plan(&self, plan: LinePlan) {
        *self.plan.lock().unwrap_or_else(PoisonError::into_inner) = plan;
    }
}
