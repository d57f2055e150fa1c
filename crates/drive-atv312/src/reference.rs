//! Which reference the drive follows: that of the bus, or another one, and which.

use drive_core::{
    Class, Port, Refusal, Result,
    drivecom::{follows_frequency, follows_speed},
};

use crate::{
    Atv312,
    reading::FastWords,
    registers::{AI1C, IOLR, LFRD, LRS3},
    words::{AccessLevel, ExtendedStatus3},
};

/// An analog input below this does not change a reference by a count: 20 mV of 10 V, and 20 µA of 20 mA.
const SILENT: u16 = 20;
/// `SA2`, `SA3`: AI1 to AI3.
const ANALOG_INPUTS: core::ops::RangeInclusive<u16> = 1..=3;

impl<P: Port> Atv312<P> {
    /// Whether the drive follows the frequency of the bus, `LFr`, between the limits.
    pub(crate) async fn follows_frequency(&mut self, words: &FastWords, lfr: u16) -> Result<bool> {
        let limits = self.frequency_limits().await?;
        let asked = self.resolution(Class::Command).await?.frequency(lfr);
        Ok(follows_frequency(words.reference(), asked, limits))
    }

    /// Whether the drive follows the speed of the bus.
    pub(crate) async fn follows_speed(&mut self) -> Result<bool> {
        // LFRD, ETAD, RFRD, FRHD.
        let [lfrd, _, _, frhd] = self.registers.at(Class::Command).read_array(LFRD.address()).await?;
        Ok(follows_speed(frhd, lfrd))
    }

    /// What decides the reference instead of the bus, or would after a start by the bus, as far as settings, inputs and the
    /// drive's own words tell it.
    pub(crate) async fn other_reference(&mut self) -> Result<Option<Refusal>> {
        self.read_settings(Class::Command).await?;
        let held = self.held.unwrap_or(0);
        let mut calls = self.registers.at(Class::Command);
        let settings = &self.known.settings;
        if let Some(reason) = settings.refuses_reference() {
            return Ok(Some(reason));
        }
        if settings.has_presets() {
            let inputs = calls.read(IOLR).await?;
            if let Some(reason) = settings.selected_preset(inputs, held) {
                return Ok(Some(reason));
            }
        }
        let mut second = settings.has_second_reference();
        if settings.level() == Some(AccessLevel::L3) && settings.switches_reference() {
            let selection = ExtendedStatus3::from_bits_retain(calls.read(LRS3).await?);
            second = selection.contains(ExtendedStatus3::REFERENCE_2);
            if let Some(reason) = settings.refuses_channel(second) {
                return Ok(Some(reason));
            }
        }
        // Only to reference 1 is something summed (p. 42).
        if second { Ok(None) } else { self.summed_reference().await }
    }

    async fn summed_reference(&mut self) -> Result<Option<Refusal>> {
        const SUMMED: Refusal = Refusal::Overridden {
            by: "a summing input (SA2, AI2 as the drive leaves the factory, or SA3)",
            remedy: "set SA2 and SA3 to nO",
        };
        let summed = self.known.settings.summed();
        let mut inputs = [0; 3];
        if summed.iter().any(|source| ANALOG_INPUTS.contains(source)) {
            inputs = self.registers.at(Class::Command).read_array(AI1C.address()).await?;
        }
        let adds = |source: &u16| match *source {
            0 => false,
            // What the potentiometer or another bus adds is not told.
            source => source
                .checked_sub(1)
                .and_then(|input| inputs.get(usize::from(input)))
                .is_none_or(|input| input.cast_signed().unsigned_abs() > SILENT),
        };
        Ok(summed.iter().any(adds).then_some(SUMMED))
    }
}
