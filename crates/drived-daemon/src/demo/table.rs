//! What the demo's screen looks like.

use std::collections::VecDeque;

use drive_core::Direction;
use drive_fleet::Event;
use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style, Stylize},
    text::{Line, Span},
    widgets::{self, Block, Borders, Paragraph, Table},
};
use tokio::time::Instant;

use super::{
    meter::HEADS,
    unit::{Done, Order},
};
use drived_plant::plant::views::DriveView;
use drived_screen::row::{Column, Columns, Row, hertz};
use drived_words::output;

/// What stands beside the last command.
const COLUMNS: [Column; 3] = [Column::State, Column::Frequency, Column::Current];

/// Before the text of an event: its time and its drive.
const EVENT_INDENT: usize = 20;

/// From this width on there is room for whole sentences.
const WIDE: u16 = 110;

pub(super) struct Picture<'a> {
    pub(super) began: Instant,
    /// The drives that are still waited for, once the motors are being stopped.
    pub(super) waited_for: Option<String>,
    /// Where its page is, in words.
    pub(super) page: &'a str,
    /// The drives, with how their last commands ended.
    pub(super) units: Vec<(DriveView, Option<Done>)>,
    /// The cells of each line, under [`HEADS`].
    pub(super) lines: Vec<[String; 8]>,
    /// The newest first.
    pub(super) events: &'a VecDeque<Event>,
}

impl Picture<'_> {
    pub(super) fn draw(&self, frame: &mut Frame<'_>) {
        let height = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
        let [title, drives, lines, events] = Layout::vertical([
            Constraint::Length(1),
            Constraint::Length(height(self.units.len() + 2)),
            Constraint::Length(height(self.lines.len() + 2)),
            Constraint::Fill(1),
        ])
        .areas(frame.area());
        frame.render_widget(self.title(title.width), title);
        frame.render_widget(self.drives(drives.width), drives);
        frame.render_widget(self.lines(), lines);
        frame.render_widget(self.events(events), events);
    }

    fn title(&self, width: u16) -> Line<'_> {
        let (left, right, colour) = match &self.waited_for {
            Some(drives) => {
                (format!(" stopping, waiting for {drives}"), " Ctrl-C: leave now ", Color::Yellow)
            }
            None => {
                (format!(" drived demo, simulated  {}", self.page), " Ctrl-C: stop the motors ", Color::Cyan)
            }
        };
        let room = usize::from(width).saturating_sub(right.len());
        let left = match left.chars().count() > room {
            true => left.chars().take(room.saturating_sub(1)).chain(['…']).collect(),
            false => left,
        };
        Line::styled(
            format!("{left:room$}{right}"),
            Style::new().fg(Color::Black).bg(colour).add_modifier(Modifier::BOLD),
        )
    }

    fn drives(&self, width: u16) -> Paragraph<'_> {
        let now = Instant::now();
        let rows = self.units.iter().map(|(drive, last)| {
            let mut row = Row::of(drive, now);
            if !row.is_in_trouble() {
                row.note = last.as_ref().map_or_else(String::new, |last| told(last, width >= WIDE));
            }
            row
        });
        let rows: Vec<_> = rows.collect();
        let columns = Columns::of(&rows, &COLUMNS, usize::from(width));
        let head = Line::from(columns.head("")).dim();
        let drawn = rows.iter().map(|row| columns.line(row, false));
        Paragraph::new([head].into_iter().chain(drawn).collect::<Vec<_>>())
    }

    fn lines(&self) -> Table<'_> {
        let widths =
            HEADS.map(|head| Constraint::Length(u16::try_from(head.len()).unwrap_or(u16::MAX).max(9)));
        Table::new(self.lines.iter().map(|cells| widgets::Row::new(cells.iter().map(String::as_str))), widths)
            .header(widgets::Row::new(HEADS).style(Style::new().add_modifier(Modifier::DIM)))
            .column_spacing(1)
    }

    fn events(&self, area: Rect) -> Paragraph<'_> {
        let room = usize::from(area.width).saturating_sub(EVENT_INDENT).max(1);
        let lines = self.events.iter().take(usize::from(area.height)).flat_map(|event| {
            let at = event.at.saturating_duration_since(self.began).as_millis();
            let at = format!(" {:>4}.{:01} s ", at / 1_000, at % 1_000 / 100);
            let style = if event.kind.is_alarm() { Style::new().fg(Color::Red) } else { Style::new() };
            output::wrapped(&event.kind.to_string(), room).into_iter().enumerate().map(move |(line, text)| {
                let (at, name) =
                    if line == 0 { (at.clone(), event.drive.to_string()) } else { <_>::default() };
                Line::from(vec![
                    Span::raw(format!("{at:10}")).dim(),
                    Span::styled(format!("{name:<9} {text}"), style),
                ])
            })
        });
        let block = Block::new().borders(Borders::TOP).title(" events ");
        Paragraph::new(lines.collect::<Vec<_>>()).block(block)
    }
}

