//! What the drives of a UNI-TELWAY line have counted on their side of it.

use std::time::Duration;

use drive_bus::{Line, LineConfig, Protocol};
use tokio::time;

use super::summary::Summary;
use drived_words::drive_spec::DriveName;

/// How long the reading of all counters may take.
const LIMIT: Duration = Duration::from_secs(5);

/// Reads the counters of every drive that answers (request A2h), so that they stand in the line's statistics.
pub(super) async fn read_counters(line: &Line, names: &[DriveName], config: &LineConfig) {
    if !matches!(config.protocol, Protocol::UniTelway(_)) {
        return;
    }
    let all = async {
        for name in names {
            // One that does not answer is told by the summary.
            let _ = line.slave(name.slave.number()).unite().link_counters().await;
        }
    };
    let _ = time::timeout(LIMIT, all).await;
}

/// What they have counted, where that is anything.
pub(super) fn told(summary: &Summary) -> impl Iterator<Item = String> {
    summary.drives.iter().filter_map(|(name, stats)| {
        let link = stats.link.filter(|link| *link != Default::default())?;
        Some(format!(
            "{name} has counted: {} not acknowledged and {} refused of what it said, {} not acknowledged and {} refused \
             of what it heard",
            link.sent_not_acknowledged,
            link.sent_refused,
            link.received_not_acknowledged,
            link.received_refused,
        ))
    })
}
