//! What is kept of the run commands of this side beyond the life of the program: [`RunKept`].

use std::{sync::Arc, time::Duration};

use drive_core::Lease;
use tokio::{
    sync::{mpsc, oneshot},
    time::timeout,
};

use crate::{place::Place, settings::RunRecord, stop_order::StopOrder};

/// How long a start waits at the most until its record is kept: a disk that hangs holds up no pump for ever. Less than half of
/// the second that a command may wait, and that goes on meanwhile.
const KEPT_WITHIN: Duration = Duration::from_millis(400);

/// What is to be kept of a drive's run command, and of a stop that is not confirmed, from now on, in the order in which it is told. **A start waits until its record is
/// kept**, 0.4 s at the most, so that a program that is killed has told the next one of every motor that it started.
#[derive(Debug)]
#[non_exhaustive]
pub struct RunKept {
    /// The drive, by the name that it has now.
    pub drive: Arc<str>,
    /// By what it is kept: which machine the drive is, whatever it is called.
    pub place: Place,
    /// The run command that stands, or is about to be given, and the stop that is not confirmed; `None`: none of this side stands any
    /// more, and no stop is under way, as the drive's own words have shown.
    pub run: Option<RunRecord>,
    kept: Option<oneshot::Sender<()>>,
}

impl RunKept {
    /// It is kept.
    pub fn kept(self) {
        if let Some(kept) = self.kept {
            // Who does not wait any more needs not know.
            let _ = kept.send(());
        }
    }
}

/// Where a drive tells what is to be kept of its run command.
#[derive(Debug)]
pub(crate) struct Keeper {
    drive: Arc<str>,
    place: Place,
    keeps: Option<mpsc::UnboundedSender<RunKept>>,
    told: Option<RunRecord>,
}

impl Keeper {
    pub(crate) fn new(
        drive: Arc<str>,
        place: Place,
        keeps: Option<mpsc::UnboundedSender<RunKept>>,
        kept: Option<RunRecord>,
    ) -> Self {
        let mut keeper = Self { drive, place, keeps, told: None };
        if kept.is_some() {
            // Who keeps it may have had it under another name.
            keeper.tell(kept, None);
        }
        keeper
    }

    /// The run command of this side as it stands now, and the stop that is not confirmed. A stop outlives the run command that it ends,
    /// as one by direct current does. The identity counts that the drive had when the run command was given, and of a stop alone that
    /// which it said last.
    pub(crate) fn follow(
        &mut self,
        lease: Option<Lease>,
        stop: Option<StopOrder>,
        identity: impl FnOnce() -> Option<String>,
    ) {
        let known = self.told.as_ref().filter(|told| lease.is_none() || told.lease == lease);
        let known = known.map(|told| told.identity.clone());
        let identity = || match lease {
            Some(_) => known.unwrap_or_else(identity),
            None => identity().or(known.flatten()),
        };
        let run = RunRecord::of(identity, lease, stop);
        if run != self.told {
            self.tell(run, None);
        }
    }

    /// What was kept by an earlier run, and is not decided yet, is to be stopped.
    pub(crate) fn note_stop(&mut self, stop: StopOrder) {
        let noted = self.told.clone().map(|told| told.stopped_by(Some(stop)));
        if noted != self.told {
            self.tell(noted, None);
        }
    }

    /// The drive may be called otherwise now: what is kept of it has the name that it has.
    pub(crate) fn follow_name(&mut self, name: Arc<str>) {
        if self.drive == name {
            return;
        }
        self.drive = name;
        if let Some(run) = self.told.clone() {
            self.tell(Some(run), None);
        }
    }

    /// A run command is about to be given.
    pub(crate) async fn before(&mut self, run: Option<RunRecord>) {
        if self.keeps.is_none() || self.told == run {
            return;
        }
        let (kept, is_kept) = oneshot::channel();
        self.tell(run, Some(kept));
        // A keeper that has gone keeps nothing, and holds up nothing.
        let _ = timeout(KEPT_WITHIN, is_kept).await;
    }

