//! What is wrong with a line for as long as nobody mends it: its cable, its adapter, who else is on it. A
//! [`Fault`](crate::Fault) strikes single frames; a defect follows time, and who runs.

use std::{collections::VecDeque, time::Duration};

use fastrand::Rng;
use tokio::time::Instant;

use crate::fault::{ALWAYS, PerMillion};

/// How long bursts of noise that are over are remembered: no frame that may still be looked at is older.
const REMEMBERED: Duration = Duration::from_secs(2);

/// So many characters of an answer come before the pause of an adapter that makes one inside.
const FIRST_PIECE: usize = 3;

/// The defects of a line; none by default.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Defects {
    /// The adapter hands over what it has received only every so often, as FTDI's do with their latency timer (16 ms as
    /// delivered): its clock runs on by itself, whoever sends what.
    pub hands_over_every: Option<Duration>,
    /// The adapter makes a pause of so long inside each answer, behind its third character, as those do that fill packets of their own.
    pub pauses_inside: Option<Duration>,
    /// The cable of one slave is disturbed while the motor of another runs.
    pub interference: Option<Interference>,
    /// Bursts of noise on the cable.
    pub noise: Option<Noise>,
    /// Somebody else asks on this line.
    pub second_master: Option<SecondMaster>,
    /// The master's A and B are swapped: it hears everything upside down, and so do all others what it says.
    pub swapped: Option<Rest>,
}

/// Where a receiver whose wires are swapped sees the line while nobody drives it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Rest {
    /// Low, as a break is: the bias of the line is upside down too.
    Low,
    /// High: the line has no bias, and the receiver takes an open line for one at rest.
    High,
}

/// How a waveform reaches a listener.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Polarity {
    Right,
    Swapped(Rest),
}

/// One slave's cable is disturbed while another's motor runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interference {
    /// Whose frames are damaged: its requests where it stands, its answers on their way.
    pub victim: u8,
    /// Whose running motor does it.
    pub source: u8,
    /// How many of the frames are hit.
    pub rate: PerMillion,
}

/// Noise that comes in bursts, whoever sends or not. What is on the wire then is damaged in both directions; on an idle
/// wire the receivers hear characters that nobody has sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Noise {
    /// The share of the time in which there is noise.
    pub share: PerMillion,
    /// How long one burst is.
    pub burst: Duration,
    /// Of its random numbers.
    pub seed: u64,
}

/// A second master, which knows nothing of the first: it asks when its time has come, and both are damaged when both
/// send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SecondMaster {
    /// Whom it asks what, one after the other: a slave and the PDU of a request.
    pub requests: Vec<(u8, Vec<u8>)>,
    /// From the beginning of one request to that of the next.
    pub every: Duration,
    /// What the first does not hear of it.
    pub unheard: Option<Unheard>,
}

/// What one master does not hear of the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unheard {
    /// What it asks: the bus has four wires, and masters hear slaves alone.
    Requests,
    /// What it is answered: the cable is too bad for what a slave says to somebody else.
    Answers,
}

/// The defects of a line, and where they are in time.
#[derive(Debug, Default)]
pub(crate) struct Defective {
    pub(crate) defects: Defects,
    since: Option<Instant>,
    random: Rng,
    bursts: VecDeque<(Instant, Instant)>,
    /// Up to when the bursts are known.
    drawn: Option<Instant>,
    /// Requests that the second master has made.
    made: u32,
}

impl Defective {
    pub(crate) fn new(defects: Defects, now: Instant) -> Self {
        let seed = defects.noise.map_or(0, |noise| noise.seed);
        let (since, drawn) = (Some(now), Some(now));
        Self { defects, since, random: Rng::with_seed(seed), bursts: VecDeque::new(), drawn, made: 0 }
    }

    /// What the master does not hear of a second one.
    pub(crate) fn unheard(&self) -> Option<Unheard> {
        self.defects.second_master.as_ref()?.unheard
    }

    /// When what has come by `arrived` is handed over, where the adapter waits.
    pub(crate) fn handed_over(&self, arrived: Instant) -> Option<Instant> {
        let (every, since) = (self.defects.hands_over_every?, self.since?);
        let ticks = arrived.saturating_duration_since(since).as_nanos().div_ceil(every.as_nanos().max(1));
        Some(since + every.saturating_mul(u32::try_from(ticks).unwrap_or(u32::MAX)))
    }

    /// How many characters of an answer are handed over next, of which so many were, and how much later than they arrive, where the adapter
    /// makes a pause inside.
    pub(crate) fn next_piece(&self, delivered: usize, whole: usize) -> Option<(usize, Duration)> {
        let pause = self.defects.pauses_inside?;
        Some(if delivered < FIRST_PIECE.min(whole) {
            (FIRST_PIECE.min(whole), Duration::ZERO)
        } else {
            (whole, pause)
        })
    }

