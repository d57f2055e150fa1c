//! The run command as it reads back: one word, also of a drive that has a coil or a register for each direction.

use std::collections::BTreeSet;

use crate::{
    format::{Answer, File, Space},
    written::Written,
};

/// The most places of which one word tells: a bit of each.
const MOST: usize = 16;

/// Where the command reads back. Of one register it is what stands there; of a coil for each direction one bit of each, the first
/// lowest; of a register for each direction as many bits as there are for each, all of them where it holds more.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ReadBack {
    cells: Vec<(Space, u16)>,
}

impl ReadBack {
    /// That of a file: the register that it names, and those in which a start runs by another word than the one there.
    pub(crate) fn of(file: &File) -> Option<Self> {
        let named = file.read_back()?;
        let starts = [&file.start.forward, &file.start.reverse].into_iter().filter_map(Answer::given);
        let runs = starts.map(|start| {
            let last = start.get_ref().steps.last();
            let written = last.map(|step| file.written(step.get_ref(), None)).unwrap_or_default();
            let runs = written.into_iter().filter(|written| file.runs(*written));
            runs.map(|written| (written.space, written.address)).collect::<BTreeSet<_>>()
        });
        let runs: Vec<BTreeSet<_>> = runs.filter(|runs| !runs.is_empty()).collect();
        let is_split =
            runs.iter().any(|of| of.contains(&named)) && !runs.iter().all(|of| of.contains(&named));
        let all = runs.into_iter().flatten().filter(|(space, _)| is_split && *space == named.0);
        let cells: BTreeSet<_> = all.chain([named]).collect();
        Some(Self { cells: cells.into_iter().take(MOST).collect() })
    }

    /// The places, in their order.
    pub(crate) fn cells(&self) -> &[(Space, u16)] {
        &self.cells
    }

    /// Whether one place alone does not tell a run command from none.
    pub(crate) fn is_split(&self) -> bool {
        self.cells.len() > 1
    }

    /// The most that one place may hold and be told.
    pub(crate) fn most(&self) -> u16 {
        u16::MAX >> (u16::BITS - self.width())
    }

    /// How many bits of the word are each place's.
    fn width(&self) -> u32 {
        match self.cells[..] {
            [_] => u16::BITS,
            [(space, _), ..] if space.is_bit() => 1,
            _ => u32::try_from(self.cells.len()).map_or(1, |count| (u16::BITS / count.max(1)).max(1)),
        }
    }

    /// Each place, and by how many bits its own are shifted.
    fn shifted(&self) -> impl Iterator<Item = ((Space, u16), u32)> {
        let width = self.width();
        self.cells.iter().copied().zip((0..).map(move |index| index * width))
    }

    /// The word of what stands at its places; `None`: one of them was not read.
    pub(crate) fn word(&self, at: impl Fn(Space, u16) -> Option<u16>) -> Option<u16> {
        self.shifted().try_fold(0, |word, ((space, address), shift)| {
            Some(word | at(space, address)?.min(self.most()) << shift)
        })
    }

    /// The word that stands once this was written, where another stood before; `None`: this says nothing of it.
    pub(crate) fn written(&self, before: u16, writes: &[Written]) -> Option<u16> {
        let last = |space, address| {
            let written = writes.iter().rev().find(|of| (of.space, of.address) == (space, address));
            written.map(|of| of.value)
        };
        let is_its = self.cells.iter().any(|&(space, address)| last(space, address).is_some());
        let held = |space, address| self.held(before).find(|of| (of.space, of.address) == (space, address));
        is_its
            .then(|| {
                self.word(|space, address| last(space, address).or_else(|| Some(held(space, address)?.value)))
            })
            .flatten()
    }

    /// What a word says that its places hold.
    fn held(&self, word: u16) -> impl Iterator<Item = Written> {
        let most = self.most();
        let held = move |((space, address), shift)| Written { space, address, value: word >> shift & most };
        self.shifted().map(held)
    }

    /// Whether a word runs the motor.
    pub(crate) fn runs(&self, file: &File, word: u16) -> bool {
        self.held(word).any(|written| file.runs(written))
    }
}
