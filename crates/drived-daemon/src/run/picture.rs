//! `drived run` on a terminal: the drives and the lines as a table, the log below it.

use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style, Stylize},
    text::Line,
    widgets::{Block, Borders, Paragraph},
};
use tokio::time::Instant;

use drived_plant::plant::{
    Plant,
    views::{DriveView, LineLink, LineView},
};
use drived_screen::row::{Column, Columns, Row, line_of_plant};
use drived_words::output;

/// From this width on there is room for a whole sentence in the title.
const WIDE: u16 = 76;
/// The log has so many lines at the least, and the lines of the plant so many at the most.
const LOG: u16 = 6;
const LINES: usize = 4;

pub(super) struct Picture {
    /// Those in trouble first.
    drives: Vec<Row>,
    lines: Vec<LineView>,
    /// The newest last.
    log: Vec<String>,
}

impl Picture {
    pub(super) fn of(plant: &Plant, log: Vec<String>) -> Self {
        Self::with(plant.drives(), plant.lines(), log)
    }

    /// A picture of these.
    pub(super) fn with(mut drives: Vec<DriveView>, lines: Vec<LineView>, log: Vec<String>) -> Self {
        // Stable: who troubles nobody stands in the order of the configuration.
        drives.sort_by_key(|drive| drive.snapshot.rank());
        let now = Instant::now();
        let drives = drives.iter().map(|drive| Row::of(drive, now)).collect();
        Self { drives, lines, log }
    }

    pub(super) fn draw(&self, frame: &mut Frame<'_>) {
        let height = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
        let lines = height(self.lines.len().min(LINES));
        let room = frame.area().height.saturating_sub(1 + lines + LOG);
        let drives = height(self.drives.len()).saturating_add(1).min(room);
        let [title, drives, lines, log] = Layout::vertical([
            Constraint::Length(1),
            Constraint::Length(drives),
            Constraint::Length(lines),
            Constraint::Fill(1),
        ])
        .areas(frame.area());
        frame.render_widget(self.title(title.width), title);
        frame.render_widget(self.drives(drives), drives);
        frame.render_widget(self.lines(lines.width), lines);
        frame.render_widget(self.log(log), log);
    }

    fn title(&self, width: u16) -> Line<'_> {
        let (all, troubled) =
            (self.drives.len(), self.drives.iter().filter(|row| row.is_in_trouble()).count());
        let (left, colour) = match troubled {
            0 => (format!(" drived: {all} drives"), Color::Cyan),
            _ => (format!(" drived: {all} drives, {troubled} in trouble"), Color::Yellow),
        };
        let right = if width < WIDE { " Ctrl-C: end " } else { " Ctrl-C: end, by each drive's policy " };
        let room = usize::from(width).saturating_sub(right.len());
        let left: String = left.chars().take(room).collect();
        Line::styled(
            format!("{left:room$}{right}"),
            Style::new().fg(Color::Black).bg(colour).add_modifier(Modifier::BOLD),
        )
    }

    fn drives(&self, area: Rect) -> Paragraph<'_> {
        let columns = Columns::of(&self.drives, &Column::ALL, usize::from(area.width));
        let shown = usize::from(area.height.saturating_sub(1));
        // The last row says how many more there are.
        let rows = if self.drives.len() > shown { shown.saturating_sub(1) } else { shown };
        let more = self.drives.len().saturating_sub(rows);
        let more = (more > 0 && shown > 0).then(|| Line::from(format!("  and {more} more")).dim());
        let head = [Line::from(columns.head("")).dim()].into_iter();
        let rows = self.drives.iter().take(rows).map(|row| columns.line(row, false));
        Paragraph::new(head.chain(rows).chain(more).collect::<Vec<_>>())
    }

    fn lines(&self, width: u16) -> Paragraph<'_> {
        let away_first = |link| self.lines.iter().filter(move |line| line.link == link);
        let lines = away_first(LineLink::Away).chain(away_first(LineLink::Connected));
        let lines = lines.take(LINES).map(|line| line_of_plant(line, true, usize::from(width)));
        Paragraph::new(lines.collect::<Vec<_>>())
    }

    fn log(&self, area: Rect) -> Paragraph<'_> {
        let (width, height) = (usize::from(area.width).max(1), usize::from(area.height.saturating_sub(1)));
        let mut lines: Vec<Line<'_>> = Vec::new();
        for said in self.log.iter().rev() {
            let style = match said {
                said if said.contains(" ERROR ") => Style::new().fg(Color::Red),
                said if said.contains(" WARN ") => Style::new().fg(Color::Yellow),
                _ => Style::new(),
            };
            let parts = output::hanging(&with_time_alone(said), width);
            lines.extend(parts.into_iter().rev().map(|part| Line::styled(part, style)));
            if lines.len() >= height {
                break;
            }
        }
        lines.truncate(height);
        lines.reverse();
        Paragraph::new(lines).block(Block::new().borders(Borders::TOP).title(" log "))
    }
}

