//! Asks each slave again and again, after short and long pauses, and keeps those fed that it has woken.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use drive_bus::{Line, SlaveSettings};
use drive_core::{
    Class, Drive, Error, PortError, Row, SlaveAddress, Terms,
    tokio_modbus::{Request, client::Client as _},
};
use drive_families::{Family, Options};
use drive_fleet::FEED_PART;
use tokio::time::{self, Instant};

use super::{
    DITHER, PATIENCE, TRIES, Task, Ways,
    chance::Chance,
    terms::{IMPATIENCE, of_doctor, settings_of},
};
use crate::doctor::observations::{Asked, Observations};
use drived_client::own_line;
use drived_words::failure::Failure;

/// Rounds of questions at the least: three questions to each slave in a round.
const ROUNDS: usize = 10;

/// What a slave that needs a pause has in any case, before chance adds to it.
const REST: Duration = Duration::from_millis(45);

/// How often a drive gets a message whose watchdog is not known: any that was armed counts from the first one.
const FED_EVERY: Duration = Duration::from_millis(500);

/// The status word of three families. What has none answers an exception.
const ANY_REGISTER: u16 = 3_201;

/// The most words of a question after a short pause: as many as every family answers, by words or by an exception.
const WORDS: u16 = 8;

/// How long a question may wait until the line is quiet enough for it.
const QUIET_WITHIN: Duration = Duration::from_secs(5);

/// The exchanges that are read back after each question.
const KEPT: usize = 32;

/// The line while it is asked.
pub(super) struct Asking {
    pub(super) line: Line,
    pub(super) began: Instant,
    pub(super) asked: Vec<Asked>,
    pub(super) own_waits: Vec<(u8, u16)>,
    pub(super) never_quiet: bool,
    /// When the last exchange began that was read back.
    pub(super) last: Option<Instant>,
    pub(super) ended: Option<Duration>,
    pub(super) answered: BTreeMap<u8, Duration>,
    pub(super) running: Option<BTreeSet<u8>>,
    pub(super) tripped: BTreeSet<u8>,
    pub(super) foreign: u64,
    /// Questions after a short pause, which differ from each other.
    pub(super) short: u16,
    pub(super) chance: Chance,
}

/// One slave that is asked.
pub(super) struct Asker {
    pub(super) slave: u8,
    pub(super) drive: Box<dyn Drive>,
    /// Whether its family is known.
    pub(super) is_named: bool,
    /// A register that was asked for.
    pub(super) register: u16,
    /// How often it wants a message, as far as that is known; `None`: whenever it comes.
    pub(super) fed_every: Option<Duration>,
    pub(super) asked_at: Instant,
    /// Its answers, as long as all of them were soon.
    pub(super) soon: usize,
}

/// So much later than it is waited for an acknowledgement of UNI-TELWAY may come.
const LATE: Duration = Duration::from_millis(400);

/// The pause before a question.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pause {
    /// As short as the line allows.
    None,
    /// Of a length left to chance, from the shortest on: for the answers that follow each other.
    Soon,
    /// Of a length left to chance.
    Chance,
    /// Longer than any slave needs, and something left to chance.
    Rest,
}

impl Asking {
    pub(super) async fn open(task: &Task, ways: &impl Ways, began: Instant) -> Result<Self, Failure> {
        let line = ways.open(of_doctor(task)).await?;
        line.keep_exchanges(KEPT);
        Ok(Self {
            line,
            began,
            asked: Vec::new(),
            own_waits: Vec::new(),
            never_quiet: false,
            last: None,
            ended: None,
            answered: BTreeMap::new(),
            running: None,
            tripped: BTreeSet::new(),
            foreign: 0,
            short: 0,
            chance: Chance::default(),
        })
    }

    pub(super) async fn all(&mut self, task: &Task, progress: &mut impl FnMut(&str)) -> Result<(), Failure> {
        let (mut there, mut silent) = (Vec::new(), Vec::new());
        let number = task.addresses.len();
        for (index, &slave) in task.addresses.iter().enumerate() {
            progress(&format!("looking for address {slave}, {} of {number}", index + 1));
            let mut asker = self.asker(task, slave);
            let tries = if asker.is_named { TRIES } else { 1 };
            for again in 0..tries {
                self.feed(&mut there).await?;
                self.ask(&mut asker, if again == 0 { Pause::Chance } else { Pause::Rest }).await?;
                if self.never_quiet {
                    return Ok(());
                }
                if self.is_anybody_at(asker.slave) {
                    break;
                }
                self.hear_out(&asker).await;
            }
            if self.is_anybody_at(asker.slave) {
                self.be_patient(task, slave);
                self.learn_watchdog(&mut asker).await?;
                there.push(asker);
            } else if asker.is_named {
                let settings =
                    SlaveSettings { response_timeout: Some(IMPATIENCE), ..settings_of(task, slave) };
                self.line.configure_slave(asker.slave, settings);
                silent.push(asker);
            }
        }
        self.rounds(task, there, silent, progress).await
    }

