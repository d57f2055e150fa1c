//! The register itself: who is known, who is new, and who is one of those by another name.

use std::{collections::BTreeSet, sync::Arc};

use serde::{Deserialize, Serialize};

use crate::kept::sha256;

/// What has an identity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Drive,
    Line,
    Group,
}

/// Something of the configuration, as it is told from others of its kind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// Its name.
    pub name: String,
    /// What it is, whatever it is called: of a drive its port, its family and its address, of a line its port, of a group its drives.
    pub place: String,
    /// The number that the configuration gives a drive.
    pub slot: Option<u16>,
}

/// What there is.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Configured {
    /// In the order of the configuration.
    pub drives: Vec<Named>,
    pub lines: Vec<Named>,
    pub groups: Vec<Named>,
}

/// What is kept of something.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Known {
    /// Its name.
    pub name: String,
    /// By which it is known wherever a name would do and must not change: the name that it had first, or one like it that nobody has.
    #[serde(default)]
    pub id: String,
    /// What it was when it was last configured.
    pub place: String,
    /// The number of a drive, from 0; `None`: it is no drive, or none was left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u16>,
    /// Its level in topics, and its id where one has to be of letters, digits, `-` and `_`.
    #[serde(default)]
    pub topic: String,
    /// It is in the configuration no more; what it has is kept for it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gone: bool,
}

/// All that were ever configured and not forgotten.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// In the order of their numbers.
    pub drives: Vec<Known>,
    #[serde(default)]
    pub lines: Vec<Known>,
    #[serde(default)]
    pub groups: Vec<Known>,
}

/// What came of a configuration, in words.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Told {
    pub changed: Vec<String>,
    /// The drives that are called otherwise: what each was called, and is called now.
    pub renamed: Vec<(String, String)>,
    /// What the configuration gives and nobody may have.
    pub refused: Vec<String>,
}

impl Table {
    /// Makes this what there is. Who is known by his name keeps what he has; who is not, and stands where one stood who is gone, is that
    /// one by another name; everybody else gets the next number that nobody has had, and a topic of his own. What the configuration gives
    /// comes first.
    pub fn take_up(&mut self, there: &Configured) -> Told {
        let mut told = Told::default();
        let is_first = self.drives.is_empty();
        told.renamed = recognise("", &mut self.drives, &there.drives, &mut told);
        recognise("line ", &mut self.lines, &there.lines, &mut told);
        recognise("group ", &mut self.groups, &there.groups, &mut told);
        self.give_as_configured(&there.drives, &mut told);
        self.give_others(is_first, &mut told);
        if is_first && !there.drives.is_empty() {
            told.changed.push("given for the first time, in the order of the configuration".to_owned());
        }
        told
    }

    /// Gives drives the numbers that the configuration has for them, unless another keeps one.
    fn give_as_configured(&mut self, drives: &[Named], told: &mut Told) {
        let mut given: Vec<(&str, u16)> =
            drives.iter().filter_map(|drive| Some((drive.name.as_str(), drive.slot?))).collect();
        loop {
            // Somebody who has the number and goes elsewhere himself is in nobody's way.
            let stays = |known: &Known| !given.iter().any(|(name, _)| known.name == *name);
            let refused = given.iter().enumerate().find_map(|(at, (name, slot))| {
                let other = self.drives.iter().find(|known| known.slot == Some(*slot) && stays(known))?;
                Some((at, format!("{name} cannot have the slot {slot}: {}", other.keeps(*slot))))
            });
            let Some((at, why)) = refused else { break };
            told.refused.push(why);
            given.remove(at);
        }
        for (name, slot) in given {
            let Some(known) = self.drives.iter_mut().find(|known| known.name == name) else { continue };
            if known.slot.replace(slot).is_some_and(|before| before != slot) {
                told.changed.push(format!("{name} has the number {slot} now, as the configuration says"));
            }
        }
    }

    /// Gives the next numbers to those who have none: above all that were given, and at first the lowest.
    fn give_others(&mut self, is_first: bool, told: &mut Told) {
        for at in 0..self.drives.len() {
            if self.drives[at].slot.is_some() {
                continue;
            }
            let taken: BTreeSet<u16> = self.drives.iter().filter_map(|known| known.slot).collect();
            let next = match (is_first, taken.last()) {
                (true, _) => (0..=u16::MAX).find(|slot| !taken.contains(slot)),
                (false, None) => Some(0),
                (false, Some(highest)) => highest.checked_add(1),
            };
            let known = &mut self.drives[at];
            known.slot = next;
            match next {
                Some(_) if is_first => {}
                Some(slot) => told.changed.push(format!("{} has the number {slot}", known.name)),
                None => told.refused.push(format!("{} has no number: none is left", known.name)),
            }
        }
    }

    /// Forgets a drive that is gone, so that its number and its topic are free. Gives the number.
    ///
    /// # Errors
    /// It is configured, or not known: in words.
    pub fn forget(&mut self, name: &str) -> Result<Option<u16>, String> {
        match self.drives.iter().position(|known| known.name == name) {
            None => Err(format!("no number is kept for {name}")),
            Some(at) if !self.drives[at].gone => {
                Err(format!("{name} is in the configuration: take it out there first"))
            }
            Some(at) => Ok(self.drives.remove(at).slot),
        }
    }

    /// Gives a drive a number that no other has.
    ///
    /// # Errors
    /// It is not known, or another has it: in words.
    pub fn give(&mut self, name: &str, slot: u16) -> Result<(), String> {
        let other = self.drives.iter().find(|known| known.slot == Some(slot) && known.name != name);
        if let Some(other) = other {
            return Err(other.keeps(slot));
        }
        let known = self.drives.iter_mut().find(|known| known.name == name);
        known.ok_or_else(|| format!("no number is kept for {name}"))?.slot = Some(slot);
        Ok(())
    }

