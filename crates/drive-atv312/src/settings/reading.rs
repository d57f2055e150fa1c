//! The settings and the control variables on the wire: what is read once, what is read anew, and when.

use drive_core::{Class, Error, ErrorKind, Frequency, Ground, Port, Result, Speed};
use drive_drivecom::{self as drivecom, Limits};

use super::{BLOCKS, Block, FOR_A_STOP, REPLACE_A_REFERENCE, Settings};
use crate::{
    Atv312,
    reading::Resolution,
    registers::{CMD, SMIL, TFR, address},
    words::{AccessLevel, ExtendedControl},
};

impl<P: Port> Atv312<P> {
    /// Bit 9 of `CMI`: one exchange once.
    pub(crate) async fn resolution(&mut self, class: Class) -> Result<Resolution> {
        match self.known.resolution {
            Some(resolution) => Ok(resolution),
            None => Ok(self.read_controls(class).await?.resolution()),
        }
    }

    /// Reads what is not known yet of the settings.
    pub(crate) async fn read_settings(&mut self, class: Class) -> Result<()> {
        while !self.known.settings.is_complete() {
            match self.read_setting(class).await {
                // Of so many readings one may be lost without the drive being so.
                Err(error) if error.kind() == ErrorKind::NoAnswer => self.read_setting(class).await?,
                read => read?,
            }
        }
        Ok(())
    }

    /// The settings, and anew those that say whose the reference is: whoever stands at the drive may have set them otherwise since they
    /// were read, and of a motor that stands no word tells it. Below L3 it is the level itself that may have changed.
    pub(crate) async fn read_references(&mut self, class: Class) -> Result<()> {
        let channels: &[u16] = match self.known.settings.level() {
            Some(AccessLevel::L3) => &[address::RFC, address::FR1],
            _ => &[address::LAC],
        };
        self.read_again(class, &[channels, REPLACE_A_REFERENCE].concat()).await
    }

    /// The settings, and anew those that decide what a command word does. A drive takes them while its motor stands alone, so that what is
    /// read for a start holds for its stop.
    pub(crate) async fn read_meanings(&mut self, class: Class) -> Result<()> {
        let meanings = BLOCKS.iter().take(FOR_A_STOP.1).map(|(first, ..)| *first);
        self.read_again(class, &meanings.collect::<Vec<_>>()).await
    }

    /// The same with what would have the motor turn otherwise than it is asked to, or start again by itself: a start rests on all of it, and
    /// no word of a motor that stands tells that somebody at the keypad has changed it a moment ago.
    pub(crate) async fn read_for_a_start(&mut self, class: Class) -> Result<()> {
        let decide = BLOCKS.iter().map(|(first, ..)| *first).filter(|first| *first != address::ADC);
        self.read_again(class, &decide.collect::<Vec<_>>()).await
    }

    async fn read_again(&mut self, class: Class, blocks: &[u16]) -> Result<()> {
        let before = self.known.settings.selects();
        // Of those that are not all known yet the known ones may be old as well.
        for (index, _) in BLOCKS.iter().enumerate().filter(|(_, (first, ..))| blocks.contains(first)) {
            match self.read_setting_again(class, index).await {
                // Of so many readings one may be lost without the drive being so.
                Err(error) if error.kind() == ErrorKind::NoAnswer => {
                    self.read_setting_again(class, index).await?;
                }
                read => read?,
            }
        }
        if self.known.settings.selects() != before {
            self.known.settings = Settings::default();
        }
        self.read_settings(class).await
    }

    /// Reads one block of the settings, for whoever has time; the drive is asked no more once it has refused one.
    pub(crate) async fn read_a_setting(&mut self, class: Class) {
        if !self.known.settings.refused
            && let Err(Error::Exception { .. }) = self.read_setting(class).await
        {
            self.known.settings.refused = true;
        }
    }

    pub(crate) async fn read_setting(&mut self, class: Class) -> Result<()> {
        let Some((index, block)) = self.known.settings.next_block() else { return Ok(()) };
        let words = self.read_block(class, block).await?;
        let settings = &mut self.known.settings;
        settings.words.extend(words);
        settings.blocks = index + 1;
        Ok(())
    }

    /// Reads a block of the settings that is known already, and remembers what is otherwise.
    pub(crate) async fn read_setting_again(&mut self, class: Class, index: usize) -> Result<()> {
        let settings = &self.known.settings;
        let known = |&&(first, ..): &&Block| settings.at(first).is_some();
        let Some(&block) = BLOCKS.get(index).filter(known) else { return Ok(()) };
        for (address, word) in self.read_block(class, block).await? {
            let known = self.known.settings.words.iter_mut().find(|(at, _)| *at == address);
            if let Some((_, known)) = known.filter(|(_, known)| *known != word) {
                *known = word;
                self.proof.watch.changes(Ground::Inputs);
            }
        }
        Ok(())
    }

    /// The words of a block that this drive has. A function that it does not have is assigned to nothing.
    async fn read_block(&mut self, class: Class, (first, count, _): Block) -> Result<Vec<(u16, u16)>> {
        let words = self.known.absent.read(&mut self.registers.at(class), first, count).await?;
        Ok((first..=u16::MAX).zip(words).filter_map(|(at, word)| Some((at, word?))).collect())
    }

    /// `LSP` to `HSP`, both within `tFr`: the three follow each other, one exchange where they were not read lately.
    pub(crate) async fn frequency_limits(&mut self) -> Result<Limits> {
        match self.proof.fresh_limits().flatten() {
            Some(limits) => Ok(limits),
            None => self.read_frequency_limits(Class::Command).await,
        }
    }

    pub(crate) async fn read_frequency_limits(&mut self, class: Class) -> Result<Limits> {
        let words: [u16; 3] = self.registers.at(class).read_array(TFR.address()).await?;
        let [tfr, hsp, lsp] = words.map(Frequency::from_decihertz);
        let limits = (lsp, hsp.min(tfr));
        if self.proof.take_limits(Some(limits)) {
            // The same limits in rpm.
            self.known.speeds = None;
        }
        Ok(limits)
    }

    /// `SMIL` and `SMAL`, the same limits in rpm: one exchange once.
    pub(crate) async fn speed_limits(&mut self) -> Result<(Speed, Speed)> {
        if let Some(limits) = self.known.speeds {
            return Ok(limits);
        }
        let limits = drivecom::speed_limits(&mut self.registers.at(Class::Command), SMIL).await?;
        self.known.speeds = Some(limits);
        Ok(limits)
    }

    /// `CMD`, `LFr`, `PISP` and `CMI` in one exchange.
    pub(crate) async fn read_controls(&mut self, class: Class) -> Result<Controls> {
        let [command, reference, _, cmi] = self.registers.at(class).read_array(CMD.address()).await?;
        // Of a word that stands as this side wrote it, the bits above are those that it has kept: what else it holds, such as the bit of a
        // stop that has another meaning since, was this side's.
        if self.proof.held() != Some(command) {
            self.hold(command);
        }
        self.proof.was_read(command, reference);
        let controls = Controls { command, reference, cmi: ExtendedControl::from_bits_retain(cmi) };
        self.take_extended(controls.cmi);
        Ok(controls)
    }
}

/// The control variables.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Controls {
    pub(crate) command: u16,
    /// `LFr`.
    pub(crate) reference: u16,
    pub(crate) cmi: ExtendedControl,
}

impl Controls {
    pub(crate) const fn resolution(&self) -> Resolution {
        Resolution::of(self.cmi)
    }
}
