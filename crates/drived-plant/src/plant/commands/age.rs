//! How old what says when it was issued is, the same at every face.

use std::time::Duration;

use drived_words::json::{milliseconds, unix};
use tokio::time::Instant;

use super::Rejected;

/// By how much another clock may be ahead of ours.
const AHEAD: Duration = Duration::from_secs(1);

/// How old something is that was issued at the earliest of these times, within its lifetime; nothing where it does not say. Where this
/// computer's clock was set back since, it may be older by that.
///
/// # Errors
/// It is too old, or nobody can say.
pub fn age_of(
    issued: [Option<u64>; 2],
    arrived: Instant,
    lifetime: Duration,
    set_back: Duration,
) -> Result<Duration, Rejected> {
    let Some(issued) = issued.into_iter().flatten().min() else { return Ok(Duration::ZERO) };
    let age = drive_fleet::mutant!("old-command-moves", age(issued, arrived)?, Duration::ZERO);
    match age {
        age if age >= lifetime => Err(Rejected::TooOld { age, lifetime }),
        age if age + set_back >= lifetime => Err(Rejected::ClockSetBack(set_back)),
        age => Ok(age),
    }
}

/// How old something is that was issued then, by a clock that may differ.
fn age(issued: u64, arrived: Instant) -> Result<Duration, Rejected> {
    let now = unix(arrived);
    let ahead = issued.saturating_sub(now);
    if ahead > milliseconds(AHEAD) {
        return Err(Rejected::FromTheFuture(ahead));
    }
    Ok(Duration::from_millis(now.saturating_sub(issued)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_says_when_it_was_sent_may_be_older_by_what_the_clock_was_set_back() {
        let (now, second) = (Instant::now(), Duration::from_secs(1));
        let judge = |age: u64, set_back| age_of([None, Some(unix(now) - age)], now, second, set_back);
        assert!(judge(100, Duration::ZERO).is_ok_and(|age| age < second));
        assert!(judge(100, Duration::from_millis(300)).is_ok());
        assert!(matches!(judge(100, Duration::from_secs(5)), Err(Rejected::ClockSetBack(_))));
        assert!(matches!(judge(5_000, Duration::from_secs(5)), Err(Rejected::TooOld { .. })));
        // What says nothing of when it was sent has another proof of its age.
        assert!(age_of([None, None], now, second, Duration::from_secs(5)).is_ok());
    }
}
