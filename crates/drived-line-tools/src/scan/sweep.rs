//! The task that asks: each step of a plan in its order, and whom it has found again and again, each at his own settings.

use std::{pin::pin, time::Duration};

use drive_bus::{
    Line, LineConfig, SlaveSettings,
    evidence::{Defect, Finding},
};
use drive_families::Family;
use tokio::time::{Instant, sleep_until};

use super::{
    answer::{Answer, Likeness},
    feeding::{Feeding, interval},
    look::{self, Heard, Looks},
    plan::{Found, Plan, Step},
};
use drived_client::own_line;
use drived_words::{drive_spec::DriveName, failure::Failure, line_spec};

/// How long one look at a slave takes at the slowest settings: some watchdogs are not much longer.
const LOOK: Duration = Duration::from_millis(600);

/// The function by which a drive tells its name (Modbus Application Protocol V1.1b3, section 6.21).
const IDENTIFICATION: u8 = 0x2B;

/// How much longer one is waited for whose answer came too late.
const SLOWER: u32 = 10;

/// Why a scan has ended before its end.
const ANOTHER: &str = "somebody else has begun to ask on this line, and the scan has ended: end his asking first, then scan again";

/// So many are, of whom nothing is known but that the next was disturbed: where there is noise that is said of anybody.
const DISTURBING: usize = 8;

/// The scan of a line.
pub(super) struct Sweep<'a, Open> {
    plan: &'a Plan,
    base: LineConfig,
    wait: Duration,
    open: Open,
    /// The line as it is open now, and at which of the trials.
    at: Option<(usize, Line)>,
    feeding: Feeding,
    /// The drives of a known family, and whether each had tripped when it was found.
    seen: Vec<(Step, Family, bool)>,
    /// The last one that was silent, and those that were when the next was disturbed: by their late answers, may be.
    silent: Option<Step>,
    disturbing: Vec<Step>,
    /// Another master was heard before anything was asked.
    pub(super) is_shared: bool,
    /// It ends where another master begins to ask meanwhile.
    pub(super) ends_at_another: bool,
    began: Instant,
}

/// A drive that has tripped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tripped {
    pub step: Step,
    /// It had when it was found.
    pub before: bool,
}

/// Somebody who was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Find {
    pub step: Step,
    pub answer: Answer,
    /// What it has taken, for the time that the plan takes.
    pub found: Found,
}

impl<'a, Open: AsyncFn(LineConfig) -> Result<Line, Failure>> Sweep<'a, Open> {
    pub(super) fn new(plan: &'a Plan, line: LineConfig, wait: Duration, open: Open) -> Self {
        Self {
            plan,
            base: patient(line),
            wait,
            open,
            at: None,
            feeding: Feeding::default(),
            seen: Vec::new(),
            silent: None,
            disturbing: Vec::new(),
            is_shared: false,
            ends_at_another: false,
            began: Instant::now(),
        }
    }

    /// Asks at every step that is wanted, by it and the trial at which somebody was found first, and tells who answers.
    pub(super) async fn run(
        &mut self,
        mut is_wanted: impl FnMut(Step, Option<usize>) -> bool,
        mut tell: impl FnMut(Told) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut found: Option<usize> = None;
        for (done, &step) in self.plan.steps.iter().enumerate() {
            if !is_wanted(step, found) {
                continue;
            }
            tell(Told::At { done, step })?;
            if let Some(find) = self.ask(step).await? {
                found = found.or(Some(step.trial));
                tell(Told::Found(find))?;
            }
            self.leaves_to_another()?;
        }
        self.ask_slow(tell).await
    }

    /// Whoever began to ask behind the beginning has the line, where nobody is there to end his asking.
    fn leaves_to_another(&self) -> Result<(), Failure> {
        let Some((_, line)) = self.at.as_ref().filter(|_| self.ends_at_another) else { return Ok(()) };
        let is_heard =
            line.findings().into_iter().any(|finding| matches!(finding.defect, Defect::SecondMaster(_)));
        match is_heard {
            true => Err(Failure::Input(ANOTHER.to_owned())),
            false => Ok(()),
        }
    }

