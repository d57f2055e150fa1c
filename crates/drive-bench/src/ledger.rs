//! A drive whose every answer is told from every other: for each request that it carries out its registers have new
//! contents.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use drive_sim::{Block, Cast, Exception, Model, Observation, Panel, Rules};

/// What a drive has carried out; its maker looks into it beside the line.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ledger {
    address: u8,
    book: Arc<Mutex<Book>>,
}

#[derive(Debug, Default)]
struct Book {
    reads: u64,
    written: BTreeMap<u16, u16>,
}

impl Ledger {
    pub(crate) fn new(address: u8) -> Self {
        Self { address, book: Arc::default() }
    }

    /// How many reads it has carried out.
    pub(crate) fn reads(&self) -> u64 {
        self.book().reads
    }

    /// The last value that was written to a register.
    pub(crate) fn written(&self, register: u16) -> Option<u16> {
        self.book().written.get(&register).copied()
    }

    /// Whether `words` are what one of the reads `since` so many answered from `first` on.
    pub(crate) fn answered(&self, since: u64, first: u16, words: &[u16]) -> bool {
        (since + 1..=self.reads()).any(|read| {
            (first..).zip(words).all(|(register, &word)| word == content(self.address, register, read))
        })
    }

    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The content of a register at one read: a mixture, so that no two answers are alike by accident (the finaliser of
/// MurmurHash3).
fn content(address: u8, register: u16, read: u64) -> u16 {
    let mut mixed = u64::from(address) << 56 ^ u64::from(register) << 40 ^ read;
    for factor in [0xFF51_AFD7_ED55_8CCD, 0xC4CE_B9FE_1A85_EC53] {
        mixed = (mixed ^ mixed >> 33).wrapping_mul(factor);
    }
    (mixed >> 48) as u16
}

impl Model for Ledger {
    fn rules(&self) -> &Rules {
        const RULES: Rules = Rules {
            read_holding: 60,
            read_input: 0,
            write_single: true,
            write_multiple: 60,
            diagnostics: &[],
            event_counter: false,
            broadcast: &[],
            turnaround: Duration::from_millis(5),
        };
        &RULES
    }

    fn check_read(&self, _: Block) -> Result<(), Exception> {
        self.book().reads += 1;
        Ok(())
    }

    fn read(&mut self, register: u16) -> Result<u16, Exception> {
        Ok(content(self.address, register, self.reads()))
    }

    fn write(&mut self, register: u16, value: u16, _: Cast) -> Result<(), Exception> {
        self.book().written.insert(register, value);
        Ok(())
    }

    fn peek(&self, register: u16) -> Option<u16> {
        self.written(register)
    }

    // It is no machine: there is nothing that turns, trips or wears.

    fn poke(&mut self, _: u16, _: u16) -> bool {
        false
    }

    fn advance(&mut self, _: Duration) {}

    fn power(&mut self, _: bool) {}

    fn trip(&mut self, _: u16) {}

    fn set_load(&mut self, _: u16) {}

    fn panel(&mut self, _: Panel) {}

    fn observe(&self) -> Observation {
        Observation::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_told_from_an_older_one_and_from_another_registers() {
        let mut ledger = Ledger::new(7);
        let block = Block { function: 3, first: 100, quantity: 2 };
        let mut read = || {
            ledger.check_read(block).unwrap();
            [ledger.read(100).unwrap(), ledger.read(101).unwrap()]
        };
        let (first, second) = (read(), read());
        assert!(ledger.answered(0, 100, &first) && ledger.answered(1, 100, &second));
        assert!(!ledger.answered(1, 100, &first), "it is older than the call");
        assert!(!ledger.answered(0, 101, &first), "it is another register's");
        assert!(!Ledger::new(8).answered(0, 100, &first), "it is another drive's");
    }
}
