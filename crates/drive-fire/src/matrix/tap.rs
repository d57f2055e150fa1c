//! A hand on the cable: everything that a line sends and hears goes through here, one exchange at a time, and one of them is struck.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use fastrand::Rng;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex},
    time::{Instant, advance, sleep_until},
};

use super::{
    Way,
    fault::Fault,
    frames::{self, Cut},
};

/// Bytes that a cable holds.
const MEMORY: usize = 4_096;

/// A read that was answered by the machine itself, as it answered.
#[derive(Debug, Clone)]
pub(super) struct Answered {
    pub(super) asked: Instant,
    pub(super) slave: u8,
    pub(super) request: Vec<u8>,
    pub(super) answer: Vec<u8>,
}

#[derive(Debug)]
struct Plan {
    fault: Fault,
    /// After how many more exchanges it strikes.
    left: Option<usize>,
    struck: bool,
    mute_until: Option<Instant>,
    lost_until: Option<Instant>,
    rng: Rng,
    answered: Vec<Answered>,
    caches: bool,
    begun: Instant,
    traces: bool,
    traces_bytes: bool,
}

impl Plan {
    /// What UNI-TELWAY carries is no PDU: it is told as it passes, and so is everything where the variable is `bytes`.
    fn trace_bytes(&self, way: Way, whose: &str, bytes: &[u8]) {
        if self.traces && (way == Way::UniTelway || self.traces_bytes) {
            eprintln!("{:8.3} s {whose} {bytes:02X?}", self.begun.elapsed().as_secs_f64());
        }
    }

    /// With `DRIVE_FIRE_TRACE` set each exchange is told, for whoever looks at one cell.
    fn trace(&self, answered: &Answered) {
        if self.traces {
            let Answered { asked, request, answer, .. } = answered;
            eprintln!("{:8.3} s {request:02X?} {answer:02X?}", (*asked - self.begun).as_secs_f64());
        }
    }
}

/// The hand: clones share it.
#[derive(Debug, Clone)]
pub(super) struct Tap {
    way: Way,
    plan: Arc<Mutex<Plan>>,
}

impl Tap {
    pub(super) fn new(way: Way, seed: u64, caches: bool) -> Self {
        let plan = Plan {
            fault: Fault::None,
            left: None,
            struck: false,
            mute_until: None,
            lost_until: None,
            rng: Rng::with_seed(seed),
            answered: Vec::new(),
            caches,
            begun: Instant::now(),
            traces: std::env::var_os("DRIVE_FIRE_TRACE").is_some(),
            traces_bytes: std::env::var_os("DRIVE_FIRE_TRACE").is_some_and(|traces| traces == "bytes"),
        };
        Self { way, plan: Arc::new(Mutex::new(plan)) }
    }

