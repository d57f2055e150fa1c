//! The values of one quantity as bytes ([`pack`]), times and counts by their differences, in a zlib stream.
//!
//! Anybody can read it: `zlib.decompress`, then pairs of LEB128 numbers, each zigzag: by how many milliseconds the step to
//! the next time differs from the step before, and by how much the count differs from the one before. A count that is not known is
//! written as the marker 0, any other as its difference zigzag and 1 more.

use std::cell::RefCell;

use flate2::{Compress, Compression, Decompress, FlushCompress, FlushDecompress, Status};

/// More bytes than this are none that were written here: a column holds an hour of one quantity.
const LONGEST: usize = 64 << 20;
/// So much room there is at the least for what was packed.
const ROOM: usize = 4_096;

thread_local! {
    /// One state for each thread that packs: to make one takes longer than to pack what a column holds.
    static PACKS: RefCell<Compress> = RefCell::new(Compress::new(Compression::default(), true));
    static UNPACKS: RefCell<Decompress> = RefCell::new(Decompress::new(true));
}

/// What was known of a quantity from one moment on: a count in the quantity's own steps; `None`: nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Point {
    /// Milliseconds, of whichever clock the column's owner says.
    pub at: i64,
    pub count: Option<i64>,
}

/// Bytes that are no column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the bytes of a column do not fit together")]
pub struct Damaged;

/// Packs points, with their times from `start`.
#[must_use]
pub fn pack(start: i64, points: &[Point]) -> Vec<u8> {
    let mut raw = Vec::with_capacity(points.len() * 3);
    write(start, points, &mut raw);
    deflated(&raw)
}

/// Writes points as pairs of numbers, with their times from `start`.
pub(crate) fn write(start: i64, points: &[Point], raw: &mut Vec<u8>) {
    let (mut at, mut step, mut count) = (start, 0_i64, 0_i64);
    for point in points {
        let next = point.at.wrapping_sub(at);
        write_number(raw, zigzag(next.wrapping_sub(step)));
        (at, step) = (point.at, next);
        match point.count {
            None => write_number(raw, 0),
            Some(known) => {
                write_number(raw, zigzag(known.wrapping_sub(count)).saturating_add(1));
                count = known;
            }
        }
    }
}

/// Unpacks what was packed from `start`.
///
/// # Errors
/// [`Damaged`]: it is no column.
pub fn unpack(start: i64, packed: &[u8]) -> Result<Vec<Point>, Damaged> {
    read(start, &inflated(packed)?)
}

/// Reads points that were written from `start`.
///
/// # Errors
/// [`Damaged`]: there are none.
pub(crate) fn read(start: i64, mut rest: &[u8]) -> Result<Vec<Point>, Damaged> {
    let mut points = Vec::with_capacity(rest.len() / 2);
    let (mut at, mut step, mut count) = (start, 0_i64, 0_i64);
    while !rest.is_empty() {
        step = step.wrapping_add(unzigzag(read_number(&mut rest)?));
        at = at.wrapping_add(step);
        let known = match read_number(&mut rest)?.checked_sub(1) {
            None => None,
            Some(difference) => {
                count = count.wrapping_add(unzigzag(difference));
                Some(count)
            }
        };
        points.push(Point { at, count: known });
    }
    Ok(points)
}

/// Numbers one after the other.
#[must_use]
pub fn pack_numbers(numbers: &[i64]) -> Vec<u8> {
    let mut raw = Vec::with_capacity(numbers.len() * 2);
    numbers.iter().for_each(|number| write_number(&mut raw, zigzag(*number)));
    deflated(&raw)
}

/// Numbers that were packed, as rows: those of the first column stand before those of the second, and so on.
#[derive(Debug)]
pub(crate) struct Rows<const N: usize> {
    raw: Vec<u8>,
    /// Where each column is read on.
    places: [usize; N],
    left: usize,
}

impl<const N: usize> Rows<N> {
    /// # Errors
    /// [`Damaged`]: there are none.
    pub(crate) fn unpacked(packed: &[u8]) -> Result<Self, Damaged> {
        let raw = inflated(packed)?;
        let numbers = raw.iter().filter(|byte| **byte & 0x80 == 0).count();
        let left = numbers / N;
        let (mut places, mut column, mut number, mut length) = ([0; N], 0, 0, 0);
        for (place, byte) in raw.iter().enumerate() {
            if length == 0 && number == column * left && column < N {
                places[column] = place;
                column += 1;
            }
            length += 1;
            if length > 10 {
                return Err(Damaged);
            }
            if byte & 0x80 == 0 {
                (number, length) = (number + 1, 0);
            }
        }
        if length > 0 { Err(Damaged) } else { Ok(Self { raw, places, left }) }
    }
}

impl<const N: usize> Iterator for Rows<N> {
    type Item = [i64; N];

