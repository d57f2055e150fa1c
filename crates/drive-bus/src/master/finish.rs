//! How exchanges and waiting requests end.

use std::time::Duration;

use drive_core::{Class, Effect, PortError};
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{
    Asked, Flight, Master, Purpose, Sent,
    port::PortState,
    probing::Question,
    row::{self, Come},
};
use crate::{
    answer, config,
    evidence::{Ended, Over},
    exchange::{Answer, Failure, Frame, NOBODY_ANSWERED},
    protocol::Protocol,
    record::Ending,
    schedule::Entry,
    shape,
};

/// The length of an exception: its function code and its number.
const EXCEPTION: usize = 2;

/// Whether a request reads what a slave may answer otherwise the next time.
fn is_read<C>(flight: &Flight<C>) -> bool {
    matches!(
        *flight.request,
        Request::ReadCoils(..)
            | Request::ReadDiscreteInputs(..)
            | Request::ReadHoldingRegisters(..)
            | Request::ReadInputRegisters(..)
    )
}

impl<C> Master<C> {
    /// The exchange that is under way ends with `result`.
    pub(super) fn finish(&mut self, now: Instant, result: Result<Answer, Failure>) {
        let Some(flight) = self.flight.take() else { return };
        self.to_send = None;
        self.exchange_end = now;
        self.asked_at = crate::mutant!("age-of-the-telling", flight.asked_at, now);
        let slave = flight.slave;
        if flight.purpose.is_thrown_away() {
            return self.throw_away(now, &flight, &result);
        }
        let result = self.believe(now, &flight, result);
        let (result, nobody) = self.gateway_says(now, &flight, result);
        let may_be_late = self.may_be_late(now, &flight, &result);
        if may_be_late && matches!(flight.purpose, Purpose::Call(_)) {
            return self.ask_again(now, flight, &result);
        }
        let mut result = result;
        if let Some((frame, times)) = self.doubted(now, &flight, &result) {
            if times < row::MOST_TIMES {
                return self.ask_once_more(now, flight, &result, (frame, times));
            }
            result = Err(Failure::Doubted("each time it was asked it said what another read had said"));
        }
        self.record.ended(now, slave, flight.started, Ending::of(&result));
        let expected = answer::likely_len(&flight.request);
        let ended = match &result {
            Ok(Ok(_)) => Ended::Answered(expected),
            Ok(Err(code)) => Ended::Exception(u8::from(*code)),
            Err(Failure::Nobody) => Ended::Exception(NOBODY_ANSWERED),
            Err(Failure::Doubted(_) | Failure::Refused(_)) => Ended::Unclear,
            Err(_) => Ended::InVain,
        };
        let is_rtu = self.config.protocol == Protocol::Rtu;
        let instead = self.evidence.ended(now, (Over::First, slave), is_rtu, ended, expected);
        self.stats.busy += now.saturating_duration_since(flight.started) + self.config.silence();
        match &result {
            Ok(answer) => self.note_answer(now, &flight, answer),
            Err(failure) => self.note_failure(now, &flight, failure),
        }
        if may_be_late {
            // A probe's own answer may still come too.
            self.throw_away_for(now, &flight);
        }
        if nobody {
            self.nobody_answered(now, vec![slave]);
        }
        let took = now.saturating_duration_since(flight.started);
        self.station(slave).stats.exchanges.record(took);
        let answered = result.is_ok();
        match flight.purpose {
            Purpose::Call(Some(mut entry)) => match result {
                Ok(Err(_)) if flight.more > 0 => {
                    // The drive may have nothing behind what was wanted.
                    entry.work.asked_longer = true;
                    self.schedule.put_back(entry);
                }
                Ok(answer) => {
                    // An earlier attempt may have been carried out: its repetition can be refused for that very reason.
                    let doubtful = answer.is_err() && entry.work.is_write && entry.work.last.is_some();
                    let refused = "not answered, and refused when it was repeated";
                    let outcome = if crate::mutant!("refused-repetition-believed", doubtful, false) {
                        Err(PortError::OutcomeUnknown(refused))
                    } else {
                        Ok(answer)
                    };
                    self.outcomes.push_back((entry.work.caller, outcome));
                }
                Err(failure) => {
                    if entry.terms.class == Class::Stop {
                        // What it waited behind was owed for others, each of which has had its own share.
                        let usual = |sent: Sent| sent.usually_by.saturating_duration_since(flight.started);
                        let behind = flight.sent.filter(|_| flight.behind > 0);
                        let own = behind.map_or(took, |sent| took.min(usual(sent)));
                        let own = crate::mutant!("stop-rests-for-others", own, took);
                        self.offline.stop_failed(now, slave, own.max(self.in_vain()));
                    }
                    let waited = flight.sent.map_or(Duration::ZERO, |sent| {
                        sent.timeout.min(now.saturating_duration_since(sent.end))
                    });
                    // To the line it is silent; whoever asked is told what came.
                    let failure = match (failure, instead) {
                        (Failure::Timeout | Failure::Mismatch(_), Some(came)) if !entry.work.is_write => {
                            Failure::Mismatch(came)
                        }
                        (failure, _) => failure,
                    };
                    self.fail(now, entry, failure, waited);
                }
            },
            Purpose::Call(None) => self.station(slave).stats.outcomes.withdrawn += 1,
            Purpose::Probe => {
                let held = if answered { Duration::ZERO } else { self.in_vain() };
                let long = flight.question == Question::Long && held.is_zero();
                let took = took.max(held) + self.config.silence();
                self.probing.ended(now, took, answered, long, self.offline.len());
            }
            Purpose::ThrowAway => {}
            Purpose::EchoRead => {
                tracing::debug!(slave, echoes = self.exchange.echoes(), "adapter asked for its echo");
            }
        }
    }

