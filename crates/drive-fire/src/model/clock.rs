//! The one clock of the worlds in which a master goes on by itself.

use std::time::Duration;

use drive_bus::master::Master;
use tokio::time::Instant;

use super::Held;

/// A port is open again so soon.
const REOPENED: Duration = Duration::from_millis(10);

/// A world around a master, whose time goes from one thing that happens to the next.
pub(super) trait Clocked {
    fn master(&mut self) -> &mut Master<u32>;

    fn now(&mut self) -> &mut Instant;

    /// The master has told outcomes.
    fn collect(&mut self) -> Held;

    /// The master has sent this.
    fn transmitted(&mut self, frame: &[u8]) -> Held;

    /// What was heard of before belongs to a port that was left.
    fn port_is_left(&mut self) {}

    /// When something happens beside the master, by itself.
    fn next(&self) -> Option<Instant> {
        None
    }

    /// It happens.
    fn happens(&mut self) -> Held {
        Ok(())
    }

    /// So much time passes, and whatever happens in it happens.
    fn run_for(&mut self, time: Duration) -> Held {
        let until = *self.now() + time;
        while self.goes_on_before(until)? {}
        let now = self.now();
        *now = until.max(*now);
        Ok(())
    }

    /// The next thing that happens by itself before `until`; false: nothing.
    fn goes_on_before(&mut self, until: Instant) -> Result<bool, &'static str> {
        let now = *self.now();
        self.master().handle_timeout(now);
        self.collect()?;
        // A port that brings nothing is left, and opened again.
        if let Some(why) = self.master().poll_mute(now) {
            self.port_is_left();
            self.master().handle_lost(now, &why);
            self.collect()?;
            *self.now() = now + REOPENED;
            self.master().handle_up(now + REOPENED);
            return Ok(true);
        }
        if let Some(frame) = self.master().poll_transmit(now) {
            self.transmitted(&frame)?;
            self.master().handle_sent(now);
            return Ok(true);
        }
        let (due, beside) = (self.master().deadline(), self.next());
        let Some(next) = due.into_iter().chain(beside).min().filter(|next| *next <= until) else {
            return Ok(false);
        };
        if beside == Some(next) {
            *self.now() = next.max(now);
            self.happens()?;
            return Ok(true);
        }
        // What is due and does nothing waits for something else.
        if next <= now {
            return Ok(false);
        }
        *self.now() = next;
        Ok(true)
    }
}
