//! Reading, and what the words say of the state, the shaft and the run command of this side.

use drive_core::{
    Class, Control, Current, Direction, Evidence, Exchange, Fault, Faults, Frequency, Measurements, Output,
    Port, RawWord, Refusal, Result, RunWord, Speed, State, Status, Told, Voltage,
    tokio_modbus::{Request, Response},
};
use tokio::time::Instant;

use super::{ProfileDrive, Words, plan::Block};
use crate::{
    format::{Answer, Owner as OwnerBits, Proves, Space, StateName, UnitName},
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
const OTHER_WORD: Refusal = Refusal::Overridden {
    by: "another command word than was written",
    remedy: "see who else writes to this drive",
};
const HELD_BACK: Refusal = Refusal::Overridden {
    by: "a stop at the drive, or an input that holds it",
    remedy: "stop it, see what holds it, and start it again if it is to run",
};

impl<P: Port> ProfileDrive<P> {
    /// The words, or bits as 0 and 1, of one exchange.
    pub(super) async fn read_block(&mut self, class: Class, block: Block) -> Result<Vec<u16>> {
        let Block { space, first, count } = block;
        let mut calls = self.registers.at(class);
        let exchange = Exchange { function: space.read_by(), register: Some(first) };
        let request = match space {
            Space::HoldingRegister => return calls.read_words(first, count).await,
            Space::InputRegister => Request::ReadInputRegisters(first, count),
            Space::Coil => Request::ReadCoils(first, count),
            Space::DiscreteInput => Request::ReadDiscreteInputs(first, count),
        };
        let read = match calls.request(request, exchange).await? {
            Response::ReadInputRegisters(words) => words,
            Response::ReadCoils(bits) | Response::ReadDiscreteInputs(bits) => {
                bits.into_iter().take(count.into()).map(u16::from).collect()
            }
            _ => return Err(calls.answer(exchange, "the answer is of another function")),
        };
        if read.len() != usize::from(count) {
            return Err(calls.answer(exchange, "the answer holds another number of registers"));
        }
        Ok(read)
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
        let blocks = self.fast.clone();
        let mut words = self.read_blocks(class, &blocks).await?;
        if let Some(block) = self.command.filter(|_| self.wants_command(class)) {
            let read = self.read_block(class, block).await.inspect_err(|_| self.watch.turns.again())?;
            words.keep(block, read);
        }
        let mut status = self.explain(&words);
        if let Some(block) = self.code.filter(|_| status.is_fault()) {
            // That it has tripped is told in any case.
            if let Ok(read) = self.read_block(class, block).await {
                words.keep(block, read);
                status.fault_code = see_code(&self.profile, &words).filter(|code| *code != 0);
                status.raw = self.raw(&words);
            }
        }
        let shown = self.shown(&status, &words);
        status.motion = self.watch.see(Instant::now(), shown, status.output_frequency);
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
        let profile = self.profile.clone();
        let (file, see) = (profile.file(), &profile.file().see);
        let states = file.state.is.iter().map(crate::format::Spanned::get_ref);
        let mut state = State::Unknown;
        for is in states {
            match profile.fits(words, is.bits.get_ref()) {
                Some(true) => {
                    state = is.state.state();
                    break;
                }
                Some(false) => {}
                // What cannot be seen may be a trip: nothing behind it is told.
                None => break,
            }
        }
        let output_frequency = see.output.given().and_then(|name| self.frequency(words, name.get_ref()));
        state = self.coming_down(state, output_frequency);
        let fits =
            |bits: Option<&crate::format::Spanned<crate::format::Bits>>| profile.fits(words, bits?.get_ref());
        let code = see_code(&profile, words).filter(|code| *code != 0 && state.is_fault());
        let control =
            match self.owned(words, file.ownership.command.given().map(crate::format::Spanned::get_ref)) {
                Told::Yes => Some(Control::Bus),
                Told::No(_) => Some(Control::Local),
                Told::NotTold => None,
            };
        let current = see.current.given().and_then(|name| {
            let hundredths = profile.hundredths(words, name.get_ref(), UnitName::Ampere)?;
            i32::try_from(hundredths / 10).ok()
        });
        if let Some(held) = self.held(words) {
            self.watch.run.reads(held);
        }
        Status {
            state,
            direction: self.direction(words),
            output_frequency,
            current: current.and_then(|tenths| u32::try_from(tenths).ok()).map(Current::from_deciamperes),
            reference: see.setpoint.given().and_then(|name| self.frequency(words, name.get_ref())),
            at_reference: fits(see.at_setpoint.given()),
            warning: fits(see.warning.given()),
            fault_code: code,
            control,
            raw: self.raw(words),
            at: self.registers.snapshot_time(),
            ..Status::default()
        }
    }

    /// Some drives tell that they run until the motor stands: behind a stop of this side, and as long as the output only goes down,
    /// it is stopping.
    fn coming_down(&mut self, state: State, output: Option<Frequency>) -> State {
        let output = output.map(Frequency::centihertz);
        match (state, self.comes_down, output) {
            (State::Running, Some(last), Some(output)) if output <= last => {
                self.comes_down = Some(output);
                State::Stopping
            }
            (state, ..) => {
                self.comes_down = None;
                state
            }
        }
    }

    /// A register as a frequency, whichever way it turns.
    pub(super) fn frequency(&self, words: &Words, name: &str) -> Option<Frequency> {
        let register = self.profile.file().named(name)?;
        let counts = self.profile.counts(words, name)?;
        let [numerator, denominator] = self.hertz_of(register, words)?;
        let centihertz = hundredths(counts, numerator, denominator);
        u32::try_from(centihertz.unsigned_abs()).ok().map(Frequency::from_centihertz)
    }

    /// How many hertz are one count of a register, as a fraction.
    pub(super) fn hertz_of(&self, register: &crate::format::Register, words: &Words) -> Option<[i64; 2]> {
        let [numerator, denominator] = self.profile.scale(words, register)?;
        match register.unit {
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
        let full = self.profile.file().setpoint.given()?.get_ref().full_scale.as_ref()?;
        if full.get_ref() == "owner" {
            return self.owner.full_scale.filter(|full| *full != Frequency::ZERO);
        }
        let held = self.profile.hundredths(words, full.get_ref(), UnitName::Hertz)?;
        u32::try_from(held).ok().filter(|held| *held != 0).map(Frequency::from_centihertz)
    }

    fn direction(&self, words: &Words) -> Option<Direction> {
        let direction = self.profile.file().see.direction.given()?.get_ref();
        let name = direction.register.get_ref();
        let Some(mask) = &direction.mask else {
            return match self.profile.counts(words, name)?.signum() {
                1 => Some(Direction::Forward),
                -1 => Some(Direction::Reverse),
                _ => None,
            };
        };
        let word = Some(self.profile.word(words, name)? & mask.get_ref());
        if word == direction.forward {
            Some(Direction::Forward)
        } else if word == direction.reverse {
            Some(Direction::Reverse)
        } else {
            None
        }
    }

    fn raw(&self, words: &Words) -> Vec<RawWord> {
        let rows = self.registers.capabilities().rows;
        let code = |space, address| match space {
            Space::HoldingRegister => {
                let row = rows.binary_search_by_key(&address, |row| row.address).ok();
                row.and_then(|at| rows.get(at)).map_or("", |row| row.code)
            }
            Space::InputRegister => "InputRegister",
            Space::Coil => "Coil",
            Space::DiscreteInput => "DiscreteInput",
        };
        words
            .iter()
            .map(|(space, address, value)| RawWord { address, code: code(space, address), value })
            .collect()
    }

    /// What this status shows of the output. Of the shaft it tells only by what its file names for that.
    fn shown(&self, status: &Status, words: &Words) -> Output {
        let output = status.output_frequency;
        let standstill = self.profile.file().state.standstill.given();
        let stands = standstill.and_then(|bits| self.profile.fits(words, bits.get_ref())) == Some(true);
        match status.state {
            State::Fault | State::Ready | State::Disabled | State::NotReady if stands => Output::Stands,
            State::Fault => Output::Tripped,
            State::Running => Output::Driven,
            State::Stopping | State::QuickStop | State::FaultReaction => match output {
                Some(output) => Output::Braking(output),
                None => Output::NotKnown,
            },
            // A drive of which nothing shows that it runs may run in any of these.
            State::Ready | State::Disabled | State::NotReady if output.is_none() && !self.shows_running() => {
                Output::NotKnown
            }
            State::Ready | State::Disabled | State::NotReady => match output {
                Some(output) if output != Frequency::ZERO => Output::Braking(output),
                // Whatever feeds a motor that stands, direct current perhaps: its output is not cut.
                _ if status.current.is_some_and(|current| current > Current::from_deciamperes(0)) => {
                    Output::NotKnown
                }
                // Behind a stop of this side another may stand by now.
                _ if self.watch.shaft.was_braked() && !self.lets_coast => Output::Gone,
                _ => Output::Cut,
            },
            State::Unknown => Output::NotKnown,
        }
    }

    /// Whether a state of its profile is that of a motor that runs.
    fn shows_running(&self) -> bool {
        self.profile.file().state.is.iter().any(|is| is.get_ref().state == StateName::Running)
    }

    /// The command that the drive is read to hold.
    fn held(&self, words: &Words) -> Option<u16> {
        let read = self.profile.file().ownership.reads_back.given()?;
        self.profile.word(words, read.get_ref().register.get_ref())
    }

    /// The setpoint as the drive shows it, in hundredths of a hertz, or in counts where they cannot be told so.
    pub(super) fn setpoint_seen(&self, words: &Words) -> Option<i64> {
        let name = self.profile.file().see.setpoint.given()?.get_ref();
        match self.frequency(words, name) {
            Some(frequency) => Some(i64::from(frequency.centihertz())),
            None => self.profile.counts(words, name),
        }
    }

    pub(super) fn owned(&self, words: &Words, owner: Option<&OwnerBits>) -> Told {
        let Some(owner) = owner else { return Told::NotTold };
        match (self.profile.fits(words, &owner.bits), owner.proves) {
            (Some(true), Proves::Bus) => Told::Yes,
            (Some(false), _) => Told::No(OTHERS),
            (Some(true), Proves::Nothing) | (None, _) => Told::NotTold,
        }
    }

    pub(super) fn evidence(&self, status: &Status, words: &Words) -> Evidence {
        let owner = &self.profile.file().ownership;
        let command = self.owned(words, owner.command.given().map(crate::format::Spanned::get_ref));
        let other = self.agreed.is_some()
            && self.setpoint_seen(words).is_some()
            && self.agreed != self.setpoint_seen(words);
        let reference = match self.owned(words, owner.reference.given().map(crate::format::Spanned::get_ref))
        {
            _ if other => Told::No(OTHER_REFERENCE),
            Told::Yes if self.agreed.is_none() || !self.turns_as_commanded(status) => Told::NotTold,
            told => told,
        };
        let word = match self.watch.run.held() {
            Some(_) => self.watch.run.word(|word| self.is_run(word)),
            None => RunWord::NotTold,
        };
        Evidence { word, command, output: Told::unless(withheld(status)), reference }
    }

    /// Who has command or reference instead of the bus, where the drive tells it.
    pub(super) fn commanded_by_other(&self, words: &Words) -> Option<Refusal> {
        let owner = &self.profile.file().ownership;
        let told = [&owner.command, &owner.reference]
            .map(|owner| self.owned(words, owner.given().map(crate::format::Spanned::get_ref)));
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
        let file = self.profile.file();
        let register =
            file.ownership.reads_back.given().and_then(|read| file.named(read.get_ref().register.get_ref()));
        let place = register.and_then(|register| file.place(register));
        place.is_some_and(|(space, address)| {
            file.runs(crate::profile::Written { space, address, value: word })
        })
    }

    pub(super) async fn read_measurements(&mut self) -> Result<Measurements> {
        let blocks = self.slow.clone();
        let words = self.read_blocks(Class::Background, &blocks).await?;
        let see = &self.profile.file().see;
        let of = |name: Option<&crate::format::Spanned<String>>, unit| {
            self.profile.hundredths(&words, name?.get_ref(), unit)
        };
        let volts =
            |name| of(name, UnitName::Volt).and_then(|hundredths| u32::try_from(hundredths / 10).ok());
        let rpm = of(see.speed.given(), UnitName::Rpm)
            .and_then(|hundredths| u32::try_from(hundredths.abs() / 100).ok());
        let reference = see.setpoint.given().and_then(|name| self.frequency(&words, name.get_ref()));
        Ok(Measurements {
            at: self.registers.snapshot_time(),
            reference: reference.map(Into::into),
            speed: rpm.map(Speed::from_rpm),
            output_voltage: volts(see.output_voltage.given()).map(Voltage::from_decivolts),
            dc_bus_voltage: volts(see.dc_bus_voltage.given()).map(Voltage::from_decivolts),
            raw: self.raw(&words),
            ..Measurements::default()
        })
    }

    /// The present fault; its history is not read.
    pub(super) async fn read_faults(&mut self) -> Result<Faults> {
        let (status, _) = self.read_status(Class::Background).await?;
        let table = self.profile.fault_entries();
        let present = status.fault_code.map(|code| Fault::lookup(table, code));
        Ok(Faults { present: present.into_iter().collect(), ..Faults::default() })
    }
}

fn see_code(profile: &crate::profile::Profile, words: &Words) -> Option<u16> {
    profile.word(words, profile.file().faults.present.given()?.get_ref())
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
