//! Which profile a person means.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use drive_profile::Profile;

use drived_config::profiles;
use drived_words::failure::Failure;

/// The profile of a key, or of a file: what has a dot or a slash is one.
pub(crate) fn named(said: &str) -> Result<(Arc<Profile>, Option<PathBuf>), Failure> {
    if said.contains(['.', '/', '\\']) {
        let file = Path::new(said);
        let profile = profiles::profile(file).map_err(|error| Failure::Input(error.to_string()))?;
        return Ok((Arc::new(profile), Some(file.to_owned())));
    }
    profiles::find(said).ok_or_else(|| {
        Failure::Input(format!("there is no profile {said:?}: drived profile list has them, or name a file, such as ./{said}.toml"))
    })
}
