//! A file that is there as a whole, in its old or in its new form, also when the power fails.

use std::{
    fs,
    io::{self, Write as _},
    path::Path,
};

/// Replaces a file, and makes its folder where there is none.
pub(crate) fn write(file: &Path, content: &[u8]) -> io::Result<()> {
    if let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder)?;
    }
    let mut beside = file.as_os_str().to_owned();
    beside.push(".new");
    let mut new = fs::File::create(&beside)?;
    new.write_all(content)?;
    new.sync_all()?;
    fs::rename(&beside, file)
}
