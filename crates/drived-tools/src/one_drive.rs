//! The one drive on which a subcommand acts.

use std::{
    collections::BTreeSet,
    sync::{Mutex, PoisonError},
};

use drive_bus::{Endpoint, Line, LineConfig};
use drive_core::{Drive, Error, Recognised, Row, Status, Written};
use drive_families::Options;
use drive_fleet::{Order, Refused, Started, view::StopModesView};
use serde_json::json;

use crate::commanded::{Commanded, LOOKED_AFTER, Stop};
use drived_client::{
    self as client, self, Daemon, DaemonArgs, Target, Told,
    own_line::{close, may_have_written, open_drive, open_line_of, wait_at_most, words},
};
use drived_file::ledger::{Ledger, LedgerArgs};
use drived_words::{
    drive_options::OptionArgs,
    drive_spec::{DriveName, DriveSpec},
    failure::Failure,
    line_spec::{self, LineSpec},
    output, values,
};

/// What nobody can know of a drive that is commanded: in one line, and once in a process, so that the answer is not lost among it.
fn say_not_known(drive: &str, not_known: &[impl AsRef<str>]) {
    static TOLD: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut told = TOLD.lock().unwrap_or_else(PoisonError::into_inner);
    if !not_known.is_empty() && told.insert(drive.to_owned()) {
        let all: Vec<&str> = not_known.iter().map(AsRef::as_ref).collect();
        output::complain(format_args!("{drive}: {}", all.join("; ")));
    }
}

/// Which drive a subcommand acts on: one on a line, by `--line` and `--drive`, or what the running daemon knows by name.
#[derive(Debug, clap::Args)]
pub struct OneDriveArgs {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", requires = "drive", conflicts_with_all = ["socket", "token_file"], help = line_spec::HELP)]
    line: Option<LineSpec>,
    /// The drive, such as atv312@1
    #[arg(long, value_name = "FAMILY@ADDRESS", requires = "line")]
    drive: Option<DriveSpec>,
    #[command(flatten)]
    options: OptionArgs,
    #[command(flatten)]
    pub daemon: DaemonArgs,
}

impl OneDriveArgs {
    /// Whether it is a drive on a line; without, it is one of the running daemon.
    pub const fn is_on_line(&self) -> bool {
        self.line.is_some()
    }

    /// The name of the one drive on a line.
    pub fn name(&self) -> Result<DriveName, Failure> {
        let drive = self.drive.as_ref().ok_or_else(unnamed)?;
        drive.single().ok_or_else(|| {
            Failure::Input("--drive names several drives: this acts on one, such as atv312@1".to_owned())
        })
    }

    /// Commands a drive or a group of the running daemon.
    pub async fn tell(&self, name: Option<&str>, told: &Told) -> Result<(), Failure> {
        let name = name.ok_or_else(unnamed)?;
        let mut daemon = self.daemon.connect().await?;
        let state = daemon.state().await?;
        let target = Target::find(&state, name)?;
        let commanded = state.drives.iter().filter(|drive| target.has(&state, drive.name()));
        commanded.for_each(|drive| say_not_known(drive.name(), &drive.not_known));
        client::order(&self.daemon, daemon, &target, told).await
    }

    /// The path of something of one drive of the running daemon.
    pub async fn path(
        &self,
        daemon: &mut Daemon,
        name: Option<&str>,
        parts: &[&str],
    ) -> Result<String, Failure> {
        let name = name.ok_or_else(unnamed)?;
        match Target::find(&daemon.state().await?, name)? {
            Target::Drive(drive) => Ok(client::path_of(&[&["drives", drive.as_str()], parts].concat())),
            _ => Err(Failure::Input(format!("{name} is a group: name one drive"))),
        }
    }

    /// Opens the line, for reading and for parameters. Nothing is sent by it.
    pub async fn open(&self) -> Result<OneDrive, Failure> {
        let line = self.line.as_ref().ok_or_else(unnamed)?;
        OneDrive::open(line, &self.options, self.name()?).await
    }

