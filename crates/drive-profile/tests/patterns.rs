//! Patterns of control that few drives have: the setpoint as the run command, a watchdog that a command word feeds, function 23. And what a
//! start by a file has to be seen by.

use std::{sync::Arc, time::Duration};

use drive_core::{Direction, Drive, Error, ErrorKind, Frequency, Port, State, StopMode, Verdict};
use drive_families::{Family, Options, SetUp};
use drive_profile::{Level, Owner, Profile, ProfileDrive, definition, read, shipped};
use drive_sim::Panel;
use drive_testing::{Contract, rig::Rig};
use tokio::time::{Instant, sleep};

const SIGNED: &str = include_str!("data/signed.toml");
const DIRECTIONS: &str = include_str!("data/directions.toml");
const SPLIT: &str = include_str!("data/split.toml");
const ABB: &str = include_str!("data/abb.toml");

/// Where the drive of `signed.toml` takes its setpoint.
const SPEED: u16 = 0x000E;
/// Where a Danfoss takes its control word, and its words: FC 102 Design Guide p. 144-146.
const CTW: u16 = 49_999;
const STOP: u16 = 0x043C;

fn profile(text: &str) -> Profile {
    read(text).unwrap_or_else(|refusals| panic!("{refusals}"))
}

fn rig(profile: Profile) -> Rig {
    let family = Family::new(definition(&Arc::new(profile)));
    let options = family.simulated_options();
    let open = move |port, slave| family.open_with(port, slave, &options);
    Contract::new(family.capabilities(), open, move || {
        family.machine(SetUp::ForTheBus).expect("it has a twin")
    })
    .rig()
}

/// The words that were written to a register since then, function 06, 10h or 17h with one word, in their order.
fn written_since(rig: &Rig, register: u16, since: Instant) -> Vec<u16> {
    let words = rig.machine.received_since(since).into_iter().filter_map(|request| {
        let (at, word) = match request.pdu[..] {
            [0x06, a, b, c, d] | [0x10, a, b, _, _, _, c, d] | [0x17, _, _, _, _, a, b, _, _, _, c, d] => {
                (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]))
            }
            _ => return None,
        };
        (at == register).then_some(word)
    });
    words.collect()
}

/// The same while the drive is polled for a time: the machine remembers its last requests alone.
async fn written_while(rig: &mut Rig, register: u16, time: Duration) -> Vec<u16> {
    const SLICE: Duration = Duration::from_millis(500);
    let (until, mut words) = (Instant::now() + time, Vec::new());
    while Instant::now() < until {
        let since = Instant::now();
        rig.poll_for(SLICE).await;
        words.extend(written_since(rig, register, since));
        // The next slice begins behind this one's last request.
        sleep(Duration::from_millis(1)).await;
    }
    words
}

/// Each pattern of control, with the profiles that have it, and how their drives are turned round where they do not say. Every profile that is
/// shipped at motion is among them.
const PATTERNS: [(&str, &str, Turned); 14] = [
    ("code", "goodrive", Turned::Round),
    ("bits", "danfoss-fc", Turned::Round),
    ("bits", "vfs15", Turned::Round),
    ("bits", "ig5a", Turned::Round),
    ("CiA 402", "atv312", Turned::Round),
    ("CiA 402", "altivar", Turned::NotKnown),
    ("PROFIdrive", "v20", Turned::Round),
    ("PROFIdrive", "g120", Turned::Round),
    ("ABB", "abb", Turned::NotKnown),
    ("coils", "wj200", Turned::Round),
    ("coils", "mx2", Turned::Round),
    ("coils of directions", "directions", Turned::Round),
    ("split registers", "split", Turned::Round),
    ("setpoint is the command", "signed", Turned::Round),
];

/// The second column of the README's table.
#[test]
fn the_readme_names_the_twins_of_each_pattern() {
    let readme = include_str!("../README.md");
    let rows =
        readme.split("| Pattern |").nth(1).and_then(|rest| rest.split("\n\n").next()).expect("there is one");
    let rows: Vec<Vec<&str>> = rows
        .lines()
        .skip(2)
        .map(|row| row.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>())
        .collect();
    let mut patterns: Vec<&str> = PATTERNS.iter().map(|(pattern, ..)| *pattern).collect();
    patterns.dedup();
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), patterns);
    for row in rows {
        let of_it = PATTERNS.iter().filter(|(pattern, ..)| *pattern == row[0]);
        let named: Vec<String> = of_it
            .map(|(_, key, turned)| match turned {
                Turned::Round => format!("`{key}`"),
                Turned::NotKnown => format!("`{key}` (not reversed)"),
            })
            .collect();
        assert_eq!(row[1], named.join(", "), "{}", row[0]);
    }
    for profile in shipped::all().iter().filter(|profile| profile.level() == Level::Motion) {
        assert!(
            PATTERNS.iter().any(|(_, key, _)| *key == profile.key()),
            "{} is in no pattern",
            profile.key()
        );
    }
}

#[derive(Debug, PartialEq)]
enum Turned {
    Round,
    /// Its profile does not say how: it is `Unsupported`.
    NotKnown,
}

