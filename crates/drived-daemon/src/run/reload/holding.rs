//! A new configuration comes to hold: who leaves ends by his policy, who comes is added, and who stays has his new settings.

use std::sync::PoisonError;

use drive_bus::Line;
use drive_fleet::{FleetError, LineBudget};
use drived_config::config::{DrivePart, add};
use drived_file::Config;
use drived_plant::plant::Plant;
use drived_words::{closing, failure::Failure};

use super::{
    Reloader,
    changes::{Change, changes},
    leavings::{Leaving, Leavings, taken},
};
use crate::run::{self, faces, kept::Kept};

impl Reloader {
    /// Makes a new configuration hold, and `config` what holds then, whatever comes of it.
    pub(super) async fn carry_out(&self, config: &mut Config, mut new: Config) -> Result<Done, Failure> {
        let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
        let (plant, changes) = (&self.0.plant, changes(config, &new));
        let fleet = plant.fleet();
        // What can fail without anything being done comes first.
        let mut lines = Vec::new();
        for part in new.lines.iter().filter(|part| changes.iter().any(|change| change.opens(&part.name))) {
            let line = Line::start(part.config.clone()).map_err(|error| input(&error))?;
            lines.push((part.name.clone(), part.budget, line));
        }
        let openings =
            faces::prepare(&new, |table| changes.iter().any(|change| change.opened_face() == Some(table)))?;
        let leaving: Vec<&str> = changes.iter().filter_map(Change::removed_drive).collect();
        let gone: Vec<_> = leaving.iter().filter_map(|name| fleet.drive(name)).collect();
        self.leave(leaving.iter().map(ToString::to_string).collect());
        let actions = fleet.remove(&leaving, config.shutdown).await;
        self.leave(Vec::new());
        // Whoever has to be heard goes with the motor that he has started and that was left turning.
        let gone: Vec<_> = gone.iter().map(|handle| Leaving::of(plant, handle)).collect();
        let mut leavings =
            std::mem::take(&mut *self.0.leavings.lock().unwrap_or_else(PoisonError::into_inner));
        leavings.retain(|before| gone.iter().all(|leaving| leaving.place != before.place));
        leavings.extend(gone);
        let turning = actions.iter().filter(|(_, action)| action.is_alarm());
        let turning: Vec<String> = turning.map(|(name, action)| format!("{name}: {action}")).collect();
        for name in changes.iter().filter_map(Change::closed_line) {
            if let Some(line) = fleet.remove_line(name) {
                closing::close(&line).await;
            }
        }
        for line in &mut config.lines {
            line.drives.retain(|drive| !leaving.contains(&&*drive.settings.name));
        }
        config.lines.retain(|line| !changes.iter().any(|change| change.closed_line() == Some(&line.name)));
        // Those who leave are gone and those who come are not there yet: no name means another drive than it is meant to.
        config.groups = std::mem::take(&mut new.groups);
        plant.set_groups(config.groups.clone());
        let names_problem = plant.names_problem();
        // Who comes has his identity when he is there.
        let renamed = run::tell_names(&self.0.names, &new.lines, &config.groups);
        // Nobody asks for a drive that is not there yet.
        plant.set_options(run::options(&new.lines));
        let made = match self.may_begin() {
            Ok(()) => add_all(plant, &changes, &new, &lines, &mut leavings, &self.0.kept),
            Err(_) => Err(FleetError::ShutDown),
        };
        let made = made.map(|()| {
            tell_renamed(plant, &changes, &renamed);
            settle(plant, config, &mut new, &changes)
        });
        *self.0.leavings.lock().unwrap_or_else(PoisonError::into_inner) = leavings;
        // Also where nothing has changed: what is kept may have been mended.
        run::tell_names(&self.0.names, &config.lines, &config.groups);
        self.0.opened.tell(&config.lines);
        let closed: Vec<&str> = changes.iter().filter_map(Change::closed_face).collect();
        self.0.faces.exchange(&closed, openings).await;
        config.faces = std::mem::take(&mut new.faces);
        config.added = new.added.take();
        if !changes.is_empty() || plant.names_problem() != names_problem {
            plant.revisions().begin_anew();
        }
        let made = made.map_err(|error| (error.to_string(), halves(&changes)));
        match made.and_then(|refused| refused.map_or(Ok(()), Err)) {
            Ok(()) => Ok(Done { changes, turning }),
            Err((why, half)) => {
                let told = format!("ONLY IN PART ({why}): {}", half.join("; "));
                let parts = (!turning.is_empty()).then(|| may_turn(&turning)).into_iter().chain([told]);
                Err(Failure::Drive(parts.collect::<Vec<_>>().join("; ")))
            }
        }
    }

