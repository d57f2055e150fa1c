//! What is told of the alarms: how many of each kind are where in their life.

use std::collections::BTreeMap;

use super::{samples::Samples, table::Id};
use drived_plant::plant::alarms::AlarmsView;

pub(super) fn collect(all: &AlarmsView, samples: &mut Samples) {
    let mut counts: BTreeMap<(&str, &str, &str, String), u64> = BTreeMap::new();
    for view in &all.alarms {
        let (line, drive) = (view.alarm.line.as_deref(), view.alarm.drive.as_deref());
        let of = (line.unwrap_or_default(), drive.unwrap_or_default(), view.alarm.kind.word());
        *counts.entry((of.0, of.1, of.2, view.state.to_string())).or_default() += 1;
    }
    for ((line, drive, kind, state), count) in &counts {
        samples.count(Id::Alarms, &[line, drive, kind, state], *count);
    }
    samples.count(Id::AlarmsDropped, &[], all.dropped);
}
