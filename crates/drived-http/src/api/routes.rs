//! The table of routes: what the router serves and what the document describes, in one place, so that they are the same.

mod commands;
mod elsewhere;
mod past;
mod reads;

use self::{commands::commands, past::pasts, reads::reads};
use super::route::{Answer, Route};

pub(super) use self::elsewhere::{demo_routes, door_routes, reload_routes, setup_routes};

const PCAPNG: Answer =
    Answer { status: 200, about: "a pcapng file", content: "application/x-pcapng", describe: None };

/// All of them.
pub(super) fn routes() -> Vec<Route> {
    let mut routes = reads();
    routes.extend(pasts());
    routes.extend(commands());
    routes
}
