//! A motor that the STOP key of its drive has stopped, as a fact: [`StopKey`]. It has no clock of its own.

use std::fmt;

use drive_core::StatusBit;
use drive_fleet::Snapshot;
use serde::Serialize;

/// The drive says that its STOP key has stopped the motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(crate) struct Pressed {
    /// The word that says so.
    word: u16,
    /// Where the manual says what it means.
    manual: &'static str,
}

impl fmt::Display for Pressed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("stopped by the STOP key of the drive")
    }
}

/// Follows what one drive says of its STOP key.
#[derive(Debug, Default)]
pub(crate) struct StopKey {
    was: Option<bool>,
}

impl StopKey {
    /// Looks at what is known of the drive now; gives what is to be told, once for each time that the key stops the motor. What stood when
    /// the drive was seen first tells of no moment.
    pub(crate) fn look(&mut self, says: Option<StatusBit>, snapshot: &Snapshot) -> Option<Pressed> {
        let status = snapshot.status.as_ref().filter(|_| !snapshot.retracted)?;
        let bit = says?;
        let is = bit.is_set(&status.value)?;
        let was = self.was.replace(is);
        let word = status.value.raw(bit.address)?;
        (is && was == Some(false)).then_some(Pressed { word, manual: bit.source })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use drive_core::RawWord;
    use drived_plant::plant::testing::TestPlant;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_stop_key_is_told_when_the_drive_says_so_and_not_as_long_as_it_does() {
        let test = TestPlant::of(1).await;
        let drive = test.plant.fleet().drive("pump 1").unwrap();
        let seen = drive.snapshot();
        // BBV51701 p. 21: bit 14 of ETA, W3201.
        let shown = |eta: u16| {
            let mut seen = Snapshot::clone(&seen);
            let status = Arc::make_mut(&mut seen.status.as_mut().unwrap().value);
            status.raw = vec![RawWord { address: 3201, code: "ETA", value: eta }];
            seen
        };
        let mut key = StopKey::default();
        let mut told = |eta: u16| {
            key.look(drive.capabilities().stop_key, &shown(eta)).map(|pressed| pressed.to_string())
        };
        let text = Some("stopped by the STOP key of the drive".to_owned());
        assert_eq!([told(0x4427), told(0x0027)], [None, None], "it was found so");
        assert_eq!([told(0x4427), told(0x4427)], [text.clone(), None]);
        assert_eq!([told(0x0240), told(0x4240)], [None, text]);
    }
}
