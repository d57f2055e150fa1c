//! A simulated drive from a profile: it does what the profile says, so that it proves that the profile agrees with itself, and not that it
//! is true. Of drives whose registers are all holding registers.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use drive_core::{Direction, Frequency, State};
use drive_sim::{
    Act, Cast, Exception, Model, Motor, Nameplate, Observation, Panel, Ramp, Ramps, Rules, Surroundings,
};

use crate::{
    drive::{Words, counts, hundredths},
    format::{Access, Bits, Guard, Register, Space, UnitName},
    profile::{Profile, Written},
};

/// What 100 % is on a simulated drive that counts in percent: its owner is to say so.
pub const FULL_SCALE: Frequency = Frequency::from_hertz(50);

/// Both ramps, measured to 50 Hz.
const RAMP: Ramp = Ramp { full_scale: 5_000, time: Duration::from_secs(3) };
/// The short ramp.
const FAST: Ramp = Ramp { full_scale: 5_000, time: Duration::from_secs(1) };

/// What the code of a trip is on a drive that tells none.
const NO_CODE: u16 = 1;

/// A drive of a profile as somebody beside it sees it.
#[derive(Debug, Clone)]
pub struct Machine {
    profile: Arc<Profile>,
    rules: Rules,
    surroundings: &'static Surroundings,
    /// What was written, by address.
    kept: BTreeMap<u16, u16>,
    motor: Motor,
    /// The run command that is in force.
    order: Option<Direction>,
    ramp: Ramp,
    fault: Option<u16>,
    local: bool,
    panel_runs: bool,
    panel_reference: Frequency,
    powered: bool,
    supplied: bool,
}

impl Machine {
    /// One that the bus commands; `None`: it has coils or inputs, which no simulated drive here has. What is around it lives as long as
    /// the program: clone one rather than make several.
    #[must_use]
    pub fn new(profile: Arc<Profile>) -> Option<Self> {
        let file = profile.file();
        let place = |register: &toml::Spanned<Register>| file.place(register.get_ref());
        if !file
            .register
            .values()
            .all(|register| place(register).is_some_and(|(space, _)| space == Space::HoldingRegister))
        {
            return None;
        }
        let claims = profile.capabilities();
        let rules = Rules {
            read_holding: claims.read_words,
            read_input: 0,
            write_single: claims.functions.contains(&6),
            write_multiple: if claims.functions.contains(&16) { claims.write_words } else { 0 },
            diagnostics: &[],
            event_counter: false,
            broadcast: &[],
            turnaround: Duration::from_millis(4),
        };
        let around = Surroundings {
            family: claims.key,
            trips: profile.fault_entries(),
            rows: claims.rows,
            ..Surroundings::NONE
        };
        Some(Self {
            rules,
            surroundings: Box::leak(Box::new(around)),
            kept: BTreeMap::new(),
            motor: Motor::new(Nameplate {
                nominal_frequency: FULL_SCALE.centihertz(),
                ..Nameplate::light(24)
            }),
            order: None,
            ramp: RAMP,
            fault: None,
            local: false,
            panel_runs: false,
            panel_reference: Frequency::ZERO,
            powered: true,
            supplied: true,
            profile,
        })
    }

    /// One that its panel commands.
    #[must_use]
    pub fn at_the_panel(mut self) -> Self {
        self.local = true;
        self
    }

    fn register(&self, address: u16) -> Option<&Register> {
        let file = self.profile.file();
        let all = file.register.values().map(toml::Spanned::get_ref);
        all.into_iter().find(|register| file.place(register) == Some((Space::HoldingRegister, address)))
    }

    fn ordered(&self) -> Option<Direction> {
        let runs = self.powered && self.supplied && self.fault.is_none();
        let order = if self.local { self.panel_runs.then_some(Direction::Forward) } else { self.order };
        order.filter(|_| runs)
    }

    /// The setpoint of the bus, in hundredths of a hertz.
    fn setpoint(&self) -> i64 {
        let file = self.profile.file();
        let name = file.setpoint.given().map(|setpoint| setpoint.get_ref().register.get_ref());
        let Some(register) = name.and_then(|name| file.named(name)) else { return 0 };
        let held =
            file.place(register).and_then(|(_, address)| self.kept.get(&address)).copied().unwrap_or(0);
        hertz(register).map_or(0, |[numerator, denominator]| hundredths(held.into(), numerator, denominator))
    }

