//! Reads a file of votes: CSV or JSON Lines, of any program. Unusable rows are reported with line and reason.

use super::columns::{ColumnNames, delimited_rows, json_rows};
use super::row::{check, vote};
use crate::plan::TaskDesign;
use crate::vote::{Response, StudyVote, VOTE_COLUMNS};
use anyhow::{Context, Result, bail};
use orator_base::input;
use orator_base::text::counted;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Maximum file size, bytes.
const MAX_BYTES: u64 = 1 << 30;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct VotesRead {
    pub votes: Vec<StudyVote>,
    pub rejected: Vec<RejectedRow>,
    /// Fields of exported votes that the source lacks; exclusion rules that need them cannot be applied.
    pub absent: Vec<&'static str>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RejectedRow {
    /// Line in the file, from 1.
    pub line: u64,
    pub reason: String,
}

impl VotesRead {
    /// Checks votes that are already parsed, such as those of a study's own database.
    pub fn of_votes(votes: Vec<StudyVote>) -> Self {
        let mut read = Self::default();
        for (row, vote) in votes.into_iter().enumerate() {
            match check(&vote) {
                Ok(()) => read.votes.push(vote),
                Err(reason) => read.rejected.push(RejectedRow { line: row as u64 + 1, reason }),
            }
        }
        read
    }

    /// Reads a file. `design` applies to rows without a design.
    ///
    /// # Errors
    /// The file cannot be read, is not a table of votes, or contains no valid vote.
    pub fn of_file(path: &Path, names: &ColumnNames, design: Option<TaskDesign>) -> Result<Self> {
        let context = || path.display().to_string();
        let bytes = input::read(path, MAX_BYTES).with_context(context)?;
        let ending = path.extension().unwrap_or_default().to_ascii_lowercase();
        let is_json = ending == "jsonl" || ending == "ndjson" || ending == "json";
        Self::of_bytes(&bytes, is_json, names, design).with_context(context)
    }

    /// As [`Self::of_file`], from the content of the file: lines of JSON, or a table.
    pub fn of_bytes(bytes: &[u8], is_json: bool, names: &ColumnNames, design: Option<TaskDesign>) -> Result<Self> {
        let rows = if is_json { json_rows(bytes, names)? } else { delimited_rows(bytes, names)? };
        let (mut read, mut seen) = (Self::default(), BTreeSet::new());
        let mut pages = SliderPages::default();
        let mut present: BTreeSet<&str> = BTreeSet::new();
        let n_rows = rows.len();
        for (line, row) in rows {
            let row = row.inspect(|cells| present.extend(cells.values.keys().copied()));
            let is_score =
                row.as_ref().is_ok_and(|cells| cells.values.get("score").is_some_and(|cell| !cell.is_empty()));
            let read_vote = row.and_then(|cells| vote(&cells, design)).and_then(|vote| {
                let trial_key = (vote.participant.clone(), vote.task.clone(), vote.trial);
                match is_score || vote.trial == 0 || seen.insert(trial_key) {
                    true => Ok(vote),
                    false => Err(format!(
                        "duplicate: {} already answered trial {} of {}",
                        vote.participant, vote.trial, vote.task
                    )),
                }
            });
            let added = read_vote.and_then(|vote| match is_score {
                true => pages.add(vote, &mut read.votes),
                false => {
                    read.votes.push(vote);
                    Ok(())
                }
            });
            read.rejected.extend(added.err().map(|reason| RejectedRow { line, reason }));
        }
        if read.votes.is_empty() {
            let first = read.rejected.first().map(|row| format!("; line {}: {}", row.line, row.reason));
            bail!("no valid votes in {}{}", counted(n_rows, "row"), first.unwrap_or_default());
        }
        number_trials(&mut read.votes);
        read.absent = VOTE_COLUMNS.into_iter().filter(|field| !present.contains(field)).collect();
        Ok(read)
    }
}

/// Merges slider scores in separate rows into one vote per page.
#[derive(Default)]
struct SliderPages(BTreeMap<(String, String, String, u32), usize>);

impl SliderPages {
    /// Adds a score to the page with the same participant, task, clip and trial.
    fn add(&mut self, vote: StudyVote, votes: &mut Vec<StudyVote>) -> std::result::Result<(), String> {
        let key = (vote.participant.clone(), vote.task.clone(), vote.clip.clone(), vote.trial);
        let page = *self.0.entry(key).or_insert(votes.len());
        let Some(page_vote) = votes.get_mut(page) else {
            votes.push(vote);
            return Ok(());
        };
        if vote.conditions.iter().any(|condition| page_vote.conditions.contains(condition)) {
            let StudyVote { participant, conditions, clip, .. } = vote;
            return Err(format!("duplicate: {participant} already scored {} of {clip}", conditions.join(", ")));
        }
        if let (Response::Scores(all), Response::Scores(one)) = (&mut page_vote.response, vote.response) {
            all.extend(one);
            page_vote.conditions.extend(vote.conditions);
        }
        Ok(())
    }
}

/// Numbers votes without a trial by their position among the participant's votes.
fn number_trials(votes: &mut [StudyVote]) {
    let mut n_trials: BTreeMap<String, u32> = BTreeMap::new();
    for vote in votes {
        let n = n_trials.entry(vote.participant.clone()).or_default();
        *n += 1;
        if vote.trial == 0 {
            vote.trial = *n;
        }
    }
}
