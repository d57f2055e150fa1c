//! Reading, and what the words say of the state, the shaft and the run command of this side.

use drive_core::{
    Class, Control, Current, Evidence, Fault, Faults, Frequency, Measurements, Output, Port, RawWord,
    Refusal, Result, Row, RunWord, Speed, State, Status, Told, Voltage, registers::Place,
};
use tokio::time::Instant;

use super::{
    ProfileDrive, Words,
    cell::Cell,
    falling::has_fallen,
    plan::Block,
    sight::{FullScale, Sight, Test},
};
use crate::{
    format::{Answer, Proves, UnitName},
    scale::hundredths,
};

pub(super) const OTHERS: Refusal = Refusal::Overridden {
    by: "something else than the bus",
    remedy: "give command and reference to the bus at the drive",
};
const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another setpoint than was given",
    remedy: "see who else writes to this drive, and that its reference is that of the bus",
};
/// The same where the drive tells itself what 100 % is: whichever of both was changed, the motor is to turn at another speed.
const OTHER_SCALE: Refusal = Refusal::Overridden {
    by: "another setpoint than was given, or another frequency that is its 100 %,",
    remedy: "see who else writes to this drive, whether its 100 % was changed, and that its reference is that of the bus",
};
const OTHER_WORD: Refusal = Refusal::Overridden {
    by: "another command word than was written",
    remedy: "see who else writes to this drive",
};
const HELD_BACK: Refusal = Refusal::Overridden {
    by: "something that the drive does not tell, such as a stop at it, an input, another master or its supply,",
    remedy: "stop it, see what holds it, and start it again if it is to run",
};

impl<P: Port> ProfileDrive<P> {
    /// The words, or bits as 0 and 1, of one exchange.
    pub(super) async fn read_block(&mut self, class: Class, block: Block) -> Result<Vec<u16>> {
        let Block { space, first, count } = block;
        self.registers.at(class).read_places(Place { space, address: first }, count).await
    }

    pub(super) async fn read_blocks(&mut self, class: Class, blocks: &[Block]) -> Result<Words> {
        self.registers.begin_snapshot();
        let mut words = Words::default();
        for block in blocks {
            let read = self.read_block(class, *block).await?;
            words.keep(*block, read);
        }
        Ok(words)
    }

    /// A status. What it says of the run command ends nothing: see [`judge`](Self::judge).
    pub(super) async fn read_status(&mut self, class: Class) -> Result<(Status, Words)> {
        let sight = self.sight.clone();
        let mut words = self.read_blocks(class, &sight.fast).await?;
        if self.watch.shaft.was_braked() && self.registers.is_torn() {
            // Its state may be of before a trip, and its output of behind it: no ramp has brought the motor down then.
            words = self.read_blocks(class, &sight.fast).await?;
        }
        if !sight.command.is_empty() && self.wants_command(class) {
            for block in &sight.command {
                let read = self.read_block(class, *block).await.inspect_err(|_| self.watch.turns.again())?;
                words.keep(*block, read);
            }
        }
        let mut status = self.explain(&words);
        if let Some(block) = sight.code.filter(|_| status.is_fault()) {
            // That it has tripped is told in any case.
            if let Ok(read) = self.read_block(class, block).await {
                words.keep(block, read);
                status.fault_code = sight.fault_code(&words);
                status.raw = self.raw(&words);
            }
        }
        let shown = self.shown(&status, &words);
        let at = status.at.unwrap_or_else(Instant::now);
        status.motion = self.watch.see(at, shown, status.output_frequency);
        let turns = status.output_frequency.filter(|output| *output != Frequency::ZERO);
        let direction = status.direction.filter(|_| turns.is_some());
        self.watch.see_turning(at, direction, turns.unwrap_or_default(), None);
        let evidence = self.evidence(&status, &words);
        status.verdict = self.watch.run.verdict(&evidence);
        Ok((status, words))
    }

    /// Whether the command is to be read back: of a command each time; else while one of this side stands, in its turn, or at once where
    /// nobody knows what the drive holds.
    fn wants_command(&mut self, class: Class) -> bool {
        let stands = self.watch.run.lease().is_some();
        class == Class::Command
            || stands && (self.watch.turns.pass(1).is_some() || self.watch.run.held().is_none())
    }

