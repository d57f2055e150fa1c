//! Who posts: one task for each receiver, and one that hears of the alarms.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError, atomic::Ordering::Relaxed},
    time::Duration,
};

use drive_fleet::alarms::AlarmView;
use drived_plant::plant::{
    Plant,
    revisions::{self, Subject, data_of},
};
use drived_words::json::unix;
use tokio::{
    sync::{Notify, watch},
    time::{Instant, sleep_until},
};

use crate::{
    counters::{Counters, Why},
    memory::Memory,
    message::Form,
    outbox::{Next, Outbox},
    post::Way,
};

/// Between two attempts at a receiver that does not take anything: twice the one before, up to the longest.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_secs(300);

/// How long an alarm may wait at its coming.
pub(crate) const LONGEST_SETTLE: Duration = Duration::from_secs(60);

/// A receiver while its face is open.
pub(crate) struct Receiver {
    pub(crate) name: String,
    pub(crate) form: Form,
    pub(crate) way: Way,
    /// Between two messages, so that what comes and goes is no flood.
    pub(crate) pause: Duration,
    pub(crate) outbox: Mutex<Outbox>,
    pub(crate) counters: Counters,
    pub(crate) offered: Notify,
    pub(crate) memory: Memory,
}

impl Receiver {
    fn outbox(&self) -> MutexGuard<'_, Outbox> {
        self.outbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What became of the one on its way.
    fn settle(&self, change: impl FnOnce(&mut Outbox)) {
        let mut outbox = self.outbox();
        change(&mut outbox);
        self.counters.waiting.store(outbox.waiting() as u64, Relaxed);
        self.memory.set(&self.name, outbox.told());
    }

    /// Offers it something, and counts what was lost by that.
    fn offer(&self, offer: impl FnOnce(&mut Outbox) -> u64) {
        let mut outbox = self.outbox();
        let count = offer(&mut outbox);
        self.counters.waiting.store(outbox.waiting() as u64, Relaxed);
        drop(outbox);
        self.offered.notify_one();
        if count > 0 {
            self.counters.lose(Why::NoRoom, count);
            tracing::warn!("webhook {}: no room for {count} messages: they are lost", self.name);
        }
    }

    /// Posts what waits until the end; then what waits still, each tried once.
    pub(crate) async fn post_all(self: Arc<Self>, mut ended: watch::Receiver<bool>) {
        let mut in_vain = 0_u32;
        loop {
            let is_last = *ended.borrow();
            // At the end nothing waits for its cause any more.
            let until = Instant::now() + if is_last { LONGEST_SETTLE } else { Duration::ZERO };
            let next = self.outbox().next(until);
            let (message, lost) = match next {
                Next::Post(message, lost) => (message, lost),
                _ if is_last => return,
                Next::At(at) => {
                    tokio::select! {
                        () = sleep_until(at) => {}
                        () = self.offered.notified() => {}
                        _ = ended.changed() => {}
                    }
                    continue;
                }
                Next::Nothing => {
                    tokio::select! {
                        () = self.offered.notified() => {}
                        _ = ended.changed() => {}
                    }
                    continue;
                }
            };
            let body = self.form.write(&message, lost);
            let pause = match self.way.post(&message.id, unix(Instant::now()) / 1_000, body).await {
                Ok(()) => {
                    self.settle(|outbox| outbox.taken(lost));
                    if self.counters.take() {
                        tracing::info!("webhook {}: {} takes alarms again", self.name, self.way.target);
                    }
                    in_vain = 0;
                    self.pause
                }
                Err(not) if not.why == Why::Refused => {
                    self.settle(Outbox::refused);
                    self.counters.fail(not.why);
                    self.counters.lose(not.why, 1);
                    tracing::warn!(
                        "webhook {}: {}: {not}: it is lost: {}",
                        self.name,
                        self.way.target,
                        message.view
                    );
                    self.pause
                }
                Err(not) => {
                    self.settle(Outbox::not_taken);
                    if self.counters.fail(not.why) {
                        tracing::warn!(
                            "webhook {}: {}: {not}: alarms wait for it",
                            self.name,
                            self.way.target
                        );
                    }
                    if *ended.borrow() {
                        return;
                    }
                    let usual = FIRST_PAUSE.saturating_mul(1 << in_vain.min(10));
                    in_vain += 1;
                    not.after.unwrap_or(usual).clamp(FIRST_PAUSE, LONGEST_PAUSE)
                }
            };
            let next = Instant::now() + pause;
            tokio::select! {
                () = sleep_until(next) => {}
                _ = ended.wait_for(|is_ended| *is_ended) => {}
            }
        }
    }
}

/// Offers the receivers what becomes of alarms: what there is first, and then each change.
pub(crate) async fn hear(plant: Plant, receivers: Vec<Arc<Receiver>>) {
    let mut reader = plant.revisions().reader(None);
    offer_all(&plant, &receivers);
    loop {
        match plant.revisions().next(&mut reader).await {
            revisions::Next::Frames(frames) => {
                let changes = frames.iter().filter_map(|frame| data_of(frame, Subject::Alarm));
                let now = Instant::now();
                for (revision, view) in changes {
                    // It was written by this very program.
                    let Ok(view) = serde_json::from_slice::<AlarmView>(view) else { continue };
                    for receiver in &receivers {
                        receiver.offer(|outbox| outbox.offer(view.clone(), revision, now));
                    }
                }
            }
            // Too many changes came at once to be told one by one, or the configuration is another.
            revisions::Next::Reset(_) => offer_all(&plant, &receivers),
            revisions::Next::End => return,
        }
    }
}

fn offer_all(plant: &Plant, receivers: &[Arc<Receiver>]) {
    let (revision, now) = (plant.revisions().last(), Instant::now());
    let all = plant.alarms().alarms;
    for receiver in receivers {
        receiver.offer(|outbox| outbox.offer_all(all.clone(), revision, now));
    }
}