/// The last command and how it ended: a word or two, or the whole sentence where there is room.
fn told(done: &Done, wide: bool) -> String {
    let order = match (done.order, wide) {
        (order, true) => order.to_string(),
        (Order::Setpoint(frequency), false) => format!("{} Hz", hertz(frequency)),
        (Order::Start(Direction::Forward), false) => "start fwd".to_owned(),
        (Order::Start(Direction::Reverse), false) => "start rev".to_owned(),
        (Order::Stop(_), false) => "stop".to_owned(),
        (Order::Reset, false) => "reset".to_owned(),
    };
    match (done.outcome.is_confirmed(), wide) {
        (true, true) => format!("{order}: confirmed, {} ms", done.took.as_millis()),
        (false, true) => format!("{order}: {}", done.outcome),
        (true, false) => format!("✓ {order}"),
        (false, false) => format!("✗ {order}"),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use drive_fleet::{Cause, EventKind, Outcome};
    use ratatui::{Terminal, backend::TestBackend};
    use serde_json::json;

    use super::*;
    use drived_plant::plant::testing::{read, told};

    fn drawn(width: u16, height: u16) -> String {
        let named = |name: &str, status: serde_json::Value, shows: &str| {
            let mut drive = told(name);
            (drive["status"], drive["shows"]) = (status, shows.into());
            drive["setpoint"] = json!({"frequency_hz": 40.0});
            read(&drive)
        };
        let status = json!({"quality": "good", "state": "running", "direction": "reverse",
            "output_frequency_hz": 25.0, "current_a": 2.3, "control": "bus", "raw": []});
        let started = Done {
            order: Order::Start(Direction::Reverse),
            took: Duration::from_millis(48),
            outcome: Outcome::Confirmed,
        };
        let events = VecDeque::from([Event::now("atv312@1", EventKind::ControlReturned, Cause::Drive)]);
        let picture = Picture {
            began: Instant::now(),
            waited_for: None,
            page: "page: http://127.0.0.1:7580/",
            units: vec![
                (named("atv312@1", status, "running"), Some(started)),
                (named("atv21@2", json!({"quality": "missing"}), "lost"), None),
            ],
            lines: vec![
                ["19200 8E1", "97.00 %", "7.1", "900", "2.01 ms", "2.00 ms", "0", "0"].map(str::to_owned),
            ],
            events: &events,
        };
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| picture.draw(frame)).unwrap();
        terminal.backend().to_string()
    }

    #[test]
    fn a_small_screen_shows_each_drive_in_a_line() {
        let screen = drawn(80, 24);
        assert!(
            screen.contains("atv312@1 running rev  ██████···┃··  25.0/40.0   2.3 A ✓ start rev"),
            "{screen}"
        );
        assert!(screen.contains("page: http://127.0.0.1:7580/ "), "{screen}");
        assert!(screen.contains("atv21@2  lost "), "{screen}");
        assert!(screen.contains("19200 8E1 97.00 %   7.1       900"), "{screen}");
    }

    #[test]
    fn a_large_screen_says_how_the_last_command_ended() {
        assert!(drawn(120, 40).contains("start reverse: confirmed, 48 ms"));
    }

    #[test]
    fn a_screen_that_is_too_small_is_no_panic() {
        for (width, height) in [(1, 1), (10, 3), (79, 5)] {
            drawn(width, height);
        }
    }
}
