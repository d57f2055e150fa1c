//! The task that listens and asks, and notes what comes of it. It reads only.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use drive_bus::{
    Line, LineConfig, Protocol, SlaveSettings,
    config::Echo,
    listen::{Ear, Listener, Role},
    record,
    stats::Stats,
};
use drive_core::{
    Class, Drive, Error, PortError, SlaveAddress, State, Terms,
    serial::{CharacterFormat, Parity, SerialSettings},
    tokio_modbus::{Request, client::Client as _},
};
use drive_families::{Family, Options};
use drive_fleet::FEED_PART;
use tokio::time::{self, Instant};

use super::observations::{Adapter, Asked, Ending, Listened, Observations};
use crate::{drive_spec::DriveName, failure::Failure, one_drive};

/// How long the line is listened to before anything is asked: a panel or a PLC asks once a second or more often.
pub(super) const LISTENING: Duration = Duration::from_secs(3);

/// How long at each other speed and format, where somebody talks at one that is not ours.
pub(super) const ELSEWHERE: Duration = Duration::from_secs(1);

/// How long an answer is waited for from a slave that is there or should be: twice what masters usually wait.
pub(super) const PATIENCE: Duration = Duration::from_secs(1);

/// One that has answered so often, and always so soon, is waited for only so long from then on: what it misses would cost a second
/// each.
const STEADY: usize = 20;
const SOON: Duration = Duration::from_millis(150);
const IMPATIENCE: Duration = Duration::from_millis(400);

/// Rounds of questions at the least: three questions to each slave in a round.
const ROUNDS: usize = 10;

/// A slave that should be there and is silent is asked so often before it is left out of the rounds.
const TRIES: u32 = 3;

/// The longest pause that is left to chance: longer than any clock of an adapter that is looked for.
const DITHER: Duration = Duration::from_millis(48);

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

