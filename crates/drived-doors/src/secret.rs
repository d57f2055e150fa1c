//! Files that hold a secret: read by whom they are for.

use std::path::Path;

/// What stands in the file of a secret, without the end of its line.
///
/// # Errors
///
/// It is missing, or can be read by everybody.
pub fn secret(file: &Path) -> Result<String, String> {
    private(file)?;
    let text = std::fs::read_to_string(file).map_err(|error| of(file, &error))?;
    Ok(text.trim_end_matches(['\r', '\n']).to_owned())
}

/// Refuses a secret that everybody on this machine can read.
pub fn private(file: &Path) -> Result<(), String> {
    #[cfg(unix)]
    if std::fs::metadata(file)
        .is_ok_and(|known| std::os::unix::fs::PermissionsExt::mode(&known.permissions()) & 0o007 != 0)
    {
        return Err(of(file, &format_args!("everybody can read it: chmod o= {}", file.display())));
    }
    Ok(())
}

/// What is wrong with a file, by its name.
pub(super) fn of(file: &Path, error: &dyn std::fmt::Display) -> String {
    format!("{}: {error}", file.display())
}
