//! Whether the motor turns: [`Motion`], a claim with its evidence (rule 12), and [`Shaft`], which follows it from status to
//! status.

use std::time::Duration;

use tokio::time::Instant;

use crate::{setpoint::StopMode, units::Frequency};

/// What is known of the shaft. No output is not standstill: a motor whose output was cut coasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Motion {
    /// The drive turns it: a run command acts.
    Driven,
    /// The drive brings it down, along a ramp, a quick stop or by injection.
    Braking,
    /// It stands, and the drive holds it there by direct current.
    Held,
    /// The output was cut while it turned, or was not there at the first look or the first one behind a lost line, and nothing tells
    /// when it has come to rest.
    Coasting,
    /// The drive brought it down to no output, or watches the shaft itself and says that it stands, or its coast time is over. What it
    /// did between two looks nobody saw: a motor that was at rest, and that others have run and let coast meanwhile, is told to be at
    /// rest still. Behind a lost line it is not: nobody knows for how long it was not looked at.
    AtRest,
    /// The words do not tell.
    #[default]
    NotKnown,
}

crate::named! { Motion {
    Driven => "driven",
    Braking => "braking",
    Held => "held by injection",
    Coasting => "output off, the shaft may coast",
    AtRest => "at rest",
    NotKnown => "not known",
} }

impl Motion {
    /// Whether nothing is known of it.
    #[must_use]
    pub const fn is_not_known(&self) -> bool {
        matches!(self, Self::NotKnown)
    }

    /// Whether the drive gives the motor no torque and none is to be expected: at rest, or coasting.
    #[must_use]
    pub const fn is_undriven(self) -> bool {
        matches!(self, Self::AtRest | Self::Coasting)
    }
}

/// What one status shows of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Output {
    /// A run command acts.
    Driven,
    /// The motor is brought down, at this output.
    Braking(Frequency),
    /// Direct current is injected. Until the motor stands this brakes it.
    Injection,
    /// There is no output, and the drive has not cut it by itself: a ramp has ended.
    None,
    /// There is no output, and the drive says that the stop which it was making has come to its end.
    Ended,
    /// There is no output any more, of a motor that a stop brought down in whose place another may stand by now: only that it had
    /// the time to come down as fast as it was seen to tells a ramp that has ended from a cut.
    Gone,
    /// The output is cut: freewheel, a blocked output, no mains.
    Cut,
    /// The output is cut by a trip.
    Tripped,
    /// Something that watches the shaft itself says that it stands.
    Stands,
    /// The words do not tell.
    NotKnown,
}

/// How long direct current is given to bring a motor to rest where nothing else is known: as long as an Altivar 312 keeps it at
/// its full height (`IdC`, BBV51701 p. 40). No manual says when the shaft stands.
pub const INJECTION_TIME: Duration = Duration::from_secs(5);

/// How long direct current is held at the most: longer heats a motor that stands. An Altivar 312 takes no longer time for it
/// either (`tdC`, BBV51701 p. 41).
pub const INJECTION_AT_MOST: Duration = Duration::from_secs(30);

/// What two readings of an output leave open of its ramp, in hundredths of a hertz: they are rounded, and their moments are those of
/// answers.
const ROUNDING: u32 = 50;

/// The ramp of an Altivar 312 as it leaves the factory: 50 Hz in 3 s (`dEC`, BBV51701 p. 39). Of a drive whose ramp was neither seen nor
/// [told](Shaft::set_ramp) none shorter is believed, of whatever family.
const FACTORY_RAMP: (Frequency, Duration) = (Frequency::from_hertz(50), Duration::from_secs(3));
/// By what a fast stop divides the time of the ramp, as an Altivar 312 leaves the factory (`dCF`, BBV51701 p. 40).
const FAST_STOP: u32 = 4;

/// For how long a motor with a run command is seen at no output until it is one that has nothing to follow: one that has begins to turn
/// sooner, and an output that is cut as it does leaves it coasting.
const AT_ZERO: Duration = Duration::from_secs(1);

/// What was last seen of the shaft, or is to be taken for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Past {
    /// It was never seen, or may have turned since. No output is no standstill then: a drive whose motor was let coast shows none
    /// either, nor does one behind a power cycle.
    #[default]
    Unseen,
    /// It stood.
    AtRest,
    /// It was driven; since `zero`: at no output, to which it was seen to come down. Of one that was `still` so [a while](AT_ZERO) later
    /// nothing is to be expected when the output goes.
    Driven { zero: Option<Instant>, still: bool },
    /// It was braked.
    Braked { still: bool },
    /// It coasts since then.
    Coasts(Instant),
}

