//! The task of one drive: it owns the conversation and does what the supervisor says.

use std::{
    collections::BTreeMap,
    pin::{Pin, pin},
    sync::Arc,
    time::Duration,
};

use drive_bus::{Latest, Slave};
use drive_core::{Direction, Drive, Error, Lease, Lifetimes, Setpoint};
use futures_util::future::poll_immediate;
use tokio::{
    sync::{AcquireError, OwnedSemaphorePermit, Semaphore, mpsc, oneshot, watch},
    time::{Instant, sleep_until},
};

use crate::{
    cause::Act,
    event::{ExitAction, Moment, Teller},
    message::{Message, Urgent},
    outcome::Refused,
    progress::Report,
    round::Round,
    runs::Keeper,
    settings::{DriveSettings, Left, RunRecord},
    snapshot::Snapshot,
    supervisor::{Asker, CallId, Job, Output, Question, Reply, Step, Supervisor, Told, Turn},
};

/// The task of one drive.
pub(crate) struct Task {
    pub(crate) drive: Box<dyn Drive>,
    pub(crate) desk: Desk,
    pub(crate) messages: mpsc::Receiver<Message>,
    pub(crate) urgent: mpsc::UnboundedReceiver<Urgent>,
    /// The turn that the drives of a line take one after the other.
    pub(crate) turns: Arc<Semaphore>,
    pub(crate) keeper: Keeper,
    /// What its line says of its answers.
    pub(crate) answers: Slave,
}

