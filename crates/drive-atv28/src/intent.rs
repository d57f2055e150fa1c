//! What another master's writes ask.

use drive_core::{Frequency, Intent, Port, Result, Speed};

use crate::{
    Atv28,
    registers::address::{CMD, CMDD, CMI, LFR, LFRD, RPI},
    words::ControlWord,
};

impl<P: Port> Atv28<P> {
    /// The words of the twin, BBV51701 p. 12, 16 and 19. References are signed: a negative one turns the direction round and
    /// is not understood.
    pub(crate) async fn asked_by_another(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        let count = u16::try_from(word.cast_signed()).ok();
        match register {
            CMD | CMDD => Intent::understood(ControlWord::from_bits_retain(word).intent()),
            LFR => Intent::understood(
                count.map(|count| Intent::Setpoint(Frequency::from_decihertz(count).into())),
            ),
            LFRD => {
                Intent::understood(count.map(|count| Intent::Setpoint(Speed::from_rpm(count.into()).into())))
            }
            CMI | RPI => Intent::kept(),
            _ => Ok(None),
        }
    }
}
