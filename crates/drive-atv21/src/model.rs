//! The models of the Altivar 21 (Altivar 21 Modbus §8.9, p. 40, 41).

use drive_core::{Identity, Power, Recognised};

use crate::registers as map;

/// Bit 7 of FB72: the class B variant, whose reference ends in C.
const CLASS_B: u16 = 1 << 7;

/// The class of the supply voltage, always three-phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VoltageClass {
    /// 200 V.
    V200,
    /// 400 to 460 V.
    V400,
}

/// How the drive is housed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Enclosure {
    /// The open drive (references ATV21H).
    Standard,
    /// IP54 (references ATV21W).
    Ip54,
    /// IP54 with the filter of class B (references ATV21W with a C at the end). From 37 kW on the manual's text says
    /// IP54 only while its class column says class B.
    Ip54ClassB,
}

/// A model: what the codes FB05 and FB72 say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ModelEntry {
    /// The code FB05.
    pub code: u16,
    /// The reference; the manual leaves the smallest of each range without one.
    pub reference: Option<&'static str>,
    /// The class of the supply voltage.
    pub voltage: VoltageClass,
    /// The enclosure.
    pub enclosure: Enclosure,
    decawatts: &'static [i32],
}

impl ModelEntry {
    const fn new(
        code: u16,
        reference: Option<&'static str>,
        decawatts: &'static [i32],
        voltage: VoltageClass,
        enclosure: Enclosure,
    ) -> Self {
        Self { code, reference, voltage, enclosure, decawatts }
    }

    /// The model with these codes FB05 and FB72; `None` for codes that the manual does not list.
    #[must_use]
    pub fn lookup(code: u16, class: u16) -> Option<&'static Self> {
        let class_b = class & CLASS_B != 0;
        MODELS.iter().find(|model| model.code == code && model.is_class_b() == class_b)
    }

    /// Whether bit 7 of FB72 is set.
    #[must_use]
    pub fn is_class_b(&self) -> bool {
        self.enclosure == Enclosure::Ip54ClassB
    }

    /// The power of the motor; two where the manual prints two (3.7/4 kW).
    pub fn powers(&self) -> impl Iterator<Item = Power> + use<> {
        self.decawatts.iter().copied().map(Power::from_decawatts)
    }
}

/// Whether what says this of itself is an Altivar 21: by the reference of 43/14 (§7.9), else by FB05 and FB72.
pub(crate) fn recognise(identity: &Identity) -> Recognised {
    const STRANGER: Recognised =
        Recognised::NotMine { it_is: "a drive whose identification (43/14) names no Altivar" };
    if let Some(model) = identity.model.as_deref().map(str::trim).filter(|model| !model.is_empty()) {
        return Recognised::by_reference(model, "ATV21").unwrap_or(STRANGER);
    }
    let code =
        |register: u16| identity.codes.iter().find(|word| word.address == register).map(|word| word.value);
    let codes = code(map::MODEL_CODE.address()).zip(code(map::MODEL_CLASS.address()));
    match codes.and_then(|(code, class)| ModelEntry::lookup(code, class)) {
        Some(_) => Recognised::Mine,
        None => Recognised::CannotTell,
    }
}

use Enclosure::{Ip54, Ip54ClassB, Standard};
use VoltageClass::{V200, V400};

