//! Start, stop, reset: what is written to `CMD`, and how it is seen to act.

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Class, Command, Control, Direction, Effect, Error, Port, Refusal, Result, SlaveAddress,
    State, Status, StopMode, Withdrawn,
    drivecom::{self, ChartState, Drivecom, RunShown, StatusWords, StopWord},
};

use crate::{
    Atv28,
    reading::{FIRST_BLOCK, FastWords, SECOND_BLOCK, raw_command},
    registers::{CMD, ETA, IOLR, LFR, LFRD},
    words::{ControlWord, ExtendedStatus, LogicIo, StatusWord},
};

/// What decides the reference where the drive does not follow the bus.
pub(crate) const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another reference (FrH is not the reference of the bus)",
    remedy: "see which inputs are in use: preset speeds (SP2 to SP7), jog, summing inputs, the PI regulator",
};

impl<P: Port> Atv28<P> {
    pub(crate) async fn withdraw_run(&mut self) -> Result<Withdrawn> {
        let is_run = |held| ControlWord::from_bits_retain(held).is_run();
        let held = self.read_control().await?;
        let status = self.read_status(Class::Command).await?;
        if !is_run(held) {
            return Ok(Withdrawn::Nothing(status));
        }
        if let Some(reason) = FastWords::of_raw(&status.raw).state_words().refuses_withdrawal() {
            return Err(Error::Unsupported { what: "withdrawal of the run command", reason });
        }
        self.write_control(Class::Command, held | ControlWord::STOP.bits(), Effect::Level).await?;
        let held = self.read_control().await.map_err(Error::after_write)?;
        let status = self.read_status(Class::Command).await.map_err(Error::after_write)?;
        if !is_run(held) {
            return Ok(Withdrawn::Ended(status));
        }
        let (slave, command) = (self.registers.slave(), Command::Withdraw);
        Err(Error::NotConfirmed { slave, command, status: Box::new(status), because: None })
    }

    /// Reads the fast set, in two exchanges: seven words are the most that one carries.
    async fn fast_words(&mut self, class: Class) -> Result<FastWords> {
        let mut calls = self.registers.at(class);
        let first = calls.read_array(FIRST_BLOCK.0).await?;
        let second = calls.read_array(SECOND_BLOCK.0).await?;
        Ok(FastWords::of(first, second))
    }

    /// The fast set for whoever watches, with `CMD` where only that tells what the drive does.
    pub(crate) async fn watch(&mut self) -> Result<Status> {
        let status = self.read_status(Class::Status).await?;
        let words = FastWords::of_raw(&status.raw);
        // The status is good without it.
        if self.needs_control(words.state_words())
            && let Ok(held) = self.registers.at(Class::Status).read(CMD).await
        {
            self.command = Some(ControlWord::from_bits_retain(held));
            return Ok(self.status_of(&words));
        }
        Ok(status)
    }

    /// A motor that slows down to stop looks like one that slows down to a lower setpoint, and one that stands at a setpoint
    /// of zero, or after `tLS`, like a stopped one.
    fn needs_control(&self, words: StatusWords) -> bool {
        let by_bus = words.chart() == Some(ChartState::OperationEnabled) && words.control() == Control::Bus;
        let slows_down = !words.is_turning() || words.eti.contains(ExtendedStatus::DECELERATING);
        by_bus && self.command.is_none_or(|command| command.is_run() && slows_down)
    }

    fn status_of(&self, words: &FastWords) -> Status {
        Status { at: self.registers.snapshot_time(), ..words.status(self.command) }
    }
}

#[async_trait]
impl<P: Port> Drivecom for Atv28<P> {
    const ETA: u16 = ETA.address();

    fn address(&self) -> SlaveAddress {
        self.registers.slave()
    }

    async fn read_status(&mut self, class: Class) -> Result<Status> {
        self.registers.begin_snapshot();
        let words = self.fast_words(class).await?;
        // A stop that was just written may not show yet.
        let fresh = |command: ControlWord| class == Class::Command && command.is_stop();
        let held = |&command: &ControlWord| fresh(command) || words.state_words().can_hold(command);
        self.command = self.command.filter(held);
        self.control = Some(words.state_words().control());
        Ok(self.status_of(&words))
    }

    /// Remembers the word as the one that the drive holds; while the outcome is not known, none is.
    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
        self.command = None;
        let mut calls = self.registers.at(class);
        match (class, effect) {
            // What a stop has done is read as a command.
            (Class::Stop, _) => calls.write_word(CMD.address(), word).await?,
            (_, Effect::Edge) => calls.edge().write(CMD, word).await?,
            (_, Effect::Level) => calls.write(CMD, word).await?,
        }
        self.command = Some(ControlWord::from_bits_retain(word));
        Ok(())
    }

    async fn refuses_start(&mut self, _: Direction, status: &Status) -> Result<Option<Refusal>> {
        let words = FastWords::of_raw(&status.raw).state_words();
        if let Some(reason) = words.refuses_to_take_over() {
            return Ok(Some(reason));
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

    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<RunShown> {
        let words = FastWords::of_raw(&status.raw);
        let follows = self.follows(&words).await?;
        // The last thing that is read: a stop of somebody else that came before shows in it.
        let held = self.read_control().await?;
        *status = self.status_of(&words);
        status.raw.push(raw_command(held));
        let reverse = ControlWord::from_bits_retain(word).contains(ControlWord::REVERSE);
        let direction = if reverse { Direction::Reverse } else { Direction::Forward };
        let shown = words.state_words().shows_run(direction, words.reference());
        Ok(if held == word && follows { shown } else { RunShown::NotYet })
    }

    async fn prevents_run(&mut self, status: &Status) -> Option<Refusal> {
        let words = FastWords::of_raw(&status.raw);
        if let Some(reason) = words.state_words().prevents_run() {
            return Some(reason);
        }
        (self.follows(&words).await == Ok(false)).then_some(OTHER_REFERENCE)
    }

    /// Whether the level of an input counts on this drive, or its edge, no register tells.
    async fn refuses_reset(&mut self, _: &Status) -> Result<Option<Refusal>> {
        const ASKED: Refusal = Refusal::Overridden {
            by: "a run command of the terminals (LI1 or LI2)",
            remedy: "open the input first: it might start the motor",
        };
        let inputs = LogicIo::from_bits_retain(self.registers.at(Class::Command).read(IOLR).await?);
        Ok(inputs.intersects(LogicIo::LI1 | LogicIo::LI2).then_some(ASKED))
    }

    async fn read_control(&mut self) -> Result<u16> {
        let held = self.registers.at(Class::Command).read(CMD).await?;
        self.command = Some(ControlWord::from_bits_retain(held));
        Ok(held)
    }

    fn last_control(&self) -> Option<Control> {
        self.control
    }

    fn stop_word(&self, mode: StopMode) -> StopWord {
        StopWord { word: stop_word(mode).bits(), mode, instead: None }
    }

    fn shows_stop(&self, stop: &StopWord, status: &Status) -> bool {
        let word = ControlWord::from_bits_retain(stop.word);
        FastWords::of_raw(&status.raw).state_words().shows_stop(word)
    }

    fn defies_stop(&self, status: &Status) -> Option<Refusal> {
        let words = FastWords::of_raw(&status.raw).state_words();
        let forced_local = !words.eta.contains(StatusWord::NOT_FORCED_LOCAL);
        (forced_local && words.is_driving()).then(|| Refusal::NotInControl(words.control()))
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
