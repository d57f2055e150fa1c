//! What becomes of a request: to whom it goes, whether it may, and what answers it.

mod writes;

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_core::{
    Class, NEGATIVE_REPLY, Port as _, PortError, Terms,
    tokio_modbus::{ExceptionCode, Response, client::Client as _},
};
use drive_fleet::{DriveHandle, LineBudget, Place};
use futures_util::{
    FutureExt as _,
    future::{BoxFuture, Shared, WeakShared},
};
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    time::{Instant, sleep_until, timeout_at},
};

pub(crate) use self::writes::{Stop, watched};
use super::{
    clients::{Clients, Connection, Course},
    counters::{Counters, Result as Counted},
    framing::Frame,
    kept::Kept,
    pdu::{self, Ask},
    share::Share,
    virtual_unit::{self, Outcomes},
};
use crate::config::{GatewayConfig, Units};
use drived_config::names::Names;
use drived_doors::audit::Audit;
use drived_plant::plant::Plant;

/// What the daemon keeps of a line for itself, besides what it has planned, in percent.
const RESERVE: u32 = 5;

/// So many reads beyond the share wait on a line at once: the next one is there when one ends, and the daemon's own readings of the same
/// class have their turns.
const BEYOND: usize = 2;

/// What a client wants.
pub(super) struct Asked {
    arrived: Instant,
    unit: u8,
    function: u8,
    ask: Result<Ask, ExceptionCode>,
    /// It goes ahead of everything.
    pub(super) stop: Option<Stop>,
    /// To whom a write goes, as it came: its unit may mean others by the time of its turn.
    written: Vec<DriveHandle>,
}

/// The PDU of an answer, or the exception instead.
pub(super) type Answer = Result<Vec<u8>, ExceptionCode>;

/// An exchange that several clients wait for.
type Exchange = BoxFuture<'static, Answer>;

/// Reads by the place of their drive.
type UnderWay = HashMap<(Place, Ask), WeakShared<Exchange>>;

/// The turns of the clients on one line.
struct Turns {
    /// Whoever waits for his turn stands in this row. Each client stands there once, so that all come round.
    row: tokio::sync::Mutex<()>,
    share: Mutex<Share>,
    /// Those that use what nobody else wants of the line.
    beyond: Arc<Semaphore>,
}

/// How an exchange goes to the line.
enum Turn {
    /// Within the share.
    Share,
    /// Beyond it: behind everything else, so that it uses only what is left.
    Beyond { _place: OwnedSemaphorePermit },
}

impl Turns {
    fn new() -> Self {
        let share = Mutex::new(Share::new(Instant::now()));
        Self { row: tokio::sync::Mutex::default(), share, beyond: Arc::new(Semaphore::new(BEYOND)) }
    }

    /// Waits for a turn of this length, within the share, or beyond it where that is allowed.
    async fn take(&self, takes: Duration, percent: u32, may_go_beyond: bool) -> Turn {
        let _first = self.row.lock().await;
        loop {
            let now = Instant::now();
            let (free_at, is_in_vain) = {
                let share = lock(&self.share);
                (share.free_at(now), share.is_owed_more_than(takes, percent, now))
            };
            if free_at <= now {
                self.charge(takes, percent);
                return Turn::Share;
            }
            let beyond = async {
                match may_go_beyond && !is_in_vain {
                    true => Arc::clone(&self.beyond).acquire_owned().await.ok(),
                    false => None,
                }
            };
            tokio::select! {
                () = sleep_until(free_at) => {}
                Some(_place) = beyond => return Turn::Beyond { _place },
            }
        }
    }

    fn charge(&self, used: Duration, percent: u32) {
        lock(&self.share).charge(Instant::now(), used, percent);
    }
}

/// What all clients of a gateway share.
pub(super) struct Desk {
    pub(super) config: GatewayConfig,
    pub(super) counters: Arc<Counters>,
    pub(super) plant: Plant,
    pub(super) audit: Audit,
    /// Which place each drive has in the virtual unit.
    pub(super) names: Names,
    pub(super) clients: Clients,
    pub(super) kept: Kept,
    /// What the virtual unit tells of the last commands.
    pub(super) outcomes: Outcomes,
    /// By the name of the line.
    turns: Mutex<BTreeMap<Arc<str>, Arc<Turns>>>,
    /// Reads that are not answered yet.
    under_way: Mutex<UnderWay>,
}

impl Desk {
    pub(super) fn new(
        course: &Course,
        config: GatewayConfig,
        plant: Plant,
        audit: Audit,
        names: Names,
    ) -> Arc<Self> {
        let clients = Clients::of(course.clone());
        let (counters, kept, outcomes, turns, under_way) = Default::default();
        Arc::new(Self { config, counters, plant, audit, names, clients, kept, outcomes, turns, under_way })
    }

