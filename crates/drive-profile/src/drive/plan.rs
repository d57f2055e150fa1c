//! What a profile comes to once its names are resolved: which registers are read together, and what their words are worth.

use std::collections::BTreeSet;

use crate::format::Spanned;

use super::cell::{Cell, Single};
use crate::{
    format::{Access, Answer, Bits, Register, Space, UnitName},
    profile::Profile,
    read_back::ReadBack,
};

/// Registers that one exchange reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) space: Space,
    pub(crate) first: u16,
    pub(crate) count: u16,
}

/// What was read, in the order in which it was: a few words, looked through from the last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Words(Vec<((Space, u16), u16)>);

impl Words {
    /// Keeps what a block was read to hold.
    pub(crate) fn keep(&mut self, block: Block, words: impl IntoIterator<Item = u16>) {
        let places = (0_u16..).map(|at| (block.space, block.first.saturating_add(at)));
        self.0.extend(places.zip(words));
    }

    pub(crate) fn at(&self, space: Space, address: u16) -> Option<u16> {
        self.0.iter().rev().find(|(place, _)| *place == (space, address)).map(|(_, word)| *word)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (Space, u16, u16)> {
        self.0.iter().map(|&((space, address), word)| (space, address, word))
    }
}

impl Profile {
    /// The words of a register as they stand on the wire.
    fn place_of(&self, name: &str) -> Option<(&Register, Space, u16)> {
        let register = self.file.named(name)?;
        let (space, address) = self.file.place(register)?;
        Some((register, space, address))
    }

    /// A register by its name, resolved.
    pub(crate) fn cell(&self, name: &str) -> Option<Cell> {
        let (register, space, address) = self.place_of(name)?;
        let decimals = register.decimals_in.as_ref().map(|of| self.place_of(of.get_ref()));
        // What says how many decimals there are is one word, or nobody knows what a count is worth.
        let decimals = decimals.map(|of| of.filter(|(register, ..)| !is_double(register)));
        // Whose decimals another register tells counts whole ones of its unit before them.
        let whole = register.decimals_in.is_some().then_some([1, 1]);
        let scale = register.scale.as_ref().map(|scale| *scale.get_ref()).or(whole);
        Some(Cell {
            at: Single { space, address, byte: register.byte },
            order: register.order.filter(|_| is_double(register)),
            signed: register.signed,
            unit: register.unit,
            scale: scale.filter(|_| !matches!(decimals, Some(None))),
            decimals: decimals.flatten().map(|(of, space, address)| Single { space, address, byte: of.byte }),
        })
    }

    /// The word that counts of a register: a byte of it where it is one. Of two words there is none.
    pub(crate) fn word(&self, words: &Words, name: &str) -> Option<u16> {
        self.cell(name)?.word(words)
    }

    /// Whether bits fit; `None`: they were not read.
    pub(crate) fn fits(&self, words: &Words, bits: &Bits) -> Option<bool> {
        self.word(words, bits.register.get_ref()).map(|word| bits.fit(word))
    }

    /// What a status reads.
    pub(crate) fn fast(&self) -> Vec<Block> {
        let file = &self.file;
        let mut names: BTreeSet<&str> = BTreeSet::new();
        names.extend(file.state.is.iter().map(|is| name(&is.get_ref().bits.get_ref().register)));
        let see = &file.see;
        names.extend([&see.output, &see.setpoint, &see.current].into_iter().filter_map(given));
        names.extend(see.direction.given().map(|direction| name(&direction.get_ref().register)));
        let told =
            [&see.at_setpoint, &see.warning, &file.state.standstill].into_iter().filter_map(Answer::given);
        names.extend(told.map(|bits| name(&bits.get_ref().register)));
        let owners =
            [&file.ownership.command, &file.ownership.reference].into_iter().filter_map(Answer::given);
        names.extend(owners.map(|owner| name(&owner.get_ref().bits.register)));
        let mut blocks = self.blocks(&names);
        // Read along where it costs no exchange; else the command in its turn, and the code once there is a fault.
        for also in [self.reads_back(), given(&file.faults.present).into_iter().collect()] {
            let all: BTreeSet<&str> = names.iter().copied().chain(also).collect();
            let with = self.blocks(&all);
            if with.len() == blocks.len() {
                (names, blocks) = (all, with);
            }
        }
        blocks
    }

    /// What reads the code of the present fault, where a status does not.
    pub(crate) fn code(&self) -> Option<Block> {
        self.apart(given(&self.file.faults.present).into_iter().collect()).first().copied()
    }

    /// What reads the command back, where a status does not.
    pub(crate) fn command(&self) -> Vec<Block> {
        self.apart(self.reads_back())
    }

    /// The registers in which the command reads back.
    fn reads_back(&self) -> BTreeSet<&str> {
        let Some(read_back) = ReadBack::of(&self.file) else { return BTreeSet::new() };
        let is_its = |register: &Register| {
            self.file.place(register).is_some_and(|place| read_back.cells().contains(&place))
        };
        let all = self.file.register.iter().filter(|(_, register)| is_its(register.get_ref()));
        all.map(|(name, _)| name.as_str()).collect()
    }

