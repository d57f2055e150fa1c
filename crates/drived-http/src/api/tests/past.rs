//! The past as it is asked: whose it is.

use std::sync::Arc;

use super::*;
use drived_plant::plant::past::{
    CurvesAsked, DayView, DaysAsked, FrameView, GivenUp, KeptView, LineMinutesView, MomentView,
    ParameterRead, Past, PastError, PastParameterView, RecordsAsked, RecordsView, StepsView, StoryView,
    ValuesAsked, ValuesView,
};

/// A past in which nothing happened to one drive, and nothing else is known.
struct Of(&'static str);

fn not_asked<T>() -> Result<T, PastError> {
    Err(PastError::Unreadable("nobody asks for it here".to_owned()))
}

impl Past for Of {
    fn about(&self) -> Result<KeptView, PastError> {
        not_asked()
    }

    fn knows(&self, drive: &str) -> Result<bool, PastError> {
        Ok(drive == self.0)
    }

    fn values(&self, asked: &ValuesAsked, _: &GivenUp) -> Result<ValuesView, PastError> {
        let ValuesAsked { drive, value, .. } = asked.clone();
        Ok(ValuesView { drive, value, points: Vec::new(), steps: Vec::new(), next_from_unix_ms: None })
    }

    fn curves(&self, _: &CurvesAsked, _: &GivenUp) -> Result<StepsView, PastError> {
        not_asked()
    }

    fn moment(&self, _: i64, _: &GivenUp) -> Result<MomentView, PastError> {
        not_asked()
    }

    fn lines(&self, _: i64, _: i64) -> Result<LineMinutesView, PastError> {
        not_asked()
    }

    fn days(&self, _: &DaysAsked, _: &GivenUp) -> Result<Vec<DayView>, PastError> {
        not_asked()
    }

    fn frames(&self, _: &str, _: i64, _: i64) -> Result<Vec<FrameView>, PastError> {
        Ok(Vec::new())
    }

    fn capture(&self, _: &str, _: i64) -> Result<Vec<u8>, PastError> {
        Ok(Vec::new())
    }

    fn parameters(&self, _: &str) -> Result<Vec<PastParameterView>, PastError> {
        Ok(Vec::new())
    }

    fn records(&self, _: &RecordsAsked) -> Result<RecordsView, PastError> {
        not_asked()
    }

    fn story(&self, drive: &str, _: i64) -> Result<StoryView, PastError> {
        let (drive, [why, before, course, not_known]) = (drive.to_owned(), [const { Vec::new() }; 4]);
        Ok(StoryView { drive, about: None, why, before, course, not_known })
    }

    fn note(&self, _: ParameterRead) {}

    fn maintained(&self, _: &str, _: &str, _: &str, _: Option<&str>) {}
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_never_was_has_no_past_and_one_that_is_not_there_any_more_has_its_own() {
    let plant = TestPlant::of(1).await;
    plant.plant.set_past(Some(Arc::new(Of("pump 0"))));
    let time = "value=state&from_unix_ms=0&to_unix_ms=1&at_unix_ms=0";
    for what in ["past", "frames", "frames/capture", "parameters/past", "why"] {
        for (drive, expected) in [("pump%201", 200), ("pump%200", 200), ("pump%209", 404)] {
            let (status, told) = get(&plant.plant, &format!("/api/v1/drives/{drive}/{what}?{time}")).await;
            assert_eq!(status, expected, "{drive} {what}: {told}");
            if status == StatusCode::NOT_FOUND {
                assert_eq!(told["detail"], "there is no drive \"pump 9\"", "{what}");
            }
        }
    }
}
