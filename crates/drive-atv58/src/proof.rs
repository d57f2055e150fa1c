//! What proves a run command of this side from status to status, and what the shaft does: what the ordinary exchange carries, and
//! what takes a further one, never more than one behind a status.

use drive_core::{
    Class, Direction, Evidence, Frequency, Ground, Motion, Output, Port, Refusal, Result, RunWord, State,
    Status, Told, Verdict,
    drivecom::{ChartState, ControlWord, follows_frequency},
};
use tokio::time::Instant;

use crate::{Atv58, command::OTHER_REFERENCE, registers::CMD};

/// What has its turn: `CMD` with `W401`, and the limits.
const TURNS: usize = 2;

/// What was seen of a run command beside the ordinary words.
#[derive(Debug, Clone, Default)]
pub(crate) struct Seen {
    /// `CMD` and `W401` as they were read last, or written.
    pub(crate) held: Option<(u16, u16)>,
    /// The words of the status behind which they were read.
    words: Option<(u16, Option<Frequency>, bool)>,
    /// How many statuses behind each other show no output although there is a reference.
    idle: u8,
}

impl<P: Port> Atv58<P> {
    /// The fast set for whoever watches, with what only a further exchange tells.
    pub(crate) async fn watch(&mut self) -> Result<Status> {
        let mut status = self.fast_status(Class::Status).await?;
        if self.own.lease().is_some() {
            let turn = self.turns.pass(TURNS);
            let words = (
                self.chart_word(&status),
                status.reference,
                status.output_frequency == Some(Frequency::ZERO),
            );
            let doubtful = self.evidence(&status).is_some_and(|evidence| !is_proven(&evidence));
            if doubtful && self.seen.words != Some(words) || turn == Some(0) {
                self.seen.words = Some(words);
                // The status is good without it.
                let _ = self.read_held(Class::Status).await;
                if turn == Some(1) {
                    self.turns.again();
                }
            } else if turn == Some(1) || self.map.speed_limits.is_some() && self.limits.is_none() {
                let _ = self.read_limits(Class::Status).await;
            }
        }
        status.verdict = self.judge(&status);
        Ok(status)
    }

    fn chart_word(&self, status: &Status) -> u16 {
        status.raw(self.map.status).unwrap_or(0) & (0x006F | self.map.remote | self.map.reverse_status)
    }

    /// `CMD` and `W401` in one exchange.
    pub(crate) async fn read_held(&mut self, class: Class) -> Result<(u16, u16)> {
        let [held, reference] = self.registers.at(class).read_array(CMD.address()).await?;
        self.seen.held = Some((held, reference));
        Ok((held, reference))
    }

    fn evidence(&self, status: &Status) -> Option<Evidence> {
        let lease = self.own.lease()?;
        let chart = status.raw(self.map.status).and_then(ChartState::of);
        let run = ControlWord::run(Direction::Forward).bits();
        let word = self.seen.held.map_or(RunWord::NotTold, |(held, _)| match held {
            held if held == lease.word => RunWord::Stands,
            held if held & run == run => RunWord::Another,
            _ => RunWord::Gone,
        });
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
            reference: self.told_reference(status),
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
                    if self.seen.idle > 1 { Told::No(STOPPED) } else { Told::NotTold }
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
        let Some((_, w401)) = self.seen.held else { return Told::NotTold };
        if w401.cast_signed() < 0 {
            return Told::No(SIGN);
        }
        let (Some(reference), Some(_)) = (status.reference, self.map.reference) else { return Told::NotTold };
        let asked = self.reference_of(w401);
        let limits = match (self.map.speed_limits, self.limits) {
            (Some(_), None) => return Told::NotTold,
            (_, limits) => limits.map_or((asked, asked), |(limits, _)| limits),
        };
        if !follows_frequency(reference, asked, limits) {
            return Told::No(OTHER_REFERENCE);
        }
        Told::unless(self.given.is_some_and(|given| given != w401).then_some(WRITTEN_BY_ANOTHER))
    }

    /// The verdict on our run command, which ends where another word was read in its place.
    fn judge(&mut self, status: &Status) -> Option<Verdict> {
        let evidence = self.evidence(status)?;
        let ours = self.seen.held.map(|(held, _)| held) == self.last_written;
        if evidence.word == RunWord::Gone && ours {
            // A stop of ours that did not show at once.
            self.own.end();
            return None;
        }
        self.own.judge(&evidence)
    }

    /// The verdict for a status that a command has read: it ends nothing.
    pub(crate) fn verdict(&self, status: &Status) -> Option<Verdict> {
        let evidence = self.evidence(status)?;
        // While a word of this side is on its way, what stands says nothing.
        let word = if evidence.word == RunWord::Gone { RunWord::NotTold } else { evidence.word };
        let mut own = self.own;
        own.judge(&Evidence { word, ..evidence })
    }

    /// What the shaft does, as far as the mapped words show it.
    pub(crate) fn see_shaft(&mut self, status: &Status) -> Motion {
        let chart = status.raw(self.map.status).and_then(ChartState::of);
        let output = status.output_frequency;
        let turns = output.is_some_and(|output| output != Frequency::ZERO);
        let idle = chart == Some(ChartState::OperationEnabled) && output == Some(Frequency::ZERO);
        self.seen.idle = if idle { self.seen.idle.saturating_add(1) } else { 0 };
        let stops = status.state == State::Stopping || status.state == State::Ready;
        let at = output.unwrap_or(Frequency::ZERO);
        let shown = match chart {
            None => Output::NotKnown,
            Some(ChartState::OperationEnabled) if output.is_none() && !stops => Output::NotKnown,
            Some(ChartState::OperationEnabled) if stops && turns => Output::Braking(at),
            // That the normal stop is a ramp nobody has confirmed: it is one where it was seen to bring the motor down.
            Some(ChartState::OperationEnabled) if stops && self.shaft.was_braked() => Output::None,
            Some(ChartState::OperationEnabled) if stops => Output::Cut,
            Some(ChartState::OperationEnabled) => Output::Driven,
            _ if turns => Output::Braking(at),
            _ if output.is_none() => Output::Cut,
            Some(ChartState::QuickStopActive | ChartState::SwitchedOn | ChartState::Fault)
                if self.shaft.was_braked() =>
            {
                Output::None
            }
            _ => Output::Cut,
        };
        self.shaft.see(status.at.unwrap_or_else(Instant::now), shown, output)
    }

    pub(crate) fn changed(&mut self, ground: Ground) {
        if self.own.lease().is_some() && !self.changed.contains(&ground) {
            self.changed.push(ground);
        }
    }
}

fn is_proven(evidence: &Evidence) -> bool {
    let parts = [evidence.command, evidence.output, evidence.reference];
    evidence.word == RunWord::Stands && parts.iter().all(|told| *told == Told::Yes)
}