    fn plan(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The exchange behind so many more is struck.
    pub(super) fn strike(&self, fault: Fault, behind: usize) {
        let mut plan = self.plan();
        plan.fault = fault;
        plan.left = (fault != Fault::None).then_some(behind);
    }

    /// Nothing is struck any more. Whether something was.
    pub(super) fn calm(&self) -> bool {
        let mut plan = self.plan();
        plan.left = None;
        plan.struck
    }

    /// The answers that the machine itself gave to this request of this slave since then.
    pub(super) fn answers_to(&self, slave: u8, request: &[u8], since: Instant) -> Vec<Answered> {
        let plan = self.plan();
        let is_it = |answered: &&Answered| {
            let same = answered.request.get(..3) == request.get(..3);
            same && answered.slave == slave && (plan.caches || answered.asked >= since)
        };
        plan.answered.iter().filter(is_it).cloned().collect()
    }

    /// The master's end of a cable to this machine. `None` while the port is lost.
    pub(super) fn before(&self, machine: DuplexStream) -> Option<DuplexStream> {
        if self.plan().lost_until.is_some_and(|until| until > Instant::now()) {
            return None;
        }
        let (master, far) = duplex(MEMORY);
        drop(tokio::spawn(
            Cable { tap: self.clone(), far, machine, due: Vec::new(), now: None, before: None }.carry(),
        ));
        Some(master)
    }
}

/// The request that is under way.
#[derive(Debug, Clone)]
struct UnderWay {
    at: Instant,
    cut: Option<Cut>,
    fault: Fault,
    /// It is over: what comes behind belongs to it, and is struck no more.
    answered: bool,
}

struct Cable {
    tap: Tap,
    far: DuplexStream,
    machine: DuplexStream,
    /// What will come to the master, and when.
    due: Vec<(Instant, Vec<u8>)>,
    now: Option<UnderWay>,
    /// The last answer.
    before: Option<Vec<u8>>,
}

impl Cable {
    async fn carry(mut self) {
        let (mut from_master, mut from_machine) = ([0; 600], [0; 600]);
        loop {
            let next = self.due.iter().map(|(at, _)| *at).min();
            tokio::select! {
                biased;
                read = self.far.read(&mut from_master) => match read {
                    Ok(len) if len > 0 => {
                        if !self.asks(&from_master[..len]).await { return }
                    }
                    _ => return,
                },
                read = self.machine.read(&mut from_machine) => match read {
                    Ok(len) if len > 0 => {
                        if !self.answers(&from_machine[..len]).await { return }
                    }
                    _ => return,
                },
                () = async { match next { Some(at) => sleep_until(at).await, None => std::future::pending().await } } => {}
            }
            let now = Instant::now();
            self.due.sort_by_key(|(at, _)| *at);
            while self.due.first().is_some_and(|(at, _)| *at <= now) {
                let (_, bytes) = self.due.remove(0);
                // On one connection what comes byte by byte comes to its end first.
                if let Some(last) =
                    self.still_coming().filter(|_| self.tap.way == Way::ModbusTcp && bytes.len() > 1)
                {
                    self.due.push((last + Duration::from_millis(1), bytes));
                    self.due.sort_by_key(|(at, _)| *at);
                    continue;
                }
                self.tap.plan().trace_bytes(self.tap.way, "heard late", &bytes);
                if self.far.write_all(&bytes).await.is_err() {
                    return;
                }
            }
        }
    }

