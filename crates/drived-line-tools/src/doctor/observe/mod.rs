//! The task that listens and asks, and notes what comes of it. It reads only.

mod asking;
mod chance;
mod noting;
mod terms;

use std::{collections::BTreeSet, pin::pin, time::Duration};

use drive_bus::{Line, LineConfig, listen::Listener};
use drive_core::{
    SlaveAddress,
    serial::{CharacterFormat, Parity, SerialSettings},
};
use tokio::time::{self, Instant};

use self::asking::Asking;
use super::observations::{Adapter, Listened, Observations};
use drived_client::own_line;
use drived_words::{drive_spec::DriveName, failure::Failure};

/// How long the line is listened to before anything is asked: a panel or a PLC asks once a second or more often.
pub(super) const LISTENING: Duration = Duration::from_secs(3);

/// How long at each other speed and format, where somebody talks at one that is not ours.
pub(super) const ELSEWHERE: Duration = Duration::from_secs(1);

/// How long an answer is waited for from a slave that is there or should be: twice what masters usually wait.
pub(super) const PATIENCE: Duration = Duration::from_secs(1);

/// A slave that should be there and is silent is asked so often before it is left out of the rounds.
const TRIES: u32 = 3;

/// The longest pause that is left to chance: longer than any clock of an adapter that is looked for.
const DITHER: Duration = Duration::from_millis(48);

/// How the line is reached: a port, or in a test a simulated line.
pub(super) trait Ways {
    async fn open(&self, config: LineConfig) -> Result<Line, Failure>;
    async fn listen(&self, config: &LineConfig) -> Result<Listener, Failure>;
    fn adapter(&self) -> Adapter;
}

/// What to look at.
#[derive(Debug, Clone)]
pub(super) struct Task {
    pub(super) config: LineConfig,
    /// Who should be there; empty: whoever answers at the addresses.
    pub(super) expected: Vec<DriveName>,
    pub(super) addresses: Vec<SlaveAddress>,
    /// How long an address that may be nobody's is waited for.
    pub(super) wait: Duration,
    /// How long those that are there are asked.
    pub(super) time: Duration,
}

impl Task {
    /// How long it takes where nobody is missing.
    pub(super) fn estimate(&self) -> Duration {
        let per_address = if self.expected.is_empty() { self.wait } else { DITHER };
        let addresses = u32::try_from(self.addresses.len()).unwrap_or(u32::MAX);
        LISTENING + (per_address + self.config.silence() * 8).saturating_mul(addresses) + self.time
    }

    /// How much longer for each drive that should be there and is silent.
    pub(super) fn estimate_of_silent(&self) -> Option<Duration> {
        (!self.expected.is_empty()).then(|| PATIENCE * TRIES)
    }
}

/// Listens, asks, and gives what was noticed: until it is done, is asked to `end`, or loses its port.
pub(super) async fn observe(
    task: &Task,
    ways: &impl Ways,
    mut progress: impl FnMut(&str),
    end: impl Future<Output = ()>,
) -> Result<Observations, Failure> {
    let began = Instant::now();
    let mut end = pin!(end);
    let mut seen = Observations {
        config: task.config.clone(),
        adapter: Adapter::default(),
        expected: task.expected.clone(),
        addresses: task.addresses.iter().map(|slave| slave.number()).collect(),
        listened: Listened::default(),
        elsewhere: Vec::new(),
        asked: Vec::new(),
        own_waits: Vec::new(),
        tripped: BTreeSet::new(),
        overdue: Vec::new(),
        never_quiet: false,
        findings: Vec::new(),
        cut_short: None,
        took: Duration::ZERO,
    };
    if task.config.protocol.is_paced() {
        tokio::select! {
            heard = listen_first(task, ways, &mut seen, &mut progress) => heard?,
            () = &mut end => return Err(Failure::Drive("asked to end before anything could be said".to_owned())),
        }
    }
    let mut asking = Asking::open(task, ways, began).await?;
    let ended = tokio::select! {
        ended = asking.all(task, &mut progress) => ended,
        () = &mut end => Err(Failure::Drive("it was asked to end".to_owned())),
    };
    own_line::close(&asking.line).await;
    if let Err(failure) = ended {
        if asking.asked.is_empty() {
            return Err(failure);
        }
        seen.cut_short = Some(failure.to_string());
    }
    asking.into(&mut seen);
    let good = seen.asked.iter().filter(|asked| asked.is_good()).count();
    let nobody_answers = good * 4 < seen.asked.len() && seen.cut_short.is_none();
    if task.config.protocol.is_paced() && nobody_answers {
        progress("others are understood, but nobody answers: listening with another parity");
        listen_with_parity(task, ways, &mut seen).await?;
    }
    seen.adapter = ways.adapter();
    seen.took = began.elapsed();
    Ok(seen)
}

