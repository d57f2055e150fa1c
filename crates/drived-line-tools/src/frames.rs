//! Frames of a line as they come: from a capture, from a port that is only listened to, from a line of the running daemon.

use std::{
    collections::VecDeque,
    fs,
    io::{self, Read as _},
    path::Path,
    time::Duration,
};

use drive_bus::{
    LineConfig,
    capture::{Captured, Dissector, Reader},
    listen::Listener,
};
use http_body_util::BodyExt as _;
use hyper::body::Incoming;

use super::taken::{self, Taken};
use drived_client::{DaemonArgs, path_of};
use drived_plant::plant::views::{LineView, StateView};
use drived_words::explain::Known;
use drived_words::{failure::Failure, line_spec::LineSpec, ports};

/// The longest capture that is read.
const LONGEST: u64 = 256 << 20;

/// Where frames come from.
pub(super) struct Frames {
    source: Source,
    dissector: Dissector,
    late: Option<Duration>,
    has_times: bool,
    notes: Vec<String>,
}

enum Source {
    File(VecDeque<Captured>),
    Port(Listener),
    Daemon(Box<(Incoming, Reader)>),
}

impl Frames {
    /// Those that somebody has taken down.
    fn of(taken: Taken) -> Self {
        let Taken { dissector, late, has_times, frames, notes } = taken;
        Self { source: Source::File(frames.into()), dissector, late, has_times, notes }
    }

    /// Those of words of the command line.
    pub(super) fn of_words(words: &[String], without_check: bool) -> Result<Self, Failure> {
        taken::read(words.join(" ").as_bytes(), without_check).map(Self::of).map_err(Failure::Input)
    }

    /// Those of a file, or of what comes on standard input until it ends.
    pub(super) fn of_file(file: Option<&Path>, without_check: bool) -> Result<Self, Failure> {
        taken(file, without_check).map(Self::of)
    }

    /// Those that are heard on a port from now on.
    pub(super) async fn of_port(config: &LineConfig) -> Result<Self, Failure> {
        let listener =
            Listener::open(config).await.map_err(|error| Failure::Input(ports::refused(&error)))?;
        let late = Some(listener.late());
        let (dissector, notes) = (Dissector::of(config), Vec::new());
        Ok(Self { source: Source::Port(listener), dissector, late, has_times: true, notes })
    }

    /// Those of a line of the running daemon from now on, for so many seconds, and what it knows of the line.
    pub(super) async fn of_daemon(
        args: &DaemonArgs,
        line: &str,
        seconds: u64,
    ) -> Result<(Self, Known), Failure> {
        let mut daemon = args.connect().await?;
        let state = daemon.state().await?;
        let Some(found) = state.lines.iter().find(|known| known.name == *line) else {
            let names: Vec<&str> = state.lines.iter().map(|line| line.name.as_str()).collect();
            let names = names.join(", ");
            return Err(Failure::Input(format!("there is no line {line:?}: expected one of {names}")));
        };
        let known = known(&state, found);
        let path = format!("{}/capture?seconds={seconds}", path_of(&["lines", line]));
        let answer = daemon.send("GET", &path, None).await?;
        if !answer.status().is_success() {
            return Err(Failure::Drive(format!("the daemon answers {}", answer.status())));
        }
        let source = Source::Daemon(Box::new((answer.into_body(), Reader::default())));
        let (dissector, notes) = (Dissector::Data, Vec::new());
        Ok((Self { source, dissector, late: None, has_times: true, notes }, known))
    }

    /// What the line speaks, as far as the frames that came have told it.
    pub(super) const fn dissector(&self) -> Dissector {
        self.dissector
    }

    /// How late a frame is handed over at the most, where the line is only listened to.
    pub(super) const fn late(&self) -> Option<Duration> {
        self.late
    }

    /// Whether it is known when each came.
    pub(super) const fn has_times(&self) -> bool {
        self.has_times
    }

    /// What is to be known of them besides.
    pub(super) fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The next frame; `None` when there are no more. Safe to drop.
    pub(super) async fn next(&mut self) -> Result<Option<Captured>, Failure> {
        match &mut self.source {
            Source::File(frames) => Ok(frames.pop_front()),
            Source::Port(listener) => {
                let heard = listener.next().await;
                let heard = heard.map_err(|error| Failure::Drive(format!("the port is gone: {error}")))?;
                match heard {
                    Some(heard) => Ok(Some(heard.captured())),
                    None => Err(Failure::Drive("the port is gone".to_owned())),
                }
            }
            Source::Daemon(daemon) => {
                let (body, reader) = &mut **daemon;
                let failed = |error: &dyn std::fmt::Display| {
                    Failure::Drive(format!("the capture of the daemon broke off: {error}"))
                };
                loop {
                    if let Some(frame) = reader.next_frame().map_err(|error| failed(&error))? {
                        self.dissector = reader.dissector();
                        return Ok(Some(frame));
                    }
                    match body.frame().await {
                        Some(piece) => {
                            let piece = piece.map_err(|error| failed(&error))?;
                            reader.push(piece.data_ref().map_or(&[][..], |data| data));
                        }
                        None => return Ok(None),
                    }
                }
            }
        }
    }
}

/// Whether a path is a device, which has no end.
fn is_device(path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        let kind = fs::metadata(path).map(|found| found.file_type());
        kind.is_ok_and(|kind| kind.is_char_device() || kind.is_block_device())
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        false
    }
}

/// What a file has, or what comes on standard input until it ends.
pub(super) fn taken(file: Option<&Path>, without_check: bool) -> Result<Taken, Failure> {
    let name = file.map_or_else(|| "standard input".to_owned(), |file| file.display().to_string());
    let failed = |why: &dyn std::fmt::Display| Failure::Input(format!("{name}: {why}"));
    if file.is_some_and(is_device) {
        return Err(failed(&"it is a device: expected a file, or a pipe"));
    }
    let mut bytes = Vec::new();
    let read = match file {
        Some(file) => fs::File::open(file).and_then(|file| file.take(LONGEST + 1).read_to_end(&mut bytes)),
        None => io::stdin().lock().take(LONGEST + 1).read_to_end(&mut bytes),
    };
    read.map_err(|error| failed(&error))?;
    if bytes.len() as u64 > LONGEST {
        return Err(failed(&format_args!("expected at most {} MiB", LONGEST >> 20)));
    }
    taken::read(&bytes, without_check).map_err(|why| failed(&why))
}

/// What the daemon's state says of a line.
fn known(state: &StateView, line: &LineView) -> Known {
    let drives = state.drives.iter().filter(|drive| drive.line == line.name);
    let drives =
        drives.filter_map(|drive| Some((drive.slave, (drive.family.parse().ok()?, drive.name().to_owned()))));
    let config = line.port.parse::<LineSpec>().ok().and_then(|port| port.config(&[]).ok());
    let serial = config.filter(|config| config.protocol.is_paced()).map(|config| config.serial);
    Known { serial, late: None, drives: drives.collect() }
}
