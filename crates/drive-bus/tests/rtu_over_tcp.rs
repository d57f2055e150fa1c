//! Modbus RTU to a serial server over TCP: the simulated line behind one, and what becomes of answers and calls when the
//! connection cuts them, joins them, or ends.

#![cfg(feature = "tcp")]

mod support;

use drive_bus::{Gateway, Line, LineConfig, OpenError, SlaveSettings, exchange::rtu};
use drive_core::{Class, PortError, SerialSettings, Terms};
use drive_sim::{Delivery, SimLine, Wiring, models::atv312::Atv312};
use support::{
    MS,
    server::{PATIENCE, Server, call, outcome},
};
use tokio::net::{TcpListener, TcpSocket};
use tokio_modbus::{Request, Response};

const SERIAL: SerialSettings = SerialSettings::MODBUS_DEFAULT;
const READ: Request<'static> = Request::ReadHoldingRegisters(3201, 1);
const WRITE: Request<'static> = Request::WriteSingleRegister(9001, 55);

fn words(words: &[u16]) -> Result<Response, PortError> {
    Ok(Response::ReadHoldingRegisters(words.to_vec()))
}

/// A line to this address whose answers may be as late as a busy machine makes them.
fn to(address: impl Into<String>) -> LineConfig {
    LineConfig {
        response_timeout: PATIENCE,
        timeout_floor: PATIENCE,
        chunk_gap: PATIENCE,
        gateway: Some(Gateway::NONE),
        ..LineConfig::rtu_over_tcp(address, SERIAL)
    }
}

/// The same for a connection that is lost: what was asked over it is not asked again before its answer can no longer come.
fn to_one_that_is_lost(address: impl Into<String>) -> LineConfig {
    let soon = 2_000 * MS;
    LineConfig { response_timeout: soon, timeout_floor: soon, ..to(address) }
}

/// The same, asking once, and giving up slave 1 soon.
fn impatient_with_the_first(address: impl Into<String>) -> LineConfig {
    let first = SlaveSettings { response_timeout: Some(50 * MS), ..SlaveSettings::default() };
    LineConfig { retries: 0, ..to(address) }.slave(1, first)
}

/// A simulated line with drives 1 to 3 behind a serial server, and a master's line to it.
async fn simulated(delivery: Delivery) -> (SimLine, drive_sim::Serving, Line) {
    let simulated = SimLine::new(Wiring { delivery, ..Wiring::rtu(SERIAL) });
    for address in 1..=3 {
        simulated.add(address, Atv312::under_bus_control()).unwrap();
    }
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let serving = simulated.serve_rtu_tcp(listener);
    let line = Line::open(to(address)).await.unwrap();
    (simulated, serving, line)
}

#[tokio::test]
async fn drives_behind_a_serial_server_are_read_and_written_and_their_line_keeps_its_silences() {
    let (simulated, _serving, line) = simulated(Delivery::Whole).await;
    for round in 1..=5 {
        for slave in 1..=3 {
            let write = Request::WriteSingleRegister(9001, round);
            let written = outcome(call(&line, slave, Terms::of(Class::Command), write)).await;
            assert_eq!(written, Ok(Response::WriteSingleRegister(9001, round)));
            let read = call(&line, slave, Terms::default(), Request::ReadHoldingRegisters(9001, 1));
            assert_eq!(outcome(read).await, words(&[round]));
        }
    }
    let ramp = Request::WriteSingleRegister(9001, 70);
    assert!(outcome(call(&line, 0, Terms::default(), ramp)).await.is_ok());
    for slave in 1..=3 {
        let read = call(&line, slave, Terms::default(), Request::ReadHoldingRegisters(9001, 1));
        assert_eq!(outcome(read).await, words(&[70]));
    }
    assert_eq!(simulated.violations(), []);
    let silence = simulated.stats().shortest_silence.expect("there were many");
    assert!(silence >= SERIAL.t3_5(), "{silence:?}");
    assert_eq!((line.stats().opened, line.stats().noise_bytes, line.stats().foreign), (1, 0, 0));
}