/// How fast an output comes down.
#[derive(Debug, Clone, Copy, Default)]
struct Descent {
    last: Option<(Instant, u32)>,
    /// Hundredths of a hertz in a time.
    rate: Option<(u32, Duration)>,
    /// The last look showed less than the one before it.
    falls: bool,
}

/// Whether the look is one that none before it can be held against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Sight {
    /// Nobody has looked yet, or not since the line was lost.
    #[default]
    Lost,
    /// The last look was the first one.
    First,
    /// There were others.
    Kept,
}

impl Descent {
    fn see(&mut self, now: Instant, output: u32) {
        self.falls = false;
        if let Some((then, before)) = self.last {
            self.falls = output < before;
            if output > before {
                self.rate = None;
            } else if output < before && now > then {
                self.rate = Some((before - output, now - then));
            }
        }
        self.last = Some((now, output));
    }

    /// Whether an output that is gone at `now` cannot have come down so fast, or hardly: it was cut, whatever the drive says. A third
    /// faster than it was seen to come down is still a ramp; of one of which nothing was seen its `ramp` is.
    fn is_cut(&self, now: Instant, ramp: (u32, Duration)) -> bool {
        let counts_in = |(counts, time)| self.until(now, counts, time, ROUNDING);
        match self.rate {
            Some(rate) => counts_in(rate).is_some_and(|(passed, needed)| passed * 4 < needed * 3),
            None => counts_in(ramp).is_some_and(|(passed, needed)| passed < needed),
        }
    }

    /// Whether an output that is gone at `now` had the time to come down as fast as it was seen to.
    fn has_come_down(&self, now: Instant) -> bool {
        let seen = self.rate.and_then(|(counts, time)| self.until(now, counts, time, ROUNDING));
        seen.is_some_and(|(passed, needed)| passed >= needed)
    }

    /// How long ago it was last seen, and how long it takes from there down to an output of `end`, by so many hundredths of a hertz in a
    /// time.
    fn until(&self, now: Instant, counts: u32, time: Duration, end: u32) -> Option<(Duration, Duration)> {
        let (then, output) = self.last?;
        Some((now.saturating_duration_since(then), time * output.saturating_sub(end) / counts.max(1)))
    }
}

/// The shaft behind the output, from status to status. Pure: time is an argument.
///
/// ```
/// use std::time::Duration;
/// use drive_core::{Frequency, Motion, Output, Shaft};
/// use tokio::time::Instant;
///
/// let (mut shaft, now) = (Shaft::new(), Instant::now());
/// shaft.set_coast_time(Some(Duration::from_secs(20)));
/// assert_eq!(shaft.see(now, Output::Driven, Some(Frequency::from_hertz(50))), Motion::Driven);
/// // No output is no standstill: the motor coasts, until its owner's time is over.
/// let cut = now + Duration::from_secs(1);
/// assert_eq!(shaft.see(cut, Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
/// let later = cut + Duration::from_secs(20);
/// assert_eq!(shaft.see(later, Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Shaft {
    past: Past,
    sight: Sight,
    descent: Descent,
    /// Since when direct current flows into a motor that may turn.
    injected_since: Option<Instant>,
    /// Direct current was asked for since the last look: it may have taken the output, and have ended again.
    may_inject: bool,
    /// The last stop that was sent is a fast one.
    stops_fast: bool,
    /// A freewheel stop was sent since the last look.
    was_let_go: bool,
    /// In which time the drive brings it down by how much.
    ramp: (Frequency, Duration),
    /// How long the motor coasts at the most, where its owner says so.
    coast_time: Option<Duration>,
    /// How long an injection takes to bring it to rest, where its owner says so.
    injection_time: Option<Duration>,
}

impl Default for Shaft {
    fn default() -> Self {
        Self::new()
    }
}