    fn target(&self) -> i32 {
        let counts = if self.local { i64::from(self.panel_reference.centihertz()) } else { self.setpoint() };
        let counts = i32::try_from(counts).unwrap_or(0);
        if self.ordered() == Some(Direction::Reverse) { -counts } else { counts }
    }

    fn steer(&mut self) {
        if !self.powered || !self.supplied || self.fault.is_some() {
            self.motor.freewheel();
        } else if self.ordered().is_some() {
            self.motor.run(self.target(), Ramps { acceleration: RAMP, deceleration: RAMP });
        } else {
            self.motor.ramp_to_rest(self.ramp);
        }
    }

    /// What a word does that was written.
    fn obey(&mut self, written: Written) {
        let profile = self.profile.clone();
        let file = profile.file();
        let writes = |action: &crate::format::Answer<toml::Spanned<crate::format::Action>>| {
            action.given().map(|action| file.writes(action.get_ref())).unwrap_or_default()
        };
        let ends = |start| writes(start).last() == Some(&written);
        if ends(&file.start.forward) {
            self.order = Some(Direction::Forward);
        } else if ends(&file.start.reverse) {
            self.order = Some(Direction::Reverse);
        } else if writes(&file.stop.freewheel).contains(&written) {
            self.order = None;
            self.motor.freewheel();
        } else if writes(&file.stop.fast).contains(&written) {
            (self.order, self.ramp) = (None, FAST);
        } else if writes(&file.stop.ramp).contains(&written) {
            (self.order, self.ramp) = (None, RAMP);
        } else if writes(&file.reset).contains(&written) {
            (self.order, self.fault) = (None, None);
        }
        // A run command that comes to a drive that has tripped or has no supply is lost.
        if self.fault.is_some() || !self.supplied || self.local {
            self.order = None;
        }
    }

    /// The state that it shows.
    fn state(&self) -> State {
        let has =
            |state: State| self.profile.file().state.is.iter().any(|is| is.get_ref().state.state() == state);
        if self.fault.is_some() {
            State::Fault
        } else if !self.supplied {
            State::NotReady
        } else if self.ordered().is_some() {
            State::Running
        } else if self.motor.is_fed() {
            if has(State::Stopping) { State::Stopping } else { State::Running }
        } else if has(State::Ready) {
            State::Ready
        } else {
            State::Disabled
        }
    }

    /// All its registers, as they are read now.
    fn shown(&self) -> BTreeMap<u16, u16> {
        let file = self.profile.file();
        let mut words = self.kept.clone();
        let output = self.motor.output_frequency();
        let see = &file.see;
        for guard in
            [&file.who.guards, &file.who.fingerprints].into_iter().filter_map(|all| all.given()).flatten()
        {
            self.fulfil(&mut words, guard.get_ref());
        }
        for (name, value) in [
            (see.output.given(), i64::from(output)),
            (
                see.setpoint.given(),
                if self.local { i64::from(self.panel_reference.centihertz()) } else { self.setpoint() },
            ),
            (see.current.given(), i64::from(self.motor.current()) * 10),
        ] {
            if let Some(name) = name {
                self.put(&mut words, name.get_ref(), value);
            }
        }
        if let Some(name) = file.faults.present.given() {
            self.put_word(&mut words, name.get_ref(), u16::MAX, self.fault.unwrap_or(0));
        }
        if let Some(at) = see.at_setpoint.given() {
            self.set(&mut words, at.get_ref(), self.ordered().is_some() && self.motor.is_at_target());
        }
        for owner in
            [&file.ownership.command, &file.ownership.reference].into_iter().filter_map(|owner| owner.given())
        {
            self.set(&mut words, &owner.get_ref().bits, !self.local);
        }
        self.show_state(words, output)
    }

