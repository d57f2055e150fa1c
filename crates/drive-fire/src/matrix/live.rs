//! One cell, lived through in virtual time and judged.

use std::{cell::RefCell, panic, sync::Once, time::Duration};

use drive_core::{Direction, Error, ErrorKind, Frequency, Reaction, Result, Status, StopMode, Withdrawn};
use drive_sim::Breach;
use drive_testing::{contract::Open, truth::TOLERANCE};
use tokio::time::{Instant, sleep, timeout};

use super::{
    Cell, Event, FarEnd, Fault, Operation, Subject, Untold, Way,
    axes::parameter,
    stage::{Around, Stage},
    story::Story,
    telling,
};

/// Longer than any operation may take: every retry of every exchange behind the slowest gateway, and the repetitions of a stop.
pub(super) const PATIENCE: Duration = Duration::from_secs(240);
/// How often a plant asks.
pub(super) const POLL: Duration = Duration::from_millis(300);
/// The speed at which the motor runs.
pub(super) const SETPOINT: Frequency = Frequency::from_hertz(30);

/// How a cell ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Lived {
    /// The operation said this.
    Told(&'static str),
    /// The drive could not be brought to where the operation begins, for what stands between.
    NotBegun,
    /// The operation has fewer exchanges than the fault wants.
    NotReached,
    /// It was told what is wrong, and nobody at this end of the way can tell; why.
    BeyondTelling(&'static str),
    /// What contradicted itself.
    Against(Vec<String>),
}

thread_local! {
    static PANICS: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
    static LISTENS: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// Panics of this thread are written down instead of printed while a cell lives.
fn write_panics_down() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if LISTENS.get() {
                PANICS.with_borrow_mut(|panics| panics.push(info.to_string()));
            } else {
                before(info);
            }
        }));
    });
}

/// Lives through a cell with the drive that `open` makes.
///
/// # Panics
/// When the stage itself is wrong.
#[must_use]
pub fn live(cell: &Cell, open: &Open) -> Lived {
    watched(play(cell, open))
}

/// Tells a story of the drive that `open` makes.
///
/// # Panics
/// When the stage itself is wrong.
#[must_use]
pub fn tell(story: &Story, open: &Open) -> Lived {
    watched(telling::tell(story, open))
}

/// In a virtual time of its own; whatever panics there is found.
fn watched(lives: impl Future<Output = Lived>) -> Lived {
    write_panics_down();
    LISTENS.set(true);
    PANICS.with_borrow_mut(Vec::clear);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    let runtime = runtime.expect("a runtime of one thread");
    let lived = panic::catch_unwind(panic::AssertUnwindSafe(|| runtime.block_on(lives)));
    drop(runtime);
    LISTENS.set(false);
    let panics = PANICS.take();
    if panics.is_empty() {
        return lived.unwrap_or_else(|_| Lived::Against(vec!["a panic that said nothing".to_owned()]));
    }
    Lived::Against(panics.into_iter().map(|panic| format!("a panic: {panic}")).collect())
}

async fn play(cell: &Cell, open: &Open) -> Lived {
    let mut stage = Stage::new(&cell.into(), open);
    if !prepare(cell, &mut stage).await {
        return Lived::NotBegun;
    }
    let (deeds, later) = cell.event.deeds(cell.subject);
    let around = Around::of(&stage);
    if !cell.amid {
        deeds.iter().for_each(|deed| around.happens(deed));
        sleep(Duration::from_millis(200)).await;
    }
    let before = Before::of(&stage);
    stage.bench.tap.strike(cell.fault, cell.place);
    let asked = Instant::now();
    let event = async {
        if cell.amid {
            sleep(Duration::from_millis(60)).await;
            deeds.iter().for_each(|deed| around.happens(deed));
        }
        if let Some((time, deed)) = later {
            sleep(time).await;
            around.happens(&deed);
        }
    };
    let (told, ()) = tokio::join!(timeout(PATIENCE, operate(Asks::of(cell), &mut stage)), event);
    let Ok(told) = told else {
        return Lived::Against(vec![format!("{} does not end in {PATIENCE:?}", cell.operation)]);
    };
    let fresh = cell.operation == Operation::Status;
    match &told {
        Ok(Some(status)) => stage.bench.judge_status(status, asked, fresh),
        Err(Error::NotConfirmed { status, .. }) => stage.bench.judge_status(status, asked, false),
        _ => {}
    }
    let (at_once, ended) = (stage.bench.machine.observe(), Instant::now());
    let struck = stage.bench.tap.calm();
    sleep(cell.fault.lasts()).await;
    settle(&mut stage).await;
    judge(cell, &stage, &told, &before, (&at_once, ended));
    if let Some(against) = against(&stage, cell.way, cell.untold()) {
        return against;
    }
    if cell.fault != Fault::None && !struck {
        return Lived::NotReached;
    }
    Lived::Told(match told {
        Ok(_) => "confirmed",
        Err(error) => word(&error),
    })
}