    /// Who has each number, from 0 to the highest; `None`: nobody, or somebody who is gone.
    pub fn slots(&self) -> Vec<Option<Arc<str>>> {
        let highest = self.drives.iter().filter_map(|known| known.slot).max();
        let mut slots = vec![None; highest.map_or(0, |highest| usize::from(highest) + 1)];
        for known in self.drives.iter().filter(|known| !known.gone) {
            if let Some(slot) = known.slot {
                slots[usize::from(slot)] = Some(Arc::from(known.name.as_str()));
            }
        }
        slots
    }

    pub fn of(&self, kind: Kind) -> &[Known] {
        match kind {
            Kind::Drive => &self.drives,
            Kind::Line => &self.lines,
            Kind::Group => &self.groups,
        }
    }

    /// What a version before this one has kept had the topics and the ids that follow from the names.
    pub(super) fn complete(&mut self) {
        for known in [&mut self.drives, &mut self.lines, &mut self.groups].into_iter().flatten() {
            if known.id.is_empty() {
                known.id.clone_from(&known.name);
            }
            if known.topic.is_empty() {
                known.topic = topic_id(&known.name);
            }
        }
    }

    /// What has to be well in what was read: no number, no name, no id and no topic of one kind twice.
    pub(super) fn is_sound(&self) -> bool {
        let is_twice = |one: &Known, other: &Known| {
            let is_slot = one.slot.is_some() && one.slot == other.slot;
            is_slot || one.name == other.name || one.id == other.id || one.topic == other.topic
        };
        [&self.drives, &self.lines, &self.groups].into_iter().all(|all| {
            let twice = |(at, one): (usize, &Known)| all[..at].iter().any(|other| is_twice(one, other));
            !all.iter().enumerate().any(twice)
        })
    }
}

impl Known {
    /// Why nobody else gets a number.
    fn keeps(&self, slot: u16) -> String {
        let gone = if self.gone { ", which is gone: drived names forget it first" } else { "" };
        format!("{slot} is the number of {}{gone}", self.name)
    }

    /// What it keeps, in words.
    fn kept(&self) -> String {
        match self.slot {
            Some(slot) => format!("its number {slot}"),
            None => format!("its topic {}", self.topic),
        }
    }
}

/// Finds those of one kind among the known ones, and takes in who is new. Gives who is called otherwise: what each was called, and is called now.
fn recognise(kind: &str, all: &mut Vec<Known>, there: &[Named], told: &mut Told) -> Vec<(String, String)> {
    let is_there = |name: &str| there.iter().any(|named| named.name == name);
    let (mut new, mut renamed) = (Vec::new(), Vec::new());
    for Named { name, place, .. } in there {
        if let Some(known) = all.iter_mut().find(|known| known.name == *name) {
            known.place.clone_from(place);
        } else if let Some(known) =
            all.iter_mut().find(|known| known.place == *place && !is_there(&known.name))
        {
            told.changed.push(format!(
                "{kind}{} is called {name} now: it keeps {}",
                known.name,
                known.kept()
            ));
            renamed.push((std::mem::replace(&mut known.name, name.clone()), name.clone()));
        } else {
            new.push((name, place));
        }
    }
    for known in &mut *all {
        let is_gone = !is_there(&known.name);
        if is_gone && !known.gone {
            told.changed.push(format!("{kind}{} is gone: {} is kept for it", known.name, known.kept()));
        }
        known.gone = is_gone;
    }
    // Names of one topic each get one that says which of them it is, whatever the order.
    let plain: Vec<String> = new.iter().map(|(name, _)| topic_id(name)).collect();
    for ((name, place), topic) in new.iter().zip(&plain) {
        let is_alone = plain.iter().filter(|other| *other == topic).count() == 1;
        let own = |topic: &String| !all.iter().any(|known| known.topic == *topic);
        let marked = (4..).step_by(4).map(|length| marked(name, length)).find(own).unwrap_or_default();
        let topic = Some(topic.clone()).filter(|topic| is_alone && own(topic)).unwrap_or(marked);
        if topic != topic_id(name) {
            told.changed.push(format!("{kind}{name} has the topic {topic}"));
        }
        // The name that another had first is his.
        let others = |id: &String| all.iter().any(|known| known.id == *id);
        let mark = |length| format!("{name}-{}", mark_of(name, length));
        let id = std::iter::once((*name).clone()).chain((4..).step_by(4).map(mark)).find(|id| !others(id));
        let id = id.unwrap_or_default();
        if id != **name {
            told.changed.push(format!("{kind}{name} has the id {id}"));
        }
        let (name, place) = ((*name).clone(), (*place).clone());
        all.push(Known { name, id, place, slot: None, topic, gone: false });
    }
    renamed
}

/// A name as a level of a topic, and as an id of Home Assistant: letters, digits, `-` and `_`.
pub fn topic_id(name: &str) -> String {
    let allowed = |character: char| character.is_ascii_alphanumeric() || character == '-' || character == '_';
    name.chars().map(|character| if allowed(character) { character } else { '_' }).collect()
}

/// The same with a mark of so many digits by which it is told from others.
fn marked(name: &str, length: usize) -> String {
    format!("{}-{}", topic_id(name), mark_of(name, length))
}

/// So many digits that another name hardly has.
fn mark_of(name: &str, length: usize) -> String {
    let mut mark = sha256(name.as_bytes());
    mark.truncate(length);
    mark
}
