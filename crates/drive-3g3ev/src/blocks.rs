//! The blocks of the monitors: what is read together, within the limit of eight registers.

use drive_core::{
    RawWord, Row,
    registers::{Register, access::Readable},
};

use crate::registers::{CURRENT, DC_BUS, INPUT_TERMINALS, LINK, ROWS, SIGNALS};

/// A run of registers: the first and how many.
pub(crate) type Run = (u16, u16);

/// Registers that are read in one exchange, and the runs that they fall into when the reserved ones between them
/// cannot be read along: the manual does not say what those answer.
pub(crate) struct Block {
    pub(crate) whole: Run,
    pub(crate) parts: [Run; 2],
}

/// 0020h to 0027h, eight registers: 0025h and 0026h are reserved.
pub(crate) const FAST: Block =
    Block { whole: (SIGNALS.address(), 8), parts: [(SIGNALS.address(), 5), (CURRENT.address(), 1)] };
/// 0022h to 0028h: 0025h and 0026h are reserved.
pub(crate) const OUTPUT: Block =
    Block { whole: (LINK.address(), 7), parts: [(LINK.address(), 3), (CURRENT.address(), 2)] };
/// 002Bh to 0031h: 002Eh to 0030h are reserved.
pub(crate) const TERMINALS: Block = Block {
    whole: (INPUT_TERMINALS.address(), 7),
    parts: [(INPUT_TERMINALS.address(), 3), (DC_BUS.address(), 1)],
};

/// Words as they were read, reserved ones left out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Words(Vec<RawWord>);

impl Words {
    pub(crate) fn extend(&mut self, first: u16, values: &[u16]) {
        let named = |address| ROWS.iter().find(|row: &&Row| row.address == address);
        let words = (first..).zip(values).filter_map(|(address, &value)| {
            named(address).map(|row| RawWord { address, code: row.code, value })
        });
        self.0.extend(words);
    }

    /// The word of a register that one of the blocks holds.
    pub(crate) fn word(&self, register: Register<impl Readable>) -> u16 {
        let found = self.0.iter().find(|word| word.address == register.address());
        found.map_or(0, |word| word.value)
    }

    /// Each address with its word.
    pub(crate) fn pairs(&self) -> Vec<(u16, u16)> {
        self.0.iter().map(|word| (word.address, word.value)).collect()
    }

    pub(crate) fn into_raw(self) -> Vec<RawWord> {
        self.0
    }
}
