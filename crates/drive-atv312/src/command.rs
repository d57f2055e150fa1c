//! Start, stop, reset: the control words of this drive, and how they are seen to act. The chart itself is
//! [`drive_drivecom`].

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    Class, Command, Control, Direction, Effect, Error, OwnRun, Port, Recognised, Refusal, Result, Setpoint,
    SlaveAddress, State, Status, StopMode, Stopped, Verdict,
    registers::{Register, access::ReadWrite},
};
use drive_drivecom::{self as drivecom, ChartState, Drivecom, RunShown, StatusWords, StopWord};

use crate::{
    Atv312,
    facts::OTHER_REFERENCE,
    reading::{FIRST, FastWords, raw_command},
    registers::{BLC, BRT, CMD, ETA, IOLR, LAF, LFR, LFRD, LFT, RRS, TCC, TCT},
    settings::{Controls, Known},
    words::{AccessLevel, ControlWord, ExtendedControl, ExtendedStatus, StatusWord},
};

impl<P: Port> Atv312<P> {
    pub(crate) async fn stop_motor(&mut self, mode: StopMode) -> Result<Stopped> {
        if self.brought_down == Some(mode) && !self.known.settings.knows_stop() {
            self.read_for_a_stop_under_way(mode).await;
        }
        match drivecom::stop(self, mode).await {
            Err(Error::NotConfirmed { slave, command, status, because: None }) => {
                let because = FastWords::in_status(&status).refuses_while_saving();
                if because.is_none() {
                    // The settings may have been changed at the drive: the next attempt does without them, and reads them. Where the drive
                    // says who has the motor instead, or that it takes no word now, they are not what it lacks.
                    self.known.settings = Known::default().settings;
                }
                Err(Error::NotConfirmed { slave, command, status, because })
            }
            stopped => stopped,
        }
    }

    /// What a stop depends on that is given anew, for a drive that was seen to make it and whose settings are not known: the quick stop, which is
    /// sure without them, would end a direct current, and the motor would coast, or make a quick stop of a ramp. Nothing is late meanwhile, for
    /// the motor is brought down; where it is no more, or does not tell, the stop goes out without.
    async fn read_for_a_stop_under_way(&mut self, mode: StopMode) {
        let is_run = |word| ControlWord::from_bits_retain(word).is_run();
        if self.proof.held().is_some_and(is_run) {
            return;
        }
        let Ok(words) = self.fast_words(Class::Command).await else { return };
        let Ok(controls) = self.read_controls(Class::Command).await else { return };
        // By a bit of the bus: what an input brings down ends with the input, and a run command would go on.
        if brought_down_by_the_bus(words.state_words()) != Some(mode) || is_run(controls.command) {
            return;
        }
        while !self.known.settings.knows_stop() && !self.known.settings.is_complete() {
            // Of so many readings one may be lost without the drive being so.
            if self.read_setting(Class::Command).await.is_err()
                && self.read_setting(Class::Command).await.is_err()
            {
                return;
            }
        }
    }

    /// Reads the fast words in a class, without making a status of them.
    pub(crate) async fn fast_words(&mut self, class: Class) -> Result<FastWords> {
        self.registers.at(class).read_array(FIRST).await.map(FastWords::of)
    }

    /// The fast set as a status.
    pub(crate) async fn fast_status(&mut self, class: Class) -> Result<Status> {
        self.registers.begin_snapshot();
        let words = self.fast_words(class).await?;
        let settings = &self.known.settings;
        self.proof.holds_if(|held| {
            let command = settings.meaning(held);
            // A stop that was just written may not show yet.
            class == Class::Command && command.is_stop() || words.state_words().can_hold(command)
        });
        self.control = Some(words.state_words().control());
        self.brought_down = brought_down_by_the_bus(words.state_words());
        self.see_shaft(&words);
        let verdict = self.evidence(&words).and_then(|evidence| self.proof.watch.run.verdict(&evidence));
        Ok(Status { verdict, ..self.status_of(&words) })
    }

    /// The control word that the drive was last seen to hold, as it would be at level L1.
    pub(crate) fn command(&self) -> Option<ControlWord> {
        self.proof.held().map(|held| self.known.settings.meaning(held))
    }

