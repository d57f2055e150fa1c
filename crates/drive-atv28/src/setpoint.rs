//! Setpoints: `LFr` in hertz, `LFRD` in rpm, both as magnitudes. The direction is the run command's.

use drive_core::{
    Class, Command, Confirming, Control, Error, Frequency, Port, Result, Setpoint, SetpointProblem, Speed,
};
use drive_drivecom::{self as drivecom, ChartState, Drivecom, Limits, follows_frequency, follows_speed};

use crate::{
    Atv28,
    command::OTHER_REFERENCE,
    reading::FastWords,
    registers::{HSP, LFR, LFRD, SMIL_LOW},
    words::ControlWord,
};

/// What a word of `LFr` asks for, in size.
pub(crate) const fn count(lfr: u16) -> Frequency {
    Frequency::from_decihertz(lfr.cast_signed().unsigned_abs())
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
            Setpoint::Share(_) => return Err(Error::no_share()),
        };
        let word =
            if self.is_negative().await? { word.cast_signed().wrapping_neg().cast_unsigned() } else { word };
        self.proof.is_giving(register.address(), word);
        let written = self.registers.at(Class::Command).replacing(LFR.address()).write(register, word).await;
        let is_lfr = register.address() == LFR.address();
        self.proof.gave(register.address(), word, is_lfr, written)?;
        let frequency = is_lfr.then(|| count(word));
        self.registers.owe_judgement();
        self.see_setpoint(setpoint, frequency).await.map_err(Error::after_write)
    }

    /// Whether the reference that stands turns the motor against its run command, as another master may have left it: a setpoint
    /// leaves that as it is, while the motor is driven or might be. One for a motor that nothing runs has no sign.
    pub(crate) async fn is_negative(&mut self) -> Result<bool> {
        let words = self.fast_words(Class::Command).await?;
        let (held, lfr) = self.read_held(Class::Command).await?;
        let (state, command) = (words.state_words(), ControlWord::from_bits_retain(held));
        let by_bus = state.control() == Control::Bus;
        let enabled = state.chart() == Some(ChartState::OperationEnabled);
        if !(state.is_driving() || enabled && by_bus && command.is_run()) {
            return Ok(false);
        }
        if by_bus && enabled && words.reference() != Frequency::ZERO {
            return Ok(state.asks_for() != command.direction());
        }
        Ok(lfr.cast_signed() < 0)
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
                _ if !self.runs_by_bus(&words) && self.holds_setpoint().await? => return Ok(()),
                _ if !self.runs_by_bus(&words) => false,
                Some(asked) => {
                    let limits = self.frequency_limits().await?.unwrap_or((asked, asked));
                    follows_frequency(words.reference(), asked, limits)
                }
                None => self.follows_speed().await?.1,
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

    /// Whether the drive holds the word that it was given last: its acknowledgement alone does not tell.
    async fn holds_setpoint(&mut self) -> Result<bool> {
        let Some((register, word)) = self.proof.given() else { return Ok(false) };
        let held = self.registers.at(Class::Command).read_words(register, 1).await?;
        Ok(held.first() == Some(&word))
    }

    /// The reference of the bus that the drive follows, its register and its word: `FrH` is `LFr` between the limits, or, where a
    /// speed was given, `FRHD` is `LFRD`.
    pub(crate) async fn follows(&mut self, words: &FastWords) -> Result<Option<(u16, u16)>> {
        let (_, lfr) = self.read_held(Class::Command).await?;
        let asked = count(lfr);
        let limits = self.frequency_limits().await?.unwrap_or((asked, asked));
        if follows_frequency(words.reference(), asked, limits) {
            return Ok(Some((LFR.address(), lfr)));
        }
        let (lfrd, follows) = self.follows_speed().await?;
        Ok(follows.then_some((LFRD.address(), lfrd)))
    }

    /// Whether `FrH` may only be late, where it is not the speed of the bus that the drive follows.
    pub(crate) async fn frh_lags(&mut self, words: &FastWords, lfrd: u16) -> Result<bool> {
        let hsp = self.frequency_limits().await?.map(|(_, hsp)| hsp);
        let speeds = self.speed_limits().await;
        self.proof.frh_lags(words.reference(), lfrd, hsp, speeds)
    }

    async fn follows_speed(&mut self) -> Result<(u16, bool)> {
        let (lfrd, frhd) = self.read_speeds(Class::Command).await?;
        Ok((lfrd, follows_speed(frhd, lfrd)))
    }

    /// `LFRD` and `FRHD`: a drive without them follows no speed.
    pub(crate) async fn read_speeds(&mut self, class: Class) -> Result<(u16, u16)> {
        let words = self.absent.read(&mut self.registers.at(class), LFRD.address(), 2).await?;
        let word = |index: usize| words.get(index).copied().flatten().unwrap_or(0);
        Ok((word(0), word(1)))
    }

    /// Whether a run command of the bus is in force.
    fn runs_by_bus(&self, words: &FastWords) -> bool {
        let words = words.state_words();
        let runs = self.command().map_or(words.is_turning(), ControlWord::is_run);
        runs && words.chart() == Some(ChartState::OperationEnabled) && words.control() == Control::Bus
    }

    async fn frequency_word(&mut self, frequency: Frequency) -> Result<u16> {
        let setpoint = Setpoint::Frequency(frequency);
        if !frequency.centihertz().is_multiple_of(10) {
            return Err(self.setpoint(setpoint, SetpointProblem::Resolution("0.1 Hz")));
        }
        let word = frequency.exact_decihertz();
        let word = word.ok_or_else(|| self.setpoint(setpoint, SetpointProblem::TooLarge))?;
        match self.frequency_limits().await? {
            Some((low, high)) if !(low..=high).contains(&frequency) => {
                Err(self.setpoint(setpoint, SetpointProblem::OutsideFrequencyLimits { low, high }))
            }
            _ => Ok(word),
        }
    }

    async fn speed_word(&mut self, speed: Speed) -> Result<u16> {
        let setpoint = Setpoint::Speed(speed);
        let limits = self.speed_limits().await?;
        drivecom::speed_word(speed, limits).map_err(|problem| self.setpoint(setpoint, problem))
    }

    /// HSP and LSP, which follow each other, where they were not read lately; `None`: the drive has none.
    async fn frequency_limits(&mut self) -> Result<Option<Limits>> {
        match self.proof.fresh_limits() {
            Some(limits) => Ok(limits),
            None => self.read_frequency_limits(Class::Command).await,
        }
    }

    pub(crate) async fn read_frequency_limits(&mut self, class: Class) -> Result<Option<Limits>> {
        let words = self.absent.read(&mut self.registers.at(class), HSP.address(), 2).await?;
        let limits = match *words.as_slice() {
            [Some(high), Some(low)] => {
                Some((Frequency::from_decihertz(low), Frequency::from_decihertz(high)))
            }
            _ => None,
        };
        if self.proof.take_limits(limits) {
            // The same limits in rpm.
            self.speeds = None;
        }
        Ok(limits)
    }

    /// SMIL and SMAL, the same limits in rpm.
    async fn speed_limits(&mut self) -> Result<(Speed, Speed)> {
        if let Some(limits) = self.speeds {
            return Ok(limits);
        }
        let limits = drivecom::speed_limits(&mut self.registers.at(Class::Command), SMIL_LOW).await?;
        self.speeds = Some(limits);
        Ok(limits)
    }

    const fn setpoint(&self, setpoint: Setpoint, problem: SetpointProblem) -> Error {
        Error::Setpoint { slave: self.registers.slave(), setpoint, problem }
    }
}
