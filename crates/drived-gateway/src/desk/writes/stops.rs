//! Stops: carried out whatever else stands in what was written.

use drive_core::{Drive, Intent, StopMode};
use drive_families::Family;
use drive_fleet::{DriveHandle, Snapshot, Until};
use futures_util::FutureExt as _;
use tokio::time::{Instant, timeout_at};

use super::{Refusal, Who, busy, disables_voltage, shows_fault, stands};
use crate::{desk::Desk, pdu::Ask};
use drived_doors::Caller;
use drived_plant::plant::commands::{Action, Expects, LONGEST_LIFETIME, Lifetime, Request, Target};

/// A stop that waits for nothing, by this mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Stop(pub(super) StopMode);

impl Desk {
    /// Whether a write stops the motor, so that it goes ahead of what waits: a word that is a stop; or one without a run
    /// command, unless the motor is known to stand and nothing is about to start it.
    pub(crate) fn stop_in(&self, unit: u8, ask: &Ask) -> Option<Stop> {
        let Ask::Write { .. } = ask else { return None };
        if unit == 0 && self.config.broadcast {
            return self.broadcast_stop(ask);
        }
        let drive = self.drive(unit).filter(|_| self.config.rights.stop)?;
        let by_a_word = self.intents_without_reading(&drive, ask).find_map(|intent| match intent {
            Intent::Prepare(_) if stands(&drive) => None,
            Intent::ResetFaults(_) if stands(&drive) || shows_fault(&drive) => None,
            intent => self.stops_by(&drive, intent),
        });
        let places: Vec<_> = ask.places().collect();
        by_a_word.or_else(|| self.speaker(&drive)?.stopped_by(&places)).map(Stop)
    }

    /// How what a word asks stops a motor that runs, if it does. In a quick stop of the chart no word acts but one that disables the
    /// voltage: what else would stop it, as a shutdown that lets it coast, leaves it to that.
    pub(super) fn stops_by(&self, drive: &DriveHandle, intent: Intent) -> Option<StopMode> {
        let mode = intent.stops()?;
        let is_left = !disables_voltage(intent) && self.plant.quick_stops().locks(drive);
        Some(if is_left { StopMode::Fast } else { mode })
    }

    /// Stops a motor by what a client has written: a quick stop locks it from its word on, and one that disables the voltage ends that
    /// once the drive has shown it.
    pub(super) async fn stop_as_asked(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        Stop(mode): Stop,
        ask: &Ask,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        self.clients.write_without_run(who.by, drive.place());
        let asked: Vec<Intent> = self.intents_without_reading(drive, ask).collect();
        if asked.contains(&Intent::QuickStop) {
            self.plant.quick_stops().lock(drive);
        }
        self.stop(who.caller, drive, mode, arrived).await?;
        if asked.iter().any(|intent| disables_voltage(*intent)) && !asked.contains(&Intent::QuickStop) {
            self.plant.quick_stops().unlock(drive);
        }
        Ok(())
    }

    /// What each word of a write asks, as far as that needs no exchange.
    pub(super) fn intents_without_reading(
        &self,
        drive: &DriveHandle,
        ask: &Ask,
    ) -> impl Iterator<Item = Intent> + use<> {
        let mut speaker = self.speaker(drive);
        let words: Vec<(u16, u16)> = ask.writes().filter(|_| !ask.is_of_coils()).collect();
        words.into_iter().filter_map(move |(register, word)| {
            speaker.as_mut()?.intent(register, word).now_or_never()?.ok().flatten()
        })
    }

    /// The drive of the family that knows its words, on the same line. It reads units; it writes nothing.
    pub(super) fn speaker(&self, drive: &DriveHandle) -> Option<Box<dyn Drive>> {
        let family: Family = drive.capabilities().key.parse().ok()?;
        let (_, line) = drive.line();
        let options = self.plant.options(drive.name());
        Some(family.open_with(line.slave(drive.slave().number()), drive.slave(), &options))
    }