/// Started, turned round, stopped, tripped, reset and lost, each status held against the shaft of its twin. On slaves of another hand
/// `tests/profile_strangers.rs` of the workspace does the same.
#[tokio::test(start_paused = true)]
async fn each_pattern_of_control_is_lived_through_each_act() {
    for (pattern, key, turned) in PATTERNS {
        let profile = match key {
            "atv312" => profile(include_str!("../../../tests/profiles/atv312.toml")),
            "abb" => profile(ABB),
            "directions" => profile(DIRECTIONS),
            "split" => profile(SPLIT),
            "signed" => profile(SIGNED),
            key => shipped::find(key).expect("it is shipped").clone(),
        };
        assert_eq!(profile.level(), Level::Motion, "{key}");
        let mut rig = rig(profile);
        rig.drive.status().await.expect("it answers");
        let given = rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await;
        assert!(given.as_ref().err().is_none_or(Error::only_a_start_shows), "{key}: {given:?}");
        let run = async |rig: &mut Rig, direction, output: i32| {
            rig.drive.start(direction).await.unwrap_or_else(|error| panic!("{key} {direction}: {error}"));
            rig.until_machine("its setpoint", |seen| seen.output_frequency.abs_diff(output) < 2).await;
        };
        run(&mut rig, Direction::Forward, 3_000).await;
        if turned == Turned::Round {
            run(&mut rig, Direction::Reverse, -3_000).await;
        } else {
            let refused = rig.drive.start(Direction::Reverse).await.expect_err("nobody knows how");
            assert_eq!(refused.kind(), ErrorKind::Unsupported, "{key}: {refused}");
        }
        let stopped = rig.drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        assert_eq!((stopped.mode, rig.drive.lease()), (StopMode::Ramp, None), "{key}");
        rig.until_machine("it stands", |seen| !seen.running && seen.shaft_frequency == 0).await;
        run(&mut rig, Direction::Forward, 3_000).await;
        rig.machine.trip(9);
        rig.until("the trip", |status| status.state == State::Fault).await;
        rig.drive.start(Direction::Forward).await.expect_err("it has tripped");
        rig.until_machine("it stands", |seen| seen.shaft_frequency == 0).await;
        rig.drive.reset_faults().await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.poll_for(Duration::from_secs(3)).await;
        assert!(!rig.machine.observe().running, "{key}: a reset is no start");
        run(&mut rig, Direction::Forward, 3_000).await;
        rig.machine.mute();
        let lost = rig.drive.status().await.expect_err("nobody answers");
        assert_eq!(lost.kind(), ErrorKind::NoAnswer, "{key}");
        rig.machine.unmute();
        rig.drive.forget();
        sleep(Duration::from_secs(12)).await;
        rig.poll_for(Duration::from_secs(2)).await;
        assert!(
            rig.drive.lease().is_some() && rig.machine.observe().running,
            "{key}: it runs on by what stands"
        );
        rig.drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.until_machine("it stands", |seen| !seen.running && seen.shaft_frequency == 0).await;
        println!("{pattern} ({key}): started, reversed ({turned:?}), stopped, tripped, reset, lost");
    }
}

/// Modbus Application Protocol V1.1b3, 6.11: both coils in one write, the first lowest. The command that reads back is both of them, so that
/// a run command of somebody else is told from this side's, and a stop from both.
#[tokio::test(start_paused = true)]
async fn a_run_coil_for_each_direction_is_written_with_the_other_and_both_are_read_back() {
    let profile = profile(DIRECTIONS);
    assert_eq!(profile.level(), Level::Motion, "{:#?}", profile.gaps());
    let mut rig = rig(profile);
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect("it takes it");
    let coils_since = |rig: &Rig, since| -> Vec<Vec<u8>> {
        let all = rig.machine.received_since(since).into_iter().map(|request| request.pdu.to_vec());
        all.filter(|pdu| matches!(pdu[0], 0x05 | 0x0F)).collect()
    };
    let other = drive_core::registers::Place { space: drive_core::registers::Space::Coil, address: 2 };
    for (direction, byte, output) in [(Direction::Forward, 0b01, 3_000), (Direction::Reverse, 0b10, -3_000)] {
        sleep(Duration::from_millis(1)).await;
        let began = Instant::now();
        rig.drive.start(direction).await.unwrap_or_else(|error| panic!("{direction}: {error}"));
        assert_eq!(coils_since(&rig, began), [vec![0x0F, 0, 1, 0, 2, 1, byte]], "{direction}");
        rig.until_machine("its setpoint", |seen| seen.output_frequency == output).await;
        let status = rig.drive.status().await.expect("it answers");
        assert_eq!((status.direction, status.verdict), (Some(direction), Some(Verdict::InForce)));
    }
    sleep(Duration::from_millis(1)).await;
    let began = Instant::now();
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    assert_eq!(coils_since(&rig, began)[0], [0x0F, 0, 1, 0, 2, 1, 0]);
    rig.until_machine("it stands", |seen| !seen.running && seen.shaft_frequency == 0).await;

    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.written_by_another_at(other, 1).expect("another master wants it in reverse");
    rig.poll_for(Duration::from_secs(2)).await;
    let status = rig.drive.status().await.expect("it answers");
    assert_eq!(
        rig.drive.lease(),
        None,
        "both coils are on: no run command of this side, {:?}",
        status.verdict
    );
}

