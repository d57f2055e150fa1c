//! Setpoints: `LFr` in hertz, `LFRD` in rpm, both as magnitudes. The direction is the run command's.

use drive_core::{
    Class, Command, Confirming, Control, Error, Frequency, Port, Refusal, Result, Setpoint, SetpointProblem,
    Speed,
};
use drive_drivecom::{self as drivecom, ChartState, follows_frequency};

use crate::{
    Atv312,
    facts::OTHER_REFERENCE,
    reading::{FastWords, Resolution},
    registers::{LFR, LFRD},
    settings::Controls,
    words::{AccessLevel, ControlWord, StatusWord},
};

impl<P: Port> Atv312<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        if let Some(reason) = self.refuses_writes() {
            return Err(self.refused(Command::Setpoint(setpoint), reason));
        }
        let words = self.fast_words(Class::Command).await?;
        // Whoever stands at a drive whose motor rests may have set otherwise whose reference it follows, or may have set it right since.
        if !words.state_words().is_driving() || self.known.settings.refuses_reference().is_some() {
            self.read_references(Class::Command).await?;
        } else {
            self.read_settings(Class::Command).await?;
        }
        if let Some(reason) = self.known.settings.refuses_reference() {
            return Err(self.refused(Command::Setpoint(setpoint), reason));
        }
        // What a count is, and which way the reference that stands turns the motor, another master may have changed.
        let controls = self.read_controls(Class::Command).await?;
        let resolution = controls.resolution();
        let (register, word) = match setpoint {
            Setpoint::Frequency(frequency) => (LFR, self.frequency_word(frequency, resolution).await?),
            // No speed is no frequency too, and FRHD would not tell it from a speed that nobody gave.
            Setpoint::Speed(speed) => match self.speed_word(speed, resolution).await? {
                0 => (LFR, 0),
                word => (LFRD, word),
            },
            Setpoint::Share(_) => return Err(Error::no_share()),
        };
        let word = if self.is_negative(&words, &controls).await? { negative(word) } else { word };
        // Both are images of the one reference of the bus, so a later setpoint of either kind takes the place of one
        // that still waits.
        self.recounted = false;
        self.proof.is_giving(register.address(), word);
        let written = self.registers.at(Class::Command).replacing(LFR.address()).write(register, word).await;
        let is_lfr = register.address() == LFR.address();
        self.proof.gave(register.address(), word, is_lfr, written)?;
        let frequency = is_lfr.then(|| resolution.frequency(word));
        self.registers.owe_judgement();
        self.see_setpoint(setpoint, frequency).await.map_err(Error::after_write)
    }

    /// Sees the setpoint in force: the motor that runs by a command of the bus follows it; one that does not will, as far as
    /// nothing tells of another reference.
    async fn see_setpoint(&mut self, setpoint: Setpoint, frequency: Option<Frequency>) -> Result<()> {
        let mut confirming = Confirming::begin();
        loop {
            let status = self.fast_status(Class::Command).await?;
            let words = FastWords::in_status(&status);
            let running = self.runs_by_bus(&words);
            let follows = match frequency {
                _ if !running => false,
                Some(asked) => follows_frequency(words.reference(), asked, self.frequency_limits().await?),
                None => self.follows_speed().await?.1,
            };
            if follows && !self.known.settings.falls_back() {
                return Ok(());
            }
            if follows {
                let held = self.proof.held().unwrap_or(0);
                return match self.judge_reference(held).await? {
                    None => Ok(()),
                    because => Err(self.not_confirmed(Command::Setpoint(setpoint), status, because)),
                };
            }
            if running && confirming.again().await {
                continue;
            }
            let held = self.proof.held().unwrap_or(0);
            let other = if words.state_words().is_driving() {
                self.other_reference().await?
            } else {
                // What the settings say was read in front of the write.
                self.judge_reference(held).await?
            };
            let other = self.refuses_reference(&words).or(other);
            let because = if running { other.or(Some(OTHER_REFERENCE)) } else { other };
            return match because {
                None if self.holds_setpoint().await? => Ok(()),
                None if confirming.again().await => continue,
                because => {
                    let because = because.or(Some(OTHER_REFERENCE));
                    Err(self.not_confirmed(Command::Setpoint(setpoint), status, because))
                }
            };
        }
    }

    /// Whether the drive holds the word that it was given last: its acknowledgement alone does not tell.
    async fn holds_setpoint(&mut self) -> Result<bool> {
        let Some((register, word)) = self.proof.given() else { return Ok(false) };
        let held = self.registers.at(Class::Command).read_words(register, 1).await?;
        Ok(held.first() == Some(&word))
    }

    /// Whether the reference that stands turns the motor against its run command: a setpoint leaves that as it is, while the motor
    /// is driven or might be. One for a motor that nothing runs has no sign.
    pub(crate) async fn is_negative(&mut self, words: &FastWords, controls: &Controls) -> Result<bool> {
        let state = words.state_words();
        let by_bus = state.control() == Control::Bus;
        let command = self.known.settings.meaning(controls.command);
        let enabled = state.chart() == Some(ChartState::OperationEnabled);
        if !(state.is_driving() || enabled && (!by_bus || command.is_run())) {
            return Ok(false);
        }
        if by_bus && enabled && words.reference() != Frequency::ZERO {
            return Ok(state.asks_for() != command.direction());
        }
        // Of a command that is not in CMD, LFr or LFRD tells, whichever the drive follows.
        let negative = |word: u16| word.cast_signed() < 0;
        let lfr = controls.reference;
        let limits = self.frequency_limits().await?;
        if lfr != 0 && follows_frequency(words.reference(), controls.resolution().frequency(lfr), limits) {
            return Ok(negative(lfr));
        }
        let (lfrd, follows) = self.follows_speed().await?;
        Ok(negative(if follows || lfr == 0 { lfrd } else { lfr }))
    }

    /// Whose the drive is, where its reference is his too: at L3 that of the command channel is another matter.
    fn refuses_reference(&self, words: &FastWords) -> Option<Refusal> {
        let words = words.state_words();
        let at_l3 = self.known.settings.level() == Some(AccessLevel::L3);
        let forced_local = !words.eta.contains(StatusWord::NOT_FORCED_LOCAL);
        words.refuses_reference().filter(|_| !at_l3 || forced_local)
    }

    /// Whether a run command of the bus is in force.
    fn runs_by_bus(&self, words: &FastWords) -> bool {
        let words = words.state_words();
        let runs = self.command().map_or(words.is_turning(), ControlWord::is_run);
        runs && words.chart() == Some(ChartState::OperationEnabled) && words.control() == Control::Bus
    }

    async fn frequency_word(&mut self, frequency: Frequency, resolution: Resolution) -> Result<u16> {
        let setpoint = Setpoint::Frequency(frequency);
        let (low, high) = self.frequency_limits().await?;
        if !(low..=high).contains(&frequency) {
            return Err(self.bad_setpoint(setpoint, SetpointProblem::OutsideFrequencyLimits { low, high }));
        }
        let problem = SetpointProblem::Resolution(resolution.step());
        resolution.word(frequency).ok_or_else(|| self.bad_setpoint(setpoint, problem))
    }

    async fn speed_word(&mut self, speed: Speed, resolution: Resolution) -> Result<u16> {
        let setpoint = Setpoint::Speed(speed);
        if resolution == Resolution::High {
            return Err(Error::Unsupported {
                what: "a setpoint in rpm",
                reason: "CMI bit 9 (high resolution) makes LFRD a frequency",
            });
        }
        let limits = self.speed_limits().await?;
        drivecom::speed_word(speed, limits).map_err(|problem| self.bad_setpoint(setpoint, problem))
    }

    const fn bad_setpoint(&self, setpoint: Setpoint, problem: SetpointProblem) -> Error {
        Error::Setpoint { slave: self.registers.slave(), setpoint, problem }
    }
}

/// The same magnitude the other way.
const fn negative(word: u16) -> u16 {
    word.cast_signed().wrapping_neg().cast_unsigned()
}