#[tokio::test]
async fn answers_that_a_serial_server_forwards_character_by_character_are_whole() {
    let (simulated, _serving, line) = simulated(Delivery::Pieces(1)).await;
    for slave in 1..=3 {
        let read = call(&line, slave, Terms::default(), Request::ReadHoldingRegisters(9001, 2));
        assert_eq!(outcome(read).await, words(&[30, 30]));
    }
    assert_eq!(simulated.violations(), []);
    assert_eq!(line.stats().noise_bytes, 0);
}

#[tokio::test]
async fn a_frame_in_several_segments_is_one_answer() {
    let server = Server::bind().await;
    let (line, mut far) = server.serve(to(server.address())).await;
    let read = call(&line, 1, Terms::default(), Request::ReadHoldingRegisters(3201, 2));
    let request: [u8; 8] = far.request().await;
    assert_eq!(request[..], rtu::frame(1, &[3, 0x0C, 0x81, 0, 2])[..]);
    far.send_one_by_one(&rtu::frame(1, &[3, 4, 0x02, 0x37, 0x12, 0x34])).await;
    assert_eq!(outcome(read).await, words(&[0x0237, 0x1234]));
    assert_eq!(line.stats().slaves[&1].outcomes.damaged, 0);
}

#[tokio::test]
async fn a_late_answer_and_the_right_one_in_one_segment_are_told_apart() {
    let server = Server::bind().await;
    let late = rtu::frame(1, &[3, 2, 0xAA, 0xAA]);
    // Another slave's, and another function's of the same slave, which is not left alone for that.
    let next = [
        (2, READ, rtu::frame(2, &[3, 2, 0, 7]), words(&[7])),
        (
            1,
            Request::ReadInputRegisters(3201, 1),
            rtu::frame(1, &[4, 2, 0, 8]),
            Ok(Response::ReadInputRegisters(vec![8])),
        ),
    ];
    for (slave, request, frame, right) in next {
        let (line, mut far) = server.serve(impatient_with_the_first(server.address())).await;
        let first = call(&line, 1, Terms::default(), READ);
        far.request::<8>().await;
        assert_eq!(outcome(first).await, Err(PortError::Timeout { after: 50 * MS }));
        line.configure_slave(1, SlaveSettings::default());
        let second = call(&line, slave, Terms::default(), request);
        far.request::<8>().await;
        far.send(&[&late[..], &frame].concat()).await;
        assert_eq!(outcome(second).await, right);
        assert_eq!((line.stats().slaves[&1].late, line.stats().foreign), (1, 0));
    }
}

#[tokio::test]
async fn a_read_cut_off_in_the_middle_of_its_answer_is_asked_again_on_the_next_connection() {
    let server = Server::bind().await;
    let (line, mut far) = server.serve(to_one_that_is_lost(server.address())).await;
    let read = call(&line, 1, Terms::default(), READ);
    let request = far.request::<8>().await;
    far.send(&rtu::frame(1, &[3, 2, 0xAA, 0xAA])[..5]).await;
    drop(far);
    let mut far = server.accept().await;
    assert_eq!(far.request::<8>().await, request);
    // The half of the first answer is no beginning of this one.
    far.send(&rtu::frame(1, &[3, 2, 0, 7])).await;
    assert_eq!(outcome(read).await, words(&[7]));
    assert_eq!((line.stats().opened, line.stats().lost), (2, 1));
}

#[tokio::test]
async fn a_read_that_may_not_be_asked_again_says_that_the_line_was_down() {
    let server = Server::bind().await;
    let (line, mut far) =
        server.serve(LineConfig { retries: 0, ..to_one_that_is_lost(server.address()) }).await;
    let read = call(&line, 1, Terms::default(), READ);
    far.request::<8>().await;
    far.send(&[1, 3]).await;
    drop(far);
    let error = PortError::LineDown("the port was closed by its far end".to_owned());
    assert_eq!(outcome(read).await, Err(error));
    let mut far = server.accept().await;
    let read = call(&line, 1, Terms::default(), READ);
    far.request::<8>().await;
    far.send(&rtu::frame(1, &[3, 2, 0, 7])).await;
    assert_eq!(outcome(read).await, words(&[7]));
}

