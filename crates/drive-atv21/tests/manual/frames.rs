//! Every frame that the manual prints with its CRC, byte for byte: what the driver sends and how it reads the answer, and
//! what the simulated drive answers.

use drive_atv21::{Atv21, Authority, CAPABILITIES};
use drive_bus::Line;
use drive_core::{
    Class, Direction, Drive, Error, ExceptionMeaning, Frequency, Percent, Recognised, Registers, State,
};
use drive_sim::{Exception, Model, SimLine, SimSlave, Wiring, models};
use drive_testing::{
    bench,
    frames::{self, OtherEnd, Printed, answered_on},
};
use tokio::io::DuplexStream;

/// §7.9, without CRC.
const IDENTIFIED: Printed<'_> = (
    "01 2B 0E 01 00",
    "01 2B 0E 01 01 00 00 03  00 0D 54656C656D6563616E69717565  01 0C 41545632314830373 54D3358  02 04 30323031",
);
/// §7.4.
const ONE_WORD: Printed<'_> = ("01 03 FD 00 00 01 | B5 A6", "01 03 02 17 70 | B6 50");
const TWO_WORDS: Printed<'_> = ("01 03 FD 00 00 02 | F5 A7", "01 83 03 | 01 31");
/// §7.5.
const BLOCK_OF_FIVE: Printed<'_> =
    ("01 03 18 75 00 05 | 92 B3", "01 03 0A 64 04 17 70 00 00 26 FB 00 80 | 1E 29");
const BLOCK_OF_TWO: Printed<'_> = ("01 03 18 75 00 02 | D3 71", "01 03 04 64 04 17 70 | AA D6");
const READ_START: Printed<'_> = ("01 03 18 76 00 02 | 23 71", "01 83 03 | 01 31");
const READ_QUANTITY: Printed<'_> = ("01 03 18 75 00 06 | D2 B2", "01 83 03 | 01 31");
/// §7.6.
const SIXTY_HERTZ: Printed<'_> = ("01 06 FA01 1770 | E6C6", "01 06 FA01 1770 | E6C6");
const NO_REGISTER: Printed<'_> = ("01 06 FFFF 0000 | 89EE", "01 86 02 | C3A1");
/// §7.7.
const BY_16: Printed<'_> = ("01 10 FA 01 00 01 02 17 70 | F3 9A", "01 10 FA 01 00 01 | 60 D1");
/// §7.8. The CRC of the accepted write's answer is printed 43 B3 and is 46 B3.
const WRITTEN: Printed<'_> = ("01 10 18 70 00 02 04 C4 00 17 70 | 6D AF", "01 10 18 70 00 02 | 46 B3");
const BUSY: Printed<'_> = ("01 10 18 70 00 02 04 C4 00 17 70 | 6D AF", "01 90 04 | 4D C3");
const WRITE_START: Printed<'_> = ("01 10 18 71 00 02 04 C4 00 17 70 | AC63", "01 90 03 | 0C 01");
const WRITE_QUANTITY: Printed<'_> = ("01 10 18 70 00 03 04 C4 00 17 70 | 6C 7E", "01 90 03 | 0C 01");
const WRITE_BYTES: Printed<'_> = ("01 10 18 70 00 02 03 C4 00 17 70 | D8 6F", "01 90 03 | 0C 01");
/// §8.5. Request and answer are printed with the CRC B5 A6, which is that of §7.4; it is E1 12.
const EIGHTY_HERTZ: Printed<'_> = ("01 06 FA 01 1F 40 | E1 12", "01 06 FA 01 1F 40 | E1 12");

const PRINTED: [Printed<'_>; 15] = [
    ONE_WORD,
    TWO_WORDS,
    BLOCK_OF_FIVE,
    BLOCK_OF_TWO,
    READ_START,
    READ_QUANTITY,
    SIXTY_HERTZ,
    NO_REGISTER,
    BY_16,
    WRITTEN,
    BUSY,
    WRITE_START,
    WRITE_QUANTITY,
    WRITE_BYTES,
    EIGHTY_HERTZ,
];

