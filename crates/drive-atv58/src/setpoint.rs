//! Setpoints: `W401`, in counts of the map.

use drive_core::{
    Class, Command, Confirming, Error, Frequency, Port, Refusal, Result, Setpoint, SetpointProblem, Status,
};
use drive_drivecom::{ChartState, Drivecom, ENABLE_OPERATION, Limits, follows_frequency};

use crate::{Atv58, command::OTHER_REFERENCE, reading::Words, registers::W401};

impl<P: Port> Atv58<P> {
    pub(crate) async fn give_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let Setpoint::Frequency(frequency) = setpoint else {
            return Err(Error::Unsupported {
                what: "a setpoint in rpm or percent",
                reason: "the manual names a frequency reference only",
            });
        };
        let slave = self.registers.slave();
        let scaled = u64::from(frequency.centihertz()) * u64::from(self.map.reference_counts_per_hertz);
        if !scaled.is_multiple_of(100) {
            let problem = SetpointProblem::Resolution("one count of W401");
            return Err(Error::Setpoint { slave, setpoint, problem });
        }
        let count = i16::try_from(scaled / 100);
        let count =
            count.map_err(|_| Error::Setpoint { slave, setpoint, problem: SetpointProblem::TooLarge })?;
        let count = if self.is_negative().await? { -count } else { count };
        if let Some((low, high)) = self.speed_limits().await?
            && (frequency < low || frequency > high)
        {
            let problem = SetpointProblem::OutsideFrequencyLimits { low, high };
            return Err(Error::Setpoint { slave, setpoint, problem });
        }
        let word = count.cast_unsigned();
        self.proof.is_giving(W401.address(), word);
        let mut calls = self.registers.at(Class::Command).replacing(W401.address());
        let written = calls.write(W401, word).await;
        self.proof.gave(W401.address(), word, true, written)?;
        self.registers.owe_judgement();
        self.see_setpoint(setpoint).await.map_err(Error::after_write)
    }

    /// Whether the reference that stands turns the motor against its run command, as another master may have left it: a setpoint
    /// leaves that as it is, while the motor turns or might. One for a motor that nothing runs has no sign.
    pub(crate) async fn is_negative(&mut self) -> Result<bool> {
        let status = self.read_status(Class::Command).await?;
        let (_, reference) = self.read_held(Class::Command).await?;
        let chart = status.raw(self.map.status).and_then(ChartState::of);
        let turns = status.output_frequency.is_none_or(|output| output != Frequency::ZERO);
        let enabled = chart.is_none_or(|chart| chart == ChartState::OperationEnabled);
        Ok(reference.cast_signed() < 0 && (turns || enabled))
    }

    /// Sees the setpoint in force: a motor that runs follows it, and local control is not forced. What one that stands will
    /// follow, the drive does not tell; its start sees that.
    async fn see_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        let mut confirming = Confirming::begin();
        loop {
            let status = self.read_status(Class::Command).await?;
            let enabled =
                status.raw(self.map.status).and_then(ChartState::of) == Some(ChartState::OperationEnabled);
            let turns = status.output_frequency.is_some_and(|frequency| frequency != Frequency::ZERO);
            let runs = enabled && turns && self.read_control().await? & ENABLE_OPERATION == ENABLE_OPERATION;
            // It is told only while local control is forced, in which no reference of the line counts.
            let forced = status.control.map(Refusal::NotInControl);
            let is_seen = if runs { self.follows(&status).await? } else { self.holds_setpoint().await? };
            if forced.is_none() && is_seen {
                return Ok(());
            }
            if forced.is_some() || !confirming.again().await {
                let (slave, command) = (self.registers.slave(), Command::Setpoint(setpoint));
                let because = forced.or(Some(OTHER_REFERENCE));
                return Err(Error::NotConfirmed { slave, command, status: Box::new(status), because });
            }
        }
    }

    /// Whether the drive holds the word that it was given last: its acknowledgement alone does not tell.
    async fn holds_setpoint(&mut self) -> Result<bool> {
        let held = self.registers.at(Class::Command).read(W401).await?;
        Ok(Some((W401.address(), held)) == self.proof.given())
    }

    /// Whether the drive follows the reference of the bus, as far as the map names the word that tells.
    pub(crate) async fn follows(&mut self, status: &Status) -> Result<bool> {
        let Some(reference) = self.reference(status) else { return Ok(true) };
        let (_, w401) = self.read_held(Class::Command).await?;
        let asked = self.reference_of(w401);
        let limits = self.speed_limits().await?.unwrap_or((asked, asked));
        Ok(follows_frequency(reference, asked, limits))
    }

    /// What a word of W401 asks for, in size.
    pub(crate) fn reference_of(&self, w401: u16) -> Frequency {
        let counts = u64::from(w401.cast_signed().unsigned_abs());
        let asked = (counts * 100).checked_div(u64::from(self.map.reference_counts_per_hertz)).unwrap_or(0);
        Frequency::from_centihertz(u32::try_from(asked).unwrap_or(u32::MAX))
    }

    /// Whether the reference before the ramp is zero, so that nothing turns.
    pub(crate) fn asks_for_nothing(&self, status: &Status) -> bool {
        self.reference(status).is_none_or(|reference| reference == Frequency::ZERO)
    }

    fn reference(&self, status: &Status) -> Option<Frequency> {
        status.raw(self.map.reference?).map(Frequency::from_decihertz)
    }

    async fn speed_limits(&mut self) -> Result<Option<Limits>> {
        match self.proof.fresh_limits() {
            Some(limits) => Ok(limits),
            None => self.read_limits(Class::Command).await,
        }
    }

    /// The limits, where the map names them and the drive has them.
    pub(crate) async fn read_limits(&mut self, class: Class) -> Result<Option<Limits>> {
        let limits = match self.map.speed_limits {
            None => None,
            Some((low, high)) => {
                let calls = &mut self.registers.at(class);
                let words = Words::read(&mut self.absent, calls, false, &[low, high]).await?;
                let frequency = |address| words.at(Some(address)).map(Frequency::from_decihertz);
                frequency(low).zip(frequency(high))
            }
        };
        self.proof.take_limits(limits);
        Ok(limits)
    }
}
