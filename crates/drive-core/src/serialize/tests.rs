//! The expected objects are written from the words of the fields, by hand.

use std::time::Duration;

use serde_json::{Value, from_value, json, to_value};
use tokio::time::{Instant, advance};

use crate::{
    Command, Control, Current, Direction, ErrorKind, Fault, FaultEntry, Faults, Frequency, Identity, Lack,
    Measurements, Motion, Percent, Power, RawWord, Reaction, Refusal, Setpoint, Speed, State, Status,
    StopMode, Stopped, Verdict, Voltage, Watchdog,
};

fn is(told: impl serde::Serialize, expected: Value) {
    assert_eq!(to_value(told).unwrap(), expected);
}

fn setpoint(value: Value) -> Result<Setpoint, String> {
    from_value(value).map_err(|error| error.to_string())
}

#[tokio::test(start_paused = true)]
async fn a_status_is_told_in_the_units_of_its_keys_with_its_age_when_it_is_told() {
    let status = Status {
        state: State::QuickStop,
        direction: Some(Direction::Reverse),
        output_frequency: Some(Frequency::from_centihertz(3_005)),
        current: Some(Current::from_deciamperes(32)),
        current_share: Some(Percent::from_percent(41)),
        reference: Some(Frequency::from_hertz(35)),
        at_reference: Some(true),
        warning: Some(false),
        fault_code: Some(5),
        control: Some(Control::OtherBus),
        verdict: Some(Verdict::lacks(Lack::Output, Refusal::Tripped)),
        motion: Motion::AtRest,
        raw: vec![RawWord { address: 3_201, code: "ETA", value: 1_591 }],
        at: Some(Instant::now()),
    };
    advance(Duration::from_millis(120)).await;
    is(
        status,
        json!({
            "state": "quick_stop", "direction": "reverse", "output_frequency_hz": 30.05, "current_a": 3.2,
            "current_percent": 41.0, "reference_hz": 35.0, "at_reference": true, "warning": false, "fault_code": 5,
            "control": "other_bus", "motion": "at_rest",
            "run_command": {
                "verdict": "not_in_force", "lacks": "output",
                "because": "the drive has tripped: remove the cause, then reset it"
            },
            "raw": [{"address": 3201, "code": "ETA", "value": 1591}], "age_ms": 120
        }),
    );
}

#[test]
fn what_a_drive_does_not_tell_has_no_key() {
    is(Status::default(), json!({"state": "unknown", "raw": []}));
    is(Measurements::default(), json!({"before_trip": false, "raw": []}));
    is(Identity::default(), json!({"codes": []}));
    is(Faults::default(), json!({"present": [], "history": [], "warnings": [], "tripped": false}));
}

#[test]
fn measurements_are_told_in_the_units_of_their_keys() {
    let percent = |percent| Some(Percent::from_percent(percent));
    let measurements = Measurements {
        reference: Some(Speed::from_rpm(900).into()),
        speed: Some(Speed::from_rpm(890)),
        output_voltage: Some(Voltage::from_decivolts(3_805)),
        output_voltage_share: percent(95),
        line_voltage: Some(Voltage::from_decivolts(4_000)),
        dc_bus_voltage: Some(Voltage::from_decivolts(5_600)),
        dc_bus_voltage_share: percent(99),
        torque: percent(-40),
        power_share: percent(30),
        input_power: Some(Power::from_decawatts(80)),
        output_power: Some(Power::from_decawatts(75)),
        drive_thermal: percent(40),
        motor_thermal: percent(50),
        drive_load: percent(60),
        motor_load: percent(70),
        input_energy: Some(2),
        output_energy: Some(1),
        running_time: Some(Duration::from_secs(1_200 * 3_600 + 1_800)),
        powered_time: Some(Duration::from_secs(2_000 * 3_600)),
        inputs: Some(3),
        outputs: Some(1),
        ..Measurements::default()
    };
    is(
        measurements,
        json!({
            "before_trip": false, "reference": {"speed_rpm": 900}, "speed_rpm": 890, "output_voltage_v": 380.5,
            "output_voltage_percent": 95.0, "line_voltage_v": 400.0, "dc_bus_voltage_v": 560.0,
            "dc_bus_voltage_percent": 99.0, "torque_percent": -40.0, "power_percent": 30.0, "input_power_kw": 0.8,
            "output_power_kw": 0.75, "drive_thermal_percent": 40.0, "motor_thermal_percent": 50.0,
            "drive_load_percent": 60.0, "motor_load_percent": 70.0, "input_energy_counts": 2,
            "output_energy_counts": 1, "running_time_h": 1200.5, "powered_time_h": 2000.0, "inputs": 3,
            "outputs": 1, "raw": []
        }),
    );
}

