//! The setpoint.

use drive_core::{
    Class, Command as Order, Confirming, Control, Error, ErrorKind, Frequency, Lease, Port, Refusal, Result,
    SETTLED_WITHIN, Setpoint, SetpointProblem, Speed, State, Status, Verdict,
};

use tokio::time::Instant;

use super::{ProfileDrive, Words, falling::has_fallen, reading::OTHERS};
use crate::{
    format::{Access, Register, Setpoint as Fact, Sign, UnitName},
    ladder::Level,
    scale::{counts, hundredths},
};

const KEPT: Refusal = Refusal::OnlyAStartShows(
    "its setpoint is its run command, so that nothing was written: the next start gives it",
);
const READS_BACK: Refusal = Refusal::OnlyAStartShows(
    "its register reads back as it was written, and the drive does not tell whose setpoint it goes by: start it, and see its output",
);
const NOT_SHOWN: Refusal = Refusal::OnlyAStartShows(
    "it was written, and its profile has no register that holds the setpoint in force: start it, and see its output",
);
const HELD_BACK: Refusal = Refusal::Settings(
    "its setpoint is its run command, and the motor does not run by the one that was given: stop it, then start it",
);

const NEGATIVE: Refusal = Refusal::Settings(
    "the setpoint that stands in it is negative and turns its motor the other way: stop the motor, and give a setpoint before the start",
);
const TOO_HIGH: Refusal = Refusal::Settings(
    "the setpoint that stands in it is above what may be given to it: give one before the start",
);

const ANOTHER: Refusal = Refusal::Settings(
    "the setpoint that stands in it is not the one that was given to it: another master has written it, or a power cut has taken it: give \
     one before the start",
);

/// What a setpoint may differ by in the register that takes it and in the one that shows it, in hundredths of a hertz.
const STEP: u64 = 10;

const NO_FULL_SCALE: Refusal = Refusal::Settings(
    "the drive counts in percent of a frequency that it does not tell: say it by full-scale, or give a setpoint in percent",
);
const NO_HIGHEST: Refusal =
    Refusal::Settings("the drive does not tell how fast it may turn: say it by highest");
const NOT_FOLLOWED: Refusal = Refusal::Overridden {
    by: "something that the drive does not tell: its motor runs, and its output was not seen to go to this setpoint; another setpoint, perhaps,",
    remedy: "see whose reference the drive goes by",
};

