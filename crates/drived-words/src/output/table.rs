//! Tables and texts in a given width. A number is never cut: where the columns have no room beside each other, each row is
//! told in lines of its own.

use std::{fmt, io};

use super::terminal;

/// Between two columns of a table.
const GAP: usize = 2;

/// A longer word is broken where it has to be, between its parts if it has some; a number never.
const LONG: usize = 16;

/// A table with aligned columns. Where there is a limit to its width, the texts of its widest columns go on in further
/// lines; where that is not enough, each row is a paragraph of its heads and cells.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Table {
    heads: Option<Vec<String>>,
    rows: Vec<Vec<String>>,
    /// Columns from this one on are numbers, set to the right.
    numbers_from: Option<usize>,
    /// How many characters a line may have.
    available: Option<usize>,
}

impl Table {
    /// A table of texts without heads.
    pub fn texts() -> Self {
        Self::default()
    }

    /// A table of texts.
    pub fn new<const N: usize>(heads: [&str; N]) -> Self {
        Self::headed(heads.map(str::to_owned))
    }

    /// A table of texts with as many columns as there are heads.
    pub fn headed(heads: impl IntoIterator<Item = String>) -> Self {
        Self { heads: Some(heads.into_iter().collect()), ..Self::default() }
    }

    /// The same, with numbers from a column on.
    pub fn with_numbers_from(self, column: usize) -> Self {
        Self { numbers_from: Some(column), ..self }
    }

    /// The same, on a terminal no wider than that.
    pub fn on_terminal(self) -> Self {
        Self { available: terminal::width(&io::stdout()), ..self }
    }

    pub fn row<const N: usize>(&mut self, cells: [String; N]) {
        self.cells(cells);
    }

