//! Start, stop, reset: what is written to `CMD`, and how it is seen to act.

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Class, Control, Direction, Effect, OwnRun, Port, Refusal, Result, Setpoint, SlaveAddress,
    State, Status, StopMode, Verdict,
};
use drive_drivecom::{self as drivecom, ChartState, Drivecom, RunShown, StopWord};

use crate::{
    Atv28,
    reading::{FIRST_BLOCK, FastWords, SECOND_BLOCK, raw_command, read_block},
    registers::{CMD, ETA, IOLR, LFR, LFRD},
    words::{ControlWord, LogicIo, StatusWord},
};

/// What decides the reference where the drive does not follow the bus.
pub(crate) const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another reference (FrH is not the reference of the bus)",
    remedy: "see which inputs are in use: preset speeds (SP2 to SP7), jog, summing inputs, the PI regulator",
};

impl<P: Port> Atv28<P> {
    /// Reads the fast set, in two exchanges: seven words are the most that one carries.
    pub(crate) async fn fast_words(&mut self, class: Class) -> Result<FastWords> {
        let mut calls = self.registers.at(class);
        let first = read_block(&mut self.absent, &mut calls, FIRST_BLOCK).await?;
        let second = read_block(&mut self.absent, &mut calls, SECOND_BLOCK).await?;
        Ok(FastWords::of(first.into_iter().chain(second)))
    }

    /// The fast set as a status.
    pub(crate) async fn fast_status(&mut self, class: Class) -> Result<Status> {
        self.registers.begin_snapshot();
        let words = self.fast_words(class).await?;
        self.proof.holds_if(|word| {
            let command = ControlWord::from_bits_retain(word);
            // A stop that was just written may not show yet.
            class == Class::Command && command.is_stop() || words.state_words().can_hold(command)
        });
        self.control = Some(words.state_words().control());
        self.see_shaft(&words);
        let verdict = self.evidence(&words).and_then(|evidence| self.proof.watch.run.verdict(&evidence));
        Ok(Status { verdict, ..self.status_of(&words) })
    }

    /// The control word that the drive was last seen to hold.
    pub(crate) fn command(&self) -> Option<ControlWord> {
        self.proof.held().map(ControlWord::from_bits_retain)
    }

    /// A logic input that is closed: which of them gives a run command, and whether its level counts or its edge, no register
    /// tells.
    pub(crate) async fn closed_input(&mut self) -> Result<Option<Refusal>> {
        const CLOSED: [Refusal; 6] = [
            closed("a logic input that may give a run command (LI1 is closed)"),
            closed("a logic input that may give a run command (LI2 is closed)"),
            closed("a logic input that may give a run command (LI3 is closed)"),
            closed("a logic input that may give a run command (LI4 is closed)"),
            closed("a logic input that may give a run command (LI5 is closed)"),
            closed("a logic input that may give a run command (LI6 is closed)"),
        ];
        const NOT_TOLD: Refusal =
            Refusal::Settings("the drive has no IOLR (W478), so nothing tells which logic inputs are closed");
        let iolr = self.absent.word(&mut self.registers.at(Class::Command), IOLR.address()).await?;
        let Some(inputs) = iolr.map(|iolr| iolr & LogicIo::INPUTS.bits()) else { return Ok(Some(NOT_TOLD)) };
        let lowest = usize::try_from(inputs.trailing_zeros()).ok();
        Ok(lowest.and_then(|input| CLOSED.get(input)).copied())
    }

    pub(crate) fn status_of(&self, words: &FastWords) -> Status {
        let at = self.registers.snapshot_time();
        Status { at, motion: self.proof.motion, ..words.status(self.command()) }
    }
}

