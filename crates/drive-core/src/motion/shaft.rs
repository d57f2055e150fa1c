//! The shaft behind the output: [`Shaft`], what is known of it from status to status.

use std::time::Duration;

use tokio::time::Instant;

use super::{INJECTION_AT_MOST, INJECTION_TIME, Motion, Output, descent::Descent};
use crate::{setpoint::StopMode, units::Frequency};

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