    /// The master sends. False: the port is lost.
    async fn asks(&mut self, bytes: &[u8]) -> bool {
        let (way, now) = (self.tap.way, Instant::now());
        self.tap.plan().trace_bytes(way, "sent", bytes);
        // On UNI-TELWAY polls and acknowledgements are parts of one exchange.
        let begins = way != Way::UniTelway || bytes.starts_with(&[0x10, 0x02]);
        let cut = frames::cut(way, bytes);
        let (fault, mute, cached) = {
            let mut plan = self.tap.plan();
            let mut fault = Fault::None;
            if begins {
                match plan.left {
                    Some(0) => {
                        (fault, plan.left, plan.struck) = (plan.fault, None, true);
                    }
                    Some(left) => plan.left = Some(left - 1),
                    None => {}
                }
            }
            if let Fault::Mute(ms) = fault {
                plan.mute_until = Some(now + Duration::from_millis(ms.into()));
            }
            if fault == Fault::PortLost {
                plan.lost_until = Some(now + Duration::from_millis(500));
            }
            let cached =
                cut.as_ref().filter(|cut| plan.caches && cut.pdu.first() == Some(&3)).and_then(|cut| {
                    let young = |answered: &&Answered| answered.asked + Duration::from_secs(1) > now;
                    let same =
                        |answered: &&Answered| answered.slave == cut.slave && answered.request == cut.pdu;
                    plan.answered
                        .iter()
                        .rev()
                        .filter(young)
                        .find(same)
                        .map(|answered| answered.answer.clone())
                });
            (fault, plan.mute_until.is_some_and(|until| until > now), cached)
        };
        if begins {
            self.now = Some(UnderWay { at: now, cut: cut.clone(), fault, answered: false });
        }
        if let (Some(cached), Some(cut)) = (cached, &cut) {
            let frame = frames::join(way, &Cut { pdu: cached, ..cut.clone() });
            self.due.push((now + Duration::from_millis(2), frame));
            return true;
        }
        if mute {
            return true;
        }
        match fault {
            Fault::PortLost => return false,
            Fault::RequestLost => return true,
            Fault::RequestFlipped => {
                let mut bytes = bytes.to_vec();
                self.flip(&mut bytes, 1);
                return self.machine.write_all(&bytes).await.is_ok();
            }
            Fault::RequestTruncated => {
                return self.machine.write_all(&bytes[..bytes.len() / 2]).await.is_ok();
            }
            Fault::Refused(code) => {
                if let Some(cut) = cut {
                    let pdu = vec![cut.pdu[0] | 0x80, code];
                    self.due.push((now + Duration::from_millis(25), frames::join(way, &Cut { pdu, ..cut })));
                }
                return true;
            }
            // At 19200 bit/s a character takes half a millisecond; an echo is there when the request is off the line.
            Fault::Echo | Fault::EchoPart | Fault::EchoDamaged | Fault::EchoAlone => {
                let mut echo = bytes.to_vec();
                match fault {
                    Fault::EchoPart => echo.truncate(bytes.len() / 2),
                    Fault::EchoDamaged => self.flip(&mut echo, 1),
                    _ => {}
                }
                let takes = Duration::from_micros(1_200 * echo.len() as u64 / 2);
                self.due.push((now + takes, echo));
                if fault == Fault::EchoAlone {
                    return true;
                }
            }
            _ => {}
        }
        self.machine.write_all(bytes).await.is_ok()
    }

    /// The machine answers, perhaps more than once. False: the port is lost.
    async fn answers(&mut self, bytes: &[u8]) -> bool {
        for frame in frames::apart(self.tap.way, bytes) {
            if !self.answer(frame).await {
                return false;
            }
        }
        true
    }

