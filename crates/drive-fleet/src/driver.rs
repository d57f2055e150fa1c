//! [`Driver`]: the driver of a drive, as its task uses it. One that panics is a fault of the program, and its drive goes on being
//! asked and stopped.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

use drive_core::{
    Direction, Drive, Error, Follower, Ground, Lease, Lifetimes, Refusal, Setpoint, later, panic_said,
};
use tokio::time::Instant;

use crate::{
    runs::Keeper,
    settings::{DriveSettings, RunRecord},
    supervisor::{Job, Lifetime, Question, Reply, Told},
};

/// The driver of a drive. What it is asked at once never panics here; a call may.
pub(crate) struct Driver {
    drive: Box<dyn Drive>,
    /// What it said last.
    lease: Option<Lease>,
    unmet: Option<Refusal>,
    panicked: Option<String>,
}

impl Driver {
    pub(crate) fn new(drive: Box<dyn Drive>) -> Self {
        Self { drive, lease: None, unmet: None, panicked: None }
    }

    /// What it has panicked in at once, if it has since this was last asked.
    pub(crate) fn take_panic(&mut self) -> Option<String> {
        self.panicked.take()
    }

    /// What it says or takes at once, or `otherwise` where it panics.
    fn at_once<T>(&mut self, otherwise: T, asked: impl FnOnce(&mut dyn Drive) -> T) -> T {
        catch_unwind(AssertUnwindSafe(|| asked(&mut *self.drive))).unwrap_or_else(|panic| {
            self.panicked = Some(panic_said(&*panic));
            otherwise
        })
    }

    /// What it is to know of the settings.
    pub(crate) fn configure(&mut self, settings: &DriveSettings) {
        let accepted: Vec<&str> = settings.accept_self_restart.iter().map(String::as_str).collect();
        self.at_once((), |drive| {
            drive.accept_self_restart(&accepted);
            drive.set_coast_time(settings.coast);
        });
    }

    /// Who hears of what a stop reads that does not show yet.
    pub(crate) fn follow_stops(&mut self, follower: Follower) {
        self.at_once((), |drive| drive.follow_stops(follower));
    }

    pub(crate) fn set_injection_time(&mut self, time: Option<Duration>) {
        self.at_once((), |drive| drive.set_injection_time(time));
    }

    pub(crate) fn adopt(&mut self, lease: Lease) {
        self.at_once((), |drive| drive.adopt(lease));
    }

    /// The run command of this side that stands, as it said last.
    pub(crate) fn lease(&mut self) -> Option<Lease> {
        self.lease = self.at_once(self.lease, |drive| drive.lease());
        self.lease
    }

    pub(crate) fn unmet(&mut self) -> Option<Refusal> {
        self.unmet = self.at_once(self.unmet, |drive| drive.unmet());
        self.unmet
    }

    pub(crate) fn take_changed(&mut self) -> Option<Ground> {
        self.at_once(None, |drive| drive.take_changed())
    }

    pub(crate) fn run_word_for(&mut self, direction: Direction) -> Option<u16> {
        self.at_once(None, |drive| drive.run_word_for(direction))
    }

    /// What a call gave, and the run command of this side as it stands behind it, of a drive that says to be this, and that is started at this.
    pub(crate) async fn carry_out(
        &mut self,
        keeper: &mut Keeper,
        job: Job,
        mut lifetime: Lifetime,
        (identity, asked_for): (Option<String>, Option<Setpoint>),
    ) -> (Reply, Option<Lease>) {
        if let Job::Start(direction) = job
            && let Some(word) = self.run_word_for(direction)
        {
            let began = Instant::now();
            let run = RunRecord::of(|| identity, Some(Lease::new(direction, word)), None);
            keeper.before(run).await;
            // The disk's time is the order's: a start is not sent late for it (rule 2).
            lifetime = lifetime.without(began.elapsed());
        }
        let reply = call(&mut *self.drive, job, lifetime, asked_for).await;
        (reply, self.lease())
    }
}

/// How long what a job asks may wait until it is sent. The time of an order is that order's alone: what looks at a stop is in
/// the class of commands, too, and waits for as long as it takes.
fn lifetimes(job: Job, lifetime: Lifetime) -> Lifetimes {
    let Lifetime { call, all, asked_as } = lifetime;
    let until = all.map(|all| later(Instant::now(), all));
    let usual = Lifetimes { polls_as: asked_as, ..Lifetimes::default() };
    match job {
        Job::Status { .. } => Lifetimes { status: call, ..usual },
        Job::SetSetpoint(..) | Job::Start(_) => Lifetimes { command: call, command_until: until, ..usual },
        // Their steps belong together: what has risen is to fall again.
        Job::ResetFaults | Job::Release | Job::Persist => {
            Lifetimes { command: call, begun_until: until, ..usual }
        }
        Job::Stop(_) | Job::Withdraw => Lifetimes { command: None, ..usual },
        _ => usual,
    }
}

