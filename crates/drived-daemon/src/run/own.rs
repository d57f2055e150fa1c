//! One folder, one daemon: what has to outlive a daemon is no longer its own where another one writes the same files.

use std::{
    fs::{File, TryLockError},
    path::Path,
};

use drived_config::kept::Kept;
use drived_words::failure::Failure;

/// The file of the state folder.
const FILE: &str = "lock";

/// Keeps others from the folder of what outlives the daemon, for as long as it is held; also a daemon that is killed gives it back.
/// `None`: there is no folder, or its disk takes no lock, as one that is only read.
///
/// # Errors
/// Another daemon has it.
pub(super) fn take(folder: Option<&Path>) -> Result<Option<File>, Failure> {
    let Some(folder) = folder else { return Ok(None) };
    let file = match Kept::at(&folder.join(FILE)).open_to_append() {
        Ok(file) => file,
        Err(error) => {
            tracing::warn!("{}: {error}: nothing keeps another daemon from this folder", folder.display());
            return Ok(None);
        }
    };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Err(Failure::Input(format!(
            "another daemon keeps in {} what has to outlive it, such as stops that are not confirmed: give this one a folder of its own by state = \"FOLDER\"",
            folder.display()
        ))),
        Err(TryLockError::Error(error)) => {
            tracing::warn!("{}: {error}: nothing keeps another daemon from this folder", folder.display());
            Ok(None)
        }
    }
}

#[cfg(test)]
mod tests {
    use drived_config::testing::Folder;

    use super::*;

    #[test]
    fn a_folder_has_one_daemon_at_a_time() {
        let place = Folder::new("own");
        let folder = place.file("state");
        let first = take(Some(&folder)).expect("nobody has it");
        let Err(Failure::Input(why)) = take(Some(&folder)) else { panic!("a second one has it") };
        assert!(why.contains("another daemon keeps in"), "{why}");
        drop(first);
        assert!(take(Some(&folder)).expect("it was given back").is_some());
        assert!(take(None).expect("nothing is kept").is_none());
    }
}
