//! Unit tests of `orator_study::store::database`.

use orator_study::store::database::{NotStored, ResponseStore, increment};
use rusqlite::Connection;

#[test]
fn work_is_acknowledged_after_its_commit_and_failures_are_not_stored() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("responses.sqlite");
    let (store, thread) = ResponseStore::open(&path, "plan").unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
    let add = |db: &Connection| {
        increment(db, "withdrawn")?;
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
    assert!(format!("{error:#}").contains("a different plan"), "{error:#}");
}
