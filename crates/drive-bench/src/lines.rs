//! Many lines in one process, each at the full speed of its wire.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::serial::SerialSettings;

use crate::{Error, millis, rig::populated, row, share, usage::memory_kib, utilisation::saturate};

const DRIVES: u8 = 31;

pub(crate) fn measure(time: Duration, lines: u16) -> Result<Vec<String>, Error> {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let settings = SerialSettings::MODBUS_DEFAULT;
    let (simulated, before, after) = runtime.block_on(async {
        let mut simulated = Vec::new();
        let mut streams = Vec::new();
        for _ in 0..lines {
            let line = populated(DRIVES, false)?;
            streams.push(line.in_memory_precise());
            simulated.push(line);
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
        let before = memory_kib()?;
        let config = LineConfig { precise_timer: true, ..LineConfig::stream(settings) };
        let masters: Vec<Line> =
            streams.into_iter().map(|stream| Line::over(stream, config.clone())).collect();
        let polls: Vec<_> = masters
            .iter()
            .map(|line| {
                let line = line.clone();
                tokio::spawn(async move { saturate(&line, DRIVES, time).await })
            })
            .collect();
        tokio::time::sleep(time / 2).await;
        let after = memory_kib()?;
        for poll in polls {
            poll.await??;
        }
        for line in masters {
            line.close().await;
        }
        Ok::<_, Error>((simulated, before, after))
    })?;
    let t3_5 = settings.t3_5();
    let stats: Vec<_> = simulated.iter().map(drive_sim::SimLine::stats).collect();
    let mut used: Vec<u64> = stats.iter().filter_map(|stats| stats.utilisation(t3_5)).collect();
    used.sort_unstable();
    let mean = used.iter().sum::<u64>().checked_div(used.len() as u64).unwrap_or_default();
    let violations: u64 = stats.iter().map(|stats| stats.violations).sum();
    let shortest = stats.iter().filter_map(|stats| stats.shortest_silence).min().unwrap_or_default();
    Ok(vec![
        row(
            format!("{lines} lines in one process, simulators included: utilisation, mean and least"),
            format!("{} and {}", share(mean), share(used.first().copied().unwrap_or_default())),
            "≥ 0.97",
        ),
        row(
            format!("{lines} lines: memory of a line with 31 polls"),
            format!("{} KiB", after.saturating_sub(before) / u64::from(lines.max(1))),
            "≤ 200 KiB",
        ),
        row(
            format!("{lines} lines: silences shorter than {}", millis(t3_5)),
            format!("{violations} (shortest {})", millis(shortest)),
            "0",
        ),
    ])
}
