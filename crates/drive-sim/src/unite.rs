//! UNI-TE requests of a slave, mapped to the registers of its model (VVDED397054 p. 11–13). Words are little-endian.

use crate::{
    model::{Block, Cast, Exception, Model, UniTe},
    pdu::{self, word_of},
};

/// The answer to what is not understood or not permitted.
pub(crate) const REFUSED: &[u8] = &[0xFD];
const DONE: &[u8] = &[0xFE];
/// Segment of internal words and type of a 16-bit word: the only objects there are.
const WORDS: [u8; 2] = [0x68, 0x07];
const WORD_TYPE: u8 = 0x07;
/// Categories run from 0 to this.
const CATEGORIES: u8 = 7;
/// Where a counter of the link stops.
const COUNTER_END: u16 = 0x7FFF;

/// The four error counters of a slave's link, in the order in which request A2h reads them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct LinkCounters {
    pub(crate) sent_not_acknowledged: u16,
    pub(crate) sent_refused: u16,
    pub(crate) received_not_acknowledged: u16,
    pub(crate) received_refused: u16,
}

impl LinkCounters {
    pub(crate) const fn count(counter: &mut u16) {
        if *counter < COUNTER_END {
            *counter += 1;
        }
    }
}

/// Answers one request, from its code on, without the network header.
pub(crate) fn answer(model: &mut dyn Model, request: &[u8], counters: &mut LinkCounters) -> Vec<u8> {
    let Some(unite) = model.unite() else { return REFUSED.to_vec() };
    let answered = match *request {
        [_, category, ..] if category > CATEGORIES => None,
        [0x0F, _] => Some(identification(unite)),
        // What else the answer to the protocol version holds is not known.
        [0x30, _] => Some(vec![0x60]),
        [0xFA, _, ref data @ ..] => Some([&[0xFB], data].concat()),
        [0xA2, _] => Some(read_counters(*counters)),
        [0xA4, _] => {
            *counters = LinkCounters::default();
            Some(DONE.to_vec())
        }
        [0x04, _, a, b] => read(model, u16::from_le_bytes([a, b])).map(|word| with_words(&[0x34], &[word])),
        [0x14, _, a, b, c, d] => write(model, u16::from_le_bytes([a, b]), &[u16::from_le_bytes([c, d])]),
        [0x36, _, segment, kind, a, b, c, d] if [segment, kind] == WORDS => {
            read_objects(model, u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]))
        }
        [0x37, _, segment, kind, a, b, c, d, ref data @ ..] if [segment, kind] == WORDS => {
            let values = words(data);
            let quantity = usize::from(u16::from_le_bytes([c, d]));
            let fits = data.len() == quantity * 2
                && (1..=usize::from(model.rules().write_multiple)).contains(&quantity);
            fits.then(|| write(model, u16::from_le_bytes([a, b]), &values)).flatten()
        }
        [0xF2, _, 0, 0, ref data @ ..] => command(model, unite, &words(data)),
        _ => None,
    };
    answered.unwrap_or_else(|| REFUSED.to_vec())
}

fn identification(unite: UniTe) -> Vec<u8> {
    let length = u8::try_from(unite.name.len()).unwrap_or(u8::MAX);
    let mut answer = vec![0x3F];
    answer.extend(unite.product);
    answer.push(length);
    answer.extend(unite.name.bytes().take(usize::from(length)));
    answer
}

fn read_counters(counters: LinkCounters) -> Vec<u8> {
    let words = [
        counters.sent_not_acknowledged,
        counters.sent_refused,
        counters.received_not_acknowledged,
        counters.received_refused,
    ];
    with_words(&[0xD2], &words)
}

/// A word; 0 where there is none (p. 12).
fn read(model: &mut dyn Model, address: u16) -> Option<u16> {
    match model.read(address) {
        Ok(value) => Some(value),
        Err(Exception::ILLEGAL_ADDRESS) if model.peek(address).is_none() => Some(0),
        Err(_) => None,
    }
}

fn read_objects(model: &mut dyn Model, first: u16, quantity: u16) -> Option<Vec<u8>> {
    if quantity == 0 || quantity > model.rules().read_holding {
        return None;
    }
    let block = Block { function: 0x36, first, quantity };
    let words: Option<Vec<_>> = pdu::registers(block).ok()?.map(|address| read(model, address)).collect();
    Some(with_words(&[0x66, WORD_TYPE], &words?))
}

/// Writes words from an address on. What does not exist is passed over; it is done if at least one word is written
/// (p. 12). What the drive produces is refused (p. 10).
fn write(model: &mut dyn Model, first: u16, values: &[u16]) -> Option<Vec<u8>> {
    let block = Block { function: 0x37, first, quantity: u16::try_from(values.len()).ok()? };
    let mut written = false;
    for (address, value) in pdu::registers(block).ok()?.zip(values) {
        match model.write(address, *value, Cast::Unicast) {
            Ok(()) => written = true,
            Err(_) if model.peek(address).is_none() => {}
            Err(_) => return None,
        }
    }
    written.then(|| DONE.to_vec())
}

/// The specific request: orders and their answer in one exchange.
fn command(model: &mut dyn Model, unite: UniTe, values: &[u16]) -> Option<Vec<u8>> {
    if values.len() != unite.command.len() {
        return None;
    }
    // Ramps and reference before the command that uses them.
    for (address, value) in unite.command.into_iter().zip(values).rev() {
        model.write(address, *value, Cast::Unicast).ok()?;
    }
    let report: Option<Vec<_>> = unite.report.into_iter().map(|address| read(model, address)).collect();
    Some(with_words(&[0xF2, 0x30, 0x00], &report?))
}

fn words(data: &[u8]) -> Vec<u16> {
    // A byte that is left over makes a word too many, so that its request has the wrong number of parameters.
    data.chunks(2).map(|word| word_of(word, u16::from_le_bytes)).collect()
}

fn with_words(head: &[u8], words: &[u16]) -> Vec<u8> {
    let mut bytes = head.to_vec();
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    bytes
}
