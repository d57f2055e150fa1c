//! Start, stop, reset: what is written to `CMD`, and how it is seen to act.

use async_trait::async_trait;
use drive_core::{
    Class, Direction, Effect, Error, Frequency, OwnRun, Port, RawWord, Refusal, Result, Setpoint,
    SlaveAddress, Status, StopMode, Verdict,
};
use drive_drivecom::{self as drivecom, ChartState, Drivecom, RunShown, StopWord};

use crate::{
    Atv58, CAPABILITIES,
    reading::Words,
    registers::{CMD, W401, W458, W483},
};

/// What decides the reference where the drive does not follow the bus.
pub(crate) const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another reference (the mapped reference is not that of W401)",
    remedy: "see which input gives it, or correct the map of the words",
};

const NO_WITHDRAWAL: &str = "the manual names no word that ends it and nothing else";

impl<P: Port> Atv58<P> {
    pub(crate) const fn run_word(&self, direction: Direction) -> Result<u16> {
        match direction {
            Direction::Forward => Ok(drivecom::ENABLE_OPERATION),
            Direction::Reverse if self.map.reverse_command != 0 => {
                Ok(drivecom::ENABLE_OPERATION | self.map.reverse_command)
            }
            Direction::Reverse => Err(Error::Unsupported {
                what: "start in reverse",
                reason: "the drive's map names no bit of the control word for it",
            }),
        }
    }

    /// The fast set as a status, without the verdict.
    pub(crate) async fn fast_status(&mut self, class: Class) -> Result<Status> {
        let map = self.map;
        self.registers.begin_snapshot();
        let ordinary = [Some(map.status), map.output_frequency, map.current];
        // The reference confirms a command, and costs a status nothing where it stands beside the other words.
        let span = |word: &u16| {
            ordinary.iter().flatten().all(|other| other.abs_diff(*word) < CAPABILITIES.read_words)
        };
        let reference = map.reference.filter(|word| class == Class::Command || span(word));
        let fast = ordinary.into_iter().chain([reference]);
        let addresses: Vec<u16> = fast.flatten().collect();
        let mut words = self.produced(class, &addresses, map.status).await?;
        let mut calls = self.registers.at(class);
        if words.is_tripped(&map) {
            let fault = Words::read(&mut self.absent, &mut calls, map.input_words, &[W483.address()]).await?;
            words.join(fault);
        }
        // Whether a drive leaves "operation enabled" at once or at the end of its ramp is not known; the control word
        // that it holds tells the stop from the run.
        if self.stops_by_ramp && words.chart(&map) == Some(ChartState::OperationEnabled) {
            words.append(&mut calls, false, CMD.address(), 1).await?;
        }
        let status = Status { at: self.registers.snapshot_time(), ..words.status(&map) };
        self.see_shaft(&status);
        Ok(Status { motion: self.proof.motion, ..status })
    }

    /// The control word of a stop; `None` where there is none.
    pub(crate) const fn word_of(&self, mode: StopMode) -> Option<u16> {
        match mode {
            StopMode::Ramp => self.map.ramp_stop,
            StopMode::Fast => Some(drivecom::QUICK_STOP),
            StopMode::Freewheel => Some(drivecom::DISABLE_VOLTAGE),
            StopMode::DcInjection => None,
        }
    }
}

#[async_trait]
impl<P: Port> Drivecom for Atv58<P> {
    const ETA: u16 = W458.address();

    fn status_register(&self) -> u16 {
        self.map.status
    }

    fn address(&self) -> SlaveAddress {
        self.registers.slave()
    }

    fn own_run(&mut self) -> &mut OwnRun {
        &mut self.proof.watch.run
    }

    fn owes_judgement(&mut self) {
        self.registers.owe_judgement();
    }

    fn tell_follower<T>(&self, status: &Status, written: &Result<T>) {
        self.registers.tell_follower(status, written);
    }