#[tokio::test]
async fn a_write_cut_off_in_the_middle_of_its_answer_has_an_unknown_outcome_and_is_never_sent_again() {
    let server = Server::bind().await;
    let (line, mut far) = server.serve(to_one_that_is_lost(server.address())).await;
    for (known, terms) in
        [Terms::of(Class::Command).edge(), Terms::of(Class::Command)].into_iter().enumerate()
    {
        let write = call(&line, 1, terms, WRITE);
        let request = far.request::<8>().await;
        far.send(&request[..5]).await;
        drop(far);
        assert_eq!(outcome(write).await, Err(PortError::OutcomeUnknown("the line was lost")));
        far = server.accept().await;
        // The first thing on the new connection is what is asked next, or a read whose answer is thrown away.
        let read = call(&line, 1, Terms::default(), READ);
        for _ in 0..=known {
            assert_eq!(far.request::<8>().await[1], 3);
            far.send(&rtu::frame(1, &[3, 2, 0, 7])).await;
        }
        assert_eq!(outcome(read).await, words(&[7]));
    }
    line.close().await;
    assert!(far.rest().await.unwrap().is_empty());
    assert_eq!((line.stats().opened, line.stats().lost), (3, 2));
}

#[tokio::test]
async fn a_server_that_accepts_and_is_mute_costs_its_calls_a_timeout_and_keeps_its_connection() {
    let server = Server::bind().await;
    let (line, mut far) = server.serve(impatient_with_the_first(server.address())).await;
    let write = call(&line, 1, Terms::of(Class::Command).edge(), WRITE);
    far.request::<8>().await;
    assert_eq!(outcome(write).await, Err(PortError::OutcomeUnknown("no answer")));
    for function in [3, 4] {
        let request = match function {
            3 => READ,
            _ => Request::ReadInputRegisters(3201, 1),
        };
        let read = call(&line, 1, Terms::default(), request);
        assert_eq!(far.request::<8>().await[1], function);
        assert_eq!(outcome(read).await, Err(PortError::Timeout { after: 50 * MS }));
    }
    // Three in a row: from now on calls to this slave end at once.
    let refused = outcome(call(&line, 1, Terms::default(), READ)).await;
    assert!(matches!(refused, Err(PortError::Offline { .. })), "{refused:?}");
    // The others are served, on the same connection.
    let read = call(&line, 2, Terms::default(), READ);
    loop {
        let request = far.request::<8>().await;
        if request[0] == 2 {
            break;
        }
    }
    far.send(&rtu::frame(2, &[3, 2, 0, 7])).await;
    assert_eq!(outcome(read).await, words(&[7]));
    assert_eq!((line.stats().opened, line.stats().lost), (1, 0));
}

#[tokio::test]
async fn a_server_that_refuses_is_named_and_one_that_comes_later_is_found() {
    // Bound and not listening: the system refuses every connection to it.
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let address = socket.local_addr().unwrap().to_string();
    for config in [to(&address), LineConfig::modbus_tcp(&address)] {
        let error = Line::open(config).await.unwrap_err();
        assert!(matches!(&error, OpenError::Connect { address: named, .. } if *named == address), "{error}");
    }

    let line = Line::start(to(&address)).unwrap();
    let error = outcome(call(&line, 1, Terms::default(), READ)).await.unwrap_err();
    let PortError::LineDown(reason) = &error else { panic!("{error:?}") };
    assert!(reason.contains(&address), "{reason}");

    let server = Server::from(socket.listen(1).unwrap());
    let mut far = server.accept().await;
    let serving = tokio::spawn(async move {
        far.request::<8>().await;
        far.send(&rtu::frame(1, &[3, 2, 0, 7])).await;
        far
    });
    // The server has the connection; a moment later the line sees it too.
    let read = loop {
        match outcome(call(&line, 1, Terms::default(), READ)).await {
            Err(PortError::LineDown(_)) => tokio::task::yield_now().await,
            other => break other,
        }
    };
    assert_eq!(read, words(&[7]));
    drop(serving.await.unwrap());
}
