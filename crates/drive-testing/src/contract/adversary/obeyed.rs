//! What is sent, in which class, how often, and in which order; and what is claimed of a drive that keeps its words.

use std::{iter, time::Duration};

use drive_core::{Class, Control, Direction, Error, StopMode, Withdrawn};

use super::{CALLS, Complaint, OTHER, SETPOINT, SETTLED, Stage};
use crate::{
    contract::{Contract, is_given},
    recorder::{Habit, Heard},
};

/// Which requests there were, for a complaint.
fn told(heard: &[Heard]) -> String {
    let one = |heard: &Heard| {
        let what = if heard.writes() { "writes" } else { "reads" };
        let register = heard.register.map_or_else(String::new, |register| format!(" {register}"));
        format!("{what}{register} ({})", heard.class())
    };
    heard.iter().map(one).collect::<Vec<_>>().join(", ")
}

impl Contract {
    /// What a drive is sent that does as it is told.
    pub(super) async fn obeyed(&self) -> Vec<Complaint> {
        let mut complaints = self.classes().await;
        complaints.extend(self.stop_before_all_else(true).await);
        complaints.extend(self.stop_before_all_else(false).await);
        complaints.extend(self.run_command_once().await);
        complaints.extend(self.what_acts_once_is_written_once().await);
        complaints.extend(self.no_command_is_a_parameter().await);
        complaints.extend(self.reset_is_an_edge().await);
        complaints.extend(self.a_drive_without_a_trip_is_not_reset().await);
        complaints.extend(self.somebody_at_the_drive_keeps_what_he_has().await);
        complaints.extend(self.who_asks_is_told_what_a_start_would_be().await);
        complaints.extend(self.forgets().await);
        complaints
    }

    /// Each method sets its class by itself.
    async fn classes(&self) -> Vec<Complaint> {
        let mut stage = self.stage("each method travels in its class").await;
        let lifetime = Some(Duration::from_secs(1));
        stage.rig.drive.lifetimes_mut().command = lifetime;

        let _ = stage.rig.drive.status().await;
        stage.expect("a status", |heard| heard.class() == Class::Status && !heard.writes());
        let _ = stage.rig.drive.measurements().await;
        stage.expect("measurements", |heard| heard.class() <= Class::Status && !heard.writes());
        let _ = stage.rig.drive.set_setpoint(SETPOINT.into()).await;
        let timely = |heard: &Heard| heard.class() == Class::Command && heard.terms.lifetime.is_some();
        stage.expect_owed("a setpoint");
        stage.expect("the write of a setpoint", |heard| !heard.writes() || timely(heard));
        let _ = stage.rig.drive.start(Direction::Forward).await;
        let heard = stage.witness.heard();
        if heard.first().is_none_or(Heard::writes) {
            stage.blame(format!("a start reads a fresh status before it writes: it {}", told(&heard)));
        }
        stage.expect_owed("a start");
        stage.expect("the write of a start", |heard| !heard.writes() || timely(heard));
        let _ = stage.rig.drive.stop(StopMode::Ramp).await;
        stage.expect("the write of a stop", |heard| !heard.writes() || heard.class() == Class::Stop);
        stage.complaints
    }

    /// A stop is written before anything is read, whatever is known of the drive.
    async fn stop_before_all_else(&self, seen_before: bool) -> Vec<Complaint> {
        let mut stage = self.stage("a stop is written before anything is read").await;
        if !seen_before {
            stage.rig.drive.forget();
        }
        let _ = stage.rig.drive.stop(StopMode::Ramp).await;
        let heard = stage.witness.heard();
        if !heard.first().is_some_and(|first| first.writes() && first.class() == Class::Stop) {
            stage.blame(format!("known before: {seen_before}; it {}", told(&heard)));
        }
        stage.complaints
    }

