//! How fast the drive brings its motor down, as far as it has told: an output that is gone sooner was cut.

use std::time::Duration;

use drive_core::{Class, Error, Frequency, Port, Result};

use crate::{
    Atv312,
    registers::{DEC, FRS, INR, RPS},
};

/// What decides a ramp, as far as it was read.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ramp {
    /// `FrS`, from which the motor comes down in the time (BBV51701 p. 39).
    nominal: Option<u16>,
    /// `Inr`, what a count of the time is (p. 38).
    increment: Option<u16>,
    /// `rPS`, `Frt`, `AC2`, `dE2`: whether there is a second ramp, and its time.
    second: Option<[u16; 4]>,
    /// `dEC`.
    time: Option<u16>,
    /// The drive has refused one.
    refused: bool,
}

impl Ramp {
    /// Whether something of it is to be read that the drive has not refused.
    pub(crate) const fn can_learn(&self) -> bool {
        let known = self.nominal.is_some()
            && self.increment.is_some()
            && self.second.is_some()
            && self.time.is_some();
        !known && !self.refused
    }

    /// The frequency by which it comes down, and in which time: by the slower one of two ramps, for which of them acts is an input's or a
    /// threshold's.
    fn rate(&self) -> Option<(Frequency, Duration)> {
        let step = match self.increment? {
            0 => Duration::from_millis(10),
            1 => Duration::from_millis(100),
            2 => Duration::from_secs(1),
            _ => return None,
        };
        let [switched, threshold, _, second] = self.second?;
        let second = if switched == 0 && threshold == 0 { 0 } else { second };
        Some((Frequency::from_decihertz(self.nominal?), step * u32::from(self.time?.max(second))))
    }
}

impl<P: Port> Atv312<P> {
    /// Reads what is not known yet of the ramp: one exchange.
    pub(crate) async fn read_ramp(&mut self, class: Class) -> Result<()> {
        let ramp = self.known.ramp;
        if ramp.nominal.is_none() {
            let read = self.registers.at(class).read(FRS).await;
            self.take_ramp(read, |ramp, word| ramp.nominal = Some(word))
        } else if ramp.increment.is_none() {
            let read = self.registers.at(class).read(INR).await;
            self.take_ramp(read, |ramp, word| ramp.increment = Some(word))
        } else if ramp.second.is_none() {
            self.read_second_ramp(class).await
        } else {
            self.read_ramp_time(class).await
        }
    }

    /// Reads which of two ramps acts, and the second one.
    pub(crate) async fn read_second_ramp(&mut self, class: Class) -> Result<()> {
        let read = self.registers.at(class).read_array(RPS.address()).await;
        self.take_ramp(read, |ramp, words| ramp.second = Some(words))
    }

    /// Reads the time of the first one.
    pub(crate) async fn read_ramp_time(&mut self, class: Class) -> Result<()> {
        let read = self.registers.at(class).read(DEC).await;
        self.take_ramp(read, |ramp, word| ramp.time = Some(word))
    }

    fn take_ramp<T>(&mut self, read: Result<T>, take: impl FnOnce(&mut Ramp, T)) -> Result<()> {
        let ramp = &mut self.known.ramp;
        ramp.refused |= matches!(read, Err(Error::Exception { .. }));
        let taken = read.map(|read| take(ramp, read));
        if !ramp.can_learn() {
            self.proof.watch.shaft.set_ramp(ramp.rate());
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_as_fast_as_the_drive_has_told_and_of_two_the_slower_one_counts() {
        let ramp = |increment, second: [u16; 4], time| Ramp {
            nominal: Some(500),
            increment: Some(increment),
            second: Some(second),
            time: Some(time),
            refused: false,
        };
        let in_time = |milliseconds| Some((Frequency::from_hertz(50), Duration::from_millis(milliseconds)));
        assert_eq!(ramp(1, [0, 0, 50, 50], 5).rate(), in_time(500));
        assert_eq!(ramp(0, [0, 0, 50, 50], 5).rate(), in_time(50));
        assert_eq!(ramp(2, [0, 0, 50, 50], 5).rate(), in_time(5_000));
        assert_eq!(ramp(1, [129, 0, 50, 50], 5).rate(), in_time(5_000), "an input chooses");
        assert_eq!(ramp(1, [0, 200, 50, 50], 5).rate(), in_time(5_000), "a threshold chooses");
        assert_eq!(ramp(1, [129, 0, 50, 50], 90).rate(), in_time(9_000));
        assert_eq!(ramp(3, [0, 0, 50, 50], 5).rate(), None, "no increment that the manual lists");
        assert_eq!(Ramp { time: None, ..ramp(1, [0; 4], 5) }.rate(), None);
    }
}
