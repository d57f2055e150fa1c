//! The figures of lines, each from the line's own arithmetic.

use drive_bus::LineConfig;
use drive_core::{Capabilities, Reaction, SerialSettings};

use super::*;
use crate::{settings::Periods, testing, watchdog::WatchdogContract};

/// One exchange a status and nothing besides.
const CAPABILITIES: Capabilities = Capabilities { statuses_per_turn: 0, ..testing::CAPABILITIES };

const MS: Duration = Duration::from_millis(1);
/// A frame for a watchdog: 8 + 8 characters.
const FRAME: Duration = Duration::from_nanos(28 * 1_000_000 + 620_167 - 13 * 11 * 1_000_000_000 / 19_200);
/// One exchange at 19200 8E1: 8 + 21 characters of 11 bits, t3.5, and the 10 ms of the slave.
const READ: Duration = Duration::from_nanos(28 * 1_000_000 + 620_167);

fn budget() -> LineBudget {
    LineBudget::of(&LineConfig::stream(SerialSettings::MODBUS_DEFAULT))
}

#[test]
fn an_adapter_that_is_said_to_make_longer_pauses_than_usual_makes_each_answer_so_much_later() {
    let of = |chunk_gap| {
        LineBudget::of(&LineConfig { chunk_gap, ..LineConfig::stream(SerialSettings::MODBUS_DEFAULT) })
    };
    assert_eq!(of(20 * MS), of(5 * MS));
    assert_eq!(of(60 * MS).read_slot(), of(20 * MS).read_slot() + 60 * MS);
}

fn drives(number: usize, running: Duration, watchdog: Option<Duration>) -> Vec<Demand> {
    let watchdog = watchdog.map(|timeout| WatchdogContract { timeout, reaction: Reaction::Ramp });
    let periods =
        Periods { running, rest: 2 * running, max_age: 3 * running + 3_000 * MS, ..Periods::default() };
    let demand = |number: usize| Demand {
        drive: format!("pump {number}"),
        capabilities: &CAPABILITIES,
        watchdog_capability: CAPABILITIES.watchdog,
        periods,
        watchdog,
    };
    (1..=number).map(demand).collect()
}

fn without_measurements(mut drives: Vec<Demand>) -> Vec<Demand> {
    drives.iter_mut().for_each(|demand| demand.periods.slow = Duration::ZERO);
    drives
}

#[test]
fn a_line_that_cannot_keep_its_periods_is_refused_with_the_arithmetic() {
    assert!(plan(budget(), &drives(31, 1_000 * MS, None)).is_ok());
    let problem = plan(budget(), &drives(31, 500 * MS, None)).unwrap_err();
    assert!(problem.to_string().starts_with("one status of 31 drives takes 888ms"), "{problem}");
}

#[test]
fn a_sweep_is_one_exchange_of_every_drive_and_the_rest_of_the_period_is_left() {
    let plan = plan(budget(), &without_measurements(drives(31, 1_000 * MS, None))).unwrap();
    let sweep = READ * 31;
    assert!(plan.sweep.abs_diff(sweep) < MS / 10, "{plan:?}");
    let used = u64::try_from(sweep.as_micros()).unwrap();
    assert!(plan.utilisation_ppm.abs_diff(used) < 100, "{plan:?}");
    assert_eq!(plan.left_ppm(), 1_000_000 - plan.utilisation_ppm);
    assert_eq!(plan.status_age(1_000 * MS), 1_000 * MS + plan.sweep);
}

#[test]
fn measurements_take_a_twentieth_of_what_the_statuses_wait_and_wait_themselves_for_what_is_left() {
    let every = drives(31, 1_500 * MS, None);
    let plan = plan(budget(), &every).unwrap();
    assert_eq!(plan.status_age(1_500 * MS), 1_500 * MS + stretched(plan.sweep, 950_000));
    let exchanges = 31 * u32::from(CAPABILITIES.measurement_exchanges.max(1));
    let all = budget().read_slot() * exchanges;
    // The statuses take the sweep out of each 1.5 s, the rest is for these.
    let alone = all.as_secs_f64() / (1.0 - plan.sweep.as_secs_f64() / 1.5);
    let wait = (plan.measurements_age(60_000 * MS) - 60_000 * MS).as_secs_f64();
    assert!((wait - alone).abs() < 0.001, "{wait} {alone}");
}

