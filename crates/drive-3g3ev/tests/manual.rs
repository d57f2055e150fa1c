//! The manual a second time, from its text and not from the driver: "3G3EV MODBUS" (Omron, French). And its frames,
//! byte for byte, as they cross the wire between the driver and the simulated drive.

mod rig;

use std::time::Duration;

use drive_3g3ev::{
    CAPABILITIES, Drive3g3ev, FAULTS, ROWS, WARNINGS, broadcast, registers, turnaround, words,
};
use drive_core::{
    Class, Direction, Drive, Error, ExceptionMeaning, Frequency, Percent, Port, Registers, Row, StopMode,
    registers::{Access, Storage},
    serial::CharacterFormat,
};
use drive_sim::models::drive_3g3ev::Drive3g3ev as Model;
use drive_testing::{
    bench::{self, address},
    frames::{self, Printed},
    words::Words,
};
use rig::Rig;
use tokio_modbus::{Request, client::Client};

fn row(address: u16) -> &'static Row {
    ROWS.iter().find(|row| row.address == address).unwrap_or_else(|| panic!("no row {address:04X}h"))
}

/// §5.1 and §5.2: address, access, and whether it is a word of bits.
const MAP: &[(u16, &str, bool)] = &[
    (0x0001, "R/W", true),
    (0x0002, "R/W", false),
    (0x0003, "R/W", false),
    (0x0009, "R/W", true),
    (0x0900, "W", false),
    (0x0020, "R", true),
    (0x0021, "R", true),
    (0x0022, "R", true),
    (0x0023, "R", false),
    (0x0024, "R", false),
    (0x0027, "R", false),
    (0x0028, "R", false),
    (0x002B, "R", true),
    (0x002C, "R", true),
    (0x002D, "R", true),
    (0x0031, "R", false),
    (0x003D, "R", true),
];

#[test]
fn every_register_of_sections_5_1_and_5_2_is_a_row_and_nothing_else_below_the_parameters() {
    for &(address, access, bits) in MAP {
        let row = row(address);
        assert_eq!(row.access.to_string(), access, "{}", row.code);
        assert_eq!(row.unit == drive_core::registers::Unit::BITS, bits, "{}", row.code);
        assert_eq!(row.storage, Storage::Volatile, "{}", row.code);
        assert_eq!(row.code, format!("{address:04X}h"));
    }
    let others = ROWS.iter().filter(|row| !(0x0101..=0x0144).contains(&row.address));
    assert_eq!(others.count(), MAP.len());
}

#[test]
fn parameter_n_is_at_256_and_its_number_and_can_be_read_and_written() {
    for number in 1..=68_u8 {
        let row = registers::parameter(number).unwrap();
        assert_eq!(row.address, 256 + u16::from(number));
        assert_eq!(row.code, format!("n{number:02}"));
        assert!(row.access.is_readable() && row.access.is_writable());
        assert_eq!(row.storage, Storage::RamUntilSaved);
    }
    assert_eq!((registers::parameter(0), registers::parameter(69)), (None, None));
    // §5.4: n20 is 114h. §6 changes it while the motors run.
    assert_eq!((row(0x0114).code, row(0x0114).access), ("n20", Access::ReadWrite));
}

#[test]
fn parameters_that_the_manual_does_not_name_are_raw() {
    // §2.1, §5.1 to §5.4.
    let named =
        [2, 5, 6, 7, 8, 9, 10, 20, 24, 26, 27, 29, 31, 39, 40, 41, 42, 53, 56, 57, 58, 63, 64, 65, 66, 67];
    for number in 1..=68 {
        let row = registers::parameter(number).unwrap();
        assert_eq!(row.name.starts_with("raw word"), !named.contains(&number), "{}", row.code);
        if !named.contains(&number) {
            assert_eq!((row.show(1_234).as_str(), row.range.allows(0xFFFF)), ("1234", true));
        }
    }
}

