//! A configuration that is read again while the daemon runs: only what is different changes.

mod added;
mod changes;
mod holding;
mod leavings;
mod scan;

use std::{
    path::{Path, PathBuf},
    sync::{Arc, OnceLock, PoisonError},
    time::Duration,
};

use drive_bus::Endpoint;
use drived_config::{config::NO_DRIVE, names::Names};
use drived_doors::{Pair, Tls};
use drived_file::Config;
use drived_http::api::Reload;
use drived_plant::{
    counts::{Id, Samples, Source},
    plant::{Plant, commands::Rejected, views::NoticeView},
};
use drived_words::{failure::Failure, json::unix};
use tokio::{
    sync::{Mutex, MutexGuard},
    time::{Instant, timeout},
};

use self::{
    changes::{Change, changes},
    holding::{Done, may_turn},
    leavings::Leavings,
};
use super::{faces::Faces, here::Here, kept::Kept, notify::Notify, profiles::Opened};

pub(super) use self::scan::Claim;

/// Whoever has asked for a reload hears within this time what it waits for: it goes on for as long as the exit may take (`shutdown`), and
/// his door for no longer than forty seconds.
const TOLD_WITHIN: Duration = Duration::from_secs(30);

/// Reads the configuration again. Cheap to clone; one reload at a time.
#[derive(Clone)]
pub(super) struct Reloader(Arc<Inner>);

struct Inner {
    plant: Plant,
    notify: Notify,
    names: Names,
    faces: Faces,
    opened: Opened,
    kept: Kept,
    /// By what the page is served, if not in clear.
    certificate: OnceLock<Tls>,
    file: PathBuf,
    /// What holds now.
    config: Mutex<Config>,
    /// Whether what was read last holds, and when what holds was read.
    last: std::sync::Mutex<(bool, u64)>,
    /// The drives that are being taken out, each by its policy.
    leaving: std::sync::Mutex<Vec<String>>,
    /// What is left of drives that were taken out.
    leavings: std::sync::Mutex<Leavings>,
    /// Where a scan asks: nobody opens a line there meanwhile.
    scanned: std::sync::Mutex<Option<Endpoint>>,
}

impl Reloader {
    pub(super) fn new(
        plant: Plant,
        notify: Notify,
        names: Names,
        faces: Faces,
        opened: Opened,
        kept: Kept,
        (file, config): (PathBuf, Config),
    ) -> Self {
        let last = std::sync::Mutex::new((true, unix(Instant::now())));
        Self(Arc::new(Inner {
            plant,
            notify,
            names,
            faces,
            opened,
            kept,
            certificate: OnceLock::new(),
            file,
            config: Mutex::new(config),
            last,
            leaving: std::sync::Mutex::default(),
            leavings: std::sync::Mutex::default(),
            scanned: std::sync::Mutex::default(),
        }))
    }

    /// The page is served by this certificate from the start on.
    pub(super) fn serves_by(&self, certificate: Tls) {
        // It is there once, as long as the program.
        let _ = self.0.certificate.set(certificate);
    }

    /// The certificate that takes the place of the one that is served, if the files have another.
    async fn renewed(&self, new: &Config) -> Result<Option<Pair>, Failure> {
        let Some(certificate) = self.0.certificate.get().cloned() else { return Ok(None) };
        let files = new.doors.http.as_ref().and_then(|http| http.tls.clone());
        let another = move || certificate.another(files.as_ref());
        blocking(move || another().map_err(|why| Failure::Input(format!("[http]: {why}")))).await
    }

    /// What a reload that goes on waits for: each drive that is being taken out, with what troubles it.
    fn waits_for(&self) -> String {
        let (fleet, now) = (self.0.plant.fleet(), Instant::now());
        let leaving = self.0.leaving.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let told = leaving.iter().filter_map(|name| {
            let concern = fleet.drive(name)?.snapshot().concern(now);
            Some(concern.map_or_else(|| name.clone(), |concern| format!("{name}: {concern}")))
        });
        let told: Vec<String> = told.collect();
        let waits = if told.is_empty() { String::new() } else { format!(": {}", may_turn(&told)) };
        format!("the configuration is being read again, and that goes on{waits}")
    }

    /// Reads the file and does what has changed in it, however long that takes.
    pub(super) async fn read_again(&self, dry_run: bool) -> Result<Vec<String>, Failure> {
        let mut config = self.changing().await?;
        let file = self.0.file.clone();
        // A name of a server may have to be looked up.
        let read = blocking(move || Config::load_to_begin(&file, None)).await;
        let mut read = read.and_then(|new| {
            no_new_doubt(&config, &new).and(still_own(&self.0.file, &config, &new)).map(|()| new)
        });
        if let Ok(new) = &read
            && let Err(scanned) = self.leaves_the_scan(&config, new).await
        {
            read = Err(scanned);
        }
        let renewed = match &read {
            Ok(new) => self.renewed(new).await,
            Err(_) => Ok(None),
        };
        let (read, renewed) = match renewed {
            Ok(renewed) => (read, renewed),
            Err(refused) => (Err(refused), None),
        };
        if dry_run {
            let mut changes = changes(&config, &read?);
            changes.extend(renewed.map(|_| Change::Certificate));
            return Ok(changes.iter().map(|change| change.would_be(&self.0.plant.fleet())).collect());
        }
        self.take(&mut config, read, renewed).await
    }

