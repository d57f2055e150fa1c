//! What is due: what is done now, the most urgent first, what is done on the drive's turn, and when to look again.

use drive_core::Error;
use tokio::time::Instant;

use super::{
    Job, Lifetime, Question, Step, Supervisor, Turn, orders::Active, stopping::Stopping, withdraw::Withdrawal,
};
use crate::snapshot::Link;

impl Supervisor {
    /// What to do now. A job that it gives is in flight until its reply or [`handle_dropped`](Self::handle_dropped).
    pub(crate) fn next(&mut self, now: Instant) -> Step {
        // What the time has ended ends before anything is chosen: nothing that has expired is sent.
        self.handle_time(now);
        if self.is_gone() {
            return Step::Finished;
        }
        self.turn_ends = None;
        let urgent = self.choose(now);
        // Whose turn it is to start is seen before anything else is begun.
        if urgent.is_none() && self.active.as_ref().is_some_and(Active::asks_for_turn) {
            return Step::Wait(now);
        }
        let Some((job, until)) = urgent.or_else(|| self.choose_background(now)) else {
            return Step::Wait(self.wake_at(now));
        };
        let on_turn = urgent.is_none();
        let lifetime = self.lifetime(now, job, on_turn);
        if let Job::Start(_) = job {
            // A new run command takes the place of the one that was to be withdrawn.
            self.withdrawal = None;
        }
        self.note_act(job);
        self.wearing = self.wears(job);
        if let Job::Ask(_) = job {
            self.begin_question();
        }
        self.in_flight = Some(job);
        self.changed = true;
        Step::Do { job, on_turn, lifetime, until }
    }

    /// What is most urgent, and how long it may hold up the rest.
    fn choose(&mut self, now: Instant) -> Option<(Job, Option<Instant>)> {
        if let Some(job) = self.stop_job(now) {
            return Some((job, None));
        }
        // A run command that is not in force may act at any moment (rule 5): before every order.
        if let Some(job) = self.withdraw_job(now).or_else(|| self.restore_job()) {
            return Some((job, None));
        }
        if let Some(job) = self.stopped_identity_job(now) {
            return Some((job, None));
        }
        let feed_at = self.checks.feed_at().filter(|_| self.link == Link::Connected);
        let hungry = feed_at.is_some_and(|at| at <= now);
        let anew = self.doubtful || self.unseen || self.link != Link::Connected;
        let status = (Job::Status { anew }, feed_at);
        // A stream of orders must not blind the fleet for the drive that it commands.
        if !hungry && self.pace.status_due() + self.settings.periods.rest <= now {
            return Some(status);
        }
        if let Some(order) = self.order_job(now) {
            return Some(order);
        }
        if self.active.as_ref().is_some_and(Active::asks_for_turn) {
            return None;
        }
        // Behind the orders, whose own frames feed the drive as well.
        if hungry {
            return Some((Job::KeepAlive, None));
        }
        (self.pace.status_due() <= now).then_some(status)
    }

    /// What is done on the drive's turn, when it has it.
    fn choose_background(&mut self, now: Instant) -> Option<(Job, Option<Instant>)> {
        let wanted = match self.link {
            Link::Connected => self.background_job(now),
            // What answers and refuses is asked what it is, and nothing else.
            _ => self
                .checks
                .identity_job(now)
                .filter(|_| matches!(self.last_error, Some(Error::Exception { .. }))),
        };
        let Some(job) = wanted else {
            self.turn = Turn::Unwanted;
            return None;
        };
        if self.turn != Turn::Granted {
            self.turn = Turn::Wanted;
            return None;
        }
        self.turn = Turn::Unwanted;
        // A write is not left half done for a poll, and its frames feed the drive as well.
        if let Job::ArmWatchdog(..) | Job::Ask(Question::Write(..)) = job {
            return Some((job, None));
        }
        let ends = self.pace.status_due().max(now + self.settings.periods.max_age / 3);
        self.turn_ends = Some(ends);
        // Nobody feeds the watchdog of a drive that is lost.
        let feed_at = self.checks.feed_at().filter(|_| self.link == Link::Connected);
        Some((job, Some(feed_at.map_or(ends, |at| at.min(ends)))))
    }

    /// Whether the drive wants its turn.
    pub(crate) const fn turn(&self) -> Turn {
        self.turn
    }

    /// The drive has its turn.
    pub(crate) const fn grant_turn(&mut self) {
        self.turn = Turn::Granted;
    }