impl Shaft {
    /// A shaft that was never seen to turn.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            past: Past::Unseen,
            sight: Sight::Lost,
            descent: Descent { last: None, rate: None, falls: false },
            injected_since: None,
            may_inject: false,
            stops_fast: false,
            was_let_go: false,
            ramp: FACTORY_RAMP,
            coast_time: None,
            injection_time: None,
        }
    }

    /// How long it coasts at the most, as its owner says; `None`: nobody knows.
    pub const fn set_coast_time(&mut self, time: Option<Duration>) {
        self.coast_time = time;
    }

    /// How long an injection takes to bring it to rest, as its owner says; `None`: nobody knows, and
    /// [`INJECTION_TIME`] counts.
    pub const fn set_injection_time(&mut self, time: Option<Duration>) {
        self.injection_time = time;
    }

    /// In which time the drive brings the motor down by this frequency, as it has told; `None`: it has not, and the ramp of the factory
    /// counts where none was seen.
    pub fn set_ramp(&mut self, ramp: Option<(Frequency, Duration)>) {
        self.ramp = ramp.unwrap_or(FACTORY_RAMP);
    }

    /// The ramp of the stop that was sent, in hundredths of a hertz.
    const fn ramp(&self) -> (u32, Duration) {
        let (frequency, time) = self.ramp;
        (frequency.centihertz() * if self.stops_fast { FAST_STOP } else { 1 }, time)
    }

    /// How long direct current is to be held until the motor stands: as its owner says, else [`INJECTION_TIME`]; never longer
    /// than [`INJECTION_AT_MOST`].
    #[must_use]
    pub fn injection_time(&self) -> Duration {
        self.injection_time.unwrap_or(INJECTION_TIME).min(INJECTION_AT_MOST)
    }

    /// The line was lost: what the drive does meanwhile nobody sees, for however long. What turned may have been cut, and what stood may
    /// have been run by others and let coast: it is as one that was never seen.
    pub fn lose_sight(&mut self) {
        *self = Self { coast_time: self.coast_time, injection_time: self.injection_time, ..Self::new() };
    }

    /// A stop in this mode is sent. Where it is one by direct current and the next look shows neither that current nor an output, it may
    /// have flowed for a moment between them, and a motor that turned coasts.
    pub const fn is_stopped_by(&mut self, mode: StopMode) {
        self.may_inject |= matches!(mode, StopMode::DcInjection);
        self.stops_fast = matches!(mode, StopMode::Fast);
        self.was_let_go |= matches!(mode, StopMode::Freewheel);
    }

    /// A motor that was seen at rest may have turned since, by what was seen of it besides a status, or not seen at all: without an
    /// output that was seen to come down, it may coast.
    pub fn may_turn(&mut self) {
        if self.past == Past::AtRest {
            self.past = Past::Unseen;
        }
    }

    /// Whether it was let coast by this side since the last look.
    pub(crate) const fn was_let_go(&self) -> bool {
        self.was_let_go
    }

    /// Whether the last status showed it being brought down.
    #[must_use]
    pub const fn was_braked(&self) -> bool {
        matches!(self.past, Past::Braked { .. })
    }

    /// Whether the last status showed the output going down, from the one before it: no obedience to a reference above it.
    #[must_use]
    pub const fn falls(&self) -> bool {
        self.descent.falls
    }

    /// Whether the last look was the first one, or the first behind a lost line: whether the output goes up or down it does not show.
    #[must_use]
    pub const fn is_seen_first(&self) -> bool {
        matches!(self.sight, Sight::First)
    }

    /// What a status shows at `at`, with the output frequency that the drive tells.
    pub fn see(&mut self, at: Instant, shown: Output, frequency: Option<Frequency>) -> Motion {
        if shown == Output::NotKnown {
            // The next look goes on from the one before.
            return Motion::NotKnown;
        }
        self.sight = if self.sight == Sight::Lost { Sight::First } else { Sight::Kept };
        let turns = frequency.is_some_and(|frequency| frequency != Frequency::ZERO);
        let mut descent = std::mem::take(&mut self.descent);
        let shown = match shown {
            Output::Tripped => Output::Cut,
            Output::None if self.was_braked() && descent.is_cut(at, self.ramp()) => Output::Cut,
            Output::Gone if descent.has_come_down(at) => Output::None,
            Output::Gone => Output::Cut,
            shown => shown,
        };
        self.was_let_go = false;
        let may_inject = std::mem::take(&mut self.may_inject) && self.past != Past::AtRest;
        if may_inject && !matches!(shown, Output::Driven | Output::Braking(_) | Output::Injection) && !turns {
            self.past = Past::Coasts(at);
        }
        if shown != Output::Injection {
            self.end_injection(at, matches!(shown, Output::Driven | Output::Braking(_)));
        }
        match shown {
            Output::NotKnown => Motion::NotKnown,
            Output::Driven if frequency == Some(Frequency::ZERO) => {
                self.past = self.at_zero(at, descent);
                Motion::Driven
            }
            Output::Driven => {
                if !matches!(self.past, Past::Driven { .. }) {
                    descent = Descent::default();
                }
                if let Some(frequency) = frequency {
                    descent.see(at, frequency.centihertz());
                }
                (self.past, self.descent) = (Past::Driven { zero: None, still: false }, descent);
                Motion::Driven
            }
            Output::Braking(output) => {
                self.brake(at, output, descent);
                Motion::Braking
            }
            Output::Stands if !turns => {
                self.past = Past::AtRest;
                Motion::AtRest
            }
            Output::Injection if self.past == Past::AtRest => Motion::Held,
            Output::Injection => {
                let since = *self.injected_since.get_or_insert(at);
                if !self.is_injected_for_long(at, since) {
                    return Motion::Braking;
                }
                (self.past, self.injected_since) = (Past::AtRest, None);
                Motion::Held
            }
            Output::None | Output::Ended | Output::Gone | Output::Cut | Output::Tripped | Output::Stands
                if turns =>
            {
                // It tells an output all the same: it comes down. Where it was not seen to before, its words are of two moments, and
                // the output may have been cut between them.
                match frequency.filter(|_| self.was_braked()) {
                    Some(output) => self.brake(at, output, descent),
                    None => self.past = Past::Driven { zero: None, still: false },
                }
                Motion::Braking
            }
            Output::None | Output::Ended | Output::Gone | Output::Cut | Output::Tripped | Output::Stands => {
                self.without_output(at, shown == Output::Cut)
            }
        }
    }

    fn brake(&mut self, at: Instant, output: Frequency, before: Descent) {
        let still = output == Frequency::ZERO;
        // At no output the words of a ramp may be of the moment before a cut, and those of one whose output was cut already bring
        // nothing down.
        let is_cut = before.is_cut(at, self.ramp());
        let coasting = match self.past {
            _ if !still => None,
            Past::Unseen => Some(at),
            Past::Driven { still: false, .. } if is_cut || !before.falls => Some(at),
            Past::Braked { still: false } if is_cut => Some(at),
            Past::Coasts(since) if !self.has_coasted(at, since) => Some(since),
            _ => None,
        };
        self.descent = if self.was_braked() { before } else { Descent::default() };
        self.descent.see(at, output.centihertz());
        self.past = coasting.map_or(Past::Braked { still }, Past::Coasts);
    }

    /// A run command acts, at no output. It stands where it stood, or was seen to come down so far; else it may coast below a run
    /// command that was given to it since, as after a stop of one moment.
    fn at_zero(&self, at: Instant, descent: Descent) -> Past {
        let came_down = descent.rate.is_some() && !descent.is_cut(at, self.ramp());
        let just_now = Past::Driven { zero: Some(at), still: false };
        match self.past {
            Past::Driven { zero: Some(since), .. } => {
                Past::Driven { zero: Some(since), still: at.saturating_duration_since(since) >= AT_ZERO }
            }
            Past::AtRest | Past::Braked { still: true } => just_now,
            Past::Driven { .. } | Past::Braked { .. } if came_down => just_now,
            Past::Coasts(since) if self.has_coasted(at, since) => just_now,
            coasts @ Past::Coasts(_) => coasts,
            _ => Past::Coasts(at),
        }
    }

    fn has_coasted(&self, at: Instant, since: Instant) -> bool {
        self.coast_time.is_some_and(|time| at.saturating_duration_since(since) >= time)
    }

    fn is_injected_for_long(&self, at: Instant, since: Instant) -> bool {
        at.saturating_duration_since(since) >= self.injection_time()
    }

    /// What was injected for long enough stands; else it coasts on.
    fn end_injection(&mut self, at: Instant, is_fed: bool) {
        let Some(since) = self.injected_since.take() else { return };
        if !is_fed {
            let over = self.is_injected_for_long(at, since);
            self.past = if over { Past::AtRest } else { Past::Coasts(at) };
        }
    }

    fn without_output(&mut self, at: Instant, cut: bool) -> Motion {
        self.past = match self.past {
            // Whoever was driven and is without an output was not seen to be brought down: a ramp, or a cut between two looks.
            Past::Unseen | Past::Driven { still: false, .. } => Past::Coasts(at),
            Past::Braked { still: false } if cut => Past::Coasts(at),
            coasts @ Past::Coasts(since) if !self.has_coasted(at, since) => coasts,
            _ => Past::AtRest,
        };
        if self.past == Past::AtRest { Motion::AtRest } else { Motion::Coasting }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIFTY: Option<Frequency> = Some(Frequency::from_hertz(50));

    /// One that the drive itself has said to stand.
    fn resting(at: Instant) -> Shaft {
        let mut shaft = Shaft::new();
        assert_eq!(shaft.see(at, Output::Stands, Some(Frequency::ZERO)), Motion::AtRest);
        shaft
    }

    #[tokio::test(start_paused = true)]
    async fn an_output_that_was_cut_leaves_a_shaft_that_coasts_until_its_owner_says_it_rests() {
        let begun = Instant::now();
        let (mut shaft, after) = (resting(begun), |seconds| begun + Duration::from_secs(seconds));
        assert_eq!(shaft.see(begun, Output::None, None), Motion::AtRest);
        assert_eq!(shaft.see(after(1), Output::Driven, FIFTY), Motion::Driven);
        assert_eq!(shaft.see(after(2), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
        assert_eq!(shaft.see(after(90), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
        shaft.set_coast_time(Some(Duration::from_secs(60)));
        assert_eq!(shaft.see(after(91), Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_that_was_driven_and_has_no_output_at_the_next_look_may_coast_whoever_ended_it() {
        let (mut shaft, now) = (Shaft::new(), Instant::now());
        shaft.see(now, Output::Driven, FIFTY);
        assert_eq!(shaft.see(now, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_into_which_current_may_have_flowed_for_a_moment_between_two_looks_may_coast() {
        let now = Instant::now();
        let braked = |outputs: [u16; 2]| {
            let mut shaft = Shaft::new();
            for (tenth, hertz) in (0..).zip(outputs) {
                let at = now + Duration::from_millis(100 * tenth);
                shaft.see(at, Output::Braking(Frequency::from_hertz(hertz)), None);
            }
            shaft
        };
        let later = now + Duration::from_secs(10);
        let mut shaft = braked([30, 29]);
        assert_eq!(shaft.see(later, Output::None, Some(Frequency::ZERO)), Motion::AtRest, "its ramp is over");
        let mut shaft = braked([30, 29]);
        shaft.is_stopped_by(StopMode::DcInjection);
        assert_eq!(shaft.see(later, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
        let mut rests = resting(now);
        rests.is_stopped_by(StopMode::DcInjection);
        assert_eq!(rests.see(later, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_that_was_never_seen_may_coast_whatever_became_of_its_output() {
        let now = Instant::now();
        for shown in [Output::None, Output::Gone, Output::Cut, Output::Tripped] {
            let mut shaft = Shaft::new();
            shaft.set_coast_time(Some(Duration::from_secs(20)));
            assert_eq!(shaft.see(now, shown, Some(Frequency::ZERO)), Motion::Coasting, "{shown:?}");
            let later = now + Duration::from_secs(20);
            assert_eq!(shaft.see(later, shown, Some(Frequency::ZERO)), Motion::AtRest, "{shown:?}");
        }
        assert_eq!(resting(now).see(now, Output::Cut, Some(Frequency::ZERO)), Motion::AtRest, "it stood");
    }

    /// The words of one status are of two moments where it takes two exchanges. A 3G3EV and an Altivar 28 lost their supply between
    /// them, with the output of the moment before.
    #[tokio::test(start_paused = true)]
    async fn an_output_that_was_cut_amid_the_words_of_one_status_was_not_seen_to_come_down() {
        let now = Instant::now();
        for gone in [Output::None, Output::Cut] {
            let mut shaft = Shaft::new();
            shaft.see(now, Output::Driven, FIFTY);
            assert_eq!(
                shaft.see(now, Output::Cut, FIFTY),
                Motion::Braking,
                "it tells an output all the same"
            );
            assert!(!shaft.was_braked());
            assert_eq!(shaft.see(now, gone, Some(Frequency::ZERO)), Motion::Coasting);
        }
        // Its output was gone at 26 Hz while a run command acted, and the words of a ramp come behind.
        let mut shaft = Shaft::new();
        let seen =
            [(0, Output::Driven, 26), (40, Output::Driven, 0), (60, Output::Braking(Frequency::ZERO), 0)];
        for (at, shown, hertz) in seen {
            shaft.see(now + Duration::from_millis(at), shown, Some(Frequency::from_hertz(hertz)));
        }
        let cut = now + Duration::from_millis(80);
        assert_eq!(shaft.see(cut, Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
        // The last moment of a ramp.
        let (mut shaft, after) = (Shaft::new(), |tenths: u64| now + Duration::from_millis(100 * tenths));
        for (at, hertz) in [(0, 3), (1, 2)] {
            shaft.see(
                after(at),
                Output::Braking(Frequency::from_hertz(hertz)),
                Some(Frequency::from_hertz(hertz)),
            );
        }
        assert_eq!(shaft.see(after(2), Output::Cut, Some(Frequency::from_hertz(1))), Motion::Braking);
        assert_eq!(shaft.see(after(3), Output::None, Some(Frequency::ZERO)), Motion::AtRest);
    }

    /// An Altivar 21 was let coast, tripped or lost its release between the word that says that it runs and the output.
    #[tokio::test(start_paused = true)]
    async fn the_words_of_a_ramp_at_no_output_tell_standstill_only_where_it_was_seen_to_come_down() {
        let begun = Instant::now();
        let after = |milliseconds| begun + Duration::from_millis(milliseconds);
        let zero = Output::Braking(Frequency::ZERO);
        let driven: fn(Frequency) -> Output = |_| Output::Driven;
        for (what, shown, outputs, gone, motion) in [
            ("never seen", driven, &[][..], 100, Motion::Coasting),
            ("at its speed", driven, &[40, 40], 100, Motion::Coasting),
            ("at a low speed, which it came down to once", driven, &[4, 3, 3], 2_000, Motion::Coasting),
            ("on its way to a lower speed", driven, &[40, 39], 1_000, Motion::Coasting),
            ("almost at zero", driven, &[2, 1], 100, Motion::AtRest),
            ("in a ramp", Output::Braking, &[40, 39], 1_000, Motion::Coasting),
            ("in a ramp that had the time to end", Output::Braking, &[40, 39], 3_900, Motion::AtRest),
        ] {
            let (mut shaft, mut last) = (Shaft::new(), 0);
            for (look, hertz) in (0..).zip(outputs) {
                let output = Frequency::from_hertz(*hertz);
                last = 100 * look;
                shaft.see(after(last), shown(output), Some(output));
            }
            shaft.see(after(last + gone), zero, Some(Frequency::ZERO));
            for cut in [Output::None, Output::Gone, Output::Cut] {
                let mut shaft = shaft;
                let told = shaft.see(after(last + gone + 100), cut, Some(Frequency::ZERO));
                assert_eq!(told, motion, "{what}: {cut:?}");
            }
        }
    }

    /// An Altivar 58 was let coast, and its panel took it and commanded nothing, between two looks.
    #[tokio::test(start_paused = true)]
    async fn a_motor_that_is_driven_at_no_output_stands_only_where_it_was_seen_to_come_down_or_its_coast_time_is_over()
     {
        let begun = Instant::now();
        let after = |seconds| begun + Duration::from_secs(seconds);
        let mut cut = Shaft::new();
        cut.see(begun, Output::Driven, FIFTY);
        let mut lowered = cut;
        for at in [1, 2, 3] {
            assert_eq!(cut.see(after(at), Output::Driven, Some(Frequency::ZERO)), Motion::Driven);
        }
        let mut later = cut;
        assert_eq!(cut.see(after(4), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
        later.set_coast_time(Some(Duration::from_secs(9)));
        for at in [10, 11] {
            later.see(after(at), Output::Driven, Some(Frequency::ZERO));
        }
        assert_eq!(later.see(after(12), Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
        // 10 Hz a second.
        for at in 1..5_u16 {
            lowered.see(after(at.into()), Output::Driven, Some(Frequency::from_hertz(50 - 10 * at)));
        }
        for at in [5, 6] {
            lowered.see(after(at), Output::Driven, Some(Frequency::ZERO));
        }
        assert_eq!(lowered.see(after(7), Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn what_watches_the_shaft_ends_its_coasting_and_an_output_outweighs_it() {
        let (mut shaft, now) = (Shaft::new(), Instant::now());
        shaft.see(now, Output::Driven, FIFTY);
        assert_eq!(shaft.see(now, Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
        assert_eq!(shaft.see(now, Output::Stands, FIFTY), Motion::Braking, "it tells an output all the same");
        assert_eq!(shaft.see(now, Output::Stands, Some(Frequency::ZERO)), Motion::AtRest);
        assert_eq!(shaft.see(now, Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn a_ramp_that_has_ended_leaves_a_shaft_at_rest() {
        let (mut shaft, now) = (Shaft::new(), Instant::now());
        assert_eq!(shaft.see(now, Output::Braking(Frequency::from_hertz(3)), None), Motion::Braking);
        let later = now + Duration::from_millis(200);
        assert_eq!(shaft.see(later, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn an_output_that_is_gone_sooner_than_its_ramp_brings_it_down_was_cut() {
        for (last, said_to_be_over, not_said) in [
            (200, Motion::Coasting, Motion::Coasting),
            (1_000, Motion::Coasting, Motion::Coasting),
            // More than three quarters of the time: the drive may have come down faster in the end, if it says that its ramp is over.
            (1_500, Motion::AtRest, Motion::Coasting),
            (1_800, Motion::AtRest, Motion::AtRest),
        ] {
            let (mut shaft, begun) = (Shaft::new(), Instant::now());
            let after = |milliseconds| begun + Duration::from_millis(milliseconds);
            for (at, hertz) in [(0, 20), (100, 19), (200, 18)] {
                shaft.see(
                    after(at),
                    Output::Braking(Frequency::from_hertz(hertz)),
                    Some(Frequency::from_hertz(hertz)),
                );
            }
            // 18 Hz at 10 Hz/s take 1.8 s.
            let mut other = shaft;
            let at = after(200 + last);
            assert_eq!(shaft.see(at, Output::None, Some(Frequency::ZERO)), said_to_be_over, "{last}");
            assert_eq!(other.see(at, Output::Gone, Some(Frequency::ZERO)), not_said, "{last}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn an_output_that_is_gone_behind_one_look_alone_tells_no_ramp_but_that_of_the_factory() {
        for (shown, after, motion) in [
            // A freewheel input behind the word of a stop: 30 Hz that are gone at the next look.
            (Output::None, 500, Motion::Coasting),
            (Output::None, 1_800, Motion::AtRest),
            // Another stop may stand there by now.
            (Output::Gone, 1_800, Motion::Coasting),
        ] {
            let (mut shaft, begun) = (Shaft::new(), Instant::now());
            shaft.see(begun, Output::Braking(Frequency::from_hertz(30)), Some(Frequency::from_hertz(30)));
            let later = begun + Duration::from_millis(after);
            assert_eq!(shaft.see(later, shown, Some(Frequency::ZERO)), motion, "{shown:?} after {after}");
        }
        let now = Instant::now();
        assert_eq!(resting(now).see(now, Output::Gone, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn a_ramp_that_the_drive_has_told_and_a_fast_stop_may_be_over_sooner_than_that_of_the_factory() {
        let half_a_second = Some((Frequency::from_hertz(50), Duration::from_millis(500)));
        for (ramp, mode, after, motion) in [
            (half_a_second, StopMode::Ramp, 310, Motion::AtRest),
            (half_a_second, StopMode::Ramp, 250, Motion::Coasting),
            (None, StopMode::Ramp, 460, Motion::Coasting),
            // 30 Hz in 1.8 s, divided by 4.
            (None, StopMode::Fast, 460, Motion::AtRest),
            (None, StopMode::Fast, 400, Motion::Coasting),
        ] {
            let (mut shaft, begun) = (Shaft::new(), Instant::now());
            shaft.set_ramp(ramp);
            shaft.is_stopped_by(mode);
            shaft.see(begun, Output::Braking(Frequency::from_hertz(30)), Some(Frequency::from_hertz(30)));
            let later = begun + Duration::from_millis(after);
            assert_eq!(
                shaft.see(later, Output::None, Some(Frequency::ZERO)),
                motion,
                "{ramp:?} {mode} {after}"
            );
        }
    }

    /// A quick stop of an Altivar 58 that takes 0.3 s, looked at each 0.3 s.
    #[tokio::test(start_paused = true)]
    async fn a_stop_that_the_drive_says_to_have_ended_needs_no_time_and_one_that_was_not_seen_to_begin_does()
    {
        let (begun, zero) = (Instant::now(), Some(Frequency::ZERO));
        let later = begun + Duration::from_millis(300);
        let mut shaft = Shaft::new();
        shaft.see(begun, Output::Driven, FIFTY);
        let mut unseen = shaft;
        shaft.see(begun, Output::Braking(Frequency::from_hertz(50)), FIFTY);
        assert_eq!(shaft.see(later, Output::Ended, zero), Motion::AtRest);
        assert_eq!(unseen.see(later, Output::Ended, zero), Motion::Coasting);
    }

    /// What stood as well: its panel may have run it and let it coast, for however long it was not looked at. So it is at the first look
    /// of a program.
    #[tokio::test(start_paused = true)]
    async fn behind_a_lost_line_a_motor_may_coast_whatever_was_seen_of_it_until_its_coast_time_is_over() {
        let (begun, zero) = (Instant::now(), Some(Frequency::ZERO));
        let three = Frequency::from_hertz(3);
        let ways: [(&str, &[Output]); 5] = [
            ("at rest", &[Output::Stands]),
            ("braked", &[Output::Braking(three)]),
            ("braked to no output", &[Output::Braking(three), Output::Braking(Frequency::ZERO)]),
            ("driven at no output", &[Output::Stands, Output::Driven, Output::Driven]),
            ("let coast long ago", &[Output::Cut]),
        ];
        for (what, ways) in ways {
            let mut shaft = Shaft::new();
            shaft.set_coast_time(Some(Duration::from_secs(20)));
            for shown in ways {
                let output = if let Output::Braking(output) = *shown { output } else { Frequency::ZERO };
                shaft.see(begun, *shown, Some(output));
            }
            shaft.lose_sight();
            let back = begun + Duration::from_secs(60);
            assert_eq!(shaft.see(back, Output::NotKnown, None), Motion::NotKnown);
            for shown in [Output::None, Output::Gone, Output::Cut] {
                let mut shaft = shaft;
                assert_eq!(shaft.see(back, shown, zero), Motion::Coasting, "{what}: {shown:?}");
                let later = back + Duration::from_secs(20);
                assert_eq!(shaft.see(later, shown, zero), Motion::AtRest, "{what}: {shown:?}");
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_look_that_does_not_tell_leaves_how_fast_the_motor_came_down() {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        let after = |milliseconds| begun + Duration::from_millis(milliseconds);
        for (at, hertz) in [(0, 20), (100, 19)] {
            shaft.see(after(at), Output::Braking(Frequency::from_hertz(hertz)), None);
        }
        assert_eq!(shaft.see(after(200), Output::NotKnown, None), Motion::NotKnown);
        // 19 Hz at 10 Hz/s take 1.9 s.
        assert_eq!(shaft.see(after(300), Output::None, Some(Frequency::ZERO)), Motion::Coasting);
    }

    #[test]
    fn direct_current_is_held_as_its_owner_says_and_never_for_longer_than_a_motor_at_rest_bears() {
        let held = |time| {
            let mut shaft = Shaft::new();
            shaft.set_injection_time(time);
            shaft.injection_time()
        };
        assert_eq!(held(None), INJECTION_TIME);
        assert_eq!(held(Some(Duration::from_secs(2))), Duration::from_secs(2));
        assert_eq!(held(Some(Duration::from_secs(600))), INJECTION_AT_MOST);
    }

    #[tokio::test(start_paused = true)]
    async fn an_injection_that_was_ended_too_early_leaves_a_shaft_that_coasts() {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        shaft.set_injection_time(Some(Duration::from_secs(2)));
        shaft.see(begun, Output::Driven, FIFTY);
        assert_eq!(shaft.see(begun, Output::Injection, Some(Frequency::ZERO)), Motion::Braking);
        let early = begun + Duration::from_millis(20);
        let mut ended = shaft;
        assert_eq!(ended.see(early, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
        let late = begun + Duration::from_secs(2);
        assert_eq!(shaft.see(late, Output::Injection, Some(Frequency::ZERO)), Motion::Held);
        assert_eq!(shaft.see(late, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
    }

    #[tokio::test(start_paused = true)]
    async fn direct_current_in_a_motor_that_was_never_seen_to_stand_brakes_it_until_its_time_is_over() {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        shaft.set_injection_time(Some(Duration::from_secs(2)));
        assert_eq!(shaft.see(begun, Output::Injection, Some(Frequency::ZERO)), Motion::Braking);
        let late = begun + Duration::from_secs(2);
        assert_eq!(shaft.see(late, Output::Injection, Some(Frequency::ZERO)), Motion::Held);
        let mut resting = resting(begun);
        assert_eq!(resting.see(begun, Output::Injection, Some(Frequency::ZERO)), Motion::Held);
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_whose_output_was_cut_as_it_began_to_turn_may_coast_and_one_at_zero_speed_stands() {
        // An Altivar 58 that was let coast 40 ms behind its start, and had been looked at twice.
        for (looks, motion) in
            [(&[0][..], Motion::Coasting), (&[0, 20], Motion::Coasting), (&[0, 500, 1_000], Motion::AtRest)]
        {
            let begun = Instant::now();
            let (mut shaft, after) =
                (resting(begun), |milliseconds| begun + Duration::from_millis(milliseconds));
            for at in looks {
                shaft.see(after(*at), Output::Driven, Some(Frequency::ZERO));
            }
            assert_eq!(shaft.see(after(1_010), Output::Cut, Some(Frequency::ZERO)), motion, "{looks:?}");
        }
    }
}
