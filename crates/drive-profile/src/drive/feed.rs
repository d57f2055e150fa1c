//! A communication watchdog that only a command word feeds: the word that stands is written once more, where it is seen to stand.
//!
//! A drive whose run command acts for as long as it stands would be started by it where it has just come back from a power cycle, or
//! was stopped by somebody else. So the run word goes out only while the drive is seen to run by it, with an output that does not come
//! down below the setpoint as behind a stop, and only so shortly behind that look that no drive can have been switched off and on
//! in between.

use std::time::Duration;

use drive_core::{Class, Command as Order, Control, Frequency, Port, Result, State, Status, Verdict};
use tokio::time::Instant;

use super::ProfileDrive;
use crate::format::{Acts, FedBy, Step};

/// From a look at a drive until a word that repeats what was seen is on the line: makers give their drives a second and more from power-up
/// until they answer (Toshiba VF-S15 E6581913; Hitachi WJ200 B-26).
const REPEATED_WITHIN: Duration = Duration::from_millis(500);

/// The part of a watchdog's time after which it is fed.
const FEED_PART: u32 = 3;

impl<P: Port> ProfileDrive<P> {
    /// Feeds the watchdog behind a look that began then, where it is due: at the most one exchange.
    pub(super) async fn feed(&mut self, status: &Status, began: Instant) -> Result<()> {
        let Some(time) = self.owner.watchdog.filter(|_| self.is_fed_by_commands()) else { return Ok(()) };
        let before = std::mem::replace(&mut self.output_seen, status.output_frequency);
        if !self.guarded.hold || self.fed.is_some_and(|at| at.elapsed() < time / FEED_PART) {
            return Ok(());
        }
        let Some((step, order)) = self.standing(status, before) else { return Ok(()) };
        let age = status.at.unwrap_or(began).elapsed();
        let Some(left) = REPEATED_WITHIN.checked_sub(age) else { return Ok(()) };
        let usual = self.registers.lifetimes.keep_alive;
        self.registers.lifetimes.keep_alive = Some(usual.map_or(left, |usual| usual.min(left)));
        let fed = self.step(&step, Class::KeepAlive, order).await;
        self.registers.lifetimes.keep_alive = usual;
        self.fed = Some(Instant::now());
        fed
    }

    /// Whether a command word feeds its watchdog, and may be repeated. One that acts as an edge would be a new command each time.
    fn is_fed_by_commands(&self) -> bool {
        let file = self.profile.file();
        let fed_by = file.watchdog.given().and_then(|watchdog| watchdog.get_ref().fed_by.given());
        let acts = file.command.given().map(|command| command.get_ref().acts);
        fed_by == Some(&FedBy::CommandWrite) && acts == Some(Acts::Level)
    }

    /// The command of this side that this status shows to stand: a run command while the motor runs by it, or the stop behind it.
    fn standing(&self, status: &Status, before: Option<Frequency>) -> Option<(Step, Order)> {
        let file = self.profile.file();
        let Some(lease) = self.watch.run.lease() else {
            // A trip that has its own word, and a motor that somebody else runs, are left alone.
            let stop = file.stop.ramp.given()?.get_ref();
            let stands = matches!(status.state, State::Ready | State::Disabled | State::NotReady);
            let ours = self.fed.is_some() && status.control != Some(Control::Local);
            let step = stop.steps.first().filter(|_| stands && ours)?;
            return Some((step.get_ref().clone(), Order::Withdraw));
        };
        let output = status.output_frequency?;
        let below = status.reference.is_none_or(|reference| output < reference);
        // It comes down as behind a stop, of which this look is the first: the next one tells.
        if below && before.is_none_or(|before| output < before) {
            return None;
        }
        let lacks = matches!(status.verdict, None | Some(Verdict::NotInForce { .. }));
        let runs = status.state == State::Running && self.comes_down.is_none();
        if lacks || !runs || !self.watch.run.has_arrived() {
            return None;
        }
        let start = self.profile.start(lease.direction)?;
        let step = start.steps.last()?.get_ref();
        let is_it = file.run_word(start, self.kept) == Some(lease.word);
        is_it.then(|| (step.clone(), Order::Start(lease.direction)))
    }
}
