//! Whether what came to a question is believed.

use tokio::time::Instant;
use tokio_modbus::Request;

use super::{Flight, Master, Purpose, row::Come};
use crate::{
    config,
    exchange::{Answer, Brought, Failure, Frame, NOBODY_ANSWERED},
    shape,
};

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
    /// Whether it may be the answer to an earlier question that looks the same, and that was never heard: the far end may have kept it
    /// until this question came.
    pub(super) fn may_be_late(&self, now: Instant, flight: &Flight<C>, result: &Brought) -> bool {
        let station =
            self.stations.get(&flight.slave).filter(|_| is_read(flight) && matches!(result, Ok(Ok(_))));
        let may_be = station.is_some_and(|station| station.doubt.may_be_late(now, flight.shape));
        may_be && self.exchange.confuses_late_answers()
    }

    /// What came to a read, where it may be the answer to another one that came twice, and how often that was so.
    pub(super) fn doubted(&self, now: Instant, flight: &Flight<C>, result: &Brought) -> Option<(Frame, u32)> {
        let Purpose::Call(Some(entry)) = &flight.purpose else { return None };
        let come = self.come(flight, result.as_ref().ok()?)?;
        let row = &self.stations.get(&flight.slave)?.row;
        let is_doubtful = crate::mutant!("row-out-of-step-believed", row.is_doubtful(now, come), false);
        let times = entry.work.doubted.map_or(1, |(_, times)| times + 1);
        is_doubtful.then_some((come.frame, times))
    }

    /// What came to a read, where nothing but its shape tells whose answer it is.
    pub(super) fn come(&self, flight: &Flight<C>, answer: &Answer) -> Option<Come> {
        let is_it = answer.is_ok() && is_read(flight) && self.exchange.confuses_late_answers();
        let frame = self.exchange.taken().filter(|_| is_it)?;
        Some(Come { question: flight.asks, asked_at: flight.asked_at, frame, before: flight.doubted() })
    }

    /// What has come counts as what was owed; that to this question may still come.
    pub(super) fn throw_away_for(&mut self, now: Instant, flight: &Flight<C>) {
        let until = now + flight.patience.max(config::DOUBLE);
        self.station(flight.slave).doubt.threw_away(now, flight.shape, until);
    }

    /// What the exchange brought, as far as it proves itself. Where it does not, its own answer may still come.
    pub(super) fn believe(&mut self, now: Instant, flight: &Flight<C>, result: Brought) -> Brought {
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
    pub(super) fn gateway_says(&mut self, now: Instant, flight: &Flight<C>, result: Brought) -> Brought {
        match result {
            Ok(Err(code)) if self.far_end.is_there() && u8::from(code) == NOBODY_ANSWERED => {
                self.far_end.nobody_answered(now, flight.asked());
                Err(Failure::Nobody)
            }
            result => result,
        }
    }
}
