//! What is known of the past, by whoever keeps it: the faces ask it here, and none of them knows how it is kept.

use std::sync::{
    Arc, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use drive_core::{Row, registers::Access};
use drive_fleet::DriveHandle;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use super::Plant;

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

/// A setting of a drive as it was read, or written and read back, a moment ago.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterRead {
    pub drive: Arc<str>,
    pub address: u16,
    /// The manual's mnemonic.
    pub code: &'static str,
    pub word: u16,
    /// With its unit or its meaning.
    pub text: String,
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

/// Which curves are asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CurvesAsked {
    /// All of which there is something, where none is named.
    pub drives: Vec<String>,
    pub values: Vec<String>,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    pub every_ms: i64,
}

/// Curves in steps of one length, all of them of the same steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepsView {
    /// When the first step begins: at a whole multiple of their length since 1970.
    pub from_unix_ms: i64,
    pub every_ms: i64,
    /// How many there are in each list below.
    pub steps: usize,
    pub curves: Vec<CurveView>,
}

/// The steps of a value of a drive, in the value's unit; `null`: nothing is known of that step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveView {
    pub drive: String,
    pub value: String,
    pub least: Vec<Option<f64>>,
    /// By time, over what is known; of a word or of bits it means nothing, and the list is empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mean: Vec<Option<f64>>,
    pub greatest: Vec<Option<f64>>,
    /// The share of each step for which something is known, from 0 to 1.
    pub known: Vec<f64>,
}

/// What was known at a moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MomentView {
    pub at_unix_ms: i64,
    /// Every drive of which there is anything.
    pub drives: Vec<DriveThenView>,
    /// The lines, in the minute of that moment.
    pub lines: Vec<LineMinuteView>,
}

/// A drive at a moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveThenView {
    pub drive: String,
    /// By their names; a value that was not known then is not there.
    pub values: std::collections::BTreeMap<String, IsView>,
    /// Whether they are those of the moment itself; else they are the means of its minute or hour, because nothing finer is kept.
    pub exact: bool,
}

/// What was counted of the lines.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LineMinutesView {
    pub minutes: Vec<LineMinuteView>,
    /// From where to ask on, where that was too much for one answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_from_unix_ms: Option<i64>,
}

/// A line within a minute.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LineMinuteView {
    /// When the minute ended.
    pub time_unix_ms: i64,
    pub line: String,
    /// Requests, those that were sent again among them.
    pub sent: i64,
    pub answered: i64,
    /// Answers that were damaged, or did not fit the request.
    pub damaged: i64,
    /// Requests that nobody answered.
    pub missing: i64,
    /// Whole frames of somebody else.
    pub foreign: i64,
    /// Silences that were kept before requests.
    pub silences: i64,
    /// Their mean, in microseconds; absent where there was none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub silence_us: Option<i64>,
    /// Thousandths of the minute in which the line was needed.
    pub busy_permille: i64,
    /// Whether its port was there at the end of the minute.
    pub is_open: bool,
}

/// Which days are asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DaysAsked {
    /// All, where none is named.
    pub drives: Vec<String>,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
}

/// A day of a drive, from midnight to midnight in this machine's zone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DayView {
    pub drive: String,
    /// `2026-11-21`.
    pub day: String,
    pub start_unix_ms: i64,
    /// The share of the day for which its state is known, from 0 to 1: what is told below is told of that.
    pub known: f64,
    /// For how long its motor ran.
    pub running_ms: i64,
    /// How often it was seen to begin to run.
    pub starts: u64,
    /// By what it tripped, and how often.
    pub trips: std::collections::BTreeMap<String, u64>,
    /// For how long a value was above a limit of this program's configuration.
    pub above_limits_ms: i64,
    /// For how long it told a warning of its own.
    pub warning_ms: i64,
    /// The electrical energy; absent where nothing is known of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<EnergyView>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub greatest_current_a: Option<f64>,
    /// The greatest thermal state of the motor and of the drive, in per cent, and what was left to 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motor_thermal_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_thermal_percent: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_margin_percent: Option<f64>,
}

/// Energy, and where it is from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnergyView {
    /// In kWh where it was summed up here, and in the drive's own counts where it has a counter.
    pub amount: f64,
    pub from: EnergyFrom,
}

/// Where an energy is from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EnergyFrom {
    /// The drive's own counter: its counts.
    Counter,
    /// Summed up here from its power over the time in which that is known: kWh, and what was used otherwise is not in it.
    Summed,
}

/// What was known of a drive around something that happened to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameView {
    /// The event.
    pub why: String,
    pub at_unix_ms: i64,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    /// Whether what came after it is in it too.
    pub is_whole: bool,
    pub curves: Vec<FrameCurveView>,
    /// The last exchanges of its line before it was told, where they were kept: the newest last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exchanges: Vec<super::views::ExchangeView>,
    /// What captures of its line have heard around it; absent where none ran.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub capture: Option<FrameCaptureView>,
}

