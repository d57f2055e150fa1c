//! A drive that is exchanged for another between two looks, within a time in which nobody misses it: it has the address and the
//! wires of the one before, and says of itself what it is.

use drive_bus::Protocol;
use drive_core::{Direction, Drive, Error, Frequency, Refusal, Setpoint};
use drive_families::Family;
use drive_sim::{Model, models};
use drive_testing::{bench, rig::ADDRESS, rig::Rig};
use support::drives::{self, Five, five};

const TWENTY: Setpoint = Setpoint::Frequency(Frequency::from_hertz(20));

/// What tells one Altivar 28 from another: its nominal current (BBV51701 p. 57).
const INV_OF_A_28: u16 = 555;

/// The rating of a 312, 13: 15 kW (BBV51701 p. 26).
const NCV_OF_A_312: u16 = 3_011;

/// One of the same family, of another size.
fn another(family: Family) -> Box<dyn Model> {
    match five(family) {
        Five::Atv21 => Box::new(models::atv21::Atv21::new().identified_as("ATV21HD30N4")),
        Five::Atv312 => {
            Box::new(models::atv312::Atv312::under_bus_control().identified_as("ATV312HD15N4", "0102"))
        }
        _ => drives::machine(family),
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_was_exchanged_between_two_looks_is_not_started_by_the_others_name() {
    for family in [Family::ATV21, Family::ATV28, Family::ATV312] {
        for identified in [true, false] {
            let settings = family.capabilities().factory;
            let open = |port, slave| drives::drive(family, port, slave);
            let mut rig = Rig::new(Protocol::Rtu, settings, drives::machine(family), open);
            if identified {
                rig.drive.identify().await.unwrap();
            }
            rig.drive.set_setpoint(TWENTY).await.unwrap();
            rig.drive.start(Direction::Forward).await.unwrap();
            rig.drive.stop(drive_core::StopMode::Ramp).await.unwrap();
            rig.until("standstill", drive_core::Status::is_standstill).await;
            // The same drive behind a power cut says the same.
            rig.machine.power_cycle();
            rig.drive.status().await.unwrap();
            rig.drive.set_setpoint(TWENTY).await.unwrap();
            rig.drive.start(Direction::Forward).await.unwrap();
            rig.drive.stop(drive_core::StopMode::Ramp).await.unwrap();
            rig.until("standstill", drive_core::Status::is_standstill).await;

            rig.machine.power(false);
            let other = rig.simulated.add_beside(ADDRESS, another(family)).unwrap();
            match five(family) {
                Five::Atv28 => assert!(other.poke(INV_OF_A_28, other.peek(INV_OF_A_28).unwrap() + 50)),
                Five::Atv312 => assert!(other.poke(NCV_OF_A_312, 13)),
                _ => {}
            }
            rig.drive.status().await.unwrap();
            for _ in 0..2 {
                let error = rig.drive.start(Direction::Forward).await.unwrap_err();
                assert!(
                    matches!(error, Error::Refused { reason: Refusal::Exchanged, .. }),
                    "{family}: {error}"
                );
            }
            assert_eq!(bench::writes(&other), 0, "{family}");
            // A stop is written to any drive.
            rig.drive.stop(drive_core::StopMode::Ramp).await.unwrap();
            assert!(bench::writes(&other) > 0, "{family}");
            // Who has asked it again which it is knows whom it starts.
            rig.drive.identify().await.unwrap();
            rig.drive.set_setpoint(TWENTY).await.unwrap();
            rig.drive.start(Direction::Forward).await.unwrap();
        }
    }
}
