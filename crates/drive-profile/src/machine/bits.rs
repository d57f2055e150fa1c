//! Coils, inputs and input registers of a simulated drive: Modbus Application Protocol V1.1b3, sections 6.1, 6.2, 6.4, 6.5, 6.11 and 6.17.

use drive_sim::Exception;

use crate::{format::Space, written::Written};

/// A drive by its places, whatever they are: coils, inputs, registers.
pub(super) trait Places {
    fn has_function(&self, function: u8) -> bool;
    /// Coils or inputs that one read may ask for, and coils that one write may carry.
    fn most_bits(&self) -> (u16, u16);
    fn most_words(&self) -> u16;
    fn most_written(&self) -> u16;
    fn read_at(&self, place: (Space, u16)) -> Result<u16, Exception>;
    fn takes(&self, place: (Space, u16)) -> Result<(), Exception>;
    fn write_at(&mut self, written: Written) -> Result<(), Exception>;
}

const READ_COILS: u8 = 0x01;
const READ_INPUTS: u8 = 0x02;
const READ_INPUT_REGISTERS: u8 = 0x04;
const WRITE_COIL: u8 = 0x05;
const WRITE_COILS: u8 = 0x0F;
const READ_WRITE: u8 = 0x17;

/// What a coil is written to with, on and off.
const ON: u16 = 0xFF00;
const OFF: u16 = 0;

/// What it answers to a function that is none of its holding registers.
pub(super) fn answer(machine: &mut dyn Places, request: &[u8]) -> Result<Vec<u8>, Exception> {
    let has = request.first().is_some_and(|function| machine.has_function(*function));
    match *request {
        _ if !has => Err(Exception::ILLEGAL_FUNCTION),
        [function @ (READ_COILS | READ_INPUTS), a, b, c, d] => {
            let (first, count) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            let space = if function == READ_COILS { Space::Coil } else { Space::DiscreteInput };
            read_bits(machine, function, space, first, count)
        }
        [READ_INPUT_REGISTERS, a, b, c, d] => {
            let (first, count) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            read_words(machine, READ_INPUT_REGISTERS, Space::InputRegister, first, count)
        }
        // The write comes before the read.
        [READ_WRITE, a, b, c, d, e, f, g, h, bytes, ref data @ ..] => {
            let (from, count) = (u16::from_be_bytes([e, f]), u16::from_be_bytes([g, h]));
            write_words(machine, from, count, usize::from(bytes), data)?;
            let (first, count) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            read_words(machine, READ_WRITE, Space::HoldingRegister, first, count)
        }
        [WRITE_COIL, a, b, c, d] => {
            let value = match u16::from_be_bytes([c, d]) {
                ON => 1,
                OFF => 0,
                _ => return Err(Exception::ILLEGAL_VALUE),
            };
            let address = u16::from_be_bytes([a, b]);
            machine.write_at(Written { space: Space::Coil, address, value })?;
            Ok(request.to_vec())
        }
        [WRITE_COILS, a, b, c, d, bytes, ref data @ ..] => {
            let (first, count) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            write_bits(machine, first, count, usize::from(bytes), data)?;
            Ok(vec![WRITE_COILS, a, b, c, d])
        }
        _ => Err(Exception::ILLEGAL_FUNCTION),
    }
}

fn read_bits(
    machine: &dyn Places,
    function: u8,
    space: Space,
    first: u16,
    count: u16,
) -> Result<Vec<u8>, Exception> {
    let places = places(space, first, count, machine.most_bits().0)?;
    let bytes = u8::try_from(count.div_ceil(8)).map_err(|_| Exception::ILLEGAL_VALUE)?;
    // A drive has more bits than its profile names, and reads those between as 0 (Hitachi WJ-C1 11-2-2).
    let bits: Vec<_> = places.into_iter().map(|place| machine.read_at(place)).collect();
    if bits.iter().all(Result::is_err) {
        return Err(Exception::ILLEGAL_ADDRESS);
    }
    let packed = bits.chunks(8).map(|bits| {
        let on = bits.iter().map(|bit| u8::from(matches!(bit, Ok(held) if *held != 0)));
        on.zip(0..).fold(0, |byte, (on, at)| byte | on << at)
    });
    Ok([function, bytes].into_iter().chain(packed).collect())
}

fn read_words(
    machine: &dyn Places,
    function: u8,
    space: Space,
    first: u16,
    count: u16,
) -> Result<Vec<u8>, Exception> {
    let places = places(space, first, count, machine.most_words())?;
    let bytes = u8::try_from(2 * count).map_err(|_| Exception::ILLEGAL_VALUE)?;
    let mut answer = vec![function, bytes];
    for place in places {
        answer.extend(machine.read_at(place)?.to_be_bytes());
    }
    Ok(answer)
}

fn write_words(
    machine: &mut dyn Places,
    first: u16,
    count: u16,
    bytes: usize,
    data: &[u8],
) -> Result<(), Exception> {
    let places = places(Space::HoldingRegister, first, count, machine.most_written())?;
    if bytes != usize::from(count) * 2 || data.len() != bytes {
        return Err(Exception::ILLEGAL_VALUE);
    }
    let words = data.chunks_exact(2).map(|word| u16::from_be_bytes(word.try_into().unwrap_or_default()));
    write(machine, places, words)
}

fn write_bits(
    machine: &mut dyn Places,
    first: u16,
    count: u16,
    bytes: usize,
    data: &[u8],
) -> Result<(), Exception> {
    let places = places(Space::Coil, first, count, machine.most_bits().1)?;
    if bytes != usize::from(count.div_ceil(8)) || data.len() != bytes {
        return Err(Exception::ILLEGAL_VALUE);
    }
    let coils = data.iter().flat_map(|byte| (0..8).map(move |at| u16::from(byte >> at & 1)));
    write(machine, places, coils)
}

/// So many places in a row, of the most that a request may have.
fn places(space: Space, first: u16, count: u16, most: u16) -> Result<Vec<(Space, u16)>, Exception> {
    if count == 0 || count > most {
        return Err(Exception::ILLEGAL_VALUE);
    }
    let all = (0..count).map(|at| Some((space, first.checked_add(at)?)));
    all.collect::<Option<_>>().ok_or(Exception::ILLEGAL_ADDRESS)
}

/// All of them, or none where one of them cannot be written.
fn write(
    machine: &mut dyn Places,
    places: Vec<(Space, u16)>,
    values: impl Iterator<Item = u16>,
) -> Result<(), Exception> {
    places.iter().try_for_each(|place| machine.takes(*place))?;
    let mut all = places.into_iter().zip(values);
    all.try_for_each(|((space, address), value)| machine.write_at(Written { space, address, value }))
}
