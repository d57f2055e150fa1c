//! What a person reads on stdout: lines, tables, and numbers in their units.

use std::{
    fmt,
    io::{self, Write},
    time::Duration,
};

use drive_core::{Status, registers::Unit};

use crate::failure::Failure;

/// Prints a line. A reader who went away (`drived poll | head`) ends the program, without a panic.
pub(crate) fn say(line: impl fmt::Display) -> Result<(), Failure> {
    writeln!(io::stdout().lock(), "{line}").map_err(|error| Failure::output(&error))
}

/// A table with aligned columns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Table {
    rows: Vec<Vec<String>>,
    /// Columns from this one on are numbers, set to the right.
    numbers_from: usize,
}

impl Table {
    /// A table of texts.
    pub(crate) fn new<const N: usize>(heads: [&str; N]) -> Self {
        Self { rows: vec![heads.map(str::to_owned).to_vec()], numbers_from: usize::MAX }
    }

    /// The same, with numbers from a column on.
    pub(crate) fn with_numbers_from(self, column: usize) -> Self {
        Self { numbers_from: column, ..self }
    }

    pub(crate) fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.rows.push(cells.to_vec());
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or_default();
        let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        let width = |column| self.rows.iter().map(|row| cell(row, column).chars().count()).max();
        let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or_default()).collect();
        for (index, row) in self.rows.iter().enumerate() {
            let mut line = String::new();
            for (column, width) in widths.iter().copied().enumerate() {
                let text = cell(row, column);
                if column >= self.numbers_from {
                    line.push_str(&format!("{text:>width$}  "));
                } else {
                    line.push_str(&format!("{text:<width$}  "));
                }
            }
            if index > 0 {
                f.write_str("\n")?;
            }
            f.write_str(line.trim_end())?;
        }
        Ok(())
    }
}

/// A value, or a dash where there is none.
pub(crate) fn or_dash(value: Option<impl fmt::Display>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| value.to_string())
}

/// A short time as a person compares it.
pub(crate) fn milliseconds(time: Duration) -> String {
    let micros = time.as_micros();
    format!("{}.{:02} ms", micros / 1_000, micros % 1_000 / 10)
}

/// Millionths as a percentage.
pub(crate) fn percent(ppm: u64) -> String {
    format!("{}.{:02} %", ppm / 10_000, ppm % 10_000 / 100)
}

/// A number of counts in a register's unit.
pub(crate) fn in_unit(unit: Unit, count: i32) -> String {
    let word = if unit.signed {
        i16::try_from(count).ok().map(i16::cast_unsigned)
    } else {
        u16::try_from(count).ok()
    };
    word.map_or_else(|| count.to_string(), |word| unit.show(word))
}

/// The motor current, in amperes or as a share of the drive's own.
pub(crate) fn current(status: &Status) -> Option<String> {
    let share = || status.current_share.map(|share| share.to_string());
    status.current.map(|current| current.to_string()).or_else(share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_sets_texts_to_the_left_and_numbers_to_the_right() {
        let mut table = Table::new(["drive", "good"]).with_numbers_from(1);
        table.row(["atv312@1".to_owned(), "7".to_owned()]);
        table.row(["atv21@2".to_owned(), "12345".to_owned()]);
        assert_eq!(table.to_string(), "drive      good\natv312@1      7\natv21@2   12345");
    }

    #[test]
    fn a_count_is_shown_in_its_unit_with_its_sign() {
        assert_eq!(in_unit(Unit::scaled("Hz", 1), 500), "50.0 Hz");
        assert_eq!(in_unit(Unit::scaled("Hz", 1).signed(), -500), "-50.0 Hz");
        assert_eq!(in_unit(Unit::COUNT, 70_000), "70000");
    }

    #[test]
    fn shares_and_times_keep_two_decimals() {
        assert_eq!(percent(995_040), "99.50 %");
        assert_eq!(milliseconds(Duration::from_micros(5_678)), "5.67 ms");
    }
}
