//! What a wrong daemon would tell, or its machines do, and whether that is taken for wrong.

use std::time::{Duration, Instant};

use drive_core::{Direction, Frequency, Motion, State, Status, Verdict};
use drive_sim::Observation;
use serde_json::json;

use super::{
    super::{GROWTH, judge as of_program},
    judge::{self, Said},
    simulator::Look,
};
use crate::report::{Plant, Told};

/// A second in which a machine is looked at each quarter, with these outputs in hertz, and what was told in its middle of 200 ms before.
struct Second {
    begun: Instant,
    looks: Vec<Look>,
}

fn seen(hertz: i32) -> Observation {
    let hundredths = 100 * hertz;
    let running = hertz != 0;
    Observation {
        running,
        output_frequency: hundredths,
        shaft_frequency: hundredths,
        setpoint: hundredths,
        ..Observation::default()
    }
}

impl Second {
    fn of(outputs: [i32; 8]) -> Self {
        let begun = Instant::now();
        let look = |(at, hertz): (u64, i32)| {
            let asked = begun + Duration::from_millis(250 * at);
            Look { asked, told: asked + Duration::from_millis(2), life: 1, seen: seen(hertz) }
        };
        Self { begun, looks: (0..).zip(outputs).map(look).collect() }
    }

    fn said(&self, age_ms: u64, status: Status) -> Said {
        let asked = self.begun + Duration::from_millis(1_300);
        Said {
            asked,
            told: asked + Duration::from_millis(5),
            status,
            is_good: true,
            age: Duration::from_millis(age_ms),
            is_owned: true,
            misses: 0,
        }
    }

    fn judged(&self, age_ms: u64, status: Status) -> Result<(), String> {
        let said = self.said(age_ms, status);
        let around = judge::around(&said, false, &self.looks).ok_or("it was not looked at")?;
        judge::status(&said, around)
    }
}

/// A drive that is driven at so many hertz, as it tells it.
fn driven(hertz: u16) -> Status {
    Status {
        state: State::Running,
        direction: Some(Direction::Forward),
        output_frequency: Some(Frequency::from_hertz(hertz)),
        reference: Some(Frequency::from_hertz(hertz)),
        at_reference: Some(true),
        verdict: Some(Verdict::InForce),
        motion: Motion::Driven,
        ..Status::default()
    }
}

/// One that is told at rest.
fn at_rest() -> Status {
    let output_frequency = Some(Frequency::ZERO);
    Status { state: State::Ready, output_frequency, motion: Motion::AtRest, ..Status::default() }
}

/// Each of them.
pub(in super::super) fn find() -> Told {
    let begun = Instant::now();
    let mut told = Told::new("the program with the host's faults, against planted defects", "answers");
    let runs = Second::of([30; 8]);
    let stands = Second::of([0; 8]);
    let mut coasts = Second::of([0; 8]);
    for look in &mut coasts.looks {
        look.seen.shaft_frequency = 900;
    }
    let unowned = |outputs: [i32; 8]| {
        let second = Second::of(outputs);
        let said = Said { is_owned: false, ..second.said(100, driven(30)) };
        judge::is_owned([&said, &said], [&second.looks[0], &second.looks[1], &second.looks[2]])
    };
    let machines = |hertz| [("pump", seen(0)), ("fan", seen(hertz))];
    let wrong = [
        ("a status of before the daemon stood still, told as of now", runs.judged(200, driven(12))),
        ("one that is told at rest, and runs", runs.judged(200, at_rest())),
        ("one that is told at rest, and coasts", coasts.judged(200, at_rest())),
        ("one that is told to run, and stands", stands.judged(200, driven(30))),
        ("one that is told in force at another reference", {
            let reference = Some(Frequency::from_hertz(40));
            runs.judged(200, Status { reference, ..driven(30) })
        }),
        ("a status that is too old and told as good", {
            judge::status(&stands.said(3_400, at_rest()), &stands.looks)
        }),
        ("a motor that runs and is nobody's", unowned([30; 8])),
        ("a motor that comes up and is nobody's", unowned([2, 6, 10, 14, 18, 22, 26, 30])),
        ("a confirmed stop, and the motor is driven", judge::stands(&seen(12), true)),
        ("a confirmed stop, and the motor coasts", {
            judge::stands(&Observation { shaft_frequency: 900, ..Observation::default() }, false)
        }),
        ("a stop that is refused", refuses(&json!({"id": "a", "outcome": "refused", "open": false}))),
        ("a stop of which nothing more is told", {
            refuses(&json!({"id": "a", "outcome": "not_confirmed", "open": false}))
        }),
        ("a stop that is answered by nothing", refuses(&json!({}))),
        ("a stop that is told after five minutes", judge::in_time(Duration::from_secs(300))),
        ("the end: it does not end", judge::end(None, &machines(0))),
        ("the end: it is killed", judge::end(Some(None), &machines(0))),
        ("the end: a motor was given up", judge::end(Some(Some(1)), &machines(0))),
        ("the end: a motor runs behind it", judge::end(Some(Some(0)), &machines(20))),
        ("the daemon: a panic in its log", of_program::log("a\nthread 'line' panicked at x.rs\n")),
        ("the daemon: it keeps what it was told", of_program::memory(50_000, 150_000, GROWTH)),
    ];
    for (name, held) in wrong {
        told.count += 1;
        told.plants.push(Plant { name: name.to_owned(), found_by: held.err() });
    }
    told.took = begun.elapsed();
    told
}

