//! Start, stop, reset: the control words of this drive, and how they are seen to act. The chart itself is
//! [`drive_core::drivecom`].

use async_trait::async_trait;
use drive_core::{
    Class, Command, Control, Direction, Effect, Error, Port, Refusal, Result, SlaveAddress, State, Status,
    StopMode,
    drivecom::{self, ChartState, Drivecom, StatusWords},
    registers::Register,
};

use crate::{
    Atv312,
    registers::{CMD, ETA, LFRD, LFT},
    status::{FIRST, FastWords, raw_command},
    words::{AccessLevel, ControlWord, ExtendedControl, ExtendedStatus, StatusWord},
};

impl<P: Port> Atv312<P> {
    /// Stops, by one write where the settings that it depends on are known; [`start`](drive_core::Drive::start) reads
    /// them. A fast stop and a freewheel stop depend on none: the quick stop and the disabled voltage of the chart act
    /// at every access level.
    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Status> {
        let word = self.stop_word(mode).await?;
        let shows = |status: &Status| FastWords::in_status(status).state_words().shows_stop(word);
        let stopped = drivecom::stop(self, mode, word.bits(), shows).await;
        if matches!(stopped, Err(Error::NotConfirmed { .. })) {
            // The settings may have been changed at the drive: the next attempt reads them, or does without them.
            self.known.control = None;
        }
        stopped
    }

    async fn stop_word(&mut self, mode: StopMode) -> Result<ControlWord> {
        const QUICK_STOP: ControlWord = ControlWord::from_bits_retain(drivecom::QUICK_STOP);
        let Some(enabled) = ControlWord::enabled_stop(mode) else {
            return Ok(ControlWord::from_bits_retain(drivecom::DISABLE_VOLTAGE));
        };
        if mode == StopMode::Fast {
            // 400Fh takes a run command at once afterwards, the quick stop does not; but only the latter is sure to
            // act without a look at the settings.
            let has_bit = self.known.control.is_some_and(|settings| settings.lacks(mode).is_none());
            return Ok(if has_bit { enabled } else { QUICK_STOP });
        }
        // A stop does not fail for a reading that fails.
        let Ok(settings) = self.control_settings(Class::Stop).await else { return Ok(QUICK_STOP) };
        match settings.lacks(mode) {
            None => Ok(enabled),
            Some(reason) if mode == StopMode::Ramp => {
                Err(Error::Unsupported { what: "a stop along the ramp", reason })
            }
            Some(reason) => Err(Error::Unsupported { what: "a stop by DC injection", reason }),
        }
    }

    /// Reads the fast words in a class, without making a status of them.
    pub(crate) async fn fast_words(&mut self, class: Class) -> Result<FastWords> {
        self.registers.at(class).read_array(FIRST).await.map(FastWords::of)
    }

    /// The fast set as a status.
    pub(crate) async fn fast_status(&mut self, class: Class) -> Result<Status> {
        let resolution = self.resolution(class).await?;
        let words = self.fast_words(class).await?;
        // A stop that was just written may not show yet.
        let fresh = |command: ControlWord| class == Class::Stop && command.is_stop();
        let held = |&command: &ControlWord| fresh(command) || words.state_words().can_hold(command);
        self.command = self.command.filter(held);
        Ok(words.status(resolution, self.command))
    }