#[test]
fn the_table_of_section_2_1() {
    // Parameter, lowest, highest, factory setting.
    let table = [(2, 0, 5, 5), (39, 0, 3, 0), (40, 0, 1, 0), (63, 0, 3, 2), (64, 0, 2, 0), (65, 5, 40, 5)];
    let table = table.into_iter().chain([(66, 0, 1, 0), (67, 1, 31, 0)]);
    for (number, low, high, factory) in table {
        let row = registers::parameter(number).unwrap();
        let allowed: Vec<i32> = (-1..100).filter(|&value| row.range.allows(value)).collect();
        assert_eq!(allowed, (low..=high).collect::<Vec<_>>(), "{}", row.code);
        assert_eq!(row.factory, drive_core::registers::Factory::Value(factory), "{}", row.code);
    }
    let show = |number, word| registers::parameter(number).unwrap().show(word);
    let sources = ["panel/panel", "terminals/panel", "bus/panel", "panel/panel", "terminals/bus", "bus/bus"];
    for (word, source) in (0..).zip(sources) {
        assert!(show(2, word).starts_with(&format!("{word} {source} ")), "n02 = {word}");
    }
    let n39 = [0, 1, 2, 3].map(|word| show(39, word));
    for (text, unit) in n39.iter().zip(["0.1 Hz", "0.01 Hz", "30000 = 100 %", "0.1 %"]) {
        assert!(text.contains(unit), "{text}");
    }
    let n63 = [0, 1, 2, 3].map(|word| show(63, word));
    for (text, baud) in n63.iter().zip(["2400", "4800", "9600", "19200"]) {
        assert!(text.contains(baud), "{text}");
    }
    assert!(show(64, 0).contains("even") && show(64, 1).contains("odd") && show(64, 2).contains("none"));
    assert!(show(40, 0).contains("(detection)") && show(40, 1).contains("no detection"));
}

#[test]
fn units_of_sections_5_1_5_2_and_5_4() {
    assert_eq!(row(0x0027).show(42), "4.2 A");
    assert_eq!(row(0x0028).show(230), "230 V");
    assert_eq!(row(0x0031).show(325), "325 V");
    assert_eq!(row(0x0003).show(1_000), "100.0 %");
    assert!(!row(0x0003).range.allows(19) && row(0x0003).range.allows(20));
    assert!(row(0x0003).range.allows(2_000) && !row(0x0003).range.allows(2_001));
    assert_eq!(row(0x0114).show(3), "0.3 s");
    assert_eq!(row(0x0114).read("5"), Some(0x32));
    assert_eq!(row(0x0109).show(15), "15 bus (commanded by 0009h)");
}

#[test]
fn section_1_and_3_1_functions_limits_addresses_and_characters() {
    assert_eq!(CAPABILITIES.functions, [0x03, 0x08, 0x10]);
    assert_eq!((CAPABILITIES.read_words, CAPABILITIES.write_words), (8, 8));
    assert_eq!(CAPABILITIES.speeds, [2_400, 4_800, 9_600, 19_200]);
    let formats = [CharacterFormat::F8E1, CharacterFormat::F8O1, CharacterFormat::F8N1];
    assert_eq!(CAPABILITIES.formats, formats);
    assert_eq!((CAPABILITIES.factory.baud(), CAPABILITIES.factory.format()), (9_600, CharacterFormat::F8E1));
    assert!(CAPABILITIES.check_line(address(31), CAPABILITIES.factory).is_ok());
    assert!(CAPABILITIES.check_line(address(32), CAPABILITIES.factory).is_err());
    // 24 bits and 10 ms: VS-606V7 manual p. 92.
    assert_eq!(turnaround(2_400), Duration::from_millis(20));
    assert_eq!(turnaround(19_200), Duration::from_micros(11_250));
}

#[test]
fn the_bits_of_section_5_1() {
    use words::{BroadcastCommand, Command, Outputs};
    assert_eq!((Command::RUN.bits(), Command::REVERSE.bits()), (1, 2));
    let inputs = [Command::INPUT_1, Command::INPUT_2, Command::INPUT_3].map(|input| input.bits());
    assert_eq!(inputs, [0x10, 0x20, 0x40]);
    assert_eq!((BroadcastCommand::RUN.bits(), BroadcastCommand::REVERSE.bits()), (1, 2));
    assert_eq!(BroadcastCommand::EXTERNAL_FAULT.bits(), 0x10);
    assert_eq!(BroadcastCommand::FAULT_RESET.bits(), 0x20);
    assert_eq!((Outputs::OUTPUT_1.bits(), Outputs::OUTPUT_2.bits()), (1, 2));
}

