//! The drives as a table, those in trouble first, and the lines below.

use drive_core::Setpoint;
use drive_fleet::Severity;
use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style, Stylize as _},
    text::{Line, Span},
    widgets::Paragraph,
};
use tokio::time::Instant;

use super::{
    super::{drive::Drive, model::Model, words},
    document::{alarm, old},
    text::{fitted, height_of, shortened},
};
use crate::{
    drive_cells::{bar, colour, control, direction, hertz},
    logging::escaped,
    output,
    plant::views::{LineLink, LineView},
};

/// A name is not made shorter than this.
const SHORTEST_NAME: usize = 6;
/// The mark, and the sign of trouble.
const SIGNS: usize = 2;
/// How wide the bar of the frequency is.
const BAR: usize = 12;
const LONGEST_BAR: usize = 24;
/// A remark is not worth less room.
const REMARK: usize = 16;
/// So many lines of the plant are shown.
const LINES: usize = 4;

/// The columns behind the name that have numbers or words, with their heads; those that go first stand last.
const HEADS: [&str; 5] = ["state", "out/set Hz", "age", "current", "control"];
const STATE: usize = 0;
const AGE: usize = 2;
/// How wide they are at the least where there is room for it, so that nothing jumps when a word changes.
const WIDTHS: [usize; 5] = [12, 10, 8, 7, 7];
/// From this width on there is.
const STEADY: usize = 60;
/// In which order they stand.
const ORDER: [usize; 5] = [0, 1, 3, 4, 2];

pub(super) fn draw(model: &mut Model, now: Instant, frame: &mut Frame<'_>, area: Rect) {
    let lines: Vec<Line<'_>> = lines(model, usize::from(area.width));
    let [head, table, plant] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Fill(1),
        Constraint::Length(height_of(lines.len().min(LINES))),
    ])
    .areas(area);
    let height = usize::from(table.height);
    let rows = model.rows();
    let marked = rows.iter().position(|drive| Some(&drive.name) == model.selected.as_ref());
    // The mark stays in sight, and the last row is not far from the bottom.
    let first = marked.unwrap_or_default().saturating_sub(height / 2).min(rows.len().saturating_sub(height));
    let connected = model.plant.is_connected();
    let all: Vec<Row> = rows.iter().map(|drive| Row::of(drive, now, connected)).collect();
    let columns = Columns::of(&all, usize::from(area.width));
    let shown = all.iter().enumerate().skip(first).take(height);
    let drawn: Vec<Line<'_>> = shown.map(|(index, row)| columns.line(row, Some(index) == marked)).collect();
    frame.render_widget(Line::from(columns.head(&filter(model, all.len()))).dim(), head);
    frame.render_widget(Paragraph::new(drawn), table);
    frame.render_widget(Paragraph::new(lines), plant);
    model.page = height.max(1);
}

/// Which drives these are, where they are not all.
fn filter(model: &Model, found: usize) -> String {
    let group = model.group.as_ref().map(|group| format!("group {group}"));
    let search = (!model.search.is_empty()).then(|| format!("\"{}\"", model.search));
    let parts: Vec<String> = [group, search].into_iter().flatten().collect();
    match parts.is_empty() {
        true => String::new(),
        false => format!("{}: {found} of {}", parts.join(", "), model.plant.drives.len()),
    }
}

/// One drive in words and numbers.
struct Row {
    name: String,
    /// How badly something troubles it.
    trouble: Option<Severity>,
    is_live: bool,
    colour: Color,
    /// Under [`HEADS`].
    cells: [String; 5],
    /// Its output, with the setpoint, where that is known now.
    bar: Option<(drive_core::Frequency, drive_core::Frequency)>,
    remark: String,
}

impl Row {
    fn of(drive: &Drive, now: Instant, connected: bool) -> Self {
        let is_live = drive.is_live(now, connected);
        let dated = |text: String| if is_live || text == "-" { text } else { format!("({text})") };
        let status = drive.status.as_ref();
        let output = status.and_then(|status| status.output_frequency);
        let (setpoint, asked) = match drive.setpoint {
            Some(Setpoint::Frequency(frequency)) => (Some(frequency), hertz(frequency)),
            Some(setpoint) => (None, setpoint.to_string()),
            None => (None, "-".to_owned()),
        };
        let as_setpoint = setpoint.is_none_or(|setpoint| Some(setpoint) == output);
        let current = status.and_then(output::current).unwrap_or_else(|| "-".to_owned());
        let age = match (is_live, drive.age(now)) {
            (true, Some(age)) if drive.is_rarely_read() => words::time(age),
            (true, _) => "live".to_owned(),
            (false, Some(age)) => format!("{} old", words::time(age)),
            (false, None) => "-".to_owned(),
        };
        Self {
            name: drive.name.clone(),
            trouble: drive.concern().map(|concern| concern.severity),
            is_live,
            colour: status.map_or(Color::Reset, |status| colour(status, as_setpoint)),
            cells: [
                state(drive, is_live),
                format!("{}/{asked}", dated(output.map_or_else(|| "-".to_owned(), hertz))),
                age,
                dated(current),
                dated(status.map_or("-", control).to_owned()),
            ],
            bar: output.filter(|_| is_live).map(|output| (output, setpoint.unwrap_or_default())),
            remark: drive.remark(),
        }
    }
}

