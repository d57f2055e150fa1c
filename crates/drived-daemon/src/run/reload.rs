//! A configuration that is read again while the daemon runs: only what is different changes.

mod changes;

use std::{
    path::{Path, PathBuf},
    sync::{Arc, OnceLock, PoisonError},
    time::Duration,
};

use drive_bus::{Endpoint, Line};
use drive_fleet::{DriveHandle, FleetError, Left, LineBudget, Place};
use drived_words::closing;
use tokio::{
    sync::{Mutex, MutexGuard},
    time::{Instant, timeout},
};

use self::changes::{Change, changes};
use super::{
    faces::{self, Faces},
    here::{self, Here},
    kept::Kept,
    notify::Notify,
    profiles::Opened,
};
use drived_config::{
    config::{DrivePart, NO_DRIVE, add},
    names::Names,
};
use drived_doors::{Pair, Tls};
use drived_file::{Config, is_one_wire};
use drived_http::api::Reload;
use drived_plant::{
    counts::{Id, Samples, Source},
    plant::{Plant, commands::Rejected, views::NoticeView, watched::Watch},
};
use drived_words::{failure::Failure, json::unix};

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

/// A port that is a scan's until this is dropped.
pub(super) struct Claim(Reloader);

impl Drop for Claim {
    fn drop(&mut self) {
        *self.0.0.scanned.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
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

    /// No line is opened there until the claim is dropped. Whoever claims looks at the lines that are there behind it: a reload under way
    /// sees the claim, or is seen. One scan at a time: a second claim would end the first.
    pub(super) fn claim(&self, endpoint: Endpoint) -> Claim {
        *self.0.scanned.lock().unwrap_or_else(PoisonError::into_inner) = Some(endpoint);
        Claim(self.clone())
    }

    /// Two who ask on one line destroy each other's questions: a line whose port is being scanned is not opened.
    async fn leaves_the_scan(&self, config: &Config, new: &Config) -> Result<(), Failure> {
        let scanned = self.0.scanned.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let Some(scanned) = scanned else { return Ok(()) };
        let changes = changes(config, new);
        let opened = new.lines.iter().filter(|part| changes.iter().any(|change| change.opens(&part.name)));
        let opened: Vec<_> = opened.map(|part| (part.name.clone(), part.config.endpoint.clone())).collect();
        // A name of a server may have to be looked up.
        let is_there = move || Ok(opened.into_iter().find(|(_, endpoint)| is_one_wire(endpoint, &scanned)));
        match blocking(is_there).await? {
            Some((line, _)) => Err(Failure::Input(format!(
                "the port of line {line:?} is being scanned: wait for it, or give the scan up"
            ))),
            None => Ok(()),
        }
    }

    /// Makes a new configuration hold, and `config` what holds then, whatever comes of it.
    async fn carry_out(&self, config: &mut Config, mut new: Config) -> Result<Done, Failure> {
        let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
        let (plant, changes) = (&self.0.plant, changes(config, &new));
        let fleet = plant.fleet();
        // What can fail without anything being done comes first.
        let mut lines = Vec::new();
        for part in new.lines.iter().filter(|part| changes.iter().any(|change| change.opens(&part.name))) {
            let line = Line::start(part.config.clone()).map_err(|error| input(&error))?;
            lines.push((part.name.clone(), part.budget, line));
        }
        let openings =
            faces::prepare(&new, |table| changes.iter().any(|change| change.opened_face() == Some(table)))?;
        let leaving: Vec<&str> = changes.iter().filter_map(Change::removed_drive).collect();
        let gone: Vec<_> = leaving.iter().filter_map(|name| fleet.drive(name)).collect();
        self.leave(leaving.iter().map(ToString::to_string).collect());
        let actions = fleet.remove(&leaving, config.shutdown).await;
        self.leave(Vec::new());
        // Whoever has to be heard goes with the motor that he has started and that was left turning.
        let gone: Vec<_> = gone.iter().map(|handle| Leaving::of(plant, handle)).collect();
        let mut leavings =
            std::mem::take(&mut *self.0.leavings.lock().unwrap_or_else(PoisonError::into_inner));
        leavings.retain(|before| gone.iter().all(|leaving| leaving.place != before.place));
        leavings.extend(gone);
        let turning = actions.iter().filter(|(_, action)| action.is_alarm());
        let turning: Vec<String> = turning.map(|(name, action)| format!("{name}: {action}")).collect();
        for name in changes.iter().filter_map(Change::closed_line) {
            if let Some(line) = fleet.remove_line(name) {
                closing::close(&line).await;
            }
        }
        for line in &mut config.lines {
            line.drives.retain(|drive| !leaving.contains(&&*drive.settings.name));
        }
        config.lines.retain(|line| !changes.iter().any(|change| change.closed_line() == Some(&line.name)));
        // Those who leave are gone and those who come are not there yet: no name means another drive than it is meant to.
        config.groups = std::mem::take(&mut new.groups);
        plant.set_groups(config.groups.clone());
        let names_problem = plant.names_problem();
        // Who comes has his identity when he is there.
        let renamed = super::tell_names(&self.0.names, &new.lines, &config.groups);
        // Nobody asks for a drive that is not there yet.
        plant.set_options(super::options(&new.lines));
        let made = match self.may_begin() {
            Ok(()) => add_all(plant, &changes, &new, &lines, &mut leavings, &self.0.kept),
            Err(_) => Err(FleetError::ShutDown),
        };
        let made = made.map(|()| {
            tell_renamed(plant, &changes, &renamed);
            settle(plant, config, &mut new, &changes)
        });
        *self.0.leavings.lock().unwrap_or_else(PoisonError::into_inner) = leavings;
        // Also where nothing has changed: what is kept may have been mended.
        super::tell_names(&self.0.names, &config.lines, &config.groups);
        self.0.opened.tell(&config.lines);
        let closed: Vec<&str> = changes.iter().filter_map(Change::closed_face).collect();
        self.0.faces.exchange(&closed, openings).await;
        config.faces = std::mem::take(&mut new.faces);
        config.added = new.added.take();
        if !changes.is_empty() || plant.names_problem() != names_problem {
            plant.revisions().begin_anew();
        }
        let made = made.map_err(|error| (error.to_string(), halves(&changes)));
        match made.and_then(|refused| refused.map_or(Ok(()), Err)) {
            Ok(()) => Ok(Done { changes, turning }),
            Err((why, half)) => {
                let told = format!("ONLY IN PART ({why}): {}", half.join("; "));
                let parts = (!turning.is_empty()).then(|| may_turn(&turning)).into_iter().chain([told]);
                Err(Failure::Drive(parts.collect::<Vec<_>>().join("; ")))
            }
        }
    }
}

impl Reloader {
    /// These are being taken out.
    fn leave(&self, leaving: Vec<String>) {
        *self.0.leaving.lock().unwrap_or_else(PoisonError::into_inner) = leaving;
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
    pub(super) async fn change_added(
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

/// What a reload has done.
struct Done {
    changes: Vec<Change>,
    /// Who was removed and may turn.
    turning: Vec<String>,
}

fn may_turn(turning: &[String]) -> String {
    format!("THE MOTOR MAY TURN: {}", turning.join("; "))
}

/// Adds lines and drives, all of them or none.
fn add_all(
    plant: &Plant,
    changes: &[Change],
    new: &Config,
    lines: &[(String, LineBudget, Line)],
    leavings: &mut Leavings,
    kept: &Kept,
) -> Result<(), FleetError> {
    plant.fleet().extend(|mut builder| {
        for (name, budget, line) in lines {
            builder = builder.line_with(&**name, line.clone(), |_| *budget);
        }
        for part in &new.lines {
            let is_added = |drive: &&DrivePart| {
                changes.iter().any(|change| change.added_drive() == Some(&*drive.settings.name))
            };
            builder = part.drives.iter().filter(is_added).fold(builder, |builder, drive| {
                let place = part.place(drive.name);
                add(builder, part, drive, taken(leavings, kept, plant, &place, &drive.settings.name))
            });
        }
        // The file was planned as a whole.
        builder.whatever_the_plan()
    })
}

/// Tells who is called otherwise and was not there meanwhile: of those who went on the fleet tells.
fn tell_renamed(plant: &Plant, changes: &[Change], renamed: &[(String, String)]) {
    let went_on = |name: &str| {
        let mut renamed = changes.iter().filter_map(Change::renamed);
        renamed.any(|(_, settings)| settings.name == name)
    };
    let others = renamed.iter().filter(|(_, new)| !went_on(new));
    others.for_each(|(old, new)| plant.tell_renamed(old, new));
}

/// Gives the drives their new settings, and makes the lines of `config` those that there are now. What holds from the next
/// start on stays in it as it was. Gives why settings were not taken, and by whom.
fn settle(
    plant: &Plant,
    config: &mut Config,
    new: &mut Config,
    changes: &[Change],
) -> Option<(String, Vec<String>)> {
    let fleet = plant.fleet();
    let mut refused: Vec<(String, FleetError)> = Vec::new();
    for (old, settings) in changes.iter().filter_map(Change::renamed) {
        match fleet.rename(old, settings.clone()) {
            Ok(()) => plant.renamed(old, &settings.name),
            Err(error) => refused.push((settings.name.clone(), error)),
        }
    }
    for settings in changes.iter().filter_map(Change::settings) {
        if let Err(error) = fleet.reconfigure(settings.clone()) {
            refused.push((settings.name.clone(), error));
        }
    }
    let called_before = |name: &str| {
        let mut renamed = changes.iter().filter_map(Change::renamed);
        renamed.find_map(|(old, settings)| (settings.name == name).then_some(old))
    };
    let mut before = std::mem::replace(&mut config.lines, std::mem::take(&mut new.lines));
    for line in &mut config.lines {
        let Some(old) = before.iter_mut().find(|old| old.name == line.name) else { continue };
        line.budget = old.budget;
        for drive in &mut line.drives {
            let name = &drive.settings.name;
            let name = called_before(name).unwrap_or(name);
            let Some(old) = old.drives.iter().find(|old| old.settings.name == name) else { continue };
            if old.name == drive.name {
                // One that was not exchanged goes on by the profile with which it was opened.
                drive.name = old.name;
            }
            if refused.iter().any(|(name, _)| *name == drive.settings.name) {
                drive.settings = old.settings.clone();
            }
        }
    }
    let (_, why) = refused.first()?;
    let half = |change: &Change| match change.settings().or(change.renamed().map(|(_, settings)| settings)) {
        Some(settings) if refused.iter().any(|(name, _)| *name == settings.name) => change.half(),
        _ => Some(change.to_string()),
    };
    Some((why.to_string(), changes.iter().filter_map(half).collect()))
}

/// What holds when lines and drives could not be added.
fn halves(changes: &[Change]) -> Vec<String> {
    changes.iter().filter_map(Change::half).collect()
}

impl Source for Reloader {
    fn collect(&self, samples: &mut Samples) {
        let (is_successful, at) = *self.0.last.lock().unwrap_or_else(PoisonError::into_inner);
        samples.add(Id::ReloadSuccessful, &[], f64::from(u8::from(is_successful)));
        samples.add(Id::ReloadTime, &[], at as f64 / 1_000.0);
    }
}

/// What is left of a drive that is not in the fleet any more.
struct Leaving {
    place: Place,
    left: Left,
    /// Over who has started its motor, where that was left turning.
    watch: Option<Watch>,
}

impl Leaving {
    fn of(plant: &Plant, drive: &DriveHandle) -> Self {
        let (left, place) = (drive.left(), drive.place().clone());
        let watch = plant.watched().take(&place);
        let watch = watch.filter(|_| left.run.as_ref().is_some_and(|run| run.lease.is_some()));
        Self { place, left, watch }
    }
}

/// What is left of drives that are not in the fleet any more, for when they are taken up again, by whatever name.
type Leavings = Vec<Leaving>;

/// Takes what is left of the drive at a place, which is called so now: by this run, or by one before it, in whose configuration it was.
fn taken(leavings: &mut Leavings, kept: &Kept, plant: &Plant, place: &Place, name: &str) -> Left {
    let at = leavings.iter().position(|leaving| leaving.place == *place);
    let Some(Leaving { left, watch, .. }) = at.map(|at| leavings.swap_remove(at)) else {
        if kept.runs(place) {
            plant.watched().put_kept(place, name);
        }
        // Whoever comes to a place has what was kept there: it is nobody's no more.
        kept.runs.call(place, name);
        return kept.of(place);
    };
    if let Some(watch) = watch {
        plant.watched().put(place, name, watch);
    }
    left
}

#[cfg(test)]
mod tests;