#[test]
fn a_fault_is_told_with_what_to_do_and_one_that_no_manual_lists_by_its_code() {
    static TABLE: [FaultEntry; 1] = [FaultEntry::new(9, "OLF", "motor overload", "let the motor cool")];
    let faults = Faults {
        present: vec![Fault::lookup(&TABLE, 9)],
        history: vec![Fault::lookup(&TABLE, 77)],
        tripped: true,
        reset_allowed: Some(true),
        ..Faults::default()
    };
    is(
        faults,
        json!({
            "present": [{"code": 9, "mnemonic": "OLF", "meaning": "motor overload", "remedy": "let the motor cool"}],
            "history": [{"code": 77}], "warnings": [], "tripped": true, "reset_allowed": true
        }),
    );
}

#[test]
fn what_is_asked_reads_back_as_it_was_told() {
    for (setpoint, told) in [
        (Setpoint::from(Frequency::from_centihertz(3_005)), json!({"frequency_hz": 30.05})),
        (Speed::from_rpm(900).into(), json!({"speed_rpm": 900})),
        (Percent::from_hundredths(4_550).into(), json!({"share_percent": 45.5})),
    ] {
        is(setpoint, told.clone());
        assert_eq!(from_value::<Setpoint>(told).unwrap(), setpoint);
    }
    for (mode, word) in StopMode::ALL.into_iter().zip(["ramp", "fast", "freewheel", "dc_injection"]) {
        is(mode, json!(word));
        assert_eq!(from_value::<StopMode>(json!(word)).unwrap(), mode);
    }
    for (direction, word) in [(Direction::Forward, "forward"), (Direction::Reverse, "reverse")] {
        is(direction, json!(word));
        assert_eq!(from_value::<Direction>(json!(word)).unwrap(), direction);
    }
    for (reaction, told) in [(Reaction::DcInjection, json!("dc_injection")), (Reaction::Unknown(7), json!(7))]
    {
        is(reaction, told.clone());
        assert_eq!(from_value::<Reaction>(told).unwrap(), reaction);
    }
}

#[test]
fn every_hundredth_of_a_hertz_reads_back_as_itself() {
    for centihertz in (0..=70_000).chain([u32::MAX - 1, u32::MAX]) {
        let frequency = Frequency::from_centihertz(centihertz);
        let text = serde_json::to_string(&frequency).unwrap();
        assert_eq!(serde_json::from_str::<Frequency>(&text).unwrap(), frequency, "{text}");
    }
    assert_eq!(setpoint(json!({"frequency_hz": 30})), Ok(Frequency::from_hertz(30).into()));
}

#[test]
fn a_number_that_the_type_cannot_hold_is_an_error_in_words() {
    for (value, says) in [
        (json!({"frequency_hz": 30.005}), "expected a number in Hz with 2 decimals at the most"),
        (json!({"frequency_hz": -5}), "-5.00 Hz is outside 0.00 Hz to 42949672.95 Hz"),
        (json!({"frequency_hz": 1e300}), "expected a number in Hz"),
        (json!({"frequency_hz": 5e7}), "50000000.00 Hz is outside"),
        (json!({"frequency_hz": u64::MAX}), "too large"),
        (json!({"frequency_hz": "30"}), "expected a number in Hz"),
        (json!({"speed_rpm": 900.5}), "expected a number in rpm with 0 decimals"),
        (json!({"speed_rpm": null}), "expected a number in rpm"),
        (json!({"frequency": 30}), "unknown variant `frequency`"),
        (json!({"frequency_hz": 30, "speed_rpm": 900}), ""),
        (json!(30), ""),
    ] {
        let error = setpoint(value.clone()).expect_err(&value.to_string());
        assert!(error.contains(says), "{value}: {error}");
    }
    let not_a_number = serde::de::value::F64Deserializer::<serde::de::value::Error>::new(f64::NAN);
    let error = <Frequency as serde::Deserialize>::deserialize(not_a_number).unwrap_err().to_string();
    assert!(error.contains("NaN") && error.contains("a number in Hz"), "{error}");
}

