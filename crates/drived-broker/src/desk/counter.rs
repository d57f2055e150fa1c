//! Behind the desk: carrying out, the audit log, and telling what becomes of it.

use std::{sync::Arc, time::Duration};

use serde_json::json;
use tokio::{
    sync::{Semaphore, mpsc},
    time::Instant,
};

use super::{
    Answer, Answers, Refusal, Refused,
    alarms_answer::{AlarmsAnswer, AlarmsOrder},
    lately::Lately,
};
use drived_doors::{
    Caller,
    audit::{Audit, Kind, Record},
};
use drived_plant::{
    follow::{Follower, News},
    plant::{
        Plant,
        alarms::{AlarmDone, AlarmRejected},
        commands::{ActionWord, Expects, OutcomeWord, Request, Target, Told},
    },
};
use drived_words::json::unix;

/// Commands whose outcome is waited for.
const FOLLOWED: usize = 256;

/// What is known of a message.
#[derive(Default)]
pub(super) struct Named {
    pub(super) id: Option<String>,
    pub(super) action: Option<ActionWord>,
    /// The drive that was meant, where it was one.
    pub(super) drive: Option<String>,
}

/// What waits for its record in the audit log.
pub(super) enum Order<A> {
    Command { caller: Caller, request: Request, asked_after: Instant, record: Record, answers: A },
    Alarms { caller: Caller, order: AlarmsOrder, record: Record, answers: A },
}

/// What carries commands out.
pub(super) struct Counter {
    plant: Plant,
    audit: Audit,
    followed: Arc<Semaphore>,
    refused: Lately,
}

impl Counter {
    pub(super) fn new(plant: Plant, audit: Audit) -> Self {
        Self { plant, audit, followed: Arc::new(Semaphore::new(FOLLOWED)), refused: Lately::default() }
    }

    /// Those that are meant now.
    pub(super) fn as_it_is(&self, target: &Target) -> Option<Expects> {
        self.plant.as_it_is(target)
    }

    pub(super) fn clock_set_back(&self) -> Duration {
        self.plant.clock_set_back()
    }

    /// Stops at once: no disk and no other command holds it up.
    pub(super) fn stop(&self, caller: &Caller, request: Request, record: Record, answers: &impl Answers) {
        self.audit.record(record.clone()).whenever();
        let asked_after = request.arrived;
        self.begin(caller, request, asked_after, record, answers);
    }

    /// Carries out what waits, one after the other, when it stands in the audit log.
    pub(super) async fn work<A: Answers + Sync>(self: Arc<Self>, mut orders: mpsc::Receiver<Order<A>>) {
        while let Some(order) = orders.recv().await {
            let (caller, record, answers, named) = order.head();
            let written = self.audit.record(record.clone()).done().await;
            if let Err(error) = drive_fleet::mutant!("unwritten-command-moves", written, written.or(Ok(()))) {
                self.refuse(caller, record.clone(), answers, named, Refusal::Audit(error.to_string()));
                continue;
            }
            match order {
                Order::Command { caller, request, asked_after, record, answers } => {
                    self.begin(&caller, request, asked_after, record, &answers);
                }
                Order::Alarms { caller, order, record, answers } => {
                    self.act_on_alarms(&caller, order, record, &answers);
                }
            }
        }
    }

    fn act_on_alarms(&self, caller: &Caller, order: AlarmsOrder, record: Record, answers: &impl Answers) {
        let AlarmsOrder { id, asked } = order;
        let done = self.plant.act_on_alarms(caller, &asked);
        let refused = done.iter().find_map(|one| one.done.as_ref().err());
        let outcome = match refused {
            Some(_) => OutcomeWord::Refused,
            None if done.is_empty() => OutcomeWord::Nothing,
            None => OutcomeWord::Confirmed,
        };
        self.answered(caller, record, id.clone(), outcome);
        answers.tell(Answer::Alarms(&AlarmsAnswer {
            id,
            outcome,
            reason: refused.map(AlarmRejected::reason),
            text: refused.map(ToString::to_string),
            alarms: done.iter().map(AlarmDone::told).collect(),
            caller: caller.name.clone(),
            origin: caller.origin.clone(),
            time_unix_ms: unix(Instant::now()),
        }));
    }

