//! What each status says of the run command and of the shaft, against the machine itself: words against shaft.

use std::time::Duration;

use drive_core::{Status, StopMode, Verdict};
use tokio::time::{Instant, sleep};

use super::{Complaint, SETTLED, Stage};
use crate::{contract::Contract, recorder::Habit, truth::contradiction};

impl Contract {
    /// What it says of its run command and of the shaft holds, in every status.
    pub(super) async fn proves_what_it_says(&self) -> Vec<Complaint> {
        let mut complaints = self.a_run_is_proved().await;
        for mode in StopMode::ALL {
            complaints.extend(self.a_stop_is_proved(mode).await);
        }
        complaints.extend(self.a_trip_is_proved().await);
        complaints.extend(self.a_power_cut_is_proved().await);
        complaints
    }

    async fn a_run_is_proved(&self) -> Vec<Complaint> {
        let mut stage = self
            .stage("a run command that stands is a lease, and each status says whether it is in force")
            .await;
        stage.expect_lease(false, "before any start");
        if stage.run().await.is_none() {
            return stage.complaints;
        }
        stage.expect_lease(true, "after a confirmed start");
        stage.expect_verdict("while it runs by it", |verdict| verdict == Some(Verdict::InForce)).await;
        stage.rig.drive.forget();
        stage.expect_lease(true, "after forget");
        stage.watch(SETTLED).await;
        stage.expect_verdict("a while after forget", |verdict| verdict == Some(Verdict::InForce)).await;
        // A stop that the drive does not take ends no lease.
        stage.witness.from_now_on(Habit::KeepsItsWords);
        let stopped = stage.rig.drive.stop(StopMode::Ramp).await;
        if stopped.is_err() {
            stage.expect_lease(true, "after a stop that was not confirmed");
        }
        stage.stop_at_last().await;
        stage.expect_lease(false, "after a confirmed stop");
        stage.expect_verdict("after a confirmed stop", |verdict| verdict.is_none()).await;
        stage.complaints
    }

    async fn a_stop_is_proved(&self, mode: StopMode) -> Vec<Complaint> {
        let mut stage = self.stage("told at rest, the shaft stands").await;
        if stage.run().await.is_none() {
            return stage.complaints;
        }
        let stopped = stage.rig.drive.stop(mode).await;
        if let Ok(stopped) = &stopped {
            stage.judge_motion(&stopped.status);
        }
        stage.watch(SETTLED).await;
        stage.complaints
    }

    async fn a_trip_is_proved(&self) -> Vec<Complaint> {
        let mut stage = self.stage("a run command that a trip has cut off is not in force").await;
        let Some(trip) = self.trip else { return Vec::new() };
        if stage.run().await.is_none() {
            return stage.complaints;
        }
        stage.rig.machine.trip(trip);
        stage.expect_verdict("tripped", |verdict| !matches!(verdict, Some(Verdict::InForce))).await;
        stage.watch(SETTLED).await;
        stage.complaints
    }

    async fn a_power_cut_is_proved(&self) -> Vec<Complaint> {
        let mut stage = self.stage("a run command that a power cut has ended is not in force").await;
        if stage.run().await.is_none() {
            return stage.complaints;
        }
        stage.rig.machine.power_cycle();
        stage.watch(Duration::from_secs(5)).await;
        if !stage.seen().running {
            stage
                .expect_verdict("after a power cut", |verdict| !matches!(verdict, Some(Verdict::InForce)))
                .await;
        }
        stage.complaints
    }
}

impl Stage {
    fn expect_lease(&mut self, stands: bool, when: &str) {
        let lease = self.rig.drive.lease();
        if lease.is_some() != stands {
            self.blame(format!("{when} the lease is {lease:?}"));
        }
    }

    async fn expect_verdict(&mut self, when: &str, is_so: impl Fn(Option<Verdict>) -> bool) {
        match self.rig.drive.status().await {
            Ok(status) if !is_so(status.verdict) => {
                let seen = self.seen();
                self.blame(format!("{when} the verdict is {:?}; {seen:?}", status.verdict));
            }
            Ok(status) => self.judge_motion(&status),
            Err(error) => self.blame(format!("{when}: {error}")),
        }
    }

    /// Asks it all the while, and holds each status against the machine.
    async fn watch(&mut self, time: Duration) {
        let end = Instant::now() + time;
        while Instant::now() < end {
            if let Ok(status) = self.rig.drive.status().await {
                self.judge_motion(&status);
            }
            sleep(Duration::from_millis(50)).await;
        }
    }

    fn judge_motion(&mut self, status: &Status) {
        if let Some(seen) = contradiction(status, &self.seen()) {
            self.blame(seen);
        }
    }
}
