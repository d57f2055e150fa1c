use proptest::prelude::*;

use super::*;

const MS: Duration = Duration::from_millis(1);

fn schedule() -> Schedule<u32> {
    Schedule::new(Rules { limit: 1_000, aging: 1_000 * MS })
}

fn push(schedule: &mut Schedule<u32>, now: Instant, slave: u8, terms: Terms, work: u32) {
    schedule.push(now, slave, terms, work).unwrap();
}

/// What is chosen, one after the other, when every slave is ready.
fn order(schedule: &mut Schedule<u32>, now: Instant) -> Vec<u32> {
    std::iter::from_fn(|| {
        match schedule.choose(now, |_| Readiness { at: now, takes: 20 * MS, holds_line: false }) {
            Chosen::Send(entry) => Some(entry.work),
            Chosen::Wait(_) | Chosen::Idle => None,
        }
    })
    .collect()
}

#[test]
fn a_higher_class_goes_first() {
    let (mut schedule, now) = (schedule(), Instant::now());
    for (work, class) in Class::ALL.into_iter().rev().enumerate() {
        push(&mut schedule, now, 1, Terms::of(class), work as u32);
    }
    assert_eq!(order(&mut schedule, now), [4, 3, 2, 1, 0]);
}

#[test]
fn inside_a_class_the_earliest_deadline_goes_first() {
    let (mut schedule, now) = (schedule(), Instant::now());
    for (work, lifetime) in [(1, 300), (2, 100), (3, 200)] {
        push(&mut schedule, now, work as u8, Terms::of(Class::Command).within(lifetime * MS), work);
    }
    assert_eq!(order(&mut schedule, now), [2, 3, 1]);
}

#[test]
fn a_slave_with_many_requests_does_not_starve_the_others() {
    let (mut schedule, now) = (schedule(), Instant::now());
    for work in 0..5 {
        push(&mut schedule, now, 1, Terms::of(Class::Status), work);
    }
    for slave in 2..5 {
        push(&mut schedule, now, slave, Terms::of(Class::Status), u32::from(slave) * 10);
    }
    assert_eq!(order(&mut schedule, now), [0, 20, 30, 40, 1, 2, 3, 4]);
}

/// How often each of 31 slaves is asked in a minute whose status each wants every `period` and gives up when the next is due, on a
/// line that has 28 ms for one.
fn turns_on_a_line_that_is_too_slow(period: impl Fn(u8) -> Duration) -> Vec<u32> {
    let (mut schedule, start) = (schedule(), Instant::now());
    let mut due: Vec<Option<Instant>> = (1..=31).map(|slave| Some(start + slave * MS)).collect();
    let mut turns = vec![0; 31];
    let mut now = start;
    while now < start + 60_000 * MS {
        for entry in schedule.expired(now) {
            due[usize::from(entry.slave) - 1] = Some(now);
        }
        for (slave, due) in (1..).zip(&mut due) {
            if due.take_if(|due| *due <= now).is_some() {
                push(&mut schedule, now, slave, Terms::of(Class::Status).within(period(slave)), 0);
            }
        }
        match schedule.choose(now, |_| Readiness { at: now, takes: 28 * MS, holds_line: false }) {
            Chosen::Send(entry) => {
                turns[usize::from(entry.slave) - 1] += 1;
                due[usize::from(entry.slave) - 1] = entry.expires();
                now += 28 * MS;
            }
            Chosen::Wait(_) | Chosen::Idle => now += MS,
        }
    }
    turns
}

#[test]
fn a_request_that_expires_unsent_has_not_had_its_turn_so_nobody_starves_on_a_line_that_is_too_slow() {
    for period in [50, 100, 500] {
        for turns in [
            turns_on_a_line_that_is_too_slow(|_| period * MS),
            turns_on_a_line_that_is_too_slow(|slave| (period + u32::from(slave)) * MS),
            turns_on_a_line_that_is_too_slow(|slave| if slave % 3 == 0 { 10 * MS } else { period * MS }),
        ] {
            // 2142 turns for 31.
            assert!(turns.iter().all(|turns| (60..=80).contains(turns)), "every {period} ms: {turns:?}");
        }
    }
}

/// How often each of three slaves is asked in a minute whose status each wants twice a second and gives up when the next is due, while the
/// commands of `commanded` others never end. A turn takes 20 ms: they want 12 % of the line.
fn turns_beside_commands(commanded: u8) -> Vec<u32> {
    let (mut schedule, start) = (schedule(), Instant::now());
    let mut turns = vec![0; 3];
    for turn in 0..3_000 {
        let now = start + turn * 20 * MS;
        schedule.expired(now);
        for slave in 10..10 + commanded {
            let waits = schedule.any(|entry| entry.slave == slave);
            if !waits {
                push(&mut schedule, now, slave, Terms::of(Class::Command), 0);
            }
        }
        for slave in (1..=3).filter(|_| turn % 25 == 0) {
            push(&mut schedule, now, slave, Terms::of(Class::Status).within(500 * MS), 1);
        }
        if let Chosen::Send(entry) =
            schedule.choose(now, |_| Readiness { at: now, takes: 20 * MS, holds_line: false })
            && entry.work == 1
        {
            turns[usize::from(entry.slave) - 1] += 1;
        }
    }
    turns
}

