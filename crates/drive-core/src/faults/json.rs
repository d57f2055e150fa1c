//! A fault for programs.

use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Fault, FaultEntry};
use crate::serialize::{text, there_is_room_for};

/// What the manual does not list has a code alone.
impl Serialize for Fault {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Unlisted {
            code: u16,
        }
        match self.entry {
            Some(entry) => FaultEntry { code: self.code, ..*entry }.serialize(serializer),
            None => Unlisted { code: self.code }.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Fault {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        struct Listed {
            code: u16,
            mnemonic: Option<String>,
            meaning: Option<String>,
            remedy: Option<String>,
        }
        let Listed { code, mnemonic, meaning, remedy } = Listed::deserialize(deserializer)?;
        let entry = mnemonic.zip(meaning).zip(remedy).and_then(|((mnemonic, meaning), remedy)| {
            let (mnemonic, meaning) = (text(&mnemonic), text(&meaning));
            let remedy = text(&remedy);
            kept(FaultEntry { code, mnemonic, meaning, remedy })
        });
        Ok(Self { code, entry })
    }
}

/// The entries that were read, each kept once for the life of the program; `None`: there is no room for this one.
fn kept(entry: FaultEntry) -> Option<&'static FaultEntry> {
    static ENTRIES: Mutex<Vec<&'static FaultEntry>> = Mutex::new(Vec::new());
    let mut entries = ENTRIES.lock().unwrap_or_else(PoisonError::into_inner);
    let known = entries.iter().copied().find(|known| **known == entry);
    known.or_else(|| {
        let kept: &'static FaultEntry =
            there_is_room_for(size_of::<FaultEntry>()).then(|| &*Box::leak(Box::new(entry)))?;
        entries.push(kept);
        Some(kept)
    })
}

#[cfg(feature = "schemars")]
impl schemars::JsonSchema for Fault {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Fault".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "type": "object",
            "properties": {
                "code": {"type": "integer"},
                "mnemonic": {"type": "string"},
                "meaning": {"type": "string"},
                "remedy": {"type": "string"}
            },
            "required": ["code"]
        })
    }
}
