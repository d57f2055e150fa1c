//! The start: what speaks against it, what is written, and how it is seen.

use drive_core::{
    Class, Command as Order, Confirming, Direction, Error, ErrorKind, Frequency, Lease, Port, Refusal,
    Result, SETTLED_WITHIN, State, Status,
};
use tokio::time::Instant;

use super::{
    ProfileDrive, Words,
    falling::{has_fallen, holds},
    reading::{OTHERS, lacks},
};
use crate::{
    format::{Action, Deed},
    ladder::Level,
    written::Written,
};

const NOT_OURS: Refusal = Refusal::Overridden {
    by: "a run command that this side has not given",
    remedy: "stop the motor first, and see what else commands it; a setpoint alone changes the speed of one that runs",
};
/// The same where the setpoint is the run command: no setpoint goes to such a motor either.
const NOT_OURS_AT_ALL: Refusal = Refusal::Overridden {
    by: "a run command that this side has not given",
    remedy: "stop the motor first, and see what else commands it; its setpoint is its run command, which goes only to a motor that this side has started",
};
const NO_SUCH_START: Error =
    Error::Unsupported { what: "a start in this direction", reason: "its profile does not say how" };
const NO_SETPOINT: Refusal = Refusal::Settings(
    "its setpoint is its run command, and none was given since it was reached: give it one, then start it",
);

/// The most rungs of a ladder that are climbed for one start.
const RUNGS: usize = 8;

impl<P: Port> ProfileDrive<P> {
    /// Whether nothing speaks against a start, by what is read now; whether the motor was fed, and what was read.
    pub(super) async fn start_is_allowed(&mut self, direction: Direction) -> Result<(bool, Words)> {
        let order = Order::Start(direction);
        self.allow(Level::Motion, "a start")?;
        if self.profile.start(direction).is_none() {
            return Err(NO_SUCH_START);
        }
        let (status, words) = self.read_status(Class::Command).await?;
        // Between two looks it may have been exchanged, or set up otherwise.
        self.forget_guards();
        self.guard(order).await?;
        let local = self.commanded_by_other(&words);
        let was_fed = matches!(status.state, State::Running | State::Stopping);
        // One whose run command was taken back may have another's by now: it is not started before it stands.
        let runs = was_fed && (self.comes_down.is_none() || self.withdrawn_at.is_some());
        let not_ours = if self.profile.file().starts_by_setpoint() { NOT_OURS_AT_ALL } else { NOT_OURS };
        let others = (runs && self.watch.run.lease().is_none()).then_some(not_ours);
        match status.bars_motion().or(local).or(others) {
            Some(reason) => Err(self.refused(order, reason)),
            None => Ok((was_fed, words)),
        }
    }

    /// Whether the setpoint that stands is one to start by, where none is given with the start; and what it is, where another register
    /// shows the one in force.
    pub(super) async fn check_standing(
        &mut self,
        direction: Direction,
        words: &Words,
    ) -> Result<Option<i64>> {
        let is_the_start = self.profile.start(direction).is_some_and(Action::starts_by_setpoint);
        let (reason, stands) = match is_the_start && self.kept.is_none() {
            true => (Some(NO_SETPOINT), None),
            false => self.standing(words).await?,
        };
        reason.map_or(Ok(stands), |reason| Err(self.refused(Order::Start(direction), reason)))
    }

