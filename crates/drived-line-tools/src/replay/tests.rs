//! A simulated session is captured and played back: the same program reads the same.

use std::{
    io,
    sync::{Arc, Mutex},
};

use drive_bus::{Line, LineConfig, capture::Writer};
use drive_core::{Measurements, PortError, SlaveAddress, Status};
use drive_families::{Family, SetUp, simulated};

use super::*;
use crate::sim;

#[derive(Clone, Default)]
struct Sink(Arc<Mutex<Vec<u8>>>);

impl io::Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

const RTU: SerialSettings = SerialSettings::MODBUS_DEFAULT;

fn config(protocol: &str, settings: SerialSettings) -> LineConfig {
    LineConfig { protocol: protocol.parse().unwrap(), offline_after: 0, ..LineConfig::stream(settings) }
}

/// What the program sees: identity, status and measurements while the drive starts and stops, and a parameter it lacks.
async fn program(line: &Line, family: Family) -> Vec<String> {
    let slave = SlaveAddress::try_from(3).unwrap();
    let mut drive = family.open_with(line.slave(3), slave, &simulated::options());
    let mut seen = vec![format!("{:?}", drive.identify().await)];
    for _ in 0..5 {
        let Status { state, output_frequency, .. } = drive.status().await.unwrap();
        seen.push(format!("{state:?} {output_frequency:?}"));
        tokio::time::sleep(std::time::Duration::from_millis(400)).await;
    }
    let measured = drive.measurements().await.map(|measured| Measurements { at: None, ..measured });
    seen.push(format!("{measured:?}"));
    seen.push(format!("{:?}", drive.faults().await));
    seen
}