/// The state, with the direction of a motor that turns or the mnemonic of the fault.
fn state(drive: &Drive, is_live: bool) -> String {
    let status = drive.status.as_ref();
    let turning = status.filter(|status| !status.is_standstill() && !drive.stop_is_pending());
    let more = drive.fault().or_else(|| turning.map(|status| direction(status).to_owned()));
    let word = drive.state();
    match (&*word, more) {
        ("lost" | "connecting" | "not known", _) => word,
        (_, more) => {
            let text = more.map_or_else(|| word.clone(), |more| format!("{word} {more}"));
            if is_live { text } else { format!("({text})") }
        }
    }
}

/// Which columns there is room for, and how wide each is: as wide as its widest text, or not there.
struct Columns {
    width: usize,
    name: usize,
    /// Of the columns under [`HEADS`]; 0: it is left out.
    cells: [usize; 5],
    bar: usize,
    remark: usize,
}

impl Columns {
    fn of(rows: &[Row], width: usize) -> Self {
        let longest = |text: fn(&Row) -> usize| rows.iter().map(text).max().unwrap_or_default();
        let longest_name = longest(|row| row.name.chars().count()).max(SHORTEST_NAME);
        let mut room = width.saturating_sub(SIGNS + SHORTEST_NAME.min(longest_name));
        let mut is_full = false;
        let cells = std::array::from_fn(|index| {
            let cell = |row: &Row| row.cells.get(index).map_or(0, |cell| cell.chars().count());
            let least = match width {
                STEADY.. => WIDTHS.get(index).copied(),
                _ => HEADS.get(index).map(|head| head.chars().count()),
            };
            let widest = rows.iter().map(cell).max().unwrap_or_default().max(least.unwrap_or_default());
            // Behind one that has no room none is shown.
            is_full |= widest + 1 > room;
            if is_full {
                return 0;
            }
            room -= widest + 1;
            widest
        });
        let more = room.min(longest_name - SHORTEST_NAME);
        room -= more;
        let longest_remark = longest(|row| row.remark.chars().count());
        let remark_is_worth_it = longest_remark > 0 && room > BAR + 1 + REMARK;
        let bar = match (room, remark_is_worth_it) {
            (room, _) if room <= BAR => 0,
            (_, true) => BAR,
            (room, false) => (room - 1).min(LONGEST_BAR),
        };
        room = room.saturating_sub(if bar > 0 { bar + 1 } else { 0 });
        let remark = if room > REMARK { room - 1 } else { 0 };
        Self { width, name: SHORTEST_NAME + more, cells, bar, remark }
    }

    /// The heads, or in place of those of the numbers which drives are shown.
    fn head(&self, filter: &str) -> String {
        let mut head = format!("{:SIGNS$}{:name$}", "", "drive", name = self.name);
        for (index, width) in self.shown() {
            let text = HEADS.get(index).copied().unwrap_or_default();
            head += &if is_number(index) { format!(" {text:>width$}") } else { format!(" {text:width$}") };
            if index == STATE && self.bar > 0 {
                head += &format!(" {:bar$}", "frequency", bar = self.bar);
            }
        }
        match filter.is_empty() {
            true => head,
            false => fitted(&format!("{:SIGNS$}{filter}", ""), self.width),
        }
    }

    fn shown(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let width = |index: usize| self.cells.get(index).copied().unwrap_or_default();
        ORDER.into_iter().map(move |index| (index, width(index))).filter(|(_, width)| *width > 0)
    }

    fn line(&self, row: &Row, is_marked: bool) -> Line<'static> {
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
        let has_age = self.shown().any(|(index, _)| index == AGE);
        for (index, width) in self.shown() {
            // Where there is no room for the age it takes the place of an old state.
            let told = if index == STATE && !row.is_live && !has_age { AGE } else { index };
            let text = row.cells.get(told).map_or("", String::as_str);
            let text = if is_number(index) { format!(" {text:>width$}") } else { format!(" {text:width$}") };
            let style = if index == STATE && row.is_live { Style::new().fg(row.colour) } else { style };
            spans.push(Span::styled(text, style));
            if index == STATE && self.bar > 0 {
                spans.push(Span::raw(" "));
                match row.bar {
                    Some((output, setpoint)) => {
                        spans.extend(bar(output, setpoint, self.bar, row.colour).spans);
                    }
                    None => spans.push(Span::raw(" ".repeat(self.bar))),
                }
            }
        }
        if self.remark > 0 {
            spans.push(Span::styled(format!(" {}", fitted(&row.remark, self.remark)), style));
        }
        Line::from(spans)
    }
}

/// Whether a column is set to the right.
const fn is_number(column: usize) -> bool {
    matches!(column, 1..=3)
}

/// The lines, those that are away first.
fn lines(model: &Model, width: usize) -> Vec<Line<'static>> {
    let away = |line: &LineView| line.link == LineLink::Away;
    let all = || model.plant.lines.iter();
    let told = all().filter(|(_, line)| away(line)).chain(all().filter(|(_, line)| !away(line)));
    let connected = model.plant.is_connected();
    let told = told.map(|(name, line)| match away(line) {
        true => {
            let why = line.error.as_deref().map_or_else(|| "its port is not there".to_owned(), escaped);
            Line::styled(fitted(&format!("{name}: AWAY, {why}"), width), alarm())
        }
        false => {
            let (used, stop) = (line.utilisation_percent, line.worst_case_stop_ms);
            let text = match connected {
                true => format!("{name}: {used:.0} % used, a stop waits {stop} ms at most"),
                false => format!("{name}: (was {used:.0} % used)"),
            };
            Line::styled(fitted(&text, width), Style::new().add_modifier(Modifier::DIM))
        }
    });
    told.collect()
}
