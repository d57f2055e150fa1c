//! Worlds generated: random sequences of operations, faults and events on one drive, judged at each step by what judges a cell of the
//! matrix, shrunk to what matters, and told as a line that replays them.

use std::{fmt, time::Instant};

use drive_core::{Direction, StopMode};
use fastrand::Rng;

use super::{Event, FarEnd, Fault, Lived, Operation, Subject, Untold, Way, axes::settings, tell};
use crate::report::{Find, Told};

/// What happens next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The drive is asked this.
    Ask(Operation),
    /// The drive is asked this, and nobody waits for it any more so many times 5 ms later: its call is dropped.
    Drops(Operation, u8),
    /// This strikes at so many exchanges from here.
    Strike(Fault, usize),
    /// This happens to the drive.
    Happens(Event),
    /// Somebody sets this one of its settings at the keypad of a drive that stands: one that runs takes it not.
    Sets(u8),
    /// The drive is asked for its status for so many seconds.
    Live(u8),
}

/// A drive, the way to it, and what happens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Story {
    /// Whose drive.
    pub subject: Subject,
    /// How it is reached.
    pub way: Way,
    /// What stands between.
    pub far_end: FarEnd,
    /// What happens.
    pub steps: Vec<Step>,
}

fn place<T: PartialEq>(all: &[T], one: &T) -> usize {
    all.iter().position(|known| known == one).unwrap_or(usize::MAX)
}

impl Story {
    /// The story of a seed; `None`: its drive is not on its way.
    #[must_use]
    pub fn of(seed: u64) -> Option<Self> {
        let mut rng = Rng::with_seed(seed);
        let subject = Subject::of(rng.usize(..Subject::COUNT));
        let way = Way::ALL[rng.usize(..Way::ALL.len())];
        let far_end = if rng.bool() { FarEnd::Plain } else { FarEnd::ALL[rng.usize(..FarEnd::ALL.len())] };
        if subject.impossible_on(way).is_some() || far_end.impossible_on(way).is_some() {
            return None;
        }
        let steps = (0..rng.usize(3..16)).flat_map(|_| some_steps(&mut rng, subject, way)).collect();
        Some(Self { subject, way, far_end, steps })
    }

    /// The story of such a line as [`Display`](fmt::Display) prints.
    #[must_use]
    pub fn read(line: &str) -> Option<Self> {
        let mut words = line.split('.');
        let mut number = || words.next()?.parse::<usize>().ok();
        let (subject, way, far_end) = (number()?, number()?, number()?);
        let steps = words.map(|word| {
            let (kind, rest) = word.split_at_checked(1)?;
            let (first, second) = rest.split_once('x').unwrap_or((rest, "0"));
            let (first, second) = (first.parse::<usize>().ok()?, second.parse::<usize>().ok()?);
            Some(match kind {
                "o" => Step::Ask(*Operation::ALL.get(first)?),
                "d" => Step::Drops(*Operation::ALL.get(first)?, second as u8),
                "f" => Step::Strike(*Fault::ALL.get(first)?, second),
                "e" => Step::Happens(*Event::ALL.get(first)?),
                "s" => Step::Sets(first as u8),
                "l" => Step::Live(first as u8),
                _ => return None,
            })
        });
        let steps = steps.collect::<Option<Vec<_>>>()?;
        let is_subject = subject < Subject::COUNT;
        is_subject.then_some(())?;
        Some(Self {
            subject: Subject::of(subject),
            way: *Way::ALL.get(way)?,
            far_end: *FarEnd::ALL.get(far_end)?,
            steps,
        })
    }

    /// Whether nobody but this side commands the drive or sets anything in it.
    #[must_use]
    pub fn is_alone(&self) -> bool {
        let others = |step: &Step| {
            matches!(
                step,
                Step::Happens(_) | Step::Sets(_) | Step::Ask(Operation::Release | Operation::WriteParameter)
            )
        };
        self.far_end != FarEnd::Twins && !self.steps.iter().any(others)
    }

