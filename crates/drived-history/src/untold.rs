//! What somebody was not told while it was read, found again in the file: [`Ledger`]. It keeps when that was beside the values themselves, so
//! that neither a kill nor a lost connection makes a hole.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use drived_plant::plant::{
    past::PastError,
    untold::{Told, Untold, UntoldPoint, UntoldView},
};
use rusqlite::Connection;

use crate::{
    clocks::Clocks,
    doubt::ask,
    outages::{END, Outage, Outages},
    read::{self, History, Page, Read},
    store,
    write::inbox::Inbox,
};

/// What was read just before a moment may come so much later.
const LATE_MS: i64 = 5_000;
/// How long is waited for what was read to be written.
const WRITTEN_WITHIN: Duration = Duration::from_millis(1_500);
/// So many outages of which nothing is there are passed over at once.
const PASSED: usize = 256;

/// Keeps who was told what.
pub(crate) struct Ledger {
    path: PathBuf,
    inbox: Inbox,
    clocks: Clocks,
    /// By whom.
    all: Mutex<BTreeMap<String, Outages>>,
}

impl Ledger {
    pub(crate) fn new(path: PathBuf, inbox: Inbox, clocks: Clocks) -> Self {
        Self { path, inbox, clocks, all: Mutex::default() }
    }

    /// Gives on what has changed.
    fn keep(&self, whom: &str, outages: &mut Outages) {
        if let Some((changes, is_urgent)) = outages.take_changes() {
            self.inbox.outages(whom, changes, is_urgent);
        }
    }

    /// Whether everything that was read up to a moment is in the file.
    fn is_written(&self, until_ms: i64) -> bool {
        let until_ms = until_ms.saturating_add(LATE_MS);
        if self.inbox.written_until() < Some(until_ms) && self.clocks.now().steady_ms >= until_ms {
            self.inbox.have_written(WRITTEN_WITHIN);
        }
        self.inbox.written_until() >= Some(until_ms)
    }

    /// The next part of an outage of a drive; `None`: it cannot be told now. A part without points lies behind everything that is there.
    fn part(
        &self,
        connection: &Connection,
        drive: &str,
        outage: &Outage,
        run: i64,
    ) -> Result<Option<Page>, PastError> {
        let to_ms = outage.to_ms.unwrap_or(END);
        let of = match outage.run {
            // Of another file, which was put aside.
            Some(of) if of >= run => return Ok(Some(Page { points: Vec::new(), until_ms: to_ms })),
            Some(of) => of,
            None if self.is_written(to_ms) => run,
            None => return Ok(None),
        };
        Ok(Some(read::as_read(connection, drive, of, outage.from_ms, to_ms)?))
    }
}

impl Untold for Ledger {
    fn note(&self, told: &Told) -> Result<(), PastError> {
        let mut all = self.all.lock().unwrap_or_else(PoisonError::into_inner);
        if !all.contains_key(&told.whom) {
            let kept = ask(&self.inbox, || store::outages(&History::open(&self.path)?.0, &told.whom))?;
            all.insert(told.whom.clone(), Outages::of(kept, self.clocks.of(told.begun)));
        }
        let Some(outages) = all.get_mut(&told.whom) else { return Ok(()) };
        if let Some((since, until)) = told.live {
            outages.told(self.clocks.of(since), self.clocks.of(until));
        }
        if let Some((number, until_ms)) = told.later {
            outages.made_up(number, until_ms);
        }
        self.keep(&told.whom, outages);
        Ok(())
    }

    fn next(&self, whom: &str, later: &BTreeSet<String>) -> Result<Option<UntoldView>, PastError> {
        let mut all = self.all.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(outages) = all.get_mut(whom) else { return Ok(None) };
        // Before the run of this daemon stands in the file nobody can say whose values are in it.
        if outages.over().next().is_none() || self.inbox.written_until().is_none() {
            return Ok(None);
        }
        let history = History::open(&self.path)?;
        let run = newest_run(&history.0)?;
        let wholes: Vec<i64> =
            outages.over().filter(|(_, one)| one.drive.is_none()).map(|(it, _)| it).collect();
        for whole in wholes {
            let lost = outages.part(whole, read::drives(&history.0)?);
            if lost > 0 {
                tracing::warn!(
                    "{whom}: of {lost} outages of drives nothing will be told: there were too many"
                );
            }
        }
        let mut found = None;
        for _ in 0..PASSED {
            let is_meant = |one: &Outage| one.drive.as_ref().is_some_and(|drive| !later.contains(drive));
            let next =
                outages.over().find(|(_, one)| is_meant(one)).map(|(number, one)| (number, one.clone()));
            let Some((number, outage)) = next else { break };
            let drive = outage.drive.clone().unwrap_or_default();
            let Some(page) = self.part(&history.0, &drive, &outage, run)? else { break };
            if !page.points.is_empty() {
                found = Some(view(number, drive, page));
                break;
            }
            outages.made_up(number, page.until_ms);
        }
        self.keep(whom, outages);
        Ok(found)
    }
}

fn newest_run(connection: &Connection) -> Result<i64, PastError> {
    let newest = connection.query_row("SELECT coalesce(max(id), 0) FROM run", [], |row| row.get(0));
    newest.map_err(|error| PastError::Unreadable(error.to_string()))
}

fn view(number: i64, drive: String, page: Page) -> UntoldView {
    let told = |Read { at_ms, quantity, point }: Read| {
        let value = quantity.row()?.name;
        Some(UntoldPoint { at_ms, value, point: quantity.point(point) })
    };
    let points = page.points.into_iter().filter_map(told).collect();
    UntoldView { number, drive, points, until_ms: page.until_ms }
}