    /// What the last port left behind has come, or the answer, or nothing: either of the two may still come.
    fn throw_away(&mut self, now: Instant, flight: &Flight<C>, result: &Result<Answer, Failure>) {
        self.record.ended(now, flight.slave, flight.started, Ending::of(result));
        self.stats.busy += now.saturating_duration_since(flight.started) + self.config.silence();
        self.fear_late_answer(now, flight);
        if result.is_ok() {
            self.station(flight.slave).doubt.is_in_step();
        }
        if *result == Err(Failure::Timeout) {
            self.owe(flight);
        }
        self.thrown_away(now);
    }

    /// Whether it may be the answer to an earlier question that looks the same, and that was never heard: the far end may have kept it
    /// until this question came.
    fn may_be_late(&self, now: Instant, flight: &Flight<C>, result: &Result<Answer, Failure>) -> bool {
        let station =
            self.stations.get(&flight.slave).filter(|_| is_read(flight) && matches!(result, Ok(Ok(_))));
        let may_be = station.is_some_and(|station| station.doubt.may_be_late(now, flight.shape));
        may_be && self.exchange.confuses_late_answers()
    }

    /// What came to a read, where it may be the answer to another one that came twice, and how often that was so.
    fn doubted(
        &self,
        now: Instant,
        flight: &Flight<C>,
        result: &Result<Answer, Failure>,
    ) -> Option<(Frame, u32)> {
        let Purpose::Call(Some(entry)) = &flight.purpose else { return None };
        let come = self.come(flight, result.as_ref().ok()?)?;
        let row = &self.stations.get(&flight.slave)?.row;
        let is_doubtful = crate::mutant!("row-out-of-step-believed", row.is_doubtful(now, come), false);
        let times = entry.work.doubted.map_or(1, |(_, times)| times + 1);
        is_doubtful.then_some((come.frame, times))
    }

    /// What came to a read, where nothing but its shape tells whose answer it is.
    fn come(&self, flight: &Flight<C>, answer: &Answer) -> Option<Come> {
        let is_it = answer.is_ok() && is_read(flight) && self.exchange.confuses_late_answers();
        let frame = self.exchange.taken().filter(|_| is_it)?;
        Some(Come { question: flight.asks, asked_at: flight.asked_at, frame, before: flight.doubted() })
    }

    /// Before anybody is told what came the same is asked once more: nothing of it counts but that the slave is there.
    fn ask_once_more(
        &mut self,
        now: Instant,
        flight: Flight<C>,
        result: &Result<Answer, Failure>,
        doubted: (Frame, u32),
    ) {
        let slave = flight.slave;
        let expected = answer::likely_len(&flight.request);
        self.set_aside(now, &flight, result, Ended::Answered(expected));
        self.note_alive(now, slave);
        if let Purpose::Call(Some(mut entry)) = flight.purpose {
            entry.work.doubted = Some(doubted);
            self.schedule.put_back(entry);
        }
    }

    /// An exchange is over whose answer nobody is told.
    fn set_aside(
        &mut self,
        now: Instant,
        flight: &Flight<C>,
        result: &Result<Answer, Failure>,
        ended: Ended,
    ) {
        let slave = flight.slave;
        self.record.ended(now, slave, flight.started, Ending::of(result));
        let expected = answer::likely_len(&flight.request);
        let is_rtu = self.config.protocol == Protocol::Rtu;
        self.evidence.ended(now, (Over::First, slave), is_rtu, ended, expected);
        let took = now.saturating_duration_since(flight.started);
        self.stats.busy += took + self.config.silence();
        self.station(slave).stats.exchanges.record(took);
    }

