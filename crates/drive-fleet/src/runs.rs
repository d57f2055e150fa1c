//! What is kept of the run commands of this side beyond the life of the program: [`RunKept`].

use std::{sync::Arc, time::Duration};

use drive_core::Lease;
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

    /// The run command of this side as it stands now. The identity counts that the drive had when it was given.
    pub(crate) fn follow(&mut self, lease: Option<Lease>, identity: impl FnOnce() -> Option<String>) {
        if self.told.as_ref().map(|told| told.lease) != lease {
            self.tell(lease.map(|lease| RunRecord { identity: identity(), lease }), None);
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
