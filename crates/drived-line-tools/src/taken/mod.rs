//! Frames as somebody has taken them down: a capture of this program or of another, a log, hex in any dress, or bytes as they were.
//! Pure: bytes in, frames out. Whatever comes, it is looked at and never trusted.

mod own;
#[cfg(feature = "captures")]
mod packets;
mod stream;
mod text;

use std::time::Duration;

use drive_bus::capture::{Captured, Dissector};

/// Frames that were taken down.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Taken {
    /// What the line spoke.
    pub(super) dissector: Dissector,
    /// How late each frame was handed over at the most, where the line was only listened to.
    pub(super) late: Option<Duration>,
    /// Whether the times of the frames were taken down with them.
    pub(super) has_times: bool,
    pub(super) frames: Vec<Captured>,
    /// What is to be known of them besides: that the file is cut off, that something in it is no frame.
    pub(super) notes: Vec<String>,
}

/// How captures begin: pcapng, then pcap in its two byte orders and two resolutions.
const PCAPNG: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];
const PCAP: [[u8; 4]; 4] =
    [[0xA1, 0xB2, 0xC3, 0xD4], [0xD4, 0xC3, 0xB2, 0xA1], [0xA1, 0xB2, 0x3C, 0x4D], [0x4D, 0x3C, 0xB2, 0xA1]];

/// The frames in these bytes; without a check, each line of a text is address and PDU alone.
///
/// # Errors
/// Why there are none.
pub(super) fn read(bytes: &[u8], without_check: bool) -> Result<Taken, String> {
    let taken = if bytes.starts_with(&PCAPNG) || PCAP.iter().any(|first| bytes.starts_with(first)) {
        own::read(bytes).map_or_else(|| of_others(bytes), Ok)?
    } else if let Ok(text) = std::str::from_utf8(bytes)
        && !text.contains('\0')
    {
        text::read(text, without_check)
    } else {
        stream::read(bytes)
    };
    match taken.frames.is_empty() {
        true => Err(taken.notes.into_iter().next().unwrap_or_else(|| NOTHING.to_owned())),
        false => Ok(taken),
    }
}

#[cfg(feature = "captures")]
fn of_others(file: &[u8]) -> Result<Taken, String> {
    packets::read(file)
}

#[cfg(not(feature = "captures"))]
fn of_others(_: &[u8]) -> Result<Taken, String> {
    Err("this program was built without the captures of others: cargo build --bin drived builds them in"
        .to_owned())
}

const NOTHING: &str = "nothing in it looks like a frame: expected a capture (pcapng, pcap), or bytes in hexadecimal such as \
    01 03 0C 81 00 01 D7 72";

#[cfg(test)]
mod tests;
