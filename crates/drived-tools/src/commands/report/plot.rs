//! Plots as pictures in the text itself: no script, no request, sharp on paper. Each has its figures in words too.

use maud::{Markup, html};

/// The size of a picture of answer times.
const WIDTH: f64 = 250.0;
const HEIGHT: f64 = 34.0;
/// Below it stand the labels of the axis.
const AXIS: f64 = 12.0;

/// The share of a slave's answers that may be too short for an axis.
const FEW: f64 = 0.05;

/// One step of a histogram: where it begins and ends, and how many are in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) count: f64,
}

/// An axis of times in milliseconds, the same distance for the same ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// One on which the answers of all these slaves have room, but for a few that were much shorter than the others of their
    /// slave: those stand at its left end. Nothing where there is none.
    pub(super) fn of<'a>(slaves: impl Iterator<Item = &'a [Step]>) -> Option<Self> {
        let (mut low, mut high) = (f64::MAX, 0.0_f64);
        for steps in slaves {
            let few = steps.iter().map(|step| step.count).sum::<f64>() * FEW;
            let mut seen = 0.0;
            let usual = steps.iter().find(|step| {
                seen += step.count;
                seen > few
            });
            low = usual.map_or(low, |step| low.min(step.from));
            let longest = steps.iter().filter(|step| step.count > 0.0).map(|step| step.to);
            high = longest.fold(high, f64::max);
        }
        // Never so narrow that a steady drive looks like a wide one.
        (high > 0.0).then(|| Self { low: (low * 0.8).max(0.01), high: high.max(low * 3.0) * 1.1 })
    }

    fn at(self, time: f64) -> f64 {
        WIDTH * (time.max(self.low) / self.low).ln() / (self.high / self.low).ln()
    }

    /// Round times on it: 1, 2, 5, 10 …
    fn ticks(self) -> impl Iterator<Item = f64> {
        let decades = [0.01, 0.1, 1.0, 10.0, 100.0, 1_000.0, 10_000.0];
        let round = decades.into_iter().flat_map(|decade| [decade, 2.0 * decade, 5.0 * decade]);
        round.filter(move |tick| (self.low..=self.high).contains(tick))
    }
}

/// How long answers took: a bar for each step, on an axis that others share.
pub(super) fn answer_times(axis: Axis, steps: &[Step], about: &str) -> Markup {
    let most = steps.iter().map(|step| step.count).fold(0.0, f64::max);
    html! {
        svg.plot role="img" viewBox=(format!("0 0 {WIDTH} {}", HEIGHT + AXIS)) width=(WIDTH) height=(HEIGHT + AXIS) {
            title.own { (about) }
            @for tick in axis.ticks() {
                @let x = format!("{:.1}", axis.at(tick));
                line.grid x1=(x) x2=(x) y1="0" y2=(HEIGHT) {}
                text x=(x) y=(HEIGHT + AXIS - 2.0) text-anchor=(anchor(axis.at(tick))) { (tick) }
            }
            @for step in steps.iter().filter(|step| step.count > 0.0) {
                @let (left, right) = (axis.at(step.from), axis.at(step.to));
                // One answer of a thousand is still seen.
                @let height = (HEIGHT * step.count / most).max(1.0);
                rect.bar x=(format!("{left:.1}")) y=(format!("{:.1}", HEIGHT - height))
                    width=(format!("{:.1}", (right - left - 0.4).max(0.8))) height=(format!("{height:.1}")) {}
            }
            line.axis x1="0" x2=(WIDTH) y1=(HEIGHT) y2=(HEIGHT) {}
        }
    }
}

/// Where the text of a tick is held, so that none is cut at an end.
fn anchor(x: f64) -> &'static str {
    if x < 8.0 {
        "start"
    } else if x > WIDTH - 12.0 {
        "end"
    } else {
        "middle"
    }
}

/// Parts of a whole, one beside the other; what is left is drawn empty. A part is known by its class, and by its place.
pub(super) fn shares(parts: &[(&str, f64)], whole: f64, about: &str) -> Markup {
    const LONG: f64 = 120.0;
    const HIGH: f64 = 10.0;
    let mut left = 0.0;
    let mut bars = Vec::new();
    for (class, part) in parts.iter().filter(|(_, part)| *part > 0.0) {
        // Whatever there is is seen.
        let width = (LONG * part / whole).max(1.5).min(LONG - left);
        bars.push((*class, left, width));
        left += width;
    }
    html! {
        svg.plot role="img" viewBox=(format!("0 0 {LONG} {HIGH}")) width=(LONG) height=(HIGH) {
            title.own { (about) }
            rect.whole x="0" y="0" width=(LONG) height=(HIGH) {}
            @for (class, left, width) in bars {
                rect class=(class) x=(format!("{left:.1}")) y="0" width=(format!("{width:.1}")) height=(HIGH) {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_ratio_is_the_same_distance_and_nothing_falls_off_the_picture() {
        let steps = [Step { from: 5.0, to: 5.6, count: 3.0 }, Step { from: 40.0, to: 45.0, count: 1.0 }];
        let axis = Axis::of([&steps[..]].into_iter()).unwrap();
        assert!((axis.at(20.0) - axis.at(10.0) - (axis.at(40.0) - axis.at(20.0))).abs() < 1e-9);
        assert!(axis.at(5.0) > 0.0 && axis.at(45.0) < WIDTH);
        assert_eq!(axis.ticks().collect::<Vec<_>>(), [5.0, 10.0, 20.0]);
        assert_eq!(Axis::of([&[Step { from: 1.0, to: 2.0, count: 0.0 }][..]].into_iter()), None);
        let picture = answer_times(axis, &steps, "<b>").into_string();
        assert_eq!(picture.matches("<rect").count(), 2);
        assert!(picture.contains("&lt;b&gt;"), "{picture}");
    }
}