/// What was found against it, if anything.
pub(super) fn against(stage: &Stage, way: Way, untold: impl Iterator<Item = Untold>) -> Option<Lived> {
    let (mut why, explained) = stage.bench.notes.verdict(way, untold);
    why.truncate(4);
    let found = !why.is_empty();
    found.then(|| explained.map_or(Lived::Against(why), Lived::BeyondTelling))
}

/// What an error is in one word.
fn word(error: &Error) -> &'static str {
    match error.kind() {
        ErrorKind::NoAnswer => "no answer",
        ErrorKind::OutcomeUnknown => "outcome unknown",
        ErrorKind::NotSent => "not sent",
        ErrorKind::Exception => "exception",
        ErrorKind::Answer => "answer against the manual",
        ErrorKind::Refused => "refused",
        ErrorKind::NotConfirmed => "not confirmed",
        ErrorKind::Unsupported => "unsupported",
        _ => "another error",
    }
}

/// The drive is known, has its setpoint, runs where it is to run, has tripped where it is to be reset.
async fn prepare(cell: &Cell, stage: &mut Stage) -> bool {
    let begins = async {
        stage.drive.status().await.ok()?;
        let given = stage.drive.set_setpoint(SETPOINT.into()).await;
        given.or_else(|error| if error.only_a_start_shows() { Ok(()) } else { Err(error) }).ok()?;
        if cell.runs {
            stage.drive.start(Direction::Forward).await.ok()?;
            while stage.bench.machine.observe().output_frequency < 2_500 {
                stage.drive.status().await.ok()?;
                sleep(POLL).await;
            }
        }
        if cell.operation == Operation::Reset {
            let trip = cell.subject.family().simulated_trip()?;
            stage.happens(&format!("trip {trip}"));
            stage.drive.status().await.ok()?;
        }
        Some(())
    };
    matches!(timeout(Duration::from_secs(60), begins).await, Ok(Some(())))
}

/// Everything is well again, and the drive is asked as a plant asks it.
async fn settle(stage: &mut Stage) {
    poll_for(stage, Duration::from_secs(6)).await;
}

pub(super) async fn poll_for(stage: &mut Stage, time: Duration) {
    let end = Instant::now() + time;
    while Instant::now() < end {
        let asked = Instant::now();
        match timeout(PATIENCE, stage.drive.status()).await {
            Ok(Ok(status)) => stage.bench.judge_status(&status, asked, true),
            // What was read once is true only as long as the drive was not switched off.
            Ok(Err(_)) => stage.drive.forget(),
            Err(_) => stage.bench.notes.breach(format!("status does not end in {PATIENCE:?}")),
        }
        sleep(POLL).await;
    }
}

/// What there was before the operation.
struct Before {
    saved: u32,
    ran: bool,
    had_lease: bool,
}

impl Before {
    fn of(stage: &Stage) -> Self {
        let seen = stage.bench.machine.observe();
        Self { saved: seen.eeprom_writes, ran: seen.running, had_lease: stage.drive.lease().is_some() }
    }
}

/// What is asked, of which drive, and whether anything else may have changed what it holds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asks {
    pub(super) operation: Operation,
    pub(super) subject: Subject,
    pub(super) touched: bool,
}

impl Asks {
    fn of(cell: &Cell) -> Self {
        Self { operation: cell.operation, subject: cell.subject, touched: cell.event != Event::Nothing }
    }
}

pub(super) async fn operate(cell: Asks, stage: &mut Stage) -> Result<Option<Status>> {
    let drive = &mut stage.drive;
    let parameter = parameter(cell.subject);
    Ok(match (cell.operation, parameter) {
        (Operation::Status, _) => Some(drive.status().await?),
        (Operation::Measurements, _) => drive.measurements().await.map(|_| None)?,
        (Operation::Faults, _) => drive.faults().await.map(|_| None)?,
        (Operation::Identify, _) => drive.identify().await.map(|_| None)?,
        (Operation::KeepAlive, _) => drive.keep_alive().await.map(|()| None)?,
        (Operation::Start(direction), _) => Some(drive.start(direction).await?),
        (Operation::Setpoint, _) => {
            drive.set_setpoint(Frequency::from_hertz(20).into()).await.map(|()| None)?
        }
        (Operation::Stop(mode), _) => Some(drive.stop(mode).await?.status),
        (Operation::Reset, _) => Some(drive.reset_faults().await?),
        (Operation::Release, _) => Some(drive.release().await?),
        (Operation::Withdraw, _) => Some(drive.withdraw().await.map(Withdrawn::into_status)?),
        (Operation::ReadParameter, Some(row)) => {
            let held = stage.bench.machine.peek(row.address);
            let read = drive.read_parameter(row).await?;
            let touched = cell.touched;
            if Some(read) != held && !touched {
                stage.bench.notes.object(format!("{} reads {read}, the machine has {held:?}", row.code));
            }
            None
        }
        (Operation::WriteParameter, Some(row)) => {
            drive.write_parameter(row, 42).await?;
            let held = stage.bench.machine.peek(row.address);
            let touched = cell.touched;
            if held != Some(42) && !touched {
                stage
                    .bench
                    .notes
                    .object(format!("{} is told as written, the machine has {held:?}", row.code));
            }
            None
        }
        (Operation::Persist, _) => drive.persist().await.map(|_| None)?,
        (Operation::Watchdog, _) => drive.watchdog().await.map(|_| None)?,
        (Operation::ArmWatchdog, _) => {
            let claims = drive.capabilities().watchdog.ok_or(Error::no_share())?;
            let reaction = claims.reactions.iter().copied().find(|reaction| *reaction != Reaction::Ignore);
            let time = claims.min.max(Duration::from_secs(2));
            drive.arm_watchdog(time, reaction.unwrap_or(Reaction::Ramp)).await.map(|_| None)?
        }
        (Operation::ReadParameter | Operation::WriteParameter, None) => None,
    })
}

