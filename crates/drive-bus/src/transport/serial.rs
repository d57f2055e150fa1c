//! A serial port.

use std::{
    io,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use drive_core::serial::Parity;
use tokio_serial::{DataBits, ErrorKind, FlowControl, SerialPortBuilderExt, StopBits};

use super::{BoxedStream, OpenError, low_latency};
use crate::config::{Endpoint, LineConfig, Rs485};

/// The port of a line, to be opened again and again.
#[derive(Debug, Clone)]
pub(crate) struct SerialPort {
    config: Box<LineConfig>,
    /// Whether it was said of this port before that its adapter holds answers back.
    warned: Arc<AtomicBool>,
}

impl SerialPort {
    pub(super) fn new(config: LineConfig) -> Self {
        Self { config: Box::new(config), warned: Arc::default() }
    }

    /// Opens the port exclusively.
    ///
    /// Nothing here or later ever flushes it: `tcdrain` would block the runtime's thread for as long as the frame is on
    /// the line. The end of a transmission is computed instead.
    pub(super) fn open(&self) -> Result<BoxedStream, OpenError> {
        let Self { config, warned } = self;
        let Endpoint::Serial(path) = &config.endpoint else { return Err(OpenError::NoPort) };
        if let Some(rs485) = config.rs485 {
            // Before the port is opened for good: the mode stays with the port, and afterwards it is ours alone.
            set_rs485(path, rs485).map_err(|reason| OpenError::Rs485 { path: path.clone(), reason })?;
        }
        let format = config.serial.format();
        let builder = tokio_serial::new(path.to_string_lossy(), config.serial.baud())
            .data_bits(if format.data_bits() == 7 { DataBits::Seven } else { DataBits::Eight })
            .parity(match format.parity() {
                Parity::None => tokio_serial::Parity::None,
                Parity::Even => tokio_serial::Parity::Even,
                Parity::Odd => tokio_serial::Parity::Odd,
            })
            .stop_bits(if format.stop_bits() == 2 { StopBits::Two } else { StopBits::One })
            .flow_control(FlowControl::None);
        let stream = builder.open_native_async().map_err(|error| describe(path, &error))?;
        if config.low_latency
            && let Some(latency) = low_latency::lower(&stream, path)
            && !warned.swap(true, Ordering::Relaxed)
        {
            tracing::warn!(
                port = %path.display(),
                ?latency,
                "the adapter holds answers back and its latency cannot be lowered"
            );
        }
        Ok(Box::new(stream))
    }
}

#[cfg(target_os = "linux")]
fn set_rs485(path: &Path, rs485: Rs485) -> Result<(), String> {
    use serial2::{KeepSettings, rs4xx};

    let mut mode = rs4xx::Rs485Config::new();
    mode.set_full_duplex(rs485.receive_while_sending);
    mode.set_invert_rts(rs485.inverted);
    mode.set_delay_before_send(rs485.delay_before_send);
    mode.set_delay_after_send(rs485.delay_after_send);
    let port = serial2::SerialPort::open(path, KeepSettings).map_err(|error| error.to_string())?;
    port.set_rs4xx_mode(mode).map_err(|error| error.to_string())
}

#[cfg(not(target_os = "linux"))]
fn set_rs485(_: &Path, _: Rs485) -> Result<(), String> {
    Err("this system has no such mode".to_owned())
}

fn describe(path: &Path, error: &tokio_serial::Error) -> OpenError {
    let path = path.to_path_buf();
    if !path.exists() {
        return OpenError::NotFound { path };
    }
    let text = error.to_string();
    match error.kind() {
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => OpenError::Denied { path },
        ErrorKind::Io(io::ErrorKind::ResourceBusy | io::ErrorKind::WouldBlock) => OpenError::InUse { path },
        // The serial port library reports a port that is locked as one that is not there, with the reason in words.
        ErrorKind::NoDevice
            if text.to_lowercase().contains("busy") || text.to_lowercase().contains("lock") =>
        {
            OpenError::InUse { path }
        }
        _ => OpenError::Serial { path, reason: text },
    }
}
