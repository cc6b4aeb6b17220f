//! Stored answers: one per trial, in the order of the session, never changed. Starts of trials: in how many loads of
//! the page the films of a trial began to play; with more than one, the page was reloaded and films were seen again.

use super::participants::{Participant, Status, find};
use crate::vote::Response;
use rusqlite::{Connection, OptionalExtension, Row, params};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubmittedAnswer {
    pub position: u32,
    pub response: Response,
    /// Number of times the films were played.
    pub plays: u32,
    /// Seconds during which playback was stalled for lack of data.
    pub stalled_secs: f64,
    /// Seconds during which the page was hidden or unfocused.
    pub unfocused_secs: f64,
    /// Seconds from the end of the films to the answer.
    pub response_secs: f64,
}

/// Properties of a trial that decide how its answer is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrialTerms {
    /// Session of the trial. A participant who began anew may have another one than an earlier token names.
    pub session: u32,
    /// Minimum time from the trial's first presentation to its answer, milliseconds: before, its films cannot be over.
    pub min_ms: i64,
    pub is_last: bool,
    pub fails_check: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub enum RecordOutcome {
    /// The answer is stored, now or earlier; current state of the participant.
    Stored(Participant),
    /// The participant is unknown in this session: withdrawn, or deleted before the first answer.
    Unknown,
    /// The session was reassigned to another participant.
    Replaced,
    /// A different answer is stored at this position.
    Differs,
    /// The trial has not been presented yet.
    OutOfOrder,
    /// The films cannot have been watched yet; remaining milliseconds.
    TooEarly(i64),
}

/// Stores `answer` of the participant `id`.
pub fn record(
    db: &Connection,
    id: &str,
    answer: &SubmittedAnswer,
    terms: TrialTerms,
    now_ms: i64,
) -> rusqlite::Result<RecordOutcome> {
    let found = find(db, id)?.filter(|participant| participant.session == terms.session);
    let Some(participant) = found else { return Ok(RecordOutcome::Unknown) };
    if answer.position < participant.position {
        let is_same = at(db, id, answer.position)?.is_some_and(|stored| stored == *answer);
        return Ok(if is_same { RecordOutcome::Stored(participant) } else { RecordOutcome::Differs });
    }
    if participant.status == Status::Replaced {
        return Ok(RecordOutcome::Replaced);
    }
    if answer.position > participant.position || participant.status == Status::Completed {
        return Ok(RecordOutcome::OutOfOrder);
    }
    let left_ms = terms.min_ms - (now_ms - participant.given_ms);
    if left_ms > 0 {
        return Ok(RecordOutcome::TooEarly(left_ms));
    }
    insert(db, id, answer)?;
    let after = Participant {
        position: participant.position + 1,
        given_ms: now_ms,
        failed_checks: participant.failed_checks + u32::from(terms.fails_check),
        status: if terms.is_last { Status::Completed } else { Status::Active },
        ..participant
    };
    let sql = "UPDATE participant SET position = ?2, given_ms = ?3, failed_checks = ?4, status = ?5 WHERE id = ?1";
    db.execute(sql, params![id, after.position, after.given_ms, after.failed_checks, after.status])?;
    Ok(RecordOutcome::Stored(after))
}

/// Inserts the row of an answer.
///
/// # Errors
/// The database fails, or an answer exists at that position.
pub fn insert(db: &Connection, id: &str, answer: &SubmittedAnswer) -> rusqlite::Result<()> {
    let response = serde_json::to_string(&answer.response).unwrap_or_default();
    let sql = "INSERT INTO answer VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
    let secs = [answer.stalled_secs, answer.unfocused_secs, answer.response_secs];
    db.execute(sql, params![id, answer.position, response, answer.plays, secs[0], secs[1], secs[2]]).map(drop)
}

const COLUMNS: &str = "position, response, plays, stalled_secs, unfocused_secs, response_secs";

fn of_row(row: &Row) -> rusqlite::Result<SubmittedAnswer> {
    let response: String = row.get(1)?;
    let unreadable = |error| rusqlite::Error::FromSqlConversionFailure(1, rusqlite::types::Type::Text, Box::new(error));
    Ok(SubmittedAnswer {
        position: row.get(0)?,
        response: serde_json::from_str(&response).map_err(unreadable)?,
        plays: row.get(2)?,
        stalled_secs: row.get(3)?,
        unfocused_secs: row.get(4)?,
        response_secs: row.get(5)?,
    })
}

fn at(db: &Connection, id: &str, position: u32) -> rusqlite::Result<Option<SubmittedAnswer>> {
    let sql = format!("SELECT {COLUMNS} FROM answer WHERE participant = ?1 AND position = ?2");
    db.query_row(&sql, params![id, position], of_row).optional()
}

pub fn of(db: &Connection, id: &str) -> rusqlite::Result<Vec<SubmittedAnswer>> {
    let sql = format!("SELECT {COLUMNS} FROM answer WHERE participant = ?1 ORDER BY position");
    db.prepare(&sql)?.query_map([id], of_row)?.collect()
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StallCount {
    pub trials: u32,
    pub secs: f64,
}

pub fn stalls(db: &Connection) -> rusqlite::Result<StallCount> {
    let sql = "SELECT COUNT(*), TOTAL(stalled_secs) FROM answer WHERE stalled_secs > 0";
    db.query_row(sql, [], |row| Ok(StallCount { trials: row.get(0)?, secs: row.get(1)? }))
}

/// Start of a trial's films as sent by a page.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrialStart {
    /// Index of the trial in its session.
    pub position: u32,
    /// Random number of the load of the page.
    pub load: String,
}

/// Counts the start unless the same load of the page has sent it already; returns whether the participant `id` is known
/// in this session. Starts of other trials than the current one are ignored.
pub fn record_start(db: &Connection, id: &str, session: u32, start: &TrialStart) -> rusqlite::Result<bool> {
    let found = find(db, id)?.filter(|participant| participant.session == session);
    let Some(participant) = found else { return Ok(false) };
    if participant.status == Status::Active && participant.position == start.position {
        // One row per trial, so that requests cannot fill the database.
        let sql = "INSERT INTO start VALUES (?1, ?2, ?3, 1) ON CONFLICT (participant, position) \
            DO UPDATE SET load = excluded.load, loads = loads + 1 WHERE load <> excluded.load";
        db.execute(sql, params![id, start.position, start.load])?;
    }
    Ok(true)
}

/// Number of reloads of a participant after a film began, by position of the trial; trials without any are absent.
pub fn reloads(db: &Connection, id: &str) -> rusqlite::Result<BTreeMap<u32, u32>> {
    let sql = "SELECT position, loads - 1 FROM start WHERE participant = ?1 AND loads > 1";
    db.prepare(sql)?.query_map([id], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
}
