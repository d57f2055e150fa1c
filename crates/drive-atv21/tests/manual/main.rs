//! The Altivar 21's map a second time, from the text of "Altivar 21 Modbus, guide d'exploitation", 10/2009, and not from
//! the driver, and its printed frames.
//!
//! The text comes from a scan in which the seven-segment 8 of parameter titles reads B (FB29 is F829), and 0 reads D or
//! O. Its misprints are corrected here: the CRC of the accepted block write (43 B3 for 46 B3, §7.8), the CRC of the 80 Hz
//! example (B5 A6 for E1 12, §8.5), the reference mode FE45 for FE46 (§8.6), OL1 as hexadecimal P for D (§8.7), codes with a
//! leading zero (0136 is decimal, §8.9), "Schneider Electric" in 13 bytes for Telemecanique (§7.9).

mod frames;

use std::time::Duration;

use drive_atv21::{
    ALARMS, Alarms, Atv21, Authority, CAPABILITIES, CommandSource, CommandWord, CommandWord2, FAULTS,
    LogicInputs, LogicOutputs, MODELS, MaintenanceAlarms, ModelEntry, ROWS, ReferenceSource, StatusWord,
    StatusWord2, StatusWord3,
    blocks::{ReadSlot, WriteSlot},
};
use drive_core::{
    Drive, Fault, Power, SerialSettings, StopMode,
    registers::{Confidence, Factory, Storage},
};
use drive_testing::{bench, words::Words};

/// §6, §8.2, §8.3: communication number, unit as printed, factory setting where there is one.
const PRINTED: &str = "
    0829 - 1     0800 - 1     0801 - 1     0802 - 1
    0870 - 0     0871 - 0     0875 - 0     0876 - 0     0877 - 0     0878 - 0     0879 - 0
    0803 s 3     0603 - 4
    0000 - 0     0009 0.1s 100
    FA00 - 0     FA20 - 0     FA01 0.01Hz 0             FA13 rpm 0   FA50 - 0     FA51 - 0
    FD01 - .     FD42 - .     FD49 - .     FE01 - .     FE42 - .     FE49 - .     FE45 - .     FE46 - .
    FD00 0.01Hz .             FE00 0.01Hz .             FE90 rpm .   FE16 0.01Hz .
    FE02 0.01Hz .             FE15 0.01Hz .             FE22 0.01Hz .
    FE03 0.01% . FE18 0.01% . FE20 0.01% . FE21 0.01% .
    FE05 0.01% . FE04 0.01% .
    FE29 0.01kW .             FE30 0.01kW .             FE76 - .     FE77 - .
    FE26 1% .    FE27 1% .    FE14 1h .    FE80 1h .
    FD06 - .     FD07 - .     FE06 - .     FE07 - .     FE35 - .     FE36 - .
    FC90 - .     FC91 - .     FE79 - .     FE10 - .     FE11 - .     FE12 - .     FE13 - .
    FB05 - .     FB72 - .";

fn hex(text: &str) -> u16 {
    u16::from_str_radix(text, 16).unwrap()
}

#[test]
fn every_printed_communication_number_is_a_row_with_its_unit_and_factory_setting() {
    let words: Vec<&str> = PRINTED.split_whitespace().collect();
    for entry in words.chunks(3) {
        let &[number, unit, factory] = entry else { panic!("{entry:?}") };
        let address = hex(number);
        let row = ROWS.iter().find(|row| row.address == address).unwrap_or_else(|| panic!("no {number}"));
        let one = row.unit.show(1);
        let expected = match unit {
            "-" => None,
            "s" => Some("1 s"),
            "0.1s" => Some("0.1 s"),
            "0.01Hz" => Some("0.01 Hz"),
            "rpm" => Some("1 rpm"),
            "0.01%" => Some("0.01 %"),
            "0.01kW" => Some("0.01 kW"),
            "1%" => Some("1 %"),
            "1h" => Some("1 h"),
            other => panic!("{other}"),
        };
        assert_eq!(expected.unwrap_or(&one), one, "{number}");
        let written = match factory {
            "." => Factory::None,
            value => Factory::Value(value.parse().unwrap()),
        };
        assert_eq!(row.factory, written, "{number}");
        assert_eq!(row.access.is_writable(), factory != ".", "{number}");
        assert_eq!(row.confidence, Confidence::Manual, "{number}");
        // §8.2: the control parameters are "uniquement dans la RAM et non dans l'EEPROM".
        let ram = number.starts_with('F');
        assert_eq!(row.storage, if ram { Storage::Volatile } else { Storage::Eeprom }, "{number}");
    }
    assert_eq!(words.len() / 3, 15 + 6 + 44);
}