    /// A run command is written once.
    async fn run_command_once(&self) -> Vec<Complaint> {
        let mut stage = self.stage("a run command is written once").await;
        let Some(control) = self.control else { return Vec::new() };
        let _ = stage.rig.drive.set_setpoint(SETPOINT.into()).await;
        stage.witness.from_now_on(Habit::Obeys);
        let started = stage.rig.drive.start(Direction::Forward).await;
        let words = stage.witness.written_to(control.register);
        let runs = words.last().map_or(0, |last| words.iter().filter(|word| *word == last).count());
        if runs != 1 {
            stage.blame(format!("{started:?} after the control words {words:04X?}: {runs} run commands"));
        }
        stage.live(SETTLED).await;
        if started.is_ok() && !stage.seen().running {
            let seen = stage.seen();
            stage.blame(format!("the start is confirmed and the motor does not run: {seen:?}"));
        }
        stage.complaints
    }

    /// A word that acts when it is written is an edge, and is written once whichever answer is lost.
    async fn what_acts_once_is_written_once(&self) -> Vec<Complaint> {
        let Some(control) = self.control.filter(|control| !control.once.is_empty()) else {
            return Vec::new();
        };
        let mut complaints = Vec::new();
        for number in 0..CALLS {
            let mut stage = self.stage("a word that acts once is an edge, and is written once").await;
            let _ = stage.rig.drive.set_setpoint(SETPOINT.into()).await;
            stage.witness.from_now_on(Habit::LosesAnswer(number));
            let _ = stage.rig.drive.start(Direction::Forward).await;
            let heard = stage.witness.heard();
            let acts = |heard: &&Heard| {
                heard.written_to(control.register).is_some_and(|word| control.once.contains(&word))
            };
            let acted: Vec<&Heard> = heard.iter().filter(acts).collect();
            if acted.len() > 1 || acted.iter().any(|heard| !heard.is_edge()) {
                stage.blame(format!("the answer of call {number} is lost: it sent {acted:?}"));
            }
            complaints.append(&mut stage.complaints);
            if heard.len() <= number {
                break;
            }
        }
        complaints
    }

    /// A control word goes out by an order, and never as the value of a parameter.
    async fn no_command_is_a_parameter(&self) -> Vec<Complaint> {
        let mut stage = self.stage("no command goes out as a parameter").await;
        let Some(control) = self.control else { return Vec::new() };
        for row in self.capabilities.rows.iter().filter(|row| row.address == control.register) {
            for word in control.words {
                stage.witness.from_now_on(Habit::Obeys);
                let _ = stage.rig.drive.write_parameter(row, *word).await;
                if stage.witness.heard().iter().any(|heard| heard.written_to(control.register).is_some()) {
                    stage.blame(format!("{word:04X}h goes out by {}", row.code));
                }
            }
        }
        stage.complaints
    }

    /// A reset is written and cleared; one that has a register of its own is an edge there.
    async fn reset_is_an_edge(&self) -> Vec<Complaint> {
        let mut stage = self.stage("a reset is one edge that is cleared").await;
        let (Some(control), Some(trip)) = (self.control, self.trip) else { return Vec::new() };
        // The bus has command: some drives give it to whoever wrote last, and a reset is no way to take it.
        if stage.run().await.is_none() {
            return stage.complaints;
        }
        stage.rig.machine.trip(trip);
        stage.live(SETTLED).await;
        let _ = stage.rig.drive.status().await;
        stage.witness.from_now_on(Habit::Obeys);
        let _ = stage.rig.drive.reset_faults().await;
        let words = stage.witness.written_to(control.register);
        let heard = stage.witness.heard();
        if words.is_empty() && heard.iter().filter(|heard| heard.writes() && heard.is_edge()).count() == 1 {
            return stage.complaints;
        }
        let edge = words.split_last().is_some_and(|(last, before)| before.iter().any(|word| word != last));
        if !edge {
            stage.blame(format!("it wrote {words:04X?} and nothing after it"));
        }
        // What was there before must not come back in a reset that is held.
        let resets = words.iter().filter(|word| words.last() != Some(*word)).count();
        if resets > 1 && words.iter().collect::<std::collections::BTreeSet<_>>().len() == 2 {
            stage.blame(format!("it wrote {words:04X?}: more than one edge"));
        }
        stage.complaints
    }