    /// The verdict of a status for its own sake, which ends a run command that stands no more.
    pub(super) fn judge(&mut self, status: &mut Status, words: &Words) {
        if self.watch.run.lease().is_some() {
            // Of a run command of an earlier run of the program nobody knows what it rested on.
            self.agreed = self.agreed.or(self.setpoint_seen(words));
        }
        let evidence = self.evidence(status, words);
        status.verdict = self.watch.run.judge(&evidence);
    }

    fn explain(&mut self, words: &Words) -> Status {
        let sight = self.sight.clone();
        let output_frequency = sight.output.and_then(|output| self.frequency(words, output));
        let fits = |test: &Option<Test>| test.as_ref()?.fits(words);
        self.at_speed = fits(&sight.at_setpoint) == Some(true);
        let state = self.by_output(sight.state(words), output_frequency);
        let state = self.coming_down(state, output_frequency);
        let control = match owned(&sight, words, sight.commanded_by.as_ref()) {
            Told::Yes => Some(Control::Bus),
            Told::No(_) => Some(Control::Local),
            Told::NotTold => None,
        };
        let current = sight.current.and_then(|current| {
            let hundredths = current.hundredths(words, UnitName::Ampere)?;
            u32::try_from(hundredths / 10).ok()
        });
        if let Some(held) = sight.held(words) {
            self.watch.run.reads(held);
        }
        Status {
            state,
            direction: sight.direction(words),
            output_frequency,
            current: current.map(Current::from_deciamperes),
            reference: sight.setpoint.and_then(|setpoint| self.frequency(words, setpoint)),
            at_reference: fits(&sight.at_setpoint),
            warning: fits(&sight.warning),
            fault_code: sight.fault_code(words).filter(|_| state.is_fault()),
            control,
            raw: self.raw(words),
            at: self.registers.snapshot_time(),
            ..Status::default()
        }
    }

    /// A motor that its terminals run may be none by a status word that tells of the bus's command alone. While one of this side stands, the
    /// word says what becomes of it.
    fn by_output(&mut self, state: State, output: Option<Frequency>) -> State {
        if self.watch.run.lease().is_some() {
            self.steady.forget();
            return state;
        }
        self.steady.see(state, output)
    }

    /// Some drives tell that they run until the motor stands: behind a stop of this side, and as long as the output only goes down and does
    /// not stay where the setpoint is, it is stopping. Of one that tells no output it is until it is at its speed again.
    fn coming_down(&mut self, state: State, output: Option<Frequency>) -> State {
        self.withdrawn_at = self.withdrawn_at.filter(|_| state == State::Running);
        if self.comes_down.is_none() && output.is_some_and(|output| has_fallen(output, self.withdrawn_at)) {
            // One that holds a lower speed by somebody else does not come down any more.
            let from = std::mem::replace(&mut self.withdrawn_at, output);
            self.comes_down = Some(from.map(Frequency::centihertz));
        }
        let output = output.map(Frequency::centihertz);
        let is_down = match (state, self.comes_down, output) {
            (State::Running, Some(Some(last)), Some(output)) => {
                output < last || output == last && !self.at_speed
            }
            (State::Running, Some(None), None) => !self.at_speed,
            _ => false,
        };
        self.comes_down = is_down.then_some(output);
        if is_down { State::Stopping } else { state }
    }

    /// A register as a frequency, whichever way it turns.
    pub(super) fn frequency(&self, words: &Words, cell: Cell) -> Option<Frequency> {
        let [numerator, denominator] = self.hertz_of(words, cell)?;
        let centihertz = hundredths(cell.counts(words)?, numerator, denominator);
        u32::try_from(centihertz.unsigned_abs()).ok().map(Frequency::from_centihertz)
    }

    /// How many hertz are one count of a register, as a fraction.
    pub(super) fn hertz_of(&self, words: &Words, cell: Cell) -> Option<[i64; 2]> {
        let [numerator, denominator] = cell.scale(words)?;
        match cell.unit {
            UnitName::Hertz => Some([numerator, denominator]),
            UnitName::Percent => {
                let full = i64::from(self.full_scale(words)?.centihertz());
                Some([numerator.checked_mul(full)?, denominator.checked_mul(10_000)?])
            }
            _ => None,
        }
        .filter(|[numerator, denominator]| *numerator > 0 && *denominator > 0)
    }