    pub(crate) fn status_of(&self, words: &FastWords) -> Status {
        let at = self.registers.snapshot_time();
        Status { at, motion: self.proof.motion, ..words.status(self.known.resolution, self.command()) }
    }

    pub(crate) fn refused(&self, command: Command, reason: Refusal) -> Error {
        Error::Refused { slave: self.registers.slave(), command, reason }
    }

    pub(crate) fn not_confirmed(&self, command: Command, status: Status, because: Option<Refusal>) -> Error {
        let (slave, status) = (self.registers.slave(), Box::new(status));
        Error::NotConfirmed { slave, command, status, because }
    }

    /// Remembers the high bits that the drive holds, as it has just confirmed.
    pub(crate) fn hold(&mut self, word: u16) {
        self.high_bits = word & self.known.settings.assignable();
    }

    /// Whose command the drive is under, for a start.
    fn refuses_control(&self, words: StatusWords) -> Option<Refusal> {
        let control = words.control();
        match self.known.settings.level() {
            Some(AccessLevel::L1 | AccessLevel::L2) => words.refuses_to_take_over(),
            Some(AccessLevel::L3) => (control != Control::Bus).then_some(Refusal::NotInControl(control)),
            _ => Some(Refusal::Settings(
                "the access level is none that the manual lists: set LAC to L1, L2 or L3",
            )),
        }
    }

    /// What the control variables forbid: a lock, or a sign that would turn the direction round. `LFr` and `LFRD` are images of the
    /// one reference of the bus, so a setpoint of either kind replaces both.
    async fn refuses_variables(
        &mut self,
        controls: Controls,
        setpoint: Option<Setpoint>,
    ) -> Result<Option<Refusal>> {
        let rpm = self.registers.at(Class::Command).read(LFRD).await?;
        let negative = controls.reference.cast_signed() < 0 || rpm.cast_signed() < 0;
        Ok(if controls.cmi.contains(ExtendedControl::NO_CONSISTENCY_CHECK) {
            Some(Refusal::Settings(
                "the drive checks no consistency and is locked on standstill (CMI bit 15): clear that bit",
            ))
        } else if controls.cmi.contains(ExtendedControl::LOCK) {
            Some(Refusal::Settings("the drive is locked on standstill (CMI bit 13): clear that bit"))
        } else if negative && (setpoint.is_none() || self.keeps_sign(&controls).await?) {
            Some(Refusal::Settings(
                "the reference on the bus is negative: stop the motor, and give a setpoint before the start",
            ))
        } else {
            None
        })
    }

    /// Whether a setpoint would leave the reference its sign.
    async fn keeps_sign(&mut self, controls: &Controls) -> Result<bool> {
        let words = self.fast_words(Class::Command).await?;
        self.is_negative(&words, controls).await
    }

    /// A run command of the terminals that acts as soon as they command, because the level of their inputs counts and not an
    /// edge (`tCC`, `tCt`, p. 33).
    pub(crate) async fn terminals_ask_for_run(&mut self) -> Result<Option<Refusal>> {
        self.inputs_ask_for_run(None).await
    }

    /// The same once this register is written: `tCC` puts `rrS` and `tCt` back to their factory setting.
    pub(crate) async fn inputs_ask_for_run(
        &mut self,
        written: Option<(u16, u16)>,
    ) -> Result<Option<Refusal>> {
        const TWO_WIRE: u16 = 0;
        const TRANSITION: u16 = 1;
        const LI1: u16 = 129;
        const ASKED: Refusal = Refusal::Overridden {
            by: "a run command of the terminals (LI1, or the input of rrS)",
            remedy: "open the input first, or set tCt to trn",
        };
        let mut calls = self.registers.at(Class::Command);
        let [tcc, tct] = calls.read_array(TCC.address()).await?;
        let after = |register: u16, word| match written {
            Some((at, written)) if at == register => written,
            _ => word,
        };
        let rewired = written.is_some_and(|(at, _)| at == TCC.address());
        let edge =
            after(TCT.address(), tct) == TRANSITION || rewired && after(TCC.address(), tcc) == TWO_WIRE;
        if after(TCC.address(), tcc) != TWO_WIRE || edge {
            return Ok(None);
        }
        let reverse = calls.read(RRS).await?;
        let inputs = calls.read(IOLR).await?;
        let closed =
            |source: u16| source.checked_sub(LI1).is_some_and(|input| input < 6 && inputs >> input & 1 == 1);
        let runs = closed(LI1) || closed(reverse) || closed(after(RRS.address(), reverse));
        Ok(runs.then_some(ASKED))
    }