impl Task {
    /// Runs until the fleet has shut down, or nobody holds it any more and each stop that was given has ended.
    pub(crate) async fn run(self) {
        let Self { mut drive, mut desk, mut messages, mut urgent, turns, mut keeper, answers } = self;
        let (mut open, mut held) = (true, true);
        let mut losses = answers.port_losses();
        let mut retractions = answers.retractions();
        // Kept across the steps, so that a drive does not lose its place in the row.
        let mut waits_for_turn = None;
        let mut turn: Option<OwnedSemaphorePermit> = None;
        loop {
            if let Some(settings) = desk.settings.take() {
                let accepted: Vec<&str> = settings.accept_self_restart.iter().map(String::as_str).collect();
                drive.accept_self_restart(&accepted);
                drive.set_coast_time(settings.coast);
                keeper.follow_name(desk.supervisor.name());
            }
            drive.set_injection_time(desk.supervisor.injection());
            if let Some(lease) = desk.supervisor.take_adoption() {
                drive.adopt(lease);
            }
            // Also what a call that was dropped has left.
            let lease = drive.lease();
            desk.supervisor.handle_lease(lease);
            desk.supervisor.handle_unmet(drive.unmet());
            // The record of an earlier run stays kept until the drive has said whether it is ours.
            let stop = desk.supervisor.stop_under_way();
            if lease.is_some() || !desk.supervisor.is_adopting() {
                keeper.follow(lease, stop, || desk.supervisor.says_what_it_is());
            } else if let Some(stop) = stop {
                keeper.note_stop(stop);
            }
            if losses.has_changed().unwrap_or(false) {
                losses.look();
                desk.supervisor.handle_line_lost(Instant::now());
            }
            if let Some(ground) = drive.take_changed() {
                desk.supervisor.handle_changed(Instant::now(), ground);
            }
            retractions.look();
            if let Some(at) = answers.retracted() {
                desk.supervisor.handle_retracted(Instant::now(), at);
            }
            if let Some(at) = answers.answered_at() {
                desk.supervisor.handle_heard(at);
            }
            let step = desk.supervisor.next(Instant::now());
            if let Step::Do { job: Job::Start(direction), .. } = step
                && let Some(word) = drive.run_word_for(direction)
            {
                // It may turn the motor long before its driver has seen that it does: it is ours from now on.
                desk.supervisor.handle_lease(Some(Lease::new(direction, word)));
            }
            let (call, until) = match step {
                Step::Finished => {
                    desk.publish();
                    break;
                }
                Step::Wait(until) => (None, Some(until)),
                Step::Do { job, lifetime, until, .. } => {
                    let identity = desk.supervisor.says_what_it_is();
                    (Some(carry_out(&mut *drive, &mut keeper, job, lifetime, identity)), until)
                }
            };
            let on_turn = matches!(step, Step::Do { on_turn: true, .. });
            match desk.supervisor.turn() {
                Turn::Unwanted if !on_turn => {
                    waits_for_turn = None;
                    drop(turn.take());
                }
                Turn::Wanted if waits_for_turn.is_none() => {
                    waits_for_turn = Some(Box::pin(Arc::clone(&turns).acquire_owned()));
                }
                _ => {}
            }
            let talking = call.is_some();
            let mut call = pin!(async {
                match call {
                    Some(call) => call.await,
                    None => std::future::pending().await,
                }
            });
            // A stop waits for its line before anything is told of it.
            let at_once = match step {
                Step::Do { job: Job::Stop(_) | Job::Withdraw, .. } => poll_immediate(call.as_mut()).await,
                _ => None,
            };
            desk.tell();
            if let Some((reply, lease)) = at_once {
                desk.supervisor.handle_lease(lease);
                desk.supervisor.handle_reply(Instant::now(), reply);
                continue;
            }
            let mut timer = pin!(passing(until));
            // A stop is looked at before everything else, an order before the answer of a poll.
            loop {
                let alarm_at = desk.supervisor.stop_alarm_at().filter(|_| talking);
                let drops = tokio::select! {
                    biased;
                    message = urgent.recv(), if held => match message {
                        Some(message) => desk.handle_urgent(message),
                        None if desk.supervisor.handle_unheld() => {
                            held = false;
                            // What waits behind the stop would move what it has stopped.
                            messages.close();
                            while messages.try_recv().is_ok() {}
                            false
                        }
                        None => return,
                    },
                    message = messages.recv(), if open => match message {
                        Some(message) => desk.handle_message(message),
                        None => {
                            open = false;
                            continue;
                        }
                    },
                    // What is left of a call would be sent to whoever answers now.
                    () = changed(&mut losses) => desk.supervisor.handle_line_lost(Instant::now()),
                    // However long the call under way takes, what is withdrawn is good for nobody any more.
                    () = changed(&mut retractions) => match answers.retracted() {
                        Some(at) => desk.supervisor.handle_retracted(Instant::now(), at),
                        None => continue,
                    },
                    (reply, lease) = &mut call => {
                        // What it says is judged by what stands now.
                        desk.supervisor.handle_lease(lease);
                        desk.supervisor.handle_reply(Instant::now(), reply);
                        break;
                    }
                    granted = next_turn(&mut waits_for_turn) => {
                        waits_for_turn = None;
                        turn = granted;
                        desk.supervisor.grant_turn();
                        // A poll in flight is not disturbed by it.
                        if talking {
                            continue;
                        }
                        true
                    }
                    () = &mut timer => {
                        if let Some(at) = answers.answered_at() {
                            desk.supervisor.handle_heard(at);
                        }
                        if let Some(at) = desk.supervisor.goes_on(Instant::now()).filter(|_| talking) {
                            timer.set(passing(Some(at)));
                            continue;
                        }
                        true
                    }
                    // A call may take long on a line with dead drives; who waits for a stop hears in time that it does.
                    () = passing(alarm_at) => {
                        desk.supervisor.handle_stop_alarm(Instant::now());
                        desk.publish();
                        continue;
                    }
                    () = all_are_given(&mut desk.round) => {
                        desk.tell();
                        continue;
                    }
                };
                if drops || !talking {
                    desk.supervisor.handle_dropped(Instant::now());
                    break;
                }
                desk.tell();
            }
            if on_turn {
                drop(turn.take());
            }
        }
    }
}

/// Until the line counts one more.
async fn changed(count: &mut Latest<u64>) {
    if count.changed().await.is_err() {
        // Nobody will tell it any more.
        std::future::pending::<()>().await;
    }
}

/// Until this time, and for ever when there is none.
async fn passing(at: Option<Instant>) {
    match at {
        Some(at) => sleep_until(at).await,
        None => std::future::pending().await,
    }
}

/// Until each of the drives that are stopped together has been given its stop, and for ever where it is not one of several.
async fn all_are_given(round: &mut Option<Round>) {
    match round {
        Some(round) => round.all_are_given().await,
        None => std::future::pending().await,
    }
}