/// How much captures have heard of the line of a drive around a freeze-frame. The frames themselves are told as a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct FrameCaptureView {
    /// When the first and the last of them were heard.
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    pub frames: u64,
    /// So many others there were between them, for which there was no room.
    pub left_out: u64,
    /// Whether there were others before them, for which there was no room.
    pub is_cut: bool,
}

/// A value in a freeze-frame, as it was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrameCurveView {
    pub value: String,
    pub points: Vec<PointView>,
}

/// A value of a parameter that was read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PastParameterView {
    pub address: u16,
    pub mnemonic: String,
    pub raw: u16,
    pub text: String,
    /// When it was first read so, and when last; between the two nobody has read another value.
    pub first_unix_ms: i64,
    pub last_unix_ms: i64,
    /// How often.
    pub times: i64,
}

/// Which values are asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValuesAsked {
    pub drive: String,
    /// By its name, with its unit: `output_frequency_hz`.
    pub value: String,
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    /// In steps of this length; `None`: as they were read.
    pub every_ms: Option<i64>,
}

/// The values of a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ValuesView {
    pub drive: String,
    pub value: String,
    /// As they were read: from each point on the value is this, up to the next point.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<PointView>,
    /// In steps; one of which nothing is known is not there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepView>,
    /// From where to ask on, where that was too much for one answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_from_unix_ms: Option<i64>,
}

/// What was known from one moment on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PointView {
    pub time_unix_ms: i64,
    /// A number in the value's unit, or a word; `null`: nothing is known from then on.
    pub is: Option<IsView>,
}

/// A value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum IsView {
    Number(f64),
    Word(String),
}

/// One step, in the value's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepView {
    /// When it begins.
    pub start_unix_ms: i64,
    /// Of a word its place among the value's words.
    pub least: f64,
    /// By time, over what is known. Of words and bits there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    pub greatest: f64,
    /// The share of the step for which something is known, from 0 to 1.
    pub known: f64,
    /// Of a value in words: each that it was.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shares: Vec<ShareView>,
}

/// For how much of a step a value was this word.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShareView {
    /// `running`.
    pub is: String,
    /// From 0 to 1: those of a step are together what is known of it.
    pub share: f64,
}

/// Which of what happened is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordsAsked {
    pub from_unix_ms: i64,
    pub to_unix_ms: i64,
    /// One drive, and what is of no drive alone.
    pub drive: Option<String>,
    /// Of one line.
    pub line: Option<String>,
    /// `event`, `command`, `alarm`, `notice`, `history`.
    pub kind: Option<String>,
    /// In one word: `tripped`, `stop`.
    pub what: Option<String>,
    /// Only what somebody had to see to.
    pub only_alarms: bool,
    /// Only what stands behind the record of this number.
    pub after: i64,
    /// Only what stands before the record of this number, the newest first.
    pub before: Option<i64>,
    /// So many at the most.
    pub limit: Option<usize>,
}

/// What happened.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RecordsView {
    /// In the daemon's own order; where `before` is said, the newest first.
    pub records: Vec<RecordView>,
    /// The number behind which to ask on, where there may be more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_after: Option<i64>,
    /// Likewise, where the newest come first: the number before which to ask on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_before: Option<i64>,
}

/// Something that happened.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct RecordView {
    /// Its place in the order of the history, which the wall's clock does not change.
    pub number: i64,
    /// The run of the daemon.
    pub run: i64,
    /// By the wall's clock as it stood then.
    pub time_unix_ms: i64,
    /// By the daemon's own clock, since its run began.
    pub steady_ms: i64,
    /// `event`, `command`, `alarm`, `notice`, or `history`: what the black box tells of itself.
    pub kind: String,
    /// In one word.
    pub what: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<String>,
    pub alarm: bool,
    pub text: String,
    /// As the API told it then.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<serde_json::Value>")]
    pub body: Option<Box<RawValue>>,
}

/// How sure a sentence is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Certainty {
    /// It was seen here.
    Seen,
    /// The drive says so.
    Said,
    /// The facts speak for it, and something else is possible.
    Likely,
    /// It is not known.
    NotKnown,
}

/// One sentence, with its time where it has one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SentenceView {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_unix_ms: Option<i64>,
    pub certainty: Certainty,
    pub text: String,
}

impl SentenceView {
    /// Without a time.
    pub fn of(certainty: Certainty, text: impl Into<String>) -> Self {
        Self { time_unix_ms: None, certainty, text: text.into() }
    }

    /// The same, with its time.
    pub fn at(self, time_unix_ms: i64) -> Self {
        Self { time_unix_ms: Some(time_unix_ms), ..self }
    }
}

/// The story of a drive around a moment.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct StoryView {
    pub drive: String,
    /// What the story is about; absent where nothing happened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub about: Option<SentenceView>,
    /// Why, as far as it is known.
    pub why: Vec<SentenceView>,
    /// How it was before.
    pub before: Vec<SentenceView>,
    /// What happened, in order: to the drive, by somebody, and to its line.
    pub course: Vec<SentenceView>,
    /// What is not known.
    pub not_known: Vec<SentenceView>,
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
