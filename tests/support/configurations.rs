//! Who may decide what a motor does: the control configurations of the five manuals, as settings made at the drive, and
//! the states of the world around it.

use drive_atv21::Authority;
use drive_families::{Family, Options};
use drive_sim::{Model, Surroundings, models};

use crate::{drives, scene::options};

/// A way in which a manual lets a drive be commanded.
#[derive(Clone, Copy)]
pub struct Configuration {
    /// The drive.
    pub family: Family,
    /// What it is, in a few words.
    pub name: &'static str,
    /// The drive before the settings.
    pub model: fn() -> Box<dyn Model>,
    /// What is set at the drive, as lines of the simulator's text.
    pub settings: &'static [&'static str],
    /// What its owner says of it.
    pub options: Options,
}

const fn at(
    family: Family,
    name: &'static str,
    model: fn() -> Box<dyn Model>,
    settings: &'static [&'static str],
) -> Configuration {
    Configuration { family, name, model, settings, options: NO_OPTIONS }
}

const NO_OPTIONS: Options = Options { authority: None, map: None, fault_reset_function: None, saves: None };

fn atv21() -> Box<dyn Model> {
    drives::machine(Family::Atv21)
}

fn atv28() -> Box<dyn Model> {
    drives::machine(Family::Atv28)
}

fn atv58() -> Box<dyn Model> {
    drives::machine(Family::Atv58)
}

fn atv312() -> Box<dyn Model> {
    drives::machine(Family::Atv312)
}

fn atv312_as_delivered() -> Box<dyn Model> {
    Box::new(models::atv312::Atv312::new())
}

fn omron() -> Box<dyn Model> {
    drives::machine(Family::Omron3g3ev)
}

/// Altivar 21, §6.2 p. 12–17: five configurations, the keypad, and the inputs that override the bus (§8.4 p. 31).
const ATV21: &[Configuration] = &[
    at(Family::Atv21, "bus only, CMOD 2 FMOD 4", atv21, &["set CMOD 2", "set FMOD 4"]),
    at(Family::Atv21, "terminals, CMOD 0 FMOD 1", atv21, &["set CMOD 0", "set FMOD 1"]),
    at(Family::Atv21, "command by the bus, reference VIA", atv21, &["set CMOD 2", "set FMOD 1"]),
    at(Family::Atv21, "command by the terminals, reference by the bus", atv21, &["set CMOD 0", "set FMOD 4"]),
    at(Family::Atv21, "keypad, CMOD 1 FMOD 3", atv21, &["set CMOD 1", "set FMOD 3"]),
    at(Family::Atv21, "R forces local, F112 48", atv21, &["set CMOD 0", "set FMOD 1", "set F112 48"]),
    at(
        Family::Atv21,
        "R forces local over the bus, F112 48",
        atv21,
        &["set CMOD 2", "set FMOD 4", "set F112 48"],
    ),
    at(
        Family::Atv21,
        "R switches the reference, F112 38",
        atv21,
        &["set CMOD 2", "set FMOD 4", "set F207 1", "set F112 38"],
    ),
    at(Family::Atv21, "R forces operation, F112 52", atv21, &["set CMOD 2", "set FMOD 4", "set F112 52"]),
    at(Family::Atv21, "R forces run, F112 53", atv21, &["set CMOD 2", "set FMOD 4", "set F112 53"]),
];

/// Altivar 28, VVDED399092: terminals or line, the remote terminal above both.
const ATV28: &[Configuration] = &[
    at(Family::Atv28, "as delivered", atv28, &[]),
    at(Family::Atv28, "3-wire, tCC 1", atv28, &["set tCC 1", "terminal LI1 on"]),
    at(Family::Atv28, "keypad, tCC 2", atv28, &["set tCC 2"]),
    at(Family::Atv28, "remote terminal, LCC 1", atv28, &["set LCC 1"]),
    at(Family::Atv28, "tLS 2 s at LSP", atv28, &["set tLS 20"]),
    at(Family::Atv28, "LSP 10 Hz, HSP 30 Hz", atv28, &["set LSP 10", "set HSP 30"]),
];

