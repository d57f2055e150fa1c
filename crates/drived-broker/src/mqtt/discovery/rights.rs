//! What Home Assistant may do.

use super::super::Face;
use drived_doors::{Rights, Role};

/// How Home Assistant is called among the commanders, where they are named.
const COMMANDER: &str = "homeassistant";

/// What Home Assistant may do.
pub(super) fn rights(face: &Face) -> Rights {
    let config = &face.config;
    let role = match said(face) {
        Some(name) => config.commanders.get(name).copied(),
        None if config.commanders.is_empty() => Some(Role::Operate),
        None => config.commanders.get("mqtt").copied(),
    };
    role.filter(|_| config.commands).map_or(Rights::NONE, Role::rights)
}

/// The name by which Home Assistant commands, where its topics have one.
pub(super) fn said(face: &Face) -> Option<&'static str> {
    face.config.commanders.contains_key(COMMANDER).then_some(COMMANDER)
}
