//! The file: blocks of pcapng, and in each packet the tags that name its dissector.

use std::{
    io::{self, Write},
    time::Duration,
};

use bytes::{Bytes, BytesMut};

use super::{Captured, Direction, Dissector};

const SECTION_HEADER: u32 = 0x0A0D_0D0A;
const INTERFACE: u32 = 1;
const ENHANCED_PACKET: u32 = 6;
const BYTE_ORDER: u32 = 0x1A2B_3C4D;
const UPPER_PDU: u16 = 252;
const TAG_PROTOCOL: u16 = 12;
const OPTION_DESCRIPTION: u16 = 3;
const OPTION_RESOLUTION: u16 = 9;
const OPTION_FLAGS: u16 = 2;

/// How the description of a line that was only listened to begins; microseconds follow.
const LISTENED: &str = "listened to; late by at most, in us: ";

/// The longest block that is read: more than any frame with its tags.
const MAX_BLOCK: usize = 65_536;

/// Writes a capture.
#[derive(Debug)]
pub struct Writer<W> {
    sink: W,
    dissector: Dissector,
}

impl<W: Write> Writer<W> {
    /// Begins a capture of what a master has sent and received.
    ///
    /// # Errors
    /// The sink's.
    pub fn new(sink: W, dissector: Dissector) -> io::Result<Self> {
        Self::begin(sink, dissector, "")
    }

    /// Begins a capture of a line that is only listened to, where each frame is handed over up to `late` after it was on the
    /// line.
    ///
    /// # Errors
    /// The sink's.
    pub fn of_listener(sink: W, dissector: Dissector, late: Duration) -> io::Result<Self> {
        Self::begin(sink, dissector, &format!("{LISTENED}{}", late.as_micros()))
    }

    fn begin(mut sink: W, dissector: Dissector, description: &str) -> io::Result<Self> {
        let mut section = BYTE_ORDER.to_le_bytes().to_vec();
        section.extend([1, 0, 0, 0]); // version 1.0
        section.extend([0xFF; 8]); // length unknown
        write_block(&mut sink, SECTION_HEADER, &section)?;
        let mut interface = u32::from(UPPER_PDU).to_le_bytes().to_vec();
        interface.extend([0; 4]); // no limit of length
        if !description.is_empty() {
            put_option(&mut interface, OPTION_DESCRIPTION, description.as_bytes());
        }
        put_option(&mut interface, OPTION_RESOLUTION, &[9]); // nanoseconds
        put_option(&mut interface, 0, &[]);
        write_block(&mut sink, INTERFACE, &interface)?;
        Ok(Self { sink, dissector })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// The sink's.
    pub fn write(&mut self, frame: &Captured) -> io::Result<()> {
        let mut packet = Vec::with_capacity(frame.bytes.len() + 16);
        put_tag(&mut packet, TAG_PROTOCOL, self.dissector.name());
        put_tag(&mut packet, 0, &[]);
        packet.extend_from_slice(&frame.bytes);

        let nanos = u64::try_from(frame.at.as_nanos()).unwrap_or(u64::MAX);
        let len = u32::try_from(packet.len()).map_err(io::Error::other)?;
        let mut block = vec![0; 4]; // interface 0
        block.extend(((nanos >> 32) as u32).to_le_bytes());
        block.extend((nanos as u32).to_le_bytes());
        block.extend(len.to_le_bytes());
        block.extend(len.to_le_bytes());
        block.extend_from_slice(&packet);
        pad(&mut block);
        let flags: u32 = match frame.direction {
            Direction::Unknown => 0,
            Direction::Received => 1,
            Direction::Sent => 2,
        };
        put_option(&mut block, OPTION_FLAGS, &flags.to_le_bytes());
        put_option(&mut block, 0, &[]);
        write_block(&mut self.sink, ENHANCED_PACKET, &block)
    }

    /// Writes out what the sink holds back.
    ///
    /// # Errors
    /// The sink's.
    pub fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }
}

fn write_block(sink: &mut impl Write, kind: u32, body: &[u8]) -> io::Result<()> {
    let len = u32::try_from(body.len() + 12).map_err(io::Error::other)?.to_le_bytes();
    let block = [&kind.to_le_bytes()[..], &len, body, &len].concat();
    sink.write_all(&block)
}

