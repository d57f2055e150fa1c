//! What happens in the demo, and when.

use std::{collections::BTreeSet, sync::Arc, time::Duration};

use drive_core::{Command, Direction, Frequency, StopMode};
use drive_families::Family;
use drive_fleet::{Event, EventKind, Events, Fleet, Received};
use drive_sim::Panel;
use tokio::time::{self, Instant};

use super::unit::{Order, Unit};

/// The story is told again from the beginning after this time.
const LENGTH: Duration = Duration::from_secs(30);

/// It begins when every drive can be started, and at the latest after this time.
const PATIENCE: Duration = Duration::from_secs(15);

/// By whom the orders of the story are given.
pub(super) const TELLER: &str = "the demo";

/// Somebody at the plant does something with one drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Deed {
    Order(Order),
    Trip,
    Panel(Panel),
}

struct Scene {
    at: Duration,
    unit: usize,
    deed: Deed,
}

/// Tells the story again and again. A drive that somebody else has commanded is left to him from then on: a motor that
/// was stopped by a person does not start again.
pub(super) async fn tell(units: Vec<Unit>, fleet: Fleet) {
    let ready_by = Instant::now() + PATIENCE;
    for unit in &units {
        unit.is_ready_by(ready_by).await;
    }
    let mut events = fleet.events();
    let mut left_alone = BTreeSet::new();
    let families: Vec<Family> = units.iter().map(|unit| unit.name.family).collect();
    loop {
        let began = Instant::now();
        for scene in scenes(&families) {
            hear_until(began + scene.at, &mut events, &mut left_alone).await;
            let unit = units.get(scene.unit).filter(|unit| !left_alone.contains(&*unit.name.to_string()));
            let Some(unit) = unit else { continue };
            match scene.deed {
                Deed::Order(order) => unit.order(order),
                Deed::Trip => {
                    if let Some(code) = unit.name.family.simulated_trip() {
                        unit.machine.trip(code);
                    }
                }
                Deed::Panel(action) => unit.machine.panel(action),
            }
        }
        hear_until(began + LENGTH, &mut events, &mut left_alone).await;
    }
}

/// Notes until then which drives are commanded by others.
async fn hear_until(then: Instant, events: &mut Events, left_alone: &mut BTreeSet<Arc<str>>) {
    loop {
        let received = tokio::select! {
            biased;
            received = events.recv() => received,
            () = time::sleep_until(then) => return,
        };
        match received {
            Received::Event(Event { drive, kind: EventKind::Command { command, commander, .. }, .. }) => {
                // A run command of the story is withdrawn by the fleet when the drive trips.
                if &*commander != TELLER && command != Command::Withdraw {
                    left_alone.insert(drive);
                }
            }
            Received::Event(_) | Received::Missed(_) => {}
            Received::End => return time::sleep_until(then).await,
        }
    }
}

/// The scenes in their order, for drives of these families.
fn scenes(families: &[Family]) -> Vec<Scene> {
    let mut scenes = Vec::new();
    let mut scene = |at_ms: usize, unit: usize, deed: Deed| {
        scenes.push(Scene { at: Duration::from_millis(at_ms as u64), unit, deed });
    };
    let mut tripped = Vec::new();
    for (unit, family) in families.iter().enumerate() {
        let hertz =
            |base: u16| Deed::Order(Order::Setpoint(Frequency::from_hertz(base + unit as u16 % 5 * 5)));
        let start = |direction| Deed::Order(Order::Start(direction));
        let direction = if unit % 3 == 2 { Direction::Reverse } else { Direction::Forward };
        scene(500 + 100 * unit, unit, hertz(20));
        scene(1_500 + 300 * unit, unit, start(direction));
        // The first drive of each family trips; one that restarts by its reset has lost its setpoint.
        if !tripped.contains(family) {
            let at = 5_500 + 1_200 * tripped.len();
            tripped.push(*family);
            scene(at, unit, Deed::Trip);
            scene(at + 2_000, unit, Deed::Order(Order::Reset));
            scene(at + 5_000, unit, hertz(30));
            scene(at + 5_500, unit, start(direction));
        } else {
            scene(8_500 + 100 * unit, unit, hertz(30));
            if unit % 3 == 1 {
                scene(12_000, unit, start(Direction::Reverse));
            }
        }
        let modes = family.capabilities().stop_modes;
        let mode = modes.get(unit % modes.len().max(1)).copied().unwrap_or(StopMode::Ramp);
        scene(22_000 + 300 * unit, unit, Deed::Order(Order::Stop(mode)));
    }
    // While somebody at the panel has control, a start is refused and a drive says who commands it.
    let middle = families.len() / 2;
    scene(25_500, middle, Deed::Panel(Panel::TakeControl));
    scene(27_000, middle, Deed::Order(Order::Start(Direction::Forward)));
    scene(28_500, middle, Deed::Panel(Panel::ReleaseControl));
    scenes.sort_by_key(|scene| scene.at);
    scenes
}

