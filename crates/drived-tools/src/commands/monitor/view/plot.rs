//! The curves of a drive: frequency with its setpoint above, current and torque below.

use ratatui::{
    Frame,
    layout::{Constraint, Layout, Rect},
    style::{Color, Style, Stylize as _},
    symbols::Marker,
    text::Line,
    widgets::{Axis, Chart, Dataset, GraphType, Paragraph},
};

use super::super::{
    curves::{Curves, Sample},
    words,
};
use drived_screen::row::fitted;

/// With fewer lines there is room for the frequency alone.
const WITH_BOTH: u16 = 14;

/// One quantity.
struct Curve {
    name: &'static str,
    value: fn(&Sample) -> Option<f64>,
    colour: Color,
    marker: Marker,
}

const FREQUENCY: Curve = Curve {
    name: "frequency",
    value: |sample| sample.frequency,
    colour: Color::Green,
    marker: Marker::Braille,
};
const SETPOINT: Curve =
    Curve { name: "setpoint", value: |sample| sample.setpoint, colour: Color::Blue, marker: Marker::Dot };
const CURRENT: Curve =
    Curve { name: "current", value: |sample| sample.current, colour: Color::Yellow, marker: Marker::Braille };
const TORQUE: Curve =
    Curve { name: "torque", value: |sample| sample.torque, colour: Color::Magenta, marker: Marker::Braille };

pub(super) fn draw(curves: &Curves, frame: &mut Frame<'_>, area: Rect) {
    let [charts, legend] = Layout::vertical([Constraint::Fill(1), Constraint::Length(1)]).areas(area);
    let legend_text = fitted(&at_cursor(curves), usize::from(legend.width));
    frame.render_widget(Paragraph::new(legend_text).bold(), legend);
    if charts.height < WITH_BOTH {
        chart(curves, &[SETPOINT, FREQUENCY], "Hz", frame, charts);
        return;
    }
    let [above, below] = Layout::vertical([Constraint::Percentage(55), Constraint::Fill(1)]).areas(charts);
    chart(curves, &[SETPOINT, FREQUENCY], "Hz", frame, above);
    let [left, right] = Layout::horizontal([Constraint::Fill(1), Constraint::Fill(1)]).areas(below);
    chart(curves, &[CURRENT], "A", frame, left);
    chart(curves, &[TORQUE], "%", frame, right);
}

/// What was known at the cursor, in units.
fn at_cursor(curves: &Curves) -> String {
    let Some(sample) = curves.at_cursor() else { return "reading the last ten minutes".to_owned() };
    let known = |what: &str, value: Option<f64>, unit: &str| Some(format!("{what}{:.1} {unit}", value?));
    let values = [
        known("", sample.frequency, "Hz"),
        known("setpoint ", sample.setpoint, "Hz"),
        known("", sample.current, "A"),
        known("torque ", sample.torque, "%"),
    ];
    let values: Vec<String> = values.into_iter().flatten().collect();
    let held = if curves.is_paused() { "HELD at" } else { "now" };
    let values = if values.is_empty() { "nothing fresh was known".to_owned() } else { values.join(", ") };
    format!("{held} {}: {values}", words::clock(sample.unix_ms))
}

fn chart(curves: &Curves, of: &[Curve], unit: &str, frame: &mut Frame<'_>, area: Rect) {
    let pieces: Vec<(usize, Vec<(f64, f64)>)> = of
        .iter()
        .enumerate()
        .flat_map(|(index, curve)| curves.pieces(curve.value).into_iter().map(move |piece| (index, piece)))
        .collect();
    let values = || pieces.iter().flat_map(|(_, piece)| piece.iter().map(|(_, value)| *value));
    let (least, most) = (values().fold(0.0, f64::min), nice(values().fold(1.0, f64::max)));
    let least = if least < 0.0 { -nice(-least) } else { 0.0 };
    let at = curves.at_cursor().filter(|_| curves.is_paused()).map(|sample| curves.seconds(sample));
    let cursor: Vec<(f64, f64)> = at.into_iter().flat_map(|at| [(at, least), (at, most)]).collect();
    let named: Vec<String> = of.iter().map(|curve| curve.name.to_owned()).collect();
    let mut sets: Vec<Dataset<'_>> = pieces
        .iter()
        .filter_map(|(index, piece)| {
            let curve = of.get(*index)?;
            let kind = if piece.len() > 1 { GraphType::Line } else { GraphType::Scatter };
            Some(Dataset::default().data(piece).marker(curve.marker).graph_type(kind).style(curve.colour))
        })
        .collect();
    if !cursor.is_empty() {
        let line = Dataset::default().data(&cursor).marker(Marker::Braille).graph_type(GraphType::Line);
        sets.push(line.style(Style::new().bold()));
    }
    let window = curves.window();
    let minutes = |seconds: f64| match seconds {
        seconds if seconds >= 120.0 => format!("-{:.0} min", seconds / 60.0),
        seconds => format!("-{seconds:.0} s"),
    };
    let x = Axis::default().bounds([-window, 0.0]).labels([
        minutes(window),
        minutes(window / 2.0),
        "now".to_owned(),
    ]);
    let label = |value: f64| format!("{value:.0}");
    let y = Axis::default().bounds([least, most]).labels([label(least), format!("{} {unit}", label(most))]);
    let title =
        if pieces.is_empty() { format!("{}: nothing known", named.join(", ")) } else { named.join(", ") };
    let [head, body] = Layout::vertical([Constraint::Length(1), Constraint::Fill(1)]).areas(area);
    frame.render_widget(Line::from(fitted(&format!("{title}, {unit}"), usize::from(head.width))).dim(), head);
    frame.render_widget(Chart::new(sets).x_axis(x.dim()).y_axis(y.dim()), body);
}

/// The next value that is easily read at the end of an axis.
fn nice(value: f64) -> f64 {
    let step = 10_f64.powf(value.max(1.0).log10().floor());
    let steps = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    steps.into_iter().map(|times| times * step).find(|end| *end >= value).unwrap_or(value)
}
