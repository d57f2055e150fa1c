//! Setpoints: `LFr` in hertz, `LFRD` in rpm, both as magnitudes. The direction is the run command's.

use drive_core::{
    Class, Command, Confirming, Control, Error, Frequency, Port, Result, Setpoint, SetpointProblem, Speed,
    drivecom::{self, ChartState, Drivecom, follows_frequency, follows_speed},
};

use crate::{
    Atv28,
    command::OTHER_REFERENCE,
    reading::FastWords,
    registers::{HSP, LFR, LFRD, SMIL_LOW},
    words::ControlWord,
};

/// The drive's own limits, read when the first setpoint needs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Limits {
    frequency: Option<(Frequency, Frequency)>,
    speed: Option<(Speed, Speed)>,
}

impl<P: Port> Atv28<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let (register, word) = match setpoint {
            Setpoint::Frequency(frequency) => (LFR, self.frequency_word(frequency).await?),
            // No speed is no frequency too, and FRHD would not tell it from a speed that nobody gave.
            Setpoint::Speed(speed) => match self.speed_word(speed).await? {
                0 => (LFR, 0),
                word => (LFRD, word),
            },
        };
        // A run command may stand from before, of which nothing but CMD tells.
        if self.command.is_none() {
            self.read_control().await?;
        }
        self.registers.at(Class::Command).replacing(LFR.address()).write(register, word).await?;
        let frequency = (register.address() == LFR.address()).then(|| Frequency::from_decihertz(word));
        self.see_setpoint(setpoint, frequency).await.map_err(Error::after_write)
    }

    /// Sees the setpoint in force: the motor that runs by a command of the bus follows it, and one that somebody else runs
    /// does not. What one that stands will follow, the drive does not tell; its start sees that.
    async fn see_setpoint(&mut self, setpoint: Setpoint, frequency: Option<Frequency>) -> Result<()> {
        let mut confirming = Confirming::begin();
        loop {
            let status = self.read_status(Class::Command).await?;
            let words = FastWords::of_raw(&status.raw);
            let refusal = words.state_words().refuses_reference();
            let follows = match frequency {
                _ if refusal.is_some() => false,
                _ if !self.runs_by_bus(&words) => return Ok(()),
                Some(asked) => follows_frequency(words.reference(), asked, self.frequency_limits().await?),
                None => self.follows_speed().await?,
            };
            if follows {
                return Ok(());
            }
            if refusal.is_some() || !confirming.again().await {
                let (slave, command) = (self.registers.slave(), Command::Setpoint(setpoint));
                let (status, because) = (Box::new(status), refusal.or(Some(OTHER_REFERENCE)));
                return Err(Error::NotConfirmed { slave, command, status, because });
            }
        }
    }

    /// Whether the drive follows the reference of the bus: `FrH` is `LFr` between the limits, or, where a speed was given,
    /// `FRHD` is `LFRD`.
    pub(crate) async fn follows(&mut self, words: &FastWords) -> Result<bool> {
        let asked = self.registers.at(Class::Command).read(LFR).await?.cast_signed().unsigned_abs();
        let limits = self.frequency_limits().await?;
        let asked = Frequency::from_decihertz(asked);
        Ok(follows_frequency(words.reference(), asked, limits) || self.follows_speed().await?)
    }

    async fn follows_speed(&mut self) -> Result<bool> {
        // LFRD, FRHD.
        let [lfrd, frhd] = self.registers.at(Class::Command).read_array(LFRD.address()).await?;
        Ok(follows_speed(frhd, lfrd))
    }

    /// Whether a run command of the bus is in force.
    fn runs_by_bus(&self, words: &FastWords) -> bool {
        let words = words.state_words();
        let runs = self.command.map_or(words.is_turning(), ControlWord::is_run);
        runs && words.chart() == Some(ChartState::OperationEnabled) && words.control() == Control::Bus
    }

    async fn frequency_word(&mut self, frequency: Frequency) -> Result<u16> {
        let setpoint = Setpoint::Frequency(frequency);
        if !frequency.centihertz().is_multiple_of(10) {
            return Err(self.setpoint(setpoint, SetpointProblem::Resolution("0.1 Hz")));
        }
        let word = frequency.exact_decihertz();
        let word = word.ok_or_else(|| self.setpoint(setpoint, SetpointProblem::TooLarge))?;
        let (low, high) = self.frequency_limits().await?;
        if frequency < low || frequency > high {
            return Err(self.setpoint(setpoint, SetpointProblem::OutsideFrequencyLimits { low, high }));
        }
        Ok(word)
    }

    async fn speed_word(&mut self, speed: Speed) -> Result<u16> {
        let setpoint = Setpoint::Speed(speed);
        let limits = self.speed_limits().await?;
        drivecom::speed_word(speed, limits).map_err(|problem| self.setpoint(setpoint, problem))
    }

    /// HSP and LSP, which follow each other.
    async fn frequency_limits(&mut self) -> Result<(Frequency, Frequency)> {
        if let Some(limits) = self.limits.frequency {
            return Ok(limits);
        }
        let words: [u16; 2] = self.registers.at(Class::Command).read_array(HSP.address()).await?;
        let [high, low] = words.map(Frequency::from_decihertz);
        let limits = (low, high);
        self.limits.frequency = Some(limits);
        Ok(limits)
    }

    /// SMIL and SMAL, the same limits in rpm.
    async fn speed_limits(&mut self) -> Result<(Speed, Speed)> {
        if let Some(limits) = self.limits.speed {
            return Ok(limits);
        }
        let limits = drivecom::speed_limits(&mut self.registers.at(Class::Command), SMIL_LOW).await?;
        self.limits.speed = Some(limits);
        Ok(limits)
    }

    const fn setpoint(&self, setpoint: Setpoint, problem: SetpointProblem) -> Error {
        Error::Setpoint { slave: self.registers.slave(), setpoint, problem }
    }
}
