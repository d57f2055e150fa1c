//! A line's master, fed by hand: requests, what the line hears, and time.

use std::time::Duration;

use drive_bus::{
    LineConfig,
    exchange::rtu,
    master::{Master, Outcome},
};
use drive_core::{PortError, Terms};
use tokio::time::Instant;
use tokio_modbus::Request;

/// How long a slave takes to answer here.
pub(crate) const RESPONSE: Duration = Duration::from_millis(20);

pub(crate) struct ByHand {
    pub(crate) master: Master<u32>,
    pub(crate) now: Instant,
    config: LineConfig,
}

impl ByHand {
    /// A line whose port has been open for a while.
    pub(crate) fn new(config: LineConfig) -> Self {
        let mut master = Master::new(Instant::now(), config.clone());
        let now = Instant::now() + Duration::from_secs(1);
        master.handle_up(now);
        Self { master, now: now + Duration::from_secs(1), config }
    }

    /// A line whose slave 1 was asked this for so long in vain.
    pub(crate) fn after_a_question_in_vain(
        config: LineConfig,
        request: Request<'static>,
        terms: Terms,
        time: Duration,
    ) -> Self {
        let mut line = Self::new(config);
        line.ask(1, 1, request, terms);
        line.sent();
        line.sends_nothing_for(time);
        assert!(line.ended().is_some_and(|(_, outcome)| outcome.is_err()));
        line
    }

    pub(crate) fn ask(&mut self, caller: u32, slave: u8, request: Request<'static>, terms: Terms) {
        self.submit(caller, slave, request, terms).expect("the line takes it");
    }

    pub(crate) fn submit(
        &mut self,
        caller: u32,
        slave: u8,
        request: Request<'static>,
        terms: Terms,
    ) -> Result<(), PortError> {
        self.master.submit(self.now, slave, request, terms, caller).map(|_| ())
    }

    /// What is written next, before `until`; the port has not taken it yet.
    pub(crate) fn next_written(&mut self, until: Instant) -> Option<Vec<u8>> {
        loop {
            self.master.handle_timeout(self.now);
            if let Some(bytes) = self.master.poll_transmit(self.now) {
                return Some(bytes.to_vec());
            }
            let due = self.master.deadline().filter(|due| *due < until)?;
            self.now = self.now.max(due);
        }
    }

    /// What is sent next, before `until`.
    pub(crate) fn next_sent(&mut self, until: Instant) -> Option<Vec<u8>> {
        let bytes = self.next_written(until)?;
        self.master.handle_sent(self.now);
        Some(bytes)
    }

    /// What is sent next, within a minute.
    pub(crate) fn sent(&mut self) -> Vec<u8> {
        self.next_sent(self.now + Duration::from_secs(60)).expect("something is sent")
    }

    /// Nothing is sent for so long.
    pub(crate) fn sends_nothing_for(&mut self, time: Duration) {
        let until = self.now + time;
        assert_eq!(self.next_sent(until), None);
        self.now = until;
    }

    /// Bytes that end on the line `after` from now, with what the line does until then.
    pub(crate) fn hears(&mut self, after: Duration, bytes: &[u8]) {
        let at = self.now + after;
        assert_eq!(self.next_sent(at), None, "sent while something was on its way");
        self.now = at;
        self.master.handle_timeout(at);
        self.master.handle_bytes(at, bytes);
    }

    /// The slave that `request` was for answers it, [`RESPONSE`] after its end.
    pub(crate) fn answers(&mut self, request: &[u8], pdu: &[u8]) {
        let characters = if self.config.silence().is_zero() { 0 } else { request.len() + pdu.len() + 3 };
        let after = self.config.serial.characters(characters) + RESPONSE;
        self.hears(after, &rtu::frame(request[0], pdu));
    }

    /// How the next call ended, if one has.
    pub(crate) fn ended(&mut self) -> Option<(u32, Outcome)> {
        self.master.poll_outcome()
    }
}
