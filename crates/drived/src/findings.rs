//! What a line has found wrong with itself, in words, with the names of its drives: the same in `poll` and in the log of `run`.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::{
    Line,
    evidence::{Defect, Finding},
};
use drive_fleet::Fleet;

use crate::drive_spec::DriveName;

/// How often `run` looks.
const EVERY: Duration = Duration::from_secs(10);

/// Each finding with the first thing to do.
pub(crate) fn told(line: &Line, names: &[DriveName]) -> Vec<String> {
    let name = |slave: u8| {
        let named = names.iter().find(|name| name.slave.number() == slave);
        named.map_or_else(|| format!("address {slave}"), ToString::to_string)
    };
    line.findings().iter().map(|finding| words(finding, name)).collect()
}

fn words(finding: &Finding, name: impl Fn(u8) -> String) -> String {
    let whom = finding.slave.map(|slave| format!("{}: ", name(slave))).unwrap_or_default();
    let next = finding.next().first().map_or_else(String::new, |next| format!(". Next: {next}"));
    format!("{whom}{finding}{next}")
}

/// Writes each finding of each line into the log when it comes and when it goes, for as long as the fleet is there.
pub(crate) async fn follow(fleet: Fleet) {
    let mut known: BTreeMap<(String, Option<u8>, &'static str), String> = BTreeMap::new();
    let mut ticks = tokio::time::interval(EVERY);
    loop {
        ticks.tick().await;
        let mut now = BTreeMap::new();
        for (name, line) in fleet.lines() {
            let drives = fleet.drives_on(&name);
            for finding in line.findings() {
                // That a drive does not answer any more is told of the drive.
                if matches!(finding.defect, Defect::FellSilent(_)) {
                    continue;
                }
                let of = |slave: u8| {
                    let drive = drives.iter().find(|drive| drive.slave().number() == slave);
                    drive.map_or_else(|| format!("address {slave}"), |drive| drive.name().to_string())
                };
                let text = format!("line {name}: {}", words(&finding, of));
                now.insert((name.to_string(), finding.slave, finding.defect.name()), text);
            }
        }
        for (_, text) in now.iter().filter(|(key, _)| !known.contains_key(*key)) {
            tracing::warn!("{text}");
        }
        for (_, text) in known.iter().filter(|(key, _)| !now.contains_key(*key)) {
            tracing::info!("not any more: {text}");
        }
        known = now;
    }
}