/// Started, turned round, stopped, tripped, reset and lost. Its setpoint goes out with a start, and to a motor that runs by it; never else.
#[tokio::test(start_paused = true)]
async fn a_setpoint_that_is_the_run_command_is_kept_until_a_start() {
    let profile = profile(SIGNED);
    assert_eq!(profile.level(), Level::Motion, "{:#?}", profile.gaps());
    let mut rig = rig(profile);
    let refused = rig.drive.start(Direction::Forward).await.expect_err("no setpoint was given");
    assert_eq!(refused.kind(), ErrorKind::Refused, "{refused}");
    let kept = rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect_err("nothing shows it");
    assert!(matches!(kept, Error::NotConfirmed { .. }) && kept.to_string().contains("run command"), "{kept}");
    let words = written_while(&mut rig, SPEED, Duration::from_secs(2)).await;
    assert!(words.is_empty() && !rig.machine.observe().running, "nothing was asked for: {words:?}");

    let began = Instant::now();
    let started = rig.drive.start(Direction::Forward).await.expect("it starts");
    assert_eq!((started.state, written_since(&rig, SPEED, began)), (State::Running, vec![300]));
    rig.until_machine("it is at its setpoint", |machine| machine.output_frequency == 3_000).await;
    assert_eq!(rig.drive.status().await.expect("it answers").verdict, Some(Verdict::InForce));
    rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect("the motor runs by it");
    rig.until_machine("it follows", |machine| machine.output_frequency == 2_000).await;
    assert_eq!(rig.drive.status().await.expect("it answers").verdict, Some(Verdict::InForce));

    rig.drive.start(Direction::Reverse).await.expect("it is turned round");
    rig.until_machine("it turns round", |machine| machine.output_frequency == -2_000).await;
    let status = rig.drive.status().await.expect("it answers");
    assert_eq!((status.direction, status.verdict), (Some(Direction::Reverse), Some(Verdict::InForce)));

    sleep(Duration::from_millis(1)).await;
    let began = Instant::now();
    let stopped = rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    assert_eq!((stopped.mode, rig.drive.lease()), (StopMode::Ramp, None));
    assert_eq!(written_since(&rig, SPEED, began), [0]);
    rig.until_machine("it stands", |machine| machine.shaft_frequency == 0).await;
    rig.drive.set_setpoint(Frequency::from_hertz(10).into()).await.expect_err("it is kept");
    rig.poll_for(Duration::from_secs(2)).await;
    assert!(!rig.machine.observe().running, "a setpoint is no start");

    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.trip(1);
    rig.until("the trip", |status| status.state == State::Fault).await;
    sleep(Duration::from_millis(1)).await;
    let began = Instant::now();
    let refused = rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect_err("it has tripped");
    assert_eq!(
        (refused.kind(), written_since(&rig, SPEED, began)),
        (ErrorKind::Refused, vec![]),
        "{refused}"
    );
    rig.drive.reset_faults().await.expect("it is reset");
    rig.poll_for(Duration::from_secs(2)).await;
    assert!(!rig.machine.observe().running, "a reset is no start");

    rig.drive.start(Direction::Forward).await.expect("what was kept is kept");
    rig.machine.mute();
    rig.drive.status().await.expect_err("nobody answers");
    rig.machine.power_cycle();
    rig.machine.unmute();
    rig.drive.forget();
    sleep(Duration::from_millis(1)).await;
    let mut words = written_while(&mut rig, SPEED, Duration::from_secs(3)).await;
    let began = Instant::now();
    let refused = rig.drive.start(Direction::Forward).await.expect_err("another drive may be there");
    words.extend(written_since(&rig, SPEED, began));
    assert_eq!((refused.kind(), words), (ErrorKind::Refused, vec![]), "{refused}");
    assert!(!rig.machine.observe().running);
}

/// FA00 is a word of bits (E6581913 p. 25-26; the Altivar 21's manual 8.2): 13 resets, whatever 9, the direction, is. Bit 7 of a control
/// word likewise (FC 102 Design Guide p. 144). A code is one whole.
#[tokio::test(start_paused = true)]
async fn a_reset_by_a_bit_is_obeyed_whatever_the_direction_bit_says_and_one_by_a_code_is_not() {
    for (key, register, word, resets) in [
        ("vfs15", 0xFA00, 0xE200, true),
        ("vfs15", 0xFA00, 0xC200, false),
        ("danfoss-fc", CTW, 0x84BC, true),
        ("goodrive", 0x2000, 0x0207, false),
    ] {
        let rig = rig(shipped::find(key).expect("it is shipped").clone());
        rig.machine.trip(9);
        rig.machine.written_by_another(register, word).expect("it takes it");
        let seen = rig.machine.observe();
        assert_eq!((seen.trip.is_none(), seen.running), (resets, false), "{key} {word:04X}h");
    }
}

