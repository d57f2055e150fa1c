//! What happens in the demo, and when.

use std::time::Duration;

use drive_core::{Direction, Frequency, StopMode};
use drive_sim::Panel;
use tokio::time::{self, Instant};

use super::unit::{Order, Unit};
use crate::simulated;

/// The story is told again from the beginning after this time.
const LENGTH: Duration = Duration::from_secs(30);

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
    let stop_modes: Vec<&[StopMode]> =
        units.iter().map(|unit| unit.name.family.capabilities().stop_modes).collect();
    loop {
        let began = Instant::now();
        for scene in scenes(&stop_modes) {
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

/// The scenes in their order, for drives with these stop modes.
fn scenes(stop_modes: &[&[StopMode]]) -> Vec<Scene> {
    let mut scenes = Vec::new();
    let mut scene = |at_ms: usize, unit: usize, deed: Deed| {
        scenes.push(Scene { at: Duration::from_millis(at_ms as u64), unit, deed });
    };
    for (unit, modes) in stop_modes.iter().enumerate() {
        let hertz = |base: u16| Order::Setpoint(Frequency::from_hertz(base + unit as u16 % 5 * 5));
        let direction = if unit % 3 == 2 { Direction::Reverse } else { Direction::Forward };
        scene(500 + 100 * unit, unit, Deed::Order(hertz(20)));
        scene(1_500 + 300 * unit, unit, Deed::Order(Order::Start(direction)));
        scene(8_500 + 100 * unit, unit, Deed::Order(hertz(30)));
        if unit % 3 == 1 {
            scene(12_000, unit, Deed::Order(Order::Start(Direction::Reverse)));
        }
        let mode = modes.get(unit % modes.len().max(1)).copied().unwrap_or(StopMode::Ramp);
        scene(22_000 + 300 * unit, unit, Deed::Order(Order::Stop(mode)));
    }
    let last = stop_modes.len().saturating_sub(1);
    scene(5_500, 0, Deed::Trip);
    scene(8_000, 0, Deed::Order(Order::Reset));
    scene(12_500, 0, Deed::Order(Order::Start(Direction::Forward)));
    scene(13_000, last, Deed::Trip);
    scene(16_000, last, Deed::Order(Order::Reset));
    scene(17_500, last, Deed::Order(Order::Start(Direction::Forward)));
    // While somebody at the panel has control, a start is refused and a drive says who commands it.
    let middle = last / 2;
    scene(25_500, middle, Deed::Panel(Panel::TakeControl));
    scene(27_000, middle, Deed::Order(Order::Start(Direction::Forward)));
    scene(28_500, middle, Deed::Panel(Panel::ReleaseControl));
    scenes.sort_by_key(|scene| scene.at);
    scenes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_drive_is_started_and_stopped_by_a_mode_that_it_has_before_the_story_begins_anew() {
        let modes: [&[StopMode]; 4] =
            [&StopMode::ALL, &[StopMode::Ramp], &[StopMode::Ramp, StopMode::Freewheel], &StopMode::ALL];
        let scenes = scenes(&modes);
        assert!(scenes.iter().all(|scene| scene.at < LENGTH));
        for (unit, modes) in modes.iter().enumerate() {
            let orders =
                scenes.iter().filter(|scene| scene.unit == unit).filter_map(|scene| match scene.deed {
                    Deed::Order(order) => Some(order),
                    Deed::Trip | Deed::Panel(_) => None,
                });
            let orders: Vec<Order> = orders.collect();
            assert!(orders.iter().any(|order| matches!(order, Order::Start(_))));
            assert!(orders.iter().any(|order| matches!(order, Order::Stop(mode) if modes.contains(mode))));
        }
    }

    #[test]
    fn a_trip_is_followed_by_its_reset() {
        let scenes = scenes(&[&StopMode::ALL[..]; 3]);
        for (index, scene) in scenes.iter().enumerate().filter(|(_, scene)| scene.deed == Deed::Trip) {
            let later = &scenes[index..];
            assert!(
                later.iter().any(|next| next.unit == scene.unit && next.deed == Deed::Order(Order::Reset))
            );
        }
    }
}
