//! Captures of other programs: pcapng and classic pcap, of Wireshark, of tcpdump at a gateway. One that is cut off is read as far as it
//! is whole.

use std::{collections::BTreeMap, time::Duration};

use bytes::Bytes;
use drive_bus::{
    capture::{Captured, Direction, Dissector},
    content::Content,
};
use etherparse::{NetSlice, SlicedPacket, TransportSlice};
use pcap_parser::{
    Block, LegacyPcapReader, Linktype, PcapBlockOwned, PcapError, PcapNGReader, traits::PcapReaderIterator,
};

use super::{Taken, own::CUT};

/// The largest packet or block that is read.
const LARGEST: usize = 1 << 18;

/// The port of Modbus TCP.
const MODBUS: u16 = 502;

/// More than this of one connection waits for no header that makes sense.
const UNREAD: usize = 4_096;

/// The frames of a capture.
pub(super) fn read(file: &[u8]) -> Result<Taken, String> {
    let mut packets = Packets::default();
    let cut =
        if file.starts_with(&super::PCAPNG) { pcapng(file, &mut packets) } else { pcap(file, &mut packets) };
    packets.finish(cut)
}

/// Reads the packets of a pcapng file; says whether it is cut off.
fn pcapng(file: &[u8], packets: &mut Packets) -> bool {
    let Ok(mut reader) = PcapNGReader::new(LARGEST, file) else { return true };
    // Link type, and units of a second, of each interface.
    let mut interfaces: Vec<(Linktype, u64, i64)> = Vec::new();
    each(&mut reader, |block| match block {
        PcapBlockOwned::NG(Block::SectionHeader(_)) => interfaces.clear(),
        PcapBlockOwned::NG(Block::InterfaceDescription(interface)) => {
            let units = interface.ts_resolution().filter(|units| *units > 0).unwrap_or(1_000_000);
            interfaces.push((interface.linktype, units, interface.if_tsoffset));
        }
        PcapBlockOwned::NG(Block::EnhancedPacket(packet)) => {
            let Some(&(link, units, offset)) = interfaces.get(packet.if_id as usize) else { return };
            let ticks = u64::from(packet.ts_high) << 32 | u64::from(packet.ts_low);
            let nanos = u128::from(ticks % units) * 1_000_000_000 / u128::from(units);
            let seconds = (ticks / units).saturating_add_signed(offset);
            let at = Duration::new(seconds, u32::try_from(nanos).unwrap_or_default());
            let data = packet.data.get(..packet.caplen as usize).unwrap_or(packet.data);
            packets.packet(link, at, data);
        }
        PcapBlockOwned::NG(Block::SimplePacket(packet)) => {
            if let Some(&(link, ..)) = interfaces.first() {
                packets.packet(link, Duration::ZERO, packet.data);
            }
        }
        _ => {}
    })
}

/// The same of a classic one.
fn pcap(file: &[u8], packets: &mut Packets) -> bool {
    let Ok(mut reader) = LegacyPcapReader::new(LARGEST, file) else { return true };
    let (mut link, mut is_nano) = (Linktype::NULL, false);
    each(&mut reader, |block| match block {
        PcapBlockOwned::LegacyHeader(header) => {
            link = header.network;
            is_nano = header.is_nanosecond_precision();
        }
        PcapBlockOwned::Legacy(packet) => {
            let fraction = if is_nano { packet.ts_usec } else { packet.ts_usec.saturating_mul(1_000) };
            let at = Duration::from_secs(packet.ts_sec.into()) + Duration::from_nanos(fraction.into());
            packets.packet(link, at, packet.data);
        }
        _ => {}
    })
}

