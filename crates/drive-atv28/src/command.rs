//! Start, stop, reset: what is written to `CMD`, and how it is seen to act.

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Class, Control, Direction, Effect, Port, Refusal, Result, SlaveAddress, State, Status,
    StopMode,
    drivecom::{self, ChartState, Drivecom},
};

use crate::{
    Atv28,
    registers::{CMD, ETA, LFR, LFRD},
    status::{FastWords, raw_command},
    words::{ControlWord, StatusWord},
};

impl<P: Port> Atv28<P> {
    pub(crate) async fn start_motor(&mut self, direction: Direction) -> Result<Status> {
        drivecom::start(self, direction, ControlWord::run(direction).bits()).await
    }

    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Status> {
        let word = stop_word(mode);
        let shows = |status: &Status| FastWords::of_raw(&status.raw).state_words().shows_stop(word);
        drivecom::stop(self, mode, word.bits(), shows).await
    }
}

#[async_trait]
impl<P: Port> Drivecom for Atv28<P> {
    const ETA: u16 = ETA.address();

    fn address(&self) -> SlaveAddress {
        self.registers.slave()
    }

    async fn read_status(&mut self, class: Class) -> Result<Status> {
        let words = self.fast_words(class).await?;
        // A stop that was just written may not show yet.
        let fresh = |command: ControlWord| class == Class::Stop && command.is_stop();
        let held = |&command: &ControlWord| fresh(command) || words.state_words().can_hold(command);
        self.command = self.command.filter(held);
        Ok(words.status(self.command))
    }

    /// Remembers the word as the one that the drive holds; while the outcome is not known, none is.
    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
        self.command = None;
        let calls = self.registers.at(class);
        let mut calls = if effect == Effect::Edge { calls.edge() } else { calls };
        calls.write(CMD, word).await?;
        self.command = Some(ControlWord::from_bits_retain(word));
        Ok(())
    }

    async fn refuses_start(&mut self, _: Direction, status: &Status) -> Result<Option<Refusal>> {
        let words = FastWords::of_raw(&status.raw).state_words();
        let turning = words.is_turning();
        let forced_local = !words.eta.contains(StatusWord::NOT_FORCED_LOCAL);
        // At power-up the terminals command and the motor stands; the first command of the line takes over then. A motor
        // that somebody else has running is not taken away from him.
        let taken = turning && words.control() != Control::Bus;
        if forced_local || taken {
            return Ok(Some(Refusal::NotInControl(words.control())));
        }
        // A motor that direct current brakes shows no output frequency, and would coast without voltage.
        if words.is_driving() && words.chart() == Some(ChartState::QuickStopActive) {
            return Ok(Some(Refusal::State(State::QuickStop)));
        }
        // A sign that somebody else left would turn the direction round.
        let mut calls = self.registers.at(Class::Command);
        let negative = calls.read(LFR).await?.cast_signed() < 0 || calls.read(LFRD).await?.cast_signed() < 0;
        Ok(negative.then_some(Refusal::Settings(
            "a reference on the bus (LFr or LFRD) is negative: give a setpoint in its unit first",
        )))
    }

    /// "Operation enabled" is also the state of a drive that its terminals have just powered up in, so the drive must
    /// hold the control word too, and name the bus as its source of commands.
    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<bool> {
        let held = self.registers.at(Class::Command).read(CMD).await?;
        self.command = Some(ControlWord::from_bits_retain(held));
        *status = FastWords::of_raw(&status.raw).status(self.command);
        status.raw.push(raw_command(held));
        Ok(held == word && status.control == Some(Control::Bus))
    }
}

/// The write that stops all drives on a line, by the words of the chart: the others would enable a drive that is merely
/// ready.
pub(crate) const fn broadcast(mode: StopMode) -> Option<BroadcastWrite> {
    let value = match mode {
        StopMode::Fast => drivecom::QUICK_STOP,
        StopMode::Freewheel => drivecom::DISABLE_VOLTAGE,
        StopMode::Ramp | StopMode::DcInjection => return None,
    };
    Some(BroadcastWrite { function: 0x06, register: CMD.address(), value })
}

/// The stops by bits 12 to 14 keep operation enabled; without voltage the motor coasts (BBV51701 p. 11, 12, 19).
const fn stop_word(mode: StopMode) -> ControlWord {
    match ControlWord::enabled_stop(mode) {
        Some(word) => word,
        None => ControlWord::from_bits_retain(drivecom::DISABLE_VOLTAGE),
    }
}
