//! How far something is that takes longer than a second: one line on stderr, where that is a terminal, gone at the end.

use std::{
    fmt,
    io::{self, IsTerminal as _, Write as _},
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use tokio::time::{Instant, MissedTickBehavior, interval_at};

use super::terminal;

/// What is done earlier needs no progress.
const SHOWN_AFTER: Duration = Duration::from_secs(1);
/// The line is written anew no more often than this.
const WRITTEN_EVERY: Duration = Duration::from_millis(100);
/// Fewer steps than these say nothing of the time that is left.
const TOLD_AFTER: usize = 3;

/// Whether the last line of the terminal is a progress. What is said meanwhile takes it away first.
static SHOWN: AtomicBool = AtomicBool::new(false);

/// How far something is that is done in steps: `pump 1: 12 of 247, about 14 s left`.
///
/// It is written by whoever makes a step, when it has taken a second; `output::say` writes above it. It is gone when it is
/// dropped. Where stderr is no terminal it says nothing.
#[derive(Debug)]
pub struct Progress {
    what: String,
    note: String,
    done: usize,
    of: usize,
    began: Instant,
    written: Option<Instant>,
    is_shown: bool,
}

impl Progress {
    /// Something that has so many steps.
    pub fn of(what: impl fmt::Display, of: usize) -> Self {
        Self {
            what: what.to_string(),
            note: String::new(),
            done: 0,
            of,
            began: Instant::now(),
            written: None,
            is_shown: io::stderr().is_terminal(),
        }
    }

    /// One step more is done.
    pub fn step(&mut self) {
        self.at(self.done + 1);
    }

    /// So many steps are done.
    pub fn at(&mut self, done: usize) {
        self.done = done;
        self.write(Instant::now());
    }

    /// What is done at present stands behind the count: `9600 8E1`.
    pub fn note(&mut self, note: impl fmt::Display) {
        self.note = note.to_string();
        self.write(Instant::now());
    }

    fn write(&mut self, now: Instant) {
        let is_due = self.written.is_none_or(|written| now - written >= WRITTEN_EVERY);
        if self.is_shown && now - self.began >= SHOWN_AFTER && is_due {
            self.written = Some(now);
            show(&self.text(now - self.began));
        }
    }

    /// What it says after so long.
    fn text(&self, taken: Duration) -> String {
        let Self { what, note, done, of, .. } = self;
        let note = if note.is_empty() { String::new() } else { format!(", {note}") };
        let left = match (u32::try_from(*done), u32::try_from(of.saturating_sub(*done))) {
            (Ok(done), Ok(left)) if left > 0 && *of > 0 && done as usize >= TOLD_AFTER => {
                format!(", about {} left", rounded((taken / done).saturating_mul(left)))
            }
            _ => String::new(),
        };
        format!("{what}: {done} of {of}{note}{left}")
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        make_room();
    }
}

/// Waits for something that has no steps, and shows for how long: `capturing north: 3 of 10 s`. Dropping it drops the work.
pub async fn during<T>(what: impl fmt::Display, whole: Option<Duration>, work: impl Future<Output = T>) -> T {
    if !io::stderr().is_terminal() {
        return work.await;
    }
    let began = Instant::now();
    let mut ticks = interval_at(began + SHOWN_AFTER, SHOWN_AFTER);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    tokio::pin!(work);
    let _gone_at_the_end = Gone;
    loop {
        tokio::select! {
            biased;
            done = &mut work => return done,
            _ = ticks.tick() => show(&waited(&what, began.elapsed(), whole)),
        }
    }
}

/// Takes the line away when it is dropped.
struct Gone;

impl Drop for Gone {
    fn drop(&mut self) {
        make_room();
    }
}

fn waited(what: impl fmt::Display, taken: Duration, whole: Option<Duration>) -> String {
    match whole {
        Some(whole) => format!("{what}: {} of {}", taken.as_secs().min(whole.as_secs()), rounded(whole)),
        None => format!("{what}: {}", rounded(taken)),
    }
}

/// A time as somebody waits for it.
fn rounded(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7200 => format!("{} min", seconds.div_ceil(60)),
        _ => format!("{} h", seconds.div_ceil(3600)),
    }
}

/// Takes the progress away, for what is said now.
pub(super) fn make_room() {
    if SHOWN.swap(false, Ordering::Relaxed) {
        write("");
    }
}

fn show(text: &str) {
    SHOWN.store(true, Ordering::Relaxed);
    let width = terminal::width(&io::stderr()).unwrap_or(usize::MAX).saturating_sub(1);
    write(&text.chars().take(width).collect::<String>());
}

/// Puts a text in the place of the last one.
fn write(text: &str) {
    let mut stderr = io::stderr().lock();
    // Nobody's work ends because this cannot be shown.
    let _ = write!(stderr, "\r\x1b[K{text}").and_then(|()| stderr.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_reckoned_from_what_was_done() {
        let mut progress = Progress::of("north", 200);
        assert_eq!(progress.text(Duration::from_secs(9)), "north: 0 of 200");
        progress.done = 50;
        assert_eq!(progress.text(Duration::from_secs(10)), "north: 50 of 200, about 30 s left");
        assert_eq!(progress.text(Duration::from_secs(100)), "north: 50 of 200, about 5 min left");
        progress.note = "9600 8E1".to_owned();
        progress.done = 200;
        assert_eq!(progress.text(Duration::from_secs(40)), "north: 200 of 200, 9600 8E1");
    }

    #[test]
    fn a_wait_tells_how_long_it_has_lasted() {
        let second = Duration::from_secs;
        assert_eq!(waited("capturing north", second(3), Some(second(10))), "capturing north: 3 of 10 s");
        assert_eq!(waited("asking atv312@1", second(3), None), "asking atv312@1: 3 s");
    }

    #[tokio::test(start_paused = true)]
    async fn what_is_waited_for_is_given_as_it_came() {
        let slow = async {
            tokio::time::sleep(Duration::from_secs(30)).await;
            7
        };
        assert_eq!(during("something slow", None, slow).await, 7);
    }
}