async fn captured(family: Family, protocol: &str, settings: SerialSettings) -> (Vec<String>, Recording) {
    let wiring = Wiring { protocol: sim::by(protocol.parse().unwrap()), ..Wiring::rtu(settings) };
    let simulated = SimLine::new(wiring);
    let machine = simulated.add_boxed(3, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
    let line = Line::over(simulated.in_memory(), config(protocol, settings));
    let sink = Sink::default();
    let writing = line.capture(sink.clone()).unwrap();
    // In the middle of what the program looks at.
    let trip = async {
        tokio::time::sleep(std::time::Duration::from_secs(1)).await;
        machine.trip(family.simulated_trip().unwrap());
    };
    let (seen, ()) = tokio::join!(program(&line, family), trip);
    assert!(seen.iter().any(|seen| seen.starts_with("Fault")) && !seen[1].starts_with("Fault"), "{seen:?}");
    line.close().await;
    drop(line);
    writing.finished().await.unwrap();
    let recording = drive_bus::capture::read(&sink.0.lock().unwrap()).unwrap();
    (seen, recording)
}

fn played_back(
    recording: &Recording,
    settings: SerialSettings,
) -> (SimLine, mpsc::UnboundedReceiver<NotRecorded>) {
    let (unknown, asked) = mpsc::unbounded_channel();
    let found = exchanges(recording, settings);
    (line(spoken(recording).unwrap(), settings, &found, false, unknown).unwrap(), asked)
}

#[tokio::test(start_paused = true)]
async fn a_program_reads_from_a_replay_what_it_read_from_the_drives_of_every_family() {
    for family in Family::BUILT_IN {
        let settings = family.capabilities().factory;
        let (seen, recording) = captured(family, "rtu", settings).await;
        let (simulated, mut asked) = played_back(&recording, settings);
        let line = Line::over(simulated.in_memory(), config("rtu", settings));
        assert_eq!(program(&line, family).await, seen, "{family}");
        assert!(asked.try_recv().is_err(), "{family}: {:?}", asked.try_recv());
    }
}

#[tokio::test(start_paused = true)]
async fn ascii_and_unitelway_are_played_back_too() {
    for (protocol, format) in [("ascii", "7E1"), ("unitelway", "8O1")] {
        let settings = SerialSettings::new(19_200, format.parse().unwrap()).unwrap();
        let (seen, recording) = captured(Family::ATV58, protocol, settings).await;
        let (simulated, mut asked) = played_back(&recording, settings);
        let line = Line::over(simulated.in_memory(), config(protocol, settings));
        assert_eq!(program(&line, Family::ATV58).await, seen, "{protocol}");
        assert!(asked.try_recv().is_err(), "{protocol}");
    }
}

/// A recording of PDUs with their directions, each handed over so many milliseconds after the first.
fn recording(frames: &[(Direction, u64, Vec<u8>)]) -> Recording {
    let mut file = Vec::new();
    let mut writer = Writer::new(&mut file, Dissector::Rtu).unwrap();
    for (direction, at, bytes) in frames {
        let at = std::time::Duration::from_millis(1_000_000 + at);
        writer.write(&Captured { at, direction: *direction, bytes: bytes.clone().into() }).unwrap();
    }
    drive_bus::capture::read(&file).unwrap()
}

#[tokio::test(start_paused = true)]
async fn exceptions_damage_and_silence_are_met_again_and_what_was_not_asked_is_told() {
    let read = |register| rtu::frame(3, &[3, 0, register, 0, 1]).to_vec();
    let answer = |word| rtu::frame(3, &[3, 2, 0, word]).to_vec();
    let mut damaged = answer(9);
    damaged[3] ^= 1;
    let (sent, received) = (Direction::Sent, Direction::Received);
    let recording = recording(&[
        (sent, 0, read(1)),
        (received, 40, answer(7)),
        (sent, 100, read(2)),
        (received, 140, rtu::frame(3, &[0x83, 2]).to_vec()),
        (sent, 200, read(4)),
        (sent, 900, read(5)),
        (received, 940, damaged),
        // Repeated, and answered then; the last request has had no time for its answer.
        (sent, 1_000, read(5)),
        (received, 1_040, answer(9)),
        // It may be that to a question before, which is owed: it is thrown away once, and asked for again.
        (sent, 1_060, read(5)),
        (received, 1_090, answer(9)),
        (sent, 1_100, read(6)),
    ]);
    let (simulated, mut asked) = played_back(&recording, RTU);
    let config = LineConfig { retries: 0, ..config("rtu", RTU) };
    let line = Line::over(simulated.in_memory(), config);
    let read = |register| {
        let mut slave = line.slave(3);
        async move {
            use drive_core::tokio_modbus::{Request, client::Client as _};
            let call = slave.call(Request::ReadHoldingRegisters(register, 1)).await;
            call.map(|answer| format!("{answer:?}")).map_err(PortError::from_modbus)
        }
    };
    assert!(read(1).await.unwrap().contains("[7]"));
    assert!(read(2).await.unwrap().contains("IllegalDataAddress"));
    assert!(matches!(read(4).await, Err(PortError::Timeout { .. })));
    // Without its first bits it looks as much like a damaged echo.
    assert!(matches!(read(5).await, Err(PortError::Damaged(_) | PortError::Mismatch(_))));
    assert!(read(5).await.unwrap().contains("[9]"));
    assert!(asked.try_recv().is_err());
    assert!(matches!(read(6).await, Err(PortError::Timeout { .. })));
    assert_eq!(asked.try_recv().unwrap(), (3, vec![3, 0, 6, 0, 1]));
    let mut explainer = Explainer::new(Known::default());
    let words = in_words(&mut explainer, drive_sim::Protocol::Rtu, 3, &[3, 0, 6, 0, 1]);
    assert_eq!(words, "reads 6 (0006h)");
}

#[test]
fn the_time_of_an_answer_counts_from_the_end_of_its_request() {
    // At 19200 8E1 the 8 characters of the request take 4.58 ms and the 7 of the answer 4.01 ms: 40 - 8.59 ms.
    let frames = [
        (Direction::Sent, 0, rtu::frame(3, &[3, 0, 1, 0, 1]).to_vec()),
        (Direction::Received, 40, rtu::frame(3, &[3, 2, 0, 7]).to_vec()),
    ];
    let found = exchanges(&recording(&frames), RTU);
    assert_eq!(found[&3][0].1.after.as_micros(), 31_406);
    // Heard by another the request has ended already when it is handed over: 40 - 4.01 ms.
    let heard = Recording { late: Some(std::time::Duration::ZERO), ..recording(&frames) };
    assert_eq!(exchanges(&heard, RTU)[&3][0].1.after.as_micros(), 35_989);
}

#[tokio::test(start_paused = true)]
async fn an_image_answers_any_question_of_the_registers_that_the_capture_has() {
    use drive_core::tokio_modbus::{Request, client::Client as _};

    let (sent, received) = (Direction::Sent, Direction::Received);
    let recording = recording(&[
        (sent, 0, rtu::frame(3, &[3, 0, 10, 0, 3]).to_vec()),
        (received, 40, rtu::frame(3, &[3, 6, 0, 1, 0, 2, 0, 3]).to_vec()),
        (sent, 100, rtu::frame(3, &[6, 0, 11, 0, 9]).to_vec()),
        (received, 140, rtu::frame(3, &[6, 0, 11, 0, 9]).to_vec()),
    ]);
    let (unknown, mut asked) = mpsc::unbounded_channel();
    let found = exchanges(&recording, RTU);
    let simulated = line(drive_sim::Protocol::Rtu, RTU, &found, true, unknown).unwrap();
    let line = Line::over(simulated.in_memory(), LineConfig { retries: 0, ..config("rtu", RTU) });
    let ask = |request| {
        let mut slave = line.slave(3);
        async move {
            slave.call(request).await.map(|answer| format!("{answer:?}")).map_err(PortError::from_modbus)
        }
    };
    // Other blocks than were asked for, the later word over the earlier.
    assert!(ask(Request::ReadHoldingRegisters(11, 2)).await.unwrap().contains("[9, 3]"));
    assert!(ask(Request::ReadHoldingRegisters(12, 1)).await.unwrap().contains("[3]"));
    assert!(ask(Request::WriteSingleRegister(12, 77)).await.is_ok());
    assert!(ask(Request::ReadHoldingRegisters(10, 3)).await.unwrap().contains("[1, 9, 77]"));
    assert!(asked.try_recv().is_err());
    assert!(ask(Request::ReadHoldingRegisters(12, 2)).await.unwrap().contains("IllegalDataAddress"));
    assert_eq!(asked.try_recv().unwrap(), (3, vec![3, 0, 13, 0, 1]));
}
