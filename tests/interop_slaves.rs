//! Our line reads and writes a slave that was not written here, by the path of a pty as it would open a serial port.
#![cfg(unix)]

use std::{path::PathBuf, process::Stdio};

use drive_bus::{Line, LineConfig, Protocol, protocol::AsciiSettings};
use drive_core::SerialSettings;
use support::{cable::Cable, peers};
use tokio::{
    io::{AsyncBufReadExt, BufReader},
    process::{Child, Command},
};
use tokio_modbus::{
    ExceptionCode,
    client::{Context, Reader, Writer},
    prelude::ReadCode,
};

#[tokio::test(flavor = "multi_thread")]
async fn our_line_reads_writes_and_identifies_a_pymodbus_slave() {
    let Some(python) = peers::python_with("pymodbus") else { return };
    let cable = Cable::new();
    let _slave = Pymodbus::start(&python, &cable, "rtu").await;
    let line =
        Line::open(LineConfig::serial(cable.near(), SerialSettings::MODBUS_DEFAULT)).await.expect("it opens");
    let mut slave = Context::from(line.slave(3));

    assert_eq!(slave.read_holding_registers(3201, 4).await.unwrap().unwrap(), [0x0227, 500, 480, 12]);
    slave.write_single_register(3202, 250).await.unwrap().unwrap();
    slave.write_multiple_registers(3203, &[7, 8]).await.unwrap().unwrap();
    assert_eq!(slave.read_holding_registers(3201, 4).await.unwrap().unwrap(), [0x0227, 250, 7, 8]);
    assert_eq!(slave.read_holding_registers(9000, 1).await.unwrap(), Err(ExceptionCode::IllegalDataAddress));

    let identity = slave.read_device_identification(ReadCode::Basic, 0).await.unwrap().unwrap();
    let objects: Vec<_> =
        identity.device_id_objects.iter().map(|object| (object.id, &object.value[..])).collect();
    assert_eq!(objects, [(0, &b"Telemecanique"[..]), (1, b"ATV31HU09M3S232"), (2, b"0201")]);
}

#[tokio::test(flavor = "multi_thread")]
async fn our_line_reads_and_writes_a_pymodbus_slave_in_modbus_ascii() {
    let Some(python) = peers::python_with("pymodbus") else { return };
    let cable = Cable::new();
    let _slave = Pymodbus::start(&python, &cable, "ascii").await;
    let config = LineConfig {
        protocol: Protocol::Ascii(AsciiSettings::default()),
        ..LineConfig::serial(cable.near(), SerialSettings::MODBUS_DEFAULT)
    };
    let line = Line::open(config).await.expect("it opens");
    let mut slave = Context::from(line.slave(3));

    assert_eq!(slave.read_holding_registers(3201, 4).await.unwrap().unwrap(), [0x0227, 500, 480, 12]);
    slave.write_single_register(3202, 250).await.unwrap().unwrap();
    slave.write_multiple_registers(3203, &[7, 8]).await.unwrap().unwrap();
    assert_eq!(slave.read_holding_registers(3201, 4).await.unwrap().unwrap(), [0x0227, 250, 7, 8]);
    assert_eq!(slave.read_holding_registers(9000, 1).await.unwrap(), Err(ExceptionCode::IllegalDataAddress));
}

/// pymodbus as slave 3 at the far end of a cable; it ends with this value.
struct Pymodbus {
    _child: Child,
}

impl Pymodbus {
    async fn start(python: &PathBuf, cable: &Cable, framer: &str) -> Self {
        let mut child = Command::new(python)
            .arg(peers::script("pymodbus_slave.py"))
            .arg(cable.far())
            .args(["3", framer, "3201", "551", "500", "480", "12"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .expect("the peer can be run");
        let stdout = child.stdout.take().expect("it is piped");
        let line = BufReader::new(stdout).lines().next_line().await.expect("it speaks");
        assert_eq!(line.as_deref(), Some("serving"));
        Self { _child: child }
    }
}