#[async_trait]
impl<P: Port> Drivecom for Atv28<P> {
    const ETA: u16 = ETA.address();

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
        self.fast_status(class).await
    }

    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
        self.proof.write_control(&mut self.registers, CMD, (class, word, effect)).await
    }

    async fn refuses_start(
        &mut self,
        _: Direction,
        setpoint: Option<Setpoint>,
        status: &Status,
    ) -> Result<Option<Refusal>> {
        let words = FastWords::of_raw(&status.raw).state_words();
        if let Some(reason) = words.refuses_to_take_over() {
            return Ok(Some(reason));
        }
        // A motor that direct current brakes shows no output frequency, and would coast without voltage.
        if words.is_driving() && words.chart() == Some(ChartState::QuickStopActive) {
            return Ok(Some(Refusal::State(State::QuickStop)));
        }
        let identity = self.read_identity(Class::Command).await?;
        if let Some(reason) = identity.refuses_start(&mut self.said) {
            return Ok(Some(reason));
        }
        let mut calls = self.registers.at(Class::Command);
        let frequency = calls.read(LFR).await?;
        let speed = self.absent.word(&mut calls, LFRD.address()).await?.unwrap_or(0);
        let [frequency, speed] = [frequency, speed].map(|word| word.cast_signed() < 0);
        // A setpoint replaces one of the two.
        let stays = match setpoint {
            Some(Setpoint::Frequency(_)) => speed || frequency && self.is_negative().await?,
            Some(Setpoint::Speed(_)) => frequency || speed && self.is_negative().await?,
            Some(Setpoint::Share(_)) | None => frequency || speed,
        };
        Ok(stays.then_some(Refusal::Settings(
            "a reference on the bus (LFr or LFRD) is negative: stop the motor, and give a setpoint in its unit first",
        )))
    }

    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<RunShown> {
        let words = FastWords::of_raw(&status.raw);
        let follows = self.follows(&words).await?;
        let in_force = match follows {
            Some((at, lfrd)) if at == LFRD.address() && self.frh_lags(&words, lfrd).await? => None,
            followed => followed,
        };
        // The last thing that is read: a stop of somebody else that came before shows in it.
        let held = self.read_control().await?;
        *status = self.status_of(&words);
        status.reference = status.reference.map(|reference| self.proof.turns_at(reference));
        status.raw.push(raw_command(held));
        let direction = ControlWord::from_bits_retain(word).direction();
        let shown = words.state_words().shows_run(direction, words.reference(), words.output());
        let Some(in_force) = in_force.filter(|_| held == word && shown != RunShown::NotYet) else {
            return Ok(RunShown::NotYet);
        };
        // The setpoint that the run command found is the one that it is to follow from now on.
        self.proof.is_to_follow(in_force);
        status.verdict = Some(Verdict::InForce);
        Ok(shown)
    }

    async fn prevents_run(&mut self, status: &Status) -> Option<Refusal> {
        let words = FastWords::of_raw(&status.raw);
        if let Some(reason) = words.state_words().prevents_run() {
            return Some(reason);
        }
        (self.follows(&words).await == Ok(None)).then_some(OTHER_REFERENCE)
    }

    /// Any word of the bus takes command from whoever has it, as at the twin's level L1. And which input gives a run command on this
    /// drive, and whether its level counts or its edge, no register tells: none is closed.
    async fn refuses_reset(&mut self, status: &Status) -> Result<Option<Refusal>> {
        const TAKES_COMMAND: Refusal = Refusal::Overridden {
            by: "whoever has command, for any word of the bus takes it from him,",
            remedy: "stop the motor by the bus first, which says whom it takes command from, or reset the fault at the drive",
        };
        if FastWords::of_raw(&status.raw).state_words().control() != Control::Bus {
            return Ok(Some(TAKES_COMMAND));
        }
        self.closed_input().await
    }

    async fn read_control(&mut self) -> Result<u16> {
        self.read_held(Class::Command).await.map(|(held, _)| held)
    }

    /// The stop of bit 12 beside every bit as it stands, in forced local mode and where the bus commands.
    fn withdrawal(&self, held: u16, status: &Status) -> std::result::Result<u16, &'static str> {
        let refused = FastWords::of_raw(&status.raw).state_words().refuses_withdrawal();
        refused.map_or(Ok(held | ControlWord::STOP.bits()), Err)
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

const fn closed(by: &'static str) -> Refusal {
    Refusal::Overridden { by, remedy: "open the input first: it might start the motor" }
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
