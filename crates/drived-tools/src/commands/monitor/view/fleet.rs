//! The drives as a table, those in trouble first, and the lines below.

use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::Stylize as _,
    text::Line,
    widgets::Paragraph,
};
use tokio::time::Instant;

use super::super::model::Model;
use drived_plant::plant::views::{LineLink, LineView};
use drived_screen::row::{Column, Columns, Row, height_of, line_of_plant};

/// So many lines of the plant are shown.
const LINES: usize = 4;

pub(super) fn draw(model: &mut Model, now: Instant, frame: &mut Frame<'_>, area: Rect) {
    let lines: Vec<Line<'_>> = lines(model, usize::from(area.width));
    let [head, table, plant] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Fill(1),
        Constraint::Length(height_of(lines.len().min(LINES))),
    ])
    .areas(area);
    let height = usize::from(table.height);
    let connected = model.plant.is_connected();
    let rows: Vec<Row> = model.rows().iter().map(|drive| drive.row(now, connected)).collect();
    let marked = rows.iter().position(|row| Some(&row.name) == model.selected.as_ref());
    // The mark stays in sight, and the last row is not far from the bottom.
    let first = marked.unwrap_or_default().saturating_sub(height / 2).min(rows.len().saturating_sub(height));
    let columns = Columns::of(&rows, &Column::ALL, usize::from(area.width));
    let shown = rows.iter().enumerate().skip(first).take(height);
    let drawn: Vec<Line<'_>> = shown.map(|(index, row)| columns.line(row, Some(index) == marked)).collect();
    frame.render_widget(Line::from(columns.head(&filter(model, rows.len()))).dim(), head);
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

/// The lines, those that are away first.
fn lines(model: &Model, width: usize) -> Vec<Line<'static>> {
    let mut lines: Vec<&LineView> = model.plant.lines.values().collect();
    lines.sort_by_key(|line| line.link != LineLink::Away);
    let connected = model.plant.is_connected();
    lines.into_iter().map(|line| line_of_plant(line, connected, width)).collect()
}
