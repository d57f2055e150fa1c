//! The first hour: which ports are there, who answers on one, and who of them is taken up. For engineers; who may see, sees it.

use std::path::PathBuf;

use axum::{
    Json, Router,
    extract::State,
    http::StatusCode,
    routing::{get, post},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    ask::{By, Sent, Viewer},
    problem::Problem,
};
use drived_config::rights::Caller;
use drived_words::failure::Failure;

/// Finds drives on a port, and has them in the plant.
pub trait Setup: Clone + Send + Sync + 'static {
    /// How it stands.
    fn view(&self) -> impl Future<Output = SetupView> + Send;

    /// Begins to scan a port. Nothing is written to anybody by it.
    ///
    /// # Errors
    /// [`Failure::Input`]: the port is a line's already, another scan is under way, or nothing of that name can be scanned.
    fn scan(&self, wanted: ScanWanted) -> impl Future<Output = Result<(), Failure>> + Send;

    /// Gives up the scan that is under way, if one is.
    fn cancel(&self);

    /// Takes drives up, to be watched: writes them down, and reads the configuration again. Gives what has changed.
    ///
    /// # Errors
    /// [`Failure::Input`] with what is wrong; nothing has changed then. Others say what holds.
    fn add(&self, wanted: DrivesWanted) -> impl Future<Output = Result<Vec<String>, Failure>> + Send;

    /// Has commands taken for a drive, or not any more. Gives what has changed.
    ///
    /// # Errors
    /// As [`Self::add`].
    fn control(&self, wanted: ControlWanted) -> impl Future<Output = Result<Vec<String>, Failure>> + Send;
}

/// How the first hour stands.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct SetupView {
    /// The configuration that the daemon was started with, and the file of what is added here.
    pub configuration: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Why nothing is added here; absent: drives can be added.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed: Option<Closed>,
    pub ports: Vec<PortView>,
    /// Every family that is known, for whoever is not told by his registers.
    pub families: Vec<FamilyView>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scan: Option<ScanView>,
    /// The drives that were added here.
    pub drives: Vec<AddedView>,
}

/// Why nothing is added here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Closed {
    /// The configuration has lines and drives of its own, and then it alone holds.
    OwnDrives,
    /// There is no folder in which it could be kept.
    NoFolder,
}

/// A serial port of this machine.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct PortView {
    /// By the name that it keeps wherever it is plugged in, if it has one.
    pub path: String,
    /// What that is now.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<String>,
    /// The line that has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<String>,
}

/// A family.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct FamilyView {
    pub name: String,
    pub title: String,
}

/// How a scan stands.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct ScanView {
    /// What is scanned, as it was asked for.
    pub line: String,
    pub state: ScanState,
    /// So many questions were asked, of so many.
    pub done: usize,
    pub steps: usize,
    /// How long it takes if nobody answers.
    pub takes_ms: u64,
    /// Where it asks now: speed, format and protocol, and the address.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setting: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub address: Option<u8>,
    pub found: Vec<FoundView>,
    /// What a person has to know of the line.
    pub doubts: Vec<String>,
    /// Why it has failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

/// What a scan does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScanState {
    /// It hears whether somebody else asks on the line.
    Listening,
    Asking,
    Done,
    GivenUp,
    Failed,
}

/// Somebody who answers.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct FoundView {
    pub address: u8,
    /// The line with the settings at which he answers.
    pub line: String,
    /// The same for a person.
    pub setting: String,
    /// `drive`, `unknown_slave`, `damaged`, or what makes two of one.
    pub verdict: String,
    /// Which families it can be of.
    pub families: Vec<AlikeView>,
    /// In words.
    pub text: String,
    /// How often it has to hear something from now on, where its watchdog is armed or cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fed_every_ms: Option<u64>,
}

/// A family that somebody can be of.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct AlikeView {
    pub family: String,
    /// Whether it has said so itself.
    pub certain: bool,
    /// What it says it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub says: Option<String>,
}

/// A drive that was added here.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
pub struct AddedView {
    pub name: String,
    pub line: String,
    /// Family and address: `atv312@1`.
    pub drive: String,
    /// Whether its family is a guess: the drive has not said so itself, and nobody has said yet that its nameplate does.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub guessed: bool,
    /// Whether commands are taken for it.
    pub control: bool,
}