    /// The PDU that answers a request; `None`: silence.
    pub(super) async fn answer(self: &Arc<Self>, by: &Connection, asked: Asked) -> Option<Vec<u8>> {
        let Asked { arrived, unit, function, ask, stop, written } = asked;
        let answer = match ask {
            Err(code) if self.config.virtual_unit == Some(unit) => Err(code),
            Err(code) => self.drive(unit).ok_or(ExceptionCode::GatewayPathUnavailable).and(Err(code)),
            Ok(ask @ Ask::Write { .. }) => self.write(by, arrived, unit, &ask, stop, written).await,
            Ok(ask) => self.look_up(arrived, unit, ask).await,
        };
        let (counted, pdu) = match answer {
            Ok(pdu) => (Counted::Answered, Some(pdu)),
            Err(ExceptionCode::GatewayTargetDevice) if self.config.silent => (Counted::Silence, None),
            Err(code) => (Counted::Exception(code.into()), Some(pdu::exception(function, code))),
        };
        self.counters.answer(function, counted, arrived.elapsed());
        pdu
    }

    /// What a frame asks, and whether it may not wait.
    pub(super) fn look_at(&self, arrived: Instant, frame: &Frame) -> Asked {
        let Frame { unit, ref pdu, .. } = *frame;
        let ask = Ask::of(pdu);
        let stop = ask.as_ref().ok().and_then(|ask| self.stop_in(unit, ask));
        let written = match &ask {
            Ok(Ask::Write { .. }) => self.written(unit),
            _ => Vec::new(),
        };
        Asked { arrived, unit, function: pdu.first().copied().unwrap_or_default(), ask, stop, written }
    }

    /// The PDU of a refusal that needs no look at the plant.
    pub(super) fn refuse(&self, function: u8, code: ExceptionCode) -> Vec<u8> {
        self.counters.answer(function, Counted::Exception(code.into()), Duration::ZERO);
        pdu::exception(function, code)
    }

    async fn look_up(self: &Arc<Self>, arrived: Instant, unit: u8, ask: Ask) -> Answer {
        if self.config.virtual_unit == Some(unit) {
            let Ask::Read { function, address, count } = ask else {
                return Err(ExceptionCode::IllegalFunction);
            };
            // Without numbers nobody's values are told, and not somebody else's.
            let slots = self.names.slots().ok_or(ExceptionCode::ServerDeviceFailure)?;
            let fleet = self.plant.fleet();
            let drive = |name: &str| fleet.drive(name);
            let words = virtual_unit::read(&slots, drive, &self.outcomes, address, count);
            let words = words.ok_or(ExceptionCode::IllegalDataAddress)?;
            return Ok(pdu::words(function, &words));
        }
        let drive = self.drive(unit).ok_or(ExceptionCode::GatewayPathUnavailable)?;
        let capabilities = drive.capabilities();
        if !capabilities.functions.contains(&ask.function()) {
            return Err(ExceptionCode::IllegalFunction);
        }
        let mut unmapped = ask.registers().filter(|address| {
            let is_it = |row: &drive_core::Row| {
                row.address == *address && !row.space.is_bit() && row.access.is_readable()
            };
            !capabilities.rows.iter().any(is_it)
        });
        if self.config.mapped_only && unmapped.next().is_some() {
            return Err(ExceptionCode::IllegalDataAddress);
        }
        if let Some(words) = self.kept.of(drive.place(), &ask, Instant::now(), self.config.max_age) {
            self.counters.keep();
            return Ok(pdu::words(ask.function(), &words));
        }
        self.read(&drive, ask, arrived).await
    }

    /// All drives behind its units.
    pub(super) fn drives(&self) -> Vec<DriveHandle> {
        let fleet = self.plant.fleet();
        match &self.config.units {
            Units::OfLine(line) => fleet.drives_on(line),
            Units::Table(units) => {
                let names: BTreeSet<&String> = units.values().collect();
                names.into_iter().filter_map(|name| fleet.drive(name)).collect()
            }
        }
    }

    /// The drive behind a unit.
    pub(super) fn drive(&self, unit: u8) -> Option<DriveHandle> {
        let fleet = self.plant.fleet();
        match &self.config.units {
            Units::Table(units) => fleet.drive(units.get(&unit)?),
            Units::OfLine(line) => {
                fleet.drives_on(line).into_iter().find(|drive| drive.slave().number() == unit)
            }
        }
    }

    /// Reads, or waits with those who have asked for the same and are not answered yet: nothing that they get is older than
    /// the request, because a line carries one exchange at a time.
    async fn read(self: &Arc<Self>, drive: &DriveHandle, ask: Ask, arrived: Instant) -> Answer {
        loop {
            let (exchange, is_own) = self.exchange_of(drive, &ask, arrived);
            let answer = exchange.await;
            // Another's patience ends before one's own.
            let again = !is_own && answer == Err(ExceptionCode::ServerDeviceBusy);
            if !again || Instant::now() >= arrived + self.config.patience {
                return answer;
            }
        }
    }