    /// A reset of a drive that has not tripped is none: what resets may do something else there, such as end a run.
    async fn a_drive_without_a_trip_is_not_reset(&self) -> Vec<Complaint> {
        let mut stage = self.stage("a drive that has not tripped is left alone by a reset").await;
        let _ = stage.rig.drive.reset_faults().await;
        let heard = stage.witness.heard();
        if heard.iter().any(Heard::writes) {
            stage.blame(format!("it {}", told(&heard)));
        }
        stage.complaints
    }

    /// A motor that somebody runs at the drive: he is told as the one who has it, and a withdrawal, where no run command of this side stands,
    /// leaves him his motor.
    async fn somebody_at_the_drive_keeps_what_he_has(&self) -> Vec<Complaint> {
        let mut stage = self.stage("what somebody runs at the drive is told as his, and not withdrawn").await;
        if !stage.run_at_the_drive().await {
            return stage.complaints;
        }
        match stage.rig.drive.status().await {
            Ok(status) if status.control == Some(Control::Bus) => {
                let seen = stage.seen();
                stage.blame(format!("told under the control of the bus: {status}; {seen:?}"));
            }
            _ => {}
        }
        stage.witness.from_now_on(Habit::Obeys);
        let withdrawn = stage.rig.drive.withdraw().await;
        let writes = stage.witness.heard().iter().any(Heard::writes);
        stage.live(SETTLED).await;
        if writes || matches!(withdrawn, Ok(Withdrawn::Ended(_))) || !stage.seen().running {
            let seen = stage.seen();
            stage.blame(format!("withdrawn, written: {writes}: {withdrawn:?}; {seen:?}"));
        }
        stage.complaints
    }

    /// Whether a start would be refused is judged as the start itself judges it, and nothing is written for it.
    async fn who_asks_is_told_what_a_start_would_be(&self) -> Vec<Complaint> {
        let mut stage = self.stage("whether it may start is judged as by the start itself").await;
        for trip in iter::once(None).chain(self.trip.map(Some)) {
            if let Some(trip) = trip {
                stage.rig.machine.trip(trip);
                stage.live(SETTLED).await;
            }
            stage.witness.from_now_on(Habit::Obeys);
            let asked = stage.rig.drive.may_start(Direction::Forward, None).await;
            if stage.witness.heard().iter().any(Heard::writes) {
                stage.blame(format!("asked whether it may start, it {}", told(&stage.witness.heard())));
            }
            let started = match stage.rig.drive.start(Direction::Forward).await.map(drop) {
                // It was sent: what its drive does not tell is no refusal.
                Err(Error::NotConfirmed { .. }) => Ok(()),
                started => started,
            };
            if asked != started {
                stage.blame(format!("tripped: {}; it may: {asked:?}, it does: {started:?}", trip.is_some()));
            }
        }
        stage.complaints
    }

    /// What is read once is read again after `forget`.
    async fn forgets(&self) -> Vec<Complaint> {
        let mut stage = self.stage("what was read once is read again after forget").await;
        stage.rig.drive.forget();
        let first = stage.reads_of_a_start().await;
        let again = stage.reads_of_a_start().await;
        stage.rig.drive.forget();
        let after = stage.reads_of_a_start().await;
        let missing: Vec<u16> = first
            .iter()
            .filter(|register| !again.contains(register) && !after.contains(register))
            .copied()
            .collect();
        if !missing.is_empty() {
            stage.blame(format!("registers {missing:?} were read at first, and not after forget"));
        }
        stage.complaints
    }

