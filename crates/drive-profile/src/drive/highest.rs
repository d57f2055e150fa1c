//! The highest frequency that a drive lets its motor turn at, where a register holds it: looked at again while it runs.

use drive_core::{Class, Frequency, Port, Refusal, interned};

use super::{ProfileDrive, Words, plan::Block};
use crate::profile::Profile;

impl Profile {
    /// The register that holds how fast it may turn.
    fn highest_in(&self) -> Option<&str> {
        let setpoint = self.file().setpoint.given()?.get_ref();
        let name = setpoint.limits.get_ref().high_in.as_ref()?.get_ref();
        (name != "owner").then_some(name)
    }

    /// What reads it.
    pub(super) fn highest(&self) -> Vec<Block> {
        self.highest_in().map(|name| self.blocks(&[name].into())).unwrap_or_default()
    }
}

impl<P: Port> ProfileDrive<P> {
    /// Looks whether the setpoint on which the run command of this side rests is still one that the drive lets its motor reach. That it
    /// cannot be asked now says nothing.
    pub(super) async fn see_highest(&mut self) {
        let profile = self.profile.clone();
        let mut words = Words::default();
        for block in profile.highest() {
            let Ok(read) = self.read_block(Class::Background, block).await else { return };
            words.keep(block, read);
        }
        let given = self.watch.run.lease().and(self.agreed).and_then(|agreed| u32::try_from(agreed).ok());
        let given = given.map(Frequency::from_centihertz);
        let Some((name, given)) = profile.highest_in().zip(given) else {
            self.limited = None;
            return;
        };
        let highest = profile.cell(name).and_then(|cell| self.frequency(&words, cell));
        self.limited = highest.filter(|highest| *highest < given).map(|highest| {
            Refusal::Settings(interned::text(&format!(
                "the drive lets its motor turn no faster than {highest} ({name}), and its setpoint is {given}: raise that at the drive, or \
                 give a lower setpoint"
            )))
        });
    }
}