    /// From now on it is waited for longer than masters do.
    fn be_patient(&self, task: &Task, slave: SlaveAddress) {
        let patient = SlaveSettings { response_timeout: Some(PATIENCE), ..settings_of(task, slave) };
        self.line.configure_slave(slave.number(), patient);
    }

    /// Asks those that are there, again and again, after short and long pauses.
    async fn rounds(
        &mut self,
        task: &Task,
        mut there: Vec<Asker>,
        mut silent: Vec<Asker>,
        progress: &mut impl FnMut(&str),
    ) -> Result<(), Failure> {
        let began = Instant::now();
        let mut round = 0;
        let longest = task.time * 3;
        while !there.is_empty()
            && (began.elapsed() < task.time || round < ROUNDS && began.elapsed() < longest)
        {
            progress(&format!("asking {} that answer, {} questions so far", there.len(), self.asked.len()));
            for index in 0..there.len() {
                self.feed(&mut there).await?;
                if let Some(asker) = there.get_mut(index).filter(|asker| asker.is_named) {
                    self.look(asker, round == 0).await?;
                }
            }
            // One that should be there and was silent may come; each of them in its turn.
            if let Some(mut asker) = silent.pop() {
                self.ask(&mut asker, Pause::Rest).await?;
                self.hear_out(&asker).await;
                if let (true, Ok(slave)) =
                    (self.is_anybody_at(asker.slave), SlaveAddress::try_from(asker.slave))
                {
                    self.be_patient(task, slave);
                    there.push(asker);
                } else {
                    silent.insert(0, asker);
                }
            }
            for index in 0..there.len() {
                self.feed(&mut there).await?;
                let soon = if round % 2 == 0 { Pause::None } else { Pause::Soon };
                for pause in [Pause::Chance, soon, Pause::Rest] {
                    if let Some(asker) = there.get_mut(index) {
                        self.ask(asker, pause).await?;
                    }
                }
                if self.never_quiet {
                    return Ok(());
                }
            }
            round += 1;
        }
        Ok(())
    }

    fn asker(&self, task: &Task, slave: SlaveAddress) -> Asker {
        let named = task.expected.iter().find(|name| name.slave == slave);
        // An exception is an answer too, so that any family's shortest question does.
        let family = named.map_or(Family::ATV312, |name| name.family);
        let mut drive = family.open_with(self.line.slave(slave.number()), slave, &Options::default());
        own_line::wait_at_most(&mut *drive);
        let is_named = named.is_some();
        let fed_every = (!is_named).then_some(FED_EVERY);
        Asker {
            slave: slave.number(),
            drive,
            is_named,
            register: ANY_REGISTER,
            fed_every,
            asked_at: Instant::now(),
            soon: 0,
        }
    }

    /// Whether anything has come from an address, whole or not.
    fn is_anybody_at(&self, slave: u8) -> bool {
        let stats = self.line.stats();
        let late = stats.slaves.get(&slave).is_some_and(|stats| stats.late > 0);
        late || self.asked.iter().any(|asked| asked.slave == slave && (asked.is_good() || asked.is_garbled()))
    }

    /// Asks nobody for as long as one that should be there and was silent may be late: on UNI-TELWAY what it says then is one
    /// character, which any other question would destroy.
    async fn hear_out(&self, asker: &Asker) {
        if asker.is_named
            && self.line.config().protocol.name() == "unitelway"
            && !self.is_anybody_at(asker.slave)
        {
            time::sleep(LATE).await;
        }
    }

