//! What every family promises of itself, through `dyn Drive` and the same door as families from outside.

use std::{panic::AssertUnwindSafe, sync::Arc, time::Duration};

use drive_core::{Direction, Frequency, Motion, Status, StopMode, Verdict};
use drive_families::Family;
use drive_sim::models;
use drive_testing::{
    Contract,
    mutants::Mutant,
    witness::{Told, Witnesses},
    worlds::{Configuration, Share, Surrounded},
};
use futures_util::FutureExt;
use support::{contracts::contract, drives};
use tokio::{
    sync::watch,
    time::{Instant, sleep},
};

#[tokio::test(start_paused = true)]
async fn whatever_a_drive_says_nothing_panics_and_only_control_words_of_its_manual_are_written() {
    for family in Family::BUILT_IN {
        contract(family).survives_any_words().await;
    }
}

#[tokio::test]
async fn every_status_word_is_decoded_and_kept_and_says_a_state_that_fits_its_own_words() {
    for family in Family::BUILT_IN {
        contract(family).decodes_every_status_word().await;
    }
}

#[tokio::test]
async fn a_request_beyond_the_words_of_a_family_is_never_sent() {
    for family in Family::BUILT_IN {
        contract(family).sends_no_request_that_is_too_long().await;
    }
}

#[tokio::test(start_paused = true)]
async fn each_exception_has_the_meaning_that_its_manual_gives() {
    for family in Family::BUILT_IN {
        contract(family).explains_its_exceptions().await;
    }
}

#[tokio::test(start_paused = true)]
async fn what_a_family_claims_it_does_and_what_it_does_not_claim_is_unsupported() {
    for family in Family::BUILT_IN {
        contract(family).does_what_it_claims().await;
    }
}

