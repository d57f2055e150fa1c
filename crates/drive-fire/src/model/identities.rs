//! Who is who, explored to the end: drives are added, taken out, renamed, moved, exchanged and numbered in a configuration that is taken up
//! after each step, with restarts in between. A SCADA reads by number and a broker by topic, so that a number that goes to another drive
//! starts another motor.

use std::collections::{BTreeMap, BTreeSet};

use drived_config::names::{Configured, Known, Named, Table, Told, topic_id};

use super::{Held, Model, names};

/// As it is explored.
pub(crate) const MODEL: Model = Model {
    name: "identities",
    part: "model of identities",
    against_plants: "model of identities, against planted defects",
    settings: &["Drives"],
    steps: || names(&Step::ALL),
    lives: |_, steps, defect| {
        let mut world = World { defect: defect.map(|defect| DEFECTS[defect]), ..World::default() };
        steps.iter().try_for_each(|step| world.take(Step::ALL[*step]))
    },
    defects: || names(&DEFECTS),
    lines: false,
};

/// Three drives; the first two have one name in the letters of a topic.
const DRIVES: [(&str, &str); 3] = [("fan 1", "a 1"), ("fan_1", "a 2"), ("pump", "b 1")];

/// One step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// One of the three drives that is not configured is added at the end.
    Add,
    /// The one after it.
    AddAnother,
    /// The first is taken out.
    TakeOutFirst,
    /// The last is taken out.
    TakeOutLast,
    /// The first is called otherwise, in its place.
    Rename,
    /// The last has the name that one has had that is gone, in its own place.
    RenameToOneThatIsGone,
    /// The first two exchange their names.
    ExchangeNames,
    /// The first goes to another place.
    Move,
    /// The configuration is written in another order.
    Reverse,
    /// The configuration gives the last the number 1.
    Number,
    /// Somebody forgets one that is gone.
    Forget,
    /// The program is started again, with what it has kept.
    Restart,
}

impl Step {
    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::Add,
        Self::AddAnother,
        Self::TakeOutFirst,
        Self::TakeOutLast,
        Self::Rename,
        Self::RenameToOneThatIsGone,
        Self::ExchangeNames,
        Self::Move,
        Self::Reverse,
        Self::Number,
        Self::Forget,
        Self::Restart,
    ];
}

/// A wrong way of keeping who is who.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Defect {
    RenamedIsNew,
    GoneIsForgotten,
    NumbersByOrder,
    NumberOfOneThatIsGoneIsFree,
    TopicByName,
    IdByName,
    PlaceBeforeName,
    ComesBackAsAnother,
    RestartNumbersAnew,
    ConfiguredNumberIsTakenAway,
    ChangesUntold,
    GoneIsShown,
}

const DEFECTS: [Defect; 12] = [
    Defect::RenamedIsNew,
    Defect::GoneIsForgotten,
    Defect::NumbersByOrder,
    Defect::NumberOfOneThatIsGoneIsFree,
    Defect::TopicByName,
    Defect::IdByName,
    Defect::PlaceBeforeName,
    Defect::ComesBackAsAnother,
    Defect::RestartNumbersAnew,
    Defect::ConfiguredNumberIsTakenAway,
    Defect::ChangesUntold,
    Defect::GoneIsShown,
];

#[derive(Default)]
struct World {
    table: Table,
    defect: Option<Defect>,
    there: Vec<Named>,
    renamed: u8,
    moved: u8,
}

impl World {
    fn has(&self, defect: Defect) -> bool {
        self.defect == Some(defect)
    }

