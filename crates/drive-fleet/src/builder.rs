//! [`FleetBuilder`]: lines and drives become a fleet, after everything that can be checked beforehand is.

mod check;
mod error;
mod spawn;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use drive_bus::{Line, Slave};
use drive_core::{Drive, Port, SlaveAddress};
use tokio::sync::{broadcast, mpsc};

use self::spawn::spawn;
use crate::{
    event::Teller,
    fleet::Fleet,
    handle::Entry,
    line_entry::LineEntry,
    members::Members,
    plan::{Demand, Forecast, LineBudget, forecast},
    runs::RunKept,
    settings::DriveSettings,
};

pub use self::{
    check::check_settings,
    error::{FleetError, SettingProblem},
};

/// How many events are kept for a slow reader.
const EVENTS: usize = 4_096;

/// What a line is before the fleet starts.
struct Wire {
    name: String,
    line: Line,
    budget: LineBudget,
    /// The line of a fleet that runs, and its drives.
    standing: Option<(Arc<LineEntry>, Vec<Arc<Entry>>)>,
    /// Which of the members that are added are on it.
    added: Vec<usize>,
}

impl Wire {
    /// The drives of a fleet that runs.
    fn standing(&self) -> &[Arc<Entry>] {
        self.standing.as_ref().map(|(_, entries)| entries.as_slice()).unwrap_or_default()
    }
}

/// What a drive is before the fleet starts.
struct Member {
    line: usize,
    settings: DriveSettings,
    drive: Box<dyn Drive>,
}

/// Lines and drives that become a [`Fleet`].
#[must_use]
pub struct FleetBuilder {
    lines: Vec<Wire>,
    /// The number of each line by its name, and the names of all drives: nobody is looked for among all of them.
    by_name: BTreeMap<String, usize>,
    names: BTreeSet<String>,
    members: Vec<Member>,
    /// The first thing that cannot be.
    problem: Option<FleetError>,
    refuses_plans: bool,
    runs: Option<mpsc::UnboundedSender<RunKept>>,
    /// So many readers miss nothing of the start.
    readers: usize,
}

impl Fleet {
    /// Begins a fleet.
    pub const fn builder() -> FleetBuilder {
        FleetBuilder {
            lines: Vec::new(),
            by_name: BTreeMap::new(),
            names: BTreeSet::new(),
            members: Vec::new(),
            problem: None,
            refuses_plans: true,
            runs: None,
            readers: 1,
        }
    }
}

/// The lines that there are, and the drives that were added.
pub(crate) type Enlisted = (Vec<Arc<LineEntry>>, Vec<Arc<Entry>>);

impl FleetBuilder {
    /// Begins an addition to a fleet that runs.
    pub(crate) fn addition(members: &Members) -> Self {
        let wire = |entry: &Arc<LineEntry>| Wire {
            name: entry.name.to_string(),
            line: entry.line.clone(),
            budget: entry.budget,
            standing: Some((Arc::clone(entry), members.on_line(&entry.name).cloned().collect())),
            added: Vec::new(),
        };
        Self {
            lines: members.lines().map(wire).collect(),
            by_name: members.lines().map(|entry| entry.name.to_string()).zip(0..).collect(),
            names: members.drives().map(|entry| entry.name.to_string()).collect(),
            ..Fleet::builder()
        }
    }

    /// Adds a line. What it gives follows from its configuration, as [`LineBudget::of`] says.
    pub fn line(self, name: impl Into<String>, line: Line) -> Self {
        self.line_with(name, line, |budget| budget)
    }

