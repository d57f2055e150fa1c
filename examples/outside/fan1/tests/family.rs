//! The family as programs have it that choose drives by name.

use drive_core::{Direction, Error, Frequency, Lack, Motion, StopMode, Verdict};
use drive_families::{Family, Options, SetUp};
use drive_fan1::FAN1;
use drive_sim::Panel;
use drive_testing::{Contract, rig::Rig};

const FAMILY: Family = Family::new(&FAN1);

/// Of a drive whose owner says this, and a machine that is set up so.
fn rig(options: &Options, set_up: SetUp) -> Rig {
    let options = options.clone();
    let open = move |port, slave| FAMILY.open_with(port, slave, &options);
    Contract::new(FAMILY.capabilities(), open, move || FAMILY.machine(set_up).expect("it has a twin")).rig()
}

#[tokio::test(start_paused = true)]
async fn a_setpoint_above_what_the_owner_allows_is_refused_and_not_sent() {
    FAMILY.add().expect("its name is free");
    let mut options = Options::default();
    options.set("highest-frequency", "45Hz").expect("it is a value");
    options.check(FAMILY).expect("it is its option");
    let mut rig = rig(&options, SetUp::ForTheBus);
    let refused = rig.drive.set_setpoint(Frequency::from_decihertz(451).into()).await;
    assert!(matches!(refused, Err(Error::Setpoint { .. })), "{refused:?}");
    assert_eq!(rig.machine.all_requests(), 0);
    rig.drive.set_setpoint(Frequency::from_hertz(45).into()).await.expect("its owner allows it");
    assert_eq!(rig.machine.peek(0x0101), Some(450));
}

#[test]
fn what_is_no_frequency_of_the_drive_is_no_value_of_the_option() {
    let mut options = Options::default();
    for text in ["0Hz", "0.99Hz", "60.01Hz", "45", "fast"] {
        assert!(options.set("highest-frequency", text).is_err(), "{text}");
    }
}

#[tokio::test(start_paused = true)]
async fn from_the_factory_its_panel_commands_and_a_start_is_refused() {
    let mut rig = rig(&Options::default(), SetUp::Factory);
    let refused = rig.drive.start(Direction::Forward).await;
    assert!(matches!(refused, Err(Error::Refused { .. })), "{refused:?}");
    assert_eq!(rig.machine.peek(0x0100), Some(0), "no run command was written");
}

#[tokio::test(start_paused = true)]
async fn a_stop_along_the_ramp_ends_at_rest() {
    let mut rig = rig(&Options::default(), SetUp::ForTheBus);
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect("it takes 30 Hz");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.until_at(Frequency::from_hertz(30)).await;
    rig.drive.stop(StopMode::Ramp).await.expect("it stops");
    assert_eq!(rig.until_standstill().await.motion, Motion::AtRest);
}

/// FAN1 Modbus p. 2: it acts when it was 0 once.
#[tokio::test(start_paused = true)]
async fn a_run_command_that_stood_through_a_stop_at_the_panel_is_taken_back_before_the_next_start() {
    let mut rig = rig(&Options::default(), SetUp::ForTheBus);
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect("it takes 30 Hz");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.panel(Panel::Stop);
    rig.until_machine("it stands", |machine| !machine.running).await;
    assert_eq!(rig.machine.peek(0x0100), Some(0x0001), "its run command stands");
    rig.drive.start(Direction::Forward).await.expect("it starts again");
    rig.until_at(Frequency::from_hertz(30)).await;
}

#[tokio::test(start_paused = true)]
async fn a_reference_of_another_master_is_not_told_as_ours() {
    let mut rig = rig(&Options::default(), SetUp::ForTheBus);
    rig.drive.set_setpoint(Frequency::from_hertz(30).into()).await.expect("it takes 30 Hz");
    rig.drive.start(Direction::Forward).await.expect("it starts");
    rig.machine.written_by_another(0x0101, 100).expect("the drive takes it");
    let verdict = rig.drive.status().await.expect("it answers").verdict;
    assert!(matches!(verdict, Some(Verdict::NotInForce { lacks: Lack::Reference, .. })), "{verdict:?}");
    rig.drive.set_setpoint(Frequency::from_hertz(20).into()).await.expect("it takes 20 Hz");
    assert_eq!(rig.drive.status().await.expect("it answers").verdict, Some(Verdict::InForce));
}
