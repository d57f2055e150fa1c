//! `drived run`: the fleet as a daemon.

mod certificate;
mod descriptors;
mod eeprom;
mod exit;
mod faces;
mod here;
mod json;
mod kept;
mod notify;
mod own;
mod picture;
mod profiles;
mod reload;
mod report;
mod runs;
mod setup;
mod watchdogs;

use std::{collections::HashMap, io::IsTerminal as _, path::PathBuf, pin::pin, sync::Arc, time::Duration};

use drive_bus::Line;
use drive_families::Options;
use drive_fleet::{Fleet, FleetBuilder, Left, Place};
use drived_words::closing;
use futures_util::future::OptionFuture;
use tokio::{sync::mpsc, time::timeout};

use self::{
    faces::Faces,
    notify::Notify,
    picture::Picture,
    profiles::Opened,
    reload::Reloader,
    report::{Form, Report},
};
use drived_config::{
    config::{Group, LinePart, add, places},
    kept::{BALLAST, lay_ballast},
    names::{self, Names, PLACES, Told},
    places::Places,
    records,
    rights::Caller,
};
use drived_doors::{
    config::Http,
    {
        Doors,
        audit::{Audit, Kind, Record},
    },
};
use drived_face::Surroundings;
use drived_file::Config;
use drived_http::{
    api::{self, setup::Setup as _},
    metrics, page,
};
use drived_plant::{
    counts::Source,
    findings, journal,
    plant::{Plant, alarms::KeptAlarms, quick_stops::QuickStops, watched::Watched},
};
use drived_screen::screen::Screen;
use drived_words::{
    failure::Failure,
    logging,
    signals::{Ending, Wish, Wishes},
};

/// So many follow what happens from the start on: what is told on stdout, the log, the records of watchdogs, of EEPROMs and of runs, the plant
/// with its history, who is driven by a profile, and the audit log.
const READERS: usize = 8;
/// How long the disk has for the last records of the audit log.
const AUDITED_WITHIN: Duration = Duration::from_secs(2);
/// So soon a page has its address, unless somebody else has it.
const LINKED_WITHIN: Duration = Duration::from_secs(3);

