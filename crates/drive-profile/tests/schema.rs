//! The schema for editors, by somebody else's validator: it lets pass what is a profile, and nothing that has other keys or leaves one out.

use drive_profile::{schema, shipped};
use serde_json::Value;

fn value(text: &str) -> Value {
    toml::from_str(text).expect("it is TOML")
}

#[test]
fn each_profile_that_is_shipped_is_one_by_the_schema_and_none_with_another_key_or_without_one() {
    let validator = jsonschema::validator_for(schema().as_value()).expect("it is a schema");
    for (name, text) in shipped::TEXTS {
        let profile = value(text);
        let errors: Vec<String> = validator
            .iter_errors(&profile)
            .map(|error| format!("{}: {error}", error.instance_path()))
            .collect();
        assert!(errors.is_empty(), "{name}: {}", errors.join("\n"));
        let mut other = profile.clone();
        other["colour"] = Value::from("red");
        assert!(!validator.is_valid(&other), "{name}: a key that there is none of");
        let mut without = profile;
        without.as_object_mut().expect("it is a table").remove("watchdog");
        assert!(!validator.is_valid(&without), "{name}: a question that is left in silence");
    }
}
