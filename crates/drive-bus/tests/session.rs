//! A port that is lost, comes back, or never comes.

#![cfg(feature = "serial")]

mod support;

use std::{
    io,
    sync::{Arc, Mutex},
};

use drive_bus::{Line, LineConfig, OpenError, exchange::rtu};
use drive_core::{Class, PortError, Terms, serial::SerialSettings};
use support::{MS, read, reads, writes};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream},
    sync::mpsc,
    time::Instant,
};

/// A line whose port can be pulled and plugged: each opening gives its far end to the test, or fails while unplugged.
fn pluggable() -> (Line, mpsc::UnboundedReceiver<DuplexStream>, Arc<Mutex<bool>>) {
    let (far_ends, opened) = mpsc::unbounded_channel();
    let plugged = Arc::new(Mutex::new(true));
    let is_plugged = Arc::clone(&plugged);
    let open = move || {
        let (ours, theirs) = tokio::io::duplex(512);
        let plugged = *is_plugged.lock().unwrap();
        if plugged {
            far_ends.send(theirs).unwrap();
        }
        async move { if plugged { Ok(ours) } else { Err(io::Error::from(io::ErrorKind::NotFound)) } }
    };
    (Line::over_reopened(open, LineConfig::stream(SerialSettings::MODBUS_DEFAULT)), opened, plugged)
}

async fn serve_one(port: &mut DuplexStream) -> Vec<u8> {
    let mut bytes = vec![0; 512];
    let len = port.read(&mut bytes).await.unwrap();
    bytes.truncate(len);
    let pdu: &[u8] = if bytes[1] == 3 { &[3, 2, 0, 1] } else { &bytes[1..6] };
    port.write_all(&rtu::frame(bytes[0], pdu)).await.unwrap();
    bytes
}

#[tokio::test(start_paused = true)]
async fn a_port_that_was_pulled_is_opened_again_and_the_line_goes_on() {
    let (line, mut opened, plugged) = pluggable();
    let call = reads(line.slave(1), 0, 1);
    let mut port = opened.recv().await.unwrap();
    serve_one(&mut port).await;
    assert_eq!(call.await.unwrap(), Ok(vec![1]));

    *plugged.lock().unwrap() = false;
    drop(port);
    tokio::time::sleep(5_000 * MS).await;
    assert!(matches!(read(&mut line.slave(1), 0, 1).await, Err(PortError::LineDown(_))));

    *plugged.lock().unwrap() = true;
    let mut port = opened.recv().await.unwrap();
    tokio::time::sleep(MS).await;
    let call = reads(line.slave(1), 0, 1);
    // The first answer is thrown away.
    serve_one(&mut port).await;
    serve_one(&mut port).await;
    assert_eq!(call.await.unwrap(), Ok(vec![1]));
    assert_eq!((line.stats().opened, line.stats().lost), (2, 1));
}

#[tokio::test(start_paused = true)]
async fn a_short_interruption_costs_a_waiting_read_nothing() {
    let (line, mut opened, _plugged) = pluggable();
    let call = reads(line.slave(1), 0, 1);
    let mut port = opened.recv().await.unwrap();
    let mut bytes = [0; 64];
    assert!(port.read(&mut bytes).await.unwrap() > 0);
    drop(port);
    let mut port = opened.recv().await.unwrap();
    serve_one(&mut port).await;
    assert_eq!(call.await.unwrap(), Ok(vec![1]));
}

#[tokio::test(start_paused = true)]
async fn a_write_under_way_when_the_port_is_lost_is_never_sent_again() {
    let (line, mut opened, _plugged) = pluggable();
    let call = writes(line.slave(1), 8501, 15);
    let mut port = opened.recv().await.unwrap();
    let mut bytes = [0; 64];
    assert!(port.read(&mut bytes).await.unwrap() > 0);
    drop(port);
    assert_eq!(call.await.unwrap(), Err(PortError::OutcomeUnknown("the line was lost")));
    let mut port = opened.recv().await.unwrap();
    let sent = tokio::time::timeout(5_000 * MS, port.read(&mut bytes)).await;
    assert!(sent.is_err(), "{sent:?}");
}