/// 5305 chooses between two meanings of the same words (ACS355 p. 313), and 0004 of an iG5A lets nothing be written at 0 (p. 11-3): somebody
/// changes it at the panel of the twin, behind a lost line or while everything answers, and no start goes out any more.
#[tokio::test(start_paused = true)]
async fn a_guard_that_is_broken_at_the_twins_panel_lets_no_start_through() {
    let ig5a = shipped::find("ig5a").expect("it is shipped").clone();
    let guarded = [(profile(ABB), 5_304, 1), (ig5a, 3, 0)];
    for ((profile, register, word), is_lost) in
        guarded.into_iter().flat_map(|it| [(it.clone(), true), (it, false)])
    {
        let key = profile.key().to_owned();
        let mut rig = rig(profile);
        let given = rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await;
        assert!(given.as_ref().err().is_none_or(Error::only_a_start_shows), "{key}: {given:?}");
        assert!(rig.machine.poke(register, word), "{key}");
        if is_lost {
            rig.drive.forget();
        }
        let refused = rig.drive.start(Direction::Forward).await.expect_err("its words mean something else");
        assert_eq!(refused.kind(), ErrorKind::Refused, "{key} {is_lost}: {refused}");
        let cause =
            if key == "ig5a" { "its write enable lets a stop through (ENABLE reads 0)" } else { "reads 1" };
        let setpoint =
            rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect_err("it is not taken");
        for refused in [refused, setpoint] {
            assert!(refused.kind() == ErrorKind::Refused && refused.to_string().contains(cause), "{refused}");
        }
        assert!(!rig.machine.observe().running, "{key}");
    }
}

/// A start that will be refused is told so before its setpoint is given: the motor runs by a command that this side has not given.
#[tokio::test(start_paused = true)]
async fn a_start_that_would_be_refused_is_known_before_anything_is_written() {
    let mut rig = rig(shipped::find("goodrive").expect("it is shipped").clone());
    rig.machine.written_by_another(0x2001, 2_000).expect("20 Hz by the bus");
    rig.machine.written_by_another(0x2000, 1).expect("a run command");
    rig.until_machine("it runs", |seen| seen.output_frequency == 2_000).await;
    let before = rig.machine.requests(6);
    let refused = rig.drive.may_start(Direction::Forward, None).await.expect_err("another has started it");
    assert_eq!(refused.kind(), ErrorKind::Refused, "{refused}");
    assert_eq!(rig.machine.requests(6), before, "nothing is written to ask that");
    rig.machine.written_by_another(0x2000, 5).expect("a stop");
    rig.until_machine("it stands", |seen| !seen.running && seen.shaft_frequency == 0).await;
    rig.drive.may_start(Direction::Forward, None).await.expect("nothing speaks against it");
}

/// A setpoint goes only to a motor that runs by this side's command where it is the run command: none is offered as the way out.
#[tokio::test(start_paused = true)]
async fn a_motor_of_another_whose_setpoint_is_its_run_command_is_refused_a_start_without_the_way_of_a_setpoint()
 {
    let mut rig = rig(profile(SIGNED));
    rig.machine.written_by_another(SPEED, 2_000).expect("20 Hz by another master");
    rig.until_machine("it runs", |seen| seen.running).await;
    let kept =
        rig.drive.set_setpoint(Frequency::from_hertz(5).into()).await.expect_err("only a start shows it");
    assert!(kept.only_a_start_shows(), "{kept}");
    let refused = rig.drive.start(Direction::Forward).await.expect_err("another has started it").to_string();
    assert!(refused.contains("stop the motor first") && !refused.contains("a setpoint alone"), "{refused}");
}

/// 0012h of a VF-S15 is UL, the upper limit, and 3104 of an Altivar HSP, both in a register that somebody may lower while the motor runs.
#[tokio::test(start_paused = true)]
async fn a_limit_below_the_setpoint_is_refused_before_it_is_given_and_told_of_a_motor_that_runs() {
    for (key, register, per_hertz) in [("vfs15", 0x0012, 100), ("altivar", 3104, 10)] {
        let mut rig = rig(shipped::find(key).expect("it is shipped").clone());
        let hertz = |hertz: u16| Frequency::from_hertz(hertz).into();
        assert!(rig.machine.poke(register, 25 * per_hertz), "{key}");
        let above = rig.drive.set_setpoint(hertz(40)).await.expect_err("it is above the limit");
        assert!(above.to_string().contains("the drive allows 0.00 Hz to 25.00 Hz"), "{key}: {above}");
        assert!(rig.machine.poke(register, 50 * per_hertz), "{key}");
        let given = rig.drive.set_setpoint(hertz(40)).await;
        assert!(given.as_ref().err().is_none_or(Error::only_a_start_shows), "{key}: {given:?}");
        rig.drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.drive.measurements().await.expect("they are read");
        assert_eq!(rig.drive.unmet(), None, "{key}");

        assert!(rig.machine.poke(register, 25 * per_hertz), "{key}");
        rig.drive.measurements().await.expect("they are read");
        let told = rig.drive.unmet().expect("somebody has lowered it").to_string();
        assert!(
            told.contains("no faster than 25.00 Hz") && told.contains("its setpoint is 40.00 Hz"),
            "{key}: {told}"
        );
        rig.drive.set_setpoint(hertz(20)).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.drive.measurements().await.expect("they are read");
        assert_eq!(rig.drive.unmet(), None, "{key}: a lower one is below it");
    }
}

/// FA01h holds the setpoint of the bus, and any master can write it (E6581913 p. 25-26).
#[tokio::test(start_paused = true)]
async fn another_masters_setpoint_is_told_of_a_vf_s15() {
    let mut rig = rig(shipped::find("vfs15").expect("it is shipped").clone());
    let given = rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await;
    assert!(given.as_ref().err().is_none_or(Error::only_a_start_shows), "{given:?}");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.written_by_another(0xFA01, 4_500).expect("45 Hz");
    let status =
        rig.until("it is told", |status| matches!(status.verdict, Some(Verdict::NotInForce { .. }))).await;
    assert!(
        format!("{:?}", status.verdict).contains("another setpoint than was given"),
        "{:?}",
        status.verdict
    );
}

