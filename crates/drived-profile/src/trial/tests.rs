//! A trial with a simulated drive and a person beside it.

use drive_bus::{Line, LineConfig};
use drive_core::{SerialSettings, serial::CharacterFormat};
use drive_families::{SetUp, simulated};
use drive_profile::read;
use drive_sim::{Panel, SimLine, SimSlave, Wiring};
use drived_words::signals::Ending;
use tokio::{
    io::{AsyncWriteExt as _, BufReader, DuplexStream, duplex},
    time::{Instant, sleep},
};

use super::*;

/// A V20 on a line, by its own profile or by one that has a place otherwise.
fn steps(change: (&str, &str)) -> (Steps, SimSlave) {
    let (_, text) = shipped::TEXTS.iter().find(|(name, _)| *name == "siemens/v20").expect("it is shipped");
    let profile = read(&text.replace(change.0, change.1)).unwrap_or_else(|refusals| panic!("{refusals}"));
    let settings = SerialSettings::new(9_600, CharacterFormat::F8E1).expect("it is one");
    let sim = SimLine::new(Wiring::rtu(settings));
    let twin = family(shipped::find("v20").expect("it is shipped").clone());
    let model = simulated::model(twin, SetUp::ForTheBus).expect("it has a twin");
    let machine = sim.add_boxed(3, model).expect("nobody has the address");
    let config = LineConfig::stream(settings);
    let line = Line::over(sim.in_memory(), config.clone());
    let slave = SlaveAddress::try_from(3).expect("it is one");
    let name = DriveName { family: family(profile), slave };
    let options = twin.simulated_options();
    (Steps { name, line, config, options, lowest: Frequency::from_hertz(5) }, machine)
}

async fn says(answers: &mut DuplexStream, lines: &[&str]) {
    for line in lines {
        answers.write_all(format!("{line}\n").as_bytes()).await.expect("it is read");
    }
}

/// The person: compares, starts and stops the motor at the panel, and answers what is asked.
async fn person(mut answers: DuplexStream, machine: SimSlave, last: &'static str) -> DuplexStream {
    for act in [Panel::TakeControl, Panel::Reference(Frequency::from_hertz(10)), Panel::Run] {
        machine.panel(act);
    }
    says(&mut answers, &["yes", ""]).await;
    machine.wait_until(|seen| seen.output_frequency == 1_000).await;
    says(&mut answers, &["yes"]).await;
    machine.panel(Panel::Stop);
    machine.wait_until(|seen| seen.shaft_frequency == 0).await;
    machine.panel(Panel::ReleaseControl);
    says(&mut answers, &["", "yes", "", "yes", last]).await;
    if last == "v20" {
        machine.wait_until(|seen| seen.running).await;
        says(&mut answers, &["yes"]).await;
        machine.wait_until(|seen| !seen.running).await;
        says(&mut answers, &["yes"]).await;
    }
    answers
}

#[tokio::test(start_paused = true)]
async fn a_person_climbs_with_the_drive_and_what_was_seen_is_noted() {
    let (steps, machine) = steps(("", ""));
    let (answers, asked) = duplex(4_096);
    let person = tokio::spawn(person(answers, machine.clone(), "v20"));
    let mut seen = Vec::new();
    let reached = steps.climb(&mut Console::reading(BufReader::new(asked)), &mut seen).await;
    assert_eq!(reached.expect("it climbs"), Reached::Started);
    drop(person.await);
    assert_eq!(seen.len(), 4, "{seen:#?}");
    assert!(seen[3].contains("5.00 Hz"), "{seen:#?}");
    assert!(!machine.observe().running);
}

/// The person types the drive's name, and then presses Ctrl-C instead of an answer: the motor runs, and nobody stands by it any more.
#[tokio::test(start_paused = true)]
async fn a_person_who_asks_to_end_while_the_motor_runs_leaves_it_stopped() {
    let (steps, machine) = steps(("", ""));
    let (answers, asked) = duplex(4_096);
    let of = machine.clone();
    let (runs, mut ran) = tokio::sync::oneshot::channel();
    let person = tokio::spawn(async move {
        // All but the answers after the start, which do not come.
        let answers = person(answers, of.clone(), "v20 ").await;
        of.wait_until(|seen| seen.running).await;
        runs.send(()).expect("it is waited for");
        std::future::pending::<()>().await;
        drop(answers);
    });
    let mut console = Console::reading(BufReader::new(asked));
    let mut ending = Ending::listen().expect("it listens");
    ending.at(Instant::now() + std::time::Duration::from_secs(300));
    console.hear(ending);
    let mut seen = Vec::new();
    let failed = steps.climb(&mut console, &mut seen).await;
    person.abort();
    let failure = failed.expect_err("the trial ends").to_string();
    assert!(failure.contains("asked to end") && seen.len() == 3, "{failure}: {seen:#?}");
    sleep(std::time::Duration::from_secs(5)).await;
    assert!(ran.try_recv().is_ok() && !machine.observe().running);
}