/// Watch and command the drives of a configuration
///
/// Without a drive, or a configuration, it begins all the same, says where its page is, and waits for a reload. Events and snapshots are JSON objects on stdout, one a line; the log is on stderr. On a terminal the drives are shown as
/// a table with the log below it; where only stdout is one, it has a line for each drive whose state has changed. Ctrl-C and SIGTERM end it: each drive's
/// policy acts, and what was done is told. A second Ctrl-C ends it at once. Exit code 1 when a motor may turn that no policy
/// leaves turning. A stdout that nobody reads any more ends nothing: the drives are watched on.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The configuration, in TOML
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
    /// Where the page and the API are served: an address and a port, or off; by default as the configuration says
    #[arg(long, value_name = "ADDRESS")]
    http: Option<Http>,
    /// Where the control socket is, for the commands without a line
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// Print JSON objects on a terminal too
    #[arg(long)]
    json: bool,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let config = Config::load_to_begin(&args.config, args.http)?;
    let aside = config.added.as_ref().and_then(|added| added.aside(&args.config));
    for doubt in config.doubts().into_iter().chain(aside) {
        tracing::warn!("{doubt}");
    }
    descriptors::check(config.lines.len())?;
    let own = own::take(config.doors.state.folder.as_deref())?;
    // What is wrong with the doors is told before a drive is spoken to.
    let doors = Doors::prepare(config.doors.clone().with(args.http, args.socket)?)?;
    let faces = faces::prepare(&config, |_| true)?;
    let mut ending = Ending::listen()?;
    let notify = Notify::start();
    let mut wishes = Wishes::listen()?;
    let lines = start_lines(&config)?;
    let state = &config.doors.state;
    let folder = state.folder.as_deref();
    if let Some(folder) = folder
        && let Err(error) = lay_ballast(folder)
    {
        tracing::warn!(
            "{}: {error}: on a full disk there is no room for the stops that are not confirmed",
            folder.join(BALLAST).display()
        );
    }
    let places = places(&config.lines).collect::<Places>().after(names::places_before(folder));
    let kept = kept::Kept::open(state, &places);
    let (tell_runs, told_runs) = mpsc::unbounded_channel();
    let builder = build(&config, &lines, |place| kept.of(place)).keep_runs(tell_runs);
    // A drive may answer, or show a trip, before the last of them reads.
    let fleet =
        builder.readers_from_the_start(READERS).start().map_err(|error| Failure::Input(error.to_string()))?;
    // Nobody is watched any more for a run that was ended.
    let watched = Watched::in_folder(folder, &places, |place| kept.runs(place));
    let runs = runs::follow(kept.runs.clone(), told_runs);
    // Whatever else shows the fleet to somebody takes a handle of it and a reader of its events, as this does.
    let with_table = !args.json && logging::may_be_shown();
    let form = match with_table {
        true => Form::Table,
        false if args.json || !std::io::stdout().is_terminal() => Form::Json,
        false => Form::Text,
    };
    let mut report = Report::start(fleet.clone(), fleet.events(), config.snapshots, form);
    let journal = tokio::spawn(journal::keep(fleet.clone(), fleet.events(), journal::log));
    let watchdogs = records::follow(kept.watchdogs.clone(), fleet.events(), watchdogs::note);
    let eeproms = records::follow(kept.eeproms.clone(), fleet.events(), eeprom::note);
    let adopted = records::follow(kept.runs.clone(), fleet.events(), runs::note);
    let findings = tokio::spawn(findings::follow(fleet.clone()));
    // Before anything is kept by which a later start sees that there was this one.
    let names = Names::in_folder(config.doors.state.folder.as_deref());
    let renamed = tell_names(&names, &config.lines, &config.groups);
    let alarms = KeptAlarms::in_folder(folder, &places).with_runs_of(kept.runs.clone());
    let watched = (watched, QuickStops::in_folder(folder, &places));
    let plant = Plant::start_with(fleet.clone(), config.groups.clone(), false, &alarms, watched);
    plant.set_names(names.clone());
    renamed.iter().for_each(|(old, new)| plant.tell_renamed(old, new));
    let watched = plant.keep_watched();
    let alarms = plant.keep_alarms(alarms);
    plant.set_options(options(&config.lines));
    let opened = Opened::default();
    opened.tell(&config.lines);
    let by_profile = opened.clone().follow(plant.clone(), doors.audit(), fleet.events());
    let by_profile = tokio::spawn(by_profile);
    // Before the faces take readers of theirs, which are told what there is besides.
    let for_the_audit = fleet.events();
    let known = names.clone();
    let faces = Faces::open(faces, Surroundings::new(plant.clone(), doors.audit(), names.clone()));
    let silences = {
        let audit = doors.audit();
        let record = move |caller: &Caller, what| {
            audit.record(Record::new(Kind::Command, caller, what)).whenever();
        };
        tokio::spawn(plant.clone().follow_watched(record))
    };
    let shutdown = config.shutdown;
    let beginning = config.lines.is_empty().then(|| args.config.clone());
    let reloader = Reloader::new(
        plant.clone(),
        notify.clone(),
        names,
        faces.clone(),
        opened,
        kept,
        (args.config, config),
    );
    if let Some(tls) = doors.certificate() {
        reloader.serves_by(tls.clone());
        certificate::follow(tls, plant.clone());
    }
    let first_hour = setup::Desk::new(reloader.clone());
    let router = api::router(plant.clone())
        .merge(api::reload_router(reloader.clone()))
        .merge(api::setup::setup_router(first_hour.clone()))
        .merge(page::router());
    let sources: Vec<Arc<dyn Source>> = vec![Arc::new(reloader.clone()), Arc::new(faces.clone())];
    let doors = doors.open(metrics::serve(router, plant.clone(), sources), api::stops());
    plant.follow_audit(doors.audit().failing());
    let audited = doors.follow(known, for_the_audit);
    let watching = notify.watch(fleet.clone(), doors.listening());
    let screen = with_table.then(|| table(plant.clone())).flatten();
    // Below the table: what was said before it is behind it.
    if let Some(file) = beginning {
        let is_read = std::io::stderr().is_terminal();
        tokio::spawn(tell_beginning(file, is_read.then(|| doors.link_for_whoever_started("terminal"))));
    }
    let mut read = None;
    loop {
        tokio::select! {
            () = ending.asked() => break,
            wish = wishes.next() => match wish {
                Wish::Reload => drop(tokio::spawn(told(reloader.clone(), doors.audit()))),
                Wish::State => {
                    tell_state(&fleet);
                    faces.tell();
                }
                Wish::End => {
                    tracing::warn!("the terminal is closed: the program ends by each drive's policy");
                    break;
                }
            },
            result = report.ended(), if read.is_none() => {
                // Without this program the drives' watchdogs would stop their motors.
                tracing::warn!("nobody reads stdout any more: the drives are watched on, Ctrl-C ends it");
                read = Some(result);
            }
        }
    }
    // Until what becomes of each motor is settled everybody may stop his own, by every door; nothing else is begun any more.
    plant.close();
    drop(watching);
    findings.abort();
    // Whose the motors were is kept as it was.
    watched.abort();
    first_hour.cancel();
    // What becomes of the motors is told in words.
    let screen = OptionFuture::from(screen.map(Screen::close));
    let screen = tokio::spawn(screen);
    let stopping = notify.stopping(fleet.clone());
    let ended = exit::end(&fleet, shutdown, &mut ending).await;
    silences.abort();
    // Nothing waits for a reader of the page.
    let closed = tokio::spawn(doors.close());
    // What became of the motors is in them; that the lines are closed is not.
    plant.close_alarms();
    let _ = screen.await;
    drop(stopping);
    // It ends with the fleet, and what it says last is not lost.
    let _ = journal.await;
    let _ = watchdogs.await;
    let _ = eeproms.await;
    let _ = adopted.await;
    let _ = tokio::time::timeout(AUDITED_WITHIN, runs).await;
    let _ = tokio::time::timeout(AUDITED_WITHIN, alarms).await;
    let _ = tokio::time::timeout(AUDITED_WITHIN, by_profile).await;
    let _ = tokio::time::timeout(AUDITED_WITHIN, audited).await;
    if read.is_none() {
        report.finish().await;
    }
    let _ = closed.await;
    // Whoever reads along sees the motors stop first.
    faces.close().await;
    for (_, line) in fleet.lines() {
        closing::close(&line).await;
    }
    drop(own);
    ended.and(read.unwrap_or(Ok(())))
}

