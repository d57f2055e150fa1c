//! An object in JSON as it was written: with every value of a key that stands there twice.

use std::{
    collections::{BTreeMap, HashSet},
    fmt,
};

use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

/// The members of an object, in their order.
#[derive(Debug, Clone, Default)]
pub struct Object {
    members: Vec<(String, Value)>,
    twice: Option<String>,
    null: Option<String>,
}

impl Object {
    /// Reads an object; `None` where it is something else.
    ///
    /// # Errors
    /// It is no JSON.
    pub fn read(text: &[u8]) -> serde_json::Result<Option<Self>> {
        Ok(match serde_json::from_slice(text)? {
            Node::Object(object) => Some(object),
            Node::Other(..) => None,
        })
    }

    /// The members with which a text begins as an object, as far as they are whole; what is no text in them is replaced. For what may be
    /// understood of something cut off, and for nothing that moves a motor.
    #[must_use]
    pub fn begun(text: &[u8]) -> Self {
        let text = String::from_utf8_lossy(text);
        let mut begun = Self::default();
        // Where it ends is no matter: what was read until then stands.
        let _ = serde_json::Deserializer::from_str(&text).deserialize_map(Members(&mut begun));
        begun
    }

    pub fn members(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.members.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// Every value of a key.
    pub fn all<'a>(&'a self, key: &'a str) -> impl Iterator<Item = &'a Value> {
        self.members().filter(move |(known, _)| *known == key).map(|(_, value)| value)
    }

    /// The value of a key that stands there once.
    pub fn one<'a>(&'a self, key: &'a str) -> Option<&'a Value> {
        let mut values = self.all(key);
        values.next().filter(|_| values.next().is_none())
    }

    /// The path of the first key that stands twice in its object, such as `setpoint.frequency_hz`.
    pub fn twice(&self) -> Option<&str> {
        self.twice.as_deref()
    }

    /// The path of the first key whose value is `null`.
    pub fn null(&self) -> Option<&str> {
        self.null.as_deref()
    }

    /// The last value of each key.
    pub fn into_members(self) -> Map<String, Value> {
        self.members.into_iter().collect()
    }

    /// For somebody who reads it later: a key that stands there twice has all its values.
    pub fn shown(&self) -> Value {
        let mut values: BTreeMap<&str, Vec<Value>> = BTreeMap::new();
        for (key, value) in self.members() {
            values.entry(key).or_default().push(value.clone());
        }
        let shown = |(key, mut values): (&str, Vec<Value>)| {
            let value = if values.len() == 1 { values.remove(0) } else { Value::Array(values) };
            (key.to_owned(), value)
        };
        Value::Object(values.into_iter().map(shown).collect())
    }

    /// Notes what is wrong in a member, which is known already or not.
    fn note(&mut self, key: &str, is_known: bool, node: Node) -> Value {
        let within = |path: String| format!("{key}.{path}");
        let (value, twice, null) = node.parts();
        let twice = if is_known { Some(key.to_owned()) } else { twice.map(within) };
        let null = if value.is_null() { Some(key.to_owned()) } else { null.map(within) };
        self.twice = self.twice.take().or(twice);
        self.null = self.null.take().or(null);
        value
    }
}

/// Any value, with what is wrong in the objects within.
enum Node {
    Object(Object),
    Other(Value, Option<String>, Option<String>),
}

impl Node {
    fn parts(self) -> (Value, Option<String>, Option<String>) {
        match self {
            Self::Object(Object { members, twice, null }) => {
                (Value::Object(members.into_iter().collect()), twice, null)
            }
            Self::Other(value, twice, null) => (value, twice, null),
        }
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reading)
    }
}

impl From<Value> for Node {
    fn from(value: Value) -> Self {
        Self::Other(value, None, None)
    }
}

struct Reading;

