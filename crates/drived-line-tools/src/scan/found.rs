//! What has been found so far, and how it is told.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use drive_bus::LineConfig;
use drive_core::SlaveAddress;
use drive_families::Family;
use serde_json::json;

use super::{
    answer::Answer,
    plan::{Plan, Step, Trial},
    sweep::{Find, Tripped},
};
use drived_words::{drive_spec::Addresses, failure::Failure, json, output};

/// The finds of a scan, for a person or a program.
#[derive(Debug)]
pub(super) struct Finds {
    line: LineConfig,
    is_json: bool,
    /// In the order in which they were found.
    pub(super) all: Vec<(Trial, Find)>,
}

impl Finds {
    pub(super) const fn on(line: LineConfig, is_json: bool) -> Self {
        Self { line, is_json, all: Vec::new() }
    }

    /// A line with the settings of a trial, as `--line` takes it.
    pub(super) fn written(&self, trial: &Trial) -> String {
        trial.config(self.line.clone(), Duration::ZERO).to_string()
    }

    /// Tells of one more.
    pub(super) fn note(&mut self, plan: &Plan, find: Find) -> Result<(), Failure> {
        let Some(&trial) = plan.trials.get(find.step.trial) else { return Ok(()) };
        let Find { step, answer, found } = &find;
        let (serial, protocol) = (trial.serial, trial.protocol);
        if self.is_json {
            let mut object = answer.object();
            if let Some(object) = object.as_object_mut() {
                object.insert("address".to_owned(), json!(step.slave.number()));
                object.insert("line".to_owned(), json!(self.written(&trial)));
                object.insert("baud".to_owned(), json!(serial.baud()));
                object.insert("format".to_owned(), json!(serial.format().to_string()));
                object.insert("protocol".to_owned(), json!(protocol.name()));
                object.insert("fed_every_ms".to_owned(), json!(found.interval.map(json::milliseconds)));
            }
            output::say_as_it_is(json::line(&object))?;
        } else if plan.trials.len() == 1 {
            output::say(format_args!("{:>5}  {}", step.slave, answer.words()))?;
        } else {
            let setting = format!("{serial} {}", protocol.name());
            output::say(format_args!("{:>5}  {setting:<20} {}", step.slave, answer.words()))?;
        }
        if let Some(interval) = found.interval.filter(|interval| *interval < plan.longest_step()) {
            output::complain(format_args!(
                "the watchdog of {} allows {} between two messages, which is shorter than a step of this scan: it may trip",
                step.slave,
                output::bound(interval * 2)
            ));
        }
        self.all.push((trial, find));
        Ok(())
    }

    /// How many answer, and how to go on.
    pub(super) fn conclude(
        &self,
        questions: usize,
        addresses: usize,
        (took, is_whole): (Duration, bool),
        tripped: &[Tripped],
    ) -> Result<(), Failure> {
        if self.is_json {
            let tripped: Vec<u8> = tripped.iter().map(|tripped| tripped.step.slave.number()).collect();
            let summary = json!({ "questions": questions, "found": self.all.len(), "milliseconds": json::milliseconds(took),
                                  "complete": is_whole, "tripped": tripped });
            output::say_as_it_is(json::line(&json!({ "summary": summary })))?;
        }
        let asked = output::counted(questions.min(addresses), "address", "addresses");
        if self.all.is_empty() {
            return Err(Failure::Drive(format!(
                "nobody answers at {asked}: see that the drives are switched on and wired, and try the other speeds and \
                 formats that they can be set to: drived scan --standstill, while all motors stand"
            )));
        }
        if self.is_json {
            return Ok(());
        }
        let answered = self.all.iter().filter(|(_, find)| !matches!(find.answer, Answer::Damaged(_))).count();
        output::say(format_args!("{answered} of {asked} answer"))?;
        self.trips(tripped).into_iter().try_for_each(output::say)?;
        for (line, drives) in self.known() {
            let drives = drives
                .iter()
                .map(|(family, slaves)| format!(" --drive {family}@{}", Addresses(slaves.clone())));
            output::say(format_args!("to go on: drived poll --line {line}{}", drives.collect::<String>()))?;
        }
        Ok(())
    }

    /// Who has tripped, and who may yet.
    pub(super) fn trips(&self, tripped: &[Tripped]) -> Vec<String> {
        let is_tripped = |step: Step| tripped.iter().any(|tripped| tripped.step == step);
        let slaves = |steps: &mut dyn Iterator<Item = Step>| {
            let slaves: BTreeSet<SlaveAddress> = steps.map(|step| step.slave).collect();
            (!slaves.is_empty()).then(|| Addresses(slaves.into_iter().collect()))
        };
        let of = |before: bool| {
            let those = tripped.iter().filter(move |tripped| tripped.before == before);
            slaves(&mut those.map(|tripped| tripped.step))
        };
        let watched =
            self.all.iter().filter(|(_, find)| find.found.interval.is_some() && !is_tripped(find.step));
        let [during, before] = [false, true].map(of);
        let may = slaves(&mut watched.map(|(_, find)| find.step));
        let during = during.map(|who| {
            format!("{who} tripped while this scan went on, and not before it: see its display, and whether its watchdog is shorter than told")
        });
        let before = before.map(|who| format!("{who} had tripped when it was found"));
        let may = may.map(|who| {
            format!(
                "{who} may trip now that nobody asks any more: the watchdog is armed there, or cannot be read"
            )
        });
        [during, before, may].into_iter().flatten().collect()
    }

    /// The addresses of each family that is the only likely one there, by line.
    fn known(&self) -> Vec<(String, BTreeMap<Family, Vec<SlaveAddress>>)> {
        let mut known: Vec<(String, BTreeMap<Family, Vec<SlaveAddress>>)> = Vec::new();
        for (trial, find) in &self.all {
            let Some(family) = find.answer.only() else { continue };
            let line = self.written(trial);
            let index = known.iter().position(|(other, _)| *other == line).unwrap_or_else(|| {
                known.push((line, BTreeMap::new()));
                known.len() - 1
            });
            if let Some((_, drives)) = known.get_mut(index) {
                drives.entry(family).or_default().push(find.step.slave);
            }
        }
        known
    }
}
