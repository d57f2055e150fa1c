//! What is believed of a drive by a file is watched for as long as it matters: its guards, what 100 % of its setpoint is, and that it is
//! one of its profile at all.

use std::sync::Arc;

use drive_core::{Direction, Drive, Error, ErrorKind, Frequency, State, StopMode, Verdict};
use drive_families::{Family, Options, SetUp};
use drive_profile::{definition, read, shipped};
use drive_testing::{Contract, rig::Rig};

/// REF FREQ of a V20, 40016 (A5E03728167 p. 112): P2000 in hundredths of a hertz, 50 Hz from the factory.
const P2000: u16 = 15;
/// A001 of a WJ200 (B7 p. 342): who gives the frequency, 3 the bus, 1 the analog input.
const A001: u16 = 0x1200;
/// A002 of it: who gives the run command, 3 the bus, 1 the terminals.
const A002: u16 = 0x1201;

fn family(key: &str) -> Family {
    Family::new(definition(&Arc::new(shipped::find(key).expect("it is shipped").clone())))
}

fn rig_of(key: &str, options: Options) -> Rig {
    let family = family(key);
    let open = move |port, slave| family.open_with(port, slave, &options);
    Contract::new(family.capabilities(), open, move || {
        family.machine(SetUp::ForTheBus).expect("it has a twin")
    })
    .rig()
}

fn rig(key: &str) -> Rig {
    rig_of(key, family(key).simulated_options())
}

async fn start_at(rig: &mut Rig, hertz: u16) {
    let given = rig.drive.set_setpoint(Frequency::from_hertz(hertz).into()).await;
    assert!(given.as_ref().err().is_none_or(Error::only_a_start_shows), "{given:?}");
    rig.drive.start(Direction::Forward).await.expect("it starts");
}

/// Somebody changes a setting at the keypad of a motor that runs.
#[tokio::test(start_paused = true)]
async fn a_guard_that_is_broken_while_the_motor_runs_is_found_with_the_next_slow_look_and_says_what() {
    for (register, name) in [(A001, "A001"), (A002, "A002")] {
        let mut rig = rig("wj200");
        start_at(&mut rig, 25).await;
        rig.drive.measurements().await.expect("it answers");
        assert_eq!(rig.drive.unmet(), None, "all is as it has to be");
        assert!(rig.machine.poke(register, 1), "at the keypad");
        rig.drive.measurements().await.expect("it answers");
        let found = rig.drive.unmet().expect("it is told").to_string();
        assert!(found.contains(name) && found.contains("reads 1"), "{found}");
        // Whoever runs it by its command may stop it still.
        rig.drive.stop(StopMode::Ramp).await.expect("it stops");
        rig.until_machine("it stands", |seen| !seen.running).await;
        let refused = rig.drive.start(Direction::Forward).await.expect_err("by the same");
        assert!(refused.kind() == ErrorKind::Refused && refused.to_string().contains(name), "{refused}");
        // Set back, it is as before, and nobody has to wait for the next look.
        assert!(rig.machine.poke(register, 3), "at the keypad");
        start_at(&mut rig, 25).await;
        assert_eq!(rig.drive.unmet(), None);
    }
}

/// 4000h of the main setpoint is P2000, whatever that is.
#[tokio::test(start_paused = true)]
async fn a_v20_turns_as_fast_as_was_asked_whatever_its_p2000_is() {
    for (p2000, hsw) in [(5_000, 8_192), (6_000, 6_827), (10_000, 4_096)] {
        let mut rig = rig_of("v20", Options::default());
        assert!(rig.machine.poke(P2000, p2000));
        start_at(&mut rig, 25).await;
        let status =
            rig.until_machine("it turns at 25 Hz", |seen| seen.output_frequency.abs_diff(2_500) <= 1).await;
        assert_eq!(status.reference, Some(Frequency::from_hertz(25)), "{p2000}");
        assert_eq!(rig.machine.peek(100), Some(hsw), "HSW 40101 of {p2000}");
    }
}

/// One of the two is wrong, and nobody knows which.
#[tokio::test(start_paused = true)]
async fn a_v20_whose_p2000_is_not_what_its_owner_says_is_not_driven_and_is_told_when_it_runs() {
    let mut standing = rig("v20");
    assert!(standing.machine.poke(P2000, 6_000));
    let refused =
        standing.drive.set_setpoint(Frequency::from_hertz(25).into()).await.expect_err("50 Hz were said");
    let said = refused.to_string();
    assert!(said.contains("REF_FREQ reads 60.00 Hz") && said.contains("50.00 Hz"), "{said}");
    let refused = standing.drive.start(Direction::Forward).await.expect_err("50 Hz were said");
    assert_eq!(refused.kind(), ErrorKind::Refused, "{refused}");
    let mut running = rig("v20");
    start_at(&mut running, 25).await;
    assert!(running.machine.poke(P2000, 6_000));
    running.drive.measurements().await.expect("it answers");
    let found = running.drive.unmet().expect("it is told").to_string();
    assert!(found.contains("REF_FREQ reads 60.00 Hz"), "{found}");
}

