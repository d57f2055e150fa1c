//! The tables of the file, and how one of an older version becomes one of this.

use rusqlite::Connection;

use crate::quantity::TABLE;

/// By which `file` and others know the file: `drvd`.
pub const APPLICATION: i32 = 0x6472_7664;

/// One step for each version: the tables of the first, and what each later one changed.
const STEPS: &[&str] = &[FIRST, SECOND, THIRD, FOURTH, FIFTH];

pub(crate) const FIRST: &str = "
CREATE TABLE run (
    id INTEGER PRIMARY KEY,
    began_ms INTEGER NOT NULL,
    ended_ms INTEGER,
    program TEXT NOT NULL
);
CREATE TABLE segment (
    id INTEGER PRIMARY KEY,
    run INTEGER NOT NULL REFERENCES run(id),
    steady_ms INTEGER NOT NULL,
    wall_ms INTEGER NOT NULL
);
CREATE TABLE source (
    id INTEGER PRIMARY KEY,
    drive TEXT NOT NULL,
    part TEXT NOT NULL,
    UNIQUE (drive, part)
);
CREATE TABLE quantity (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL,
    per INTEGER NOT NULL,
    words TEXT
);
CREATE TABLE flush (
    id INTEGER PRIMARY KEY,
    segment INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    end_ms INTEGER NOT NULL
);
CREATE TABLE chunk (
    id INTEGER PRIMARY KEY,
    start_ms INTEGER NOT NULL,
    end_ms INTEGER NOT NULL,
    data BLOB NOT NULL
);
CREATE TABLE block (
    id INTEGER PRIMARY KEY,
    source INTEGER NOT NULL,
    quantity INTEGER NOT NULL,
    segment INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    end_ms INTEGER NOT NULL,
    points INTEGER NOT NULL,
    data BLOB NOT NULL
);
CREATE INDEX block_of ON block (source, quantity, start_ms);
CREATE TABLE minute (
    id INTEGER PRIMARY KEY,
    source INTEGER NOT NULL,
    quantity INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    data BLOB NOT NULL
);
CREATE INDEX minute_of ON minute (source, quantity, start_ms);
CREATE TABLE hour (
    source INTEGER NOT NULL,
    quantity INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    least INTEGER NOT NULL,
    mean REAL NOT NULL,
    greatest INTEGER NOT NULL,
    known_ms INTEGER NOT NULL,
    PRIMARY KEY (source, quantity, start_ms)
) WITHOUT ROWID;
CREATE TABLE record (
    id INTEGER PRIMARY KEY,
    run INTEGER NOT NULL REFERENCES run(id),
    steady_ms INTEGER NOT NULL,
    wall_ms INTEGER NOT NULL,
    kind TEXT NOT NULL,
    what TEXT NOT NULL,
    drive TEXT,
    line TEXT,
    alarm INTEGER NOT NULL,
    text TEXT NOT NULL,
    body TEXT,
    act TEXT UNIQUE
);
CREATE INDEX record_at ON record (wall_ms);
CREATE TABLE frame (
    id INTEGER PRIMARY KEY,
    drive TEXT NOT NULL,
    why TEXT NOT NULL,
    at_ms INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    end_ms INTEGER NOT NULL,
    is_whole INTEGER NOT NULL
);
CREATE INDEX frame_at ON frame (at_ms);
CREATE TABLE frame_block (
    frame INTEGER NOT NULL REFERENCES frame(id),
    quantity INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    end_ms INTEGER NOT NULL,
    data BLOB NOT NULL
);
CREATE INDEX frame_block_of ON frame_block (frame);
CREATE TABLE line_minute (
    wall_ms INTEGER NOT NULL,
    line TEXT NOT NULL,
    sent INTEGER NOT NULL,
    answered INTEGER NOT NULL,
    damaged INTEGER NOT NULL,
    missing INTEGER NOT NULL,
    busy_permille INTEGER NOT NULL,
    is_open INTEGER NOT NULL,
    PRIMARY KEY (wall_ms, line)
) WITHOUT ROWID;
";

/// Age by the daemon's own clock, words for years, hours in packs, settings, and what the line said around a trip.
const SECOND: &str = "
ALTER TABLE run ADD COLUMN lived_ms INTEGER NOT NULL DEFAULT 0;
CREATE TABLE mark (
    id INTEGER PRIMARY KEY,
    lived_ms INTEGER NOT NULL,
    wall_ms INTEGER NOT NULL,
    block INTEGER NOT NULL,
    minute INTEGER NOT NULL,
    record INTEGER NOT NULL,
    frame INTEGER NOT NULL
);
CREATE TABLE change (
    source INTEGER NOT NULL,
    quantity INTEGER NOT NULL,
    at_ms INTEGER NOT NULL,
    segment INTEGER NOT NULL,
    count INTEGER,
    PRIMARY KEY (source, quantity, at_ms)
) WITHOUT ROWID;
CREATE TABLE hours (
    source INTEGER NOT NULL,
    quantity INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    data BLOB NOT NULL,
    PRIMARY KEY (source, quantity, start_ms)
) WITHOUT ROWID;
CREATE TABLE parameter (
    id INTEGER PRIMARY KEY,
    drive TEXT NOT NULL,
    address INTEGER NOT NULL,
    code TEXT NOT NULL,
    word INTEGER NOT NULL,
    text TEXT NOT NULL,
    first_ms INTEGER NOT NULL,
    last_ms INTEGER NOT NULL,
    times INTEGER NOT NULL
);
CREATE INDEX parameter_of ON parameter (drive, address);
CREATE TABLE sent (
    target TEXT PRIMARY KEY,
    segment INTEGER NOT NULL,
    until_ms INTEGER NOT NULL
);
ALTER TABLE frame ADD COLUMN run INTEGER NOT NULL DEFAULT 0;
ALTER TABLE frame ADD COLUMN steady_ms INTEGER NOT NULL DEFAULT 0;
ALTER TABLE frame ADD COLUMN exchanges BLOB;
ALTER TABLE line_minute ADD COLUMN foreigners INTEGER NOT NULL DEFAULT 0;
ALTER TABLE line_minute ADD COLUMN silences INTEGER NOT NULL DEFAULT 0;
ALTER TABLE line_minute ADD COLUMN silence_us INTEGER;
";