    /// The same for what writes, once the drive is known to be none of another family.
    pub async fn open_to_write(&self, ledger: &LedgerArgs) -> Result<OneDrive, Failure> {
        let mut one = self.open().await?;
        one.is_meant().await?;
        one.ledger = Some(ledger.of(one.name, &one.config));
        Ok(one)
    }

    /// Opens the line, for a command: see [`Commanded::over`].
    pub async fn command(&self, accepted: Vec<String>) -> Result<Commanded, Failure> {
        let (name, options, config) = self.parts()?;
        let line = open_line_of(Some(name), config.clone()).await?;
        say_not_known(&name.to_string(), name.family.not_known());
        Ok(self.telling(Commanded::over(name, line, config, &options, accepted)?))
    }

    /// Gives the drive an order and says what it has done when that is confirmed.
    pub async fn order(&self, order: Order, done: &str) -> Result<(), Failure> {
        let mut one = self.command(Vec::new()).await?;
        let outcome = one.command(async |drive| drive.order(order).await).await?;
        if !outcome.is_confirmed() {
            return Err(one.failure(&outcome));
        }
        self.say_done(&one, order.command().action(), &one.status_behind().await, done)?;
        one.close().await;
        Ok(())
    }

    /// Says what a command has done that is confirmed.
    pub fn say_done(
        &self,
        one: &Commanded,
        action: &str,
        status: &Status,
        done: &str,
    ) -> Result<(), Failure> {
        let name = one.name;
        let body =
            json!({ "drive": name.to_string(), "action": action, "outcome": "confirmed", "status": status });
        self.daemon.say_done(&body, || output::say(format_args!("{name} {done}: the drive shows {status}")))
    }

    /// The same for a start, with the setpoint that it uses.
    pub fn say_started(&self, one: &Commanded, started: Started, status: &Status) -> Result<(), Failure> {
        let name = one.name;
        let body = json!({
            "drive": name.to_string(), "action": "start", "outcome": "confirmed", "text": started.to_string(), "started": started,
            "status": status,
        });
        self.daemon
            .say_done(&body, || output::say(format_args!("{name} {started}: the drive shows {status}")))
    }

    /// The same for a stop, with how it was asked for and how the drive has stopped.
    pub fn say_stopped(&self, one: &Commanded, stop: &Stop) -> Result<(), Failure> {
        let (name, Stop { modes, status, restarts }) = (one.name, stop);
        // One that has tripped does no stop by any mode.
        let is_told = modes.is_told() && !status.is_fault();
        let by = if is_told { format!(", {modes}") } else { String::new() };
        let mut body = json!({
            "drive": name.to_string(), "action": "stop", "outcome": "confirmed", "stop": StopModesView::from(*modes), "status": status,
        });
        if is_told {
            body["text"] = json!(modes.to_string());
        }
        let mut behind = String::new();
        if *restarts > 0 {
            body["restarts"] = json!(restarts);
            behind = format!(
                ", and was started again by somebody else while it stopped: it was looked after for {} s more, and whoever starts it by a \
                 longer cycle does so again",
                LOOKED_AFTER.as_secs()
            );
        }
        let stopped = values::stopped(Some(status));
        self.daemon.say_done(&body, || {
            output::say(format_args!("{name} {stopped}{by}{behind}: the drive shows {status}"))
        })
    }

    /// [`command`](Self::command) for a stop, which is sent as soon as the port can be opened.
    pub fn stop(&self) -> Result<Commanded, Failure> {
        let (name, options, config) = self.parts()?;
        let line = Line::start(config.clone()).map_err(|error| Failure::Input(error.to_string()))?;
        Ok(self.telling(Commanded::over(name, line, config, &options, Vec::new())?))
    }

    /// On the way a person is told how it goes; a program gets one object at the end.
    fn telling(&self, mut one: Commanded) -> Commanded {
        one.is_quiet = self.daemon.is_json();
        one
    }

