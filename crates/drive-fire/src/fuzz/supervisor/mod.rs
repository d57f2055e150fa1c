//! Whoever looks after a drive, by what the drive replies: one that is no family's, whose answers are late, lost, refused or true as the
//! numbers have it, that trips, is taken by others and is exchanged for another one, while it is commanded. What it has done, and what it
//! told, is held against what the fleet does and says.

mod hands;
mod puppet;
mod truth;

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, SerialSettings, StopMode};
use drive_fleet::{DriveHandle, DriveSettings, Fleet, FrequencyLimits, Outcome};
use drive_sim::{SimLine, Wiring};
use tokio::time::{Instant, sleep};

use super::source::Source;
pub(super) use hands::execute as execute_hands;
use puppet::Puppet;
use truth::{Given, LIMIT, Truth};

/// Everything is told by then.
const LONGEST: Duration = Duration::from_secs(240);
/// Commands and events of one life, at the most.
const STEPS: usize = 24;

/// What was ordered, of what is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ordered {
    Start(Direction),
    Setpoint(Frequency),
    Stop,
    Other,
}

pub(super) fn execute(source: Source) -> Result<(), String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    runtime.map_err(|error| error.to_string())?.block_on(live(source))
}

fn locked(truth: &Mutex<Truth>) -> MutexGuard<'_, Truth> {
    truth.lock().unwrap_or_else(PoisonError::into_inner)
}

async fn live(mut source: Source) -> Result<(), String> {
    let control = source.u8(..8) > 0;
    let steps = source.usize(1..=STEPS);
    let truth = Arc::new(Mutex::new(Truth::new(source, control)));
    let settings = DriveSettings {
        control,
        limits: FrequencyLimits { high: Some(LIMIT), ..FrequencyLimits::default() },
        ..DriveSettings::watched("puppet")
    };
    let serial = SerialSettings::MODBUS_DEFAULT;
    let line = Line::over(SimLine::new(Wiring::rtu(serial)).in_memory(), LineConfig::stream(serial));
    let fleet = Fleet::builder()
        .whatever_the_plan()
        .line("line", line)
        .drive("line", 1, settings, |_, slave| Box::new(Puppet::new(Arc::clone(&truth), slave)))
        .start()
        .map_err(|error| error.to_string())?;
    let drive = fleet.drives()[0].clone();
    for _ in 0..steps {
        let (what, frequency, wait) = {
            let source = &mut locked(&truth).source;
            (source.u8(..14), Frequency::from_hertz(source.u16(10..50)), source.u16(..))
        };
        match what {
            0..=2 => start(&drive, &truth, Direction::Forward, frequency),
            3 => start(&drive, &truth, Direction::Reverse, frequency),
            4 | 5 => stop(&drive, &truth),
            6 => {
                let ticket = drive.set_setpoint(frequency);
                tell(&truth, Ordered::Setpoint(frequency), async move { ticket.finished().await });
            }
            7 => {
                locked(&truth).resets_ordered += 1;
                let ticket = drive.reset_faults();
                tell(&truth, Ordered::Other, async move { ticket.finished().await });
            }
            _ => locked(&truth).happens(what),
        }
        // Some come at once behind each other, most have their time.
        let wait = if wait % 4 == 0 { 0 } else { u64::from(wait) % 8_000 };
        sleep(Duration::from_millis(wait)).await;
    }
    locked(&truth).becomes_calm();
    sleep(LONGEST).await;
    locked(&truth).judge_the_end();
    if drive.watch().has_changed().is_err() {
        locked(&truth).object("whoever looks after it has ended before his fleet");
    }
    // What runs by this side now is stopped by its end.
    drop(fleet.shutdown(Duration::from_secs(60)).await);
    sleep(LONGEST).await;
    let mut truth = locked(&truth);
    if truth.runs() {
        truth.object("it runs behind the end of the fleet that has started it");
    }
    truth.against.take().map_or(Ok(()), |against| Err(format!("{against}: {}", truth.story.join(", "))))
}

fn start(drive: &DriveHandle, truth: &Arc<Mutex<Truth>>, direction: Direction, frequency: Frequency) {
    let ticket = drive.start_at(direction, frequency);
    tell(truth, Ordered::Start(direction), async move { ticket.finished().await });
}

fn stop(drive: &DriveHandle, truth: &Arc<Mutex<Truth>>) {
    let ticket = drive.stop(StopMode::Ramp);
    tell(truth, Ordered::Stop, async move { ticket.finished().await });
}

/// What becomes of an order is told to the judge when it is told.
fn tell(
    truth: &Arc<Mutex<Truth>>,
    ordered: Ordered,
    finished: impl Future<Output = Outcome> + Send + 'static,
) {
    let (given, truth) = (Instant::now(), Arc::clone(truth));
    locked(&truth).given(Given { ordered, at: given, by: "owner", setpoint: None, of_group: false });
    drop(tokio::spawn(async move {
        let outcome = finished.await;
        locked(&truth).told(ordered, given, &outcome);
    }));
}