    fn next(&mut self) -> Option<[i64; N]> {
        self.left = self.left.checked_sub(1)?;
        let mut row = [0; N];
        for (number, place) in row.iter_mut().zip(&mut self.places) {
            let (mut read, mut shift) = (0_u64, 0);
            loop {
                let byte = *self.raw.get(*place)?;
                *place += 1;
                read |= u64::from(byte & 0x7F).wrapping_shl(shift);
                shift += 7;
                if byte & 0x80 == 0 {
                    break;
                }
            }
            *number = unzigzag(read);
        }
        Some(row)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

/// Writes a number in LEB128.
pub fn write_number(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        bytes.push((number & 0x7F) as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
}

/// Reads a number in LEB128, and goes on behind it.
///
/// # Errors
/// [`Damaged`]: it has no end, or more than 64 bits.
pub fn read_number(bytes: &mut &[u8]) -> Result<u64, Damaged> {
    let mut number = 0;
    for place in 0..10 {
        let (byte, rest) = bytes.split_first().ok_or(Damaged)?;
        *bytes = rest;
        if place == 9 && *byte > 1 {
            return Err(Damaged);
        }
        number |= u64::from(byte & 0x7F) << (7 * place);
        if byte & 0x80 == 0 {
            return Ok(number);
        }
    }
    Err(Damaged)
}

const fn zigzag(number: i64) -> u64 {
    ((number << 1) ^ (number >> 63)).cast_unsigned()
}

const fn unzigzag(number: u64) -> i64 {
    (number >> 1).cast_signed() ^ -((number & 1).cast_signed())
}

/// Bytes as a zlib stream.
#[must_use]
pub fn deflated(raw: &[u8]) -> Vec<u8> {
    PACKS.with_borrow_mut(|packs| {
        packs.reset();
        let mut packed = Vec::with_capacity(raw.len() + 64);
        loop {
            let done = usize::try_from(packs.total_in()).unwrap_or(raw.len());
            // Into memory: it does not fail.
            match packs.compress_vec(&raw[done..], &mut packed, FlushCompress::Finish) {
                Ok(Status::StreamEnd) | Err(_) => return packed,
                Ok(_) => packed.reserve(raw.len() / 8 + 64),
            }
        }
    })
}

/// The bytes of a zlib stream.
///
/// # Errors
/// [`Damaged`]: it is none.
pub fn inflated(packed: &[u8]) -> Result<Vec<u8>, Damaged> {
    UNPACKS.with_borrow_mut(|unpacks| {
        let mut room = ROOM.max(packed.len() * 8);
        loop {
            unpacks.reset(true);
            let mut raw = Vec::with_capacity(room);
            match unpacks.decompress_vec(packed, &mut raw, FlushDecompress::Finish) {
                Ok(Status::StreamEnd) => return Ok(raw),
                // It wants more room, and gets it once more from the beginning.
                Ok(_) if raw.len() == raw.capacity() && room < LONGEST => room *= 8,
                _ => return Err(Damaged),
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_was_packed_comes_back_as_it_was(
            start in any::<i64>(),
            points in prop::collection::vec((any::<i64>(), prop::option::of(-(1_i64 << 61)..1 << 61)), 0..200),
        ) {
            let points: Vec<Point> = points.into_iter().map(|(at, count)| Point { at, count }).collect();
            prop_assert_eq!(unpack(start, &pack(start, &points)), Ok(points));
        }

        #[test]
        fn numbers_that_were_packed_come_back_in_rows(columns in prop::collection::vec(any::<[i64; 3]>(), 0..200)) {
            let column = |place: usize| columns.iter().map(move |row| row[place]);
            let numbers: Vec<i64> = column(0).chain(column(1)).chain(column(2)).collect();
            let rows: Vec<[i64; 3]> = Rows::unpacked(&pack_numbers(&numbers)).unwrap().collect();
            prop_assert_eq!(rows, columns);
        }

        #[test]
        fn no_bytes_upset_it(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let _ = unpack(0, &bytes);
            let _ = unpack(0, &deflated(&bytes));
            let _ = Rows::<5>::unpacked(&deflated(&bytes)).map(Iterator::count);
        }
    }

    #[test]
    fn it_is_written_as_the_readme_says() {
        // Two seconds apart from 1000, 50 then 48, then nothing: by hand from the description above.
        let points = [
            Point { at: 1_000, count: Some(50) },
            Point { at: 3_000, count: Some(48) },
            Point { at: 5_000, count: None },
        ];
        let raw = inflated(&pack(1_000, &points)).unwrap();
        // 0; 100 + 1; 2000 zigzag is 4000; -2 zigzag is 3, and 1; 0; 0.
        assert_eq!(raw, [0, 101, 0xA0, 0x1F, 4, 0, 0]);
    }

    #[test]
    fn a_value_a_second_that_changes_a_little_takes_less_than_three_bytes() {
        let mut random = fastrand::Rng::with_seed(1);
        let (mut at, mut count) = (0, 3_000);
        let points: Vec<Point> = (0..3_600)
            .map(|_| {
                at += 1_000 + random.i64(-8..=8);
                count += random.i64(-20..=20);
                Point { at, count: Some(count) }
            })
            .collect();
        let bytes = pack(0, &points).len() as f64 / points.len() as f64;
        assert!(bytes < 3.0, "{bytes}");
        println!("{bytes:.2} bytes a value");
    }
}