#[test]
fn the_bits_of_section_5_2() {
    use words::{DriveState as State, LinkError, LinkState, Signals};
    let signals = [
        Signals::RUN,
        Signals::REVERSE,
        Signals::READY,
        Signals::FAULT,
        Signals::DATA_ERROR,
        Signals::OUTPUT_1,
        Signals::OUTPUT_2,
    ];
    for (bit, flag) in signals.into_iter().enumerate() {
        assert_eq!(flag.bits(), 1 << bit, "0020h");
    }
    assert_eq!(Signals::all().bits(), 0x007F);
    let link = [(0, LinkState::WRITING), (3, LinkState::LIMIT_EXCEEDED), (4, LinkState::VERIFY_ERROR)];
    for (bit, flag) in link {
        assert_eq!(flag.bits(), 1 << bit, "0022h");
    }
    let state = [
        (0x0, State::RUN),
        (0x1, State::ZERO_SPEED),
        (0x2, State::AT_REFERENCE),
        (0x3, State::FREQUENCY_OK),
        (0x4, State::BELOW_N53),
        (0x5, State::ABOVE_N53),
        (0x6, State::READY),
        (0x7, State::UNDERVOLTAGE),
        (0x8, State::OUTPUT_OFF),
        (0x9, State::LOCAL_REFERENCE),
        (0xA, State::LOCAL_RUN),
        (0xB, State::OVERTORQUE),
        (0xC, State::REFERENCE_ERROR),
        (0xE, State::MAJOR_FAULT),
        (0xF, State::LINK_FAULT),
    ];
    for (bit, flag) in state {
        assert_eq!(flag.bits(), 1 << bit, "002Ch");
    }
    assert_eq!(State::all().bits(), 0xDFFF);
    let errors = [
        (0, LinkError::CRC),
        (1, LinkError::LENGTH),
        (3, LinkError::PARITY),
        (4, LinkError::OVERRUN),
        (5, LinkError::FRAMING),
        (6, LinkError::TIME_OVER),
    ];
    for (bit, flag) in errors {
        assert_eq!(flag.bits(), 1 << bit, "003Dh");
    }
    assert_eq!(LinkError::all().bits(), 0x007B);
}

#[test]
fn the_faults_of_0021h_and_the_alarms_beside_them() {
    let printed = [
        (0x0, "OC"),
        (0x1, "OV"),
        (0x2, "OL2"),
        (0x3, "OH"),
        (0x7, "EFx"),
        (0x8, "CPFxx"),
        (0x9, "OL1"),
        (0xA, "OL3"),
        (0xC, "UV1"),
        (0xD, "UV2"),
        (0xE, "BUS"),
    ];
    assert_eq!(FAULTS.iter().map(|fault| (fault.code, fault.mnemonic)).collect::<Vec<_>>(), printed);
    let named = printed.iter().fold(0, |word, (bit, _)| word | 1 << bit);
    assert_eq!(words::Errors::all().bits(), named);
    let alarms: Vec<u16> = WARNINGS.iter().map(|alarm| alarm.code).collect();
    let of_3d = [0x3D0, 0x3D1, 0x3D3, 0x3D4, 0x3D5, 0x3D6];
    let others = [0x204, 0x223, 0x224, 0x2C7, 0x2CB, 0x2CC, 0x2CF];
    assert_eq!(alarms, [&others[..], &of_3d[..]].concat());
    assert!(FAULTS.iter().chain(WARNINGS).all(|entry| entry.remedy.len() > 10));
}

/// §4.1.2.
const LOOP_BACK: Printed<'_> = ("01 08 0000 A537 | DA8D", "01 08 0000 A537 | DA8D");
/// §4.2.2. Of what is refused only the answer is printed.
const READ_FOUR: Printed<'_> = ("02 03 0020 0004 | 45F0", "02 03 08 0085 0000 0000 01F4 | 4E4C");
const TOO_MANY: Printed<'_> = ("02 03 0020 0009", "02 83 03 | F131");
/// §4.3.2. The answer's start register is printed 0120h; its CRC is that of 0001h.
const WRITE_TWO: Printed<'_> = ("01 10 0001 0002 04 0001 0258 | 6339", "01 10 0001 0002 | 1008");
const NO_REGISTER: Printed<'_> = ("01 10 0220 0001 02 0000", "01 90 02 | CDC1");
/// §4.5. The answer is not printed.
const ENTER: Printed<'_> = ("01 10 0900 0001 02 0000 | 3F50", "01 10 0900 0001");
/// §6.
const SIXTY_HERTZ_1: Printed<'_> = ("0110 0002 0001 02 0258 | A728", "0110 0002 0001 | A009");
const SIXTY_HERTZ_2: Printed<'_> = ("0210 0002 0001 02 0258 | B3D8", "0210 0002 0001 | A03A");
const RUN: Printed<'_> = ("0010 0001 0001 02 0001 | 6BD1", "");
const OUTPUT_1: Printed<'_> = ("0103 0024 0001 | C401", "0103 02 0258 | B8DE");
const OUTPUT_2: Printed<'_> = ("0203 0024 0001 | C432", "0203 02 0258 | FCDE");
const STATE_2: Printed<'_> = ("0203 002C 0001 | 45F0", "0203 02 0065 | 3C6F");
const ACCELERATION_1: Printed<'_> = ("0110 0114 0001 02 0014 | B58B", "0110 0114 0001 | 4031");

