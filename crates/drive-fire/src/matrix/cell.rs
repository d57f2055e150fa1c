//! One cell: which drive, on which way, behind what, in which state, asked for what, struck by what, and where. A cell has a number,
//! and a number is a cell.

use std::fmt;

use super::{Event, FarEnd, Fault, Operation, Subject, Untold, Way};

/// At which exchange of the operation the fault strikes: the first, the second, the third or the fifth.
pub(super) const PLACES: [usize; 4] = [0, 1, 2, 4];

/// Which cells of the whole are looked at together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Plane {
    /// Faults of the wire alone.
    Wire,
    /// What stands between, with a fault of the wire.
    FarEnds,
    /// What happens to the drive, on a sound line.
    Events,
    /// Everything with everything.
    All,
    /// A second master that is heard in part, with a fault of the wire.
    HeardInPart,
}

impl Plane {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Wire, Self::FarEnds, Self::Events, Self::All, Self::HeardInPart];

    pub(super) const fn letter(self) -> char {
        match self {
            Self::Wire => 'W',
            Self::FarEnds => 'F',
            Self::Events => 'E',
            Self::All => 'A',
            Self::HeardInPart => 'P',
        }
    }

    /// How many values each axis has here, in the order of [`Cell::by_digits`].
    const fn axes(self) -> [u64; 9] {
        let all = [
            Subject::COUNT as u64,
            Way::ALL.len() as u64,
            FarEnd::FIRST as u64,
            Fault::ALL.len() as u64,
            PLACES.len() as u64,
            Event::ALL.len() as u64,
            2,
            2,
            Operation::ALL.len() as u64,
        ];
        let [subjects, ways, far_ends, faults, places, events, moments, states, operations] = all;
        match self {
            Self::Wire => [subjects, ways, 1, faults, places, 1, 1, states, operations],
            Self::FarEnds => [subjects, ways, far_ends, faults, places, 1, 1, states, operations],
            Self::Events => [subjects, ways, 1, 1, 1, events, moments, states, operations],
            Self::All => all,
            Self::HeardInPart => {
                let parts = (FarEnd::ALL.len() - FarEnd::FIRST) as u64;
                [subjects, ways, parts, faults, places, 1, 1, states, operations]
            }
        }
    }

    /// How many cells it has, those that cannot exist among them.
    #[must_use]
    pub fn cells(self) -> u64 {
        self.axes().iter().product()
    }
}

/// One cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cell {
    /// Where it stands.
    pub plane: Plane,
    /// Its number there.
    pub number: u64,
    /// Whose drive.
    pub subject: Subject,
    /// How it is reached.
    pub way: Way,
    /// What stands between.
    pub far_end: FarEnd,
    /// What goes wrong on the wire.
    pub fault: Fault,
    /// At which exchange.
    pub place: usize,
    /// What happens to the drive.
    pub event: Event,
    /// While the operation is under way, or before it.
    pub amid: bool,
    /// Whether the motor runs by our command before.
    pub runs: bool,
    /// What is asked.
    pub operation: Operation,
}

impl Cell {
    /// The cell of this number; `None`: the plane has fewer.
    #[must_use]
    pub fn of(plane: Plane, number: u64) -> Option<Self> {
        if number >= plane.cells() {
            return None;
        }
        let mut rest = number;
        let digits = plane.axes().map(|axis| {
            let digit = rest % axis;
            rest /= axis;
            digit as usize
        });
        let [subject, way, far_end, fault, place, event, moment, state, operation] = digits;
        let far_end = if plane == Plane::HeardInPart { FarEnd::FIRST + far_end } else { far_end };
        Some(Self {
            plane,
            number,
            subject: Subject::of(subject),
            way: Way::ALL[way],
            far_end: FarEnd::ALL[far_end],
            fault: Fault::ALL[fault],
            place: PLACES[place],
            event: Event::ALL[event],
            amid: moment == 1,
            runs: state == 1,
            operation: Operation::ALL[operation],
        })
    }

    /// The cell of a line such as `W:123456`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let (plane, number) = name.split_once(':')?;
        let plane = Plane::ALL.into_iter().find(|known| plane.starts_with(known.letter()))?;
        Self::of(plane, number.parse().ok()?)
    }

    /// Its name, which replays it.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}:{}", self.plane.letter(), self.number)
    }

    /// What nobody at this end of the way can tell from what is right: the README of drive-bus lists it.
    pub fn untold(&self) -> impl Iterator<Item = Untold> {
        let of_far_end = self.far_end.untold(self.way, self.fault != Fault::None);
        let fast = self.far_end == FarEnd::Fast;
        let deaf = self.fault.in_front_of(self.event.deafens()).untold(self.way, fast);
        let collides = self.far_end == FarEnd::MasterHeardInAnswers && matches!(self.fault, Fault::Double(_));
        let lost = collides.then_some(Untold::confirmation(
            "the second of two confirmations of one write, while the next is lost to a question that is not heard",
        ));
        let of_the_wire = self.fault.untold(self.way, fast);
        of_far_end.into_iter().chain(of_the_wire).chain(deaf).chain(lost)
    }

    /// Why it cannot exist, or is another one; `None`: it can.
    #[must_use]
    pub fn cannot_exist(&self) -> Option<&'static str> {
        let Self { subject, way, far_end, fault, place, event, amid, runs, operation, .. } = *self;
        subject
            .impossible_on(way)
            .or_else(|| far_end.impossible_on(way))
            .or_else(|| fault.impossible_on(way))
            .or_else(|| event.impossible_for(subject))
            .or_else(|| operation.impossible_for(subject, runs))
            .or((fault == Fault::None && place > 0).then_some("no fault has one place"))
            .or((event == Event::Nothing && amid).then_some("nothing happens at one time"))
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { subject, way, far_end, fault, place, event, amid, runs, operation, .. } = self;
        let state = if *runs { "running" } else { "at rest" };
        write!(
            f,
            "{}: {subject} {state}, {way}, {far_end}, {operation}, {fault} at exchange {place}",
            self.name()
        )?;
        match event {
            Event::Nothing => Ok(()),
            event => write!(f, ", {event} {}", if *amid { "amid" } else { "before" }),
        }
    }
}
