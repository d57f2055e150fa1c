//! The last ten minutes of a drive, and which part of them is looked at.

use drived_plant::plant::history::HistoryView;

/// How much is shown, in seconds: ten minutes is what the daemon keeps.
const WINDOWS: [f64; 4] = [600.0, 300.0, 120.0, 60.0];

/// The cursor goes so many samples at a step.
const STEP: usize = 4;

/// What was known of a drive at each sample, the newest last.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Curves {
    samples: Vec<Sample>,
    window: usize,
    /// The sample at the cursor, while it stands still.
    paused: Option<usize>,
}

/// What was known at one moment; `None` where nothing fresh was.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Sample {
    pub(super) unix_ms: u64,
    pub(super) frequency: Option<f64>,
    pub(super) setpoint: Option<f64>,
    pub(super) current: Option<f64>,
    pub(super) torque: Option<f64>,
}

impl Curves {
    /// Takes a history of the API.
    pub(super) fn take(&mut self, history: HistoryView) {
        if self.is_paused() {
            return;
        }
        let HistoryView { time_unix_ms, frequency_hz, setpoint_hz, current_a, torque_percent, .. } = history;
        let at = |column: &[Option<f64>], index: usize| column.get(index).copied().flatten();
        let samples = time_unix_ms.into_iter().enumerate().map(|(index, unix_ms)| Sample {
            unix_ms,
            frequency: at(&frequency_hz, index),
            setpoint: at(&setpoint_hz, index),
            current: at(&current_a, index),
            torque: at(&torque_percent, index),
        });
        self.samples = samples.collect();
    }

    pub(super) const fn is_paused(&self) -> bool {
        self.paused.is_some()
    }

    /// The sample at the cursor: where it was put, or the newest.
    pub(super) fn at_cursor(&self) -> Option<&Sample> {
        match self.paused {
            Some(at) => self.samples.get(at),
            None => self.samples.last(),
        }
    }

    /// How many seconds are shown.
    pub(super) fn window(&self) -> f64 {
        WINDOWS.get(self.window).copied().unwrap_or(WINDOWS[0])
    }

    /// The points of a curve in pieces without a gap: seconds before the newest sample, and the value.
    pub(super) fn pieces(&self, value: impl Fn(&Sample) -> Option<f64>) -> Vec<Vec<(f64, f64)>> {
        let mut pieces = vec![Vec::new()];
        for sample in &self.samples {
            let seconds = self.seconds(sample);
            match (value(sample).filter(|_| seconds >= -self.window()), pieces.last_mut()) {
                (Some(value), Some(piece)) => piece.push((seconds, value)),
                (None, Some(piece)) if !piece.is_empty() => pieces.push(Vec::new()),
                _ => {}
            }
        }
        pieces.retain(|piece| !piece.is_empty());
        pieces
    }

    /// Where a sample stands: seconds before the newest.
    pub(super) fn seconds(&self, sample: &Sample) -> f64 {
        let newest = self.samples.last().map_or(0, |newest| newest.unix_ms);
        -(newest.saturating_sub(sample.unix_ms) as f64) / 1_000.0
    }

    pub(super) fn pause_or_resume(&mut self) {
        self.paused = match self.paused {
            Some(_) => None,
            None => self.samples.len().checked_sub(1),
        };
    }

    pub(super) const fn resume(&mut self) {
        self.paused = None;
    }

    /// Moves the cursor back or forth, and stands still for that.
    pub(super) fn step(&mut self, direction: i8) {
        let Some(last) = self.samples.len().checked_sub(1) else { return };
        let at = self.paused.unwrap_or(last);
        let to = if direction < 0 { at.saturating_sub(STEP) } else { at + STEP };
        let first = self.samples.iter().position(|sample| self.seconds(sample) >= -self.window());
        self.paused = Some(to.clamp(first.unwrap_or_default(), last));
    }

    pub(super) fn zoom_in(&mut self) {
        self.window = (self.window + 1).min(WINDOWS.len() - 1);
    }

    pub(super) fn zoom_out(&mut self) {
        self.window = self.window.saturating_sub(1);
    }
}
