//! A master reaches the line on a pty and over TCP, in real time.

use std::time::Duration;

use crate::support::{KEEP, Small, ask, frame, read, write};
use drive_sim::{Fault, SimLine, Wiring};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
};

/// Longer than any answer takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(5);

fn line() -> SimLine {
    let line = SimLine::new(Wiring { unpaced: true, ..Wiring::default() });
    line.add(1, Small::new()).unwrap();
    line
}

#[cfg(unix)]
mod pty {
    use std::{
        fs,
        path::{Path, PathBuf},
    };

    use drive_core::SerialSettings;
    use drive_sim::Dialect;
    use rustix::fs::{Mode, OFlags};
    use tokio_serial::{Parity, SerialPortBuilderExt, SerialStream};

    use super::*;

    fn link(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("drive-sim-{}-{name}", std::process::id()))
    }

    #[tokio::test]
    async fn masters_come_and_go_on_a_pty_and_its_link_ends_with_it() {
        let link = link("come-and-go");
        let line = line();
        let serving = line.serve_pty(&link).unwrap();
        assert_eq!(fs::read_link(&link).unwrap(), PathBuf::from(serving.device().unwrap()));
        for value in 1..=5 {
            let path = link.to_str().unwrap();
            let mut port = tokio_serial::new(path, 19_200).open_native_async().unwrap();
            let request = write(1, KEEP.address(), value);
            assert_eq!(whole(&mut port, &request, 8).await, request);
        }
        assert_eq!(line.slave(1).unwrap().requests(6), 5);
        drop(serving);
        assert!(fs::symlink_metadata(&link).is_err());
    }

    #[tokio::test]
    async fn a_paced_line_on_a_pty_sees_no_violation_of_a_master_that_waits() {
        let link = link("paced");
        let line = SimLine::default();
        line.add(1, Small::new()).unwrap();
        let _serving = line.serve_pty(&link).unwrap();
        let mut port = at(&link, "19200 8E1");
        for _ in 0..10 {
            whole(&mut port, &read(1, KEEP.address(), 1), 7).await;
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        assert_eq!(line.violations(), []);
        assert!(line.stats().ideal > Duration::from_millis(150));
    }

    #[tokio::test]
    async fn a_master_that_sets_another_speed_or_parity_is_misheard_until_it_sets_the_slaves() {
        let link = link("misheard");
        let line = SimLine::default();
        let own = |text: &str| Dialect { settings: text.parse().unwrap(), ..Dialect::default() };
        for (address, text) in [(1, "19200 8E1"), (2, "9600 8N1"), (3, "19200 8O1")] {
            line.add(address, Small::new()).unwrap().set_dialect(own(text));
        }
        let _serving = line.serve_pty(&link).unwrap();
        let request = |address| read(address, KEEP.address(), 1);
        for (text, address) in [("19200 8E1", 1), ("9600 8N1", 2), ("19200 8O1", 3), ("19200 8E1", 1)] {
            let mut port = at(&link, text);
            for other in (1..=3).filter(|other| *other != address) {
                // Nobody takes it; whoever hears noise takes it for a frame's end a silence later.
                port.write_all(&request(other)).await.unwrap();
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
            whole(&mut port, &request(address), 7).await;
        }
        let taken = [1, 2, 3].map(|address| line.slave(address).unwrap().requests(3));
        assert_eq!(taken, [2, 1, 1]);
    }

    #[tokio::test]
    async fn a_program_that_opens_the_pty_as_a_file_and_sets_nothing_is_understood() {
        let link = link("as-it-is");
        let line = SimLine::new(Wiring::rtu("9600 8N2".parse().unwrap()));
        line.add(1, Small::new()).unwrap();
        let _serving = line.serve_pty(&link).unwrap();
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK;
        let port = rustix::fs::open(&link, flags, Mode::empty()).unwrap();
        rustix::io::write(&port, &read(1, KEEP.address(), 1)).unwrap();
        let mut heard: Vec<u8> = Vec::new();
        let answered = async {
            while heard.len() < 7 {
                let mut some = [0; 16];
                match rustix::io::read(&port, &mut some) {
                    Ok(number) => heard.extend_from_slice(&some[..number]),
                    Err(_) => tokio::time::sleep(Duration::from_millis(5)).await,
                }
            }
        };
        tokio::time::timeout(Duration::from_secs(20), answered).await.expect("it is answered");
        assert_eq!(heard[..2], [1, 3]);
    }

    #[tokio::test]
    async fn a_file_in_the_way_of_the_link_is_left_alone() {
        let link = link("in-the-way");
        fs::write(&link, "mine").unwrap();
        let error = line().serve_pty(&link).unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(&link).unwrap(), "mine");
        fs::remove_file(&link).unwrap();
    }

    #[tokio::test]
    async fn a_link_that_a_killed_simulator_left_behind_is_replaced() {
        let link = link("old");
        std::os::unix::fs::symlink("/dev/pts/gone", &link).unwrap();
        let serving = line().serve_pty(&link).unwrap();
        assert_eq!(fs::read_link(&link).unwrap(), PathBuf::from(serving.device().unwrap()));
    }

    /// Opens the port as a program does that uses a serial port library.
    fn at(link: &Path, settings: &str) -> SerialStream {
        let settings: SerialSettings = settings.parse().unwrap();
        let parity = match settings.format().parity() {
            drive_core::serial::Parity::None => Parity::None,
            drive_core::serial::Parity::Even => Parity::Even,
            drive_core::serial::Parity::Odd => Parity::Odd,
        };
        let port = tokio_serial::new(link.to_str().unwrap(), settings.baud()).parity(parity);
        port.open_native_async().unwrap()
    }

    async fn whole(port: &mut SerialStream, request: &[u8], length: usize) -> Vec<u8> {
        port.write_all(request).await.unwrap();
        let mut answer = vec![0; length];
        tokio::time::timeout(PATIENCE, port.read_exact(&mut answer)).await.unwrap().unwrap();
        answer
    }
}

