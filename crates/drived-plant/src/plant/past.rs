//! What is known of the past, by whoever keeps it: the faces ask it here, and none of them knows how it is kept.

mod days;
mod frames;
mod moment;
mod records;
mod settings;
mod story;
mod values;

use std::sync::{
    Arc, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use drive_core::{Row, registers::Access};
use drive_fleet::DriveHandle;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Plant;

pub use self::{
    days::{DayView, DaysAsked, EnergyFrom, EnergyView},
    frames::{FrameCaptureView, FrameCurveView, FrameView},
    moment::{DriveThenView, LineMinuteView, LineMinutesView, MomentView},
    records::{RecordView, RecordsAsked, RecordsView},
    settings::{ParameterRead, PastParameterView},
    story::{Certainty, SentenceView, StoryView},
    values::{
        CurveView, CurvesAsked, IsView, PointView, ShareView, StepView, StepsView, ValuesAsked, ValuesView,
    },
};

/// So many steps, points or records are answered at once, at the most.
pub const AT_ONCE: usize = 20_000;

/// So many numbers of curves are answered at once, at the most: those of 31 drives in 540 steps, three times.
pub const CELLS: usize = 50_000;

/// Keeps the past of a plant. Each call but [`note`](Past::note) reads a disk, and may take its time: it is made on a thread that may wait.
pub trait Past: Send + Sync {
    /// What is kept, and since when.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn about(&self) -> Result<KeptView, PastError>;

    /// Whether there is anything of a drive, also of one that is not there any more.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn knows(&self, drive: &str) -> Result<bool, PastError>;

    /// The values of a drive.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn values(&self, asked: &ValuesAsked, given_up: &GivenUp) -> Result<ValuesView, PastError>;

    /// Values of several drives, in steps of one length.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn curves(&self, asked: &CurvesAsked, given_up: &GivenUp) -> Result<StepsView, PastError>;

    /// What was known of every drive and line at a moment.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn moment(&self, at_unix_ms: i64, given_up: &GivenUp) -> Result<MomentView, PastError>;

    /// What was counted of the lines, minute by minute.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn lines(&self, from_unix_ms: i64, to_unix_ms: i64) -> Result<LineMinutesView, PastError>;

    /// What is made of it, per drive and day.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn days(&self, asked: &DaysAsked, given_up: &GivenUp) -> Result<Vec<DayView>, PastError>;

    /// The freeze-frames of a drive.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn frames(&self, drive: &str, from_unix_ms: i64, to_unix_ms: i64) -> Result<Vec<FrameView>, PastError>;

    /// What captures have heard of the line of a drive around the freeze-frame of this moment, as pcapng.
    ///
    /// # Errors
    /// [`PastError`]: there is none, or nothing can be answered.
    fn capture(&self, drive: &str, at_unix_ms: i64) -> Result<Vec<u8>, PastError>;

    /// Every value of its parameters that was ever read, by address, the newest last.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn parameters(&self, drive: &str) -> Result<Vec<PastParameterView>, PastError>;

    /// What happened.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn records(&self, asked: &RecordsAsked) -> Result<RecordsView, PastError>;

    /// What happened to a drive at a moment, in words.
    ///
    /// # Errors
    /// [`PastError`]: nothing can be answered.
    fn story(&self, drive: &str, at_unix_ms: i64) -> Result<StoryView, PastError>;

    /// Keeps what was read of a parameter. It waits for nothing.
    fn note(&self, read: ParameterRead);

    /// Keeps that something was seen to of a drive, and by whom: its hours and starts count from now on. It waits for nothing.
    fn maintained(&self, drive: &str, part: &str, by: &str, note: Option<&str>);
}

/// Whether somebody still waits for an answer. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct GivenUp(Arc<AtomicBool>);

impl GivenUp {
    /// Nobody waits any more.
    pub fn give_up(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether nobody does.
    #[must_use]
    pub fn is_so(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PastError {
    /// What is asked cannot be.
    #[error("{0}")]
    Asked(String),
    /// A drive that is not there, and of which nothing is kept.
    #[error("there is no drive {0:?}")]
    NoDrive(String),
    /// It cannot be read now.
    #[error("the history cannot be read: {0}")]
    Unreadable(String),
    /// What is kept cannot be right.
    #[error("the history is damaged ({0}): it is put aside, and a new one is begun")]
    Damaged(String),
    /// Nobody waits for it any more.
    #[error("nobody waits for the answer any more")]
    GivenUp,
}

/// What is kept.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct KeptView {
    /// When the history begins; absent where nothing is there yet.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since_unix_ms: Option<i64>,
    /// The newest moment of which it knows something.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub until_unix_ms: Option<i64>,
    /// How much of the file is in use.
    pub bytes: u64,
    pub largest_bytes: u64,
    /// For how long values are kept as they were read, and their minutes.
    pub polled_ms: i64,
    pub minutes_ms: i64,
    /// Those of which there is something, also of those that are not there any more.
    pub drives: Vec<String>,
    /// The names by which values are asked for, each with its unit; beside them `word_ADDRESS`.
    pub values: Vec<ValueNameView>,
}

/// A value that can be asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ValueNameView {
    pub name: String,
    /// Of a value that is a word: what its numbers mean, from 0 on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub words: Vec<String>,
}

impl Plant {
    /// This keeps the past from now on; `None`: nobody does.
    pub fn set_past(&self, past: Option<Arc<dyn Past>>) {
        self.0.has_kept_past.fetch_or(past.is_some(), Ordering::Relaxed);
        *self.0.past.write().unwrap_or_else(PoisonError::into_inner) = past;
    }

    /// Whether somebody keeps the past, or has since the program began.
    pub fn has_kept_past(&self) -> bool {
        self.0.has_kept_past.load(Ordering::Relaxed)
    }

    /// Gives what was read of a setting to whoever keeps the past.
    pub(super) fn note_parameter(&self, drive: &DriveHandle, row: &Row, word: u16) {
        let is_setting = matches!(row.access, Access::ReadWrite | Access::WriteStopped);
        if let Some(past) = self.past().filter(|_| is_setting) {
            past.note(ParameterRead {
                drive: Arc::clone(drive.name()),
                address: row.address,
                code: row.code,
                word,
                text: row.show(word),
            });
        }
    }

    /// Who keeps the past; `None`: nobody does.
    pub fn past(&self) -> Option<Arc<dyn Past>> {
        self.0.past.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
