//! What every face shares: the fleet, the groups, and what is told of them. No HTTP is in it.

#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod views;

use std::sync::Arc;

use drive_fleet::{DriveHandle, Fleet};
use tokio::time::Instant;

use self::views::{DaemonView, DriveView, LineView, StateView};
use crate::{config::Group, doors::Caller, json::unix};

/// The plant as its faces see it. Cheap to clone.
#[derive(Clone)]
pub(crate) struct Plant(Arc<Inner>);

struct Inner {
    fleet: Fleet,
    groups: Vec<Group>,
    started_unix_ms: u64,
    demo: bool,
}

impl Plant {
    pub(crate) fn start(fleet: Fleet, groups: Vec<Group>, demo: bool) -> Self {
        Self(Arc::new(Inner { fleet, groups, started_unix_ms: unix(Instant::now()), demo }))
    }

    pub(crate) fn fleet(&self) -> Fleet {
        self.0.fleet.clone()
    }

    pub(crate) fn state(&self, caller: &Caller) -> StateView {
        let now = Instant::now();
        StateView {
            revision: 0,
            time_unix_ms: unix(now),
            daemon: DaemonView {
                version: env!("CARGO_PKG_VERSION"),
                started_unix_ms: self.0.started_unix_ms,
                demo: self.0.demo,
                rights: caller.rights,
                caller: caller.name.clone(),
            },
            lines: self.lines(),
            drives: self.drives(),
            groups: self.0.groups.clone(),
        }
    }

    pub(crate) fn lines(&self) -> Vec<LineView> {
        let view = |name: &Arc<str>, line| {
            let plan = self.0.fleet.plan(name)?;
            Some(LineView::of(name, line, plan, &self.0.fleet.drives_on(name)))
        };
        self.0.fleet.lines().iter().filter_map(|(name, line)| view(name, line)).collect()
    }

    /// The drives, line by line.
    pub(crate) fn drives(&self) -> Vec<DriveView> {
        let now = Instant::now();
        self.members().map(|(line, drive)| DriveView::of(&line, &drive, now)).collect()
    }

    pub(crate) fn drive(&self, name: &str) -> Option<DriveView> {
        let (line, drive) = self.members().find(|(_, drive)| **drive.name() == *name)?;
        Some(DriveView::of(&line, &drive, Instant::now()))
    }

    fn members(&self) -> impl Iterator<Item = (Arc<str>, DriveHandle)> {
        let fleet = self.fleet();
        fleet.lines().into_iter().flat_map(move |(name, _)| {
            fleet.drives_on(&name).into_iter().map(move |drive| (Arc::clone(&name), drive))
        })
    }
}
