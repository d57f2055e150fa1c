//! The past as the faces have it: that of a file which a writer of this program writes, who puts it aside where it is found damaged.

use drived_plant::plant::past::{
    CurvesAsked, DayView, DaysAsked, FrameView, GivenUp, KeptView, LineMinutesView, MomentView,
    ParameterRead, Past, PastError, PastParameterView, RecordsAsked, RecordsView, StepsView, StoryView,
    ValuesAsked, ValuesView,
};

use crate::{doubt::ask, past::InFile};

/// The past of a file that a writer of this program writes.
pub(crate) struct Asked(pub(crate) InFile);

impl Asked {
    fn ask<T>(&self, question: impl Fn(&InFile) -> Result<T, PastError>) -> Result<T, PastError> {
        ask(&self.0.inbox, || question(&self.0))
    }
}

impl Past for Asked {
    fn about(&self) -> Result<KeptView, PastError> {
        self.ask(InFile::about)
    }

    fn knows(&self, drive: &str) -> Result<bool, PastError> {
        self.ask(|past| past.knows(drive))
    }

    fn values(&self, asked: &ValuesAsked, given_up: &GivenUp) -> Result<ValuesView, PastError> {
        self.ask(|past| past.values(asked, given_up))
    }

    fn curves(&self, asked: &CurvesAsked, given_up: &GivenUp) -> Result<StepsView, PastError> {
        self.ask(|past| past.curves(asked, given_up))
    }

    fn moment(&self, at_unix_ms: i64, given_up: &GivenUp) -> Result<MomentView, PastError> {
        self.ask(|past| past.moment(at_unix_ms, given_up))
    }

    fn lines(&self, from_unix_ms: i64, to_unix_ms: i64) -> Result<LineMinutesView, PastError> {
        self.ask(|past| past.lines(from_unix_ms, to_unix_ms))
    }

    fn days(&self, asked: &DaysAsked, given_up: &GivenUp) -> Result<Vec<DayView>, PastError> {
        self.ask(|past| past.days(asked, given_up))
    }

    fn frames(&self, drive: &str, from_unix_ms: i64, to_unix_ms: i64) -> Result<Vec<FrameView>, PastError> {
        self.ask(|past| past.frames(drive, from_unix_ms, to_unix_ms))
    }

    fn capture(&self, drive: &str, at_unix_ms: i64) -> Result<Vec<u8>, PastError> {
        self.ask(|past| past.capture(drive, at_unix_ms))
    }

    fn parameters(&self, drive: &str) -> Result<Vec<PastParameterView>, PastError> {
        self.ask(|past| past.parameters(drive))
    }

    fn records(&self, asked: &RecordsAsked) -> Result<RecordsView, PastError> {
        self.ask(|past| past.records(asked))
    }

    fn story(&self, drive: &str, at_unix_ms: i64) -> Result<StoryView, PastError> {
        self.ask(|past| past.story(drive, at_unix_ms))
    }

    fn note(&self, read: ParameterRead) {
        self.0.note(read);
    }

    fn maintained(&self, drive: &str, part: &str, by: &str, note: Option<&str>) {
        self.0.maintained(drive, part, by, note);
    }
}
