//! Participants: sessions are assigned in the plan's order, and those of participants who left are reassigned. A
//! participant without answers who loses the session is deleted, so that requests to begin cannot fill the database.

use super::database::increment;
use rusqlite::types::{FromSql, FromSqlError, FromSqlResult, ToSql, ToSqlOutput, ValueRef};
use rusqlite::{Connection, OptionalExtension, Row, params};
use std::collections::{BTreeMap, BTreeSet};

/// URL parameters of recruiting sites (Prolific, Mechanical Turk).
pub const PARAMETERS: [&str; 6] = ["PROLIFIC_PID", "STUDY_ID", "SESSION_ID", "workerId", "assignmentId", "hitId"];

/// Parameters that identify a person.
const PERSON_IDS: [&str; 2] = ["PROLIFIC_PID", "workerId"];

#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// In progress; an abandoned session stays active until it is reassigned.
    Active,
    /// Every trial is answered.
    Completed,
    /// Abandoned after an answer and reassigned to another participant.
    Replaced,
}

impl Status {
    const ALL: [Self; 3] = [Self::Active, Self::Completed, Self::Replaced];

    pub fn name(self) -> &'static str {
        match self {
            Self::Active => "active",
            Self::Completed => "completed",
            Self::Replaced => "replaced",
        }
    }
}

impl ToSql for Status {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        Ok(self.name().into())
    }
}

