//! Start, stop, withdrawal and reset: what is written, step by step, and how it is seen.

use drive_core::{
    CONFIRMED_WITHIN, Class, Command as Order, Confirming, Control, Direction, Error, ErrorKind, Exchange,
    Frequency, Lease, Output, Port, Refusal, Result, SETTLED_WITHIN, State, Status, StopMode, Stopped,
    Withdrawn,
    tokio_modbus::{Request, Response},
};
use tokio::time::{Duration, Instant, sleep};

use super::{
    ProfileDrive, Words,
    reading::{OTHERS, lacks},
    tables::{mode_name, stop_mode},
};
use crate::{
    format::{Action, Deed, Spanned, Step},
    ladder::Level,
    profile::Profile,
    requests::READ_WRITE,
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
const NOT_ALONE: Refusal = Refusal::Settings(
    "the drive does not tell who commands it, and a reset may start the motor by another's run command: see that nothing else commands \
     it, and say so by commands-alone = yes",
);

const NO_SETPOINT: Refusal = Refusal::Settings(
    "its setpoint is its run command, and none was given since it was reached: give it one, then start it",
);

/// How far an output has to fall to be on its way down: more than the few counts by which that of many drives flickers. A ramp that
/// falls less in the time that a command has to show (200 s from 50 Hz) is seen by its end, and not by its beginning.
const FALL: Frequency = Frequency::from_centihertz(50);

/// How long an output that came down by a stop of this side has to go down no more, to be one that a start holds: at a tenth of a hertz
/// a count a ramp of 200 s shows every 0.4 s.
const HELD_FOR: Duration = Duration::from_secs(1);

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

    /// The stop is written before anything is read, and again while it does not show.
    pub(super) async fn stop_motor(&mut self, asked: StopMode) -> Result<Stopped> {
        self.allow(Level::Stop, "a stop")?;
        let order = Order::Stop(asked);
        if let Some(barred) = self.stop_is_barred(order) {
            return Err(barred);
        }
        let profile = self.profile.clone();
        let (mode, instead) = self.substitute(&profile, asked);
        let Some(action) =
            profile.file().stop.of(mode_name(mode)).given().map(crate::format::Spanned::get_ref)
        else {
            return Err(Error::Unsupported { what: "a stop", reason: "its profile has none" });
        };
        self.has_ended = true;
        self.lets_coast |= mode == StopMode::Freewheel;
        // What the drive shows is no proof of a stop that it has refused or never got: behind a trip, or a state in which no motor turns,
        // the run command may stand and act when that goes away.
        let mut written = self.write_stop(action, order).await?;
        // What is started behind it is started at what stands then, whoever has given that; where the setpoint is the run command, at
        // the one that is kept.
        if !profile.file().starts_by_setpoint() {
            (self.agreed, self.agreed_before) = (None, None);
        }
        self.withdrawn_at = None;
        // It has said of each write that nothing was done by it.
        let denied =
            |written: &Result<()>| written.as_ref().is_err_and(|error| error.kind() == ErrorKind::Exception);
        let (mut is_denied, mut why_denied, mut is_asked) = (denied(&written), None, false);
        self.registers.owe_judgement();
        let mut confirming = Confirming::begin();
        let settled = Instant::now() + SETTLED_WITHIN;
        let half = Instant::now() + CONFIRMED_WITHIN / 2;
        let (mut again, mut first, mut was_at_speed) = (settled, None::<Frequency>, self.at_speed);
        loop {
            let (mut status, _) = match self.read_status(Class::Command).await {
                Ok(read) => read,
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error.after_write()),
            };
            let seen = action
                .seen
                .iter()
                .flat_map(crate::format::Spanned::get_ref)
                .any(|state| state.state() == status.state);
            let held = self.watch.run.held().map(|held| self.is_run(held));
            // A run word of this side that was late may stand in place of the stop by now.
            let stands = held == Some(true);
            // Where no run word stands any more, or where the stop is a setpoint, an output that goes down does so by that. Of a drive that
            // tells none, that it has left its speed shows it.
            let is_by_stop = held == Some(false) || profile.file().starts_by_setpoint();
            let falls = match status.output_frequency {
                Some(output) if is_by_stop => has_fallen(output, first),
                Some(_) => comes_down(&status, first),
                None => was_at_speed && status.at_reference == Some(false),
            };
            let is_others = status.control == Some(Control::Local);
            let falls = falls && status.state == State::Running && !is_others;
            was_at_speed |= self.at_speed;
            if written.is_ok() && !stands && (seen || falls) {
                if falls {
                    let output = status.output_frequency;
                    let shown = output.map_or(Output::NotKnown, Output::Braking);
                    status.state = State::Stopping;
                    status.motion = self.watch.see(Instant::now(), shown, output);
                    self.comes_down = Some(output.map(Frequency::centihertz));
                }
                self.watch.run.end();
                let stopped = Stopped { instead, ..Stopped::by(mode, Status { verdict: None, ..status }) };
                return Ok(stopped.held_by(&self.watch.shaft));
            }
            first = first.or(status.output_frequency);
            if Instant::now() >= again {
                written = self.write_stop(action, order).await.map_err(Error::after_write)?;
                is_denied &= denied(&written);
                again = Instant::now() + SETTLED_WITHIN;
            }
            // Behind a write, and once: the next one is not due yet.
            if is_denied && !std::mem::replace(&mut is_asked, true) {
                why_denied = self.why_denied().await;
            }
            // One that somebody else commands does not obey however long that is waited for, and what it says is told. One that goes down to
            // a lower setpoint may not tell for as long as that takes whether it obeys: by half the time whoever waits hears that it does.
            let because = is_others.then_some(OTHERS);
            let slows = status.output_frequency.is_some_and(|output| has_fallen(output, first));
            let now = Instant::now();
            let is_told = because.is_some() && now >= settled || slows && now >= half;
            if is_told || !confirming.again().await {
                let why_denied = why_denied.filter(|_| is_denied);
                return Err(match written {
                    Err(denied) if is_denied && why_denied.is_none() => denied,
                    Err(error) if why_denied.is_none() => error.after_write(),
                    _ => self.not_confirmed(order, status, why_denied.or(because)),
                });
            }
        }
    }

    /// The mode by which a stop is done, and why where it is not the one that was asked for.
    fn substitute(&self, profile: &Profile, asked: StopMode) -> (StopMode, Option<&'static str>) {
        let unread = stop_mode(*profile.file().stop.unread.get_ref());
        let why = if self.guarded.otherwise.is_some() && !self.guarded.hold {
            Some("the drive is set up otherwise than its profile says: this one is a stop whatever it is")
        } else if self.guarded.have_held {
            None
        } else {
            Some("what tells how the drive is set up was never read: this one is a stop whatever it is")
        };
        if why.is_some() {
            return (unread, why.filter(|_| asked != unread));
        }
        let has = profile.stop_modes();
        if has.contains(&asked) {
            return (asked, None);
        }
        let others = [StopMode::Ramp, StopMode::Fast, StopMode::Freewheel];
        let instead = others.into_iter().find(|mode| has.contains(mode)).unwrap_or(unread);
        (instead, Some("its profile has no such stop"))
    }

    /// That the drive refuses it, or that nobody knows whether it arrived, is given back: it is written again.
    async fn write_stop(&mut self, action: &Action, order: Order) -> Result<Result<()>> {
        let Some(step) = action.steps.first() else { return Ok(Ok(())) };
        match self.step(step.get_ref(), Class::Stop, order).await {
            Err(error) if error.kind() == ErrorKind::NotSent => Err(error),
            sent => Ok(sent),
        }
    }

    pub(super) async fn withdraw_run(&mut self) -> Result<Withdrawn> {
        self.allow(Level::Stop, "a withdrawal")?;
        let (status, _) = self.read_status(Class::Command).await?;
        if self.watch.run.lease().is_none() {
            return Ok(Withdrawn::Nothing(Status { verdict: None, ..status }));
        }
        // Whatever they say, and also where they cannot be read: a run command of this side may stand, and act once it can.
        self.see_guards(Class::Command).await.ok();
        let profile = self.profile.clone();
        let (mode, _) = self.substitute(&profile, StopMode::Ramp);
        let stop = profile.file().stop.of(mode_name(mode)).given();
        let Some(step) = stop.and_then(|stop| stop.get_ref().steps.first()) else {
            return Err(Error::Unsupported { what: "a withdrawal", reason: "its profile has no stop" });
        };
        self.has_ended = true;
        self.lets_coast |= mode == StopMode::Freewheel;
        self.watch.shaft.is_stopped_by(mode);
        self.step(step.get_ref(), Class::Command, Order::Withdraw).await?;
        self.registers.owe_judgement();
        let mut confirming = Confirming::begin();
        let (mut first, mut was_others) = (None, status.control == Some(Control::Local));
        loop {
            let (status, _) = self.read_status(Class::Command).await.map_err(Error::after_write)?;
            // Where the command reads back, that it holds no run word is seen whoever runs the motor.
            let held = self.watch.run.held();
            let is_gone = held.map(|held| !self.is_run(held));
            // Where it does not, the motor shows it, unless somebody else has it: what that one lets it do, such as turn round, is not by the
            // word that was written.
            let is_others = status.control == Some(Control::Local);
            if !is_others && std::mem::take(&mut was_others) {
                // It was not taken meanwhile, and what comes down now still does so by whoever had it.
                self.step(step.get_ref(), Class::Command, Order::Withdraw)
                    .await
                    .map_err(Error::after_write)?;
                first = None;
                continue;
            }
            was_others = is_others;
            let stands = !matches!(status.state, State::Running | State::Unknown);
            if is_gone.unwrap_or_else(|| !is_others && (stands || comes_down(&status, first))) {
                self.watch.run.end();
                // It is not waited for that the output goes down: what goes down below this does so by the withdrawal.
                self.withdrawn_at =
                    status.output_frequency.filter(|_| status.state == State::Running && !is_others);
                return Ok(Withdrawn::Ended(Status { verdict: None, ..status }));
            }
            first = first.or(status.output_frequency);
            if !confirming.again().await {
                return Err(self.not_confirmed(Order::Withdraw, status, None));
            }
        }
    }

    pub(super) async fn pulse_reset(&mut self) -> Result<Status> {
        let order = Order::ResetFaults;
        self.allow(Level::Motion, "a reset")?;
        let profile = self.profile.clone();
        let (status, _) = self.read_status(Class::Command).await?;
        if !status.is_fault() {
            return Ok(status);
        }
        let Some(reset) = profile.file().reset.given().map(crate::format::Spanned::get_ref) else {
            return Err(Error::Unsupported {
                what: "a reset",
                reason: "its profile does not say how: reset it at the drive",
            });
        };
        self.guard(order).await?;
        match status.control {
            Some(Control::Bus) => {}
            None if self.owner.commands_alone => {}
            None => return Err(self.refused(order, NOT_ALONE)),
            Some(_) => return Err(self.refused(order, OTHERS)),
        }
        self.has_ended = true;
        // The run command goes first: none of this side's is to act when the fault is gone.
        if let Some(stop) = profile.file().stop.ramp.given().and_then(|stop| stop.get_ref().steps.first()) {
            self.step(stop.get_ref(), Class::Command, order).await?;
        }
        // What rises is an edge, and goes out once; what clears it is a level, and is written until it is there.
        let (before, rest) = reset.steps.split_at(profile.file().rising(reset));
        self.steps(before, order).await?;
        let Some((rising, clearing)) = rest.split_first() else { return Err(self.refused(order, OTHERS)) };
        let rise = self.take_step(rising.get_ref(), Class::Command, order, true).await;
        if rise.as_ref().is_err_and(|error| error.kind() == ErrorKind::NotSent) {
            return rise.map(|()| status);
        }
        self.registers.owe_judgement();
        let mut cleared = self.steps(clearing, order).await;
        let mut confirming = Confirming::begin();
        loop {
            let read = match self.read_status(Class::Command).await {
                Err(error) if error.kind() != ErrorKind::NoAnswer => return Err(error.after_write()),
                read => read,
            };
            if let Ok((status, _)) = &read
                && !status.is_fault()
                && cleared.is_ok()
            {
                self.watch.run.end();
                return Ok(Status { verdict: None, ..status.clone() });
            }
            if !confirming.again().await {
                rise.and(cleared).map_err(Error::after_write)?;
                let (status, _) = read.map_err(Error::after_write)?;
                return Err(self.not_confirmed(order, status, None));
            }
            if cleared.is_err() {
                cleared = self.steps(clearing, order).await;
            }
        }
    }

    /// Steps of a command, each a level, up to the first that fails.
    async fn steps(&mut self, steps: &[Spanned<Step>], order: Order) -> Result<()> {
        for step in steps {
            self.step(step.get_ref(), Class::Command, order).await?;
        }
        Ok(())
    }

    /// One step of an action, a level: what it writes may be written again.
    pub(super) async fn step(&mut self, step: &Step, class: Class, order: Order) -> Result<()> {
        self.take_step(step, class, order, false).await
    }

    async fn take_step(&mut self, step: &Step, class: Class, order: Order, is_edge: bool) -> Result<()> {
        if let Some(pause) = &step.pause_ms {
            sleep(Duration::from_millis((*pause.get_ref()).into())).await;
        }
        if let (Some(bits), Some(within)) = (&step.awaits, &step.within_ms) {
            let profile = self.profile.clone();
            let blocks = profile.blocks(&[bits.register.get_ref().as_str()].into());
            let mut confirming = Confirming::within(Duration::from_millis((*within.get_ref()).into()));
            loop {
                let words = self.read_blocks(class, &blocks).await?;
                if profile.fits(&words, bits) == Some(true) {
                    return Ok(());
                }
                if !confirming.again().await {
                    let (status, _) = self.read_status(class).await?;
                    return Err(self.not_confirmed(order, status, None));
                }
            }
        }
        let writes = self.profile.file().written(step, self.kept);
        self.write(step, &writes, class, is_edge).await.map_err(|error| self.explained(error))
    }

    /// What is about to be written. A command word is what reads back as one: a word for another register says nothing of it.
    fn sends(&mut self, writes: &[Written]) {
        let held = self.watch.run.held().unwrap_or(0);
        let command = self.sight.reads_back.as_ref().and_then(|of| of.written(held, writes));
        if let Some(command) = command {
            self.watch.run.sends(command);
        }
    }

    async fn write(&mut self, step: &Step, writes: &[Written], class: Class, is_edge: bool) -> Result<()> {
        let function = step.function.as_ref().map(|function| *function.get_ref());
        let Some(request) = self.profile.request(function, writes) else { return Ok(()) };
        self.sends(writes);
        let mut calls = self.registers.at(class);
        if is_edge {
            calls = calls.edge();
        }
        let by = |function, address| Exchange { function, register: Some(address) };
        let (exchange, echo) = match &request {
            Request::WriteSingleRegister(address, word) => return calls.write_word(*address, *word).await,
            Request::WriteMultipleRegisters(first, words) => return calls.write_words(*first, words).await,
            Request::ReadWriteMultipleRegisters(_, _, address, _) => {
                let exchange = by(READ_WRITE, *address);
                return match calls.request(request, exchange).await? {
                    Response::ReadWriteMultipleRegisters(read) if read.len() == 1 => Ok(()),
                    _ => Err(calls.answer(exchange, "the answer holds another number of registers")),
                };
            }
            Request::WriteSingleCoil(address, on) => {
                (by(5, *address), Response::WriteSingleCoil(*address, *on))
            }
            Request::WriteMultipleCoils(first, coils) => {
                let count = u16::try_from(coils.len()).unwrap_or(u16::MAX);
                (by(15, *first), Response::WriteMultipleCoils(*first, count))
            }
            _ => return Ok(()),
        };
        match calls.request(request, exchange).await? {
            response if response == echo => Ok(()),
            _ => Err(calls.answer(exchange, "the confirmation does not echo the write")),
        }
    }
}

