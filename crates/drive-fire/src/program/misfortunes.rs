//! What befalls the process and not the line: it is killed while a motor runs by it and begun again, it has no descriptors left, the disk
//! of its state is full. A stop is taken through it all, nothing starts by itself, and what was told of the past can be read behind it.

use std::{
    fs::{self, File},
    io::Write,
    net::TcpStream,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant, SystemTime},
};

use chrono::{DateTime, SecondsFormat, Utc};

use super::{
    broker::message,
    doors, judge, mqtt,
    plant::{Disk, Plant},
    process, promises,
};
use crate::{child, fuzz::Source};

/// Until all is as it was, at the most.
const LONGEST: Duration = Duration::from_secs(60);

/// How many there are.
pub(super) const COUNT: u64 = 3;

/// The one of this number, on this plant.
pub(super) fn execute(number: u64, plant: &mut Plant, rng: &mut Source) -> Result<(), String> {
    match number % COUNT {
        0 => killed(plant, rng).map_err(|why| format!("killed and begun again: {why}")),
        1 => without_descriptors(plant).map_err(|why| format!("without descriptors: {why}")),
        _ => with_a_full_disk(plant).map_err(|why| format!("with a full disk: {why}")),
    }
}

fn request(plant: &Plant, line: &str, body: &str) -> Result<String, String> {
    let len = body.len();
    let text = format!(
        "{line} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {len}\r\nConnection: close\r\n\r\n{body}"
    );
    let answer = plant.ask(plant.http, text.as_bytes()).map_err(|error| format!("{line}: {error}"))?;
    let answer = String::from_utf8_lossy(&answer).into_owned();
    if answer.starts_with("HTTP/1.1 2") { Ok(answer) } else { Err(format!("{line}: {answer}")) }
}

#[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
fn until(what: &str, mut is_so: impl FnMut() -> Result<bool, String>) -> Result<(), String> {
    let begun = Instant::now();
    loop {
        match is_so() {
            Ok(true) => return Ok(()),
            last if begun.elapsed() > LONGEST => return Err(format!("{what} did not come: {last:?}")),
            _ => thread::sleep(Duration::from_millis(50)),
        }
    }
}

fn shows(plant: &Plant, state: &str) -> Result<bool, String> {
    let shown = request(plant, "GET /api/v1/drives/pump%201", "")?;
    Ok(shown.contains(&format!("\"state\":\"{state}\"")))
}

/// Whatever the kill fell into, a run of before is stopped by whoever comes after, and nothing runs that stood.
#[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
fn killed(plant: &mut Plant, rng: &mut Source) -> Result<(), String> {
    let (ran, mut was_seen) = (rng.u8(..4) > 0, false);
    if ran {
        // By the one who may start: whoever comes over HTTP without a token may not.
        let start = || {
            let id = mqtt::id();
            let asked = format!(
                r#"{{"id": "{id}", "action": "start", "direction": "forward", "setpoint": {{"frequency_hz": 20}}, "expires_in_ms": 9000}}"#
            );
            plant.broker.give(&message("drived/drive/pump_1/command/desk", asked.as_bytes(), None));
        };
        until("the daemon at its broker", || Ok(plant.broker.has_daemon()))?;
        start();
        was_seen = rng.u8(..3) > 0;
        if was_seen {
            // One that nobody knows yet how it is refuses a start, and is asked again.
            let mut asked = Instant::now();
            until("a motor that runs", || {
                if asked.elapsed() > Duration::from_secs(4) {
                    asked = Instant::now();
                    start();
                }
                shows(plant, "running")
            })?;
        }
    }
    thread::sleep(Duration::from_millis(rng.u64(..400)));
    plant.kill();
    let begins = plant.begin();
    begins.map_err(|error| format!("it does not begin again: {error}"))?;
    if !ran {
        doors::nothing_moves(plant)?;
    }
    if was_seen {
        // What was kept before it was given is known again: a motor that still runs is its own, and is told so.
        until("that it is its own", || {
            let events = request(plant, "GET /api/v1/events/recent", "")?;
            Ok(events.contains("\"event\":\"run_adopted\"") || !shows(plant, "running")?)
        })?;
    }
    request(plant, "POST /api/v1/drives/pump%201/stop?wait=30s", "{}")?;
    until("standstill behind a stop", || Ok(!shows(plant, "running")? && !shows(plant, "stopping")?))?;
    doors::lives(plant)?;
    can_be_read(plant)
}

/// What was sound stands where it stood: nobody has begun it anew.
fn nothing_is_put_aside(history: &Path) -> Result<(), String> {
    let folder = history.parent().ok_or("it has no folder")?;
    let names = fs::read_dir(folder).map_err(|error| error.to_string())?;
    let names = names.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    match names.into_iter().find(|name| name.contains(".damaged-")) {
        Some(name) => Err(format!("what was sound was put aside: {name}")),
        None => Ok(()),
    }
}

