//! What the doors answer themselves, held against the description of the API.

use drived_doors::{
    LINKS, Role, TOKENS,
    testing::{Asked, Rig, START, STOPS},
};

use crate::api::{described, stops, testing::validate};

#[test]
fn what_the_doors_are_tested_with_stops_as_the_api_does() {
    let sorted = |mut all: Vec<&'static str>| {
        all.sort_unstable();
        all
    };
    assert_eq!(sorted(stops()), sorted(STOPS.to_vec()));
}

#[tokio::test]
async fn login_and_logout_are_answered_as_the_document_says() {
    let rig = Rig::new("described");
    let token = rig.token("panel", Role::Operate);
    let document = described();
    let right = format!("{{\"token\": \"{token}\"}}");
    for (path, body, status) in [
        ("/api/v1/login", right.as_str(), 200),
        ("/api/v1/login", "{\"token\": \"drv_wrong\"}", 401),
        ("/api/v1/login", "nonsense", 400),
        ("/api/v1/logout", "{}", 200),
    ] {
        let answer = rig.ask(&Asked { method: "POST", path, body, headers: &[] }).await;
        assert_eq!(answer.status.as_u16(), status, "{path} {body}");
        let kind = answer.headers["content-type"].to_str().unwrap();
        let described = &document["paths"][path]["post"]["responses"][status.to_string()]["content"][kind];
        let told = serde_json::from_str(&answer.body).unwrap();
        assert!(described.is_object(), "{path} {status} {kind} is not described");
        validate(&document, &described["schema"], &told, path);
    }
    let schema =
        &document["paths"]["/api/v1/login"]["post"]["requestBody"]["content"]["application/json"]["schema"];
    validate(&document, schema, &serde_json::from_str(&right).unwrap(), "the body");
}

#[tokio::test]
async fn a_link_and_the_session_by_its_code_are_answered_as_the_document_says() {
    let rig = Rig::new("link-described");
    let document = described();
    let schema = |path: &str, status: &str, kind: &str| {
        document["paths"][path]["post"]["responses"][status]["content"][kind]["schema"].clone()
    };
    let new = Asked { path: LINKS, body: r#"{"name":"anna","role":"view","days":3}"#, ..START };
    let told: serde_json::Value = serde_json::from_str(&rig.ask_on_socket(&new).await.body).unwrap();
    validate(&document, &schema(LINKS, "200", "application/json"), &told, LINKS);
    let code = told["link"].as_str().unwrap().rsplit('/').next().unwrap();
    let login = Asked { path: "/api/v1/login", body: &format!("{{\"code\":\"{code}\"}}"), ..START };
    let told = serde_json::from_str(&rig.ask(&login).await.body).unwrap();
    validate(&document, &schema("/api/v1/login", "200", "application/json"), &told, "a code");
    let refused = serde_json::from_str(&rig.ask(&new).await.body).unwrap();
    validate(&document, &schema(LINKS, "403", "application/problem+json"), &refused, LINKS);
}

#[tokio::test]
async fn a_token_that_is_made_over_the_socket_is_answered_as_the_document_says() {
    let rig = Rig::new("token-described");
    let new = Asked { path: TOKENS, body: r#"{"name":"panel","role":"operate"}"#, ..START };
    let told = serde_json::from_str(&rig.ask_on_socket(&new).await.body).unwrap();
    let document = described();
    let schema =
        &document["paths"][TOKENS]["post"]["responses"]["200"]["content"]["application/json"]["schema"];
    validate(&document, schema, &told, TOKENS);
}
