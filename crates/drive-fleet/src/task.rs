//! The task of one drive: it owns the conversation and does what the supervisor says.

use std::{collections::BTreeMap, panic::AssertUnwindSafe, pin::pin, sync::Arc, time::Duration};

use drive_bus::{Latest, Slave};
use drive_core::{Drive, Followed, Lease, panic_said};
use futures_util::{FutureExt, future::poll_immediate};
use tokio::{
    sync::{mpsc, oneshot, watch},
    time::{Instant, sleep, sleep_until},
};

use crate::{
    cause::Act,
    driver::Driver,
    event::{ExitAction, Moment, Teller},
    message::{Message, Urgent},
    outcome::Refused,
    place::Place,
    progress::{Progress, Report},
    round::Round,
    row::Row,
    runs::Keeper,
    settings::{DriveSettings, Left},
    snapshot::Snapshot,
    supervisor::{Asker, CallId, Job, Output, Step, Supervisor, Told, Turn},
};

/// Until a drive is gone on with whose task has panicked beside a call: a call has its own pause.
const AFTER_PANIC: Duration = Duration::from_millis(10);

/// The task of one drive.
pub(crate) struct Task {
    pub(crate) drive: Box<dyn Drive>,
    pub(crate) desk: Desk,
    pub(crate) messages: mpsc::Receiver<Message>,
    pub(crate) urgent: mpsc::UnboundedReceiver<Urgent>,
    /// The turn that the drives of a line take one after the other.
    pub(crate) turns: Row,
    /// The turn that they take to start.
    pub(crate) starts: Row,
    pub(crate) keeper: Keeper,
    /// What its line says of its answers.
    pub(crate) answers: Slave,
}

impl Task {
    /// Runs until the fleet has shut down, or nobody holds it any more and each stop that was given has ended. **No panic ends it**: a motor whose driver has a fault is to be
    /// stopped all the same.
    pub(crate) async fn run(self) {
        let Self { drive, desk, messages, urgent, turns, starts, keeper, answers } = self;
        let (losses, retractions) = (answers.port_losses(), answers.retractions());
        let (follower, followed) = watch::channel(None);
        let mut driver = Driver::new(drive);
        driver.follow_stops(follower);
        let mut talk = Talk {
            driver,
            desk,
            messages,
            open: true,
            held: true,
            urgent,
            turns,
            starts,
            keeper,
            answers,
            losses,
            retractions,
            followed,
        };
        while let Err(panic) = AssertUnwindSafe(talk.go_on()).catch_unwind().await {
            let in_a_call = talk.desk.supervisor.handle_panicked(Instant::now(), panic_said(&*panic));
            if !in_a_call {
                sleep(AFTER_PANIC).await;
            }
        }
    }
}

/// The conversation of a task with its drive.
struct Talk {
    driver: Driver,
    desk: Desk,
    messages: mpsc::Receiver<Message>,
    /// Somebody may still send some.
    open: bool,
    /// Somebody holds the fleet.
    held: bool,
    urgent: mpsc::UnboundedReceiver<Urgent>,
    turns: Row,
    starts: Row,
    keeper: Keeper,
    answers: Slave,
    losses: Latest<u64>,
    retractions: Latest<u64>,
    /// What a stop has read that does not show yet.
    followed: watch::Receiver<Option<Followed>>,
}

