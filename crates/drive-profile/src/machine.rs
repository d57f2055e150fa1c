//! A simulated drive from a profile: it does what the profile says, so that it proves that the profile agrees with itself, and not that it
//! is true.

mod bits;

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use drive_core::{Direction, Frequency, State, registers::Place};
use drive_sim::{
    Act, Cast, Exception, Model, Motor, Nameplate, Observation, Panel, Ramp, Ramps, Rules, Surroundings,
};

use self::bits::Places;
use crate::{
    drive::Words,
    format::{Access, Acts, Bits, Guard, Order, Register, Space, UnitName},
    profile::Profile,
    scale::{counts, hundredths},
    written::Written,
};

/// What 100 % is on a simulated drive that counts in percent: its owner is to say so.
pub const FULL_SCALE: Frequency = Frequency::from_hertz(50);

/// Both ramps, measured to 50 Hz.
const RAMP: Ramp = Ramp { full_scale: 5_000, time: Duration::from_secs(3) };
/// The short ramp.
const FAST: Ramp = Ramp { full_scale: 5_000, time: Duration::from_secs(1) };

/// What the code of a trip is on a drive that tells none.
const NO_CODE: u16 = 1;

/// Registers, coils and inputs by their places.
type Cells = BTreeMap<(Space, u16), u16>;

/// A drive of a profile as somebody beside it sees it.
#[derive(Debug, Clone)]
pub struct Machine {
    profile: Arc<Profile>,
    rules: Rules,
    surroundings: &'static Surroundings,
    /// What was written, by its place.
    kept: Cells,
    /// The bits that the profile names of what commands it: another does nothing, whoever sets it.
    named: Arc<Cells>,
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
    /// One that the bus commands. What is around it lives as long as the program: clone one rather than make several.
    #[must_use]
    pub fn new(profile: Arc<Profile>) -> Self {
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
        Self {
            rules,
            surroundings: Box::leak(Box::new(around)),
            kept: BTreeMap::new(),
            named: Arc::new(named(&profile)),
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
        }
    }

    /// One that its panel commands.
    #[must_use]
    pub fn at_the_panel(mut self) -> Self {
        self.local = true;
        self
    }

