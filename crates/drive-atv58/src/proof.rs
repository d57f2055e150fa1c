//! What proves a run command of this side from status to status, and what the shaft does: what the ordinary exchange carries, and
//! what takes a further one, never more than one behind a status.

use drive_core::{Class, Direction, Evidence, Frequency, Output, Port, Refusal, Result, State, Status, Told};
use drive_drivecom::{ChartState, ControlWord, follows_frequency};

use crate::{
    Atv58,
    command::OTHER_REFERENCE,
    registers::{CMD, W401},
};

/// What has its turn: `CMD` with `W401`, and the limits.
const TURNS: [Look; 2] = [Look::Control, Look::Limits];

/// A further exchange behind a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Look {
    /// `CMD` and `W401`.
    Control,
    /// The words that the map names for the limits.
    Limits,
}

impl<P: Port> Atv58<P> {
    /// The fast set for whoever watches, with what only a further exchange tells.
    pub(crate) async fn watch(&mut self) -> Result<Status> {
        let mut status = self.fast_status(Class::Status).await?;
        if let Some(evidence) = self.evidence(&status) {
            let eta = status.raw(self.map.status).unwrap_or(0);
            let stands = status.output_frequency == Some(Frequency::ZERO);
            let reference = self.map.reference.and_then(|word| status.raw(word)).unwrap_or(0);
            self.proof.doubt_anew((
                eta & (0x006F | self.map.remote | self.map.reverse_status),
                stands.into(),
                reference,
            ));
            let elsewhere = self.told_reference(&status) != Told::Yes;
            let wanted = [
                (Look::Control, !evidence.is_proven()),
                (
                    Look::Limits,
                    self.map.speed_limits.is_some() && (elsewhere || self.proof.limits().is_none()),
                ),
            ];
            let wanted = self.proof.goes_on(wanted, 1, elsewhere);
            if let Some(look) = self.proof.choose(None, wanted, TURNS.len(), |turn| TURNS[turn]) {
                // The status is good without it.
                let _ = self.look(look).await;
            }
        }
        status.verdict = self.evidence(&status).and_then(|evidence| self.proof.watch.run.judge(&evidence));
        Ok(status)
    }

    async fn look(&mut self, look: Look) -> Result<()> {
        match look {
            Look::Control => self.read_held(Class::Status).await.map(drop)?,
            Look::Limits => self.read_limits(Class::Status).await.map(drop)?,
        }
        self.proof.looked(look);
        Ok(())
    }

    /// `CMD` and `W401` in one exchange.
    pub(crate) async fn read_held(&mut self, class: Class) -> Result<(u16, u16)> {
        let [held, reference] = self.registers.at(class).read_array(CMD.address()).await?;
        self.proof.was_read(held, reference);
        Ok((held, reference))
    }

    pub(crate) fn evidence(&self, status: &Status) -> Option<Evidence> {
        self.proof.watch.run.lease()?;
        let chart = status.raw(self.map.status).and_then(ChartState::of);
        let run = ControlWord::run(Direction::Forward).bits();
        let word = self.proof.watch.run.word(|held| held & run == run);
        let command = match status.control {
            Some(somebody) => Told::No(Refusal::NotInControl(somebody)),
            // Nothing tells whether the line commands or the terminals, but what the motor does.
            None if self.map.remote == 0 => Told::NotTold,
            None => Told::Yes,
        };
        Some(Evidence {
            word,
            command,
            output: self.told_output(chart, status),
            // No word of the card tells what the motor is asked for.
            reference: self.proof.watch.told_by_turning(self.told_reference(status)),
        })
    }