    /// Asks those once more, and waits longer, whose answer came when another was asked.
    async fn ask_slow(&mut self, mut tell: impl FnMut(Told) -> Result<(), Failure>) -> Result<(), Failure> {
        let Some((trial, line)) = self.at.clone() else { return Ok(()) };
        let is_late = |step: &Step| {
            let stats = line.stats();
            stats.slaves.get(&step.slave.number()).is_some_and(|stats| stats.late > 0)
                || self.disturbing.contains(step)
        };
        let steps: Vec<Step> = self
            .plan
            .steps
            .iter()
            .filter(|step| step.trial == trial && is_late(step) && !self.feeding.has(**step))
            .copied()
            .collect();
        for step in steps {
            let config = line.config();
            let kept = config.slaves.get(&step.slave.number()).copied().unwrap_or_default();
            line.configure_slave(
                step.slave.number(),
                SlaveSettings { response_timeout: Some(self.wait * SLOWER), ..kept },
            );
            if let Some(find) = self.ask(step).await? {
                tell(Told::Found(find))?;
            }
        }
        Ok(())
    }

    /// What is wrong with the line by what was heard, and what its far end was seen to be like.
    pub(super) fn findings(&self) -> Vec<String> {
        let Some((_, line)) = &self.at else { return Vec::new() };
        // That two answer is told of their address, and most addresses refuse what families are known by.
        let is_told = |finding: &Finding| {
            let is_odd = matches!(finding.defect, Defect::RefusesAll(_) | Defect::FellSilent(_));
            finding.slave.is_none() || !is_odd && !finding.is_of_two()
        };
        let told = line.findings().into_iter().filter(is_told).map(|finding| {
            let whose = finding.slave.map_or_else(String::new, |slave| format!("address {slave}: "));
            let next = finding.next().first().map_or_else(String::new, |next| format!(": {next}"));
            format!("{whose}{finding}{next}")
        });
        let proposal = line_spec::proposal(&line.config(), &line.stats());
        told.chain(proposal).collect()
    }

    /// Who has tripped by now: each drive of a known family that had not when it was found is looked at once more.
    pub(super) async fn tripped(&mut self) -> Result<Vec<Tripped>, Failure> {
        let mut tripped = Vec::new();
        for (step, family, before) in self.seen.clone() {
            let is_tripped = before || {
                let line = self.line_fed_for(step, LOOK).await?;
                let look = look::status(self.look_at(&line, step), family);
                self.fed_meanwhile(&line, step.trial, look).await == Looks::Like(true)
            };
            tripped.extend(is_tripped.then_some(Tripped { step, before }));
        }
        Ok(tripped)
    }

    /// Lets the port go.
    pub(super) async fn close(&mut self) {
        if let Some((_, line)) = self.at.take() {
            own_line::close(&line).await;
        }
    }

    async fn ask(&mut self, step: Step) -> Result<Option<Find>, Failure> {
        let line = self.fed_line(step).await?;
        let before = look::unasked(&line);
        let look = look::ask(self.look_at(&line, step), self.wait);
        let heard = self.fed_meanwhile(&line, step.trial, look).await?;
        let silent = std::mem::replace(&mut self.silent, Some(step).filter(|_| heard == Heard::Nothing));
        let silent = silent.filter(|silent| silent.trial == step.trial);
        self.note_disturbing(silent, &line, before);
        let (answer, interval) = match heard {
            Heard::Nothing => return Ok(None),
            Heard::Damaged(why) => self.judged(step, Vec::new(), Some(why)).await?,
            Heard::Somebody if look::found(self.look_at(&line, step)).is_some() => {
                self.judged(step, Vec::new(), None).await?
            }
            Heard::Somebody => self.recognise(step).await?,
        };
        if let Some(interval) = interval {
            self.feeding.add(step, answer.only(), interval, self.began.elapsed());
        }
        let line = self.line(step.trial).await?;
        // His answer may also have come while the next one was being recognised.
        self.note_disturbing(silent, &line, before);
        let asked = line.stats().slaves.get(&step.slave.number()).map_or(0, |slave| slave.sent);
        let exchanges = u32::try_from(asked).unwrap_or(u32::MAX);
        Ok(Some(Find { step, answer, found: Found { step, exchanges, interval } }))
    }

