//! The [`Drive`] of this family.

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    Absent, BroadcastWrite, Class, Direction, Drive, Fault, Faults, Frequency, Identity, Intent, Lease,
    Measurements, Percent, Port, RawWord, Result, Row, Setpoint, Speed, Status, StopMode, Stopped, Voltage,
    Withdrawn, Written,
};
use drive_drivecom as drivecom;

use crate::{
    Atv28, FAULTS, WARNINGS, command,
    reading::{FIRST_BLOCK, FastWords, SECOND_BLOCK, read_block},
    registers::{DP1, DP2, DP3, DP4, ETA, FRH, IOLR, LFT, OPR, OTR, RFRD, RTH, THD, THR, ULN},
    words::{self, ControlWord, ExtendedStatus},
};

#[async_trait]
impl<P: Port> Drive for Atv28<P> {
    drive_core::told_by!(registers);
    drive_core::watched_by!(proof.watch);

    fn run_word_for(&self, direction: Direction) -> Option<u16> {
        Some(ControlWord::run(direction).bits())
    }

    fn adopt(&mut self, lease: Lease) {
        self.proof.adopt(lease);
    }

    fn forget(&mut self) {
        self.proof.forget();
        (self.absent, self.speeds, self.control, self.said) = (Absent::default(), None, None, None);
    }

    /// Two exchanges, and a third one, for `CMD`, where the words alone do not tell whether a run command is in force: the
    /// first time for a drive that the bus commands, and while its motor slows down or stands with a run command.
    async fn status(&mut self) -> Result<Status> {
        self.watch().await
    }

    /// Six exchanges: W450 to W456 in one, and the five others one by one, because what stands between them is not
    /// known.
    async fn measurements(&mut self) -> Result<Measurements> {
        self.registers.begin_snapshot();
        let mut calls = self.registers.at(Class::Background);
        let words = FastWords::of(self.absent.read(&mut calls, FIRST_BLOCK.0, FIRST_BLOCK.1).await?);
        let mut raw = words.raw();
        for row in [IOLR.row(), OTR.row(), OPR.row(), RTH.row(), RFRD.row()] {
            if let Some(value) = self.absent.word(&mut calls, row.address).await? {
                raw.push(RawWord { address: row.address, code: row.code, value });
            }
        }
        let word = |row: &Row| raw.iter().find(|word| word.address == row.address).map(|word| word.value);
        let signed = |row| word(row).map(u16::cast_signed);
        // Whether torque and power have a sign is not printed of the twin either (BBV51701 p. 21): a word that would be negative is left
        // to the raw words.
        let driving = |row| signed(row).filter(|word| *word >= 0).map(Percent::from_percent);
        let iolr = word(IOLR.row());
        Ok(Measurements {
            reference: word(FRH.row()).map(|word| Frequency::from_decihertz(word).into()),
            speed: signed(RFRD.row()).map(|rpm| Speed::from_rpm(u32::from(rpm.unsigned_abs()))),
            line_voltage: word(ULN.row()).map(|word| Voltage::from_decivolts(u32::from(word))),
            torque: driving(OTR.row()),
            power_share: driving(OPR.row()),
            drive_thermal: word(THD.row()).map(percent),
            motor_thermal: word(THR.row()).map(percent),
            running_time: word(RTH.row()).map(|hours| Duration::from_secs(u64::from(hours) * 3_600)),
            inputs: iolr.map(|iolr| iolr & words::LogicIo::INPUTS.bits()),
            outputs: iolr.map(|iolr| iolr & words::LogicIo::OUTPUTS.bits()),
            raw,
            at: self.registers.snapshot_time(),
            ..Measurements::default()
        })
    }

    async fn faults(&mut self) -> Result<Faults> {
        let mut calls = self.registers.at(Class::Background);
        let second = read_block(&mut self.absent, &mut calls, SECOND_BLOCK).await?;
        let words = FastWords::of([None; FIRST_BLOCK.1 as usize].into_iter().chain(second));
        let mut history = Vec::new();
        for register in [DP1, DP2, DP3, DP4] {
            let code = self.absent.word(&mut calls, register.address()).await?;
            history.extend(code.filter(|&code| code != 0).map(|code| Fault::lookup(FAULTS, code)));
        }
        let state = words.state_words();
        let tripped = state.is_tripped();
        let warnings = WARNINGS.iter().filter(|entry| state.eti.bits() >> entry.code & 1 == 1);
        // 0 is nOF: no fault.
        let present = words.word(LFT).filter(|&code| tripped && code != 0);
        Ok(Faults {
            present: present.map(|code| Fault::lookup(FAULTS, code)).into_iter().collect(),
            history,
            warnings: warnings.map(|entry| Fault { code: entry.code, entry: Some(entry) }).collect(),
            tripped,
            reset_allowed: tripped.then(|| state.eti.contains(ExtendedStatus::RESET_AUTHORISED)),
        })
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        self.registers.begin_order();
        drivecom::start(self, direction, ControlWord::run(direction).bits()).await
    }

    async fn may_start(&mut self, direction: Direction, setpoint: Option<Setpoint>) -> Result<()> {
        self.registers.begin_order();
        drivecom::may_start(self, direction, setpoint).await
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        self.proof.watch.shaft.is_stopped_by(mode);
        Ok(drivecom::stop(self, mode).await?.held_by(&self.proof.watch.shaft))
    }

    /// 100Fh, in forced local mode and where the bus commands: elsewhere a command would take the motor from whoever has it
    /// running.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.registers.begin_order();
        drivecom::withdraw(self).await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.registers.begin_order();
        self.give_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        self.registers.begin_order();
        drivecom::reset_fault(self).await
    }

    /// The drive does not say what it is; its nominal current tells one rating from another.
    async fn identify(&mut self) -> Result<Identity> {
        let identity = self.read_identity(Class::Background).await?;
        self.said = Some(identity.clone());
        Ok(identity)
    }

    async fn keep_alive(&mut self) -> Result<()> {
        self.registers.at(Class::KeepAlive).read(ETA).await.map(drop)
    }

    async fn intent(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        self.asked_by_another(register, word).await
    }

    async fn read_parameter(&mut self, row: &'static Row) -> Result<u16> {
        self.registers.at(Class::Background).read_row(row).await
    }

    async fn write_parameter(&mut self, row: &'static Row, word: u16) -> Result<Written> {
        self.change_parameter(row, word).await
    }

    fn broadcast_stop(&self, mode: StopMode) -> Option<BroadcastWrite> {
        command::broadcast(mode)
    }
}

fn percent(word: u16) -> Percent {
    Percent::from_hundredths(i32::from(word) * 100)
}