    /// Adds a line of which more is known than its configuration says: how fast its drives answer, how many segments it
    /// has.
    pub fn line_with(
        mut self,
        name: impl Into<String>,
        line: Line,
        budget: impl FnOnce(LineBudget) -> LineBudget,
    ) -> Self {
        let (name, budget) = (name.into(), budget(LineBudget::of(&line.config())));
        if self.by_name.contains_key(&name) {
            self.problem.get_or_insert(FleetError::NameTaken(name.clone()));
        } else if let Some(other) = self.lines.iter().find(|other| other.line.is_same(&line)) {
            self.problem
                .get_or_insert(FleetError::LineTaken { line: name.clone(), other: other.name.clone() });
        } else {
            self.by_name.insert(name.clone(), self.lines.len());
        }
        self.lines.push(Wire { name, line, budget, standing: None, added: Vec::new() });
        self
    }

    /// Adds a drive at this address of a line that was added before. `open` makes it over the port that it is given, so
    /// that it is commanded where it is registered. The line keeps the pause that the family needs after each answer.
    ///
    /// ```no_run
    /// # use drive_core::{Drive, SlaveAddress};
    /// # fn atv312(port: drive_bus::Slave, slave: SlaveAddress) -> Box<dyn Drive> { unimplemented!() }
    /// # fn example(line: drive_bus::Line) -> Result<(), Box<dyn std::error::Error>> {
    /// use drive_fleet::{DriveSettings, Fleet};
    ///
    /// let fleet = Fleet::builder()
    ///     .line("north", line)
    ///     .drive("north", 2, DriveSettings::controlled("pump 2"), |port, slave| atv312(port, slave))
    ///     .start()?;
    /// # Ok(())
    /// # }
    /// ```
    pub fn drive(
        mut self,
        line: &str,
        address: u8,
        settings: DriveSettings,
        open: impl FnOnce(Slave, SlaveAddress) -> Box<dyn Drive>,
    ) -> Self {
        match self.member(line, address, settings, open) {
            Ok(member) => {
                self.names.insert(member.settings.name.clone());
                if let Some(wire) = self.lines.get_mut(member.line) {
                    wire.added.push(self.members.len());
                }
                self.members.push(member);
            }
            Err(problem) => {
                self.problem.get_or_insert(problem);
            }
        }
        self
    }

    fn member(
        &self,
        line_name: &str,
        address: u8,
        settings: DriveSettings,
        open: impl FnOnce(Slave, SlaveAddress) -> Box<dyn Drive>,
    ) -> Result<Member, FleetError> {
        let drive = || settings.name.clone();
        if self.names.contains(&settings.name) {
            return Err(FleetError::NameTaken(drive()));
        }
        let line = self.by_name.get(line_name).copied();
        let Some((line, wire)) = line.and_then(|line| Some((line, self.lines.get(line)?))) else {
            return Err(FleetError::NoSuchLine { drive: drive(), line: line_name.to_owned() });
        };
        let slave = SlaveAddress::try_from(address)
            .map_err(|problem| FleetError::NoAddress { drive: drive(), problem })?;
        let mut added = self.added_to(wire);
        if added.any(|other| other.drive.slave() == slave)
            || wire.standing().iter().any(|entry| entry.slave == slave)
        {
            return Err(FleetError::AddressTaken { drive: drive(), line: line_name.to_owned(), slave });
        }
        let opened = open(wire.line.slave(address), slave);
        // A drive that was made for another address would be commanded where nobody looks for it.
        let made_for = opened.slave();
        if made_for != slave {
            return Err(FleetError::OtherAddress { drive: drive(), slave, made_for });
        }
        let capabilities = opened.capabilities();
        if let Some(serial) = wire.budget.serial {
            let fits = capabilities.check_line(slave, serial);
            fits.map_err(|problem| FleetError::Mismatch { drive: drive(), problem })?;
        }
        check_settings(&settings, capabilities, opened.watchdog_capability())
            .map_err(|problem| FleetError::Setting { drive: drive(), problem })?;
        Ok(Member { line, settings, drive: opened })
    }

    fn added_to(&self, wire: &Wire) -> impl Iterator<Item = &Member> {
        wire.added.iter().filter_map(|number| self.members.get(*number))
    }

