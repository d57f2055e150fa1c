//! Setpoints: FA01 in hertz and FA13 in rpm, and what may override both.

use drive_core::{
    Class, Command, Confirming, Error, ErrorKind, ExceptionMeaning, Frequency, Port, Refusal, Result,
    SETTLED_WITHIN, Setpoint, SetpointProblem, Speed, Status,
    registers::{Register, access::ReadWrite},
};
use tokio::time::Instant;

use crate::{
    Atv21, Authority,
    control::{other_reference, status_word},
    refusals::OTHER_REFERENCE,
    registers as map,
    words::{CommandWord, ReferenceSource, StatusWord},
};

/// FA13 takes no more (Altivar 21 Modbus §8.2).
const HIGHEST_SPEED: Speed = Speed::from_rpm(24_000);

/// What a setpoint is written to.
pub(crate) type Reference = (Register<ReadWrite>, u16);

impl<P: Port> Atv21<P> {
    pub(crate) async fn write_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.check_own(Command::Setpoint(setpoint)).await?;
        let reference @ (register, word) = self.reference(setpoint).await?;
        self.check_reference(Command::Setpoint(setpoint)).await?;
        let before = self.proof.agreed;
        let has_cleared = self.clear_other_reference(register).await?;
        let mut calls = self.registers.at(Class::Command).replacing(register.address());
        let written = calls.write(register, word).await;
        // A motor that followed the other one comes down by that.
        written.map_err(|error| if has_cleared { error.after_write() } else { error })?;
        self.registers.owe_judgement();
        let seen = self.confirm_reference(setpoint, reference).await.map_err(Error::after_write);
        if seen.as_ref().is_err_and(|error| error.kind() == ErrorKind::NotConfirmed) {
            let held = self.registers.at(Class::Command).read(register).await.ok();
            let was =
                before.filter(|(before, _)| before.address() == register.address()).map(|(_, word)| word);
            if held.is_some_and(|held| held != word && was != Some(held)) {
                self.proof.expect(reference);
            }
        }
        seen
    }

    /// Sets the reference to 0 that is not to count: the manual does not say which of FA01 and FA13 does where both are
    /// set. What both held before the first setpoint is remembered. Gives whether it was written.
    pub(crate) async fn clear_other_reference(&mut self, register: Register<ReadWrite>) -> Result<bool> {
        let hertz = register.address() == map::FREQUENCY_REFERENCE.address();
        let other = if hertz { map::SPEED_REFERENCE } else { map::FREQUENCY_REFERENCE };
        self.proof.disagree();
        let mut calls = self.registers.at(Class::Command);
        let held = calls.read(other).await?;
        if self.references.is_none() {
            let own = calls.read(register).await?;
            self.references = Some(if hertz { [own, held] } else { [held, own] });
        }
        if held != 0 {
            calls.write(other, 0).await?;
        }
        Ok(held != 0)
    }

    /// The register and the word of a setpoint, if the drive's limits allow it.
    pub(crate) async fn reference(&mut self, setpoint: Setpoint) -> Result<Reference> {
        let slave = self.registers.slave();
        let refuse = |problem| Error::Setpoint { slave, setpoint, problem };
        match setpoint {
            Setpoint::Frequency(frequency) => {
                let high = self.upper_limit().await?;
                if frequency > high {
                    let low = Frequency::ZERO;
                    return Err(refuse(SetpointProblem::OutsideFrequencyLimits { low, high }));
                }
                let word =
                    u16::try_from(frequency.centihertz()).map_err(|_| refuse(SetpointProblem::TooLarge))?;
                Ok((map::FREQUENCY_REFERENCE, word))
            }
            Setpoint::Speed(speed) => {
                let low = Speed::default();
                let outside = SetpointProblem::OutsideSpeedLimits { low, high: HIGHEST_SPEED };
                match u16::try_from(speed.rpm()) {
                    Ok(word) if speed <= HIGHEST_SPEED => Ok((map::SPEED_REFERENCE, word)),
                    _ => Err(refuse(outside)),
                }
            }
            Setpoint::Share(_) => Err(Error::no_share()),
        }
    }

    /// The drive's UL, read once. A drive that has no such register judges the setpoint by itself.
    pub(crate) async fn upper_limit(&mut self) -> Result<Frequency> {
        if let Some(limit) = self.upper_limit {
            return Ok(limit);
        }
        let limit = match self.registers.at(Class::Command).read(map::UPPER_LIMIT).await {
            Ok(word) => {
                self.watch.knows(map::UPPER_LIMIT.address(), word);
                Frequency::from_centihertz(word.into())
            }
            Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, .. }) => {
                Frequency::from_centihertz(u16::MAX.into())
            }
            Err(error) => return Err(error),
        };
        self.upper_limit = Some(limit);
        Ok(limit)
    }

    /// Reads a reference back, and sees that nothing else is in force: FE46 names the bus while the motor runs, and where it
    /// does FE02 is what was written. At rest FE02 may be 0, and what it shows of a tripped drive is from before the trip.
    pub(crate) async fn confirm_reference(
        &mut self,
        setpoint: Setpoint,
        (register, word): Reference,
    ) -> Result<()> {
        let (mut confirming, settled) = (Confirming::begin(), Instant::now() + SETTLED_WITHIN);
        loop {
            let (kept, status, because) = match self.look_at_reference((register, word)).await {
                Ok(seen) => seen,
                // A reading that the line has lost is one more reason to read again.
                Err(error) if error.kind() == ErrorKind::NoAnswer && confirming.again().await => continue,
                Err(error) => return Err(error),
            };
            if kept && because.is_none() {
                self.proof.agreed = Some((register, word));
                self.proof.reference = self.proof.reference.or(Some(word));
                return Ok(());
            }
            if !kept || Instant::now() >= settled || !confirming.again().await {
                return Err(self.not_confirmed(Command::Setpoint(setpoint), status, because));
            }
        }
    }

    /// Whether the register holds the word, the status where it was read, and what is in force instead.
    async fn look_at_reference(
        &mut self,
        (register, word): Reference,
    ) -> Result<(bool, Status, Option<Refusal>)> {
        let kept = self.registers.at(Class::Command).read(register).await? == word;
        let active = self.active_reference().await?;
        let hertz = register.address() == map::FREQUENCY_REFERENCE.address();
        let ours = active == ReferenceSource::Serial;
        let mut in_force = 0;
        if hertz && ours {
            in_force = self.registers.at(Class::Command).read(map::REFERENCE_BEFORE_RAMP).await?;
        }
        if kept && ours && (!hertz || is_same(in_force, word)) {
            return Ok((kept, Status::default(), None));
        }
        let status = self.read_briefly().await?;
        let runs = status_word(&status).contains(StatusWord::RUN);
        let because = if ours {
            let own = !hertz || status.is_fault() || is_same(in_force, word) || (in_force == 0 && !runs);
            (!own).then_some(OTHER_REFERENCE)
        } else {
            other_reference(active).filter(|_| runs)
        };
        Ok((kept, status, because))
    }

    /// Refuses a setpoint that something else than the bus would override now or at the next start. A preset speed that
    /// stands in FA00 at rest is overwritten by the next command word, and the reference priority that the next start
    /// sets makes the bus the source.
    async fn check_reference(&mut self, command: Command) -> Result<()> {
        let own = self.selections.unwrap_or_default().preset_speed();
        let active = if own != 0 { ReferenceSource::PresetSpeed } else { self.active_reference().await? };
        let Some(instead) = other_reference(active) else { return Ok(()) };
        let status = self.read_briefly().await?;
        let held = self.command_word(Class::Command).await?;
        let ours_at_start = match active {
            ReferenceSource::PresetSpeed => own == 0 && held.preset_speed() != 0,
            _ => self.authority == Authority::Priority && !held.contains(CommandWord::REFERENCE_PRIORITY),
        };
        if ours_at_start && !status_word(&status).intersects(StatusWord::RUN | StatusWord::LOCAL) {
            return Ok(());
        }
        Err(self.refused(command, instead))
    }
}

/// Whether two frequencies are the same but for the drive's own rounding.
pub(crate) const fn is_same(one: u16, other: u16) -> bool {
    one.abs_diff(other) <= 1
}
