//! What every family promises of itself, through `dyn Drive`: whatever the drive says, nothing panics and only what its
//! manual allows is written; what is claimed can be done, and what is not claimed is `Unsupported`.

use std::time::Duration;

use drive_core::{
    Class, Direction, Drive, Error, ErrorKind, ExceptionMeaning, Frequency, Reaction, Registers, Setpoint,
    Speed, State, StopMode,
};
use drive_families::Family;
use drive_testing::{babble::Babble, bench::address, words::Words};
use support::{drives, rig::Rig};

/// The control word of a family, and every value of it that the driver can send.
struct Control {
    register: u16,
    words: &'static [u16],
    /// Words of the family that are plausible somewhere, so that commands are carried through and not only refused.
    plausible: &'static [u16],
}

/// The words of the chart, and 080Fh, reverse (BBV51701 p. 12, 19; VVDED397054 p. 21/45).
const fn control(family: Family) -> Control {
    /// `ETA` of the chart's states, `ETI` with the bus in control, 0 and small numbers.
    const CHART: &[u16] = &[0x0240, 0x0221, 0x0223, 0x0227, 0x0227, 0x4000, 0, 0, 0, 1, 2, 0x0008];
    match family {
        // Guide d'exploitation §8.4: the priorities with run, reverse, freewheel, DC braking, fault reset; 0 to release.
        Family::Atv21 => Control {
            register: 0xFA00,
            words: &[0x0000, 0xC000, 0xC080, 0xC400, 0xC600, 0xC800, 0xE000],
            plausible: &[0x4000, 0x4000, 0x4000, 0x6400, 0x6600, 2, 2, 2, 4, 4, 4, 0, 0, 1, 8_000],
        },
        Family::Atv28 => Control {
            register: 400,
            words: &[0x0000, 0x0006, 0x0007, 0x000F, 0x0080, 0x080F, 0x100F, 0x200F, 0x400F],
            plausible: CHART,
        },
        Family::Atv58 => Control {
            register: 400,
            words: &[0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x0080, 0x080F],
            plausible: CHART,
        },
        Family::Atv312 => Control {
            register: 8501,
            words: &[0x0000, 0x0002, 0x0006, 0x0007, 0x000F, 0x0080, 0x080F, 0x100F, 0x200F, 0x400F],
            plausible: CHART,
        },
        // §5.1: run, reverse, and a pulse of the inputs of n06 to n08.
        Family::Omron3g3ev => Control {
            register: 0x0001,
            words: &[0x0000, 0x0001, 0x0003, 0x0010, 0x0020, 0x0040],
            plausible: &[0x0004, 0x0005, 0x0142, 0x0041, 0x0065, 0, 0, 0, 1, 5, drives::RESET_FUNCTION],
        },
    }
}

/// Everything that a user can ask of a drive.
async fn ask_everything(family: Family, drive: &mut dyn Drive) {
    let _ = drive.status().await;
    let _ = drive.measurements().await;
    let _ = drive.faults().await;
    let _ = drive.identify().await;
    let _ = drive.keep_alive().await;
    let _ = drive.set_setpoint(Setpoint::Frequency(Frequency::from_hertz(25))).await;
    let _ = drive.set_setpoint(Setpoint::Speed(Speed::from_rpm(100))).await;
    for direction in [Direction::Forward, Direction::Reverse] {
        let _ = drive.start(direction).await;
    }
    for mode in StopMode::ALL {
        let _ = drive.stop(mode).await;
    }
    let _ = drive.reset_faults().await;
    let _ = drive.watchdog().await;
    let _ = drive.arm_watchdog(Duration::from_secs(2), Reaction::Ramp).await;
    let _ = drive.release().await;
    // The register of the control word among them: it is no parameter.
    let control = family.capabilities().rows.iter().filter(|row| row.address == control(family).register);
    for row in control.chain(family.capabilities().rows.iter().step_by(7)) {
        let _ = drive.read_parameter(row).await;
        let _ = drive.write_parameter(row, 1).await;
    }
    let _ = drive.persist().await;
}

