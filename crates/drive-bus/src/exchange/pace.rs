//! Time as a proof: what comes sooner than a line can carry it is no answer.

use std::time::Duration;

use drive_core::serial::SerialSettings;
use tokio::time::Instant;

/// By how much the two ends' clocks may differ: each by 1 % as delivered, and as much again.
const TOLERANCE_PERCENT: u32 = 3;

/// How soon an answer can come. A far end that takes no time for its characters can answer at once.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    serial: SerialSettings,
    paces: bool,
    /// The last request: when its last bit was sent, and how many characters it has.
    request: Option<(Instant, usize)>,
}

impl Pace {
    pub(super) const fn new(serial: SerialSettings) -> Self {
        Self { serial, paces: true, request: None }
    }

    pub(super) const fn set_far_end_paces(&mut self, paces: bool) {
        self.paces = paces;
    }

    /// Whether time proves anything here.
    pub(super) const fn proves(&self) -> bool {
        self.paces
    }

    /// A request of so many characters is off the line at `end`.
    pub(super) const fn sent(&mut self, end: Instant, characters: usize) {
        self.request = Some((end, characters));
    }

    /// Another request is to be sent; nothing that comes before it answers it.
    pub(super) const fn forget(&mut self) {
        self.request = None;
    }

    /// Whether an answer of so many characters that is there at `now` came too soon to be one. With 0 characters: whether
    /// it is too soon for any character of it.
    pub(super) fn is_early(&self, now: Instant, characters: usize) -> bool {
        let Some((end, request)) = self.request.filter(|_| self.paces) else { return false };
        let tolerance = self.serial.characters(request + characters) * TOLERANCE_PERCENT / 100
            + self.serial.characters(1);
        now + tolerance < end + self.characters(characters)
    }

    fn characters(&self, characters: usize) -> Duration {
        self.serial.characters(characters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_early_until_the_line_can_have_carried_it() {
        let serial = SerialSettings::MODBUS_DEFAULT;
        let mut pace = Pace::new(serial);
        let end = Instant::now() + Duration::from_secs(1);
        assert!(!pace.is_early(end, 7), "nothing was sent");
        pace.sent(end, 8);
        assert!(pace.is_early(end - serial.characters(2), 0));
        assert!(!pace.is_early(end - serial.characters(1), 0), "one character of tolerance");
        assert!(pace.is_early(end + serial.characters(5), 7));
        assert!(!pace.is_early(end + serial.characters(6), 7));
        pace.set_far_end_paces(false);
        assert!(!pace.is_early(end - serial.characters(2), 7));
    }
}