    /// Whose the port is, where a stop could not be sent because somebody else has it.
    pub async fn whose(&self) -> Option<String> {
        let (name, _, config) = self.parts().ok()?;
        let Endpoint::Serial(path) = &config.endpoint else { return None };
        client::explain(path, Some(name)).await
    }

    fn parts(&self) -> Result<(DriveName, Options, LineConfig), Failure> {
        parts(self.line.as_ref().ok_or_else(unnamed)?, &self.options, self.name()?)
    }
}

/// One drive on a line, what its owner says of it, and how the line is opened for it.
fn parts(
    line: &LineSpec,
    options: &OptionArgs,
    name: DriveName,
) -> Result<(DriveName, Options, LineConfig), Failure> {
    let options = options.of(&[name])?;
    let config = line.config(&[name]).map_err(|error| Failure::Input(error.to_string()))?;
    // No other drive waits behind a mute one here, so each request is really sent.
    Ok((name, options, LineConfig { offline_after: 0, ..config }))
}

/// Nobody has said which drive.
pub fn unnamed() -> Failure {
    Failure::Input(
        "say which drive: by its name in the running daemon (drived status lists them), or by --line and --drive"
            .to_owned(),
    )
}

/// A drive and its open line.
pub struct OneDrive {
    pub name: DriveName,
    pub drive: Box<dyn Drive>,
    config: LineConfig,
    line: Line,
    /// Where the writes to its EEPROM are counted, where any are to be.
    pub ledger: Option<Ledger>,
}

impl OneDrive {
    /// Opens a line for one drive, for reading and for parameters. Nothing is sent by it.
    pub async fn open(line: &LineSpec, options: &OptionArgs, name: DriveName) -> Result<Self, Failure> {
        let (name, options, config) = parts(line, options, name)?;
        let line = open_line_of(Some(name), config.clone()).await?;
        Ok(Self::over(name, line, config, &options))
    }

    /// The same on a line that is open.
    pub fn over(name: DriveName, line: Line, config: LineConfig, options: &Options) -> Self {
        let mut drive = open_drive(&line, name, options);
        wait_at_most(&mut *drive);
        Self { name, drive, config, line, ledger: None }
    }

    /// How the line is set.
    pub const fn config(&self) -> &LineConfig {
        &self.config
    }

    /// What a person reads when the drive did not do it.
    pub fn failure(&self, error: &Error) -> Failure {
        Failure::Drive(words(self.name, &self.config, error))
    }

    /// That it is none of another family, before anything is written to it: as a fleet judges it.
    pub async fn is_meant(&mut self) -> Result<(), Failure> {
        let identity = match self.drive.identify().await {
            Ok(identity) => identity,
            Err(error) if error.is_speechless() => return Ok(()),
            Err(error) => return Err(self.failure(&error)),
        };
        match self.drive.recognise(&identity) {
            Recognised::NotMine { it_is } => Err(Failure::Drive(format!(
                "{}: nothing was written: {}",
                self.name,
                Refused::OtherFamily(it_is.into())
            ))),
            _ => Ok(()),
        }
    }

    /// Counts what a write of this row has done to the EEPROM, or may have.
    pub fn count_of(&mut self, row: &Row, written: &Result<Written, Error>) {
        let is_written = match written {
            Ok(written) => written.changed,
            Err(error) => may_have_written(error),
        };
        self.count(is_written && row.storage.may_wear());
    }

    /// Counts a save to the EEPROM, or what may have been one.
    pub fn count_save(&mut self, saves: &Result<u32, Error>) {
        self.count(saves.as_ref().err().is_none_or(may_have_written));
    }

    fn count(&mut self, is_written: bool) {
        if let Some(ledger) = self.ledger.as_mut().filter(|_| is_written) {
            ledger.count(1);
        }
    }

    /// Closes the port.
    pub async fn close(self) {
        close(&self.line).await;
    }
}
