//! What the attacks have found and was mended, each as the cell that found it.

use drive_core::{Direction, StopMode};
use drive_fire::{
    matrix::{
        Cell, Event, FarEnd, Fault, Lived, Operation, Plane, Subject, Way, drive_of, live, open,
        story::Story, tell,
    },
    model::{
        Model,
        master::{Setting, Step, lives},
    },
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

/// Each of these cells was a find once.
#[test]
fn no_cell_that_was_a_find_is_one_again() {
    for (name, what) in [
        ("W:493662", "the silence of ASCII behind an echo: asked again into the answer"),
        ("W:364162", "the same"),
        (
            "A:147610559",
            "a G120 whose output is cut in a stop: told at rest at 26 Hz by the words of a ramp behind it",
        ),
        ("W:201462", "the same behind a damaged echo"),
        ("W:346590", "a 21 whose status word was refused: told that it may coast while it injects"),
        // Explained: between two looks half a second apart a supply went and came back. The words are those of a ramp that has ended.
        ("E:41031", "at rest at 17 Hz, in a stop"),
        ("E:41500", "the same"),
        ("E:36801", "the same"),
        ("W:188834", "a run command that trips before the next look, told at rest"),
        ("W:190931", "a run word that was carried out and answered by exception 04, without a lease"),
        ("W:161341", "the same"),
        ("F:1614781", "the same by 0Bh"),
        ("A:85936002", "the same of a 58"),
        ("A:63342000", "a 21 that a refused start saw running had tripped by the next status: told at rest"),
        ("A:183655244", "a 3G3EV that lost its supply between the two exchanges of a status: told at rest"),
        ("A:183523431", "the same of a 28"),
        (
            "A:134574732",
            "a 58 that was let coast, and taken by its panel at a setpoint of zero: told at rest",
        ),
        ("E:24453", "a 312 told in force while it came down, whose panel gave back control"),
        ("A:97350993", "the same in a setpoint"),
        ("W:366934", "the late confirmation by 10h of another value, told as that of the next write"),
        ("A:154333284", "the same behind a gateway"),
        (
            "A:143205551",
            "an adapter's first echo in front of a drive that had lost its supply for a moment: the matrix was wrong",
        ),
        (
            "A:69246507",
            "an answer that came twice, taken for the next of the same words: the matrix was wrong",
        ),
        ("A:128469787", "an equal stop, confirmed by the answer to the one before it: the matrix was wrong"),
        ("A:72501572", "a 58 told in force while it came down, whose panel gave back control"),
        (
            "W:156103",
            "a neighbour asked into the answer of a 312 whose answer to another question had come instead",
        ),
        (
            "W:177444",
            "a start that was confirmed, and says that this was four seconds ago: the matrix was wrong",
        ),
    ] {
        let cell = Cell::named(name).expect("it is a cell");
        let why = against(&cell);
        assert!(why.is_empty(), "{what}: {cell}\n{}", why.join("\n"));
    }
}

/// Each of these stories was a find once.
#[test]
fn no_story_that_was_a_find_is_one_again() {
    for (line, what) in [
        (
            "4.4.0.e11.o12.e7",
            "a 3G3EV run by its panel behind a reset, of which its twin heard nothing: the stories were wrong",
        ),
        (
            "4.4.0.o5.f51x4.o6.o14",
            "a 3G3EV that could not complete a start the other way: what it ran by was not withdrawn",
        ),
        (
            "3.0.0.o19.o11.f48x4.o14.s2.o6.o9",
            "a 312 some of whose settings were known when FSt was changed at the keypad: its fast stop was none",
        ),
        ("7.4.0.d6x21.f71x2.l5.d5x35", "an iG5A that goes on by its own run word of before"),
        (
            "6.3.0.o6.f52x5.o5",
            "a Goodrive that answers a start the other way by 05h, and goes on by the one before",
        ),
        (
            "6.4.0.o6.d5x5.o6.o5.f70x4.l1",
            "a Goodrive that goes on by its own run word of before: another was blamed for its direction",
        ),
        ("6.0.0.f22x4.o6.d5x26", "the same behind a damaged answer and a start whose call was dropped"),
        ("6.0.0.o5.f72x5.o6", "the same behind a mute line"),
        (
            "9.3.0.o8.d5x27.d7x10",
            "a G120 whose start and setpoint nobody waited for: another was blamed for what stood before",
        ),
        ("5.4.0.o5.l3.o8.o10", "freewheel behind a ramp: told at rest at 5 Hz, as if the ramp had ended"),
        ("3.4.0.o13.e14.e12", "released to the terminals, which start it: the stories were wrong"),
        (
            "2.2.0.f10x5.o5.o11",
            "a 58 on UNI-TELWAY: told at rest at 0.36 Hz by a reply to an earlier question",
        ),
        (
            "2.1.3.l4.l3.o7",
            "what a 58 said behind another frame of ASCII was taken for nobody's: the stage was wrong",
        ),
        (
            "1.0.0.e14.o5.l6.o8.f48x1.o11.o9",
            "a 28 into which current flowed for a moment between two looks told at rest at 24 Hz",
        ),
        (
            "2.2.0.f73x3.o8.o8",
            "the stop of a 58 on UNI-TELWAY that never ended: it was put aside while a port opened anew was listened to",
        ),
        (
            "3.0.0.o5.l8.o8.l8.s0.o5.l4.o8.l2",
            "a ramp stop that sped a 312 up: a preset speed was put on bit 12 of CMD while its motor stood",
        ),
        (
            "0.4.0.s0.o6.l6.o8.f71x1.l4",
            "a 21 that tripped in the middle of a status behind a stop told at rest at 0.7 Hz, by a word of before and one of behind",
        ),
        ("1.0.0.o5.l4.d7x13.l6", "a 28 whose setpoint nobody waited for was told to follow another master's"),
        ("2.0.0.o5.l4.d7x10.l6", "the same of a 58"),
        ("3.0.0.o5.l4.d7x10.l6", "the same of a 312"),
        (
            "3.4.0.f7x1.o2.f60x2.o9",
            "a 312 over Modbus TCP whose answer had another one in its middle: the stage was wrong",
        ),
        (
            "4.0.0.f70x4.o5",
            "a start that was confirmed four seconds ago, before the process stood still: the judge was wrong",
        ),
        (
            "6.4.0.o6.e4.o7.o9.o7.e1",
            "a Goodrive that lost its supply behind a stop, seen by a refused setpoint alone: the stories were wrong",
        ),
        (
            "3.3.8.l8.o6.o10.e6.o11.o9.o11",
            "a 312 behind a gateway that doubles: the wait for the answer that was taken last was forgotten for what was owed",
        ),
        (
            "2.3.0.l3.l5.o6.o8.f47x3.o5.o10",
            "a 58 that was started, answered by exceptions, and was let coast before its next status: told at rest at 0.56 Hz",
        ),
        ("8.3.0.o5.l2.o8.e10.o1.l1", "a V20 whose output is cut in a ramp: told at rest at 6.7 Hz"),
    ] {
        let story = Story::read(line).expect("it is a story");
        let lived = tell(&story, &*drive_of(story.subject.family()));
        assert!(!matches!(lived, Lived::Against(_)), "{what}: {}: {lived:?}", story.in_words());
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

/// An answer that was damaged, or cut off by a stop, came from its slave as every other.
#[test]
fn a_slave_whose_answer_was_damaged_has_its_pause_before_a_stop() {
    use Step::{Answer, Command, Damage, Lose, Read, Refuse, Stop, Wait};

    for (setting, steps) in [
        (Setting::Gateway, &[Read, Refuse, Stop, Lose, Damage, Stop][..]),
        (Setting::Wire, &[Command, Wait, Wait, Wait, Wait, Answer, Wait, Damage, Stop]),
    ] {
        assert_eq!(lives(setting, steps), Ok(()), "{setting:?}: {steps:?}");
    }
}

/// Found by long orders of events through the master of a line.
#[test]
fn no_order_of_a_line_that_was_a_find_is_one_again() {
    for (setting, steps, what) in [
        (
            "Wire",
            "kjaehfahiila",
            "a stop in the pause behind a late answer in the exchange that it broke off",
        ),
        ("Wire", "fjekiiaail", "a repeated stop sent into another's late answer"),
        ("Wire", "famiikjll", "an answer later than its window, which nobody can tell: the model was wrong"),
        ("Wire", "faijdkfhfhfamhjml", "the same of a read of which answers of all lengths are owed"),
        ("Wire", "aheiiijialfmiikmlfccmijiajl", "a late answer whose check ends with 00h"),
        (
            "Wire",
            "afhmimiljafjefilafjchjehmljml",
            "the answer to an earlier question of a shape that was owed, and taken, once already",
        ),
        (
            "Wire",
            "fjjdjkfaikackmimjfakjhlifl",
            "the same where two of the lengths were answered behind a damaged answer, and the model was wrong",
        ),
        ("Gateway", "aaaaaaaaaaaaaaaaa", "seventeen stops in vain end after 300 s: the model was wrong"),
        ("Gateway", &"a".repeat(60), "the same of sixty"),
    ] {
        assert_eq!(Model::named("master").expect("it is one").again(setting, steps), Ok(()), "{what}");
    }
}

/// The same through what the master knows of a gateway.
#[test]
fn no_order_of_a_gateway_that_was_a_find_is_one_again() {
    for (setting, steps, what) in [
        ("Tells", "afhehb", "asked while it was at a question, behind two lost connections"),
        (
            "Tells",
            "bfjfjdgggheefjb",
            "the same, by what looked like the answer to what a lost connection had asked",
        ),
        ("Silent", "fbeeih", "the same behind one"),
        ("Silent", "jcffje", "taken to wait for more than twice as long, behind three stops"),
        ("Silent", "aagiggeeeij", "the same"),
        ("Silent", "fffgjjjee", "the same, of what was given up when all before it was over"),
        (
            "Silent",
            "ffeaefijiijgje",
            "the same, by what it was asked when all before it was over, and it had been at nothing for two seconds",
        ),
        (
            "Silent",
            "gfgjfjgffeeifgjgefbee",
            "the same, by a stop that went out when it had been at nothing for four",
        ),
        ("Unknown", "ffgbbihgjgijadgj", "the only probe went to a drive that nobody asked for"),
        ("Silent", &*"f".repeat(30), "thirty stops in vain end after two minutes: the model was wrong"),
        (
            "Unknown",
            "ffffffffffffjjjjjjjjjjf",
            "the thirteenth of thirteen stops in vain waited for the shares of all",
        ),
        ("Unknown", "hcdhjgde", "a timeout of a second, learned behind what a lost connection had asked"),
    ] {
        assert_eq!(Model::named("gateway").expect("it is one").again(setting, steps), Ok(()), "{what}");
    }
}