    /// Whoever was silent may have disturbed what has been asked since, by an answer that came too late.
    fn note_disturbing(&mut self, silent: Option<Step>, line: &Line, before: u64) {
        let is_disturbed = self.disturbing.len() < DISTURBING && look::unasked(line) > before;
        let silent = silent.filter(|silent| is_disturbed && !self.disturbing.contains(silent));
        self.disturbing.extend(silent);
    }

    /// Reads whoever answers as each family that can be set so, and says how often he is to be fed.
    async fn recognise(&mut self, step: Step) -> Result<(Answer, Option<Duration>), Failure> {
        let (mut alike, mut intervals, mut is_damaged) = (Vec::new(), Vec::new(), false);
        let mut trips = Vec::new();
        let mut longest = 0;
        // Those that tell their names come first: whoever has told his is asked for no other's words.
        let mut families = Family::all();
        families.retain(|family| family.tells_itself());
        families.sort_by_key(|family| !family.capabilities().functions.contains(&IDENTIFICATION));
        for family in families {
            if alike.iter().any(|likeness: &Likeness| likeness.certain) {
                break;
            }
            let line = self.line_fed_for(step, LOOK).await?;
            if look::found(self.look_at(&line, step)).is_some_and(|finding| finding.is_of_two()) {
                break;
            }
            let config = line.config();
            if line_spec::check(&config, &[DriveName { family, slave: step.slave }]).is_err() {
                continue;
            }
            let look = look::status(self.look_at(&line, step), family);
            let looks = self.fed_meanwhile(&line, step.trial, look).await;
            longest = longest.max(look::longest_read(&line, step.slave));
            match looks {
                Looks::Like(has_tripped) => trips.push((family, has_tripped)),
                Looks::Unlike => continue,
                Looks::Damaged => {
                    is_damaged = true;
                    continue;
                }
            }
            let line = self.line_fed_for(step, LOOK).await?;
            let look = look::identity(self.look_at(&line, step), family);
            match self.fed_meanwhile(&line, step.trial, look).await {
                Looks::Like((likeness, watchdog)) => {
                    intervals.push((family, interval(family, config.protocol.is_ascii(), watchdog)));
                    alike.push(likeness);
                }
                Looks::Unlike => continue,
                Looks::Damaged => is_damaged = true,
            }
            let line = self.line_fed_for(step, LOOK).await?;
            let look = look::measurements(self.look_at(&line, step), family);
            is_damaged |= self.fed_meanwhile(&line, step.trial, look).await == Looks::Damaged;
        }
        let named = alike.iter().any(|likeness| likeness.certain);
        alike.retain(|likeness| match named {
            true => likeness.certain,
            false => longest <= likeness.family.capabilities().read_words,
        });
        intervals.retain(|(family, _)| alike.iter().any(|likeness| likeness.family == *family));
        let interval = intervals.into_iter().filter_map(|(_, interval)| interval).min();
        // Another master damages some answers, and behind one a refusal is not believed at once: a look as one more family may come
        // to nothing by that. It takes nothing from what was read whole.
        let is_damaged = is_damaged && (!self.is_shared || alike.is_empty());
        let damaged = is_damaged.then(|| "again and again its answers are damaged".to_owned());
        let (answer, unknown) = self.judged(step, alike, damaged).await?;
        let of_it = trips.into_iter().find(|(family, _)| answer.only() == Some(*family));
        self.seen.extend(of_it.map(|(family, has_tripped)| (step, family, has_tripped)));
        Ok((answer, interval.or(unknown)))
    }

