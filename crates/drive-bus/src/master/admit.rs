//! How a request comes to the line, and how whoever asked goes away.

use std::sync::Arc;

use bytes::Bytes;
use drive_core::{Class, PortError, Terms};
use tokio::time::Instant;
use tokio_modbus::Request;

use super::{Asked, Master, Purpose, port::PortState};
use crate::{
    answer, pdu,
    schedule::{Entry, Ticket},
};

impl<C> Master<C> {
    /// Takes a request.
    ///
    /// # Errors
    /// The request is refused at once: it has no form on this line, the slave is off-line, too many wait, the line is
    /// down or closed.
    pub fn submit(
        &mut self,
        now: Instant,
        slave: u8,
        request: Request<'static>,
        terms: Terms,
        caller: C,
    ) -> Result<Ticket, PortError> {
        let request = Arc::new(request);
        let pdu = self.admit(now, slave, &request, terms).inspect_err(|error| {
            if let Some(station) = self.stations.get_mut(&slave) {
                station.stats.outcomes.never_sent(error);
            }
        })?;
        let is_write = self.exchange.is_write(&request);
        if terms.class == Class::Stop {
            self.clear_the_way(now, slave);
            if is_write {
                self.station(slave).stopped = Some(now);
            }
        }
        let shape = self.exchange.shape(&pdu);
        let asked = Asked {
            request,
            pdu,
            shape,
            is_write,
            caller,
            attempts: 0,
            echo_was_read: false,
            asked_longer: false,
            went_second: false,
            doubted: None,
            last: None,
        };
        let (ticket, replaced) = self
            .schedule
            .push(now, slave, terms, asked)
            .map_err(|_| PortError::QueueFull(self.schedule.len()))?;
        for old in replaced {
            self.drop_unsent(old, PortError::Superseded);
        }
        self.choose_at = None;
        if terms.class == Class::Stop && is_write {
            // By this line whoever measures sees when a stop is there.
            tracing::debug!(slave, "a stop is in the queue of its line");
        }
        Ok(ticket)
    }

    fn admit(
        &mut self,
        now: Instant,
        slave: u8,
        request: &Arc<Request<'static>>,
        terms: Terms,
    ) -> Result<Bytes, PortError> {
        if self.closing {
            return Err(PortError::Closed);
        }
        let pdu = pdu::encode(request).map_err(|error| PortError::NotCarried(error.to_string()))?;
        if slave == 0 && answer::confirmation(request).is_none() {
            return Err(PortError::NotCarried(
                "nobody answers a broadcast, so that it cannot read".to_owned(),
            ));
        }
        let last = self.config.protocol.last_address();
        if slave > last {
            return Err(PortError::NotCarried(format!(
                "{slave} is no address of a slave on a line: 1 to {last}"
            )));
        }
        self.exchange.carries(slave, request, terms.class).map_err(PortError::NotCarried)?;
        if let PortState::Down(reason) = &self.port {
            return Err(PortError::LineDown(reason.clone()));
        }
        let is_write = self.exchange.is_write(request);
        self.station(slave).ask(now, request, is_write);
        let is_over = terms.class == Class::Command && is_write && self.is_stopped_since(slave, terms.begun);
        if crate::mutant!("order-goes-on-behind-stop", is_over, false) {
            return Err(PortError::Superseded);
        }
        if terms.class != Class::Stop
            && let Some(at) = self.probe_at(slave)
        {
            return Err(PortError::Offline { retry_in: self.probe_in(now, at) });
        }
        Ok(pdu)
    }

    /// The caller of a request is gone: what is unsent never is, but the write of a stop is sent, and sent again, all the same.
    pub fn withdraw(&mut self, ticket: Ticket) {
        let is_stop = |entry: &Entry<Asked<C>>| {
            let is_stop = entry.terms.class == Class::Stop && entry.work.is_write;
            crate::mutant!("stop-dropped-with-its-caller", is_stop, false)
        };
        if self.schedule.any(|entry| entry.ticket == ticket && is_stop(entry)) {
            return;
        }
        if let Some(entry) = self.schedule.withdraw(ticket) {
            self.station(entry.slave).stats.outcomes.withdrawn += 1;
            return;
        }
        let aside = self.aside.values_mut().map(|aside| &mut aside.flight);
        for flight in self.flight.iter_mut().chain(aside) {
            if let Purpose::Call(call) = &mut flight.purpose {
                call.take_if(|entry| entry.ticket == ticket && !is_stop(entry));
            }
        }
    }
}
