//! What a program may have besides: the routes of a demonstration, of the doors, of a reload and of the first hour.

use axum::http::Method;
use drived_doors::{
    LINKS, LOGIN, LOGOUT, LoginBody, MadeLink, MadeToken, NewLink, NewToken, RemovedToken, Rotation,
    SessionView, TOKENS, TokensView,
};
use schemars::{JsonSchema, SchemaGenerator};

use crate::api::{
    demo, reload,
    route::{Parameter, Route},
    setup::{self, SetupChanges, SetupView},
};

const DRY_RUN: Parameter =
    Parameter { name: "dry_run", about: "only say what would change", kind: "boolean" };

/// What a demonstration has besides.
pub(in crate::api) fn demo_routes() -> Vec<Route> {
    vec![
        Route::deed::<_, _, demo::Trip>("/api/v1/demo/trip", demo::trip, "Trips a simulated drive"),
        Route::deed::<_, _, demo::Cable>("/api/v1/demo/cable", demo::cable, "Pulls or plugs in a cable"),
    ]
}

/// What the doors serve themselves.
pub(in crate::api) fn door_routes() -> Vec<Route> {
    let post = |path, about| {
        let mut route =
            Route::elsewhere(Method::POST, path, about).answers::<SessionView>(200, "who the caller is now");
        route.problems.extend([413, 415]);
        route
    };
    let mut login = post(
        LOGIN,
        "Begins a session by a token, or by a code that is good once; the answer sets its cookie",
    )
    .or_problem(422)
    .or_problem(429)
    .or_problem(503);
    login.body = Some(SchemaGenerator::subschema_for::<LoginBody>);
    let on_socket = |mut route: Route| {
        route.problems.extend([404, 413, 415, 422, 503]);
        route
    };
    let mut new = on_socket(
        Route::elsewhere(Method::POST, TOKENS, "Makes a token, over the control socket")
            .answers::<MadeToken>(200, "what it is, told this once"),
    );
    new.body = Some(SchemaGenerator::subschema_for::<NewToken>);
    let mut link = on_socket(
        Route::elsewhere(
            Method::POST,
            LINKS,
            "Makes a link by which a browser begins a session, over the control socket",
        )
        .answers::<MadeLink>(200, "the link, told this once"),
    );
    link.body = Some(SchemaGenerator::subschema_for::<NewLink>);
    let removed = "/api/v1/tokens/{name}";
    let mut other = on_socket(
        Route::elsewhere(
            Method::PUT,
            removed,
            "Replaces a token by another of its name, over the control socket",
        )
        .answers::<MadeToken>(200, "the other one, told this once"),
    );
    other.body = Some(SchemaGenerator::subschema_for::<Rotation>);
    vec![
        login,
        other,
        post(LOGOUT, "Ends the session of the cookie"),
        on_socket(
            Route::elsewhere(Method::GET, TOKENS, "All tokens, over the control socket")
                .answers::<TokensView>(200, "their names and roles"),
        ),
        new,
        link,
        on_socket(
            Route::elsewhere(Method::DELETE, removed, "Removes a token, over the control socket")
                .answers::<RemovedToken>(200, "it is no more"),
        ),
    ]
}

/// What a program with a configuration has besides.
pub(in crate::api) fn reload_routes() -> Vec<Route> {
    let mut route =
        Route::elsewhere(Method::POST, reload::PATH, "Reads the configuration again, for engineers")
            .answers::<reload::Changes>(200, "what was done, or would be")
            .with_query(DRY_RUN);
    route.problems.extend([413, 415, 422, 500]);
    vec![route]
}

/// How drives come into a program with a configuration.
pub(in crate::api) fn setup_routes() -> Vec<Route> {
    fn post<B: JsonSchema, A: JsonSchema>(
        path: &'static str,
        about: &'static str,
        told: &'static str,
    ) -> Route {
        let mut route = Route::elsewhere(Method::POST, path, about).answers::<A>(200, told);
        route.body = Some(SchemaGenerator::subschema_for::<B>);
        route.problems.extend([413, 415, 422, 500]);
        route
    }
    let view = "ports, families, the scan that is under way or was last, and the drives that were added";
    let done = "what was done, a sentence each";
    vec![
        Route::elsewhere(Method::GET, setup::PATH, "How the first hour stands")
            .answers::<SetupView>(200, view),
        post::<setup::ScanWanted, SetupView>(
            setup::SCAN,
            "Begins to scan a port; nothing is written by it",
            view,
        ),
        post::<setup::Cancel, SetupView>(setup::CANCEL, "Gives up the scan that is under way", view),
        post::<setup::DrivesWanted, SetupChanges>(
            setup::DRIVES,
            "Takes drives up, to be watched, and writes them down",
            done,
        ),
        post::<setup::ControlWanted, SetupChanges>(
            setup::CONTROL,
            "Has commands taken for a drive that was added, or not any more",
            done,
        ),
    ]
}
