//! The blocks of the monitors: what is read together, within the limit of eight registers.

use drive_core::{
    RawWord, Row,
    registers::{Register, access::Readable},
};

use crate::registers::{INPUT_TERMINALS, LINK, ROWS, SIGNALS};

/// A run of registers: the first and how many.
pub(crate) type Run = (u16, u16);

/// 0020h to 0027h, eight registers: 0025h and 0026h are reserved, and the manual does not say what those answer.
pub(crate) const FAST: Run = (SIGNALS.address(), 8);
/// 0022h to 0028h: 0025h and 0026h are reserved.
pub(crate) const OUTPUT: Run = (LINK.address(), 7);
/// 002Bh to 0031h: 002Eh to 0030h are reserved.
pub(crate) const TERMINALS: Run = (INPUT_TERMINALS.address(), 7);

/// Words as they were read, reserved ones left out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Words(Vec<RawWord>);

impl Words {
    /// `None`: not in this drive.
    pub(crate) fn extend(&mut self, first: u16, values: impl IntoIterator<Item = Option<u16>>) {
        let named = |address| ROWS.iter().find(|row: &&Row| row.address == address);
        let words = (first..).zip(values).filter_map(|(address, value)| {
            named(address).zip(value).map(|(row, value)| RawWord { address, code: row.code, value })
        });
        self.0.extend(words);
    }

    /// The word of a register that one of the blocks holds; `None`: not in this drive.
    pub(crate) fn word(&self, register: Register<impl Readable>) -> Option<u16> {
        self.0.iter().find(|word| word.address == register.address()).map(|word| word.value)
    }

    /// Each address with its word.
    pub(crate) fn pairs(&self) -> Vec<(u16, u16)> {
        self.0.iter().map(|word| (word.address, word.value)).collect()
    }

    pub(crate) fn into_raw(self) -> Vec<RawWord> {
        self.0
    }
}
