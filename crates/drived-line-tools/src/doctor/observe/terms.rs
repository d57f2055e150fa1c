//! How the line and its slaves are asked: patiently, and each question once.

use std::time::Duration;

use drive_bus::{LineConfig, SlaveSettings, config::Echo};
use drive_core::SlaveAddress;
use drive_families::Family;

use super::{DITHER, PATIENCE, Task};

/// How long one is waited for that has answered soon so often, or was silent though it should be there: what it misses would
/// cost a second each.
pub(super) const IMPATIENCE: Duration = Duration::from_millis(400);

/// The line so that every question is asked once, and answers are waited for longer than masters do.
pub(super) fn of_doctor(task: &Task) -> LineConfig {
    let config = LineConfig {
        echo: Echo::Auto,
        timeout_floor: PATIENCE,
        response_timeout: PATIENCE,
        offline_after: 0,
        retries: 0,
        double_window: Duration::ZERO,
        // An adapter may hold back the rest of an answer for as long as the slowest clock that is looked for, or longer.
        chunk_gap: 2 * DITHER,
        ..task.config.clone()
    };
    task.addresses.iter().fold(config, |config, slave| {
        let settings = settings_of(task, *slave);
        config.slave(slave.number(), settings)
    })
}

/// How a slave is asked: after the pause that its family's manual wants, or the longest of any where it is not known.
pub(super) fn settings_of(task: &Task, slave: SlaveAddress) -> SlaveSettings {
    let named = task.expected.iter().find(|name| name.slave == slave);
    let pauses = Family::all().into_iter().map(|family| family.capabilities().turnaround);
    match named {
        Some(name) => SlaveSettings {
            turnaround: name.family.capabilities().turnaround,
            response_timeout: Some(PATIENCE),
        },
        None => {
            SlaveSettings { turnaround: pauses.max().unwrap_or_default(), response_timeout: Some(task.wait) }
        }
    }
}
