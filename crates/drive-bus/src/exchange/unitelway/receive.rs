//! What is heard, and what the exchange does upon it.

use bytes::Bytes;
use tokio::time::Instant;

use super::{
    UniTelway,
    frame::{self, ACK, EOT, Heard, NAK, poll},
    network::unite_of,
    request::decode,
    settings::{LEFTOVERS, POLL_LEN},
    stage::{Current, Next, Stage},
};
use crate::exchange::{Failure, Step, Stray};

impl UniTelway {
    /// Takes what the receiver has made of the bytes.
    pub(super) fn hear(&mut self, now: Instant, heard: Heard) -> Step {
        match heard {
            Heard::Signal { byte, alone } => self.signal(now, byte, alone),
            Heard::Poll(address) => {
                // Another master's poll is no frame of the slave that it names.
                if self.is_echo(&poll(address)) { Step::More } else { self.noise(POLL_LEN) }
            }
            Heard::Data { address, message } => {
                if self.is_echo(&frame::data(address, &message)) {
                    return Step::More;
                }
                self.data(now, address, &message)
            }
            Heard::Damaged(len) => self.damaged(len),
            Heard::Noise(len) => self.noise(len),
        }
    }

    /// Takes our own transmission away where the adapter gives it back. Slaves send nothing that it could be.
    fn is_echo(&mut self, bytes: &[u8]) -> bool {
        if self.sent.is_empty() || *self.sent != *bytes {
            return false;
        }
        self.sent.clear();
        self.receiver.discount();
        self.echoes = true;
        self.strays.push(Stray::Echo);
        true
    }

    fn signal(&mut self, now: Instant, byte: u8, alone: bool) -> Step {
        // A single character proves no echo, it is only taken away where there is one.
        if self.echoes && self.is_echo(&[byte]) {
            let is_last = self.current.as_ref().is_some_and(|current| current.stage == Stage::Ending);
            return if is_last { self.overdue() } else { Step::More };
        }
        let (turnaround, pause) = (self.turnaround, self.settings.poll_pause.max(self.turnaround));
        let repeats = self.settings.repeats;
        let Some(current) = &mut self.current else { return self.noise(1) };
        match (&current.stage, byte) {
            (Stage::Requesting, ACK) => current.pause(now + turnaround, Next::Poll),
            // What stands among other bytes is no refusal: the slave may have taken the request.
            (Stage::Requesting, NAK) if alone && current.refusals < repeats => {
                current.refusals += 1;
                current.pause(now + turnaround, Next::Request);
            }
            (Stage::Requesting, NAK) if alone => {
                self.empty.insert(current.slave);
                return self.end(Err(Failure::Refused("the slave refuses the frame (NAK)")));
            }
            (Stage::Emptying, EOT) if alone => {
                self.silent.remove(&current.slave);
                self.outspoken.insert(current.slave);
                current.pause(now + turnaround, Next::Request);
            }
            (Stage::Polling, EOT) if alone && !current.is_late(now) => {
                current.pause(now + pause, Next::Poll);
            }
            (Stage::Polling, EOT) if alone => return self.fail(),
            _ => return self.noise(1),
        }
        Step::More
    }

    /// A data frame whose BCC fits.
    fn data(&mut self, now: Instant, address: u8, message: &Bytes) -> Step {
        let unite = unite_of(message);
        let function = match &unite {
            Some(Ok(unite)) => unite.first().copied().unwrap_or_default(),
            _ => message.first().copied().unwrap_or_default(),
        };
        let stray = Stray::Frame { slave: address, function };
        let Some(current) = self.current.as_mut().filter(|current| current.slave == address) else {
            self.strays.push(stray);
            return Step::More;
        };
        match current.stage {
            Stage::Emptying => {
                self.strays.push(stray);
                self.respond(ACK)
            }
            Stage::Polling => {
                let answer = match unite {
                    Some(Ok(unite)) => decode(&current.request, &unite),
                    Some(Err(exception)) => Ok(Err(exception)),
                    None => Err(format!("the network header {function:02X}h")),
                };
                match answer {
                    Ok(answer) => {
                        self.silent.remove(&current.slave);
                        current.stage = Stage::Ending;
                        current.answer = Some(answer);
                        self.send(Bytes::from_static(&[ACK]))
                    }
                    Err(why) => {
                        let is_late = current.is_late(now);
                        current.misfit = Some(why);
                        self.strays.push(stray);
                        if is_late { self.fail() } else { self.respond(ACK) }
                    }
                }
            }
            _ => {
                self.strays.push(stray);
                Step::More
            }
        }
    }

    fn damaged(&mut self, len: usize) -> Step {
        self.strays.push(Stray::Noise(len));
        let repeats = self.settings.repeats;
        match &mut self.current {
            Some(current) if current.stage == Stage::Polling => {
                if current.damaged >= repeats {
                    return self.end(Err(Failure::Damaged("BCC")));
                }
                current.damaged += 1;
                self.respond(NAK)
            }
            Some(Current { stage: Stage::Emptying, .. }) => self.respond(NAK),
            _ => Step::More,
        }
    }

    /// Answers a data frame, before the next poll.
    fn respond(&mut self, signal: u8) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        let next = match current.stage {
            Stage::Emptying => {
                current.leftovers += 1;
                if current.leftovers < LEFTOVERS { Next::Empty } else { Next::Request }
            }
            _ => Next::Poll,
        };
        current.stage = Stage::Answering(next);
        self.send(Bytes::copy_from_slice(&[signal]))
    }

    fn noise(&mut self, len: usize) -> Step {
        self.strays.push(Stray::Noise(len));
        Step::More
    }
}
