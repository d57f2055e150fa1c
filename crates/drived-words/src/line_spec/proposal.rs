//! What a line's far end was seen to be like, as the setting that says it.

use drive_bus::{Gateway, LineConfig, Stats, stats::WaitIs};

/// What the far end was seen to be like where the line is not set so, with the setting that says it.
pub fn proposal(config: &LineConfig, stats: &Stats) -> Option<String> {
    if config.far_end_paces != Some(false) && stats.is_faster_than_configured() {
        return Some(format!(
            "every answer came sooner than {} can carry it, and none was taken: an adapter without a UART or a program is faster than \
             a line, say far-end-paces=no; or the speed is set too low",
            config.serial
        ));
    }
    let seen = stats.far_end.filter(|seen| seen.wait_is == WaitIs::Seen && config.gateway.is_none())?;
    let wait = std::time::Duration::from_millis(
        u64::try_from(seen.wait.as_millis().div_ceil(100)).unwrap_or(u64::MAX) * 100,
    );
    let gateway = Gateway { at_once: Some(seen.at_once), wait: Some(wait) };
    Some(format!(
        "a gateway was seen to wait {wait:?} for a drive that does not answer, and to serve {} at once: say gateway={gateway}",
        if seen.at_once == 1 { "one request".to_owned() } else { format!("{} requests", seen.at_once) }
    ))
}
