//! What is heard, and what the exchange does upon it.

use std::time::Instant;

use bytes::Bytes;

use crate::{
    failure::Failure,
    frame::{self, ACK, EOT, Heard, NAK, poll},
    link::{Step, Stray, UniTelway},
    network::unite_of,
    request::REFUSED,
    settings::{LEFTOVERS, POLL_LEN},
    stage::{Next, Stage, Then, Wanted},
};

/// Why a reply that fits its request is not taken.
const DOUBTED: &str = "the confirmation may belong to an earlier request";
const ANOTHER_BEHIND_IT: &str = "behind the reply came another one to the same question";

impl UniTelway {
    /// Takes what the receiver has made of the bytes.
    pub(crate) fn hear(&mut self, now: Instant, heard: Heard) -> Step {
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
            Heard::Damaged(len) => self.damaged(now, len),
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
            return match self.current.as_ref().map(|current| current.stage) {
                Some(Stage::Answering(then)) => self.go_on(now, then),
                _ => Step::More,
            };
        }
        let Some(current) = &mut self.current else { return self.noise(1) };
        match (current.stage, byte) {
            (Stage::Asking, ACK) => {
                current.waiting_since = None;
                current.refusals = 0;
                self.poll_when_ready(now)
            }
            // What stands among other bytes is no refusal: the slave may have taken the request.
            (Stage::Asking, NAK) if alone => {
                current.refusals += 1;
                let since = *current.waiting_since.get_or_insert(now);
                if now.saturating_duration_since(since) >= self.settings.busy_timeout {
                    return self.end(Err(Failure::Refused("NAK")));
                }
                // It may refuse because nobody has come for what it holds.
                self.after_silence(now, Next::Poll(Wanted::Room))
            }
            (Stage::Polling(wanted), EOT) if alone => {
                // Of a slave whose earlier reply may still be on its way it proves nothing, nor does one to an earlier poll.
                let emptied = wanted == Wanted::Nothing && current.is_proven && current.unanswered == 0;
                self.known.entry(current.slave).or_default().note_nothing_said(emptied);
                match wanted {
                    Wanted::Nothing => self.close(),
                    wanted => self.nothing_came(now, wanted, true),
                }
            }
            _ => self.noise(1),
        }
    }

    /// A data frame whose BCC fits.
    fn data(&mut self, now: Instant, address: u8, message: &Bytes) -> Step {
        let unite = unite_of(message);
        let function = match &unite {
            Some(Ok(unite)) => unite.first().copied().unwrap_or_default(),
            _ => message.first().copied().unwrap_or_default(),
        };
        let stray = Stray::Frame { slave: address, function };
        let current = self.current.as_mut().filter(|current| current.slave == address);
        let Some((current, wanted)) = current.and_then(|current| match current.stage {
            Stage::Polling(wanted) => Some((current, wanted)),
            _ => None,
        }) else {
            self.strays.push(stray);
            return Step::More;
        };
        match (wanted, &mut current.mark) {
            (Wanted::Room, _) => self.leftover(now, stray, Then::Ask),
            (Wanted::Nothing, _) => {
                // One of the two was said to an earlier poll, and kept on the way: which one, nothing tells. The same once more is
                // only a reply whose acknowledgement was lost.
                let again = unite.and_then(|unite| match unite {
                    Ok(unite) => current.request.check(&unite).ok(),
                    Err(refusal) => Some(Err(refusal)),
                });
                let is_another = again.is_some_and(|again| current.result.as_ref() != Some(&Ok(again)));
                if is_another {
                    current.result = Some(Err(Failure::Doubted(ANOTHER_BEHIND_IT)));
                }
                self.leftover(now, stray, Then::Poll(Wanted::Nothing))
            }
            (Wanted::Reply, Some(mark)) => match unite {
                Some(Ok(unite)) if *unite == mark.reply => {
                    current.mark = None;
                    current.is_proven = true;
                    self.known.entry(address).or_default().note_reply(current.polled_after);
                    self.answer_with(now, ACK, Then::Ask)
                }
                other => {
                    mark.refused |=
                        other.is_some_and(|other| other.is_ok_and(|unite| unite.starts_with(&[REFUSED])));
                    self.leftover(now, stray, Then::Poll(Wanted::Reply))
                }
            },
            (Wanted::Reply, None) => {
                let answer = match unite {
                    Some(Ok(unite)) => current.request.check(&unite),
                    Some(Err(refusal)) => Ok(Err(refusal)),
                    None => Err(format!("the network header {function:02X}h")),
                };
                match answer {
                    Ok(answer) => {
                        self.known.entry(address).or_default().note_reply(current.polled_after);
                        let said = self.speed.characters(1 + POLL_LEN + frame::len(message.len()));
                        self.took = current.requested.map(|end| {
                            now.saturating_duration_since(end).saturating_sub(said + self.silence)
                        });
                        current.result =
                            Some(if current.is_proven { Ok(answer) } else { Err(Failure::Doubted(DOUBTED)) });
                        self.answer_with(now, ACK, Then::Close)
                    }
                    Err(why) => {
                        current.misfit = Some(why);
                        self.leftover(now, stray, Then::Poll(Wanted::Reply))
                    }
                }
            }
        }
    }

    /// What is not the request's is taken from the slave and dropped.
    fn leftover(&mut self, now: Instant, stray: Stray, then: Then) -> Step {
        self.strays.push(stray);
        let Some(current) = &mut self.current else { return Step::More };
        current.leftovers += 1;
        if current.leftovers > LEFTOVERS || (then == Then::Poll(Wanted::Reply) && current.is_late(now)) {
            return self.close();
        }
        self.answer_with(now, ACK, then)
    }

    fn damaged(&mut self, now: Instant, len: usize) -> Step {
        self.strays.push(Stray::Noise(len));
        let Some(current) = &mut self.current else { return Step::More };
        let Stage::Polling(wanted) = current.stage else { return Step::More };
        current.damaged += 1;
        if current.damaged <= self.settings.repeats {
            return self.answer_with(now, NAK, Then::Poll(wanted));
        }
        match current.result.take() {
            Some(result) => self.end(result),
            None => self.end(Err(Failure::Damaged("BCC"))),
        }
    }

    /// Answers a data frame.
    fn answer_with(&mut self, now: Instant, signal: u8, then: Then) -> Step {
        self.after_silence(now, Next::Signal(signal, then))
    }

    fn noise(&mut self, len: usize) -> Step {
        self.strays.push(Stray::Noise(len));
        Step::More
    }
}
