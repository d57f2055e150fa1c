//! What a drive holds on the way from what it held to what it is to hold, and what its manual wants to hold all the while. Pure.

use std::collections::BTreeMap;

use drive_core::{
    Capabilities, Row,
    registers::{Change, Exceeded, Limit, Place, Relation, Restoring, Space},
};

use crate::{
    output,
    registers::{brief, range},
};

/// The words of a drive between two writes.
#[derive(Debug, Clone)]
pub struct Way {
    capabilities: &'static Capabilities,
    held: BTreeMap<Place, u16>,
}

impl Way {
    pub fn of(capabilities: &'static Capabilities, held: impl Iterator<Item = (Place, u16)>) -> Self {
        Self { capabilities, held: held.collect() }
    }

    pub fn word(&self, place: impl Into<Place>) -> Option<u16> {
        self.held.get(&place.into()).copied()
    }

    pub fn hold(&mut self, place: Place, word: u16) {
        self.held.insert(place, word);
    }

    pub fn forget(&mut self, place: Place) {
        self.held.remove(&place);
    }

    pub const fn restoring(&self) -> &'static Restoring {
        &self.capabilities.restoring
    }

    /// A word as a person reads it, in the unit that it has now.
    pub fn text(&self, row: &Row, word: u16) -> String {
        brief(&self.capabilities.in_units(row, |address| self.word(address)), word)
    }

    /// The registers that have a relation to one of these or limit it, themselves left out.
    pub fn related(&self, addresses: &[u16]) -> Vec<&'static Row> {
        let registers = self.concerned(addresses);
        let is_other = |row: &&Row| registers.contains(&row.address) && !addresses.contains(&row.address);
        self.capabilities.rows.iter().filter(is_other).collect()
    }

    /// All that have to do with one of these: what they have a relation to, and what limits them.
    fn concerned(&self, addresses: &[u16]) -> Vec<u16> {
        let is_ours = |registers: &[u16]| registers.iter().any(|register| addresses.contains(register));
        let Restoring { relations, limits, .. } = self.capabilities.restoring;
        let relations = relations.iter().filter(|relation| is_ours(relation.registers));
        let limits = limits.iter().filter(|limit| is_ours(limit.registers));
        let related = relations.flat_map(|relation| relation.registers).copied();
        related.chain(limits.map(|limit| limit.by)).collect()
    }

    /// What does not hold any more, in words, when a word is written, and did before, or what limits it; `None` where nothing is
    /// broken by it.
    pub fn would_break(&self, Change { row, wanted, .. }: &Change) -> Option<String> {
        let mut then = self.clone();
        then.hold(row.place(), *wanted);
        if let Some(why) = then.exceeds(row) {
            return Some(why);
        }
        let relations = self.capabilities.restoring.relations.iter();
        let mut concerned = relations.filter(|relation| relation.registers.contains(&row.address));
        concerned.find_map(|relation| {
            let broken = then.broken(relation)?;
            (self.broken(relation).as_ref() != Some(&broken)).then(|| then.in_words(relation, &broken))
        })
    }

    /// The registers by which is judged whether these words may be written: none where the manual wants nothing to hold of them.
    pub fn judged_by(&self, writes: &[(&'static Row, u16)]) -> Vec<&'static Row> {
        let rows = || writes.iter().map(|(row, _)| *row).filter(|row| row.space == Space::HoldingRegister);
        let addresses: Vec<u16> = rows().map(|row| row.address).collect();
        let registers = self.concerned(&addresses);
        let is_one = |row: &&Row| {
            row.space == Space::HoldingRegister
                && registers.contains(&row.address)
                && row.access.is_readable()
        };
        self.capabilities.rows.iter().filter(is_one).collect()
    }

    /// Why these words are not written, one after the other, to a drive that holds this: one of them is outside its range, or would
    /// leave it with what its manual forbids. What is not known forbids nothing.
    pub fn refuses(&self, writes: &[(&'static Row, u16)]) -> Option<String> {
        let mut way = self.clone();
        writes.iter().find_map(|&(row, wanted)| {
            if !row.range.allows(row.unit.number(wanted)) {
                let (text, expected) = (way.text(row, wanted), range(row));
                let code = row.code;
                return Some(format!(
                    "{code} {text} is not allowed, expected: {expected}; nothing was written"
                ));
            }
            let held = way.word(row.place()).unwrap_or(wanted);
            let why = way.would_break(&Change { row, held, wanted }).map(|why| {
                let text = way.text(row, wanted);
                format!("{} {text}: the drive would be left with {why}; nothing was written", row.code)
            });
            way.hold(row.place(), wanted);
            why
        })
    }

    /// What does not hold, and these registers have to do with it.
    pub fn breaks(&self, changed: &[u16]) -> Option<String> {
        self.capabilities.restoring.relations.iter().find_map(|relation| {
            let broken = self.broken(relation)?;
            let is_ours = broken.iter().any(|row| changed.contains(&row.address));
            is_ours.then(|| self.in_words(relation, &broken))
        })
    }

    /// Takes the first of these changes that breaks nothing when it is written now. `None`: there is none.
    pub fn take(&self, pending: &mut Vec<Change>) -> Option<Change> {
        let index = pending.iter().position(|change| self.would_break(change).is_none())?;
        Some(pending.remove(index))
    }

    fn broken(&self, relation: &Relation) -> Option<Vec<&'static Row>> {
        relation.broken(self.capabilities.rows, &|address| self.word(address))
    }

    /// Which limit a register does not keep with what it holds here, in words.
    pub fn exceeds(&self, row: &Row) -> Option<String> {
        let word = self.word(row.place()).filter(|_| row.space == Space::HoldingRegister)?;
        let limits = self.capabilities.restoring.limits.iter();
        let mut limits = limits.filter(|limit: &&Limit| limit.registers.contains(&row.address));
        let Exceeded { limit, by, held, span } = limits.find_map(|limit| {
            limit.exceeded(self.capabilities.rows, (row, word), &|address| self.word(address))
        })?;
        let unit = self.capabilities.in_units(row, |address| self.word(address)).unit;
        let span = span.map(|(low, high)| {
            format!(", here {} to {}", output::in_unit(unit, low), output::in_unit(unit, high))
        });
        let (code, text, by_code, by_text) = (row.code, self.text(row, word), by.code, self.text(by, held));
        Some(format!(
            "{code} {text} with {by_code} {by_text} against {}{}",
            limit.why,
            span.unwrap_or_default()
        ))
    }

    fn in_words(&self, relation: &Relation, broken: &[&'static Row]) -> String {
        let holds = broken.iter().filter_map(|row| {
            let word = self.word(row.place())?;
            Some(format!("{} {}", row.code, self.text(row, word)))
        });
        format!("{} against {}", holds.collect::<Vec<_>>().join(" and "), relation.why)
    }
}
