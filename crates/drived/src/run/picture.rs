//! `drived run` on a terminal: the drives and the lines as a table, the log below it.

use std::sync::Arc;

use drive_core::Setpoint;
use drive_fleet::{DriveHandle, Freshness, Link, Snapshot};
use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Modifier, Style, Stylize},
    text::Line,
    widgets::{Block, Borders, Cell, Paragraph, Row, Table},
};
use tokio::time::Instant;

use crate::{
    drive_cells::{bar, colour, control, direction, hertz},
    output,
    plant::{
        Plant,
        views::{LineLink, LineView},
    },
};

/// From this width on there is room for a bar, and from this one for why a start would be refused.
const WITH_BAR: u16 = 76;
const WITH_REMARK: u16 = 110;
const BAR: u16 = 12;
/// What the columns behind the name take, with their gaps.
const NUMBERS: u16 = 12 + 3 + 11 + 7 + 5 + 5 + 6;
/// The log has so many lines at the least, and the lines of the plant so many at the most.
const LOG: u16 = 6;
const LINES: usize = 4;

pub(super) struct Picture {
    now: Instant,
    /// Those in trouble first.
    drives: Vec<Arc<Snapshot>>,
    lines: Vec<LineView>,
    /// The newest last.
    log: Vec<String>,
}

impl Picture {
    pub(super) fn of(plant: &Plant, log: Vec<String>) -> Self {
        let mut drives: Vec<_> = plant.fleet().drives().iter().map(DriveHandle::snapshot).collect();
        let now = Instant::now();
        // Stable: who troubles nobody stands in the order of the configuration.
        drives
            .sort_by_cached_key(|drive| drive.concern(now).map_or(usize::MAX, |concern| concern.kind.rank()));
        Self { now, drives, lines: plant.lines(), log }
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
        frame.render_widget(self.lines(), lines);
        frame.render_widget(self.log(log), log);
    }

    fn title(&self, width: u16) -> Line<'_> {
        let (all, troubled) =
            (self.drives.len(), self.drives.iter().filter(|drive| in_trouble(drive, self.now)).count());
        let (left, colour) = match troubled {
            0 => (format!(" drived: {all} drives"), Color::Cyan),
            _ => (format!(" drived: {all} drives, {troubled} in trouble"), Color::Yellow),
        };
        let right = if width < WITH_BAR { " Ctrl-C: end " } else { " Ctrl-C: end, by each drive's policy " };
        let room = usize::from(width).saturating_sub(right.len());
        let left: String = left.chars().take(room).collect();
        Line::styled(
            format!("{left:room$}{right}"),
            Style::new().fg(Color::Black).bg(colour).add_modifier(Modifier::BOLD),
        )
    }

    fn drives(&self, area: Rect) -> Table<'_> {
        let with_bar = area.width >= WITH_BAR;
        let with_remark = area.width >= WITH_REMARK;
        let longest = self.drives.iter().map(|drive| drive.name.chars().count()).max().unwrap_or(0).max(7);
        let free = area.width.saturating_sub(NUMBERS + if with_bar { BAR + 1 } else { 0 });
        let name = u16::try_from(longest).unwrap_or(u16::MAX).min(free.max(7)).min(24);
        let shown = usize::from(area.height.saturating_sub(1));
        // The last row says how many more there are.
        let rows = match self.drives.len() > shown {
            true => shown.saturating_sub(1),
            false => shown,
        };
        let more = self.drives.len().saturating_sub(rows);
        let more =
            (more > 0 && shown > 0).then(|| Row::new([format!("and {more}"), "more".to_owned()]).dim());
        let rows = self.drives.iter().take(rows).map(|drive| {
            let cells = cells(drive, self.now, usize::from(name), with_bar, with_remark);
            Row::new(cells)
        });
        let mut widths = vec![Constraint::Length(name), Constraint::Length(12), Constraint::Length(3)];
        let mut heads = vec!["drive", "state", "dir"];
        if with_bar {
            widths.push(Constraint::Length(BAR));
            heads.push("frequency");
        }
        widths.extend([11, 7, 5, 5].map(Constraint::Length));
        heads.extend(["out/set Hz", "current", "ctrl", "fault"]);
        if with_remark {
            widths.push(Constraint::Fill(1));
            heads.push("");
        }
        Table::new(rows.chain(more).collect::<Vec<_>>(), widths)
            .header(Row::new(heads).style(Style::new().add_modifier(Modifier::DIM)))
            .column_spacing(1)
    }

    fn lines(&self) -> Paragraph<'_> {
        let of = |line: &LineView| match line.link {
            LineLink::Connected => Line::from(format!(
                "{}: {:.0} % used, a stop waits {} ms at most",
                line.name, line.utilisation_percent, line.worst_case_stop_ms
            ))
            .dim(),
            LineLink::Away => {
                let why = line.error.as_deref().unwrap_or("its port is not there");
                Line::from(format!("{}: AWAY, {why}", line.name)).red()
            }
        };
        let away_first = |link| self.lines.iter().filter(move |line| line.link == link);
        let lines = away_first(LineLink::Away).chain(away_first(LineLink::Connected));
        Paragraph::new(lines.take(LINES).map(of).collect::<Vec<_>>())
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

/// Whether somebody should look at it.
fn in_trouble(drive: &Snapshot, now: Instant) -> bool {
    drive.concern(now).is_some_and(|concern| concern.kind.severity().is_trouble())
}

