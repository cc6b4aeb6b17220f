//! Who takes part: places are given out in the plan's order, those of who left are given again.

use super::database::count_up;
use rusqlite::types::{FromSql, FromSqlError, FromSqlResult, ToSql, ToSqlOutput, ValueRef};
use rusqlite::{Connection, OptionalExtension, Row, params};
use std::collections::{BTreeMap, BTreeSet};

/// What recruiting sites give along (Prolific, Mechanical Turk).
pub const PARAMETERS: [&str; 6] = ["PROLIFIC_PID", "STUDY_ID", "SESSION_ID", "workerId", "assignmentId", "hitId"];

/// Those of them that name a person.
const PERSON: [&str; 2] = ["PROLIFIC_PID", "workerId"];

/// Where a participant stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Answers; or has stopped to, and may go on until the place is given to another.
    Active,
    /// Answered every trial.
    Completed,
    /// Had stopped to answer, and the place was given to another.
    Replaced,
}

impl Status {
    const ALL: [Self; 3] = [Self::Active, Self::Completed, Self::Replaced];

    /// Word in the database and in exports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Active => "active",
            Self::Completed => "completed",
            Self::Replaced => "replaced",
        }
    }
}

impl ToSql for Status {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        Ok(self.word().into())
    }
}

impl FromSql for Status {
    fn column_result(value: ValueRef<'_>) -> FromSqlResult<Self> {
        let word = value.as_str()?;
        Self::ALL.into_iter().find(|status| status.word() == word).ok_or(FromSqlError::InvalidType)
    }
}

/// Participant as stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Participant {
    /// Random name.
    pub id: String,
    /// Index into the plan's sessions.
    pub session: u32,
    pub language: String,
    /// What the recruiting site gave along, such as `PROLIFIC_PID`.
    pub parameters: BTreeMap<String, String>,
    /// Proof of completion, shown at the end.
    pub code: String,
    pub status: Status,
    pub begun_ms: i64,
    /// Number of answers: the index of the next trial.
    pub position: u32,
    /// When that trial was first given out.
    pub given_ms: i64,
    /// Attention checks answered wrongly.
    pub failed_checks: u32,
}

impl Participant {
    const COLUMNS: &str =
        "id, session, language, parameters, code, status, begun_ms, position, given_ms, failed_checks";

    fn of_row(row: &Row) -> rusqlite::Result<Self> {
        let parameters: String = row.get(3)?;
        Ok(Self {
            id: row.get(0)?,
            session: row.get(1)?,
            language: row.get(2)?,
            parameters: serde_json::from_str(&parameters).unwrap_or_default(),
            code: row.get(4)?,
            status: row.get(5)?,
            begun_ms: row.get(6)?,
            position: row.get(7)?,
            given_ms: row.get(8)?,
            failed_checks: row.get(9)?,
        })
    }
}

/// How places are given out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quota {
    /// Sessions of the plan.
    pub n_sessions: u32,
    /// Participants wanted: completed, and not excluded for failed checks.
    pub wanted: u32,
    /// Failed attention checks from which on a participant is excluded.
    pub excluded_from: Option<u32>,
    /// Milliseconds without an answer after which a place is given again.
    pub abandoned_ms: i64,
}

/// How many participants there are, by how far they came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct QuotaCounts {
    pub wanted: u32,
    /// Answered every trial, and not excluded.
    pub completed: u32,
    /// Answered every trial, and excluded for failed checks.
    pub excluded: u32,
    pub active: u32,
    /// Without an answer for so long that their place is free.
    pub abandoned: u32,
    /// Whose place was given to another.
    pub replaced: u32,
    /// Whose data was deleted at their wish.
    pub withdrawn: u32,
}

impl Quota {
    /// Whether `participant` has a place that nobody else may take.
    fn holds(&self, participant: &Participant, now_ms: i64) -> bool {
        match participant.status {
            Status::Active => now_ms - participant.given_ms < self.abandoned_ms,
            Status::Completed => self.excluded_from.is_none_or(|least| participant.failed_checks < least),
            Status::Replaced => false,
        }
    }

