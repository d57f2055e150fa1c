//! What the attacks have found and was mended, each as the cell that found it.

use drive_core::{Direction, StopMode};
use drive_fire::{
    matrix::{Cell, Event, FarEnd, Fault, Lived, Operation, Plane, Subject, Way, live, open},
    model::master::{Setting, Step, lives},
};

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

/// A late answer was heard, and its slave asked again at once: by the next request, and by the probe of one that was off-line.
#[test]
fn a_slave_that_was_heard_late_has_its_pause_before_it_is_asked_or_probed() {
    use Step::{ComesLate, Command, Lose, Read, Stop};

    for setting in Setting::ALL {
        for steps in [&[Command, Lose, ComesLate, Stop][..], &[Read, Lose, Lose, ComesLate]] {
            assert_eq!(lives(setting, steps), Ok(()), "{setting:?}: {steps:?}");
        }
    }
}