    fn begin(
        &self,
        caller: &Caller,
        request: Request,
        asked_after: Instant,
        record: Record,
        answers: &impl Answers,
    ) {
        let named = named(&request);
        match self.plant.begin_asked_after(caller, request, asked_after) {
            Ok(told) => self.follow(caller, told, record, answers),
            Err(rejected) => self.tell_refusal(caller, record, answers, named, rejected.into()),
        }
    }

    /// Tells what is known, and what becomes of it.
    fn follow(&self, caller: &Caller, told: Told, record: Record, answers: &impl Answers) {
        let mut follower = Follower::new(told);
        let view = follower.last();
        self.answered(caller, record, Some(view.id.clone()), view.outcome);
        answers.tell(Answer::Command(&view));
        if !view.open {
            return;
        }
        // Of so many that their outcomes are not waited for, they stand in the audit log.
        let Ok(permit) = Arc::clone(&self.followed).try_acquire_owned() else { return };
        let answers = answers.clone();
        tokio::spawn(async move {
            let mut outcome = view.outcome;
            while let Some(news) = follower.next().await {
                if let News::Told(view) = news
                    && view.outcome != outcome
                {
                    outcome = view.outcome;
                    answers.tell(Answer::Command(&view));
                }
            }
            drop(permit);
        });
    }

    /// Does nothing, and says why.
    pub(super) fn refuse(
        &self,
        caller: &Caller,
        record: Record,
        answers: &impl Answers,
        named: Named,
        refusal: Refusal,
    ) {
        self.audit.record(record.clone()).whenever();
        self.tell_refusal(caller, record, answers, named, refusal);
    }

    fn tell_refusal(
        &self,
        caller: &Caller,
        record: Record,
        answers: &impl Answers,
        Named { id, action, drive }: Named,
        refusal: Refusal,
    ) {
        let (outcome, reason) = refusal.told();
        self.answered(caller, record, id.clone(), outcome);
        let refused = Refused {
            id,
            action,
            outcome,
            reason,
            text: refusal.to_string(),
            caller: caller.name.clone(),
            origin: caller.origin.clone(),
            time_unix_ms: unix(Instant::now()),
        };
        if let Some(drive) = drive {
            self.plant.note_refused_command(&drive, refused.as_last());
            let told = self.refused.of(&drive, &refused, Instant::now());
            told.into_iter().for_each(|told| self.plant.tell_notice(told));
        }
        answers.tell(Answer::Refused(&refused));
    }

    /// Keeps the first answer in the audit log.
    fn answered(&self, caller: &Caller, record: Record, id: Option<String>, outcome: OutcomeWord) {
        let outcome = json!(outcome).as_str().map(str::to_owned);
        let answer = Record { id, outcome, ..Record::new(Kind::Answer, caller, record.what) };
        self.audit.record(answer).whenever();
    }
}

impl<A> Order<A> {
    fn head(&self) -> (&Caller, &Record, &A, Named) {
        match self {
            Self::Command { caller, request, record, answers, .. } => {
                (caller, record, answers, named(request))
            }
            Self::Alarms { caller, order, record, answers } => {
                let named = Named { id: order.id.clone(), ..Named::default() };
                (caller, record, answers, named)
            }
        }
    }
}

fn named(request: &Request) -> Named {
    Named { id: request.id.clone(), action: Some(request.action.word()), drive: drive_of(&request.target) }
}

/// The drive that is meant, where it is one alone.
pub(super) fn drive_of(target: &Target) -> Option<String> {
    match target {
        Target::Drive(name) => Some(name.clone()),
        _ => None,
    }
}
