//! The body of a command for drives that somebody has selected: their names beside what any command says.

use std::collections::BTreeSet;

use axum::{extract::FromRequest, extract::Request};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de::DeserializeOwned, de::Error as _};
use serde_json::{Map, Value};

use super::{ask::Stopping, problem::Problem};
use drived_plant::plant::commands::Said;

/// A body with the names of the drives that are meant.
#[derive(Debug, JsonSchema)]
pub(super) struct Selected<T> {
    /// Their names, at least one.
    #[schemars(length(min = 1))]
    pub(super) drives: Vec<String>,
    #[serde(flatten)]
    pub(super) body: T,
}

impl<'de, T: DeserializeOwned> Deserialize<'de> for Selected<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut members = Map::deserialize(deserializer)?;
        let drives = names(members.remove("drives").as_ref()).map_err(D::Error::custom)?;
        let body = serde_json::from_value(Value::Object(members)).map_err(D::Error::custom)?;
        Ok(Self { drives, body })
    }
}

/// A stop of drives that are named: it is one whatever else it says.
pub(super) struct StoppingSelected(pub(super) Vec<String>, pub(super) Said);

impl<S: Send + Sync> FromRequest<S> for StoppingSelected {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let Stopping(said) = Stopping::from_request(request, state).await?;
        let drives = names(said.body.get("drives")).map_err(Problem::unprocessable)?;
        Ok(Self(drives, said))
    }
}

/// Every name once, in the order in which they are said.
fn names(said: Option<&Value>) -> Result<Vec<String>, String> {
    let expected = || "drives: expected the names of one drive or several".to_owned();
    let mut names: Vec<String> = said.and_then(|said| Vec::deserialize(said).ok()).ok_or_else(expected)?;
    let mut known = BTreeSet::new();
    names.retain(|name| known.insert(name.clone()));
    if names.is_empty() { Err(expected()) } else { Ok(names) }
}