async fn listen_first(
    task: &Task,
    ways: &impl Ways,
    seen: &mut Observations,
    progress: &mut impl FnMut(&str),
) -> Result<(), Failure> {
    progress("listening");
    seen.listened = listen(ways, &task.config, LISTENING).await?;
    listen_elsewhere(task, ways, seen, progress).await
}

async fn listen(ways: &impl Ways, config: &LineConfig, time: Duration) -> Result<Listened, Failure> {
    let mut listener = ways.listen(config).await?;
    let mut heard = Vec::new();
    let all = async {
        while let Ok(Some(frame)) = listener.next().await {
            heard.push(frame);
        }
        // A port that fails now fails again when it is opened to ask, and is told of then.
        std::future::pending::<()>().await;
    };
    let _ = time::timeout(time, all).await;
    Ok(Listened { time, heard })
}

/// Looks for the speed and format at which makes sense what makes none at ours.
async fn listen_elsewhere(
    task: &Task,
    ways: &impl Ways,
    seen: &mut Observations,
    progress: &mut impl FnMut(&str),
) -> Result<(), Failure> {
    let (noise, frames) = (seen.listened.noise().count(), seen.listened.frames().count());
    if noise < 8 || frames * 8 > noise {
        return Ok(());
    }
    for serial in usual_settings().into_iter().filter(|serial| *serial != task.config.serial) {
        progress(&format!("somebody talks, but not at {}: listening at {serial}", task.config.serial));
        let config = LineConfig { serial, ..task.config.clone() };
        let heard = listen(ways, &config, ELSEWHERE).await?;
        let is_it = heard.frames().count() >= 2 && heard.noise().count() < heard.frames().count() * 4;
        seen.elsewhere.push((serial, heard));
        if is_it {
            break;
        }
    }
    Ok(())
}

/// A port without parity hears those who have one, and is not understood by them.
async fn listen_with_parity(task: &Task, ways: &impl Ways, seen: &mut Observations) -> Result<(), Failure> {
    if seen.listened.frames().count() < 2 || task.config.serial.format().parity() != Parity::None {
        return Ok(());
    }
    for format in [CharacterFormat::F8E1, CharacterFormat::F8O1] {
        let Ok(serial) = SerialSettings::new(task.config.serial.baud(), format) else { continue };
        let config = LineConfig { serial, ..task.config.clone() };
        seen.elsewhere.push((serial, listen(ways, &config, ELSEWHERE).await?));
    }
    Ok(())
}

/// The speeds and formats that drives can be set to, likeliest first.
fn usual_settings() -> Vec<SerialSettings> {
    use CharacterFormat as Format;
    let speeds = [19_200, 9_600, 38_400, 4_800, 115_200, 57_600, 2_400, 1_200];
    let of = |baud| {
        let formats = [Format::F8E1, Format::F8N1, Format::F8O1, Format::F8N2];
        formats.into_iter().filter_map(move |format| SerialSettings::new(baud, format).ok())
    };
    speeds.into_iter().flat_map(of).collect()
}