impl Talk {
    /// Until it is over.
    async fn go_on(&mut self) {
        let Self {
            driver,
            desk,
            messages,
            open,
            held,
            urgent,
            turns,
            starts,
            keeper,
            answers,
            losses,
            retractions,
            followed,
        } = self;
        loop {
            if let Some(settings) = desk.settings.take() {
                driver.configure(&settings);
                keeper.follow_name(desk.supervisor.name());
            }
            driver.set_injection_time(desk.supervisor.injection());
            if let Some(lease) = desk.supervisor.take_adoption() {
                driver.adopt(lease);
            }
            // Also what a call that was dropped has left.
            let lease = driver.lease();
            desk.supervisor.handle_lease(lease);
            desk.supervisor.handle_unmet(driver.unmet());
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
            if let Some(ground) = driver.take_changed() {
                desk.supervisor.handle_changed(Instant::now(), ground);
            }
            retractions.look();
            if let Some(at) = answers.retracted() {
                desk.supervisor.handle_retracted(Instant::now(), at);
            }
            if let Some(at) = answers.answered_at() {
                desk.supervisor.handle_heard(at);
            }
            if let Some(said) = driver.take_panic() {
                desk.supervisor.note_panic(said);
            }
            let step = desk.supervisor.next(Instant::now());
            match desk.supervisor.start_turn() {
                Turn::Unwanted => starts.leave(),
                Turn::Wanted if starts.stand() => desk.supervisor.handle_row(),
                Turn::Wanted | Turn::Granted => {}
            }
            let on_turn = matches!(step, Step::Do { on_turn: true, .. });
            match desk.supervisor.turn() {
                Turn::Unwanted if !on_turn => turns.leave(),
                Turn::Wanted => {
                    turns.stand();
                }
                Turn::Unwanted | Turn::Granted => {}
            }
            if let Step::Do { job: Job::Start(direction), .. } = step
                && let Some(word) = driver.run_word_for(direction)
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
                    desk.begin_order();
                    let identity = desk.supervisor.says_what_it_is();
                    let asked_for = desk.supervisor.starts_at();
                    (Some(driver.carry_out(keeper, job, lifetime, (identity, asked_for))), until)
                }
            };
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
                    message = urgent.recv(), if *held => match message {
                        Some(message) => desk.handle_urgent(message),
                        None if desk.supervisor.handle_unheld() => {
                            *held = false;
                            // What waits behind the stop would move what it has stopped.
                            messages.close();
                            while messages.try_recv().is_ok() {}
                            false
                        }
                        None => return,
                    },
                    message = messages.recv(), if *open => match message {
                        Some(message) => desk.handle_message(message),
                        None => {
                            *open = false;
                            continue;
                        }
                    },
                    // What is left of a call would be sent to whoever answers now.
                    () = changed(losses) => desk.supervisor.handle_line_lost(Instant::now()),
                    // However long the call under way takes, what is withdrawn is good for nobody any more.
                    () = changed(retractions) => match answers.retracted() {
                        Some(at) => desk.supervisor.handle_retracted(Instant::now(), at),
                        None => continue,
                    },
                    (reply, lease) = &mut call => {
                        // What it says is judged by what stands now.
                        desk.supervisor.handle_lease(lease);
                        desk.supervisor.handle_reply(Instant::now(), reply);
                        break;
                    }
                    // A stop that is not obeyed is waited for by its driver alone: what that reads meanwhile is what is so.
                    heard = next_of(followed), if talking => {
                        if let Some(heard) = heard {
                            desk.supervisor.handle_followed(Instant::now(), heard);
                        }
                        false
                    }
                    () = starts.come() => desk.supervisor.grant_start_turn(),
                    () = turns.come() => {
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
                turns.leave();
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

/// What a stop hears next, and for ever where nothing is told.
async fn next_of(followed: &mut watch::Receiver<Option<Followed>>) -> Option<Followed> {
    match followed.changed().await {
        Ok(()) => followed.borrow_and_update().clone(),
        Err(_) => std::future::pending().await,
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

/// The supervisor and those who wait for its words.
pub(crate) struct Desk {
    pub(crate) supervisor: Supervisor,
    /// Which machine it is.
    pub(crate) place: Place,
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
                // It is sent at once, or is taken in by one that was.
                self.begin(id);
                self.supervisor.handle_stop(now, asker, order, patience)
            }
            Urgent::Withdraw(id) => self.supervisor.handle_withdrawal(now, id),
            Urgent::Settings(settings) => {
                let drops = self.supervisor.handle_settings(now, &settings);
                self.settings = Some(settings);
                drops
            }
            Urgent::Renamed(settings, snapshots) => {
                // What has happened so far has happened to the drive of the old name.
                self.publish();
                let drops = self.supervisor.handle_settings(now, &settings);
                (self.settings, self.snapshots) = (Some(settings), snapshots);
                drops
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

    /// Of the order that is sent now nobody is told any more that it was not, whatever becomes of this task.
    fn begin_order(&self) {
        if let Some(id) = self.supervisor.asker_of_sent() {
            self.begin(id);
        }
    }

    fn begin(&self, id: CallId) {
        let begin = |progress: &mut Progress| {
            progress.begun = true;
            // There is nothing to be heard.
            false
        };
        self.callers.get(&id).map(|caller| caller.send_if_modified(begin));
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
        // One for all that is told now: who reads of a trip finds the change of the state that was read with it by its time, and no alarm that
        // comes of the snapshot is older than what happened.
        let moment = Moment::now();
        if let Some(snapshot) = self.supervisor.take_snapshot(Instant::now()) {
            self.snapshots.send_replace(Arc::new(snapshot));
        }
        while let Some(output) = self.supervisor.poll_output() {
            match output {
                Output::Event(happened) => {
                    let drive = self.supervisor.name();
                    tracing::debug!(%drive, "{}", happened.kind);
                    self.events.tell(drive, self.place.clone(), moment, happened);
                }
                Output::Untold(id) => drop(self.askers.remove(&id)),
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
