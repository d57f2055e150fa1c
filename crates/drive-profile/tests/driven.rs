//! The drives of profiles, each against its simulated twin: started, reversed, stopped, tripped, reset and lost.

use std::{sync::Arc, time::Duration};

use drive_core::{
    Direction, Drive, Error, ErrorKind, Frequency, Lack, Motion, Percent, Refusal, State, StopMode, Verdict,
};
use drive_families::{Definition, Family, Options, SetUp};
use drive_profile::{Level, Profile, definition, read, shipped};
use drive_testing::{
    Contract,
    rig::Rig,
    worlds::{Configuration, Event, Share, Surrounded},
};

/// Those that reach motion.
const DRIVEN: [&str; 9] =
    ["danfoss-fc", "goodrive", "ig5a", "v20", "g120", "altivar", "wj200", "mx2", "vfs15"];
/// Those of them that show the setpoint in force in another register than that which takes it.
const SHOWN: [&str; 2] = ["goodrive", "altivar"];

fn family(key: &str) -> Family {
    family_of(shipped::find(key).expect("it is shipped").clone())
}

fn family_of(profile: Profile) -> Family {
    let definition: &'static Definition = definition(&Arc::new(profile));
    Family::new(definition)
}

fn contract(family: Family, options: Options) -> Contract {
    Contract::new(
        family.capabilities(),
        move |port, slave| family.open_with(port, slave, &options),
        move || family.machine(SetUp::ForTheBus).expect("it has a twin"),
    )
}

fn rig(key: &str) -> Rig {
    let family = family(key);
    contract(family, family.simulated_options()).rig()
}

/// Gives a setpoint: in force, or taken by a drive of which only a start shows whether it is.
async fn give(rig: &mut Rig, hertz: u16) {
    let given = rig.drive.set_setpoint(Frequency::from_hertz(hertz).into()).await;
    assert!(given.as_ref().err().is_none_or(Error::only_a_start_shows), "{given:?}");
}

async fn running(key: &str) -> Rig {
    let mut rig = rig(key);
    rig.drive.status().await.expect("it answers");
    give(&mut rig, 30).await;
    rig.drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{key}: {error}"));
    rig.until_machine("the output is that of the setpoint", |machine| machine.output_frequency == 3_000)
        .await;
    rig
}

/// Its motor runs by its panel, behind a run command of the bus.
async fn run_by_its_panel(key: &str) -> Rig {
    let rig = running(key).await;
    rig.machine.panel(drive_sim::Panel::TakeControl);
    rig.machine.panel(drive_sim::Panel::Run);
    rig
}

/// Whether a request only reads: functions 1 to 4.
fn is_read(request: &drive_sim::Received) -> bool {
    matches!(request.pdu.first(), Some(1..=4))
}

/// A register that reads back as it was written is an echo: the five families, too, confirm a setpoint at standstill by what the drive tells of its
/// active reference.
#[tokio::test(start_paused = true)]
async fn at_rest_a_setpoint_is_confirmed_by_what_shows_it_in_force_and_by_no_echo() {
    for key in DRIVEN {
        let mut rig = rig(key);
        rig.drive.status().await.expect("it answers");
        let given = rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await;
        if SHOWN.contains(&key) {
            given.unwrap_or_else(|error| panic!("{key}: {error}"));
        } else {
            let error = given.expect_err(key);
            assert!(
                error.only_a_start_shows() && error.to_string().contains("see its output"),
                "{key}: {error}"
            );
        }
        assert!(!rig.machine.observe().running, "{key}: a setpoint is no start");
        rig.drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.until_machine("it is what was given", |machine| machine.output_frequency.abs_diff(3_000) < 2)
            .await;
        // Of a motor that runs its output is seen to follow.
        rig.drive
            .set_setpoint(Frequency::from_hertz(20).into())
            .await
            .unwrap_or_else(|error| panic!("{key}: {error}"));
    }
    // Its register is the one that takes it, and the drive tells that its reference is the bus's.
    let family =
        family_of(read(include_str!("data/split.toml")).unwrap_or_else(|refusals| panic!("{refusals}")));
    let mut rig = contract(family, family.simulated_options()).rig();
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect("its reference is the bus's");
    rig.machine.panel(drive_sim::Panel::TakeControl);
    let error =
        rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect_err("it is the panel's");
    assert!(!error.only_a_start_shows(), "{error}");
}

/// What [`Contract`] asks of every family but for one thing: a drive that does not tell who commands it is told in force by no status.
#[tokio::test(start_paused = true)]
async fn each_keeps_the_contract_of_a_family_at_its_level() {
    for key in DRIVEN {
        let family = family(key);
        let contract = contract(family, family.simulated_options());
        contract.survives_any_words().await;
        contract.sends_no_request_that_is_too_long().await;
        contract.does_what_it_claims().await;
        contract.has_the_watchdog_that_it_claims().await;
        contract.takes_the_exchanges_that_it_claims().await;
        // How an Altivar is turned round by these profiles is not known, and the story turns every drive round.
        if key != "altivar" {
            contract.lives_the_story().await;
        }
    }
}

#[tokio::test(start_paused = true)]
async fn no_disobedient_drive_and_no_lost_answer_makes_one_say_what_is_not_so() {
    for key in DRIVEN {
        let family = family(key);
        let complaints = contract(family, family.simulated_options()).complaints().await;
        // Told as not known is no lie: it is all that the drive shows.
        let lies = complaints
            .iter()
            .map(ToString::to_string)
            .filter(|complaint| !complaint.contains("the verdict is Some(NotKnown)"));
        let lies: Vec<String> = lies.collect();
        assert!(lies.is_empty(), "{key}:\n{}", lies.join("\n"));
    }
}

/// Coils: started, turned round through standstill, stopped, tripped, reset and lost, by what the machine does.
#[tokio::test(start_paused = true)]
async fn a_drive_that_is_commanded_by_coils_is_driven_as_those_are_that_have_words() {
    for key in ["wj200", "mx2"] {
        let mut rig = running(key).await;
        assert_eq!(rig.machine.observe().output_frequency, 3_000, "{key}");
        let status =
            rig.drive.start(Direction::Reverse).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        assert_eq!((status.state, status.verdict), (State::Running, Some(Verdict::NotKnown)), "{key}");
        rig.until_machine("it turns round", |machine| machine.output_frequency == -3_000).await;
        let stopped = rig.drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        assert_eq!((stopped.mode, rig.drive.lease()), (StopMode::Ramp, None), "{key}");
        rig.until_machine("it stands", |machine| machine.shaft_frequency == 0).await;
        rig.drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.machine.trip(9);
        rig.until("the trip", |status| status.state == State::Fault).await;
        rig.drive.reset_faults().await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.poll_for(Duration::from_secs(3)).await;
        assert!(!rig.machine.observe().running, "{key}: a reset is no start");
        rig.drive.start(Direction::Forward).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.machine.mute();
        let lost = rig.drive.status().await.expect_err("nobody answers");
        assert_eq!(lost.kind(), ErrorKind::NoAnswer, "{key}");
        rig.machine.unmute();
        rig.drive.forget();
        rig.poll_for(Duration::from_secs(12)).await;
        rig.drive.status().await.expect("it answers again");
        assert!(rig.drive.lease().is_some(), "{key}: it may stand, and nothing has shown that it does not");
        rig.drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{key}: {error}"));
    }
}