/// Says what is done first where there is no drive yet. Whoever has started the program and reads its terminal has every right to it: he
/// is told a link by which his browser has them too. What is read by others, such as a journal, never has one.
async fn tell_beginning(file: PathBuf, link: Option<impl Future<Output = Option<String>>>) {
    let file = file.display();
    let in_words = || {
        tracing::warn!(
            "no drive yet: find them at the page, as drived token link NAME --role engineer lets a browser in, or by drived scan --line \
             PORT,19200,8E1 --save {file}, then drived reload"
        );
    };
    let mut link = pin!(OptionFuture::from(link));
    // An address that is taken is tried again and again: whoever waits for the page learns meanwhile what else he can do.
    let (link, is_told) = match timeout(LINKED_WITHIN, &mut link).await {
        Ok(link) => (link, false),
        Err(_) => {
            in_words();
            (link.await, true)
        }
    };
    match link.flatten() {
        Some(link) => tracing::warn!("no drive yet. Find them in a browser, within ten minutes: {link}"),
        None if is_told => {}
        None => in_words(),
    }
}

/// Gives what there is its numbers and topics, and says in the log what has changed. Gives the drives that are called otherwise than when they
/// were there last.
fn tell_names(names: &Names, lines: &[LinePart], groups: &[Group]) -> Vec<(String, String)> {
    let mut called_otherwise = Vec::new();
    match names.take_up(&names::configured(lines, groups)) {
        Ok(Told { changed, renamed, refused }) => {
            called_otherwise = renamed;
            if !changed.is_empty() {
                tracing::info!("numbers of drives: {}", changed.join("; "));
            }
            for why in refused {
                tracing::error!("numbers of drives: {why}");
            }
        }
        Err(why) => tracing::error!("{why}"),
    }
    let places = names.slots().map_or(0, |slots| slots.len());
    if places > PLACES {
        tracing::warn!(
            "{places} numbers are given, and a virtual unit has {PLACES} places: drived names forget frees those of drives that are gone"
        );
    }
    called_otherwise
}