    /// What in it nobody can tell from what is right.
    pub fn untold(&self) -> impl Iterator<Item = Untold> {
        let fast = self.far_end == FarEnd::Fast;
        let is_deaf = self.steps.iter().any(|step| matches!(step, Step::Happens(event) if event.deafens()));
        let of_faults = self.steps.iter().filter_map(move |step| match step {
            Step::Strike(fault, _) => fault.in_front_of(is_deaf).untold(self.way, fast),
            _ => None,
        });
        let struck = self.steps.iter().any(|step| matches!(step, Step::Strike(..)));
        of_faults.chain(self.far_end.untold(self.way, struck))
    }

    /// The same without this step.
    fn without(&self, step: usize) -> Self {
        let mut less = self.clone();
        less.steps.remove(step);
        less
    }

    /// A shorter story that is wrong as well, as short as leaving one step out after the other makes it.
    #[must_use]
    pub fn shrunk(&self, is_wrong: impl Fn(&Self) -> bool) -> Self {
        let mut story = self.clone();
        let plain = Self { far_end: FarEnd::Plain, ..story.clone() };
        if is_wrong(&plain) {
            story = plain;
        }
        let mut at = story.steps.len();
        while at > 0 {
            at -= 1;
            let less = story.without(at);
            if is_wrong(&less) {
                story = less;
                at = at.min(story.steps.len());
            }
        }
        story
    }
}

impl fmt::Display for Story {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let subject =
            (0..Subject::COUNT).position(|number| Subject::of(number) == self.subject).unwrap_or_default();
        write!(f, "{subject}.{}.{}", place(&Way::ALL, &self.way), place(&FarEnd::ALL, &self.far_end))?;
        for step in &self.steps {
            match step {
                Step::Ask(operation) => write!(f, ".o{}", place(&Operation::ALL, operation))?,
                Step::Drops(operation, cut) => write!(f, ".d{}x{cut}", place(&Operation::ALL, operation))?,
                Step::Strike(fault, behind) => write!(f, ".f{}x{behind}", place(Fault::ALL, fault))?,
                Step::Happens(event) => write!(f, ".e{}", place(&Event::ALL, event))?,
                Step::Sets(setting) => write!(f, ".s{setting}")?,
                Step::Live(seconds) => write!(f, ".l{seconds}")?,
            }
        }
        Ok(())
    }
}

impl Story {
    /// The story in words.
    #[must_use]
    pub fn in_words(&self) -> String {
        let mut words = vec![format!("{}, {}, {}", self.subject, self.way, self.far_end)];
        words.extend(self.steps.iter().map(|step| match step {
            Step::Ask(operation) => operation.to_string(),
            Step::Drops(operation, cut) => format!("{operation}, dropped after {} ms", u32::from(*cut) * 5),
            Step::Strike(fault, behind) => format!("{fault}, {behind} exchanges from here"),
            Step::Happens(event) => event.to_string(),
            Step::Sets(setting) => {
                format!(
                    "set at the keypad: {}",
                    settings(self.subject).get(usize::from(*setting)).unwrap_or(&"nothing")
                )
            }
            Step::Live(seconds) => format!("{seconds} s"),
        }));
        words.join("; ")
    }
}

/// What comes next: one step, or what a technician does, who stops the motor, sets something at the keypad, starts it and stops it again.
fn some_steps(rng: &mut Rng, subject: Subject, way: Way) -> Vec<Step> {
    let settings = settings(subject);
    if settings.is_empty() || rng.u8(..24) > 0 {
        return vec![a_step(rng, subject, way)];
    }
    let start = [Direction::Forward, Direction::Reverse][rng.usize(..2)];
    let stop = StopMode::ALL[rng.usize(..StopMode::ALL.len())];
    let asks = |operation: Operation| {
        operation.impossible_for(subject, false).is_none().then_some(Step::Ask(operation))
    };
    let all = [
        asks(Operation::Stop(StopMode::Ramp)),
        Some(Step::Live(8)),
        Some(Step::Sets(rng.u8(..settings.len() as u8))),
        asks(Operation::Start(start)),
        Some(Step::Live(rng.u8(1..9))),
        asks(Operation::Stop(stop)),
    ];
    all.into_iter().flatten().collect()
}

