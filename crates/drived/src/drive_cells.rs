//! What a table on a terminal shows of a drive: the cells that the demo and the daemon share.

use drive_core::{Control, Direction, Frequency, State, Status};
use ratatui::{
    style::{Color, Style},
    text::{Line, Span},
};

/// The right end of the frequency bars.
const FULL_SCALE: Frequency = Frequency::from_hertz(50);

/// Running is green at the reference. A drive that does not tell whether it is there is there when its output is as the
/// setpoint.
pub(crate) fn colour(status: &Status, as_setpoint: bool) -> Color {
    match (status.state, status.at_reference.or(Some(as_setpoint))) {
        (State::Fault | State::FaultReaction | State::Unknown, _) => Color::Red,
        (State::Running, Some(true)) => Color::Green,
        (State::Running, _) => Color::Cyan,
        (State::Stopping | State::QuickStop, _) => Color::Yellow,
        (State::NotReady | State::Disabled | State::Ready, _) => Color::Gray,
    }
}

/// Two or three letters of it.
pub(crate) fn direction(status: &Status) -> &'static str {
    match status.direction {
        Some(Direction::Forward) => "fwd",
        Some(Direction::Reverse) => "rev",
        None => "-",
    }
}

/// Who commands, in five letters.
pub(crate) fn control(status: &Status) -> &'static str {
    match status.control {
        Some(Control::Bus) => "bus",
        Some(Control::Terminals) => "terms",
        Some(Control::Panel) => "panel",
        Some(Control::Local) => "local",
        Some(Control::OtherBus) => "other",
        None => "-",
    }
}

/// With one decimal, rounded up.
pub(crate) fn hertz(frequency: Frequency) -> String {
    let tenths = frequency.centihertz().div_ceil(10);
    format!("{}.{}", tenths / 10, tenths % 10)
}

/// The output frequency as a bar in eighths of a character, with a mark where the setpoint is.
pub(crate) fn bar(output: Frequency, setpoint: Frequency, width: usize, colour: Color) -> Line<'static> {
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
    Line::from(cells.collect::<Vec<_>>())
}
