//! SQLite file of the responses: its tables, opening, secure erasure of deleted rows, and the writer thread, which
//! takes all queued work, runs it in one transaction, and acknowledges it after the commit.

use anyhow::{Context, Result, ensure};
use orator_web::axum::http::StatusCode;
use orator_web::reply::ApiError;
use rusqlite::{Connection, OpenFlags, OptionalExtension, TransactionBehavior, params};
use std::path::Path;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::{mpsc, oneshot};
use tokio::time::timeout;

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

/// Opens the database at `path` for writing and creates it if missing. `plan`: hash of the plan of its sessions.
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

const MAX_JOBS_PER_COMMIT: usize = 256;
/// Maximum number of queued jobs; further callers wait to enqueue.
const MAX_QUEUED: usize = 1024;

/// Timeout of a job including its time in the queue. Shorter than that of a request, so that the client gets a reply.
const STORE_TIMEOUT: Duration = Duration::from_secs(8);
/// Time that a transaction waits for locks of other processes.
const LOCK_TIMEOUT: Duration = Duration::from_secs(3);

/// Notifies the caller that the work is committed.
type Acknowledge = Box<dyn FnOnce() + Send>;
type Work = Box<dyn FnOnce(&Connection) -> rusqlite::Result<Acknowledge> + Send>;

struct Job {
    work: Work,
    /// Whether the job deletes data that must leave no trace.
    erases: bool,
}

/// The work was not committed: the disk is full, or the database is not writable or is locked by another process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the response could not be stored")]
pub struct NotStored;

impl From<NotStored> for ApiError {
    fn from(_: NotStored) -> Self {
        let sentence = "The server cannot store data at the moment; try again.";
        Self::new(StatusCode::SERVICE_UNAVAILABLE, sentence).retry_after(5)
    }
}

/// Handle of the writer thread; clones share it.
#[derive(Clone, Debug)]
pub struct ResponseStore {
    jobs: mpsc::Sender<Job>,
}

impl ResponseStore {
    /// Opens the database at `path` for the plan with this hash and starts the writer, which ends with the last handle.
    ///
    /// # Errors
    /// The database cannot be opened (see [`open`]), or the thread cannot be started.
    pub fn open(path: &Path, plan: &str) -> Result<(Self, JoinHandle<()>)> {
        let mut db = open(path, plan)?;
        db.busy_timeout(LOCK_TIMEOUT)?;
        let (jobs, mut queue) = mpsc::channel(MAX_QUEUED);
        let thread = std::thread::Builder::new().name("responses".to_owned());
        let thread = thread.spawn(move || run_jobs(&mut db, &mut queue)).context("cannot start a thread")?;
        Ok((Self { jobs }, thread))
    }

    /// Runs `work` in a transaction and returns its value after the commit. An error of `work` rolls back the entire
    /// batch, so `work` must report rejections in its value and fail only when the database fails.
    ///
    /// # Errors
    /// The work was not committed, or not within the timeout.
    pub async fn write<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Connection) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, NotStored> {
        self.submit(false, work).await
    }

    /// Runs `work`, which deletes data, and returns its value once no file contains a byte of the deleted data.
    pub async fn erase<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Connection) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, NotStored> {
        self.submit(true, work).await
    }

    async fn submit<T: Send + 'static>(
        &self,
        erases: bool,
        work: impl FnOnce(&Connection) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, NotStored> {
        let (answer, answered) = oneshot::channel();
        let work: Work = Box::new(move |db| {
            // The caller has timed out or disconnected; a withdrawal is carried out nevertheless.
            if answer.is_closed() && !erases {
                return Ok(Box::new(|| ()));
            }
            let value = work(db)?;
            Ok(Box::new(move || drop(answer.send(value))))
        });
        let stored = async {
            self.jobs.send(Job { work, erases }).await.map_err(|_| NotStored)?;
            answered.await.map_err(|_| NotStored)
        };
        timeout(STORE_TIMEOUT, stored).await.unwrap_or(Err(NotStored))
    }
}

fn run_jobs(db: &mut Connection, queue: &mut mpsc::Receiver<Job>) {
    let mut holds_deleted = false;
    while let Some(first) = queue.blocking_recv() {
        let more = std::iter::from_fn(|| queue.try_recv().ok());
        let batch = std::iter::once(first).chain(more).take(MAX_JOBS_PER_COMMIT);
        // On failure, callers are notified by their dropped channels.
        let Ok((committed, erases)) = commit(db, batch) else { continue };
        holds_deleted |= erases;
        if holds_deleted {
            holds_deleted = erase_deleted(db).is_err();
        }
        for (acknowledge, erases) in committed {
            if !(erases && holds_deleted) {
                acknowledge();
            }
        }
    }
}

/// Runs a batch in one transaction. Returns the acknowledgements with their erasure flags, and whether any job erases.
fn commit(db: &mut Connection, batch: impl Iterator<Item = Job>) -> rusqlite::Result<(Vec<(Acknowledge, bool)>, bool)> {
    let transaction = db.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let done = batch.map(|job| Ok(((job.work)(&transaction)?, job.erases)));
    let done = done.collect::<rusqlite::Result<Vec<_>>>()?;
    transaction.commit()?;
    let erases = done.iter().any(|(_, erases)| *erases);
    Ok((done, erases))
}
