//! Responses as tables: each answer with what its films showed, and who took part.

use super::file::StudyFile;
use super::folder::StudyFolder;
use super::plan::{FilmContent, PlannedTask, StudyKey, StudyPlan, TaskDesign, Trial, TrialPhase};
use super::response::{Response, ScreenSide};
use super::store::answers::{self, GivenAnswer};
use super::store::database;
use super::store::participants::{self, PARAMETERS, Participant, Status};
use super::vote::StudyVote;
use anyhow::{Context, Result};
use orator_base::stage::workdir;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::json;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Columns of the table of votes, in the order of [`StudyVote`].
const VOTE_COLUMNS: [&str; 15] = [
    "participant",
    "task",
    "design",
    "phase",
    "trial",
    "clip",
    "speaker",
    "conditions",
    "response",
    "expected",
    "stalled_secs",
    "unfocused_secs",
    "response_secs",
    "plays",
    "completed",
];

const PARTICIPANT_COLUMNS: [&str; 8] =
    ["participant", "place", "language", "status", "answers", "failed_checks", "begun_ms", "code"];

/// Form of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableForm {
    /// Columns; several conditions or scores are joined by `|`.
    Csv,
    /// JSON Lines, one object a row.
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

/// Tables that were written.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Exported {
    pub votes: PathBuf,
    pub participants: PathBuf,
    pub n_votes: usize,
    pub n_participants: usize,
}

/// Writes the responses of a study into the folder `out`: `votes` and `participants`. Participants come in the order in
/// which they began, their answers in that of their session.
///
/// # Errors
/// A study without responses, a file of it that cannot be read, a folder that cannot be written.
pub fn export(folder: &StudyFolder, form: TableForm, out: &Path) -> Result<Exported> {
    let joined = JoinedPlan::read(folder)?;
    let db = database::open_to_read(&folder.responses())?;
    // One moment of the database for both tables.
    db.execute_batch("BEGIN")?;
    let all = participants::all(&db)?;
    write_tables(&joined, &all, |participant| Ok(answers::of(&db, &participant.id)?), form, out)
}

fn write_tables(
    joined: &JoinedPlan,
    all: &[Participant],
    mut answers_of: impl FnMut(&Participant) -> Result<Vec<GivenAnswer>>,
    form: TableForm,
    out: &Path,
) -> Result<Exported> {
    let path = |name: &str| out.join(name).with_extension(form.extension());
    let (votes, of_participants) = (path("votes"), path("participants"));
    let mut n_votes = 0;
    workdir::replace(&votes, |attempt| {
        let mut table = TableFile::create(attempt, form, &VOTE_COLUMNS)?;
        for participant in all {
            for answer in answers_of(participant)? {
                let vote = joined.vote(participant, answer)?;
                table.add(&vote, || vote_cells(&vote))?;
                n_votes += 1;
            }
        }
        table.end()
    })?;
    let columns = [&PARTICIPANT_COLUMNS[..], &PARAMETERS].concat();
    workdir::replace(&of_participants, |attempt| {
        let mut table = TableFile::create(attempt, form, &columns)?;
        for participant in all {
            let cells = participant_cells(participant);
            let mut row: serde_json::Map<_, _> =
                columns.iter().zip(&cells).map(|(name, cell)| ((*name).to_owned(), json!(cell))).collect();
            row.insert("place".to_owned(), json!(participant.session + 1));
            row.insert("answers".to_owned(), json!(participant.position));
            row.insert("failed_checks".to_owned(), json!(participant.failed_checks));
            row.insert("begun_ms".to_owned(), json!(participant.begun_ms));
            table.add(&row, || cells)?;
        }
        table.end()
    })?;
    Ok(Exported { votes, participants: of_participants, n_votes, n_participants: all.len() })
}

/// All votes of a study, in the order of [`export`].
///
/// # Errors
/// Those of [`export`].
pub fn votes(folder: &StudyFolder) -> Result<Vec<StudyVote>> {
    let joined = JoinedPlan::read(folder)?;
    let db = database::open_to_read(&folder.responses())?;
    db.execute_batch("BEGIN")?;
    let mut votes = Vec::new();
    for participant in participants::all(&db)? {
        for answer in answers::of(&db, &participant.id)? {
            votes.push(joined.vote(&participant, answer)?);
        }
    }
    Ok(votes)
}

/// Plan and key, by which an answer becomes a vote.
struct JoinedPlan {
    plan: StudyPlan,
    key: StudyKey,
    /// Names of the real conditions.
    real: Vec<String>,
}

impl JoinedPlan {
    fn read(folder: &StudyFolder) -> Result<Self> {
        let file = StudyFile::read(&folder.study_file())?;
        let real = file.condition.into_iter().filter(|condition| condition.real).map(|condition| condition.name);
        Ok(Self { plan: read_json(&folder.plan())?, key: read_json(&folder.key())?, real: real.collect() })
    }

