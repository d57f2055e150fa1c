use super::*;

const SECOND: Duration = Duration::from_secs(1);
const MS: Duration = Duration::from_millis(1);

/// Of which nothing is known.
fn unknown() -> (Instant, FarEnd) {
    (Instant::now(), FarEnd::new(Some(Gateway::default())))
}

/// One that does one thing at a time and waits a second for the dead.
fn in_turn() -> (Instant, FarEnd) {
    (Instant::now(), FarEnd::new(Some(Gateway { at_once: Some(1), wait: Some(SECOND) })))
}

fn asked(far: &FarEnd, slave: u8, number: u16, at: Instant) -> Asked {
    Asked { slave, number: Some(number), shape: Shape::ANY, at, place: far.place(at) }
}

fn owe(far: &mut FarEnd, slave: u8, number: u16, at: Instant) {
    far.owe(asked(far, slave, number, at));
}

#[test]
fn nothing_is_owed_where_nothing_is_in_between() {
    let mut far = FarEnd::new(None);
    owe(&mut far, 1, 1, Instant::now());
    assert_eq!((far.owes(), far.gate(true), far.stop_waits()), (0, None, Duration::ZERO));
}

#[test]
fn one_living_drive_is_read_to_see_and_nothing_is_written_meanwhile() {
    let (now, mut far) = unknown();
    owe(&mut far, 1, 1, now);
    assert_eq!(far.gate(true), None);
    assert!(far.gate(false).is_some());
    owe(&mut far, 2, 2, now);
    assert!(far.gate(true).is_some(), "two are enough");
}

#[test]
fn what_is_answered_at_once_beside_a_question_in_vain_shows_that_it_does_more_at_once() {
    let (now, mut far) = unknown();
    owe(&mut far, 1, 1, now);
    assert!(far.answered(now + 20 * MS, 1, true).is_empty());
    assert_eq!((far.gate(false), far.held_up(now)), (None, Duration::ZERO));
    assert!(!far.holds_others_up());
    owe(&mut far, 3, 2, now);
    assert!(far.gate(false).is_some(), "of three at once nothing is known");
    assert_eq!(far.gate(true), None);
}

#[test]
fn an_answer_at_once_when_the_far_end_may_be_done_says_nothing_of_how_much_it_does_at_once() {
    let (now, mut far) = unknown();
    owe(&mut far, 1, 1, now);
    // A stop, sent when the gateway had given up without a word.
    assert!(far.answered(now + 3_200 * MS, 1, true).is_empty());
    assert!(far.holds_others_up());
    assert_eq!(far.stop_waits(), 2 * Gateway::ASSUMED_WAIT);
}

#[test]
fn an_answer_behind_two_questions_in_vain_does_not_show_that_two_are_served_at_once() {
    let (now, mut far) = unknown();
    owe(&mut far, 1, 1, now);
    owe(&mut far, 2, 2, now);
    assert_eq!(far.answered(now + 6 * SECOND, 2, false), [1, 2]);
    assert!(far.holds_others_up());
    assert_eq!((far.wait(), far.stop_waits()), (3 * SECOND, 3 * SECOND));
}

#[test]
fn an_answer_behind_a_question_in_vain_shows_how_long_that_took_and_that_it_does_one_thing_at_a_time() {
    let (now, mut far) = unknown();
    assert_eq!(far.stop_waits(), 2 * Gateway::ASSUMED_WAIT);
    owe(&mut far, 1, 1, now);
    assert_eq!(far.answered(now + 2 * SECOND, 1, false), [1]);
    assert_eq!((far.wait(), far.stop_waits(), far.owes()), (2 * SECOND, 2 * SECOND, 0));
    owe(&mut far, 1, 3, now + 3 * SECOND);
    assert_eq!(far.gate(true), Some(now + 5_500 * MS));
    assert!(far.expired(now + 5_400 * MS).is_empty());
    assert_eq!(far.expired(now + 5_500 * MS), [1]);
}

