//! Whoever reads the file finds damage where nothing is written any more: [`ask`] has its writer put it aside then, and [`Asked`] is the past
//! that is asked so.

use drived_plant::plant::past::{
    CurvesAsked, DayView, DaysAsked, FrameView, GivenUp, KeptView, LineMinutesView, MomentView,
    ParameterRead, Past, PastError, PastParameterView, RecordsAsked, RecordsView, StepsView, StoryView,
    ValuesAsked, ValuesView,
};

use crate::{past::InFile, store::StoreError, write::inbox::Inbox};

/// Why something cannot be read, as far as it tells of the file itself.
pub(crate) trait Doubt {
    /// What cannot be right in it; `None`: it may be sound.
    fn damage(&self) -> Option<String>;
}

impl Doubt for StoreError {
    fn damage(&self) -> Option<String> {
        self.is_damage().then(|| self.to_string())
    }
}

impl Doubt for PastError {
    fn damage(&self) -> Option<String> {
        match self {
            Self::Damaged(why) => Some(why.clone()),
            _ => None,
        }
    }
}

/// Asks a question that opens the file. What is found damaged is opened and asked once more, since not every reading that fails is the fault of
/// what is read; its writer is told of what is found twice.
pub(crate) fn ask<T, E: Doubt>(inbox: &Inbox, mut question: impl FnMut() -> Result<T, E>) -> Result<T, E> {
    let file = inbox.file();
    let told = question();
    if !told.as_ref().is_err_and(|error| error.damage().is_some()) {
        return told;
    }
    let again = question();
    if let Some(why) = again.as_ref().err().and_then(Doubt::damage) {
        inbox.is_damaged(file, why);
    }
    again
}

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