#[tokio::test(start_paused = true)]
async fn every_printed_frame_is_sent_and_read() {
    let printed = [
        LOOP_BACK,
        READ_FOUR,
        TOO_MANY,
        WRITE_TWO,
        NO_REGISTER,
        ENTER,
        SIXTY_HERTZ_1,
        SIXTY_HERTZ_2,
        RUN,
        OUTPUT_1,
        OUTPUT_2,
        STATE_2,
        ACCELERATION_1,
    ];
    assert_eq!(frames::with_crc(&printed), 22);
    frames::sent_and_read(&CAPABILITIES, &printed).await;
}

/// The bytes of an exchange. In the tests below they cross the wire between the driver and the simulated drive.
fn bytes((request, answer): Printed<'_>) -> [Vec<u8>; 2] {
    [request, answer].map(frames::frame)
}

/// Two drives, as in §2.2, running at 60 Hz or not.
fn two() -> Rig {
    Rig::new([Model::new(), Model::new()])
}

fn registers<P: Port>(port: P, number: u8) -> Registers<P> {
    Registers::new(port, address(number), &CAPABILITIES, |_, _| ExceptionMeaning::Unknown)
}

#[tokio::test(start_paused = true)]
async fn section_4_1_2_the_loop_back_is_the_keep_alive() {
    let rig = two();
    rig.drive(1).keep_alive().await.unwrap();
    assert_eq!(rig.frames.take(), bytes(LOOP_BACK));
}

#[tokio::test(start_paused = true)]
async fn section_4_2_2_four_registers_are_read() {
    let rig = two();
    // 0085h: running, ready, and bit 7; 01F4h: 50 Hz.
    for (register, value) in [(0x0002, 500), (0x0001, 1)] {
        rig.machines[1].poke(register, value);
    }
    let words = registers(rig.line.slave(2), 2).at(Class::Status).read_words(0x20, 4).await.unwrap();
    assert_eq!(words, [0x85, 0, 0, 0x01F4]);
    assert_eq!(rig.frames.take(), bytes(READ_FOUR));
}

#[tokio::test(start_paused = true)]
async fn section_4_2_2_too_many_registers_are_exception_03() {
    let rig = two();
    // Nine registers: past the limit that the driver keeps, so straight to the line.
    let answer = rig.line.slave(2).call(Request::ReadHoldingRegisters(0x20, 9)).await.unwrap();
    assert_eq!(u8::from(answer.unwrap_err()), 3);
    assert_eq!(rig.frames.take(), bytes(TOO_MANY));
}

#[tokio::test(start_paused = true)]
async fn section_4_3_2_two_registers_are_written() {
    let rig = two();
    registers(rig.line.slave(1), 1).at(Class::Command).write_words(1, &[1, 0x0258]).await.unwrap();
    assert_eq!(rig.frames.take(), bytes(WRITE_TWO));
    assert_eq!(rig.machines[0].peek(2), Some(600));
}

#[tokio::test(start_paused = true)]
async fn section_4_3_2_an_unknown_register_is_exception_02() {
    let rig = two();
    let mut registers = registers(rig.line.slave(1), 1);
    let error = registers.at(Class::Background).write_word(0x0120 + 0x100, 0).await.unwrap_err();
    assert!(matches!(error, Error::Exception { code: 2, .. }), "{error}");
    assert_eq!(rig.frames.take(), bytes(NO_REGISTER));
}

#[tokio::test(start_paused = true)]
async fn section_4_5_enter_is_the_save() {
    let rig = two();
    let mut drive = rig.drive(1);
    drive.write_parameter(row(0x0114), 50).await.unwrap();
    rig.frames.take();
    assert_eq!(drive.persist().await, Ok(1));
    // The motor stands, and under no run command; then it is written.
    assert!(rig.frames.take().ends_with(&bytes(ENTER)));
}

