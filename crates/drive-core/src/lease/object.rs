//! A verdict as an object: its word, what is lacking, and the sentence.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Lack, Verdict};
use crate::{refusal::Refusal, serialize::text};

pub(crate) fn serialize<S: Serializer>(verdict: &Option<Verdict>, serializer: S) -> Result<S::Ok, S::Error> {
    verdict.as_ref().map(VerdictObject::from).serialize(serializer)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Verdict>, D::Error> {
    Ok(Option::<VerdictObject>::deserialize(deserializer)?.map(Verdict::from))
}

#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub(crate) struct VerdictObject {
    verdict: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    lacks: Option<Lack>,
    #[serde(skip_serializing_if = "Option::is_none")]
    because: Option<String>,
}

impl From<&Verdict> for VerdictObject {
    fn from(verdict: &Verdict) -> Self {
        let lacks = match verdict {
            Verdict::NotInForce { lacks, .. } => Some(*lacks),
            Verdict::InForce | Verdict::NotKnown => None,
        };
        let because = verdict.because().map(|because| because.to_string());
        Self { verdict: verdict.word().to_owned(), lacks, because }
    }
}

impl From<VerdictObject> for Verdict {
    fn from(object: VerdictObject) -> Self {
        let VerdictObject { verdict, lacks, because } = object;
        match (&*verdict, lacks) {
            ("in_force", _) => Self::InForce,
            ("not_in_force", Some(lacks)) => {
                let because = because.unwrap_or_default();
                let because = text(&because);
                // The sentence is what is told of a reason.
                Self::lacks(lacks, Refusal::Settings(because))
            }
            _ => Self::NotKnown,
        }
    }
}