/// Hands each block over; says whether the file ends inside one, or makes no sense from there.
fn each(reader: &mut dyn PcapReaderIterator, mut take: impl FnMut(PcapBlockOwned<'_>)) -> bool {
    loop {
        match reader.next() {
            Ok((length, block)) => {
                take(block);
                reader.consume(length);
            }
            Err(PcapError::Eof) => return false,
            Err(PcapError::Incomplete(_)) => {
                if reader.reader_exhausted() || reader.refill().is_err() {
                    return true;
                }
            }
            Err(_) => return true,
        }
    }
}

/// One way of a connection: address and port of who sends, and of whom it is for.
type Way = (Vec<u8>, u16, Vec<u8>, u16);

/// What is made of packets.
#[derive(Default)]
struct Packets {
    rtu: Vec<Captured>,
    tcp: Vec<Captured>,
    other: Vec<Captured>,
    /// Of each connection and way: the next number of a byte, and what makes no frame yet.
    streams: BTreeMap<Way, (u32, Vec<u8>)>,
    /// Packets in which no frame was found.
    passed_over: usize,
}

impl Packets {
    fn packet(&mut self, link: Linktype, at: Duration, data: &[u8]) {
        let sliced = match link {
            // Exported PDUs, which name their protocol.
            Linktype(252) => return self.exported(at, data),
            // A protocol of the user's: bytes of a serial line.
            Linktype(147..=162) => return self.bytes(at, data),
            Linktype::ETHERNET => SlicedPacket::from_ethernet(data).ok(),
            Linktype::LINUX_SLL => SlicedPacket::from_linux_sll(data).ok(),
            Linktype(276) => data.get(20..).and_then(|data| SlicedPacket::from_ip(data).ok()),
            // The loopback of BSD: four bytes of the address family.
            Linktype::NULL | Linktype::LOOP => {
                data.get(4..).and_then(|data| SlicedPacket::from_ip(data).ok())
            }
            Linktype(12 | 14 | 101 | 228 | 229) => SlicedPacket::from_ip(data).ok(),
            _ => None,
        };
        match sliced {
            Some(sliced) => self.network(at, &sliced),
            None => self.passed_over += 1,
        }
    }

    /// Tags, then the frame.
    fn exported(&mut self, at: Duration, mut data: &[u8]) {
        let mut protocol: &[u8] = b"";
        while let Some((head, rest)) = data.split_first_chunk::<4>() {
            let [tag, length] = [[head[0], head[1]], [head[2], head[3]]].map(u16::from_be_bytes);
            let Some((value, rest)) = rest.split_at_checked(length.into()) else { return };
            data = rest;
            match tag {
                0 => break,
                12 | 13 => protocol = value.split(|byte| *byte == 0).next().unwrap_or_default(),
                _ => {}
            }
        }
        let frame = Captured { at, direction: Direction::Unknown, bytes: Bytes::copy_from_slice(data) };
        match protocol {
            b"mbtcp" => self.tcp.push(frame),
            b"mbrtu" | b"modbus" => self.rtu.push(frame),
            _ => self.other.push(frame),
        }
    }

    fn bytes(&mut self, at: Duration, data: &[u8]) {
        self.rtu.push(Captured { at, direction: Direction::Unknown, bytes: Bytes::copy_from_slice(data) });
    }

    fn network(&mut self, at: Duration, packet: &SlicedPacket<'_>) {
        let Some(TransportSlice::Tcp(tcp)) = &packet.transport else {
            self.passed_over += 1;
            return;
        };
        let addresses = match &packet.net {
            Some(NetSlice::Ipv4(ip)) => (ip.header().source().to_vec(), ip.header().destination().to_vec()),
            Some(NetSlice::Ipv6(ip)) => (ip.header().source().to_vec(), ip.header().destination().to_vec()),
            _ => return,
        };
        let (from, to) = (tcp.source_port(), tcp.destination_port());
        // The server has the port of Modbus, else the lower one.
        let is_request = to == MODBUS || from != MODBUS && to < from;
        let direction = if is_request { Direction::Sent } else { Direction::Received };
        let payload = tcp.payload();
        let number = tcp.sequence_number();
        let (next, unread) =
            self.streams.entry((addresses.0, from, addresses.1, to)).or_insert_with(|| (number, Vec::new()));
        if payload.is_empty() {
            if tcp.syn() {
                *next = number.wrapping_add(1);
            }
            return;
        }
        // What is sent once more was told before.
        let behind = number.wrapping_sub(*next).cast_signed();
        let known = usize::try_from(behind.min(0).unsigned_abs()).unwrap_or(usize::MAX);
        let Some(new) = payload.get(known..).filter(|new| !new.is_empty()) else { return };
        if behind > 0 {
            unread.clear();
        }
        *next = number.wrapping_add(u32::try_from(payload.len()).unwrap_or_default());
        unread.extend_from_slice(new);
        while let Some(length) = whole(unread) {
            let bytes = Bytes::from(unread.drain(..length).collect::<Vec<u8>>());
            let frame = Captured { at, direction, bytes };
            match Content::of(Dissector::Tcp, &frame.bytes) {
                Ok(_) => self.tcp.push(frame),
                Err(_) => self.rtu.push(frame),
            }
        }
        if unread.len() > UNREAD {
            unread.clear();
        }
    }

    fn finish(self, is_cut: bool) -> Result<Taken, String> {
        let Self { rtu, tcp, other, passed_over, .. } = self;
        let mut notes = Vec::new();
        if is_cut {
            notes.push(CUT.to_owned());
        }
        let mut kinds = [(Dissector::Rtu, rtu), (Dissector::Tcp, tcp), (Dissector::Data, other)];
        kinds.sort_by_key(|(_, frames)| std::cmp::Reverse(frames.len()));
        let [(dissector, mut frames), others @ ..] = kinds;
        let left: usize = others.iter().map(|(_, frames)| frames.len()).sum();
        if left > 0 {
            notes.push(format!("{left} frames of another protocol in it are not told"));
        }
        if passed_over > 0 {
            notes.push(format!("{passed_over} packets in it are no Modbus"));
        }
        if frames.is_empty() {
            let why = "it is a capture, and no packet of it carries Modbus".to_owned();
            return Err(if is_cut { format!("{why}; {CUT}") } else { why });
        }
        if frames.iter().all(|frame| frame.direction == Direction::Unknown) {
            directions(dissector, &mut frames);
        }
        Ok(Taken { dissector, late: None, has_times: true, frames, notes })
    }
}

/// The length of the first whole frame of a connection: of Modbus TCP by its header, of RTU by its check.
fn whole(unread: &[u8]) -> Option<usize> {
    if let [_, _, 0, 0, high, low, ..] = *unread {
        let length = 6 + usize::from(u16::from_be_bytes([high, low]));
        if (8..=260).contains(&length) {
            return (unread.len() >= length).then_some(length);
        }
    }
    (4..=unread.len().min(256)).find(|length| drive_bus::exchange::rtu::is_frame(&unread[..*length]))
}

/// Who sent which frame, where the capture does not say: by their forms, and of Modbus TCP by its numbers.
fn directions(dissector: Dissector, frames: &mut [Captured]) {
    match dissector {
        Dissector::Rtu => super::stream::directions(frames),
        Dissector::Tcp => {
            let mut open: BTreeMap<[u8; 2], u8> = BTreeMap::new();
            for frame in frames {
                let Some((number, unit)) =
                    frame.bytes.first_chunk().copied().zip(frame.bytes.get(6).copied())
                else {
                    continue;
                };
                frame.direction = match open.remove(&number) {
                    Some(asked) if asked == unit => Direction::Received,
                    _ => {
                        open.insert(number, unit);
                        Direction::Sent
                    }
                };
            }
        }
        Dissector::Data => {}
    }
}
