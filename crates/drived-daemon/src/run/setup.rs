//! The first hour at the page: a port is scanned, and whoever is there is taken up, by the way of a reload.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use drive_bus::Endpoint;
use drive_families::Family;
use tokio::{runtime::Handle, sync::oneshot};

use super::reload::{Claim, Reloader};
use drived_config::config::look_alikes;
use drived_file::{
    added::{self, NewDrive},
    is_one_wire,
};
use drived_http::api::setup::{
    AlikeView, ControlWanted, DrivesWanted, FamilyView, FoundView, PortView, ScanState, ScanView, ScanWanted,
    Setup, SetupView,
};
use drived_line_tools::scan::told::{self, Alike, Found, News, Wanted};
use drived_words::{
    drive_spec::{Addresses, DriveSpec},
    failure::Failure,
    json::milliseconds,
    line_spec::LineSpec,
    ports,
};

/// Addresses of a scan that names none: all that a drive can have.
const ALL: &str = "1-247";
/// Whoever answers more often than this is told of no more: a line has no more addresses.
const FOUND: usize = 247;
/// What is wrong with a line is told so often.
const DOUBTS: usize = 32;

/// The first hour. Cheap to clone; one scan at a time.
#[derive(Clone)]
pub(super) struct Desk(Arc<Inner>);

struct Inner {
    reloader: Reloader,
    scan: Mutex<Option<Scan>>,
}

struct Scan {
    view: ScanView,
    /// No line is opened at its port while it is under way.
    claim: Option<Claim>,
    /// Gives it up.
    given_up: Option<oneshot::Sender<()>>,
}

impl Scan {
    const fn is_under_way(&self) -> bool {
        matches!(self.view.state, ScanState::Listening | ScanState::Asking)
    }
}

impl Desk {
    pub(super) fn new(reloader: Reloader) -> Self {
        Self(Arc::new(Inner { reloader, scan: Mutex::default() }))
    }

    fn scan(&self) -> MutexGuard<'_, Option<Scan>> {
        self.0.scan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn heard(&self, news: News) {
        let mut scan = self.scan();
        let Some(Scan { view, .. }) = &mut *scan else { return };
        match news {
            News::Begins { steps, takes } => {
                view.steps = steps;
                view.takes_ms = milliseconds(takes);
            }
            News::At { done, setting, address } => {
                view.state = ScanState::Asking;
                view.done = done;
                (view.setting, view.address) = (Some(setting), Some(address));
            }
            News::Found(found) if view.found.len() < FOUND => view.found.push(told_of(found)),
            News::Doubt(doubt) if view.doubts.len() < DOUBTS => view.doubts.push(doubt),
            News::Found(_) | News::Doubt(_) => {}
        }
    }

    /// Scans to the end, and says how it has ended.
    async fn carry_out(self, wanted: Wanted, given_up: oneshot::Receiver<()>) {
        // Whoever lets the other half go gives it up as well.
        let given_up = async { drop(given_up.await) };
        let ended = told::told(wanted, |news| self.heard(news), given_up).await;
        let mut scan = self.scan();
        let Some(Scan { view, given_up, claim }) = &mut *scan else { return };
        (*given_up, *claim) = (None, None);
        (view.setting, view.address) = (None, None);
        view.state = match ended {
            Ok(true) => {
                view.done = view.steps;
                ScanState::Done
            }
            Ok(false) => ScanState::GivenUp,
            Err(failure) => {
                view.why = Some(failure.to_string());
                ScanState::Failed
            }
        };
    }

    /// The drives as they are wished for, each with what the scan knows of it.
    fn named(&self, wanted: &DrivesWanted) -> Result<Vec<NewDrive>, Failure> {
        let scan = self.scan();
        let found = scan.as_ref().map_or(&[][..], |scan| &scan.view.found);
        let drives = wanted.drives.iter().map(|drive| {
            let spec = format!("{}@{}", drive.family, drive.address).parse::<DriveSpec>().map_err(input)?;
            let name =
                spec.single().ok_or_else(|| Failure::Input(format!("{:?} is no family", drive.family)))?;
            let is_it = |found: &&FoundView| found.address == drive.address && found.line == wanted.line;
            let alike = found.iter().filter(is_it).flat_map(|found| &found.families);
            let certain: Vec<&str> =
                alike.filter(|alike| alike.certain).map(|alike| &*alike.family).collect();
            let is_certain = certain.contains(&&*drive.family);
            if let (false, [says, ..]) = (is_certain, &*certain) {
                return Err(Failure::Input(format!(
                    "the drive at address {} says itself that it is {says}: it is not read as {}",
                    drive.address, drive.family
                )));
            }
            Ok(NewDrive { drive: name, name: drive.name.trim().to_owned(), is_certain })
        });
        drives.collect()
    }
}

/// A thread that ends without a word leaves no scan under way, which would keep its port for good.
struct Ending(Desk);

impl Drop for Ending {
    fn drop(&mut self) {
        if let Some(scan) = &mut *self.0.scan()
            && scan.is_under_way()
        {
            (scan.given_up, scan.claim) = (None, None);
            scan.view.state = ScanState::Failed;
            scan.view.why = Some("it has ended without saying why: see the log of the daemon".to_owned());
        }
    }
}