    /// What is there, by what the line has found, else by what it looks like; and how often it is fed where nobody knows that.
    async fn judged(
        &mut self,
        step: Step,
        alike: Vec<Likeness>,
        damaged: Option<String>,
    ) -> Result<(Answer, Option<Duration>), Failure> {
        let line = self.line(step.trial).await?;
        let often = Some(Duration::from_secs(1));
        Ok(match (look::found(self.look_at(&line, step)), damaged) {
            (Some(finding), _) if finding.is_of_two() => (Answer::Two { alike, finding }, often),
            (Some(finding), Some(_)) => (Answer::Damaged(finding.to_string()), None),
            (None, Some(why)) => (Answer::Damaged(why), None),
            (_, None) => {
                let often = often.filter(|_| alike.is_empty());
                (Answer::Slave(alike), often)
            }
        })
    }

    /// The address of a step, on the line at its settings.
    const fn look_at<'line>(&self, line: &'line Line, step: Step) -> look::At<'line> {
        look::At { line, slave: step.slave, is_shared: self.is_shared }
    }

    /// The line at a step's settings, after those were fed who could not wait.
    async fn fed_line(&mut self, step: Step) -> Result<Line, Failure> {
        let ahead = self.plan.trials.get(step.trial).map(|trial| trial.silent(self.wait)).unwrap_or_default();
        self.line_fed_for(step, ahead).await
    }

    /// The same before something that takes longer than to ask once.
    async fn line_fed_for(&mut self, step: Step, ahead: Duration) -> Result<Line, Failure> {
        for _ in 0..self.feeding.len() {
            let at = self.at.as_ref().map(|(trial, _)| *trial);
            let Some(fed) = self.feeding.next(self.began.elapsed(), ahead, at) else { break };
            let line = self.line(fed.step.trial).await?;
            look::feed(&line, fed.family, fed.step.slave).await;
            self.feeding.fed(fed.step, self.began.elapsed());
        }
        self.line(step.trial).await
    }

    /// Looks, and feeds those at the same settings between any two questions of it, however many it has.
    async fn fed_meanwhile<T>(&mut self, line: &Line, trial: usize, look: impl Future<Output = T>) -> T {
        let mut look = pin!(look);
        while let Some((fed, due)) = self.feeding.first_at(trial) {
            tokio::select! {
                biased;
                seen = &mut look => return seen,
                () = sleep_until(self.began + due) => {}
            }
            let mut feed = pin!(look::feed(line, fed.family, fed.step.slave));
            let seen = tokio::select! {
                biased;
                () = &mut feed => None,
                seen = &mut look => Some(seen),
            };
            if seen.is_some() {
                feed.await;
            }
            self.feeding.fed(fed.step, self.began.elapsed());
            if let Some(seen) = seen {
                return seen;
            }
        }
        look.await
    }

    /// The line at the settings of a trial.
    async fn line(&mut self, trial: usize) -> Result<Line, Failure> {
        if let Some((at, line)) = &self.at
            && *at == trial
        {
            return Ok(line.clone());
        }
        self.close().await;
        let settings = self.plan.trials.get(trial);
        let config =
            settings.map_or_else(|| self.base.clone(), |trial| trial.config(self.base.clone(), self.wait));
        let line = (self.open)(config).await?;
        self.at = Some((trial, line.clone()));
        Ok(line)
    }
}

/// How a scan goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Told {
    /// It asks there now, after so many steps.
    At {
        done: usize,
        step: Step,
    },
    Found(Find),
}

/// Each address is asked once, however many are silent.
/// Who answers is not known yet, so whoever has answered gets the longest pause that a family needs.
fn patient(line: LineConfig) -> LineConfig {
    let pauses = Family::all().into_iter().map(|family| family.capabilities().turnaround);
    let turnaround = pauses.max().unwrap_or_default();
    let patient = LineConfig { offline_after: 0, retries: 0, ..line };
    (1..=247).fold(patient, |config, address| {
        config.slave(address, SlaveSettings { turnaround, ..SlaveSettings::default() })
    })
}