fn refuses(answer: &serde_json::Value) -> Result<(), String> {
    judge::stop(409, answer).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use judge::Stopped;

    #[test]
    fn each_wrong_answer_is_found() {
        let told = find();
        assert_eq!(told.plants_found(), told.plants.len(), "{told}");
    }

    #[test]
    fn what_is_right_is_taken_for_right() {
        assert_eq!(Second::of([30; 8]).judged(200, driven(30)), Ok(()));
        assert_eq!(Second::of([0; 8]).judged(200, at_rest()), Ok(()));
        // It comes up: what it showed a moment ago is not what it shows now.
        let up = Second::of([0, 4, 8, 12, 16, 20, 24, 28]);
        assert_eq!(up.judged(200, Status { at_reference: Some(false), ..driven(14) }), Ok(()));
        // It was fresh when it was asked for, and the daemon stood still before it told so.
        let stands = Second::of([0; 8]);
        let said = stands.said(3_400, at_rest());
        let late = Said { told: said.asked + Duration::from_millis(600), ..said };
        assert_eq!(judge::status(&late, &stands.looks), Ok(()));
        // It coasted, was started, and told so before its simulator was killed; the next is another one.
        let mut coasts = Second::of([0; 8]);
        for (look, hertz) in coasts.looks.iter_mut().zip([16, 15, 14, 13, 12, 11]) {
            look.seen.shaft_frequency = 100 * hertz;
        }
        let killed = coasts.begun + Duration::from_millis(1_100);
        coasts.looks.retain(|look| look.told <= killed);
        let asked = coasts.begun + Duration::from_millis(2_600);
        coasts.looks.push(Look { asked, told: asked, life: 2, seen: seen(0) });
        assert_eq!(coasts.judged(120, driven(13)), Ok(()));
        // What is told as old is judged by nobody.
        let runs = Second::of([30; 8]);
        let stale = Said { is_good: false, ..runs.said(200, at_rest()) };
        assert_eq!(judge::status(&stale, &runs.looks), Ok(()));
        // It comes down behind a stop.
        let down = Second::of([30, 26, 22, 18, 14, 10, 6, 2]);
        let said = Said { is_owned: false, ..down.said(200, driven(10)) };
        assert_eq!(judge::is_owned([&said, &said], [&down.looks[0], &down.looks[1], &down.looks[2]]), Ok(()));
        assert_eq!(judge::stands(&seen(0), false), Ok(()));
        let coasts = Observation { shaft_frequency: 900, ..Observation::default() };
        assert_eq!(judge::stands(&coasts, true), Ok(()), "it was told to coast");
        let confirmed =
            |motion: &str| judge::stop(200, &json!({"outcome": "confirmed", "status": {"motion": motion}}));
        assert_eq!(confirmed("at_rest"), Ok(Stopped::Confirmed { may_coast: false }));
        assert_eq!(confirmed("coasting"), Ok(Stopped::Confirmed { may_coast: true }));
        let open = json!({"id": "a", "outcome": "pending", "open": true});
        assert_eq!(judge::stop(202, &open), Ok(Stopped::Open("a".to_owned())));
        assert_eq!(judge::end(Some(Some(0)), &[("pump", seen(0))]), Ok(()));
    }

    #[test]
    fn a_status_is_judged_by_looks_around_all_of_it_and_by_no_others() {
        let runs = Second::of([30; 8]);
        let around = |age_ms, missed| judge::around(&runs.said(age_ms, at_rest()), missed, &runs.looks);
        // From half a second before it was read until behind it was told.
        assert_eq!(around(200, false).map(<[_]>::len), Some(5));
        assert_eq!(around(900, false).map(<[_]>::len), None, "nobody looked before that");
        assert_eq!(around(200, true).map(<[_]>::len), None, "behind a miss it may be older");
    }
}
