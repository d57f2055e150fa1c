//! The history as the faces ask it: each answer has a bound and can be given up, and the file is opened for each.

use std::{
    path::PathBuf,
    sync::Arc,
    time::{Duration, SystemTime},
};

use drived_plant::plant::past::{
    AT_ONCE, CELLS, CurveView, CurvesAsked, DayView, DaysAsked, FrameCaptureView, FrameCurveView, FrameView,
    GivenUp, KeptView, LineMinutesView, MomentView, ParameterRead, Past, PastError, PastParameterView,
    RecordsAsked, RecordsView, StepsView, StoryView, ValueNameView, ValuesAsked, ValuesView,
};

use tokio::sync::Notify;

use crate::{
    clocks::Clocks,
    maintenance,
    quantity::{Quantity, TABLE},
    read::{self, Filter, Heard, History},
    record::Setting,
    store::StoreError,
    story,
    write::{Limits, archive::FLUSHED_EVERY_MS, inbox::Inbox, tidy},
};

/// Whoever asks for what has just happened waits at the most for this long for what was read then to be written; a disk that is slower leaves
/// the rest out, as not known.
const WRITTEN_WITHIN: Duration = Duration::from_millis(1_500);

/// The past of a plant in this file, and the way into it.
pub(crate) struct InFile {
    pub(crate) path: PathBuf,
    pub(crate) limits: Limits,
    pub(crate) inbox: Inbox,
    pub(crate) clocks: Clocks,
    /// Rings when something was seen to.
    pub(crate) done: Arc<Notify>,
}

impl From<StoreError> for PastError {
    fn from(error: StoreError) -> Self {
        match error.is_damage() {
            true => Self::Damaged(error.to_string()),
            false => Self::Unreadable(error.to_string()),
        }
    }
}

impl From<Heard> for FrameCaptureView {
    fn from(Heard { frames, left_out, is_cut, from_unix_ms, to_unix_ms }: Heard) -> Self {
        let [frames, left_out] = [frames, left_out].map(|count| u64::try_from(count).unwrap_or_default());
        Self { from_unix_ms, to_unix_ms, frames, left_out, is_cut }
    }
}

impl InFile {
    fn open(&self) -> Result<History, PastError> {
        Ok(History::open(&self.path)?)
    }

    /// The same, for what was up to a moment: values wait for up to a minute to be written, and what is known is told as known.
    fn open_up_to(&self, to_unix_ms: i64) -> Result<History, PastError> {
        if wall_ms().saturating_sub(to_unix_ms) <= FLUSHED_EVERY_MS {
            self.inbox.have_written(WRITTEN_WITHIN);
        }
        self.open()
    }
}

/// The quantity of a name.
fn named(value: &str) -> Result<Quantity, PastError> {
    Quantity::named(value).ok_or_else(|| {
        let names: Vec<&str> = TABLE.iter().map(|row| row.name).collect();
        PastError::Asked(format!(
            "{value:?} is no value: expected one of {}, or word_ADDRESS",
            names.join(", ")
        ))
    })
}

/// Those that are named, or all of which there is something.
fn meant(history: &History, drives: &[String]) -> Result<Vec<String>, PastError> {
    match drives.is_empty() {
        true => Ok(read::drives(&history.0)?),
        false => Ok(drives.to_vec()),
    }
}

fn is_waited_for(given_up: &GivenUp) -> Result<(), PastError> {
    if given_up.is_so() { Err(PastError::GivenUp) } else { Ok(()) }
}

impl Past for InFile {
    fn about(&self) -> Result<KeptView, PastError> {
        let history = self.open()?;
        let (since, until) = read::bounds(&history.0)?;
        let words = |row: &crate::quantity::Row| row.words.iter().map(|word| (*word).to_owned()).collect();
        Ok(KeptView {
            since_unix_ms: since,
            until_unix_ms: until,
            bytes: u64::try_from(tidy::used_bytes(&history.0)?).unwrap_or_default(),
            largest_bytes: u64::try_from(self.limits.bytes).unwrap_or_default(),
            polled_ms: self.limits.polled_ms,
            minutes_ms: self.limits.minutes_ms,
            drives: read::drives(&history.0)?,
            values: TABLE
                .iter()
                .map(|row| ValueNameView { name: row.name.to_owned(), words: words(row) })
                .collect(),
        })
    }

    fn knows(&self, drive: &str) -> Result<bool, PastError> {
        Ok(read::drives(&self.open()?.0)?.iter().any(|known| known == drive))
    }