/// What is said of the operation, against what the machine does at the end.
fn judge(
    cell: &Cell,
    stage: &Stage,
    told: &Result<Option<Status>>,
    before: &Before,
    (at_once, ended): (&drive_sim::Observation, Instant),
) {
    let notes = &stage.bench.notes;
    let (seen, twin) = (stage.bench.machine.observe(), stage.twin.observe());
    for why in notes.doubled_edges(&stage.bench.machine) {
        notes.breach(why);
    }
    if seen.eeprom_writes > before.saved + 1 && cell.operation == Operation::Persist {
        notes.breach(format!("saved {} times", seen.eeprom_writes - before.saved));
    }
    silences(cell, stage);
    // One that comes down on its ramp steers for nothing.
    let steers = seen.setpoint.abs() > TOLERANCE;
    let moves = seen.running && steers && seen.output_frequency.abs() > TOLERANCE;
    // The twin heard of no reset, so that its panel could not run it.
    let by_panel = seen.local && cell.operation == Operation::Reset;
    let moves = moves && !by_panel;
    let lease = stage.drive.lease();
    if moves && !twin.running && lease.is_none() && !cell.event.silences() {
        notes.object(format!("it moves and no lease stands: {seen:?}"));
    }
    let starts = matches!(cell.operation, Operation::Start(_));
    if moves && !twin.running && !before.ran && !before.had_lease && !starts && !cell.runs {
        notes.object(format!("{} started it: {seen:?}", cell.operation));
    }
    match (cell.operation, told) {
        // An injection is held for as long as it is told to.
        (Operation::Stop(mode), Ok(_)) if moves && !twin.running && mode != StopMode::DcInjection => {
            notes.object(format!("a stop was confirmed: {seen:?}"));
        }
        (Operation::Start(_), Ok(status))
            if !at_once.running && cell.event == Event::Nothing && !is_of_before(status.as_ref(), ended) =>
        {
            notes.object(format!("a start was confirmed: {at_once:?}"));
        }
        (Operation::Start(_), Err(error))
            if error.kind() == ErrorKind::Refused && moves && !cell.runs && !before.ran && !twin.running =>
        {
            notes.object(format!("a start was refused ({error}): {seen:?}"));
        }
        (Operation::Reset, Ok(status))
            if at_once.trip.is_some()
                && cell.event == Event::Nothing
                && !is_of_before(status.as_ref(), ended) =>
        {
            notes.object(format!("a reset was confirmed: {at_once:?}"));
        }
        _ => {}
    }
}

/// Whether a confirmation is of a second ago: it says so, and what the drive's watchdog did to one whose master stood still it does not say.
pub(super) fn is_of_before(status: Option<&Status>, ended: Instant) -> bool {
    status.and_then(|status| status.at).is_some_and(|at| at + Duration::from_secs(1) < ended)
}

/// The rules of the line were kept, where the line that the simulator sees is the line that the master sees.
fn silences(cell: &Cell, stage: &Stage) {
    let sees_the_same = matches!(cell.way, Way::Rtu | Way::Ascii)
        && matches!(cell.far_end, FarEnd::Plain)
        && cell.fault != Fault::RequestTruncated
        && cell.fault != Fault::PortLost;
    if !sees_the_same {
        return;
    }
    // What comes twice may be taken for the answer to the next question, of the same words: that is over then, and its own comes later.
    let ends_early = matches!(cell.fault, Fault::Double(_));
    for violation in stage.simulated.violations() {
        // A request that was cut or changed on the way has another length for whoever listens.
        let is_excused = matches!(violation.breach, Breach::Collision { late, .. } if late || ends_early);
        if !is_excused {
            stage.bench.notes.object(format!("a rule of the line was broken: {:?}", violation.breach));
        }
    }
}