#[test]
fn a_watchdog_that_cannot_be_fed_is_refused_and_the_time_that_it_names_is_taken() {
    let problem = plan(budget(), &drives(31, 1_000 * MS, Some(1_000 * MS))).unwrap_err();
    let PlanProblem::Starved { feed, .. } = &problem else { panic!("{problem}") };
    assert!(problem.to_string().contains("the watchdog of pump 1 is 1s"), "{problem}");
    let named = (feed.lost + feed.frames) * 2;
    assert!(plan(budget(), &drives(31, 1_000 * MS, Some(named))).is_ok());
    assert!(plan(budget(), &drives(31, 1_000 * MS, Some(named - MS))).is_err());
}

#[test]
fn a_status_that_would_be_too_old_before_the_next_comes_is_refused() {
    let mut every = without_measurements(drives(31, 1_000 * MS, None));
    let sweep = plan(budget(), &every).unwrap().sweep;
    every[7].periods.max_age = 2_000 * MS + sweep;
    assert!(plan(budget(), &every).is_ok());
    every[7].periods.max_age = 2_000 * MS + sweep - MS;
    let problem = plan(budget(), &every).unwrap_err();
    assert!(matches!(&problem, PlanProblem::Stale { drive, .. } if drive == "pump 8"), "{problem}");
}

#[test]
fn mute_drives_lengthen_the_stop_of_all_by_their_lost_answers_only() {
    let plan = plan(budget(), &drives(31, 1_000 * MS, None)).unwrap();
    let lost = plan.stop_all(3) - plan.stop_all(0);
    assert_eq!(lost, budget().lost_slot() * 9);
}

#[test]
fn dead_drives_leave_their_polls_and_take_their_probes() {
    let every = without_measurements(drives(31, 1_000 * MS, Some(10_000 * MS)));
    let Forecast { plan: whole, .. } = forecast(budget(), &every, 0);
    let Forecast { plan: dead, problem } = forecast(budget(), &every, 3);
    assert_eq!(problem, None);
    assert_eq!(dead.sweep, stretched(budget().read_slot() * 28, 950_000));
    assert_eq!(dead.utilisation_ppm, 50_000 + 28 * whole.utilisation_ppm / 31);
    let (fed, starving) = (whole.feed(10_000 * MS), dead.feed(10_000 * MS));
    assert_eq!(starving.lost, 3 * fed.lost, "each costs an answer until the line knows");
    assert_eq!(fed.frames - starving.frames, 3 * budget().read_slot(), "and wants no frame");
}

#[test]
fn a_gap_at_each_change_of_slave_is_part_of_every_exchange() {
    let gap = LineBudget { slave_change_gap: 10 * MS, ..budget() };
    let every = drives(10, 1_000 * MS, None);
    let (with, without) = (plan(gap, &every).unwrap(), plan(budget(), &every).unwrap());
    assert_eq!(with.sweep - without.sweep, 100 * MS);
}

#[test]
fn a_pause_that_a_drive_needs_counts_only_when_there_is_no_other_to_serve_in_it() {
    static SLOW: Capabilities = Capabilities { turnaround: Duration::from_millis(12), ..CAPABILITIES };
    let of = |number| {
        let mut every = drives(number, 1_000 * MS, None);
        every.iter_mut().for_each(|demand| demand.capabilities = &SLOW);
        plan(budget(), &every).unwrap().sweep
    };
    let pause = 12 * MS - SerialSettings::MODBUS_DEFAULT.t3_5();
    assert_eq!(of(1), budget().read_slot() + pause);
    assert_eq!(of(2), budget().read_slot() * 2);
}