fn cells(
    drive: &Snapshot,
    now: Instant,
    name: usize,
    with_bar: bool,
    with_remark: bool,
) -> Vec<Cell<'static>> {
    let name = match drive.name.chars().count() > name {
        true => drive.name.chars().take(name.saturating_sub(1)).chain(['…']).collect(),
        false => drive.name.to_string(),
    };
    let name = Cell::from(name).bold();
    let fresh = drive.status.as_ref().filter(|_| drive.freshness(now) == Freshness::Fresh);
    // What is old is not shown as if it were so now.
    let Some(status) = fresh.map(|status| &status.value) else {
        let (word, colour) = match drive.link {
            Link::Connecting => ("connecting", Color::Gray),
            Link::Connected => ("no news", Color::Yellow),
            Link::Lost => ("LOST", Color::Red),
        };
        let mut cells = vec![name, Cell::from(word).fg(colour)];
        if with_remark {
            let empty = if with_bar { 7 } else { 6 };
            cells.extend(std::iter::repeat_n(Cell::default(), empty - 1));
            cells.push(remark(drive, now));
        }
        return cells;
    };
    let output = status.output_frequency.unwrap_or_default();
    let setpoint = match drive.setpoint {
        Some(Setpoint::Frequency(frequency)) => Some(frequency),
        _ => None,
    };
    let is_there = setpoint.is_none_or(|setpoint| setpoint == output);
    let colour = colour(status, is_there);
    let state = match drive.stop {
        Some(_) => Cell::from("stop pending").fg(Color::Yellow),
        None => Cell::from(status.state.to_string()).fg(colour),
    };
    let mut cells = vec![name, state, Cell::from(direction(status))];
    if with_bar {
        cells.push(Cell::from(bar(output, setpoint.unwrap_or_default(), usize::from(BAR), colour)));
    }
    let asked = setpoint.map_or_else(|| "-".to_owned(), hertz);
    cells.push(Cell::from(format!("{:>5}/{asked:<5}", hertz(output))));
    cells.push(Cell::from(format!("{:>7}", output::current(status).unwrap_or_else(|| "-".to_owned()))));
    cells.push(Cell::from(control(status)));
    let fault = drive.trips.back().filter(|_| status.is_fault());
    let known = fault.and_then(|trip| trip.faults.as_ref()?.present.first().copied());
    let fault = match (status.is_fault(), known) {
        (true, Some(fault)) => Cell::from(fault.mnemonic()).fg(Color::Red),
        (true, None) => {
            Cell::from(status.fault_code.map_or_else(|| "yes".to_owned(), |code| code.to_string()))
                .fg(Color::Red)
        }
        (false, _) => Cell::from("-"),
    };
    cells.push(fault);
    if with_remark {
        cells.push(remark(drive, now));
    }
    cells
}

fn remark(drive: &Snapshot, now: Instant) -> Cell<'static> {
    let cell = Cell::from(remark_text(drive, now));
    if in_trouble(drive, now) { cell.fg(Color::Yellow) } else { cell.dim() }
}

/// What troubles it, or why a start would be refused.
fn remark_text(drive: &Snapshot, now: Instant) -> String {
    let refused = || drive.start_refused(now).map(ToString::to_string).unwrap_or_default();
    drive.concern(now).map_or_else(refused, |concern| concern.to_string())
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, Frequency};
    use drive_fleet::DriveSettings;
    use ratatui::{Terminal, backend::TestBackend};

    use super::*;
    use crate::plant::testing::{TestPlant, every_pair_of_troubles};

    fn drawn(plant: &Plant, log: &[&str], width: u16, height: u16) -> String {
        let log = log.iter().map(|line| (*line).to_owned()).collect();
        let picture = Picture::of(plant, log);
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| picture.draw(frame)).unwrap();
        terminal.backend().to_string()
    }

    #[tokio::test(start_paused = true)]
    async fn sixty_columns_cut_no_number_and_who_is_lost_shows_none_and_stands_first() {
        let TestPlant { plant, machines, line: _line } = TestPlant::of(3).await;
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
            assert!(rows[2].contains("pump 3") && rows[2].contains("LOST"), "{screen}");
            assert!(!rows[2].contains("Hz") && !rows[2].contains("0.0"), "{screen}");
            let running = rows.iter().find(|row| row.contains("pump 1")).unwrap();
            assert!(
                running.contains("rev") && running.contains("40.5/40.5 ") && running.contains(" A bus"),
                "{screen}"
            );
            assert!(screen.contains("north: ") && screen.contains("% used, a stop waits"), "{screen}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn of_every_pair_of_troubles_the_worst_is_told_as_by_everybody() {
        let now = Instant::now();
        for (drive, _, worst) in every_pair_of_troubles(now) {
            assert_eq!(remark_text(&drive, now), worst);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn who_has_no_room_is_counted_and_the_log_has_its_own() {
        let TestPlant { plant, .. } = TestPlant::with(20, DriveSettings::watched).await;
        let log = ["2026-11-21 14:03:21.350+01:00 WARN  north: pump 3 lost", "another form"];
        let screen = drawn(&plant, &log, 80, 16);
        // A title, eight rows with their heads, one line, the log.
        assert!(screen.contains("and 14  more"), "{screen}");
        assert!(screen.contains("14:03:21 WARN  north: pump 3 lost") && !screen.contains("2026"), "{screen}");
        assert!(screen.contains("another form"), "{screen}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_screen_that_is_too_small_is_no_panic() {
        let TestPlant { plant, .. } = TestPlant::of(2).await;
        for (width, height) in [(1, 1), (5, 2), (30, 5), (200, 3)] {
            drawn(&plant, &["a line"], width, height);
        }
    }
}