/// Altivar 58 with card, VVDED397054: forced local above the line.
const ATV58: &[Configuration] = &[
    at(Family::Atv58, "as delivered", atv58, &[]),
    at(Family::Atv58, "W251 10 Hz, W250 30 Hz", atv58, &["set W251 100", "set W250 300"]),
    at(Family::Atv58, "level", atv58, &["reading 2-wire level"]),
];

/// Altivar 312, BBV51701 p. 14–15, 27–28, 33, 35–44, 51.
const ATV312: &[Configuration] = &[
    at(Family::Atv312, "L1, as delivered", atv312_as_delivered, &[]),
    at(Family::Atv312, "L3, SEP, command and reference by the bus", atv312, &[]),
    at(Family::Atv312, "L3, SIM, Fr1 Mdb", atv312_as_delivered, &["set LAC 2", "set CHCF 1", "set Fr1 164"]),
    at(Family::Atv312, "L3, SIM, Fr1 AI1", atv312_as_delivered, &["set LAC 2", "set CHCF 1"]),
    at(Family::Atv312, "L3, SEP, command by the bus, Fr1 AI1", atv312, &["set Fr1 1"]),
    at(Family::Atv312, "L3, SEP, command by the terminals, Fr1 Mdb", atv312, &["set Cd1 1"]),
    at(Family::Atv312, "L3, SEP, rFC Fr2, Fr2 AI1", atv312, &["set Fr2 1", "set rFC 97"]),
    at(
        Family::Atv312,
        "L3, SEP, rFC LI3, Fr2 AI1",
        atv312,
        &["set PS2 0", "set PS4 0", "set Fr2 1", "set rFC 131"],
    ),
    at(
        Family::Atv312,
        "L3, SEP, CCS LI3, Cd2 tEr",
        atv312,
        &["set PS2 0", "set PS4 0", "set Cd2 1", "set CCS 131"],
    ),
    at(Family::Atv312, "L3, SEP, CCS C113, Cd2 tEr", atv312, &["set dCI 0", "set Cd2 1", "set CCS 189"]),
    at(
        Family::Atv312,
        "L3, SEP, CCS C113, Cd1 tEr",
        atv312,
        &["set dCI 0", "set Cd1 1", "set Cd2 10", "set CCS 189"],
    ),
    at(Family::Atv312, "L3, SEP, presets on LI3 and LI4", atv312, &["set PS2 131", "set PS4 132"]),
    at(Family::Atv312, "L3, SEP, AI2 added by SA2", atv312, &["set SA2 2"]),
    at(
        Family::Atv312,
        "L3, SEP, PI regulator on AI1",
        atv312,
        &["set PS2 0", "set PS4 0", "set SA2 0", "set PIF 1"],
    ),
    at(Family::Atv312, "L3, SEP, Stt fast", atv312, &["set Stt 1"]),
    at(Family::Atv312, "L3, SEP, Stt freewheel", atv312, &["set Stt 2"]),
    at(Family::Atv312, "L3, SEP, Stt DC injection", atv312, &["set Stt 3"]),
    at(Family::Atv312, "L3, SEP, FSt on bit 12", atv312, &["set FSt 172"]),
    at(Family::Atv312, "L3, SEP, FSt on bit 12, Stt freewheel", atv312, &["set FSt 172", "set Stt 2"]),
    at(Family::Atv312, "L3, SEP, freewheel on LI5", atv312, &["terminal LI5 on", "set nSt 133"]),
    at(Family::Atv312, "L3, SEP, fast stop on LI5", atv312, &["terminal LI5 on", "set FSt 133"]),
    at(Family::Atv312, "L3, SEP, DC injection on LI5", atv312, &["set dCI 133"]),
    at(Family::Atv312, "L3, SEP, forced local on LI5", atv312, &["set FLO 133", "set FLOC 1"]),
    at(Family::Atv312, "L3, SEP, tLS 2 s at LSP", atv312, &["set tLS 20"]),
    at(Family::Atv312, "L3, SEP, automatic restart Atr", atv312, &["set Atr 1"]),
    at(Family::Atv312, "L3, SEP, AdC continuous", atv312, &["set AdC 2"]),
];

