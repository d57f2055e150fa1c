//! The slow set, the faults, the identity.

use std::time::Duration;

use drive_core::{
    Class, Error, Fault, Faults, Frequency, Identity, Measurements, Percent, Port, RawWord, Recognised,
    Refusal, Result, Row, Setpoint, Speed, Voltage,
};
use drive_drivecom::StatusWords;
use tokio_modbus::prelude::ReadCode;

use crate::{
    Atv312, FAULTS, PastFault, WARNINGS,
    reading::Resolution,
    registers::{
        ARE, DP1, EP1, ERRD, ETI, FRH, FRHD, INV, IOLR, LCR, LFT, LRS1, NCV, OPR, OTR, RFRD, RTH, TDM, THD,
        THR, TSP, UDP, ULN, VCAL,
    },
    words::{ExtendedStatus, ExtendedStatus1, FaultState, LogicIo, StatusWord},
};

impl<P: Port> Atv312<P> {
    /// Six requests: no list of the manual has the words between these.
    pub(crate) async fn read_measurements(&mut self) -> Result<Measurements> {
        let resolution = self.resolution(Class::Background).await?;
        self.registers.begin_snapshot();
        let mut raw = Vec::new();
        // W3206 ETI lies between and is shown by the status.
        self.collect(Class::Background, &mut raw, &[FRH.row(), LCR.row(), OTR.row(), ETI.row(), ULN.row()])
            .await?;
        self.collect(Class::Background, &mut raw, &[THD.row(), TDM.row(), OPR.row()]).await?;
        self.collect(Class::Background, &mut raw, &[RTH.row()]).await?;
        self.collect(Class::Background, &mut raw, &[IOLR.row()]).await?;
        self.collect(Class::Background, &mut raw, &[RFRD.row(), FRHD.row()]).await?;
        self.collect(Class::Background, &mut raw, &[THR.row()]).await?;
        let word = |row: &Row| raw.iter().find(|word| word.address == row.address).map(|word| word.value);
        let percent = |row: &Row| word(row).map(|word| Percent::from_hundredths(i32::from(word) * 100));
        // Whether torque and power have a sign, as of a motor that feeds back, is not printed: a word that would be
        // negative is left to the raw words.
        let driving =
            |row: &Row| percent(row).filter(|_| word(row).is_some_and(|word| word.cast_signed() >= 0));
        let speed = |word: u16| Speed::from_rpm(u32::from(word.cast_signed().unsigned_abs()));
        let io = word(IOLR.row()).map(LogicIo::from_bits_retain);
        let outputs = LogicIo::R1 | LogicIo::R2 | LogicIo::LO | LogicIo::ANALOG_OUTPUT;
        Ok(Measurements {
            reference: word(FRH.row()).map(|word| Setpoint::Frequency(Frequency::from_decihertz(word))),
            // At high resolution the word counts a frequency, and the motor's poles are no register.
            speed: word(RFRD.row()).filter(|_| resolution == Resolution::Normal).map(speed),
            line_voltage: word(ULN.row()).map(|word| Voltage::from_decivolts(u32::from(word))),
            torque: driving(OTR.row()),
            power_share: driving(OPR.row()),
            drive_thermal: percent(THD.row()),
            motor_thermal: percent(THR.row()),
            running_time: word(RTH.row()).map(|word| Duration::from_secs(u64::from(word) * 3_600)),
            inputs: io.map(|io| (io - outputs).bits()),
            outputs: io.map(|io| (io & outputs).bits()),
            raw,
            at: self.registers.snapshot_time(),
            ..Measurements::default()
        })
    }

    /// The status, `LFt`, the alarms and the four past faults: four requests.
    pub(crate) async fn read_faults(&mut self) -> Result<Faults> {
        let words = self.fast_words(Class::Background).await?;
        let absent = &mut self.known.absent;
        let mut calls = self.registers.at(Class::Background);
        let last = absent.word(&mut calls, LFT.address()).await?;
        let past = absent.read(&mut calls, DP1.address(), 4).await?;
        let lrs1 = absent.word(&mut calls, LRS1.address()).await?;
        let lrs1 = ExtendedStatus1::from_bits_retain(lrs1.unwrap_or(0));
        // LFt keeps the last fault after it is gone: only the state says that it is present.
        let state = words.state_words();
        let tripped = state.is_tripped();
        // 0 is nOF: no fault.
        let present = last
            .filter(|&code| tripped && code != 0)
            .map(|code| Fault::lookup(FAULTS, code))
            .into_iter()
            .collect();
        let past = past.into_iter().flatten().filter(|&code| code != 0);
        let history = past.map(|code| Fault::lookup(FAULTS, code));
        Ok(Faults {
            present,
            history: history.collect(),
            warnings: warnings(state, lrs1),
            tripped,
            reset_allowed: tripped.then(|| state.eti.contains(ExtendedStatus::RESET_AUTHORISED)),
        })
    }

    /// The four past faults with the drive's state at each, in the drive's order. Which end is the newest is not
    /// printed.
    ///
    /// # Errors
    /// Those of [`Drive::faults`](drive_core::Drive::faults).
    pub async fn past_faults(&mut self) -> Result<[PastFault; 4]> {
        let mut calls = self.registers.at(Class::Background);
        let [dp1, dp2, dp3, dp4] = calls.read_array(DP1.address()).await?;
        let [ep1, ep2, ep3, ep4] = calls.read_array(EP1.address()).await?;
        let past = |code, state| PastFault {
            fault: (code != 0).then(|| Fault::lookup(FAULTS, code)),
            state: FaultState::from_bits_retain(state),
        };
        Ok([past(dp1, ep1), past(dp2, ep2), past(dp3, ep3), past(dp4, ep4)])
    }