    /// A row of as many cells as there are.
    pub fn cells(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Whether it has no row below its heads.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    fn with_heads(&self) -> impl Iterator<Item = &Vec<String>> {
        self.heads.iter().chain(&self.rows)
    }

    fn are_numbers(&self, column: usize) -> bool {
        self.numbers_from.is_some_and(|first| column >= first)
    }

    /// The width of each column: that of its longest text, or less where there is less room; `None` where that would cut a
    /// number or a word.
    fn widths(&self) -> Option<Vec<usize>> {
        let columns = self.with_heads().map(Vec::len).max().unwrap_or_default();
        let most = |column: usize, of: &dyn Fn(&str) -> usize| {
            let cells = self.with_heads().filter_map(|row| row.get(column));
            cells.map(|cell| of(cell)).max().unwrap_or_default()
        };
        let mut widths: Vec<usize> = (0..columns).map(|column| most(column, &length)).collect();
        let available = self.available.unwrap_or(usize::MAX).saturating_sub(GAP * columns.saturating_sub(1));
        let needed = |column: usize| {
            most(column, &|cell| {
                if self.are_numbers(column) && has_digit(cell) { length(cell) } else { needed(cell) }
            })
        };
        while widths.iter().sum::<usize>() > available {
            let narrower = widths.iter_mut().enumerate().filter(|(column, width)| **width > needed(*column));
            *narrower.max_by_key(|(_, width)| **width)?.1 -= 1;
        }
        Some(widths)
    }

    /// Each row as a paragraph: its first cell, then what stands under each other head; its numbers together.
    fn paragraphs(&self, heads: &[String], width: usize) -> Vec<String> {
        let mut lines = Vec::new();
        for row in &self.rows {
            lines.extend(row.first().into_iter().flat_map(|cell| wrapped(cell, width)));
            let mut numbers = String::new();
            for (column, (head, cell)) in heads.iter().zip(row).enumerate().skip(1) {
                match cell.is_empty() {
                    true => {}
                    false if self.are_numbers(column) => {
                        // A number stays beside its head.
                        let number = format!("  {head} {cell}");
                        if length(&numbers) + length(&number) > width {
                            lines.extend(hanging(&std::mem::take(&mut numbers), width));
                        }
                        numbers.push_str(&number);
                    }
                    false => lines.extend(hanging(&format!("  {head}: {cell}"), width)),
                }
            }
            lines.extend(hanging(&numbers, width));
        }
        lines.retain(|line| !line.is_empty());
        lines
    }

    fn lines(&self) -> Vec<String> {
        let widths = match (self.widths(), &self.heads, self.available) {
            (Some(widths), ..) => widths,
            (None, Some(heads), Some(width)) => return self.paragraphs(heads, width),
            // Without heads a cell is known by its column alone, which the terminal breaks as it can.
            (None, ..) => Self { available: None, ..self.clone() }.widths().unwrap_or_default(),
        };
        let mut lines = Vec::new();
        for row in self.with_heads() {
            let cells: Vec<Vec<String>> =
                row.iter().zip(&widths).map(|(cell, &width)| wrapped(cell, width)).collect();
            let height = cells.iter().map(Vec::len).max().unwrap_or_default();
            for line_of_row in 0..height {
                let mut line = String::new();
                for (column, (cell, &width)) in cells.iter().zip(&widths).enumerate() {
                    let text = cell.get(line_of_row).map_or("", String::as_str);
                    if self.are_numbers(column) {
                        line.push_str(&format!("{text:>width$}"));
                    } else {
                        line.push_str(&format!("{text:<width$}"));
                    }
                    line.push_str(&" ".repeat(GAP));
                }
                lines.push(line.trim_end().to_owned());
            }
        }
        lines
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}

/// A text in lines of at most this width, broken between words where it has some; its indentation is kept.
pub fn wrapped(text: &str, width: usize) -> Vec<String> {
    broken(text, width, 0)
}

/// The same, with the lines that go on set in by a little.
pub fn hanging(text: &str, width: usize) -> Vec<String> {
    broken(text, width, GAP)
}

fn broken(text: &str, width: usize, set_in: usize) -> Vec<String> {
    if length(text) <= width {
        return vec![text.to_owned()];
    }
    let first: String = text.chars().take_while(|character| *character == ' ').collect();
    let indent = format!("{first}{}", " ".repeat(set_in));
    let mut lines = Vec::new();
    let mut line = first;
    let mut is_empty = true;
    for word in text.split_whitespace() {
        if !is_empty && length(&line) + 1 + length(word) > width {
            lines.push(std::mem::replace(&mut line, indent.clone()));
        } else if !is_empty {
            line.push(' ');
        }
        is_empty = false;
        for part in parts(word) {
            if length(&line) + length(part) > width && line.len() > indent.len() {
                lines.push(std::mem::replace(&mut line, indent.clone()));
            }
            for character in part.chars() {
                // A number that is wider than the window is the terminal's to break.
                if !has_digit(part) && length(&line) >= width.max(indent.len() + 1) {
                    lines.push(std::mem::replace(&mut line, indent.clone()));
                }
                line.push(character);
            }
        }
    }
    lines.push(line);
    lines
}

/// What a long word is broken between: `atv312@1-3,` `5,` `9`. A short one is one part.
fn parts(word: &str) -> impl Iterator<Item = &str> {
    let between: &[char] = if length(word) > LONG { &[',', '/', ';'] } else { &[] };
    word.split_inclusive(between)
}

/// The width without which a number or a short word of a text would be cut.
fn needed(text: &str) -> usize {
    let indent = text.chars().take_while(|character| *character == ' ').count();
    let uncut = |part: &str| if has_digit(part) { length(part) } else { length(part).min(LONG) };
    let longest = text.split_whitespace().flat_map(parts).map(uncut).max().unwrap_or_default();
    indent + longest
}

fn length(text: &str) -> usize {
    text.chars().count()
}

fn has_digit(text: &str) -> bool {
    text.contains(|character: char| character.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn in_width(table: &Table, width: usize) -> String {
        Table { available: Some(width), ..table.clone() }.to_string()
    }

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
        assert_eq!(
            in_width(&table, 24),
            "code  name\nACC   acceleration time\n      to the nominal\n      frequency\ndEC   deceleration"
        );
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
    fn rows_without_room_for_their_columns_are_told_one_below_the_other() {
        let mut table = Table::new(["drive", "good", "timeouts", "p99"]).with_numbers_from(1);
        table.row(["atv312@1", "1234567", "12", "12.34 ms"].map(str::to_owned));
        assert_eq!(
            in_width(&table, 37),
            "drive        good  timeouts       p99\natv312@1  1234567        12  12.34 ms"
        );
        assert_eq!(in_width(&table, 36), "atv312@1\n  good 1234567  timeouts 12\n  p99 12.34 ms");
    }

    #[test]
    fn a_list_of_addresses_is_broken_between_them() {
        assert_eq!(wrapped("atv312@1-10,12,14,100-120", 12), ["atv312@1-10,", "12,14,", "100-120"]);
    }

    /// Words as tables have them: names, lists of addresses, numbers with units.
    fn words() -> impl Strategy<Value = String> {
        let word = prop_oneof![
            "[a-z]{1,14}",
            "-?[0-9]{1,9}\\.[0-9]{1,3}",
            "atv312@[0-9]{1,3}",
            Just("ms".to_owned()),
        ];
        proptest::collection::vec(word, 0..6).prop_map(|words| words.join(" "))
    }

    fn numbers(text: &str) -> Vec<String> {
        let mut numbers: Vec<String> =
            text.split_whitespace().filter(|word| has_digit(word)).map(str::to_owned).collect();
        numbers.sort();
        numbers
    }

    proptest! {
        #[test]
        fn no_width_cuts_a_number_and_no_line_is_wider_than_the_window(
            rows in proptest::collection::vec(proptest::collection::vec(words(), 7), 1..6),
            columns in 1_usize..=7,
            numbers_from in 0_usize..8,
            width in 32_usize..130,
        ) {
            let heads = ["drive", "state", "output", "setpoint", "exceptions", "age", "what it is"];
            let mut table = Table::headed(heads.iter().take(columns).map(|head| (*head).to_owned()))
                .with_numbers_from(numbers_from);
            for row in &rows {
                table.cells(row.iter().take(columns).cloned());
            }
            let shown = in_width(&table, width);
            let told = rows.iter().flat_map(|row| row.iter().take(columns)).fold(String::new(), |all, cell| all + " " + cell);
            prop_assert_eq!(numbers(&shown), numbers(&told), "{}", shown);
            for line in shown.lines() {
                prop_assert!(length(line) <= width, "{} > {width}:\n{shown}", length(line));
            }
        }
    }
}
