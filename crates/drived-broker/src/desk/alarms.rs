//! What is asked to be done with alarms: taken by the same desk as commands, and for as long.

use std::time::Duration;

use tokio::time::Instant;

use super::{
    Answers, Desk, Refusal,
    alarms_answer::AlarmsOrder,
    counter::{Named, Order},
};
use drived_doors::{
    Caller,
    audit::{Kind, Record},
};
use drived_plant::plant::{
    alarms::AlarmsSaid,
    commands::{LIFETIME, age::age_of},
};

/// A message about alarms, as a broker's face has it.
pub struct AlarmMessage<A> {
    pub said: AlarmsSaid,
    pub caller: Caller,
    /// Whose pace it comes at.
    pub pace_of: String,
    /// What the face itself has against it.
    pub doubt: Option<Refusal>,
    pub arrived: Instant,
    /// When it was sent, by the clock of its sender.
    pub sent_unix_ms: Option<u64>,
    /// For the audit log.
    pub what: String,
    pub answers: A,
}

impl<A: Answers + Sync> Desk<A> {
    /// Takes a message about alarms.
    pub fn take_alarms(&mut self, message: AlarmMessage<A>) {
        let AlarmMessage { said, caller, pace_of, doubt, arrived, sent_unix_ms, what, answers } = message;
        if !self.is_in_time(pace_of, arrived) {
            return;
        }
        let AlarmsSaid { body, id, issued_unix_ms, asked } = said;
        let named = Named { id: id.clone(), ..Named::default() };
        let record = Record { body: Some(body), ..Record::new(Kind::Command, &caller, what) };
        let judged = match doubt {
            Some(doubt) => Err(doubt),
            None => asked.map_err(Refusal::from).and_then(|asked| {
                age_of([sent_unix_ms, issued_unix_ms], arrived, LIFETIME.time(), Duration::ZERO)?;
                Ok(asked)
            }),
        };
        let order = match judged {
            Ok(asked) => AlarmsOrder { id, asked },
            Err(refusal) => return self.counter.refuse(&caller, record, &answers, named, refusal),
        };
        let (by, audited, to) = (caller.clone(), record.clone(), answers.clone());
        if self.orders.try_send(Order::Alarms { caller: by, order, record: audited, answers: to }).is_err() {
            self.counter.refuse(&caller, record, &answers, named, Refusal::Busy);
        }
    }
}
