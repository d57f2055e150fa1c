//! What is at an address, and in which words it is told.

use drive_bus::evidence::{Certainty, Defect, Finding};
use drive_core::{Capabilities, Identity};
use drive_families::Family;
use serde_json::{Value, json};

/// Read device identification.
const IDENTIFICATION: u8 = 0x2B;

/// What is at an address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Answer {
    /// Something answers that cannot be understood.
    Damaged(String),
    /// Something answers, and it could be a drive of these families.
    Slave(Vec<Likeness>),
    /// Two slaves may answer, by what the line has found.
    Two {
        /// What one of them could be, as far as its answers come intact.
        alike: Vec<Likeness>,
        /// How that shows.
        finding: Finding,
    },
}

/// A family that a slave could be of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Likeness {
    pub family: Family,
    /// Whether it says so itself, by its name.
    pub certain: bool,
    /// What it says it is.
    pub identity: Option<Identity>,
}

impl Likeness {
    /// Vendor, model, firmware, and of what registers tell the rated power and current.
    pub(super) fn says(&self) -> Option<String> {
        let Identity { vendor, model, version, codes } = self.identity.as_ref()?;
        let names = [vendor, model, version].into_iter().flatten().map(|text| text.trim().to_owned());
        let Capabilities { rows, .. } = self.family.capabilities();
        let rating = codes.iter().filter_map(|code| {
            let row = rows.iter().find(|row| row.address == code.address)?;
            let told = row
                .choice(code.value)
                .map_or_else(|| row.show(code.value), |choice| choice.meaning.to_owned());
            [" kW", " A"].iter().any(|unit| told.ends_with(unit)).then_some(told)
        });
        let names: Vec<String> = names.filter(|word| !word.is_empty()).collect();
        let parts: Vec<String> =
            [names.join(" ")].into_iter().filter(|names| !names.is_empty()).chain(rating).collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// What speaks against it: that it has not said its name, by which the drives of this family are known.
    pub(super) fn doubt(&self) -> Option<String> {
        let tells = self.family.capabilities().functions.contains(&IDENTIFICATION);
        let model = self.identity.as_ref().and_then(|identity| identity.model.as_ref());
        (tells && !self.certain && model.is_none()).then(|| {
            format!("it does not say its name (function 43/14), as each {} does by its manual", self.family)
        })
    }

    fn object(&self) -> Value {
        json!({ "family": self.family.to_string(), "certain": self.certain, "identity": self.identity })
    }
}

impl Answer {
    /// The family of a drive that is the only likely one.
    pub(super) fn only(&self) -> Option<Family> {
        match self {
            Self::Slave(alike) => match &alike[..] {
                [only] => Some(only.family),
                _ => None,
            },
            Self::Damaged(_) | Self::Two { .. } => None,
        }
    }

    /// For a person.
    pub(super) fn words(&self) -> String {
        match self {
            Self::Damaged(why) => {
                format!("{why}: something else is sending, or speed, format or protocol are others")
            }
            Self::Slave(alike) => described(alike),
            Self::Two { alike, finding } => {
                let what = match finding.defect {
                    Defect::AnswersTwice => "EACH ANSWER COMES TWICE",
                    _ => "TWO DRIVES SEEM TO HAVE THIS ADDRESS",
                };
                let seen =
                    if alike.is_empty() { String::new() } else { format!(", one {}", described(alike)) };
                let other = match finding.certainty {
                    Certainty::CannotBeToldFrom(other) => format!("; a master cannot tell it from {other}"),
                    _ => String::new(),
                };
                let next = finding.next().first().copied().unwrap_or_default();
                format!("{what}{seen}: {finding}{other}. Next: {next}")
            }
        }
    }

    /// What is there, in one word.
    pub(super) fn verdict(&self) -> &'static str {
        match self {
            Self::Damaged(_) => "damaged",
            Self::Slave(alike) if alike.is_empty() => "unknown_slave",
            Self::Slave(_) => "drive",
            Self::Two { finding, .. } => finding.defect.name(),
        }
    }

    /// What it could be.
    pub(super) fn alike(&self) -> &[Likeness] {
        match self {
            Self::Damaged(_) => &[],
            Self::Slave(alike) | Self::Two { alike, .. } => alike,
        }
    }

    /// For a program.
    pub(super) fn object(&self) -> Value {
        let why = match self {
            Self::Damaged(why) => Some(why.clone()),
            Self::Slave(_) => None,
            Self::Two { finding, .. } => Some(finding.to_string()),
        };
        let families: Vec<Value> = self.alike().iter().map(Likeness::object).collect();
        let mut object = json!({ "verdict": self.verdict(), "families": families });
        if let (Some(why), Some(object)) = (why, object.as_object_mut()) {
            object.insert("why".to_owned(), json!(why));
        }
        object
    }
}

/// A slave by what it looks like.
pub(super) fn described(alike: &[Likeness]) -> String {
    let one = |likeness: &Likeness| match likeness.says() {
        Some(says) => format!("{} ({says})", likeness.family),
        None => likeness.family.to_string(),
    };
    match alike {
        [] => {
            let mute = mute().map_or_else(String::new, |mute| format!(", unless {mute}"));
            format!("a Modbus slave, and no drive of a family that is known here{mute}")
        }
        [only] if only.certain => format!("{}, by its own words", one(only)),
        _ => {
            let families: Vec<String> = alike.iter().map(one).collect();
            let doubt = alike.iter().find_map(Likeness::doubt).map_or_else(String::new, |doubt| {
                let mute = mute().map_or_else(String::new, |mute| format!(", or {mute}"));
                format!("; {doubt}: it may be a drive that is not known here{mute}")
            });
            format!("likely {}, by its registers{doubt}", families.join(" or "))
        }
    }
}

/// The families whose drives are not guessed: nothing is found out by writing, and they read like others'.
fn mute() -> Option<String> {
    let mute = Family::all().into_iter().filter(|family| !family.tells_itself());
    let mute: Vec<String> = mute.map(|family| family.to_string()).collect();
    (!mute.is_empty()).then(|| format!("one of those that nothing tells from others: {}", mute.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn like(family: Family, certain: bool, model: Option<&str>) -> Likeness {
        let identity = model.map(|model| Identity { model: Some(model.to_owned()), ..Identity::default() });
        Likeness { family, certain, identity }
    }

    #[test]
    fn what_a_drive_says_of_itself_is_told_from_what_its_registers_look_like() {
        let sure = like(Family::ATV312, true, Some("ATV312HU15N4"));
        assert_eq!(described(&[sure]), "atv312 (ATV312HU15N4), by its own words");
        let (one, other) = (like(Family::ATV28, false, None), like(Family::ATV58, false, None));
        assert_eq!(described(std::slice::from_ref(&one)), "likely atv28, by its registers");
        assert_eq!(described(&[one, other]), "likely atv28 or atv58, by its registers");
        assert!(described(&[]).contains("no drive of a family"));
    }
}