impl<P: Port> ProfileDrive<P> {
    pub(super) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let order = Order::Setpoint(setpoint);
        self.allow(Level::Motion, "a setpoint")?;
        let profile = self.profile.clone();
        let Some(fact) = profile.file().setpoint.given().map(crate::format::Spanned::get_ref) else {
            return Err(Error::Unsupported { what: "a setpoint", reason: "its profile has none" });
        };
        let Some(register) = profile.file().named(fact.register.get_ref()) else {
            return Err(Error::Unsupported { what: "a setpoint", reason: "its profile has none" });
        };
        self.takes(register, setpoint)?;
        let (status, words) = self.read_status(Class::Command).await?;
        // Somebody may have set it up otherwise since.
        self.forget_guards();
        self.guard(order).await?;
        if status.control == Some(Control::Local) {
            return Err(self.refused(order, OTHERS));
        }
        let held = self.limits(fact).await?;
        let counts = self.setpoint_counts(fact, register, setpoint, &held)?;
        if profile.file().starts_by_setpoint() {
            return self.give_run_command(setpoint, counts, status).await;
        }
        let word = Sign::Positive.word(counts);
        let Some((_, address)) = profile.file().place(register) else { return Ok(()) };
        // A start that nobody waited for to its end rests on what stands.
        let stands = self.setpoint_seen(&words);
        let before = self.agree(setpoint);
        self.agreed_before = before.or(stands);
        match self.registers.at(Class::Command).replacing(address).write_word(address, word).await {
            Err(error) if error.kind() == ErrorKind::NotSent => {
                self.agreed = before;
                return Err(error);
            }
            written => written.map_err(|error| self.explained(error))?,
        }
        self.registers.owe_judgement();
        self.see_setpoint(setpoint, word).await.map_err(Error::after_write)
    }

    /// What a start rests on from here on, whatever becomes of the write: another setpoint in its place is not this side's, but the one on
    /// which it rested before, as long as the drive has not shown that it took this one. Gives that.
    fn agree(&mut self, setpoint: Setpoint) -> Option<i64> {
        let shows = self.profile.file().see.setpoint.given().is_some();
        let agreed = match setpoint {
            Setpoint::Frequency(frequency) if shows => Some(frequency.centihertz().into()),
            _ => None,
        };
        self.agreed_before = std::mem::replace(&mut self.agreed, agreed);
        self.agreed_before
    }

    /// The setpoint of a drive whose run command it is. It is kept for the next start, and goes only to a motor that runs by this side's.
    async fn give_run_command(&mut self, setpoint: Setpoint, counts: i32, status: Status) -> Result<()> {
        let order = Order::Setpoint(setpoint);
        let before = (self.agreed, self.kept);
        let Some(lease) = self.watch.run.lease() else {
            self.agree(setpoint);
            self.kept = Some(counts);
            return Err(self.not_confirmed(order, status, Some(KEPT)));
        };
        let lacks = matches!(status.verdict, None | Some(Verdict::NotInForce { .. }));
        if lacks || status.state != State::Running {
            return Err(self.refused(order, HELD_BACK));
        }
        let profile = self.profile.clone();
        let Some(start) = profile.start(lease.direction) else { return Err(self.refused(order, HELD_BACK)) };
        let word = profile.file().run_word(start, Some(counts)).unwrap_or(0);
        let Some(step) = start.steps.last() else { return Err(self.refused(order, HELD_BACK)) };
        self.agree(setpoint);
        self.kept = Some(counts);
        self.watch.run.give(Lease::new(lease.direction, word));
        let sent = self.step(step.get_ref(), Class::Command, order).await;
        self.registers.owe_judgement();
        match sent {
            Ok(()) => self.watch.run.was_written(),
            Err(error) if error.kind() == ErrorKind::NotSent => {
                self.watch.run.was_not_written();
                (self.agreed, self.kept) = before;
                return Err(error);
            }
            Err(error) => return Err(error.after_write()),
        }
        self.see_setpoint(setpoint, word).await.map_err(Error::after_write)
    }

    /// Why the setpoint that stands in the drive, by whomever it was given, is none to start by: a sign would turn the motor the other
    /// way, whichever is commanded, and what is beyond the limits would be refused to whoever gave it. And what it is, where another
    /// register shows the one in force.
    pub(super) async fn standing(&mut self, seen: &Words) -> Result<(Option<Refusal>, Option<i64>)> {
        let profile = self.profile.clone();
        let file = profile.file();
        let Some(fact) = file.setpoint.given().map(crate::format::Spanned::get_ref) else {
            return Ok((None, None));
        };
        let name = fact.register.get_ref();
        let Some(register) = file.named(name).filter(|register| register.access != Access::Write) else {
            return Ok((None, None));
        };
        if file.starts_by_setpoint() {
            return Ok((None, None));
        }
        let mut words = self.limits(fact).await?;
        for block in profile.blocks(&[name.as_str()].into()) {
            let read = self.read_block(Class::Command, block).await?;
            words.keep(block, read);
        }
        let Some(cell) = profile.cell(name) else { return Ok((None, None)) };
        let hertz = self.hertz_of(&words, cell);
        // A highest that its owner has not said bounds only what is given.
        let highest = self.highest(fact, register, hertz, &words).map_or(i64::MAX, |(highest, _)| highest);
        let stands = self.frequency(&words, cell).map(|frequency| i64::from(frequency.centihertz()));
        let refusal = cell.counts(&words).and_then(|counts| match counts {
            ..0 => Some(NEGATIVE),
            counts if counts > highest => Some(TOO_HIGH),
            _ => stands.filter(|stands| self.was_given_otherwise(seen, *stands)).map(|_| ANOTHER),
        });
        let another_shows = file.see.setpoint.given().is_some_and(|seen| seen.get_ref() != name);
        Ok((refusal, stands.filter(|_| another_shows)))
    }

    /// Whether a setpoint that was given since the last stop is not the one that stands: its register, and the one by which it was seen,
    /// may count in steps of their own.
    fn was_given_otherwise(&self, seen: &Words, stands: i64) -> bool {
        let is_a_frequency = self.sight.setpoint.is_some_and(|cell| self.frequency(seen, cell).is_some());
        self.agreed.is_some_and(|agreed| is_a_frequency && agreed.abs_diff(stands) > STEP)
    }

    fn takes(&self, register: &Register, setpoint: Setpoint) -> Result<()> {
        let takes = match setpoint {
            Setpoint::Frequency(_) => matches!(register.unit, UnitName::Hertz | UnitName::Percent),
            Setpoint::Share(_) => register.unit == UnitName::Percent,
            Setpoint::Speed(_) => register.unit == UnitName::Rpm,
        };
        match setpoint {
            _ if register.decimals_in.is_some() || super::is_double(register) => Err(Error::Unsupported {
                what: "a setpoint",
                reason: "its register has two words, or another says how many decimals it has",
            }),
            _ if takes => Ok(()),
            Setpoint::Share(_) => Err(Error::no_share()),
            _ => Err(Error::Unsupported {
                what: "a setpoint in this unit",
                reason: "the drive counts in another",
            }),
        }
    }

    /// The registers that hold limits and full scale, where the drive has them.
    async fn limits(&mut self, fact: &Fact) -> Result<Words> {
        let profile = self.profile.clone();
        let named = [&fact.limits.get_ref().high_in, &fact.full_scale].into_iter().flatten();
        let names = named.map(|name| name.get_ref().as_str()).filter(|name| *name != "owner").collect();
        let blocks = profile.blocks(&names);
        let mut words = Words::default();
        for block in blocks {
            let read = self.read_block(Class::Command, block).await?;
            words.keep(block, read);
        }
        Ok(words)
    }

    /// The counts that stand for a setpoint: exactly, and within what the drive, its profile and its owner allow.
    fn setpoint_counts(
        &self,
        fact: &Fact,
        register: &Register,
        setpoint: Setpoint,
        held: &Words,
    ) -> Result<i32> {
        let slave = self.registers.slave();
        let problem = |problem| Error::Setpoint { slave, setpoint, problem };
        let refused = |reason| self.refused(Order::Setpoint(setpoint), reason);
        let hertz = self.profile.cell(fact.register.get_ref()).and_then(|cell| self.hertz_of(held, cell));
        let (value, scale) = match setpoint {
            Setpoint::Frequency(frequency) => {
                (i64::from(frequency.centihertz()), hertz.ok_or_else(|| refused(NO_FULL_SCALE))?)
            }
            Setpoint::Share(share) => (i64::from(share.hundredths()), self.scale(register)?),
            Setpoint::Speed(speed) => (i64::from(speed.rpm()) * 100, self.scale(register)?),
        };
        let step = self.registers.capabilities().frequency_step;
        let count =
            counts(value, scale[0], scale[1]).ok_or_else(|| problem(SetpointProblem::Resolution(step)))?;
        let limits = fact.limits.get_ref();
        let (high, owners) = self.highest(fact, register, hertz, held).ok_or_else(|| refused(NO_HIGHEST))?;
        if !(i64::from(limits.low)..=high).contains(&count) {
            let (outside, is_above) = (self.outside(limits.low.into(), high, scale, setpoint), count > high);
            return Err(problem(match outside {
                // What somebody has said of a drive is no word of the drive's.
                SetpointProblem::OutsideFrequencyLimits { low, high } if owners && is_above => {
                    SetpointProblem::OutsideOwnersLimits { low, high }
                }
                outside => outside,
            }));
        }
        let highest = if register.signed { i16::MAX.cast_unsigned() } else { u16::MAX };
        let fits = u16::try_from(count).ok().filter(|count| *count <= highest);
        fits.map(i32::from).ok_or_else(|| problem(SetpointProblem::TooLarge))
    }

    /// The highest setpoint in counts, and whether its owner's word decides it, also by what 100 % is; `None`: nobody has said it.
    fn highest(
        &self,
        fact: &Fact,
        register: &Register,
        hertz: Option<[i64; 2]>,
        held: &Words,
    ) -> Option<(i64, bool)> {
        let limits = fact.limits.get_ref();
        let high = i64::from(limits.high);
        let full_scale_is_owners = fact.full_scale.as_ref().is_some_and(|name| name.get_ref() == "owner");
        let Some(name) = &limits.high_in else { return Some((high, full_scale_is_owners)) };
        let owners = self.owner.highest.zip(hertz).map(|(highest, [numerator, denominator])| {
            i64::from(highest.centihertz()).saturating_mul(denominator) / numerator.saturating_mul(100)
        });
        let drives = match name.get_ref().as_str() {
            "owner" => owners?,
            name => self.allowed(register, name, held)?,
        };
        // What its owner has said as well holds where it is less.
        let allowed = owners.map_or(drives, |owners| owners.min(drives));
        let is_owners = owners == Some(allowed) && (name.get_ref() == "owner" || allowed < drives);
        Some((high.min(allowed), full_scale_is_owners || is_owners && allowed < high))
    }

    fn scale(&self, register: &Register) -> Result<[i64; 2]> {
        let none = Error::Unsupported { what: "a setpoint", reason: "its register has no scale" };
        register.scale.as_ref().map(|scale| *scale.get_ref()).ok_or(none)
    }

    /// What a register allows, in counts of the setpoint's.
    fn allowed(&self, register: &Register, name: &str, held: &Words) -> Option<i64> {
        let highest = self.profile.cell(name)?.hundredths(held, register.unit)?;
        let [numerator, denominator] = *register.scale.as_ref()?.get_ref();
        highest.checked_mul(denominator).map(|counts| counts / numerator.saturating_mul(100))
    }

    fn outside(
        &self,
        low: i64,
        high: i64,
        [numerator, denominator]: [i64; 2],
        setpoint: Setpoint,
    ) -> SetpointProblem {
        let worth = |counts: i64| {
            u32::try_from(hundredths(counts, numerator, denominator).max(0)).unwrap_or(u32::MAX)
        };
        match setpoint {
            Setpoint::Frequency(_) => SetpointProblem::OutsideFrequencyLimits {
                low: Frequency::from_centihertz(worth(low)),
                high: Frequency::from_centihertz(worth(high)),
            },
            Setpoint::Speed(_) => SetpointProblem::OutsideSpeedLimits {
                low: Speed::from_rpm(worth(low) / 100),
                high: Speed::from_rpm(worth(high) / 100),
            },
            Setpoint::Share(_) => SetpointProblem::TooLarge,
        }
    }

    /// It is in force where another register than its own shows it, or where its own holds it and the drive tells that its reference is the
    /// bus's. Else a motor that runs has to bear it out, for many a drive echoes what it does not go by; while none runs only a start shows
    /// it, and that is said.
    async fn see_setpoint(&mut self, setpoint: Setpoint, word: u16) -> Result<()> {
        let order = Order::Setpoint(setpoint);
        let profile = self.profile.clone();
        let file = profile.file();
        let taken = file.setpoint.given().map(|fact| fact.get_ref().register.get_ref());
        let seen = file.see.setpoint.given().map(crate::format::Spanned::get_ref);
        let is_echo = seen.is_none() || seen == taken && !file.starts_by_setpoint();
        let (mut confirming, settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        let mut first = None;
        loop {
            let (status, words) = match self.read_status(Class::Command).await {
                Ok(read) => read,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            let others = self.commanded_by_other(&words);
            let held = match (setpoint, seen) {
                (_, None) => true,
                (Setpoint::Frequency(frequency), _) => status.reference == Some(frequency),
                (_, Some(name)) => profile.word(&words, name) == Some(word),
            };
            let asked = if let Setpoint::Frequency(frequency) = setpoint {
                Some(frequency)
            } else {
                status.reference
            };
            let is_bus = seen.is_some() && self.reference_is_ours(&words);
            let runs = status.state == State::Running;
            let is_borne_out = if runs {
                !is_echo
                    || follows(&status, asked, first)
                        .unwrap_or_else(|| status.at_reference == Some(true) && Instant::now() >= settled)
            } else {
                !is_echo || is_bus
            };
            first = first.or(status.output_frequency);
            if held && is_borne_out && others.is_none() {
                (self.agreed, self.agreed_before) = (self.setpoint_seen(&words), None);
                return Ok(());
            }
            let only_a_start = held && !runs && others.is_none();
            if only_a_start || !confirming.again().await {
                let unseen = match seen {
                    _ if !held || is_borne_out => None,
                    _ if runs => Some(NOT_FOLLOWED),
                    Some(_) => Some(READS_BACK),
                    None => Some(NOT_SHOWN),
                };
                return Err(self.not_confirmed(order, status, others.or(unseen)));
            }
        }
    }
}

/// Whether an output is at the setpoint, or was seen to go towards it; `None`: the drive does not show both.
fn follows(status: &Status, setpoint: Option<Frequency>, first: Option<Frequency>) -> Option<bool> {
    let (output, setpoint) = (status.output_frequency?, setpoint?);
    let is_there = !has_fallen(output, Some(setpoint)) && !has_fallen(setpoint, Some(output));
    let comes = first.is_some_and(|first| {
        if first > setpoint { has_fallen(output, Some(first)) } else { has_fallen(first, Some(output)) }
    });
    Some(is_there || comes)
}
