//! What the tests of UNI-TELWAY share: its control characters, one read and one write, the characters.

use drive_core::serial::{CharacterFormat, SerialSettings};
use tokio_modbus::{Request, Response};

pub(crate) const ACK: &[u8] = &[0x06];
pub(crate) const NAK: &[u8] = &[0x15];
pub(crate) const EOT: &[u8] = &[0x04];
pub(crate) const READ: Request<'static> = Request::ReadHoldingRegisters(400, 1);
pub(crate) const WRITE: Request<'static> = Request::WriteSingleRegister(400, 6);
pub(crate) const WRITTEN: Response = Response::WriteSingleRegister(400, 6);

pub(crate) fn serial() -> SerialSettings {
    SerialSettings::new(19_200, CharacterFormat::F8O1).unwrap()
}
