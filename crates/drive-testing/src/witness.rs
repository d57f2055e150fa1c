//! Who stands beside the machines while others tell of them: a fleet, a daemon, whoever publishes what drives say.
//!
//! [`Witnesses::attend`] holds everything that is told of a drive against its simulated machine: [the shaft](crate::truth), and the
//! manual of its family, as [`ByManual`] follows it: nothing turns by a command of the bus while no run command of this side stands.
//! What contradicts is told, by a panic, when the witnesses are dropped, so that no test has to ask.

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::Duration,
};

use drive_bus::Latest;
use drive_core::Status;
use drive_sim::{Intervention, SimSlave};
use tokio::{task::JoinHandle, time::Instant};

use crate::{
    truth::{TOLERANCE, contradiction},
    worlds::{ByManual, Judge},
};

/// No answer that is taken is longer on its way.
const ON_ITS_WAY: Duration = Duration::from_secs(5);

/// What is told of a drive at one moment.
#[derive(Debug, Clone)]
pub struct Told {
    /// What it says of itself.
    pub status: Arc<Status>,
    /// When that was read.
    pub at: Instant,
    /// Whether a run command of this side is said to stand in it.
    pub held: bool,
    /// How many of its answers have not come so far: one of them may have come since, and be taken for that to an equal question, which
    /// no master can tell where frames have no numbers.
    pub missing: u64,
}

/// What was said of drives, and what their machines did meanwhile.
#[derive(Debug, Default)]
pub struct Witnesses {
    attending: Vec<JoinHandle<()>>,
    against: Arc<Mutex<Vec<String>>>,
}

impl Witnesses {
    /// From now on whatever is told of this machine's drive is held against it. `says` takes it from what is published; `None`:
    /// nothing is said now.
    ///
    /// Its manual is followed only where nobody has commanded it before.
    ///
    /// # Panics
    /// Outside of a runtime.
    pub fn attend<T: Send + Sync + 'static>(
        &mut self,
        machine: &SimSlave,
        published: impl Into<Latest<Arc<T>>>,
        says: fn(&T) -> Option<Told>,
    ) {
        let mut witness = Witness::of(machine);
        let (mut published, against) = (published.into(), Arc::clone(&self.against));
        self.attending.push(tokio::spawn(async move {
            loop {
                let told = says(&published.look());
                if let Some(objection) = told.and_then(|told| witness.objects(&told)) {
                    against.lock().unwrap_or_else(PoisonError::into_inner).push(objection);
                }
                if published.changed().await.is_err() {
                    break;
                }
            }
        }));
    }
}

#[cfg(feature = "fleet")]
impl Witnesses {
    /// From now on whatever a fleet tells of its drives is held against the machines of these lines, by the names under which the
    /// fleet has them.
    ///
    /// # Panics
    /// As [`attend`](Self::attend).
    #[must_use]
    pub fn of_fleet<'a>(
        fleet: &drive_fleet::Fleet,
        lines: impl IntoIterator<Item = (&'a str, &'a drive_sim::SimLine)>,
    ) -> Self {
        let mut witnesses = Self::default();
        for (name, simulated) in lines {
            for drive in fleet.drives().iter().filter(|drive| **drive.line().0 == *name) {
                if let Some(machine) = simulated.slave(drive.slave().number()) {
                    witnesses.attend_drive(&machine, drive);
                }
            }
        }
        witnesses
    }

    /// The same for one drive.
    ///
    /// # Panics
    /// As [`attend`](Self::attend).
    pub fn attend_drive(&mut self, machine: &SimSlave, drive: &drive_fleet::DriveHandle) {
        self.attend(machine, drive.watch(), by_fleet);
    }
}

/// What a fleet tells of a drive that answers.
#[cfg(feature = "fleet")]
fn by_fleet(snapshot: &drive_fleet::Snapshot) -> Option<Told> {
    let is_live = snapshot.link == drive_fleet::Link::Connected && !snapshot.retracted;
    let status = snapshot.status.as_ref().filter(|_| is_live)?;
    Some(Told {
        status: Arc::clone(&status.value),
        at: status.at,
        held: snapshot.lease.is_some(),
        missing: snapshot.counters.failures,
    })
}

impl Drop for Witnesses {
    fn drop(&mut self) {
        self.attending.iter().for_each(JoinHandle::abort);
        let against = self.against.lock().unwrap_or_else(PoisonError::into_inner);
        assert!(against.is_empty() || thread::panicking(), "words against the machine: {against:#?}");
    }
}

/// One machine and what was told of it last.
struct Witness {
    machine: SimSlave,
    manual: Option<ByManual>,
    last: Option<Instant>,
    missing: u64,
    /// How fast it turned when the manual objected last.
    doubted: Option<i32>,
}

impl Witness {
    fn of(machine: &SimSlave) -> Self {
        let is_set = |what| matches!(what, Intervention::Set(..));
        let is_untouched = machine.interventions().iter().all(|done| is_set(done.what))
            && [0x06, 0x10].iter().all(|function| machine.requests(*function) == 0);
        let manual = is_untouched.then(|| ByManual::of(machine)).flatten();
        Self { machine: machine.clone(), manual, last: None, missing: 0, doubted: None }
    }

    /// What the machine, or the manual, has against it.
    fn objects(&mut self, told: &Told) -> Option<String> {
        // Followed at every word: the machine remembers the last requests only.
        if let Some(manual) = &mut self.manual {
            manual.follow();
        }
        let missed = std::mem::replace(&mut self.missing, told.missing) < told.missing;
        if self.last.replace(told.at) == Some(told.at) || self.has_changed_since(told.at, missed) {
            return None;
        }
        let by_shaft = contradiction(&told.status, &self.machine.observe());
        let why = by_shaft.or_else(|| self.manual_objects(told))?;
        let ago = |at: Instant| Instant::now().saturating_duration_since(at);
        let happened = self.machine.interventions().last().map(|last| (last.what, ago(last.at)));
        let told = ago(told.at);
        Some(format!("{}: {why}; told of {told:?} ago, last befell it {happened:?} ago", self.machine.name()))
    }

    /// What the manual has against it, of a motor that does not come down: one that was stopped still turns for a while.
    fn manual_objects(&mut self, told: &Told) -> Option<String> {
        let in_force = told.status.verdict.is_some_and(|verdict| verdict.is_in_force());
        let why = self.manual.as_mut()?.objects(told.held, in_force);
        let turns = self.machine.observe().output_frequency.abs();
        let before = std::mem::replace(&mut self.doubted, why.as_ref().map(|_| turns));
        why.filter(|_| before.is_some_and(|before| turns >= before && turns > TOLERANCE))
    }

    /// Whether something was done to the machine since it was asked for what came at this moment, so that it need not be any more as
    /// it was told: a drive answers what it is when it is asked, and its answer may be long on its way.
    fn has_changed_since(&self, at: Instant, missed: bool) -> bool {
        let earliest = at.checked_sub(ON_ITS_WAY).unwrap_or(at);
        let asked = self.machine.received_since(earliest).into_iter().map(|request| request.at);
        let asked = asked.filter(|asked| *asked <= at).max().unwrap_or(at);
        let since = if missed { earliest } else { asked };
        let touched = self.machine.interventions().last().is_some_and(|last| last.at >= since);
        let writes = |pdu: &[u8]| matches!(pdu.first(), Some(0x06 | 0x10));
        touched || self.machine.received_since(at).iter().any(|request| writes(&request.pdu))
    }
}