#[cfg(test)]
mod tests {
    use drive_core::SlaveAddress;
    use drive_fleet::{DriveHandle, DriveSettings};

    use super::*;
    use drived_plant::plant::testing::TestPlant;
    use drived_words::drive_spec::DriveName;

    #[tokio::test(start_paused = true)]
    async fn a_motor_that_a_person_has_stopped_is_not_started_by_the_story() {
        let named = |name: String| DriveSettings::controlled(name.replace("pump ", "atv312@"));
        let TestPlant { plant, machines, witnesses: _witnesses, .. } = TestPlant::with(2, named).await;
        let fleet = plant.fleet();
        let unit = |((address, machine), handle): ((u8, &drive_sim::SimSlave), DriveHandle)| {
            let slave = SlaveAddress::try_from(address).unwrap();
            Unit::new(DriveName { family: Family::ATV312, slave }, machine.clone(), handle)
        };
        let units = (1..).zip(&machines).zip(fleet.drives()).map(unit).collect();
        let story = tokio::spawn(tell(units, fleet.clone()));
        // The second drive trips never, and runs until it is stopped.
        let second = fleet.drive("atv312@2").unwrap();
        second
            .wait_until(|known| known.status.as_ref().is_some_and(|status| status.value.state.is_moving()))
            .await;
        assert!(second.commanded_by("somebody").stop(StopMode::Fast).await.is_confirmed());
        for _ in 0..LENGTH.as_secs() * 4 {
            time::sleep(Duration::from_millis(500)).await;
            assert!(!machines[1].observe().running);
        }
        let trips = fleet.drive("atv312@1").unwrap().snapshot().counters.trips;
        assert!(trips > 1, "the story goes on with the other: {trips}");
        story.abort();
    }

    impl Scene {
        fn order(&self) -> Option<Order> {
            match self.deed {
                Deed::Order(order) => Some(order),
                Deed::Trip | Deed::Panel(_) => None,
            }
        }
    }

    #[test]
    fn every_drive_is_started_and_stopped_by_a_mode_that_it_has_before_the_story_begins_anew() {
        let families: Vec<Family> = Family::all().iter().flat_map(|&family| [family, family]).collect();
        let scenes = scenes(&families);
        assert!(scenes.iter().all(|scene| scene.at < LENGTH));
        for (unit, family) in families.iter().enumerate() {
            let modes = family.capabilities().stop_modes;
            let of_unit = scenes.iter().filter(|scene| scene.unit == unit);
            let orders: Vec<Order> = of_unit.filter_map(Scene::order).collect();
            assert!(orders.iter().any(|order| matches!(order, Order::Start(_))));
            assert!(orders.iter().any(|order| matches!(order, Order::Stop(mode) if modes.contains(mode))));
        }
    }

    #[test]
    fn a_drive_of_every_family_trips_and_is_reset_and_started_again() {
        let scenes = scenes(&Family::BUILT_IN);
        for unit in 0..Family::BUILT_IN.len() {
            let mut of_unit = scenes.iter().filter(|scene| scene.unit == unit);
            assert!(of_unit.any(|scene| scene.deed == Deed::Trip));
            assert_eq!(of_unit.next().and_then(Scene::order), Some(Order::Reset));
            assert!(of_unit.any(|scene| matches!(scene.order(), Some(Order::Start(_)))));
        }
    }
}