#[tokio::test]
async fn masters_follow_each_other_over_tcp() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let _serving = line().serve_rtu_tcp(listener);
    for _ in 0..3 {
        let mut stream = TcpStream::connect(address).await.unwrap();
        let answer = ask(&mut stream, &read(1, KEEP.address(), 1), PATIENCE).await;
        assert_eq!(answer, Some(frame(&[1, 0x03, 2, 0, 7])));
    }
}

#[tokio::test]
async fn modbus_tcp_answers_by_transaction_and_unit_and_several_clients_at_once() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let line = line();
    let _serving = line.serve_modbus_tcp(listener);
    let mut one = TcpStream::connect(address).await.unwrap();
    let mut other = TcpStream::connect(address).await.unwrap();
    // Transaction 0102h, protocol 0, 6 bytes, unit 0 (all) and then 1: function 06 on register 4.
    one.write_all(&[1, 2, 0, 0, 0, 6, 0, 6, 0, 4, 0, 5]).await.unwrap();
    let confirmed = ask(&mut one, &[1, 3, 0, 0, 0, 6, 1, 6, 0, 4, 0, 9], PATIENCE).await;
    assert_eq!(confirmed.unwrap(), [1, 3, 0, 0, 0, 6, 1, 6, 0, 4, 0, 9]);
    let answer = ask(&mut other, &[7, 8, 0, 0, 0, 6, 1, 3, 0, 4, 0, 1], PATIENCE).await;
    assert_eq!(answer.unwrap(), [7, 8, 0, 0, 0, 5, 1, 3, 2, 0, 9]);
    let values: Vec<_> = line.slave(1).unwrap().received().iter().map(|received| received.cast).collect();
    assert_eq!(values.len(), 3);

    let slave = line.slave(1).unwrap();
    slave.hold_next_answer();
    one.write_all(&[9, 9, 0, 0, 0, 6, 1, 3, 0, 4, 0, 1]).await.unwrap();
    slave.wait_until_held().await;
    slave.release();
    let mut late = [0; 11];
    tokio::time::timeout(PATIENCE, one.read_exact(&mut late)).await.unwrap().unwrap();
    assert_eq!(late, [9, 9, 0, 0, 0, 5, 1, 3, 2, 0, 9]);
}

#[tokio::test]
async fn a_client_that_does_not_speak_modbus_tcp_is_disconnected() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let line = line();
    line.set_fault(Fault::Lost, 0);
    let _serving = line.serve_modbus_tcp(listener);
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(b"GET / HTTP/1.1\r\n\r\n").await.unwrap();
    let read = tokio::time::timeout(PATIENCE, stream.read(&mut [0; 16])).await;
    assert_eq!(read.unwrap().unwrap_or(0), 0);
}
