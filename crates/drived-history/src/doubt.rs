//! Whoever reads the file finds damage where nothing is written any more: [`ask`] has its writer put it aside then.

use drived_plant::plant::past::PastError;

use crate::{store::StoreError, write::inbox::Inbox};

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
