//! What is sent next, and how an exchange ends.

use std::time::{Duration, Instant};

use bytes::Bytes;

use crate::{
    failure::{Answer, Failure},
    frame::{self, poll},
    link::{Step, Stray, UniTelway},
    request::{MARK, code},
    stage::{Current, Mark, Next, Stage, Then, Wanted},
};

/// The pause before a slave is polled or asked again grows by this part of the time that it has kept us waiting: what is
/// noticed late is at most an eighth late, and one that is slow takes some 20 polls in half a second.
const PAUSE_GROWTH: u32 = 8;

impl UniTelway {
    /// The time of a stage is over.
    pub(crate) fn overdue(&mut self, now: Instant) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        match current.stage {
            Stage::Before(next) => self.send(next),
            Stage::Answering(then) => {
                // One that was taken for an echo once may have been none.
                self.echoes &= self.sent.is_empty();
                self.go_on(now, then)
            }
            // Whether it has come to the slave is not known: to ask again might do it twice.
            Stage::Asking => self.fail(),
            Stage::Polling(wanted) => {
                current.unanswered += 1;
                if wanted == Wanted::Reply {
                    self.known.entry(current.slave).or_default().note_silent_poll(current.polled_after);
                }
                self.nothing_came(now, wanted, false)
            }
        }
    }

    /// A poll has brought nothing: `said`, or silence.
    pub(crate) fn nothing_came(&mut self, now: Instant, wanted: Wanted, said: bool) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        match wanted {
            Wanted::Reply => match &current.mark {
                // It cannot mirror: that nothing comes any more has to be enough.
                Some(mark) if mark.refused => self.marked(now),
                // What was lost is asked for again, however short the time is.
                _ if current.is_late(now) && (said || current.unanswered > self.settings.repeats) => {
                    self.fail()
                }
                _ => self.wait(now, Next::Poll(Wanted::Reply)),
            },
            // Whatever was refused for is over, or it was the frame: at once. Then the slave is busy.
            Wanted::Room if current.refusals <= 1 => self.after_silence(now, Next::Ask),
            Wanted::Room => self.wait(now, Next::Ask),
            Wanted::Nothing => {
                if let Some(known) = self.known.get_mut(&current.slave) {
                    known.note_silence();
                }
                self.close()
            }
        }
    }

    /// The slave has taken what it was asked: it is polled at once, or when one that is silent until then is likely ready.
    pub(crate) fn poll_when_ready(&mut self, now: Instant) -> Step {
        let Some(current) = &self.current else { return Step::More };
        let after = self.known.get(&current.slave).map_or(Duration::ZERO, |known| known.poll_after());
        let ready = current.requested.unwrap_or(now) + after;
        let pause = ready.saturating_duration_since(now);
        if after.is_zero() || pause <= self.silence {
            return self.after_silence(now, Next::Poll(Wanted::Reply));
        }
        let Some(current) = self.current.take() else { return Step::More };
        self.put_aside(now, current, Next::Poll(Wanted::Reply), pause)
    }

    pub(crate) fn go_on(&mut self, now: Instant, then: Then) -> Step {
        let Some(current) = &self.current else { return Step::More };
        match then {
            Then::Ask => self.yield_line(now, Next::Ask),
            Then::Poll(wanted) => self.yield_line(now, Next::Poll(wanted)),
            Then::Close => {
                let known = self.known.entry(current.slave).or_default();
                if known.may_say_nothing() {
                    return self.after_silence(now, Next::Poll(Wanted::Nothing));
                }
                known.note_silence();
                self.close()
            }
        }
    }

    /// The mark has come back, or cannot: what comes from now on can only be the request's.
    pub(crate) fn marked(&mut self, now: Instant) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        current.mark = None;
        current.is_proven = true;
        current.waiting_since = None;
        current.refusals = 0;
        self.after_silence(now, Next::Ask)
    }

    /// Ends as what came has decided.
    pub(crate) fn close(&mut self) -> Step {
        match self.current.as_mut().and_then(|current| current.result.take()) {
            Some(result) => self.end(result),
            None => self.fail(),
        }
    }

    /// The silence before this passes, then it is sent.
    pub(crate) fn after_silence(&mut self, now: Instant, next: Next) -> Step {
        let Some(current) = &mut self.current else { return Step::More };
        current.stage = Stage::Before(next);
        current.due = Some(now + self.silence);
        Step::More
    }

    /// The slave is not ready: the line is free for others until this is sent, the longer the longer it takes.
    pub(crate) fn wait(&mut self, now: Instant, next: Next) -> Step {
        let Some(mut current) = self.current.take() else { return Step::More };
        let since = *current.waiting_since.get_or_insert(now);
        let waited = now.saturating_duration_since(since);
        let pause = self.settings.poll_pause.max(self.silence).max(waited / PAUSE_GROWTH);
        self.put_aside(now, current, next, pause)
    }

    /// The exchange goes on with this after the silence, unless a stop is more urgent.
    pub(crate) fn yield_line(&mut self, now: Instant, next: Next) -> Step {
        let Some(current) = self.current.take() else { return Step::More };
        self.put_aside(now, current, next, self.silence)
    }

    fn put_aside(&mut self, now: Instant, mut current: Current, next: Next, pause: Duration) -> Step {
        current.stage = Stage::Before(next);
        current.due = None;
        self.aside.insert(current.slave, current);
        Step::Wait(now + pause)
    }

    pub(crate) fn send(&mut self, next: Next) -> Step {
        Step::Send(self.begin(next))
    }

    /// The bytes of a stage, which begins with them. What comes after them is heard anew.
    pub(crate) fn begin(&mut self, next: Next) -> Bytes {
        let Some(current) = &mut self.current else { return Bytes::new() };
        let (stage, bytes) = match next {
            Next::Ask => {
                self.known.entry(current.slave).or_default().note_request();
                let frame = current.mark.as_ref().map_or(&current.frame, |mark| &mark.frame);
                (Stage::Asking, frame.clone())
            }
            Next::Poll(wanted) => (Stage::Polling(wanted), poll(current.slave)),
            Next::Signal(signal, then) => (Stage::Answering(then), Bytes::copy_from_slice(&[signal])),
        };
        current.stage = stage;
        current.due = None;
        self.sent = bytes.clone();
        let unfinished = self.receiver.begin();
        if unfinished > 0 {
            self.strays.push(Stray::Noise(unfinished));
        }
        bytes
    }

    /// A number that no earlier one can be taken for.
    pub(crate) fn new_mark(&mut self, slave: u8) -> Mark {
        self.marks = self.marks.wrapping_add(1);
        // Six bits a byte: none of them is a 10h, which would be doubled.
        let number = [18, 12, 6, 0].map(|shift| 0x40 | (self.marks >> shift) as u8 & 0x3F);
        let [a, b, c, d] = number;
        let request = [code::MIRROR, self.settings.category, a, b, c, d];
        let frame = frame::data(slave, &self.settings.header.message(&request));
        Mark { frame, reply: [MARK, a, b, c, d], refused: false }
    }

    pub(crate) fn fail(&mut self) -> Step {
        if let Some(known) = self.current.as_ref().and_then(|current| self.known.get_mut(&current.slave)) {
            known.note_failure();
        }
        let misfit = self.current.as_mut().and_then(|current| current.misfit.take());
        self.end(Err(misfit.map_or(Failure::Timeout, Failure::Mismatch)))
    }

    pub(crate) fn end(&mut self, result: Result<Answer, Failure>) -> Step {
        self.current = None;
        Step::Done(result)
    }
}
