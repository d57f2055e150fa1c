//! What is right of what a daemon tells while its host misbehaves: pure, and held against what it must not take for right.

use std::time::{Duration, Instant};

use drive_core::Status;
use drive_sim::Observation;
use drive_testing::truth::{TOLERANCE, contradiction};
use serde_json::Value;

use super::simulator::Look;

/// A stop is told by then, whatever the host did meanwhile: the longest that a fleet waits for standstill, and some faults of the host.
pub(super) const LONGEST: Duration = Duration::from_secs(240);
/// An answer is on its way for no longer, on this line.
const ON_ITS_WAY: Duration = Duration::from_millis(500);
/// One may be that much older where others did not come: where frames have no numbers no master can tell an answer to the question before from
/// that to an equal one.
const BEHIND_A_MISS: Duration = Duration::from_secs(5);
/// What two readings of an output may be apart that tell the same, in hundredths of a hertz.
const APART: i32 = 100;
/// No machine of the site changes its output faster, and turns back, in hundredths of a hertz in a second.
const SLOPE: f64 = 2_000.0;
/// From this output on a motor is moved, in hundredths of a hertz.
const MOVES: i32 = 100;
/// The age up to which a status is told as good: what the configuration leaves as it is.
const MAX_AGE: Duration = Duration::from_secs(3);

/// What was told of a drive over HTTP, at some moment between asking and being told.
#[derive(Debug, Clone)]
pub(super) struct Said {
    pub(super) asked: Instant,
    pub(super) told: Instant,
    pub(super) status: Status,
    pub(super) is_good: bool,
    pub(super) age: Duration,
    /// Whether a run command of the daemon's stands, or a start or a stop of it is under way.
    pub(super) is_owned: bool,
    /// How many answers had not come by then.
    pub(super) misses: u64,
}

impl Said {
    /// As the API tells a drive; `None`: it has no status, or what is told has not its form.
    pub(super) fn read(asked: Instant, told: Instant, drive: &Value) -> Option<Self> {
        let status = &drive["status"];
        Some(Self {
            asked,
            told,
            status: serde_json::from_value(status.clone()).ok()?,
            is_good: status["quality"] == "good",
            age: Duration::from_millis(status["age_ms"].as_u64()?),
            is_owned: drive["started_here"].as_bool()? || drive["stop"].is_object(),
            misses: drive["counters"]["failures"].as_u64()?,
        })
    }

    /// The earliest moment of which it speaks; `missed`: answers did not come since the one before it.
    fn from(&self, missed: bool) -> Option<Instant> {
        let back = if missed { BEHIND_A_MISS } else { ON_ITS_WAY };
        self.asked.checked_sub(self.age + back)
    }
}

/// The looks at a machine around all of which a status may speak. `None`: it is not known yet, or was not looked at before.
pub(super) fn around<'a>(said: &Said, missed: bool, looks: &'a [Look]) -> Option<&'a [Look]> {
    let from = said.from(missed)?;
    let first = looks.iter().rposition(|look| look.told <= from)?;
    let last = looks.iter().position(|look| look.asked >= said.told)?;
    looks.get(first..=last)
}

/// A status that is told as good is young enough, and says what the machine did at some moment of which it may speak.
pub(super) fn status(said: &Said, around: &[Look]) -> Result<(), String> {
    if !said.is_good {
        return Ok(());
    }
    // It was judged at some moment since it was asked for, and its age told behind that.
    if said.age > MAX_AGE + said.told.saturating_duration_since(said.asked) {
        return Err(format!("a status of {:?} ago is told as good", said.age));
    }
    if let Some(hertz) = said.status.output_frequency {
        output(hertz.centihertz().cast_signed(), around)
            .map_err(|why| format!("{why}: told of {:?} ago", said.age))?;
    }
    // Of one that does not change meanwhile, or of a shaft that only slows down, more is known than its output: not of one whose
    // simulator was killed. It may have run between the last look and that.
    let Some(first) = around.first() else { return Ok(()) };
    let is_as_before = |look: &Look| {
        look.life == first.life
            && look.seen.running == first.seen.running
            && (!first.seen.running || look.seen.shaft_frequency.abs_diff(first.seen.shaft_frequency) <= 20)
    };
    let is_steady = around.iter().all(is_as_before);
    let mut against = around.iter().map(|look| contradiction(&said.status, &look.seen));
    match against.by_ref().collect::<Option<Vec<_>>>() {
        Some(why) if is_steady && !why.is_empty() => {
            Err(format!("{}: told of {:?} ago", why.join("; "), said.age))
        }
        _ => Ok(()),
    }
}