/// A line of the log without its date: the screen shows today. One of another form stays as it is.
fn with_time_alone(line: &str) -> String {
    let time = line.split_once(' ').and_then(|(_, rest)| rest.split_once(' '));
    match time {
        Some((time, rest)) if time.contains('+') || time.contains('-') => {
            format!("{} {rest}", time.split('.').next().unwrap_or(time))
        }
        _ => line.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, Frequency};
    use drive_fleet::{DriveSettings, Link};
    use ratatui::{Terminal, backend::TestBackend};

    use super::*;
    use drived_plant::plant::testing::TestPlant;

    fn drawn(plant: &Plant, log: &[&str], width: u16, height: u16) -> String {
        let log = log.iter().map(|line| (*line).to_owned()).collect();
        let picture = Picture::of(plant, log);
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| picture.draw(frame)).unwrap();
        terminal.backend().to_string()
    }

    #[tokio::test(start_paused = true)]
    async fn sixty_columns_cut_no_number_and_who_is_lost_stands_first_with_what_it_showed_in_brackets() {
        let TestPlant { plant, machines, line: _line, witnesses: _witnesses } = TestPlant::of(3).await;
        let drive = plant.fleet().drive("pump 1").unwrap();
        assert!(drive.set_setpoint(Frequency::from_decihertz(405)).await.is_confirmed());
        assert!(drive.start(Direction::Reverse).await.is_confirmed());
        let _ = drive
            .wait_until(|seen| seen.status.as_ref().is_some_and(|seen| seen.value.at_reference == Some(true)))
            .await;
        let lost = plant.fleet().drive("pump 3").unwrap();
        machines[2].mute();
        let _ = lost.wait_until(|seen| seen.link == Link::Lost).await;
        for width in [60, 80, 140] {
            let screen = drawn(&plant, &[], width, 20);
            let rows: Vec<&str> = screen.lines().collect();
            assert!(rows[0].contains("drived: 3 drives, 1 in trouble"), "{screen}");
            assert!(
                rows[2].contains("!pump 3") && rows[2].contains("lost") && rows[2].contains(" old"),
                "{screen}"
            );
            assert_eq!(rows[2].matches("0.0").count(), rows[2].matches("(0.0").count(), "{screen}");
            let running = rows.iter().find(|row| row.contains("pump 1")).unwrap();
            assert!(
                running.contains("running rev")
                    && running.contains("40.5/40.5 ")
                    && running.contains(" A bus "),
                "{screen}"
            );
            assert!(screen.contains("north: ") && screen.contains("% used, a stop waits"), "{screen}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_no_room_is_counted_and_the_log_has_its_own() {
        let TestPlant { plant, witnesses: _witnesses, .. } =
            TestPlant::with(20, DriveSettings::watched).await;
        let log = ["2026-11-21 14:03:21.350+01:00 WARN  north: pump 3 lost", "another form"];
        let screen = drawn(&plant, &log, 80, 16);
        // A title, eight rows with their heads, one line, the log.
        assert!(screen.contains("and 14 more"), "{screen}");
        assert!(screen.contains("14:03:21 WARN  north: pump 3 lost") && !screen.contains("2026"), "{screen}");
        assert!(screen.contains("another form"), "{screen}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_screen_that_is_too_small_is_no_panic() {
        let TestPlant { plant, witnesses: _witnesses, .. } = TestPlant::of(2).await;
        for (width, height) in [(1, 1), (5, 2), (30, 5), (200, 3)] {
            drawn(&plant, &["a line"], width, height);
        }
    }
}