#[test]
fn commands_of_one_slave_or_of_some_that_never_end_keep_nobody_else_from_being_asked() {
    for commanded in 1..=4 {
        let turns = turns_beside_commands(commanded);
        // Each wants 120.
        assert!(turns.iter().all(|turns| *turns >= 110), "beside {commanded}: {turns:?}");
    }
}

#[test]
fn the_commands_of_a_drive_that_is_started_go_ahead_of_all_polls() {
    let (mut schedule, now) = (schedule(), Instant::now());
    (1..=30).for_each(|slave| push(&mut schedule, now, slave, Terms::of(Class::Status), 1));
    (0..16).for_each(|_| push(&mut schedule, now, 40, Terms::of(Class::Command), 0));
    assert_eq!(order(&mut schedule, now)[..16], [0; 16]);
}

#[test]
fn aging_never_lifts_a_poll_above_a_stop() {
    let (mut schedule, start) = (schedule(), Instant::now());
    for slave in 1..=30 {
        push(&mut schedule, start, slave, Terms::of(Class::Status), 0);
    }
    let now = start + 3_600_000 * MS;
    push(&mut schedule, now, 40, Terms::of(Class::Command), 1);
    push(&mut schedule, now, 41, Terms::of(Class::Stop), 2);
    let order = order(&mut schedule, now);
    assert_eq!(order.iter().position(|work| *work == 2), Some(0));
    assert_eq!(
        order.iter().position(|work| *work == 1),
        Some(1),
        "a command waits for one aged poll at most"
    );
}

#[test]
fn a_keep_alive_is_not_starved_by_a_stream_of_commands_nor_by_polls_that_have_aged_before_it() {
    let (mut schedule, start) = (schedule(), Instant::now());
    for slave in 1..=30 {
        push(&mut schedule, start, slave, Terms::of(Class::Status), 0);
    }
    push(&mut schedule, start + 2_000 * MS, 31, Terms::of(Class::KeepAlive), 7);
    let now = start + 2_100 * MS;
    for slave in 40..60 {
        push(&mut schedule, now, slave, Terms::of(Class::Command), 1);
    }
    let place = order(&mut schedule, now).iter().position(|work| *work == 7);
    assert!(place.is_some_and(|place| place <= 3), "{place:?}");
}

#[test]
fn what_has_aged_gets_every_fourth_turn_below_a_stream_of_commands() {
    let (mut schedule, start) = (schedule(), Instant::now());
    push(&mut schedule, start, 1, Terms::of(Class::Status), 7);
    let now = start + 2_000 * MS;
    for slave in 2..20 {
        push(&mut schedule, now, slave, Terms::of(Class::Command), 0);
    }
    let place = order(&mut schedule, now).iter().position(|work| *work == 7);
    assert_eq!(place, Some(3));
}

#[test]
fn background_gets_every_twentieth_turn_and_no_more() {
    let (mut schedule, now) = (schedule(), Instant::now());
    for slave in 1..=100 {
        push(&mut schedule, now, slave, Terms::of(Class::Status), 0);
        push(&mut schedule, now, slave, Terms::of(Class::Background), 1);
    }
    let order = order(&mut schedule, now);
    let share = order.iter().take(100).filter(|work| **work == 1).count();
    assert_eq!(share, 5);
}

#[test]
fn a_pause_of_one_slave_is_spent_on_another_unless_a_command_would_wait_for_it() {
    let (mut schedule, now) = (schedule(), Instant::now());
    let readiness = |entry: &Entry<u32>| match entry.slave {
        1 => Readiness { at: now + 5 * MS, takes: 20 * MS, holds_line: false },
        _ => Readiness { at: now, takes: 20 * MS, holds_line: false },
    };
    push(&mut schedule, now, 1, Terms::of(Class::Status), 1);
    push(&mut schedule, now, 2, Terms::of(Class::Background), 2);
    assert!(matches!(schedule.choose(now, readiness), Chosen::Send(entry) if entry.work == 2));

    push(&mut schedule, now, 1, Terms::of(Class::Command), 3);
    push(&mut schedule, now, 2, Terms::of(Class::Background), 4);
    assert!(matches!(schedule.choose(now, readiness), Chosen::Wait(at) if at == now + 5 * MS));
    // A pause that is longer than the other's exchange is not waited for.
    let long = |entry: &Entry<u32>| Readiness {
        at: if entry.slave == 1 { now + 50 * MS } else { now },
        takes: 20 * MS,
        holds_line: false,
    };
    assert!(matches!(schedule.choose(now, long), Chosen::Send(entry) if entry.work == 4));
}