/// Listens, asks, and gives what was noticed.
pub(super) async fn observe(
    task: &Task,
    ways: &impl Ways,
    mut progress: impl FnMut(&str),
) -> Result<Observations, Failure> {
    let began = Instant::now();
    let mut seen = Observations {
        config: task.config.clone(),
        adapter: Adapter::default(),
        expected: task.expected.clone(),
        addresses: task.addresses.iter().map(|slave| slave.number()).collect(),
        listened: Listened::default(),
        elsewhere: Vec::new(),
        asked: Vec::new(),
        own_waits: Vec::new(),
        overdue: Vec::new(),
        never_quiet: false,
        took: Duration::ZERO,
    };
    if task.config.protocol.is_paced() {
        progress("listening");
        seen.listened = listen(ways, &task.config, LISTENING).await?;
        listen_elsewhere(task, ways, &mut seen, &mut progress).await?;
    }
    let mut asking = Asking::open(task, ways, began).await?;
    let result = asking.all(task, &mut progress).await;
    one_drive::close(&asking.line).await;
    result?;
    asking.into(&mut seen);
    let good = seen.asked.iter().filter(|asked| asked.is_good()).count();
    if task.config.protocol.is_paced() && good * 4 < seen.asked.len() {
        progress("others are understood, but nobody answers: listening with another parity");
        listen_with_parity(task, ways, &mut seen).await?;
    }
    seen.adapter = ways.adapter();
    seen.took = began.elapsed();
    Ok(seen)
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

/// The line while it is asked.
struct Asking {
    line: Line,
    began: Instant,
    asked: Vec<Asked>,
    own_waits: Vec<(u8, Duration)>,
    never_quiet: bool,
    /// When the last exchange began that was read back.
    last: Option<Instant>,
    ended: Option<Duration>,
    answered: BTreeMap<u8, Duration>,
    running: Option<BTreeSet<u8>>,
    foreign: u64,
    /// Questions after a short pause, which differ from each other.
    short: u16,
    chance: Chance,
}

/// One slave that is asked.
struct Asker {
    slave: u8,
    drive: Box<dyn Drive>,
    /// Whether its family is known.
    is_named: bool,
    /// A register that was asked for.
    register: u16,
    /// How often it wants a message, as far as that is known; `None`: whenever it comes.
    fed_every: Option<Duration>,
    asked_at: Instant,
    /// Its answers, as long as all of them were soon.
    soon: usize,
}

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
    async fn open(task: &Task, ways: &impl Ways, began: Instant) -> Result<Self, Failure> {
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
            foreign: 0,
            short: 0,
            chance: Chance(0x2545_F491_4F6C_DD1D),
        })
    }

    async fn all(&mut self, task: &Task, progress: &mut impl FnMut(&str)) -> Result<(), Failure> {
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
        let family = named.map_or(Family::Atv312, |name| name.family);
        let mut drive = family.open_with(self.line.slave(slave.number()), slave, &Options::default());
        one_drive::wait_at_most(&mut *drive);
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
                let runs = matches!(status.state, State::Running | State::Stopping | State::QuickStop)
                    || status.output_frequency.is_some_and(|frequency| frequency.centihertz() != 0);
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
        if is_first && asker.drive.capabilities().key == Family::Omron3g3ev.capabilities().key {
            let row = asker.drive.capabilities().rows.iter().find(|row| row.code == "n65");
            if let Some(row) = row
                && let Ok(wait) = asker.drive.read_parameter(row).await
            {
                self.own_waits.push((asker.slave, Duration::from_millis(u64::from(wait))));
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

    /// Frames that nobody has asked for, since the last time.
    fn strays(&mut self) -> u64 {
        let foreign = foreign(&self.line.stats());
        let strays = foreign - self.foreign;
        self.foreign = foreign;
        strays
    }

    /// Reads back what was on the line since the last time.
    fn note(&mut self, asker: &mut Asker, strays_before: u64, dithered: bool) {
        let (config, slave) = (self.line.config(), asker.slave);
        asker.asked_at = Instant::now();
        let mut first = true;
        for exchange in self.line.exchanges() {
            if self.last.is_some_and(|last| exchange.began <= last) || exchange.slave != slave {
                continue;
            }
            self.last = Some(exchange.began);
            let began = exchange.began.saturating_duration_since(self.began);
            let ended = began + exchange.took;
            let echoed = exchange.answer.starts_with(&exchange.request) && exchange.request.len() > 4;
            let heard =
                exchange.answer.get(if echoed { exchange.request.len() } else { 0 }..).unwrap_or_default();
            // The answer to a question that is its own echo, such as the loop-back of function 08.
            let (echoed, heard) = match (exchange.ending, heard) {
                (record::Ending::Answered | record::Ending::Exception, []) => (false, &exchange.answer[..]),
                _ => (echoed, heard),
            };
            let Some(ending) = ending(&config, exchange.ending, heard) else { continue };
            let asked = Asked {
                slave,
                began,
                ended,
                since_own: self.answered.get(&slave).map(|at| began.saturating_sub(*at)),
                quiet: self.ended.map(|at| began.saturating_sub(at)),
                request: exchange.request.to_vec(),
                heard: heard.to_vec(),
                echoed,
                ending,
                after: exchange
                    .took
                    .saturating_sub(characters(&config, exchange.request.len() + heard.len())),
                running: self.running.clone(),
                strays_before: if first { strays_before } else { 0 },
                dithered: dithered && first,
            };
            first = false;
            self.ended = Some(ended);
            if asked.is_good() {
                self.answered.insert(slave, ended);
                asker.soon = if asked.after <= SOON { asker.soon.saturating_add(1) } else { 0 };
                if asker.soon == STEADY {
                    let kept = config.slaves.get(&slave).copied().unwrap_or_default();
                    let sooner = SlaveSettings { response_timeout: Some(IMPATIENCE), ..kept };
                    self.line.configure_slave(slave, sooner);
                }
            }
            if let (Protocol::Rtu, [_, 3, high, low, ..]) = (config.protocol, &asked.request[..]) {
                asker.register = u16::from_be_bytes([*high, *low]);
            }
            self.asked.push(asked);
        }
        // What came meanwhile may be an answer to whom was asked before: only what comes while nobody is asked tells whose it is.
        self.strays();
    }

    fn into(self, seen: &mut Observations) {
        let stats = self.line.stats();
        let late = stats.slaves.iter().filter(|(_, stats)| stats.late > 0);
        seen.overdue = late.map(|(slave, stats)| (*slave, stats.late)).collect();
        seen.asked = self.asked;
        seen.own_waits = self.own_waits;
        seen.never_quiet = self.never_quiet;
    }
}

/// The line so that every question is asked once, and answers are waited for longer than masters do.
fn of_doctor(task: &Task) -> LineConfig {
    let config = LineConfig {
        echo: Echo::Auto,
        timeout_floor: PATIENCE,
        response_timeout: PATIENCE,
        offline_after: 0,
        retries: 0,
        double_window: Duration::ZERO,
        // An adapter may hold back the rest of an answer for as long as the slowest clock that is looked for.
        chunk_gap: DITHER,
        ..task.config.clone()
    };
    task.addresses.iter().fold(config, |config, slave| {
        let settings = settings_of(task, *slave);
        config.slave(slave.number(), settings)
    })
}

/// How a slave is asked: after the pause that its family's manual wants, or the longest of any where it is not known.
fn settings_of(task: &Task, slave: SlaveAddress) -> SlaveSettings {
    let named = task.expected.iter().find(|name| name.slave == slave);
    let pauses = Family::ALL.map(|family| family.capabilities().turnaround);
    match named {
        Some(name) => SlaveSettings {
            turnaround: name.family.capabilities().turnaround,
            response_timeout: Some(PATIENCE),
        },
        None => SlaveSettings {
            turnaround: pauses.into_iter().max().unwrap_or_default(),
            response_timeout: Some(task.wait),
        },
    }
}

/// How a question ended that brought this.
fn ending(config: &LineConfig, recorded: record::Ending, heard: &[u8]) -> Option<Ending> {
    use record::Ending as Recorded;
    let is_silent = recorded == Recorded::NoAnswer;
    Some(match recorded {
        Recorded::Answered | Recorded::Doubted => Ending::Answered,
        Recorded::Exception | Recorded::Busy => Ending::Refused,
        Recorded::NoAnswer | Recorded::Damaged | Recorded::Mismatch => match heard {
            [] => Ending::Silent,
            _ if !is_intact(config, heard) => Ending::Damaged,
            // Others have talked with each other.
            _ if is_silent => Ending::Silent,
            _ => Ending::Wrong,
        },
        _ => return None,
    })
}

/// Whether these are whole frames and nothing else.
fn is_intact(config: &LineConfig, heard: &[u8]) -> bool {
    let Some(mut ear) = Ear::new(config, Duration::ZERO) else { return true };
    ear.hear(Duration::ZERO, heard);
    let whole: Vec<_> = ear.by_ref().collect();
    ear.handle_timeout();
    whole.into_iter().chain(ear).all(|heard| heard.role != Role::Damaged)
}

fn foreign(stats: &Stats) -> u64 {
    stats.foreign + stats.slaves.values().map(|slave| slave.early).sum::<u64>()
}

fn characters(config: &LineConfig, count: usize) -> Duration {
    if config.protocol.is_paced() && !config.unpaced {
        config.serial.characters(count)
    } else {
        Duration::ZERO
    }
}

/// Numbers that follow no pattern that an adapter or a drive could have.
struct Chance(u64);

impl Chance {
    fn up_to(&mut self, longest: Duration) -> Duration {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        let micros = u64::try_from(longest.as_micros()).unwrap_or(u64::MAX).max(1);
        Duration::from_micros(self.0 % micros)
    }
}
