//! A unit that no line has: all drives of the daemon in few reads. What stands where is one table, for the code, for
//! `drived export gateway-map` and for the manual.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use drive_core::{Control, Direction, Setpoint, State, Status};
use drive_fleet::{
    Became, DriveHandle, Event, EventKind, Events, Freshness, Link, Outcome, Place, Received, Snapshot,
};
use drived_config::names::{PLACES, revision};
use tokio::time::Instant;

/// What stands for a value that is not known, or too old to be told as one.
const UNKNOWN: u16 = 0xFFFF;

/// The head: what is where, so that a reader need not know it.
const HEAD: [(&str, u16, &str); 9] = [
    ("magic", 0x4452, "4452h, \"DR\""),
    ("magic", 0x4956, "4956h, \"IV\""),
    ("version", 1, "of this map"),
    ("drives", 0, "how many places there are: a drive keeps its own, and one that is gone leaves it empty"),
    ("overview", OVERVIEW_AT, "where the overview begins"),
    ("overview_stride", OVERVIEW.len() as u16, "its registers of each drive"),
    ("details", DETAILS_AT, "where the details begin"),
    ("details_stride", DETAILS.len() as u16, "their registers of each drive"),
    ("revision", 0, "of who stands where: another one when a drive has come, left, or has another name"),
];
/// Which register of the head is the number of drives.
const DRIVES: usize = 3;
/// Which is the revision.
const REVISION: usize = 8;
/// Four registers of each drive: 31 drives in one read of 124.
const OVERVIEW_AT: u16 = 16;
const DETAILS_AT: u16 = 2_000;

/// One register of each drive.
struct Column {
    name: &'static str,
    meaning: &'static str,
    of: fn(&Shown) -> u16,
}

const fn column(name: &'static str, meaning: &'static str, of: fn(&Shown) -> u16) -> Column {
    Column { name, meaning, of }
}

const FLAGS: Column = column(
    "flags",
    "bits 0-3 state (as below), 4 forward, 5 reverse, 6 connected, 8-9 quality (as below), 10 fault, 11 a warning of the drive's own, 12 stop not confirmed yet, 13 started by the daemon, 14 something troubles it, as the page says",
    Shown::flags,
);
const FREQUENCY: Column =
    column("frequency", "output frequency, 0.01 Hz; FFFFh: not known now", Shown::frequency);
const CURRENT: Column = column("current", "motor current, 0.1 A; FFFFh: not known now", Shown::current);
const AGE: Column = column("age", "of the status, 0.1 s; FFFFh: never read, or longer", Shown::age);

const OVERVIEW: [Column; 4] = [FLAGS, FREQUENCY, CURRENT, AGE];
const DETAILS: [Column; 16] = [
    FLAGS,
    column(
        "state",
        "0 unknown, 1 not ready, 2 disabled, 3 ready, 4 running, 5 stopping, 6 quick stop, 7 fault reaction, 8 fault; as it was last seen",
        Shown::state,
    ),
    column("quality", "0 never read, 1 old: no value is live, 2 good", Shown::quality),
    column("link", "0 connecting, 1 connected, 2 lost", Shown::link),
    column(
        "control",
        "who commands it: 0 not told, 1 bus, 2 terminals, 3 panel, 4 terminals or panel, 5 another bus",
        Shown::control,
    ),
    FREQUENCY,
    CURRENT,
    AGE,
    column("fault", "the vendor's code of the present fault; 0: none; FFFFh: not known now", Shown::fault),
    column("setpoint", "that the daemon gave last, 0.01 Hz; FFFFh: none, or in rpm", Shown::setpoint),
    column(
        "command",
        "the last one: 0 none, 1 start, 2 stop, 3 setpoint, 4 reset, 5 another",
        Shown::command,
    ),
    column(
        "outcome",
        "of it: 0 none, 1 confirmed, 2 not confirmed, 3 unknown, 4 refused, 5 expired, 6 superseded, 7 nothing to be done",
        Shown::outcome,
    ),
    column("outcome_age", "since then, 1 s; FFFFh: none, or longer", Shown::outcome_age),
    column("trips", "since the daemon began", Shown::trips),
    column("lost", "how often it was lost since then", Shown::lost),
    column("slave", "its address on its line", |shown| shown.slave.into()),
];

/// What became of the last command to each drive.
#[derive(Debug, Clone, Default)]
pub(super) struct Outcomes(Arc<Mutex<HashMap<Place, Last>>>);