/// Nothing more can be opened, while sixty ask to be let in: who is in already stops his motor, and behind it all live on.
fn without_descriptors(plant: &Plant) -> Result<(), String> {
    let Some(pid) = plant.pid() else { return Ok(()) };
    let Some(limit) = process::free_descriptor(pid) else { return Ok(()) };
    if !process::limit_descriptors(pid, limit) {
        return Err("skipped: prlimit is not there".to_owned());
    }
    let ports = [plant.http, plant.gateway].into_iter().cycle().take(60);
    let waiting: Vec<_> = ports.filter_map(|port| TcpStream::connect(("127.0.0.1", port)).ok()).collect();
    let stopped = mqtt::answers(&plant.broker);
    drop(waiting);
    process::limit_descriptors(pid, process::DESCRIPTORS);
    stopped?;
    until("life", || doors::lives(plant).map(|()| true))
}

/// Each file that the daemon keeps wants more than there is.
#[allow(clippy::disallowed_methods, reason = "nothing asynchronous stands here")]
fn with_a_full_disk(plant: &Plant) -> Result<(), String> {
    let own = plant.another_with(Disk::Small).map_err(|error| error.to_string())?;
    let Some(disk) = own.seen_disk() else {
        return Err("skipped: no name space of mounts is to be had".to_owned());
    };
    let filler = disk.join("filler");
    let mut file = File::create(&filler).map_err(|error| error.to_string())?;
    while file.write_all(&[0x55; 4_096]).is_ok() {}
    let wrote = file.write(&[0x55]).is_ok();
    // Some looks at each drive are kept meanwhile, or are not.
    thread::sleep(Duration::from_secs(4));
    // A stop is taken once nothing at all can be written down any more.
    let full =
        until("that nothing is done of which nobody can write", || refuses_what_cannot_be_written(&own))
            .and_then(|()| doors::lives(&own))
            .and_then(|()| mqtt::answers(&own.broker));
    drop(file);
    let _ = fs::remove_file(&filler);
    full?;
    if wrote {
        return Err("the disk was not full".to_owned());
    }
    let from = SystemTime::now() + Duration::from_secs(1);
    until("life", || doors::lives(&own).map(|()| true))?;
    judge::log(&own.log())?;
    let taken = || promises::is_taken(&own.broker, promises::by_the_desk).map(|()| true);
    until("a command that can be written down", taken)?;
    let audit = fs::read_to_string(disk.join("audit")).map_err(|error| format!("the audit log: {error}"))?;
    if !audit.contains("\"kind\":\"gap\"") {
        return Err("the audit log does not say that something is missing".to_owned());
    }
    // By its own name nobody outside of its name space finds it: a copy, with what waits to be written into it.
    let history = find(&disk).ok_or("no history is kept behind it")?;
    nothing_is_put_aside(&history)?;
    let copy = plant.folder.join("behind-a-full-disk.sqlite");
    until("what happened behind it", || {
        for (from, to) in [(history.clone(), copy.clone()), (log_of(&history), log_of(&copy))] {
            fs::copy(&from, to).map_err(|error| format!("{}: {error}", from.display()))?;
        }
        doors::lives(&own)?;
        Ok(!reads(plant, "fan", from, &copy)?.contains("nothing is recorded of that time"))
    })
}

/// A page that was begun has room for some more lines: what is refused by then is refused for want of room.
fn refuses_what_cannot_be_written(plant: &Plant) -> Result<bool, String> {
    promises::is_refused(&plant.broker, "\"audit\"", promises::by_the_desk).map(|()| true)
}

/// Where SQLite keeps what is to be written into this file.
pub(super) fn log_of(history: &Path) -> PathBuf {
    let mut name = history.as_os_str().to_owned();
    name.push("-wal");
    name.into()
}

/// The first file of a history in a folder.
pub(super) fn find(folder: &Path) -> Option<PathBuf> {
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(&folder).ok()?.filter_map(|entry| Some(entry.ok()?.path())) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "sqlite") {
                return Some(path);
            }
        }
    }
    None
}

/// What the black box has of before the kill is read by its tool.
fn can_be_read(plant: &Plant) -> Result<(), String> {
    let history = find(&plant.folder.join("state")).ok_or("no history is kept")?;
    nothing_is_put_aside(&history)?;
    reads(plant, "pump 1", SystemTime::UNIX_EPOCH, &history).map(drop)
}

/// What is told of a drive from then on.
fn reads(plant: &Plant, drive: &str, from: SystemTime, history: &Path) -> Result<String, String> {
    let from = DateTime::<Utc>::from(from).to_rfc3339_opts(SecondsFormat::Secs, true);
    let mut tool = plant.tool();
    tool.args(["history", drive, "--from", &from, "--file"]).arg(history);
    let ended = child::run(&mut tool, Duration::from_secs(20)).map_err(|error| error.to_string())?;
    judge::tool(&ended)?;
    match ended.status.and_then(|status| status.code()) {
        Some(0) => Ok(ended.stdout),
        code => Err(format!("the history is not read, {code:?}: {}", ended.stderr)),
    }
}

/// Whether a name space of mounts is to be had here, for a disk of one's own.
pub(super) fn may_mount() -> bool {
    let tried = Command::new("unshare")
        .args(["--map-root-user", "--mount", "true"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    tried.is_ok_and(|status| status.success())
}