#[test]
fn rows_that_the_manual_does_not_print_say_where_they_are_from() {
    let words: Vec<&str> = PRINTED.split_whitespace().collect();
    let printed: Vec<u16> = words.chunks(3).map(|entry| hex(entry[0])).collect();
    for row in ROWS.iter().filter(|row| !printed.contains(&row.address)) {
        let by_rule = row.source.contains("by the rule of Fnnn");
        assert!(by_rule || row.confidence == Confidence::Elsewhere, "{}", row.code);
        if by_rule {
            assert_eq!(row.code, format!("F{:03X}", row.address), "{}", row.code);
        }
    }
}

#[test]
fn ranges_are_those_of_6_and_8_2() {
    for (number, allowed, refused) in [
        ("0829", 4, 5),
        ("0800", 1, 2),
        ("0801", 2, 3),
        ("0802", 247, 248),
        ("0803", 100, 101),
        ("0603", 2, 3),
        ("0870", 6, 7),
        ("0871", 6, 7),
        ("0875", 11, 12),
        ("0879", 11, 12),
        ("0000", 2, 3),
        ("0009", 32_000, 32_001),
        ("FA13", 24_000, 24_001),
        ("FA50", 255, 256),
        ("FA51", 1_023, 1_024),
    ] {
        let row = ROWS.iter().find(|row| row.address == hex(number)).unwrap();
        assert!(row.range.allows(allowed) && !row.range.allows(refused), "{number}");
    }
}

#[test]
fn what_the_manual_says_of_the_line_is_in_the_capabilities() {
    // §3 and §7.3: functions 3, 6, 16, 43/14. §5.5, §6.1: 9600 or 19200, 1 to 247.
    assert_eq!(CAPABILITIES.functions, [3, 6, 16, 43]);
    assert_eq!((CAPABILITIES.read_words, CAPABILITIES.write_words), (5, 2));
    assert_eq!(CAPABILITIES.speeds, [9_600, 19_200]);
    assert_eq!(CAPABILITIES.highest_address, 247);
    assert_eq!(CAPABILITIES.factory, SerialSettings::MODBUS_DEFAULT);
    let watchdog = CAPABILITIES.watchdog.unwrap();
    assert_eq!((watchdog.min, watchdog.max), (Duration::from_secs(1), Duration::from_secs(100)));
}

/// Checks that bit `n` of a word is the flag that is listed for it, and that nothing else has a name.
macro_rules! assert_bits {
    ($word:ident: $($bit:literal $flag:ident),* $(,)?) => {
        let mut all = 0_u16;
        $(
            assert_eq!($word::$flag.bits(), 1 << $bit, stringify!($flag));
            all |= 1 << $bit;
        )*
        assert_eq!($word::all().bits(), all, stringify!($word));
    };
}

