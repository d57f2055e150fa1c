//! What an exchange shows of its slave, and of what stands between.

use std::time::Duration;

use drive_core::{Class, PortError};
use tokio::time::Instant;

use super::{Flight, Master, port::PortState, probing::Question};
use crate::{
    answer, config,
    exchange::{Answer, Failure},
};

/// The length of an exception: its function code and its number.
const EXCEPTION: usize = 2;

impl<C> Master<C> {
    /// The far end has waited for these in vain, as long and as often as it does: they are off-line, without being asked
    /// again.
    pub(super) fn nobody_answered(&mut self, now: Instant, slaves: Vec<u8>) {
        if self.config.offline_after == 0 {
            return;
        }
        for slave in slaves {
            if self.missed(now, slave, true) {
                self.go_offline(now, slave);
            }
        }
    }

    /// How long a question in vain holds everybody up.
    pub(super) fn in_vain(&self) -> Duration {
        if self.far_end.holds_others_up() { self.far_end.wait() } else { Duration::ZERO }
    }

    /// The far end may still be at it.
    pub(super) fn owe(&mut self, flight: &Flight<C>) {
        self.unsettle(self.exchange_end, flight);
        if let Some(asked) = flight.asked() {
            self.far_end.owe(asked);
        }
    }

    pub(super) fn note_answer(&mut self, now: Instant, flight: &Flight<C>, answer: &Answer) {
        let again = self.comes_again_after(now);
        let read = self.come(flight, answer);
        let again = if read.is_some_and(|read| read.contradicts_itself()) {
            // One of its own may still be to come.
            again.max(Some(flight.patience.max(config::DOUBLE)))
        } else {
            again
        };
        let double = self.config.double_window.max(again.unwrap_or_default());
        let taken = self.exchange.taken();
        let expected = if answer.is_ok() { answer::likely_len(&flight.request) } else { EXCEPTION };
        let characters = self.config.characters(self.config.answer_len(expected));
        let took = self.exchange.took();
        let confuses = self.exchange.confuses_late_answers();
        let at_once = flight.sent.is_none_or(|sent| now <= sent.usually_by);
        let given_up = self.far_end.answered(now, flight.behind, at_once);
        self.nobody_answered(now, given_up);
        self.second.settled(now, flight.slave, flight.asked_at);
        let station = self.station(flight.slave);
        match read {
            Some(read) => station.row.told(now, read),
            None => station.row.is_in_step(),
        }
        station.doubt.is_in_step();
        station.answered_at = Some(flight.asked_at);
        // What has waited behind what was owed says nothing of its slave.
        if let Some(sent) = flight.sent.filter(|_| at_once) {
            let elapsed = || now.saturating_duration_since(sent.end).saturating_sub(characters);
            let after = took.unwrap_or_else(elapsed);
            station.timeout.answered(after);
            station.stats.response.record(after);
        }
        match answer {
            Ok(_) => {
                station.stats.outcomes.answered += 1;
                if confuses {
                    station.doubt.answered(now, flight.shape, double, again);
                    if let Some(frame) = taken {
                        station.doubt.took(now, frame, flight.asked_at);
                    }
                    self.fresh.answered(flight.slave, flight.shape);
                }
            }
            Err(_) => station.stats.outcomes.exceptions += 1,
        }
        self.note_alive(now, flight.slave);
    }

    pub(super) fn note_alive(&mut self, now: Instant, slave: u8) {
        self.station(slave).answered(now);
        if self.offline.remove(slave) {
            self.welcome(now, slave);
        }
    }