/// wj200_vfd reads the output of a WJ200 in 1001h and 1002h, hundredths of a hertz. From 45 to 5 Hz takes longer than a command has to show.
#[tokio::test(start_paused = true)]
async fn a_setpoint_that_a_wj200_takes_seconds_to_reach_is_confirmed_by_its_output() {
    for key in ["wj200", "mx2"] {
        let mut rig = running(key).await;
        for hertz in [45, 5, 45] {
            let setpoint = Frequency::from_hertz(hertz);
            rig.drive
                .set_setpoint(setpoint.into())
                .await
                .unwrap_or_else(|error| panic!("{key} {hertz}: {error}"));
            rig.until("it is there", |status| status.output_frequency == Some(setpoint)).await;
        }
        let stopped = rig.drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        assert!(matches!(stopped.status.motion, Motion::Braking), "{key}: {stopped:?}");
        rig.until("rest", |status| status.motion == Motion::AtRest).await;
    }
}

/// Run command, direction and reset in registers of their own, its state in a register that is only read, its output in two words: whoever
/// tells all of it is told in force.
#[tokio::test(start_paused = true)]
async fn a_drive_of_split_registers_is_turned_round_and_its_run_command_is_in_force() {
    let profile = read(include_str!("data/split.toml")).unwrap_or_else(|refusals| panic!("{refusals}"));
    assert_eq!(profile.level(), Level::Motion, "{:#?}", profile.gaps());
    let family = family_of(profile);
    let contract = contract(family, family.simulated_options());
    contract.does_what_it_claims().await;
    contract.takes_the_exchanges_that_it_claims().await;
    contract.lives_the_story().await;
    let mut rig = contract.rig();
    rig.drive.status().await.expect("it answers");
    give(&mut rig, 30).await;
    for (direction, output) in [(Direction::Forward, 3_000), (Direction::Reverse, -3_000)] {
        rig.drive.start(direction).await.expect("it starts");
        rig.until_machine("it is at its setpoint", |machine| machine.output_frequency == output).await;
        let status = rig.drive.status().await.expect("it answers");
        assert_eq!(status.output_frequency, Some(Frequency::from_hertz(30)), "two words");
        assert_eq!(status.verdict, Some(Verdict::InForce), "{direction}");
    }
    rig.machine.written_by_another(0x091B, 0).expect("it takes it");
    let status = rig.until("another has stopped it", |status| status.state != State::Running).await;
    assert!(!matches!(status.verdict, Some(Verdict::InForce)), "{:?}", status.verdict);
}

/// What was given and what the drive shows are two things: an input, a preset or another master may stand between them.
#[tokio::test(start_paused = true)]
async fn a_start_at_another_setpoint_than_was_given_is_none() {
    let mut rig = rig("goodrive");
    rig.drive.status().await.expect("it answers");
    give(&mut rig, 20).await;
    rig.machine.written_by_another(0x2001, 3_000).expect("it takes it");
    let error = rig.drive.start(Direction::Forward).await.expect_err("it would run at 30 Hz");
    assert!(
        matches!(error, Error::Refused { .. }) && error.to_string().contains("is not the one that was given"),
        "{error}"
    );
    assert!(!rig.machine.observe().running);
    give(&mut rig, 25).await;
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    rig.until_machine("it stands", |machine| machine.shaft_frequency == 0).await;
    rig.drive.start(Direction::Forward).await.expect("it is what was given");
}

