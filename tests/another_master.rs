//! What the words of another master ask, by each family's manual.

use drive_bus::{Line, LineConfig};
use drive_core::{
    Direction::{Forward, Reverse},
    Drive, Frequency, Intent, Percent, Speed, StopMode,
};
use drive_families::{Family, Options};
use drive_sim::{SimLine, SimSlave, Wiring, models};
use futures_util::FutureExt as _;
use support::drives::{Five, five};

use Intent::{Prepare, QuickStop, ResetFaults, Setpoint, Start, Stop};
use StopMode::{DcInjection, Fast, Freewheel, Ramp};

fn drive(family: Family) -> (SimSlave, Box<dyn Drive>) {
    let settings = family.capabilities().factory;
    let simulated = SimLine::new(Wiring::rtu(settings));
    let machine = match five(family) {
        Five::Atv21 => simulated.add(1, models::atv21::Atv21::new()),
        Five::Atv28 => simulated.add(1, models::atv28::Atv28::new()),
        Five::Atv58 => simulated.add(1, models::atv58::Atv58::new()),
        Five::Atv312 => simulated.add(1, models::atv312::Atv312::new()),
        Five::Omron3g3ev => simulated.add(1, models::drive_3g3ev::Drive3g3ev::new()),
    };
    let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
    let slave = 1.try_into().unwrap();
    (machine.unwrap(), family.open_with(line.slave(1), slave, &Options::default()))
}

fn hertz(centihertz: u32) -> Intent {
    Setpoint(Frequency::from_centihertz(centihertz).into())
}

/// The DRIVECOM table of commands (BBV51701 p. 12) with the bits above it (p. 16 and 19); Altivar 21 Modbus §8.4; 3G3EV
/// §5.1.
#[tokio::test(start_paused = true)]
async fn command_words_are_understood_as_the_manuals_have_them_and_none_needs_an_exchange() {
    let chart = [
        (0x0000, Some(Stop(Freewheel))),
        (0x0002, Some(QuickStop)),
        (0x0006, Some(Prepare(Freewheel))),
        (0x0007, Some(Prepare(Ramp))),
        (0x000F, Some(Start(Forward))),
        (0x080F, Some(Start(Reverse))),
        (0x100F, Some(Stop(Ramp))),
        (0x200F, Some(Stop(DcInjection))),
        (0x400F, Some(Stop(Fast))),
        (0x0080, Some(ResetFaults(Freewheel))),
        (0x0005, Some(Stop(Freewheel))),
        (0x008F, None),
        (0x001F, None),
        (0x800F, None),
    ];
    let atv21 = [
        (0xC400, Some(Start(Forward))),
        (0xC600, Some(Start(Reverse))),
        (0x0400, Some(Start(Forward))),
        (0xC000, Some(Stop(Ramp))),
        (0x0000, Some(Stop(Ramp))),
        (0xC800, Some(Stop(Freewheel))),
        (0xCC00, Some(Stop(Freewheel))),
        (0xD400, Some(Stop(Fast))),
        (0xC480, Some(Stop(DcInjection))),
        (0xE000, Some(ResetFaults(Ramp))),
        (0xC401, None),
        (0xC410, None),
        (0xE400, None),
    ];
    let omron = [
        (0x0001, Some(Start(Forward))),
        (0x0003, Some(Start(Reverse))),
        (0x0000, Some(Stop(Ramp))),
        (0x0002, Some(Stop(Ramp))),
        (0x0011, None),
        (0x0101, None),
    ];
    for (family, registers, words) in [
        (Family::ATV312, &[8_501, 8_601][..], &chart[..]),
        (Family::ATV28, &[400, 601], &chart),
        (Family::ATV58, &[400], &chart),
        (Family::ATV21, &[0xFA00], &atv21),
        (Family::OMRON_3G3EV, &[0x0001], &omron),
    ] {
        let (machine, mut drive) = drive(family);
        for register in registers {
            for (word, intent) in words {
                let told = drive.intent(*register, *word).now_or_never().expect("without an exchange");
                assert_eq!(told.ok().flatten(), *intent, "{family}: {word:04X}h");
            }
        }
        assert_eq!(machine.all_requests(), 0);
    }
}

#[tokio::test(start_paused = true)]
async fn references_are_understood_in_the_unit_that_they_have_in_the_drive() {
    for (family, register, word, setpoint) in [
        (Family::ATV312, 8_502, 305, Some(hertz(3_050))),
        (Family::ATV312, 8_502, 0xFED4, None),
        (Family::ATV312, 8_602, 900, Some(Setpoint(Speed::from_rpm(900).into()))),
        (Family::ATV28, 401, 305, Some(hertz(3_050))),
        (Family::ATV28, 603, 900, Some(Setpoint(Speed::from_rpm(900).into()))),
        (Family::ATV58, 401, 305, Some(hertz(3_050))),
        (Family::ATV21, 0xFA01, 3_005, Some(hertz(3_005))),
        (Family::ATV21, 0xFA13, 900, Some(Setpoint(Speed::from_rpm(900).into()))),
        (Family::OMRON_3G3EV, 0x0002, 305, Some(hertz(3_050))),
    ] {
        let (_machine, mut drive) = drive(family);
        let told = drive.intent(register, word).await;
        assert_eq!(told.ok().flatten(), setpoint, "{family}: {register} = {word}");
    }
    // CMI bit 9: 32767 counts for 600 Hz (BBV51701 p. 20).
    let (machine, mut drive) = drive(Family::ATV312);
    assert!(machine.poke(8_504, 1 << 9));
    assert_eq!(drive.intent(8_502, 1_638).await.unwrap(), Some(hertz(2_999)));
    // n39 = 2: 30000 counts are 100 % (3G3EV §2.1).
    let (machine, mut drive) = self::drive(Family::OMRON_3G3EV);
    assert!(machine.poke(0x0127, 2));
    assert_eq!(drive.intent(0x0002, 3_000).await.unwrap(), Some(Setpoint(Percent::from_percent(10).into())));
}

/// Saving, locking, factory settings, PI references, outputs.
#[tokio::test(start_paused = true)]
async fn registers_that_act_behind_the_rules_are_nobodys_and_parameters_are_no_commands() {
    for (family, kept, parameter) in [
        (Family::ATV312, &[8_503, 8_504, 8_001, 8_002][..], 9_001),
        (Family::ATV28, &[402, 440], 252),
        (Family::ATV58, &[402], 250),
        (Family::ATV21, &[0xFA20], 0x0009),
        (Family::OMRON_3G3EV, &[0x0009, 0x0900], 0x0114),
    ] {
        let (_machine, mut drive) = drive(family);
        for register in kept {
            assert!(drive.intent(*register, 2).await.is_err(), "{family}: {register}");
        }
        assert_eq!(drive.intent(parameter, 2).await, Ok(None), "{family}");
    }
}
