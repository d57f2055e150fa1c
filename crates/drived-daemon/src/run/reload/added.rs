//! Drives that are added at the page: written down, and held from then on by the way of every reload.

use drived_file::Config;
use drived_words::failure::Failure;

use super::{
    Reloader, blocking,
    changes::{Change, changes},
    no_new_doubt,
};
use crate::run::here;

impl Reloader {
    /// Whether this daemon has something to end at a drive: a run of its own, or a stop.
    fn is_answered_for(&self, drive: &str) -> bool {
        let Some(drive) = self.0.plant.fleet().drive(drive) else { return false };
        let now = drive.snapshot();
        now.lease.is_some()
            || now.stop.is_some()
            || now.suspended.is_some()
            || now.run_command_stands.is_some()
    }

    /// Changes what was added at the page, and has it hold by the way of every reload: `change` makes the new text of the old one.
    /// The whole is read and checked before anything is written, and whoever asks for one change brings no other about. Only `ends` may
    /// end by it, and is begun anew: who is only read from then on.
    ///
    /// # Errors
    /// [`Failure::Input`]: nothing is written and nothing has changed. Others as of [`Self::reload`].
    pub(in crate::run) async fn change_added(
        &self,
        ends: Option<String>,
        change: impl FnOnce(Option<&str>) -> Result<String, Failure> + Send + 'static,
    ) -> Result<Vec<String>, Failure> {
        let mut config = self.changing().await?;
        let file = self.0.file.clone();
        let read = blocking(move || {
            // As it stands now: a person may have changed it.
            let there = Config::load_to_begin(&file, None)?;
            if let Some(closed) = here::closed(there.added.as_ref()) {
                return Err(Failure::Input(here::why(closed, &file)));
            }
            let before = there.added.as_ref().and_then(|added| added.text.clone());
            let new = Config::load_with(&file, &change(before.as_deref())?)?;
            Ok((before, there, new))
        });
        let (before, there, new) = read.await?;
        no_new_doubt(&config, &new)?;
        self.leaves_the_scan(&config, &new).await?;
        // Somebody else's wishes hold when he says so himself.
        let pending = changes(&config, &there);
        let pending = pending.iter().filter(|change| change.is_now());
        let pending: Vec<_> = pending.map(|change| change.would_be(&self.0.plant.fleet())).collect();
        if !pending.is_empty() {
            return Err(Failure::Input(format!(
                "the files say more than what holds ({}), and it would come to hold with this: drived reload first",
                pending.join("; ")
            )));
        }
        if let Some(drive) = ends.as_ref().filter(|drive| self.is_answered_for(drive)) {
            return Err(Failure::Input(format!(
                "{drive} has a run command of this daemon, or a stop that is not confirmed: it could not be stopped from here any more. Stop it first"
            )));
        }
        // Whoever adds a drive takes none away, whatever has become of the files between the two readings.
        let all = changes(&config, &new);
        let is_meant = |drive: &str| ends.as_deref() == Some(drive);
        let goes = |change: &&Change| {
            change.removed_drive().is_some_and(|drive| !is_meant(drive)) || change.closed_line().is_some()
        };
        let gone = all.iter().find(goes);
        if let Some(gone) = gone {
            return Err(Failure::Input(format!(
                "the files have changed since they were read, and by them {}: drived reload first",
                gone.would_be(&self.0.plant.fleet())
            )));
        }
        let Some(added) = new.added.clone() else { return Ok(Vec::new()) };
        let written = added.clone();
        let write = move || {
            written.write(written.text.as_deref().unwrap_or_default()).map_err(|error| {
                Failure::Input(format!("{} cannot be written: {error}", written.file.display()))
            })
        };
        blocking(write).await?;
        let done = self.take(&mut config, Ok(new), None).await;
        let Err(Failure::Input(why)) = done else { return done };
        // What does not hold is not found there by the next start.
        let put_back = move || match added.put_back(before.as_deref()) {
            Ok(()) => Err(Failure::Input(why)),
            Err(error) => Err(Failure::Input(format!(
                "{why}; and {} has it still, because it cannot be written: {error}. It would hold from the next start on",
                added.file.display()
            ))),
        };
        blocking(put_back).await
    }
}
