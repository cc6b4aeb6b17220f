//! The one thread that writes: it takes all that waits, does it in one transaction, and answers after the commit.

use super::database;
use anyhow::{Context, Result};
use rusqlite::{Connection, TransactionBehavior};
use std::path::Path;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::{mpsc, oneshot};
use tokio::time::timeout;

/// Pieces of work that one commit holds at most.
const MOST_IN_A_COMMIT: usize = 256;
/// Pieces of work that wait at most; who brings more waits to hand them in.
const MOST_WAITING: usize = 1024;

/// Time until work is refused, the wait of earlier work with it: shorter than a request may take, so that the client is
/// told.
const STORE_TIME: Duration = Duration::from_secs(8);
/// Time that a transaction waits for a lock of another process.
const LOCK_TIME: Duration = Duration::from_secs(3);

/// Tells who waits that the work is committed.
type Acknowledge = Box<dyn FnOnce() + Send>;
type Work = Box<dyn FnOnce(&Connection) -> rusqlite::Result<Acknowledge> + Send>;

struct Job {
    work: Work,
    /// Whether it deletes what must leave no trace.
    erases: bool,
}

/// The work was not committed: a full disk, a database that cannot be written or that another process locks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the response could not be stored")]
pub struct NotStored;

/// Handle of the thread that writes; clones share it.
#[derive(Clone, Debug)]
pub struct ResponseStore {
    jobs: mpsc::Sender<Job>,
}

impl ResponseStore {
    /// Opens the database at `path` for the plan of that hash and starts its thread, which ends after the last handle.
    ///
    /// # Errors
    /// Those of [`database::open`].
    pub fn open(path: &Path, plan: &str) -> Result<(Self, JoinHandle<()>)> {
        let mut db = database::open(path, plan)?;
        db.busy_timeout(LOCK_TIME)?;
        let (jobs, mut waiting) = mpsc::channel(MOST_WAITING);
        let thread = std::thread::Builder::new().name("responses".to_owned());
        let thread = thread.spawn(move || write_all(&mut db, &mut waiting)).context("cannot start a thread")?;
        Ok((Self { jobs }, thread))
    }

    /// Does `work` in a transaction; its value comes after the commit. What fails takes the other work of its
    /// transaction with it: `work` refuses by its value and fails only where the database does.
    ///
    /// # Errors
    /// Nothing of `work` is stored.
    pub async fn write<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Connection) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, NotStored> {
        self.hand_in(false, work).await
    }

    /// Does `work`, which deletes; its value comes when no file holds a byte of what was deleted.
    ///
    /// # Errors
    /// The work, or the erasure, failed.
    pub async fn erase<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Connection) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, NotStored> {
        self.hand_in(true, work).await
    }

    async fn hand_in<T: Send + 'static>(
        &self,
        erases: bool,
        work: impl FnOnce(&Connection) -> rusqlite::Result<T> + Send + 'static,
    ) -> Result<T, NotStored> {
        let (answer, answered) = oneshot::channel();
        let work: Work = Box::new(move |db| {
            // Its client was refused, or has gone; a withdrawal is carried out all the same.
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
        timeout(STORE_TIME, stored).await.unwrap_or(Err(NotStored))
    }
}

fn write_all(db: &mut Connection, waiting: &mut mpsc::Receiver<Job>) {
    let mut holds_deleted = false;
    while let Some(first) = waiting.blocking_recv() {
        let more = std::iter::from_fn(|| waiting.try_recv().ok());
        let batch = std::iter::once(first).chain(more).take(MOST_IN_A_COMMIT);
        // Who waits for work that failed is told by the loss of its channel.
        let Ok((committed, erases)) = commit(db, batch) else { continue };
        holds_deleted |= erases;
        if holds_deleted {
            holds_deleted = database::erase_deleted(db).is_err();
        }
        for (acknowledge, erases) in committed {
            if !(erases && holds_deleted) {
                acknowledge();
            }
        }
    }
}

/// Does a batch in one transaction: what to acknowledge, which of it erases, and whether any does.
fn commit(db: &mut Connection, batch: impl Iterator<Item = Job>) -> rusqlite::Result<(Vec<(Acknowledge, bool)>, bool)> {
    let transaction = db.transaction_with_behavior(TransactionBehavior::Immediate)?;
    let done = batch.map(|job| Ok(((job.work)(&transaction)?, job.erases)));
    let done = done.collect::<rusqlite::Result<Vec<_>>>()?;
    transaction.commit()?;
    let erases = done.iter().any(|(_, erases)| *erases);
    Ok((done, erases))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_answered_after_its_commit_and_a_failure_stores_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("responses.sqlite");
        let (store, thread) = ResponseStore::open(&path, "plan").unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let add = |db: &Connection| {
            database::count_up(db, "withdrawn")?;
            db.query_row("SELECT value FROM about WHERE name = 'withdrawn'", [], |row| row.get::<_, String>(0))
        };
        assert_eq!(runtime.block_on(store.write(add)).unwrap(), "1");
        let failed = runtime.block_on(store.write(move |db| {
            add(db)?;
            db.execute("no SQL", []).map(drop)
        }));
        assert_eq!(failed, Err(NotStored));
        assert_eq!(runtime.block_on(store.erase(add)).unwrap(), "2");
        drop(store);
        thread.join().unwrap();
        let error = ResponseStore::open(&path, "another").unwrap_err();
        assert!(format!("{error:#}").contains("another plan"), "{error:#}");
    }
}
