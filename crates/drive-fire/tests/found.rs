//! What the attacks have found and was mended, each as the cell that found it.

use drive_core::{Direction, StopMode};
use drive_fire::matrix::{Cell, Event, FarEnd, Fault, Lived, Operation, Plane, Subject, Way, live, open};

/// A sound line to the first family.
const CELL: Cell = Cell {
    plane: Plane::All,
    number: 0,
    subject: Subject::of(0),
    way: Way::ModbusTcp,
    far_end: FarEnd::Plain,
    fault: Fault::None,
    place: 0,
    event: Event::Nothing,
    amid: false,
    runs: true,
    operation: Operation::Start(Direction::Forward),
};

fn against(cell: &Cell) -> Vec<String> {
    match live(cell, &*open(cell)) {
        Lived::Against(why) => why,
        _ => Vec::new(),
    }
}

/// Rule 12: told at rest at 26 Hz, because a motor that was seen to come down once has no output any more.
#[test]
fn a_motor_that_trips_in_a_stop_may_coast() {
    for mode in [StopMode::Ramp, StopMode::Fast] {
        for way in [Way::Rtu, Way::ModbusTcp] {
            let cell = Cell { event: Event::Trip, amid: true, operation: Operation::Stop(mode), way, ..CELL };
            assert_eq!(against(&cell), Vec::<String>::new(), "{cell}");
        }
    }
}
