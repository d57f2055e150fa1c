//! Drives from files, whose stops alone are carried out.

use std::{sync::Arc, time::Duration};

use drive_core::{Direction, Frequency};
use drive_families::Family;
use drive_profile::{definition, shipped};
use tokio::time::sleep;

use super::{Peer, config, names};
use crate::{clients::Course, desk::Desk};
use drived_doors::{Role, audit::Audit};
use drived_plant::plant::testing::TestPlant;

/// RUN of a WJ200 is coil 1, and coil 2 its direction: 0000h and 0001h on the wire (function 05h, 0Fh).
const COIL: fn(u16, bool) -> Vec<u8> =
    |coil, on| [&[0x05][..], &coil.to_be_bytes(), &[if on { 0xFF } else { 0 }, 0]].concat();

#[tokio::test(start_paused = true)]
async fn a_coil_that_stops_a_drive_from_a_file_stops_it_through_a_gateway_and_one_that_runs_it_is_refused() {
    let profile = shipped::find("wj200").expect("it is shipped").clone();
    let family = Family::new(definition(&Arc::new(profile)));
    family.add().expect("nobody has its name");
    let plant = TestPlant::of_family(family, 1).await;
    let mut config = config();
    (config.rights, config.patience) = (Role::Operate.rights(), Duration::from_secs(3));
    let desk = Desk::new(&Course::default(), config, plant.plant.clone(), Audit::default(), names(&plant));
    let mut peer = Peer::of(&desk);
    let pump = plant.plant.fleet().drive("pump 1").expect("it is there");
    let run = family.capabilities().rows.iter().find(|row| row.code == "RUN").expect("it has one").address;
    let several = [&[0x0F][..], &run.to_be_bytes(), &[0, 2, 1, 0b10]].concat();
    for stop in [COIL(run, false), several] {
        let started = pump.start_at(Direction::Forward, Frequency::from_hertz(20)).await;
        assert!(started.is_confirmed(), "{started:?}");
        sleep(Duration::from_secs(10)).await;
        let refused = [peer.ask(1, &COIL(run, true)).await, peer.ask(1, &COIL(run + 1, true)).await];
        assert_eq!(refused, [[0x85, 0x01], [0x85, 0x01]]);
        assert!(plant.machines[0].observe().running);
        assert_eq!(peer.ask(1, &stop).await[..], stop[..5]);
        sleep(Duration::from_secs(20)).await;
        assert!(!plant.machines[0].observe().running);
    }
    // Of a family that has no coils it is as before.
    let other = TestPlant::of(1).await;
    let desk = Desk::new(
        &Course::default(),
        desk.config.clone(),
        other.plant.clone(),
        Audit::default(),
        names(&other),
    );
    assert_eq!(Peer::of(&desk).ask(1, &COIL(0, false)).await, [0x85, 0x01]);
}