#[tokio::test(start_paused = true)]
async fn the_motor_is_started_only_by_the_drives_name() {
    for answer in ["yes", "V20 ", ""] {
        let (steps, machine) = steps(("", ""));
        let (answers, asked) = duplex(4_096);
        let person =
            tokio::spawn(person(answers, machine.clone(), if answer == "V20 " { "v21" } else { answer }));
        let mut seen = Vec::new();
        let reached = steps.climb(&mut Console::reading(BufReader::new(asked)), &mut seen).await;
        assert_eq!(reached.expect("it ends there"), Reached::Read, "its stop found the motor at rest");
        drop(person.await);
        assert_eq!(seen.len(), 3, "{seen:#?}");
        // 047Fh, bit 0 with the bits that let it run: the word that runs a V20.
        let runs = machine.received().iter().any(|request| request.pdu.ends_with(&[0x04, 0x7F]));
        assert!(!runs && !machine.observe().running);
    }
}

#[tokio::test(start_paused = true)]
async fn a_profile_whose_states_are_not_those_of_the_drive_goes_no_further_and_writes_nothing() {
    // Bit 1 of the status word for "running", which a V20 has for "ready to run".
    let (steps, machine) = steps(("mask = 0x0004, value = 0x0004", "mask = 0x0002, value = 0x0002"));
    let (answers, asked) = duplex(4_096);
    let person = tokio::spawn(person(answers, machine.clone(), ""));
    let mut seen = Vec::new();
    let failed = steps.climb(&mut Console::reading(BufReader::new(asked)), &mut seen).await;
    person.abort();
    let failure = failed.expect_err("the drive runs, and its profile does not see it").to_string();
    assert!(failure.contains("the states of the profile are not those of this drive"), "{failure}");
    assert!(machine.received().iter().all(|request| request.pdu.first() == Some(&3)), "nothing was written");
}

/// A setpoint that is counted ten times as large reads back as it was written: the motor alone tells, and is stopped before anybody has
/// answered.
#[tokio::test(start_paused = true)]
async fn a_motor_that_does_not_turn_at_what_was_given_is_stopped_at_once_and_nothing_is_signed() {
    let of_the_setpoint = |scale| format!("{scale}\nsigned = true\nsource = \"oi2012 wb\"\n\n[register.ZSW]");
    for scale in ["scale = [10, 16384]", "scale = [150, 16384]"] {
        let (right, wrong) = (of_the_setpoint("scale = [100, 16384]"), of_the_setpoint(scale));
        let (steps, machine) = steps((&right, &wrong));
        let (answers, asked) = duplex(4_096);
        let person = tokio::spawn(person(answers, machine.clone(), "v20"));
        let mut seen = Vec::new();
        let answered = steps.climb(&mut Console::reading(BufReader::new(asked)), &mut seen).await;
        drop(person.await);
        let failure = answered.expect_err("it is not what was given").to_string();
        assert!(failure.contains("at a setpoint of 5.00 Hz: the scale of the one or the other"), "{failure}");
        assert!(!machine.observe().running && seen.len() == 3, "{seen:#?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_person_who_does_not_agree_or_has_gone_ends_it() {
    for said in ["no\n", ""] {
        let (steps, machine) = steps(("", ""));
        let (mut answers, asked) = duplex(4_096);
        answers.write_all(said.as_bytes()).await.expect("it is read");
        drop(answers);
        let mut seen = Vec::new();
        let failed = steps.climb(&mut Console::reading(BufReader::new(asked)), &mut seen).await;
        assert!(failed.is_err() && seen.is_empty(), "{said:?}");
        assert!(
            machine.received().iter().all(|request| request.pdu.first() == Some(&3)),
            "nothing was written"
        );
    }
}