    /// The answer is nobody's, and the question asked again once its own could have come.
    fn ask_again(&mut self, now: Instant, flight: Flight<C>, result: &Result<Answer, Failure>) {
        let slave = flight.slave;
        self.set_aside(now, &flight, result, Ended::Unclear);
        self.station(slave).stats.outcomes.mismatches += 1;
        self.throw_away_for(now, &flight);
        self.note_alive(now, slave);
        match flight.purpose {
            Purpose::Call(Some(mut entry)) => {
                let why = "the answer may be that to an earlier request".to_owned();
                entry.work.last = Some(PortError::Mismatch(why));
                // Longer it may have been refused before.
                entry.work.asked_longer = true;
                self.schedule.put_back(entry);
            }
            _ => self.station(slave).stats.outcomes.withdrawn += 1,
        }
    }

    /// What has come counts as what was owed; that to this question may still come.
    fn throw_away_for(&mut self, now: Instant, flight: &Flight<C>) {
        let until = now + flight.patience.max(config::DOUBLE);
        self.station(flight.slave).doubt.threw_away(now, flight.shape, until);
    }

    /// What the exchange brought, as far as it proves itself. Where it does not, its own answer may still come.
    fn believe(
        &mut self,
        now: Instant,
        flight: &Flight<C>,
        result: Result<Answer, Failure>,
    ) -> Result<Answer, Failure> {
        let answer = result?;
        let owes_refusal = self.station(flight.slave).doubt.owes_refusal(now, flight.shape);
        let doubtful = flight.suspect || answer.is_err() && owes_refusal;
        if crate::mutant!("doubtful-answer-believed", doubtful, false) {
            self.fear_late_answer(now, flight);
            return Err(Failure::Doubted("the answer may be that to an earlier request"));
        }
        Ok(answer.map(|response| shape::shortened(response, flight.more)))
    }

    /// What a gateway says for a slave that has not answered is no answer of it.
    fn gateway_says(
        &mut self,
        now: Instant,
        flight: &Flight<C>,
        result: Result<Answer, Failure>,
    ) -> (Result<Answer, Failure>, bool) {
        match result {
            Ok(Err(code)) if self.far_end.is_there() && u8::from(code) == NOBODY_ANSWERED => {
                self.far_end.nobody_answered(now, flight.asked());
                (Err(Failure::Nobody), true)
            }
            result => (result, false),
        }
    }

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
    fn in_vain(&self) -> Duration {
        if self.far_end.holds_others_up() { self.far_end.wait() } else { Duration::ZERO }
    }

    /// The far end may still be at it.
    pub(super) fn owe(&mut self, flight: &Flight<C>) {
        self.unsettle(self.exchange_end, flight);
        if let Some(asked) = flight.asked() {
            self.far_end.owe(asked);
        }
    }