/// The turn of a drive that waits for it, and for ever otherwise.
async fn next_turn<F>(waits: &mut Option<Pin<Box<F>>>) -> Option<OwnedSemaphorePermit>
where
    F: Future<Output = Result<OwnedSemaphorePermit, AcquireError>>,
{
    match waits {
        // Nobody closes the row.
        Some(waits) => waits.await.ok(),
        None => std::future::pending().await,
    }
}

/// The supervisor and those who wait for its words.
pub(crate) struct Desk {
    pub(crate) supervisor: Supervisor,
    pub(crate) events: Teller,
    pub(crate) snapshots: watch::Sender<Arc<Snapshot>>,
    pub(crate) exit: watch::Sender<Option<(ExitAction, Left)>>,
    pub(crate) callers: BTreeMap<CallId, Report>,
    pub(crate) askers: BTreeMap<CallId, oneshot::Sender<Result<Told, Refused>>>,
    /// What the drive itself is to know of its settings from its next call on.
    pub(crate) settings: Option<Arc<DriveSettings>>,
    /// The drive is stopped with others, and what is told of its stop waits for theirs.
    pub(crate) round: Option<Round>,
}

impl Desk {
    fn handle_message(&mut self, message: Message) -> bool {
        let now = Instant::now();
        match message {
            Message::Order { id, order, leave, expires, act, reply } => {
                let withdrawn = reply.is_closed();
                let asker = self.caller(id, act, reply);
                if withdrawn {
                    self.supervisor.refuse(asker, order, Refused::Withdrawn);
                    return false;
                }
                self.supervisor.handle_order(now, asker, order, leave, expires)
            }
            Message::Question { id, question, name, reply } => {
                // Who does not wait any more leaves his place to the next.
                self.askers.retain(|_, asker| !asker.is_closed());
                let askers = &self.askers;
                self.supervisor.forget_questions(|id| !askers.contains_key(&id));
                self.askers.insert(id, reply);
                self.supervisor.handle_question(id, &name, question);
                false
            }
            Message::Ask { name, direction, setpoint, reply } => {
                let _ = reply.send(self.supervisor.leave(now, &name, direction, setpoint));
                false
            }
        }
    }

    fn handle_urgent(&mut self, message: Urgent) -> bool {
        let now = Instant::now();
        match message {
            Urgent::Stop { id, order, act, patience, round, reply } => {
                self.round = round;
                // A stop may be pending for hours; only those who still wait for it are kept.
                self.callers.retain(|_, caller| !caller.is_closed());
                let callers = &self.callers;
                self.supervisor.forget_callers(|id| !callers.contains_key(&id));
                let asker = self.caller(id, act, reply);
                self.supervisor.handle_stop(now, asker, order, patience)
            }
            Urgent::Withdraw(id) => self.supervisor.handle_withdrawal(now, id),
            Urgent::Settings(settings) => {
                self.supervisor.handle_settings(now, &settings);
                self.settings = Some(settings);
                false
            }
            Urgent::Renamed(settings, snapshots) => {
                // What has happened so far has happened to the drive of the old name.
                self.publish();
                self.supervisor.handle_settings(now, &settings);
                (self.settings, self.snapshots) = (Some(settings), snapshots);
                false
            }
            Urgent::Exit(why, round) => {
                self.round = Some(round);
                self.supervisor.handle_exit(now, why)
            }
            Urgent::Leave => self.supervisor.handle_leave(),
            Urgent::ExitTimeOver => {
                self.supervisor.handle_exit_time_over();
                true
            }
        }
    }

    fn caller(&mut self, id: CallId, act: Arc<Act>, reply: Report) -> Asker {
        self.callers.insert(id, reply);
        Asker::Caller { id, act }
    }

    /// The same, where each drive that is stopped with this one has been given its stop; else it is told when they have, and no later than
    /// what comes next.
    fn tell(&mut self) {
        match &mut self.round {
            Some(round) if !round.is_given() => round.give(),
            _ => {
                self.round = None;
                self.publish();
            }
        }
    }

