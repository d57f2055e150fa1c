//! Faults of a line, drawn from a seed: the same seed and the same traffic give the same faults.

use std::time::Duration;

use fastrand::Rng;

/// What can go wrong between a master and its slaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Fault {
    /// One bit of a request is inverted: no slave understands it.
    RequestFlipped,
    /// A request is not heard by any slave.
    RequestLost,
    /// One bit of an answer is inverted.
    Flipped,
    /// An answer is lost as a whole.
    Lost,
    /// An answer ends early.
    Truncated,
    /// The master hears what it sends, as from an adapter that leaves its receiver on.
    Echo,
    /// One to four characters of noise come directly before an answer.
    Noise,
    /// An answer comes later by [`Faults::set_lateness`].
    Late,
    /// An answer is sent twice.
    Duplicated,
    /// Before the right answer, the same answer comes in another slave's name.
    Foreign,
    /// The confirmation of a write, or of an echo request, names another register, quantity or value; its check is
    /// right.
    WrongEcho,
}

impl Fault {
    /// Every kind of fault.
    pub const ALL: [Self; 11] = [
        Self::RequestFlipped,
        Self::RequestLost,
        Self::Flipped,
        Self::Lost,
        Self::Truncated,
        Self::Echo,
        Self::Noise,
        Self::Late,
        Self::Duplicated,
        Self::Foreign,
        Self::WrongEcho,
    ];
}

/// A rate, in faults per million opportunities, so that rare noise can be said in integers.
pub type PerMillion = u32;

/// Every opportunity: the fault always strikes.
pub const ALWAYS: PerMillion = 1_000_000;

/// The faults of one line: seed, rates, and how often each has struck.
///
/// Each kind has a sequence of its own, so switching one on or off does not move the others.
///
/// ```
/// use drive_core::SerialSettings;
/// use drive_sim::{Fault, Faults, SimLine, Wiring};
///
/// let line = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
/// // One answer in a hundred is lost, and one in a thousand damaged; the same seed gives the same ones.
/// line.set_faults(Faults::seeded(7).with(Fault::Lost, 10_000).with(Fault::Flipped, 1_000));
/// assert_eq!(line.injected(Fault::Lost), 0, "nobody has asked for anything yet");
/// ```
#[derive(Debug, Clone)]
pub struct Faults {
    kinds: Vec<Kind>,
    lateness: Duration,
}

#[derive(Debug, Clone)]
struct Kind {
    fault: Fault,
    random: Rng,
    rate: PerMillion,
    injected: u64,
}

impl Faults {
    /// No faults yet, from a seed.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        let mut seeds = Rng::with_seed(seed);
        let kind = |fault| Kind { fault, random: seeds.fork(), rate: 0, injected: 0 };
        Self { kinds: Fault::ALL.into_iter().map(kind).collect(), lateness: Duration::from_millis(200) }
    }

    /// These faults with another rate of one kind.
    #[must_use]
    pub fn with(mut self, fault: Fault, rate: PerMillion) -> Self {
        self.set(fault, rate);
        self
    }

    /// Sets the rate of one kind; 0 switches it off.
    pub fn set(&mut self, fault: Fault, rate: PerMillion) {
        if let Some(kind) = self.kind(fault) {
            kind.rate = rate;
        }
    }

    /// Sets by how much a late answer is late; 200 ms from the start.
    pub const fn set_lateness(&mut self, lateness: Duration) {
        self.lateness = lateness;
    }

    /// How often a kind of fault has struck.
    #[must_use]
    pub fn injected(&self, fault: Fault) -> u64 {
        self.kinds.iter().find(|kind| kind.fault == fault).map_or(0, |kind| kind.injected)
    }

    pub(crate) const fn lateness(&self) -> Duration {
        self.lateness
    }

    /// The random numbers of a kind when it strikes now.
    pub(crate) fn strikes(&mut self, fault: Fault) -> Option<&mut Rng> {
        let kind = self.kind(fault).filter(|kind| kind.rate > 0)?;
        let strikes = kind.random.u32(0..ALWAYS) < kind.rate;
        kind.injected += u64::from(strikes);
        strikes.then_some(&mut kind.random)
    }

    fn kind(&mut self, fault: Fault) -> Option<&mut Kind> {
        self.kinds.iter_mut().find(|kind| kind.fault == fault)
    }
}

impl Default for Faults {
    fn default() -> Self {
        Self::seeded(0)
    }
}

/// Inverts one of the bits that a character of the line has.
pub(crate) fn flip(bytes: &mut [u8], data_bits: u8, random: &mut Rng) {
    let bit = random.u8(0..data_bits.max(1));
    let at = random.usize(0..bytes.len().max(1));
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1_u8.wrapping_shl(u32::from(bit));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strikes(faults: &mut Faults) -> Vec<bool> {
        (0..1_000).map(|_| faults.strikes(Fault::Lost).is_some()).collect()
    }

    #[test]
    fn the_same_seed_gives_the_same_faults_whatever_else_is_switched_on() {
        let mut one = Faults::seeded(7).with(Fault::Lost, 100_000);
        let mut other = Faults::seeded(7).with(Fault::Lost, 100_000).with(Fault::Late, ALWAYS);
        assert!(other.strikes(Fault::Late).is_some());
        let first = strikes(&mut one);
        assert_eq!(first, strikes(&mut other));
        assert_ne!(first, strikes(&mut Faults::seeded(8).with(Fault::Lost, 100_000)));
    }

    #[test]
    fn a_rate_is_kept_and_counted() {
        let mut faults = Faults::seeded(1).with(Fault::Lost, 100_000);
        let struck = strikes(&mut faults).into_iter().filter(|struck| *struck).count();
        assert!((60..=140).contains(&struck), "{struck}");
        assert_eq!(faults.injected(Fault::Lost), u64::try_from(struck).unwrap());
        faults.set(Fault::Lost, 0);
        assert!(!strikes(&mut faults).contains(&true));
    }
}