const fn withheld_by(deed: Deed) -> Option<Refusal> {
    match deed {
        Deed::Wait => Some(Refusal::State(State::NotReady)),
        Deed::Write | Deed::Run => None,
    }
}

/// Whether the output goes down below what it is to be, since the first look. One that only follows a lower setpoint ends there.
fn comes_down(status: &Status, first: Option<Frequency>) -> bool {
    let Some(output) = status.output_frequency else { return false };
    let below = status.reference.is_none_or(|reference| has_fallen(output, Some(reference)));
    below && has_fallen(output, first) && status.state == State::Running
}

/// Whether an output that may come down goes down no more: it has risen, or has had no lower one for [`HELD_FOR`].
fn holds(output: Frequency, lowest: &mut Option<(Frequency, Instant)>) -> bool {
    match *lowest {
        Some((least, since)) if output >= least => {
            has_fallen(least, Some(output)) || since.elapsed() >= HELD_FOR
        }
        _ => {
            *lowest = Some((output, Instant::now()));
            false
        }
    }
}

/// Whether an output is so far below another that it is no flicker of its register.
pub(super) fn has_fallen(output: Frequency, from: Option<Frequency>) -> bool {
    from.is_some_and(|from| {
        output.centihertz().checked_add(FALL.centihertz()).is_some_and(|least| least <= from.centihertz())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_that_only_follows_a_lower_setpoint_is_no_stop() {
        let hertz = |hertz| Some(Frequency::from_hertz(hertz));
        let shown = |output, reference| Status {
            state: State::Running,
            output_frequency: hertz(output),
            reference,
            ..Status::default()
        };
        assert!(!comes_down(&shown(35, hertz(20)), hertz(40)), "on its way to 20 Hz");
        assert!(comes_down(&shown(19, hertz(20)), hertz(40)));
        assert!(!comes_down(&shown(40, hertz(50)), hertz(40)), "it holds its speed");
        assert!(!comes_down(&shown(39, hertz(50)), None), "one look tells nothing");
    }

    #[tokio::test(start_paused = true)]
    async fn an_output_that_comes_down_is_held_once_it_rises_or_stands_for_a_while() {
        let mut lowest = None;
        let mut look = |centihertz| holds(Frequency::from_centihertz(centihertz), &mut lowest);
        assert!(!look(3_000) && !look(2_900) && !look(2_900) && !look(2_910), "a flicker is no rise");
        assert!(look(2_950), "it rises");
        assert!(!look(2_890), "and comes down again");
        sleep(HELD_FOR).await;
        assert!(look(2_890), "it stands");
        assert!(!look(2_880));
    }

    #[test]
    fn an_output_that_flickers_by_a_count_is_no_stop() {
        let first = Some(Frequency::from_hertz(40));
        for (output, falls) in [(3_999, false), (3_990, false), (3_951, false), (3_950, true)] {
            let output = Frequency::from_centihertz(output);
            let status =
                Status { state: State::Running, output_frequency: Some(output), ..Status::default() };
            assert_eq!(comes_down(&status, first), falls, "{output}");
            assert_eq!(has_fallen(output, first), falls, "{output}");
        }
    }
}