    fn tell(&mut self, run: Option<RunRecord>, kept: Option<oneshot::Sender<()>>) {
        self.told.clone_from(&run);
        if let Some(keeps) = &self.keeps {
            let (drive, place) = (Arc::clone(&self.drive), self.place.clone());
            let _ = keeps.send(RunKept { drive, place, run, kept });
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, StopMode};

    use super::*;

    const RUN: Lease = Lease::new(Direction::Forward, 0x000F);

    fn kept_of(mut kept: mpsc::UnboundedReceiver<RunKept>) -> Vec<Option<RunRecord>> {
        std::iter::from_fn(|| kept.try_recv().ok()).map(|kept| kept.run).collect()
    }

    fn record(lease: Option<Lease>, stop: Option<StopOrder>) -> Option<RunRecord> {
        RunRecord::of(|| Some("one".to_owned()), lease, stop)
    }

    #[test]
    fn a_stop_is_kept_with_its_run_and_the_identity_of_the_start_until_it_is_over() {
        let (keeps, kept) = mpsc::unbounded_channel();
        let mut keeper = Keeper::new(Arc::from("pump"), "/dev/ttyUSB0 atv312@1".into(), Some(keeps), None);
        keeper.follow(Some(RUN), None, || Some("one".to_owned()));
        // Its line was lost: it has not said anew which it is.
        keeper.follow(Some(RUN), Some(StopMode::Ramp.into()), || None);
        keeper.follow(Some(RUN), Some(StopMode::Ramp.into()), || None);
        keeper.note_stop(StopMode::Fast.into());
        keeper.follow(None, None, || None);
        let stopped = |mode: StopMode| record(Some(RUN), Some(mode.into()));
        assert_eq!(
            kept_of(kept),
            [record(Some(RUN), None), stopped(StopMode::Ramp), stopped(StopMode::Fast), None]
        );
    }

    #[test]
    fn a_run_is_kept_by_the_place_of_its_drive_whatever_that_is_called() {
        let (keeps, mut kept) = mpsc::unbounded_channel();
        let place = Place::from("/dev/ttyUSB0 atv312@1");
        let mut keeper = Keeper::new(Arc::from("north"), place.clone(), Some(keeps), None);
        keeper.follow(Some(RUN), None, || Some("one".to_owned()));
        keeper.follow_name(Arc::from("south"));
        keeper.follow(None, None, || None);
        let told = std::iter::from_fn(|| kept.try_recv().ok());
        let told: Vec<_> = told.map(|kept| (kept.drive, kept.place, kept.run)).collect();
        let [north, south] = ["north", "south"].map(Arc::<str>::from);
        let run = record(Some(RUN), None);
        assert_eq!(
            told,
            [
                (north, place.clone(), run.clone()),
                (Arc::clone(&south), place.clone(), run),
                (south, place, None)
            ]
        );
    }

    #[test]
    fn a_stop_is_kept_with_its_seconds_behind_the_run_command_that_it_has_ended() {
        let (keeps, kept) = mpsc::unbounded_channel();
        let mut keeper = Keeper::new(Arc::from("pump"), "/dev/ttyUSB0 atv312@1".into(), Some(keeps), None);
        let held = Some(StopOrder::injecting(Duration::from_secs(20)));
        keeper.follow(Some(RUN), None, || Some("one".to_owned()));
        keeper.follow(Some(RUN), held, || None);
        keeper.follow(None, held, || None);
        // Direct current has brought it to rest, and is only to be ended.
        keeper.follow(None, Some(StopMode::Ramp.into()), || None);
        keeper.follow(None, None, || None);
        let ramp = Some(StopMode::Ramp.into());
        let told =
            [record(Some(RUN), None), record(Some(RUN), held), record(None, held), record(None, ramp), None];
        assert_eq!(kept_of(kept), told);
    }

    #[test]
    fn a_stop_of_a_motor_that_somebody_else_runs_is_kept_with_the_drive_that_it_was_asked_of() {
        let (keeps, kept) = mpsc::unbounded_channel();
        let mut keeper = Keeper::new(Arc::from("pump"), "/dev/ttyUSB0 atv312@1".into(), Some(keeps), None);
        let fast = Some(StopMode::Fast.into());
        keeper.follow(None, fast, || None);
        keeper.follow(None, fast, || Some("one".to_owned()));
        // Its line was lost meanwhile.
        keeper.follow(None, fast, || None);
        keeper.follow(None, None, || None);
        let of_nobody = RunRecord::of(|| None, None, fast);
        assert_eq!(kept_of(kept), [of_nobody, record(None, fast), None]);
    }
}