impl FromSql for Status {
    fn column_result(value: ValueRef<'_>) -> FromSqlResult<Self> {
        let name = value.as_str()?;
        Self::ALL.into_iter().find(|status| status.name() == name).ok_or(FromSqlError::InvalidType)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Participant {
    /// Random identifier, or the one derived from the page's attempt to begin.
    pub id: String,
    /// Index into the plan's sessions.
    pub session: u32,
    pub language: String,
    /// Parameters of the recruiting site, such as `PROLIFIC_PID`.
    pub parameters: BTreeMap<String, String>,
    /// Completion code, shown at the end.
    pub code: String,
    pub status: Status,
    pub begun_ms: i64,
    /// Number of answers, which is the index of the next trial.
    pub position: u32,
    /// Time at which that trial was first presented, milliseconds since 1970.
    pub given_ms: i64,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quota {
    pub n_sessions: u32,
    /// Target number of participants who complete the study and are not excluded for failed checks.
    pub target: u32,
    /// Minimum number of failed attention checks that excludes a participant; `None`: no exclusion.
    pub excluded_from: Option<u32>,
    /// Time without a further answer after which a session may be reassigned, milliseconds.
    pub abandoned_ms: i64,
    /// Time without an answer after which a session may be reassigned, milliseconds; or `abandoned_ms` if shorter.
    pub unanswered_ms: i64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct QuotaCounts {
    pub target: u32,
    /// Completed and not excluded.
    pub completed: u32,
    /// Completed, but excluded for failed checks.
    pub excluded: u32,
    pub active: u32,
    /// Active, but idle for so long that the session may be reassigned.
    pub abandoned: u32,
    /// Replaced by another participant after an answer.
    pub replaced: u32,
    /// Data deleted on request.
    pub withdrawn: u32,
}

impl Quota {
    /// Whether the session of `participant` must not be reassigned.
    fn holds(&self, participant: &Participant, now_ms: i64) -> bool {
        match participant.status {
            Status::Active => {
                let is_unanswered = participant.position == 0;
                let max_ms = if is_unanswered { self.unanswered_ms } else { i64::MAX }.min(self.abandoned_ms);
                now_ms - participant.given_ms < max_ms
            }
            Status::Completed => self.excluded_from.is_none_or(|n| participant.failed_checks < n),
            Status::Replaced => false,
        }
    }

    /// Counts `participants` by status; `withdrawn` participants are no longer among them.
    pub fn count(&self, participants: &[Participant], withdrawn: u32, now_ms: i64) -> QuotaCounts {
        let mut counts = QuotaCounts { target: self.target, withdrawn, ..QuotaCounts::default() };
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

#[derive(Clone, Debug)]
pub struct NewParticipant {
    pub id: String,
    pub language: String,
    pub parameters: BTreeMap<String, String>,
    pub code: String,
}

impl NewParticipant {
    /// IDs from recruiting sites, by parameter.
    fn ids(&self) -> impl Iterator<Item = (&str, &String)> {
        PERSON_IDS.into_iter().filter_map(|name| Some((name, self.parameters.get(name).filter(|id| !id.is_empty())?)))
    }

    pub fn has_id(&self) -> bool {
        self.ids().next().is_some()
    }

    fn has_same_id(&self, participant: &Participant) -> bool {
        self.ids().any(|(name, id)| participant.parameters.get(name) == Some(id))
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum BeginOutcome {
    /// Session assigned now, or earlier to the same identifier.
    Begun(Participant),
    /// The identifier is that of a participant who was replaced.
    Replaced,
    /// A session that has answers or is still held has the same ID. Only its token resumes it: anybody can send an ID.
    Known,
    /// The study has all its participants.
    Full,
}

/// Assigns the first free session to `new_participant`, unless its identifier has a session already: the page repeats a
/// request whose reply was lost. An abandoned participant of the assigned session is marked as replaced, or deleted if
/// there are no answers; so is one with the same ID who has not given the first answer in time.
pub fn begin(
    db: &Connection,
    new_participant: &NewParticipant,
    quota: Quota,
    now_ms: i64,
) -> rusqlite::Result<BeginOutcome> {
    if let Some(participant) = find(db, &new_participant.id)? {
        let is_replaced = participant.status == Status::Replaced;
        return Ok(if is_replaced { BeginOutcome::Replaced } else { BeginOutcome::Begun(participant) });
    }
    let (replaced, active) = (Status::Replaced, Status::Active);
    let current = select(db, &format!("WHERE status <> '{}'", replaced.name()))?;
    let (own, others): (Vec<_>, Vec<_>) =
        current.into_iter().partition(|participant| new_participant.has_same_id(participant));
    if own.iter().any(|participant| participant.position > 0 || quota.holds(participant, now_ms)) {
        return Ok(BeginOutcome::Known);
    }
    let holders = others.into_iter().filter(|participant| quota.holds(participant, now_ms));
    let taken: BTreeSet<u32> = holders.map(|participant| participant.session).collect();
    let free = (0..quota.n_sessions).find(|session| !taken.contains(session));
    let Some(session) = free.filter(|_| taken.len() < quota.target as usize) else { return Ok(BeginOutcome::Full) };
    let silent = "session = ?1 AND status = ?2 AND position = 0";
    for given_up in own.iter().map(|participant| participant.session).chain([session]) {
        for sql in [
            format!("DELETE FROM start WHERE participant IN (SELECT id FROM participant WHERE {silent})"),
            format!("DELETE FROM participant WHERE {silent}"),
        ] {
            db.execute(&sql, params![given_up, active])?;
        }
        db.execute(
            "UPDATE participant SET status = ?1 WHERE session = ?2 AND status = ?3",
            params![replaced, given_up, active],
        )?;
    }
    let parameters = serde_json::to_string(&new_participant.parameters).unwrap_or_default();
    let sql =
        format!("INSERT INTO participant ({}) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, 0, ?7, 0)", Participant::COLUMNS);
    db.execute(
        &sql,
        params![
            new_participant.id,
            session,
            new_participant.language,
            parameters,
            new_participant.code,
            active,
            now_ms
        ],
    )?;
    find(db, &new_participant.id)?.map(BeginOutcome::Begun).ok_or(rusqlite::Error::QueryReturnedNoRows)
}

/// Participant with this identifier; `None` if unknown, withdrawn, or deleted before the first answer.
pub fn find(db: &Connection, id: &str) -> rusqlite::Result<Option<Participant>> {
    let sql = format!("SELECT {} FROM participant WHERE id = ?1", Participant::COLUMNS);
    db.query_row(&sql, [id], Participant::of_row).optional()
}

pub fn all(db: &Connection) -> rusqlite::Result<Vec<Participant>> {
    select(db, "")
}

/// Participants that fulfil an SQL `condition`, in order of start time.
fn select(db: &Connection, condition: &str) -> rusqlite::Result<Vec<Participant>> {
    let sql = format!("SELECT {} FROM participant {condition} ORDER BY begun_ms, id", Participant::COLUMNS);
    db.prepare(&sql)?.query_map([], Participant::of_row)?.collect()
}

/// Deletes all data of a participant and counts the withdrawal; `false` if the identifier is unknown.
pub fn withdraw(db: &Connection, id: &str) -> rusqlite::Result<bool> {
    db.execute("DELETE FROM answer WHERE participant = ?1", [id])?;
    db.execute("DELETE FROM start WHERE participant = ?1", [id])?;
    let is_known = db.execute("DELETE FROM participant WHERE id = ?1", [id])? > 0;
    if is_known {
        increment(db, "withdrawn")?;
    }
    Ok(is_known)
}

/// Latest time at which a participant began or answered, milliseconds since 1970; 0 without participants.
pub fn latest_ms(db: &Connection) -> rusqlite::Result<i64> {
    let sql = "SELECT COALESCE(MAX(MAX(begun_ms, given_ms)), 0) FROM participant";
    db.query_row(sql, [], |row| row.get(0))
}

pub fn n_withdrawn(db: &Connection) -> rusqlite::Result<u32> {
    db.query_row("SELECT CAST(value AS INTEGER) FROM about WHERE name = 'withdrawn'", [], |row| row.get(0))
}
