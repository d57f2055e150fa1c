//! What came and was no answer to what was asked.

use std::time::Duration;

use tokio::time::Instant;

use super::{
    Master,
    doubt::{self, Heard},
};
use crate::{
    config,
    evidence::{Over, What},
    exchange::{Frame, Stray},
};

/// How much later than it was seen to come again an answer may come again: as much as the time of a host varies.
const AGAIN: Duration = Duration::from_millis(5);

impl<C> Master<C> {
    pub(super) fn count_strays(&mut self, now: Instant) {
        for stray in self.exchange.take_strays() {
            match stray {
                Stray::Echo => self.stats.echoes += 1,
                Stray::Noise(bytes) => self.stats.noise_bytes += bytes as u64,
                Stray::Early { slave, frame } => {
                    let station = self.station(slave);
                    station.stats.early += 1;
                    let heard = station.heard(now, frame, false);
                    self.evidence.stray(now, Over::First, slave, What::Early);
                    self.note_heard(now, slave, heard);
                }
                Stray::Frame { slave, function, frame, is_request, number, nobody } => {
                    if number == Some(0) && self.exchange.number() != Some(0) {
                        self.evidence.stray(now, Over::First, slave, What::NumberZero);
                    }
                    let took = self.far_end.took(now, number).filter(|_| !nobody);
                    let given_up = self.far_end.heard(now, slave, number, frame.shape, nobody);
                    let was_owed = given_up.is_some();
                    // Its number says which question it answers, so that what it has taken is what such a question takes. A
                    // gateway is waited for so long all the same: the time that a stop waits behind it has it in it.
                    let wait = self.far_end.wait();
                    if let (Some(took), Some(station)) = (took, self.stations.get_mut(&slave)) {
                        station.timeout.allow((took * 5 / 4).min(wait));
                        station.timeout.answered(took);
                    }
                    if was_owed && !nobody && number.is_some() && self.stations.contains_key(&slave) {
                        self.note_alive(now, slave);
                    }
                    self.nobody_answered(now, given_up.unwrap_or_default());
                    self.count_frame(now, (slave, function, frame, is_request), was_owed);
                }
            }
        }
    }

    fn count_frame(
        &mut self,
        now: Instant,
        (slave, function, frame, is_request): (u8, u8, Frame, bool),
        was_owed: bool,
    ) {
        if let Some(flight) = self.flight.as_mut().filter(|flight| flight.slave == slave) {
            // Two masters have asked for the same; whose answer comes first nobody knows.
            flight.suspect |= is_request && frame.shape == flight.shape;
        }
        let asked = self.flight.as_ref().filter(|flight| flight.slave == slave);
        let asked = asked.map(|flight| flight.request.function_code().value());
        let confuses = self.exchange.confuses_late_answers();
        let with_next = asked.is_some();
        let stop = self.schedule.first_stop(|entry| (entry.slave == slave).then_some(entry.arrived));
        let stop_by = stop.map(|arrived| arrived + self.learned_worst_case_stop());
        let Some(station) = self.stations.get_mut(&slave) else {
            self.stats.foreign += 1;
            let what = if is_request { What::OthersRequest } else { What::OthersAnswer };
            self.evidence.stray(now, Over::First, slave, what);
            return;
        };
        let heard = if confuses { station.heard(now, frame, is_request) } else { Heard::default() };
        let late = heard.was_owed;
        self.evidence.stray(
            now,
            Over::First,
            slave,
            match &heard {
                _ if is_request => What::OthersRequest,
                _ if was_owed || late => What::Late { with_next },
                heard if heard.withdraws.is_some() => What::Contradicted,
                heard if heard.again_after.is_some() => What::Doubled,
                _ => What::OthersAnswer,
            },
        );
        if was_owed && !late {
            station.stats.late += 1;
            return;
        }
        if late {
            station.heard_late(now);
            self.offline.hope(now, slave);
        } else if !is_request && stop_by.is_none_or(|by| station.pauses_before(now, by)) {
            // Whatever it was, it was its own: it needs its pause. A stop that waits does so for none of them beyond its bound.
            station.spoke(now);
        }
        match asked {
            _ if late => station.stats.late += 1,
            Some(asked) if function & 0x7F != asked => station.stats.wrong_function += 1,
            Some(_) => station.stats.wrong_count += 1,
            None => self.stats.foreign += 1,
        }
        self.note_heard(now, slave, heard);
    }

    /// What a frame says of those before it.
    pub(super) fn note_heard(&mut self, now: Instant, slave: u8, heard: Heard) {
        if let Some(after) = heard.again_after {
            let known = self.comes_again_after(now);
            self.again =
                Some((known.unwrap_or(config::DOUBLE).max(after * 5 / 4 + AGAIN), now + doubt::MEMORY));
        }
        if let Some(asked_at) = heard.withdraws {
            let station = self.station(slave);
            station.stats.retracted += 1;
            station.retracted = Some(asked_at);
            self.retractions += 1;
        }
    }

    /// After how long answers were seen to come again lately.
    pub(super) fn comes_again_after(&self, now: Instant) -> Option<Duration> {
        self.again.filter(|(_, until)| *until > now).map(|(again, _)| again)
    }

    /// When the last value of a slave was asked for that another answer has withdrawn.
    pub(crate) fn retracted(&self, slave: u8) -> Option<Instant> {
        self.stations.get(&slave)?.retracted
    }

    /// How many values were withdrawn so far, of all slaves.
    pub(crate) const fn retractions(&self) -> u64 {
        self.retractions
    }
}
