//! What of a drive's registers a backup keeps, and the order in which a restore writes it: as data, from the manuals.

use super::{
    limits::Limit,
    relations::Relation,
    row::{Row, Storage},
    unit::Unit,
};

/// What a register is to a backup of its drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// A setting: kept, compared and restored.
    Setting,
    /// A setting of the line itself, address, speed or format: kept and compared; whoever writes it cuts the line.
    Communication,
    /// What the drive is, and no setting: its rating, its voltage. Settings are for drives of one rating.
    Rating,
    /// A setting that loads others, and that nobody writes over the bus for this reason: kept and compared; whoever restores sets it
    /// at the drive before.
    ByHand(&'static str),
    /// Kept, and not restored, for this reason.
    Left(&'static str),
    /// No part of a backup: measured values, commands, orders, and other views of a setting.
    Passing,
}

/// What a family's manual says of putting a drive's settings back. What is not named is written one by one in the order of
/// the map, after [`first`](Self::first) and before [`last`](Self::last).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Restoring {
    /// What goes before all other settings, in this order.
    pub first: &'static [Step],
    /// What goes after them, in this order.
    pub last: &'static [Step],
    /// What changes the line itself.
    pub communication: &'static [u16],
    /// What the drive is.
    pub ratings: &'static [u16],
    /// Registers that keep a value and are no part of a backup: other views of settings that have registers of their own, and
    /// a person's code.
    pub unkept: &'static [u16],
    /// Settings that load others, and are only set at the drive, with the reason: they have to be as they were before anything
    /// else is restored, or what is restored would be put back by them.
    pub by_hand: &'static [(u16, &'static str)],
    /// What a register needs before its value acts, where that is more than the write, with the page of the manual: the drive
    /// switched off and on, or reset.
    pub acts_later: &'static [(&'static [u16], &'static str)],
    /// Registers that keep a value and are not restored, with the reason.
    pub left: &'static [(&'static [u16], &'static str)],
    /// What has to hold among values at every moment of the way.
    pub relations: &'static [Relation],
    /// Which values registers take by what others hold, judged whenever one of them is written.
    pub limits: &'static [Limit],
    /// Registers that say who commands, or which reference acts: written last, and not at all behind a setting that was refused, for that one may be
    /// what keeps the motor of whoever commands then within its limits. What stands in one [`Step`] with one of them stays as it is with it.
    pub control: &'static [u16],
}

/// Registers that are written together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Step {
    /// The registers. Where there are several, none may pass the next one, or none can be without the next one: what is
    /// lowered is written in this order, what is raised in the opposite order after it.
    pub registers: &'static [u16],
    /// Why it stands here, with the page of the manual.
    pub why: &'static str,
}

/// Registers whose unit another register chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Scaled {
    /// The registers.
    pub registers: &'static [u16],
    /// The register that chooses.
    pub by: u16,
    /// Which of its bits choose.
    pub mask: u16,
    /// The unit for each of its words, as far as these bits go.
    pub units: &'static [(u16, Unit)],
}

impl Restoring {
    /// A family whose manual says nothing of it.
    pub const NONE: Self = Self {
        first: &[],
        last: &[],
        communication: &[],
        ratings: &[],
        unkept: &[],
        by_hand: &[],
        acts_later: &[],
        left: &[],
        relations: &[],
        limits: &[],
        control: &[],
    };

    /// What a register needs before a written value acts; `None` where the manual asks for nothing.
    #[must_use]
    pub fn acts_later(&self, address: u16) -> Option<&'static str> {
        let later = self.acts_later.iter().find(|(registers, _)| registers.contains(&address));
        later.map(|(_, needs)| *needs)
    }

    /// What a register is to a backup.
    #[must_use]
    pub fn part(&self, row: &Row) -> Part {
        let address = row.address;
        if let Some((_, why)) = self.by_hand.iter().find(|(register, _)| *register == address) {
            return Part::ByHand(why);
        }
        if let Some((_, why)) = self.left.iter().find(|(registers, _)| registers.contains(&address)) {
            return Part::Left(why);
        }
        match row.storage {
            _ if self.ratings.contains(&address) => Part::Rating,
            _ if !(row.access.is_readable() && row.access.is_writable()) => Part::Passing,
            Storage::Volatile => Part::Passing,
            _ if self.unkept.contains(&address) => Part::Passing,
            _ if self.communication.contains(&address) => Part::Communication,
            Storage::RamUntilSaved | Storage::Eeprom | Storage::Unknown => Part::Setting,
        }
    }

    /// The settings in the order in which they are restored, those of one step together; those of the line itself last.
    #[must_use]
    pub fn steps(&self, rows: &'static [Row]) -> Vec<Vec<&'static Row>> {
        let of = |step: &Step| {
            let row = |address: &u16| rows.iter().find(|row| row.address == *address);
            step.registers.iter().filter_map(row).collect::<Vec<_>>()
        };
        let is_named = |row: &Row| {
            let mut steps = self.first.iter().chain(self.last);
            steps.any(|step| step.registers.contains(&row.address))
        };
        let alone = |wanted: Part| {
            let rows = rows.iter().filter(move |row| self.part(row) == wanted && !is_named(row));
            rows.map(|row| vec![row])
        };
        let steps = self.first.iter().map(of).chain(alone(Part::Setting)).chain(self.last.iter().map(of));
        steps.chain(alone(Part::Communication)).filter(|step| !step.is_empty()).collect()
    }

    /// Why a register has its place among the others, where the manual gives it one.
    #[must_use]
    pub fn why(&self, address: u16) -> Option<&'static str> {
        let mut steps = self.first.iter().chain(self.last);
        steps.find(|step| step.registers.contains(&address)).map(|step| step.why)
    }
}

