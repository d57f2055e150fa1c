//! The tables of a family, from a profile: kept once for the life of the program.

use std::time::Duration;

use drive_core::{
    Capabilities, FaultEntry, Quantity, Row, SerialSettings, StopMode, interned,
    registers::{Access, Choice, Confidence, Factory, Form, Place, Range, Storage, Unit},
    serial::CharacterFormat,
};

use crate::{
    format::{self, Action, Byte, ModeName, Register, UnitName},
    ladder::Level,
    profile::Profile,
    written::Written,
};

/// The speeds that are let of a drive whose own are not known: who has it knows them.
const USUAL: &[u32] = &[1_200, 2_400, 4_800, 9_600, 19_200, 38_400, 57_600, 115_200];

/// What a coil or an input can be.
const BIT: &[Choice] = &[Choice::new(0, "off", ""), Choice::new(1, "on", "")];

const MODES: [(ModeName, StopMode); 4] = [
    (ModeName::Ramp, StopMode::Ramp),
    (ModeName::Fast, StopMode::Fast),
    (ModeName::Freewheel, StopMode::Freewheel),
    (ModeName::DcInjection, StopMode::DcInjection),
];

pub(crate) fn mode_name(mode: StopMode) -> ModeName {
    MODES.iter().find(|(_, other)| *other == mode).map_or(ModeName::Ramp, |(name, _)| *name)
}

pub(crate) fn stop_mode(name: ModeName) -> StopMode {
    MODES.iter().find(|(other, _)| *other == name).map_or(StopMode::Ramp, |(_, mode)| *mode)
}

