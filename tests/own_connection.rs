//! A drive family on a tokio-modbus connection of its own, against a simulated drive.

use std::{future, io, time::Duration};

use drive_atv312::Atv312;
use drive_core::{
    Direction, Drive, ErrorKind, Frequency, Port, PortError, Reconnecting, SerialSettings, StopMode, Terms,
    tokio_modbus::{
        Request, Response, Slave,
        client::{Client, Context, rtu},
        slave::SlaveContext,
    },
};
use drive_sim::{SimLine, SimSlave, Wiring, models};
use tokio::time::{Instant, timeout};

const RESPONSE: Duration = Duration::from_millis(200);
/// `LFr` and `HSP`.
const LFR: u16 = 8502;
const HSP: u16 = 3104;

fn plant() -> (SimLine, SimSlave) {
    let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let machine = line.add(1, models::atv312::Atv312::under_bus_control()).unwrap();
    (line, machine)
}

fn port(plant: &SimLine) -> Reconnecting<impl FnMut() -> future::Ready<io::Result<Context>> + Send + use<>> {
    let plant = plant.clone();
    let mut port = Reconnecting::new(RESPONSE, move || {
        future::ready(Ok(rtu::attach_slave(plant.in_memory(), Slave(1))))
    });
    port.set_slave(Slave(1));
    port
}

async fn read(port: &mut impl Client, address: u16) -> Option<u16> {
    match port.call(Request::ReadHoldingRegisters(address, 1)).await {
        Ok(Ok(Response::ReadHoldingRegisters(words))) => words.first().copied(),
        _ => None,
    }
}

#[tokio::test(start_paused = true)]
async fn the_answer_to_a_dropped_read_is_given_to_nobody() {
    let (plant, machine) = plant();
    assert!(machine.poke(LFR, 321) && machine.poke(HSP, 456));
    // What a bare context does.
    let mut bare = rtu::attach_slave(plant.in_memory(), Slave(1));
    assert!(timeout(Duration::from_millis(1), read(&mut bare, LFR)).await.is_err());
    tokio::time::sleep(RESPONSE).await;
    assert_eq!(read(&mut bare, HSP).await, Some(321), "if this fails, tokio-modbus has learned it");
    drop(bare);
    let mut port = port(&plant);
    for _ in 0..5 {
        assert!(timeout(Duration::from_millis(1), read(&mut port, LFR)).await.is_err());
        assert_eq!(read(&mut port, HSP).await, Some(456));
        assert_eq!(read(&mut port, LFR).await, Some(321));
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_over_a_cut_cable_ends_in_its_time() {
    let (plant, _machine) = plant();
    let mut drive = Atv312::new(port(&plant), 1.try_into().unwrap());
    drive.set_setpoint(Frequency::from_hertz(20).into()).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    plant.control("line cut").unwrap();
    let begun = Instant::now();
    let error = drive.stop(StopMode::Ramp).await.unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::OutcomeUnknown | ErrorKind::NoAnswer), "{error}");
    assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
    plant.control("line join").unwrap();
    drive.stop(StopMode::Ramp).await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn a_stop_behind_a_dropped_read_is_sent_at_once_and_confirmed_by_what_is_read_later() {
    let (plant, machine) = plant();
    let mut drive = Atv312::new(port(&plant), 1.try_into().unwrap());
    drive.set_setpoint(Frequency::from_hertz(20).into()).await.unwrap();
    drive.start(Direction::Forward).await.unwrap();
    assert!(timeout(Duration::from_millis(1), drive.status()).await.is_err());
    let (begun, writes) = (Instant::now(), machine.requests(0x06));
    let stopping = drive.stop(StopMode::Ramp);
    tokio::pin!(stopping);
    while machine.requests(0x06) == writes {
        assert!(timeout(Duration::from_millis(5), &mut stopping).await.is_err(), "not written yet");
    }
    assert!(begun.elapsed() < RESPONSE, "{:?}", begun.elapsed());
    stopping.await.unwrap();
}

#[tokio::test(start_paused = true)]
async fn what_has_waited_too_long_for_its_connection_is_not_sent() {
    let mut port = Reconnecting::new(RESPONSE, future::pending::<io::Result<Context>>);
    let begun = Instant::now();
    let lost = port.call(Request::ReadHoldingRegisters(LFR, 1)).await.unwrap_err();
    assert!(matches!(PortError::from_modbus(lost), PortError::LineDown(_)));
    assert_eq!(begun.elapsed(), Duration::from_secs(1));

    let (plant, machine) = plant();
    let mut port = self::port(&plant);
    port.set_terms(Terms { lifetime: Some(Duration::from_millis(100)), ..Terms::default() });
    assert!(timeout(Duration::from_millis(1), read(&mut port, LFR)).await.is_err());
    let before = machine.all_requests();
    let expired = port.call(Request::WriteSingleRegister(LFR, 100)).await.unwrap_err();
    assert_eq!(PortError::from_modbus(expired), PortError::Expired);
    assert_eq!(machine.all_requests(), before);
}
