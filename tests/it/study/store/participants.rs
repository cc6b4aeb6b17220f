//! Participants in the database.

use orator_study::store::answers::{RecordOutcome, SubmittedAnswer, TrialTerms, record};
use orator_study::store::database;
use orator_study::store::participants::{BeginOutcome, NewParticipant, Quota, Status, all, begin, find, latest_ms};
use orator_study::vote::Response;
use rusqlite::Connection;
use std::collections::BTreeMap;

const QUOTA: Quota =
    Quota { n_sessions: 3, target: 2, excluded_from: None, abandoned_ms: 3_600_000, unanswered_ms: 300_000 };

/// Begins the session `name` with this ID of a recruiting site.
fn begin_as(db: &Connection, name: &str, pid: &str, now_ms: i64) -> BeginOutcome {
    let parameters = BTreeMap::from([("PROLIFIC_PID".to_owned(), pid.to_owned())]);
    let (id, language) = (name.to_owned(), "en".to_owned());
    begin(db, &NewParticipant { id, language, parameters, code: String::new() }, QUOTA, now_ms).unwrap()
}

fn session(outcome: &BeginOutcome) -> Option<u32> {
    if let BeginOutcome::Begun(participant) = outcome { Some(participant.session) } else { None }
}

fn answer(db: &Connection, name: &str, now_ms: i64) -> RecordOutcome {
    let response = Response::Number(42);
    let [stalled_secs, unfocused_secs, response_secs] = [0.0; 3];
    let given = SubmittedAnswer { position: 0, response, plays: 1, stalled_secs, unfocused_secs, response_secs };
    let session = find(db, name).unwrap().map_or(0, |participant| participant.session);
    record(db, name, &given, TrialTerms { session, min_ms: 0, is_last: false, fails_check: false }, now_ms).unwrap()
}

fn status(db: &Connection, name: &str) -> Option<Status> {
    find(db, name).unwrap().map(|participant| participant.status)
}

#[test]
fn an_id_neither_resumes_a_session_nor_ends_one_early() {
    let dir = tempfile::tempdir().unwrap();
    let db = database::open(&dir.path().join("responses.sqlite"), "plan").unwrap();
    assert_eq!(session(&begin_as(&db, "first", "p", 1000)), Some(0));
    assert_eq!(session(&begin_as(&db, "first", "p", 2000)), Some(0), "the reply was lost");
    assert_eq!(begin_as(&db, "second", "p", 300_999), BeginOutcome::Known, "in time for the first answer");
    assert_eq!(session(&begin_as(&db, "second", "p", 301_000)), Some(0), "the same session for the same person");
    assert_eq!((status(&db, "first"), answer(&db, "first", 302_000)), (None, RecordOutcome::Unknown));
    assert!(matches!(answer(&db, "second", 303_000), RecordOutcome::Stored(_)));
    assert_eq!(begin_as(&db, "third", "p", 304_000), BeginOutcome::Known);
    assert_eq!(begin_as(&db, "third", "p", 4_000_000), BeginOutcome::Known, "abandoned, but not replaced");
    assert_eq!(session(&begin_as(&db, "other", "q", 4_000_000)), Some(0), "the abandoned session");
    assert_eq!(status(&db, "second"), Some(Status::Replaced), "its answer stays");
    assert_eq!(begin_as(&db, "second", "p", 4_000_000), BeginOutcome::Replaced);
    assert_eq!(session(&begin_as(&db, "third", "p", 4_000_001)), Some(1), "after the session was reassigned");
    assert_eq!(status(&db, "other"), Some(Status::Active), "the new participant keeps the session");
    assert_eq!(begin_as(&db, "last", "r", 4_000_002), BeginOutcome::Full);
    assert_eq!(latest_ms(&db).unwrap(), 4_000_001);
}

#[test]
fn repeated_begins_leave_one_row_and_none_of_another_session() {
    let dir = tempfile::tempdir().unwrap();
    let db = database::open(&dir.path().join("responses.sqlite"), "plan").unwrap();
    for k in 0..50 {
        assert_eq!(session(&begin_as(&db, &format!("own-{k}"), "p", 300_000 * k)), Some(0));
        assert_eq!(begin_as(&db, "early", "p", 300_000 * k + 299_999), BeginOutcome::Known);
    }
    assert_eq!(all(&db).unwrap().len(), 1);
    for k in 50..100 {
        assert_eq!(session(&begin_as(&db, &format!("other-{k}"), "", 300_000 * k)), Some(0));
    }
    let left = all(&db).unwrap();
    assert_eq!(left.iter().map(|participant| participant.id.as_str()).collect::<Vec<_>>(), ["other-99"]);
    // The identifier of a deleted participant may start again; a token of the earlier session stores nothing then.
    assert_eq!(session(&begin_as(&db, "own-0", "p", 29_700_001)), Some(1));
    let response = Response::Number(42);
    let [stalled_secs, unfocused_secs, response_secs] = [0.0; 3];
    let given = SubmittedAnswer { position: 0, response, plays: 1, stalled_secs, unfocused_secs, response_secs };
    let terms = TrialTerms { session: 0, min_ms: 0, is_last: false, fails_check: false };
    assert_eq!(record(&db, "own-0", &given, terms, 29_700_002).unwrap(), RecordOutcome::Unknown);
}