/// Chunks in one stream: what was written before has form 1.
const THIRD: &str = "
ALTER TABLE chunk ADD COLUMN form INTEGER NOT NULL DEFAULT 1;
";

/// Quarters of an hour: of a season they are read in a fifteenth of what its minutes are.
const FOURTH: &str = "
CREATE TABLE quarter (
    source INTEGER NOT NULL,
    quantity INTEGER NOT NULL,
    start_ms INTEGER NOT NULL,
    data BLOB NOT NULL,
    PRIMARY KEY (source, quantity, start_ms)
) WITHOUT ROWID;
";

/// What captures have heard around freeze-frames.
const FIFTH: &str = "
ALTER TABLE frame ADD COLUMN line TEXT;
CREATE INDEX frame_on_line ON frame (line, run, steady_ms);
CREATE TABLE captured (
    id INTEGER PRIMARY KEY,
    run INTEGER NOT NULL,
    line TEXT NOT NULL,
    first_ms INTEGER NOT NULL,
    last_ms INTEGER NOT NULL,
    frames INTEGER NOT NULL,
    left_out INTEGER NOT NULL,
    is_cut INTEGER NOT NULL,
    data BLOB NOT NULL
);
CREATE INDEX captured_of ON captured (line, run, first_ms);
";

/// How a file of an older version is read as one of the fifth, by a reader who changes nothing in it.
pub(crate) const CAPTURES_OF_NONE: &str = "
CREATE TEMP VIEW frame AS SELECT *, NULL AS line FROM main.frame;
CREATE TEMP TABLE captured (id INTEGER, run INTEGER, line TEXT, first_ms INTEGER, last_ms INTEGER, frames INTEGER,
    left_out INTEGER, is_cut INTEGER, data BLOB)";
/// How a file of an older version is read as one of the fourth, by a reader who changes nothing in it.
pub(crate) const QUARTERS_OF_NONE: &str =
    "CREATE TEMP TABLE quarter (source INTEGER, quantity INTEGER, start_ms INTEGER, data BLOB)";
/// How chunks of the second version are read as those of the third, by a reader who changes nothing in the file.
pub(crate) const CHUNKS_OF_SECOND: &str =
    "CREATE TEMP VIEW chunk AS SELECT id, start_ms, end_ms, data, 1 AS form FROM main.chunk";

/// The version that is written here.
#[must_use]
pub fn version() -> i64 {
    i64::try_from(STEPS.len()).unwrap_or(i64::MAX)
}

/// The version of a file; zero: it is empty.
///
/// # Errors
/// It cannot be read, or is no file of SQLite.
pub fn version_of(connection: &Connection) -> rusqlite::Result<i64> {
    connection.pragma_query_value(None, "user_version", |row| row.get(0))
}

/// Brings a file that is empty or older to this version, in one step of which all or nothing is done.
///
/// # Errors
/// It cannot be written.
pub fn migrate(connection: &mut Connection) -> rusqlite::Result<()> {
    let from = version_of(connection)?;
    let missing = STEPS.iter().skip(usize::try_from(from).unwrap_or(usize::MAX));
    if missing.len() > 0 {
        let transaction = connection.transaction()?;
        for step in missing {
            transaction.execute_batch(step)?;
        }
        transaction.pragma_update(None, "application_id", APPLICATION)?;
        transaction.pragma_update(None, "user_version", version())?;
        transaction.commit()?;
    }
    name_quantities(connection)
}

/// The names of the quantities, for whoever reads the file without this program. A newer program of the same version may know more.
fn name_quantities(connection: &mut Connection) -> rusqlite::Result<()> {
    let known: i64 = connection.query_row("SELECT count(*) FROM quantity", [], |row| row.get(0))?;
    if usize::try_from(known).is_ok_and(|known| known >= TABLE.len()) {
        return Ok(());
    }
    let transaction = connection.transaction()?;
    for (number, row) in (0_u32..).zip(TABLE) {
        let words = (!row.words.is_empty()).then(|| row.words.join(","));
        transaction.execute(
            "INSERT OR REPLACE INTO quantity (id, name, per, words) VALUES (?1, ?2, ?3, ?4)",
            (number, row.name, row.per, words),
        )?;
    }
    transaction.commit()
}