    pub(super) fn note_failure(&mut self, now: Instant, flight: &Flight<C>, failure: &Failure) {
        // Damage may have made it look like ours: then our own answer is still to come.
        let may_be_anothers = matches!(failure, Failure::Damaged(_))
            && self.stations.iter().any(|(slave, other)| {
                *slave != flight.slave && other.doubt.over().is_some_and(|over| over > now)
            });
        if may_be_anothers {
            self.fear_late_answer(now, flight);
        }
        // What is off-line and says what is no answer is probed no sooner for that.
        if matches!(failure, Failure::Damaged(_) | Failure::Mismatch(_)) {
            self.offline.missed_again(now, flight.slave, self.config.probe_backoff);
        }
        let heard_until = self.quiet_from;
        let Some(station) = self.stations.get_mut(&flight.slave) else { return };
        if !matches!(failure, Failure::Timeout | Failure::Nobody) {
            station.spoke(heard_until);
        }
        match failure {
            Failure::Damaged(_) => {
                station.stats.outcomes.damaged += 1;
                // It may come once more, whole.
                let again = if self.far_end_paces { config::DOUBLE } else { self.config.late_window };
                station.doubt.owe(now, flight.shape, flight.wrote, now + again, false);
                station.doubt.is_in_step();
                return;
            }
            // It answers, and its next exchange will prove something.
            Failure::Doubted(_) => {
                station.stats.outcomes.mismatches += 1;
                self.note_alive(now, flight.slave);
                return;
            }
            // Nothing of it can still come. One that does nothing but refuse is as good as away.
            Failure::Refused(_) => {
                station.stats.outcomes.busy += 1;
                if self.missed(now, flight.slave, false) {
                    self.go_offline(now, flight.slave);
                }
                return;
            }
            Failure::Mismatch(_) => {
                station.stats.outcomes.mismatches += 1;
                self.unsettle(now, flight);
            }
            Failure::Timeout => station.stats.outcomes.timeouts += 1,
            // Its gateway has waited for it.
            Failure::Nobody => {
                station.stats.outcomes.timeouts += 1;
                return;
            }
        }
        let goes_offline = *failure == Failure::Timeout
            && self.missed(now, flight.slave, flight.question == Question::Short);
        self.fear_late_answer(now, flight);
        if *failure == Failure::Timeout {
            self.owe(flight);
            if self.stations.get(&flight.slave).is_some_and(|station| station.timeout.is_learned()) {
                self.fresh.in_vain(now);
                if self.blame_second(flight) {
                    self.fresh.is_mute = true;
                }
            }
        }
        if goes_offline {
            self.go_offline(now, flight.slave);
        }
    }

    /// The exchange has ended without its answer, which may still come: also over the next connection, from a serial
    /// server that has kept it.
    pub(super) fn fear_late_answer(&mut self, now: Instant, flight: &Flight<C>) {
        let confuses = crate::mutant!("late-answer-unfeared", self.exchange.confuses_late_answers(), false);
        if flight.slave == 0 || !confuses {
            return;
        }
        let station = self.station(flight.slave);
        let timeout = flight.sent.map_or(station.timeout.current(), |sent| sent.timeout);
        // A slave that may take longer than the window to answer in time may take longer still to be late.
        let window = self.config.late_window.max(timeout * 3 / 2);
        let sent = flight.sent.map_or(self.end_of_sending(now), |sent| sent.end);
        let lost = !matches!(self.port, PortState::Open);
        let from = if flight.stalled { now } else { sent };
        let doubt = &mut self.station(flight.slave).doubt;
        doubt.owe(now, flight.shape, flight.wrote, from + window, lost);
        if lost {
            // The first answer over the next port is thrown away for all of them.
            doubt.is_in_step();
        }
        if flight.stalled {
            doubt.hold(now, from + window);
        }
    }

    /// A slave did not answer a question, `short` or not. True: it goes off-line with this.
    fn missed(&mut self, now: Instant, slave: u8, short: bool) -> bool {
        let backoff = self.config.probe_backoff;
        let Some(station) = self.stations.get_mut(&slave) else { return false };
        let is_lost = station.missed(&self.config, short);
        if self.offline.missed_again(now, slave, backoff) || !is_lost {
            return false;
        }
        station.stats.went_offline += 1;
        self.offline.insert(now, slave, backoff.0);
        true
    }

    fn go_offline(&mut self, now: Instant, slave: u8) {
        tracing::debug!(slave, "slave off-line");
        let at = self.probe_at(slave).unwrap_or(now);
        let retry_in = self.probe_in(now, at);
        let waiting = self.schedule.withdraw_all(|entry| {
            entry.slave == slave
                && crate::mutant!("stop-dropped-offline", entry.terms.class != Class::Stop, true)
        });
        for entry in waiting {
            self.drop_unsent(entry, PortError::Offline { retry_in });
        }
    }
}
