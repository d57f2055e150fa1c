//! What is read and never written: the fast and the slow set, faults, the last trip, identity.

use std::time::Duration;

use drive_core::{
    Class, Error, Fault, Faults, Frequency, Identity, Measurements, Percent, Port, Power, RawWord, Result,
    Setpoint, Speed, State, Status,
    registers::{Register, access::Read},
};
use tokio_modbus::prelude::ReadCode;

use crate::{
    Atv21,
    blocks::{self, Blocks, READ_BLOCK, ReadSlot, WriteSlot},
    control::status_word,
    faults::{FAULTS, alarms},
    in_effect::{self, ReadBlock},
    model::{self, ModelEntry},
    registers as map,
    status::{self, FAST_SET},
    words::{
        Alarms, CommandSource, LogicInputs, LogicOutputs, MaintenanceAlarms, ReferenceSource, StatusWord,
        StatusWord2, StatusWord3,
    },
};

/// What a trend wants to see.
pub(crate) const SLOW_SET: [Register<Read>; 15] = [
    map::REFERENCE_BEFORE_RAMP,
    map::OUTPUT_SPEED,
    map::OUTPUT_VOLTAGE,
    map::DC_BUS_VOLTAGE,
    map::TORQUE,
    map::INPUT_POWER,
    map::OUTPUT_POWER,
    map::MOTOR_LOAD,
    map::DRIVE_LOAD,
    map::INPUT_ENERGY,
    map::OUTPUT_ENERGY,
    map::RUNNING_TIME,
    map::POWERED_TIME,
    map::LOGIC_INPUTS,
    map::LOGIC_OUTPUTS,
];

/// The words that §8.3 of the manual remarks as "value before the trip" and that have no address of their own for it.
const FROZEN: [Register<Read>; 11] = [
    map::ESTIMATED_SPEED,
    map::REFERENCE_BEFORE_RAMP,
    map::REFERENCE_AFTER_RAMP,
    map::PID_FEEDBACK,
    map::TORQUE_CURRENT,
    map::EXCITATION_CURRENT,
    map::OUTPUT_VOLTAGE,
    map::INPUT_POWER,
    map::OUTPUT_POWER,
    map::MOTOR_LOAD,
    map::DRIVE_LOAD,
];

const HISTORY: [Register<Read>; 4] =
    [map::PAST_FAULT_1, map::PAST_FAULT_2, map::PAST_FAULT_3, map::PAST_FAULT_4];

/// The drive as it was just before its last trip (Altivar 21 Modbus §8.3, §8.6, §8.8).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LastTrip {
    /// The fault, FE10; `None` when the drive remembers none.
    pub fault: Option<Fault>,
    /// The output frequency, FE00.
    pub output_frequency: Frequency,
    /// The status word, FE01.
    pub status: StatusWord,
    /// The status word 2, FE42.
    pub status_2: StatusWord2,
    /// The status word 3, FE49.
    pub status_3: StatusWord3,
    /// The logic inputs, FE06.
    pub inputs: LogicInputs,
    /// The logic outputs, FE07.
    pub outputs: LogicOutputs,
    /// While the drive is tripped, also the monitored words that the manual remarks as "value before the trip";
    /// empty when it is not, because they show the present then.
    pub frozen: Vec<RawWord>,
}

impl<P: Port> Atv21<P> {
    /// Reads the fast set in any class.
    pub(crate) async fn read_status(&mut self, class: Class) -> Result<Status> {
        self.registers.begin_snapshot();
        let mut words = match self.read_fast_block(class).await? {
            Some(words) => words,
            None => self.read_each(class, &FAST_SET).await?,
        };
        words.extend(self.read_each(class, &[map::COMMAND_SOURCE]).await?);
        if self.watch.shaft.was_braked() && self.registers.is_torn() {
            // FD00 may be of behind a trip that FD01 was too early for: no ramp has brought the motor down then.
            let again = self.read_each(class, &[map::STATUS_WORD]).await?;
            words.retain(|word| word.address != map::STATUS_WORD.address());
            words.extend(again);
        }
        let mut status = Status { at: self.registers.snapshot_time(), ..status::status(words) };
        self.tell(&mut status);
        if status.is_fault() || status.state == State::NotReady {
            // It may be reset and started up anew by somebody else.
            self.forget_blocks();
        }
        Ok(status)
    }