fn a_step(rng: &mut Rng, subject: Subject, way: Way) -> Step {
    for _ in 0..64 {
        match rng.u8(..11) {
            0..=4 => {
                // What moves or stops the motor is asked more often than what reads.
                let operation = match rng.u8(..3) {
                    0 => Operation::ALL[5 + rng.usize(..7)],
                    _ => Operation::ALL[rng.usize(..Operation::ALL.len())],
                };
                if operation.impossible_for(subject, false).is_none() {
                    return Step::Ask(operation);
                }
            }
            5 | 6 => {
                let fault = Fault::ALL[rng.usize(1..Fault::ALL.len())];
                if fault.impossible_on(way).is_none() {
                    return Step::Strike(fault, rng.usize(..6));
                }
            }
            7 => {
                let event = Event::ALL[rng.usize(1..Event::ALL.len())];
                if event.impossible_for(subject).is_none() {
                    return Step::Happens(event);
                }
            }
            8 => {
                let operation =
                    if rng.bool() { Operation::Setpoint } else { Operation::ALL[5 + rng.usize(..7)] };
                if operation.impossible_for(subject, false).is_none() {
                    return Step::Drops(operation, rng.u8(..40));
                }
            }
            _ => return Step::Live(rng.u8(1..9)),
        }
    }
    Step::Live(1)
}

/// Tells so many stories, and shrinks what is wrong.
pub fn run(seed: u64, stories: u64, mut go_on: impl FnMut() -> bool) -> Told {
    let begun = Instant::now();
    let mut told = Told::new("worlds generated", "stories");
    let mut number = seed.wrapping_mul(1_000_000_007);
    while told.count < stories && go_on() {
        number = number.wrapping_add(1);
        let Some(story) = Story::of(number) else { continue };
        told.count += 1;
        crate::report::begins(&story);
        told.count_as("steps", story.steps.len() as u64);
        match tell(&story, &*crate::matrix::drive_of(story.subject.family())) {
            Lived::Against(why) => told.finds.push(found(&story, &why)),
            Lived::BeyondTelling(_) => told.count_as("stories wrong where nobody can tell", 1),
            _ => {}
        }
    }
    crate::report::ends();
    told.took = begun.elapsed();
    told
}

fn found(story: &Story, why: &[String]) -> Find {
    let is_wrong = |story: &Story| {
        matches!(tell(story, &*crate::matrix::drive_of(story.subject.family())), Lived::Against(_))
    };
    let shrunk = story.shrunk(is_wrong);
    let why = match tell(&shrunk, &*crate::matrix::drive_of(shrunk.subject.family())) {
        Lived::Against(why) => why,
        _ => why.to_vec(),
    };
    let what = format!(
        "{} (shrunk from {} steps)\n    {}",
        shrunk.in_words(),
        story.steps.len(),
        why.join("\n    ")
    );
    Find { what, replay: format!("drive-fire worlds --story {shrunk}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_story_is_that_story() {
        for story in (0..200).filter_map(Story::of) {
            assert_eq!(Story::read(&story.to_string()), Some(story));
        }
        for wrong in ["", "0.0", "0.9.0", "0.0.0.z1", "99.0.0.o1", "0.0.0.o99", "0.0.0.é"] {
            assert_eq!(Story::read(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn what_does_not_matter_is_left_out() {
        let story = (0..)
            .find_map(|seed| Story::of(seed).filter(|story| story.steps.len() > 9))
            .expect("one is long");
        let last = *story.steps.last().expect("it has steps");
        let shrunk = story.shrunk(|story| story.steps.contains(&last));
        assert_eq!(shrunk.steps, [last]);
    }
}