#[test]
fn nothing_starts_while_a_stop_holds_the_line_for_its_slaves_pause() {
    let (mut schedule, now) = (schedule(), Instant::now());
    push(&mut schedule, now, 1, Terms::of(Class::Stop), 1);
    push(&mut schedule, now, 2, Terms::of(Class::Command), 2);
    let pause = now + 500 * MS;
    let waits = |holds_line: bool| {
        move |entry: &Entry<u32>| match entry.slave {
            1 => Readiness { at: pause, takes: MS, holds_line },
            _ => Readiness { at: now, takes: MS, holds_line: false },
        }
    };
    assert!(matches!(schedule.choose(now, waits(true)), Chosen::Wait(at) if at == pause));
    assert!(matches!(schedule.choose(now, waits(false)), Chosen::Send(entry) if entry.work == 2));
    assert!(matches!(schedule.choose(now, waits(false)), Chosen::Wait(at) if at == pause));
}

#[test]
fn when_it_could_be_sent_is_asked_once_of_each_and_only_of_what_may_be_chosen() {
    let (mut schedule, now) = (schedule(), Instant::now());
    (1..=31).for_each(|slave| push(&mut schedule, now, slave, Terms::of(Class::Status), 0));
    (1..=31).for_each(|slave| push(&mut schedule, now, slave, Terms::of(Class::Background), 1));
    let mut asked = Vec::new();
    let mut choose = |ready: fn(u8) -> bool| {
        asked.clear();
        let chosen = schedule.choose(now, |entry| {
            asked.push(entry.ticket);
            let at = if ready(entry.slave) { now } else { now + 5 * MS };
            Readiness { at, takes: 20 * MS, holds_line: false }
        });
        if let Chosen::Send(entry) = chosen {
            schedule.put_back(entry);
        }
        let times = asked.len();
        asked.sort_unstable();
        asked.dedup();
        (times, asked.len())
    };
    assert_eq!(choose(|_| true), (1, 1), "the first goes");
    assert_eq!(
        choose(|slave| slave > 3),
        (5, 5),
        "three have their pauses, and one of the background was the first that was looked at"
    );
    assert_eq!(choose(|_| false), (62, 62), "all have");
}

#[test]
fn a_stream_of_setpoints_keeps_the_place_of_the_first() {
    let (mut schedule, now) = (schedule(), Instant::now());
    let setpoint = Terms::of(Class::Command).replacing(8502);
    push(&mut schedule, now, 1, setpoint, 1);
    push(&mut schedule, now, 2, Terms::of(Class::Command), 2);
    let (_, replaced) = schedule.push(now + 500 * MS, 1, setpoint, 3).unwrap();
    assert!(matches!(replaced.as_slice(), [old] if old.work == 1));
    assert_eq!(order(&mut schedule, now + 500 * MS), [3, 2]);
}

#[test]
fn nothing_less_urgent_takes_the_place_of_a_stop() {
    let (mut schedule, now) = (schedule(), Instant::now());
    push(&mut schedule, now, 1, Terms::of(Class::Stop).replacing(8501), 1);
    let (_, replaced) = schedule.push(now, 1, Terms::of(Class::Command).replacing(8501), 2).unwrap();
    assert!(replaced.is_empty());
    // The next stop takes the place of both.
    let (_, replaced) = schedule.push(now, 1, Terms::of(Class::Stop).replacing(8501), 3).unwrap();
    assert_eq!(replaced.len(), 2);
    assert_eq!(order(&mut schedule, now), [3]);
}

#[test]
fn a_full_queue_refuses_all_but_stops() {
    let mut schedule = Schedule::new(Rules { limit: 2, aging: 1_000 * MS });
    let now = Instant::now();
    push(&mut schedule, now, 1, Terms::default(), 1);
    push(&mut schedule, now, 2, Terms::default(), 2);
    assert_eq!(schedule.push(now, 3, Terms::of(Class::Command), 3).unwrap_err(), 3);
    assert!(schedule.push(now, 3, Terms::of(Class::Stop), 4).is_ok());
}

