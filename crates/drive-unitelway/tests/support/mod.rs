//! The machine, fed by hand: what is sent, what comes, and time.

#![allow(dead_code, reason = "each test file uses its part")]

use std::time::{Duration, Instant};

use bytes::Bytes;
use drive_unitelway::{Request, Step, Stray, UniTelway, UniTelwaySettings};

pub(crate) const MS: Duration = Duration::from_millis(1);

/// How long an answer may take here.
pub(crate) const PATIENCE: Duration = Duration::from_millis(500);

pub(crate) struct Script {
    pub(crate) machine: UniTelway,
    pub(crate) now: Instant,
}

impl Script {
    /// A line at 19200 bit/s.
    pub(crate) fn new(settings: UniTelwaySettings) -> Self {
        Self { machine: UniTelway::new(19_200, settings, 20 * MS), now: Instant::now() }
    }

    /// Begins an exchange; what is sent, which takes no time here.
    pub(crate) fn ask(&mut self, slave: u8, request: &Request) -> Bytes {
        self.machine.check(slave, request).expect("it has a form");
        let bytes = self.machine.start(slave, request.clone());
        self.machine.handle_sent(self.now, self.now + PATIENCE);
        bytes
    }

    /// Begins the exchange of a stop's first write.
    pub(crate) fn ask_at_once(&mut self, slave: u8, request: &Request) -> Bytes {
        let bytes = self.machine.start_at_once(slave, request.clone());
        self.machine.handle_sent(self.now, self.now + PATIENCE);
        bytes
    }

    /// The exchange that was put aside goes on at this time; what is sent.
    pub(crate) fn resume(&mut self, slave: u8, at: Instant) -> Bytes {
        self.now = self.now.max(at);
        let bytes = self.machine.resume(slave).expect("it was put aside");
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

    /// A deadline passes, or the exchange that was put aside goes on; steps in which nothing is to be done pass by.
    pub(crate) fn wait_or_go_on(&mut self, slave: u8) -> Step {
        for _ in 0..1_000 {
            match self.wait() {
                Step::More => {}
                Step::Wait(until) => return Step::Send(self.resume(slave, until)),
                step => return step,
            }
        }
        panic!("nothing ever happens");
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
