//! Drives from files: the profiles that are shipped, and those of a folder. Each becomes a family, and nothing above knows that it is from a file.
//!
//! A profile is known by its content. Read again, only a content that is new makes a new family; a drive that is open goes on by
//! the one with which it was opened.

use std::{
    collections::{BTreeMap, BTreeSet},
    ffi::OsStr,
    fmt, fs,
    io::Read as _,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use drive_families::{Family, NameTaken};
use drive_profile::{LONGEST, Profile, Refusals, definition, shipped};

/// The folder whose profiles every subcommand knows, beside those of a configuration.
pub const ENVIRONMENT: &str = "DRIVED_PROFILES";

/// The most files that a folder may have.
pub const MOST: usize = 4_096;

/// What was read in this process.
static KNOWN: Mutex<BTreeMap<String, Known>> = Mutex::new(BTreeMap::new());

/// A profile that was read.
#[derive(Debug, Clone)]
struct Known {
    family: Family,
    profile: Arc<Profile>,
    /// The file; `None`: it is shipped.
    file: Option<PathBuf>,
}

/// Makes the shipped profiles known. For the beginning of a program.
///
/// # Errors
/// A family of another origin has a name of theirs.
pub fn ship() -> Result<(), NameTaken> {
    for profile in shipped::all() {
        let profile = Arc::new(profile.clone());
        let family = Family::new(definition(&profile));
        family.add()?;
        keep(Known { family, profile, file: None });
    }
    Ok(())
}

/// The profiles of a folder, by their keys, and what of it is left out.
#[derive(Debug, Clone, Default)]
pub struct Folder {
    files: BTreeMap<String, PathBuf>,
    left_out: Vec<ProfilesError>,
}

impl Folder {
    /// Reads every `.toml` in a folder and in the folders in it, and makes what they say known in place of what they said before.
    ///
    /// A file that is no profile, or whose key another has, is left out alone: the motors of the others have to be stopped. Whoever
    /// names a drive of it is told why.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn read(folder: &Path) -> Result<Self, ProfilesError> {
        let mut left_out = Vec::new();
        let mut read: BTreeMap<String, (PathBuf, Profile)> = BTreeMap::new();
        let mut twice = BTreeSet::new();
        for file in files(folder)? {
            match profile(&file) {
                Ok(profile) => {
                    let key = profile.key().to_owned();
                    if let Some((other, _)) = read.insert(key.clone(), (file.clone(), profile)) {
                        twice.insert(key.clone());
                        left_out.push(ProfilesError::Twice { key, file, other });
                    }
                }
                Err(error) => left_out.push(error),
            }
        }
        // Which of two is meant nobody can tell: neither is taken.
        read.retain(|key, _| !twice.contains(key));
        let mut files = BTreeMap::new();
        for (key, (file, profile)) in read {
            if is_taken(&key) {
                left_out.push(ProfilesError::Taken { key, file });
                continue;
            }
            match take_up(Arc::new(profile), &file) {
                Ok(()) => {
                    Family::leave_out(&key, None);
                    files.insert(key, file);
                }
                Err(taken) => left_out.push(ProfilesError::Taken { key: taken.0.to_owned(), file }),
            }
        }
        for error in &left_out {
            if let Some(key) = error.key().filter(|key| !files.contains_key(key)) {
                Family::leave_out(&key, Some(error.to_string()));
            }
        }
        Ok(Self { files, left_out })
    }

    /// What is left out, each with its file and why.
    #[must_use]
    pub fn left_out(&self) -> &[ProfilesError] {
        &self.left_out
    }

    /// Why the drives of a family cannot be driven by this folder, although something is known of them: its file is left out.
    #[must_use]
    pub fn why_not(&self, family: Family) -> Option<String> {
        let key = family.capabilities().key;
        let error = self.left_out.iter().find(|error| error.key().is_some_and(|of| of == key))?;
        (!self.files.contains_key(key)).then(|| error.to_string())
    }

    /// Whether a family may be used by whoever reads this folder: one that comes from a file comes from one that is still there.
    #[must_use]
    pub fn has(&self, family: Family) -> bool {
        let key = family.capabilities().key;
        let file = of(key).and_then(|known| known.file);
        file.is_none_or(|file| self.files.contains_key(key) || said_by_environment(&file))
    }

    /// Their keys.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }
}

