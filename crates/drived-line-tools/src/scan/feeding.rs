//! Which drives are kept fed while the scan goes on, and when. No line and no clock.

use std::time::Duration;

use super::plan::Step;
use drive_core::{Reaction, Watchdog};
use drive_families::{Family, Options};

/// How often a slave is asked of which nobody knows whether it watches its line: of an unknown family, or of one whose manual
/// prints no time.
const UNKNOWN: Duration = Duration::from_secs(1);

/// How often a drive wants to be asked, by what it tells of its watchdog or by the shortest time that its family can be set to;
/// `None`: its watchdog is off. It is half the time, because an exchange that is under way is waited for.
pub(super) fn interval(family: Family, is_ascii: bool, told: Option<Watchdog>) -> Option<Duration> {
    match told {
        Some(Watchdog { timeout: None, .. } | Watchdog { reaction: Some(Reaction::Ignore), .. }) => None,
        Some(Watchdog { timeout: Some(timeout), .. }) => Some(timeout / 2),
        None => {
            let capability = family.watchdog(is_ascii, &Options::default());
            // That it does not tell is no reason to believe that it is as short as it can be.
            Some(capability.map_or(UNKNOWN, |capability| (capability.min / 2).max(UNKNOWN / 2)))
        }
    }
}

/// A slave that has answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fed {
    pub(super) step: Step,
    pub(super) family: Option<Family>,
    interval: Duration,
    due: Duration,
}

/// The slaves that have answered and have to be asked again and again. Times are since the scan began.
#[derive(Debug, Default)]
pub(super) struct Feeding(Vec<Fed>);

impl Feeding {
    /// Takes a slave that has just answered.
    pub(super) fn add(&mut self, step: Step, family: Option<Family>, interval: Duration, now: Duration) {
        self.0.push(Fed { step, family, interval, due: now + interval });
    }

    /// Whom to ask before something that takes so long: who would be late after it, those at the setting `at` first, because
    /// the line has it already. Whoever is asked at a setting has the others there asked too that are due soon.
    pub(super) fn next(&self, now: Duration, ahead: Duration, at: Option<usize>) -> Option<Fed> {
        // Whoever was fed a moment ago leaves the others their turn, however long it takes.
        let until = |fed: &Fed| now + ahead.min(fed.interval / 2);
        let soon = |fed: &&Fed| Some(fed.step.trial) == at && fed.due <= until(fed) + fed.interval / 4;
        let anybody = self.0.iter().filter(|fed| fed.due <= until(fed)).min_by_key(|fed| fed.due)?;
        Some(*self.0.iter().find(soon).unwrap_or(anybody))
    }

    /// Who is to be asked first of those at these settings, and when.
    pub(super) fn first_at(&self, trial: usize) -> Option<(Fed, Duration)> {
        let there = self.0.iter().filter(|fed| fed.step.trial == trial);
        there.min_by_key(|fed| fed.due).map(|fed| (*fed, fed.due))
    }

    /// Whether it is among them.
    pub(super) fn has(&self, step: Step) -> bool {
        self.0.iter().any(|fed| fed.step == step)
    }

    /// It was asked.
    pub(super) fn fed(&mut self, step: Step, now: Duration) {
        for fed in self.0.iter_mut().filter(|fed| fed.step == step) {
            fed.due = now + fed.interval;
        }
    }

    /// How many they are. In one round each is fed once at the most: a watchdog that is shorter than the round to all of them
    /// cannot be kept.
    pub(super) const fn len(&self) -> usize {
        self.0.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn step(trial: usize, slave: u8) -> Step {
        Step { trial, slave: slave.try_into().unwrap() }
    }

    #[test]
    fn a_watchdog_that_is_off_needs_no_feeding_and_one_that_does_not_tell_the_shortest_of_its_family() {
        let told = |timeout, reaction| interval(Family::ATV21, false, Some(Watchdog { timeout, reaction }));
        assert_eq!(told(None, None), None);
        assert_eq!(told(Some(SECOND), Some(Reaction::Ignore)), None);
        assert_eq!(told(Some(4 * SECOND), Some(Reaction::Freewheel)), Some(2 * SECOND));
        // F803 counts whole seconds; the 3G3EV has 2 s; the Altivar 58 in ASCII 1 s (VVDED397054 p. 24/48).
        assert_eq!(interval(Family::ATV21, false, None), Some(SECOND / 2));
        assert_eq!(interval(Family::OMRON_3G3EV, false, None), Some(SECOND));
        assert_eq!(interval(Family::ATV58, true, None), Some(SECOND / 2));
        assert_eq!(interval(Family::ATV28, false, None), Some(UNKNOWN));
    }

    #[test]
    fn who_would_be_late_after_the_next_question_is_asked_before_it() {
        let (now, mut feeding) = (SECOND, Feeding::default());
        feeding.add(step(0, 1), None, SECOND, now);
        assert_eq!(feeding.next(now, SECOND / 2, Some(0)), None);
        let due = now + SECOND / 2;
        assert_eq!(feeding.next(due, SECOND / 2, Some(0)).map(|fed| fed.step), Some(step(0, 1)));
        feeding.fed(step(0, 1), due);
        assert_eq!(feeding.next(due, SECOND / 2, Some(0)), None);
    }

    #[test]
    fn those_at_the_setting_that_the_line_has_are_asked_first_and_also_when_they_are_due_soon() {
        let (now, mut feeding) = (SECOND, Feeding::default());
        feeding.add(step(0, 1), None, SECOND, now);
        feeding.add(step(1, 2), None, SECOND, now + SECOND / 8);
        let at = now + SECOND;
        assert_eq!(feeding.next(at, Duration::ZERO, Some(1)).map(|fed| fed.step), Some(step(1, 2)));
        assert_eq!(feeding.next(at, Duration::ZERO, Some(0)).map(|fed| fed.step), Some(step(0, 1)));
        assert_eq!(feeding.next(now + SECOND / 2, Duration::ZERO, Some(1)), None);
    }
}