impl<'de> Visitor<'de> for Reading {
    type Value = Node;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value in JSON")
    }

    fn visit_unit<E>(self) -> Result<Node, E> {
        Ok(Value::Null.into())
    }

    fn visit_bool<E>(self, value: bool) -> Result<Node, E> {
        Ok(Value::Bool(value).into())
    }

    fn visit_u64<E>(self, number: u64) -> Result<Node, E> {
        Ok(Value::from(number).into())
    }

    fn visit_i64<E>(self, number: i64) -> Result<Node, E> {
        Ok(Value::from(number).into())
    }

    fn visit_f64<E>(self, number: f64) -> Result<Node, E> {
        Ok(Number::from_f64(number).map_or(Value::Null, Value::Number).into())
    }

    fn visit_str<E>(self, text: &str) -> Result<Node, E> {
        Ok(Value::from(text).into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Node, A::Error> {
        let (mut elements, mut within) = (Vec::new(), Object::default());
        while let Some(node) = sequence.next_element()? {
            let value = within.note(&elements.len().to_string(), false, node);
            elements.push(value);
        }
        Ok(Node::Other(Value::Array(elements), within.twice, within.null))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Node, A::Error> {
        let mut object = Object::default();
        Members(&mut object).visit_map(map)?;
        Ok(Node::Object(object))
    }
}

/// Reads members into an object, which has those before an error.
struct Members<'a>(&'a mut Object);

impl<'de> Visitor<'de> for Members<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object in JSON")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut known = HashSet::new();
        while let Some((key, node)) = map.next_entry::<String, Node>()? {
            let is_known = !known.insert(key.clone());
            let value = self.0.note(&key, is_known, node);
            self.0.members.push((key, value));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    #[test]
    fn a_key_that_stands_twice_is_found_wherever_it_is() {
        for (text, twice, null) in [
            (r#"{"a": 1, "b": {"c": 2, "c": 3}}"#, Some("b.c"), None),
            (r#"{"a": [0, {"c": 2, "c": null}]}"#, Some("a.1.c"), Some("a.1.c")),
            (r#"{"a": 1, "a": 1}"#, Some("a"), None),
            (r#"{"a": {"b": null}}"#, None, Some("a.b")),
            (r#"{"a": 1, "b": {"a": 1}}"#, None, None),
        ] {
            let object = Object::read(text.as_bytes()).unwrap().unwrap();
            assert_eq!((object.twice(), object.null()), (twice, null), "{text}");
        }
        let object = Object::read(br#"{"a": 1, "a": 2, "b": 3}"#).unwrap().unwrap();
        assert_eq!((object.one("a"), object.one("b")), (None, Some(&json!(3))));
        assert_eq!(object.shown(), json!({"a": [1, 2], "b": 3}));
    }

    #[test]
    fn what_a_text_begins_with_is_known_up_to_where_it_is_cut_off() {
        for (text, members) in [
            (&br#"{"a": 1, "b": {"c": 2"#[..], vec![("a", json!(1))]),
            (br#"{"a": 1, "b": 2"#, vec![("a", json!(1)), ("b", json!(2))]),
            (br#"{"a": 1}x"#, vec![("a", json!(1))]),
            (b"{\"a\": \"\xFF\"", vec![("a", json!("\u{FFFD}"))]),
            (br#"{"a": "#, vec![]),
            (br#"[{"a": 1}"#, vec![]),
            (b"", vec![]),
        ] {
            let begun = Object::begun(text);
            let known: Vec<_> = begun.members().map(|(key, value)| (key, value.clone())).collect();
            assert_eq!(known, members, "{}", text.escape_ascii());
        }
    }

    proptest! {
        /// Whatever is no key twice reads as the common reader reads it.
        #[test]
        fn an_object_reads_as_everybody_reads_it(members in proptest::collection::btree_map(
            "[a-z]{1,3}", prop_oneof![any::<f64>().prop_filter("finite", |n| n.is_finite()).prop_map(|n| json!(n)),
                any::<i64>().prop_map(|n| json!(n)), ".*".prop_map(|t| json!(t)), Just(json!([1, {"a": true}]))], 0..5)
        ) {
            let text = json!(members).to_string();
            let object = Object::read(text.as_bytes()).unwrap().unwrap();
            prop_assert_eq!(object.twice(), None);
            prop_assert_eq!(Value::Object(object.into_members()), serde_json::from_str::<Value>(&text).unwrap());
        }
    }
}