#[tokio::test(start_paused = true)]
async fn the_watchdog_that_a_family_claims_is_the_one_that_it_has() {
    for family in Family::BUILT_IN {
        contract(family).has_the_watchdog_that_it_claims().await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_family_has_a_history_of_faults_if_it_claims_one() {
    for family in Family::BUILT_IN {
        contract(family).has_the_history_that_it_claims().await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_stands_or_runs_takes_as_many_exchanges_as_are_claimed() {
    for family in Family::BUILT_IN {
        contract(family).takes_the_exchanges_that_it_claims().await;
    }
}

#[tokio::test(start_paused = true)]
async fn no_disobedient_drive_and_no_lost_answer_makes_a_family_say_what_is_not_so() {
    let mut complaints = Vec::new();
    for family in Family::BUILT_IN {
        let its = contract(family).complaints().await;
        complaints.extend(its.iter().map(|complaint| format!("{family}: {complaint}")));
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

/// Faults that one family cannot show: without a reading that is done once nothing is forgotten.
const CANNOT_SHOW: &[(Family, Mutant)] = &[
    (Family::OMRON_3G3EV, Mutant::ForgetForgetsNothing),
    (Family::ATV28, Mutant::ForgetForgetsNothing),
    (Family::ATV58, Mutant::ForgetForgetsNothing),
];

#[tokio::test(start_paused = true)]
async fn the_contract_complains_of_every_family_that_breaks_it() {
    let mut unseen = Vec::new();
    for family in Family::BUILT_IN {
        for mutant in Mutant::ALL {
            let shows = !CANNOT_SHOW.contains(&(family, mutant));
            if shows && !mutant.of(contract(family)).complains().await {
                unseen.push(format!("{family}: {mutant:?}"));
            }
        }
    }
    assert!(unseen.is_empty(), "not seen: {unseen:#?}");
}

/// A family whose author has told how its drives are commanded and nothing else: no referee knows it.
struct FromOutside;

impl Surrounded for FromOutside {
    fn configurations(&self) -> Vec<Configuration> {
        let of = |name: &str, settings: &[&str]| Configuration {
            name: name.to_owned(),
            open: Box::new(|port, slave| drives::drive(Family::ATV28, port, slave)),
            machine: Box::new(|| Box::new(models::atv28::Atv28::new())),
            settings: settings.iter().map(|&setting| setting.to_owned()).collect(),
        };
        vec![of("as delivered", &[]), of("HSP 30 Hz", &["set HSP 30"])]
    }
}

fn from_outside() -> Contract {
    Contract { around: Some(Box::new(FromOutside)), ..contract(Family::ATV28) }
}

#[tokio::test(start_paused = true)]
async fn a_family_that_tells_only_its_configurations_is_judged_by_shaft_and_twin_in_its_worlds() {
    let share = Share { one_in: 7, doubtful_one_in: 101 };
    let tally = from_outside().is_true_in_worlds(share).await;
    assert!(tally.lived > 200 && tally.decided == 0, "{tally}");
    // Broken, it passes no longer.
    for mutant in [Mutant::StartConfirmedByAnything, Mutant::AlwaysInForce, Mutant::NoOutputIsStandstill] {
        let tally = mutant.of(from_outside()).live_in_worlds(share).await;
        assert!(!tally.contradictions.is_empty(), "{mutant:?}: {tally}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_check_that_is_published_fails_for_every_family_that_breaks_the_contract() {
    contract(Family::ATV312).check().await;
    let mut passed = Vec::new();
    for mutant in Mutant::ALL {
        let broken = mutant.of(contract(Family::ATV312));
        match AssertUnwindSafe(broken.check()).catch_unwind().await {
            Ok(()) => passed.push(mutant),
            Err(why) => println!("{mutant:?}: {}", why.downcast_ref::<String>().map_or("", String::as_str)),
        }
    }
    assert!(passed.is_empty(), "{passed:?}");
}

/// What is told of a motor that is not so.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Lie {
    None,
    AtRest,
    Coasting,
    OtherDirection,
    OtherSpeed,
    NoLease,
    StillInForce,
}

impl Lie {
    const ALL: [Self; 6] = [
        Self::AtRest,
        Self::Coasting,
        Self::OtherDirection,
        Self::OtherSpeed,
        Self::NoLease,
        Self::StillInForce,
    ];

    fn about(self, mut status: Status, held: bool) -> Told {
        let at = status.at.expect("it was read");
        match self {
            Self::None | Self::NoLease => {}
            Self::AtRest => status.motion = Motion::AtRest,
            Self::Coasting => status.motion = Motion::Coasting,
            Self::OtherDirection => status.direction = Some(Direction::Reverse),
            Self::OtherSpeed => {
                (status.reference, status.at_reference) = (Some(Frequency::from_hertz(30)), Some(true));
            }
            Self::StillInForce => {
                (status.verdict, status.reference) =
                    (Some(Verdict::InForce), Some(Frequency::from_hertz(20)));
            }
        }
        Told { status: Arc::new(status), at, held: held && self != Self::NoLease, missing: 0 }
    }
}

/// What the witnesses say of this lie about a motor that runs, or that was stopped.
async fn witnessed(family: Family, lie: Lie) -> Result<(), String> {
    let mut rig = contract(family).rig();
    let mut witnesses = Witnesses::default();
    let (tell, told) = watch::channel(Arc::new(None));
    witnesses.attend(&rig.machine, told, |told: &Option<Told>| told.clone());
    let frequency = Frequency::from_hertz(20);
    rig.drive.set_setpoint(frequency.into()).await.expect("it takes 20 Hz");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_at(frequency).await;
    if lie == Lie::StillInForce {
        rig.drive.stop(StopMode::Ramp).await.expect("it stops");
        rig.until_standstill().await;
    }
    for _ in 0..3 {
        let status = rig.drive.status().await.expect("it answers");
        tell.send_replace(Arc::new(Some(lie.about(status, rig.drive.lease().is_some()))));
        sleep(Duration::from_millis(100)).await;
    }
    let dropped = std::panic::catch_unwind(AssertUnwindSafe(|| drop(witnesses)));
    dropped.map_err(|why| why.downcast_ref::<String>().cloned().unwrap_or_default())
}

#[tokio::test(start_paused = true)]
async fn a_witness_complains_of_what_is_told_of_a_motor_and_is_not_so_and_of_nothing_else() {
    let mut unseen = Vec::new();
    for family in Family::BUILT_IN {
        assert_eq!(witnessed(family, Lie::None).await, Ok(()), "{family}");
        for lie in Lie::ALL {
            match witnessed(family, lie).await {
                Ok(()) => unseen.push((family, lie)),
                Err(said) => assert!(said.contains("words against the machine"), "{family}: {lie:?}: {said}"),
            }
        }
    }
    assert_eq!(unseen, []);
}

/// Which question an answer belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum To {
    Last,
    Before,
    MissedBefore,
}

/// What the witnesses say of a motor that is told in force by an answer that has just come, when it lost its supply for a moment since
/// it was asked, or before that.
async fn told_late(family: Family, to: To) -> Result<(), String> {
    let mut rig = contract(family).rig();
    let mut witnesses = Witnesses::default();
    let (tell, told) = watch::channel(Arc::new(None));
    witnesses.attend(&rig.machine, told, |told: &Option<Told>| told.clone());
    let frequency = Frequency::from_hertz(20);
    rig.drive.set_setpoint(frequency.into()).await.expect("it takes 20 Hz");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    let status = rig.until_at(frequency).await;
    let status = Status { verdict: Some(Verdict::InForce), reference: Some(frequency), ..status };
    rig.machine.power_cycle();
    sleep(Duration::from_millis(30)).await;
    if to != To::Last {
        let _ = rig.drive.status().await;
    }
    let missing = u64::from(to == To::MissedBefore);
    let told = Told { status: Arc::new(status), at: Instant::now(), held: true, missing };
    tell.send_replace(Arc::new(Some(told)));
    sleep(Duration::from_millis(100)).await;
    let dropped = std::panic::catch_unwind(AssertUnwindSafe(|| drop(witnesses)));
    dropped.map_err(|why| why.downcast_ref::<String>().cloned().unwrap_or_default())
}

#[tokio::test(start_paused = true)]
async fn what_befalls_a_machine_behind_a_question_is_not_held_against_its_answer() {
    for family in Family::BUILT_IN {
        assert_eq!(told_late(family, To::Last).await, Ok(()), "{family}");
        assert_eq!(told_late(family, To::MissedBefore).await, Ok(()), "{family}");
        assert!(told_late(family, To::Before).await.is_err(), "{family}");
    }
}
