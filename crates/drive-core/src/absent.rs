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
    /// Blocks that are refused as such although the drive has each of their registers.
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
        let (mut at, known) = (first, self.missing.len());
        while let Some((from, row)) = self.next(at, first + count) {
            let read = calls.read_words(from, row).await;
            if let Some(read) = self.told(from, row, read)? {
                let behind = words.iter_mut().skip(usize::from(from - first));
                behind.zip(read).for_each(|(word, read)| *word = Some(read));
                at = from + row;
            }
        }
        if self.missing.len() > known {
            // Those between the missing ones are read in rows from now on, unless such a row is refused as well.
            self.singly.retain(|register| !(first..first + count).contains(register));
        }
        Ok(words)
    }

    /// The next request for the registers from `at` up to `end`: its first one and how many; `None`: no other is there. For who
    /// reads by a function of his own, with [`told`](Self::told).
    #[must_use]
    pub fn next(&self, at: u16, end: u16) -> Option<(u16, u16)> {
        let from = (at..end).find(|&register| !self.has(register))?;
        Some((from, self.row(from, 0, end - from)))
    }

    /// What such a request was answered; `None`: one of them is missing, and [`next`](Self::next) tells how to go on.
    ///
    /// # Errors
    /// The answer's, except that of a register that the drive does not have.
    pub fn told(&mut self, first: u16, count: u16, answer: Result<Vec<u16>>) -> Result<Option<Vec<u16>>> {
        match answer {
            Ok(words) => Ok(Some(words)),
            Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, .. }) => {
                if count == 1 {
                    self.missing.insert(first);
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

    /// How many words from `at` on are asked for together; 0: the drive does not have this one.
    fn row(&self, first: u16, at: u16, count: u16) -> u16 {
        if self.has(first + at) {
            return 0;
        }
        if self.singly.contains(&(first + at)) {
            return 1;
        }
        let there = |&more: &u16| !self.has(first + more) && !self.singly.contains(&(first + more));
        (at..count).take_while(there).count() as u16
    }
}
