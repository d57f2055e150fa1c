//! The referee: who may move the motor and what stops it, by the manuals alone.
//!
//! A second transcription, by another hand than the drivers' and the simulator's: it knows neither and depends on neither.
//! A [`World`] is a drive with everything around it as plain data; a [`Change`] is what happens to it; [`next`] follows a
//! sequence, with the memory that edges and charts need. At each moment the manual of its [`Family`] is asked:
//!
//! - [`commander`]: who commands run and stop;
//! - [`reference()`]: which reference counts, its sign and its limits;
//! - [`order`]: what the drive has to do with the motor;
//! - [`starts_by`]: whether a change starts the motor;
//! - [`effects`]: what a write of the bus does to it;
//! - [`explains`], [`ruling`]: whether a motion that is seen is explained.
//!
//! Every answer names the [`Rule`] it comes from. Where a manual says nothing or contradicts itself the answer names the
//! [`Silence`]; [`silences`] lists them all, [`rules`] the rules. A silence convicts nobody.
//!
//! The manuals: S0 is the Altivar 21 Modbus guide (10/2009), S1 the Omron 3G3EV MODBUS manual, S2 VVDED399092 of the
//! Altivar 28, S3 VVDED397054 of the Altivar 58, S4 BBV52816 and BBV is BBV51701, both of the Altivar 312.

mod answer;
mod atv21;
mod atv28;
mod atv312;
mod atv58;
mod drivecom;
mod omron_3g3ev;
mod world;

pub use self::answer::{
    Answer, Effect, Mark, Motion, Order, Origin, Reference, Rule, Ruling, Silence, Start, Stop, Verdict, Who,
};
pub use self::drivecom::State;
pub use self::world::{Change, Direction, Key, Panel, Spent, World};

use self::answer::judge;

/// A family of drives, and so a manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// Altivar 21.
    Atv21,
    /// Altivar 28.
    Atv28,
    /// Altivar 58 with the card VW3-A58303.
    Atv58,
    /// Altivar 312.
    Atv312,
    /// Omron 3G3EV MODBUS.
    Omron3g3ev,
}

impl Family {
    /// The family that is called so, by its [key](drive_core::Capabilities::key); `None`: no manual here is of it.
    #[must_use]
    pub fn by_key(key: &str) -> Option<Self> {
        Some(match key {
            "atv21" => Self::Atv21,
            "atv28" => Self::Atv28,
            "atv58" => Self::Atv58,
            "atv312" => Self::Atv312,
            "3g3ev" => Self::Omron3g3ev,
            _ => return None,
        })
    }
}

impl Family {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Atv21, Self::Atv28, Self::Atv58, Self::Atv312, Self::Omron3g3ev];

    fn manual(self) -> &'static dyn Manual {
        match self {
            Self::Atv21 => &atv21::Atv21,
            Self::Atv28 => &atv28::Atv28,
            Self::Atv58 => &atv58::Atv58,
            Self::Atv312 => &atv312::Atv312,
            Self::Omron3g3ev => &omron_3g3ev::Omron3g3ev,
        }
    }
}

/// What one manual says.
trait Manual: Sync {
    fn rules(&self) -> &'static [&'static Rule];
    fn silences(&self) -> &'static [&'static Silence];
    fn commander(&self, world: &World) -> Answer<Who>;
    fn reference(&self, world: &World) -> Answer<Reference>;
    fn order(&self, world: &World) -> Answer<Order>;
    /// The memory of the drive after a change.
    fn step(&self, world: &World, change: &Change) -> World;
    /// Where a run command of the bus stood while somebody else commanded.
    fn standing_run(&self) -> Option<&'static Silence>;
    /// A word that commands run and stop.
    fn is_command(&self, address: u16) -> bool;
    /// What must not be seen although the order itself is not known.
    fn forbids(&self, _: &World, _: Motion) -> Option<&'static Rule> {
        None
    }
    /// Starts that no run command explains.
    fn of_itself(&self, _: &World, _: &Change) -> Option<Answer<Start>> {
        None
    }
    /// What else than motion the manual says of a write.
    fn said_of(&self, _: &World, _: &Change) -> Vec<Answer<Effect>> {
        Vec::new()
    }
}

/// Every rule of every manual, in the order of [`Family::ALL`].
pub fn rules() -> Vec<&'static Rule> {
    Family::ALL.iter().flat_map(|family| family.manual().rules().iter().copied()).collect()
}

/// Every question that a manual leaves open.
pub fn silences() -> Vec<&'static Silence> {
    Family::ALL.iter().flat_map(|family| family.manual().silences().iter().copied()).collect()
}

/// Who commands run and stop, and by which setting.
pub fn commander(world: &World) -> Answer<Who> {
    world.family.manual().commander(world)
}

/// The reference that counts, whether or not anything runs.
pub fn reference(world: &World) -> Answer<Reference> {
    world.family.manual().reference(world)
}