#[test]
fn a_late_answer_of_known_number_ends_what_was_asked_before_it() {
    let now = Instant::now();
    let mut far = FarEnd::new(Some(Gateway { at_once: Some(1), ..Gateway::default() }));
    owe(&mut far, 1, 1, now);
    owe(&mut far, 2, 2, now + SECOND);
    assert_eq!(far.heard(now + 9 * SECOND, 2, Some(7), Shape::ANY, false), None);
    assert_eq!(far.heard(now + 9 * SECOND, 2, Some(2), Shape::ANY, false), Some(vec![1]));
    assert_eq!((far.owes(), far.wait()), (0, 9 * SECOND));
}

#[test]
fn a_late_answer_tells_its_own_time_only_where_nothing_held_it_up() {
    let (now, mut far) = unknown();
    owe(&mut far, 1, 1, now);
    assert_eq!(far.took(now + 250 * MS, Some(1)), Some(250 * MS));
    assert_eq!(far.took(now + 250 * MS, Some(2)), None, "another question's");
    assert_eq!(far.took(now + 250 * MS, None), None, "whose, nobody knows");
    owe(&mut far, 2, 2, now + 100 * MS);
    assert_eq!(far.took(now + 250 * MS, Some(1)), None);
    far.heard(now + 250 * MS, 1, Some(1), Shape::ANY, false);
    assert_eq!(far.took(now + 500 * MS, Some(2)), None, "it has waited behind the first");
}

#[test]
fn a_gateway_that_says_nobody_teaches_its_wait() {
    let (now, mut far) = unknown();
    owe(&mut far, 1, 1, now);
    assert_eq!(far.heard(now + 4 * SECOND, 1, Some(1), Shape::ANY, true), Some(vec![1]));
    assert_eq!(far.wait(), 4 * SECOND);
}

#[test]
fn what_waited_in_the_gateway_is_owed_from_when_the_gateway_came_to_it() {
    let (now, mut far) = in_turn();
    owe(&mut far, 3, 1, now);
    // A stop is sent behind it; the gateway says after a second that nobody answered, and only then comes to the stop.
    assert_eq!(far.heard(now + SECOND, 3, Some(1), Shape::ANY, true), Some(vec![3]));
    owe(&mut far, 4, 2, now + 300 * MS);
    assert_eq!(far.gate(false), Some(now + 2_250 * MS));
}

#[test]
fn what_was_waited_for_behind_what_can_no_longer_come_has_waited_for_that_too() {
    let (now, mut far) = in_turn();
    for (slave, at) in [(3, 0), (4, 300), (5, 600)] {
        owe(&mut far, slave, u16::from(slave), now + at * MS);
    }
    assert_eq!(far.expired(now + 2_500 * MS), [3, 4]);
    // Each was waited for a second: the answer behind the third comes when three are over.
    assert_eq!(far.answered(now + 3 * SECOND, 1, false), [5]);
    assert_eq!(far.wait(), SECOND);
}

#[test]
fn what_was_given_up_when_all_before_it_was_over_has_waited_behind_it_all_the_same() {
    let (now, mut far) = in_turn();
    owe(&mut far, 3, 1, now);
    let behind = asked(&far, 4, 2, now + 300 * MS);
    assert_eq!(far.expired(now + 1_250 * MS), [3]);
    far.owe(behind);
    // Two seconds are over: both were waited for.
    assert_eq!(far.answered(now + 2 * SECOND, 1, false), [4]);
    assert_eq!(far.wait(), SECOND);
}

#[test]
fn a_far_end_that_was_at_nothing_between_two_questions_in_vain_has_not_waited_meanwhile() {
    let (now, mut far) = in_turn();
    // Nothing proves that it is done with what it says nothing of, so that the third is expected for five seconds.
    owe(&mut far, 1, 1, now);
    assert_eq!(far.expired(now + 2 * SECOND), [1]);
    owe(&mut far, 1, 2, now + 2 * SECOND);
    assert_eq!(far.expired(now + 5 * SECOND), [1]);
    owe(&mut far, 1, 3, now + 5 * SECOND);
    // Stops that are sent all the same when it has done nothing for more than three seconds.
    owe(&mut far, 1, 4, now + 9_500 * MS);
    owe(&mut far, 2, 5, now + 9_800 * MS);
    assert_eq!(far.heard(now + 10_500 * MS, 2, Some(5), Shape::ANY, false), Some(vec![1, 1]));
    assert_eq!(far.wait(), SECOND);
}