    /// The CiA 402 error code `ERRD` (W8606), 0 where the drive has saved none.
    ///
    /// # Errors
    /// Those of [`Drive::faults`](drive_core::Drive::faults).
    pub async fn error_code(&mut self) -> Result<u16> {
        self.registers.at(Class::Background).read(ERRD).await
    }

    /// Function 43/14, then the words that tell one model from another: those are asked only of a drive that has not
    /// called itself another. A drive that refuses the function is described by the words alone.
    pub(crate) async fn read_identity(&mut self) -> Result<Identity> {
        let mut identity = self.named(Class::Background).await?;
        if !matches!(recognised(&identity), Recognised::NotMine { .. }) {
            let codes = &mut identity.codes;
            self.collect(Class::Background, codes, &SIZE).await?;
            self.known.size = Some(Identity { codes: codes.clone(), ..Identity::default() });
            for row in [INV.row(), UDP.row(), TSP.row()] {
                self.collect(Class::Background, codes, &[row]).await?;
            }
        }
        self.known.kind = Some(recognised(&identity));
        Ok(identity)
    }

    /// What the drive says of itself by function 43/14, and nothing where it refuses that.
    async fn named(&mut self, class: Class) -> Result<Identity> {
        match self.registers.at(class).identification(ReadCode::Basic).await {
            Err(Error::Exception { .. }) => Ok(Identity::default()),
            asked => asked,
        }
    }

    /// Reads the words of these rows, which must follow each other, in one request.
    async fn collect(&mut self, class: Class, raw: &mut Vec<RawWord>, rows: &[&'static Row]) -> Result<()> {
        let Some(first) = rows.first() else { return Ok(()) };
        let count = u16::try_from(rows.len()).unwrap_or(u16::MAX);
        let mut calls = self.registers.at(class);
        let words = self.known.absent.read(&mut calls, first.address, count).await?;
        let there = rows.iter().zip(words).filter_map(|(row, word)| Some((row, word?)));
        raw.extend(there.map(|(row, value)| RawWord { address: row.address, code: row.code, value }));
        Ok(())
    }

    /// Asks the drive of which size it is, before each start: another one may have come to its address since it was asked last. That is a
    /// third of what function 43/14 answers, which is asked once where nobody has: thirty that start at once on one line have no
    /// time for more. Why it is not started, if that shows.
    pub(crate) async fn recognise_itself(&mut self) -> Result<Option<Refusal>> {
        if self.known.kind.is_none() {
            self.known.kind = Some(recognised(&self.named(Class::Command).await?));
        }
        let mut size = Identity::default();
        self.collect(Class::Command, &mut size.codes, &SIZE).await?;
        Ok(size.refuses_start(&mut self.known.size).or(self.refuses_writes()))
    }
}

/// What tells a drive from one of another size.
const SIZE: [&Row; 3] = [ARE.row(), NCV.row(), VCAL.row()];

/// What function 43/14 or `TSP` say of the family: the reference begins with it (BBV52816 p. 14), `TSP` is 128 (p. 26). An
/// Altivar 31, which has all but three of these registers at the same addresses, is not told from it.
pub(crate) fn recognised(identity: &Identity) -> Recognised {
    let model = identity.model.as_deref().unwrap_or_default();
    let tsp = identity.codes.iter().find(|word| word.address == TSP.address()).map(|word| word.value);
    match Recognised::by_reference(model, "ATV312") {
        Some(Recognised::NotMine { .. }) if model.starts_with("ATV31") => return Recognised::CannotTell,
        Some(told) => return told,
        None => {}
    }
    match tsp {
        Some(128) => Recognised::Mine,
        // "An ASCII letter" (p. 26).
        Some(letter) if u8::try_from(letter).is_ok_and(|letter| letter.is_ascii_alphabetic()) => {
            Recognised::NotMine { it_is: "a product that TSP does not call an Altivar 312" }
        }
        _ => Recognised::CannotTell,
    }
}

fn warnings(words: StatusWords, lrs1: ExtendedStatus1) -> Vec<Fault> {
    let eti = words.eti;
    let mut codes: Vec<u16> = [
        (eti.contains(ExtendedStatus::MOTOR_THERMAL_ALARM), 7),
        (eti.contains(ExtendedStatus::BRAKING_ALARM), 8),
        (eti.contains(ExtendedStatus::CURRENT_LIMIT), 11),
        // The same alarm in the other word, told once.
        (
            lrs1.contains(ExtendedStatus1::MOTOR_THERMAL_ALARM)
                && !eti.contains(ExtendedStatus::MOTOR_THERMAL_ALARM),
            24,
        ),
        (lrs1.contains(ExtendedStatus1::SIGNAL_LOST), 28),
        (lrs1.contains(ExtendedStatus1::DRIVE_THERMAL_ALARM), 30),
    ]
    .into_iter()
    .filter_map(|(present, code)| present.then_some(code))
    .collect();
    if codes.is_empty() && words.eta.contains(StatusWord::ALARM) {
        codes.push(0);
    }
    codes.into_iter().map(|code| Fault::lookup(WARNINGS, code)).collect()
}