#[test]
fn more_drives_than_a_family_allows_on_a_segment_are_refused_unless_there_are_repeaters() {
    static FEW: Capabilities = Capabilities { name: "Schneider Altivar 28", stations: 18, ..CAPABILITIES };
    let mut every = without_measurements(drives(19, 5_000 * MS, None));
    every[18].capabilities = &FEW;
    let problem = plan(budget(), &every).unwrap_err();
    assert!(
        problem.to_string().starts_with(
            "19 drives on 1 segment: pump 19 is of the family Schneider Altivar 28, which allows 18 stations on each"
        ),
        "{problem}"
    );
    assert!(plan(LineBudget { segments: 2, ..budget() }, &every).is_ok());
    assert!(plan(budget(), &every[1..]).is_ok());
    let tcp = LineBudget::of(&LineConfig::modbus_tcp("gateway:502"));
    assert!(plan(tcp, &every).is_ok(), "behind a gateway there is a segment that nobody here knows");
}

#[test]
fn behind_a_groups_command_the_line_is_left_to_the_polls_and_to_the_frames_for_the_watchdogs() {
    // Each of 25 drives is polled every 4 s and wants to hear something every 2.5 s: one frame of its own between two polls.
    let mut every = without_measurements(drives(25, 4_000 * MS, Some(5_000 * MS)));
    every.iter_mut().for_each(|demand| demand.periods = Periods { rest: 4_000 * MS, ..demand.periods });
    every.iter_mut().for_each(|demand| demand.periods.max_age = 5_000 * MS);
    let plan = forecast(budget(), &every, 0).plan;
    // A status of each within the second that it may be late, and a frame of each within its 4 s.
    let (polls, frames) = (25.0 * READ.as_secs_f64() / 1.0, 25.0 * FRAME.as_secs_f64() / 4.0);
    let rest = plan.rest_after(1_000 * MS).as_secs_f64();
    let wanted = 1.0 / (1.0 - polls - frames) - 1.0;
    assert!((rest - wanted).abs() < 0.01, "{rest} s behind a command of 1 s, and {wanted} s are wanted");
}

#[test]
fn a_sweep_counts_the_words_of_its_statuses_what_proves_a_run_command_and_the_frames_of_the_watchdogs() {
    static FAMILY: Capabilities =
        Capabilities { status_exchanges: 2, status_words: 11, statuses_per_turn: 10, ..CAPABILITIES };
    let of = |watchdog| {
        let mut every = without_measurements(drives(10, 4_000 * MS, watchdog));
        every.iter_mut().for_each(|demand| {
            demand.capabilities = &FAMILY;
            demand.periods = Periods { rest: 4_000 * MS, ..demand.periods };
        });
        plan(budget(), &every).unwrap()
    };
    // Two exchanges are 16 + 10 + 22 characters, and half of that a tenth as often.
    let characters = Duration::from_nanos(48 * 11 * 1_000_000_000 / 19_200);
    let status = characters + 2 * (READ - Duration::from_nanos(29 * 11 * 1_000_000_000 / 19_200));
    let statuses = 10 * (status + status / 20);
    assert!(of(None).sweep.abs_diff(statuses) < MS / 10, "{:?}", of(None));
    // A frame is due after 1.5 s without one, twice in 4 s.
    let fed = of(Some(3_000 * MS));
    assert!(fed.sweep.abs_diff(statuses + 20 * FRAME) < MS / 10, "{fed:?}");
    let used = (statuses + 20 * FRAME).as_secs_f64() / 4.0;
    assert!((fed.utilisation_ppm as f64 / 1e6 - used).abs() < 0.001, "{fed:?}");
    assert!(fed.status_age(4_000 * MS) > 4_000 * MS + statuses, "the frames come first");
    // One that is due as often as the drive is polled comes where a poll is late, and is counted.
    let late = of(Some(8_000 * MS)).sweep;
    assert!(late > statuses + 9 * FRAME && late < statuses + 10 * FRAME, "{late:?}");
    assert_eq!(
        of(Some(8_000 * MS)).utilisation_ppm,
        of(None).utilisation_ppm,
        "where it never is it gets none"
    );
}