    fn take(&mut self, step: Step) -> Held {
        let gone = self.table.drives.iter().find(|known| known.gone).map(|known| known.name.clone());
        match step {
            Step::Add => self.add(0),
            Step::AddAnother => self.add(1),
            Step::TakeOutFirst if !self.there.is_empty() => drop(self.there.remove(0)),
            Step::TakeOutLast => drop(self.there.pop()),
            Step::Rename => {
                self.renamed += 1;
                let name = format!("mill {}", self.renamed);
                if let Some(first) = self.there.first_mut() {
                    first.name = name;
                }
            }
            Step::RenameToOneThatIsGone => {
                if let (Some(last), Some(gone)) = (self.there.last_mut(), gone) {
                    last.name = gone;
                }
            }
            Step::ExchangeNames => {
                if let [first, second, ..] = &mut self.there[..] {
                    std::mem::swap(&mut first.name, &mut second.name);
                    std::mem::swap(&mut first.slot, &mut second.slot);
                }
            }
            Step::Move => {
                self.moved += 1;
                if let Some(first) = self.there.first_mut() {
                    first.place = format!("c {}", self.moved);
                }
            }
            Step::Reverse => self.there.reverse(),
            Step::Number => {
                // A configuration in which two have it is refused before anybody is told from anybody.
                let has_it_already = self.there.iter().any(|named| named.slot == Some(1));
                if let Some(last) = self.there.last_mut().filter(|_| !has_it_already) {
                    last.slot = Some(1);
                }
            }
            Step::Forget => {
                if let Some(gone) = gone {
                    self.table.forget(&gone).map_err(|_| "one that is gone can be forgotten")?;
                }
            }
            Step::Restart => self.restart()?,
            Step::TakeOutFirst => {}
        }
        self.take_up()
    }

    /// The first, or the one after it, that is not configured: by its name or in its place.
    fn add(&mut self, behind: usize) {
        let there = &self.there;
        let is_there =
            |(name, place): &&(&str, &str)| there.iter().any(|one| one.name == *name || one.place == *place);
        let free = DRIVES.iter().filter(|drive| !is_there(drive)).nth(behind);
        if let Some((name, place)) = free {
            let named = Named { name: (*name).to_owned(), place: (*place).to_owned(), slot: None };
            self.there.push(named);
        }
    }

    fn restart(&mut self) -> Held {
        let kept = serde_json::to_string(&self.table).map_err(|_| "it can be kept")?;
        let read: Table = serde_json::from_str(&kept).map_err(|_| "what is kept can be read")?;
        if read != self.table {
            return Err("a restart changes nothing");
        }
        if self.has(Defect::RestartNumbersAnew) {
            self.table.drives.iter_mut().for_each(|known| known.slot = None);
        }
        Ok(())
    }

    fn configured(&self) -> Configured {
        Configured { drives: self.there.clone(), ..Configured::default() }
    }

    fn take_up(&mut self) -> Held {
        let before = self.table.clone();
        let told = self.tells();
        self.nobody_is_another()?;
        self.everybody_stays_himself(&before)?;
        self.the_rest_is_told(&before, &told)?;
        let again = self.table.clone();
        let told_again = self.tells();
        if again != self.table || !told_again.changed.is_empty() {
            return Err("the same configuration changes nothing");
        }
        Ok(())
    }

    /// What the register makes of the configuration, with its defect.
    fn tells(&mut self) -> Told {
        let (before, there) = (self.table.clone(), self.configured());
        let is_there = |known: &Known| there.drives.iter().any(|named| named.name == known.name);
        if self.has(Defect::RenamedIsNew) {
            self.table
                .drives
                .iter_mut()
                .filter(|known| !is_there(known))
                .for_each(|known| known.place.clear());
        }
        if self.has(Defect::PlaceBeforeName) {
            for known in &mut self.table.drives {
                if let Some(named) = there.drives.iter().find(|named| named.place == known.place) {
                    known.name.clone_from(&named.name);
                }
            }
        }
        let mut told = self.table.take_up(&there);
        let was_gone = |known: &Known| before.drives.iter().any(|one| one.gone && one.name == known.name);
        let was_known = |known: &Known| before.drives.iter().any(|one| one.id == known.id);
        let free = self.table.drives.iter().find(|known| known.gone).and_then(|known| known.slot);
        for at in 0..self.table.drives.len() {
            let defect = self.defect;
            let known = &mut self.table.drives[at];
            match defect {
                Some(Defect::NumbersByOrder) => {
                    let order = there.drives.iter().position(|named| named.name == known.name);
                    known.slot = order.map_or(known.slot, |order| Some(order as u16));
                }
                Some(Defect::NumberOfOneThatIsGoneIsFree) if !was_known(known) && free.is_some() => {
                    known.slot = free;
                }
                Some(Defect::TopicByName) => known.topic = topic_id(&known.name),
                Some(Defect::IdByName) => known.id.clone_from(&known.name),
                Some(Defect::ComesBackAsAnother) if was_gone(known) && !known.gone => known.id.push('x'),
                Some(Defect::ConfiguredNumberIsTakenAway) => {
                    let given = there.drives.iter().find(|named| named.name == known.name);
                    known.slot = given.and_then(|named| named.slot).or(known.slot);
                }
                _ => {}
            }
        }
        if self.has(Defect::GoneIsForgotten) {
            self.table.drives.retain(|known| !known.gone);
        }
        if self.has(Defect::ChangesUntold) {
            told = Told::default();
        }
        told
    }

