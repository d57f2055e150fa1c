//! A drive without a fleet, each of whose statuses a witness holds against its machine.

use std::sync::Arc;

use drive_core::{Drive, Result, Status};
use drive_sim::SimSlave;
use drive_testing::witness::{Told, Witnesses};
use tokio::sync::watch;

/// A drive and whoever hears what it says of itself.
pub struct Attended {
    /// The drive.
    pub drive: Box<dyn Drive>,
    tell: watch::Sender<Arc<Option<Told>>>,
}

impl Attended {
    /// This drive of this machine, before these witnesses.
    #[must_use]
    pub fn new(drive: Box<dyn Drive>, machine: &SimSlave, witnesses: &mut Witnesses) -> Self {
        let (tell, told) = watch::channel(Arc::new(None));
        witnesses.attend(machine, told, |told: &Option<Told>| told.clone());
        Self { drive, tell }
    }

    /// Its status, which is told.
    ///
    /// # Errors
    /// The drive's.
    pub async fn status(&mut self) -> Result<Status> {
        let status = self.drive.status().await?;
        if let Some(at) = status.at {
            let (status, held) = (Arc::new(status.clone()), self.drive.lease().is_some());
            self.tell.send_replace(Arc::new(Some(Told { status, at, held, missing: 0 })));
        }
        Ok(status)
    }
}
