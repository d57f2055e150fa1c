//! What a drive holds on the way from what it held to what it is to hold, and what its manual wants to hold all the while. Pure.

use std::collections::BTreeMap;

use drive_core::{
    Capabilities, Row,
    registers::{Change, Place, Relation, Restoring},
};

use drived_words::registers::brief;

/// The words of a drive between two writes.
#[derive(Debug, Clone)]
pub(in crate::commands::param) struct Way {
    capabilities: &'static Capabilities,
    held: BTreeMap<Place, u16>,
}

impl Way {
    pub(in crate::commands::param) fn of(
        capabilities: &'static Capabilities,
        held: impl Iterator<Item = (Place, u16)>,
    ) -> Self {
        Self { capabilities, held: held.collect() }
    }

    pub(in crate::commands::param) fn word(&self, place: impl Into<Place>) -> Option<u16> {
        self.held.get(&place.into()).copied()
    }

    pub(in crate::commands::param) fn hold(&mut self, place: Place, word: u16) {
        self.held.insert(place, word);
    }

    pub(super) fn forget(&mut self, place: Place) {
        self.held.remove(&place);
    }

    pub(super) const fn restoring(&self) -> &'static Restoring {
        &self.capabilities.restoring
    }

    /// A word as a person reads it, in the unit that it has now.
    pub(in crate::commands::param) fn text(&self, row: &Row, word: u16) -> String {
        brief(&self.capabilities.in_units(row, |address| self.word(address)), word)
    }

    /// The registers that have a relation to one of these, themselves left out.
    pub(in crate::commands::param) fn related(&self, addresses: &[u16]) -> Vec<&'static Row> {
        let relations = self.capabilities.restoring.relations.iter();
        let relations = relations
            .filter(|relation| relation.registers.iter().any(|register| addresses.contains(register)));
        let registers: Vec<u16> = relations.flat_map(|relation| relation.registers).copied().collect();
        let is_other = |row: &&Row| registers.contains(&row.address) && !addresses.contains(&row.address);
        self.capabilities.rows.iter().filter(is_other).collect()
    }

    /// What does not hold any more, in words, when a word is written, and did before; `None` where nothing is broken by it.
    pub(in crate::commands::param) fn would_break(
        &self,
        Change { row, wanted, .. }: &Change,
    ) -> Option<String> {
        let mut then = self.clone();
        then.hold(row.place(), *wanted);
        let relations = self.capabilities.restoring.relations.iter();
        let mut concerned = relations.filter(|relation| relation.registers.contains(&row.address));
        concerned.find_map(|relation| {
            let broken = then.broken(relation)?;
            (self.broken(relation).as_ref() != Some(&broken)).then(|| then.in_words(relation, &broken))
        })
    }

    /// What does not hold, and these registers have to do with it.
    pub(super) fn breaks(&self, changed: &[u16]) -> Option<String> {
        self.capabilities.restoring.relations.iter().find_map(|relation| {
            let broken = self.broken(relation)?;
            let is_ours = broken.iter().any(|row| changed.contains(&row.address));
            is_ours.then(|| self.in_words(relation, &broken))
        })
    }

    /// Takes the first of these changes that breaks nothing when it is written now. `None`: there is none.
    pub(super) fn take(&self, pending: &mut Vec<Change>) -> Option<Change> {
        let index = pending.iter().position(|change| self.would_break(change).is_none())?;
        Some(pending.remove(index))
    }

    fn broken(&self, relation: &Relation) -> Option<Vec<&'static Row>> {
        relation.broken(self.capabilities.rows, &|address| self.word(address))
    }

    fn in_words(&self, relation: &Relation, broken: &[&'static Row]) -> String {
        let holds = broken.iter().filter_map(|row| {
            let word = self.word(row.place())?;
            Some(format!("{} {}", row.code, self.text(row, word)))
        });
        format!("{} against {}", holds.collect::<Vec<_>>().join(" and "), relation.why)
    }
}