    async fn answer(&mut self, bytes: &[u8]) -> bool {
        let (way, now) = (self.tap.way, Instant::now());
        self.tap.plan().trace_bytes(way, "said", bytes);
        let speaks = way != Way::UniTelway || bytes.starts_with(&[0x10, 0x02]);
        let own = frames::cut(way, bytes);
        let mut fault = Fault::None;
        if let Some(under_way) = &mut self.now {
            if let (Some(request), Some(answer)) = (&under_way.cut, &own)
                && (answer.slave, answer.number) == (request.slave, request.number)
            {
                let answered = Answered {
                    asked: under_way.at,
                    slave: answer.slave,
                    request: request.pdu.clone(),
                    answer: answer.pdu.clone(),
                };
                let mut plan = self.tap.plan();
                plan.trace(&answered);
                // Long runs need the last of them only.
                if plan.answered.len() >= 512 {
                    plan.answered.drain(..256);
                }
                plan.answered.push(answered);
            }
            if speaks && !under_way.answered {
                (fault, under_way.answered) = (under_way.fault, true);
            }
        }
        if self.tap.plan().mute_until.is_some_and(|until| until > now) {
            return true;
        }
        let later = |ms: u32| now + Duration::from_millis(ms.into());
        let before = if speaks { self.before.replace(bytes.to_vec()) } else { None };
        let mut answer = bytes.to_vec();
        let changed = |change: &dyn Fn(&mut Cut)| {
            own.clone().map(|mut cut| {
                change(&mut cut);
                frames::join(way, &cut)
            })
        };
        let writes = own.as_ref().is_some_and(|cut| matches!(cut.pdu.first(), Some(6 | 16)));
        match fault {
            Fault::Lost => return true,
            Fault::Late(ms) => {
                self.due.push((later(ms), answer));
                return true;
            }
            Fault::Truncated(0) => answer.truncate(bytes.len() / 2),
            Fault::Truncated(count) => answer.truncate(bytes.len().saturating_sub(count.into())),
            Fault::Flipped(bits) => self.flip(&mut answer, bits),
            Fault::NoiseBefore(count) => answer = [self.noise(count), answer].concat(),
            Fault::NoiseAfter(count) => answer = [answer, self.noise(count)].concat(),
            Fault::NoiseInside => {
                let stray = self.noise(1);
                answer.splice(bytes.len() / 2..bytes.len() / 2, stray);
            }
            Fault::ForeignBefore => {
                let foreign = changed(&|cut| cut.slave = cut.slave.wrapping_add(1)).unwrap_or_default();
                self.due.push((now, foreign));
                self.due.push((later(12), answer));
                return true;
            }
            Fault::ForeignInstead => {
                answer = changed(&|cut| cut.slave = cut.slave.wrapping_add(1)).unwrap_or_default();
            }
            Fault::Double(ms) => self.due.push((later(ms), answer.clone())),
            Fault::ReplayBefore => {
                self.due.push((now, before.unwrap_or_default()));
                self.due.push((later(15), answer));
                return true;
            }
            Fault::ReplayInstead => answer = before.unwrap_or_default(),
            Fault::Exception(code) => {
                answer = changed(&|cut| cut.pdu = vec![cut.pdu[0] | 0x80, code]).unwrap_or_default();
            }
            Fault::Dribble(ms) => {
                for (at, byte) in (0..).zip(&answer) {
                    self.due.push((later(ms * at), vec![*byte]));
                }
                return true;
            }
            Fault::WrongFunction => answer = changed(&|cut| cut.pdu[0] ^= 0x01).unwrap_or_default(),
            Fault::WrongCount(more) if !writes => {
                let count = |cut: &mut Cut| {
                    if more {
                        cut.pdu.extend([0, 0]);
                    } else {
                        cut.pdu.truncate(cut.pdu.len().saturating_sub(2));
                    }
                    if let Some(count) = cut.pdu.get(2..).map(|words| words.len() as u8) {
                        cut.pdu[1] = count;
                    }
                };
                answer = changed(&count).unwrap_or_default();
            }
            Fault::WrongValue if writes => {
                let value = |cut: &mut Cut| cut.pdu.last_mut().map_or((), |last| *last ^= 0x01);
                answer = changed(&value).unwrap_or_default();
            }
            Fault::WrongRegister if writes => answer = changed(&|cut| cut.pdu[2] ^= 0x01).unwrap_or_default(),
            Fault::Stall(ms) => {
                // It lies in the port when nobody is there to read it.
                let written = self.far.write_all(&answer).await.is_ok();
                advance(Duration::from_millis(ms.into())).await;
                return written;
            }
            _ => {}
        }
        // What is said behind something that is still coming comes behind it.
        if let Some(last) = self.still_coming() {
            self.due.push((last + Duration::from_millis(1), answer));
            return true;
        }
        answer.is_empty() || self.far.write_all(&answer).await.is_ok()
    }

    /// When the last byte of what comes byte by byte is there.
    fn still_coming(&self) -> Option<Instant> {
        self.due.iter().filter(|(_, bytes)| bytes.len() == 1).map(|(at, _)| *at).max()
    }

    fn flip(&self, bytes: &mut [u8], bits: u8) {
        let rng = &mut self.tap.plan().rng;
        let mut places = std::collections::BTreeSet::new();
        // An ASCII character has seven bits on the line.
        let width = if self.tap.way == Way::Ascii { 7 } else { 8 };
        while places.len() < usize::from(bits).min(bytes.len()) {
            places.insert((rng.usize(..bytes.len()), rng.u8(..width)));
        }
        for (at, bit) in places {
            bytes[at] ^= 1 << bit;
        }
    }

    fn noise(&self, count: u8) -> Vec<u8> {
        let rng = &mut self.tap.plan().rng;
        (0..count).map(|_| rng.u8(..)).collect()
    }
}
