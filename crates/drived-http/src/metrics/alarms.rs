//! What is told of the alarms: how many of each kind are where in their life.

use std::collections::BTreeMap;

use super::{samples::Samples, table::Id};
use drived_config::names::Kind;
use drived_plant::plant::Plant;

pub(super) fn collect(plant: &Plant, samples: &mut Samples) {
    let all = plant.alarms();
    let mut counts: BTreeMap<([Option<&str>; 2], &str, String), u64> = BTreeMap::new();
    for view in &all.alarms {
        let of = [view.alarm.line.as_deref(), view.alarm.drive.as_deref()];
        *counts.entry((of, view.alarm.kind.word(), view.state.to_string())).or_default() += 1;
    }
    for (([line, drive], kind, state), count) in &counts {
        let id =
            |kind, name: &Option<&str>| name.map_or_else(String::new, |name| plant.known_as(kind, name).id);
        // What a person calls it who is told of it.
        let name = drive.or(*line).unwrap_or_default();
        let labels = [&*id(Kind::Line, line), &*id(Kind::Drive, drive), name, kind, state];
        samples.count(Id::Alarms, &labels, *count);
    }
    samples.count(Id::AlarmsDropped, &[], all.dropped);
}