/// Reads the folder that the environment names, if it names one, and gives what is left out of it.
///
/// # Errors
/// As [`Folder::read`].
pub fn of_environment() -> Result<Vec<ProfilesError>, ProfilesError> {
    folder_of_environment().map_or(Ok(Vec::new()), |folder| Folder::read(&folder).map(|read| read.left_out))
}

fn folder_of_environment() -> Option<PathBuf> {
    std::env::var_os(ENVIRONMENT).filter(|folder| !folder.is_empty()).map(PathBuf::from)
}

fn said_by_environment(file: &Path) -> bool {
    folder_of_environment().is_some_and(|folder| file.starts_with(folder))
}

/// Every profile that is known, by its key, and its file where it has one.
#[must_use]
pub fn all() -> Vec<(Arc<Profile>, Option<PathBuf>)> {
    let known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    known.values().map(|known| (known.profile.clone(), known.file.clone())).collect()
}

/// The profile of this key.
#[must_use]
pub fn find(key: &str) -> Option<(Arc<Profile>, Option<PathBuf>)> {
    of(key).map(|known| (known.profile, known.file))
}

/// What has become of the file of a family since it was read, in words; `None`: nothing, or it is from no file.
///
/// The disk is asked: not for a thread that others wait for.
#[must_use]
pub fn changed(family: Family) -> Option<String> {
    let (key, revision) = (family.capabilities().key, family.revision()?);
    let file = of(key)?.file?;
    let short = short(revision);
    let file_now = file.display();
    match text(&file).map(|text| drive_profile::digest(&text)) {
        Ok(digest) if digest == revision => None,
        Ok(digest) => Some(format!(
            "its profile {key} is {short}, and {file_now} says something else now ({}): it goes on by {short} until the \
             next start of the daemon",
            self::short(&digest)
        )),
        Err(why) => {
            Some(format!("its profile {key} is {short}, and {file_now} cannot be read any more: {why}"))
        }
    }
}

/// As much of a digest as people compare.
#[must_use]
pub fn short(revision: &str) -> &str {
    revision.get(..12).unwrap_or(revision)
}

/// Reads one file.
///
/// # Errors
/// It cannot be read, or it is no profile.
pub fn profile(file: &Path) -> Result<Profile, ProfilesError> {
    let read = text(file).map_err(|why| ProfilesError::File { file: file.to_owned(), why })?;
    drive_profile::read(&read).map_err(|refusals| ProfilesError::Refused { file: file.to_owned(), refusals })
}

/// The text of a file, of which no more is read than a profile may have.
fn text(file: &Path) -> Result<String, String> {
    let open = || {
        if !fs::metadata(file)?.is_file() {
            return Err(std::io::Error::other("it is no file"));
        }
        let mut text = String::new();
        let most = u64::try_from(LONGEST).unwrap_or(u64::MAX).saturating_add(1);
        fs::File::open(file)?.take(most).read_to_string(&mut text)?;
        Ok(text)
    };
    open().map_err(|error: std::io::Error| error.to_string())
}

/// The profiles in a folder and in the folders in it, in the order of their paths.
fn files(folder: &Path) -> Result<Vec<PathBuf>, ProfilesError> {
    let entries = |folder: &Path| -> Result<Vec<PathBuf>, ProfilesError> {
        let failed =
            |error: std::io::Error| ProfilesError::File { file: folder.to_owned(), why: error.to_string() };
        fs::read_dir(folder)
            .map_err(failed)?
            .map(|entry| entry.map(|entry| entry.path()).map_err(failed))
            .collect()
    };
    let mut found = Vec::new();
    for path in entries(folder)? {
        match path.is_dir() {
            true => found.extend(entries(&path)?),
            false => found.push(path),
        }
    }
    found.retain(|path| path.extension() == Some(OsStr::new("toml")) && !path.is_dir());
    found.sort();
    if found.len() > MOST {
        return Err(ProfilesError::TooMany { folder: folder.to_owned(), found: found.len() });
    }
    Ok(found)
}