    fn told_output(&self, chart: Option<ChartState>, status: &Status) -> Told {
        const LOCKED: Refusal = Refusal::Overridden {
            by: "a stop at the drive that has disabled operation, by an input or a key,",
            remedy: "see which one it is, release it, and start again",
        };
        const STOPPED: Refusal = Refusal::Overridden {
            by: "a stop at the drive, by an input or a key,",
            remedy: "see which one it is, release it, and start again",
        };
        match chart {
            None => Told::NotTold,
            Some(ChartState::Fault | ChartState::FaultReactionActive) => {
                Told::No(status.fault_code.map_or(Refusal::Tripped, Refusal::Fault))
            }
            Some(ChartState::NotReadyToSwitchOn) => Told::No(Refusal::State(State::NotReady)),
            Some(ChartState::QuickStopActive) => Told::No(Refusal::State(State::QuickStop)),
            Some(ChartState::OperationEnabled) => match (status.output_frequency, status.reference) {
                (None, _) => Told::NotTold,
                (Some(Frequency::ZERO), None) => Told::NotTold,
                (Some(Frequency::ZERO), Some(reference)) if reference != Frequency::ZERO => {
                    // A motor that turns round is at zero for a moment.
                    if self.idle > 1 { Told::No(STOPPED) } else { Told::NotTold }
                }
                (Some(output), Some(reference))
                    if self.proof.watch.is_brought_down(status.direction, output, reference) =>
                {
                    Told::NotTold
                }
                _ => Told::Yes,
            },
            Some(_) => Told::No(LOCKED),
        }
    }

    /// Whether the motor follows `W401` as this side gave it, or found it when it gave its run command.
    fn told_reference(&self, status: &Status) -> Told {
        const SIGN: Refusal = Refusal::Overridden {
            by: "the sign of the reference W401, which another master has turned round,",
            remedy: "stop the motor, and give a setpoint",
        };
        const WRITTEN_BY_ANOTHER: Refusal = Refusal::Overridden {
            by: "a reference that another master has written (W401)",
            remedy: "see which one it is, and give the setpoint again",
        };
        let Some(w401) = self.proof.reference else { return Told::NotTold };
        if w401.cast_signed() < 0 {
            return Told::No(SIGN);
        }
        let (Some(reference), Some(_)) = (status.reference, self.map.reference) else { return Told::NotTold };
        let asked = self.reference_of(w401);
        let limits = match (self.map.speed_limits, self.proof.limits()) {
            (Some(_), None) => return Told::NotTold,
            (_, limits) => limits.flatten().unwrap_or((asked, asked)),
        };
        if !follows_frequency(reference, asked, limits) {
            // The limits may have been set otherwise at the drive, across the setpoint.
            let is_judged = self.map.speed_limits.is_none() || self.proof.has_looked(&Look::Limits);
            return if is_judged { Told::No(OTHER_REFERENCE) } else { Told::NotTold };
        }
        let ours = self.proof.may_be_ours((W401.address(), w401));
        Told::unless((!ours).then_some(WRITTEN_BY_ANOTHER))
    }

    /// What the shaft does, as far as the mapped words show it.
    pub(crate) fn see_shaft(&mut self, status: &Status) {
        let chart = status.raw(self.map.status).and_then(ChartState::of);
        let output = status.output_frequency;
        let turns = output.is_some_and(|output| output != Frequency::ZERO);
        let idle = chart == Some(ChartState::OperationEnabled) && output == Some(Frequency::ZERO);
        self.idle = if idle { self.idle.saturating_add(1) } else { 0 };
        let stops = status.state == State::Stopping || status.state == State::Ready;
        let at = output.unwrap_or(Frequency::ZERO);
        let (braked, reacted) = (self.proof.watch.shaft.was_braked(), self.proof.has_reacted(chart));
        let shown = match chart {
            None => Output::NotKnown,
            Some(ChartState::OperationEnabled) if output.is_none() && !stops => Output::NotKnown,
            Some(ChartState::OperationEnabled) if stops && turns => Output::Braking(at),
            // That the normal stop is a ramp nobody has confirmed: it is one where it was seen to bring the motor down.
            Some(ChartState::OperationEnabled) if stops && self.proof.watch.shaft.was_braked() => {
                Output::None
            }
            Some(ChartState::OperationEnabled) if stops => Output::Cut,
            Some(ChartState::OperationEnabled) => Output::Driven,
            _ if turns => Output::Braking(at),
            _ if output.is_none() => Output::Cut,
            Some(ChartState::QuickStopActive) if braked => Output::Ended,
            Some(ChartState::SwitchedOn) if braked => Output::None,
            // A trip cuts off a motor that was coming down for another reason.
            Some(ChartState::Fault) if reacted => Output::None,
            Some(ChartState::Fault) => Output::Tripped,
            _ => Output::Cut,
        };
        self.turning = status.direction.filter(|_| turns);
        self.proof.see_turning(None, (self.turning, None), output);
        self.proof.see(status.at, shown, output);
    }
}
