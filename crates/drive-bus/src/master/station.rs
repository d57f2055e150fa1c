//! What the master knows of one slave: its timeout, its pauses, what may still come from it.

use std::{sync::Arc, time::Duration};

use tokio::time::Instant;
use tokio_modbus::Request;

use super::{
    Asked,
    doubt::{Doubt, Heard},
    row::Row,
};
use crate::{
    answer,
    config::{LineConfig, SlaveSettings},
    exchange::Frame,
    schedule::Entry,
    stats::SlaveStats,
    timeout::LearnedTimeout,
};

/// How long a slave is probed after somebody last asked for it: whoever still cares asks more often, and an address that
/// was tried once is left alone.
const INTEREST: Duration = Duration::from_secs(60);

/// By how many words a read is lengthened at the most, to tell its answer from others: four lengths are more than the answers
/// that are ever owed at once, and three words are 3 ms at 19200 bit/s.
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
    pub(super) row: Row,
    /// When the last of its values was asked for that was withdrawn.
    pub(super) retracted: Option<Instant>,
    /// When the last question began that it has answered.
    pub(super) answered_at: Option<Instant>,
    /// When the write of a stop came for it last.
    pub(super) stopped: Option<Instant>,
    failures: u32,
    /// It was heard when its time was over.
    slow: bool,
    /// What a probe asks: the last read that was asked of this slave.
    last_read: Option<Arc<Request<'static>>>,
    asked: Option<Instant>,
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
            row: Row::default(),
            retracted: None,
            answered_at: None,
            stopped: None,
            failures: 0,
            slow: false,
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

    /// An intact frame of its came that was no answer to what was asked, or another master's request for one.
    pub(super) fn heard(&mut self, now: Instant, frame: Frame, is_request: bool) -> Heard {
        let heard = self.doubt.heard(now, frame, is_request);
        let out_of_step = if is_request { None } else { self.row.heard(now, frame.shape) };
        Heard { withdraws: out_of_step.or(heard.withdraws), ..heard }
    }

    /// It has answered, at `now`.
    pub(super) fn answered(&mut self, now: Instant) {
        self.failures = 0;
        self.slow = false;
        self.ready_at = Some(now + crate::mutant!("pause-unkept", self.settings.turnaround, Duration::ZERO));
    }

    /// With how many words more a read is asked, so that its answer differs from what may come, and until when it waits
    /// nevertheless.
    pub(super) fn place<C>(&self, now: Instant, entry: &Entry<Asked<C>>) -> (u8, Option<Instant>) {
        let spare = if entry.work.asked_longer { 0 } else { entry.terms.spare_words.min(MOST_SPARE) };
        let shapes = (0..=spare).map_while(|more| match more {
            0 => Some(entry.work.shape),
            more => entry.work.shape.longer(more),
        });
        self.doubt.best(now, shapes).map_or((0, None), |(more, wait)| (more as u8, wait))
    }

    /// It did not answer a question, `short` or not. True: as often as makes a slave off-line.
    pub(super) fn missed(&mut self, config: &LineConfig, short: bool) -> bool {
        self.timeout.missed();
        // A short question was one in the first place because it has never answered.
        self.failures = if short { config.offline_after } else { self.failures.saturating_add(1) };
        config.offline_after > 0 && self.failures >= config.offline_after
    }

    /// Whether somebody has asked for it, or will not have waited long, when it is probed at `at`.
    pub(super) fn is_wanted(&self, at: Instant) -> bool {
        self.asked.is_some_and(|asked| at <= asked + INTEREST)
    }

    /// Whether somebody has asked for it since then.
    pub(super) fn was_asked_since(&self, since: Instant) -> bool {
        self.asked.is_some_and(|asked| asked >= since)
    }

    /// Whether it has answered, and what was asked last.
    pub(super) const fn is_answering(&self) -> bool {
        self.failures == 0 && self.timeout.is_learned()
    }

    /// An answer came when its time was over: it is there, and slow, and needs its pause.
    pub(super) fn heard_late(&mut self, now: Instant) {
        self.slow = true;
        self.spoke(now);
    }

    /// What came until then, and was no answer, may have been its own: it needs its pause all the same.
    pub(super) fn spoke(&mut self, until: Instant) {
        self.ready_at = self.ready_at.max(Some(until + self.settings.turnaround));
    }

    /// Whether a pause that begins now is over by then.
    pub(super) fn pauses_before(&self, now: Instant, by: Instant) -> bool {
        now + self.settings.turnaround <= by
    }

    /// Whether only a long question is worth asking, because its own time was set or because it was heard late.
    pub(super) const fn wants_long(&self) -> bool {
        self.slow || self.settings.response_timeout.is_some()
    }
}