    /// What 100 % is: as the drive holds it, or its owner says.
    fn full_scale(&self, words: &Words) -> Option<Frequency> {
        let full = match self.sight.full_scale.as_ref()? {
            FullScale::Owner => self.owner.full_scale?,
            FullScale::Register(cell) => {
                let held = cell.hundredths(words, UnitName::Hertz)?;
                Frequency::from_centihertz(u32::try_from(held).ok()?)
            }
        };
        Some(full).filter(|full| *full != Frequency::ZERO)
    }

    fn raw(&self, words: &Words) -> Vec<RawWord> {
        let rows = self.registers.capabilities().rows;
        let code = |place: Place| {
            let row = rows.binary_search_by_key(&place, Row::place).ok();
            row.and_then(|at| rows.get(at)).map_or("", |row| row.code)
        };
        words
            .iter()
            .map(|(space, address, value)| RawWord { address, code: code(Place { space, address }), value })
            .collect()
    }

    /// What this status shows of the output. Of the shaft it tells only by what its file names for that.
    fn shown(&self, status: &Status, words: &Words) -> Output {
        let output = status.output_frequency;
        let stands = self.sight.standstill.as_ref().and_then(|test| test.fits(words)) == Some(true);
        match status.state {
            State::Fault | State::Ready | State::Disabled | State::NotReady if stands => Output::Stands,
            State::Fault => Output::Tripped,
            State::Running => Output::Driven,
            State::Stopping | State::QuickStop | State::FaultReaction => match output {
                Some(output) => Output::Braking(output),
                None => Output::NotKnown,
            },
            // A drive of which nothing shows that it runs may run in any of these.
            State::Ready | State::Disabled | State::NotReady
                if output.is_none() && !self.sight.shows_running() =>
            {
                Output::NotKnown
            }
            State::Ready | State::Disabled | State::NotReady => match output {
                Some(output) if output != Frequency::ZERO => Output::Braking(output),
                // Whatever feeds a motor that stands, direct current perhaps: its output is not cut.
                _ if status.current.is_some_and(|current| current > Current::from_deciamperes(0)) => {
                    Output::NotKnown
                }
                // A drive that is not ready lacks its supply, or is held off: no ramp of a stop ends there.
                _ if status.state == State::NotReady => Output::Cut,
                // Behind a stop of this side another may stand by now.
                _ if self.watch.shaft.was_braked() && !self.lets_coast => Output::Gone,
                _ => Output::Cut,
            },
            State::Unknown => Output::NotKnown,
        }
    }

    /// The setpoint as the drive shows it, in hundredths of a hertz, or in counts where they cannot be told so. In a register that
    /// takes it and no more a sign is somebody else's; another one may show by it which way the motor is commanded.
    pub(super) fn setpoint_seen(&self, words: &Words) -> Option<i64> {
        let setpoint = self.sight.setpoint?;
        let is_negative =
            self.sight.shows_own_setpoint && setpoint.counts(words).is_some_and(|counts| counts < 0);
        match self.frequency(words, setpoint) {
            Some(frequency) if is_negative => Some(-i64::from(frequency.centihertz())),
            Some(frequency) => Some(i64::from(frequency.centihertz())),
            None => setpoint.counts(words),
        }
    }

    /// Whether the drive tells that its reference is the bus's.
    pub(super) fn reference_is_ours(&self, words: &Words) -> bool {
        owned(&self.sight, words, self.sight.reference_by.as_ref()) == Told::Yes
    }

    pub(super) fn evidence(&self, status: &Status, words: &Words) -> Evidence {
        let command = owned(&self.sight, words, self.sight.commanded_by.as_ref());
        let seen = self.agreed.and_then(|_| self.setpoint_seen(words));
        let other = seen.is_some() && ![self.agreed, self.agreed_before].contains(&seen);
        let reference = match owned(&self.sight, words, self.sight.reference_by.as_ref()) {
            _ if other && matches!(self.sight.full_scale, Some(FullScale::Register(_))) => {
                Told::No(OTHER_SCALE)
            }
            _ if other => Told::No(OTHER_REFERENCE),
            Told::Yes if self.agreed.is_none() || !self.turns_as_commanded(status) => Told::NotTold,
            told => told,
        };
        let reference = self.watch.told_by_turning(reference);
        let word = match self.watch.run.held() {
            Some(_) => self.watch.run.word(|word| self.is_run(word)),
            None => RunWord::NotTold,
        };
        let both = status.output_frequency.zip(status.reference);
        let is_brought_down = status.state == State::Running
            && both.is_some_and(|(output, of)| self.watch.is_brought_down(status.direction, output, of));
        let output = if is_brought_down { Told::NotTold } else { Told::unless(withheld(status)) };
        Evidence { word, command, output, reference }
    }