/// Omron 3G3EV, §2.1: n02, which acts at the next power-up.
const OMRON: &[Configuration] = &[
    at(Family::Omron3g3ev, "n02 = 5, bus and bus", omron, &[]),
    at(Family::Omron3g3ev, "n02 = 0, panel and panel", omron, &["set n02 0", "power cycle"]),
    at(Family::Omron3g3ev, "n02 = 1, terminals and panel", omron, &["set n02 1", "power cycle"]),
    at(Family::Omron3g3ev, "n02 = 2, bus and panel", omron, &["set n02 2", "power cycle"]),
    at(Family::Omron3g3ev, "n02 = 3, panel and panel", omron, &["set n02 3", "power cycle"]),
    at(Family::Omron3g3ev, "n02 = 4, terminals and bus", omron, &["set n02 4", "power cycle"]),
    at(Family::Omron3g3ev, "n02 = 5, to be 0 at the next power-up", omron, &["set n02 0"]),
    at(
        Family::Omron3g3ev,
        "n02 = 0, to be 5 at the next power-up",
        omron,
        &["set n02 0", "power cycle", "set n02 5"],
    ),
];

/// Every control configuration of a family, with what its owner may say of it.
#[must_use]
pub fn configurations(family: Family) -> Vec<Configuration> {
    let of_manual = match family {
        Family::Atv21 => ATV21,
        Family::Atv28 => ATV28,
        Family::Atv58 => ATV58,
        Family::Atv312 => ATV312,
        Family::Omron3g3ev => OMRON,
    };
    let owners = match family {
        Family::Atv21 => [Authority::Priority, Authority::Settings]
            .map(|authority| Options { authority: Some(authority), ..options(family) })
            .to_vec(),
        _ => vec![options(family)],
    };
    let of_owner =
        |owner: Options| of_manual.iter().map(move |&this| Configuration { options: owner, ..this });
    owners.into_iter().flat_map(of_owner).collect()
}

/// A state of the world: what happens, and how it is taken back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct World {
    /// What happens, in the simulator's lines.
    pub comes: Vec<String>,
    /// What takes it back, in the same order.
    pub goes: Vec<String>,
}

impl World {
    fn of(pairs: &[(String, String)]) -> Self {
        let (comes, goes) = pairs.iter().cloned().unzip();
        Self { comes, goes }
    }
}

/// Every state of the world in which something else than the bus may decide: each input closed, alone and with every
/// analog input at 60 %, each analog input alone, the panel in its ways, the supplies.
#[must_use]
pub fn worlds(around: &Surroundings) -> Vec<World> {
    let pair = |comes: String, goes: &str| (comes, goes.to_owned());
    let terminals: Vec<_> = (around.terminals.iter())
        .map(|name| pair(format!("terminal {name} on"), &format!("terminal {name} off")))
        .collect();
    let opened: Vec<_> = (around.terminals.iter())
        .map(|name| pair(format!("terminal {name} off"), &format!("terminal {name} on")))
        .collect();
    let analog: Vec<_> = (around.analog_inputs.iter())
        .map(|name| pair(format!("analog {name} 60%"), &format!("analog {name} 0%")))
        .collect();
    let panel = [pair("panel takes".to_owned(), "panel releases")];
    let mut panel_runs = panel.to_vec();
    panel_runs.push(pair("panel reference 35Hz".to_owned(), "panel reference 0Hz"));
    panel_runs.push(pair("panel run".to_owned(), "panel stop"));
    let mut worlds = vec![World::of(&[])];
    worlds.extend(terminals.iter().map(|one| World::of(std::slice::from_ref(one))));
    worlds.extend(opened.iter().map(|one| World::of(std::slice::from_ref(one))));
    worlds.extend(terminals.iter().map(|one| {
        let mut all = analog.clone();
        all.push(one.clone());
        World::of(&all)
    }));
    worlds.extend(analog.iter().map(|one| World::of(std::slice::from_ref(one))));
    worlds.push(World::of(&panel));
    worlds.push(World::of(&panel_runs));
    worlds.push(World::of(&[pair("panel stop".to_owned(), "panel releases")]));
    worlds.push(World::of(&[pair("motor-supply off".to_owned(), "motor-supply on")]));
    worlds.push(World::of(&[pair("power off".to_owned(), "power on")]));
    worlds
}
