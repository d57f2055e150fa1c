//! The faces that a program knows.

use std::sync::{PoisonError, RwLock};

use crate::Face;

/// The tables and keys of the file that are the daemon's own.
pub const OWN: &[&str] = &[
    "snapshots",
    "shutdown",
    "state",
    "tokens",
    "audit",
    "watchdogs",
    "profiles",
    "lines",
    "drives",
    "defaults",
    "groups",
    "http",
    "socket",
];

static ADDED: RwLock<Vec<&'static dyn Face>> = RwLock::new(Vec::new());

/// Makes the program know a face, before it reads a file.
///
/// # Errors
/// Its table is the daemon's own, or another face's.
pub fn add(face: &'static dyn Face) -> Result<(), TableTaken> {
    let mut added = ADDED.write().unwrap_or_else(PoisonError::into_inner);
    let table = face.table();
    if OWN.contains(&table) || added.iter().any(|other| other.table() == table) {
        return Err(TableTaken(table));
    }
    added.push(face);
    Ok(())
}

/// The faces that the program knows, in the order in which they were added.
#[must_use]
pub fn all() -> Vec<&'static dyn Face> {
    ADDED.read().unwrap_or_else(PoisonError::into_inner).clone()
}

/// A face with a table that there is already.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a face with the table {0:?}: there is one of this name already")]
pub struct TableTaken(pub &'static str);
