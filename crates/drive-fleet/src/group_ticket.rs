//! Tickets of what several drives were told together.

use std::{
    fmt,
    future::IntoFuture,
    pin::Pin,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use futures_util::future::join_all;
use tokio::{runtime::Handle, sync::watch, task::AbortHandle};

use crate::{
    outcome::{Outcome, Refused},
    progress::{Hearer, outcome},
    ticket::{StopTicket, Ticket},
};

/// A stop that was given to several drives: all of it is on its way, whether or not anybody awaits this.
///
/// Awaiting it gives what [`finished`](Self::finished) gives. **A stop is never withdrawn**: when this is dropped every drive is
/// stopped all the same, and each drive's own task repeats its stop until the drive stands, as of a [`StopTicket`].
#[derive(Debug, Clone)]
#[must_use = "a stop that is not confirmed is an alarm"]
pub struct GroupStop {
    each: Vec<(Arc<str>, StopTicket)>,
    read_only: Vec<Arc<str>>,
    /// The lines, and whether the broadcast went out, when that is known.
    broadcasts: Vec<(Arc<str>, watch::Receiver<Option<bool>>)>,
}

impl GroupStop {
    pub(crate) const fn new(
        each: Vec<(Arc<str>, StopTicket)>,
        read_only: Vec<Arc<str>>,
        broadcasts: Vec<(Arc<str>, watch::Receiver<Option<bool>>)>,
    ) -> Self {
        Self { each, read_only, broadcasts }
    }

    /// The stop of each drive that may be commanded.
    pub fn each(&self) -> &[(Arc<str>, StopTicket)] {
        &self.each
    }

    /// Waits until each drive shows that no run command is in force any more, which is what `confirmed` means in this
    /// report, or until its time is over.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn in_force(&self) -> StopReport {
        self.report(join_all(self.each.iter().map(|(_, stop)| stop.in_force())).await).await
    }

    /// Waits until each drive stands, or until its time is over: its stop goes on being repeated then.
    ///
    /// # Cancellation
    /// Safe to drop.
    pub async fn finished(&self) -> StopReport {
        self.report(join_all(self.each.iter().map(|(_, stop)| stop.finished())).await).await
    }

    async fn report(&self, outcomes: Vec<Outcome>) -> StopReport {
        let mut report = StopReport { read_only: self.read_only.clone(), ..StopReport::default() };
        for ((name, _), outcome) in self.each.iter().zip(outcomes) {
            if outcome.is_confirmed() {
                report.confirmed.push(Arc::clone(name));
            } else {
                report.unconfirmed.push((Arc::clone(name), outcome));
            }
        }
        for (line, sent) in &self.broadcasts {
            if sent.clone().wait_for(Option::is_some).await.is_ok_and(|sent| *sent == Some(true)) {
                report.broadcasts.push(Arc::clone(line));
            }
        }
        report
    }
}

impl IntoFuture for GroupStop {
    type Output = StopReport;
    type IntoFuture = Pin<Box<dyn Future<Output = StopReport> + Send>>;

    fn into_future(self) -> Self::IntoFuture {
        Box::pin(async move { self.finished().await })
    }
}

/// What became of a stop of several drives.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[must_use = "a stop that is not confirmed is an alarm"]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StopReport {
    /// Drives that show standstill.
    pub confirmed: Vec<Arc<str>>,
    /// Drives that do not, and why. Their stops go on being repeated.
    #[cfg_attr(feature = "serde", serde(serialize_with = "crate::view::by_drive"))]
    #[cfg_attr(feature = "schemars", schemars(with = "Vec<crate::view::OfDrive>"))]
    pub unconfirmed: Vec<(Arc<str>, Outcome)>,
    /// Drives that are only read: nothing was sent to them.
    pub read_only: Vec<Arc<str>>,
    /// Lines on which one broadcast went out first.
    pub broadcasts: Vec<Arc<str>>,
}

impl StopReport {
    /// Whether every drive that may be commanded shows standstill.
    #[must_use]
    pub fn is_confirmed(&self) -> bool {
        self.unconfirmed.is_empty()
    }
}

impl fmt::Display for StopReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} confirmed", self.confirmed.len())?;
        for (name, outcome) in &self.unconfirmed {
            write!(f, "; {name}: {outcome}")?;
        }
        Ok(())
    }
}

/// How far a command of a group has come.
#[derive(Debug)]
struct Progress<T> {
    in_force: Option<T>,
    finished: Option<T>,
}

/// The tickets of the members: dropped with the group's, they withdraw what nobody has heard of.
type Held = Arc<Mutex<Vec<Ticket>>>;

/// What was given to which member, for whoever hears nothing from the steps any more; `None` once the group's ticket is dropped, for an order
/// whose ticket nobody has is withdrawn.
type Given = Arc<Mutex<Option<Vec<(Arc<str>, Hearer)>>>>;

/// Where the steps of a group's command tell what they have done.
pub(crate) struct Told<T> {
    progress: watch::Sender<Progress<T>>,
    held: Held,
    given: Given,
}

impl<T> Told<T> {
    /// It is in force, and not finished yet.
    pub(crate) fn in_force(&self, outcome: T) {
        self.progress.send_modify(|progress| progress.in_force = Some(outcome));
    }

