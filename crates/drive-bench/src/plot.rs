//! A plot as an SVG, for a README.

use std::fmt::Write;

/// One curve over a logarithmic axis, from 0 to its own `most`.
pub(crate) struct Curve {
    pub(crate) name: &'static str,
    pub(crate) most: f64,
    pub(crate) points: Vec<(f64, f64)>,
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 40.0;
const BOTTOM: f64 = 40.0;
const COLOURS: [&str; 3] = ["#1a6fb5", "#c0392b", "#2e8b57"];

/// The curves, with what they mean above them and `axis` below.
pub(crate) fn plot(axis: &str, curves: &[Curve]) -> String {
    let xs = || curves.iter().flat_map(|curve| curve.points.iter().map(|(x, _)| *x));
    let decades = xs().fold(10.0_f64, f64::max).log10();
    let x_of = |x: f64| LEFT + x.max(1.0).log10() / decades * (WIDTH - 2.0 * LEFT);
    let y_of = |share: f64| HEIGHT + 20.0 - share.clamp(0.0, 1.0) * HEIGHT;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        HEIGHT + 20.0 + BOTTOM + 20.0 * curves.len() as f64
    );
    let mut line = |text: std::fmt::Arguments<'_>| {
        // Writing into a string cannot fail.
        let _ = writeln!(svg, "{text}");
    };
    for quarter in 0..=4 {
        let y = y_of(f64::from(quarter) / 4.0);
        line(format_args!("<path d=\"M{LEFT} {y}H{}\" stroke=\"#ddd\"/>", WIDTH - LEFT));
    }
    let mut marks: Vec<f64> = xs().collect();
    marks.sort_by(f64::total_cmp);
    marks.dedup();
    for x in marks {
        let (at, y) = (x_of(x), y_of(0.0));
        line(format_args!("<path d=\"M{at:.1} {y}v4\" stroke=\"black\"/>"));
        line(format_args!("<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{x}</text>", y + 16.0));
    }
    let below = y_of(0.0) + 32.0;
    line(format_args!("<text x=\"{}\" y=\"{below}\" text-anchor=\"middle\">{axis}</text>", WIDTH / 2.0));
    for (number, (curve, colour)) in curves.iter().zip(COLOURS).enumerate() {
        let points: Vec<String> = curve
            .points
            .iter()
            .map(|(x, y)| format!("{:.1},{:.1}", x_of(*x), y_of(y / curve.most)))
            .collect();
        let points = points.join(" ");
        line(format_args!(
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
        ));
        let y = below + 20.0 * (number + 1) as f64;
        line(format_args!("<text x=\"{LEFT}\" y=\"{y}\" fill=\"{colour}\">{}</text>", curve.name));
    }
    svg.push_str("</svg>\n");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_goes_from_the_left_to_the_right_and_no_higher_than_the_top() {
        let points = vec![(1.0, 0.0), (10.0, 1.0), (1_000.0, 3.0)];
        let svg = plot("lines", &[Curve { name: "share", most: 1.0, points }]);
        assert!(svg.contains("points=\"40.0,280.0 226.7,20.0 600.0,20.0\""), "{svg}");
        assert!(svg.contains(">1000</text>") && svg.ends_with("</svg>\n"));
    }
}
