//! What is kept of the run commands of this side beyond the life of the program: [`RunKept`].

use std::{sync::Arc, time::Duration};

use drive_core::{Lease, StopMode};
use tokio::{
    sync::{mpsc, oneshot},
    time::timeout,
};

use crate::settings::RunRecord;

/// How long a start waits at the most until its record is kept: a disk that hangs holds up no pump for ever. Less than half of
/// the second that a command may wait, and that goes on meanwhile.
const KEPT_WITHIN: Duration = Duration::from_millis(400);

/// What is to be kept of a drive's run command from now on, in the order in which it is told. **A start waits until its record is
/// kept**, 0.4 s at the most, so that a program that is killed has told the next one of every motor that it started.
#[derive(Debug)]
#[non_exhaustive]
pub struct RunKept {
    /// The drive.
    pub drive: Arc<str>,
    /// The run command that stands, or is about to be given; `None`: none of this side stands any more, as the drive's own
    /// words have shown.
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
    keeps: Option<mpsc::UnboundedSender<RunKept>>,
    told: Option<RunRecord>,
}

impl Keeper {
    pub(crate) fn new(
        drive: Arc<str>,
        keeps: Option<mpsc::UnboundedSender<RunKept>>,
        kept: Option<RunRecord>,
    ) -> Self {
        let mut keeper = Self { drive, keeps, told: None };
        if kept.is_some() {
            // Who keeps it may have had it under another name.
            keeper.tell(kept, None);
        }
        keeper
    }

    /// The run command of this side as it stands now, and the stop that is to end it. The identity counts that the drive had when the
    /// run command was given.
    pub(crate) fn follow(
        &mut self,
        lease: Option<Lease>,
        stop: Option<StopMode>,
        identity: impl FnOnce() -> Option<String>,
    ) {
        let told = self.told.as_ref();
        if told.map(|told| (told.lease, told.stop)) == lease.map(|lease| (lease, stop)) {
            return;
        }
        let known = told.filter(|told| Some(told.lease) == lease).map(|told| told.identity.clone());
        let run = lease.map(|lease| RunRecord { identity: known.unwrap_or_else(identity), lease, stop });
        self.tell(run, None);
    }

    /// A run command of which it is not known yet whether it is ours is to be stopped.
    pub(crate) fn note_stop(&mut self, stop: StopMode) {
        if let Some(told) = self.told.clone().filter(|told| told.stop != Some(stop)) {
            self.tell(Some(RunRecord { stop: Some(stop), ..told }), None);
        }
    }

    /// The drive may be called otherwise now: what is kept of it is kept by the name that it has.
    pub(crate) fn follow_name(&mut self, name: Arc<str>) {
        if self.drive == name {
            return;
        }
        let old = std::mem::replace(&mut self.drive, name);
        // First by the new one: a program that is killed between both has told of the run twice, and not never.
        if let Some(run) = self.told.clone() {
            self.tell(Some(run), None);
            self.send(old, None, None);
        }
    }

    /// A run command is about to be given.
    pub(crate) async fn before(&mut self, record: RunRecord) {
        if self.keeps.is_none() || self.told.as_ref() == Some(&record) {
            return;
        }
        let (kept, is_kept) = oneshot::channel();
        self.tell(Some(record), Some(kept));
        // A keeper that has gone keeps nothing, and holds up nothing.
        let _ = timeout(KEPT_WITHIN, is_kept).await;
    }

    fn tell(&mut self, run: Option<RunRecord>, kept: Option<oneshot::Sender<()>>) {
        self.told.clone_from(&run);
        self.send(Arc::clone(&self.drive), run, kept);
    }

    fn send(&self, drive: Arc<str>, run: Option<RunRecord>, kept: Option<oneshot::Sender<()>>) {
        if let Some(keeps) = &self.keeps {
            let _ = keeps.send(RunKept { drive, run, kept });
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_core::Direction;

    use super::*;

    #[test]
    fn a_stop_is_kept_with_its_run_and_the_identity_of_the_start_until_it_is_over() {
        let (keeps, mut kept) = mpsc::unbounded_channel();
        let mut keeper = Keeper::new(Arc::from("pump"), Some(keeps), None);
        let lease = Lease::new(Direction::Forward, 0x000F);
        let identity = Some("one".to_owned());
        keeper.follow(Some(lease), None, || identity.clone());
        // Its line was lost: it has not said anew which it is.
        keeper.follow(Some(lease), Some(StopMode::Ramp), || None);
        keeper.follow(Some(lease), Some(StopMode::Ramp), || None);
        keeper.note_stop(StopMode::Fast);
        keeper.follow(None, None, || None);
        drop(keeper);
        let record = |stop| Some(RunRecord { identity: identity.clone(), lease, stop });
        let told: Vec<_> = std::iter::from_fn(|| kept.try_recv().ok()).map(|kept| kept.run).collect();
        assert_eq!(told, [record(None), record(Some(StopMode::Ramp)), record(Some(StopMode::Fast)), None]);
    }
}