impl Setup for Desk {
    async fn view(&self) -> SetupView {
        let here = self.0.reloader.holds().await;
        let taken = here.lines;
        let read = tokio::task::spawn_blocking(move || present(&taken)).await;
        let families = Family::all().into_iter().map(|family| FamilyView {
            name: family.to_string(),
            title: family.capabilities().name.to_owned(),
        });
        SetupView {
            configuration: here.configuration,
            file: here.added.as_ref().map(|added| added.file.clone()),
            closed: here.closed,
            ports: read.unwrap_or_default(),
            families: families.collect(),
            scan: self.scan().as_ref().map(|scan| scan.view.clone()),
            drives: here.drives,
        }
    }

    async fn scan(&self, wanted: ScanWanted) -> Result<(), Failure> {
        let line: LineSpec = wanted.line.trim().parse().map_err(input)?;
        let endpoint = endpoint(&line)?;
        let addresses: Addresses = wanted.addresses.as_deref().unwrap_or(ALL).parse().map_err(input)?;
        self.0.reloader.may_begin()?;
        let (tell, given_up) = oneshot::channel();
        let before = {
            let mut scan = self.scan();
            if scan.as_ref().is_some_and(Scan::is_under_way) {
                return Err(Failure::Input("another scan is under way: give it up first".to_owned()));
            }
            scan.replace(Scan {
                view: ScanView {
                    line: wanted.line.trim().to_owned(),
                    state: ScanState::Listening,
                    done: 0,
                    steps: 0,
                    takes_ms: 0,
                    setting: None,
                    address: None,
                    found: Vec::new(),
                    doubts: Vec::new(),
                    why: None,
                },
                claim: Some(self.0.reloader.claim(endpoint.clone())),
                given_up: Some(tell),
            })
        };
        // The port is claimed first: who adds a line meanwhile sees the claim, or is seen.
        let lines = self.0.reloader.holds().await.lines;
        let is_taken = move || lines.into_iter().find(|(_, other)| is_one_wire(other, &endpoint));
        let taken = tokio::task::spawn_blocking(is_taken).await;
        if let Some(why) = match taken {
            Ok(taken) => taken.map(|(line, _)| {
                format!("this is the port of line {line:?}, whose drives are asked there already: a scan would disturb them")
            }),
            Err(error) => Some(error.to_string()),
        } {
            *self.scan() = before;
            return Err(Failure::Input(why));
        }
        let wanted = Wanted { line, addresses, standstill: wanted.standstill };
        // It opens its port again and again, and moves from no thread to another meanwhile.
        let (desk, runtime) = (self.clone(), Handle::current());
        std::thread::spawn(move || {
            let _ending = Ending(desk.clone());
            runtime.block_on(desk.carry_out(wanted, given_up));
        });
        Ok(())
    }

    fn cancel(&self) {
        if let Some(scan) = &mut *self.scan() {
            scan.given_up = None;
        }
    }

    async fn add(&self, wanted: DrivesWanted) -> Result<Vec<String>, Failure> {
        let spec: LineSpec = wanted.line.trim().parse().map_err(input)?;
        endpoint(&spec)?;
        let line = wanted.name.trim().to_owned();
        if let Some(oddity) = look_alikes::oddity(&line) {
            return Err(Failure::Input(format!("the name of the line {oddity}")));
        }
        let drives = self.named(&wanted)?;
        if drives.is_empty() {
            return Err(Failure::Input("no drive is chosen".to_owned()));
        }
        let port = wanted.line.trim().to_owned();
        let change = move |text: Option<&str>| {
            added::with_drives(text, (&line, &port), &drives).map_err(Failure::Input)
        };
        self.0.reloader.change_added(None, change).await
    }

    async fn control(&self, wanted: ControlWanted) -> Result<Vec<String>, Failure> {
        let ControlWanted { drive, control } = wanted;
        let ends = (!control).then(|| drive.clone());
        let change = move |text: Option<&str>| {
            text.and_then(|text| added::with_control(text, &drive, control)).ok_or_else(|| {
                Failure::Input(format!(
                    "no entry of the file is of {drive:?} alone: change it there, then reload"
                ))
            })
        };
        self.0.reloader.change_added(ends, change).await
    }
}

fn input(error: impl std::fmt::Display) -> Failure {
    Failure::Input(error.to_string())
}

/// Where a line goes.
fn endpoint(line: &LineSpec) -> Result<Endpoint, Failure> {
    match line.port() {
        Some((line, _)) => Ok(line.endpoint),
        None => Ok(line.config(&[]).map_err(input)?.endpoint),
    }
}

/// The ports that are there, each once, by the name that it keeps.
fn present(taken: &[(String, Endpoint)]) -> Vec<PortView> {
    let mut known = Vec::new();
    let mut views = Vec::new();
    for path in ports::all() {
        let device = Path::new(&path).canonicalize().ok();
        if device.is_some() && known.contains(&device) {
            continue;
        }
        let endpoint = Endpoint::Serial(PathBuf::from(&path));
        let line =
            taken.iter().find(|(_, other)| is_one_wire(other, &endpoint)).map(|(line, _)| line.clone());
        let told =
            device.as_ref().map(|device| device.display().to_string()).filter(|device| *device != path);
        known.push(device);
        views.push(PortView { path, device: told, line });
    }
    views
}

fn told_of(found: Found) -> FoundView {
    let Found { address, line, setting, verdict, families, text, fed_every } = found;
    let alike = |Alike { family, is_certain, says }: Alike| AlikeView {
        family: family.to_string(),
        certain: is_certain,
        says,
    };
    FoundView {
        address,
        line,
        setting,
        verdict,
        families: families.into_iter().map(alike).collect(),
        text,
        fed_every_ms: fed_every.map(milliseconds),
    }
}