    /// The same with the bits of its state: those by which the profile reads that state, and as many of what a start waits for as
    /// say no other.
    fn show_state(&self, words: BTreeMap<u16, u16>, output: i32) -> BTreeMap<u16, u16> {
        let file = self.profile.file();
        let state = self.state();
        let is_it = |words: &BTreeMap<u16, u16>| self.told(words) == state;
        let mut best = words.clone();
        for row in file.state.is.iter().map(toml::Spanned::get_ref).filter(|is| is.state.state() == state) {
            let mut tried = words.clone();
            self.set(&mut tried, row.bits.get_ref(), true);
            if state == State::Running || output != 0 {
                self.show_direction(&mut tried, output);
            }
            if is_it(&tried) {
                best = tried;
                break;
            }
        }
        let starts = [&file.start.forward, &file.start.reverse].into_iter().filter_map(|start| start.given());
        for awaited in
            starts.flat_map(|start| &start.get_ref().steps).filter_map(|step| step.get_ref().awaits.as_ref())
        {
            let mut tried = best.clone();
            self.set(&mut tried, awaited, true);
            if is_it(&tried) {
                best = tried;
            }
        }
        best
    }

    fn show_direction(&self, words: &mut BTreeMap<u16, u16>, output: i32) {
        let Some(direction) = self.profile.file().see.direction.given().map(toml::Spanned::get_ref) else {
            return;
        };
        let name = direction.register.get_ref();
        let reverse = if output == 0 { self.ordered() == Some(Direction::Reverse) } else { output < 0 };
        match (&direction.mask, direction.forward, direction.reverse) {
            (Some(mask), Some(forward), Some(backward)) => {
                self.put_word(words, name, *mask.get_ref(), if reverse { backward } else { forward });
            }
            _ => self.put(words, name, i64::from(output)),
        }
    }

    /// The state that these registers tell, by the profile.
    fn told(&self, words: &BTreeMap<u16, u16>) -> State {
        let mut read = Words::default();
        for (&first, &word) in words {
            read.keep(crate::drive::Block { space: Space::HoldingRegister, first, count: 1 }, [word]);
        }
        let states = self.profile.file().state.is.iter().map(toml::Spanned::get_ref);
        // What was never set holds 0.
        let fits = |bits: &Bits| self.profile.fits(&read, bits).unwrap_or(bits.fit(0));
        states.into_iter().find(|is| fits(is.bits.get_ref())).map_or(State::Unknown, |is| is.state.state())
    }

    fn fulfil(&self, words: &mut BTreeMap<u16, u16>, guard: &Guard) {
        let free = |is_not: &Vec<u16>| (0..=u16::MAX).find(|word| !is_not.contains(word));
        let word = guard
            .is
            .as_ref()
            .and_then(|is| is.first().copied())
            .or_else(|| guard.is_not.as_ref().and_then(free));
        self.put_word(words, guard.register.get_ref(), guard.mask.unwrap_or(u16::MAX), word.unwrap_or(0));
    }

    fn set(&self, words: &mut BTreeMap<u16, u16>, bits: &Bits, fit: bool) {
        let mask = *bits.mask.get_ref();
        let other = bits.value ^ (mask & mask.wrapping_neg());
        self.put_word(
            words,
            bits.register.get_ref(),
            mask,
            if fit != bits.differs { bits.value } else { other },
        );
    }

    /// Puts a value in hundredths of its unit into a register.
    fn put(&self, words: &mut BTreeMap<u16, u16>, name: &str, value: i64) {
        let Some(register) = self.profile.file().named(name) else { return };
        let scale = match register.unit {
            UnitName::Ampere => register.scale.as_ref().map(|scale| *scale.get_ref()),
            _ => hertz(register),
        };
        let Some([numerator, denominator]) = scale else { return };
        let value = if register.signed { value } else { value.abs() };
        // What is less than a count is shown as one: it turns.
        let least = if value == 0 { 0 } else { value.signum() };
        let nearest = counts(value, numerator, denominator).unwrap_or_else(|| {
            i64::try_from(i128::from(value) * i128::from(denominator) / i128::from(100 * numerator))
                .unwrap_or(0)
        });
        let count = if nearest == 0 { least } else { nearest };
        let word = if register.signed {
            i16::try_from(count).unwrap_or(i16::MAX).cast_unsigned()
        } else {
            u16::try_from(count).unwrap_or(u16::MAX)
        };
        self.put_word(words, name, u16::MAX, word);
    }

