//! Answers in the database.

use orator_study::store::answers::{SubmittedAnswer, TrialStart, TrialTerms, record, record_start, reloads};
use orator_study::store::database;
use orator_study::store::participants::{BeginOutcome, NewParticipant, Quota, begin, withdraw};
use orator_study::vote::Response;
use rusqlite::Connection;
use std::collections::BTreeMap;

const QUOTA: Quota =
    Quota { n_sessions: 1, target: 1, excluded_from: None, abandoned_ms: 3_600_000, unanswered_ms: 300_000 };

fn begun(db: &Connection, name: &str, now_ms: i64) {
    let id = name.to_owned();
    let new = NewParticipant { id, language: "en".to_owned(), parameters: BTreeMap::new(), code: String::new() };
    assert!(matches!(begin(db, &new, QUOTA, now_ms).unwrap(), BeginOutcome::Begun(_)));
}

fn start(db: &Connection, position: u32, load: &str) -> bool {
    record_start(db, "p", 0, &TrialStart { position, load: load.to_owned() }).unwrap()
}

fn n_rows(db: &Connection) -> u32 {
    db.query_row("SELECT COUNT(*) FROM start", [], |row| row.get(0)).unwrap()
}

#[test]
fn only_further_loads_of_the_page_count_as_reloads() {
    let dir = tempfile::tempdir().unwrap();
    let db = database::open(&dir.path().join("responses.sqlite"), "plan").unwrap();
    assert!(!start(&db, 0, "a"), "an unknown participant");
    begun(&db, "p", 0);
    for load in ["a", "a"] {
        assert!(start(&db, 0, load), "a repeated request");
    }
    assert!(
        start(&db, 1, "a") && !record_start(&db, "p", 1, &TrialStart { position: 0, load: "b".to_owned() }).unwrap()
    );
    assert_eq!((reloads(&db, "p").unwrap(), n_rows(&db)), (BTreeMap::new(), 1));
    assert!(start(&db, 0, "b") && start(&db, 0, "c"));
    let [stalled_secs, unfocused_secs, response_secs] = [0.0; 3];
    let response = Response::Number(42);
    let given = SubmittedAnswer { position: 0, response, plays: 1, stalled_secs, unfocused_secs, response_secs };
    let terms = TrialTerms { session: 0, min_ms: 0, is_last: false, fails_check: false };
    record(&db, "p", &given, terms, 1000).unwrap();
    assert!(start(&db, 0, "d"), "a late request is ignored");
    assert_eq!(reloads(&db, "p").unwrap(), BTreeMap::from([(0, 2)]));
    assert!(withdraw(&db, "p").unwrap());
    assert_eq!(n_rows(&db), 0);
    // A participant without answers who loses the session is deleted, with the starts.
    begun(&db, "p", 2000);
    assert!(start(&db, 0, "a"));
    begun(&db, "q", 400_000);
    assert_eq!(n_rows(&db), 0);
}

#[test]
fn a_database_without_starts_is_read_and_extended() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("responses.sqlite");
    let db = database::open(&path, "plan").unwrap();
    begun(&db, "p", 0);
    db.execute_batch("DROP TABLE start").unwrap();
    drop(db);
    let reader = database::open_for_reading(&path).unwrap();
    assert_eq!(reloads(&reader, "p").unwrap(), BTreeMap::new());
    drop(reader);
    let db = database::open(&path, "plan").unwrap();
    assert!(start(&db, 0, "a") && start(&db, 0, "b"));
    assert_eq!(reloads(&database::open_for_reading(&path).unwrap(), "p").unwrap(), BTreeMap::from([(0, 1)]));
}
