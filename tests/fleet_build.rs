//! What a fleet takes and refuses before it starts.

use std::time::Duration;

use drive_bus::{Line, LineConfig, SlaveSettings};
use drive_core::{Direction, Error, Frequency, SerialSettings, SlaveAddress, StopMode};
use drive_families::Family;
use drive_fleet::{DriveSettings, Fleet, FleetError};
use drive_sim::{SimLine, Wiring};
use drive_testing::witness::Witnesses;
use support::{drives, plant::common_settings};

const SECOND: Duration = Duration::from_secs(1);

/// A line with machines of this family at 1 and 2.
fn site(family: Family, settings: SerialSettings) -> (SimLine, Line) {
    let simulated = SimLine::new(Wiring::rtu(settings));
    for address in 1..=2 {
        simulated.add_boxed(address, drives::machine(family)).expect("the address is free");
    }
    let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
    (simulated, line)
}

#[tokio::test(start_paused = true)]
async fn a_drive_is_commanded_on_the_line_and_at_the_address_under_which_it_is_registered() {
    let family = Family::ATV312;
    let (north, north_line) = site(family, SerialSettings::MODBUS_DEFAULT);
    let (south, south_line) = site(family, SerialSettings::MODBUS_DEFAULT);
    let fleet = Fleet::builder()
        .line("north", north_line)
        .line("south", south_line)
        .drive("south", 2, DriveSettings::controlled("pump"), |port, slave| family.open(port, slave))
        .start()
        .expect("it can be");
    let _witnesses = Witnesses::of_fleet(&fleet, [("north", &north), ("south", &south)]);
    let pump = fleet.drive("pump").expect("it is there");
    pump.ready(60 * SECOND).await.expect("it gets ready");
    assert!(pump.run(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
    assert!(south.slave(2).expect("it is there").observe().running);
    for (site, address) in [(&north, 1), (&north, 2), (&south, 1)] {
        assert_eq!(site.slave(address).expect("it is there").all_requests(), 0);
    }
}

#[tokio::test(start_paused = true)]
async fn what_was_made_for_another_address_is_refused() {
    let family = Family::ATV312;
    let (_site, line) = site(family, SerialSettings::MODBUS_DEFAULT);
    let other = SlaveAddress::try_from(2).expect("it is an address");
    let refused = Fleet::builder()
        .line("north", line)
        .drive("north", 1, DriveSettings::controlled("pump"), |port, _| family.open(port, other))
        .start();
    let Err(problem @ FleetError::OtherAddress { .. }) = refused else { panic!("{refused:?}") };
    assert_eq!(problem.to_string(), "pump: registered at address 1, and made for address 2");
}

#[tokio::test(start_paused = true)]
async fn what_cannot_be_is_refused_with_its_name() {
    let family = Family::ATV312;
    for (line_name, address, expected) in [
        ("south", 1, "pump: there is no line \"south\""),
        ("north", 0, "pump: 0 is not a slave address"),
        ("north", 248, "pump: 248 is not a slave address"),
        ("north", 2, "pump: address 2 of line \"north\" is taken"),
    ] {
        let (_site, line) = site(family, SerialSettings::MODBUS_DEFAULT);
        let refused = Fleet::builder()
            .line("north", line)
            .drive("north", 2, DriveSettings::controlled("fan"), |port, slave| family.open(port, slave))
            .drive(line_name, address, DriveSettings::controlled("pump"), |port, slave| {
                family.open(port, slave)
            })
            .start();
        let problem = refused.expect_err("it cannot be").to_string();
        assert!(problem.starts_with(expected), "{problem}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_line_that_was_told_nothing_keeps_the_pause_of_its_families_and_a_longer_one_that_it_was_told() {
    let family = Family::OMRON_3G3EV;
    let needed = family.capabilities().turnaround;
    for said in [Duration::ZERO, 2 * needed] {
        let simulated = SimLine::new(Wiring::rtu(common_settings()));
        simulated.add_boxed(5, drives::machine(family)).expect("the address is free");
        let told = SlaveSettings { turnaround: said, response_timeout: Some(SECOND) };
        let config = LineConfig::stream(common_settings()).slave(5, told);
        let line = Line::over(simulated.in_memory(), config);
        let fleet = Fleet::builder()
            .line("north", line.clone())
            .drive("north", 5, DriveSettings::controlled("fan"), |port, slave| {
                drives::drive(family, port, slave)
            })
            .start()
            .expect("it can be");
        let _witnesses = Witnesses::of_fleet(&fleet, [("north", &simulated)]);
        let fan = fleet.drive("fan").expect("it is there");
        fan.ready(60 * SECOND).await.expect("it gets ready");
        assert!(fan.run(Direction::Forward, Frequency::from_hertz(20)).await.is_confirmed());
        assert_eq!(simulated.violations(), []);
        let expected = SlaveSettings { turnaround: needed.max(said), ..told };
        assert_eq!(line.config().slaves.get(&5), Some(&expected));
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_of_another_address_than_its_port_says_so_and_neither_slave_hears_of_it() {
    for family in Family::BUILT_IN {
        let (simulated, line) = site(family, common_settings());
        let [one, two] = [1, 2].map(|at| SlaveAddress::try_from(at).expect("an address"));
        let mut drive = family.open(line.slave(1), two);
        let expected = Error::OtherSlave { slave: two, made_for: one };
        assert_eq!(drive.status().await, Err(expected.clone()), "{family}");
        assert_eq!(drive.start(Direction::Forward).await, Err(expected.clone()), "{family}");
        assert_eq!(drive.stop(StopMode::Freewheel).await, Err(expected), "{family}");
        for address in [1, 2] {
            assert_eq!(simulated.slave(address).expect("it is there").all_requests(), 0, "{family}");
        }
    }
}