#[tokio::test(start_paused = true)]
async fn a_command_that_waits_when_the_port_is_lost_is_never_sent_to_whoever_answers_over_the_next() {
    let (line, mut opened, _plugged) = pluggable();
    let mut port = opened.recv().await.unwrap();
    // The line is busy, so that the command waits; then the port goes.
    let busy = reads(line.slave(1), 0, 1);
    let mut bytes = [0; 64];
    assert!(port.read(&mut bytes).await.unwrap() > 0);
    let command = writes(line.slave(2).with_terms(Terms::of(Class::Command).within(1_000 * MS)), 8501, 15);
    tokio::task::yield_now().await;
    let mut losses = line.slave(2).port_losses();
    // It is plugged in again at once.
    drop(port);
    assert!(matches!(command.await.unwrap(), Err(PortError::LineDown(_))));
    assert!(losses.has_changed().unwrap(), "who has commanded it hears why");
    assert_eq!(losses.look(), 1);
    let mut port = opened.recv().await.unwrap();
    serve_one(&mut port).await;
    assert_eq!(busy.await.unwrap(), Ok(vec![1]), "a read waits");
    let sent = tokio::time::timeout(5_000 * MS, port.read(&mut bytes)).await;
    assert!(sent.is_err(), "{sent:?}");
}

#[tokio::test(start_paused = true)]
async fn one_bad_frame_never_closes_the_port() {
    let (line, mut opened, _plugged) = pluggable();
    let call = reads(line.slave(1), 0, 1);
    let mut port = opened.recv().await.unwrap();
    let mut bytes = [0; 64];
    assert!(port.read(&mut bytes).await.unwrap() > 0);
    port.write_all(&[1, 3, 2, 0, 1, 0xBA, 0xD0]).await.unwrap();
    serve_one(&mut port).await;
    assert_eq!(call.await.unwrap(), Ok(vec![1]));
    assert_eq!(line.stats().opened, 1);
}

