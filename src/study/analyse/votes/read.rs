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

    fn of_bytes(bytes: &[u8], is_json: bool, names: &ColumnNames, design: Option<TaskDesign>) -> Result<Self> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vote::ScreenSide;

    fn read(text: &str) -> Result<VotesRead> {
        VotesRead::of_bytes(text.as_bytes(), false, &ColumnNames::default(), None)
    }

    #[test]
    fn a_short_table_of_another_program_is_read() {
        let names = ColumnNames::parse("participant=worker, clip=Stimulus ID,correct=ok").unwrap();
        let text = "\u{feff}Worker;stimulus id;ok;response_secs\r\nw1;c1;1;2,5\r\n\"w;2\";c1;no;3\r\n\r\n";
        let read = VotesRead::of_bytes(text.as_bytes(), false, &names, None).unwrap();
        assert_eq!(read.votes.len(), 2, "{:?}", read.rejected);
        let vote = &read.votes[1];
        assert_eq!((vote.participant.as_str(), vote.trial, vote.task.as_str()), ("w;2", 1, "real-or-generated"));
        assert_eq!(
            (&vote.response, &vote.conditions[1]),
            (&Response::Side(ScreenSide::Right), &"generated".to_owned())
        );
        assert_eq!(read.votes[0].response_secs, 2.5);
        assert!(read.absent.contains(&"completed") && !read.absent.contains(&"clip"));
    }

    #[test]
    fn scores_in_separate_rows_become_pages() {
        let read =
            read("participant,clip,condition,score\na,1,N,80\na,1,M,20\na,2,N,70\nb,1,M,10\nb,1,M,11\n").unwrap();
        assert_eq!(read.votes.len(), 3);
        assert_eq!(read.votes[0].response, Response::Scores(vec![80, 20]));
        assert_eq!((read.votes[0].conditions.join(" "), read.votes[1].trial), ("N M".to_owned(), 2));
        assert_eq!(read.rejected.len(), 1);
        assert_eq!(
            (read.rejected[0].line, read.rejected[0].reason.as_str()),
            (6, "duplicate: b already scored M of 1")
        );
    }

    #[test]
    fn exported_votes_round_trip_in_both_formats() {
        let vote = StudyVote::example(TaskDesign::Sliders, &["N", "M"], Response::Scores(vec![60, 0]));
        let line = serde_json::to_string(&vote).unwrap();
        let json = VotesRead::of_bytes(line.as_bytes(), true, &ColumnNames::default(), None).unwrap();
        assert_eq!(json.votes, std::slice::from_ref(&vote));
        let head = VOTE_COLUMNS.join(",");
        for response in ["\"{\"\"scores\"\":[60,0]}\"", "60|0"] {
            let row = format!("p,t,sliders,main,3,ellen/4,ellen,N|M,{response},,0.5,0,4.25,2,0,true");
            assert_eq!(read(&format!("{head}\n{row}\n")).unwrap().votes, std::slice::from_ref(&vote), "{response}");
        }
    }

    #[test]
    fn rejected_rows_state_line_and_reason() {
        let head = "participant,clip,design,conditions,response,expected,trial\n";
        let rows = [
            ("a,1,turing,x|y,left,right,1", ""),
            ("a,1,turing,x|y,left,right,1", "duplicate: a already answered trial 1 of real-or-generated"),
            ("a,1,turing,x|y,up,right,2", "response is \"up\"; expected left or right"),
            ("a,1,turing,x,left,right,3", "expected two conditions, a response side and an expected side"),
            ("a,1,sliders,x|y,60|101,,4", "expected a score from 0 to 100 for each condition"),
            ("a,1,preference,x|x,1,,5", "expected two different conditions and a step from -2 to 2"),
            ("a,1,tuning,x|y,left,right,6", "design is \"tuning\"; expected turing, turing-single"),
            (",1,turing,x|y,left,right,7", "participant is empty"),
            ("a,,turing,x|y,left,right,8", "clip is empty"),
            ("a,1,turing,x|y,left,right,1.5", "trial is 1.5; expected an integer"),
            ("a,1,turing,x|y,left", "5 cells, but the header has 7"),
            ("a,1,turing,x|y,\"{\"\"side\"\":\"\"up\"\"}\",right,9", "expected an answer like"),
        ];
        let text: String = rows.iter().map(|(row, _)| format!("{row}\n")).collect();
        let read = read(&format!("{head}{text}")).unwrap();
        assert_eq!((read.votes.len(), read.rejected.len()), (1, rows.len() - 1));
        for ((row, (_, reason)), rejected) in rows.iter().enumerate().skip(1).zip(&read.rejected) {
            assert!(rejected.line == row as u64 + 2 && rejected.reason.contains(reason), "{reason}: {rejected:?}");
        }
    }

    #[test]
    fn invalid_tables_are_errors() {
        for (text, expected) in [
            ("", "the file is empty"),
            ("participant,clip,correct\n", "no valid votes in 0 rows"),
            ("participant,clip\na,1\n", "no column with answers"),
            ("worker,clip,correct\na,1,1\n", "column \"participant\" not found"),
            ("participant,participant,clip,correct\na,a,1,1\n", "two columns are named \"participant\""),
            ("participant,clip,correct\na,1,maybe\n", "line 2: correct is \"maybe\"; expected 1 or 0"),
        ] {
            let error = format!("{:#}", read(text).unwrap_err());
            assert!(error.contains(expected), "{expected}: {error}");
        }
        let utf16 = VotesRead::of_bytes(b"\xff\xfea\0", false, &ColumnNames::default(), None).unwrap_err();
        assert!(utf16.to_string().contains("save it as UTF-8"));
        for (columns, expected) in
            [("worker", "invalid pair"), ("who=worker", "unknown field \"who\""), ("clip=", "no column name")]
        {
            assert!(ColumnNames::parse(columns).unwrap_err().to_string().contains(expected), "{expected}");
        }
        let names = ColumnNames::parse("clip=video").unwrap();
        let error = VotesRead::of_bytes(b"participant,clip,correct\na,1,1\n", false, &names, None).unwrap_err();
        assert!(error.to_string().contains("column \"video\" not found"), "{error}");
    }

    #[test]
    fn keys_of_json_lines_match_like_columns_of_csv() {
        let csv = read("Participant, CLIP,Correct\na,1,1\nb,2,0\n").unwrap();
        let lines =
            "{\"Participant\":\"a\",\" CLIP\":1,\"Correct\":1}\n{\"PARTICIPANT\":\"b\",\"clip\":2,\"correct\":0}\n";
        let twice = format!("{lines}{{\"participant\":\"c\",\"clip\":3,\"Clip\":4,\"correct\":1}}\n");
        let json = |text: &str| VotesRead::of_bytes(text.as_bytes(), true, &ColumnNames::default(), None).unwrap();
        assert_eq!(json(lines), csv);
        assert_eq!(json(&twice).rejected[0].reason, "two keys are named \"clip\"");
    }

    #[test]
    fn arbitrary_bytes_do_not_panic() {
        let head = b"participant,clip,condition,score,design,trial\n".to_vec();
        let mut state = 1_u32;
        for n in 0..400 {
            let mut bytes = head.clone();
            for _ in 0..n {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                bytes.push(b"a1,\"\n|;{\xff\xc3-.e\0"[(state >> 24) as usize % 14]);
            }
            let _ = VotesRead::of_bytes(&bytes, n % 2 == 0, &ColumnNames::default(), None);
            let _ = VotesRead::of_bytes(&bytes[head.len()..], true, &ColumnNames::default(), None);
        }
    }
}
