//! What the registers of the drive show.

use drive_core::{Direction, State};

use super::{Cells, FULL_SCALE, Machine};
use crate::{
    drive::Words,
    format::{Bits, Guard, Order, Register, UnitName},
    scale::{counts, hundredths},
};

impl Machine {
    /// The state that it shows.
    pub(super) fn state(&self) -> State {
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
    pub(super) fn shown(&self) -> Cells {
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
    pub(super) fn hertz(&self, register: &Register) -> Option<[i64; 2]> {
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
