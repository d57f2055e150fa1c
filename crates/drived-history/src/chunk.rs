//! What has been shown since it was written last: [`Chunk`], of one set of one drive.

use std::collections::BTreeMap;

use crate::{
    column::{self, Damaged, Point, deflated, inflated, read_number, unpack, write_number},
    curve::Piece,
    quantity::Quantity,
    tracker::Seen,
};

/// The number in the file of the form in which a chunk is written: one stream.
pub(crate) const WHOLE: i64 = 2;

/// What is known of one set of one drive between two moments of one clock.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Chunk {
    pub(crate) start: i64,
    pub(crate) end: i64,
    pub(crate) columns: BTreeMap<Quantity, Vec<Point>>,
    /// Whether anything was seen since it was begun.
    pub(crate) is_new: bool,
}

impl Chunk {
    /// The first that is known.
    #[must_use]
    pub(crate) fn begin(at: i64) -> Self {
        Self { start: at, end: at, columns: BTreeMap::new(), is_new: false }
    }

    /// Adds what was seen; gives how many points that were.
    pub(crate) fn see(&mut self, seen: &Seen) -> usize {
        let mut points = 0;
        if seen.is_after_gap {
            let gap = self.end + 1;
            for column in self.columns.values_mut() {
                if column.last().is_some_and(|point| point.count.is_some()) {
                    column.push(Point { at: gap, count: None });
                    points += 1;
                }
            }
        }
        for (quantity, count) in &seen.changed {
            self.columns.entry(*quantity).or_default().push(Point { at: seen.at, count: *count });
            points += 1;
        }
        self.end = self.end.max(seen.at);
        self.is_new = true;
        points
    }

    /// What comes after it: it begins where this ends, with what is known there.
    #[must_use]
    pub(crate) fn next(&self) -> Self {
        let held = |points: &Vec<Point>| {
            points
                .last()
                .filter(|point| point.count.is_some())
                .map(|point| vec![Point { at: self.end, ..*point }])
        };
        let columns = self.columns.iter().filter_map(|(quantity, points)| Some((*quantity, held(points)?)));
        Self { start: self.end, end: self.end, columns: columns.collect(), is_new: false }
    }

    /// As bytes, in one zlib stream: for each quantity its number, how many bytes its column has, and the column, whose times count from the
    /// start. A column alone is too short to be packed.
    #[must_use]
    pub(crate) fn packed(&self) -> Vec<u8> {
        let (mut bytes, mut column) = (Vec::new(), Vec::new());
        for (quantity, points) in &self.columns {
            column.clear();
            column::write(self.start, points, &mut column);
            write_number(&mut bytes, u64::from(quantity.0));
            write_number(&mut bytes, column.len() as u64);
            bytes.extend_from_slice(&column);
        }
        deflated(&bytes)
    }

    /// Reads what was packed.
    ///
    /// # Errors
    /// [`Damaged`]: it is none.
    pub(crate) fn unpacked(start: i64, end: i64, packed: &Packed) -> Result<Self, Damaged> {
        let mut columns = BTreeMap::new();
        packed.each_column(|quantity, column| {
            columns.insert(quantity, column.points(start)?);
            Ok(())
        })?;
        Ok(Self { start, end, columns, is_new: false })
    }
}

/// The bytes of a chunk as they stand in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Packed {
    /// In one stream.
    Whole(Vec<u8>),
    /// Each column in a stream of its own, as files of versions before the third have it.
    Columns(Vec<u8>),
}

/// One column of it.
enum Column<'a> {
    Plain(&'a [u8]),
    Packed(&'a [u8]),
}

impl Column<'_> {
    fn points(&self, start: i64) -> Result<Vec<Point>, Damaged> {
        match self {
            Self::Plain(bytes) => column::read(start, bytes),
            Self::Packed(bytes) => unpack(start, bytes),
        }
    }
}

impl Packed {
    /// Of a form, by its number in the file.
    pub(crate) fn of(form: i64, data: Vec<u8>) -> Self {
        if form == WHOLE { Self::Whole(data) } else { Self::Columns(data) }
    }

    fn each_column(
        &self,
        mut each: impl FnMut(Quantity, Column<'_>) -> Result<(), Damaged>,
    ) -> Result<(), Damaged> {
        let whole;
        let (mut bytes, is_whole): (&[u8], bool) = match self {
            Self::Whole(data) => {
                whole = inflated(data)?;
                (&whole, true)
            }
            Self::Columns(data) => (data, false),
        };
        while !bytes.is_empty() {
            let quantity = u32::try_from(read_number(&mut bytes)?).map_err(|_| Damaged)?;
            let length = usize::try_from(read_number(&mut bytes)?).map_err(|_| Damaged)?;
            let (column, rest) = bytes.split_at_checked(length).ok_or(Damaged)?;
            bytes = rest;
            let column = if is_whole { Column::Plain(column) } else { Column::Packed(column) };
            each(Quantity(quantity), column)?;
        }
        Ok(())
    }
}

/// What packed bytes know of one quantity: a piece without points where it was not shown.
///
/// # Errors
/// [`Damaged`]: they are none.
pub(crate) fn piece_of(quantity: Quantity, start: i64, end: i64, packed: &Packed) -> Result<Piece, Damaged> {
    let mut piece = Piece { start, end, points: Vec::new() };
    packed.each_column(|found, column| {
        if found == quantity {
            piece.points = column.points(start)?;
        }
        Ok(())
    })?;
    Ok(piece)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HZ: Quantity = Quantity::OUTPUT_FREQUENCY;

    fn seen(at: i64, is_after_gap: bool, count: i64) -> Seen {
        Seen { at, is_after_gap, changed: vec![(HZ, Some(count))] }
    }

    #[test]
    fn each_begins_with_what_the_one_before_knew_at_its_end() {
        let mut chunk = Chunk::begin(1_000);
        chunk.see(&seen(1_000, true, 50));
        chunk.see(&Seen { at: 2_000, is_after_gap: false, changed: Vec::new() });
        let next = chunk.next();
        assert_eq!((next.start, next.end), (2_000, 2_000));
        assert_eq!(next.columns[&HZ], [Point { at: 2_000, count: Some(50) }]);
        chunk.see(&seen(9_000, true, 50));
        let counts: Vec<_> = chunk.columns[&HZ].iter().map(|point| (point.at, point.count)).collect();
        assert_eq!(counts, [(1_000, Some(50)), (2_001, None), (9_000, Some(50))]);
        let read = Chunk::unpacked(chunk.start, chunk.end, &Packed::of(WHOLE, chunk.packed())).unwrap();
        assert_eq!(read.columns, chunk.columns);
    }

    #[test]
    fn a_chunk_of_an_older_file_is_read_as_it_was_written_then() {
        let points = vec![Point { at: 1_000, count: Some(50) }, Point { at: 2_000, count: Some(48) }];
        let column = column::pack(1_000, &points);
        let mut old = Vec::new();
        write_number(&mut old, u64::from(HZ.0));
        write_number(&mut old, column.len() as u64);
        old.extend(column);
        let read = Chunk::unpacked(1_000, 2_000, &Packed::of(1, old)).unwrap();
        assert_eq!(read.columns[&HZ], points);
    }
}