    /// What reads registers that no status reads.
    fn apart(&self, names: BTreeSet<&str>) -> Vec<Block> {
        let fast = self.fast();
        let is_read = |name: &&str| {
            let holds = |(_, space, address): (&Register, Space, u16)| {
                let at = |block: &Block| address.checked_sub(block.first).filter(|_| block.space == space);
                fast.iter().any(|block| at(block).is_some_and(|at| at < block.count))
            };
            self.place_of(name).is_none_or(holds)
        };
        self.blocks(&names.into_iter().filter(|name| !is_read(name)).collect())
    }

    /// The register that a write by function 23 reads along: the first that tells the state.
    pub(crate) fn read_along(&self) -> Option<u16> {
        let names = self.file.state.is.iter().map(|is| name(&is.get_ref().bits.get_ref().register));
        let mut places = names.filter_map(|name| self.place_of(name));
        places.find(|(_, space, _)| *space == Space::HoldingRegister).map(|(.., address)| address)
    }

    /// What only the measurements read; where there is nothing, what a status does.
    pub(crate) fn slow(&self) -> Vec<Block> {
        let see = &self.file.see;
        let names = [&see.speed, &see.output_voltage, &see.dc_bus_voltage, &see.setpoint]
            .into_iter()
            .filter_map(given);
        let blocks = self.blocks(&names.collect());
        if blocks.is_empty() { self.fast().into_iter().take(1).collect() } else { blocks }
    }

    /// What reads the guards and fingerprints, and what 100 % is, which its owner may have said as well.
    pub(crate) fn guards(&self) -> Vec<Block> {
        let who = &self.file.who;
        let all = [&who.fingerprints, &who.guards].into_iter().filter_map(Answer::given).flatten();
        let names = all.map(|guard| name(&guard.get_ref().register));
        self.blocks(&names.chain(self.file.full_scale()).collect())
    }

    /// The exchanges that read these registers: those that stand in a row in one, where the drive lets them be read so.
    pub(crate) fn blocks(&self, names: &BTreeSet<&str>) -> Vec<Block> {
        let link = self.file.link.get_ref();
        let registers = || names.iter().filter_map(|name| self.file.named(name));
        let decimals = registers().filter_map(|register| register.decimals_in.as_ref()).map(name);
        // Without what 100 % is a percentage is no frequency.
        let is_share = registers().any(|register| register.unit == UnitName::Percent);
        let full_scale = self.file.full_scale().filter(|_| is_share);
        let all = names.iter().copied().chain(decimals).chain(full_scale);
        let all = all.filter_map(|name| self.place_of(name));
        let mut singles: Vec<(Space, u16)> = Vec::new();
        // The second of two words, which stands for nothing without the first.
        let mut seconds: BTreeSet<(Space, u16)> = BTreeSet::new();
        for (register, space, address) in all.filter(|(register, ..)| register.access != Access::Write) {
            singles.push((space, address));
            if let Some(second) = address.checked_add(1).filter(|_| is_double(register)) {
                singles.push((space, second));
                seconds.insert((space, second));
            }
        }
        singles.sort_unstable();
        singles.dedup();
        let most = |space: Space| {
            let limit = if space.is_bit() { &link.read_coils } else { &link.read_words };
            limit.given().copied().unwrap_or(1)
        };
        let across = link.reads_across.given() == Some(&true);
        let mut blocks: Vec<Block> = Vec::new();
        for (space, first) in singles {
            let joins = |last: &Block| {
                let count = first.checked_sub(last.first)?.checked_add(1)?;
                let next = last.first.saturating_add(last.count);
                let is_next = first == next && (across || seconds.contains(&(space, first)));
                // What lies between is read along, where the file names it and the drive lets it be read.
                let bridges = across && (next..first).all(|between| self.is_readable(space, between));
                (last.space == space && count <= most(space) && (is_next || bridges)).then_some(count)
            };
            match blocks.last().and_then(joins).zip(blocks.last_mut()) {
                Some((count, last)) => last.count = count,
                None => blocks.push(Block { space, first, count: 1 }),
            }
        }
        blocks
    }

    /// Whether the file names a register of one word there that can be read.
    fn is_readable(&self, space: Space, address: u16) -> bool {
        let is_it = |register: &Register| {
            self.file.place(register) == Some((space, address))
                && register.access != Access::Write
                && !is_double(register)
        };
        self.file.register.values().any(|register| is_it(register.get_ref()))
    }
}

pub(crate) fn is_double(register: &Register) -> bool {
    register.words.as_ref().is_some_and(|words| *words.get_ref() == 2)
}

fn name(name: &Spanned<String>) -> &str {
    name.get_ref()
}

fn given(answer: &Answer<Spanned<String>>) -> Option<&str> {
    answer.given().map(name)
}