    /// What holds now, for whoever changes it: nobody does any more when the program is about to end, for who came then would end by no
    /// policy.
    async fn changing(&self) -> Result<MutexGuard<'_, Config>, Failure> {
        let config = self.0.config.lock().await;
        self.may_begin().map(|()| config)
    }

    /// Whether anything new may be begun.
    pub(super) fn may_begin(&self) -> Result<(), Failure> {
        match self.0.plant.is_closing() {
            true => Err(Failure::Input(Rejected::Closing.to_string())),
            false => Ok(()),
        }
    }

    /// What holds now, as far as the first hour asks.
    pub(super) async fn holds(&self) -> Here {
        Here::of(&self.0.file, &*self.0.config.lock().await)
    }

    /// Makes what was read hold, and tells everybody.
    async fn take(
        &self,
        config: &mut Config,
        read: Result<Config, Failure>,
        renewed: Option<Pair>,
    ) -> Result<Vec<String>, Failure> {
        let reloaded = match read {
            Ok(new) => {
                for why in &new.left_out {
                    tracing::warn!("a profile is left out: {why}");
                }
                self.0.notify.reloading();
                let is_renewed = renewed.is_some();
                if let (Some(pair), Some(certificate)) = (renewed, self.0.certificate.get()) {
                    certificate.take(pair);
                }
                let mut done = self.carry_out(config, new).await;
                if let Ok(done) = &mut done {
                    done.changes.extend(is_renewed.then_some(Change::Certificate));
                }
                self.0.notify.reloaded();
                done
            }
            Err(wrong) => Err(wrong),
        };
        let mut last = self.0.last.lock().unwrap_or_else(PoisonError::into_inner);
        *last = match &reloaded {
            Ok(_) => (true, unix(Instant::now())),
            Err(_) => (false, last.1),
        };
        drop(last);
        let notice = match &reloaded {
            Ok(done) if done.changes.is_empty() => None,
            Ok(Done { changes, turning }) => {
                let all: Vec<String> = changes.iter().map(ToString::to_string).collect();
                let text = format!("the configuration was read again: {}", all.join("; "));
                Some(NoticeView::new("reload", !turning.is_empty(), text))
            }
            Err(failure) => {
                let text = format!("the configuration could not be read again: {failure}");
                Some(NoticeView::new("reload", true, text))
            }
        };
        notice.into_iter().for_each(|notice| self.0.plant.tell_notice(notice));
        let Done { changes, turning } = reloaded?;
        match turning.is_empty() {
            true => Ok(changes.iter().map(ToString::to_string).collect()),
            false => Err(Failure::Drive(may_turn(&turning))),
        }
    }
}

impl Reload for Reloader {
    /// Reads the file and does what has changed in it, or with `dry_run` only says what that would be: one sentence each. The
    /// whole file is read and checked first.
    ///
    /// A drive whose settings or whose name alone have changed keeps its task, its snapshot and its motor. One that is removed, or whose
    /// line, address, family or options have changed, ends by its policy, as at the exit. What that waits for is told in time, and goes on.
    ///
    /// # Errors
    /// [`Failure::Input`] with what is wrong in the file; the old configuration holds then. [`Failure::Drive`] when a motor
    /// whose drive was removed may turn, and when only a part could be done: it says what holds then.
    async fn reload(&self, dry_run: bool) -> Result<Vec<String>, Failure> {
        let this = self.clone();
        let going = tokio::spawn(async move { this.read_again(dry_run).await });
        match timeout(TOLD_WITHIN, going).await {
            Ok(Ok(done)) => done,
            Ok(Err(error)) => Err(Failure::Drive(error.to_string())),
            Err(_) => Err(Failure::Drive(self.waits_for())),
        }
    }
}

/// Reads on a thread that may wait.
async fn blocking<T: Send + 'static>(
    read: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let read = tokio::task::spawn_blocking(read).await;
    read.unwrap_or_else(|_| Err(Failure::Input("the file could not be read".to_owned())))
}

/// A configuration that has lost its drives is no wish for those that stand aside: an editor may have half written it.
fn still_own(file: &Path, config: &Config, new: &Config) -> Result<(), Failure> {
    if new.lines.is_empty() && !config.lines.is_empty() {
        return Err(Failure::Input(format!("{}: {NO_DRIVE}", file.display())));
    }
    let has_own = config.added.as_ref().is_some_and(|added| added.is_aside);
    match &new.added {
        Some(added) if has_own && !added.is_aside => Err(Failure::Input(format!(
            "{NO_DRIVE}; those of {} hold from the next start on",
            added.file.display()
        ))),
        _ => Ok(()),
    }
}

fn no_new_doubt(config: &Config, new: &Config) -> Result<(), Failure> {
    match config.new_doubt(new) {
        Some(doubt) => Err(Failure::Input(format!("a new name: {doubt}"))),
        None => Ok(()),
    }
}

impl Source for Reloader {
    fn collect(&self, samples: &mut Samples) {
        let (is_successful, at) = *self.0.last.lock().unwrap_or_else(PoisonError::into_inner);
        samples.add(Id::ReloadSuccessful, &[], f64::from(u8::from(is_successful)));
        samples.add(Id::ReloadTime, &[], at as f64 / 1_000.0);
    }
}

#[cfg(test)]
mod tests;
