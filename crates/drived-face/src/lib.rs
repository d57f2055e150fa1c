//! A face of the daemon: a way by which somebody sees the plant and commands it, such as a broker, a gateway or a webhook. The page, the
//! API and the control socket are none: they are the [doors](drived_doors) that are always there, by which the tools come in.
//!
//! A face goes through four states, each a trait or a function of its own:
//!
//! | | What | When |
//! |---|---|---|
//! | [`Face`] | what the program knows of it: its table in the configuration | the program [adds](add) it before it begins |
//! | [`Configured`] | what the file says of it, checked | a file is read, by the daemon or by a tool |
//! | [`Opening`] | what it needs has been found: files, keys | before a drive is spoken to, and before a reload touches anything |
//! | [`Open`] | it tells and hears | from then on, until it is closed: at the end, or where a reload finds its table changed |
//!
//! **A face holds up nobody.** It stands on the [`Plant`], which answers at once; whatever it waits for, it waits for on tasks of its own,
//! with queues that have an end. What it commands goes through [`Plant::command`](drived_plant::plant::Plant), which judges rights
//! and rules for every face alike, and it [records](Audit) what it was asked.
//!
//! One of somebody else's is in `examples/outside` of the repository.

#![forbid(unsafe_code)]

mod known;
mod written;

use std::{any::Any, fmt, pin::Pin};

use serde_json::{Map, Value};

pub use self::{
    known::{OWN, TableTaken, add, all},
    written::Written,
};
pub use drived_config::{
    config::{ConfigError, Group, Key, LinePart, Source, State},
    names::Names,
};
pub use drived_doors::audit::Audit;
pub use drived_plant::{counts::Samples, plant::Plant};
pub use drived_words::failure::Failure;

/// What the program knows of a face before it has read a file.
pub trait Face: Sync {
    /// Its table at the top level of the configuration, such as `mqtt`.
    fn table(&self) -> &'static str;

    /// The table's row among those of the top level, for the documents.
    fn row(&self) -> &'static Key;

    /// The keys of its table, for the documents; none where they are told elsewhere.
    fn keys(&self) -> &'static [Key] {
        &[]
    }

    /// Reads its table, without looking at anything else than the file.
    ///
    /// # Errors
    /// What is wrong, with file, line and field: [`Written::read`] and [`Source::error`] make it.
    fn configure(&self, written: Written<'_>, site: &Site<'_>) -> Result<Box<dyn Configured>, ConfigError>;

    /// What holds where the file has no table of it; `None`: there is no such face then.
    fn unsaid(&self, _site: &Site<'_>) -> Option<Box<dyn Configured>> {
        None
    }
}

/// What else the file says, as far as a face has to fit to it.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Site<'a> {
    /// The lines with their drives.
    pub lines: &'a [LinePart],
    /// The groups.
    pub groups: &'a [Group],
    /// Where it is kept what outlives the daemon.
    pub state: &'a State,
}

impl<'a> Site<'a> {
    /// A file with these.
    #[must_use]
    pub const fn new(lines: &'a [LinePart], groups: &'a [Group], state: &'a State) -> Self {
        Self { lines, groups, state }
    }

    /// The names of the drives.
    pub fn drives(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.lines.iter().flat_map(|line| &line.drives).map(|drive| drive.settings.name.as_str())
    }
}

/// What a file says of a face, checked.
pub trait Configured: Any + fmt::Debug + Send + Sync {
    /// Whether another file says the same: then a reload leaves the open face alone. [`same`] compares two of a type.
    fn is_same(&self, other: &dyn Configured) -> bool;

    /// The names that it gives, with what they are names of, so that those are told which somebody may take for others.
    fn names(&self) -> Option<(&'static str, Vec<&str>)> {
        None
    }

    /// What it means, for `drived check`.
    fn meaning(&self) -> Vec<Meaning>;

    /// The same for a program: keys of the object that `drived check --json` gives.
    fn object(&self) -> Map<String, Value>;

    /// Finds out whether what it needs can be read, such as keys and passwords, and changes nothing: a daemon may run beside it.
    ///
    /// # Errors
    /// What cannot be found or read.
    fn check(&self) -> Result<(), Failure> {
        Ok(())
    }

    /// Finds what it needs to be opened.
    ///
    /// # Errors
    /// What cannot be found or read.
    fn prepare(&self) -> Result<Opening, Failure>;
}

/// Whether two configurations of one type are equal.
pub fn same<T: Configured + PartialEq>(one: &T, other: &dyn Configured) -> bool {
    (other as &dyn Any).downcast_ref::<T>() == Some(one)
}

/// A paragraph of `drived check`: a sentence, and what holds in particular, each with its label.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Meaning {
    /// In a sentence.
    pub head: String,
    /// In particular.
    pub rows: Vec<(&'static str, String)>,
}

/// Opens a face for which everything has been found. It waits for nothing: what is away is tried again by the face.
pub type Opening = Box<dyn FnOnce(&Surroundings) -> Box<dyn Open> + Send>;

/// Among what a face stands; each is a handle, cheap to clone.
#[derive(Clone)]
#[non_exhaustive]
pub struct Surroundings {
    /// The drives and lines, what they are like, and the desk that takes commands.
    pub plant: Plant,
    /// The log of who did what.
    pub audit: Audit,
    /// The lasting numbers and topics of drives, lines and groups.
    pub names: Names,
}

impl Surroundings {
    /// These.
    #[must_use]
    pub const fn new(plant: Plant, audit: Audit, names: Names) -> Self {
        Self { plant, audit, names }
    }
}

/// An open face.
pub trait Open: Send + Sync {
    /// Adds what it counts to a scrape of `/metrics`. It is called at each scrape and waits for nothing.
    fn collect(&self, _samples: &mut Samples) {}

    /// Says in the log what it has counted: somebody has asked by a signal.
    fn tell(&self) {}

    /// Ends it, with a goodbye where there is one. It takes a few seconds at most, however the other side is.
    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>>;
}