    /// Reads who commands and the status word, and no more than that where it takes more exchanges.
    pub(crate) async fn read_briefly(&mut self) -> Result<Status> {
        if matches!(self.read_block, ReadBlock::Shown(_)) {
            return self.read_status(Class::Command).await;
        }
        self.registers.begin_snapshot();
        let words = self.read_each(Class::Command, &[map::STATUS_WORD, map::COMMAND_SOURCE]).await?;
        let status = Status { at: self.registers.snapshot_time(), ..status::status(words) };
        // A motor that somebody else runs does not stand any more, though its next status may show no output.
        if status_word(&status).contains(StatusWord::RUN) {
            self.watch.shaft.may_turn();
        }
        Ok(status)
    }

    pub(crate) async fn read_measurements(&mut self) -> Result<Measurements> {
        self.registers.begin_snapshot();
        let raw = self.read_each(Class::Background, &SLOW_SET).await?;
        let at = self.registers.snapshot_time();
        // Read last: what was read before a trip counts as from before it, and never the other way round.
        let now =
            StatusWord::from_bits_retain(self.registers.at(Class::Background).read(map::STATUS_WORD).await?);
        let before_trip = now.contains(StatusWord::TRIPPED);
        let word = |register: Register<Read>| {
            let frozen = before_trip && FROZEN.iter().any(|held| held.address() == register.address());
            find(&raw, register.address()).filter(|_| !frozen)
        };
        let hundredths = |register| word(register).map(|word| Percent::from_hundredths(word.into()));
        let percent = |register| word(register).map(|word| Percent::from_hundredths(i32::from(word) * 100));
        let power = |register| word(register).map(|word| Power::from_decawatts(word.into()));
        let hours = |register| word(register).map(|word| Duration::from_secs(u64::from(word) * 3_600));
        let reference = word(map::REFERENCE_BEFORE_RAMP).map(|word| Frequency::from_centihertz(word.into()));
        Ok(Measurements {
            at,
            before_trip,
            reference: reference.map(Setpoint::Frequency),
            speed: word(map::OUTPUT_SPEED).map(|word| Speed::from_rpm(word.into())),
            output_voltage_share: hundredths(map::OUTPUT_VOLTAGE),
            dc_bus_voltage_share: hundredths(map::DC_BUS_VOLTAGE),
            torque: hundredths(map::TORQUE),
            input_power: power(map::INPUT_POWER),
            output_power: power(map::OUTPUT_POWER),
            drive_load: percent(map::DRIVE_LOAD),
            motor_load: percent(map::MOTOR_LOAD),
            input_energy: word(map::INPUT_ENERGY).map(u32::from),
            output_energy: word(map::OUTPUT_ENERGY).map(u32::from),
            running_time: hours(map::RUNNING_TIME),
            powered_time: hours(map::POWERED_TIME),
            inputs: word(map::LOGIC_INPUTS),
            outputs: word(map::LOGIC_OUTPUTS),
            raw,
            ..Measurements::default()
        })
    }

    pub(crate) async fn read_faults(&mut self) -> Result<Faults> {
        let word = self.registers.at(Class::Background).read(map::STATUS_WORD).await?;
        let tripped = StatusWord::from_bits_retain(word).contains(StatusWord::TRIPPED);
        let present = fault(self.fault_code(Class::Background).await?);
        let mut history = Vec::with_capacity(HISTORY.len());
        for register in HISTORY {
            let code = self.optional(Class::Background, register).await?;
            history.extend(code.and_then(fault));
        }
        let alarm = self.optional(Class::Background, map::ALARM_CODE).await?.unwrap_or(0);
        let maintenance = self.optional(Class::Background, map::MAINTENANCE_ALARM).await?.unwrap_or(0);
        let maintenance = MaintenanceAlarms::from_bits_retain(maintenance);
        let warnings = alarms(Alarms::from_bits_retain(alarm), maintenance);
        Ok(Faults { present: present.into_iter().collect(), history, warnings, tripped, reset_allowed: None })
    }