/// That the scan is given up: nothing more is to be said.
#[derive(Debug, JsonSchema)]
pub struct Cancel {}

/// A scan that is wished for.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanWanted {
    /// The line as `--line` takes it: `/dev/ttyUSB0,19200,8E1`.
    pub line: String,
    /// The addresses, such as `1-31,40`; 1 to 247 unless it is said.
    #[serde(default)]
    pub addresses: Option<String>,
    /// All motors on this line stand, and will: other speeds, formats and protocols are tried too, up to the first at which
    /// somebody answers.
    #[serde(default)]
    pub standstill: bool,
}

/// Drives that are taken up.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DrivesWanted {
    /// What their line is called.
    pub name: String,
    /// The line with its settings, as the scan has told it.
    pub line: String,
    pub drives: Vec<DriveWanted>,
}

/// A drive that is taken up.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveWanted {
    pub address: u8,
    pub family: String,
    pub name: String,
}

/// Whether commands are taken for a drive.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlWanted {
    pub drive: String,
    pub control: bool,
}

/// What was done, a sentence each.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
pub struct SetupChanges {
    pub changes: Vec<String>,
}

/// Where it is served.
pub(super) const PATH: &str = "/api/v1/setup";
pub(super) const SCAN: &str = "/api/v1/setup/scan";
pub(super) const CANCEL: &str = "/api/v1/setup/scan/cancel";
pub(super) const DRIVES: &str = "/api/v1/setup/drives";
pub(super) const CONTROL: &str = "/api/v1/setup/control";

/// The routes for a program that has a configuration.
pub fn setup_router<S: Setup>(setup: S) -> Router {
    Router::new()
        .route(PATH, get(view::<S>))
        .route(SCAN, post(scan::<S>))
        .route(CANCEL, post(cancel::<S>))
        .route(DRIVES, post(add::<S>))
        .route(CONTROL, post(control::<S>))
        .with_state(setup)
}

async fn view<S: Setup>(State(setup): State<S>, _: Viewer) -> Json<SetupView> {
    Json(setup.view().await)
}

async fn scan<S: Setup>(
    State(setup): State<S>,
    By(caller): By,
    Sent(wanted): Sent<ScanWanted>,
) -> Result<Json<SetupView>, Problem> {
    may(&caller, "scan a port")?;
    // Nobody who goes away leaves a scan behind that is begun and never ends.
    let scan = setup.clone();
    let begun = tokio::spawn(async move { scan.scan(wanted).await }).await;
    begun.map_err(unfinished)?.map_err(problem)?;
    Ok(Json(setup.view().await))
}

async fn cancel<S: Setup>(State(setup): State<S>, By(caller): By) -> Result<Json<SetupView>, Problem> {
    may(&caller, "give up a scan")?;
    setup.cancel();
    Ok(Json(setup.view().await))
}

async fn add<S: Setup>(
    State(setup): State<S>,
    By(caller): By,
    Sent(wanted): Sent<DrivesWanted>,
) -> Result<Json<SetupChanges>, Problem> {
    may(&caller, "add drives")?;
    // Nobody who goes away leaves it half done.
    told(tokio::spawn(async move { setup.add(wanted).await }).await)
}

async fn control<S: Setup>(
    State(setup): State<S>,
    By(caller): By,
    Sent(wanted): Sent<ControlWanted>,
) -> Result<Json<SetupChanges>, Problem> {
    may(&caller, "say who takes commands")?;
    told(tokio::spawn(async move { setup.control(wanted).await }).await)
}

/// It changes what the program does to every drive.
fn may(caller: &Caller, what: &str) -> Result<(), Problem> {
    match caller.rights.engineer && caller.scope.is_none() {
        true => Ok(()),
        false => Err(Problem::lacks_right(caller, what)),
    }
}

fn told(
    done: Result<Result<Vec<String>, Failure>, tokio::task::JoinError>,
) -> Result<Json<SetupChanges>, Problem> {
    let changes = done.map_err(unfinished)?.map_err(problem)?;
    Ok(Json(SetupChanges { changes }))
}

fn unfinished(error: tokio::task::JoinError) -> Problem {
    Problem::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string())
}

fn problem(failure: Failure) -> Problem {
    match failure {
        Failure::Input(why) => Problem::unprocessable(why),
        failure => Problem::new(StatusCode::INTERNAL_SERVER_ERROR, failure.to_string()),
    }
}