/// Every model, in the manual's order; powers in 0.01 kW.
pub const MODELS: &[ModelEntry] = &[
    ModelEntry::new(2, None, &[37, 40], V200, Standard),
    ModelEntry::new(4, Some("ATV21H075M3X"), &[75], V200, Standard),
    ModelEntry::new(6, Some("ATV21HU15M3X"), &[150], V200, Standard),
    ModelEntry::new(7, Some("ATV21HU22M3X"), &[220], V200, Standard),
    ModelEntry::new(8, Some("ATV21HU30M3X"), &[300], V200, Standard),
    ModelEntry::new(9, Some("ATV21HU40M3X"), &[370, 400], V200, Standard),
    ModelEntry::new(10, Some("ATV21HU55M3X"), &[550], V200, Standard),
    ModelEntry::new(11, Some("ATV21HU75M3X"), &[750], V200, Standard),
    ModelEntry::new(108, Some("ATV21HD11M3X"), &[1100], V200, Standard),
    ModelEntry::new(109, Some("ATV21HD15M3X"), &[1500], V200, Standard),
    ModelEntry::new(110, Some("ATV21HD18M3X"), &[1850], V200, Standard),
    ModelEntry::new(111, Some("ATV21HD22M3X"), &[2200], V200, Standard),
    ModelEntry::new(112, Some("ATV21HD30M3X"), &[3000], V200, Standard),
    ModelEntry::new(34, None, &[40], V400, Standard),
    ModelEntry::new(36, Some("ATV21H075N4"), &[75], V400, Standard),
    ModelEntry::new(38, Some("ATV21HU15N4"), &[150], V400, Standard),
    ModelEntry::new(39, Some("ATV21HU22N4"), &[220], V400, Standard),
    ModelEntry::new(40, Some("ATV21HU30N4"), &[300], V400, Standard),
    ModelEntry::new(41, Some("ATV21HU40N4"), &[370, 400], V400, Standard),
    ModelEntry::new(42, Some("ATV21HU55N4"), &[550], V400, Standard),
    ModelEntry::new(43, Some("ATV21HU75N4"), &[750], V400, Standard),
    ModelEntry::new(44, Some("ATV21HD11N4"), &[1100], V400, Standard),
    ModelEntry::new(45, Some("ATV21HD15N4"), &[1500], V400, Standard),
    ModelEntry::new(46, Some("ATV21HD18N4"), &[1850], V400, Standard),
    ModelEntry::new(47, Some("ATV21HD22N4"), &[2200], V400, Standard),
    ModelEntry::new(48, Some("ATV21HD30N4"), &[3000], V400, Standard),
    ModelEntry::new(49, Some("ATV21HD37N4"), &[3700], V400, Standard),
    ModelEntry::new(50, Some("ATV21HD45N4"), &[4500], V400, Standard),
    ModelEntry::new(51, Some("ATV21HD55N4"), &[5500], V400, Standard),
    ModelEntry::new(52, Some("ATV21HD75N4"), &[7500], V400, Standard),
    ModelEntry::new(134, None, &[40], V400, Ip54),
    ModelEntry::new(136, Some("ATV21W075N4"), &[75], V400, Ip54),
    ModelEntry::new(138, Some("ATV21WU15N4"), &[150], V400, Ip54),
    ModelEntry::new(139, Some("ATV21WU22N4"), &[220], V400, Ip54),
    ModelEntry::new(140, Some("ATV21WU30N4"), &[300], V400, Ip54),
    ModelEntry::new(141, Some("ATV21WU40N4"), &[370, 400], V400, Ip54),
    ModelEntry::new(142, Some("ATV21WU55N4"), &[550], V400, Ip54),
    ModelEntry::new(143, Some("ATV21WU75N4"), &[750], V400, Ip54),
    ModelEntry::new(144, Some("ATV21WD11N4"), &[1100], V400, Ip54),
    ModelEntry::new(145, Some("ATV21WD15N4"), &[1500], V400, Ip54),
    ModelEntry::new(146, Some("ATV21WD18N4"), &[1850], V400, Ip54),
    ModelEntry::new(147, Some("ATV21WD22N4"), &[2200], V400, Ip54),
    ModelEntry::new(148, Some("ATV21WD30N4"), &[3000], V400, Ip54),
    ModelEntry::new(149, Some("ATV21WD37N4"), &[3700], V400, Ip54),
    ModelEntry::new(150, Some("ATV21WD45N4"), &[4500], V400, Ip54),
    ModelEntry::new(151, Some("ATV21WD55N4"), &[5500], V400, Ip54),
    ModelEntry::new(152, Some("ATV21WD75N4"), &[7500], V400, Ip54),
    ModelEntry::new(134, None, &[40], V400, Ip54ClassB),
    ModelEntry::new(136, Some("ATV21W075N4C"), &[75], V400, Ip54ClassB),
    ModelEntry::new(138, Some("ATV21WU15N4C"), &[150], V400, Ip54ClassB),
    ModelEntry::new(139, Some("ATV21WU22N4C"), &[220], V400, Ip54ClassB),
    ModelEntry::new(140, Some("ATV21WU30N4C"), &[300], V400, Ip54ClassB),
    ModelEntry::new(141, Some("ATV21WU40N4C"), &[370, 400], V400, Ip54ClassB),
    ModelEntry::new(142, Some("ATV21WU55N4C"), &[550], V400, Ip54ClassB),
    ModelEntry::new(143, Some("ATV21WU75N4C"), &[750], V400, Ip54ClassB),
    ModelEntry::new(144, Some("ATV21WD11N4C"), &[1100], V400, Ip54ClassB),
    ModelEntry::new(145, Some("ATV21WD15N4C"), &[1500], V400, Ip54ClassB),
    ModelEntry::new(146, Some("ATV21WD18N4C"), &[1850], V400, Ip54ClassB),
    ModelEntry::new(147, Some("ATV21WD22N4C"), &[2200], V400, Ip54ClassB),
    ModelEntry::new(148, Some("ATV21WD30N4C"), &[3000], V400, Ip54ClassB),
    ModelEntry::new(149, Some("ATV21WD37N4C"), &[3700], V400, Ip54ClassB),
    ModelEntry::new(150, Some("ATV21WD45N4C"), &[4500], V400, Ip54ClassB),
    ModelEntry::new(151, Some("ATV21WD55N4C"), &[5500], V400, Ip54ClassB),
    ModelEntry::new(152, Some("ATV21WD75N4C"), &[7500], V400, Ip54ClassB),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_class_tells_two_models_with_one_code_apart() {
        let plain = ModelEntry::lookup(142, 0).and_then(|model| model.reference);
        let class_b = ModelEntry::lookup(142, 0x0080).and_then(|model| model.reference);
        assert_eq!((plain, class_b), (Some("ATV21WU55N4"), Some("ATV21WU55N4C")));
    }

    #[test]
    fn an_unlisted_code_is_no_model() {
        assert_eq!(ModelEntry::lookup(3, 0), None);
        assert_eq!(ModelEntry::lookup(4, 0x0080), None, "there is no class B variant of the 200 V models");
    }

    #[test]
    fn a_model_has_one_power_or_the_two_that_are_printed() {
        let powers = |code| ModelEntry::lookup(code, 0).map(|model| model.powers().collect::<Vec<_>>());
        assert_eq!(powers(52), Some(vec![Power::from_decawatts(7_500)]));
        assert_eq!(powers(9), Some(vec![Power::from_decawatts(370), Power::from_decawatts(400)]));
    }
}
