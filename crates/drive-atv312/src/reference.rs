//! Which reference the drive follows: that of the bus, or another one, and which.

use drive_core::{Class, Port, Refusal, Result};
use drive_drivecom::{follows_frequency, follows_speed};

use crate::{
    Atv312,
    facts::{ANALOG_INPUTS, Facts},
    reading::FastWords,
    registers::{AI1C, IOLR, LFRD, LRS1, LRS3},
    words::{AccessLevel, ExtendedStatus1, ExtendedStatus3},
};

impl<P: Port> Atv312<P> {
    /// Whether the drive follows the frequency of the bus, `LFr`, between the limits.
    pub(crate) async fn follows_frequency(&mut self, words: &FastWords, lfr: u16) -> Result<bool> {
        let limits = self.frequency_limits().await?;
        let asked = self.resolution(Class::Command).await?.frequency(lfr);
        Ok(follows_frequency(words.reference(), asked, limits))
    }

    /// The speed of the bus, and whether the drive follows it.
    pub(crate) async fn follows_speed(&mut self) -> Result<(u16, bool)> {
        // LFRD, ETAD, RFRD, FRHD.
        let [lfrd, _, _, frhd] = self.registers.at(Class::Command).read_array(LFRD.address()).await?;
        Ok((lfrd, follows_speed(frhd, lfrd)))
    }

    /// Whether `FrH` may only be late, where it is not the speed of the bus that the drive follows.
    pub(crate) async fn frh_lags(&mut self, words: &FastWords, lfrd: u16) -> Result<bool> {
        let (_, hsp) = self.frequency_limits().await?;
        let speeds = self.speed_limits().await;
        self.proof.frh_lags(words.reference(), lfrd, Some(hsp), speeds)
    }

    /// What decides the reference instead of the bus, or would after a start by the bus, as far as settings, inputs and the
    /// drive's own words tell it.
    pub(crate) async fn other_reference(&mut self) -> Result<Option<Refusal>> {
        self.read_references(Class::Command).await?;
        let held = self.proof.held().unwrap_or(0);
        self.judge_reference(held).await
    }

    /// The same by the settings as they were read last, of a drive that holds this control word.
    pub(crate) async fn judge_reference(&mut self, held: u16) -> Result<Option<Refusal>> {
        let mut calls = self.registers.at(Class::Command);
        let settings = &self.known.settings;
        let mut facts = Facts::default();
        // What the settings say is enough where they say it.
        if let Some(reason) = settings.refuses_reference() {
            return Ok(Some(reason));
        }
        if settings.falls_back() {
            let lrs1 = ExtendedStatus1::from_bits_retain(calls.read(LRS1).await?);
            facts.lost = Some(lrs1.contains(ExtendedStatus1::SIGNAL_LOST));
        }
        if settings.has_presets() {
            facts.inputs = Some(calls.read(IOLR).await?);
        }
        if settings.level() == Some(AccessLevel::L3) && settings.switches_reference() {
            let selection = ExtendedStatus3::from_bits_retain(calls.read(LRS3).await?);
            facts.second = Some(selection.contains(ExtendedStatus3::REFERENCE_2));
        }
        if settings.summed().iter().any(|source| ANALOG_INPUTS.contains(source)) {
            facts.analog = Some(calls.read_array(AI1C.address()).await?);
        }
        Ok(settings.overrides(&facts, held))
    }
}
