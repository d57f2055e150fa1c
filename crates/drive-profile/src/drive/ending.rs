//! What ends a run command without being a stop that was asked for: the withdrawal, and the reset.

use drive_core::{
    Class, Command as Order, Confirming, Control, Error, ErrorKind, Port, Refusal, Result, State, Status,
    StopMode, Withdrawn,
};

use super::{ProfileDrive, falling::comes_down, reading::OTHERS, tables::mode_name};
use crate::ladder::Level;

const NOT_ALONE: Refusal = Refusal::Settings(
    "the drive does not tell who commands it, and a reset may start the motor by another's run command: see that nothing else commands \
     it, and say so by commands-alone = yes",
);

impl<P: Port> ProfileDrive<P> {
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
}
