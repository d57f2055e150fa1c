//! Settings that somebody may change at the drive at any time, looked at with the measurements: the highest frequency at which it lets its
//! motor turn, and the time of its communication watchdog.

use drive_core::{Class, Frequency, Ground, Port, Refusal, interned};

use super::{ProfileDrive, Words, plan::Block};
use crate::{
    format::{Access, Answer, FedBy},
    profile::Profile,
};

impl Profile {
    /// The register that holds how fast it may turn.
    fn highest_in(&self) -> Option<&str> {
        let setpoint = self.file().setpoint.given()?.get_ref();
        let name = setpoint.limits.get_ref().high_in.as_ref()?.get_ref();
        (name != "owner").then_some(name)
    }

    /// The register that holds the time of a watchdog that asking may feed.
    pub(super) fn watchdog_time(&self) -> Option<&str> {
        let watchdog = self.file().watchdog.given()?.get_ref();
        let by_asking = watchdog.fed_by != Answer::Given(FedBy::CommandWrite);
        let name = watchdog.time.given().filter(|_| by_asking)?.get_ref();
        self.file().named(name).is_some_and(|of| of.access != Access::Write).then_some(name)
    }

    /// What reads them.
    pub(super) fn settings(&self) -> Vec<Block> {
        self.blocks(&[self.highest_in(), self.watchdog_time()].into_iter().flatten().collect())
    }
}

impl<P: Port> ProfileDrive<P> {
    /// Looks at them. That the drive cannot be asked now says nothing.
    pub(super) async fn see_settings(&mut self) {
        let profile = self.profile.clone();
        let mut words = Words::default();
        for block in profile.settings() {
            let Ok(read) = self.read_block(Class::Background, block).await else { return };
            words.keep(block, read);
        }
        self.see_highest(&profile, &words);
        self.see_watchdog_time(&profile, &words);
    }

    /// Whether the setpoint on which the run command of this side rests is still one that the drive lets its motor reach.
    fn see_highest(&mut self, profile: &Profile, words: &Words) {
        let given = self.watch.run.lease().and(self.agreed).and_then(|agreed| u32::try_from(agreed).ok());
        let given = given.map(Frequency::from_centihertz);
        let highest = profile.highest_in().and_then(|name| {
            let highest = self.frequency(words, profile.cell(name)?)?;
            Some((name, highest))
        });
        self.limited = highest.zip(given).filter(|((_, highest), given)| highest < given).map(
            |((name, highest), given)| {
                Refusal::Settings(interned::text(&format!(
                    "the drive lets its motor turn no faster than {highest} ({name}), and its setpoint is {given}: raise that at the \
                     drive, or give a lower setpoint"
                )))
            },
        );
    }

    /// Whether somebody has set its watchdog otherwise than it was read to be: whoever feeds it has to know. Whether a run command stands
    /// makes nothing of that: the next one would be tripped.
    pub(super) fn see_watchdog_time(&mut self, profile: &Profile, words: &Words) {
        let held =
            profile.watchdog_time().and_then(|name| profile.cell(name)).and_then(|cell| cell.counts(words));
        let Some(held) = held else { return };
        if self.watchdog_time.replace(held).is_some_and(|known| known != held) {
            self.changed = Some(Ground::Watchdog);
        }
    }
}
