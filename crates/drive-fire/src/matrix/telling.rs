//! A story, told step by step, and judged at each.

use std::time::Duration;

use drive_core::{Error, ErrorKind};
use drive_testing::{contract::Open, truth::TOLERANCE};
use tokio::time::{Instant, sleep, timeout};

use super::{
    Fault, Operation,
    axes::settings,
    live::{Asks, Lived, PATIENCE, SETPOINT, against, is_of_before, operate, poll_for},
    stage::{Around, Site, Stage},
    story::{Step, Story},
};

/// What was done so far.
#[derive(Debug, Default)]
struct Done {
    /// A start was asked for, whatever became of it.
    started: bool,
    /// Control was to be given back, whatever became of it.
    released: bool,
    /// A fault was to be reset, whatever became of it.
    reset: bool,
    touched: bool,
}

impl Done {
    fn asked(&mut self, operation: Operation) {
        self.started |= matches!(operation, Operation::Start(_));
        self.released |= operation == Operation::Release;
        self.reset |= operation == Operation::Reset;
    }
}

pub(super) async fn tell(story: &Story, open: &Open) -> Lived {
    let stalls = story.steps.iter().any(|step| matches!(step, Step::Strike(Fault::Stall(_), _)));
    let Story { subject, way, far_end, .. } = *story;
    let seed = story.steps.len() as u64;
    let mut stage = Stage::new(&Site { subject, way, far_end, seed, stalls }, open);
    stage.bench.notes.alone(story.is_alone());
    let mut done = Done::default();
    poll_for(&mut stage, Duration::from_secs(1)).await;
    let _ = timeout(PATIENCE, stage.drive.set_setpoint(SETPOINT.into())).await;
    for step in &story.steps {
        match *step {
            Step::Ask(operation) => {
                if ask(story, &mut stage, operation, &mut done).await.is_none() {
                    return Lived::Against(vec![format!("{operation} does not end in {PATIENCE:?}")]);
                }
            }
            Step::Drops(operation, cut) => {
                let asks = Asks { operation, subject, touched: done.touched };
                let _ = timeout(Duration::from_millis(u64::from(cut) * 5), operate(asks, &mut stage)).await;
                done.asked(operation);
                // What is on the wire finishes there.
                sleep(Duration::from_millis(500)).await;
            }
            Step::Strike(fault, behind) => stage.bench.tap.strike(fault, behind),
            Step::Happens(event) => {
                done.touched = true;
                let around = Around::of(&stage);
                let (deeds, later) = event.deeds(subject);
                deeds.iter().for_each(|deed| around.happens(deed));
                if let Some((time, deed)) = later {
                    sleep(time).await;
                    around.happens(&deed);
                }
            }
            Step::Sets(setting) => {
                let setting = settings(subject).get(usize::from(setting));
                if let Some(setting) = setting.filter(|_| !stage.bench.machine.observe().running) {
                    done.touched = true;
                    stage.happens(&format!("set {setting}"));
                }
            }
            Step::Live(seconds) => poll_for(&mut stage, Duration::from_secs(seconds.into())).await,
        }
    }
    // Everything is well again, as long as it takes.
    stage.bench.tap.calm();
    let lasts = |step: &Step| if let Step::Strike(fault, _) = step { fault.lasts() } else { Duration::ZERO };
    sleep(story.steps.iter().map(lasts).max().unwrap_or_default()).await;
    poll_for(&mut stage, Duration::from_secs(8)).await;
    at_the_end(&stage, &done);
    against(&stage, story.way, story.untold()).unwrap_or(Lived::Told("told"))
}

/// Asks, and judges what is told at once. `None`: it does not end.
async fn ask(story: &Story, stage: &mut Stage, operation: Operation, done: &mut Done) -> Option<()> {
    let (ran, had_lease) = (stage.bench.machine.observe().running, stage.drive.lease().is_some());
    let asked = Instant::now();
    let asks = Asks { operation, subject: story.subject, touched: done.touched };
    let told = timeout(PATIENCE, operate(asks, stage)).await.ok()?;
    let seen = stage.bench.machine.observe();
    if matches!(operation, Operation::Stop(_)) && told.is_ok() {
        stage.bench.notes.comes_down();
    }
    match &told {
        Ok(Some(status)) => stage.bench.judge_status(status, asked, operation == Operation::Status),
        Err(Error::NotConfirmed { status, .. }) => stage.bench.judge_status(status, asked, false),
        _ => {}
    }
    let twin_runs = stage.twin.observe().running;
    let steers = seen.setpoint.abs() > TOLERANCE && seen.output_frequency.abs() > TOLERANCE;
    match (operation, &told) {
        (Operation::Start(_), Ok(status))
            if !seen.running && !done.touched && !is_of_before(status.as_ref(), Instant::now()) =>
        {
            stage.bench.notes.object(format!("a start was confirmed: {seen:?}"));
        }
        (Operation::Start(_), Err(error))
            if error.kind() == ErrorKind::Refused
                && seen.running
                && steers
                && !ran
                && !had_lease
                && !twin_runs
                && !done.started =>
        {
            stage.bench.notes.object(format!("a start was refused ({error}): {seen:?}"));
        }
        _ => {}
    }
    done.asked(operation);
    if matches!(operation, Operation::Stop(_)) && told.is_ok() && !done.touched {
        // Behind a confirmed stop it steers for nothing, or comes down.
        let before = seen.output_frequency.abs();
        poll_for(stage, Duration::from_secs(1)).await;
        let seen = stage.bench.machine.observe();
        if seen.running
            && seen.output_frequency.abs() > before.max(TOLERANCE)
            && !stage.twin.observe().running
        {
            stage.bench.notes.object(format!("a stop was confirmed: {seen:?}"));
        }
    }
    Some(())
}

fn at_the_end(stage: &Stage, done: &Done) {
    let notes = &stage.bench.notes;
    for why in notes.doubled_edges(&stage.bench.machine) {
        notes.breach(why);
    }
    let (seen, twin) = (stage.bench.machine.observe(), stage.twin.observe());
    let steers = seen.setpoint.abs() > TOLERANCE && seen.output_frequency.abs() > TOLERANCE;
    if !(seen.running && steers) || twin.running {
        return;
    }
    if stage.drive.lease().is_none() {
        // Whom it was released to commands it, and the twin was released to nobody. Nor did that hear of a reset, so that its panel could
        // not run it.
        if done.released || done.reset && seen.local {
            return;
        }
        notes.object(format!("it moves and no lease stands: {seen:?}"));
    } else if !done.started {
        notes.object(format!("nobody has started it: {seen:?}"));
    }
}
