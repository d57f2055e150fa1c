//! What the handles of a line and its task share.

use std::sync::{
    Arc, Mutex, MutexGuard, PoisonError,
    atomic::{AtomicU64, Ordering},
};

use tokio::{
    sync::{Notify, oneshot, watch},
    time::Instant,
};

use crate::{
    capture::{Last, Tap},
    latest::Latest,
    master::{Master, Outcome},
};

/// What every handle of a line shares; its end closes the line.
pub(crate) struct Handle {
    pub(crate) shared: Arc<Shared>,
    when_finished: watch::Receiver<bool>,
}

impl Handle {
    /// The handle of a line whose task says through `when_finished` that it has ended.
    pub(crate) const fn new(shared: Arc<Shared>, when_finished: watch::Receiver<bool>) -> Self {
        Self { shared, when_finished }
    }

    /// Closes the line and returns when its task has ended.
    pub(crate) async fn close(&self) {
        self.shared.close();
        let mut when_finished = self.when_finished.clone();
        // An error means that the task is gone with its runtime, and the port with it.
        let _ = when_finished.wait_for(|finished| *finished).await;
    }
}

impl Drop for Handle {
    fn drop(&mut self) {
        self.shared.close();
    }
}

/// What the handles and the task share.
pub(crate) struct Shared {
    master: Mutex<Master<Caller>>,
    tap: Mutex<Option<Tap>>,
    /// The last frames that captures have heard. The task never waits for it.
    pub(crate) last: Arc<Last>,
    /// How often the task has come round.
    rounds: AtomicU64,
    /// How often the port was lost.
    losses: watch::Sender<u64>,
    /// How many values were withdrawn.
    retractions: watch::Sender<u64>,
    /// Tells the task that the master has something new to do.
    pub(crate) wake: Notify,
}

impl Shared {
    pub(crate) fn new(master: Master<Caller>) -> Self {
        Self {
            master: Mutex::new(master),
            tap: Mutex::new(None),
            last: Arc::default(),
            rounds: AtomicU64::new(0),
            losses: watch::Sender::new(0),
            retractions: watch::Sender::new(0),
            wake: Notify::new(),
        }
    }

    /// The master, locked for the moment of one decision; never across an await.
    pub(crate) fn master(&self) -> MutexGuard<'_, Master<Caller>> {
        // A panic elsewhere must not keep a stop from being sent.
        self.master.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The capture, if there is one.
    pub(crate) fn tap(&self) -> MutexGuard<'_, Option<Tap>> {
        self.tap.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The task has come round once more.
    pub(crate) fn count_round(&self) {
        self.rounds.fetch_add(1, Ordering::Relaxed);
    }

    /// How often the task has come round.
    pub(crate) fn rounds(&self) -> u64 {
        self.rounds.load(Ordering::Relaxed)
    }

    /// The port is lost.
    pub(crate) fn count_loss(&self) {
        self.losses.send_modify(|losses| *losses += 1);
    }

    /// How often the port was lost, for who waits for that.
    pub(crate) fn losses(&self) -> Latest<u64> {
        self.losses.subscribe().into()
    }

    /// So many values were withdrawn so far.
    pub(crate) fn tell_retractions(&self, retractions: u64) {
        self.retractions.send_if_modified(|told| std::mem::replace(told, retractions) != retractions);
    }

    /// How many values were withdrawn, for who waits for the next.
    pub(crate) fn retractions(&self) -> Latest<u64> {
        self.retractions.subscribe().into()
    }

    /// The task has gone: what is under way ends as where a port is lost, and nothing is taken any more.
    pub(crate) fn end(&self) {
        const GONE: &str = "the task of the line has ended";
        let now = Instant::now();
        let mut master = self.master();
        if !master.is_finished() {
            master.handle_lost(now, GONE);
        }
        master.handle_down(GONE);
        master.handle_close();
        let ended: Vec<_> = std::iter::from_fn(|| master.poll_outcome()).collect();
        drop(master);
        for (caller, outcome) in ended {
            caller.answer(outcome, now);
        }
    }

    fn close(&self) {
        self.master().handle_close();
        self.wake.notify_one();
    }
}

/// Who waits for an answer.
pub(crate) struct Caller(oneshot::Sender<Told>);

/// What a caller is told: the outcome, and when its exchange ended on the line.
pub(crate) type Told = (Outcome, Instant);

impl Caller {
    pub(crate) fn new() -> (Self, oneshot::Receiver<Told>) {
        let (caller, outcome) = oneshot::channel();
        (Self(caller), outcome)
    }

    pub(crate) fn answer(self, outcome: Outcome, at: Instant) {
        // Whoever dropped the call does not want the answer.
        let _ = self.0.send((outcome, at));
    }
}