/// Shows the drives and the lines as a table, and the log below it.
fn table(plant: Plant) -> Option<Screen> {
    Screen::open(move |frame| Picture::of(&plant, logging::shown()).draw(frame))
}

/// Reads the configuration again and says what became of it.
async fn told(reloader: Reloader, audit: Audit) {
    let reloaded = reloader.read_again(false).await;
    let text = match &reloaded {
        Ok(done) => done.join("; "),
        Err(failure) => failure.to_string(),
    };
    audit.record(Record::of_program(Kind::Configuration, format!("read again: {text}"))).whenever();
    match reloaded {
        Ok(done) if done.is_empty() => tracing::info!("configuration read again: nothing has changed"),
        Ok(done) => tracing::info!("configuration read again: {}", done.join("; ")),
        Err(failure @ Failure::Drive(_)) => tracing::error!("configuration read again: {failure}"),
        Err(failure) => tracing::error!("the old configuration holds on: {failure}"),
    }
}

/// Says in the log how each drive is.
fn tell_state(fleet: &Fleet) {
    for (line, _) in fleet.lines() {
        for drive in fleet.drives_on(&line) {
            tracing::info!("{line}: {}: {}", drive.name(), report::text(&drive.snapshot()));
        }
    }
}

/// What the configuration says of the drives of these lines that the bus cannot tell.
fn options(lines: &[LinePart]) -> HashMap<String, Options> {
    let drives = lines.iter().flat_map(|line| &line.drives);
    drives.map(|drive| (drive.settings.name.clone(), drive.options.clone())).collect()
}

/// Starts every line. One whose port cannot be opened is tried again; its drives are lost meanwhile, and the others run.
fn start_lines(config: &Config) -> Result<Vec<Line>, Failure> {
    let start = |part: &LinePart| Line::start(part.config.clone());
    let lines = config.lines.iter().map(start).collect::<Result<_, _>>();
    lines.map_err(|error| Failure::Input(error.to_string()))
}

/// By what a run before has left of the drive at each place.
fn build(config: &Config, lines: &[Line], left: impl Fn(&Place) -> Left) -> FleetBuilder {
    let mut builder = Fleet::builder();
    for (part, line) in config.lines.iter().zip(lines) {
        builder = builder.line_with(&*part.name, line.clone(), |_| part.budget);
        builder = part
            .drives
            .iter()
            .fold(builder, |builder, drive| add(builder, part, drive, left(&part.place(drive.name))));
    }
    builder
}

/// The picture of `run` of these drives, on a wide terminal.
#[cfg(any(test, feature = "testing"))]
pub fn screen_of(drives: &[drived_plant::plant::views::DriveView]) -> String {
    let backend = ratatui::backend::TestBackend::new(400, 24);
    let mut terminal = ratatui::Terminal::new(backend).expect("it has a size");
    let picture = Picture::with(drives.to_vec(), Vec::new(), Vec::new());
    terminal.draw(|frame| picture.draw(frame)).expect("it is drawn");
    terminal.backend().to_string()
}