/// An Altivar that its terminals run holds its chart where it was: 23h, "switched on" (ATV312 BBV51701 p. 22 has another word for what turns).
/// The motor of this machine shows its run bit to nobody.
#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_steadily_by_its_terminals_while_its_word_says_ready_is_told_running_and_not_started()
 {
    let blind = SPLIT
        .replace("mask = 0x0001, value = 0x0001", "mask = 0x0010, value = 0x0010")
        .replace("mask = 0x0001, value = 0x0000", "mask = 0x0010, value = 0x0000");
    // Of who commands it tells nothing.
    let owner = |text: &str, key: &str, mask: &str| {
        let known = format!(
            "{key} = {{ bits = {{ register = \"STATUS\", mask = {mask}, value = {mask}, source = \"made\" }}, proves = \"bus\" }}"
        );
        assert_eq!(text.matches(&known).count(), 1, "{known}");
        text.replace(&known, &format!("{key} = \"unknown\""))
    };
    let blind = owner(&owner(&blind, "command", "0x0200"), "reference", "0x0100");
    let mut rig = rig_of(SPLIT, &blind);
    rig.drive.status().await.expect("it answers");
    rig.machine.panel(Panel::TakeControl);
    rig.machine.panel(Panel::Reference(Frequency::from_hertz(20)));
    rig.machine.panel(Panel::Run);
    rig.until_machine("it runs", |seen| seen.output_frequency == 2_000).await;
    rig.poll_for(Duration::from_secs(4)).await;
    let status = rig.drive.status().await.expect("it answers");
    assert_eq!((status.state, status.motion), (State::Running, drive_core::Motion::Driven));
    sleep(Duration::from_millis(1)).await;
    let began = Instant::now();
    let refused = rig.drive.start(Direction::Forward).await.expect_err("it runs by another's command");
    assert_eq!(
        (refused.kind(), written_since(&rig, 0x091B, began)),
        (ErrorKind::Refused, vec![]),
        "{refused}"
    );
    // A stop by the bus does not stop it, and is not told to have.
    let stop = rig.drive.stop(StopMode::Ramp).await.expect_err("it turns on");
    assert_eq!(stop.kind(), ErrorKind::NotConfirmed, "{stop}");
    rig.machine.panel(Panel::Stop);
    let stands =
        rig.until("its output is gone", |status| status.output_frequency == Some(Frequency::ZERO)).await;
    assert_eq!(stands.state, State::Ready);
}

/// What its owner says holds below what the drive tells, and no higher.
#[tokio::test(start_paused = true)]
async fn an_owners_highest_holds_where_the_drive_tells_more() {
    let family = Family::new(definition(&Arc::new(shipped::find("vfs15").expect("it is shipped").clone())));
    let profile = Arc::new(shipped::find("vfs15").expect("it is shipped").clone());
    let owner = Owner::default().with_highest(Frequency::from_hertz(30));
    let open = move |port, slave| -> Box<dyn Drive> {
        Box::new(ProfileDrive::<Box<dyn Port>>::new(port, slave, profile.clone(), owner))
    };
    let mut rig = Contract::new(family.capabilities(), open, move || {
        family.machine(SetUp::ForTheBus).expect("it has a twin")
    })
    .rig();
    let error =
        rig.drive.set_setpoint(Frequency::from_hertz(40).into()).await.expect_err("its owner allows less");
    assert!(error.to_string().contains("its owner allows 0.00 Hz to 30.00 Hz"), "{error}");
    assert!(rig.machine.poke(0x0012, 2_000));
    let error =
        rig.drive.set_setpoint(Frequency::from_hertz(25).into()).await.expect_err("the drive allows less");
    assert!(error.to_string().contains("the drive allows 0.00 Hz to 20.00 Hz"), "{error}");
}

const SPACES: &str = include_str!("data/spaces.toml");

/// By the lines of text that `drived sim` reads: a coil, an input and an input register of one address with a holding register.
#[tokio::test(start_paused = true)]
async fn what_stands_in_each_of_the_four_spaces_is_shown_and_set_beside_the_line() {
    let line = drive_sim::SimLine::default();
    let family = Family::new(definition(&Arc::new(profile(SPACES))));
    line.add_boxed(3, family.machine(SetUp::ForTheBus).expect("it has a twin")).expect("3 is free");
    let said = |words: &str| line.control(&format!("spaces@3 {words}")).map_err(|error| error.to_string());
    for (place, name, value, shown) in [
        ("coil 512", "BRAKE", "on", "1 on"),
        ("discrete input 512", "DOOR", "1", "1 on"),
        ("input register 512", "SUPPLY", "325.0", "325.0 V"),
        ("512", "ACC", "4.5", "4.5 s"),
    ] {
        assert_eq!(said(&format!("set {place} {value}")).as_deref(), Ok("done"), "{place}");
        for place in [place, name] {
            assert_eq!(said(&format!("get {place}")).as_deref(), Ok(shown), "{place}");
        }
    }
    assert_eq!(said("master coil 512 0").as_deref(), Ok("done"));
    assert_eq!(said("get BRAKE").as_deref(), Ok("0 off"));
    // The drive alone says whether it runs; a bit is 0 or 1; nobody writes an input over the line.
    for words in
        ["set STATUS 1", "set discrete input 512 2", "set coil 9 1", "master DOOR 1", "get input register 9"]
    {
        said(words).expect_err(words);
    }
}

