//! Linux: a timer descriptor in the poll of the runtime itself. What it wakes is the thread that runs the line's task; a
//! timer on a thread of its own would have to wake that thread as well.

use std::{
    io,
    os::fd::OwnedFd,
    task::{Context, Poll, ready},
};

use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create, timerfd_settime,
};
use tokio::{
    io::{Interest, unix::AsyncFd},
    time::Instant,
};

pub(crate) struct Alarm {
    descriptor: AsyncFd<OwnedFd>,
    at: Instant,
}

impl Alarm {
    /// # Errors
    /// The system's, when the process has no descriptor left.
    pub(crate) fn new() -> io::Result<Self> {
        let flags = TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC;
        let descriptor = timerfd_create(TimerfdClockId::Monotonic, flags)?;
        #[expect(deprecated, reason = "sound for a descriptor that is owned; its successor is unsafe")]
        let descriptor = AsyncFd::with_interest(descriptor, Interest::READABLE)?;
        Ok(Self { descriptor, at: Instant::now() })
    }

    /// Rings at this time from now on, and at no earlier one.
    pub(crate) fn set(&mut self, now: Instant, at: Instant) {
        self.at = at;
        let wait = at.saturating_duration_since(now);
        let value = Timespec {
            tv_sec: i64::try_from(wait.as_secs()).unwrap_or(i64::MAX),
            // Zero would be no alarm at all.
            tv_nsec: i64::from(wait.subsec_nanos()).max(1),
        };
        let once = Itimerspec { it_interval: Timespec::default(), it_value: value };
        // It has a valid time and a valid descriptor, and nothing else that could be refused.
        let _ = timerfd_settime(&self.descriptor, TimerfdTimerFlags::empty(), &once);
    }

    pub(crate) fn poll(&self, context: &mut Context<'_>) -> Poll<()> {
        loop {
            // An error means that the runtime ends.
            let Ok(mut ready) = ready!(self.descriptor.poll_read_ready(context)) else {
                return Poll::Ready(());
            };
            // The descriptor is never read: setting it anew takes back that it has rung, and so does this for the runtime.
            ready.clear_ready();
            if Instant::now() >= self.at {
                return Poll::Ready(());
            }
        }
    }
}