/// A call that goes on where it was cut, if it is such a one.
async fn call(drive: &mut dyn Drive, job: Job, lifetime: Lifetime, asked_for: Option<Setpoint>) -> Reply {
    if let Some(kept) = drive.kept_mut() {
        match (job.keeps(), job) {
            (Some(number), _) => kept.begin(number),
            (None, Job::Status { anew: true }) => kept.forget(),
            (None, _) => kept.pause(),
        }
    }
    let reply = asked(drive, job, lifetime, asked_for).await;
    // What found no answer goes on as well.
    let ended = reply.error().is_none_or(|error| !matches!(error, Error::Port { .. }));
    if let (Some(kept), Some(number), true) = (drive.kept_mut(), job.keeps(), ended) {
        kept.end(number);
    }
    reply
}

/// A motor that runs by somebody else's command is not given the setpoint of a start that it will refuse.
async fn given(drive: &mut dyn Drive, setpoint: Setpoint, start: Option<Direction>) -> Result<(), Error> {
    if let Some(direction) = start {
        drive.may_start(direction, Some(setpoint)).await?;
    }
    drive.set_setpoint(setpoint).await
}

async fn asked(drive: &mut dyn Drive, job: Job, lifetime: Lifetime, asked_for: Option<Setpoint>) -> Reply {
    *drive.lifetimes_mut() = lifetimes(job, lifetime);
    match job {
        Job::Stop(mode) => Reply::stopped(drive.slave(), mode, drive.stop(mode).await),
        Job::Withdraw => Reply::Withdrawn(drive.withdraw().await),
        Job::Start(direction) => {
            Reply::started(drive.slave(), direction, asked_for, drive.start(direction).await)
        }
        Job::SetSetpoint(setpoint, start) => Reply::Setpoint(given(drive, setpoint, start).await),
        Job::ResetFaults => Reply::Ordered(drive.reset_faults().await),
        Job::Release => Reply::Ordered(drive.release().await),
        Job::Persist => Reply::Saved(drive.persist().await),
        Job::ArmWatchdog(timeout, reaction) => Reply::Watchdog(drive.arm_watchdog(timeout, reaction).await),
        Job::RestoreWatchdog(found) => Reply::Watchdog(drive.restore_watchdog(found).await),
        Job::KeepAlive => Reply::KeptAlive(drive.keep_alive().await),
        Job::Status { anew } => {
            if anew {
                drive.forget();
            }
            Reply::Status(drive.status().await)
        }
        Job::Identify => {
            let identity = drive.identify().await;
            Reply::Identity(identity.map(|identity| {
                let recognised = drive.recognise(&identity);
                (identity, recognised)
            }))
        }
        Job::Watchdog => Reply::Watchdog(drive.watchdog().await),
        Job::SelfRestarts => Reply::SelfRestarts(drive.self_restarts().await),
        Job::Faults => Reply::Faults(drive.faults().await),
        Job::Measurements => Reply::Measurements(drive.measurements().await),
        Job::Ask(Question::Faults) => Reply::Told(drive.faults().await.map(Told::Faults)),
        Job::Ask(Question::Read(row)) => Reply::Told(drive.read_parameter(row).await.map(Told::Word)),
        Job::Ask(Question::Write(row, word)) => {
            Reply::Told(drive.write_parameter(row, word).await.map(Told::Written))
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, Frequency, StopMode};

    use super::*;

    #[test]
    fn the_look_at_a_stop_has_all_the_time_whatever_was_left_to_the_order_before() {
        const MS_54: Duration = Duration::from_millis(54);
        let (time, usual) = (Some(MS_54), Lifetimes::default());
        let short = Lifetime { call: time, all: time, ..Lifetime::default() };
        let setpoint = Frequency::from_hertz(20).into();
        for order in [Job::SetSetpoint(setpoint, None), Job::Start(Direction::Forward)] {
            let of_order = lifetimes(order, short);
            assert_eq!(of_order.command, time, "{order:?}");
            assert!(of_order.command_until.is_some_and(|until| until <= Instant::now() + MS_54), "{order:?}");
        }
        for order in [Job::ResetFaults, Job::Release, Job::Persist] {
            let of_order = lifetimes(order, short);
            assert_eq!((of_order.command, of_order.command_until), (time, None), "{order:?}");
            assert!(of_order.begun_until.is_some_and(|until| until <= Instant::now() + MS_54), "{order:?}");
        }
        for stop in [Job::Stop(StopMode::Ramp), Job::Withdraw] {
            assert_eq!(lifetimes(stop, short), Lifetimes { command: None, ..usual }, "{stop:?}");
        }
        assert_eq!(lifetimes(Job::Status { anew: false }, short), Lifetimes { status: time, ..usual });
        assert_eq!(lifetimes(Job::KeepAlive, short), usual);
    }
}