#[tokio::test(start_paused = true)]
async fn section_5_4_the_acceleration_time_is_read_and_changed() {
    let rig = two();
    rig.machines[0].poke(0x0114, 3);
    let mut drive = rig.drive(1);
    assert_eq!(drive.read_parameter(row(0x0114)).await, Ok(3));
    let read = bytes(("0103 0114 0001", "0103 02 0003"));
    assert_eq!(rig.frames.take(), read);
    drive.write_parameter(row(0x0114), row(0x0114).read("5").unwrap()).await.unwrap();
    let written = bytes(("0110 0114 0001 02 0032", "0110 0114 0001"));
    let sent = rig.frames.take();
    assert_eq!((&sent[..2], &sent[2..4]), (&read[..], &written[..]), "read first, then written");
    assert_eq!(rig.machines[0].peek(0x0114), Some(50));
}

#[tokio::test(start_paused = true)]
async fn section_6_two_drives_at_60_hz() {
    let rig = two();
    let (mut first, mut second) = (rig.drive(1), rig.drive(2));
    for drive in [&mut first, &mut second] {
        drive.status().await.unwrap();
        drive.set_setpoint(Frequency::from_hertz(60).into()).await.unwrap();
    }
    let sent = rig.frames.take();
    for exchange in [SIXTY_HERTZ_1, SIXTY_HERTZ_2] {
        let pair = bytes(exchange);
        assert!(sent.windows(2).any(|frames| frames == pair), "{exchange:?} in {sent:02X?}");
    }
    bench::broadcast(&rig.line, broadcast::run(Direction::Forward)).await;
    assert_eq!(rig.frames.take(), bytes(RUN)[..1]);
    // The drives trip when nothing is said for 2 s.
    while rig.machines.iter().any(|machine| machine.observe().output_frequency != 6_000) {
        first.keep_alive().await.unwrap();
        second.keep_alive().await.unwrap();
    }
    rig.frames.take();
    for (number, exchange) in [(1, OUTPUT_1), (2, OUTPUT_2)] {
        let mut registers = registers(rig.line.slave(number), number);
        assert_eq!(registers.at(Class::Status).read(registers::OUTPUT_FREQUENCY).await, Ok(600));
        assert_eq!(rig.frames.take(), bytes(exchange));
    }
    second.status().await.unwrap();
    // 0065h: running, at the reference, above n53, ready.
    assert_eq!(rig.frames.take()[2..4], bytes(STATE_2));
    first.write_parameter(row(0x0114), 0x14).await.unwrap();
    let sent = rig.frames.take();
    assert_eq!(sent[2..4], bytes(ACCELERATION_1));
    assert_eq!(rig.sim.violations(), []);
}

#[tokio::test(start_paused = true)]
async fn each_error_of_section_4_4_has_its_meaning() {
    let meanings = [
        (0x01, ExceptionMeaning::NoSuchFunction),
        (0x02, ExceptionMeaning::NoSuchRegister),
        (0x03, ExceptionMeaning::ValueRefused),
        (0x21, ExceptionMeaning::ValueRefused),
        (0x22, ExceptionMeaning::NotNow),
        (0x04, ExceptionMeaning::Unknown),
    ];
    for (code, expected) in meanings {
        let mut words = rig::ready();
        words.refused.insert(0x0114, code);
        let error = rig::drive(words).read_parameter(row(0x0114)).await.unwrap_err();
        let Error::Exception { meaning, .. } = error else { panic!("{error}") };
        assert_eq!((meaning, meaning.is_worth_a_retry()), (expected, false), "{code:02X}h");
    }
}

#[test]
fn broadcasts_have_the_bits_and_the_unit_of_section_5_1() {
    let values = |writes: [drive_core::BroadcastWrite; 2]| writes.map(|write| (write.register, write.value));
    assert_eq!(values(broadcast::external_fault()), [(1, 0x10), (1, 0)]);
    assert_eq!(values(broadcast::fault_reset()), [(1, 0x20), (1, 0)]);
    assert_eq!((broadcast::stop().register, broadcast::stop().value), (1, 0));
    assert_eq!(broadcast::run(Direction::Forward).value, 1);
    assert_eq!(broadcast::run(Direction::Reverse).value, 3);
    let reference = |hundredths| broadcast::reference(Percent::from_hundredths(hundredths));
    assert_eq!(reference(10_000).map(|write| (write.register, write.value)), Some((2, 30_000)));
    assert_eq!(reference(1).map(|write| write.value), Some(3));
    assert_eq!((reference(-1), reference(21_846), reference(i32::MAX)), (None, None, None));
    let drive: Drive3g3ev<Words> = rig::drive(rig::ready());
    assert_eq!(drive.broadcast_stop(StopMode::Ramp), Some(broadcast::stop()));
    assert_eq!(drive.broadcast_stop(StopMode::Freewheel), None);
}
