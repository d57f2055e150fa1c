//! A serial port.

use std::{fs, io, path::Path, path::PathBuf, time::Duration};

use drive_core::serial::Parity;
use tokio_serial::{DataBits, ErrorKind, FlowControl, SerialPortBuilderExt, StopBits};

use super::{BoxedStream, OpenError};
use crate::config::{Endpoint, LineConfig, Rs485};

/// Opens the port exclusively.
///
/// Nothing here or later ever flushes it: `tcdrain` would block the runtime's thread for as long as the frame is on the
/// line. The end of a transmission is computed instead.
pub(super) fn open(config: &LineConfig) -> Result<BoxedStream, OpenError> {
    let Endpoint::Serial(path) = &config.endpoint else { return Err(OpenError::NoPort) };
    if let Some(rs485) = config.rs485 {
        // Before the port is opened for good: the mode stays with the port, and afterwards it is ours alone.
        set_rs485(path, rs485).map_err(|reason| OpenError::Rs485 { path: path.clone(), reason })?;
    }
    if config.low_latency {
        lower_latency(path);
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
    Ok(Box::new(stream))
}

#[cfg(target_os = "linux")]
fn set_rs485(path: &Path, rs485: Rs485) -> Result<(), String> {
    use serial2::{KeepSettings, SerialPort, rs4xx};

    let mut mode = rs4xx::Rs485Config::new();
    mode.set_full_duplex(rs485.receive_while_sending);
    mode.set_invert_rts(rs485.inverted);
    mode.set_delay_before_send(rs485.delay_before_send);
    mode.set_delay_after_send(rs485.delay_after_send);
    let port = SerialPort::open(path, KeepSettings).map_err(|error| error.to_string())?;
    port.set_rs4xx_mode(mode).map_err(|error| error.to_string())
}

#[cfg(not(target_os = "linux"))]
fn set_rs485(_: &Path, _: Rs485) -> Result<(), String> {
    Err("this system has no such mode".to_owned())
}

/// Where Linux keeps the latency timer of a USB serial adapter, in milliseconds.
fn latency_timer(path: &Path) -> Option<PathBuf> {
    // The path may be a link of udev's, /dev/serial/by-id/….
    let device = fs::canonicalize(path).ok()?;
    Some(Path::new("/sys/class/tty").join(device.file_name()?).join("device/latency_timer"))
}

/// How long the USB adapter at `path` holds back what it has received, as its driver reports it (FTDI `latency_timer`).
/// `None` where there is no such thing: no USB adapter, another driver, another system.
#[must_use]
pub fn adapter_latency(path: &Path) -> Option<Duration> {
    let millis = fs::read_to_string(latency_timer(path)?).ok()?;
    Some(Duration::from_millis(millis.trim().parse().ok()?))
}

/// Best effort: usually only root may write it, and a line works without, only slower.
fn lower_latency(path: &Path) {
    let is_long = |latency: &Duration| *latency > Duration::from_millis(1);
    let Some(latency) = adapter_latency(path).filter(is_long) else { return };
    let written = latency_timer(path).map(|timer| fs::write(timer, "1"));
    if !matches!(written, Some(Ok(()))) {
        tracing::warn!(
            port = %path.display(),
            ?latency,
            "the adapter holds answers back, and its latency_timer cannot be written"
        );
    }
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