    /// Reads the drive as it was just before its last trip: FE10, FE00, FE01, FE42, FE49, FE06, FE07, and while it is
    /// tripped also the words that it holds still.
    ///
    /// # Errors
    /// As every read.
    pub async fn last_trip(&mut self) -> Result<LastTrip> {
        let mut calls = self.registers.at(Class::Background);
        let mut trip = LastTrip {
            fault: fault(calls.read(map::PAST_FAULT_1).await?),
            output_frequency: Frequency::from_centihertz(
                calls.read(map::TRIP_OUTPUT_FREQUENCY).await?.into(),
            ),
            status: StatusWord::from_bits_retain(calls.read(map::TRIP_STATUS_WORD).await?),
            status_2: StatusWord2::from_bits_retain(calls.read(map::TRIP_STATUS_WORD_2).await?),
            status_3: StatusWord3::from_bits_retain(calls.read(map::TRIP_STATUS_WORD_3).await?),
            inputs: LogicInputs::from_bits_retain(calls.read(map::TRIP_LOGIC_INPUTS).await?),
            outputs: LogicOutputs::from_bits_retain(calls.read(map::TRIP_LOGIC_OUTPUTS).await?),
            frozen: Vec::new(),
        };
        let now = StatusWord::from_bits_retain(calls.read(map::STATUS_WORD).await?);
        if now.contains(StatusWord::TRIPPED) {
            trip.frozen = self.read_each(Class::Background, &FROZEN).await?;
        }
        Ok(trip)
    }

    /// Reads the maintenance alarms, FE79.
    ///
    /// # Errors
    /// As every read.
    pub async fn maintenance(&mut self) -> Result<MaintenanceAlarms> {
        let word = self.registers.at(Class::Background).read(map::MAINTENANCE_ALARM).await?;
        Ok(MaintenanceAlarms::from_bits_retain(word))
    }

    /// Reads who commands the drive, FE45.
    ///
    /// # Errors
    /// As every read.
    pub async fn command_source(&mut self) -> Result<CommandSource> {
        self.registers.at(Class::Status).read(map::COMMAND_SOURCE).await.map(CommandSource::from)
    }

    /// Reads where the reference comes from, FE46: [`ReferenceSource::PresetSpeed`] means that no setpoint counts.
    ///
    /// # Errors
    /// As every read.
    pub async fn reference_source(&mut self) -> Result<ReferenceSource> {
        self.registers.at(Class::Status).read(map::REFERENCE_SOURCE).await.map(ReferenceSource::from)
    }

