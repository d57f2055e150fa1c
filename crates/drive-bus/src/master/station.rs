//! What the master knows of one slave: its timeout, its pauses, whether it answers at all.

use std::{sync::Arc, time::Duration};

use drive_core::Class;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{Job, doubt::Doubt};
use crate::{
    answer,
    config::{LineConfig, SlaveSettings},
    exchange::Exchange,
    pdu,
    schedule::Entry,
    shape::Shape,
    stats::SlaveStats,
    timeout::LearnedTimeout,
};

/// How long a slave is probed after somebody last asked for it.
const INTEREST: Duration = Duration::from_secs(60);

/// By how many words a read is lengthened at the most, to tell its answer from others.
const MOST_SPARE: u8 = 3;

/// One slave, as seen by the master.
#[derive(Debug)]
pub(super) struct Station {
    pub(super) settings: SlaveSettings,
    pub(super) timeout: LearnedTimeout,
    pub(super) stats: SlaveStats,
    /// Its own pause is over at this time.
    pub(super) ready_at: Option<Instant>,
    pub(super) doubt: Doubt,
    failures: u32,
    /// It was heard when its time was over.
    slow: bool,
    offline: Option<Offline>,
    /// What a probe asks: the last read that was asked of this slave.
    last_read: Option<Arc<Request<'static>>>,
    asked: Option<Instant>,
}

#[derive(Debug, Clone, Copy)]
struct Offline {
    missed_at: Instant,
    probe_at: Instant,
    backoff: Duration,
    /// A Stop was sent to it in vain: the next is a repetition.
    stopped_in_vain: bool,
}

impl Station {
    pub(super) fn new(config: &LineConfig, settings: SlaveSettings) -> Self {
        let ceiling = settings.response_timeout.unwrap_or(config.response_timeout);
        Self {
            settings,
            timeout: LearnedTimeout::new(config.timeout_floor, ceiling),
            stats: SlaveStats::default(),
            ready_at: None,
            doubt: Doubt::default(),
            failures: 0,
            slow: false,
            offline: None,
            last_read: None,
            asked: None,
        }
    }

    pub(super) fn configure(&mut self, config: &LineConfig, settings: SlaveSettings) {
        self.settings = settings;
        self.timeout.limit(settings.response_timeout.unwrap_or(config.response_timeout));
    }

    /// Somebody asks for it.
    pub(super) fn ask(&mut self, now: Instant, request: &Arc<Request<'static>>, is_write: bool) {
        self.asked = Some(now);
        if !is_write && !answer::equals_its_request(request) {
            self.last_read = Some(Arc::clone(request));
        }
    }