    /// How often a drive wants a message that has just answered. One whose watchdog nobody can read gets what its family always
    /// wants.
    async fn learn_watchdog(&mut self, asker: &mut Asker) -> Result<(), Failure> {
        if asker.is_named {
            let capability = asker.drive.watchdog_capability();
            let fixed = capability.and_then(|watchdog| watchdog.fixed());
            let found = if capability.is_some() { asker.drive.watchdog().await.ok() } else { None };
            asker.fed_every = found.and_then(|found| found.timeout).or(fixed).map(|time| time / FEED_PART);
            self.note(asker, 0, false);
        }
        Ok(())
    }

    /// Sends a message to those that would miss one.
    async fn feed(&mut self, there: &mut [Asker]) -> Result<(), Failure> {
        for asker in there {
            // The longest that comes before it is thought of again: an answer that does not come.
            let is_due = |every: Duration| asker.asked_at.elapsed() + PATIENCE / 4 >= every;
            if asker.fed_every.is_some_and(is_due) {
                self.ask(asker, Pause::Chance).await?;
            }
        }
        Ok(())
    }

    /// Looks whether a drive's motor runs, and once how long a 3G3EV is set to wait.
    async fn look(&mut self, asker: &mut Asker, is_first: bool) -> Result<(), Failure> {
        let strays = self.strays();
        let status = asker.drive.status().await;
        self.note(asker, strays, false);
        match status {
            Ok(status) => {
                let is_tripped = status.is_fault();
                if is_tripped {
                    self.tripped.insert(asker.slave)
                } else {
                    self.tripped.remove(&asker.slave)
                };
                let runs = !status.is_undriven();
                let running = self.running.get_or_insert_default();
                if runs {
                    running.insert(asker.slave)
                } else {
                    running.remove(&asker.slave)
                };
            }
            Err(Error::Port { problem, .. }) => self.check(&problem)?,
            Err(_) => {}
        }
        if is_first && let Some(delay) = asker.drive.capabilities().answer_delay {
            if let Some(row) = Row::find(asker.drive.capabilities().rows, delay.code)
                && let Ok(wait) = asker.drive.read_parameter(row).await
            {
                self.own_waits.push((asker.slave, wait));
            }
            self.note(asker, 0, false);
        }
        Ok(())
    }

    /// Asks one slave once.
    async fn ask(&mut self, asker: &mut Asker, pause: Pause) -> Result<(), Failure> {
        match pause {
            Pause::None => {}
            Pause::Chance | Pause::Soon => time::sleep(self.chance.up_to(DITHER)).await,
            Pause::Rest => time::sleep(REST + self.chance.up_to(DITHER)).await,
        }
        let strays = self.strays();
        let answer = match pause {
            Pause::None | Pause::Soon => self.ask_at_once(asker).await,
            Pause::Chance | Pause::Rest => asker.drive.keep_alive().await.map_err(|error| match error {
                Error::Port { problem, .. } => Some(problem),
                _ => None,
            }),
        };
        self.note(asker, strays, pause != Pause::None);
        match answer {
            Err(Some(problem)) => self.check(&problem),
            _ => Ok(()),
        }
    }

    /// Asks as soon as the line lets it, for another number of words each time: for a number whose answer is owed it would wait.
    async fn ask_at_once(&mut self, asker: &Asker) -> Result<(), Option<PortError>> {
        self.short = self.short % WORDS + 1;
        let terms = Terms::of(Class::Status).within(QUIET_WITHIN);
        let mut slave = self.line.slave(asker.slave).with_terms(terms);
        let answer = slave.call(Request::ReadHoldingRegisters(asker.register, self.short)).await;
        answer.map(drop).map_err(|error| Some(PortError::from_modbus(error)))
    }

    /// What ends all asking: a port that is gone, a line that is never quiet.
    fn check(&mut self, problem: &PortError) -> Result<(), Failure> {
        match problem {
            PortError::Expired | PortError::NeverQuiet { .. } => self.never_quiet = true,
            PortError::LineDown(_) | PortError::Closed => return Err(Failure::Input(problem.to_string())),
            _ => {}
        }
        Ok(())
    }

    pub(super) fn into(self, seen: &mut Observations) {
        let stats = self.line.stats();
        let late = stats.slaves.iter().filter(|(_, stats)| stats.late > 0);
        seen.overdue = late.map(|(slave, stats)| (*slave, stats.late)).collect();
        seen.findings = self.line.findings();
        seen.asked = self.asked;
        seen.own_waits = self.own_waits;
        seen.tripped = self.tripped;
        seen.never_quiet = self.never_quiet;
    }
}
