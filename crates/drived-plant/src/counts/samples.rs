//! The samples of one scrape, and the two texts they can be written as.

use std::fmt::Write as _;

use super::table::{Id, Kind, TABLE};

/// Whatever counts or measures something of its own that is told at `/metrics`.
///
/// A face that has counters keeps them where its tasks reach them without waiting, such as in atomics, adds its rows to the
/// [table](super::table), and is given to `/metrics`.
pub trait Source: Send + Sync {
    /// Adds what it knows now. It is called on a thread that may take its time, at each scrape, and **must not** wait for
    /// anything that a line needs. What is not known is left out.
    fn collect(&self, samples: &mut Samples);
}

/// A text format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Prometheus' text format 0.0.4.
    Text,
    /// OpenMetrics 1.0.
    OpenMetrics,
}

impl Format {
    pub const fn content_type(self) -> &'static str {
        match self {
            Self::Text => "text/plain; version=0.0.4; charset=utf-8",
            Self::OpenMetrics => "application/openmetrics-text; version=1.0.0; charset=utf-8",
        }
    }
}

/// The samples of one scrape: those of each metric together, whoever gave them.
pub struct Samples(Vec<String>);

impl Default for Samples {
    fn default() -> Self {
        Self(vec![String::new(); TABLE.len()])
    }
}

impl Samples {
    /// Adds a sample; the values of the labels in the order of the table.
    pub fn add(&mut self, id: Id, labels: &[&str], value: f64) {
        self.line(id, "", labels, None, value);
    }

    /// The same, where there is a value at all.
    pub fn add_known(&mut self, id: Id, labels: &[&str], value: Option<f64>) {
        if let Some(value) = value {
            self.add(id, labels, value);
        }
    }

    /// Adds a number that only rises.
    pub fn count(&mut self, id: Id, labels: &[&str], value: u64) {
        // Exact up to 2^53.
        self.add(id, labels, value as f64);
    }

    /// Adds a histogram: how many were not longer than each of the bounds of its row, at last how many there were, and
    /// their sum in seconds.
    pub fn add_histogram(&mut self, id: Id, labels: &[&str], up_to: impl Iterator<Item = u64>, sum: f64) {
        let Kind::Histogram(bounds) = id.metric().kind else { return };
        let mut bounds = bounds.iter();
        let mut count = 0;
        for counted in up_to {
            // As OpenMetrics wants it, in both formats: with a decimal point.
            let bound =
                bounds.next().map_or_else(|| "+Inf".to_owned(), |bound| format!("{:?}", bound.as_secs_f64()));
            self.line(id, "_bucket", labels, Some(&bound), counted as f64);
            count = counted;
        }
        self.line(id, "_sum", labels, None, sum);
        self.line(id, "_count", labels, None, count as f64);
    }

    fn line(&mut self, id: Id, suffix: &str, labels: &[&str], bound: Option<&str>, value: f64) {
        let metric = id.metric();
        debug_assert_eq!(labels.len(), metric.labels.len(), "{}", metric.name);
        let Some(text) = self.0.get_mut(id as usize).filter(|_| value.is_finite()) else { return };
        text.push_str(metric.name);
        text.push_str(suffix);
        let labels = metric.labels.iter().zip(labels).map(|(name, value)| (*name, *value));
        let mut separator = '{';
        for (name, value) in labels.chain(bound.map(|bound| ("le", bound))) {
            text.push(separator);
            text.push_str(name);
            text.push_str("=\"");
            escape(value, text);
            text.push('"');
            separator = ',';
        }
        if separator == ',' {
            text.push('}');
        }
        // Writing to a string does not fail.
        let _ = writeln!(text, " {value}");
    }

    /// Everything as a text. A metric without samples is left out.
    pub fn text(&self, format: Format) -> String {
        let mut text = String::with_capacity(self.0.iter().map(|samples| samples.len() + 200).sum());
        for (metric, samples) in TABLE.iter().zip(&self.0).filter(|(_, samples)| !samples.is_empty()) {
            let (name, kind) = match (metric.kind, format) {
                (Kind::Gauge, _) => (metric.name, "gauge"),
                (Kind::Histogram(_), _) => (metric.name, "histogram"),
                (Kind::Counter, Format::Text) => (metric.name, "counter"),
                (Kind::Counter, Format::OpenMetrics) => (metric.name.trim_end_matches("_total"), "counter"),
                (Kind::Info, Format::Text) => (metric.name, "gauge"),
                (Kind::Info, Format::OpenMetrics) => (metric.name.trim_end_matches("_info"), "info"),
            };
            let _ = writeln!(text, "# HELP {name} {}\n# TYPE {name} {kind}", metric.help);
            text.push_str(samples);
        }
        if format == Format::OpenMetrics {
            text.push_str("# EOF\n");
        }
        text
    }
}

/// Writes the value of a label as it may stand between quotation marks.
fn escape(value: &str, text: &mut String) {
    for letter in value.chars() {
        match letter {
            '\\' => text.push_str("\\\\"),
            '"' => text.push_str("\\\""),
            '\n' => text.push_str("\\n"),
            other => text.push(other),
        }
    }
}