#[tokio::test(start_paused = true)]
async fn whatever_a_drive_says_nothing_panics_and_only_control_words_of_its_manual_are_written() {
    for family in Family::ALL {
        let Control { register, words, plausible } = control(family);
        let mut used = vec![false; words.len()];
        for seed in 0..1_000 {
            let port = Babble::new(family.capabilities(), plausible, seed);
            let mut drive = drives::drive(family, port.clone(), address(1));
            ask_everything(family, drive.as_mut()).await;
            for written in port.written(register) {
                // Bits that belong to others are kept as they were read; no run command, edge or reserved bit is among them.
                let own = match family {
                    Family::Atv21 if written & 0x3508 == 0 => 0xCAF7,
                    Family::Atv21 | Family::Omron3g3ev => 0x0070,
                    Family::Atv312 => 0xF800,
                    _ => 0,
                };
                let index = words.iter().position(|&word| word == written);
                let index = index.or_else(|| words.iter().position(|&word| word == written & !own));
                used[index.unwrap_or_else(|| panic!("{family}: {written:04X}h was written"))] = true;
            }
        }
        // No Altivar 312 whose settings are any words is started: one of them always decides something instead.
        let started =
            |word: u16| family == Family::Atv312 && [0x0006, 0x0007, 0x000F, 0x080F].contains(&word);
        let unused = words.iter().zip(used).filter(|&(&word, used)| !used && !started(word));
        let unused: Vec<_> = unused.collect();
        assert_eq!(unused, [], "{family}: each of them is in use");
    }
}

/// The status word, and what else a drive holds that stands ready at zero speed under the bus.
const fn standing(family: Family) -> (u16, &'static [(u16, u16)]) {
    match family {
        Family::Atv21 => (0xFD01, &[(0x0003, 2), (0x0004, 4)]),
        Family::Atv28 | Family::Atv58 => (458, &[(459, 0x4002)]),
        Family::Atv312 => (3201, &[(3206, 0x4002)]),
        Family::Omron3g3ev => (0x002C, &[(0x0020, 0x0004), (0x0102, 5)]),
    }
}

#[tokio::test]
async fn every_status_word_is_decoded_and_kept_and_says_a_state_that_fits_its_own_words() {
    for family in Family::ALL {
        let (register, others) = standing(family);
        for word in 0..=u16::MAX {
            let mut words = Words::new(family.capabilities(), others);
            words.words.insert(register, word);
            let status = drives::drive(family, words, address(1)).status().await.expect("it answers");
            assert_eq!(status.raw(register), Some(word), "{family}");
            let tripped = match family {
                Family::Atv21 => word & 0x0002 != 0,
                // Bit E, "major fault, incl. communication" (§5.2).
                Family::Omron3g3ev => word & 0x4000 != 0,
                Family::Atv28 | Family::Atv58 | Family::Atv312 => {
                    matches!(word & 0x006F, 0x0008 | 0x0028 | 0x000F | 0x002F)
                }
            };
            assert_eq!(status.is_fault(), tripped, "{family}: {word:04X}h is {}", status.state);
        }
    }
}

