//! A register whose name is resolved: where it stands, and what its words are worth.

use super::Words;
use crate::{
    format::{Byte, Order, Space, UnitName},
    scale::hundredths,
};

/// The most decimals that a register can say another has.
const DECIMALS: u16 = 6;

/// One register of a profile.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    pub(super) at: Single,
    /// Of two words: which is first.
    pub(super) order: Option<Order>,
    pub(super) signed: bool,
    pub(crate) unit: UnitName,
    /// So many of its unit are one count, before the decimals that another register holds.
    pub(super) scale: Option<[i64; 2]>,
    pub(super) decimals: Option<Single>,
}

/// One word, or a byte of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Single {
    pub(super) space: Space,
    pub(super) address: u16,
    pub(super) byte: Option<Byte>,
}

impl Single {
    fn word(self, words: &Words) -> Option<u16> {
        let word = words.at(self.space, self.address)?;
        Some(match self.byte {
            None => word,
            Some(Byte::High) => word >> 8,
            Some(Byte::Low) => word & 0xFF,
        })
    }
}

impl Cell {
    /// The word that counts: a byte of it where it is one. Of two words there is none.
    pub(crate) fn word(&self, words: &Words) -> Option<u16> {
        if self.order.is_some() { None } else { self.at.word(words) }
    }

    /// The number of counts that it holds, of one word or of two.
    pub(crate) fn counts(&self, words: &Words) -> Option<i64> {
        let Some(order) = self.order else {
            let word = self.at.word(words)?;
            return Some(if self.signed { word.cast_signed().into() } else { word.into() });
        };
        let Single { space, address, .. } = self.at;
        let pair = [words.at(space, address)?, words.at(space, address.checked_add(1)?)?];
        let [high, low] = if order == Order::HighFirst { pair } else { [pair[1], pair[0]] };
        let double = u32::from(high) << 16 | u32::from(low);
        Some(if self.signed { double.cast_signed().into() } else { double.into() })
    }

    /// The value in hundredths of a unit, rounded; `None` where it has another unit, or was not read.
    pub(crate) fn hundredths(&self, words: &Words, unit: UnitName) -> Option<i64> {
        let [numerator, denominator] = self.scale(words).filter(|_| self.unit == unit)?;
        Some(hundredths(self.counts(words)?, numerator, denominator))
    }

    /// So many of its unit are one count, as a fraction: also where another register holds how many decimals there are.
    pub(crate) fn scale(&self, words: &Words) -> Option<[i64; 2]> {
        let [numerator, denominator] = self.scale?;
        let Some(decimals) = self.decimals else { return Some([numerator, denominator]) };
        let decimals = decimals.word(words).filter(|decimals| *decimals <= DECIMALS)?;
        Some([numerator, denominator.checked_mul(10_i64.pow(decimals.into()))?])
    }
}
