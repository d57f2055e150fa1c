//! What a person reads on stdout: lines, tables, and numbers in their units.

use std::{
    fmt,
    io::{self, IsTerminal, Write},
    time::Duration,
};

use drive_core::{Status, registers::Unit};

use crate::failure::Failure;

/// Prints a line, on a terminal broken between its words. A reader who went away (`drived poll | head`) ends the program,
/// without a panic.
pub(crate) fn say(line: impl fmt::Display) -> Result<(), Failure> {
    match terminal_width(&io::stdout()) {
        Some(width) => {
            line.to_string().split('\n').flat_map(|line| hanging(line, width)).try_for_each(say_as_it_is)
        }
        None => say_as_it_is(line),
    }
}

/// Prints a line for a program, unbroken.
pub(crate) fn say_as_it_is(line: impl fmt::Display) -> Result<(), Failure> {
    writeln!(io::stdout().lock(), "{line}").map_err(|error| Failure::output(&error))
}

/// Prints a table, on a terminal no wider than that.
pub(crate) fn say_table(table: Table) -> Result<(), Failure> {
    say_as_it_is(table.on_terminal())
}

/// Says on stderr why the program ends, if anybody reads that.
pub(crate) fn complain(why: impl fmt::Display) {
    let line = format!("drived: {why}");
    let lines = match terminal_width(&io::stderr()) {
        Some(width) => hanging(&line, width),
        None => vec![line],
    };
    for line in lines {
        // The exit code says it too.
        let _ = writeln!(io::stderr(), "{line}");
    }
}

/// Puts a text in the place of the last one on stderr, which has to be a terminal; an empty one takes it away.
pub(crate) fn progress(text: &str) {
    let width = terminal_width(&io::stderr()).unwrap_or(usize::MAX).saturating_sub(1);
    let text: String = text.chars().take(width).collect();
    let mut stderr = io::stderr().lock();
    // Nobody's work ends because this cannot be shown.
    let _ = write!(stderr, "\r\x1b[K{text}").and_then(|()| stderr.flush());
}

impl Table {
    /// The same, on a terminal no wider than that.
    pub(crate) fn on_terminal(self) -> Self {
        Self { available: terminal_width(&io::stdout()), ..self }
    }
}

/// How many characters a line of the terminal has, if this is one.
fn terminal_width(stream: &impl IsTerminal) -> Option<usize> {
    let size = stream.is_terminal().then(|| crossterm::terminal::size().ok()).flatten();
    size.map(|(columns, _)| usize::from(columns))
}

/// Between two columns of a table.
const GAP: usize = 2;

/// No column is made narrower than this.
const NARROWEST: usize = 12;

/// A table with aligned columns. Where there is a limit to its width, the texts of its widest columns go on in further
/// lines.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Table {
    rows: Vec<Vec<String>>,
    /// How many of the rows are heads.
    heads: usize,
    /// Columns from this one on are numbers, set to the right.
    numbers_from: Option<usize>,
    /// How many characters a line may have.
    available: Option<usize>,
}

impl Table {
    /// A table of texts without heads.
    pub(crate) fn texts() -> Self {
        Self::default()
    }

    /// A table of texts.
    pub(crate) fn new<const N: usize>(heads: [&str; N]) -> Self {
        Self { rows: vec![heads.map(str::to_owned).to_vec()], heads: 1, ..Self::default() }
    }

    /// The same, with numbers from a column on.
    pub(crate) fn with_numbers_from(self, column: usize) -> Self {
        Self { numbers_from: Some(column), ..self }
    }

    pub(crate) fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.cells(cells);
    }

    /// A row of as many cells as there are.
    pub(crate) fn cells(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Whether it has no row below its heads.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.len() <= self.heads
    }

    /// The width of each column: that of its longest text, unless there is less room.
    fn widths(&self) -> Vec<usize> {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or_default();
        let longest = |column: usize| {
            self.rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max()
        };
        let mut widths: Vec<usize> = (0..columns).map(|column| longest(column).unwrap_or_default()).collect();
        let available = self.available.unwrap_or(usize::MAX).saturating_sub(GAP * columns.saturating_sub(1));
        while widths.iter().sum::<usize>() > available {
            match widths.iter_mut().max() {
                Some(widest) if *widest > NARROWEST => *widest -= 1,
                _ => break,
            }
        }
        widths
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let widths = self.widths();
        for (index, row) in self.rows.iter().enumerate() {
            let cells: Vec<Vec<String>> =
                row.iter().zip(&widths).map(|(cell, &width)| wrapped(cell, width)).collect();
            let height = cells.iter().map(Vec::len).max().unwrap_or_default();
            for line_of_row in 0..height {
                let mut line = String::new();
                for (column, (cell, &width)) in cells.iter().zip(&widths).enumerate() {
                    let text = cell.get(line_of_row).map_or("", String::as_str);
                    if self.numbers_from.is_some_and(|first| column >= first) {
                        line.push_str(&format!("{text:>width$}"));
                    } else {
                        line.push_str(&format!("{text:<width$}"));
                    }
                    line.push_str(&" ".repeat(GAP));
                }
                if index + line_of_row > 0 {
                    f.write_str("\n")?;
                }
                f.write_str(line.trim_end())?;
            }
        }
        Ok(())
    }
}