#[tokio::test]
async fn a_request_beyond_the_words_of_a_family_is_never_sent() {
    for family in Family::ALL {
        let capabilities = family.capabilities();
        let unsent = |_, _| ExceptionMeaning::Unknown;
        let mut registers = Registers::new(Words::new(capabilities, &[]), address(1), capabilities, unsent);
        let mut calls = registers.at(Class::Background);
        let (read, written) = (capabilities.read_words + 1, capabilities.write_words + 1);
        let errors = [
            calls.read_words(0, read).await.expect_err("too many"),
            calls.read_words(0, 0).await.expect_err("none"),
            calls.write_words(0, &vec![0; usize::from(written)]).await.expect_err("too many"),
            calls.write_words(0, &[]).await.expect_err("none"),
        ];
        for error in errors {
            assert!(matches!(error, Error::TooManyWords { .. }), "{family}: {error}");
        }
        assert_eq!(registers.into_port().asked, [], "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn each_exception_has_the_meaning_that_its_manual_gives() {
    use ExceptionMeaning::{
        Accepted, Busy, Failed, NoSuchFunction, NoSuchRegister, NotNow, Unknown, ValueRefused,
    };
    for family in Family::ALL {
        let listed: &[(u8, ExceptionMeaning)] = match family {
            Family::Atv21 => &[(1, NoSuchFunction), (2, NoSuchRegister), (3, ValueRefused), (4, NotNow)],
            // Their manuals list 1 to 4 as the Modbus specification has them; 5 and 6 are the specification's.
            Family::Atv28 | Family::Atv58 | Family::Atv312 => &[
                (1, NoSuchFunction),
                (2, NoSuchRegister),
                (3, ValueRefused),
                (4, Failed),
                (5, Accepted),
                (6, Busy),
            ],
            Family::Omron3g3ev => &[
                (1, NoSuchFunction),
                (2, NoSuchRegister),
                (3, ValueRefused),
                (0x21, ValueRefused),
                (0x22, NotNow),
            ],
        };
        let row = family.capabilities().rows.iter().find(|row| row.access.is_readable()).expect("it has one");
        for code in 1..=u8::MAX {
            let mut words = Words::new(family.capabilities(), &[]);
            words.refused.insert(row.address, code);
            let error = drives::drive(family, words, address(1)).read_parameter(row).await;
            let Err(Error::Exception { code: told, meaning, .. }) = error else { panic!("{error:?}") };
            let expected =
                listed.iter().find(|(listed, _)| *listed == code).map_or(Unknown, |(_, means)| *means);
            assert_eq!((told, meaning), (code, expected), "{family}");
            // Only what the drive began and could not complete, or is too busy for, may succeed by itself.
            let retry = matches!(expected, Failed | Busy);
            assert_eq!(meaning.is_worth_a_retry(), retry, "{family}: {code:02X}h");
        }
    }
}

/// Whether an attempt was `Unsupported`; any other outcome shows that the family has it.
fn is_unsupported<T>(outcome: Result<T, Error>) -> bool {
    outcome.is_err_and(|error| error.kind() == ErrorKind::Unsupported)
}

#[tokio::test(start_paused = true)]
async fn what_a_family_claims_it_does_and_what_it_does_not_claim_is_unsupported() {
    for family in Family::ALL {
        let mut rig = Rig::new(family);
        let claims = rig.drive.capabilities();
        rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect("every family takes hertz");
        let by_speed = rig.drive.set_setpoint(Speed::from_rpm(900).into()).await;
        assert_eq!(is_unsupported(by_speed), !claims.speed_setpoint, "{family}: a setpoint in rpm");
        // The card of the Altivar 58 says it over UNI-TELWAY only.
        let says = claims.identification.is_some() && family != Family::Atv58;
        assert_eq!(is_unsupported(rig.drive.identify().await), !says, "{family}");
        assert_eq!(is_unsupported(rig.drive.persist().await), claims.persist.is_none(), "{family}: saving");
        for mode in StopMode::ALL {
            let lacks = !claims.stop_modes.contains(&mode);
            match rig.drive.stop(mode).await {
                Ok(stopped) => {
                    assert!(!lacks || stopped.mode != mode, "{family}: a stop by {mode}");
                    assert_eq!(stopped.instead.is_some(), stopped.mode != mode, "{family}: {stopped}");
                }
                Err(error) => assert!(lacks && error.kind() == ErrorKind::Unsupported, "{family}: {error}"),
            }
            let write = rig.drive.broadcast_stop(mode);
            assert_eq!(write.is_some(), claims.broadcast_stops.contains(&mode), "{family}: {mode} to all");
            assert!(write.is_none_or(|write| claims.functions.contains(&write.function)), "{family}");
        }
        rig.drive.stop(StopMode::Ramp).await.expect("every family has a ramp");
        rig.until_standstill().await;
        assert_eq!(
            is_unsupported(rig.drive.release().await),
            !claims.release,
            "{family}: giving control back"
        );
        let received = rig.machine.received();
        let functions = received.iter().filter_map(|request| request.pdu.first());
        for function in functions {
            let asks_what_it_is = family == Family::Atv58 && *function == 0x2B;
            let claimed = claims.functions.contains(function) || asks_what_it_is;
            assert!(claimed, "{family}: function {function:02X}h");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn the_watchdog_that_a_family_claims_is_the_one_that_it_has() {
    const EVERY: [Reaction; 6] = [
        Reaction::Ignore,
        Reaction::Freewheel,
        Reaction::Ramp,
        Reaction::Fast,
        Reaction::DcInjection,
        Reaction::Trip,
    ];
    for family in Family::ALL {
        let mut rig = Rig::new(family);
        let Some(claims) = rig.drive.capabilities().watchdog else {
            assert!(is_unsupported(rig.drive.watchdog().await), "{family}");
            assert!(is_unsupported(rig.drive.arm_watchdog(Duration::from_secs(2), Reaction::Ramp).await));
            continue;
        };
        rig.drive.watchdog().await.expect("it is known");
        for reaction in EVERY {
            let lacks = is_unsupported(rig.drive.arm_watchdog(claims.max, reaction).await);
            assert_eq!(lacks, !claims.reactions.contains(&reaction), "{family}: {reaction}");
        }
        let Some(reaction) = claims.reactions.iter().copied().find(|reaction| *reaction != Reaction::Ignore)
        else {
            continue;
        };
        for timeout in [claims.max + claims.step, claims.min / 2] {
            let error = rig.drive.arm_watchdog(timeout, reaction).await.expect_err("it cannot keep it");
            assert!(matches!(error, Error::WatchdogTime { .. }), "{family}: {error}");
        }
        for timeout in [claims.min, claims.max] {
            let armed = rig.drive.arm_watchdog(timeout, reaction).await.expect("it can keep it");
            assert_eq!((armed.timeout, armed.reaction), (Some(timeout), Some(reaction)), "{family}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_family_has_a_history_of_faults_if_it_claims_one() {
    for family in Family::ALL {
        let mut rig = Rig::new(family);
        let length = usize::from(rig.drive.capabilities().fault_history);
        for _ in 0..length + 2 {
            rig.machine.trip(drives::a_trip(family));
            drives::reset(family, &mut rig.drive).await;
            rig.until("no fault", |status| !status.is_fault()).await;
        }
        let faults = rig.drive.faults().await.expect("it tells its faults");
        assert_eq!(faults.history.len(), length, "{family}");
        assert_eq!(faults.present, [], "{family}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_stands_or_runs_takes_as_many_exchanges_as_are_claimed() {
    for family in Family::ALL {
        let mut rig = Rig::new(family);
        let claims = rig.drive.capabilities();
        let claimed = (u64::from(claims.status_exchanges), u64::from(claims.measurement_exchanges));
        // Settings that are read once, some of them behind a status.
        let status = rig.drive.status().await.expect("it answers");
        rig.drive.self_restarts().await.expect("it tells them");
        assert_ne!(status.state, State::Unknown, "{family}");
        rig.drive.measurements().await.expect("it measures");
        assert_eq!(exchanges(&mut rig).await, claimed, "{family} stands: of a status, of the measurements");
        rig.drive.set_setpoint(Frequency::from_hertz(25).into()).await.expect("it takes 25 Hz");
        rig.drive.start(Direction::Forward).await.expect("it starts");
        rig.until_at(Frequency::from_hertz(25)).await;
        // What only a turning motor shows is looked for once.
        rig.drive.measurements().await.expect("it measures");
        assert_eq!(exchanges(&mut rig).await, claimed, "{family} runs: of a status, of the measurements");
    }
}

/// Exchanges of one status and of the measurements.
async fn exchanges(rig: &mut Rig) -> (u64, u64) {
    let before = rig.machine.all_requests();
    rig.drive.status().await.expect("it answers");
    let between = rig.machine.all_requests();
    rig.drive.measurements().await.expect("it measures");
    (between - before, rig.machine.all_requests() - between)
}