/// Another master's setpoint in its place is another run command.
#[tokio::test(start_paused = true)]
async fn a_run_command_that_is_a_setpoint_is_not_in_force_once_another_stands_there() {
    let mut rig = rig(profile(SIGNED));
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect_err("it is kept");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.written_by_another(SPEED, 200).expect("it takes it");
    let verdict = rig.drive.status().await.expect("it answers").verdict;
    assert!(matches!(verdict, Some(Verdict::NotInForce { .. })), "{verdict:?}");
}

/// The write and the reading of its state in one exchange: Modbus Application Protocol V1.1b3, section 6.17.
#[tokio::test(start_paused = true)]
async fn a_drive_that_is_commanded_by_function_23_is_started_and_stopped_by_it() {
    let text =
        SIGNED.replace("setpoint = \"positive\" }", "setpoint = \"positive\", function = 23 }").replace(
            "{ write = \"SPEED\", words = [0] }], seen",
            "{ write = \"SPEED\", words = [0], function = 23 }], seen",
        );
    let mut rig = rig(profile(&text));
    let begun = Instant::now();
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect_err("it is kept");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_machine("it is at its setpoint", |machine| machine.output_frequency == 3_000).await;
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    rig.until_machine("it stands", |machine| machine.shaft_frequency == 0).await;
    let all = written_since(&rig, SPEED, begun);
    let by_23 =
        rig.machine.received().into_iter().filter(|request| request.pdu.first() == Some(&0x17)).count();
    assert_eq!((by_23, all), (2, vec![300, 0]));
}

/// A Danfoss that runs at 30 Hz, whose owner has told of a watchdog: an updated control word alone feeds it (FC 102 and FC 202 guides).
async fn watched() -> Rig {
    let profile = Arc::new(shipped::find("danfoss-fc").expect("it is shipped").clone());
    let family = Family::new(definition(&profile));
    let owner =
        Owner::default().with_full_scale(Frequency::from_hertz(50)).with_watchdog(Duration::from_secs(2));
    let open = move |port, slave| -> Box<dyn Drive> {
        Box::new(ProfileDrive::<Box<dyn Port>>::new(port, slave, profile.clone(), owner))
    };
    let mut rig = Contract::new(family.capabilities(), open, move || {
        family.machine(SetUp::ForTheBus).expect("it has a twin")
    })
    .rig();
    let given = rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await;
    assert!(given.is_err_and(|error| error.only_a_start_shows()));
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_machine("it is at its setpoint", |machine| machine.output_frequency == 3_000).await;
    sleep(Duration::from_millis(1)).await;
    rig
}

/// Neither a status nor a keep-alive: a run word that nobody asked for would overwrite a stop of another master that does not show yet.
#[tokio::test(start_paused = true)]
async fn a_watchdog_that_a_command_word_alone_feeds_is_not_fed_and_that_is_said() {
    let mut rig = watched().await;
    let words = written_while(&mut rig, CTW, Duration::from_secs(6)).await;
    rig.drive.keep_alive().await.expect("it answers");
    assert!(words.is_empty() && written_since(&rig, CTW, Instant::now() - Duration::from_secs(1)).is_empty());
    assert_eq!(rig.drive.watchdog_capability(), None, "whoever plans the line does not count on it");
    for (key, takes) in
        [("danfoss-fc", false), ("danfoss-fc51", false), ("v20", false), ("g120", false), ("vfs15", true)]
    {
        let profile = shipped::find(key).expect("it is shipped").clone();
        let says = profile.not_known().any(|what| what.contains("a command word alone feeds"));
        let has =
            Family::new(definition(&Arc::new(profile))).options().iter().any(|of| of.name == "watchdog-time");
        assert_eq!((has, says), (takes, !takes && key != "g120"), "{key}");
    }
}

/// Its watchdog stands in a register: in tenths of a second, 0 is off.
fn with_watchdog(table: &str) -> Profile {
    let register = "[register.WDT]\nwhat = \"time of the watchdog\"\naddress = 0x0120\naccess = \"read_write\"\nstorage = \"ram\"\nunit = \"s\"\n\
        scale = [1, 10]\nsource = \"made\"\n\n[state]";
    let table = format!(
        "[watchdog]\n{table}\naction = \"unknown\"\nactions = \"unknown\"\nsource = \"made\"\n\n[sources]"
    );
    let text = SIGNED.replacen("watchdog = \"none\"\n", "", 1);
    profile(&text.replacen("[sources]", &table, 1).replacen("[state]", register, 1))
}