    pub(crate) fn refused(&self, command: Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    pub(crate) fn not_confirmed(&self, command: Command, status: Status) -> Error {
        Error::NotConfirmed {
            slave: self.registers.slave(),
            command,
            status: Box::new(status),
            because: None,
        }
    }

    /// Whose command the drive is under, for a start.
    fn refuses_control(words: StatusWords, level: AccessLevel) -> Option<Refusal> {
        let control = words.control();
        let not_ours = Some(Refusal::NotInControl(control)).filter(|_| control != Control::Bus);
        if !words.eta.contains(StatusWord::NOT_FORCED_LOCAL) {
            return not_ours;
        }
        match level {
            // At L1 and L2 the terminals command from power-up on until a command comes by the bus; a motor that
            // somebody else has running is not taken away from him, nor is what the remote terminal was given.
            AccessLevel::L1 | AccessLevel::L2 if control == Control::Local && !words.is_turning() => None,
            AccessLevel::L1 | AccessLevel::L2 | AccessLevel::L3 => not_ours,
            AccessLevel::Unknown(_) => {
                Some(Refusal::Settings("the access level LAC is none that the manual lists"))
            }
        }
    }

    /// What the control variables forbid: a lock, or a sign that would turn the direction round.
    async fn refuses_variables(&mut self) -> Result<Option<Refusal>> {
        const SIGN: Refusal =
            Refusal::Settings("the reference on the bus is negative: give a setpoint before the start");
        let mut calls = self.registers.at(Class::Command);
        // CMD, LFr, PISP, CMI.
        let [_, hertz, _, cmi] = calls.read_array(CMD.address()).await?;
        let rpm = calls.read(LFRD).await?;
        let cmi = ExtendedControl::from_bits_retain(cmi);
        self.learn_resolution(cmi);
        Ok(if cmi.contains(ExtendedControl::NO_CONSISTENCY_CHECK) {
            Some(Refusal::Settings("CMI bit 15: no consistency check, and locked on standstill"))
        } else if cmi.contains(ExtendedControl::LOCK) {
            Some(Refusal::Settings("CMI bit 13: locked on standstill"))
        } else {
            (hertz.cast_signed() < 0 || rpm.cast_signed() < 0).then_some(SIGN)
        })
    }
}

#[async_trait]
impl<P: Port> Drivecom for Atv312<P> {
    const ETA: u16 = ETA.address();

    fn address(&self) -> SlaveAddress {
        self.registers.slave()
    }

    async fn read_status(&mut self, class: Class) -> Result<Status> {
        let mut status = self.fast_status(class).await?;
        // One word more for a tripped drive, so that the refusal names the fault.
        if status.state == State::Fault && class == Class::Command {
            status.fault_code = Some(self.registers.at(class).read(LFT).await?);
        }
        Ok(status)
    }

    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
        // Not known while the outcome is not known.
        self.command = None;
        let mut calls = self.registers.at(class);
        if effect == Effect::Edge {
            calls = calls.edge();
        }
        calls.write(CMD, word).await?;
        self.command = Some(ControlWord::from_bits_retain(word));
        Ok(())
    }

    async fn refuses_start(&mut self, direction: Direction, status: &Status) -> Result<Option<Refusal>> {
        let words = FastWords::in_status(status).state_words();
        let settings = self.control_settings(Class::Command).await?;
        if let Some(reason) = Self::refuses_control(words, settings.level) {
            return Ok(Some(reason));
        }
        // A motor that direct current brakes shows no output frequency, and would coast without voltage.
        if words.chart() == Some(ChartState::QuickStopActive) && words.is_driving() {
            return Ok(Some(Refusal::State(State::QuickStop)));
        }
        if direction == Direction::Reverse
            && let Some(reason) = settings.refuses_reverse()
        {
            return Ok(Some(reason));
        }
        self.refuses_variables().await
    }

    /// The run command shows by the control word that the drive holds, by the control source, and by the direction that
    /// the reference asks for where there is a reference.
    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<bool> {
        let held = self.registers.at(Class::Command).read(CMD).await?;
        self.command = Some(ControlWord::from_bits_retain(held));
        status.raw.push(raw_command(held));
        let words = FastWords::in_status(status);
        let reverse = ControlWord::from_bits_retain(word).contains(ControlWord::REVERSE);
        let asked = words.state_words().eti.contains(ExtendedStatus::REVERSE_REQUESTED);
        let directed = words.word(crate::registers::FRH) == 0 || asked == reverse;
        Ok(held == word && words.state_words().control() == Control::Bus && directed)
    }
}

/// The word that stops every drive of this family at once, for the stops that no setting changes: the others would
/// enable a drive that is merely ready.
pub(crate) const fn broadcast_word(
    mode: StopMode,
) -> Option<(Register<drive_core::registers::access::ReadWrite>, u16)> {
    match mode {
        StopMode::Fast => Some((CMD, drivecom::QUICK_STOP)),
        StopMode::Freewheel => Some((CMD, drivecom::DISABLE_VOLTAGE)),
        StopMode::Ramp | StopMode::DcInjection => None,
    }
}
