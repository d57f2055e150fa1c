//! The stop: what is written, how it is seen, and what takes the place of one that the drive does not have.

use drive_core::{
    CONFIRMED_WITHIN, Class, Command as Order, Confirming, Control, Error, ErrorKind, Frequency, Output,
    Port, Result, SETTLED_WITHIN, State, Status, StopMode, Stopped,
};
use tokio::time::Instant;

use super::{
    ProfileDrive,
    falling::{comes_down, has_fallen},
    reading::OTHERS,
    tables::{mode_name, stop_mode},
};
use crate::{format::Action, ladder::Level, profile::Profile};

impl<P: Port> ProfileDrive<P> {
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
            self.registers.tell_follower(&status, &written);
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
    pub(super) fn substitute(&self, profile: &Profile, asked: StopMode) -> (StopMode, Option<&'static str>) {
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
}