#[tokio::test(start_paused = true)]
async fn the_time_of_a_watchdog_is_read_where_its_profile_names_the_register_and_asking_feeds_it() {
    const WDT: u16 = 0x0120;
    let fed_by_any = "time = \"WDT\"\nzero_is = \"off\"\nfrom_factory = false\nfed_by = \"any_request\"";
    let mut rig = rig(with_watchdog(fed_by_any));
    assert_eq!(rig.drive.watchdog_capability(), None, "nobody sets it, and nobody has said its time");
    for (word, time) in [(0, None), (20, Some(2_000)), (1, Some(100)), (6_000, Some(600_000))] {
        assert!(rig.machine.poke(WDT, word));
        let found = rig.drive.watchdog().await.expect("it is read");
        assert_eq!(found.timeout, time.map(Duration::from_millis), "{word}");
    }
    for (other, why) in [
        (fed_by_any.replace("any_request", "command_write"), "a command word alone feeds it"),
        (fed_by_any.replace("\"WDT\"", "\"unknown\""), "in which register"),
        (fed_by_any.replace("\"off\"", "\"unknown\""), "what a time of 0 means"),
    ] {
        let error = self::rig(with_watchdog(&other)).drive.watchdog().await.expect_err(why);
        assert!(error.kind() == ErrorKind::Unsupported && error.to_string().contains(why), "{error}");
    }
    let said: Vec<String> = with_watchdog(fed_by_any).not_known().map(str::to_owned).collect();
    let told = "off from the factory; whoever polls it reads how it is set, and feeds it";
    assert!(said.iter().any(|what| what.contains(told)), "{said:?}");
}

/// Somebody arms it at the panel, or sets it shorter, while the line is not lost: whoever feeds it by asking has to read it anew.
#[tokio::test(start_paused = true)]
async fn a_watchdog_that_is_armed_at_the_panel_between_two_connects_is_told_to_have_changed() {
    let fed_by_any = "time = \"WDT\"\nzero_is = \"off\"\nfrom_factory = false\nfed_by = \"any_request\"";
    let mut rig = rig(with_watchdog(fed_by_any));
    assert_eq!(rig.drive.watchdog().await.expect("it is read").timeout, None);
    rig.drive.measurements().await.expect("they are read");
    assert_eq!(rig.drive.take_changed(), None, "it is as it was");
    assert!(rig.machine.poke(0x0120, 20));
    rig.drive.measurements().await.expect("they are read");
    assert_eq!(rig.drive.take_changed(), Some(drive_core::Ground::Watchdog));
    assert_eq!(rig.drive.take_changed(), None, "once");
    let found = rig.drive.watchdog().await.expect("it is read");
    assert_eq!((found.timeout, rig.drive.take_changed()), (Some(Duration::from_secs(2)), None));
    // Behind a lost line it is read in any case.
    rig.drive.forget();
    assert!(rig.machine.poke(0x0120, 0));
    rig.drive.measurements().await.expect("they are read");
    assert_eq!(rig.drive.take_changed(), None);
}

/// Behind a setpoint below the output a stop does not show before the output is there: until then nothing tells that it has arrived.
#[tokio::test(start_paused = true)]
async fn no_run_word_follows_a_stop_that_is_not_seen_yet() {
    let mut rig = watched().await;
    rig.drive.set_setpoint(Frequency::from_hertz(10).into()).await.expect("it takes it");
    let stopping = tokio::time::timeout(Duration::from_millis(300), rig.drive.stop(StopMode::Ramp)).await;
    assert!(stopping.is_err() && rig.drive.lease().is_some(), "it does not show yet");
    sleep(Duration::from_millis(1)).await;
    let mut words = Vec::new();
    for _ in 0..20 {
        let since = Instant::now();
        rig.drive.keep_alive().await.expect("it answers");
        rig.drive.status().await.expect("it answers");
        sleep(Duration::from_millis(200)).await;
        words.extend(written_since(&rig, CTW, since));
    }
    assert!(words.is_empty() && !rig.machine.observe().running, "{words:?}");
}

/// A level-start drive would restart by a run word that is repeated at the wrong moment.
#[tokio::test(start_paused = true)]
async fn no_run_word_is_repeated_behind_a_power_cycle_a_trip_a_panel_or_another_masters_stop() {
    type Deed = fn(&mut Rig);
    let deeds: [(&str, Deed); 4] = [
        ("a power cycle", |rig| rig.machine.power_cycle()),
        ("a trip", |rig| rig.machine.trip(9)),
        ("the panel", |rig| rig.machine.panel(Panel::TakeControl)),
        ("another master", |rig| rig.machine.written_by_another(CTW, STOP).expect("it takes it")),
    ];
    for (name, deed) in deeds {
        for polls in [1_u64, 7, 13] {
            let mut rig = watched().await;
            rig.poll_for(Duration::from_secs(4) + Duration::from_millis(50 * polls)).await;
            sleep(Duration::from_millis(1)).await;
            deed(&mut rig);
            let words = written_while(&mut rig, CTW, Duration::from_secs(8)).await;
            assert!(words.is_empty() && !rig.machine.observe().running, "{name} at {polls}: {words:?}");
            // The line is lost and comes back: what is found is what is there.
            rig.drive.forget();
            let words = written_while(&mut rig, CTW, Duration::from_secs(4)).await;
            assert!(words.is_empty() && !rig.machine.observe().running, "{name}: {words:?}");
        }
    }
}

