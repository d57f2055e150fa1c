//! What another master's writes ask.

use drive_core::{Frequency, Intent, Port, Result};
use drive_drivecom::ControlWord;

use crate::{
    Atv58,
    registers::address::{CMD, W401, W402},
};

impl<P: Port> Atv58<P> {
    /// The words of the chart; of the bits above it none but those that the map names is known.
    pub(crate) async fn asked_by_another(&mut self, register: u16, word: u16) -> Result<Option<Intent>> {
        match register {
            CMD => Intent::understood(ControlWord::from_bits_retain(word).intent()),
            W401 => {
                let count = u32::try_from(word.cast_signed()).ok();
                let per_hertz = u32::from(self.map.reference_counts_per_hertz);
                let centihertz = count.and_then(|count| (count * 100).checked_div(per_hertz));
                Intent::understood(
                    centihertz.map(|value| Intent::Setpoint(Frequency::from_centihertz(value).into())),
                )
            }
            W402 => Intent::kept(),
            _ => Ok(None),
        }
    }
}
