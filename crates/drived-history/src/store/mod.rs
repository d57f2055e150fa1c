//! The file: opened, checked, locked against a second daemon, and put aside where it is damaged.

mod outages;
mod place;
pub mod schema;

use std::{
    fs::{File, TryLockError},
    io,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use rusqlite::{Connection, ErrorCode, OpenFlags, types::Type};

use drived_config::kept::Kept;

pub(crate) use self::outages::{outages, write as write_outages};
pub use self::place::Place;

/// What stands behind the name of the file in that of the file that says who writes it.
const LOCK: &str = ".lock";
/// What stands behind the names of the files that SQLite makes beside it.
const BESIDE: [&str; 2] = ["-wal", "-shm"];
/// How long a reader is waited for, who holds up a checkpoint or a change of the tables.
const PATIENCE: Duration = Duration::from_secs(2);

/// The file as its only writer has it.
#[derive(Debug)]
pub struct Store {
    pub connection: Connection,
    /// Held for as long as it is written.
    _lock: File,
}

/// Why a file cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("{} is written by another daemon", .0.display())]
    InUse(PathBuf),
    #[error("{} is of a newer version ({found}, {} is known here): it is left as it is", .path.display(), schema::version())]
    Newer { path: PathBuf, found: i64 },
    #[error("{} is none of this program: it is left as it is", .0.display())]
    Foreign(PathBuf),
    #[error("there is no history yet: {} is not there", .0.display())]
    Missing(PathBuf),
    #[error("{}: {error}", .path.display())]
    File { path: PathBuf, error: io::Error },
    #[error("it is damaged ({0}) and was put aside")]
    Damaged(String),
    #[error(transparent)]
    Sql(#[from] rusqlite::Error),
    #[error(transparent)]
    Column(#[from] crate::column::Damaged),
}

impl StoreError {
    /// Whether what stands in the file cannot be right, so that it is put aside.
    #[must_use]
    pub fn is_damage(&self) -> bool {
        match self {
            Self::Sql(error) => is_damage(error),
            Self::Column(_) => true,
            _ => false,
        }
    }

    /// Whether it is so until somebody does something about the file, so that it is not tried again and again in vain.
    #[must_use]
    pub const fn is_lasting(&self) -> bool {
        matches!(self, Self::Newer { .. } | Self::Foreign(_))
    }
}

fn is_damage(error: &rusqlite::Error) -> bool {
    let code = error.sqlite_error_code();
    let of_sqlite = matches!(code, Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase));
    // What SQLite gives as it stands though nobody here has written it so: a text that is none, a number where a text was.
    let is_other = match error {
        rusqlite::Error::Utf8Error(..) => true,
        rusqlite::Error::InvalidColumnType(_, _, found) => *found != Type::Null,
        _ => false,
    };
    let is_damage = of_sqlite || is_other;
    drive_fleet::mutant!("full-disk-is-damage", is_damage, is_damage || code == Some(ErrorCode::DiskFull))
}

/// A file that was opened to be written.
#[derive(Debug)]
pub struct Opened {
    pub store: Store,
    /// Where a damaged one is now, in whose place this one was begun, and what was wrong with it.
    pub aside: Option<(PathBuf, String)>,
}

/// Opens the file to write it, and makes it where there is none. A damaged one is put aside.
///
/// # Errors
/// [`StoreError`]: nothing was changed.
pub fn open(path: &Path) -> Result<Opened, StoreError> {
    let lock = lock(path)?;
    if drive_fleet::mutant!("past-begun-anew", false, path.exists()) {
        put_aside(path)?;
    }
    match open_locked(path) {
        Ok(connection) => Ok(Opened { store: Store { connection, _lock: lock }, aside: None }),
        Err(error) if error.is_damage() => {
            let aside = put_aside(path)?;
            let connection = open_locked(path)?;
            Ok(Opened { store: Store { connection, _lock: lock }, aside: Some((aside, error.to_string())) })
        }
        Err(error) => Err(error),
    }
}

/// Opens the file to read it; a daemon may write it meanwhile.
///
/// # Errors
/// [`StoreError`]: it is not there, or cannot be read here.
pub fn open_to_read(path: &Path) -> Result<Connection, StoreError> {
    if !path.try_exists().map_err(|error| of_file(path, error))? {
        return Err(StoreError::Missing(path.to_owned()));
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let mut connection = Connection::open_with_flags(path, flags)?;
    connection.busy_timeout(PATIENCE)?;
    let version = match check(&connection, path) {
        // Beside a file without a log SQLite makes an empty one, which it cannot where nothing is written: nobody changes it there either.
        Err(StoreError::Sql(error))
            if error.sqlite_error_code() == Some(ErrorCode::CannotOpen) && !has_log(path) =>
        {
            let unchanging = format!("file:{}?immutable=1", in_uri(path));
            connection = Connection::open_with_flags(unchanging, flags | OpenFlags::SQLITE_OPEN_URI)?;
            check(&connection, path)?
        }
        version => version?,
    };
    if version == 0 {
        return Err(StoreError::Missing(path.to_owned()));
    }
    // It is read as it stands until a daemon brings it to this version.
    if version < 3 {
        connection.execute_batch(schema::CHUNKS_OF_SECOND)?;
    }
    if version < 4 {
        connection.execute_batch(schema::QUARTERS_OF_NONE)?;
    }
    if version < 5 {
        connection.execute_batch(schema::CAPTURES_OF_NONE)?;
    }
    Ok(connection)
}

/// Whether something stands beside a file that is not carried over into it.
fn has_log(path: &Path) -> bool {
    Kept::at(path).beside(BESIDE[0]).path().try_exists().unwrap_or(true)
}

/// A path as a part of a URI.
fn in_uri(path: &Path) -> String {
    path.to_string_lossy().replace('%', "%25").replace('?', "%3F").replace('#', "%23")
}

/// Puts a file aside that is found damaged while it is written; the store is closed first.
///
/// # Errors
/// It cannot be given another name.
pub fn put_aside(path: &Path) -> Result<PathBuf, StoreError> {
    let seconds = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs();
    let kept = Kept::at(path);
    let ending = format!(".damaged-{seconds}");
    // Its log belongs to it: without it the file tells less, and another file would take it for its own.
    for beside in BESIDE {
        kept.beside(beside)
            .rename(&kept.beside(&format!("{ending}{beside}")))
            .map_err(|error| of_file(path, error))?;
    }
    kept.rename(&kept.beside(&ending)).map_err(|error| of_file(path, error))?;
    Ok(kept.beside(&ending).path().to_owned())
}

fn open_locked(path: &Path) -> Result<Connection, StoreError> {
    // Made for its owner alone, and never through a link.
    drop(Kept::at(path).open_to_write().map_err(|error| of_file(path, error))?);
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let mut connection = Connection::open_with_flags(path, flags)?;
    connection.busy_timeout(PATIENCE)?;
    check(&connection, path)?;
    connection.pragma_update(None, "journal_mode", "wal")?;
    // A commit is on the disk when it returns: a power cut loses what was not committed, and nothing else.
    connection.pragma_update(None, "synchronous", "full")?;
    connection.pragma_update(None, "temp_store", "memory")?;
    connection.pragma_update(None, "cache_size", -2_048)?;
    schema::migrate(&mut connection)?;
    Ok(connection)
}

/// The version of a file that this program may use; zero: it is empty.
fn check(connection: &Connection, path: &Path) -> Result<i64, StoreError> {
    let found = schema::version_of(connection)?;
    let application: i32 = connection.pragma_query_value(None, "application_id", |row| row.get(0))?;
    let tables: i64 = connection.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))?;
    match (application, found) {
        (schema::APPLICATION, found) if found > schema::version() => {
            Err(StoreError::Newer { path: path.to_owned(), found })
        }
        (schema::APPLICATION, found) => Ok(found),
        (0, 0) if tables == 0 => Ok(0),
        _ => Err(StoreError::Foreign(path.to_owned())),
    }
}

fn lock(path: &Path) -> Result<File, StoreError> {
    let kept = Kept::at(path).beside(LOCK);
    let file = kept.open_to_write().map_err(|error| of_file(path, error))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(StoreError::InUse(path.to_owned())),
        Err(TryLockError::Error(error)) => Err(of_file(path, error)),
    }
}

fn of_file(path: &Path, error: io::Error) -> StoreError {
    StoreError::File { path: path.to_owned(), error }
}
