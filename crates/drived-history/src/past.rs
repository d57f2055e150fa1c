//! The history as the faces ask it: each answer has a bound, and the file is opened for each.

use std::path::PathBuf;

use drived_plant::plant::past::{
    AT_ONCE, Past, PastError, RecordsAsked, RecordsView, StoryView, ValuesAsked, ValuesView,
};

use crate::{
    quantity::{Quantity, TABLE},
    read::{self, Filter, History},
    store::StoreError,
    story,
};

/// The past of a plant in this file.
pub(crate) struct InFile(pub(crate) PathBuf);

impl From<StoreError> for PastError {
    fn from(error: StoreError) -> Self {
        Self::Unreadable(error.to_string())
    }
}

impl Past for InFile {
    fn values(&self, asked: &ValuesAsked) -> Result<ValuesView, PastError> {
        let ValuesAsked { drive, value, from_unix_ms, to_unix_ms, every_ms } = asked;
        let quantity = Quantity::named(value).ok_or_else(|| {
            let names: Vec<&str> = TABLE.iter().map(|row| row.name).collect();
            PastError::Asked(format!(
                "{value:?} is no value: expected one of {}, or word_ADDRESS",
                names.join(", ")
            ))
        })?;
        let history = History::open(&self.0)?;
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
                view.steps = read::steps(&history.0, drive, quantity, *from_unix_ms, end, every)?;
                view.next_from_unix_ms = (end < *to_unix_ms).then(|| end + 1);
            }
            None => read::points(&history.0, drive, quantity, *from_unix_ms, *to_unix_ms, |point| {
                let is_full = view.points.len() >= AT_ONCE;
                match is_full {
                    true => view.next_from_unix_ms = Some(point.at),
                    false => view.points.push(quantity.point(point)),
                }
                Ok::<_, PastError>(!is_full)
            })?,
        }
        Ok(view)
    }

    fn records(&self, asked: &RecordsAsked) -> Result<RecordsView, PastError> {
        let history = History::open(&self.0)?;
        let limit = asked.limit.unwrap_or(AT_ONCE).clamp(1, AT_ONCE);
        let filter = Filter {
            from_ms: asked.from_unix_ms,
            to_ms: asked.to_unix_ms,
            drive: asked.drive.as_deref(),
            kind: asked.kind.as_deref(),
            limit,
            after: asked.after,
        };
        let read::Found { records, is_cut } = read::records(&history.0, &filter)?;
        let next_after = records.last().filter(|_| is_cut).map(|last| last.number);
        Ok(RecordsView { records, next_after })
    }

    fn story(&self, drive: &str, at_unix_ms: i64) -> Result<StoryView, PastError> {
        Ok(story::tell(&History::open(&self.0)?.0, drive, at_unix_ms)?)
    }
}