/// No word of a V20 or G120 has OFF2, OFF3 and an overload at once and nothing else: another maker's drive that has no such register, and
/// answers 0 for it, is none.
#[tokio::test(start_paused = true)]
async fn a_drive_whose_status_word_is_zero_is_no_sinamics_and_its_stop_is_not_confirmed() {
    for (key, mask) in [("v20", "0xA030"), ("g120", "0x2030")] {
        let sinamics = family(key);
        let text = shipped::TEXTS.iter().find(|(name, _)| *name == format!("siemens/{key}")).expect(key).1;
        let alive = format!("mask = {mask}, value = 0x0000, differs = true");
        assert!(text.contains(&alive), "{key}");
        // One whose word is 0 when it is not ready.
        let other = read(&text.replace(&alive, "mask = 0x0001, value = 0x0000")).expect(key);
        let other = Family::new(definition(&Arc::new(other)));
        let options = sinamics.simulated_options();
        let open = move |port, slave| sinamics.open_with(port, slave, &options);
        let machine = move || other.machine(SetUp::ForTheBus).expect("it has a twin");
        let mut rig = Contract::new(sinamics.capabilities(), open, machine).rig();
        for deed in ["panel takes", "motor-supply off"] {
            rig.simulated
                .control(&format!("{key}@5 {deed}"))
                .unwrap_or_else(|error| panic!("{deed}: {error}"));
        }
        assert_eq!(rig.machine.peek(109), Some(0), "ZSW 40110 of {key}");
        // Its bit for who commands is none either: one such word stops no motor that runs.
        let status = rig.drive.status().await.expect("it answers");
        assert_eq!((status.state, status.control), (State::Unknown, None), "{key}");
        let stopped = rig.drive.stop(StopMode::Ramp).await.expect_err("nobody has seen it stop");
        assert_eq!(stopped.kind(), ErrorKind::NotConfirmed, "{key}: {stopped}");
    }
}

/// 0003h of a WJ200 or MX2 is 0 in the initial state, and coil 0010h by the manual's count (0Fh on the wire) says whether the motor runs
/// (WJ200 B7 p. 342): of both, the one that tells of a motor that runs is believed.
#[tokio::test(start_paused = true)]
async fn a_word_of_the_initial_state_stops_no_motor_whose_own_coil_says_that_it_runs() {
    for (key, path) in [("wj200", "hitachi/wj200"), ("mx2", "omron/mx2")] {
        let real = family(key);
        let text = shipped::TEXTS.iter().find(|(name, _)| *name == path).expect(key).1;
        let runs = r#"state = "running", bits = { register = "STATE", mask = 0xFFFF, value = 3"#;
        assert!(text.contains(runs), "{key}");
        // One that tells the initial state while it runs.
        let freed = text.replace("mask = 0xFFFF, value = 0,", "mask = 0xFFFF, value = 10,");
        let odd = read(&freed.replace(runs, &runs.replace("value = 3", "value = 0"))).expect(key);
        let odd = Family::new(definition(&Arc::new(odd)));
        let options = real.simulated_options();
        let open = move |port, slave| real.open_with(port, slave, &options);
        let machine = move || odd.machine(SetUp::ForTheBus).expect("it has a twin");
        let mut rig = Contract::new(real.capabilities(), open, machine).rig();
        start_at(&mut rig, 25).await;
        let status = rig.until_machine("it turns", |seen| seen.output_frequency == 2_500).await;
        assert_eq!(rig.machine.peek(2), Some(0), "0003h of {key}");
        assert_eq!((status.state, status.verdict), (State::Running, Some(Verdict::NotKnown)), "{key}");
    }
}

/// HSW stands as it was written, and is worth another frequency.
#[tokio::test(start_paused = true)]
async fn a_changed_p2000_is_told_beside_a_changed_setpoint_of_which_nobody_knows_which_it_was() {
    let mut rig = rig_of("v20", Options::default());
    start_at(&mut rig, 20).await;
    rig.until_machine("it turns", |seen| seen.output_frequency.abs_diff(2_000) <= 1).await;
    assert!(rig.machine.poke(P2000, 2_500), "at the drive");
    let status =
        rig.until("it is told", |status| matches!(status.verdict, Some(Verdict::NotInForce { .. }))).await;
    let said = format!("{:?}", status.verdict);
    assert!(said.contains("100 %"), "{said}");
}