/// The machine had this output, in hundredths of a hertz, at some moment.
fn output(told: i32, around: &[Look]) -> Result<(), String> {
    let outputs = || around.iter().map(|look| look.seen.output_frequency.abs());
    let (Some(least), Some(most)) = (outputs().min(), outputs().max()) else { return Ok(()) };
    // Between two looks it may have gone up and come back.
    let gaps = around.windows(2).map(|two| two[1].told.saturating_duration_since(two[0].asked));
    let between = (gaps.max().unwrap_or_default().as_secs_f64() * SLOPE / 2.0) as i32;
    let tolerance = APART.saturating_add(between);
    if (least.saturating_sub(tolerance)..=most.saturating_add(tolerance)).contains(&told.abs()) {
        return Ok(());
    }
    let hertz = |hundredths: i32| f64::from(hundredths) / 100.0;
    Err(format!(
        "an output of {} Hz is told; the machine had {} to {} Hz",
        hertz(told),
        hertz(least),
        hertz(most)
    ))
}

/// Nobody's motor is moved: what was seen of it before, between and behind two answers that both say that no command stands.
pub(super) fn is_owned(said: [&Said; 2], looks: [&Look; 3]) -> Result<(), String> {
    let moves = |look: &Look| look.seen.running && look.seen.output_frequency.abs() >= MOVES;
    let [before, .., behind] = looks.map(|look| look.seen.output_frequency.abs());
    let is_one = looks.iter().all(|look| look.life == looks[0].life);
    if is_one
        && said.iter().all(|said| !said.is_owned)
        && looks.iter().all(|look| moves(look))
        && behind >= before
    {
        let outputs = looks.map(|look| look.seen.output_frequency);
        let ages = said.map(|said| (said.age, said.is_good));
        let over = looks[2].told.saturating_duration_since(looks[0].asked);
        return Err(format!(
            "it runs, and no command of it stands: {outputs:?} in {over:?}, told {ages:?}, {:?}",
            looks[2].seen
        ));
    }
    Ok(())
}

/// A motor whose stop was confirmed is driven by nobody; its shaft stands, unless it was told to coast.
pub(super) fn stands(seen: &Observation, may_coast: bool) -> Result<(), String> {
    let turns = !may_coast && seen.shaft_frequency.abs() > TOLERANCE;
    if turns || seen.output_frequency.abs() > TOLERANCE {
        return Err(format!("a stop was confirmed, and it turns: {seen:?}"));
    }
    Ok(())
}

/// What is answered to a stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Stopped {
    /// The drive shows it; whether the shaft is told to stand, or may coast.
    Confirmed { may_coast: bool },
    /// More is told under this name.
    Open(String),
}

/// A stop is confirmed, or more will be told of it.
pub(super) fn stop(http: u16, answer: &Value) -> Result<Stopped, String> {
    let is_open = answer["open"] == true;
    match (answer["outcome"].as_str(), answer["id"].as_str()) {
        (Some("confirmed"), _) => {
            let motion = &answer["status"]["motion"];
            Ok(Stopped::Confirmed { may_coast: !["at_rest", "held"].iter().any(|word| motion == word) })
        }
        (Some("pending" | "not_confirmed" | "unknown"), Some(id)) if is_open => {
            Ok(Stopped::Open(id.to_owned()))
        }
        _ => Err(format!("a stop is answered by {http}: {answer}")),
    }
}

/// A stop is told in its time.
pub(super) fn in_time(took: Duration) -> Result<(), String> {
    if took > LONGEST { Err(format!("a stop is told after {took:?}")) } else { Ok(()) }
}

/// Behind the end of the daemon all stands, and it says so.
pub(super) fn end(code: Option<Option<i32>>, machines: &[(&str, Observation)]) -> Result<(), String> {
    match code {
        Some(Some(0)) => {}
        None => return Err("it does not end".to_owned()),
        Some(code) => return Err(format!("it ends with {code:?}")),
    }
    let moves = |seen: &Observation| seen.running || stands(seen, false).is_err();
    match machines.iter().find(|(_, seen)| moves(seen)) {
        Some((name, seen)) => Err(format!("{name} runs behind its end: {seen:?}")),
        None => Ok(()),
    }
}
