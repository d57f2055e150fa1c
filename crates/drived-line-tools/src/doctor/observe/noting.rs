//! Reads back what was on the line, and says how each question ended.

use std::time::Duration;

use drive_bus::{
    LineConfig, Protocol, SlaveSettings,
    listen::{Ear, Role},
    record,
    stats::Stats,
};
use tokio::time::Instant;

use super::{
    asking::{Asker, Asking},
    terms::IMPATIENCE,
};
use crate::doctor::observations::{Asked, Ending};

/// One that has answered so often, and always so soon, is waited for only so long from then on: what it misses would cost a second
/// each.
const STEADY: usize = 20;
const SOON: Duration = Duration::from_millis(150);

impl Asking {
    /// Frames that nobody has asked for, since the last time.
    pub(super) fn strays(&mut self) -> u64 {
        let foreign = foreign(&self.line.stats());
        let strays = foreign - self.foreign;
        self.foreign = foreign;
        strays
    }

    /// Reads back what was on the line since the last time.
    pub(super) fn note(&mut self, asker: &mut Asker, strays_before: u64, dithered: bool) {
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
                    .saturating_sub(characters(&config, exchange.request.len() + heard.len()))
                    .saturating_sub(exchange.pause),
                pause: exchange.pause,
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