#[test]
fn what_was_asked_when_all_before_it_was_over_has_waited_for_itself_alone() {
    let (now, mut far) = in_turn();
    owe(&mut far, 1, 1, now);
    // It is still owed, as nobody has looked since then.
    let third = asked(&far, 3, 2, now + 4 * SECOND);
    far.nobody_answered(now + 5 * SECOND, Some(third));
    assert_eq!(far.wait(), SECOND);
}

#[test]
fn a_late_answer_is_that_of_its_number_and_not_of_what_a_lost_connection_has_asked() {
    let (now, mut far) = in_turn();
    owe(&mut far, 1, 1, now);
    far.lost(None);
    owe(&mut far, 1, 2, now + 10 * MS);
    owe(&mut far, 1, 3, now + 20 * MS);
    assert_eq!(far.heard(now + SECOND, 1, Some(2), Shape::ANY, true), Some(vec![1]));
    assert_eq!(far.heard(now + 2 * SECOND, 1, Some(3), Shape::ANY, true), Some(vec![1]));
    assert_eq!((far.owes(), far.wait()), (0, SECOND));
}

#[test]
fn what_is_asked_while_a_gateway_may_be_at_a_question_of_a_lost_connection_shows_nothing_of_its_time() {
    let (now, mut far) = unknown();
    far.lost(Some(asked(&far, 3, 1, now)));
    owe(&mut far, 1, 2, now + 10 * MS);
    assert_eq!(far.took(now + SECOND, Some(2)), None);
    far.heard(now + SECOND, 1, Some(2), Shape::ANY, false);
    owe(&mut far, 1, 3, now + 5 * SECOND);
    assert_eq!(far.took(now + 5_020 * MS, Some(3)), Some(20 * MS));
}

#[test]
fn what_a_lost_connection_has_asked_says_nothing_of_its_slave_nor_of_how_long_a_gateway_waits() {
    let now = Instant::now();
    for nobody in [false, true] {
        let (_, mut far) = in_turn();
        owe(&mut far, 1, 1, now);
        // It was answered meanwhile, and nobody was told.
        far.lost(None);
        owe(&mut far, 3, 2, now + 10 * MS);
        if nobody {
            assert_eq!(far.heard(now + SECOND, 3, Some(2), Shape::ANY, true), Some(vec![3]));
        } else {
            assert_eq!(far.answered(now + SECOND, 2, false), [3]);
        }
        assert_eq!(far.wait(), SECOND, "{nobody}: not half of it");
    }
}

#[test]
fn a_lost_connection_ends_nothing_that_a_gateway_is_at() {
    let (now, mut far) = in_turn();
    owe(&mut far, 3, 1, now);
    far.lost(Some(asked(&far, 1, 2, now + 300 * MS)));
    assert_eq!(far.owes(), 2);
    assert_eq!(far.gate(true), Some(now + 1_250 * MS));
}

#[test]
fn a_gateway_waits_from_when_it_came_to_a_question() {
    let (now, mut far) = in_turn();
    owe(&mut far, 3, 1, now);
    owe(&mut far, 4, 2, now + 300 * MS);
    assert_eq!(far.heard(now + SECOND, 3, Some(1), Shape::ANY, true), Some(vec![3]));
    assert_eq!(far.heard(now + 2 * SECOND, 4, Some(2), Shape::ANY, true), Some(vec![4]));
    assert_eq!(far.wait(), SECOND);
}

#[test]
fn while_nothing_proves_that_it_is_done_it_is_asked_less_and_less() {
    let mut now = Instant::now();
    let mut far = FarEnd::new(Some(Gateway { wait: Some(SECOND), ..Gateway::default() }));
    let mut limits = Vec::new();
    for number in 0..4 {
        owe(&mut far, 1, number, now);
        let until = far.gate(false).expect("it is owed");
        limits.push(until - now);
        now = until;
        assert_eq!(far.expired(now), [1]);
    }
    assert_eq!(limits, [1_250 * MS, 2_500 * MS, 5_000 * MS, 5_000 * MS]);
}
