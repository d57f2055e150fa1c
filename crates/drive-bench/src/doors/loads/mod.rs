//! Loads that nobody means ill by: very many who read, command, or ask a gateway, all at once. Each says what it got.

mod asking;
mod client;
mod commands;
mod http;
mod looking;
mod readers;

use std::{
    collections::BTreeMap,
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use tokio::task::JoinSet;

pub(super) use self::looking::Looking;
use super::attacks::{Attack, attack, wait};
use crate::report::Unit;

/// The first is none: beside it the others are judged.
pub(super) const LOADS: [Attack; 4] = [
    attack("calm", "nobody does anything", |_, over| wait(over)),
    attack("readers", "1 000 who read", readers::read),
    attack("commands", "10 000 commands a second", commands::offer),
    attack("asking-gateway", "256 clients who ask the gateway", asking::ask),
];

/// What somebody has got, to be told as a row.
#[derive(Debug)]
pub(in crate::doors) struct Got {
    pub(in crate::doors) what: String,
    pub(in crate::doors) unit: Unit,
    pub(in crate::doors) value: f64,
}

impl Got {
    fn new(what: impl Into<String>, unit: Unit, value: f64) -> Self {
        Self { what: what.into(), unit, value }
    }
}

/// How often something was, by its name.
#[derive(Debug, Default)]
struct Tally(BTreeMap<String, u64>);

impl Tally {
    fn count(&mut self, what: impl Into<String>) {
        *self.0.entry(what.into()).or_default() += 1;
    }

    fn of(&self, what: &str) -> u64 {
        self.0.get(what).copied().unwrap_or_default()
    }

    fn add(&mut self, other: Self) {
        for (what, count) in other.0 {
            *self.0.entry(what).or_default() += count;
        }
    }
}

/// Clients by their numbers, each a task that counts until it is over; what they counted together, and what each got of `share`.
fn all<F>(
    numbers: Range<u16>,
    over: &AtomicBool,
    share: &str,
    client: impl Fn(u16, Arc<AtomicBool>) -> F,
) -> Vec<Got>
where
    F: Future<Output = Tally> + Send + 'static,
{
    let is_over = Arc::new(AtomicBool::new(false));
    let counted = thread::scope(|scope| {
        scope.spawn(|| {
            let _ = wait(over);
            is_over.store(true, Ordering::Relaxed);
        });
        tokio::runtime::Runtime::new().map(|runtime| {
            runtime.block_on(async {
                let clients: JoinSet<Tally> =
                    numbers.map(|number| client(number, Arc::clone(&is_over))).collect();
                clients.join_all().await
            })
        })
    });
    let counted = counted.unwrap_or_default();
    let shares = || counted.iter().map(|tally| tally.of(share)).filter(|count| *count > 0);
    let one = |name, count: Option<u64>| {
        Got::new(format!("{share}: {name} that a client got"), Unit::Count, count.unwrap_or_default() as f64)
    };
    let with = Got::new(format!("{share}: clients that got any"), Unit::Count, shares().count() as f64);
    let mut got = vec![with, one("the least", shares().min()), one("the most", shares().max())];
    let mut sum = Tally::default();
    counted.into_iter().for_each(|tally| sum.add(tally));
    got.extend(sum.0.into_iter().map(|(what, count)| Got::new(what, Unit::Count, count as f64)));
    got
}

const SECOND: Duration = Duration::from_secs(1);
