//! Every control configuration in every world under every operation, and how many of them contradicted themselves.

use std::{collections::BTreeMap, fmt};

use super::{
    Configuration, Event, Scene, Surrounded,
    cell::{Cell, Comes, Operation},
};
use crate::contract::Contract;

/// How many of the worlds are lived through, evenly spread over all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Share {
    /// One in so many of those under the usual reading of the manual.
    pub one_in: usize,
    /// One in so many of those under another reading.
    pub doubtful_one_in: usize,
}

impl Share {
    /// All of them.
    pub const ALL: Self = Self { one_in: 1, doubtful_one_in: 1 };

    /// One in so many, and of the doubtful readings a twelfth of that.
    #[must_use]
    pub const fn one_in(one_in: usize) -> Self {
        Self { one_in, doubtful_one_in: one_in * 12 }
    }
}

/// What was lived through, and what contradicted itself.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// The family.
    pub family: &'static str,
    /// Its control configurations.
    pub configurations: usize,
    /// What may happen around each.
    pub events: usize,
    /// The operations, each when it comes.
    pub operations: usize,
    /// All worlds, under every reading of the manual.
    pub worlds: usize,
    /// Those that were lived through.
    pub lived: usize,
    /// Those of them in which the manual decides.
    pub decided: usize,
    /// What contradicted itself.
    pub contradictions: Vec<String>,
    /// How often an operation ended how.
    pub outcomes: BTreeMap<(String, &'static str), usize>,
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { family, configurations, events, operations, worlds, lived, decided, .. } = self;
        let wrong = self.contradictions.len();
        write!(
            f,
            "{family}: {configurations} configurations, {events} events, {operations} operations when they come: {lived} of {worlds} \
             worlds, {decided} decided by the manual, {wrong} contradictions"
        )
    }
}

impl Contract {
    /// Lives through a share of the family's worlds. Nothing, for a family that has told none.
    ///
    /// # Panics
    /// When a configuration or an event is none of the simulator's.
    pub async fn live_in_worlds(&self, share: Share) -> Tally {
        let mut tally = Tally { family: self.name(), ..Tally::default() };
        let Some(family) = self.around.as_deref() else { return tally };
        for configuration in family.configurations() {
            self.live_in(family, &configuration, share, &mut tally).await;
        }
        tally
    }

    /// The same, for a test.
    ///
    /// # Panics
    /// With what contradicted itself, if anything did.
    pub async fn is_true_in_worlds(&self, share: Share) -> Tally {
        let tally = self.live_in_worlds(share).await;
        assert!(tally.contradictions.is_empty(), "{tally}:\n{}", tally.contradictions.join("\n"));
        tally
    }

    async fn live_in(
        &self,
        family: &dyn Surrounded,
        configuration: &Configuration,
        share: Share,
        tally: &mut Tally,
    ) {
        let around = Scene::new(self.capabilities, configuration).machine.surroundings();
        let others = around.switches.iter().flat_map(|switch| {
            let others = switch.readings.iter().skip(1);
            others.map(|reading| format!("reading {} {reading}", switch.name))
        });
        let readings: Vec<Option<String>> = std::iter::once(None).chain(others.map(Some)).collect();
        let events: Vec<Event> = family.events(around).into_iter().chain(family.other_masters()).collect();
        let operations: Vec<(Comes, Operation)> = Operation::all(self, family)
            .into_iter()
            .flat_map(|operation| Comes::of(operation).iter().map(move |&comes| (comes, operation)))
            .collect();
        tally.configurations += 1;
        (tally.events, tally.operations) = (events.len(), operations.len());
        let mut number = tally.worlds;
        for event in &events {
            for &(comes, operation) in &operations {
                for (index, reading) in readings.iter().enumerate() {
                    let one_in = if index == 0 { share.one_in } else { share.doubtful_one_in };
                    tally.worlds += 1;
                    number += usize::from(index == 0);
                    // Each reading begins elsewhere, so that not all fall to the same worlds.
                    if !(number + index).is_multiple_of(one_in) {
                        continue;
                    }
                    tally.lived += 1;
                    let mut cell =
                        Cell::new(self, family, configuration, reading.as_deref(), (event, comes, operation));
                    let judged = cell.live_through().await;
                    tally.decided += usize::from(cell.decided);
                    match judged {
                        Ok(outcome) => {
                            *tally.outcomes.entry((format!("{operation:?}"), outcome)).or_default() += 1;
                        }
                        Err(why) => tally.contradictions.push(format!(
                            "[{}] {} {comes:?} {:?} {operation:?}: {why}",
                            configuration.name,
                            reading.as_deref().unwrap_or("as usual"),
                            event.comes
                        )),
                    }
                }
            }
        }
    }
}