    /// Who has command or reference instead of the bus, where the drive tells it.
    pub(super) fn commanded_by_other(&self, words: &Words) -> Option<Refusal> {
        let told = [&self.sight.commanded_by, &self.sight.reference_by]
            .map(|by| owned(&self.sight, words, by.as_ref()));
        told.into_iter().find_map(|told| if let Told::No(because) = told { Some(because) } else { None })
    }

    /// Whether the motor is seen to turn in the direction of the run command. Of a drive that cannot be turned round nobody has to ask.
    fn turns_as_commanded(&self, status: &Status) -> bool {
        let file = self.profile.file();
        let commanded = self.watch.run.lease().map(|lease| lease.direction);
        match file.see.direction {
            Answer::Given(_) => status.direction == commanded,
            Answer::None => matches!(file.start.reverse, Answer::None),
            Answer::Unknown => false,
        }
    }

    /// Whether a word of the command register that reads back runs the motor.
    pub(super) fn is_run(&self, word: u16) -> bool {
        self.sight.reads_back.as_ref().is_some_and(|of| of.runs(self.profile.file(), word))
    }

    pub(super) async fn read_measurements(&mut self) -> Result<Measurements> {
        let sight = self.sight.clone();
        let words = self.read_blocks(Class::Background, &sight.slow).await?;
        let of = |cell: Option<Cell>, unit| cell?.hundredths(&words, unit);
        let volts =
            |cell| of(cell, UnitName::Volt).and_then(|hundredths| u32::try_from(hundredths / 10).ok());
        let rpm =
            of(sight.speed, UnitName::Rpm).and_then(|hundredths| u32::try_from(hundredths.abs() / 100).ok());
        let reference = sight.setpoint.and_then(|setpoint| self.frequency(&words, setpoint));
        Ok(Measurements {
            at: self.registers.snapshot_time(),
            reference: reference.map(Into::into),
            speed: rpm.map(Speed::from_rpm),
            output_voltage: volts(sight.output_voltage).map(Voltage::from_decivolts),
            dc_bus_voltage: volts(sight.dc_bus_voltage).map(Voltage::from_decivolts),
            raw: self.raw(&words),
            ..Measurements::default()
        })
    }

    /// The present fault; its history is not read.
    pub(super) async fn read_faults(&mut self) -> Result<Faults> {
        let (status, _) = self.read_status(Class::Background).await?;
        let table = self.profile.fault_entries();
        let present = status.fault_code.map(|code| Fault::lookup(table, code));
        let tripped = status.is_fault();
        Ok(Faults { present: present.into_iter().collect(), tripped, ..Faults::default() })
    }
}

/// Whether it is the bus, by the bits that tell it.
fn owned(sight: &Sight, words: &Words, by: Option<&(Test, Proves)>) -> Told {
    let Some((test, proves)) = by else { return Told::NotTold };
    // A word that no drive of the profile has when it is alive says nothing of it by its other bits either.
    if sight.is_of_the_state(test) && sight.state(words) == State::Unknown {
        return Told::NotTold;
    }
    match (test.fits(words), proves) {
        (Some(true), Proves::Bus) => Told::Yes,
        (Some(false), _) => Told::No(OTHERS),
        (Some(true), Proves::Nothing) | (None, _) => Told::NotTold,
    }
}

/// What keeps a run command from being in force, by what the drive shows of it.
pub(super) fn lacks(evidence: &Evidence) -> Option<Refusal> {
    let told = |told| if let Told::No(because) = told { Some(because) } else { None };
    let another = matches!(evidence.word, RunWord::Gone | RunWord::Another).then_some(OTHER_WORD);
    let is_tripped = matches!(evidence.output, Told::No(Refusal::Tripped | Refusal::Fault(_)));
    told(evidence.command)
        .or(another.filter(|_| !is_tripped))
        .or_else(|| told(evidence.output))
        .or_else(|| told(evidence.reference))
}

/// What keeps the motor from being driven by a run command that stands.
fn withheld(status: &Status) -> Option<Refusal> {
    match status.state {
        State::Running => None,
        State::Fault | State::FaultReaction => {
            Some(status.fault_code.map_or(Refusal::Tripped, Refusal::Fault))
        }
        _ => Some(HELD_BACK),
    }
}
