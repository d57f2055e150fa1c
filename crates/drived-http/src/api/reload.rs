//! Reading the configuration again, for engineers.

use axum::{
    Json, Router,
    extract::{Query, State, rejection::QueryRejection},
    http::StatusCode,
    routing::post,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ask::By, problem::Problem};
use drived_words::failure::Failure;

/// Reads the configuration again.
pub trait Reload: Clone + Send + Sync + 'static {
    /// Does what has changed in it, or with `dry_run` only says what that would be: one sentence each.
    ///
    /// # Errors
    /// [`Failure::Input`] with what is wrong in the file; the old configuration holds then. Others say what holds.
    fn reload(&self, dry_run: bool) -> impl Future<Output = Result<Vec<String>, Failure>> + Send;
}

#[derive(Debug, Deserialize)]
struct Asked {
    /// Only say what would change.
    #[serde(default)]
    dry_run: bool,
}

/// What a reload does.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
pub struct Changes {
    dry_run: bool,
    /// What was done, or would be, a sentence each.
    pub changes: Vec<String>,
}

/// Where it is served.
pub(super) const PATH: &str = "/api/v1/reload";

/// The [route](PATH) for a program that has a configuration.
pub fn reload_router<R: Reload>(reloader: R) -> Router {
    Router::new().route(PATH, post(reload::<R>)).with_state(reloader)
}

async fn reload<R: Reload>(
    State(reloader): State<R>,
    By(caller): By,
    asked: Result<Query<Asked>, QueryRejection>,
) -> Result<Json<Changes>, Problem> {
    // It may change what every drive is told.
    if !caller.rights.engineer || caller.scope.is_some() {
        return Err(Problem::lacks_right(&caller, "reload the configuration"));
    }
    let Query(Asked { dry_run }) = asked?;
    // Nobody who goes away leaves it half done.
    let reloading = tokio::spawn(async move { reloader.reload(dry_run).await });
    match reloading.await {
        Ok(Ok(changes)) => Ok(Json(Changes { dry_run, changes })),
        Ok(Err(Failure::Input(why))) => Err(Problem::unprocessable(why)),
        Ok(Err(failure)) => Err(Problem::new(StatusCode::INTERNAL_SERVER_ERROR, failure.to_string())),
        Err(error) => Err(Problem::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string())),
    }
}