    fn values(&self, asked: &ValuesAsked, given_up: &GivenUp) -> Result<ValuesView, PastError> {
        let ValuesAsked { drive, value, from_unix_ms, to_unix_ms, every_ms } = asked;
        let quantity = named(value)?;
        let history = self.open_up_to(*to_unix_ms)?;
        let mut view = ValuesView {
            drive: drive.clone(),
            value: value.clone(),
            points: Vec::new(),
            steps: Vec::new(),
            next_from_unix_ms: None,
        };
        match every_ms {
            Some(every) => {
                let every = (*every).max(1);
                let at_once = every.saturating_mul(i64::try_from(AT_ONCE).unwrap_or(i64::MAX));
                // A page ends with a whole step: none is told twice.
                let first = from_unix_ms.saturating_sub(from_unix_ms.rem_euclid(every));
                let end = first.saturating_add(at_once - 1).min(*to_unix_ms);
                let go_on = || !given_up.is_so();
                view.steps = read::steps(&history.0, drive, quantity, *from_unix_ms, end, every, &go_on)?;
                view.next_from_unix_ms = (end < *to_unix_ms).then(|| end + 1);
            }
            None => read::points(&history.0, drive, quantity, *from_unix_ms, *to_unix_ms, |point| {
                let is_full = view.points.len() >= AT_ONCE;
                match is_full {
                    true => view.next_from_unix_ms = Some(point.at),
                    false => view.points.push(quantity.point(point)),
                }
                Ok::<_, PastError>(!is_full && !given_up.is_so())
            })?,
        }
        is_waited_for(given_up).map(|()| view)
    }

    fn curves(&self, asked: &CurvesAsked, given_up: &GivenUp) -> Result<StepsView, PastError> {
        let CurvesAsked { values, from_unix_ms, to_unix_ms, every_ms, .. } = asked;
        let quantities = values.iter().map(|value| named(value)).collect::<Result<Vec<_>, _>>()?;
        if quantities.is_empty() || *every_ms < 1 || to_unix_ms < from_unix_ms {
            let text = "expected a value at least, every_ms from 1 on, and a time that ends after it begins";
            return Err(PastError::Asked(text.to_owned()));
        }
        let history = self.open_up_to(*to_unix_ms)?;
        let drives = meant(&history, &asked.drives)?;
        let first = from_unix_ms - from_unix_ms.rem_euclid(*every_ms);
        let steps = usize::try_from((to_unix_ms - first) / every_ms + 1).unwrap_or(usize::MAX);
        let curves = drives.len().saturating_mul(quantities.len()).max(1);
        if steps.saturating_mul(curves) > CELLS {
            let fewest = i64::try_from(CELLS / curves).unwrap_or(1).max(1);
            return Err(PastError::Asked(format!(
                "{curves} curves of {steps} steps are more than the {CELLS} that are answered at once:                  every_ms has to be {} or more, or the drives, values or time fewer",
                (to_unix_ms - first) / fewest + 1
            )));
        }
        let mut view = StepsView { from_unix_ms: first, every_ms: *every_ms, steps, curves: Vec::new() };
        for drive in &drives {
            for quantity in &quantities {
                is_waited_for(given_up)?;
                let go_on = || !given_up.is_so();
                let told = read::steps(&history.0, drive, *quantity, first, *to_unix_ms, *every_ms, &go_on)?;
                let mut curve = CurveView {
                    drive: drive.clone(),
                    value: quantity.to_string(),
                    least: vec![None; steps],
                    mean: if quantity.is_number() { vec![None; steps] } else { Vec::new() },
                    greatest: vec![None; steps],
                    known: vec![0.0; steps],
                };
                for step in told {
                    let Ok(place) = usize::try_from((step.start_unix_ms - first) / every_ms) else {
                        continue;
                    };
                    let set = |list: &mut Vec<Option<f64>>, value: Option<f64>| {
                        if let Some(cell) = list.get_mut(place) {
                            // As many places as the thickness of a line can show.
                            *cell = value.map(|value| (value * 1_000.0).round() / 1_000.0);
                        }
                    };
                    set(&mut curve.least, Some(step.least));
                    set(&mut curve.mean, step.mean);
                    set(&mut curve.greatest, Some(step.greatest));
                    if let Some(known) = curve.known.get_mut(place) {
                        *known = (step.known * 10_000.0).round() / 10_000.0;
                    }
                }
                view.curves.push(curve);
            }
        }
        is_waited_for(given_up).map(|()| view)
    }

    fn moment(&self, at_unix_ms: i64, given_up: &GivenUp) -> Result<MomentView, PastError> {
        let history = self.open_up_to(at_unix_ms)?;
        let mut drives = Vec::new();
        for drive in read::drives(&history.0)? {
            is_waited_for(given_up)?;
            drives.push(read::then(&history.0, &drive, at_unix_ms)?);
        }
        Ok(MomentView { at_unix_ms, drives, lines: read::lines_at(&history.0, at_unix_ms)? })
    }

