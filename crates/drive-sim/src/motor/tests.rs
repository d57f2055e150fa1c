use super::*;

const RAMPS: Ramps = Ramps {
    acceleration: Ramp { full_scale: 5_000, time: Duration::from_secs(3) },
    deceleration: Ramp { full_scale: 5_000, time: Duration::from_secs(6) },
};

fn motor() -> Motor {
    Motor::new(Nameplate::light(20))
}

fn running_at(frequency: i32) -> Motor {
    let mut motor = motor();
    motor.run(frequency, RAMPS);
    motor.advance(Duration::from_secs(60));
    motor
}

#[test]
fn the_motor_ramps_in_the_time_its_ramp_says() {
    let mut motor = motor();
    motor.run(4_000, RAMPS);
    motor.advance(Duration::from_millis(2_399));
    assert_eq!(motor.output_frequency(), 3_998);
    assert!(motor.is_accelerating() && !motor.is_at_target());
    motor.advance(Duration::from_millis(1));
    assert_eq!(motor.output_frequency(), 4_000);
    assert!(!motor.is_accelerating() && motor.is_at_target());
}

#[test]
fn a_reversal_goes_through_standstill_on_both_ramps() {
    let mut motor = running_at(5_000);
    motor.run(-5_000, RAMPS);
    motor.advance(Duration::from_secs(6));
    assert_eq!(motor.output_frequency(), 0);
    motor.advance(Duration::from_millis(1_500));
    assert_eq!(motor.output_frequency(), -2_500);
    motor.advance(Duration::from_millis(1_500));
    assert!(motor.is_at_target());
}

#[test]
fn one_long_step_ends_where_many_short_ones_end() {
    let mut once = running_at(5_000);
    let mut often = once;
    for motor in [&mut once, &mut often] {
        motor.set_load(40);
        motor.run(-3_000, RAMPS);
    }
    once.advance(Duration::from_millis(9_500));
    for _ in 0..19_000 {
        often.advance(Duration::from_micros(500));
    }
    assert_eq!(once.output_frequency(), often.output_frequency());
    assert_eq!(once.current(), often.current());
    assert_eq!(once.thermal_state(), often.thermal_state());
    assert_eq!(once.fed_for(), often.fed_for());
}

#[test]
fn a_stop_along_the_ramp_blocks_the_output_at_standstill() {
    let mut motor = running_at(5_000);
    motor.ramp_to_rest(RAMPS.deceleration);
    motor.advance(Duration::from_millis(5_999));
    assert!(motor.is_fed() && motor.is_stopping() && motor.is_decelerating());
    motor.advance(Duration::from_millis(1));
    assert!(!motor.is_fed());
    assert_eq!(motor.shaft_frequency(), 0);
}

#[test]
fn a_freewheel_stop_coasts_and_a_load_shortens_it() {
    let coasts_for = |load: u16| {
        let mut motor = running_at(5_000);
        motor.set_load(load);
        motor.freewheel();
        assert_eq!((motor.output_frequency(), motor.shaft_frequency()), (0, 5_000));
        let mut time = Duration::ZERO;
        while motor.shaft_frequency() > 0 {
            motor.advance(Duration::from_millis(10));
            time += Duration::from_millis(10);
        }
        time
    };
    assert_eq!(coasts_for(0), Duration::from_secs(10));
    assert_eq!(coasts_for(95), Duration::from_millis(500));
}

#[test]
fn direct_current_brakes_faster_than_coasting_and_ends_after_its_time() {
    let mut motor = running_at(5_000);
    motor.brake(70, Some(Duration::from_secs(2)));
    assert!(motor.is_braking() && motor.is_fed());
    assert_eq!(motor.current(), 14);
    motor.advance(Duration::from_millis(500));
    assert_eq!(motor.shaft_frequency(), 0);
    motor.advance(Duration::from_millis(1_499));
    assert!(motor.is_braking());
    motor.advance(Duration::from_millis(1));
    assert!(!motor.is_fed());
}

#[test]
fn a_coasting_motor_is_caught_at_its_speed() {
    let mut motor = running_at(5_000);
    motor.freewheel();
    motor.advance(Duration::from_secs(5));
    motor.run(5_000, RAMPS);
    assert_eq!(motor.output_frequency(), 2_500);
}

#[test]
fn current_torque_and_heat_follow_the_load() {
    let mut motor = running_at(5_000);
    assert_eq!(motor.torque(), 5);
    let idle = motor.current();
    motor.set_load(95);
    assert_eq!((motor.torque(), motor.current()), (100, 19));
    assert!(idle < motor.current());
    motor.advance(Duration::from_secs(36_000));
    assert!((98..=100).contains(&motor.thermal_state()), "{}", motor.thermal_state());
    motor.freewheel();
    motor.advance(Duration::from_secs(600));
    assert!((34..=38).contains(&motor.thermal_state()), "{}", motor.thermal_state());
}

#[test]
fn a_ramp_of_no_time_is_taken_at_once() {
    let at_once = Ramp { full_scale: 5_000, time: Duration::ZERO };
    let mut motor = motor();
    motor.run(5_000, Ramps { acceleration: at_once, deceleration: at_once });
    motor.advance(Duration::from_millis(1));
    assert_eq!(motor.output_frequency(), 5_000);
    motor.ramp_to_rest(at_once);
    motor.advance(Duration::from_millis(1));
    assert!(!motor.is_fed());
}