    /// How the master and all others hear each other.
    pub(crate) fn polarity(&self) -> Polarity {
        self.defects.swapped.map_or(Polarity::Right, Polarity::Swapped)
    }

    /// Whose motor disturbs this slave.
    pub(crate) fn interferes(&self, slave: u8) -> Option<u8> {
        self.defects.interference.filter(|hit| hit.victim == slave).map(|hit| hit.source)
    }

    /// Random numbers, when the interference hits a frame.
    pub(crate) fn strike(&mut self) -> Option<Rng> {
        let hit = self.defects.interference?;
        (self.random.u32(0..ALWAYS) < hit.rate).then(|| self.random.fork())
    }

    /// Damages the bits of a character that noise falls on.
    pub(crate) fn disturb(&mut self, byte: u8, begins: Instant, ends: Instant) -> u8 {
        self.draw(ends);
        let hit = self.bursts.iter().any(|(from, to)| *from < ends && begins < *to);
        if hit { byte ^ self.random.u8(1..) } else { byte }
    }

    /// The next burst that begins after this moment.
    pub(crate) fn next_burst(&mut self, after: Instant) -> Option<(Instant, Instant)> {
        let mut until = after;
        loop {
            if let Some(burst) = self.bursts.iter().find(|(begins, _)| *begins > after) {
                return Some(*burst);
            }
            until += self.usual_gap()?;
            self.draw(until);
        }
    }

    /// A character as a receiver makes it of noise.
    pub(crate) fn stray(&mut self) -> u8 {
        self.random.u8(..)
    }

    /// The second master's next request and when it makes it.
    pub(crate) fn next_request(&self) -> Option<(Instant, u8, &[u8])> {
        let (master, since) = (self.defects.second_master.as_ref()?, self.since?);
        let at = usize::try_from(self.made).ok()?.checked_rem(master.requests.len())?;
        let (slave, pdu) = master.requests.get(at)?;
        Some((since + master.every.saturating_mul(self.made.saturating_add(1)), *slave, pdu))
    }

    pub(crate) const fn request_made(&mut self) {
        self.made = self.made.saturating_add(1);
    }

    fn usual_gap(&self) -> Option<Duration> {
        let noise = self.defects.noise.filter(|noise| noise.share > 0)?;
        let (share, burst) = (noise.share.min(ALWAYS), noise.burst.as_nanos());
        let gap = burst * u128::from(ALWAYS - share) / u128::from(share);
        Some(Duration::from_nanos(u64::try_from(gap).unwrap_or(u64::MAX)).max(Duration::from_micros(1)))
    }

    /// Draws the bursts up to this moment: their distances are those of events that come by chance.
    fn draw(&mut self, until: Instant) {
        let (Some(noise), Some(gap), Some(mut at)) = (self.defects.noise, self.usual_gap(), self.drawn)
        else {
            return;
        };
        while at <= until {
            let chance = self.random.f64().max(f64::MIN_POSITIVE);
            at += gap.mul_f64(-chance.ln());
            self.bursts.push_back((at, at + noise.burst));
            at += noise.burst;
        }
        self.drawn = Some(at);
        while self.bursts.front().is_some_and(|(_, ended)| *ended + REMEMBERED < until) {
            self.bursts.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_takes_the_share_of_the_time_that_it_is_given() {
        for share in [1_000, 10_000, 100_000] {
            let burst = Duration::from_millis(2);
            let now = Instant::now();
            let noise = Some(Noise { share, burst, seed: 1 });
            let mut line = Defective::new(Defects { noise, ..Defects::default() }, now);
            let (mut at, mut bursts) = (now, 0);
            while let Some((begins, _)) = line.next_burst(at)
                && begins < now + Duration::from_secs(1_000)
            {
                at = begins;
                bursts += 1;
            }
            // In 1000 s, bursts of 2 ms.
            let expected = share / 2;
            assert!((expected * 8 / 10..=expected * 12 / 10).contains(&bursts), "{share}: {bursts}");
        }
    }

    #[test]
    fn an_adapter_that_waits_hands_over_on_a_grid_of_its_own() {
        let now = Instant::now();
        let every = Some(Duration::from_millis(16));
        let line = Defective::new(Defects { hands_over_every: every, ..Defects::default() }, now);
        for (arrived, handed_over) in [(0, 0), (1, 16), (16, 16), (17, 32), (100, 112)] {
            let moment = |millis| now + Duration::from_millis(millis);
            assert_eq!(line.handed_over(moment(arrived)), Some(moment(handed_over)), "{arrived}");
        }
    }
}
