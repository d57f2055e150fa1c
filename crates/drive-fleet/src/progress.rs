//! How far a command has come: where it is told and where it is heard.

use tokio::sync::watch;

use crate::outcome::{Outcome, Refused, Unknown};

/// How far a command has come.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Progress {
    /// It was sent to the drive, or may have been.
    pub(crate) begun: bool,
    /// The drive has shown that it is in force, and how.
    pub(crate) in_force: Option<Outcome>,
    pub(crate) finished: Option<Outcome>,
}

impl Progress {
    /// What is told of it when whoever carried it out has ended first, with its runtime or with the last handle of its fleet.
    fn abandoned(&self) -> Outcome {
        if self.begun {
            Outcome::OutcomeUnknown(Unknown { abandoned: true, ..Unknown::default() })
        } else {
            Outcome::Refused(Refused::ShutDown)
        }
    }
}

/// Where the progress of a command is told.
pub(crate) type Report = watch::Sender<Progress>;

/// Where it is heard.
pub(crate) type Hearer = watch::Receiver<Progress>;

/// A command that has ended before it began.
pub(crate) fn refused(refused: Refused) -> Hearer {
    watch::Sender::new(Progress { finished: Some(Outcome::Refused(refused)), ..Progress::default() })
        .subscribe()
}

/// What became of a command, when it is known; with `early` also that it is in force.
pub(crate) async fn outcome(hearer: &Hearer, early: bool) -> Outcome {
    let known = |progress: &Progress| {
        let in_force = progress.in_force.clone().filter(|_| early);
        in_force.or_else(|| progress.finished.clone())
    };
    let mut hearer = hearer.clone();
    // Its end wakes as well, and leaves what was told last.
    let _ = hearer.wait_for(|progress| known(progress).is_some()).await;
    let told = hearer.borrow();
    known(&told).unwrap_or_else(|| told.abandoned())
}