    async fn read_status(&mut self, class: Class) -> Result<Status> {
        let status = self.fast_status(class).await?;
        let verdict = self.evidence(&status).and_then(|evidence| self.proof.watch.run.verdict(&evidence));
        Ok(Status { verdict, ..status })
    }

    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
        self.stops_by_ramp = Some(word) == self.map.ramp_stop;
        if word & drivecom::ENABLE_OPERATION == drivecom::ENABLE_OPERATION && self.proof.held() != Some(word)
        {
            self.turned = self.turning;
        }
        self.proof.write_control(&mut self.registers, CMD, (class, word, effect)).await
    }

    async fn refuses_start(
        &mut self,
        _: Direction,
        setpoint: Option<Setpoint>,
        status: &Status,
    ) -> Result<Option<Refusal>> {
        if let Some(control) = status.control {
            return Ok(Some(Refusal::NotInControl(control)));
        }
        let negative = self.registers.at(Class::Command).read(W401).await?.cast_signed() < 0;
        let stays = negative && (setpoint.is_none() || self.is_negative().await?);
        Ok(stays.then_some(Refusal::Settings(
            "the reference W401 is negative: stop the motor, and give a setpoint",
        )))
    }

    /// The drive shows a run command by holding it in the state "operation enabled", not in forced local mode, with a motor
    /// that turns that way, and by following the reference of the bus, as far as the map names the words for it.
    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<RunShown> {
        let follows = self.follows(status).await?;
        // The last thing that is read: a stop of somebody else that came before shows in it.
        let (value, reference) = self.read_held(Class::Command).await?;
        status.raw.push(RawWord { address: CMD.address(), code: CMD.row().code, value });
        if value != word || status.control.is_some() || !follows {
            return Ok(RunShown::NotYet);
        }
        let stands = status.output_frequency == Some(Frequency::ZERO);
        let reverse = self.map.reverse_command & word != 0;
        let asked = if reverse { Direction::Reverse } else { Direction::Forward };
        let shown = match status.direction {
            _ if stands && self.asks_for_nothing(status) => RunShown::InForce,
            _ if stands => RunShown::NotYet,
            Some(direction) if direction != asked && self.turned != Some(direction) => RunShown::NotYet,
            Some(direction) if direction != asked => RunShown::TurningRound,
            _ => RunShown::InForce,
        };
        if shown != RunShown::NotYet {
            status.reference = status.reference.map(|reference| self.proof.turns_at(reference));
            // The setpoint that the run command found is the one that it is to follow from now on.
            self.proof.is_to_follow((W401.address(), reference));
            status.verdict = Some(Verdict::InForce);
        }
        Ok(shown)
    }

    async fn prevents_run(&mut self, status: &Status) -> Option<Refusal> {
        if let Some(control) = status.control {
            return Some(Refusal::NotInControl(control));
        }
        (self.follows(status).await == Ok(false)).then_some(OTHER_REFERENCE)
    }

    async fn read_control(&mut self) -> Result<u16> {
        self.read_held(Class::Command).await.map(|(held, _)| held)
    }

    /// "Disable voltage" for a drive that has left "operation enabled", such as a tripped one, or that has no output, whoever commands it: it
    /// moves nothing there. For a motor that turns, the manual names no word that ends a run command and nothing else.
    fn withdrawal(&self, _: u16, status: &Status) -> std::result::Result<u16, &'static str> {
        let turns = status.output_frequency.is_none_or(|output| output != Frequency::ZERO);
        match status.raw(self.map.status).and_then(ChartState::of) {
            Some(ChartState::Fault) => Ok(drivecom::DISABLE_VOLTAGE),
            None | Some(ChartState::FaultReactionActive) => Err(NO_WITHDRAWAL),
            Some(_) if turns => Err(NO_WITHDRAWAL),
            Some(_) => Ok(drivecom::DISABLE_VOLTAGE),
        }
    }

    /// The card gives no word of the terminals: while local control is forced, or might be, one of their inputs may start the
    /// motor once the fault is gone.
    async fn refuses_reset(&mut self, status: &Status) -> Result<Option<Refusal>> {
        const FORCED: Refusal = Refusal::Overridden {
            by: "a run command of the terminals, whose inputs no word tells, while local control is forced,",
            remedy: "give control back to the line first, or reset the fault at the drive",
        };
        const NOT_TOLD: Refusal = Refusal::Settings(
            "the drive's map names no bit that tells whether local control is forced: name it (`remote`), or reset the fault at the drive",
        );
        Ok(match status.control {
            Some(_) => Some(FORCED),
            None if self.map.remote == 0 => Some(NOT_TOLD),
            None => None,
        })
    }

    fn stop_word(&self, mode: StopMode) -> StopWord {
        let fast = StopWord { word: drivecom::QUICK_STOP, mode: StopMode::Fast, instead: None };
        let ramp = self.map.ramp_stop.map(|word| StopWord { word, mode: StopMode::Ramp, instead: None });
        let no_ramp = Some("the drive's map names no control word for a ramp stop");
        match mode {
            StopMode::Fast => fast,
            StopMode::Freewheel => StopWord { word: drivecom::DISABLE_VOLTAGE, mode, instead: None },
            StopMode::Ramp => ramp.unwrap_or(StopWord { instead: no_ramp, ..fast }),
            StopMode::DcInjection => {
                let instead = Some("the manual names no bit of the control word for DC injection");
                StopWord { instead, ..ramp.unwrap_or(fast) }
            }
        }
    }

    /// In forced local mode the control word that the drive holds does not act, and tells nothing.
    fn shows_stop(&self, stop: &StopWord, status: &Status) -> bool {
        match status.raw(self.map.status).and_then(ChartState::of) {
            None | Some(ChartState::NotReadyToSwitchOn) => false,
            Some(ChartState::OperationEnabled) => {
                stop.mode == StopMode::Ramp
                    && status.control.is_none()
                    && status.raw(CMD.address()) == self.map.ramp_stop
            }
            Some(ChartState::QuickStopActive) => stop.mode != StopMode::Freewheel,
            Some(_) => true,
        }
    }

    fn defies_stop(&self, status: &Status) -> Option<Refusal> {
        let turns = status.output_frequency.is_none_or(|frequency| frequency != Frequency::ZERO);
        let enabled =
            status.raw(self.map.status).and_then(ChartState::of) == Some(ChartState::OperationEnabled);
        status.control.filter(|_| turns && enabled).map(Refusal::NotInControl)
    }
}

#[cfg(test)]
mod tests {
    use drive_testing::words::Words;

    use crate::{Atv58Map, CAPABILITIES};

    use super::*;

    #[test]
    fn the_held_control_word_shows_no_stop_while_local_control_is_forced() {
        let drive = Atv58::new(Words::new(&CAPABILITIES, &[]), SlaveAddress::try_from(1).unwrap());
        let stop = drive.stop_word(StopMode::Ramp);
        let stopping = |eta, control| {
            let raw = |address, value| RawWord { address, code: "", value };
            let raw = vec![raw(Atv58Map::default().status, eta), raw(CMD.address(), drivecom::SWITCH_ON)];
            drive.shows_stop(&stop, &Status { control, raw, ..Status::default() })
        };
        assert!(stopping(0x0227, None));
        assert!(!stopping(0x0027, Some(drive_core::Control::Local)));
        assert!(!stopping(0x0200, None), "initialising");
        assert!(stopping(0x0223, None));
    }
}
