//! The table: a defect, and what the doctor says of it. What is expected follows from the defect.

use std::time::Duration;

use drive_core::Percent;
use drive_sim::{ALWAYS, Defects, Fault, Interference, Noise, Rest, SecondMaster};
use tokio::time::sleep;

use super::*;

const TEN_SECONDS: Duration = Duration::from_secs(10);

/// What is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Broken {
    Nothing,
    NoPower,
    OneWithoutPower,
    EchoAndNoPower,
    SecondMaster,
    InterferenceByTheSecond,
    HeldBack(u64),
    InPieces(u64),
    EchoAndPieces(u64),
    SlowByAnEeprom,
    SlowN65,
    Late(u64),
    Deaf(u64),
    Noise(u32),
    BadContactAtTheSecond,
    /// The other drive with the address of the third answers this much later.
    TwoAtTheThird(u64),
    /// A line at another speed or format than ours, where somebody talks.
    OtherSettings(&'static str, bool),
    /// A and B swapped at our adapter, on a line with bias or without, where somebody talks or nobody does.
    Swapped(Rest, bool),
}

/// Who stands on the line.
const FAMILIES: [Family; 3] = [Family::ATV21, Family::OMRON_3G3EV, Family::ATV312];

/// A panel that reads one word of two drives.
fn somebody() -> SecondMaster {
    let requests = vec![(3, vec![3, 0x0C, 0x81, 0, 1]), (2, vec![3, 0, 0x20, 0, 1])];
    SecondMaster { requests, every: Duration::from_millis(250), unheard: None }
}

/// The line with its defect; one that follows time goes on beside the doctor.
async fn broken(broken: Broken, bench: &Bench) {
    let line = &bench.line;
    match broken {
        Broken::Nothing => {}
        Broken::NoPower => bench.machines.iter().for_each(|machine| machine.power(false)),
        Broken::OneWithoutPower => bench.machine(2).power(false),
        Broken::EchoAndNoPower => {
            line.set_fault(Fault::Echo, ALWAYS);
            bench.machines.iter().for_each(|machine| machine.power(false));
        }
        Broken::SecondMaster => {
            line.set_defects(Defects { second_master: Some(somebody()), ..Defects::default() });
        }
        Broken::InterferenceByTheSecond => {
            let interference = Some(Interference { victim: 3, source: 1, rate: 700_000 });
            line.set_defects(Defects { interference, ..Defects::default() });
            let motor = bench.machine(1);
            motor.analog("VIA", Percent::from_percent(50)).unwrap();
            loop {
                motor.terminal("F", true).unwrap();
                motor.wait_until(|seen| seen.running).await;
                sleep(TEN_SECONDS).await;
                motor.terminal("F", false).unwrap();
                motor.wait_until(|seen| !seen.running).await;
                sleep(TEN_SECONDS).await;
            }
        }
        Broken::HeldBack(millis) => {
            let hands_over_every = Some(Duration::from_millis(millis));
            line.set_defects(Defects { hands_over_every, ..Defects::default() });
        }
        Broken::InPieces(millis) => {
            let pauses_inside = Some(Duration::from_millis(millis));
            line.set_defects(Defects { pauses_inside, ..Defects::default() });
        }
        Broken::EchoAndPieces(millis) => {
            line.set_fault(Fault::Echo, ALWAYS);
            let pauses_inside = Some(Duration::from_millis(millis));
            line.set_defects(Defects { pauses_inside, ..Defects::default() });
        }
        Broken::SlowByAnEeprom => bench.machine(3).set_turnaround(Some(Duration::from_millis(180))),
        // n65 is 5 ms, and it waits 60.
        Broken::SlowN65 => bench.machine(2).set_turnaround(Some(Duration::from_millis(60))),
        Broken::Late(millis) => {
            line.set_lateness(Duration::from_millis(millis));
            line.set_fault(Fault::Late, 250_000);
        }
        Broken::Deaf(millis) => bench.machine(3).set_deaf_for(Duration::from_millis(millis)),
        Broken::Noise(share) => {
            let noise = Some(Noise { share, burst: Duration::from_millis(1), seed: 7 });
            line.set_defects(Defects { noise, ..Defects::default() });
        }
        Broken::TwoAtTheThird(micros) => {
            let other =
                line.add_beside(3, simulated::model(Family::ATV312, SetUp::Factory).unwrap()).unwrap();
            other.set_turnaround(Some(Duration::from_micros(5_000 + micros)));
        }
        Broken::OtherSettings(_, talks) => {
            line.set_defects(Defects { second_master: talks.then(somebody), ..Defects::default() });
        }
        Broken::Swapped(rest, talks) => {
            let second_master = talks.then(somebody);
            line.set_defects(Defects { swapped: Some(rest), second_master, ..Defects::default() });
        }
        Broken::BadContactAtTheSecond => {
            let interference = Some(Interference { victim: 2, source: 1, rate: 300_000 });
            line.set_defects(Defects { interference, ..Defects::default() });
            let motor = bench.machine(1);
            motor.analog("VIA", Percent::from_percent(50)).unwrap();
            motor.terminal("F", true).unwrap();
        }
    }
    std::future::pending::<()>().await;
}