#[derive(Debug, Clone, Copy)]
struct Last {
    command: u16,
    outcome: u16,
    at: Instant,
}

impl Outcomes {
    /// Follows the events of the fleet until its end.
    pub(super) async fn follow(self, mut events: Events) {
        loop {
            match events.recv().await {
                Received::Event(Event {
                    place,
                    at,
                    kind: EventKind::Command { command, outcome, .. },
                    ..
                }) => {
                    let command = match command.action() {
                        "start" => 1,
                        "stop" => 2,
                        "setpoint" => 3,
                        "reset" => 4,
                        _ => 5,
                    };
                    let last = Last { command, outcome: number_of(&outcome), at };
                    self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(place, last);
                }
                Received::Event(_) | Received::Missed(_) => {}
                Received::End => return,
            }
        }
    }

    fn of(&self, drive: &Place) -> Option<Last> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(drive).copied()
    }
}

fn number_of(outcome: &Outcome) -> u16 {
    match outcome.became() {
        Became::Confirmed => 1,
        Became::NotConfirmed => 2,
        Became::Unknown => 3,
        Became::Refused => 4,
        Became::Expired => 5,
        Became::Superseded => 6,
        Became::Nothing => 7,
    }
}

/// A drive as it is shown: everything of one moment.
struct Shown {
    /// `None`: nobody is in this place.
    snapshot: Option<Arc<Snapshot>>,
    slave: u8,
    last: Option<Last>,
    now: Instant,
}

impl Shown {
    fn status(&self) -> Option<&Status> {
        self.snapshot.as_ref()?.status.as_ref().map(|status| &*status.value)
    }

    /// The status, where it is one of now.
    fn live(&self) -> Option<&Status> {
        self.snapshot.as_ref()?.fresh_status(self.now)
    }

    fn flags(&self) -> u16 {
        let bit = |is: bool, bit: u16| u16::from(is) << bit;
        let way = self.live().and_then(|status| status.direction);
        self.state()
            | bit(way == Some(Direction::Forward), 4)
            | bit(way == Some(Direction::Reverse), 5)
            | bit(self.link() == 1, 6)
            | self.quality() << 8
            | bit(self.live().is_some_and(Status::is_fault), 10)
            | bit(self.live().is_some_and(|status| status.warning == Some(true)), 11)
            | bit(self.snapshot.as_ref().is_some_and(|snapshot| snapshot.stop.is_some()), 12)
            | bit(self.snapshot.as_ref().is_some_and(|snapshot| snapshot.started_here()), 13)
            | bit(self.snapshot.as_ref().is_some_and(|snapshot| snapshot.concern(self.now).is_some()), 14)
    }

    fn state(&self) -> u16 {
        match self.status().map(|status| status.state) {
            None | Some(State::Unknown) => 0,
            Some(State::NotReady) => 1,
            Some(State::Disabled) => 2,
            Some(State::Ready) => 3,
            Some(State::Running) => 4,
            Some(State::Stopping) => 5,
            Some(State::QuickStop) => 6,
            Some(State::FaultReaction) => 7,
            Some(State::Fault) => 8,
        }
    }

    fn quality(&self) -> u16 {
        match self.snapshot.as_ref().map(|snapshot| snapshot.freshness(self.now)) {
            None | Some(Freshness::Never) => 0,
            Some(Freshness::Stale) => 1,
            Some(Freshness::Fresh) => 2,
        }
    }

    fn link(&self) -> u16 {
        match self.snapshot.as_ref().map(|snapshot| snapshot.link) {
            None | Some(Link::Connecting) => 0,
            Some(Link::Connected) => 1,
            Some(Link::Lost) => 2,
        }
    }

    fn control(&self) -> u16 {
        match self.live().and_then(|status| status.control) {
            None => 0,
            Some(Control::Bus) => 1,
            Some(Control::Terminals) => 2,
            Some(Control::Panel) => 3,
            Some(Control::Local) => 4,
            Some(Control::OtherBus) => 5,
        }
    }

    fn frequency(&self) -> u16 {
        word(self.live().and_then(|status| status.output_frequency).map(drive_core::Frequency::centihertz))
    }

    fn current(&self) -> u16 {
        word(self.live().and_then(|status| status.current).map(drive_core::Current::deciamperes))
    }

    fn age(&self) -> u16 {
        let status = self.snapshot.as_ref().and_then(|snapshot| snapshot.status.as_ref());
        word(status.map(|status| status.age(self.now).as_millis() / 100))
    }