/// A value that a drive holds and the one that it is to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Change {
    /// The register.
    pub row: &'static Row,
    /// The word that it holds.
    pub held: u16,
    /// The word that it is to hold.
    pub wanted: u16,
}

/// The changes of one [`Step`], given in its order, in the order in which they are written: what is lowered as given, then
/// what is raised from the other end, so that none passes its neighbour on the way. What is equal is left out.
#[must_use]
pub fn in_order(changes: &[Change]) -> Vec<Change> {
    let number = |change: &Change, word| change.row.unit.number(word);
    let is_raised = |change: &&Change| number(change, change.wanted) > number(change, change.held);
    let is_lowered = |change: &&Change| number(change, change.wanted) < number(change, change.held);
    let lowered = changes.iter().filter(is_lowered);
    lowered.chain(changes.iter().rev().filter(is_raised)).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    crate::registers! {
        /// Three limits, each not above the next; a voltage; an address.
        pub(crate) const ROWS;

        ADD: WriteStopped(6001, "Add", "address", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "test");
        TFR: WriteStopped(3103, "tFr", "highest", RamUntilSaved, Unit::scaled("Hz", 1), Range::Any, Factory::None, Elsewhere, "test");
        HSP: ReadWrite(3104, "HSP", "high", RamUntilSaved, Unit::scaled("Hz", 1), Range::Any, Factory::None, Elsewhere, "test");
        LSP: ReadWrite(3105, "LSP", "low", RamUntilSaved, Unit::scaled("Hz", 1), Range::Any, Factory::None, Elsewhere, "test");
        CMD: ReadWrite(8501, "CMD", "command", Volatile, Unit::BITS, Range::Any, Factory::None, Elsewhere, "test");
        NCV: Read(3011, "NCV", "rating", Volatile, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "test");
        COD: ReadWrite(3003, "COd", "code", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "test");
        SMIL: ReadWrite(8607, "SMIL", "low, in rpm", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "test");
        ACC: ReadWrite(9001, "ACC", "ramp", RamUntilSaved, Unit::COUNT, Range::Any, Factory::None, Elsewhere, "test");
    }

    const RESTORING: Restoring = Restoring {
        first: &[Step { registers: &[3105, 3104, 3103], why: "test p. 1" }],
        communication: &[6001],
        ratings: &[3011],
        unkept: &[8607],
        by_hand: &[(3052, "it loads a configuration")],
        acts_later: &[(&[6001], "power")],
        left: &[(&[3003], "a code")],
        ..Restoring::NONE
    };

    #[test]
    fn limits_never_pass_each_other_on_the_way_to_any_other_values() {
        let limits = [LSP.row(), HSP.row(), TFR.row()];
        let values = [0, 1, 5, 6, 9];
        let mut triples = Vec::new();
        for low in values {
            for high in values {
                triples.extend(values.map(|highest| [low, high, highest]));
            }
        }
        triples.retain(|[low, high, highest]| low <= high && high <= highest);
        for held in &triples {
            for wanted in &triples {
                let mut now = *held;
                let changes: Vec<Change> =
                    (0..3).map(|i| Change { row: limits[i], held: held[i], wanted: wanted[i] }).collect();
                for change in in_order(&changes) {
                    now[limits.iter().position(|row| *row == change.row).unwrap()] = change.wanted;
                    assert!(now.is_sorted(), "{held:?} to {wanted:?} passes {now:?}");
                }
                assert_eq!(now, *wanted);
            }
        }
    }

    #[test]
    fn what_passes_is_no_part_of_a_backup_and_the_line_itself_comes_last() {
        let part = |row| RESTORING.part(row);
        assert_eq!(
            [CMD.row(), SMIL.row(), NCV.row()].map(part),
            [Part::Passing, Part::Passing, Part::Rating]
        );
        assert_eq!([part(COD.row()), part(ADD.row())], [Part::Left("a code"), Part::Communication]);
        let steps = RESTORING.steps(ROWS);
        let codes: Vec<Vec<_>> = steps.iter().map(|step| step.iter().map(|row| row.code).collect()).collect();
        assert_eq!(codes, [vec!["LSP", "HSP", "tFr"], vec!["ACC"], vec!["Add"]]);
    }
}