    fn note_answer(&mut self, now: Instant, flight: &Flight<C>, answer: &Answer) {
        let again = self.again.filter(|(_, until)| *until > now).map(|(again, _)| again);
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

    fn note_failure(&mut self, now: Instant, flight: &Flight<C>, failure: &Failure) {
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

    /// An attempt has failed: once more, or the end.
    pub(super) fn fail(
        &mut self,
        now: Instant,
        mut entry: Entry<Asked<C>>,
        failure: Failure,
        waited: Duration,
    ) {
        let write = entry.work.is_write;
        let error = match failure {
            Failure::Refused(why) => match entry.work.last.take() {
                // An earlier attempt may have been carried out.
                Some(unknown @ PortError::OutcomeUnknown(_)) => unknown,
                _ => PortError::Busy(why),
            },
            Failure::Doubted(why) if write => PortError::OutcomeUnknown(why),
            Failure::Doubted(why) => PortError::Mismatch(why.to_owned()),
            Failure::Timeout | Failure::Nobody if write => {
                crate::mutant!(
                    "lost-write-told-as-expired",
                    PortError::OutcomeUnknown("no answer"),
                    PortError::Expired
                )
            }
            Failure::Damaged(_) if write => PortError::OutcomeUnknown("the answer was damaged"),
            Failure::Mismatch(_) if write => PortError::OutcomeUnknown("the confirmation does not fit"),
            Failure::Timeout | Failure::Nobody => PortError::Timeout { after: waited },
            Failure::Damaged(why) => PortError::Damaged(why),
            Failure::Mismatch(why) => PortError::Mismatch(why),
        };
        if self.may_retry(now, &entry) {
            entry.work.attempts += 1;
            entry.work.last = Some(error);
            self.schedule.queue_again(entry);
        } else {
            self.outcomes.push_back((entry.work.caller, Err(error)));
        }
    }

    fn may_retry(&self, now: Instant, entry: &Entry<Asked<C>>) -> bool {
        let offline = self.offline.contains(entry.slave);
        let edge =
            crate::mutant!("edge-repeated", entry.work.is_write && entry.terms.effect == Effect::Edge, false);
        // A command sent again behind a stop would undo it.
        let stopped = entry.work.is_write
            && entry.terms.class != Class::Stop
            && self.schedule.any(|other| {
                other.terms.class == Class::Stop && (other.slave == 0 || other.slave == entry.slave)
            });
        // A later request with the same key says that this value is not wanted any more.
        let replaced = entry.terms.replaces.is_some()
            && self
                .schedule
                .any(|other| other.slave == entry.slave && other.terms.replaces == entry.terms.replaces);
        // The gateway has not given it up yet, and asks as often as it does. One that answers as a rule is late, and soon heard.
        let was_heard = self.stations.get(&entry.slave).is_some_and(|station| station.timeout.is_learned());
        let is_asked_still =
            !entry.work.is_write && !was_heard && self.far_end.gate(true).is_some_and(|gate| gate > now);
        entry.work.attempts < self.config.retries
            && entry.expires().is_none_or(|expires| now < expires)
            && !(offline
                || edge
                || crate::mutant!("command-repeated-behind-stop", stopped, false)
                || crate::mutant!("old-setpoint-repeated", replaced, false)
                || is_asked_still
                || self.closing)
    }

    /// The time of a request that nobody answers is over.
    pub(super) fn finish_unanswered(&mut self, now: Instant) {
        let Some(flight) = self.flight.take() else { return };
        self.exchange_end = now;
        self.exchange.abandon();
        self.record.ended(now, flight.slave, flight.started, Ending::Unanswered);
        self.stats.broadcasts += u64::from(flight.slave == 0);
        if flight.behind > 0 {
            self.unsettle(now, &flight);
        }
        self.stats.busy += now.saturating_duration_since(flight.started);
        let Purpose::Call(Some(entry)) = flight.purpose else { return };
        let confirmation = answer::confirmation(&flight.request)
            .map(Ok)
            .ok_or_else(|| PortError::NotCarried("nobody answers it".to_owned()));
        self.outcomes.push_back((entry.work.caller, confirmation));
    }

    /// The port is lost with exchanges under way. A read waits for the next port, and so does a stop; any other write has an
    /// unknown outcome and is never sent again.
    pub(super) fn fail_flight(&mut self, now: Instant, reason: &str) {
        self.to_send = None;
        if let Some(flight) = &self.flight {
            self.record.ended(now, flight.slave, flight.started, Ending::LineLost);
        }
        self.evidence.forsake(None);
        let aside = std::mem::take(&mut self.aside).into_values().map(|aside| aside.flight);
        let flights: Vec<_> = self.flight.take().into_iter().chain(aside).collect();
        for flight in flights {
            self.unsettle(now, &flight);
            self.fear_late_answer(now, &flight);
            self.fail_call(now, flight.purpose, reason);
        }
    }

    fn fail_call(&mut self, now: Instant, purpose: Purpose<C>, reason: &str) {
        let Purpose::Call(Some(mut entry)) = purpose else { return };
        if entry.work.is_write {
            let unknown = PortError::OutcomeUnknown("the line was lost");
            // A stop is sent again, as soon as there is a port.
            if entry.terms.class == Class::Stop && self.may_retry(now, &entry) {
                entry.work.attempts += 1;
                entry.work.last = Some(unknown);
                self.schedule.queue_again(entry);
            } else {
                self.outcomes.push_back((entry.work.caller, Err(unknown)));
            }
        } else if self.may_retry(now, &entry) {
            entry.work.attempts += 1;
            entry.work.last = Some(PortError::LineDown(reason.to_owned()));
            self.schedule.queue_again(entry);
        } else {
            self.outcomes.push_back((entry.work.caller, Err(PortError::LineDown(reason.to_owned()))));
        }
    }

    /// A request leaves the queue. What was sent before, and waited to be sent again, ends as that attempt did.
    pub(super) fn drop_unsent(&mut self, entry: Entry<Asked<C>>, error: PortError) {
        let outcomes = &mut self.station(entry.slave).stats.outcomes;
        match error {
            PortError::Expired => outcomes.expired += 1,
            PortError::Superseded => outcomes.superseded += 1,
            _ => outcomes.refused += 1,
        }
        let error = crate::mutant!("sent-told-as-unsent", entry.work.last.unwrap_or(error), error);
        self.outcomes.push_back((entry.work.caller, Err(error)));
    }
}
