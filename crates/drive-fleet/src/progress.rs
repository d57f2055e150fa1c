//! How far a command has come: where it is told and where it is heard.

use tokio::sync::watch;

use crate::outcome::{Outcome, Refused};

/// How far a command has come.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Progress {
    /// The drive has shown that it is in force, and how.
    pub(crate) in_force: Option<Outcome>,
    pub(crate) finished: Option<Outcome>,
}

/// Where the progress of a command is told.
pub(crate) type Report = watch::Sender<Progress>;

/// Where it is heard.
pub(crate) type Hearer = watch::Receiver<Progress>;

/// A command that has ended before it began.
pub(crate) fn refused(refused: Refused) -> Hearer {
    watch::Sender::new(Progress { in_force: None, finished: Some(Outcome::Refused(refused)) }).subscribe()
}

/// What became of a command, when it is known; with `early` also that it is in force.
pub(crate) async fn outcome(hearer: &Hearer, early: bool) -> Outcome {
    let known = |progress: &Progress| {
        let in_force = progress.in_force.clone().filter(|_| early);
        in_force.or_else(|| progress.finished.clone())
    };
    let mut hearer = hearer.clone();
    let told = hearer.wait_for(|progress| known(progress).is_some()).await;
    told.ok().and_then(|progress| known(&progress)).unwrap_or(Outcome::Refused(Refused::ShutDown))
}