/// A line whose other end is played by the script.
fn scripted(script: &[Printed<'_>]) -> (Line, OtherEnd) {
    frames::scripted(CAPABILITIES.factory, script)
}

fn registers(line: &Line) -> Registers<drive_bus::Slave> {
    Registers::new(line.slave(1), bench::address(1), &CAPABILITIES, |_, _| ExceptionMeaning::Unknown)
}

fn exception(error: Error) -> u8 {
    let Error::Exception { code, .. } = error else { panic!("{error}") };
    code
}

#[tokio::test(start_paused = true)]
async fn every_printed_frame_is_sent_and_read() {
    assert_eq!(frames::with_crc(&PRINTED), 30);
    frames::sent_and_read(&CAPABILITIES, &PRINTED).await;
}

/// A simulated drive at the end of a bare line.
fn simulated(model: models::atv21::Atv21) -> (DuplexStream, SimSlave) {
    let line = SimLine::new(Wiring::rtu(CAPABILITIES.factory));
    let machine = line.add(1, model).unwrap();
    (line.in_memory(), machine)
}

/// One that the bus commands, with the blocks of the manual's examples in effect; they outlive a power cycle.
fn with_blocks() -> models::atv21::Atv21 {
    let mut model = models::atv21::Atv21::new().with_blocks();
    model.poke(0x0003, 2);
    model.poke(0x0004, 4);
    model.power_cycle();
    model.advance(std::time::Duration::from_secs(1));
    model
}

fn at_60_hertz() -> models::atv21::Atv21 {
    let mut model = with_blocks();
    for (address, value) in [(0x0012, 6_000), (0xFA01, 6_000), (0xFA00, 0x0400)] {
        assert!(model.poke(address, value));
    }
    model.advance(std::time::Duration::from_secs(60));
    model
}

#[tokio::test(start_paused = true)]
async fn every_printed_read_is_answered() {
    let mut model = at_60_hertz();
    // The example's motor runs at 60 Hz without a current and with an undercurrent alarm.
    for (address, value) in [(0xFC91, 0x0080), (0xFE03, 0), (0xFE05, 9_979)] {
        assert!(model.poke(address, value));
    }
    let (mut master, _machine) = simulated(model);
    for exchange in [ONE_WORD, TWO_WORDS, BLOCK_OF_FIVE, BLOCK_OF_TWO, READ_START, READ_QUANTITY] {
        answered_on(&mut master, exchange).await;
    }
}

#[tokio::test(start_paused = true)]
async fn every_printed_write_is_answered_and_carried_out() {
    let (mut master, machine) = simulated(with_blocks());
    for exchange in [SIXTY_HERTZ, NO_REGISTER, BY_16] {
        answered_on(&mut master, exchange).await;
    }
    assert_eq!(machine.peek(0xFA01), Some(6_000));
    answered_on(&mut master, EIGHTY_HERTZ).await;
    assert_eq!(machine.peek(0xFA01), Some(8_000));
    answered_on(&mut master, WRITTEN).await;
    assert_eq!((machine.peek(0xFA00), machine.peek(0xFA01)), (Some(0xC400), Some(6_000)));
    machine.refuse_next(Exception::FAILURE);
    for exchange in [BUSY, WRITE_START, WRITE_QUANTITY, WRITE_BYTES] {
        answered_on(&mut master, exchange).await;
    }
    // F870 = 0.
    let (mut master, _machine) = simulated(models::atv21::Atv21::new());
    answered_on(&mut master, BUSY).await;
}

/// CMOD = 2 and FMOD = 4: serial communication (§6.2 p. 12).
const BUS_HAS_COMMAND: (&str, &str) = ("01 03 0003 0001", "01 03 02 0002");
const BUS_HAS_REFERENCE: (&str, &str) = ("01 03 0004 0001", "01 03 02 0004");

#[tokio::test(start_paused = true)]
async fn a_status_without_a_block_reads_the_output_frequency_as_in_7_4() {
    let (line, other_end) = scripted(&[
        ("01 03 FD01 0001", "01 03 02 6400"),
        ONE_WORD,
        ("01 03 FE03 0001", "01 03 02 1388"),
        ("01 03 FE45 0001", "01 03 02 0002"),
        // What the next stop keeps of it.
        ("01 03 FA00 0001", "01 03 02 C400"),
        // Whether it has to claim command and reference by FA00: not where CMOD and FMOD give them to the bus.
        BUS_HAS_COMMAND,
        BUS_HAS_REFERENCE,
    ]);
    let status = Atv21::new(line.slave(1), bench::address(1)).status().await.unwrap();
    assert_eq!(status.output_frequency, Some(Frequency::from_hertz(60)));
    assert_eq!(status.current_share, Some(Percent::from_percent(50)));
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn two_words_beside_the_block_are_refused_as_in_7_4() {
    let (line, other_end) = scripted(&[TWO_WORDS]);
    let error = registers(&line).at(Class::Status).read_words(0xFD00, 2).await.unwrap_err();
    assert_eq!(exception(error), 3);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_block_of_five_of_7_5_is_looked_at_and_not_used_because_its_current_of_0_shows_nothing() {
    const STATUS: [(&str, &str); 4] = [
        ("01 03 FD01 0001", "01 03 02 6404"),
        ONE_WORD,
        ("01 03 FE03 0001", "01 03 02 0000"),
        ("01 03 FE45 0001", "01 03 02 0002"),
    ];
    let slow_set = [
        ("01 03 FE02 0001", "01 03 02 1770"),
        ("01 03 FE90 0001", "01 03 02 0708"),
        ("01 03 FE05 0001", "01 03 02 26FC"),
        ("01 03 FE04 0001", "01 03 02 2710"),
        ("01 03 FE18 0001", "01 03 02 0000"),
        ("01 03 FE29 0001", "01 03 02 0000"),
        ("01 03 FE30 0001", "01 03 02 0000"),
        ("01 03 FE26 0001", "01 03 02 0000"),
        ("01 03 FE27 0001", "01 03 02 0000"),
        ("01 03 FE76 0001", "01 03 02 0000"),
        ("01 03 FE77 0001", "01 03 02 0000"),
        ("01 03 FE14 0001", "01 03 02 0000"),
        ("01 03 FE80 0001", "01 03 02 0000"),
        ("01 03 FD06 0001", "01 03 02 0000"),
        ("01 03 FD07 0001", "01 03 02 0000"),
        ("01 03 FD01 0001", "01 03 02 6404"),
    ];
    let slots = [
        ("01 03 0875 0001", "01 03 02 0001"),
        ("01 03 0876 0001", "01 03 02 0002"),
        ("01 03 0877 0001", "01 03 02 0003"),
        ("01 03 0878 0001", "01 03 02 0004"),
        ("01 03 0879 0001", "01 03 02 0005"),
    ];
    let held = [
        ("01 03 FD01 0001", "01 03 02 6404"),
        ONE_WORD,
        ("01 03 FE03 0001", "01 03 02 0000"),
        ("01 03 FE05 0001", "01 03 02 26FC"),
        ("01 03 FC91 0001", "01 03 02 0080"),
        ("01 03 FE22 0001", "01 03 02 0000"),
        ("01 03 FD06 0001", "01 03 02 0000"),
        ("01 03 FD07 0001", "01 03 02 0000"),
        ("01 03 FE35 0001", "01 03 02 03FF"),
        ("01 03 FE36 0001", "01 03 02 0000"),
        ("01 03 FE90 0001", "01 03 02 0708"),
    ];
    let held_for_the_stop = ("01 03 FA00 0001", "01 03 02 C400");
    let script: Vec<_> = slow_set
        .into_iter()
        .chain(slots)
        .chain(STATUS)
        .chain([BLOCK_OF_FIVE])
        .chain(held)
        .chain(STATUS)
        .chain([held_for_the_stop, BUS_HAS_COMMAND, BUS_HAS_REFERENCE])
        .collect();
    let (line, other_end) = scripted(&script);
    let mut drive = Atv21::new(line.slave(1), bench::address(1));
    drive.measurements().await.unwrap();
    let status = drive.status().await.unwrap();
    assert_eq!((status.state, status.direction), (State::Running, Some(Direction::Forward)));
    assert_eq!(status.output_frequency, Some(Frequency::from_hertz(60)));
    assert_eq!((status.current_share, status.warning), (Some(Percent::from_percent(0)), Some(true)));
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn a_block_of_two_is_read_and_refused_as_in_7_5() {
    let (line, other_end) = scripted(&[BLOCK_OF_TWO, READ_START]);
    let mut registers = registers(&line);
    let mut calls = registers.at(Class::Status);
    assert_eq!(calls.read_words(0x1875, 2).await.unwrap(), [0x6404, 0x1770]);
    assert_eq!(exception(calls.read_words(0x1876, 2).await.unwrap_err()), 3);
    // "Quantité des registres incorrecte": six words are refused here, before they are sent (01 03 18 75 00 06 D2 B2).
    let error = calls.read_words(0x1875, 6).await.unwrap_err();
    assert!(matches!(error, Error::TooManyWords { words: 6, limit: 5, .. }), "{error}");
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_of_60_hertz_is_the_write_of_7_6_and_one_of_80_that_of_8_5() {
    let set = |first: bool, write, word| {
        let mut script = vec![("01 03 FE46 0001", "01 03 02 0004"), ("01 03 FA13 0001", "01 03 02 0000")];
        if first {
            script.push(("01 03 FA01 0001", "01 03 02 0000"));
        }
        script.extend([write, ("01 03 FA01 0001", word)]);
        if !first {
            // 0012h has just said the same: it is asked twice, and so is FE02 behind it.
            script.push(("01 03 FA01 0001", word));
        }
        script.push(("01 03 FE46 0001", "01 03 02 0004"));
        script.push(("01 03 FE02 0001", word));
        if !first {
            script.push(("01 03 FE02 0001", word));
        }
        script
    };
    let script = [
        vec![IDENTIFIED, ("01 03 0012 0001", "01 03 02 1F40")],
        set(true, SIXTY_HERTZ, "01 03 02 1770"),
        set(false, EIGHTY_HERTZ, "01 03 02 1F40"),
        vec![NO_REGISTER],
    ];
    let (line, other_end) = scripted(&script.concat());
    let mut drive = Atv21::new(line.slave(1), bench::address(1));
    drive.set_setpoint(Frequency::from_hertz(60).into()).await.unwrap();
    drive.set_setpoint(Frequency::from_hertz(80).into()).await.unwrap();
    let error = registers(&line).at(Class::Command).write_word(0xFFFF, 0).await.unwrap_err();
    assert_eq!(exception(error), 2);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn function_16_writes_one_word_as_in_7_7() {
    let (line, other_end) = scripted(&[BY_16]);
    registers(&line).at(Class::Command).write_words(0xFA01, &[6_000]).await.unwrap();
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_block_is_written_and_refused_as_in_7_8() {
    let (line, other_end) = scripted(&[WRITTEN, BUSY, WRITE_START]);
    let mut registers = registers(&line);
    let mut calls = registers.at(Class::Command);
    calls.write_words(0x1870, &[0xC400, 0x1770]).await.unwrap();
    assert_eq!(exception(calls.write_words(0x1870, &[0xC400, 0x1770]).await.unwrap_err()), 4);
    assert_eq!(exception(calls.write_words(0x1871, &[0xC400, 0x1770]).await.unwrap_err()), 3);
    // Three words are refused here, before they are sent; a byte count that is not twice the quantity cannot be asked for.
    let error = calls.write_words(0x1870, &[0xC400, 0x1770, 0]).await.unwrap_err();
    assert!(matches!(error, Error::TooManyWords { words: 3, limit: 2, .. }), "{error}");
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn identification_is_asked_and_read_as_in_7_9() {
    let (line, other_end) = scripted(&[
        IDENTIFIED,
        ("01 03 FB05 0001", "01 03 02 0004"),
        ("01 03 FB72 0001", "01 03 02 0000"),
        // A drive without FB05 and FB72 is the one that 43/14 names all the same.
        IDENTIFIED,
        ("01 03 FB05 0001", "01 83 02"),
        ("01 03 FB72 0001", "01 83 02"),
    ]);
    let mut drive = Atv21::new(line.slave(1), bench::address(1));
    let identity = drive.identify().await.unwrap();
    assert_eq!(identity.vendor.as_deref(), Some("Telemecanique"));
    assert_eq!(identity.model.as_deref(), Some("ATV21H075M3X"));
    assert_eq!(identity.version.as_deref(), Some("0201"));
    assert_eq!(identity.codes.iter().map(|code| code.value).collect::<Vec<_>>(), [4, 0]);
    let named = drive.identify().await.unwrap();
    assert_eq!((&named.model, named.codes.len()), (&identity.model, 0));
    assert_eq!(drive.recognise(&named), Recognised::Mine);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn command_words_are_those_of_8_4_with_and_without_the_priorities() {
    for (authority, mode, direction, word) in [
        (Authority::Settings, "0002", Direction::Forward, "0400"),
        (Authority::Settings, "0002", Direction::Reverse, "0600"),
        (Authority::Priority, "0000", Direction::Forward, "C400"),
        (Authority::Priority, "0000", Direction::Reverse, "C600"),
    ] {
        let source = format!("01 03 02 {mode}");
        let write = format!("01 06 FA00 {word}");
        let held = format!("01 03 02 {word}");
        let running =
            format!("01 03 02 {:04X}", if direction == Direction::Forward { 0x6400 } else { 0x6600 });
        let mut script: Vec<(&str, &str)> = vec![
            IDENTIFIED,
            ("01 03 FD01 0001", "01 03 02 4000"),
            ("01 03 FE45 0001", &source),
            ("01 03 FA00 0001", "01 03 02 0000"),
        ];
        // The priorities first, so that FE45 and FE46 tell who decides before anything runs.
        if authority == Authority::Priority {
            script.extend([("01 03 0003 0001", "01 03 02 0000"), ("01 03 0004 0001", "01 03 02 0001")]);
            script.push(("01 06 FA00 C000", "01 06 FA00 C000"));
            script.extend([("01 03 FD01 0001", "01 03 02 4000"), ("01 03 FE45 0001", "01 03 02 0002")]);
        }
        script.extend([
            ("01 03 FE46 0001", "01 03 02 0004"),
            (&write, &write),
            // UL, up to which it turns.
            ("01 03 0012 0001", "01 03 02 1388"),
            ("01 03 FD01 0001", &running),
            ("01 03 FD00 0001", "01 03 02 0000"),
            ("01 03 FE03 0001", "01 03 02 0000"),
            ("01 03 FE45 0001", "01 03 02 0002"),
            ("01 03 FE46 0001", "01 03 02 0004"),
            ("01 03 FE02 0001", "01 03 02 1770"),
            ("01 03 FA01 0001", "01 03 02 1770"),
            // Others of these words have said the same as each other: what is new behind them is asked twice.
            ("01 03 FA00 0001", &held),
            ("01 03 FA00 0001", &held),
        ]);
        let (line, other_end) = scripted(&script);
        let mut drive = Atv21::new(line.slave(1), bench::address(1)).with_authority(authority);
        let started = drive.start(direction).await.unwrap();
        assert_eq!(
            (started.direction, started.reference),
            (Some(direction), Some(Frequency::from_hertz(50)))
        );
        other_end.is_done().await;
    }
}