#[test]
fn the_bits_of_every_word_are_those_of_8_4_8_6_8_7_8_8() {
    assert_bits!(CommandWord: 0 PRESET_SPEED_1, 1 PRESET_SPEED_2, 2 PRESET_SPEED_3, 4 MOTOR_2, 5 PID_OFF, 6 RAMP_2,
        7 DC_BRAKING, 9 REVERSE, 10 RUN, 11 FREEWHEEL, 12 EMERGENCY_STOP, 13 FAULT_RESET, 14 REFERENCE_PRIORITY,
        15 COMMAND_PRIORITY);
    assert_bits!(CommandWord2: 1 ENERGY_RESET, 12 STALL_LEVEL_2);
    assert_bits!(StatusWord: 0 FAULT_RELAY, 1 TRIPPED, 2 ALARM, 3 UNDERVOLTAGE, 4 MOTOR_2, 5 PID_OFF, 6 RAMP_2,
        7 DC_BRAKING, 9 REVERSE, 10 RUN, 11 FREEWHEEL, 12 EMERGENCY_STOP, 13 STANDBY_RUN, 14 STANDBY, 15 LOCAL);
    assert_bits!(StatusWord2: 1 ENERGY_RESET, 8 RAMP_2, 12 STALL_LEVEL_2);
    assert_bits!(StatusWord3: 0 RY_HELD, 12 RCH, 13 RCHF);
    assert_bits!(Alarms: 0 OVERCURRENT, 1 DRIVE_OVERLOAD, 2 MOTOR_OVERLOAD, 3 OVERHEAT, 4 OVERVOLTAGE, 5 UNDERVOLTAGE,
        7 UNDERCURRENT, 8 OVERTORQUE, 10 OPERATING_HOURS, 13 UNDERVOLTAGE_RELAY, 14 POWER_LOSS_STOP,
        15 LOWER_LIMIT_STOP);
    assert_bits!(MaintenanceAlarms: 0 FAN, 1 CIRCUIT_BOARD, 2 MAIN_CAPACITOR, 3 USER);
    assert_bits!(LogicInputs: 0 F, 1 R, 2 RES, 7 VIA);
    assert_bits!(LogicOutputs: 0 RY, 2 FL);
    // §8.8: F and RES, RY and FL are both 0005h.
    assert_eq!((LogicInputs::F | LogicInputs::RES).bits(), 0x0005);
    assert_eq!((LogicOutputs::RY | LogicOutputs::FL).bits(), 0x0005);
    // §8.4: 000 to 111 is preset speed 0 to 7.
    for number in 0..=7 {
        assert_eq!(CommandWord::from_bits_retain(0xC400 | number).preset_speed(), number);
    }
    let listed: Vec<u16> = ALARMS.iter().map(|alarm| alarm.code).collect();
    let named = |word: u16| (0..16).filter(move |bit| word & (1 << bit) != 0);
    let maintenance = named(MaintenanceAlarms::all().bits()).map(|bit| 16 + bit);
    let named: Vec<u16> = named(Alarms::all().bits()).chain(maintenance).collect();
    assert_eq!(listed, named);
}

#[test]
fn sources_are_those_of_8_6() {
    use CommandSource as C;
    use ReferenceSource as R;
    assert_eq!([0, 1, 2, 3].map(C::from), [C::Terminals, C::Keypad, C::Serial, C::Unknown(3)]);
    let references = [R::Via, R::Vib, R::Keypad, R::Serial, R::UpDown, R::PresetSpeed];
    assert_eq!([1, 2, 3, 4, 5, 255].map(R::from), references);
    assert_eq!([0, 6].map(R::from), [R::Unknown(0), R::Unknown(6)]);
}

#[test]
fn the_choices_of_the_blocks_are_those_of_6_3() {
    use ReadSlot as R;
    use WriteSlot as W;
    let write = [
        W::None,
        W::CommandWord,
        W::CommandWord2,
        W::FrequencyReference,
        W::LogicOutputs,
        W::AnalogOutput,
        W::SpeedReference,
        W::Unknown(7),
    ];
    assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(W::from), write);
    let read = [
        R::None,
        R::StatusWord,
        R::OutputFrequency,
        R::OutputCurrent,
        R::OutputVoltage,
        R::Alarms,
        R::PidFeedback,
        R::LogicInputs,
        R::LogicOutputs,
        R::AnalogInputVia,
        R::AnalogInputVib,
        R::OutputSpeed,
        R::Unknown(12),
    ];
    assert_eq!([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12].map(R::from), read);
    assert!(write.iter().zip(0..).all(|(slot, number)| slot.number() == number));
    assert!(read.iter().zip(0..).all(|(slot, number)| slot.number() == number));
}

/// §8.7: mnemonic, hexadecimal, decimal.
const FAULT_CODES: &str = "
    OC1 1 1    OC2 2 2    OC3 3 3    OCL 4 4    OCA 5 5    EPHI 8 8   EPHO 9 9   OP1 A 10   OP2 B 11   OP3 C 12
    OL1 D 13   OL2 E 14   OH 10 16   E 11 17    EEP1 12 18 EEP2 13 19 EEP3 14 20 Err2 15 21 Err3 16 22 Err4 17 23
    Err5 18 24 Err7 1A 26 Err8 1B 27 UC 1D 29   UP1 1E 30  Ot 20 32   EF2 22 34  OC1P 25 37 OC2P 26 38 OC3P 27 39
    EtYP 29 41 OH2 2E 46  SOUt 2F 47 E-18 32 50 E-19 33 51 E-20 34 52 E-21 35 53 Etn1 54 84";