#[tokio::test(start_paused = true)]
async fn who_commands_is_told_only_where_the_drive_tells_it() {
    for key in DRIVEN {
        let mut rig = running(key).await;
        let verdict = rig.drive.status().await.expect("it answers").verdict;
        assert_eq!(verdict, Some(Verdict::NotKnown), "{key}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_panel_that_takes_control_is_told_where_the_drive_tells_it() {
    for (key, tells) in [("goodrive", true), ("v20", true), ("danfoss-fc", true), ("ig5a", false)] {
        let mut rig = run_by_its_panel(key).await;
        let status = rig.drive.status().await.expect("it answers");
        let told = matches!(
            status.verdict,
            Some(Verdict::NotInForce { lacks: Lack::Command | Lack::Reference, .. })
        );
        assert!(told || !tells, "{key}: {:?}", status.verdict);
    }
}

/// Whoever asks for a stop hears what it says, which is not old by then; each repetition is a call of its own.
#[tokio::test(start_paused = true)]
async fn a_drive_that_answers_and_runs_by_its_panel_is_not_waited_for_as_one_that_is_on_its_way() {
    for key in ["goodrive", "v20", "danfoss-fc"] {
        let mut rig = run_by_its_panel(key).await;
        let begun = tokio::time::Instant::now();
        let error = rig.drive.stop(StopMode::Ramp).await.expect_err("its panel runs it");
        assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{key}: {error}");
        assert!(begun.elapsed().as_millis() < 1_000, "{key}: {error}");
    }
}

/// Its run command does not read back, and its panel lets the motor come down, as it does too where it turns it round.
#[tokio::test(start_paused = true)]
async fn what_a_panel_lets_a_motor_do_shows_no_withdrawal() {
    let mut rig = run_by_its_panel("goodrive").await;
    rig.drive.status().await.expect("it answers");
    rig.machine.panel(drive_sim::Panel::Stop);
    let error = rig.drive.withdraw().await.expect_err("the panel has it");
    assert_eq!(error.kind(), ErrorKind::NotConfirmed, "{error}");
    assert!(rig.drive.lease().is_some(), "it may stand, and act when the panel gives control back");
    rig.machine.panel(drive_sim::Panel::ReleaseControl);
    rig.drive.withdraw().await.expect("the bus has it");
    assert!(rig.drive.lease().is_none());
}

/// The word was written while the panel had it, and it gives control back before that has shown.
#[tokio::test(start_paused = true)]
async fn a_withdrawal_that_was_written_to_a_panel_is_written_again_when_it_gives_control_back() {
    let mut rig = run_by_its_panel("goodrive").await;
    rig.drive.status().await.expect("it answers");
    rig.machine.panel(drive_sim::Panel::Reference(Frequency::from_hertz(5)));
    let back = async {
        tokio::time::sleep(Duration::from_millis(150)).await;
        rig.machine.panel(drive_sim::Panel::ReleaseControl);
    };
    let (withdrawn, ()) = tokio::join!(rig.drive.withdraw(), back);
    withdrawn.expect("the bus has it");
    // 2000h = 0005h, which such a drive does not take while its panel has it.
    let received = rig.machine.received();
    let stops = received.iter().filter(|request| request.pdu[..] == [6, 0x20, 0, 0, 5]).count();
    assert_eq!(stops, 2);
}

#[tokio::test(start_paused = true)]
async fn it_trips_and_is_reset_and_nothing_starts_by_itself() {
    for key in DRIVEN {
        let mut rig = running(key).await;
        rig.machine.trip(9);
        rig.until("the trip", |status| status.state == State::Fault).await;
        let refused = rig.drive.start(Direction::Forward).await.expect_err("it has tripped");
        assert!(
            matches!(refused, Error::Refused { reason: Refusal::Tripped | Refusal::Fault(_), .. }),
            "{key}: {refused}"
        );
        rig.until_machine("the shaft stands", |machine| machine.shaft_frequency == 0).await;
        let status = rig.drive.reset_faults().await.unwrap_or_else(|error| panic!("{key}: {error}"));
        assert!(!status.is_fault() && rig.drive.lease().is_none(), "{key}");
        rig.poll_for(Duration::from_secs(3)).await;
        assert!(!rig.machine.observe().running, "{key}: a reset is no start");
    }
}

#[tokio::test(start_paused = true)]
async fn a_fault_of_a_drive_that_does_not_tell_who_commands_it_is_reset_only_where_its_owner_says_that_nobody_else_does()
 {
    for key in ["v20", "danfoss-fc", "ig5a"] {
        let family = family(key);
        let mut options = Options::default();
        options.set("full-scale", "50Hz").ok();
        let mut rig = contract(family, options).rig();
        rig.machine.trip(9);
        rig.until("the trip", |status| status.state == State::Fault).await;
        let writes = |rig: &Rig| {
            rig.machine.received().iter().filter(|request| request.pdu.first() == Some(&6)).count()
        };
        let refused = rig.drive.reset_faults().await.expect_err("another's run command may stand");
        assert_eq!((refused.kind(), writes(&rig)), (ErrorKind::Refused, 0), "{key}: {refused}");
    }
}

#[tokio::test(start_paused = true)]
async fn neither_a_lost_line_nor_a_power_cycle_makes_it_write_anything() {
    for key in DRIVEN {
        let mut rig = running(key).await;
        rig.machine.power_cycle();
        let before = rig.machine.received().len();
        rig.drive.forget();
        rig.poll_for(Duration::from_secs(5)).await;
        let written = rig.machine.received().iter().skip(before).any(|request| !is_read(request));
        assert!(!written && !rig.machine.observe().running, "{key}");
        assert!(
            rig.drive.lease().is_some(),
            "{key}: what was given may stand, and nothing has shown that it does not"
        );
        rig.drive.withdraw().await.unwrap_or_else(|error| panic!("{key}: {error}"));
        assert!(rig.drive.lease().is_none() && !rig.machine.observe().running, "{key}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_another_has_started_is_not_turned_round() {
    let mut rig = rig("danfoss-fc");
    give(&mut rig, 30).await;
    rig.machine.written_by_another(49_999, 0x047C).expect("it takes it");
    rig.until("it runs", |status| status.state == State::Running).await;
    let refused = rig.drive.start(Direction::Reverse).await.expect_err("it is not ours");
    assert_eq!(refused.kind(), ErrorKind::Refused, "{refused}");
    rig.drive.stop(StopMode::Ramp).await.expect("a stop is for everybody");
    rig.until_machine("it stands", |machine| !machine.running).await;
}

/// INVT: 1 is "run forward", and Delta's 1 is its stop. A drive that answers otherwise gets neither.
#[tokio::test(start_paused = true)]
async fn a_drive_that_answers_otherwise_than_its_guards_gets_no_word_not_even_a_stop() {
    let mut rig = rig("goodrive");
    let family = family("goodrive");
    let other =
        family_of(read(&text("invt/goodrive").replace("is_not = [0]", "is = [77]")).expect("it is right"));
    assert_eq!(other.capabilities().key, family.capabilities().key);
    let machine = move || family.machine(SetUp::ForTheBus).expect("it has a twin");
    let options = family.simulated_options();
    let mut wrong = Contract::new(
        other.capabilities(),
        move |port, slave| other.open_with(port, slave, &options),
        machine,
    )
    .rig();
    wrong.drive.status().await.expect("it is read all the same");
    for refused in [
        wrong.drive.start(Direction::Forward).await.map(drop),
        wrong.drive.set_setpoint(Frequency::from_hertz(20).into()).await,
        wrong.drive.stop(StopMode::Ramp).await.map(drop),
    ] {
        let error = refused.expect_err("it is another drive");
        let told = error.to_string();
        assert!(told.contains("IDENTITY") && told.contains("change the family"), "{told}");
    }
    assert!(
        wrong.machine.received().iter().all(|request| request.pdu.first() == Some(&3)),
        "nothing was written"
    );
    rig.drive.status().await.expect("it answers");
    rig.drive.stop(StopMode::Ramp).await.expect("its guards hold");
}

/// Between two looks at it it was exchanged, or set up otherwise at its panel.
#[tokio::test(start_paused = true)]
async fn a_drive_that_answers_otherwise_than_its_guards_by_now_is_not_started() {
    let mut rig = rig("goodrive");
    rig.drive.status().await.expect("it answers");
    give(&mut rig, 20).await;
    let identity = rig.machine.peek(0x2103).expect("it has one");
    assert!(rig.machine.poke(0x2103, 0));
    rig.drive.status().await.expect("it is read all the same");
    let writes = |rig: &Rig| rig.machine.requests(0x06);
    let before = writes(&rig);
    let refused = rig.drive.start(Direction::Forward).await.expect_err("it is another drive");
    assert!(refused.to_string().contains("IDENTITY"), "{refused}");
    assert_eq!(writes(&rig), before);
    assert!(rig.machine.poke(0x2103, identity));
    rig.drive.start(Direction::Forward).await.expect("it is the one of its file");
}

/// In the I/O profile of an Altivar word 7 starts it: until its guard was read, a stop is word 0, which coasts.
#[tokio::test(start_paused = true)]
async fn a_stop_before_the_guards_were_read_is_the_one_that_is_a_stop_whatever_they_say() {
    let family = family("altivar");
    let mut rig = contract(family, family.simulated_options()).rig();
    let _ = rig.drive.stop(StopMode::Ramp).await;
    let first = rig.machine.received().first().expect("it writes").pdu.clone();
    assert_eq!(first[..], [0x06, 0x21, 0x35, 0x00, 0x00]);
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_its_profile_only_lets_stop_is_stopped_and_nothing_else() {
    let profile = shipped::find("a1000").expect("it is shipped");
    assert_eq!(profile.level(), Level::Stop);
    let mut rig = rig("a1000");
    for refused in [
        rig.drive.start(Direction::Forward).await.map(drop),
        rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await,
        rig.drive.reset_faults().await.map(drop),
    ] {
        assert_eq!(refused.expect_err("its profile does not reach so far").kind(), ErrorKind::Unsupported);
    }
    assert_eq!(rig.machine.all_requests(), 0);
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_beyond_what_is_known_is_refused_and_not_sent() {
    for (key, option) in [("g120", "full-scale"), ("goodrive", "highest")] {
        let family = family(key);
        let mut rig = contract(family, Options::default()).rig();
        let refused =
            rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect_err("nobody has said");
        assert!(refused.to_string().contains(option), "{refused}");
        let mut rig = self::rig(key);
        let refused = rig
            .drive
            .set_setpoint(Frequency::from_centihertz(5_001).into())
            .await
            .expect_err("more than 50 Hz");
        // Neither drive tells it: the one counts in percent, of which its owner has said what they are.
        let said = refused.to_string();
        assert!(said.contains("its owner allows 0.00 Hz to 50.00 Hz"), "{key}: {said}");
        assert!(rig.machine.received().iter().all(|request| request.pdu.first() == Some(&3)), "{key}");
    }
    let mut rig = rig("v20");
    let given = rig.drive.set_setpoint(Percent::from_percent(50).into()).await;
    assert!(given.is_err_and(|error| error.only_a_start_shows()), "it counts so");
    assert_eq!(rig.machine.peek(100), Some(8_192), "HSW 40101");
}

#[tokio::test(start_paused = true)]
async fn a_stop_along_the_ramp_ends_at_rest_and_one_that_cuts_the_output_does_not() {
    for (mode, end) in [(StopMode::Ramp, Motion::AtRest), (StopMode::Freewheel, Motion::Coasting)] {
        let mut rig = running("v20").await;
        let stopped = rig.drive.stop(mode).await.expect("it stops");
        assert_eq!(stopped.mode, mode);
        assert_eq!(rig.until_standstill().await.motion, end, "{mode}");
    }
}

/// A WJ200 and a VF-S15 run until their motor stands: what comes down by a word that was taken back does so along the ramp.
#[tokio::test(start_paused = true)]
async fn a_motor_whose_run_command_was_taken_back_is_told_at_rest_once_it_has_come_down() {
    for key in DRIVEN {
        let mut rig = running(key).await;
        rig.drive.withdraw().await.unwrap_or_else(|error| panic!("{key}: {error}"));
        rig.poll_for(Duration::from_millis(500)).await;
        let start =
            rig.drive.start(Direction::Forward).await.expect_err("it may run by another's word by now");
        assert_eq!(start.kind(), ErrorKind::Refused, "{key}: {start}");
        let end = rig.until_standstill().await.motion;
        assert_eq!(end, Motion::AtRest, "{key}");
    }
}

/// A V20 tells that it operates until its motor stands, on a ramp of 3 s.
#[tokio::test(start_paused = true)]
async fn a_stop_that_is_taken_is_told_of_a_motor_that_comes_down_whatever_its_drive_calls_that() {
    for key in DRIVEN {
        let mut rig = running(key).await;
        let stopped = rig.drive.stop(StopMode::Ramp).await.unwrap_or_else(|error| panic!("{key}: {error}"));
        assert_eq!(stopped.status.state, State::Stopping, "{key}");
        assert_eq!(stopped.status.motion, Motion::Braking, "{key}: {stopped:?}");
    }
}

/// A V20 tells that it operates until its motor stands: on the way to a lower setpoint nothing tells whether it obeys. Each such answer has the
/// status that is had by then, and whoever repeats the stop sees the motor come to rest.
#[tokio::test(start_paused = true)]
async fn a_stop_on_the_way_to_a_lower_setpoint_is_told_by_young_statuses_until_it_shows() {
    let mut untold = Vec::new();
    for key in ["danfoss-fc", "goodrive", "ig5a", "v20", "g120"] {
        let mut rig = running(key).await;
        give(&mut rig, 5).await;
        assert!(rig.machine.observe().output_frequency > 1_000, "{key}: it is on its way");
        let mut answers = 0;
        loop {
            answers += 1;
            assert!(answers < 30, "{key}: it never shows");
            let asked = tokio::time::Instant::now();
            let Err(error) = rig.drive.stop(StopMode::Ramp).await else { break };
            let Error::NotConfirmed { status, because: None, .. } = &error else { panic!("{key}: {error}") };
            assert!(status.output_frequency.is_some(), "{key}: {error}");
            assert!(
                asked.elapsed() < drive_core::CONFIRMED_WITHIN * 3 / 4,
                "{key}: it is told after {:?}",
                asked.elapsed()
            );
        }
        if answers > 1 {
            untold.push(key);
        }
        rig.until_standstill().await;
    }
    assert!(untold.contains(&"v20"), "{untold:?}");
}

/// Whether the write of the setpoint, or what follows it, is lost, either setpoint may stand in the drive: neither is somebody else's.
#[tokio::test(start_paused = true)]
async fn a_setpoint_of_which_nobody_knows_whether_it_arrived_leaves_the_run_command_in_force() {
    for key in DRIVEN {
        for exchanges in 0..8 {
            let mut rig = running(key).await;
            let machine = rig.machine.clone();
            let until = machine.all_requests() + exchanges;
            let given = {
                let falls_silent = async {
                    while machine.all_requests() < until {
                        tokio::time::sleep(Duration::from_millis(1)).await;
                    }
                    machine.mute();
                    std::future::pending::<()>().await;
                };
                tokio::select! {
                    given = rig.drive.set_setpoint(Frequency::from_hertz(40).into()) => given,
                    () = falls_silent => unreachable!("it waits for ever"),
                }
            };
            machine.unmute();
            tokio::time::sleep(Duration::from_secs(5)).await;
            let verdict = rig.drive.status().await.expect("it answers").verdict;
            let is_gone = matches!(verdict, None | Some(Verdict::NotInForce { .. }));
            assert!(!is_gone, "{key}, mute behind {exchanges}: {verdict:?}, {given:?}");
        }
    }
}

/// What another master has left in HSW: C666h are -45 Hz, 7FFFh twice the frequency that P2000 says.
#[tokio::test(start_paused = true)]
async fn a_motor_whose_setpoint_nobody_could_have_given_is_not_started_until_one_is_given() {
    let mut rig = rig("v20");
    rig.drive.status().await.expect("it answers");
    let written = rig.machine.received().iter().filter(|request| !is_read(request)).count();
    for (setpoint, why) in [(0xC666, "is negative"), (0x7FFF, "is above what may be given")] {
        rig.machine.poke(100, setpoint);
        for direction in [Direction::Forward, Direction::Reverse] {
            let error = rig.drive.start(direction).await.expect_err(why);
            assert!(error.to_string().contains(&format!("the setpoint that stands in it {why}")), "{error}");
            // Who starts several asks each beforehand: one that is given the setpoint with its start would start.
            assert_eq!(rig.drive.may_start(direction, None).await.expect_err(why), error);
            let given = Some(Frequency::from_hertz(30).into());
            rig.drive.may_start(direction, given).await.expect("it would start");
        }
    }
    assert_eq!(rig.machine.received().iter().filter(|request| !is_read(request)).count(), written);
    give(&mut rig, 30).await;
    rig.drive.start(Direction::Forward).await.expect("it is started");
    rig.until_machine("it turns forward", |machine| machine.output_frequency == 3_000).await;
}

/// 3333h in HSW is 40 Hz of 50 (16384 is 100 %): another master writes it, while the motor stands.
#[tokio::test(start_paused = true)]
async fn a_start_behind_a_stop_is_one_at_what_stands_and_behind_a_setpoint_one_at_that_or_none() {
    let mut rig = running("v20").await;
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    rig.until_machine("it stands", |machine| machine.output_frequency == 0).await;
    rig.machine.poke(100, 0x3333);
    rig.drive.status().await.expect("it answers");
    let started = rig.drive.start(Direction::Forward).await.expect("it is started at what it holds");
    assert_eq!(started.reference, Some(Frequency::from_hertz(40)));
    rig.until_machine("it turns at that", |machine| machine.output_frequency == 4_000).await;

    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    rig.until_machine("it stands", |machine| machine.output_frequency == 0).await;
    give(&mut rig, 30).await;
    // Another master, and a power cut.
    for lost in [0x3333, 0] {
        rig.machine.poke(100, lost);
        rig.drive.status().await.expect("it answers");
        let error = rig.drive.start(Direction::Forward).await.expect_err("it is not what was given");
        assert!(error.to_string().contains("is not the one that was given to it"), "{error}");
        assert!(!rig.machine.observe().running, "nothing has moved");
    }
    give(&mut rig, 20).await;
    rig.drive.start(Direction::Forward).await.expect("it is started");
}

/// Another master writes D99Ah into HSW, -30 Hz, while the motor runs forward at 30 Hz.
#[tokio::test(start_paused = true)]
async fn a_setpoint_whose_sign_another_master_has_turned_round_is_not_the_one_that_was_given() {
    let mut rig = running("v20").await;
    rig.machine.poke(100, 0xD99A);
    let verdict = rig.drive.status().await.expect("it answers").verdict;
    assert!(matches!(verdict, Some(Verdict::NotInForce { .. })), "{verdict:?}");
}

fn text(name: &str) -> String {
    let found = shipped::TEXTS.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| (*text).to_owned()).expect("it is shipped")
}

/// The one way in which a profile lets its drive be commanded, with panel, supplies and another master around it.
struct Around {
    key: &'static str,
    masters: Vec<Event>,
}

impl Surrounded for Around {
    fn configurations(&self) -> Vec<Configuration> {
        let of = family(self.key);
        let options = of.simulated_options();
        vec![Configuration {
            name: "by the bus".to_owned(),
            open: Box::new(move |port, slave| of.open_with(port, slave, &options)),
            machine: Box::new(move || of.machine(SetUp::ForTheBus).expect("it has a twin")),
            settings: Vec::new(),
        }]
    }

    fn other_masters(&self) -> Vec<Event> {
        self.masters.clone()
    }
}

#[tokio::test(start_paused = true)]
async fn the_three_that_motion_was_proved_for_say_the_truth_in_every_world_around_them() {
    let masters =
        |deeds: &[&str]| deeds.iter().map(|deed| Event::lasting(&format!("master {deed}"))).collect();
    for (key, masters) in [
        ("goodrive", masters(&["CMD 1", "CMD 2", "CMD 5", "FREQ 1000"])),
        ("v20", masters(&["STW 1151", "STW 3199", "STW 1150", "HSW 3000"])),
        ("danfoss-fc", masters(&["CTW 1148", "CTW 33916", "CTW 1084", "REF 3000"])),
    ] {
        let of = family(key);
        let contract = contract(of, of.simulated_options());
        Contract { around: Some(Box::new(Around { key, masters })), ..contract }
            .is_true_in_worlds(Share::one_in(17))
            .await;
    }
}

/// The states of a stop that is done are those of a drive that does nothing: what it has refused there is no stop that it has taken.
#[tokio::test(start_paused = true)]
async fn a_stop_that_is_refused_ends_no_lease_whatever_state_the_drive_shows() {
    for trips in [false, true] {
        let mut rig = misread("invt/goodrive", "goodrive", "address = 0x2000", "address = 0x2010");
        give(&mut rig, 20).await;
        rig.drive.start(Direction::Forward).await.expect_err("it is refused");
        if trips {
            rig.machine.trip(9);
        }
        let error = rig.drive.stop(StopMode::Ramp).await.expect_err("it is refused, each time");
        assert_eq!(error.kind(), ErrorKind::Exception, "{error}");
        assert!(rig.drive.lease().is_some(), "the run command may stand");
    }
}

/// While 0004 of an iG5A is 0 it refuses every write, a stop too (p. 11-3). Its twin refuses one to a register that it does not have.
#[tokio::test(start_paused = true)]
async fn a_stop_that_a_drive_refuses_by_its_settings_says_by_which_and_is_written_on() {
    let mut rig = misread("ls/ig5a", "ig5a", "address = 0x0006", "address = 0x0036");
    rig.drive.status().await.expect("it answers");
    rig.machine.written_by_another(4, 3_000).expect("30 Hz by the bus");
    rig.machine.written_by_another(5, 2).expect("a run command");
    rig.until_machine("it runs", |machine| machine.output_frequency == 3_000).await;
    assert!(rig.machine.poke(3, 0));
    let before = rig.machine.received().len();
    for _ in 0..2 {
        let error = rig.drive.stop(StopMode::Ramp).await.expect_err("it is refused, each time");
        let (kind, told) = (error.kind(), error.to_string());
        let cause = "its write enable lets a stop through (ENABLE reads 0): set ENABLE";
        assert!(kind == ErrorKind::NotConfirmed && told.contains(cause), "{told}");
    }
    let received = rig.machine.received();
    let stops: Vec<_> = received.iter().skip(before).map(|request| !is_read(request)).collect();
    assert!(stops.first() == Some(&true), "nothing is read before it");
    assert!(stops.iter().filter(|is_stop| **is_stop).count() >= 8, "{stops:?}");
}

/// It has tripped, and the one write of the stop gets an exception, or is lost: it is written until it is taken.
#[tokio::test(start_paused = true)]
async fn a_stop_of_a_drive_that_has_tripped_is_written_again_until_it_is_taken() {
    for key in DRIVEN {
        let mut rig = running(key).await;
        rig.machine.trip(9);
        rig.until("the trip", |status| status.state == State::Fault).await;
        let before = rig.machine.received().len();
        rig.machine.refuse_next(drive_sim::Exception::FAILURE);
        let stopped = rig.drive.stop(StopMode::Ramp).await;
        stopped.unwrap_or_else(|error| panic!("{key}: {error}"));
        let written = rig.machine.received().iter().skip(before).filter(|request| !is_read(request)).count();
        assert!(written >= 2 && rig.drive.lease().is_none(), "{key}: {written}");
    }
}

/// Its last step writes the run word and then another: the lease is of the run word, which stands where it reads back.
#[tokio::test(start_paused = true)]
async fn the_lease_of_a_start_of_several_words_is_of_the_word_that_runs() {
    let text = include_str!("data/split.toml")
        .replace(
            "{ write = \"DIRECTION\", words = [0] }, { write = \"RUN\", words = [1] }",
            "{ write = \"RUN\", words = [1, 0] }",
        )
        .replace(
            "{ write = \"DIRECTION\", words = [1] }, { write = \"RUN\", words = [1] }",
            "{ write = \"RUN\", words = [1, 7] }",
        );
    let family = family_of(read(&text).unwrap_or_else(|refusals| panic!("{refusals}")));
    let mut rig = contract(family, family.simulated_options()).rig();
    rig.drive.status().await.expect("it answers");
    give(&mut rig, 30).await;
    for direction in [Direction::Forward, Direction::Reverse] {
        rig.drive.start(direction).await.unwrap_or_else(|error| panic!("{direction}: {error}"));
        assert_eq!(rig.drive.lease().map(|lease| lease.word), Some(1), "{direction}");
        assert_eq!(rig.drive.run_word_for(direction), Some(1), "{direction}");
        let status = rig.drive.status().await.expect("it answers");
        assert!(!matches!(status.verdict, None | Some(Verdict::NotInForce { .. })), "{:?}", status.verdict);
    }
}

/// The same drive, driven by a profile that has one place otherwise than the machine.
fn misread(name: &str, key: &str, place: &str, by: &str) -> Rig {
    let text = text(name);
    assert_eq!(text.matches(place).count(), 1, "{place}");
    let (of, other) = (family(key), family_of(read(&text.replace(place, by)).expect("it is right")));
    let options = of.simulated_options();
    let open = move |port, slave| other.open_with(port, slave, &options);
    Contract::new(other.capabilities(), open, move || of.machine(SetUp::ForTheBus).expect("it has a twin"))
        .rig()
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_the_other_way_than_it_was_told_is_not_confirmed() {
    let mut rig =
        misread("invt/goodrive", "goodrive", "forward = 1, reverse = 2", "forward = 2, reverse = 1");
    give(&mut rig, 20).await;
    let error = rig.drive.start(Direction::Forward).await.expect_err("it turns in reverse");
    assert!(matches!(error, Error::NotConfirmed { .. }), "{error}");
    assert!(rig.drive.lease().is_some(), "it may run by us all the same");
}

/// A V20 carries out the valid words of a block that it refuses.
#[tokio::test(start_paused = true)]
async fn an_exception_to_a_run_command_is_no_proof_that_nothing_was_done() {
    let mut rig = misread("invt/goodrive", "goodrive", "address = 0x2000", "address = 0x2010");
    give(&mut rig, 20).await;
    let error = rig.drive.start(Direction::Forward).await.expect_err("it is refused");
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    assert!(rig.drive.lease().is_some());
}

/// 14h of an iG5A: "write disabled" (p. 11-3). By the twin of another file the write of the setpoint gets 02h: as one of the codes that a profile
/// lists it says that nothing was done, and as one that it does not list it says nothing.
#[tokio::test(start_paused = true)]
async fn an_exception_that_the_profile_lists_says_what_the_drive_has_done() {
    let key = "exceptions = { list = [[7, \"no_such_register\"], [8, \"not_now\"], [9, \"not_now\"]], source = \"manuals\" }";
    let moved = text("invt/goodrive").replace("address = 0x2001", "address = 0x2011");
    let listed =
        |list: &str| moved.replace(key, &format!("exceptions = {{ list = {list}, source = \"manuals\" }}"));
    for (text, said) in [
        (listed("[[2, \"not_now\"]]"), "the drive refuses it now"),
        (listed("[[2, \"value_refused\"]]"), "the drive does not take this value"),
        (moved.clone(), "the drive does not have this register"),
    ] {
        let mut rig = over_the_twin_without_its_guard(&text);
        let error =
            rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect_err("it is refused");
        assert_eq!(error.kind(), ErrorKind::Exception, "{error}");
        assert!(error.to_string().contains(said), "{error}");
    }
    for (key, code) in [("ig5a", 0x14), ("wj200", 0x21), ("mx2", 0x22), ("goodrive", 9)] {
        let file = shipped::find(key).expect("it is shipped").file();
        let listed = file.link.get_ref().exceptions.as_ref().expect("its manual has some").get_ref();
        assert!(listed.list.iter().any(|(listed, _)| *listed == code), "{key} {code:02X}h");
    }
}

/// A Goodrive's file with a guard on its fault, which reads otherwise once it has tripped.
fn with_guard() -> String {
    let guard =
        "guards = [{ what = \"it has not tripped\", register = \"FAULT\", is = [0], source = \"manuals\" }]";
    text("invt/goodrive").replace("guards = \"none\"", guard)
}

/// A drive whose guard reads otherwise once it has tripped, as a bit does that tells who commands just now.
fn guarded() -> Rig {
    over_the_twin_without_its_guard(&with_guard())
}

/// The twin of a file holds its guards. That of the one without shows its state.
fn over_the_twin_without_its_guard(text: &str) -> Rig {
    let driven = family_of(read(text).expect("it is right"));
    let twin = family("goodrive");
    let options = twin.simulated_options();
    Contract::new(
        driven.capabilities(),
        move |port, slave| driven.open_with(port, slave, &options),
        move || twin.machine(SetUp::ForTheBus).expect("it has a twin"),
    )
    .rig()
}

/// The stop word of a Goodrive: 5 in 2000h.
fn stops(rig: &Rig) -> usize {
    let stop = [0x06, 0x20, 0x00, 0x00, 0x05];
    rig.machine.received().iter().filter(|request| request.pdu[..] == stop).count()
}

/// The run word may stand in the drive, and act when the place of control comes back: a stop is withheld only from a drive in which this
/// side has run nothing.
#[tokio::test(start_paused = true)]
async fn a_stop_and_a_withdrawal_go_to_a_drive_that_was_run_from_here_whatever_its_guards_read_since() {
    for (withdraws, adopts) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut rig = guarded();
        if adopts {
            rig.drive.adopt(drive_core::Lease::new(Direction::Forward, 1));
        } else {
            give(&mut rig, 20).await;
            rig.drive.start(Direction::Forward).await.expect("it starts");
        }
        rig.machine.trip(9);
        rig.drive.forget();
        rig.drive.status().await.expect("it is read all the same");
        let identity = drive_core::Identity::default();
        assert_eq!(rig.drive.recognise(&identity), drive_core::Recognised::CannotTell);
        let refused = rig.drive.start(Direction::Forward).await.expect_err("nothing but a stop");
        assert_eq!((refused.kind(), stops(&rig)), (ErrorKind::Refused, 0), "{refused}");
        if withdraws {
            rig.drive.withdraw().await.expect("it takes it");
        } else {
            rig.drive.stop(StopMode::Ramp).await.expect("it takes it");
        }
        assert!(stops(&rig) >= 1 && rig.drive.lease().is_none(), "{withdraws} {adopts}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_is_withheld_says_that_nothing_was_sent_what_was_read_and_what_was_wanted() {
    let mut rig = guarded();
    rig.machine.trip(9);
    rig.drive.status().await.expect("it is read all the same");
    let error = rig.drive.stop(StopMode::Ramp).await.expect_err("it is set up for something else");
    assert_eq!((error.kind(), stops(&rig)), (ErrorKind::Refused, 0), "{error}");
    let told = error.to_string();
    let advice = "FAULT reads 9): set FAULT to 0 at the drive";
    assert!(told.contains(advice) && !told.contains("change the family"), "{told}");
}

/// Once the guards have held, a mode may be a run command where they read otherwise now: 7 in the I/O profile of an Altivar.
#[tokio::test(start_paused = true)]
async fn a_stop_of_a_drive_that_is_set_up_otherwise_by_now_is_the_one_that_is_a_stop_in_any_case() {
    let text = with_guard().replace("unread = \"ramp\"", "unread = \"freewheel\"");
    let mut rig = over_the_twin_without_its_guard(&text);
    give(&mut rig, 20).await;
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.trip(9);
    rig.drive.forget();
    rig.drive.status().await.expect("it is read all the same");
    let stopped = rig.drive.stop(StopMode::Ramp).await.expect("it takes it");
    assert_eq!((stopped.mode, stops(&rig)), (StopMode::Freewheel, 0));
    assert!(stopped.instead.is_some());
}

/// A drive without supply, or just switched on, shows no output, and its shaft may turn all the same.
#[tokio::test(start_paused = true)]
async fn a_motor_that_turned_before_it_was_first_seen_is_not_told_at_rest() {
    for cycles in [false, true] {
        let mut rig = rig("v20");
        for (register, word) in [(100, 8_192), (99, 0x047E), (99, 0x047F)] {
            rig.machine.written_by_another(register, word).expect("it takes it");
        }
        tokio::time::sleep(Duration::from_secs(6)).await;
        if cycles {
            rig.machine.power_cycle();
        } else {
            rig.machine.motor_supply(false);
        }
        let status = rig.drive.status().await.expect("it answers");
        assert!(rig.machine.observe().shaft_frequency > 2_000, "it turns");
        assert!(!status.is_standstill() && status.output_frequency == Some(Frequency::ZERO), "{status}");
    }
}

/// `worlds --story 8.3.0.o5.l2.o8.e10.o1.l1` of `drive-fire`: told at rest at 6.7 Hz, behind more than half of the time that the ramp would
/// have taken.
#[tokio::test(start_paused = true)]
async fn a_motor_whose_output_is_cut_in_a_ramp_is_not_told_at_rest_whether_or_not_its_supply_is_back() {
    for comes_back in [false, true] {
        let mut rig = running("v20").await;
        rig.drive.stop(StopMode::Ramp).await.expect("it is seen to come down");
        tokio::time::sleep(Duration::from_millis(400)).await;
        assert_eq!(rig.drive.status().await.expect("it answers").motion, Motion::Braking);
        rig.machine.motor_supply(false);
        if comes_back {
            rig.machine.motor_supply(true);
        }
        tokio::time::sleep(Duration::from_millis(600)).await;
        let status = rig.drive.status().await.expect("it answers");
        let seen = rig.machine.observe();
        assert!(seen.shaft_frequency > 1_000 && !seen.running, "{seen:?}");
        assert_eq!(status.motion, Motion::Coasting, "{comes_back}: {status}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_shaft_is_told_at_rest_by_what_its_file_names_for_that() {
    let told = "standstill = { register = \"ZSW\", mask = 0x4000, value = 0x4000, source = \"oi2012 wb\" }";
    for (standstill, end) in [("standstill = \"unknown\"", Motion::Coasting), (told, Motion::AtRest)] {
        let text = text("siemens/v20").replace("standstill = \"unknown\"", standstill);
        let family = family_of(read(&text).unwrap_or_else(|refusals| panic!("{refusals}")));
        let mut rig = contract(family, family.simulated_options()).rig();
        assert_eq!(rig.drive.status().await.expect("it answers").motion, end, "it was never seen to turn");
        give(&mut rig, 30).await;
        rig.drive.start(Direction::Forward).await.expect("it starts");
        rig.until_machine("it is at its setpoint", |machine| machine.output_frequency == 3_000).await;
        rig.drive.stop(StopMode::Freewheel).await.expect("it stops");
        assert_eq!(rig.drive.status().await.expect("it answers").motion, Motion::Coasting);
        let status = rig.until_machine("it stands", |machine| machine.shaft_frequency == 0).await;
        assert_eq!(status.motion, end);
    }
}

/// Its profile has another word for reverse than the machine: the word is taken, and acts on nothing. What turns still turns by its stop.
#[tokio::test(start_paused = true)]
async fn a_start_is_not_confirmed_by_a_motor_that_still_comes_down_from_a_stop_of_this_side() {
    let mut rig = misread("danfoss/danfoss-fc", "danfoss-fc", "words = [0x847C]", "words = [0x845C]");
    give(&mut rig, 30).await;
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_machine("it is at its setpoint", |machine| machine.output_frequency == 3_000).await;
    rig.drive.stop(StopMode::Ramp).await.expect("it is seen to come down");
    let error = rig.drive.start(Direction::Reverse).await.expect_err("it comes down, and that is all");
    assert!(matches!(error, Error::NotConfirmed { .. }), "{error}");
    assert!(rig.drive.lease().is_some(), "the word may act all the same");
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    // What acts is confirmed, out of the same ramp.
    rig.until_machine("it stands", |machine| machine.shaft_frequency == 0).await;
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_machine("it is at its setpoint", |machine| machine.output_frequency == 3_000).await;
    rig.drive.stop(StopMode::Ramp).await.expect("it is seen to come down");
    rig.drive.start(Direction::Forward).await.expect("it rises again");
}

/// The word that clears it goes to a register that the drive refuses: the fault is gone, and the reset stands.
#[tokio::test(start_paused = true)]
async fn a_reset_whose_clearing_word_was_not_written_is_not_told_done() {
    let other = "[register.STW2]\nwhat = \"another\"\naddress = 40103\naccess = \"read_write\"\nstorage = \"ram\"\nsource = \"oi2012 wb\"\n\n[register.HSW]\n";
    let text = text("siemens/v20")
        .replacen("[register.HSW]\n", other, 1)
        // A stop of its own leaves the run word standing: only where that acts by an edge.
        .replace("acts = \"level\"", "acts = \"edge\"")
        .replace(
            "{ write = \"STW\", words = [0x047C] }], seen",
            "{ write = \"STW2\", words = [0x047C] }], seen",
        )
        .replace(
            "{ write = \"STW\", words = [0x047E] }], clears_itself",
            "{ write = \"STW2\", words = [0x047C] }], clears_itself",
        );
    let (of, other) = (family("v20"), family_of(read(&text).unwrap_or_else(|refusals| panic!("{refusals}"))));
    let options = of.simulated_options();
    let open = move |port, slave| other.open_with(port, slave, &options);
    let machine = move || of.machine(SetUp::ForTheBus).expect("it has a twin");
    let mut rig = Contract::new(other.capabilities(), open, machine).rig();
    rig.machine.trip(9);
    rig.until("the trip", |status| status.state == State::Fault).await;
    let error = rig.drive.reset_faults().await.expect_err("its reset bit may stand");
    assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{error}");
    let to = |register: u16| {
        let [a, b] = register.to_be_bytes();
        rig.machine.received().iter().filter(|request| request.pdu.starts_with(&[6, a, b])).count()
    };
    assert!(to(102) > 1, "a level is written again: {}", to(102));
    let rises =
        rig.machine.received().iter().filter(|request| request.pdu[..] == [6, 0, 99, 0x04, 0xFE]).count();
    assert_eq!(rises, 1, "an edge goes out once");
}

/// Its reference comes from elsewhere; the register of the bus holds what was written all the same.
#[tokio::test(start_paused = true)]
async fn a_setpoint_that_only_reads_back_is_not_confirmed_while_the_motor_runs_on_as_before() {
    let other = "[register.ELSEWHERE]\nwhat = \"another\"\naddress = 40103\naccess = \"read_write\"\nstorage = \"ram\"\nunit = \"%\"\nscale = [100, 16384]\nsigned = true\nsource = \"oi2012 wb\"\n\n[register.HSW]\n";
    let machine = text("siemens/v20")
        .replacen("[register.HSW]\n", other, 1)
        .replace("setpoint = \"HSW\"", "setpoint = \"ELSEWHERE\"")
        .replace("register = \"HSW\"", "register = \"ELSEWHERE\"");
    let (of, machine) =
        (family("v20"), family_of(read(&machine).unwrap_or_else(|refusals| panic!("{refusals}"))));
    let options = of.simulated_options();
    let open = move |port, slave| of.open_with(port, slave, &options);
    let twin = move || machine.machine(SetUp::ForTheBus).expect("it has a twin");
    let mut rig = Contract::new(of.capabilities(), open, twin).rig();
    rig.machine.written_by_another(102, 9_830).expect("30 Hz");
    let error =
        rig.drive.set_setpoint(Frequency::from_hertz(10).into()).await.expect_err("at rest nothing shows it");
    assert!(error.only_a_start_shows(), "{error}");
    give(&mut rig, 30).await;
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_machine("it is at 30 Hz", |machine| machine.output_frequency > 2_990).await;
    let error = rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect_err("it runs at 30 Hz");
    assert!(matches!(error, Error::NotConfirmed { .. }), "{error}");
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    // Where it follows, it is seen to.
    for key in DRIVEN {
        let mut rig = running(key).await;
        give(&mut rig, 20).await;
        rig.until_machine("it follows", |machine| machine.output_frequency.abs_diff(2_000) < 10).await;
    }
}

/// Goodrive: 5 stops along the ramp, 6 lets coast, 1 and 2 run; V20 and G120: OFF1 is 047Eh, OFF3 047Ah, OFF2 047Ch, ON 047Fh. A GS4 tells 1 in one
/// register for both directions, and its stop is 0 there; a WJ200 is stopped by a coil.
#[tokio::test]
async fn the_word_of_a_stop_by_another_master_is_known_as_one_and_no_other_word_is() {
    use drive_core::Intent;
    let rows = [
        ("goodrive", 0x2000, 5, Some(StopMode::Ramp)),
        ("goodrive", 0x2000, 6, Some(StopMode::Freewheel)),
        ("goodrive", 0x2000, 1, None),
        ("goodrive", 0x2000, 2, None),
        ("goodrive", 0x2001, 5, None),
        ("v20", 99, 0x047E, Some(StopMode::Ramp)),
        ("v20", 99, 0x047A, Some(StopMode::Fast)),
        ("v20", 99, 0x047C, Some(StopMode::Freewheel)),
        ("v20", 99, 0x047F, None),
        ("wj200", 0, 0, None),
    ];
    for (key, register, word, stop) in rows {
        let intent = rig(key).drive.intent(register, word).await;
        assert_eq!(intent.ok().flatten(), stop.map(Intent::Stop), "{key} {register:04X}h {word:04X}h");
    }
}

/// A WJ200 and an MX2 run by their coil RUN, beside which stands that of the direction; words may be a stop together.
#[tokio::test]
async fn a_stop_by_a_coil_or_by_several_registers_is_known_among_all_that_is_written_at_once_and_only_whole()
{
    use drive_core::registers::{Place, Space};
    let ramp = Some(StopMode::Ramp);
    for key in ["wj200", "mx2"] {
        let drive = rig(key).drive;
        let row = drive.capabilities().rows.iter().find(|row| row.code == "RUN").expect("it has one");
        let run = row.place();
        assert_eq!(run.space, Space::Coil);
        let beside = Place { address: run.address + 1, ..run };
        for (written, stop) in [
            (&[(run, 0)][..], ramp),
            (&[(run, 0), (beside, 1)], ramp),
            (&[(run, 1), (beside, 0)], None),
            (&[(beside, 0)], None),
            // The register of that number.
            (&[(Place::from(run.address), 0)], None),
        ] {
            assert_eq!(drive.stopped_by(written), stop, "{key} {written:?}");
        }
    }
    let together = text("delta/ms300").replace("words = [0x0001] }], seen", "words = [1, 0] }], seen");
    let of = family_of(read(&together).expect("it is right"));
    let mut drive = contract(of, of.simulated_options()).rig().drive;
    let [one, other, third] = [0x2000, 0x2001, 0x2002].map(Place::from);
    for (written, stop) in [
        (&[(one, 1), (other, 0)][..], ramp),
        (&[(one, 1), (other, 0), (third, 7)], ramp),
        (&[(one, 1)], None),
        (&[(one, 1), (other, 1)], None),
    ] {
        assert_eq!(drive.stopped_by(written), stop, "{written:?}");
    }
    assert!(drive.intent(0x2000, 1).await.is_err(), "half of it is none");
}

/// A Goodrive that takes every stop and runs on by the bus, at 20 Hz.
#[tokio::test(start_paused = true)]
async fn who_follows_a_stop_that_is_not_obeyed_hears_of_each_status_that_is_read_for_it() {
    let family = family("goodrive");
    let runs = [(0x2000, 1), (0x2100, 1), (0x2101, 0x0040), (0x3000, 2_000), (0x3001, 2_000)];
    let mut words = drive_testing::words::Words::new(family.capabilities(), &runs);
    words.deaf = true;
    let mut drive = family.open_with(words, 1.try_into().unwrap(), &family.simulated_options());
    let (follower, mut followed) = tokio::sync::watch::channel(None);
    drive.follow_stops(follower);
    let mut stop = std::pin::pin!(drive.stop(StopMode::Ramp));
    let mut heard = 0;
    let stopped = loop {
        tokio::select! {
            biased;
            stopped = &mut stop => break stopped,
            told = followed.changed() => {
                told.expect("the drive is there");
                let status = followed.borrow_and_update().clone().expect("it is told").status;
                assert_eq!((status.state, status.verdict), (State::Running, None), "{status:?}");
                heard += 1;
            }
        }
    };
    assert!(stopped.is_err() && heard > 10, "{heard}: {stopped:?}");
}
