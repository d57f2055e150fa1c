//! A serial port.

use std::{io, path::Path};

use drive_core::serial::Parity;
use tokio_serial::{DataBits, ErrorKind, FlowControl, SerialPortBuilderExt, StopBits};

use super::{BoxedStream, OpenError};
use crate::config::{Endpoint, LineConfig};

/// Opens the port exclusively.
///
/// Nothing here or later ever flushes it: `tcdrain` would block the runtime's thread for as long as the frame is on the
/// line. The end of a transmission is computed instead.
pub(super) fn open(config: &LineConfig) -> Result<BoxedStream, OpenError> {
    let Endpoint::Serial(path) = &config.endpoint else { return Err(OpenError::NoPort) };
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
