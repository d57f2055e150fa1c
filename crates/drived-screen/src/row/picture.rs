//! What the tables on a terminal have in common besides their cells.

use drive_core::Frequency;
use ratatui::{
    style::{Color, Modifier, Style},
    text::{Line, Span},
};

use super::text::fitted;
use drived_plant::plant::views::{LineLink, LineView};
use drived_words::logging::escaped;

/// The right end of the frequency bars.
const FULL_SCALE: Frequency = Frequency::from_hertz(50);

/// What is old. The brackets say it where nothing is dim.
pub fn old() -> Style {
    Style::new().fg(Color::DarkGray).add_modifier(Modifier::DIM)
}

/// What somebody has to see to.
pub fn alarm() -> Style {
    Style::new().fg(Color::Red).add_modifier(Modifier::BOLD)
}

/// The output frequency as a bar in eighths of a character, with a mark where the setpoint is.
pub(super) fn bar(output: Frequency, setpoint: Frequency, width: usize, colour: Color) -> Vec<Span<'static>> {
    const EIGHTHS: [&str; 8] = [" ", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let eighths = |frequency: Frequency| {
        let share = u64::from(frequency.centihertz()) * width as u64 * 8 / u64::from(FULL_SCALE.centihertz());
        usize::try_from(share).unwrap_or(usize::MAX).min(width * 8)
    };
    let filled = eighths(output);
    let mark = (eighths(setpoint) / 8).min(width.saturating_sub(1));
    let cells = (0..width).map(|cell| {
        let here = filled.saturating_sub(cell * 8).min(8);
        let text = EIGHTHS.get(here).copied().unwrap_or("█");
        match (cell == mark && setpoint > Frequency::ZERO, here) {
            (true, 8) => Span::styled("┃", Style::new().fg(Color::Black).bg(colour)),
            (true, _) => Span::styled("┃", Style::new().fg(Color::White)),
            (false, 0) => Span::styled("·", Style::new().fg(Color::DarkGray)),
            (false, _) => Span::styled(text, Style::new().fg(colour)),
        }
    });
    cells.collect()
}

/// A line of the plant in a line: how it is used, or why it is away.
pub fn line_of_plant(line: &LineView, is_live: bool, width: usize) -> Line<'static> {
    let LineView { name, utilisation_percent: used, worst_case_stop_ms: stop, .. } = line;
    let (text, style) = match (line.link, is_live) {
        (LineLink::Away, _) => {
            let why = line.error.as_deref().map_or_else(|| "its port is not there".to_owned(), escaped);
            (format!("{name}: AWAY, {why}"), alarm())
        }
        (LineLink::Connected, true) => {
            (format!("{name}: {used:.0} % used, a stop waits {stop} ms at most"), dim())
        }
        (LineLink::Connected, false) => (format!("{name}: (was {used:.0} % used)"), dim()),
    };
    Line::styled(fitted(&text, width), style)
}

fn dim() -> Style {
    Style::new().add_modifier(Modifier::DIM)
}