    /// Tells what there is to tell: the snapshot first, so that who hears an outcome sees what it rests on.
    fn publish(&mut self) {
        if let Some(snapshot) = self.supervisor.take_snapshot(Instant::now()) {
            self.snapshots.send_replace(Arc::new(snapshot));
        }
        // One for all that is told now: who reads of a trip finds the change of the state that was read with it by its time.
        let moment = Moment::now();
        while let Some(output) = self.supervisor.poll_output() {
            match output {
                Output::Event(happened) => {
                    let drive = self.supervisor.name();
                    tracing::debug!(%drive, "{}", happened.kind);
                    self.events.tell(drive, moment, happened);
                }
                Output::Told(id, told) => {
                    if let Some(asker) = self.askers.remove(&id) {
                        let _ = asker.send(told);
                    }
                }
                Output::InForce(id, outcome) => {
                    if let Some(caller) = self.callers.get(&id) {
                        caller.send_modify(|progress| progress.in_force = Some(outcome));
                    }
                }
                Output::Answer(id, outcome) => {
                    if let Some(caller) = self.callers.remove(&id) {
                        caller.send_modify(|progress| progress.finished = Some(outcome));
                    }
                }
            }
        }
        if let Some(action) = self.supervisor.exit_action() {
            self.exit.send_replace(Some((action.clone(), self.supervisor.left())));
        }
    }
}

/// What a call gave, and the run command of this side as it stands behind it.
async fn carry_out(
    drive: &mut dyn Drive,
    keeper: &mut Keeper,
    job: Job,
    lifetime: Option<Duration>,
    identity: Option<String>,
) -> (Reply, Option<Lease>) {
    let mut lifetime = lifetime;
    if let Job::Start(direction) = job
        && let Some(word) = drive.run_word_for(direction)
    {
        let began = Instant::now();
        let run = RunRecord::of(|| identity, Some(Lease::new(direction, word)), None);
        keeper.before(run).await;
        // The disk's time is the order's: a start is not sent late for it (rule 2).
        lifetime = lifetime.map(|lifetime| lifetime.saturating_sub(began.elapsed()));
    }
    let reply = call(drive, job, lifetime).await;
    (reply, drive.lease())
}

/// How long what a job asks may wait until it is sent. The time of an order is that order's alone: what looks at a stop is in
/// the class of commands, too, and waits for as long as it takes.
fn lifetimes(job: Job, lifetime: Option<Duration>) -> Lifetimes {
    let usual = Lifetimes::default();
    match job {
        Job::Status { .. } => Lifetimes { status: lifetime, ..usual },
        Job::SetSetpoint(..) | Job::Start(_) | Job::ResetFaults | Job::Release | Job::Persist => {
            Lifetimes { command: lifetime, ..usual }
        }
        Job::Stop(_) | Job::Withdraw => Lifetimes { command: None, ..usual },
        _ => usual,
    }
}

/// A call that goes on where it was cut, if it is such a one.
async fn call(drive: &mut dyn Drive, job: Job, lifetime: Option<Duration>) -> Reply {
    if let Some(kept) = drive.kept_mut() {
        match (job.keeps(), job) {
            (Some(number), _) => kept.begin(number),
            (None, Job::Status { anew: true }) => kept.forget(),
            (None, _) => kept.pause(),
        }
    }
    let reply = asked(drive, job, lifetime).await;
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

async fn asked(drive: &mut dyn Drive, job: Job, lifetime: Option<Duration>) -> Reply {
    *drive.lifetimes_mut() = lifetimes(job, lifetime);
    match job {
        Job::Stop(mode) => Reply::Stopped(drive.stop(mode).await),
        Job::Withdraw => Reply::Withdrawn(drive.withdraw().await),
        Job::Start(direction) => Reply::Ordered(drive.start(direction).await),
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
        let (short, usual) = (Some(Duration::from_millis(54)), Lifetimes::default());
        let setpoint = Frequency::from_hertz(20).into();
        let orders = [Job::SetSetpoint(setpoint, None), Job::ResetFaults, Job::Release, Job::Persist];
        for order in [Job::Start(Direction::Forward)].into_iter().chain(orders) {
            assert_eq!(lifetimes(order, short), Lifetimes { command: short, ..usual }, "{order:?}");
        }
        for stop in [Job::Stop(StopMode::Ramp), Job::Withdraw] {
            assert_eq!(lifetimes(stop, short), Lifetimes { command: None, ..usual }, "{stop:?}");
        }
        assert_eq!(lifetimes(Job::Status { anew: false }, short), Lifetimes { status: short, ..usual });
        assert_eq!(lifetimes(Job::KeepAlive, short), usual);
    }
}
