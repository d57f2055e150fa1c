//! What another master's writes ask.

use drive_core::{Class, Intent, Port, Result, Speed};

use crate::{
    Atv312,
    reading::Resolution,
    registers::address::{CMD, CMDD, CMI, FCS, LFR, LFRD, PISP, RP, SCS},
    words::ControlWord,
};

impl<P: Port> Atv312<P> {
    /// BBV51701 p. 12, 16 and 19. References are signed: a negative one turns the direction round and is not understood. What
    /// a count of them is, bit 9 of CMI says.
    pub(crate) async fn asked_by_another(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        match register {
            CMD | CMDD => Intent::understood(ControlWord::from_bits_retain(word).intent()),
            LFR | LFRD => {
                let Ok(count) = u16::try_from(word.cast_signed()) else { return Intent::understood(None) };
                let resolution = self.resolution(Class::Command).await?;
                let setpoint = match (register, resolution) {
                    (LFRD, Resolution::Normal) => Speed::from_rpm(count.into()).into(),
                    _ => resolution.frequency(count).into(),
                };
                Intent::understood(Some(Intent::Setpoint(setpoint)))
            }
            PISP | CMI | SCS | FCS | RP => Intent::kept(),
            _ => Ok(None),
        }
    }
}