    fn lines(&self, from_unix_ms: i64, to_unix_ms: i64) -> Result<LineMinutesView, PastError> {
        let mut minutes = read::line_minutes(&self.open()?.0, from_unix_ms, to_unix_ms, AT_ONCE + 1)?;
        // The lines of one minute are not parted.
        let next_from_unix_ms = match minutes.len() > AT_ONCE {
            true => minutes.last().map(|next| next.time_unix_ms),
            false => None,
        };
        if let Some(next) = next_from_unix_ms {
            minutes.retain(|minute| minute.time_unix_ms < next);
        }
        Ok(LineMinutesView { minutes, next_from_unix_ms })
    }

    fn days(&self, asked: &DaysAsked, given_up: &GivenUp) -> Result<Vec<DayView>, PastError> {
        // Of a drive that has just been added all of it may wait to be written.
        let history = self.open_up_to(asked.to_unix_ms)?;
        let (since, until) = read::bounds(&history.0)?;
        let (Some(since), Some(until)) = (since, until) else { return Ok(Vec::new()) };
        let (from, to) = (asked.from_unix_ms.max(since), asked.to_unix_ms.min(until));
        let drives = meant(&history, &asked.drives)?;
        let days = usize::try_from((to - from).max(0) / 86_400_000 + 2).unwrap_or(usize::MAX);
        if days.saturating_mul(drives.len()) > AT_ONCE {
            let text = format!("{days} days of {} drives are more than are answered at once", drives.len());
            return Err(PastError::Asked(text));
        }
        let mut all = Vec::new();
        for drive in drives {
            is_waited_for(given_up)?;
            all.extend(read::days(&history.0, &drive, from, to, &|| !given_up.is_so())?);
        }
        is_waited_for(given_up).map(|()| all)
    }

    fn frames(&self, drive: &str, from_unix_ms: i64, to_unix_ms: i64) -> Result<Vec<FrameView>, PastError> {
        let frames = read::frames(&self.open()?.0, drive, from_unix_ms, to_unix_ms)?;
        let told = frames.into_iter().map(|frame| FrameView {
            why: frame.why,
            at_unix_ms: frame.at_unix_ms,
            from_unix_ms: frame.start_ms,
            to_unix_ms: frame.end_ms,
            is_whole: frame.is_whole,
            curves: frame
                .curves
                .into_iter()
                .map(|(quantity, piece)| FrameCurveView {
                    value: quantity.to_string(),
                    points: piece.closed().into_iter().map(|point| quantity.point(point)).collect(),
                })
                .collect(),
            exchanges: serde_json::from_str(&frame.exchanges).unwrap_or_default(),
            capture: frame.capture.map(FrameCaptureView::from),
        });
        Ok(told.collect())
    }

    fn capture(&self, drive: &str, at_unix_ms: i64) -> Result<Vec<u8>, PastError> {
        read::capture(&self.open()?.0, drive, at_unix_ms)?.ok_or_else(|| {
            PastError::Asked(format!("no capture is kept of {drive:?} of {at_unix_ms}: its freeze-frames tell of which there is one"))
        })
    }

    fn parameters(&self, drive: &str) -> Result<Vec<PastParameterView>, PastError> {
        Ok(read::parameters(&self.open()?.0, drive)?)
    }

    fn records(&self, asked: &RecordsAsked) -> Result<RecordsView, PastError> {
        let history = self.open()?;
        let limit = asked.limit.unwrap_or(AT_ONCE).clamp(1, AT_ONCE);
        let filter = Filter {
            from_ms: asked.from_unix_ms,
            to_ms: asked.to_unix_ms,
            drive: asked.drive.as_deref(),
            line: asked.line.as_deref(),
            kind: asked.kind.as_deref(),
            what: asked.what.as_deref(),
            only_alarms: asked.only_alarms,
            limit,
            after: asked.after,
            before: asked.before,
        };
        let read::Found { records, is_cut } = read::records(&history.0, &filter)?;
        let next = records.last().filter(|_| is_cut).map(|last| last.number);
        let (next_after, next_before) = match asked.before {
            None => (next, None),
            Some(_) => (None, next),
        };
        Ok(RecordsView { records, next_after, next_before })
    }

    fn story(&self, drive: &str, at_unix_ms: i64) -> Result<StoryView, PastError> {
        let history = self.open_up_to(at_unix_ms.saturating_add(story::LOOKED_AFTER_MS))?;
        Ok(story::tell(&history.0, drive, at_unix_ms)?)
    }

    fn note(&self, read: ParameterRead) {
        self.inbox.setting(Setting { wall_ms: wall_ms(), read });
    }

    fn maintained(&self, drive: &str, part: &str, by: &str, note: Option<&str>) {
        self.inbox.record(maintenance::done(self.clocks.now(), drive, part, by, note));
        self.done.notify_one();
    }
}

fn wall_ms() -> i64 {
    let wall = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(wall.as_millis()).unwrap_or(i64::MAX)
}