/// Whether a name belongs to what is no file.
#[must_use]
pub fn is_taken(key: &str) -> bool {
    match of(key) {
        Some(known) => known.file.is_none(),
        None if shipped::find(key).is_some() => true,
        None => Family::all().iter().any(|family| family.capabilities().key.eq_ignore_ascii_case(key)),
    }
}

/// Makes a profile known; one of the same content is known already.
fn take_up(profile: Arc<Profile>, file: &Path) -> Result<(), NameTaken> {
    let known = of(profile.key());
    let same = known.filter(|known| known.profile.digest() == profile.digest());
    let family = match same {
        Some(known) => known.family,
        None => {
            let family = of_content(&profile);
            family.exchange()?;
            family
        }
    };
    keep(Known { family, profile, file: Some(file.to_owned()) });
    Ok(())
}

/// The family of a content, made once: a family lives as long as the program.
fn of_content(profile: &Arc<Profile>) -> Family {
    static MADE: Mutex<BTreeMap<String, Family>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    *made.entry(profile.digest().to_owned()).or_insert_with(|| Family::new(definition(profile)))
}

fn of(key: &str) -> Option<Known> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner).get(key).cloned()
}

fn keep(known: Known) {
    let key = known.profile.key().to_owned();
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(key, known);
}

/// Why profiles cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProfilesError {
    /// A file or a folder cannot be read.
    File {
        file: PathBuf,
        why: String,
    },
    /// A file is no profile.
    Refused {
        file: PathBuf,
        refusals: Refusals,
    },
    /// Its key is that of a family of the program.
    Taken {
        key: String,
        file: PathBuf,
    },
    /// Two files have one key.
    Twice {
        key: String,
        file: PathBuf,
        other: PathBuf,
    },
    TooMany {
        folder: PathBuf,
        found: usize,
    },
}

impl ProfilesError {
    /// The key by which somebody may name the drives of it. Of a file that is no profile it is what a line of it says, or the file's name.
    fn key(&self) -> Option<String> {
        match self {
            Self::Taken { key, .. } | Self::Twice { key, .. } => Some(key.clone()),
            Self::File { file, .. } => Some(file.file_stem()?.to_str()?.to_owned()),
            Self::Refused { file, .. } => {
                let text = text(file).unwrap_or_default();
                let said = text.lines().find_map(|line| {
                    let (key, said) = line.split_once('=')?;
                    (key.trim() == "key").then(|| said.split('"').nth(1).unwrap_or_default().to_owned())
                });
                said.filter(|said| !said.is_empty()).or_else(|| Some(file.file_stem()?.to_str()?.to_owned()))
            }
            Self::TooMany { .. } => None,
        }
    }
}

impl fmt::Display for ProfilesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { file, why } => write!(f, "{}: {why}", file.display()),
            Self::Refused { file, refusals } => {
                let Some(first) = refusals.0.first() else { return write!(f, "{}", file.display()) };
                write!(f, "{}:{}: {}; write {}", file.display(), first.line, first.reason, first.write)?;
                match refusals.0.len() {
                    1 => Ok(()),
                    all => write!(f, " (and {} more: drived profile check {})", all - 1, file.display()),
                }
            }
            Self::Taken { key, file } => write!(
                f,
                "{}: {key:?} is the name of a family that this program has: give the profile another key",
                file.display()
            ),
            Self::Twice { key, file, other } => {
                write!(
                    f,
                    "{}: {} has the key {key:?} too, and neither is taken: give one of them another, or move it out of the folder",
                    file.display(),
                    other.display()
                )
            }
            Self::TooMany { folder, found } => {
                write!(f, "{}: {found} files: expected {MOST} at the most", folder.display())
            }
        }
    }
}

impl std::error::Error for ProfilesError {}

#[cfg(test)]
mod tests;