    /// A limit switch, where one is assigned and the motor does not turn although its reference asks for it. At which level a switch stops it
    /// is not printed (p. 50).
    async fn limit_switch(&mut self, words: StatusWords) -> Option<Refusal> {
        const SWITCH: Refusal = Refusal::Overridden {
            by: "a limit switch, as it seems (LAF or LAr is assigned, and the motor does not turn),",
            remedy: "see the switches, and start away from the one that is reached",
        };
        if words.is_turning() {
            return None;
        }
        let mut calls = self.registers.at(Class::Command);
        let switches = self.known.absent.read(&mut calls, LAF.address(), 2).await.ok()?;
        switches.into_iter().flatten().any(|source| source != 0).then_some(SWITCH)
    }

    /// Why nothing but a stop is written to this drive: it has said that it is another one.
    pub(crate) const fn refuses_writes(&self) -> Option<Refusal> {
        match self.known.kind {
            Some(Recognised::NotMine { it_is }) => Some(Refusal::AnotherDrive(it_is)),
            _ => None,
        }
    }
}

#[async_trait]
impl<P: Port> Drivecom for Atv312<P> {
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

    fn as_written(&self, word: u16) -> u16 {
        word | self.known.settings.kept(self.high_bits)
    }

    async fn read_status(&mut self, class: Class) -> Result<Status> {
        let mut status = self.fast_status(class).await?;
        // One word more for a tripped drive, so that the refusal names the fault.
        if status.state == State::Fault {
            status.fault_code = Some(self.registers.at(class).read(LFT).await?).filter(|code| *code != 0);
        }
        Ok(status)
    }

