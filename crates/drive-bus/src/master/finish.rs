//! How exchanges and waiting requests end.

use std::time::Duration;

use drive_core::{Class, PortError};
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{Flight, Master, Purpose, Sent, probing::Question, row};
use crate::{
    answer,
    evidence::{Ended, Over},
    exchange::{Brought, Failure, Frame, NOBODY_ANSWERED},
    protocol::Protocol,
    record::Ending,
};

impl<C> Master<C> {
    /// The exchange that is under way ends with `result`.
    pub(super) fn finish(&mut self, now: Instant, result: Brought) {
        let Some(flight) = self.flight.take() else { return };
        self.to_send = None;
        self.exchange_end = now;
        self.asked_at = crate::mutant!("age-of-the-telling", flight.asked_at, now);
        let slave = flight.slave;
        if matches!(flight.purpose, Purpose::ThrowAway) {
            return self.throw_away(now, &flight, &result);
        }
        let result = self.believe(now, &flight, result);
        let result = self.gateway_says(now, &flight, result);
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
        let ended = match &result {
            Ok(answer) => Ended::with(answer),
            Err(Failure::Nobody) => Ended::Exception(NOBODY_ANSWERED),
            Err(Failure::Doubted(_) | Failure::Refused(_)) => Ended::Unclear,
            Err(_) => Ended::InVain,
        };
        let (took, instead) = self.count(now, &flight, &result, ended);
        match &result {
            Ok(answer) => self.note_answer(now, &flight, answer),
            Err(failure) => self.note_failure(now, &flight, failure),
        }
        if may_be_late {
            // A probe's own answer may still come too.
            self.throw_away_for(now, &flight);
        }
        if result == Err(Failure::Nobody) {
            self.nobody_answered(now, vec![slave]);
        }
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
                    // It may have been refused for its length.
                    entry.work.asked_longer |= flight.more > 0 && matches!(failure, Failure::Doubted(_));
                    if entry.terms.class == Class::Stop {
                        // What it waited behind was owed for others, each of which has had its own share.
                        let usual = |sent: Sent| sent.usually_by.saturating_duration_since(flight.started);
                        let behind = flight.sent.filter(|_| flight.behind > 0);
                        let own = behind.map_or(took, |sent| took.min(usual(sent)));
                        let held_up = crate::mutant!("stop-rests-for-others", own, took);
                        self.offline.stop_failed(now, slave, held_up.max(self.in_vain()));
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
    fn throw_away(&mut self, now: Instant, flight: &Flight<C>, result: &Brought) {
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

    /// Before anybody is told what came the same is asked once more: nothing of it counts but that the slave is there.
    fn ask_once_more(&mut self, now: Instant, flight: Flight<C>, result: &Brought, doubted: (Frame, u32)) {
        self.count(now, &flight, result, Ended::Answered);
        self.note_alive(now, flight.slave);
        self.await_its_own(now);
        if let Purpose::Call(Some(mut entry)) = flight.purpose {
            entry.work.doubted = Some(doubted);
            self.schedule.put_back(entry);
        }
    }

    /// What came is another question's answer, or may be. Its own may be on its way: whoever is asked now would speak into it.
    fn await_its_own(&mut self, now: Instant) {
        self.thrown_away(now);
    }

    /// An exchange is over. Gives how long it took, and what came instead of its answer.
    fn count(
        &mut self,
        now: Instant,
        flight: &Flight<C>,
        result: &Brought,
        ended: Ended,
    ) -> (Duration, Option<String>) {
        let slave = flight.slave;
        self.record.ended(now, slave, flight.started, Ending::of(result));
        let instead = self.note_end(now, (Over::First, slave), &flight.request, ended);
        let took = now.saturating_duration_since(flight.started);
        self.stats.busy += took + self.config.silence();
        self.station(slave).stats.exchanges.record(took);
        (took, instead)
    }

    /// How an exchange ended is kept. Gives what came instead of its answer, in words.
    pub(super) fn note_end(
        &mut self,
        now: Instant,
        of: (Over, u8),
        request: &Request<'_>,
        ended: Ended,
    ) -> Option<String> {
        let is_rtu = self.config.protocol == Protocol::Rtu;
        self.evidence.ended(now, of, is_rtu, ended, answer::likely_len(request))
    }

    /// The answer is nobody's, and the question asked again once its own could have come.
    fn ask_again(&mut self, now: Instant, flight: Flight<C>, result: &Brought) {
        let slave = flight.slave;
        self.count(now, &flight, result, Ended::Unclear);
        self.station(slave).stats.outcomes.mismatches += 1;
        self.throw_away_for(now, &flight);
        self.await_its_own(now);
        self.note_alive(now, slave);
        match flight.purpose {
            Purpose::Call(Some(mut entry)) => {
                let why = "the answer may be that to an earlier request".to_owned();
                entry.work.last = Some(PortError::Mismatch(why));
                self.schedule.put_back(entry);
            }
            _ => self.station(slave).stats.outcomes.withdrawn += 1,
        }
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
}
