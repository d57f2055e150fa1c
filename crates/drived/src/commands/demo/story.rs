//! What happens in the demo, and when.

use std::time::Duration;

use drive_core::{Direction, Frequency, StopMode};
use drive_families::Family;
use drive_sim::Panel;
use tokio::time::{self, Instant};

use super::unit::{Order, Unit};
use crate::simulated;

/// The story is told again from the beginning after this time.
const LENGTH: Duration = Duration::from_secs(30);

/// It begins when every drive can be started, and at the latest after this time.
const PATIENCE: Duration = Duration::from_secs(15);

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

/// Tells the story again and again.
pub(super) async fn tell(units: Vec<Unit>) {
    let ready_by = Instant::now() + PATIENCE;
    for unit in &units {
        unit.is_ready_by(ready_by).await;
    }
    let families: Vec<Family> = units.iter().map(|unit| unit.name.family).collect();
    loop {
        let began = Instant::now();
        for scene in scenes(&families) {
            time::sleep_until(began + scene.at).await;
            let Some(unit) = units.get(scene.unit) else { continue };
            match scene.deed {
                Deed::Order(order) => unit.order(order),
                Deed::Trip => unit.machine.trip(simulated::trip_code(unit.name.family)),
                Deed::Panel(action) => unit.machine.panel(action),
            }
        }
        time::sleep_until(began + LENGTH).await;
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
    use super::*;

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
        let families: Vec<Family> = Family::ALL.iter().flat_map(|&family| [family, family]).collect();
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
        let scenes = scenes(&Family::ALL);
        for unit in 0..Family::ALL.len() {
            let mut of_unit = scenes.iter().filter(|scene| scene.unit == unit);
            assert!(of_unit.any(|scene| scene.deed == Deed::Trip));
            assert_eq!(of_unit.next().and_then(Scene::order), Some(Order::Reset));
            assert!(of_unit.any(|scene| matches!(scene.order(), Some(Order::Start(_)))));
        }
    }
}