fn put_option(block: &mut Vec<u8>, code: u16, value: &[u8]) {
    block.extend(code.to_le_bytes());
    block.extend((value.len() as u16).to_le_bytes());
    block.extend_from_slice(value);
    pad(block);
}

/// A tag of an exported PDU: big-endian, its value padded to four bytes with the padding counted.
fn put_tag(packet: &mut Vec<u8>, tag: u16, value: &[u8]) {
    let padded = value.len().next_multiple_of(4);
    packet.extend(tag.to_be_bytes());
    packet.extend((padded as u16).to_be_bytes());
    packet.extend_from_slice(value);
    packet.resize(packet.len() + padded - value.len(), 0);
}

fn pad(block: &mut Vec<u8>) {
    block.resize(block.len().next_multiple_of(4), 0);
}

/// A file that is no capture of ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// It does not begin as a pcapng file of this byte order does.
    #[error("not a little-endian pcapng file")]
    NotPcapng,
    /// A block is cut off or its length makes no sense.
    #[error("broken block at byte {0}")]
    Broken(usize),
}

/// A capture that was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recording {
    /// What its line spoke; [`Dissector::Data`] where no frame says.
    pub dissector: Dissector,
    /// How late each frame was handed over at the most, where the line was only listened to.
    pub late: Option<Duration>,
    /// Its frames, in their order.
    pub frames: Vec<Captured>,
}

/// Reads a capture that [`Writer`] wrote. Blocks of other kinds are passed over.
///
/// # Errors
/// [`ReadError`] when it is none.
pub fn read(file: &[u8]) -> Result<Recording, ReadError> {
    let mut reader = Reader::default();
    reader.push(file);
    let mut frames = Vec::new();
    while let Some(frame) = reader.next_frame()? {
        frames.push(frame);
    }
    reader.finish()?;
    Ok(Recording { dissector: reader.dissector(), late: reader.late(), frames })
}

/// Reads a capture while it is still being written, piece by piece.
#[derive(Debug, Default)]
pub struct Reader {
    /// What makes no whole block yet.
    unread: BytesMut,
    /// How many bytes were read before.
    at: usize,
    dissector: Option<Dissector>,
    late: Option<Duration>,
}

impl Reader {
    /// Takes a piece of the file.
    pub fn push(&mut self, piece: &[u8]) {
        self.unread.extend_from_slice(piece);
    }

    /// The next frame; `None`: the file goes on.
    ///
    /// # Errors
    /// [`ReadError`] when it is no capture.
    pub fn next_frame(&mut self) -> Result<Option<Captured>, ReadError> {
        loop {
            if self.at == 0 && self.unread.len() >= 12 {
                let begins = word(&self.unread, 0) == Some(SECTION_HEADER);
                if !begins || word(&self.unread, 8) != Some(BYTE_ORDER) {
                    return Err(ReadError::NotPcapng);
                }
            }
            let (Some(kind), Some(len)) = (word(&self.unread, 0), word(&self.unread, 4)) else {
                return Ok(None);
            };
            let (len, broken) = (len as usize, ReadError::Broken(self.at));
            if !(12..=MAX_BLOCK).contains(&len) || len % 4 != 0 {
                return Err(broken);
            }
            if self.unread.len() < len {
                return Ok(None);
            }
            let block = self.unread.split_to(len);
            self.at += len;
            let body = block.get(8..len - 4).ok_or(broken)?;
            match kind {
                INTERFACE => self.late = late_of(body),
                ENHANCED_PACKET => {
                    let (frame, spoken) = read_packet(body).ok_or(broken)?;
                    self.dissector = spoken.or(self.dissector);
                    return Ok(Some(frame));
                }
                _ => {}
            }
        }
    }

    /// The file has ended.
    ///
    /// # Errors
    /// [`ReadError`] when it ends inside a block.
    pub fn finish(&self) -> Result<(), ReadError> {
        match (self.at, self.unread.is_empty()) {
            (0, _) => Err(ReadError::NotPcapng),
            (_, true) => Ok(()),
            (at, false) => Err(ReadError::Broken(at)),
        }
    }

    /// As [`Recording::dissector`], of what was read so far.
    #[must_use]
    pub fn dissector(&self) -> Dissector {
        self.dissector.unwrap_or(Dissector::Data)
    }

