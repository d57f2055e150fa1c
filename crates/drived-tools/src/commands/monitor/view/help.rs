//! The keys.

use ratatui::{Frame, layout::Rect, style::Stylize as _, text::Line, widgets::Paragraph};

use drived_words::output;

const KEYS: [(&str, &str); 18] = [
    ("Ctrl-S", "STOP ALL drives, at once, in every view and while a search is typed"),
    ("Ctrl-T", "stop the drive that is marked or shown"),
    (
        "",
        "What became of a stop is counted at the top until every drive is accounted for. It is no emergency stop.",
    ),
    ("1 2 3, Tab", "fleet, lines, events"),
    ("Enter, Esc", "open the marked drive; back, and close what was told of a stop"),
    ("arrows, j k", "mark a drive, or scroll"),
    ("PgUp PgDn", "a page up or down"),
    ("Home End", "to the first or the last"),
    ("/", "search: every word must be in the row; Enter keeps it, Esc clears it"),
    ("g", "fleet: the next group"),
    ("f", "events: everything, commands, alarms"),
    ("left right", "drive: back and forth in time; lines: the line before or after"),
    ("space", "drive: hold the curves still, and let them go on"),
    ("+ -", "drive: less or more time"),
    ("c", "drive: the curves alone, with current and torque; and back"),
    ("Ctrl-Z", "suspend; fg goes on"),
    ("q, Ctrl-C", "end; motors are left as they are, and a stop that the daemon has goes on"),
    ("(…)", "what stands in brackets is old: it was so, as long ago as stands beside it"),
];

/// How wide the names of the keys are.
const KEY: usize = 13;

pub(super) fn draw(frame: &mut Frame<'_>, area: Rect) {
    let room = usize::from(area.width).saturating_sub(KEY).max(1);
    let lines = KEYS.iter().flat_map(|(key, what)| {
        let parts = output::wrapped(what, room).into_iter().enumerate();
        parts.map(|(index, part)| {
            let key = if index == 0 { *key } else { "" };
            Line::from(vec![format!("{key:KEY$}").bold(), part.into()])
        })
    });
    frame.render_widget(Paragraph::new(lines.collect::<Vec<_>>()), area);
}
