//! The Altivar 28's map a second time, from the texts and not from the driver: the RS485 kit's manual (VVDED399092,
//! 1999-11) and the table "Replacing an ATV28 with an ATV312" (BBV51701 06/2009, p. 57).

use drive_atv28::{Atv28, CAPABILITIES, FAULTS, ROWS, WARNINGS, words};
use drive_bus::Line;
use drive_core::{
    Class, Drive, Error, ExceptionMeaning, Fault, Registers, Row, State, StopMode, registers::Confidence,
    serial::CharacterFormat,
};
use drive_sim::models;
use drive_testing::{
    bench::address as slave,
    frames::{self, OtherEnd, Printed},
    words::Words,
};

/// A line whose other end is played by the script. The manual prints no CRC: they are computed.
fn scripted(script: &[Printed<'_>]) -> (Line, OtherEnd) {
    frames::scripted(CAPABILITIES.factory, script)
}

/// Column by column as p. 57 prints it: ATV28 address, new address, code.
const PAGE_57: &str = "
    2 3003 COd     4 4434 CrL3    5 4444 CrH3    6 11101 tCC   10 6001 Add    40 3015 bFr    51 3102 SFr
    52 3103 tFr    53 9602 FrS    55 9601 UnS    60 3107 nrd   61 9607 UFt    64 9003 brA    65 9011 Frt
    110 5002 r2    151 9611 OPL   152 7002 IPL   155 3110 FLr  190 7007 drn   250 3104 HSP   251 3105 LSP
    252 9001 ACC   253 9002 dEC   258 9622 ItH   260 9012 AC2  261 9013 dE2   262 11111 JGF  264 11410 SP2
    265 11411 SP3
    266 11412 SP4  267 11413 SP5  268 11414 SP6  269 11415 SP7 270 11210 IdC  272 11701 tLS  279 11941 rPG
    280 11942 rIG  281 11903 FbS  282 11001 Ctd  283 11002 ttd 284 11003 Ftd  286 11301 JPF  287 11940 PIC
    340 64001 rOt  400 8501 CMD   401 8502 LFR   402 8504 CMI  440 11920 rPI  450 3203 FrH   451 3202 rFr
    453 3204 LCr   454 3207 ULn   455 9630 tHr   456 3209 tHd  457 7121 LFt   458 3201 ETA   459 3206 ETI
    460 - ETI2
    462 7201 DP1   464 7202 DP2   466 7203 DP3   468 7204 DP4  478 5240 IOLR  482 5261 AO1R  487 3205 Otr
    491 3211 OPr   530 3231 rtH   555 3017 INV   600 8606 ERRD 601 8601 CMDD  602 8603 ETAD  603 8602 LFRD
    604 8605 FRHD  605 8604 RFRD  606 8607 SMIL  607 8608 SMIL 608 8609 SMAL  609 8610 SMAL  610 8611 SPAL
    611 8612 SPAL  612 8613 SPAT  613 8614 SPDL  614 8615 SPDL 615 8616 SPDT  991 64003 LCC";

#[test]
fn every_register_of_page_57_is_a_row_with_its_mnemonic_and_its_twin() {
    let words: Vec<&str> = PAGE_57.split_whitespace().collect();
    let mut known = 0;
    for line in words.chunks(3) {
        let &[address, twin, code] = line else { panic!("{line:?}") };
        let address: u16 = address.parse().unwrap();
        let row =
            ROWS.iter().find(|row| row.address == address).unwrap_or_else(|| panic!("no row {address}"));
        // The second word of a double word needs a mnemonic of its own to be found by it; `LFR` is `LFr` on p. 19.
        let same = row.code.eq_ignore_ascii_case(code) || row.code.strip_suffix('h') == Some(code);
        assert!(same, "{address}: {} instead of {code}", row.code);
        if twin != "-" {
            assert!(row.source.contains(&format!("twin W{twin}")), "{address}: {}", row.source);
        }
        known += 1;
    }
    assert_eq!(known, 85);
    // The kit's manual reads one word that p. 57 leaves out.
    assert_eq!(ROWS.len(), known + 1);
    assert!(ROWS.iter().any(|row| row.address == 452 && row.confidence == Confidence::Manual));
}

#[test]
fn what_the_kits_manual_prints_itself_is_marked_so() {
    let printed: Vec<u16> =
        ROWS.iter().filter(|row| row.confidence == Confidence::Manual).map(|row| row.address).collect();
    assert_eq!(printed, [400, 401, 452]);
}

#[test]
fn monitored_words_cannot_be_written_and_commands_can() {
    // Twins, BBV51701: p. 16 to 18 and 19 R/W, p. 21 to 24 R, IOLR and AO1R written where not assigned (p. 20, 23).
    let row = |address: u16| ROWS.iter().find(|row| row.address == address).unwrap();
    let writable = |row: &Row| row.access.is_writable();
    for address in (450..=460).chain([462, 464, 466, 468, 487, 491, 530, 555, 600, 602, 604, 605]) {
        assert!(!writable(row(address)), "{address}");
    }
    for address in [400, 401, 402, 440, 478, 482, 601, 603].into_iter().chain(606..=615) {
        assert!(writable(row(address)), "{address}");
    }
    // R/WS of the twins: written only with the motor stopped.
    for address in [4, 5, 6, 40, 52, 53, 55, 60, 61, 64, 65, 110, 151, 152, 155, 190, 282, 283, 284, 340, 991]
    {
        assert_eq!(row(address).access.to_string(), "R/WS", "{address}");
    }
}

#[test]
fn units_are_those_of_the_twins() {
    let show = |address: u16, word| ROWS.iter().find(|row| row.address == address).unwrap().show(word);
    assert_eq!(show(401, 200), "20.0 Hz");
    assert_eq!(show(401, (-200_i16).cast_unsigned()), "-20.0 Hz");
    assert_eq!(show(451, (-500_i16).cast_unsigned()), "-50.0 Hz");
    assert_eq!(show(450, 500), "50.0 Hz");
    assert_eq!(show(453, 42), "4.2 A");
    assert_eq!(show(454, 4_003), "400.3 V");
    assert_eq!(show(455, 118), "118 %");
    assert_eq!(show(603, (-1_500_i16).cast_unsigned()), "-1500 rpm");
    assert_eq!(show(530, 12), "12 h");
    assert_eq!(show(440, 1_000), "100.0 %");
    // Not confirmed for the Altivar 28: raw.
    for ramp in [252, 253, 260, 261] {
        assert_eq!(show(ramp, 30), "30");
    }
    assert_eq!(show(457, 9), "9 OCF (overcurrent)");
}

#[test]
fn functions_limits_addresses_and_characters_are_those_of_the_kits_manual() {
    // "Fonctions Modbus": 03 seven words, 06, 16 seven words. "Format d'échange": 9600 or 19200, no parity, 8 bits, one
    // stop bit. "Principe": addresses 1 to 31.
    assert_eq!(CAPABILITIES.functions, [3, 6, 16]);
    assert_eq!((CAPABILITIES.read_words, CAPABILITIES.write_words), (7, 7));
    assert_eq!(CAPABILITIES.speeds, [9_600, 19_200]);
    assert_eq!(CAPABILITIES.formats, [CharacterFormat::F8N1]);
    assert_eq!(CAPABILITIES.highest_address, 31);
    assert_eq!(CAPABILITIES.watchdog, None);
}

#[tokio::test(start_paused = true)]
async fn the_sample_of_function_03_is_what_a_status_sends_first() {
    // "Exemple : lecture des mots W450 à W456 de l'esclave 2". The answer's byte count is printed as 14, which is
    // decimal: 0Eh.
    let (line, other_end) = scripted(&[
        ("02 03 01C2 0007", "02 03 0E 01F4 FE0C 1234 002A 0FA3 0037 0028"),
        ("02 03 01C9 0004", "02 03 08 0000 8627 4010 0000"),
        // Whether it runs or comes down, CMD tells.
        ("02 03 0190 0002", "02 03 04 080F 0000"),
    ]);
    let mut drive = Atv28::new(line.slave(2), slave(2));
    let status = drive.status().await.unwrap();
    assert_eq!(status.output_frequency.unwrap().centihertz(), 5_000);
    assert_eq!(status.current.unwrap().deciamperes(), 42);
    assert_eq!(status.raw(452), Some(0x1234));
    assert_eq!(status.state, State::Running);
    assert_eq!(status.to_string(), "running, reverse, 50.00 Hz, 4.2 A, at reference, control: bus");
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_sample_of_function_16_is_what_the_register_access_sends() {
    // "Exemple : écriture des valeurs 15 et 200 dans les mots W400 et W401 de l'esclave 2".
    let (line, other_end) = scripted(&[("02 10 0190 0002 04 000F 00C8", "02 10 0190 0002")]);
    let mut registers =
        Registers::new(line.slave(2), slave(2), &CAPABILITIES, |_, _| drive_core::ExceptionMeaning::Unknown);
    registers.at(Class::Command).write_words(400, &[15, 200]).await.unwrap();
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn function_06_is_laid_out_as_the_table_says() {
    // "Ecriture d'un mot de sortie : fonction 6": the answer repeats the question. CMD = 0 is a freewheel stop.
    let (line, other_end) = scripted(&[
        ("05 06 0190 0000", "05 06 0190 0000"),
        ("05 03 01C2 0007", "05 03 0E 0000 0000 0000 0000 0000 0000 0000"),
        ("05 03 01C9 0004", "05 03 08 0000 0240 4002 0000"),
    ]);
    let mut drive = Atv28::new(line.slave(5), slave(5));
    assert_eq!(drive.stop(StopMode::Freewheel).await.unwrap().status.state, State::Disabled);
    other_end.is_done().await;
}

#[tokio::test(start_paused = true)]
async fn the_simulated_drive_answers_as_the_frames_of_the_manual_say() {
    let script = [
        // "Lecture de N mots de sortie", the sample, its byte count in hexadecimal.
        ("02 03 01C2 0007", "02 03 0E xxxx xxxx xxxx xxxx xxxx xxxx xxxx"),
        // "Ecriture d'un mot de sortie", the layout.
        ("02 06 0191 00C8", "02 06 0191 00C8"),
        // "Ecriture de N mots de sortie", the sample.
        ("02 10 0190 0002 04 000F 00C8", "02 10 0190 0002"),
        ("02 03 0190 0002", "02 03 04 000F 00C8"),
        // "Diffusion générale": never an answer.
        ("00 06 0190 0000", ""),
        ("02 03 0190 0001", "02 03 02 0000"),
        // "Réponses d'exception": no such function, no such word, too many words, a value that is not permitted.
        ("02 04 01C2 0001", "02 84 01"),
        ("02 03 0064 0001", "02 83 02"),
        ("02 03 01C2 0008", "02 83 03"),
        ("02 10 01C2 0008 10 0000 0000 0000 0000 0000 0000 0000 0000", "02 90 03"),
        ("02 06 000A 0020", "02 86 03"),
    ];
    frames::answered(CAPABILITIES.factory, 2, models::atv28::Atv28::new(), &script).await;
}

#[tokio::test(start_paused = true)]
async fn each_exception_has_its_meaning() {
    // "Réponses d'exception", codes 1 to 4; the answer's function is the question's + 80h.
    let meanings = [
        ("01", ExceptionMeaning::NoSuchFunction, false),
        ("02", ExceptionMeaning::NoSuchRegister, false),
        ("03", ExceptionMeaning::ValueRefused, false),
        ("04", ExceptionMeaning::Failed, true),
        ("09", ExceptionMeaning::Unknown, false),
    ];
    for (code, expected, retry) in meanings {
        let (line, other_end) = scripted(&[("01 03 01CA 0001", &format!("01 83 {code}"))]);
        let error = Atv28::new(line.slave(1), slave(1)).keep_alive().await.unwrap_err();
        other_end.is_done().await;
        let Error::Exception { meaning, .. } = error else { panic!("{error}") };
        assert_eq!((meaning, meaning.is_worth_a_retry()), (expected, retry));
    }
}

#[tokio::test(start_paused = true)]
async fn more_words_than_the_manual_allows_are_never_sent() {
    let (line, other_end) = scripted(&[]);
    let mut registers =
        Registers::new(line.slave(1), slave(1), &CAPABILITIES, |_, _| ExceptionMeaning::Unknown);
    let mut calls = registers.at(Class::Background);
    assert!(matches!(calls.read_words(450, 8).await, Err(Error::TooManyWords { limit: 7, .. })));
    assert!(matches!(calls.write_words(264, &[0; 8]).await, Err(Error::TooManyWords { limit: 7, .. })));
    other_end.is_done().await;
}

/// BBV51701 p. 24, W7121, code and mnemonic.
const LFT: &str =
    "3 CFF 4 CFI 5 SLF 6 ILF 8 EPF 9 OCF 10 CrF 13 LFF 16 OHF 17 OLF 18 ObF 19 OSF 20 OPF 21 PHF 22 USF
    23 OCF 24 SOF 25 tnF 26 IF1 27 IF2 28 IF3 29 IF4 30 EEF 31 OCF 32 SCF 33 OPF 55 SCF";

#[test]
fn the_fault_codes_are_those_of_page_24_without_what_an_altivar_28_does_not_have() {
    let words: Vec<&str> = LFT.split_whitespace().collect();
    let printed: Vec<(u16, &str)> = words.chunks(2).map(|pair| (pair[0].parse().unwrap(), pair[1])).collect();
    let coded: Vec<(u16, &str)> = FAULTS.iter().map(|entry| (entry.code, entry.mnemonic)).collect();
    assert_eq!(coded, printed);
    // 7 and 34 need an option card, 35 access level L2, 36 an ATV312HD15.
    for code in [7, 34, 35, 36] {
        assert_eq!(Fault::lookup(FAULTS, code).entry, None);
    }
    let row = ROWS.iter().find(|row| row.code == "LFt").unwrap();
    for (code, mnemonic) in printed {
        assert_eq!(row.range.choices().iter().find(|choice| choice.value == code).unwrap().code, mnemonic);
    }
}

#[test]
fn the_bits_are_those_of_the_twins() {
    use words::{ControlWord as Cmd, ExtendedStatus as Eti, LogicIo, StatusWord as Eta};
    // CMD, p. 19.
    assert_eq!(Cmd::from_bits_retain(0x080F) - Cmd::from_bits_retain(0x000F), Cmd::REVERSE);
    assert_eq!(Cmd::STOP.bits(), 0x1000);
    assert_eq!(Cmd::DC_INJECTION.bits(), 0x2000);
    assert_eq!(Cmd::FAST_STOP.bits(), 0x4000);
    assert_eq!(Cmd::FAULT_RESET.bits(), 0x0080);
    // ETA, p. 21.
    let eta = [
        (0, Eta::READY),
        (1, Eta::SWITCHED_ON),
        (2, Eta::OPERATION_ENABLED),
        (3, Eta::FAULT),
        (4, Eta::VOLTAGE_DISABLED),
        (5, Eta::NO_QUICK_STOP),
        (6, Eta::SWITCH_ON_DISABLED),
        (7, Eta::ALARM),
        (9, Eta::NOT_FORCED_LOCAL),
        (10, Eta::REFERENCE_REACHED),
        (11, Eta::REFERENCE_EXCEEDED),
        (14, Eta::STOP_KEY),
        (15, Eta::REVERSE),
    ];
    for (bit, flag) in eta {
        assert_eq!(flag.bits(), 1 << bit);
    }
    // ETI, p. 22.
    let eti = [
        (0, Eti::EEPROM_BUSY),
        (1, Eti::CONSISTENCY_CHECK),
        (2, Eti::RESET_AUTHORISED),
        (4, Eti::MOTOR_RUNNING),
        (5, Eti::DC_INJECTION),
        (6, Eti::TRANSIENT),
        (7, Eti::MOTOR_THERMAL_ALARM),
        (8, Eti::BRAKING_ALARM),
        (9, Eti::ACCELERATING),
        (10, Eti::DECELERATING),
        (11, Eti::CURRENT_LIMIT),
        (12, Eti::FAST_STOP),
        (15, Eti::REVERSE_REQUESTED),
    ];
    for (bit, flag) in eti {
        assert_eq!(flag.bits(), 1 << bit);
    }
    assert_eq!(WARNINGS.iter().map(|entry| entry.code).collect::<Vec<_>>(), [7, 8, 11]);
    // IOLR, p. 23.
    assert_eq!(LogicIo::INPUTS.bits(), 0x003F);
    assert_eq!(LogicIo::OUTPUTS.bits(), 0x0700);
}

#[tokio::test]
async fn every_status_word_is_decoded_and_the_named_states_come_out_as_the_table_says() {
    // BBV51701 p. 10 and 21, ETA under the mask 006Fh. ETI = 4002h: the bus commands, the motor stands.
    for eta in 0..=u16::MAX {
        let words = [(457, 0x11), (458, eta), (459, 0x4002), (460, 0xFFFF)];
        let status = Atv28::new(Words::new(&CAPABILITIES, &words), slave(1)).status().await.unwrap();
        let expected = match eta & 0x006F {
            0x00 | 0x20 => State::NotReady,
            0x40 | 0x60 | 0x21 => State::Disabled,
            0x23 | 0x27 => State::Ready,
            0x07 => State::QuickStop,
            0x08 | 0x28 => State::Fault,
            0x0F | 0x2F => State::FaultReaction,
            _ => State::Unknown,
        };
        assert_eq!(status.state, expected, "{eta:04X}h");
        assert_eq!(status.fault_code, status.is_fault().then_some(0x11), "{eta:04X}h");
        assert_eq!(status.raw(458), Some(eta));
    }
}
