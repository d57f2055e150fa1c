//! The standard functions of a slave: from a request PDU to the answer's, by the rules of the model.

use crate::model::{Block, Cast, Exception, Model};

pub(crate) const READ_HOLDING: u8 = 0x03;
pub(crate) const READ_INPUT: u8 = 0x04;
pub(crate) const WRITE_COIL: u8 = 0x05;
pub(crate) const WRITE_SINGLE: u8 = 0x06;
pub(crate) const DIAGNOSTICS: u8 = 0x08;
pub(crate) const EVENT_COUNTER: u8 = 0x0B;
pub(crate) const WRITE_MULTIPLE: u8 = 0x10;
/// Set in the function code of an exception.
pub(crate) const EXCEPTION: u8 = 0x80;

/// Answers everything but the functions that the slave itself counts for (08 and 0Bh).
pub(crate) fn answer(model: &mut dyn Model, request: &[u8], cast: Cast) -> Result<Vec<u8>, Exception> {
    match *request {
        [function @ (READ_HOLDING | READ_INPUT), a, b, c, d]
            if function == READ_HOLDING || model.rules().read_input > 0 =>
        {
            let (first, quantity) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            read(model, Block { function, first, quantity })
        }
        [WRITE_SINGLE, a, b, c, d] if model.rules().write_single => {
            let (first, value) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            model.check_write(Block { function: WRITE_SINGLE, first, quantity: 1 }, &[value], cast)?;
            model.write(first, value, cast)?;
            Ok(request.to_vec())
        }
        [WRITE_MULTIPLE, a, b, c, d, bytes, ref data @ ..] if model.rules().write_multiple > 0 => {
            let (first, quantity) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            let block = Block { function: WRITE_MULTIPLE, first, quantity };
            write(model, block, usize::from(bytes), data, cast)?;
            Ok(vec![WRITE_MULTIPLE, a, b, c, d])
        }
        _ => model.other(request),
    }
}

fn read(model: &mut dyn Model, block: Block) -> Result<Vec<u8>, Exception> {
    let most = match block.function {
        READ_HOLDING => model.rules().read_holding,
        _ => model.rules().read_input,
    };
    if most == 0 {
        return Err(Exception::ILLEGAL_FUNCTION);
    }
    model.check_read(block)?;
    if block.quantity == 0 || block.quantity > most {
        return Err(Exception::ILLEGAL_VALUE);
    }
    let bytes = u8::try_from(block.quantity * 2).map_err(|_| Exception::ILLEGAL_VALUE)?;
    let mut answer = Vec::with_capacity(2 + usize::from(bytes));
    answer.extend([block.function, bytes]);
    for register in registers(block)? {
        answer.extend(model.read(register)?.to_be_bytes());
    }
    Ok(answer)
}

fn write(
    model: &mut dyn Model,
    block: Block,
    bytes: usize,
    data: &[u8],
    cast: Cast,
) -> Result<(), Exception> {
    let values: Vec<_> = data.chunks_exact(2).map(|word| word_of(word, u16::from_be_bytes)).collect();
    model.check_write(block, &values, cast)?;
    let fits = block.quantity <= model.rules().write_multiple && bytes == usize::from(block.quantity) * 2;
    if block.quantity == 0 || !fits || data.len() != bytes {
        return Err(Exception::ILLEGAL_VALUE);
    }
    let words: Vec<_> = registers(block)?.zip(values).collect();
    if words.len() > 1 {
        words.iter().try_for_each(|&(register, value)| model.check_word(register, value, cast))?;
    }
    words.into_iter().try_for_each(|(register, value)| model.write(register, value, cast))
}

/// Whether an answer repeats what the request named, so that a master can check it: single and multiple writes, and
/// the echo of function 08.
pub(crate) fn is_confirmation(answer: &[u8]) -> bool {
    matches!(answer, [WRITE_COIL | WRITE_SINGLE | DIAGNOSTICS | 0x0F | WRITE_MULTIPLE, ..])
}

/// The registers of a block, which may not run over the highest address.
pub(crate) fn registers(block: Block) -> Result<impl Iterator<Item = u16>, Exception> {
    let last = block.first.checked_add(block.quantity.saturating_sub(1)).ok_or(Exception::ILLEGAL_ADDRESS)?;
    Ok(block.first..=last)
}

/// A word from two bytes; 0 from any other number of them.
pub(crate) fn word_of(bytes: &[u8], order: fn([u8; 2]) -> u16) -> u16 {
    bytes.try_into().map_or(0, order)
}

/// The answer to function 2Bh/0Eh (read device identification) with these objects, numbered from 0.
///
/// `code` is the identification code of the request, `conformity` the level of the drive.
#[must_use]
pub fn identification(code: u8, conformity: u8, objects: &[&str]) -> Vec<u8> {
    let count = u8::try_from(objects.len()).unwrap_or(u8::MAX);
    let mut answer = vec![0x2B, 0x0E, code, conformity, 0x00, 0x00, count];
    for (id, object) in (0..count).zip(objects) {
        let length = u8::try_from(object.len()).unwrap_or(u8::MAX);
        answer.extend([id, length]);
        answer.extend(object.bytes().take(usize::from(length)));
    }
    answer
}
