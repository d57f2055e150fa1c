//! The world of a drive, by its handle and by lines of text.

use std::time::Duration;

use crate::support::{CMD, HOME, REF, Small, ask, frame, read, write};
use drive_core::Percent;
use drive_sim::{ControlError, SimLine};

const PATIENCE: Duration = Duration::from_millis(500);

fn line() -> SimLine {
    let line = SimLine::default();
    line.add(1, Small::new()).unwrap();
    line.add(2, Small::new()).unwrap();
    line
}

#[tokio::test(start_paused = true)]
async fn what_happens_around_a_drive_acts_on_it_alone() {
    let line = line();
    let [one, two] = [1, 2].map(|address| line.slave(address).unwrap());
    for said in
        ["small@1 set CMD 1", "small@1 analog ai1 50%", "small@2 master REF 40", "small@2 master CMD 1"]
    {
        assert_eq!(line.control(said).as_deref(), Ok("done"), "{said}");
    }
    one.wait_until(|seen| seen.output_frequency == 2_500).await;
    line.control("small@1 terminal LOC on").unwrap();
    two.wait_until(|seen| seen.output_frequency == 4_000).await;
    let seen = line.control("small@2 show").unwrap();
    assert_eq!(seen, "fed, output 40.00 Hz, shaft 40.00 Hz, setpoint 40.00 Hz");
    one.wait_until(|seen| seen.local && !seen.running).await;
    line.control("small@1 terminal LOC off").unwrap();
    one.analog("AI1", Percent::from_percent(100)).unwrap();
    one.wait_until(|seen| seen.output_frequency == 5_000).await;
}

#[tokio::test(start_paused = true)]
async fn a_drive_without_supply_is_mute_and_its_motor_coasts() {
    let line = line();
    let mut port = line.in_memory();
    let slave = line.slave(1).unwrap();
    for (register, value) in [(REF, 5_000), (CMD, 1)] {
        ask(&mut port, &write(1, register.address(), value), PATIENCE).await.unwrap();
    }
    slave.wait_until(|seen| seen.output_frequency == 5_000).await;
    line.control("small@1 power off").unwrap();
    let seen = slave.observe();
    assert_eq!((seen.running, seen.shaft_frequency), (false, 5_000));
    slave.power(true);
    assert!(ask(&mut port, &read(1, CMD.address(), 1), PATIENCE).await.is_some());
    slave.power(false);
    assert_eq!(ask(&mut port, &read(1, CMD.address(), 1), PATIENCE).await, None);
    line.control("small@1 power on").unwrap();
    let answer = ask(&mut port, &read(1, CMD.address(), 1), PATIENCE).await;
    assert_eq!(answer, Some(frame(&[1, 3, 2, 0, 0])), "the command is gone");
}

#[tokio::test(start_paused = true)]
async fn the_reading_of_a_doubtful_place_is_chosen_by_name() {
    for (reading, fed) in [("coasts", false), ("ramps", true)] {
        let line = line();
        let slave = line.slave(1).unwrap();
        line.control("small@1 analog AI1 100%").unwrap();
        slave.poke(CMD.address(), 1);
        line.control("small@1 analog AI1 100%").unwrap();
        slave.wait_until(|seen| seen.output_frequency == 5_000).await;
        slave.reading("trip", reading).unwrap();
        line.control("small@1 trip SLF").unwrap();
        assert_eq!((slave.observe().running, slave.observe().trip), (fed, Some(5)));
    }
}

#[tokio::test(start_paused = true)]
async fn a_cable_is_cut_for_one_drive_or_for_all() {
    let line = line();
    let mut port = line.in_memory();
    let mut heard = Vec::new();
    for said in ["small@1 cable cut", "small@1 cable join", "line cut", "line join"] {
        line.control(said).unwrap();
        for address in [1, 2] {
            heard.push(ask(&mut port, &read(address, CMD.address(), 1), PATIENCE).await.is_some());
        }
    }
    assert_eq!(heard, [false, true, true, true, false, false, true, true]);
}

#[tokio::test(start_paused = true)]
async fn a_drive_answers_at_the_address_that_it_has_given_itself() {
    let line = line();
    let mut port = line.in_memory();
    let change = write(1, HOME.address(), 9);
    assert_eq!(ask(&mut port, &change, PATIENCE).await, Some(change));
    assert_eq!(ask(&mut port, &read(1, CMD.address(), 1), PATIENCE).await, None);
    let answer = ask(&mut port, &read(9, HOME.address(), 1), PATIENCE).await;
    assert_eq!(answer, Some(frame(&[9, 3, 2, 0, 9])));
    assert_eq!(
        line.slave(1).unwrap().name(),
        "small@1",
        "somebody beside it still finds it where it was put"
    );
}

#[tokio::test(start_paused = true)]
async fn a_block_with_one_word_that_is_refused_writes_nothing() {
    let line = line();
    let mut port = line.in_memory();
    // CMD = 1 and REF = 5001, of which 5000 is the most.
    let block = frame(&[1, 0x10, 0, 1, 0, 2, 4, 0, 1, 0x13, 0x89]);
    assert_eq!(ask(&mut port, &block, PATIENCE).await, Some(frame(&[1, 0x90, 3])));
    assert_eq!(line.slave(1).unwrap().peek(CMD.address()), Some(0));
}

#[tokio::test(start_paused = true)]
async fn a_line_that_cannot_be_carried_out_says_why() {
    let line = line();
    for (said, why) in [
        ("small@1 terminal LI7 on", "small has no terminal \"LI7\": it has LOC"),
        ("small@1 analog AI2 50%", "small has no analog input \"AI2\": it has AI1"),
        ("small@1 reading trip jumps", "small has no reading \"jumps\": it has coasts, ramps"),
        ("small@1 reading stop coasts", "small has no switch \"stop\": it has trip"),
        ("small@3 power off", "\"small@3\" is no drive of this line: it has small@1, small@2"),
        ("atv312@1 power off", "\"atv312@1\" is no drive of this line: it has small@1, small@2"),
        ("small@1 trip SLG", "\"SLG\" is not a fault of this family, by its mnemonic or its number"),
        ("small@1 analog AI1 half", "\"half\" is not a level such as 50% or -12.5%"),
        ("small@1 get SPEED", "\"SPEED\" is not a register, by its mnemonic or its address"),
        ("small@1 get 0x00FF", "small@1 has no register 00FFh that takes this"),
        ("small@1 master REF 5001", "the drive answers exception 03h"),
        ("small@1 dance", "\"small@1 dance\" is none of the lines that there are: say help for a list"),
        ("line cut now", "\"line cut now\" is none of the lines that there are: say help for a list"),
    ] {
        assert_eq!(line.control(said).unwrap_err().to_string(), why);
    }
    assert!(matches!(line.control("reboot"), Err(ControlError::Unknown(_))));
}

#[tokio::test(start_paused = true)]
async fn the_lines_and_the_names_are_told_to_who_asks() {
    let line = line();
    let help = line.control(" help ").unwrap();
    for word in
        ["terminal", "analog", "panel", "power", "motor-supply", "trip", "cable", "reading", "line cut"]
    {
        assert!(help.contains(word), "{word}");
    }
    let drives = line.control("drives").unwrap();
    assert_eq!(
        drives.lines().take(4).collect::<Vec<_>>(),
        [
            "small@1",
            "  terminals: LOC",
            "  analog inputs: AI1",
            "  reading trip coasts | ramps: how a trip stops the motor"
        ]
    );
    assert_eq!(line.control("").as_deref(), Ok(""));
    assert_eq!(line.control("small@1 get EEP").as_deref(), Ok("7"));
}
