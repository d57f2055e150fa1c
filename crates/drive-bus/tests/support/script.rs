//! One exchange machine, fed by hand: what is sent, what comes, and time.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use drive_bus::{
    exchange::{Machine, Step, Stray},
    pdu,
};
use drive_core::Class;
use tokio::time::Instant;
use tokio_modbus::Request;

use super::MS;

/// How long an answer may take here.
pub(crate) const PATIENCE: Duration = Duration::from_millis(500);

pub(crate) struct Script<M> {
    pub(crate) machine: M,
    pub(crate) now: Instant,
}

impl<M: Machine> Script<M> {
    pub(crate) fn new(machine: M) -> Self {
        Self { machine, now: Instant::now() }
    }

    /// Begins an exchange; what is sent, which takes no time here.
    pub(crate) fn ask(&mut self, slave: u8, request: &Request<'static>) -> Bytes {
        self.machine.carries(slave, request, Class::Command).expect("the protocol has a form for it");
        let encoded = pdu::encode(request).expect("it can be encoded");
        let bytes = self.machine.start(slave, Arc::new(request.clone()), &encoded);
        self.machine.handle_sent(self.now, self.now + PATIENCE);
        bytes
    }

    /// Bytes come, 5 ms later.
    pub(crate) fn hear(&mut self, bytes: &[u8]) -> Step {
        self.now += 5 * MS;
        let step = self.machine.handle_bytes(self.now, bytes);
        self.written(step)
    }

    /// Bytes come one by one, 1 ms apart; the first step that is more than waiting.
    pub(crate) fn hear_one_by_one(&mut self, bytes: &[u8]) -> Step {
        for (index, byte) in bytes.iter().enumerate() {
            self.now += MS;
            let step = self.machine.handle_bytes(self.now, &[*byte]);
            if step != Step::More {
                assert_eq!(index + 1, bytes.len(), "{step:?} before the last byte");
                return self.written(step);
            }
        }
        Step::More
    }

    /// The machine's deadline passes.
    pub(crate) fn wait(&mut self) -> Step {
        let deadline = self.machine.deadline().expect("it waits for something");
        self.now = self.now.max(deadline);
        let step = self.machine.handle_timeout(self.now);
        self.written(step)
    }

    /// Deadlines pass until something happens.
    pub(crate) fn wait_for_step(&mut self) -> Step {
        for _ in 0..1_000 {
            let step = self.wait();
            if step != Step::More {
                return step;
            }
        }
        panic!("nothing ever happens");
    }

    pub(crate) fn strays(&mut self) -> Vec<Stray> {
        self.machine.take_strays()
    }

    fn written(&mut self, step: Step) -> Step {
        if let Step::Send(_) = step {
            self.machine.handle_sent(self.now, self.now + PATIENCE);
        }
        step
    }
}