#[tokio::test(start_paused = true)]
async fn a_port_that_opens_and_ends_at_once_is_tried_ever_less_often() {
    let (openings, mut opened) = mpsc::unbounded_channel();
    let open = move || {
        openings.send(Instant::now()).unwrap();
        // The far end is gone already.
        async { Ok(tokio::io::duplex(512).0) }
    };
    let _line = Line::over_reopened(open, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    let mut times = Vec::new();
    while times.len() < 9 {
        times.push(opened.recv().await.unwrap());
    }
    let pauses: Vec<_> = times.windows(2).map(|pair| (pair[1] - pair[0]).as_millis()).collect();
    // At once after the first loss, then from 0.2 s to 2 s.
    assert_eq!(pauses, [0, 200, 400, 800, 1_600, 2_000, 2_000, 2_000]);
}

/// A serial server that has its one client already opens each connection, and ends it at once.
#[tokio::test(start_paused = true)]
async fn a_call_over_a_port_that_opens_and_ends_at_once_for_ever_is_told_so() {
    let open = || async { Ok(tokio::io::duplex(512).0) };
    let line = Line::over_reopened(open, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    for class in [Class::Status, Class::Stop] {
        let stop = writes(line.slave(1).with_terms(Terms::of(class)), 8501, 0);
        let read = reads(line.slave(1), 0, 1);
        let both = tokio::time::timeout(60_000 * MS, async { (stop.await.unwrap(), read.await.unwrap()) });
        let both = both.await.expect("it ends");
        assert!(
            matches!(both, (Err(PortError::LineDown(_)), Err(PortError::LineDown(_)))),
            "{class}: {both:?}"
        );
    }
}

/// A port of somebody else's making, that does what none may.
struct Panics;

impl tokio::io::AsyncRead for Panics {
    fn poll_read(
        self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
        _: &mut tokio::io::ReadBuf<'_>,
    ) -> std::task::Poll<io::Result<()>> {
        panic!("a port that panics, for a test");
    }
}

impl tokio::io::AsyncWrite for Panics {
    fn poll_write(
        self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
        bytes: &[u8],
    ) -> std::task::Poll<io::Result<usize>> {
        std::task::Poll::Ready(Ok(bytes.len()))
    }

    fn poll_flush(
        self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
    ) -> std::task::Poll<io::Result<()>> {
        std::task::Poll::Ready(Ok(()))
    }

    fn poll_shutdown(
        self: std::pin::Pin<&mut Self>,
        _: &mut std::task::Context<'_>,
    ) -> std::task::Poll<io::Result<()>> {
        std::task::Poll::Ready(Ok(()))
    }
}

/// Whatever has ended the line, nothing is sent any more, and each call tells this of it.
async fn ends_every_call(line: &Line, tells: &str) {
    for class in [Class::Status, Class::Stop] {
        let mut slave = line.slave(1).with_terms(Terms::of(class));
        let read = tokio::time::timeout(60_000 * MS, read(&mut slave, 0, 1)).await.expect("it ends");
        assert!(read.as_ref().is_err_and(|error| error.to_string().contains(tells)), "{class}: {read:?}");
    }
    assert!(line.stats().away.is_some(), "it says that it is away");
    line.close().await;
}

#[tokio::test(start_paused = true)]
async fn a_line_whose_port_panics_ends_every_call_that_waits_or_comes() {
    let line = Line::over(Panics, LineConfig::stream(SerialSettings::MODBUS_DEFAULT));
    let waits = reads(line.slave(1), 0, 1);
    let waits = tokio::time::timeout(60_000 * MS, waits).await.expect("it ends").unwrap();
    assert!(matches!(waits, Err(PortError::LineDown(_) | PortError::Closed)), "{waits:?}");
    ends_every_call(&line, "the stream has panicked: a port that panics, for a test").await;
}

#[test]
fn a_line_whose_runtime_has_ended_ends_every_call_from_another() {
    let made =
        || tokio::runtime::Builder::new_current_thread().enable_all().start_paused(true).build().unwrap();
    let (its, ours) = (made(), made());
    let (near, mut far) = tokio::io::duplex(512);
    let line = its.block_on(async { Line::over(near, LineConfig::stream(SerialSettings::MODBUS_DEFAULT)) });
    let (mut reading, mut writing) = (line.slave(1), line.slave(1));
    let calls = ours
        .spawn(async move { tokio::join!(support::write(&mut writing, 8501, 15), read(&mut reading, 0, 1)) });
    ours.block_on(tokio::task::yield_now());
    // The write is on the line, and the read waits behind it.
    its.block_on(far.read_exact(&mut [0; 8])).unwrap();
    drop(its);
    let calls = async { tokio::time::timeout(60_000 * MS, calls).await.expect("they end").unwrap() };
    let (written, waited) = ours.block_on(calls);
    assert!(matches!(written, Err(PortError::OutcomeUnknown(_))), "{written:?}");
    assert!(matches!(waited, Err(PortError::LineDown(_) | PortError::Closed)), "{waited:?}");
    ours.block_on(ends_every_call(&line, &PortError::Closed.to_string()));
}

#[tokio::test]
async fn a_missing_port_is_named() {
    let path = "/dev/no-such-port";
    let error = Line::open(LineConfig::serial(path, SerialSettings::MODBUS_DEFAULT)).await.unwrap_err();
    assert_eq!(error, OpenError::NotFound { path: path.into() });
    assert_eq!(error.to_string(), "there is no serial port /dev/no-such-port");
}

#[cfg(unix)]
#[tokio::test]
async fn a_port_in_use_is_named_and_a_free_one_serves() {
    use tokio_serial::{SerialPort, SerialStream};

    let (mut far, near) = SerialStream::pair().unwrap();
    let path = near.name().unwrap();
    drop(near);
    let config = LineConfig {
        echo: drive_bus::Echo::Off,
        ..LineConfig::serial(&path, SerialSettings::MODBUS_DEFAULT)
    };
    let line = Line::open(config.clone()).await.unwrap();
    let error = Line::open(config).await.unwrap_err();
    assert_eq!(error, OpenError::InUse { path: path.into() });

    let call = reads(line.slave(1), 0, 1);
    let mut request = [0; 8];
    far.read_exact(&mut request).await.unwrap();
    assert_eq!(request[..], rtu::frame(1, &[3, 0, 0, 0, 1])[..]);
    far.write_all(&rtu::frame(1, &[3, 2, 0, 1])).await.unwrap();
    assert_eq!(call.await.unwrap(), Ok(vec![1]));
    line.close().await;
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn a_port_without_an_rs485_mode_says_so() {
    use tokio_serial::{SerialPort, SerialStream};

    let (_far, near) = SerialStream::pair().unwrap();
    let path = near.name().unwrap();
    drop(near);
    let config = LineConfig {
        rs485: Some(drive_bus::Rs485::default()),
        ..LineConfig::serial(&path, SerialSettings::MODBUS_DEFAULT)
    };
    let error = Line::open(config).await.unwrap_err();
    assert!(matches!(error, OpenError::Rs485 { .. }), "{error}");
    assert_eq!(drive_bus::adapter_latency(path.as_ref()), None);
}

#[tokio::test(start_paused = true)]
async fn an_answer_that_was_on_its_way_when_the_port_was_lost_is_never_taken_for_the_next() {
    let (line, mut opened, _plugged) = pluggable();
    let first = reads(line.slave(1), 7, 1);
    let mut port = opened.recv().await.unwrap();
    let mut bytes = [0; 64];
    assert!(port.read(&mut bytes).await.unwrap() > 0);
    // Its caller has lost patience: nothing is asked again.
    first.abort();
    drop(port);
    let mut port = opened.recv().await.unwrap();
    let second = reads(line.slave(1), 8, 1);
    // What a serial server still has of the line it gives to the next connection.
    let late = rtu::frame(1, &[3, 2, 0xAA, 0xAA]);
    tokio::time::sleep(10 * MS).await;
    port.write_all(&late).await.unwrap();
    serve_one(&mut port).await;
    assert_eq!(second.await.unwrap(), Ok(vec![1]));
    assert_eq!(line.stats().slaves[&1].late, 1);
}
