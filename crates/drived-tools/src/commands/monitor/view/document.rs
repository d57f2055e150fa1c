//! A text that is longer than the screen: headed lines, scrolled.

use ratatui::{
    Frame,
    layout::Rect,
    style::{Modifier, Style, Stylize as _},
    text::{Line, Span},
    widgets::Paragraph,
};

use super::super::model::Model;
use drived_screen::row::old;
use drived_words::output;

/// How wide the labels are.
const LABEL: usize = 18;

/// Lines for a width.
pub(super) struct Document {
    width: usize,
    lines: Vec<Line<'static>>,
}

impl Document {
    pub(super) const fn new(width: usize) -> Self {
        Self { width, lines: Vec::new() }
    }

    pub(super) fn heading(&mut self, text: &str) {
        if !self.lines.is_empty() {
            self.lines.push(Line::default());
        }
        self.lines.push(Line::from(text.to_owned()).bold().underlined());
    }

    /// A sentence.
    pub(super) fn say(&mut self, text: &str, style: Style) {
        let lines = output::hanging(text, self.width.max(1)).into_iter();
        self.lines.extend(lines.map(|line| Line::styled(line, style)));
    }

    /// A label and a value; nothing where there is no value.
    pub(super) fn pair(&mut self, label: &str, value: Option<String>) {
        self.styled_pair(label, value, Style::new());
    }

    /// The same for a value that may be old: set in brackets then.
    pub(super) fn dated_pair(&mut self, label: &str, value: Option<String>, is_live: bool) {
        match is_live {
            true => self.pair(label, value),
            false => self.styled_pair(label, value.map(|value| format!("({value})")), old()),
        }
    }

    fn styled_pair(&mut self, label: &str, value: Option<String>, style: Style) {
        let Some(value) = value.filter(|value| !value.is_empty()) else { return };
        let room = self.width.saturating_sub(LABEL).max(1);
        for (index, part) in output::wrapped(&value, room).into_iter().enumerate() {
            let label = if index == 0 { label } else { "" };
            self.lines.push(Line::from(vec![
                Span::styled(format!("{label:LABEL$}"), Style::new().add_modifier(Modifier::DIM)),
                Span::styled(part, style),
            ]));
        }
    }

    /// A line as it is.
    pub(super) fn line(&mut self, line: Line<'static>) {
        self.lines.push(line);
    }

    /// Draws from where the model has scrolled to, and puts that right where it is too far.
    pub(super) fn draw(self, model: &mut Model, frame: &mut Frame<'_>, area: Rect) {
        let height = usize::from(area.height);
        model.page = height.max(1);
        model.scroll = model.scroll.min(self.lines.len().saturating_sub(height));
        let shown = self.lines.into_iter().skip(model.scroll).take(height);
        frame.render_widget(Paragraph::new(shown.collect::<Vec<_>>()), area);
    }
}
