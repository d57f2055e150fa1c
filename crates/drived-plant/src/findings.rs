//! What a line has found wrong with itself, in words, with the names of its drives, in `poll`; and as
//! events of `run`.

use std::{collections::BTreeMap, time::Duration};

use drive_bus::{
    Line,
    evidence::{Defect, Finding},
};
use drive_fleet::{DriveHandle, Fleet};

use drived_words::drive_spec::DriveName;

/// How often `run` looks.
const EVERY: Duration = Duration::from_secs(10);

/// Each finding with the first thing to do.
pub fn told(line: &Line, names: &[DriveName]) -> Vec<String> {
    let name = |slave: u8| {
        let named = names.iter().find(|name| name.slave.number() == slave);
        named.map_or_else(|| format!("address {slave}"), ToString::to_string)
    };
    line.findings().iter().map(|finding| words(finding, name)).collect()
}

/// What a line has found wrong that tells why this drive does not answer, with the first thing to do.
pub fn why(line: &Line, name: DriveName) -> Option<String> {
    let concerns = |finding: &Finding| {
        finding.slave.is_none_or(|slave| slave == name.slave.number())
            && !matches!(finding.defect, Defect::FellSilent(_))
    };
    line.findings()
        .iter()
        .find(|finding| concerns(finding))
        .map(|finding| words(finding, |_| name.to_string()))
}

fn words(finding: &Finding, name: impl Fn(u8) -> String) -> String {
    let whom = finding.slave.map(|slave| format!("{}: ", name(slave))).unwrap_or_default();
    let next = finding.next().first().map_or_else(String::new, |next| format!(". Next: {next}"));
    format!("{whom}{finding}{next}")
}

/// Tells each finding of each line as an event when it comes and when it goes, for as long as the fleet is there.
pub async fn follow(fleet: Fleet) {
    let mut known = Known::default();
    let mut ticks = tokio::time::interval(EVERY);
    loop {
        ticks.tick().await;
        for (name, line) in fleet.lines() {
            let drives = fleet.drives_on(&name);
            for (finding, present) in known.changed(&name, line.findings()) {
                let of =
                    |drive: &&DriveHandle| finding.slave.is_none_or(|slave| drive.slave().number() == slave);
                if let Some(drive) = drives.iter().find(of) {
                    fleet.tell_finding(drive, finding, present);
                }
            }
        }
    }
}

/// What each line has found, so that it is told once.
#[derive(Debug, Default)]
struct Known(BTreeMap<String, BTreeMap<(Option<u8>, &'static str), Finding>>);

impl Known {
    /// What of this is new, and what is not found any more.
    fn changed(&mut self, line: &str, findings: Vec<Finding>) -> Vec<(Finding, bool)> {
        // That a drive does not answer any more is told of the drive.
        let now: BTreeMap<_, _> = findings
            .into_iter()
            .filter(|finding| !matches!(finding.defect, Defect::FellSilent(_)))
            .map(|finding| ((finding.slave, finding.defect.name()), finding))
            .collect();
        let known = self.0.entry(line.to_owned()).or_default();
        let come =
            now.iter().filter(|(key, _)| !known.contains_key(*key)).map(|(_, finding)| (*finding, true));
        let gone =
            known.iter().filter(|(key, _)| !now.contains_key(*key)).map(|(_, finding)| (*finding, false));
        let changed = come.chain(gone).collect();
        *known = now;
        changed
    }
}

#[cfg(test)]
mod tests {
    use drive_bus::evidence::Certainty;

    use super::*;

    #[test]
    fn a_finding_is_told_once_and_again_when_it_ends_whatever_its_figures_are_meanwhile() {
        let found = |slave, defect, part| Finding {
            defect,
            slave,
            share: (part, 100),
            certainty: Certainty::Certain,
        };
        let mut known = Known::default();
        let cut = found(Some(3), Defect::FirstByteCut, 60);
        let silent = found(None, Defect::FellSilent(Duration::from_secs(9)), 6);
        assert_eq!(known.changed("a", vec![cut, silent]), [(cut, true)], "silence is told of the drive");
        let more = found(Some(3), Defect::FirstByteCut, 90);
        let master = found(None, Defect::SecondMaster(None), 4);
        assert_eq!(known.changed("a", vec![more, master]), [(master, true)]);
        assert_eq!(known.changed("b", vec![more]), [(more, true)], "another line");
        assert_eq!(known.changed("a", vec![master]), [(more, false)]);
        assert_eq!(known.changed("a", Vec::new()), [(master, false)]);
    }
}
