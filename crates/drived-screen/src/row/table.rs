//! Rows of drives on a terminal of any width: no number is cut, and what has no room is left out whole.

use drive_fleet::Severity;
use ratatui::{
    style::{Color, Modifier, Style},
    text::{Line, Span},
};

use super::{
    Column, Row,
    picture::{alarm, bar, old},
    text::{fitted, shortened},
};

/// A name is not made shorter than this.
const SHORTEST_NAME: usize = 6;
/// The mark, and the sign of trouble.
const SIGNS: usize = 2;
/// How wide the bar of the frequency is.
const BAR: usize = 12;
const LONGEST_BAR: usize = 24;
/// A note is not worth less room.
const NOTE: usize = 16;
/// From this width on nothing jumps when a word changes.
const STEADY: usize = 60;
/// The order in which the columns stand.
const ORDER: [Column; 5] = [Column::State, Column::Frequency, Column::Current, Column::Control, Column::Age];

impl Column {
    /// How wide it is at the least where there is room for it.
    const fn least(self) -> usize {
        match self {
            Self::State => 12,
            Self::Frequency => 10,
            Self::Age => 8,
            Self::Current | Self::Control => 7,
        }
    }

    /// A text of it, as wide as the column.
    fn set(self, text: &str, width: usize) -> String {
        match self {
            Self::Frequency | Self::Age | Self::Current => format!(" {text:>width$}"),
            Self::State | Self::Control => format!(" {text:width$}"),
        }
    }
}

/// Which columns there is room for, and how wide each is: as wide as its widest text, or not there.
pub struct Columns {
    width: usize,
    name: usize,
    /// In the order of [`Column::ALL`]; 0: it is left out.
    cells: [usize; 5],
    bar: usize,
    note: usize,
}

impl Columns {
    /// Those of these for rows in a width.
    pub fn of(rows: &[Row], wanted: &[Column], width: usize) -> Self {
        let longest = |text: fn(&Row) -> usize| rows.iter().map(text).max().unwrap_or_default();
        let longest_name = longest(|row| row.name.chars().count()).max(SHORTEST_NAME);
        let mut room = width.saturating_sub(SIGNS + SHORTEST_NAME.min(longest_name));
        let mut is_full = false;
        let cells = Column::ALL.map(|column| {
            let text = |row: &Row| row.cell(column).chars().count();
            let least = if width < STEADY { column.head().chars().count() } else { column.least() };
            let widest = rows.iter().map(text).max().unwrap_or_default().max(least);
            let is_wanted = wanted.contains(&column);
            // Behind one that has no room none is shown.
            is_full |= is_wanted && widest + 1 > room;
            if is_full || !is_wanted {
                return 0;
            }
            room -= widest + 1;
            widest
        });
        let more = room.min(longest_name - SHORTEST_NAME);
        room -= more;
        let longest_note = longest(|row| row.note.chars().count());
        let note_is_worth_it = longest_note > 0 && room > BAR + 1 + NOTE;
        let bar = match (room, note_is_worth_it) {
            (room, _) if room <= BAR => 0,
            (_, true) => BAR,
            (room, false) => (room - 1).min(LONGEST_BAR),
        };
        room = room.saturating_sub(if bar > 0 { bar + 1 } else { 0 });
        let note = if room > NOTE { room - 1 } else { 0 };
        Self { width, name: SHORTEST_NAME + more, cells, bar, note }
    }

    /// The heads, or in place of those of the numbers which drives are shown.
    pub fn head(&self, which: &str) -> String {
        if !which.is_empty() {
            return fitted(&format!("{:SIGNS$}{which}", ""), self.width);
        }
        let mut head = format!("{:SIGNS$}{:name$}", "", "drive", name = self.name);
        for (column, width) in self.shown() {
            head += &column.set(column.head(), width);
            if column == Column::State && self.bar > 0 {
                head += &format!(" {:bar$}", "frequency", bar = self.bar);
            }
        }
        head
    }

    fn shown(&self) -> impl Iterator<Item = (Column, usize)> + '_ {
        let width = |column: Column| self.cells.get(column as usize).copied().unwrap_or_default();
        ORDER.into_iter().map(move |column| (column, width(column))).filter(|(_, width)| *width > 0)
    }

    /// A row.
    pub fn line(&self, row: &Row, is_marked: bool) -> Line<'static> {
        let sign = match row.trouble {
            Some(Severity::Alarm) => "!",
            Some(Severity::Warning) => "~",
            _ => " ",
        };
        let mark = if is_marked { "▸" } else { " " };
        let style = match (row.is_live, row.trouble == Some(Severity::Alarm)) {
            (false, _) => old(),
            (true, true) => Style::new().fg(Color::Red),
            (true, false) => Style::new(),
        };
        let of_name = if is_marked { Modifier::REVERSED | Modifier::BOLD } else { Modifier::BOLD };
        let name = shortened(&row.name, self.name);
        let mut spans = vec![
            Span::styled(format!("{mark}{sign}"), alarm()),
            Span::styled(format!("{name:width$}", width = self.name), Style::new().add_modifier(of_name)),
        ];
        let has_age = self.shown().any(|(column, _)| column == Column::Age);
        let is_dated = row.is_live || has_age || !row.shows.is_of_the_drive();
        for (column, width) in self.shown() {
            // Where there is no room for the age it takes the place of an old state.
            let told = if column == Column::State && !is_dated { Column::Age } else { column };
            let is_live_state = column == Column::State && row.is_live;
            let style = if is_live_state { Style::new().fg(row.colour) } else { style };
            spans.push(Span::styled(column.set(row.cell(told), width), style));
            if column == Column::State && self.bar > 0 {
                spans.push(Span::raw(" "));
                match row.bar {
                    Some((output, setpoint)) => spans.extend(bar(output, setpoint, self.bar, row.colour)),
                    None => spans.push(Span::raw(" ".repeat(self.bar))),
                }
            }
        }
        if self.note > 0 {
            spans.push(Span::styled(format!(" {}", fitted(&row.note, self.note)), style));
        }
        Line::from(spans)
    }
}