    /// Reads which model it is, FB05 and FB72; `None` for codes that the manual does not list.
    ///
    /// # Errors
    /// As every read.
    pub async fn model(&mut self) -> Result<Option<&'static ModelEntry>> {
        let [code, class] = self.model_codes(Class::Background).await?;
        Ok(code.zip(class).and_then(|(code, class)| ModelEntry::lookup(code, class)))
    }

    /// Reads how the indirect blocks are set up. What stands there is in effect only if the drive was reset since it
    /// was written.
    ///
    /// # Errors
    /// As every read.
    pub async fn blocks(&mut self) -> Result<Blocks> {
        let class = Class::Background;
        Ok(Blocks { read: self.read_slots(class).await?, write: self.configured_write_slots(class).await? })
    }

    /// What 43/14 says, and FB05 and FB72 where the drive has them.
    pub(crate) async fn read_identity(&mut self) -> Result<Identity> {
        let told = self.registers.at(Class::Background).identification(ReadCode::Basic).await;
        self.named = match &told {
            Err(Error::Exception { .. }) => Some(Identity::default()),
            told => told.as_ref().ok().cloned(),
        };
        let codes = self.model_words(Class::Background).await?;
        let identity = match told {
            Ok(identity) => Identity { codes, ..identity },
            // Its codes tell what it is as well.
            Err(Error::Exception { .. }) if !codes.is_empty() => Identity { codes, ..Identity::default() },
            Err(error) => return Err(error),
        };
        self.kind = Some(model::recognise(&identity));
        Ok(identity)
    }

    /// Asks the drive what it is, by 43/14, and by FB05 and FB72 where that names no reference.
    pub(crate) async fn recognise_itself(&mut self) -> Result<()> {
        let mut identity = self.ask_name().await?;
        self.named = Some(identity.clone());
        if identity.model.is_none() {
            identity.codes = self.model_words(Class::Command).await?;
        }
        self.kind = Some(model::recognise(&identity));
        Ok(())
    }

    /// What it says of itself by 43/14, and nothing where it refuses that.
    pub(crate) async fn ask_name(&mut self) -> Result<Identity> {
        match self.registers.at(Class::Command).identification(ReadCode::Basic).await {
            Err(Error::Exception { .. }) => Ok(Identity::default()),
            told => told,
        }
    }

    async fn model_words(&mut self, class: Class) -> Result<Vec<RawWord>> {
        let raw = |register: Register<Read>, value: Option<u16>| {
            value.map(|value| RawWord { address: register.address(), code: register.row().code, value })
        };
        let [code, model_class] = self.model_codes(class).await?;
        let words = [raw(map::MODEL_CODE, code), raw(map::MODEL_CLASS, model_class)];
        Ok(words.into_iter().flatten().collect())
    }

    /// The present fault in a form for a refusal: FC90, 0 for none.
    pub(crate) async fn fault_code(&mut self, class: Class) -> Result<u16> {
        self.registers.at(class).read(map::FAULT_CODE).await
    }

    /// F875 to F879.
    pub(crate) async fn read_slots(&mut self, class: Class) -> Result<[ReadSlot; 5]> {
        let mut calls = self.registers.at(class);
        let mut slots = [ReadSlot::None; 5];
        for (slot, register) in slots.iter_mut().zip(map::READ_SLOTS_IN_ORDER) {
            *slot = calls.read(register).await?.into();
        }
        Ok(slots)
    }

    /// F870 and F871.
    pub(crate) async fn configured_write_slots(&mut self, class: Class) -> Result<[WriteSlot; 2]> {
        let mut calls = self.registers.at(class);
        let [first, second] = map::WRITE_SLOTS_IN_ORDER;
        Ok([calls.read(first).await?.into(), calls.read(second).await?.into()])
    }

    async fn model_codes(&mut self, class: Class) -> Result<[Option<u16>; 2]> {
        let code = self.optional(class, map::MODEL_CODE).await?;
        Ok([code, self.optional(class, map::MODEL_CLASS).await?])
    }

    /// Reads the fast set from the block, where that is known to hold it; `None` where it is not. A drive that refuses
    /// its block is not asked for it again.
    async fn read_fast_block(&mut self, class: Class) -> Result<Option<Vec<RawWord>>> {
        let ReadBlock::Shown(places) = self.read_block else { return Ok(None) };
        match self.registers.at(class).read_words(READ_BLOCK, blocks::read_count(&places)).await {
            Ok(answer) => Ok(Some(blocks::words(&places, &answer))),
            Err(Error::Exception { meaning, .. }) if in_effect::is_refusal(meaning) => {
                self.read_block = ReadBlock::Unused;
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Reads registers one by one, those left out that this drive does not have.
    async fn read_each(&mut self, class: Class, registers: &[Register<Read>]) -> Result<Vec<RawWord>> {
        let mut words = Vec::with_capacity(registers.len());
        for &register in registers {
            // Every 21 has its status word. Without it nothing is known of the motor: a refusal of it is an error, and no word of zeros,
            // which would say that the output is cut.
            let value = if register.address() == map::STATUS_WORD.address() {
                Some(self.registers.at(class).read(register).await?)
            } else {
                self.optional(class, register).await?
            };
            if let Some(value) = value {
                words.push(RawWord { address: register.address(), code: register.row().code, value });
            }
        }
        Ok(words)
    }
}

fn find(words: &[RawWord], address: u16) -> Option<u16> {
    words.iter().find(|word| word.address == address).map(|word| word.value)
}

/// The fault with this code; 0 is NErr, no fault.
fn fault(code: u16) -> Option<Fault> {
    (code != 0).then(|| Fault::lookup(FAULTS, code))
}