#[test]
fn the_fault_codes_are_those_of_8_7() {
    let words: Vec<&str> = FAULT_CODES.split_whitespace().collect();
    for entry in words.chunks(3) {
        let &[mnemonic, hexadecimal, decimal] = entry else { panic!("{entry:?}") };
        let code = decimal.parse().unwrap();
        assert_eq!(hex(hexadecimal), code, "{mnemonic}");
        assert_eq!(Fault::lookup(FAULTS, code).mnemonic(), mnemonic);
    }
    assert_eq!(FAULTS.len(), words.len() / 3);
    assert!(FAULTS.iter().all(|fault| !fault.remedy.is_empty() && !fault.meaning.is_empty()));
}

/// §8.9: the reference without ATV21, kW, code; the three tables one after the other, "-" for the models without a name.
const H_M3X: &str = "- 0.37/0.4 2   H075M3X 0.75 4  HU15M3X 1.5 6   HU22M3X 2.2 7  HU30M3X 3 8    HU40M3X 3.7/4 9
    HU55M3X 5.5 10  HU75M3X 7.5 11  HD11M3X 11 108  HD15M3X 15 109 HD18M3X 18.5 110 HD22M3X 22 111 HD30M3X 30 112";
const H_N4: &str =
    "- 0.4 34        H075N4 0.75 36  HU15N4 1.5 38   HU22N4 2.2 39  HU30N4 3.0 40  HU40N4 3.7/4 41
    HU55N4 5.5 42   HU75N4 7.5 43   HD11N4 11 44    HD15N4 15 45   HD18N4 18.5 46  HD22N4 22 47   HD30N4 30 48
    HD37N4 37 49    HD45N4 45 50    HD55N4 55 51    HD75N4 75 52";
const W_N4: &str = "- 0.4 134       W075N4 0.75 136 WU15N4 1.5 138  WU22N4 2.2 139 WU30N4 3.0 140 WU40N4 3.7/4 141
    WU55N4 5.5 142  WU75N4 7.5 143  WD11N4 11 144   WD15N4 15 145  WD18N4 18.5 146 WD22N4 22 147  WD30N4 30 148
    WD37N4 37 149   WD45N4 45 150   WD55N4 55 151   WD75N4 75 152";

#[test]
fn the_models_are_those_of_8_9() {
    let class_b = W_N4.replace("N4 ", "N4C ");
    let mut known = 0;
    for (table, class) in [(H_M3X, 0x0000), (H_N4, 0x0000), (W_N4, 0xFF7F), (class_b.as_str(), 0x0080)] {
        let words: Vec<&str> = table.split_whitespace().collect();
        for entry in words.chunks(3) {
            let &[reference, power, code] = entry else { panic!("{entry:?}") };
            let model = ModelEntry::lookup(code.parse().unwrap(), class).unwrap();
            let expected = (reference != "-").then(|| format!("ATV21{reference}"));
            assert_eq!(model.reference, expected.as_deref());
            let powers: Vec<_> =
                power.split('/').map(|kw| (kw.parse::<f64>().unwrap() * 100.0) as i32).collect();
            assert_eq!(model.powers().map(Power::decawatts).collect::<Vec<_>>(), powers);
            let two_hundred = reference.ends_with("M3X") || code == "2";
            assert_eq!(model.voltage == drive_atv21::VoltageClass::V200, two_hundred);
            known += 1;
        }
    }
    assert_eq!(MODELS.len(), known);
}

#[test]
fn every_stop_word_is_one_that_8_4_allows() {
    let drive = Atv21::new(Words::new(&CAPABILITIES, &[]), bench::address(1));
    let words = StopMode::ALL.map(|mode| drive.broadcast_stop(mode).map(|write| write.value));
    assert_eq!(words, [Some(0x8000), None, Some(0x8800), Some(0x8080)]);
    // 0000h would give every drive of the line to its terminals.
    let drive = drive.with_authority(Authority::Settings);
    assert_eq!(words, StopMode::ALL.map(|mode| drive.broadcast_stop(mode).map(|write| write.value)));
}
