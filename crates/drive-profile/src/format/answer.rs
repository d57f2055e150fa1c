//! An answer to a question of the format: [`Answer`].

use std::{collections::BTreeMap, fmt, marker::PhantomData};

use serde::{
    Deserialize, Deserializer,
    de::{
        Error, MapAccess, SeqAccess, Visitor,
        value::{MapAccessDeserializer, SeqAccessDeserializer},
    },
};

use super::{FedBy, Spanned};

/// What a file says to a question. A question is never passed over in silence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer<T> {
    /// It says this.
    Given(T),
    /// The drive has none: its document says so, or shows it.
    None,
    /// Nobody knows.
    Unknown,
}

impl<T> Answer<T> {
    /// What was said.
    #[must_use]
    pub const fn given(&self) -> Option<&T> {
        match self {
            Self::Given(given) => Some(given),
            Self::None | Self::Unknown => None,
        }
    }

    /// Whether nobody knows.
    #[must_use]
    pub const fn is_unknown(&self) -> bool {
        matches!(self, Self::Unknown)
    }
}

#[cfg(feature = "schemars")]
impl<T: schemars::JsonSchema> schemars::JsonSchema for Answer<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("AnswerOf{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let given = generator.subschema_for::<T>();
        schemars::json_schema!({ "anyOf": [given, { "enum": ["none", "unknown"] }] })
    }
}

/// An answer without its place.
struct Raw<T>(Answer<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Raw<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Said(PhantomData)).map(Self)
    }
}

/// The place is asked for first: what stands behind it is not the file's own deserializer any more, which alone knows the lines.
impl<'de, T: Deserialize<'de>> Deserialize<'de> for Answer<Spanned<T>> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let said = Spanned::<Raw<T>>::deserialize(deserializer)?;
        let span = said.span();
        Ok(match said.into_inner().0 {
            Answer::Given(given) => Self::Given(Spanned::new(span, given)),
            Answer::None => Self::None,
            Answer::Unknown => Self::Unknown,
        })
    }
}

/// Answers whose place nobody needs.
macro_rules! plain {
    ($([$($of:ident)?] $type:ty),+ $(,)?) => {
        $(impl<'de $(, $of: Deserialize<'de>)?> Deserialize<'de> for Answer<$type> {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                Raw::deserialize(deserializer).map(|raw| raw.0)
            }
        })+
    };
}

plain!([] bool, [] u8, [] u16, [] i64, [] String, [] FedBy, [] BTreeMap<String, String>, [T] Vec<T>);

/// What may stand there: one of the two words, or what the question asks for.
struct Said<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Said<T> {
    type Value = Answer<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an answer, \"none\" or \"unknown\"")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Answer<T>, E> {
        match text {
            "none" => Ok(Answer::None),
            "unknown" => Ok(Answer::Unknown),
            text => T::deserialize(serde::de::value::StrDeserializer::new(text)).map(Answer::Given),
        }
    }

    fn visit_bool<E: Error>(self, yes: bool) -> Result<Answer<T>, E> {
        T::deserialize(serde::de::value::BoolDeserializer::new(yes)).map(Answer::Given)
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Answer<T>, E> {
        T::deserialize(serde::de::value::I64Deserializer::new(number)).map(Answer::Given)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Answer<T>, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Answer::Given)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Answer<T>, A::Error> {
        T::deserialize(SeqAccessDeserializer::new(seq)).map(Answer::Given)
    }
}