    /// The register of a place: also where it is the second of two words.
    fn register(&self, (space, address): (Space, u16)) -> Option<&Register> {
        let file = self.profile.file();
        let has = |register: &&Register| {
            let Some((of, first)) = file.place(register) else { return false };
            let second = if crate::drive::is_double(register) { first.checked_add(1) } else { None };
            of == space && (first == address || second == Some(address))
        };
        file.register.values().map(crate::format::Spanned::get_ref).find(has)
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
        let held = file.place(register).and_then(|place| self.kept.get(&place)).copied().unwrap_or(0);
        // A drive whose setpoint is its run command turns round by its sign; the run command says so already.
        let counts = if register.signed { i64::from(held.cast_signed()).abs() } else { held.into() };
        self.hertz(register).map_or(0, |[numerator, denominator]| hundredths(counts, numerator, denominator))
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

    /// A word as it is taken: without the bits of a command that the profile does not name.
    fn heard(&self, written: Written) -> Written {
        let named = self.named.get(&(written.space, written.address)).copied().unwrap_or(u16::MAX);
        Written { value: written.value & named, ..written }
    }

    /// What a word does that was written.
    fn obey(&mut self, written: Written) {
        let written = self.heard(written);
        let profile = self.profile.clone();
        let file = profile.file();
        let writes = |action: &crate::format::Answer<crate::format::Spanned<crate::format::Action>>| {
            action.given().map(|action| file.writes(action.get_ref())).unwrap_or_default()
        };
        // The last write of a start starts it, where what else it writes stands by now: a direction of its own.
        let ends = |start| {
            let mut all = writes(start);
            let by_setpoint = start.given().is_some_and(|start| start.get_ref().starts_by_setpoint());
            // Whatever setpoint it is, with the sign of this start.
            if let Some(last) = all.last_mut().filter(|last| by_setpoint && alike(**last, written)) {
                *last = written;
            }
            all.last() == Some(&written) && all.iter().all(|of| self.stands(&all, *of))
        };
        // Of several coils that stop together each has to stand so.
        let stops = |stop| {
            let all = writes(stop);
            all.contains(&written) && all.iter().all(|of| self.stands(&all, *of))
        };
        if ends(&file.start.forward) {
            self.order = Some(Direction::Forward);
        } else if ends(&file.start.reverse) {
            self.order = Some(Direction::Reverse);
        } else if stops(&file.stop.freewheel) {
            self.order = None;
            self.motor.freewheel();
        } else if stops(&file.stop.fast) {
            (self.order, self.ramp) = (None, FAST);
        } else if stops(&file.stop.ramp) {
            (self.order, self.ramp) = (None, RAMP);
        } else if writes(&file.reset).contains(&written) || self.has_reset_bit(written) {
            (self.order, self.fault) = (None, None);
        } else if self.order.is_some()
            && file.command.given().is_some_and(|of| of.get_ref().acts == Acts::Level)
        {
            // A direction of its own acts at once on a motor that runs by a level.
            let stands = |start| {
                let all = writes(start);
                let is_its = all.iter().any(|of| (of.space, of.address) == (written.space, written.address));
                is_its && all.iter().all(|of| self.stands(&all, *of))
            };
            if stands(&file.start.forward) {
                self.order = Some(Direction::Forward);
            } else if stands(&file.start.reverse) {
                self.order = Some(Direction::Reverse);
            } else if self.run_word_ends(written) {
                (self.order, self.ramp) = (None, RAMP);
            }
        }
        // A run command that comes to a drive that has tripped or has no supply is lost.
        if self.fault.is_some() || !self.supplied || self.local {
            self.order = None;
        }
    }

    /// Whether a word of a command of bits has the bit that rises in a reset, whatever else it has: a direction, say.
    fn has_reset_bit(&self, written: Written) -> bool {
        let rises = self.profile.file().reset_bits();
        let at_place = |of: &&Written| (of.space, of.address) == (written.space, written.address);
        rises.iter().find(at_place).is_some_and(|rise| written.value & rise.value == rise.value)
    }

    /// Whether a word takes the place of the run word that stands, and is none.
    fn run_word_ends(&self, written: Written) -> bool {
        let file = self.profile.file();
        let start = self.order.and_then(|direction| self.profile.start(direction));
        let runs = start.into_iter().flat_map(|start| file.writes(start)).filter(|of| file.runs(*of));
        let is_its = runs.into_iter().any(|of| (of.space, of.address) == (written.space, written.address));
        is_its && !file.runs(written)
    }

    /// Whether what an action leaves at a place stands there.
    fn stands(&self, action: &[Written], of: Written) -> bool {
        let place = (of.space, of.address);
        let left = action.iter().rev().find(|other| (other.space, other.address) == place);
        // What nobody has written is 0.
        let held = self.kept.get(&place).copied().unwrap_or(0);
        left.is_none_or(|left| self.heard(Written { value: held, ..of }).value == left.value)
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
    fn shown(&self) -> Cells {
        let file = self.profile.file();
        let mut words = self.kept.clone();
        let output = self.motor.output_frequency();
        let see = &file.see;
        for guard in
            [&file.who.guards, &file.who.fingerprints].into_iter().filter_map(|all| all.given()).flatten()
        {
            // A setting that somebody has changed is what he has made it: the guard holds no more.
            let place =
                file.named(guard.get_ref().register.get_ref()).and_then(|register| file.place(register));
            if place.is_none_or(|place| !self.kept.contains_key(&place)) {
                self.fulfil(&mut words, guard.get_ref());
            }
        }
        for name in self.limits() {
            if !file
                .named(name)
                .and_then(|register| file.place(register))
                .is_some_and(|place| words.contains_key(&place))
            {
                self.put(&mut words, name, FULL_SCALE.centihertz().into());
            }
        }
        // The register that takes the setpoint holds it as it was written, with its sign.
        let taken = file.setpoint.given().map(|setpoint| setpoint.get_ref().register.get_ref());
        let other = |name: &&crate::format::Spanned<String>| self.local || Some(name.get_ref()) != taken;
        for (name, value) in [
            (see.output.given(), i64::from(output)),
            (
                see.setpoint.given().filter(other),
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
        if let Some(stands) = file.state.standstill.given() {
            self.set(&mut words, stands.get_ref(), self.motor.shaft_frequency() == 0);
        }
        for owner in
            [&file.ownership.command, &file.ownership.reference].into_iter().filter_map(|owner| owner.given())
        {
            self.set(&mut words, &owner.get_ref().bits, !self.local);
        }
        self.show_state(words, output)
    }

    /// How many hertz are one count of a register, as a fraction.
    fn hertz(&self, register: &Register) -> Option<[i64; 2]> {
        let [numerator, denominator] = *register.scale.as_ref()?.get_ref();
        match register.unit {
            UnitName::Hertz => Some([numerator, denominator]),
            UnitName::Percent => Some([numerator * self.full_scale(), denominator * 10_000]),
            _ => None,
        }
    }

    /// What 100 % is, in hundredths of a hertz: what somebody has set beside the line, where a register holds it.
    fn full_scale(&self) -> i64 {
        let file = self.profile.file();
        let set = || {
            let register = file.named(file.full_scale()?)?;
            let held = self.kept.get(&file.place(register)?)?;
            let [numerator, denominator] = *register.scale.as_ref()?.get_ref();
            Some(hundredths((*held).into(), numerator, denominator))
        };
        set().unwrap_or_else(|| FULL_SCALE.centihertz().into())
    }

    /// The registers that hold how fast it may turn.
    fn limits(&self) -> impl Iterator<Item = &str> {
        let setpoint = self.profile.file().setpoint.given().map(crate::format::Spanned::get_ref);
        let named = setpoint.into_iter().flat_map(|of| [&of.limits.get_ref().high_in, &of.full_scale]);
        named.flatten().map(|name| name.get_ref().as_str()).filter(|name| *name != "owner")
    }

    /// The same with the bits of its state: those by which the profile reads that state, and as many of what a start waits for as
    /// say no other.
    fn show_state(&self, words: Cells, output: i32) -> Cells {
        let file = self.profile.file();
        let state = self.state();
        let is_it = |words: &Cells| self.told(words) == state;
        let mut best = words.clone();
        // Each register that tells it: those who read another than the profile does are told the same.
        let mut telling: Vec<&str> = Vec::new();
        for row in
            file.state.is.iter().map(crate::format::Spanned::get_ref).filter(|is| is.state.state() == state)
        {
            let bits = row.bits.get_ref();
            if telling.contains(&bits.register.get_ref().as_str()) {
                continue;
            }
            let mut tried = best.clone();
            self.set(&mut tried, bits, true);
            if state == State::Running || output != 0 {
                self.show_direction(&mut tried, output);
            }
            if is_it(&tried) {
                best = tried;
                telling.push(bits.register.get_ref());
            }
        }
        if !is_it(&best) {
            best = self.told_by_no_other(&best, state).unwrap_or(best);
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

    /// The same with the bits of a state whose row stands behind those of others that fit as well, as one does for which nothing is
    /// set: one bit of theirs is changed. `None`: no one bit does it.
    fn told_by_no_other(&self, words: &Cells, state: State) -> Option<Cells> {
        let rows = || self.profile.file().state.is.iter().map(crate::format::Spanned::get_ref);
        let (its, others): (Vec<_>, Vec<_>) = rows().partition(|row| row.state.state() == state);
        its.into_iter().find_map(|row| {
            let mut set = words.clone();
            self.set(&mut set, row.bits.get_ref(), true);
            others.iter().find_map(|other| {
                let bits = other.bits.get_ref();
                let register = bits.register.get_ref();
                (0..u16::BITS).map(|at| bits.mask.get_ref() & 1 << at).filter(|bit| *bit != 0).find_map(
                    |bit| {
                        let mut tried = set.clone();
                        self.put_word(&mut tried, register, bit, !bits.value & bit);
                        (self.told(&tried) == state).then_some(tried)
                    },
                )
            })
        })
    }

    fn show_direction(&self, words: &mut Cells, output: i32) {
        let Some(direction) = self.profile.file().see.direction.given().map(crate::format::Spanned::get_ref)
        else {
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
    fn told(&self, words: &Cells) -> State {
        let mut read = Words::default();
        for (&(space, first), &word) in words {
            read.keep(crate::drive::Block { space, first, count: 1 }, [word]);
        }
        let states = self.profile.file().state.is.iter().map(crate::format::Spanned::get_ref);
        // What was never set holds 0.
        let fits = |bits: &Bits| self.profile.fits(&read, bits).unwrap_or(bits.fit(0));
        states.into_iter().find(|is| fits(is.bits.get_ref())).map_or(State::Unknown, |is| is.state.state())
    }

    fn fulfil(&self, words: &mut Cells, guard: &Guard) {
        let free = |is_not: &Vec<u16>| (0..=u16::MAX).find(|word| !is_not.contains(word));
        let word = guard
            .is
            .as_ref()
            .and_then(|is| is.first().copied())
            .or_else(|| guard.is_not.as_ref().and_then(free));
        self.put_word(words, guard.register.get_ref(), guard.mask.unwrap_or(u16::MAX), word.unwrap_or(0));
    }

    fn set(&self, words: &mut Cells, bits: &Bits, fit: bool) {
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
    fn put(&self, words: &mut Cells, name: &str, value: i64) {
        let Some(register) = self.profile.file().named(name) else { return };
        let scale = match register.unit {
            UnitName::Ampere => register.scale.as_ref().map(|scale| *scale.get_ref()),
            _ => self.hertz(register),
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
        if crate::drive::is_double(register) {
            self.put_double(words, name, u32::try_from(count.unsigned_abs()).unwrap_or(u32::MAX), count < 0);
            return;
        }
        let word = if register.signed {
            i16::try_from(count).unwrap_or(i16::MAX).cast_unsigned()
        } else {
            u16::try_from(count).unwrap_or(u16::MAX)
        };
        self.put_word(words, name, u16::MAX, word);
    }

    /// Puts a number into a register of two words.
    fn put_double(&self, words: &mut Cells, name: &str, count: u32, is_negative: bool) {
        let file = self.profile.file();
        let Some(register) = file.named(name) else { return };
        let Some((space, first)) = file.place(register) else { return };
        let count = if is_negative { count.wrapping_neg() } else { count };
        let [a, b, c, d] = count.to_be_bytes();
        let (high, low) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
        let pair = if register.order == Some(Order::HighFirst) { [high, low] } else { [low, high] };
        for (at, word) in (first..=first.saturating_add(1)).zip(pair) {
            words.insert((space, at), word);
        }
    }

    /// Puts bits into a register, or into the byte that it is.
    fn put_word(&self, words: &mut Cells, name: &str, mask: u16, value: u16) {
        let file = self.profile.file();
        let Some(register) = file.named(name) else { return };
        let Some(place) = file.place(register) else { return };
        let (mask, value) = match register.byte {
            None => (mask, value),
            Some(crate::format::Byte::Low) => (mask & 0xFF, value & 0xFF),
            Some(crate::format::Byte::High) => ((mask & 0xFF) << 8, (value & 0xFF) << 8),
        };
        let word = words.entry(place).or_insert(0);
        *word = *word & !mask | value & mask;
    }
}

/// The bits that a profile names of each place at which its drive is commanded.
fn named(profile: &Profile) -> Cells {
    let file = profile.file();
    let runs = file.command.given().into_iter().flat_map(|command| &command.get_ref().runs);
    let mut named: Cells = BTreeMap::new();
    for run in runs.map(crate::format::Spanned::get_ref) {
        let place = file.named(run.register.get_ref()).and_then(|register| file.place(register));
        named.extend(
            place.map(|place| (place, named.get(&place).copied().unwrap_or(0) | *run.mask.get_ref())),
        );
    }
    let rungs = file.start.ladder.given().into_iter().flatten().map(crate::format::Spanned::get_ref);
    let rungs = rungs.filter_map(|rung| {
        let (space, address) = file.place(file.named(rung.register.as_ref()?.get_ref())?)?;
        Some(Written { space, address, value: rung.word? })
    });
    for written in file.actions().flat_map(|(_, action)| file.writes(action.get_ref())).chain(rungs) {
        // Where no bit of a register runs the motor, the whole word counts.
        if let Some(bits) = named.get_mut(&(written.space, written.address)) {
            *bits |= written.value;
        }
    }
    named
}

/// Whether two words for one place have one sign, and neither is 0.
fn alike(one: Written, other: Written) -> bool {
    let sign = |of: Written| of.value.cast_signed().signum();
    (one.space, one.address, sign(one)) == (other.space, other.address, sign(other)) && one.value != 0
}

impl Places for Machine {
    fn has_function(&self, function: u8) -> bool {
        self.profile.capabilities().functions.contains(&function)
    }

    fn most_bits(&self) -> (u16, u16) {
        let link = self.profile.file().link.get_ref();
        let most = |limit: &crate::format::Answer<u16>| limit.given().copied().unwrap_or(1);
        (most(&link.read_coils), most(&link.write_coils))
    }

    fn most_words(&self) -> u16 {
        self.profile.capabilities().read_words
    }

    fn most_written(&self) -> u16 {
        self.profile.capabilities().write_words
    }

    fn read_at(&self, place: (Space, u16)) -> Result<u16, Exception> {
        let readable = self.register(place).is_some_and(|register| register.access != Access::Write);
        if readable {
            Ok(self.shown().get(&place).copied().unwrap_or(0))
        } else {
            Err(Exception::ILLEGAL_ADDRESS)
        }
    }

    fn takes(&self, place: (Space, u16)) -> Result<(), Exception> {
        match self.register(place).map(|register| register.access) {
            None | Some(Access::Read) => Err(Exception::ILLEGAL_ADDRESS),
            Some(Access::WriteStopped) if self.motor.is_fed() => Err(Exception::FAILURE),
            Some(_) => Ok(()),
        }
    }

    fn write_at(&mut self, written: Written) -> Result<(), Exception> {
        self.takes((written.space, written.address))?;
        self.kept.insert((written.space, written.address), written.value);
        self.obey(written);
        self.steer();
        Ok(())
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
        self.read_at((Space::HoldingRegister, address))
    }

    fn write(&mut self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
        self.check_word(address, value, cast)?;
        self.write_at(Written { space: Space::HoldingRegister, address, value })
    }

    fn check_word(&self, address: u16, _: u16, _: Cast) -> Result<(), Exception> {
        self.takes((Space::HoldingRegister, address))
    }

    /// Coils, inputs, and the registers that only read: the functions beside those of holding registers.
    fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
        bits::answer(self, request)
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
        self.peek_at(address.into())
    }

    fn poke(&mut self, address: u16, value: u16) -> bool {
        self.poke_at(address.into(), value)
    }

    fn peek_at(&self, Place { space, address }: Place) -> Option<u16> {
        self.register((space, address))?;
        Some(self.shown().get(&(space, address)).copied().unwrap_or(0))
    }

    /// What is only read is what something beside the drive makes it, an input or a temperature, unless the twin itself says what stands there.
    fn poke_at(&mut self, Place { space, address }: Place, value: u16) -> bool {
        let place = (space, address);
        let Some(access) = self.register(place).map(|register| register.access) else { return false };
        if space.is_bit() && value > 1 {
            return false;
        }
        let before = self.kept.insert(place, value);
        if access == Access::Read && self.shown().get(&place) != Some(&value) {
            match before {
                Some(before) => self.kept.insert(place, before),
                None => self.kept.remove(&place),
            };
            return false;
        }
        self.steer();
        true
    }
}
