//! What is sent next, and how an exchange ends.

use bytes::Bytes;

use super::{
    UniTelway,
    stage::{Next, Stage},
};
use crate::exchange::{Answer, Failure, Step, Stray};

impl UniTelway {
    /// The time of a stage is over.
    pub(super) fn overdue(&mut self) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        match current.stage {
            Stage::Before(next) | Stage::Answering(next) => self.send_next(next),
            // It may be late, with a reply that would then be taken for the next one. Not twice: a stop must go out.
            Stage::Emptying
                if self.outspoken.contains(&current.slave) && self.silent.insert(current.slave) =>
            {
                self.fail()
            }
            // A slave that never says anything to such a poll has nothing to say, or is not there: the request will
            // show it.
            Stage::Emptying => self.send_next(Next::Request),
            // Polled again, it might answer twice, and the second answer be taken for a later request's.
            Stage::Requesting | Stage::Polling => self.fail(),
            Stage::Ending => {
                // One that was taken for an echo once may have been none.
                self.echoes &= self.sent.is_empty();
                match current.answer.take() {
                    Some(answer) => {
                        self.empty.insert(current.slave);
                        self.end(Ok(answer))
                    }
                    None => self.fail(),
                }
            }
        }
    }

    fn send_next(&mut self, next: Next) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        let bytes = current.begin(next);
        if next == Next::Request {
            self.empty.remove(&current.slave);
        }
        self.send(bytes)
    }

    pub(super) fn send(&mut self, bytes: Bytes) -> Step {
        self.prepare(&bytes);
        Step::Send(bytes)
    }

    /// These bytes are sent next: what comes after them is heard anew.
    pub(super) fn prepare(&mut self, bytes: &Bytes) {
        if let Some(current) = &mut self.current {
            current.due = None;
        }
        self.sent = bytes.clone();
        let unfinished = self.receiver.begin();
        if unfinished > 0 {
            self.strays.push(Stray::Noise(unfinished));
        }
    }

    pub(super) fn fail(&mut self) -> Step {
        let misfit = self.current.as_mut().and_then(|current| current.misfit.take());
        self.end(Err(misfit.map_or(Failure::Timeout, Failure::Mismatch)))
    }

    pub(super) fn end(&mut self, result: Result<Answer, Failure>) -> Step {
        self.current = None;
        Step::Done(result)
    }
}
