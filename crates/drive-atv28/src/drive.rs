//! The [`Drive`] of this family.

use std::time::Duration;

use async_trait::async_trait;
use drive_core::{
    BroadcastWrite, Class, Direction, Drive, Fault, Faults, Ground, Identity, Intent, Lease, Measurements,
    Percent, Port, RawWord, Result, Row, Setpoint, Speed, Status, StopMode, Stopped, Voltage, Withdrawn,
    Written,
    drivecom::{self, StatusWords},
    registers::{Register, access::Readable},
};

use crate::{
    Atv28, FAULTS, WARNINGS, command,
    proof::Doubt,
    reading::{FIRST_BLOCK, FastWords, SECOND_BLOCK},
    registers::{DP1, DP2, DP3, DP4, ETA, INV, IOLR, OPR, OTR, RFRD, RTH},
    setpoint::Limits,
    words::{self, ControlWord, ExtendedStatus},
};

#[async_trait]
impl<P: Port> Drive for Atv28<P> {
    drive_core::told_by!(registers);

    fn lease(&self) -> Option<Lease> {
        self.own.lease()
    }

    fn adopt(&mut self, lease: Lease) {
        self.own.adopt(lease);
        // What the drive holds is read with the next status.
        self.command = None;
    }

    fn take_changed(&mut self) -> Option<Ground> {
        (!self.changed.is_empty()).then(|| self.changed.remove(0))
    }

    fn set_coast_time(&mut self, time: Option<Duration>) {
        self.shaft.set_coast_time(time);
    }

    fn forget(&mut self) {
        self.limits = Limits::default();
        self.command = None;
        self.control = None;
        self.lfr = None;
        self.doubt = Doubt::default();
        if self.own.lease().is_none() {
            self.given = None;
        }
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
        let block = calls.read_array(FIRST_BLOCK.0).await?;
        let [frh, _, _, _, uln, thr, thd] = block;
        let mut raw: Vec<_> = FastWords::first_block(&block);
        let iolr = keep(&mut raw, IOLR, calls.read(IOLR).await?);
        let otr = keep(&mut raw, OTR, calls.read(OTR).await?);
        let opr = keep(&mut raw, OPR, calls.read(OPR).await?);
        let rth = keep(&mut raw, RTH, calls.read(RTH).await?);
        let rfrd = keep(&mut raw, RFRD, calls.read(RFRD).await?);
        Ok(Measurements {
            reference: Some(drive_core::Frequency::from_decihertz(frh).into()),
            speed: Some(Speed::from_rpm(u32::from(rfrd.cast_signed().unsigned_abs()))),
            line_voltage: Some(Voltage::from_decivolts(u32::from(uln))),
            torque: Some(Percent::from_percent(otr.cast_signed())),
            power_share: Some(Percent::from_percent(opr.cast_signed())),
            drive_thermal: Some(percent(thd)),
            motor_thermal: Some(percent(thr)),
            running_time: Some(Duration::from_secs(u64::from(rth) * 3_600)),
            inputs: Some(iolr & words::LogicIo::INPUTS.bits()),
            outputs: Some(iolr & words::LogicIo::OUTPUTS.bits()),
            raw,
            at: self.registers.snapshot_time(),
            ..Measurements::default()
        })
    }

    async fn faults(&mut self) -> Result<Faults> {
        let mut calls = self.registers.at(Class::Background);
        let [lft, eta, eti, _] = calls.read_array(SECOND_BLOCK.0).await?;
        let mut history = Vec::new();
        for register in [DP1, DP2, DP3, DP4] {
            let code = calls.read(register).await?;
            if code != 0 {
                history.push(Fault::lookup(FAULTS, code));
            }
        }
        let state = StatusWords::new(eta, eti);
        let tripped = state.is_tripped();
        let warnings = WARNINGS.iter().filter(|entry| eti >> entry.code & 1 == 1);
        Ok(Faults {
            present: tripped.then(|| Fault::lookup(FAULTS, lft)).into_iter().collect(),
            history,
            warnings: warnings.map(|entry| Fault { code: entry.code, entry: Some(entry) }).collect(),
            reset_allowed: tripped.then(|| state.eti.contains(ExtendedStatus::RESET_AUTHORISED)),
        })
    }

    async fn start(&mut self, direction: Direction) -> Result<Status> {
        drivecom::start(self, direction, ControlWord::run(direction).bits()).await
    }

    async fn stop(&mut self, mode: StopMode) -> Result<Stopped> {
        drivecom::stop(self, mode).await
    }

    /// 100Fh, in forced local mode and where the bus commands: elsewhere a command would take the motor from whoever has it
    /// running.
    async fn withdraw(&mut self) -> Result<Withdrawn> {
        self.withdraw_run().await
    }

    async fn set_setpoint(&mut self, setpoint: Setpoint) -> Result<()> {
        self.give_setpoint(setpoint).await
    }

    async fn reset_faults(&mut self) -> Result<Status> {
        drivecom::reset_fault(self).await
    }

    /// The drive does not say what it is; its nominal current tells one rating from another.
    async fn identify(&mut self) -> Result<Identity> {
        let value = self.registers.at(Class::Background).read(INV).await?;
        let codes = vec![RawWord { address: INV.address(), code: INV.row().code, value }];
        Ok(Identity { codes, ..Identity::default() })
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

/// Keeps the raw word of a register and returns it.
fn keep(raw: &mut Vec<RawWord>, register: Register<impl Readable>, value: u16) -> u16 {
    raw.push(RawWord { address: register.address(), code: register.row().code, value });
    value
}