    /// Counts `participants`, of whom `withdrawn` have gone.
    pub fn count(&self, participants: &[Participant], withdrawn: u32, now_ms: i64) -> QuotaCounts {
        let mut counts = QuotaCounts { wanted: self.wanted, withdrawn, ..QuotaCounts::default() };
        for participant in participants {
            let holds = self.holds(participant, now_ms);
            *match participant.status {
                Status::Active if holds => &mut counts.active,
                Status::Active => &mut counts.abandoned,
                Status::Completed if holds => &mut counts.completed,
                Status::Completed => &mut counts.excluded,
                Status::Replaced => &mut counts.replaced,
            } += 1;
        }
        counts
    }
}

/// Who begins.
#[derive(Clone, Debug)]
pub struct NewParticipant {
    pub id: String,
    pub language: String,
    pub parameters: BTreeMap<String, String>,
    pub code: String,
}

impl NewParticipant {
    /// Whether the recruiting site gives the same person along.
    fn is(&self, participant: &Participant) -> bool {
        PERSON.iter().any(|name| {
            let person = self.parameters.get(*name).filter(|person| !person.is_empty());
            person.is_some() && person == participant.parameters.get(*name)
        })
    }
}

/// Gives the first free session to `newcomer`; whoever had abandoned it is replaced. Who comes again by the name that the
/// recruiting site gives along is the participant of before. `None`: the study has all the participants wanted.
pub fn begin(
    db: &Connection,
    newcomer: &NewParticipant,
    quota: Quota,
    now_ms: i64,
) -> rusqlite::Result<Option<Participant>> {
    let all = all(db)?;
    if let Some(known) = all.iter().find(|participant| newcomer.is(participant)) {
        return Ok(Some(known.clone()));
    }
    let holders = all.into_iter().filter(|participant| quota.holds(participant, now_ms));
    let taken: BTreeSet<u32> = holders.map(|participant| participant.session).collect();
    let Some(session) = (0..quota.n_sessions).find(|session| !taken.contains(session)) else { return Ok(None) };
    if taken.len() >= quota.wanted as usize {
        return Ok(None);
    }
    let (replaced, active) = (Status::Replaced, Status::Active);
    db.execute(
        "UPDATE participant SET status = ?1 WHERE session = ?2 AND status = ?3",
        params![replaced, session, active],
    )?;
    let parameters = serde_json::to_string(&newcomer.parameters).unwrap_or_default();
    let sql =
        format!("INSERT INTO participant ({}) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, 0, ?7, 0)", Participant::COLUMNS);
    db.execute(&sql, params![newcomer.id, session, newcomer.language, parameters, newcomer.code, active, now_ms])?;
    find(db, &newcomer.id)
}

/// Participant of that name; `None`: never begun, or withdrawn.
pub fn find(db: &Connection, id: &str) -> rusqlite::Result<Option<Participant>> {
    let sql = format!("SELECT {} FROM participant WHERE id = ?1", Participant::COLUMNS);
    db.query_row(&sql, [id], Participant::of_row).optional()
}

/// All participants, the first to begin first.
pub fn all(db: &Connection) -> rusqlite::Result<Vec<Participant>> {
    let sql = format!("SELECT {} FROM participant ORDER BY begun_ms, id", Participant::COLUMNS);
    db.prepare(&sql)?.query_map([], Participant::of_row)?.collect()
}

/// Deletes all of a participant and counts the withdrawal; `false`: there is none of that name.
pub fn withdraw(db: &Connection, id: &str) -> rusqlite::Result<bool> {
    db.execute("DELETE FROM answer WHERE participant = ?1", [id])?;
    let is_known = db.execute("DELETE FROM participant WHERE id = ?1", [id])? > 0;
    if is_known {
        count_up(db, "withdrawn")?;
    }
    Ok(is_known)
}

/// Number of participants who withdrew.
pub fn n_withdrawn(db: &Connection) -> rusqlite::Result<u32> {
    db.query_row("SELECT CAST(value AS INTEGER) FROM about WHERE name = 'withdrawn'", [], |row| row.get(0))
}
