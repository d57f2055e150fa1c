//! Two drives at one address are found.

use super::*;

pub(super) async fn verdict(simulated: &SimLine) -> Answer {
    let mut finds = scanned(simulated, &at_one("19200 8N1", 3..=7)).await;
    assert_eq!(finds.len(), 1, "{finds:?}");
    finds.remove(0).answer
}

fn two(one: Family, other: Family) -> (SimLine, SimSlave, SimSlave) {
    let simulated = SimLine::new(Wiring::rtu(serial("19200 8N1")));
    let [one, other] = [one, other]
        .map(|family| simulated.add_beside(5, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap());
    let turnaround = Some(Duration::from_millis(5));
    one.set_turnaround(turnaround);
    other.set_turnaround(turnaround);
    (simulated, one, other)
}

#[tokio::test(start_paused = true)]
async fn two_of_one_family_are_known_by_what_they_differ_in() {
    let (simulated, one, _) = two(Family::ATV312, Family::ATV312);
    // The version of their firmware (UdP, W3302).
    assert!(one.poke(3_302, 0x1305));
    let answer = verdict(&simulated).await;
    assert!(matches!(&answer, Answer::Two { .. }), "{answer:?}");
}

#[tokio::test(start_paused = true)]
async fn two_that_say_the_same_at_the_same_moment_cannot_be_told_from_one() {
    let (simulated, ..) = two(Family::ATV312, Family::ATV312);
    assert!(matches!(verdict(&simulated).await, Answer::Slave(alike) if alike.len() == 1));
}

#[tokio::test(start_paused = true)]
async fn two_of_different_families_are_known() {
    for (one, other) in [
        (Family::ATV312, Family::ATV21),
        (Family::ATV28, Family::OMRON_3G3EV),
        (Family::ATV58, Family::ATV28),
    ] {
        let (simulated, ..) = two(one, other);
        let answer = verdict(&simulated).await;
        assert!(matches!(answer, Answer::Two { .. }), "{one} {other}: {answer:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_second_answer_after_the_first_or_into_it_is_known() {
    for millis in [6, 8, 15, 40, 90] {
        let (simulated, _, other) = two(Family::ATV312, Family::ATV312);
        other.set_turnaround(Some(Duration::from_millis(millis)));
        let answer = verdict(&simulated).await;
        assert!(matches!(answer, Answer::Two { .. }), "{millis} ms: {answer:?}");
    }
}
