//! A curve drawn in a terminal, or in whatever takes its lines.

use ratatui::{
    buffer::Buffer,
    layout::Rect,
    symbols::Marker,
    text::Line,
    widgets::{Axis, Chart, Dataset, GraphType, Widget as _},
};

/// A step of a curve: where it lies, and its least, mean and greatest.
pub(crate) struct Step {
    pub(crate) place: f64,
    pub(crate) least: f64,
    pub(crate) mean: f64,
    pub(crate) greatest: f64,
}

/// Columns of a drawing with so many steps that each has a dot of its own: two dots in a column.
pub(crate) const STEPS: u16 = 140;
const COLUMNS: u16 = 90;
const ROWS: u16 = 15;

/// Draws steps that lie between two places, with what stands at both ends. Where two neighbours are farther apart than `every` nothing is drawn.
pub(crate) fn drawn(steps: &[Step], bounds: [f64; 2], every: f64, ends: [String; 2]) -> Vec<String> {
    let least = steps.iter().map(|step| step.least).fold(f64::INFINITY, f64::min);
    let greatest = steps.iter().map(|step| step.greatest).fold(f64::NEG_INFINITY, f64::max);
    // A curve that is flat lies in the middle.
    let around = if greatest > least { 0.0 } else { greatest.abs().max(1.0) / 10.0 };
    let (low, high) = (least - around, greatest + around);
    let mut strokes: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut last: Option<f64> = None;
    for step in steps {
        match (strokes.last_mut(), last) {
            (Some(stroke), Some(last)) if step.place - last <= every * 1.5 => {
                stroke.push((step.place, step.mean));
            }
            _ => strokes.push(vec![(step.place, step.mean)]),
        }
        last = Some(step.place);
    }
    strokes.extend(steps.iter().map(|step| vec![(step.place, step.least), (step.place, step.greatest)]));
    let sets = strokes
        .iter()
        .map(|stroke| Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).data(stroke));
    let labels = [low, f64::midpoint(low, high), high].map(|value| Line::from(format!("{value:.2}")));
    let chart = Chart::new(sets.collect())
        .x_axis(Axis::default().bounds(bounds).labels(ends.map(Line::from)))
        .y_axis(Axis::default().bounds([low, high]).labels(labels));
    let area = Rect::new(0, 0, COLUMNS, ROWS);
    let mut buffer = Buffer::empty(area);
    chart.render(area, &mut buffer);
    let row = |y| {
        (0..COLUMNS)
            .filter_map(|x| buffer.cell((x, y)))
            .map(ratatui::buffer::Cell::symbol)
            .collect::<String>()
    };
    (0..ROWS).map(|y| row(y).trim_end().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(place: f64, value: f64) -> Step {
        Step { place, least: value, mean: value, greatest: value }
    }

    #[test]
    fn a_gap_is_left_empty_and_both_ends_are_named() {
        let known = (0..40).chain(60..100).map(|place| step(f64::from(place), 30.0)).collect::<Vec<_>>();
        let lines = drawn(&known, [0.0, 100.0], 1.0, ["03:00".to_owned(), "03:30".to_owned()]);
        let is_drawn = |line: &&String| line.chars().any(|sign| ('\u{2801}'..='\u{28FF}').contains(&sign));
        let curve = lines.iter().find(is_drawn).unwrap_or_else(|| panic!("no curve: {lines:#?}"));
        // Nothing over the fifth of the width in which nothing is known.
        assert!(curve.trim_end().contains(&" ".repeat(12)), "{lines:#?}");
        assert!(
            lines.last().unwrap().contains("03:00") && lines.last().unwrap().contains("03:30"),
            "{lines:#?}"
        );
        assert!(lines[0].contains("33.00") && lines.iter().any(|line| line.contains("27.00")), "{lines:#?}");
    }
}