impl Profile {
    /// What a drive of it can do.
    #[must_use]
    pub fn capabilities(&self) -> &'static Capabilities {
        let link = self.file.link.get_ref();
        let least = Capabilities::least(interned::text(self.key()), interned::text(self.name()));
        let functions: Vec<u8> = link.functions.iter().map(|function| *function.get_ref()).collect();
        let formats: Vec<CharacterFormat> = link
            .formats
            .given()
            .into_iter()
            .flatten()
            .filter_map(|format| format.get_ref().parse().ok())
            .collect();
        let speeds = link.speeds.given().filter(|speeds| !speeds.is_empty());
        let (fast, slow) = (self.fast(), self.slow());
        let unit = self.setpoint_unit();
        let status_exchanges = u8::try_from(fast.len()).unwrap_or(u8::MAX);
        let command_exchanges = u8::try_from(self.command().len()).unwrap_or(u8::MAX);
        interned::one(Capabilities {
            functions: interned::list(&functions),
            read_words: link.read_words.given().copied().unwrap_or(1),
            rows: interned::list(&self.rows()),
            write_words: link.write_words.given().copied().unwrap_or(1),
            highest_address: link.highest_address.given().map_or(247, |of| *of.get_ref()),
            speeds: speeds.map_or(USUAL, |speeds| interned::list(speeds)),
            formats: if formats.is_empty() {
                &[CharacterFormat::F8E1, CharacterFormat::F8O1, CharacterFormat::F8N1, CharacterFormat::F8N2]
            } else {
                interned::list(&formats)
            },
            factory: self.factory(speeds, &formats),
            stop_modes: interned::list(&self.stop_modes()),
            speed_setpoint: unit == Some(UnitName::Rpm),
            share_setpoint: unit == Some(UnitName::Percent),
            frequency_step: self.frequency_step(),
            fault_reset: if self.file.reset.given().is_some() { "by the bus" } else { "not by the bus" },
            communication_fault: self.file.faults.communication.given().copied(),
            identification: self.identification(),
            turnaround: Duration::from_millis(link.pause_ms.given().copied().unwrap_or(0).into()),
            status_exchanges,
            status_words: fast.iter().filter(|block| !block.space.is_bit()).map(|block| block.count).sum(),
            statuses_per_turn: if command_exchanges == 0 { 0 } else { super::STATUSES_PER_TURN },
            stop_exchanges: status_exchanges
                .saturating_add(command_exchanges)
                .saturating_mul(3)
                .saturating_add(2),
            // With them the guards and the settings are looked at.
            measurement_exchanges: u8::try_from(slow.len() + self.guards().len() + self.settings().len())
                .unwrap_or(u8::MAX),
            quantities: interned::list(&self.quantities()),
            ..least
        })
    }

    /// The values that its file names.
    fn quantities(&self) -> Vec<Quantity> {
        let see = &self.file.see;
        let named = [
            (Quantity::OutputFrequency, see.output.given().is_some()),
            (Quantity::Current, see.current.given().is_some()),
            (Quantity::Speed, see.speed.given().is_some()),
            (Quantity::OutputVoltage, see.output_voltage.given().is_some()),
            (Quantity::DcBusVoltage, see.dc_bus_voltage.given().is_some()),
        ];
        named.into_iter().filter(|(_, is_named)| *is_named).map(|(quantity, _)| quantity).collect()
    }

    /// What its fault codes mean.
    #[must_use]
    pub fn fault_entries(&self) -> &'static [FaultEntry] {
        let codes = self.file.faults.codes.given().map(|codes| &codes.get_ref().list);
        let entry = |(code, mnemonic, meaning, remedy): &(u16, String, String, String)| {
            FaultEntry::new(*code, interned::text(mnemonic), interned::text(meaning), interned::text(remedy))
        };
        interned::list(&codes.into_iter().flatten().map(entry).collect::<Vec<_>>())
    }

    /// The stops that are done as they are asked for.
    pub(crate) fn stop_modes(&self) -> Vec<StopMode> {
        let has = |(name, mode): &(ModeName, StopMode)| self.file.stop.of(*name).given().map(|_| *mode);
        MODES.iter().filter_map(has).collect()
    }

    /// The stop that is among these values, whole.
    pub(crate) fn stopped_by(&self, written: &[Written]) -> Option<StopMode> {
        let is_it = |stop: &Action| {
            let writes = self.file.writes(stop);
            !writes.is_empty() && writes.iter().all(|one| written.contains(one))
        };
        let has = |(name, mode): &(ModeName, StopMode)| {
            self.file.stop.of(*name).given().filter(|stop| is_it(stop.get_ref())).map(|_| *mode)
        };
        MODES.iter().find_map(has).filter(|_| self.keeps_from(Level::Stop).is_none())
    }

    fn setpoint_unit(&self) -> Option<UnitName> {
        let setpoint = self.file.setpoint.given()?;
        self.file.named(setpoint.get_ref().register.get_ref()).map(|register| register.unit)
    }

    fn frequency_step(&self) -> &'static str {
        let register = self
            .file
            .setpoint
            .given()
            .and_then(|setpoint| self.file.named(setpoint.get_ref().register.get_ref()));
        match register.and_then(|register| Some((register.unit, *register.scale.as_ref()?.get_ref()))) {
            Some((UnitName::Hertz, [1, 10])) => "0.1 Hz",
            Some((UnitName::Hertz, [1, 100])) => "0.01 Hz",
            _ => "as its full scale gives",
        }
    }

    /// The settings with which a line of it is tried first.
    fn factory(&self, speeds: Option<&Vec<u32>>, formats: &[CharacterFormat]) -> SerialSettings {
        let said = self.file.link.get_ref().factory.given().and_then(|said| said.get_ref().parse().ok());
        let speed = speeds.and_then(|speeds| speeds.first().copied()).unwrap_or(19_200);
        let format = formats.first().copied().unwrap_or(CharacterFormat::F8E1);
        let usual = SerialSettings::new(speed, format).unwrap_or(SerialSettings::MODBUS_DEFAULT);
        said.unwrap_or(usual)
    }

    /// Its registers, coils and inputs, but for the second byte of a word: those that are no parameters are only read. Of a byte the
    /// word is shown that it is in, without a unit.
    fn rows(&self) -> Vec<Row> {
        let mut rows: Vec<Row> = Vec::new();
        for (name, spanned) in &self.file.register {
            let register = spanned.get_ref();
            let Some((space, address)) = self.file.place(register) else { continue };
            let place = Place { space, address };
            if rows.iter().all(|row| row.place() != place) {
                rows.push(self.row(name, register, place));
            }
        }
        rows.sort_by_key(Row::place);
        rows
    }

    fn row(&self, name: &str, register: &Register, Place { space, address }: Place) -> Row {
        let sound = crate::source::grade(&self.file, &register.source) == format::Mark::P;
        Row {
            space,
            address,
            code: interned::text(name),
            name: match register.byte {
                None => interned::text(&register.what),
                Some(Byte::High) => interned::text(&format!("{}: the high byte of this word", register.what)),
                Some(Byte::Low) => interned::text(&format!("{}: the low byte of this word", register.what)),
            },
            access: match register.access {
                format::Access::Write => Access::Write,
                format::Access::WriteStopped if register.parameter => Access::WriteStopped,
                format::Access::ReadWrite if register.parameter => Access::ReadWrite,
                _ => Access::Read,
            },
            storage: match register.storage.as_ref().map(|storage| *storage.get_ref()) {
                None | Some(format::Storage::Ram) => Storage::Volatile,
                Some(format::Storage::RamUntilSaved) => Storage::RamUntilSaved,
                Some(format::Storage::Eeprom) => Storage::Eeprom,
                Some(format::Storage::Unknown) => Storage::Unknown,
            },
            unit: if space.is_bit() || register.byte.is_some() { Unit::CODE } else { unit(register) },
            range: match &register.range {
                _ if space.is_bit() => Range::OneOf(BIT),
                Some(range) => {
                    let [low, high] = *range.get_ref();
                    Range::Within(low, high)
                }
                None => Range::Any,
            },
            factory: register
                .factory
                .as_ref()
                .and_then(|factory| factory.given().copied())
                .map_or(Factory::None, Factory::Value),
            confidence: if sound { Confidence::Manual } else { Confidence::Elsewhere },
            source: interned::text(&self.cited(register)),
        }
    }

    /// The documents that a register names.
    fn cited(&self, register: &Register) -> String {
        let cited =
            crate::source::names(register.source.get_ref()).filter_map(|name| self.file.sources.get(name));
        let cited = cited.map(|source| format!("{}, {}", source.get_ref().document, source.get_ref().page));
        cited.collect::<Vec<_>>().join("; ")
    }
}

/// The unit in which a word is shown, where its scale is one of decimals; else its counts.
fn unit(register: &Register) -> Unit {
    let scale = register.scale.as_ref().map(|scale| *scale.get_ref());
    let decimals = match scale {
        Some([1, 1]) => Some(0),
        Some([1, 10]) => Some(1),
        Some([1, 100]) => Some(2),
        Some([1, 1_000]) => Some(3),
        _ => None,
    };
    let unit = match (register.unit, decimals) {
        (UnitName::Bits, _) => Unit::BITS,
        (UnitName::Code, _) => Unit::CODE,
        (name, Some(decimals)) => Unit { form: Form::Number, ..Unit::scaled(name.symbol(), decimals) },
        _ => Unit::COUNT,
    };
    if register.signed { unit.signed() } else { unit }
}
