//! What is known of a shaft, look by look.

use tokio::time::Instant;

use super::*;
use crate::setpoint::StopMode;

const FIFTY: Option<Frequency> = Some(Frequency::from_hertz(50));

/// One that the drive itself has said to stand.
fn resting(at: Instant) -> Shaft {
    let mut shaft = Shaft::new();
    assert_eq!(shaft.see(at, Output::Stands, Some(Frequency::ZERO)), Motion::AtRest);
    shaft
}

#[tokio::test(start_paused = true)]
async fn an_output_that_was_cut_leaves_a_shaft_that_coasts_until_its_owner_says_it_rests() {
    let begun = Instant::now();
    let (mut shaft, after) = (resting(begun), |seconds| begun + Duration::from_secs(seconds));
    assert_eq!(shaft.see(begun, Output::None, None), Motion::AtRest);
    assert_eq!(shaft.see(after(1), Output::Driven, FIFTY), Motion::Driven);
    assert_eq!(shaft.see(after(2), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
    assert_eq!(shaft.see(after(90), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
    shaft.set_coast_time(Some(Duration::from_secs(60)));
    assert_eq!(shaft.see(after(91), Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_was_driven_and_has_no_output_at_the_next_look_may_coast_whoever_ended_it() {
    let (mut shaft, now) = (Shaft::new(), Instant::now());
    shaft.see(now, Output::Driven, FIFTY);
    assert_eq!(shaft.see(now, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
}

#[tokio::test(start_paused = true)]
async fn a_motor_into_which_current_may_have_flowed_for_a_moment_between_two_looks_may_coast() {
    let now = Instant::now();
    let braked = |outputs: [u16; 2]| {
        let mut shaft = Shaft::new();
        for (tenth, hertz) in (0..).zip(outputs) {
            let at = now + Duration::from_millis(100 * tenth);
            shaft.see(at, Output::Braking(Frequency::from_hertz(hertz)), None);
        }
        shaft
    };
    let later = now + Duration::from_secs(10);
    let mut shaft = braked([30, 29]);
    assert_eq!(shaft.see(later, Output::None, Some(Frequency::ZERO)), Motion::AtRest, "its ramp is over");
    let mut shaft = braked([30, 29]);
    shaft.is_stopped_by(StopMode::DcInjection);
    assert_eq!(shaft.see(later, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
    let mut rests = resting(now);
    rests.is_stopped_by(StopMode::DcInjection);
    assert_eq!(rests.see(later, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn a_motor_that_was_never_seen_may_coast_whatever_became_of_its_output() {
    let now = Instant::now();
    for shown in [Output::None, Output::Gone, Output::Cut, Output::Tripped] {
        let mut shaft = Shaft::new();
        shaft.set_coast_time(Some(Duration::from_secs(20)));
        assert_eq!(shaft.see(now, shown, Some(Frequency::ZERO)), Motion::Coasting, "{shown:?}");
        let later = now + Duration::from_secs(20);
        assert_eq!(shaft.see(later, shown, Some(Frequency::ZERO)), Motion::AtRest, "{shown:?}");
    }
    assert_eq!(resting(now).see(now, Output::Cut, Some(Frequency::ZERO)), Motion::AtRest, "it stood");
}

/// The words of one status are of two moments where it takes two exchanges. A 3G3EV and an Altivar 28 lost their supply between
/// them, with the output of the moment before.
#[tokio::test(start_paused = true)]
async fn an_output_that_was_cut_amid_the_words_of_one_status_was_not_seen_to_come_down() {
    let now = Instant::now();
    for gone in [Output::None, Output::Cut] {
        let mut shaft = Shaft::new();
        shaft.see(now, Output::Driven, FIFTY);
        assert_eq!(shaft.see(now, Output::Cut, FIFTY), Motion::Braking, "it tells an output all the same");
        assert!(!shaft.was_braked());
        assert_eq!(shaft.see(now, gone, Some(Frequency::ZERO)), Motion::Coasting);
    }
    // Its output was gone at 26 Hz while a run command acted, and the words of a ramp come behind.
    let mut shaft = Shaft::new();
    let seen = [(0, Output::Driven, 26), (40, Output::Driven, 0), (60, Output::Braking(Frequency::ZERO), 0)];
    for (at, shown, hertz) in seen {
        shaft.see(now + Duration::from_millis(at), shown, Some(Frequency::from_hertz(hertz)));
    }
    let cut = now + Duration::from_millis(80);
    assert_eq!(shaft.see(cut, Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
    // The last moment of a ramp.
    let (mut shaft, after) = (Shaft::new(), |tenths: u64| now + Duration::from_millis(100 * tenths));
    for (at, hertz) in [(0, 3), (1, 2)] {
        shaft.see(
            after(at),
            Output::Braking(Frequency::from_hertz(hertz)),
            Some(Frequency::from_hertz(hertz)),
        );
    }
    assert_eq!(shaft.see(after(2), Output::Cut, Some(Frequency::from_hertz(1))), Motion::Braking);
    assert_eq!(shaft.see(after(3), Output::None, Some(Frequency::ZERO)), Motion::AtRest);
}

/// An Altivar 21 was let coast, tripped or lost its release between the word that says that it runs and the output.
#[tokio::test(start_paused = true)]
async fn the_words_of_a_ramp_at_no_output_tell_standstill_only_where_it_was_seen_to_come_down() {
    let begun = Instant::now();
    let after = |milliseconds| begun + Duration::from_millis(milliseconds);
    let zero = Output::Braking(Frequency::ZERO);
    let driven: fn(Frequency) -> Output = |_| Output::Driven;
    for (what, shown, outputs, gone, motion) in [
        ("never seen", driven, &[][..], 100, Motion::Coasting),
        ("at its speed", driven, &[40, 40], 100, Motion::Coasting),
        ("at a low speed, which it came down to once", driven, &[4, 3, 3], 2_000, Motion::Coasting),
        ("on its way to a lower speed", driven, &[40, 39], 1_000, Motion::Coasting),
        ("almost at zero", driven, &[2, 1], 100, Motion::AtRest),
        ("in a ramp", Output::Braking, &[40, 39], 1_000, Motion::Coasting),
        ("in a ramp that had the time to end", Output::Braking, &[40, 39], 3_900, Motion::AtRest),
    ] {
        let (mut shaft, mut last) = (Shaft::new(), 0);
        for (look, hertz) in (0..).zip(outputs) {
            let output = Frequency::from_hertz(*hertz);
            last = 100 * look;
            shaft.see(after(last), shown(output), Some(output));
        }
        shaft.see(after(last + gone), zero, Some(Frequency::ZERO));
        for cut in [Output::None, Output::Gone, Output::Cut] {
            let mut shaft = shaft;
            let told = shaft.see(after(last + gone + 100), cut, Some(Frequency::ZERO));
            assert_eq!(told, motion, "{what}: {cut:?}");
        }
    }
}

/// An Altivar 58 was let coast, and its panel took it and commanded nothing, between two looks.
#[tokio::test(start_paused = true)]
async fn a_motor_that_is_driven_at_no_output_stands_only_where_it_was_seen_to_come_down_or_its_coast_time_is_over()
 {
    let begun = Instant::now();
    let after = |seconds| begun + Duration::from_secs(seconds);
    let mut cut = Shaft::new();
    cut.see(begun, Output::Driven, FIFTY);
    let mut lowered = cut;
    for at in [1, 2, 3] {
        assert_eq!(cut.see(after(at), Output::Driven, Some(Frequency::ZERO)), Motion::Driven);
    }
    let mut later = cut;
    assert_eq!(cut.see(after(4), Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
    later.set_coast_time(Some(Duration::from_secs(9)));
    for at in [10, 11] {
        later.see(after(at), Output::Driven, Some(Frequency::ZERO));
    }
    assert_eq!(later.see(after(12), Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
    // 10 Hz a second.
    for at in 1..5_u16 {
        lowered.see(after(at.into()), Output::Driven, Some(Frequency::from_hertz(50 - 10 * at)));
    }
    for at in [5, 6] {
        lowered.see(after(at), Output::Driven, Some(Frequency::ZERO));
    }
    assert_eq!(lowered.see(after(7), Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn what_watches_the_shaft_ends_its_coasting_and_an_output_outweighs_it() {
    let (mut shaft, now) = (Shaft::new(), Instant::now());
    shaft.see(now, Output::Driven, FIFTY);
    assert_eq!(shaft.see(now, Output::Cut, Some(Frequency::ZERO)), Motion::Coasting);
    assert_eq!(shaft.see(now, Output::Stands, FIFTY), Motion::Braking, "it tells an output all the same");
    assert_eq!(shaft.see(now, Output::Stands, Some(Frequency::ZERO)), Motion::AtRest);
    assert_eq!(shaft.see(now, Output::Cut, Some(Frequency::ZERO)), Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn a_ramp_that_has_ended_leaves_a_shaft_at_rest() {
    let (mut shaft, now) = (Shaft::new(), Instant::now());
    assert_eq!(shaft.see(now, Output::Braking(Frequency::from_hertz(3)), None), Motion::Braking);
    let later = now + Duration::from_millis(200);
    assert_eq!(shaft.see(later, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn an_output_that_is_gone_sooner_than_its_ramp_brings_it_down_was_cut() {
    for (last, said_to_be_over, not_said) in [
        (200, Motion::Coasting, Motion::Coasting),
        (1_000, Motion::Coasting, Motion::Coasting),
        // More than three quarters of the time: the drive may have come down faster in the end, if it says that its ramp is over.
        (1_500, Motion::AtRest, Motion::Coasting),
        (1_800, Motion::AtRest, Motion::AtRest),
    ] {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        let after = |milliseconds| begun + Duration::from_millis(milliseconds);
        for (at, hertz) in [(0, 20), (100, 19), (200, 18)] {
            shaft.see(
                after(at),
                Output::Braking(Frequency::from_hertz(hertz)),
                Some(Frequency::from_hertz(hertz)),
            );
        }
        // 18 Hz at 10 Hz/s take 1.8 s.
        let mut other = shaft;
        let at = after(200 + last);
        assert_eq!(shaft.see(at, Output::None, Some(Frequency::ZERO)), said_to_be_over, "{last}");
        assert_eq!(other.see(at, Output::Gone, Some(Frequency::ZERO)), not_said, "{last}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_output_that_is_gone_behind_one_look_alone_tells_no_ramp_but_that_of_the_factory() {
    for (shown, after, motion) in [
        // A freewheel input behind the word of a stop: 30 Hz that are gone at the next look.
        (Output::None, 500, Motion::Coasting),
        (Output::None, 1_800, Motion::AtRest),
        // Another stop may stand there by now.
        (Output::Gone, 1_800, Motion::Coasting),
    ] {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        shaft.see(begun, Output::Braking(Frequency::from_hertz(30)), Some(Frequency::from_hertz(30)));
        let later = begun + Duration::from_millis(after);
        assert_eq!(shaft.see(later, shown, Some(Frequency::ZERO)), motion, "{shown:?} after {after}");
    }
    let now = Instant::now();
    assert_eq!(resting(now).see(now, Output::Gone, Some(Frequency::ZERO)), Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn a_ramp_that_the_drive_has_told_and_a_fast_stop_may_be_over_sooner_than_that_of_the_factory() {
    let half_a_second = Some((Frequency::from_hertz(50), Duration::from_millis(500)));
    for (ramp, mode, after, motion) in [
        (half_a_second, StopMode::Ramp, 310, Motion::AtRest),
        (half_a_second, StopMode::Ramp, 250, Motion::Coasting),
        (None, StopMode::Ramp, 460, Motion::Coasting),
        // 30 Hz in 1.8 s, divided by 4.
        (None, StopMode::Fast, 460, Motion::AtRest),
        (None, StopMode::Fast, 400, Motion::Coasting),
    ] {
        let (mut shaft, begun) = (Shaft::new(), Instant::now());
        shaft.set_ramp(ramp);
        shaft.is_stopped_by(mode);
        shaft.see(begun, Output::Braking(Frequency::from_hertz(30)), Some(Frequency::from_hertz(30)));
        let later = begun + Duration::from_millis(after);
        assert_eq!(shaft.see(later, Output::None, Some(Frequency::ZERO)), motion, "{ramp:?} {mode} {after}");
    }
}

/// A quick stop of an Altivar 58 that takes 0.3 s, looked at each 0.3 s.
#[tokio::test(start_paused = true)]
async fn a_stop_that_the_drive_says_to_have_ended_needs_no_time_and_one_that_was_not_seen_to_begin_does() {
    let (begun, zero) = (Instant::now(), Some(Frequency::ZERO));
    let later = begun + Duration::from_millis(300);
    let mut shaft = Shaft::new();
    shaft.see(begun, Output::Driven, FIFTY);
    let mut unseen = shaft;
    shaft.see(begun, Output::Braking(Frequency::from_hertz(50)), FIFTY);
    assert_eq!(shaft.see(later, Output::Ended, zero), Motion::AtRest);
    assert_eq!(unseen.see(later, Output::Ended, zero), Motion::Coasting);
}

/// What stood as well: its panel may have run it and let it coast, for however long it was not looked at. So it is at the first look
/// of a program.
#[tokio::test(start_paused = true)]
async fn behind_a_lost_line_a_motor_may_coast_whatever_was_seen_of_it_until_its_coast_time_is_over() {
    let (begun, zero) = (Instant::now(), Some(Frequency::ZERO));
    let three = Frequency::from_hertz(3);
    let ways: [(&str, &[Output]); 5] = [
        ("at rest", &[Output::Stands]),
        ("braked", &[Output::Braking(three)]),
        ("braked to no output", &[Output::Braking(three), Output::Braking(Frequency::ZERO)]),
        ("driven at no output", &[Output::Stands, Output::Driven, Output::Driven]),
        ("let coast long ago", &[Output::Cut]),
    ];
    for (what, ways) in ways {
        let mut shaft = Shaft::new();
        shaft.set_coast_time(Some(Duration::from_secs(20)));
        for shown in ways {
            let output = if let Output::Braking(output) = *shown { output } else { Frequency::ZERO };
            shaft.see(begun, *shown, Some(output));
        }
        shaft.lose_sight();
        let back = begun + Duration::from_secs(60);
        assert_eq!(shaft.see(back, Output::NotKnown, None), Motion::NotKnown);
        for shown in [Output::None, Output::Gone, Output::Cut] {
            let mut shaft = shaft;
            assert_eq!(shaft.see(back, shown, zero), Motion::Coasting, "{what}: {shown:?}");
            let later = back + Duration::from_secs(20);
            assert_eq!(shaft.see(later, shown, zero), Motion::AtRest, "{what}: {shown:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_look_that_does_not_tell_leaves_how_fast_the_motor_came_down() {
    let (mut shaft, begun) = (Shaft::new(), Instant::now());
    let after = |milliseconds| begun + Duration::from_millis(milliseconds);
    for (at, hertz) in [(0, 20), (100, 19)] {
        shaft.see(after(at), Output::Braking(Frequency::from_hertz(hertz)), None);
    }
    assert_eq!(shaft.see(after(200), Output::NotKnown, None), Motion::NotKnown);
    // 19 Hz at 10 Hz/s take 1.9 s.
    assert_eq!(shaft.see(after(300), Output::None, Some(Frequency::ZERO)), Motion::Coasting);
}

#[test]
fn direct_current_is_held_as_its_owner_says_and_never_for_longer_than_a_motor_at_rest_bears() {
    let held = |time| {
        let mut shaft = Shaft::new();
        shaft.set_injection_time(time);
        shaft.injection_time()
    };
    assert_eq!(held(None), INJECTION_TIME);
    assert_eq!(held(Some(Duration::from_secs(2))), Duration::from_secs(2));
    assert_eq!(held(Some(Duration::from_secs(600))), INJECTION_AT_MOST);
}

#[tokio::test(start_paused = true)]
async fn an_injection_that_was_ended_too_early_leaves_a_shaft_that_coasts() {
    let (mut shaft, begun) = (Shaft::new(), Instant::now());
    shaft.set_injection_time(Some(Duration::from_secs(2)));
    shaft.see(begun, Output::Driven, FIFTY);
    assert_eq!(shaft.see(begun, Output::Injection, Some(Frequency::ZERO)), Motion::Braking);
    let early = begun + Duration::from_millis(20);
    let mut ended = shaft;
    assert_eq!(ended.see(early, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
    let late = begun + Duration::from_secs(2);
    assert_eq!(shaft.see(late, Output::Injection, Some(Frequency::ZERO)), Motion::Held);
    assert_eq!(shaft.see(late, Output::None, Some(Frequency::ZERO)), Motion::AtRest);
}

#[tokio::test(start_paused = true)]
async fn direct_current_in_a_motor_that_was_never_seen_to_stand_brakes_it_until_its_time_is_over() {
    let (mut shaft, begun) = (Shaft::new(), Instant::now());
    shaft.set_injection_time(Some(Duration::from_secs(2)));
    assert_eq!(shaft.see(begun, Output::Injection, Some(Frequency::ZERO)), Motion::Braking);
    let late = begun + Duration::from_secs(2);
    assert_eq!(shaft.see(late, Output::Injection, Some(Frequency::ZERO)), Motion::Held);
    let mut resting = resting(begun);
    assert_eq!(resting.see(begun, Output::Injection, Some(Frequency::ZERO)), Motion::Held);
}

#[tokio::test(start_paused = true)]
async fn a_motor_whose_output_was_cut_as_it_began_to_turn_may_coast_and_one_at_zero_speed_stands() {
    // An Altivar 58 that was let coast 40 ms behind its start, and had been looked at twice.
    for (looks, motion) in
        [(&[0][..], Motion::Coasting), (&[0, 20], Motion::Coasting), (&[0, 500, 1_000], Motion::AtRest)]
    {
        let begun = Instant::now();
        let (mut shaft, after) = (resting(begun), |milliseconds| begun + Duration::from_millis(milliseconds));
        for at in looks {
            shaft.see(after(*at), Output::Driven, Some(Frequency::ZERO));
        }
        assert_eq!(shaft.see(after(1_010), Output::Cut, Some(Frequency::ZERO)), motion, "{looks:?}");
    }
}