    /// The exchange for a read, and whether it is a new one.
    fn exchange_of(
        self: &Arc<Self>,
        drive: &DriveHandle,
        ask: &Ask,
        arrived: Instant,
    ) -> (Shared<Exchange>, bool) {
        let mut under_way = lock(&self.under_way);
        under_way.retain(|_, exchange| exchange.upgrade().is_some_and(|exchange| exchange.peek().is_none()));
        let key = (drive.place().clone(), ask.clone());
        if let Some(exchange) = under_way.get(&key).and_then(WeakShared::upgrade) {
            self.counters.join();
            return (exchange, false);
        }
        let (desk, drive, ask) = (Arc::clone(self), drive.clone(), ask.clone());
        let exchange = async move {
            let terms = Terms::of(desk.config.reads);
            desk.exchange(&drive, &ask, terms, arrived).await
        };
        let exchange = exchange.boxed().shared();
        if let Some(weak) = exchange.downgrade() {
            under_way.insert(key, weak);
        }
        (exchange, true)
    }

    /// One exchange with a drive's slave, within the share of its line and the client's patience.
    pub(super) async fn exchange(
        &self,
        drive: &DriveHandle,
        ask: &Ask,
        terms: Terms,
        arrived: Instant,
    ) -> Answer {
        let deadline = arrived + self.config.patience;
        let (name, line) = drive.line();
        let budget = LineBudget::of(&line.config());
        let lost = budget.lost_slot();
        let answered = budget.serial.map_or(budget.response, |serial| {
            let (request, answer) = ask.lengths();
            budget.protocol.exchange_time(serial, request, answer) + budget.response * budget.protocol.turns()
        });
        let percent = self.percent_of(name);
        let turns = self.turns_of(name);
        let is_read = matches!(ask, Ask::Read { .. });
        let turn = timeout_at(deadline, turns.take(answered, percent, is_read)).await;
        let turn = turn.map_err(|_| ExceptionCode::ServerDeviceBusy)?;
        let class = if matches!(turn, Turn::Beyond { .. }) { Class::Background } else { terms.class };
        let terms = Terms { class, ..terms };
        // What is sent at the last moment has the time of an answer, where the patience is long enough for that.
        let left = deadline.saturating_duration_since(Instant::now());
        let lifetime = left.saturating_sub(lost).max(left / 2);
        let mut slave = line.slave(drive.slave().number()).with_terms(terms.within(lifetime));
        let outcome = timeout_at(deadline, slave.call(ask.request())).await;
        let (code, was_lost) = match outcome {
            Ok(Ok(Ok(response))) => {
                if let Response::ReadHoldingRegisters(words) | Response::ReadInputRegisters(words) = &response
                {
                    let at = slave.asked_at().unwrap_or_else(Instant::now);
                    self.kept.keep(drive.place(), ask, words, at, self.config.max_age);
                }
                return Ok(pdu::answer(ask, response));
            }
            // Without a reason: what comes nearest in Modbus.
            Ok(Ok(Err(ExceptionCode::Custom(NEGATIVE_REPLY)))) => {
                return Err(ExceptionCode::IllegalDataValue);
            }
            Ok(Ok(Err(exception))) => return Err(exception),
            Ok(Err(error)) => code_of(&PortError::from_modbus(error)),
            Err(_) => (ExceptionCode::GatewayTargetDevice, true),
        };
        if was_lost {
            let charged = if matches!(turn, Turn::Share) { answered } else { Duration::ZERO };
            turns.charge(lost.saturating_sub(charged), percent);
        }
        Err(code)
    }

    /// How much of a line may be used: the share of the configuration, as far as the daemon's own plan leaves it.
    fn percent_of(&self, line: &str) -> u32 {
        let planned = self.plant.fleet().plan(line).map_or(0, |plan| plan.utilisation_ppm / 10_000);
        let left = 100_u32.saturating_sub(u32::try_from(planned).unwrap_or(100)).saturating_sub(RESERVE);
        u32::from(self.config.share).min(left).max(1)
    }

    fn turns_of(&self, line: &Arc<str>) -> Arc<Turns> {
        let mut turns = lock(&self.turns);
        Arc::clone(turns.entry(Arc::clone(line)).or_insert_with(|| Arc::new(Turns::new())))
    }
}

/// The exception for what the line says, and whether an exchange was in vain.
fn code_of(error: &PortError) -> (ExceptionCode, bool) {
    match error {
        PortError::Timeout { .. }
        | PortError::Damaged(_)
        | PortError::Mismatch(_)
        | PortError::OutcomeUnknown(_) => (ExceptionCode::GatewayTargetDevice, true),
        PortError::Offline { .. } => (ExceptionCode::GatewayTargetDevice, false),
        PortError::LineDown(_) | PortError::Closed => (ExceptionCode::GatewayPathUnavailable, false),
        PortError::NotCarried(_) => (ExceptionCode::IllegalFunction, false),
        PortError::Expired
        | PortError::Superseded
        | PortError::QueueFull(_)
        | PortError::Busy(_)
        | PortError::NeverQuiet { .. } => (ExceptionCode::ServerDeviceBusy, false),
        _ => (ExceptionCode::GatewayTargetDevice, false),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
