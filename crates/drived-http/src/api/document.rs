//! The description of the API, OpenAPI 3.1, made from the table of routes and from the types.

use schemars::{SchemaGenerator, generate::SchemaSettings};
use serde_json::{Map, Value, json};

use super::{
    problem::Problem,
    route::{Answer, Parameter, Route},
};

/// Where it is served.
pub(super) const PATH: &str = "/api/v1/openapi.json";

/// The document of these routes.
pub(super) fn of(routes: &[Route]) -> Value {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.meta_schema = None);
    // What is said and what is taken differ in what has to be there.
    let bodies = settings.clone().for_deserialize().with(|settings| settings.inline_subschemas = true);
    let answers = settings.for_serialize();
    let answers = answers.with(|settings| settings.definitions_path = "/components/schemas".into());
    let (mut bodies, mut generator) = (bodies.into_generator(), answers.into_generator());
    let mut paths: Map<String, Value> = Map::new();
    for route in routes {
        let operation = operation(route, &mut generator, &mut bodies);
        let methods = paths.entry(route.path).or_insert_with(|| json!({}));
        if let Value::Object(methods) = methods {
            methods.insert(route.method.as_str().to_lowercase(), operation);
        }
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "drived",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "Variable-speed drives over Modbus: what they do, and commands with a known outcome. \
                Numbers are in the unit that their key ends with. Every value has an age and a quality.",
            "license": { "name": "MIT OR Apache-2.0" }
        },
        "paths": paths,
        "components": {
            "schemas": generator.take_definitions(true),
            "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } }
        },
        "security": [{}, { "token": [] }]
    })
}

fn operation(route: &Route, generator: &mut SchemaGenerator, bodies: &mut SchemaGenerator) -> Value {
    let in_path = route.path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    let mut parameters: Vec<Value> = in_path
        .map(|name| json!({ "name": name, "in": "path", "required": true, "schema": { "type": "string" } }))
        .collect();
    parameters.extend(route.query.iter().map(|&Parameter { name, about, kind }| {
        json!({ "name": name, "in": "query", "description": about, "schema": { "type": kind } })
    }));
    let mut responses: Map<String, Value> = Map::new();
    for Answer { status, about, content, describe } in &route.answers {
        let schema = describe.map(|describe| json!({ "schema": describe(generator) })).unwrap_or_default();
        let schema = if schema.is_null() { json!({}) } else { schema };
        responses.insert(
            status.to_string(),
            json!({ "description": about, "content": content_of(content, schema) }),
        );
    }
    let problem = generator.subschema_for::<Problem>();
    for status in &route.problems {
        let about =
            axum::http::StatusCode::from_u16(*status).ok().and_then(|status| status.canonical_reason());
        let content = json!({ "application/problem+json": { "schema": problem } });
        responses.insert(status.to_string(), json!({ "description": about, "content": content }));
    }
    let mut operation = json!({ "summary": route.about, "parameters": parameters, "responses": responses });
    if let (Some(describe), Value::Object(operation)) = (route.body, &mut operation) {
        let content = json!({ "application/json": { "schema": describe(bodies) } });
        operation.insert("requestBody".to_owned(), json!({ "content": content }));
    }
    operation
}

fn content_of(kind: &str, schema: Value) -> Value {
    if kind.is_empty() { json!({}) } else { json!({ kind: schema }) }
}
