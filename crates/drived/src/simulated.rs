//! Simulated drives, for `sim` and `demo`.

use drive_bus::Protocol;
use drive_families::Family;
use drive_sim::{Model, models};

/// A simulated drive of a family, set up for the bus.
pub(crate) fn model(family: Family) -> Box<dyn Model> {
    match family {
        Family::Atv21 => Box::new(models::atv21::Atv21::new().with_blocks()),
        Family::Atv28 => Box::new(models::atv28::Atv28::new()),
        Family::Atv58 => Box::new(models::atv58::Atv58::new()),
        Family::Atv312 => Box::new(models::atv312::Atv312::under_bus_control()),
        Family::Omron3g3ev => Box::new(models::drive_3g3ev::Drive3g3ev::new()),
    }
}

/// The simulator's name of a protocol.
pub(crate) const fn protocol(protocol: Protocol) -> drive_sim::Protocol {
    match protocol {
        Protocol::Rtu => drive_sim::Protocol::Rtu,
        Protocol::Ascii(_) => drive_sim::Protocol::Ascii,
        Protocol::UniTelway(_) => drive_sim::Protocol::UniTelway,
    }
}

/// A code of the family's for an overcurrent or an overload, which a reset clears.
pub(crate) const fn trip_code(family: Family) -> u16 {
    match family {
        Family::Atv21 => 3,
        Family::Atv28 | Family::Atv312 => 9,
        Family::Atv58 => 5,
        Family::Omron3g3ev => 0,
    }
}

#[cfg(test)]
mod tests {
    use drive_bus::{Line, LineConfig};
    use drive_core::{SlaveAddress, State};
    use drive_sim::{SimLine, Wiring};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn the_trip_of_every_family_is_read_as_a_fault() {
        for family in Family::ALL {
            let settings = family.capabilities().factory;
            let simulated = SimLine::new(Wiring::rtu(settings));
            let machine = simulated.add_boxed(1, model(family)).unwrap();
            let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
            let mut drive = family.open(line.slave(1), SlaveAddress::try_from(1).unwrap());
            assert!(!drive.status().await.unwrap().is_fault(), "{family}");
            machine.trip(trip_code(family));
            assert_eq!(drive.status().await.unwrap().state, State::Fault, "{family}");
            assert_eq!(drive.faults().await.unwrap().present.len(), 1, "{family}");
        }
    }
}
