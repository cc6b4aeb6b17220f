//! Export of responses as tables: each answer with the content of its films, and the participants.

use super::design::right_response;
use super::file::StudyFile;
use super::folder::{StudyFolder, read_json};
use super::plan::{StudyKey, StudyPlan, TaskDesign};
use super::store::answers::{self, SubmittedAnswer};
use super::store::database;
use super::store::participants::{self, PARAMETERS, Participant, Status};
use super::vote::{Response, StudyVote, VOTE_COLUMNS};
use anyhow::{Context, Result};
use orator_base::stage::workdir;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Columns of the table of participants, followed by the parameters of recruiting sites.
const PARTICIPANT_COLUMNS: [&str; 8] =
    ["participant", "place", "language", "status", "answers", "failed_checks", "begun_ms", "code"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableForm {
    /// Comma-separated values; multiple conditions or scores are joined by `|`.
    Csv,
    /// JSON Lines, one object per row.
    Jsonl,
}

impl TableForm {
    fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Jsonl => "jsonl",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExportSummary {
    pub votes: PathBuf,
    pub participants: PathBuf,
    pub n_votes: usize,
    pub n_participants: usize,
}

/// Writes the responses of a study into the folder `out` as the tables `votes` and `participants`. Participants are
/// ordered by start time, their answers by position in the session.
///
/// # Errors
/// The study has no responses, one of its files cannot be read, or the folder cannot be written.
pub fn export(folder: &StudyFolder, form: TableForm, out: &Path) -> Result<ExportSummary> {
    let (participants, votes) = responses(folder)?;
    let path = |name: &str| out.join(name).with_extension(form.extension());
    let (votes_file, participants_file) = (path("votes"), path("participants"));
    write_table(&votes_file, form, &VOTE_COLUMNS, &votes)?;
    let rows: Vec<Map<String, Value>> = participants.iter().map(participant_row).collect();
    write_table(&participants_file, form, &[&PARTICIPANT_COLUMNS[..], &PARAMETERS].concat(), &rows)?;
    Ok(ExportSummary {
        votes: votes_file,
        participants: participants_file,
        n_votes: votes.len(),
        n_participants: participants.len(),
    })
}

pub fn responses(folder: &StudyFolder) -> Result<(Vec<Participant>, Vec<StudyVote>)> {
    let joined = JoinedPlan::read(folder)?;
    let db = database::open_for_reading(&folder.responses())?;
    // A single read transaction gives a consistent snapshot of participants and answers.
    db.execute_batch("BEGIN")?;
    let (all, mut votes) = (participants::all(&db)?, Vec::new());
    for participant in &all {
        let reloads = answers::reloads(&db, &participant.id)?;
        for answer in answers::of(&db, &participant.id)? {
            let reloads = reloads.get(&answer.position).copied().unwrap_or_default();
            votes.push(joined.vote(participant, answer, reloads)?);
        }
    }
    Ok((all, votes))
}

/// Plan, key and study file, joined to turn an answer into a vote.
struct JoinedPlan {
    plan: StudyPlan,
    key: StudyKey,
    file: StudyFile,
}

impl JoinedPlan {
    fn read(folder: &StudyFolder) -> Result<Self> {
        let file = StudyFile::read(&folder.study_file())?;
        Ok(Self { plan: read_json(&folder.plan())?, key: read_json(&folder.key())?, file })
    }

    /// Correct response of an analysed trial, from the conditions of its avatars.
    fn right_response(&self, design: TaskDesign, conditions: &[String]) -> Option<Response> {
        let shown: Option<Vec<_>> = conditions.iter().map(|name| self.file.find_condition(name)).collect();
        right_response(design, &shown?)
    }

    fn vote(&self, participant: &Participant, answer: SubmittedAnswer, reloads: u32) -> Result<StudyVote> {
        let context = || {
            format!(
                "answer {} of the participant {} is not in plan.json and key.json: restore the files of the build",
                answer.position + 1,
                participant.id
            )
        };
        let session = self.plan.sessions.get(participant.session as usize).with_context(context)?;
        let trial = session.trials.get(answer.position as usize).with_context(context)?;
        let task = self.plan.tasks.get(trial.task).with_context(context)?;
        let films = trial.films.iter().map(|film| self.key.films.get(film));
        let films = films.collect::<Option<Vec<_>>>().with_context(context)?;
        let first = films.first().with_context(context)?;
        let conditions = films.iter().flat_map(|film| film.conditions()).map(str::to_owned);
        let conditions: Vec<String> = conditions.collect();
        Ok(StudyVote {
            participant: participant.id.clone(),
            task: task.name.clone(),
            design: task.design,
            phase: trial.phase,
            trial: answer.position + 1,
            clip: first.clip.clone(),
            speaker: first.speaker.clone(),
            expected: trial.expected.clone().or_else(|| self.right_response(task.design, &conditions)),
            conditions,
            response: answer.response,
            stalled_secs: answer.stalled_secs,
            unfocused_secs: answer.unfocused_secs,
            response_secs: answer.response_secs,
            plays: answer.plays,
            reloads,
            completed: participant.status == Status::Completed,
        })
    }
}

fn participant_row(participant: &Participant) -> Map<String, Value> {
    let own = [
        json!(participant.id),
        json!(participant.session + 1),
        json!(participant.language),
        json!(participant.status),
        json!(participant.position),
        json!(participant.failed_checks),
        json!(participant.begun_ms),
        json!(participant.code),
    ];
    let given = PARAMETERS.map(|name| json!(participant.parameters.get(name).map_or("", String::as_str)));
    let columns = PARTICIPANT_COLUMNS.into_iter().chain(PARAMETERS).map(str::to_owned);
    columns.zip(own.into_iter().chain(given)).collect()
}

/// Writes a table atomically; each row must serialise as an object with these columns.
fn write_table(path: &Path, form: TableForm, columns: &[&str], rows: &[impl Serialize]) -> Result<()> {
    workdir::replace(path, |attempt| {
        let mut file = BufWriter::new(File::create(attempt)?);
        match form {
            TableForm::Csv => {
                let mut writer = csv::Writer::from_writer(&mut file);
                writer.write_record(columns)?;
                for row in rows {
                    let Value::Object(row) = serde_json::to_value(row)? else { continue };
                    writer.write_record(row.values().map(cell))?;
                }
                writer.flush()?;
            }
            TableForm::Jsonl => {
                for row in rows {
                    serde_json::to_writer(&mut file, row)?;
                    file.write_all(b"\n")?;
                }
            }
        }
        Ok(file.flush()?)
    })
}

/// Text of a CSV cell. Array elements are joined by `|`; a response is reduced to its value: `left`, `real`, `-1`,
/// `70|20`, `42`.
fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::Bool(is_so) => is_so.to_string(),
        Value::Number(number) => number.as_f64().unwrap_or(f64::NAN).to_string(),
        Value::String(text) => text.clone(),
        Value::Array(parts) => parts.iter().map(cell).collect::<Vec<_>>().join("|"),
        Value::Object(response) => match response.get("real") {
            Some(is_real) => if *is_real == json!(true) { "real" } else { "generated" }.to_owned(),
            None => response.values().map(cell).collect(),
        },
    }
}
