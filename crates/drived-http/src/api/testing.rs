//! Answers held against the description of the API, for the tests of this crate and, by its path, of the daemon: no program is to be
//! built with a validator of schemas.

use serde_json::Value;

/// Validates against a schema of the document.
pub(crate) fn validate(document: &Value, schema: &Value, answer: &Value, what: &str) {
    let mut schema = schema.clone();
    schema["components"] = document["components"].clone();
    let validator = jsonschema::draft202012::options().build(&schema).unwrap();
    let errors: Vec<String> = validator
        .iter_errors(answer)
        .map(|error| format!("{} at {}", error, error.instance_path()))
        .collect();
    assert!(errors.is_empty(), "{what}: {errors:?} in {answer}");
}
