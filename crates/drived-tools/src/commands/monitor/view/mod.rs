//! What is drawn: a title, what became of the stops, what is looked at, and the keys.

mod document;
mod drive;
mod events;
mod fleet;
mod help;
mod line;
mod plot;
#[cfg(test)]
mod tests;

use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style},
    text::Line,
    widgets::Paragraph,
};
use tokio::time::Instant;

use super::{
    model::{Connection, Model, View},
    words,
};
use drived_screen::row::{fitted, height_of};
use drived_words::{moment, output};

/// What stands beside every stop.
const NO_EMERGENCY_STOP: &str = "no emergency stop";

/// Draws everything; notes in the model how much of it there was room for.
pub(super) fn draw(model: &mut Model, now: Instant, frame: &mut Frame<'_>) {
    let width = usize::from(frame.area().width);
    let troubles = troubles(model, now, width);
    let accounts = accounts(model, width);
    let [title, above, stops, body, footer] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(height_of(troubles.len())),
        Constraint::Length(height_of(accounts.len())),
        Constraint::Fill(1),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    frame.render_widget(title_of(model, now, width), title);
    frame.render_widget(Paragraph::new(troubles), above);
    frame.render_widget(Paragraph::new(accounts), stops);
    if model.help {
        help::draw(frame, body);
    } else {
        view(model, now, frame, body);
    }
    frame.render_widget(keys(model, width), footer);
    if !has_colours() {
        without_colours(frame);
    }
}

fn view(model: &mut Model, now: Instant, frame: &mut Frame<'_>, area: Rect) {
    match model.view.clone() {
        View::Fleet => fleet::draw(model, now, frame, area),
        View::Drive(name) => drive::draw(model, &name, now, frame, area),
        View::Line(name) => line::draw(model, &name, frame, area),
        View::Events => events::draw(model, frame, area),
    }
}

/// Everything keeps its words, its brackets and its weight.
fn without_colours(frame: &mut Frame<'_>) {
    for cell in &mut frame.buffer_mut().content {
        (cell.fg, cell.bg) = (Color::Reset, Color::Reset);
    }
}

fn title_of(model: &Model, now: Instant, width: usize) -> Line<'static> {
    let plant = &model.plant;
    let troubled = plant.drives.iter().filter(|drive| drive.is_in_trouble()).count();
    let drives = output::counted(plant.drives.len(), "drive", "drives");
    let trouble = if troubled > 0 { format!(", {troubled} in trouble") } else { String::new() };
    let (state, colour) = match &plant.connection {
        Connection::Live if plant.silent_for(now).is_some() => ("SILENT", Color::Red),
        Connection::Live if troubled > 0 => ("live", Color::Yellow),
        Connection::Live => ("live", Color::Cyan),
        Connection::Reading => ("reading", Color::Yellow),
        Connection::Gone { .. } => ("NOT CONNECTED", Color::Red),
    };
    let demo = if plant.is_demo { ", simulated" } else { "" };
    let right = format!("{state} {}", moment::told(&chrono::Local::now(), "%H:%M:%S"));
    let room = width.saturating_sub(right.chars().count() + 3);
    let left = fitted(&format!("drived monitor: {drives}{trouble}{demo}"), room);
    // Without colours the bar is seen by its reversal.
    let style = match has_colours() {
        true => Style::new().fg(Color::Black).bg(colour),
        false => Style::new().add_modifier(Modifier::REVERSED),
    };
    let style = style.add_modifier(Modifier::BOLD);
    Line::styled(format!(" {left:room$} {right} "), style)
}

fn has_colours() -> bool {
    output::is_coloured(&std::io::stdout())
}

/// What makes everything on the screen old.
fn troubles(model: &Model, now: Instant, width: usize) -> Vec<Line<'static>> {
    let silent = model.plant.silent_for(now).map(output::age);
    let text = match &model.plant.connection {
        Connection::Gone { since, why } => {
            let since = output::age(now.saturating_duration_since(*since));
            format!("NOT CONNECTED for {since}, trying again: everything below is old. {why}")
        }
        Connection::Reading => format!("reading the state: {}", model.plant.source),
        Connection::Live => match silent {
            Some(silent) => format!("nothing was heard for {silent}: everything below is old"),
            None => return Vec::new(),
        },
    };
    let style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);
    output::wrapped(&text, width.max(1)).into_iter().map(|line| Line::styled(line, style)).collect()
}

/// What became of the stops.
fn accounts(model: &Model, width: usize) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    for account in &model.accounts {
        let colour = match (account.is_open(), account.is_done()) {
            (true, _) => Color::Yellow,
            (false, true) => Color::Green,
            (false, false) => Color::Red,
        };
        let bold = Style::new().fg(colour).add_modifier(Modifier::BOLD);
        let left = account.left();
        let last = if account.is_open() { "" } else { " (Esc: close)" };
        let given = format!("at {}, {NO_EMERGENCY_STOP}", words::clock(account.unix_ms));
        let more = if left.is_empty() { given } else { format!("{given}; {left}") };
        let sentence = output::hanging(&account.sentence(), width.max(1)).into_iter();
        lines.extend(sentence.map(|line| Line::styled(line, bold)));
        lines.push(Line::styled(fitted(&format!("  {more}{last}"), width), Style::new().fg(colour)));
    }
    lines
}

fn keys(model: &Model, width: usize) -> Line<'static> {
    let style = Style::new().add_modifier(Modifier::REVERSED);
    let text = if let Some(hint) = &model.hint {
        hint.clone()
    } else if model.is_typing {
        format!("Ctrl-S STOP ALL  search: {}_  Enter: keep, Esc: clear", model.search)
    } else {
        let this = model.marked().map(|name| format!("  Ctrl-T stop {name}"));
        let stop = match model.plant.may_stop {
            true => format!("Ctrl-S STOP ALL ({NO_EMERGENCY_STOP}){}", this.unwrap_or_default()),
            false => "you have no right to stop".to_owned(),
        };
        let shortest = "  ? keys";
        let (short, long) = ("  ? keys  q end", "  Tab views  Enter open  / search  ? keys  q end");
        match stop.chars().count() + long.len() <= width {
            true => stop + long,
            false if stop.chars().count() + short.len() <= width => stop + short,
            false if stop.chars().count() + shortest.len() <= width => stop + shortest,
            false => format!("Ctrl-S STOP ALL ({NO_EMERGENCY_STOP}){short}"),
        }
    };
    Line::styled(format!("{:width$}", fitted(&text, width)), style)
}