    pub(super) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        let order = Order::Start(direction);
        let (was_fed, words) = self.start_is_allowed(direction).await?;
        let stands = self.check_standing(direction, &words).await?;
        let profile = self.profile.clone();
        let Some(action) = profile.start(direction) else { return Err(NO_SUCH_START) };
        // At another one than was given nothing starts.
        self.agreed_before = None;
        self.agreed = self.agreed.or(stands);
        self.climb(order).await?;
        let Some((last, before)) = action.steps.split_last() else { return Err(self.refused(order, OTHERS)) };
        let mut is_begun = false;
        for step in before {
            let done = self.step(step.get_ref(), Class::Command, order).await;
            // What was written before it may have turned round a motor that runs.
            done.map_err(|error| if is_begun { error.after_write() } else { error })?;
            is_begun |= step.get_ref().write.is_some();
        }
        let word = profile.file().run_word(action, self.kept).unwrap_or(0);
        self.watch.run.give(Lease::new(direction, word));
        let was_started = std::mem::replace(&mut self.guarded.started, true);
        let came_down = self.comes_down.take();
        let sent = self.step(last.get_ref(), Class::Command, order).await;
        self.registers.owe_judgement();
        match sent {
            Ok(()) => self.watch.run.was_written(),
            Err(error) if error.kind() == ErrorKind::NotSent => {
                self.watch.run.was_not_written();
                self.guarded.started = was_started;
                self.comes_down = came_down;
                return Err(if is_begun { error.after_write() } else { error });
            }
            // An exception is no proof that nothing was done.
            Err(error) => return Err(error.after_write()),
        }
        self.see_start(direction, was_fed).await.map_err(Error::after_write)
    }

    /// What has to be written before the run command, from the state in which the drive is.
    async fn climb(&mut self, order: Order) -> Result<()> {
        let profile = self.profile.clone();
        let Some(rungs) = profile.file().start.ladder.given() else { return Ok(()) };
        let mut confirming = Confirming::begin();
        let mut written = 0;
        loop {
            let (status, words) = self.read_status(Class::Command).await?;
            let rung = rungs
                .iter()
                .map(crate::format::Spanned::get_ref)
                .find(|rung| profile.fits(&words, &rung.bits) == Some(true));
            let Some(rung) = rung else { return Err(self.refused(order, Refusal::State(status.state))) };
            match (rung.deed, &rung.register, rung.word) {
                (Deed::Run, ..) => return Ok(()),
                (Deed::Write, Some(register), Some(word)) if written < RUNGS => {
                    written += 1;
                    if let Some((space, address)) =
                        profile.file().named(register.get_ref()).and_then(|of| profile.file().place(of))
                    {
                        self.sends(&[Written { space, address, value: word }]);
                        let written = self.registers.at(Class::Command).write_word(address, word).await;
                        written.map_err(|error| self.explained(error))?;
                    }
                }
                _ => {}
            }
            if !confirming.again().await {
                return Err(self.not_confirmed(order, status, withheld_by(rung.deed)));
            }
        }
    }

    /// Reads until the motor is driven that way. One that turned the other way slows down first: it is on its way. One that comes down by
    /// a stop of this side may do so still: it is driven once its output goes down no more.
    async fn see_start(&mut self, direction: Direction, was_fed: bool) -> Result<Status> {
        let (mut confirming, settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let tells_direction = self.profile.file().see.direction.given().is_some();
        let mut first: Option<Frequency> = None;
        let mut lowest = None;
        let may_come_down = self.has_ended && was_fed && self.profile.file().see.output.given().is_some();
        loop {
            let (status, words) = match self.read_status(Class::Command).await {
                Ok(read) => read,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            // By the evidence of a verdict: whatever keeps a run command from being in force keeps a start from being confirmed.
            let because = lacks(&self.evidence(&status, &words));
            let output = status.output_frequency;
            let slows = !may_come_down && output.is_some_and(|output| has_fallen(output, first));
            let turns = status.direction == Some(direction) || !tells_direction || slows;
            let is_held = !may_come_down || output.is_some_and(|output| holds(output, &mut lowest));
            if because.is_none() && turns && is_held {
                self.has_ended = false;
                self.lets_coast = false;
                self.agreed = self.setpoint_seen(&words);
                let verdict = self.watch.run.verdict(&self.evidence(&status, &words));
                return Ok(Status { verdict, ..status });
            }
            first = first.or(output);
            let over = because.is_some() && status.is_fault() && Instant::now() >= settled;
            if over || !confirming.again().await {
                return Err(self.not_confirmed(Order::Start(direction), status, because));
            }
        }
    }
}

const fn withheld_by(deed: Deed) -> Option<Refusal> {
    match deed {
        Deed::Wait => Some(Refusal::State(State::NotReady)),
        Deed::Write | Deed::Run => None,
    }
}
