//! What this very drive has: [`Absent`], the registers of the family that it lacks.

use std::collections::BTreeSet;

use crate::{
    access::Calls,
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
        let mut at = 0;
        while at < count {
            let row = self.row(first, at, count);
            if row == 0 {
                at += 1;
                continue;
            }
            match calls.read_words(first + at, row).await {
                Ok(read) => {
                    for (word, read) in words.iter_mut().skip(usize::from(at)).zip(read) {
                        *word = Some(read);
                    }
                    at += row;
                }
                Err(Error::Exception { meaning: ExceptionMeaning::NoSuchRegister, .. }) => {
                    if row == 1 {
                        self.missing.insert(first + at);
                    } else {
                        self.singly.extend(first + at..first + at + row);
                    }
                }
                Err(error) => return Err(error),
            }
        }
        Ok(words)
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
