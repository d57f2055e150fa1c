//! What the monitor knows, and what of it somebody looks at: news, keys and the time in; what is to be shown and done out.

mod keys;
mod plant;

use std::collections::BTreeMap;

use tokio::time::Instant;

pub(super) use self::plant::{Connection, Plant};
use super::{
    account::{Account, Progress, Sent, Stop},
    curves::Curves,
    drive::Drive,
    happening::{Happening, Kind},
};
use drived_client::Heard;
use drived_plant::plant::{
    history::HistoryView,
    recent::RecentView,
    views::{DriveView, LineDetailView, LineView, StateView},
};
use drived_screen::row;

/// How many stops are told of at a time: the newest.
const ACCOUNTS: usize = 3;

/// What comes in besides keys.
#[derive(Debug, Clone)]
pub(super) enum News {
    /// The whole state, and what happened before.
    State {
        state: Box<StateView>,
        recent: Vec<RecentView>,
        /// What the history has kept of before.
        kept: Vec<Happening>,
    },
    /// An event of the stream.
    Heard(Heard),
    /// The connection is gone; it is tried again.
    Interrupted(String),
    /// The last ten minutes of a drive.
    History { drive: String, history: HistoryView },
    /// A line with its last exchanges.
    Line(Box<LineDetailView>),
    /// What has become of a stop.
    Stop { number: u64, progress: Progress },
}

/// What a key asks the program for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Ask {
    Stop { number: u64, stop: Stop },
    Quit,
}

/// What is looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum View {
    Fleet,
    Drive(String),
    Line(String),
    Events,
}

/// What has to be read again and again for what is looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Wanted {
    History(String),
    Line(String),
}

/// Everything.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) plant: Plant,
    pub(super) view: View,
    /// The drive that somebody has marked among the rows. None is marked by itself: a stop key is for what somebody chose.
    pub(super) selected: Option<String>,
    /// What is searched for, and whether it is being typed.
    pub(super) search: String,
    pub(super) is_typing: bool,
    /// The group that is shown; `None`: all drives.
    pub(super) group: Option<String>,
    pub(super) kind: Kind,
    /// The first line that is shown of what is longer than the screen.
    pub(super) scroll: usize,
    /// How many lines the screen had for it.
    pub(super) page: usize,
    pub(super) help: bool,
    /// What the last key could not do; shown until the next.
    pub(super) hint: Option<String>,
    pub(super) curves: Curves,
    /// Whether the curves have the whole screen.
    pub(super) curves_alone: bool,
    /// A line with its last exchanges.
    pub(super) line: Option<Box<LineDetailView>>,
    /// The newest last.
    pub(super) accounts: Vec<Account>,
    stops: u64,
}

impl Model {
    /// Nothing is known yet. `source`: where it comes from, in words.
    pub(super) fn new(source: String, now: Instant) -> Self {
        Self {
            plant: Plant::new(source, now),
            view: View::Fleet,
            selected: None,
            search: String::new(),
            is_typing: false,
            group: None,
            kind: Kind::All,
            scroll: 0,
            page: 1,
            help: false,
            hint: None,
            curves: Curves::default(),
            curves_alone: false,
            line: None,
            accounts: Vec::new(),
            stops: 0,
        }
    }

    pub(super) fn take(&mut self, news: News, now: Instant) {
        match news {
            News::State { state, recent, kept } => self.plant.begin(*state, &recent, kept, now),
            News::Heard(heard) => {
                if let Heard::Command(command) = &heard {
                    // Above a motor that turns again nobody reads that it has stopped.
                    self.accounts.retain(|account| !account.is_over_by(command));
                }
                self.plant.take(heard, now);
            }
            News::Interrupted(why) => self.plant.interrupted(why, now),
            News::History { drive, history } => {
                if self.view == View::Drive(drive) {
                    self.curves.take(history);
                }
            }
            News::Line(line) => self.line = Some(line),
            News::Stop { number, progress } => {
                let known = self.accounts.iter_mut().find(|account| account.number == number);
                let Some(account) = known else { return };
                let is_silent = match &account.stop {
                    Stop::All => false,
                    Stop::One(name) => self
                        .plant
                        .drive(name)
                        .is_some_and(|drive| drive.is_lost() || !drive.is_live(now, true)),
                };
                account.take(progress, is_silent);
            }
        }
        self.selected.take_if(|name| self.plant.drive(name).is_none());
    }