    /// Puts bits into a register, or into the byte that it is.
    fn put_word(&self, words: &mut BTreeMap<u16, u16>, name: &str, mask: u16, value: u16) {
        let file = self.profile.file();
        let Some(register) = file.named(name) else { return };
        let Some((_, address)) = file.place(register) else { return };
        let (mask, value) = match register.byte {
            None => (mask, value),
            Some(crate::format::Byte::Low) => (mask & 0xFF, value & 0xFF),
            Some(crate::format::Byte::High) => ((mask & 0xFF) << 8, (value & 0xFF) << 8),
        };
        let word = words.entry(address).or_insert(0);
        *word = *word & !mask | value & mask;
    }
}

/// How many hertz are one count of a register, as a fraction.
fn hertz(register: &Register) -> Option<[i64; 2]> {
    let [numerator, denominator] = *register.scale.as_ref()?.get_ref();
    match register.unit {
        UnitName::Hertz => Some([numerator, denominator]),
        UnitName::Percent => Some([numerator * i64::from(FULL_SCALE.centihertz()), denominator * 10_000]),
        _ => None,
    }
}

impl Model for Machine {
    fn rules(&self) -> &Rules {
        &self.rules
    }

    fn surroundings(&self) -> &'static Surroundings {
        self.surroundings
    }

    fn read(&mut self, address: u16) -> Result<u16, Exception> {
        let readable = self.register(address).is_some_and(|register| register.access != Access::Write);
        if readable { Ok(self.peek(address).unwrap_or(0)) } else { Err(Exception::ILLEGAL_ADDRESS) }
    }

    fn write(&mut self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        self.check_word(address, value, cast)?;
        self.kept.insert(address, value);
        self.obey(Written { space: Space::HoldingRegister, address, value });
        self.steer();
        Ok(())
    }

    fn check_word(&self, address: u16, _: u16, _: Cast) -> Result<(), Exception> {
        match self.register(address).map(|register| register.access) {
            None | Some(Access::Read) => Err(Exception::ILLEGAL_ADDRESS),
            Some(Access::WriteStopped) if self.motor.is_fed() => Err(Exception::FAILURE),
            Some(_) => Ok(()),
        }
    }

    fn advance(&mut self, elapsed: Duration) {
        self.motor.advance(elapsed);
    }

    fn power(&mut self, on: bool) {
        self.powered = on;
        self.motor.freewheel();
        if on {
            self.kept.clear();
            (self.order, self.fault, self.panel_runs) = (None, None, false);
            self.steer();
        }
    }

    fn trip(&mut self, code: u16) {
        let tells = self.profile.file().faults.present.given().is_some();
        self.fault = Some(if tells { code } else { NO_CODE });
        (self.order, self.panel_runs) = (None, false);
        self.steer();
    }

    fn set_load(&mut self, percent: u16) {
        self.motor.set_load(percent);
    }

    fn panel(&mut self, action: Panel) {
        match action {
            Panel::TakeControl => (self.local, self.order) = (true, None),
            Panel::ReleaseControl => (self.local, self.panel_runs, self.order) = (false, false, None),
            Panel::Stop => (self.panel_runs, self.order) = (false, None),
            Panel::Run => self.panel_runs = self.local && self.fault.is_none(),
            Panel::Reset => self.fault = None,
            Panel::Reference(frequency) => self.panel_reference = frequency,
        }
        self.steer();
    }

    fn world(&mut self, act: Act) {
        if let Act::MotorSupply(on) = act {
            (self.supplied, self.order) = (on, None);
            self.panel_runs &= on;
            self.steer();
        }
    }

    fn observe(&self) -> Observation {
        Observation {
            running: self.motor.is_fed(),
            output_frequency: self.motor.output_frequency(),
            shaft_frequency: self.motor.shaft_frequency(),
            setpoint: if self.ordered().is_some() { self.target() } else { 0 },
            current: self.motor.current(),
            trip: self.fault,
            local: self.local,
            eeprom_writes: 0,
        }
    }

    fn peek(&self, address: u16) -> Option<u16> {
        self.register(address)?;
        Some(self.shown().get(&address).copied().unwrap_or(0))
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        let writable = self.register(address).is_some_and(|register| register.access != Access::Read);
        if writable {
            self.kept.insert(address, value);
            self.steer();
        }
        writable
    }
}
