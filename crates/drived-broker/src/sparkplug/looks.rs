//! What the node and its devices are like, taken from the plant: it is said by whoever polls the node.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use drive_fleet::{DriveHandle, Link};
use serde_json::json;
use tokio::time::Instant;

use super::{Face, Seen, metrics, now};
use drived_config::names::Kind;
use drived_plant::plant::alarms::Owner;
use drived_words::json::unix;

impl Face {
    /// Sets what the drives are like.
    pub(super) fn look(&mut self) {
        let fleet = self.plant.fleet();
        let mut there = BTreeSet::new();
        for (line, _) in fleet.lines() {
            for drive in fleet.drives_on(&line) {
                let id = self.plant.known_as(Kind::Drive, drive.name()).id;
                self.look_at(&line, &id, &drive);
                there.insert(id);
            }
        }
        let gone: Vec<String> = self.drives.keys().filter(|id| !there.contains(*id)).cloned().collect();
        for id in gone {
            self.drives.remove(&id);
            self.node.remove_device(&id);
        }
    }

    fn look_at(&mut self, line: &str, id: &str, drive: &DriveHandle) {
        let (snapshot, at) = (drive.snapshot(), Instant::now());
        if !self.drives.contains_key(id) {
            self.drives.insert(id.to_owned(), Seen::default());
            if let Err(error) = self.node.add_device(id, metrics::of_a_drive(), now()) {
                tracing::error!("Sparkplug: {error}");
            }
        }
        let Some(seen) = self.drives.get_mut(id) else { return };
        let freshness = Some((snapshot.freshness(at), snapshot.measurements_freshness(at)));
        let is_same = seen.snapshot.as_ref().is_some_and(|known| Arc::ptr_eq(known, &snapshot));
        if is_same && seen.freshness == freshness {
            return;
        }
        let mut object = json!(self.plant.view_of(line, drive));
        object["fault"]["present"] = snapshot.present_trip().is_some().into();
        object["last"] = seen.last.clone();
        for (metric, reading) in metrics::read_drive(&object, unix(at)) {
            // A device that was refused has no metrics; that has been said.
            let _ = self.node.set_device(id, metric, reading);
        }
        self.node.set_present(id, snapshot.link == Link::Connected);
        (seen.snapshot, seen.freshness) = (Some(snapshot), freshness);
    }

    /// Sets what the daemon, its lines and all alarms are like. Lines and drives that have come or gone are told by births.
    pub(super) fn look_at_lines(&mut self) {
        let (lines, at) = (self.plant.lines(), now());
        let drives = self.plant.fleet().drives();
        let id = |kind, name: &str| self.plant.known_as(kind, name).id;
        let ids: (BTreeSet<String>, BTreeSet<String>) = (
            lines.iter().map(|line| line.known_as.id.clone()).collect(),
            drives.iter().map(|drive| id(Kind::Drive, drive.name())).collect(),
        );
        if ids != self.ids {
            let owners = owners(&ids);
            match self.node.define(metrics::of_the_node(&ids.0, &owners), at) {
                Ok(()) => self.ids = ids,
                Err(error) => tracing::error!("Sparkplug: {error}"),
            }
        }
        for line in &lines {
            for (metric, reading) in metrics::read_line(&json!(line), at.unix_ms) {
                let _ = self.node.set_node(&metric, reading);
            }
        }
        let version = json!({ "version": env!("CARGO_PKG_VERSION") });
        for (metric, reading) in metrics::read_daemon(&version, at.unix_ms) {
            let _ = self.node.set_node(metric, reading);
        }
        self.look_at_alarms();
    }

    /// Sets what the alarms of everybody are like.
    pub(super) fn look_at_alarms(&mut self) {
        let at = now();
        let id = |kind, name: String| self.plant.known_as(kind, &name).id;
        let by_id = |owner| match owner {
            Owner::Program => Owner::Program,
            Owner::Line(name) => Owner::Line(id(Kind::Line, name)),
            Owner::Drive(name) => Owner::Drive(id(Kind::Drive, name)),
        };
        let together = self.plant.alarms().together();
        let mut alarms: BTreeMap<Owner, _> =
            together.into_iter().map(|(owner, own)| (by_id(owner), own)).collect();
        for owner in owners(&self.ids) {
            let own = alarms.remove(&owner).unwrap_or_default();
            for (metric, reading) in metrics::read_alarms(&owner, &own, at.unix_ms) {
                let _ = self.node.set_node(&metric, reading);
            }
        }
    }
}

/// Who can have alarms, of the lines and drives of these ids.
fn owners((lines, drives): &(BTreeSet<String>, BTreeSet<String>)) -> Vec<Owner> {
    let lines = lines.iter().cloned().map(Owner::Line);
    std::iter::once(Owner::Program).chain(lines).chain(drives.iter().cloned().map(Owner::Drive)).collect()
}