/// A word beside the command word says nothing of what stands there: here the reset of split registers, which has no effect.
#[tokio::test(start_paused = true)]
async fn a_word_for_another_register_is_not_taken_for_the_command_that_stands() {
    let other = "[register.OTHER]\nwhat = \"another\"\naddress = 0x091E\naccess = \"write\"\nstorage = \"ram\"\nsource = \"made\"\n\n[register.RUN]\n";
    let machine =
        SPLIT.replace("address = 0x091E", "address = 0x0A1E").replacen("[register.RUN]\n", other, 1);
    let mut rig = rig_of(&machine, SPLIT);
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect("it takes it");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.trip(1);
    rig.until("the trip", |status| status.state == State::Fault).await;
    rig.drive.reset_faults().await.expect_err("its cause stands");
    let verdict = rig.drive.status().await.expect("it answers").verdict;
    assert_eq!((verdict, rig.drive.lease()), (None, None), "its run command was taken back by this side");
}

#[tokio::test(start_paused = true)]
async fn a_start_of_a_drive_whose_reference_is_elsewhere_is_refused() {
    let local = SPLIT.replace("mask = 0x0100, value = 0x0100", "mask = 0x0100, value = 0x0000");
    let mut rig = rig_of(SPLIT, &local);
    let unseen = rig
        .drive
        .set_setpoint(Frequency::from_hertz(30).into())
        .await
        .expect_err("it reads back, and no more");
    assert!(matches!(unseen, Error::NotConfirmed { .. }) && !unseen.only_a_start_shows(), "{unseen}");
    let began = Instant::now();
    let refused = rig.drive.start(Direction::Forward).await.expect_err("its reference is elsewhere");
    assert_eq!(
        (refused.kind(), written_since(&rig, 0x091B, began)),
        (ErrorKind::Refused, vec![]),
        "{refused}"
    );
}

/// The machine of one text, driven by another.
fn rig_of(machine: &str, text: &str) -> Rig {
    let machine = Family::new(definition(&Arc::new(profile(machine))));
    let family = Family::new(definition(&Arc::new(profile(text))));
    let options = Options::default();
    let open = move |port, slave| family.open_with(port, slave, &options);
    Contract::new(family.capabilities(), open, move || {
        machine.machine(SetUp::ForTheBus).expect("it has a twin")
    })
    .rig()
}

/// Another register shows the setpoint in force, and an input or another master has changed it: what the bus has given is not it.
#[tokio::test(start_paused = true)]
async fn a_start_at_another_setpoint_than_stands_in_its_register_is_not_confirmed() {
    let seen = "[register.SEEN]\nwhat = \"setpoint in force\"\naddress = 0x0120\naccess = \"read\"\nunit = \"Hz\"\nscale = [1, 10]\nsource = \"made\"\n\n[register.RUN]\n";
    let text =
        SPLIT.replace("setpoint = \"SPEED\"", "setpoint = \"SEEN\"").replacen("[register.RUN]\n", seen, 1);
    // The machine takes its setpoint from another place than the one that this side reads and writes.
    let machine = text.replace("address = 0x091A", "address = 0x0A1A");
    let both = "[register.OTHER]\nwhat = \"another\"\naddress = 0x091A\naccess = \"read_write\"\nstorage = \"ram\"\nsource = \"made\"\n\n[register.RUN]\n";
    let machine = machine.replacen("[register.RUN]\n", both, 1);
    let mut rig = rig_of(&machine, &text);
    rig.machine.written_by_another(0x0A1A, 100).expect("a preset of 10 Hz");
    rig.machine.written_by_another(0x091A, 300).expect("30 Hz by the bus");
    let error = rig.drive.start(Direction::Forward).await.expect_err("it runs at 10 Hz");
    assert!(
        matches!(error, Error::NotConfirmed { .. }) && error.to_string().contains("another setpoint"),
        "{error}"
    );
}

/// Modbus Application Protocol V1.1b3, section 7: 05 is "accepted, and takes long", whatever was written.
#[test]
fn a_coil_that_is_accepted_and_takes_long_is_of_unknown_outcome_as_a_register_is() {
    let slave = drive_core::SlaveAddress::try_from(1).expect("it is one");
    for function in [0x05, 0x06, 0x0F, 0x10, 0x17] {
        let exchange = drive_core::Exchange { function, register: Some(1) };
        let meaning = drive_core::ExceptionMeaning::standard(5);
        let error = Error::Exception { slave, exchange, code: 5, meaning };
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{function:02X}h");
    }
}

/// "The register whose number says how many decimals this one has": what it counts before them need not be said.
#[tokio::test(start_paused = true)]
async fn an_output_whose_decimals_another_register_tells_is_seen_without_a_scale() {
    const DECIMALS: u16 = 0x0120;
    let register = "[register.DEC]\nwhat = \"decimals of the output\"\naddress = 0x0120\naccess = \"read\"\nunit = \"count\"\n\
        source = \"made\"\n\n[state]";
    let machine = SIGNED.replacen("[state]", register, 1);
    let at = machine.find("[register.OUTPUT]").expect("it has one");
    let (before, output) = machine.split_at(at);
    let text = [before, &output.replacen("scale = [1, 100]", "decimals_in = \"DEC\"", 1)].concat();
    let mut rig = rig_of(&machine, &text);
    assert!(rig.machine.poke(DECIMALS, 2));
    rig.drive
        .set_setpoint(Frequency::from_hertz(20).into())
        .await
        .expect_err("its setpoint is its run command");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_machine("it is at its speed", |machine| machine.output_frequency == 2_000).await;
    let told = rig.drive.status().await.expect("it answers").output_frequency;
    assert_eq!(told, Some(Frequency::from_hertz(20)));
}