/// A defect, and whom it concerns.
type Found = (Defect, &'static [u8]);

/// The table.
const TABLE: &[(Broken, &[Found])] = &[
    (Broken::Nothing, &[]),
    (Broken::NoPower, &[(Defect::NothingHeard, &[])]),
    (Broken::OneWithoutPower, &[(Defect::NoAnswer, &[2])]),
    (Broken::EchoAndNoPower, &[(Defect::OnlyOurEcho, &[])]),
    (Broken::SecondMaster, &[(Defect::SecondMaster, &[])]),
    (Broken::InterferenceByTheSecond, &[(Defect::Interference, &[3])]),
    (Broken::HeldBack(16), &[(Defect::AdapterHoldsBack, &[])]),
    (Broken::HeldBack(32), &[(Defect::AdapterHoldsBack, &[])]),
    (Broken::HeldBack(10), &[(Defect::AdapterHoldsBack, &[])]),
    (Broken::InPieces(25), &[(Defect::AnswersInPieces, &[])]),
    (Broken::InPieces(45), &[(Defect::AnswersInPieces, &[])]),
    (Broken::EchoAndPieces(45), &[(Defect::AnswersInPieces, &[])]),
    (Broken::SlowByAnEeprom, &[(Defect::SlowDrive, &[3])]),
    (Broken::SlowN65, &[(Defect::SlowDrive, &[2])]),
    (Broken::Late(600), &[(Defect::LateAnswers, &[1, 2, 3])]),
    (Broken::Deaf(12), &[(Defect::NeedsPause, &[3])]),
    (Broken::Noise(20_000), &[(Defect::Noise, &[])]),
    (Broken::TwoAtTheThird(300), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(10_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(15_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(20_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(25_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(30_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(35_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(40_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::TwoAtTheThird(45_000), &[(Defect::TwoAtOneAddress, &[3])]),
    (Broken::OtherSettings("9600 8N1", true), &[(Defect::WrongFraming, &[])]),
    // A port without parity hears those who have one: whoever talks there is understood.
    (Broken::OtherSettings("19200 8E1", true), &[(Defect::SecondMaster, &[]), (Defect::WrongFraming, &[])]),
    (Broken::OtherSettings("38400 8O1", true), &[(Defect::WrongFraming, &[])]),
    (Broken::OtherSettings("9600 8N1", false), &[(Defect::NothingHeard, &[])]),
    (Broken::Swapped(Rest::Low, false), &[(Defect::Polarity, &[])]),
    (Broken::Swapped(Rest::High, false), &[(Defect::NothingHeard, &[])]),
    (Broken::Swapped(Rest::Low, true), &[(Defect::Polarity, &[])]),
    (Broken::Swapped(Rest::High, true), &[(Defect::Polarity, &[])]),
    // It runs all the time, so that nobody can tell whether it is the motor.
    (Broken::BadContactAtTheSecond, &[(Defect::DamagedAtOneAddress, &[2])]),
];

fn bench_of(defect: Broken) -> Bench {
    let bench = Bench::of(&FAMILIES);
    match defect {
        Broken::OtherSettings(settings, _) => {
            Bench { serial: bench.serial, ..Bench::at(settings.parse().unwrap(), &FAMILIES) }
        }
        _ => bench,
    }
}

/// What is told of a row that is judged wrongly.
fn misjudged(defect: Broken, expected: &[Found], seen: &Observations) -> String {
    let found = defects(&judge(seen));
    let expected: Vec<_> = expected.iter().map(|(defect, slaves)| (*defect, slaves.to_vec())).collect();
    match found == expected {
        true => String::new(),
        false => format!("\n=== {defect:?}: {found:?}, expected {expected:?}\n{}", told(seen)),
    }
}

#[tokio::test(start_paused = true)]
async fn each_defect_of_a_line_gets_its_verdict_and_no_other() {
    let mut wrong = String::new();
    for (defect, expected) in TABLE {
        let bench = bench_of(*defect);
        let time = if *defect == Broken::InterferenceByTheSecond { 4 * TEN_SECONDS } else { TEN_SECONDS };
        let seen = tokio::select! {
            seen = bench.seen(time) => seen,
            () = broken(*defect, &bench) => unreachable!(),
        };
        wrong.push_str(&misjudged(*defect, expected, &seen));
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[tokio::test(start_paused = true)]
async fn a_line_that_lets_no_question_through_is_told_as_such_and_as_nothing_else() {
    let bench = bench_of(Broken::NoPower);
    let seen = tokio::select! {
        seen = bench.seen(TEN_SECONDS) => seen,
        () = broken(Broken::NoPower, &bench) => unreachable!(),
    };
    let seen = Observations { never_quiet: true, ..seen };
    assert_eq!(defects(&judge(&seen)), [(Defect::NeverQuiet, Vec::new())]);
}

/// All at once, each on a line of its own: it takes as long as the longest, in real time. That makes a machine busy, and what it
/// holds back looks like a defect: a row that is misjudged is looked at once more alone.
#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn on_a_pty_each_defect_gets_the_same_verdict() {
    // A busy machine keeps no time of 10 ms.
    let rows = TABLE.iter().filter(|(defect, _)| *defect != Broken::HeldBack(10));
    let row = async |(index, (defect, expected)): (usize, &'static (Broken, &'static [Found]))| {
        let bench = bench_of(*defect);
        let time = if *defect == Broken::InterferenceByTheSecond { 4 * TEN_SECONDS } else { TEN_SECONDS / 2 };
        let name = index.to_string();
        let seen = tokio::select! {
            seen = bench.seen_on_pty(&name, time) => seen,
            () = broken(*defect, &bench) => unreachable!(),
        };
        misjudged(*defect, expected, &seen)
    };
    let rows: Vec<_> = rows.enumerate().collect();
    let at_once = futures_util::future::join_all(rows.iter().copied().map(row)).await;
    let mut wrong = String::new();
    for (&again, _) in rows.iter().zip(at_once).filter(|(_, misjudged)| !misjudged.is_empty()) {
        wrong.push_str(&row(again).await);
    }
    assert!(wrong.is_empty(), "{wrong}");
}
