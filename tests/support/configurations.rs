//! Who may decide what a motor does: the control configurations of the five manuals, as settings made at the drive, what other
//! masters do, and the referee of each.

use drive_core::registers::{Range, Row};
use drive_families::{Family, Options};
use drive_sim::{Model, SimSlave, models};
use drive_testing::worlds::{ByManual, Configuration, Event, Judge, Surrounded, Values};

use crate::drives::{self, Five, five};

/// A way in which a manual lets a drive be commanded: what it is in a few words, the drive before the settings, and what is set at
/// it, as lines of the simulator's text.
type Way = (&'static str, fn() -> Box<dyn Model>, &'static [&'static str]);

fn atv21() -> Box<dyn Model> {
    drives::machine(Family::ATV21)
}

fn atv28() -> Box<dyn Model> {
    drives::machine(Family::ATV28)
}

fn atv58() -> Box<dyn Model> {
    drives::machine(Family::ATV58)
}

fn atv312() -> Box<dyn Model> {
    drives::machine(Family::ATV312)
}

fn atv312_as_delivered() -> Box<dyn Model> {
    Box::new(models::atv312::Atv312::new())
}

fn omron() -> Box<dyn Model> {
    drives::machine(Family::OMRON_3G3EV)
}

/// Altivar 21, §6.2 p. 12–17: five configurations, the keypad, and the inputs that override the bus (§8.4 p. 31).
const ATV21: &[Way] = &[
    ("bus only, CMOD 2 FMOD 4", atv21, &["set CMOD 2", "set FMOD 4"]),
    ("terminals, CMOD 0 FMOD 1", atv21, &["set CMOD 0", "set FMOD 1"]),
    ("command by the bus, reference VIA", atv21, &["set CMOD 2", "set FMOD 1"]),
    ("command by the terminals, reference by the bus", atv21, &["set CMOD 0", "set FMOD 4"]),
    ("keypad, CMOD 1 FMOD 3", atv21, &["set CMOD 1", "set FMOD 3"]),
    ("R forces local, F112 48", atv21, &["set CMOD 0", "set FMOD 1", "set F112 48"]),
    ("R forces local over the bus, F112 48", atv21, &["set CMOD 2", "set FMOD 4", "set F112 48"]),
    ("R switches the reference, F112 38", atv21, &["set CMOD 2", "set FMOD 4", "set F207 1", "set F112 38"]),
    ("R forces operation, F112 52", atv21, &["set CMOD 2", "set FMOD 4", "set F112 52"]),
    ("R forces run, F112 53", atv21, &["set CMOD 2", "set FMOD 4", "set F112 53"]),
];

/// Altivar 28, VVDED399092: terminals or line, the remote terminal above both.
const ATV28: &[Way] = &[
    ("as delivered", atv28, &[]),
    ("3-wire, tCC 1", atv28, &["set tCC 1", "terminal LI1 on"]),
    ("keypad, tCC 2", atv28, &["set tCC 2"]),
    ("remote terminal, LCC 1", atv28, &["set LCC 1"]),
    ("tLS 2 s at LSP", atv28, &["set tLS 20"]),
    ("LSP 10 Hz, HSP 30 Hz", atv28, &["set LSP 10", "set HSP 30"]),
];

/// Altivar 58 with card, VVDED397054: forced local above the line.
const ATV58: &[Way] = &[
    ("as delivered", atv58, &[]),
    ("W251 10 Hz, W250 30 Hz", atv58, &["set W251 100", "set W250 300"]),
    ("level", atv58, &["reading 2-wire level"]),
];

/// Altivar 312, BBV51701 p. 14–15, 27–28, 33, 35–44, 51.
const ATV312: &[Way] = &[
    ("L1, as delivered", atv312_as_delivered, &[]),
    ("L3, SEP, command and reference by the bus", atv312, &[]),
    ("L3, SIM, Fr1 Mdb", atv312_as_delivered, &["set LAC 2", "set CHCF 1", "set Fr1 164"]),
    ("L3, SIM, Fr1 AI1", atv312_as_delivered, &["set LAC 2", "set CHCF 1"]),
    ("L3, SEP, command by the bus, Fr1 AI1", atv312, &["set Fr1 1"]),
    ("L3, SEP, command by the terminals, Fr1 Mdb", atv312, &["set Cd1 1"]),
    ("L3, SEP, rFC Fr2, Fr2 AI1", atv312, &["set Fr2 1", "set rFC 97"]),
    ("L3, SEP, rFC LI3, Fr2 AI1", atv312, &["set PS2 0", "set PS4 0", "set Fr2 1", "set rFC 131"]),
    ("L3, SEP, CCS LI3, Cd2 tEr", atv312, &["set PS2 0", "set PS4 0", "set Cd2 1", "set CCS 131"]),
    ("L3, SEP, CCS C113, Cd2 tEr", atv312, &["set dCI 0", "set Cd2 1", "set CCS 189"]),
    ("L3, SEP, CCS C113, Cd1 tEr", atv312, &["set dCI 0", "set Cd1 1", "set Cd2 10", "set CCS 189"]),
    ("L3, SEP, presets on LI3 and LI4", atv312, &["set PS2 131", "set PS4 132"]),
    ("L3, SEP, AI2 added by SA2", atv312, &["set SA2 2"]),
    ("L3, SEP, PI regulator on AI1", atv312, &["set PS2 0", "set PS4 0", "set SA2 0", "set PIF 1"]),
    ("L3, SEP, Stt fast", atv312, &["set Stt 1"]),
    ("L3, SEP, Stt freewheel", atv312, &["set Stt 2"]),
    ("L3, SEP, Stt DC injection", atv312, &["set Stt 3"]),
    ("L3, SEP, FSt on bit 12", atv312, &["set FSt 172"]),
    ("L3, SEP, FSt on bit 12, Stt freewheel", atv312, &["set FSt 172", "set Stt 2"]),
    ("L3, SEP, freewheel on LI5", atv312, &["terminal LI5 on", "set nSt 133"]),
    ("L3, SEP, fast stop on LI5", atv312, &["terminal LI5 on", "set FSt 133"]),
    ("L3, SEP, DC injection on LI5", atv312, &["set dCI 133"]),
    ("L3, SEP, forced local on LI5", atv312, &["set FLO 133", "set FLOC 1"]),
    ("L3, SEP, tLS 2 s at LSP", atv312, &["set tLS 20"]),
    ("L3, SEP, automatic restart Atr", atv312, &["set Atr 1"]),
    ("L3, SEP, AdC continuous", atv312, &["set AdC 2"]),
];

/// Omron 3G3EV, §2.1: n02, which acts at the next power-up.
const OMRON: &[Way] = &[
    ("n02 = 5, bus and bus", omron, &[]),
    ("n02 = 0, panel and panel", omron, &["set n02 0", "power cycle"]),
    ("n02 = 1, terminals and panel", omron, &["set n02 1", "power cycle"]),
    ("n02 = 2, bus and panel", omron, &["set n02 2", "power cycle"]),
    ("n02 = 3, panel and panel", omron, &["set n02 3", "power cycle"]),
    ("n02 = 4, terminals and bus", omron, &["set n02 4", "power cycle"]),
    ("n02 = 5, to be 0 at the next power-up", omron, &["set n02 0"]),
    ("n02 = 0, to be 5 at the next power-up", omron, &["set n02 0", "power cycle", "set n02 5"]),
];

/// What is around the drives of a family.
#[derive(Debug, Clone, Copy)]
pub struct Around(pub Family);

impl Around {
    /// What an owner may say of his drive.
    fn owners(&self) -> Vec<(String, Options)> {
        match five(self.0) {
            Five::Atv21 => ["priority", "settings"]
                .map(|authority| (format!(", {authority}"), drives::said("authority", authority)))
                .to_vec(),
            _ => vec![(String::new(), drives::options(self.0))],
        }
    }
}

impl Surrounded for Around {
    fn configurations(&self) -> Vec<Configuration> {
        let ways = match five(self.0) {
            Five::Atv21 => ATV21,
            Five::Atv28 => ATV28,
            Five::Atv58 => ATV58,
            Five::Atv312 => ATV312,
            Five::Omron3g3ev => OMRON,
        };
        let family = self.0;
        let owners = self.owners();
        let of_owner = owners.iter().flat_map(|(owner, options)| {
            ways.iter().map(move |&(name, machine, settings)| {
                let options = options.clone();
                Configuration {
                    name: format!("{name}{owner}"),
                    open: Box::new(move |port, slave| family.open_with(port, slave, &options)),
                    machine: Box::new(machine),
                    settings: settings.iter().map(|&setting| setting.to_owned()).collect(),
                }
            })
        });
        of_owner.collect()
    }

    /// His run command and his stops, a reference of his own, one the other way round, and no way back: he stays.
    fn other_masters(&self) -> Vec<Event> {
        let deeds: &[&str] = match five(self.0) {
            // Another reference, a preset speed, reverse, a stop, and what gives control back (§8.4, §8.5).
            Five::Atv21 => &["FA01 3000", "FA00 C401h", "FA00 C600h", "FA00 C000h", "FA00 0000h"],
            // §5.1.
            Five::Omron3g3ev => &["0002h 300", "0001h 3", "0001h 0"],
            Five::Atv58 => {
                &["W401 300", "W401 FF38h", "CMD 000Fh", "CMD 080Fh", "CMD 100Fh", "CMD 0002h", "CMD 0000h"]
            }
            Five::Atv28 | Five::Atv312 => {
                &["LFr 30", "LFr -20", "CMD 000Fh", "CMD 080Fh", "CMD 100Fh", "CMD 0002h", "CMD 0000h"]
            }
        };
        deeds.iter().map(|deed| Event::lasting(&format!("master {deed}"))).collect()
    }

    fn judge(&self, machine: &SimSlave) -> Option<Box<dyn Judge>> {
        ByManual::of(machine).map(|judge| Box::new(judge) as Box<dyn Judge>)
    }

    fn parameter(&self) -> Option<(&'static str, u16)> {
        Some((if self.0 == Family::OMRON_3G3EV { "n20" } else { "ACC" }, 25))
    }

    fn values_of(&self, row: &Row) -> Option<Values> {
        match row.range {
            _ if LEFT_ALONE.contains(&row.code) => None,
            // The functions of the Altivar 21's inputs that its manual names.
            Range::Any if row.code.starts_with("F11") => Some(Values::Listed(vec![0, 2, 38, 48, 52, 53])),
            // No drive lets itself be set to a low speed above its high speed.
            _ if row.code == "LSP" => Some(Values::Between(0, 400)),
            ref range if row.code == "HSP" => match Values::of(range) {
                Some(Values::Between(_, high)) => Some(Values::Between(400, high)),
                listed => listed,
            },
            ref range => Values::of(range),
        }
    }
}

/// What random settings leave alone: how the drive is reached and how fast its ramps are, by the manuals' mnemonics. A drive that
/// cannot be reached says nothing, and one with a ramp of an hour is still coming down when it is judged.
const LEFT_ALONE: [&str; 36] = [
    "F802", "F800", "F801", "F829", "F803", "F603", "ACC", "DEC", "F500", "F501", "AU1", "F856", "F870",
    "F871", "ACC", "dEC", "AC2", "dE2", "Inr", "Add", "tbr", "tFO", "ttO", "SLL", "FCS", "SCS", "CMI", "dCF",
    "tUn", "nCr", "n63", "n64", "n65", "n66", "n67", "n40",
];