    /// The bits that have another function in this drive stay as it holds them, and the channels with the bus.
    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
        let word = self.as_written(word);
        self.proof.write_control(&mut self.registers, CMD, (class, word, effect)).await?;
        self.hold(word);
        Ok(())
    }

    async fn refuses_start(
        &mut self,
        direction: Direction,
        setpoint: Option<Setpoint>,
        status: &Status,
    ) -> Result<Option<Refusal>> {
        if let Some(reason) = self.recognise_itself().await? {
            return Ok(Some(reason));
        }
        self.read_for_a_start(Class::Command).await?;
        let controls = self.read_controls(Class::Command).await?;
        let fast = FastWords::in_status(status);
        if let Some(reason) = fast.refuses_while_saving() {
            return Ok(Some(reason));
        }
        let words = fast.state_words();
        let settings = &self.known.settings;
        let restart = settings.self_restart().filter(|_| !self.accepts_restart).map(Refusal::RestartsItself);
        let reverse = if direction == Direction::Reverse { settings.refuses_reverse() } else { None };
        if let Some(reason) = self.refuses_control(words).or(reverse).or(restart) {
            return Ok(Some(reason));
        }
        // A motor that direct current brakes shows no output frequency, and would coast without voltage.
        if words.is_driving() && words.chart() == Some(ChartState::QuickStopActive) {
            return Ok(Some(Refusal::State(State::QuickStop)));
        }
        if self.known.settings.has_stop_inputs() {
            let inputs = self.registers.at(Class::Command).read(IOLR).await?;
            if let Some(reason) = self.known.settings.stopped_by(inputs) {
                return Ok(Some(reason));
            }
        }
        match self.refuses_variables(controls, setpoint).await? {
            // By the bits that the start will leave as they are.
            None => self.judge_reference(self.as_written(0)).await,
            refusal => Ok(refusal),
        }
    }

    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<RunShown> {
        let words = FastWords::in_status(status);
        self.frequency_limits().await?;
        let mut controls = self.read_controls(Class::Command).await?;
        let mut follows = self.follows_frequency(&words, controls.reference).await?;
        let mut in_force = (LFR.address(), controls.reference);
        if !follows {
            let (lfrd, by_speed) = self.follows_speed().await?;
            follows = by_speed && !self.frh_lags(&words, lfrd).await?;
            in_force = (LFRD.address(), lfrd);
            // The last thing that is read: a stop of somebody else that came before shows in it.
            controls = self.read_controls(Class::Command).await?;
        }
        let fault_code = status.fault_code;
        *status = Status { fault_code, ..self.status_of(&words) };
        status.reference = status.reference.map(|reference| self.proof.turns_at(reference));
        status.raw.push(raw_command(controls.command));
        if controls.command != self.as_written(word) {
            return Ok(RunShown::NotYet);
        }
        let direction = ControlWord::from_bits_retain(word).direction();
        let shown = words.state_words().shows_run(direction, words.reference(), self.output(&words));
        if !follows || shown == RunShown::NotYet {
            return Ok(RunShown::NotYet);
        }
        // The setpoint that the run command found is the one that it is to follow from now on.
        self.recounted = false;
        self.proof.is_to_follow(in_force);
        status.verdict = Some(Verdict::InForce);
        Ok(shown)
    }

    async fn prevents_run(&mut self, status: &Status) -> Option<Refusal> {
        let words = FastWords::in_status(status);
        if let Some(reason) = words.state_words().prevents_run() {
            return Some(reason);
        }
        let controls = self.read_controls(Class::Command).await.ok()?;
        let other = self.other_reference().await.ok()?;
        if let (None, Some(reason)) = (other, self.limit_switch(words.state_words()).await) {
            return Some(reason);
        }
        let follows = self.follows_frequency(&words, controls.reference).await.ok()?
            || self.follows_speed().await.ok()?.1;
        other.or((!follows).then_some(OTHER_REFERENCE))
    }

    /// With brake control (bLC) the brake is released first, which takes brt, 5 s at the most (BBV51701 p. 47).
    async fn turns_late(&mut self) -> Duration {
        let mut calls = self.registers.at(Class::Command);
        let (Ok(assigned), Ok(release)) = (calls.read(BLC).await, calls.read(BRT).await) else {
            return Duration::ZERO;
        };
        if assigned == 0 { Duration::ZERO } else { Duration::from_millis(u64::from(release) * 10) }
    }

    /// What the inputs ask for counts only where the terminals command then. Keys and another bus do not tell what they ask for;
    /// and at L1 and L2 the reset itself would take command from whoever has it, without anybody having asked for that.
    async fn refuses_reset(&mut self, status: &Status) -> Result<Option<Refusal>> {
        const TAKES_COMMAND: Refusal = Refusal::Overridden {
            by: "whoever has command, for at LAC = L1 and L2 any word of the bus takes it from him,",
            remedy: "stop the motor by the bus first, which says whom it takes command from, or reset the fault at the drive",
        };
        if let Some(reason) = self.refuses_writes() {
            return Ok(Some(reason));
        }
        self.read_settings(Class::Command).await?;
        let words = FastWords::in_status(status).state_words();
        match (words.control(), self.known.settings.level()) {
            (Control::Bus, _) => Ok(None),
            (_, level) if level != Some(AccessLevel::L3) => Ok(Some(TAKES_COMMAND)),
            (Control::Local, _) if self.is_commanded_by_terminals(words).await? => {
                self.terminals_ask_for_run().await
            }
            (somebody, _) => Ok(Some(Refusal::NotInControl(somebody))),
        }
    }

    async fn read_control(&mut self) -> Result<u16> {
        self.read_controls(Class::Command).await.map(|controls| controls.command)
    }

    fn is_run(&self, held: u16) -> bool {
        self.known.settings.meaning(held).is_run()
    }

    /// The stop of bit 12 beside every bit as it stands: it ends a run command, and neither voltage nor channel. Where operation
    /// is not enabled, as after a trip, no bit acts on the motor.
    fn withdrawal(&self, held: u16, status: &Status) -> std::result::Result<u16, &'static str> {
        let settings = &self.known.settings;
        let words = FastWords::in_status(status).state_words();
        let enabled = words.chart() == Some(ChartState::OperationEnabled);
        let taken = settings.others().contains(ControlWord::STOP);
        if taken && enabled {
            return Err("a function is assigned to bit 12 of CMD, and no other bit ends a run command alone");
        }
        let manages_channels = settings.level() != Some(AccessLevel::L3);
        match words.refuses_withdrawal().filter(|_| manages_channels) {
            Some(reason) => Err(reason),
            None if taken => Ok(settings.kept(held)),
            None => Ok(held | ControlWord::STOP.bits()),
        }
    }

    /// Without the bits that lead the channels to the bus.
    async fn write_withdrawal(&mut self, word: u16) -> Result<()> {
        self.proof.is_writing(word);
        self.registers.at(Class::Command).write(CMD, word).await
    }

    fn last_control(&self) -> Option<Control> {
        self.control
    }

    fn stop_word(&self, mode: StopMode) -> StopWord {
        self.known.settings.stop(mode)
    }

    async fn corrected_stop(&mut self, asked: StopMode, sent: StopWord) -> Option<StopWord> {
        let before = self.known.settings.kept(self.high_bits);
        let mut led = before;
        let was_known = self.known.settings.knows_stop();
        if was_known {
            self.read_meanings(Class::Command).await.ok()?;
        }
        // A drive that has no LAC never tells them, however often it is asked.
        while !self.known.settings.knows_stop() && !self.known.settings.is_complete() {
            if self.read_setting(Class::Command).await.is_err() {
                return (led != before).then_some(sent);
            }
            // Until the bit is known that leads the command to the bus, a stop of the bus may have left the motor to the terminals.
            let kept = self.known.settings.kept(self.high_bits);
            if kept != led {
                led = kept;
                // It is written once more when all is known, and that one's outcome counts.
                let _ = self.write_control(Class::Stop, sent.word, Effect::Level).await;
            }
        }
        // A quick stop that went out while nothing was known is not turned into a slower one.
        let stop = if was_known { self.known.settings.stop(asked) } else { sent };
        (stop.word != sent.word || self.known.settings.kept(self.high_bits) != before).then_some(stop)
    }

    fn shows_stop(&self, stop: &StopWord, status: &Status) -> bool {
        FastWords::in_status(status).state_words().shows_stop(ControlWord::from_bits_retain(stop.word))
    }

    fn defies_stop(&self, status: &Status) -> Option<Refusal> {
        let words = FastWords::in_status(status).state_words();
        let forced_local = !words.eta.contains(StatusWord::NOT_FORCED_LOCAL);
        let fixed = forced_local || self.known.settings.level() == Some(AccessLevel::L3);
        (fixed && words.is_driving() && words.control() != Control::Bus)
            .then(|| Refusal::NotInControl(words.control()))
    }
}

/// By what the motor is brought down while the bus commands, where that is direct current or a ramp: the fast stop has a word that is sure.
fn brought_down_by_the_bus(words: StatusWords) -> Option<StopMode> {
    if words.chart() != Some(ChartState::OperationEnabled) || words.control() != Control::Bus {
        return None;
    }
    let is = |bits| words.eti.contains(bits);
    match (is(ExtendedStatus::DC_INJECTION), is(ExtendedStatus::DECELERATING)) {
        (true, _) => Some(StopMode::DcInjection),
        (false, true) if !is(ExtendedStatus::FAST_STOP) => Some(StopMode::Ramp),
        _ => None,
    }
}

/// The word that stops every drive of this family at once, for the stops that no setting changes: the others would
/// enable a drive that is merely ready.
pub(crate) const fn broadcast_word(mode: StopMode) -> Option<(Register<ReadWrite>, u16)> {
    match mode {
        StopMode::Fast => Some((CMD, drivecom::QUICK_STOP)),
        StopMode::Freewheel => Some((CMD, drivecom::DISABLE_VOLTAGE)),
        StopMode::Ramp | StopMode::DcInjection => None,
    }
}