    /// As [`Recording::late`].
    #[must_use]
    pub const fn late(&self) -> Option<Duration> {
        self.late
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// What the description of an interface says of a line that was only listened to.
fn late_of(interface: &[u8]) -> Option<Duration> {
    let mut options = interface.get(8..)?;
    loop {
        let (head, rest) = options.split_first_chunk::<4>()?;
        let [code, len] = [[head[0], head[1]], [head[2], head[3]]].map(u16::from_le_bytes);
        let (value, rest) = rest.split_at_checked(usize::from(len).next_multiple_of(4))?;
        if code == OPTION_DESCRIPTION {
            let text = std::str::from_utf8(value.get(..usize::from(len))?).ok()?;
            return text.strip_prefix(LISTENED)?.parse().ok().map(Duration::from_micros);
        }
        options = rest;
    }
}

/// A frame, and what the packet says that it speaks.
fn read_packet(body: &[u8]) -> Option<(Captured, Option<Dissector>)> {
    let word = |at: usize| word(body, at);
    let nanos = u64::from(word(4)?) << 32 | u64::from(word(8)?);
    let len = word(12)? as usize;
    let mut packet = body.get(20..20 + len)?;
    let mut spoken = None;
    loop {
        let (tag, rest) = packet.split_first_chunk::<2>()?;
        let (len, rest) = rest.split_first_chunk::<2>()?;
        let (value, rest) = rest.split_at_checked(usize::from(u16::from_be_bytes(*len)))?;
        packet = rest;
        match u16::from_be_bytes(*tag) {
            0 => break,
            TAG_PROTOCOL => spoken = Dissector::named(value),
            _ => {}
        }
    }
    let options = 20 + len.next_multiple_of(4);
    let has_flags = word(options) == Some(u32::from(OPTION_FLAGS) | 4 << 16);
    let direction = match word(options + 4).filter(|_| has_flags).map(|flags| flags & 3) {
        Some(1) => Direction::Received,
        Some(2) => Direction::Sent,
        _ => Direction::Unknown,
    };
    let frame =
        Captured { at: Duration::from_nanos(nanos), direction, bytes: Bytes::copy_from_slice(packet) };
    Some((frame, spoken))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames() -> Vec<Captured> {
        let frame = |millis, direction, bytes: &'static [u8]| Captured {
            at: Duration::from_millis(millis),
            direction,
            bytes: Bytes::from_static(bytes),
        };
        vec![
            frame(1_700_000_000_000, Direction::Sent, &[1, 3, 0, 0, 0, 1, 0x84, 0x0A]),
            frame(1_700_000_000_020, Direction::Received, &[1, 3, 2, 0, 7, 0xF8, 0x46]),
            frame(1_700_000_000_025, Direction::Unknown, &[]),
        ]
    }

    fn file() -> Vec<u8> {
        let mut file = Vec::new();
        let mut writer = Writer::new(&mut file, Dissector::Rtu).unwrap();
        for frame in frames() {
            writer.write(&frame).unwrap();
        }
        file
    }

    #[test]
    fn what_is_written_is_read_back() {
        let read = read(&file()).unwrap();
        assert_eq!((read.dissector, read.frames), (Dissector::Rtu, frames()));
    }

    #[test]
    fn a_file_is_read_while_it_is_written_and_says_how_late_a_listener_was() {
        let mut file = Vec::new();
        let late = Duration::from_micros(5_200);
        let mut writer = Writer::of_listener(&mut file, Dissector::Data, late).unwrap();
        for frame in frames() {
            writer.write(&frame).unwrap();
        }
        let (mut reader, mut read) = (Reader::default(), Vec::new());
        for byte in file {
            assert!(reader.finish().is_err() || reader.unread.is_empty());
            reader.push(&[byte]);
            read.extend(reader.next_frame().unwrap());
        }
        assert_eq!((read, reader.finish()), (frames(), Ok(())));
        assert_eq!((reader.dissector(), reader.late()), (Dissector::Data, Some(late)));
    }

    #[test]
    fn a_broken_file_is_an_error_and_never_a_panic() {
        let file = file();
        assert_eq!(read(&[]), Err(ReadError::NotPcapng));
        for cut in 1..file.len() {
            let _ = read(&file[..cut]);
        }
        for at in 0..file.len() {
            for value in [0, 1, 0x7F, 0xFF] {
                let mut broken = file.clone();
                broken[at] = value;
                let _ = read(&broken);
            }
        }
    }
}