    /// An order was given to this member as a part of it.
    pub(crate) fn give(&self, member: &Arc<str>, ticket: &Ticket) {
        if let Some(given) = &mut *lock(&self.given) {
            given.extend(ticket.hearer().map(|hearer| (Arc::clone(member), hearer)));
        }
    }

    /// This order is a part of it, and has ended.
    pub(crate) fn hold(&self, ticket: Ticket) {
        lock(&self.held).push(ticket);
    }
}

/// A start or a setpoint that was given to several drives: a task of the fleet carries it out, one drive of a line after the
/// other, whether or not anybody awaits this.
///
/// Awaiting it gives what [`finished`](Self::finished) gives.
///
/// # Dropping
/// **When it is dropped before its outcome was heard it is withdrawn**, drive by drive as by the drives' own
/// [tickets](Ticket#dropping): no further drive is commanded, and those that were started are stopped again along their ramps,
/// where nobody else has started or stopped them since. When it is dropped after its outcome was heard the motors go on.
#[must_use = "a command is withdrawn when its ticket is dropped before its outcome was heard"]
pub struct GroupTicket<T> {
    progress: watch::Receiver<Progress<T>>,
    held: Held,
    given: Given,
    steps: AbortHandle,
    members: Vec<Arc<str>>,
    abandoned: Abandoned<T>,
}

/// What is told when the runtime has ended before the steps have, by what became of each member.
type Abandoned<T> = Box<dyn Fn(Vec<(Arc<str>, Outcome)>) -> T + Send + Sync>;

impl<T: Clone + Send + Sync + 'static> GroupTicket<T> {
    /// Begins with these steps.
    pub(crate) fn spawn<F>(
        runtime: &Handle,
        members: Vec<Arc<str>>,
        abandoned: impl Fn(Vec<(Arc<str>, Outcome)>) -> T + Send + Sync + 'static,
        steps: impl FnOnce(Arc<Told<T>>) -> F,
    ) -> Self
    where
        F: Future<Output = T> + Send + 'static,
    {
        let (progress, heard) = watch::channel(Progress { in_force: None, finished: None });
        let (held, given) = (Held::default(), Given::new(Mutex::new(Some(Vec::new()))));
        let told = Arc::new(Told { progress, held: Arc::clone(&held), given: Arc::clone(&given) });
        let steps = steps(Arc::clone(&told));
        let steps = runtime.spawn(async move {
            let outcome = steps.await;
            told.progress.send_modify(|progress| progress.finished = Some(outcome));
        });
        Self {
            progress: heard,
            held,
            given,
            steps: steps.abort_handle(),
            members,
            abandoned: Box::new(abandoned),
        }
    }

    /// Waits until it is in force on every drive, or why it is not: a start does not wait for the reference here.
    ///
    /// # Cancellation
    /// Dropping the wait leaves the ticket as it is.
    pub async fn in_force(&self) -> T {
        self.hear(|progress| progress.in_force.clone().or_else(|| progress.finished.clone())).await
    }

    /// Waits for what became of it.
    ///
    /// # Cancellation
    /// Dropping the wait leaves the ticket as it is.
    pub async fn finished(&self) -> T {
        self.hear(|progress| progress.finished.clone()).await
    }

    /// Takes it back as if nobody had heard of it: see [dropping](#dropping).
    pub fn withdraw(self) {
        lock(&self.held).drain(..).for_each(Ticket::withdraw);
    }

    async fn hear(&self, known: impl Fn(&Progress<T>) -> Option<T>) -> T {
        let mut progress = self.progress.clone();
        let told = progress.wait_for(|progress| known(progress).is_some()).await;
        let outcome = match told.ok().and_then(|progress| known(&progress)) {
            Some(outcome) => outcome,
            None => (self.abandoned)(self.became_of_each().await),
        };
        lock(&self.held).iter().for_each(Ticket::keep);
        outcome
    }
}

impl<T> GroupTicket<T> {
    /// What became of each member by what it was given last. Who was given nothing was not commanded.
    async fn became_of_each(&self) -> Vec<(Arc<str>, Outcome)> {
        let is_sent = |outcome: &Outcome| !matches!(outcome, Outcome::Refused(_));
        let given = lock(&self.given).clone().unwrap_or_default();
        let mut each: Vec<_> = self
            .members
            .iter()
            .map(|member| (Arc::clone(member), Outcome::Refused(Refused::ShutDown)))
            .collect();
        for (member, hearer) in given {
            let became = outcome(&hearer, false).await;
            let of_member = each.iter_mut().find(|(name, _)| *name == member);
            if let Some((_, known)) = of_member.filter(|(_, known)| is_sent(&became) || !is_sent(known)) {
                *known = became;
            }
        }
        each
    }
}

impl<T> Drop for GroupTicket<T> {
    fn drop(&mut self) {
        *lock(&self.given) = None;
        self.steps.abort();
        lock(&self.held).clear();
    }
}

impl<T: Clone + Send + Sync + 'static> IntoFuture for GroupTicket<T> {
    type Output = T;
    type IntoFuture = Pin<Box<dyn Future<Output = T> + Send>>;

    fn into_future(self) -> Self::IntoFuture {
        Box::pin(async move { self.finished().await })
    }
}

impl<T> fmt::Debug for GroupTicket<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("GroupTicket").finish_non_exhaustive()
    }
}

fn lock<T>(kept: &Mutex<T>) -> MutexGuard<'_, T> {
    kept.lock().unwrap_or_else(PoisonError::into_inner)
}