/// What the drive has to do with the motor now.
pub fn order(world: &World) -> Answer<Order> {
    if let Some(silence) = world.unsure {
        return Answer::Silent(silence);
    }
    let order = world.family.manual().order(world);
    match (world.regained, order, world.family.manual().standing_run()) {
        (true, Answer::Says(Order::Drive { by: Who::Bus, .. }, _), Some(silence)) => Answer::Silent(silence),
        _ => order,
    }
}

/// The world after a change.
#[must_use]
pub fn next(world: &World, change: &Change) -> World {
    let manual = world.family.manual();
    let mut after = manual.step(world, change);
    let by_command = match *change {
        Change::Write { address, .. } | Change::Broadcast { address, .. } => manual.is_command(address),
        _ => false,
    };
    let is_bus = |world: &World| manual.commander(world).said() == Some(Who::Bus);
    if !by_command && world.mains && is_bus(&after) && !is_bus(world) && after.command.is_some() {
        after.regained = true;
    }
    after
}

/// Whether a change starts a motor that is not driven, without or with a new command of the bus.
pub fn starts_by(world: &World, change: &Change) -> Start {
    if let Some(answer) = world.family.manual().of_itself(world, change) {
        return answer.said().unwrap_or(Start::ManualSilent);
    }
    match (order(world), order(&next(world, change))) {
        (Answer::Says(Order::Drive { .. }, _), Answer::Says(..)) => Start::MayNot,
        (_, Answer::Says(Order::Drive { .. }, _)) => Start::MayStart,
        (_, Answer::Says(..)) => Start::MayNot,
        (_, Answer::Silent(_)) => Start::ManualSilent,
    }
}

/// What a write does, first to who commands and to trips, last to the motor.
pub fn effects(world: &World, write: &Change) -> Vec<Answer<Effect>> {
    let mut all = world.family.manual().said_of(world, write);
    all.push(answer::effect(order(world), order(&next(world, write))));
    all
}

/// Whether the manual explains a motion that is seen.
pub fn explains(world: &World, motion: Motion) -> Verdict {
    ruling(world, motion).verdict
}

/// Whether the manual explains a motion that is seen, and where.
pub fn ruling(world: &World, motion: Motion) -> Ruling {
    if let Some(rule) = world.family.manual().forbids(world, motion) {
        return Ruling { verdict: Verdict::MustNot, source: rule.source, because: rule.says };
    }
    match order(world) {
        Answer::Says(order, rule) => {
            Ruling { verdict: judge(order, motion), source: rule.source, because: rule.says }
        }
        Answer::Silent(silence) => {
            Ruling { verdict: Verdict::Silent, source: silence.source, because: silence.question }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_and_every_silence_names_a_page_or_a_section_of_its_manual() {
        for (source, name) in rules()
            .iter()
            .map(|rule| (rule.source, rule.name))
            .chain(silences().iter().map(|silence| (silence.source, silence.name)))
        {
            assert!(source.contains("p.") || source.contains('§'), "{name}: {source}");
        }
    }

    #[test]
    fn where_a_manual_is_silent_it_is_written_down_what_the_driver_does() {
        for family in Family::ALL {
            for silence in family.manual().silences() {
                assert!(silence.driver.is_some(), "{family:?}: {}", silence.name);
            }
        }
    }

    #[test]
    fn the_page_of_silences_says_what_stands_here() {
        let mut page = String::from(include_str!("silences_head.md"));
        for family in Family::ALL {
            page.push_str(&format!("\n## {family:?}\n\n| What the manual does not say | Where one would look | What the driver does |\n|---|---|---|\n"));
            for Silence { question, source, driver, .. } in family.manual().silences() {
                page.push_str(&format!("| {question} | {source} | {} |\n", driver.unwrap_or("")));
            }
        }
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/SILENCES.md");
        if std::env::var_os("UPDATE_SILENCES").is_some() {
            std::fs::write(path, &page).expect("it can be written");
        }
        let stands = std::fs::read_to_string(path).unwrap_or_default();
        assert!(
            stands == page,
            "write it anew: UPDATE_SILENCES=1 cargo test -p drive-testing the_page_of_silences"
        );
    }

    #[test]
    fn names_of_a_family_are_its_own() {
        for family in Family::ALL {
            let mut names: Vec<_> = family.manual().rules().iter().map(|rule| rule.name).collect();
            names.extend(family.manual().silences().iter().map(|silence| silence.name));
            let all = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all, "{family:?}");
        }
    }

    #[test]
    fn a_drive_as_delivered_that_nobody_asks_anything_is_never_said_to_turn() {
        for family in Family::ALL {
            let turning = Motion::Turning { reverse: false, tends: None };
            let verdict = explains(&World::factory(family), turning);
            assert!(matches!(verdict, Verdict::MustNot | Verdict::Silent), "{family:?}: {verdict:?}");
        }
    }
}