    /// Whether the words of a broadcast stop the drives of this gateway.
    pub(super) fn broadcast_stop(&self, ask: &Ask) -> Option<Stop> {
        // What a word of one drive by file asks of another nothing tells: it may be a start there.
        let is_built_in = |drive: &DriveHandle| {
            Family::BUILT_IN.iter().any(|family| family.capabilities().key == drive.capabilities().key)
        };
        let drives: Vec<_> = self.drives().into_iter().filter(is_built_in).collect();
        let intents = drives.iter().flat_map(|drive| self.intents_without_reading(drive, ask));
        stop_of_all(intents)
    }

    /// Stops a motor. Confirmed when the drive shows that no run command is in force any more; it may still come down.
    pub(super) async fn stop(
        &self,
        caller: &Caller,
        drive: &DriveHandle,
        mode: StopMode,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        let request = Request {
            id: None,
            target: Target::Drive(drive.name().to_string()),
            action: Action::Stop(mode.into()),
            expects: Some(Expects::of(drive)),
            lifetime: Lifetime::Usual(LONGEST_LIFETIME),
            arrived,
        };
        self.record(caller, drive, &request).whenever();
        let left = (arrived + self.config.patience).saturating_duration_since(Instant::now());
        let settled = self.plant.command(caller, request, left);
        // By what it has shown since: that it took a stop of before does not tell that nobody has run it behind that.
        let has_taken = |snapshot: &Snapshot| {
            let is_seen = snapshot.status.as_ref().is_some_and(|status| status.at > arrived);
            is_seen && snapshot.stop.is_some_and(|stop| stop.taken)
        };
        let taken = drive.wait_until(has_taken);
        // It is on its way before anything is looked at, and goes on whoever waits.
        tokio::select! {
            biased;
            view = settled => match view {
                Ok(view) => self.judged(drive, view.outcome, view.text.as_deref()),
                Err(rejected) => Err(Refusal::rule(rejected.to_string())),
            },
            // A drive that has left shows nothing any more.
            Some(()) = async { has_taken(&*taken.await).then_some(()) } => Ok(()),
        }
    }

    /// The setpoint that was written together with a stop.
    pub(super) async fn setpoint_beside(
        &self,
        who: Who<'_>,
        drive: &DriveHandle,
        ask: &Ask,
        arrived: Instant,
    ) -> Result<(), Refusal> {
        if ask.is_of_coils() || ask.writes().count() == 1 {
            return Ok(());
        }
        let deadline = arrived + self.config.patience;
        let wanted = timeout_at(deadline, self.wanted(drive, ask)).await.map_err(|_| busy())??;
        match wanted.and_then(|wanted| wanted.setpoint) {
            Some(setpoint) if drive.snapshot().setpoint != Some(setpoint) => {
                let action = Action::Setpoint { setpoint, until: Until::InForce };
                let given = self.order(who, drive, action, arrived, deadline).await;
                given.map_err(|Refusal { code, why }| {
                    Refusal::new(code, format!("it stops; its setpoint: {why}"))
                })
            }
            _ => Ok(()),
        }
    }
}

/// How the words stop all, if they do, by what they ask of each drive that understands them: whoever speaks of one family to all means
/// all of them, so that they do when they stop any and start none. The mode is that of the first.
fn stop_of_all(intents: impl Iterator<Item = Intent>) -> Option<Stop> {
    let mut first = None;
    for intent in intents {
        match intent {
            Intent::Start(_) => return None,
            other => first = first.or(other.stops().map(Stop)),
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use drive_core::Direction;

    use super::*;

    #[test]
    fn words_for_one_family_stop_every_drive_of_a_gateway_that_none_of_them_starts() {
        let stop = Intent::Stop(StopMode::Freewheel);
        assert_eq!(stop_of_all([].into_iter()), None, "nobody understands it");
        assert_eq!(stop_of_all([stop, stop].into_iter()), Some(Stop(StopMode::Freewheel)));
        assert_eq!(stop_of_all([Intent::Start(Direction::Forward), stop].into_iter()), None);
        assert_eq!(stop_of_all([stop, Intent::Start(Direction::Reverse)].into_iter()), None);
    }
}