    /// Whether the drive wants the turn in which those of its line start, one after the other.
    pub(crate) fn start_turn(&self) -> Turn {
        self.active.as_ref().map_or(Turn::Unwanted, Active::start_turn)
    }

    /// The drive has the turn to start. Gives whether the job in flight has to be dropped for it.
    pub(crate) fn grant_start_turn(&mut self) -> bool {
        self.active.as_mut().map(Active::grant_turn).is_some() && self.poll_gives_way()
    }

    /// Others of its line are before it.
    pub(crate) fn handle_row(&mut self) {
        if let Some(active) = &mut self.active {
            active.stand_in_row();
        }
    }

    fn background_job(&self, now: Instant) -> Option<Job> {
        // What is known of the drive is read anew first, or it would be asked by what another one has said.
        if self.unseen || self.exit_action().is_some() {
            return None;
        }
        if self.explanations > 0 {
            return Some(Job::Faults);
        }
        if let Some(job) = self.checks.job(now, self.settings.control, self.stands()) {
            return Some(job);
        }
        self.question_job().or_else(|| (self.pace.slow_due() <= now).then_some(Job::Measurements))
    }

    fn lifetime(&self, now: Instant, job: Job, on_turn: bool) -> Lifetime {
        match job {
            // Which drive it is decides whether a stop of before is its own: it is looked for as the stop itself would be given.
            Job::Status { .. } if self.owes_stop_of_before() && self.link != Link::Connected => {
                Lifetime::FOR_A_STOP
            }
            Job::Identify if self.owes_stop_of_before() => Lifetime::FOR_A_STOP,
            Job::Watchdog if !on_turn => Lifetime::FOR_AN_ORDER,
            Job::Status { .. } => {
                Lifetime { call: Some(self.pace.until_next(now, self.is_busy())), ..Lifetime::default() }
            }
            Job::SetSetpoint(..) | Job::Start(_) | Job::ResetFaults | Job::Release | Job::Persist => {
                self.order_lifetime(now)
            }
            _ => Lifetime::default(),
        }
    }

    /// When something is to be done at the latest.
    fn wake_at(&self, now: Instant) -> Instant {
        let mut at = self.pace.status_due();
        if self.link == Link::Connected {
            at = at.min(self.lost_at());
            at = self.checks.feed_at().into_iter().fold(at, Instant::min);
            if self.turn == Turn::Unwanted && !self.unseen && self.exit_action().is_none() {
                at = at.min(self.pace.slow_due());
                at = self.checks.wake_at().into_iter().fold(at, Instant::min);
            }
        }
        let stop = self.stopping.as_ref().and_then(Stopping::wake_at);
        let order = self.active.as_ref().and_then(Active::wake_at);
        let withdrawal = self.withdrawal.as_ref().and_then(Withdrawal::wake_at).filter(|_| !self.is_unseen());
        stop.into_iter().chain(order).chain(withdrawal).fold(at, Instant::min).max(now)
    }

    fn handle_time(&mut self, now: Instant) {
        if self.link != Link::Lost && now >= self.lost_at() {
            self.lose(now);
        }
        self.checks.hold_back(self.watchdog_wears && self.ledger.is_worn(now).is_some());
        self.check_stop_times(now);
        self.check_order_times(now);
        self.advance_exit(now);
    }

    fn lost_at(&self) -> Instant {
        self.silent_since + self.settings.periods.max_age
    }

    /// Until when the job in flight goes on although its time is over: the frames of a status, or of what the drive does on its
    /// turn, feed it as well, so it is not cut for a keep-alive while they are answered.
    pub(crate) fn goes_on(&self, now: Instant) -> Option<Instant> {
        let fed_until = self.checks.feed_at()?;
        let until = match self.in_flight? {
            Job::Status { .. } => fed_until,
            _ => fed_until.min(self.turn_ends?),
        };
        (until > now).then_some(until)
    }

    /// When a stop under way becomes an alarm or is over for those who wait for it, whatever is in flight.
    pub(crate) fn stop_alarm_at(&self) -> Option<Instant> {
        self.stopping.as_ref().and_then(Stopping::alarm_at)
    }

    /// [`stop_alarm_at`](Self::stop_alarm_at) has passed.
    pub(crate) fn handle_stop_alarm(&mut self, now: Instant) {
        self.changed = true;
        self.check_stop_times(now);
    }
}
