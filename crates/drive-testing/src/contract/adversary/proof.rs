//! What each status says of the run command and of the shaft, against the machine itself: words against shaft.

use std::time::Duration;

use drive_core::{Status, StopMode, Verdict};
use tokio::time::{Instant, sleep};

use super::{Complaint, OTHER, SETPOINT, SETTLED, Stage};
use crate::{
    contract::{Contract, is_given},
    recorder::Habit,
    truth::contradiction,
    words::words_written,
};

/// How long a reference of another may be taken for ours: longer than every turn of the families takes at this pace.
const TOLD_WITHIN: Duration = Duration::from_secs(60);

impl Contract {
    /// What it says of its run command and of the shaft holds, in every status.
    pub(super) async fn proves_what_it_says(&self) -> Vec<Complaint> {
        let mut complaints = self.a_run_is_proved().await;
        for mode in StopMode::ALL {
            complaints.extend(self.a_stop_is_proved(mode).await);
        }
        complaints.extend(self.a_trip_is_proved().await);
        complaints.extend(self.a_power_cut_is_proved().await);
        complaints.extend(self.a_reference_of_another_is_told().await);
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

impl Contract {
    /// Another master writes another setpoint over that of a run, in the word by which the family itself has given it. The machine
    /// says who decides: no referee is needed.
    async fn a_reference_of_another_is_told(&self) -> Vec<Complaint> {
        let mut stage =
            self.stage("a run command whose reference another master has replaced is not in force").await;
        let Some((register, word)) = stage.word_of_another_setpoint().await else { return stage.complaints };
        if stage.run().await.is_none() {
            return stage.complaints;
        }
        let before = stage.seen().setpoint;
        let write = format!("{} master {register:#06x} {word:04X}h", stage.rig.machine.name());
        // Not every setpoint is one word that anybody may write.
        if stage.rig.simulated.control(&write).is_err() {
            return stage.complaints;
        }
        sleep(Duration::from_millis(500)).await;
        let end = Instant::now() + TOLD_WITHIN;
        let mut verdict = None;
        while Instant::now() < end {
            let status = stage.rig.drive.status().await;
            let seen = stage.seen();
            verdict = status.map_or(verdict, |status| status.verdict);
            if matches!(verdict, Some(Verdict::NotInForce { .. })) || !seen.running || seen.setpoint == before
            {
                return stage.complaints;
            }
            sleep(Duration::from_millis(400)).await;
        }
        let seen = stage.seen();
        stage.blame(format!(
            "another master wrote {word:04X}h to {register:04X}h {TOLD_WITHIN:?} ago, and the verdict is {verdict:?}; {seen:?}"
        ));
        stage.complaints
    }
}

impl Stage {
    /// The register of a setpoint and the word that stands for [`OTHER`] in it, as the family writes them; the setpoint is
    /// [`SETPOINT`] again afterwards.
    async fn word_of_another_setpoint(&mut self) -> Option<(u16, u16)> {
        let mut written = Vec::new();
        for setpoint in [SETPOINT, OTHER, SETPOINT] {
            let since = Instant::now();
            is_given(&self.rig.drive.set_setpoint(setpoint.into()).await).then_some(())?;
            let received = self.rig.machine.received_since(since);
            written.push(received.iter().flat_map(|request| words_written(&request.pdu)).collect::<Vec<_>>());
        }
        let is_other = |at: u16, word: u16| written[0].iter().any(|&(it, before)| it == at && before != word);
        written[1].iter().copied().find(|&(at, word)| is_other(at, word))
    }

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