    /// What is claimed of a drive that acknowledges every write and keeps its words.
    pub(super) async fn disobeyed(&self) -> Vec<Complaint> {
        let mut stage = self.stage("nothing is confirmed that the drive does not do").await;
        let given = stage.rig.drive.set_setpoint(SETPOINT.into()).await;
        if !is_given(&given) {
            stage.blame(format!("a plain setpoint is not confirmed: {given:?}"));
        }
        stage.witness.from_now_on(Habit::KeepsItsWords);
        let (heard, other) = (stage.witness.clone(), stage.rig.drive.set_setpoint(OTHER.into()).await);
        if other.is_ok() && heard.heard().iter().any(Heard::writes) {
            stage.blame("a setpoint is confirmed to a drive that keeps another".to_owned());
        }
        if let Ok(status) = stage.rig.drive.start(Direction::Forward).await {
            stage.blame(format!("a start is confirmed to a drive that keeps its word: {status}"));
        }
        stage.witness.from_now_on(Habit::Obeys);
        if stage.run().await.is_some() {
            stage.witness.from_now_on(Habit::KeepsItsWords);
            if let Ok(stopped) = stage.rig.drive.stop(StopMode::Ramp).await {
                let seen = stage.seen();
                stage.blame(format!("a stop is confirmed to a drive that runs on: {stopped}; {seen:?}"));
            }
            let writes = stage.witness.heard().iter().filter(|heard| heard.writes()).count();
            if writes < 2 {
                stage.blame(format!(
                    "a stop that does not show is written again: {writes} writes in its time"
                ));
            }
            if let Ok(Withdrawn::Ended(status)) = stage.rig.drive.withdraw().await {
                stage.blame(format!("a withdrawal is confirmed to a drive that runs on: {status}"));
            }
        }
        stage.stop_at_last().await;
        if let Some(trip) = self.trip {
            stage.rig.machine.trip(trip);
            stage.witness.from_now_on(Habit::KeepsItsWords);
            if let Ok(status) = stage.rig.drive.reset_faults().await {
                stage.blame(format!("a reset is confirmed to a drive that stays tripped: {status}"));
            }
        }
        stage.complaints
    }
}

impl Stage {
    /// That all that was heard since the last question is so.
    fn expect(&mut self, what: &str, is_so: impl Fn(&Heard) -> bool) {
        let heard = self.witness.heard();
        if heard.is_empty() || !heard.iter().all(is_so) {
            self.blame(format!("{what}: it {}", told(&heard)));
        }
        self.witness.from_now_on(Habit::Obeys);
    }

    /// What is read for an order dies with it, so that none is written late, and what judges it once it is written does not.
    fn expect_owed(&mut self, what: &str) {
        let heard = self.witness.heard();
        let Some(first) = heard.iter().position(Heard::writes) else { return };
        let last = heard.iter().rposition(Heard::writes).unwrap_or(first);
        let dies = |heard: &Heard| heard.terms.lifetime.is_some();
        if !heard[..first].iter().all(dies) {
            self.blame(format!(
                "{what} is read for without an end before it is written: it {}",
                told(&heard)
            ));
        }
        if heard[last..].iter().any(|heard| !heard.writes() && dies(heard)) {
            self.blame(format!("what judges {what} dies of the lifetime of the order: it {}", told(&heard)));
        }
    }

    /// Somebody takes the control at the drive, and runs its motor by a key or an input of which the level or the edge counts. False: his machine
    /// has none.
    async fn run_at_the_drive(&mut self) -> bool {
        let around = self.rig.machine.surroundings();
        let analog = around.analog_inputs.iter().map(|name| format!("analog {name} 60%"));
        let takes = ["panel takes".to_owned(), "panel reference 25Hz".to_owned()].into_iter().chain(analog);
        let terminals = around.terminals.iter().map(|name| format!("terminal {name} on"));
        let runs = iter::once("panel run".to_owned()).chain(terminals);
        for deed in takes.chain(runs) {
            let line = format!("{} {deed}", self.rig.machine.name());
            // What this machine has no part for does not happen.
            let _ = self.rig.simulated.control(&line);
            self.live(Duration::from_secs(2)).await;
            if self.seen().running {
                self.live(SETTLED).await;
                return self.seen().running;
            }
        }
        false
    }

    /// The registers that are read by a status, a setpoint and a start, in order. What only takes its turn is not among them.
    async fn reads_of_a_start(&mut self) -> Vec<u16> {
        self.witness.from_now_on(Habit::Obeys);
        let _ = self.rig.drive.status().await;
        let _ = self.rig.drive.set_setpoint(SETPOINT.into()).await;
        let _ = self.rig.drive.start(Direction::Forward).await;
        let heard = self.witness.heard();
        let _ = self.rig.drive.stop(StopMode::Ramp).await;
        self.live(SETTLED).await;
        heard.iter().filter(|heard| !heard.writes()).filter_map(|heard| heard.register).collect()
    }
}