    /// What is to be read for what is looked at.
    pub(super) fn wanted(&self) -> Option<Wanted> {
        match &self.view {
            View::Drive(name) if !self.curves.is_paused() => Some(Wanted::History(name.clone())),
            View::Line(name) => Some(Wanted::Line(name.clone())),
            _ => None,
        }
    }

    /// The drives that are searched for, those in trouble first.
    pub(super) fn rows(&self) -> Vec<&Drive> {
        let mut rows: Vec<&Drive> =
            self.plant.drives.iter().filter(|drive| self.is_searched(drive)).collect();
        // Stable: behind those in trouble the order is that of the daemon.
        rows.sort_by_key(|drive| drive.told.snapshot.rank());
        rows
    }

    fn is_searched(&self, drive: &Drive) -> bool {
        let in_group = self.group.as_ref().is_none_or(|group| self.plant.has(group, drive.name()));
        let text = || {
            let DriveView { line, family, snapshot, .. } = &drive.told;
            let parts = [
                drive.name(),
                line,
                &snapshot.shows.to_string(),
                family,
                &row::fault(snapshot).unwrap_or_default(),
                &row::note(&drive.told),
            ];
            parts.join(" ").to_lowercase()
        };
        in_group && (self.search.is_empty() || self.has_words(&text()))
    }

    /// Whether a text has every word that is searched for.
    fn has_words(&self, text: &str) -> bool {
        self.search.to_lowercase().split_whitespace().all(|word| text.contains(word))
    }

    /// What happened and is searched for, the newest first.
    pub(super) fn happenings(&self) -> Vec<&Happening> {
        let all = self.plant.happenings.iter().rev();
        all.filter(|one| one.is(self.kind) && self.has_words(&one.sentence().to_lowercase())).collect()
    }

    /// Something that was asked is not done; it is told until the next key.
    pub(super) fn refuse(&mut self, why: &str) {
        self.hint = Some(why.to_owned());
    }

    /// The drive that the stop key of one drive is for.
    pub(super) fn marked(&self) -> Option<String> {
        match &self.view {
            View::Drive(name) => Some(name.clone()),
            // One that is not in sight is not meant.
            View::Fleet => {
                let marked = |drive: &&Drive| Some(drive.name()) == self.selected.as_deref();
                self.rows().into_iter().find(marked).map(|drive| drive.name().to_owned())
            }
            View::Line(_) | View::Events => None,
        }
    }

    /// Stops that not every drive has confirmed, and that nobody has closed.
    pub(super) fn unconfirmed_stops(&self) -> impl Iterator<Item = &Account> {
        self.accounts.iter().filter(|account| !account.is_done())
    }

    fn stop(&mut self, stop: Stop, unix_ms: u64) -> Ask {
        self.stops += 1;
        let number = self.stops;
        let drives = match &stop {
            Stop::All => self.plant.drives.len(),
            Stop::One(_) => 1,
        };
        // The same stop once more takes the place of what was told of it before.
        self.accounts.retain(|account| account.stop != stop);
        let state = Sent::Sending { drives, failed: 0, why: String::new() };
        self.accounts.push(Account { number, stop: stop.clone(), unix_ms, state });
        if let Some(settled) = self
            .accounts
            .iter()
            .position(|account| !account.is_open())
            .filter(|_| self.accounts.len() > ACCOUNTS)
        {
            self.accounts.remove(settled);
        }
        Ask::Stop { number, stop }
    }
}

/// The lines by their names.
pub(super) type Lines = BTreeMap<String, LineView>;