    /// Tells here what is to be kept of the run commands of this side: what becomes
    /// [`run_before`](DriveSettings::run_before) in the next run of the program. A start waits until its record is kept.
    pub fn keep_runs(mut self, runs: mpsc::UnboundedSender<RunKept>) -> Self {
        self.runs = Some(runs);
        self
    }

    /// So many readers of [events](Fleet::events) get them from the start of the fleet, however long after it they begin to read: the first
    /// that ask. Otherwise it is the first alone.
    pub const fn readers_from_the_start(mut self, readers: usize) -> Self {
        self.readers = readers;
        self
    }

    /// Starts also if a line cannot keep its periods or feed its watchdogs: for a tool that commands a drive for a moment,
    /// whatever its line is like.
    pub const fn whatever_the_plan(mut self) -> Self {
        self.refuses_plans = false;
        self
    }

    /// Checks everything that can be checked beforehand and starts one task for each drive on the current tokio runtime.
    /// Nothing is written to any drive until somebody commands it, except its watchdog at standstill, and the stop of a run of ours that
    /// an earlier run of the program did not see confirmed.
    ///
    /// # Errors
    /// [`FleetError`] with what does not fit, and the arithmetic where it is arithmetic.
    pub fn start(mut self) -> Result<Fleet, FleetError> {
        let (events, first) = broadcast::channel(EVENTS);
        // Before any drive is asked: whoever comes later has missed what happened by then.
        let others = (1..self.readers).map(|_| events.subscribe());
        let first = std::iter::once(first).chain(others).take(self.readers).collect();
        let events = Teller::new(events, self.runs.take());
        let (lines, drives) = self.enlist(&events)?;
        let mut members = Members::default();
        lines.into_iter().for_each(|line| members.add_line(line));
        drives.into_iter().for_each(|drive| members.add_drive(drive));
        Ok(Fleet::new(members, events, first))
    }

    /// Starts the drives that are added, if all of it can work: these, and the lines that there are then.
    pub(crate) fn enlist(self, events: &Teller) -> Result<Enlisted, FleetError> {
        let (lines, added) = self.check()?;
        let mut drives = Vec::with_capacity(added.len());
        for member in added {
            if let Some(line) = lines.get(member.line) {
                // Before its task asks anything.
                member.keep_pause(&line.line);
                drives.push(spawn(member, events, Arc::clone(line)));
            }
        }
        Ok((lines, drives))
    }

    fn check(mut self) -> Result<(Vec<Arc<LineEntry>>, Vec<Member>), FleetError> {
        if let Some(problem) = self.problem.take() {
            return Err(problem);
        }
        let mut plans = Vec::with_capacity(self.lines.len());
        for wire in &self.lines {
            let standing = wire.standing().iter().map(|entry| entry.demand());
            let demands: Vec<_> = standing.chain(self.added_to(wire).map(Member::demand)).collect();
            let Forecast { plan, problem } = forecast(wire.budget, &demands, 0);
            if let Some(problem) = problem.filter(|_| self.refuses_plans) {
                return Err(FleetError::Plan { line: wire.name.clone(), problem });
            }
            plans.push(plan);
        }
        let entry = |(Wire { name, line, budget, standing, .. }, plan)| match standing {
            Some((entry, _)) => {
                entry.set_plan(plan);
                entry
            }
            None => Arc::new(LineEntry::new(name, line, budget, plan)),
        };
        Ok((self.lines.into_iter().zip(plans).map(entry).collect(), self.members))
    }
}

impl Member {
    fn demand(&self) -> Demand {
        Demand {
            drive: self.settings.name.clone(),
            capabilities: self.drive.capabilities(),
            watchdog_capability: self.drive.watchdog_capability(),
            periods: self.settings.periods,
            watchdog: self.settings.watchdog,
        }
    }

    /// Has the line keep the pause that the drive needs after its answers, also one that has not said so to its port.
    fn keep_pause(&self, line: &Line) {
        line.slave(self.drive.slave().number()).wants_pause(self.drive.capabilities().turnaround);
    }
}