    fn vote(&self, participant: &Participant, answer: GivenAnswer) -> Result<StudyVote> {
        let place = || format!("answer {} of {}: not in plan.json and key.json", answer.position + 1, participant.id);
        let session = self.plan.sessions.get(participant.session as usize).with_context(place)?;
        let trial = session.trials.get(answer.position as usize).with_context(place)?;
        let task = self.plan.tasks.get(trial.task).with_context(place)?;
        let films = trial.films.iter().map(|film| self.key.films.get(film));
        let films = films.collect::<Option<Vec<_>>>().with_context(place)?;
        let first = films.first().with_context(place)?;
        Ok(StudyVote {
            participant: participant.id.clone(),
            task: task.name.clone(),
            design: task.design,
            phase: trial.phase,
            trial: answer.position + 1,
            clip: first.clip.clone(),
            speaker: first.speaker.clone(),
            conditions: films.iter().map(|film| film.condition.clone()).collect(),
            expected: trial.expected.clone().or_else(|| self.expected(trial, task, &films)),
            response: answer.response,
            stalled_secs: answer.stalled_secs,
            unfocused_secs: answer.unfocused_secs,
            response_secs: answer.response_secs,
            plays: answer.plays,
            completed: participant.status == Status::Completed,
        })
    }

    /// Right response of an analysed trial: the real film's, the matched film's.
    fn expected(&self, trial: &Trial, task: &PlannedTask, films: &[&FilmContent]) -> Option<Response> {
        let is_real = |film: &FilmContent| self.real.contains(&film.condition);
        let is_matched = |film: &FilmContent| film.motion_of == film.clip;
        let side_of = |is: &dyn Fn(&FilmContent) -> bool| match films {
            [left, right] if is(left) != is(right) => {
                Some(Response::Side(if is(left) { ScreenSide::Left } else { ScreenSide::Right }))
            }
            _ => None,
        };
        match task.design {
            TaskDesign::Turing => side_of(&is_real),
            TaskDesign::Mismatch => side_of(&is_matched),
            TaskDesign::TuringSingle if trial.films.len() == 1 => Some(Response::Real(is_real(films[0]))),
            TaskDesign::TuringSingle | TaskDesign::Preference | TaskDesign::Sliders => None,
        }
    }
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_slice(&bytes).with_context(|| format!("{} is no file of a study", path.display()))
}

/// Table that is being written, row by row.
enum TableFile {
    Csv(Box<csv::Writer<File>>),
    Jsonl(BufWriter<File>),
}

impl TableFile {
    fn create(path: &Path, form: TableForm, columns: &[&str]) -> Result<Self> {
        let file = File::create(path)?;
        Ok(match form {
            TableForm::Jsonl => Self::Jsonl(BufWriter::new(file)),
            TableForm::Csv => {
                let mut writer = csv::Writer::from_writer(file);
                writer.write_record(columns)?;
                Self::Csv(Box::new(writer))
            }
        })
    }

    fn add(&mut self, row: &impl Serialize, cells: impl FnOnce() -> Vec<String>) -> Result<()> {
        match self {
            Self::Csv(writer) => writer.write_record(cells())?,
            Self::Jsonl(writer) => {
                serde_json::to_writer(&mut *writer, row)?;
                writer.write_all(b"\n")?;
            }
        }
        Ok(())
    }

    fn end(self) -> Result<()> {
        match self {
            Self::Csv(mut writer) => Ok(writer.flush()?),
            Self::Jsonl(mut writer) => Ok(writer.flush()?),
        }
    }
}

fn vote_cells(vote: &StudyVote) -> Vec<String> {
    vec![
        vote.participant.clone(),
        vote.task.clone(),
        word(&vote.design),
        word(&vote.phase),
        vote.trial.to_string(),
        vote.clip.clone(),
        vote.speaker.clone(),
        vote.conditions.join("|"),
        response_cell(&vote.response),
        vote.expected.as_ref().map(response_cell).unwrap_or_default(),
        vote.stalled_secs.to_string(),
        vote.unfocused_secs.to_string(),
        vote.response_secs.to_string(),
        vote.plays.to_string(),
        vote.completed.to_string(),
    ]
}

fn participant_cells(participant: &Participant) -> Vec<String> {
    let own = [
        participant.id.clone(),
        (participant.session + 1).to_string(),
        participant.language.clone(),
        participant.status.word().to_owned(),
        participant.position.to_string(),
        participant.failed_checks.to_string(),
        participant.begun_ms.to_string(),
        participant.code.clone(),
    ];
    let given = PARAMETERS.iter().map(|name| participant.parameters.get(*name).cloned().unwrap_or_default());
    own.into_iter().chain(given).collect()
}

/// Word by which serde writes a plain variant.
fn word(value: &impl Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|word| word.as_str().map(str::to_owned)).unwrap_or_default()
}

/// Response in a cell: `left`, `real`, `-1`, `70|20`, `42`.
fn response_cell(response: &Response) -> String {
    match response {
        Response::Side(side) => word(side),
        Response::Real(is_real) => if *is_real { "real" } else { "generated" }.to_owned(),
        Response::Step(step) => step.to_string(),
        Response::Scores(scores) => scores.iter().map(u8::to_string).collect::<Vec<_>>().join("|"),
        Response::Number(number) => number.to_string(),
    }
}