#[test]
fn a_stop_of_all_counts_the_exchanges_that_the_family_says() {
    static TWO_LOOKS: Capabilities = Capabilities { stop_exchanges: 7, ..CAPABILITIES };
    let mut every = drives(10, 1_000 * MS, None);
    let before = plan(budget(), &every).unwrap().stop_all(0);
    every.iter_mut().for_each(|demand| demand.capabilities = &TWO_LOOKS);
    assert_eq!(plan(budget(), &every).unwrap().stop_all(0) - before, budget().read_slot() * 30);
}

#[cfg(feature = "serde")]
#[test]
fn a_plan_reads_back_as_it_is_written_and_goes_on_calculating() {
    use serde_json::{from_value, json, to_value};

    let unitelway = LineConfig {
        protocol: "unitelway,header=simplified".parse().unwrap(),
        ..LineConfig::stream("9600 8O1".parse().unwrap())
    };
    for budget in [budget(), LineBudget::of(&unitelway)] {
        let plan = plan(budget, &drives(3, 1_000 * MS, Some(4_000 * MS))).unwrap();
        let read: LinePlan = from_value(to_value(plan).unwrap()).unwrap();
        assert_eq!(read, plan);
        assert_eq!(read.feed(4_000 * MS), plan.feed(4_000 * MS));
        assert_eq!(read.stop_all(2), plan.stop_all(2));
    }
    let written = to_value(budget()).unwrap();
    assert_eq!(written["serial"], "19200 8E1");
    assert_eq!((&written["protocol"], &written["response_ns"]), (&json!("rtu"), &json!(10_000_000)));
}

#[cfg(feature = "serde")]
#[test]
fn every_problem_of_a_plan_reads_back_with_its_arithmetic() {
    let crowded = plan(budget(), &drives(40, 5_000 * MS, None)).unwrap_err();
    let overloaded = plan(budget(), &drives(31, 500 * MS, None)).unwrap_err();
    let starved = plan(budget(), &drives(31, 5_000 * MS, Some(500 * MS))).unwrap_err();
    let mut tight = drives(20, 1_000 * MS, None);
    tight.iter_mut().for_each(|demand| demand.periods.max_age = 2_001 * MS);
    let stale = plan(budget(), &tight).unwrap_err();
    assert!(matches!(
        (&crowded, &overloaded, &starved, &stale),
        (
            PlanProblem::Stations { .. },
            PlanProblem::Overloaded { .. },
            PlanProblem::Starved { .. },
            PlanProblem::Stale { .. }
        )
    ));
    for problem in [crowded, overloaded, starved, stale] {
        let read: PlanProblem = serde_json::from_value(serde_json::to_value(&problem).unwrap()).unwrap();
        assert_eq!((read.to_string(), &read), (problem.to_string(), &problem));
    }
}

#[cfg(feature = "serde")]
#[test]
fn a_plan_that_says_the_impossible_overflows_nothing() {
    let mut written = serde_json::to_value(plan(budget(), &drives(3, 1_000 * MS, None)).unwrap()).unwrap();
    let least =
        ["fresh_ppm", "fed_ppm", "slow_ppm", "utilisation_ppm", "sweep_ns", "statuses_ns", "slow_sweep_ns"];
    for key in least {
        written[key] = u64::MAX.into();
    }
    for key in ["watched", "dead", "drives", "stop_exchanges"] {
        written[key] = u32::MAX.into();
    }
    for key in ["response_ns", "response_timeout_ns", "broadcast_turnaround_ns"] {
        written["budget"][key] = u64::MAX.into();
    }
    let read: LinePlan = serde_json::from_value(written).unwrap();
    assert_eq!(read.feed(Duration::MAX).heard_within(), Duration::MAX);
    assert_eq!(read.stop_all(u32::MAX), Duration::MAX);
    assert!(read.status_age(Duration::MAX) == Duration::MAX && read.left_ppm() == 0);
    assert!(read.measurements_age(Duration::MAX) == Duration::MAX && read.rest_after(MS) < SECOND);
}

#[cfg(feature = "serde")]
const SECOND: Duration = Duration::from_secs(1);
