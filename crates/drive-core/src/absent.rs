//! What this very drive has: [`Absent`], the registers of the family that it lacks.

use std::collections::BTreeSet;

use crate::{
    calls::Calls,
    error::{Error, ExceptionMeaning, Result},
    port::Port,
};

/// The registers that a drive has answered to not to have. It is found out at a block's first exception, and kept until the
/// drive may be another one: a register that is missing takes no other along, and is not asked for again.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Absent {
    missing: BTreeSet<u16>,
    /// Registers of blocks that were refused: they are read one by one.
    singly: BTreeSet<u16>,
}

impl Absent {
    /// Whether the drive was found not to have this register.
    #[must_use]
    pub fn has(&self, register: u16) -> bool {
        self.missing.contains(&register)
    }

    /// Reads `count` words from `first` on: in one request, and once one of them is missing each of the others, those that stand
    /// in a row together. `None`: not in this drive.
    ///
    /// # Errors
    /// Those of [`Calls`], except that of a register that the drive does not have.
    pub async fn read<P: Port>(
        &mut self,
        calls: &mut Calls<'_, P>,
        first: u16,
        count: u16,
    ) -> Result<Vec<Option<u16>>> {
        let mut words = vec![None; usize::from(count)];
        let mut at = first;
        while let Some((from, row)) = self.next(at, first + count) {
            let read = calls.read_words(from, row).await;
            if let Some(read) = self.told(from, row, read)? {
                let behind = words.iter_mut().skip(usize::from(from - first));
                behind.zip(read).for_each(|(word, read)| *word = Some(read));
                at = from + row;
            }
        }
        Ok(words)
    }

    /// The next request for the registers from `at` up to `end`: its first one and how many; `None`: no other is there. For who
    /// reads by a function of his own, with [`told`](Self::told).
    #[must_use]
    pub fn next(&self, at: u16, end: u16) -> Option<(u16, u16)> {
        let from = (at..end).find(|&register| !self.has(register))?;
        Some((from, self.row(from, end)))
    }

    /// What such a request was answered; `None`: one of them is missing, and [`next`](Self::next) tells how to go on.
    ///
    /// # Errors
    /// The answer's, except that of a register that the drive does not have.
    pub fn told(&mut self, first: u16, count: u16, answer: Result<Vec<u16>>) -> Result<Option<Vec<u16>>> {
        match answer {
            Ok(words) => {
                if count == 1 {
                    self.was_asked_alone(first);
                }
                Ok(Some(words))
            }
            Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, .. }) => {
                if count == 1 {
                    self.missing.insert(first);
                    self.was_asked_alone(first);
                } else {
                    self.singly.extend(first..first + count);
                }
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    /// Reads one register. `None`: not in this drive.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub async fn word<P: Port>(&mut self, calls: &mut Calls<'_, P>, register: u16) -> Result<Option<u16>> {
        Ok(self.read(calls, register, 1).await?.first().copied().flatten())
    }

    /// The last one of a block that is read word by word ends that, where one was found for which the block was refused: those
    /// between the missing ones are read in rows from then on, unless such a row is refused as well.
    fn was_asked_alone(&mut self, last: u16) {
        let is_singly =
            |register: Option<u16>| register.is_some_and(|register| self.singly.contains(&register));
        if !is_singly(Some(last)) || is_singly(last.checked_add(1)) {
            return;
        }
        let mut first = last;
        while is_singly(first.checked_sub(1)) {
            first -= 1;
        }
        if (first..=last).any(|register| self.has(register)) {
            self.singly.retain(|register| !(first..=last).contains(register));
        }
    }

    /// How many words from `first` on, which is not missing, are asked for together, up to `end`.
    fn row(&self, first: u16, end: u16) -> u16 {
        if self.singly.contains(&first) {
            return 1;
        }
        let there = |register: &u16| !self.has(*register) && !self.singly.contains(register);
        (first..end).take_while(there).count() as u16
    }
}