    /// These are being taken out.
    fn leave(&self, leaving: Vec<String>) {
        *self.0.leaving.lock().unwrap_or_else(PoisonError::into_inner) = leaving;
    }
}

/// What a reload has done.
pub(super) struct Done {
    pub(super) changes: Vec<Change>,
    /// Who was removed and may turn.
    pub(super) turning: Vec<String>,
}

pub(super) fn may_turn(turning: &[String]) -> String {
    format!("THE MOTOR MAY TURN: {}", turning.join("; "))
}

/// Adds lines and drives, all of them or none.
fn add_all(
    plant: &Plant,
    changes: &[Change],
    new: &Config,
    lines: &[(String, LineBudget, Line)],
    leavings: &mut Leavings,
    kept: &Kept,
) -> Result<(), FleetError> {
    plant.fleet().extend(|mut builder| {
        for (name, budget, line) in lines {
            builder = builder.line_with(&**name, line.clone(), |_| *budget);
        }
        for part in &new.lines {
            let is_added = |drive: &&DrivePart| {
                changes.iter().any(|change| change.added_drive() == Some(&*drive.settings.name))
            };
            builder = part.drives.iter().filter(is_added).fold(builder, |builder, drive| {
                let place = part.place(drive.name);
                add(builder, part, drive, taken(leavings, kept, plant, &place, &drive.settings.name))
            });
        }
        // The file was planned as a whole.
        builder.whatever_the_plan()
    })
}

/// Tells who is called otherwise and was not there meanwhile: of those who went on the fleet tells.
fn tell_renamed(plant: &Plant, changes: &[Change], renamed: &[(String, String)]) {
    let went_on = |name: &str| {
        let mut renamed = changes.iter().filter_map(Change::renamed);
        renamed.any(|(_, settings)| settings.name == name)
    };
    let others = renamed.iter().filter(|(_, new)| !went_on(new));
    others.for_each(|(old, new)| plant.tell_renamed(old, new));
}

/// Gives the drives their new settings, and makes the lines of `config` those that there are now. What holds from the next
/// start on stays in it as it was. Gives why settings were not taken, and by whom.
fn settle(
    plant: &Plant,
    config: &mut Config,
    new: &mut Config,
    changes: &[Change],
) -> Option<(String, Vec<String>)> {
    let fleet = plant.fleet();
    let mut refused: Vec<(String, FleetError)> = Vec::new();
    for (old, settings) in changes.iter().filter_map(Change::renamed) {
        match fleet.rename(old, settings.clone()) {
            Ok(()) => plant.renamed(old, &settings.name),
            Err(error) => refused.push((settings.name.clone(), error)),
        }
    }
    for settings in changes.iter().filter_map(Change::settings) {
        if let Err(error) = fleet.reconfigure(settings.clone()) {
            refused.push((settings.name.clone(), error));
        }
    }
    let called_before = |name: &str| {
        let mut renamed = changes.iter().filter_map(Change::renamed);
        renamed.find_map(|(old, settings)| (settings.name == name).then_some(old))
    };
    let mut before = std::mem::replace(&mut config.lines, std::mem::take(&mut new.lines));
    for line in &mut config.lines {
        let Some(old) = before.iter_mut().find(|old| old.name == line.name) else { continue };
        line.budget = old.budget;
        for drive in &mut line.drives {
            let name = &drive.settings.name;
            let name = called_before(name).unwrap_or(name);
            let Some(old) = old.drives.iter().find(|old| old.settings.name == name) else { continue };
            if old.name == drive.name {
                // One that was not exchanged goes on by the profile with which it was opened.
                drive.name = old.name;
            }
            if refused.iter().any(|(name, _)| *name == drive.settings.name) {
                drive.settings = old.settings.clone();
            }
        }
    }
    let (_, why) = refused.first()?;
    let half = |change: &Change| match change.settings().or(change.renamed().map(|(_, settings)| settings)) {
        Some(settings) if refused.iter().any(|(name, _)| *name == settings.name) => change.half(),
        _ => Some(change.to_string()),
    };
    Some((why.to_string(), changes.iter().filter_map(half).collect()))
}

/// What holds when lines and drives could not be added.
fn halves(changes: &[Change]) -> Vec<String> {
    changes.iter().filter_map(Change::half).collect()
}
