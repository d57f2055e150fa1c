//! What the settings of a drive say, checked against each other and its family before anything is asked of it.

use std::time::Duration;

use drive_core::{Capabilities, INJECTION_AT_MOST, WatchdogCapability};

use super::SettingProblem;
use crate::{settings::DriveSettings, watchdog::WatchdogContract};

/// The longest that any period or time of a drive may be. Longer ones are mistakes, and a clock cannot hold the longest.
const LONGEST: Duration = Duration::from_secs(365 * 86_400);

/// Checks what the settings of a drive say against each other, its family and its own watchdog
/// ([`Drive::watchdog_capability`](drive_core::Drive::watchdog_capability)).
///
/// # Errors
/// [`SettingProblem`] with the first that does not fit.
pub fn check_settings(
    settings: &DriveSettings,
    capabilities: &Capabilities,
    watchdog: Option<WatchdogCapability>,
) -> Result<(), SettingProblem> {
    let problem = |setting, reason| Err(SettingProblem { setting, reason });
    if settings.name.trim().is_empty() {
        return problem("name", "a drive needs a name".to_owned());
    }
    if settings.name.chars().any(char::is_control) {
        return problem("name", "a name has no control characters".to_owned());
    }
    let periods = settings.periods;
    for (name, period) in [("running", periods.running), ("rest", periods.rest)] {
        if period.is_zero() {
            return problem("periods", format!("{name} is zero: expected the time between two statuses"));
        }
        if period >= periods.max_age {
            return problem(
                "periods",
                format!(
                    "with a status every {period:?} ({name}) and a max_age of {:?} no value is ever fresh: expected a \
                     longer max_age",
                    periods.max_age
                ),
            );
        }
    }
    for (setting, times) in [("periods", periods.named()), ("times", settings.times.named())] {
        if let Some((name, time)) = times.into_iter().find(|(_, time)| *time > LONGEST) {
            return problem(setting, format!("{name} is {time:?}: expected a year at the most"));
        }
    }
    if settings.times.lifetime.is_zero() {
        return problem("times", "lifetime is zero: no command would ever be sent".to_owned());
    }
    if let Some(time) = settings.injection.filter(|time| time.is_zero() || *time > INJECTION_AT_MOST) {
        let reason = format!("expected more than nothing and {INJECTION_AT_MOST:?} at the most");
        return problem("injection", format!("an injection of {time:?}: {reason}"));
    }
    if let Err(reason) = settings.limits.check() {
        return problem("limits", reason);
    }
    match settings.watchdog.map(|contract| check_watchdog(contract, capabilities.name, watchdog)) {
        Some(Err(reason)) => problem("watchdog", reason),
        _ => Ok(()),
    }
}

fn check_watchdog(
    contract: WatchdogContract,
    name: &str,
    watchdog: Option<WatchdogCapability>,
) -> Result<(), String> {
    let Some(watchdog) = watchdog else {
        return Err(format!("the bus cannot set a communication watchdog of {name}"));
    };
    let timeout = contract.timeout;
    let in_steps = timeout
        .checked_sub(watchdog.min)
        .is_some_and(|above| above.as_nanos().checked_rem(watchdog.step.as_nanos()).unwrap_or_default() == 0);
    if timeout > watchdog.max || !in_steps {
        return Err(format!(
            "a watchdog of {timeout:?}: {name} has {:?} to {:?} in steps of {:?}",
            watchdog.min, watchdog.max, watchdog.step
        ));
    }
    if watchdog.settable && !watchdog.reactions.contains(&contract.reaction) {
        let has: Vec<_> = watchdog.reactions.iter().map(ToString::to_string).collect();
        return Err(format!(
            "the watchdog of {name} has no {}: it has {}",
            contract.reaction,
            has.join(", ")
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        settings::{Periods, Times},
        testing::CAPABILITIES,
    };

    #[test]
    fn times_that_no_clock_can_hold_and_a_lifetime_of_nothing_are_refused() {
        let usual = DriveSettings::controlled("pump");
        assert_eq!(check_settings(&usual, &CAPABILITIES, CAPABILITIES.watchdog), Ok(()));
        let (periods, times, for_ever) = (Periods::default(), Times::default(), Duration::MAX);
        for (setting, periods, times) in [
            ("periods", Periods { max_age: for_ever, ..periods }, times),
            ("periods", Periods { slow: for_ever, ..periods }, times),
            ("times", periods, Times { lifetime: for_ever, ..times }),
            ("times", periods, Times { effect: for_ever, ..times }),
            ("times", periods, Times { reference: for_ever, ..times }),
            ("times", periods, Times { standstill: for_ever, ..times }),
            ("times", periods, Times { stop_alarm: for_ever, ..times }),
            ("times", periods, Times { lifetime: Duration::ZERO, ..times }),
        ] {
            let settings = DriveSettings { periods, times, ..usual.clone() };
            let problem = check_settings(&settings, &CAPABILITIES, CAPABILITIES.watchdog).unwrap_err();
            assert_eq!(problem.setting, setting, "{problem}");
        }
    }
}