    /// Number, id and topic are those of one, also of one that is gone; the places show those that are there.
    fn nobody_is_another(&self) -> Held {
        let drives = &self.table.drives;
        let ids: BTreeSet<_> = drives.iter().map(|known| &known.id).collect();
        let topics: BTreeSet<_> = drives.iter().map(|known| &known.topic).collect();
        let numbers: BTreeSet<_> = drives.iter().map(|known| known.slot).collect();
        if ids.len() < drives.len() || ids.iter().any(|id| id.is_empty()) {
            return Err("an id is that of one drive");
        }
        let is_level = |topic: &&String| !topic.is_empty() && topic_id(topic) == **topic;
        if topics.len() < drives.len() || !topics.iter().all(is_level) {
            return Err("a topic is that of one drive, in letters of a topic");
        }
        if numbers.len() < drives.len() || numbers.contains(&None) {
            return Err("a number is that of one drive");
        }
        let mut shown: Vec<String> =
            self.table.slots().into_iter().flatten().map(|name| name.to_string()).collect();
        if self.has(Defect::GoneIsShown) {
            shown.extend(drives.iter().filter(|known| known.gone).map(|known| known.name.clone()));
        }
        shown.sort_unstable();
        let mut there: Vec<String> = self.there.iter().map(|named| named.name.clone()).collect();
        there.sort_unstable();
        if shown == there {
            Ok(())
        } else {
            Err("a number shows a drive that is configured, and each of them")
        }
    }

    /// Who has kept his name is who he was; so is who has kept his place while nobody has his name; nobody that is gone is given away.
    fn everybody_stays_himself(&self, before: &Table) -> Held {
        let is_there = |name: &str| self.there.iter().any(|named| named.name == name);
        let now: BTreeMap<&str, &Known> =
            self.table.drives.iter().map(|known| (known.name.as_str(), known)).collect();
        let given = |name: &str| self.there.iter().any(|named| named.name == name && named.slot.is_some());
        let same = |one: &Known, other: &Known| {
            let number = one.slot == other.slot || given(&other.name);
            number && (&one.id, &one.topic) == (&other.id, &other.topic)
        };
        for known in &before.drives {
            let place = self.there.iter().find(|named| named.place == known.place);
            let is_new = |name: &str| !before.drives.iter().any(|one| one.name == name);
            let same_place =
                before.drives.iter().filter(|one| one.place == known.place && !is_there(&one.name));
            let renamed = place.filter(|named| !is_there(&known.name) && is_new(&named.name));
            let (name, why) = match renamed {
                // Two that are gone may have stood in one place: the first of them is meant.
                Some(_) if same_place.clone().next().is_some_and(|first| first.id != known.id) => continue,
                Some(named) => (named.name.as_str(), "a drive that is called otherwise keeps what it has"),
                None => {
                    (known.name.as_str(), "a drive keeps number, id and topic with its name, gone or there")
                }
            };
            if !now.get(name).is_some_and(|now| same(known, now)) {
                return Err(why);
            }
        }
        Ok(())
    }

    /// What is another than before was said; the first numbers are said as such.
    fn the_rest_is_told(&self, before: &Table, told: &Told) -> Held {
        let who = |table: &Table| {
            let of = |known: &Known| (known.name.clone(), known.id.clone(), known.topic.clone(), known.slot);
            let mut all: Vec<_> = table.drives.iter().map(of).collect();
            all.sort_unstable();
            all
        };
        if who(before) != who(&self.table) && told.changed.is_empty() {
            return Err("what changes is told");
        }
        Ok(())
    }
}