#[test]
fn a_stop_a_watchdog_a_command_and_a_kind_of_error_are_told_in_their_words() {
    let stopped = Stopped {
        instead: Some("DC injection is not assigned"),
        taken_from: Some(Control::Panel),
        ..Stopped::by(StopMode::Ramp, Status { state: State::Ready, ..Status::default() })
    };
    is(
        stopped,
        json!({
            "status": {"state": "ready", "raw": []}, "mode": "ramp",
            "instead": "DC injection is not assigned", "taken_from": "panel"
        }),
    );
    let armed = Watchdog { timeout: Some(Duration::from_secs(10)), reaction: Some(Reaction::Ramp) };
    is(armed, json!({"time_ms": 10_000, "reaction": "ramp"}));
    is(Watchdog { timeout: None, reaction: None }, json!({}));
    is(
        Command::Start(Direction::Forward),
        json!({"action": "start", "command": "start forward", "direction": "forward"}),
    );
    is(ErrorKind::OutcomeUnknown, json!("outcome_unknown"));
}

#[cfg(feature = "schemars")]
#[test]
fn the_schema_of_a_status_names_the_keys_that_it_is_told_by() {
    let schema = schemars::generate::SchemaSettings::default()
        .for_serialize()
        .into_generator()
        .into_root_schema_for::<Status>();
    let properties = schema.get("properties").and_then(Value::as_object).unwrap();
    assert_eq!(properties["output_frequency_hz"]["type"], json!(["number", "null"]));
    assert!(properties.contains_key("age_ms") && !properties.contains_key("at"), "{properties:?}");
    assert_eq!(schema.get("required"), Some(&json!(["state", "raw"])));
}

#[tokio::test(start_paused = true)]
async fn what_is_told_of_a_drive_reads_back_as_it_was() {
    fn comes_back<T>(told: &T)
    where
        T: serde::Serialize + serde::de::DeserializeOwned + PartialEq + std::fmt::Debug,
    {
        assert_eq!(from_value::<T>(to_value(told).unwrap()).as_ref().ok(), Some(told));
    }
    let at = Some(Instant::now());
    advance(Duration::from_millis(1_250)).await;
    let raw = vec![RawWord { address: 3_201, code: "ETA", value: 1_591 }];
    let status = Status {
        state: State::FaultReaction,
        direction: Some(Direction::Reverse),
        output_frequency: Some(Frequency::from_centihertz(3_005)),
        fault_code: Some(5),
        control: Some(Control::Terminals),
        warning: Some(true),
        verdict: Some(Verdict::lacks(Lack::Reference, Refusal::Settings("the panel gives the reference"))),
        motion: Motion::Coasting,
        raw: raw.clone(),
        at,
        ..Status::default()
    };
    comes_back(&status);
    comes_back(&Status::default());
    let measurements = Measurements {
        at,
        torque: Some(Percent::from_percent(-40)),
        running_time: Some(Duration::from_secs(5_400)),
        reference: Some(Speed::from_rpm(900).into()),
        inputs: Some(3),
        raw: raw.clone(),
        ..Measurements::default()
    };
    comes_back(&measurements);
    comes_back(&Identity { model: Some("ATV312HU15N4".to_owned()), codes: raw, ..Identity::default() });
    static OLF: FaultEntry = FaultEntry::new(9, "OLF", "motor overload", "let the motor cool");
    let listed = Fault { code: 9, entry: Some(&OLF) };
    let unlisted = Fault { code: 77, entry: None };
    comes_back(&Faults { present: vec![listed], history: vec![unlisted], ..Faults::default() });
    for command in [
        Command::Start(Direction::Reverse),
        Command::Stop(StopMode::DcInjection),
        Command::Withdraw,
        Command::Setpoint(Frequency::from_hertz(30).into()),
        Command::ResetFaults,
        Command::Release,
        Command::ArmWatchdog,
        Command::WriteParameter(3_103),
        Command::Persist,
        Command::Configure("accepting the identity"),
    ] {
        comes_back(&command);
    }
    assert!(from_value::<Command>(json!({"action": "start", "command": "start forward"})).is_err());
    assert!(from_value::<Command>(json!({"action": "dance", "command": "dance"})).is_err());
}

#[test]
fn words_that_a_stranger_sends_do_not_fill_the_memory() {
    let mut words = super::Words { texts: std::collections::BTreeSet::new(), bytes: 0 };
    let large = "x".repeat(300_000);
    let kept: usize = (0..10).map(|number| words.text(&format!("{number}{large}")).len()).sum();
    assert!((900_000..=1 << 20).contains(&kept), "{kept}");
    assert_eq!(words.text(&large), "?", "a word for which there is no room is a question mark");
    assert_eq!(words.text(&format!("0{large}")).len(), large.len() + 1, "one that is known needs no room");
}