    /// A read that does no harm and whose answer no echo can be taken for: the last that was asked, or one register.
    pub(super) fn harmless_read(&self) -> Arc<Request<'static>> {
        self.last_read.clone().unwrap_or_else(|| Arc::new(Request::ReadHoldingRegisters(0, 1)))
    }

    /// It has answered, at `now`. True: it had been off-line.
    pub(super) fn answered(&mut self, now: Instant) -> bool {
        self.failures = 0;
        self.slow = false;
        self.ready_at = Some(now + self.settings.turnaround);
        self.stats.offline = false;
        self.offline.take().is_some()
    }

    /// With how many words more a read is asked, so that its answer differs from what may come, and until when it waits
    /// nevertheless.
    pub(super) fn place<C>(&self, now: Instant, entry: &Entry<Job<C>>) -> (u8, Option<Instant>) {
        let spare = if entry.work.asked_longer { 0 } else { entry.terms.spare_words.min(MOST_SPARE) };
        let shapes = (0..=spare).map_while(|more| match more {
            0 => Some(entry.work.shape),
            more => entry.work.shape.longer(more),
        });
        self.doubt.best(now, shapes).map_or((0, None), |(more, wait)| (more as u8, wait))
    }

    /// Until when this request still waits, besides its slave's pause: an answer that may come could be taken for its own,
    /// or it repeats the stop of a slave that is off-line. The write of any other Stop waits for neither.
    pub(super) fn held_until<C>(
        &self,
        now: Instant,
        exchange: &dyn Exchange,
        entry: &Entry<Job<C>>,
        offline_stop_at: Option<Instant>,
    ) -> Option<Instant> {
        let stop = entry.terms.class == Class::Stop;
        let offline = offline_stop_at.filter(|_| stop && self.was_stopped_in_vain());
        let (late, settling) = if stop && entry.work.is_write {
            (None, None)
        } else {
            let settling = wants_settling(exchange, entry).then(|| shape_of(exchange, &self.harmless_read()));
            (self.place(now, entry).1, settling.and_then(|shape| self.doubt.wait(now, shape)))
        };
        [late, settling, offline].into_iter().flatten().max().filter(|until| *until > now)
    }

    /// A Stop to it failed. True: it is off-line.
    pub(super) fn stop_failed(&mut self) -> bool {
        self.offline.as_mut().map(|offline| offline.stopped_in_vain = true).is_some()
    }

    /// Whether a Stop to it would be a repetition, since it is off-line.
    pub(super) fn was_stopped_in_vain(&self) -> bool {
        self.offline.is_some_and(|offline| offline.stopped_in_vain)
    }

    /// It did not answer a question, `short` or not. True: it goes off-line with this.
    pub(super) fn missed(&mut self, now: Instant, config: &LineConfig, short: bool) -> bool {
        self.timeout.missed();
        // A short question was one in the first place because it has never answered.
        self.failures = if short { config.offline_after } else { self.failures.saturating_add(1) };
        let (first, longest) = config.probe_backoff;
        match &mut self.offline {
            Some(offline) => {
                offline.missed_at = now;
                offline.backoff = offline.backoff.saturating_mul(2).clamp(first, longest);
                offline.probe_at = now + offline.backoff;
                false
            }
            None if config.offline_after > 0 && self.failures >= config.offline_after => {
                self.offline = Some(Offline {
                    missed_at: now,
                    probe_at: now + first,
                    backoff: first,
                    stopped_in_vain: false,
                });
                self.stats.offline = true;
                self.stats.went_offline += 1;
                true
            }
            None => false,
        }
    }

    /// When it is off-line: when it is asked next.
    pub(super) fn probe_at(&self) -> Option<Instant> {
        let offline = self.offline?;
        Some(self.doubt.over().map_or(offline.probe_at, |over| over.max(offline.probe_at)))
    }

    /// [`probe_at`](Self::probe_at), as long as somebody cares. On an `idle` line no probe waits longer than the first.
    pub(super) fn wanted_probe_at(&self, idle: bool, config: &LineConfig) -> Option<Instant> {
        let at = match self.offline? {
            offline if idle => {
                let at = offline.probe_at.min(offline.missed_at + config.probe_backoff.0);
                self.doubt.over().map_or(at, |over| over.max(at))
            }
            _ => self.probe_at()?,
        };
        self.asked.is_some_and(|asked| at <= asked + INTEREST).then_some(at)
    }

    /// An answer came when its time was over: it is there, and slow.
    pub(super) fn heard_late(&mut self, now: Instant) {
        self.slow = true;
        self.hope(now);
    }

    /// Whether only a long question is worth asking, because its own time was set or because it was heard late.
    pub(super) const fn wants_long(&self) -> bool {
        self.slow || self.settings.response_timeout.is_some()
    }

    /// Its neighbour is back: it is asked at once, and soon again.
    pub(super) fn hope(&mut self, now: Instant) {
        if let Some(offline) = &mut self.offline {
            offline.probe_at = now;
            offline.backoff = Duration::ZERO;
        }
    }

    /// A probe that was under way is given up.
    pub(super) fn probe_again(&mut self, at: Instant) {
        if let Some(offline) = &mut self.offline {
            offline.probe_at = at;
        }
    }
}

/// The shape of the answer to `request`.
pub(super) fn shape_of(exchange: &dyn Exchange, request: &Request<'_>) -> Shape {
    exchange.shape(&pdu::encode(request).unwrap_or_default())
}

/// Whether the adapter is to be asked for its echo before this request: otherwise its answer would prove nothing.
pub(super) fn wants_settling<C>(exchange: &dyn Exchange, entry: &Entry<Job<C>>) -> bool {
    exchange.echo_is_unknown()
        && !entry.work.settled
        && entry.slave != 0
        && answer::equals_its_request(&entry.work.request)
}
