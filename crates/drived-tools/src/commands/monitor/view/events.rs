//! What has happened, the newest first.

use ratatui::{Frame, layout::Rect, style::Style};

use super::{
    super::{happening::Kind, model::Model, words},
    document::Document,
};
use drived_screen::row::alarm;

pub(super) fn draw(model: &mut Model, frame: &mut Frame<'_>, area: Rect) {
    let mut document = Document::new(usize::from(area.width));
    let found = model.happenings();
    let search = if model.search.is_empty() { String::new() } else { format!(", \"{}\"", model.search) };
    let more = if model.kind == Kind::All { "" } else { " only" };
    document.heading(&format!(
        "events: {}{more}{search}: {} (f: others, /: search)",
        model.kind.name(),
        found.len()
    ));
    for one in found {
        let style = if one.is_alarm { alarm() } else { Style::new() };
        document.say(&format!("{} {}", words::clock(one.unix_ms), one.sentence()), style);
    }
    document.draw(model, frame, area);
}