    fn fault(&self) -> u16 {
        match self.live() {
            None => UNKNOWN,
            Some(status) if status.is_fault() => {
                let trip = self.snapshot.as_ref().and_then(|snapshot| snapshot.present_trip()?.fault());
                trip.map(|fault| fault.code).or(status.fault_code).unwrap_or(UNKNOWN)
            }
            Some(_) => 0,
        }
    }

    fn setpoint(&self) -> u16 {
        match self.snapshot.as_ref().and_then(|snapshot| snapshot.setpoint) {
            Some(Setpoint::Frequency(frequency)) => word(Some(frequency.centihertz())),
            _ => UNKNOWN,
        }
    }

    fn command(&self) -> u16 {
        self.last.map_or(0, |last| last.command)
    }

    fn outcome(&self) -> u16 {
        self.last.map_or(0, |last| last.outcome)
    }

    fn outcome_age(&self) -> u16 {
        word(self.last.map(|last| self.now.saturating_duration_since(last.at).as_secs()))
    }

    fn trips(&self) -> u16 {
        word(Some(self.snapshot.as_ref().map_or(0, |snapshot| snapshot.counters.trips)))
    }

    fn lost(&self) -> u16 {
        word(Some(self.snapshot.as_ref().map_or(0, |snapshot| snapshot.counters.lost)))
    }
}

/// A number as a register tells it.
fn word<T: TryInto<u16>>(number: Option<T>) -> u16 {
    number.and_then(|number| number.try_into().ok()).unwrap_or(UNKNOWN)
}

/// The registers of a read; `None` where one of them is nowhere. Each drive stands in its own place, whoever else is there.
pub(super) fn read(
    slots: &[Option<Arc<str>>],
    drive: impl Fn(&str) -> Option<DriveHandle>,
    outcomes: &Outcomes,
    address: u16,
    count: u16,
) -> Option<Vec<u16>> {
    let now = Instant::now();
    let shown = |slot: usize| {
        let name = slots.get(slot)?;
        let handle = name.as_deref().and_then(&drive);
        Some(Shown {
            snapshot: handle.as_ref().map(DriveHandle::snapshot),
            slave: handle.as_ref().map_or(0, |handle| handle.slave().number()),
            last: handle.as_ref().and_then(|handle| outcomes.of(handle.place())),
            now,
        })
    };
    // All registers of a drive are of one moment.
    let mut last: Option<(usize, Shown)> = None;
    let mut of_block = |address: u16, at: u16, columns: &[Column]| {
        let offset = usize::from(address.checked_sub(at)?);
        let slot = offset / columns.len();
        if last.as_ref().is_none_or(|(of, _)| *of != slot) {
            last = Some((slot, shown(slot)?));
        }
        let (_, drive) = last.as_ref()?;
        columns.get(offset % columns.len()).map(|column| (column.of)(drive))
    };
    let mut register = |address: u16| match usize::from(address) {
        DRIVES => u16::try_from(slots.len()).ok(),
        REVISION => Some(revision(slots)),
        head if address < OVERVIEW_AT => Some(HEAD.get(head).map_or(0, |(_, value, _)| *value)),
        _ if address >= DETAILS_AT => of_block(address, DETAILS_AT, &DETAILS),
        _ => of_block(address, OVERVIEW_AT, &OVERVIEW),
    };
    (0..count).map(|number| register(address.checked_add(number)?)).collect()
}

/// Each number that is given has a place, in the overview and in the details.
const _: () = assert!(PLACES == (DETAILS_AT - OVERVIEW_AT) as usize / OVERVIEW.len());

/// The map for these drives, each in its place, as CSV.
pub fn map(slots: &[Option<Arc<str>>]) -> String {
    let mut lines = vec!["register,drive,name,meaning".to_owned()];
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    for (address, (name, _, meaning)) in HEAD.iter().enumerate() {
        let of_map = if address == REVISION { format!("; {} here", revision(slots)) } else { String::new() };
        lines.push(format!("{address},,{name},{}", quoted(&format!("{meaning}{of_map}"))));
    }
    for (at, columns) in [(OVERVIEW_AT, &OVERVIEW[..]), (DETAILS_AT, &DETAILS[..])] {
        let rows = slots.iter().flat_map(|drive| columns.iter().map(move |column| (drive, column)));
        for (address, (drive, Column { name, meaning, .. })) in (usize::from(at)..).zip(rows) {
            if let Some(drive) = drive {
                lines.push(format!("{address},{},{name},{}", quoted(drive), quoted(meaning)));
            }
        }
    }
    lines.join("\n")
}