/// A text in lines of at most this width, broken between words where it has some; its indentation is kept.
pub(crate) fn wrapped(text: &str, width: usize) -> Vec<String> {
    broken(text, width, 0)
}

/// The same, with the lines that go on set in by a little.
pub(crate) fn hanging(text: &str, width: usize) -> Vec<String> {
    broken(text, width, GAP)
}

fn broken(text: &str, width: usize, set_in: usize) -> Vec<String> {
    if text.chars().count() <= width {
        return vec![text.to_owned()];
    }
    let first: String = text.chars().take_while(|character| *character == ' ').collect();
    let indent = format!("{first}{}", " ".repeat(set_in));
    let mut lines = Vec::new();
    let mut line = first;
    let mut is_empty = true;
    for word in text.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > width {
            lines.push(std::mem::replace(&mut line, indent.clone()));
        } else if !is_empty {
            line.push(' ');
        }
        is_empty = false;
        for character in word.chars() {
            if line.chars().count() >= width.max(indent.len() + 1) {
                lines.push(std::mem::replace(&mut line, indent.clone()));
            }
            line.push(character);
        }
    }
    lines.push(line);
    lines
}

/// A number of things: `1 drive`, `31 drives`.
pub(crate) fn counted(number: usize, one: &str, several: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { several })
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

/// A time that nothing takes longer than, rounded up.
pub(crate) fn bound(time: Duration) -> String {
    let millis = time.as_nanos().div_ceil(1_000_000);
    match millis {
        0..1_000 => format!("{millis} ms"),
        _ => {
            let hundredths = millis.div_ceil(10);
            format!("{}.{:02} s", hundredths / 100, hundredths % 100)
        }
    }
}

/// Millionths as a percentage.
pub(crate) fn percent(ppm: u64) -> String {
    let ppm = ppm.saturating_add(50);
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
    fn a_table_goes_on_in_further_lines_where_there_is_no_room() {
        let mut table = Table::new(["code", "name"]);
        table.row(["ACC".to_owned(), "acceleration time to the nominal frequency".to_owned()]);
        table.row(["dEC".to_owned(), "deceleration".to_owned()]);
        let narrow = Table { available: Some(24), ..table.clone() };
        assert_eq!(
            narrow.to_string(),
            "code  name\nACC   acceleration time\n      to the nominal\n      frequency\ndEC   deceleration"
        );
        assert_eq!(Table { available: Some(0), ..table.clone() }.to_string().lines().count(), 6);
        assert_eq!(table.to_string().lines().count(), 3);
    }

    #[test]
    fn a_word_without_room_is_broken() {
        assert_eq!(wrapped("  abc defghij", 5), ["  abc", "  def", "  ghi", "  j"]);
        assert_eq!(wrapped("abc", 0), ["a", "b", "c"]);
    }

    #[test]
    fn a_line_that_goes_on_is_set_in() {
        assert_eq!(hanging("one two three", 20), ["one two three"]);
        assert_eq!(hanging("one two three four", 9), ["one two", "  three", "  four"]);
        assert_eq!(hanging("  ab cd", 5), ["  ab", "    c", "    d"]);
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
        assert_eq!(percent(680_150), "68.02 %");
        assert_eq!(milliseconds(Duration::from_micros(5_678)), "5.67 ms");
    }

    #[test]
    fn a_bound_is_never_shown_shorter_than_it_is() {
        for (micros, shown) in [
            (0, "0 ms"),
            (1, "1 ms"),
            (999_000, "999 ms"),
            (999_001, "1.00 s"),
            (1_000_001, "1.01 s"),
            (61_230_000, "61.23 s"),
        ] {
            assert_eq!(bound(Duration::from_micros(micros)), shown);
        }
    }
}
