//! SQLite file of the responses: its tables, opening, and secure erasure of deleted rows.

use anyhow::{Context, Result, ensure};
use rusqlite::{Connection, OpenFlags, OptionalExtension, params};
use std::path::Path;
use std::time::Duration;

/// Time that a connection waits for locks of other processes.
const BUSY_TIMEOUT: Duration = Duration::from_secs(10);

/// Times are milliseconds since 1970. `position`: number of answers, which is the index of the next trial; `given_ms`:
/// when that trial was first presented. `status`: see [`super::participants::Status`]. `load`: last load of the page in
/// which the films of a trial began; `loads`: number of these loads.
const TABLES: &str = "
    CREATE TABLE IF NOT EXISTS about (name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT, WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS participant (
        id TEXT PRIMARY KEY, session INTEGER NOT NULL, language TEXT NOT NULL, parameters TEXT NOT NULL,
        code TEXT NOT NULL, status TEXT NOT NULL, begun_ms INTEGER NOT NULL, position INTEGER NOT NULL,
        given_ms INTEGER NOT NULL, failed_checks INTEGER NOT NULL
    ) STRICT, WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS answer (
        participant TEXT NOT NULL REFERENCES participant (id), position INTEGER NOT NULL, response TEXT NOT NULL,
        plays INTEGER NOT NULL, stalled_secs REAL NOT NULL, unfocused_secs REAL NOT NULL, response_secs REAL NOT NULL,
        PRIMARY KEY (participant, position)
    ) STRICT, WITHOUT ROWID;
    CREATE TABLE IF NOT EXISTS start (
        participant TEXT NOT NULL REFERENCES participant (id), position INTEGER NOT NULL, load TEXT NOT NULL,
        loads INTEGER NOT NULL, PRIMARY KEY (participant, position)
    ) STRICT, WITHOUT ROWID;
    INSERT OR IGNORE INTO about VALUES ('withdrawn', '0');";

/// Opens the database at `path` for writing and creates it if missing. `plan`: hash of the plan to which its sessions
/// belong.
///
/// # Errors
/// The file is not a database, cannot be written, or belongs to another plan.
pub fn open(path: &Path, plan: &str) -> Result<Connection> {
    let opened = || -> Result<Connection> {
        let db = Connection::open(path)?;
        db.busy_timeout(BUSY_TIMEOUT)?;
        db.pragma_update(None, "secure_delete", true)?;
        db.pragma_update(None, "temp_store", "memory")?;
        let mode: String = db.query_row("PRAGMA journal_mode = wal", [], |row| row.get(0))?;
        ensure!(
            mode == "wal",
            "its file system does not support a write-ahead log (journal mode {mode}); use a local disk"
        );
        // A commit returns after its data have been flushed to disk.
        db.pragma_update(None, "synchronous", "full")?;
        db.execute_batch(TABLES)?;
        db.execute("INSERT OR IGNORE INTO about VALUES ('plan', ?1)", [plan])?;
        let of: String = db.query_row("SELECT value FROM about WHERE name = 'plan'", [], |row| row.get(0))?;
        ensure!(
            of == plan,
            "its responses belong to a different plan than plan.json; move the file away to start with no responses"
        );
        // Completes the erasure of a withdrawal that was interrupted by a kill.
        erase_deleted(&db)?;
        Ok(db)
    };
    opened().with_context(|| format!("cannot open {}", path.display()))
}

/// Opens the database at `path` for reading, while a server may be writing it.
///
/// # Errors
/// There is no database at `path`.
pub fn open_for_reading(path: &Path) -> Result<Connection> {
    ensure!(path.is_file(), "{} does not exist: no participant has started yet", path.display());
    // Writable, because a reader also has to recover the write-ahead log of a killed server.
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let opened = || -> rusqlite::Result<Connection> {
        let db = Connection::open_with_flags(path, flags)?;
        db.busy_timeout(BUSY_TIMEOUT)?;
        db.query_row("SELECT value FROM about WHERE name = 'plan'", [], |row| row.get::<_, String>(0)).optional()?;
        // Databases of earlier versions have no starts; a temporary table leaves the file as it is.
        let has_starts = "SELECT COUNT(*) > 0 FROM sqlite_master WHERE name = 'start'";
        if !db.query_row(has_starts, [], |row| row.get::<_, bool>(0))? {
            db.pragma_update(None, "temp_store", "memory")?;
            db.execute_batch("CREATE TEMP TABLE start (participant TEXT, position INTEGER, loads INTEGER)")?;
        }
        Ok(db)
    };
    opened().with_context(|| format!("cannot read {}: is it the database of `orator study serve`?", path.display()))
}

/// Rebuilds the database and truncates its log, so that neither contains bytes of deleted rows.
///
/// # Errors
/// The disk is full, or a reader blocks the checkpoint.
pub fn erase_deleted(db: &Connection) -> rusqlite::Result<()> {
    db.execute_batch("VACUUM")?;
    let is_busy: bool = db.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |row| row.get(0))?;
    if is_busy {
        let busy = rusqlite::ffi::Error::new(rusqlite::ffi::SQLITE_BUSY);
        return Err(rusqlite::Error::SqliteFailure(busy, Some("the log is being read".to_owned())));
    }
    Ok(())
}

/// Increments a counter of the table `about`.
pub fn increment(db: &Connection, name: &str) -> rusqlite::Result<()> {
    db.execute("UPDATE about SET value = value + 1 WHERE name = ?1", params![name]).map(drop)
}