#[test]
fn background_has_its_twentieth_turn_also_while_something_has_aged() {
    let (mut schedule, now) = (schedule(), Instant::now());
    // Aged: an old status behind a stream of commands, at each of its turns.
    (0..10).for_each(|work| push(&mut schedule, now, 2, Terms::of(Class::Status), work));
    let later = now + 2_000 * MS;
    (100..200).for_each(|work| push(&mut schedule, later, 1, Terms::of(Class::Command), work));
    push(&mut schedule, later, 3, Terms::of(Class::Background), 99);
    let order = order(&mut schedule, later);
    assert!(order.iter().position(|work| *work == 99).unwrap() < 20, "{order:?}");
}

#[derive(Debug, Clone, Copy)]
enum Event {
    Push { slave: u8, class: Class, lifetime: Option<u64>, key: Option<u16> },
    Choose,
    Withdraw(u64),
    Pass(u64),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        4 => (1_u8..8, 0_usize..5, prop::option::of(1_u64..3_000), prop::option::weighted(0.2, 0_u16..3))
            .prop_map(|(slave, class, lifetime, key)| Event::Push {
                slave,
                class: Class::ALL[class],
                lifetime,
                key,
            }),
        4 => Just(Event::Choose),
        1 => (0_u64..200).prop_map(Event::Withdraw),
        2 => (1_u64..400).prop_map(Event::Pass),
    ]
}

proptest! {
    #[test]
    fn no_request_is_lost_or_chosen_twice_and_every_class_is_inside_its_bound(
        events in prop::collection::vec(event(), 1..400),
    ) {
        let (mut schedule, mut now) = (schedule(), Instant::now());
        let (mut pushed, mut ended) = (0_u32, Vec::new());
        let mut turns_without_background = 0;
        for event in events {
            for entry in schedule.expired(now) {
                prop_assert!(entry.expires().is_some_and(|expires| expires <= now));
                ended.push(entry.work);
            }
            match event {
                Event::Push { slave, class, lifetime, key } => {
                    let lifetime = lifetime.map(Duration::from_millis);
                    let terms = Terms { lifetime, replaces: key, ..Terms::of(class) };
                    let (_, replaced) = schedule.push(now, slave, terms, pushed).unwrap();
                    ended.extend(replaced.into_iter().map(|entry| entry.work));
                    pushed += 1;
                    let same_key = schedule.queued.iter().filter(|entry| {
                        (entry.slave, entry.terms.replaces) == (slave, key) && entry.terms.class <= class
                    });
                    prop_assert!(key.is_none() || same_key.count() == 1, "a predecessor was left behind");
                }
                Event::Choose => {
                    let stops = schedule.first_stop(|entry| Some(entry.arrived)).is_some();
                    let background = schedule.any(|entry| entry.terms.class == Class::Background);
                    let oldest_of = |schedule: &Schedule<u32>, slave, class| {
                        let mut least = None;
                        let _ = schedule.any(|entry| {
                            if (entry.slave, entry.terms.class, entry.terms.replaces) == (slave, class, None) {
                                least = Some(least.map_or(entry.ticket, |least: Ticket| least.min(entry.ticket)));
                            }
                            false
                        });
                        least
                    };
                    let before: Vec<_> = (1..8)
                        .flat_map(|slave| Class::ALL.map(|class| (slave, class)))
                        .map(|(slave, class)| (slave, class, oldest_of(&schedule, slave, class)))
                        .collect();
                    match schedule.choose(now, |_| Readiness { at: now, takes: 20 * MS, holds_line: false }) {
                        Chosen::Send(entry) => {
                            let class = entry.terms.class;
                            prop_assert!(!stops || class == Class::Stop, "a stop is overtaken");
                            prop_assert!(entry.expires().is_none_or(|expires| expires > now));
                            if entry.terms.replaces.is_none() && entry.terms.lifetime.is_none() {
                                let first = before
                                    .iter()
                                    .find(|(slave, of, _)| (*slave, *of) == (entry.slave, class))
                                    .and_then(|(.., first)| *first);
                                prop_assert_eq!(first, Some(entry.ticket), "one slave's calls keep their order");
                            }
                            let counts = background && class < Class::Stop && class != Class::Background;
                            turns_without_background = if counts { turns_without_background + 1 } else { 0 };
                            prop_assert!(turns_without_background < BACKGROUND_TURN);
                            ended.push(entry.work);
                        }
                        Chosen::Wait(_) => prop_assert!(false, "everything is ready"),
                        Chosen::Idle => prop_assert!(schedule.is_empty()),
                    }
                }
                Event::Withdraw(ticket) => {
                    ended.extend(schedule.withdraw(Ticket(ticket)).map(|entry| entry.work));
                }
                Event::Pass(millis) => now += Duration::from_millis(millis),
            }
        }
        ended.extend(schedule.withdraw_all(|_| true).into_iter().map(|entry| entry.work));
        ended.sort_unstable();
        prop_assert_eq!(ended, (0..pushed).collect::<Vec<_>>());
    }
}
